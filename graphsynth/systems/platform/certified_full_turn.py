"""`certify_full_turn`: proof that the single-motor platform makes a full rotation on one branch.

Drives by the exact condition of theory/platform-drive 5; the platform by linked moving boxes that cover the rotation
and close at exactly 2 pi; the working mode by enclosures of the reach of every leg over these boxes.

Unknowns: the angles ``phi_k`` of the drive arms in the fixed frame, and the pose ``(x, y, alpha)``; the input is the
wheel angle psi.  Equations ``h_k = |C_k - B_k|^2 - l_BC^2`` and ``f_k = |F_k - A_k|^2 - l2^2``.  Every angle of the
dimensions (frame, phase, bell-crank) is a ball of a few 1e-16 rad around the given number, so that -pi/6 and the
double nearest to it are both meant.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import TINY, UP, Balls, exact, stack, tau_times, unit
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.moving import Boxes, Budget, Cover, Nodes, cover, prove_nodes, whole_turns
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]

#: Angles of the dimensions are meant within this many radians.
ANGLE = 5e-16
_NODES = 73
_SPLIT = 12
Arcs = tuple[tuple[int, float, float, bool], ...]


class _Vectors(NamedTuple):
    """Balls (N, 3): arms and links of the three legs, and crank."""

    crank: Balls  # B - O
    link: Balls  # C - B
    arm: Balls  # C - D
    rocker: Balls  # A - D
    leg: Balls  # F - A
    vertex: Balls  # F - p
    reach: Balls  # F - D


class PlatformSystem:
    """Equations of a `SingleMotorPlatform` as a `System` of the Krawczyk test."""

    def __init__(self, platform: SingleMotorPlatform) -> None:
        self.platform = platform
        turn = unit(_near(platform.frame_angle))
        self.O, self.D, self.b = (
            exact(np.array(v, dtype=np.complex128)) * turn for v in (platform.axis, platform.pivot, platform.vertex)
        )
        self.bell = unit(_near(platform.delta))
        self.lengths = {
            name: exact(np.array(getattr(platform, name))) for name in ("crank", "coupler", "rocker", "l1", "l2")
        }

    @property
    def weights(self) -> Array:
        """1 for angles, the characteristic length for x and y."""
        Lc = self.platform.Lc
        return np.array([1.0, 1.0, 1.0, Lc, Lc, 1.0])

    def units(self, x: Array, u: Array, checked: bool = True) -> Balls:
        """Directions of the three arms, of the platform and of the three cranks, (N, 7)."""
        crank = exact(u[:, None]) + _near(self.platform.phase)
        angles = np.concatenate([x[:, :3], x[:, 5:6], crank.mid], axis=1)
        rad = np.concatenate([np.zeros((len(x), 4)), crank.rad], axis=1)
        if checked:
            return unit(Balls(angles, rad))
        return exact(np.exp(1j * np.where(np.isfinite(angles), angles, 0.0)))

    def _vectors(self, x: Balls, u: Balls, units: Balls) -> _Vectors:
        n = self.lengths
        arm = units[:, :3].wider(x.rad[:, :3])
        vertex = units[:, 3:4].wider(x.rad[:, 5:6]) * self.b
        crank = units[:, 4:].wider(np.broadcast_to(u.rad[:, None], (len(u.mid), 3))) * n["crank"]
        place = Balls(x.mid[:, 3:4] + 1j * x.mid[:, 4:5], x.rad[:, 3:4] + x.rad[:, 4:5]).wider(0.0)
        arm_c, rocker = arm * n["rocker"], arm * self.bell * n["l1"]
        link = (self.D - self.O) + arm_c - crank
        reach = (place - self.D) + vertex
        return _Vectors(crank, link, arm_c, rocker, reach - rocker, vertex, reach)

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        """``(h_1, h_2, h_3, f_1, f_2, f_3)``, shape (N, 6)."""
        v, n = self._vectors(x, u, units), self.lengths
        h = _square(v.link) - n["coupler"] * n["coupler"]
        f = _square(v.leg) - n["l2"] * n["l2"]
        return _beside(h, f)

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """Jacobian (N, 6, 6) and derivative by psi (N, 6)."""
        v = self._vectors(x, u, units)
        h_phi, f_phi = 2.0 * _cross(v.arm, v.link), -(2.0 * _cross(v.rocker, v.leg))
        columns = stack([2.0 * v.leg.real, 2.0 * v.leg.imag, 2.0 * _cross(v.vertex, v.leg)])
        h_psi = -(2.0 * _cross(v.crank, v.link))
        N, k = len(x.mid), np.arange(3)
        jacobian = Balls(np.zeros((N, 6, 6)), np.zeros((N, 6, 6)))
        for part in ("mid", "rad"):
            of, h, f, legs = (getattr(value, part) for value in (jacobian, h_phi, f_phi, columns))
            of[:, k, k], of[:, 3 + k, k], of[:, 3:, 3:] = h, f, legs
        return jacobian, _beside(h_psi, exact(np.zeros((N, 3))))

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Nothing is counted: all angles enter through their directions."""
        return np.zeros((len(x.mid), 0), dtype=np.int64), exact(np.zeros((len(x.mid), 0)))

    def bounds(self, x: Balls, u: Balls) -> tuple[Balls, Balls, Balls, Balls]:
        """Enclosures (N, 3) of ``P1``, ``P2`` (both positive inside the reach), ``JT`` of the legs and ``h_phi``."""
        v, n = self._vectors(x, u, self.units(x.mid, u.mid)), self.lengths
        rho2, total, gap = _square(v.reach), n["l1"] + n["l2"], n["l1"] - n["l2"]
        JT, h_phi = -(2.0 * _cross(v.rocker, v.leg)), 2.0 * _cross(v.arm, v.link)
        return total * total - rho2, rho2 - gap * gap, JT, h_phi


