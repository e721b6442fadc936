"""Cognates: mechanisms that draw the curve of another one, its links turning in exchanged places (theory/poses 7)."""

from __future__ import annotations

import cmath
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import Point, checked, link_number
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

Quad = tuple[Any, Any, Any, Any]
Complex = NDArray[np.complex128]
Order = tuple[int, ...]
#: Largest number of links: all orders of the moving ones are tried.
LINKS = 8
#: Relative size below which a number counts as zero.
_ZERO = 1e-9


def roberts(O: Any, A: Any, B: Any, Q: Any, P: Any) -> tuple[Quad, Quad]:
    """Cognates of a four-bar with pivots O, Q, joints A, B and the coupler point P, in any complex arithmetic.

    Each is (pivot, joint, joint, pivot): the first about O and the third pivot, the second about Q and the third.
    """
    ratio = (P - A) / (B - A)
    third = O + ratio * (Q - O)
    left = (O, O + (P - A), P + (ratio - 1) * (A - O), third)
    right = (Q, Q + (P - B), P - ratio * (B - Q), third)
    return left, right


@dataclass(frozen=True, eq=False, repr=False)
class Cognate(Shown):
    """A mechanism whose links turn as those of a given one, perhaps exchanged, and that keeps its curve.

    Attributes
    ----------
    mechanism : Mechanism
        In the pose in which the given one stands; its driver turns as the given one's where a joint allows that.
    turns : tuple of int
        Link k turns as link ``turns[k]`` of the given mechanism, by the same angles.
    timed : bool
        Whether its driver turns as the given one's, so that the point is at the same place at every input.
    freedom : int
        How many joints may be put anywhere (`placed`); 0 for a single mechanism.
    """

    mechanism: Mechanism
    turns: Order
    timed: bool
    freedom: int
    _family: _Family

    def inputs(self, motion: Motion) -> NDArray[np.float64]:
        """Return the coordinates of its driver at which it is as the given mechanism in a motion of that."""
        if self.timed:
            return motion.inputs
        (driver,) = self.mechanism.drivers
        angles = motion.poses[..., [self.turns[driver.link], self.turns[driver.base]], 2]
        return np.asarray(np.unwrap(angles[..., 0] - angles[..., 1]))

    def placed(self, joints: Mapping[tuple[int, int], Point]) -> Cognate:
        """Return the member of the family nearest to this one with joints, named by their links, at given places.

        The places are those in the pose of the given mechanism; `GeometryError` if the family has no such member.
        """
        rows = [self._family.number(*pair) for pair in joints]
        x, ways = self._family.places, self._family.ways
        step = np.array([complex(*at) for at in joints.values()]) - x[rows]
        c = np.linalg.lstsq(ways[rows], step, rcond=None)[0]
        if np.abs(ways[rows] @ c - step).max(initial=0.0) > _ZERO * (np.abs(x).max() + np.abs(step).max(initial=0.0)):
            raise GeometryError(
                f"joints {list(joints)} cannot be there: {self.freedom} joints of this cognate are free"
            )
        family = self._family._replace(places=x + ways @ c)
        if not family.sound():
            raise GeometryError(f"with joints {list(joints)} there a link has length 0; choose other places")
        return family.cognate()

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [("links turn as", str(self.turns)), ("free joints", str(self.freedom))]
        return f"cognate with {self.mechanism.graph.links} links{', same timing' if self.timed else ''}", rows

    def _picture(self) -> str:
        return self.mechanism._picture()


