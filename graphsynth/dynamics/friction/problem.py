"""The friction problem at one state: every set of friction forces that fits its own loads and the motion it leaves.

Accelerations and multipliers depend linearly on the friction ``phi`` along the sliding directions, so at one state all
that is left is ``udot = b + A phi`` and ``lam = lam0 + B phi``.  A joint that slides has ``phi = -sign(u) mu N(lam)``;
one at rest either sticks (``udot = 0``, ``|phi| <= mu_s N``) or starts (``phi = -sign(udot) mu_s N``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics import kernels
from graphsynth.dynamics.friction.loads import FrictionRows, fitting_loads, loads_of
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads

Array = NDArray[np.float64]
Senses = tuple[int, ...]

#: Rates below this part of the velocities that make them count as 0: rounding.
AT_REST = 1e-12
#: Joints at rest whose states are enumerated.
MOST = 7
#: Part of their size below which friction directions depend on each other.
_DEPENDENT = 1e-9
#: Relative: equal accelerations, limits of sticking, accelerations that start a sliding.
_SAME, _LIMIT, _STARTS = 1e-7, 1e-10, 1e-10
#: Part of a null vector of the multipliers in the rows of a joint from which its load is not determined.
_OPEN = 1e-8
#: Parts of its limit at which the friction of an element is looked at.
_FOLLOWED = 65
#: Rounds for how friction is shared among joints that stick together.
_ROUNDS = 200


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """One state of friction: senses (0 sticks), forces (N or N m, on b), loads (N), accelerations, multipliers.

    ``rates`` are 0 where an element sticks or rounding is all there is; ``rubbing`` is the generalised force;
    ``shared`` are the elements that stick together in a loop: how they share their friction is not determined.
    """

    senses: Senses
    forces: Array
    loads: Array
    a: Array
    multipliers: Array
    rates: Array
    rubbing: Array
    shared: tuple[int, ...] = ()


class FrictionProblem:
    """The friction problem of a model at one state.

    ``speed`` is the largest velocity so far (characteristic lengths or radians per second), beside which rounding is
    judged.
    """

    def __init__(self, rows: FrictionRows, t: float, q: Array, v: Array, slots: Array, speed: float = 0.0) -> None:
        self.rows, self.elements = rows, rows.elements
        compiled = rows.compiled
        T = compiled.tables
        self._J, gam, self.W, _, offset = rows.directions(t, q, v, slots)
        Q, _, _, _, self.good = kernels.load_vector(
            T, kernels.state_rows(T, q, v), applied_loads(compiled, t, q, v), compiled.currents
        )
        self.rates = self.W @ v
        size = compiled.unit
        self.speed = max(speed, float(np.abs(v / size).max()))
        self.noise = AT_REST * self.speed * (np.abs(self.W) @ size) + 1e-300
        self.speeds = self.rates * np.array([e.lever for e in self.elements])
        self._part = respond(rows, self._J, gam, Q, self.W)
        self.A = self.W @ self._part.G
        self.b = self.W @ self._part.a0 + offset
        unit = compiled.unit / T.size
        inertial = T.mass @ self._part.a0
        self._force = max(float(np.abs(part * unit).max()) for part in (Q, inertial, self._J.T @ self._part.lam0))
        inertia = np.diag(T.mass)
        weight = np.where(inertia > 0.0, inertia, float((inertia * size**2).max()) / size**2)  # of massless links
        self._push = np.abs(self.W @ np.diag(1.0 / weight) @ self.W.T)

    @property
    def resting(self) -> list[int]:
        """Elements at rest that could stick."""
        return [f for f, e in enumerate(self.elements) if e.sticks and abs(self.rates[f]) <= self.noise[f]]

    def moving(self) -> dict[int, int]:
        """Senses of the elements that slide."""
        resting = set(self.resting)
        return {f: int(np.sign(self.rates[f])) for f in range(len(self.elements)) if f not in resting}

    def undetermined(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Name joints whose friction needs loads that redundant constraints leave open, and all that share these."""
        scaled = self._part.null * self._part.sizes[:, None]
        needed = [e for f, e in enumerate(self.elements) if e.static > 0.0 and not self.idle(f)]
        bad = [e for e in needed if np.abs(scaled[e.rows]).max(initial=0.0) > _OPEN]
        if not bad:
            return (), ()
        own = np.abs(np.vstack([scaled[e.rows] for e in bad])).max(axis=0) > _OPEN
        touched = np.abs(scaled[:, own]).max(axis=1) > _OPEN
        return tuple(dict.fromkeys(e.name for e in bad)), joint_names(self.rows.compiled, touched)

    def idle(self, f: int) -> bool:
        """Whether the element's friction moves nothing, and nothing moves it: its joint is held by others."""
        small = _DEPENDENT * max(float(self._push[f, f]), 1e-300)
        return bool(
            abs(self.rates[f]) <= self.noise[f] and abs(self.A[f, f]) <= small and abs(self.b[f]) <= self._starting(f)
        )

    def _starting(self, f: int) -> float:
        """Acceleration of an element's joint that counts as none."""
        scale = np.abs(self.W[f]) @ (np.abs(self._part.a0)) + self._push[f, f] * self._force
        return float(_STARTS * scale) + 1e-300

    def factor(self, senses: Mapping[int, int] | None = None) -> float:
        """Bound of how much the loads change with the loads when all elements slide; below 1 they are unique."""
        if not self.elements:
            return 0.0
        K = np.column_stack(
            [loads_of(self.elements, B) * e.static * e.lever for B, e in zip(self._part.B.T, self.elements)]
        )
        return float(np.abs(np.linalg.eigvals(K)).max())

    def solutions(
        self, sliding: Mapping[int, int], resting: Iterable[int], onset: Iterable[int] = ()
    ) -> tuple[list[FrictionSolution], bool]:
        """Return all solutions, and whether that is known to be all of them.

        ``sliding`` are elements that slide, with their senses, ``resting`` those that stick or start to slide;
        ``onset`` are those of ``sliding`` that have just begun, with the friction of that instant.
        """
        begun = set(onset)
        free = [f for f in resting if not self.idle(f)]
        found: list[FrictionSolution] = []
        known, unsettled = True, False
        for choice in product((0, 1, -1), repeat=len(free)):
            trial = dict(zip(free, choice))
            stuck = [f for f in free if trial[f] == 0]
            moving = {**sliding, **{f: s for f, s in trial.items() if s}}
            if self._held(stuck, trial):
                continue
            fits, whole, lost = self._of(moving, stuck, begun)
            if not whole and len(stuck) == 1 and self.factor() < 1.0:
                fits, whole = self._followed(moving, stuck[0], begun), True
            known, unsettled = known and whole, unsettled or lost
            for fit in fits:
                starts = all(s * self._udot(fit.forces, f) > self._starting(f) for f, s in trial.items() if s)
                if starts and not any(self._alike(fit, other) for other in found):
                    found.append(fit)
        if unsettled and not (len(found) == 1 and self.factor() < 1.0):
            known = (
                False  # below 1, joints held in a loop that are used beyond their limits start, and nothing else fits
            )
        return found, known

    def _followed(self, moving: dict[int, int], f: int, begun: set[int]) -> list[FrictionSolution]:
        """Return the states in which one element sticks, where the loads of the others are not known to be all found.

        Its friction is followed from one limit to the other; every part of the limit leaves one set of loads.
        """
        from scipy.optimize import brentq

        D, e, at_rest = sorted({*moving, f}), self.elements[f], set(self.resting)
        part = self._part

        def forces(use: float) -> Array:
            ratio = np.array(
                [use * e.static * e.lever if g == f else self._ratio(g, moving[g], begun, g in at_rest) for g in D]
            )
            fits, _ = fitting_loads([self.elements[g] for g in D], part.lam0, part.B[:, D] * ratio)
            found = np.zeros(len(self.elements))
            found[D] = ratio * fits[0]
            return found

        uses = np.linspace(-1.0, 1.0, _FOLLOWED)
        rates = [self._udot(forces(use), f) for use in uses]
        found = []
        for k in range(len(uses) - 1):
            if rates[k] == 0.0 or rates[k] * rates[k + 1] < 0.0:
                use = brentq(lambda at: self._udot(forces(at), f), uses[k], uses[k + 1], xtol=1e-15)
                found.append(self._made(forces(use), moving, ()))
        return found

    def _held(self, stuck: list[int], trial: Mapping[int, int]) -> bool:
        """Whether joints that stick hold one that should start: no friction can change that."""
        kept = self._independent(stuck)
        moving = [f for f, s in trial.items() if s]
        if not kept or not moving:
            return False
        through = self.A[np.ix_(moving, kept)] @ np.linalg.inv(self.A[np.ix_(kept, kept)])
        own = np.diag(self.A)[moving]
        left = own - (through * self.A[np.ix_(moving, kept)]).sum(axis=1)
        fixed = self.b[moving] - through @ self.b[kept]
        return any(
            left[k] <= _DEPENDENT * max(own[k], 1e-300) and trial[f] * fixed[k] <= self._starting(f)
            for k, f in enumerate(moving)
        )

    def _udot(self, forces: Array, f: int) -> float:
        return float(self.b[f] + self.A[f] @ forces)

    def _alike(self, one: FrictionSolution, two: FrictionSolution) -> bool:
        size = max(float(np.abs(one.a).max()), float(np.abs(two.a).max()), float(np.abs(self._part.a0).max()))
        loads = max(float(one.loads.max()), float(two.loads.max()))
        moved = float(np.abs(one.a - two.a).max()) <= _SAME * size
        return moved and (bool(one.shared) or float(np.abs(one.loads - two.loads).max()) <= _SAME * loads)

    def _ratio(self, f: int, sense: int, begun: set[int], resting: bool) -> float:
        """Friction for a unit load."""
        e = self.elements[f]
        if e.smooth:
            return -e.coefficient(self.speeds[f]) * float(np.tanh(self.speeds[f] / e.regular)) * e.lever
        if f in begun:
            return -sense * e.onset * e.lever
        return -sense * (e.static if resting else e.coefficient(self.speeds[f])) * e.lever

    def _of(
        self, moving: dict[int, int], stuck: list[int], begun: set[int], within: bool = True
    ) -> tuple[list[FrictionSolution], bool, bool]:
        """Return the solutions with given elements sliding and sticking, whether all, whether sharing failed."""
        D = sorted(moving)
        at_rest = set(self.resting)
        ratio = np.array([self._ratio(f, moving[f], begun, f in at_rest) for f in D])
        kept = self._independent(stuck)
        # friction of all elements from the loads of those that slide: those kept are held at rest
        held, change = np.zeros(len(self.elements)), np.zeros((len(self.elements), len(D)))
        change[D, range(len(D))] = ratio
        if kept:
            inverse = np.linalg.inv(self.A[np.ix_(kept, kept)])
            held[kept] = -inverse @ self.b[kept]
            change[kept] = -inverse @ self.A[kept] @ change
        start, slopes = self._part.lam0 + self._part.B @ held, self._part.B @ change
        fits, known = fitting_loads([self.elements[f] for f in D], start, slopes)
        found, unsettled = [], False
        for x in fits:
            forces = held + change @ x
            shared: tuple[int, ...] = ()
            if len(kept) < len(stuck):
                if any(abs(self._udot(forces, f)) > self._starting(f) for f in stuck):
                    continue  # they cannot all be at rest
                shared = tuple(stuck)
                spread = self._share(held, change, D, stuck, kept, x)
                if spread is None:
                    unsettled = True
                    continue
                forces = spread
            fit = self._made(forces, moving, shared)
            limit = np.array([self.elements[f].static * self.elements[f].lever * fit.loads[f] for f in stuck])
            lever = np.array([self.elements[f].lever for f in stuck])
            if not within or (np.abs(forces[stuck]) <= limit * (1.0 + _LIMIT) + 1e-12 * self._force * lever).all():
                found.append(fit)
        return found, known, unsettled

    def _made(self, forces: Array, moving: Mapping[int, int], shared: tuple[int, ...]) -> FrictionSolution:
        lam = self._part.lam0 + self._part.B @ forces
        senses = tuple(moving.get(f, 0) for f in range(len(self.elements)))
        rests = [s == 0 and not e.smooth for s, e in zip(senses, self.elements)]
        return FrictionSolution(
            senses,
            forces,
            loads_of(self.elements, lam),
            self._part.a0 + self._part.G @ forces,
            lam,
            np.where(rests | (np.abs(self.rates) <= self.noise), 0.0, self.rates),
            self.W.T @ forces,
            shared,
        )

    def _independent(self, stuck: list[int]) -> list[int]:
        """Return elements enough to hold all that stick."""
        kept: list[int] = []
        for f in stuck:
            trial = [*kept, f]
            scale = 1.0 / np.sqrt(np.maximum(np.diag(self._push)[trial], 1e-300))
            block = self.A[np.ix_(trial, trial)] * scale[:, None] * scale
            if float(np.linalg.eigvalsh(0.5 * (block + block.T))[0]) > _DEPENDENT:
                kept = trial
        return kept

    def _share(
        self, held: Array, change: Array, D: list[int], stuck: list[int], kept: list[int], x: Array
    ) -> Array | None:
        """Friction of elements that stick together, spread so that all are used to the same part of their limits.

        Only its sums over the motions that it prevents are determined.  None if the loads do not settle.
        """
        forces = held + change @ x
        map_ = self.A[np.ix_(kept, stuck)]  # how friction prevents motions: rows of rank len(kept)
        for step in range(_ROUNDS):
            loads = loads_of(self.elements, self._part.lam0 + self._part.B @ forces)
            limits = np.array([self.elements[f].static * self.elements[f].lever * loads[f] for f in stuck])
            fresh = held + change @ loads[D]
            need = map_ @ fresh[stuck]
            part = _least_use(map_, need, limits)
            if part is None:
                return None
            fresh[stuck] = part
            moved = float(np.abs(fresh - forces).max())
            forces = fresh if step < 20 else 0.5 * (forces + fresh)
            if moved <= 1e-13 * float(np.abs(forces).max(initial=0.0)) + 1e-300:
                return forces
        return None

    def at(self, senses: Senses, *, within: bool = True) -> FrictionSolution | None:
        """Return the solution with given senses: what an integration follows; None if there is none or several.

        ``within`` asks that what sticks is within its limits.
        """
        stuck = [f for f, s in enumerate(senses) if s == 0 and not self.elements[f].smooth and not self.idle(f)]
        moving = {f: s for f, s in enumerate(senses) if f not in stuck and (s or self.elements[f].smooth)}
        fits, _, _ = self._of(moving, stuck, {f for f in moving if abs(self.rates[f]) <= self.noise[f]}, within)
        return fits[0] if len(fits) == 1 else None


