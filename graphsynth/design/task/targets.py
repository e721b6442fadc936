"""What a mechanism shall do: paths of points, poses and angles of links, dwells, strokes.

Targets name what they speak of: ``point`` a point of some link, ``link`` a link.  Targets with the same name speak of
the same point or link; which link of a chain it is, the search finds out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.angles import Kept, angle, angles, listed, optional
from graphsynth.core.checks import finite, point, positive, whole
from graphsynth.core.errors import GeometryError
from graphsynth.design.task.places import Place, Point, place

#: Place and angle.
Pose = tuple[float, float, float]
#: Angles or parts of a stroke, if any; type checkers forget what is kept of a frozen field that is inherited.
Inputs = Kept[Sequence[float | str] | None, tuple[float, ...] | None]
#: An angle, of sliders a length.
Tolerance = Kept[float | str, float]
#: Points of a curve that is given as a whole: a segment, an arc, a drawing.
_COUNT = 48
#: Part of its range by which a function may differ at both ends and yet has the same value there.
_SAME = 1e-9
#: Points of an open path without times beyond which it is a curve.
_DENSE = 64
#: Most points, poses or values of a target.
MOST = 400


def _part(name: str, value: float | str) -> float:
    """Read a part of a size."""
    if isinstance(value, str):
        raise GeometryError(f"{name} = {value!r} of a path or of poses is a part of their size; give a number")
    return positive(name, value)


def _within(name: str, value: float | str) -> float:
    """Read a positive angle or length."""
    return positive(name, angle(name, value))


@dataclass(frozen=True, kw_only=True)
class Target:
    """What every target has.

    Parameters
    ----------
    tolerance : float or str
        Largest error with which the target counts as met: of paths and poses a part of their size, else radians or a
        text such as "4 deg", of sliders a length.
    weight : float
        Weight among several targets.
    """

    tolerance: Tolerance = Kept(_part, 0.01)
    weight: float = 1.0

    def __post_init__(self) -> None:
        positive("weight", self.weight)
        if "" in (getattr(self, "point", None), getattr(self, "link", None)):
            raise GeometryError(f"a {type(self).__name__} has an empty name; name its point or link")

    @property
    def unknowns(self) -> int:
        """How many numbers it adds to those of a mechanism: its start, the zero of its angles."""
        return 0

    @property
    def shared_inputs(self) -> Sequence[float]:
        """Inputs, from the start that all targets share, at which it is looked at."""
        return ()


@dataclass(frozen=True, kw_only=True)
class TimedTarget(Target):
    """A target that may say at which inputs of the driver it is met.

    Parameters
    ----------
    inputs : sequence of float or str, optional
        Inputs of the driver, increasing: radians or texts such as "30 deg" of a rotation, parts 0 to 1 of a stroke.
    own_start : bool
        The inputs count from a start of their own, which is free; else from the start that all targets share.
    """

    inputs: Inputs = Kept(optional(listed), None)
    own_start: bool = False

    @property
    def unknowns(self) -> int:
        """One for a start of its own."""
        return int(self.own_start and self.inputs is not None)

    @property
    def shared_inputs(self) -> Sequence[float]:
        """The inputs, unless they have a start of their own."""
        return () if self.own_start or self.inputs is None else self.inputs

    def _time(self, count: int) -> None:
        """Check and keep the inputs of a target with so many values."""
        if self.inputs is None:
            return
        found = self.inputs
        if len(found) != count:
            raise GeometryError(f"the target has {count} values but {len(found)} inputs; give one input for each")
        if any(b <= a for a, b in pairwise(found)) or found[-1] - found[0] > math.tau + 1e-12:
            raise GeometryError("inputs must increase, over at most one turn, 2 pi; sort them and remove duplicates")


@dataclass(frozen=True, kw_only=True)
class PathTarget(TimedTarget):
    """A point passes given points, in order.

    `GeometryError` for fewer than two points, or all at one place.

    Parameters
    ----------
    points : sequence of (x, y)
    closed : bool
        Without inputs: the last point is followed by the first, and the path is the whole curve, which nowhere leaves
        its polygon by more than a smooth curve through the points would (twice the sagitta, a fifth of a side at most);
        where the polygon turns by more than 69 degrees it has a corner.
    point : str
        Name of the point.
    mean : bool
        The tolerance is that of the root mean square of the distances from the points, as much of the literature has
        it, not of the largest one; not of a closed path without inputs.

    Examples
    --------
    >>> PathTarget.segment((0, 0), (2, 0), count=3).points
    ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))
    """

    points: Sequence[Point]
    inputs: Inputs = Kept(optional(listed), None)
    closed: bool = False
    point: str = "P"
    tolerance: Tolerance = Kept(_part, 0.01)
    mean: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mean and self.outline:
            raise GeometryError("mean = True is for points, a closed path is a whole curve; leave one of both out")
        places = tuple(point(f"points[{k}]", p) for k, p in enumerate(self.points))
        if not 2 <= len(places) <= MOST or len(set(places)) < 2:
            raise GeometryError(f"a path needs 2 to {MOST} points that do not all coincide; it has {len(places)}")
        object.__setattr__(self, "points", places)
        self._time(len(places))

    @property
    def outline(self) -> bool:
        """Whether it is a whole curve, however fast it is run through."""
        return self.closed and self.inputs is None

    @property
    def drawn(self) -> bool:
        """Whether it is an outline, or an open path of so many points that they tell where it goes between them."""
        return self.inputs is None and (self.closed or len(self.points) > _DENSE)

    @property
    def goal(self) -> NDArray[np.complex128]:
        """The points as complex numbers."""
        return np.array([complex(*p) for p in self.points])

    @property
    def size(self) -> float:
        """Largest distance of a point from their mean."""
        return float(np.abs(self.goal - self.goal.mean()).max())

    @classmethod
    def segment(cls, start: Point, end: Point, *, count: int = _COUNT, **more: Any) -> Self:
        """Return a straight segment; with ``inputs`` of its two ends it is passed at a constant velocity."""
        first, last = complex(*point("start", start)), complex(*point("end", end))
        return cls._drawn(first + (last - first) * np.linspace(0.0, 1.0, whole("count", count, 2, MOST)), more)

    @classmethod
    def polyline(cls, corners: Sequence[Point], *, count: int = _COUNT, **more: Any) -> Self:
        """Return a line from corner to corner, in points of equal distance along it, ``closed`` or not."""
        z = np.array([complex(*point(f"corners[{k}]", p)) for k, p in enumerate(corners)])
        closed = bool(more.get("closed")) and z[0] != z[-1]
        z = np.append(z, z[0]) if closed else z
        return cls._drawn(evenly(z, whole("count", count, 2, MOST), bool(more.get("closed"))), more)

    @classmethod
    def arc(
        cls, centre: Point, radius: float, start: float | str, end: float | str, *, count: int = _COUNT, **more: Any
    ) -> Self:
        """Return an arc of a circle between two directions; with ``inputs`` of its ends at a constant speed."""
        turn = np.linspace(angle("start", start), angle("end", end), whole("count", count, 2, MOST))
        return cls._drawn(complex(*point("centre", centre)) + positive("radius", radius) * np.exp(1j * turn), more)

    @classmethod
    def svg(cls, data: str, *, count: int = _COUNT, **more: Any) -> Self:
        """Return the first curve of SVG path data, in points of equal distance along it; y turned up.

        A curve that ends where it began, or with Z, is closed unless ``closed`` says otherwise.
        """
        curve = _read_svg(data)
        ends = abs(curve[0] - curve[-1]) < 1e-9 * np.abs(curve - curve.mean()).max()
        closed = bool(more.setdefault("closed", bool(ends)))
        return cls._drawn(evenly(curve, whole("count", count, 2, MOST), closed and bool(ends)), more)

    @classmethod
    def _drawn(cls, z: NDArray[Any], more: dict[str, Any]) -> Self:
        ends = more.get("inputs")
        if ends is not None and len(ends) == 2:  # of both ends
            start, end = angles("inputs", list(ends)).tolist()
            more["inputs"] = np.linspace(start, end, len(z)).tolist()
        return cls(points=[(p.real, p.imag) for p in z.tolist()], **more)


def evenly(z: NDArray[np.complex128], count: int, closed: bool) -> NDArray[np.complex128]:
    """Return points of equal distance along a polyline; of a closed one, whose ends meet, the last is left out."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
    at = np.linspace(0.0, along[-1], count + closed)[:count]
    return np.asarray(np.interp(at, along, z.real) + 1j * np.interp(at, along, z.imag))


