"""Checks of a stress case: a value against what is right, a required report, a refusal.

What is right comes from outside of the library: a printed value of the specification, a closed form, or many digits.
Comparisons of numbers are made with exact fractions, so that the comparison itself adds no error.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import zip_longest
from numbers import Integral
from typing import Any

from graphsynth.core.errors import GraphsynthError


class CaseStatus(enum.Enum):
    """Outcome of a check or of a case; a case has the worst of its checks."""

    OK = "ok"
    FLAGGED = "flagged"
    NOT_RUN = "not run"
    WRONG = "WRONG"


#: From harmless to bad.
SEVERITY = (CaseStatus.OK, CaseStatus.FLAGGED, CaseStatus.NOT_RUN, CaseStatus.WRONG)


@dataclass(frozen=True)
class Check:
    """One comparison.

    Attributes
    ----------
    what : str
        What was compared.
    right, given : str
        What is right, and what the library gave.
    source : str
        Where ``right`` comes from.
    error, bound : float
        Distance of ``given`` from ``right`` and the distance allowed; NaN for reports and refusals.
    status : Status
        OK: a number within its bound, or an answer that is right.  FLAGGED: the required report or refusal was given.
        WRONG: neither.
    """

    what: str
    right: str
    given: str
    source: str
    error: float
    bound: float
    status: CaseStatus


def exact(value: Any) -> Fraction | None:
    """Return a number as a fraction, exactly; None for NaN and infinities.

    Takes integers, floats, fractions, decimal text and mpmath numbers.

    Examples
    --------
    >>> exact("0.1"), exact(0.5), exact(float("nan"))
    (Fraction(1, 10), Fraction(1, 2), None)
    """
    if isinstance(value, (str, Fraction)):
        return Fraction(value)
    if isinstance(value, Integral):  # also those of numpy, which a double may not hold
        return Fraction(int(value))
    if hasattr(value, "man_exp"):  # mpmath
        if not value.man and value.exp:  # infinities and NaN
            return None
        return Fraction(int(value.man)) * Fraction(2) ** int(value.exp) * (-1 if value < 0 else 1)
    number = float(value)
    return Fraction(number) if math.isfinite(number) else None


def _text(value: Any) -> str:
    """Return a number or anything else in a few characters."""
    if isinstance(value, str):
        return value
    if isinstance(value, Fraction):
        return f"{float(value):.17g}" if value.denominator > 1 else str(value.numerator)
    if hasattr(value, "man_exp"):
        from mpmath import nstr

        return str(nstr(value, 22))
    if isinstance(value, bool) or str(getattr(value, "dtype", "")) == "bool" or not hasattr(value, "__float__"):
        return str(value)
    return str(value) if isinstance(value, int) else f"{float(value):.17g}"


@dataclass
class Checks:
    """Recorder that a case fills.

    Attributes
    ----------
    rows : list of Check
        What was compared so far.
    source : str
        Where what is right comes from, unless a check names another source.
    """

    source: str
    rows: list[Check] = field(default_factory=list)

    def value(
        self, what: str, given: Any, right: Any, *, relative: float = 0.0, absolute: float = 0.0, source: str = ""
    ) -> None:
        """Compare a number; it may be off by ``relative * |right| + absolute``, and must be equal if both are zero.

        What is right may be decimal text, which is read exactly; `source` says where it comes from, if not from the
        source of the case.  A `ValueError` says that it is not finite: the case is written wrongly.
        """
        wanted, found = exact(right), exact(given)
        if wanted is None:
            raise ValueError(f"what is right for {what} is not finite: use reports() for reports")
        bound = Fraction(relative) * abs(wanted) + Fraction(absolute)
        error = math.inf if found is None else abs(found - wanted)
        status = CaseStatus.OK if error <= bound else CaseStatus.WRONG
        self._add(status, what, _text(right), _text(given), source, _as_float(error), _as_float(bound))

    def _add(self, status: CaseStatus, what: str, right: str, given: str, source: str, *numbers: float) -> None:
        error, bound = numbers or (math.nan, math.nan)
        self.rows.append(Check(what, right, given, source or self.source, error, bound, status))

    def values(
        self,
        what: str,
        given: Iterable[Any],
        right: Iterable[Any],
        *,
        relative: float = 0.0,
        absolute: float = 0.0,
        source: str = "",
    ) -> None:
        """Compare several numbers, one row each; a missing or superfluous number is wrong."""
        missing = object()
        for k, (found, wanted) in enumerate(zip_longest(given, right, fillvalue=missing)):
            name = f"{what} [{k}]"
            if found is missing or wanted is missing:
                shown = "missing" if found is missing else _text(found)
                self.reports(name, shown, "nothing" if wanted is missing else _text(wanted))
            else:
                self.value(name, found, wanted, relative=relative, absolute=absolute, source=source)

    def below(self, what: str, given: Any, bound: float, *, source: str = "") -> None:
        """Require a number of zero or more below a bound: a residual, an error, a drift."""
        self.value(what, given, 0, absolute=bound, source=source)

    def reports(self, what: str, given: Any, right: Any, *, source: str = "") -> None:
        """Require a report of something extreme: a status, an event, a flag, a proof withheld; others: `equals`."""
        self._add(CaseStatus.FLAGGED if given == right else CaseStatus.WRONG, what, _text(right), _text(given), source)

    def equals(self, what: str, given: Any, right: Any, *, source: str = "") -> None:
        """Require an answer that is no number with an error: a count, a list, a proved verdict; OK if it is right."""
        self._add(CaseStatus.OK if given == right else CaseStatus.WRONG, what, _text(right), _text(given), source)

    def holds(self, what: str, good: object, given: Any = "", right: str = "yes", *, source: str = "") -> None:
        """Require a statement to hold; ``given`` shows what was found."""
        shown = _text(given) if given != "" else ("yes" if good else "no")
        self._add(CaseStatus.OK if good else CaseStatus.WRONG, what, right, shown, source)

    def mentions(self, what: str, given: str, *words: str, source: str = "") -> None:
        """Require a sentence for a person that contains all the words."""
        good = given and all(word in given for word in words)
        right = " ... ".join(f"“{word}”" for word in words)
        self._add(CaseStatus.FLAGGED if good else CaseStatus.WRONG, what, right, given, source)

    def refused(self, what: str, call: Callable[[], object], *words: str, source: str = "") -> None:
        """Require a refusal: an exception of the library with one line that contains all the words."""
        try:
            found = call()
        except GraphsynthError as error:
            text = str(error)
            if "\n" in text:
                self.holds(what, False, repr(text), "a refusal in one line", source=source)
            else:
                self.mentions(what, text, *words, source=source)
        else:
            self._add(CaseStatus.WRONG, what, "a refusal", f"no refusal but {type(found).__name__}", source)


def _as_float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf
