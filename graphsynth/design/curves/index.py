"""`CurveIndex`: an index on disk, asked for the curves nearest to a wanted one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import whole
from graphsynth.core.errors import FormatError
from graphsynth.design.curves.building import build
from graphsynth.design.curves.fourier import magnitudes
from graphsynth.design.curves.matches import CurveMatch, CurveStart, Entry
from graphsynth.design.curves.stored import MANIFEST, digest, opened, unpacked
from graphsynth.design.curves.wanted import LEADING, TimedCurve, Wanted, WantedCurve, WantedMotion

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

    from graphsynth.kinematics.dimensional.design import Design

#: Mechanisms moved anew beyond those wanted; fewest positions of one; rows unpacked at once; no number is larger.
_SPARE, _FEWEST, _BLOCK, _FAR = 5, 8, 1 << 16, 1e6
#: Closed curves whose distance is computed, by default; open ones over that.
CANDIDATES, _OPEN = 1000, 8


class CurveIndex:
    """Curves that mechanisms draw, found by their shape, whatever its place, size, direction and beginning.

    Parameters
    ----------
    folder : path
        Of an index made by `CurveIndex.build`; all its shards are used.

    Raises
    ------
    FormatError
        A folder without an index, shards that are missing or of different indices, files that are damaged.

    Examples
    --------
    >>> import tempfile
    >>> from graphsynth.design import CurveIndex
    >>> folder = tempfile.TemporaryDirectory()
    >>> index = CurveIndex.build(folder.name, 1000, links=[4], sliders=0)
    >>> len(index)
    1000
    >>> circle = [(3.0, 1.0), (2.0, 2.0), (1.0, 1.0), (2.0, 0.0), (3.0, 1.0)]
    >>> [match.links for match in index.find(circle, 2)]
    [4, 4]
    >>> folder.cleanup()
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        places = sorted(path.parent for path in self.folder.glob(f"shard-*/{MANIFEST}"))
        if not places:
            raise FormatError("holds no finished index of curves; build one with graphsynth curves build", str(folder))
        self.shards = tuple(opened(place) for place in places)
        first = self.shards[0].manifest
        for shard in self.shards:
            if shard.manifest["asked"] != first["asked"] or shard.manifest["shard"][1] != first["shard"][1]:
                raise FormatError(f"belongs to another index than {self.shards[0].folder}", str(shard.folder))
        if len(self.shards) != first["shard"][1]:
            raise FormatError(
                f"holds {len(self.shards)} of {first['shard'][1]} shards; build the others", str(self.folder)
            )
        self.families = self.shards[0].families
        self._ends = np.cumsum([len(shard) for shard in self.shards])
        self._trees: dict[tuple[str, bool], tuple[NDArray[np.int64], cKDTree]] = {}

    @classmethod
    def build(
        cls,
        folder: str | Path,
        curves: int = 1_000_000,
        *,
        links: Sequence[int] = (4, 6, 8),
        sliders: int = 2,
        seed: int = 0,
        executor: Executor | None = None,
        watch: Callable[[int, int], None] | None = None,
    ) -> CurveIndex:
        """Build an index in one shard, or go on with it; see :func:`graphsynth.design.curves.building.build`."""
        build(folder, curves, links=links, sliders=sliders, seed=seed, executor=executor, watch=watch)
        return cls(folder)

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __repr__(self) -> str:
        asked = self.shards[0].manifest["asked"]
        links = ", ".join(map(str, asked["links"]))
        return f"CurveIndex({len(self)} curves of {len(self.families)} families, links {links}, seed {asked['seed']})"

    def verify(self) -> None:
        """Compare every file with its checksum; `FormatError` for the first that differs."""
        for shard in self.shards:
            for name, about in shard.manifest["columns"].items():
                if digest(shard.folder / f"{name}.npy") != about["sha256"]:
                    raise FormatError(
                        "differs from its checksum; copy it again or build anew", str(shard.folder / f"{name}.npy")
                    )

    def entry(self, number: int) -> Entry:
        """Return a row: a mechanism with its tracing point, as it was drawn.

        `GeometryError` for a row that does not exist, `FormatError` for one that is damaged.
        """
        number = whole("number", number, 0, len(self) - 1)
        at = int(np.searchsorted(self._ends, number, side="right"))
        row = self.shards[at].columns["mechanism"][number - (self._ends[at] - len(self.shards[at]))]
        own = self.families[int(row["family"])] if row["family"] < len(self.families) else None
        numbers = np.concatenate([row[name].ravel() for name in ("inputs", "point", "places", "numbers")])
        if own is None or row["link"] not in own.tracing or not np.abs(numbers).max() < _FAR:
            raise FormatError(f"row {number} is no mechanism; copy the index again or build anew", str(self.folder))
        return Entry(own, row)

    def find(
        self,
        curve: ArrayLike,
        count: int = 10,
        *,
        closed: bool | None = None,
        timed: bool = False,
        only: Callable[[Design], bool] | None = None,
        within: float = math.inf,
        candidates: int = CANDIDATES,
    ) -> list[CurveMatch]:
        """Find the curves nearest to a wanted one, best first.

        Parameters
        ----------
        curve : array_like, shape (n, 2)
            Points of the wanted curve in order, taken as a polygon: give enough of them.
        count : int
            Curves to return.
        closed : bool, optional
            Whether the last point is joined to the first; by default if they are the same.
        timed : bool
            The points belong to uniform inputs: of a full rotation if closed, else of the range.
        only : callable, optional
            Says of a `Design` (graph, drivers, kinds of joints) whether its mechanisms may be found.
        within : float
            Largest range of the driver over which an open curve is drawn: radians, or a slide.
        candidates : int
            Closed curves whose distance is computed: more miss fewer, see the theory; open ones eight times as many.

        Returns
        -------
        list of CurveMatch
            Closed curves are drawn by a full rotation of the driver, open ones by a part or a slide.

        Raises
        ------
        GeometryError
            Fewer than three points (five with inputs), all at one place, numbers that are not finite.
        """
        wanted = TimedCurve(curve, closed) if timed else WantedCurve(curve, closed)
        return self._found(wanted, count, only, within, candidates)

    def find_motion(
        self,
        poses: ArrayLike,
        count: int = 10,
        *,
        closed: bool | None = None,
        only: Callable[[Design], bool] | None = None,
        candidates: int = CANDIDATES,
    ) -> list[CurveMatch]:
        """Find the links that move most like a wanted body, best first.

        Parameters
        ----------
        poses : array_like, shape (n, 3)
            Place and angle (x, y, theta) of the body at uniform inputs, of a full rotation or a range.
        count, closed, only, candidates
            As of `find`.

        Returns
        -------
        list of CurveMatch
            The point "P" is the one of the link that follows the places best.  ``error`` is the root of the sum of two
            mean squares: of the distance over the size of the path, and of the angle in radians.

        Raises
        ------
        GeometryError
            Fewer than five poses, all at one place, numbers that are not finite.
        """
        return self._found(WantedMotion(poses, closed), count, only, math.inf, candidates)

    def starts(
        self,
        curve: ArrayLike,
        count: int = 10,
        *,
        closed: bool | None = None,
        only: Callable[[Design], bool] | None = None,
    ) -> list[CurveStart]:
        """Return mechanisms with which a search for the curve may begin, nearest first.

        Parameters, errors: as of `find`.
        """
        return [match.start for match in self.find(curve, count, closed=closed, only=only)]

    # --- the search

    def _found(
        self, wanted: Wanted, count: int, only: Callable[[Design], bool] | None, within: float, candidates: int
    ) -> list[CurveMatch]:
        count, candidates = whole("count", count, 1, 10**5), whole("candidates", candidates, 1, 10**7)
        most = max(candidates * (1 if wanted.closed else _OPEN), count + _SPARE)
        near = self._nearest(wanted, most, only, within)[: count + _SPARE]
        found = [self._matched(int(number), wanted) for number in near]
        return sorted((match for match in found if match is not None), key=lambda match: match.error)[:count]

    def _nearest(
        self, wanted: Wanted, most: int, only: Callable[[Design], bool] | None, within: float
    ) -> NDArray[np.int64]:
        """Rows in the order of the distance of what is stored, of those with the nearest sizes."""
        rows, tree = self._tree(wanted.column, wanted.closed)
        if only is None and within == math.inf and len(rows):
            near = [tree.query(own, k=np.arange(1, min(most, len(rows)) + 1))[1] for own in wanted.sizes()]
        else:
            allowed = np.array([only is None or bool(only(family.design)) for family in self.families])
            own = np.flatnonzero(allowed[self._family[rows]] & (self._range[rows] <= within))
            near = []
            for sizes in wanted.sizes():
                far = ((tree.data[own] - sizes) ** 2).sum(axis=1)
                near.append(own[np.argpartition(far, most)[:most] if most < len(own) else slice(None)])
        at = rows[np.unique(np.concatenate(near))]
        distance = wanted.distances({name: self._stored(name, at) for name in wanted.columns})
        return np.asarray(at[np.argsort(distance, kind="stable")])

    @cached_property
    def _family(self) -> NDArray[np.uint16]:
        return np.concatenate([shard.columns["mechanism"]["family"] for shard in self.shards])

    @cached_property
    def _range(self) -> NDArray[np.float32]:
        return np.concatenate([np.ptp(shard.columns["mechanism"]["inputs"], axis=1) for shard in self.shards])

    def _tree(self, column: str, closed: bool) -> tuple[NDArray[np.int64], cKDTree]:
        """Rows of closed or open curves, and a tree of the sizes of their coefficients in a column."""
        if (column, closed) not in self._trees:
            from scipy.spatial import cKDTree

            kinds = np.concatenate([shard.columns["mechanism"]["closed"] for shard in self.shards])
            rows = np.flatnonzero(kinds == closed)
            sizes = [
                magnitudes(self._stored(column, rows[start : start + _BLOCK]), LEADING)
                for start in range(0, len(rows), _BLOCK)
            ]
            every = np.concatenate([np.zeros((0, 2 * LEADING + (column == "turn"))), *sizes])
            self._trees[column, closed] = rows, cKDTree(every, balanced_tree=False, compact_nodes=False)
        return self._trees[column, closed]

    def _stored(self, column: str, rows: NDArray[np.int64]) -> NDArray[np.complex64]:
        """Return the coefficients in ascending rows of a column."""
        own = np.searchsorted(self._ends, rows, side="right")
        parts = [
            shard.columns[column][rows[own == k] - (self._ends[k] - len(shard))] for k, shard in enumerate(self.shards)
        ]
        return unpacked(np.concatenate(parts))

    def _matched(self, number: int, wanted: Wanted) -> CurveMatch | None:
        """Move a mechanism anew and fit it; None if it does not move, or not to where the wanted curve begins."""
        entry = self.entry(number)
        traced = entry.traced()
        if len(traced.curve) < _FEWEST:
            return None
        error, fitted = wanted.fitted(traced)
        family = entry.family
        match = CurveMatch(error, family.key, family.design.graph.links, family.dyadic, number, entry, fitted)
        return match if np.isfinite(match.start.places).all() else None  # near a dead centre steps decide
