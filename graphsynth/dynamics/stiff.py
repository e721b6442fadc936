"""CVODE of SUNDIALS through scikit-sundae, as a stepper like scipy's (extra ``stiff``)."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.errors import GeometryError

__all__ = ["CvodeStepper"]

Array = NDArray[np.float64]


class CvodeStepper:
    """Integrate to the bound in one call; the integration loop lands at every output time.

    Raises
    ------
    GeometryError
        If scikit-sundae is not installed.
    """

    def __init__(
        self, rates: Callable[[float, Array], Array], t: float, y: Array, bound: float, rtol: float, atol: Array | float
    ) -> None:
        try:
            CVODE = import_module("sksundae.cvode").CVODE
        except ImportError as error:
            raise GeometryError("method 'CVODE' needs scikit-sundae; install graphsynth[stiff]") from error

        def right_hand_side(time: float, state: Array, found: Array) -> None:
            found[:] = rates(time, np.array(state))

        self._solver: Any = CVODE(right_hand_side, rtol=rtol, atol=atol, method="BDF", max_num_steps=500_000)
        self.t, self.y, self.t_bound, self.status = t, np.array(y), bound, "running"

    def step(self) -> str | None:
        """Go to the bound; the status is "failed" if the solver did not reach it."""
        found = self._solver.solve(np.array([self.t, self.t_bound]), self.y)
        if not found.success or abs(float(found.t[-1]) - self.t_bound) > 1e-12 * max(1.0, abs(self.t_bound)):
            self.status = "failed"
            return str(found.message)
        self.t, self.y, self.status = self.t_bound, np.asarray(found.y[-1]), "finished"
        return None
