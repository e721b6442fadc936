"""`certify_full_turn`: proof that the single-motor platform makes a full turn on one branch.

Drives by the exact condition of theory/platform-drive 5; the platform by moving boxes that cover
the turn, linked, and closed at exactly 2 pi; the working mode by enclosures of the reach of every leg over these boxes.

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


class _Vectors(NamedTuple):
    """Balls (N, 3): arms and links of the three legs, and crank."""

    crank: Balls  # B - O
    link: Balls  # C - B
    arm: Balls  # C - D
    rocker: Balls  # A - D
    leg: Balls  # F - A
    vertex: Balls  # F - p
    reach: Balls  # F - D


class LegBounds(NamedTuple):
    """Enclosures (N, 3): ``P1``, ``P2`` (both positive inside the reach), ``JT`` of the legs and ``h_phi``."""

    P1: Balls
    P2: Balls
    JT: Balls
    h_phi: Balls


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
        return Balls(np.concatenate([h.mid, f.mid], axis=1), np.concatenate([h.rad, f.rad], axis=1))

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """Jacobian (N, 6, 6) and derivative by psi (N, 6)."""
        v = self._vectors(x, u, units)
        h_phi, f_phi = 2.0 * _cross(v.arm, v.link), -(2.0 * _cross(v.rocker, v.leg))
        columns = stack([2.0 * v.leg.real, 2.0 * v.leg.imag, 2.0 * _cross(v.vertex, v.leg)])
        h_psi = -(2.0 * _cross(v.crank, v.link))
        N = len(x.mid)
        mid, rad = np.zeros((N, 6, 6)), np.zeros((N, 6, 6))
        for k in range(3):
            mid[:, k, k], rad[:, k, k] = h_phi.mid[:, k], h_phi.rad[:, k]
            mid[:, 3 + k, k], rad[:, 3 + k, k] = f_phi.mid[:, k], f_phi.rad[:, k]
        mid[:, 3:, 3:], rad[:, 3:, 3:] = columns.mid, columns.rad
        zero = np.zeros((N, 3))
        rate = Balls(np.concatenate([h_psi.mid, zero], axis=1), np.concatenate([h_psi.rad, zero], axis=1))
        return Balls(mid, rad), rate

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Nothing is counted: all angles enter through their directions."""
        return np.zeros((len(x.mid), 0), dtype=np.int64), exact(np.zeros((len(x.mid), 0)))

    def bounds(self, x: Balls, u: Balls) -> LegBounds:
        """Quantities whose signs are the working mode and the drive branches, over boxes."""
        v, n = self._vectors(x, u, self.units(x.mid, u.mid)), self.lengths
        rho2, total, gap = _square(v.reach), n["l1"] + n["l2"], n["l1"] - n["l2"]
        JT, h_phi = -(2.0 * _cross(v.rocker, v.leg)), 2.0 * _cross(v.arm, v.link)
        return LegBounds(total * total - rho2, rho2 - gap * gap, JT, h_phi)


def _near(angles: tuple[float, float, float]) -> Balls:
    mid = np.array(angles, dtype=np.float64)
    return Balls(mid, np.full(3, ANGLE) * np.maximum(1.0, np.abs(mid)) * UP)


def _cross(a: Balls, b: Balls) -> Balls:
    return (a.conj * b).imag


def _square(z: Balls) -> Balls:
    return z.real * z.real + z.imag * z.imag


Arc = tuple[float, float]

_NODES = 73
_SPLIT = 12


