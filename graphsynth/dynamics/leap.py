"""Passing a singular pose: the motion is smooth along its branch although the equations lose their digits there.

Off the constraints the accelerations are singular at a change point, so the stages of a step cannot come near.  States
on the constraints, accurate to rounding, are interpolated by the polynomial through their positions, velocities and
accelerations (Hermite), and the polynomial leads over the pose.  The leap counts only if it lands on the constraints:
where two branches nearly meet and do not cross, it does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["HermiteLeap"]

Array = NDArray[np.float64]


class HermiteLeap:
    """Polynomials through states ``(q, v, work)`` and their rates at several times."""

    def __init__(self, times: list[float], states: list[Array], rates: list[Array]) -> None:
        self._n = (len(states[0]) - 1) // 2
        n = self._n
        self._centre, self._unit = times[-1], times[-1] - times[0]
        nodes = (np.array(times) - self._centre) / self._unit
        u = self._unit
        places = [[y[:n], u * y[n : 2 * n], 0.5 * u * u * f[n : 2 * n]] for y, f in zip(states, rates)]
        works = [[y[2 * n :], u * f[2 * n :]] for y, f in zip(states, rates)]
        self._place, self._place_nodes = _divided(nodes, places)
        self._work, self._work_nodes = _divided(nodes, works)

    def __call__(self, t: float) -> Array:
        """State at time t."""
        x = (t - self._centre) / self._unit
        place, slope = _value(self._place, self._place_nodes, x)
        work, _ = _value(self._work, self._work_nodes, x)
        return np.concatenate([place, slope / self._unit, work])


def _divided(nodes: Array, data: list[list[Array]]) -> tuple[Array, Array]:
    """Newton's divided differences with repeated nodes; ``data`` holds Taylor coefficients at every node."""
    order = len(data[0])
    x = np.repeat(nodes, order)
    table = np.array([data[k // order][0] for k in range(len(x))])
    found = [table[0]]
    for column in range(1, len(x)):
        fresh = []
        for k in range(len(x) - column):
            gap = x[k + column] - x[k]
            fresh.append(data[k // order][column] if gap == 0.0 else (table[k + 1] - table[k]) / gap)
        table = np.array(fresh)
        found.append(table[0])
    return np.array(found), x


def _value(coefficients: Array, nodes: Array, x: float) -> tuple[Array, Array]:
    """Newton's form and its derivative by Horner's rule."""
    value, slope = coefficients[-1].copy(), np.zeros_like(coefficients[-1])
    for k in range(len(coefficients) - 2, -1, -1):
        slope = value + (x - nodes[k]) * slope
        value = coefficients[k] + (x - nodes[k]) * value
    return value, slope
