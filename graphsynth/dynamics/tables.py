"""A dynamic model as flat tables for the kernels.

Coordinates are those of theory/planar-dynamics 1: for every moving link, ascending, ``(x, y, theta)`` of its centre of
mass.  Joint points are shifted to the centres of mass, so the rows of the planar engine apply as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Force, JointFriction, MotorDrive, Spring, Torque, TorqueSource, TorsionSpring
from graphsynth.dynamics.model import DynamicModel, Rack, Rigid
from graphsynth.dynamics.motors import electric
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.inputs import coordinates
from graphsynth.kinematics.engine.program import equations
from graphsynth.mechanism.joints import Cam, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
#: Kind, links a and b, parameters of a constraint row.
Row = tuple[int, int, int, list[float]]

#: Kind of a rack row, beside those of :mod:`graphsynth.kinematics.engine.codes`.
RACK = 20
#: Kinds of rows that are angles.
_ANGULAR = (codes.ANGLE, codes.DRIVE_ANGLE, codes.GEAR)
#: Sense of sliding of a friction element that is given by the speed itself.
BY_SPEED = 2.0


class Tables(NamedTuple):
    """What the kernels read; n coordinates, m constraint rows."""

    column: IntArray  #: (links,) first coordinate of a link, -1 for the frame
    rows: IntArray  #: (m, 3) kind, a, b
    table: Array  #: (m, width) parameters
    slots: IntArray  #: (m,) slot of a gear or rack, -1
    mass: Array  #: (n, n)
    lower: Array  #: (n, n) Cholesky factor of the mass matrix; (0, 0) if there are massless links
    diagonal: bool  #: whether the mass matrix is diagonal
    gravity: Array  #: (2,)
    springs: IntArray  #: (springs, 2) links
    spring_table: Array  #: (springs, 7) points, stiffness, free length, damping
    torsions: IntArray
    torsion_table: Array  #: stiffness, free angle, damping
    forces: IntArray  #: (forces, 2) link, 1 if the force turns with it
    force_table: Array  #: point, force
    sources: IntArray  #: (torques, 2) links
    source_table: Array  #: torque behind the train, efficiency
    motors: IntArray  #: (motors, 4) links, kind, first current
    motor_table: Array  #: ratio, efficiency, electrical data by kind
    modes: IntArray  #: (motors, 2) voltage at its limit (-1, 0, 1), power flow (1 drives); changed in place
    friction: IntArray  #: (frictions, 4) first row, rows, a, b
    friction_table: Array  #: kinetic, static, Stribeck speed, smoothing velocity, radius, length, sense of sliding
    size: float  #: characteristic length


class RowInfo(NamedTuple):
    """What a constraint row belongs to: its name, whether it is an angle, and the joint (index into ``joints``)."""

    name: str
    angular: bool
    joint: int


@dataclass(frozen=True, eq=False)
class Compiled:
    """Tables and what they mean.

    ``joints`` are all constraint objects in the order of their rows (graph joints, additional ones, prescribed
    drivers), ``first`` the first row of each, ``centres`` (links, 2) the centres of mass, ``laws`` the motion laws by
    driver slot, ``applied`` the loads given as functions.
    """

    model: DynamicModel
    tables: Tables
    info: tuple[RowInfo, ...]
    joints: tuple[Any, ...]
    first: tuple[int, ...]
    centres: Array
    laws: tuple[Callable[[Array], tuple[Array, Array, Array]], ...]
    applied: tuple[Force | Torque | TorqueSource, ...]
    #: Values at which further coordinates are held, after those of the laws: joints that stick.
    held: tuple[float, ...] = ()

    @property
    def links(self) -> int:
        """Number of links, the frame included."""
        return self.model.mechanism.graph.links

    @property
    def moving(self) -> list[int]:
        """Moving links, ascending."""
        return list(self.model.bodies)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return 3 * len(self.model.bodies)

    @cached_property
    def unit(self) -> Array:
        """Unit of every coordinate: the characteristic length, or 1 for angles."""
        return np.tile([self.tables.size, self.tables.size, 1.0], self.n // 3)

    @cached_property
    def row_unit(self) -> Array:
        """Unit of every row: the characteristic length, or 1 for angles."""
        return np.array([1.0 if info.angular else self.tables.size for info in self.info])

    def _carried(self, sense: float, *parts: Array) -> list[Array]:
        """Places, velocities, accelerations (as many as given) of centres from those of frames (+1), or back (-1)."""
        arm = sense * np.exp(1j * parts[0][..., 2]) * (self.centres[self.moving] @ [1.0, 1j])
        turns = [part[..., 2] for part in parts[1:]]
        arms = [arm, *(1j * turn * arm for turn in turns)]
        if len(turns) > 1:
            arms[2] -= turns[0] ** 2 * arm
        return [np.stack([p[..., 0] + r.real, p[..., 1] + r.imag, p[..., 2]], axis=-1) for p, r in zip(parts, arms)]

    def to_coordinates(self, poses: ArrayLike) -> Array:
        """Coordinates of the centres of mass, shape (..., n), from link poses (..., links, 3)."""
        pose = np.asarray(poses, dtype=np.float64)[..., self.moving, :]
        return self._carried(1.0, pose)[0].reshape(*pose.shape[:-2], self.n)

    def to_rates(self, q: ArrayLike, *rates: ArrayLike) -> Array:
        """Velocities of the centres of mass (..., n) from link velocities (..., links, 3); with both, accelerations."""
        parts = [np.asarray(part, dtype=np.float64)[..., self.moving, :] for part in rates]
        shape = parts[0].shape
        found = self._carried(1.0, np.asarray(q, dtype=np.float64).reshape(shape), *parts)
        return found[-1].reshape(*shape[:-2], self.n)

    def to_links(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> tuple[Array, Array, Array]:
        """Poses, velocities and accelerations of the link frames, each (..., links, 3)."""
        shape = np.shape(q)[:-1]
        parts = [np.asarray(part, dtype=np.float64).reshape(*shape, -1, 3) for part in (q, v, a)]
        found = np.zeros((3, *shape, self.links, 3))
        for target, part in zip(found, self._carried(-1.0, *parts)):
            target[..., self.moving, :] = part
        return found[0], found[1], found[2]

    @cached_property
    def drives(self) -> tuple[MotorDrive, ...]:
        """Motors, in the order of the elements."""
        return tuple(e for e in self.model.elements if isinstance(e, MotorDrive))

    @cached_property
    def currents(self) -> Array:
        """Currents of all motors at the start."""
        return np.array([part for drive in self.drives for part in drive.currents])

    @property
    def tail(self) -> Array:
        """Start of what stands in every state behind the motion: currents, their energy, work."""
        count = len(self.currents)
        return np.concatenate([self.currents, np.zeros(2 if count else 1)])

    def currents_of(self, y: Array) -> Array:
        """Currents in a state of any form."""
        count = len(self.currents)
        return np.asarray(y[len(y) - count - 2 : len(y) - 2] if count else y[:0])

    def with_modes(self, modes: IntArray) -> Compiled:
        """Return the same with modes of the motors of its own."""
        return replace(self, tables=self.tables._replace(modes=modes.copy())) if self.drives else self

    @property
    def spread(self) -> float:
        """Largest mass over the smallest, inertias taken by the characteristic length; infinite without mass."""
        sizes = np.diag(self.tables.mass) * (self.unit / self.tables.size) ** 2
        return float(sizes.max() / sizes.min()) if sizes.min() > 0.0 else math.inf

    @property
    def spread_words(self) -> str:
        """What to say where masses are too far apart."""
        return (
            f"masses and inertias differ by a factor of {self.spread:.1g}, too much for double precision; leave out "
            "what hardly weighs, or use form='one-coordinate'"
        )

    @cached_property
    def _still(self) -> Array:
        """Prescribed coordinates besides those that follow a law, shape (1, drivers, 3); at least one row."""
        count = len(self.laws)
        found = np.zeros((1, max(1, count + len(self.held)), 3))
        found[:, count : count + len(self.held), 0] = self.held
        return found

    def with_held(self, rows: Sequence[Row], info: Sequence[tuple[str, int]], held: Iterable[float]) -> Compiled:
        """Return the same with coordinates held at values; of every row its name and joint."""
        T = self.tables
        ints, table = _stacked(rows, T.table.shape[1])
        slots = np.concatenate([T.slots, np.full(len(rows), -1, dtype=np.int64)])
        tables = T._replace(rows=np.vstack([T.rows, ints]), table=np.vstack([T.table, table]), slots=slots)
        more = (RowInfo(name, row[0] in _ANGULAR, joint) for (name, joint), row in zip(info, rows))
        return replace(self, tables=tables, info=(*self.info, *more), held=tuple(float(x) for x in held))

    def driven(self, t: float) -> Array:
        """Prescribed coordinates and their two derivatives, shape (drivers, 3); at least one row."""
        return np.asarray(self.driven_at(np.array([t]))[0])

    def driven_at(self, times: Array) -> Array:
        """Return `driven` at several times, shape (times, drivers, 3); one for all if nothing depends on time."""
        if not self.laws:
            return self._still
        found = np.repeat(self._still, len(times), axis=0)
        for k, law in enumerate(self.laws):
            for c, part in enumerate(law(times)):
                found[:, k, c] = part
        return found


class _Remembered:
    """A motion law that keeps its last single values: the same time is asked for several times in a row."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._last: tuple[float, tuple[Array, Array, Array]] = (math.nan, (np.empty(0),) * 3)

    def __call__(self, times: Array) -> tuple[Array, Array, Array]:
        if len(times) > 1:
            return coordinates(self._driver, times)
        if self._last[0] != times[0]:
            self._last = float(times[0]), coordinates(self._driver, times)
        return self._last[1]


