"""What is said about the tribometer of a scene: the verdict, events, the cycle, energies, methods."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from graphsynth.pipeline.display import quantity_table
from graphsynth.pipeline.products import Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.systems.tribometer.stages import METHOD_COLUMNS, method_rows, tribometer_of

if TYPE_CHECKING:
    from graphsynth.evidence.rows import Problem
    from graphsynth.systems.tribometer.cycles import BeltCycle, LimitCycle
    from graphsynth.systems.tribometer.model import Tribometer
    from graphsynth.systems.tribometer.stick_slip import StickSlipMotion

#: Above this part of the energy exchanged the balance gets a warning.
BALANCE = 1e-9
_MOST_EVENTS = 400


def judge(
    context: Context, motion: StickSlipMotion, cycle: LimitCycle, study: Problem | None
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict and the tables."""
    model = tribometer_of(context)
    margins = _margins(motion, cycle)
    tables = [
        quantity_table("What the run gives", margins, motion.statement),
        _events_table(motion),
        _cycle_table(model, cycle),
        _energy_table(motion),
    ]
    if study is not None:
        tables.append(_methods_table(study))
    return (_verdict(motion, cycle, margins),), tuple(tables)


def _verdict(motion: StickSlipMotion, cycle: LimitCycle, margins: tuple[Quantity, ...]) -> Record:
    name = "tribometer"
    if not motion.complete:
        return Record(recognised_as=name, verdict=motion.statement, good=False, margins=margins)
    words = f"{len(motion.events)} changes between stick and slip in {motion.t[-1]:g} s"
    if cycle.kind == "none found":
        words += "; no limit cycle found"
    elif cycle.kind == "steady":
        words += (
            f"; settles to steady sliding at {1e3 * cycle.x2:.6g} mm" if cycle.stable else "; steady sliding unstable"
        )
    else:
        words += f"; settles to a {cycle.kind} cycle of {cycle.period:.6g} s with {len(cycle.events)} of them"
    good = motion.energy_residual <= BALANCE
    if not good:
        words += f"; WARNING: energies balance to {motion.energy_residual:.1e} only"
    return Record(recognised_as=name, verdict=f"{words} ({motion.guarantee})", good=good, margins=margins)


def _margins(motion: StickSlipMotion, cycle: LimitCycle) -> tuple[Quantity, ...]:
    import numpy as np

    worst = max((event.error for event in motion.events), default=0.0)
    found = [exact("changes between stick and slip", len(motion.events))]
    known = np.flatnonzero(np.isfinite(motion.x2))
    if known.size:
        last = int(known[-1])
        found += [
            Quantity(
                f"upper platform at {motion.t[last]:g} s", 1e3 * float(motion.x2[last]), "mm", "estimated",
                1e3 * motion.error if math.isfinite(motion.error) else None,
            ),
            Quantity("share of the time that it sticks", _sticking(motion), "", "estimated"),
        ]  # fmt: skip
    if math.isfinite(motion.shortest_dwell):
        found.append(Quantity("shortest dwell", motion.shortest_dwell, "s", "estimated", 2.0 * worst))
    if math.isfinite(cycle.period):
        found.append(Quantity("period of the cycle", cycle.period, "s", "estimated", _period_error(cycle)))
        found.append(Quantity("largest multiplier of the cycle", max(map(abs, cycle.multipliers)), "", "estimated"))
    found.append(Quantity("largest estimated error of an event time", worst, "s", "estimated"))
    found.append(Quantity("energy that does not balance, relative", motion.energy_residual, "", "estimated"))
    return tuple(found)


def _period_error(cycle: LimitCycle) -> float:
    """With a crank the period is that of the drive; on a belt it carries the errors of its events."""
    if cycle.turns:
        return 2.0 * math.ulp(cycle.period)
    return max((event.error for event in cycle.events if math.isfinite(event.error)), default=0.0) + 1e-14


def _sticking(motion: StickSlipMotion) -> float:
    """Share of the known time spent in stick, from the nodes of the run."""
    if motion.path is None:
        return math.nan
    nodes = motion.path.nodes
    spans = nodes[1:, 0] - nodes[:-1, 0]
    return float(spans[nodes[:-1, 3] == 0.0].sum() / max(float(nodes[-1, 0]), 1e-300))


