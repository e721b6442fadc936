"""A mechanism as a program: drivers and groups in the order of assembly, in flat tables for the kernels.

Inside a group, a link with exactly two plain joints (R or P) is eliminated, and placed afterwards in closed form; see
docs/explanation/planar-engine.md, "Groups, and what is eliminated".  The kernels of :mod:`.kernels.planning` do it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import check_largest
from graphsynth.core.compilation import named
from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.kinematics.engine import codes, outlines
from graphsynth.mechanism.joints import COLUMNS, Cam, JointGeometry
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import Decomposition, decompose
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Columns of a dimension set that are lengths.
_LENGTHS = [k for k, name in enumerate(COLUMNS) if name in ("ax", "ay", "bx", "by", "radius_a", "radius_b")]
_PLANNING = "graphsynth.kinematics.engine.kernels.planning"
#: Equations of kinds of joints that the kernels do not know, of mobility 2: from its numbers, each an array over the
#: sets, to code and parameters beside the two points.
FURTHER: dict[str, Callable[[Array], list[tuple[int, dict[int, Array]]]]] = {}
#: What a fault of one link means.
_FAULTS = {
    outlines.NO_LENGTH: "link {} has length 0 between its two joints; give it a positive length",
    outlines.PARALLEL_GUIDES: "link {} slides along two parallel lines, so its place is not defined; "
    "turn one direction",
    outlines.TURNED_TWICE: "link {} has its direction fixed twice by prismatic joints; its place is not defined",
}


@dataclass(frozen=True)
class Step:
    """What one step of a program places.

    `code`: see :mod:`.codes`; `group`: index of the Assur group, or -1 for a driver; `links` placed; `kind`:
    "driver R", "driver P", "RRR", "RRP", "RPR", "PRP", "RPP", or what the group is; `core`: links with unknown poses.
    """

    code: int
    group: int
    links: tuple[int, ...]
    kind: str
    core: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        """The group with its kind and links, for messages."""
        return f"group {self.group} ({self.kind}, links {', '.join(map(str, self.links))})"

    @property
    def has_two_modes(self) -> bool:
        """Whether a sign +1 or -1 selects the assembly mode in closed form."""
        return self.code in codes.TWO_MODES

    @property
    def iterative(self) -> bool:
        """Whether the step is solved by Newton's method."""
        return self.code >= codes.ITERATIVE_FROM


@dataclass(frozen=True, eq=False)
class Program:
    """Flat tables that the kernels run, and what they mean; ``gears`` are the rows of gear pairs.

    ``Lc`` is the characteristic length; an origin farther out than ``far`` belongs to a link that has gone away.
    """

    mechanism: Mechanism
    steps: tuple[Step, ...]
    tables: codes.Tables
    gears: IntArray
    Lc: float
    far: float


def compile_program(mechanism: Mechanism, dimensions: Array | None = None) -> Program:
    """Compile a mechanism, or many of a kind with ``dimensions`` (sets, joints, 10) in the form of the mechanism's own.

    `GeometryError` if the drivers do not fit the mobility, or a group has no definite place with these joint kinds.
    """
    if not isinstance(mechanism, Mechanism):
        raise GeometryError(f"{type(mechanism).__name__} is not a Mechanism; give one")
    sizes = mechanism.dimensions[None] if dimensions is None else dimensions
    check_largest(float(np.abs(sizes[..., _LENGTHS]).max(initial=0.0)))  # products of four lengths must be numbers
    outline, fill, sizes_of = named(_PLANNING, "outline", "fill", "sizes_of")
    given, links = drawn(mechanism.joints, sizes, mechanism.drivers), mechanism.graph.links
    found = outlines.Outline(*(np.zeros(shape, dtype=np.int64) for shape in _shapes(mechanism)))
    fault = outline(given, mechanism.frame, found)
    if fault in _FAULTS:
        raise GeometryError(_FAULTS[fault].format(found.counts[outlines.AT]))
    if fault:
        try:
            decomposed(mechanism.graph, tuple(driver.pair for driver in mechanism.drivers))
        except GraphError as error:
            raise GeometryError(f"the mechanism cannot be simulated: {error}") from error
    used = found.counts.tolist()
    rows, gears = found.rows[: used[outlines.ROWS]], found.gears[: used[outlines.GEARS]]
    width = codes.ROW_WIDTH + (given.waves.shape[1] if (rows[:, 0] == codes.CAM).any() else 0)
    numbers = np.zeros((len(sizes), len(rows), width))
    eliminated = np.zeros((len(sizes), used[outlines.GONE], codes.ELIM_WIDTH))
    drives = np.zeros((len(sizes), used[outlines.DRIVES], codes.DRIVE_WIDTH))
    fill(given, found, numbers, eliminated, drives)
    _further(mechanism.joints, sizes, found.source[:, 1], rows, numbers)
    need = np.zeros(links, dtype=np.bool_)
    need[rows[gears, 1:3].ravel()] = True
    tables = codes.Tables(
        found.steps[: used[outlines.STEPS]],
        found.touched[: max(1, used[outlines.TOUCHED])],
        rows,
        numbers,
        found.core[: max(1, used[outlines.CORE])],
        found.eliminated[: used[outlines.GONE]],
        eliminated,
        found.drives[: used[outlines.DRIVES]],
        drives,
        need,
    )
    steps = tuple(_step(given.joints, found, tables, k) for k in range(len(tables.steps)))
    return Program(mechanism, steps, tables, gears, *sizes_of(given._replace(sizes=mechanism.dimensions[None]), links))


