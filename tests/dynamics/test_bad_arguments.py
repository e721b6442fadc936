"""Arguments of public functions that are not what they should be: a sentence of the project, never another exception.

Every argument of every call below is replaced by everything in ``BAD``; what a function can use, it may.
"""

from __future__ import annotations

import contextlib
import math
import signal
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from graphsynth import dynamics, formats
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.dynamics import (
    Body,
    DynamicModel,
    EffectiveInertia,
    Force,
    Torque,
    Train,
    consistent_start,
    inverse_dynamics,
    simulate_dynamics,
)
from graphsynth.formats import ExudynSettings, MujocoSettings, run_mujoco, to_mjcf
from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems import braider
from graphsynth.systems.braider import Braider
from graphsynth.systems.piston import FloatingPiston, GivenForce, PistonMachine
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import HarmonicDrive

G1 = ParallelPlatform.g1()
POSE, SIGMA = (1.2, 0.9, 0.15), (1, 1, 1)
DRIVEN = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
ARM = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
MODEL = DynamicModel(ARM, {1: Body(1.0, 0.1, (0.1, 0.0))})
MACHINE = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2))
BRAIDER, TRAIN, INERTIA = Braider(), Train(2.0), EffectiveInertia.of_slider(2.0, 0.05)
SLIDER = Tribometer(drive=HarmonicDrive(0.03, 2.0))


# what takes kernels is made on first use: a worker that only collects this file compiles nothing
@cache
def angles() -> Any:
    return G1.inverse(POSE, SIGMA).theta


@cache
def start() -> dynamics.StartReport:
    return consistent_start(MODEL, keep={(0, 1): 0.3})


@cache
def motion() -> Any:
    return simulate(ARM, [0.0, 0.1])


@cache
def run() -> dynamics.DynamicMotion:
    return simulate_dynamics(MODEL, [0.0, 0.01], start=start(), rtol=1e-6)


def at() -> dict[str, Any]:
    return {"pose": POSE, "theta": angles()}


def turn() -> dict[str, Any]:
    return {"platform": DRIVEN, "psi": 0.0, "pose": DRIVEN.home_pose(0.0)}


BAD = {
    "None": None, "text": "x", "ragged": [[1], [2, 3]], "nan": math.nan, "shape": np.zeros((2, 5)), "empty": [],
    "object": object(), "too large for a float": 10**400, "complex": 1j, "mapping": {"a": 1}, "negative": -1,
}  # fmt: skip


def of(room: str, name: str) -> Callable[..., Any]:
    return getattr(import_module(f"graphsynth.systems.platform.{room}"), name)  # type: ignore[no-any-return]


