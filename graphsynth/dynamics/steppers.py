"""Steppers beside scipy's: DOP853 with its stages in one compiled kernel; CVODE of SUNDIALS (extra ``stiff``)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from functools import cache
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.extras import need

if TYPE_CHECKING:
    from graphsynth.dynamics.stepping import Trail

Array = NDArray[np.float64]

#: ``(t, y, h, A, K) -> new state``: fills the rows of K after the first with the rates at ``y + h A[s] K``.
Stages = Callable[[float, Array, float, Array, Array], Array]
#: The table of a "step" that only evaluates the rates at a state.
ONE_STAGE: Array = np.zeros((1, 1))

# of scipy.integrate's Runge-Kutta methods
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 10.0


@cache
def _stepper_class() -> Any:
    from scipy.integrate import DOP853

    A = np.vstack([DOP853.A, DOP853.B])  # the last row leads to the new state

    class CompiledDOP853(DOP853):  # type: ignore[misc]  # scipy has no types
        """The step of `scipy.integrate.DOP853` with compiled stages."""

        stages: Stages
        trail: Trail

        t: float
        y: Array
        f: Array
        h_abs: float

        def _step_impl(self) -> tuple[bool, str | None]:
            t, y = self.t, self.y
            least = 10.0 * abs(np.nextafter(t, np.inf) - t)
            size, rejected = min(max(self.h_abs, least), self.max_step), False
            while True:
                if size < least:
                    return False, self.TOO_SMALL_STEP
                fresh_t = min(t + size, self.t_bound)
                h = fresh_t - t
                size = abs(h)
                self.K[0] = self.f
                fresh = self.stages(t, y, h, A, self.K)
                self.trail.evaluations += self.n_stages
                scale = self.atol + np.maximum(np.abs(y), np.abs(fresh)) * self.rtol
                error = self._estimate_error_norm(self.K, h, scale)
                if error < 1.0:
                    factor = _MOST if error == 0.0 else min(_MOST, _SAFETY * error**self.error_exponent)
                    self.h_previous, self.y_old = h, y
                    self.h_abs = size * (min(1.0, factor) if rejected else factor)
                    self.t, self.y, self.f = fresh_t, fresh, self.K[-1].copy()
                    return True, None
                size *= max(_LEAST, _SAFETY * error**self.error_exponent) if error == error else _LEAST
                rejected = True

    return CompiledDOP853


def compiled_stepper(
    stages: Stages, rates: Callable[[float, Array], Array], t: float, y: Array, bound: float, rtol: float,
    atol: Array | float, first: float | None, trail: Trail,
) -> Any:  # fmt: skip
    """Return a stepper like `scipy.integrate.DOP853` for equations without loads given as functions.

    Parameters
    ----------
    stages : callable
    rates : callable
        The same right-hand side, for the first step and the interpolant.
    """
    solver = _stepper_class()(
        rates, t, y, bound, rtol=rtol, atol=atol, first_step=None if first is None else min(first, bound - t)
    )
    solver.stages, solver.trail = stages, trail
    return solver


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
