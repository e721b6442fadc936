"""`CurveIndex`: an index on disk, asked for the curves nearest to a wanted one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, whole
from graphsynth.core.errors import FormatError, GeometryError
from graphsynth.design.curves.building import build
from graphsynth.design.curves.fourier import Aligned, aligned, coefficients, magnitudes, unit
from graphsynth.design.curves.matches import CurveMatch, CurveStart, Entry, Fitted
from graphsynth.design.curves.stored import ARC, MANIFEST, Shard, digest, opened, unpacked

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Complex = NDArray[np.complex128]

#: Harmonics of the sizes that are searched, of the final comparison; curves compared at last, over those wanted.
_LEADING, _FINAL, _SPARE = 8, 64, 3
#: Curves whose distance is computed, by default.
CANDIDATES = 1000


#: No number of a row is larger.
_FAR = 1e6


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
        self, curve: ArrayLike, count: int = 10, *, closed: bool | None = None, candidates: int = CANDIDATES
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
        candidates : int
            Curves whose distance is computed: more miss fewer, see the theory.

        Returns
        -------
        list of CurveMatch
            Closed curves are drawn by a full rotation of the driver, open ones by a part or a slide.

        Raises
        ------
        GeometryError
            Fewer than three points, all at one place, numbers that are not finite.
        """
        count, candidates = whole("count", count, 1, 10**5), whole("candidates", candidates, 1, 10**7)
        points, loop = wanted_curve(curve, closed)
        at = self._nearest(points, loop, max(candidates, _SPARE * count))[: _SPARE * count]
        target = _Target.of(points, loop)
        found = [self._matched(int(number), target) for number in at]
        return sorted((match for match in found if match is not None), key=lambda match: match.error)[:count]

    def starts(self, curve: ArrayLike, count: int = 10, *, closed: bool | None = None) -> list[CurveStart]:
        """Return mechanisms with which a search for the curve may begin, nearest first.

        Parameters, errors: as of `find`.
        """
        return [match.start for match in self.find(curve, count, closed=closed)]

    # --- the search

    def _nearest(self, points: Complex, closed: bool, candidates: int) -> NDArray[np.int64]:
        """Rows in the order of the distance of their stored curves, of those with the nearest sizes."""
        wanted = unit(coefficients(points[None], np.array([closed]), ARC)[0])
        rows, tree = self._trees[closed]
        if not len(rows):
            return rows
        most = min(candidates, len(rows))
        near = [
            tree.query(magnitudes(own, _LEADING), k=np.arange(1, most + 1))[1]
            for own in ([wanted, wanted[::-1]] if closed else [wanted])
        ]
        at = rows[np.unique(np.concatenate(near))]
        distance = aligned(wanted.astype(np.complex64), self._arcs(at), closed).error
        return np.asarray(at[np.argsort(distance, kind="stable")])

    @cached_property
    def _trees(self) -> dict[bool, tuple[NDArray[np.int64], cKDTree]]:
        """Rows of closed and open curves, each with a tree of the sizes of their coefficients."""
        from scipy.spatial import cKDTree

        closed = np.concatenate([shard.columns["mechanism"]["closed"] for shard in self.shards])
        sizes = np.concatenate(
            [magnitudes(unpacked(block), _LEADING) for shard in self.shards for block in _blocks(shard)]
        )
        found = {}
        for kind in (False, True):
            rows = np.flatnonzero(closed == kind)
            found[kind] = rows, cKDTree(sizes[rows], balanced_tree=False, compact_nodes=False)
        return found

    def _arcs(self, rows: NDArray[np.int64]) -> NDArray[np.complex64]:
        """Return the stored curves of ascending rows."""
        own = np.searchsorted(self._ends, rows, side="right")
        parts = [
            shard.columns["arc"][rows[own == k] - (self._ends[k] - len(shard))] for k, shard in enumerate(self.shards)
        ]
        return unpacked(np.concatenate(parts))

    def _matched(self, number: int, target: _Target) -> CurveMatch | None:
        """Move a mechanism anew and fit its curve; None if it does not move."""
        entry = self.entry(number)
        traced = entry.traced()
        if len(traced.curve) < 3:
            return None
        curve = np.append(traced.curve[:-1], traced.curve[0]) if target.closed else traced.curve
        own = _Target.of(curve, target.closed)
        fit = aligned(target.curve, own.curve[None], target.closed, fine=True)
        return CurveMatch(
            float(fit.error[0]),
            entry.family.key,
            entry.family.design.graph.links,
            entry.family.dyadic,
            number,
            entry,
            _placed(target, own, fit, traced.inputs, curve),
        )


class _Target(NamedTuple):
    """A curve for comparison: unit coefficients, their norm, the centre over the arc length."""

    curve: Complex
    size: float
    centre: complex
    closed: bool

    @classmethod
    def of(cls, points: Complex, closed: bool) -> _Target:
        found = coefficients(points[None], np.array([closed]), _FINAL)[0]
        sides = np.diff(points)
        middle = 0.5 * (points[1:] + points[:-1])
        centre = complex((np.abs(sides) * middle).sum() / max(np.abs(sides).sum(), 1e-300))
        return cls(unit(found), float(np.linalg.norm(found)), centre, closed)


def _placed(target: _Target, own: _Target, fit: Aligned, inputs: NDArray[np.float64], curve: Complex) -> Fitted:
    """How a curve comes to its place, and the input at which the wanted one begins."""
    factor = complex(fit.factor[0]) * target.size / own.size
    reflected, backwards = bool(fit.reflected[0]), bool(fit.backwards[0])
    centre = own.centre.conjugate() if reflected else own.centre
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(curve)))])
    shift = float(fit.shift[0])
    if target.closed:
        share = (-shift if backwards else shift) % 1.0
        start = float(np.interp(share * along[-1], along, inputs))
    else:
        backwards = shift != 0.0
        start = float(inputs[-1] if backwards else inputs[0])
    return Fitted(factor, target.centre - factor * centre, reflected, start, backwards)


def _blocks(shard: Shard) -> Iterator[NDArray[Any]]:
    """Parts of the stored curves, so that little of a large index is unpacked at once."""
    for start in range(0, len(shard), 1 << 16):
        yield shard.columns["arc"][start : start + (1 << 16)]


def wanted_curve(curve: ArrayLike, closed: bool | None) -> tuple[Complex, bool]:
    """Return points as complex numbers, the first repeated at the end of a closed curve, and whether it is closed.

    `GeometryError` for fewer than three points, all at one place.
    """
    values = finite_array("curve", curve)
    if values.ndim != 2 or values.shape[1] != 2 or len(values) < 3:
        raise GeometryError(f"curve has shape {values.shape}; give three or more points (x, y)")
    points = values[:, 0] + 1j * values[:, 1]
    same = bool(points[0] == points[-1])
    loop = same if closed is None else bool(closed)
    if loop and not same:
        points = np.append(points, points[0])
    if not np.abs(np.diff(points)).sum() > 0.0:
        raise GeometryError("all points of the curve are the same; give a curve")
    return points, loop
