"""Stages for what binding costs: torque and loads where the bearings of a candidate bind, curves of the best."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.display import table
from graphsynth.pipeline.planar.stages import Moved, Part, given_bearings
from graphsynth.pipeline.products import Finding, Outcome, Picture, Quantity, Table
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.jamming.binding.report import BindingReport
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.pipeline.planar.stages_pictures import Best

_COLUMNS = (
    "joint",
    "moment [N m] | .4g",
    "axial force [N] | .4g",
    "force at an end [N] | .4g",
    "sliding [m] | .4g",
    "wear [N/m] | .4g",
    "lost [J] | .4g",
    "force in the plane [N] | .4g",
)
_NOTE = (
    "Largest values over the range, those that wear most first; estimated, with small tilts. Friction takes a moment "
    "as two opposite forces at the ends of the bearing and the axial force on its face; a load in the plane may share "
    "their contacts. Wear is pressure times sliding distance, lost is the work of friction."
)


def binding(context: Context, moved: Moved) -> tuple[Part, dict[str, Any]]:
    """Find the drive torque, the energy and the loads of a candidate; it is no good if that blocks the motor."""
    report = _report(context, moved.motion)
    margins = (
        Quantity("binding torque", report.peak_torque, "N m"),
        Quantity("binding loss", report.loss, "J"),
        Quantity("largest tilting moment", max((row.moment for row in report.wear), default=0.0), "N m"),
    )
    good, reason = report.answer != "blocks", report.statement if report.answer == "blocks" else ""
    values = {
        "name": moved.name,
        "told": report.statement,
        "notes": "".join(f" {note[:1].upper()}{note[1:]}." for note in report.notes),
        "good": good,
        "share": report.share,
        "rows": [(f"{row.joint[0]}-{row.joint[1]}", *row[1:]) for row in report.wear],
    }
    return Part(f"drive: {report.answer} (estimated)", good, margins, reason), values


def _report(context: Context, motion: Motion) -> BindingReport:
    from graphsynth.jamming.binding import ContactFriction, LinkSection, binding_torque
    from graphsynth.kinematics.simulation import simulate

    bearings, table = context.scene.mechanism.bearings, context.scene.mechanism.binding
    if table.radial is not None:  # as it closes by itself
        motion = simulate(motion.mechanism, motion.inputs)
    return binding_torque(
        motion,
        **given_bearings(context, motion.mechanism),
        links=None if table.young is None else LinkSection.rectangular(table.young, table.width, table.height),
        friction=ContactFriction(table.friction, 1e-3 * bearings.radius_mm, 1e-3 * bearings.height_mm),
        motor_torque=table.motor,
    )


def tables(context: Context, loaded: tuple[Outcome, ...], best: Best) -> tuple[Table, ...]:
    """Lay out loads and wear of the joints of the best candidates; the first screen says what they come to."""
    from graphsynth.pipeline.planar.stages_pictures import best_numbers

    values = _values(loaded)
    found = []
    for _, number in best_numbers(context, best):
        own = values[number]
        whose, name = (f"{own['name']}: ", f", {own['name']}") if len(values) > 1 else ("", "")
        told = Finding(whose + _told(own), own["good"])
        found.append(table(f"What binding costs{name}", _COLUMNS, own["rows"], _NOTE + own["notes"], told))
    return tuple(found)


def _values(loaded: tuple[Outcome, ...]) -> dict[int, Mapping[str, Any]]:
    return {outcome.number: outcome.products["loaded"] for outcome in loaded if outcome.status == "assessed"}


def _told(own: Mapping[str, Any]) -> str:
    """Return the answer, where it binds, and which joints come first."""
    if not own["share"]:
        return str(own["told"])
    most, worn = max(own["rows"], key=lambda row: row[1]), own["rows"][0]
    over = f"It binds over {100.0 * own['share']:.3g} % of the range"
    first = f"joint {most[0]} bears the largest moment, {most[1]:.4g} N m"
    wears = "" if not worn[5] > 0.0 else ", and wears first" if worn == most else f"; joint {worn[0]} wears first"
    return f"{own['told']} {over}; {first}{wears}."


def curves(
    context: Context, loaded: tuple[Outcome, ...], written: tuple[Outcome, ...], best: Best
) -> tuple[Picture, ...]:
    """Plot the torque that binding costs the best candidates."""
    from graphsynth.pipeline.planar.stages_pictures import best_motions

    values = _values(loaded)
    return tuple(
        Picture(title, _report(context, motion).plot().svg(), _told(values[number]))
        for title, number, motion in best_motions(context, written, best)
    )
