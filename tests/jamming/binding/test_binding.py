"""What binding costs against closed forms, an independent formulation by bodies, and conservation of energy."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import Bearing
from graphsynth.jamming.binding import ContactFriction, JointStiffness, LinkSection, binding_torque
from graphsynth.jamming.binding.energy import least_energy
from graphsynth.jamming.joints import FREE, RIGID, SPHERICAL, JointLimits, Misalignment, SlideLimits
from graphsynth.jamming.joints.program import problem
from graphsynth.mechanism.joints import Prismatic

Array = NDArray[np.float64]
Springs = dict[tuple[int, int], JointStiffness]
U = np.linspace(0.0, math.tau, 121)
LAMBDA = gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25).simulate(U)


def points(motion: gs.Motion) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Joints A (1-2) and B (2-3) of a four-bar, from its poses."""
    mechanism = motion.mechanism
    found = []
    for a, b in ((1, 2), (2, 3)):
        joint: Any = mechanism.joint(a, b)
        pose = motion.poses[:, joint.a]
        found.append(pose[:, 0] + 1j * pose[:, 1] + np.exp(1j * pose[:, 2]) * complex(*joint.at_a))
    return found[0], found[1]


def test_one_joint_takes_all_of_the_tilt() -> None:
    """A spherical, all others rigid: B tilts by alpha l2 |sin f| / l3, and is a spring beyond its limit."""
    alpha, limit, k = 0.03, 0.006, 700.0
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(limit), (0, 3): RIGID}
    report = LAMBDA.binding(tilt=alpha, joints=joints, stiffness={(2, 3): k})
    need = alpha * 0.1 / 0.25 * np.abs(np.sin(U))
    over = np.maximum(need - limit, 0.0)
    np.testing.assert_allclose(report.energy, 0.5 * k * over**2, atol=1e-13)
    wanted = k * over * alpha * 0.1 / 0.25 * np.cos(U) * np.sign(np.sin(U))
    np.testing.assert_allclose(report.elastic_torque, wanted, atol=1e-11)
    np.testing.assert_allclose(report.moment[:, report.joints.index((2, 3))], k * over, atol=1e-9)
    assert report.answer == "binds"
    assert report.statement.startswith("Estimated: binds with at most")


def test_a_cantilever_is_bent() -> None:
    """The rocker, fixed to the frame and spherical at B, is a cantilever whose end the coupler lifts."""
    alpha, bending = 0.01, 42.0
    joints = {(0, 1): RIGID, (1, 2): RIGID, (2, 3): SPHERICAL, (0, 3): RIGID}
    report = LAMBDA.binding(tilt=alpha, joints=joints, links={3: LinkSection(bending, 7.0)})
    lift = alpha * points(LAMBDA)[1].imag
    np.testing.assert_allclose(report.energy, 1.5 * bending / 0.25**3 * lift**2, rtol=1e-9, atol=1e-15)


