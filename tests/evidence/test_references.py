"""The references are right: against the specification, closed forms and brute force."""

import math

import mpmath
import numpy as np
import pytest

from graphsynth import LambdaLinkage, ParallelPlatform, SingleMotorPlatform
from graphsynth.core.errors import GeometryError
from graphsynth.evidence.crossing import precise_area, precise_crossing
from graphsynth.evidence.embodiment import precise_strip
from graphsynth.evidence.jamming import precise_arc_ends, precise_critical_tilt
from graphsynth.evidence.position import four_bar, precise_points, precise_poses
from graphsynth.jamming import Bearing, ToleranceBox
from graphsynth.jamming.intersection.hull import surrogate_problem
from graphsynth.systems.platform.evidence import precise_branch
from graphsynth.systems.platform.evidence_direct import eigenvalue_modes, precise_anchors, precise_modes


def test_modes_of_g1_of_the_specification():
    g1 = ParallelPlatform.g1()  # theory/values-of-the-platform 3
    modes = precise_modes(precise_anchors(g1, np.zeros(3)), g1.b, g1.l2)
    right = [
        (2.201176574824335152, 0.85920239409603039, -0.16764789067400023),
        (2.17219297078024771, 0.78662438809005049, 0.47804588469221801),
    ]
    assert np.abs(modes - right).max() < 1e-15


def test_modes_of_g1_at_another_pose_of_the_specification():
    g1 = ParallelPlatform.g1()  # theory/values-of-the-platform 1
    theta = np.array([1.820203731367051943, -2.644475043988912944, -0.1619825351011604738])
    modes = precise_modes(precise_anchors(g1, theta), g1.b, g1.l2)
    right = [(1.170779876116247461, 1.0132616187106641, -1.20068946437938629), (1.2, 0.9, 0.15)]
    assert np.abs(modes - right).max() < 1e-14  # the angles given are rounded


def test_reference_modes_close_the_legs_and_come_in_pairs():
    random = np.random.default_rng(5)
    for _ in range(6):
        A = random.normal(size=3) + 1j * random.normal(size=3)
        b = random.normal(size=3) + 1j * random.normal(size=3)
        pose, alpha = complex(*random.normal(size=2)), random.uniform(-3, 3)
        l2 = np.abs(pose + np.exp(1j * alpha) * b - A)  # a mode is known
        modes = precise_modes(A.tolist(), b.tolist(), l2.tolist())
        assert len(modes) % 2 == 0
        legs = np.abs(modes[:, :1] + 1j * modes[:, 1:2] + np.exp(1j * modes[:, 2:]) * b - A)
        assert np.abs(legs - l2).max() < 1e-13
        assert np.abs(modes - [pose.real, pose.imag, alpha]).max(axis=1).min() < 1e-11


def test_eigenvalues_find_the_same_modes():
    g1 = ParallelPlatform.g1()
    theta = np.random.default_rng(1).uniform(-3, 3, (8, 3))
    found = eigenvalue_modes(g1.elbows(theta), np.array(g1.b), np.array(g1.l2), polish=2)
    for own, angles in zip(found, theta):
        right = precise_modes(precise_anchors(g1, angles), g1.b, g1.l2)
        assert own.shape == right.shape
        assert own.size == 0 or np.abs(own - right).max() < 1e-12


def test_arc_ends_of_the_specification():
    ends = precise_arc_ends(ToleranceBox(alpha="1/30"))  # theory/jam-arcs 1: condition A
    right = [27.0592203251509475645179736478, 152.940779674849052435482026352]
    assert np.abs(np.degrees(ends) - [*right, 180 + right[0], 180 + right[1]]).max() < 1e-13


@pytest.mark.parametrize("condition", ["A", "B"])
def test_arc_ends_are_where_the_gap_changes_sign(condition):
    box = ToleranceBox(l3="2.2", alpha="0.05", axis=(1, "0.4", "0.2"), azimuth="0.3")
    linkage, bearing = box.nominal()
    f = np.linspace(0.0, math.tau, 200_001)
    path = linkage.positions(f)
    sign = bearing.interference(path.sin_theta, path.cos_theta, condition) > 0
    changes = f[np.flatnonzero(sign[1:] != sign[:-1])]
    ends = np.array(precise_arc_ends(box, condition))
    assert len(changes) == len(ends) == 4
    assert np.abs(np.sort(changes) - ends).max() < math.tau / 200_000


