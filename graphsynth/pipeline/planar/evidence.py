"""``module = "planar"``: what is measured where any mechanism is given dimensions and moved.

Positions, bearings and loads are measured on a mechanism of the scene: the first one that gets dimensions, moves and
has an Assur group of more than two links, or else the first that moves.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GeometryError, SceneError
from graphsynth.evidence.rows import Effort, Problem

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

#: Candidates that are given dimensions before the first that moved is taken.
_LOOKED_AT = 12
_FIXED = "Not the target of the scene, whose best answer is unknown, but a fixed one, whose best answer is known."


def positions(context: Any, effort: Effort) -> Problem:
    """Measure positions of a mechanism of the scene."""
    from graphsynth.evidence.position import position_problem

    mechanism, name, span = _own(context)
    return position_problem(mechanism, name, inputs=(0.0, span), effort=effort)


def coupled_joints(context: Any, effort: Effort) -> Problem:
    """Measure the bearings of the scene, in all moving joints of a mechanism of the scene."""
    from graphsynth.evidence.jamming import coupled_problem
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.jamming.joints import bearing_limits
    from graphsynth.jamming.joints.limits import Misalignment

    table = getattr(context.scene.mechanism, "bearings", None)
    if table is None:
        raise GeometryError("the scene has no table [mechanism.bearings]")
    mechanism, name, span = _own(context)
    driver = mechanism.drivers[0]
    bearing = Bearing(table.radius_mm, table.height_mm, table.clearance_mm)
    tilt = Misalignment(driver.base, driver.link, table.alpha, table.direction)
    return coupled_problem(
        mechanism,
        bearing_limits(bearing, table.condition),
        tilt,
        name,
        condition=table.condition,
        inputs=(0.0, span),
        effort=effort,
    )


def binding(context: Any, effort: Effort) -> Problem:
    """Measure the torque that binding costs."""
    from graphsynth.evidence.binding import binding_problem

    problem = binding_problem(effort)
    return replace(problem, note=f"Not a mechanism of the scene, but one with a closed form. {problem.note}")


def binding_in_space(context: Any, effort: Effort) -> Problem:
    """Measure the elastic torque of a mechanism of the scene, links rigid."""
    from graphsynth.evidence.binding import small_tilts_problem
    from graphsynth.pipeline.planar.stages import given_bearings

    if getattr(context.scene.mechanism, "binding", None) is None:
        raise GeometryError("the scene has no table [mechanism.binding]")
    mechanism, name, span = _own(context)
    return small_tilts_problem(mechanism, given_bearings(context, mechanism), name, span, effort)


def linkage_dynamics(context: Any, effort: Effort) -> Problem:
    """Measure a mechanism of the scene with its loads, free to move from the speed of the scene."""
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.evidence.dynamics import dynamics_problem
    from graphsynth.pipeline.planar.stages import model_of

    table = getattr(context.scene.mechanism, "loads", None)
    if table is None:
        raise GeometryError("the scene has no table [mechanism.loads]")
    mechanism, name, _ = _own(context)
    model = model_of(table, mechanism)
    pair = mechanism.drivers[0].pair
    start = consistent_start(model, pose=mechanism.pose, keep={pair: 0.0}, keep_rates={pair: table.speed})
    return dynamics_problem(model, start, 0.5 if effort.quick else 1.0, f"{name}, free", effort)


def dimensions(context: Any, effort: Effort) -> Problem:
    """Measure the search for a straight line."""
    from graphsynth.evidence.embodiment import line_problem

    problem = line_problem(effort)
    return replace(problem, note=f"{_FIXED} {problem.note}")


def path_dimensions(context: Any, effort: Effort) -> Problem:
    """Measure the search for a path."""
    from graphsynth.evidence.embodiment import path_problem

    problem = path_problem(effort)
    return replace(problem, note=f"{_FIXED} {problem.note}")


def _own(context: Any) -> tuple[Mechanism, str, float]:
    """Return a mechanism of the scene, its name, and the range of its input, radians.

    Raises `GeometryError` if none of the first candidates gets dimensions, moves, and has joints of the reference.
    """
    import numpy as np

    from graphsynth.evidence.position import precise_points
    from graphsynth.pipeline.planar.stages import embody, move, take
    from graphsynth.structure.assur import decompose

    span = context.scene.mechanism.motion.span
    first, why = None, "there is none"
    for design in islice(take(context), _LOOKED_AT):
        try:
            built = embody(context, design)
            move(context, built)
            precise_points(built.mechanism, np.array([0.0]))
        except SceneError:
            raise
        except Exception as error:  # as in a run: whatever goes wrong with one candidate does not stop the others
            why = " ".join(str(error).split())
            continue
        mechanism = built.mechanism
        groups = decompose(mechanism.graph, [driver.pair for driver in mechanism.drivers]).groups
        largest = max((len(group.links) for group in groups), default=0)
        name = f"{built.name} of the scene ({mechanism.graph.links} links, largest Assur group {largest} links)"
        if largest > 2:
            return mechanism, name, span
        first = first or (mechanism, name, span)
    if first is None:
        raise GeometryError(f"none of the first {_LOOKED_AT} candidates of the scene can be measured: {why}")
    return first
