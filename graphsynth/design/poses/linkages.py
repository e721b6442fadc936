"""Four-bars of pairs of dyads: simulated, and judged by circuit, branch and order (theory/poses 5)."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Count
from graphsynth.core.checks import checked, positive
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.design.poses.curves import burmester_curves
from graphsynth.design.poses.dyads import PoseDyad, PoseDyads, dyads
from graphsynth.design.poses.passing import REACHED, passed
from graphsynth.design.poses.task import Task, read_poses
from graphsynth.kinematics.certify.poses import MotionCertificate, certify
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
#: The least sine with a sign.
_SIGN = 1e-9
#: Centre points that are paired, and how far apart the pivots of two linkages given are, over the size.
_SAMPLES, _UNLIKE = 200, 0.2


@dataclass(frozen=True, eq=False, repr=False)
class PoseLinkage(Shown):
    """A linkage whose link 2 passes through the poses, link 1 driven.

    Attributes
    ----------
    mechanism : Mechanism
        Frame 0, driven link 1, body 2, link 3, in the first pose; the body's frame is that of the poses, and its origin
        is the point P.
    dyads : (PoseDyad, PoseDyad)
        Links 1 and 3.
    defects : tuple of str
        "circuit": some pose belongs to another assembly; "branch": a dead point of the driver lies between;
        "order": the driver passes the poses in another order; "motion": the motion does not reach all poses.
    rotates : bool
        Whether the driver turns fully.
    inputs : ndarray
        Coordinate of the driver at the poses.
    miss : float
        Largest distance of the simulated body from the poses, angles times the size of the task (estimated).
    transmission : float
        Smallest transmission angle on the way, radians; 0 with a defect.
    motion : Motion
        From the first pose to the last.
    """

    mechanism: Mechanism
    dyads: tuple[PoseDyad, PoseDyad]
    defects: tuple[str, ...]
    rotates: bool
    inputs: Array
    miss: float
    transmission: float
    motion: Motion

    def certify(self) -> MotionCertificate:
        """Prove that the motion shows exact assemblies of one branch from the first pose to the last."""
        return certify(self.motion)

    def crank_driven(self, rod: float | None = None) -> Mechanism:
        """Let a crank that turns fully rock link 1 from its first to its last position and back: a six-bar.

        Parameters
        ----------
        rod : float, optional
            Length of the rod between crank and link 1; four cranks by default.

        Returns
        -------
        Mechanism
            Links 4, the crank, and 5, the rod.  The dyad is central: both strokes take half a turn.

        Raises
        ------
        GeometryError
            A link 1 that is no RR dyad, turns fully or swings by half a turn or more, defects, too short a rod.

        Notes
        -----
        Why it turns is shown in theory/poses 5.
        """
        first, swing = self.dyads[0], float(abs(self.inputs[-1] - self.inputs[0]))
        if self.defects or first.kind != "RR":
            raise GeometryError(f"link 1 is {first.kind}, defects {self.defects}; give a linkage without, of RR")
        if self.rotates or not 0.0 < swing < math.pi:
            raise GeometryError(f"link 1 swings by {swing:.6g} rad; give one that rocks by less than half a turn")
        own, pivot = first.length, complex(*first.pivot)
        start, stop = (pivot + cmath.rect(own, float(self.inputs[k])) for k in (0, -1))
        crank = abs(stop - start) / 2
        length = 4.0 * crank if rod is None else positive("rod", rod)
        if length <= crank:
            raise GeometryError(f"rod = {length:g} is no longer than the crank, {crank:g}; give a longer one")
        away = (start - stop) / (2 * crank)
        centre = start + away * (length - crank)  # the first pose is the near end of the stroke
        old = self.mechanism
        graph = MechanismGraph(6, [*old.graph.joints, (0, 4), (4, 5), (1, 5)], frame=0)
        joints = (
            *old.joints,
            Revolute(0, 4, (centre.real, centre.imag)),
            Revolute(4, 5, (crank, 0.0)),
            Revolute(1, 5, (own, 0.0), (length, 0.0)),
        )
        turn, end = cmath.phase(away), centre + away * crank
        assert old.pose is not None
        pose = (*old.pose, (centre.real, centre.imag, turn), (end.real, end.imag, cmath.phase(start - end)))
        return Mechanism(graph, joints, (Driver(0, 4),), old.points, pose)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("dyads", " and ".join(dyad.kind for dyad in self.dyads)),
            ("defects", ", ".join(self.defects) or "none"),
            ("driver", "turns fully" if self.rotates else "rocks or slides"),
            ("smallest transmission angle", f"{math.degrees(self.transmission):.4g} deg"),
            ("misses the poses by", f"{self.miss:.2g}"),
        ]
        return f"Four-bar through {len(self.inputs)} poses", rows

    def _picture(self) -> str:
        return self.mechanism._picture()


@dataclass(frozen=True, eq=False, repr=False)
class PoseLinkages(Shown):
    """Four-bars through given poses, the best first: without defects, with a large transmission angle.

    Attributes
    ----------
    linkages : tuple of PoseLinkage
    complete : bool
        Whether it is proved that there is no other four-bar of these kinds.
    notes : tuple of str
    """

    linkages: tuple[PoseLinkage, ...]
    complete: bool
    notes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.linkages)

    def __iter__(self) -> Iterator[PoseLinkage]:
        return iter(self.linkages)

    def __getitem__(self, index: int) -> PoseLinkage:
        return self.linkages[index]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(str(k), ", ".join(one.defects) or "no defect") for k, one in enumerate(self)]
        return f"{len(self)} four-bars, {'certified: no other' if self.complete else 'not all'}", rows


@checked
def four_bars_for_poses(
    poses: Any, *, links: Sequence[PoseDyad] | None = None, pivots: Any = None, count: Count = 6
) -> PoseLinkages:
    """Find the four-bars whose coupler passes through given poses, simulate and judge them.

    Parameters
    ----------
    poses : sequence of (x, y, angle)
        As for `dyads`.
    links : sequence of PoseDyad, optional
        PoseDyads of these poses to be paired; needed for two and three poses.
    pivots : ((x, x), (y, y)), optional
        Four poses: the rectangle in which the joints at the frame lie; everywhere near the poses by default.
    count : int, optional
        Four poses: how many to give; five poses have at most six, which are all given.

    Returns
    -------
    PoseLinkages
        Each pair once, driven by that of its dyads with fewer defects.  For five poses it is proved that there is no
        other; for four poses the curve is sampled and the dyads chosen are proved.  The judgement is floating point;
        `PoseLinkage.certify` proves a motion.

    Raises
    ------
    GeometryError
        Links that are missing, or not those of the poses; a rectangle without dyads.

    Examples
    --------
    >>> poses = [(0, 0, 0), (0.5, 1, "20 deg"), (1.5, 2, "40 deg"), (3, 2.5, "60 deg")]
    >>> found = four_bars_for_poses(poses, pivots=((-4, 3), (-1, 6)), count=2)
    >>> found[0].defects, bool(found[0].miss < 1e-9)
    ((), True)
    """
    task, complete = read_poses(poses), False
    notes: tuple[str, ...] = ()
    if links is not None:
        found: Sequence[PoseDyad] = list(links)
        pairs = list(combinations(found, 2))
    elif len(task) == 4:
        pairs = _chosen(task, pivots, count)
    elif len(task) == 5:
        all_dyads: PoseDyads = dyads(task)
        pairs, complete, notes = list(combinations(all_dyads, 2)), all_dyads.complete, all_dyads.notes
    else:
        raise GeometryError(f"{len(task)} poses leave the pivots free; give links=[...] made by dyads")
    made = [made for pair in pairs if (made := _better(task, pair)) is not None]
    made.sort(key=lambda one: (len(one.defects), -one.transmission))
    return PoseLinkages(tuple(made), complete, notes)


def _better(task: Task, pair: tuple[PoseDyad, PoseDyad]) -> PoseLinkage | None:
    """Make the linkage of a pair, driven by the better of its dyads; None where none of them can be driven."""
    sides = [side for side in (pair, pair[::-1]) if side[0].kind == "RR"]
    made = [linkage_of(task.poses, first, second) for first, second in sides]
    return min(made, key=lambda one: (len(one.defects), -one.transmission), default=None)


def linkage_of(poses: Array, first: PoseDyad, second: PoseDyad) -> PoseLinkage:
    """Make the linkage of two dyads, driven by the first, simulate and judge it."""
    if max(np.ptp(_radii(dyad, poses)) for dyad in (first, second)) > 1e-6 * _size(poses, first, second):
        raise GeometryError(f"a dyad of kinds {first.kind}, {second.kind} does not keep these poses; give their own")
    defects, rotates, inputs = _judged(first, second, poses)
    order = np.arange(len(inputs))
    if "order" in defects or np.ptp(np.sign(np.diff(np.round(inputs, 9)))):  # what a motion can pass: one after another
        order = np.unique(np.round(inputs, 9), return_index=True)[1]
    arm = float(np.ptp(poses[:, :2], axis=0).max())
    motion, miss = passed(lambda k: mechanism_of(first, second, poses[k]), inputs, order, poses, 2, arm)
    if not miss <= REACHED * _size(poses, first, second):
        defects = defects or ("motion",)
    angles = motion.transmission_angle()
    least = min((float(np.min(own)) for own in angles.values()), default=0.0)
    mechanism = mechanism_of(first, second, poses[0])
    return PoseLinkage(mechanism, (first, second), defects, rotates, inputs, miss, 0.0 if defects else least, motion)


def _size(poses: Array, first: PoseDyad, second: PoseDyad) -> float:
    parts = [*first.pivot, *first.point, *second.pivot, *second.point, first.length, second.length]
    return float(max(np.abs(poses[:, :2]).max(), *(abs(part) for part in parts)))


def _radii(dyad: PoseDyad, poses: Array) -> Array:
    """Return what a dyad keeps constant over its poses."""
    if dyad.kind == "RP":
        seen = (complex(*dyad.pivot) - poses[:, 0] - 1j * poses[:, 1]) * np.exp(-1j * poses[:, 2]) - complex(
            *dyad.point
        )
        return np.asarray((seen * cmath.exp(-1j * dyad.angle)).imag)
    arms = dyad.at(poses) @ [1.0, 1j] - complex(*dyad.pivot)
    return np.asarray(np.abs(arms) if dyad.kind == "RR" else (arms * cmath.exp(-1j * dyad.angle)).imag)


def mechanism_of(first: PoseDyad, second: PoseDyad, start: Array) -> Mechanism:
    """Frame 0, links 1 and 3 of the dyads, body 2, in a pose."""
    x, y, angle = map(float, start)
    joints: list[JointGeometry] = []
    pose = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (x, y, angle), (0.0, 0.0, 0.0)]
    for link, dyad in ((1, first), (3, second)):
        end = complex(*dyad.at([start])[0])
        turn = {"RR": cmath.phase(end - complex(*dyad.pivot)), "PR": dyad.angle, "RP": angle + dyad.angle}[dyad.kind]
        own = (dyad.length, 0.0) if dyad.kind == "RR" else (0.0, 0.0)
        slides = dyad.kind == "PR"
        joints.append(
            Prismatic(0, link, dyad.pivot, (0.0, 0.0), dyad.angle) if slides else Revolute(0, link, dyad.pivot)
        )
        pose[link] = (end.real, end.imag, turn) if slides else (*dyad.pivot, turn)
        low, high = sorted((link, 2))
        ends, turns = ((own, dyad.point), (0.0, dyad.angle)) if link == 1 else ((dyad.point, own), (dyad.angle, 0.0))
        joints.append(Prismatic(low, high, *ends, *turns) if dyad.kind == "RP" else Revolute(low, high, *ends))
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    return Mechanism(graph, tuple(joints), (Driver(0, 1),), {"P": TracePoint(2, (0.0, 0.0))}, tuple(pose))


def _judged(first: PoseDyad, second: PoseDyad, poses: Array) -> tuple[tuple[str, ...], bool, Array]:
    A = first.at(poses) @ [1.0, 1j]
    if second.kind != "RR":  # the simulation decides; the driver goes by the shorter way
        return (), False, np.unwrap(np.angle(A - complex(*first.pivot)))
    found = judge(complex(*first.pivot), A, complex(*second.pivot), second.at(poses) @ [1.0, 1j])
    return found.defects, bool(found.rotates), found.inputs


class Judgement(NamedTuple):
    """Of four-bars driven about O, arrays over the linkages: defects, whether the driver turns fully, its angles."""

    circuit: Mask
    branch: Mask
    order: Mask
    rotates: Mask
    inputs: Array

    @property
    def defects(self) -> tuple[str, ...]:
        """Names of the defects of one linkage."""
        return tuple(name for name in ("circuit", "branch", "order") if getattr(self, name))


def judge(O: Any, A: Any, Q: Any, B: Any) -> Judgement:
    """Judge four-bars with the pivots O and Q and the joints A, driven, and B in all poses, shape (..., poses)."""
    O, Q = np.asarray(O)[..., None], np.asarray(Q)[..., None]
    sides = np.stack([abs(Q - O)[..., 0], abs(A - O)[..., 0], abs(B - A)[..., 0], abs(B - Q)[..., 0]])
    shortest = np.argmin(sides, axis=0)  # frame, driver, coupler, other
    grashof = 2.0 * (sides.min(axis=0) + sides.max(axis=0)) < sides.sum(axis=0)
    at_B, at_O = _sines(B - A, Q - B), _sines(A - O, Q - O)
    # of a Grashof linkage, the angle at a joint that is not on the shortest link never becomes 0 or pi
    circuit = grashof & ~_one_sign(np.where((shortest < 2)[..., None], at_B, at_O))
    rotates = grashof & (shortest < 2)
    angles = np.angle(A - O)
    steps = np.diff(angles) % (2 * np.pi)
    back = (2 * np.pi - steps).sum(axis=-1) < steps.sum(axis=-1)
    turned = np.where(back[..., None], steps - 2 * np.pi, steps)
    # a driver that rocks: its angles are counted from the side of the pivots that it does not pass
    line = np.angle(Q - O)
    far = np.where(sides[0] + sides[1] <= sides[2] + sides[3], np.pi, 0.0)[..., None]
    seen = (angles - line - far + np.pi) % (2 * np.pi) - np.pi
    turned = np.where(rotates[..., None], turned, np.diff(seen))
    one_way = np.abs(np.sign(turned).sum(axis=-1)) == turned.shape[-1]
    order = ~one_way | (np.abs(turned.sum(axis=-1)) >= 2 * np.pi)
    inputs = angles[..., :1] + np.concatenate([0.0 * turned[..., :1], np.cumsum(turned, axis=-1)], axis=-1)
    return Judgement(circuit, ~_one_sign(at_B), order, rotates, inputs)


def _sines(a: Any, b: Any) -> Array:
    return np.asarray((np.conj(a) * b).imag / (np.abs(a) * np.abs(b)))


def _one_sign(sines: Array) -> Mask:
    return np.asarray((sines > _SIGN).all(axis=-1) | (sines < -_SIGN).all(axis=-1))


def _chosen(task: Task, region: Any, count: int) -> list[tuple[PoseDyad, PoseDyad]]:
    """Good pairs of dyads of four poses with pivots in a rectangle, the dyads proved."""
    curves, poses, size = burmester_curves(task), task.poses, float(task.unit)
    if region is None:
        region = [(c - 3.0 * size, c + 3.0 * size) for c in poses[:, :2].mean(axis=0)]
    try:
        (x0, x1), (y0, y1) = (sorted(map(float, side)) for side in region)
    except (TypeError, ValueError) as error:
        raise GeometryError(f"pivots = {region!r} is not a rectangle; give ((x, x), (y, y))") from error
    branches = [branch @ [1.0, 1j] for branch in curves.centre.points(2000)]
    O, across = np.concatenate(branches), np.concatenate([np.angle(1j * np.gradient(z)) for z in branches])
    w = curves.centre.partners(np.column_stack([O.real, O.imag])) @ [1.0, 1j]
    A = poses[:, 0] + 1j * poses[:, 1] + np.exp(1j * poses[:, 2]) * w[:, None]
    arms = abs(A[:, 0] - O)
    inside = (x0 <= O.real) & (O.real <= x1) & (y0 <= O.imag) & (O.imag <= y1)
    kept = np.flatnonzero(inside & (arms > 0.05 * size) & (arms < 20.0 * size))
    if len(kept) < 2:
        raise GeometryError(f"pivots = {region!r} holds no two centre points; give a larger rectangle")
    kept = kept[np.unique(np.linspace(0, len(kept) - 1, _SAMPLES).astype(int))]
    O, A, across = O[kept], A[kept], across[kept]
    i, j = (own.ravel() for own in np.nonzero(~np.eye(len(kept), dtype=bool)))
    with np.errstate(invalid="ignore", divide="ignore"):
        found = judge(O[i], A[i], O[j], A[j])
        sides = np.stack([abs(O[j] - O[i]), *(abs(A[k, 0] - O[k]) for k in (i, j)), abs(A[i, 0] - A[j, 0])])
        sine = np.abs(_sines(A[j] - A[i], O[j][:, None] - A[j])).min(axis=1)
        merit = np.nan_to_num(sine * np.sqrt(sides.min(axis=0) / sides.max(axis=0)))
    rank = found.circuit.astype(int) + found.branch + found.order
    chosen: list[tuple[PoseDyad, PoseDyad]] = []
    taken: list[Complex] = []
    for k in np.lexsort((-merit, rank)):
        ends = np.array([O[i[k]], O[j[k]]])
        if len(chosen) == count or len(taken) > 8 * count:
            break
        if any(min(abs(ends - other).max(), abs(ends[::-1] - other).max()) < _UNLIKE * size for other in taken):
            continue
        taken.append(ends)
        first, second = (_proved(task, O[n], float(across[n])) for n in (i[k], j[k]))
        chosen += [(first, second)] if first and second else []
    return chosen


def _proved(task: Task, near: complex, across: float) -> PoseDyad | None:
    """Return the proved dyad beside a sampled centre point."""
    found = dyads(task, line=((near.real, near.imag), across))
    beside = [dyad for dyad in found if abs(complex(*dyad.pivot) - near) < 1e-6 * float(task.unit)]
    return beside[0] if len(beside) == 1 else None
