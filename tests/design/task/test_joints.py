"""Functions between any two joints, and functions that end where they began; judged by poses alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.design import DesignTask, FunctionTarget, SwingTarget, design
from graphsynth.design.task.answers import output
from graphsynth.design.task.plans import plans
from graphsynth.kinematics import simulate
from graphsynth.kinematics.dimensional import embody
from graphsynth.mechanism.joints import Prismatic
from graphsynth.structure.graph import MechanismGraph


def test_outputs_against_a_moving_link_are_at_their_joint() -> None:
    """Of four links: coupler and rocker have one joint, coupler and crank another, each seen from both sides."""
    task = DesignTask(targets=[SwingTarget(least=1.0, base="rod")], links=[4])
    for driven in (1, 3):
        own = [plan.carriers for plan in plans(task, 4) if plan.design.drivers == ((0, driven),)]
        assert sorted(own) == [(1, 2), (2, 1), (2, 3), (3, 2)]
    sliding = DesignTask(targets=[SwingTarget(least=1.0, base="rod", slides=True)], links=[4], sliders=1)
    for plan in plans(sliding, 4):
        joint = plan.design.kinds.index("P")
        assert {*plan.design.graph.joints[joint][:2]} == {*plan.carriers}


@pytest.mark.long
@pytest.mark.parametrize("slides", [False, True])
def test_a_function_between_two_moving_links(slides: bool) -> None:
    inputs = np.linspace(0.0, 1.5, 5)
    wanted = 0.3 * np.sin(inputs)
    target = FunctionTarget(inputs=inputs.tolist(), outputs=wanted.tolist(), base="rod", slides=slides, tolerance=1e-3)
    found = design(DesignTask(targets=[target], links=[4], sliders=int(slides)), count=1)
    assert found.accepted
    mechanism, motion = found[0].mechanism, simulate(found[0].mechanism, inputs)
    link, rod = (found[0].carriers[name] for name in ("output", "rod"))
    joint = mechanism.joint(link, rod)
    if slides:
        assert isinstance(joint, Prismatic)
        # how far the two points of the joint are apart, along the guide
        a, b = (motion.point(n, at).position @ [1.0, 1.0j] for n, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))
        seen = ((b - a) * np.exp(-1j * (motion.poses[:, joint.a, 2] + joint.angle_a))).real
    else:
        seen = np.unwrap(motion.poses[:, link, 2] - motion.poses[:, rod, 2])
    errors = [np.ptp(seen - sign * wanted) / 2.0 for sign in (1.0, -1.0)]
    assert min(errors if slides else errors[:1]) == pytest.approx(found[0].errors[0], abs=1e-9) and min(errors) < 1e-3


@pytest.mark.long
def test_speeds_of_outputs_are_those_of_their_values() -> None:
    """By differences: of an angle, and of a block that slides on a turning link."""
    crank_slide = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    mechanism = embody(crank_slide, driver=1, joints={(2, 3): "P"}).mechanism
    assert mechanism is not None
    inputs = np.linspace(0.0, math.tau, 20_001)
    motion = simulate(mechanism, inputs, events=False)
    for pair in ((3, 2), (2, 3), (2, 1), (3, 0)):
        values, rates = output(motion, *pair)
        assert rates[1:-1] == pytest.approx((values[2:] - values[:-2]) / (inputs[2] - inputs[0]), rel=1e-5, abs=1e-5)


@pytest.mark.long
def test_a_function_of_a_whole_turn() -> None:
    """It ends where it began; its range is that between the least and the largest value."""
    target = FunctionTarget.of(np.sin, (0.0, math.tau), input_range="360 deg", output_range="40 deg", tolerance="3 deg")
    assert np.ptp(target.outputs) == pytest.approx(math.radians(40.0), rel=1e-12)
    assert target.outputs[-1] == pytest.approx(target.outputs[0], abs=1e-12)
    found = design(DesignTask(targets=[target], links=[4]), count=1)
    assert found.accepted
    assert target.inputs is not None
    motion, link = found[0].motion, found[0].carriers["output"]
    seen = np.degrees(np.interp(np.array(target.inputs), motion.inputs, np.unwrap(motion.poses[:, link, 2])))
    assert np.ptp(seen - 20.0 * np.sin(np.array(target.inputs))) / 2.0 < 3.0


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: SwingTarget(least=1.0, link="a", base="a"), "name two links"),
        (lambda: SwingTarget(least=1.0, base="rod", pivot=(0, 0)), "leave pivot out"),
        (
            lambda: FunctionTarget.of(lambda x: 0.0 * x, (0, 1), input_range=1.0, output_range=1.0),
            "must be finite and not constant",
        ),
    ],
)
def test_what_cannot_be_is_refused(make: Any, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        make()
