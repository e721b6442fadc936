"""``module = "lambda_linkage"``: what is measured of a tilted four-bar linkage and its bearing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem


def _box(context: Any) -> Any:
    from graphsynth.systems.lambda_linkage.stages import tolerance_box

    return tolerance_box(context, False)


def _worst(context: Any) -> tuple[Any, str]:
    """Bearing of the scene, and the sine of the largest tilt of a rotation."""
    linkage, bearing = _box(context).nominal()
    return bearing, repr(linkage.largest_tilt[1])


def crossing(context: Any, effort: Effort) -> Problem:
    """Measure circle and ellipse at the worst pose."""
    from graphsynth.evidence.crossing import crossing_problem

    return crossing_problem(*_worst(context), effort)


def areas(context: Any, effort: Effort) -> Problem:
    """Measure the area of the gap at the worst pose."""
    from graphsynth.evidence.crossing import area_problem

    return area_problem(*_worst(context), effort)


def arc_ends(context: Any, effort: Effort) -> Problem:
    """Measure the ends of the intervals of binding, without tolerances."""
    from graphsynth.evidence.jamming import arc_problem

    return arc_problem(_box(context), context.scene.mechanism.bearing.condition, effort)


def coupled_joints(context: Any, effort: Effort) -> Problem:
    """Measure the linkage and the bearing of the scene, the bearing in all three moving joints."""
    from graphsynth.evidence.jamming import lambda_problem

    table = context.scene.mechanism
    linkage, bearing = _box(context).nominal()
    x, y, z = table.tilt.axis
    if z:
        raise GeometryError(f"tilt.axis = {table.tilt.axis} leaves the plane; the shared misalignment needs one in it")
    return lambda_problem(replace(linkage, alpha=0.0), bearing, math.atan2(y, x), table.bearing.condition, effort)


def exact_closure(context: Any, effort: Effort) -> Problem:
    """Measure the tilt of the bearing at B with every loop closed in space."""
    from graphsynth.evidence.space import space_problem

    return space_problem(_box(context).nominal()[0], effort=effort)


def positions(context: Any, effort: Effort) -> Problem:
    """Measure the planar linkage over a rotation, by closed form, engine and proof."""
    from graphsynth.evidence.position import four_bar, position_problem

    linkage, _ = _box(context).nominal()
    mechanism, closed = four_bar(replace(linkage, alpha=0.0))
    return position_problem(mechanism, "the four-bar linkage of the scene", closed, effort=effort)


def dimensions(context: Any, effort: Effort) -> Problem:
    """Search for the source's proportions from the requirement alone."""
    from graphsynth.evidence.embodiment import line_problem

    return line_problem(effort)
