"""Why an integration does not get past a pose: a lock under prescribed motion, masses too far apart, branches."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import Values, initial_slots

__all__ = ["lock", "stalled"]

Array = NDArray[np.float64]

#: Masses farther apart than this (see `Compiled.spread`) may defeat double precision.
_SPREAD = 1e16
#: Smallest singular value of the constraints over the largest, above which a pose counts as regular.
_REGULAR = 1e-2


def stalled(form: Any, t: float, y: Array) -> str:
    """Say why steps become ever shorter at a state of a formulation."""
    compiled: Compiled = form.compiled
    found = lock(form, t, y)
    if found:
        return found
    values, q = _values(form, t, y)
    if _SPREAD < compiled.spread < np.inf and _least(values.scaled_jacobian(q)) > _REGULAR:
        return compiled.spread_words
    return str(form.stall)


def lock(form: Any, t: float, y: Array) -> str:
    """Say which prescribed motion locks the mechanism next to a state; nothing if none does.

    There the joints alone are regular, and with the prescribed coordinate they are not: it is at its extreme.
    """
    compiled: Compiled = form.compiled
    drivers = compiled.model.prescribed
    if not drivers or not np.isfinite(y).all():
        return ""
    values, q = _values(form, t, y)
    J = values.scaled_jacobian(q)
    of = np.array([info.joint for info in compiled.info])
    whole = _least(J)
    for number, driver in enumerate(drivers, len(compiled.joints) - len(drivers)):
        if whole < 0.1 and _least(J[of != number]) > 3.0 * whole:
            value, speed = values.driven[number - len(compiled.joints) + len(drivers), :2]
            unit = "m" if compiled.model.mechanism.joint(*driver.pair).kind == "P" else "rad"
            return (
                f"the prescribed motion of joint {driver.base}-{driver.link} locks the mechanism: near {value:.6g} "
                f"{unit}, at {speed:.3g} {unit}/s, its coordinate is at an extreme of what the joints allow; prescribe "
                "less, or another joint"
            )
    return ""


def _values(form: Any, t: float, y: Array) -> tuple[Values, Array]:
    q = np.ascontiguousarray(form.state(t, y)[0])
    return Values(form.compiled, t, initial_slots(form.compiled, q, getattr(form, "slots", None))), q


def _least(J: Array) -> float:
    """Smallest singular value over the largest; 1 without rows."""
    S = np.linalg.svd(J, compute_uv=False) if J.size else np.ones(1)
    return float(S[min(J.shape) - 1] / S[0]) if J.size and S[0] > 0.0 else 1.0
