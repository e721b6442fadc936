"""Stages that run in another process while later ones run here."""

from __future__ import annotations

import threading
import tomllib
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import pytest

from graphsynth.pipeline.runner import Running, execute
from graphsynth.pipeline.scene import Scene, find_scene
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.system import Stage


def survey() -> Scene:
    found = tomllib.loads(find_scene("four_bar_survey").read_text(encoding="utf-8"))
    span = {"first": 0.5, "last": 5, "step": 0.5}
    found["mechanism"] |= {"lengths": {"crank": 1, "frame": span, "coupler": span, "rocker": span}, "certify": 10}
    found["outputs"] = {"products": ["records", "ranking", "plots"]}
    return Scene.from_mapping(found)


class Noted(Executor):
    """Threads, with a note of every function handed to them."""

    def __init__(self) -> None:
        self.pool = ThreadPoolExecutor(1)
        self.names: list[str] = []
        self.workers_of_aside: list[Executor | None] = []

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        if arguments and isinstance(arguments[0], Stage):
            self.names.append(arguments[0].name)
            self.workers_of_aside.append(arguments[1].executor)
        return self.pool.submit(function, *arguments, **named)


@pytest.mark.slow
def test_pictures_drawn_elsewhere_are_the_same() -> None:
    alone = execute(survey())
    executor = Noted()
    shared = execute(survey(), executor)
    assert executor.names == ["maps"]
    assert executor.workers_of_aside == [None]  # it must not wait for the threads it runs on
    assert shared.products == alone.products
    assert [time.stage for time in shared.times] == [time.stage for time in alone.times]
    drawn = next(time for time in shared.times if time.stage == "maps")
    assert drawn.seconds > 0 and drawn.peak_mb > 0


_FIRST = threading.Event()


def draw(context: Context, number: int) -> str:
    """Wait for the stage behind this one, which could not begin if this one ran where it runs."""
    return "picture" if _FIRST.wait(20) else "never"


def go_on(context: Context, number: int) -> int:
    _FIRST.set()
    return number + 1


def fail(context: Context, number: int) -> str:
    raise ArithmeticError("no ink")


def count(context: Context) -> int:
    return 1


def fake(monkeypatch: pytest.MonkeyPatch, **functions: Any) -> None:
    monkeypatch.setattr(Stage, "load", lambda stage: functions[stage.function])


@pytest.fixture
def stages(monkeypatch: pytest.MonkeyPatch) -> list[Stage]:
    fake(monkeypatch, count=count, draw=draw, go_on=go_on, fail=fail)
    return [
        Stage("count", "count", (), ("number",)),
        Stage("draw", "draw", ("number",), ("picture",), aside=True),
        Stage("go on", "go_on", ("number",), ("next",)),
    ]


def test_it_starts_as_soon_as_its_needs_are_there(stages: list[Stage]) -> None:
    _FIRST.set()
    executor = Noted()
    shuffled = [stages[0], stages[2], stages[1]]  # "go on" stands before it, but gives nothing it needs
    running = Running(shuffled, ("picture", "next"), Context(survey(), executor))
    tell = running._tell
    seen: dict[str, list[str]] = {}
    running._tell = lambda what, done: (seen.update({what: list(executor.names)}), tell(what, done))[1]  # type: ignore
    assert running.run() == {"picture": "picture", "next": 2}
    assert seen == {"count": [], "go on": [], "draw": ["draw"], "done": ["draw"]}
    assert [time.stage for time in running.times] == ["count", "go on", "draw"]


def test_later_stages_go_on_meanwhile(stages: list[Stage]) -> None:
    _FIRST.clear()
    with ThreadPoolExecutor(1) as executor:
        running = Running(stages, ("picture", "next"), Context(survey(), executor))
        assert running.run() == {"picture": "picture", "next": 2}
    assert [time.stage for time in running.times] == ["count", "draw", "go on"]


def test_what_another_stage_needs_is_not_put_aside(stages: list[Stage]) -> None:
    _FIRST.set()
    executor = Noted()
    last = Stage("last", "draw", ("picture",), ("end",))
    Running([*stages, last], ("next", "end"), Context(survey(), executor)).run()
    assert executor.names == []


def test_an_error_there_is_raised_here(stages: list[Stage]) -> None:
    stages[1] = replace(stages[1], function="fail")
    with ThreadPoolExecutor(1) as executor, pytest.raises(ArithmeticError, match="no ink"):
        Running(stages, ("picture", "next"), Context(survey(), executor)).run()
