"""Closed-form dyads of the general engine against independent references of 50 digits."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
DYADS = ["RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR"]


def laid_out(kinds: str, seed: int) -> Mechanism:
    """A crank and a dyad assembled at a random pose of every link (joints 1-2, 2-3, 0-3 of the given kinds)."""
    random = np.random.default_rng(seed)
    pose = np.vstack([np.zeros(3), random.normal(size=(3, 3))])

    def local(link: int, where: complex) -> tuple[float, float]:
        z = (where - complex(*pose[link, :2])) * np.exp(-1j * pose[link, 2])
        return z.real, z.imag

    joints = [Revolute(0, 1, (0.0, 0.0), local(1, 0j))]
    for (a, b), kind, at in zip([(1, 2), (2, 3), (0, 3)], kinds, [0.4 + 0.3j, 2.2 + 1.6j, 2.4 - 0.3j]):
        if kind == "R":
            joints.append(Revolute(a, b, local(a, at), local(b, at)))
        else:
            angle = random.uniform(-3.0, 3.0)
            other = at + np.exp(1j * angle) * random.normal()
            joints.append(Prismatic(a, b, local(a, at), local(b, other), angle - pose[a, 2], angle - pose[b, 2]))
    drivers = [Driver(0, 1, Linear(1.0, pose[1, 2]))]
    return Mechanism(CYCLE, joints, drivers, pose=tuple(tuple(float(v) for v in row) for row in pose))


def closure_equations(mechanism: Mechanism, unknown: list[mp.mpf], crank: mp.mpf) -> list[mp.mpf]:
    """The joints' own equations for links 2 and 3 at 50 digits, written out from the definition of each pair."""
    first = mechanism.joint(0, 1)
    turn = mp.expj(crank)
    pin = mp.mpc(*first.at_a) - turn * mp.mpc(*first.at_b)
    pose = {0: (mp.mpc(0), mp.mpf(0)), 1: (pin, crank)}
    for k in (2, 3):
        x, y, angle = unknown[3 * (k - 2) : 3 * (k - 1)]
        pose[k] = (mp.mpc(x, y), angle)
    equations = []
    for a, b in ((1, 2), (2, 3), (0, 3)):
        joint = mechanism.joint(a, b)
        P = pose[joint.a][0] + mp.expj(pose[joint.a][1]) * mp.mpc(*joint.at_a)
        Q = pose[joint.b][0] + mp.expj(pose[joint.b][1]) * mp.mpc(*joint.at_b)
        if isinstance(joint, Revolute):
            equations += [mp.re(Q - P), mp.im(Q - P)]
        else:
            along = pose[joint.a][1] + mp.mpf(joint.angle_a)
            equations.append(mp.im((Q - P) * mp.expj(-along)))
            equations.append(mp.sin(pose[joint.b][1] + mp.mpf(joint.angle_b) - along))
    return equations


@pytest.mark.parametrize("kinds", DYADS)
@pytest.mark.parametrize("seed", range(4))
def test_dyads_agree_with_fifty_digits(kinds: str, seed: int) -> None:
    mechanism = laid_out(kinds, seed)
    motion = simulate(mechanism, [0.0, 0.006, 0.012])
    assert motion.assembled.all(), motion.reason
    with mp.workdps(50):
        for k, u in enumerate(motion.inputs):
            crank = mp.mpf(u) + mp.mpf(mechanism.drivers[0].law.offset)
            guess = [mp.mpf(v) for v in motion.poses[k, 2:].ravel()]
            exact = mp.findroot(lambda *x, q=crank: closure_equations(mechanism, list(x), q), guess, tol=1e-60)
            error = max(abs(float(exact[i] - guess[i])) for i in range(6))
            # the guess is double precision; its distance from the exact root is the error of the engine
            assert error <= 4.0 * motion.errors[k] * motion.Lc + 1e-15
            assert error < 2e-13


@pytest.mark.parametrize("kinds", DYADS)
def test_start_pose_selects_the_mode(kinds: str) -> None:
    for seed in range(6):
        mechanism = laid_out(kinds, seed)
        motion = simulate(mechanism, [0.0])
        apart = motion.poses[0] - np.array(mechanism.pose)
        assert np.abs(apart[:, :2]).max() < 1e-12
        assert np.abs(np.exp(1j * apart[:, 2]) - 1.0).max() < 1e-12


