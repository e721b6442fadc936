"""The one-coordinate form: one independent coordinate through the planar engine (theory/planar-dynamics 4)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import kernels
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.stepping import NO_LOADS, ONE_STAGE, Form, Stages
from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import applied_loads, initial_slots, joint_coordinate
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.kinematics.engine.start import started
from graphsynth.mechanism.laws import Linear

if TYPE_CHECKING:
    from graphsynth.dynamics.friction.loads import FrictionRows

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


#: Sine of a dyad's angle below which modes may meet within a step.
_CLOSE = 0.2


class EngineTables(NamedTuple):
    """The engine's program for the kernel; see `graphsynth.kinematics.engine.kernels.running.run`."""

    steps: IntArray
    touched: IntArray
    rows: IntArray
    RP: Array
    core: IntArray
    elim: IntArray
    EP: Array
    drv: IntArray
    DP: Array
    need: NDArray[np.bool_]
    wanted: NDArray[np.bool_]
    modes: Array
    poses: Array
    centres: Array
    kept: IntArray
    groups: IntArray
    OX: Array
    OV: Array
    OW: Array
    OM: Array
    first: int
    Lc: float
    far: float
    derivs: bool


class EngineState(NamedTuple):
    """Two samples of the engine: where it starts, and what is asked for.

    ``centres`` (3, n) are the coordinates of the centres of mass and their derivatives by the input.
    """

    u: Array
    q: Array
    X: Array
    TH: Array
    V: Array
    W: Array
    PHI: Array
    M: Array
    done: IntArray
    why: IntArray
    centres: Array


class InertiaCurve(NamedTuple):
    """Effective inertia at the input, its derivative, and the mechanism's transmission to every link.

    ``inertia`` J and ``slope`` dJ/dtheta, shape (n,), kg m^2 (kg for a sliding input); NaN where the pose is out of
    reach.
    """

    inputs: Array
    inertia: Array
    slope: Array


def one_coordinate_obstacle(model: DynamicModel) -> str:
    """Why a model has no one-coordinate form through the planar engine; empty if it has one."""
    mechanism = model.mechanism
    if model.additional or model.prescribed:
        return "it has additional constraints or prescribed motions"
    if len(mechanism.drivers) != 1:
        return f"the mechanism names {len(mechanism.drivers)} drivers, not the one independent coordinate"
    if mechanism.graph.mobility != 1:
        return f"the mobility by count is {mechanism.graph.mobility}, not 1"
    return ""


