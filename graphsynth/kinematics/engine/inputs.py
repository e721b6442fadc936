"""Inputs of a motion: their check, the coordinates of the drivers, the internal grid, full turns, the whole range."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.angles import angles
from graphsynth.core.checks import called, finite_array
from graphsynth.core.errors import GeometryError, UnitWarning
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.laws import LAWS, Harmonic, Linear, Table

if TYPE_CHECKING:
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

#: Largest step of a turning driver on the internal grid, radians: events between samples are looked for on it.
_FINE = math.tau / 360.0
#: Parts of the whole range for a prismatic driver.
_PARTS = 200.0
#: Most poses of links on the internal grid: about 2 GB of state.
_MOST = 2e7


def monotonic(inputs: ArrayLike) -> Array:
    """Return the inputs as an array; `GeometryError` unless they are finite and increase or decrease strictly."""
    u = finite_array("inputs", inputs)
    if u.ndim != 1 or u.size == 0:
        raise GeometryError(f"inputs have shape {u.shape}; give one list of one or more inputs")
    steps = np.diff(u)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise GeometryError("inputs must increase or decrease strictly; sort them and remove duplicates")
    return u


def warn_of_degrees(mechanism: Mechanism, u: Array) -> None:
    """Warn where the angle of a driver runs over quarters of 360: 0 to 360 radians are 57.3 turns, hardly meant.

    Whole turns are multiples of ``2 pi``, never of 90; ranges without their end, like ``range(0, 360, 5)``, count too.
    """
    if u.size < 2:
        return
    span, step = abs(float(u[-1] - u[0])), abs(float(u[-1] - u[-2]))
    if not any(whole >= 89.0 and abs(whole - 90.0 * round(whole / 90.0)) < 1e-9 for whole in (span, span + step)):
        return
    for driver in mechanism.drivers:
        turns = not isinstance(mechanism.joint(*driver.pair), Prismatic)
        if turns and isinstance(driver.law, Linear) and abs(driver.law.rate) == 1.0:
            warnings.warn(
                f"the inputs run from {u[0]:g} to {u[-1]:g}, and driver {driver.base}-{driver.link} takes them as "
                f"radians ({span / math.tau:.3g} turns); if they are degrees, give gs.degrees(inputs)",
                UnitWarning,
                stacklevel=4,
            )
            return


def coordinates(driver: Driver, u: Array) -> tuple[Array, Array, Array]:
    """Coordinate of a driver and its two derivatives, NaN where the law has no finite value.

    `GeometryError` if the law does not return three arrays of the shape of its input.
    """
    name = f"the law of driver {driver.base}-{driver.link}"
    found = called(name, driver.law, u)
    if not isinstance(found, tuple | list) or len(found) != 3:
        what = f"{len(found)} of them" if isinstance(found, tuple | list) else f"one {type(found).__name__}"
        raise GeometryError(f"{name} must return three arrays, (q, dq/du, d2q/du2), not {what}")
    parts = [finite_array(f"a part of what {name} returned", part, nan=True) for part in found]
    for part in parts:
        if part.shape != u.shape:
            raise GeometryError(f"{name} returned the shape {part.shape} for inputs of shape {u.shape}; return as many")
    finite = np.isfinite(parts).all(axis=0)
    value, rate, second = parts if finite.all() else (np.where(finite, part, np.nan) for part in parts)
    return value, rate, second


def fine_grid(mechanism: Mechanism, u: Array) -> Array:
    """Return inputs with extra samples where a turning driver would step too far.

    `GeometryError` if the range needs more samples than memory has room for, or the user's own law jumps.
    """
    if u.size < 2:
        return u
    parts = np.ones(u.size - 1)
    steps = np.abs(np.diff(u))
    for driver in mechanism.drivers:
        if isinstance(mechanism.joint(*driver.pair), Prismatic):
            size = steps * (_PARTS / abs(float(u[-1] - u[0])))
        else:
            # by values, rates and accelerations: a law that oscillates between neighbours is seen
            value, rate, second = coordinates(driver, u)
            by_rate = steps * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1]))
            by_second = 0.5 * steps**2 * np.maximum(np.abs(second[1:]), np.abs(second[:-1]))
            size = np.maximum(np.abs(np.diff(value)), np.maximum(by_rate, by_second)) / _FINE
        parts = np.maximum(parts, np.ceil(np.nan_to_num(size, nan=1.0) - 1e-9))
    if parts.sum() * mechanism.graph.links > _MOST:
        raise GeometryError(
            f"the inputs from {u[0]:.6g} to {u[-1]:.6g} need {parts.sum():.3g} samples in between, more than the limit "
            f"of {_MOST / mechanism.graph.links:.3g} for {mechanism.graph.links} links; give a shorter range"
        )
    counts = parts.astype(np.intp)
    part = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    grid = np.append(np.repeat(u[:-1], counts) + part * np.repeat(np.diff(u) / counts, counts), u[-1])
    for driver in mechanism.drivers:
        if type(driver.law) not in LAWS.values():  # the laws of the package are smooth
            _check_jumps(driver, grid)
    return grid


def _check_jumps(driver: Driver, u: Array) -> None:
    """Compare the changes of the user's own law with its derivative."""
    value, rate, _ = coordinates(driver, u)
    steps = np.diff(u)
    change, expected = np.diff(value), 0.5 * steps * (rate[1:] + rate[:-1])
    size = np.maximum(np.abs(change), np.abs(steps) * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1])))
    allowed = 0.1 * size + 1e-13 * np.abs(value[1:])
    bad = np.flatnonzero(np.abs(change - expected) > allowed)
    if bad.size:
        k = int(bad[0])
        raise GeometryError(
            f"the law of driver {driver.base}-{driver.link} changes by {change[k]:.6g} between the inputs {u[k]:.9g} "
            f"and {u[k + 1]:.9g}, but its derivative gives {expected[k]:.6g}: it jumps, its derivative is wrong, or "
            "the inputs are too coarse for it; correct the law or give finer inputs"
        )


