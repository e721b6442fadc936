"""`parts`: the links of a moving mechanism as sheets with holes, in layers where nothing collides."""

from __future__ import annotations

import math
from time import perf_counter

import numpy as np

from graphsynth.core.checks import positive
from graphsynth.core.errors import GeometryError
from graphsynth.design.parts.collisions import Hazards
from graphsynth.design.parts.gaps import Array, Solid, Tube, corners, proved_travel
from graphsynth.design.parts.layers import least_layers
from graphsynth.design.parts.outline import Rounded
from graphsynth.design.parts.plan import PartSizes, PartsPlan, Travel, divided, plan
from graphsynth.design.parts.result import Parts
from graphsynth.design.parts.wheels import check
from graphsynth.kinematics.certify.poses import Enclosures, enclosures
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.joints import PinSlot, Prismatic

#: Boxes wider than this (over Lc, radians) are made narrower by more samples, of which there are at most so many.
_WIDE, _SAMPLES = 1e-4, 20_000
#: Poses that differ by less than this, in their size, belong to the same assembly.
_SAME = 1e-7


def parts(
    motion: Motion,
    *,
    unit: float = 1.0,
    sizes: PartSizes | None = None,
    prove: bool = True,
    max_boxes: int = 100_000,
    seconds: float = 60.0,
) -> Parts:
    """Make parts of the links of a moving mechanism, in the least number of layers where nothing collides.

    Parameters
    ----------
    motion : Motion
        Of a planar mechanism; its links are sheets, the frame is the board below all others.  Gears become wheels
        and rings with involute teeth, cams disks, each in the layer of what it touches.
    unit : float
        Millimetres of one unit of length of the mechanism.
    sizes : PartSizes, optional
        Thickness, diameters, wall, clearance; in proportion to the mechanism by default.
    prove : bool
        Prove by intervals that the parts stay clear of each other over the whole motion; else, and where that fails,
        it is estimated at the samples.
    max_boxes, seconds : optional
        Limits of the proof of the motion, as in `graphsynth.certify`.

    Returns
    -------
    Parts
        Outlines, layers, pins, bill of parts, mass properties.

    Raises
    ------
    GeometryError
        Gears that cannot mesh, a motion that is nowhere assembled, holes that overlap; or no layering without a
        collision: the message names the parts and the inputs at which they meet.

    Examples
    --------
    >>> from graphsynth import gallery, simulate
    >>> made = parts(simulate(gallery.chebyshev_lambda()), unit=40.0)
    >>> made.layers, made.certified
    ((0, 1, 2, 1), True)
    """
    if not isinstance(motion, Motion):
        raise GeometryError(f"{type(motion).__name__} is not a motion of graphsynth.simulate; give one")
    begin, unit = perf_counter(), positive("unit", unit)
    if not 1e-9 <= unit <= 1e9:
        raise GeometryError(f"unit = {unit:g} mm is no unit of length of a part; give 1e-9 to 1e9")
    reached = motion.poses[motion.assembled] * [unit, unit, 1.0]
    if len(reached) < 2:
        raise GeometryError(f"{len(reached)} poses of the motion are assembled; parts need a motion of two or more")
    tube, reason = _tube(motion, unit, max_boxes, seconds) if prove else (None, "no proof was asked for")
    given = PartSizes() if sizes is None else sizes
    mechanism = motion.mechanism
    check(motion)
    travel = _travel(motion, unit, reached if tube is None else np.concatenate([reached, tube.poses()]))
    own = plan(mechanism, given, unit, travel, reached[0])
    if tube is not None and (short := _short_slot(motion, own, unit, travel, tube)):
        tube, reason = None, short
    at = motion.inputs[motion.assembled]
    hazards = Hazards(own, mechanism.frame, reached, at)
    layers = _stacked(hazards, tube)
    if layers is None:  # one link of two sheets: those with the fewest layers are proved first
        tried = [Hazards(other, mechanism.frame, reached, at) for other in divided(own, mechanism.frame)]
        found = [(other, least) for other in tried if (least := least_layers(other.stacking())) is not None]
        for other, _ in sorted(found, key=lambda one: (max(one[1]), one[0].length(one[1]))):
            layers = _stacked(other, tube)
            if layers is not None:
                hazards = other
                break
        else:
            raise GeometryError(f"no layers without a collision: {'; '.join(map(str, hazards.impossible()))}")
    gap = min((hazards.known[pair].gap for pair in hazards.relied(layers)), default=math.inf)
    collisions = tuple(map(hazards.collision, hazards.kept_apart))
    return Parts(motion, unit, hazards.plan, layers, not reason, reason, gap, collisions, perf_counter() - begin)


