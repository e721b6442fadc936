"""Drive torque and moments against exudyn: finite rotations, pins that touch the holes at both ends with clearance.

The engine gets bodies in space, for every joint two forces at the ends of a pin (a spring beyond the radial clearance)
and an axial one, for a guide along x torques beyond its roll and its pitch, and for the driven joint a constraint on
its tilted axis, whose reaction about that axis is the torque.  A weak spring (1e-5 of the contacts') keeps the pins
that touch nothing in place.
"""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import graphsynth as gs
from graphsynth.jamming.binding import unclosed_motion
from graphsynth.jamming.joints import RIGID, JointLimits, SlideLimits
from graphsynth.mechanism.joints import Prismatic

exu = pytest.importorskip("exudyn")
Array = NDArray[np.float64]
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


class Pin:
    """A pin of a length in a hole with radial and axial clearance and stiffness (SI)."""

    def __init__(self, length: float, radial: float, axial: float, stiffness: float) -> None:
        self.length, self.radial, self.axial, self.stiffness = length, radial, axial, stiffness

    @property
    def limits(self) -> JointLimits:
        return JointLimits(2.0 * self.radial / self.length, self.axial)

    @property
    def spring(self) -> gs.JointStiffness:
        return gs.JointStiffness.of_contacts(self.stiffness, self.length, self.stiffness)

    def loads(self, _mbs: Any, t: float, _item: int, place: Any, angles: Any, *_rest: Any) -> list[float]:
        """Force and torque on the pin; the weak spring gets weaker over the load steps."""
        weak = self.stiffness * 10.0 ** (-5.0 * t)
        axis = Rotation.from_euler("XYZ", angles).as_matrix()[:, 2]
        force, torque = np.zeros(3), np.zeros(3)
        for arm in (0.5 * self.length * axis, -0.5 * self.length * axis):
            end = (np.asarray(place) + arm) * [1.0, 1.0, 0.0]
            way = float(np.hypot(*end[:2]))
            own = end * (self.stiffness * max(1.0 - self.radial / way, 0.0) + weak) if way > 1e-12 else np.zeros(3)
            force, torque = force + own, torque + np.cross(arm, own)
        beyond = math.copysign(max(abs(place[2]) - self.axial, 0.0), place[2])
        force[2] += self.stiffness * beyond + weak * place[2]
        return [*force, *torque]


class Guide:
    """A block on a guide along x: free within roll and pitch, held across it and against yaw (SI)."""

    def __init__(self, roll: float, pitch: float, stiffness: float) -> None:
        self.limits, self.spring = SlideLimits(roll, pitch), gs.JointStiffness(1e-3 * stiffness, stiffness)
        self.roll, self.pitch, self.stiffness = roll, pitch, stiffness

    def loads(self, _mbs: Any, _t: float, _item: int, place: Any, angles: Any, *_rest: Any) -> list[float]:
        """Force and torque on the block; the turn as a vector."""
        turn = Rotation.from_euler("XYZ", angles).as_rotvec()
        beyond = [math.copysign(max(abs(x) - t, 0.0), x) for x, t in zip(turn, (self.roll, self.pitch, 0.0))]
        force = self.stiffness * np.array([0.0, place[1], place[2]])
        return [*force, *(self.spring.tilt * np.array(beyond))]


