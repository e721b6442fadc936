"""The certificate of a motion on the page: beside the library's proofs, and bit for bit that of the native kernels."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from graphsynth import Mechanism, certify
from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits, certify_coupled
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.joints.walked import Walk
from graphsynth.kinematics.certify.four_bar import certify_four_bar
from graphsynth.mechanism import gallery
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.laws import Linear
from graphsynth.workbench.posing import assembled
from tests.workbench.test_workbench_scripts import geared

FOUND = """const motion = await Kernels.load("motion"), proof = await Kernels.load("proof"), found = [];
for (const data of args[0]) {
  const engine = Engine.open(motion, data), swept = engine.sweep(), { inputs } = swept;
  const turns = swept.full && swept.turns < Infinity ? swept.turns : 0;
  const asked = { pose: Array.from(engine.pose), driver: 0, from: inputs[0], to: inputs[inputs.length - 1], turns };
  found.push({ ...await Proving.found(motion, proof, data, asked), asked, start: engine.inputs[0], Lc: engine.Lc });
  engine.close();
}
return found;"""
TURNING = ["klann", "stephenson_six_bar", "toggle_press", "whitworth_quick_return"]


def proved(scripts, *mechanisms):
    return scripts(FOUND, [to_dict(assembled(own)) for own in mechanisms], modules=("motion", "proof"))


@pytest.mark.long
def test_full_turns_are_proved_where_the_library_proves_them(scripts):
    own = [getattr(gallery, name)() for name in TURNING] + [Mechanism.slider_crank(1.0, 3.0, 0.2)]
    for mechanism, found in zip(own, proved(scripts, *own)):
        theirs = certify(mechanism.simulate(np.linspace(0.0, 2.0 * np.pi, 73)))
        assert theirs.certified and theirs.closed
        assert found["full"] and found["boxes"] > 10


@pytest.mark.long
def test_a_rocker_is_proved_up_to_its_exact_limits_and_not_beyond(scripts):
    lengths = [(2.0, 1.5, 1.0, 1.0), (4.0, 3.0, 2.0, 2.5)]
    for given, found in zip(lengths, proved(scripts, *(Mechanism.four_bar(*own) for own in lengths))):
        (limit,) = certify_four_bar(*given).limits  # of both signs
        assert not found["full"]
        assert limit.low - 1e-5 < -found["low"] < limit.low and limit.low - 1e-5 < found["high"] < limit.low


@pytest.mark.long
def test_nothing_is_proved_through_a_position_where_branches_meet(scripts):
    """A parallelogram is flat before and after half a turn; a gear is none of the known joints."""
    flat, wheels = proved(scripts, Mechanism.four_bar(2.0, 1.0, 2.0, 1.0, crank_angle=1.0), geared())
    assert not flat["full"] and 0.0 < flat["low"] < 1e-5
    assert math.pi - 1e-5 < flat["high"] < math.pi
    assert wheels == {"known": False} | {key: wheels[key] for key in ("asked", "start", "Lc")}


@pytest.mark.slow  # numba compiles the kernels
@pytest.mark.parametrize("name", ["klann", "peaucellier"])
def test_the_page_has_the_bits_of_the_library_and_boxes_hold_the_motion(scripts, name):
    from graphsynth.kinematics.certify.kernels import marching, proving
    from graphsynth.kinematics.engine.program import equations

    mechanism = Mechanism.from_json(json.dumps(to_dict(assembled(getattr(gallery, name)()))))
    (found,) = proved(scripts, mechanism)
    asked, start, Lc = found["asked"], float(found["start"]), float(found["Lc"])
    (driver,) = mechanism.drivers
    assert driver.law == Linear()  # inputs are coordinates
    rows, (table,) = equations(mechanism.joints, mechanism.dimensions[None], mechanism.drivers)
    poses = np.array(asked["pose"], dtype=np.float64).reshape(-1, 3)
    box, turns, inputs = np.zeros((4, *poses.shape)), np.zeros(len(rows)), np.array([start])
    box[0], state, seen = poses, np.array([start, 0.05, 0.0, 0.0]), {start: box}

    def march(goal):
        """Node after node, as far as it goes."""
        given = rows, table, mechanism.frame, inputs, 0, goal, Lc, turns, box, state
        while (code := marching.march(*given, int(state[marching.TESTED] + 1))) == marching.LIMIT:
            if state[marching.AT] not in seen:
                seen[state[marching.AT]] = box.copy()
        return code

    assert marching.march(rows, table, mechanism.frame, inputs, 0, 9.0, Lc, turns, box, state, 0) == marching.LIMIT
    first, goal = box.copy(), start + 2.0 * math.pi * asked["turns"] if asked["turns"] else float(asked["to"])
    code = march(goal)
    assert found["high"] == state[marching.AT]
    if asked["turns"]:
        assert code == marching.DONE and found["boxes"] == state[marching.NODES]
        given = [rows, table, mechanism.frame, 0, first, start, box, goal, asked["turns"]]
        assert found["full"] == marching.closes(*given) is True
        given[4] = first * [[[1.0]], [[1.0]], [[1e-9]], [[1.0]]]  # nothing comes back so exactly
        assert not marching.closes(*given)
    else:
        boxes = state[marching.NODES]
        box[:], state[:] = first, [start, -0.05, 1.0, 0.0]
        march(float(asked["from"]))
        assert found["low"] == state[marching.AT] and found["boxes"] == boxes + state[marching.NODES] - 1
    # the engine goes through the nodes
    for way in (1.0, -1.0):
        own = sorted((node for node in seen.items() if way * (node[0] - start) > 0.0), key=lambda node: way * node[0])
        motion = mechanism.simulate([start, *(at for at, _ in own)], start=poses, events=False)
        assert motion.assembled.all()
        for pose, (_, node) in zip(motion.poses[1:], own, strict=True):
            off = pose - node[proving.CENTRE]
            off[:, 2] = np.remainder(off[:, 2] + math.pi, math.tau) - math.pi
            assert (np.abs(off) < node[proving.TIGHT] + 1e-9).all()
    assert len(seen) > 100


BINDS = """const motion = await Kernels.load("motion"), proof = await Kernels.load("proof"), found = [];
const binding = await Kernels.load("binding");
for (const [data, limits, tilt, limited] of args[0]) {
  const engine = Engine.open(motion, data), { inputs } = engine.sweep();
  const turns = limited ? 0 : 1, [from, to] = limited || [inputs[0], inputs[inputs.length - 1]];
  const told = [], asked = { pose: Array.from(engine.pose), driver: 0, from, to, turns, limits, tilt };
  const tell = share => { told.push(share); return true; };
  const { pieces, ...rest } = await Proving.binds(motion, proof, binding, data, asked, tell);
  const text = pieces && pieces.map(own => own.map(String));
  found.push({ ...rest, pieces: text, told, start: engine.inputs[0], pose: asked.pose });
  engine.close();
}
return found;"""


def leaning(mechanism, tilt, end, alpha, joint=0, limited=None):
    """A question of the page: all joints alike, the axis of one leans by alpha; and the same for the library."""
    limits = [
        {"tilt": tilt, "end": end} if own.kind == "R" else {"roll": tilt, "pitch": tilt, "end": end}
        for own in mechanism.joints
    ]
    a, b = mechanism.joints[joint].pair
    ours = [to_dict(mechanism), limits, {"joint": joint, "alpha": alpha, "direction": 0.3, "base": a}, limited]
    theirs = {
        own.pair: JointLimits(tilt, end) if own.kind == "R" else SlideLimits(tilt, tilt, end)
        for own in mechanism.joints
    }
    return ours, (mechanism, theirs, Misalignment(a, b, alpha, 0.3), limited)


def cases_of_binding():
    own = [Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), Mechanism.slider_crank(1.0, 3.0, 0.2), gallery.toggle_press()]
    bar, crank, press = (Mechanism.from_json(json.dumps(to_dict(assembled(mechanism)))) for mechanism in own)
    asked = [(bar, 0.02), (bar, 0.027), (crank, 0.026), (crank, 0.2), (press, 0.027)]
    found = [leaning(mechanism, 0.01, 0.001, alpha) for mechanism, alpha in asked]
    return [*found, leaning(bar, 0.01, 0.001, 0.026, limited=[-1.0, 1.5])]


def proved_to_bind(scripts, asked):
    return scripts(BINDS, [ours for ours, _ in asked], modules=("motion", "proof", "binding"))


@pytest.mark.long
def test_the_page_proves_where_it_binds_as_the_library_does(scripts):
    """The same verdicts, and as much decided; another seat, a gear and a misaligned rail are told to be unknown."""
    asked, verdicts = cases_of_binding(), set()
    for (_, (mechanism, limits, tilt, limited)), found in zip(asked, proved_to_bind(scripts, asked), strict=True):
        start = float(found["start"])
        ends = limited or [start, start + math.tau]
        theirs = certify_coupled(mechanism.simulate(np.linspace(*ends, 145)), limits, tilt)
        wanted = {"CERTIFIED_FREE": "free", "CERTIFIED_JAMMED": "binds"}.get(theirs.verdict.name, "undecided")
        assert found["known"] and found["verdict"] == wanted
        verdicts.add(wanted)
        assert found["free"] == pytest.approx(theirs.share(1), abs=0.02)
        assert found["binds"] == pytest.approx(theirs.share(-1), abs=0.02)
        assert found["told"] == sorted(found["told"]) and 0.0 < found["told"][-1] <= 1.0 + 1e-12
    assert verdicts == {"free", "binds"}
    rail = Mechanism.slider_crank(1.0, 3.0, 0.2)
    slider = leaning(assembled(rail), 0.01, 0.0, 0.01, joint=[own.kind for own in rail.joints].index("P"))
    wheels = leaning(assembled(geared()), 0.01, 0.0, 0.01)
    wheels[0][1][[own.kind for own in geared().joints].index("gear")] = None
    unknown = proved_to_bind(scripts, [slider, wheels])
    assert [own["known"] for own in unknown] == [False, False]


@pytest.mark.slow  # numba compiles the kernel
def test_pieces_of_the_page_have_the_bits_of_the_library(scripts):
    asked = cases_of_binding()[:-1]
    for (_, (mechanism, limits, tilt, _)), found in zip(asked, proved_to_bind(scripts, asked), strict=True):
        start, pose = float(found["start"]), np.array(found["pose"], dtype=np.float64).reshape(-1, 3)
        motion = mechanism.simulate([start, start + math.tau], start=pose, events=False)
        walk = Walk(problem(mechanism, limits, tilt), motion, 1e-4 * math.tau, 20_000)
        walk.box[0], walk.widths[1], walk.state[1] = pose, math.tau / 128.0, math.tau / 512.0
        assert walk.go(20_000)
        np.testing.assert_array_equal(np.array(found["pieces"], dtype=np.float64), walk.pieces)
