"""What the rows advise: which method for which accuracy, and whether a default lies at the knee.

Nothing here is known beforehand: every sentence is computed from the rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from graphsynth.evidence.rows import FLOOR, Problem, Row, RowStatus

#: Factor in time that one more decade of accuracy may cost before the knee is passed.
DECADE_COST = 2.0
#: Below this ratio two times are equal: wall times on a shared machine are not known better.
_NOISE = 1.25
#: An error counts as smaller only below this part of another: the last digits of two errors are luck.
_SMALLER = 0.5


def _size(row: Row, floor: float = FLOOR) -> float:
    return max(row.error, floor)


def front(rows: Iterable[Row], floor: float = FLOOR) -> tuple[Row, ...]:
    """Return the good rows that no other beats in both time and error, fastest first.

    Errors count as smaller only below half of another, and as ``floor`` if they are below it.

    Parameters
    ----------
    rows : iterable of Row
        Of one problem.
    floor : float, optional
        Errors below it count as it; half a unit in the last place of 1 by default.

    Returns
    -------
    tuple of Row

    Examples
    --------
    >>> rows = [Row("a", str(k), e, t, 3, "", "") for k, (e, t) in enumerate([(1e-2, 1.0), (1e-3, 2.0), (1e-1, 3.0)])]
    >>> [row.setting for row in front(rows)]
    ['0', '1']
    """
    found: list[Row] = []
    for row in sorted((row for row in rows if row.good), key=lambda row: (row.seconds, _size(row, floor))):
        if not found or _size(row, floor) < _SMALLER * _size(found[-1], floor):
            found.append(row)
    return tuple(found)


@dataclass(frozen=True)
class Knee:
    """The setting of a method beyond which more accuracy costs much time, and how the library's default compares.

    Attributes
    ----------
    method : str
    knee : Row
        The finest setting up to which each further decade of accuracy costs at most twice the time.
    default : Row or None
    verdict : {"at the knee", "finer", "coarser", "slower, no gain", "failed", "no default"}
        The others only if the default differs from the knee by more than a factor of two in time or a decade in error.
    """

    method: str
    knee: Row
    default: Row | None
    verdict: str

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        k, d = self.knee, self.default
        at = f"the knee is {k.setting} ({k.error:.1e} in {seconds_text(k.seconds)})"
        if d is None:
            return f"{self.method}: {at}"
        if self.verdict == "failed":
            return f"{self.method}: the default {d.setting} {d.status.value} here; {at}"
        own = f"{self.method}: the default {d.setting} ({d.error:.1e} in {seconds_text(d.seconds)})"
        if self.verdict == "at the knee":
            return f"{own} lies at the knee"
        than = f"{self.verdict} than the knee"
        if self.verdict == "slower, no gain":
            than = "slower than the knee and gains nothing"
        return f"{own} is {than}; {at}"


def knee(rows: Sequence[Row], floor: float = FLOOR) -> Row | None:
    """Return the finest row up to which each further decade of accuracy costs at most `DECADE_COST` times as much.

    From the fastest row of the method's own front on, every step that pays is taken, also over rows that do not.  None
    without a good row.

    Parameters
    ----------
    rows : sequence of Row
        Of one method.
    floor : float, optional
        Errors below it count as it; half a unit in the last place of 1 by default.

    Returns
    -------
    Row or None

    Examples
    --------
    >>> rows = [Row("a", str(k), 10.0**-k, t, 3, "", "") for k, t in enumerate([1.0, 1.5, 2.0, 9.0])]
    >>> knee(rows).setting
    '2'
    """
    own = front(rows, floor)
    if not own:
        return None
    at = own[0]
    for row in own[1:]:
        decades = math.log10(_size(at) / _size(row))
        # a step that does not pay may lead to one that does: one slow run must not end the search
        if row.seconds <= at.seconds * max(DECADE_COST**decades, _NOISE if decades > 0.3 else 1.0):
            at = row
    return at


def knees(problem: Problem) -> tuple[Knee, ...]:
    """Compare the default of every method that has three settings or more with its knee.

    Parameters
    ----------
    problem : Problem
        With its measured rows.

    Returns
    -------
    tuple of Knee
        One for each such method.
    """
    found = []
    for method in problem.methods:
        rows = problem.of(method)
        at = knee(rows, problem.floor)
        if at is None or len(rows) < 3 or problem.count or problem.over:
            continue
        default = next((row for row in rows if row.default), None)
        found.append(Knee(method, at, default, _verdict(at, default)))
    return tuple(found)


def _verdict(at: Row, default: Row | None) -> str:
    if default is None:
        return "no default"
    if not default.good:
        return "failed"
    near = _size(default) <= 10.0 * _size(at) and default.seconds <= 2.0 * at.seconds
    if near:
        return "at the knee"
    if default.seconds > at.seconds:
        return "slower, no gain" if _size(default) > _size(at) else "finer"
    return "coarser"


def seconds_text(seconds: float) -> str:
    """Write a time with two digits.

    >>> [seconds_text(t) for t in (0.0000034, 0.123, 2.0, 1234.0)]
    ['3.4 µs', '120 ms', '2 s', '1200 s']
    """
    if not math.isfinite(seconds):
        return "no time"
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6), ("ns", 1e9)):
        if seconds * factor >= 1.0 or unit == "ns":
            break
    return f"{float(f'{seconds * factor:.2g}'):g} {unit}"


def advice(problem: Problem) -> dict[str, str]:
    """Return one sentence for each method: for which accuracy it is the fastest, or which other method is better.

    Parameters
    ----------
    problem : Problem
        With its measured rows.

    Returns
    -------
    dict of str to str
        Method to sentence.

    Examples
    --------
    >>> rows = [Row("a", "coarse", 1e-2, 1e-3, 3, "", ""), Row("a", "fine", 1e-4, 1e-1, 3, "", ""),
    ...         Row("a", "finest", 1e-5, 1.0, 3, "", ""), Row("b", "", 1e-12, 1e-2, 3, "", "")]
    >>> advice(Problem("p", "q", "mm", tuple(rows)))["a"]
    'a: fastest for errors down to 0.01 mm (coarse, 1 ms); for smaller errors b is faster.'
    """
    if problem.sentences:
        return dict(problem.sentences)
    best = front(problem.rows, problem.floor)
    proved = front((row for row in problem.rows if row.proved), problem.floor)
    return {method: _sentence(problem, method, best, proved) for method in problem.methods}


def _sentence(problem: Problem, method: str, best: tuple[Row, ...], proved: tuple[Row, ...]) -> str:
    rows = problem.of(method)
    good = [row for row in rows if row.good]
    if not good:
        why = next((row.reason for row in rows if row.reason), "no result")
        return f"{method}: not usable here, no setting gave a reliable result ({why}){_settings(rows)}."
    mine = [row for row in best if row.method == method]
    if mine:
        text = f"fastest {_range(mine, best, problem.unit)}"
    elif any(row.method == method for row in proved):
        own = [row for row in proved if row.method == method]
        text = f"fastest with a proof, {_range(own, proved, problem.unit)}"
    else:
        text = _beaten(good, best, problem)
    lost = [row for row in rows if row.status is not RowStatus.OK]
    tail = _settings(rows)
    if lost:
        which = ", ".join(row.setting or "its only setting" for row in lost[:3]) + (" ..." if len(lost) > 3 else "")
        tail += f"; {len(lost)} of {len(rows)} settings failed or gave a wrong result ({which})"
    return f"{method}: {text}{tail}."


def _settings(rows: Sequence[Row]) -> str:
    """Say that a method has fewer than three settings, so that its row is a point and no curve."""
    if len(rows) >= 3:
        return ""
    if len(rows) == 1 and not rows[0].setting:
        return "; it has no setting"
    return f"; measured at {len(rows)} setting{'s' if len(rows) > 1 else ''} only"


def _range(mine: list[Row], best: tuple[Row, ...], unit: str) -> str:
    """Say for which wanted errors the rows of a method are the fastest."""
    first, last = best.index(mine[0]), best.index(mine[-1])
    setting = f"{mine[-1].setting}, " if mine[-1].setting else ""
    low = f"{_error(mine[-1].error, unit)} ({setting}{seconds_text(mine[-1].seconds)})"
    between = sorted({row.method for row in best[first : last + 1]} - {mine[0].method})
    text = f"for errors down to {low}"
    if first > 0:
        text = f"for errors from {_error(best[first - 1].error, unit)} down to {low}"
    if between:
        text += f", with {' and '.join(between)} in between"
    if last + 1 < len(best):
        text += f"; for smaller errors {best[last + 1].method} is faster"
    elif len(best) > 1:
        text += ", the smallest error of all"
    return text


def _beaten(good: list[Row], best: tuple[Row, ...], problem: Problem) -> str:
    floor, unit = problem.floor, problem.unit
    own = min(good, key=lambda row: (_size(row, floor), row.seconds))
    other = next((row for row in best if _SMALLER * _size(row, floor) <= _size(own, floor)), best[-1])
    times = own.seconds / other.seconds
    than = f"{_error(other.error, unit)} in {seconds_text(other.seconds)}"
    if times < _NOISE:
        return f"as good as {other.label}, {than}"
    return (
        f"{other.label} is better: {than}, {float(f'{times:.2g}'):g} times faster than {_error(own.error, unit)} in "
        f"{seconds_text(own.seconds)} here"
    )


def _error(error: float, unit: str) -> str:
    text = "rounding" if error <= FLOOR else f"{error:.1g}"
    return f"{text} {unit}" if unit and unit != "relative" and error > FLOOR else text
