"""Direct kinematics of the platform: every assembly mode, by sextic, eigenvalues, continuation and proof.

The reference with 50 digits: the closure condition itself is sampled, interpolated, and its roots are found in the
complex plane; no coefficient formula, no isolation and no iteration of the library is used.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.certified_assembly_modes import AssemblyCertificate, certify_direct
from graphsynth.systems.platform.certified_modes_batch import certify_direct_batch
from graphsynth.systems.platform.motion import distance

if TYPE_CHECKING:
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

DIGITS = 50
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_REFERENCE = f"interpolated closure condition, roots with {DIGITS} digits"
_KIND = "largest distance of a mode from the reference"
PROVED = f"none needed; checked to hold the result with {DIGITS} digits"
#: Modes and their proved radii (scaled), None for a problem that is not decided.
Proved = list[tuple[Array, float] | None]
Timed = Sequence[float]


def _away(found: Array, truth: Array, size: float) -> float:
    """Largest scaled distance of modes found from those of the reference; infinite if their numbers differ."""
    if len(found) != len(truth):
        return math.inf
    if not len(found):
        return 0.0
    apart = np.array([distance(truth, pose, size) for pose in found])
    return float(max(apart.min(axis=0).max(), apart.min(axis=1).max()))


def assessed(
    method: str, setting: str, found: Sequence[Array], truth: Sequence[Array], size: float, timed: Timed, **more: Any
) -> Row:
    """Row of a method that gives all modes: a wrong number of modes anywhere is a failure."""
    gaps = np.array([_away(np.asarray(one), right, size) for one, right in zip(found, truth)])
    wrong = int(np.isinf(gaps).sum())
    why = f"another number of modes than the reference in {wrong} of {len(gaps)} problems" if wrong else ""
    error = math.nan if wrong else float(gaps.max())
    return Row.of(method, setting, error, timed, why, kind=_KIND, reference=_REFERENCE, **more)


def mode_problem(
    platform: ParallelPlatform, theta: Array, size: float, name: str, effort: Effort | None = None
) -> Problem:
    """Compare every way to all assembly modes at rocker angles ``theta`` (n, 3), radians.

    `theta`: shape (n, 3). `size`: characteristic length that scales positions.

    >>> from graphsynth import ParallelPlatform
    >>> problem = mode_problem(ParallelPlatform.g1(), np.zeros((2, 3)), 0.5, "G1", Effort(rounds=1, quick=True))
    >>> problem.rows[0].error < 1e-14
    True
    """
    effort = effort or Effort()
    theta = np.ascontiguousarray(theta)
    n, b, l2 = len(theta), np.array(platform.b), np.array(platform.l2)
    truth = [precise_modes(precise_anchors(platform, t), platform.b, platform.l2) for t in theta]
    rows: list[Row] = []
    for many in (n, 20 * n) if effort.quick else (1, n, 100 * n, 1000 * n):
        tiled = np.resize(theta, (many, 3))
        batch, *timed = best_of(partial(platform.direct_batch, tiled), effort)
        found = [batch.poses[batch.problem == k] for k in range(min(many, n))]
        rows.append(assessed("sextic and Newton", f"{many} at once", found, truth, size, timed, many=many))
    anchors = platform.elbows(theta)
    for polish in (0, 1, 2):
        modes, *timed = best_of(partial(eigenvalue_modes, anchors, b, l2, polish=polish), effort)
        rows.append(assessed("companion eigenvalues", f"{polish} Newton steps", modes, truth, size, timed, many=n))
    rows += _one_mode(platform, theta, truth, size, effort)
    rows += _proved_rows(platform, theta, truth, size, effort)
    note = "scipy's fsolve finds one mode from a guess near it; all others find all modes."
    question = f"All assembly modes of {name} ({n} sets of rocker angles)"
    return Problem("assembly-modes", question, "relative", tuple(rows), "problem", note)


def _one_mode(
    platform: ParallelPlatform, theta: Array, truth: Sequence[Array], size: float, effort: Effort
) -> list[Row]:
    """Let scipy's ``fsolve`` find one mode from a guess a hundredth away."""
    which = [k for k, modes in enumerate(truth) if len(modes)][:8]
    rows = []
    for tol in (1e-4, 1e-8, 1e-12) if which else ():
        run = partial(_fsolve, platform, [(theta[k], truth[k][0]) for k in which], size, tol)
        found, *timed = best_of(run, effort)
        worst = max(_away(X[None], truth[k][:1], size) for X, k in zip(found, which))
        more: dict[str, Any] = {"kind": _KIND, "reference": _REFERENCE, "many": len(which)}
        why = "it ends at another mode or at none" if worst > 1e-3 else ""
        setting, status = f"tol {tol:.0e}", RowStatus.UNRELIABLE
        rows.append(Row.of("scipy fsolve, one mode", setting, worst, timed, why, status=status, **more))
    return rows


