"""Programs of mechanisms in plain Python, to compare the compiled planning with.

It was the library's own until the kernels took its place.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine import codes
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import Decomposition, decompose

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Complex = NDArray[np.complex128]
#: One number, or one per dimension set.
Number = float | Array

_WIDE = 1e-14
#: Equations of the kernels: codes, with the parameters that they have beside the two points.
KernelRows = list[tuple[int, dict[int, Number]]]


def _line(size: Array) -> dict[int, Number]:
    return {codes.TX: np.cos(size[2]), codes.TY: np.sin(size[2])}


#: Equations of every kind of joint, from its numbers in the order of `COLUMNS` (columns are arrays over the sets).
ROWS: dict[str, Callable[[Array], KernelRows]] = {
    "R": lambda size: [(codes.RX, {}), (codes.RY, {})],
    "P": lambda size: [(codes.LINE, _line(size)), (codes.ANGLE, _line(size) | {codes.H: size[2] - size[5]})],
    "pin-slot": lambda size: [(codes.LINE, _line(size))],
    "gear": lambda size: [(codes.GEAR, {codes.RA: size[6], codes.RB: size[7], codes.SIGN: size[8], codes.H: size[9]})],
    "cam": lambda size: [(codes.CAM, {codes.RA: size[2], codes.H: size[6]})],
}


class KernelRow(NamedTuple):
    """One equation between links a and b with its parameters."""

    kind: int
    a: int
    b: int
    parameters: list[Number]


def plain_program(mechanism: Mechanism, dimensions: Array | None = None) -> tuple[codes.Tables, list[Any], list[int]]:
    """Tables, steps (code, group, links, kind, core) and rows of gear pairs."""
    found = decompose(mechanism.graph, tuple(driver.pair for driver in mechanism.drivers))
    return _Compiler(mechanism, found, mechanism.dimensions[None] if dimensions is None else dimensions).program()


class _Compiler:
    def __init__(self, mechanism: Mechanism, found: Decomposition, dimensions: Array) -> None:
        self.mechanism = mechanism
        self.found = found
        self.sets = len(dimensions)
        self.sizes = {joint.pair: dimensions[:, k] for k, joint in enumerate(mechanism.joints)}
        self.joint = {joint.pair: joint for joint in mechanism.joints}
        self.driven = {driver.pair: (k, driver) for k, driver in enumerate(mechanism.drivers)}
        self.steps: list[Any] = []
        self.table: list[list[int]] = []
        self.rows: list[tuple[list[int], list[Number]]] = []
        self.core: list[int] = []
        self.touched: list[int] = []
        self.eliminated: list[tuple[list[int], list[Number]]] = []
        self.drives: list[tuple[list[int], list[Number]]] = []
        self.gears: list[int] = []

    def program(self) -> tuple[codes.Tables, list[Any], list[int]]:
        placed = {self.mechanism.frame}
        # the links that drivers hang on the frame, one after another
        left = [pair for pair in self.driven if set(pair) <= set(self.found.driven)]
        while left:
            pair = next(p for p in left if len(placed & set(p)) == 1)
            left.remove(pair)
            link = pair[0] if pair[1] in placed else pair[1]
            self._drive(pair, link)
            placed.add(link)
        for index, group in enumerate(self.found.groups):
            self._group(index, group.links, placed)
            placed |= set(group.links)
        links = self.mechanism.graph.links
        need = np.zeros(links, dtype=np.bool_)
        for joint in self.mechanism.joints:
            if isinstance(joint, Gear):
                need[[joint.a, joint.b]] = True
        steps = np.array(self.table, dtype=np.int64).reshape(-1, 10)
        touched, core = (np.array(links or [0], dtype=np.int64) for links in (self.touched, self.core))
        rows, row_table = self._tables(self.rows, 5, codes.ROW_WIDTH)
        drives = self._tables(self.drives, 4, codes.DRIVE_WIDTH)
        eliminated = self._tables(self.eliminated, 4, codes.ELIM_WIDTH)
        tables = codes.Tables(steps, touched, rows, row_table, core, *eliminated, *drives, need)
        return tables, self.steps, self.gears

    def _drive(self, pair: tuple[int, int], link: int) -> None:
        joint, (index, driver) = self.joint[pair], self.driven[pair]
        sign, forward = (1.0 if driver.base == joint.a else -1.0), (1.0 if link == joint.b else -1.0)
        other, base, own, da, db = self._seen(joint, link)
        code = codes.DRIVE_P if isinstance(joint, Prismatic) else codes.DRIVE_R
        direction = np.exp(1j * da)
        self.table.append([code, len(self.drives), 0, 0, 0, 0, 0, 0, 0, -1])
        self.steps.append((code, -1, (link,), f"driver {joint.kind}", ()))
        self.drives.append(([code, other, link, index], [*_parts(base, direction, own), sign * forward, da - db]))

    def _group(self, index: int, links: tuple[int, ...], placed: set[int]) -> None:
        inside = set(links)
        own = [
            joint
            for joint in self.mechanism.joints
            if (joint.a in inside or joint.b in inside) and {joint.a, joint.b} <= inside | placed
        ]
        gone = self._choose(links, own)
        rows = [
            row
            for joint in own
            if not gone & {joint.a, joint.b}
            for row in joint_rows(joint, self.sizes[joint.pair], self.driven.get(joint.pair))
        ]
        first_eliminated = len(self.eliminated)
        for link in sorted(gone):
            ends = [joint for joint in own if link in (joint.a, joint.b)]
            rows.append(self._eliminate(link, ends[0], ends[1]))
        core = tuple(link for link in links if link not in gone)
        code, rows = _closed(core, rows)
        place = {link: k for k, link in enumerate(core)}
        outside = sorted({link for joint in own for link in joint.pair} - inside)
        first = [code, len(self.rows), len(rows), len(self.core), len(core), first_eliminated, len(gone)]
        self.table.append([*first, len(self.touched), len(outside), index])
        self.steps.append((code, index, links, _describe(code, links, own), core))
        for kind, a, b, parameters in rows:
            if kind == codes.GEAR:
                parameters[codes.SLOT] = float(len(self.gears))
                self.gears.append(len(self.rows))
            self.rows.append(([kind, a, b, place.get(a, -1), place.get(b, -1)], parameters))
        self.core.extend(core)
        self.touched.extend(outside)

    def _choose(self, links: tuple[int, ...], own: list[JointGeometry]) -> set[int]:
        """Links to eliminate: two plain joints each, no two of them joined."""
        gone: set[int] = set()
        for link in sorted(links, reverse=True):
            ends = [joint for joint in own if link in (joint.a, joint.b)]
            near = {other for joint in ends for other in joint.pair} - {link}
            plain = all(isinstance(j, Revolute | Prismatic) and j.pair not in self.driven for j in ends)
            if len(ends) == 2 and plain and not near & gone and len(near) == 2 and len(gone) < len(links) - 1:
                gone.add(link)
        return gone

    def _eliminate(self, link: int, first: JointGeometry, second: JointGeometry) -> KernelRow:
        """Record an eliminated link and return the equation that replaces it."""
        if isinstance(first, Prismatic) and isinstance(second, Revolute):
            first, second = second, first
        a, pa, ea, da, dea = self._seen(first, link)
        b, pb, eb, db, deb = self._seen(second, link)
        kind = codes.E_PP if isinstance(first, Prismatic) else codes.E_RP
        kind = codes.E_RR if isinstance(second, Revolute) else kind
        ta, tb = np.exp(1j * da), np.exp(1j * db)
        turn = 0.0 * da if kind == codes.E_RR else db - deb if kind == codes.E_RP else da - dea
        self.eliminated.append(([kind, link, a, b], [*_parts(pa, ea, pb, eb, ta, tb), turn]))
        if kind == codes.E_RP:  # the pin of a runs on a line of b
            offset = (np.exp(-1j * deb) * (ea - eb)).imag
            return KernelRow(codes.LINE, b, a, [*_parts(pb, pa, tb), offset, *[0.0] * 5])
        if kind == codes.E_RR:
            length = np.abs(eb - ea)
            if not (length > 0.0).all():
                raise GeometryError(f"link {link} has length 0 between its two joints; give it a positive length")
            return KernelRow(codes.DIST, a, b, [*_parts(pa, pb), 1.0, 0.0, length, *[0.0] * 4, 1.0 / length])
        if (np.abs(np.sin(dea - deb)) <= _WIDE).any():
            raise GeometryError(
                f"link {link} slides along two parallel lines, so its place is not defined; turn one direction"
            )
        return KernelRow(codes.ANGLE, a, b, [*_parts(pa, pb), 1.0, 0.0, da - dea + deb - db, *[0.0] * 5])

    def _seen(self, joint: JointGeometry, link: int) -> tuple[int, Complex, Complex, Array, Array]:
        """Other link, its point, the link's point, and the directions there (0 for a revolute joint)."""
        size = self.sizes[joint.pair].T
        on_a, on_b = size[0] + 1j * size[1], size[3] + 1j * size[4]
        if link == joint.b:
            return joint.a, on_a, on_b, size[2], size[5]
        return joint.b, on_b, on_a, size[5], size[2]

    def _tables(self, rows: list[tuple[list[int], list[Number]]], count: int, width: int) -> tuple[IntArray, Array]:
        """Return whole numbers (rows, count) and a parameter table (sets, rows, width); cams make it wider."""
        width = max([width, *(len(parameters) for _, parameters in rows)])
        table = np.zeros((self.sets, len(rows), width))
        for k, (_, parameters) in enumerate(rows):
            for column, value in enumerate(parameters):
                table[:, k, column] = value
        return np.array([own for own, _ in rows], dtype=np.int64).reshape(-1, count), table


