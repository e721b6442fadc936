"""What varies in a mechanism with limits at all joints: lengths, limits of the joints, misalignments of axes.

Every quantity has a name and a range.  `Quantities.values` returns limits and misalignments for quantities in any
arithmetic, so that intervals and derivatives come from the same formulas (theory/probability-of-coupled-joints 1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Dual, Interval, atan, cos, sin
from graphsynth.intervals.reading import enclose
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.fits import Fit
from graphsynth.jamming.bearing.parameters import Range
from graphsynth.jamming.joints.closure import KINDS, Layout
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Limits, Misalignment, bounds
from graphsynth.jamming.joints.program import Bearings, JointProblem, problem
from graphsynth.mechanism.model import Mechanism
from graphsynth.tolerances.box import ParameterBox
from graphsynth.tolerances.parts import AxisAngle, EndFloat, FitClearance, Parallelism

#: A limit or a component of a misalignment, of all quantities.
Formula: TypeAlias = Callable[[Sequence[Any]], Any]
#: Ranges narrower than this, relative to their end, are rounding.
_ROUNDING = 1e-9


class Values(NamedTuple):
    """Limits of the blocks, axial clearances of the joints, vectors of the misalignments; infinite limits are None."""

    limits: list[Any]
    plays: list[Any]
    vectors: list[tuple[Any, Any]]


@dataclass(frozen=True, eq=False)
class Quantities:
    """Quantities of a mechanism: the parameters of ``box`` first, then those of limits and misalignments."""

    given: JointProblem
    box: ParameterBox
    ranges: dict[str, Range]
    limits: tuple[Formula | None, ...]
    plays: tuple[Formula | None, ...]
    vectors: tuple[tuple[Formula, Formula], ...]

    @property
    def layout(self) -> Layout:
        """Loops and blocks."""
        return self.given.layout

    def values(self, q: Sequence[Any]) -> Values:
        """Return limits, axial clearances and misalignments for quantities: intervals, duals or floats."""
        limits, plays = ([None if own is None else own(q) for own in part] for part in (self.limits, self.plays))
        return Values(limits, plays, [(x(q), y(q)) for x, y in self.vectors])

    def within(self, ranges: dict[str, Range]) -> Quantities:
        """Return the same quantities with other ranges."""
        size = self.box.size
        ends = [ranges[name] for name in self.box.names]
        low = np.array([min(enclose(own.lower)[0], 0.0) for own in ends])
        high = np.array([max(enclose(own.upper)[1], 0.0) for own in ends])
        box = replace(self.box, low=low, high=high) if size else self.box
        found = replace(self, box=box, ranges=ranges)
        found.check()
        return found

    def check(self) -> None:
        """Refuse ranges over which a limit is not defined or not positive somewhere."""
        values = self.values([own.outer for own in self.ranges.values()])
        for own, what in ((values.limits, "critical tilt of a joint"), (values.plays, "axial clearance of a joint")):
            for value in own:
                if value is not None and not (bool(value.guaranteed) and bool(value.is_bounded)):
                    raise GeometryError(
                        f"the {what} is not defined for all tolerances (a bearing so short that it never binds); "
                        "leave that joint free, or narrow its fit"
                    )
                if value is not None and float(value.lo) < 0.0:
                    raise GeometryError(
                        f"the {what} is negative for some members of the tolerances ({float(value.lo):.6g}): their "
                        "parts interfere and cannot be assembled; narrow the fit"
                    )


class _Making:
    """Quantities gathered in the order of the joints."""

    def __init__(self, ranges: dict[str, Range]) -> None:
        self.ranges = ranges

    def add(self, name: str, own: Range) -> Formula:
        """Return a quantity, or the number it is."""
        if own.is_point:
            value = own.outer
            return lambda q: value
        if name in self.ranges:
            raise GeometryError(f"{name} has two tolerances; give one")
        place = len(self.ranges)
        self.ranges[name] = own
        return lambda q: q[place]

    def spread(self, name: str, ends: tuple[float, float]) -> Formula:
        """Return a quantity between two doubles; one enclosed number where they differ by rounding."""
        low, high = ends
        if high - low <= _ROUNDING * abs(high):
            value = Interval.from_bounds(low, high)
            return lambda q: value
        return self.add(name, Range(Fraction(low), Fraction(high), exact=False))


def _tilt_of_fit(hole: Formula, shaft: Formula, height: Formula, nominal: Fraction, condition: str) -> Formula:
    """Critical tilt ``2 arctan(c / (h + w))`` of a bearing with deviations of both diameters (bearing-contact 7)."""
    size = Interval.from_bounds(*enclose(nominal))
    sign = -1.0 if condition == "A" else 1.0

    def tilt(q: Sequence[Any]) -> Any:
        bore, pin, h = hole(q), shaft(q), height(q) * 0.5
        c = (bore - pin) * 0.5
        both = (bore + pin) * 0.5 + size  # 2 R + c
        w = _square(h) + c * both * sign
        return atan(c / (h + w.sqrt())) * 2

    return tilt


def _square(x: Any) -> Any:
    return x.sqr() if isinstance(x, Dual | Interval) else x * x


def _angle_parts(alpha: Formula, direction: Formula) -> tuple[Formula, Formula]:
    return (lambda q: alpha(q) * cos(direction(q))), (lambda q: alpha(q) * sin(direction(q)))


def quantities_of(
    mechanism: Mechanism,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    tolerances: Tolerances,
    condition: Condition,
) -> Quantities:
    """Gather the quantities of a mechanism; arguments as those of `certify_coupled`."""
    tilts = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    parts = tuple(tolerances) if isinstance(tolerances, Iterable) else ()
    bearings, axes, box = drawn(mechanism, bearings, tilts, parts if parts else tolerances)
    if not axes:
        raise GeometryError("no axis is misaligned; give a tilt, or an AxisAngle among the tolerances")
    given = problem(mechanism, bearings, axes, condition)
    made = _Making(
        {name: Range(Fraction(a), Fraction(b), exact=False) for name, a, b in zip(box.names, box.low, box.high)}
    )
    layout = given.layout
    fits = {mechanism.joint(*own.joint).pair: own for own in parts if isinstance(own, FitClearance)}
    limits = []
    for block, place in enumerate(layout.block_joint.tolist()):
        joint = layout.joints[place]
        kind = KINDS[layout.block_axis[block]]
        limits.append(_limit(made, given.limits[joint], kind, mechanism.joints[joint].pair, fits))
    floats = {mechanism.joint(*own.joint).pair: own for own in parts if isinstance(own, EndFloat)}
    plays = [_play(made, given.limits[k], mechanism.joints[k].pair, floats) for k in layout.joints]
    leaning = len(axes) - sum(isinstance(own, AxisAngle | Parallelism) for own in parts)
    by_pair = {axis.pair: k for k, axis in enumerate(axes)}
    vectors = []
    for _, _, axis in layout.misalignments:
        vectors.append(_vector(made, axis, by_pair[axis.pair] >= leaning))
    found = Quantities(given, box, made.ranges, tuple(limits), tuple(plays), tuple(vectors))
    found.check()
    return found


def _named(pair: tuple[int, int]) -> str:
    return f"{pair[0]}-{pair[1]}"


def _limit(
    made: _Making, own: Limits, kind: str, pair: tuple[int, int], fits: dict[tuple[int, int], FitClearance]
) -> Formula | None:
    """Make the formula of one limit on tilt; None if it is infinite."""
    ends = bounds(own, kind)
    if math.isinf(ends[1]) and not math.isinf(ends[0]):
        raise GeometryError(
            f"joint {_named(pair)} binds for some of its tolerances and never for others; narrow them, or leave it "
            "free of limits"
        )
    if math.isinf(ends[0]):
        return None
    if ends[1] == 0.0:
        return lambda q: Interval(0)
    if pair not in fits:
        return made.spread(f"{kind} {_named(pair)}", ends)
    drawing = fits[pair]
    fit = Fit.read(drawing.fit)
    hole, shaft = made.add(f"hole {_named(pair)}", fit.hole), made.add(f"shaft {_named(pair)}", fit.shaft)
    middle, about = Fraction(drawing.height), Fraction(drawing.height_tolerance)
    height = made.add(f"height {_named(pair)}", Range(middle - about, middle + about, exact=False))
    return _tilt_of_fit(hole, shaft, height, fit.nominal, drawing.condition)


def _play(made: _Making, own: Limits, pair: tuple[int, int], floats: dict[tuple[int, int], EndFloat]) -> Formula | None:
    """Make the formula of an axial clearance to either side; None if it is infinite."""
    if math.isinf(own.axial_clearance):
        return None
    if pair not in floats or own.axial_clearance == 0.0:
        return made.spread(f"axial clearance {_named(pair)}", bounds(own, "axial_clearance"))
    whole = made.spread(f"end float {_named(pair)}", (floats[pair].least, floats[pair].most))
    return lambda q: whole(q) * 0.5


def _vector(made: _Making, axis: Misalignment, of_a_part: bool) -> tuple[Formula, Formula]:
    """Formulas of both components of a misalignment, in the frame of its base."""
    name = f"{axis.base}-{axis.link}"
    if of_a_part:  # any direction: two components, each up to the angle
        most = bounds(axis, "alpha")[1]
        return made.spread(f"lean x {name}", (-most, most)), made.spread(f"lean y {name}", (-most, most))
    return _angle_parts(
        made.spread(f"alpha {name}", bounds(axis, "alpha")), made.spread(f"direction {name}", bounds(axis, "direction"))
    )
