"""Moving boxes: one regular branch of solutions over a range of inputs, proved without gaps.

For a system ``f(x, u) = 0`` with as many equations as unknowns, an interval U of inputs, a centre that moves as
``c(u) = x + V (u - mid U)`` and radii B, Krawczyk's operator about the centre

    K(u) - c(u) = -Y f(c(u), u) + (1 - Y J(c(U) + B, U)) [-B, B]

with any matrix Y satisfies: if it lies in the interior of [-B, B] for every u in U, then for every u in U there is
exactly one solution in ``c(u) + B``, and the Jacobian is regular everywhere in the box ([Krawczyk 1969]; [Neumaier
1990], theory/circle-and-ellipse 1).  ``f`` along the moving centre is bounded by its value at mid U and its derivative
by u over U, so the bound is of second order in the width of U.

Nodes are inputs with a small box around the pose there; an interval between two nodes has a moving box.  If both are
proved, and each node's solution lies in the moving box at that node's input, then by uniqueness the branch through the
moving box passes through both nodes; the branch is continuous, because the Jacobian is regular in the whole box.
An interval that fails is halved; where that does not help it stays undecided.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from functools import reduce
from time import perf_counter
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import TINY, UP, Balls, exact, join, tau_times
from graphsynth.intervals.operations import Array, Mask
from graphsynth.intervals.proving import inverses

Index = NDArray[np.intp]

#: Entries of the Jacobians handled at once.
_CHUNK = 1_000_000
#: Radii of uniqueness tried at nodes, times the weights.
_WIDE = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
_DEPTH = 40


class MovingSystem(Protocol):
    """Equations in balls; N boxes at once, n unknowns."""

    @property
    def weights(self) -> Array:
        """Size of one unit of every unknown, shape (n,): a length for lengths, 1 for angles."""

    def units(self, x: Array, u: Array, checked: bool = True) -> Balls:
        """``exp(i angle)`` of every angle of the equations at midpoints, shape (N, angles)."""

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        """``f``, shape (N, n); ``units`` belong to the midpoints of x and u."""

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """``df/dx`` (N, n, n) and ``df/du`` (N, n)."""

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Whole turns counted in the equations (N, any) and continuous directions (N, any) over the boxes ``x``."""


@dataclass(frozen=True, eq=False)
class _Rows:
    """Arrays and balls with one row for each of N things."""

    def take(self, key: Mask | Index | slice) -> Self:
        """Return some of the rows."""
        return type(self)(*(v.take(key) if isinstance(v, _Rows) else v[key] for v in vars(self).values()))

    def join(self, other: Self) -> Self:
        """Rows of both."""
        return type(self)(*map(_joined, vars(self).values(), vars(other).values()))


def _joined(a: Any, b: Any) -> Any:
    if isinstance(a, _Rows):
        return a.join(b)
    return join(a, b) if isinstance(a, Balls) else np.concatenate([a, b])


@dataclass(frozen=True, eq=False)
class Boxes(_Rows):
    """Moving boxes: inputs U as balls (N,), centres at the midpoints and their velocities (N, n)."""

    u: Balls
    x: Array
    V: Array

    def hull(self, radius: Array) -> Balls:
        """Balls that hold every box over all its inputs."""
        return Balls(self.x, (np.abs(self.V) * self.u.rad[:, None] + radius) * UP + TINY)

    def at(self, u: Balls) -> Balls:
        """Centres at inputs ``u`` (N,)."""
        step = u - exact(self.u.mid)
        return exact(self.x) + exact(self.V) * step[:, None]


@dataclass(frozen=True, eq=False)
class Proof(_Rows):
    """``proved`` (N,); the box ``radius`` in which the solution is unique; its bound ``tight`` around the centre."""

    proved: Mask
    radius: Array
    tight: Array


@dataclass(frozen=True, eq=False)
class Nodes(_Rows):
    """Inputs as balls (N,), centres and velocities (N, n), and the proof of exactly one solution in each box."""

    u: Balls
    x: Array
    V: Array
    proof: Proof
    turns: NDArray[np.int64]
    directions: Balls


@dataclass(frozen=True)
class Budget:
    """Limits of the work: boxes tested, seconds."""

    boxes: int = 100_000
    seconds: float = 60.0


@dataclass(eq=False)
class Cover:
    """Proved moving boxes in the order found; which intervals between the given nodes are covered; boxes tested."""

    covered: Mask
    undecided: list[tuple[float, float]] = field(default_factory=list)
    boxes: list[tuple[Boxes, Array]] = field(default_factory=list)
    owners: list[Index] = field(default_factory=list)
    tested: int = 0
    exhausted: bool = False


