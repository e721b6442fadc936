"""What dimensions shall achieve, and by how much candidates miss it.

Every curve a link can draw is ``s z + q exp(i theta) + t``, so that s, q, t are not searched but solved for (variable
projection; docs/explanation/embodiment.md, "Targets").
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite, point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.dimensional.matching import Wanted

if TYPE_CHECKING:
    from collections.abc import Iterable

    from graphsynth.kinematics.dimensional.design import Design

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _check(target: Target) -> None:
    """Check tolerance and link, which every target has."""
    positive("tolerance", target.tolerance)
    link: Any = target.link
    if link is not None and (isinstance(link, bool) or not isinstance(link, int) or link < 0):
        raise GeometryError(f"link = {link!r} is not a link; give its number, 0 or more")


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


@dataclass(frozen=True)
class LineGoal:
    """A point of a link draws a straight segment, as straight as can be, during part of the turn.

    `GeometryError` for a span outside (0, 2 pi], or numbers that are not finite.

    Parameters
    ----------
    length : float
        Length of the segment in lengths of the crank (distance of the crank's two joints).
    span : float
        Part of the turn in which the segment is drawn, radians.
    link : int, optional
        The link that carries the point; the one farthest from the frame by default.
    on_bar : bool
        The point is to lie on the line through the link's first two joints: the link is a straight rod.
    tolerance : float
        Largest width of the strip that holds the segment, over its length.
    """

    length: float
    span: float = math.pi
    link: int | None = None
    on_bar: bool = False
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        positive("length", self.length)
        if not 0.0 < finite("span", self.span) <= math.tau:
            raise GeometryError(f"span = {self.span} must lie in (0, 2 pi]; give the part of the turn in radians")
        _check(self)


@dataclass(frozen=True)
class PathGoal:
    """A point of a link passes given points in order.

    `GeometryError` for fewer than three points, or all at one place.

    Parameters
    ----------
    points : iterable of (x, y)
        At least three, in the order of the motion.
    closed : bool
        Without inputs: the last point is followed by the first, and the path is the whole curve.
    inputs : iterable of float, optional
        Inputs at the points relative to the first, increasing, within the turn or range; else only the order counts.
    link : int, optional
        The link that carries the point; the one farthest from the frame by default.
    tolerance : float
        Largest distance from a point, over the size of the set of points.
    """

    points: tuple[tuple[float, float], ...]
    inputs: tuple[float, ...] | None = None
    link: int | None = None
    tolerance: float = 0.01
    closed: bool = False

    def __post_init__(self) -> None:
        places = tuple(point(f"points[{k}]", p) for k, p in enumerate(_listed("points", self.points)))
        if len(places) < 3 or len(set(places)) < 2:
            raise GeometryError(f"a path needs three or more points that do not all coincide; it has {len(places)}")
        object.__setattr__(self, "points", places)
        _timed(self, len(places))


@dataclass(frozen=True)
class PosesGoal:
    """A link passes given poses in order (motion generation).

    `GeometryError` for fewer than three poses.

    Parameters
    ----------
    poses : iterable of (x, y, theta)
        At least three; place of one point of the link, the same in all poses, and the link's angle in radians.  The
        angle counts relative to the first: the line on the link from which it is measured is the designer's choice.
    inputs : iterable of float, optional
        Inputs at the poses relative to the first, increasing; else only the order counts.
    link : int, optional
        By default the link farthest from the frame.
    tolerance : float
        Largest distance from a pose over the size of the set of points; angles count as arcs of that size.
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
        _timed(self, len(rows))


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


def _timed(goal: PathGoal | PosesGoal | FunctionGoal, count: int) -> None:
    """Check a goal, and store its inputs shifted to begin at 0."""
    _check(goal)
    if goal.inputs is None:
        return
    inputs = _numbers("inputs", goal.inputs, 1)
    if any(b <= a for a, b in pairwise(inputs)):
        raise GeometryError("inputs must increase strictly; sort the list and remove duplicates")
    if len(inputs) != count:
        raise GeometryError(f"the goal has {count} targets but {len(inputs)} inputs; give one input for each")
    object.__setattr__(goal, "inputs", tuple(value - inputs[0] for value in inputs))
    if inputs[-1] - inputs[0] > math.tau + 1e-12:
        raise GeometryError(f"inputs span {inputs[-1] - inputs[0]:.6g}, more than one turn; give at most 2 pi")


Target = LineGoal | PathGoal | PosesGoal | FunctionGoal


@dataclass(frozen=True)
class Goals:
    """What an embodiment shall achieve: bounds that every accepted result keeps, and at most one target.

    `GeometryError` for a bound that nothing can satisfy, or a target of another type.

    Parameters
    ----------
    span : float
        Range of the driver: 2 pi is a full turn (then the mechanism must close); shorter for a rocking driver, in
        radians, or the stroke of a prismatic driver, in mean link lengths of the sketch.
    min_transmission_angle : float
        Smallest transmission angle of every bar over the range, radians.
    max_length_ratio : float
        Longest over shortest distance of two revolute joints on one link, over all links, the frame included; the
        distances of a tracing point from the joints of its link count among the long ones.
    target : LineGoal, PathGoal, PosesGoal or FunctionGoal, optional
    symmetry : sequence of int, optional
        Image of every link under an automorphism that keeps the frame: at the first input a rotation carries the
        mechanism into itself so.  Without a target.
    mirrored : bool
        The mechanism is its own mirror image at the first input, and moves as its mirror image when the driver turns
        back: all links but the frame and the driven one exchange places in pairs.  Without a target.
    rates : sequence of float, optional
        Rate of every driver over the input, in their order; 1 by default.  Whole numbers for a full turn.

    Examples
    --------
    >>> Goals(min_transmission_angle=0.5).full_turn
    True
    """

    span: float = math.tau
    min_transmission_angle: float = math.radians(25.0)
    max_length_ratio: float = 6.0
    target: Target | None = None
    symmetry: tuple[int, ...] = ()
    mirrored: bool = False
    rates: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        positive("span", self.span)
        object.__setattr__(self, "rates", _numbers("rates", self.rates, 0))
        if 0.0 in self.rates or (self.full_turn and any(rate % 1.0 for rate in self.rates)):
            raise GeometryError(f"rates = {self.rates} must not be 0, and whole numbers if the input is a full turn")
        object.__setattr__(self, "symmetry", _listed("symmetry", self.symmetry))
        if bool(self.symmetry) + self.mirrored + (self.target is not None) > 1:
            raise GeometryError("of symmetry, mirrored and a target one can be given; leave out the others")
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


# --- errors of the targets over many candidate motions at once


class Sampled(NamedTuple):
    """A link over the inputs of the target, by set: origin, angle factor and continuous angle, each (sets, samples)."""

    z: Complex
    w: Complex
    angle: Array


class Placed(NamedTuple):
    """What the fit adds to a candidate: the whole is multiplied by s and moved by t; q/s is the point on the link."""

    s: Complex
    q: Complex
    t: Complex


def target_link(design: Design, target: Target) -> int:
    """Return the link that a target speaks of; `GeometryError` if it cannot be that one."""
    graph = design.graph
    frame = graph.frame
    assert frame is not None
    link = target.link
    driven = {pair[1] for pair in design.drivers}
    if link is None:
        if isinstance(target, FunctionGoal):
            near = [k for k in range(graph.links) if graph.neighbours[frame] >> k & 1 and k not in driven]
            link = near[0] if near else graph.levels[1][-1]
        else:
            link = graph.levels[-1][-1]
    if link >= graph.links or link == frame:
        raise GeometryError(
            f"target link {link} is the frame or does not exist; name a moving link, 0 to {graph.links - 1}"
        )
    return link


class TargetFit(ABC):
    """Base: where to sample, how many more unknowns, and the errors.

    `inputs`: at which the target is sampled, relative to the first; `ranges`: of further unknowns, shape (extras, 2);
    `placed`: the target speaks of absolute coordinates; `angular`: continuous angles are needed; `smooth`: the errors
    vanish smoothly at a perfect candidate, so that least squares help; `warped`: every set has inputs of its own.
    """

    inputs: Array
    ranges: Array = np.zeros((0, 2))
    placed, angular, smooth, warped = False, True, True, False

    @abstractmethod
    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Errors (sets, m) whose largest size is in the unit of the tolerance, and the placement."""

    def linear(self, own: Array) -> tuple[Array, Array, Array]:
        """Errors and their derivatives for least squares, of a smooth target at inputs of its own.

        ``own`` (sets, n, 4) are x, y, cos, sin of the link.  Returns errors (sets, directions, n), their derivatives by
        (x, y, theta), (sets, directions, 3, n), and what the placement can change, columns (sets, directions n, k).
        """
        raise GeometryError("this target has no derivatives")  # never asked: `smooth` and not `warped` come first

    def unplaced(self, q: Complex) -> Placed:
        """Return a placement that leaves the whole where it is."""
        one = np.ones(len(q), dtype=np.complex128)
        return Placed(one, q, 0.0 * one)


class PathFit(TargetFit):
    """Points, timed or not, and poses."""

    placed = True

    def __init__(self, target: PathGoal | PosesGoal) -> None:
        rows = np.array(target.points if isinstance(target, PathGoal) else target.poses)
        self.goal = rows[:, 0] + 1j * rows[:, 1]
        self.turn = rows[:, 2] - rows[0, 2] if isinstance(target, PosesGoal) else None
        self.size = float(np.abs(self.goal - self.goal.mean()).max()) or 1.0
        self.warped = target.inputs is None
        self.angular = self.turn is not None
        self.inputs = np.zeros(0) if target.inputs is None else np.array(target.inputs)
        closed = isinstance(target, PathGoal) and target.closed
        self.wanted = Wanted(self.goal, self.turn, self.size, closed)

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Distance of every point over the size of the set, and angles."""
        z, w = sampled.z, sampled.w
        B = np.stack([z, w, np.ones_like(z)], axis=2)
        BH = np.conj(B.transpose(0, 2, 1))
        N = BH @ B
        N = N + 1e-13 * np.trace(N, axis1=1, axis2=2).real[:, None, None] * np.eye(3)
        c: Complex = np.linalg.solve(N, BH @ np.broadcast_to(self.goal, z.shape)[:, :, None]).astype(np.complex128)
        found = ((B @ c)[:, :, 0] - self.goal) / self.size
        if self.turn is not None:
            found = np.concatenate([found, self._turned(sampled.angle)], axis=1)
        return found, Placed(c[:, 0, 0], c[:, 1, 0], c[:, 2, 0])

    def _turned(self, angle: Array) -> Array:
        """Errors of the angles but for the line on the link from which they are measured."""
        assert self.turn is not None
        if self.warped:  # at times that are found whole rotations mean nothing
            rest = np.exp(1j * (angle - self.turn))
            return np.asarray(np.angle(rest * np.conj(rest.sum(axis=1, keepdims=True))))
        turned = angle - angle[:, :1] - self.turn
        return np.asarray(turned - turned.mean(axis=1, keepdims=True))

    def linear(self, own: Array) -> tuple[Array, Array, Array]:
        """Real and imaginary parts of distances over the size, and angles; the placement is three complex numbers."""
        z, w = own[..., 0] + 1j * own[..., 1], own[..., 2] + 1j * own[..., 3]
        B = np.stack([z, w, np.ones_like(z)], axis=2)
        BH = np.conj(B.transpose(0, 2, 1))
        N = BH @ B
        N = N + 1e-13 * np.trace(N, axis1=1, axis2=2).real[:, None, None] * np.eye(3)
        c = np.linalg.solve(N, BH @ np.broadcast_to(self.goal, z.shape)[:, :, None])
        e = ((B @ c)[:, :, 0] - self.goal) / self.size
        by = np.stack(
            [np.broadcast_to(c[:, :1, 0], z.shape), 1j * c[:, :1, 0] + 0.0 * z, 1j * c[:, 1:2, 0] * w], axis=1
        )
        by, B = by / self.size, np.concatenate([B, 1j * B], axis=2)
        errors, slopes = [e.real, e.imag], [by.real, by.imag]
        basis = np.concatenate([B.real, B.imag], axis=1)
        if self.turn is not None:
            angle = np.unwrap(np.arctan2(own[..., 3], own[..., 2]), axis=1)
            errors.append(self._turned(angle))
            slopes.append(np.stack([0.0 * angle, 0.0 * angle, 1.0 + 0.0 * angle], axis=1))
            more = np.zeros((len(z), 3 * z.shape[1], basis.shape[2] + 1))
            more[:, : basis.shape[1], :-1], more[:, basis.shape[1] :, -1] = basis, 1.0
            basis = more
        return np.stack(errors, axis=1), np.stack(slopes, axis=1), basis


class FunctionFit(TargetFit):
    """Angle of a link as a function of the input."""

    def __init__(self, target: FunctionGoal) -> None:
        self.inputs, self.outputs = np.array(target.inputs), np.array(target.outputs)

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Differences of angles with the best zero of the scale."""
        e = sampled.angle - self.outputs
        e = e - 0.5 * (e.max(axis=1, keepdims=True) + e.min(axis=1, keepdims=True))
        return e.astype(np.complex128), self.unplaced(np.zeros(len(e), dtype=np.complex128))

    def linear(self, own: Array) -> tuple[Array, Array, Array]:
        """Differences of angles but for a constant."""
        angle = np.unwrap(np.arctan2(own[..., 3], own[..., 2]), axis=1)
        e = angle - self.outputs
        ones = np.ones((*angle.shape, 1))
        slope = np.stack([0.0 * angle, 0.0 * angle, ones[..., 0]], axis=1)
        return (e - e.mean(axis=1, keepdims=True))[:, None], slope[:, None], ones


class LineFit(TargetFit):
    """A straight stroke: its two ends are set exactly the wanted length apart, the strip is measured."""

    smooth = angular = False

    def __init__(self, target: LineGoal) -> None:
        self.target = target
        self.inputs = np.linspace(0.0, target.span, 73)
        tilt = [-3.0 * target.tolerance, 3.0 * target.tolerance]
        self.ranges = np.array([tilt] if target.on_bar else [tilt, [-np.pi, np.pi]])

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Width of the strip over its length, shape (sets, 1)."""
        z, w = sampled.z, sampled.w
        dz, dw = z[:, -1] - z[:, 0], w[:, -1] - w[:, 0]
        length = self.target.length * crank
        if self.target.on_bar:  # q real with |dz + q dw| = length (the larger), and how far it is from existing
            a, b, c = np.abs(dw) ** 2, (dz * np.conj(dw)).real, np.abs(dz) ** 2 - length**2
            inside = b * b - a * c
            q = ((-b + np.sqrt(np.maximum(inside, 0.0))) / a).astype(np.complex128)
            far = np.sqrt(np.maximum(-inside, 0.0)) / (a * length)
        else:
            q, far = (length * np.exp(1j * extras[:, 1]) - dz) / dw, np.zeros(len(z))
        M = z + q[:, None] * w
        along = (M[:, -1] - M[:, 0]) / length * np.exp(1j * extras[:, 0])
        y = (np.conj(along)[:, None] * M).imag
        width = (_peak(y) + _peak(-y)) / length
        return (width + far)[:, None].astype(np.complex128), self.unplaced(q)


def _peak(y: Array) -> Array:
    """Largest value by row of equidistant samples, with the parabola through every local maximum and its neighbours."""
    y0, y1, y2 = y[:, :-2], y[:, 1:-1], y[:, 2:]
    bend = np.minimum(y0 - 2.0 * y1 + y2, -1e-300)
    rise = np.where((y1 >= y0) & (y1 >= y2), -((y0 - y2) ** 2) / (8.0 * bend), 0.0)
    return np.asarray(np.maximum(y.max(axis=1), (y1 + rise).max(axis=1)))
