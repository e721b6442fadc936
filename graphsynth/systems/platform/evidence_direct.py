"""Direct kinematics of the platform: every assembly mode, by sextic, eigenvalues, continuation and proof.

The reference is `graphsynth.systems.platform.evidence_direct_reference`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.systems.platform.evidence_direct_reference import DIGITS, precise_anchors, precise_modes
from graphsynth.systems.platform.evidence_eigenvalues import eigenvalue_modes

if TYPE_CHECKING:
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

__all__ = ["Proved", "judged", "mode_problem", "proof_row"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_REFERENCE = f"interpolated closure condition, roots with {DIGITS} digits"
_KIND = "largest distance of a mode from the reference"


def _away(found: Array, truth: Array, size: float) -> float:
    """Largest scaled distance of modes found from those of the reference; infinite if their numbers differ."""
    if len(found) != len(truth):
        return math.inf
    if not len(found):
        return 0.0
    d = found[:, None] - truth[None]
    turn = np.angle(np.exp(1j * d[..., 2]))
    distance = np.sqrt((d[..., 0] ** 2 + d[..., 1] ** 2) / size**2 + turn**2)
    return float(max(distance.min(axis=0).max(), distance.min(axis=1).max()))


def judged(
    method: str, setting: str, found: Sequence[Array], truth: Sequence[Array], size: float, seconds: float, rounds: int,
    **more: Any,
) -> Row:  # fmt: skip
    """Row of a method that gives all modes: a wrong number of modes anywhere is a failure."""
    gaps = [_away(np.asarray(one), right, size) for one, right in zip(found, truth)]
    wrong = sum(not math.isfinite(gap) for gap in gaps)
    error = max((gap for gap in gaps if math.isfinite(gap)), default=math.nan)
    if wrong:
        return Row(
            method, setting, math.nan, seconds, rounds, _KIND, _REFERENCE, RowStatus.FAILED,
            f"another number of modes than the reference in {wrong} of {len(gaps)} problems", **more,
        )  # fmt: skip
    return Row(method, setting, error, seconds, rounds, _KIND, _REFERENCE, **more)


def _split(problem: NDArray[np.intp], poses: Array, count: int) -> list[Array]:
    return [poses[problem == k] for k in range(count)]


def mode_problem(
    platform: ParallelPlatform, theta: Array, size: float, name: str, effort: Effort | None = None
) -> Problem:
    """Compare every way to all assembly modes at rocker angles ``theta`` (n, 3), radians.

    Parameters
    ----------
    platform : ParallelPlatform
    theta : ndarray, shape (n, 3)
    size : float
        Characteristic length that scales positions.
    name : str
    effort : Effort, optional

    Examples
    --------
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
        batch, seconds, rounds = best_of(partial(platform.direct_batch, tiled), effort)
        part = min(many, n)
        found = _split(batch.problem, batch.poses, part)
        rows.append(judged(
            "sextic and Newton", f"{many} at once", found, truth[:part], size, seconds / many, rounds,
        ))  # fmt: skip
    anchors = platform.elbows(theta)
    for polish in (0, 1, 2):
        modes, seconds, rounds = best_of(partial(eigenvalue_modes, anchors, b, l2, polish=polish), effort)
        setting = f"{polish} Newton steps"
        rows.append(judged("companion eigenvalues", setting, modes, truth, size, seconds / n, rounds))
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
        found, seconds, rounds = best_of(run, effort)
        worst = max(_away(X[None], truth[k][:1], size) for X, k in zip(found, which))
        lost = worst > 1e-3
        rows.append(Row(
            "scipy fsolve, one mode", f"tol {tol:.0e}", worst, seconds / len(which), rounds, _KIND, _REFERENCE,
            RowStatus.UNRELIABLE if lost else RowStatus.OK, "it ends at another mode or at none" if lost else "",
        ))  # fmt: skip
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
    from graphsynth.systems.platform.certified_assembly_modes import certify_direct

    n = len(theta)
    rows = []
    for many in (n, 4 * n) if effort.quick else (1, n, 10 * n):
        tiled = np.resize(theta, (many, 3))
        rows.append(proof_row(
            "certified, balls of doubles", f"{many} at once", partial(_batch, platform, tiled, size),
            truth[: min(many, n)], size, many, effort,
        ))  # fmt: skip
    few = min(n, 2 if effort.quick else 6)
    rows += [
        proof_row(
            "certified, one by one", f"up to {bits} bits", partial(_singly, platform, theta[:few], bits, size),
            truth[:few], size, few, effort, default=bits == signature(certify_direct).parameters["max_bits"].default,
        )
        for bits in (64, 128, 512)
    ]  # fmt: skip
    return rows


#: Modes and their proved radii (scaled), None for a problem that is not decided.
Proved = list[tuple[Array, float] | None]


def _batch(platform: ParallelPlatform, theta: Array, size: float) -> Proved:
    from graphsynth.systems.platform import certify_direct_batch

    proof = certify_direct_batch(platform, theta)
    unit = np.array([size, size, 1.0])
    found: Proved = []
    starts = np.searchsorted(proof.problem, np.arange(len(theta) + 1))
    for k in range(len(theta)):
        own = slice(starts[k], starts[k + 1])
        radius = float(np.linalg.norm(proof.radii[own] / unit, axis=-1).max(initial=0.0))
        found.append((proof.poses[own], radius) if proof.counts[k] >= 0 else None)
    return found


def _singly(platform: ParallelPlatform, theta: Array, bits: int, size: float) -> Proved:
    from graphsynth.systems.platform import certify_direct

    unit = np.array([size, size, 1.0])
    found: Proved = []
    for angles in theta:
        proof = certify_direct(platform, angles.tolist(), max_bits=bits)
        poses = np.array([mode.pose for mode in proof.modes]).reshape(-1, 3)
        radius = max((float(np.linalg.norm(np.asarray(mode.radius) / unit)) for mode in proof.modes), default=0.0)
        found.append((poses, radius) if proof.certified else None)
    return found


def proof_row(
    method: str, setting: str, run: Callable[[], Proved], truth: Sequence[Array], size: float, many: int,
    effort: Effort, *, default: bool = False,
) -> Row:  # fmt: skip
    """Row of a method that proves: its radius, and whether the reference lies within."""
    kind = "largest proved radius"
    try:
        found, seconds, rounds = best_of(run, effort)
    except GraphsynthError as error:  # the extra is not installed
        return Row(method, setting, math.nan, math.nan, 0, kind, "", RowStatus.FAILED, str(error), default)
    reference = f"none needed; checked to hold the modes with {DIGITS} digits"
    open_ = sum(one is None for one in found[: len(truth)])
    why = f"undecided in {open_} of {len(truth)} problems" if open_ else ""
    for one, right in zip(found, truth):
        if one is not None and not _away(one[0], right, size) <= one[1] + 1e-15:
            why = "the reference lies outside of what is proved"
    radius = max((one[1] for one in found if one is not None), default=math.nan)
    status = RowStatus.FAILED if why else RowStatus.OK
    return Row(
        method,
        setting,
        math.nan if why else radius,
        seconds / many,
        rounds,
        kind,
        reference,
        status,
        why,
        default,
        True,
    )
