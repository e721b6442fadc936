"""Four-bars through poses: known ones come back, defects are named as the motion shows them."""

from __future__ import annotations

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import dyads, four_bars_for_poses
from graphsynth.design.poses.linkages import linkage_of

from .planted import planted

CRANK = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1))
ANGLES = np.array([0.3, 0.9, 1.7, 2.6, 3.3])


def of(mechanism, inputs):
    """Poses of the coupler."""
    return mechanism.simulate(np.asarray(inputs)).poses[:, 2].tolist()


def like(linkage, pivots):
    found = {tuple(np.round(dyad.pivot, 6) + 0.0) for dyad in linkage.dyads}
    return found == {tuple(np.round(p, 6) + 0.0) for p in pivots}


def test_a_known_crank_rocker_comes_back():
    found = four_bars_for_poses(of(CRANK, ANGLES))
    assert found.complete and len(found) in (1, 3, 6)
    [own] = [one for one in found if like(one, ((0, 0), (2, 0)))]
    assert own.defects == () and own.rotates and own.miss < 1e-12
    assert np.allclose(own.inputs, ANGLES) and own.transmission == pytest.approx(
        0.43775, abs=1e-5
    )  # where the crank starts
    lengths = [dyad.length for dyad in own.dyads]
    assert np.allclose(lengths, [1, 2.5])
    proof = own.certify()
    assert proof.certified and proof.intervals.all()
    assert np.allclose(own.mechanism.simulate(ANGLES).poses[:, 2], of(CRANK, ANGLES), atol=1e-10)
    assert "no defect" in repr(found) and "turns fully" in repr(own)


def test_other_order_of_the_same_poses_is_an_order_defect():
    poses = of(CRANK, ANGLES)
    found = four_bars_for_poses([poses[k] for k in (0, 2, 1, 3, 4)])
    [own] = [one for one in found if like(one, ((0, 0), (2, 0)))]
    assert own.defects == ("order",) and own.miss < 1e-12 and own.transmission == 0.0
    turned = four_bars_for_poses([poses[k] for k in (3, 4, 0, 1, 2)])  # a crank may begin anywhere
    [own] = [one for one in turned if like(one, ((0, 0), (2, 0)))]
    assert own.defects == ()
    back = four_bars_for_poses(poses[::-1])
    [own] = [one for one in back if like(one, ((0, 0), (2, 0)))]
    assert own.defects == () and (np.diff(own.inputs) < 0).all()


def test_poses_of_two_assemblies_are_a_circuit_defect():
    other = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1), branch=-1)
    mixed = [*of(CRANK, ANGLES[:3]), *of(other, ANGLES[3:])]
    [own] = [one for one in four_bars_for_poses(mixed) if like(one, ((0, 0), (2, 0)))]
    assert "circuit" in own.defects and not own.miss < 1e-3


def test_a_dead_point_between_is_a_branch_defect_unless_the_other_link_drives():
    """The rocker of a crank-rocker reaches both branches of one circuit; the crank as driver passes all."""
    poses = of(CRANK, [0.5, 1.5, 3.0, 4.0, 5.5])
    first, second = (d for d in dyads(poses) if abs(d.pivot[1]) < 1e-6)
    best = four_bars_for_poses(poses, links=[first, second])[0]
    assert best.defects == () and best.dyads[0].length == pytest.approx(1)
    driven_at_rocker = linkage_of(np.array(poses), second, first)
    assert "branch" in driven_at_rocker.defects and "circuit" not in driven_at_rocker.defects


@pytest.mark.long
def test_judgement_agrees_with_the_motion():
    """No defect exactly where the simulated body comes to all poses in their order."""
    rng = np.random.default_rng(12)
    seen = {True: 0, False: 0}
    for _ in range(30):
        poses = np.cumsum(rng.normal(size=(5, 3)) * [0.3, 0.3, 0.4], axis=0).tolist()
        for one in four_bars_for_poses(poses):
            assert "motion" not in one.defects
            if one.defects != ("order",):
                assert (one.defects == ()) == (one.miss < 1e-6), one
            seen[one.defects == ()] += 1
    for _ in range(30):
        sides = rng.uniform(0.5, 3.0, 4)
        try:
            linkage = gs.Mechanism.four_bar(*sides, coupler_point=(0.3, 0.4))
        except GeometryError:
            continue
        start = linkage.pose[1][2]
        motion = linkage.simulate(start + np.linspace(0, 0.4, 5))
        if motion.completed:
            found = four_bars_for_poses(motion.poses[:, 2].tolist())
            own = [one for one in found if like(one, ((0, 0), (sides[0], 0)))]
            assert own and own[0].defects == () and own[0].miss < 1e-6
            seen[True] += 1
    assert min(seen.values()) > 10


