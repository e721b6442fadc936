"""Pavings: all solutions of a system in a box, by branch and prune over many boxes at once.

Breadth first: a batch of boxes from the front of the queue is tested by Krawczyk's operator, contracted, kept or cut.
The search is an iterator; it can be stopped, saved as plain arrays, loaded and resumed, and gives the same boxes
however it is interrupted.  Nothing is lost: at any time the kept and the waiting boxes hold every solution of the
start box.  Source: theory/interval-tests 2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Budget, Count, Positive
from graphsynth.core.errors import FormatError, IntervalError
from graphsynth.intervals.boxes import Paving, PavingProgress, Status, posed
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, _make
from graphsynth.intervals.operations import Array, Mask
from graphsynth.intervals.proving import System, image, read_parameters

_FORMAT = 2
_GAIN = 0.9
_CONTRACTIONS = 4
_POLISH = 8
_INFLATIONS = 4
_ARRAYS = ("waiting_lo", "waiting_hi", "lo", "hi", "domain_lo", "domain_hi", "status", "inner")


class Search:
    """Branch and prune as an iterator over batches.

    Parameters
    ----------
    f : callable
        As for `krawczyk`.
    box : Interval or anything it takes, shape (n,)
        Start box, bounded.
    parameters : Interval or anything it takes, shape (m,), optional
    tolerance : float or sequence of float
        Boxes whose widths are all below this part of those of the start box, or below widths given, are not cut
        further.
    max_boxes, max_seconds : int, float
        Budget of the whole search, resumed parts included.  A batch is never cut short, so that an interrupted search
        gives the same boxes; the budget may be exceeded by one batch.
    inner : sequence of int, optional
        As many parameters as equations by which boxes are proved inner: for every point of the box there are values
        of these parameters that make it a solution.  The search then paves the solution set: boxes are cut down to
        the tolerance even where a wide box is proved to hold exactly one solution for every parameter value.
    batch : int
        Boxes tested at once; part of the definition of the result.

    Raises
    ------
    IntervalError
        For a box that is empty, unbounded or no vector, budgets and tolerances that are not positive.

    Examples
    --------
    >>> search = Search(lambda x: [x[0] ** 2 - 2], ["[-4, 4]"], tolerance=1e-9)
    >>> for state in search:
    ...     pass
    >>> found = search.paving()
    >>> [Status(s).name for s in found.status], found.finished
    (['UNIQUE', 'UNIQUE'], True)
    """

    @checked
    def __init__(
        self,
        f: System,
        box: Any,
        parameters: Any = None,
        *,
        tolerance: Positive | Sequence[float] = 1e-6,
        max_boxes: Budget = 100_000,
        max_seconds: Budget = 60.0,
        inner: Sequence[int] | None = None,
        batch: Count = 2048,
    ) -> None:
        check_rounding()
        start, self.widths = posed(box, tolerance)
        self.f, self.start, self.parameters = f, start, read_parameters(parameters)
        self._posed = {"start_lo": start.lo, "start_hi": start.hi, "widths": self.widths}
        self.max_boxes, self.max_seconds, self.batch = max_boxes, max_seconds, batch
        self.inner_by = None if inner is None else list(inner)
        given = 0 if self.parameters is None else self.parameters.size
        if self.inner_by is not None and not (
            len(self.inner_by) == start.size and all(-given <= j < given for j in self.inner_by)
        ):
            raise IntervalError(f"inner = {inner!r} must name as many parameters as there are equations, {start.size}")
        n = start.size
        none = np.zeros((0, n))
        self._state: dict[str, NDArray[Any]] = dict.fromkeys(_ARRAYS[2:6], none)
        self._state |= {"waiting_lo": start.lo[None].copy(), "waiting_hi": start.hi[None].copy()}
        self._state |= {"status": np.zeros(0, dtype=np.int8), "inner": np.zeros(0, dtype=np.bool_)}
        self.tested, self.seconds = 0, 0.0

    @property
    def finished(self) -> bool:
        """Whether no box waits."""
        return len(self._state["waiting_lo"]) == 0

    @property
    def exhausted(self) -> bool:
        """Whether a budget is used up."""
        return self.tested >= self.max_boxes or self.seconds >= self.max_seconds

    def __iter__(self) -> Iterator[PavingProgress]:
        check_rounding()
        while not self.finished and not self.exhausted:
            begin = perf_counter()
            self._advance()
            self.seconds += perf_counter() - begin
            yield PavingProgress(self.tested, len(self._state["waiting_lo"]), len(self._state["lo"]), self.seconds)

    def paving(self) -> Paving:
        """Return what is known now; waiting boxes are UNDECIDED."""
        s = self._state
        count = len(s["waiting_lo"])
        keys = ("lo", "hi", "domain_lo", "domain_hi")
        lo, hi, dlo, dhi = (np.concatenate([s[key], s[f"waiting_{key[-2:]}"]]) for key in keys)
        status = np.concatenate([s["status"], np.full(count, Status.UNDECIDED, dtype=np.int8)])
        inner = np.concatenate([s["inner"], np.zeros(count, dtype=np.bool_)])
        return Paving(_make(lo, hi), status, _make(dlo, dhi), inner, count == 0, self.tested, self.seconds)

    @checked
    def save(self, path: str | Path) -> None:
        """Write the state to an ``.npz`` file of plain arrays."""
        meta, own = np.array([_FORMAT, self.tested, self.batch], dtype=np.int64), np.array([self.seconds])
        with Path(path).open("wb") as file:
            np.savez(file, meta=meta, seconds=own, **self._posed, **self._state)  # type: ignore[arg-type]

    @checked
    def load(self, path: str | Path) -> Search:
        """Go on from a saved state of the same search; returns the search itself.

        `FormatError` for a file that is not a saved state, or that belongs to another box, tolerance or batch.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                data = {key: file[key] for key in file.files}
            meta, seconds = data["meta"], float(data["seconds"][0])
            state = {key: data[key] for key in _ARRAYS}
            same = int(meta[0]) == _FORMAT and int(meta[2]) == self.batch
            same = same and all(np.array_equal(data[key], value) for key, value in self._posed.items())
            rows = {len(state[key]) for key in _ARRAYS[2:]}
            sound = len(rows) == 1 and all(state[key].shape[1:] == self.start.shape for key in _ARRAYS[:6])
            sound = sound and not any(np.isnan(state[key]).any() for key in _ARRAYS[:6])
        except Exception as error:
            raise FormatError(
                f"not a saved search ({type(error).__name__}); give a file written by save", str(path)
            ) from error
        if not same or not sound:
            raise FormatError("saved by a search of another box, tolerance or batch; start it anew", str(path))
        self._state, self.tested, self.seconds = state, int(meta[1]), seconds
        return self

    def _advance(self) -> None:
        s = self._state
        count = self.batch
        X = _make(s["waiting_lo"][:count], s["waiting_hi"][:count])
        s["waiting_lo"], s["waiting_hi"] = s["waiting_lo"][count:], s["waiting_hi"][count:]
        X, domain, status, last = self._contract(X)
        alive = status != Status.EMPTY
        X, domain, status, last = X[alive], domain[alive], status[alive], last[alive]
        if self.inner_by is None:
            status[self._sharpened(X, status)] = Status.EMPTY  # its solutions are kept one by one
            proved = (status == Status.UNIQUE) | (status == Status.EXISTS)
            self._keep(X[proved], domain[proved], status[proved])
            left = status == Status.UNDECIDED
            X, last = X[left], last[left]
            X = X[~self._prove_beyond(X, last)]
        elif len(X):  # a set is wanted, not the hull of a proof: go on cutting
            inside = self._inner(X)
            self._keep(X[inside], X[inside], Status.UNDECIDED, inner=True)
            X = X[~inside]
        # keep boxes at the limit of the resolution as undecided, cut the others
        sides = X.width / self.widths
        widest = sides.argmax(axis=1) if len(X) else np.zeros(0, dtype=np.int64)
        row = np.arange(len(X))
        middle = X.mid[row, widest]
        small = sides.max(axis=1, initial=0.0) <= 1.0
        small |= (middle <= X.lo[row, widest]) | (middle >= X.hi[row, widest])
        self._keep(X[small], X[small], Status.UNDECIDED)
        halves = _halves(X[~small], widest[~small], middle[~small])
        for key, rows in zip(_ARRAYS[:2], halves):  # neighbours, at the back of the queue
            s[key] = np.concatenate([s[key], rows])
        if self.inner_by is None:
            self._absorb()

    def _contract(self, X: Interval) -> tuple[Interval, Interval, NDArray[np.int8], Array]:
        """Repeat the test on each box while it gains; the domain is the box of the first proof."""
        lo, hi = X.lo.copy(), X.hi.copy()
        dlo, dhi = lo.copy(), hi.copy()
        status = np.full(len(lo), Status.UNDECIDED, dtype=np.int8)
        norm = np.full(len(lo), np.inf)
        active = np.arange(len(lo))
        for turn in range(_CONTRACTIONS + _POLISH):
            if active.size == 0:
                break
            boxes = _make(lo[active], hi[active])
            step = image(self.f, boxes, self.parameters)
            self.tested += active.size
            norm[active] = step.factor.sum(axis=2).max(axis=1)
            better = (status[active] == Status.UNDECIDED) & (step.status != Status.UNDECIDED)
            better |= (status[active] == Status.EXISTS) & (step.status == Status.UNIQUE)
            first = active[better]
            dlo[first], dhi[first] = lo[first], hi[first]
            status[first] = step.status[better]
            empty = step.status == Status.EMPTY
            status[active[empty]] = Status.EMPTY
            gain = (step.box.width < _GAIN * boxes.width).any(axis=1) & ~empty
            lo[active], hi[active] = step.box.lo, step.box.hi
            if turn >= _CONTRACTIONS:
                gain &= status[active] != Status.UNDECIDED
            active = active[gain]
        return _make(lo, hi), _make(dlo, dhi), status, norm

    def _sharpened(self, X: Interval, status: NDArray[np.int8]) -> NDArray[np.intp]:
        """Try to settle the halves of boxes that are only known to hold a solution; returns those of which both are."""
        some = np.flatnonzero(status == Status.EXISTS)
        if some.size == 0:
            return some
        boxes = X[some]
        widest = (boxes.width / self.widths).argmax(axis=1)
        lo, hi = _halves(boxes, widest, boxes.mid[np.arange(some.size), widest])
        halves, domain, found, norm = self._contract(_make(lo, hi))
        unique = found == Status.UNIQUE
        self._keep(halves[unique], domain[unique], found[unique])
        settled = unique | (found == Status.EMPTY)
        left = np.flatnonzero(~settled)
        settled[left] = self._prove_beyond(halves[left], norm[left])
        return np.asarray(some[settled.reshape(-1, 2).all(axis=1)])

    def _prove_beyond(self, X: Interval, norm: Array) -> Mask:
        """Epsilon-inflation: prove solutions near faces in enlarged boxes; returns the boxes that are settled."""
        settled = np.zeros(len(norm), dtype=np.bool_)
        near = np.flatnonzero(norm < 0.5)
        trial = X[near]
        for _ in range(_INFLATIONS):
            if near.size == 0:
                break
            trial = trial.inflate(0.25, 1e-300)
            grow = _make(-0.05, 0.05) * trial.width.max(axis=1, keepdims=True)
            grow = grow + _make(-4e-16, 4e-16) * trial.mag  # some steps of the numbers themselves
            trial = trial + grow
            step = image(self.f, trial, self.parameters)
            self.tested += near.size
            good = step.status == Status.UNIQUE
            # a unique solution that certainly lies outside the start box leaves none in the box itself
            outside = good & step.image.disjoint(self.start).any(axis=1)
            keep = good & step.image.subset(self.start).all(axis=1)
            settled[near[(step.status == Status.EMPTY) | outside | keep]] = True
            if keep.any():
                box = step.box[keep]
                for _ in range(_POLISH):
                    box = image(self.f, box.inflate(0.01, 1e-300), self.parameters).box.intersect(box)
                    self.tested += len(box)
                self._keep(box, trial[keep], step.status[keep])
            again = ~good & (step.status != Status.EMPTY) & (step.image.width < 4.0 * trial.width).all(axis=1)
            near, trial = near[again], trial[again].hull(step.image[again])
        return settled

    def _inner(self, X: Interval) -> Mask:
        """Whether for every point of a box there are values of the chosen parameters that make it a solution."""
        assert self.parameters is not None
        assert self.inner_by is not None
        chosen, n, parameters = self.inner_by, self.start.size, self.parameters
        m = parameters.shape[-1]
        middle = parameters.mid

        def flipped(q: Sequence[Any], x: Sequence[Any]) -> Sequence[Any]:
            values: list[Any] = [_make(middle[j], middle[j]) for j in range(m)]
            for index, value in zip(chosen, q):
                values[index] = value
            return self.f(x[:n], values)

        wanted = parameters[np.array(chosen)]
        shape = (len(X.lo), len(chosen))
        boxes = _make(np.broadcast_to(wanted.lo, shape), np.broadcast_to(wanted.hi, shape))
        status = image(flipped, boxes, X).status
        return np.asarray((status == Status.UNIQUE) | (status == Status.EXISTS))

    def _keep(self, box: Interval, domain: Interval, status: Any, *, inner: bool = False) -> None:
        """Keep boxes, with the status of each or of all."""
        own = (box.lo, box.hi, domain.lo, domain.hi, np.full(len(box), status, np.int8), np.full(len(box), inner))
        for key, rows in zip(_ARRAYS[2:], own):
            self._state[key] = np.concatenate([self._state[key], rows])

    def _absorb(self) -> None:
        """Drop what a proved box already stands for: a box inside its domain, or the same solution found twice."""
        s = self._state
        dropped = np.zeros(len(s["lo"]), dtype=np.bool_)
        gone = np.zeros(len(s["waiting_lo"]), dtype=np.bool_)
        for k in np.flatnonzero(s["status"] == Status.UNIQUE):
            if dropped[k]:
                continue
            dlo, dhi = s["domain_lo"][k], s["domain_hi"][k]
            inside = (s["lo"] >= dlo).all(axis=1) & (s["hi"] <= dhi).all(axis=1)
            inside[k] = False
            dropped |= inside
            gone |= (s["waiting_lo"] >= dlo).all(axis=1) & (s["waiting_hi"] <= dhi).all(axis=1)
        if gone.any():
            s["waiting_lo"], s["waiting_hi"] = s["waiting_lo"][~gone], s["waiting_hi"][~gone]
        if dropped.any():
            for key in _ARRAYS[2:]:
                s[key] = s[key][~dropped]


def _halves(X: Interval, side: NDArray[np.intp], middle: Array) -> tuple[Array, Array]:
    """Bounds of the halves of boxes; halves are neighbours."""
    row = np.arange(len(side))
    lo, hi = np.repeat(X.lo, 2, axis=0), np.repeat(X.hi, 2, axis=0)
    hi[2 * row, side] = middle
    lo[2 * row + 1, side] = middle
    return lo, hi


def pave(f: System, box: Any, parameters: Any = None, **options: Any) -> Paving:
    """Find all solutions of ``f = 0`` in a box: run a `Search` to its end or its budget.

    Parameters
    ----------
    f, box, parameters : as for `krawczyk`
    **options
        As for `Search`: tolerance, max_boxes, max_seconds, inner, batch.

    Returns
    -------
    Paving
        Certified; ``finished`` is False if a budget ended the search.

    Raises
    ------
    IntervalError
        For whatever `Search` refuses.

    Examples
    --------
    >>> found = pave(lambda x: [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2], ["[-2, 2]", "[-2, 2]"])
    >>> len(found.status), found.verdict.name
    (2, 'EXISTS')
    """
    search = Search(f, box, parameters, **options)
    for _ in search:
        pass
    return search.paving()
