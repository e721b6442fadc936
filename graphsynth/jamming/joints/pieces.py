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

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, check_rounding
from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.assembly.positions import Positions, points
from graphsynth.jamming.assembly.tubes import Tubes, columns_of, middles, prove_tubes, slopes, whole_box
from graphsynth.jamming.joints.closure import Layout, leaning_points, leans, shifts_enclosed
from graphsynth.jamming.joints.enclosure import Moving, Pieces, Rule, factor_range, lower_bounds, rule_of, upper_bounds
from graphsynth.jamming.joints.exact import Neglected, neglected
from graphsynth.jamming.joints.limits import Misalignment, bounds
from graphsynth.jamming.joints.program import JointProblem, PoseSolution, check_motion, solve_poses
from graphsynth.tolerances.box import ParameterBox

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
#: Largest over smallest factor of a piece up to which its estimated range is believed.
_SMALL = 1.35
#: Layout, pieces and solution that a bound starts from.
_Bound: TypeAlias = tuple[Layout, Pieces, PoseSolution]


class Found(NamedTuple):
    """Pieces evaluated: inputs, bounds of the factor, whether positions are proved, and the boxes they lie in.

    ``sure`` tells what exact tilts prove: +1 free, -1 binds, 0 nothing; the bounds of the factor are of first order.
    ``p_lo``, ``p_hi`` (N, m) are the parameters of every piece, ``reach`` (N, 1 + m) what is worth cutting, ``least``
    and ``most`` estimates of the factor's range over the piece.
    """

    lo: Array
    hi: Array
    lower: Array
    upper: Array
    proved: Mask
    box_lo: Array
    box_hi: Array
    sure: NDArray[np.int8]
    p_lo: Array
    p_hi: Array
    reach: Array
    least: Array
    most: Array

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

    @property
    def mixed(self) -> Mask:
        """Whether some members seem to bind and some do not (estimated): no cut proves them all alike.

        Told only of pieces so small that a range to first order means something.
        """
        return np.asarray((self.least < 1.0) & (self.most > 1.0) & (self.most < _SMALL * self.least))

    @staticmethod
    def join(parts: list[Found]) -> Found:
        """Return all pieces in the order of the input, then of the parameters."""
        whole = Found._make(np.concatenate(columns) for columns in zip(*parts))
        return whole.take(np.lexsort((*whole.p_lo.T[::-1], whole.hi, whole.lo)))

    def by_input(self) -> Found:
        """Return one piece for each range of inputs: decided where all pieces over it are decided alike."""
        if self.p_lo.shape[1] == 0:
            return self
        edges = np.unique(np.concatenate([self.lo, self.hi]))
        still = np.unique(self.lo[self.lo == self.hi])
        low, high = np.concatenate([edges[:-1], still]), np.concatenate([edges[1:], still])
        order = np.lexsort((high, low))
        parts = []
        for a, b in zip(low[order].tolist(), high[order].tolist()):
            rows = (self.lo == self.hi) & (self.lo == a) if a == b else (self.lo <= a) & (self.hi >= b) & (self.lo < b)
            own = self.take(rows)
            sure = own.sure.min() if own.sure.min() == own.sure.max() else 0
            parts.append((a, b, own.lower.min(), own.upper.max(), own.proved.all(), sure))
        lo, hi, lower, upper, proved, sure = (np.array(column) for column in zip(*parts))
        whole = Interval.from_bounds(*(np.tile(f(axis=0), (lo.size, 1)) for f in (self.p_lo.min, self.p_hi.max)))
        found = Found.open(lo, hi, whole, self.box_lo.shape[1])
        return found._replace(lower=lower, upper=upper, proved=proved.astype(bool), sure=sure.astype(np.int8))

    @property
    def volume(self) -> Array:
        """Share of every piece in all inputs and dimensions together."""
        width = self.p_hi - self.p_lo
        whole = self.p_hi.max(axis=0, initial=-np.inf) - self.p_lo.min(axis=0, initial=np.inf)
        shares = np.where(whole > 0.0, width / np.where(whole > 0.0, whole, 1.0), 1.0).prod(axis=1)
        size = (self.hi - self.lo) * shares
        return np.asarray(size / size.sum()) if size.sum() > 0.0 else size

    @staticmethod
    def open(lo: Array, hi: Array, p: Interval, size: int) -> Found:
        """Return pieces about which nothing is known."""
        none, box = np.zeros(len(lo)), np.full((len(lo), size), np.nan)
        reach = np.zeros((len(lo), 1 + p.shape[1]))
        state = none.astype(np.int8)
        return Found(lo, hi, none, none + np.inf, none > 1.0, box, box, state, p.lo, p.hi, reach, none, none + np.inf)


