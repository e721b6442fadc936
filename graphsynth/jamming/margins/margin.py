"""The margin of all joints of a mechanism over a range of its input (small tilts), for `probability_of_jamming`."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.intervals import check_rounding
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
#: Rounds of cutting stations for one batch of boxes; pairs looked at together; what the input may add to a gap.
_ROUNDS, _TOGETHER, _SHARE = 5, 2048, 0.3


class _Pairs(NamedTuple):
    """Pairs of a box and a station: certificate (``low`` and ``a`` in the sources), slack of the items."""

    box: Rows
    station: Rows
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
        self.items = Items.of(layout, self.stations.places.r.mid)
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
        self, at: Sequence[Any], over: Sequence[Any], half: Array, open_: Sequence[Rows | None]
    ) -> tuple[Affine, list[Rows]]:
        """Bound the margin over N boxes by linear functions of the n sources.

        ``at``, ``over``: quantities at the middles, and over the boxes as duals by the sources; ``half`` (N, n);
        ``open_``: stations at which each box may bind, None for all.  Returns the same for what is left.
        """
        boxes = boxes_of(self.quantities, self.items, at, over, half)
        lists = [self.first if own is None else own for own in open_]
        box = np.repeat(np.arange(len(half)), [len(own) for own in lists])
        fresh = self._pairs(boxes, box, np.concatenate(lists) if lists else box)
        found = fresh
        for k in range(_ROUNDS):
            a, low, loose, c, item, v = self._bounds(found, half)
            again = self._worth(found, (c, low, item, v)) if k < _ROUNDS - 1 else np.zeros(len(c), dtype=np.bool_)
            if not again.any():
                break
            parts = [self.stations.children[s] for s in found.station[again].tolist()]
            size = [len(own) for own in parts]
            fresh = self._pairs(boxes, np.repeat(found.box[again], size), np.concatenate(parts))
            found = _Pairs.join([found.take(~again), fresh])
        return self._affine(found, half, (a, low, loose, c, item, v))

    def _affine(self, found: _Pairs, half: Array, bounds: tuple[Any, ...]) -> tuple[Affine, list[Rows]]:
        """Put the bounds of all pairs of every box together."""
        a, low, loose, c, item, v = bounds
        start = np.full(len(half), np.inf)
        np.minimum.at(start, found.box, found.start)
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
        left = (c > low[found.box]) | (found.start == start[found.box])
        box, station = found.box[left], found.station[left]
        order = np.argsort(box, kind="stable")
        ends = np.searchsorted(box[order], np.arange(len(half) + 1))
        sets = [station[order[i:j]] for i, j in itertools.pairwise(ends)]
        low = np.where(
            (low > 0.0) & (low > (np.abs(a) * half).sum(axis=1) * (1.0 + 1e-12)), np.inf, np.minimum(low, high)
        )
        return Affine(a, low, high, curved), sets

    def _pairs(self, boxes: Boxes, box: Rows, station: Rows) -> _Pairs:
        parts = [
            self._evaluated(boxes, box[k : k + _TOGETHER], station[k : k + _TOGETHER])
            for k in range(0, max(len(box), 1), _TOGETHER)
        ]
        return _Pairs.join(parts)

    def _evaluated(self, boxes: Boxes, box: Rows, station: Rows) -> _Pairs:
        layout, items, stations = self.quantities.layout, self.items, self.stations
        own = Boxes(
            boxes.t[box],
            boxes.t_by[:, box],
            boxes.v[box],
            boxes.v_over[box],
            boxes.v_by[:, box],
            boxes.p[box],
            boxes.p_by[:, box],
            boxes.half[box],
        )
        pairs = pairs_of(layout, items, own, stations.places.take(station), stations.middle, stations.half[station])
        found = solved(layout, items, own, pairs)
        line = certificates(layout, items, own, pairs, found.y)
        a = np.where(line.sound, line.by.mid, 0.0)
        loose = np.where(line.sound[:, None], (line.by.rad[1:] * pairs.steps.mag[1:]).T, 0.0)
        low = -line.start.hi - loose.sum(axis=1) * (1.0 + 1e-12)
        low = np.where(line.sound, np.nextafter(low, -np.inf), -np.inf)
        slack = slacks(layout, items, own, pairs, found, np.nan_to_num(a))
        start = np.where(line.sound, line.start.hi, np.inf)
        return _Pairs(box, station, start, low, a[1:].T, loose, slack)

    def _bounds(self, found: _Pairs, half: Array) -> tuple[Any, ...]:
        """Return the line of every box, by its most dangerous station, and the thresholds of all pairs."""
        count = len(half)
        order = np.argsort(-found.start, kind="stable")
        best = np.full(count, -1)
        best[found.box[order]] = order
        have = best >= 0
        a = np.where(have[:, None], found.a[best] if len(found.box) else 0.0, 0.0)
        low = np.where(have, found.low[best] if len(found.box) else 0.0, -np.inf)
        loose = np.where(have[:, None], found.loose[best] if len(found.box) else 0.0, 0.0)
        return a, low, loose, *thresholds(found.slack, a[found.box], half[found.box])

    def _worth(self, found: _Pairs, bounds: tuple[Any, ...]) -> NDArray[np.bool_]:
        """Tell the pairs whose station is too wide for their box, and cut those stations."""
        c, low, item, v = bounds
        gap = c - low[found.box]
        rows = np.arange(len(c))
        most = np.full(len(low), -np.inf)
        np.maximum.at(most, found.box, gap)
        curved = found.slack.curved[rows, item]
        with np.errstate(all="ignore"):
            wide = np.where(
                c == np.inf, curved[:, 0] > curved[:, 1:].max(axis=1, initial=0.0), v * curved[:, 0] > _SHARE * gap
            )
            wide &= (gap > _SHARE * most[found.box]) | (gap == np.inf)
        wide &= (gap > 0.0) & (c > -np.inf)
        self.stations.cut(np.unique(found.station[wide]))
        can = np.array([k in self.stations.children for k in found.station.tolist()], dtype=np.bool_)
        return np.asarray(wide & can)


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
