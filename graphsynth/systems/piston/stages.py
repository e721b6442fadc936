"""The floating piston of a scene: loops and their spaces, a turn with and without the second group, what is said."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.products import Candidate, Quantity, Recognised, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import recognise_by_key
from graphsynth.systems.piston.system import PistonTable

if TYPE_CHECKING:
    from graphsynth.systems.piston.assignments import Assignment
    from graphsynth.systems.piston.machine import PistonMachine
    from graphsynth.systems.piston.spaces import LoopSpaces
    from graphsynth.systems.piston.turn import PistonComparison

_KINDS = {"crank_slider": "crank-slider", "scotch_yoke": "Scotch yoke"}


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """One turn of a machine with and without the second group, and how far it can be trusted.

    Attributes
    ----------
    kind : str
    machine : PistonMachine
    found : PistonComparison
    difference : float
        Between the closed form and the multipliers, relative to the largest force; the larger of both machines.
    redundant : bool
        Whether the multipliers found the couple of the second loop undetermined.
    square : tuple of (float, PistonComparison)
        The same with the slot out of square to the cylinder by an angle, radians.
    """

    kind: str
    machine: PistonMachine
    found: PistonComparison
    difference: float
    redundant: bool
    square: tuple[tuple[float, PistonComparison], ...]


def table_of(context: Context) -> PistonTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, PistonTable)
    return table


def words_of(kind: str) -> str:
    """Return the name of a kind for readers."""
    return _KINDS[kind]


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to the graph with the crowned slot, whose count in one space is right."""
    from graphsynth.structure.graph import MechanismGraph

    known = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (3, 4, 2)], frame=0)
    return recognise_by_key(candidates, known, "floating_piston")


def machines_of(context: Context) -> tuple[tuple[str, PistonMachine], ...]:
    """Build the machines of the scene; a number that makes no sense is an error of the scene."""
    table = table_of(context)
    try:
        return tuple((kind, _machine(table, kind)) for kind in table.kinds)
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be built: {error}") from error


def _machine(table: PistonTable, kind: str) -> PistonMachine:
    from graphsynth.systems.piston.drives import CrankSlider, ScotchYoke
    from graphsynth.systems.piston.gas import CompressorCycle, ConstantForce
    from graphsynth.systems.piston.group import FloatingGroup
    from graphsynth.systems.piston.loads import PistonFriction, PistonMasses
    from graphsynth.systems.piston.machine import PistonMachine
    from graphsynth.systems.piston.model import FloatingPiston

    drive, group, gas, masses, friction = table.drive, table.group, table.gas, table.masses, table.friction
    crank, offset = drive.crank_mm / 1e3, drive.offset_mm / 1e3
    first = (
        CrankSlider(crank, drive.rod_mm / 1e3, offset)
        if kind == "crank_slider"
        else ScotchYoke(crank, offset, math.radians(drive.yoke_angle_deg))
    )
    second = FloatingGroup(
        math.radians(group.cylinder_angle_deg), math.radians(group.slot_angle_deg), group.cylinder_offset_mm / 1e3,
        group.lead_mm / 1e3,
    )  # fmt: skip
    back = None if gas is None or gas.back_MPa is None else gas.back_MPa * 1e6
    return PistonMachine(
        FloatingPiston(first, second),
        PistonMasses(
            masses.crank_kg, masses.follower_kg, masses.crosshead_kg, masses.piston_kg, masses.crank_inertia_kg_m2,
            masses.rod_inertia_kg_m2 if kind == "crank_slider" else 0.0, masses.crank_centre_mm / 1e3,
            masses.rod_centre_mm / 1e3 if kind == "crank_slider" else 0.0,
        ),
        ConstantForce(table.force_N) if gas is None else CompressorCycle(
            gas.bore_mm / 1e3, gas.suction_MPa * 1e6, gas.discharge_MPa * 1e6, back, gas.clearance, gas.exponent
        ),
        PistonFriction(
            friction.guide, friction.cylinder, friction.slot, friction.yoke if kind == "scotch_yoke" else 0.0,
            friction.rings_N, friction.smoothing_velocity_m_s,
        ),
        table.speed_rad_s, 0.0, table.gravity_m_s2,
    )  # fmt: skip


def loops(context: Context) -> tuple[tuple[tuple[str, LoopSpaces], ...], tuple[Assignment, ...]]:
    """Find the spaces of the loops of every machine, and all kinds of joints with such loops."""
    from graphsynth.systems.piston.assignments import rotary_assignments
    from graphsynth.systems.piston.spaces import loop_spaces

    found = tuple((kind, loop_spaces(machine.mechanism.mechanism())) for kind, machine in machines_of(context))
    return found, tuple(rotary_assignments(context.scene.scene.seed))