def compile_model(model: DynamicModel) -> Compiled:
    """Compile a model."""
    if not isinstance(model, DynamicModel):
        raise GeometryError(f"model = {model!r} is not a DynamicModel; build one from a mechanism and its bodies")
    mechanism = model.mechanism
    links = mechanism.graph.links
    centres = np.zeros((links, 2))
    for link, body in model.bodies.items():
        centres[link] = body.centre
    joints: list[Any] = [*mechanism.joints, *model.additional, *model.prescribed]
    rows, table, slots, info, first = _constraints(model, joints, centres)
    column = np.full(links, -1, dtype=np.int64)
    column[list(model.bodies)] = 3 * np.arange(len(model.bodies))
    mass = _mass_matrix(model, column)
    diagonal = not (mass - np.diag(np.diag(mass))).any()
    lower: Array = np.zeros((0, 0)) if model.massless else np.asarray(np.linalg.cholesky(mass), dtype=np.float64)
    springs, torsions, forces, sources = _loads(model, centres)
    motors, motor_table, modes = _motors(model)
    rubbing, gravity = _frictions(model, joints, first), np.array(model.gravity)
    loads: list[Any] = [*springs, *torsions, *forces, *sources, motors, motor_table, modes, *rubbing, _size(model)]
    tables = Tables(column, rows, table, slots, mass, lower, diagonal, gravity, *loads)
    loaded = (e for e in model.elements if isinstance(e, Force | Torque | TorqueSource))
    applied = (e for e in loaded if callable(e.force if isinstance(e, Force) else e.torque))
    laws = tuple(_Remembered(driver) for driver in model.prescribed)
    return Compiled(model, tables, tuple(info), tuple(joints), tuple(first), centres, laws, tuple(applied))