def frame_of_beams(motion: gs.Motion, k: int, alpha: float, tilt: float, bar: LinkSection) -> float:
    """Energy of a pose by finite elements: grid beams from the middle of every link to its joints, springs between.

    Unknowns are tilts and height (x, y, w) of every hub and every end; heights at a joint are equal (multipliers).
    """
    mechanism, poses = motion.mechanism, motion.poses[k]
    places: dict[tuple[int, int], complex] = {}  # of (link, number of a joint, or -1 for its hub)
    for number, joint in enumerate(mechanism.joints):
        x, y, t = poses[joint.a]
        places[joint.a, number] = places[joint.b, number] = complex(x, y) + np.exp(1j * t) * complex(*joint.at_a)
    for link in range(mechanism.graph.links):
        own = [at for (other, _), at in places.items() if other == link]
        places[link, -1] = sum(own) / len(own)
    index = {key: 3 * i for i, key in enumerate(sorted(key for key in places if key[0] != mechanism.frame))}
    size = 3 * len(index)
    K, f, constant = np.zeros((size, size)), np.zeros(size), 0.0
    for (link, number), start in index.items():
        if number < 0:
            continue
        e = places[link, number] - places[link, -1]
        length, e = abs(e), e / abs(e)
        # rows: height, slope along the arm and twist, at both ends
        B = np.zeros((6, size))
        for end, at in enumerate((index[link, -1], start)):
            B[3 * end, at + 2] = 1.0
            B[3 * end + 1, at : at + 2] = e.imag, -e.real
            B[3 * end + 2, at : at + 2] = e.real, e.imag
        beam, m = np.zeros((6, 6)), length
        rows = [0, 1, 3, 4]
        bent = np.array(
            [[12, 6 * m, -12, 6 * m], [0, 4 * m**2, -6 * m, 2 * m**2], [0, 0, 12, -6 * m], [0, 0, 0, 4 * m**2]]
        )
        beam[np.ix_(rows, rows)] = bar.bending / m**3 * (bent + np.triu(bent, 1).T)
        beam[np.ix_([2, 5], [2, 5])] = bar.torsion / m * np.array([[1.0, -1.0], [-1.0, 1.0]])
        K += B.T @ beam @ B
    rows = []
    for number, joint in enumerate(mechanism.joints):
        row, spring = np.zeros(size), np.zeros((2, size))
        for link, sign in ((joint.a, -1.0), (joint.b, 1.0)):
            if link != mechanism.frame:
                at = index[link, number]
                row[at + 2] = sign
                spring[[0, 1], [at, at + 1]] = sign
        rows.append(row)
        turned = np.array([alpha if joint.pair == mechanism.drivers[0].pair else 0.0, 0.0])
        turned *= 1.0 if joint.a == mechanism.frame else -1.0
        K += tilt * spring.T @ spring
        f += tilt * spring.T @ turned
        constant += 0.5 * tilt * turned @ turned
    C = np.array(rows)
    # heights of a tilted shaft stay those of its pivot: the joint is at the tilted axis itself
    whole = np.block([[K, C.T], [C, np.zeros((len(C), len(C)))]])
    u = np.linalg.lstsq(whole, np.concatenate([f, np.zeros(len(C))]), rcond=None)[0][:size]
    return float(0.5 * u @ K @ u - f @ u + constant)


@pytest.mark.parametrize("kind", ["four-bar", "six-bar"])
def test_links_as_a_frame_of_beams(kind: str) -> None:
    """Binary and ternary links with joints without clearance: linear, so finite elements give the same energy."""
    mechanism = {"four-bar": gs.Mechanism.four_bar(0.3, 0.1, 0.32, 0.25), "six-bar": gs.gallery.watt_six_bar()}[kind]
    motion = mechanism.simulate(np.array([0.4, 1.4, 2.4]))
    bar = LinkSection(40.0, 23.0)
    report = motion.binding(tilt=0.02, joints=0.0, stiffness=900.0, links=bar)
    found = [frame_of_beams(motion, k, 0.02, 900.0, bar) for k in range(3)]
    np.testing.assert_allclose(report.energy, found, rtol=1e-8)


def test_an_axial_clearance_is_used_up() -> None:
    alpha, clearance, k = 0.01, 0.0016, 3e5
    joints = {(0, 1): RIGID, (1, 2): RIGID, (2, 3): JointLimits(math.inf, clearance), (0, 3): RIGID}
    report = LAMBDA.binding(tilt=alpha, joints=joints, stiffness={(2, 3): JointStiffness(math.inf, k)})
    over = np.maximum(np.abs(alpha * points(LAMBDA)[1].imag) - clearance, 0.0)
    assert 0 < np.count_nonzero(over) < len(over)
    np.testing.assert_allclose(report.energy, 0.5 * k * over**2, rtol=1e-8, atol=1e-13)
    np.testing.assert_allclose(report.force[:, report.joints.index((2, 3))], k * over, atol=1e-6)


def test_millimetres_are_metres() -> None:
    given: Any = {"tilt": 0.03, "joints": JointLimits(0.004, 0.0), "stiffness": JointStiffness(900.0, 1e6)}
    links = LinkSection.rectangular(2e11, 0.02, 0.005)
    small = gs.Mechanism.four_bar(200.0, 100.0, 250.0, 250.0).simulate(U)
    a, b = LAMBDA.binding(**given, links=links), small.binding(**given, links=links, unit="mm")
    np.testing.assert_allclose(a.energy, b.energy, rtol=1e-9)
    np.testing.assert_allclose(a.elastic_torque, b.elastic_torque, rtol=1e-6, atol=1e-9)
    assert b.unit == 1e-3


