"""Every trial for every competitor, at the same processor time: tables and pictures.

``python -m tests.bench.design --out FOLDER`` goes on where it stopped; ``--only vertical log`` runs some,
``--seconds 60`` gives all of them more time, of the processor: run it on one thread (``OMP_NUM_THREADS=1``).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from graphsynth.design import CurveIndex
from tests.bench.design import table
from tests.bench.design.peers import evolved, swarmed
from tests.bench.design.search import Result, ours
from tests.bench.design.tasks import CLASSICAL, EVERY, PATHS, Trial


def compete(trial: Trial, by: str, seconds: float, index: CurveIndex | None) -> Result | None:
    """Let one of them try; None where it would be the same as another, for all four-bars are dyadic."""
    if by == "evolution":
        return evolved(trial, seconds)
    if by == "swarm":
        return swarmed(trial, seconds)
    if by == "dyads" and max(trial.task(trial.tolerance).links) == 4:
        return None
    return ours(trial, seconds, only_dyads=by == "dyads", index=index)


def main() -> None:
    """Run what is asked and not there yet, then write the tables and pictures."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.design", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("design-benchmark"))
    parser.add_argument("--seconds", type=float, default=10.0, help="of the processor, for each task and competitor")
    parser.add_argument("--only", nargs="*", default=[trial.name for trial in EVERY], help="names of tasks")
    parser.add_argument("--by", nargs="*", default=list(table.NAMES), choices=list(table.NAMES))
    parser.add_argument("--curves", type=int, default=1_000_000, help="curves of the index with which paths begin")
    parser.add_argument("--index", type=Path, help="folder of an index that is there, instead of building one")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    results, drawn = given.out / "results.csv", given.out / "curves"
    drawn.mkdir(exist_ok=True)
    done, index = table.read(results), None
    for trial in EVERY:
        for by in given.by:
            if trial.name not in given.only or (trial.name, by) in done:
                continue
            if trial.kind in ("curve", "path", "timed") and by in ("ours", "dyads") and index is None:
                index = opened(given.index, given.out / "index", given.curves)
            found = compete(trial, by, given.seconds, index)
            if found is None:
                continue
            table.add(results, trial, by, found)
            print(f"{trial.name} {by}: {found.error:.3g}, {found.seconds:.1f} s {found.note}", flush=True)
            if found.curve is not None:
                np.save(drawn / f"{trial.name} {by}.npy", found.curve)
    write(given.out)


def opened(there: Path | None, place: Path, curves: int) -> CurveIndex:
    """Open an index that is there, or build one; look for a curve once, which is not part of a search."""
    index = CurveIndex.build(place, curves, links=[4, 6, 8], sliders=0) if there is None else CurveIndex(there)
    circle = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 33))
    for closed, timed in ((True, False), (False, False), (True, True)):
        index.find(np.stack([circle.real, circle.imag**3], axis=1), 1, closed=closed, timed=timed)
    return index


def write(folder: Path) -> None:
    """Write the tables and the pictures of a folder with results."""
    table.tidy(folder / "results.csv")
    rows = table.read(folder / "results.csv")
    (folder / "table.md").write_text(f"{table.classical(rows)}\n\n{table.letters(rows)}\n", "utf-8")
    table.draw_errors(rows, folder / "design-benchmark-errors.svg")
    curves = {path.stem: np.load(path) for path in (folder / "curves").glob("*.npy")}
    for name, trials, columns in (("paths", PATHS, 3), ("letters", EVERY[len(CLASSICAL) :], 7)):
        if any(f"{trial.name} ours" in curves for trial in trials):
            table.draw_curves(trials, curves, folder / f"design-benchmark-{name}.svg", columns)


if __name__ == "__main__":
    main()