def _size(model: DynamicModel) -> float:
    """Return the largest distance of joint points and centre of mass on a link; else a radius of gyration."""
    points: dict[int, list[complex]] = {link: [complex(*body.centre)] for link, body in model.bodies.items()}
    for joint in model.mechanism.joints:
        points.setdefault(joint.a, []).append(complex(*joint.at_a))
        points.setdefault(joint.b, []).append(complex(*joint.at_b))
    size = max(abs(p - q) for found in points.values() for p in found for q in found)
    if size > 0.0:
        return size
    return max((math.sqrt(b.inertia / b.mass) for b in model.bodies.values() if b.mass > 0.0), default=0.0) or 1.0


def _shifted(at: tuple[float, float], centre: Array) -> tuple[float, float]:
    return at[0] - float(centre[0]), at[1] - float(centre[1])


def _constraints(
    model: DynamicModel, joints: list[Any], centres: Array
) -> tuple[IntArray, Array, IntArray, list[RowInfo], list[int]]:
    found: list[Row] = []
    info: list[RowInfo] = []
    first: list[int] = []
    slots: list[int] = []
    for index, joint in enumerate(joints):
        first.append(len(found))
        if isinstance(joint, Driver):
            own = [driver_row(model, joint, centres, len(first) - 1 - len(joints) + len(model.prescribed))]
        else:
            own = joint_rows(_moved(joint, centres))
        for kind, a, b, parameters in own:
            slots.append(sum(slot >= 0 for slot in slots) if kind in (codes.GEAR, RACK) else -1)
            number = index - len(model.mechanism.joints)
            more = f"additional {number + 1}: " if 0 <= number < len(model.additional) else ""
            info.append(RowInfo(more + _row_name(kind, joint), kind in _ANGULAR, index))
            found.append((kind, a, b, parameters))
    rows, table = _stacked(found, max([codes.ROW_WIDTH, *(len(row[3]) for row in found)]))
    own_slots = np.array(slots, dtype=np.int64)
    table[:, codes.SLOT] = np.where(own_slots >= 0, own_slots, table[:, codes.SLOT])
    return rows, table, own_slots, info, first