def joint_rows(joint: JointGeometry, sizes: Array, driven: tuple[int, Driver] | None) -> list[KernelRow]:
    """Return the equations of a joint of dimensions (sets, 10), the driven coordinate included."""
    size = sizes.T
    base: list[Number] = [size[0], size[1], size[3], size[4], 1.0, 0.0, *[0.0] * 6]
    found = []
    for code, own in ROWS[joint.kind](size):
        parameters = list(base)
        for column, value in own.items():
            parameters[column] = value
        harmonics = joint.harmonics if isinstance(joint, Cam) else ()
        found.append(KernelRow(code, joint.a, joint.b, [*parameters, *(part for pair in harmonics for part in pair)]))
    if driven is not None:
        index, driver = driven
        base[codes.TX], base[codes.TY] = np.cos(size[2]), np.sin(size[2])
        base[codes.SIGN], base[codes.SLOT] = (1.0 if driver.base == joint.a else -1.0), float(index)
        code = codes.DRIVE_ANGLE if isinstance(joint, Revolute) else codes.DRIVE_SLIDE
        found.append(KernelRow(code, joint.a, joint.b, base))
    return found


def _parts(*points: Complex) -> list[Number]:
    """Real and imaginary parts in turn."""
    return [part for z in points for part in (z.real, z.imag)]


