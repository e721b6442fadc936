"""The shipped scenes end to end, against published values; and what each of them loads."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import SceneError, TooLargeError
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.steps import threefold_symmetry
from graphsynth.structure.graph import MechanismGraph

# What a scene may load besides the standard library and graphsynth.
ENUMERATOR = {"numpy", "numba", "llvmlite"}
ALLOWED = {
    ("lambda", "solutions"): set(),
    ("lambda", "records"): ENUMERATOR | {"flint"},  # of the proof with every loop closed in space
    ("lambda", "mechanism_pictures"): ENUMERATOR,
    ("didenko", "solutions"): set(),
    ("didenko", "graph_pictures"): ENUMERATOR,
}

FIGURE_3 = MechanismGraph(
    15,
    [
        *((0, k) for k in (1, 2, 3, 4, 8, 9, 10)),
        *((2, 5), (3, 6), (4, 7), (5, 8), (6, 9), (7, 10), (8, 11), (9, 12), (10, 13), (11, 14), (12, 14), (13, 14)),
        *((1, 2, 2), (1, 3, 2), (1, 4, 2)),
    ],
    frame=0,
)

PROBE = """
import sys
before = set(sys.modules)  # what the interpreter itself loads, .pth files included
from dataclasses import replace
from graphsynth.pipeline.runner import run
from graphsynth.pipeline.scene import OutputsTable, load_scene
name, products, out = sys.argv[1:]
scene = load_scene(name)
if products:
    scene = replace(scene, outputs=OutputsTable(tuple(products.split(","))))