def by_bodies(
    motion: gs.Motion, k: int, tilt: Any, joints: Any, springs: dict[tuple[int, int], JointStiffness]
) -> float:
    """Least energy of a pose over tilts and heights of all bodies, by a general optimiser; lengths in metres."""
    given = problem(motion.mechanism, joints, tilt)
    mechanism, poses = motion.mechanism, motion.poses[k]
    free = [link for link in range(mechanism.graph.links) if link != mechanism.frame]
    axes = {own.pair: own for own in given.misalignments}

    def place(joint: Any) -> tuple[complex, complex]:
        link, at = (joint.b, joint.at_b) if isinstance(joint, Prismatic) else (joint.a, joint.at_a)
        x, y, t = poses[link]
        e = np.exp(1j * (poses[joint.a][2] + getattr(joint, "angle_a", 0.0)))
        return complex(x, y) + np.exp(1j * t) * complex(*at), e

    def residuals(v: Array) -> list[float]:
        tilts = {link: v[3 * i] + 1j * v[3 * i + 1] for i, link in enumerate(free)} | {mechanism.frame: 0j}
        up = {link: v[3 * i + 2] for i, link in enumerate(free)} | {mechanism.frame: 0.0}
        found = []
        for joint, limits in zip(mechanism.joints, given.limits):
            r, e = place(joint)
            tau = tilts[joint.b] - tilts[joint.a]
            if joint.pair in axes:
                own = axes[joint.pair]
                turn = np.exp(1j * (poses[own.base][2] + own.direction))
                tau -= own.alpha * turn * (1.0 if own.base == joint.a else -1.0)
            z = [up[link] + (np.conj(tilts[link]) * r).imag for link in (joint.a, joint.b)]
            spring = springs[joint.pair]
            local = np.conj(e) * tau
            over = (
                [abs(local.real) - limits.roll, abs(local.imag) - limits.pitch]
                if isinstance(limits, SlideLimits)
                else [abs(tau) - limits.tilt]
            )
            found += [math.sqrt(spring.tilt) * max(part, 0.0) for part in over]
            found += [math.sqrt(spring.axial) * max(abs(z[1] - z[0]) - limits.axial_clearance, 0.0)]
        return found

    starts = [0.01 * np.random.default_rng(start).normal(size=3 * len(free)) for start in range(3)]
    return min(
        float(least_squares(residuals, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=400).cost)
        for start in starts
    )


@pytest.mark.parametrize("kind", ["four-bar", "slider", pytest.param("six-bar", marks=pytest.mark.long)])
def test_energy_of_bodies(kind: str) -> None:
    """Random limits and stiffness; the energy over all tilts and heights of bodies is the same."""
    random = np.random.default_rng(len(kind))
    mechanism = {
        "four-bar": gs.Mechanism.four_bar(0.3, 0.1, 0.32, 0.25),
        "slider": gs.Mechanism.slider_crank(0.1, 0.3),
        "six-bar": gs.gallery.watt_six_bar(),
    }[kind]
    motion = mechanism.simulate(np.array([0.4, 0.5]))
    assert motion.completed
    joints: dict[tuple[int, int], Any] = {}
    springs: dict[tuple[int, int], JointStiffness] = {}
    for joint in mechanism.joints:
        a, b, c = random.uniform(0.001, 0.006, 3)
        joints[joint.pair] = SlideLimits(a, b, 0.02 * c) if isinstance(joint, Prismatic) else JointLimits(a, 0.02 * c)
        springs[joint.pair] = JointStiffness(random.uniform(0.5, 2.0), random.uniform(50.0, 200.0))
    driver = mechanism.drivers[0]
    axes = [Misalignment(driver.base, driver.link, 0.05, 0.7, rigid=False)]
    report = motion.binding(tilt=axes, joints=joints, stiffness=springs)
    assert report.energy[0] > 0.0
    assert by_bodies(motion, 0, axes, joints, springs) == pytest.approx(report.energy[0], rel=1e-5)


def test_torque_is_the_derivative_of_the_energy_and_gives_back_its_work() -> None:
    u = np.linspace(0.0, math.tau, 1201)
    motion = gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25).simulate(u)
    report = motion.binding(tilt=0.03, joints=0.006, stiffness=900.0, links=LinkSection.rectangular(2e11, 0.02, 0.006))
    slope = np.gradient(report.energy, u)[1:-1]
    size = np.abs(slope).max()
    assert np.quantile(np.abs(slope - report.elastic_torque[1:-1]), 0.98) < 1e-4 * size
    assert np.abs(slope - report.elastic_torque[1:-1]).max() < 2e-2 * size  # where a joint begins to touch
    assert report.work_error < 1e-5


