"""When Krawczyk's test in (x, y) can succeed: the spectral radius of ``|I - Y L|`` on a box."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graphsynth.core.checks import checked
from graphsynth.intervals.interval import Interval

if TYPE_CHECKING:
    from graphsynth.jamming.intersection.problem import CircleEllipse

__all__ = ["RHO_LIMIT", "spectral_radius"]

#: On the exact hull enlarged by s the image has radius 1 + s^2 rho: below s for some s only if rho < 1/4 (section 6.6).
RHO_LIMIT = 0.25


@checked
def spectral_radius(problem: CircleEllipse, box: Interval) -> float:
    """Spectral radius of ``|I - Y L|`` on a box of the quadrant, Y the inverse of mid L.

    An estimate in double precision.  As ``I - Y mid L = 0``, it is the radius of ``|Y| rad L``; infinite where mid L
    is singular (a circle, or a box at the origin).

    Examples
    --------
    >>> from graphsynth.jamming.intersection import circle_ellipse
    >>> box = Interval.from_bounds([4.0, 2.9], [4.1, 3.0])
    >>> round(spectral_radius(circle_ellipse(5, 6, 4), box), 4)
    0.0733
    """
    if box.is_empty.any():
        return 0.0
    unit = problem.R1.hi  # lengths in units of the radius, so that no unit of the data overflows
    x, y, rx, ry = (np.concatenate([box.mid, box.rad]) / float(unit)).tolist()
    bounds = [(unit**2 / r.hi**2, unit**2 / r.lo**2) for r in (problem.a, problem.b)]
    (alpha, beta), (da, db) = [float((p + q) / 2) for p, q in bounds], [float((q - p) / 2) for p, q in bounds]
    difference = float(sum(bounds[1]) - sum(bounds[0])) / 2
    determinant = 4.0 * x * y * difference
    if determinant == 0.0:
        return float("inf")
    inverse = np.abs(np.array([[2 * beta * y, -2 * y], [-2 * alpha * x, 2 * x]]) / determinant)
    radius = 2.0 * np.array([[rx, ry], [alpha * rx + da * (x + rx), beta * ry + db * (y + ry)]])
    return float(np.abs(np.linalg.eigvals(inverse @ radius)).max())