def _read_svg(data: str, fine: int = 64) -> NDArray[np.complex128]:
    """Return the first sub-path of SVG path data as a fine polyline."""
    from fontTools.pens.recordingPen import RecordingPen
    from fontTools.svgLib.path import parse_path

    pen = RecordingPen()
    try:
        parse_path(data, pen)
    except Exception as error:  # the reader raises whatever its grammar meets
        raise GeometryError(
            f"SVG path data {data[:40]!r} cannot be read ({error}); give the text of an attribute d"
        ) from None
    z: list[complex] = []
    t = np.linspace(0.0, 1.0, fine + 1)[1:]
    for kind, given in pen.value:
        if (kind == "moveTo" and z) or kind in ("closePath", "endPath"):
            z += z[:1] if kind == "closePath" and z[-1] != z[0] else []
            break
        ends = [complex(*p) for p in given]
        if kind in ("moveTo", "lineTo"):
            z += ends
        elif kind == "curveTo":
            a, b, c, d = z[-1], *ends
            z += ((1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t * t * c + t**3 * d).tolist()
        else:  # one or more quadratic curves with the points between them implied
            implied = [(p + q) / 2 for p, q in pairwise(ends[:-1])]
            for b, d in zip(ends[:-1], [*implied, ends[-1]]):
                z += ((1 - t) ** 2 * z[-1] + 2 * (1 - t) * t * b + t * t * d).tolist()
    if len(z) < 2:  # a curve has two ends
        raise GeometryError(f"SVG path data {data[:40]!r} draws nothing; give M and at least one more command")
    return np.array([w.conjugate() for w in z])


def _poses(name: str, given: Sequence[tuple[float, float, float | str]]) -> tuple[Pose, ...]:
    """Read poses: places, and angles as numbers or texts."""
    return tuple((*point(f"{name}[{k}]", (p[0], p[1])), angle(f"{name}[{k}]", p[2])) for k, p in enumerate(given))


@dataclass(frozen=True, kw_only=True)
class PosesTarget(TimedTarget):
    """A link passes poses, in order (motion generation).

    `GeometryError` for fewer than two or more than 400 poses.

    Parameters
    ----------
    poses : sequence of (x, y, theta)
        Places of one point of the link, and angles of the link, radians or texts such as "30 deg"; the line on the link
        from which they are measured is free.
    point : str
        Name of the point.
    """

    poses: Kept[Sequence[tuple[float, float, float | str]], tuple[Pose, ...]] = Kept(_poses)
    inputs: Inputs = Kept(optional(listed), None)
    point: str = "P"
    tolerance: Tolerance = Kept(_part, 0.01)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2 <= len(self.poses) <= MOST or len(set(self.poses)) < 2:
            raise GeometryError(f"a motion needs 2 to {MOST} poses that are not all the same; it has {len(self.poses)}")
        self._time(len(self.poses))

    @property
    def unknowns(self) -> int:
        """One for the zero of the angles, one for a start of its own."""
        return 1 + super().unknowns

    @property
    def goal(self) -> NDArray[np.complex128]:
        """The places as complex numbers."""
        return np.array([complex(x, y) for x, y, _ in self.poses])

    @property
    def turn(self) -> NDArray[np.float64]:
        """The angles, from the first."""
        return np.array([theta - self.poses[0][2] for _, _, theta in self.poses])

    @property
    def size(self) -> float:
        """Largest distance of a place from their mean; angles count as arcs of it."""
        return float(np.abs(self.goal - self.goal.mean()).max()) or 1.0


@dataclass(frozen=True, kw_only=True)
class LinkTarget(Target):
    """A target of a link that is jointed to the frame, or to another named link: see `FunctionTarget`."""

    link: str = "output"
    base: str = ""
    slides: bool = False
    pivot: Place | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base and (self.base == self.link or self.pivot is not None):
            raise GeometryError(f"link {self.link!r} moves against {self.base!r}: name two links, and leave pivot out")
        if self.pivot is not None and self.slides:
            raise GeometryError(f"link {self.link!r} slides and has no pivot; leave slides or pivot out")
        if self.pivot is not None:
            object.__setattr__(self, "pivot", place("pivot", self.pivot))

    @property
    def size(self) -> float:
        """How far a slider goes; 0 where that is not said."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class FunctionTarget(LinkTarget, TimedTarget):
    """The angle of a link is a function of the input; of a slider its place.  Only differences count.

    Parameters
    ----------
    outputs : sequence of float or str
        At the inputs, which must be given: radians or texts such as "30 deg"; lengths of a slider.
    link : str
        Name of the output link, which is jointed to the frame.
    base : str
        Name of the link to which it is jointed instead: then the outputs are those of this joint.
    slides : bool
        It slides there: outputs and tolerance are lengths.
    pivot : (x, y) or (x0, y0, x1, y1), optional
        Where its joint on the frame is: a place, or a region.
    """

    outputs: Kept[Sequence[float | str], tuple[float, ...]] = Kept(listed)
    inputs: Inputs = Kept(optional(listed), None)
    tolerance: Tolerance = Kept(_within, 0.01)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inputs is None:
            raise GeometryError("a function needs inputs; give one for each output")
        self._time(len(self.outputs))

    @property
    def unknowns(self) -> int:
        """One for the zero of the outputs, one for a start of its own."""
        return 1 + super().unknowns

    @property
    def size(self) -> float:
        """How far a slider goes; 0 of a link that turns."""
        return float(np.ptp(self.outputs)) if self.slides else 0.0

    @classmethod
    def of(
        cls,
        function: Callable[[NDArray[np.float64]], NDArray[np.float64]],
        between: tuple[float, float],
        *,
        input_range: float | str,
        output_range: float | str,
        count: int = 25,
        **more: Any,
    ) -> Self:
        """Return a function y(x) between two x, drawn out over ranges of input and output.

        The output goes through its range from the first to the last y; if these are the same, as of a period, between
        the least and the largest.  `GeometryError` for a function that is not finite there, or constant.

        >>> FunctionTarget.of(np.log10, (1, 2), input_range="60 deg", output_range="90 deg", count=3).inputs[1]
        0.5235987755982988
        """
        first, last = (finite(f"between[{k}]", value) for k, value in enumerate(between))
        y = np.asarray(function(np.linspace(first, last, whole("count", count, 3, MOST))))
        if not np.isfinite(y).all() or not np.ptp(y) > 0.0:
            raise GeometryError(f"the function must be finite and not constant in {between}; choose other ends")
        whole_range = y[-1] - y[0] if abs(y[-1] - y[0]) > _SAME * np.ptp(y) else np.ptp(y)
        span, reach = angle("input_range", input_range), angle("output_range", output_range)
        return cls(
            inputs=np.linspace(0.0, span, len(y)).tolist(),
            outputs=(reach * (y - y[0]) / whole_range).tolist(),
            **more,
        )


@dataclass(frozen=True, kw_only=True)
class DwellTarget(LinkTarget):
    """A link stands still while the driver goes on; ``tolerance`` says how still, ``SwingTarget`` what it does else.

    Parameters
    ----------
    span : float or str
        How long: of the input.
    start : float or str, optional
        From where on; free by default.
    link, base, slides, pivot
        As of a function.
    """

    span: Kept[float | str, float] = Kept(angle)
    start: Kept[float | str | None, float | None] = Kept(optional(angle), None)
    tolerance: Tolerance = Kept(_within, 0.01)

    def __post_init__(self) -> None:
        super().__post_init__()
        if positive("span", self.span) > math.tau:
            raise GeometryError(
                f"span = {self.span:.6g} is longer than a turn, 2 pi; give the part of it that is to be still"
            )

    @property
    def unknowns(self) -> int:
        """One for the output, one for where it begins."""
        return 1 + (self.start is None)


def _limit(name: str, value: float | str) -> float:
    """Read an angle or length, which may be infinite."""
    return math.inf if value == math.inf else angle(name, value)


@dataclass(frozen=True, kw_only=True)
class SwingTarget(LinkTarget):
    """A link swings to and fro: how far, and how much longer one way than the other.

    Parameters
    ----------
    least, most : float or str
        Limits of the stroke: radians or texts such as "30 deg", lengths of a slider.
    time_ratio : float, optional
        Time of the slow stroke over that of the quick one, at a constant speed of the driver (full rotation).  The
        slow stroke may be longer or shorter by the tolerance in radians of the input, of a slider over the stroke.
    link, base, slides, pivot
        As of a function.
    """

    least: Kept[float | str, float] = Kept(angle, 0.0)
    most: Kept[float | str, float] = Kept(_limit, math.inf)
    time_ratio: float | None = None
    tolerance: Tolerance = Kept(_within, 0.01)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.least <= self.most or self.most <= 0.0:
            told = (f"{x:.6g}" + ("" if self.slides else f" ({math.degrees(x):.6g}°)") for x in (self.least, self.most))
            raise GeometryError("least = {} and most = {} must be 0 <= least <= most; correct them".format(*told))
        if self.time_ratio is not None and not 1.0 <= finite("time_ratio", self.time_ratio) <= 20.0:
            raise GeometryError(f"time_ratio = {self.time_ratio} must lie in 1 to 20: slow over quick")

    @property
    def unknowns(self) -> int:
        """One for the beginning of the slow stroke."""
        return int(self.time_ratio is not None)

    @property
    def size(self) -> float:
        """How far a slider goes, at least if that is said; 0 of a link that turns."""
        return (self.least or (self.most if math.isfinite(self.most) else 0.0)) if self.slides else 0.0
