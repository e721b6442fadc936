"""The lattice of a four-bar survey: exact integer lengths, and the class of every set decided in integers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.rotatability import grashof_type, rotation_kind
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import exact_number
from graphsynth.pipeline.units import Unit
from graphsynth.systems.four_bar_survey.system import RangeTable, SurveyTable

Ints = NDArray[np.int64]

#: Lengths in units of the lattice: products of four stay exact, and margins stay clear of rounding.
LONGEST = 20_000


@dataclass(frozen=True, slots=True)
class Lattice:
    """Dimension sets by number: the rocker runs fastest, then the coupler, then the frame.

    Attributes
    ----------
    unit : Fraction
        The length that all lengths are whole multiples of.
    crank : int
        In units.
    frame, coupler, rocker : range
        In units.

    Examples
    --------
    >>> lattice = Lattice(Fraction(1, 2), 2, range(3, 5), range(4, 6), range(4, 7))
    >>> len(lattice), lattice.lengths(np.array([0, 11])).tolist()
    (12, [[3, 2, 4, 4], [4, 2, 5, 6]])
    """

    unit: Fraction
    crank: int
    frame: range
    coupler: range
    rocker: range

    def __len__(self) -> int:
        return len(self.frame) * len(self.coupler) * len(self.rocker)

    def lengths(self, sets: Ints) -> Ints:
        """Return frame, crank, coupler and rocker of sets in units (exact), shape (n, 4)."""
        rest, rocker = np.divmod(sets, len(self.rocker))
        frame, coupler = np.divmod(rest, len(self.coupler))
        parts = [r.start + r.step * k for r, k in ((self.frame, frame), (self.coupler, coupler), (self.rocker, rocker))]
        return np.stack([parts[0], np.full(len(sets), self.crank), parts[1], parts[2]], axis=1).astype(np.int64)


def lattice_of(context: Context) -> Lattice:
    """Read the lattice from a scene: numbers are the decimals (or fractions) that stand in the file.

    Raises
    ------
    SceneError
        If a range does not end on a step, or lengths have no common unit that is coarse enough.
    """
    table: SurveyTable = context.scene.mechanism
    place = context.scene.place / "mechanism" / "lengths"
    raw: Any = context.scene.raw.get("mechanism", {})
    raw = raw.get("lengths", {}) if isinstance(raw, dict) else {}
    crank = _exact(raw.get("crank"), table.lengths.crank)
    ranges: list[tuple[Fraction, Fraction, int]] = []
    for name in ("frame", "coupler", "rocker"):
        own: RangeTable = getattr(table.lengths, name)
        given = raw.get(name) if isinstance(raw.get(name), dict) else {}
        first, last, step = (_exact(given.get(key), getattr(own, key)) for key in ("first", "last", "step"))
        count = (last - first) / step
        if count.denominator != 1:
            raise (place / name).error(
                f"runs from {own.first:g} to {own.last:g} in steps of {own.step:g} and misses its last length; "
                "let last be first plus a whole number of steps"
            )
        ranges.append((first, step, int(count) + 1))
    unit = _common([crank, *(value for first, step, _ in ranges for value in (first, step))])
    longest = max(crank, *(first + step * (count - 1) for first, step, count in ranges)) / unit
    if longest > LONGEST:
        raise place.error(
            f"has lengths whose common unit is {float(unit):g}, {float(longest):g} of them in the longest; at most "
            f"{LONGEST} are exact: give rounder lengths"
        )
    spans = [range(int(first / unit), int(first / unit) + int(step / unit) * count, int(step / unit))
             for first, step, count in ranges]  # fmt: skip
    return Lattice(unit, int(crank / unit), *spans)


def _exact(written: object, value: float) -> Fraction:
    """Return the number that stands in the file, if it is the one that was read; else the shortest decimal of it."""
    number = exact_number(written, Unit.parse("")) if written is not None else None
    return number if number is not None and float(number) == value else Fraction(repr(float(value)))


def _common(values: list[Fraction]) -> Fraction:
    """Return the largest number that all values are whole multiples of."""
    below = math.lcm(*(value.denominator for value in values))
    return Fraction(math.gcd(*(int(value * below) for value in values)), below)


def classify(lengths: Ints) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Decide in integers whether the crank turns, and Grashof's type (exact).

    Parameters
    ----------
    lengths : ndarray of int64, shape (n, 4)
        Frame, crank, coupler, rocker; at most 2**60.

    Returns
    -------
    kind, type : ndarray of int8, shape (n,)
        Places in `KINDS` and `TYPES` of `graphsynth.mechanism.rotatability`.

    Examples
    --------
    >>> kind, type_ = classify(np.array([[4, 2, 5, 5], [4, 2, 3, 5], [4, 3, 2, 2], [1, 1, 1, 9], [3, 1, 1, 1]]))
    >>> [KINDS[k] for k in kind], [TYPES[k] for k in type_]
    ... # doctest: +NORMALIZE_WHITESPACE
    (['full turn', 'change point', 'limited', 'never assembled', 'immovable'],
     ['crank-rocker', 'change point', 'triple rocker', 'never assembled', 'immovable'])
    """
    g, a, b, c = lengths.T
    nearest, farthest, least, most = np.abs(g - a), g + a, np.abs(b - c), b + c
    return rotation_kind(nearest - least, farthest - most, nearest - most, farthest - least), grashof_type(lengths)