def _fsolve(platform: ParallelPlatform, given: Sequence[tuple[Array, Array]], size: float, tol: float) -> list[Array]:
    from scipy.optimize import fsolve

    found = []
    for theta, mode in given:
        closure = partial(lambda X, t: platform.closure(X, t) / size**2, t=theta)
        slope = partial(lambda X, t: platform.jacobians(X, t)[0] / size**2, t=theta)
        guess = mode + 0.01 * np.array([size, size, 1.0])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # where it cannot do better it warns; the error tells
            found.append(np.asarray(fsolve(closure, guess, fprime=slope, xtol=tol)))
    return found


def _proved_rows(
    platform: ParallelPlatform, theta: Array, truth: Sequence[Array], size: float, effort: Effort
) -> list[Row]:
    n, rows = len(theta), []
    for many in (n, 4 * n) if effort.quick else (1, n, 10 * n):
        run = partial(_batch, platform, np.resize(theta, (many, 3)), size)
        rows.append(proof_row("certified, balls of floats", f"{many} at once", run, truth, size, many, effort))
    few, usual = min(n, 2 if effort.quick else 6), signature(certify_direct).parameters["max_bits"].default
    for bits in (64, 128, 512):
        run = partial(_singly, platform, theta[:few], bits, size)
        row = proof_row("certified, one by one", f"up to {bits} bits", run, truth, size, few, effort)
        rows.append(replace(row, default=bits == usual))
    return rows


def _batch(platform: ParallelPlatform, theta: Array, size: float) -> Proved:
    proof = certify_direct_batch(platform, theta)
    radii = np.linalg.norm(proof.radii / [size, size, 1.0], axis=-1)
    starts = np.searchsorted(proof.problem, np.arange(len(theta) + 1))
    parts = (slice(*ends) for ends in pairwise(starts))
    found = [(proof.poses[own], float(radii[own].max(initial=0.0))) for own in parts]
    return [modes if count >= 0 else None for modes, count in zip(found, proof.counts)]


def _singly(platform: ParallelPlatform, theta: Array, bits: int, size: float) -> Proved:
    return [of_certificate(certify_direct(platform, angles.tolist(), max_bits=bits), size) for angles in theta]


def of_certificate(proof: AssemblyCertificate, size: float) -> tuple[Array, float] | None:
    """Modes of a certificate and the largest of their radii (scaled); None if it is not decided."""
    poses = np.array([mode.pose for mode in proof.modes]).reshape(-1, 3)
    radius = max((float(np.linalg.norm(mode.radius / [size, size, 1.0])) for mode in proof.modes), default=0.0)
    return (poses, radius) if proof.certified else None


def proof_row(
    method: str,
    setting: str,
    run: Callable[[], Proved],
    truth: Sequence[Array],
    size: float,
    many: int,
    effort: Effort,
) -> Row:
    """Row of a method that proves: its radius, and whether the reference lies within."""
    found, *timed = best_of(run, effort)
    open_ = sum(one is None for one in found[: len(truth)])
    why = f"undecided in {open_} of {min(len(truth), len(found))} problems" if open_ else ""
    for one, right in zip(found, truth):
        if one is not None and not _away(one[0], right, size) <= one[1] + 1e-15:
            why = "the reference lies outside of what is proved"
    radius = math.nan if why else max(one[1] for one in found if one is not None)
    more: dict[str, Any] = {"kind": "largest proved radius", "reference": PROVED, "proved": True, "many": many}
    return Row.of(method, setting, radius, timed, why, **more)


