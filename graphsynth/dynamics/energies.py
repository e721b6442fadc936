"""Energies and checks of a computed motion (theory/planar-dynamics 8)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.history import FrictionAt
from graphsynth.dynamics.result import Checks, FrictionHistory, MotorHistory
from graphsynth.dynamics.switching import motor_torques, shaft_speeds
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads

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
    compiled: Compiled, t: float, q: Array, v: Array, currents: Array, slots: Array, own: Array | None,
    fit: FrictionAt | None = None,
) -> Balance:  # fmt: skip
    """Evaluate one state; ``own`` are accelerations of another formulation, used where masses vanish."""
    from graphsynth.dynamics import kernels

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
    forces = max(float(np.abs(Q).max(initial=0.0)), float(np.abs(inertial).max(initial=0.0)),
                 float(np.abs(J * lam[:, None]).max(initial=0.0)), 1e-300)  # fmt: skip
    unit = np.array([1.0 if info.angular else T.size for info in compiled.info])
    return Balance(
        a, lam, 0.5 * float(v @ T.mass @ v), float(V), power, abs(rate - power),
        float(np.abs(v) @ (np.abs(inertial) + np.abs(Q) + np.abs(J.T) @ np.abs(lam))),
        float(np.abs(C / unit).max(initial=0.0)), float(np.abs((J @ v - vel) / unit).max(initial=0.0)),
        float(np.abs(residual).max(initial=0.0)) / forces,
        0.5 * (np.diag(T.mass) * v**2).reshape(-1, 3).sum(axis=1),
    )  # fmt: skip


def energy_error(times: Array, kinetic: Array, potential: Array, work: Array, power: Array, bodies: Array) -> float:
    """Largest ``|E - E(0) - W|`` over the energies in play.

    The scale is the largest of the ranges of kinetic (of all, and of every body), potential and total energy and of
    the power's integral, and at least a tenth of the kinetic energy: for a conservative motion the range of
    the total energy alone is the error itself.
    """
    good = np.isfinite(kinetic)
    if not good.any():
        return float("nan")
    E, t = (kinetic + potential)[good], times[good]
    error = float(np.abs(E - E[0] - work[good]).max())
    spent = (
        float(np.sum(0.5 * np.diff(t) * (np.abs(power[good][1:]) + np.abs(power[good][:-1])))) if len(t) > 1 else 0.0
    )
    scale = max(float(np.ptp(part)) for part in (kinetic[good], potential[good], E))
    scale = max(scale, spent, float(np.ptp(bodies[good], axis=0).max(initial=0.0)), 0.1 * float(kinetic[good].max()))
    return error / scale if scale > 0.0 else 0.0


def checks_of(
    compiled: Compiled, times: Array, balances: list[Balance], work: Array, second: list[Array | None], newton: float,
    loss: float, contraction: float, electric: float,
) -> Checks:  # fmt: skip
    """Collect the checks over all output times reached."""
    if not balances:
        return Checks(*[float("nan")] * 10)
    kinetic, potential, power = (
        np.array([getattr(b, name) for b in balances]) for name in ("kinetic", "potential", "power")
    )
    n = len(balances)
    errors = np.array([b.power_error for b in balances])
    scale = max(b.power_scale for b in balances)
    unit = np.tile([compiled.tables.size, compiled.tables.size, 1.0], compiled.n // 3)
    sizes = [float(np.abs(b.a / unit).max()) for b in balances]
    largest = max((size for size in sizes if size == size), default=0.0)
    least = max(_ROUNDED * largest, 1e-300)  # what is far below the others is rounding
    apart = [
        float(np.abs((b.a - other) / unit).max()) / max(size, least)
        for b, other, size in zip(balances, second, sizes) if other is not None
    ]  # fmt: skip
    return Checks(
        max(b.position for b in balances), max(b.velocity for b in balances),
        energy_error(times[:n], kinetic, potential, work[:n], power, np.array([b.bodies for b in balances])),
        float(errors.max()) / scale if scale > 0.0 else 0.0, max(b.dalembert for b in balances),
        max(apart, default=float("nan")), newton, loss, contraction, electric,
    )  # fmt: skip


def motor_histories(
    compiled: Compiled, v: Array, currents: Array, modes: NDArray[np.int64]
) -> tuple[MotorHistory, ...]:
    """Speed, torque, currents and torque behind the train of every motor."""
    shafts, found = shaft_speeds(compiled, v), []
    torques = np.array([motor_torques(compiled, w, i) for w, i in zip(shafts, currents)])
    first = 0
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
        return float("nan")
    stored, moved = np.zeros(good.sum()), 0.0
    for drive, motor in zip(compiled.drives, motors):
        inductance = getattr(drive.equation, "inductance", 0.0) * (1.5 if motor.currents.shape[1] == 2 else 1.0)
        stored += 0.5 * inductance * (motor.currents[good] ** 2).sum(axis=1)
        moved += float(np.abs(np.trapezoid(np.abs(motor.torque * motor.speed)[good], times[good])))
    error = float(np.abs(stored - stored[0] - tail[good, -2]).max())
    scale = max(float(stored.max()), moved)
    return error / scale if scale > 0.0 else 0.0


def warnings_of(checks: Checks, rtol: float, friction: FrictionHistory | None = None) -> tuple[str, ...]:
    """Say which checks are worse than expected, each in a sentence."""
    found = [
        f"{', '.join(names)} stick together in a loop: how they share their friction is not determined, and the "
        "reactions there are those in which all are used to the same part of their limits"
        for names in (() if friction is None else friction.shared)
    ]
    unknown = [name for name in ("position_drift", "energy", "power", "dalembert") if np.isnan(getattr(checks, name))]
    if unknown:
        found.append(f"no value of {', '.join(unknown)}: a state reached has no accelerations, or none was reached")
    if checks.energy > max(1e-9, 100.0 * rtol):
        found.append(
            f"the energy balance is off by {checks.energy:.2g} of the energies in play, at a relative tolerance of "
            f"{rtol:g}; tighten rtol"
        )
    if checks.electric > max(1e-9, 100.0 * rtol):
        found.append(
            f"the electrical energy balance is off by {checks.electric:.2g} of the energies in play, at a relative "
            f"tolerance of {rtol:g}; tighten rtol"
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
