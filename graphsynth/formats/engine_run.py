"""What a run of any engine gives back, in the coordinates of graphsynth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.core.extras import need

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EngineRun:
    """The motion that an engine computed (estimated; nothing is known of its error until it is compared).

    Attributes
    ----------
    engine, version : str
    settings : str
        Integrator, constraint parameters.
    step : float
        Seconds.
    times : ndarray, shape (n,)
    poses, velocities : ndarray, shape (n, links, 3)
        ``(x, y, theta)`` of the link frames, m and rad; NaN from where the engine failed.
    status : str
        "completed" or "failed".
    message : str
        One sentence.
    steps : int
    seconds : float
        Wall time of the integration alone.
    """

    engine: str
    version: str
    settings: str
    step: float
    times: Array
    poses: Array
    velocities: Array
    status: str
    message: str
    steps: int
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether the last output time was reached with finite numbers."""
        return self.status == "completed"


def load_engine(name: str) -> Any:
    """Import an engine; `MissingExtraError` if it is not installed."""
    return need(name, "crosscheck", "a run in another engine")


def steps_between(times: ArrayLike, step: float) -> tuple[Array, list[int]]:
    """Return the times and the whole numbers of steps from the first to each of them.

    >>> steps_between([0.0, 0.5, 2.0], 0.25)[1]
    [0, 2, 8]
    """
    grid = finite_array("times", times, nan=True)
    if grid.ndim != 1 or grid.size < 2 or not np.isfinite(grid).all() or (np.diff(grid) <= 0.0).any():
        raise GeometryError("times must be a list of two or more finite numbers that increase; sort them")
    if not (np.isfinite(step) and step > 0.0):
        raise GeometryError(f"step = {step} s must be positive; give the step of the engine")
    counts = (grid - grid[0]) / step
    whole = np.rint(counts)
    if (np.abs(counts - whole) > 1e-6 * np.maximum(1.0, whole)).any() or (np.diff(whole) < 1.0).any():
        raise GeometryError(f"step = {step} s does not divide the output times; give a step that does")
    return grid, [int(n) for n in whole]


def turn(angle: float, place: tuple[float, float]) -> tuple[float, float]:
    """Turn a point or vector by an angle (rad)."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return c * place[0] - s * place[1], s * place[0] + c * place[1]
