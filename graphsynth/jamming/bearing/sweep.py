"""The turn cut into pieces: free, jammed or undecided with proof, for motions without a closed form.

The interference is enclosed on every piece of the turn; undecided pieces are halved until a resolution or a budget ends
the search (theory/jam-arcs 3).  For the lambda linkage `sweep_linkage` uses interval kinematics, which shares
no formula with the closed form of the arcs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Budget, Count, Real
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.arcs import TURN_HIGH, Span, total_length
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import ToleranceBox

if TYPE_CHECKING:
    from graphsynth.intervals import Interval

Mask = NDArray[np.bool_]
_FREE, _JAMS, _OPEN, _OUT = 0, 1, 2, 3  # in the order of the fields of `TurnPartition`
_ENOUGH = 64


class PieceInterference(NamedTuple):
    """Enclosure of the interference on pieces of the turn, over all parameters; and what is proved about assembly.

    ``assembled``: at every angle of the piece for every parameter vector; ``missing``: at none of them.
    """

    interference: Interval
    assembled: Mask
    missing: Mask


@dataclass(frozen=True)
class TurnPartition:
    """The turn in four kinds of spans (radians, within [0, 2 pi]); together they cover it.

    Certified: no parameter vector binds (``free``), every one is assembled and jammed (``inner``), none can be
    assembled (``missing``); ``undecided`` is the rest, where neither is proved at this resolution.  Not ``finished``:
    the budget ended the search, after so many ``pieces``, above the resolution asked for.
    """

    free: tuple[Span, ...]
    inner: tuple[Span, ...]
    undecided: tuple[Span, ...]
    missing: tuple[Span, ...]
    pieces: int
    finished: bool
    seconds: float = field(default=0.0, compare=False)

    @property
    def undecided_part(self) -> float:
        """Part of the turn that is undecided."""
        return total_length(self.undecided) / math.tau


@checked
def sweep_turn(
    interference: Callable[[Interval], PieceInterference],
    *,
    resolution: Real = 1e-6,
    first: Count = 256,
    max_pieces: Count = 200_000,
    max_seconds: Budget = math.inf,
) -> TurnPartition:
    """Partition the turn by the sign of an interference given in intervals.

    Parameters
    ----------
    interference : callable
        Takes pieces of the turn, an `Interval` of shape (m,), and returns a `PieceInterference`.
    resolution, first : float, int
        Undecided pieces no longer than this (radians, at least 1e-15) are left; pieces to begin with.
    max_pieces, max_seconds : budgets
        Exhausted: what is not settled is undecided, ``finished`` is False.

    Returns
    -------
    TurnPartition
        Pieces that jam, are free, cannot be assembled (certified), or are undecided.

    Raises
    ------
    GeometryError
        For a resolution that is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from graphsynth.intervals import sin
    >>> def always(f):
    ...     return PieceInterference(sin(f) - 0.5, np.ones(len(f), bool), np.zeros(len(f), bool))
    >>> found = sweep_turn(always)
    >>> [round(end, 5) for end in found.inner[0]], found.undecided_part < 1e-6
    ([0.5236, 2.61799], True)
    """
    from graphsynth.intervals import Interval, check_rounding

    begin = perf_counter()
    check_rounding()
    if not resolution >= 1e-15:
        raise GeometryError(f"resolution = {resolution} must be at least 1e-15; 1e-6 rad is usual")
    edges = np.linspace(0.0, TURN_HIGH, first + 1)
    lo, hi = edges[:-1], edges[1:]
    done: list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int8]]] = []
    pieces, finished = 0, True
    while lo.size:
        if pieces + lo.size > max_pieces or perf_counter() - begin > max_seconds:
            finished = False
            done.append((lo, hi, np.full(lo.size, _OPEN, dtype=np.int8)))
            break
        found = interference(Interval.from_bounds(lo, hi))
        value, kind = found.interference, np.full(lo.size, _OPEN, dtype=np.int8)
        sound = value.guaranteed & ~value.is_empty
        kind[np.broadcast_to(sound & (value.hi < 0.0), kind.shape)] = _FREE
        kind[np.broadcast_to(sound & (value.lo > 0.0) & found.assembled, kind.shape)] = _JAMS
        kind[found.missing] = _OUT
        pieces += lo.size
        split = (kind == _OPEN) & (hi - lo > resolution)
        done.append((lo[~split], hi[~split], kind[~split]))
        lo, hi = _split(lo[split], hi[split])
    # sorted, and neighbours of one kind joined: their borders are the same doubles
    lo, hi, kind = (np.concatenate([part[i] for part in done]) for i in range(3))
    order = np.argsort(lo, kind="stable")
    lo, hi, kind = lo[order], hi[order], kind[order]
    starts = np.flatnonzero(np.r_[True, kind[1:] != kind[:-1]])
    stops = np.r_[starts[1:] - 1, len(kind) - 1]
    spans: list[list[Span]] = [[], [], [], []]
    for a, b in zip(starts, stops):
        spans[int(kind[a])].append(Span(float(lo[a]), float(hi[b])))
    free, inner, undecided, missing = (tuple(part) for part in spans)
    return TurnPartition(free, inner, undecided, missing, pieces, finished, perf_counter() - begin)


def _split(lo: NDArray[np.float64], hi: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cut every piece in two, or in more parts when there are few: long arrays take the compiled path."""
    parts = 2 if lo.size >= _ENOUGH // 2 else -(-_ENOUGH // max(lo.size, 1))
    shares = np.linspace(0.0, 1.0, parts + 1)[1:-1]
    inner = np.clip(lo[:, None] + (hi - lo)[:, None] * shares, lo[:, None], hi[:, None])
    starts, stops = np.column_stack([lo, inner]), np.column_stack([inner, hi])
    filled = (starts < stops) | (lo == hi)[:, None]
    return starts[filled], stops[filled]


@checked
def sweep_linkage(
    box: ToleranceBox,
    condition: Condition = "A",
    *,
    resolution: Real = 1e-6,
    max_pieces: Count = 200_000,
    max_seconds: Budget = math.inf,
) -> TurnPartition:
    """Partition the turn of a lambda linkage (any four-bar) by interval kinematics, for all parameters of a box.

    Unlike the closed form it also proves where the linkage cannot be assembled.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        Ranges of all parameters, for each combination of which the statement holds; contact condition.
    resolution, max_pieces, max_seconds
        As for `sweep_turn`.

    Returns
    -------
    TurnPartition
        Pieces that jam, are free, cannot be assembled (certified), or are undecided.

    Examples
    --------
    >>> found = sweep_linkage(ToleranceBox(alpha="1/30"), resolution=1e-3)
    >>> len(found.inner), len(found.missing), found.undecided_part < 1e-3
    (2, 0, True)
    """
    from graphsynth.intervals import Interval
    from graphsynth.jamming.bearing.corners import check_condition, corner_interference, pose

    check_condition(box, condition)

    def interference(f: Interval) -> PieceInterference:
        found = pose(box, f)
        low, high = (Interval.from_bounds(end, end) for end in (found.sine.lo, found.sine.hi))
        lower, upper = corner_interference(box, low, condition, 0).lo, corner_interference(box, high, condition, 1).hi
        return PieceInterference(Interval.from_bounds(lower, upper), found.assembled, found.missing)

    return sweep_turn(interference, resolution=resolution, max_pieces=max_pieces, max_seconds=max_seconds)