def engine(
    motion: gs.Motion, k: int, alpha: float, pins: dict[tuple[int, int], Any]
) -> tuple[float, dict[Any, float], dict[Any, float]]:
    """Torque about the tilted axis, tilting moments of the joints of a pose, and their forces in the plane."""
    import exudyn.itemInterface as items
    import exudyn.utilities as utilities

    mechanism, pose = motion.mechanism, motion.poses[k]
    driver = mechanism.drivers[0]
    system = exu.SystemContainer().AddSystem()
    tilted = Rotation.from_rotvec([alpha, 0.0, 0.0]).as_matrix()
    bodies = {mechanism.frame: system.AddObject(items.ObjectGround())}
    for link in range(mechanism.graph.links):
        if link == mechanism.frame:
            continue
        turn = Rotation.from_rotvec([0.0, 0.0, pose[link, 2]]).as_matrix()
        inertia = utilities.RigidBodyInertia(1.0, np.eye(3))
        own = {"position": [*pose[link, :2], 0.0], "rotationMatrix": tilted @ turn if link == driver.link else turn}
        kind = exu.NodeType.RotationRxyz
        bodies[link] = utilities.AddRigidBody(system, inertia, nodeType=kind, gravity=[0.0] * 3, **own)[1]
    read: dict[Any, Any] = {}
    pushed, held = {}, -1
    for joint in mechanism.joints:
        ends = ((joint.a, joint.at_a), (joint.b, joint.at_b))  # type: ignore[union-attr]
        marks = [
            system.AddMarker(items.MarkerBodyRigid(bodyNumber=bodies[link], localPosition=[*at, 0.0]))
            for link, at in ends
        ]
        if joint.pair == driver.pair:
            assert joint.a == driver.base == mechanism.frame
            turn = Rotation.from_rotvec([0.0, 0.0, pose[joint.b, 2]]).as_matrix()
            given = {"constrainedAxes": [1] * 6, "rotationMarker0": tilted @ turn, "rotationMarker1": np.eye(3)}
            thing = system.AddObject(items.GenericJoint(markerNumbers=marks, **given))
        else:
            law = pins[joint.pair].loads
            given = {"stiffness": np.eye(6), "damping": np.zeros((6, 6)), "springForceTorqueUserFunction": law}
            thing = system.AddObject(items.ObjectConnectorRigidBodySpringDamper(markerNumbers=marks, **given))
        what = exu.OutputVariableType.TorqueLocal
        sensor = system.AddSensor(items.SensorObject(objectNumber=thing, storeInternal=True, outputVariableType=what))
        if joint.pair == driver.pair:
            held = sensor
        else:
            read[joint.pair] = sensor
            force = {
                "objectNumber": thing,
                "storeInternal": True,
                "outputVariableType": exu.OutputVariableType.ForceLocal,
            }
            pushed[joint.pair] = system.AddSensor(items.SensorObject(**force))
    system.Assemble()
    exu.config.suppressWarnings = True
    settings = exu.SimulationSettings()
    solver = settings.staticSolver
    solver.newton.relativeTolerance = solver.newton.absoluteTolerance = 1e-8
    solver.newton.maxIterations, solver.numberOfLoadSteps, solver.adaptiveStep = 60, 8, False
    solver.newton.numericalDifferentiation.forODE2 = True
    settings.solutionSettings.writeSolutionToFile = False
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            system.SolveStatic(settings)
        except Exception:  # its solver has no line search, and may go to and fro between two contacts
            nothing = dict.fromkeys(read, math.nan)
            return math.nan, nothing, nothing
    moments, forces = (
        {pair: float(np.hypot(*system.GetSensorStoredData(own)[-1][1:3])) for pair, own in part.items()}
        for part in (read, pushed)
    )
    return -float(system.GetSensorStoredData(held)[-1][3]), moments, forces


def pins_of(mechanism: gs.Mechanism, seed: int, axial: float, size: float) -> dict[tuple[int, int], Any]:
    random = np.random.default_rng(seed)
    return {
        joint.pair: Guide(2e-3, 1e-3, 2e6)
        if isinstance(joint, Prismatic)
        else Pin(0.1 * size, random.uniform(1e-4, 4e-4) * size, axial, random.uniform(1e6, 3e6))
        for joint in mechanism.joints
        if joint.pair != mechanism.drivers[0].pair
    }