def _events_table(motion: StickSlipMotion) -> Table:
    rows = tuple(
        (
            str(k), f"{event.time:.15f}", f"{event.error:.0e}" if math.isfinite(event.error) else "", event.name,
            f"{1e3 * event.position:.12f}",
        )
        for k, event in enumerate(motion.events[:_MOST_EVENTS], 1)
    )  # fmt: skip
    had = (
        "closed-form pieces joined at roots found to rounding"
        if motion.guarantee == "exact"
        else "slip integrated with order 8, events are roots in the length of a step"
    )
    note = f"{had[:1].upper()}{had[1:]}; errors estimated by a second run with other tolerance and data."
    if len(motion.events) > _MOST_EVENTS:
        note += f" The first {_MOST_EVENTS} of {len(motion.events)}."
    columns = ("no.", "time [s]", "± [s]", "new state", "position of the upper platform [mm]")
    return Table(f"Events: {len(motion.events)}", columns, rows, note)


def _cycle_table(model: Tribometer, cycle: LimitCycle) -> Table:
    rows = [("kind", cycle.kind), ("statement", cycle.statement)]
    if cycle.kind != "none found":
        rows += [
            ("period", f"{cycle.period:.12g} s" if math.isfinite(cycle.period) else "none"),
            ("turns of the crank", str(cycle.turns) if cycle.turns else "no crank"),
            ("upper platform at its start", f"{1e3 * cycle.x2:.12g} mm, {round(1e3 * cycle.v2, 10) + 0.0:.10g} mm/s"),
            ("change over one period", f"{cycle.residual:.1e} m"),
            ("multipliers (small changes shrink by)", ", ".join(_complex(value) for value in cycle.multipliers)),
            ("stable", "yes" if cycle.stable else "no"),
        ]
        rows += [
            (f"{event.name} in the cycle", f"{event.time:.12f} s, {1e3 * event.position:.9f} mm")
            for event in cycle.events
        ]
    known = _belt_cycle(model)
    if known is not None:
        rows += [
            ("exact: stick", f"{known.stick:.15g} s"),
            ("exact: slip", f"{known.slip:.15g} s"),
            ("exact: period", f"{known.period:.15g} s"),
        ]
    return Table(
        "Limit cycle", ("", ""), tuple(rows), "Return map of the automaton, multipliers by differences (estimated)."
    )


def _complex(value: complex) -> str:
    return f"{value.real:.6g}" if value.imag == 0.0 else f"{value.real:.6g} {value.imag:+.6g}i"


def _belt_cycle(model: Tribometer) -> BeltCycle | None:
    from graphsynth.core.errors import SpecError
    from graphsynth.systems.tribometer.cycles import belt_cycle

    try:
        return belt_cycle(model)
    except SpecError:  # no closed form for this drive or law
        return None


def _energy_table(motion: StickSlipMotion) -> Table:
    warned = "" if motion.energy_residual <= BALANCE else " (WARNING)"
    model = motion.model
    stored = math.nan
    if motion.path is not None:
        nodes = motion.path.nodes
        energy = 0.5 * model.mass * nodes[:, 2] ** 2 + 0.5 * model.stiffness * nodes[:, 1] ** 2
        stored = float(energy[-1] - energy[0])
    rows = (
        ("work of the drive", f"{motion.drive_work:.12g} J"),
        ("heat of friction", f"{motion.friction_loss:.12g} J"),
        ("loss in the damper", f"{motion.damper_loss:.12g} J"),
        ("gained by platform and spring", f"{stored:.12g} J"),
        ("largest gap of the balance, relative", f"{motion.energy_residual:.1e}{warned}"),
    )
    note = "Each is integrated by itself along the run; none is the remainder of the others."
    return Table("Energy balance", ("", ""), rows, note)


def _methods_table(study: Problem) -> Table:
    note = (
        f"Error of the position at 0.05, 0.10, ... s, against: {study.rows[0].reference} (rows 'event-driven': the "
        "same method with a larger tolerance). Solvers of scipy run the smoothed law."
    )
    return Table("The other methods", METHOD_COLUMNS, method_rows(study), note)
