"""Two models of one mechanism that follow different conventions: the difference of their outputs (section 2.8)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import choice, sign
from graphsynth.systems.antenna.closed_form import crank_arrays
from graphsynth.systems.antenna.results import PoseStatus

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["ModelComparison", "Reading", "compare", "read_angles"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """How a model reads its inputs and outputs.

    Parameters
    ----------
    sense_y, sense_x : {+1, -1}
        -1 reverses the crank of leg Y or X.
    side_y, side_x : {+1, -1}
        -1 mounts a leg on the negative side of its axis (mounting angle turned by half a turn): crank pivot, ball joint
        and cardan are mirrored, the senses of all rotations are kept.
    output : {"gimbal", "normal"}
        "normal" reads the tilt of the reflector's normal ``n``: ``atan2(-n_y, n_z)`` and ``atan2(n_x, n_z)``.
    """

    sense_y: int = 1
    sense_x: int = 1
    side_y: int = 1
    side_x: int = 1
    output: str = "gimbal"

    def __post_init__(self) -> None:
        for name in ("sense_y", "sense_x", "side_y", "side_x"):
            object.__setattr__(self, name, sign(name, getattr(self, name)))
        choice("output", self.output, ("gimbal", "normal"))


@dataclass(frozen=True, eq=False)
class ModelComparison:
    """Outputs of two models at the same crank angles.

    Attributes
    ----------
    phi_x, phi_y : ndarray, shape (...)
        Crank angles, radians.
    a, b : ndarray, shape (2, ...)
        Elevation and azimuth of the first and of the second model, radians; NaN where a model cannot be assembled.
    status : ndarray of int8, shape (2, ...)
        `PoseStatus`.
    """

    phi_x: Array
    phi_y: Array
    a: Array
    b: Array
    status: NDArray[np.int8]

    @property
    def means(self) -> Array:
        """Mean of elevation and azimuth of each model, shape (2, ...), radians."""
        return 0.5 * (self.a + self.b)

    @property
    def difference(self) -> Array:
        """Mean of the second model minus mean of the first, radians."""
        return np.asarray(0.5 * ((self.a[1] - self.a[0]) + (self.b[1] - self.b[0])))

    @property
    def arcminutes(self) -> Array:
        """`difference` in minutes of arc."""
        return np.degrees(self.difference) * 60.0

    @property
    def separation(self) -> Array:
        """Elevation minus azimuth of each model, shape (2, ...), radians."""
        return self.a - self.b

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """True where both models can be assembled."""
        return np.asarray((self.status <= PoseStatus.FOLD_X).all(axis=0))


def read_angles(
    mechanism: PointingMechanism, reading: Reading, phi_x: Array, phi_y: Array
) -> tuple[Array, Array, NDArray[np.int8]]:
    """Elevation, azimuth and status as a model with the given conventions reads them.

    A leg on the negative side is the mirror image of the leg in the plane through the other gimbal axis: crank angle
    and output change their signs together, and the other output enters through its cosine only.
    """
    poses = mechanism.poses(reading.side_y * reading.sense_y * phi_x, reading.side_x * reading.sense_x * phi_y)
    a, b = reading.side_y * poses.a, reading.side_x * poses.b
    if reading.output == "normal":
        from graphsynth.systems.antenna.results import orientation

        normal = orientation(a, b, mechanism.order)[..., :, 2]
        a, b = np.arctan2(-normal[..., 1], normal[..., 2]), np.arctan2(normal[..., 0], normal[..., 2])
    return a, b, poses.status


def compare(
    mechanism: PointingMechanism,
    other: PointingMechanism,
    phi_x: ArrayLike,
    phi_y: ArrayLike | None,
    reading: Reading,
    other_reading: Reading,
) -> ModelComparison:
    """Compare two models; see `PointingMechanism.compare`."""
    x, y = crank_arrays(phi_x, phi_x if phi_y is None else phi_y)
    one, two = read_angles(mechanism, reading, x, y), read_angles(other, other_reading, x, y)
    a, b = np.stack([one[0], two[0]]), np.stack([one[1], two[1]])
    return ModelComparison(x, y, a, b, np.stack([one[2], two[2]]))
