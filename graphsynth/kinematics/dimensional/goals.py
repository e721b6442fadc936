"""What an embodiment shall achieve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite, point, positive
from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterable

Array = NDArray[np.float64]


def _link(name: str, value: int | None) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
        raise GeometryError(f"{name} = {value!r} is not a link; give its number, 0 or more")


def _numbers(name: str, values: Iterable[float], least: int) -> tuple[float, ...]:
    try:
        found = tuple(finite(f"{name}[{k}]", value) for k, value in enumerate(values))
    except TypeError as error:
        raise GeometryError(f"{name} = {values!r} is not a list of numbers") from error
    if len(found) < least:
        raise GeometryError(f"{name} has {len(found)} entries; give at least {least}")
    return found


def _listed(name: str, values: Any) -> tuple[Any, ...]:
    try:
        return tuple(values)
    except TypeError as error:
        raise GeometryError(f"{name} = {values!r} is not a list; give one") from error


def _rising(name: str, values: tuple[float, ...]) -> tuple[float, ...]:
    if any(b <= a for a, b in pairwise(values)):
        raise GeometryError(f"{name} must increase strictly; sort the list and remove duplicates")
    return values


@dataclass(frozen=True)
class LineGoal:
    """A point of a link draws a straight segment, as straight as can be, during part of the turn.

    Parameters
    ----------
    length : float
        Length of the segment in lengths of the crank (distance of the crank's two joints).
    span : float
        Part of the turn in which the segment is drawn, radians.
    link : int, optional
        The link that carries the point; by default the one farthest from the frame.
    on_bar : bool
        The point is to lie on the line through the link's first two joints: the link is a straight rod.
    tolerance : float
        Largest width of the strip that holds the segment, over its length.

    Raises
    ------
    GeometryError
        A span outside (0, 2 pi], or numbers that are not finite.
    """

    length: float
    span: float = math.pi
    link: int | None = None
    on_bar: bool = False
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        positive("length", self.length)
        positive("tolerance", self.tolerance)
        if not 0.0 < finite("span", self.span) <= math.tau:
            raise GeometryError(f"span = {self.span} must lie in (0, 2 pi]; give the part of the turn in radians")
        _link("link", self.link)


@dataclass(frozen=True)
class PathGoal:
    """A point of a link passes given points in order.

    Parameters
    ----------
    points : iterable of (x, y)
        At least three, in the order of the motion.
    inputs : iterable of float, optional
        Inputs at the points relative to the first, increasing, within the turn or range; timed path.  Without them
        only the order counts.
    link : int, optional
        The link that carries the point; by default the one farthest from the frame.
    tolerance : float
        Largest distance from a point, over the size of the set of points.

    Raises
    ------
    GeometryError
        Fewer than three points, or all at one place.
    """

    points: tuple[tuple[float, float], ...]
    inputs: tuple[float, ...] | None = None
    link: int | None = None
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        places = tuple(point(f"points[{k}]", p) for k, p in enumerate(_listed("points", self.points)))
        if len(places) < 3 or len(set(places)) < 2:
            raise GeometryError(f"a path needs three or more points that do not all coincide; it has {len(places)}")
        object.__setattr__(self, "points", places)
        _timed(self, len(places))
        positive("tolerance", self.tolerance)
        _link("link", self.link)


@dataclass(frozen=True)
class PosesGoal:
    """A link passes given poses in order (motion generation).

    Parameters
    ----------
    poses : iterable of (x, y, theta)
        At least three; place of one point of the link, the same in all poses, and the link's angle in radians.  The
        angle counts relative to the first: the line on the link from which it is measured is the designer's choice.
    inputs : iterable of float
        Inputs at the poses relative to the first, increasing.
    link : int, optional
        By default the link farthest from the frame.
    tolerance : float
        Largest distance from a pose over the size of the set of points; angles count as arcs of that size.

    Raises
    ------
    GeometryError
        Fewer than three poses, or inputs missing.
    """

    poses: tuple[tuple[float, float, float], ...]
    inputs: tuple[float, ...] | None = None
    link: int | None = None
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        rows = tuple(_numbers(f"poses[{k}]", pose, 3) for k, pose in enumerate(_listed("poses", self.poses)))
        if len(rows) < 3 or any(len(row) != 3 for row in rows):
            raise GeometryError("a poses goal needs three or more poses (x, y, theta)")
        object.__setattr__(self, "poses", rows)
        if self.inputs is None:
            raise GeometryError("a poses goal needs the inputs at which the poses are passed; give inputs")
        _timed(self, len(rows))
        positive("tolerance", self.tolerance)
        _link("link", self.link)


@dataclass(frozen=True)
class FunctionGoal:
    """The angle of a link on the frame is a given function of the input.

    Parameters
    ----------
    inputs, outputs : iterable of float
        Inputs relative to the first, increasing, and the output angles there, radians; at least three.
        The zero of the output scale is free: only differences of outputs count.
    link : int, optional
        The output link; by default the first link on the frame that is not driven.
    tolerance : float
        Largest error of the output, radians.
    """

    inputs: tuple[float, ...]
    outputs: tuple[float, ...]
    link: int | None = None
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", _numbers("outputs", self.outputs, 3))
        _timed(self, len(self.outputs))
        positive("tolerance", self.tolerance)
        _link("link", self.link)


def _timed(goal: PathGoal | PosesGoal | FunctionGoal, count: int) -> None:
    """Check and store the inputs of a goal, shifted to begin at 0."""
    if goal.inputs is None:
        return
    inputs = _rising("inputs", _numbers("inputs", goal.inputs, 1))
    if len(inputs) != count:
        raise GeometryError(f"the goal has {count} targets but {len(inputs)} inputs; give one input for each")
    object.__setattr__(goal, "inputs", tuple(value - inputs[0] for value in inputs))
    if inputs[-1] - inputs[0] > math.tau + 1e-12:
        raise GeometryError(f"inputs span {inputs[-1] - inputs[0]:.6g}, more than one turn; give at most 2 pi")


Target = LineGoal | PathGoal | PosesGoal | FunctionGoal


@dataclass(frozen=True)
class Goals:
    """What an embodiment shall achieve: bounds that every accepted result keeps, and at most one target.

    Parameters
    ----------
    span : float
        Range of the driver: 2 pi is a full turn (then the mechanism must close); shorter for a rocking driver, in
        radians, or the stroke of a sliding driver, in mean link lengths of the sketch.
    min_transmission_angle : float
        Smallest transmission angle of every bar over the range, radians.
    max_length_ratio : float
        Longest over shortest distance of two turning joints on one link, over all links, the frame included; the
        distances of a tracing point from the joints of its link count among the long ones.
    target : LineGoal, PathGoal, PosesGoal or FunctionGoal, optional

    Raises
    ------
    GeometryError
        A bound that nothing can satisfy, or a target of another type.

    Examples
    --------
    >>> Goals(min_transmission_angle=0.5).full_turn
    True
    """

    span: float = math.tau
    min_transmission_angle: float = math.radians(25.0)
    max_length_ratio: float = 6.0
    target: Target | None = None

    def __post_init__(self) -> None:
        positive("span", self.span)
        if not 0.0 <= finite("min_transmission_angle", self.min_transmission_angle) < 0.5 * math.pi:
            raise GeometryError(
                f"min_transmission_angle = {self.min_transmission_angle} must lie in [0, pi/2); give radians"
            )
        if finite("max_length_ratio", self.max_length_ratio) < 1.0:
            raise GeometryError(f"max_length_ratio = {self.max_length_ratio} must be 1 or more")
        if self.target is not None and not isinstance(self.target, Target):
            raise GeometryError(
                f"target = {self.target!r} is no goal; use LineGoal, PathGoal, PosesGoal or FunctionGoal"
            )
        needed = 0.0
        if isinstance(self.target, LineGoal):
            needed = self.target.span
        elif self.target is not None and self.target.inputs is not None:
            needed = self.target.inputs[-1]
        if needed > self.span + 1e-9:
            raise GeometryError(
                f"the target needs a range of {needed:.6g}, but span = {self.span:.6g}; give a larger span"
            )

    @property
    def full_turn(self) -> bool:
        """Whether the range is a full turn."""
        return abs(self.span - math.tau) <= 1e-12
