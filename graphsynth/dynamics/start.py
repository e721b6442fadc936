"""Consistent start: positions, velocities, accelerations and reactions that fit the joints, with a full report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import kernels
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.tables import Compiled, compile_model, coordinate_row
from graphsynth.dynamics.values import Values, applied_loads, initial_slots
from graphsynth.kinematics.engine import codes
from graphsynth.mechanism.laws import Linear

if TYPE_CHECKING:
    from graphsynth.dynamics.singular import BranchTangents, PoseClass

Array = NDArray[np.float64]


Keys = Mapping[Any, float]

#: Singular values below this part of the largest count as zero.
RANK = 1e-10
_ROUNDS = 60
#: Scaled residual above which constraints are violated.
_CLOSED = 1e-11
#: Speed (characteristic lengths or radians per second) below which a mechanism counts as at rest.
_REST = 1e-6


@dataclass(frozen=True, eq=False)
class StartReport:
    """A start state and everything that is known about it (estimated: floating point; theory/planar-dynamics 6).

    Attributes
    ----------
    status : str
        "consistent", "violated" (positions do not close), "contradicting rates" (velocities do not fit), or what dry
        friction leaves: "friction: none", "friction: several", "friction: undetermined", "friction: not decided".
    message : str
        The result in one sentence.
    time : float
    poses, velocities, accelerations : ndarray, shape (links, 3)
        Of the link frames; NaN where not reached.
    q, v, a : ndarray, shape (n,)
        Of the centres of mass of the moving links, ascending.
    multipliers : ndarray, shape (rows,)
        ``lam`` of ``M a + J^T lam = Q``, least norm where they are not determined.
    determined : ndarray of bool, shape (rows,)
        Which multipliers are determined.
    rows : tuple of str
        Names of the constraint rows.
    position_correction, velocity_correction : float
        Largest change of the guess (lengths over the characteristic length; angles).
    rank, freedom : int
        Rank of the scaled Jacobian and ``n - rank``.
    singular_values : ndarray
        Of the scaled Jacobian, descending.
    condition : float
        Largest over smallest kept singular value.
    redundant : tuple of tuple of str
        Sets of rows that depend on each other.
    violated : dict of str to float
        Residual of every row in its own unit (m, rad, m/s, rad/s), if the start is not consistent.
    pose_class : str
        "regular", "redundant" (permanently), "singular" (the rank is larger nearby), or "not tested".
    nearby_rank : int
        Largest rank found at nearby poses.
    tangents : BranchTangents or None
        At a singular pose: the motions of the branches that meet.
    """

    model: DynamicModel
    status: str
    message: str
    time: float
    poses: Array
    velocities: Array
    accelerations: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    determined: NDArray[np.bool_]
    rows: tuple[str, ...]
    position_correction: float
    slots: Array = field(repr=False)
    velocity_correction: float = math.nan
    rank: int = 0
    freedom: int = 0
    singular_values: Array = field(default_factory=lambda: np.empty(0))
    condition: float = math.nan
    redundant: tuple[tuple[str, ...], ...] = ()
    violated: dict[str, float] = field(default_factory=dict)
    pose_class: PoseClass = "not tested"
    nearby_rank: int = 0
    tangents: BranchTangents | None = None

    @property
    def consistent(self) -> bool:
        """Whether a motion can start here."""
        return self.status == "consistent"


def consistent_start(
    model: DynamicModel,
    *,
    pose: ArrayLike | None = None,
    rates: ArrayLike | None = None,
    keep: Keys | None = None,
    keep_rates: Keys | None = None,
    modes: Mapping[int, int] | None = None,
    time: float = 0.0,
) -> StartReport:
    """Find the state nearest to a guess that satisfies all constraints, and classify it (theory/planar-dynamics 6).

    Parameters
    ----------
    model : DynamicModel
    pose : array_like, shape (links, 3), optional
        Guess of the link poses; ``mechanism.pose`` by default, or what the planar engine finds for the drivers' kept
        coordinates and ``modes``.
    rates : array_like, shape (links, 3), optional
        Guess of the link velocities; 0 by default.
    keep, keep_rates : mapping, optional
        Coordinates and rates to keep: keys ``(base, link)`` for the coordinate of an R or P joint, or ``(link, "x")``,
        ``(link, "y")``, ``(link, "theta")`` for a link frame.
    modes : mapping of int to int, optional
        Assembly modes for the planar engine.
    time : float, optional
        For prescribed motions.

    Returns
    -------
    StartReport
        Ask ``consistent`` before using it; violated constraints are a value, not an exception.

    Raises
    ------
    GeometryError
        If there is no guess to start from, or a kept key names nothing.

    Examples
    --------
    >>> from graphsynth.dynamics.model import Body
    >>> from graphsynth import Driver, Mechanism, MechanismGraph
    >>> from graphsynth.mechanism.joints import Revolute
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> start = consistent_start(model, keep={(0, 1): 0.0})
    >>> start.status, start.freedom, round(float(start.accelerations[1, 2]), 6)  # -3 g / 2
    ('consistent', 1, -14.715)
    """
    return start_compiled(compile_model(model), pose, rates, keep, keep_rates, modes, finite("time", time))


def start_compiled(
    compiled: Compiled,
    pose: ArrayLike | None,
    rates: ArrayLike | None,
    keep: Keys | None,
    keep_rates: Keys | None,
    modes: Mapping[int, int] | None,
    time: float,
) -> StartReport:
    """Do what `consistent_start` says for a compiled model."""
    keep, keep_rates = _keys("keep", keep), _keys("keep_rates", keep_rates)
    q0 = compiled.to_coordinates(_guess(compiled, pose, keep, modes, time))
    slots = initial_slots(compiled, q0)
    kept = Values(_keeping(compiled, keep), time, slots)
    q, residual = _close(kept, q0)
    values = Values(compiled, time, initial_slots(compiled, q, slots))
    nan, names = np.full(compiled.n, np.nan), tuple(info.name for info in compiled.info)
    unknown = np.full(len(names), np.nan), np.zeros(len(names), dtype=np.bool_)
    moved = float(np.abs((q - q0) / compiled.unit).max(initial=0.0))
    state = (*compiled.to_links(q, nan, nan), q, nan, nan, *unknown)
    report = StartReport(compiled.model, "consistent", "", time, *state, names, moved, values.slots)
    scaled = np.abs(residual / kept.compiled.row_unit)
    if not np.isfinite(residual).all() or scaled.max(initial=0.0) > _CLOSED:
        worst = kept.compiled.info[int(np.argmax(scaled))]
        open_ = abs(residual[np.argmax(scaled)])
        return replace(
            report,
            status="violated",
            violated=_above(kept.compiled, residual, 1e-12),
            message=f"the constraints do not close: '{worst.name}' is open by {open_:.6g} "
            f"{'rad' if worst.angular else 'm'}; correct the dimensions or the kept coordinates",
        )
    report = classify(values, report)
    v0 = np.zeros(compiled.n) if rates is None else compiled.to_rates(q, _checked(compiled, rates, "rates"))
    return _velocities(values, report, v0, _keeping(compiled, keep_rates))


def _above(compiled: Compiled, residual: Array, least: float) -> dict[str, float]:
    """Residuals above a bound, or NaN, by the names of their rows."""
    return {info.name: float(value) for info, value in zip(compiled.info, residual) if not abs(value) <= least}


def _keeping(compiled: Compiled, keep: Keys) -> Compiled:
    """Return the model with coordinates held that are kept."""
    rows = [coordinate_row(compiled, key, len(compiled.laws) + k) for k, key in enumerate(keep)]
    held = [finite(f"kept {key}", value) for key, value in keep.items()]
    return compiled.with_held(rows, [(f"kept {key}", -1) for key in keep], held)


def _turned(compiled: Compiled, part: Array) -> Array:
    """Return a part of every row as the user sees it: kernels see the held ones from the joint's first link."""
    first = len(part) - len(compiled.held)
    return np.concatenate([part[:first], compiled.tables.table[first:, codes.SIGN] * part[first:]])


