"""Running a scene: only the stages its outputs need, in order, each imported on demand and timed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from graphsynth.errors import SceneError
from graphsynth.scenes.report import loaded_versions, write_report
from graphsynth.scenes.scene import Scene, load_scene
from graphsynth.scenes.stages import Context, Progress, Stage, load, resolve

__all__ = ["Report", "StageTime", "execute", "run"]


@dataclass(frozen=True, slots=True)
class StageTime:
    """Wall-clock seconds a stage took to import and to run (estimated, one measurement)."""

    stage: str
    import_seconds: float
    seconds: float


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
    """

    scene: Scene
    products: Mapping[str, Any]
    times: tuple[StageTime, ...]
    versions: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None

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


def run(
    scene: str | Path | Scene,
    out: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Report:
    """Run a scene and write its report folder.

    Parameters
    ----------
    scene : str, Path or Scene
        A shipped scene by name, a TOML file by path, or a scene.
    out : str or Path, optional
        The folder for ``report.html``, ``results.csv`` and ``scene.json``; ``graphsynth-out/<scene>`` by default.
    executor : concurrent.futures.Executor, optional
        Handed to every stage in its context, for stages that can work in parallel; the shipped ones are quick and
        run here, so the result does not depend on it.
    progress : callable, optional
        Called as ``progress(stage, done, total)``.

    Returns
    -------
    Report
        With ``folder`` set.

    Raises
    ------
    SceneError, FormatError
        If the scene cannot be read or asks for something no stage gives.
    SpecError
        If the structural question makes no sense.
    """
    report = execute(scene, executor, progress)
    folder = Path(out) if out is not None else Path("graphsynth-out") / report.scene.name
    return replace(report, folder=write_report(report, folder))


def execute(scene: str | Path | Scene, executor: Executor | None = None, progress: Progress | None = None) -> Report:
    """Run a scene without writing anything; otherwise like :func:`run`."""
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    wanted = scene.outputs.products
    stages = resolve(scene.stages(), wanted, scene.place / "outputs")
    products, times = run_stages(stages, wanted, Context(scene, executor), progress)
    return Report(scene, MappingProxyType(products), times, MappingProxyType(loaded_versions()))


def run_stages(
    stages: tuple[Stage, ...], wanted: tuple[str, ...], context: Context, progress: Progress | None = None
) -> tuple[dict[str, Any], tuple[StageTime, ...]]:
    """Run resolved stages in order and return the wanted products and the times.

    A product nobody needs any more is dropped at once, so memory holds what is in use.
    """
    products: dict[str, Any] = {}
    times: list[StageTime] = []
    for done, stage in enumerate(stages):
        if progress:
            progress(stage.name, done, len(stages))
        products.update(_run_stage(stage, products, context, times))
        still_needed = {need for later in stages[done + 1 :] for need in later.needs} | set(wanted)
        products = {name: value for name, value in products.items() if name in still_needed}
    if progress:
        progress("done", len(stages), len(stages))
    return {name: products[name] for name in wanted}, tuple(times)


def _run_stage(stage: Stage, products: Mapping[str, Any], context: Context, times: list[StageTime]) -> dict[str, Any]:
    """Import and call one stage; append its times."""
    start = time.perf_counter()
    function = load(stage)
    imported = time.perf_counter()
    result = function(context, *(products[need] for need in stage.needs))
    times.append(StageTime(stage.name, imported - start, time.perf_counter() - imported))
    values = (result,) if len(stage.gives) == 1 else result
    if not isinstance(values, tuple) or len(values) != len(stage.gives):
        raise SceneError(f"stage {stage.name!r} says it gives {', '.join(stage.gives)} but returned something else")
    return dict(zip(stage.gives, values, strict=True))
