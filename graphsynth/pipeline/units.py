"""Units written in scene files: ``"17.5 mm"``, ``"2 deg"``, ``"0.01 %"``, ``"0.3 N m/rad"``.

A unit is an exact rational factor to SI (radians for angles), a power of pi, and exponents of metre, kilogram,
second, ampere, radian and byte.  A value is converted exactly and rounded once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, TypeVar

T = TypeVar("T")

Dimensions = tuple[int, int, int, int, int, int]
_Meaning = tuple[Fraction, int, Dimensions]
_PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459")
#: One degree, radians.
DEGREE = math.pi / 180.0
_NONE: Dimensions = (0, 0, 0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of measurement; ``dimensions`` are exponents of (m, kg, s, A, rad, byte).

    >>> Unit.parse("N m/rad").dimensions
    (2, 1, -2, 0, -1, 0)
    """

    text: str
    factor: Fraction
    pi: int
    dimensions: Dimensions

    @classmethod
    def parse(cls, text: str) -> Unit:
        """Read a unit: symbols with optional powers, joined by space, ``*`` or ``/`` (which divides by the next one).

        A `ValueError` whose text is the symbol refuses an unknown one.
        """
        return _parse(text.strip())

    def to_si(self, number: float) -> float:
        """Return a number in this unit in SI, radians for angles.

        >>> Unit.parse("mm").to_si(17.5), Unit.parse("deg").to_si(180.0)
        (0.0175, 3.141592653589793)
        """
        if self.pi == 0:
            return float(Fraction(number) * self.factor)
        return math.radians(float(Fraction(number) * self.factor * 180)) * math.pi ** (self.pi - 1)

    def from_si(self, value: T) -> T:
        """Return an SI value, or an array of them, in this unit.

        >>> Unit.parse("°").from_si(math.pi), Unit.parse("mm").from_si(0.002)
        (180.0, 2.0)
        """
        factor = 1 / self.factor if self.pi == 0 else 1 / (self.factor * 180)
        scaled: Any = value if self.pi == 0 else value * (180.0 / math.pi) / math.pi ** (self.pi - 1)  # type: ignore[operator]
        return scaled * float(factor) if factor != 1 else scaled  # type: ignore[no-any-return]

    def agrees(self, other: Unit) -> bool:
        """Whether both measure the same quantity; a radian may be left out of mechanical and electrical units."""
        if (*self.dimensions[:4], self.dimensions[5]) != (*other.dimensions[:4], other.dimensions[5]):
            return False
        return self.dimensions[4] == other.dimensions[4] or self.dimensions[1] != 0

    @property
    def quantity(self) -> str:
        """The quantity in words, as in ``a length``; the unit itself if it has no common name."""
        return _QUANTITIES.get(self.dimensions, f"a quantity in {self.text}")


_SYMBOL = re.compile(r"([^\W\d²³]+|[%‰°′″Ω]|1)(?:\^?(-?[1-9])|([²³]))?")


def _meaning(text: str, units: Mapping[str, _Meaning]) -> _Meaning:
    """Return the factor to SI, the power of pi and the dimensions of a product of symbols."""
    factor, pi, dimensions, sign = Fraction(1), 0, _NONE, 1
    for part in re.findall(r"/|[^\s*·/]+", text):
        if part == "/":
            if sign < 0:
                raise ValueError(text)
            sign = -1
            continue
        match = _SYMBOL.fullmatch(part)
        known = units.get(match[1]) if match else None
        if known is None or match is None:
            raise ValueError(part)
        power = sign * (int(match[2]) if match[2] else {"²": 2, "³": 3}.get(match[3], 1))
        factor *= known[0] ** power
        pi += known[1] * power
        a, b, c, d, e, f = (have + power * more for have, more in zip(dimensions, known[2], strict=True))
        dimensions, sign = (a, b, c, d, e, f), 1
    if sign < 0:  # a stroke with nothing behind it
        raise ValueError(text)
    return factor, pi, dimensions


@cache
def _parse(text: str) -> Unit:
    return Unit(text, *_meaning(text, _UNITS))


def behind(unit: str) -> str:
    """Return a unit as print writes it behind a number, as in ``" kg m²"`` or ``"°"``."""
    sign = {"deg": "°"}.get(unit) or re.sub(r"\^([234])", lambda power: "²³⁴"[int(power[1]) - 2], unit)
    return sign if sign in ("", "°", "′", "″") else f" {sign}"


def grouped(count: int) -> str:
    """Return a count with thin spaces between thousands, as ISO 80000 does."""
    return f"{count:,}".replace(",", "\u202f")


def _listed(text: str) -> list[tuple[str, str]]:
    """Read ``"name = value; name = value"``; a name without a value stands for itself."""
    pairs = [entry.partition(" = ") for entry in text.split("; ")]
    return [(name, value or name) for name, _, value in pairs]


