"""Tilted axes on the page: the kernel `share`, and `binding.js` in Node round it, beside `assess_coupled`."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.native.wasm import MODULES
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits, assess_coupled
from graphsynth.jamming.joints.limits import Limits
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism import gallery
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.model import Mechanism
from graphsynth.workbench import __file__ as _workbench

PAGES = Path(_workbench).with_name("pages")
RUNNER = """
const fs = require("fs"), [, , pages, modules, jobs, results] = process.argv;
globalThis.Engine = require(`${pages}/engine.js`);
const Kernels = require(`${pages}/kernels.js`), Binding = require(`${pages}/binding.js`);
const plain = (key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value === Infinity ? "inf" : value;
async function main() {
  const table = JSON.parse(fs.readFileSync(`${modules}/binding.json`));
  const module = await Kernels.open("binding", fs.readFileSync(`${modules}/binding.wasm`), table);
  const found = JSON.parse(fs.readFileSync(jobs)).map(({ drawn, limits, tilt, poses }) => {
    const binding = Binding.open(module, drawn, limits, tilt);
    if (binding.fault) return { fault: binding.fault };
    const flat = Float64Array.from(poses.flat(2), (x) => x ?? NaN), begin = process.hrtime.bigint();
    const over = binding.over(flat, poses.length), seconds = Number(process.hrtime.bigint() - begin) / 1e9;
    const at = poses.map((pose) => binding.at(Float64Array.from(pose.flat())));
    const python = binding.python();
    binding.close();
    return { over, at, python, seconds };
  });
  fs.writeFileSync(results, JSON.stringify(found, plain));
}
main().catch((error) => { console.error(error); process.exit(1); });
"""


def in_page(folder: Path, jobs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What the page says of mechanisms with limits and a tilt, at poses."""
    for name, text in (("runner.js", RUNNER), ("jobs.json", json.dumps(jobs))):
        (folder / name).write_text(text)
    command = ["node", "runner.js", str(PAGES), str(MODULES), "jobs.json", "results.json"]
    subprocess.run(command, check=True, cwd=folder)
    found: list[dict[str, Any]] = json.loads((folder / "results.json").read_text())
    return found


Case = tuple[Motion, dict[tuple[int, int], Limits], Misalignment]


def cases(seed: int, each: int) -> list[Case]:
    """Motions with limits and a misaligned joint: four-bars, slider-cranks, mechanisms of six and eight links."""
    random, found = np.random.default_rng(seed), []
    makers = (gallery.chebyshev_lambda, gallery.klann, gallery.jansen, gallery.toggle_press)
    mechanisms = [*(make() for make in (*makers, gallery.whitworth_quick_return)), Mechanism.slider_crank(1.0, 3.0)]
    for mechanism in mechanisms:
        motion = simulate(mechanism, np.linspace(0.1, 6.0, 5), events=False)
        for _ in range(each if motion.completed else 0):
            limits: dict[tuple[int, int], Limits] = {}
            for joint in mechanism.joints:
                angles, end = 10.0 ** random.uniform(-3, -1.5, 2), float(random.choice([0.0, 0.02]))
                one, two = angles.tolist()
                limits[joint.pair] = JointLimits(one, end) if joint.kind == "R" else SlideLimits(one, two, end)
            own = mechanism.joints[int(random.integers(len(mechanism.joints)))]
            base, link = (own.a, own.b) if random.random() < 0.5 else (own.b, own.a)
            tilt = Misalignment(base, link, 0.01, random.uniform(0.0, 6.0), rigid=bool(random.random() < 0.5))
            found.append((motion, limits, tilt))
    return found


def job(case: Case) -> dict[str, Any]:
    motion, limits, tilt = case
    joints = motion.mechanism.joints
    given = [
        {"tilt": own.tilt, "end": own.axial_clearance}
        if isinstance(own, JointLimits)
        else {"roll": own.roll, "pitch": own.pitch, "end": own.axial_clearance}
        for own in (limits[joint.pair] for joint in joints)
        if isinstance(own, JointLimits | SlideLimits)
    ]
    number = [joint.pair for joint in joints].index(tilt.pair)
    lean = {"joint": number, "alpha": tilt.alpha, "direction": tilt.direction, "base": tilt.base, "rigid": tilt.rigid}
    return {"drawn": to_dict(motion.mechanism), "limits": given, "tilt": lean, "poses": motion.poses.tolist()}


@pytest.mark.long
@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
@pytest.mark.parametrize("each", [3, pytest.param(60, marks=pytest.mark.slow)])
def test_the_page_says_what_the_library_says(tmp_path: Path, each: int) -> None:
    given = cases(5, each)
    assert len({motion.mechanism.graph.links for motion, _, _ in given}) > 1
    for (motion, limits, tilt), found in zip(given, in_page(tmp_path, [job(case) for case in given]), strict=True):
        report = assess_coupled(motion, limits, tilt)
        wanted, over = 1.0 / report.allowed_scale, found["over"]
        factors = np.array([math.inf if value == "inf" else value for value in over["factors"]])
        np.testing.assert_allclose(factors, wanted, rtol=1e-10, atol=1e-14)
        # bounds are close to each other; those of one pose are those of the sweep
        for value, at in zip(factors, found["at"], strict=True):
            assert at["binds"] == (value > 1.0)
            if math.isfinite(value):
                assert at["factor"] == value and value <= at["upper"] * (1.0 + 1e-14) + 1e-300
                assert at["upper"] - value <= 1e-9 * value + 1e-14
        # prices of the pose that binds first, where an optimum is the only one they agree
        worst = int(np.argmax(factors))
        assert over["worst"] == worst or factors[over["worst"]] == factors[worst]
        if math.isfinite(factors[worst]) and factors[worst] > 0.0:
            prices = np.array(over["prices"]).reshape(len(factors), -1)[worst]
            assert abs(prices.sum() - 1.0) < 1e-12
            joint = over["first"][worst]
            own = {one.joint: 0.0 for one in report.sensitivities}
            for one in report.sensitivities:
                own[one.joint] += one.gain
            first = motion.mechanism.joints[joint].pair
            assert own.get(first, 0.0) > 0.0
            assert found["at"][worst]["joints"]
            used = max(one["used"] for one in found["at"][worst]["joints"] if one["price"] > 1e-6)
            assert used == pytest.approx(1.0, abs=1e-6)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_the_page_takes_bearings_and_says_what_does_not_fit(tmp_path: Path) -> None:
    motion = simulate(Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), np.linspace(0.1, 6.0, 4), events=False)
    joints = motion.mechanism.joints
    bearing = {"radius": 17.5, "height": 10.0, "clearance": 0.03}
    given = {"drawn": to_dict(motion.mechanism), "poses": motion.poses.tolist(), "limits": [bearing] * len(joints)}
    tilt = {"joint": 0, "alpha": 0.012}
    base, link = joints[0].a, joints[0].b
    jobs = [{**given, "tilt": tilt}, {**given, "tilt": {"joint": 9, "alpha": 0.01}}, {**given, "tilt": {"joint": 0}}]
    jobs.append({**given, "limits": [{"tilt": -1.0}] * len(joints), "tilt": tilt})
    lost = motion.poses.astype(object)
    lost[1] = None
    jobs.append({**given, "poses": lost.tolist(), "tilt": tilt})
    good, *bad, part = in_page(tmp_path, jobs)
    assert part["over"]["factors"][1] is None and part["over"]["factors"][2:] == good["over"]["factors"][2:]
    assert part["over"]["worst"] != 1 and part["over"]["first"][1] == -1
    known = assess_coupled(motion, Bearing(), Misalignment(base, link, 0.012))
    np.testing.assert_allclose(good["over"]["factors"], 1.0 / known.allowed_scale, rtol=1e-10)
    assert [found["fault"] for found in bad] == ["tilt", "tilt", "limits"]
    # the program that it writes is the same question
    said: list[Any] = []
    exec(good["python"].replace("print(", "said.append("), {"said": said})
    tilts = [[own.tilt for own in report.limits if isinstance(own, JointLimits)] for report in (said[0], known)]
    assert tilts[0] == tilts[1] and len(tilts[0]) == len(joints)
    assert said[0].misalignments == known.misalignments and said[0].certificate is not None


@pytest.mark.long
def test_critical_tilts_of_bearings_are_those_of_the_library() -> None:
    from graphsynth.jamming.joints.kernels.sharing import critical_tilt

    random = np.random.default_rng(2)
    for _ in range(200):
        radius, height = (10.0 ** random.uniform(-1, 2, 2)).tolist()
        own = Bearing(radius, height, float(10.0 ** random.uniform(-4, 1)))
        for condition in ("A", "B"):
            known = own.critical_tilt(condition).angle
            found = critical_tilt(own.Rb, own.h, own.clearance, condition == "B")
            assert math.isnan(found) if known is None else found == pytest.approx(known, rel=1e-14)