def test_no_arc_ends_without_a_jam():
    assert precise_arc_ends(ToleranceBox(alpha="0.001")) == ()
    with pytest.raises(GeometryError, match="single dimensions"):
        precise_arc_ends(ToleranceBox(alpha="0.03 +- 0.001"))


def test_crossing_lies_on_both_curves():
    problem = surrogate_problem(Bearing(), "0.0133308643347")
    x, y = precise_crossing(problem)
    with mpmath.workdps(40):
        a, b, R = (mpmath.mpf(r.lo.numerator) / r.lo.denominator for r in (problem.a, problem.b, problem.R1))
        assert abs(x * x + y * y - R * R) < 1e-35
        assert abs((x / a) ** 2 + (y / b) ** 2 - 1) < 1e-35


def test_no_crossing_below_the_critical_tilt():
    with pytest.raises(GeometryError, match="do not cross"):
        precise_crossing(surrogate_problem(Bearing(), "0.001"))


def test_strip_of_the_lambda_linkage():
    path = LambdaLinkage().positions(np.linspace(math.pi / 2, 1.5 * math.pi, 100_001)).M[:, 1]
    assert abs(np.ptp(path) / 4 - precise_strip()) < 1e-10  # samples miss the top by the square of their distance


def test_positions_of_the_specification():
    # theory/four-bar-and-tilt 4: at 90 degrees B lies at (2, 2.5)
    mechanism, (_, closed) = four_bar(LambdaLinkage())
    assert abs(precise_points(mechanism, np.array([math.pi / 2]))[0] - (2 + 2.5j)) < 1e-15
    assert abs(closed(np.array([math.pi / 2]))[0] - (2 + 2.5j)) < 1e-15


@pytest.mark.parametrize("sgn", [1, -1])
def test_precise_poses_agree_with_circles_in_fifty_digits(sgn):
    linkage = LambdaLinkage(2.2, 1.0, 2.4, 2.3, sgn=sgn)
    mechanism, _ = four_bar(linkage)
    u = np.array([0.3, 2.0, 4.4])
    for angle, point in zip(u, precise_points(mechanism, u)):
        with mpmath.workdps(50):
            A, C = mpmath.expj(mpmath.mpf(float(angle))), mpmath.mpf(linkage.l1)
            w = A - C
            cosine = (abs(w) ** 2 + mpmath.mpf(linkage.l4) ** 2 - mpmath.mpf(linkage.l3) ** 2) / (
                2 * abs(w) * linkage.l4
            )
            ends = [C + linkage.l4 * w / abs(w) * mpmath.expj(s * mpmath.acos(cosine)) for s in (1, -1)]
            assert min(abs(complex(end) - point) for end in ends) < 1e-15
    assert abs(np.imag(precise_points(mechanism, np.array([0.0]))[0])) > 0.1
    assert np.sign(np.imag(precise_points(mechanism, np.array([0.0]))[0])) == sgn


def test_a_singular_pose_has_no_reference():
    from graphsynth import Driver, Mechanism, MechanismGraph, Revolute

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    flat = Mechanism(graph, (
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.0, 0.0), (1.0, 0.0)), Revolute(0, 3, (4.0, 0.0)),
    ), (Driver(0, 1),))  # fmt: skip
    guess = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [4, 0, math.pi]], dtype=float)
    with pytest.raises((GeometryError, ZeroDivisionError)):
        precise_poses(flat, 0.0, guess)


def test_branch_is_one_of_all_poses_of_the_platform():
    machine = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
    psi = np.array([0.0, 1.0, 4.0])
    near = machine.sweep(psi).pose
    for angle, pose in zip(psi, precise_branch(machine, psi, near)):
        every = machine.all_poses(float(angle))
        assert np.abs((every - pose) / [45, 45, 1]).max(axis=1).min() < 1e-14


def test_area_of_the_specification():
    worst = "0.01333086433470144655443037446460955080344"  # 0.4 sin(1/30): the largest tilt of the linkage

    # docs/explanation/errata.md: the free gap at the worst pose, 25 digits
    with mpmath.workdps(30):
        assert abs(precise_area(Bearing(), worst) - mpmath.mpf("0.9749683652811658362854900")) < mpmath.mpf("1e-24")