def turn(context: Context) -> tuple[Turn, ...]:
    """Turn every machine once, with and without the second group; compute the loads a second way."""
    try:
        return tuple(_turn(context, kind, machine) for kind, machine in machines_of(context))
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be turned: {error}") from error


def _turn(context: Context, kind: str, machine: PistonMachine) -> Turn:
    from dataclasses import replace

    import numpy as np

    from graphsynth.systems.piston.dynamic_model import check_by_multipliers
    from graphsynth.systems.piston.turn import compare_pistons

    table = table_of(context)
    length = None if table.piston_length_mm is None else table.piston_length_mm / 1e3
    step = math.tau / table.positions
    angles = (np.arange(table.positions) + 0.5) * step
    checks = [check_by_multipliers(own, angles) for own in (machine, machine.without_group())]
    group = machine.mechanism.group
    assert group is not None
    square = []
    for degrees in table.square_errors_deg:
        error = math.radians(degrees)
        turned = replace(group, slot_angle=group.cylinder_angle + 0.5 * math.pi + error)
        other = replace(machine, mechanism=replace(machine.mechanism, group=turned))
        square.append((error, compare_pistons(other, length)))
    return Turn(
        kind, machine, compare_pistons(machine, length), max(check.difference for check in checks),
        checks[0].redundant_couples, tuple(square),
    )  # fmt: skip


