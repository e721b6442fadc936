"""Positions of a mechanism over its input: closed form, engine, proof and a general solver against 50 digits.

The reference is Newton's method in 50 digits on the equations of the joints as stated, nothing eliminated: it shares no
formula with the closed forms or the engine, which tell it the branch only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.mechanism.four_bar import TiltedFourBar
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
#: Name of a closed form, and what it gives at inputs (n,): the position (n,) of the watched point, complex.
Closed = tuple[str, Callable[[Array], NDArray[np.complex128]]]
_DIGITS = 50
NODES = 12  # the reference is computed at these intervals of the range
_REFERENCE = f"Newton's method with {_DIGITS} digits on the joint equations"
_KIND = "distance from the reference"
Complex = NDArray[np.complex128]
_Made = tuple[Mechanism, Closed]
_POSITIONS = 6 * NODES + 1
_SETS_KIND = "largest distance from the reference over the longest link"


def four_bar(linkage: TiltedFourBar) -> tuple[Mechanism, Closed]:
    """Return a planar four-bar linkage as a mechanism, with its closed form for joint B (the origin of link 2's end).

    The mechanism's link frames: crank at O, coupler at A, rocker at C; all along the bars.

    Examples
    --------
    >>> from graphsynth import TiltedFourBar
    >>> mechanism, closed = four_bar(TiltedFourBar())
    >>> mechanism.graph.links, closed[1](np.array([0.0])).round(9).tolist()
    (4, [(1.5+2.449489743j)])
    """
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    if linkage.alpha:
        raise GeometryError(f"alpha = {linkage.alpha}: a planar mechanism has no tilt; set it to zero")
    l1, l2, l3, l4 = linkage.l1, linkage.l2, linkage.l3, linkage.l4
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = (
        Revolute(0, 1),
        Revolute(1, 2, (l2, 0.0)),
        Revolute(2, 3, (l3, 0.0), (l4, 0.0)),
        Revolute(0, 3, (l1, 0.0)),
    )
    first = linkage.positions([0.0])
    A, B = complex(first.A[0, 0], first.A[0, 1]), complex(first.B[0, 0], first.B[0, 1])
    coupler, rocker = (A.real, A.imag, float(np.angle(B - A))), (l1, 0.0, float(np.angle(B - l1)))
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), coupler, rocker)

    def closed(f: Array) -> NDArray[np.complex128]:
        found = linkage.positions(f).B
        return np.asarray(found[..., 0] + 1j * found[..., 1])

    return Mechanism(graph, joints, (Driver(0, 1),), pose=pose), ("closed form", closed)


def _watched(mechanism: Mechanism) -> tuple[int, tuple[float, float]]:
    """Return link and point that are compared: the last turning joint between moving links, else a link's origin."""
    from graphsynth.mechanism.joints import Revolute

    for joint in reversed(mechanism.joints):
        if isinstance(joint, Revolute) and mechanism.frame not in joint.pair:
            return joint.b, joint.at_b
    return mechanism.graph.links - 1, (0.0, 0.0)


def _point(poses: Array, watched: tuple[int, tuple[float, float]]) -> NDArray[np.complex128]:
    link, at = watched
    place = poses[..., link, :]
    return np.asarray(place[..., 0] + 1j * place[..., 1] + np.exp(1j * place[..., 2]) * complex(*at))


def precise_poses(mechanism: Mechanism, u: float, guess: Array) -> list[list[Any]]:
    """Poses of all links at one input with 50 digits: Newton's method on the joint equations, from a pose near by.

    Parameters
    ----------
    mechanism : Mechanism
        With turning and sliding pairs and pins in slots, and one driver of a turning pair that follows the input.
    u : float
        Input, taken as the double it is.
    guess : ndarray, shape (links, 3)
        Decides the branch.

    Returns
    -------
    list of [x, y, theta], mpmath numbers

    Raises
    ------
    GeometryError
        Another joint or driver, or no convergence from this guess.
    """
    import mpmath

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
    import mpmath

    from graphsynth.mechanism.joints import Cam, Gear, Prismatic, Revolute

    values: list[Any] = []
    rows: list[dict[Any, Any]] = []

    def arm(link: int, at: tuple[float, float]) -> Any:
        return mpmath.expj(pose[link][2]) * mpmath.mpc(*at)

    for joint in mechanism.joints:
        if isinstance(joint, Gear | Cam):
            raise GeometryError("the 50-digit reference knows turning and sliding pairs and pins in slots only")
        a, b = joint.a, joint.b
        p, q = arm(a, joint.at_a), arm(b, joint.at_b)
        d = mpmath.mpc(pose[b][0], pose[b][1]) + q - mpmath.mpc(pose[a][0], pose[a][1]) - p
        slope = {(a, 0): -1, (a, 1): -1j, (a, 2): -1j * p, (b, 0): 1, (b, 1): 1j, (b, 2): 1j * q}
        if isinstance(joint, Revolute):
            values += [d.real, d.imag]
            rows += [{k: mpmath.re(v) for k, v in slope.items()}, {k: mpmath.im(v) for k, v in slope.items()}]
            continue
        turn = mpmath.expj(-(pose[a][2] + mpmath.mpf(joint.angle_a)))
        values.append((turn * d).imag)
        row = {k: mpmath.im(turn * v) for k, v in slope.items()}
        row[a, 2] += mpmath.im(-1j * turn * d)
        rows.append(row)
        if isinstance(joint, Prismatic):
            angle = pose[b][2] + mpmath.mpf(joint.angle_b) - pose[a][2] - mpmath.mpf(joint.angle_a)
            values.append(angle - 2 * mpmath.pi * mpmath.nint(angle / (2 * mpmath.pi)))
            rows.append({(a, 2): mpmath.mpf(-1), (b, 2): mpmath.mpf(1)})
    value, row = _driven(mechanism, u, pose)
    return [*values, value], [*rows, row]


def _driven(mechanism: Mechanism, u: Any, pose: list[list[Any]]) -> tuple[Any, dict[Any, Any]]:
    import mpmath

    from graphsynth.mechanism.laws import Linear

    driver = mechanism.drivers[0]
    joint = next((j for j in mechanism.joints if j.pair == driver.pair), None)
    if len(mechanism.drivers) != 1 or not isinstance(driver.law, Linear) or joint is None or joint.kind != "R":
        raise GeometryError(
            "the 50-digit reference needs one driver, of a turning pair, that follows the input linearly"
        )
    wanted = mpmath.mpf(driver.law.offset) + mpmath.mpf(driver.law.rate) * u
    angle = pose[driver.link][2] - pose[driver.base][2] - wanted
    one = mpmath.mpf(1)
    return angle - 2 * mpmath.pi * mpmath.nint(angle / (2 * mpmath.pi)), {(driver.link, 2): one, (driver.base, 2): -one}


def position_problem(
    mechanism: Mechanism,
    name: str,
    closed: Closed | None = None,
    *,
    inputs: tuple[float, float] = (0.0, math.tau),
    effort: Effort | None = None,
) -> Problem:
    """Compare every way to the positions over a range of the input.

    Parameters
    ----------
    mechanism : Mechanism
        That can be moved through the range; joints and driver as for `precise_poses`.
    name : str
        Of the mechanism, for the picture.
    closed : (str, function), optional
        A closed form of the watched point: the last turning joint between two moving links.
    inputs : (float, float), optional
        Range of the input, radians.
    effort : Effort, optional

    Returns
    -------
    Problem
        Error: largest distance of the watched point from the reference over the characteristic length; seconds for one
        position.

    Raises
    ------
    GeometryError
        If the motion ends within the range.
    """
    from graphsynth.kinematics.simulation import simulate

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
        rows += [_closed_row(closed, grid, truth, motion.Lc, effort) for grid in grids]
        if not effort.quick:
            rows.append(_closed_row(closed, np.linspace(*inputs, 120_001), truth, motion.Lc, effort))
    rows += [_engine_row(mechanism, grid, truth, watched, motion.Lc, effort) for grid in grids]
    rows += [_root_row(mechanism, nodes, truth, watched, motion, tol, effort) for tol in (1e-4, 1e-8, 1e-12)]
    rows += [_proof_row(mechanism, grid, truth, watched, motion.Lc, effort) for grid in grids[:3]]
    return Problem("positions", f"Positions of {name} over the range of its input", "relative", tuple(rows), "position")


def precise_points(mechanism: Mechanism, inputs: Array) -> NDArray[np.complex128]:
    """Watched point at inputs (n,) with 50 digits, rounded once, shape (n,); the branch is that of `simulate`."""
    from graphsynth.kinematics.simulation import simulate

    motion, watched = simulate(mechanism, inputs), _watched(mechanism)
    if not motion.completed:
        raise GeometryError(f"the motion ends: {motion.reason}")
    return np.array(
        [_precise_point(precise_poses(mechanism, float(u), p), watched) for u, p in zip(inputs, motion.poses)]
    )


def _precise_point(pose: list[list[Any]], watched: tuple[int, tuple[float, float]]) -> complex:
    """Point of a 50-digit pose, rounded once."""
    import mpmath

    link, at = watched
    with mpmath.workdps(_DIGITS):
        x, y, theta = pose[link]
        return complex(mpmath.mpc(x, y) + mpmath.expj(theta) * mpmath.mpc(*at))


def _gap(found: NDArray[np.complex128], truth: NDArray[np.complex128], Lc: float) -> float:
    """Largest distance at the nodes, which every grid contains."""
    step = (len(found) - 1) // NODES
    return float(np.abs(found[::step] - truth).max()) / Lc


def _closed_row(closed: Closed, grid: Array, truth: NDArray[np.complex128], Lc: float, effort: Effort) -> Row:
    found, seconds, rounds = best_of(lambda: closed[1](grid), effort)
    setting = f"{len(grid)} at once"
    return Row(closed[0], setting, _gap(found, truth, Lc), seconds / len(grid), rounds, _KIND, _REFERENCE)


def _engine_row(
    mechanism: Mechanism, grid: Array, truth: NDArray[np.complex128], watched: Any, Lc: float, effort: Effort
) -> Row:
    from graphsynth.kinematics.simulation import simulate

    found, seconds, rounds = best_of(lambda: simulate(mechanism, grid), effort)
    error = _gap(_point(found.poses, watched), truth, Lc)
    status = RowStatus.OK if found.completed else RowStatus.FAILED
    return Row(
        "engine, with events and derivatives",
        f"{len(grid)} at once",
        error,
        seconds / len(grid),
        rounds,
        _KIND,
        _REFERENCE,
        status,
        found.reason,
        more={"residual": found.residual},
    )


def _root_row(
    mechanism: Mechanism,
    nodes: Array,
    truth: NDArray[np.complex128],
    watched: Any,
    motion: Any,
    tol: float,
    effort: Effort,
) -> Row:
    """Scipy's ``root`` on the same equations, from node to node with steps of five degrees between."""
    from scipy.optimize import root

    from graphsynth.mechanism.constraints import residual

    fine = np.linspace(nodes[0], nodes[-1], 6 * NODES + 1)
    free = [k for k in range(mechanism.graph.links) if k != mechanism.frame]
    driver = mechanism.drivers[0]
    size = np.array([motion.Lc, motion.Lc, 1.0])

    def full(x: Array) -> Array:
        pose = np.zeros((mechanism.graph.links, 3))
        pose[free] = x.reshape(-1, 3) * size
        return pose

    def driven(pose: Array, u: float) -> float:
        (angle, _, _) = driver.law(np.array([u]))
        return float(pose[driver.link, 2] - pose[driver.base, 2] - angle[0])

    def run() -> tuple[list[Array], str]:
        x = (motion.poses[0][free] / size).ravel()
        found: list[Array] = []
        for u in fine:
            answer = root(
                lambda y, u=u: np.append(residual(mechanism.joints, full(y)) / motion.Lc, driven(full(y), u)),
                x,
                tol=tol,
            )
            if not answer.success:
                return found, " ".join(answer.message.split())
            x = answer.x
            found.append(full(x))
        return found, ""

    name, setting = "scipy root, pose by pose", f"tol {tol:.0e}"
    (found, why), seconds, rounds = best_of(run, effort)
    each = seconds / max(1, len(found))
    if why:
        return Row(name, setting, math.nan, each, rounds, _KIND, _REFERENCE, RowStatus.FAILED, why)
    error = _gap(_point(np.array(found), watched), truth, motion.Lc)
    if error > 1e-2:
        why = "it converges to another assembly"
    status = RowStatus.UNRELIABLE if why else RowStatus.OK
    return Row(name, setting, error, each, rounds, _KIND, _REFERENCE, status, why)


def _proof_row(
    mechanism: Mechanism, grid: Array, truth: NDArray[np.complex128], watched: Any, Lc: float, effort: Effort
) -> Row:
    from graphsynth.kinematics.simulation import simulate

    name, setting = "engine and certificate", f"{len(grid)} at once"
    kind = "proved radius about every link's origin"
    try:
        from graphsynth.kinematics.certify.poses import certify

        def run() -> Any:
            return (motion := simulate(mechanism, grid)), certify(motion)

        (motion, proof), seconds, rounds = best_of(run, effort)
    except GraphsynthError as error:
        return Row(name, setting, math.nan, math.nan, 0, kind, "", RowStatus.FAILED, str(error))
    more = {"boxes": float(proof.boxes)}
    if not proof.certified:
        return Row(
            name, setting, math.nan, seconds / len(grid), rounds, kind, "", RowStatus.FAILED, proof.reason, more=more
        )
    radius = float(np.max(proof.position_radius))
    # the watched point moves with the angle of its link too
    reach = radius + float(np.max(proof.angle_radius)) * math.hypot(*watched[1])
    away = _gap(_point(motion.poses, watched), truth, 1.0)
    held = away <= reach + 4.0 * math.ulp(float(np.abs(truth).max()))
    why = "" if held else f"the reference is {away:.1e} away, beyond the proved radius"
    return Row(
        name,
        setting,
        reach / Lc,
        seconds / len(grid),
        rounds,
        kind,
        f"none needed; checked to hold the pose with {_DIGITS} digits",
        RowStatus.OK if held else RowStatus.FAILED,
        why,
        proved=True,
        more=more,
    )


def batch_problem(crank: float, largest: float, effort: Effort | None = None) -> Problem:
    """Move crank-rockers with one crank and other lengths up to ``largest``, at 73 crank angles each.

    Parameters
    ----------
    crank, largest : float
        In one unit; ``largest`` is at least four cranks.
    effort : Effort, optional

    Examples
    --------
    >>> problem = batch_problem(1.0, 5.0, Effort(rounds=1, quick=True))
    >>> max(row.error for row in problem.rows) < 1e-13
    True
    """
    effort = effort or Effort()
    linkages = _crank_rockers(crank, largest, 4 if effort.quick else 12)
    f = np.linspace(0.0, math.tau, _POSITIONS)
    made = [four_bar(linkage) for linkage in linkages]
    nodes = f[:: (_POSITIONS - 1) // NODES]
    truth = np.array([precise_points(mechanism, nodes) for mechanism, _ in made])
    size = np.array([max(linkage.l1, linkage.l3, linkage.l4) for linkage in linkages])
    rows = []
    for sets in (len(made), 40, 400) if effort.quick else (1, len(made), 240, 2400, 24_000):
        for rates in (False, True):
            name = "batch engine" + (" with derivatives" if rates else "")
            run = partial(_batch, [m for m, _ in made], f, sets, rates)
            found, seconds, rounds = best_of(run, effort)
            rows.append(_sets_row(name, f"{sets} sets", found, truth, size, seconds / (sets * len(f)), rounds))
    for name, each in (("engine, set by set", _engine), ("closed form, set by set", _closed)):
        for count in (1, len(made) // 2, len(made)):
            found, seconds, rounds = best_of(partial(each, made[:count], f), effort)
            rows.append(_sets_row(name, f"{count} sets", found, truth, size, seconds / (count * len(f)), rounds))
    question = f"Positions of crank-rockers of many dimensions, {len(f)} crank angles each"
    return Problem("many-sets", question, "relative", tuple(rows), "position")


def _crank_rockers(crank: float, largest: float, count: int) -> list[TiltedFourBar]:
    """Draw crank-rockers well away from change points, always the same ones."""
    random = np.random.default_rng(0)
    found: list[TiltedFourBar] = []
    while len(found) < count:
        l1, l3, l4 = random.uniform(1.2 * crank, largest, 3)
        sides = sorted((l1, l3, l4))
        if crank + sides[2] < sides[0] + sides[1] - 0.05 * crank:
            found.append(TiltedFourBar(float(l1), crank, float(l3), float(l4)))
    return found


def _batch(mechanisms: list[Mechanism], f: Array, sets: int, rates: bool) -> Complex:
    from graphsynth.kinematics.engine.batch import simulate_batch

    dimensions = np.stack([mechanisms[k % len(mechanisms)].dimensions for k in range(sets)])
    found = simulate_batch(mechanisms[0], f, dimensions, rates=rates, keep=(3,))
    # joint B is the end of the rocker, link 3
    x, y, cosine, sine = np.moveaxis(found.frames[: len(mechanisms), :, 0], -1, 0)
    ends = np.array([_end(mechanism) for mechanism in mechanisms])[: len(x), None]
    return np.asarray(x + 1j * y + ends * (cosine + 1j * sine))


def _end(mechanism: Mechanism) -> float:
    """Length of the rocker, link 3."""
    joint = next(joint for joint in mechanism.joints if joint.pair == (2, 3))
    assert isinstance(joint, Revolute)
    return joint.at_b[0]


def _engine(made: Sequence[_Made], f: Array) -> Complex:
    from graphsynth.kinematics.simulation import simulate

    found = []
    for mechanism, _ in made:
        pose = simulate(mechanism, f).poses[:, 3]
        found.append(pose[:, 0] + 1j * pose[:, 1] + _end(mechanism) * np.exp(1j * pose[:, 2]))
    return np.array(found)


def _closed(made: Sequence[_Made], f: Array) -> Complex:
    return np.array([closed(f) for _, (_, closed) in made])


def _sets_row(
    method: str, setting: str, found: Complex, truth: Complex, size: Array, seconds: float, rounds: int
) -> Row:
    nodes = found[:, :: (_POSITIONS - 1) // NODES]
    error = float((np.abs(nodes - truth[: len(found)]) / size[: len(found), None]).max())
    lost = not math.isfinite(error)
    return Row(
        method,
        setting,
        error,
        seconds,
        rounds,
        _SETS_KIND,
        "Newton's method with 50 digits on the joint equations",
        RowStatus.FAILED if lost else RowStatus.OK,
        "a set stopped" if lost else "",
    )
