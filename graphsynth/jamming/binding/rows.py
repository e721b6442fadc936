"""Rows of the closure over a motion, in metres and radians, and their derivatives by the input.

In the loop wrenches ``y = (M_l, f_l)`` of `graphsynth.jamming.joints.closure` joint j carries the moment ``A(r_j) y_j``
with ``A(x) = (1, -J x)`` and the sum ``y_j`` of the loops through it.  So does every section of a link's arm to the
joint, at its own place x.  Joints and links are springs in series: their compliances add up to one matrix K of the
wrenches.  See theory/what-binding-costs 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.binding.parts import JointStiffness, LinkSection
from graphsynth.jamming.joints.closure import ROLL, ROUND, carried, joint_places, leans, moment_rows, work_row
from graphsynth.mechanism.joints import PinSlot, Prismatic

if TYPE_CHECKING:
    from graphsynth.jamming.joints.program import JointProblem
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
#: Gauss points of an arm: exact for squares of moments that are linear along it.
_GAUSS = 0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0)
_STEP = 1e-40
#: Arms shorter than this, relative to the farthest place, have no length but by rounding.
_POINT = 1e-12


class Rows(NamedTuple):
    """Of N poses and k loop wrenches: ``M`` (N, blocks, 2, k), ``W`` (N, k), ``K`` (N, k, k), and derivatives."""

    M: Array
    W: Array
    K: Array
    M_rate: Array
    W_rate: Array
    K_rate: Array


def rows_of(
    given: JointProblem,
    springs: Sequence[JointStiffness],
    beams: Sequence[LinkSection | None],
    poses: Array,
    rates: Array,
    unit: float,
) -> Rows:
    """Rows at poses (N, links, 3) with rates by the input; ``unit``: metres of the mechanism's unit of length."""
    layout, mechanism = given.layout, given.mechanism
    if len(poses) == 0:
        k = 3 * layout.loops
        shapes = ((0, len(layout.limit), 2, k), (0, k), (0, k, k)) * 2
        return Rows(*(np.zeros(shape) for shape in shapes))
    at = joint_places(mechanism, layout.joints, poses)
    spin = 1j * rates[..., 2] * np.exp(1j * poses[..., 2])
    by = carried(mechanism, layout.joints, rates[..., 0] + 1j * rates[..., 1], spin, 0.0)
    at, by = (own._replace(r=unit * own.r, rail=unit * own.rail) for own in (at, by))

    def moments(at: Places) -> Array:
        return moment_rows(layout, at.r, at.e)

    def work(at: Places) -> Array:
        return work_row(layout, leans(layout, at))

    K = _compliance(given, springs, beams, at.r + 1j * _STEP * by.r, at.e + 1j * _STEP * by.e)
    M, W = moments(at), work(at)
    return Rows(M, W, K.real.copy(), _bilinear(moments, at, by), _bilinear(work, at, by), K.imag / _STEP)


def _bilinear(function: Callable[..., Array], at: Places, by: Places) -> Array:
    """Differentiate a function of second degree: the central difference is exact, whatever the step."""
    size = max(float(np.abs(part).max(initial=0.0)) for part in by)
    step = 1.0 / size if size > 0.0 else 1.0
    ahead, behind = (Places(*(p + sign * step * q for p, q in zip(at, by))) for sign in (1.0, -1.0))
    return np.asarray((function(ahead) - function(behind)) / (2.0 * step))


