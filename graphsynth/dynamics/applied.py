"""Loads given as functions of time and state, as generalised forces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import called
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Force, TorqueSource
from graphsynth.dynamics.tables import Compiled

__all__ = ["applied_loads"]

Array = NDArray[np.float64]


def applied_loads(compiled: Compiled, t: float, q: Array, v: Array) -> Array:
    """Generalised force of all loads given as functions, shape (n,).

    Raises
    ------
    GeometryError
        If a function returns something that is not a finite number (for a force: two of them).
    """
    Q = np.zeros(compiled.n)
    column = compiled.tables.column
    for element in compiled.applied:
        if isinstance(element, Force):
            _force(compiled, element, int(column[element.link]), t, q, v, Q)
            continue
        a, b = (int(column[link]) for link in (element.a, element.b))
        angle = (q[b + 2] if b >= 0 else 0.0) - (q[a + 2] if a >= 0 else 0.0)
        speed = (v[b + 2] if b >= 0 else 0.0) - (v[a + 2] if a >= 0 else 0.0)
        law: Any = element.torque
        name = f"the torque {element.a}-{element.b}"
        if isinstance(element, TorqueSource):
            G = element.ratio
            torque = G * _number(called(name, law, t, G * angle, G * speed), element)
            torque *= element.efficiency if torque * speed >= 0.0 else 1.0 / element.efficiency
        else:
            torque = _number(called(name, law, t, angle, speed), element)
        for k, sign in ((a, -1.0), (b, 1.0)):
            if k >= 0:
                Q[k + 2] += sign * torque
    return Q


def _force(compiled: Compiled, element: Force, k: int, t: float, q: Array, v: Array, Q: Array) -> None:
    if k < 0:
        return
    centre = compiled.centres[element.link]
    px, py = element.at[0] - float(centre[0]), element.at[1] - float(centre[1])
    c, s = math.cos(q[k + 2]), math.sin(q[k + 2])
    ux, uy = c * px - s * py, s * px + c * py
    place = (float(q[k] + ux), float(q[k + 1] + uy))
    speed = (float(v[k] - v[k + 2] * uy), float(v[k + 1] + v[k + 2] * ux))
    law: Any = element.force
    found = called(f"the force on link {element.link}", law, t, place, speed)
    try:
        fx, fy = (_number(part, element) for part in found)
    except (TypeError, ValueError) as error:
        raise GeometryError(
            f"the force on link {element.link} gave {found!r}; return two finite numbers (fx, fy)"
        ) from error
    Q[k] += fx
    Q[k + 1] += fy
    Q[k + 2] += ux * fy - uy * fx


def _number(value: Any, element: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise GeometryError(
            f"a {type(element).__name__} gave {value!r}; return a finite number at every state"
        ) from error
    if not math.isfinite(number):
        raise GeometryError(f"a {type(element).__name__} gave {number}; return a finite number at every state")
    return number
