"""All assembly modes at given crank angles: one for each pair of branch signs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.systems.antenna.closed_form import poses
from graphsynth.systems.antenna.results import PoseStatus

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["SIGNS", "AssemblyModes", "solve"]

#: Branch signs ``(s_y, s_x)`` of the four modes; the rest pose lies on the first.
SIGNS = ((1, -1), (1, 1), (-1, -1), (-1, 1))


@dataclass(frozen=True, eq=False)
class AssemblyModes:
    """All assembly modes; the last axis runs over `SIGNS`.

    Attributes
    ----------
    a, b : ndarray, shape (..., 4)
        Elevation and azimuth, radians; NaN where the mode does not exist.
    status : ndarray of int8, shape (..., 4)
        `PoseStatus`.
    deficit : ndarray, shape (..., 4)
        Missing length, 0 where assembled.
    distinct : ndarray of bool, shape (..., 4)
        The mode exists and is not the second copy of a mode that a fold has merged with it.
    signs : tuple of (int, int)
        `SIGNS`.
    """

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    status: NDArray[np.int8]
    deficit: NDArray[np.float64]
    distinct: NDArray[np.bool_]
    signs: tuple[tuple[int, int], ...] = SIGNS

    @property
    def count(self) -> NDArray[np.int64]:
        """Number of different real modes, 0 to 4."""
        return np.asarray(self.distinct.sum(axis=-1))


def solve(mechanism: PointingMechanism, phi_x: ArrayLike, phi_y: ArrayLike) -> AssemblyModes:
    """All assembly modes; see `PointingMechanism.solve`."""
    found = [poses(mechanism, phi_x, phi_y, *signs) for signs in SIGNS]
    a, b, status, deficit = (
        np.stack([getattr(mode, name) for mode in found], axis=-1) for name in ("a", "b", "status", "deficit")
    )
    distinct = status <= PoseStatus.FOLD_X
    for later in range(1, 4):
        for earlier in range(later):
            same = (a[..., later] == a[..., earlier]) & (b[..., later] == b[..., earlier])
            distinct[..., later] &= ~same
    return AssemblyModes(a, b, status, deficit, distinct)
