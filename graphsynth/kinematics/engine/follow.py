"""Following one branch of a mechanism over increasing or decreasing inputs, with step control.

What makes a step too long: docs/explanation/planar-engine.md, "Larger groups".  It is halved; a step that becomes too
small is a singularity, never a jump.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.inputs import coordinates
from graphsynth.kinematics.engine.program import Program

Array = NDArray[np.float64]

#: Smallest step, relative to the length of the whole range.
_SMALLEST = 1e-13
_TRIALS = 4000
#: Samples of the trace before a stop that are kept with those on the way to it.
_BEFORE = 64
#: Samples added before the end of a branch.
_CLOSER = 24


@dataclass(frozen=True)
class Way:
    """Samples on the way to a stop: inputs (n,), margins (n, steps), distances of the links from the origin (n, links).

    ``last`` are the trace and its sample that came closest.
    """

    u: Array
    margins: Array
    distances: Array
    last: tuple[Trace, int]


@dataclass(frozen=True)
class Stop:
    """Why and where following stopped: code of :mod:`.codes`, step of the program, input, and its uncertainty."""

    code: int
    step: int
    at: float
    uncertainty: float
    way: Way | None = None

    def after(self, earlier: Stop) -> Stop:
        """Return the same stop with the samples on the way to another one before its own."""
        if self.way is None or earlier.way is None:
            return self
        own, first = self.way, earlier.way
        before = np.flatnonzero((own.u[0] - first.u) * (own.u[-1] - first.u[0]) > 0.0)
        u, margins, distances = (
            np.concatenate([a[before], b])
            for a, b in ((first.u, own.u), (first.margins, own.margins), (first.distances, own.distances))
        )
        return replace(self, way=Way(u, margins, distances, own.last))


@dataclass
class Trace:
    """Samples of a branch: a solver workspace, not a result.

    ``q`` (drivers, 5, n) holds the driver coordinates, their derivatives, cosine and sine.  The state has the sample as
    last axis in memory; the names without underscore are views with the sample as first axis: ``X`` (n, links, 4) holds
    x, y, cos, sin; ``TH`` angles where gears need them; ``V``, ``W`` first and second derivatives by the input; ``M``
    (n, steps) margins; ``done`` the number of samples reached.
    """

    u: Array
    q: Array
    memory: codes.State
    done: int = 0
    stop: Stop | None = field(default=None)

    def __post_init__(self) -> None:
        self.X, self.TH, self.V, self.W, self.PHI, self.M = (
            part.transpose(part.ndim - 1, *range(part.ndim - 1)) for part in self.memory
        )

    def row(self, k: int) -> tuple[Array, ...]:
        """State at sample k."""
        return self.X[k], self.TH[k], self.V[k], self.W[k], self.PHI[k], self.M[k]

    def angles(self, program: Program, k: int) -> Array:
        """Angle of every link at sample k: with its turns where gears count them."""
        angle: Array = np.where(program.tables.need_angle, self.TH[k], np.arctan2(self.X[k, :, 3], self.X[k, :, 2]))
        return angle


class Tracker:
    """Runs a program; everything about one mechanism on one choice of assembly modes.

    ``centres`` (gears,) are the directions of the lines of centres, turns included, near which a start is looked for;
    ``turned`` (links,) the angles of a start pose, whose turns a motion goes on to count.
    """

    def __init__(
        self, program: Program, modes: Array, centres: Array | None = None, turned: Array | None = None
    ) -> None:
        self.turned = turned
        self._passed: tuple[Trace, int, list[tuple[Trace, int]]] | None = None
        self.program = program
        self.modes = modes
        self.centres = np.zeros(max(1, len(program.gears))) if centres is None else centres

    def values(self, u: Array) -> Array:
        """Driver coordinates, first and second derivatives, cosine and sine, shape (drivers, 5, n)."""
        drivers = self.program.mechanism.drivers
        q = np.zeros((max(1, len(drivers)), 5, len(u)))
        for k, driver in enumerate(drivers):
            for order, part in enumerate(coordinates(driver, u)):
                q[k, order] = part
        with np.errstate(invalid="ignore"):  # a law without a value is found by the kernel
            q[:, 3], q[:, 4] = np.cos(q[:, 0]), np.sin(q[:, 0])
        return q

    def blank(self, u: Array) -> Trace:
        """Return an empty trace for inputs ``u`` with every link at the origin."""
        p = self.program
        return Trace(u, self.values(u), workspace(p, len(u)))

    def run(self, trace: Trace, first: int, derivs: bool = True) -> tuple[int, int, int]:
        """Run the kernel from sample ``first``."""
        found = run_program(self.program, self.modes, trace, first, derivs)
        return int(found[0][0]), int(found[1][0, 0]), int(found[1][0, 1])

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
        trace.PHI[0] = self.centres if phi is None else phi

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

    def approach(self, trace: Trace, end: float) -> Trace:
        """Insert samples between the last one reached and the end of the branch, each four times as close to it.

        What happens there would not be seen otherwise, and near a fold much does: speeds grow without bound.
        """
        k = trace.done - 1
        gap = end - float(trace.u[k])
        source, at = trace, k
        pairs: list[Trace] = []
        lost = 0.0 if trace.stop is None else abs(end - trace.stop.at)
        while abs(gap := 0.25 * gap) > max(lost, 8.0 * np.spacing(abs(end))) and len(pairs) < _CLOSER:
            pair, stop = self.reach(source, at, end - gap)
            if stop is not None:
                break
            pairs.append(pair)
            source, at = pair, 1
        if not pairs:
            return trace

        def joined(whole: Array, *parts: Array) -> Array:
            new = [part[..., 1:] for part in parts]
            return np.concatenate([whole[..., : k + 1], *new, whole[..., k + 1 :]], axis=-1)

        memory = codes.State(*(joined(*parts) for parts in zip(trace.memory, *(pair.memory for pair in pairs))))
        u, q = joined(trace.u, *(pair.u for pair in pairs)), joined(trace.q, *(pair.q for pair in pairs))
        return Trace(u, q, memory, trace.done + len(pairs), trace.stop)

    def _bridge(self, trace: Trace, k: int, code: int) -> Stop | None:
        """Reach sample k from sample k - 1 by smaller steps; the reason if that is not possible."""
        total = abs(float(trace.u[-1] - trace.u[0])) or 1.0
        here, goal = float(trace.u[k - 1]), float(trace.u[k])
        source, at = trace, k - 1
        step, failed = 0.5 * (goal - here), (code, -1)
        way = [(trace, near) for near in range(max(0, at - _BEFORE), at)]
        if self._passed is not None and self._passed[0] is trace and self._passed[1] == at:
            way += self._passed[2]  # the step before was bridged too
        way.append((trace, at))
        begun = len(way)
        for _ in range(_TRIALS):
            target = goal if abs(step) >= abs(goal - here) else here + step
            pair, why, where = self.near(source, at, target)
            if why == codes.DONE:
                source, at, here = pair, 1, target
                way.append((pair, 1))
                if target == goal:
                    for final, reached in zip(trace.row(k), pair.row(1)):
                        final[...] = reached
                    self._passed = trace, k, way[begun:-1]
                    return None
                step *= 2.0
                continue
            failed = (why, where)
            step = 0.5 * (target - here)
            if abs(step) < _SMALLEST * total or here + step == here:
                break
        why, where = failed
        u, M, X = (np.array(part) for part in zip(*((one.u[j], one.M[j], one.X[j]) for one, j in way)))
        return Stop(why, where, here, abs(2.0 * step), Way(u, M, np.hypot(X[:, :, 0], X[:, :, 1]), (source, at)))


def workspace(program: Program, n: int, derivs: bool = True) -> codes.State:
    """State of every link over n samples, at the origin."""
    links = program.mechanism.graph.links
    X, TH, PHI = np.zeros((links, 4, n)), np.zeros((links, n)), np.zeros((max(1, len(program.gears)), n))
    X[:, 2] = 1.0
    V, W = (np.zeros((links, 3, n if derivs else 0)) for _ in range(2))
    return codes.State(X, TH, V, W, PHI, np.full((len(program.steps), n), np.nan))


_NOWHERE, _NOTHING = np.empty((0, 0, 0)), np.empty(0, np.int64)
_FRAMES = np.empty((0, 0, 0, 0))
_KEPT = codes.Delivery(_NOWHERE, np.empty((0, 0)), _NOTHING, _NOTHING, _FRAMES, _FRAMES, _FRAMES, _NOWHERE)


def run_program(
    program: Program,
    modes: Array,
    trace: Trace,
    first: int,
    derivs: bool,
    wanted: NDArray[np.bool_] | None = None,
    delivery: codes.Delivery = _KEPT,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Run the kernel for every dimension set; returns samples reached, and code and step of the stop."""
    sets, sizes = len(program.tables.row_table), (program.Lc, program.far)
    done, why = np.zeros(sets, dtype=np.int64), np.zeros((sets, 2), dtype=np.int64)
    every = np.ones(program.mechanism.graph.links, dtype=np.bool_) if wanted is None else wanted
    q, u, state = trace.q, trace.u, trace.memory
    (run,) = named("graphsynth.kinematics.engine.kernels.running", "run")
    run(program.tables, every, q, u, modes, state, delivery, done, why, first, sizes, derivs)
    return done, why