def _shapes(mechanism: Mechanism) -> list[tuple[int, ...]]:
    """Shapes of an outline with room for every program of so many links, joints and drivers."""
    links, joints, drivers = mechanism.graph.links, len(mechanism.joints), len(mechanism.drivers)
    rows = 2 * joints + drivers + links
    wide = (links + drivers, 10), (2 * joints + 1,), (rows, 5), (rows, 4), (links + 1,), (links, 4), (links, 2)
    return [*wide, (drivers, 4), (joints,), (links, 3), (8,)]


def drawn(joints: Sequence[JointGeometry], sizes: Array, drivers: Sequence[Driver]) -> outlines.Drawn:
    """Return what the kernels read of joints with dimension sets (sets, joints, 10), and of drivers."""
    number = {joint.pair: k for k, joint in enumerate(joints)}
    kinds = {kind: k for k, kind in enumerate(outlines.JOINTS)} | dict.fromkeys(FURTHER, outlines.CAMMED)
    table = np.array([(kinds[j.kind], j.a, j.b) for j in joints], dtype=np.int64).reshape(-1, 3)
    own = [joint.harmonics if isinstance(joint, Cam) else () for joint in joints]
    waves = np.zeros((len(own), 2 * max(map(len, own), default=0)))
    for k, harmonics in enumerate(own):
        waves[k, : 2 * len(harmonics)] = np.ravel(harmonics)
    driven = np.array([(number[d.pair], d.base) for d in drivers], dtype=np.int64).reshape(-1, 2)
    return outlines.Drawn(table, np.ascontiguousarray(sizes), waves, driven)


def equations(joints: Sequence[JointGeometry], sizes: Array, drivers: Sequence[Driver] = ()) -> tuple[IntArray, Array]:
    """Return all equations of joints and drivers, in which no link is eliminated.

    Rows (rows, 6): code, links a and b, -1, -1, the joint; their numbers (sets, rows, width).  A joint of mobility 1
    has two rows, any other one; those of the drivers come last.
    """
    (joint_rows,) = named(_PLANNING, "joint_rows")
    given = drawn(joints, sizes, drivers)
    count = sum(3 - joint.mobility for joint in joints) + len(drivers)
    rows, width = np.zeros((count, 6), dtype=np.int64), codes.ROW_WIDTH + given.waves.shape[1]
    table = np.zeros((len(sizes), count, width))
    joint_rows(given, rows, table)
    _further(joints, sizes, rows[:, 5], rows, table)
    return rows, table


def _further(joints: Sequence[JointGeometry], sizes: Array, joint_of: IntArray, rows: IntArray, table: Array) -> None:
    """Write the equations of `FURTHER` kinds into rows that the kernels took for those of cams."""
    for r in np.flatnonzero(rows[:, 0] == codes.CAM).tolist() if FURTHER else ():
        k = int(joint_of[r])
        if joints[k].kind in FURTHER:
            ((rows[r, 0], own),) = FURTHER[joints[k].kind](sizes[:, k].T)
            table[:, r, codes.TX :] = 0.0
            for column, value in ({codes.TX: np.ones(len(sizes))} | own).items():
                table[:, r, column] = value


@lru_cache(maxsize=512)
def decomposed(graph: MechanismGraph, drivers: tuple[tuple[int, int], ...]) -> Decomposition:
    """Structural groups, kept: searches compile the same graph again and again."""
    return decompose(graph, drivers)


def _step(joints: IntArray, found: outlines.Outline, tables: codes.Tables, k: int) -> Step:
    """Describe a step of a program."""
    code, first, _, core0, cores, _, _, _, _, group = tables.steps[k].tolist()
    if group < 0:
        kind = "R" if code == codes.DRIVE_R else "P"
        return Step(code, -1, (int(tables.drives[first, 2]),), f"driver {kind}")
    number = found.structure[:, 1]
    links = tuple(np.flatnonzero(number == group + 1).tolist())
    of_a, of_b = number[joints[:, 1]], number[joints[:, 2]]
    own = ((of_a == group + 1) | (of_b == group + 1)) & (np.maximum(of_a, of_b) == group + 1)
    kinds = [(outlines.JOINTS[joint], inside) for joint, inside in zip(joints[own, 0], (of_a == of_b)[own].tolist())]
    return Step(code, group, links, _describe(links, kinds), tuple(tables.core[core0 : core0 + cores].tolist()))


def _describe(links: tuple[int, ...], joints: list[tuple[str, bool]]) -> str:
    """Name of a group by its joints, of which those inside are marked: a dyad as outer, inner, outer."""
    inner, outer = ([kind for kind, inside in joints if inside is wanted] for wanted in (True, False))
    if len(links) == 2 and len(inner) == 1 and len(outer) == 2:
        ends = sorted(outer, reverse=True)
        return f"{ends[0]}{inner[0]}{ends[1]}"
    if len(links) == 1:
        return "+".join(outer)
    return f"group of {len(links)} links"
