"""A dynamic model in exudyn: absolute coordinates, every joint a constraint, implicit integration.

See theory/exports 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import choice, finite, positive
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Element, Force, Spring, Torque, TorqueSource, TorsionSpring
from graphsynth.dynamics.model import DynamicModel, Rigid
from graphsynth.dynamics.start import StartReport, check_start
from graphsynth.formats.exporting import (
    EngineRun,
    check_common,
    check_settings,
    constant_torque,
    finished,
    gear_weights,
    load_engine,
    steps_between,
    turn,
)
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver

Array = NDArray[np.float64]
Point = tuple[float, float]
INTEGRATORS = ("generalized-alpha", "trapezoidal")


@dataclass(frozen=True)
class ExudynSettings:
    """How exudyn integrates.

    Parameters
    ----------
    step : float
        Seconds.
    integrator : {"generalized-alpha", "trapezoidal"}
        Index 3 with numerical damping, or the trapezoidal rule with velocity constraints (index 2).
    spectral_radius : float
        At infinite frequency, of generalized-alpha; 1 has no damping and is known to stop or diverge.
    newton_tolerance : float
        Relative, of the iteration in a step.

    Examples
    --------
    >>> ExudynSettings(1e-3).text
    'generalized-alpha, spectral radius 0.9'
    """

    step: float = 1e-4
    integrator: str = "generalized-alpha"
    spectral_radius: float = 0.9
    newton_tolerance: float = 1e-10

    def __post_init__(self) -> None:
        positive("step", self.step)
        positive("newton_tolerance", self.newton_tolerance)
        choice("integrator", self.integrator, INTEGRATORS)
        if not 0.0 <= finite("spectral_radius", self.spectral_radius) <= 1.0:
            raise GeometryError(f"spectral_radius = {self.spectral_radius} must lie in 0..1; 0.9 is usual")

    @property
    def text(self) -> str:
        """Integrator and its parameter in one line."""
        damped = self.integrator == "generalized-alpha"
        return self.integrator + (f", spectral radius {self.spectral_radius:g}" if damped else ", index 2")

    @property
    def family(self) -> str:
        """What stays the same when only the step changes."""
        return self.text


@dataclass(eq=False)
class ExudynModel:
    """An assembled exudyn system and where its items are.

    Attributes
    ----------
    container, system
        The engine's ``SystemContainer`` (keep it alive) and ``MainSystem``.
    nodes : dict of int to item
        Node of every moving link: coordinates of its centre of mass and its angle, as differences to the start.
    sensors : dict of int to (item, item)
        Coordinates and rates of every moving link.
    """

    container: Any
    system: Any
    nodes: dict[int, Any]
    bodies: dict[int, Any]
    sensors: dict[int, tuple[Any, Any]]


class _Work:
    """Workspace of one export."""

    def __init__(self, model: DynamicModel, start: StartReport) -> None:
        self.exu, self.items = load_engine("exudyn"), load_engine("exudyn.itemInterface")
        self.model, self.start = model, start
        container = self.exu.SystemContainer()
        self.system = container.AddSystem()
        self.export = ExudynModel(container, self.system, {}, {}, {})

    def angle(self, link: int) -> float:
        return float(self.start.poses[link, 2])

    def add(self, kind: str, **fields: Any) -> Any:
        """Add an item of the engine; its kind begins with Node, Object, Marker, Load or Sensor."""
        what = next(what for what in ("Node", "Object", "Marker", "Load", "Sensor") if kind.startswith(what))
        return getattr(self.system, f"Add{what}")(getattr(self.items, kind)(**fields))

    def spot(self, link: int, at: Point) -> Any:
        """Marker at a point of a link."""
        body = self.model.bodies.get(link)
        x, y = (at[0] - body.centre[0], at[1] - body.centre[1]) if body else at
        return self.add("MarkerBodyRigid", bodyNumber=self.export.bodies[link], localPosition=[x, y, 0.0])

    def turning(self, link: int) -> Any:
        """Marker at the angle of a link."""
        coordinate = 2 if link != self.model.mechanism.frame else 0
        return self.add("MarkerNodeCoordinate", nodeNumber=self.export.nodes[link], coordinate=coordinate)


def to_exudyn(model: DynamicModel, start: StartReport) -> ExudynModel:
    """Assemble a model in exudyn (floating point; the engine's own types).

    One rigid body for each link, R and P joints and slots as 2D joints, gear pairs as constraints between two angles,
    springs, dampers, constant forces and torques, drivers of revolute joints on velocity level.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport

    Returns
    -------
    ExudynModel

    Raises
    ------
    GeometryError
        What is not exported: cams, racks, gear pairs among three moving links, joint friction, loads that are
        functions, driven prismatic joints, rotors between two moving links, massless links; an inconsistent start.
    GraphsynthError
        exudyn is not installed.

    References
    ----------
    See theory/exports 2; [Gerstmayr 2024], Exudyn.
    """
    check_common(model, start, "exudyn")
    work = _Work(model, start)
    _add_bodies(work)
    for joint in (*model.mechanism.joints, *model.additional):
        _add_joint(work, joint)
    for element in model.elements:
        _add_element(work, element)
    for driver in model.prescribed:
        _add_driver(work, driver)
    work.system.Assemble()
    return work.export


def _add_bodies(work: _Work) -> None:
    export, start, frame = work.export, work.start, work.model.mechanism.frame
    kind = work.exu.OutputVariableType
    export.nodes[frame], export.bodies[frame] = work.add("NodePointGround"), work.add("ObjectGround")
    for k, (link, body) in enumerate(work.model.bodies.items()):
        place, rate = start.q[3 * k : 3 * k + 3], start.v[3 * k : 3 * k + 3]
        node = export.nodes[link] = work.add(
            "NodeRigidBody2D",
            referenceCoordinates=[float(place[0]), float(place[1]), work.angle(link)],
            initialCoordinates=[0.0, 0.0, 0.0],
            initialVelocities=[float(v) for v in rate],
        )
        rotor = 0.0
        for element in work.model.elements:  # the rotors of torque sources between the link and the frame
            if isinstance(element, TorqueSource) and element.rotor_inertia and link in (element.a, element.b):
                if frame not in (element.a, element.b):
                    between = f"{element.a}-{element.b} between moving links"
                    raise GeometryError(f"rotor of torque source {between} is not exported")
                rotor += element.ratio**2 * element.rotor_inertia
        inertia = body.inertia + rotor
        export.bodies[link] = work.add("ObjectRigidBody2D", mass=body.mass, inertia=inertia, nodeNumber=node)
        gravity = [body.mass * g for g in (*work.model.gravity, 0.0)]
        work.add("LoadForceVector", markerNumber=work.spot(link, body.centre), loadVector=gravity)
        kept = {"nodeNumber": node, "storeInternal": True, "writeToFile": False}
        export.sensors[link] = (
            work.add("SensorNode", outputVariableType=kind.Coordinates, **kept),
            work.add("SensorNode", outputVariableType=kind.Coordinates_t, **kept),
        )


def _add_joint(work: _Work, joint: Any) -> None:
    if isinstance(joint, Revolute | Rigid):
        spots = [work.spot(joint.a, joint.at_a), work.spot(joint.b, joint.at_b)]
        work.add("ObjectJointRevolute2D", markerNumbers=spots)
        if isinstance(joint, Rigid):
            work.add("ObjectConnectorCoordinate", markerNumbers=[work.turning(joint.a), work.turning(joint.b)])
    elif isinstance(joint, Prismatic | PinSlot):
        along = turn(joint.angle_b, (1.0, 0.0)) if isinstance(joint, Prismatic) else (1.0, 0.0)
        work.add(
            "ObjectJointPrismatic2D",  # the line belongs to the second marker
            markerNumbers=[work.spot(joint.b, joint.at_b), work.spot(joint.a, joint.at_a)],
            axisMarker0=[*along, 0.0],
            normalMarker1=[*turn(joint.angle_a, (0.0, 1.0)), 0.0],
            constrainRotation=isinstance(joint, Prismatic),
        )
    elif isinstance(joint, Gear):
        frame = work.model.mechanism.frame
        weights = {k: w for k, w in gear_weights(work.model, joint).items() if k != frame and abs(w) > 1e-14}
        if len(weights) != 2:
            raise GeometryError(f"gear pair {joint.a}-{joint.b} turns with a moving carrier: exported to MuJoCo only")
        (k, wk), (m, wm) = weights.items()
        work.add("ObjectConnectorCoordinate", markerNumbers=[work.turning(k), work.turning(m)], factor1=-wm / wk)
    else:
        raise GeometryError(f"{type(joint).__name__} is not exported to exudyn; leave it out")


def _add_element(work: _Work, element: Element) -> None:
    if isinstance(element, Spring):
        markers = [work.spot(element.a, element.at_a), work.spot(element.b, element.at_b)]
        own = {"stiffness": element.stiffness, "damping": element.damping, "referenceLength": element.free_length}
        work.add("ObjectConnectorSpringDamper", markerNumbers=markers, **own)
    elif isinstance(element, TorsionSpring):
        rest = element.free_angle - (work.angle(element.b) - work.angle(element.a))
        _torsion(work, element, element.stiffness, element.damping, rest)
    elif isinstance(element, Torque | TorqueSource):
        torque, damping = constant_torque(element)
        if damping:
            _torsion(work, element, 0.0, damping, 0.0)
        for link, load in ((element.a, -torque), (element.b, torque)):
            if link != work.model.mechanism.frame:
                work.add("LoadCoordinate", markerNumber=work.turning(link), load=load)
    elif isinstance(element, Force):
        if callable(element.force):
            raise GeometryError(f"force on link {element.link} is a function; an exported one must be constant")
        where, push = work.spot(element.link, element.at), [*element.force, 0.0]
        work.add("LoadForceVector", markerNumber=where, loadVector=push, bodyFixed=element.frame == "body")
    else:
        raise GeometryError(f"{type(element).__name__} is not exported to exudyn; leave it out")


def _torsion(
    work: _Work, between: TorsionSpring | Torque | TorqueSource, stiffness: float, damping: float, rest: float
) -> None:
    markers = [work.turning(between.a), work.turning(between.b)]
    spring = {"stiffness": stiffness, "damping": damping, "offset": rest}
    work.add("ObjectConnectorCoordinateSpringDamper", markerNumbers=markers, **spring)


def _add_driver(work: _Work, driver: Driver) -> None:
    if not isinstance(work.model.mechanism.joint(*driver.pair), Revolute):
        raise GeometryError(f"driver {driver.base}-{driver.link} of a prismatic joint is not exported to exudyn")

    def rate(system: Any, t: float, item: int, offset: float) -> float:
        return float(driver.law(np.array([t]))[1][0])

    turns = [work.turning(driver.base), work.turning(driver.link)]
    held = {"velocityLevel": True, "offsetUserFunction_t": rate, "offsetUserFunction": lambda *_: 0.0}
    work.add("ObjectConnectorCoordinate", markerNumbers=turns, **held)


def run_exudyn(
    model: DynamicModel, start: StartReport, times: ArrayLike, settings: ExudynSettings | None = None
) -> EngineRun:
    """Assemble a model in exudyn, run it, give the motion of all links back (estimated).

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
    times : array_like, shape (n,)
        Output times, s; the step must divide them, else `GeometryError`.
    settings : ExudynSettings, optional

    Returns
    -------
    EngineRun
        Status "failed" and NaN from where the solver stopped.

    Raises
    ------
    GeometryError, GraphsynthError
        As for :func:`to_exudyn`.
    """
    settings = ExudynSettings() if settings is None else settings
    check_settings(settings, ExudynSettings)
    grid, counts = steps_between(times, settings.step)
    check_start(model, start, float(grid[0]))
    export = to_exudyn(model, start)
    exu = load_engine("exudyn")
    every = reduce(math.gcd, counts)
    options = _options(exu, start, settings, counts[-1], every)
    kind = exu.DynamicSolverType
    solver = kind.GeneralizedAlpha if settings.integrator == "generalized-alpha" else kind.TrapezoidalIndex2
    begin, message = perf_counter(), ""
    exu.config.printToConsole, told = False, exu.config.printToConsole
    try:
        if not export.system.SolveDynamic(options, solverType=solver, showHints=False, updateInitialValues=False):
            message = "the solver stopped"
    except Exception as error:  # the engine raises its own kinds
        message = f"the solver stopped: {str(error).strip().splitlines()[0] if str(error).strip() else type(error)}"
    finally:
        exu.config.printToConsole = told
    seconds = perf_counter() - begin
    poses, rates = _collect(export, model, start, grid, [n // every for n in counts])
    if not message and not np.isfinite(poses).all():
        message = "the solver ended before the last output time"
    version = exu.config.Version()
    return finished("exudyn", version, settings, grid, (poses, rates), message, counts[-1], seconds)


def _options(exu: Any, start: StartReport, settings: ExudynSettings, steps: int, every: int) -> Any:
    options = exu.SimulationSettings()
    integration = options.timeIntegration
    integration.startTime, integration.endTime = start.time, start.time + steps * settings.step
    integration.numberOfSteps = steps
    integration.verboseMode = 0
    integration.adaptiveStep = False
    integration.newton.relativeTolerance = settings.newton_tolerance
    integration.generalizedAlpha.spectralRadius = settings.spectral_radius
    options.solution.file.write = False
    options.solution.sensors.writePeriod = every * settings.step
    options.show.statistics = False
    if len(start.rows) > start.rank:  # redundant constraints: the multipliers are not unique
        options.linearSolver.solverType = exu.LinearSolverType.EigenDense
        options.linearSolver.ignoreSingularJacobian = True
    return options


def _collect(
    export: ExudynModel, model: DynamicModel, start: StartReport, grid: Array, places: list[int]
) -> tuple[Array, Array]:
    """Poses and velocities of the link frames from the stored sensors, each (n, links, 3)."""
    poses, rates = np.full((2, grid.size, model.mechanism.graph.links, 3), np.nan)
    poses[:, model.mechanism.frame], rates[:, model.mechanism.frame] = 0.0, 0.0
    for k, (link, body) in enumerate(model.bodies.items()):
        place, rate = (np.atleast_2d(export.system.GetSensorStoredData(sensor)) for sensor in export.sensors[link])
        known = [n for n, row in enumerate(places) if row < len(place)]
        rows = [places[n] for n in known]
        if not rows or place.shape[1] != 4:
            continue
        q = place[rows, 1:] + np.array([*start.q[3 * k : 3 * k + 2], start.poses[link, 2]])
        v = rate[rows, 1:]
        arm = np.exp(1j * q[:, 2]) * complex(*body.centre)
        poses[known, link] = np.column_stack([q[:, 0] - arm.real, q[:, 1] - arm.imag, q[:, 2]])
        rates[known, link] = np.column_stack([v[:, 0] + v[:, 2] * arm.imag, v[:, 1] - v[:, 2] * arm.real, v[:, 2]])
    return poses, rates
