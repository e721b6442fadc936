"""How joint positions move with the input, enclosed over pieces: implicit differentiation of the loop equations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, variables
from graphsynth.intervals.dual import jacobian_of
from graphsynth.jamming.joints.linear import enclosed_solve
from graphsynth.jamming.joints.positions import Positions
from graphsynth.jamming.joints.tubes import Tubes, places

__all__ = ["slopes"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def slopes(
    system: Positions, joints: tuple[int, ...], u: Interval, tubes: Tubes, counted: Array
) -> tuple[Interval, Interval, Interval, Mask]:
    """Enclose the derivatives by the input of ``r``, ``e``, ``base`` of `Tubes`, and tell where that is proved.

    On the branch ``F(x(u), u) = 0``, so ``F_x x' = -F_u``; with both enclosed over the tight boxes the solution set of
    the linear system holds ``x'`` for every input and every choice of dimensions.
    """
    count, n = len(u), system.size
    box = Interval.from_bounds(np.column_stack([tubes.tight.lo, u.lo]), np.column_stack([tubes.tight.hi, u.hi]))
    unknowns = variables(box)
    q: list[Any] = system.driven(unknowns[n])
    if n:
        table = jacobian_of(system.equations(unknowns[:n], q, counted), n + 1, (count,))
        rate, fine = enclosed_solve(table[:, :, :n], -table[:, :, n])
    else:
        rate, fine = Interval.zeros((count, 0)), np.ones(count, dtype=bool)

    def along(value: Any) -> Interval:
        """Return the derivative along the motion."""
        if not isinstance(value, Dual):
            return Interval.zeros((count,))
        total = value.grad[n]
        for i in range(n):
            total = total + value.grad[i] * rate[:, i]
        return total

    moved = places(system, joints, system.place(unknowns[:n], q), along)
    return (*moved, fine)