def _least_use(rows: Array, need: Array, limits: Array) -> Array | None:
    """Find forces with ``rows forces = need`` whose largest part of its limit is least; None if limits are all 0."""
    if not limits.max(initial=0.0) > 0.0:
        return None if np.abs(need).max(initial=0.0) > 0.0 else np.zeros_like(limits)
    scaled = rows * limits
    if len(rows) == 1:
        total = float(np.abs(scaled).sum())
        return limits * np.sign(scaled[0]) * float(need[0]) / total if total > 0.0 else None
    from scipy.optimize import linprog

    n = len(limits)
    size = max(float(np.abs(scaled).max()), 1e-300)
    sides = np.vstack([np.hstack([np.eye(n), -np.ones((n, 1))]), np.hstack([-np.eye(n), -np.ones((n, 1))])])
    solved = linprog(
        [*np.zeros(n), 1.0],
        sides,
        np.zeros(2 * n),
        np.hstack([scaled / size, np.zeros((len(rows), 1))]),
        need / size,
        bounds=[(None, None)] * n + [(0.0, None)],
    )
    return np.asarray(limits * solved.x[:n]) if solved.status == 0 else None


def joint_names(compiled: Compiled, touched: NDArray[np.bool_]) -> tuple[str, ...]:
    """Names of the joints of some rows."""
    names = []
    for k in np.flatnonzero(touched):
        name = compiled.info[k].name
        for part in (" x", " y", " normal", " angle"):
            name = name.removesuffix(part)
        names.append(name)
    return tuple(dict.fromkeys(names))


