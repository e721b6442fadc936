"""CVODE of SUNDIALS through scikit-sundae, as a stepper like scipy's (extra ``stiff``)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.extras import need

__all__ = ["CvodeStepper"]

Array = NDArray[np.float64]


#: Where SUNDIALS is told to write its warnings, read when a solver is made.
_WARNINGS = "SUNLOGGER_WARNING_FILENAME"


@contextmanager
def _collected() -> Iterator[StringIO]:
    """Collect what the solver prints of a failure, and drop its warnings: the result says what happened.

    Somebody who has told SUNDIALS where to write its warnings gets them there.
    """
    own = _WARNINGS not in os.environ
    if own:
        os.environ[_WARNINGS] = os.devnull
    try:
        with redirect_stdout(StringIO()) as said:
            yield said
    finally:
        if own:
            os.environ.pop(_WARNINGS, None)


class CvodeStepper:
    """One internal step of CVODE a call, the last one ending at the bound.

    Parameters
    ----------
    rates : callable
        Rates of the state at a time and a state.
    t, bound : float
        Where to begin and where to end.
    y : ndarray
        State at ``t``.
    rtol, atol : float or ndarray
        Tolerances of CVODE.

    Raises
    ------
    MissingExtraError
        If scikit-sundae is not installed.
    """

    def __init__(
        self, rates: Callable[[float, Array], Array], t: float, y: Array, bound: float, rtol: float, atol: Array | float
    ) -> None:
        CVODE = need("sksundae.cvode", "stiff", "method 'CVODE'").CVODE

        def right_hand_side(time: float, state: Array, found: Array) -> None:
            found[:] = rates(time, np.array(state))

        with _collected():
            self._solver: Any = CVODE(right_hand_side, rtol=rtol, atol=atol, method="BDF")
            self._solver.init_step(t, np.array(y))
        self.t, self.y, self.t_bound, self.status = t, np.array(y), bound, "running"

    def step(self) -> str | None:
        """Take one step; the status is "failed" if the solver could not, "finished" at the bound."""
        with _collected() as said:
            found = self._solver.step(self.t_bound, method="onestep", tstop=self.t_bound)
        if not found.success:
            self.status = "failed"
            return " ".join(f"{found.message} {said.getvalue()}".split())
        self.t, self.y = float(found.t), np.asarray(found.y)
        if self.t >= self.t_bound:
            self.t, self.status = self.t_bound, "finished"
        return None
