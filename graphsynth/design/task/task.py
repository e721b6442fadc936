"""A task: what a mechanism shall do, and what is given, bounded or wished."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

from graphsynth.core.angles import Kept, angle, optional
from graphsynth.core.checks import choice, finite, positive, whole
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.design.task.places import Box, Place, Point, box, limits, place
from graphsynth.design.task.targets import DwellTarget, LinkTarget, PathTarget, PosesTarget, SwingTarget, Target

Drive = Literal["rotation", "rocking", "cylinder", "slide"]
#: How the driven link turns: counter-clockwise is positive.
Turning = Literal["either", "counter-clockwise", "clockwise"]
_SENSES = {"either": 0, "counter-clockwise": 1, "clockwise": -1}
#: Lengths of links unless they are given, in sizes of the task.
_SHORT, _LONG = 0.1, 6.0
#: Least span of a rocking drive, and the largest misalignment for which tilts are small.
_LEAST, _MOST = 1e-3, 0.5
#: Bounds that may be wishes.
SOFT = ("transmission", "length_ratio", "lengths", "box")
#: What answers are ranked by, and how much each counts: errors in tolerances, links, size of the task, radians,
#: the margin of binding (at most 4).
RANKED = {"error": 1.0, "links": 0.05, "size": 0.02, "transmission": 0.1, "jam": 0.05}


def _start(name: str, given: float | str | Sequence[float | str] | None) -> tuple[float, float] | None:
    """Read one direction, or two limits; None is kept."""
    if given is None:
        return None
    limits = (given, given) if isinstance(given, float | int | str) else tuple(given)
    if len(limits) != 2:
        raise GeometryError(f"{name} = {given!r} must be one angle, or two: the limits")
    low, high = (angle(name, value) for value in limits)
    if not low <= high <= low + math.tau:
        raise GeometryError(f"{name} = {given!r}: the second limit must not be below the first, nor a turn beyond it")
    return low, high


def _plate(name: str, sides: Sequence[float]) -> tuple[float, float, float]:
    """Read the three sides of a triangle, which may be flat."""
    try:
        a, b, c = (positive(f"{name}[{k}]", side) for k, side in enumerate(sides))
    except (TypeError, ValueError):
        raise GeometryError(f"{name} = {sides!r} must be three distances of its holes: 1-2, 2-3, 3-1") from None
    if 2.0 * max(a, b, c) > (a + b + c) * (1.0 + 1e-9):
        raise GeometryError(f"{name} = {sides!r}: no side of a triangle is longer than both others; correct them")
    return a, b, c


Start = Kept[float | str | Sequence[float | str] | None, tuple[float, float] | None]


@dataclass(frozen=True, kw_only=True, repr=False)
class DesignTask(Shown):
    """Targets, all in one set of coordinates, and bounds that every answer keeps.

    `GeometryError` for bounds that contradict themselves.

    Parameters
    ----------
    targets : sequence of PathTarget, PosesTarget, FunctionTarget, DwellTarget or SwingTarget
        Several at once: one frame, one drive.
    drive : {"rotation", "rocking", "cylinder", "slide"}
        A link on the frame that turns fully, or by ``span``; a cylinder between any two links; a slide on the frame.
    span : float or str
        Of a rocking drive, radians or a text such as "90 deg".
    stroke : (float, float), optional
        Limits of the stroke of a cylinder or slide; free by default.
    links : sequence of int
        Numbers of links that are allowed; fewer links are tried first.
    sliders : int
        Most prismatic joints, the drive not counted.
    dyads_only : bool
        Only mechanisms that are assembled dyad by dyad, none with a larger structural group.
    pivots : sequence of (x, y) or (x0, y0, x1, y1)
        Given revolute joints on the frame, each at a place or in a region; a chain may have more of them.  Which link
        turns there, the search finds out; `drive_pivot` and the ``pivot`` of a target say it.
    drive_pivot : (x, y) or (x0, y0, x1, y1), optional
        Where the driven link turns on the frame, or the foot of the cylinder.
    pivot_region, box : (x0, y0, x1, y1), optional
        Where all joints on the frame lie; where all joints and named points stay over the whole motion.
    lengths : (float, float), optional
        Shortest and longest distance of two revolute joints on a link; by default 0.1 and 6 sizes of the task, further
        if links are given.  A point is no nearer to a joint than the shortest, if other links would do nothing there.
    crank : float, optional
        Given length of the driven link.
    crank_start : float, str or a pair of them, optional
        Direction of the driven link at the input 0, from its pivot to its (first) other joint: given, or between two
        limits, counter-clockwise.
    crank_from : {"x", "frame"}
        Whether it is measured from the x axis or from the line to the other pivot on the frame (four links).
    turning : {"either", "counter-clockwise", "clockwise"}
        How the driven link turns.
    symmetric : bool
        The point draws a curve with an axis of symmetry.  Of four links: the point and the crank pin and the pivot of
        the follower are equally far from the joint of coupler and follower (lambda-type linkages).  Of more, eight if a
        point is named: at the input 0 the mechanism is its own mirror image, a point that draws is a joint on the axis.
    bars : sequence of float
        Lengths of bars that are there and shall be used: each is a distance of two joints on a moving link.
    plates : sequence of (float, float, float)
        Links with three holes that are there and shall be used: distances of the first from the second, of the second
        from the third, of the third from the first.  Each hole takes a joint or the named point of a path or of poses;
        either side may be up, and the link may have more joints than these.
    length_ratio : float
        Longest over shortest of these distances; those of points from the joints of their link count as long ones.
    transmission : float or str
        Smallest transmission angle over the motion.
    misalignment, joint_tilt : float or str, optional
        Tilt of the driver's axis that must not make the joints bind, and that which every joint takes up (0.3 degrees).
    soft : mapping of str to float
        Bounds that are wishes, of "transmission", "length_ratio", "lengths", "box", each with its weight: a hundredth
        by which one is broken (of a radian, of a length, of the size of the task) counts as much as so many tolerances
        of a target with the weight 1.
    rank : mapping of str to float
        What counts how much in the ranking, beside the defaults: "error", "links", "size", "transmission", "jam".

    Examples
    --------
    >>> task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], pivots=[(1, -3)])
    >>> task.links, task.size
    ((4, 6), 2.0)
    """

    targets: Sequence[Target]
    drive: Drive = "rotation"
    span: Kept[float | str, float] = Kept(angle, math.tau)
    stroke: tuple[float, float] | None = None
    links: Sequence[int] = (4, 6)
    sliders: int = 0
    dyads_only: bool = False
    pivots: Sequence[Place] = ()
    drive_pivot: Place | None = None
    pivot_region: Box | None = None
    box: Box | None = None
    lengths: tuple[float, float] | None = None
    crank: float | None = None
    crank_start: Start = Kept(_start, None)
    crank_from: Literal["x", "frame"] = "x"
    turning: Turning = "either"
    symmetric: bool = False
    bars: Sequence[float] = ()
    plates: Sequence[tuple[float, float, float]] = ()
    length_ratio: float = 8.0
    transmission: Kept[float | str, float] = Kept(angle, math.radians(25.0))
    misalignment: Kept[float | str | None, float | None] = Kept(optional(angle), None)
    joint_tilt: Kept[float | str, float] = Kept(angle, math.radians(0.3))
    soft: Mapping[str, float] = field(default_factory=dict)
    rank: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        targets = tuple(self.targets)
        if not targets or not all(isinstance(target, Target) for target in targets):
            raise GeometryError(f"targets = {self.targets!r} must be one or more targets, such as a PathTarget")
        put(self, "targets", targets)
        choice("drive", self.drive, ("rotation", "rocking", "cylinder", "slide"))
        span = 1.0 if self.linear else positive("span", self.span)
        if not _LEAST <= span <= math.tau or (self.drive == "rotation" and span < math.tau):
            raise GeometryError(
                f"span = {span:.6g} must be {_LEAST:g} to 2 pi, and a turn for a rotation; use drive 'rocking'"
            )
        put(self, "span", span)
        if self.stroke is not None:
            put(self, "stroke", limits("stroke", self.stroke))
            if not self.linear:
                raise GeometryError(f"stroke = {self.stroke} is that of a cylinder or slide; drive is {self.drive!r}")
        put(self, "links", tuple(sorted({whole("links", n, 4, 10) for n in self.links})))
        if not self.links or any(n % 2 for n in self.links):
            raise GeometryError(f"links = {self.links} must be even numbers, 4 to 10: others have not one freedom")
        whole("sliders", self.sliders, 0, 3)
        put(self, "pivots", tuple(place(f"pivots[{k}]", p) for k, p in enumerate(self.pivots)))
        if len(set(self.pivots)) < len(self.pivots):
            raise GeometryError(f"pivots = {self.pivots} repeat; give each once")
        if self.drive_pivot is not None:
            put(self, "drive_pivot", place("drive_pivot", self.drive_pivot))
            if self.drive == "slide":
                raise GeometryError("a slide on the frame has no pivot; leave drive_pivot out")
        for name in ("pivot_region", "box"):
            if getattr(self, name) is not None:
                put(self, name, box(name, getattr(self, name)))
        if self.lengths is not None:
            put(self, "lengths", limits("lengths", self.lengths))
        if self.crank is not None:
            positive("crank", self.crank)
        self._shaped()
        put(self, "bars", tuple(positive(f"bars[{k}]", bar) for k, bar in enumerate(self.bars)))
        put(self, "plates", tuple(_plate(f"plates[{k}]", plate) for k, plate in enumerate(self.plates)))
        if self.lengths is None:
            sizes = [self.size, *(math.dist(p, q) for p, q in combinations(self.given_pivots, 2))]
            put(self, "lengths", (min([_SHORT * min(sizes), *self.given]), max([_LONG * max(sizes), *self.given])))
        if self.plates and max(self.links) < 6 and not any(self.names.values()):
            raise GeometryError(
                "no link of four-bars but the frame has three joints; allow six links for plates, or name a point"
            )
        for name in ("misalignment", "joint_tilt"):
            if (tilt := getattr(self, name)) is not None and positive(name, tilt) > _MOST:
                raise GeometryError(f"{name} = {tilt:.6g} is no small tilt; give at most {_MOST:g} rad")
        if self.misalignment is not None and self.linear:
            raise GeometryError("misalignment is that of an axis that is driven; a linear drive has none: leave it out")
        if finite("length_ratio", self.length_ratio) < 1.0:
            raise GeometryError(f"length_ratio = {self.length_ratio} must be 1 or more")
        if not 0.0 <= self.transmission < 0.5 * math.pi:
            raise GeometryError(f"transmission = {self.transmission:.6g} must lie in [0, pi/2); give radians")
        for name, value in self.soft.items():
            choice("soft", name, SOFT)
            positive(f"soft[{name!r}]", value)
        for name, value in self.rank.items():
            choice("rank", name, tuple(RANKED))
            finite(f"rank[{name!r}]", value)
        put(self, "rank", {**RANKED, **self.rank})
        for name in self.sliding:
            own = [t for t in targets if name in (getattr(t, "link", ""), getattr(t, "point", ""))]
            if not all(getattr(t, "slides", False) for t in own if not getattr(t, "base", "")):
                raise GeometryError(f"link {name!r} slides for one target and turns for another; name two links")
        if any(getattr(target, "slides", False) for target in targets) and not self.sliders:
            raise GeometryError("a link slides, but sliders = 0; allow one or more")
        for target in targets:
            inputs = getattr(target, "inputs", None) or (0.0,)
            if isinstance(target, DwellTarget):
                inputs = (target.start or 0.0, (target.start or 0.0) + target.span)
            for u in (inputs[0], inputs[-1]):
                if self.drive != "rotation" and not -1e-9 <= u <= span + 1e-9:
                    raise GeometryError(f"a target has an input of {u:.6g}, but the drive goes from 0 to {span:.6g}")
            if isinstance(target, SwingTarget) and target.time_ratio is not None and self.drive != "rotation":
                raise GeometryError("a time ratio needs a drive that turns fully; use drive = 'rotation'")

    def _shaped(self) -> None:
        """Check the words that speak of the crank and of the shape of a curve."""
        choice("crank_from", self.crank_from, ("x", "frame"))
        choice("turning", self.turning, tuple(_SENSES))
        four = self.links == (4,) and not self.sliders
        if self.linear and (self.crank_start is not None or self.turning != "either"):
            raise GeometryError("a linear drive has no crank; leave crank_start and turning out")
        if self.crank_start is not None and self.crank_from == "frame" and not four:
            raise GeometryError("a direction from the frame's line needs four links that turn; use links = [4]")
        points = {target.point for target in self.targets if isinstance(target, PathTarget | PosesTarget)}
        if self.mirrored:
            fits = self.drive == "rotation" and not self.sliders and self.links[0] >= (8 if points else 6)
        else:
            fits = four and not self.linear and len(points) == 1
        if self.symmetric and not fits:
            raise GeometryError(
                f"symmetric, links = {list(self.links)}, drive {self.drive!r}, sliders = {self.sliders}: a symmetric "
                "curve is that of one point of four links, links = [4], or of eight or more; from six a mechanism may "
                "be its own mirror image, if its drive turns fully; leave out sliders and linear drives"
            )

    @property
    def sense(self) -> int:
        """1 if the driven link turns counter-clockwise, -1 clockwise, 0 if either will do."""
        return _SENSES[self.turning]

    @property
    def mirrored(self) -> bool:
        """Whether the whole mechanism is to be its own mirror image; of four links only the curve can be."""
        return self.symmetric and self.links != (4,)

    @property
    def symmetric_point(self) -> str:
        """Name of the point that draws a symmetric curve."""
        return next(target.point for target in self.targets if isinstance(target, PathTarget | PosesTarget))

    @property
    def every_pivot(self) -> tuple[Place, ...]:
        """Places and regions of joints on the frame, whoever has them, each once."""
        named = (self.drive_pivot, *(getattr(target, "pivot", None) for target in self.targets))
        return tuple(dict.fromkeys(p for p in (*self.pivots, *named) if p is not None))

    @property
    def given_pivots(self) -> tuple[Point, ...]:
        """Those of `every_pivot` that are places."""
        return tuple(p for p in self.every_pivot if len(p) == 2)

    @property
    def given(self) -> tuple[float, ...]:
        """Lengths that are given: those of the crank, of bars and of sides of plates."""
        return *((self.crank,) if self.crank else ()), *self.bars, *(side for plate in self.plates for side in plate)

    @property
    def linear(self) -> bool:
        """Whether the drive pushes; then inputs are parts of its stroke."""
        return self.drive in ("cylinder", "slide")

    @property
    def size(self) -> float:
        """Length by which the task is measured: of its largest path, or the next that it names.

        The largest distance of given pivots or stroke of a slider; a given link or the stroke of the drive; half of
        the box; 1 of a task that knows no length.
        """
        sizes = [target.size for target in self.targets if isinstance(target, PathTarget | PosesTarget)]
        apart = [math.dist(p, q) for p, q in combinations(self.given_pivots, 2)]
        apart += [target.size for target in self.targets if isinstance(target, LinkTarget)]
        given = [*self.given, *([self.stroke[1]] if self.linear and self.stroke else [])]
        box = (0.5 * min(self.box[2] - self.box[0], self.box[3] - self.box[1]),) if self.box else ()
        return next((found for some in (sizes, apart, given, box) if (found := max(some, default=0.0))), 1.0)

    @property
    def sized(self) -> bool:
        """Whether the task knows a length: else a mechanism does it in any size."""
        lengths = any(isinstance(t, PathTarget | PosesTarget) or getattr(t, "slides", False) for t in self.targets)
        given = self.every_pivot, self.bars, self.plates, self.crank, self.box, self.pivot_region, self.stroke
        return lengths or any(given)

    @property
    def names(self) -> dict[str, bool]:
        """Names of the points and links the targets speak of, in their order; true of points."""
        found: dict[str, bool] = {}
        for target in self.targets:
            name = str(getattr(target, "point", "") or getattr(target, "link", ""))
            found[name] = found.get(name, False) or hasattr(target, "point")
            if base := str(getattr(target, "base", "")):
                found.setdefault(base, False)
        return found

    @property
    def sliding(self) -> set[str]:
        """Names of the links that slide on the frame."""
        return {own.link for own in self.targets if isinstance(own, LinkTarget) and own.slides and not own.base}

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(type(t).__name__, f"tolerance {t.tolerance:g}, weight {t.weight:g}") for t in self.targets]
        return f"Task: {self.drive}, {' or '.join(map(str, self.links))} links", rows