def test_six_four_bars_of_four_dyads():
    rng = np.random.default_rng(13)
    counts = set()
    for _ in range(12):
        *_, poses = planted(rng)
        found = four_bars_for_poses(poses)
        count = len(dyads(poses))
        assert len(found) == count * (count - 1) // 2 and found.complete
        assert [len(one.defects) for one in found] == sorted(len(one.defects) for one in found)
        counts.add(count)
    assert counts == {2, 4}


def test_four_poses_are_chosen_in_the_rectangle():
    region = ((-1.0, 1.5), (-0.6, 1.0))
    found = four_bars_for_poses(of(CRANK, ANGLES[:4]), pivots=region, count=4)
    assert len(found) == 4 and not found.complete
    for one in found:
        for dyad in one.dyads:
            assert region[0][0] <= dyad.pivot[0] <= region[0][1] and region[1][0] <= dyad.pivot[1] <= region[1][1]
            assert dyad.error < 1e-10
        assert one.defects == () and one.miss < 1e-9
    with pytest.raises(GeometryError, match="no two centre points"):
        four_bars_for_poses(of(CRANK, ANGLES[:4]), pivots=((50, 51), (50, 51)))
    with pytest.raises(GeometryError, match="not a rectangle"):
        four_bars_for_poses(of(CRANK, ANGLES[:4]), pivots=(1, 2))


@pytest.mark.parametrize("kind", ["PR", "RP"])
def test_a_slider_may_be_the_second_dyad(kind):
    rng = np.random.default_rng(14)
    *_, poses = planted(rng, kind, 3)
    poses = [(x, y, 0.2 * k) for k, (x, y, _) in enumerate(poses)]
    [slider] = dyads(poses, kind, angle=0.3)
    [arm] = dyads(poses, pivot=(5.0, 3.0))
    [found] = four_bars_for_poses(poses, links=[slider, arm])
    assert [dyad.kind for dyad in found.dyads] == ["RR", kind]
    graph = {joint.kind for joint in found.mechanism.joints}
    assert len(graph) == 2 and (found.defects == ()) == (found.miss < 1e-7)
    assert found.mechanism.simulate([found.inputs[0]]).residual < 1e-12


def test_two_and_three_poses_need_links():
    poses = of(CRANK, ANGLES[:3])
    with pytest.raises(GeometryError, match="give links"):
        four_bars_for_poses(poses)
    pair = [dyads(poses, pivot=(0, 0))[0], dyads(poses, pivot=(2, 0))[0]]
    [own] = four_bars_for_poses(poses, links=pair)
    assert own.defects == () and np.allclose([d.length for d in own.dyads], [1, 2.5])
    with pytest.raises(GeometryError, match="does not keep these poses"):
        four_bars_for_poses([(x + 0.1 * k, y, t) for k, (x, y, t) in enumerate(poses)], links=pair)


def test_a_crank_rocks_the_driver_between_the_ends():
    poses = of(CRANK, ANGLES[:3])
    pair = [dyads(poses, pivot=(-3.0, -2.0))[0], dyads(poses, pivot=(2.0, 0.0))[0]]
    found = four_bars_for_poses(poses, links=pair)[0]
    assert not found.rotates and not found.defects
    six = found.crank_driven()
    start = six.pose[4][2]
    motion = six.simulate(start + np.linspace(0, 2 * np.pi, 361))
    assert motion.completed and motion.closure.closed
    assert np.abs(motion.poses[0, 2] - poses[0]).max() < 1e-9
    assert np.abs(motion.poses[180, 2] - poses[2]).max() < 1e-9
    swing = motion.poses[:, 1, 2]
    assert np.ptp(swing) == pytest.approx(abs(found.inputs[-1] - found.inputs[0]), abs=1e-9)
    with pytest.raises(GeometryError, match="rod"):
        found.crank_driven(rod=1e-3)
    with pytest.raises(GeometryError, match="swings"):
        four_bars_for_poses(of(CRANK, ANGLES))[0].crank_driven()


def test_two_poses_at_one_angle_of_the_driver_are_not_both_reached():
    """Both assemblies of a four-bar at the same crank angle, from an exact problem at quarter turns."""
    other = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1), branch=-1)
    mixed = [*of(CRANK, ANGLES[:2]), *of(other, ANGLES[1:2])]
    pair = [dyads(mixed, pivot=(0, 0))[0], dyads(mixed, pivot=(2, 0))[0]]
    driven = linkage_of(np.array(mixed), *sorted(pair, key=lambda dyad: dyad.length))
    assert {"branch", "order"} <= set(driven.defects) and driven.miss == np.inf
