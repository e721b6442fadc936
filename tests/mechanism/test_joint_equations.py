"""Joint equations in every arithmetic, and a kind of joint added from outside: one class and one entry in a table."""

import math
from dataclasses import dataclass
from typing import ClassVar

import mpmath
import numpy as np
import pytest
import sympy

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, certify, simulate
from graphsynth.core.checks import positive
from graphsynth.intervals import Dual, Interval, atan2, cos, hypot, sin, variables
from graphsynth.intervals.balls import Balls
from graphsynth.kinematics.certify.equations import MechanismSystem
from graphsynth.kinematics.engine import codes, program
from graphsynth.mechanism import joints
from graphsynth.mechanism.constraints import jacobian, mobility_report, residual
from graphsynth.mechanism.equations import Gradient, Plane, derivatives, seen
from graphsynth.mechanism.files import from_json, to_json
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic

INTERVALS = Plane(sin, cos, hypot, atan2)
MPMATH = Plane(mpmath.sin, mpmath.cos, mpmath.hypot, mpmath.atan2)
SYMBOLS = Plane(sympy.sin, sympy.cos, lambda x, y: sympy.sqrt(x**2 + y**2), sympy.atan2)


# --- the template of a new kind of joint: what follows would be one class in joints.py and one line in program.py


@dataclass(frozen=True)
class Rod(joints.PlanarJoint):
    """A massless bar with pins at both ends: ``at_b`` stays at a distance from ``at_a`` (one equation)."""

    at_a: tuple[float, float] = (0.0, 0.0)
    at_b: tuple[float, float] = (0.0, 0.0)
    length: float = 1.0

    mobility: ClassVar[int] = 2
    kind: ClassVar[str] = "rod"

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "length", positive("length", self.length))

    def row(self):
        return (*self.at_a, 0.0, *self.at_b, 0.0, self.length, 0.0, 0.0, 0.0)

    def values(self, at):
        return [at.plane.length(at.d) - self.length]

    def gradients(self, at):
        return [Gradient(at.d * (1.0 / at.plane.length(at.d)))]


@pytest.fixture
def rod(monkeypatch):
    monkeypatch.setitem(joints.KINDS, "rod", Rod)
    monkeypatch.setitem(
        program.FURTHER, "rod", lambda size: [(codes.DIST, {codes.H: size[6], codes.INVERSE: 1.0 / size[6]})]
    )


def four_bar(last):
    """A four-bar; the coupler is a link with two pins, or a rod."""
    crank, rocker = Revolute(0, 1), Revolute(0, 2, (2.0, 0.0))
    if last is Rod:
        graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
        return Mechanism(graph, [crank, rocker, Rod(1, 2, (1.0, 0.0), (2.5, 0.0), 2.5)], [Driver(0, 1)])
    graph = MechanismGraph(4, [(0, 1), (0, 2), (1, 3), (2, 3)], frame=0)
    pins = [Revolute(1, 3, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0))]
    return Mechanism(graph, [crank, rocker, *pins], [Driver(0, 1)])


def test_a_new_kind_of_joint_moves_like_the_link_it_stands_for(rod):
    u = np.linspace(0.0, math.tau, 49)
    bar, links = simulate(four_bar(Rod), u), [simulate(four_bar(Revolute), u, modes={0: sign}) for sign in (1, -1)]
    assert bar.completed and all(link.completed for link in links)
    assert min(np.abs(bar.poses[:, 2] - link.poses[:, 2]).max() for link in links) < 1e-12
    assert np.abs(residual(bar.mechanism.joints, bar.poses)).max() < 1e-12


def test_a_new_kind_of_joint_is_certified_ranked_and_filed(rod):
    motion = simulate(four_bar(Rod), np.linspace(0.0, math.tau, 49))
    proof = certify(motion)
    assert proof.certified and proof.closed
    report = mobility_report(motion.mechanism, motion.poses[3])
    assert report.count == report.by_rank == 1
    assert from_json(to_json(motion.mechanism)).joints == motion.mechanism.joints


# --- every kind in every arithmetic

SOME = [
    Revolute(0, 1, (0.5, -0.25), (1.0, 0.75)),
    Prismatic(0, 1, (0.5, -0.25), (1.0, 0.75), 0.5, -1.25),
    PinSlot(0, 1, (0.5, -0.25), (1.0, 0.75), 0.5),
    Gear(0, 1, (0.5, -0.25), (1.0, 0.75), 1.5, 0.5, True, 0.125),
    Cam(0, 1, (0.5, -0.25), (1.0, 0.75), 0.5, 2.0, ((0.25, -0.125), (0.0625, 0.03125))),
    Rod(0, 1, (0.5, -0.25), (1.0, 0.75), 1.75),
]
POSES = np.array([[0.25, -0.5, 0.75], [1.5, 1.0, -0.5]])


def both(plane, joint, numbers):
    """Values, and derivatives by the six coordinates with zeros filled in."""
    at = seen(plane, joint, tuple(numbers[:3]), tuple(numbers[3:]))
    rows = [[0.0 if one is None else one for one in (*a, *b)] for a, b in derivatives(at, joint.gradients(at))]
    return joint.values(at), rows


@pytest.mark.parametrize("joint", SOME, ids=lambda joint: joint.kind)
def test_floats_are_inside_of_intervals_and_near_many_digits(joint):
    rows = jacobian([joint], POSES)
    with mpmath.workdps(40):
        _, exact = both(MPMATH, joint, [mpmath.mpf(float(x)) for x in POSES.ravel()])
        np.testing.assert_allclose(rows, np.array(exact, dtype=float), rtol=1e-14, atol=1e-14)
        _, enclosed = both(INTERVALS, joint, [Interval(float(x)) for x in POSES.ravel()])
        for row, precise in zip(enclosed, exact):
            for one, number in zip(row, precise):
                assert Interval(one).lo <= number <= Interval(one).hi


@pytest.mark.long
@pytest.mark.parametrize("joint", SOME, ids=lambda joint: joint.kind)
def test_derivatives_are_those_of_the_values(joint):
    """Automatic derivatives of the values over a box, and formulas, against the derivatives that the class states."""
    numbers = variables(Interval.from_bounds(POSES.ravel() - 1e-9, POSES.ravel() + 1e-9)[None])
    values, rows = both(INTERVALS, joint, numbers)
    for value, row in zip(values, rows):
        automatic = value.grad.reshape(-1)
        stated = [(one.value if isinstance(one, Dual) else Interval(one)).reshape(-1)[0] for one in row]
        assert all(bool((a - s).mag < 1e-6) for a, s in zip(automatic, stated))
    symbols = sympy.symbols("xa ya ta xb yb tb", real=True)
    values, rows = both(SYMBOLS, joint, symbols)
    at = dict(zip(symbols, POSES.ravel().tolist()))
    for value, row in zip(values, rows):
        for symbol, one in zip(symbols, row):
            assert float(sympy.diff(value, symbol).subs(at)) == pytest.approx(float(sympy.sympify(one).subs(at)))


def test_balls_hold_the_floats(rod):
    mechanism = four_bar(Rod)
    system, random = MechanismSystem(mechanism), np.random.default_rng(3)
    poses = random.normal(size=(5, 3, 3))
    poses[:, 0] = 0.0
    x, u = poses[:, 1:].reshape(5, -1), np.zeros(5)
    J, _ = system.derivatives(Balls(x, np.zeros_like(x)), Balls(u, u), system.units(x, u))
    own = jacobian(mechanism.joints, poses)[..., 3:]
    assert (np.abs(J.mid[:, :5] - own) <= J.rad[:, :5] + 1e-14).all()