@pytest.mark.parametrize("kinds", DYADS)
def test_rates_agree_with_differences(kinds: str) -> None:
    h = 1e-3
    for seed in (0, 2, 3):
        mechanism = laid_out(kinds, seed)
        motion = simulate(mechanism, h * np.arange(-4, 5))
        if not motion.completed:
            continue
        p, v = motion.poses, motion.velocities
        weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / h
        for values, rates in ((p, v[4]), (v, motion.accelerations[4])):
            difference = np.tensordot(weights, values, axes=1)
            assert np.abs(difference - rates).max() <= 1e-9 * max(1.0, np.abs(values).max(), np.abs(rates).max())


def test_both_modes_of_a_dyad_are_mirror_images() -> None:
    mechanism = Mechanism(
        CYCLE,
        [
            Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
            Revolute(0, 3, (2.0, 0.0)),
        ],
        [Driver(0, 1)],
    )  # fmt: skip
    up, down = (simulate(mechanism, [0.0, 0.5], modes={0: sign}) for sign in (1, -1))
    assert up.modes.tolist() == [[1], [1]] and down.modes.tolist() == [[-1], [-1]]
    B_up, B_down = up.point(3, (2.5, 0.0)).position, down.point(3, (2.5, 0.0)).position
    A, C = up.point(1, (1.0, 0.0)).position, np.array([2.0, 0.0])
    # the mirror line passes through A and C
    for k in range(2):
        axis = (C - A[k]) / np.linalg.norm(C - A[k])
        d = B_up[k] - C
        mirrored = C + 2.0 * axis * (d @ axis) - d
        np.testing.assert_allclose(B_down[k], mirrored, atol=1e-14)
        (ax, ay), (bx, by) = C - A[k], B_up[k] - A[k]
        assert ax * by - ay * bx > 0.0


@pytest.mark.parametrize(("angle", "slot"), [(0.4, 1.2), (-1.1, 2.0), (2.2, 0.5)])
def test_a_guide_on_the_crank_and_a_slanted_slot(angle: float, slot: float) -> None:
    """The link keeps its angle to the crank, its origin stays on the guide, and the fixed pin in its own slot."""
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    rail, seat, pin, groove = 0.3 + 0.2j, 0.1 - 0.2j, 0.5 + 0.3j, 2.0 + 0.1j

    def at(z: complex) -> tuple[float, float]:
        return z.real, z.imag

    joints = [
        Revolute(0, 1),
        Prismatic(1, 2, at(rail), at(seat), angle, 0.1),
        PinSlot(2, 0, at(groove), at(pin), slot),
    ]
    u = np.linspace(0.2, 9.0, 40)
    poses = simulate(Mechanism(graph, joints, [Driver(0, 1)]), u).poses
    turn, own = np.exp(1j * u), np.exp(1j * poses[:, 2, 2])
    np.testing.assert_allclose(poses[:, 2, 2], u + angle - 0.1, atol=1e-13)
    origin = poses[:, 2, 0] + 1j * poses[:, 2, 1]
    off = (origin + seat * own - rail * turn) * np.exp(-1j * angle) / turn
    np.testing.assert_allclose(off.imag, 0.0, atol=1e-13)
    np.testing.assert_allclose(((pin - origin - groove * own) / own * np.exp(-1j * slot)).imag, 0.0, atol=1e-13)


