"""Direct problem of the planar platform: every pose for given anchors and leg lengths (3-RPR)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.kinematics.sextic import Sextic, real_roots, sextic

__all__ = ["AssemblyModeBatch", "AssemblyModes", "assembly_modes", "assembly_modes_batch"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: (pivots, arms, angles): lets the anchors be recomputed at higher precision
Arms = tuple[tuple[complex, complex, complex], tuple[float, float, float], tuple[float, ...]]

_CHUNK = 8192


@dataclass(frozen=True, eq=False)
class AssemblyModes:
    """All assembly modes of one problem, sorted by alpha.

    Attributes
    ----------
    poses : ndarray, shape (m, 3)
        ``(x, y, alpha)`` with alpha in (-pi, pi]; m is 0 to 6, or 0 with ``self_motion`` set.
    determinants : ndarray, shape (m,)
        ``det JX`` of every mode, length^4.
    residuals : ndarray, shape (m,)
        Largest ``|f_k|`` relative to the square of the largest length.
    near_double_root : bool
        Two modes are closer than float64 coefficients can separate (type-II singularity).
    escalated : bool
        The modes were then computed at 50 digits from the given double-precision input.
    double : ndarray of bool, shape (m,)
        Modes that stay merged even at 50 digits; they count twice.
    self_motion : str
        Description of a continuous family of poses; empty if there is none.
    consistent : bool
        The number of modes is even and the signs of ``det JX`` cancel (section 5.4).
    note : str
        Remark, for instance on a drop of the degree.
    method : str
        How the count was had.
    """

    poses: Array
    determinants: Array
    residuals: Array
    near_double_root: bool
    escalated: bool
    double: NDArray[np.bool_]
    self_motion: str
    consistent: bool
    note: str
    method: str

    def __len__(self) -> int:
        return len(self.poses)


@dataclass(frozen=True, eq=False)
class AssemblyModeBatch:
    """Assembly modes of N problems in one list.

    ``poses[i]`` and ``determinants[i]`` belong to problem ``problem[i]``; ``counts``, ``near_double_root`` and
    ``consistent`` have shape (N,).  A flagged problem is incomplete: solve it with `assembly_modes`.
    """

    problem: NDArray[np.intp]
    poses: Array
    determinants: Array
    counts: NDArray[np.intp]
    near_double_root: NDArray[np.bool_]
    consistent: NDArray[np.bool_]


def _scale(anchors: Complex, vertices: Complex, lengths: Array) -> Array:
    """Power of two near the largest length of each problem: dividing by it is exact."""
    spread = np.max(np.abs(anchors - anchors[..., :1]), axis=-1)
    arms = np.max(np.abs(vertices - vertices[..., :1]), axis=-1)
    largest = np.maximum(np.maximum(spread, arms), np.max(lengths, axis=-1))
    return np.asarray(np.ldexp(1.0, np.frexp(largest)[1]))


def jacobian_x(anchors: Complex, vertices: Complex, pose: Array) -> tuple[Array, Complex]:
    """``df/dX`` (..., 3, 3) and the leg vectors (..., 3)."""
    arm = np.exp(1j * pose[..., 2:3]) * vertices
    d = pose[..., 0:1] + 1j * pose[..., 1:2] + arm - anchors
    return 2.0 * np.stack([d.real, d.imag, arm.real * d.imag - arm.imag * d.real], axis=-1), d


def _closure(d: Complex, lengths: Array) -> Array:
    size = np.abs(d)
    return np.asarray((size - lengths) * (size + lengths))


def polish(anchors: Complex, vertices: Complex, lengths: Array, pose: Array, steps: int = 3) -> tuple[Array, Array]:
    """Newton steps on ``f_k = 0``, kept only where they reduce the residual; returns poses and largest residuals."""
    JX, d = jacobian_x(anchors, vertices, pose)
    f = _closure(d, lengths)
    worst = np.max(np.abs(f), axis=-1)
    for _ in range(steps):
        regular = np.abs(np.linalg.det(JX)) > 0.0
        JX = np.where(regular[..., None, None], JX, np.eye(3))
        trial = pose - np.where(regular[..., None], np.linalg.solve(JX, f[..., None])[..., 0], 0.0)
        JX, d = jacobian_x(anchors, vertices, trial)
        f = _closure(d, lengths)
        new = np.max(np.abs(f), axis=-1)
        better = new < worst
        pose, worst = np.where(better[..., None], trial, pose), np.where(better, new, worst)
        if not better.any():
            break
        JX, d = jacobian_x(anchors, vertices, pose)
        f = _closure(d, lengths)
    return pose, worst


def _poses(s: Sextic, i: NDArray[np.intp], alpha: Array, anchor: Complex, vertex: Complex) -> tuple[Array, Array]:
    """Poses of the roots and ``|Delta|``; a vanishing Delta gives a pose of NaN."""
    z = np.exp(1j * alpha)
    n2, n1, n0, nm = (np.atleast_1d(c)[i] for c in s.n)
    d0, de = (np.atleast_1d(c)[i] for c in s.d)
    N = (n2 * z + n1) * z + n0 + nm / z
    Delta = d0 + de * z - np.conj(de) / z
    size = np.abs(Delta)
    Q = N / np.where(size > 0.0, Delta, np.nan)
    p = anchor + Q - z * vertex
    return np.stack([p.real, p.imag, alpha], axis=-1), size


def assembly_modes_batch(anchors: ArrayLike, vertices: ArrayLike, lengths: ArrayLike) -> AssemblyModeBatch:
    """All assembly modes of N problems: anchors (N, 3), vertices (3,) or (N, 3), leg lengths (3,) or (N, 3).

    The count is guaranteed for the computed coefficients where ``near_double_root`` is False (section 5.2); poses are
    polished on the closure equations.  ``consistent`` is the exact parity and sign test of section 5.4.
    """
    A = np.atleast_2d(np.asarray(anchors, dtype=np.complex128))
    b = np.broadcast_to(np.asarray(vertices, dtype=np.complex128), A.shape)
    l2 = np.broadcast_to(np.asarray(lengths, dtype=np.float64), A.shape)
    parts = [_batch(A[k : k + _CHUNK], b[k : k + _CHUNK], l2[k : k + _CHUNK]) for k in range(0, max(len(A), 1), _CHUNK)]
    start = np.cumsum([0, *(len(part.counts) for part in parts)])
    return AssemblyModeBatch(
        np.concatenate([part.problem + shift for part, shift in zip(parts, start)]),
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("poses", "determinants", "counts", "near_double_root", "consistent")
        ),
    )


def _batch(A: Complex, b: Complex, l2: Array) -> AssemblyModeBatch:
    unit = _scale(A, b, l2)[:, None]
    As, bs, ls = A / unit, b / unit, l2 / unit
    origin = As[:, :1]
    s = sextic(As - origin, bs, ls)
    roots = real_roots(s)
    i = roots.problem
    pose, size = _poses(s, i, roots.alpha, np.zeros(i.size, dtype=np.complex128), bs[i, 0])
    flagged = roots.near_double.copy()
    usable = size > 1e-12
    flagged[i[~usable]] = True
    i, pose = i[usable], pose[usable]
    pose, _ = polish((As - origin)[i], bs[i], ls[i], pose)
    JX, _ = jacobian_x((As - origin)[i], bs[i], pose)
    determinant = np.linalg.det(JX) * unit[i, 0] ** 4
    pose[:, :2] += np.stack([origin[i, 0].real, origin[i, 0].imag], axis=-1)
    pose[:, :2] *= unit[i]
    pose[:, 2] = _principal(pose[:, 2])
    order = np.lexsort((pose[:, 2], i))
    i, pose, determinant = i[order], pose[order], determinant[order]
    counts = np.bincount(i, minlength=len(A))
    balance = np.bincount(i, weights=np.sign(determinant), minlength=len(A))
    return AssemblyModeBatch(i, pose, determinant, counts, flagged, (counts % 2 == 0) & (balance == 0.0))


def _principal(alpha: Array) -> Array:
    return np.asarray(math.pi - np.mod(math.pi - alpha, math.tau)) if alpha.size and _wraps(alpha) else alpha


def _wraps(alpha: Array) -> bool:
    return bool(np.any((alpha > math.pi) | (alpha <= -math.pi)))


def assembly_modes(
    anchors: ArrayLike, vertices: ArrayLike, lengths: ArrayLike, *, arms: Arms | None = None
) -> AssemblyModes:
    """All assembly modes of one problem: anchors A_k, platform vertices b_k, leg lengths, each of shape (3,).

    Problems whose modes nearly merge, or whose linear system degenerates at a mode, are solved again at 50 digits from
    the given double-precision numbers; ``arms`` lets the anchors be recomputed there from pivots, arms and angles.

    Examples
    --------
    >>> import numpy as np
    >>> corner = np.exp(2j * np.pi * np.arange(3) / 3)  # similar triangles: two mirror modes (section 5.3)
    >>> modes = assembly_modes(2 * corner, corner, [1.5, 1.5, 1.5])
    >>> len(modes), modes.consistent
    (2, True)
    """
    A, b = np.asarray(anchors, dtype=np.complex128), np.asarray(vertices, dtype=np.complex128)
    l2 = np.asarray(lengths, dtype=np.float64)
    batch = assembly_modes_batch(A[None], b, l2)
    scale = float(_scale(A, b, l2))
    note = _degree_note(A, b)
    if batch.near_double_root[0] or not batch.consistent[0]:
        from graphsynth.kinematics.escalation import escalate

        poses, double, self_motion = escalate(A, b, l2, arms)
        method = "isolated by bounds on derivatives at 50 digits"
        escalated = True
    else:
        poses, double, self_motion = batch.poses, np.zeros(len(batch.poses), dtype=bool), ""
        method, escalated = "isolated by bounds on derivatives, float64", False
    JX, d = jacobian_x(A, b, poses)
    determinants = np.linalg.det(JX)
    residuals = np.max(np.abs(_closure(d, l2)), axis=-1, initial=0.0) / scale**2
    single = np.sign(determinants[~double])
    consistent = bool(single.size % 2 == 0 and single.sum() == 0) and not self_motion
    return AssemblyModes(
        poses,
        determinants,
        residuals,
        bool(batch.near_double_root[0]),
        escalated,
        double,
        self_motion,
        consistent,
        note,
        method,
    )


def _degree_note(A: Complex, b: Complex) -> str:
    for name, points in (("anchors", A), ("platform vertices", b)):
        for first, second in ((0, 1), (0, 2), (1, 2)):
            if points[first] == points[second]:
                return f"{name} {first + 1} and {second + 1} coincide: the degree drops to at most four modes"
    return ""