def test_friction_is_all_that_is_lost() -> None:
    """Work of the whole torque over a full rotation is the sum of the joints' losses; without friction nothing."""
    given: Any = {"tilt": 0.03, "joints": 0.006, "stiffness": 900.0}
    rough = LAMBDA.binding(**given, friction=ContactFriction(0.1, 0.008, 0.02))
    work = float(np.trapezoid(rough.torque, U))
    assert work == pytest.approx(rough.loss, rel=2e-3)
    assert rough.loss == pytest.approx(sum(row.loss for row in rough.wear), rel=1e-12)
    smooth = LAMBDA.binding(**given)
    assert smooth.loss == 0.0
    assert abs(np.trapezoid(smooth.torque, U)) < 2e-3 * np.trapezoid(np.abs(smooth.torque), U)
    twice = LAMBDA.binding(**given, friction=ContactFriction(0.2, 0.008, 0.02))
    assert twice.loss == pytest.approx(2.0 * rough.loss, rel=1e-12)
    assert twice.wear[0].wear == pytest.approx(rough.wear[0].wear, rel=1e-12)


def test_wear_of_one_joint() -> None:
    """Pressure m / (l r l) times the distance r |turn|, and the loss mu (2 m / l + f) r |turn| with f = m / l3."""
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(0.0), (0, 3): RIGID}
    friction = {(2, 3): ContactFriction(0.15, 0.01, 0.03)}
    report = LAMBDA.binding(tilt=0.03, joints=joints, stiffness={(2, 3): 700.0}, friction=friction)
    moment = 700.0 * 0.03 * 0.1 / 0.25 * np.abs(np.sin(U))
    turn = np.abs(LAMBDA.velocities[:, 3, 2] - LAMBDA.velocities[:, 2, 2])
    row = report.wear[0]
    assert row.joint == (2, 3)
    assert row.contact == pytest.approx(moment.max() / 0.03)
    assert row.sliding == pytest.approx(0.01 * np.trapezoid(turn, U))
    assert row.wear == pytest.approx(np.trapezoid(moment / (0.03 * 0.01 * 0.03) * 0.01 * turn, U))
    rubs = 0.15 * (2.0 / 0.03 + 1.0 / 0.25) * moment * 0.01 * turn
    assert row.loss == pytest.approx(np.trapezoid(rubs, U))
    np.testing.assert_allclose(report.friction_torque, rubs, atol=1e-12)


@pytest.mark.long
def test_binds_where_the_limits_are_exceeded() -> None:
    """It binds exactly where the convex program of the limits says so."""
    for tilt in (0.012, 0.0121, 0.0122, 0.013):
        jammed = LAMBDA.assess_jamming(tilt=tilt, joints=Bearing(), certify=False)
        report = LAMBDA.binding(tilt=tilt, joints=Bearing(), stiffness=1000.0)
        np.testing.assert_array_equal(report.energy > 0.0, jammed.factor > 1.0 + 1e-9)
        assert report.answer == ("binds" if jammed.verdict.is_jammed else "free")


def test_nothing_misaligned_costs_nothing() -> None:
    report = LAMBDA.binding(tilt=0.0, joints=0.0, stiffness=1e9, links=LinkSection(1.0, 1.0))
    assert report.answer == "free"
    assert not report.torque.any()


def test_the_motor_decides_what_blocks() -> None:
    given: Any = {"tilt": 0.03, "joints": 0.006, "stiffness": 900.0}
    peak = LAMBDA.binding(**given).peak_torque
    assert LAMBDA.binding(**given, motor_torque=1.01 * peak).answer == "binds"
    report = LAMBDA.binding(**given, motor_torque=0.99 * peak)
    assert report.answer == "blocks"
    assert "exceed the motor's" in report.statement


def test_what_cannot_give_way_blocks() -> None:
    joints = {(0, 1): RIGID, (1, 2): RIGID, (2, 3): JointLimits(0.0), (0, 3): RIGID}
    report = LAMBDA.binding(tilt=0.03, joints=joints, stiffness={(2, 3): 700.0})
    assert report.blocked.any()
    assert report.answer == "blocks"
    assert math.isinf(report.peak_torque)
    assert "neither clearance nor compliance" in report.statement


