"""Limit cycles of the tribometer: the exact belt cycle, and any cycle found by its return map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.motion import EventGuard, StickSlipEvent, StickSlipMotion
from graphsynth.systems.tribometer.platforms import BeltDrive, TwoCoefficientLaw

Array = NDArray[np.float64]
#: Relative change of the state by which the multipliers are measured.
_NUDGE = 1e-5


class BeltCycle(NamedTuple):
    """Exact cycle on a belt: times of stick, slip, period (s), positions where slip starts and ends (m)."""

    stick: float
    slip: float
    period: float
    release: float
    capture: float


def belt_cycle(model: Tribometer) -> BeltCycle:
    """Stick-slip cycle on a belt without damping, two-coefficient law: closed form, exact.

    ``T_stick = 2 (mu_s - mu_k) N / (k v0)``, ``T_slip = (2/w0) (pi - atan(A))`` with
    ``A = (mu_s - mu_k) N w0 / (k v0)`` (theory/tribometer 7).  `SpecError` for other drives and laws.

    Examples
    --------
    >>> from graphsynth.systems.tribometer.platforms import TwoCoefficientLaw
    >>> cycle = belt_cycle(Tribometer(damping=0.0, law=TwoCoefficientLaw(0.4, 0.25), drive=BeltDrive(0.02)))
    >>> round(cycle.period, 15)
    0.551496439575209
    """
    drive, law = model.drive, model.law
    if not isinstance(drive, BeltDrive) or drive.speed == 0.0:
        raise SpecError(f"The drive is {drive}; the belt cycle needs a BeltDrive with a speed other than zero.")
    if not isinstance(law, TwoCoefficientLaw) or law.viscous or model.damping:
        raise SpecError(
            f"The belt cycle in closed form needs a two-coefficient law without viscous part and no damping, "
            f"not {law} and {model.damping:g} N s/m; use limit_cycle."
        )
    speed, side = abs(drive.speed), math.copysign(1.0, drive.speed)
    drop = (law.static - law.kinetic) * model.normal / model.stiffness
    stick = 2.0 * drop / speed
    slip = 2.0 / model.frequency * (math.pi - math.atan(drop * model.frequency / speed))
    reach = side * model.normal / model.stiffness
    return BeltCycle(stick, slip, stick + slip, law.static * reach, (2.0 * law.kinetic - law.static) * reach)


@dataclass(frozen=True)
class LimitCycle:
    """A periodic motion, and its state ``x2``, ``v2`` (m, m/s) at whole turns of the crank, on a belt at the release.

    ``kind`` is "stick-slip", "sliding" (periodic without sticking), "stuck" (carried along all the time), "steady" (at
    rest on a moving belt) or "none found".  ``multipliers`` are the factors by which small changes of the state shrink
    over a period (Floquet multipliers), 0 for directions that a stick piece forgets altogether.
    """

    kind: str
    period: float  #: s; NaN if none was found or the platform is at rest
    turns: int  #: of the crank in one period; 0 on a belt
    x2: float
    v2: float
    events: tuple[StickSlipEvent, ...]  #: of one period, times counted from its start
    multipliers: tuple[complex, ...]
    stable: bool  #: all multipliers below 1 in size
    residual: float  #: change of x2 and of ``v2 / frequency`` over one period, m
    statement: str


def limit_cycle(
    model: Tribometer, *, most_turns: int = 400, longest: int = 8, guard: EventGuard | None = None
) -> LimitCycle:
    """Find the periodic motion to which the tribometer settles; estimated.

    With a crank the state at whole turns, ``most_turns`` of them, is followed until it repeats after 1, 2, ...
    ``longest`` turns; the initial state decides between several cycles.  On a belt the state at the release is always
    the same, so one slip and one stick make the cycle.  "none found" and NaN if the motion does not repeat or the run
    stopped early.

    Examples
    --------
    >>> cycle = limit_cycle(Tribometer())
    >>> cycle.kind, cycle.turns, cycle.stable
    ('stick-slip', 1, True)
    """
    guard = guard or EventGuard()
    if isinstance(model.drive, BeltDrive):
        return _on_belt(model, guard)
    spell = model.drive.period
    states, stuck = [np.array([model.x2, model.start()[0]])], model.v2 is None
    scale = max(model.reach, 1e-3 * abs(float(np.abs(model.drive.motion(0.0).x))))
    while len(states) <= most_turns:
        motion, state = _run(model, states[-1], stuck, spell, guard)
        if not motion.complete:
            return _none(f"The run stopped in turn {len(states)}: {motion.statement}")
        states.append(state)
        stuck = bool(motion.state[-1] == 0)
        for turns in range(1, min(longest, len(states) - 1) + 1):
            if _gap(model, state, states[-1 - turns]) <= 1e-13 * scale:
                # a shorter period may close a little more slowly, when the motion settles with changing sign
                turns = next(n for n in range(1, turns + 1) if _gap(model, state, states[-1 - n]) <= 1e-11 * scale)
                return _describe(model, state, stuck, turns, guard)
    return _none(
        f"The state at whole turns did not repeat within {most_turns} turns (periods up to {longest} turns): "
        "raise most_turns, or the motion is not periodic."
    )


def _run(
    model: Tribometer, state: Array, stuck: bool, duration: float, guard: EventGuard, estimate: bool = False
) -> tuple[StickSlipMotion, Array]:
    """Run from another state of the upper platform, and return the state at the end too."""
    start = replace(model, x2=float(state[0]), v2=None if stuck else float(state[1]))
    motion = start.event_driven(duration, times=[duration], guard=guard, estimate=estimate)
    return motion, np.array([motion.x2[-1], motion.v2[-1]])


def _gap(model: Tribometer, a: Array, b: Array) -> float:
    return float(max(abs(a[0] - b[0]), abs(a[1] - b[1]) / model.frequency))


def _none(statement: str) -> LimitCycle:
    return LimitCycle("none found", math.nan, 0, math.nan, math.nan, (), (), False, math.nan, statement)


def _describe(model: Tribometer, state: Array, stuck: bool, turns: int, guard: EventGuard) -> LimitCycle:
    period = turns * model.drive.period
    motion, end = _run(model, state, stuck, period, guard, estimate=True)
    residual = _gap(model, end, state)
    sticking = (motion.path.columns.state == 0.0) if motion.path is not None else np.array([True])
    kind = "sliding" if not sticking.any() else "stuck" if not motion.events else "stick-slip"
    factors = (1.0 + 0j,) if kind == "stuck" else _multipliers(model, state, stuck, period, guard)
    stable = all(abs(factor) < 1.0 for factor in factors)
    statement = f"{kind}: period {period:.12g} s ({turns} turn{'s' if turns > 1 else ''}), {len(motion.events)} events"
    statement += (
        "; any nearby state with the platform stuck is periodic too."
        if kind == "stuck"
        else f", largest multiplier {max(map(abs, factors)):.6g}."
    )
    return LimitCycle(
        kind, period, turns, float(state[0]), float(state[1]), motion.events, factors, stable, residual, statement
    )


def _multipliers(model: Tribometer, state: Array, stuck: bool, period: float, guard: EventGuard) -> tuple[complex, ...]:
    """Eigenvalues of the derivative of the return map, by central differences; zero across a stuck start."""
    step = _NUDGE * model.reach
    columns = []
    for unit in ([1.0, 0.0],) if stuck else ([1.0, 0.0], [0.0, model.frequency]):
        more, less = (
            _run(model, state + change, stuck, period, guard)[1] / [1.0, model.frequency]
            for change in (step * np.array(unit), -step * np.array(unit))
        )
        columns.append((more - less) / (2.0 * step))
    if stuck:
        return (complex(columns[0][0]), 0j)
    return tuple(complex(value) for value in np.linalg.eigvals(np.array(columns).T))


def _on_belt(model: Tribometer, guard: EventGuard) -> LimitCycle:
    """Follow one slip from the release; if it is not captured the platform comes to rest or keeps its swing."""
    v0 = model.drive.speed
    side = math.copysign(1.0, v0)
    if v0 == 0.0:
        return _none("The belt does not move: the platform comes to rest; give the belt a speed.")
    release = (side * model.law.static * model.normal - model.damping * v0) / model.stiffness
    rest = side * model.normal * model.law.coefficient(abs(v0)) / model.stiffness
    spell = math.tau / model.frequency
    ratio = (model.damping + model.normal * model.law.slope(abs(v0))) / model.mass
    start = replace(model, x2=release, v2=v0)
    long = 60.0 * spell + 2.0 * model.reach / abs(v0) * 2.0
    motion = start.event_driven(long, times=[long], guard=guard)
    captures = [event for event in motion.events if event.state == 0 and event.time > 0.0]
    if captures:
        first = captures[0]
        again = [event for event in motion.events if event.time > first.time]
        if not again:
            return _none(f"The run stopped before the second release: {motion.statement}")
        opening = StickSlipEvent(0.0, int(side), release, 0.0)
        text = f"stick-slip: period {again[0].time:.12g} s; a stick piece forgets everything, so the cycle is stable."
        gap = abs(again[0].position - release)
        return LimitCycle("stick-slip", again[0].time, 0, release, v0, (opening, first), (0j, 0j), True, gap, text)
    pair = np.roots([1.0, ratio, model.frequency**2])
    factors = tuple(complex(value) for value in np.exp(pair * spell))
    stable = bool(ratio > 0.0)
    text = f"A slip from the release is not captured within {long:.3g} s; steady sliding at x2 = {rest:.9g} m is "
    text += "stable." if stable else "unstable or neutral."
    return LimitCycle("steady", math.nan, 0, rest, 0.0, (), factors, stable, 0.0, text)
