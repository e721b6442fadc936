"""Inverse dynamics: the drivers' efforts and all reactions for a given motion; the same at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.dynamics import kernels
from graphsynth.dynamics.checks import newton_euler_difference
from graphsynth.dynamics.elements import Force, MotorDrive, Torque
from graphsynth.dynamics.friction.loads import FrictionElement, FrictionRows, fitting_loads, sliding_loads
from graphsynth.dynamics.friction.problem import joint_names
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.dynamics.motors import torque_constant
from graphsynth.dynamics.reactions import Reactions, reactions_from_multipliers
from graphsynth.dynamics.result import MotorHistory
from graphsynth.dynamics.tables import Compiled, compile_model
from graphsynth.dynamics.values import applied_loads, jacobians, joint_coordinate
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InverseDynamics:
    """Efforts and reactions of a given motion (estimated: floating point; NaN where the motion does not reach).

    Attributes
    ----------
    inputs, times : ndarray, shape (n,)
        Input and time of every sample.
    efforts : ndarray, shape (n, drivers)
        Torque (N m) or force (N) of every driver on its ``link``, against its ``base``.
    reactions : Reactions
        Of all joints; the last ones are the drivers'.
    power : ndarray, shape (n,)
        Of the drivers together, W.
    power_error : float
        Largest ``|drivers' power - (dE/dt - power of other loads)|`` over the largest power in play.
    newton_euler : float
        Largest difference of the reactions to body-by-body equilibrium, over the largest force.
    motors : tuple of MotorHistory
        What the motors at the drivers' joints must give: their speeds, torques, and currents (of a synchronous motor
        with i_d = 0).
    """

    inputs: Array
    times: Array
    efforts: Array
    reactions: Reactions
    power: Array
    power_error: float
    newton_euler: float
    motors: tuple[MotorHistory, ...] = ()


def inverse_dynamics(
    model: DynamicModel,
    motion: Motion,
    speed: ArrayLike = 1.0,
    acceleration: ArrayLike = 0.0,
    *,
    times: ArrayLike | None = None,
    refuse: bool = True,
) -> InverseDynamics:
    """Find the efforts of the mechanism's drivers, and the reactions, for a motion of the planar engine.

    Parameters
    ----------
    model : DynamicModel
        Massless links are allowed.  A motor drive counts with its inertia and friction; it must act at a driver's
        joint, and what it has to give is among the results.
    motion : Motion
        Of :func:`graphsynth.kinematics.simulate` for ``model.mechanism``.
    speed, acceleration : array_like, scalar or shape (n,)
        First and second time derivative of the input at every sample.
    times : array_like, scalar or shape (n,), optional
        Time of every sample, s, for loads given as functions.  By default ``input / speed``, if the speed is constant
        (0 at rest); at a speed that varies it must be given.
    refuse : bool, optional
        False: NaN at inputs where friction leaves no loads, or several; by default that is an error.

    Returns
    -------
    InverseDynamics
        Efforts of the drivers, N m or N, and reactions at every sample (estimated).

    Raises
    ------
    GeometryError
        If the motion is of another mechanism, numbers have another shape, loads are functions and their times are not
        known, friction leaves no loads, several, or needs an open reaction, or a motor is not at a driver's joint.

    Examples
    --------
    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
    >>> from graphsynth.dynamics.model import Body
    >>> arm = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(arm, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> inverse_dynamics(model, simulate(arm, [0.0]), speed=0.0).efforts.round(6).tolist()
    [[4.905]]
    """
    _check(model, motion)
    held = tuple(Driver(d.base, d.link) for d in (*model.prescribed, *motion.mechanism.drivers))  # laws are not asked
    passive = tuple(e.idle if isinstance(e, MotorDrive) else e for e in model.elements)
    compiled = compile_model(replace(model, elements=passive, prescribed=held))
    n = len(motion.inputs)
    given = {"speed": speed, "acceleration": acceleration}
    rate, second = (_by_sample(name, values, n)[:, None, None] for name, values in given.items())
    instants = _times(compiled, motion, rate.ravel(), second.ravel(), times)
    q = compiled.to_coordinates(motion.poses)
    rates = motion.velocities * rate
    v = compiled.to_rates(q, rates)
    a = compiled.to_rates(q, rates, motion.accelerations * rate**2 + motion.velocities * second)
    lam = np.full((n, len(compiled.info)), np.nan)
    there = np.flatnonzero(motion.assembled & np.isfinite(a).all(axis=1))
    found = balance(compiled, instants[there], q[there], v[there], a[there])
    if refuse and found.refusals:
        raise found.refusals[min(found.refusals)]
    lam[there] = found.multipliers
    work = np.full(n, np.nan)  # of all bodies for a unit of the input
    work[there] = (found.missing * compiled.to_rates(q[there], motion.velocities[there])).sum(axis=1)
    power_error = float(np.fmax.reduce(found.error, initial=0.0) / np.fmax.reduce(found.size, initial=1e-300))
    reactions = reactions_from_multipliers(compiled, q, v, lam, instants)
    efforts, power = _efforts(compiled, reactions, motion, rates, work)
    good = np.flatnonzero(np.isfinite(lam).all(axis=1))
    some = good[np.unique(np.linspace(0, len(good) - 1, min(len(good), 40)).astype(int))] if len(good) else good
    none = np.zeros((len(some), 0))
    equilibrium = newton_euler_difference(compiled, instants[some], q[some], v[some], a[some], lam[some], none)
    motors = _motors(model, motion, efforts, rates)
    return InverseDynamics(motion.inputs, instants, efforts, reactions, power, power_error, equilibrium, motors)


def _check(model: DynamicModel, motion: Motion) -> None:
    from graphsynth.kinematics.engine.result import Motion as Moved

    if not isinstance(model, DynamicModel):
        raise GeometryError(
            f"model is {type(model).__name__}, not a DynamicModel; build one from a mechanism and bodies"
        )
    if not isinstance(motion, Moved):
        raise GeometryError(
            f"motion is {type(motion).__name__}, not a Motion; give that of graphsynth.kinematics.simulate for "
            "model.mechanism"
        )
    if motion.mechanism.graph != model.mechanism.graph or motion.mechanism.joints != model.mechanism.joints:
        raise GeometryError("the motion is of another mechanism than the model; simulate model.mechanism")


def _motors(model: DynamicModel, motion: Motion, efforts: Array, rates: Array) -> tuple[MotorHistory, ...]:
    """Return what the motors have to give: the losses of a train are on the side that supplies."""
    pairs = [driver.pair for driver in motion.mechanism.drivers]
    found = []
    for drive in (e for e in model.elements if isinstance(e, MotorDrive)):
        pair, name = (min(drive.a, drive.b), max(drive.a, drive.b)), f"motor {drive.a}-{drive.b}"
        if pair not in pairs:
            raise GeometryError(f"{name} is not at the joint of a driver; name a driver there, or leave the motor out")
        k = pairs.index(pair)
        sense = 1.0 if motion.mechanism.drivers[k].link == drive.b else -1.0
        output = sense * efforts[:, k]
        speed = drive.train.ratio * (rates[:, drive.b, 2] - rates[:, drive.a, 2])
        eta = np.where(output * speed >= 0.0, drive.train.efficiency, 1.0 / drive.train.efficiency)
        torque = output / (drive.train.ratio * eta)
        constant = torque_constant(drive.equation)
        currents = np.full((len(torque), len(drive.currents)), 0.0)
        if currents.size:
            with np.errstate(divide="ignore", invalid="ignore"):
                currents[:, -1] = torque / constant
        found.append(MotorHistory(name, speed, torque, currents, output))
    return tuple(found)


def _by_sample(name: str, given: ArrayLike, n: int) -> Array:
    """Return one finite number for each of n samples."""
    values = finite_array(name, given)
    if values.shape not in ((), (1,), (n,)):
        raise GeometryError(f"{name} has the shape {values.shape}; give one number, or one for each of {n} samples")
    return np.broadcast_to(values, (n,))


def _times(compiled: Compiled, motion: Motion, rate: Array, second: Array, given: ArrayLike | None) -> Array:
    """Return the times at which loads are taken."""
    if given is not None:
        return _by_sample("times", given, len(rate))
    steady = bool((rate == rate[:1]).all()) and not second.any()
    if not steady and compiled.applied:
        raise GeometryError(
            "the speed of the motion varies and loads are functions of time; give times=, the time of every sample"
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(rate == 0.0, 0.0, motion.inputs / rate) if steady else np.full(len(rate), np.nan)


class Balance(NamedTuple):
    """Balance of all bodies at n samples.

    Multipliers (n, rows), the drivers' included, NaN where a sample is refused; what joints and drivers
    must give, inertia forces less loads and friction (n, coordinates); error and size of the power along the
    velocity (n,), W; why friction leaves no loads, several, or needs an open reaction, by sample.
    """

    multipliers: Array
    missing: Array
    error: Array
    size: Array
    refusals: dict[int, GeometryError]


def balance(compiled: Compiled, times: Array, q: Array, v: Array, a: Array) -> Balance:
    """Multipliers of all rows for given motions; coordinates, rates and accelerations have the shape (n, coordinates).

    All samples are solved at once; those where friction returns to itself with a factor of 1 or more, or where a row is
    redundant, are then looked at one by one.
    """
    T = compiled.tables
    elements = FrictionRows(compiled).elements if T.friction.size else ()
    n = len(q)
    loads, units = np.zeros((n, compiled.n)), np.zeros((n, len(elements), compiled.n))
    J = jacobians(compiled, q, v)
    for k in range(n):
        x = kernels.state_rows(T, q[k], v[k])
        loads[k] = kernels.load_vector(T, x, applied_loads(compiled, float(times[k]), q[k], v[k]), compiled.currents)[0]
        for f in range(len(elements)):
            kernels.friction_unit(T, x, J[k], f, units[k, f])
    inertial = a @ T.mass
    unit = compiled.unit / T.size
    U, S, Vt = np.linalg.svd((J * unit).swapaxes(1, 2), full_matrices=False)
    kept = 1e-12 * S[:, :1] < S
    right = np.concatenate([(loads - inertial)[:, None], units], axis=1) * unit
    parts = right @ U * np.divide(1.0, S, out=np.zeros_like(S), where=kept)[:, None]
    solved = parts @ Vt  # multipliers of the loads, then of each element's friction for 1 N
    start, slopes = solved[:, 0], solved[:, 1:].swapaxes(1, 2)
    rubbing, refusals = np.zeros((n, len(elements))), {}
    if elements:
        rubbing, plain = sliding_loads(elements, start, slopes)
        for k in np.flatnonzero(~(plain & kept.all(axis=1) & (J.shape[1] <= J.shape[2]))).tolist():
            try:
                rubbing[k] = _loads(compiled, elements, (J[k] * unit).T, start[k], slopes[k], units[k])
            except GeometryError as error:
                rubbing[k], refusals[k] = np.nan, error
    lam = start + np.einsum("nmf,nf->nm", slopes, rubbing)
    missing = inertial - loads - np.einsum("nf,nfc->nc", rubbing, units)
    rest = missing + np.einsum("nmc,nm->nc", J, lam)
    size = np.abs(inertial) + np.abs(loads) + np.einsum("nmc,nm->nc", np.abs(J), np.abs(lam))
    return Balance(lam, missing, np.abs((rest * v).sum(axis=1)), (np.abs(v) * size).sum(axis=1), refusals)


def _loads(
    compiled: Compiled, elements: tuple[FrictionElement, ...], matrix: Array, lam: Array, parts: Array, units: Array
) -> Array:
    """Return the loads that fit the friction they make; none, several, or an open reaction in them are refused."""
    _, S, Vt = np.linalg.svd(matrix)
    null = Vt[int(np.sum(1e-10 * S[0] < S)) :]
    rubbing = [e for e, unit in zip(elements, units) if unit.any()]
    for e in rubbing:
        shared = np.abs(null[np.abs(null[:, e.rows]).max(axis=1, initial=0.0) > 1e-8]).max(axis=0, initial=0.0) > 1e-8
        if shared.any():
            names = ", ".join(joint_names(compiled, shared))
            raise GeometryError(
                f"the friction in joint {e.name} depends on a reaction that is not determined: {names} share it; "
                "remove one of the redundant constraints, or the friction"
            )
    found, known = fitting_loads(elements, lam, parts)
    if len(found) != 1 or not known:
        count = f"{len(found) or 'no'} sets of" if known else "it is not decided which"
        raise GeometryError(
            f"{count} loads fit the friction in {', '.join(e.name for e in rubbing)} at an input; reduce the friction "
            "coefficient"
        )
    return found[0]


def _efforts(
    compiled: Compiled, reactions: Reactions, motion: Motion, rates: Array, work: Array
) -> tuple[Array, Array]:
    """Efforts and power of the drivers; a driver alone has its effort from the virtual work, which loses no digits."""
    mechanism = motion.mechanism
    n, count = len(motion.inputs), len(mechanism.drivers)
    efforts, power = np.zeros((n, count)), np.zeros(n)
    for k, driver in enumerate(mechanism.drivers):
        own = reactions.joints[len(reactions.joints) - count + k]
        joint = mechanism.joint(*driver.pair)
        sense = 1.0 if driver.link == joint.b else -1.0
        if isinstance(joint, Revolute):
            efforts[:, k] = sense * own.couple
        else:
            direction = np.exp(1j * (motion.poses[:, joint.a, 2] + joint.angle_a))  # type: ignore[union-attr]
            efforts[:, k] = sense * (np.conj(direction) * (own.force[:, 0] + 1j * own.force[:, 1])).real
        way = joint_coordinate(mechanism, driver.base, driver.link, motion.poses, motion.velocities)[1]
        if len(compiled.laws) == 1:
            efforts[:, k] = np.divide(work, way, out=efforts[:, k].copy(), where=way != 0.0)
        power += efforts[:, k] * joint_coordinate(mechanism, driver.base, driver.link, motion.poses, rates)[1]
    return efforts, power


@dataclass(frozen=True, eq=False, repr=False)
class StaticForces(Shown):
    """Forces at rest at every sample of a motion (estimated: float64; NaN where the motion does not reach).

    Attributes
    ----------
    motion : Motion
    efforts : ndarray, shape (n, drivers)
        Torque (N times the unit of length) or force (N) that every driver exerts on its ``link`` to hold the mechanism.
    reactions : Reactions
        Of all joints; see `between`.
    """

    motion: Motion
    efforts: Array
    reactions: Reactions

    def between(self, a: int, b: int) -> Array:
        """Return the force that link a exerts on link b in their joint, shape (n, 2), N, in fixed coordinates."""
        return self.reactions.between(a, b).on(b)[0]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        mechanism, inputs = self.motion.mechanism, self.motion.inputs
        angular = not isinstance(mechanism.joint(*mechanism.drivers[0].pair), Prismatic)
        rows = []
        for driver, effort in zip(mechanism.drivers, self.efforts.T):
            kind = "force" if isinstance(mechanism.joint(*driver.pair), Prismatic) else "torque"
            ends = f"{np.nanmin(effort):.4g} to {np.nanmax(effort):.4g}" if np.isfinite(effort).any() else "unknown"
            rows.append((f"driver {driver.base}-{driver.link}", f"{kind} {ends}"))
        for joint in self.reactions.joints:
            size = joint.size
            if joint.kind == "driver" or not np.isfinite(size).any():
                continue
            at = float(inputs[int(np.nanargmax(size))])
            where = f"{math.degrees(at):.4g}°" if angular else f"{at:.4g}"
            rows.append((f"joint {joint.a}-{joint.b}", f"force up to {np.nanmax(size):.4g}, at input {where}"))
        return "Static forces in the units of the loads (estimated: float64)", rows


def static_forces(
    motion: Motion,
    loads: Mapping[str | int, Any] | Sequence[Force | Torque],
    gravity: tuple[float, float] = (0.0, 0.0),
    bodies: Mapping[int, Body] | None = None,
) -> StaticForces:
    """Find the forces in all joints, and what the drivers must hold, at every position of a motion at rest.

    Parameters
    ----------
    motion : Motion
    loads : mapping, or sequence of Force and Torque
        By the name of a point, the force (fx, fy) that acts there, N; by the number of a link, the torque on it, N
        times the unit of length, its opposite on the frame.
    gravity : (gx, gy)
        m/s^2; acts on ``bodies`` only.
    bodies : mapping of int to Body, optional
        Masses of links; the others have none.

    Returns
    -------
    StaticForces

    Raises
    ------
    GeometryError
        A point or link that does not exist, a load of another kind.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> arm = Mechanism.from_points({"A": (0, 0), "B": (2, 0)}, ["AB"], "A")
    >>> arm.simulate([0.0]).forces({"B": (0, -100)}).efforts.round(9).tolist()
    [[200.0]]
    """
    mechanism = motion.mechanism
    given = [_load(motion, where, what) for where, what in loads.items()] if isinstance(loads, Mapping) else list(loads)
    massless = {link: Body(0.0, 0.0) for link in range(mechanism.graph.links) if link != mechanism.frame}
    model = DynamicModel(mechanism, {**massless, **(bodies or {})}, tuple(given), gravity)
    found = inverse_dynamics(model, motion, speed=0.0)
    return StaticForces(motion, found.efforts, found.reactions)


def _load(motion: Motion, where: str | int, what: Any) -> Force | Torque:
    mechanism = motion.mechanism
    if not isinstance(where, str):
        return Torque(mechanism.frame, where, what)
    if where not in mechanism.points:
        known = ", ".join(mechanism.points) or "none"
        raise GeometryError(f"point {where!r} of a load is not defined; the mechanism has {known}")
    link, at = mechanism.points[where]
    return Force(link, what, at)
