"""Transmission angles of groups of any class, over many poses at once.

A *line of force* is a bar with two pins, a link with a pin and a guide, a pin in a slot, a roller on a cam, a mesh of
teeth: all that goes through it is one force.  Its transmission angle is defined in docs/explanation/embodiment.md, "The
search".  Here J is the constraint matrix of the group's core links, one row for every line: the unit vector of the
force times the velocity across it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.joints import Cam, JointGeometry, Prismatic, Revolute
from graphsynth.structure.assur import decompose

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.program import Step
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
#: Columns of a joint's row of dimensions: direction on its first link, pitch radii, sign of a gear.
_ANGLE, _RADIUS, _SIGN = 2, 6, 8


class Tie(NamedTuple):
    """What two links have to do with each other: joint at one end, link there, joint at the other end, link there.

    Lines of force are a ``"bar"`` between two pins, a ``"pin-slot"`` (the pin of the first joint, the guide of the
    second), a ``"cam"`` and a ``"gear"``; other ties are ``"R"`` and ``"P"``, with ``"drive"`` for one that is held.
    """

    kind: str
    p: int
    a: int
    q: int
    b: int
    waves: tuple[tuple[float, float], ...] = ()


class GroupForm(NamedTuple):
    """How to find the transmission of one group.

    ``core`` holds the unknown links, ``lines`` and ``ties`` what holds them.  Without lines the margin of the engine is
    taken: its square root where ``closed``, else its size.
    """

    group: int
    closed: bool
    core: tuple[int, ...]
    lines: tuple[Tie, ...]
    ties: tuple[Tie, ...]


def group_forms(mechanism: Mechanism, steps: Sequence[Step]) -> tuple[GroupForm, ...]:
    """Return the form of every group of a mechanism."""
    found = decompose(mechanism.graph, [driver.pair for driver in mechanism.drivers])
    known, forms = {*found.driven}, []  # links placed before a group: the frame, driven links and earlier groups
    for group, step in zip(found.groups, (step for step in steps if step.group >= 0)):
        forms.append(_form(mechanism, step, known))
        known |= {*group.links}
    return tuple(forms)


_Joints = list[tuple[int, JointGeometry]]


def _form(mechanism: Mechanism, step: Step, known: set[int]) -> GroupForm:
    plain = GroupForm(step.group, step.has_two_modes, (), (), ())
    if step.has_two_modes or not step.iterative:
        return plain
    inside, driven = set(step.links), {frozenset(driver.pair) for driver in mechanism.drivers}
    own = [
        (k, joint)
        for k, joint in enumerate(mechanism.joints)
        if {joint.a, joint.b} & inside and {joint.a, joint.b} <= inside | known
    ]
    held = [(k, joint) for k, joint in own if frozenset(joint.pair) in driven]
    # a cylinder, a driven slide between two links with one more joint each, is a bar between these
    two = {link: len([k for k, joint in own if link in joint.pair]) == 2 for link in inside}
    cylinders = [j.pair for _, j in held if isinstance(j, Prismatic) and all(two.get(link) for link in j.pair)]
    pushed = {link for pair in cylinders for link in pair}
    lines, left = [_bar(own, {*pair}) for pair in cylinders], set(pushed)
    for link in sorted(inside - pushed):
        joints = [(k, joint) for k, joint in own if link in joint.pair]
        beside = {other for _, joint in joints for other in joint.pair} - {link}
        if two[link] and not beside & left and not any(entry in held for entry in joints):
            line = _line(own, joints, link)
            lines += [line] if line else []
            left |= {link} if line else set()
    rest = [(k, joint) for k, joint in own if not {*joint.pair} & left]
    lines += [_contact(k, joint) for k, joint in rest if joint.mobility == 2]
    ties = [Tie(joint.kind, k, joint.a, k, joint.b) for k, joint in rest if joint.mobility == 1]
    ties += [Tie(f"drive {joint.kind}", k, joint.a, k, joint.b) for k, joint in held if not {*joint.pair} & left]
    core = tuple(sorted(inside - left))
    if not lines or len(lines) + sum(_ROWS[tie.kind] for tie in ties) != 3 * len(core):
        return plain
    return GroupForm(step.group, False, core, tuple(lines), tuple(ties))


#: Equations of ties that are no lines of force.
_ROWS = {"R": 2, "P": 2, "drive R": 1, "drive P": 1}


def _line(own: _Joints, joints: _Joints, link: int) -> Tie | None:
    """Return the line of force of a link with two joints: two pins, or a pin and a guide; None for other joints."""
    kinds = [type(joint) for _, joint in joints]
    if kinds == [Revolute, Revolute]:
        return _bar(own, {link})
    if sorted(kind.__name__ for kind in kinds) != ["Prismatic", "Revolute"]:
        return None
    (p, pin), (q, guide) = joints if kinds[0] is Revolute else joints[::-1]
    a, b = (sum(joint.pair) - link for joint in (pin, guide))  # the links at both ends
    return Tie("pin-slot", p, a, q, b)


def _bar(own: _Joints, links: set[int]) -> Tie:
    """Joints at both ends of a bar of one link, or of the two of a cylinder, and the links there."""
    ends = [(k, joint.b if joint.a in links else joint.a) for k, joint in own if len({*joint.pair} & links) == 1]
    return Tie("bar", *ends[0], *ends[1])


def _contact(k: int, joint: JointGeometry) -> Tie:
    """Line of force of a joint of mobility 2: the point of its second link, the line or curve of the first."""
    return Tie(joint.kind, k, joint.b, k, joint.a, joint.harmonics if isinstance(joint, Cam) else ())


def transmission_sines(
    forms: Sequence[GroupForm], dimensions: Array, ends: Sequence[tuple[int, int]], frames: Array, margins: Array
) -> Array:
    """Sine of the smallest transmission angle of every group, shape (sets, n, groups); NaN where there is no pose.

    ``dimensions`` (sets, joints, 10); ``ends``, the links of every joint in that order; ``frames`` (sets, n, links, 4)
    with x, y, cos, sin of every link; ``margins`` (sets, n, groups).
    """
    found = np.empty(margins.shape)
    for form in forms:
        margin = margins[:, :, form.group]
        if form.lines:
            found[:, :, form.group] = _Poses(dimensions, ends, frames).sines(form)
        elif form.closed:
            found[:, :, form.group] = np.sqrt(np.clip(margin, 0.0, 1.0))
        else:
            found[:, :, form.group] = np.clip(np.abs(margin), 0.0, 1.0)
    return found


class _Poses(NamedTuple):
    """Dimensions and poses, as of `transmission_sines`; vectors in the plane are complex numbers (sets, n)."""

    dimensions: Array
    ends: Sequence[tuple[int, int]]
    frames: Array

    def sines(self, form: GroupForm) -> Array:
        """Smallest sine over all lines of force, (sets, n)."""
        size, lines = 3 * len(form.core), len(form.lines)
        with np.errstate(all="ignore"):  # where there is no pose
            J, across = self._system(form, size)
            missing = ~np.isfinite(J).all(axis=(2, 3))
            J[missing] = np.eye(size)
            try:
                columns = np.linalg.inv(J)[..., :lines]
            except np.linalg.LinAlgError:  # one pose is singular to the last bit
                columns = np.linalg.pinv(J)[..., :lines] * 1e300
            moved = np.einsum("...rck,...kr->...rc", across, columns)
            sine = 1.0 / np.hypot(moved[..., 0], moved[..., 1]).max(axis=-1)
        sine[missing] = np.nan
        return np.asarray(np.minimum(sine, 1.0))

    def _system(self, form: GroupForm, size: int) -> tuple[Array, Array]:
        """Return J (sets, n, size, size), and the velocity across every line (sets, n, lines, 2, size)."""
        place, row = {link: 3 * k for k, link in enumerate(form.core)}, len(form.lines)
        J = np.zeros((*self.frames.shape[:2], size, size))
        across = np.zeros((*self.frames.shape[:2], row, 2, size))
        for r, line in enumerate(form.lines):
            at_a, at_b, force = self.line(line)
            _put(across[:, :, r], place, line.a, at_a, -1.0)
            _put(across[:, :, r], place, line.b, at_b, 1.0)
            J[:, :, r] = _along(force, across[:, :, r])
        for tie in form.ties:
            for rows in self.rows(tie, place, size):
                J[:, :, row] = rows
                row += 1
        return J, across

    def line(self, line: Tie) -> tuple[Any, Any, Any]:
        """Points of both links where a line of force holds them, and its unit vector."""
        at = self.point(line.p, line.a)
        if line.kind == "bar":
            other = self.point(line.q, line.b)
            return at, other, _unit(other - at)
        if line.kind == "pin-slot":
            return at, at, 1j * self.direction(line.q)
        d = at - self.point(line.q, line.b)
        if line.kind == "gear":
            radii = self.dimensions[:, line.p, _RADIUS : _RADIUS + 2]
            share = radii[:, :1] / (radii[:, :1] + self.dimensions[:, line.p, _SIGN, None] * radii[:, 1:])
            mesh = at - d * (1.0 - share)
            return mesh, mesh, 1j * _unit(d)
        psi, first = np.angle(d * np.conj(self.direction(line.q))), np.zeros(d.shape)
        for k, (c, s) in enumerate(line.waves, 1):
            first += k * (s * np.cos(k * psi) - c * np.sin(k * psi))
        return at, at, _unit(_unit(d) * (1.0 - 1j * first / np.maximum(np.abs(d), 1e-300)))

    def rows(self, tie: Tie, place: dict[int, int], size: int) -> list[Array]:
        """Equations of a tie that is no line of force."""
        at, across = self.point(tie.q, tie.b), np.zeros((*self.frames.shape[:2], 2, size))
        _put(across, place, tie.a, at, -1.0)
        _put(across, place, tie.b, at, 1.0)
        if tie.kind == "R":
            return [across[..., 0, :], across[..., 1, :]]
        if tie.kind == "drive P":
            return [_along(self.direction(tie.p), across)]
        turned = np.zeros((*self.frames.shape[:2], size))
        for link, sign in ((tie.a, -1.0), (tie.b, 1.0)):
            if link in place:
                turned[..., place[link] + 2] = sign
        return [turned] if tie.kind == "drive R" else [turned, _along(1j * self.direction(tie.p), across)]

    def point(self, k: int, link: int) -> Any:
        """Places of joint k as a point of one of its links."""
        first = 0 if self.ends[k][0] == link else 3
        local = self.dimensions[:, k, first, None] + 1j * self.dimensions[:, k, first + 1, None]
        x, y, c, s = (self.frames[:, :, link, i] for i in range(4))
        return x + 1j * y + (c + 1j * s) * local

    def direction(self, k: int) -> Any:
        """Direction on the first link of joint k: of a guide, or from which the angle of a cam counts."""
        c, s = (self.frames[:, :, self.ends[k][0], i] for i in (2, 3))
        return (c + 1j * s) * np.exp(1j * self.dimensions[:, k, _ANGLE, None])


def _unit(z: Any) -> Any:
    return z / np.maximum(np.abs(z), 1e-300)


def _put(across: Array, place: dict[int, int], link: int, at: Any, sign: float) -> None:
    """Add the velocity of a point of a link; a link's twist is that of its point at the world's origin."""
    if link in place:
        k = place[link]
        across[..., 0, k] += sign
        across[..., 1, k + 1] += sign
        across[..., 0, k + 2] -= sign * at.imag
        across[..., 1, k + 2] += sign * at.real


def _along(way: Any, across: Array) -> Array:
    """Component of velocities along unit vectors."""
    return np.asarray(way.real[..., None] * across[..., 0, :] + way.imag[..., None] * across[..., 1, :])