def _stacked(rows: Sequence[Row], width: int) -> tuple[IntArray, Array]:
    """Kinds and links of rows; their parameters."""
    table = np.zeros((len(rows), width))
    for k, row in enumerate(rows):
        table[k, : len(row[3])] = row[3]
    return np.array([row[:3] for row in rows], dtype=np.int64).reshape(-1, 3), table


def _moved(joint: Any, centres: Array) -> Any:
    """Return the joint with its points given from the centres of mass."""
    if isinstance(joint, Rack):
        return replace(joint, centre=_shifted(joint.centre, centres[joint.pinion]))
    return replace(joint, at_a=_shifted(joint.at_a, centres[joint.a]), at_b=_shifted(joint.at_b, centres[joint.b]))


def joint_rows(joint: Any) -> list[Row]:
    """Equations of a joint, in the parameters of the engine's rows."""
    if isinstance(joint, Rack):
        e = [math.cos(joint.angle), math.sin(joint.angle)]
        row = [0.0] * 12
        row[codes.PBX], row[codes.PBY], row[codes.TX], row[codes.TY], row[codes.RA] = *joint.centre, *e, joint.radius
        return [(RACK, joint.rack, joint.pinion, row)]
    own = [joint]
    if isinstance(joint, Rigid):
        ends = joint.a, joint.b, joint.at_a, joint.at_b
        own = [Revolute(*ends), Prismatic(*ends, joint.angle_a, joint.angle_b)]
    rows, table = zip(*(equations([one], np.array([[one.row()]])) for one in own))
    kinds, numbers = np.concatenate(rows)[:, 0].tolist(), np.concatenate(table, axis=1)[0].tolist()
    more = [0.0] if isinstance(joint, Cam) else []
    found = [(kind, joint.a, joint.b, [*row, *more]) for kind, row in zip(kinds, numbers)]
    return [*found[:2], *found[3:]] if isinstance(joint, Rigid) else found


def driver_row(model: DynamicModel, driver: Driver, centres: Array, slot: int) -> Row:
    """Row that prescribes the coordinate of a joint; of a pin in a slot it is the way along the slot."""
    joint = model.mechanism.joint(*driver.pair)
    sign = 1.0 if driver.base == joint.a else -1.0
    moved = _moved(joint, centres)
    row = [*moved.at_a, *moved.at_b, 1.0, 0.0, *[0.0] * 6]
    row[codes.SIGN], row[codes.SLOT] = sign, float(slot)
    if isinstance(joint, Prismatic | PinSlot):
        row[codes.TX], row[codes.TY] = math.cos(joint.angle_a), math.sin(joint.angle_a)
        return codes.DRIVE_SLIDE, joint.a, joint.b, row
    return codes.DRIVE_ANGLE, joint.a, joint.b, row


def coordinate_row(compiled: Compiled, key: Sequence[Any], slot: int) -> Row:
    """Row that prescribes ``(link, "x" | "y" | "theta")`` or ``(base, link)``; `GeometryError` if it names nothing."""
    model, frame = compiled.model, compiled.model.mechanism.frame
    try:
        one, two = key
    except (TypeError, ValueError) as error:
        raise GeometryError(f"{key!r} names no coordinate; give (link, 'x' | 'y' | 'theta') or (base, link)") from error
    if not isinstance(two, str):
        driver = Driver(one, two)
        joint = model.mechanism.joint(*driver.pair)
        if not isinstance(joint, Revolute | Prismatic):
            raise GeometryError(f"joint {one}-{two} is {joint.kind}; only coordinates of R and P joints can be kept")
        return driver_row(model, driver, compiled.centres, slot)
    if two not in ("x", "y", "theta") or one not in model.bodies:
        raise GeometryError(f"{key!r} names no coordinate; give (moving link, 'x' | 'y' | 'theta')")
    own = (-float(compiled.centres[one, 0]), -float(compiled.centres[one, 1]))
    row = [0.0, 0.0, *own, 0.0, 0.0, *[0.0] * 6]
    row[codes.SIGN], row[codes.SLOT] = 1.0, float(slot)
    row[codes.TX], row[codes.TY] = (1.0, 0.0) if two == "x" else (0.0, 1.0)
    return codes.DRIVE_ANGLE if two == "theta" else codes.DRIVE_SLIDE, frame, one, row


