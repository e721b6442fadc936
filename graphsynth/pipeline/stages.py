"""The stages of a run: the fewest that yield the outputs asked for, what each is called with, what a run gave."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from graphsynth.core.errors import SceneError
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


def build(scene: Scene) -> Any:
    """Return the mechanism of a scene, as its system builds it.

    A `SceneError` says that the numbers of the scene cannot be built, or that the scene has many mechanisms.

    Examples
    --------
    >>> from graphsynth.pipeline.scene import load_scene
    >>> build(load_scene("antenna")).lengths
    (0.1, 0.15, 0.0592, 0.15, 0.0592)
    """
    name = scene.mechanism.module
    builder = system(name).build
    if not builder:
        raise (scene.place / "mechanism").error(
            f"has many mechanisms, not one: module = {name!r} builds none by itself"
        )
    return imported(builder, f"system {name!r}")(Context(scene))


@dataclass(frozen=True, slots=True)
class StageTime:
    """What a stage took (estimated, one measurement).

    Attributes
    ----------
    import_seconds, seconds : float
        Wall clock; for a stage for each candidate the sum over candidates, wherever they were computed.
    peak_mb : float
        Largest resident memory of the process where it ran, while it ran, in MB; of all stages for each candidate
        together.
    modules : tuple of str
        Rooms of graphsynth and third-party packages it was the first to import, in the process where it ran.
    runs : int
        How many candidates it looked at; 1 for a stage over all.
    """

    stage: str
    import_seconds: float
    seconds: float
    peak_mb: float = math.nan
    modules: tuple[str, ...] = ()
    runs: int = 1


@dataclass(frozen=True, slots=True)
class Report:
    """What a run gave.

    Attributes
    ----------
    scene : Scene
        The scene that was run.
    products : Mapping
        The outputs asked for, and the records and tables that say what became of the candidates; name to value.
    times : tuple of StageTime
        In the order of running.
    versions : Mapping
        Of Python, graphsynth and the third-party packages that were loaded.
    folder : Path or None
        Where the report was written.
    stages : tuple of Stage
        That ran, in order.
    notes : tuple of str
        What a reader must know: a budget that was used up, candidates taken over from an interrupted run.
    seconds : float
        Wall clock of the run; the stages of candidates that several processes share take longer together.
    """

    scene: Scene
    products: Mapping[str, Any]
    times: tuple[StageTime, ...]
    versions: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None
    stages: tuple[Stage, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    def __getitem__(self, product: str) -> Any:
        """Return one output.

        Raises
        ------
        SceneError
            If the scene did not ask for it.
        """
        if product not in self.products:
            raise SceneError(
                f"this run did not keep {product!r}; add it to [outputs] products (kept: {', '.join(self.products)})"
            )
        return self.products[product]


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


def _givers(stages: Iterable[Stage]) -> dict[str, Stage]:
    """Map each product to the one stage that gives it."""
    givers: dict[str, Stage] = {}
    for stage in stages:
        for product in stage.gives:
            if product in givers:
                raise SceneError(
                    f"product {product!r} is given by two stages, {givers[product].name!r} and {stage.name!r}"
                )
            givers[product] = stage
    return givers


def resolve(
    stages: Iterable[Stage],
    outputs: Sequence[str],
    place: Place | None = None,
) -> tuple[Stage, ...]:
    """Return the smallest set of stages that yields `outputs`, in an order in which each finds what it needs.

    Backward from the outputs; the order depends on `outputs` and `stages` alone. A product that none of `stages` gives
    may come from a stage that another package announces. `place` is where the outputs were named. A `SceneError` names
    an unknown output, a need that no stage gives, or the stages of a cycle.

    Examples
    --------
    >>> a, b, c = Stage("a", "m:a", (), ("x",)), Stage("b", "m:b", ("x",), ("y",)), Stage("c", "m:c", (), ("z",))
    >>> [stage.name for stage in resolve([c, b, a], ["y"])]
    ['a', 'b']
    """
    givers = _givers(stages)
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
            raise SceneError(
                f"{at}stages need each other: {' -> '.join([*path[path.index(giver.name) :], giver.name])}"
            )
        path.append(giver.name)
        for need in giver.needs:
            visit(need)
        path.pop()
        order.append(giver)

    for output in outputs:
        visit(output)
    return tuple(order)
