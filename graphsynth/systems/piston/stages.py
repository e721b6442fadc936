"""The floating piston of a scene: loops and their spaces, a turn with and without the second group; what is shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Candidate, Picture, Quantity, Recognised, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import recognise_by_key
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.piston.loads import CompressorCycle, ConstantForce, PistonFriction, PistonMasses
from graphsynth.systems.piston.machine import PistonMachine
from graphsynth.systems.piston.model import CrankSlider, FloatingGroup, FloatingPiston, ScotchYoke
from graphsynth.systems.piston.spaces import Assignment, LoopSpaces, loop_spaces, rotary_assignments
from graphsynth.systems.piston.turn import PistonComparison, PistonTurn, compare_pistons

Loops = tuple[tuple[tuple[str, LoopSpaces], ...], tuple[Assignment, ...]]
_KINDS = {"crank_slider": "slider-crank", "scotch_yoke": "Scotch yoke"}
_POSES = (1.0, 4.0)


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """One turn of a machine with and without the second group, and how far it can be trusted.

    ``difference`` is that of the forces with a crowned and with a sliding slot, relative to the largest, ``power`` the
    error of the power balance over the largest power in play; ``redundant`` tells whether the couples are found
    undetermined with a sliding slot; ``square`` has the same for a slot that is out of square by an angle, radians.
    """

    kind: str
    machine: PistonMachine
    found: PistonComparison
    difference: float
    power: float
    redundant: bool
    square: tuple[tuple[float, PistonComparison], ...]

    @property
    def name(self) -> str:
        """Of the drive, for readers."""
        return _KINDS[self.kind]


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to the graph with the crowned slot, whose count in one space is right."""
    known = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (3, 4, 2)], frame=0)
    return recognise_by_key(candidates, known, "floating_piston")


def machines_of(context: Context) -> tuple[tuple[str, PistonMachine], ...]:
    """Build the machines of the scene; a number that makes no sense is an error of the scene."""
    own: Any = context.scene.mechanism
    try:
        return tuple((kind, _machine(own, kind)) for kind in own.kinds)
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be built: {error}") from error


def _machine(own: Any, kind: str) -> PistonMachine:
    def values(part: Any, **changed: float) -> dict[str, Any]:
        return {item.name: getattr(part, item.name) for item in fields(part)} | changed

    drive, slider = own.drive, kind == "crank_slider"
    first = (
        CrankSlider(drive.crank, drive.rod, drive.offset)
        if slider
        else ScotchYoke(drive.crank, drive.offset, drive.yoke_angle)
    )
    return PistonMachine(
        FloatingPiston(first, FloatingGroup(**values(own.group))),
        PistonMasses(**values(own.masses, **({} if slider else {"rod_inertia": 0.0, "rod_centre": 0.0}))),
        ConstantForce(own.force) if own.gas is None else CompressorCycle(**values(own.gas)),
        PistonFriction(**values(own.friction, **({"yoke": 0.0} if slider else {}))),
        own.speed,
        gravity=own.gravity,
    )


def loops(context: Context) -> Loops:
    """Find the spaces of the loops of every machine, and all kinds of joints with such loops."""
    found = tuple((kind, loop_spaces(machine.mechanism.mechanism())) for kind, machine in machines_of(context))
    return found, tuple(rotary_assignments(context.scene.scene.seed))


def turn(context: Context) -> tuple[Turn, ...]:
    """Turn every machine once, with and without the second group; find the forces of a sliding slot too."""
    try:
        return tuple(_turn(context, kind, machine) for kind, machine in machines_of(context))
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be turned: {error}") from error


