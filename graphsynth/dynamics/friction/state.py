"""Which joints stick and which slide: decided at a state, and the model with those that stick locked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.loads import FrictionRows
from graphsynth.dynamics.friction.problem import MOST, FrictionProblem, FrictionSolution, Senses
from graphsynth.dynamics.kernels import accelerate, constraint_system, load_vector, state_rows
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Decision:
    """The state of friction from an instant on, or why there is none.

    ``kind`` is "" or one of "undetermined", "none", "several", "not decided".
    """

    kind: str
    message: str
    solution: FrictionSolution | None = None


def decide(
    problem: FrictionProblem, sliding: dict[int, int], resting: Iterable[int], begun: Iterable[int] = ()
) -> Decision:
    """Decide which of the elements at rest stick and which slide from here on.

    ``sliding`` elements have senses; those ``begun`` at this instant are among them.  An element that starts under its
    static friction goes on under the friction of sliding; where that is less at once (two coefficients), others may
    start in turn.
    """
    if not problem.good or not np.isfinite(problem.b).all():
        return Decision("", "")
    names, shared = problem.undetermined()
    if names:
        return Decision(
            "undetermined",
            f"the friction in joint {' and '.join(names)} depends on a reaction that is not determined: "
            f"{', '.join(shared)} share it in proportions that the equations leave open; remove one of the redundant "
            "constraints, or the friction",
        )
    sliding, still, fresh = dict(sliding), sorted(resting), set(begun)
    if len(still) > MOST and len(problem._independent([f for f in still if not problem.idle(f)])) > MOST:
        return Decision(
            "not decided",
            f"{len(still)} joints with dry friction are at rest at once; which of them stick is decided for at most "
            f"{MOST} that move independently: leave out the friction of some, or start with rates",
        )
    while True:
        found, known = problem.solutions(sliding, still, fresh)
        if len(found) != 1 or not known:
            return _refused(problem, found, known)
        falls = {
            f: found[0].senses[f]
            for f in still
            if found[0].senses[f] and problem.elements[f].onset < problem.elements[f].static
        }
        if not falls:
            break
        sliding.update(falls)
        fresh |= set(falls)
        still = [f for f in still if f not in falls]
    fit = found[0]
    for f in fresh:  # all that has begun to slide must go on
        if fit.senses[f] * problem._udot(fit.forces, f) < -problem._starting(f):
            return Decision(
                "not decided",
                f"joint {problem.elements[f].name} starts under its static friction and is turned back at once under "
                "that of sliding: what follows is not decided; give a stribeck_speed, over which friction falls",
            )
    return Decision("", "", fit)


def _refused(problem: FrictionProblem, found: list[FrictionSolution], known: bool) -> Decision:
    rubbing = [f for f, e in enumerate(problem.elements) if e.static > 0.0]
    names = ", ".join(dict.fromkeys(problem.elements[f].name for f in rubbing))
    factor = problem.factor()
    if len(found) > 1:
        far = max(rubbing, key=lambda f: float(np.ptp([problem._udot(fit.forces, f) for fit in found])))
        rates = ", ".join(f"{problem._udot(fit.forces, far):.4g}" for fit in found[:4])
        return Decision(
            "several",
            f"{len(found)} motions fit the dry friction in {names} (accelerations in {problem.elements[far].name}: "
            f"{rates}), and the equations do not tell which: the load that friction makes returns to it with the "
            f"factor {factor:.3g}, above 1; reduce the friction coefficient, or lengthen the guide",
        )
    if not known:
        return Decision(
            "not decided",
            f"whether one motion fits the dry friction in {names} is not decided: loads return with the factor "
            f"{factor:.3g}; reduce the friction coefficients",
        )
    return Decision(
        "none",
        f"no motion fits the dry friction in {names}: the load that friction makes returns to it with the factor "
        f"{factor:.3g}, above 1, and the joint jams; reduce the friction coefficient, or lengthen the guide",
    )


@dataclass(frozen=True, eq=False)
class Piece:
    """A time in which the same joints stick and the same slide.

    ``compiled`` is the model with locks; ``kept`` are the locked elements, which hold all of ``stuck``; ``shared`` are
    those that stick together in a loop; ``still`` if nothing moves.
    """

    rows: FrictionRows
    compiled: Compiled
    senses: Senses
    kept: tuple[int, ...]
    stuck: tuple[int, ...]
    shared: tuple[int, ...]
    still: bool
    quiet: Array


def state_values(piece: Piece, t: float, q: Array, v: Array, slots: Array) -> tuple[Array, Array, float]:
    """Values that stay positive within a piece, their derivatives (NaN of those that stick), return of the loads.

    Of an element that slides the rate in its sense; of one that sticks the friction still to be had (N or N m); 1 of
    others.
    """
    rows, base = piece.rows, piece.rows.compiled
    count, m = len(rows.elements), len(base.info)
    value, slope = np.ones(count), np.zeros(count)
    T = piece.compiled.tables
    if piece.shared or not T.lower.size:
        problem = FrictionProblem(rows, t, q, v, slots)
        fit = problem.at(piece.senses)
        if fit is None:
            return np.full(count, -1.0), slope, 0.0
        u, lam, forces, factor = problem.rates, fit.multipliers, fit.forces, 0.0
        du = problem.b + problem.A @ forces
    else:
        x = state_rows(T, q, v)
        _, J, gam, _ = constraint_system(rows.all.tables, x, slots, rows.all.driven(t))
        own = [*range(m), *(m + f for f in piece.kept)]
        Q = load_vector(T, x, applied_loads(base, t, q, v), base.currents)[0]
        out = np.zeros(7)
        a, lam = accelerate(T, x, np.ascontiguousarray(J[own]), gam[own], Q, out)
        u, du, forces, factor = J[m:] @ v, J[m:] @ a - gam[m:], np.zeros(count), float(out[3])
        forces[list(piece.kept)] = -lam[m:]
        if out[4] < 0.0:
            return np.full(count, np.nan), slope, factor
    for f, e in enumerate(rows.elements):
        s = piece.senses[f]
        if f in piece.stuck:
            value[f], slope[f] = e.static * e.lever * e.load(lam) - abs(float(forces[f])), np.nan
        elif s and not e.smooth:
            value[f], slope[f] = s * u[f], s * du[f]
        elif e.sticks and abs(u[f]) > piece.quiet[f]:
            value[f] = -1.0  # what held it besides friction lets it go
    return value, slope, factor