def _keys(name: str, given: Keys | None) -> Keys:
    if given is not None and not isinstance(given, Mapping):
        raise GeometryError(f"{name} = {given!r} is not a mapping; give {{(base, link): value}}")
    return given or {}


def check_start(model: DynamicModel, start: StartReport, first: float | None = None, *parts: str) -> None:
    """Refuse what is no consistent start of a model: its coordinates would be taken for those of this one.

    ``first`` is the time that the start is to be for; ``parts`` of the model, besides mechanism and bodies, must be its
    own.
    """
    if not isinstance(model, DynamicModel):
        raise GeometryError(
            f"model is {type(model).__name__}, not a DynamicModel; build one from a mechanism and bodies"
        )
    if not isinstance(start, StartReport):
        raise GeometryError(f"start is {type(start).__name__}, not a StartReport; give that of consistent_start(model)")
    if not start.consistent and not start.status.startswith("friction"):
        raise GeometryError(start.message)
    own = start.model
    for name in ("mechanism", "bodies", *parts) if own is not model else ():
        if getattr(own, name) != getattr(model, name):
            raise GeometryError(
                f"the start belongs to a model with another {name}; call consistent_start with this model"
            )
    if first is not None and abs(start.time - first) > 1e-9 * max(1.0, abs(first)):
        raise GeometryError(
            f"the start is for t = {start.time:.9g} s and the times begin at {first:.9g} s; call consistent_start with "
            f"time={first:.9g}, or let the times begin at {start.time:.9g} s"
        )