class Work:
    """Evaluation of pieces of one problem along one motion; without ``exact`` by small tilts alone.

    ``tolerance`` is the box of parameters, or one relative half width of every coordinate of a joint.
    """

    def __init__(
        self, given: JointProblem, motion: Motion, tolerance: float | ParameterBox, exact: bool = True
    ) -> None:
        self.given, self.motion, self.exact = given, motion, exact
        for joint, own in zip(motion.mechanism.joints, given.limits):
            if (most := bounds(own, "radial_clearance")[1]) > 0.0:
                name = f"joint {joint.a}-{joint.b} has a radial clearance of {most:g}"
                raise GeometryError(f'{name}, which small tilts do not count; ask model="exact", or leave it out')
        keep = np.flatnonzero(motion.assembled)
        ends = motion.inputs[keep]
        self.low, self.high = float(ends.min()), float(ends.max())
        self.start = motion.poses[keep[int(np.argmin(ends))]]
        self.system = Positions(motion.mechanism, tolerance, self.start)
        self.box = self.system.box
        self.corners = corner_layouts(given.layout)
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
        fine = found.assembled[at] & np.isfinite(found.velocities[at]).all(axis=(1, 2))
        return fine, found.poses[at], found.velocities[at]

    def _near(self, inputs: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Return inputs at which the motion is assembled, the unknowns there, and what is counted (estimated)."""
        if self.system.size == 0:
            none = np.zeros((len(inputs), 0))
            return np.arange(len(inputs)), none, np.zeros((len(inputs), len(self.system.closing)))
        fine, poses, velocities = self._follow(inputs)
        keep = np.flatnonzero(fine & self.system.follows(poses))
        return keep, self.system.coordinates(poses[keep], velocities[keep])[0], self.system.count(poses[keep])

    def whole(self, count: int) -> Interval:
        """Return the whole box of parameters for N pieces."""
        return whole_box(self.system, count)

    def evaluate(self, lo: Array, hi: Array, parameters: Interval | None = None) -> Found:
        """Bounds of the factor over every piece; ``parameters`` (N, m) is the whole box if not given."""
        count = len(lo)
        self.evaluated += count
        p = self.whole(count) if parameters is None else parameters
        u, found = Interval.from_bounds(lo, hi), Found.open(lo, hi, p, self.system.size)
        found = Found._make(np.array(part) for part in found)
        keep, x, counted = self._near(u.mid)
        if keep.size == 0:
            return found
        tubes = prove_tubes(self.system, self.given.layout.joints, u[keep], x, counted, p[keep])
        found.proved[keep], found.reach[keep] = tubes.proved, tubes.reach
        found.box_lo[keep], found.box_hi[keep] = tubes.domain.lo, tubes.domain.hi
        rows = np.flatnonzero(tubes.proved)
        if rows.size:
            own, tubes = keep[rows], tubes.take(rows)
            middle = middles(self.system, self.given.layout.joints, u[own], tubes, p[own])
            columns = self._bounds(u[own], tubes, middle, counted[rows], p[own])
            for name, value in zip(("lower", "upper", "sure", "least", "most"), columns):
                getattr(found, name)[own] = value
        return found

    def _bounds(self, u: Interval, tubes: Tubes, middle: Tubes, counted: Array, p: Interval) -> tuple[Any, ...]:
        """Bound the factor: below over the whole boxes, above at the corners of the misalignments.

        And where small tilts decide, tell what exact tilts prove.  A combination of corners closes with the combination
        of their tilts, and what exact tilts add to it is the combination of what they add at the corners.
        """
        layout, count = self.given.layout, len(counted)
        if layout.loops == 0:
            none = np.zeros(count)
            return none, none, np.full(count, int(self.exact), dtype=np.int8), none, none
        rates, fine = slopes(self.system, layout.joints, u, tubes, counted, p)
        steps = Interval.stack([u, *columns_of(p)], axis=0)
        steps = steps - points(steps.mid)
        sound = middle.proved & fine
        wanted = zip(Places._fields, tubes.places, middle.places, rates)
        narrow: dict[str, Any] = {
            name: _straight(whole, here, rate, steps, sound)
            for name, whole, here, rate in wanted
            if name != "rail" or layout.rails
        }
        tubes = tubes._replace(**narrow)
        about, about_middle, about_slope = (
            leaning_points(layout, at.r, at.rail) for at in (tubes.places, middle.places, rates)
        )
        flat = rates.base.reshape(-1, *rates.base.shape[2:])
        middles_of = Places(*(part.mid for part in middle.places))

        def pieces(own: Layout) -> Pieces:
            """Positions and misalignments, with what the mean value theorem needs where it is proved."""
            d_slope = shifts_enclosed(own, flat).reshape(*rates.r.shape)
            shift = shifts_enclosed(own, middle.base)
            at = middle.r, middle.e, shift, about_middle
            moving = Moving(*at, rates.r, rates.e, d_slope, about_slope, steps, sound)
            return Pieces(tubes.r, tubes.e, shifts_enclosed(own, tubes.base), about, moving)

        def solved(own: Layout) -> PoseSolution:
            return solve_poses(own, middles_of.r, middles_of.e, leans(own, middles_of), "scale")

        upper, least, most = np.zeros((3, count))
        above = []
        for corner in self.corners:
            bound = corner, pieces(corner), solved(corner)
            rule = rule_of(*bound)
            above.append((*bound, rule))
            upper = np.maximum(upper, upper_bounds(*bound, rule=rule))
            low, high = factor_range(rule, steps, bound[2])
            least, most = np.maximum(least, low), np.maximum(most, high)
        # one corner alone differs by a factor at most, which the bound from below does not see
        below = layout, pieces(layout), above[0][2] if len(self.corners) == 1 else solved(layout)
        lower = lower_bounds(*below)
        if not self.exact:
            return lower, upper, np.zeros(count, dtype=np.int8), least, most
        return lower, upper, self._sure(lower, upper, below, above, tubes, u, counted, p), least, most

    def _sure(
        self,
        lower: Array,
        upper: Array,
        below: _Bound,
        above: list[tuple[Layout, Pieces, PoseSolution, Rule]],
        tubes: Tubes,
        u: Interval,
        counted: Array,
        p: Interval,
    ) -> NDArray[np.int8]:
        """Tell where exact tilts prove binding (-1) or freedom (+1), among the pieces that small tilts decide."""
        sure = np.zeros(len(lower), dtype=np.int8)

        def rest(layout: Layout, rows: NDArray[np.intp], assumed: Array) -> Neglected:
            system = self.system.within(columns_of(p[rows]))
            return neglected(system, layout, tubes.take(rows), u[rows], counted[rows], assumed)

        rows = np.flatnonzero(lower > 1.0)
        if rows.size:
            layout, at, found = below[0], _take(below[1], rows), _take(below[2], rows)
            exact = rest(layout, rows, np.full((rows.size, len(layout.limit)), np.inf))
            sure[rows[lower_bounds(layout, at, found, exact) > 1.0]] = -1
        for wide in (False, True):
            rows = np.flatnonzero((upper < 1.0) & (sure == 0))
            if rows.size == 0:
                break
            free = np.ones(rows.size, dtype=bool)
            for layout, whole, found, rule in above:
                at, found, rule = _take(whole, rows), _take(found, rows), rule.take(rows)
                tilts = np.abs(rule.tau).sum(axis=-1)
                tilts = _ROOM * tilts + _SHARE * tilts.max(axis=1, keepdims=True, initial=0.0) + _LEAST
                if wide:  # over a wide piece a tilt may come nearer to its limit than in the middle
                    near = layout.limit_range[0] * (_ROOM * upper[rows, None])
                    tilts = np.maximum(tilts, np.where(np.isfinite(near), near, 0.0))
                free &= upper_bounds(layout, at, found, rest(layout, rows, tilts), rule) < 1.0
            sure[rows[free]] = 1
        return sure

    def estimate(self, inputs: Array) -> Array:
        """Factor at inputs in ascending order (estimated); 0 where there is no pose."""
        fine, poses, _ = self._follow(inputs)
        value = np.zeros(len(inputs))
        value[fine] = self.given.solve(poses[fine], "scale").lower
        return value

    def assemblies(self, u: Array, p: Array) -> Tubes:
        """Prove the assembly of the motion at inputs (N,) and parameters (N, m); the poses are estimated."""
        fine, poses, _ = self._follow(u)
        poses = np.where(fine[:, None, None], poses, 0.0)
        x = self.system.coordinates(poses, np.zeros_like(poses))[0]
        found = prove_tubes(self.system, (), points(u), x, self.system.count(poses), points(p))
        return found._replace(proved=found.proved & fine)


def _straight(whole: Interval, middle: Interval, rates: Interval, steps: Interval, sound: Mask) -> Interval:
    """Narrow values over pieces by the mean value theorem, where it is proved: rates are (1 + m, N, ...)."""
    shape = (*steps.shape, *(1,) * (whole.ndim - 1))
    with np.errstate(all="ignore"):
        better = (middle + (rates * steps.reshape(*shape)).sum(0)).intersect(whole)
    use = sound.reshape(-1, *(1,) * (whole.ndim - 1)) & ~better.is_empty
    return Interval.from_bounds(np.where(use, better.lo, whole.lo), np.where(use, better.hi, whole.hi))


def _take(value: Any, rows: NDArray[np.intp]) -> Any:
    """Return some of the pieces of a named tuple of arrays and intervals; its other entries as they are."""
    parts: list[Any] = []
    for part in value:
        if isinstance(part, tuple):
            parts.append(part.take(rows) if isinstance(part, Moving) else part)
        else:
            parts.append(part[rows] if isinstance(part, np.ndarray | Interval) else part)
    return type(value)(*parts)


def cut(lo: Array, hi: Array) -> tuple[Array, Array]:
    """Cut every piece into equal parts; parts share their ends exactly."""
    edges = lo[:, None] + (hi - lo)[:, None] * (np.arange(PARTS + 1) / PARTS)
    edges[:, 0], edges[:, -1] = lo, hi
    return edges[:, :-1].ravel(), edges[:, 1:].ravel()


def check_range(motion: Motion, **limits: float) -> None:
    """Refuse a changed rounding mode, a limit of the work out of bounds, a motion without a range."""
    check_rounding()
    check_motion(motion)
    for name, value in limits.items():
        if not isinstance(value, int | float | np.number) or not value >= 0 or (value > 2**63 and value != np.inf):
            raise GeometryError(f"{name} = {value!r} must be a number of zero or more; correct the value")
    if int(motion.assembled.sum()) < 2:
        raise GeometryError(
            f"the motion has {int(motion.assembled.sum())} assembled samples; a range needs two or more"
        )