def _turn(context: Context, kind: str, machine: PistonMachine) -> Turn:
    own: Any = context.scene.mechanism
    angles = (np.arange(own.positions) + 0.5) * math.tau / own.positions
    crowned, sliding = (machine.inverse_dynamics(angles, slot).reactions for slot in ("crowned", "sliding"))
    forces = [np.array([joint.force for joint in reactions.joints[:-1]]) for reactions in (crowned, sliding)]
    couples = [sliding.between(*pair).determined[:, 2] for pair in ((0, 3), (3, 4), (0, 4))]
    group = machine.mechanism.group
    assert group is not None
    square = []
    for error in own.square_errors:
        turned = replace(group, slot_angle=group.cylinder_angle + 0.5 * math.pi + error)
        other = replace(machine, mechanism=replace(machine.mechanism, group=turned))
        square.append((error, compare_pistons(other, own.piston_length)))
    return Turn(
        kind,
        machine,
        compare_pistons(machine, own.piston_length),
        float(np.abs(forces[0] - forces[1]).max() / np.abs(forces).max()),
        max(one.loads(angles).power_error for one in (machine, machine.without_group())),
        not np.any(couples),
        tuple(square),
    )


def assess(context: Context, found: Loops, turns: tuple[Turn, ...]) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record for each machine, and the tables."""
    spaces, assignments = found
    by_kind = dict(spaces)
    records = tuple(_record(number, own, by_kind[own.kind]) for number, own in enumerate(turns, 1))
    tables = (
        _loop_table(spaces),
        _assignment_table(assignments),
        _motion_table(turns),
        _load_table(turns),
        _square_table(turns),
        _trust_table(turns),
    )
    return records, tables


def _record(number: int, own: Turn, spaces: LoopSpaces) -> Record:
    floating, plain, stroke = own.found.floating, own.found.plain, own.machine.mechanism.stroke
    words, good = _verdict(own.found)
    margins = (
        exact("mobility W", spaces.mobility),
        exact("redundant constraints", spaces.redundant),
        Quantity("stroke", 1e3 * stroke, "mm", "exact", 4e3 * math.ulp(stroke)),
        Quantity("largest side load on the cylinder", floating.peak_wall, "N"),
        Quantity("largest side load of the plain piston", plain.peak_wall, "N"),
        Quantity("largest force at an end of the piston", floating.peak_edge, "N"),
        Quantity("largest force at an end of the plain piston", plain.peak_edge, "N"),
        Quantity("largest load on the crosshead's guide", floating.peak_guide, "N"),
        Quantity("static friction of the slot", floating.peak_held, "N"),
        Quantity("friction loss over that of the plain piston", own.found.friction_ratio),
        Quantity("energy balance over one rotation", max(floating.balance_error, plain.balance_error)),
        Quantity("difference of the forces to a sliding slot", own.difference),
    )
    name = f"floating piston on a {own.name}"
    return Record(number=number, recognised_as=name, verdict=f"{own.name}: {words}", good=good, margins=margins)


def _verdict(found: PistonComparison) -> tuple[str, bool | None]:
    """Say what the ends of the piston carry; static friction in the slot presses on both ends alike."""
    ratio, held = found.edge_ratio, found.floating.peak_held
    if math.isnan(ratio):
        return "the plain piston has no side load, so there is nothing to gain", None
    worst = ratio + 0.5 * held / found.plain.peak_edge
    words = "with a crowned slot the ends of the piston carry "
    words += "no side load" if abs(ratio) < 1e-11 else f"at most {100 * ratio:.3g} % of what the plain piston's carry"
    if held > 0.0:
        words += f"; static friction in the slot may raise this to {100 * worst:.3g} % of what the plain piston's carry"
    return f"{words} (estimated)", worst < 1.0


def _loop_table(spaces: tuple[tuple[str, LoopSpaces], ...]) -> Table:
    rows: list[tuple[object, ...]] = []
    for kind, own in spaces:
        for k, loop in enumerate(own.loops):
            joints = " ".join(f"{a}-{b}" for a, b in loop.fresh)
            added = f"{loop.sub_edges} - {loop.space} = {loop.mobility}"
            rows.append(
                ("" if k else _KINDS[kind], "-".join(map(str, loop.links)), joints, loop.own, loop.space, added)
            )
        checked = "agrees" if own.agrees else "does NOT agree"
        rows.append(("", own.statement, f"rank of the constraints: W = {own.by_constraints}, {checked}", "", "", ""))
    note = (
        "The span is that of the loop's own screws, Pi_j what it adds to the earlier loops. The second group adds no "
        "mobility: it is a structural group of a space of mobility 2. The redundant constraint is a couple."
    )
    columns = ("mechanism", "loop", "new joints", "span", "Pi_j", "sub-edges - Pi_j")
    return table("Loops and the spaces they move in", columns, rows, note)


def _assignment_table(assignments: tuple[Assignment, ...]) -> Table:
    rows = ((" ".join(own.kinds), own.full_turn, own.remark) for own in assignments)
    note = (
        "All 64 choices of revolute (R) and prismatic (P) joints were tried at random geometry; these have loops in "
        "spaces 3 and 2, W = 1, a crank and a piston that move. The joints are 0-1, 1-2, 2-3, 0-3, 3-4, 0-4."
    )
    return table("Which joints make such a mechanism", ("joints", "full rotation", "what it is"), rows, note)


def _motion_table(turns: tuple[Turn, ...]) -> Table:
    rows = []
    for own in turns:
        mechanism = own.machine.mechanism
        angles = [dead.angle for dead in mechanism.dead_centres()]
        rows.append((own.name, mechanism.stroke, *angles, mechanism.time_ratio))
    centres = ("outer dead centre [°] | .8g", "inner dead centre [°] | .8g")
    columns = ("mechanism", "stroke [mm] | .10g", *centres, "time ratio | .8g")
    return table("Motion", columns, rows, "Closed form; exact but for rounding.")


def _of_pistons(title: str, turns: Iterable[Turn], columns: dict[str, Callable[..., object]], note: str) -> Table:
    """Lay out every machine with and without its second group; columns are functions of turn, floating, works."""
    both = ((own, k == 0, one) for own in turns for k, one in enumerate((own.found.floating, own.found.plain)))
    return table(title, tuple(columns), ([get(*given) for get in columns.values()] for given in both), note)


def _load_table(turns: tuple[Turn, ...]) -> Table:
    columns: dict[str, Callable[..., object]] = {
        "mechanism": lambda own, floats, one: own.name if floats else "",
        "piston": lambda own, floats, one: "floating" if floats else "plain",
        "wall, peak [N] | 9 .5g": lambda own, floats, one: one.peak_wall,
        "wall, mean [N] | 9 .5g": lambda own, floats, one: one.mean_wall,
        "end of piston [N] | 9 .5g": lambda own, floats, one: one.peak_edge,
        "guide, peak [N] | .5g": lambda own, floats, one: one.peak_guide if floats else None,
        "end of shoe [N] | .5g": lambda own, floats, one: one.peak_guide_edge if floats else None,
        "gas work [J] | .6g": lambda own, floats, one: one.gas,
        "friction loss [J] | .5g": lambda own, floats, one: one.friction,
    }
    held = max(own.found.floating.peak_held for own in turns)
    note = (
        "Forces at the ends are those of a crowned slot, which carries no couple. A slot with flat faces may return "
        "any share of the couple on the crosshead to the cylinder; rigid bodies cannot tell how large a share."
    )
    if held > 0.0:
        note += (
            f" Where the slot does not slide, its static friction can hold up to {held:.4g} N across the cylinder, and "
            "the wall may carry that much more."
        )
    return _of_pistons("Side loads over one rotation", turns, columns, note)


def _square_table(turns: tuple[Turn, ...]) -> Table:
    rows: list[tuple[object, ...]] = []
    for own in turns:
        for k, (error, found) in enumerate(own.square):
            share = None if math.isnan(found.edge_ratio) else found.edge_ratio
            rows.append(("" if k else own.name, error, found.floating.peak_wall, share))
        if not math.isnan(own.found.squareness):
            angle = f"{math.degrees(own.found.squareness):.4g}"
            rows.append(("", angle, "no gain beyond this angle, whatever the load", ""))
    columns = (
        "mechanism",
        "slot out of square [°] | g",
        "wall, peak [N] | 9 .5g",
        "end of piston, share of the plain one [%] | 9 .3g",
    )
    note = (
        "An axial force F becomes the side load F tan(error); the rod of a plain piston makes it F tan(slope). The "
        "last angle is the steepest slope of the rod; a load that is large elsewhere ends the gain at a smaller angle."
    )
    return table("How square the slot must be", columns, rows, note)


def _trust_table(turns: tuple[Turn, ...]) -> Table:
    def gas(own: Turn, floats: bool, one: PistonTurn) -> str:
        known = one.gas_closed_form
        return f"{abs(one.gas - known) / max(abs(known), 1e-300):.1e}" if known else "0"

    def couples(own: Turn, floats: bool, one: PistonTurn) -> str:
        return ("undetermined, as the structure says" if own.redundant else "DETERMINED") if floats else ""

    columns: dict[str, Callable[..., object]] = {
        "machine": lambda own, floats, one: f"{own.name}, {'floating' if floats else 'plain'}",
        "energy over one rotation": lambda own, floats, one: (
            f"{one.balance_error:.1e}" + ("" if one.balance_error <= 1e-9 else " (WARNING)")
        ),
        "gas work against p-V area": gas,
        "power, at every angle | .1e": lambda own, floats, one: own.power,
        "forces against a sliding slot | .1e": lambda own, floats, one: own.difference if floats else None,
        "couples of a sliding slot": couples,
    }
    note = (
        "All relative. The reactions are the multipliers of all bodies at once; with the sliding slot of the source "
        "one constraint is redundant, and the same forces must come out."
    )
    return _of_pistons("Checks", turns, columns, note)


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw every machine in two poses, and its plain form."""
    from graphsynth.drawing.sketch import degrees
    from graphsynth.systems.piston.pictures import piston_sketch

    caption = (
        "Links: 1 crank, 2 rod or block, 3 crosshead or yoke on its guide, 4 piston. The piston is held by the "
        "cylinder and by the slot of the crosshead, nothing else."
    )
    pictures = []
    for kind, machine in machines_of(context):
        name = _KINDS[kind][0].upper() + _KINDS[kind][1:]
        for angle in _POSES:
            svg = piston_sketch(machine.mechanism, angle, width=620.0).svg()
            title = f"{name} with floating piston, crank at {degrees(angle)}"
            pictures.append(Picture(title, svg, caption if angle == _POSES[0] else ""))
        plain = piston_sketch(machine.mechanism.without_group(), _POSES[0], width=620.0).svg()
        pictures.append(Picture(f"{name} with plain piston", plain, "For comparison."))
    return tuple(pictures)