def _beside(a: Balls, b: Balls) -> Balls:
    return Balls(np.concatenate([a.mid, b.mid], axis=1), np.concatenate([a.rad, b.rad], axis=1))


def _near(angles: tuple[float, float, float]) -> Balls:
    mid = np.array(angles, dtype=np.float64)
    return Balls(mid, np.full(3, ANGLE) * np.maximum(1.0, np.abs(mid)) * UP)


def _cross(a: Balls, b: Balls) -> Balls:
    return (a.conj * b).imag


def _square(z: Balls) -> Balls:
    return z.real * z.real + z.imag * z.imag


class TurnVerdict(StrEnum):
    """Outcome for a full rotation of the wheels."""

    CERTIFIED_FULL_TURN = "certified full rotation"
    NOT_FULL_TURN = "proved: no full rotation"
    CHANGE_POINT = "proved: change point"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class FullTurnCertificate:
    """What is proved about a full rotation.

    Attributes
    ----------
    verdict : TurnVerdict
        CERTIFIED_FULL_TURN: no drive locks or changes its branch, ``det JX`` vanishes nowhere on the branch through the
        start pose, and the pose after exactly 2 pi is the start pose.  NOT_FULL_TURN and CHANGE_POINT are exact
        statements on the drives.
    drives : tuple of str
        Exact kind of every drive: "full turn", "change point", "limited", "immovable" or "never assembled".
    covered : float
        The branch is proved for wheel angles from 0 to here (radians; 0 if nothing is).
    sigma : tuple of int
        Working mode at psi = 0; zeros where it is not proved.
    working_mode_constant : bool or None
        True: proved constant over ``covered``; False: a change is proved; None: not decided, or no cover.
    mode_arcs : tuple of (leg, start, stop, changes)
        Arcs of psi in which leg 1 to 3 may pass its boundary; ``changes`` tells that its sign is proved different
        before and after.
    boxes : int
        Moving boxes tested.
    reason : str
        Why the verdict is UNDECIDED, or what forbids it; empty if it is certified.
    seconds : float
    statement : str
    """

    verdict: TurnVerdict
    drives: tuple[str, str, str]
    covered: float
    sigma: tuple[int, int, int]
    working_mode_constant: bool | None
    mode_arcs: Arcs
    boxes: int
    reason: str
    seconds: float
    statement: str
    _cover: tuple[PlatformSystem, Boxes, Array] | None = None

    @property
    def certified(self) -> bool:
        """Whether the full rotation is certified."""
        return self.verdict is TurnVerdict.CERTIFIED_FULL_TURN

    def enclosure(self, psi: float) -> tuple[Array, Array]:
        """Pose ``(x, y, alpha)`` on the proved branch at the wheel angle ``psi`` in [0, covered]: midpoint and radius.

        Raises
        ------
        GeometryError
            If no proved box contains ``psi``.
        """
        if self._cover is not None and 0.0 <= psi <= self.covered:
            system, boxes, tight = self._cover
            hits = np.flatnonzero(np.abs(psi - boxes.u.mid) * UP <= boxes.u.rad)
            u = exact(np.array([psi], dtype=np.float64))
            for hit in hits:
                box = boxes.take(np.array([hit])).at(u)
                node = prove_nodes(system, u, box.mid)
                # the solution is in the tight box around the moving centre, and the node's box holds only one
                apart = (box - exact(node.x)).size + tight[hit]
                if bool(node.proof.proved[0]) and bool((apart * UP < node.proof.radius).all()):
                    return node.x[0, 3:], node.proof.tight[0, 3:]
        raise GeometryError(f"psi = {psi} is outside the proved arc [0, {self.covered:.9g}]; give an angle inside it")


