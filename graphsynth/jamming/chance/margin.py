"""Margins: what is left before a mechanism binds, as a function of its toleranced quantities.

A margin is negative where the mechanism binds somewhere in its range of inputs.  `Margin` is all that the probability
asks of it, so that other models of jamming can take the place of the single bearing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Dual, Interval, maximum, sin
from graphsynth.jamming.bearing import corners
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox

Array = NDArray[np.float64]


class Margin(Protocol):
    """What is left before a mechanism binds: negative where it does, for some input of its range."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the toleranced quantities, in the order of the columns."""

    @property
    def model(self) -> str:
        """What the margin is of, and what that neglects, in one sentence without a full stop."""

    def sampled(self, x: Array) -> Array:
        """Return the margin of members (N, quantities) in floating point, (N,); estimated."""

    def enclosed(self, x: Sequence[Any]) -> Any:
        """Return the margin, of shape (N,), for one `Interval` or `Dual` of shape (N,) for each quantity.

        Of duals a `Dual`, whose derivatives hold those anywhere in the box, or an `Interval` if they are not known.
        """


@runtime_checkable
class LinearMargin(Protocol):
    """A margin that bounds itself over boxes by linear functions, better than by its derivatives."""

    def lines(
        self, at: Sequence[Any], over: Sequence[Any], ends: tuple[Array, Array], known: Sequence[Any]
    ) -> tuple[Any, list[Any]]:
        """Return an `Affine` of N boxes, and what is worth knowing of their parts.

        ``at``, ``over``: the quantities at the middles, and over the boxes as duals by the sources; ``ends`` (N, n);
        ``known`` of each box, None for nothing.
        """


class BearingMargin:
    """Clearance left in the one tilted bearing of a linkage at the worst crank angle of the full rotation (mm).

    Exact tilts (model L0): the closed form of theory/jam-arcs 6, for any direction of the tilted motor axis.

    Parameters
    ----------
    box : ToleranceBox
        Ranges of all that may vary, wide enough for everything that will be asked; every member must be assembled at
        every crank angle.
    condition : {"A", "B", "general"}
    """

    def __init__(self, box: ToleranceBox, condition: Condition = "A") -> None:
        corners.check_condition(box, condition)
        self.box, self.condition = box, condition
        self.names = tuple(name for name, value in box.ranges.items() if not value.is_point)
        self.fixed = {name: box.outer(name) for name, value in box.ranges.items() if value.is_point}
        tilt = corners.sines(box)
        if not corners.turns_freely(box, float(tilt.amplitude.hi[1])):
            raise GeometryError(
                "not every member of the tolerances is proved to be assembled at every crank angle, so that binding "
                "over the full rotation has no meaning; narrow the lengths or alpha, or choose a crank that turns"
            )
        where = "the short bearing in a long hole" if condition == "A" else f"contact condition {condition}"
        self.model = f"one tilted bearing over the full rotation, {where}, exact tilt; rigid parts"

    def __reduce__(self) -> tuple[Any, ...]:
        return BearingMargin, (self.box, self.condition)

    def sampled(self, x: Array) -> Array:
        """Return the clearance left of members in floating point."""
        q: dict[str, Any] = {name: float(value.mid) for name, value in self.fixed.items()}
        q |= dict(zip(self.names, x.T))
        flat, along = q["n1"] ** 2 + q["n2"] ** 2, q["n3"] ** 2
        wave = np.sin(0.5 * q["alpha"])
        share = flat / (flat + along)
        S = q["l2"] / q["l3"] * np.abs(wave) * np.sqrt(2.0 * share * (2.0 - 2.0 * wave * wave * share))
        S = S / np.sqrt(1.0 + S * S) if self.box.rod == "deck" else S
        C, R, h, c = np.sqrt(1.0 - S * S), q["Rb"], 0.5 * q["Hb"], q["clearance"]
        bend = S * S / (1.0 + C)
        right = c + R * bend - h * S
        saturated = (c * (2.0 * R + c) - h * h) / (np.hypot(R, h) + R + c)
        a = np.where(h * C >= R * S, right, saturated)
        if self.condition == "A":
            return np.asarray(a)
        half = h if self.condition == "B" else 0.5 * q["hole_length"]
        b = c - (R + c) * bend - half * S
        return np.asarray(b if self.condition == "B" else np.maximum(a, b / C))

    def enclosed(self, x: Sequence[Any]) -> Any:
        """Enclose the clearance left."""
        q: Mapping[str, Any] = {**self.fixed, **dict(zip(self.names, x))}
        S = self._sine(q)
        C = ((1 - S) * (1 + S)).sqrt()
        R, h, c = q["Rb"], q["Hb"] / 2, q["clearance"]
        bend = S.sqr() / (1 + C)
        if self.condition == "B":
            return c - (R + c) * bend - h * S
        a = self._rim(S, C, bend, q)
        if self.condition == "A":
            return a
        hole = q["hole_length"] / 2
        return maximum(a, (c - (R + c) * bend - hole * S) / C)

    def _sine(self, q: Mapping[str, Any]) -> Any:
        """Sine of the largest tilt of the full rotation (theory/four-bar-and-tilt 6, 8)."""
        flat, along = q["n1"].sqr() + q["n2"].sqr(), q["n3"].sqr()
        wave, share = sin(q["alpha"] / 2), flat / (flat + along)
        S = q["l2"] / q["l3"] * abs(wave) * (share * 2 * (2 - share * 2 * wave.sqr())).sqrt()
        return S / (1 + S.sqr()).sqrt() if self.box.rod == "deck" else S

    def _rim(self, S: Any, C: Any, bend: Any, q: Mapping[str, Any]) -> Any:
        """Clearance left under condition A, of both branches where the box does not tell (theory/bearing-contact 2)."""
        R, h, c = q["Rb"], q["Hb"] / 2, q["clearance"]
        right = c + R * bend - h * S
        across, along = _value(R * S), _value(h * C)
        if (across.hi <= along.lo).all():
            return right
        R, h, c = _value(R), _value(h), _value(c)
        saturated = (c * (2 * R + c) - h.sqr()) / ((R.sqr() + h.sqr()).sqrt() + R + c)
        return _value(right).hull(saturated)


def _value(x: Any) -> Interval:
    return x.value if isinstance(x, Dual) else x


def widened(box: ToleranceBox, ranges: Mapping[str, Range]) -> ToleranceBox:
    """Return the box with other ranges of some parameters; the axis of the tilt by its components."""
    axis = [ranges.get(name, box[name]) for name in ("n1", "n2", "n3")]
    rest = {name: value for name, value in ranges.items() if name not in ("n1", "n2", "n3")}
    return box.replace(axis=axis, **rest)