def _row_name(kind: int, joint: Any) -> str:
    if isinstance(joint, Rack):
        return f"rack {joint.rack} - pinion {joint.pinion}"
    if isinstance(joint, Driver):
        return f"prescribed {joint.base}-{joint.link}"
    part = {codes.RX: " x", codes.RY: " y", codes.LINE: " normal", codes.ANGLE: " angle"}.get(kind, "")
    name = "rigid" if isinstance(joint, Rigid) else joint.kind
    return f"{name} {joint.a}-{joint.b}{part}"


def _mass_matrix(model: DynamicModel, column: IntArray) -> Array:
    n = 3 * len(model.bodies)
    mass = np.zeros((n, n))
    for link, body in model.bodies.items():
        k = int(column[link])
        mass[k, k] = mass[k + 1, k + 1] = body.mass
        mass[k + 2, k + 2] = body.inertia
    for element in model.elements:
        source = element.idle if isinstance(element, MotorDrive) else element
        if isinstance(source, TorqueSource) and source.rotor_inertia > 0.0:
            reflected = source.ratio**2 * source.rotor_inertia
            ends = [(int(column[link]) + 2, sign) for link, sign in ((source.a, -1.0), (source.b, 1.0))]
            for i, si in ends:
                for j, sj in ends:
                    if i >= 2 and j >= 2:
                        mass[i, j] += si * sj * reflected
    return mass


def _loads(model: DynamicModel, centres: Array) -> list[tuple[IntArray, Array]]:
    """Springs, torsion springs, forces, torques: links and numbers of each."""
    springs, torsions, forces, sources = [], [], [], []
    for e in (e.idle if isinstance(e, MotorDrive) else e for e in model.elements):
        if isinstance(e, Spring):
            ends = (*_shifted(e.at_a, centres[e.a]), *_shifted(e.at_b, centres[e.b]))
            springs.append(((e.a, e.b), (*ends, e.stiffness, e.free_length, e.damping)))
        elif isinstance(e, TorsionSpring):
            torsions.append(((e.a, e.b), (e.stiffness, e.free_angle, e.damping)))
        elif isinstance(e, Force) and not callable(e.force):
            place = _shifted(e.at, centres[e.link])
            forces.append(((e.link, int(e.frame == "body")), (*place, *e.force)))
        elif isinstance(e, Torque) and not callable(e.torque):
            sources.append(((e.a, e.b), (e.torque, 1.0)))
        elif isinstance(e, TorqueSource):
            if not callable(e.torque):
                sources.append(((e.a, e.b), (e.ratio * e.torque, e.efficiency)))
            torsions.append(((e.a, e.b), (0.0, 0.0, e.ratio**2 * e.rotor_damping)))
    kinds: list[tuple[list[Any], int]] = [(springs, 7), (torsions, 3), (forces, 4), (sources, 2)]
    return [
        (
            np.array([item[0] for item in items], dtype=np.int64).reshape(-1, 2),
            np.array([item[1] for item in items], dtype=np.float64).reshape(-1, width),
        )
        for items, width in kinds
    ]


def _motors(model: DynamicModel) -> tuple[IntArray, Array, IntArray]:
    """Links, kind and first current of every motor; its numbers; its modes, which a run sets."""
    drives = [e for e in model.elements if isinstance(e, MotorDrive)]
    ints, table, first = np.zeros((len(drives), 4), dtype=np.int64), np.zeros((len(drives), 9)), 0
    for k, e in enumerate(drives):
        kind, numbers = electric(e.equation)
        ints[k] = e.a, e.b, kind, first
        table[k, : 2 + len(numbers)] = e.train.ratio, e.train.efficiency, *numbers
        first += len(e.currents)
    return ints, table, np.tile(np.array([0, 1]), (len(drives), 1)).astype(np.int64)


def _frictions(model: DynamicModel, joints: list[Any], first: list[int]) -> tuple[IntArray, Array]:
    ints, floats = [], []
    for e in model.elements:
        if not isinstance(e, JointFriction):
            continue
        pair = (min(e.a, e.b), max(e.a, e.b))
        index = next(k for k, joint in enumerate(model.mechanism.joints) if joint.pair == pair)
        joint = joints[index]
        ints.append([first[index], 2 if isinstance(joint, Revolute) else 1, joint.a, joint.b])
        stribeck = e.stribeck_speed if math.isfinite(e.stribeck_speed) else 1e300
        floats.append([e.kinetic, e.static, stribeck, e.smoothing_velocity, e.radius, e.length, BY_SPEED])
    table = np.array(floats, dtype=np.float64).reshape(-1, 7)
    return np.array(ints, dtype=np.int64).reshape(-1, 4), table
