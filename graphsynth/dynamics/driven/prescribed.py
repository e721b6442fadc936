"""The ideal speed source: the motion is given and the torque follows by inverse dynamics; nothing is integrated."""

from __future__ import annotations

import math
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.run import DriveRun, RunStatus, largest_defect
from graphsynth.dynamics.driven.setup import FROM_REST, DriveOptions, Plant, output_times, prepare
from graphsynth.dynamics.motors import IdealSpeed, LinearCharacteristic, Train

Array = NDArray[np.float64]
#: Largest angle of a panel of the quadrature that checks the energy, rad.
_PANEL = 0.2


def prescribed_run(
    plant: Plant, motor: IdealSpeed, train: Train, times: ArrayLike, options: DriveOptions = FROM_REST
) -> DriveRun:
    """Motion of an ideal speed source: constant crank speed, the motor torque by inverse dynamics, in closed form.

    Of the options count ``angle`` and ``speed``, 0 or that of the source.  ``energy_error`` compares the kinetic energy
    with a quadrature of the net power ``J'(q) w^3 / 2``.  NaN from the first angle on at which the mechanism cannot be
    assembled.
    """
    begin = perf_counter()
    out = output_times(times)
    w = motor.value / train.ratio
    if (speed := finite("speed", options.speed, SpecError)) not in (0.0, w):
        raise SpecError(f"speed = {speed:g} contradicts the ideal source, which turns the crank at {w:g}; leave it out")
    q = finite("angle", options.angle, SpecError) + w * (out - out[0])
    J, slope, load, friction = _terms(plant, motor, train, out, q)
    required = slope * w * w + friction * w - load
    eta = np.where(required * w >= 0.0, train.efficiency, 1.0 / train.efficiency)
    work = np.concatenate([[0.0], np.cumsum(_net_work(plant, motor, train, out, q, w))])
    reached, kinetic = int(np.isfinite(J).cumprod().sum()), 0.5 * J * w * w
    complete = reached == out.size
    there = np.arange(out.size) < reached
    turns = np.where(there, np.round(q / math.tau), 0.0).astype(np.int64)
    torque = required / (train.ratio * eta)
    given = q, np.full(out.size, w), q - math.tau * turns, np.sqrt(J) * w, torque, kinetic, work
    angles, speeds, reduced, momentum, torque, energy, moved = (np.where(there, part, np.nan) for part in given)
    return DriveRun(
        time=out,
        angle=angles,
        speed=speeds,
        currents=np.zeros((out.size, 0)),
        reduced_angle=reduced,
        turns=turns,
        momentum=momentum,
        motor_torque=torque,
        kinetic_energy=energy,
        work=moved,
        energy_error=largest_defect(kinetic - kinetic[0] - work, kinetic, reached),
        electric_error=0.0,
        error=np.array([2.0**-52 * float(np.abs(q).max()), 0.0]),
        events=(),
        status=RunStatus.DONE if complete else RunStatus.NOT_FINITE,
        reached=reached,
        reason="" if complete else f"the mechanism cannot be assembled at t = {out[reached]:.6g} s",
        model="ideal speed (motion given, torque by inverse dynamics)",
        steps=0,
        rejected=0,
        rtol=math.nan,
        seconds=perf_counter() - begin,
    )


def _terms(plant: Plant, motor: IdealSpeed, train: Train, out: Array, q: Array) -> tuple[Array, Array, Array, float]:
    """Inertia, half its derivative and the driving load at angles q; the viscous coefficient."""
    from graphsynth.dynamics.driven.kernels import systems as s

    idle = LinearCharacteristic(0.0, 0.0, motor.rotor_inertia, motor.friction)
    ready = prepare(plant, idle, train, out, DriveOptions(float(q[0])), singular=True)
    table = np.zeros((q.size, 16))
    with np.errstate(invalid="ignore"):
        s.tabulate(ready.setup, np.ascontiguousarray(q), ready.values, ready.rows, table)
    return table[:, 0], table[:, 1], table[:, 2], float(ready.values[s.FRICTION])


def _net_work(plant: Plant, motor: IdealSpeed, train: Train, out: Array, q: Array, w: float) -> Array:
    """Work of all torques on the mechanism between output times: Gauss quadrature of ``J'(q) w^2 / 2`` over q."""
    nodes, weights = np.polynomial.legendre.leggauss(10)
    counts = np.maximum(np.ceil(np.abs(np.diff(q)) / _PANEL), 1).astype(np.intp)
    edges = np.concatenate([[q[0]], *(np.linspace(a, b, n + 1)[1:] for a, b, n in zip(q[:-1], q[1:], counts))])
    half = 0.5 * np.diff(edges)
    angles = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    slope = _terms(plant, motor, train, out, angles.ravel())[1].reshape(angles.shape)
    panels = half * (slope @ weights) * w * w
    return np.asarray(np.add.reduceat(panels, np.concatenate([[0], np.cumsum(counts)[:-1]])))