@pytest.mark.long
@pytest.mark.parametrize("kind", ["four-bar", "slider", "six-bar", "rail"])
def test_exact_closure_differs_by_alpha_squared(kind: str) -> None:
    """Energy and torque with finite tilts; the difference falls with the square of the tilt."""
    mechanism = {
        "four-bar": gs.Mechanism.four_bar(0.3, 0.1, 0.32, 0.25),
        "slider": gs.Mechanism.slider_crank(0.1, 0.3),
        "six-bar": gs.gallery.watt_six_bar(),
        "rail": gs.Mechanism.slider_crank(0.1, 0.3),
    }[kind]
    motion = mechanism.simulate(np.array([0.4, 1.4, 2.4]))
    far = []
    for alpha in (0.02, 0.04):
        joints = {
            joint.pair: SlideLimits(0.1 * alpha, 0.05 * alpha)
            if isinstance(joint, Prismatic)
            else JointLimits(0.1 * alpha)
            for joint in mechanism.joints
        }
        guide = next((joint for joint in mechanism.joints if joint.kind == "P"), mechanism.joints[0])
        tilt = Misalignment(guide.a, guide.b, alpha, 1.2, rigid=False) if kind == "rail" else alpha
        report = motion.binding(tilt=tilt, joints=joints, stiffness=JointStiffness(900.0, 1e6))
        exact = report.exact()
        assert exact.missed < 1e-9
        np.testing.assert_allclose(exact.energy, report.energy, rtol=3.0 * alpha**2)
        size = np.abs(report.elastic_torque).max()
        np.testing.assert_allclose(exact.torque, report.elastic_torque, atol=5.0 * alpha**2 * size)
        far.append(np.abs(exact.energy / report.energy - 1.0).max())
    assert far[1] == pytest.approx(4.0 * far[0], rel=0.1)


def test_a_driven_guide_that_goes_back() -> None:
    """Force by the travel of the slider, in N though lengths are in mm; friction is against the motion."""
    crank = gs.Mechanism.slider_crank(100.0, 300.0)
    pose = crank.simulate(np.array([0.5, 0.6])).poses[0]
    pump = replace(crank, drivers=(gs.Driver(0, 3),), pose=tuple(tuple(row) for row in pose))
    x = np.linspace(pose[3, 0], pose[3, 0] - 30.0, 301)
    joints = {
        joint.pair: SlideLimits(0.001, 0.001) if isinstance(joint, Prismatic) else JointLimits(0.002)
        for joint in pump.joints
    }
    axis = Misalignment(0, 1, 0.03, rigid=False)
    given: Any = {"tilt": axis, "joints": joints, "stiffness": JointStiffness(500.0, 1e6), "unit": "mm"}
    report = pump.simulate(x).binding(**given, friction=ContactFriction(0.1, 0.01, 0.03))
    slope = np.gradient(report.energy, 1e-3 * x)[1:-1]
    np.testing.assert_allclose(report.elastic_torque[1:-1], slope, atol=1e-4 * np.abs(slope).max())
    np.testing.assert_allclose(report.torque, report.friction_torque - report.elastic_torque, rtol=1e-12)
    assert 0.0 <= report.work_error < 1e-5
    guide = next(row for row in report.wear if row.joint == (0, 3))
    assert guide.sliding == pytest.approx(0.03, rel=1e-9) and guide.wear > 0.0
    assert "N, at input" in report.statement
    assert report.exact([0]).torque[0] == pytest.approx(report.elastic_torque[0], rel=3e-3)


def test_singular_positions_are_told() -> None:
    """At a change point the torque is not known, and where nothing is assembled nothing is."""
    flat = gs.Mechanism.four_bar(0.2, 0.1, 0.2, 0.1).simulate(np.linspace(0.0, math.tau, 9))
    report = flat.binding(tilt=0.02, joints=0.001, stiffness=1e6)
    assert np.isnan(report.torque[0])
    assert np.isfinite(report.energy[:4]).all()
    assert np.isfinite(report.torque[1:4]).all()
    assert any("change points" in note for note in report.notes)
    assert any("not assembled" in note for note in report.notes)
    apart = gs.Mechanism.four_bar(0.3, 0.2, 0.15, 0.3).simulate([0.0])
    assert not apart.assembled.any()
    nothing = apart.binding(tilt=0.02, joints=0.001, stiffness=1e6)
    assert nothing.answer == "not assembled"
    assert math.isnan(nothing.peak_torque)
    assert "assembled" in repr(nothing)
    steep = LAMBDA.binding(tilt=0.3, joints=0.0, stiffness=1e6)
    assert any("rough model" in note for note in steep.notes)