@checked
def cognates(
    mechanism: Mechanism,
    point: str | None = "P",
    *,
    links: Sequence[int] = (),
    graph: MechanismGraph | None = None,
) -> tuple[Cognate, ...]:
    """Find the mechanisms that draw the same curve, or keep the motion of links, with links that turn as before.

    Parameters
    ----------
    mechanism : Mechanism
        At most eight links, revolute joints, one driver.
    point : str, optional
        Name of the point whose curve is kept; None keeps motions of ``links`` only.
    links : sequence of int, optional
        Links that turn as before.  With the point's own link among them its whole motion is kept.  Without a point,
        the first two joints of the first of them stay at their places too, so that its motion is kept.
    graph : MechanismGraph, optional
        Another chain with as many links, and its frame, that shall draw the curve.

    Returns
    -------
    tuple of Cognate
        The given one first, then those with its timing.  Of a four-bar there are three (Roberts), of six-bars up to
        six, some in families (Dijksman); the table is in theory/poses 7.

    Raises
    ------
    GeometryError
        No such point, too many links, a joint that is not revolute, nothing to keep.

    Notes
    -----
    All exchanges of links are tried [Sherman et al. 2021].  Six-bars have no other cognates [Sherman et al. 2022]; of
    more links that is not known.  Estimated: ranks are decided in floating point.

    Examples
    --------
    >>> linkage = Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1))
    >>> first, second, third = cognates(linkage)
    >>> path, same = (one.simulate([0.5, 1.0]).point("P").position for one in (linkage, second.mechanism))
    >>> second.timed, bool(abs(path - same).max() < 1e-12), third.turns
    (True, True, (0, 2, 1, 3))
    """
    given = _read(mechanism, point)
    kept = [link_number("link that turns as before", link) for link in links]
    if point is None and not kept:
        raise GeometryError("point = None and links = () keep nothing; name a point or links")
    other = graph or mechanism.graph
    if (other.links, len(other.joints)) != (mechanism.graph.links, len(mechanism.joints)) or other.frame is None:
        told = f"{other.links} links, {len(other.joints)} joints, frame {other.frame}"
        raise GeometryError(f"graph has {told}; give one with {len(given.angles)} links of mobility 1 and a frame")
    shape = _Shape.of(other, [joint[:2] for joint in other.joints] if graph else given.shape.joints)
    same, symmetries = tuple(range(other.links)), shape.symmetries
    carriers = [given.tracer] if point is None or given.tracer in kept else list(shape.paths)
    found: dict[Any, Cognate] = {}
    for carrier in carriers:
        for family in _families(given, shape, carrier, kept):
            made = family.cognate()
            key = min(
                (tuple(family.order[k] for k in one), -1 if carrier is None else one.index(carrier))
                for one in symmetries
            )
            before = found.get(key)
            if before is None or (made.timed, made.turns == same) > (before.timed, before.turns == same):
                found[key] = made
    if graph is None and all(one.turns != same for one in found.values()):
        raise GeometryError(
            f"point {point} lies on a joint, or a link has length 0; cognates would have such links too"
        )
    return tuple(sorted(found.values(), key=lambda one: (one.turns != same, not one.timed, one.turns)))


class _Shape(NamedTuple):
    """A chain with its frame: how places of joints make positions, as coefficients (links, places)."""

    frame: int
    joints: list[tuple[int, int]]
    loops: NDArray[np.float64]
    paths: dict[int, NDArray[np.float64]]  # of the point, which has the last place, on each link

    @classmethod
    def of(cls, graph: MechanismGraph, joints: Sequence[tuple[int, int]]) -> _Shape:
        """Positions go along a tree of links, and every other joint closes a loop."""
        frame = graph.frame or 0
        before: dict[int, tuple[int, int]] = {}
        order = [frame]
        for link in order:
            for m, pair in enumerate(joints):
                nearer = sum(pair) - link
                if link in pair and nearer != frame and nearer not in before:
                    before[nearer] = (m, link)
                    order.append(nearer)

        def path(link: int, place: int) -> NDArray[np.float64]:
            table = np.zeros((graph.links, len(joints) + 1))
            while link != frame:
                joint, parent = before[link]
                table[link, [place, joint]] += 1.0, -1.0
                link, place = parent, joint
            table[frame, place] += 1.0
            return table

        tree = {joint for joint, _ in before.values()}
        loops = [path(a, m) - path(b, m) for m, (a, b) in enumerate(joints) if m not in tree]
        paths = {link: path(link, len(joints)) for link in before}
        return cls(frame, list(joints), np.array(loops), paths)

    @property
    def symmetries(self) -> list[Order]:
        """Exchanges of links that leave joints and frame."""
        pairs = {frozenset(pair) for pair in self.joints}
        every = permutations(range(len(self.paths) + 1))
        return [
            one
            for one in every
            if one[self.frame] == self.frame and {frozenset(one[k] for k in pair) for pair in pairs} == pairs
        ]


