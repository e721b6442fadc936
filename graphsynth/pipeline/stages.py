"""The stages of a run: the fewest that yield the outputs asked for, what each is called with, what a run gave."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from graphsynth.core.errors import GeometryError, SceneError, SpecError
from graphsynth.core.shown import Shown
from graphsynth.evidence.rows import imported
from graphsynth.pipeline.scene import Scene
from graphsynth.pipeline.system import Stage, announced, system
from graphsynth.pipeline.tables import Place, shortened, suggest

#: Told the name of a stage, how many are done, and of how many: before each, after candidates, and once at the end.
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Context:
    """What every stage may read besides the products it needs: it is called as ``function(context, *products)``."""

    scene: Scene
    executor: Executor | None = None
    told: Callable[[str], None] | None = None  # says how far a stage over all is


def build(scene: Scene) -> Any:
    """Return the mechanism of a scene, as its system builds it.

    A `SceneError` says that the numbers of the scene cannot be built, or that the scene has many mechanisms.

    >>> from graphsynth.pipeline.scene import load_scene
    >>> build(load_scene("antenna")).lengths
    (0.1, 0.15, 0.0592, 0.15, 0.0592)
    """
    name = scene.mechanism.module
    builder = system(name).build
    if not builder:
        raise (scene.place / "mechanism").error(f"has many mechanisms, not one: module = {name!r} builds none")
    try:
        return imported(builder, f"system {name!r}")(Context(scene))
    except (SpecError, GeometryError) as error:
        raise (scene.place / "mechanism").error(f"cannot be built: {error}") from error


@dataclass(frozen=True, slots=True)
class StageTime:
    """What a stage took in the process where it ran (estimated, one measurement)."""

    stage: str
    import_seconds: float  # wall clock, as the next; of a stage for each candidate the sum over candidates
    seconds: float
    peak_mb: float = math.nan  # largest resident memory meanwhile, MB; of all stages for each candidate together
    modules: tuple[str, ...] = ()  # rooms of graphsynth and third-party packages it was the first to import
    runs: int = 1  # how many candidates it looked at; 1 for a stage over all


@dataclass(frozen=True, slots=True, repr=False)
class Report(Shown):
    """What a run gave."""

    scene: Scene
    products: Mapping[str, Any]  # the outputs asked for, and what became of the candidates
    times: tuple[StageTime, ...]  # in the order of running
    versions: Mapping[str, str] = field(default_factory=dict)  # of Python and of loaded packages
    folder: Path | None = None  # where the report was written
    stages: tuple[Stage, ...] = ()  # that ran, in order
    notes: tuple[str, ...] = ()  # a budget that was used up, candidates taken over from an interrupted run
    seconds: float = 0.0  # wall clock; stages of candidates that several processes share take longer together

    def __getitem__(self, product: str) -> Any:
        """Return one output; a `SceneError` if the scene did not ask for it."""
        if product not in self.products:
            raise SceneError(
                f"this run did not keep {product!r}; add it to [outputs] products (kept: {', '.join(self.products)})"
            )
        return self.products[product]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(f"no. {r.number}", r.verdict or r.reason or r.status) for r in self.products.get("records", ())][:5]
        return self.scene.scene.title, [*rows, ("products", ", ".join(self.products)), ("folder", str(self.folder))]


def _installed(product: str) -> Stage | None:
    """Return the stage of another package that gives this product, or None; a `SceneError` for one that is none."""
    for point in announced("stages").select(name=product):
        try:
            stage = point.load()
        except (ImportError, AttributeError, ValueError) as error:
            raise SceneError(
                f"product {product!r} is announced by {point.value!r}, which cannot be imported: {error}"
            ) from error
        if not isinstance(stage, Stage) or product not in stage.gives:
            raise SceneError(f"product {product!r} is announced by {point.value!r}, which is no Stage that gives it")
        return stage
    return None


def resolve(stages: Iterable[Stage], outputs: Sequence[str], place: Place | None = None) -> tuple[Stage, ...]:
    """Return the smallest set of stages that yields `outputs`, in an order in which each finds what it needs.

    Backward from the outputs; the order depends on `outputs` and `stages` alone. A product that none of `stages` gives
    may come from a stage that another package announces. `place` is where the outputs were named. A `SceneError` names
    an unknown output, a need that no stage gives, or the stages of a cycle.

    >>> a, b, c = Stage("a", "m:a", (), ("x",)), Stage("b", "m:b", ("x",), ("y",)), Stage("c", "m:c", (), ("z",))
    >>> [stage.name for stage in resolve([c, b, a], ["y"])]
    ['a', 'b']
    """
    givers: dict[str, Stage] = {}
    for stage in stages:
        for product in stage.gives:
            if product in givers:
                first = givers[product].name
                raise SceneError(f"product {product!r} is given by two stages, {first!r} and {stage.name!r}")
            givers[product] = stage
    at = f"{place} " if place else ""
    order: list[Stage] = []
    path: list[str] = []

    def visit(product: str) -> None:
        giver = givers.get(product) or _installed(product)
        if giver is None:
            who = f"stage {path[-1]!r} needs" if path else "asks for"
            known = suggest(product, (*givers, *announced("stages").names))
            raise SceneError(f"{at}{who} {shortened(repr(product))}, which no stage gives{known}")
        givers[product] = giver
        if giver in order:
            return
        if giver.name in path:
            circle = [*path[path.index(giver.name) :], giver.name]
            raise SceneError(f"{at}stages need each other: {' -> '.join(circle)}")
        path.append(giver.name)
        for need in giver.needs:
            visit(need)
        path.pop()
        order.append(giver)

    for output in outputs:
        visit(output)
    return tuple(order)
