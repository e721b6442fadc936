"""How well a motion is transmitted, for groups of any class, over many poses at once.

The transmission angle of a bar is asked for as in a four-bar linkage: hold the driver, take the bar away, and let the
rest move in the one way left to it; the angle between the bar and the normal of that motion, seen across the bar, is
the transmission angle (pi/2: the bar pushes along the motion).  With J the constraint matrix of the group's core links,
one row per bar (the unit vector along the bar times the velocity across it), the column of the inverse of J that
belongs to the bar is that motion with a unit component along the bar, so ``sin mu = 1 / |velocity across the bar|``.
For a dyad it is the angle at its inner joint; for a link held by three bars it is the angle between a bar and the line
from its end to the point where the other two bars meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine.program import Step
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


class GroupForm(NamedTuple):
    """How to find the transmission of one group.

    ``core`` holds the unknown links, ``bars`` (joint at one end, link there, joint at the other end, link there) and
    ``pins`` (joint, link, link) the constraints; without bars the margin of the engine is taken: its square root where
    ``closed``, else its size.
    """

    group: int
    closed: bool
    core: tuple[int, ...]
    bars: tuple[tuple[int, int, int, int], ...]
    pins: tuple[tuple[int, int, int], ...]


def group_forms(mechanism: Mechanism, steps: Sequence[Step]) -> tuple[GroupForm, ...]:
    """Return the form of every group of a mechanism."""
    return tuple(_form(mechanism, step) for step in steps if step.group >= 0)


def _form(mechanism: Mechanism, step: Step) -> GroupForm:
    plain = GroupForm(step.group, step.has_two_modes, (), (), ())
    if step.has_two_modes or not step.iterative:
        return plain
    inside, core = set(step.links), set(step.core)
    driven = {driver.pair for driver in mechanism.drivers}
    bars, pins = [], []
    known = {link for s in _before(mechanism, step) for link in s}
    own = [
        (k, joint)
        for k, joint in enumerate(mechanism.joints)
        if {joint.a, joint.b} & inside and {joint.a, joint.b} <= inside | known
    ]
    if any(not isinstance(joint, Revolute) or joint.pair in driven for _, joint in own):
        return plain
    for link in sorted(inside - core):
        ends = [(k, joint.b if joint.a == link else joint.a) for k, joint in own if link in joint.pair]
        bars.append((ends[0][0], ends[0][1], ends[1][0], ends[1][1]))
    for k, joint in own:
        if not {joint.a, joint.b} & (inside - core):
            pins.append((k, joint.a, joint.b))
    if not bars or len(bars) + 2 * len(pins) != 3 * len(core):
        return plain
    return GroupForm(step.group, False, tuple(step.core), tuple(bars), tuple(pins))


def _before(mechanism: Mechanism, step: Step) -> list[tuple[int, ...]]:
    """Links placed before a group: the frame, driven links and earlier groups."""
    from graphsynth.structure.assur import decompose

    found = decompose(mechanism.graph, [driver.pair for driver in mechanism.drivers])
    return [found.driven, *(group.links for group in found.groups[: step.group])]


def transmission_sines(forms: Sequence[GroupForm], dimensions: Array, ends: Sequence[tuple[int, int]], frames: Array,
                       margins: Array) -> Array:  # fmt: skip
    """Sine of the smallest transmission angle of every group.

    Parameters
    ----------
    forms : sequence of GroupForm
    dimensions : ndarray, shape (sets, joints, 10)
    ends : sequence of (a, b)
        The links of every joint, in the order of the dimensions.
    frames : ndarray, shape (sets, n, links, 4)
        (x, y, cos, sin) of every link.
    margins : ndarray, shape (sets, n, groups)

    Returns
    -------
    ndarray, shape (sets, n, groups)
        NaN where there is no pose.
    """
    found = np.empty(margins.shape)
    for form in forms:
        margin = margins[:, :, form.group]
        if form.bars:
            found[:, :, form.group] = _bars(form, dimensions, ends, frames)
        elif form.closed:
            found[:, :, form.group] = np.sqrt(np.clip(margin, 0.0, 1.0))
        else:
            found[:, :, form.group] = np.clip(np.abs(margin), 0.0, 1.0)
    return found


def _bars(form: GroupForm, dimensions: Array, ends: Sequence[tuple[int, int]], frames: Array) -> Array:
    place = {link: 3 * k for k, link in enumerate(form.core)}
    size = 3 * len(form.core)
    J = np.zeros((*frames.shape[:2], size, size))
    across = np.zeros((*frames.shape[:2], len(form.bars), 2, size))
    for r, (p, a, q, b) in enumerate(form.bars):
        A, B = _point(p, a, dimensions, ends, frames), _point(q, b, dimensions, ends, frames)
        for link, at, sign in ((a, A, -1.0), (b, B, 1.0)):
            if link in place:
                _velocity(across[:, :, r], place[link], at, sign)
        e = B - A
        e = e / np.maximum(np.hypot(e[..., 0], e[..., 1]), 1e-300)[..., None]
        J[:, :, r] = (e[..., None] * across[:, :, r]).sum(axis=2)
    row = len(form.bars)
    for k, a, b in form.pins:
        at = _point(k, a, dimensions, ends, frames)
        for link, sign in ((a, -1.0), (b, 1.0)):
            if link in place:
                _velocity(J[:, :, row : row + 2], place[link], at, sign)
        row += 2
    missing = ~np.isfinite(J).all(axis=(2, 3))
    J[missing] = np.eye(size)
    try:
        columns = np.linalg.inv(J)[..., : len(form.bars)]
    except np.linalg.LinAlgError:  # one pose is singular to the last bit
        columns = np.linalg.pinv(J)[..., : len(form.bars)] * 1e300
    moved = np.einsum("...rck,...kr->...rc", across, columns)
    with np.errstate(over="ignore"):
        sine = 1.0 / np.hypot(moved[..., 0], moved[..., 1]).max(axis=-1)
    sine[missing] = np.nan
    return np.asarray(np.minimum(sine, 1.0))


def _point(k: int, link: int, dimensions: Array, ends: Sequence[tuple[int, int]], frames: Array) -> Array:
    """World places of joint k as a point of one of its links, shape (sets, n, 2)."""
    first = 0 if ends[k][0] == link else 3
    px, py = dimensions[:, k, first, None], dimensions[:, k, first + 1, None]
    x, y, c, s = (frames[:, :, link, i] for i in range(4))
    return np.stack([x + c * px - s * py, y + s * px + c * py], axis=-1)


def _velocity(rows: Array, column: int, at: Array, sign: float) -> None:
    """Put the velocity of a point into two rows; a link's twist is that of its point at the world's origin."""
    rows[:, :, 0, column], rows[:, :, 1, column + 1] = sign, sign
    rows[:, :, 0, column + 2], rows[:, :, 1, column + 2] = -sign * at[..., 1], sign * at[..., 0]
