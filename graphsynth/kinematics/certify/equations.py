"""The joint equations of a mechanism in balls, with the driver coordinates held at the value of their laws.

The equations are those of the joints (`graphsynth.mechanism.joints`), plus one row per driver: its coordinate minus
``q(u)``.  Unknowns are the poses of the moving links.  Angles are counted, not reduced: each angular row holds up to
whole turns that `MechanismSystem.branch` states.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, argument, exact, root, stack, tau_times, unit
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.equations import Gradient, Number, Plane, Seen, derivatives
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Law, Linear, Polynomial
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


class _BallPlane(Plane):
    """Arithmetic of balls; vectors are complex balls."""

    def vector(self, x: Number, y: Number) -> Balls:
        if isinstance(x, float):
            return _fixed(x, y)
        return Balls(x.mid + 1j * y.mid, x.rad + y.rad).wider(0.0)

    def parts(self, v: Balls) -> tuple[Balls, Balls]:
        return v.real, v.imag

    def unit(self, angle: Number) -> Balls:
        return _fixed(angle) if isinstance(angle, float) else unit(angle)

    def turned(self, v: Balls, by: Balls) -> Balls:
        return v if by is _FRAME else by * v

    def left(self, v: Balls) -> Balls:
        return v.times_i

    def dot(self, a: Balls, b: Balls) -> Balls:
        if a is _fixed(1.0, 0.0):  # a component: nothing is multiplied, and nothing rounded
            return b.real
        return b.imag if a is _fixed(0.0, 1.0) else (a.conj * b).real

    def cross(self, a: Balls, b: Balls) -> Balls:
        return (a.conj * b).imag

    def length(self, v: Balls) -> Balls:
        return root((v * v.conj).real)

    def argument(self, v: Balls) -> Balls:
        return argument(v)


_PLANE = _BallPlane(
    lambda angle: unit(angle).imag,
    lambda angle: unit(angle).real,
    lambda x, y: root(x * x + y * y),
    lambda y, x: argument(Balls(x.mid + 1j * y.mid, x.rad + y.rad).wider(0.0)),
)
#: Direction of the frame: nothing is turned, and nothing rounded.
_FRAME = exact(1.0 + 0.0j)


@lru_cache(2048)
def _fixed(x: float, y: float | None = None) -> Balls:
    """Return a vector of floats; of an angle alone its direction."""
    return unit(exact([x]))[0] if y is None else exact(complex(x, y))


class _Place:
    """Links over N boxes."""

    def __init__(self, system: MechanismSystem, x: Balls, units: Balls) -> None:
        self.angle, self.axis, self.origin = {system.frame: exact(0.0)}, {system.frame: _FRAME}, {}
        for link, k in system.column.items():
            self.angle[link] = x[:, k + 2]
            self.axis[link] = units[:, k // 3].wider(x.rad[:, k + 2])
            self.origin[link] = _PLANE.vector(x[:, k], x[:, k + 1])

    def seen(self, joint: JointGeometry) -> Seen:
        """Both links of a joint."""
        a, b = joint.a, joint.b
        arm_a, P = self._point(a, joint.at_a)
        arm_b, Q = self._point(b, joint.at_b)
        return Seen(_PLANE, self.angle[a], self.angle[b], self.axis[a], arm_a, arm_b, Q - P)

    def _point(self, link: int, at: tuple[float, float]) -> tuple[Balls, Balls]:
        """Arm from the origin of a link to a point of it, and the point."""
        arm = _PLANE.turned(_PLANE.vector(*at), self.axis[link])
        return arm, self.origin[link] + arm if link in self.origin else arm


class MechanismSystem:
    """Equations of a mechanism as a `MovingSystem` of the Krawczyk test.

    `GeometryError` if equations and unknowns differ in number (one driver per freedom is needed).
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.frame = mechanism.frame
        self.moving = [link for link in range(mechanism.graph.links) if link != self.frame]
        self.column = {link: 3 * k for k, link in enumerate(self.moving)}
        self.size = 3 * len(self.moving)
        rows = sum(3 - joint.mobility for joint in mechanism.joints) + len(mechanism.drivers)
        if rows != self.size:
            raise GeometryError(
                f"the mechanism has {rows} equations, drivers included, for {self.size} unknowns; a certificate needs "
                "as many; use as many drivers as the mobility"
            )
        self.Lc = characteristic_length(mechanism)
        self.driven: list[tuple[Driver, Revolute | Prismatic]] = []
        for driver in mechanism.drivers:
            joint = mechanism.joint(*driver.pair)
            assert isinstance(joint, Revolute | Prismatic)
            self.driven.append((driver, joint))

    @property
    def weights(self) -> Array:
        """Characteristic length for coordinates, 1 for angles."""
        return np.tile([self.Lc, self.Lc, 1.0], len(self.moving))

    def units(self, x: Array, u: Array, checked: bool = True) -> Balls:
        """Directions of the moving links."""
        angles = x[:, 2::3]
        if checked:
            return unit(exact(angles))
        return exact(np.exp(1j * np.where(np.isfinite(angles), angles, 0.0)))

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        """``f`` (N, n)."""
        place, rows = _Place(self, x, units), []
        for joint in self.mechanism.joints:
            for value, turns in zip(joint.values(place.seen(joint)), joint.turns()):
                rows.append(_reduced(value, turns) if turns else value)
        for driver, joint in self.driven:
            value = _driven(place, driver, joint, u)
            rows.append(_reduced(value, (1.0,)) if joint.coordinate_turns else value)
        return stack(rows)

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Return turns of prismatic joints and drivers in order, and directions of lines of centres of gears."""
        units = self.units(x.mid, u)
        centre, place = _Place(self, exact(x.mid), units), _Place(self, x, units)
        turns, directions = [], []
        for joint in self.mechanism.joints:
            at = centre.seen(joint)
            for value, per_turn in zip(joint.values(at), joint.turns()) if any(joint.turns()) else ():
                if len(per_turn) == 1:
                    turns.append(_turns(value))
                elif per_turn:  # the line of centres, counted so that the equation is as near to zero as it can be
                    counted = argument(at.d) + tau_times(_turns(value, sum(per_turn)))
                    directions.append(Balls(counted.mid, argument(place.seen(joint).d).rad + 1e-9))
        turns += [_turns(_driven(centre, d, joint, exact(u))) for d, joint in self.driven if joint.coordinate_turns]
        n = len(x.mid)
        return (
            np.stack(turns, axis=1).astype(np.int64) if turns else np.zeros((n, 0), dtype=np.int64),
            stack(directions) if directions else exact(np.zeros((n, 0))),
        )

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """``df/dx`` (N, n, n) and ``df/du`` (N, n)."""
        place, count, n, row = _Place(self, x, units), len(x.mid), self.size, 0
        J = Balls(np.zeros((count, n, n)), np.zeros((count, n, n)))
        rate = Balls(np.zeros((count, n)), np.zeros((count, n)))

        def fill(joint: JointGeometry, at: Seen, gradients: list[Gradient], forward: bool = True) -> None:
            nonlocal row
            for both in derivatives(at, gradients):
                for link, entries in zip((joint.a, joint.b), both):
                    for axis, entry in enumerate(entries) if link != self.frame else ():
                        if entry is not None:
                            _put(J, (slice(None), row, self.column[link] + axis), entry if forward else -entry)
                row += 1

        for joint in self.mechanism.joints:
            at = place.seen(joint)
            fill(joint, at, joint.gradients(at))
        for driver, joint in self.driven:
            at = place.seen(joint)
            _put(rate, (slice(None), row), -law_over(driver.law, u)[1])
            fill(joint, at, [joint.coordinate(at)[1]], driver.base == joint.a)
        return J, rate


def _put(target: Balls, key: tuple[slice | int, ...], value: Balls | float) -> None:
    if isinstance(value, Balls):
        target.mid[key], target.rad[key] = value.mid, value.rad
    else:
        target.mid[key] = value


def _driven(place: _Place, driver: Driver, joint: Revolute | Prismatic, u: Balls) -> Balls:
    """Coordinate of a driver minus what its law asks for."""
    value: Balls = joint.coordinate(place.seen(joint))[0]
    return (value if driver.base == joint.a else -value) - law_over(driver.law, u)[0]


def _turns(value: Balls, period: float = 1.0) -> Array:
    """Whole number of turns (times ``period``) in the midpoints."""
    whole = np.round(value.mid / (2.0 * np.pi * period))
    return np.where(np.isfinite(whole), whole, 0.0)


def _reduced(value: Balls, turns: tuple[float, ...]) -> Balls:
    """Take whole turns off a value; ``turns`` add up to what one of them adds."""
    whole = tau_times(_turns(value, sum(turns)))
    return value - (whole if turns == (1.0,) else whole * sum(map(exact, turns[1:]), exact(turns[0])))


def law_over(law: Law, u: Balls) -> tuple[Balls, Balls]:
    """Coordinate and rate over the inputs; one without ``at`` is known at midpoints, as exact numbers."""
    if isinstance(law, Linear | Harmonic | Polynomial):
        return law.at(u, _PLANE.sin, _PLANE.cos)
    value, rate, _ = law(u.mid)
    known = np.where(u.rad > 0.0, np.inf, 0.0)
    return Balls(np.asarray(value, dtype=np.float64), known), Balls(np.asarray(rate, dtype=np.float64), known)


def whole_periods(law: Law, turns: Fraction, slides: bool) -> int | None:
    """Return the turns of the coordinate while the input grows by ``2 pi turns``; None if it does not return."""
    if isinstance(law, Linear):
        made = Fraction(law.rate) * turns
    elif isinstance(law, Harmonic):
        return 0 if (Fraction(law.order) * turns).denominator == 1 else None
    elif isinstance(law, Polynomial) and not any(law.coefficients[2:]):
        made = Fraction(law.coefficients[1] if len(law.coefficients) > 1 else 0.0) * turns
    else:
        return None
    if slides and made != 0:
        return None
    return int(made) if made.denominator == 1 else None
