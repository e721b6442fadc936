"""Status and arrays of the poses of the pointing mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

__all__ = ["PoseStatus", "Poses"]

Array = NDArray[np.float64]


class PoseStatus(IntEnum):
    """Whether the mechanism can be assembled at two crank angles, and if not, which leg fails."""

    OK = 0
    FOLD_Y = 1  #: assembled, two modes meet in leg Y: no velocity of the elevation
    FOLD_X = 2  #: assembled, two modes meet in leg X: no velocity of the azimuth
    LEG_Y_OUT_OF_REACH = 3
    LEG_X_OUT_OF_REACH = 4
    INDETERMINATE = 5  #: the ball joint of a leg lies where every position of an output is equally good

    @property
    def message(self) -> str:
        """One sentence that says what the status means."""
        return _MESSAGES[self]


_MESSAGES = {
    PoseStatus.OK: "assembled",
    PoseStatus.FOLD_Y: "assembled at a fold of leg Y: two assembly modes meet, the velocity is undefined",
    PoseStatus.FOLD_X: "assembled at a fold of leg X: two assembly modes meet, the velocity is undefined",
    PoseStatus.LEG_Y_OUT_OF_REACH: "cannot be assembled: |K_Y| exceeds hypot(A, B), the rod of leg Y does not reach",
    PoseStatus.LEG_X_OUT_OF_REACH: "cannot be assembled: |K_X| exceeds hypot(A, B), the rod of leg X does not reach",
    PoseStatus.INDETERMINATE: "not determined: a ball joint lies on a gimbal axis and holds nothing",
}


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of the reflector on one assembly mode; NaN wherever `assembled` is False.

    Attributes
    ----------
    phi_x, phi_y : ndarray, shape (...)
        Crank angles, radians.
    a, b : ndarray, shape (...)
        Elevation (about X) and azimuth (about Y), radians in (-pi, pi].
    status : ndarray of int8, shape (...)
        `PoseStatus` of every pose.
    deficit : ndarray, shape (...)
        ``|K| - hypot(A, B)`` of the leg that does not reach, unit of the lengths; 0 where assembled.
    margin_y, margin_x : ndarray, shape (...)
        Sine of the angle by which each output is away from the fold of its leg, 0 to 1.
    near_limit : ndarray of bool, shape (...)
        Rounding may have decided whether a leg reaches: half of the digits of an angle are lost, and only more digits
        (`precise.precise_angles`) tell.
    s_y, s_x : int
        Branch signs of the assembly mode.
    order : str
        Gimbal order.
    """

    phi_x: Array
    phi_y: Array
    a: Array
    b: Array
    status: NDArray[np.int8]
    deficit: Array
    margin_y: Array
    margin_x: Array
    near_limit: NDArray[np.bool_]
    s_y: int
    s_x: int
    order: str

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """True where the mechanism can be assembled."""
        return np.asarray(self.status <= PoseStatus.FOLD_X)

    @property
    def rotation(self) -> Array:
        """Rotation of the reflector against the ground, shape (..., 3, 3)."""
        return orientation(self.a, self.b, self.order)

    def reasons(self) -> list[str]:
        """Sentence of every status that occurs, in the order of `PoseStatus`."""
        return [PoseStatus(int(code)).message for code in np.unique(self.status)]


def orientation(a: Array, b: Array, order: str) -> Array:
    """Return ``R_y(b) R_x(a)`` (order 'YX') or ``R_x(a) R_y(b)`` (order 'XY'), shape (..., 3, 3)."""
    ca, sa, cb, sb = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    zero = np.zeros(np.broadcast(a, b).shape)
    if order == "YX":
        rows = [[cb, sb * sa, sb * ca], [zero, ca, -sa], [-sb, cb * sa, cb * ca]]
    else:
        rows = [[cb, zero, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]]
    return np.stack([np.stack([part + zero for part in row], axis=-1) for row in rows], axis=-2)
