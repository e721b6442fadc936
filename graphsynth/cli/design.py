"""``graphsynth design``."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from graphsynth.cli import console
from graphsynth.core.errors import SpecError


def run(options: argparse.Namespace) -> int:
    """Search, write the report and the mechanisms, print the ranked answers; Ctrl-C ends the search, not the report."""
    from graphsynth.core.checks import positive
    from graphsynth.core.ordered import processes
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.pipeline.design.stages import write_mechanisms
    from graphsynth.pipeline.design.tables import DesignTable
    from graphsynth.pipeline.report import print_summary
    from graphsynth.pipeline.runner import run as run_scene
    from graphsynth.pipeline.scene import load_scene

    scene = load_scene(options.scene)
    if not isinstance(scene.mechanism, DesignTable):
        raise SpecError(
            f"{options.scene} is a scene of module {scene.mechanism.module!r}, not 'design'; use graphsynth run"
        )
    if options.seconds is not None:
        seconds = positive("--seconds", options.seconds, SpecError)
        scene = replace(scene, mechanism=replace(scene.mechanism, seconds=seconds, processor_seconds=None))
    kept = ("records", "tables", "mechanisms")
    products = (*scene.outputs.products, *(name for name in kept if name not in scene.outputs.products))
    scene = replace(scene, outputs=replace(scene.outputs, products=products))
    folder = options.output or Path("graphsynth-out") / scene.name
    if options.go_on:
        last = sorted(str(file.resolve()) for file in folder.glob("mechanism-*.toml"))
        scene = replace(scene, mechanism=replace(scene.mechanism, begin=(*scene.mechanism.begin, *last)))
    scene = replace(scene, mechanism=replace(scene.mechanism, kept=str(folder.resolve())))
    with console.counting() as progress, processes(console.workers_for(options.workers, True)) as executor:
        report = run_scene(scene, folder, executor, progress)
    files = write_mechanisms([Mechanism.from_json(text) for text in report["mechanisms"].columns["mechanism"]], folder)
    good = sum(record.good is True for record in report["records"])
    if options.json:
        answers = [
            {"key": record.key, "verdict": record.verdict, "reason": record.reason, "file": str(file)}
            | {margin.name: margin.value for margin in record.margins}
            for record, file in zip(report["records"], files)
        ]
        console.put_json({"scene": scene.name, "folder": str(report.folder), "accepted": good, "answers": answers})
    else:
        print_summary(report, console.screen(), report["tables"])
        if files:
            console.put(f"See them move: {folder / 'report.html'}")
        for record, file in zip(report["records"], files):
            found = {margin.name: margin.value for margin in record.margins}
            if "layers of sheets" in found:  # a size as in millimetres, else as large as a hand
                unit = 1 if 30 <= found["size"] <= 3000 else float(f"{200 / found['size']:.1g}")
                console.put(f"Make one, with a unit of length of {unit:g} mm: graphsynth parts {file} --unit {unit:g}")
                break
    return 0
