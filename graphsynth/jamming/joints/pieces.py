"""Pieces of the input along a motion: their positions proved, the factor bounded over each.

The factor on limits and plays is a seminorm of the misalignments together (a maximum of linear functions of them).  Its
largest value over a set is that over the corners of any polygon around the set, and of one misalignment alone only the
largest ``|alpha|`` counts.  An arc of radius A lies in the polygon with corners at the radius ``A / cos(delta / 2)``,
delta apart.  So "up to alpha, in any direction" needs a dozen corners instead of one wide box.
See theory/joints-that-share-a-tilt 3 and theory/jam-arcs 6.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, check_rounding
from graphsynth.jamming.joints.closure import Layout
from graphsynth.jamming.joints.enclosure import Moving, Pieces, lower_bounds, shifts_enclosed, start_tilts, upper_bounds
from graphsynth.jamming.joints.exact import neglected
from graphsynth.jamming.joints.limits import Misalignment, bounds
from graphsynth.jamming.joints.positions import Positions, Tubes, linked, points, prove_tubes, slopes
from graphsynth.jamming.joints.program import JointProblem, PoseSolution, check_motion

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion


#: Widest angle between two corners (the polygon is 0.9 % larger than the circle), most corners, largest radius.
_APART, _MOST, _LARGEST = 0.2618, 64, 0.49


def corner_layouts(layout: Layout) -> tuple[Layout, ...]:
    """Return layouts whose sharp misalignments are the corners; the layout itself where there would be too many.

    For any positions and limits, the largest factor over the boxes of alpha and direction is at most the largest one of
    the layouts returned (certified: the polygons are rounded outward).
    """
    tilts = [tilt for _, _, tilt in layout.misalignments]
    if all(tilt == tilt.sharp() for tilt in tilts):
        return (layout,)
    if max((abs(bound) for tilt in tilts for bound in bounds(tilt, "alpha")), default=0.0) > _LARGEST:
        return (layout,)
    choices = [_around(tilt, alone=len(tilts) == 1) for tilt in tilts]
    if math.prod(len(corners) for corners in choices) > _MOST:
        return (layout,)
    places = [(place, sign) for place, sign, _ in layout.misalignments]
    return tuple(
        replace(layout, misalignments=tuple((*place, tilt) for place, tilt in zip(places, chosen)))
        for chosen in product(*choices)
    )


def _around(tilt: Misalignment, *, alone: bool) -> list[Misalignment]:
    """Corners of a polygon around all ``alpha (cos, sin)(direction)`` of a box; for one alone, up to a factor <= 1."""
    (least, most), (first, last) = bounds(tilt, "alpha"), bounds(tilt, "direction")
    largest = max(abs(least), abs(most))
    if last - first >= math.pi:
        # opposite corners count alike for one alone; for several the whole circle is needed
        turn = math.pi if alone else math.tau
        count = math.ceil(turn / _APART)
        angles = [turn * k / count for k in range(count)]
        return _corners(tilt, largest, angles, turn / count)
    if first == last:
        return [tilt.sharp(end, first) for end in sorted({largest} if alone else {least, most})]
    steps = max(1, math.ceil((last - first) / _APART))
    angles = [first, *(first + (last - first) * k / steps for k in range(1, steps)), last]
    apart = max(b - a for a, b in pairwise(angles))
    if alone:
        return _corners(tilt, largest, angles, apart)
    outer, inner = (most, least) if abs(most) >= abs(least) else (least, most)
    found = _corners(tilt, outer, angles, apart)
    if least < 0.0 < most:  # the opposite sector too; between the two lies all the rest
        return found + _corners(tilt, inner, angles, apart)
    return found + [tilt.sharp(inner, angle) for angle in (first, last)]


def _corners(tilt: Misalignment, radius: float, angles: list[float], apart: float) -> list[Misalignment]:
    # both factors are rounding allowances: angles are off by some ulps, the cosine by one
    grow = (1.0 + 1e-13) / math.cos(0.5 * apart * (1.0 + 1e-12) + 1e-14)
    return [tilt.sharp(radius * grow, angle) for angle in angles]


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Pieces of a full rotation at first, of any range at least, and parts into which one is cut.
FIRST, FEWEST, PARTS = 128, 16, 4
#: In a proof of freedom a joint may tilt so much more than the tilt found, in its own share and that of the largest.
_ROOM, _SHARE, _LEAST = 1.25, 0.25, 1e-4
#: Layout, pieces and solution that a bound starts from.
_Bound: TypeAlias = tuple[Layout, Pieces, PoseSolution]


class Found(NamedTuple):
    """Pieces evaluated: inputs, bounds of the factor, whether positions are proved, and the boxes they lie in.

    ``sure`` tells what exact tilts prove: +1 free, -1 binds, 0 nothing; the bounds of the factor are of first order.
    """

    lo: Array
    hi: Array
    lower: Array
    upper: Array
    proved: Mask
    box_lo: Array
    box_hi: Array
    sure: NDArray[np.int8]

    def take(self, rows: Mask | NDArray[np.intp]) -> Found:
        """Return some of the pieces."""
        return Found._make(part[rows] for part in self)

    @property
    def straddles(self) -> Mask:
        """Whether small tilts decide nothing."""
        return np.asarray(~((self.lower > 1.0) | (self.upper < 1.0)))

    @property
    def unsure(self) -> Mask:
        """Whether small tilts decide, and exact ones do not."""
        return np.asarray(~self.straddles & (self.sure == 0))

    @staticmethod
    def join(parts: list[Found]) -> Found:
        """Return all pieces in the order of the input."""
        whole = Found._make(np.concatenate(columns) for columns in zip(*parts))
        return whole.take(np.lexsort((whole.hi, whole.lo)))


class Work:
    """Evaluation of pieces of one problem along one motion; without ``exact`` by small tilts alone."""

    def __init__(self, given: JointProblem, motion: Motion, tolerance: float, exact: bool = True) -> None:
        self.given, self.motion, self.tolerance, self.exact = given, motion, tolerance, exact
        self.system = Positions(motion.mechanism, tolerance)
        self.corners = corner_layouts(given.layout)
        keep = np.flatnonzero(motion.assembled)
        ends = motion.inputs[keep]
        self.low, self.high = float(ends.min()), float(ends.max())
        self.start = motion.poses[keep[int(np.argmin(ends))]]
        self.evaluated = 0

    def first(self) -> tuple[Array, Array]:
        """Equal pieces of the whole range; fewer for a short one (an input is mostly an angle)."""
        count = int(np.clip(math.ceil(FIRST * (self.high - self.low) / math.tau), FEWEST, FIRST))
        edges = np.linspace(self.low, self.high, count + 1)
        return edges[:-1], edges[1:]

    def _follow(self, inputs: Array) -> tuple[Mask, Array, Array]:
        """Follow the motion from its start: whether it is assembled at inputs, poses and velocities (estimated)."""
        from graphsynth.kinematics.simulation import simulate

        passed, back = np.unique(np.concatenate([[self.low], inputs]), return_inverse=True)
        found, at = simulate(self.given.mechanism, passed, start=self.start, events=False), back[1:]
        return found.assembled[at], found.poses[at], found.velocities[at]

    def evaluate(self, lo: Array, hi: Array) -> Found:
        """Bounds of the factor over every piece."""
        count, size = len(lo), self.system.size
        self.evaluated += count
        u = Interval.from_bounds(lo, hi)
        assembled, poses, velocities = self._follow(u.mid)
        lower, upper = np.zeros(count), np.full(count, np.inf)
        proved = np.zeros(count, dtype=bool)
        box, sure = np.full((2, count, size), np.nan), np.zeros(count, dtype=np.int8)
        keep = np.flatnonzero(assembled & np.isfinite(velocities).all(axis=(1, 2)))
        if keep.size:
            poses = poses[keep]
            x, rate = self.system.coordinates(poses, velocities[keep])
            counted = self.system.count(poses)
            tubes = prove_tubes(self.system, self.given.layout.joints, u[keep], x, rate, counted)
            proved[keep] = tubes.proved
            box[0, keep], box[1, keep] = tubes.domain.lo, tubes.domain.hi
            rows = np.flatnonzero(tubes.proved)
            if rows.size:
                at_middle = prove_tubes(
                    self.system, self.given.layout.joints, points(u.mid[keep[rows]]), x[rows], rate[rows], counted[rows]
                )
                whole = u[keep[rows]], tubes.take(rows), at_middle, counted[rows]
                lower[keep[rows]], upper[keep[rows]], sure[keep[rows]] = self._bounds(poses[rows], *whole)
        return Found(lo, hi, lower, upper, proved, box[0], box[1], sure)

    def _bounds(
        self, poses: Array, u: Interval, tubes: Tubes, middle: Tubes, counted: Array
    ) -> tuple[Array, Array, NDArray[np.int8]]:
        """Bound the factor: below over the whole boxes, above at the corners of the misalignments.

        And where small tilts decide, tell what exact tilts prove.  A combination of corners closes with the combination
        of their tilts, and what exact tilts add to it is the combination of what they add at the corners.
        """
        layout = self.given.layout
        rates = slopes(self.system, layout.joints, u, tubes, counted)
        step = u - points(u.mid)

        def pieces(own: Layout) -> Pieces:
            """Positions and misalignments, with what the mean value theorem needs where it is proved."""
            r_slope, e_slope, base_slope, fine = rates
            moving = Moving(
                middle.r,
                middle.e,
                shifts_enclosed(own, middle.base),
                r_slope,
                e_slope,
                shifts_enclosed(own, base_slope),
                step,
                middle.proved & fine,
            )
            return Pieces(tubes.r, tubes.e, shifts_enclosed(own, tubes.base), moving)

        upper = np.zeros(len(poses))
        above = []
        for corner in self.corners:
            found = replace(self.given, layout=corner).solve(poses, "scale")
            above.append((corner, pieces(corner), found))
            upper = np.maximum(upper, upper_bounds(*above[-1]))
        if len(self.corners) > 1:  # one alone differs by a factor at most, which the bound from below does not see
            found = self.given.solve(poses, "scale")
        below = layout, pieces(layout), found
        lower = lower_bounds(*below)
        if not self.exact:
            return lower, upper, np.zeros(len(poses), dtype=np.int8)
        return lower, upper, self._sure(lower, upper, below, above, tubes, u, counted)

    def _sure(
        self, lower: Array, upper: Array, below: _Bound, above: list[_Bound], tubes: Tubes, u: Interval, counted: Array
    ) -> NDArray[np.int8]:
        """Tell where exact tilts prove binding (-1) or freedom (+1), among the pieces that small tilts decide."""
        sure = np.zeros(len(lower), dtype=np.int8)
        rows = np.flatnonzero(lower > 1.0)
        if rows.size:
            layout, at, found = below[0], _take(below[1], rows), _take(below[2], rows)
            none = np.full((rows.size, len(layout.limit)), np.inf)
            exact = neglected(self.system, layout, tubes.take(rows), u[rows], counted[rows], none)
            sure[rows[lower_bounds(layout, at, found, exact) > 1.0]] = -1
        rows = np.flatnonzero(upper < 1.0)
        if rows.size:
            free = np.ones(rows.size, dtype=bool)
            for layout, whole, found in above:
                at, found = _take(whole, rows), _take(found, rows)
                tilts = np.abs(start_tilts(layout, at, found)[0]).sum(axis=-1)
                tilts = _ROOM * tilts + _SHARE * tilts.max(axis=1, keepdims=True, initial=0.0) + _LEAST
                exact = neglected(self.system, layout, tubes.take(rows), u[rows], counted[rows], tilts)
                free &= upper_bounds(layout, at, found, exact) < 1.0
            sure[rows[free]] = 1
        return sure

    def estimate(self, inputs: Array) -> Array:
        """Factor at inputs in ascending order (estimated); 0 where there is no pose."""
        fine, poses, _ = self._follow(inputs)
        value = np.zeros(len(inputs))
        value[fine] = self.given.solve(poses[fine], "scale").lower
        return value

    def links(self, pieces: Found) -> Mask:
        """Whether the assemblies of neighbouring pieces are proved to be one at the input they share, (pieces - 1,)."""
        edges = pieces.lo[1:]
        found: Mask = pieces.proved[:-1] & pieces.proved[1:]
        rows = np.flatnonzero(found)
        if rows.size == 0 or self.system.size == 0:
            return found
        fine, poses, velocities = self._follow(edges[rows])
        fine &= np.isfinite(velocities).all(axis=(1, 2))
        found[rows[~fine]] = False
        rows, poses, velocities = rows[fine], poses[fine], velocities[fine]
        if rows.size == 0:
            return found
        x, rate = self.system.coordinates(poses, velocities)
        counted, u = self.system.count(poses), Interval.from_bounds(edges[rows], edges[rows])
        single = prove_tubes(self.system, (), u, x, rate, counted)
        before = Interval.from_bounds(pieces.box_lo[rows], pieces.box_hi[rows])
        after = Interval.from_bounds(pieces.box_lo[rows + 1], pieces.box_hi[rows + 1])
        found[rows] = linked(self.system, single, u, before, after, counted)
        return found

    def on_branch(self, pieces: Found, links: Mask) -> Mask:
        """Whether the assembly of a piece is proved to be that of the motion: a sample's own, or linked to such a one.

        A sample of the motion stands for the one assembly proved next to it.  Every box holds exactly one for each
        input, so a box around that assembly belongs to the motion.
        """
        # proved pieces within which the motion has a sample, and for each the sample nearest to its middle
        keep = np.flatnonzero(self.motion.assembled)
        u = self.motion.inputs[keep]
        place = np.clip(np.searchsorted(pieces.lo, u, side="right") - 1, 0, None)
        inside = np.flatnonzero(pieces.proved[place] & (pieces.lo[place] <= u) & (u <= pieces.hi[place]))
        place, u = place[inside], u[inside]
        away = np.abs(u - 0.5 * (pieces.lo[place] + pieces.hi[place]))
        order = np.lexsort((away, place))
        rows, first = np.unique(place[order], return_index=True)
        samples = keep[inside[order[first]]]
        if self.system.size and rows.size:
            poses = self.motion.poses[samples]
            x, u = self.system.coordinates(poses, np.zeros_like(poses))[0], self.motion.inputs[samples]
            own = prove_tubes(self.system, (), points(u), x, np.zeros_like(x), self.system.count(poses))
            box = Interval.from_bounds(pieces.box_lo[rows], pieces.box_hi[rows])
            rows = rows[own.proved & own.tight.subset(box).all(axis=1)]
        group = np.concatenate([[0], np.cumsum(~links)])  # of pieces that are linked
        return np.isin(group, group[rows])


def _take(value: Any, rows: NDArray[np.intp]) -> Any:
    """Return some of the pieces of a named tuple of arrays and intervals; its other entries as they are."""
    parts = []
    for part in value:
        if isinstance(part, tuple):
            parts.append(_take(part, rows) if isinstance(part, Moving) else part)
        else:
            parts.append(part[rows] if isinstance(part, np.ndarray | Interval) else part)
    return type(value)(*parts)


def cut(lo: Array, hi: Array) -> tuple[Array, Array]:
    """Cut every piece into equal parts; parts share their ends exactly."""
    edges = lo[:, None] + (hi - lo)[:, None] * (np.arange(PARTS + 1) / PARTS)
    edges[:, 0], edges[:, -1] = lo, hi
    return edges[:, :-1].ravel(), edges[:, 1:].ravel()


def check_range(motion: Motion, length_tolerance: float, **limits: float) -> None:
    """Refuse a changed rounding mode, a tolerance or a limit of the work out of bounds, a motion without a range."""
    check_rounding()
    check_motion(motion)
    for name, value in limits.items():
        if not isinstance(value, int | float | np.number) or not value >= 0 or (value > 2**63 and value != np.inf):
            raise GeometryError(f"{name} = {value!r} must be a number of zero or more; correct the value")
    if not 0.0 <= finite("length_tolerance", length_tolerance) < 0.5:
        raise GeometryError(f"length_tolerance = {length_tolerance} must be a relative half width from 0 to 0.5")
    if int(motion.assembled.sum()) < 2:
        raise GeometryError(
            f"the motion has {int(motion.assembled.sum())} assembled samples; a range needs two or more"
        )
