"""The joint equations of a mechanism in balls, with the driver coordinates held at the value of their laws.

The same equations as `graphsynth.mechanism.constraints`, plus one row per driver: ``theta_link - theta_base - q(u)`` or
``displacement - q(u)``.  Unknowns are the poses of the moving links.  Angles are counted, not reduced: each angular row
holds up to whole turns that `MechanismSystem.branch` states.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, exact, stack, tau_times, unit
from graphsynth.kinematics.certify.laws import law_rate, law_value
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.model import Driver, Mechanism
from graphsynth.mechanism.rank import characteristic_length

__all__ = ["MechanismSystem"]

Array = NDArray[np.float64]


class _Place:
    """Positions and directions of links over N boxes, with the derivatives the rows need."""

    def __init__(self, system: MechanismSystem, x: Balls, units: Balls) -> None:
        self.system, self.x, self.count = system, x, len(x.mid)
        self.turned = {}
        for link, column in system.column.items():
            z = Balls(units.mid[:, column // 3], units.rad[:, column // 3])
            self.turned[link] = z.wider(x.rad[:, column + 2])

    def arm(self, link: int, local: tuple[float, float]) -> Balls:
        """Vector from the origin of a link to a point of it."""
        value = exact(np.full(self.count, complex(*local)))
        return value if link == self.system.frame else self.turned[link] * value

    def point(self, link: int, arm: Balls) -> Balls:
        if link == self.system.frame:
            return arm
        k = self.system.column[link]
        x, y = self.x[:, k], self.x[:, k + 1]
        return Balls(x.mid + 1j * y.mid, x.rad + y.rad).wider(0.0) + arm

    def direction(self, link: int, key: int) -> Balls:
        """Return the unit vector of the line that joint number ``key`` has on link a."""
        own = self.system.fixed[key]
        value = Balls(np.full(self.count, own.mid), np.full(self.count, own.rad))
        return value if link == self.system.frame else self.turned[link] * value

    def angle(self, link: int) -> Balls:
        if link == self.system.frame:
            return exact(np.zeros(self.count))
        return self.x[:, self.system.column[link] + 2]


class MechanismSystem:
    """Equations of a mechanism as a `System` of the Krawczyk test.

    Raises
    ------
    GeometryError
        If equations and unknowns differ in number: the certificate is for mechanisms with one driver per freedom; or
        if there is a cam.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        cam = next((joint for joint in mechanism.joints if isinstance(joint, Cam)), None)
        if cam is not None:
            raise GeometryError(f"joint {cam.a}-{cam.b} is a cam: there are no certificates for cams, only estimates")
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
        angles = np.array([getattr(joint, "angle_a", 0.0) for joint in mechanism.joints])
        directions = unit(exact(angles))
        self.fixed = [Balls(directions.mid[k], directions.rad[k]) for k in range(len(angles))]
        self.Lc = characteristic_length(mechanism)
        self.driven = [(driver, mechanism.joint(*driver.pair)) for driver in mechanism.drivers]
        self.slides = {driver.pair: k for k, joint in enumerate(mechanism.joints) for driver in mechanism.drivers
                       if joint.pair == driver.pair}  # fmt: skip

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
        for key, joint in enumerate(self.mechanism.joints):
            d = self._gap(place, joint)[0]
            if isinstance(joint, Revolute):
                rows += [d.real, d.imag]
            elif isinstance(joint, Gear):
                rows.append(self._gear(place, joint, self._mesh(place, joint)))
            else:
                rows.append((place.direction(joint.a, key).conj * d).imag)
                if isinstance(joint, Prismatic):
                    value = self._parallel(place, joint)
                    rows.append(value - tau_times(_turns(value)))
        rows += [self._driver_row(place, driver, joint, u) for driver, joint in self.driven]
        return stack(rows)

    def _gap(self, place: _Place, joint: JointGeometry) -> tuple[Balls, Balls, Balls]:
        """Vector from the point of a to that of b, and the two arms."""
        arm_a, arm_b = place.arm(joint.a, joint.at_a), place.arm(joint.b, joint.at_b)
        return place.point(joint.b, arm_b) - place.point(joint.a, arm_a), arm_a, arm_b

    def _parallel(self, place: _Place, joint: Prismatic) -> Balls:
        a = place.angle(joint.a) + exact(joint.angle_a)
        return place.angle(joint.b) + exact(joint.angle_b) - a

    def _mesh(self, place: _Place, joint: Gear) -> Balls:
        """Direction of the line of centres, counted so that the gear equation is as near to zero as it can be."""
        phi = _argument(self._gap(place, joint)[0])
        total = joint.radius_a + (-1.0 if joint.internal else 1.0) * joint.radius_b
        return phi + tau_times(_turns(self._gear(place, joint, phi), total))

    def _gear(self, place: _Place, joint: Gear, phi: Balls) -> Balls:
        sign = -1.0 if joint.internal else 1.0
        first = exact(joint.radius_a) * (place.angle(joint.a) - phi)
        return first + exact(sign * joint.radius_b) * (place.angle(joint.b) - phi - exact(joint.offset))

    def _driver_row(self, place: _Place, driver: Driver, joint: JointGeometry, u: Balls) -> Balls:
        q = law_value(driver.law, u)
        if isinstance(joint, Prismatic):
            key = self.slides[driver.pair]
            along = (place.direction(joint.a, key).conj * self._gap(place, joint)[0]).real
            return (along if driver.base == joint.a else -along) - q
        value = place.angle(driver.link) - place.angle(driver.base) - q
        return value - tau_times(_turns(value))

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Return turns of sliding pairs and drivers in order, and directions of lines of centres of gears."""
        units = self.units(x.mid, u)
        centre, place = _Place(self, exact(x.mid), units), _Place(self, x, units)
        turns, directions = [], []
        for joint in self.mechanism.joints:
            if isinstance(joint, Prismatic):
                turns.append(_turns(self._parallel(centre, joint)))
            elif isinstance(joint, Gear):
                counted = self._mesh(centre, joint)
                directions.append(Balls(counted.mid, _argument(self._gap(place, joint)[0]).rad + 1e-9))
        for driver, joint in self.driven:
            if isinstance(joint, Revolute):
                value = centre.angle(driver.link) - centre.angle(driver.base) - law_value(driver.law, exact(u))
                turns.append(_turns(value))
        n = len(x.mid)
        return (
            np.stack(turns, axis=1).astype(np.int64) if turns else np.zeros((n, 0), dtype=np.int64),
            stack(directions) if directions else exact(np.zeros((n, 0))),
        )

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """``df/dx`` (N, n, n) and ``df/du`` (N, n)."""
        place = _Place(self, x, units)
        table = _Table(self, len(x.mid))
        for key, joint in enumerate(self.mechanism.joints):
            d, arm_a, arm_b = self._gap(place, joint)
            if isinstance(joint, Revolute):
                table.vector(joint.a, -1.0, arm_a)
                table.vector(joint.b, 1.0, arm_b)
                table.row += 2
            elif isinstance(joint, Gear):
                self._gear_derivatives(table, joint, d, arm_a, arm_b)
            else:
                t = place.direction(joint.a, key)
                table.line(joint, t.times_i, d, t, arm_a, arm_b)
                table.row += 1
                if isinstance(joint, Prismatic):
                    table.put(joint.a, 2, exact(-1.0))
                    table.put(joint.b, 2, exact(1.0))
                    table.row += 1
        for driver, joint in self.driven:
            self._driver_derivatives(table, place, driver, joint, u)
        return table.J(), table.rate()

    def _gear_derivatives(self, table: _Table, joint: Gear, d: Balls, arm_a: Balls, arm_b: Balls) -> None:
        sign = -1.0 if joint.internal else 1.0
        normal = d.times_i * _inverse_square(d)
        total = exact(-1.0) * (exact(joint.radius_a) + exact(sign * joint.radius_b))
        for link, weight, arm in ((joint.a, -total, arm_a), (joint.b, total, arm_b)):
            table.put(link, 0, weight * normal.real)
            table.put(link, 1, weight * normal.imag)
            table.put(link, 2, weight * (normal.conj * arm.times_i).real)
        table.put(joint.a, 2, exact(joint.radius_a))
        table.put(joint.b, 2, exact(sign * joint.radius_b))
        table.row += 1

    def _driver_derivatives(self, table: _Table, place: _Place, driver: Driver, joint: JointGeometry, u: Balls) -> None:
        if isinstance(joint, Prismatic):
            d, arm_a, arm_b = self._gap(place, joint)
            t = place.direction(joint.a, self.slides[driver.pair])
            forward = driver.base == joint.a
            # displacement = Re(conj(t) d): the derivative by theta_a turns t, d/dtheta conj(t) = -i conj(t)
            table.line(joint, t if forward else -t, d, -t.times_i if forward else t.times_i, arm_a, arm_b)
        else:
            table.put(driver.link, 2, exact(1.0))
            table.put(driver.base, 2, exact(-1.0))
        table.input(-law_rate(driver.law, u))
        table.row += 1


class _Table:
    """Jacobians of N boxes while they are filled, row by row."""

    def __init__(self, system: MechanismSystem, count: int) -> None:
        n = system.size
        self.system, self.row = system, 0
        self.mid, self.rad = np.zeros((count, n, n)), np.zeros((count, n, n))
        self.input_mid, self.input_rad = np.zeros((count, n)), np.zeros((count, n))

    def put(self, link: int, axis: int, value: Balls, row: int = 0) -> None:
        """Add to the entry of a link's coordinate; nothing for the frame."""
        if link == self.system.frame:
            return
        k = (slice(None), self.row + row, self.system.column[link] + axis)
        total = Balls(self.mid[k], self.rad[k]) + value
        self.mid[k], self.rad[k] = total.mid, total.rad

    def vector(self, link: int, sign: float, arm: Balls) -> None:
        """Add the derivatives of ``sign`` times a point of a link, two rows."""
        self.put(link, 0, exact(sign), 0)
        self.put(link, 1, exact(sign), 1)
        self.put(link, 2, exact(-sign) * arm.imag, 0)
        self.put(link, 2, exact(sign) * arm.real, 1)

    def line(self, joint: JointGeometry, n: Balls, d: Balls, t: Balls, arm_a: Balls, arm_b: Balls) -> None:
        """Add the derivatives of ``Re(conj(n) d)``, where n turns with link a and dn/dtheta_a = -t."""
        for link, sign, arm in ((joint.a, -1.0, arm_a), (joint.b, 1.0, arm_b)):
            self.put(link, 0, exact(sign) * n.real)
            self.put(link, 1, exact(sign) * n.imag)
            self.put(link, 2, exact(sign) * (n.conj * arm.times_i).real)
        self.put(joint.a, 2, -(t.conj * d).real)

    def input(self, value: Balls) -> None:
        """Set the derivative of the row by the input."""
        self.input_mid[:, self.row], self.input_rad[:, self.row] = value.mid, value.rad

    def J(self) -> Balls:
        return Balls(self.mid, self.rad)

    def rate(self) -> Balls:
        return Balls(self.input_mid, self.input_rad)