class TurnVerdict(StrEnum):
    """Outcome for a full turn of the wheels."""

    CERTIFIED_FULL_TURN = "certified full turn"
    NOT_FULL_TURN = "proved: no full turn"
    CHANGE_POINT = "proved: change point"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class FullTurnCertificate:
    """What is proved about a full turn.

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
        Why the verdict is UNDECIDED, or what forbids the turn; empty for a certified turn.
    seconds : float
    statement : str
    """

    verdict: TurnVerdict
    drives: tuple[str, str, str]
    covered: float
    sigma: tuple[int, int, int]
    working_mode_constant: bool | None
    mode_arcs: tuple[tuple[int, float, float, bool], ...]
    boxes: int
    reason: str
    seconds: float
    statement: str
    _cover: tuple[PlatformSystem, Boxes, Array] | None = None

    @property
    def certified(self) -> bool:
        """Whether the full turn is certified."""
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
    """Prove or disprove a full turn of the wheels on the branch through a pose.

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
    for verdict, bad in (
        (TurnVerdict.NOT_FULL_TURN, ("limited", "immovable", "never assembled")),
        (TurnVerdict.CHANGE_POINT, ("change point",)),
    ):
        legs = [str(k) for k, kind in enumerate(drives, 1) if kind in bad]
        words = " and ".join(dict.fromkeys(kind for kind in drives if kind in bad))
        if legs:
            return _without_cover(verdict, drives, f"drive {', '.join(legs)}: {words}, decided exactly", begin)
    try:
        motion = mechanism.full_turn(_NODES, start)
    except GeometryError as error:
        return _without_cover(TurnVerdict.UNDECIDED, drives, f"there is no start pose: {error}", begin)
    system = PlatformSystem(mechanism)
    delta = np.array(mechanism.delta)
    nodes = _nodes(system, motion.psi, np.column_stack([motion.theta - delta, motion.pose]), motion.complete)
    found = cover(system, nodes, Budget(max_boxes, seconds), begin)
    return _conclude(system, nodes, found, drives, motion.stop_reason(), begin)


def _without_cover(
    verdict: TurnVerdict, drives: tuple[str, str, str], reason: str, begin: float
) -> FullTurnCertificate:
    return FullTurnCertificate(
        verdict, drives, 0.0, (0, 0, 0), None, (), 0, reason, perf_counter() - begin, f"{verdict}: {reason}"
    )


def _nodes(system: PlatformSystem, psi: Array, guess: Array, complete: bool) -> Nodes:
    """Prove the poses that the motion suggests; the last one at exactly 2 pi."""
    u = exact(psi)
    if complete:
        u.rad[-1] = (tau_times(1.0) - exact(psi[-1])).size
    return prove_nodes(system, u, guess)


@np.errstate(all="ignore")
def _conclude(
    system: PlatformSystem, nodes: Nodes, found: Cover, drives: tuple[str, str, str], stopped: str, begin: float
) -> FullTurnCertificate:
    whole = not stopped and bool(found.covered.all())
    covered, boxes = _covered(nodes, found, whole)
    closed = whole and whole_turns(nodes, np.array([True, True, True, False, False, True])) is not None
    sigma, branches = _signs(system, nodes)
    constant, arcs = _working_mode(system, boxes) if boxes is not None else (None, ())
    right_drives = branches == system.platform.tau
    if closed and right_drives:
        verdict, reason = TurnVerdict.CERTIFIED_FULL_TURN, ""
    else:
        verdict, reason = TurnVerdict.UNDECIDED, _reason(stopped, found, whole, right_drives)
    text = f"{verdict}: {reason}; proved from psi = 0 to {covered:.9g}" if reason else f"{verdict}: one regular branch"
    if constant is not None:
        text += "; the working mode is proved constant" if constant else "; a change of the working mode is proved"
    seconds, proof = perf_counter() - begin, None if boxes is None else (system, *boxes)
    return FullTurnCertificate(
        verdict, drives, covered, sigma, constant, arcs, found.tested, reason, seconds, text, proof
    )


def _reason(stopped: str, found: Cover, whole: bool, right_drives: bool) -> str:
    if stopped:
        return f"the motion itself ends: {stopped}"
    if found.exhausted:
        return f"the limit of work was reached after {found.tested} boxes"
    if not whole:
        a, b = sorted(found.undecided)[0]
        return f"no single regular branch is proved between psi = {a:.12g} and {b:.12g}"
    return (
        "the pose after the turn is not proved to be the start pose" if right_drives else "the drive branch is unclear"
    )


def _covered(nodes: Nodes, found: Cover, whole: bool) -> tuple[float, tuple[Boxes, Array] | None]:
    """End of the arc proved without a gap from the first node, and its boxes in order."""
    if not found.boxes:
        return 0.0, None
    limit = float(nodes.u.mid[-1])
    if not whole:
        gaps = [a for a, _ in found.undecided]
        limit = min([limit, *gaps])
    boxes = [part for part, _ in found.boxes]
    u = Balls(np.concatenate([b.u.mid for b in boxes]), np.concatenate([b.u.rad for b in boxes]))
    x, V = (np.concatenate([getattr(b, name) for b in boxes]) for name in ("x", "V"))
    tight = np.concatenate([t for _, t in found.boxes])
    order = np.argsort(u.mid)
    order = order[u.mid[order] < limit]
    if order.size == 0:
        return 0.0, None
    return limit, (Boxes(u[order], x[order], V[order]), tight[order])


def _signs(system: PlatformSystem, nodes: Nodes) -> tuple[tuple[int, int, int], tuple[int, ...]]:
    """Proved working mode and drive branches at the first node; 0 where the sign is not proved."""
    first = nodes.take(np.array([0]))
    if not bool(first.proof.proved[0]):
        return (0, 0, 0), (0, 0, 0)
    bounds = system.bounds(exact(first.x).wider(first.proof.tight), first.u)
    a, b, c = (int(s) for s in _sign(bounds.JT)[0])
    return (a, b, c), tuple(int(s) for s in _sign(bounds.h_phi)[0])


def _sign(value: Balls) -> Array:
    return np.where(value.least > 0.0, np.sign(value.mid), 0.0)


def _working_mode(
    system: PlatformSystem, cover: tuple[Boxes, Array]
) -> tuple[bool | None, tuple[tuple[int, float, float, bool], ...]]:
    """Decide by enclosures of P1, P2 and JT whether a leg passes its boundary; halve the slices that do not decide."""
    boxes, tight = cover
    slices = np.column_stack([boxes.u.mid - boxes.u.rad, boxes.u.mid + boxes.u.rad])
    own = np.arange(len(slices))
    clear = np.zeros((0, 3), dtype=bool)
    kept = np.zeros((0, 2))
    signs = np.zeros((0, 3))
    for depth in range(_SPLIT + 1):
        middle = 0.5 * (slices[:, 0] + slices[:, 1])
        u = Balls(middle, np.maximum(slices[:, 1] - middle, middle - slices[:, 0]) * UP + TINY)
        part = boxes.take(own)
        centre = part.at(u)
        b = system.bounds(centre.wider(tight[own]), u)
        # JT^2 = P1 P2 on the closure: either form may decide
        good = (b.JT.least > 0.0) | ((b.P1.mid > b.P1.rad * UP) & (b.P2.mid > b.P2.rad * UP))
        done = good.all(axis=1) | (depth == _SPLIT)
        kept, clear = np.concatenate([kept, slices[done]]), np.concatenate([clear, good[done]])
        signs = np.concatenate([signs, np.where(good, np.sign(b.JT.mid) * (b.JT.least > 0.0), 0.0)[done]])
        slices, own = slices[~done], own[~done]
        if own.size == 0:
            break
        half = 0.5 * (slices[:, 0] + slices[:, 1])
        slices = np.concatenate([np.column_stack([slices[:, 0], half]), np.column_stack([half, slices[:, 1]])])
        own = np.concatenate([own, own])
    order = np.argsort(kept[:, 0])
    return _arcs(kept[order], clear[order], signs[order])


def _arcs(
    slices: Array, clear: NDArray[np.bool_], signs: Array
) -> tuple[bool | None, tuple[tuple[int, float, float, bool], ...]]:
    """Merge the slices that do not decide into arcs, and compare the proved signs on both sides of each."""
    found = []
    for leg in range(3):
        k, n = 0, len(slices)
        while k < n:
            if clear[k, leg]:
                k += 1
                continue
            stop = k
            while stop + 1 < n and not clear[stop + 1, leg]:
                stop += 1
            before = next((s for s in signs[:k, leg][::-1] if s), 0.0)
            after = next((s for s in signs[stop + 1 :, leg] if s), 0.0)
            found.append((leg + 1, float(slices[k, 0]), float(slices[stop, 1]), bool(before * after < 0.0)))
            k = stop + 1
    if not found:
        return True, ()
    return (False if any(arc[3] for arc in found) else None), tuple(found)
