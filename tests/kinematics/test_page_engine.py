"""The engine of the page in Node, with kernels in WebAssembly, beside the library."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.stored import stored_mechanisms
from graphsynth.core.errors import GeometryError
from graphsynth.core.native.wasm import MODULES
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism import gallery
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import find_fault
from graphsynth.structure.graph import MechanismGraph
from graphsynth.workbench import __file__ as _workbench

from .random_mechanisms import random_mechanism

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
RUNNER, PAGES = Path(__file__).parents[1] / "workbench_runner.js", Path(_workbench).with_name("pages")


def in_page(folder: Path, jobs: list[tuple[Mechanism, list[list[Any]]]]) -> list[dict[str, Any]]:
    """Let the page's engine do calls with mechanisms; its results, and pose and inputs after each."""
    given, found = folder / "jobs.json", folder / "results.json"
    given.write_text(json.dumps([{"drawn": to_dict(mechanism), "calls": calls} for mechanism, calls in jobs]))
    subprocess.run(["node", str(RUNNER), str(PAGES), str(MODULES), str(given), str(found)], check=True)
    results: list[dict[str, Any]] = json.loads(found.read_text())
    return results


def array(values: list[Any], *shape: int) -> np.ndarray:
    return np.array([math.nan if value is None else value for value in values]).reshape(shape)


def inversion(mechanism: Mechanism, frame: int, link: int) -> Mechanism | None:
    """The same links and joints on another frame, driven there; None if that cannot be decomposed."""
    graph = MechanismGraph(mechanism.graph.links, mechanism.graph.joints, frame=frame)
    if find_fault(graph, [(frame, link)]) is not None:
        return None
    pose = np.array(mechanism.pose)
    z = np.exp(-1j * pose[frame, 2]) * (pose[:, 0] + 1j * pose[:, 1] - complex(*pose[frame, :2]))
    turned = np.column_stack([z.real, z.imag, pose[:, 2] - pose[frame, 2]])
    turned[frame] = 0.0
    return Mechanism(graph, mechanism.joints, [Driver(frame, link)], pose=tuple(map(tuple, turned.tolist())))


def stored(own: Catalogue) -> list[Mechanism]:
    """One mechanism with dimensions of every chain of a catalogue that has them."""
    with own, own.reading():
        chains = own.connection.execute("select distinct chain_id from evaluations").fetchall()
        return [Mechanism.from_json(next(stored_mechanisms(own.connection, chain)).text) for (chain,) in chains]


def turning(mechanisms: list[Mechanism]) -> list[tuple[Mechanism, Any]]:
    """Every frame and driver with which a mechanism makes a full turn, and that motion."""
    found = []
    for mechanism in mechanisms:
        base = simulate(mechanism, [0.0], events=False)
        if not base.completed:
            continue
        posed = Mechanism(mechanism.graph, mechanism.joints, mechanism.drivers, pose=tuple(map(tuple, base.poses[0])))
        for frame in range(mechanism.graph.links):
            for joint in mechanism.graph.joints:
                if frame not in (joint.a, joint.b):
                    continue
                link = joint.a + joint.b - frame
                own = inversion(posed, frame, link)
                if own is None:
                    continue
                first = own.pose[link][2]
                motion = simulate(own, np.linspace(first, first + math.tau, 121))
                if motion.completed:
                    found.append((own, motion))
    return found


def check_turns(folder: Path, turns: list[tuple[Mechanism, Any]]) -> None:
    """Poses, rates and dead centres over whole turns are those of the library."""
    results = in_page(folder, [(mechanism, [["sweep", 121]]) for mechanism, _ in turns])
    for (mechanism, motion), result in zip(turns, results, strict=True):
        links, swept = mechanism.graph.links, result["done"][0]["result"]
        assert result["known"]["fault"] is None and swept["full"], (mechanism.graph, swept["stop"])
        poses, rates = array(swept["poses"], 121, links, 3), array(swept["velocities"], 121, links, 3)
        # the page takes the pose, which closes to rounding, onto the joints: the driver may be a few digits elsewhere
        off = array(swept["inputs"], 121) - motion.inputs
        assert abs(off[0]) < 1e-13 and np.abs(off - off[0]).max() < 1e-14
        assert np.abs(poses[..., :2] - motion.poses[..., :2]).max() < 1e-9 * motion.Lc
        assert np.abs(np.exp(1j * poses[..., 2]) - np.exp(1j * motion.poses[..., 2])).max() < 1e-9
        fastest = np.abs(motion.velocities).max()
        assert np.abs(rates - motion.velocities).max() < 1e-6 * fastest
        own = sorted(event["input"] for event in swept["events"] if event["kind"] == "dead centre")
        known = [event.input for event in motion.events if event.kind == "dead centre"]
        assert len(own) >= 0.9 * len(known) and all(min(abs(np.array(known) - at)) < 1e-6 for at in own)