class _Given(NamedTuple):
    """The mechanism: places of joints and of the point in its pose, and what its loops say of the links' rotations."""

    mechanism: Mechanism
    point: str
    shape: _Shape
    angles: list[float]
    places: Complex
    tracer: int | None
    free: Complex  # (links, n): rotations u satisfy the loops if they are orthogonal to what these vanish on
    curve: Complex  # (n,): the point's position, up to the loops


def _read(mechanism: Mechanism, point: str | None) -> _Given:
    """Check a mechanism and take it apart."""
    graph, frame = mechanism.graph, mechanism.frame
    if graph.links > LINKS or len(mechanism.drivers) != 1:
        told = f"{graph.links} links and {len(mechanism.drivers)} drivers"
        raise GeometryError(f"the mechanism has {told}; cognates are found for at most {LINKS} links and one driver")
    if wrong := [joint.pair for joint in mechanism.joints if not isinstance(joint, Revolute)]:
        raise GeometryError(f"joint {wrong[0]} is not revolute; cognates are found for revolute joints")
    if point is not None and (point not in mechanism.points or mechanism.points[point].link == frame):
        names = [name for name, own in mechanism.points.items() if own.link != frame]
        raise GeometryError(f"point = {point!r} is on no moving link; name one of {names}")
    pose = _pose(mechanism)
    tracer = None if point is None else mechanism.points[point].link
    shape = _Shape.of(graph, [joint.pair for joint in mechanism.joints])
    places = np.array([_place(pose[joint.a], joint.at_a) for joint in mechanism.joints] + [0j])
    if tracer is not None and point is not None:
        places[-1] = _place(pose[tracer], mechanism.points[point].at)
    free = np.linalg.svd(shape.loops @ places)[2][len(shape.loops) :].conj().T
    curve = np.zeros(free.shape[1], dtype=np.complex128) if tracer is None else (shape.paths[tracer] @ places) @ free
    return _Given(mechanism, point or "", shape, [float(angle) for *_, angle in pose], places, tracer, free, curve)


class _Family(NamedTuple):
    """Cognates with one order of the links: places of one of them, and ways in which they may move."""

    given: _Given
    shape: _Shape
    carrier: int | None
    order: Order
    places: Complex
    ways: Complex

    def number(self, a: int, b: int) -> int:
        """Return the number of a joint."""
        if {a, b} not in (pairs := [set(pair) for pair in self.shape.joints]):
            raise GeometryError(f"links {a} and {b} have no joint; name one of {self.shape.joints}")
        return pairs.index({a, b})

    def sound(self) -> bool:
        """Whether all links have lengths and the loops are different."""
        x = self.places
        least = _ZERO * np.abs(x - x[0]).max()
        for link in range(len(self.order)):
            own = [m for m, pair in enumerate(self.shape.joints) if link in pair] + [-1] * (link == self.carrier)
            if any(abs(x[i] - x[j]) <= least for i, j in combinations(own, 2)):
                return False
        return bool(np.linalg.svd(self.shape.loops @ x)[1][-1] > least)

    def cognate(self) -> Cognate:
        """Build the mechanism; every link has the angle of the one as which it turns."""
        given, shape, x = self.given, self.shape, self.places
        pose = []
        for link, source in enumerate(self.order):
            at = x[next(m for m, pair in enumerate(shape.joints) if link in pair)]
            pose.append((float(at.real), float(at.imag), given.angles[source]))
        pose[shape.frame] = _pose(given.mechanism)[given.shape.frame]
        joints = [Revolute(a, b, _local(x[m], pose[a]), _local(x[m], pose[b])) for m, (a, b) in enumerate(shape.joints)]
        (driver,) = given.mechanism.drivers
        base, link = (self.order.index(k) for k in (driver.base, driver.link))
        pairs = [{a, b} for a, b in shape.joints]
        timed = {base, link} in pairs
        if not timed:
            base, link = (driver.base, driver.link) if set(driver.pair) in pairs else self._first()
        points = {}
        if self.carrier is not None:
            points[given.point] = TracePoint(self.carrier, _local(x[-1], pose[self.carrier]))
        graph = MechanismGraph(len(pose), shape.joints, frame=shape.frame)
        drivers = (Driver(base, link, driver.law) if timed else Driver(base, link),)
        made = Mechanism(graph, tuple(joints), drivers, points, tuple(pose))
        return Cognate(made, self.order, timed, self.ways.shape[1], self)

    def _first(self) -> tuple[int, int]:
        """Frame and a link jointed to it."""
        return self.shape.frame, next(
            sum(pair) - self.shape.frame for pair in self.shape.joints if self.shape.frame in pair
        )


