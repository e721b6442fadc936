"""MuJoCo runs the exported model: every kind of joint and load against the internal motion.

See theory/planar-dynamics 9 and theory/exports 3.
"""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import engine_models as models
import numpy as np
import pytest
from dynamic_models import g1, g2, seven_body, seven_pose

from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.dynamics import (
    Body,
    DynamicModel,
    Force,
    JointFriction,
    TorqueSource,
    consistent_start,
    simulate_dynamics,
)
from graphsynth.formats import MujocoSettings, certify_export, run_mujoco, spanning_tree, to_mjcf
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

G1_THETA, G1_OMEGA = 19.151183313715786848, 13.058518322326194277


@pytest.fixture(scope="module")
def start():
    return consistent_start(g1(), modes={0: 1}, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0})


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        (MujocoSettings(1e-3, solref=(0.002, 1.0)), -2.3e-5),
        (MujocoSettings(1e-3, solref=(-1e6, -2e3)), -8.9e-5),
        (MujocoSettings(1e-4, solref=(-1e8, -2e4)), -1.1e-6),
        (MujocoSettings(1e-4, "Euler", (-1e6, -2e3)), -3.0e-2),
    ],
)
def test_errors_of_the_spec(start, settings, error):
    pytest.importorskip("mujoco")
    run = run_mujoco(g1(), start, [0.0, 2.0], settings)
    assert run.completed
    assert run.poses[-1, 1, 2] - G1_THETA == pytest.approx(error, rel=0.05)


def test_default_loops_are_springs(start):
    """The engine's default does not converge: the error stays at tenths of a radian (spec: -0.467)."""
    pytest.importorskip("mujoco")
    errors = []
    for step in (1e-3, 2.5e-4):
        soft = MujocoSettings(step, solref=(0.02, 1.0), solimp=(0.9, 0.95, 0.001))
        errors.append(run_mujoco(g1(), start, [0.0, 2.0], soft).poses[-1, 1, 2] - G1_THETA)
    assert errors[0] == pytest.approx(errors[1], rel=1e-3) and -0.6 < errors[0] < -0.4


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        (MujocoSettings(1e-3, solref=(0.02, 1.0), solimp=(0.9, 0.95, 0.001)), -0.467),
        (MujocoSettings(1e-4, solref=(0.002, 1.0)), -3.9e-6),
        (MujocoSettings(1e-4, solref=(-1e6, -2e3)), -6.2e-7),
    ],
)
def test_floors_of_the_spec_in_an_open_reference_pose(start, settings, error):
    """theory/exports 3 has its floors from a model written with all angles 0: the engine scales its springs there."""
    mujoco = pytest.importorskip("mujoco")
    text = re.sub(r' (quat|ref)="[^"]*"', "", to_mjcf(g1(), start, settings).xml)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, round(2.0 / settings.step))
    assert data.qpos[0] - G1_THETA == pytest.approx(error, rel=0.01)


def test_constraints_tied_to_the_step_have_order_two(start):
    pytest.importorskip("mujoco")
    runs = [run_mujoco(g1(), start, [0.0, 1.0, 2.0], MujocoSettings(step)) for step in (4e-4, 1e-4)]
    errors = [abs(run.poses[-1, 1, 2] - G1_THETA) for run in runs]
    assert errors[0] < 2e-5 and np.log(errors[0] / errors[1]) / np.log(4.0) == pytest.approx(2.0, abs=0.1)