def test_stiffness_over_nine_decades() -> None:
    """Energy and torque grow with the stiffness, whatever its size."""
    base = LAMBDA.binding(tilt=0.03, joints=0.006, stiffness=1.0)
    for k in (1e3, 1e6, 1e12):
        report = LAMBDA.binding(tilt=0.03, joints=0.006, stiffness=k)
        np.testing.assert_allclose(report.energy, k * base.energy, rtol=1e-9)
        np.testing.assert_allclose(report.elastic_torque, k * base.elastic_torque, rtol=1e-6, atol=1e-9 * k)
    mixed = {(0, 1): 1e3, (1, 2): 1e12, (2, 3): 1e3, (0, 3): 1e12}
    rigid = {(0, 1): 1e3, (1, 2): math.inf, (2, 3): 1e3, (0, 3): math.inf}
    a, b = (LAMBDA.binding(tilt=0.03, joints=0.006, stiffness=own) for own in (mixed, rigid))
    np.testing.assert_allclose(a.energy, b.energy, rtol=1e-6, atol=1e-12)


@pytest.mark.long
def test_programs_against_projected_gradients() -> None:
    """Random programs with a third of the limits zero or infinite."""
    random = np.random.default_rng(5)
    for k, blocks in ((3, 4), (6, 7)):
        M, W = random.normal(size=(8, blocks, 2, k)), random.normal(size=(8, k))
        Q = random.normal(size=(8, k, k))
        K, t = Q @ Q.transpose(0, 2, 1) + 0.01 * np.eye(k), 0.1 * random.uniform(0.2, 1.0, blocks)
        t[0] = math.inf
        found = least_energy(M, t, W, K)
        for n in range(8):
            null = np.linalg.svd(M[n, 0])[2][2:].T
            rest = null.T @ W[n]
            inverse = np.linalg.inv(null.T @ K[n] @ null)
            A = np.einsum("biu,uv->vbi", M[n, 1:], null).reshape(k - 2, -1)
            L, g, v, s = np.linalg.norm(A.T @ inverse @ A, 2), np.zeros(A.shape[1]), np.zeros(A.shape[1]), 1.0
            for _ in range(4000):
                new = (v + A.T @ (inverse @ (rest - A @ v)) / L).reshape(-1, 2)
                new *= np.minimum(1.0, t[1:] / np.maximum(np.hypot(*new.T), 1e-300))[:, None]
                after = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * s * s))
                v = new.ravel() + (s - 1.0) / after * (new.ravel() - g)
                g, s = new.ravel(), after
            r = rest - A @ g
            assert found.energy[n] == pytest.approx(0.5 * r @ inverse @ r, rel=1e-6, abs=1e-9)


def test_torsion_of_a_bar() -> None:
    """Of a thin strip a b^3/3; of a square 0.1406 a^4 [Timoshenko]."""
    thin = LinkSection.rectangular(2.6, 1.0, 1e-3)
    assert thin.torsion == pytest.approx(1e-9 / 3.0, rel=1e-3)
    square = LinkSection.rectangular(2.6, 1.0, 1.0)
    assert square.torsion == pytest.approx(0.1406, rel=5e-3)
    assert LinkSection.round(1.0, 2.0).bending == pytest.approx(math.pi / 4.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"stiffness": None}, "nothing gives way"),
        ({"stiffness": -1.0}, "must be positive"),
        ({"stiffness": {(0, 2): 1.0}}, "does not exist"),
        ({"friction": 0.1}, "size of its contacts"),
        ({"links": 3.0}, "LinkSection"),
        ({"links": {7: LinkSection(1.0, 1.0)}}, "does not exist"),
        ({"unit": "furlong"}, "no unit of length"),
        ({"motor_torque": 0.0}, "must be positive"),
        ({"joints": None}, "limits of the joints"),
    ],
)
def test_bad_arguments(change: dict[str, Any], words: str) -> None:
    given = {"tilt": 0.03, "joints": 0.006, "stiffness": 1.0} | change
    with pytest.raises(GeometryError, match=words):
        binding_torque(LAMBDA, **given)


def test_the_report_shows_itself() -> None:
    report = LAMBDA.binding(tilt=0.03, joints=Bearing(), stiffness=900.0, friction=0.1, motor_torque=5.0)
    assert len(repr(report).splitlines()) <= 10
    assert "<svg" in report._repr_html_()
    assert set(report.summary()) >= {"answer", "peak_torque", "wear"}
    assert len(report.to_pandas()) == len(U)
    assert "sampling" in report.details() and "both ends of its bearing" in report.details()
    assert report.share == np.mean(report.energy > 0.0)
    open_joints = {joint.pair: FREE for joint in LAMBDA.mechanism.joints} | {(0, 1): RIGID}
    free = LAMBDA.binding(tilt=0.03, joints=open_joints, stiffness=1.0)
    assert repr(free).startswith("Estimated: free")