#: Singular values of the joints' rows below this part of the largest count as zero.
_RANK = 1e-10


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """``a = a0 + G phi, lam = lam0 + B phi``, and the null vectors of the multipliers."""

    a0: Array
    G: Array
    lam0: Array
    B: Array
    null: Array
    sizes: Array


def respond(rows: FrictionRows, J: Array, gam: Array, Q: Array, W: Array) -> LinearResponse:
    """Solve ``M a + J^T lam = Q + W^T phi, J a = gam`` for loads alone and for every unit friction."""
    T, count = rows.compiled.tables, len(W)
    loads = np.column_stack([Q, W.T])
    sides = np.column_stack([gam, np.zeros((len(gam), count))])
    if not T.lower.size:
        return _respond_massless(rows, J, sides, loads)
    inverse = rows.lower_inverse
    Y = inverse @ J.T
    sizes = np.linalg.norm(Y, axis=0)
    sizes[sizes == 0.0] = 1.0
    U, S, Vt = np.linalg.svd(Y / sizes)
    rank = int(np.sum(_RANK * S[0] < S)) if S.size else 0
    free = inverse.T @ (inverse @ loads)
    z = (Vt[:rank] @ ((sides - J @ free) / sizes[:, None])) / S[:rank, None]
    a = free + inverse.T @ (U[:, :rank] @ z)
    lam = -(Vt[:rank].T @ (z / S[:rank, None])) / sizes[:, None]
    return LinearResponse(a[:, 0], a[:, 1:], lam[:, 0], lam[:, 1:], Vt[rank:].T / sizes[:, None], sizes)


