from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from graphsynth.pipeline import report as reports
from graphsynth.pipeline.page import report_html
from graphsynth.pipeline.scene import find_scene

from ..plain_svg import faults, pictures_of


@pytest.fixture(autouse=True)
def plain_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every picture of every report that is written is right in programs without style sheets."""

    def checked(report: Any) -> str:
        page = report_html(report)
        assert [(k, found) for k, svg in enumerate(pictures_of(page)) if (found := faults(svg))] == []
        return page

    monkeypatch.setattr(reports, "report_html", checked)


@pytest.fixture
def lambda_tables() -> dict[str, Any]:
    """The tables of the shipped lambda scene, free to be spoiled."""
    return copy.deepcopy(tomllib.loads(find_scene("lambda").read_text(encoding="utf-8")))


FAKE_FAMILY = """
import os
import time
from dataclasses import dataclass
from typing import Literal

from graphsynth.pipeline.system import System
from graphsynth.pipeline.products import Candidate, Quantity, Record, Rejected
from graphsynth.pipeline.system import COLLECT, Stage


@dataclass(frozen=True, slots=True)
class Table:
    module: Literal["springs"]
    count: int
    rest_mm: float = 1.0
    pause_s: float = 0.0
    log: str = ""


class Spring:
    def __init__(self, number):
        self.number, self.key = number, f"spring-{number}"


def springs(context, *needs):
    for number in range(1, context.scene.mechanism.count + 1):
        yield Spring(number)


def scale(context):
    return 2.0


def check(context, spring):
    note(context, "check", spring)
    if spring.number % 3 == 0:
        raise Rejected("a multiple of three", f"{spring.number}")
    return spring.number


def bend(context, spring, checked, factor):
    note(context, "bend", spring)
    time.sleep(context.scene.mechanism.pause_s)
    if spring.number == 7:
        raise ZeroDivisionError("seven")
    return factor * checked


def judge(context, bent):
    mass = Quantity("mass", bent, "kg")
    return Record(verdict="holds", good=True, margins=(mass, Quantity("stroke", (bent * 7) % 11)))


def count(context, records):
    return len(records)


def loop_a(context, b):
    return b


def note(context, what, spring):
    if context.scene.mechanism.log:
        with open(context.scene.mechanism.log, "a") as stream:
            stream.write(f"{what} {spring.number}\\n")


M = __name__
SYSTEM = System(
    Table,
    (
        Stage("springs", f"{M}:springs", (), ("springs",), stream=True),
        Stage("scale", f"{M}:scale", (), ("factor",)),
        Stage("bend", f"{M}:bend", ("springs", "checked", "factor"), ("bent",), each=True, cost=9.0),
        Stage("check", f"{M}:check", ("springs",), ("checked",), each=True, cost=0.1),
        Stage("judge", f"{M}:judge", ("bent",), ("record",), each=True),
        COLLECT,
    ),
    structure="none",
)
COUNT = Stage("count", f"{M}:count", ("records",), ("how_many",))
LOOP = Stage("loop a", f"{M}:loop_a", ("loop_b",), ("loop_a",))
BACK = Stage("loop b", f"{M}:loop_a", ("loop_a",), ("loop_b",))
WRONG = "no stage"
"""
FAKE_ENTRIES = """
[graphsynth.systems]
springs = fake_springs:SYSTEM
not_a_family = fake_springs:COUNT
broken_family = fake_springs_missing:SYSTEM
[graphsynth.stages]
how_many = fake_springs:COUNT
loop_a = fake_springs:LOOP
loop_b = fake_springs:BACK
wrong = fake_springs:WRONG
gone = fake_springs:NOTHING
"""


@pytest.fixture(scope="session")
def fake_site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an installed distribution that announces a family and stages."""
    site = tmp_path_factory.mktemp("site")
    (site / "fake_springs.py").write_text(FAKE_FAMILY, encoding="utf-8")
    info = site / "fake_springs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fake-springs\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(FAKE_ENTRIES, encoding="utf-8")
    return site


@pytest.fixture
def fake(fake_site: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The distribution, importable here and in child processes."""
    monkeypatch.syspath_prepend(str(fake_site))
    monkeypatch.setenv("PYTHONPATH", str(fake_site))
    return fake_site


SPRINGS = """
[scene]
name = "springs"
title = "Springs"

[mechanism]
module = "springs"
count = 20

[outputs]
products = ["records", "ranking"]

[ranking]
show = 5
[[ranking.objectives]]
quantity = "mass"
[[ranking.objectives]]
quantity = "stroke"
goal = "max"
weight = 3
"""


@pytest.fixture
def springs(fake: Path, tmp_path: Path) -> Path:
    """A scene file of the fake family."""
    path = tmp_path / "springs.toml"
    path.write_text(SPRINGS, encoding="utf-8")
    return path
