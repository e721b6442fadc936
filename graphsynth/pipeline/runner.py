"""Running a scene: only the stages its outputs need, in order, each imported on demand and measured."""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any

import graphsynth
from graphsynth.core.errors import SceneError
from graphsynth.core.ordered import check_executor
from graphsynth.pipeline.measure import measured, memory_in_use, new_modules, reset_peak, rooms
from graphsynth.pipeline.products import Records
from graphsynth.pipeline.report import write_report
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.stages import Context, Progress, Report, StageTime, resolve
from graphsynth.pipeline.store import JOURNAL, Candidates, check_files, check_folder, signature
from graphsynth.pipeline.streaming import Plan, Spent, given_by, plan_stream, stream
from graphsynth.pipeline.system import Stage

#: Packages whose versions the report names, where they were loaded.
_PACKAGES = ("numpy", "numba", "scipy", "networkx", "sympy", "pandas", "matplotlib", "rich", "distributed")


def run(
    scene: str | Path | Scene,
    out: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    fresh: bool = False,
) -> Report:
    """Run a scene and write its report folder.

    Parameters
    ----------
    scene : str, Path or Scene
        A shipped scene by name, a TOML file by path, or a scene.
    out : str or Path, optional
        The folder for ``report.html``, ``results.csv``, ``scene.json`` and, of a scene with stages for each
        candidate, ``candidates.jsonl``; ``graphsynth-out/<scene>`` by default.
    executor : concurrent.futures.Executor, optional
        For candidates in parallel, and handed to every other stage in its context; results do not depend on it.
    progress : callable, optional
        Called as ``progress(stage, done, total)``.
    fresh : bool, optional
        Start anew; otherwise an interrupted run in the same folder goes on where it stopped.

    Returns
    -------
    Report
        With ``folder`` set.

    Raises
    ------
    SceneError, FormatError
        At once, if the scene cannot be read or asks for what no stage gives, or the folder cannot be written.
    SpecError
        If the structural question makes no sense.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    folder = Path(out) if out is not None else Path("graphsynth-out") / scene.name
    check_folder(folder)
    report = execute(scene, executor, progress, folder / JOURNAL, fresh)
    return replace(report, folder=write_report(report, folder))


def has_stream(scene: Scene) -> bool:
    """Whether what the scene asks for takes candidates one by one, which several processes can share."""
    return any(stage.each for stage in _resolved(scene))


def _resolved(scene: Scene) -> tuple[Stage, ...]:
    return resolve(scene.stages(), scene.outputs.products, scene.place / "outputs" / "products")


def execute(
    scene: str | Path | Scene,
    executor: Executor | None = None,
    progress: Progress | None = None,
    journal: Path | None = None,
    fresh: bool = False,
) -> Report:
    """Run a scene without writing a report, otherwise like `run`; outcomes of candidates are kept in `journal`."""
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    check_executor(executor)
    check_files(scene)
    done = Running(_resolved(scene), scene.outputs.products, Context(scene, executor), progress, journal, fresh)
    products = done.run()
    if "records" in products:
        products["records"] = Records(products["records"])
    versions = {"python": platform.python_version(), "graphsynth": graphsynth.__version__}
    versions |= {name: version(name) for name in _PACKAGES if name in sys.modules}
    return Report(
        scene,
        MappingProxyType(products),
        tuple(done.times),
        MappingProxyType(versions),
        stages=done.stages,
        notes=tuple(done.notes),
        seconds=done.seconds,
    )


class Running:
    """Resolved stages, each behind all it needs, and what they have given so far.

    Parameters are those of `execute`. `stages` are in the order of running; `seconds`: wall clock of all together.
    """

    def __init__(
        self,
        stages: Sequence[Stage],
        wanted: tuple[str, ...],
        context: Context,
        progress: Progress | None = None,
        journal: Path | None = None,
        fresh: bool = False,
    ) -> None:
        self._plan = plan_stream(stages, wanted)
        self.stages = _around_stream(stages, self._plan)
        self._wanted = wanted
        self._context = context
        self._progress = progress
        self._journal = journal
        self._fresh = fresh
        self._products: dict[str, Any] = {}
        self._started = time.perf_counter()
        self._source_seconds = 0.0
        self._aside: dict[str, Future[tuple[Any, StageTime]]] = {}  # by stage
        self.times: list[StageTime] = []
        self.notes: list[str] = []
        self.seconds = 0.0

    def run(self) -> dict[str, Any]:
        """Run all stages and return the wanted products.

        A product nobody needs any more is dropped at once, so memory holds what is in use.
        """
        streamed = False
        for done, stage in enumerate(self.stages):
            if stage.each and streamed:
                continue
            self._tell(stage.name, done)
            # behind the stream a run is finished, with what there is
            if not any(other.each for other in self.stages[:done]) and (why := self._used_up()):
                raise SceneError(
                    f"{self._context.scene.place / 'budget'} stops the run before stage {stage.name!r}: {why}; raise "
                    "it, or ask for fewer outputs"
                )
            self._start_aside(self.stages[done:])
            if stage.each and self._plan is not None:
                self._run_stream(self._plan, done)
                streamed = True
            elif stage.name in self._aside:
                self.times.append(StageTime(stage.name, 0.0, 0.0))  # until it is gathered
            else:
                self._run_stage(stage, self.stages[done + 1 :])
            needed = {need for later in self.stages[done + 1 :] for need in later.needs} | set(self._wanted)
            self._products = {name: value for name, value in self._products.items() if name in needed}
        by_name = {stage.name: stage for stage in self.stages}
        for place, spent in enumerate(self.times):
            if spent.stage in self._aside:
                result, self.times[place] = self._aside[spent.stage].result()
                self._products.update(given_by(by_name[spent.stage], result))
        self.seconds = time.perf_counter() - self._started
        self._tell("done", len(self.stages))
        return {name: self._products[name] for name in self._wanted}

    def _tell(self, what: str, done: int) -> None:
        if self._progress:
            self._progress(what, done, len(self.stages))

    def _run_stage(self, stage: Stage, later: Sequence[Stage]) -> None:
        """Import and call one stage; a stream is gathered if a stage over all candidates needs it whole."""
        context = replace(self._context, told=lambda what: self._tell(what, len(self.times)))
        result, spent = measured(stage, context, [self._products[need] for need in stage.needs])
        if stage.stream:
            start = time.perf_counter()
            whole = set(self._wanted).union(*(other.needs for other in later if not other.each))
            result = tuple(result) if whole & set(stage.gives) else self._timed(result)
            spent = replace(spent, seconds=spent.seconds + time.perf_counter() - start)
        self._products.update(given_by(stage, result))
        self.times.append(spent)

    def _start_aside(self, waiting: Sequence[Stage]) -> None:
        """Have another process run every stage that only gives outputs, as soon as what it needs is there."""
        executor = self._context.executor
        if executor is None:
            return
        needed = {need for stage in self.stages for need in stage.needs}
        for stage in waiting:
            ready = set(stage.needs) <= set(self._products)
            if stage.aside and ready and stage.name not in self._aside and not needed & set(stage.gives):
                needs = [self._products[need] for need in stage.needs]
                alone = replace(self._context, executor=None)
                self._aside[stage.name] = executor.submit(measured, stage, alone, needs)

    def _timed(self, items: Iterable[Any]) -> Iterator[Any]:
        """Pass candidates on, adding up the time it takes to make them."""
        start = time.perf_counter()
        for item in items:
            self._source_seconds += time.perf_counter() - start
            yield item
            start = time.perf_counter()
        self._source_seconds += time.perf_counter() - start

    def _run_stream(self, plan: Plan, done: int) -> None:
        """Run the stages for each candidate."""
        loads = {}
        for stage in plan.stages:
            before, start = frozenset(sys.modules), time.perf_counter()
            stage.load()
            loads[stage.name] = StageTime(stage.name, time.perf_counter() - start, 0.0, modules=new_modules(before))
        reset_peak()
        mark = signature(self._context.scene, plan.stages, plan.kept)
        with Candidates(self._journal, self._context.scene.name, mark, self._fresh) as journal:
            shared = {name: self._products[name] for name in plan.shared}
            found = stream(
                plan,
                self._context,
                shared,
                self._products[plan.source],
                journal,
                self._used_up,
                lambda count: self._tell(f"candidates: {count} done", done),
            )
        if found.resumed:
            self.notes.append(f"{found.resumed} candidates were taken over from an interrupted run.")
        if found.stopped:
            self.notes.append(
                f"Stopped after {len(found.outcomes)} candidates: {found.stopped}. What is stored stays; run again "
                "with a larger [budget] to go on."
            )
        self._products.update({name: tuple(found.outcomes) for name in plan.kept})
        peak = memory_in_use("VmHWM")
        sources = [stage.name for stage in self.stages if plan.source in stage.gives]
        for place, made in enumerate(self.times):
            if made.stage in sources:
                self.times[place] = replace(made, seconds=made.seconds + self._source_seconds)
        for stage in plan.stages:
            loaded, spent = loads[stage.name], found.spent.get(stage.name, Spent())
            modules = tuple(sorted({*loaded.modules, *rooms(spent.modules)}))
            self.times.append(replace(loaded, seconds=spent.seconds, peak_mb=peak, modules=modules, runs=spent.runs))

    def _used_up(self) -> str:
        """Say which budget is used up, or nothing."""
        budget = self._context.scene.budget
        spent = time.perf_counter() - self._started
        if budget.time is not None and spent > budget.time:
            return f"the time of {budget.time:g} s is used up"
        if budget.memory is not None and (used := 1e6 * memory_in_use()) > budget.memory:
            return f"{used / 1e6:.0f} MB of memory are in use, [budget] allows {budget.memory / 1e6:g} MB"
        return ""


def _around_stream(stages: Sequence[Stage], plan: Plan | None) -> tuple[Stage, ...]:
    """Order stages: those the stream does not wait for, the stages for each candidate, those that need the stream."""
    if plan is None:
        return tuple(stages)
    after = {product for stage in plan.stages for product in stage.gives}
    last = []
    over_all = [stage for stage in stages if not stage.each]
    for stage in over_all:
        if after & set(stage.needs):
            after |= set(stage.gives)
            last.append(stage)
    return (*(stage for stage in over_all if stage not in last), *plan.stages, *last)
