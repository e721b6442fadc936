"""`certify_assembly_modes_batch`: many direct problems at once, in ball arithmetic on arrays.

The same tests as `certify_assembly_modes`, in double precision for all problems together; what these cannot decide is
done one by one with more digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import triples
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import TINY, UP, Balls, exact, join, tau_times, unit
from graphsynth.intervals.guard import check_rounding
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

_NODES = 32
_LEVELS = 20
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


class _Coefficients(NamedTuple):
    """G, N and Delta of all problems as balls, each of shape (N,)."""

    g: tuple[Balls, Balls, Balls, Balls]
    n: tuple[Balls, Balls, Balls, Balls]
    d: tuple[Balls, Balls]

    def take(self, i: Index) -> _Coefficients:
        """Return some problems, with repetitions."""
        g0, g1, g2, g3 = (c[i] for c in self.g)
        n2, n1, n0, nm = (c[i] for c in self.n)
        return _Coefficients((g0, g1, g2, g3), (n2, n1, n0, nm), (self.d[0][i], self.d[1][i]))

    def value(self, z: Balls) -> Balls:
        """Return G at points of the circle."""
        g0, g1, g2, g3 = self.g
        return g0 + 2.0 * (z * (g1 + z * (g2 + z * g3))).real

    def slope(self, z: Balls) -> Balls:
        """Return the derivative of G by alpha."""
        _, g1, g2, g3 = self.g
        return -2.0 * (z * (g1 + z * (2.0 * g2 + z * (3.0 * g3)))).imag

    def bend(self) -> Array:
        """Bound of ``|G''|``."""
        _, g1, g2, g3 = self.g
        return np.asarray(2.0 * (g1.size + 4.0 * g2.size + 9.0 * g3.size) * UP)


class _Arcs(NamedTuple):
    """Arcs of problems: first node, in units of the finest grid; signs of G at both ends; width in turns is common."""

    problem: Index
    low: NDArray[np.int64]
    at_low: Balls
    at_high: Balls


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
        For each problem the number of modes and enclosures, or undecided (certified).

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
    parts: list[list[NDArray[np.generic]]] = []
    counts = np.full(len(A.mid), -1, dtype=np.intp)
    for k in range(0, len(A.mid), _CHUNK):
        key = slice(k, k + _CHUNK)
        with np.errstate(all="ignore"):
            problem, poses, radii, signs, decided = _decide(A[key], b[key], l2[key])
        counts[key][decided] = np.bincount(problem, minlength=decided.size)[decided]
        parts.append([problem + k, poses, radii, signs])
    parts.append(_one_by_one(np.flatnonzero(counts < 0), A, b, l2, given, counts))
    problem, poses, radii, signs = (np.concatenate(column) for column in zip(*parts))
    order = np.lexsort((poses[:, 2], problem))
    return AssemblyCertificateBatch(problem[order], poses[order], radii[order], signs[order], counts)


def _one_by_one(
    left: Index,
    A: Balls,
    b: NDArray[np.complex128],
    l2: Array,
    given: tuple[ParallelPlatform, Array] | None,
    counts: Index,
) -> list[NDArray[np.generic]]:
    """Decide the rest with more digits; ``counts`` is filled in."""
    from graphsynth.systems.platform.certified_assembly_modes import certify_assembly_modes, certify_direct

    rows: list[tuple[int, Array, Array, int]] = []
    for i in left.tolist():
        if given is None:
            found = certify_assembly_modes(A.mid[i].tolist(), b[i].tolist(), l2[i].tolist(), cross_check=False)
        else:
            found = certify_direct(given[0], given[1][i].tolist(), cross_check=False)
        if found.certified:
            counts[i] = len(found)
            for mode in found.modes:
                sign = 1 if mode.determinant > 0 else -1 if mode.determinant < 0 else 0
                rows.append((i, mode.pose, mode.radius, sign))
    return [
        np.array([row[0] for row in rows], dtype=np.intp),
        np.array([row[1] for row in rows]).reshape(-1, 3),
        np.array([row[2] for row in rows]).reshape(-1, 3),
        np.array([row[3] for row in rows], dtype=np.int8),
    ]


def _coefficients(A: Balls, b: Balls, l2: Balls) -> _Coefficients:
    """theory/platform-direct 1, for every problem."""
    a2, a3, b2, b3 = A[:, 1] - A[:, 0], A[:, 2] - A[:, 0], b[:, 1] - b[:, 0], b[:, 2] - b[:, 0]
    squares = l2 * l2
    L = squares[:, 0]
    w20 = squares[:, 1] - L - _square(a2) - _square(b2)
    w30 = squares[:, 2] - L - _square(a3) - _square(b3)
    w21, w31 = b2 * a2.conj, b3 * a3.conj
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = w21.conj * b3 - w20 * a3 + w30 * a2 - w31.conj * b2
    nm = w31.conj * a2 - w21.conj * a3
    d0 = (2.0 * (b2.conj * b3 + a2.conj * a3).imag).times_i
    de = b2 * a3.conj - a2.conj * b3
    g3 = n2 * nm.conj
    g2 = n2 * n0.conj + n1 * nm.conj + L * de * de
    g1 = n2 * n1.conj + n1 * n0.conj + n0 * nm.conj + 2.0 * L * d0 * de
    g0 = _square(n2) + _square(n1) + _square(n0) + _square(nm) - L * (_square(d0) + 2.0 * _square(de))
    return _Coefficients((g0, g1, g2, g3), (n2, n1, n0, nm), (d0, de))


def _square(z: Balls) -> Balls:
    return z.real * z.real + z.imag * z.imag


@cache
def _fine() -> Balls:
    """``exp(2 pi i j / 2^25)`` for j = 0 .. 1023 and, behind them, for j = 1024 * (0 .. 1023) and 2^20 * (0 .. 31).

    The last part holds the shift of the nodes.  Products of three entries are the nodes of every level.
    """
    turns = np.concatenate([np.arange(1024.0) * 2.0**-25, np.arange(1024.0) * 2.0**-15, np.arange(32.0) / 32 + _SHIFT])
    return unit(tau_times(turns))


def _node(j: NDArray[np.int64]) -> Balls:
    """Point of the circle at ``j / 2^25`` of a turn from the first node."""
    table = _fine()
    j = j % (1 << 25)
    return table[j & 1023] * table[1024 + ((j >> 10) & 1023)] * table[2048 + (j >> 20)]


def _decide(A: Balls, b: NDArray[np.complex128], l2: Array) -> tuple[Index, Array, Array, NDArray[np.int8], Mask]:
    """Modes of the problems that double precision decides, and which these are."""
    size = np.maximum(np.abs(A.mid - A.mid[:, :1]).max(axis=1), np.abs(b - b[:, :1]).max(axis=1))
    power: Array = np.ldexp(1.0, np.frexp(np.maximum(size, l2.max(axis=1)))[1])
    unit_length = power[:, None]
    unit_length = np.where(np.isfinite(unit_length) & (unit_length > 0.0), unit_length, 1.0)
    scaled = Balls(A.mid / unit_length, A.rad / unit_length * UP + TINY)  # a power of two: exact
    vertices, legs = exact(b / unit_length), exact(l2 / unit_length)
    s = _coefficients(scaled, vertices, legs)
    # beyond these sizes products of lengths leave the range of doubles
    decided = np.asarray((power > 2.0**-150) & (power < 2.0**150))
    problem, low, width = _isolate(s, decided)
    alpha = _refine(s.take(problem), low, width)
    x, y, determinant = _poses(s.take(problem), scaled[problem], vertices[problem], alpha)
    scale = unit_length[problem, 0]
    mid = np.stack([x.mid * scale, y.mid * scale, _principal(alpha.mid)], axis=-1)
    turned = (Balls(mid[:, 2], np.zeros(len(mid))) - alpha).size  # a whole turn and its rounding
    turned = np.where(turned > 1.0, (exact(mid[:, 2]) - alpha + tau_times(np.sign(alpha.mid))).size, turned)
    radius = np.stack([x.rad * scale * UP, y.rad * scale * UP, turned], axis=-1)
    sign = np.where(determinant.least > 0.0, np.sign(determinant.mid), 0.0)
    bad = ~np.isfinite(radius).all(axis=1) | (sign == 0.0)
    decided[problem[bad]] = False
    balance = np.bincount(problem, weights=sign, minlength=len(l2))
    decided &= balance == 0.0
    keep = decided[problem]
    return problem[keep], mid[keep], radius[keep], sign[keep].astype(np.int8), decided


def _isolate(s: _Coefficients, decided: Mask) -> tuple[Index, NDArray[np.int64], Array]:
    """Arcs with exactly one simple root: problem, first node, width in units of the finest grid.

    ``decided`` is set to False where a sign or a count is not proved.
    """
    count = len(decided)
    step = 1 << 20
    grid = _node(np.arange(_NODES, dtype=np.int64) * step)
    each = np.repeat(np.arange(count), _NODES)
    values = s.take(each).value(Balls(np.tile(grid.mid, count), np.tile(grid.rad, count)))
    following = np.roll(np.arange(count * _NODES).reshape(count, _NODES), -1, axis=1).ravel()
    arcs = _Arcs(each, np.tile(np.arange(_NODES, dtype=np.int64) * step, count), values, values[following])
    bend = s.bend()
    found: list[tuple[Index, NDArray[np.int64], Array]] = []
    for _ in range(_LEVELS):
        decided[arcs.problem[(arcs.at_low.least <= 0.0) | (arcs.at_high.least <= 0.0)]] = False
        alive = decided[arcs.problem]
        arcs = _Arcs(arcs.problem[alive], arcs.low[alive], arcs.at_low[alive], arcs.at_high[alive])
        h = step * (2.0 * np.pi * 2.0**-25) * (1.0 + 1e-14)
        least = np.minimum(arcs.at_low.least, arcs.at_high.least)
        same = (arcs.at_low.mid > 0.0) == (arcs.at_high.mid > 0.0)
        rest = ~(same & (least > bend[arcs.problem] * (h * h / 8.0) * (1.0 + 1e-14)))
        arcs = _Arcs(arcs.problem[rest], arcs.low[rest], arcs.at_low[rest], arcs.at_high[rest])
        same = same[rest]
        middle = arcs.low + step // 2
        z, own = _node(middle), s.take(arcs.problem)
        monotone = own.slope(z).least > bend[arcs.problem] * (h / 2.0) * (1.0 + 1e-14)
        single = monotone & ~same
        found.append((arcs.problem[single], arcs.low[single], np.full(int(single.sum()), float(step))))
        left = ~monotone
        if step == 2 or not left.any():
            decided[arcs.problem[left]] = False
            break
        at = own.value(z)
        p, low, mid, a, m, c = (
            arcs.problem[left],
            arcs.low[left],
            middle[left],
            arcs.at_low[left],
            at[left],
            arcs.at_high[left],
        )
        arcs = _Arcs(np.concatenate([p, p]), np.concatenate([low, mid]), join(a, m), join(m, c))
        step //= 2
    else:
        decided[arcs.problem] = False
    problem, first, width = (np.concatenate(column) for column in zip(*found))
    return problem, first, width


def _refine(s: _Coefficients, low: NDArray[np.int64], width: Array) -> Balls:
    """Enclose the root of each arc: safeguarded Newton in floating point, then one interval Newton step around it."""
    grid = 2.0 * np.pi * 2.0**-25
    left = low * grid + 2.0 * np.pi * _SHIFT
    a, c = left.copy(), left + width * grid
    g1, g2, g3 = s.g[1].mid, s.g[2].mid, s.g[3].mid
    positive = s.g[0].mid + 2.0 * (lambda z: z * (g1 + z * (g2 + z * g3)))(np.exp(1j * a)).real >= 0.0
    x = 0.5 * (a + c)
    for _ in range(12):
        z = np.exp(1j * x)
        value = s.g[0].mid + 2.0 * (z * (g1 + z * (g2 + z * g3))).real
        slope = -2.0 * (z * (g1 + z * (2.0 * g2 + z * (3.0 * g3)))).imag
        before = (value >= 0.0) == positive
        a, c = np.where(before, x, a), np.where(before, c, x)
        new = x - value / slope
        x = np.where((new >= a) & (new <= c), new, 0.5 * (a + c))
    value, bend = s.value(unit(exact(x))), s.bend()
    slope_ball = s.slope(unit(exact(x)))
    # |G'| >= |G'(x)| - r bend within r of x; a root is within r if |G(x)| < r times that, and the arc holds only one
    r = 4.0 * value.size / slope_ball.least + 1e-300
    inside = (left + 1e-13 <= x - r) & (x + r <= left + width * grid - 1e-13)  # the ends are rounded
    good = (slope_ball.least > 0.0) & inside & (r * (slope_ball.least - r * bend) * (1.0 - 1e-14) > value.size)
    tight = value.size / (slope_ball.least - r * bend) * (1.0 + 1e-13) + 1e-300
    return Balls(x, np.where(good, tight, np.inf))


def _poses(s: _Coefficients, A: Balls, b: Balls, alpha: Balls) -> tuple[Balls, Balls, Balls]:
    """Position and ``det JX`` of every root, in scaled lengths; of infinite radius where Delta may vanish."""
    z = unit(alpha)
    back = z.conj
    n2, n1, n0, nm = s.n
    Delta = (s.d[0] + s.d[1] * z - s.d[1].conj * back).imag  # purely imaginary
    N = (n2 * z + n1) * z + n0 + nm * back
    Q = Balls(-1j * N.mid, N.rad)  # N / (i Im Delta)
    x, y = Q.real / Delta, Q.imag / Delta
    origin = A[:, 0] - z * b[:, 0]
    x, y = x + origin.real, y + origin.imag
    p = Balls(x.mid + 1j * y.mid, x.rad + y.rad)
    rows = []
    for k in range(3):
        arm = z * b[:, k]
        d = p + arm - A[:, k]
        rows.append((d.real, d.imag, (arm.conj * d).imag))
    (a, q, c), (e, f, g), (h, i, j) = rows
    determinant = 8.0 * (a * (f * j - g * i) - q * (e * j - g * h) + c * (e * i - f * h))
    return x, y, determinant


def _principal(alpha: Array) -> Array:
    """Alpha in (-pi, pi]."""
    return np.asarray(np.pi - np.mod(np.pi - alpha, 2.0 * np.pi)) if alpha.size else alpha