def judge(
    context: Context,
    found: tuple[tuple[tuple[str, LoopSpaces], ...], tuple[Assignment, ...]],
    turns: tuple[Turn, ...],
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
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
    found, stroke = own.found, own.machine.mechanism.stroke
    name = words_of(own.kind)
    words, good = _verdict(found)
    words = f"{name}: {words}"
    margins = (
        exact("mobility W", spaces.mobility),
        exact("redundant constraints", spaces.redundant),
        Quantity("stroke", 1e3 * stroke, "mm", "exact", 4e3 * math.ulp(stroke)),
        Quantity("largest side load on the cylinder", found.floating.peak_wall, "N"),
        Quantity("the same of the plain piston", found.plain.peak_wall, "N"),
        Quantity("largest force at an end of the piston", found.floating.peak_edge, "N"),
        Quantity("the same of the plain piston's end", found.plain.peak_edge, "N"),
        Quantity("largest load on the crosshead's guide", found.floating.peak_guide, "N"),
        Quantity("static friction of the slot", found.floating.peak_held, "N"),
        Quantity("friction loss over that of the plain piston", found.friction_ratio),
        Quantity("balance of energy over a turn", max(found.floating.balance_error, found.plain.balance_error)),
        Quantity("difference to the multipliers", own.difference),
    )
    return Record(
        number=number, recognised_as=f"floating piston on a {name}", verdict=words, good=good, margins=margins
    )  # fmt: skip


def _verdict(found: PistonComparison) -> tuple[str, bool | None]:
    """Say what the ends of the piston keep; static friction in the slot presses on both ends alike."""
    ratio = found.edge_ratio
    if math.isnan(ratio):
        return "the plain piston has no side load, so there is nothing to gain", None
    worst = ratio + 0.5 * found.floating.peak_held / found.plain.peak_edge
    words = f"with a crowned slot the ends of the piston keep {_percent(ratio)} of the plain one's largest force"
    if found.floating.peak_held > 0.0:
        words += f", at most {_percent(worst)} with what static friction in the slot may hold"
    return f"{words} (estimated)", worst < 1.0


def _percent(value: float) -> str:
    return "0 %" if abs(value) < 1e-11 else f"{100 * value:.3g} %"


def _loop_table(spaces: tuple[tuple[str, LoopSpaces], ...]) -> Table:
    rows = []
    for kind, own in spaces:
        for k, loop in enumerate(own.loops):
            joints = " ".join(f"{a}-{b}" for a, b in loop.fresh)
            added = f"{loop.sub_edges} - {loop.space} = {loop.mobility}"
            rows.append(
                (
                    words_of(kind) if k == 0 else "",
                    "-".join(map(str, loop.links)),
                    joints,
                    str(loop.own),
                    str(loop.space),
                    added,
                )
            )
        checked = "agrees" if own.agrees else "does NOT agree"
        rows.append(("", own.statement, f"rank of the constraints: W = {own.by_constraints}, {checked}", "", "", ""))
    note = (
        "The span is that of the loop's own screws, Pi_j what it adds to the earlier loops. The second group adds no "
        "mobility: it is a structural group of a space of mobility 2. The redundant constraint is a couple."
    )
    columns = ("mechanism", "loop", "new joints", "span", "Pi_j", "sub-edges - Pi_j")
    return Table("Loops and the spaces they move in", columns, tuple(rows), note)


def _assignment_table(assignments: tuple[Assignment, ...]) -> Table:
    rows = tuple((" ".join(own.kinds), "yes" if own.full_turn else "no", own.remark) for own in assignments)
    note = (
        "All 64 choices of turning (R) and sliding (P) pairs were tried at random geometry; these have loops in spaces "
        "3 and 2, W = 1, a crank and a piston that move. The joints are 0-1, 1-2, 2-3, 0-3, 3-4, 0-4."
    )
    return Table("Which joints make such a mechanism", ("joints", "full turn", "what it is"), rows, note)


def _motion_table(turns: tuple[Turn, ...]) -> Table:
    rows = []
    for own in turns:
        mechanism = own.machine.mechanism
        outer, inner = mechanism.dead_centres()
        rows.append(
            (
                words_of(own.kind), f"{1e3 * mechanism.stroke:.10g}", f"{math.degrees(outer.angle):.8g}",
                f"{math.degrees(inner.angle):.8g}", f"{mechanism.time_ratio:.8g}",
            )
        )  # fmt: skip
    columns = ("mechanism", "stroke [mm]", "outer dead centre [°]", "inner dead centre [°]", "time ratio")
    return Table("Motion", columns, tuple(rows), "Closed form; exact but for rounding.")


def _load_table(turns: tuple[Turn, ...]) -> Table:
    rows = []
    for own in turns:
        for k, (name, one) in enumerate((("floating", own.found.floating), ("plain", own.found.plain))):
            guide = (f"{one.peak_guide:.5g}", f"{one.peak_guide_edge:.5g}") if name == "floating" else ("", "")
            rows.append(
                (
                    words_of(own.kind) if k == 0 else "", name, _force(one.peak_wall), _force(one.mean_wall),
                    _force(one.peak_edge), *guide, f"{one.gas:.6g}", f"{one.friction:.5g}",
                )
            )  # fmt: skip
    columns = (
        "mechanism", "piston", "wall, peak [N]", "wall, mean [N]", "end of piston [N]", "guide, peak [N]",
        "end of shoe [N]", "gas work [J]", "friction loss [J]",
    )  # fmt: skip
    held = max(own.found.floating.peak_held for own in turns)
    note = (
        "Forces at the ends are those of a crowned slot, which carries no couple. A sliding pair may send back to the "
        "cylinder any share of the couple on the crosshead: what share, rigid bodies cannot tell."
    )
    if held > 0.0:
        note += (
            f" Where the slot does not slide, its static friction can hold up to {held:.4g} N across the cylinder, and "
            "the wall may carry so much more."
        )
    return Table("Side loads over a turn", columns, tuple(rows), note)


def _force(value: float) -> str:
    return "0" if value < 1e-9 else f"{value:.5g}"


def _square_table(turns: tuple[Turn, ...]) -> Table:
    rows = []
    for own in turns:
        for k, (error, found) in enumerate(own.square):
            share = found.edge_ratio
            rows.append(
                (
                    words_of(own.kind) if k == 0 else "", f"{math.degrees(error):g}", _force(found.floating.peak_wall),
                    "" if math.isnan(share) else _percent(share),
                )
            )  # fmt: skip
        if not math.isnan(own.found.squareness):
            text = f"{math.degrees(own.found.squareness):.4g}"
            rows.append(("", text, "nothing is gained beyond, whatever the load", ""))
    columns = ("mechanism", "slot out of square [°]", "wall, peak [N]", "end of piston, of the plain one")
    note = (
        "An axial force F becomes the side load F tan(error); the rod of a plain piston makes it F tan(slope). The "
        "last angle is the steepest slope; where in the turn the load is large decides how much earlier the gain ends."
    )
    return Table("What the slot must keep", columns, tuple(rows), note)


def _trust_table(turns: tuple[Turn, ...]) -> Table:
    rows = []
    for own in turns:
        for name, one in (("floating", own.found.floating), ("plain", own.found.plain)):
            gas = abs(one.gas - one.gas_closed_form) / max(abs(one.gas_closed_form), 1e-300)
            warned = "" if one.balance_error <= 1e-9 else " (WARNING)"
            rows.append(
                (
                    f"{words_of(own.kind)}, {name}", f"{one.balance_error:.1e}{warned}",
                    f"{gas:.1e}" if one.gas_closed_form else "0", f"{own.difference:.1e}",
                    ("undetermined, as the structure says" if own.redundant else "DETERMINED") if name == "floating"
                    else "",
                )
            )  # fmt: skip
    columns = ("machine", "energy over a turn", "gas work against p-V area", "forces against multipliers", "couples")
    note = "All relative. The multipliers solve all bodies at once; the closed form goes from body to body."
    return Table("How far it can be trusted", columns, tuple(rows), note)