def animations(context: Context) -> tuple[Picture, ...]:
    """Let every machine turn in the page."""
    from graphsynth.systems.piston.pictures import piston_animated_svg

    caption = "Symbols of ISO 3952; the small slider on the piston is its slot in the crosshead."
    return tuple(
        Picture(f"One rotation: {_KINDS[kind]}", piston_animated_svg(machine.mechanism), caption)
        for kind, machine in machines_of(context)
    )


def plots(context: Context) -> tuple[Picture, ...]:
    """Motion, side loads, torque, reactions, gas force."""
    from graphsynth.systems.piston import pictures as charts

    pictures = []
    for kind, machine in machines_of(context):
        loads = "Dashed: the plain piston. The floating one's crosshead takes over what the cylinder loses."
        side = charts.side_load_chart(machine, context.scene.mechanism.piston_length)
        moved = [charts.piston_motion_chart(machine.mechanism, order) for order in range(3)]
        pictures += [
            Picture(f"{title}, {_KINDS[kind]}", chart.svg(), caption)
            for title, chart, caption in (
                ("Side load", side, loads),
                ("Reactions", charts.reaction_chart(machine), "Path of the tip of every force."),
                *zip(("Displacement", "Velocity", "Acceleration"), moved, ("", "", "")),
                ("Torque of the motor", charts.torque_chart(machine), ""),
                ("Gas force", charts.indicator_chart(machine), "Its area is the work of one rotation."),
            )
        ]
    return tuple(pictures)