def _turns(value: Balls, period: float = 1.0) -> Array:
    """Whole number of turns (times ``period``) in the midpoints."""
    whole = np.round(value.mid / (2.0 * np.pi * period))
    return np.where(np.isfinite(whole), whole, 0.0)


def _inverse_square(d: Balls) -> Balls:
    square = (d * d.conj).real
    return exact(1.0) / square


def _argument(d: Balls) -> Balls:
    """Argument of every member, continuous over the ball; infinite radius if zero may be inside.

    The library's value at the midpoint is checked by turning back: ``d exp(-i phi)`` must lie on the positive axis.
    """
    phi = np.angle(d.mid)
    back = exact(d.mid) * unit(exact(-phi))
    least = back.real.mid - back.rad
    with np.errstate(all="ignore"):
        error = back.imag.size / least  # tangent of the error of phi
        sine = d.rad / (np.abs(d.mid) * (1.0 - 1e-15))
        spread = sine / np.sqrt(np.maximum(1.0 - sine * sine, 0.0))  # at least the arc sine
        rad = (error + spread * (1.0 + 1e-14)) * (1.0 + 1e-14) + 1e-300
    good = (least > 0.0) & (sine < 0.99) & np.isfinite(rad)
    return Balls(phi, np.where(good, rad, np.inf))
