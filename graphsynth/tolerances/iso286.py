"""ISO 286 limits and fits: exact limit deviations of every tolerance class, for nominal sizes up to 500 mm.

The table (``iso286.toml``) holds the standard tolerances IT01 to IT18 and the fundamental deviations of the shafts;
those of the holes follow by the standard's two rules.  See theory/drawing-tolerances 1.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Any

from graphsynth.core.errors import GeometryError

GRADES = ("01", *map(str, range(19)))
LETTERS = re.findall(r"\w+", "a b c cd d e ef f fg g h js j k m n p r s t u v x y z za zb zc")
LARGEST = 500
#: Nominal sizes up to this have no shafts a and b, no N of coarse grades, and no grades from IT14.
_TINY = 1
_MICRO = Fraction(1, 1000)
_FINEST_WITH_DELTA = GRADES.index("3")
_CLASS = re.compile(r"([A-Z]{1,2}|[a-z]{1,2})(01|0|[1-9]\d?)")
_FIT = re.compile(r"(?:(?P<size>[^\sA-Za-z]+)\s*)?(?P<hole>[A-Z]{1,2}\d+)\s*/?\s*(?P<shaft>[a-z]{1,2}\d+)")


@dataclass(frozen=True)
class LimitDeviations:
    """Limits of a size less the nominal one, exact, in millimetres: ``EI`` and ``ES`` of a hole, ``ei, es`` of a shaft.

    Examples
    --------
    >>> limit_deviations("k6", 25)
    LimitDeviations(lower=Fraction(1, 500), upper=Fraction(3, 200))
    """

    lower: Fraction
    upper: Fraction

    @property
    def tolerance(self) -> Fraction:
        """Upper less lower deviation: the standard tolerance."""
        return self.upper - self.lower


@cache
def table() -> dict[str, Any]:
    """Return the file: ranges of sizes (mm), and rows of exact micrometres, None where the standard has no value."""
    given = tomllib.loads((files("graphsynth.tolerances") / "iso286.toml").read_text(encoding="utf-8"))

    def row(text: str) -> tuple[Fraction | None, ...]:
        return tuple(None if entry == "-" else Fraction(entry) for entry in text.split())

    return {
        name: {key: row(text) for key, text in own.items()} if isinstance(own, dict) else row(own)
        for name, own in given.items()
    }


def nominal_size(size: Any) -> Fraction:
    """Read a nominal size in millimetres, exactly; `GeometryError` unless it lies above 0 and at most 500."""
    try:
        found = Fraction(size.strip() if isinstance(size, str) else size)
    except (TypeError, ValueError, OverflowError, ZeroDivisionError) as error:
        raise GeometryError(f"nominal size {size!r} is no number of millimetres; give one, as 25 or '12.5'") from error
    if not 0 < found <= LARGEST:
        raise GeometryError(f"nominal size {size} mm is outside the table; give one number up to {LARGEST} mm")
    return found


def _entry(group: str, key: str, size: Fraction) -> Fraction | None:
    """Value of a row at a size, micrometres; the row is fine or coarse by its length."""
    data = table()
    row: tuple[Fraction | None, ...] = data[group].get(key, ())
    if not row:
        return None
    ends = data["fine_sizes" if len(row) == len(data["fine_sizes"]) else "sizes"]
    return row[bisect_left(ends, size)]


def standard_tolerance(grade: int | str, size: Any) -> Fraction:
    """Width of a tolerance grade at a nominal size, exact.

    Parameters
    ----------
    grade : int or str
        ``7`` or ``"7"`` for IT7; ``"01"`` and ``"0"`` for the two finest.
    size : number or decimal text
        Nominal size, millimetres, at most 500.

    Returns
    -------
    Fraction
        Millimetres; exact value of ISO 286-1:2010.

    Raises
    ------
    GeometryError
        For a grade or size that the table does not have, and IT14 to IT18 up to 1 mm.

    Examples
    --------
    >>> standard_tolerance(7, 25)
    Fraction(21, 1000)
    """
    return _tolerance(str(grade), nominal_size(size)) * _MICRO


def _tolerance(grade: str, size: Fraction) -> Fraction:
    if grade not in GRADES:
        raise GeometryError(f"tolerance grade IT{grade} does not exist; the standard has IT01, IT0, IT1 to IT18")
    if size <= _TINY and GRADES.index(grade) >= GRADES.index("14"):
        raise GeometryError(f"IT{grade} is not standardised up to {_TINY} mm; size {size} mm needs IT13 or finer")
    found = _entry("grades", grade, size)
    assert found is not None  # every grade has every size
    return found


def limit_deviations(tolerance_class: str, size: Any) -> LimitDeviations:
    """Limits of a tolerance class such as ``"H7"`` (a hole) or ``"g6"`` (a shaft) at a nominal size, exact.

    Parameters
    ----------
    tolerance_class : str
        Letters a to zc, capitals for holes, and a grade 01 to 18.
    size : number or decimal text
        Nominal size, millimetres, at most 500.

    Returns
    -------
    LimitDeviations
        Exact values of ISO 286-1:2010; js and JS are plus and minus half of the tolerance, not rounded.

    Raises
    ------
    GeometryError
        For a class that the standard does not have at this size.

    Examples
    --------
    >>> limit_deviations("K7", 25)
    LimitDeviations(lower=Fraction(-3, 200), upper=Fraction(3, 500))
    """
    parts = _CLASS.fullmatch(tolerance_class.strip()) if isinstance(tolerance_class, str) else None
    if parts is None or parts[2] not in GRADES or parts[1].lower() not in LETTERS:
        raise GeometryError(
            f"tolerance class {tolerance_class!r} is not in the table; give a letter a to zc (A to ZC for a hole) and "
            "a grade 01 to 18, as H7 or g6"
        )
    letter, grade, at = parts[1], parts[2], nominal_size(size)
    width = _tolerance(grade, at)
    if letter.lower() == "js":
        return LimitDeviations(-width / 2 * _MICRO, width / 2 * _MICRO)
    found = _shaft(letter, grade, at) if letter.islower() else _hole(letter, grade, at)
    if found is None or (at <= _TINY and letter.lower() in "ab"):
        raise GeometryError(f"{letter}{grade} is not standardised at {at} mm; choose another letter or grade")
    value, is_upper = found
    lower = value - width if is_upper else value
    return LimitDeviations(lower * _MICRO, (lower + width) * _MICRO)


def _shaft(letter: str, grade: str, size: Fraction) -> tuple[Fraction, bool] | None:
    """Fundamental deviation of a shaft, micrometres, and whether it is the upper one."""
    below = _entry("below", letter, size)
    if below is not None:
        return -below, True
    if letter == "j":
        low = _entry("shaft_j", grade, size)
        return None if low is None else (-low, False)
    if letter == "k" and grade not in ("4", "5", "6", "7"):
        return Fraction(0), False
    above = _entry("above", letter, size)
    return None if above is None else (above, False)


def _hole(letter: str, grade: str, size: Fraction) -> tuple[Fraction, bool] | None:
    """Fundamental deviation of a hole, micrometres, and whether it is the upper one.

    General rule: that of the shaft with the other sign.  Special rule for K, M, N up to IT8 and P to ZC up to IT7 above
    3 mm: the difference of this and the next finer grade is added, so that a fit is the same on either basis.
    """
    below = _entry("below", letter.lower(), size)
    if below is not None:
        return below, False
    if letter == "J":
        high = _entry("hole_j", grade, size)
        return None if high is None else (high, True)
    above, at = _entry("above", letter.lower(), size), GRADES.index(grade)
    if above is None:
        return None
    smallest = table()["sizes"][0]
    if size <= smallest:
        return (Fraction(0) if letter == "K" else -above, True) if letter != "N" or size > _TINY or at <= 9 else None
    coarsest = GRADES.index("8" if letter in "KMN" else "7")
    if at > coarsest:
        values = {"K": None, "N": Fraction(0)}
        value = values.get(letter, -above)
        return None if value is None else (value, True)
    if at < _FINEST_WITH_DELTA:
        return None
    delta = _tolerance(grade, size) - _tolerance(GRADES[at - 1], size)
    if letter == "M" and grade == "6" and 250 < size <= 315:
        return Fraction(-9), True  # the one value that the standard sets against its rule, which gives -11
    return delta - above, True


def read_fit(text: str, size: Any = None) -> tuple[str, Fraction, LimitDeviations, LimitDeviations]:
    """Read ``"H7/g6"`` or ``"25 H7/g6"``: its name, the nominal size (mm), and the limits of hole and shaft."""
    parts = _FIT.fullmatch(text.strip()) if isinstance(text, str) else None
    if parts is None:
        raise GeometryError(f"fit {text!r} is not in the table; give hole and shaft, as H7/g6 or 25 H7/g6")
    if parts["size"] is None and size is None:
        raise GeometryError(f"fit {text!r} has no nominal size; write it in front, as 25 H7/g6")
    if parts["size"] is not None and size is not None:
        raise GeometryError(f"fit {text!r} has a nominal size, and {size} was given too; give it once")
    nominal = nominal_size(parts["size"] if size is None else size)
    hole, shaft = (limit_deviations(parts[part], nominal) for part in ("hole", "shaft"))
    return f"{parts['hole']}/{parts['shaft']}", nominal, hole, shaft
