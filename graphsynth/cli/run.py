"""``graphsynth run``."""

from __future__ import annotations

import argparse

from graphsynth.cli import console

__all__ = ["run"]


def run(options: argparse.Namespace) -> int:
    """Run a scene and print its summary."""
    from graphsynth.scenes.report import print_summary
    from graphsynth.scenes.runner import run as run_scene

    report = run_scene(options.scene, out=options.out)
    if options.json:
        console.put_json(
            {
                "scene": report.scene.scene.name,
                "folder": str(report.folder),
                "seconds": {time.stage: round(time.import_seconds + time.seconds, 3) for time in report.times},
            }
        )
        return 0
    from rich.console import Console

    print_summary(report, Console())
    return 0