#: Endings of keys that say the unit of a bare number: ``radius_mm = 17.5``.
SUFFIXES: dict[str, str] = dict(
    _listed(
        "mm; cm; m; um; mm2; mm4; m2; rad; mrad; deg; arcmin; arcsec; s; ms; us; kg; g; N; kN; Nm; Nmm; J; V; A; ohm; "
        "H; mH; W; rpm; Pa; MPa; GPa; MB; percent = %; rad_s = rad/s; deg_s = deg/s; m_s = m/s; mm_s = mm/s; "
        "mm_s2 = mm/s^2; rad_s2 = rad/s^2; m_s2 = m/s^2; kg_m2 = kg m^2; g_mm2 = g mm^2; kg_mm2 = kg mm^2; V_s = V s; "
        "N_per_m = N/m; N_per_mm = N/mm; Nm_per_rad = N m/rad; Nm_s = N m s; N_s_per_m = N s/m; Nm_per_A = N m/A; "
        "V_per_rad_s = V s/rad; Nm_s_per_rad = N m s/rad; kg_m = kg m; Nms = N m s"
    )
)


def split_suffix(key: str) -> tuple[str, str]:
    """Split a key into its name and the unit its ending says, empty if it says none.

    >>> split_suffix("clearance_mm"), split_suffix("speed_rad_s"), split_suffix("branch")
    (('clearance', 'mm'), ('speed', 'rad/s'), ('branch', ''))
    """
    parts = key.split("_")
    for start in range(1, len(parts)):
        unit = SUFFIXES.get("_".join(parts[start:]))
        if unit:
            return "_".join(parts[:start]), unit
    return key, ""


_NUMBER = re.compile(
    r"\s*([+-]?(?:[0-9][0-9_]*)?(?:\.[0-9]*)?(?:[eE][+-]?[0-9]{1,3})?(?:/[0-9]{1,18})?)\s*(.*?)\s*", re.S
)


def split_value(text: str) -> tuple[Fraction, str]:
    """Split a written value into its exact number and the text of its unit; a `ValueError` if it begins with none.

    >>> split_value("17.5 mm"), split_value("1/30")
    ((Fraction(35, 2), 'mm'), (Fraction(1, 30), ''))
    """
    match = _NUMBER.fullmatch(text)
    if match is None or len(text) > 200 or not any(c.isdigit() for c in match[1]):
        raise ValueError(text)
    number, _, below = match[1].partition("/")
    try:
        return Fraction(number) / Fraction(below or 1), match[2]
    except ZeroDivisionError:
        raise ValueError(text) from None


def convert(number: Fraction, unit: Unit, to: Unit) -> tuple[Fraction, bool]:
    """Return a number in another unit of the same quantity, and whether it is exact (pi may not cancel).

    >>> convert(Fraction(3), Unit.parse("cm"), Unit.parse("mm"))
    (Fraction(30, 1), True)
    """
    pi = unit.pi - to.pi
    value = number * unit.factor / to.factor
    return (value * _PI**pi, number == 0) if pi else (value, True)


_PREFIXES = {"": 0, "n": -9, "u": -6, "µ": -6, "m": -3, "k": 3, "M": 6, "G": 9}
#: Units that take a prefix, each by units before it, and units that take none; ``pi`` is the number.
_PREFIXED = "N = 1 kg m/s^2; J = 1 N m; W = 1 J/s; Pa = 1 N/m^2; V = 1 W/A; H = 1 V s/A; ohm = 1 V/A; Wb = 1 V s"
_OTHERS = (
    "1 = 1; % = 1/100; ‰ = 1/1000; ppm = 1/1000000; cm = 1/100 m; in = 254/10000 m; min = 60 s; h = 3600 s; "
    "t = 1000 kg; turn = 2 pi rad; deg = 1/180 pi rad; ° = 1 deg; arcmin = 1/60 deg; ′ = 1 arcmin; "
    "arcsec = 1/60 arcmin; ″ = 1 arcsec; rpm = 1/30 pi rad/s; Nm = 1 N m; mNm = 1 mN m; Nmm = 1 N mm; Ω = 1 ohm"
)


def _table() -> dict[str, _Meaning]:
    units: dict[str, _Meaning] = {"": (Fraction(1), 0, _NONE), "pi": (Fraction(1), 1, _NONE)}

    def define(symbol: str, number: Fraction, meaning: _Meaning, prefixes: Mapping[str, int]) -> None:
        for prefix, power in prefixes.items():
            units[prefix + symbol] = number * meaning[0] * Fraction(10) ** power, meaning[1], meaning[2]

    for place, symbol in enumerate(("m", "g", "s", "A", "rad", "B")):
        a, b, c, d, e, f = (int(k == place) for k in range(6))
        define(symbol, Fraction(1, 1000 if symbol == "g" else 1), (Fraction(1), 0, (a, b, c, d, e, f)), _PREFIXES)
    for definitions, prefixes in ((_PREFIXED, _PREFIXES), (_OTHERS, {"": 0})):
        for symbol, value in _listed(definitions):
            number, unit = split_value(value)
            define(symbol, number, _meaning(unit, units), prefixes)
    del units["pi"]
    return units


_UNITS = _table()
_QUANTITIES: dict[Dimensions, str] = {
    _parse(unit).dimensions: words
    for unit, words in _listed(
        "1 = a plain number; m = a length; m^2 = an area; rad = an angle; s = a time; kg = a mass; N = a force; "
        "N m = a torque; rad/s = an angular velocity; rad/s^2 = an angular acceleration; m/s = a velocity; "
        "m/s^2 = an acceleration; kg m^2 = a moment of inertia; V = a voltage; A = a current; ohm = a resistance; "
        "H = an inductance; W = a power; N/m = a stiffness; N s/m = a damping; Pa = a pressure; B = a size of memory"
    )
}