def certify_full_turn(
    mechanism: SingleMotorPlatform, *, start: ArrayLike | None = None, max_boxes: int = 100_000, seconds: float = 60.0
) -> FullTurnCertificate:
    """Prove or disprove a full rotation of the wheels on the branch through a pose.

    Parameters
    ----------
    mechanism : SingleMotorPlatform
        Lengths and points in the frames of the legs are taken as exact; every angle is meant within 5e-16 rad.
    start : array_like, shape (3,), optional
        Pose near the branch at psi = 0; the home branch by default.
    max_boxes, seconds : optional
        Limits of the work.

    Returns
    -------
    FullTurnCertificate

    Raises
    ------
    GeometryError
        For anything but a `SingleMotorPlatform`.

    Notes
    -----
    See theory/platform-drive 5.

    Examples
    --------
    >>> proof = certify_full_turn(SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1)))
    >>> proof.certified, proof.sigma, proof.working_mode_constant
    (True, (-1, -1, -1), True)
    """
    begin = perf_counter()
    check_rounding()
    if not isinstance(mechanism, SingleMotorPlatform):
        raise GeometryError(f"{type(mechanism).__name__} is not a SingleMotorPlatform; certify proves other motions")
    kinds = [turn.kind for turn in mechanism.drive_turns()]
    drives = (kinds[0], kinds[1], kinds[2])
    verdict, reason, motion = TurnVerdict.UNDECIDED, "", None
    for outcome, bad in (
        (TurnVerdict.CHANGE_POINT, ("change point",)),
        (TurnVerdict.NOT_FULL_TURN, ("limited", "immovable", "never assembled")),
    ):
        legs = [str(k) for k, kind in enumerate(drives, 1) if kind in bad]
        words = " and ".join(dict.fromkeys(kind for kind in drives if kind in bad))
        if legs:
            verdict, reason = outcome, f"drive {', '.join(legs)}: {words}, decided exactly"
    if not reason:
        try:
            motion = mechanism.full_turn(_NODES, start)
        except GeometryError as error:
            reason = f"there is no start pose: {error}"
    if motion is None:
        took, text = perf_counter() - begin, f"{verdict}: {reason}"
        return FullTurnCertificate(verdict, drives, 0.0, (0, 0, 0), None, (), 0, reason, took, text)
    system, u = PlatformSystem(mechanism), exact(motion.psi)
    if motion.complete:  # it ends at exactly 2 pi
        u.rad[-1] = (tau_times(1.0) - exact(motion.psi[-1])).size
    nodes = prove_nodes(system, u, np.column_stack([motion.theta - np.array(mechanism.delta), motion.pose]))
    found = cover(system, nodes, Budget(max_boxes, seconds), begin)
    return _conclude(system, nodes, found, drives, motion.stop_reason(), begin)


