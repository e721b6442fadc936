"""``graphsynth accuracy``."""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryFile

from graphsynth.cli import console
from graphsynth.core.errors import SceneError


def run(options: argparse.Namespace) -> int:
    """Measure error against run time of every method of a scene; print what to choose."""
    from graphsynth.evidence.report import measure, summary, write_report
    from graphsynth.evidence.rows import Effort
    from graphsynth.pipeline.scene import load_scene
    from graphsynth.pipeline.stages import Context
    from graphsynth.pipeline.system import plans_of

    scene = load_scene(options.scene)
    plans = plans_of(scene.mechanism.module, structure=scene.structure is not None)
    if not plans:
        raise SceneError(
            f"{scene.place}: no numerical method is known for module = {scene.mechanism.module!r}; other packages add "
            "some through the entry points graphsynth.evidence"
        )
    folder = options.output or Path("graphsynth-out") / f"{scene.name}-accuracy"
    folder.mkdir(parents=True, exist_ok=True)
    try:  # refused now, not after a minute of measurements
        TemporaryFile(dir=folder).close()
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(folder)) from error
    effort = Effort(rounds=options.rounds, quick=options.quick)
    with console.counting() as progress:
        report = measure(Context(scene), plans, effort, progress)
    files = write_report(report, folder)
    if options.json:
        console.put_json({**report.document(), "folder": str(folder), "files": [file.name for file in files]})
    else:
        for line in summary(report):
            console.put(line)
        console.put(f"{len(report.to_pandas())} rows in {report.seconds:.0f} s: {folder / 'accuracy.html'}")
    if report.interrupted:
        console.note(f"what was measured before is kept in {folder}")
        raise KeyboardInterrupt
    return 0
