"""Roots proved: Krawczyk's test in complex balls, real or not, all different (theory/nine-points 4).

In double precision first; the few roots that need more digits are tried again with balls of python-flint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.nine_points.equations import minors, slopes, value
from graphsynth.design.nine_points.task import Complex, Task
from graphsynth.intervals.balls import UP, Balls, exact, stack
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.operations import Array
from graphsynth.intervals.reading import precision

Mask = NDArray[np.bool_]
#: Relative distance of a root from its mirror image below which it is tried as a real one.
_NEAR_REAL = 1e-6
_BITS, _WIDTH = 256, 2.0**-120
#: Where the conjugate of an unknown stands.
MIRROR = [1, 0, 3, 2, 5, 4, 7, 6]


@dataclass(frozen=True, eq=False)
class ProvedRoots:
    """Roots of the nine-point equations, and what is proved of each.

    Attributes
    ----------
    box : Balls, shape (roots, 8)
        Midpoints ``box.mid`` and radii ``box.rad`` of a, a*, x, x*, b, b*, y, y*: pivots, and joints of the coupler at
        the first point, each with its conjugate, which is a number of its own (theory/nine-points 1).
    certified, proper : ndarray of bool
        A simple root lies in the box; and no link of it has length zero, no two pivots agree, every point is passed.
    real, complex : ndarray of bool
        The root is real: conjugate unknowns are conjugate; or it is not.  Where neither is true, this is undecided.
    distinct : ndarray of bool
        Proper, and no cognate of another one of these: they may be counted.
    """

    box: Balls
    certified: Mask
    proper: Mask
    real: Mask
    complex: Mask
    distinct: Mask


def prove(z: Complex, task: Task) -> ProvedRoots:
    """Prove what can be proved of approximate roots."""
    check_rounding()
    z = z.copy()
    z[:, [k for k in range(8) if k not in task.free]] = task.held.mid.ravel()  # paths end beside them
    mirror = z[:, MIRROR].conj()
    near = np.abs(z - mirror).max(axis=1) < _NEAR_REAL * (1.0 + np.abs(z).max(axis=1))
    centre = np.where(near[:, None], 0.5 * (z + mirror), z)
    box, certified = _krawczyk(centre, task)
    found, pairs = _judged(box, certified, certified & near, task)
    unclear = ~(found.proper & (found.real | found.complex))
    unclear[pairs] = True
    again = np.flatnonzero(unclear)
    for k in again:
        if (digits := _with_digits(z[k], task)) is not None:
            box.mid[k], box.rad[k], found.real[k] = digits
            certified[k] = True
    return _judged(box, certified, found.real, task)[0] if again.size else found


def _judged(box: Balls, certified: Mask, real: Mask, task: Task) -> tuple[ProvedRoots, NDArray[np.int64]]:
    apart = (np.abs(box.mid - box.mid[:, MIRROR].conj()) * (1.0 - 1e-15) > (box.rad + box.rad[:, MIRROR]) * UP).any(
        axis=1
    )
    with np.errstate(all="ignore"):
        proper = _proper(box, task) & certified
        pairs = np.flatnonzero(proper)[overlaps(marks(box[proper], len(task.pivots)))]
    distinct = proper.copy()
    distinct[pairs[:, 1]] = False
    return ProvedRoots(box, certified, proper, real, certified & ~real & apart, distinct), pairs


def _columns(box: Balls) -> list[Balls]:
    return [box[:, k, None] for k in range(8)]


def _krawczyk(z: Complex, task: Task) -> tuple[Balls, Mask]:
    """Boxes about z, their own mirror images if z is; where exactly one root in each is proved."""
    free, (p, q) = task.free, (task.points[:, 0], task.points[:, 1])
    held = np.zeros(z.shape)
    given = [k for k in range(8) if k not in free]
    held[:, given] = task.held.rad.ravel()
    centre = _columns(Balls(z, held))
    with np.errstate(all="ignore"):
        derivative = slopes(centre, p, q)
        inverse = exact(_inverses(np.stack([derivative[k].mid for k in free], axis=-1)))
        shift = inverse.times(value(centre, p, q)).size
        width = 4.0 * shift + 1e-15 * np.abs(z[:, free])
        r = held.copy()
        r[:, free] = np.maximum(width, width[:, [k ^ 1 for k in range(len(free))]])
        wide = slopes(_columns(Balls(z, r)), p, q)
        rest = inverse.times(stack([wide[k] for k in free])) - exact(np.eye(len(free)) + 0j)
        image = (shift + np.matmul(rest.size, r[:, free, None])[..., 0] * UP) * UP
        return Balls(z, r), np.asarray((image < r[:, free]).all(axis=1))


def _inverses(matrices: Complex) -> Complex:
    """Inverses, not proved; NaN where there is none."""
    found = np.full_like(matrices, np.nan)
    for k in np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2))):
        try:
            found[k] = np.linalg.inv(matrices[k])
        except np.linalg.LinAlgError:
            continue
    return found


def _with_digits(z: Complex, task: Task) -> tuple[Complex, Array, bool] | None:
    """Return midpoint and radii of one root, and whether it is real, proved with many digits; None if not proved."""
    import flint

    if not np.isfinite(z).all():
        return None
    free = task.free
    with precision(_BITS):
        points = [task.ball(point) for point in task.p[1:]]
        x = [flint.acb(complex(part)) for part in z]
        for k, pivot in enumerate(task.pivots):
            x[4 * k], x[4 * k + 1] = task.ball(pivot)
        try:
            for _ in range(8):
                x = _newton(x, points, free)
            conjugate = [flint.acb(x[k].real, -x[k].imag) for k in MIRROR]
            real = all(bool(abs(u - v) < (1.0 + abs(u)) * 2.0**-150) for u, v in zip(x, conjugate))
            if real:
                x = [((u + v) / 2).mid() if k in free else u for k, (u, v) in enumerate(zip(x, conjugate))]
            radius = max(float(abs(part).upper()) for part in x) * _WIDTH
            wide = list(x)
            for k in free:
                wide[k] = x[k] + flint.acb(flint.arb(0, radius), flint.arb(0, radius))
            matrix = _matrix(wide, points, free)
            inverse = flint.acb_mat(_matrix(x, points, free)).inv()
            inverse = flint.acb_mat([[inverse[i, j].mid() for j in range(len(free))] for i in range(len(free))])
            shift = inverse * flint.acb_mat([[value(x, p, q)] for p, q in points])
            unit = flint.acb_mat([[flint.acb(i == j) for j in range(len(free))] for i in range(len(free))])
            rest = (unit - inverse * flint.acb_mat(matrix)) * flint.acb_mat([[wide[k] - x[k]] for k in free])
            image = [rest[i, 0] - shift[i, 0] for i in range(len(free))]
        except ZeroDivisionError:
            return None
        if not all(bool(abs(part.real) < radius) and bool(abs(part.imag) < radius) for part in image):
            return None
        mid = np.array([complex(part.real, part.imag) for part in x])
        rad = [float((abs(part - flint.acb(complex(m))) + 2.0 * radius).upper()) for part, m in zip(x, mid)]
        return mid, np.nextafter(np.array(rad), np.inf), real


def _matrix(x: list[Any], points: list[tuple[Any, Any]], free: list[int]) -> list[list[Any]]:
    rows = [slopes(x, p, q) for p, q in points]
    return [[row[k] for k in free] for row in rows]


def _newton(x: list[Any], points: list[tuple[Any, Any]], free: list[int]) -> list[Any]:
    """One step of Newton's method on midpoints."""
    import flint

    step = flint.acb_mat(_matrix(x, points, free)).solve(flint.acb_mat([[value(x, p, q)] for p, q in points]))
    moved = list(x)
    for i, k in enumerate(free):
        moved[k] = (x[k] - step[i, 0]).mid()
    return moved


