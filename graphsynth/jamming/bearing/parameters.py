"""Exact input: dimensions as ranges between rational numbers, read from decimal text without rounding.

`ToleranceBox` is the linkage and its bearing with such a range for every dimension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from graphsynth.core.checks import checked, choice, sign
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import enclose, fraction, text_ends
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.mechanism.four_bar import TiltedFourBar

if TYPE_CHECKING:
    from graphsynth.intervals import Interval


@checked
@dataclass(frozen=True)
class Range:
    """All values from ``lower`` to ``upper``, both exact numbers.

    ``exact`` is False if a plain float came in: whatever rounding made that float is not included in any statement.

    Examples
    --------
    >>> Range.read("clearance", "0.03 +- 0.003")
    Range(lower=Fraction(27, 1000), upper=Fraction(33, 1000), exact=True)
    >>> Range.read("clearance", 0.5).exact
    False
    """

    lower: Fraction
    upper: Fraction
    exact: bool = True

    @classmethod
    def read(cls, name: str, value: Any) -> Range:
        """Read a number, decimal text, ``"[a, b]"``, ``"a +- b"``, a pair or an `Interval`.

        `GeometryError` for anything that is no finite number, and for reversed bounds; it names the parameter.
        """
        if isinstance(value, Range):
            return value
        if isinstance(value, str):
            one, other, is_spread = text_ends(value)
            low, high = _number(name, one), _number(name, other)
            if not is_spread:
                return cls._ordered(name, low, high, True)
            if high < 0:
                raise GeometryError(f"{name} = {value.strip()!r} has a negative tolerance; give 0 or more")
            return cls(low - high, low + high)
        if isinstance(value, tuple | list):
            if len(value) != 2:
                raise GeometryError(f"{name} = {value!r} has {len(value)} bounds; give two, or one number")
            first, last = (cls.read(name, part) for part in value)
            return cls._ordered(name, first.lower, last.upper, first.exact and last.exact)
        if hasattr(value, "lo") and hasattr(value, "hi"):
            if getattr(value, "shape", ()) != ():
                raise GeometryError(f"{name} = {value!r} is an array of shape {value.shape}; give one interval")
            low, high = _number(name, float(value.lo)), _number(name, float(value.hi))
            return cls._ordered(name, low, high, bool(value.exact_input))
        number = _number(name, value)
        return cls(number, number, isinstance(value, int | Fraction | Decimal | np.integer))

    @classmethod
    def _ordered(cls, name: str, lower: Fraction, upper: Fraction, exact: bool) -> Range:
        if lower > upper:
            raise GeometryError(
                f"{name} has its lower bound {float(lower):.6g} above its upper bound {float(upper):.6g}; exchange them"
            )
        return cls(lower, upper, exact)

    @property
    def is_point(self) -> bool:
        """Whether the range is a single number."""
        return self.lower == self.upper

    @property
    def middle(self) -> float:
        """Double nearest to the middle."""
        return float((self.lower + self.upper) / 2)

    @cached_property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Tightest double bounds of the lower and of the upper end."""
        return enclose(self.lower), enclose(self.upper)

    @cached_property
    def outer(self) -> Interval:
        """The smallest interval of doubles around the range."""
        from graphsynth.intervals import Interval

        low, high = self.ends
        return Interval.from_bounds(low[0], high[1])

    @cached_property
    def doubles(self) -> Interval:
        """The doubles inside the range; the two around it if there is none."""
        from graphsynth.intervals import Interval

        (below, first), (last, above) = self.ends
        return Interval.from_bounds(first, last) if first <= last else Interval.from_bounds(below, above)

    def __str__(self) -> str:
        ends = ((end, exact_text(end)) for end in (self.lower, self.upper))
        low, high = (text if len(text) <= 24 else f"{float(end):.12g}" for end, text in ends)
        return low if self.is_point else f"[{low}, {high}]"


Given = Any  # str, int, float, Fraction, Decimal, Interval, Range, or a pair of them


def spread(nominal: Given, absolute: Given = 0, relative: Given = 0) -> Range:
    """Return ``nominal`` with an absolute and a relative tolerance, exactly.

    Parameters
    ----------
    nominal, absolute, relative : Given
        A number, text or range; plus or minus, in the same unit; plus or minus, as a fraction of the value.

    Returns
    -------
    Range
        Exact.

    Raises
    ------
    GeometryError
        For a negative tolerance.

    Examples
    --------
    >>> str(spread("0.0130", relative="1e-2"))
    '[0.01287, 0.01313]'
    """
    given = {"nominal": nominal, "absolute": absolute, "relative": relative}
    value, plus, factor = (Range.read(name, v) for name, v in given.items())
    if plus.lower < 0 or factor.lower < 0:
        raise GeometryError(f"a tolerance of {plus} or {factor} is negative; give zero or more")
    low = min(end * (1 - sign * factor.upper) for end in (value.lower, value.upper) for sign in (1, -1))
    high = max(end * (1 + sign * factor.upper) for end in (value.lower, value.upper) for sign in (1, -1))
    return Range(low - plus.upper, high + plus.upper, value.exact and plus.exact and factor.exact)


