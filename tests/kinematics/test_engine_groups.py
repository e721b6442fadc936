"""Groups of every class: all eight-link chains, sliders and slots inside larger groups, drivers inside groups."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate, simulate_batch
from graphsynth.kinematics.engine.batch import solve_rrr
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.mechanism.constraints import jacobian
from graphsynth.mechanism.joints import Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

H = 1e-3
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / H


def drawn(graph: MechanismGraph, driver: tuple[int, int], seed: int, kinds: dict[tuple[int, int], str]) -> Mechanism:
    """A mechanism assembled with every link at the origin; ``kinds`` replaces turning pairs."""
    random = np.random.default_rng(seed)
    joints: list[JointGeometry] = []
    for a, b, mobility in graph.joints:
        x, y = random.normal(size=2)
        angle, shift = random.uniform(-3.0, 3.0), random.normal()
        along = (x + shift * math.cos(angle), y + shift * math.sin(angle))
        kind = kinds.get((a, b), "R" if mobility == 1 else "slot")
        if kind == "R":
            joints.append(Revolute(a, b, (x, y), (x, y)))
        elif kind == "P":
            joints.append(Prismatic(a, b, (x, y), along, angle, angle))
        elif kind == "gear":
            ra, rb, turn = random.uniform(0.3, 1.0), random.uniform(0.3, 1.0), math.atan2(along[1] - y, along[0] - x)
            joints.append(Gear(a, b, (x, y), along, ra, rb, offset=-turn * (ra + rb) / rb))
        else:
            joints.append(PinSlot(a, b, (x, y), along, angle))
    driven = next(joint for joint in joints if joint.pair == driver)
    offset = 0.0
    if isinstance(driven, Prismatic):  # displacement in the drawn pose
        offset = sum((q - p) * d for p, q, d in zip(
            driven.at_a, driven.at_b, (math.cos(driven.angle_a), math.sin(driven.angle_a))
        ))  # fmt: skip
    return Mechanism(graph, joints, [Driver(*driver, Linear(1.0, offset))], pose=((0.0, 0.0, 0.0),) * graph.links)


def check(mechanism: Mechanism) -> bool:
    """Simulate around the drawn pose; check start, residual and rates; False if the pose is too close to singular."""
    motion = simulate(mechanism, H * np.arange(0, 9), events=False)
    if not motion.completed or motion.singularity_distance.min() < 2e-2:
        return False
    np.testing.assert_allclose(motion.poses[0], 0.0, atol=1e-11)
    assert motion.residual < 1e-13
    size = max(1.0, np.abs(motion.accelerations).max())
    for values, rates in ((motion.poses, motion.velocities[4]), (motion.velocities, motion.accelerations[4])):
        difference = np.tensordot(WEIGHTS, values, axes=1)
        assert np.abs(difference - rates).max() < 1e-7 * size**2
    # velocities lie in the kernel of the joints' own equations
    J = jacobian(mechanism.joints, motion.poses[4])
    assert np.abs(J @ motion.velocities[4].ravel()).max() < 1e-11 * size
    return True


def chains() -> list[MechanismGraph]:
    return list(enumerate_chains(8))


@pytest.mark.long
@pytest.mark.parametrize("index", range(16))
def test_every_eight_link_chain_moves(index: int) -> None:
    """Each inversion, driven at each joint of the frame: classes II to IV and higher."""
    moved = 0
    for mechanism_graph in chains()[index].inversions():
        for link in sorted(j.b for j in mechanism_graph.joints if j.a == 0):
            done = any(check(drawn(mechanism_graph, (0, link), seed, {})) for seed in range(12))
            assert done, (mechanism_graph, link)
            moved += done
    assert moved >= 3


TRIAD = MechanismGraph(6, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)], frame=0)


@pytest.mark.parametrize(
    "kinds",
    [{(0, 4): "P"}, {(2, 4): "P"}, {(0, 4): "P", (0, 5): "P"}, {(2, 3): "P", (0, 4): "P"}, {(1, 3): "P", (2, 5): "P"},
     {(0, 4): "P", (2, 5): "P", (1, 3): "P"}, {(0, 4): "P", (2, 4): "P"}],
)  # fmt: skip
def test_triads_with_sliders(kinds: dict[tuple[int, int], str]) -> None:
    assert sum(check(drawn(TRIAD, (0, 1), seed, kinds)) for seed in range(12)) >= 2


@pytest.mark.parametrize("kind", ["slot", "gear"])
def test_higher_pairs_inside_groups(kind: str) -> None:
    """A triad with one leg replaced by a higher pair between the core link and the frame, or between links."""
    on_frame = MechanismGraph(5, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (0, 2, 2)], frame=0)
    inside = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 4), (3, 4), (2, 4, 2)], frame=0)
    for graph, pair in ((on_frame, (0, 2)), (inside, (2, 4))):
        assert graph.mobility == 1
        assert sum(check(drawn(graph, (0, 1), seed, {pair: kind})) for seed in range(12)) >= 2


def test_driver_between_moving_links_of_a_group() -> None:
    """A cylinder in a boom: the driven sliding pair lies away from the frame."""
    graph = MechanismGraph(4, [(0, 1), (0, 2), (1, 3), (2, 3)], frame=0)
    assert sum(check(drawn(graph, (2, 3), seed, {(2, 3): "P"})) for seed in range(12)) >= 2
    assert sum(check(drawn(graph, (2, 3), seed, {})) for seed in range(12)) >= 2


def test_step_names_and_sizes() -> None:
    program = compile_program(drawn(TRIAD, (0, 1), 0, {}))
    assert [len(step.core) for step in program.steps] == [0, 1] and program.steps[1].iterative
    dyad = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    names = []
    for kinds in ("RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR"):
        pairs = dict(zip([(1, 2), (2, 3), (0, 3)], kinds))
        names.append(compile_program(drawn(dyad, (0, 1), 1, pairs)).steps[1].kind)
    assert names == ["RRR", "RRP", "RRP", "RPR", "PRP", "RPP", "RPP"]


def test_groups_without_a_place_are_refused() -> None:
    dyad = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    with pytest.raises(GeometryError, match="direction fixed twice"):
        compile_program(drawn(dyad, (0, 1), 0, dict.fromkeys([(1, 2), (2, 3), (0, 3)], "P")))
    parallel = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Prismatic(2, 3, angle_a=0.3, angle_b=0.2),
        Prismatic(0, 3, angle_b=0.2),
    ]  # fmt: skip
    with pytest.raises(GeometryError, match="parallel lines"):
        compile_program(Mechanism(dyad, parallel, [Driver(0, 1)]))


# --- batches


def test_batch_agrees_with_single_simulations() -> None:
    base = drawn(TRIAD, (0, 1), 3, {})
    random = np.random.default_rng(5)
    sets = np.repeat(base.dimensions[None], 12, axis=0)
    sets += random.normal(scale=0.01, size=sets.shape) * (sets != 0.0)
    u = np.linspace(0.0, 0.4, 41)
    batch = simulate_batch(base, u, sets)
    for b in range(len(sets)):
        joints = [
            Revolute(j.a, j.b, (float(row[0]), float(row[1])), (float(row[3]), float(row[4])))
            for j, row in zip(base.joints, sets[b])
        ]
        single = simulate(Mechanism(base.graph, joints, base.drivers, pose=base.pose), u)
        reached = batch.assembled[b]
        assert reached.any() and single.assembled[reached].all()
        np.testing.assert_allclose(batch.poses[b, reached, :, :2], single.poses[reached][:, :, :2], atol=1e-12)
        np.testing.assert_allclose(batch.velocities[b, reached], single.velocities[reached], atol=1e-9)
        assert batch.completed[b] or batch.reason(b)


def test_batch_says_which_sets_cannot_be_assembled() -> None:
    dyad = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    base = Mechanism(
        dyad,
        [
            Revolute(0, 1),
            Revolute(1, 2, (1.0, 0.0)),
            Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
            Revolute(0, 3, (2.0, 0.0)),
        ],
        [Driver(0, 1)],
    )
    sets = np.repeat(base.dimensions[None], 3, axis=0)
    sets[:, 1, 0] = [2.0, 5.5, 9.0]
    u = np.linspace(0.0, 6.28, 91)
    for rates in (True, False):
        batch = simulate_batch(base, u, sets, rates=rates)
        assert batch.completed.tolist() == [True, False, False]
        limit = math.acos((1.0 + 5.5**2 - 25.0) / (2.0 * 5.5))
        assert u[batch.reached[1] - 1] <= limit < u[batch.reached[1]]
        assert np.isnan(batch.frames[1, batch.reached[1] :]).all() and batch.reached[2] == 0
        assert batch.reason(0) == "" and "assembled" in batch.reason(1)
        M = batch.point(2, (5.0, 0.0))
        np.testing.assert_allclose(M[0], simulate(base, u).point(2, (5.0, 0.0)).position, atol=1e-14)
        bare = simulate_batch(base, u, sets, rates=rates, keep=[])  # margins do not depend on what is kept
        np.testing.assert_array_equal(bare.margins, batch.margins)
        assert np.isnan(bare.margins[2]).all() and bare.frames.shape == (3, 91, 0, 4)
    with pytest.raises(GeometryError, match="shape"):
        simulate_batch(base, u, sets[:, :2])
    with pytest.raises(GeometryError, match="strictly"):
        simulate_batch(base, [0.0, 0.0], sets)


def test_rrr_batch() -> None:
    random = np.random.default_rng(1)
    A, B = random.normal(size=(2, 1000, 2))
    l1, l2 = random.uniform(0.1, 3.0, (2, 1000))
    for sign in (1, -1):
        C, margin = solve_rrr(A, B, l1, l2, sign)
        closed = margin >= 0.0
        distance = np.hypot(*(B - A).T)
        assert (closed == ((np.abs(l1 - l2) <= distance) & (distance <= l1 + l2))).all()
        assert np.isnan(C[~closed]).all() and closed.any() and (~closed).any()
        np.testing.assert_allclose(np.hypot(*(C - A)[closed].T), l1[closed], atol=1e-13)
        np.testing.assert_allclose(np.hypot(*(C - B)[closed].T), l2[closed], atol=1e-13)
        (ux, uy), (vx, vy) = (B - A)[closed].T, (C - A)[closed].T
        assert (sign * (ux * vy - uy * vx) >= 0.0).all()
    with pytest.raises(GeometryError, match="positive"):
        solve_rrr(A, B, -1.0, 1.0)
    with pytest.raises(GeometryError, match="sign"):
        solve_rrr(A, B, 1.0, 1.0, 0)


@pytest.mark.long
@pytest.mark.parametrize("index", range(0, 12, 3))
def test_branch_does_not_depend_on_the_samples(index: int) -> None:
    """Fine, coarse and reversed inputs find the same branch, the same end and the same reason."""
    branch_of_samples(chains()[index].inversions()[::3])


@pytest.mark.slow
@pytest.mark.parametrize("index", range(16))
def test_branch_does_not_depend_on_the_samples_in_any_inversion(index: int) -> None:
    branch_of_samples(chains()[index].inversions())


def branch_of_samples(inversions: Iterable[MechanismGraph]) -> None:
    for graph in inversions:
        for link in sorted(j.b for j in graph.joints if j.a == 0):
            mechanism = drawn(graph, (0, link), 1, {})
            u = np.linspace(0.0, 1.0, 101)
            fine, coarse = simulate(mechanism, u), simulate(mechanism, u[::10])
            both = fine.assembled[::10]
            assert (both == coarse.assembled).all()
            np.testing.assert_allclose(coarse.poses[both], fine.poses[::10][both], atol=1e-9)
            if not fine.completed:
                ends = [next(e for e in motion.events if e.ends_motion) for motion in (fine, coarse)]
                assert [e.kind for e in ends] == ["fold", "fold"] and ends[0].group == ends[1].group
                assert ends[0].input == pytest.approx(ends[1].input, abs=1e-7)
                continue
            back = simulate(mechanism, u[::-1], start=fine.poses[-1])
            assert back.completed
            np.testing.assert_allclose(back.poses[-1, :, :2], fine.poses[0, :, :2], atol=1e-9)


@pytest.mark.long
def test_fold_of_a_dyad_is_not_blamed_on_the_triad_that_hangs_on_it() -> None:
    graph = MechanismGraph(8, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 5), (4, 5), (4, 6), (0, 6), (4, 7), (0, 7)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (1.0, 0.0), (1.0, 0.0)), Revolute(0, 3, (2.0, 0.0)),
        Revolute(3, 5, (0.4, 0.0)), Revolute(4, 5, (-0.4, -0.25), (1.1, 0.0)),
        Revolute(4, 6, (0.45, -0.3), (0.95, 0.0)),
        Revolute(0, 6, (4.2, 0.2)), Revolute(4, 7, (0.05, 0.5), (1.05, 0.0)), Revolute(0, 7, (3.1, 1.8)),
    ]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    u = np.linspace(0.2, 2.0, 31)
    motions = [simulate(mechanism, u, modes={0: mode, 1: rank}) for mode in (1, -1) for rank in (0, 1)]
    at_limit = [m for m in motions if abs(m.stopped_at - math.acos(0.25)) < 1e-6]
    assert at_limit
    for motion in at_limit:
        event = next(e for e in motion.events if e.ends_motion)
        assert (event.kind, event.group, event.links) == ("fold", 0, (2, 3))
        assert event.input == pytest.approx(math.acos(0.25), abs=1e-12)
