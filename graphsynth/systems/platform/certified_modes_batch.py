"""`certify_assembly_modes_batch`: many direct problems at once, in ball arithmetic on arrays.

The same tests as `certify_assembly_modes`, in double precision for all problems together; what these cannot decide is
done one by one with more digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import triples
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import TINY, UP, Balls, exact, join, tau_times, unit
from graphsynth.intervals.guard import check_rounding
from graphsynth.kinematics.triad.assembly_modes import Sextic, coefficients
from graphsynth.systems.platform.certified_assembly_modes import certify_assembly_modes, certify_direct
from graphsynth.systems.platform.certified_exact_modes import slope, value
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

_NODES = 32
_SHIFT = 2.0**-9  # turns; no simple fraction of a turn is a node
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class AssemblyCertificateBatch:
    """Assembly modes of N problems in one list, with proof.

    ``poses[i]`` (x, y, alpha) with the bounds ``radii[i]`` of its distance from the exact pose and the proved sign
    ``signs[i]`` of ``det JX`` belongs to problem ``problem[i]``; problems ascend, and alpha within each.  ``counts``
    has shape (N,): -1 where the problem is UNDECIDED; ``certified`` is its mask.
    """

    problem: Index
    poses: Array
    radii: Array
    signs: NDArray[np.int8]
    counts: Index

    @property
    def certified(self) -> Mask:
        """Problems whose count and poses are proved, shape (N,)."""
        return np.asarray(self.counts >= 0)


def _some(s: Sextic, i: Index) -> Sextic:
    """Coefficients of some problems, with repetitions."""
    parts: Any = (tuple(c[i] for c in part) for part in s)
    return Sextic(*parts)


def _bend(s: Sextic) -> Array:
    """Bound of ``|G''|``."""
    return np.asarray(2.0 * (s.g[1].size + 4.0 * s.g[2].size + 9.0 * s.g[3].size) * UP)


def certify_assembly_modes_batch(
    anchors: ArrayLike, vertices: ArrayLike, lengths: ArrayLike
) -> AssemblyCertificateBatch:
    """Prove the number of assembly modes of many problems and enclose every pose.

    Parameters
    ----------
    anchors : array_like of complex, shape (N, 3)
    vertices : array_like of complex, shape (3,) or (N, 3)
    lengths : array_like of float, shape (3,) or (N, 3)
        All taken as exact.

    Returns
    -------
    AssemblyCertificateBatch

    Raises
    ------
    GeometryError
        Numbers that are not finite, a negative length, shapes that do not fit.

    Notes
    -----
    See theory/platform-direct 5.

    Examples
    --------
    >>> corner = np.array([-0.4 - 0.25j, 0.45 - 0.3j, 0.05 + 0.5j])
    >>> certify_assembly_modes_batch([[0.9, 3.5 + 0.2j, 1.9 + 2.3j], [0, 9, 9j]], corner, [1.1, 0.95, 1.05]).counts
    array([2, 0])
    """
    A = np.atleast_2d(np.asarray(anchors, dtype=np.complex128))
    if A.ndim != 2 or A.shape[1] != 3:
        raise GeometryError(f"anchors have shape {A.shape}; give three complex numbers for each problem")
    return _batch(exact(A), vertices, lengths)


def certify_direct_batch(platform: ParallelPlatform, theta: ArrayLike) -> AssemblyCertificateBatch:
    """Prove the number of assembly modes of a platform at many rocker angles, shape (N, 3), and enclose every pose.

    The anchors are balls that hold ``D_k + l1_k exp(i theta_k)``; problems that these balls do not decide are repeated
    with the exact data.

    Parameters
    ----------
    platform : ParallelPlatform
    theta : array_like, shape (N, 3)
        Rocker angles, radians.

    Returns
    -------
    AssemblyCertificateBatch

    Raises
    ------
    GeometryError
        For another shape, or angles that are not finite.

    Examples
    --------
    >>> certify_direct_batch(ParallelPlatform.g1(), [[0.0, 0.0, 0.0], [1.82, -2.64, -0.16]]).counts
    array([2, 2])
    """
    angles = np.atleast_2d(triples("theta", theta))
    if angles.ndim != 2:
        raise GeometryError(f"theta has shape {angles.shape}; give three finite angles for each problem")
    anchors = exact(np.array(platform.D)) + exact(np.array(platform.l1)) * unit(exact(angles))
    return _batch(anchors, platform.b, platform.l2, (platform, angles))


def _batch(
    A: Balls, vertices: ArrayLike, lengths: ArrayLike, given: tuple[ParallelPlatform, Array] | None = None
) -> AssemblyCertificateBatch:
    check_rounding()
    try:
        b = np.broadcast_to(np.asarray(vertices, dtype=np.complex128), A.mid.shape)
        l2 = np.broadcast_to(np.asarray(lengths, dtype=np.float64), A.mid.shape)
    except ValueError as error:
        raise GeometryError(f"vertices and lengths do not fit {len(A.mid)} problems of three legs: {error}") from error
    for name, values in (("anchors", A.mid), ("vertices", b), ("lengths", l2)):
        if not np.isfinite(values).all():
            raise GeometryError(f"{name} hold a number that is not finite; give finite numbers only")
    if (l2 < 0.0).any():
        raise GeometryError(f"lengths hold {float(l2.min())}; a leg length must be zero or more")
    parts = []
    counts = np.full(len(A.mid), -1, dtype=np.intp)
    for k in range(0, len(A.mid), _CHUNK):
        key = slice(k, k + _CHUNK)
        with np.errstate(all="ignore"):
            rows, decided = _decide(A[key], b[key], l2[key])
        counts[key][decided] = np.bincount(rows[:, 0].astype(np.intp), minlength=decided.size)[decided]
        rows[:, 0] += k
        parts.append(rows)
    for i in np.flatnonzero(counts < 0).tolist():  # with more digits
        if given is None:
            found = certify_assembly_modes(A.mid[i].tolist(), b[i].tolist(), l2[i].tolist(), cross_check=False)
        else:
            found = certify_direct(given[0], given[1][i].tolist(), cross_check=False)
        if found.certified:
            counts[i] = len(found)
            for mode in found.modes:
                sign = bool(mode.determinant > 0) - bool(mode.determinant < 0)
                parts.append(np.array([[i, *mode.pose, *mode.radius, sign]]))
    rows = np.concatenate([np.zeros((0, 8)), *parts])
    rows = rows[np.lexsort((rows[:, 3], rows[:, 0]))]
    problem, signs = rows[:, 0].astype(np.intp), rows[:, 7].astype(np.int8)
    return AssemblyCertificateBatch(problem, rows[:, 1:4].copy(), rows[:, 4:7].copy(), signs, counts)


@cache
def _fine() -> Balls:
    """``exp(2 pi i j / 2^25)`` for j = 0 .. 1023, j = 1024 * (0 .. 1023), and j = 2^20 * (0 .. 31) with the shift."""
    turns = np.concatenate([np.arange(1024.0) * 2.0**-25, np.arange(1024.0) * 2.0**-15, np.arange(32.0) / 32 + _SHIFT])
    return unit(tau_times(turns))


def _node(j: NDArray[np.int64]) -> Balls:
    """Point of the circle at ``j / 2^25`` of a turn from the first node, as a product of three in the table."""
    table = _fine()
    j = j % (1 << 25)
    return table[j & 1023] * table[1024 + ((j >> 10) & 1023)] * table[2048 + (j >> 20)]


def _decide(A: Balls, b: NDArray[np.complex128], l2: Array) -> tuple[Array, Mask]:
    """Modes of the problems that double precision decides, and which these are.

    A row for each mode: problem, pose, radii, sign of ``det JX``.
    """
    size = np.maximum(np.abs(A.mid - A.mid[:, :1]).max(axis=1), np.abs(b - b[:, :1]).max(axis=1))
    power: Array = np.ldexp(1.0, np.frexp(np.maximum(size, l2.max(axis=1)))[1])
    unit_length = np.where(np.isfinite(power) & (power > 0.0), power, 1.0)[:, None]
    scaled = Balls(A.mid / unit_length, A.rad / unit_length * UP + TINY)  # a power of two: exact
    vertices, legs = exact(b / unit_length), exact(l2 / unit_length)
    anchors, corners, sides = ([rows[:, k] for k in range(3)] for rows in (scaled, vertices, legs))
    s = coefficients(anchors, corners, sides, lambda z: z.conj, lambda x: x.times_i)
    # beyond these sizes products of lengths leave the range of doubles
    decided = np.asarray((power > 2.0**-150) & (power < 2.0**150))
    problem, low, width = _isolate(s, decided)
    own = _some(s, problem)
    alpha = _refine(own, low, width)
    x, y, determinant = _poses(own, scaled[problem], vertices[problem], alpha)
    scale, principal = unit_length[problem, 0], np.pi - np.mod(np.pi - alpha.mid, 2.0 * np.pi)
    turned = (exact(principal) - alpha).size  # a whole turn and its rounding
    turned = np.where(turned > 1.0, (exact(principal) - alpha + tau_times(np.sign(alpha.mid))).size, turned)
    radii = [x.rad * scale * UP, y.rad * scale * UP, turned]
    sign = np.where(determinant.least > 0.0, np.sign(determinant.mid), 0.0)
    decided[problem[~np.isfinite(radii).all(axis=0) | (sign == 0.0)]] = False
    decided &= np.bincount(problem, weights=sign, minlength=len(l2)) == 0.0
    rows = np.column_stack([problem, x.mid * scale, y.mid * scale, principal, *radii, sign])
    return rows[decided[problem]], decided


def _isolate(s: Sextic, decided: Mask) -> tuple[Index, NDArray[np.int64], Array]:
    """Arcs with exactly one simple root: problem, first node, width in units of the finest grid.

    ``decided`` is set to False where a sign or a count is not proved.
    """
    step = 1 << 20
    rows, numbers = np.divmod(np.arange(len(decided) * _NODES), _NODES)
    at = value(_some(s, rows).g, _node(np.arange(_NODES) * step)[numbers])
    # problem and first node of arcs of one width, values of G at both ends
    arcs: Any = (rows, numbers * step, at, at[rows * _NODES + (numbers + 1) % _NODES])
    bend = _bend(s)
    found: list[tuple[Index, NDArray[np.int64], Array]] = []
    while True:
        problem, low, first, last = arcs
        decided[problem[(first.least <= 0.0) | (last.least <= 0.0)]] = False
        h = step * (2.0 * np.pi * 2.0**-25) * (1.0 + 1e-14)
        same = (first.mid > 0.0) == (last.mid > 0.0)
        free = same & (np.minimum(first.least, last.least) > bend[problem] * (h * h / 8.0) * (1.0 + 1e-14))
        problem, low, first, last, same = (part[decided[problem] & ~free] for part in (*arcs, same))
        middle = low + step // 2
        z, own = _node(middle), _some(s, problem)
        monotone = slope(own.g, z).least > bend[problem] * (h / 2.0) * (1.0 + 1e-14)
        single = monotone & ~same
        found.append((problem[single], low[single], np.full(int(single.sum()), float(step))))
        left = ~monotone
        if step == 2 or not left.any():
            decided[problem[left]] = False
            break
        parts = (problem, low, middle, first, value(own.g, z), last)
        problem, low, middle, first, at, last = (part[left] for part in parts)
        arcs = (np.concatenate([problem] * 2), np.concatenate([low, middle]), join(first, at), join(at, last))
        step //= 2
    problem, nodes, width = (np.concatenate(column) for column in zip(*found))
    return problem, nodes, width


def _refine(s: Sextic, low: NDArray[np.int64], width: Array) -> Balls:
    """Enclose the root of each arc: safeguarded Newton in floating point, then one interval Newton step around it."""
    grid = 2.0 * np.pi * 2.0**-25
    left = low * grid + 2.0 * np.pi * _SHIFT
    a, c = left.copy(), left + width * grid
    middles = [g.mid for g in s.g]
    positive = value(middles, np.exp(1j * a)) >= 0.0
    x = 0.5 * (a + c)
    for _ in range(12):
        z = np.exp(1j * x)
        at = value(middles, z)
        before = (at >= 0.0) == positive
        a, c = np.where(before, x, a), np.where(before, c, x)
        new = x - at / slope(middles, z)
        x = np.where((new >= a) & (new <= c), new, 0.5 * (a + c))
    z = unit(exact(x))
    size, least, bend = value(s.g, z).size, slope(s.g, z).least, _bend(s)
    # |G'| >= |G'(x)| - r bend within r of x; a root is within r if |G(x)| < r times that, and the arc holds only one
    r = 4.0 * size / least + 1e-300
    inside = (left + 1e-13 <= x - r) & (x + r <= left + width * grid - 1e-13)  # the ends are rounded
    good = (least > 0.0) & inside & (r * (least - r * bend) * (1.0 - 1e-14) > size)
    tight = size / (least - r * bend) * (1.0 + 1e-13) + 1e-300
    return Balls(x, np.where(good, tight, np.inf))


def _poses(s: Sextic, A: Balls, b: Balls, alpha: Balls) -> tuple[Balls, Balls, Balls]:
    """Position and ``det JX`` of every root, in scaled lengths; of infinite radius where Delta may vanish."""
    z = unit(alpha)
    back, (n2, n1, n0, nm) = z.conj, s.n
    Delta = (s.d[0] + s.d[1] * z - s.d[1].conj * back).imag  # purely imaginary
    N = (n2 * z + n1) * z + n0 + nm * back
    Q = Balls(-1j * N.mid, N.rad)  # N / (i Im Delta)
    origin = A[:, 0] - z * b[:, 0]
    x, y = Q.real / Delta + origin.real, Q.imag / Delta + origin.imag
    p = Balls(x.mid + 1j * y.mid, x.rad + y.rad)
    rows = []
    for k in range(3):
        arm = z * b[:, k]
        d = p + arm - A[:, k]
        rows.append((d.real, d.imag, (arm.conj * d).imag))
    (a, q, c), (e, f, g), (h, i, j) = rows
    determinant = 8.0 * (a * (f * j - g * i) - q * (e * j - g * h) + c * (e * i - f * h))
    return x, y, determinant