def _number(name: str, value: Any) -> Fraction:
    try:
        if isinstance(value, bool | bytes | bytearray | np.bool_):
            raise ValueError
        if isinstance(value, str):
            number = fraction(value)
        elif isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) > 10_000:
            raise ValueError
        elif isinstance(value, int | np.integer):
            number = Fraction(int(value))
        elif isinstance(value, Fraction | Decimal | np.floating):
            number = Fraction(*value.as_integer_ratio())
        else:
            number = Fraction(float(value))
        float(number)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise GeometryError(
            f"{name} = {value!r} is not a finite number; write a decimal such as 0.03, a fraction such as 1/30, "
            "a pair [0.1, 0.2] or a spread 17.5 +- 0.005"
        ) from None
    return number


def exact_text(value: Fraction) -> str:
    """Write a rational number exactly: as a decimal if a short one exists, else as a fraction.

    >>> exact_text(Fraction(27, 1000)), exact_text(Fraction(1, 30))
    ('0.027', '1/30')
    """
    rest = value.denominator
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    if rest == 1:
        with localcontext() as context:
            context.prec = 60
            decimal = (Decimal(value.numerator) / Decimal(value.denominator)).normalize()
        if Fraction(decimal) == value:
            text = f"{decimal:f}"
            return text if len(text) <= 24 else f"{decimal:e}"
    return f"{value.numerator}/{value.denominator}"


#: Names of the ranges of a box, in a fixed order.
PARAMETERS = ("l1", "l2", "l3", "l4", "alpha", "n1", "n2", "n3", "azimuth", "Rb", "Hb", "clearance", "hole_length")
#: What a box takes by keyword alone, with its defaults.
_OTHERS: dict[str, Any] = {
    "azimuth": 0,
    "Rb": "17.5",
    "Hb": 10,
    "clearance": "0.03",
    "hole_length": None,
    "sgn": 1,
    "rod": "rigid",
    "convention": "spec",
}


