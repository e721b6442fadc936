"""Singular poses passed in motion: where, which branches meet there, which one the motion took."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.result import DynamicEvent
from graphsynth.dynamics.singular import branch_tangents
from graphsynth.dynamics.values import Values

if TYPE_CHECKING:
    from graphsynth.dynamics.forms.augmented import AugmentedForm

__all__ = ["passed_singular_pose"]

Array = NDArray[np.float64]

#: Smallest pivot over the largest seen: below the first a pose counts as singular, below the second as nearly so.
_SINGULAR, _NEARLY = 1e-5, 1e-2
#: Rounds of sampling; each is ten times finer.
_ZOOMS = 7


def passed_singular_pose(
    form: AugmentedForm, start: float, middle: float, end: float, first: Any, second: Any, largest: float
) -> DynamicEvent | None:
    """Locate the minimum of the smallest pivot over two steps with interpolants ``first`` and ``second``."""

    def pivot(t: float) -> float:
        return form.pivot_at(t, np.asarray((first if t <= middle else second)(t)))[0]

    width = end - start
    t, least = _lowest(pivot, start, end)
    least /= largest
    if least > _NEARLY:
        return None
    y = np.asarray((first if t <= middle else second)(t))
    _, q = form.pivot_at(t, y)
    n = form.compiled.n
    if least > _SINGULAR:
        text = f"nearly singular pose at t = {t:.9g} s: smallest pivot {least:.2g} of the largest; large reactions"
        return DynamicEvent("nearly singular pose", t, 1e-9 * width, text)
    text = f"singular pose passed at t = {t:.9g} s"
    return DynamicEvent("singular pose", t, 1e-7 * width, text + _branches(form, t, q, y[n : 2 * n]))


def _lowest(pivot: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """Return the minimum of a function with a sharp bend there, kinks elsewhere: by ever finer samples."""
    t, least, step = low, np.inf, (high - low) / 40.0
    for _ in range(_ZOOMS):
        for at in np.arange(low, high + 0.5 * step, step):
            value = pivot(float(at))
            if value < least:
                t, least = float(at), value
        low, high, step = max(t - step, low), min(t + step, high), 0.1 * step
    return t, least


def _branches(form: AugmentedForm, t: float, q: Array, v: Array) -> str:
    """Say which branches meet, and which one the motion follows."""
    values = Values(form.compiled, t, form.slots)
    U, S, Vt = np.linalg.svd(values.scaled_jacobian(q))
    count = int(np.sum(1e-4 * S[0] > S)) + max(0, U.shape[0] - len(S))
    kept = U.shape[0] - count
    tangents = branch_tangents(values, q, U[:, kept:], Vt[kept:].T)
    if tangents is None or tangents.kind != "change point":
        return "; what meets there is not resolved"
    rate = form.compiled.to_links(q, v, np.zeros_like(v))[1]
    unit = np.array([form.compiled.tables.size, form.compiled.tables.size, 1.0])
    along = [
        abs(float(((motion / unit) * (rate / unit)).sum())) / float(np.linalg.norm(motion / unit))
        for motion in tangents.motions
    ]
    size = float(np.linalg.norm(rate / unit)) or 1.0
    own = int(np.argmax(along))
    return (
        f"; two branches meet; the motion goes on along its own velocity, branch {own} "
        f"(cosines {along[0] / size:.6f}, {along[1] / size:.6f}): the other one would need an impulse; a change of the "
        "start by rounding does not change this choice, but close to rest it may"
    )