def _solved(J: Array, f: Array) -> Array:
    """Solutions of ``J x = f``; zero where the matrix has no inverse."""
    with suppress(np.linalg.LinAlgError):
        x = np.linalg.solve(J, f[..., None])
        if np.isfinite(x).all():
            return np.asarray(x[..., 0])
    return np.asarray(np.matmul(inverses(J)[0], f[..., None])[..., 0])


def correct(system: MovingSystem, x: Array, u: Array, steps: int = 40) -> tuple[Array, Array]:
    """Newton steps in floating point until all converge; points and velocities ``dx/du`` (NaN where it fails)."""
    with np.errstate(all="ignore"):
        for _ in range(steps):
            units = system.units(x, u, checked=False)
            f = system.residual(exact(x), exact(u), units)
            J, _ = system.derivatives(exact(x), exact(u), units)
            step = _solved(J.mid, f.mid)
            x = x - step
            size = np.abs(step / system.weights).max(axis=1, initial=0.0)
            if not (size > 1e-14 * (1.0 + np.abs(x / system.weights).max(axis=1, initial=0.0))).any():
                break
        J, fu = system.derivatives(exact(x), exact(u), system.units(x, u, checked=False))
        return x, -_solved(J.mid, fu.mid)


def prove(system: MovingSystem, boxes: Boxes, radii: tuple[float, ...] = ()) -> Proof:
    """Test every box, with radii found by inflation; then the larger ``radii`` (times the weights), largest first."""
    n = boxes.x.shape[1]
    size = max(1, _CHUNK // max(n * n, 1))
    parts = [_test(system, boxes.take(slice(k, k + size)), radii) for k in range(0, len(boxes.x), size)]
    if not parts:
        return Proof(np.zeros(0, dtype=bool), np.zeros((0, n)), np.zeros((0, n)))
    return reduce(Proof.join, parts)


@np.errstate(all="ignore")
def _test(system: MovingSystem, boxes: Boxes, radii: tuple[float, ...]) -> Proof:
    """Krawczyk's test of some moving boxes: inflate until the image lies inside, then try larger boxes.

    Those give uniqueness in more room, of the same solution.
    """
    weights = system.weights
    units = system.units(boxes.x, boxes.u.mid)
    f = system.residual(exact(boxes.x), exact(boxes.u.mid), units)
    J, fu = system.derivatives(boxes.hull(np.zeros_like(boxes.x)), boxes.u, units)
    Y, _ = inverses(J.mid)
    # the change of f along the moving centre: (J V + f_u) times the half width of U
    along = (J.times(exact(boxes.V)) + fu).size * boxes.u.rad[:, None]
    newton = -exact(Y).times(f.wider(along * UP + TINY))
    first = newton.size

    def image(which: Index, radius: Array) -> Array:
        """Radius of the Krawczyk image around the moving centres of some boxes; infinite where it is undefined."""
        own = boxes.take(which)
        J, _ = system.derivatives(own.hull(radius), own.u, units[which])
        rest = exact(np.eye(radius.shape[-1])) - exact(Y[which]).times(J)
        K = newton[which] + rest.times(Balls(np.zeros_like(radius), radius))
        return np.where(np.isfinite(K.size), K.size, np.inf)

    proved = np.zeros(len(first), dtype=bool)
    radius, tight = np.full_like(first, np.inf), np.full_like(first, np.inf)
    trial = _inflated(2.0 * first, weights)
    for _ in range(4):
        left = np.flatnonzero(~proved & np.isfinite(first).all(axis=1))
        if left.size == 0:
            break
        found = image(left, trial[left])
        inside = (found < trial[left]).all(axis=1)
        proved[left[inside]] = True
        radius[left[inside]], tight[left[inside]] = trial[left[inside]], found[inside]
        trial[left] = _inflated(1.6 * np.where(np.isfinite(found), found, 0.0), weights)
    for wide in radii:
        trial = np.broadcast_to(wide * weights, first.shape)
        left = np.flatnonzero(proved & (radius < trial).all(axis=1))
        if left.size:
            wider = left[(image(left, trial[left]) < trial[left]).all(axis=1)]
            radius[wider] = trial[wider]
    return Proof(proved, radius, tight)


def _inflated(radius: Array, weights: Array) -> Array:
    """Radius with room in every unknown, also in those that the motion follows exactly: neighbours must link there."""
    largest = (radius / weights).max(axis=1, keepdims=True)
    return np.asarray(radius + (0.01 * largest + 1e-13) * weights)


@np.errstate(all="ignore")  # what overflows or is undefined is not proved
def prove_nodes(system: MovingSystem, u: Balls, guess: Array) -> Nodes:
    """Newton from the guesses, then the proof, with the widest box of uniqueness that passes."""
    x, V = correct(system, guess, u.mid)
    V = np.where(np.isfinite(V), V, 0.0)
    proof = prove(system, Boxes(u, x, np.zeros_like(x)), _WIDE)
    turns, directions = system.branch(exact(x).wider(proof.radius), u.mid)
    return Nodes(u, x, V, proof, turns, directions)


@np.errstate(all="ignore")
def cover(system: MovingSystem, nodes: Nodes, budget: Budget, begin: float | None = None) -> Cover:
    """Cover all intervals between consecutive nodes."""
    begin = perf_counter() if begin is None else begin
    count = max(len(nodes.x) - 1, 0)
    found = Cover(np.ones(count, dtype=bool))
    spans = np.arange(count) + np.array([[0], [1], [0]])  # left node, right node, and the given interval they belong to
    for _ in range(_DEPTH):
        good = nodes.proof.proved[spans[:2]].all(axis=0)
        _give_up(found, nodes, spans[:, ~good])
        spans = spans[:, good]
        if spans.size == 0:
            return found
        if found.tested + len(spans[0]) > budget.boxes or perf_counter() - begin > budget.seconds:
            found.exhausted = True
            break
        found.tested += len(spans[0])
        boxes, proof, linked, parted = _try(system, nodes, spans[0], spans[1])
        ok = proof.proved & linked
        found.boxes.append((boxes.take(ok), proof.tight[ok]))
        found.owners.append(spans[2, ok])
        a, b = nodes.u.mid[spans[:2]]
        narrow = ~ok & ~parted & (np.abs(b - a) <= 1e-13 * np.maximum(np.abs(a), np.abs(b)) + 1e-300)
        _give_up(found, nodes, spans[:, parted])
        _give_up(found, nodes, spans[:, narrow])
        left = ~ok & ~parted & ~narrow
        spans, boxes = spans[:, left], boxes.take(left)
        if spans.size == 0:
            return found
        middle = len(nodes.x) + np.arange(len(spans[0]))
        nodes = nodes.join(prove_nodes(system, exact(boxes.u.mid), boxes.x))
        spans = np.hstack([[spans[0], middle, spans[2]], [middle, spans[1], spans[2]]])
    _give_up(found, nodes, spans)
    return found


def _give_up(found: Cover, nodes: Nodes, spans: Index) -> None:
    found.covered[spans[2]] = False
    found.undecided += map(tuple, nodes.u.mid[spans[:2]].T.tolist())


def _try(system: MovingSystem, nodes: Nodes, left: Index, right: Index) -> tuple[Boxes, Proof, Mask, Mask]:
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
            # both directions are arguments of one vector at the common solution, so they differ by whole turns: less
            # than half a turn apart they are equal, the same branch of the argument in both boxes
            near = ((directions - node.directions).size < 3.0).all(axis=1)
        same = (turns == node.turns).all(axis=1) & near
        met.append(np.asarray(inside & same, dtype=np.bool_))
        missed.append(np.asarray(outside | (turns != node.turns).any(axis=1), dtype=np.bool_))
    parted = proof.proved & ((met[0] & missed[1]) | (met[1] & missed[0]))
    return boxes, proof, met[0] & met[1], parted


def _centres(system: MovingSystem, a: Nodes, b: Nodes, middle: Array) -> tuple[Array, Array]:
    """Poses and velocities half-way between nodes: from both ends, or from the left one where that strays less.

    Newton's method from half-way between two branches may end anywhere, for instance on a copy whole turns away.
    """
    h = (b.u.mid - a.u.mid)[:, None]
    guess = 0.5 * (a.x + b.x) + 0.125 * h * (a.V - b.V)  # cubic through both nodes
    x, V = correct(system, guess, middle, steps=4)
    direct = (np.abs(a.x - b.x) / system.weights).max(axis=1)

    def detour(point: Array, rows: Any) -> Array:
        away = (np.abs(point - a.x[rows]) + np.abs(point - b.x[rows])) / system.weights
        return np.asarray(np.nan_to_num(away.max(axis=1), nan=np.inf))

    before = detour(x, slice(None))
    astray = np.flatnonzero(before > 1.5 * direct + 1e-9)
    if astray.size:
        x2, V2 = correct(system, (a.x + 0.5 * h * a.V)[astray], middle[astray], steps=4)
        shorter = detour(x2, astray) < before[astray]
        x[astray[shorter]], V[astray[shorter]] = x2[shorter], V2[shorter]
    lost = np.asarray(~np.isfinite(x + V).all(axis=1), dtype=np.bool_)[:, None]
    return np.where(lost, guess, x), np.where(lost, 0.0, V)


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
