"""Mechanisms in space from the axes of their joints, each a point and a direction where the mechanism stands.

All links have the frame of the whole at the reference, so both seats of a joint lie in the same place there and every
loop closes with all coordinates zero.  An axis that was made wrong on its second link is the only thing that disturbs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.joints.limits import RIGID, JointLimits
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import TURN, Seat, SpaceJoint, SpaceModel

Array = NDArray[np.float64]
Vector: TypeAlias = tuple[float, float, float]
#: A wrong axis further off than this (radians) is another; largest step of the driver, tries, what counts as closed.
_ANOTHER, _STEP, _TRIES, _CLOSED = 1.0, 0.05, 30, 1e-12


@dataclass(frozen=True)
class Axis:
    """Axis of a joint between links a and b: a point and a direction in the frame of the whole, at the reference.

    Parameters
    ----------
    a, b : int
        Links.
    point, direction : (float, float, float)
        A point of the axis, where the joint sits, and its direction, of any length above zero.
    limits : JointLimits
        Largest tilt and slide.
    driven : bool
        Whether the turn of this joint is given.
    made : (point, direction), optional
        The axis as it was made on link b, where that differs.

    Examples
    --------
    >>> Axis(0, 1, (0, 0, 0), (0, 0, 2)).direction
    (0.0, 0.0, 1.0)
    """

    a: int
    b: int
    point: Vector
    direction: Vector
    limits: JointLimits = RIGID
    driven: bool = False
    made: tuple[Vector, Vector] | None = None

    def __post_init__(self) -> None:
        name = f"axis {self.a}-{self.b}"
        for link in (self.a, self.b):
            if not isinstance(link, int | np.integer) or isinstance(link, bool) or link < 0 or self.a == self.b:
                raise GeometryError(f"{name} joins no two links; give two different numbers from 0 on")
        if not isinstance(self.limits, JointLimits):
            raise GeometryError(f"limits = {self.limits!r} of {name} are no JointLimits; give JointLimits(tilt)")
        object.__setattr__(self, "point", _vector(f"point of {name}", self.point))
        object.__setattr__(self, "direction", _unit(f"direction of {name}", self.direction))
        if self.made is not None:
            point, direction = self.made
            made = _vector(f"made point of {name}", point), _unit(f"made direction of {name}", direction)
            angle = math.acos(min(1.0, float(np.dot(made[1], self.direction))))
            if angle > _ANOTHER:
                raise GeometryError(
                    f"the made {name} is {angle:.3g} rad off its direction, which is another axis; keep it within "
                    f"{_ANOTHER:g} rad, or turn the direction round"
                )
            object.__setattr__(self, "made", made)


def _vector(name: str, value: Sequence[float]) -> Vector:
    if not isinstance(value, Sequence | np.ndarray) or len(value) != 3:
        raise GeometryError(f"{name} = {value!r} is no vector in space; give three numbers")
    x, y, z = (finite(name, part) for part in value)
    return x, y, z


def _unit(name: str, value: Sequence[float]) -> Vector:
    vector = _vector(name, value)
    size = math.hypot(*vector)
    if size == 0.0:
        raise GeometryError(f"{name} = {vector} has no length; give a vector along the axis")
    x, y, z = (part / size for part in vector)
    return x, y, z


def _seat(point: Vector, direction: Vector) -> Seat:
    """Seat whose z axis is a direction, by the least rotation from the z axis."""
    x, y, z = direction
    across = math.hypot(x, y)
    if across == 0.0:
        return Seat(point, (0.0, 0.0, 0.0) if z > 0.0 else (math.pi, 0.0, 0.0))
    angle = math.atan2(across, z) / across
    return Seat(point, (-y * angle, x * angle, 0.0))


def from_axes(axes: Iterable[Axis], *, frame: int = 0) -> SpaceModel:
    """Make a mechanism in space from the axes of its joints.

    Parameters
    ----------
    axes : iterable of Axis
        One for every joint; links are numbered from 0 without gaps.
    frame : int
        Link that stands still.

    Returns
    -------
    SpaceModel
        Its loops close at the reference, all coordinates zero, but for the axes that were made wrong.  Directions are
        rounded to doubles once, alike for both links.

    Raises
    ------
    GeometryError
        Links with gaps between their numbers, apart from the others, or without a loop; two joints between the same
        links; no such frame.

    Examples
    --------
    >>> corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    >>> square = [Axis(k, (k + 1) % 4, point, (0, 0, 1), driven=k == 0) for k, point in enumerate(corners)]
    >>> from_axes(square).rows
    ((2, 3, 4),)
    """
    chosen = list(axes)
    for own in chosen:
        if not isinstance(own, Axis):
            raise GeometryError(f"axes hold {own!r}, which is no Axis; give Axis(a, b, point, direction)")
    if not chosen:
        raise GeometryError("there are no axes; give at least three, of a closed loop")
    graph = nx.MultiGraph((own.a, own.b) for own in chosen)
    links = len(graph)
    if set(graph) != set(range(links)):
        missing = min(set(range(max(graph) + 1)) - set(graph))
        raise GeometryError(f"no axis names link {missing}; number the links from 0 without gaps")
    if len(set(map(frozenset, graph.edges()))) < len(chosen):
        raise GeometryError("two axes join the same links, which is one joint; leave one of them out")
    if not nx.is_connected(graph) or len(chosen) < links:
        raise GeometryError(f"{len(chosen)} joints of {links} links leave parts open; close at least one loop of all")
    if frame not in graph:
        raise GeometryError(f"frame = {frame} is none of the links 0 to {links - 1}; give one of them")
    joints = []
    for own in chosen:
        at = _seat(own.point, own.direction)
        wrong = at if own.made is None else _seat(*own.made)
        joints.append(SpaceJoint(own.a, own.b, at, wrong, own.limits, driven=own.driven))
    return SpaceModel(tuple(joints), links, frame)


def reference(axes: Iterable[Axis], given: Sequence[float] = (), *, frame: int = 0) -> Array:
    """Follow a mechanism as it was meant to be, without tilts, to given turns of its driven joints.

    Parameters
    ----------
    axes, frame
        As for `from_axes`; what was made wrong does not count.
    given : sequence of float
        Turn of every driven joint from the reference, radians, in the order of the axes.

    Returns
    -------
    ndarray, shape (width,)
        Unknowns and given coordinates, for `prove_pose`.

    Raises
    ------
    GeometryError
        The wrong number of turns; a mechanism that does not close there without tilts.
    """
    model = from_axes([replace(own, made=None) for own in axes], frame=frame)
    aim = np.array([finite("given", value) for value in given])
    if len(aim) != model.width - model.size:
        raise GeometryError(f"given = {given!r} are {len(aim)} turns for {model.width - model.size} driven joints")
    closure, q = Closure(model, False), np.zeros(model.width)
    turns = [int(column[TURN]) for column in model.column if 0 <= column[TURN] < model.size]
    count = max(1, math.ceil(float(np.abs(aim).max(initial=0.0)) / _STEP))
    for part in range(1, count + 1):
        q[model.size :] = aim * (part / count)
        missed = math.inf
        for _ in range(_TRIES):
            loops = closure.loops(q[None])
            values = closure.values(loops)[0]
            missed = float(np.abs(values).max(initial=0.0))
            if missed < _CLOSED:
                break
            q[turns] -= np.linalg.lstsq(closure.jacobian(loops)[0][:, turns], values, rcond=1e-9)[0]
        if missed >= _CLOSED:
            at = ", ".join(f"{value:.4g}" for value in q[model.size :])
            raise GeometryError(
                f"without tilts the loops do not close with the driven turns at {at} rad: they miss by {missed:.2g}; "
                "give turns that the mechanism can reach, or axes with which it moves"
            )
    return q