def _checked(compiled: Compiled, given: ArrayLike, name: str) -> Array:
    array = finite_array(name, given, nan=True)
    if array.shape != (compiled.links, 3) or not np.isfinite(array).all():
        raise GeometryError(f"{name} must hold three finite numbers for each of {compiled.links} links; give them all")
    return array


def _guess(
    compiled: Compiled, pose: ArrayLike | None, keep: Keys, modes: Mapping[int, int] | None, time: float
) -> Array:
    from graphsynth.kinematics.simulation import simulate

    mechanism = compiled.model.mechanism
    if pose is not None:
        return _checked(compiled, pose, "pose")
    driven = compiled.driven(time)[:, 0]
    wanted: dict[Any, tuple[Any, float]] = {
        driver.pair: ((driver.base, driver.link), float(driven[k]))
        for k, driver in enumerate(compiled.model.prescribed)
    }
    for key, value in keep.items():
        coordinate_row(compiled, key, 0)  # a key that names nothing is refused
        finite(f"kept {key}", value)
        if not isinstance(key[1], str):
            wanted[(min(key), max(key))] = (tuple(key), float(value))
    if mechanism.drivers and all(driver.pair in wanted for driver in mechanism.drivers):
        drivers = []
        for driver in mechanism.drivers:
            own, value = wanted[driver.pair]
            drivers.append(replace(driver, law=Linear(0.0, value if own == (driver.base, driver.link) else -value)))
        motion = simulate(replace(mechanism, drivers=tuple(drivers)), [0.0], modes=modes or {}, events=False)
        if motion.assembled[0]:
            return np.array(motion.poses[0])
        raise GeometryError(f"the mechanism cannot be assembled at {dict(keep)}; choose other coordinates or modes")
    if mechanism.pose is not None:
        return np.array(mechanism.pose)
    raise GeometryError("there is no pose to start from; give pose=, or keep= with the coordinate of every driver")


def _close(values: Values, q0: Array) -> tuple[Array, Array]:
    """Nearest point to q0 on the constraints, by Gauss-Newton; also the residual of every row."""
    q, scale, unit, size = q0.copy(), values.compiled.unit, values.compiled.row_unit, np.inf
    for k in range(_ROUNDS):
        C, J, _, _ = values.system(q, np.zeros_like(q))
        if not np.isfinite(C).all():
            return q, np.full(len(C), np.nan)
        scaled = J * scale / unit[:, None]
        inverse = np.linalg.pinv(scaled, rcond=RANK)
        away = (q0 - q) / scale if k < _ROUNDS - 10 else np.zeros_like(q)  # at last only back to the constraints
        step = -inverse @ (C / unit) + away - inverse @ (scaled @ away)
        length = float(np.abs(step).max(initial=0.0))
        if length > 0.5:
            step *= 0.5 / length
        q = q + scale * step
        if length < 1e-15 or (length < 1e-12 and length >= 0.5 * size):
            break
        size = length
    return q, _turned(values.compiled, values.system(q, np.zeros_like(q))[0])


def classify(values: Values, report: StartReport) -> StartReport:
    """Rank, dependent sets of rows, pose class."""
    J = values.scaled_jacobian(report.q)
    U, S, Vt = np.linalg.svd(J)
    largest = float(S[0]) if S.size else 1.0
    rank = int(np.sum(largest * RANK < S))
    left = U[:, rank:]
    sets: tuple[tuple[str, ...], ...] = ()
    pose_class: PoseClass = "regular"
    nearby, tangents = rank, None
    if left.shape[1]:
        # the smallest sets of dependent rows: the reduced echelon form of the left null vectors
        basis = left.T.copy()
        for k in range(len(basis)):
            column = int(np.argmax(np.abs(basis[k])))
            basis[k] /= basis[k, column]
            for other in range(len(basis)):
                if other != k:
                    basis[other] -= basis[other, column] * basis[k]
        sets = tuple(tuple(name for name, part in zip(report.rows, row) if abs(part) > 1e-8) for row in basis)
        from graphsynth.dynamics.singular import classify_pose

        pose_class, nearby, tangents = classify_pose(values, report.q, rank, left, Vt[rank:].T, RANK)
    return replace(
        report,
        rank=rank,
        freedom=values.compiled.n - rank,
        singular_values=S,
        redundant=sets,
        condition=largest / float(S[rank - 1]) if rank else 1.0,
        pose_class=pose_class,
        nearby_rank=nearby,
        tangents=tangents,
        determined=np.abs(left).max(axis=1, initial=0.0) < 1e-8,
    )


