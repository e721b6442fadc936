"""The antenna pointing mechanism: dimensions, structural graph, and the entry to everything that is computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from graphsynth.kinematics._checks import choice, positive

if TYPE_CHECKING:
    from graphsynth.kinematics.pointing.results import Poses
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["PointingMechanism"]

#: Names of the links of the structural graph, by number.
LINKS = ("ground", "reflector", "rod Y", "rod X", "crank Y", "crank X")


@dataclass(frozen=True)
class PointingMechanism:
    """A reflector on a central gimbal, tilted about two axes by two crank-and-rod legs.

    Leg Y (rod ``l2``, crank ``l3``, crank angle ``phi_x``) tilts the reflector about X: elevation ``a``.  Leg X (rod
    ``l4``, crank ``l5``, crank angle ``phi_y``) turns it about Y: azimuth ``b``.  Both are attached at the distance
    ``l1`` from the centre.  At rest all angles are zero.  The defaults are the geometry ART of the specification.

    Parameters
    ----------
    l1, l2, l3, l4, l5 : float
        Lengths, metres (any common unit).
    order : {"YX", "XY"}
        Order of the gimbal: "YX" has the azimuth axis fixed to the ground, ``R = R_y(b) R_x(a)``; "XY" the elevation
        axis, ``R = R_x(a) R_y(b)``.

    Raises
    ------
    GeometryError
        A length that is not positive and finite, or an unknown order.

    Notes
    -----
    Perechesova, Kalapyshina, Nuzhdin (2014), corrected; specification instruments_and_dynamics, section 2.

    Examples
    --------
    >>> import numpy as np
    >>> poses = PointingMechanism().poses(np.radians(40), np.radians(40))
    >>> np.degrees([poses.a, poses.b]).round(9).tolist()
    [23.712080016, 22.447857254]
    """

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

    def graph(self) -> MechanismGraph:
        """Structural graph in space: six links, universal, spherical and revolute joints as 2, 3 and 1 sub-edges.

        Examples
        --------
        >>> graph = PointingMechanism().graph()
        >>> graph.mobility, graph.loops, 6 * graph.loops
        (2, 2, 12)
        """
        from graphsynth.structure.graph import MechanismGraph

        joints = [(0, 1, 2), (1, 2, 2), (1, 3, 2), (2, 4, 3), (3, 5, 3), (0, 4, 1), (0, 5, 1)]
        return MechanismGraph(6, joints, frame=0, space=6)

    def poses(self, phi_x: ArrayLike, phi_y: ArrayLike, s_y: int = 1, s_x: int = -1) -> Poses:
        """Reflector angles for crank angles, on one assembly mode (closed form, section 2.5).

        Parameters
        ----------
        phi_x, phi_y : array_like
            Angles of the cranks of legs Y and X, radians, broadcast against each other.
        s_y, s_x : {+1, -1}
            Branch signs; the defaults contain the rest pose.

        Returns
        -------
        Poses
            Accurate to a few units of rounding divided by ``margin_y`` and ``margin_x`` (estimated).  A pose that
            cannot be assembled has NaN, a status and the deficit in length.

        Raises
        ------
        GeometryError
            A crank angle that is not finite, a sign that is not +1 or -1.
        """
        from graphsynth.kinematics.pointing.closed_form import poses

        return poses(self, phi_x, phi_y, s_y, s_x)
