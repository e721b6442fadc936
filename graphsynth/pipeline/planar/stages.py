"""Stages for any planar mechanism: take candidates, give them dimensions, move them, assess bearings and loads."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphError, GraphsynthError
from graphsynth.pipeline.planar.tables import (
    BearingsTable,
    EmbodyTable,
    LoadsTable,
    MotorTable,
    PlanarTable,
    ToleranceTable,
)
from graphsynth.pipeline.products import Candidate, Columns, Outcome, Quantity, Record, Rejected, exact
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.dynamics.elements import MotorDrive
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.jamming.joints.limits import JointLimits, Misalignment
    from graphsynth.kinematics.dimensional.goals import Goals, Target
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.tolerances.parts import PartTolerance


@dataclass(frozen=True, slots=True)
class FileCandidate:
    """A mechanism with dimensions, read from a file."""

    number: int
    name: str
    mechanism: Mechanism
    key: str
    solution: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Built:
    """A candidate with dimensions, in metres (in cranks without ``crank_mm``), and what its search achieved."""

    name: str
    mechanism: Mechanism
    margins: tuple[Quantity, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """A candidate in motion over its range."""

    name: str
    motion: Motion
    margins: tuple[Quantity, ...]


def take(context: Context) -> Iterator[Candidate | FileCandidate]:
    """Return the candidates of ``[structure]``, or those of the files, in their order.

    All files are read, and all candidates counted, before work begins on the first. A `SceneError` refuses a file that
    is no mechanism, goals that contradict themselves, a question without candidates, a `TooLargeError` too many.
    """
    table: PlanarTable = context.scene.mechanism
    if table.files:
        return iter([_read(context, i, name) for i, name in enumerate(table.files)])
    from graphsynth.kinematics.dimensional.design import check_rule
    from graphsynth.pipeline.steps import generate, mechanisms as listed, solve

    try:
        goals_of(table.embody)
        check_rule(table.embody.pairs)
    except GraphsynthError as error:
        raise (context.scene.place / "mechanism" / "embody").error(f"asks for what cannot be: {error}") from error
    solutions = solve(context)
    for _ in listed(context, solutions):
        pass  # what `generate` refuses is refused before its first candidate
    return generate(context, solutions)


def _read(context: Context, place: int, name: str) -> FileCandidate:
    from graphsynth.pipeline.steps import read_mechanism

    mechanism, data = read_mechanism(context, name, context.scene.place / "mechanism" / "files" / str(place))
    key = f"{mechanism.graph.key} {hashlib.sha256(data).hexdigest()[:12]}"
    return FileCandidate(place + 1, Path(name).stem, mechanism, key, f"file {Path(name).stem}")


def embody(context: Context, design: Candidate | FileCandidate) -> Built:
    """Give a graph dimensions that meet the goals, or reject it; a mechanism of a file keeps its own."""
    table: PlanarTable = context.scene.mechanism
    if isinstance(design, FileCandidate):
        return Built(design.name, design.mechanism)
    from graphsynth.kinematics.dimensional.api import embody as search

    own = table.embody
    goals = replace(goals_of(own), **_symmetry(context, design.graph) if own.symmetric else {})
    seed = context.scene.scene.seed
    try:
        found = search(design.graph, goals, seed, joints=own.pairs, tries=own.tries, effort=own.effort)
    except GraphError as why:  # whatever its dimensions, unless they are special ones
        part = design.graph.rigid_subchain()
        told = f"{part}; " if part else ""
        if design.graph.mobility > 0 and (part is None or part.mobility == 0):
            raise Rejected("no driver fits it", f"{told}{why}") from why
        raise Rejected("over-constrained", f"{told}{why}: it moves with special dimensions, if at all") from why
    if not found.accepted or found.mechanism is None or found.figures is None:
        causes = [why.removeprefix("result: ") for why in found.reasons if why.startswith("result: ")]
        error = found.figures.goal_error if found.figures is not None else math.nan
        best = f"; error {error:.3g}" if math.isfinite(error) else ""
        moves = found.motion is not None and found.motion.completed
        cause = causes[0] if causes else "nothing moves"
        if found.figures is not None and math.isfinite(found.figures.transmission_angle):
            angle, ratio = math.degrees(found.figures.transmission_angle), found.figures.length_ratio
            best = (
                f"; transmission angle {angle:.3g}°, length ratio {ratio:.3g}{best}" if math.isfinite(angle) else best
            )
        raise Rejected(f"moves, but {cause}" if moves else f"no dimensions were found: {cause}", found.statement + best)
    margins = [Quantity("length ratio", found.figures.length_ratio)]
    if math.isfinite(found.figures.goal_error):
        margins.insert(0, Quantity("deviation", found.figures.goal_error))
    mechanism = found.mechanism.scaled((table.crank or 1.0) / _crank(found.mechanism))
    return Built(f"No. {design.number}", mechanism, tuple(margins))


def _symmetry(context: Context, graph: MechanismGraph) -> dict[str, Any]:
    """Return the goals of what ``[structure.generate]`` asks for, if any: a rotation or mirror images."""
    from graphsynth.pipeline.steps import threefold_symmetry

    table = context.scene.structure
    if table is None or table.generate.symmetry is None:
        return {}
    if table.generate.symmetry == 2:
        return {"mirrored": True}
    fixed = table.generate.fixed_moving_links
    every = range(graph.links) if fixed is None else (fixed,)
    return {"symmetry": next(filter(None, (threefold_symmetry(graph, count) for count in every)), ())}


def goals_of(table: EmbodyTable) -> Goals:
    """Return the goals of ``[mechanism.embody]``."""
    from graphsynth.kinematics.dimensional.goals import FunctionGoal, Goals, LineGoal, PathGoal, PosesGoal

    target: Target | None = None
    if (line := table.line) is not None:
        target = LineGoal(line.length, line.span, line.link, line.on_bar, line.tolerance)
    if (path := table.path) is not None:
        target = PathGoal(path.points, path.inputs or None, path.link, path.tolerance)
    if (poses := table.poses) is not None:
        rows = tuple((*p, a) for p, a in zip(poses.points, poses.angles, strict=True))
        target = PosesGoal(rows, poses.inputs, poses.link, poses.tolerance)
    if (wanted := table.function) is not None:
        target = FunctionGoal(wanted.inputs, wanted.outputs, wanted.link, wanted.tolerance)
    return Goals(table.span, table.min_transmission, table.max_length_ratio, target, rates=table.rates)


def _crank(mechanism: Mechanism) -> float:
    """Length of the driven link: from its driven joint to its next pivot or pin, else its pitch radius; 1 for a slider.

    >>> from graphsynth.mechanism.model import Mechanism
    >>> _crank(Mechanism.four_bar(2.0, 0.7, 2.5, 2.5))
    0.7
    """
    driver, arms, radii = mechanism.drivers[0], [], []
    start = mechanism.joint(*driver.pair)
    first = start.at_a if start.a == driver.link else start.at_b
    for joint in mechanism.joints:
        if driver.link not in joint.pair or joint is start:
            continue
        own = joint.a == driver.link
        if joint.kind in ("R", "P") or (joint.kind in ("pin-slot", "cam") and not own):
            arms.append(math.dist(joint.at_a if own else joint.at_b, first))
        if (radius := getattr(joint, "radius_a" if own else "radius_b", None)) is not None:
            radii.append(radius)
    return next((length for length in (*arms, *radii) if length > 0.0), 1.0)


def move(context: Context, built: Built) -> Moved:
    """Move a candidate over ``[mechanism.motion]``, or reject it: the range, or the transmission angle, is not kept."""
    import numpy as np

    from graphsynth.kinematics.dimensional.verify import smallest_transmission
    from graphsynth.kinematics.simulation import simulate

    table: PlanarTable = context.scene.mechanism
    motion = simulate(built.mechanism, np.linspace(0.0, table.motion.span, table.motion.positions + 1))
    angle = smallest_transmission(motion) if motion.completed else 0.0
    if not motion.completed:
        motion = _completed(context, motion)
    if angle < table.motion.min_transmission:
        degrees, least = math.degrees(angle), math.degrees(table.motion.min_transmission)
        raise Rejected("the transmission angle is too small", f"{degrees:.2f}°, at least {least:.10g}° is asked")
    # the size: the diagonal of the box that holds all joints and named points over the range
    places = [motion.point(joint.a, joint.at_a).position for joint in built.mechanism.joints]
    places += [motion.point(name).position for name in built.mechanism.points]
    extent = float(np.hypot(*np.ptp(np.concatenate(places), axis=0)))
    margins = (
        *built.margins,
        Quantity.of_si("transmission angle", angle, "deg"),
        Quantity("distance to singularity", float(motion.singularity_distance.min())),
        Quantity("size", extent / _crank(built.mechanism)),
        exact("links", built.mechanism.graph.links),
    )
    return Moved(built.name, motion, margins)


def _completed(context: Context, motion: Motion) -> Motion:
    """Return a motion that is completed with its pins shifted, where the scene lets them; else it is `Rejected`."""
    table = getattr(context.scene.mechanism, "binding", None)
    if table is not None and table.radial is not None:
        from graphsynth.jamming.binding.parts import as_stiffness, by_joint
        from graphsynth.jamming.binding.shifts import shifted
        from graphsynth.jamming.joints.program import problem

        given = given_bearings(context, motion.mechanism)
        springs = by_joint(motion.mechanism, "stiffness", given["stiffness"], as_stiffness, given["stiffness"])
        limits = problem(motion.mechanism, given["joints"], given["tilt"]).limits
        motion = shifted(motion, limits, springs, 1.0).motion
    if not motion.completed:
        raise Rejected("the range is not completed", motion.reason)
    return motion


def assess(context: Context, moved: Moved, *parts: Part) -> Record:
    """Give the record of a candidate: what its motion, its bearings and its loads say."""
    words = ["moves over the whole range (estimated)", *(part.words for part in parts if part.words)]
    verdicts = [part.good for part in parts if part.words]
    margins = (*(margin for part in parts for margin in part.margins), *moved.margins)
    reason = "; ".join(part.reason for part in parts if part.reason)
    good = False if False in verdicts else None if None in verdicts else True
    return Record(verdict=", ".join(words), good=good, margins=margins, reason=reason)


def write(context: Context, moved: Moved) -> dict[str, Any]:
    """Keep the mechanism as text, for files and pictures."""
    return {"name": moved.name, "mechanism": moved.motion.mechanism.to_json()}


def mechanisms(context: Context, written: tuple[Outcome, ...]) -> Columns:
    """Lay out the mechanisms that were built, each in the JSON of ``Mechanism.from_json``."""
    built = [outcome for outcome in written if outcome.status == "assessed"]
    texts = [outcome.products["written"]["mechanism"] for outcome in built]
    columns = {"number": [own.number for own in built], "key": [own.key for own in built], "mechanism": texts}
    return Columns("mechanisms", columns)


def restored(outcome: Outcome) -> Mechanism:
    """Return the mechanism that `write` kept; a `GraphsynthError` if it keeps none."""
    from graphsynth.mechanism.model import Mechanism

    if outcome.status != "assessed":
        raise GraphsynthError(f"candidate {outcome.number} has no mechanism: {outcome.reason}")
    return Mechanism.from_json(outcome.products["written"]["mechanism"])


_PIECES = 20_000
_SAMPLES = 401


@dataclass(frozen=True, slots=True)
class Part:
    """What the bearings do, or what the loads need."""

    words: str
    good: bool | None
    margins: tuple[Quantity, ...]
    reason: str = ""


def jamming(context: Context, moved: Moved) -> Part:
    """Assess all bearings together when the driven axis is tilted; proved if ``certify`` is true.

    It is `Rejected` if they jam (or, with ``certify``, are not proved free) and ``must_be_free`` is true.
    """
    from graphsynth.jamming.joints import assess_coupled, certify_coupled
    from graphsynth.jamming.verdict import Verdict

    table: BearingsTable = context.scene.mechanism.bearings
    limits, tilt, parts = bearings_of(table, moved.motion.mechanism)
    given: Any = {"condition": table.condition, "tolerances": parts or table.length_tolerance}
    report = assess_coupled(moved.motion, limits, tilt, **given)
    verdict, reason = report.verdict, report.reason
    if table.certify:
        proof = certify_coupled(
            moved.motion, limits, tilt, **given, max_pieces=context.scene.budget.boxes or _PIECES, seconds=math.inf
        )
        verdict, reason = proof.verdict, proof.reason
    good = True if verdict.is_free else False if verdict.is_jammed else None
    if table.must_be_free and not good:
        raise Rejected("the bearings jam" if good is False else "the bearings are not proved free", reason)
    if verdict.is_jammed and context.scene.mechanism.binding is not None:
        good = True  # it may, at the price that the stage `binding` judges
    if verdict.is_free and _passes(moved.motion.mechanism):
        return Part(_LEANS, good, (exact("use of the clearances", 0.0),))
    margins = (
        Quantity("use of the clearances", report.worst_factor),
        Quantity.of_si("tilt allowed", table.alpha * report.smallest_scale, "deg"),
        Quantity.of_si("worst input", report.worst_input, "deg"),
    )
    told = verdict in (Verdict.UNDECIDED, Verdict.CERTIFIED_JAMMED_FOR_SOME)  # why, or which member
    return Part(f"bearings: {verdict.value}", good, margins, reason if told else "")


_LEANS = "bearings: none takes up the tilt, every loop of the driven joint has a gear, slot or cam"


def _passes(mechanism: Mechanism) -> bool:
    """Whether every loop through the driven joint has a joint of mobility 2, which lets a tilt pass."""
    driver = mechanism.drivers[0]
    stiff = [joint.pair for joint in mechanism.joints if joint.mobility == 1 and joint.pair != driver.pair]
    reached, before = {driver.base}, 0
    while len(reached) > before:
        before = len(reached)
        reached |= {link for pair in stiff if reached & set(pair) for link in pair}
    return driver.link not in reached


def bearings_of(table: BearingsTable, mechanism: Mechanism) -> tuple[JointLimits, Misalignment, list[PartTolerance]]:
    """Return the limits of all bearings, the tilt of the driven axis, and the tolerances of the parts."""
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.jamming.joints.limits import Misalignment, bearing_limits

    bearing = Bearing(table.radius_mm, table.height_mm, table.clearance_mm)
    limits = bearing_limits(bearing, table.condition, clearance_tolerance=table.clearance_tolerance_mm)
    driver, alpha, spread = mechanism.drivers[0], table.alpha, table.alpha_tolerance
    tilt = Misalignment(
        driver.base,
        driver.link,
        alpha,
        table.direction,
        alpha_range=(max(alpha - spread, 0.0), alpha + spread) if spread else None,
        direction_range=(0.0, math.tau) if table.any_direction else None,
    )
    return limits, tilt, [part_of(own) for own in table.tolerances]


def given_bearings(context: Context, mechanism: Mechanism) -> dict[str, Any]:
    """Return tilt, joints and stiffness for `binding_torque`, with the middles of the tolerances of the drawing."""
    from graphsynth.jamming.binding.parts import JointStiffness
    from graphsynth.jamming.joints.drawing import drawn

    bearings, table = context.scene.mechanism.bearings, context.scene.mechanism.binding
    limits, tilt, parts = bearings_of(bearings, mechanism)
    if table.radial is not None:
        limits = replace(limits, radial_clearance=1e-3 * bearings.clearance_mm, radial_clearance_range=None)
    found = drawn(mechanism, limits, tilt, parts or 0.0)
    stiffness = JointStiffness(table.stiffness, radial=math.inf if table.radial is None else table.radial)
    return {"tilt": found.tilts, "joints": found.bearings, "stiffness": stiffness}


def part_of(table: ToleranceTable) -> PartTolerance:
    """Return a tolerance of a part, in metres and radians; fits stay in millimetres."""
    from graphsynth.tolerances import parts

    own: Any = table
    if own.kind == "length":
        return parts.LengthTolerance(own.link, own.ends, own.plus, own.minus)
    if own.kind == "hole":
        return parts.HolePosition(own.link, own.to, own.diameter)
    if own.kind == "temperature":
        return parts.ThermalExpansion(own.low_kelvin, own.high_kelvin, dict(enumerate(own.per_kelvin)))
    if own.kind == "fit":
        return parts.FitClearance(own.joint, own.fit, own.height_mm)
    if own.kind == "end float":
        return parts.EndFloat(own.joint, own.least, own.most)
    if own.kind == "axis":
        return parts.AxisAngle(own.link, own.to, own.angle)
    return parts.Parallelism(own.link, own.to, own.diameter, own.over)


def dynamics(context: Context, moved: Moved) -> Part:
    """Find the torque of a constant speed; with a motor, also start from rest."""
    import numpy as np

    from graphsynth.dynamics.inverse import inverse_dynamics

    table: LoadsTable = context.scene.mechanism.loads
    model = model_of(table, moved.motion.mechanism)
    needed = inverse_dynamics(model, moved.motion, table.speed)
    torque = needed.efforts[:, 0]
    u = moved.motion.inputs
    mean = float(np.trapezoid(torque, u) / (u[-1] - u[0]))
    forces = [needed.reactions.between(*joint.pair).force for joint in model.mechanism.joints]
    margins = (
        Quantity("largest torque", float(np.abs(torque).max()), "N m"),
        Quantity("mean torque", mean, "N m"),
        Quantity("largest reaction", float(np.linalg.norm(forces, axis=-1).max()), "N"),
    )
    if table.motor is None:
        return Part("", None, margins)
    words, good, more, reason = _start_up(table, table.motor, moved)
    return Part(words, good, (*margins, *more), reason)


def model_of(table: LoadsTable, mechanism: Mechanism, elements: tuple[Any, ...] = ()) -> DynamicModel:
    """Return the mechanism with its masses and the force on its first named point."""
    from graphsynth.dynamics.elements import Force
    from graphsynth.dynamics.model import DynamicModel

    bodies = {link: _body(table, mechanism, link) for link in range(mechanism.graph.links) if link != mechanism.frame}
    if any(table.force) and mechanism.points:
        point = next(iter(mechanism.points.values()))
        elements = (*elements, Force(point.link, table.force, point.at))
    return DynamicModel(mechanism, bodies, elements, table.gravity)


def _body(table: LoadsTable, mechanism: Mechanism, link: int) -> Body:
    """Uniform bars from the first joint of a link to its others and to its named points."""
    from graphsynth.dynamics.model import Body

    at = [j.at_a if j.a == link else j.at_b for j in mechanism.joints if link in j.pair]
    at += [point.at for point in mechanism.points.values() if point.link == link]
    bars = [Body.bar(table.bar_kg_per_m * math.dist(at[0], end), at[0], end) for end in at[1:] if end != at[0]]
    if not bars:  # a block: as heavy as a bar of a hundredth of a metre
        return Body(0.01 * table.bar_kg_per_m, 1e-6 * table.bar_kg_per_m, at[0])
    return Body.combined(*bars)


def _drive(motor: MotorTable, driver: Driver, sense: float) -> MotorDrive:
    """Return the motor and its train at a driver's joint, turning in the given sense."""
    from graphsynth.dynamics.elements import MotorDrive
    from graphsynth.dynamics.motors import DCMotor, LinearCharacteristic, Train

    train = Train.of_teeth(motor.stages, motor.efficiency) if motor.stages else Train()
    if (own := motor.direct_current) is None:
        stall, slope = sense * (motor.stall or 0.0), (motor.stall or 0.0) / (motor.no_load or 1.0)
        return MotorDrive(driver.base, driver.link, LinearCharacteristic(stall, slope, motor.inertia), train)
    values = own.resistance, own.inductance, own.constant, own.constant, own.gain, sense * own.speed
    return MotorDrive(driver.base, driver.link, DCMotor(*values, rotor_inertia=motor.inertia), train)