def test_too_stiff_for_the_step_is_a_failure(start, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    run = run_mujoco(g1(), start, [0.0, 1.0, 2.0], MujocoSettings(1e-3, solref=(-1e8, -2e4)))
    assert run.status == "failed" and np.isnan(run.poses[-1]).all()
    assert not list(tmp_path.iterdir())  # no log file


@pytest.mark.parametrize(
    "name",
    ["reversed_slider_crank", "yoke", "slot_on_crank", "trammel", "gear_pair", "planet", "welded", "doubled_pin"],
)
def test_every_joint_and_load(name):
    """Two steps: the difference to the internal motion is small and of second order."""
    pytest.importorskip("mujoco")
    model, start = models.yoke(True) if name == "slot_on_crank" else getattr(models, name)()
    times = np.linspace(0.0, 0.4, 5)
    expected = simulate_dynamics(model, times, start=start, form="augmented", outputs="exact")
    errors = []
    for step in (1e-3, 2.5e-4):
        run = run_mujoco(model, start, times, MujocoSettings(step))
        assert run.completed
        errors.append(np.abs(run.poses - expected.poses).max())
    assert errors[0] < 4e-5
    assert np.log(errors[0] / errors[1]) / np.log(4.0) == pytest.approx(2.0, abs=0.1)


def test_gear_pair_closed_form():
    """theory/planar-dynamics 9: alpha = T / (J1 + J2 (z1/z2)^2)."""
    pytest.importorskip("mujoco")
    model, start = models.gear_pair(0.7)
    run = run_mujoco(model, start, [0.0, 0.5], MujocoSettings(1e-3))
    alpha = 0.7 / (0.02 + 0.3 * 0.4**2)
    assert run.poses[-1, 1, 2] == pytest.approx(0.5 * alpha * 0.25, rel=1e-7)
    assert run.velocities[-1, 2, 2] == pytest.approx(-0.4 * alpha * 0.5, rel=1e-7)


def test_text_states_the_model(start):
    first, again = to_mjcf(g2(), start), to_mjcf(g2(), start)
    assert first.xml == again.xml
    root = ET.fromstring(first.xml)
    assert [body.get("name") for body in root.iter("body")] == ["link1", "link2", "link3"]
    assert len(root.findall("equality/connect")) == 1 == len(first.tree.cuts)
    assert float(root.find(".//body[@name='link2']/inertial").get("mass")) == 0.6
    # joint coordinates: angle of b relative to a
    theta = start.poses[:, 2]
    expected = [theta[b] - theta[a] for _, a, b in first.coordinates]
    assert first.qpos == pytest.approx(expected, abs=1e-15)
    rates = start.velocities[:, 2]
    assert first.qvel == pytest.approx([rates[b] - rates[a] for _, a, b in first.coordinates], abs=1e-14)


def test_tree_of_three_loops():
    """Ten joints, seven moving links: three cuts, all turning pairs; every link hangs on one seen before."""
    mechanism = seven_body().mechanism
    tree = spanning_tree(mechanism)
    assert len(tree.edges) == 7 and len(tree.cuts) == 3
    seen = {0}
    for parent, link, joint in tree.edges:
        assert parent in seen and link not in seen and mechanism.joints[joint].pair == tuple(sorted((parent, link)))
        seen.add(link)


def test_sliding_pairs_stay_in_the_tree():
    for model, _ in (models.trammel(), models.yoke(), models.yoke(True), models.reversed_slider_crank()):
        tree = spanning_tree(model.mechanism)
        assert all(model.mechanism.joints[k].kind == "R" for k in tree.cuts)


def test_refusals_are_sentences(start):
    friction = g1(elements=[JointFriction(0, 1, 0.1, radius=0.01)])
    with pytest.raises(GeometryError, match="dry friction"):
        to_mjcf(friction, start)
    with pytest.raises(GeometryError, match="is a function"):
        to_mjcf(g1(elements=[Force(1, lambda t, place, velocity: (0.0, 0.0))]), start)
    with pytest.raises(GeometryError, match="prescribed motion of joint 0-1"):
        to_mjcf(g1(prescribed=[Driver(0, 1)]), start)
    with pytest.raises(GeometryError, match="closes a loop of prismatic joints"):
        to_mjcf(*models.wedges())
    with pytest.raises(GeometryError, match="additional Prismatic"):
        to_mjcf(*models.two_guides())
    with pytest.raises(GeometryError, match="not consistent"):
        to_mjcf(g1(), replace(start, status="violated"))
    with pytest.raises(GeometryError, match="does not divide"):
        run_mujoco(g1(), start, [0.0, 1.0], MujocoSettings(3e-3))
    with pytest.raises(GeometryError, match="solref"):
        MujocoSettings(solref=(-1.0, 1.0))
    with pytest.raises(GeometryError, match="integrator"):
        MujocoSettings(integrator="heun")


def open_tree(random):
    """Links hung on one another at random by turning and sliding pairs, a rotor between any two of them."""
    links = int(random.integers(3, 7))
    edges, joints = [], []
    for k in range(1, links):
        parent = int(random.integers(0, k))
        at_a, at_b = (tuple(random.normal(size=2).round(2)) for _ in range(2))
        edges.append((parent, k))
        turning = Revolute(parent, k, at_a, at_b)
        joints.append(turning if random.random() < 0.75 else Prismatic(parent, k, angle_a=float(random.normal())))
    mechanism = Mechanism(MechanismGraph(links, edges, frame=0), joints, [])
    a, b = (int(k) for k in random.choice(links, 2, replace=False))
    source = TorqueSource(
        a, b, float(random.normal()), float(random.choice([1.0, -3.0])), 1.0, random.uniform(0.01, 1.0), 0.1
    )
    bodies = {
        k: Body(random.uniform(0.5, 2.0), random.uniform(0.05, 0.5), tuple(random.normal(size=2)))
        for k in range(1, links)
    }
    model = DynamicModel(mechanism, bodies, [source])
    moving = (np.arange(links) > 0)[:, None]
    return model, consistent_start(
        model, pose=random.normal(size=(links, 3)) * moving, rates=random.normal(size=(links, 3)) * moving
    )


def test_a_rotor_is_exported_exactly_or_refused():
    """What is written has the accelerations of the model; a rotor between branches is not written at all."""
    mujoco = pytest.importorskip("mujoco")
    random = np.random.default_rng(1)
    counts = {True: 0, False: 0}
    for _ in range(60):
        model, start = open_tree(random)
        if not start.consistent:
            continue
        a, b = model.elements[0].a, model.elements[0].b
        turning = [hinges_to(model.mechanism, link) for link in (a, b)]
        one_branch = turning[0] <= turning[1] or turning[1] <= turning[0]
        try:
            export = to_mjcf(model, start)
        except GeometryError as error:
            assert "couples links on different branches" in str(error) and not one_branch
            counts[False] += 1
            continue
        engine = mujoco.MjModel.from_xml_string(export.xml)
        data = mujoco.MjData(engine)
        mujoco.mj_resetDataKeyframe(engine, data, 0)
        mujoco.mj_forward(engine, data)
        for k, (_, base, link) in enumerate(export.coordinates):
            if model.mechanism.joint(base, link).kind == "R":
                expected = start.accelerations[link, 2] - start.accelerations[base, 2]
                assert data.qacc[k] == pytest.approx(expected, rel=1e-8, abs=1e-8)
        counts[True] += 1
    assert counts[True] > 30 and counts[False] > 5


def hinges_to(mechanism, link):
    """Turning pairs between the frame and a link of an open tree."""
    found, at = set(), link
    while at:
        joint = next(j for j in mechanism.joints if j.b == at)
        found |= {joint.pair} if joint.kind == "R" else set()
        at = joint.a
    return found


def test_what_no_engine_can_represent_is_refused_by_writers_and_certificate():
    graph = MechanismGraph(3, [(0, 1), (0, 2)], frame=0)
    mechanism = Mechanism(graph, [Revolute(0, 1), Revolute(0, 2, (0.5, 0.0))], [])
    bodies = {k: Body.bar(1.0, (0.0, 0.0), (0.3, 0.0)) for k in (1, 2)}
    model = DynamicModel(mechanism, bodies, [TorqueSource(1, 2, 0.0, 10.0, 1.0, 1e-3)])
    begin = consistent_start(model, pose=[[0, 0, 0], [0, 0, 0], [0.5, 0, -np.pi / 2]])
    words = r"the rotor of torque source 1-2, 0.1 kg m\^2 .* couples links on different branches.*leave it out, or make"
    with pytest.raises(GeometryError, match=words):
        to_mjcf(model, begin)
    with pytest.raises(GeometryError, match=words):
        certify_export(model, begin, [0.0, 0.1], [MujocoSettings(step) for step in (1e-2, 5e-3, 2e-3)])
    assert "armature" in to_mjcf(replace(model, elements=[TorqueSource(0, 2, 0.0, 10.0, 1.0, 1e-3)]), begin).xml


def test_links_on_gears_alone_are_refused():
    from graphsynth.mechanism.joints import Gear
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    mechanism = Mechanism(MechanismGraph(2, [(0, 1, 2)], frame=0), [Gear(0, 1)])
    with pytest.raises(GraphError, match=r"links \[1\]"):
        spanning_tree(mechanism)


def test_seven_bodies_follow_the_reference():
    pytest.importorskip("mujoco")
    model = seven_body()
    start = consistent_start(model, pose=seven_pose())
    times = np.linspace(0.0, 0.01, 3)
    expected = simulate_dynamics(model, times, start=start, outputs="exact")
    run = run_mujoco(model, start, times, MujocoSettings(1e-5))
    assert np.abs(run.poses[..., 2] - expected.poses[..., 2]).max() < 1e-5
