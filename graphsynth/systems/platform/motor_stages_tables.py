"""What is said about the motor-driven platform: the verdict on the claim, and the tables."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from graphsynth.pipeline.motor_tables import balance_rows, limit_table, quantity_table
from graphsynth.pipeline.products import Finding, Quantity, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.platform.motor_stages import Claim, LabelledRun, WithoutInertia, table_of

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy

__all__ = ["judge", "run_tables"]


def judge(
    context: Context,
    runs: tuple[LabelledRun, ...],
    bare: WithoutInertia,
    found: Claim,
    study: ReductionStudy | None,
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record for each resistance and the tables."""
    records = tuple(_record(k, item) for k, item in enumerate(runs, 1))
    tables = [*run_tables(runs), *_claim_tables(context, found), *_bare_tables(context, bare)]
    if study is not None:
        tables.append(limit_table(study))
    return records, tuple(tables)


def _record(number: int, item: LabelledRun) -> Record:
    if not item.run.complete:
        return Record(
            number, status="failed", recognised_as="platform_drive", reason=f"{item.label}: {item.run.reason}"
        )
    margins = _margins(item)
    return Record(number, recognised_as="platform_drive", verdict=_words(item, margins), margins=margins)


def _words(item: LabelledRun, margins: tuple[Quantity, ...]) -> str:
    speed, torque = margins[2].value, margins[3].value
    return (
        f"{item.label}: in steady motion the speed varies by {speed:.4g} rad/s, the torque by {torque:.4g} N m "
        "(estimated)"
    )


def _margins(item: LabelledRun) -> tuple[Quantity, ...]:
    import numpy as np

    from graphsynth.core.errors import SpecError
    from graphsynth.systems.platform.resistance import steady_ripple

    run, motor = item.run, item.drive.motor
    half = run.time.size // 2
    span = float(run.time[-1] - run.time[half])
    mean = float(run.angle[-1] - run.angle[half]) / span
    try:
        (speed, current), (other, second) = (steady_ripple(item.drive, 40, rtol=rtol) for rtol in (1e-9, 1e-7))
    except SpecError:
        speed = current = other = second = math.nan
    constant = float(getattr(motor, "torque_constant", 1.0))
    torque_error = constant * abs(current - second)
    w_error, i_error = float(run.error[1]), float(run.error[-1]) * constant
    return (
        Quantity("mean speed, second half", mean, "rad/s", "estimated", 2.0 * float(run.error[0]) / span),
        Quantity("largest torque at the samples", float(run.motor_torque.max()), "N m", "estimated", i_error),
        Quantity("steady speed ripple, peak to peak", speed, "rad/s", "estimated", abs(speed - other)),
        Quantity("steady torque ripple, peak to peak", constant * current, "N m", "estimated", torque_error),
        Quantity("crank angle at the end", float(run.angle[-1]), "rad", "estimated", float(run.error[0])),
        Quantity("speed at the end", float(run.speed[-1]), "rad/s", "estimated", w_error),
        Quantity("torque at the end", float(run.motor_torque[-1]), "N m", "estimated", i_error),
        Quantity("turns made", float(np.floor(run.angle[-1] / math.tau)), "", "exact", 0.0),
    )  # fmt: skip


def run_tables(runs: tuple[LabelledRun, ...], *, told: bool = False) -> tuple[Table, ...]:
    """Quantities of every run that reached its end, and how each was had; `told`: the first screen tells of them."""
    tables = []
    for item in runs:
        if item.run.complete:
            margins = _margins(item)
            said = (Finding(f"Motor with {_words(item, margins)}."),) if told else ()
            tables.append(replace(quantity_table(f"Motion with {item.label}", margins), findings=said))
        tables.append(Table(f"How the run with {item.label} was had", ("", ""), balance_rows(item.run)))
    return tuple(tables)


