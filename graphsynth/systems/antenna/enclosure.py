"""Proved enclosures of both outputs over a box of lengths: interval Newton, then the mean-value form (section 2.10).

The four operations with outward rounding are those of mpmath.  No inverse function is enclosed; sines and cosines,
which mpmath computes with guard digits but does not prove, are widened by thirty times their last place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from graphsynth.systems.antenna.legs import Leg, solution_order

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["Enclosure", "LengthBoxProblem", "NoProof", "middle_of"]

#: Working precision of the interval arithmetic, bits.
PRECISION = 80
#: What sines and cosines are widened by, far above their last place and far below that of a double.
WIDENING = 2.0**-75
#: Rounds of inflation before a proof is given up, and of shrinking afterwards.
INFLATIONS, SHRINKS = 40, 8
#: Places of l1, crank and rod of each leg among the five lengths.
PLACES = {"Y": (0, 2, 1), "X": (0, 4, 3)}


class Enclosure(NamedTuple):
    """Intervals of both outputs and of their derivatives by the five lengths, for every length in the box."""

    u: Any
    v: Any
    du: tuple[Any, ...]
    dv: tuple[Any, ...]


class NoProof(Exception):  # noqa: N818  (a result that is caught, not an error)
    """The denominator of a leg contains zero, or the iteration did not settle."""

    def __init__(self, leg: str, spread: float) -> None:
        super().__init__(leg)
        self.leg = leg
        self.spread = spread


def middle_of(box: tuple[Any, ...]) -> tuple[Any, ...]:
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

    mechanism: PointingMechanism
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
        from dataclasses import replace

        l1, l2, l3, l4, l5 = lengths
        varied = replace(self.mechanism, l1=l1, l2=l2, l3=l3, l4=l4, l5=l5)
        pose = varied.poses(self.phi_x, self.phi_y, self.s_y, self.s_x)
        a, b = float(pose.a), float(pose.b)
        return (b, a) if self.mechanism.order == "YX" else (a, b)

    def terms(self, leg: Leg, lengths: tuple[Any, ...], output: Any, u: Any) -> _Terms:
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

    def _gradient(self, leg: Leg, terms: _Terms, du: tuple[Any, ...] | None) -> tuple[Any, ...]:
        """Numerators of the derivatives of an output by the five lengths."""
        parts = [self.iv.mpf(0)] * 5
        for place, part in zip(PLACES[leg.name], terms.by_lengths):
            parts[place] = part
        return tuple(parts) if du is None else tuple(part + terms.by_u * rate for part, rate in zip(parts, du))

    def _prove(
        self, leg: Leg, box: tuple[Any, ...], middle: tuple[Any, ...], start: float, u: Any, u_mid: Any, du: Any
    ) -> Any:
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

    def _shrink(
        self, leg: Leg, box: tuple[Any, ...], middle: tuple[Any, ...], output: Any, at_mid: Any, u: Any, du: Any
    ) -> tuple[Any, tuple[Any, ...]]:
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

    def enclose(self, box: tuple[Any, ...]) -> Enclosure:
        """Enclose both outputs and their gradients over a box of lengths.

        Raises
        ------
        NoProof
            A fold lies in the box, or so near that no proof is found.
        """
        first, second = self.legs
        middle = middle_of(box)
        starts = self.nominal(tuple(float(length.a) for length in middle))
        if math.isnan(starts[0]):
            raise NoProof(second.name, math.inf)
        u_mid = self._prove(first, middle, middle, starts[0], None, None, None)
        u = self._prove(first, box, middle, starts[0], None, None, None)
        u, du = self._shrink(first, box, middle, u, u_mid, None, None)
        v_mid = self._prove(second, middle, middle, starts[1], u_mid, u_mid, None)
        v = self._prove(second, box, middle, starts[1], u, u_mid, du)
        v, dv = self._shrink(second, box, middle, v, v_mid, u, du)
        return Enclosure(u, v, du, dv)