def _stacked(hazards: Hazards, tube: Tube | None) -> tuple[int, ...] | None:
    """Return layers whose gaps are proved, if there is a tube to prove them in; None if there is no layering."""
    while True:
        layers = least_layers(hazards.stacking())
        if layers is None or tube is None or not hazards.refuted(layers, tube):
            return layers


def _tube(motion: Motion, unit: float, max_boxes: int, seconds: float) -> tuple[Tube | None, str]:
    """Return proved poses over the whole motion in millimetres, or why there are none."""
    try:
        found = enclosures(motion, max_boxes=max_boxes, seconds=seconds)
        finer = None if found.reason else _finer(motion, found)
        if finer is not None and not (second := enclosures(finer, max_boxes=max_boxes, seconds=seconds)).reason:
            found = second
    except GeometryError as error:
        return None, str(error)
    if found.reason:
        return None, found.reason
    lengths = np.array([unit, unit, 1.0])
    return Tube(found.u_mid, found.u_rad, *(array * lengths for array in (found.x, found.V, found.radius))), ""


def _finer(motion: Motion, found: Enclosures) -> Motion | None:
    """Return the motion with more samples where the boxes around its exact poses are wide; None if nowhere.

    A box is as wide as the square of its range of inputs.  The finer motion begins at the same pose, and a proved
    branch has only one continuation, so it is the same branch.
    """
    inputs, Lc = motion.inputs, motion.Lc
    wide = (np.hypot(found.radius[:, :, 0], found.radius[:, :, 1]) / Lc + found.radius[:, :, 2]).max(axis=1)
    pieces = np.ceil(np.sqrt(wide / _WIDE))
    sense = 1.0 if inputs[-1] > inputs[0] else -1.0
    if pieces.max() <= 1.0 or not (np.diff(inputs) * sense > 0.0).all() or pieces.sum() > _SAMPLES:
        return None
    owner = np.clip(np.searchsorted(inputs * sense, found.u_mid * sense) - 1, 0, len(inputs) - 2)
    counts = np.bincount(owner, weights=pieces, minlength=len(inputs) - 1).astype(int)
    runs = [np.linspace(a, b, max(n, 1) + 1)[:-1] for a, b, n in zip(inputs[:-1], inputs[1:], counts)]
    finer = simulate(motion.mechanism, np.append(np.concatenate(runs), inputs[-1]), start=motion.poses[0], events=False)
    same = np.abs(finer.poses[0] - motion.poses[0]).max() <= _SAME * (1.0 + np.abs(motion.poses[0]).max())
    return finer if finer.completed and same else None


def _slots(motion: Motion, unit: float) -> list[tuple[Prismatic | PinSlot, Solid, Solid]]:
    """Return the joints with slots, the point that slides and the point on the line."""
    return [
        (joint, Solid(joint.b, _point(joint.at_b, unit)), Solid(joint.a, _point(joint.at_a, unit)))
        for joint in motion.mechanism.joints
        if isinstance(joint, Prismatic | PinSlot)
    ]


def _point(at: tuple[float, float], unit: float) -> Rounded:
    return Rounded((complex(*at) * unit,), 0.0)


def _travel(motion: Motion, unit: float, poses: Array) -> dict[tuple[int, int], tuple[float, float]]:
    """Return how far the pins in slots travel at poses, in millimetres."""
    found = {}
    for joint, guide, line in _slots(motion, unit):
        ways = (corners(guide, poses) - corners(line, poses))[:, 0]
        s = (ways * np.exp(-1j * (poses[:, joint.a, 2] + joint.angle_a))).real
        found[joint.pair] = (float(s.min()), float(s.max()))
    return found


def _short_slot(motion: Motion, own: PartsPlan, unit: float, travel: Travel, tube: Tube) -> str:
    """Return which slot is not proved long enough over the whole motion; empty if all are."""
    for joint, guide, line in _slots(motion, unit):
        low, high = travel[joint.pair]
        room = own.sizes.clearance
        if not proved_travel(guide, line, joint.angle_a, tube, (low - room, high + room)):
            return f"the slot of joint {joint.a}-{joint.b} is not proved long enough between the samples"
    return ""
