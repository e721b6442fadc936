"""Cognates: other linkages with the same motion of a point, or of an output link (theory/poses 7)."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np

from graphsynth.core.checks import Point, checked, link_number
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import JointGeometry, Revolute
from graphsynth.mechanism.model import Mechanism, TracePoint

Quad = tuple[Any, Any, Any, Any]


def roberts(O: Any, A: Any, B: Any, Q: Any, P: Any) -> tuple[Quad, Quad]:
    """Cognates of a four-bar with pivots O, Q, joints A, B and the coupler point P, in any complex arithmetic.

    Each is (pivot, joint, joint, pivot): the first about O and the third pivot, the second about Q and the third.
    """
    ratio = (P - A) / (B - A)
    third = O + ratio * (Q - O)
    left = (O, O + (P - A), P + (ratio - 1) * (A - O), third)
    right = (Q, Q + (P - B), P - ratio * (B - Q), third)
    return left, right


@checked
def cognates(mechanism: Mechanism, point: str = "P") -> tuple[Mechanism, Mechanism, Mechanism]:
    """Return Roberts' three four-bars that draw the same curve with a coupler point.

    Parameters
    ----------
    mechanism : Mechanism
        A four-bar with revolute joints, or a larger mechanism that hangs on the coupler of one at a single point, such
        as a Stephenson six-bar: the rest of it moves as before.
    point : str, optional
        Name of the coupler point; not needed where the rest hangs on the coupler.

    Returns
    -------
    tuple of Mechanism
        The one given; the one whose driver turns as before, so that at every input the point is where it was; the one
        whose driver turns as the coupler did.  Link numbers and drivers stay.  In the second the link at the other
        pivot turns as the coupler did, in the third as before.

    Raises
    ------
    GeometryError
        No such four-bar, a coupler with more than one point that matters, a point on a joint of the coupler.

    Notes
    -----
    Roberts' theorem: theory/poses 7.

    Examples
    --------
    >>> linkage = Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1))
    >>> _, second, third = cognates(linkage)
    >>> path, same = (one.simulate([0.5, 1.0]).point("P").position for one in (linkage, second))
    >>> bool(abs(path - same).max() < 1e-12)
    True
    """
    sub = _four_bar_in(mechanism, point)
    O, A, B, Q, P = (_place(mechanism, *end) for end in sub.ends)
    if min(abs(P - A), abs(P - B)) <= 1e-12 * abs(B - A):
        raise GeometryError(f"point {point} lies on a joint of the coupler, so a cognate has a link of length 0")
    left, right = roberts(O, A, B, Q, P)
    angles = [float(_pose(mechanism)[link][2]) for link in (sub.driver, sub.coupler, sub.other)]
    third = right[3]
    # (pivot, joint) of the driver and of the other link, with the angles at which the three links turn
    same = _rebuilt(mechanism, sub, ((third, right[2]), (Q, right[1])), (angles[0], angles[2], angles[1]), P)
    turned = _rebuilt(mechanism, sub, ((O, left[1]), (third, left[2])), (angles[1], angles[0], angles[2]), P)
    return mechanism, same, turned


class _SubChain(NamedTuple):
    """A four-bar in a mechanism: its links, and (link, place) of O, A, B, Q, P."""

    driver: int
    coupler: int
    other: int
    ends: tuple[tuple[int, Point], ...]


def _pose(mechanism: Mechanism) -> Sequence[tuple[float, float, float]]:
    """Return a pose in which the mechanism is assembled."""
    if mechanism.pose is not None:
        return mechanism.pose
    motion = mechanism.simulate(events=False)
    if not motion.assembled.any():
        raise GeometryError(f"the mechanism is not assembled: {motion.reason}")
    rows = motion.poses[int(np.argmax(motion.assembled))].tolist()
    return [(x, y, angle) for x, y, angle in rows]


def _place(mechanism: Mechanism, link: int, at: Point) -> complex:
    x, y, angle = _pose(mechanism)[link]
    return complex(complex(x, y) + cmath.exp(1j * angle) * complex(*at))


def _local(z: complex, pose: Sequence[float]) -> Point:
    own = (z - complex(pose[0], pose[1])) * cmath.exp(-1j * pose[2])
    return own.real, own.imag


def _four_bar_in(mechanism: Mechanism, name: str) -> _SubChain:
    """Find the four-bar and its coupler point."""
    frame = mechanism.frame
    of = {k: [j for j in mechanism.joints if k in (j.a, j.b)] for k in range(mechanism.graph.links)}
    near = [k for k in of if k != frame and len(of[k]) == 2 and any(frame in (j.a, j.b) for j in of[k])]
    driven = [driver.link + driver.base - frame for driver in mechanism.drivers if frame in driver.pair]
    for a, b in sorted(permutations(near, 2), key=lambda pair: (pair[0] not in driven, pair)):
        links = [next(j for j in of[k] if frame not in (j.a, j.b)) for k in (a, b)]
        carriers = {j.a + j.b - k for j, k in zip(links, (a, b))}
        grounds = [next(j for j in of[k] if frame in (j.a, j.b)) for k in (a, b)]
        if len(carriers) != 1 or frame in carriers or not all(isinstance(j, Revolute) for j in (*links, *grounds)):
            continue
        coupler = carriers.pop()
        ends = [(frame, _on(grounds[0], frame)), (coupler, _on(links[0], coupler))]
        ends += [(coupler, _on(links[1], coupler)), (frame, _on(grounds[1], frame))]
        more = [j for j in of[coupler] if j not in links]
        held = {_on(j, coupler) for j in more} or {
            at for own, (link, at) in mechanism.points.items() if own == name and link == coupler
        }
        if len(held) != 1 or not all(isinstance(j, Revolute) for j in more):
            said = f"link {coupler} has {len(held)} points to be kept and {len(more)} joints more"
            raise GeometryError(f"{said}; a cognate keeps one point, a named one or a revolute joint")
        return _SubChain(a, coupler, b, (*ends, (coupler, held.pop())))
    raise GeometryError("no four-bar with revolute joints and two binary links on the frame is in this mechanism")


def _on(joint: JointGeometry, link: int) -> Point:
    return joint.at_a if joint.a == link else joint.at_b


def _rebuilt(mechanism: Mechanism, sub: _SubChain, sides: Any, angles: Sequence[float], P: complex) -> Mechanism:
    """Put a cognate in the place of the four-bar; every link keeps its angle at this pose."""
    pose = list(_pose(mechanism))
    (O, A), (Q, B) = sides
    pose[sub.driver], pose[sub.other] = (O.real, O.imag, angles[0]), (Q.real, Q.imag, angles[2])
    pose[sub.coupler] = (P.real, P.imag, angles[1])
    places = {(mechanism.frame, sub.driver): O, (mechanism.frame, sub.other): Q}
    places |= {(sub.driver, sub.coupler): A, (sub.coupler, sub.other): B}
    places = {(min(pair), max(pair)): z for pair, z in places.items()}
    joints: list[JointGeometry] = []
    for joint in mechanism.joints:
        z = places.get(joint.pair, P if sub.coupler in joint.pair else None)
        if z is None:
            joints.append(joint)
            continue
        moved = joint.pair if joint.pair in places else (sub.coupler,)
        ends = {name: _local(z, pose[link]) for name, link in (("at_a", joint.a), ("at_b", joint.b)) if link in moved}
        joints.append(_moved(joint, ends))
    replaced = (sub.driver, sub.coupler, sub.other)
    points = {name: own for name, own in mechanism.points.items() if own.link not in replaced}
    kept = [name for name, own in mechanism.points.items() if own == sub.ends[4]]
    points |= dict.fromkeys(kept, TracePoint(sub.coupler, (0.0, 0.0)))
    return Mechanism(mechanism.graph, tuple(joints), mechanism.drivers, points, tuple(pose))


def _moved(joint: JointGeometry, ends: Any) -> JointGeometry:
    moved: JointGeometry = replace(joint, **ends)
    return moved


@checked
def stretched(mechanism: Mechanism, loop: Sequence[int], about: tuple[int, int], factor: complex) -> Mechanism:
    """Stretch and rotate one loop of links about one of its joints; every link turns as before.

    Parameters
    ----------
    mechanism : Mechanism
        With revolute joints in the loop.
    loop : sequence of int
        Links of the loop in their order.
    about : (int, int)
        Two of them that are jointed: the joint stays where it is.  The other links must have no joint outside the loop.
    factor : complex
        What the loop is multiplied by.

    Returns
    -------
    Mechanism
        A function cognate, as of Watt's six-bar: all angles are the same functions of the input.

    Raises
    ------
    GeometryError
        Links that are no loop, a loop that holds another link or a joint that is not revolute, a factor of 0.

    Notes
    -----
    Stretch-rotation: theory/poses 7.

    Examples
    --------
    >>> watt = Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    >>> other = stretched(watt, [0, 1, 2, 3], (0, 3), 1.5j)
    >>> turns = [one.simulate([0.0, 0.3]).poses[:, 5, 2] for one in (watt, other)]
    >>> bool(abs(turns[0] - turns[1]).max() < 1e-12)
    True
    """
    links = [link_number("link of the loop", link) for link in loop]
    pairs = [(min(pair), max(pair)) for pair in zip(links, [*links[1:], *links[:1]])]
    joints = {joint.pair: joint for joint in mechanism.joints}
    kept = (min(about), max(about))
    if len(links) < 4 or not set(pairs) <= joints.keys() or kept not in pairs:
        raise GeometryError(f"loop = {links} with about = {about} is no loop of links through that joint")
    if not all(isinstance(joints[pair], Revolute) for pair in pairs) or factor == 0:
        raise GeometryError(f"loop = {links} has a joint that is not revolute, or factor = {factor} is 0")
    free = [link for link in links if link not in kept]
    if any((link in pair) and pair not in pairs for link in free for pair in joints):
        raise GeometryError(f"a link of {free} has a joint outside the loop, which would move; choose another loop")
    pose = list(_pose(mechanism))
    centre = _place(mechanism, joints[kept].a, joints[kept].at_a)
    old = {pair: _place(mechanism, joints[pair].a, joints[pair].at_a) for pair in pairs}
    new = {pair: centre + factor * (z - centre) for pair, z in old.items()}
    for link in free:
        z = centre + factor * (complex(*pose[link][:2]) - centre)
        pose[link] = (z.real, z.imag, pose[link][2])
    made = []
    for joint in mechanism.joints:
        if joint.pair in new and joint.pair != kept:
            z = new[joint.pair]
            joint = _moved(joint, {"at_a": _local(z, pose[joint.a]), "at_b": _local(z, pose[joint.b])})
        made.append(joint)
    points = {name: own for name, own in mechanism.points.items() if own.link not in free}
    return Mechanism(mechanism.graph, tuple(made), mechanism.drivers, points, tuple(pose))
