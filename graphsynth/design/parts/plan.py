"""Links as rounded sheets: outlines, holes, slots, and the pins through them.

A revolute joint is a pin through all links that meet there.  A prismatic joint is a slot in the link that carries the
line, and two pins of the other link in it; a pin in a slot is one.  Gears and cams are sheets of their own (`wheels`).
Everything here is in millimetres, in the frame of the link.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import positive
from graphsynth.core.errors import GeometryError
from graphsynth.design.parts.outline import Rounded
from graphsynth.design.parts.wheels import Cut, Wheel, pair
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

#: Points of a link nearer than this times its size are one point.
_SAME = 1e-9
#: A pin by default: this part of the largest link or wheel, at most that part of the shortest way between two holes.
_OF_LARGEST, _OF_SHORTEST = 40.0, 4.0
#: Pins by default are made smaller by these factors until the holes fit.
_SMALLER = (1.0, 0.8, 0.64, 0.5, 0.4, 0.32, 0.25)
#: The board of the frame reaches this many walls and bosses beyond its holes.
_BOARD = 2.0


@dataclass(frozen=True)
class PartSizes:
    """Sizes of parts, in millimetres; those not given follow from the pin, and the pin from the mechanism.

    Attributes
    ----------
    thickness : float
        Of the sheet; 0.8 pins by default.
    pin, hole : float
        Diameters; the hole 1.04 pins.
    wall : float
        Material around a hole; 0.8 pins.
    clearance : float
        Least gap between parts of one layer; 0.2 pins.
    washer : float
        Thickness of the washers between neighbouring layers; 0.1 pins.
    """

    thickness: float | None = None
    pin: float | None = None
    hole: float | None = None
    wall: float | None = None
    clearance: float | None = None
    washer: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            if (value := getattr(self, item.name)) is not None:
                object.__setattr__(self, item.name, positive(item.name, value))

    def filled(self, largest: float, shortest: float) -> Sizes:
        """Return all sizes, for the largest link and the shortest way between two holes.

        Raises
        ------
        GeometryError
            A hole smaller than the pin.
        """
        pin = self.pin or _two_digits(min(largest / _OF_LARGEST, shortest / _OF_SHORTEST))
        part = {"thickness": 0.8, "hole": 1.04, "wall": 0.8, "clearance": 0.2, "washer": 0.1}
        own = {name: getattr(self, name) or _two_digits(share * pin, 3) for name, share in part.items()}
        if own["hole"] < pin:
            raise GeometryError(f"hole = {own['hole']:g} is smaller than the pin, {pin:g}; give a larger one")
        return Sizes(pin=pin, **own)


class Sizes(NamedTuple):
    """All sizes, in millimetres; see `PartSizes`."""

    pin: float
    thickness: float
    hole: float
    wall: float
    clearance: float
    washer: float

    @property
    def boss(self) -> float:
        """Radius of a link around a hole."""
        return self.hole / 2.0 + self.wall

    @property
    def spacer(self) -> float:
        """Radius of washers and spacers."""
        return (self.hole + self.wall) / 2.0

    @property
    def pitch(self) -> float:
        """From one layer to the next."""
        return self.thickness + self.washer


class Pin(NamedTuple):
    """A pin: the sheets it goes through with its places, the link that holds it, its place there, and what it is."""

    sheets: tuple[int, ...]
    places: tuple[complex, ...]
    link: int
    at: complex
    kind: str  #: "pin", "shaft" of a motor, "guide" in a slot, or "dowel" that fastens a wheel
    name: str
    passes: tuple[int, ...] = ()  #: sheets in whose slot it moves, without a spacer

    @property
    def title(self) -> str:
        """Its kind and its joints."""
        return f"{self.kind} {self.name}"


class PartsPlan(NamedTuple):
    """Outlines and holes of every sheet, and pins; millimetres, in the frames of the links.

    Sheets have the numbers of their links; the second sheet of a link, if it has one, comes after all links.
    """

    links: tuple[int, ...]  #: of every sheet
    outlines: tuple[Rounded, ...]
    holes: tuple[tuple[Rounded, ...], ...]
    pins: tuple[Pin, ...]
    sizes: Sizes
    wheels: tuple[str, ...] = ()  #: what the sheets are that come after all links and touch others: wheels, cams
    touching: tuple[tuple[int, int], ...] = ()  #: pairs of these

    def label(self, sheet: int) -> str:
        """Return the number of its link, with "b" for a second sheet, "w" (w2, w3) for its wheels."""
        link = self.links[sheet]
        if not self.wheel(sheet):
            return str(link) if sheet == link else f"{link}b"
        before = self.links[self._first : sheet].count(link)
        return f"{link}w{before + 1 if before else ''}"

    def wheel(self, sheet: int) -> str:
        """Say what a wheel, a cam or a roller is; empty for all other sheets."""
        at = sheet - self._first
        return self.wheels[at] if 0 <= at < len(self.wheels) else ""

    def through(self, pin: Pin) -> list[int]:
        """Return the rings through the middle of whose hole a pin goes."""
        rings = (sheet for sheet, own in enumerate(self.holes) if any(isinstance(hole, Cut) for hole in own))
        ends = dict(zip(pin.sheets, pin.places))
        return [k for k in rings if self.links[k] in ends and _near(ends[self.links[k]], self.outlines[k].hull[0])]

    @property
    def _first(self) -> int:
        """First sheet that is no link."""
        return max(self.links) + 1


#: Where ``at_b`` travels along the line of a joint, by its pair, millimetres.
Travel = Mapping[tuple[int, int], tuple[float, float]]


def plan(mechanism: Mechanism, given: PartSizes, unit: float, travel: Travel, pose: NDArray[np.float64]) -> PartsPlan:
    """Return outlines, holes and pins of a mechanism; wheels mesh at a pose (links, 3) in millimetres.

    If the pin is not given, it is made smaller where holes would be too near to each other.  If that does not help,
    guides of a cylinder are moved along its axis.
    """
    told = ""
    for free in (False, True):
        for smaller in _SMALLER if given.pin is None else _SMALLER[:1]:
            found, near = _planned(mechanism, given, unit, travel, pose, (smaller, free))
            if not near:
                return found
            told = told or near
    raise GeometryError(f"{told}; make the pin or the wall smaller, or the unit larger")


def _planned(
    mechanism: Mechanism,
    given: PartSizes,
    unit: float,
    travel: Travel,
    pose: NDArray[np.float64],
    tried: tuple[float, bool],
) -> tuple[PartsPlan, str]:
    """Return the plan and which holes are too near; tried: the pin so much smaller, guides of cylinders moved."""
    smaller, free = tried
    meeting = _meeting(mechanism, unit)
    traced = [(link, complex(*at) * unit) for link, at in mechanism.points.values() if link != mechanism.frame]
    largest, shortest = _ways(mechanism, meeting, traced, unit)
    sizes = given.filled(largest * smaller, shortest * smaller)
    links = range(mechanism.graph.links)
    places: list[list[complex]] = [[] for _ in links]
    holes: list[list[tuple[Rounded, str]]] = [[] for _ in links]
    pins: list[Pin] = []
    for places_of, name in meeting:
        driver = next((d for d in mechanism.drivers if {d.base, d.link} <= set(places_of)), None)
        shaft = (
            driver is not None
            and mechanism.joint(*driver.pair).kind == "R"
            and _on(mechanism, driver.pair, places_of, unit)
        )
        holder = (
            driver.link if shaft and driver else mechanism.frame if mechanism.frame in places_of else min(places_of)
        )
        own = tuple(sorted(places_of))
        there = tuple(places_of[link] for link in own)
        pins.append(Pin(own, there, holder, places_of[holder], "shaft" if shaft else "pin", name))
        for link, at in places_of.items():
            places[link].append(at)
            holes[link].append((Rounded((at,), (sizes.pin if link == holder else sizes.hole) / 2.0), name))
    for joint in mechanism.joints:
        if not isinstance(joint, Prismatic | PinSlot):
            continue
        name, reach, (low, high) = f"{joint.a}-{joint.b}", 0.0, travel[joint.pair]
        A, B = complex(*joint.at_a) * unit, complex(*joint.at_b) * unit
        along, guides = cmath.exp(1j * joint.angle_a), [B]
        if isinstance(joint, Prismatic):
            reach = 2.0 * sizes.boss
            way = cmath.exp(1j * joint.angle_b)
            both = (places[joint.a], places[joint.b])
            driven = any({d.base, d.link} == {joint.a, joint.b} for d in mechanism.drivers)
            shift = _guides_at(A, along, B, way, (low, high), both, sizes) if free and driven else 0.0
            B, low, high = B + shift * way, low + shift, high + shift
            guides = [B - reach * way, B + reach * way]
        for k, pin in enumerate(pins):  # what is jointed to the slider in its middle may reach through the slot
            if pin.kind != "guide" and joint.b in pin.sheets and _near(pin.places[pin.sheets.index(joint.b)], B):
                pins[k] = pin._replace(passes=(*pin.passes, joint.a))
        for at in guides:
            pins.append(Pin((joint.a, joint.b), (A, at), joint.b, at, "guide", name))
            holes[joint.b].append((Rounded((at,), sizes.pin / 2.0), name))
        reach += sizes.clearance
        ends = [A + along * (low - reach), A + along * (high + reach)]
        places[joint.a] += ends
        places[joint.b] += guides
        holes[joint.a].append((Rounded.around(ends, sizes.hole / 2.0), name))
    wheels = [w for j in mechanism.joints if isinstance(j, Gear | Cam) for w in pair(j, unit, pose, sizes.boss)]
    own_holes = [_fastened(w, len(links) + k, sizes, places, holes, pins) for k, w in enumerate(wheels)]
    for link, at in traced:
        if all(abs(at - own) > _SAME * abs(at) for own in places[link]):
            places[link].append(at)
            holes[link].append((Rounded((at,), sizes.pin / 2.0), "point"))
    radius = [sizes.boss * (_BOARD if link == mechanism.frame else 1.0) for link in links]
    outlines = tuple(Rounded.around(own, r) for own, r in zip(places, radius)) + tuple(w.outline for w in wheels)
    shapes = tuple(tuple(hole for hole, _ in own) for own in (*holes, *own_holes))
    sheets, touching = (*links, *(w.link for w in wheels)), [(n, n + 1) for n in range(len(links), len(outlines), 2)]
    told = tuple(w.told for w in wheels)
    near = _near_holes(holes, sizes) or _small_wheel(wheels, sizes)
    return PartsPlan(sheets, outlines, shapes, tuple(pins), sizes, told, tuple(touching)), near


def _fastened(
    own: Wheel,
    sheet: int,
    sizes: Sizes,
    places: Sequence[list[complex]],
    holes: Sequence[list[tuple[Rounded, str]]],
    pins: list[Pin],
) -> list[tuple[Rounded, str]]:
    """Put a wheel on the pin in its centre, a roller on one of its own, and dowels through it; return its holes."""
    link, at = own.link, own.centre
    found: list[tuple[Rounded, str]] = [] if own.hole is None else [(own.hole, "teeth")]
    name = f"{own.told.partition(',')[0]} {sheet} of link {link}"
    for k, pin in enumerate(pins if own.hole is None else ()):
        if pin.kind != "guide" and link in pin.sheets and _near(pin.places[pin.sheets.index(link)], at):
            pins[k] = pin._replace(sheets=(*pin.sheets, sheet), places=(*pin.places, at))
            tight = pin.link == link and not own.rolls
            found = [(Rounded((at,), (sizes.pin if tight else sizes.hole) / 2.0), pin.name)]
            break
    if own.rolls and not found:
        pins.append(Pin((link, sheet), (at, at), link, at, "pin", name))
        places[link].append(at)
        holes[link].append((Rounded((at,), sizes.pin / 2.0), name))
        found = [(Rounded((at,), sizes.hole / 2.0), name)]
    if own.rolls:
        return found
    far = max((p - at for p in places[link]), key=abs, default=1.0 + 0j)
    along = far / abs(far) if abs(far) > _SAME * abs(at) else 1.0 + 0j
    before = sum(pin.kind == "dowel" and pin.link == link for pin in pins) // 2
    along *= cmath.exp(1j * math.pi / 3.0 * before)  # clear of those of another wheel
    for side in (1.0, -1.0):
        there = at + side * (own.dowels or _dowels(sizes)) * along
        other = "" if side > 0.0 else ", second"
        pins.append(Pin((link, sheet), (there, there), link, there, "dowel", name + other))
        places[link].append(there)
        holes[link].append((Rounded((there,), sizes.pin / 2.0), name))
        found.append((Rounded((there,), sizes.pin / 2.0), name))
    return found


def _dowels(sizes: Sizes) -> float:
    """Distance of dowels from the centre of a wheel."""
    return 2.1 * sizes.spacer


def _small_wheel(wheels: Sequence[Wheel], sizes: Sizes) -> str:
    """Name a wheel that has no room for its dowels."""
    need = _dowels(sizes) + sizes.boss
    for own in wheels:
        if not own.rolls and own.free < need:
            what = own.told.partition(",")[0]
            return f"the {what} of link {own.link} is solid to {own.free:.3g} mm, and needs {need:.3g}"
    return ""


def _guides_at(
    A: complex,
    along: complex,
    B: complex,
    way: complex,
    travel: tuple[float, float],
    places: tuple[Sequence[complex], Sequence[complex]],
    sizes: Sizes,
) -> float:
    """Return how far along the axis the guides are moved from B, so that slot and guides are clear of other holes.

    Any place on the axis guides alike: the one with the shortest links is taken; 0 if none is clear.  ``A``, ``along``
    and ``places[0]`` belong to the link with the slot, ``B``, ``way`` and ``places[1]`` to that with the guides.
    """
    from graphsynth.design.parts.gaps import apart

    reach, room = 2.0 * sizes.boss, sizes.wall / 2.0 + sizes.hole + sizes.clearance
    low, high = travel[0] - reach - sizes.clearance, travel[1] + reach + sizes.clearance
    on_slot = [((p - A) * along.conjugate()).real for p in places[0]]
    on_guide = [((p - B) * way.conjugate()).real for p in places[1]]
    tried = [t for c in on_slot for t in (c + room - low, c - room - high)]
    tried += [c + side * (reach + room) for c in on_guide for side in (-1.0, 1.0)]

    def clear(t: float) -> bool:
        slot, guides = (A + (low + t) * along, A + (high + t) * along), (B + (t - reach) * way, B + (t + reach) * way)
        return all(apart(slot, (p,)) >= room * (1.0 - _SAME) for p in places[0]) and all(
            abs(g - p) >= 2.0 * sizes.spacer for g in guides for p in places[1]
        )

    def length(t: float) -> float:
        slot, guide = [*on_slot, low + t, high + t], [*on_guide, t - reach, t + reach]
        return max(slot) - min(slot) + max(guide) - min(guide)

    return min(filter(clear, tried), key=length, default=0.0)


def divided(whole: PartsPlan, frame: int) -> Iterator[PartsPlan]:
    """Return the plans in which one link consists of two sheets, joined by a pin that both hold, as a crankshaft.

    Such a link has three pins or more: one joins the sheets, the others are on one sheet each.
    """
    for link in range(max(whole.links) + 1):
        own = [k for k, pin in enumerate(whole.pins) if link in pin.sheets]
        if link == frame or any(len(hole.hull) > 1 for hole in whole.holes[link]):
            continue
        if any(whole.pins[k].kind in ("guide", "dowel") for k in own):
            continue
        for joining in own:
            _, *others = (k for k in own if k != joining)
            if whole.pins[joining].kind == "shaft" and whole.pins[joining].link != link:
                continue
            for count in range(1, len(others) + 1):
                yield from (_divided(whole, link, joining, moved) for moved in combinations(others, count))


def _divided(whole: PartsPlan, link: int, joining: int, moved: Sequence[int]) -> PartsPlan:
    """Return the plan with a second sheet for a link, which has some of its pins."""
    sizes, second = whole.sizes, len(whole.outlines)
    pins, holes = list(whole.pins), [list(own) for own in whole.holes]
    pin = pins[joining]
    at = pin.places[pin.sheets.index(link)]
    away = {pins[k].places[pins[k].sheets.index(link)] for k in moved}
    for k in moved:
        pins[k] = pins[k]._replace(sheets=tuple(second if sheet == link else sheet for sheet in pins[k].sheets))
    pins[joining] = pin._replace(sheets=(*pin.sheets, second), places=(*pin.places, at), link=link, at=at)
    holes.append([hole for hole in holes[link] if hole.hull[0] in away or hole.hull[0] == at])
    holes[link] = [hole for hole in holes[link] if hole.hull[0] not in away]
    for sheet, place in zip(pins[joining].sheets, pins[joining].places):  # held by both sheets, loose in the others
        radius = (sizes.pin if sheet in (link, second) else sizes.hole) / 2.0
        holes[sheet] = [Rounded(h.hull, radius) if h.hull == (place,) else h for h in holes[sheet]]
    outlines = list(whole.outlines)
    outlines[link] = Rounded.around([hole.hull[0] for hole in holes[link]], sizes.boss)
    outlines.append(Rounded.around([hole.hull[0] for hole in holes[second]], sizes.boss))
    return whole._replace(
        links=(*whole.links, link), outlines=tuple(outlines), holes=tuple(map(tuple, holes)), pins=tuple(pins)
    )


def _meeting(mechanism: Mechanism, unit: float) -> list[tuple[dict[int, complex], str]]:
    """Return the points where links meet in revolute joints: place on every link, and the names of the joints."""
    groups: list[tuple[dict[int, complex], list[str]]] = []
    for joint in mechanism.joints:
        if not isinstance(joint, Revolute):
            continue
        ends = {joint.a: complex(*joint.at_a) * unit, joint.b: complex(*joint.at_b) * unit}
        near = [g for g in groups if any(link in g[0] and _near(g[0][link], at) for link, at in ends.items())]
        merged, names = ends, [f"{joint.a}-{joint.b}"]
        for group in near:
            merged, names = group[0] | merged, group[1] + names
            groups.remove(group)
        groups.append((merged, names))
    return [(places, " ".join(names)) for places, names in groups]


def _near(a: complex, b: complex) -> bool:
    return abs(a - b) <= _SAME * max(abs(a), abs(b))


def _on(mechanism: Mechanism, pair: tuple[int, int], places: Mapping[int, complex], unit: float) -> bool:
    """Whether the joint of two links is at these places."""
    joint = mechanism.joint(*pair)
    return _near(places[joint.a], complex(*joint.at_a) * unit)


def _ways(
    mechanism: Mechanism,
    meeting: Sequence[tuple[dict[int, complex], str]],
    traced: Sequence[tuple[int, complex]],
    unit: float,
) -> tuple[float, float]:
    """Largest and smallest way between two points of a link; wheels and cams are as large as their diameters."""
    points = [(link, at) for places, _ in meeting for link, at in places.items()] + list(traced)
    ways = [abs(p - q) for (a, p), (b, q) in combinations(points, 2) if a == b and not _near(p, q)]
    if not ways:
        raise GeometryError("no link has two points, so there is no size to go by; give a mechanism with links")
    wide = [2.0 * unit * r for j in mechanism.joints if isinstance(j, Gear) for r in (j.radius_a, j.radius_b)]
    wide += [2.0 * unit * joint.radius for joint in mechanism.joints if isinstance(joint, Cam)]
    return max(ways + wide), min(ways)


def _near_holes(holes: Sequence[Sequence[tuple[Rounded, str]]], sizes: Sizes) -> str:
    """Name holes of a link that leave too little between them: washers must not touch, nor slots cut other holes."""
    from graphsynth.design.parts.gaps import apart

    for link, own in enumerate(holes):
        for (one, name), (other, second) in combinations(own, 2):
            slot = len(one.hull) > 1 or len(other.hull) > 1
            need = sizes.wall / 2.0 + one.radius + other.radius if slot else 2.0 * sizes.spacer
            found = apart(one.hull, other.hull)
            if found < need * (1.0 - _SAME):
                names = f"holes of joints {name} and {second} in link {link}"
                return f"{names} are {found:.3g} mm apart, and need {need:.3g}"
    return ""


def _two_digits(value: float, digits: int = 2) -> float:
    return float(f"{value:.{digits}g}") if math.isfinite(value) else value
