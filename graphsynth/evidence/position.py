"""Positions of a mechanism over its input: closed form, engine, proof and a general solver against 50 digits.

The reference is Newton's method in 50 digits on the equations of the joints as they state them, nothing eliminated: it
shares no formula with the closed forms or the kernels of the engine, which tell it the branch only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import mpmath
import numpy as np
from mpmath import mp
from numpy.typing import NDArray
from scipy.optimize import root

from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.equations import Plane, derivatives, seen
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Name of a closed form, and what it gives at inputs (n,): the position (n,) of the watched point, complex.
Closed = tuple[str, Callable[[Array], Complex]]
_DIGITS = 50
NODES = 12  # the reference is computed at these intervals of the range
_REFERENCE = f"Newton's method with {_DIGITS} digits on the joint equations"
_PROVED = "proved radius about every link's origin"
_STEP = 6
_POSITIONS = _STEP * NODES + 1


def four_bar(linkage: TiltedFourBar) -> tuple[Mechanism, Closed]:
    """Return a planar four-bar linkage as a mechanism, with its closed form for joint B, the end of the rocker.

    Examples
    --------
    >>> mechanism, closed = four_bar(TiltedFourBar())
    >>> mechanism.graph.links, closed[1](np.array([0.0])).round(9).tolist()
    (4, [(1.5+2.449489743j)])
    """
    if linkage.alpha:
        raise GeometryError(f"alpha = {linkage.alpha}: a planar mechanism has no tilt; set it to zero")
    sizes = (linkage.l1, linkage.l2, linkage.l3, linkage.l4)
    mechanism = Mechanism.four_bar(*sizes, crank_angle=0.0, branch=linkage.sgn)

    def closed(f: Array) -> Complex:
        found = linkage.positions(f).B
        return np.asarray(found[..., 0] + 1j * found[..., 1])

    return mechanism, ("closed form", closed)


def _watched(mechanism: Mechanism) -> tuple[int, tuple[float, float]]:
    """Return link and point that are compared: the last revolute joint between moving links, else a link's origin."""
    for joint in reversed(mechanism.joints):
        if isinstance(joint, Revolute) and mechanism.frame not in joint.pair:
            return joint.b, joint.at_b
    return mechanism.graph.links - 1, (0.0, 0.0)


def _point(poses: Array, watched: tuple[int, tuple[float, float]]) -> Complex:
    link, at = watched
    place = poses[..., link, :]
    return np.asarray(place[..., 0] + 1j * place[..., 1] + np.exp(1j * place[..., 2]) * complex(*at))


def precise_poses(mechanism: Mechanism, u: float, guess: Array) -> list[list[Any]]:
    """Poses [x, y, theta] of all links at one input with 50 digits: Newton's method on the joint equations.

    The input is taken as the double it is; the pose `guess` (links, 3) decides the branch. The mechanism has one
    driver, of a revolute joint, that follows the input: a `GeometryError` refuses others, and says where there is no
    convergence.
    """
    with mpmath.workdps(_DIGITS + 10):
        pose = [[mpmath.mpf(float(value)) for value in row] for row in guess]
        pose[mechanism.frame] = [mpmath.mpf(0)] * 3
        free = [(k, axis) for k in range(len(pose)) if k != mechanism.frame for axis in range(3)]
        for _ in range(12):
            values, rows = _equations(mechanism, mpmath.mpf(u), pose)
            matrix = mpmath.matrix([[row.get(key, mpmath.mpf(0)) for key in free] for row in rows])
            step = mpmath.lu_solve(matrix, mpmath.matrix([-v for v in values]))
            for key, change in zip(free, step):
                pose[key[0]][key[1]] += change
            if max(abs(change) for change in step) < mpmath.mpf(10) ** (-_DIGITS):
                return pose
    raise GeometryError(f"no convergence of the 50-digit reference at u = {u}: the pose is singular")


def _equations(mechanism: Mechanism, u: Any, pose: list[list[Any]]) -> tuple[list[Any], list[dict[Any, Any]]]:
    """Values and derivatives of all joint equations and of the driver; derivatives by (link, axis)."""
    plane = Plane(mp.sin, mp.cos, mp.hypot, mp.atan2)
    driver = mechanism.drivers[0]
    joint = next((j for j in mechanism.joints if j.pair == driver.pair), None)
    if len(mechanism.drivers) != 1 or not isinstance(driver.law, Linear) or not isinstance(joint, Revolute):
        raise GeometryError("the 50-digit reference needs one driver, of a revolute joint, linear in the input")
    values: list[Any] = []
    rows: list[dict[Any, Any]] = []
    for joint in mechanism.joints:
        at = seen(plane, joint, (*pose[joint.a],), (*pose[joint.b],))
        for value, turns, slopes in zip(joint.values(at), joint.turns(), derivatives(at, joint.gradients(at))):
            values.append(_near(value, abs(sum(turns))) if turns else value)
            links = zip((joint.a, joint.b), slopes)
            rows.append({(link, k): slope for link, by in links for k, slope in enumerate(by) if slope is not None})
    angle = pose[driver.link][2] - pose[driver.base][2]
    values.append(_near(angle - mp.mpf(driver.law.offset) - mp.mpf(driver.law.rate) * u, 1))
    rows.append({(driver.link, 2): mp.mpf(1), (driver.base, 2): mp.mpf(-1)})
    return values, rows