def test_a_link_that_slides_on_two_shafts() -> None:
    """Oldham coupling with offset guides: the centre is where two lines meet; rates are differences of positions."""
    lines = [((0.3, -0.2), (0.15, 0.1), 0.4), ((0.25, 0.35), (-0.2, 0.3), 1.7)]  # rail, seat, direction
    pivots = [(0.1, 0.25), (0.7, -0.4)]
    joints = [
        Revolute(0, 1, pivots[0]),
        Prismatic(1, 2, lines[0][0], lines[0][1], lines[0][2], 0.2),
        Prismatic(2, 3, lines[1][1], lines[1][0], 0.2 + lines[1][2] - lines[0][2], lines[1][2]),
        Revolute(0, 3, pivots[1]),
    ]
    mechanism = Mechanism(CYCLE, joints, [Driver(0, 1)])
    u = np.linspace(0.0, 6.0, 13)
    motion = simulate(mechanism, u)
    assert motion.completed
    step = 1e-4
    moved = [simulate(mechanism, u + k * step).poses for k in (-1, 1)]
    np.testing.assert_allclose(motion.velocities, (moved[1] - moved[0]) / (2 * step), atol=1e-6)
    second = (moved[1] - 2.0 * motion.poses + moved[0]) / step**2
    np.testing.assert_allclose(motion.accelerations, second, atol=1e-5)
    own, turn = np.exp(1j * motion.poses[:, 2, 2]), np.exp(1j * u)
    origin, at = motion.poses[:, 2, 0] + 1j * motion.poses[:, 2, 1], complex(*pivots[0])
    rail, seat, angle = complex(*lines[0][0]), complex(*lines[0][1]), lines[0][2]
    off = (origin + seat * own - at - rail * turn) / turn * np.exp(-1j * angle)
    np.testing.assert_allclose(off.imag, 0.0, atol=1e-13)
    np.testing.assert_allclose(motion.poses[:, 2, 2], u + angle - 0.2, atol=1e-13)


def test_pin_in_slot_replaces_coupler_and_slider() -> None:
    """Scotch yoke by a pin in a slot: the yoke's displacement is the cosine of the crank angle."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    yoke = Mechanism(
        graph,
        [Revolute(0, 1), Prismatic(0, 2), PinSlot(2, 1, at_b=(0.7, 0.0), angle_a=math.pi / 2)],
        [Driver(0, 1)],
    )
    u = np.linspace(0.0, 2.0 * math.pi, 37)
    motion = simulate(yoke, u)
    assert motion.completed and motion.closure.closed
    np.testing.assert_allclose(motion.poses[:, 2, 0], 0.7 * np.cos(u), atol=1e-15)
    np.testing.assert_allclose(motion.velocities[:, 2, 0], -0.7 * np.sin(u), atol=1e-15)
    np.testing.assert_allclose(motion.accelerations[:, 2, 0], -0.7 * np.cos(u), atol=1e-15)


def test_slider_crank_closed_form() -> None:
    r, l, e = 0.3, 1.1, 0.12
    mechanism = Mechanism(
        CYCLE,
        [Revolute(0, 1), Revolute(1, 2, (r, 0.0)), Revolute(2, 3, (l, 0.0)), Prismatic(0, 3, (0.0, e))],
        [Driver(0, 1)],
    )
    u = np.linspace(0.0, 2.0 * math.pi, 91)
    s, c = np.sin(u), np.cos(u)
    for sign in (1, -1):
        motion = simulate(mechanism, u, modes={0: sign})
        root = np.sqrt(l * l - (e - r * s) ** 2)
        side = np.sign(motion.poses[0, 3, 0] - r)
        x = r * c + side * root
        x1 = -r * s + side * (e - r * s) * r * c / root
        np.testing.assert_allclose(motion.poses[:, 3, 0], x, atol=1e-15 * 4)
        np.testing.assert_allclose(motion.velocities[:, 3, 0], x1, atol=4e-15)
        assert motion.closure.closed and motion.residual < 1e-14
    assert {int(simulate(mechanism, [0.0], modes={0: m}).poses[0, 3, 0] > 0) for m in (1, -1)} == {0, 1}


def test_sliding_directions_that_become_parallel_stop_the_motion() -> None:
    """A PRP dyad whose guides become parallel runs to infinity: reported, never stepped over."""
    mechanism = Mechanism(
        CYCLE,
        [Revolute(0, 1), Prismatic(1, 2), Revolute(2, 3), Prismatic(0, 3, (0.0, 1.0))],
        [Driver(0, 1, Linear(1.0, 0.5))],
    )
    motion = simulate(mechanism, np.linspace(0.0, 3.0, 31))
    assert not motion.completed and motion.events[-1].kind == "escape"
    assert motion.stopped_at == pytest.approx(math.pi - 0.5, abs=1e-12)
    assert "parallel" in motion.reason
    assert np.isnan(motion.poses[motion.inputs > motion.stopped_at]).all()
