"""The margin of all joints of a mechanism over a range of its input (small tilts), for `probability_of_jamming`."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.intervals import Interval, check_rounding
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Range
from graphsynth.jamming.chance.paving import Affine
from graphsynth.jamming.joints.drawing import Tolerances
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.program import Bearings, check_motion
from graphsynth.jamming.margins.lines import Boxes, Slack, boxes_of, certificates, pairs_of, slacks, solved, thresholds
from graphsynth.jamming.margins.program import Items
from graphsynth.jamming.margins.quantities import Quantities, quantities_of
from graphsynth.jamming.margins.stations import Stations

if TYPE_CHECKING:
    from graphsynth.jamming.margins.sampling import Sampler
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Mask = NDArray[np.bool_]
#: Rounds of looking closer for one batch of boxes; pairs looked at together, in one round; what the input may add to a
#: gap; stations of a box that are looked at in a round.
_ROUNDS, _TOGETHER, _MOST, _SHARE, _NEXT = 5, 2048, 4096, 0.15, 4
#: Share in which a used up joint may tilt further in a correction: near binding, and where there is plenty of room.
_STIFF, _LOOSE = 1e-3, 0.2


class _Pairs(NamedTuple):
    """Pairs of a box and a station: certificate (``low`` and ``a`` in the sources), slack of the items.

    ``fresh`` where both are of the box; elsewhere the slack is that of a larger box, and the certificate an estimate.
    """

    box: Rows
    station: Rows
    fresh: Mask
    start: Array
    low: Array
    a: Array
    loose: Array
    slack: Slack

    def take(self, rows: Any) -> _Pairs:
        """Return some of the pairs."""
        slack = Slack(*(part[rows] for part in self.slack))
        return _Pairs._make([*(part[rows] for part in self[:-1]), slack])

    @staticmethod
    def join(parts: list[_Pairs]) -> _Pairs:
        """Put pairs together."""
        slack = Slack(*(np.concatenate(own) for own in zip(*(part.slack for part in parts))))
        return _Pairs._make([*(np.concatenate(own) for own in zip(*(part[:-1] for part in parts))), slack])

    def inherited(self, box: int, shift: Array) -> _Pairs:
        """Return the pairs of a larger box for a part of it whose middle lies so far from the other."""
        with np.errstate(invalid="ignore"):
            change = self.slack.by @ shift
            size = np.abs(self.slack.by) @ np.abs(shift)
            need = self.slack.need - change + 1e-13 * size
        count = len(self.box)
        return self._replace(
            box=np.full(count, box),
            fresh=np.zeros(count, dtype=np.bool_),
            start=np.where(np.isfinite(self.start), self.start + self.a @ shift, self.start),
            low=np.full(count, -np.inf),
            slack=self.slack._replace(need=np.where(np.isnan(need), np.inf, need)),
        )


class _Known(NamedTuple):
    """What is known of a box: its middle, and its pairs."""

    middle: Array
    pairs: _Pairs


class JointsMargin(Shown):
    """What is left before any joint of a mechanism binds, over the range of a motion: made by `joints_margin`.

    Attributes
    ----------
    ranges : dict of str to Range
        The toleranced quantities and their ranges, lengths first.
    model : str
        What the probability is about.
    """

    def __init__(self, motion: Motion, quantities: Quantities) -> None:
        check_rounding()
        self.motion, self.quantities = motion, quantities
        self.names = tuple(quantities.ranges)
        layout = quantities.layout
        if layout.loops == 0:
            raise GeometryError("no closed loop of guided joints: nothing can bind, and no probability is needed")
        self.stations = Stations(quantities.given, motion, quantities.box)
        whole = quantities.values([Interval(float(own.lower), float(own.upper)) for own in quantities.ranges.values()])
        most = np.array([0.0 if own is None else float(own.hi) for own in (*whole.limits, *whole.plays)])
        items = Items.of(layout, self.stations.placed.at.r.mid)
        self.items = items._replace(costly=~items.free & (most > 0.0))  # a limit may be zero in the middle of its range
        if not self.items.costly.any():
            raise GeometryError("no joint has a limit above zero to be used up; give one at least a clearance")
        self.sampler: Sampler | None = None
        low, high = self.stations.work.low, self.stations.work.high
        self.model = (
            f"all joints together over the inputs {low:.6g} to {high:.6g}, small tilts (first order); rigid parts"
        )

    @property
    def ranges(self) -> dict[str, Range]:
        """Ranges of the quantities."""
        return self.quantities.ranges

    @property
    def first(self) -> Rows:
        """Stations of a box about which nothing is known."""
        return np.flatnonzero(self.stations.depth == 0)

    def covering(self, ranges: Mapping[str, Range]) -> JointsMargin:
        """Return a margin for ranges that may be wider; this one if it covers them."""
        now = self.ranges
        if all(now[name].lower <= own.lower and own.upper <= now[name].upper for name, own in ranges.items()):
            return self
        wide = {
            name: Range(min(own.lower, other.lower), max(own.upper, other.upper), own.exact and other.exact)
            for name, own, other in ((name, own, ranges.get(name, own)) for name, own in now.items())
        }
        return JointsMargin(self.motion, self.quantities.within(wide))

    def sampled(self, x: Array) -> Array:
        """Return the margin of members (N, quantities) in floating point, (N,); estimated."""
        if self.sampler is None:
            from graphsynth.jamming.margins.sampling import Sampler

            self.sampler = Sampler(self.quantities, self.items, self.stations.work)
        return self.sampler.margin_of(x)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        return f"Margin of {self.model}", [(name, str(own)) for name, own in self.ranges.items()]

    def lines(
        self, at: Sequence[Any], over: Sequence[Any], ends: tuple[Array, Array], known: Sequence[_Known | None]
    ) -> tuple[Affine, list[_Known]]:
        """Bound the margin over N boxes by linear functions of the n sources.

        ``at``, ``over``: quantities at the middles, and over the boxes as duals by the sources; ``ends`` of the boxes
        (N, n); ``known`` of each, None for nothing.  Returns the same for what is left.
        """
        middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
        boxes = boxes_of(self.quantities, self.items, at, over, half)
        found = self._start(boxes, middle, known)
        for k in range(_ROUNDS):
            bounds = self._bounds(found, half)
            if k == _ROUNDS - 1:
                break
            cut, again = self._worth(found, bounds), self._next(found, bounds, len(half))
            if not (cut.any() or again.any()):
                break
            children = [self.stations.children[s] for s in found.station[cut].tolist()]
            box = [np.full(len(own), b) for own, b in zip(children, found.box[cut].tolist())]
            fresh = self._pairs(
                boxes, np.concatenate([*box, found.box[again]]), np.concatenate([*children, found.station[again]])
            )
            found = _Pairs.join([found.take(~(cut | again)), fresh])
        return self._affine(found, middle, half, bounds)

    def _start(self, boxes: Boxes, middle: Array, known: Sequence[_Known | None]) -> _Pairs:
        """Evaluate all stations of boxes about which nothing is known, and the likely worst ones of others."""
        none = [k for k, own in enumerate(known) if own is None]
        first = self.first
        parts = [self._pairs(boxes, np.repeat(none, len(first)).astype(np.intp), np.tile(first, len(none)))]
        parts += [own.pairs.inherited(k, middle[k] - own.middle) for k, own in enumerate(known) if own is not None]
        found = _Pairs.join(parts)
        few = len(found.box) <= _TOGETHER // 2  # as fast as one
        worst = ~found.fresh & (few | (_rank(found.box, found.start, len(known)) < _NEXT))
        return _Pairs.join([found.take(~worst), self._pairs(boxes, found.box[worst], found.station[worst])])

    def _next(self, found: _Pairs, bounds: tuple[Any, ...], count: int) -> Mask:
        """Tell the pairs to look at: the highest thresholds of a box, if they are those of a larger box."""
        low, c = bounds[1], bounds[3]
        top = _rank(found.box, -c, count) < _NEXT
        again = top & ~found.fresh & (c > low[found.box])
        again[np.flatnonzero(again)[_MOST:]] = False
        return np.asarray(again)

    def _affine(
        self, found: _Pairs, middle: Array, half: Array, bounds: tuple[Any, ...]
    ) -> tuple[Affine, list[_Known]]:
        """Put the bounds of all pairs of every box together."""
        a, low, loose, c, item, v = bounds
        start = np.full(len(half), np.inf)
        np.minimum.at(start, found.box[found.fresh], found.start[found.fresh])
        order = np.argsort(c, kind="stable")
        high = np.full(len(half), -np.inf)
        worst = np.full(len(half), -1)
        high[found.box[order]], worst[found.box[order]] = c[order], order
        rows = np.arange(len(order))
        slack = found.slack
        own = v[:, None] * np.nan_to_num(slack.curved[rows, item, 1:])
        v_used = np.where(v > 0.0, v, 1.0 / np.maximum(np.abs(slack.need[rows, item]), 1e-300))
        with np.errstate(invalid="ignore", over="ignore"):
            own = own + np.abs(v_used[:, None] * slack.by[rows, item] - a[found.box]) * half[found.box]
        curved = np.where(half > 0.0, loose, 0.0) + np.where(worst[:, None] >= 0, np.nan_to_num(own)[worst], 0.0)
        # a station that may bind only where the line proves binding adds nothing: not here, not in any part
        left = (c > low[found.box]) | (found.fresh & (found.start == start[found.box]))
        order = np.flatnonzero(left)
        order = order[np.argsort(found.box[order], kind="stable")]
        places = np.searchsorted(found.box[order], np.arange(len(half) + 1))
        kept = [_Known(middle[k], found.take(order[i:j])) for k, (i, j) in enumerate(itertools.pairwise(places))]
        low = np.where(
            (low > 0.0) & (low > (np.abs(a) * half).sum(axis=1) * (1.0 + 1e-12)), np.inf, np.minimum(low, high)
        )
        return Affine(a, low, high, curved), kept

    def _pairs(self, boxes: Boxes, box: Rows, station: Rows) -> _Pairs:
        if not len(box):
            return self._empty(boxes)
        cuts = range(0, len(box), _TOGETHER)
        return _Pairs.join([self._evaluated(boxes, box[k : k + _TOGETHER], station[k : k + _TOGETHER]) for k in cuts])

    def _empty(self, boxes: Boxes) -> _Pairs:
        """Return no pairs."""
        n, rows, none = boxes.half.shape[1], 2 * len(self.items.costly), np.zeros(0, dtype=np.intp)
        slack = Slack(np.zeros((0, rows)), np.zeros((0, rows, n)), np.zeros((0, rows, 1 + n)))
        flat = np.zeros(0)
        return _Pairs(none, none, flat > 0.0, flat, flat, np.zeros((0, n)), np.zeros((0, n)), slack)

    def _evaluated(self, boxes: Boxes, box: Rows, station: Rows) -> _Pairs:
        layout, items, stations = self.quantities.layout, self.items, self.stations
        own = boxes.take(box)
        pairs = pairs_of(layout, items, own, stations.placed.take(station), stations.middle, stations.half[station])
        found = solved(layout, items, own, pairs)
        line = certificates(layout, items, own, pairs, found.y)
        a = np.where(line.sound, line.by.mid, 0.0)
        loose = np.where(line.sound[:, None], (line.by.rad[1:] * pairs.steps.mag[1:]).T, 0.0)
        low = -line.start.hi - loose.sum(axis=1) * (1.0 + 1e-12)
        low = np.where(line.sound, np.nextafter(low, -np.inf), -np.inf)
        start, reach = np.where(line.sound, line.start.hi, np.inf), (np.abs(a[1:].T) * own.half).sum(axis=1)
        room = np.where(line.sound, np.maximum(start, 0.0) / np.where(reach > 0.0, reach, 1.0), 1.0)
        slack = slacks(layout, items, own, pairs, found, np.nan_to_num(a), np.where(room > 1.0, _LOOSE, _STIFF))
        return _Pairs(box, station, np.ones(len(box), dtype=np.bool_), start, low, a[1:].T, loose, slack)

    def _bounds(self, found: _Pairs, half: Array) -> tuple[Any, ...]:
        """Return the line of every box, by its most dangerous station, and the thresholds of all pairs."""
        count = len(half)
        order = np.flatnonzero(found.fresh)
        order = order[np.argsort(-found.start[order], kind="stable")]
        best = np.full(count, -1)
        best[found.box[order]] = order
        have = best >= 0
        a = np.where(have[:, None], found.a[best] if len(found.box) else 0.0, 0.0)
        low = np.where(have, found.low[best] if len(found.box) else 0.0, -np.inf)
        loose = np.where(have[:, None], found.loose[best] if len(found.box) else 0.0, 0.0)
        return a, low, loose, *thresholds(found.slack, a[found.box], half[found.box])

    def _worth(self, found: _Pairs, bounds: tuple[Any, ...]) -> Mask:
        """Tell the pairs whose station is too wide for their box, and cut those stations."""
        _, low, _, c, item, v = bounds
        gap = c - low[found.box]
        rows = np.arange(len(c))
        most = np.full(len(low), -np.inf)
        np.maximum.at(most, found.box, np.where(gap < np.inf, gap, -np.inf))
        curved = found.slack.curved[rows, item]
        with np.errstate(all="ignore"):
            wide = (curved[:, 0] > _SHARE * curved[:, 1:].sum(axis=1)) & (
                (c == np.inf) | (v * curved[:, 0] > _SHARE * gap)
            )
            wide &= (gap > _SHARE * most[found.box]) | (gap == np.inf)
        wide &= found.fresh & (gap > 0.0) & (c > -np.inf)
        wide[np.flatnonzero(wide)[_MOST // 4 :]] = False
        self.stations.cut(np.unique(found.station[wide]))
        can = np.array([k in self.stations.children for k in found.station.tolist()], dtype=np.bool_)
        return np.asarray(wide & can)


def _rank(box: Rows, key: Array, count: int) -> Rows:
    """Place of every pair among those of its box, in the order of a key."""
    order = np.lexsort((key, box))
    first = np.searchsorted(box[order], np.arange(count))
    place = np.empty(len(box), dtype=np.intp)
    place[order] = np.arange(len(box)) - first[box[order]]
    return place


def joints_margin(
    motion: Motion,
    joints: Bearings | None = None,
    tilt: Misalignment | Iterable[Misalignment] = (),
    tolerances: Tolerances = (),
    *,
    condition: Condition = "A",
) -> JointsMargin:
    """Make the margin of all joints of a mechanism over the range of a motion, for `probability_of_jamming`.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; the range of its inputs is the range asked about.
    joints : Bearing, JointLimits, SlideLimits, or mapping of (link, link) to one of these, optional
        Limits of the joints that have no fit among the tolerances; ranges of `JointLimits` and `SlideLimits` are
        quantities.
    tilt : Misalignment or several, optional
        Which axes are tilted; their ranges of ``alpha`` and ``direction`` are quantities.
    tolerances : iterable of PartTolerance, optional
        Tolerances of the drawing (`graphsynth.tolerances`).  A fit is two quantities, the deviations of hole and shaft;
        an axis that may lean by an angle is two, its components, each up to the angle; a hole within a circle is two,
        each up to half the diameter.
    condition : {"A", "B", "general"}
        Contact condition of every `Bearing`.

    Returns
    -------
    JointsMargin
        Its quantities and their ranges print with it; uniform unless `probability_of_jamming` is told otherwise.

    Raises
    ------
    GeometryError
        For limits, axes or tolerances that do not fit the mechanism, and if not every member is proved to be assembled
        over the whole range.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming.joints.limits import JointLimits, Misalignment
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate("0..90 deg")
    >>> margin = joints_margin(motion, JointLimits(0.006), Misalignment(0, 1, 0.01, alpha_range=(0.0, 0.014)))
    >>> list(margin.ranges)
    ['alpha 0-1']
    """
    check_motion(motion)
    quantities = quantities_of(motion.mechanism, joints, tilt, tolerances, condition)
    return JointsMargin(motion, quantities)
