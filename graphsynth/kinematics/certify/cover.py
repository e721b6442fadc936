"""Cover a motion with linked moving boxes: existence, uniqueness and regularity of one branch, without gaps.

Nodes are inputs with a small box around the pose there; an interval between two nodes has a moving box.  If both are
proved, and each node's solution lies in the moving box at that node's input, then by uniqueness the branch through the
moving box passes through both nodes; the branch is continuous, because the Jacobian is regular in the whole box.
An interval that fails is halved; where that does not help it stays undecided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.certify.balls import TINY, UP, Balls, exact, tau_times
from graphsynth.kinematics.certify.krawczyk import Boxes, Proof, System, correct, prove

__all__ = ["Budget", "Cover", "Nodes", "cover", "prove_nodes", "whole_turns"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WIDE = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
_DEPTH = 40


@dataclass(frozen=True)
class Budget:
    """Limits of the work: boxes tested, seconds."""

    boxes: int = 100_000
    seconds: float = 60.0


@dataclass(frozen=True, eq=False)
class Nodes:
    """Inputs as balls (N,), centres and velocities (N, n), and the proof of exactly one solution in each box."""

    u: Balls
    x: Array
    V: Array
    proof: Proof
    turns: NDArray[np.int64]
    directions: Balls

    def take(self, key: NDArray[np.intp]) -> Nodes:
        """Return some of the nodes."""
        return Nodes(
            self.u[key], self.x[key], self.V[key], self.proof.take(key), self.turns[key],
            self.directions[key],
        )  # fmt: skip

    def join(self, other: Nodes) -> Nodes:
        """Nodes of both."""
        return Nodes(
            _join(self.u, other.u), np.concatenate([self.x, other.x]), np.concatenate([self.V, other.V]),
            self.proof.join(other.proof),
            np.concatenate([self.turns, other.turns]), _join(self.directions, other.directions),
        )  # fmt: skip


@dataclass(eq=False)
class Cover:
    """Proved moving boxes in the order found; which intervals between the given nodes are covered; boxes tested."""

    covered: Mask
    undecided: list[tuple[float, float]] = field(default_factory=list)
    boxes: list[tuple[Boxes, Array]] = field(default_factory=list)
    owners: list[NDArray[np.intp]] = field(default_factory=list)
    tested: int = 0
    exhausted: bool = False


def _join(a: Balls, b: Balls) -> Balls:
    return Balls(np.concatenate([a.mid, b.mid]), np.concatenate([a.rad, b.rad]))


@np.errstate(all="ignore")  # what overflows or is undefined is not proved
def prove_nodes(system: System, u: Balls, guess: Array) -> Nodes:
    """Newton from the guesses, then the proof, with the widest box of uniqueness that passes."""
    x, V = correct(system, guess, u.mid)
    V = np.where(np.isfinite(V), V, 0.0)
    proof = prove(system, Boxes(u, x, np.zeros_like(x)), _WIDE)
    turns, directions = system.branch(exact(x).wider(proof.radius), u.mid)
    return Nodes(u, x, V, proof, turns, directions)


@np.errstate(all="ignore")
def cover(system: System, nodes: Nodes, budget: Budget, begin: float | None = None) -> Cover:
    """Cover all intervals between consecutive nodes."""
    begin = perf_counter() if begin is None else begin
    count = max(len(nodes.x) - 1, 0)
    found = Cover(np.ones(count, dtype=bool))
    left = np.arange(count)
    right, owner = left + 1, left.copy()
    for _ in range(_DEPTH):
        good = nodes.proof.proved[left] & nodes.proof.proved[right]
        _give_up(found, nodes, left[~good], right[~good], owner[~good])
        left, right, owner = left[good], right[good], owner[good]
        if left.size == 0:
            return found
        if found.tested + left.size > budget.boxes or perf_counter() - begin > budget.seconds:
            found.exhausted = True
            break
        found.tested += left.size
        boxes, proof, linked, parted = _try(system, nodes, left, right)
        ok = proof.proved & linked
        _give_up(found, nodes, left[parted], right[parted], owner[parted])
        found.boxes.append((boxes.take(ok), proof.tight[ok]))
        found.owners.append(owner[ok])
        rest = ~ok & ~parted
        left, right, owner, boxes = left[rest], right[rest], owner[rest], boxes.take(rest)
        a, b = nodes.u.mid[left], nodes.u.mid[right]
        narrow = np.abs(b - a) <= 1e-13 * np.maximum(np.abs(a), np.abs(b)) + 1e-300
        _give_up(found, nodes, left[narrow], right[narrow], owner[narrow])
        left, right, owner, boxes = left[~narrow], right[~narrow], owner[~narrow], boxes.take(~narrow)
        if left.size == 0:
            return found
        middle = len(nodes.x) + np.arange(left.size)
        nodes = nodes.join(prove_nodes(system, exact(boxes.u.mid), boxes.x))
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
        owner = np.concatenate([owner, owner])
    _give_up(found, nodes, left, right, owner)
    return found


def _give_up(
    found: Cover, nodes: Nodes, left: NDArray[np.intp], right: NDArray[np.intp], owner: NDArray[np.intp]
) -> None:
    found.covered[owner] = False
    found.undecided += [(float(nodes.u.mid[a]), float(nodes.u.mid[b])) for a, b in zip(left, right)]


def _try(
    system: System, nodes: Nodes, left: NDArray[np.intp], right: NDArray[np.intp]
) -> tuple[Boxes, Proof, Mask, Mask]:
    """Predict, prove and link one moving box per interval.

    Also returned: where the branch through one end is proved to miss the other end, so that no subdivision can help.
    """
    a, b = nodes.take(left), nodes.take(right)
    middle = 0.5 * (a.u.mid + b.u.mid)
    reach = [np.abs(node.u.mid - middle) * UP + node.u.rad for node in (a, b)]
    u = Balls(middle, np.maximum(*reach) * UP + TINY)
    x, V = _centres(system, a, b, middle)
    boxes = Boxes(u, x, V)
    proof = prove(system, boxes)
    turns, directions = system.branch(boxes.hull(proof.radius), middle)
    met, missed = [], []
    for node in (a, b):
        with np.errstate(all="ignore"):
            gap = exact(node.x) - boxes.at(node.u)
            inside = (((gap.size + node.proof.tight) * UP) < proof.radius).all(axis=1)
            outside = (gap.least > (proof.radius + node.proof.tight) * UP).any(axis=1)
        same = (turns == node.turns).all(axis=1) & _same_direction(directions, node.directions)
        met.append(np.asarray(inside & same, dtype=np.bool_))
        missed.append(np.asarray(outside | (turns != node.turns).any(axis=1), dtype=np.bool_))
    parted = proof.proved & ((met[0] & missed[1]) | (met[1] & missed[0]))
    return boxes, proof, met[0] & met[1], parted


def _centres(system: System, a: Nodes, b: Nodes, middle: Array) -> tuple[Array, Array]:
    """Poses and velocities half-way between nodes: from both ends, or from the left one where that strays less.

    Newton's method from half-way between two branches may end anywhere, for instance on a copy whole turns away.
    """
    h = (b.u.mid - a.u.mid)[:, None]
    guess = 0.5 * (a.x + b.x) + 0.125 * h * (a.V - b.V)  # cubic through both nodes
    x, V = correct(system, guess, middle, steps=4)
    direct = (np.abs(a.x - b.x) / system.weights).max(axis=1)

    def detour(point: Array) -> Array:
        away = (np.abs(point - a.x) + np.abs(point - b.x)) / system.weights
        return np.asarray(np.nan_to_num(away.max(axis=1), nan=np.inf))

    astray = np.flatnonzero(detour(x) > 1.5 * direct + 1e-9)
    if astray.size:
        x2, V2 = correct(system, (a.x + 0.5 * h * a.V)[astray], middle[astray], steps=4)
        best = x.copy()
        best[astray] = x2
        better = astray[(detour(best) < detour(x))[astray]]
        keep = np.isin(astray, better)
        x[better], V[better] = x2[keep], V2[keep]
    lost = np.asarray(~np.isfinite(x + V).all(axis=1), dtype=np.bool_)[:, None]
    return np.where(lost, guess, x), np.where(lost, 0.0, V)


def _same_direction(own: Balls, other: Balls) -> Mask:
    """Directions counted with turns must be the same branch of the argument in both boxes.

    Both are arguments of one vector at the common solution, so they differ by whole turns; less than half a turn apart
    they are equal.
    """
    with np.errstate(all="ignore"):
        return np.asarray(((own - other).size < 3.0).all(axis=1))


def whole_turns(nodes: Nodes, angular: Mask) -> list[int] | None:
    """Return the turns of the angles from the first node to the last, if nothing else changes; None if not proved.

    The solution at the last node, with these turns taken off, lies in the box of the first node: if it solves the
    equations there, it is the solution there.
    """
    made = np.where(angular, np.round((nodes.x[-1] - nodes.x[0]) / math.tau), 0.0)
    if not np.isfinite(made).all():
        return None
    gap = exact(nodes.x[-1]) - tau_times(made) - exact(nodes.x[0])
    inside = (gap.size + nodes.proof.tight[-1]) < nodes.proof.radius[0] * (1.0 - 1e-14)
    return [int(m) for m in made] if bool(inside.all()) else None