@pytest.mark.parametrize(
    ("name", "alpha", "axial", "size"),
    [("lambda", 0.02, 0.0, 0.2), ("four-bar", 0.05, 3e-4, 0.2), ("six-bar", 0.03, 0.0, 1.0), ("press", 0.02, 0.0, 0.1)],
)
def test_against_a_general_engine(name: str, alpha: float, axial: float, size: float) -> None:
    mechanism = {
        "lambda": gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25),
        "four-bar": gs.Mechanism.four_bar(0.3, 0.1, 0.32, 0.25),
        "six-bar": gs.gallery.watt_six_bar(),
        "press": gs.Mechanism.slider_crank(0.04, 0.08),
    }[name]
    motion = mechanism.simulate(np.radians(np.arange(10.0, 370.0, 40.0)))
    assert motion.completed
    pins = pins_of(mechanism, len(name), axial, size)
    joints = {mechanism.drivers[0].pair: RIGID} | {pair: pin.limits for pair, pin in pins.items()}
    report = motion.binding(tilt=alpha, joints=joints, stiffness={pair: pin.spring for pair, pin in pins.items()})
    assert report.energy.max() > 0.0
    found = [engine(motion, k, alpha, pins) for k in range(len(motion.inputs))]
    torque = np.array([own[0] for own in found])
    solved = np.isfinite(torque)
    assert solved.sum() >= 7
    size = alpha * report.moment.max()  # of what small tilts and the play in the plane change
    np.testing.assert_allclose(torque[solved], report.elastic_torque[solved], atol=alpha**2 * size)
    exact = report.exact()
    np.testing.assert_allclose(torque[solved], exact.torque[solved], atol=alpha**2 * size)
    for k, pair in enumerate(report.joints):
        if pair in pins:
            moments = np.array([own[1][pair] for own in found])
            np.testing.assert_allclose(moments[solved], report.moment[solved, k], atol=alpha**2 * report.moment.max())


def pressed(mechanism: gs.Mechanism, inputs: Array, radial: float, clearance: float) -> Any:
    """Report in the plane, all pins alike but that of the motor, which is rigid; and the engine's pins."""
    five = mechanism.graph.links == 5
    motion = unclosed_motion(mechanism, inputs) if five else mechanism.simulate(inputs, events=False)
    joints = {joint.pair: JointLimits(math.inf, 0.0, radial_clearance=clearance) for joint in mechanism.joints}
    joints[mechanism.drivers[0].pair] = RIGID
    springs = {pair: gs.JointStiffness(1.0, 1.0, 2.0 * radial) for pair in joints}
    springs[mechanism.drivers[0].pair] = gs.JointStiffness(1.0)
    report = motion.binding(tilt=(), joints=joints, stiffness=springs)
    pins = {pair: Pin(0.02, clearance, 0.0, radial) for pair in joints if pair != mechanism.drivers[0].pair}
    return report, pins


@pytest.mark.parametrize("name", ["tension", "compression", "three cranks"])
def test_shifts_against_a_general_engine(three_cranks: Callable[[float], gs.Mechanism], name: str) -> None:
    """Links in line that are too short and too long, and a crank too many."""
    mechanism = {
        "tension": gs.Mechanism.four_bar(0.2, 0.1, 0.15, 0.1496),
        "compression": gs.Mechanism.four_bar(0.2, 0.1, 0.2004, 0.1),
        "three cranks": three_cranks(3e-4),
    }[name]
    middle = {"tension": 180.0, "compression": 360.0, "three cranks": 60.0}[name]
    inputs = np.radians(np.linspace(middle - 20.0, middle + 20.0, 21))
    report, pins = pressed(mechanism, inputs, 1e7, 4e-5)
    loaded = np.flatnonzero(report.energy > 0.1 * report.energy.max())
    assert len(loaded) > 2
    found = [engine(report.motion, int(k), 0.0, pins) for k in loaded]
    torque = np.array([own[0] for own in found])
    solved = np.isfinite(torque)
    assert solved.sum() > 2
    most = 0.1 * report.push.max()  # a force at the end of the crank; the engine's weak springs change 2e-5 of it
    np.testing.assert_allclose(torque[solved], report.elastic_torque[loaded][solved], atol=1e-4 * most)
    for k, pair in enumerate(report.joints):
        if pair in pins:
            forces = np.array([own[2][pair] for own in found])[solved]
            np.testing.assert_allclose(forces, report.push[loaded, k][solved], rtol=1e-4)
