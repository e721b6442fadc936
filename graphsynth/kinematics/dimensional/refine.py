"""Many candidates at once to the nearest optimum of a target: Levenberg and Marquardt with exact derivatives.

The placement of a curve is solved for and projected out [Golub & Pereyra 1973, Kaufman 1975]; poses are differentiated
by `graphsynth.kinematics.engine.gradients`.  Bounds on the ratio of lengths and on the transmission angles of dyads are
penalties that grow; what comes out is judged like any other candidate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.goals import PathFit
from graphsynth.kinematics.dimensional.matching import MovingLink, at_times, followed, matched
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.kinematics.engine.gradients import pose_gradients

if TYPE_CHECKING:
    from graphsynth.kinematics.dimensional.problem import DimensionProblem

Array = NDArray[np.float64]

#: Damping at the start, its factors after a step that was taken and one that was not.
_DAMPING, _BETTER, _WORSE = 1e-2, 0.2, 5.0
#: A candidate rests when its squared error falls by less than this part, or it was refused that often.
_GAIN, _REFUSED = 1e-7, 8
#: Longest step of a place, in mean lengths of the sketch.
_STEP = 0.5
#: Weights of a bound that is not kept, one after the other, and how much of it is asked beyond.
_WEIGHTS, _BEYOND = (0.2, 3.0), 1.03


class Refined(NamedTuple):
    """Candidates (sets, size), their root mean square errors (infinite: no motion), and motions computed."""

    X: Array
    error: Array
    evaluations: int


def refine(problem: DimensionProblem, X: Array, iterations: int = 40) -> Refined:
    """Improve candidates (sets, size) of a problem whose target is smooth; estimated.

    Examples
    --------
    See `graphsynth.kinematics.dimensional.api.embody`, which begins with it.
    """
    evaluations, error = 0, np.zeros(len(X))
    for weight in _WEIGHTS:
        X, error, count = _descend(problem, X, weight, iterations)
        evaluations += count
    return Refined(X, error, evaluations)


def _descend(problem: DimensionProblem, X: Array, weight: float, iterations: int) -> Refined:
    """Levenberg and Marquardt for every candidate, all with one weight of the bounds."""
    X = X.copy()
    error, J, r, times = _linearised(problem, X, weight)
    count = len(X)
    damping, refused = np.full(len(X), _DAMPING), np.zeros(len(X), dtype=np.intp)
    live = np.isfinite(error)
    for _ in range(iterations):
        at = np.flatnonzero(live)
        if not at.size:
            break
        H = np.einsum("smi,smj->sij", J[at], J[at])
        g = np.einsum("smi,sm->si", J[at], r[at])
        scale = np.einsum("sii->si", H)
        scale = np.maximum(scale, 1e-9 * scale.max(axis=1, keepdims=True)) + 1e-300
        step = np.linalg.solve(H + (damping[at, None] * scale)[:, :, None] * np.eye(X.shape[1]), -g[:, :, None])[
            :, :, 0
        ]
        longest = np.abs(step).max(axis=1, keepdims=True)
        trial = X[at] + step * np.minimum(1.0, _STEP / np.maximum(longest, _STEP))
        count += len(at)
        found, K, q, later = _linearised(problem, trial, weight, times[at])
        good = found < error[at]
        gained = error[at] ** 2 - found**2 > _GAIN * error[at] ** 2
        taken = at[good]
        X[taken], J[taken], r[taken], times[taken] = trial[good], K[good], q[good], later[good]
        refused[at] = np.where(good, np.where(gained, 0, refused[at] + 1), refused[at] + 1)
        damping[at] = np.clip(damping[at] * np.where(good, _BETTER, _WORSE), 1e-12, 1e12)
        error[taken] = found[good]
        live = np.isfinite(error) & (refused < _REFUSED) & (error > 1e-13)
    return Refined(X, error, count)


def _linearised(
    problem: DimensionProblem, X: Array, weight: float, times: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Root mean square error (sets,), derivatives (sets, rows, size) and errors (sets, rows) at candidates.

    The last result are the times (sets, n) of a target without inputs, from those given or from the beginning.
    """
    assert problem.fit is not None
    path = problem.fit if isinstance(problem.fit, PathFit) and problem.fit.warped else None
    warped = path is not None
    places, numbers, _ = problem.decode(X)
    dimensions = problem.design.dimensions(places, numbers)
    motion = simulate_batch(problem.base, problem.inputs, dimensions, modes=problem.modes, rates=warped)
    complete = motion.completed
    if problem.goals.full_turn:
        with np.errstate(invalid="ignore"):
            complete &= np.abs(motion.frames[:, -1] - motion.frames[:, 0]).max(axis=(1, 2)) < 1e-6
    if path is not None:
        seen = problem.samples(motion.frames, motion.velocities, complete)
        times = matched(seen, path.wanted) if times is None else followed(seen, times, path.wanted)
        _, rates = at_times(seen, times)
        frames = _between(problem, motion.frames, motion.velocities, times, complete)
    else:
        frames, times = motion.frames[:, problem.at_target], np.zeros((len(X), 0))
        frames = np.where(complete[:, None, None, None], frames, [0.0, 0.0, 1.0, 0.0])
    own = frames[:, :, problem.link]
    errors, loads, basis = problem.fit.linear(own)
    sets, directions, _, n = loads.shape
    sines = _sines(problem, motion.frames, complete, places)
    frames = np.concatenate([frames, *(sine.frames for sine in sines)], axis=1)
    all_loads = np.zeros((sets, directions, frames.shape[2], 3, n + len(sines)))
    all_loads[:, :, problem.link, :, :n] = loads
    for k, sine in enumerate(sines):
        all_loads[:, 0, sine.links[0], 2, n + k], all_loads[:, 0, sine.links[1], 2, n + k] = -sine.cosine, sine.cosine
    by = pose_gradients(problem.base, dimensions, frames, all_loads).dimensions
    J = problem.design.pulled(by, places, numbers)  # (sets, directions, n, 2 joints + numbers)
    wanted = np.concatenate([(2 * problem.free[:, None] + [0, 1]).ravel(), np.arange(2 * places.shape[1], J.shape[-1])])
    bound, slope = _transmission(problem, sines, J[:, 0, n:])
    slope = slope[..., wanted]
    J = J[:, :, :n, wanted].reshape(sets, directions * n, -1)
    if warped:  # what is along the motion is left to the times
        along = np.einsum("sdcn,snc->sdn", loads, rates)
        along = along / np.maximum(np.sqrt((along**2).sum(axis=1, keepdims=True)), 1e-300)
        errors, J, basis = (_across(along, part) for part in (errors[..., None], J, basis))
    basis = basis / np.maximum(np.linalg.norm(basis, axis=1, keepdims=True), 1e-300)
    BT = basis.transpose(0, 2, 1)
    J = J - basis @ np.linalg.solve(BT @ basis + 1e-12 * np.eye(basis.shape[2]), BT @ J)
    errors = errors.reshape(sets, -1)
    ratio, steep = _ratio(problem, places, J.shape[2])
    J = np.concatenate([J, weight * steep, weight * slope], axis=1)
    errors = np.concatenate([errors, weight * ratio, weight * bound], axis=1)
    size = np.sqrt((errors**2).sum(axis=1) / n)
    bad = ~complete | ~np.isfinite(J).all(axis=(1, 2)) | ~np.isfinite(size)
    J[bad], errors[bad] = 0.0, 0.0
    return np.where(bad, np.inf, size), J, errors, times