def full_turn(mechanism: Mechanism, u: Array) -> bool:
    """Whether every driver returns to its place over the inputs, at least one of them after full turns."""
    if u.size < 2 or not mechanism.drivers:
        return False
    ends = np.array([u[0], u[-1]])
    moved = False
    for driver in mechanism.drivers:
        q, rate, _ = coordinates(driver, ends)
        sliding = isinstance(mechanism.joint(*driver.pair), Prismatic)
        change = float(q[1] - q[0])
        if not math.isfinite(change):
            return False
        turns = 0 if sliding else round(change / math.tau)
        # rounding of the driver's own coordinate is no missing turn
        slack = max(1e-9 * (float(np.abs(q).max()) if sliding else 1.0), 4.0 * np.spacing(float(np.abs(q).max())))
        if abs(change - turns * math.tau) > slack or abs(rate[1] - rate[0]) > 1e-9 * max(1.0, abs(rate[0])):
            return False
        moved = moved or turns != 0 or abs(change) <= slack
    return moved


def input_of(mechanism: Mechanism, input: float | str | None) -> float:
    """Return the input that is asked for, a number or an angle such as "30 deg"; the first one if there is none."""
    return first_input(mechanism) if input is None else float(angles("input", [input])[0])


def first_input(mechanism: Mechanism) -> float:
    """Return the input at which the first driver has the coordinate of the mechanism's pose; 0 without a pose."""
    driver = mechanism.drivers[0] if mechanism.drivers else None
    if driver is None or mechanism.pose is None or not isinstance(driver.law, Linear) or driver.law.rate == 0.0:
        return 0.0
    base, link = mechanism.pose[driver.base], mechanism.pose[driver.link]
    joint = mechanism.joint(*driver.pair)
    if isinstance(joint, Prismatic):
        (ax, ay, at), (bx, by, bt) = mechanism.pose[joint.a], mechanism.pose[joint.b]
        P = complex(ax, ay) + np.exp(1j * at) * complex(*joint.at_a)
        Q = complex(bx, by) + np.exp(1j * bt) * complex(*joint.at_b)
        along = float(((Q - P) * np.exp(-1j * (at + joint.angle_a))).real)
        q = along if driver.base == joint.a else -along
    else:
        q = link[2] - base[2]
    return (q - driver.law.offset) / driver.law.rate


def whole_range(mechanism: Mechanism) -> tuple[float, float]:
    """Return the inputs to be tried where none are given: a full rotation, a period, a table; else `GeometryError`."""
    if not mechanism.drivers:
        raise GeometryError("the mechanism has no driver, so nothing moves it; give drivers")
    driver, u0 = mechanism.drivers[0], first_input(mechanism)
    law, slides = driver.law, isinstance(mechanism.joint(*driver.pair), Prismatic)
    if isinstance(law, Linear) and law.rate:
        size = 4.0 * characteristic_length(mechanism) if slides else math.tau
        return u0, u0 + size / abs(law.rate)
    if isinstance(law, Harmonic) and law.order:
        return 0.0, math.tau / abs(law.order)
    if isinstance(law, Table):
        return law.inputs[0], law.inputs[-1]
    raise GeometryError(f"the range of the law {law!r} is not known; give inputs")
