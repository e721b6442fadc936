"""Guaranteed bounds of the pointing direction over length tolerances (theory/antenna 9).

Both outputs are enclosed over a box of lengths by interval Newton, then by the mean-value form.  The four operations
with outward rounding are those of mpmath.  No inverse function is enclosed; sines and cosines, which mpmath computes
with guard digits but does not prove, are widened by thirty times their last place.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from graphsynth.core.checks import choice, finite, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.closed_form import poses
from graphsynth.systems.antenna.model import Leg, PointingDimensions, solution_order

#: Working precision of the interval arithmetic, bits.
PRECISION = 80
#: What sines and cosines are widened by, far above their last place and far below that of a double.
WIDENING = 2.0**-75
#: Rounds of inflation before a proof is given up, and of shrinking afterwards.
INFLATIONS, SHRINKS = 40, 8
#: Places of l1, crank and rod of each leg among the five lengths.
PLACES = {"Y": (0, 2, 1), "X": (0, 4, 3)}


#: Intervals of the five lengths, or of derivatives by them.
Box = tuple[Any, ...]


class OutputEnclosure(NamedTuple):
    """Intervals of both outputs and of their derivatives by the five lengths, for every length in the box."""

    u: Any
    v: Any
    du: Box
    dv: Box


class NoProof(Exception):  # noqa: N818  (a result that is caught, not an error)
    """The denominator of a leg contains zero, or the iteration did not settle."""

    def __init__(self, leg: str, spread: float) -> None:
        super().__init__(leg)
        self.leg = leg
        self.spread = spread


def middle_of(box: Box) -> Box:
    """Return a point of the box near its middle, of full precision.

    Rounded to double it could lie outside a narrow box, and the mean-value form does not hold on the way to it.
    """
    return tuple(length.mid.a for length in box)


class _Terms(NamedTuple):
    """Left side minus right side of one equation and its derivatives: by the output, by l1, crank, rod, by u."""

    value: Any
    by_output: Any
    by_lengths: tuple[Any, Any, Any]
    by_u: Any


@dataclass(frozen=True)
class LengthBoxProblem:
    """Both outputs at fixed crank angles as functions of the lengths, on one assembly mode.

    ``slack`` is a relative error of the crank angles, for angles that were rounded on the way.
    """

    mechanism: PointingDimensions
    phi_x: float
    phi_y: float
    s_y: int
    s_x: int
    slack: float = 0.0

    @cached_property
    def iv(self) -> Any:
        """Interval arithmetic of its own precision."""
        from mpmath.ctx_iv import MPIntervalContext

        context = MPIntervalContext()
        context.prec = PRECISION
        return context

    @cached_property
    def legs(self) -> tuple[Leg, Leg]:
        """Leg solved first and leg solved second."""
        return solution_order(self.mechanism)

    @cached_property
    def _crank(self) -> dict[str, tuple[Any, Any]]:
        """Sine and ``1 - cos`` of each crank angle, enclosed."""
        around = self.iv.mpf([1.0 - self.slack, 1.0 + self.slack])
        angles = {"Y": self.iv.mpf(self.phi_x) * around, "X": self.iv.mpf(self.phi_y) * around}
        return {name: (self._sine(phi), 2 * self._sine(phi / 2) ** 2) for name, phi in angles.items()}

    def _sine(self, angle: Any) -> Any:
        """Sine, widened."""
        return self.iv.sin(angle) + self.iv.mpf([-WIDENING, WIDENING])

    def _cosine(self, angle: Any) -> Any:
        """Cosine, widened."""
        return self.iv.cos(angle) + self.iv.mpf([-WIDENING, WIDENING])

    def _sign(self, leg: Leg) -> int:
        """Branch sign of a leg; on its branch the slope of its equation has the opposite sign."""
        return self.s_y if leg.name == "Y" else self.s_x

    def nominal(self, lengths: tuple[float, ...]) -> tuple[float, float]:
        """Return outputs u, v in double precision; NaN where not assembled."""
        l1, l2, l3, l4, l5 = lengths
        varied = replace(self.mechanism, l1=l1, l2=l2, l3=l3, l4=l4, l5=l5)
        pose = poses(varied, self.phi_x, self.phi_y, self.s_y, self.s_x)
        a, b = float(pose.a), float(pose.b)
        return (b, a) if self.mechanism.order == "YX" else (a, b)

    def terms(self, leg: Leg, lengths: Box, output: Any, u: Any) -> _Terms:
        """Equation ``P (cos y - 1) + Q cos u sin y - lift / l1 = 0`` of a leg; ``u`` is None for the first leg."""
        sine, bend = self._crank[leg.name]
        l1, crank, rod = (lengths[i] for i in PLACES[leg.name])
        side = int(leg.side)
        p, q = l1 - crank * bend, side * rod + crank * sine
        lift = crank * (crank * bend + side * rod * sine)
        factor = 1 if u is None else self._cosine(u)
        s, c, versine = self._sine(output), self._cosine(output), 2 * self._sine(output / 2) ** 2
        return _Terms(
            -versine * p + q * factor * s - lift / l1,
            -p * s + q * factor * c,
            (
                -versine + lift / l1**2,
                bend * versine + sine * factor * s - (2 * crank * bend + side * rod * sine) / l1,
                side * (factor * s - crank * sine / l1),
            ),
            0 if u is None else -q * self._sine(u) * s,
        )

    def _gradient(self, leg: Leg, terms: _Terms, du: Box | None) -> Box:
        """Numerators of the derivatives of an output by the five lengths."""
        parts = [self.iv.mpf(0)] * 5
        for place, part in zip(PLACES[leg.name], terms.by_lengths):
            parts[place] = part
        return tuple(parts) if du is None else tuple(part + terms.by_u * rate for part, rate in zip(parts, du))

    def _prove(self, leg: Leg, box: Box, middle: Box, start: float, u: Any, u_mid: Any, du: Any) -> Any:
        """Interval Newton with inflation: an interval that holds exactly one root for every length in the box."""
        iv = self.iv
        centre = iv.mpf(start)
        fixed = self.terms(leg, box, centre, u)
        residual = self.terms(leg, middle, centre, u_mid).value
        for part, whole, mid in zip(self._gradient(leg, fixed, du), box, middle):
            residual += part * (whole - mid)
        trial = centre + iv.mpf([-1e-18, 1e-18])
        spread = 0.0
        for _ in range(INFLATIONS):
            slope = self.terms(leg, box, trial, u).by_output
            spread = float(slope.delta.b) / max(abs(float(slope.mid.a)), 1e-300)
            if 0 in slope:
                raise NoProof(leg.name, spread)
            image = centre - residual / slope
            if trial.a < image.a and image.b < trial.b:
                if (slope.b < 0) != (self._sign(leg) > 0):
                    raise NoProof(leg.name, spread)  # a root, but of the other branch
                return image
            low, high = min(trial.a, image.a), max(trial.b, image.b)
            reach = (high - low) * 0.2 + iv.mpf(1e-20)
            trial = iv.mpf([(low - reach).a, (high + reach).b])
        raise NoProof(leg.name, spread)

    def _shrink(self, leg: Leg, box: Box, middle: Box, output: Any, at_mid: Any, u: Any, du: Any) -> tuple[Any, Box]:
        """Mean-value form, repeated until it stops shrinking: the output and its gradient over the box."""
        for _ in range(SHRINKS):
            terms = self.terms(leg, box, output, u)
            gradient = tuple(-part / terms.by_output for part in self._gradient(leg, terms, du))
            image = at_mid
            for rate, whole, mid in zip(gradient, box, middle):
                image += rate * (whole - mid)
            low, high = max(image.a, output.a), min(image.b, output.b)
            old = output.delta
            output = self.iv.mpf([low, high])
            if output.delta.b > old.a * (1 - 1e-6):
                break
        return output, gradient

    def enclose(self, box: Box) -> OutputEnclosure:
        """Enclose both outputs and their gradients over a box of lengths; `NoProof` if a fold is in or near it."""
        middle = middle_of(box)
        starts = self.nominal(tuple(float(length.a) for length in middle))
        if math.isnan(starts[0]):
            raise NoProof(self.legs[1].name, math.inf)
        found: list[tuple[Any, Box]] = []
        u_mid = None
        for leg, start in zip(self.legs, starts):
            u, du = found[0] if found else (None, None)
            at_mid = self._prove(leg, middle, middle, start, u_mid, u_mid, None)
            over = self._prove(leg, box, middle, start, u, u_mid, du)
            found.append(self._shrink(leg, box, middle, over, at_mid, u, du))
            u_mid = at_mid
        (u, du), (v, dv) = found
        return OutputEnclosure(u, v, du, dv)


NAMES = ("l1", "l2", "l3", "l4", "l5")
_ARCSECOND = math.pi / 648000.0
#: Relative rounding of lengths and angles that were decimals or degrees: at most three operations to nearest.
_CONVERTED = 2.0**-51


class ToleranceStatus(IntEnum):
    """What is proved about a box of lengths."""

    CERTIFIED = 0  #: for all lengths in the box one pose of this mode exists, inside the bounds
    UNDECIDED = 1  #: nothing is proved; a fold lies in the box or close to it


@dataclass(frozen=True)
class AngleBounds:
    """One output over the box of lengths, radians.

    `nominal`: at the middle of the box; `lower`, `upper`: certified bounds, NaN if undecided; `corner_lower`,
    `corner_upper`: extremes over the 32 corners of the box (estimate from inside), NaN if a corner cannot be assembled;
    `first_order`: sum of ``|d output / d l_i| width_i`` (estimate); `gradient`: derivatives by l1 to l5 at the middle,
    rad per unit of length; `monotone`: lengths for which the sign of the derivative is proved over the whole box.
    """

    nominal: float
    lower: float
    upper: float
    corner_lower: float
    corner_upper: float
    first_order: float
    gradient: tuple[float, ...]
    monotone: tuple[bool, ...]

    @property
    def deviation(self) -> tuple[float, float]:
        """Certified deviations from the nominal value, seconds of arc, rounded outward."""
        low, high = (self.lower - self.nominal) / _ARCSECOND, (self.upper - self.nominal) / _ARCSECOND
        # three operations to nearest, the constant included
        return math.nextafter(low - 4e-16 * abs(low), -math.inf), math.nextafter(high + 4e-16 * abs(high), math.inf)

    @property
    def corner_deviation(self) -> tuple[float, float]:
        """Deviations of the extreme corners, seconds of arc."""
        return (self.corner_lower - self.nominal) / _ARCSECOND, (self.corner_upper - self.nominal) / _ARCSECOND

    @property
    def excess(self) -> float:
        """By how much the certified bounds are wider than the corner values, relative; NaN for a box without width."""
        width = self.corner_upper - self.corner_lower
        return (self.upper - self.lower) / width - 1.0 if width > 0.0 else math.nan


@dataclass(frozen=True)
class Tolerance:
    """Bounds of both outputs.

    Attributes
    ----------
    status : ToleranceStatus
    reason : str
        One sentence.
    lengths : tuple of str
        If undecided: the lengths that make a denominator contain zero by themselves, else the one with the largest
        share in it.
    a, b : AngleBounds
        Elevation and azimuth.
    """

    status: ToleranceStatus
    reason: str
    lengths: tuple[str, ...]
    a: AngleBounds
    b: AngleBounds

    def report(self) -> str:
        """Certified bounds, corner values and first-order estimate of both outputs in seconds of arc."""
        lines = [self.reason]
        for name, bounds in (("elevation", self.a), ("azimuth", self.b)):
            corners = bounds.corner_deviation
            certified = [outward_text(value, side) for value, side in zip(bounds.deviation, (-1, 1))]
            lines.append(
                f"{name} {math.degrees(bounds.nominal):.9f} deg: certified {certified[0]} .. {certified[1]}, "
                f"corners {corners[0]:+.4f} .. {corners[1]:+.4f}, first order {bounds.first_order / _ARCSECOND:.4f}"
            )
        return "\n".join(lines)


def outward_text(value: float, side: int, places: int = 4) -> str:
    """Write a bound with a sign and so many decimals, rounded down (side -1) or up (+1) so that it stays one.

    Examples
    --------
    >>> outward_text(-0.12341, -1), outward_text(0.12341, 1), outward_text(math.nan, 1)
    ('-0.1235', '+0.1235', 'nan')
    """
    if not math.isfinite(value):
        return str(value)
    digits = Decimal(value).quantize(Decimal(1).scaleb(-places), ROUND_FLOOR if side < 0 else ROUND_CEILING)
    return f"{digits:+f}"


def _box(problem: LengthBoxProblem, widths: tuple[float, ...]) -> Box:
    iv = problem.iv
    around = iv.mpf([1.0 - problem.slack, 1.0 + problem.slack])
    return tuple((iv.mpf(l) + iv.mpf([-w, w])) * around for l, w in zip(problem.mechanism.lengths, widths))


def _face_bound(problem: LengthBoxProblem, box: Box, found: OutputEnclosure, which: int, upward: bool) -> Any:
    """Bound of one output with every proved monotone length at its end, the others in mean-value form (step 3)."""
    iv = problem.iv
    gradient = found.dv if which else found.du
    face = []
    for rate, whole in zip(gradient, box):
        if rate.a > 0 or rate.b < 0:
            face.append(iv.mpf(whole.b if (rate.a > 0) == upward else whole.a))
        else:
            face.append(whole)
    middle = middle_of(tuple(face))
    centre, over = problem.enclose(middle), problem.enclose(tuple(face))
    value = centre.v if which else centre.u
    for rate, whole, mid in zip(over.dv if which else over.du, face, middle):
        value += rate * (whole - mid)
    return value


def tolerance(
    self: PointingDimensions,
    phi_x: float,
    phi_y: float,
    widths: ArrayLike = 5e-5,
    *,
    s_y: int = 1,
    s_x: int = -1,
    method: str = "mixed",
    converted: bool = False,
) -> Tolerance:
    """Certified bounds of elevation and azimuth if every length may deviate by plus or minus its width.

    Certified, or undecided with the lengths that let a fold into the box; with the corner values and the first-order
    estimate beside it.

    Parameters
    ----------
    phi_x, phi_y : float
        Crank angles, radians.
    widths : float or array_like, shape (5,)
        Tolerances of l1 to l5, unit of the lengths, at least 0 and below the length, or a `GeometryError` is raised.
    s_y, s_x : {+1, -1}
        Assembly mode.
    method : {"mixed", "mean_value"}
        "mixed" puts every length with a proved sign of the derivative to the ends of its interval
        (theory/antenna 9, step 3); "mean_value" is faster and some per cent wider.
    converted : bool
        The doubles given stand for decimals or degrees: the bounds then hold for the numbers before they were
        converted to metres and radians and rounded (up to three roundings each).

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> import numpy as np
    >>> found = PointingMechanism().tolerance(np.radians(15), np.radians(15))
    >>> print(found.report())
    certified: one pose of this mode for all lengths in the box
    elevation 8.907526593 deg: certified -44.3763 .. +44.4260, corners -44.3762 .. +44.4259, first order 44.4010
    azimuth 8.814978215 deg: certified -42.9741 .. +43.0184, corners -42.9740 .. +43.0184, first order 42.9962
    """
    choice("method", method, ("mixed", "mean_value"))
    given = finite_array("widths", widths)
    if given.shape not in ((), (5,)):
        raise GeometryError(f"widths has shape {given.shape}; give one number or five, for l1 to l5")
    box_widths = tuple(np.broadcast_to(given, 5).tolist())
    for name, length, width in zip(NAMES, self.lengths, box_widths):
        if not 0.0 <= width < length:
            raise GeometryError(f"the tolerance {width} of {name} must be at least 0 and below the length {length}")
    slack = _CONVERTED if converted else 0.0
    problem = LengthBoxProblem(self, finite("phi_x", phi_x), finite("phi_y", phi_y), s_y, s_x, slack)
    box = _box(problem, box_widths)
    outputs = _estimates(problem, box_widths)
    try:
        found = problem.enclose(box)
        bounds = [[found.u, found.u], [found.v, found.v]]
        if method == "mixed":
            for which in (0, 1):
                low, high = (_face_bound(problem, box, found, which, upward) for upward in (False, True))
                bounds[which] = [max(bounds[which][0].a, low.a), min(bounds[which][1].b, high.b)]
    except NoProof as failure:
        (lengths, reason), status = _explain(problem, box_widths, failure), ToleranceStatus.UNDECIDED
    else:
        lengths, reason, status = (), "certified: one pose of this mode for all lengths in the box", ToleranceStatus(0)
        for k, ((low, high), gradient) in enumerate(zip(bounds, (found.du, found.dv))):
            monotone = tuple(bool(rate.a > 0 or rate.b < 0) for rate in gradient)
            # rounded outward
            lower, upper = float(low.a), float(high.b)
            lower = lower if low.a >= lower else math.nextafter(lower, -math.inf)
            upper = upper if high.b <= upper else math.nextafter(upper, math.inf)
            outputs[k] = replace(outputs[k], lower=lower, upper=upper, monotone=monotone)
    u, v = outputs
    return Tolerance(status, reason, lengths, *((v, u) if self.order == "YX" else (u, v)))


def _estimates(problem: LengthBoxProblem, widths: tuple[float, ...]) -> list[AngleBounds]:
    """Nominal value, extreme corners, first-order estimate and gradient of u and of v, in double precision."""
    lengths = problem.mechanism.lengths
    nominal = problem.nominal(lengths)
    ends = [(l - w, l + w) if w > 0.0 else (l,) for l, w in zip(lengths, widths)]
    corners = np.array([problem.nominal(corner) for corner in itertools.product(*ends)])
    gradients = _gradients(problem, nominal)
    made = []
    for i, gradient in enumerate(gradients):
        order = sum(abs(g) * w for g, w in zip(gradient, widths))
        offsets = np.remainder(corners[:, i] - nominal[i] + math.pi, math.tau) - math.pi  # no jump at +-pi
        low, high = nominal[i] + float(offsets.min()), nominal[i] + float(offsets.max())
        made.append(AngleBounds(nominal[i], math.nan, math.nan, low, high, order, gradient, (False,) * 5))
    return made


def _gradients(problem: LengthBoxProblem, nominal: tuple[float, float]) -> list[tuple[float, ...]]:
    """Return derivatives of u and v by the lengths at the middle; NaN where not assembled or at a fold."""
    if math.isnan(nominal[0]):
        return [(math.nan,) * 5] * 2
    iv = problem.iv
    lengths = tuple(iv.mpf(length) for length in problem.mechanism.lengths)
    first, second = problem.legs
    u, v = (iv.mpf(value) for value in nominal)
    one, two = problem.terms(first, lengths, u, None), problem.terms(second, lengths, v, u)
    if 0 in one.by_output or 0 in two.by_output:
        return [(math.nan,) * 5] * 2
    du = tuple(-part / one.by_output for part in problem._gradient(first, one, None))
    dv = tuple(-part / two.by_output for part in problem._gradient(second, two, du))
    return [tuple(float(rate.mid.a) for rate in rates) for rates in (du, dv)]


def _explain(problem: LengthBoxProblem, widths: tuple[float, ...], failure: NoProof) -> tuple[tuple[str, ...], str]:
    """Which lengths make the denominator contain zero, and the sentence that says so."""
    if math.isnan(problem.nominal(problem.mechanism.lengths)[0]):
        return (), "undecided: the mechanism with the nominal lengths cannot be assembled at these crank angles"
    alone, shares = [], []
    for i, name in enumerate(NAMES):
        single = tuple(width if j == i else 0.0 for j, width in enumerate(widths))
        box = _box(problem, single)
        try:
            found = problem.enclose(box)
        except NoProof:
            alone.append(name)
            continue
        leg = problem.legs[0] if failure.leg == problem.legs[0].name else problem.legs[1]
        first = leg is problem.legs[0]
        slope = problem.terms(leg, box, found.u if first else found.v, None if first else found.u).by_output
        shares.append((float(slope.delta.b) / abs(float(slope.mid.a)), name))
    where = f"undecided: the denominator of leg {failure.leg} contains zero, a fold lies in or near the box of lengths,"
    if alone:
        return tuple(alone), f"{where} by the tolerance of {' or '.join(alone)} alone; narrow it or move the cranks"
    largest = max(shares)[1]
    return (largest,), f"{where} by all tolerances together, of which {largest} has the largest share; narrow them"