class _Sine(NamedTuple):
    """Transmission of a dyad where it is worst: its sine and cosine (sets,), the poses there, what they depend on."""

    sine: Array
    cosine: Array
    frames: Array
    links: tuple[int, int]
    joints: tuple[int, int, int]
    arms: tuple[Array, Array]


def _sines(problem: DimensionProblem, frames: Array, complete: NDArray[np.bool_], places: Array) -> list[_Sine]:
    """Of every dyad of revolute joints; harmless for sets that do not complete the range."""
    found = []
    for p, q, A, B, C in problem.dyads:
        one, two = places[:, B] - places[:, A], places[:, B] - places[:, C]  # frames coincide where it is drawn
        turn = [frames[:, :, link, 2] + 1j * frames[:, :, link, 3] for link in (p, q)]
        between = (two[:, 0] + 1j * two[:, 1]) * np.conj(one[:, 0] + 1j * one[:, 1])
        mu = between[:, None] * turn[1] * np.conj(turn[0]) / np.maximum(np.abs(between), 1e-300)[:, None]
        mu = np.where(complete[:, None], mu, 1j) * np.where(mu[:, :1].imag < 0.0, -1.0, 1.0)
        worst = mu.imag.argmin(axis=1)
        at = np.arange(len(mu)), worst
        own = np.where(complete[:, None, None], frames[at], [0.0, 0.0, 1.0, 0.0])[:, None]
        found.append(_Sine(mu[at].imag, mu[at].real, own, (p, q), (A, B, C), (one, two)))
    return found