def _velocities(values: Values, report: StartReport, v0: Array, kept: Compiled) -> StartReport:
    compiled, unit = values.compiled, kept.row_unit
    _, J, _, right = Values(kept, values.time, values.slots).system(report.q, v0)
    first = len(compiled.info)
    right[first:] = kept.tables.table[first:, codes.SIGN] * kept.held
    matrix = J * compiled.unit / unit[:, None]
    # the smallest step in the metric of the masses: geometry alone satisfies the rows, however much the masses differ,
    # and these choose what is left free; where rows contradict each other the squares of their residuals are least
    U, S, Vt = np.linalg.svd(matrix)
    rank = int(np.sum(RANK * S[0] < S)) if S.size else 0
    step = compiled.unit * (Vt[:rank].T @ ((U.T @ ((right - J @ v0) / unit))[:rank] / S[:rank]))
    free = compiled.unit[:, None] * Vt[rank:].T
    lower = compiled.tables.lower
    weight = lower.T if lower.size else np.diag(1.0 / compiled.unit)  # massless links: the units of the coordinates
    root = weight @ np.column_stack([free, step])
    step -= free @ np.linalg.lstsq(root[:, :-1], root[:, -1], rcond=None)[0]
    v = v0 + step
    residual = _turned(kept, J @ v - right)
    speed = max(float(np.abs(part).max(initial=0.0)) for part in (v / compiled.unit, right / unit))
    if float(np.abs(residual / unit).max(initial=0.0)) > 1e-9 * max(speed, _REST):
        worst = int(np.argmax(np.abs(residual / unit)))
        info = kept.info[worst]
        return replace(
            report,
            status="contradicting rates",
            violated=_above(kept, residual, 1e-12 * max(speed, _REST)),
            message=f"the rates contradict the joints: '{info.name}' is missed by {abs(residual[worst]):.6g} "
            f"{'rad' if info.angular else 'm'}/s; keep fewer rates or correct them",
        )
    a, lam, text, status = _accelerations(values, report.q, v, applied_loads(compiled, values.time, report.q, v))
    pose, rate, second = compiled.to_links(report.q, v, a)
    return replace(
        report,
        status=status,
        v=v,
        a=a,
        multipliers=lam,
        velocities=rate,
        accelerations=second,
        poses=pose,
        velocity_correction=float(np.abs(step / compiled.unit).max(initial=0.0)),
        message=_sentence(report) + text if status == "consistent" else text,
    )


def _sentence(report: StartReport) -> str:
    text = f"consistent: rank {report.rank} of {len(report.rows)} rows, freedom {report.freedom}"
    if report.pose_class == "redundant":
        text += f"; {len(report.rows) - report.rank} redundant rows, their reactions are not determined"
    if report.pose_class == "singular":
        text += f"; singular pose: the rank is {report.nearby_rank} nearby"
        if report.tangents is not None:
            text += f", {report.tangents.kind}"
    return text


def _accelerations(values: Values, q: Array, v: Array, applied: Array) -> tuple[Array, Array, str, str]:
    """Accelerations and multipliers, what to say about them, and the status of a start from there.

    NaN with massless links, and where friction leaves no or several motions.
    """
    T = values.compiled.tables
    nothing = np.full(len(q), np.nan), np.full(len(values.compiled.info), np.nan)
    if not T.lower.size:
        return *nothing, "; accelerations of massless links: one-coordinate form only", "consistent"
    x = kernels.state_rows(T, q, v)
    Q, _, _, _, good = kernels.load_vector(T, x, applied, values.compiled.currents)
    if not good:
        return *nothing, "; a spring has length 0, so its direction is not defined", "consistent"
    if T.friction.size:
        from graphsynth.dynamics.friction.loads import FrictionRows
        from graphsynth.dynamics.friction.problem import FrictionProblem
        from graphsynth.dynamics.friction.state import decide

        problem = FrictionProblem(FrictionRows(values.compiled), values.time, q, v, values.slots)
        found = decide(problem, problem.moving(), problem.resting)
        if found.solution is None:
            return *nothing, found.message, f"friction: {found.kind}"
        return found.solution.a, found.solution.multipliers, "", "consistent"
    _, J, gam, _ = kernels.constraint_system(T, x, values.slots, values.driven)
    out = np.zeros(7)
    a, lam = kernels.accelerate(T, x, J, gam, Q, out)
    if values.blind(q, int(out[0])):
        return *nothing, f"; accelerations are not known: {values.compiled.spread_words}", "consistent"
    return a, lam, "", "consistent"