run(scene, out=out)
print(",".join(sorted({m.partition(".")[0] for m in set(sys.modules) - before} - set(sys.stdlib_module_names))))
"""


def loaded(name: str, products: str, out: Path) -> set[str]:
    """Top-level modules outside the standard library after a run in a fresh process."""
    command = [sys.executable, "-c", PROBE, name, products, str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    outside = set(done.stdout.strip().split(","))
    return {m for m in outside if not m.startswith(("_", "graphsynth")) and m != "google"}


@pytest.mark.parametrize(
    ("name", "product"),
    [pytest.param(*case, marks=pytest.mark.slow if "pictures" in case[1] else ()) for case in sorted(ALLOWED)],
)
def test_a_scene_loads_no_more_than_its_outputs_need(name: str, product: str, tmp_path: Path) -> None:
    extra = loaded(name, product, tmp_path) - ALLOWED[name, product] - OF_NUMBA - {"lazy_loader"} - OF_THE_PAGE
    assert extra == set()


# loaded when the report is written, behind the last stage
OF_THE_PAGE = {"jinja2", "markupsafe"}

# numba and what it imports load these when they are installed, for their own features.
OF_NUMBA = {
    "yaml",
    "cython_runtime",
    "cython",
    "Cython",
    "charset_normalizer",
    "scipy",
    "colorama",
    "cffi",
    "pkg_resources",
    "setuptools",
    "cloudpickle",
}


@pytest.fixture(scope="module")
def didenko() -> Any:
    scene = kept("didenko", "solutions", "candidates", "recognised", "motions", "records", "tables")
    return execute(replace(scene, mechanism=replace(scene.mechanism, others=None), ranking=None))


def kept(name: str, *products: str) -> Scene:
    from graphsynth.pipeline.scene import OutputsTable

    return replace(load_scene(name), outputs=OutputsTable(products))


def test_lambda_run_reproduces_the_published_values(tmp_path: Path) -> None:
    report = run("lambda", out=tmp_path)
    (record,) = report["records"]
    assert (record.status, record.recognised_as, record.good) == ("assessed", "lambda_linkage", False)
    margins = {m.name: m.value for m in record.margins}
    assert math.isclose(margins["largest tilt"], 0.0133312592085829611560698, rel_tol=1e-15)
    assert math.isclose(margins["critical tilt"], 0.006064396559156420060266, rel_tol=1e-14)
    assert math.isclose(margins["clearance left at the worst crank angle"], -0.03509927307354575852847, rel_tol=1e-12)
    assert math.isclose(margins["smallest clearance"], 0.06509927307354575852847, rel_tol=1e-13)
    assert math.isclose(margins["largest axis tilt"], 0.0151614793250201376610981, rel_tol=1e-13)
    jam = next(t for t in report["tables"] if t.title.startswith("Binding"))
    rows = {row[0]: row[1:] for row in jam.rows}
    assert rows["interval of binding 1"] == ("27.05922033° to 152.94077967°", "26.45190077° to 153.54809923°")
    assert rows["interval of binding 2"] == ("207.05922033° to 332.94077967°", "206.45190077° to 333.54809923°")


def test_lambda_run_writes_a_whole_folder(tmp_path: Path) -> None:
    report = run("lambda", out=tmp_path / "deep" / "folder")
    assert report.folder == tmp_path / "deep" / "folder"
    names = sorted(p.name for p in report.folder.iterdir())
    assert names == ["report.html", "results.csv", "scene.json"]
    (row,) = csv.DictReader(io.StringIO((report.folder / "results.csv").read_text(encoding="utf-8"), newline=""))
    assert row["key"] == MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0).key
    content = json.loads((report.folder / "scene.json").read_text(encoding="utf-8"))
    assert content["versions"]["python"] and len(content["sha256"]) == 64
    assert [s["stage"] for s in content["stages"]][:3] == ["solve", "generate", "recognise"]
    page = (report.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 12 and "binds over part of the range" in page


# theory/values-of-the-platform 5: psi/pi, x, y [mm], alpha [rad], det JX [mm^4].
TURN = [
    (0.0, 0.6726309905203590802261, -5.007798833182029853049, 0.0533847814110077176268, -188253854.0504867671045),
    (0.25, 2.0030859414710400173073, -3.391552232148333278478, 0.0698791060028457918095, -187287228.0329033806575),
    (0.5, 2.1722114191839716420408, -0.047683234144498836436, 0.0489515152541789295715, -189868098.6267280692276),
    (0.75, 1.0254958901396452594492, 3.6498280650708433981449, 0.0018734701696661657001, -192939712.3128997799288),
    (1.0, -0.673144174112717568858, 5.3037656885458130460022, -0.043417848988177012159, -194870779.2935353852359),
    (1.25, -1.831077174898203679729, 3.2923456599243512976745, -0.059422217057041598215, -196581108.8681434511971),
    (1.5, -1.889700145248385379255, -1.051522105833263727665, -0.034763772995367469675, -195831019.5659246261507),
    (1.75, -0.924952891787966374348, -4.329827171934922428383, 0.0115530089064296119147, -192012144.5301085069646),
]


@pytest.fixture(scope="module")
def moved() -> Any:
    """The turn of the Figure 3 mechanism with the dimensions of the shipped scene."""
    from graphsynth.pipeline.products import Candidate
    from graphsynth.pipeline.stages import Context
    from graphsynth.systems.platform.stages import kinematics, recognise

    context = Context(load_scene("didenko"))
    shuffled = FIGURE_3.relabelled([0, *range(14, 0, -1)])
    (attempt,) = kinematics(context, recognise(context, (Candidate(1, shuffled, ""),)))
    assert attempt.reason == ""
    return attempt.value


def test_didenko_turn_reproduces_the_published_poses(moved: Any) -> None:
    motion = moved.motion
    for angle, *pose, determinant in TURN:
        i = round(angle * 180)
        assert np.allclose(1e3 * motion.pose[i][:2], pose[:2], rtol=0, atol=2e-13)  # published in mm
        assert abs(motion.pose[i][2] - pose[2]) < 1e-14
        assert math.isclose(1e12 * motion.determinant[i], determinant, rel_tol=1e-12)
    assert np.allclose(motion.pose[-1], motion.pose[0], rtol=0, atol=1e-15)


def test_didenko_joints_keep_their_distances(moved: Any) -> None:
    for one, other, length in [
        (moved.B, moved.C, 45.0),
        (moved.C, moved.D, 60.0),
        (moved.D, moved.A, 45.0),
        (moved.A, moved.F, 60.0),
        (moved.O, moved.B, np.array([10.0, 5.0, 0.0])),
        (moved.F, np.roll(moved.F, 1, axis=1), 45 * math.sqrt(3)),
    ]:
        assert np.allclose(1e3 * np.abs(one - other), length, rtol=0, atol=1e-12)


def test_didenko_finds_figure_3_among_46_symmetric_mechanisms(didenko: Any) -> None:
    assert len(didenko["solutions"]) == 1
    candidates = didenko["candidates"]
    assert len(candidates) == len({c.graph.key for c in candidates}) == 46
    for candidate in candidates:
        graph = candidate.graph
        assert (graph.links, graph.mobility, graph.loops, graph.degrees[0]) == (15, 1, 8, 7)
        assert graph.assortment == {2: 6, 3: 7, 4: 1} and graph.rigid_subchain() is None
        assert sum(j.mobility == 2 for j in graph.joints) == 3
    known = [r for r in didenko["recognised"] if r.module]
    assert [r.candidate.graph.key for r in known] == [FIGURE_3.key]
    statuses = [record.status for record in didenko["records"]]
    assert statuses.count("assessed") == 1 and statuses.count("not recognised") == 45


def test_threefold_symmetry_against_all_automorphisms() -> None:
    from networkx.algorithms.isomorphism import GraphMatcher, categorical_edge_match

    def slow(graph: MechanismGraph, fixed: int) -> bool:
        view = graph.to_networkx()
        for link in view.nodes:
            view.nodes[link]["frame"] = link == graph.frame
        matcher = GraphMatcher(view, view, lambda a, b: a["frame"] == b["frame"], categorical_edge_match("mobility", 1))
        for image in matcher.isomorphisms_iter():
            thrice = {link: image[image[image[link]]] for link in image}
            still = sum(image[link] == link for link in image) - 1
            if thrice == {link: link for link in image} and still == fixed and still < graph.links - 1:
                return True
        return False

    two_stars = [(0, k) for k in (1, 2, 3, 4, 5, 6)] + [(7, k) for k in (1, 2, 3)] + [(8, k) for k in (4, 5, 6)]
    one_geared = [(a, b, 2 if (a, b) == (7, 1) else 1) for a, b in two_stars]
    complete = [(a, b) for a in range(5) for b in range(a)]
    for graph in (
        FIGURE_3,
        MechanismGraph(9, two_stars, frame=0),  # 9 divides its order: 2 or 5 links may stay
        MechanismGraph(9, one_geared, frame=0),
        MechanismGraph(5, complete, frame=0),  # an orbit of 4 links with one that stays
        MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0),
    ):
        for fixed in range(graph.links):
            assert bool(threefold_symmetry(graph, fixed)) == slow(graph, fixed), (graph, fixed)


def test_a_candidate_that_fails_is_recorded_with_its_reason(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["mechanism"]["lengths"] = {"frame": 1, "crank": 1, "coupler": 10, "rocker": 1}
    report = execute(Scene.from_mapping(lambda_tables))
    (record,) = report["records"]
    assert (record.status, record.recognised_as) == ("failed", "lambda_linkage")
    assert record.reason.startswith("the linkage cannot be assembled at any crank angle")
    assert report["tables"] == () and report["plots"] == () and report["mechanism_pictures"] == ()


@pytest.mark.long
def test_a_crank_that_cannot_turn_fully_is_assessed_and_drawn(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["mechanism"]["lengths"] = {"frame": 2, "crank": 1, "coupler": 1, "rocker": 1}
    report = execute(Scene.from_mapping(lambda_tables))
    (record,) = report["records"]
    assert record.status == "assessed"
    motion = next(t for t in report["tables"] if t.title == "Motion")
    assert "cannot make a full rotation" in motion.rows[0][1] and motion.rows[2][1].startswith("none")
    assert any("cannot be assembled" in picture.svg for picture in report["mechanism_pictures"])
    assert not any(re.search(r"\bnan\b", picture.svg) for picture in report["mechanism_pictures"])


@pytest.mark.parametrize(("clearance", "good"), [(0.0650992730735, False), (0.0650992730736, True)])
def test_the_verdict_turns_at_the_published_clearance(
    lambda_tables: dict[str, Any], clearance: float, good: bool
) -> None:
    lambda_tables["mechanism"]["bearing"]["clearance_mm"] = clearance
    del lambda_tables["mechanism"]["tolerances"]
    lambda_tables["outputs"]["products"] = ["records"]
    (record,) = execute(Scene.from_mapping(lambda_tables))["records"]
    assert record.good is good


def test_a_wider_question_lists_what_no_module_knows(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["structure"]["question"] = {"W": 1, "links": 6}
    lambda_tables["outputs"]["products"] = ["records"]
    records = execute(Scene.from_mapping(lambda_tables))["records"]
    assert len(records) == 5  # Watt: 2 inversions, Stephenson: 3
    assert {r.status for r in records} == {"not recognised"}
    assert {r.reason for r in records} == {"no kinematic module yet recognises this graph"}


def test_more_candidates_than_the_limit_is_an_error(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["structure"] = {"question": {"W": 1, "links": 6}, "generate": {"limit": 4}}
    with pytest.raises(TooLargeError, match=r"limit = 4 mechanisms; raise the limit"):
        execute(Scene.from_mapping(lambda_tables))


def test_a_bad_question_names_the_scene(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["structure"]["question"] = {"W": 1, "lniks": 4}
    with pytest.raises(SceneError, match=r"x\.toml: \[structure\.question\].*lniks"):
        execute(Scene.from_mapping(lambda_tables, "x.toml"))


def test_a_product_that_was_not_asked_for_is_not_kept(lambda_tables: dict[str, Any]) -> None:
    lambda_tables["outputs"]["products"] = ["solutions"]
    report = execute(Scene.from_mapping(lambda_tables))
    assert [t.stage for t in report.times] == ["solve"]
    with pytest.raises(SceneError, match=r"did not keep 'records'; add it to \[outputs\]"):
        report["records"]