@pytest.mark.long
def test_turns_of_chains_are_those_of_the_library(tmp_path: Path) -> None:
    mechanisms = stored(Catalogue.shipped())
    turns = turning([one for one in mechanisms if one.graph.links <= 6])
    assert len(turns) >= 10
    check_turns(tmp_path, turns)


@pytest.mark.slow
def test_turns_of_all_chains_are_those_of_the_library(tmp_path: Path) -> None:
    """All 249 chains of one freedom to ten links, every frame and driver that turns."""
    path = tmp_path / "ten.sqlite"
    shutil.copy(Catalogue.shipped().path, path)
    with Catalogue(path) as own:
        own.evaluate([10], [1])
    mechanisms = [one for one in stored(Catalogue(path)) if one.graph.mobility == 1]
    assert len(mechanisms) == 1 + 2 + 16 + 230
    turns = turning(mechanisms)
    chains = {MechanismGraph(own.graph.links, own.graph.joints).key for own, _ in turns}
    assert len(chains) == 249
    for start in range(0, len(turns), 100):
        check_turns(tmp_path, turns[start : start + 100])


def test_points_move_as_those_of_the_library(tmp_path: Path) -> None:
    linkage = Mechanism.four_bar(4.0, 1.2, 3.5, 3.0)
    (pose,) = simulate(linkage, [0.7], events=False).poses
    mechanism = Mechanism(linkage.graph, linkage.joints, linkage.drivers, pose=tuple(map(tuple, pose.tolist())))
    inputs, at = [0.7, 1.9, 4.0], (1.8, -1.4)
    calls = [[name, *args] for q in inputs for name, *args in (("advance", q), ("pointMotion", 2, at))]
    (result,) = in_page(tmp_path, [(mechanism, calls)])
    path = simulate(mechanism, inputs, events=False).point(2, at)
    found = array([done["result"][0] for done in result["done"][1::2]], 3, 6)
    for own, known in zip(np.split(found, 3, axis=1), (path.position, path.velocity, path.acceleration), strict=True):
        assert np.abs(own - known).max() < 1e-9 * np.abs(known).max()


def test_ranges_between_limits_are_those_of_the_library(tmp_path: Path) -> None:
    rocker = Mechanism.four_bar(4.0, 3.0, 2.0, 2.5)  # nothing turns fully
    posed = simulate(rocker, [0.7], events=False)
    mechanism = Mechanism(rocker.graph, rocker.joints, rocker.drivers, pose=tuple(map(tuple, posed.poses[0])))
    (result,) = in_page(tmp_path, [(mechanism, [["sweep", 181], ["advance", 3.0], ["advance", 0.7]])])
    swept, away, home = (done["result"] for done in result["done"])
    reach = math.acos((4.0**2 + 3.0**2 - 4.5**2) / 24.0)  # coupler and rocker stretched
    limits = [event["input"] for event in swept["events"] if event["kind"] == "limit"]
    assert np.allclose(sorted(limits), [-reach, reach], atol=1e-12, rtol=0.0)
    assert not away["reached"] and abs(away["input"] - reach) < 1e-12 and away["stop"]["kind"] == "limit"
    assert home["reached"]
    assert np.abs(np.reshape(result["done"][2]["pose"], (4, 3))[:, :2] - posed.poses[0][:, :2]).max() < 1e-9


@pytest.mark.long
def test_the_range_of_a_larger_group_is_seen_whole(tmp_path: Path) -> None:
    """Between two limits at which a group of four links is singular, so that nothing can be followed from there."""
    linkage = gallery.stephenson_six_bar()
    (pose,) = simulate(linkage, [0.3], events=False).poses
    posed = Mechanism(linkage.graph, linkage.joints, linkage.drivers, pose=tuple(map(tuple, pose.tolist())))
    partly = []
    for joint in posed.graph.joints:
        for frame, link in ((joint.a, joint.b), (joint.b, joint.a)):
            own = inversion(posed, frame, link)
            known = simulate(own) if own is not None and len(compile_program(own).steps[-1].links) == 4 else None
            if own is not None and known is not None and not known.closure.closed and known.completed:
                partly.append((own, known))
    assert len(partly) >= 3
    for (own, known), result in zip(
        partly, in_page(tmp_path, [(own, [["sweep", 121]]) for own, _ in partly]), strict=True
    ):
        swept = result["done"][0]["result"]
        inputs, poses = array(swept["inputs"], 121), array(swept["poses"], 121, own.graph.links, 3)
        assert np.isfinite(poses[1:-1]).all() and (np.diff(inputs) > 0.0).all()
        assert np.allclose(inputs[[0, -1]], known.inputs[[0, -1]], atol=2e-3 * np.ptp(inputs))
        start, compared = own.pose[own.drivers[0].link][2], 0
        for there in (inputs[inputs > start][:-1], inputs[inputs < start][:0:-1]):
            theirs = simulate(own, np.append(start, there), events=False).poses[1:]
            off = np.abs((theirs - poses[np.searchsorted(inputs, there)])[..., :2])
            assert np.all(off < 1e-9 * known.Lc)
            compared += len(there)
        assert compared >= 118


