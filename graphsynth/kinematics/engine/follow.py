"""Following one branch of a mechanism over increasing or decreasing inputs, with step control.

A closed-form step fails only where its group cannot be assembled.  A Newton step is refused when the corrector moves
far compared with the predictor, converges slowly, or the determinant halves or changes sign; it is then
halved.  A step that becomes too small is a singularity, never a jump.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.program import Program

__all__ = ["Stop", "Trace", "Tracker"]

Array = NDArray[np.float64]

#: Smallest step, relative to the length of the whole range.
_SMALLEST = 1e-13
_TRIALS = 4000


@dataclass(frozen=True)
class Stop:
    """Why and where following stopped: code of :mod:`.codes`, step of the program, input, and its uncertainty."""

    code: int
    step: int
    at: float
    uncertainty: float
    history: tuple[tuple[float, float], ...] = ()


@dataclass
class Trace:
    """Samples of a branch: a solver workspace, not a result.

    ``X`` (n, links, 4) holds x, y, cos, sin; ``TH`` angles where gears need them; ``V``, ``W`` first and second
    derivatives by the input; ``M`` (n, steps) margins; ``done`` the number of samples reached.
    """

    u: Array
    q: Array
    X: Array
    TH: Array
    V: Array
    W: Array
    PHI: Array
    M: Array
    done: int = 0
    stop: Stop | None = field(default=None)

    def row(self, k: int) -> tuple[Array, ...]:
        """State at sample k."""
        return self.X[k], self.TH[k], self.V[k], self.W[k], self.PHI[k], self.M[k]


class Tracker:
    """Runs a program; everything about one mechanism on one choice of assembly modes."""

    def __init__(self, program: Program, modes: Array) -> None:
        self.program = program
        self.modes = modes

    def values(self, u: Array) -> Array:
        """Driver coordinates and derivatives, shape (n, drivers, 3)."""
        drivers = self.program.mechanism.drivers
        q = np.zeros((len(u), max(1, len(drivers)), 3))
        for k, driver in enumerate(drivers):
            for order, part in enumerate(driver.law(u)):
                q[:, k, order] = part
        return q

    def blank(self, u: Array) -> Trace:
        """Return an empty trace for inputs ``u`` with every link at the origin."""
        p = self.program
        n, links = len(u), p.mechanism.graph.links
        X = np.zeros((n, links, 4))
        X[:, :, 2] = 1.0
        slots = max(1, len(p.gears))
        return Trace(
            u, self.values(u), X, np.zeros((n, links)), np.zeros((n, links, 3)), np.zeros((n, links, 3)),
            np.zeros((n, slots)), np.full((n, len(p.steps)), np.nan),
        )  # fmt: skip

    def run(self, trace: Trace, first: int, derivs: bool = True) -> tuple[int, int, int]:
        """Run the kernel from sample ``first``."""
        from graphsynth.kinematics.engine import kernels

        p = self.program
        done, why = np.zeros(1, dtype=np.int64), np.zeros((1, 2), dtype=np.int64)
        kernels.run(
            p.step_table, p.rows, p.row_table, p.core, p.eliminated, p.eliminated_table, p.drives,
            p.drive_table, p.need_angle, p.gears, trace.q, trace.u, self.modes, trace.X[None], trace.TH[None],
            trace.V[None], trace.W[None], trace.PHI[None], trace.M[None], done, why, first, p.Lc, derivs,
        )  # fmt: skip
        return int(done[0]), int(why[0, 0]), int(why[0, 1])

    def follow(self, u: Array, poses: Array, phi: Array | None = None) -> Trace:
        """Follow the branch that starts near ``poses`` (links, 3) at ``u[0]``."""
        trace = self.blank(u)
        self.seed(trace, poses, phi)
        first = 0
        while first < len(u):
            done, code, step = self.run(trace, first)
            trace.done = done
            if done == len(u):
                break
            if done == 0 or code == codes.BAD_INPUT:
                trace.stop = Stop(code, step, float(u[done]), 0.0)
                break
            trace.stop = self._bridge(trace, done, code)
            if trace.stop is not None:
                break
            trace.done = first = done + 1
        return trace

    def seed(self, trace: Trace, poses: Array, phi: Array | None = None) -> None:
        """Put approximate poses (links, 3) into the first sample."""
        trace.X[0, :, :2] = poses[:, :2]
        trace.X[0, :, 2], trace.X[0, :, 3] = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        trace.TH[0] = poses[:, 2]
        if phi is not None:
            trace.PHI[0] = phi

    def near(self, trace: Trace, k: int, u: float) -> tuple[Trace, int, int]:
        """Evaluate at ``u`` from sample ``k`` of a trace in one step; returns a two-sample trace, code and step."""
        pair = self.blank(np.array([trace.u[k], u]))
        for target, source in zip(pair.row(0), trace.row(k)):
            target[...] = source
        done, code, step = self.run(pair, 1)
        return pair, (code if done < 2 else codes.DONE), step

    def reach(self, trace: Trace, k: int, u: float) -> tuple[Trace, Stop | None]:
        """Evaluate at ``u`` from sample ``k`` of a trace, in as many steps as it takes.

        Returns a two-sample trace, and why ``u`` was not reached (None if it was).
        """
        pair, code, step = self.near(trace, k, u)
        if code == codes.DONE:
            return pair, None
        if code == codes.UNREACHABLE:
            return pair, Stop(code, step, u, 0.0)
        return pair, self._bridge(pair, 1, code)

    def _bridge(self, trace: Trace, k: int, code: int) -> Stop | None:
        """Reach sample k from sample k - 1 by smaller steps; the reason if that is not possible."""
        total = abs(float(trace.u[-1] - trace.u[0])) or 1.0
        here, goal = float(trace.u[k - 1]), float(trace.u[k])
        source, at = trace, k - 1
        step, failed = 0.5 * (goal - here), (code, -1)
        history: list[tuple[int, float, Array]] = []
        for _ in range(_TRIALS):
            target = goal if abs(step) >= abs(goal - here) else here + step
            pair, why, where = self.near(source, at, target)
            if why == codes.DONE:
                history.append((where, target, pair.M[1].copy()))
                source, at, here = pair, 1, target
                if target == goal:
                    for final, reached in zip(trace.row(k), pair.row(1)):
                        final[...] = reached
                    return None
                step *= 2.0
                continue
            failed = (why, where)
            step = 0.5 * (target - here)
            if abs(step) < _SMALLEST * total or here + step == here:
                break
        why, where = failed
        margins = tuple((target, float(M[where])) for _, target, M in history[-6:])
        return Stop(why, where, here, abs(2.0 * step), margins)
