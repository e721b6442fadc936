"""Closed form of the reflector angles on one assembly mode (specification instruments_and_dynamics, section 2.5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, sign
from graphsynth.systems.antenna.legs import scale_of, solution_order
from graphsynth.systems.antenna.results import Poses, PoseStatus

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["crank_arrays", "poses"]

Array = NDArray[np.float64]

#: Codes of the kernel in terms of the legs, for each gimbal order.
_CODES = {
    "YX": (0, PoseStatus.FOLD_X, PoseStatus.FOLD_Y, PoseStatus.LEG_X_OUT_OF_REACH, PoseStatus.LEG_Y_OUT_OF_REACH, 5),
    "XY": (0, PoseStatus.FOLD_Y, PoseStatus.FOLD_X, PoseStatus.LEG_Y_OUT_OF_REACH, PoseStatus.LEG_X_OUT_OF_REACH, 5),
}


def crank_arrays(phi_x: ArrayLike, phi_y: ArrayLike) -> tuple[Array, Array]:
    """Check two crank angles and broadcast them against each other."""
    x, y = np.broadcast_arrays(finite_array("phi_x", phi_x), finite_array("phi_y", phi_y))
    return x, y


def poses(mechanism: PointingMechanism, phi_x: ArrayLike, phi_y: ArrayLike, s_y: int, s_x: int) -> Poses:
    """Reflector angles at the given crank angles; see `PointingMechanism.poses`."""
    from graphsynth.systems.antenna.kernels.poses import triangular

    x, y = crank_arrays(phi_x, phi_y)
    signs = {"Y": sign("s_y", s_y), "X": sign("s_x", s_x)}
    scale = scale_of(mechanism)
    first, second = solution_order(mechanism, scale)
    inputs = {"Y": np.array(x).ravel(), "X": np.array(y).ravel()}  # writable copies: one compiled kernel
    count = x.size
    u, v, deficit, margin1, margin2 = np.empty((5, count))
    status, close = np.empty(count, dtype=np.int8), np.empty(count, dtype=np.bool_)
    triangular(
        mechanism.l1 / scale,
        *(first.crank, first.rod, first.side, float(signs[first.name])),
        *(second.crank, second.rod, second.side, float(signs[second.name])),
        *(inputs[first.name], inputs[second.name]),
        *(u, v, status, deficit, margin1, margin2, close),
    )
    status = np.array(_CODES[mechanism.order], dtype=np.int8)[status]
    if mechanism.order == "YX":
        a, b, margin_y, margin_x = v, u, margin2, margin1
    else:
        a, b, margin_y, margin_x = u, v, margin1, margin2
    shape = x.shape
    return Poses(
        phi_x=x,
        phi_y=y,
        a=a.reshape(shape),
        b=b.reshape(shape),
        status=status.reshape(shape),
        deficit=(deficit * scale).reshape(shape),
        margin_y=margin_y.reshape(shape),
        margin_x=margin_x.reshape(shape),
        near_limit=close.reshape(shape),
        s_y=int(s_y),
        s_x=int(s_x),
        order=mechanism.order,
    )