def _claim_tables(context: Context, found: Claim) -> tuple[Table, ...]:
    rows = []
    for label, effect in found.effects.items():
        for k, r in enumerate(effect.resistance):
            rows.append((
                label if k == 0 else "", f"{effect.frequency_ratio:.3f}" if k == 0 else "", f"{r:g}",
                f"{effect.damping[k]:.3f}", f"{effect.speed[k]:.4g}", f"{effect.simulated_speed[k]:.4g}",
                f"{effect.current[k]:.4g}", f"{effect.simulated_current[k]:.4g}",
            ))  # fmt: skip
    columns = (
        "case", "Om/w_n", "r [ohm]", "zeta", "speed, linear [rad/s]", "simulated", "current, linear [A]", "simulated",
    )  # fmt: skip
    note = (
        "Ripples peak to peak in steady motion. Linear, exact for small ripples: the torque ripple always falls with "
        "r, the speed ripple if and only if Om/w_n > 0.7071. Simulated: estimated, the full model over the second half "
        f"of {table_of(context).claim.revolutions} mean revolutions."
    )
    said = []
    for label, effect in found.effects.items():
        first, last = effect.simulated_speed[0], effect.simulated_speed[-1]
        said.append((
            label, f"{effect.frequency_ratio:.3f}", "falls" if effect.speed_falls else "rises",
            _trend(effect.simulated_speed), f"{last / first:.3g}",
            _trend(effect.simulated_current), f"{effect.simulated_current[-1] / effect.simulated_current[0]:.3g}",
        ))  # fmt: skip
    heads = (
        "case", "Om/w_n", "speed ripple, linear", "speed ripple, simulated", "last/first", "current ripple, simulated",
        "last/first",
    )  # fmt: skip
    truth = (
        "The claim is that a larger armature resistance calms both. On the map the linear condition tells the sign of "
        f"the simulated trend of the speed on {100 * found.map.agreement:.0f} % of the cells; the rest have ripples "
        "that are not small."
    )
    return (
        Table("Does a larger resistance calm the machine?", heads, tuple(said), truth, (_claim_told(found),)),
        Table("Ripples over the resistance", columns, tuple(rows), note),
    )


def _claim_told(found: Claim) -> Finding:
    """Answer the claim: in how many cases each ripple falls all the way."""
    count = len(found.effects)
    speed = sum(_trend(effect.simulated_speed) == "falls" for effect in found.effects.values())
    torque = sum(_trend(effect.simulated_current) == "falls" for effect in found.effects.values())
    calms = "calms" if speed == torque == count else "does not always calm"
    return Finding(
        f"A larger armature resistance {calms} the machine: of {count} cases the ripple of the speed falls throughout "
        f"in {speed}, that of the torque in {torque} (estimated)."
    )


def _bare_told(bare: WithoutInertia, root: float) -> tuple[Finding, ...]:
    """Say what the model without rotor inertia does at its first dead centre."""
    first = next((event for event in bare.source.events if event.kind == "dead centre"), None)
    if first is None:
        return ()
    return (
        Finding(
            f"Without rotor inertia the crank speed is unbounded at each dead centre, first after {first.time:.4g} s; "
            f"the platform passes it at {abs(first.motion) / root:.4g} m/s (estimated)."
        ),
    )


def _trend(values: object) -> str:
    """Words for the way a ripple goes over increasing resistance."""
    import numpy as np

    steps = np.diff(np.asarray(values, dtype=np.float64))
    if not np.isfinite(steps).all():
        return "not known: a run failed"
    if (steps < 0).all():
        return "falls"
    if (steps > 0).all():
        return "rises"
    return "falls, then rises" if steps[0] < 0 else "rises, then falls"


def _bare_tables(context: Context, bare: WithoutInertia) -> tuple[Table, ...]:
    moved = table_of(context).platform
    root = math.sqrt(moved.mass)
    reach = moved.amplitude * root
    rows = tuple(
        (
            e.kind, f"{e.angle / math.pi:.12g}", f"{e.time:.14g}", f"{e.fictitious_time * reach:.14g}",
            f"{e.motion / root:.13g}", ", ".join(f"{i:.13g}" for i in e.currents),
        )
        for e in bare.source.events[:20]
    )  # fmt: skip
    columns = ("event", "angle/pi", "time t [s]", "fictitious time s [s]", "speed of the platform [m/s]", "current [A]")
    more = len(bare.source.events) - len(rows)
    note = "Regularised by dt = |cos q| ds: the crank speed is unbounded there, the speed of the platform is not."
    note += f" {more} more events are left out." if more > 0 else ""
    limit = tuple(
        (
            f"{inertia:.0e}", f"{run.angle[-1]:.12g}" if run.complete else run.reason,
            f"{abs(run.angle[-1] - bare.source.angle[-1]):.2e}", f"{float(abs(run.speed).max()):.5g}",
            f"{run.energy_error:.1e}",
        )
        for inertia, run in zip(bare.inertias, bare.runs)
    )  # fmt: skip
    last = (
        "none", f"{bare.source.angle[-1]:.12g}" if bare.source.complete else bare.source.reason, "",
        "unbounded", f"{bare.source.energy_error:.1e}",
    )  # fmt: skip
    heads = (
        "J_0 [kg m²]",
        f"angle at {bare.source.time[-1]:g} s [rad]",
        "difference",
        "largest speed [rad/s]",
        "energy",
    )
    return (
        Table("Without inertia: dead centres and reversals", columns, rows, note, _bare_told(bare, root)),
        Table(
            "The model without inertia is a limit",
            heads,
            (*limit, last),
            "Estimated; the largest speed at the samples.",
        ),
        Table("How the run without inertia was had", ("", ""), balance_rows(bare.source)),
    )
