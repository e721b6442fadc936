"""Loops that move in spaces of different mobility: W = sum of i p_i - sum of Pi_j, checked by the rank at a pose.

And the choice of joints for the graph of the floating piston that has such loops.

Source: E. V. Didenko, *Development and analysis of planar multi-loop mechanisms on the basis of graph theory* (2019),
chapter 2; the meaning of Pi_j is that of theory/structural-system 2.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import whole
from graphsynth.core.errors import GraphError
from graphsynth.mechanism.constraints import TOLERANCE, jacobian, mobility_report
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class LoopSpace:
    """One loop and the space in which it moves at a pose.

    Attributes
    ----------
    links : tuple of int
        In the order of the loop.
    joints : tuple of (int, int)
        Each ascending.
    fresh : tuple of (int, int)
        Joints that no earlier loop has.
    own : int
        Dimension of the span of the screws of the loop's joints.
    space : int
        Pi_j: what this loop adds to the rank of the loop matrix, the span modulo the earlier loops.
    sub_edges : int
        Total mobility of the fresh joints; ``sub_edges - space`` is what the loop adds to the mobility.
    idle : ndarray, shape (3 - own, 3)
        Loads ``(couple / Lc, fx, fy)`` about the origin, Lc the characteristic length, that can circulate in the loop
        without any balance noticing: one for every direction in which the loop does not move.
    """

    links: tuple[int, ...]
    joints: tuple[Pair, ...]
    fresh: tuple[Pair, ...]
    own: int
    space: int
    sub_edges: int
    idle: Array

    @property
    def mobility(self) -> int:
        """What the loop adds to the mobility: 0 for a structural group of its space."""
        return self.sub_edges - self.space


@dataclass(frozen=True, eq=False)
class LoopSpaces:
    """Mobility of a mechanism from the spaces of its loops (estimated: ranks in floating point, at one pose).

    Attributes
    ----------
    loops : tuple of LoopSpace
    sub_edges : int
        G = sum of i p_i.
    rank : int
        Of the whole loop matrix.
    by_constraints : int
        Mobility by the rank of the joints' constraint matrix, found without loops: the check.
    """

    loops: tuple[LoopSpace, ...]
    sub_edges: int
    rank: int
    by_constraints: int

    @property
    def spaces(self) -> tuple[int, ...]:
        """Pi_j of every loop."""
        return tuple(loop.space for loop in self.loops)

    @property
    def mobility(self) -> int:
        """W = G - sum of Pi_j."""
        return self.sub_edges - sum(self.spaces)

    @property
    def own_count(self) -> int:
        """G - sum of the spans taken loop by loop: below W if the loops are badly chosen."""
        return self.sub_edges - sum(loop.own for loop in self.loops)

    @property
    def uniform(self) -> int:
        """G - 3 v: the mobility that one space for all loops gives."""
        return self.sub_edges - 3 * len(self.loops)

    @property
    def redundant(self) -> int:
        """Constraints that are redundant at the pose: 3 v - rank."""
        return 3 * len(self.loops) - self.rank

    @property
    def agrees(self) -> bool:
        """Whether W = G - sum of Pi_j, W = G - rank and the rank of the constraint matrix give the same."""
        return self.mobility == self.sub_edges - self.rank == self.by_constraints

    @property
    def statement(self) -> str:
        """The count in one sentence."""
        terms = " + ".join(map(str, self.spaces)) or "0"
        return (
            f"W = {self.sub_edges} - ({terms}) = {self.mobility}; one space 3 for all loops gives {self.uniform}, "
            f"because {self.redundant} constraint{'s are' if self.redundant != 1 else ' is'} redundant"
        )


def loop_spaces(
    mechanism: Mechanism, pose: ArrayLike | None = None, loops: Iterable[Sequence[int]] | None = None
) -> LoopSpaces:
    """Find the space of every loop and the mobility they give.

    Parameters
    ----------
    mechanism : Mechanism
    pose : array_like, shape (links, 3), optional
        An assembled pose; the mechanism's own by default.
    loops : iterable of sequences of int, optional
        A basis of loops, each as its links in order, in the order in which Pi_j is counted.  By default the loops that
        close the breadth-first tree from the frame, in the order of their largest link.

    Returns
    -------
    LoopSpaces

    Raises
    ------
    GraphError
        Loops that are no basis: a wrong number, links without a joint, loops that depend on each other.
    GeometryError
        No pose, or one at which the joints are open.

    Examples
    --------
    >>> from graphsynth.systems.piston.model import FloatingPiston
    >>> found = loop_spaces(FloatingPiston.crank_slider(0.05, 0.2).mechanism())
    >>> found.spaces, found.mobility, found.uniform, found.agrees
    ((3, 2), 1, 0, True)
    """
    report = mobility_report(mechanism, pose)
    place = np.asarray(mechanism.pose if pose is None else pose, dtype=np.float64)
    graph = mechanism.graph
    basis = _tree_loops(graph) if loops is None else [tuple(loop) for loop in loops]
    _check_basis(graph, basis)
    screws = {joint.pair: _screws(joint, place, report.Lc) for joint in mechanism.joints}
    columns, start = {}, 0
    for pair, own in screws.items():
        columns[pair] = slice(start, start + own.shape[1])
        start += own.shape[1]
    matrix = np.zeros((3 * len(basis), start))
    found: list[LoopSpace] = []
    before, seen = 0, set[Pair]()
    for k, links in enumerate(basis):
        passed = _passed(links)
        pairs = tuple(pair for pair, _ in passed)
        rows = matrix[3 * k : 3 * k + 3]
        for pair, sign in passed:
            rows[:, columns[pair]] = screws[pair] * sign
        u, values, _ = np.linalg.svd(rows)
        own_rank = _rank(values)
        rank = _rank(np.asarray(np.linalg.svd(matrix[: 3 * k + 3], compute_uv=False)))
        fresh = tuple(pair for pair in pairs if pair not in seen)
        seen.update(pairs)
        sub_edges = sum(screws[pair].shape[1] for pair in fresh)
        found.append(LoopSpace(links, pairs, fresh, own_rank, rank - before, sub_edges, u[:, own_rank:].T.copy()))
        before = rank
    return LoopSpaces(tuple(found), start, before, report.by_rank)


def _rank(values: Array) -> int:
    return int(np.sum(values > TOLERANCE * values[0])) if values.size and values[0] > 0.0 else 0


def _screws(joint: object, place: Array, Lc: float) -> Array:
    """Motions ``(omega, v at the world's origin / Lc)`` of the link with the higher number against the other."""
    a, b = joint.a, joint.b  # type: ignore[attr-defined]
    rows = jacobian([joint], place)[:, 3 * b : 3 * b + 3] * [1.0, 1.0, 1.0 / Lc]  # type: ignore[list-item]
    _, _, vt = np.linalg.svd(rows)
    twists = vt[len(rows) :]  # (vx, vy, omega Lc) of the origin of b
    x, y = place[b, :2] / Lc
    found = np.array([[w, vx + w * y, vy - w * x] for vx, vy, w in twists]).T
    return found if a < b else -found


def _passed(links: Sequence[int]) -> list[tuple[Pair, int]]:
    """Joints of a loop, each ascending, and 1 or -1 for the direction in which the loop passes it."""
    return [((a, b), 1) if a < b else ((b, a), -1) for a, b in zip(links, (*links[1:], links[0]))]


def _tree_loops(graph: MechanismGraph) -> list[tuple[int, ...]]:
    """Loops that the joints outside the breadth-first tree from the frame close, by their largest link."""
    frame = graph.frame or 0
    parent, queue = {frame: frame}, [frame]
    for link in queue:
        for other in range(graph.links):
            if graph.neighbours[link] >> other & 1 and other not in parent:
                parent[other] = link
                queue.append(other)
    if len(parent) < graph.links:
        raise GraphError("the graph is in several parts, so loops do not tell its mobility; join the parts")
    loops = []
    for a, b, _ in graph.joints:
        if a in (parent[b], b) or parent[a] == b:
            continue
        up, down = [a], [b]
        while up[-1] != frame:
            up.append(parent[up[-1]])
        while down[-1] not in up:
            down.append(parent[down[-1]])
        loops.append((*up[: up.index(down[-1]) + 1][::-1], *down[:-1]))
    return sorted(loops, key=lambda loop: (max(loop), len(loop)))


def _check_basis(graph: MechanismGraph, loops: Sequence[Sequence[int]]) -> None:
    joints = [(a, b) for a, b, _ in graph.joints]
    if len(loops) != graph.loops:
        raise GraphError(f"{len(loops)} loops are given, but the graph has {graph.loops} independent ones; give these")
    table = np.zeros((len(loops), len(joints)), dtype=np.int64)
    for k, links in enumerate(loops):
        if len(set(links)) != len(links) or len(links) < 3:
            raise GraphError(f"loop {tuple(links)} must name at least three links, each once")
        for pair, sign in _passed(links):
            if pair not in joints:
                a, b = pair[::sign]
                raise GraphError(f"loop {tuple(links)} passes from link {a} to link {b}, which have no joint")
            table[k, joints.index(pair)] = sign
    if len(loops) and np.linalg.matrix_rank(table.astype(np.float64)) < len(loops):
        raise GraphError("the loops depend on each other; leave one out and give another")


_JOINTS = ((0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (0, 4))
_FULL_TURN = {
    "RR": (True, "slider-crank: the crank turns fully if the rod is longer than crank + |offset|"),
    "RP": (True, "Scotch yoke: the crank turns fully with any dimensions"),
    "PR": (False, "swinging block: the pin runs to infinity where the crank is parallel to the guide"),
}


class Assignment(NamedTuple):
    """Kinds of joints 0-1, 1-2, 2-3, 0-3, 3-4, 0-4, the spaces of their loops, and whether the crank turns fully."""

    kinds: str
    spaces: LoopSpaces
    full_turn: bool
    remark: str


def rotary_assignments(seed: int = 0) -> list[Assignment]:
    """List all R and P on the graph's joints whose loops move in spaces (3, 2), with W = 1 and a turning crank.

    All 64 assignments are tried at random geometry.  The crank must be able to turn (joint 0-1 is R, and moves) and the
    piston must move.

    Parameters
    ----------
    seed : int
        Of the random geometry, 0 or more.

    Returns
    -------
    list of Assignment
        Three; two of them have a crank that turns fully: the two mechanisms of the source.

    Raises
    ------
    GeometryError
        A seed that is not a whole number, or is negative.

    Examples
    --------
    >>> [(a.kinds, a.full_turn) for a in rotary_assignments()]
    [('RRRPPP', True), ('RRPPPP', True), ('RPRPPP', False)]
    """
    seed = whole("seed", seed, 0, 2**63 - 1)
    found = []
    for kinds in product("RP", repeat=6):
        rng = np.random.default_rng(seed)
        made: list[JointGeometry] = []  # random joints, all link frames at the origin
        for (a, b), kind in zip(_JOINTS, kinds):
            at = (float(rng.uniform(-1, 1)), float(rng.uniform(-1, 1)))
            turn = float(rng.uniform(0, np.pi))
            made.append(Revolute(a, b, at, at) if kind == "R" else Prismatic(a, b, at, at, turn, turn))
        mechanism = Mechanism(MechanismGraph(5, list(_JOINTS), frame=0), tuple(made), pose=((0.0, 0.0, 0.0),) * 5)
        spaces = loop_spaces(mechanism, loops=[(0, 1, 2, 3), (0, 3, 4)])
        if spaces.spaces != (3, 2) or spaces.mobility != 1 or kinds[0] != "R":
            continue
        rates = mechanism.mobility().freedoms[0]
        size = np.abs(rates).max()
        if abs(rates[1, 2]) > 1e-9 * size and np.abs(rates[4, :2]).max() > 1e-9 * size:
            name = "".join(kinds)
            found.append(Assignment(name, spaces, *_FULL_TURN[name[1:3]]))
    return found
