"""Six-bars through five poses: planted ones are found, all of them pass the poses, kinds are what they are called."""

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import six_bars_for_poses

POSES = [
    (0.87, 1.44, "34 deg"), (0.68, 1.86, "25 deg"), (-0.08, 2.22, "16 deg"), (-1.03, 1.92, "14 deg"),
    (-1.38, 1.29, "18 deg"),
]  # fmt: skip
#: Joints of each kind, link 0 the frame, and the pairs of links that links 4 and 5 hold.
CHAINS = {
    "Watt I": ([(0, 1), (1, 2), (2, 3), (0, 4), (2, 4), (1, 5), (3, 5)], ((0, 2), (1, 3))),
    "Stephenson II": ([(0, 1), (1, 2), (2, 3), (0, 4), (3, 4), (1, 5), (3, 5)], ((0, 3), (1, 3))),
    "Stephenson III": ([(0, 1), (1, 2), (2, 3), (0, 4), (2, 4), (0, 5), (3, 5)], ((0, 2), (0, 3))),
    "Stephenson I": ([(0, 1), (1, 2), (2, 3), (0, 4), (3, 4), (1, 5), (4, 5)], ((0, 3), (1, 4))),
}


def planted(kind, seed):
    """Random six-bar in a pose where all angles are zero, and five of its poses."""
    joints, _ = CHAINS[kind]
    rng = np.random.default_rng(seed)
    while True:
        places = rng.normal(size=(7, 2))
        parts = tuple(gs.Revolute(a, b, tuple(z), tuple(z)) for (a, b), z in zip(joints, places))
        graph = gs.MechanismGraph(6, joints, frame=0)
        six = gs.Mechanism(graph, parts, [gs.Driver(0, 1)], {}, [(0.0, 0.0, 0.0)] * 6)
        motion = six.simulate(np.linspace(0.0, 0.8, 9), events=False)
        if not motion.completed or np.abs(np.diff(motion.poses[::2, 1:, 2], axis=0)).min() < 0.02:
            continue
        z, poses = places @ [1.0, 1j], motion.poses[::2]
        A = z[0] + (z[1] - z[0]) * np.exp(1j * poses[:, 1, 2])
        W = poses[:, 3, 0] + 1j * poses[:, 3, 1] + z[2] * np.exp(1j * poses[:, 3, 2])
        if abs(np.sign(((W - z[0]).conjugate() * (A - z[0])).imag).sum()) == 5:  # one elbow
            return z, poses


@pytest.mark.long
@pytest.mark.parametrize("kind", CHAINS)
@pytest.mark.parametrize("seed", range(4))
def test_planted_ones_are_found(kind, seed):
    z, poses = planted(kind, seed)
    O, A, W = z[:3]
    body = poses[:, 3]
    side = np.sign(((W - O).conjugate() * (A - O)).imag)
    found = six_bars_for_poses(body, (O.real, O.imag), (W.real, W.imag), (abs(A - O), abs(W - A)), elbow=int(side))
    own = [one for one in found if one.kind == kind]

    def apart(one):
        joints = [one.mechanism.joint(*pair) for pair in CHAINS[kind][0][3:]]
        pose = one.mechanism.pose
        places = [complex(*pose[j.a][:2]) + np.exp(1j * pose[j.a][2]) * complex(*j.at_a) for j in joints]
        return np.abs(np.array(places) - z[3:]).max()

    best = min(own, key=apart)
    assert apart(best) < 1e-6 * max(np.abs(z)) and best.defects == () and best.miss < 1e-8
    assert np.allclose(np.diff(best.inputs), np.diff(poses[:, 1, 2]), atol=1e-9)


def test_all_stand_in_every_pose_and_those_without_defects_move_through_them():
    found = six_bars_for_poses(POSES, (-1, 0), (0, 0), (1.5, 2))
    assert {one.kind for one in found} == set(CHAINS)
    assert [len(one.defects) for one in found] == sorted(len(one.defects) for one in found)
    for one in found:
        ternary = [k for k in range(6) if sum(k in pair[:2] for pair in one.mechanism.graph.joints) == 3]
        wanted = {"Watt I": [1, 2], "Stephenson II": [1, 3], "Stephenson III": [0, 2], "Stephenson I": [1, 4]}
        assert ternary == wanted[one.kind]
        radians = np.array([(x, y, np.radians(float(turn.split()[0]))) for x, y, turn in POSES])
        if not one.defects:
            motion = one.mechanism.simulate(one.inputs, events=False)
            assert np.abs(motion.poses[:, 3] - radians).max() < 1e-8
            assert one.certify().certified


def test_a_chain_that_is_too_short_is_told():
    with pytest.raises(GeometryError, match="pose 1 puts the joint"):
        six_bars_for_poses(POSES, (-1, 0), (0, 0), (0.1, 0.2))
    with pytest.raises(GeometryError, match="3 poses are given; give 5"):
        six_bars_for_poses(POSES[:3], (-1, 0), (0, 0), (1.5, 2))
    with pytest.raises(GeometryError, match="elbow"):
        six_bars_for_poses(POSES, (-1, 0), (0, 0), (1.5, 2), elbow=2)