def _compliance(
    given: JointProblem,
    springs: Sequence[JointStiffness],
    beams: Sequence[LinkSection | None],
    r: NDArray[Any],
    e: NDArray[Any],
) -> NDArray[Any]:
    """Sum of the compliances of joints and arms (N, k, k); complex places give the derivative as imaginary part."""
    layout = given.layout
    own = np.zeros((*r.shape[:2], 3, 3), dtype=np.complex128)
    eye = np.eye(2)
    for b, place in enumerate(layout.block_joint.tolist()):
        spring = springs[layout.joints[place]]
        if math.isinf(layout.limit[b]) or math.isinf(spring.tilt):
            continue
        kind, lean = layout.block_axis[b], e[:, place]
        across = np.stack([-lean[:, 1], lean[:, 0]], -1)
        axis = lean if kind == ROLL else across
        within = np.broadcast_to(eye, (len(r), 2, 2)) if kind == ROUND else axis[:, :, None] * axis[:, None, :]
        own[:, place] += _spring(r[:, place], within) / spring.tilt
    for place, k in enumerate(layout.joints):
        if math.isfinite(layout.end_float[place]):
            own[:, place, 2, 2] += 1.0 / springs[k].axial
    for link, beam in enumerate(beams):
        joints = [place for place, pair in enumerate(layout.pairs.tolist()) if link in pair]
        if beam is not None and joints:
            hub = r[:, joints].mean(axis=1)
            for place in joints:
                own[:, place] += _arm(hub, r[:, place], beam)
    loops = layout.incidence
    K = np.einsum("aj,bj,njuv->naubv", loops, loops, own)
    return np.asarray(K.reshape(len(r), 3 * layout.loops, 3 * layout.loops))


def _spring(x: NDArray[Any], within: NDArray[Any]) -> NDArray[Any]:
    """``A(x)' P A(x)`` for places (N, 2) and matrices P (N, 2, 2)."""
    A = np.zeros((len(x), 2, 3), dtype=np.complex128)
    A[:, 0, 0] = A[:, 1, 1] = 1.0
    A[:, 0, 2], A[:, 1, 2] = -x[:, 1], x[:, 0]
    return np.asarray(A.transpose(0, 2, 1) @ within @ A)


def _arm(hub: NDArray[Any], end: NDArray[Any], beam: LinkSection) -> NDArray[Any]:
    """Compliance of a straight arm: bending about the line across it, torsion about its own."""
    way = end - hub
    length = np.sqrt((way**2).sum(axis=1))
    apart = np.abs(length) > _POINT * np.abs(end).max()  # a link whose joints are at one place has no arm there
    if not apart.any():
        return np.zeros((len(hub), 3, 3))
    length = np.where(apart, length, 0.0)
    e = way / np.where(apart, length, 1.0)[:, None]
    along = e[:, :, None] * e[:, None, :]
    within = along / beam.torsion + (np.eye(2) - along) / beam.bending
    both = sum(_spring(hub + share * way, within) for share in _GAUSS)
    return np.asarray(0.5 * length[:, None, None] * both)


def joint_rates(mechanism: Mechanism, poses: Array, rates: Array) -> tuple[Array, Array]:
    """Rates of turn and of travel of every joint, b against a, each (N, joints); a travel is in the unit of length."""
    turn, travel = (np.zeros((len(poses), len(mechanism.joints))) for _ in range(2))
    links = np.exp(1j * poses[..., 2])
    for k, joint in enumerate(mechanism.joints):
        turn[:, k] = rates[:, joint.b, 2] - rates[:, joint.a, 2]
        if isinstance(joint, Prismatic | PinSlot):
            arm = links[:, joint.b] * complex(*joint.at_b)
            apart = (poses[:, joint.b, :2] - poses[:, joint.a, :2]) @ np.array([1.0, 1j]) + arm
            speed = (rates[:, joint.b, :2] - rates[:, joint.a, :2]) @ np.array([1.0, 1j])
            speed = speed + 1j * (rates[:, joint.b, 2] * arm - rates[:, joint.a, 2] * apart)
            travel[:, k] = (np.conj(links[:, joint.a] * np.exp(1j * joint.angle_a)) * speed).real
    return turn, travel


def driven_rate(motion: Motion, unit: float) -> Array:
    """Rate of the driven coordinate by the input, radians or metres, (n,); 1 for several drivers."""
    mechanism = motion.mechanism
    if len(mechanism.drivers) != 1:
        return np.ones(len(motion.inputs))
    driver = mechanism.drivers[0]
    k = [joint.pair for joint in mechanism.joints].index(driver.pair)
    turn, travel = joint_rates(mechanism, motion.poses, motion.velocities)
    own = unit * travel if isinstance(mechanism.joints[k], Prismatic) else turn
    return np.asarray(own[:, k] if mechanism.joints[k].a == driver.base else -own[:, k])
