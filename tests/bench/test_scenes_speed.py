"""How fast the survey and the search run; how much two processes gain."""

from __future__ import annotations

import resource
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from graphsynth.core.ordered import processes
from graphsynth.pipeline.runner import run
from graphsynth.pipeline.scene import Scene, load_scene


def survey(products: tuple[str, ...]) -> Scene:
    scene = load_scene("four_bar_survey")
    return replace(scene, outputs=replace(scene.outputs, products=products))


def small(scene: Scene) -> Scene:
    """A twentieth of the frames, for a run that only shows that this file works."""
    table = scene.mechanism
    frame = replace(table.lengths.frame, first=2.0, last=2.2)
    lengths = replace(table.lengths, frame=frame)
    raw: Any = {"mechanism": {}}
    return replace(scene, mechanism=replace(table, lengths=lengths, certify=20), raw=raw)


@pytest.mark.benchmark(min_rounds=1)
def test_four_bar_survey(benchmark: Any, tmp_path: Path) -> None:
    """A million dimension sets, a thousand certified, one process: at most 60 s on two cores are asked for."""
    scene = survey(("records", "ranking", "tables", "rows"))
    if not benchmark.enabled:
        pytest.skip("a measurement")
    run(small(scene), tmp_path / "warm")
    report = benchmark.pedantic(lambda: run(scene, tmp_path / "out", fresh=True), rounds=1)
    table = dict(next(t for t in report["tables"] if t.title == "The survey").rows)
    benchmark.extra_info["sets per second"] = int(int(table["dimension sets"]) / benchmark.stats.stats.min)
    assert " 0 sets of" in " " + table["motion against the exact class"]


def spent() -> float:
    """CPU seconds of this process and of the children that have ended."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


@pytest.mark.benchmark(min_rounds=1)
def test_two_processes(benchmark: Any, tmp_path: Path) -> None:
    """Speed-up of two processes whose pool is warm: by wall time, and CPU time (free of the load of others)."""
    if not benchmark.enabled:
        pytest.skip("a measurement")
    scene = survey(("records", "ranking", "tables", "rows"))
    run(small(scene), tmp_path / "warm")
    start, before = time.perf_counter(), spent()
    run(scene, tmp_path / "one")
    one, cpu_one = time.perf_counter() - start, spent() - before
    before = spent()
    with processes(2) as pool:
        run(small(scene), tmp_path / "warm two", pool)
        warm = time.perf_counter()
        benchmark.pedantic(lambda: run(scene, tmp_path / "two", pool, fresh=True), rounds=1)
        two = time.perf_counter() - warm
    benchmark.extra_info |= {
        "seconds with one": round(one, 2),
        "speed-up by wall time": round(one / two, 3),
        "CPU seconds with one, with two": f"{cpu_one:.1f}, {spent() - before:.1f}",
    }
    for name in ("candidates.jsonl", "results.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


@pytest.mark.benchmark(min_rounds=1)
def test_eight_link_search(benchmark: Any, tmp_path: Path) -> None:
    """All 71 mechanisms in two processes: less than a minute is asked for."""
    if not benchmark.enabled:
        pytest.skip("a measurement")
    with processes(2) as pool:
        report = benchmark.pedantic(lambda: run("eight_link_search", tmp_path, pool, fresh=True), rounds=1)
    assert len(report["records"]) == 71
