"""Six-bars through five poses: a chain of three links that reaches them, held by two dyads (theory/poses 8)."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import Point, checked, choice, point as read_point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.design.poses.dyads import PoseDyad, dyads
from graphsynth.design.poses.passing import REACHED, passed
from graphsynth.design.poses.task import read_poses
from graphsynth.kinematics.certify.poses import MotionCertificate, certify
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
#: Links 4 and 5 hold these pairs of links; what six-bar that makes.
_KINDS = {
    ((0, 2), (1, 3)): "Watt I",
    ((0, 3), (1, 3)): "Stephenson II",
    ((0, 2), (0, 3)): "Stephenson III",
    ((0, 3), (1, 4)): "Stephenson I",
}


@dataclass(frozen=True, eq=False, repr=False)
class PoseSixBar(Shown):
    """A six-bar whose link 3 passes through five poses, link 1 driven.

    Attributes
    ----------
    kind : {"Watt I", "Stephenson I", "Stephenson II", "Stephenson III"}
    mechanism : Mechanism
        Frame 0, chain 1, 2, 3, links 4 and 5, in the first pose; link 3 has the frame of the poses, its origin is P.
    dyads : (PoseDyad, PoseDyad)
        Links 4 and 5, each as seen from the link with the lower number that it is jointed to.
    defects : tuple of str
        "order": link 1 does not turn one way from the first pose to the last; "motion": not all poses are reached.
    inputs : ndarray
        Angles of link 1 at the poses.
    miss : float
        Largest distance of the simulated link 3 from the poses, angles times the size of the task (estimated).
    motion : Motion
        Through the poses, in the order in which link 1 passes them.
    """

    kind: str
    mechanism: Mechanism
    dyads: tuple[PoseDyad, PoseDyad]
    defects: tuple[str, ...]
    inputs: Array
    miss: float
    motion: Motion

    def certify(self) -> MotionCertificate:
        """Prove that the motion shows exact assemblies of one branch."""
        return certify(self.motion)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [("defects", ", ".join(self.defects) or "none"), ("misses the poses by", f"{self.miss:.2g}")]
        return f"{self.kind} six-bar through {len(self.inputs)} poses", rows

    def _picture(self) -> str:
        return self.mechanism._picture()


@checked
def six_bars_for_poses(
    poses: Any, pivot: Point, joint: Point, lengths: tuple[float, float], *, elbow: int = 1
) -> tuple[PoseSixBar, ...]:
    """Find the six-bars that lead a body through five poses, for a given chain of links from the frame to the body.

    Parameters
    ----------
    poses : sequence of (x, y, angle)
        Five, as for `dyads`.
    pivot : (float, float)
        Joint of link 1 and the frame.
    joint : (float, float)
        Joint of link 2 and the body, in the body's frame.
    lengths : (float, float)
        Of links 1 and 2.
    elbow : {1, -1}
        Side of the joint of links 1 and 2: 1 left of the way from the pivot to the body's joint.

    Returns
    -------
    tuple of PoseSixBar
        Two more links hold two of the pairs frame and link 2, link 1 and body, frame and body; of each pair there are
        at most three, three and four.  So at most 9 Watt I, 12 Stephenson II and 12 Stephenson III.  Or link 4 holds
        frame and body and link 5 holds links 1 and 4: at most 12 Stephenson I.  Those without defects first.

    Raises
    ------
    GeometryError
        A pose that the chain does not reach, another number of poses.

    Notes
    -----
    [Soh & McCarthy 2008]; theory/poses 8.  The dyads are proved for the poses of the links in double precision; the
    judgement is estimated, `PoseSixBar.certify` proves a motion.

    Examples
    --------
    >>> poses = [(0.87, 1.44, 0.6), (0.68, 1.86, 0.44), (-0.08, 2.22, 0.28), (-1.03, 1.92, 0.24), (-1.38, 1.29, 0.32)]
    >>> found = six_bars_for_poses(poses, pivot=(-1, 0), joint=(0, 0), lengths=(2, 2))
    >>> len(found), found[0].defects, bool(found[0].miss < 1e-9)
    (43, (), True)
    """
    task = read_poses(poses, 5)
    z, turn = task.poses[:, :2] @ [1.0, 1j], task.poses[:, 2]
    O, w = complex(*read_point("pivot", pivot)), complex(*read_point("joint", joint))
    first, second = (positive("lengths", length) for length in lengths)
    side = int(choice("elbow", str(elbow), ("1", "-1")))
    W = z + np.exp(1j * turn) * w
    reach = np.abs(W - O)
    if (far := np.flatnonzero((reach >= first + second) | (reach <= abs(first - second)))).size:
        told = f"pose {far[0] + 1} puts the joint {reach[far[0]]:.6g} from the pivot"
        raise GeometryError(f"{told}; links of {first:g} and {second:g} reach from their difference to their sum")
    bend = np.arccos((first**2 + reach**2 - second**2) / (2.0 * first * reach))
    one = np.angle(W - O) + side * bend
    A = O + first * np.exp(1j * one)
    chain = [(0j * z, 0.0 * turn), (O + 0j * z, one), (A, np.angle(W - A)), (z, turn)]
    rigid = {(0, 2): (O, 0j), (1, 3): (first + 0j, w)}
    held = {pair: _dyads(chain, pair, rigid.get(pair)) for pair in ((0, 2), (1, 3), (0, 3))}
    both: list[tuple[Any, tuple[PoseDyad, PoseDyad]]] = []
    for pairs in _KINDS:
        if pairs[1] in held:
            both += [(pairs, own) for own in product(held[pairs[0]], held[pairs[1]])]
            continue
        for own in held[pairs[0]]:  # link 4, whose poses follow; link 5 holds it, beside the frame
            start, end = complex(*own.pivot), own.at(task.poses) @ [1.0, 1j]
            moved = [*chain, (start + 0j * z, np.unwrap(np.angle(end - start)))]
            both += [(pairs, (own, other)) for other in _dyads(moved, pairs[1], (0j, 0j), abs(start - O))]
    made = [_six_bar(task.poses, chain, (first, second), w, pairs, own) for pairs, own in both]
    return tuple(sorted(made, key=lambda own: (len(own.defects), min(own.miss, 1e300))))


def _dyads(
    chain: list[tuple[Any, Any]], pair: tuple[int, int], known: tuple[complex, complex] | None, size: float = 0.0
) -> list[PoseDyad]:
    """Links that hold the second link of a pair as seen from the first, without the one that is there."""
    (at, angle), (z, turn) = (chain[link] for link in pair)
    seen = (z - at) * np.exp(-1j * angle)
    found = dyads([(p.real, p.imag, float(t)) for p, t in zip(seen, turn - angle)])
    if known is None:
        return list(found)
    size = max(size, *(abs(part) for part in (*known, *seen)))
    away = [abs(complex(*own.pivot) - known[0]) + abs(complex(*own.point) - known[1]) for own in found]
    return [own for own, gap in zip(found, away) if gap > 10.0 * REACHED * size]


def _six_bar(
    poses: Array, chain: Any, lengths: tuple[float, float], w: complex, pairs: Any, both: tuple[PoseDyad, PoseDyad]
) -> PoseSixBar:
    """Make one, simulate it through the poses and judge it."""
    joints = [
        Revolute(0, 1, (chain[1][0][0].real, chain[1][0][0].imag)),
        Revolute(1, 2, (lengths[0], 0.0)),
        Revolute(2, 3, (lengths[1], 0.0), (w.real, w.imag)),
    ]
    for link, pair, own in zip((4, 5), pairs, both):
        joints += [Revolute(pair[0], link, own.pivot), Revolute(pair[1], link, own.point, (own.length, 0.0))]

    def mechanism(k: int) -> Mechanism:
        """In pose k."""
        pose = [(float(at[k].real), float(at[k].imag), float(angle[k])) for at, angle in chain]
        for (a, b), own in zip(pairs, both):
            start, end = (
                complex(*pose[link][:2]) + cmath.exp(1j * pose[link][2]) * complex(*at)
                for link, at in ((a, own.pivot), (b, own.point))
            )
            pose.append((start.real, start.imag, cmath.phase(end - start)))
        graph = MechanismGraph(6, [joint.pair for joint in joints], frame=0)
        return Mechanism(graph, tuple(joints), (Driver(0, 1),), {"P": TracePoint(3, (0.0, 0.0))}, tuple(pose))

    inputs = np.unwrap(chain[1][1])
    order = np.argsort(inputs) if inputs[-1] >= inputs[0] else np.argsort(-inputs)
    one_way = bool((order == np.arange(len(order))).all())
    size = float(max(np.ptp(poses[:, :2], axis=0).max(), *lengths))
    motion, miss = passed(mechanism, inputs, order, poses, 3, size)
    defects = ("order",) * (not one_way) + ("motion",) * (not miss <= REACHED * size)
    return PoseSixBar(_KINDS[pairs], mechanism(0), both, defects, inputs, miss, motion)
