"""Stages for what binding costs: torque and loads where the bearings of a candidate bind, curves of the best."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.pipeline.planar.stages import Moved, Part
from graphsynth.pipeline.planar.tables import BearingsTable, BindingTable, PlanarTable
from graphsynth.pipeline.products import Outcome, Picture, Quantity
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.jamming.binding.report import BindingReport
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.pipeline.planar.stages_pictures import Best


def binding(context: Context, moved: Moved) -> Part:
    """Find the drive torque, the energy and the loads of a candidate; it is no good if that blocks the motor."""
    report = _report(context, moved.motion)
    margins = (
        Quantity("binding torque", report.peak_torque, "N m"),
        Quantity("binding loss", report.loss, "J"),
        Quantity("largest tilting moment", max((row.moment for row in report.wear), default=0.0), "N m"),
    )
    good, reason = report.answer != "blocks", report.statement if report.answer == "blocks" else ""
    return Part(f"drive: {report.answer} (estimated)", good, margins, reason)


def _report(context: Context, motion: Motion) -> BindingReport:
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.jamming.binding import ContactFriction, LinkSection, binding_torque
    from graphsynth.jamming.joints import Misalignment, bearing_limits

    given: PlanarTable = context.scene.mechanism
    bearings, table = given.bearings, given.binding
    assert isinstance(bearings, BearingsTable)
    assert isinstance(table, BindingTable)
    links = None
    if table.young is not None and table.width is not None and table.height is not None:
        links = LinkSection.rectangular(table.young, table.width, table.height)
    driver = motion.mechanism.drivers[0]
    return binding_torque(
        motion,
        tilt=Misalignment(driver.base, driver.link, bearings.alpha, bearings.direction),
        joints=bearing_limits(
            Bearing(bearings.radius_mm, bearings.height_mm, bearings.clearance_mm), bearings.condition
        ),
        stiffness=table.stiffness,
        links=links,
        friction=ContactFriction(table.friction, 1e-3 * bearings.radius_mm, 1e-3 * bearings.height_mm),
        motor_torque=table.motor,
    )


def curves(context: Context, written: tuple[Outcome, ...], best: Best) -> tuple[Picture, ...]:
    """Plot the torque that binding costs the best candidates, and name the joint that wears first."""
    from graphsynth.pipeline.planar.stages_pictures import best_motions

    pictures = []
    for title, _, motion in best_motions(context, written, best):
        report = _report(context, motion)
        worn = [row for row in report.wear if row.wear > 0.0]
        first = f" Joint {worn[0].joint[0]}-{worn[0].joint[1]} wears first." if worn else ""
        pictures.append(Picture(title, report.plot().svg(), report.statement + first))
    return tuple(pictures)
