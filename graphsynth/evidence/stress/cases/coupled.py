"""Joints that share a misalignment: collinear, coincident, without limit (lambda page, 12.23 and 12.24)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["collinear", "unlimited"]


def collinear(check: Checks) -> None:
    """All joints on a line, and joints that coincide: still convex, with a dual that closes the gap.

    On a line through O at an angle to the tilt the field ``cross(a, r)`` is a plane over the line: with every joint on
    it the factor is the best quotient over points of that line and at infinity.
    """
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.jamming.joints import JointLimits, Misalignment, assess_coupled
    from graphsynth.kinematics.simulation import simulate

    flat = simulate(four_bar(1.0, 0.5, 1.5, 3.0), [0.0])  # A = (1, 0), B = (1.5, 0), C = (3, 0)
    for direction in (0.0, 1.0, math.pi / 2):
        report = assess_coupled(flat, JointLimits(1.0), Misalignment(0, 1, 0.01, direction))
        what = f"on a line, tilt at {direction:.2g} rad"
        check.below(f"{what}: primal minus dual", abs(float(report.gap[0])), 1e-12)
        right = _single_loop(flat, 0.01, direction)
        check.value(f"{what}: factor", report.factor[0], right, relative=1e-6, source="search over points, section 9.4")
    on_line = max(abs(y) for _, y in _joints(flat))
    check.below("the joints lie on a line", on_line, 1e-12)
    folded = simulate(four_bar(1.0, 1.0, 1.0, 1.0), [math.pi / 2], modes={0: 1})
    met = assess_coupled(folded, JointLimits(1.0), Misalignment(0, 1, 0.01, 1.0))
    check.below("rhombus: primal minus dual", abs(float(met.gap[0])), 1e-12)
    right = _single_loop(folded, 0.01, 1.0)
    check.value("rhombus: factor", met.factor[0], right, relative=1e-6, source="search over points, section 9.4")
    _coincident(check)


def _coincident(check: Checks) -> None:
    """Crank pin on the rocker's frame pivot: two joints at one point count twice there."""
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.jamming.joints import JointLimits, Misalignment, assess_coupled
    from graphsynth.kinematics.simulation import simulate

    near = simulate(four_bar(1.0, 1.5, 1.5, 1.0), [1e-7], modes={0: 1})
    joints = _joints(near)
    check.below(
        "distance of two joints", min(math.dist(joints[i], joints[j]) for i, j in ((0, 1), (0, 2), (1, 2))), 2e-7
    )
    report = assess_coupled(near, JointLimits(1.0), Misalignment(0, 1, 0.01, 1.0))
    check.below("coincident: primal minus dual", abs(float(report.gap[0])), 1e-9)
    right = _single_loop(near, 0.01, 1.0)
    check.value("coincident: factor", report.factor[0], right, relative=1e-6, source="search over points, section 9.4")


def _joints(motion: object) -> list[tuple[float, float]]:
    """Positions of the joints but that of the driver, at the only sample."""
    poses, joints = motion.poses[0], motion.mechanism.joints  # type: ignore[attr-defined]
    places = []
    for joint in joints:
        if joint.pair == (0, 1):
            continue
        x, y, theta = poses[joint.a]
        u, v = joint.at_a
        places.append((x + math.cos(theta) * u - math.sin(theta) * v, y + math.sin(theta) * u + math.cos(theta) * v))
    return places


def _single_loop(motion: object, alpha: float, direction: float) -> float:
    """Largest ``|cross(a, p - O)| / sum |p - r_j|`` over the plane: own nested search, limits of one, no play."""
    joints = np.array(_joints(motion))
    a = alpha * np.array([math.cos(direction), math.sin(direction)])

    def quotient(p: np.ndarray) -> np.ndarray:
        lift = np.abs(a[0] * p[..., 1] - a[1] * p[..., 0])
        return np.asarray(lift / np.hypot(*np.moveaxis(p[..., None, :] - joints, -1, 0)).sum(axis=-1))

    best = alpha / len(joints)  # p at infinity
    best = max(best, *(float(q) for q in np.nan_to_num(quotient(joints + 0.0))))
    centre = joints.mean(axis=0)
    for side in (1.0, -1.0):
        low, size = centre, 8.0
        for _ in range(40):
            offsets = np.linspace(-size, size, 41)
            p = low + np.stack(np.meshgrid(offsets, offsets), axis=-1)
            signed = side * (a[0] * p[..., 1] - a[1] * p[..., 0])
            with np.errstate(invalid="ignore"):
                q = np.where(signed > 0.0, quotient(p), -1.0)
            best = max(best, float(q.max()))
            low = p[np.unravel_index(int(q.argmax()), q.shape)]
            size *= 0.6
    return best


def unlimited(check: Checks) -> None:
    """Joint without limit: its constraint is gone and its moment in the dual is zero."""
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.jamming import Bearing
    from graphsynth.jamming.joints import FREE, RIGID, SPHERICAL, JointLimits, Misalignment, assess_coupled
    from graphsynth.kinematics.simulation import simulate

    linkage = four_bar(1.0, 2.5, 2.5, 2.0)
    f = np.radians([30.0, 90.0, 200.0])
    motion = simulate(linkage, f, modes={0: 1})
    tilt = Misalignment(0, 1, 1 / 30)
    loose = assess_coupled(motion, {(1, 2): SPHERICAL, (2, 3): SPHERICAL, (0, 3): RIGID}, tilt)
    check.values("two spherical joints: factor", loose.factor, [0, 0, 0])
    open_chain = assess_coupled(motion, {(1, 2): FREE, (2, 3): RIGID, (0, 3): RIGID}, tilt)
    check.mentions("a joint that guides nothing", open_chain.notes[0], "no closed loop")
    # a spherical joint at A and a rigid rocker leave all of the tilt to B: A_z / l3 to first order
    one = assess_coupled(motion, {(1, 2): SPHERICAL, (2, 3): Bearing(), (0, 3): RIGID}, tilt)
    critical = 0.006064396559156420060266102798724801172486
    right = np.abs(np.sin(f)) / 30.0 * 0.4 / critical
    check.values("one bearing alone: factor", one.factor, right, relative=1e-12, source="section 9.1")
    prices = dict(zip(one.names, one.price[1]))
    check.below("price of the joint without limit", float(np.nan_to_num(prices.get(((1, 2), "tilt"), 0.0))), 1e-12)
    rigid = assess_coupled(motion, RIGID, Misalignment(0, 1, 1e-6))
    check.agrees("limits of zero: the factor is infinite", np.isinf(rigid.factor).all())
    check.values("limits of zero: allowed scale", rigid.allowed_scale, [0, 0, 0])
    axial = {(1, 2): JointLimits(math.inf, 0.05), (2, 3): RIGID, (0, 3): RIGID}
    upright = simulate(linkage, [math.pi / 2], modes={0: 1})
    play = assess_coupled(upright, axial, Misalignment(0, 1, 0.1))
    # the crank pin rises by 0.1 against a play of 0.05
    check.value("axial play alone: allowed scale", play.allowed_scale[0], "0.5", relative=1e-12, source="closed form")
