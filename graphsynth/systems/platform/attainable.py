"""What crank lengths alone can do when the phases are given; drives for two poses in which the mechanism reverses."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array, plane_point, positive, three
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.inverse_design import Design, _wanted, assess_design
from graphsynth.systems.platform.small_crank import small_crank

if TYPE_CHECKING:
    from graphsynth.systems.platform.motion import TurnMotion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Attainable:
    """How well real signed crank lengths approach a straight motion, to first order in the cranks.

    * `off_direction`: smallest share of the energy ``|Xi|^2`` (with ``Lc``) off the wanted direction: 0 if it is
      attainable.
    * `lengths` (shape (3,)): signed crank lengths of the best motion, scaled to a largest length of 1; a negative sign
      means keying by 180 degrees.
    * `phasor` (shape (3,), complex): first harmonic of these lengths.
    * `ellipticity`: ratio of its semi-axes in pose space: 0 for a straight motion.
    """

    off_direction: float
    lengths: Array
    phasor: Complex
    ellipticity: float
    Lc: float


@checked
def ellipticity(phasor: ArrayLike, Lc: float) -> float:
    """Ratio of the semi-axes of the ellipse ``Re(Xi exp(i psi))`` in pose space: 0 straight, 1 circular.

    >>> ellipticity([1.0, 1j, 0.0], 45.0), ellipticity([1.0, 2.0, 0.0], 45.0)
    (1.0, 0.0)
    """
    parts = zip(("x", "y", "alpha"), three("phasor", phasor))
    scaled = np.array([plane_point(f"phasor of {name}", v) for name, v in parts]) * [1.0, 1.0, positive("Lc", Lc)]
    axes = np.linalg.svd(np.column_stack([scaled.real, scaled.imag]), compute_uv=False)
    return float(axes[1] / axes[0]) if axes[0] > 0.0 else 0.0


def _gains(mechanism: SingleMotorPlatform) -> Complex:
    return np.asarray(small_crank(mechanism).gains * np.array([1.0, 1.0, mechanism.Lc])[:, None])


@checked
def attainable(mechanism: SingleMotorPlatform, direction: ArrayLike) -> Attainable:
    """Best straight motion along a direction in pose space with the phases of the mechanism, lengths free.

    `mechanism`: its phases are kept, its crank lengths ignored. `direction` (shape (3,)): real direction ``(x, y,
    alpha)``: lengths, lengths, radians. Floating point, first order in the cranks. Raises `GeometryError`: a direction
    without three numbers, or of zeros. See theory/inverse-design 4: ``1 - mu`` with mu the largest eigenvalue of the
    pencil ``(Re(g g^H), Re(G^H G))``, ``g = G^H t``.

    With equal global phases no translation is straight; with phases equal in each leg's own frame every motion is.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> round(attainable(SingleMotorPlatform(), [1.0, 0.0, 0.0]).off_direction, 12)
    0.175858187957
    >>> legs = SingleMotorPlatform(phase=SingleMotorPlatform().frame_angle)
    >>> attainable(legs, [1.0, 0.0, 0.0]).off_direction < 1e-14
    True
    """
    scale = np.array([1.0, 1.0, mechanism.Lc])
    t = finite_array("direction", direction).reshape(-1)
    if t.shape != (3,) or not t.any():
        raise GeometryError(f"direction = {t.tolist()} must hold three numbers, not all zero: x, y, alpha")
    t = t * scale / np.linalg.norm(t * scale)
    G = _gains(mechanism)
    stacked = np.concatenate([G.real, G.imag])  # |Xi|^2 = |stacked l|^2
    _, values, right = np.linalg.svd(stacked, full_matrices=False)
    keep = values > 1e-12 * values[0]
    basis = right[keep].T / values[keep]  # lengths of motions with unit energy
    along = np.stack([t @ G.real, t @ G.imag]) @ basis
    best = np.linalg.svd(along)[2]
    # 1 - mu without cancellation: the energy across t of the best motion
    lengths = basis @ best[0]
    phasor = G @ lengths
    across = phasor - t * (t @ phasor)
    lengths = lengths / np.abs(lengths).max() * np.sign(lengths[int(np.argmax(np.abs(lengths)))])
    found = G @ lengths / scale
    return Attainable(
        float(np.linalg.norm(across)) ** 2, lengths, found, ellipticity(found, mechanism.Lc), mechanism.Lc
    )


@checked
def lengths_only_design(
    mechanism: SingleMotorPlatform, wanted: ArrayLike, *, free_phase: bool = True, samples: int = 96
) -> Design:
    """Least-squares crank lengths for a wanted first harmonic with the given phases, verified over the whole turn.

    `mechanism`: its phases are kept (modulo 180 degrees: a negative length is keyed the other way round). `wanted`:
    shape (3,), complex. `free_phase`: the motion may begin at any wheel angle: ``wanted`` is multiplied by the best
    ``exp(i chi)``, and ``Design.wanted`` is that product. ``error`` tells how far the result is from what was asked;
    `attainable` tells why.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> legs = SingleMotorPlatform(phase=SingleMotorPlatform().frame_angle)
    >>> lengths_only_design(legs, [2.0, 1.0, 0.0]).error < 1e-3
    True
    """
    target, theory = _wanted(wanted), small_crank(mechanism)
    scale = np.array([1.0, 1.0, mechanism.Lc])
    G = _gains(mechanism)
    stacked = np.concatenate([G.real, G.imag])
    if free_phase:
        left, values, _ = np.linalg.svd(stacked, full_matrices=False)
        basis = left[:, values > 1e-12 * values[0]]  # of the span that the product shall be nearest to
        pair = [np.concatenate([w.real, w.imag]) for w in (target * scale, 1j * target * scale)]
        best = complex(*np.linalg.svd(basis.T @ np.column_stack(pair))[2][0])
        target = target * (best if best.real >= 0.0 else -best)
    right = target * scale
    lengths = np.linalg.lstsq(stacked, np.concatenate([right.real, right.imag]), rcond=1e-12)[0]
    phase = np.array(mechanism.phase) + np.where(lengths < 0.0, np.pi, 0.0)
    designed = replace(mechanism, crank=tuple(np.abs(lengths).tolist()), phase=tuple(phase.tolist()))
    return assess_design(designed, target, theory.home, samples=samples)


@dataclass(frozen=True, eq=False)
class TwoPoseDesign:
    """Drives that put every rocker at a dead point in the first pose.

    * `mechanism`: none if the closed form has no solution.
    * `accepted`: branches, full turn and first pose were verified.
    * `reason`: why not.
    * `notes`: legs that need not move, identical poses.
    * `other_dead_point` (shape (3,)): wheel angle of the second dead point of each leg, radians; pi if crank axis and
      both rocker ends are in line.
    * `first_error`, `second_error`: distance of the pose at psi = 0 from X+ and at psi = pi from X- (length, with
      ``Lc``).
    * `off_line`: largest distance of the path from the segment's line between the two poses (length, with ``Lc``).
    * `motion`: the whole turn.
    """

    mechanism: SingleMotorPlatform | None
    accepted: bool
    reason: str
    notes: tuple[str, ...]
    other_dead_point: Array
    first_error: float
    second_error: float
    off_line: float
    motion: TurnMotion | None


@checked
def two_pose_design(
    mechanism: SingleMotorPlatform, first: ArrayLike, second: ArrayLike, *, samples: int = 96
) -> TwoPoseDesign:
    """Crank lengths, phases and coupler lengths such that all rockers reverse at psi = 0 exactly in the pose ``first``.

    `mechanism`: gives everything else; its home pose selects the working mode. `first`, `second` (shape (3,)): the
    poses X+ and X-. `samples`: samples of the verification. The error of the second pose is of second order in
    ``other_dead_point - pi``. Raises `GeometryError`: poses that are not three finite numbers. See
    theory/inverse-design 3: with the distances d+ and d- of the rocker ends from the wheel axis, ``l_B = |d+ - d-| /
    2`` and ``l_BC = (d+ + d-) / 2``.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> found = two_pose_design(SingleMotorPlatform(), [2.4, 1.8, 0.05], [-2.4, -1.8, -0.05])
    >>> found.accepted, [round(length, 6) for length in found.mechanism.coupler], found.first_error < 1e-12
    (True, [45.148548, 45.024889, 45.055871], True)
    """
    poses = [finite_array(name, value).reshape(-1) for name, value in (("first", first), ("second", second))]
    if any(pose.shape != (3,) for pose in poses):
        raise GeometryError("first and second must hold three numbers each: x, y, alpha")
    still = replace(mechanism, crank=(0.0, 0.0, 0.0))
    platform, turn = mechanism.platform, np.exp(1j * np.array(mechanism.frame_angle))
    sigma = tuple(int(s) for s in platform.working_mode(still.home_pose(0.0), still.drive(0.0).theta))
    solutions = [platform.inverse(pose, sigma) for pose in poses]
    for name, solution in zip(("first", "second"), solutions):
        for leg in np.flatnonzero(~np.isfinite(solution.theta))[:1]:
            missing = f"{solution.deficit[leg]:.6g} missing"
            return _rejected(None, f"leg {leg + 1} does not reach the {name} pose; {missing}")
    base = (np.array(mechanism.pivot) - np.array(mechanism.axis)) * turn
    ends = np.array([solution.theta - np.array(mechanism.delta) for solution in solutions])
    plus, minus = base + np.array(mechanism.rocker) * np.exp(1j * ends)  # from the wheel axes to the joints C
    far, near = np.abs(plus), np.abs(minus)
    for k in np.flatnonzero(far + near == 0.0)[:1]:
        return _rejected(None, f"drive {k + 1}: both rocker ends lie on the wheel axis")
    held = np.abs(far - near) <= 2e-15 * (far + near)
    with np.errstate(all="ignore"):
        other = np.where(held, np.nan, math.pi + np.angle(minus / plus))
    crank = np.where(held, 0.0, 0.5 * np.abs(far - near))
    phase = np.where(held, 0.0, np.angle(plus) + np.where(far > near, 0.0, math.pi))
    notes = [f"leg {k + 1} must not move: its crank length is 0" for k in np.flatnonzero(held)]
    if held.all():
        notes.append("both poses need the same rocker distances: all cranks are zero (trivial)")
    lengths = {"crank": crank, "coupler": 0.5 * (far + near), "phase": phase}
    changes: dict[str, Any] = {name: tuple(values.tolist()) for name, values in lengths.items()}
    return _verified(replace(mechanism, **changes), solutions[0].theta, poses, tuple(notes), other, samples)


def _rejected(mechanism: SingleMotorPlatform | None, reason: str, notes: tuple[str, ...] = ()) -> TwoPoseDesign:
    return TwoPoseDesign(mechanism, False, reason, notes, np.full(3, np.nan), math.nan, math.nan, math.nan, None)


def _verified(
    designed: SingleMotorPlatform,
    start: Array,
    poses: list[Array],
    notes: tuple[str, ...],
    other: Array,
    samples: int,
) -> TwoPoseDesign:
    """Follow a design over a rotation; ``start``: rocker angles in the first pose."""
    for number, turn in enumerate(designed.drive_turns(), start=1):
        if turn.kind != "full turn":
            return _rejected(designed, f"drive {number} makes no full rotation ({turn.kind})", notes)
    gap = np.abs(np.exp(1j * (designed.drive(0.0).theta - start)) - 1.0)
    for k in np.flatnonzero(gap > 1e-6)[:1]:
        text = f"drive {k + 1} reaches the first pose on the other branch, tau = {-designed.tau[k]}"
        return _rejected(designed, text, notes)
    motion = designed.full_turn(np.linspace(0.0, math.tau, 2 * (samples // 2) + 1), start=poses[0])
    if not motion.complete:
        return _rejected(designed, motion.stop_reason() or "the tracked pose is not an assembly mode", notes)
    reason = "" if motion.working_mode_constant else "a leg passes its boundary: the working mode changes"
    weight = np.array([1.0, 1.0, designed.Lc])
    path, line = (motion.pose - poses[0]) * weight, (poses[1] - poses[0]) * weight
    unit = line / (np.linalg.norm(line) or 1.0)
    off = float(np.linalg.norm(path - (path @ unit)[:, None] * unit, axis=1).max())
    first, second = (float(np.linalg.norm(gap)) for gap in (path[0], path[samples // 2] - line))
    return TwoPoseDesign(designed, not reason, reason, notes, other, first, second, off, motion)