class ToleranceBox:
    """A lambda linkage with its bearing, every parameter in a range; immutable.

    Each value may be a number, decimal text (``"0.03"``, ``"1/30"``, ``"17.5 +- 0.005"``, ``"[0.1, 0.2]"``), a
    Fraction, Decimal, pair of bounds, `Range` or `Interval`.  Text and rational numbers are exact; a float is taken as
    the double it is, and `exact_input` is then False.

    Parameters
    ----------
    l1, l2, l3, l4 : Given
        Frame, crank, coupler, rocker; any common unit.
    alpha : Given
        Tilt of the motor axis, radians.
    axis : sequence of three
        Direction about which the motor axis is tilted; need not be normalised, each component may be a range.
    **others
        ``azimuth``: further turn of that direction about the normal of the plane, radians (0).  ``Rb``, ``Hb``,
        ``clearance``: radius and height of the bearing, radial clearance, millimetres (17.5, 10, 0.03).
        ``hole_length``: length of the hole for condition "general", millimetres.  ``sgn``, ``rod``, ``convention``: as
        for `TiltedFourBar`.

    Examples
    --------
    >>> box = ToleranceBox(alpha="1/30", clearance="0.03 +- 0.003")
    >>> str(box["clearance"]), box.exact_input
    ('[0.027, 0.033]', True)
    """

    __slots__ = ("_ranges", "convention", "rod", "sgn")
    _ranges: dict[str, Range]
    sgn: int
    rod: str
    convention: str

    def __init__(
        self,
        l1: Given = 2,
        l2: Given = 1,
        l3: Given = "2.5",
        l4: Given = "2.5",
        alpha: Given = 0,
        axis: Any = (1, 0, 0),
        **others: Any,
    ) -> None:
        if unknown := set(others) - set(_OTHERS):
            raise GeometryError(f"{unknown.pop()!r} is no parameter of a box; use {', '.join(_OTHERS)}")
        given = {"l1": l1, "l2": l2, "l3": l3, "l4": l4, "alpha": alpha, **_components(axis), **_OTHERS, **others}
        if given["hole_length"] is None:
            del given["hole_length"]
        ranges = {name: Range.read(name, given[name]) for name in PARAMETERS if name in given}
        _check(ranges)
        object.__setattr__(self, "_ranges", ranges)
        object.__setattr__(self, "sgn", sign("sgn", given["sgn"]))
        object.__setattr__(self, "rod", choice("rod", given["rod"], ("rigid", "deck")))
        object.__setattr__(self, "convention", choice("convention", given["convention"], ("spec", "deck")))

    @classmethod
    def of(cls, linkage: TiltedFourBar, bearing: Bearing | None = None) -> ToleranceBox:
        """Return the box of one linkage and one bearing: their doubles as they are, marked as float input.

        Anything else raises `GeometryError`.
        """
        if not isinstance(linkage, TiltedFourBar):
            raise GeometryError(f"linkage = {linkage!r} is no TiltedFourBar; give one")
        b = Bearing() if bearing is None else bearing
        if not isinstance(b, Bearing):
            raise GeometryError(f"bearing = {b!r} is no Bearing; give Bearing(Rb, Hb, clearance), or none")
        k = linkage
        bearing_of = {"Rb": b.Rb, "Hb": b.Hb, "clearance": b.clearance, "hole_length": b.hole_length}
        options = {"sgn": k.sgn, "rod": k.rod, "convention": k.convention}
        return cls(k.l1, k.l2, k.l3, k.l4, k.alpha, k.axis, **bearing_of, **options)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise AttributeError(f"a ToleranceBox does not change; make another with replace({name}=...)")

    def __getitem__(self, name: str) -> Range:
        """Return the range of a parameter by its name (see `PARAMETERS`)."""
        if not isinstance(name, str) or name not in self._ranges:
            raise GeometryError(f"{name!r} is no parameter of this box; it has {', '.join(self._ranges)}")
        return self._ranges[name]

    def __contains__(self, name: str) -> bool:
        return name in self._ranges

    def __repr__(self) -> str:
        return f"ToleranceBox({', '.join(f'{name}={value}' for name, value in self._ranges.items())})"

    def replace(self, **changes: Given) -> ToleranceBox:
        """Return the box with some parameters changed; a name that is none raises `GeometryError`.

        >>> str(ToleranceBox().replace(alpha="0.013")["alpha"])
        '0.013'
        """
        r: dict[str, Any] = {**self._ranges}
        options: dict[str, Any] = {"sgn": self.sgn, "rod": self.rod, "convention": self.convention}
        for name, value in changes.items():
            if name in options:
                options[name] = value
            elif name == "axis":
                r |= _components(value)
            elif name in PARAMETERS:
                r[name] = value
            else:
                raise GeometryError(f"{name!r} is no parameter; use {', '.join(PARAMETERS)}, axis, rod or convention")
        axis = (r.pop("n1"), r.pop("n2"), r.pop("n3"))
        return ToleranceBox(**r, **options, axis=axis)

    @property
    def ranges(self) -> dict[str, Range]:
        """All ranges by name."""
        return dict(self._ranges)

    @property
    def exact_input(self) -> bool:
        """Whether no plain float came in."""
        return all(value.exact for value in self._ranges.values())

    @property
    def is_point(self) -> bool:
        """Whether every range is a single number."""
        return all(value.is_point for value in self._ranges.values())

    def outer(self, name: str) -> Interval:
        """Return the smallest interval of doubles around the range of a parameter."""
        return self[name].outer

    def nominal(self) -> tuple[TiltedFourBar, Bearing]:
        """Return the linkage and the bearing in the middle of the box, in doubles (estimated: for tables and plots)."""
        m = {name: value.middle for name, value in self._ranges.items()}
        turn = m["azimuth"]
        n1 = m["n1"] * math.cos(turn) - m["n2"] * math.sin(turn)
        n2 = m["n1"] * math.sin(turn) + m["n2"] * math.cos(turn)
        axis = (m["n1"], m["n2"], m["n3"]) if turn == 0.0 else (n1, n2, m["n3"])
        options: Any = {"alpha": m["alpha"], "axis": axis, "rod": self.rod, "convention": self.convention}
        linkage = TiltedFourBar(m["l1"], m["l2"], m["l3"], m["l4"], self.sgn, **options)
        return linkage, Bearing(m["Rb"], m["Hb"], m["clearance"], m.get("hole_length"))

    def describe(self) -> dict[str, str]:
        """Ranges as text, for reports."""
        return {name: str(value) for name, value in self._ranges.items()}


def _components(axis: Any) -> dict[str, Any]:
    if isinstance(axis, str) or not hasattr(axis, "__len__") or len(axis) != 3:
        raise GeometryError(f"axis = {axis!r} is not a direction; give three components")
    return {f"n{i}": part for i, part in enumerate(axis, start=1)}


def _check(ranges: dict[str, Range]) -> None:
    for name in ("l1", "l2", "l3", "l4", "Rb", "hole_length"):
        if name in ranges and ranges[name].lower <= 0:
            raise GeometryError(f"{name} = {ranges[name]} must be positive; correct the value or its tolerance")
    if ranges["Hb"].lower < 0:
        raise GeometryError(f"Hb = {ranges['Hb']} must be zero or more; correct the value or its tolerance")
    if ranges["clearance"].lower <= -ranges["Rb"].lower:
        least = float(-ranges["Rb"].lower)
        raise GeometryError(
            f"clearance = {ranges['clearance']} mm leaves no hole; it must exceed -Rb = {least:.12g} mm"
        )
    parts = [ranges[f"n{i}"] for i in (1, 2, 3)]
    if all(part.lower <= Fraction(0) <= part.upper for part in parts):
        shown = ", ".join(map(str, parts))
        raise GeometryError(f"axis = ({shown}) contains the zero vector; give a direction that cannot vanish")