def _start_up(table: LoadsTable, motor: MotorTable, moved: Moved) -> tuple[str, bool, tuple[Quantity, ...], str]:
    """Start from rest with the motor; a run that does not reach the end is reported as such."""
    import numpy as np

    from graphsynth.dynamics.integrate import simulate_dynamics

    mechanism = moved.motion.mechanism
    driver = mechanism.drivers[0]
    angle = moved.motion.poses[:2, driver.link, 2] - moved.motion.poses[:2, driver.base, 2]
    sense = math.copysign(1.0, angle[1] - angle[0])  # in which the input grows
    model, times = model_of(table, mechanism, (_drive(motor, driver, sense),)), np.linspace(0.0, motor.end, _SAMPLES)
    run = simulate_dynamics(model, times, pose=moved.motion.poses[0], rtol=1e-7, atol=1e-9)
    if not run.completed:
        return f"start-up stops at {run.reached:.3g} s", False, (), run.message
    _, speed = run.coordinate(driver.base, driver.link)
    late = speed[_SAMPLES // 2 :]
    mean = float(late.mean())
    margins = (
        Quantity("mean speed with the motor", sense * mean, "rad/s"),
        Quantity("ripple of the speed", float(np.ptp(late)) / abs(mean) if mean else math.inf),
    )
    turns = sense * mean > 0.0 and float(np.min(sense * late)) > 0.0
    return ("the motor keeps it turning" if turns else "the motor does not keep it turning"), turns, margins, ""