def _near(angle: Any, turns: float) -> Any:
    """Angle less the whole multiple of so many turns that is nearest to it."""
    period = 2 * mp.pi * turns
    return angle - period * mp.nint(angle / period)


def position_problem(
    mechanism: Mechanism,
    name: str,
    closed: Closed | None = None,
    *,
    inputs: tuple[float, float] = (0.0, math.tau),
    effort: Effort | None = None,
) -> Problem:
    """Compare every way to the positions over a range of the input, radians.

    The mechanism moves through the range, or a `GeometryError` says so; its driver is as for `precise_poses`. A closed
    form gives the watched point: the last revolute joint between two moving links. Error: largest distance of the
    watched point from the reference over the characteristic length; seconds for one position.
    """
    effort = effort or Effort()
    nodes = np.linspace(*inputs, NODES + 1)
    motion = simulate(mechanism, nodes)
    if not motion.completed:
        raise GeometryError(f"the motion ends: {motion.reason}")
    watched = _watched(mechanism)
    truth = precise_points(mechanism, nodes)
    counts = (13, 37, 73) if effort.quick else (13, 73, 361, 3601)
    grids = [np.linspace(*inputs, n) for n in counts]
    rows: list[Row] = []
    if closed is not None:
        more_grids = grids if effort.quick else [*grids, np.linspace(*inputs, 120_001)]
        rows += [_closed_row(closed, grid, truth, motion.Lc, effort) for grid in more_grids]
    for grid in grids:
        found, *timed = best_of(partial(simulate, mechanism, grid), effort)
        error, n = _gap(_point(found.poses, watched), truth, motion.Lc), len(grid)
        more = {"many": n, "reference": _REFERENCE, "more": {"residual": found.residual}}
        method = "engine, with events and derivatives"
        rows.append(Row.of(method, f"{n} at once", error, timed, found.reason, **more))
    rows += [_root_row(mechanism, truth, watched, motion, tol, effort) for tol in (1e-4, 1e-8, 1e-12)]
    rows += [_proof_row(mechanism, grid, truth, watched, motion.Lc, effort) for grid in grids[:3]]
    return Problem("positions", f"Positions of {name} over the range of its input", "relative", tuple(rows), "position")


def precise_points(mechanism: Mechanism, inputs: Array) -> Complex:
    """Watched point at inputs (n,) with 50 digits, rounded once, shape (n,); the branch is that of `simulate`."""
    motion, watched = simulate(mechanism, inputs), _watched(mechanism)
    if not motion.completed:
        raise GeometryError(f"the motion ends: {motion.reason}")
    link, at = watched
    found = []
    with mpmath.workdps(_DIGITS):
        for u, guess in zip(inputs, motion.poses):
            x, y, theta = precise_poses(mechanism, float(u), guess)[link]
            found.append(complex(mpmath.mpc(x, y) + mpmath.expj(theta) * mpmath.mpc(*at)))
    return np.array(found)


def _gap(found: Complex, truth: Complex, Lc: float) -> float:
    """Largest distance at the nodes, which every grid contains."""
    step = (len(found) - 1) // NODES
    return float(np.abs(found[::step] - truth).max()) / Lc


def _closed_row(closed: Closed, grid: Array, truth: Complex, Lc: float, effort: Effort) -> Row:
    found, *timed = best_of(lambda: closed[1](grid), effort)
    n = len(grid)
    return Row.of(closed[0], f"{n} at once", _gap(found, truth, Lc), timed, many=n, reference=_REFERENCE)


def _root_row(mechanism: Mechanism, truth: Complex, watched: Any, motion: Motion, tol: float, effort: Effort) -> Row:
    """Scipy's ``root`` on the same equations, from node to node with steps of five degrees between."""
    fine = np.linspace(motion.inputs[0], motion.inputs[-1], 6 * NODES + 1)
    free = [k for k in range(mechanism.graph.links) if k != mechanism.frame]
    driver = mechanism.drivers[0]
    size = np.array([motion.Lc, motion.Lc, 1.0])

    def full(x: Array) -> Array:
        pose = np.zeros((mechanism.graph.links, 3))
        pose[free] = x.reshape(-1, 3) * size
        return pose

    def left(x: Array, u: float) -> Array:
        pose, (angle, _, _) = full(x), driver.law(np.array([u]))
        driven = pose[driver.link, 2] - pose[driver.base, 2] - angle
        return np.append(residual(mechanism.joints, pose) / motion.Lc, driven)

    def run() -> tuple[list[Array], str]:
        x = (motion.poses[0][free] / size).ravel()
        found: list[Array] = []
        for u in fine:
            answer = root(left, x, args=(u,), tol=tol)
            if not answer.success:
                return found, " ".join(answer.message.split())
            x = answer.x
            found.append(full(x))
        return found, ""

    (found, why), *timed = best_of(run, effort)
    row = partial(Row.of, "scipy root, pose by pose", f"tol {tol:.0e}", many=max(1, len(found)), reference=_REFERENCE)
    if why:
        return row(math.nan, timed, why)
    error = _gap(_point(np.array(found), watched), truth, motion.Lc)
    why = "it converges to another assembly" if error > 1e-2 else ""
    return row(error, timed, why, status=RowStatus.UNRELIABLE)


