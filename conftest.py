"""How pytest collects: examples in docstrings, and files that two workers do not both prepare."""

from __future__ import annotations

import gc
from collections.abc import Generator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from _pytest.doctest import DoctestModule

_PACKAGE, _TESTS = Path(__file__).parent / "graphsynth", Path(__file__).parent / "tests"
#: Examples of docstrings that take a second or more of a processor.
_LONG = {
    "graphsynth.intervals.cells.pave_compiled", "graphsynth.jamming.questions.largest_scale",
    "graphsynth.jamming.space.scale.largest_scale", "graphsynth.jamming.space.scale.least_factor",
}  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[Any], list[Any]]:
    """Look in the modules of the package that have any.

    In tests it would import every file a second time; a module of kernels would be compiled by every worker.
    """
    found = yield
    if file_path.suffix != ".py" or (file_path.is_relative_to(_PACKAGE) and ">>> " in file_path.read_text("utf-8")):
        return found
    return [collector for collector in found if not isinstance(collector, DoctestModule)]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without searching for garbage, and leave what was collected out of every later search: it stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, pytest.CollectReport, Any]:
    """Every second worker goes through the folders backwards: what one has compiled, the other one finds on disk."""
    report = yield
    worker = getattr(collector.config, "workerinput", {"workerid": "gw0"})["workerid"]
    if isinstance(collector, pytest.Directory) and int(worker.removeprefix("gw")) % 2:
        report.result.reverse()
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """All workers have the same order, of whole subjects first, since a file stays on one of them; set marks."""
    items.sort(key=lambda item: (len(item.path.parts), item.path))
    for item in items:
        if item.name in _LONG:
            item.add_marker("long")
        if _needs_extras(item.path):
            item.add_marker("extra")


@cache
def _needs_extras(path: Path) -> bool:
    """Whether some tests of a file, measurements aside, are skipped where an extra is not installed."""
    if not path.is_relative_to(_TESTS) or path.is_relative_to(_TESTS / "bench"):
        return False
    text = path.read_text("utf-8")
    return "importorskip" in text or "find_spec" in text
