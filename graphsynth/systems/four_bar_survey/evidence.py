"""``module = "four_bar_survey"``: what is measured of a survey of four-bar linkages."""

from __future__ import annotations

from typing import Any

from graphsynth.evidence.rows import Effort, Problem


def many_sets(context: Any, effort: Effort) -> Problem:
    """Measure the positions of many sets at once."""
    from graphsynth.evidence.position import batch_problem

    lengths = context.scene.mechanism.lengths
    largest = max(lengths.frame.last, lengths.coupler.last, lengths.rocker.last)
    return batch_problem(lengths.crank, max(largest, 4.0 * lengths.crank), effort)


def _box(context: Any) -> Any:
    """Bearing and tilt of the scene on the source's proportions, whose coupler is 2.5 cranks."""
    from fractions import Fraction

    from graphsynth.jamming.bearing.parameters import ToleranceBox

    table = context.scene.mechanism
    crank = Fraction(repr(table.lengths.crank))
    bearing = table.bearing
    return ToleranceBox(
        2 * crank,
        crank,
        crank * 5 / 2,
        crank * 5 / 2,
        repr(table.tilt.alpha),
        table.tilt.axis,
        Rb=repr(bearing.radius_mm),
        Hb=repr(bearing.height_mm),
        clearance=repr(bearing.clearance_mm),
    )


def arc_ends(context: Any, effort: Effort) -> Problem:
    """Measure the ends of the intervals of binding."""
    from graphsynth.evidence.jamming import arc_problem

    return arc_problem(_box(context), context.scene.mechanism.bearing.condition, effort)


def crossing(context: Any, effort: Effort) -> Problem:
    """Measure circle and ellipse at the worst pose."""
    from graphsynth.evidence.crossing import crossing_problem

    linkage, bearing = _box(context).nominal()
    return crossing_problem(bearing, repr(linkage.largest_tilt[1]), effort)


def dimensions(context: Any, effort: Effort) -> Problem:
    """Search for dimensions instead of looking at all."""
    from graphsynth.evidence.embodiment import path_problem

    return path_problem(effort)