def _transmission(problem: DimensionProblem, sines: list[_Sine], by_poses: Array) -> tuple[Array, Array]:
    """Errors (sets, dyads) of transmission angles below the bound; derivatives by all places and numbers.

    ``by_poses`` (sets, dyads, 2 joints + numbers) is what comes through the poses; the arms of the dyad come to it.
    """
    least = _BEYOND * np.sin(problem.goals.min_transmission_angle)
    errors, slope = np.zeros(by_poses.shape[:2]), by_poses.copy()
    for k, sine in enumerate(sines):
        A, B, C = sine.joints
        for arm, sign, start in zip(sine.arms, (-1.0, 1.0), (A, C)):
            normal = sign * sine.cosine[:, None] * np.stack([-arm[:, 1], arm[:, 0]], 1) / (arm**2).sum(1)[:, None]
            slope[:, k, 2 * B : 2 * B + 2] += normal
            slope[:, k, 2 * start : 2 * start + 2] -= normal
        short = (least - sine.sine) / max(least, 1e-3)
        errors[:, k] = np.maximum(short, 0.0)
        slope[:, k] *= -np.where(short > 0.0, 1.0, 0.0)[:, None] / max(least, 1e-3)
    return errors, slope


def _across(along: Array, part: Array) -> Array:
    """Take away from rows (sets, directions n, k) what is along unit vectors (sets, directions, n)."""
    sets, directions, n = along.shape
    own = part.reshape(sets, directions, n, -1)
    own = own - along[..., None] * (along[..., None] * own).sum(axis=1, keepdims=True)
    return np.asarray(own.reshape(sets, directions * n, -1))


def _between(
    problem: DimensionProblem, frames: Array, rates: Array, times: Array, complete: NDArray[np.bool_]
) -> Array:
    """Frames of all links (sets, n, links, 4) at times (sets, n), by cubics; harmless where a set is not complete."""
    period = problem.goals.span if problem.goals.full_turn else 0.0
    found = np.zeros((*times.shape, frames.shape[2], 4))
    found[..., 2] = 1.0
    for link in range(frames.shape[2]):
        own = MovingLink(problem.inputs, frames[complete, :, link], rates[complete, :, link], period)
        found[complete, :, link] = at_times(own, times[complete])[0]
    return found


def _ratio(problem: DimensionProblem, places: Array, width: int) -> tuple[Array, Array]:
    """Errors (sets, sides) of sides that are longer than the shortest by more than the bound, and their derivatives."""
    sides, free = problem.design.sides, {int(k): i for i, k in enumerate(problem.free)}
    d = places[:, sides[:, 0]] - places[:, sides[:, 1]]
    length = np.maximum(np.hypot(d[..., 0], d[..., 1]), 1e-12)
    short = length.argmin(axis=1)
    row = np.arange(len(places))
    over = np.log(length * _BEYOND / (problem.goals.max_length_ratio * length[row, short][:, None]))
    slope = np.zeros((len(places), len(sides), width))
    unit = d / (length**2)[..., None]
    for k, (p, q) in enumerate(sides.tolist()):
        for joint, sign in ((p, 1.0), (q, -1.0)):
            if joint in free:
                at = slice(2 * free[joint], 2 * free[joint] + 2)
                slope[:, k, at] += sign * unit[:, k]
                mine = short == k  # the shortest side moves the bound of all others
                slope[mine, :, at] -= (sign * unit[mine, k])[:, None, :]
    active = over > 0.0
    return np.where(active, over, 0.0), slope * active[:, :, None]
