"""All candidates of the scene, not the recognised one alone: dimensions, motion, bearings, one record each.

The recognised platform keeps the dimensions of the scene and goes through the same stages as the others, so that they
can be compared; they are those of scenes of any planar mechanism.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from graphsynth.pipeline.planar import stages as planar
from graphsynth.pipeline.planar.stages import Built, Moved, Part
from graphsynth.pipeline.products import Finding
from graphsynth.systems.platform.stages import platform_of

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.pipeline.planar.stages_pictures import Best
    from graphsynth.pipeline.products import Candidate, Outcome, Picture, Ranking, Record, Table
    from graphsynth.pipeline.stages import Context
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform


def inner(context: Context) -> Context:
    """Return the context of a scene about any planar mechanism, as ``[mechanism.others]`` says it."""
    return replace(context, scene=replace(context.scene, mechanism=context.scene.mechanism.others))


def embody(context: Context, candidate: Candidate) -> Built:
    """Give a candidate dimensions: those of the scene to the platform, searched ones to any other."""
    known = platform_of(context)
    if candidate.graph.key == known.graph().key:
        return Built("the platform of the scene", as_mechanism(known))
    return planar.embody(inner(context), candidate)


def move(context: Context, built: Built) -> Moved:
    """Move a candidate; see `graphsynth.pipeline.planar.stages.move`."""
    return planar.move(inner(context), built)


def jamming(context: Context, moved: Moved) -> Part:
    """Assess all bearings; see `graphsynth.pipeline.planar.stages.jamming`."""
    return planar.jamming(inner(context), moved)


def sketches(
    context: Context, written: tuple[Outcome, ...], best: Best, records: tuple[Record, ...]
) -> tuple[Picture, ...]:
    """Draw the best; see `graphsynth.pipeline.planar.stages_pictures.sketches`."""
    from graphsynth.pipeline.planar.stages_pictures import sketches as draw

    return draw(inner(context), written, best, records)


def comparison(context: Context, ranking: Ranking, records: tuple[Record, ...]) -> tuple[Table, ...]:
    """Compare the platform of the scene with all others, objective by objective, by the places of the ranking."""
    from graphsynth.pipeline.display import table
    from graphsynth.pipeline.units import behind

    key = platform_of(context).graph().key
    known = next((record for record in records if record.key == key and record.number in ranking.numbers), None)
    if known is None:
        return ()
    at = ranking.numbers.index(known.number)
    rows, told = [], []
    for k, objective in enumerate(ranking.objectives):
        own = next(margin for margin in known.margins if margin.name == objective.quantity)
        value, better, unit = ranking.values[at][k], ranking.places[at][k], behind(own.unit)
        best = next(row[k] for row, places in zip(ranking.values, ranking.places) if not places[k])
        rows.append((own.name, f"{value:.4g}{unit}", better, f"{best:.4g}{unit}"))
        told.append(f"{own.name} {value:.4g}{unit}, {better} of {ranking.ranked - 1} others are better")
    said = Finding(f"The platform of the scene (no. {known.number}): {'; '.join(told)}.")
    columns = ("objective", "platform of the scene", "others that are better", "best")
    return (table("The platform beside the others", columns, rows, "", said),)


def as_mechanism(platform: SingleMotorPlatform) -> Mechanism:
    """Return the platform as a mechanism of joints, wheels at the angle 0; its input is the angle of the wheels."""
    import numpy as np

    from graphsynth.kinematics.dimensional.design import Design, joint_kinds
    from graphsynth.mechanism.laws import Driver, Linear

    graph, gears = platform.graph(), platform.gears
    start = platform.full_turn(9)
    turn = np.exp(1j * np.array(platform.frame_angle))
    O, D = np.array(platform.axis) * turn, np.array(platform.platform.D)
    B = O + np.array(platform.crank) * np.exp(1j * np.array(platform.phase))
    theta = start.theta[0]
    C = D + np.array(platform.rocker) * np.exp(1j * (theta - np.array(platform.delta)))
    A, F = platform.platform.elbows(theta), platform.platform.vertices(start.pose[0])
    at = {(0, 1): 0j}
    for k in range(3):
        wheel, coupler, rocker, link = 2 + k, 5 + k, 8 + k, 11 + k
        at |= {(0, wheel): O[k], (wheel, coupler): B[k], (coupler, rocker): C[k], (0, rocker): D[k]}
        at |= {(rocker, link): A[k], (link, 14): F[k], (1, wheel): 0j}
    places = np.array([at[joint.a, joint.b] for joint in graph.joints])
    kinds = joint_kinds(graph, {(1, wheel): f"gear {gears.z1}:{gears.z2}" for wheel in (2, 3, 4)})
    made = Design(graph, ((0, 1),), kinds).mechanism(np.stack([places.real, places.imag], axis=1), np.zeros(0))
    law = Linear(1.0 / gears.ratio)
    return replace(made, drivers=(Driver(0, 1, law),))
