"""Places that depend on other places: the crank begins in a given direction, a curve or a mechanism is symmetric.

A tie puts one place where it has to be, as a function of it and others.  Candidates keep it exactly, whatever the
search does, and derivatives go through it: it is written for complex numbers in place of real ones, so that a tiny
imaginary step gives them without cancellation (Squire and Trapp, SIAM Review 40, 1998).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.plans import Plan
from graphsynth.design.task.task import DesignTask
from graphsynth.kinematics.dimensional.mirror import axis_joints, images, reflected

Array = NDArray[np.float64]
#: Imaginary step.
_STEP = 1e-30
#: A direction so near to a limit is on it.
_ON = 1e-9


class Tie(NamedTuple):
    """The first of ``places`` (joints, then named points) follows from all of them, each of shape (sets, 2)."""

    places: tuple[int, ...]
    put: Callable[..., Any]

    def kept(self, places: Array) -> Array:
        """Return places (sets, all, 2) with the first one where it has to be."""
        found = places.copy()
        found[:, self.places[0]] = self.put(*(places[:, k] for k in self.places))
        return found

    def slopes(self, places: Array) -> Array:
        """Return derivatives (sets, 2, places, 2) of the first place by all of them."""
        found = np.zeros((len(places), 2, len(self.places), 2))
        for k in range(len(self.places)):
            for axis in (0, 1):
                stepped = [places[:, place].astype(np.complex128) for place in self.places]
                stepped[k][:, axis] += 1j * _STEP
                found[:, :, k, axis] = self.put(*stepped).imag / _STEP
        return found


def ties(task: DesignTask, plan: Plan) -> list[Tie]:
    """Return what the words of a task tie in the chains of a plan, in the order in which it is put."""
    found, design = [], plan.design
    if task.crank_start is not None:
        pivot, pin = crank_joints(plan)
        more = [k for k in design.joints_of(design.graph.frame or 0) if k != pivot][: task.crank_from == "frame"]
        found.append(Tie((pin, pivot, *more), partial(_turned, task.crank_start)))
    if plan.mirror:
        found += _mirrored(task, plan)
    elif task.symmetric:
        names = [name for name, of_point in task.names.items() if of_point]
        point = len(design.kinds) + next(k for k, name in enumerate(names) if name == task.symmetric_point)
        pivot, pin = crank_joints(plan)
        (rocker,) = (k for k in design.joints_of(design.graph.frame or 0) if k != pivot)
        (middle,) = {*range(len(design.kinds))} - {pivot, pin, rocker}
        found.append(Tie((middle, pin, rocker), _between))
        found.append(Tie((point, middle, pin), _as_far))
    return found


def _mirrored(task: DesignTask, plan: Plan) -> list[Tie]:
    """Return the ties of a mechanism that is its own mirror image: of two joints one, given ones are not moved."""
    design, own = plan.design, images(plan.design, plan.mirror)
    pivot, pin, image = line = axis_joints(design, plan.mirror)
    found, done = [Tie((image, pivot, pin), _as_far)], {*line}
    given = [k for k, _ in (*plan.given, *plan.regions) if k not in done]
    for k in (*given, *range(len(own))):
        if k not in done:
            found.append(Tie((own[k], k, *line), _image) if own[k] != k else Tie((k, *line), _on_axis))
            done |= {k, own[k]}
    carriers = [link for link, of_point in zip(plan.carriers, task.names.values(), strict=True) if of_point]
    for place, link in enumerate(carriers, len(own)):
        found.append(Tie((place, axis_joint(plan, link)), _there))
    return found


def axis_joint(plan: Plan, link: int) -> int:
    """Return the joint of a link with its own mirror image, which moves on a symmetric curve; -1 if there is none."""
    joints = enumerate(plan.design.graph.joints)
    return next((k for k, pair in joints if {*pair[:2]} == {link, plan.mirror[link]}), -1)


def crank_joints(plan: Plan) -> tuple[int, int]:
    """Return the joint of the driven link on the frame, and the first other one that turns; -1 if there is none."""
    design = plan.design
    (pivot,) = design.driver_joints
    own = (k for k in design.joints_of(design.drivers[0][1]) if k != pivot and design.kinds[k] == "R")
    return pivot, next(own, -1)


def _size(v: Any) -> Any:
    return np.sqrt((v * v).sum(axis=-1, keepdims=True) + 1e-300)


def _turned(limits: tuple[float, float], pin: Any, pivot: Any, other: Any = None) -> Any:
    """Turn a pin about its pivot into the limits of its direction, from the x axis or from another pivot."""
    way, base = pin - pivot, np.array([1.0, 0.0]) if other is None else other - pivot
    base = base / _size(base)
    across = np.stack([-base[..., 1], base[..., 0]], axis=-1)
    angle = np.arctan2((way * across).sum(axis=-1).real, (way * base).sum(axis=-1).real)
    middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0])
    off = np.mod(angle - middle + math.pi, math.tau) - math.pi
    bound = (middle + np.clip(off, -half, half))[:, None]
    put = pivot + _size(way) * (np.cos(bound) * base + np.sin(bound) * across)
    return np.where((np.abs(off) > half - _ON)[:, None], put, pin)


def _between(middle: Any, pin: Any, rocker: Any) -> Any:
    """Put the joint of coupler and rocker as far from the crank pin as from the pivot of the rocker."""
    along = (rocker - pin) / _size(rocker - pin)
    return middle - along * (along * (middle - 0.5 * (pin + rocker))).sum(axis=-1, keepdims=True)


def _as_far(point: Any, middle: Any, pin: Any) -> Any:
    """Put a coupler point as far from the joint of coupler and rocker as the crank pin."""
    return middle + _size(pin - middle) * (point - middle) / _size(point - middle)


def _image(_: Any, place: Any, *line: Any) -> Any:
    """Put a joint where another one is seen in the mirror."""
    return reflected(place, *line)


def _on_axis(place: Any, *line: Any) -> Any:
    """Put a joint on the axis of the mirror."""
    return 0.5 * (place + reflected(place, *line))


def _there(_: Any, place: Any) -> Any:
    """Put a point at a joint."""
    return place
