"""Gaps and areas of a tilted bearing over the crank angles of a table (estimated: closed forms in double precision)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.bearing.areas import CrescentAreas, lid_area, rim_area, surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.mechanism.four_bar import TiltedFourBar

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["JammingTable", "table_over"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JammingTable:
    """Values over the crank angles ``f``; every array has the shape of ``f``.

    Angles in radians, gaps in mm, areas in mm^2.  ``status`` is an `AssemblyStatus`; the other columns are NaN where
    the linkage cannot be assembled, and the two areas of the surrogate E4 also where its ellipse is not defined.
    ``rim_by_quadrature`` marks the angles at which the area of the rim is not a closed form.
    """

    f: Array
    status: NDArray[np.int8]
    theta: Array
    gap_a: Array
    gap_b: Array
    gap: Array
    surrogate_gap_area: Array
    surrogate_interference_area: Array
    lid_area: Array
    rim_area: Array
    rim_by_quadrature: NDArray[np.bool_]

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a `pandas.DataFrame` (pandas is imported here)."""
        import pandas as pd

        return pd.DataFrame({name: getattr(self, name) for name in self.__dataclass_fields__})


def table_over(linkage: TiltedFourBar, bearing: Bearing, condition: Condition, f: Array) -> JammingTable:
    """Fill the table at crank angles ``f`` (radians)."""
    path = linkage.positions(f)
    S, C = np.where(path.assembled, path.sin_theta, 0.0), np.where(path.assembled, path.cos_theta, 1.0)
    hide = np.where(path.assembled, 0.0, np.nan)
    if bearing.clearance >= 0.0:
        crescent = surrogate_areas(bearing, S, C)
        lid, (rim, by_quadrature) = lid_area(bearing, S, C), rim_area(bearing, S, C)
    else:  # an interference fit has no free position to measure from
        lid = rim = hide * np.nan
        crescent = CrescentAreas(lid, rim)
        by_quadrature = np.zeros(f.shape, dtype=bool)
    return JammingTable(
        f=f,
        status=path.status,
        theta=path.theta,
        gap_a=bearing.gap(S, C, "A") + hide,
        gap_b=bearing.gap(S, C, "B") + hide,
        gap=bearing.gap(S, C, condition) + hide,
        surrogate_gap_area=crescent[0] + hide,
        surrogate_interference_area=crescent[1] + hide,
        lid_area=lid + hide,
        rim_area=rim + hide,
        rim_by_quadrature=by_quadrature,
    )