class OneCoordinateForm(Form):
    """State ``(theta, omega, currents, work)``."""

    name = "one-coordinate"
    stall = (
        "the input is next to a fold or a change point, where two assembly modes merge or meet, and is no coordinate "
        "there; use form='augmented' or 'partitioned'"
    )

    def __init__(self, compiled: Compiled, start: StartReport) -> None:
        obstacle = one_coordinate_obstacle(compiled.model)
        if obstacle:
            raise GeometryError(
                f"there is no one-coordinate form: {obstacle}; use form='augmented' or form='partitioned'"
            )
        self.inertia = float("nan")
        self._slopes: dict[int, float] = {}
        self._rows: FrictionRows | None = None
        mechanism = compiled.model.mechanism
        driver = replace(mechanism.drivers[0], law=Linear())  # its coordinate is the input
        found = joint_coordinate(mechanism, driver.base, driver.link, start.poses, start.velocities)
        theta, omega = (float(part) for part in found)
        super().__init__(compiled, np.concatenate([[theta, omega], compiled.tail]))
        self.unit = np.array([compiled.tables.size if mechanism.joint(*driver.pair).kind == "P" else 1.0])
        self._out, self._one = np.zeros(4), np.empty((1, len(self._begin)))
        tracker = started(compile_program(replace(mechanism, drivers=(driver,))), theta, {}, np.asarray(start.poses))
        self.program, trace = tracker.program, tracker.blank(np.array([theta, theta]))
        X, TH, V, W, PHI, M = trace.memory
        done, why = np.zeros(1, np.int64), np.zeros((1, 2), np.int64)
        self.S = EngineState(trace.u, trace.q, X, TH, V, W, PHI, M, done, why, np.zeros((3, compiled.n)))
        program, wanted = tracker.program, np.ones(mechanism.graph.links, dtype=np.bool_)
        empty2, empty3, empty4 = np.empty((0, 0)), np.empty((0, 0, 0)), np.empty((0, 0, 0, 0))
        none = np.empty(0, np.int64)
        kept = empty3, empty2, none, none, empty4, empty4, empty4, empty3
        self.E = EngineTables(*program.tables, wanted, tracker.modes, *kept, 1, program.Lc, program.far, True)
        # start the engine at the start pose, in its sample 0
        first = tracker.blank(np.array([theta]))
        tracker.seed(first, start.poses)
        if tracker.run(first, 0)[0] < 1:
            raise GeometryError(f"the planar engine does not reach the start pose at the input {theta:.6g}")
        for target, source in zip(trace.row(0), first.row(0)):
            target[...] = source
        self.S.u[0] = theta
        for link in compiled.moving:
            if not self.program.tables.need_angle[link]:
                trace.TH[0, link] = start.poses[link, 2]

    def rates(self, t: float, y: Array) -> Array:
        """Return the derivative of the state; NaN where the mechanism cannot be assembled."""
        if self.compiled.applied or self.compiled.tables.friction.size:
            return self._loaded_rates(t, y)
        self._run(y, 0.0, ONE_STAGE, self._one, 0, 1)
        return self._one[0].copy() if self._out[0] > 0.0 and self._out[3] == 1.0 else self._failed(y)

    def _run(self, y: Array, h: float, A: Array, K: Array, low: int, high: int) -> Array:
        model = self.compiled.tables, self.E, self.S, self.compiled.centres, self._none
        run = kernels.one_coordinate_stages
        return np.asarray(run(*model, np.ascontiguousarray(y), h, A, K, low, high, self._out))

    @property
    def stages(self) -> Stages | None:
        """A compiled Runge-Kutta step, if no load is given as a function and there is no friction."""
        return None if self.compiled.tables.friction.size else super().stages

    def step(self, t: float, y: Array, h: float, A: Array, K: Array) -> Array:
        """Return the end of a compiled Runge-Kutta step."""
        fresh = self._run(y, h, A, K, 1, len(A))
        if not np.isfinite(K).all():
            self.rates(0.0, fresh)  # says why
        return fresh

    def _failed(self, y: Array) -> Array:
        """Say why; the integrator tries a shorter step, and gives up where none is short enough."""
        if not np.isfinite(y).all():  # asked by a solver that has lost its way: no word on the mechanism
            return np.full(len(y), np.nan)
        if self.S.done[0] == 2:
            self.why = (
                "a spring has length 0, so its direction is not defined"
                if self._out[3] == 0.0
                else f"the effective inertia is {self._out[0]:.3g} at the input {y[0]:.9g}: give a link on the way "
                "some mass"
            )
        else:
            self.why = (
                f"the coordinate cannot go beyond {self.S.u[0]:.9g}: at a fold next to it two assembly modes merge, "
                "and it is no coordinate there; use form='augmented' or 'partitioned'"
            )
        return np.full(len(y), np.nan)

    def transmission(self, theta: float) -> tuple[Array, Array, Array]:
        """Coordinates and their first and second derivatives by the input; NaN out of reach."""
        if self.S.done[0] < 2 or self.S.u[1] != theta:  # else the engine has just been there
            y = np.zeros(len(self._begin))
            y[0] = theta
            self._run(y, 0.0, ONE_STAGE, self._one, 0, 1)
        if self.S.done[0] < 2:
            return (np.full(self.compiled.n, np.nan),) * 3
        q, q1, q2 = self.S.centres.copy()
        return q, q1, q2

    def _loaded_rates(self, t: float, y: Array) -> Array:
        """Rates with loads given as functions, or with friction."""
        q, q1, q2 = self.transmission(float(y[0]))
        if not np.isfinite(q).all():
            return self._failed(y)
        y, T = np.ascontiguousarray(y), self.compiled.tables
        w = float(y[1])
        v = q1 * w
        x = kernels.state_rows(T, q, v)
        Q, _, _, P, good = kernels.load_vector(T, x, applied_loads(self.compiled, t, q, v), y[2:])
        Mq = T.mass @ q1
        inertia = float(Mq @ q1)
        self._out[0], self._out[3] = inertia, float(good)
        if T.friction.size:
            rubbed = self._rub(t, q, v, x, Q)
            if not np.isfinite(rubbed):
                self.why = NO_LOADS
                return np.full(len(y), np.nan)
            P += rubbed
        if not (inertia > 0.0 and good):
            return self._failed(y)
        found = np.empty((1, len(y)))
        found[0, :2] = w, float(Q @ q1 - Mq @ q2 * w * w) / inertia
        kernels.finish(T, x, y, found, 0, 2, float(P))
        return np.asarray(found[0])

    def _rub(self, t: float, q: Array, v: Array, x: Array, Q: Array) -> float:
        """Add friction to the generalised forces; returns its power, NaN if there is none that fits."""
        T = self.compiled.tables
        slots = initial_slots(self.compiled, q)
        if not T.lower.size:  # links without mass
            if self._rows is None:
                from graphsynth.dynamics.friction.loads import FrictionRows

                self._rows = FrictionRows(self.compiled)
            from graphsynth.dynamics.friction.problem import FrictionProblem

            problem = FrictionProblem(self._rows, t, q, v, slots)
            fit = problem.at(tuple(int(s) if abs(s) <= 1.0 else 0 for s in T.friction_table[:, 6]))
            if fit is None:
                return float("nan")
            Q += problem.W.T @ fit.forces
            return float(problem.rates @ fit.forces)
        _, J, gam, _ = kernels.constraint_system(T, x, slots, np.zeros((1, 3)))
        out = np.zeros(7)
        _, lam = kernels.accelerate(T, x, J, gam, Q, out)
        self.contraction = max(self.contraction, float(out[3]))
        return float(kernels.friction_loads(T, x, J, lam, Q)) if out[4] >= 0.0 else float("nan")

    def refuses(self, t: float, y: Array) -> bool:
        """Whether two assembly modes met within the step: the sign of a mode says nothing of how it goes on there.

        The sine of a dyad's angle is the root of its margin; it falls towards 0 and rises again where modes meet.
        """
        self.transmission(float(y[0]))
        if self.S.done[0] < 2:
            return False
        h = float(y[0]) - float(self.S.u[0])
        for k, step in enumerate(self.program.steps):
            if not step.has_two_modes or h == 0.0:
                continue
            before, after = np.sqrt(np.maximum(self.S.M[k, :2], 0.0))
            slope = self._slopes.get(k)
            self._slopes[k] = (after - before) / h
            if min(before, after) < _CLOSE and slope is not None and before + slope * h < 0.0:
                self.why = (
                    f"two assembly modes of group {step.group} meet near the input {float(y[0]):.6g}, and the minimal "
                    "form cannot tell how the motion goes on; use form='augmented'"
                )
                return True
        return False

    def accept(self, t: float, y: Array) -> Array:
        """Move the engine's first sample to the accepted input."""
        _, q1, _ = self.transmission(float(y[0]))
        if self.S.done[0] == 2:
            self.S.u[0] = y[0]
            for part in (self.S.X, self.S.TH, self.S.V, self.S.W, self.S.PHI, self.S.M):
                part[..., 0] = part[..., 1]
            sines = [self.S.M[k, 1] for k, step in enumerate(self.program.steps) if step.has_two_modes]
            self.pivot = float(np.sqrt(max(min(sines, default=1.0), 0.0)))
            self.inertia = float(q1 @ self.compiled.tables.mass @ q1)
        return y

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of a state."""
        q, q1, _ = self.transmission(float(y[0]))
        return q, q1 * y[1]

    def accelerations(self, t: float, y: Array) -> Array:
        """Accelerations of all coordinates in this form."""
        _, q1, q2 = self.transmission(float(y[0]))
        return np.asarray(q1 * self.rates(t, y)[1] + q2 * y[1] ** 2)


@checked
def effective_inertia(model: DynamicModel, inputs: ArrayLike, **options: object) -> InertiaCurve:
    """Effective inertia ``J(theta) = sum m |r'|^2 + I psi'^2 (+ rotors)`` over the input, and its derivative.

    Parameters
    ----------
    model : DynamicModel
        Mobility 1, one driver named by the mechanism.
    inputs : array_like, shape (n,)
        Monotonic; radians, or metres for a sliding input.
    **options
        ``modes`` and ``start`` of :func:`graphsynth.kinematics.simulate`.

    Returns
    -------
    InertiaCurve
        Arrays of shape (n,): ``inertia``, ``slope``, and the ``inputs`` (estimated: floating point).

    Raises
    ------
    GeometryError
        If the mechanism has no single input to reduce to.

    Examples
    --------
    >>> from graphsynth.dynamics.model import Body
    >>> from graphsynth.mechanism.joints import Revolute
    >>> from graphsynth import Driver, Mechanism, MechanismGraph
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(3.0, (0.0, 0.0), (1.0, 0.0))})
    >>> effective_inertia(model, [0.0, 1.0]).inertia.round(12).tolist()
    [1.0, 1.0]
    """
    from graphsynth.dynamics.tables import compile_model
    from graphsynth.kinematics.simulation import simulate

    obstacle = one_coordinate_obstacle(model)
    if obstacle:
        raise GeometryError(f"there is no effective inertia: {obstacle}")
    compiled = compile_model(model)
    driver = replace(model.mechanism.drivers[0], law=Linear())
    motion = simulate(replace(model.mechanism, drivers=(driver,)), inputs, events=False, **options)  # type: ignore[arg-type]
    q = compiled.to_coordinates(motion.poses)
    first = compiled.to_rates(q, motion.velocities)
    second = compiled.to_rates(q, motion.velocities, motion.accelerations)
    weighted = first @ compiled.tables.mass
    inertia = (weighted * first).sum(axis=1)
    return InertiaCurve(motion.inputs, inertia, 2.0 * (weighted * second).sum(axis=1))
