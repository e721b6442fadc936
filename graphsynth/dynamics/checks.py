"""Checks of a computed motion: energies, residuals, second formulations (theory/planar-dynamics 8)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import kernels
from graphsynth.dynamics.forms.one_coordinate import OneCoordinateForm, one_coordinate_obstacle
from graphsynth.dynamics.model import Rack, Rigid
from graphsynth.dynamics.reactions import reactions_from_multipliers, world
from graphsynth.dynamics.result import FrictionHistory, MotorHistory, RunChecks
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.switching import motor_torques, shaft_speeds
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import Values, applied_loads, initial_slots
from graphsynth.mechanism.joints import Cam, Gear, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver

if TYPE_CHECKING:
    from graphsynth.dynamics.friction.problem import FrictionSolution

Array = NDArray[np.float64]
#: Part of the largest accelerations of a motion below which those of a state are no measure of an error.
_ROUNDED = 1e-9


class Balance(NamedTuple):
    """What one state gives: accelerations, multipliers, energies, power, residuals."""

    a: Array
    multipliers: Array
    kinetic: float
    potential: float
    power: float
    power_error: float
    power_scale: float
    position: float
    velocity: float
    dalembert: float
    bodies: Array


def balance_at(
    compiled: Compiled,
    t: float,
    q: Array,
    v: Array,
    currents: Array,
    slots: Array,
    own: Array | None,
    fit: FrictionSolution | None = None,
) -> Balance:
    """Evaluate one state; ``own`` are accelerations of another formulation, used where masses vanish."""
    T = compiled.tables
    driven = compiled.driven(t)
    x = kernels.state_rows(T, q, v)
    applied = applied_loads(compiled, t, q, v)
    Q, Qc, V, P, _ = kernels.load_vector(T, x, applied, currents)
    C, J, gam, vel = kernels.constraint_system(T, x, slots, driven)
    rubbing, rubbed = np.zeros_like(Q), 0.0
    if fit is not None:
        a, lam, rubbing, rubbed = fit.a, fit.multipliers, fit.rubbing, float(fit.forces @ fit.rates)
    elif T.friction.size:
        a, lam = np.full_like(Q, np.nan), np.full(len(C), np.nan)
    elif T.lower.size:
        a, lam = kernels.accelerate(T, x, J, gam, Q, np.zeros(7))
    else:
        assert own is not None  # massless links: one-coordinate form only
        a = own
        lam = np.linalg.lstsq(J.T, Q - T.mass @ a, rcond=1e-12)[0]
    inertial = T.mass @ a
    drivers = -float(lam @ vel)
    power = float(P + rubbed + drivers)
    rate = float(v @ (inertial - Qc))
    residual = inertial + J.T @ lam - Q - rubbing
    forces = max(float(np.abs(part).max(initial=1e-300)) for part in (Q, inertial, J * lam[:, None]))
    return Balance(
        a,
        lam,
        0.5 * float(v @ T.mass @ v),
        float(V),
        power,
        abs(rate - power),
        float(np.abs(v) @ (np.abs(inertial) + np.abs(Q) + np.abs(J.T) @ np.abs(lam))),
        float(np.abs(C / compiled.row_unit).max(initial=0.0)),
        float(np.abs((J @ v - vel) / compiled.row_unit).max(initial=0.0)),
        float(np.abs(residual).max(initial=0.0)) / forces,
        0.5 * (np.diag(T.mass) * v**2).reshape(-1, 3).sum(axis=1),
    )


def energy_error(times: Array, kinetic: Array, potential: Array, work: Array, power: Array, bodies: Array) -> float:
    """Largest ``|E - E(0) - W|`` over the energies in play.

    The scale is the largest of the ranges of kinetic (of all, and of every body), potential and total energy and of
    the power's integral, and at least a tenth of the kinetic energy: for a conservative motion the range of
    the total energy alone is the error itself.
    """
    good = np.isfinite(kinetic)
    if not good.any():
        return math.nan
    E, t = (kinetic + potential)[good], times[good]
    error = float(np.abs(E - E[0] - work[good]).max())
    spent = float(np.trapezoid(np.abs(power[good]), t))
    scale = max(float(np.ptp(part)) for part in (kinetic[good], potential[good], E))
    scale = max(scale, spent, float(np.ptp(bodies[good], axis=0).max(initial=0.0)), 0.1 * float(kinetic[good].max()))
    return error / scale if scale > 0.0 else 0.0


def checks_of(
    compiled: Compiled, times: Array, balances: list[Balance], work: Array, second: list[Array | None]
) -> RunChecks:
    """Collect the checks of all states reached; those of the run as a whole are left open."""
    if not balances:
        return RunChecks()
    kinetic, potential, power = (
        np.array([getattr(b, name) for b in balances]) for name in ("kinetic", "potential", "power")
    )
    n = len(balances)
    errors = np.array([b.power_error for b in balances])
    scale = max(b.power_scale for b in balances)
    unit = compiled.unit
    sizes = [float(np.abs(b.a / unit).max()) for b in balances]
    largest = max((size for size in sizes if size == size), default=0.0)
    least = max(_ROUNDED * largest, 1e-300)  # what is far below the others is rounding
    apart = [
        float(np.abs((b.a - other) / unit).max()) / max(size, least)
        for b, other, size in zip(balances, second, sizes)
        if other is not None
    ]
    return RunChecks(
        max(b.position for b in balances),
        max(b.velocity for b in balances),
        energy_error(times[:n], kinetic, potential, work[:n], power, np.array([b.bodies for b in balances])),
        float(errors.max()) / scale if scale > 0.0 else 0.0,
        max(b.dalembert for b in balances),
        max(apart, default=math.nan),
    )


def motor_histories(
    compiled: Compiled, v: Array, currents: Array, modes: NDArray[np.int64]
) -> tuple[MotorHistory, ...]:
    """Speed, torque, currents and torque behind the train of every motor."""
    shafts, found, first = shaft_speeds(compiled, v), [], 0
    torques = motor_torques(compiled, shafts, currents)
    for k, drive in enumerate(compiled.drives):
        eta = np.where(modes[:, k, 1] < 0, 1.0 / drive.train.efficiency, drive.train.efficiency)
        last = first + len(drive.currents)
        name, torque = f"motor {drive.a}-{drive.b}", torques[:, k]
        output = drive.train.ratio * eta * torque
        found.append(MotorHistory(name, shafts[:, k], torque, currents[:, first:last].copy(), output))
        first = last
    return tuple(found)


def electric_error(compiled: Compiled, times: Array, tail: Array, motors: tuple[MotorHistory, ...]) -> float:
    """Largest defect of the energy of the currents over the energies in play; NaN without currents."""
    good = np.isfinite(tail[:, -1])
    if not len(compiled.currents) or not good.any():
        return math.nan
    stored, moved = np.zeros(good.sum()), 0.0
    for drive, motor in zip(compiled.drives, motors):
        inductance = getattr(drive.equation, "inductance", 0.0) * (1.5 if motor.currents.shape[1] == 2 else 1.0)
        stored += 0.5 * inductance * (motor.currents[good] ** 2).sum(axis=1)
        moved += float(np.abs(np.trapezoid(np.abs(motor.torque * motor.speed)[good], times[good])))
    error = float(np.abs(stored - stored[0] - tail[good, -2]).max())
    scale = max(float(stored.max()), moved)
    return error / scale if scale > 0.0 else 0.0


def warnings_of(checks: RunChecks, rtol: float, friction: FrictionHistory | None = None) -> tuple[str, ...]:
    """Say which checks are worse than expected, each in a sentence."""
    found = [
        f"{', '.join(names)} stick together in a loop: how they share their friction is not determined, and the "
        "reactions there are those in which all are used to the same part of their limits"
        for names in (() if friction is None else friction.shared)
    ]
    unknown = [name for name in ("position_drift", "energy", "power", "dalembert") if np.isnan(getattr(checks, name))]
    if unknown:
        found.append(f"no value of {', '.join(unknown)}: a state reached has no accelerations, or none was reached")
    for kind, value in (("", checks.energy), ("electrical ", checks.electric)):
        if value > max(1e-9, 100.0 * rtol):
            found.append(
                f"the {kind}energy balance is off by {value:.2g} of the energies in play, at a relative tolerance of "
                f"{rtol:g}; tighten rtol"
            )
    if checks.position_drift > 1e-9:
        found.append(
            f"the joints are open by {checks.position_drift:.2g} characteristic lengths; project, or tighten rtol"
        )
    if checks.power > 1e-9 or checks.dalembert > 1e-9:
        found.append(
            f"the equations of motion are satisfied to {max(checks.power, checks.dalembert):.2g} only: the pose is "
            "close to a singular one, or the constraints contradict each other"
        )
    if checks.second_form > 1e-7:
        found.append(
            f"two formulations differ by {checks.second_form:.2g} in the accelerations; a singular pose is near"
        )
    return tuple(found)


def second_accelerations(
    compiled: Compiled, report: StartReport, times: Array, q: Array, v: Array, currents: Array
) -> list[Array | None]:
    """Accelerations of given states by a formulation without multipliers.

    Through the planar engine at up to 20 states if there is a one-coordinate form, in a null-space basis elsewhere;
    None with friction and where a pose is singular.
    """
    if compiled.tables.friction.size or compiled.model.massless:
        return [None] * len(q)
    found = [_null_space(compiled, float(t), q[k], v[k], currents[k]) for k, t in enumerate(times)]
    if not one_coordinate_obstacle(compiled.model):
        for k in np.unique(np.linspace(0, len(q) - 1, min(len(q), 20)).astype(int)) if len(q) else ():
            poses, rates, _ = compiled.to_links(q[k], v[k], np.zeros_like(q[k]))
            try:
                form = OneCoordinateForm(compiled, replace(report, poses=poses, velocities=rates))
            except GeometryError:  # next to a fold: the null-space value stays
                continue
            y = form.begin()
            compiled.currents_of(y)[:] = currents[k]
            a = form.accelerations(float(times[k]), y)
            _, q1, _ = form.transmission(float(y[0]))
            if found[k] is not None and np.isfinite(a).all() and float(np.abs(q1).max()) < 1e3:
                found[k] = a
    return found


def _null_space(compiled: Compiled, t: float, q: Array, v: Array, currents: Array) -> Array | None:
    """Solve ``(N^T M N) y = N^T (Q - M a0)`` with N an orthonormal basis of the null space; None at a singular pose."""
    values = Values(compiled, t, initial_slots(compiled, q))
    T = compiled.tables
    _, J, gam, _ = values.system(q, v)
    scale, unit = values.compiled.unit, values.compiled.row_unit
    U, S, Vt = np.linalg.svd(J * scale / unit[:, None])
    rank = int(np.sum(1e-10 * S[0] < S)) if S.size else 0
    if rank and S[rank - 1] < 1e-3 * S[0]:
        return None
    a0 = scale * (Vt[:rank].T @ ((U.T @ (gam / unit))[:rank] / S[:rank]))
    N = scale[:, None] * Vt[rank:].T
    Q = _loads(compiled, t, q, v, currents)
    return np.asarray(a0 + N @ np.linalg.solve(N.T @ T.mass @ N, N.T @ (Q - T.mass @ a0)))


def newton_euler(
    compiled: Compiled, t: float, q: Array, v: Array, a: Array, currents: Array
) -> list[tuple[complex, float, complex]]:
    """Reactions (force and couple on link b of every joint, point) from force and moment balance of every body.

    Unknowns are the contact forces themselves, placed by geometry, not by the constraint Jacobian: pin forces, guide
    forces and couples, tooth forces at the pitch point, forces along the normal of a cam.  Solved by least squares.
    """
    place = np.zeros((compiled.links, 3))
    place[compiled.moving] = q.reshape(-1, 3)
    wrenches = [_units(compiled, joint, place) for joint in compiled.joints]
    columns = sum(len(found) for _, _, found in wrenches)
    matrix, column = np.zeros((compiled.n, columns)), 0
    for a_link, b_link, found in wrenches:
        for force, couple, at in found:
            for link, sign in ((a_link, -1.0), (b_link, 1.0)):
                k = int(compiled.tables.column[link])
                if k >= 0:
                    arm = at - complex(*place[link, :2])
                    moment = (np.conj(arm) * force).imag + couple
                    matrix[k : k + 3, column] += sign * np.array([force.real, force.imag, moment])
            column += 1
    right = compiled.tables.mass @ a - _loads(compiled, t, q, v, currents)
    scale = compiled.unit / compiled.tables.size
    solution = np.linalg.lstsq(matrix * scale[:, None], right * scale, rcond=1e-12)[0]
    results, column = [], 0
    for _, _, found in wrenches:
        force, couple, at = 0j, 0.0, found[0][2]
        for unit, turn, _ in found:
            force, couple = force + solution[column] * unit, couple + float(solution[column]) * turn
            column += 1
        results.append((complex(force), couple, at))
    return results


def _loads(compiled: Compiled, t: float, q: Array, v: Array, currents: Array) -> Array:
    T = compiled.tables
    x = kernels.state_rows(T, q, v)
    Q, _, _, _, _ = kernels.load_vector(T, x, applied_loads(compiled, t, q, v), currents)
    return np.asarray(Q)


def _units(compiled: Compiled, joint: object, place: Array) -> tuple[int, int, list[tuple[complex, float, complex]]]:
    """Return unit wrenches (force on b, couple on b, point) that a joint can carry."""
    if isinstance(joint, Driver):
        own = compiled.model.mechanism.joint(*joint.pair)
        at = world(place, compiled, own.b, own.at_b)
        along = complex(np.exp(1j * (place[own.a, 2] + getattr(own, "angle_a", 0.0))))
        return own.a, own.b, [(along, 0.0, at) if isinstance(own, Prismatic) else (0j, 1.0, at)]
    if isinstance(joint, Rack):
        at = world(place, compiled, joint.pinion, joint.centre) - 1j * complex(np.exp(1j * joint.angle)) * joint.radius
        return joint.rack, joint.pinion, [(complex(np.exp(1j * joint.angle)), 0.0, at)]
    assert isinstance(joint, Revolute | Prismatic | Gear | Cam | Rigid) or hasattr(joint, "at_b")
    a, b = joint.a, joint.b  # type: ignore[attr-defined]
    at = world(place, compiled, b, joint.at_b)
    if isinstance(joint, Revolute | Rigid):
        couple = [(0j, 1.0, at)] if isinstance(joint, Rigid) else []
        return a, b, [(1.0 + 0j, 0.0, at), (1j, 0.0, at), *couple]
    if isinstance(joint, Gear):  # along the tangent at the pitch point, which divides the line of centres as the radii
        centre = world(place, compiled, a, joint.at_a)
        total = joint.radius_a + (-1.0 if joint.internal else 1.0) * joint.radius_b
        apart = at - centre
        return a, b, [(1j * apart / abs(apart), 0.0, centre + apart * (joint.radius_a / total))]
    if isinstance(joint, Cam):  # along the normal of the pitch curve at the roller's centre
        centre = world(place, compiled, a, joint.at_a)
        out = (at - centre) / abs(at - centre)
        rho, first, _ = joint.pitch_radius(math.atan2(out.imag, out.real) - place[a, 2] - joint.angle_a)
        tangent = first * out + rho * 1j * out
        return a, b, [(complex(-1j * tangent / abs(tangent)), 0.0, at)]
    normal = 1j * complex(np.exp(1j * (place[a, 2] + joint.angle_a)))  # type: ignore[attr-defined]
    return a, b, [(normal, 0.0, at), *([(0j, 1.0, at)] if isinstance(joint, Prismatic) else [])]


def newton_euler_difference(
    compiled: Compiled, times: Array, q: Array, v: Array, a: Array, lam: Array, currents: Array
) -> float:
    """Largest difference of determined reactions between both ways, over the largest force; NaN with friction."""
    equal = [
        joint
        for joint in compiled.joints
        if isinstance(joint, Gear) and joint.internal and joint.radius_a == joint.radius_b
    ]
    if compiled.tables.friction.size or equal or not len(q) or not compiled.joints:
        return math.nan
    reactions = reactions_from_multipliers(compiled, q, v, lam, times)
    worst, size = 0.0, 1e-300
    for k in range(len(q)):
        for joint, (force, couple, at) in zip(
            reactions.joints, newton_euler(compiled, float(times[k]), q[k], v[k], a[k], currents[k])
        ):
            arm = complex(*joint.point[k]) - at
            moment = couple - (np.conj(arm) * force).imag
            parts = np.array([force.real, force.imag, moment / compiled.tables.size])
            own = np.array([*joint.force[k], joint.couple[k] / compiled.tables.size])
            size = max(size, float(np.abs(own).max()))
            worst = max(worst, float(np.abs(parts - own)[joint.determined[k]].max(initial=0.0)))
    return worst / size