def _proper(box: Balls, task: Task) -> Mask:
    """Where no degenerate linkage lies in the box."""
    z = _columns(box)
    parts = [z[2], z[3], z[6], z[7]]
    parts += [z[i] - z[j] for i, j in ((0, 4), (1, 5), (2, 6), (3, 7), (0, 2), (1, 3), (4, 6), (5, 7))]
    parts += [minors(z, task.points[:, 0], task.points[:, 1])[2]]
    return np.asarray(np.logical_and.reduce([(part.least > 0.0).all(axis=1) for part in parts]))


def reciprocal(b: Balls) -> Balls:
    """Reciprocals of complex balls; of infinite radius where zero is not excluded.

    With w near 1 / b and ``|1 - b w| <= t < 1``: ``|1 / b - w| <= t |w| / (1 - t)``.
    """
    with np.errstate(all="ignore"):
        w = 1.0 / b.mid
        t = (exact(1.0) - b * exact(w)).size
        rad = t * np.abs(w) / (1.0 - t) * UP * UP
    good = (t < 0.5) & np.isfinite(rad)
    return Balls(np.where(good, w, 0.0), np.where(good, rad, np.inf))


def marks(box: Balls, pivots: int) -> list[Balls]:
    """Return numbers that agree for cognates: symmetric functions of the pivots; for given pivots, the joints."""
    a, aa, x, xx, b, bb, y, yy = (box[:, k] for k in range(8))
    if pivots == 2:
        return [x, xx, y, yy]
    found = []
    for f, g, s, t in ((a, b, x, y), (aa, bb, xx, yy)):
        e = (f * t - g * s) * reciprocal(t - s)
        found += [f + g + e, f * g + (f + g) * e, f * g * e]
    return found


def overlaps(marks: list[Balls]) -> NDArray[np.int64]:
    """Pairs of rows that no mark tells apart, shape (pairs, 2): a sweep along the real part of the first mark."""
    first = marks[0]
    size = np.abs(first.mid.real) * 1e-15 + first.rad * UP
    low, high = first.mid.real - size, first.mid.real + size
    order = np.argsort(low)
    low, high = low[order], high[order]
    pairs = []
    for step in range(1, len(low)):
        i = np.flatnonzero(~(low[step:] > high[:-step]))
        if i.size == 0:
            break
        one, other = order[i], order[i + step]
        clear = np.zeros(i.size, dtype=bool)
        for mark in marks:
            clear |= (mark[one] - mark[other]).least > 0.0
        pairs.append(np.sort(np.stack([one, other], axis=1)[~clear], axis=1))
    return np.concatenate([np.empty((0, 2), dtype=np.int64), *pairs])
