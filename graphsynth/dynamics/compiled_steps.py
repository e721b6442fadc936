"""scipy's DOP853 with the twelve stages of a step run by one compiled kernel; its control and interpolant stay."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from graphsynth.dynamics.stepping import Trail

__all__ = ["ONE_STAGE", "Stages", "compiled_stepper"]

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