@np.errstate(all="ignore")
def _conclude(
    system: PlatformSystem, nodes: Nodes, found: Cover, drives: tuple[str, str, str], stopped: str, begin: float
) -> FullTurnCertificate:
    whole = not stopped and bool(found.covered.all())
    covered, boxes = _covered(nodes, found, whole)
    closed = whole and whole_turns(nodes, np.array([True, True, True, False, False, True])) is not None
    signs = np.zeros((2, 3), dtype=int)  # working mode and drive branches at the first node; 0 where not proved
    first = nodes.take(np.array([0]))
    if bool(first.proof.proved[0]):
        bounds = system.bounds(exact(first.x).wider(first.proof.tight), first.u)[2:]
        signs = np.array([np.where(b.least > 0.0, np.sign(b.mid), 0.0)[0] for b in bounds], dtype=int)
    sigma = (int(signs[0, 0]), int(signs[0, 1]), int(signs[0, 2]))
    constant, arcs = _working_mode(system, *boxes) if boxes is not None else (None, ())
    verdict, reason = TurnVerdict.UNDECIDED, ""
    if stopped:
        reason = f"the motion itself ends: {stopped}"
    elif found.exhausted:
        reason = f"the limit of work was reached after {found.tested} boxes"
    elif not whole:
        a, b = sorted(found.undecided)[0]
        reason = f"no single regular branch is proved between psi = {a:.12g} and {b:.12g}"
    elif tuple(signs[1]) != system.platform.tau:
        reason = "the drive branch is unclear"
    elif not closed:
        reason = "the pose after the rotation is not proved to be the start pose"
    else:
        verdict = TurnVerdict.CERTIFIED_FULL_TURN
    text = f"{verdict}: {reason}; proved from psi = 0 to {covered:.9g}" if reason else f"{verdict}: one regular branch"
    if constant is not None:
        text += "; the working mode is proved constant" if constant else "; a change of the working mode is proved"
    seconds, proof = perf_counter() - begin, None if boxes is None else (system, *boxes)
    return FullTurnCertificate(
        verdict, drives, covered, sigma, constant, arcs, found.tested, reason, seconds, text, proof
    )


def _covered(nodes: Nodes, found: Cover, whole: bool) -> tuple[float, tuple[Boxes, Array] | None]:
    """End of the arc proved without a gap from the first node, and its boxes in order."""
    limit = float(nodes.u.mid[-1])
    if not whole:
        limit = min([limit, *(a for a, _ in found.undecided)])
    if not found.boxes:
        return 0.0, None
    boxes, tight = found.boxes[0]
    for part, radius in found.boxes[1:]:
        boxes, tight = boxes.join(part), np.concatenate([tight, radius])
    order = np.argsort(boxes.u.mid)
    order = order[boxes.u.mid[order] < limit]
    return (limit, (boxes.take(order), tight[order])) if order.size else (0.0, None)


def _working_mode(system: PlatformSystem, boxes: Boxes, tight: Array) -> tuple[bool | None, Arcs]:
    """Decide by enclosures of P1, P2 and JT whether a leg passes its boundary; halve the slices that do not decide.

    Slices that stay undecided are merged into arcs; the proved signs on both sides of each are compared.
    """
    slices = np.column_stack([boxes.u.mid - boxes.u.rad, boxes.u.mid + boxes.u.rad])
    own = np.arange(len(slices))
    kept = []  # start and stop of a slice; for each leg whether it is clear, and its proved sign
    for depth in range(_SPLIT + 1):
        middle = 0.5 * (slices[:, 0] + slices[:, 1])
        u = Balls(middle, np.maximum(slices[:, 1] - middle, middle - slices[:, 0]) * UP + TINY)
        P1, P2, JT, _ = system.bounds(boxes.take(own).at(u).wider(tight[own]), u)
        # JT^2 = P1 P2 on the closure: either form may decide
        good = (JT.least > 0.0) | ((P1.mid > P1.rad * UP) & (P2.mid > P2.rad * UP))
        signs = np.where(good, np.sign(JT.mid) * (JT.least > 0.0), 0.0)
        done = good.all(axis=1) | (depth == _SPLIT)
        kept.append(np.column_stack([slices, good, signs])[done])
        middle, slices, own = middle[~done], slices[~done], np.tile(own[~done], 2)
        if own.size == 0:
            break
        slices = np.concatenate([np.column_stack([slices[:, 0], middle]), np.column_stack([middle, slices[:, 1]])])
    rows = np.concatenate(kept)
    rows = rows[np.argsort(rows[:, 0])]
    found = []
    for leg in range(3):
        clear, signs = rows[:, 2 + leg], rows[:, 5 + leg]
        edges = np.flatnonzero(np.diff(clear, prepend=1.0, append=1.0)).reshape(-1, 2)
        for first, stop in edges.tolist():
            before = next((s for s in signs[:first][::-1] if s), 0.0)
            after = next((s for s in signs[stop:] if s), 0.0)
            found.append((leg + 1, float(rows[first, 0]), float(rows[stop - 1, 1]), bool(before * after < 0.0)))
    changes = any(change for *_, change in found)
    return (True if not found else False if changes else None), tuple(found)
