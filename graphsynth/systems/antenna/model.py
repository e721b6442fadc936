"""What the mechanism is: dimensions, structural graph, its two legs, and the poses that everything else computes.

With ``u`` the angle of the fixed gimbal axis and ``v`` that of the carried one, both gimbal orders lead to the same
triangular pair of equations (theory/antenna 5)::

    P1 cos u + Q1 sin u = K1
    P2 cos v + Q2 cos u sin v = K2

where a leg of crank ``c`` and rod ``r`` has its ball joint at ``P = l1 - c + c cos phi``, ``Q = side r + c sin phi``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import choice, positive

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph


@dataclass(frozen=True)
class PointingDimensions:
    """Lengths, gimbal order and structural graph of a `PointingMechanism`, which describes the parameters."""

    l1: float = 0.1
    l2: float = 0.15
    l3: float = 0.0592
    l4: float = 0.15
    l5: float = 0.0592
    order: str = "YX"

    def __post_init__(self) -> None:
        for name in ("l1", "l2", "l3", "l4", "l5"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        choice("order", self.order, ("YX", "XY"))

    @property
    def lengths(self) -> tuple[float, float, float, float, float]:
        """The five lengths l1 to l5."""
        return self.l1, self.l2, self.l3, self.l4, self.l5

    def other_order(self) -> Self:
        """Return the same lengths with the other gimbal order."""
        return replace(self, order="XY" if self.order == "YX" else "YX")

    def graph(self) -> MechanismGraph:
        """Structural graph in space: universal, spherical and revolute joints have 2, 3 and 1 sub-edges.

        Links 0 to 5: ground, reflector, rod Y, rod X, crank Y, crank X.

        Examples
        --------
        >>> graph = PointingDimensions().graph()
        >>> graph.mobility, graph.loops, 6 * graph.loops
        (2, 2, 12)
        """
        from graphsynth.structure.graph import MechanismGraph

        joints = [(0, 1, 2), (1, 2, 2), (1, 3, 2), (2, 4, 3), (3, 5, 3), (0, 4, 1), (0, 5, 1)]
        return MechanismGraph(6, joints, frame=0, space=6)


class Leg(NamedTuple):
    """One leg: name, crank, rod, side of the rod at rest, branch sign of the rest pose."""

    name: str
    crank: float
    rod: float
    side: float
    rest: int


def scale_of(mechanism: PointingDimensions) -> float:
    """Power of two near the largest length; dividing by it rounds nothing."""
    return math.ldexp(1.0, math.frexp(max(mechanism.lengths))[1])


def legs(mechanism: PointingDimensions, scale: float = 1.0) -> tuple[Leg, Leg]:
    """Leg Y and leg X, lengths divided by ``scale``."""
    _, l2, l3, l4, l5 = (length / scale for length in mechanism.lengths)
    return Leg("Y", l3, l2, -1.0, 1), Leg("X", l5, l4, 1.0, -1)


def solution_order(mechanism: PointingDimensions, scale: float = 1.0) -> tuple[Leg, Leg]:
    """Return the leg that is solved first (it turns the axis fixed to the ground) and the other one."""
    y, x = legs(mechanism, scale)
    return (x, y) if mechanism.order == "YX" else (y, x)


Array = NDArray[np.float64]
#: Directions of the crank of each leg at the crank angles 0 and a quarter turn.
_PLANES = {"Y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "X": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])}


def crank_direction(leg: str, phi: Array) -> Array:
    """Return unit vectors (..., 3) from the crank pivot of leg "Y" or "X" to its ball joint."""
    return np.asarray(np.stack([np.cos(phi), np.sin(phi)], -1) @ _PLANES[leg])


def joints(mechanism: PointingDimensions, poses: Poses) -> tuple[tuple[Array, Array, Array], ...]:
    """Crank pivot (3,), ball joint (..., 3) and cardan (..., 3) of leg Y, then of leg X, in the ground."""
    found = []
    for leg, phi, column in zip(legs(mechanism), (poses.phi_x, poses.phi_y), (1, 0)):
        pivot = (mechanism.l1 - leg.crank) * _PLANES[leg.name][0] - [0.0, 0.0, leg.rod]
        ball = pivot + leg.crank * crank_direction(leg.name, phi)
        found.append((pivot, ball, mechanism.l1 * poses.rotation[..., :, column]))
    return tuple(found)


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
        return (
            "assembled",
            "assembled at a fold of leg Y: two assembly modes meet, the velocity is undefined",
            "assembled at a fold of leg X: two assembly modes meet, the velocity is undefined",
            "cannot be assembled: |K_Y| exceeds hypot(A, B), the rod of leg Y does not reach",
            "cannot be assembled: |K_X| exceeds hypot(A, B), the rod of leg X does not reach",
            "not determined: a ball joint lies on a gimbal axis and holds nothing",
        )[self]


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
