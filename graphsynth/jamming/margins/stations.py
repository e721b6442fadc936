"""Stations: pieces of the input with proved joint positions and their rates, over the whole box of lengths.

Positions at the middle of a piece, and derivatives over all of it and all lengths, are kept; those of any smaller box
of lengths follow by the mean value theorem.  Pieces are cut on demand (theory/probability-of-coupled-joints 3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval
from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.assembly.positions import Unsupported, points
from graphsynth.jamming.assembly.tubes import Tubes, joined, prove_tubes, settled, slopes
from graphsynth.jamming.joints.branch import of_the_motion
from graphsynth.jamming.joints.pieces import PARTS, Found, Work, cut

if TYPE_CHECKING:
    from graphsynth.jamming.joints.program import JointProblem
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.tolerances.box import ParameterBox

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
#: So many times the first pieces are cut until all positions are proved, and those of a search.
_FIRST_CUTS, _DEEPEST = 6, 12
#: Pieces of a full rotation at first.
_FEW = 32


class Placed(NamedTuple):
    """Places of the joints at the middles of pieces (N, ...); derivatives over them, (N, 1 + lengths, ...)."""

    at: Places
    by: Places

    def take(self, rows: Rows) -> Placed:
        """Return some of the pieces."""
        return Placed(*(Places(*(part[rows] for part in own)) for own in self))


class Stations:
    """Pieces of the input of a motion, numbered; each keeps its cut once it is made."""

    def __init__(self, given: JointProblem, motion: Motion, box: ParameterBox) -> None:
        try:
            self.work = Work(given, motion, box, exact=False)
        except Unsupported as error:
            raise GeometryError(f"no probability for this mechanism: {error}") from error
        self.joints, self.system = given.layout.joints, self.work.system
        self.lo, self.hi = np.zeros(0), np.zeros(0)
        self.depth = np.zeros(0, dtype=np.intp)
        self.children: dict[int, Rows] = {}
        self.middle = points(self.work.whole(1).mid[0])
        self._prove_first()

    @property
    def half(self) -> Array:
        """Half widths of the pieces."""
        middle = Interval.from_bounds(self.lo, self.hi).mid
        return np.asarray(np.nextafter(np.maximum(self.hi - middle, middle - self.lo), np.inf))

    def _prove_first(self) -> None:
        """Cut the range until the positions of every piece are proved for all lengths, on the branch of the motion."""
        work = self.work
        if not work.motion.completed:
            raise GeometryError(f"the motion ends: {work.motion.reason}; choose a range that is reached")
        every = len(work.first()[0])
        edges = np.linspace(work.low, work.high, max(8, every * _FEW // 128) + 1)
        lo, hi, kept = edges[:-1], edges[1:], []
        for _ in range(_FIRST_CUTS):
            fine, poses, velocities = work._follow(0.5 * (lo + hi))
            x = self.system.coordinates(np.where(fine[:, None, None], poses, 0.0), velocities)[0]
            tubes, counted = self._tubes(lo, hi, np.nan_to_num(x), self.system.count(np.nan_to_num(poses)))
            good = tubes.proved & fine
            rows = np.flatnonzero(good)
            kept.append((lo[rows], hi[rows], tubes.take(rows), counted[rows]))
            lo, hi = cut(lo[~good], hi[~good])
            if lo.size == 0:
                break
        if lo.size:
            raise GeometryError(
                f"not every member of the tolerances is proved to be assembled near the input {lo[0]:.6g}, so that "
                "binding there has no meaning; narrow the lengths or the range of the input"
            )
        low, high, counted = (np.concatenate([part[k] for part in kept]) for k in (0, 1, 3))
        tubes = Tubes(*(joined(list(own)) for own in zip(*(part[2] for part in kept))))
        order = np.argsort(low, kind="stable")
        self._add(low[order], high[order], tubes.take(order), counted[order], 0)
        found = Found.open(self.lo, self.hi, work.whole(len(self.lo)), self.system.size)
        found = found._replace(proved=tubes.proved[order], box_lo=self.tubes.domain.lo, box_hi=self.tubes.domain.hi)
        if not of_the_motion(work, found).whole:
            raise GeometryError("the pieces of the input are not proved to be one branch; narrow the lengths")

    def _tubes(self, lo: Array, hi: Array, x: Array, counted: Array) -> tuple[Tubes, Array]:
        u, p = Interval.from_bounds(lo, hi), self.work.whole(len(lo))
        return prove_tubes(self.system, self.joints, u, x, counted, p), counted

    def _add(self, lo: Array, hi: Array, tubes: Tubes, counted: Array, depth: int) -> Rows:
        """Give numbers to proved pieces, with positions at their middles and derivatives."""
        u, p = Interval.from_bounds(lo, hi), self.work.whole(len(lo))
        here, middle = points(u.mid), points(p.mid)
        x = tubes.tight.mid if self.system.size else tubes.tight.lo
        at = prove_tubes(self.system, self.joints, here, x, counted, middle)
        by, fine = slopes(self.system, self.joints, u, tubes, counted, p)
        if not (at.proved & fine).all():
            k = int(np.flatnonzero(~(at.proved & fine))[0])
            raise GeometryError(f"the rates of the joints are not enclosed near the input {lo[k]:.6g} (a singularity)")
        by = self._at_middle(by, here, tubes, x, counted)
        rates = Places(*(Interval.from_bounds(np.moveaxis(b.lo, 0, 1), np.moveaxis(b.hi, 0, 1)) for b in by))
        placed = Placed(at.places, rates)
        start = len(self.lo)
        if start == 0:
            self.placed, self.tubes, self.counted = placed, tubes, counted
        else:
            both = (map(list, zip(*own)) for own in zip(self.placed, placed))
            self.placed = Placed(*(Places(*map(joined, own)) for own in both))
            self.tubes = Tubes(*(joined([a, b]) for a, b in zip(self.tubes, tubes)))
            self.counted = np.concatenate([self.counted, counted])
        self.lo, self.hi = np.concatenate([self.lo, lo]), np.concatenate([self.hi, hi])
        self.depth = np.concatenate([self.depth, np.full(len(lo), depth, dtype=np.intp)])
        return np.arange(start, start + len(lo))

    def _at_middle(self, by: Places, u: Interval, tubes: Tubes, x: Array, counted: Array) -> Places:
        """Return the derivatives with those by the lengths at the middle of the input alone, where that is proved.

        Enough for the mean value theorem, which moves the lengths first and the input last.
        """
        if not self.work.box.size:
            return by
        p = self.work.whole(len(x))
        at = prove_tubes(self.system, self.joints, u, x, counted, p)
        inside = ((at.tight.lo >= tubes.domain.lo) & (at.tight.hi <= tubes.domain.hi)).all(axis=1)
        own, fine = slopes(self.system, self.joints, u, at, counted, p)
        use = at.proved & inside & fine
        found = []
        for whole, here in zip(by, own):
            pick = use.reshape(1, -1, *(1,) * (whole.ndim - 2))
            ends = [
                np.concatenate([a[:1], np.where(pick, b[1:], a[1:])])
                for a, b in ((whole.lo, here.lo), (whole.hi, here.hi))
            ]
            found.append(Interval.from_bounds(*ends))
        return Places(*found)

    def cut(self, rows: Rows) -> None:
        """Cut pieces in equal parts, so that ``children`` has them; not below a smallest width."""
        fresh = np.array([k for k in rows.tolist() if k not in self.children], dtype=np.intp)
        for depth in np.unique(self.depth[fresh]).tolist():
            own = fresh[self.depth[fresh] == depth]
            if depth >= _DEEPEST:
                continue
            lo, hi = cut(self.lo[own], self.hi[own])
            parent = np.repeat(own, PARTS)
            counted, x = self.counted[parent], self.tubes.tight.mid[parent]
            u, whole = Interval.from_bounds(lo, hi), self.work.whole(len(lo))
            x = settled(self.system, x, points(u.mid), points(whole.mid), counted) if self.system.size else x
            tubes, counted = self._tubes(lo, hi, x, counted)
            domain = self.tubes.domain[parent]  # exactly one assembly there, so that of the part is that of the whole
            same = ((tubes.tight.lo >= domain.lo) & (tubes.tight.hi <= domain.hi)).all(axis=1) & tubes.proved
            good = same.reshape(-1, PARTS).all(axis=1)
            rows_good = np.flatnonzero(np.repeat(good, PARTS))
            if rows_good.size:
                numbers = self._add(
                    lo[rows_good], hi[rows_good], tubes.take(rows_good), counted[rows_good], depth + 1
                ).reshape(-1, PARTS)
                for k, parts in zip(own[good].tolist(), numbers):
                    self.children[k] = parts
