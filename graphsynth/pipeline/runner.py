"""Running a scene: only the stages its outputs need, in order, each imported on demand and measured."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from graphsynth.core.errors import SceneError
from graphsynth.core.ordered import check_executor
from graphsynth.pipeline.datafiles import check_files
from graphsynth.pipeline.journal import JOURNAL
from graphsynth.pipeline.measure import StageTime
from graphsynth.pipeline.parts import check_folder
from graphsynth.pipeline.report import loaded_versions, write_report
from graphsynth.pipeline.running import Running
from graphsynth.pipeline.scene import Scene, load_scene
from graphsynth.pipeline.stages import Context, Progress, Stage, resolve
from graphsynth.pipeline.tables import Place

__all__ = ["Report", "StageTime", "execute", "has_stream", "run"]


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
        If the scene cannot be read or asks for something no stage gives, or the folder cannot be written: this is tried
        before anything is computed.
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
    """Whether what the scene asks for takes candidates one by one, which several processes can share.

    Raises
    ------
    SceneError
        If it asks for something no stage gives.
    """
    return any(stage.each for stage in resolve(scene.stages(), scene.outputs.products, _place_of_products(scene)))


def _place_of_products(scene: Scene) -> Place:
    return scene.place / "outputs" / "products"


def execute(
    scene: str | Path | Scene,
    executor: Executor | None = None,
    progress: Progress | None = None,
    journal: Path | None = None,
    fresh: bool = False,
) -> Report:
    """Run a scene without writing a report; otherwise like :func:`run`.

    Parameters
    ----------
    journal : Path, optional
        The file where outcomes of candidates are kept as they come.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    check_executor(executor)
    check_files(scene)
    wanted = scene.outputs.products
    stages = resolve(scene.stages(), wanted, _place_of_products(scene))
    done = Running(stages, wanted, Context(scene, executor), progress, journal, fresh)
    products = done.run()
    return Report(
        scene,
        MappingProxyType(products),
        tuple(done.times),
        MappingProxyType(loaded_versions()),
        stages=done.stages,
        notes=tuple(done.notes),
        seconds=done.seconds,
    )