ON = {"platform": G1, "alpha": 0.1}
CALLS: dict[str, Callable[[], tuple[Callable[..., Any], dict[str, Any]]]] = {
    "vertices": lambda: (G1.vertices, {"pose": POSE}),
    "elbows": lambda: (G1.elbows, {"theta": angles()}),
    "inverse": lambda: (G1.inverse, {"pose": POSE, "sigma": SIGMA}),
    "closure": lambda: (G1.closure, at()),
    "jacobians": lambda: (G1.jacobians, at()),
    "determinant": lambda: (G1.determinant, at()),
    "working mode": lambda: (G1.working_mode, at()),
    "velocity matrix": lambda: (G1.velocity_matrix, at()),
    "scaled velocity matrix": lambda: (G1.scaled_velocity_matrix, at() | {"Lc": 1.0}),
    "accelerations": lambda: (G1.accelerations, at() | {"rate": (1, 1, 1), "rate2": (0, 0, 0)}),
    "rocker torques": lambda: (G1.rocker_torques, at() | {"wrench": (1, 0, 0)}),
    "direct": lambda: (G1.direct, {"theta": angles()}),
    "condition number": lambda: (G1.condition_number, at() | {"Lc": 1.0}),
    "quality": lambda: (of("maps", "quality"), {"platform": G1, "poses": [POSE], "sigma": SIGMA, "Lc": 1.0}),
    "map": lambda: (of("maps", "platform_map"), ON | {"sigma": SIGMA, "nodes": 8}),
    "orientations": lambda: (of("orientations", "orientations"), {"platform": G1, "point": 1 + 1j}),
    "type one circles": lambda: (of("singular_loci", "type_one_circles"), ON),
    "isolated points": lambda: (of("singular_loci", "isolated_singular_points"), ON | {"sigma": SIGMA, "nodes": 12}),
    "singularity": lambda: (of("singularity", "singularity"), at() | {"platform": G1, "tolerance": 1e-9}),
    "statics": lambda: (of("singularity", "statics"), at() | {"platform": G1, "wrench": (1, 0, 0), "tolerance": 1e-9}),
    "crank statics": lambda: (of("singularity", "crank_statics"), {
        "mechanism": DRIVEN, "psi": 0.0, "pose": DRIVEN.home_pose(0.0), "wrench": (1, 0, 0),
    }),
    "link poses": lambda: (of("rank_check", "link_poses"), turn()),
    "loop closure": lambda: (of("rank_check", "loop_closure"), {"mechanism": of("rank_check", "as_mechanism")(DRIVEN)}),
    "closure of a platform": lambda: (of("rank_check", "platform_loop_closure"), turn()),
    "small crank": lambda: (of("small_crank", "small_crank"), {"mechanism": DRIVEN}),
    "rockers": lambda: (of("small_crank", "small_crank")(DRIVEN).rockers, {"psi": [0.0]}),
    "sweep": lambda: (of("small_crank", "cold_sweep"), {"mechanism": DRIVEN, "samples": 8}),
    "workspace": lambda: (of("workspace", "constant_orientation_workspace"), ON | {"sigma": SIGMA, "tolerance": 1e-9}),
    "points of a workspace": lambda: (
        of("workspace", "constant_orientation_workspace")(G1, 0.1).contains, {"points": [1j]},
    ),
    "body": lambda: (Body, {"mass": 1.0, "inertia": 1.0, "centre": (0.0, 0.0)}),
    "combined": lambda: (lambda part: Body.combined(part, Body(1.0, 1.0)), {"part": Body(1.0, 1.0)}),
    "force": lambda: (Force, {"link": 1, "force": (1, 0), "at": (0, 0), "frame": "world", "breaks": ()}),
    "torque": lambda: (Torque, {"a": 0, "b": 1, "torque": 1.0, "breaks": ()}),
    "source": lambda: (dynamics.TorqueSource, {"a": 0, "b": 1, "ratio": 1.0, "breaks": ()}),
    "friction": lambda: (dynamics.JointFriction, {
        "a": 0, "b": 1, "kinetic": 0.1, "static": 0.2, "stribeck_speed": 1.0,
    }),
    "model": lambda: (DynamicModel, {"mechanism": ARM, "bodies": MODEL.bodies, "elements": (), "additional": ()}),
    "start": lambda: (consistent_start, {
        "model": MODEL, "pose": start().poses, "rates": start().velocities, "keep": {(0, 1): 0.3},
        "keep_rates": {(0, 1): 0.0}, "modes": None, "time": 0.0,
    }),
    "simulate": lambda: (simulate_dynamics, {
        "model": MODEL, "times": [0.0, 1e-3], "start": start(), "form": "auto", "method": "RK45", "rtol": 1e-4,
        "atol": 1e-4, "outputs": "exact", "max_steps": 20,
    }),
    "inverse dynamics": lambda: (inverse_dynamics, {
        "model": MODEL, "motion": motion(), "speed": 1.0, "acceleration": 0.0, "times": 0.0,
    }),
    "effective inertia": lambda: (dynamics.effective_inertia, {"model": MODEL, "inputs": [0.0, 0.1]}),
    "coordinate": lambda: (run().coordinate, {"base": 0, "link": 1}),
    "reaction": lambda: (run().reactions.between, {"a": 0, "b": 1, "index": 0}),
    "reaction on": lambda: (run().reactions.between(0, 1).on, {"link": 1, "frame": "body"}),
    "characteristic": lambda: (dynamics.LinearCharacteristic(1.0, 0.1).torque, {"speed": 1.0}),
    "teeth": lambda: (Train.of_teeth, {"stages": [(10, 20)], "efficiency": (0.9,), "inertia": 0.0}),
    "output torque": lambda: (TRAIN.output_torque, {"torque": 1.0, "speed": 1.0}),
    "reflected": lambda: (TRAIN.reflected, {"inertia": 1.0}),
    "components": lambda: (INERTIA.components, {"q": [0.0]}),
    "tip": lambda: (BRAIDER.tip, {"theta": [0.0]}),
    "acceleration of a braider": lambda: (BRAIDER.acceleration, {"theta": [0.0], "speed": 1.0, "motor_torque": 0.0}),
    "thread": lambda: (BRAIDER.thread.force, {"tip": [0j]}),
    "linkage of a braider": lambda: (braider.FourBar, {"crank": 0.02, "branch": 1}),
    "inductances": lambda: (BRAIDER.inductance_study, {"inductances": (1e-4,), "times": [0.0, 0.1]}),
    "piston": lambda: (MACHINE.loads, {"angle": [0.1]}),
    "inverse dynamics of a piston": lambda: (MACHINE.inverse_dynamics, {"angle": [0.1, 0.2], "slot": "sliding"}),
    "limit force": lambda: (SLIDER.limit_force, {"times": [0.0]}),
    "motion of a drive": lambda: (SLIDER.drive.motion, {"t": [0.0]}),
    "adjacency": lambda: (formats.adjacency_matrix, {"graph": ARM.graph}),
    "incidence": lambda: (formats.incidence_matrix, {"graph": ARM.graph}),
    "graph of a matrix": lambda: (formats.graph_from_adjacency, {"matrix": [[0, 1], [1, 0]], "frame": 0, "space": 3}),
    "tree": lambda: (formats.spanning_tree, {"mechanism": ARM}),
    "mjcf": lambda: (to_mjcf, {"model": MODEL, "start": start(), "settings": MujocoSettings()}),
    "MuJoCo": lambda: (run_mujoco, {
        "model": MODEL, "start": start(), "times": [0.0, 1e-3], "settings": MujocoSettings(1e-3),
    }),
    "settings of MuJoCo": lambda: (MujocoSettings, {"step": 1e-3, "integrator": "RK4", "solref": (-1.0, -1.0)}),
    "impedance of MuJoCo": lambda: (MujocoSettings, {"solimp": (0.9, 0.9, 0.1)}),
    "settings of exudyn": lambda: (ExudynSettings, {
        "step": 1e-3, "integrator": "trapezoidal", "spectral_radius": 0.5, "newton_tolerance": 1e-9,
    }),
    "format": lambda: (formats.format_of, {"path": "a.json", "name": "json"}),
    "text": lambda: (formats.read_text, {"text": "C]", "format": "graph6"}),
}  # fmt: skip


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Stop what takes longer: a bad argument is refused at once."""

    def late(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


@pytest.mark.parametrize("name", CALLS)
def test_bad_arguments_are_told_in_a_sentence(name: str) -> None:
    function, arguments = CALLS[name]()
    if name == "MuJoCo":
        pytest.importorskip("mujoco")
    function(**arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NaN in, NaN out
        for argument in arguments:
            for what, bad in BAD.items():
                try:
                    with at_most(5.0):
                        function(**arguments | {argument: bad})
                except GraphsynthError as error:
                    assert len(str(error)) > 15
                except BaseException as error:
                    pytest.fail(f"{argument} = {what}: {type(error).__name__}: {error}")


def test_a_singular_platform_and_shapes_that_do_not_fit_are_told() -> None:
    """Three parallel intermediate links: det JX is exactly 0."""
    vertices = np.array([1.0, 1j, -1.0])
    platform = ParallelPlatform(tuple(vertices - 2.0), tuple(vertices), (1.0,) * 3, (1.0,) * 3)
    pose, theta = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    assert platform.determinant(pose, theta) == 0.0
    for call in (
        lambda: platform.accelerations(pose, theta, (1, 0, 0), (0, 0, 0)),
        lambda: platform.rocker_torques(pose, theta, (1, 0, 0)),
        lambda: platform.velocity_matrix(pose, theta),
    ):
        with pytest.raises(GeometryError, match=r"det JX = 0: the platform is singular \(type II\) and has no velocit"):
            call()
    with pytest.raises(GeometryError, match=r"do not fit each other: pose \(2, 3\), theta \(3,\), rate \(5, 3\)"):
        G1.accelerations([POSE] * 2, angles(), np.ones((5, 3)), (0, 0, 0))
    with pytest.raises(GeometryError, match=r"wrench has shape \(2,\); its last axis must hold three numbers"):
        G1.rocker_torques(POSE, angles(), (1, 0))
    with pytest.raises(GeometryError, match="sigma is not an array of real numbers"):
        G1.inverse(POSE, [[1, 1], [1]])
    with pytest.raises(GeometryError, match=r"pose \(2, 3\), sigma \(5, 3\)"):
        G1.inverse([POSE] * 2, np.ones((5, 3)))


def test_a_batch_with_nan_keeps_the_others() -> None:
    theta = np.array([angles(), [math.nan] * 3])
    found = G1.condition_number(POSE, theta, 1.0)
    assert found[0] == pytest.approx(G1.condition_number(POSE, angles(), 1.0)) and math.isnan(found[1])
    assert G1.working_mode(POSE, theta).tolist() == [list(SIGMA), [0, 0, 0]]


def fails(*_: object) -> float:
    raise ZeroDivisionError("the motor is off")


def test_laws_that_raise_are_named() -> None:
    words = "raised ZeroDivisionError: the motor is off when called with"
    for element, who in ((Torque(0, 1, fails), "torque 0-1"), (Force(1, fails), "force on link 1")):
        model = DynamicModel(ARM, MODEL.bodies, [element])
        with pytest.raises(GeometryError, match=f"the {who} {words}"):
            consistent_start(model, keep={(0, 1): 0.3})
        with pytest.raises(GeometryError, match=f"the {who} {words}"):
            inverse_dynamics(model, motion())
    driven = Mechanism(ARM.graph, ARM.joints, [Driver(0, 1, fails)])
    with pytest.raises(GeometryError, match=f"the law of driver 0-1 {words}"):
        simulate(driven, [0.0, 0.1])
    prescribed = DynamicModel(Mechanism(ARM.graph, ARM.joints), MODEL.bodies, prescribed=[Driver(0, 1, fails)])
    with pytest.raises(GeometryError, match=f"the law of driver 0-1 {words}"):
        consistent_start(prescribed, pose=start().poses)
    gas = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=GivenForce(fails))
    with pytest.raises(GeometryError, match=f"the law of the gas {words}"):
        gas.loads([0.1])


def late_torque(t: float, angle: float, speed: float) -> float:
    """Without a value after some time: what an implicit solver meets on its way."""
    return 1.0 if t < 0.05 else fails()


@pytest.mark.parametrize("method", ["DOP853", "BDF"])
def test_a_law_that_raises_on_the_way_is_named(method: str) -> None:
    model = DynamicModel(ARM, MODEL.bodies, [Torque(0, 1, late_torque)])
    with pytest.raises(GeometryError, match="the torque 0-1 raised ZeroDivisionError"):
        simulate_dynamics(model, [0.0, 0.1], keep={(0, 1): 0.3}, method=method, rtol=1e-6)


def test_starts_belong_to_their_time_and_model() -> None:
    words = r"the start is for t = 0 s and the times begin at 1 s; call consistent_start with time=1"
    with pytest.raises(GeometryError, match=words):
        simulate_dynamics(MODEL, [1.0, 2.0], start=start())
    with pytest.raises(GeometryError, match=words):
        run_mujoco(MODEL, start(), [1.0, 2.0], MujocoSettings(1e-2))
    later = consistent_start(MODEL, keep={(0, 1): 0.3}, time=1.0)
    assert simulate_dynamics(MODEL, [1.0, 1.01], start=later, rtol=1e-6).completed
    other = DynamicModel(ARM, {1: Body(2.0, 0.1)})
    for call in (simulate_dynamics, run_mujoco):
        with pytest.raises(GeometryError, match="the start belongs to a model with another bodies"):
            call(other, [0.0, 0.1], start=start()) if call is simulate_dynamics else call(other, start(), [0.0, 0.1])
    with pytest.raises(GeometryError, match="start is NoneType, not a StartReport; give that of consistent_start"):
        to_mjcf(MODEL, None)  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="settings are ExudynSettings, not MujocoSettings"):
        to_mjcf(MODEL, start(), ExudynSettings())  # type: ignore[arg-type]
    tiny = DynamicModel(ARM, {1: Body(1.0, 1e-16)})
    with pytest.raises(GeometryError, match=r"inertia = 1e-16 kg m\^2 of link 1: MuJoCo takes none below 1e-15"):
        to_mjcf(tiny, consistent_start(tiny, keep={(0, 1): 0.3}))