def _respond_massless(rows: FrictionRows, J: Array, sides: Array, loads: Array) -> LinearResponse:
    """Return the same with links without mass, from the whole system; accelerations must be determined."""
    compiled = rows.compiled
    T, m = compiled.tables, len(J)
    unit = compiled.unit
    row = compiled.row_unit
    mass = (T.mass * unit) * unit[:, None]
    weight = float(np.abs(mass).max())
    Js = J * unit / row[:, None]
    n = compiled.n
    matrix = np.block([[mass / weight, Js.T], [Js, np.zeros((m, m))]])
    right = np.vstack([loads * unit[:, None] / weight, sides / row[:, None]])
    found = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
    U, S, _ = np.linalg.svd(Js)
    rank = int(np.sum(_RANK * S[0] < S)) if S.size else 0
    return LinearResponse(
        found[:n, 0] * unit,
        found[:n, 1:] * unit[:, None],
        found[n:, 0] * weight / row,
        found[n:, 1:] * (weight / row)[:, None],
        U[:, rank:] / row[:, None],
        row,
    )


def open_shares(
    compiled: Compiled, times: Array, q: Array, v: Array, slots: Array, state: NDArray[np.int64]
) -> dict[int, Array]:
    """Return changes of the multipliers that joints which stick together leave open, by index of the instant.

    They leave every motion as it is; the largest entry of each is 1.
    """
    rows, found = FrictionRows(compiled), {}
    for k in range(len(times)):
        stuck = [f for f, (s, e) in enumerate(zip(state[k], rows.elements)) if s == 0 and not e.smooth]
        if len(stuck) < 2 or not np.isfinite(q[k]).all():
            continue
        problem = FrictionProblem(rows, float(times[k]), q[k], v[k], slots[k])
        kept, A = problem._independent(stuck), problem.A
        rest = [f for f in stuck if f not in kept and not problem.idle(f)]
        shift = np.zeros((len(rows.elements), len(rest)))
        if kept:
            shift[kept] = -np.linalg.solve(A[np.ix_(kept, kept)], A[np.ix_(kept, rest)])
        shift[rest, range(len(rest))] = 1.0
        changes = problem._part.B @ shift
        size = np.abs(changes).max(axis=0, initial=0.0)
        if (size > 0.0).any():
            found[k] = changes[:, size > 0.0] / size[size > 0.0]
    return found
