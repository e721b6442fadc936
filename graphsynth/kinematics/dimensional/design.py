"""What a search for dimensions varies: places of the joints at the first input, directions of slides, slots and cams.

Every link's own frame coincides with the fixed one at the first input, so the places are the coordinates of each joint
on both of its links and the mechanism is assembled there by construction.  A gear pair has no place of its own: its
centres are the revolute joints of both wheels with a third link, its carrier.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.mechanism.joints import COLUMNS, Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
_A, _B = [COLUMNS.index("ax"), COLUMNS.index("ay")], [COLUMNS.index("bx"), COLUMNS.index("by")]
_ANGLE_A, _ANGLE_B = COLUMNS.index("a_angle"), COLUMNS.index("b_angle")
_RADIUS_A, _RADIUS_B = COLUMNS.index("radius_a"), COLUMNS.index("radius_b")
_SIGN, _OFFSET = COLUMNS.index("sign"), COLUMNS.index("offset")


#: Kinds by mobility; a gear may name its teeth as in "gear 2:1" and "gear 1:-3" (the second wheel is internal), a cam
#: its profile as in "cam 0.2:0 0:0.05": cosines and sines of 1, 2, ... times the polar angle, over the mean radius.
KINDS = {1: ("R", "P"), 2: ("gear", "pin-slot", "cam")}
_TEETH = re.compile(r"gear(?: ([1-9]\d*):(-?[1-9]\d*))?")


def teeth(kind: str) -> tuple[int, int] | None:
    """Teeth of a gear pair's wheels, the second negative if internal; None for other kinds.

    >>> teeth("gear"), teeth("gear 1:-3"), teeth("pin-slot")
    ((1, 1), (1, -3), None)
    """
    found = _TEETH.fullmatch(kind)
    if found is None or found[1] == str(found[2])[1:]:  # an internal pair of equal wheels has one centre
        return None
    return (int(found[1] or 1), int(found[2] or 1))


def profile(kind: str) -> tuple[tuple[float, float], ...] | None:
    """Harmonics of a cam over its mean radius, none if it is circular; None for other kinds.

    `GeometryError` for a cam whose radius is not positive everywhere, or that is no list of pairs.

    >>> profile("cam"), profile("cam 0.2:0 0:-0.05"), profile("R")
    ((), ((0.2, 0.0), (0.0, -0.05)), None)
    """
    name, *pairs = kind.split(" ")
    if name != "cam":
        return None
    try:
        found = tuple((float(c), float(s)) for c, s in (pair.split(":") for pair in pairs))
    except ValueError:
        raise GeometryError(f"{kind!r} is no cam; give its harmonics as in 'cam 0.2:0 0:0.05'") from None
    return Cam(0, 1, harmonics=found).harmonics


@dataclass(frozen=True)
class Design:
    """A mechanism graph with a frame, drivers (base, link) and kinds of joints: all but the numbers.

    A kind is "R", "P", "pin-slot", "cam" (circular, or with a profile) or "gear", in the order of ``graph.joints``.
    ``symmetry``, if any, is the image of every link under an automorphism that keeps the frame: at the first input the
    mechanism has it too, as a rotation or, if ``mirrored``, a reflection.  Cams with a profile have the mean radius 1:
    it is the rest that is larger or smaller.
    """

    graph: MechanismGraph
    drivers: tuple[tuple[int, int], ...]
    kinds: tuple[str, ...]
    symmetry: tuple[int, ...] = ()
    mirrored: bool = False

    @cached_property
    def dyadic(self) -> bool:
        """Whether no structural group is larger than a dyad."""
        return decompose(self.graph, self.drivers).dyadic

    @cached_property
    def numbers(self) -> tuple[tuple[int, str], ...]:
        """Joints with numbers besides their place: a direction, "angle"; of cams one more.

        That is the logarithm of a circular cam's radius, "size", or where a profile is touched at first, "phase".
        """
        directed = [k for k, kind in enumerate(self.kinds) if kind in ("P", "pin-slot") or k in self.profiles]
        cams = ((k, "phase" if harmonics else "size") for k, harmonics in self.profiles.items())
        return (*((k, "angle") for k in directed), *cams)

    @cached_property
    def profiles(self) -> dict[int, tuple[tuple[float, float], ...]]:
        """Of every cam its harmonics over its mean radius, none of a circular one."""
        found = ((k, profile(kind)) for k, kind in enumerate(self.kinds))
        return {k: harmonics for k, harmonics in found if harmonics is not None}

    @cached_property
    def held(self) -> tuple[int, ...]:
        """Joints that the search leaves where they are: of `fixed` one, if a cam's profile has a size."""
        return self.fixed[:1] if any(self.profiles.values()) else self.fixed

    @cached_property
    def centres(self) -> dict[int, tuple[int, int]]:
        """Of every gear pair the joints in which its wheels turn against their carrier."""
        return {k: _centres(self.graph, self.kinds, k) for k, kind in enumerate(self.kinds) if teeth(kind)}

    @cached_property
    def driver_joints(self) -> tuple[int, ...]:
        """Indices of the driven joints."""
        pairs = {(min(d), max(d)) for d in self.drivers}
        return tuple(k for k, joint in enumerate(self.graph.joints) if (joint.a, joint.b) in pairs)

    @cached_property
    def sides(self) -> NDArray[np.intp]:
        """Pairs of joints whose distance is a length of a link, shape (sides, 2).

        Slides have no place on a link, and neither have slots and cams: only pins and rollers have one.
        """
        found = []
        for link in range(self.graph.links):
            own = [
                k
                for k in self.joints_of(link)
                if self.kinds[k] == "R"
                or (self.graph.joints[k].b == link and (self.kinds[k] == "pin-slot" or k in self.profiles))
            ]
            found += [(p, q) for i, p in enumerate(own) for q in own[i + 1 :]]
        return np.array(found, dtype=np.intp).reshape(-1, 2)

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Two joints that stay where they are, so that the whole is not moved, turned or scaled: on the frame."""
        assert self.graph.frame is not None
        own = self.joints_of(self.graph.frame)
        first = [k for k in own if k in self.driver_joints]
        return tuple((first + [k for k in own if k not in first])[:2])

    @cached_property
    def orbits(self) -> list[list[int]]:
        """Joints that the symmetry carries into each other, each the image of the one before; those fixed come first.

        `GeometryError` where an image is another kind of joint, or its slot or cam is on the other side.
        """
        pairs = {(joint.a, joint.b): k for k, joint in enumerate(self.graph.joints)}
        left, found = dict.fromkeys([*self.fixed, *range(len(pairs))]), []
        while left and self.symmetry:
            orbit = [next(iter(left))]
            while orbit[-1] in left:
                k = orbit[-1]
                del left[k]
                a, b = (self.symmetry[link] for link in self.graph.joints[k][:2])
                image = pairs.get((min(a, b), max(a, b)), -1)
                one_sided = (self.kinds[k] == "pin-slot" or k in self.profiles) and a > b
                if image < 0 or one_sided or self.kinds[k] != self.kinds[image]:
                    raise GeometryError(f"joint {self.graph.joints[k][:2]} has no image of its kind; choose its kind")
                orbit.append(image)
            found.append(orbit[:-1])
        return found

    def symmetric(self, places: Array, numbers: Array) -> tuple[Array, Array]:
        """Return places and numbers in which every orbit follows its first joint, turned about the centre.

        The centre is the first fixed joint if it stays in place, else the middle of the places.
        """
        if not self.symmetry:
            return places, numbers
        whole = max(map(len, self.orbits))
        places, numbers = places.copy(), numbers.copy()
        still = [orbit[0] for orbit in self.orbits if len(orbit) == 1]
        z = places @ [1.0, 1.0j]
        centre = z[:, self.fixed[:1]] if self.fixed[0] in still else z.mean(axis=1, keepdims=True)
        for orbit in self.orbits:
            turns = np.arange(len(orbit)) * math.tau / whole
            at = centre + (z[:, orbit[:1]] - centre) * np.exp(1j * turns) if len(orbit) > 1 else centre
            places[:, orbit] = np.stack([at.real, at.imag], axis=-1)
            for column, (k, name) in enumerate(self.numbers):
                if k in orbit:
                    first = self.numbers.index((orbit[0], name))
                    numbers[:, column] = numbers[:, first] + (turns[orbit.index(k)] if name == "angle" else 0.0)
        return places, numbers

    @cached_property
    def cranks(self) -> tuple[tuple[int, list[int]], ...]:
        """Revolute joints on the frame of the driven links and of wheels they drive, each with its link's joints."""
        frame, own = self.graph.frame, {*self.driver_joints}
        driven = {link for base, link in self.drivers if base == frame}
        for _ in self.centres:  # as far as gears carry the rotation on
            for (p, q), k in ((centres, k) for k, centres in self.centres.items()):
                a, b, _ = self.graph.joints[k]
                on_frame = frame in self.graph.joints[p][:2] and frame in self.graph.joints[q][:2]
                if on_frame and driven & {a, b}:
                    driven, own = driven | {a, b}, own | {p, q}
        found = []
        for k in sorted(own):
            a, b, _ = self.graph.joints[k]
            if self.kinds[k] == "R" and frame in (a, b):
                found.append((k, self.joints_of(b if a == frame else a)))
        return tuple(found)

    def with_cranks(self, places: Array, sizes: Array) -> Array:
        """Return places (sets, joints, 2) with the links of `cranks` larger or smaller by factors (cranks, sets)."""
        places = places.copy()
        for (joint, own), size in zip(self.cranks, sizes, strict=True):
            for k in {*own} - {joint}:
                places[:, k] = places[:, joint] + size[:, None] * (places[:, k] - places[:, joint])
        return places

    def joints_of(self, link: int) -> list[int]:
        """Return the indices of the joints of a link that have a place: all but gears."""
        joints = enumerate(self.graph.joints)
        return [k for k, joint in joints if link in (joint.a, joint.b) and not teeth(self.kinds[k])]

    def dimensions(self, places: Array, numbers: Array) -> Array:
        """Dimension sets, shape (sets, joints, 10), of places (sets, joints, 2) and further numbers (sets, numbers)."""
        table = np.zeros((*places.shape[:2], len(COLUMNS)))
        table[:, :, _A] = table[:, :, _B] = places
        for column, (k, name) in enumerate(self.numbers):
            if name == "angle":
                table[:, k, _ANGLE_A] = table[:, k, _ANGLE_B] = numbers[:, column]
                continue
            # a cam's centre lies in the direction of the angle from the roller
            angle, radius = table[:, k, _ANGLE_A], np.exp(numbers[:, column])
            table[:, k, _RADIUS_A] = radius if name == "size" else 1.0
            if name == "phase":
                radius, _ = _pitch(self.profiles[k], numbers[:, column])
            table[:, k, _A] += radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            if name == "phase":
                table[:, k, _ANGLE_A] += math.pi - numbers[:, column]
        for k, (p, q) in self.centres.items():
            table[:, k, _A], table[:, k, _B] = places[:, p], places[:, q]
            way = places[:, q] - places[:, p]
            first, second = teeth(self.kinds[k]) or (1, 1)
            both = np.hypot(way[:, 0], way[:, 1]) / abs(first + second)
            table[:, k, _RADIUS_A], table[:, k, _RADIUS_B] = first * both, abs(second) * both
            table[:, k, _SIGN] = math.copysign(1.0, second)
            table[:, k, _OFFSET] = -(first + second) / second * np.arctan2(way[:, 1], way[:, 0])
        return table

    def pulled(self, by: Array, places: Array, numbers: Array) -> Array:
        """Return derivatives by places and numbers from those by dimensions: `dimensions` in reverse.

        ``by`` (sets, directions, joints, 10, n), as of `pose_gradients`; result (sets, directions, n, 2 joints +
        numbers).
        """
        by = np.moveaxis(by, -1, 2)  # samples before joints
        found = by[..., _A] + by[..., _B]
        more = np.zeros((*by.shape[:3], len(self.numbers)))
        for column, (k, name) in enumerate(self.numbers):
            if name == "angle":
                more[..., column] = by[..., k, _ANGLE_A] + by[..., k, _ANGLE_B]
                continue
            angle = self.numbers.index((k, "angle"))
            turn, at_a = numbers[:, angle], by[..., k, :][..., _A]
            if name == "size":
                radius = slope = np.exp(numbers[:, column])
                own = by[..., k, _RADIUS_A] * radius[:, None, None]
            else:
                radius, slope = _pitch(self.profiles[k], numbers[:, column])
                own = -by[..., k, _ANGLE_A]
            across = radius[:, None] * np.stack([-np.sin(turn), np.cos(turn)], axis=1)
            along = slope[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            more[..., angle] += (at_a * across[:, None, None]).sum(axis=-1)
            more[..., column] = (at_a * along[:, None, None]).sum(axis=-1) + own
        for k, (p, q) in self.centres.items():
            way = places[:, q] - places[:, p]
            first, second = teeth(self.kinds[k]) or (1, 1)
            turn = np.stack([-way[:, 1], way[:, 0]], axis=1) / (way**2).sum(axis=1)[:, None]
            offset = -(first + second) / second * by[..., k, _OFFSET, None] * turn[:, None, None]
            found[..., p, :] += by[..., k, :][..., _A] - offset
            found[..., q, :] += by[..., k, :][..., _B] + offset
            found[..., k, :] = 0.0
        return np.concatenate([found.reshape(*found.shape[:3], -1), more], axis=-1)

    def mechanism(self, places: Array, numbers: Array) -> Mechanism:
        """Return the mechanism of one set, places (joints, 2) and numbers, posed at the first input."""
        at = [World.read(row) for row in self.dimensions(places[None], numbers[None])[0]]
        drivers = tuple(Driver(*pair) for pair in self.drivers)
        rest = [(0j, 0.0)] * self.graph.links
        return Mechanism(self.graph, self.joints(at, rest), drivers, pose=((0.0, 0.0, 0.0),) * self.graph.links)

    def joints(self, at: Sequence[World], frames: Sequence[tuple[complex, float]]) -> tuple[JointGeometry, ...]:
        """Return the joints that lie at some places when the links are posed in ``frames``, origins and angles."""
        every = zip(self.graph.joints, self.kinds, at, strict=True)
        return tuple(_made(kind, a, b, own, (frames[a], frames[b])) for (a, b, _), kind, own in every)


class World(NamedTuple):
    """Where a joint lies: its point on link a and on link b, its direction, radii; one frame for all links."""

    A: complex
    B: complex
    direction: float
    radii: tuple[float, float]

    @classmethod
    def read(cls, row: Array) -> World:
        """Of a row of dimensions, with all links' frames in the fixed one."""
        radii = float(row[_RADIUS_A]), float(row[_RADIUS_B])
        return cls(complex(*row[_A]), complex(*row[_B]), float(row[_ANGLE_A]), radii)


def _made(
    kind: str, a: int, b: int, at: World, frames: tuple[tuple[complex, float], tuple[complex, float]]
) -> JointGeometry:
    (first, turn_a), (second, turn_b) = frames
    on_a, on_b = (at.A - first) * cmath.exp(-1j * turn_a), (at.B - second) * cmath.exp(-1j * turn_b)
    places = (a, b, (on_a.real, on_a.imag), (on_b.real, on_b.imag))
    along = at.direction - turn_a
    if kind == "R":
        return Revolute(*places)
    if kind == "P":
        return Prismatic(*places, along, at.direction - turn_b)
    if kind == "pin-slot":
        return PinSlot(*places, along)
    if (harmonics := profile(kind)) is not None:
        size = at.radii[0]
        return Cam(*places, along, size, tuple((size * c, size * s) for c, s in harmonics))
    phi, (r_a, r_b), internal = cmath.phase(at.B - at.A), at.radii, (teeth(kind) or (1, 1))[1] < 0
    return Gear(*places, r_a, r_b, internal, turn_b - phi + (turn_a - phi) * r_a / (-r_b if internal else r_b))


def _centres(graph: MechanismGraph, kinds: Sequence[str], gear: int) -> tuple[int, int]:
    """Joints of both wheels of a gear pair with their carrier, the frame if it can be; -1 if they have none."""
    a, b, _ = graph.joints[gear]
    turns: tuple[dict[int, int], dict[int, int]] = ({}, {})
    for k, joint in enumerate(graph.joints):
        for wheel, own in zip((a, b), turns):
            if kinds[k] == "R" and wheel in (joint.a, joint.b):
                own[joint.b if joint.a == wheel else joint.a] = k
    common = sorted(turns[0].keys() & turns[1].keys(), key=lambda link: (link != graph.frame, link))
    return (turns[0][common[0]], turns[1][common[0]]) if common else (-1, -1)


def _pitch(harmonics: Sequence[tuple[float, float]], psi: Array) -> tuple[Array, Array]:
    """Radius of a profile over its mean radius, and its derivative by the polar angle."""
    k, (c, s) = np.arange(1, len(harmonics) + 1), np.array(harmonics).T
    even, odd = np.cos(psi[:, None] * k), np.sin(psi[:, None] * k)
    return 1.0 + even @ c + odd @ s, even @ (k * s) - odd @ (k * c)


def check_rule(rule: str) -> None:
    """Refuse a rule that is no kind of mobility 2; an empty one is none."""
    if rule and rule not in KINDS[2] and not teeth(rule) and not profile(rule):
        raise GeometryError(f"pairs = {rule!r} is no kind of mobility 2; use one of {KINDS[2]}, or 'gear 2:1'")


def joint_kinds(graph: MechanismGraph, given: Mapping[tuple[int, int], str], rule: str = "") -> tuple[str, ...]:
    """Kinds of all joints: as given, else revolute; of mobility 2 as ``rule`` says.

    By default gears where both links turn on a third, else pins in slots; so it is where a gear cannot be.
    `GeometryError` for a kind that a joint cannot be, or a joint that the graph has not.
    """
    check_rule(rule)
    own = {}
    for (a, b), kind in given.items():
        wheels = teeth(kind)
        if a > b and wheels is not None:  # the wheels are named in the other order
            kind = f"gear {abs(wheels[1])}:{wheels[0] if wheels[1] > 0 else -wheels[0]}"
        own[min(a, b), max(a, b)] = kind
    pairs = [(joint.a, joint.b) for joint in graph.joints]
    if unknown := own.keys() - set(pairs):
        raise GeometryError(f"joints names {min(unknown)}, but the graph has no such joint")
    kinds = [own.get(pair, "R" if graph.joints[k].mobility == 1 else "") for k, pair in enumerate(pairs)]
    for k, (a, b, mobility) in enumerate(graph.joints):
        allowed = KINDS.get(mobility, ())
        carried = _centres(graph, kinds, k) != (-1, -1)
        if not kinds[k] and mobility == 2:
            wanted = rule or "gear"
            kinds[k] = wanted if carried or not teeth(wanted) else "pin-slot"
        if kinds[k] not in allowed and not (mobility == 2 and (teeth(kinds[k]) or profile(kinds[k]))):
            raise GeometryError(
                f"joint {a}-{b} has mobility {mobility} and cannot be {kinds[k]!r}; use one of {allowed}"
                + (", as in 'gear 2:1', 'gear 1:-3' or 'cam 0.2:0 0:0.05'" if mobility == 2 else "")
            )
        if teeth(kinds[k]) and not carried:
            raise GeometryError(
                f"joint {a}-{b} cannot be a gear pair: no third link carries both wheels on revolute joints"
            )
    return tuple(kinds)


# --- which link is fixed and which is driven, when the graph leaves it open


#: A driver is a link on the frame, or (base, link).
Drivers = int | tuple[int, int] | Iterable[int | tuple[int, int]]


def choices(graph: MechanismGraph, driver: Drivers | None) -> list[tuple[MechanismGraph, tuple[tuple[int, int], ...]]]:
    """Frames and drivers to try, best first.

    Driven are joints of mobility 1 on the frame; others only where these do not move the mechanism.  The order:
    smallest largest group first (dyads before larger groups), then the lowest class, then driven links with the fewest
    joints, then inversions in their canonical order and links by number.

    `GraphError` for a driver of a chain without a frame, drivers that do not fit, a graph that no choice can drive.

    >>> chain = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])
    >>> [drivers for _, drivers in choices(chain, None)]
    [((0, 1),), ((0, 3),)]
    """
    if graph.mobility < 1:
        raise GraphError(f"mobility {graph.mobility}: nothing moves; embodiment needs mobility 1 or more")
    if driver is not None:
        return [_given(graph, driver)]
    frames = [graph] if graph.frame is not None else graph.inversions()
    found = _driven(frames, on_frame=True) or _driven(frames, on_frame=False)
    if not found:
        raise GraphError(
            f"driving {graph.mobility} of its joints of mobility 1, whichever they are, does not move this graph"
        )
    return [(inversion, pairs) for _, inversion, pairs in sorted(found, key=lambda item: item[0])]


def _driven(frames: Iterable[MechanismGraph], on_frame: bool) -> list[tuple[Any, MechanismGraph, Any]]:
    """List the sets of drivers that move a mechanism, each after what orders it."""
    found = []
    for rank, inversion in enumerate(frames):
        frame = inversion.frame
        pins = [(b, a) if b == frame else (a, b) for a, b, mobility in inversion.joints if mobility == 1]
        if on_frame:
            pins = [pair for pair in pins if pair[0] == frame]
        for pairs in combinations(pins, inversion.mobility):
            if find_fault(inversion, pairs) is None:
                groups = decompose(inversion, pairs).groups
                size = max((len(group.links) for group in groups), default=0)
                order = max((group.group_class for group in groups), default=1)
                joints = sum(inversion.degrees[link] for _, link in pairs)
                found.append(((size, order, joints, rank, pairs), inversion, pairs))
    return found


def _is_link(value: Any) -> bool:
    return hasattr(value, "__index__") and not isinstance(value, bool)


def _given(graph: MechanismGraph, driver: Drivers) -> tuple[MechanismGraph, tuple[tuple[int, int], ...]]:
    if graph.frame is None:
        raise GraphError("a driver is given but no frame; choose one with graph.with_frame(link)")
    try:
        listed: list[Any] = [driver] if _is_link(driver) else list(driver)  # type: ignore[arg-type]
    except TypeError as error:
        raise GraphError(f"driver = {driver!r} is neither a link nor (base, link)") from error
    if len(listed) == 2 and graph.mobility == 1 and all(map(_is_link, listed)):
        listed = [tuple(listed)]  # one driver (base, link)
    pairs = []
    for item in listed:
        pair = (graph.frame, item) if _is_link(item) else item
        if not isinstance(pair, tuple | list) or len(pair) != 2 or not all(map(_is_link, pair)):
            raise GraphError(f"driver = {item!r} is neither a link nor (base, link)")
        base, link = int(pair[0]), int(pair[1])
        if base == link:
            raise GraphError(f"driver {base}-{link}: a link cannot be driven against itself; name two jointed links")
        pairs.append((base, link))
    fault = find_fault(graph, pairs)
    if fault is not None:
        raise GraphError(f"these drivers do not move the mechanism: {fault.message}")
    return graph, tuple(pairs)