def _proof_row(mechanism: Mechanism, grid: Array, truth: Complex, watched: Any, Lc: float, effort: Effort) -> Row:
    row = partial(
        Row.of, "engine and certificate", f"{len(grid)} at once", kind="proved radius about every link's origin"
    )
    try:
        from graphsynth.kinematics.certify.poses import certify

        def run() -> Any:
            return (motion := simulate(mechanism, grid)), certify(motion)

        (motion, proof), *timed = best_of(run, effort)
    except GraphsynthError as error:
        return row(math.nan, (math.nan, 0), str(error))
    row = partial(row, many=len(grid), more={"boxes": float(proof.boxes)})
    if not proof.certified:
        return row(math.nan, timed, proof.reason)
    # the watched point moves with the angle of its link too
    reach = float(np.max(proof.position_radius)) + float(np.max(proof.angle_radius)) * math.hypot(*watched[1])
    away = _gap(_point(motion.poses, watched), truth, 1.0)
    held = away <= reach + 4.0 * math.ulp(float(np.abs(truth).max()))
    why = "" if held else f"the reference is {away:.1e} away, beyond the proved radius"
    against = f"none needed; checked to hold the pose with {_DIGITS} digits"
    return row(reach / Lc, timed, why, reference=against, proved=True)


def batch_problem(crank: float, largest: float, effort: Effort | None = None) -> Problem:
    """Move crank-rockers with one crank and other lengths up to ``largest``, at 73 crank angles each.

    Both in one unit; ``largest`` is at least four cranks.

    Examples
    --------
    >>> problem = batch_problem(1.0, 5.0, Effort(rounds=1, quick=True))
    >>> max(row.error for row in problem.rows) < 1e-13
    True
    """
    effort = effort or Effort()
    # crank-rockers well away from change points, always the same ones
    random = np.random.default_rng(0)
    linkages: list[TiltedFourBar] = []
    while len(linkages) < (4 if effort.quick else 12):
        l1, l3, l4 = random.uniform(1.2 * crank, largest, 3)
        sides = sorted((l1, l3, l4))
        if crank + sides[2] < sides[0] + sides[1] - 0.05 * crank:
            linkages.append(TiltedFourBar(float(l1), crank, float(l3), float(l4)))
    f = np.linspace(0.0, math.tau, _POSITIONS)
    made = [four_bar(linkage) for linkage in linkages]
    truth = np.array([precise_points(mechanism, f[::_STEP]) for mechanism, _ in made])
    size = np.array([max(linkage.l1, linkage.l3, linkage.l4) for linkage in linkages])

    def row(method: str, sets: int, run: Callable[[], Complex]) -> Row:
        found, *timed = best_of(run, effort)
        gaps = np.abs(found[:, ::_STEP] - truth[: len(found)]) / size[: len(found), None]
        error = float(gaps.max())
        why = "" if math.isfinite(error) else "a set stopped"
        more = {"kind": "largest distance from the reference over the longest link", "reference": _REFERENCE}
        return Row.of(method, f"{sets} sets", error, timed, why, many=sets * len(f), **more)

    def engine(count: int) -> Complex:
        return np.array([_point(simulate(mechanism, f).poses, _watched(mechanism)) for mechanism, _ in made[:count]])

    def closed(count: int) -> Complex:
        return np.array([form(f) for _, (_, form) in made[:count]])

    rows = []
    for sets in (len(made), 40, 400) if effort.quick else (1, len(made), 240, 2400, 24_000):
        for name, rates in (("batch engine", False), ("batch engine with derivatives", True)):
            rows.append(row(name, sets, partial(_batch, [m for m, _ in made], f, sets, rates)))
    for name, each in (("engine, set by set", engine), ("closed form, set by set", closed)):
        rows += [row(name, n, partial(each, n)) for n in (1, len(made) // 2, len(made))]
    question = f"Positions of crank-rockers of many dimensions, {len(f)} crank angles each"
    return Problem("many-sets", question, "relative", tuple(rows), "position")


def _batch(mechanisms: list[Mechanism], f: Array, sets: int, rates: bool) -> Complex:
    dimensions = np.stack([mechanisms[k % len(mechanisms)].dimensions for k in range(sets)])
    found = simulate_batch(mechanisms[0], f, dimensions, rates=rates, keep=(3,))
    x, y, cosine, sine = np.moveaxis(found.frames[: len(mechanisms), :, 0], -1, 0)
    ends = np.array([_watched(mechanism)[1][0] for mechanism in mechanisms])[: len(x), None]
    return np.asarray(x + 1j * y + ends * (cosine + 1j * sine))
