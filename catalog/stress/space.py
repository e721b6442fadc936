"""Mechanisms in space with closures that are known: one bearing that tilts, a spherical linkage, Bennett's linkage."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.jamming.space import SpaceModel


def one_bearing(limit: float, alpha: float, u: float, lengths: tuple[float, ...] = (2.0, 1.0, 2.5, 2.5)) -> Any:
    """Return a four-bar with a tilted motor axis, spherical at A, rigid at C, and its plane coordinates at u.

    The bearing at B must tilt by ``asin(l2 / l3 sin(alpha) |sin u|)``.
    """
    from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits
    from graphsynth.jamming.space import Seat, SpaceJoint, SpaceModel

    ground, crank, coupler, rocker = lengths
    frame = Seat(turn=(alpha, 0.0, 0.0)), Seat((ground, 0.0, 0.0))
    links = [(Seat(), Seat((crank, 0.0, 0.0))), (Seat(), Seat((coupler, 0.0, 0.0))), (Seat((rocker, 0.0, 0.0)), Seat())]
    joints = (
        SpaceJoint(0, 1, frame[0], links[0][0], RIGID, driven=True),
        SpaceJoint(1, 2, links[0][1], links[1][0], SPHERICAL),
        SpaceJoint(2, 3, links[1][1], links[2][0], JointLimits(limit)),
        SpaceJoint(0, 3, frame[1], links[2][1], RIGID),
    )
    model = SpaceModel(joints, 4)
    away = crank * np.exp(1j * u)
    to = ground - away
    cosine = (coupler**2 + abs(to) ** 2 - rocker**2) / (2.0 * coupler * abs(to))
    b = float(np.angle(to)) + math.acos(cosine)
    c = float(np.angle(away + coupler * np.exp(1j * b) - ground))
    return model, _coordinates(model, [u, b - u, c - b, c])


def _coordinates(model: SpaceModel, turns: list[float]) -> np.ndarray:
    q = np.zeros(model.width)
    q[model.column[:, 0]] = turns
    return q


def bennett(limit: float, off: float, theta: float = 1.0) -> Any:
    """Return Bennett's linkage, lengths 1 and 2, with one length off by a part, and its closure where it is not off."""
    from graphsynth.jamming.joints import JointLimits
    from graphsynth.jamming.space import Seat, SpaceJoint, SpaceModel

    first, a, b = 0.4, 1.0, 2.0
    second = math.asin(b / a * math.sin(first))
    sides = [(a * (1.0 + off), first), (b, second), (a, first), (b, second)]
    joints = []
    for k in range(4):
        length, twist = sides[k - 1]
        seat = Seat((length, 0.0, 0.0), (twist, 0.0, 0.0))
        joints.append(SpaceJoint((k - 1) % 4, k, seat, Seat(), JointLimits(limit, limit), driven=k == 0))
    model = SpaceModel(tuple(joints), 4)
    other = 2.0 * math.atan(math.sin(0.5 * (second + first)) / math.sin(0.5 * (second - first)) / math.tan(0.5 * theta))
    return model, _coordinates(model, [theta, other, -theta, -other])


def _on_sphere(turn: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the z axis turned by a rotation vector."""
    angle = math.hypot(*turn)
    x, y, z = (part / angle for part in turn)
    c, s = math.cos(angle), math.sin(angle)
    return x * z * (1.0 - c) + y * s, y * z * (1.0 - c) - x * s, z * z * (1.0 - c) + c


def spherical(limit: float, off: float) -> Any:
    """Return four axes through one point, one of them off by an angle, and its closure where it is not off."""
    from graphsynth.jamming.joints import JointLimits
    from graphsynth.jamming.space import Seat, SpaceJoint, SpaceModel

    joints = []
    for k, turn in enumerate([(0.3, -0.5, 0.2), (-0.4, 0.1, 0.5), (0.2, 0.5, -0.3), (0.5, 0.4, 0.1)]):
        wrong = turn if k != 2 else (turn[0] + off, turn[1], turn[2])
        seats = Seat(_on_sphere(turn), turn), Seat(_on_sphere(turn), wrong)
        joints.append(SpaceJoint(k, (k + 1) % 4, *seats, JointLimits(limit), driven=k == 0))
    model = SpaceModel(tuple(joints), 4)
    return model, np.zeros(model.width)
