"""``graphsynth run``."""

from __future__ import annotations

import argparse
from pathlib import Path

from graphsynth.cli import console


def run(options: argparse.Namespace) -> int:
    """Run a scene and print its summary."""
    from graphsynth.core.ordered import processes
    from graphsynth.pipeline.runner import has_stream, run as run_scene
    from graphsynth.pipeline.scene import load_scene
    from graphsynth.pipeline.store import JOURNAL

    scene = load_scene(options.scene)
    folder = options.output or Path("graphsynth-out") / scene.name
    workers = console.workers_for(options.workers, has_stream(scene))
    try:
        with console.counting() as progress, processes(workers) as executor:
            report = run_scene(scene, folder, executor, progress, options.fresh)
    except KeyboardInterrupt:
        if (folder / JOURNAL).exists():
            console.note(f"what is done is kept in {folder / JOURNAL}; the same command goes on from there")
        raise
    from graphsynth.pipeline.measure import explain, explain_json
    from graphsynth.pipeline.report import print_summary

    if options.json:
        document = {
            "scene": scene.name,
            "folder": str(report.folder),
            "seconds": {time.stage: round(time.import_seconds + time.seconds, 3) for time in report.times},
            "run_seconds": round(report.seconds, 3),
            "notes": list(report.notes),
        }
        console.put_json(document | ({"explain": explain_json(report)} if options.explain else {}))
    elif options.explain:
        console.put(explain(report))
    else:
        print_summary(report, console.screen())
    return 0