def test_the_closed_form_of_coupled_joints_keeps_its_digits():
    from graphsynth.evidence.jamming import exact_largest

    found = exact_largest(LambdaLinkage(), Bearing())  # theory/joints-that-share-a-tilt 6
    with mpmath.workdps(45):
        assert abs(found - mpmath.mpf("0.012128793118312840120532205597449602345")) < mpmath.mpf("1e-38")


def test_critical_tilt_of_the_specification():
    with mpmath.workdps(45):  # theory/joints-that-share-a-tilt 6: the whole turn is free up to twice this
        twice = 2 * precise_critical_tilt(Bearing())
        assert abs(twice - mpmath.mpf("0.012128793118312840120532205597449602345")) < mpmath.mpf("1e-38")


@pytest.mark.parametrize("order", ["YX", "XY"])
def test_rods_and_closed_form_agree_in_fifty_digits(order):
    from graphsynth.systems.antenna import PointingMechanism
    from graphsynth.systems.antenna.evidence import rod_angles
    from graphsynth.systems.antenna.precise import precise_angles

    mechanism = PointingMechanism(order=order)
    pose = mechanism.poses(0.5, -0.3)
    found = rod_angles(mechanism, 0.5, -0.3, (float(pose.a), float(pose.b)))
    assert all(abs(p - q) < mpmath.mpf("1e-45") for p, q in zip(found, precise_angles(mechanism, 0.5, -0.3)))


def test_a_pendulum_falls_as_the_elliptic_integral_says():
    # released at rest at 2 rad from the vertical: a quarter period is K(sin 1) sqrt(l / g)
    from graphsynth.evidence.precise_drive import precise_drive

    def shape(q):
        return np.longdouble(1), np.longdouble(0), -np.sin(np.longdouble(q))

    quarter = float(mpmath.ellipk(mpmath.sin(1) ** 2))
    end = precise_drive(shape, None, 1.0, 0.0, 0.0, [0.0, quarter / 2, quarter], angle=2.0)[-1]
    assert abs(float(end[0])) < 2e-15  # the end itself is rounded to a double
    assert abs(float(end[1]) + 2.0 * math.sin(1.0)) < 1e-15


def test_a_motor_without_load_follows_its_exponentials():
    from graphsynth.dynamics.motors import DCMotor
    from graphsynth.evidence.precise_drive import precise_drive

    motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=2.0, speed=20.0, rotor_inertia=0.003)
    found = precise_drive(lambda q: (np.longdouble(0),) * 3, motor, 1.0, 0.0, 0.0, [0.0, 0.4])[-1]
    with mpmath.workdps(40):  # w' = Km i / J, i' = (K (wd - w) - R i - ce w) / L
        mpf = mpmath.mpf
        A = mpmath.matrix([[0, mpf(0.1) / mpf(0.003)], [-(mpf(2.0) + mpf(0.1)) / mpf(0.2), -mpf(1.0) / mpf(0.2)]])
        rest = mpmath.lu_solve(A, mpmath.matrix([0, -mpf(40) / mpf(0.2)]))
        right = rest - mpmath.expm(A * mpf(0.4), method="taylor") * rest
        assert all(abs(mpf(float(p)) - q) < 1e-14 * abs(q) for p, q in zip(found[1:], right))


def test_four_bar_in_long_doubles_is_the_braider():
    from graphsynth.systems.braider.evidence import places, shape_of_braider
    from graphsynth.systems.braider.model import Braider

    braider = Braider()
    shape = shape_of_braider(braider)
    for theta in (0.3, 2.0, 4.4):
        J, half, load = (float(value) for value in shape(theta))
        value, slope = braider.effective_inertia(theta)
        assert abs(J + braider.reflected_inertia - float(value)) < 1e-16
        assert abs(2.0 * half - float(slope)) < 1e-18
        right = float(braider.load_moment(theta) * braider.linkage.motion(theta).k3)
        assert abs(load - right) < 1e-16
        # the joints stay closed: the end of the coupler is that of the rocker
        at, bar = places(braider.linkage, braider.bodies, theta), braider.linkage
        middle, turn = complex(at[3], at[4]), np.exp(1j * float(at[5]))
        end = bar.frame + bar.rocker * np.exp(1j * float(at[8]))
        assert abs(middle + bar.coupler / 2 * turn - end) < 1e-17