def precise_modes(anchors: Sequence[Any], vertices: Sequence[complex], lengths: Sequence[float]) -> Array:
    """Return all assembly modes (x, y, alpha) of one problem (3-RPR), found with 50 digits; shape (m, 3), by alpha.

    For a rotation ``z = exp(i alpha)`` two differences of the closure equations are linear in the position; put into
    the third they give a trigonometric polynomial of degree three, sampled at eight angles and interpolated.  Its roots
    on the unit circle are the modes.

    >>> corner = [complex(np.exp(2j * np.pi * k / 3)) for k in range(3)]
    >>> precise_modes([2 * c for c in corner], corner, [1.5] * 3)[:, 2].round(6).tolist()
    [-0.812756, 0.812756]
    """
    import mpmath

    with mpmath.workdps(DIGITS + 20):
        A, b = [mpmath.mpc(v) for v in anchors], [mpmath.mpc(v) for v in vertices]
        l2 = [mpmath.mpf(v) for v in lengths]

        def parts(z: Any) -> tuple[Any, Any, Any, list[Any]]:
            w = [z * b[k] - A[k] for k in range(3)]  # p + w_k is the leg
            r = [l2[k] ** 2 - abs(w[k]) ** 2 for k in range(3)]
            u, v = w[1] - w[0], w[2] - w[0]  # 2 Re(p conj u) = r1 - r0
            det = (mpmath.conj(u) * v).imag
            top = (v * (r[1] - r[0]) - u * (r[2] - r[0])) / (2j)  # det * p
            return det, top, r[0], w

        def condition(alpha: Any) -> Any:
            det, top, r0, w = parts(mpmath.expj(alpha))
            return abs(top) ** 2 + 2 * det * (top * mpmath.conj(w[0])).real - det * det * r0

        nodes = [2 * mpmath.pi * k / 8 for k in range(8)]
        values = [(condition(alpha) / 8, alpha) for alpha in nodes]
        coefficients = [sum(g * mpmath.expj(-m * alpha) for g, alpha in values) for m in range(3, -4, -1)]
        scale = max(abs(c) for c in coefficients)
        while abs(coefficients[0]) < scale * mpmath.mpf(10) ** (-DIGITS):  # the degree drops
            coefficients = coefficients[1:-1]
        roots = mpmath.polyroots(coefficients, maxsteps=500, extraprec=400)
        found = []
        for z in roots:
            if abs(abs(z) - 1) < mpmath.mpf(10) ** (-DIGITS // 2):
                alpha = mpmath.arg(z)
                det, top, _, _ = parts(mpmath.expj(alpha))
                p = top / det
                found.append((float(alpha), float(p.real), float(p.imag)))
        return np.array([(x, y, alpha) for alpha, x, y in sorted(found)]).reshape(-1, 3)


def precise_anchors(platform: ParallelPlatform, theta: Array) -> list[Any]:
    """Elbows with 50 digits from the doubles given."""
    import mpmath

    with mpmath.workdps(DIGITS + 20):
        return [
            mpmath.mpc(D) + mpmath.mpf(arm) * mpmath.expj(mpmath.mpf(float(t)))
            for D, arm, t in zip(platform.D, platform.l1, theta)
        ]


def eigenvalue_modes(
    anchors: Complex, vertices: Complex, lengths: Array, *, polish: int = 0, band: float = 1e-6
) -> list[Array]:
    """Modes by eigenvalues of companion matrices, the textbook way; for comparison.

    `anchors`: shape (n, 3), complex. `vertices`, `lengths`: shape (3,). `polish`: steps of Newton's method on the
    closure equations afterwards. `band`: roots whose modulus differs from one by less count as real modes. Returns
    shape (m, 3): ``(x, y, alpha)`` by alpha, for each problem; estimated, and a mode may be missing or too many.
    """
    from graphsynth.kinematics.triad.assembly_modes import sextic

    scale = float(np.abs(lengths).max())
    s = sextic(anchors / scale, vertices / scale, lengths / scale)
    g0, g1, g2, g3 = s.g
    matrix = np.zeros((len(anchors), 6, 6), dtype=complex)
    matrix[:, 0] = -np.stack([g2, g1, g0 + 0j, np.conj(g1), np.conj(g2), np.conj(g3)], axis=-1) / g3[:, None]
    matrix[:, range(1, 6), range(5)] = 1.0
    every = np.linalg.eigvals(matrix)
    found = []
    for k, roots in enumerate(every):
        z = roots[np.abs(np.abs(roots) - 1.0) < band]
        z = z / np.abs(z)
        w = z[:, None] * vertices - anchors[k]  # position from two differences of the closure equations
        r = lengths**2 - np.abs(w) ** 2
        u, v = w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
        det = (np.conj(u) * v).imag
        p = (v * (r[:, 1] - r[:, 0]) - u * (r[:, 2] - r[:, 0])) / (2j * det)
        X = np.stack([p.real, p.imag, np.angle(z)], axis=-1)
        for _ in range(polish):
            X = _newton(X, anchors[k], vertices, lengths)
        found.append(X[np.argsort(X[:, 2])])
    return found


def _newton(X: Array, A: Complex, b: Complex, l2: Array) -> Array:
    arm = np.exp(1j * X[:, 2:3]) * b
    d = X[:, 0:1] + 1j * X[:, 1:2] + arm - A
    J = 2.0 * np.stack([d.real, d.imag, (np.conj(arm) * d).imag], axis=-1)
    size = np.abs(d)
    with np.errstate(all="ignore"):
        try:
            return np.asarray(X - np.linalg.solve(J, ((size - l2) * (size + l2))[..., None])[..., 0])
        except np.linalg.LinAlgError:
            return X
