"""``graphsynth run``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.cli import console

if TYPE_CHECKING:
    from graphsynth.pipeline.stages import Report


def run(options: argparse.Namespace) -> int:
    """Run a scene and print its summary."""
    from graphsynth.pipeline.scene import load_scene
    from graphsynth.pipeline.store import JOURNAL

    scene = load_scene(options.scene)
    folder = options.out or Path("graphsynth-out") / scene.name
    try:
        report = _run(scene, folder, options)
    except KeyboardInterrupt:
        if (folder / JOURNAL).exists():
            console.note(f"what is done is kept in {folder / JOURNAL}; the same command goes on from there")
        raise
    if options.json:
        console.put_json(_document(report, options.explain))
        return 0
    if options.explain:
        from graphsynth.pipeline.measure import explain

        console.put(explain(report))
        return 0
    from graphsynth.pipeline.report import print_summary

    print_summary(report, console.screen())
    return 0


def _run(scene: Any, folder: Path, options: argparse.Namespace) -> Report:
    from graphsynth.core.ordered import processes
    from graphsynth.pipeline.runner import has_stream, run as run_scene

    with console.counting() as progress, processes(console.workers_for(options.workers, has_stream(scene))) as executor:
        return run_scene(scene, folder, executor, progress, options.fresh)


def _document(report: Report, explained: bool) -> dict[str, Any]:
    document: dict[str, Any] = {
        "scene": report.scene.scene.name,
        "folder": str(report.folder),
        "seconds": {time.stage: round(time.import_seconds + time.seconds, 3) for time in report.times},
        "run_seconds": round(report.seconds, 3),
        "notes": list(report.notes),
    }
    if explained:
        from graphsynth.pipeline.measure import explain_json

        document["explain"] = explain_json(report)
    return document
