"""The search for straight lines among the 71 eight-link mechanisms."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.kinematics import simulate
from graphsynth.mechanism.model import Mechanism
from graphsynth.pipeline.products import Quantity, Record
from graphsynth.pipeline.runner import run
from graphsynth.pipeline.scene import GenerateTable, Scene, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import rank


def check(report: Any) -> None:
    """Every candidate is embodied or rejected with a reason; what is kept draws its line, seen another way."""
    kept = report["mechanisms"].columns
    texts = dict(zip(kept["number"], kept["mechanism"], strict=True))
    for record in report["records"]:
        assert record.status in ("assessed", "rejected") and (record.status == "assessed") is (record.number in texts)
        if record.status == "rejected":
            assert record.reason.startswith(("no dimensions were found: ", "moves, but "))
            assert "nothing was accepted" in record.reason
            continue
        margins = {margin.name: margin.value for margin in record.margins}
        mechanism = Mechanism.from_json(texts[record.number])
        assert mechanism.graph.links == 8 and mechanism.graph.key == record.key
        motion = simulate(mechanism, np.linspace(0.0, 2.0 * math.pi, 1441))
        assert motion.completed and motion.closure.closed
        segment = motion.point("P").position[:721]
        stroke = float(np.hypot(*(segment[-1] - segment[0])))
        assert narrowest(segment) / stroke == pytest.approx(margins["deviation"], rel=0.02)
        assert margins["deviation"] <= 0.02 and margins["transmission angle"] > 19.99
        driver = mechanism.drivers[0]
        at = [j.at_a if j.a == driver.link else j.at_b for j in mechanism.joints if driver.link in j.pair]
        assert min(abs(math.dist(p, q) * 3.0 - stroke) for p in at for q in at if p != q) < 0.2 * stroke
    ranking = report["ranking"]
    assert set(ranking.numbers) == set(texts)
    deviations = [next(m.value for m in r.margins if m.name == "deviation") for r in report["records"] if r.margins]
    assert [row[0] for row in ranking.values] == sorted(deviations)


def narrowest(points: np.ndarray) -> float:
    """Width of the narrowest strip, by trying directions."""
    chord = points[-1] - points[0]
    start = math.atan2(chord[1], chord[0])
    turns = start + np.linspace(-0.05, 0.05, 4001)
    across = points @ np.stack([-np.sin(turns), np.cos(turns)])
    return float(np.ptp(across, axis=0).min())


def drawn(scene: Scene, count: int) -> Scene:
    assert scene.structure is not None
    return replace(scene, structure=replace(scene.structure, generate=GenerateTable(sample=count)))


def test_the_answer_is_the_straightest_line() -> None:
    """Even if it is the worst of all in whatever else is known of it."""
    scene = load_scene("eight_link_search")
    lines = ((1, 0.0101, 50.0, 5.0), (2, 0.0099, 21.0, 12.0), (3, 0.02, 60.0, 4.0))
    records = tuple(
        Record(number, margins=(Quantity("deviation", d), Quantity("transmission angle", t), Quantity("size", s)))
        for number, d, t, s in lines
    )
    assert rank(Context(scene), records).numbers == (2, 1, 3)


@pytest.mark.long
def test_some_of_the_mechanisms(tmp_path: Path) -> None:
    report = run(drawn(load_scene("eight_link_search"), 2), out=tmp_path)
    check(report)
    assert len(report["records"]) == 2
    assert len(report["animations"]) == len(report["ranking"].numbers)


@pytest.mark.slow
def test_all_seventy_one(tmp_path: Path) -> None:
    report = run("eight_link_search", out=tmp_path)
    check(report)
    assert len(report["records"]) == 71 == len({record.key for record in report["records"]})
    assert len(report["ranking"].numbers) > 40 and len(report["animations"]) == 10
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure") == 20