def test_a_limit_upon_a_sample_is_no_change_point(tmp_path: Path) -> None:
    """A trammel of 3, 4 and 5: where it lies flat both modes meet, and none goes on."""
    pins = [{"kind": "R", "a": 1, "b": k, "at_a": at, "at_b": at} for k, at in ((2, [0, 3]), (3, [4, 0]))]
    slides = [
        {"kind": "P", "a": 0, "b": k, "at_a": at, "at_b": at, "angle_a": turn, "angle_b": turn}
        for k, at, turn in ((2, [0, 3], math.pi / 2), (3, [4, 0], 0.0))
    ]
    driver = {"base": 0, "link": 3, "law": {"kind": "linear", "rate": 1, "offset": 0}}
    head = {"format": "graphsynth mechanism", "version": 1, "graph": "C] f0", "pose": [[0, 0, 0]] * 4, "points": {}}
    trammel = Mechanism.from_json(json.dumps({**head, "joints": pins + slides, "drivers": [driver]}))
    (result,) = in_page(tmp_path, [(trammel, [["sweep", 181], ["advance", 2.0], ["advance", -10.0]])])
    swept, up, down = (done["result"] for done in result["done"])
    ends = [event for event in swept["events"] if event["kind"] != "dead centre"]
    assert [(event["kind"], round(event["input"], 9)) for event in ends] == [("limit", -9.0), ("limit", 1.0)]
    assert up["stop"]["kind"] == down["stop"]["kind"] == "limit"
    assert simulate(trammel, [0.0, 0.5, 1.1]).events[-1].kind == "fold"


def test_a_change_point_upon_a_sample_ends_the_range_as_in_the_library(tmp_path: Path) -> None:
    """Scott Russell's crank and rod are equal: at +-90 degrees both modes meet and go on."""
    flat = Mechanism.four_bar(2.0, 1.0, 2.0, 1.0)
    posed = simulate(flat, [1.0], events=False).poses[0]
    parallelogram = Mechanism(flat.graph, flat.joints, flat.drivers, pose=tuple(map(tuple, posed.tolist())))
    (result,) = in_page(tmp_path, [(parallelogram, [["sweep", 181]])])
    swept = result["done"][0]["result"]
    assert not swept["full"] and {event["kind"] for event in swept["events"]} == {"change point"}
    assert np.allclose([swept["inputs"][0], swept["inputs"][-1]], [0.0, math.pi], atol=1e-7, rtol=0.0)
    assert np.allclose(simulate(parallelogram).inputs[[0, -1]], [0.0, math.pi], atol=2e-3 * math.pi)
    for degrees in (40.0, 40.3, -75.0):
        given = Mechanism.slider_crank(1.0, 1.0, 0.0)
        pose = simulate(given, [math.radians(degrees)], events=False).poses[0]
        mechanism = Mechanism(given.graph, given.joints, given.drivers, pose=tuple(map(tuple, pose.tolist())))
        (result,) = in_page(tmp_path, [(mechanism, [["sweep", 181], ["advance", 1.7], ["advance", -1.7]])])
        swept, up, down = (done["result"] for done in result["done"])
        assert not swept["full"]
        ends = [event["input"] for event in swept["events"] if event["kind"] == "change point"]
        assert np.allclose(ends, [-math.pi / 2, math.pi / 2], atol=1e-7, rtol=0.0)
        library = simulate(mechanism)
        assert np.allclose(library.inputs[[0, -1]], ends, atol=2e-3 * math.pi)
        for stop, sense in ((up, 1.0), (down, -1.0)):
            assert not stop["reached"] and stop["stop"]["kind"] == "change point"
            assert abs(stop["input"] - sense * math.pi / 2) < 1e-7


def test_faults_and_groups_are_those_of_the_library(tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    mechanisms = [random_mechanism(random, 0.3) for _ in range(40)]
    jobs = []
    for mechanism in mechanisms:
        jobs.append((mechanism, [["drivers"]]))
        none = Mechanism(mechanism.graph, mechanism.joints, [], pose=mechanism.pose)
        jobs.append((none, []))
    results = in_page(tmp_path, jobs)
    for mechanism, result, none in zip(mechanisms, results[::2], results[1::2], strict=True):
        try:
            steps = [step for step in compile_program(mechanism).steps if step.group >= 0]
        except GeometryError:
            assert result["known"]["fault"] is not None
        else:
            assert [(g["kind"], g["links"]) for g in result["known"]["groups"]] == [
                (s.kind, list(s.links)) for s in steps
            ]
        assert none["known"]["fault"]["kind"] == "drivers" and none["known"]["mobility"] == mechanism.graph.mobility
        fault = find_fault(mechanism.graph, [])
        assert fault is not None and tuple(none["known"]["fault"]["loose"]) == fault.links