def _families(given: _Given, shape: _Shape, carrier: int | None, kept: Sequence[int]) -> Iterator[_Family]:
    """Solve linear equations of the places for every order of the links, all at once."""
    frame, n = given.shape.frame, len(given.angles)
    orders = [
        order for order in permutations(range(n)) if order[shape.frame] == frame and all(order[k] == k for k in kept)
    ]
    tables = shape.loops if carrier is None else np.concatenate([shape.loops, shape.paths[carrier][None]])
    turned = given.free[np.array(orders)]
    A = np.einsum("ske,lkm->slem", turned, tables).reshape(len(orders), -1, tables.shape[2])
    last = np.zeros((len(tables), given.free.shape[1]), dtype=np.complex128)
    start = given.places
    if carrier is not None:
        last[-1] = given.curve
        right = last.ravel()
    else:  # two joints of the link that is kept, and the place of the point, which there is not
        own, pins = (
            [*[m for m, pair in enumerate(one.joints) if kept[0] in pair][:2], -1] for one in (given.shape, shape)
        )
        A = np.concatenate([A, np.broadcast_to(np.eye(len(start))[pins], (len(orders), 3, len(start)))], axis=1)
        right = np.append(last, start[own])
    rest, size = right - A @ start, np.abs(start - start[0]).max()
    U, S, V = np.linalg.svd(A)
    for order, left, s, back, r in zip(orders, U, S, V, rest):
        rank = int((s > _ZERO * s[0]).sum())
        c = left.conj().T @ r
        if np.abs(c[rank:]).max(initial=0.0) <= _ZERO * size:
            ways = back[rank:].conj().T
            family = _Family(given, shape, carrier, order, start + back[:rank].conj().T @ (c[:rank] / s[:rank]), ways)
            if family.sound():
                yield family


def _pose(mechanism: Mechanism) -> Sequence[tuple[float, float, float]]:
    """Return a pose in which the mechanism is assembled."""
    if mechanism.pose is not None:
        return mechanism.pose
    motion = mechanism.simulate(events=False)
    if not motion.assembled.any():
        raise GeometryError(f"the mechanism is not assembled: {motion.reason}")
    rows = motion.poses[int(np.argmax(motion.assembled))].tolist()
    return [(x, y, angle) for x, y, angle in rows]


def _place(pose: Sequence[float], at: Point) -> complex:
    x, y, angle = pose
    return complex(complex(x, y) + cmath.exp(1j * angle) * complex(*at))


def _local(z: complex, pose: Sequence[float]) -> Point:
    own = (complex(z) - complex(pose[0], pose[1])) * cmath.exp(-1j * pose[2])
    return own.real, own.imag