def _closed(core: tuple[int, ...], rows: list[KernelRow]) -> tuple[int, list[KernelRow]]:
    """Choose the closed form of a group, with its rows in the order that the form expects."""
    if len(core) != 1:
        return codes.NEWTON, rows
    kinds = sorted(row.kind for row in rows)
    own = core[0]
    if kinds == [codes.DIST] * 3:
        return codes.PLATFORM, rows

    def order(*wanted: int) -> list[KernelRow]:
        left = list(rows)
        return [left.pop(next(k for k, row in enumerate(left) if row.kind == kind)) for kind in wanted]

    if kinds[:2] == [codes.RX, codes.RY]:
        third = order(codes.RX, codes.RY, kinds[2])
        held, last = third[0], third[2]
        if last.kind == codes.DIST:
            return codes.R_DIST, third
        if last.kind == codes.LINE:
            return (codes.R_LINE_PIN if last.b == own else codes.R_LINE_SLOT), third
        if last.kind == codes.ANGLE:
            return codes.R_ANGLE, third
        ends = [row.parameters[2:4] if row.b == own else row.parameters[0:2] for row in (held, last)]
        if last.kind == codes.GEAR and all(np.array_equal(p, q) for p, q in zip(*ends)):  # on the revolute joint
            return codes.R_GEAR, third
    if kinds == [codes.DIST, codes.LINE, codes.ANGLE]:
        return codes.P_DIST, order(codes.LINE, codes.ANGLE, codes.DIST)
    if kinds == [codes.LINE, codes.LINE, codes.ANGLE]:
        return codes.P_LINE, order(codes.LINE, codes.ANGLE, codes.LINE)
    if kinds.count(codes.ANGLE) > 1:
        raise GeometryError(f"link {own} has its direction fixed twice by prismatic joints; its place is not defined")
    return codes.NEWTON, rows


def _describe(code: int, links: tuple[int, ...], own: list[JointGeometry]) -> str:
    """Name of a group by its joints: a dyad as outer, inner, outer."""
    inside = set(links)
    inner = [joint for joint in own if {joint.a, joint.b} <= inside]
    outer = [joint for joint in own if not {joint.a, joint.b} <= inside]
    if len(links) == 2 and len(inner) == 1 and len(outer) == 2:
        ends = sorted((joint.kind for joint in outer), reverse=True)
        return f"{ends[0]}{inner[0].kind}{ends[1]}"
    if len(links) == 1:
        return "+".join(joint.kind for joint in outer)
    return f"group of {len(links)} links"
