"""Results of the trials: kept as CSV while they come, shown as tables and pictures."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.design.search import Result
from tests.bench.design.tasks import CLASSICAL, EVERY, Trial

#: Who competes, with the words of the table.
NAMES = {"ours": "graphsynth", "dyads": "dyads only", "evolution": "scipy DE", "swarm": "pylinkage"}
_COLUMNS = ("task", "by", "error", "certified", "links", "dyadic", "transmission_deg", "cpu_s", "note")
Key = tuple[str, str]


def read(path: Path) -> dict[Key, dict[str, str]]:
    """Return the rows of a file by task and competitor; none if there is no file."""
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {(row["task"], row["by"]): row for row in csv.DictReader(file)}


def add(path: Path, trial: Trial, by: str, result: Result) -> None:
    """Append a row."""
    new = not path.exists()
    proved = "" if result.certified is None else ("yes" if result.certified else "no")
    row = (
        trial.name, by, f"{result.error:.4g}", proved, result.links, "yes" if result.dyadic else "no",
        f"{result.transmission:.1f}", f"{result.seconds:.1f}", result.note,
    )  # fmt: skip
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(_COLUMNS)
        writer.writerow(row)


def tidy(path: Path) -> None:
    """Put the rows in the order of the trials."""
    rows = read(path)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[trial.name, by] for trial in EVERY for by in NAMES if (trial.name, by) in rows)


def _number(value: float) -> str:
    if math.isnan(value):
        return "—"
    return "none" if math.isinf(value) else ("0" if value == 0.0 else f"{value:.2g}")


def classical(rows: Mapping[Key, Mapping[str, str]]) -> str:
    """Markdown of the tasks one by one, each beside the best published value and the peers."""
    names = "task | error | published | graphsynth | proved | transmission | links | dyads only | scipy DE | pylinkage"
    lines = [f"| {names} |\n|{'---|' * 10}"]
    for trial in CLASSICAL:
        own = rows.get((trial.name, "ours"))
        if own is None:
            continue
        cells = {by: _cell(rows.get((trial.name, by))) for by in NAMES}
        if own["links"] == "4" and (trial.name, "dyads") not in rows:
            cells["dyads"] = "the same"
        best, _ = trial.published
        said = _number(best) if math.isfinite(best) else "none found"
        angle = "—" if own["transmission_deg"] == "nan" else f"{float(own['transmission_deg']):.0f}°"
        parts = (
            trial.title, trial.unit, said, cells["ours"], own["certified"] or "—", angle, own["links"], cells["dyads"],
            cells["evolution"], cells["swarm"],
        )  # fmt: skip
        lines.append(f"| {' | '.join(parts)} |")
    return "\n".join(lines)


def _cell(row: Mapping[str, str] | None) -> str:
    return "—" if row is None else _number(float(row["error"]))


def letters(rows: Mapping[Key, Mapping[str, str]]) -> str:
    """Markdown of the letters: Chamfer distance in parts of the size."""
    head = "| letter | graphsynth | proved | links | larger groups | dyads only | ratio | scipy DE | pylinkage |\n"
    lines = [head + "|---|---|---|---|---|---|---|---|---|"]
    for trial in EVERY[len(CLASSICAL) :]:
        own = rows.get((trial.name, "ours"))
        if own is None:
            continue
        cells = [_cell(rows.get((trial.name, by))) for by in NAMES]
        other = rows.get((trial.name, "dyads"))
        ratio = "—" if other is None else _number(float(own["error"]) / float(other["error"]))
        groups = "no" if own["dyadic"] == "yes" else "yes"
        parts = (trial.title[-1], cells[0], own["certified"] or "—", own["links"], groups, cells[1], ratio, *cells[2:])
        lines.append(f"| {' | '.join(parts)} |")
    lines.append(summary(rows))
    return "\n".join(lines)


def summary(rows: Mapping[Key, Mapping[str, str]]) -> str:
    """Return the medians over the letters as a row."""
    own = [trial.name for trial in EVERY[len(CLASSICAL) :] if (trial.name, "ours") in rows]

    def median(by: str) -> float:
        found = [float(rows[name, by]["error"]) for name in own if (name, by) in rows]
        return float(np.median(found)) if found else math.nan

    pairs = [(name, "dyads") for name in own if (name, "dyads") in rows]
    ratios = [float(rows[name, "ours"]["error"]) / float(rows[name, by]["error"]) for name, by in pairs]
    ratio = float(np.median(ratios)) if ratios else math.nan
    proved = sum(rows[name, "ours"]["certified"] == "yes" for name in own)
    cells = (_number(median("ours")), f"{proved} of {len(own)}", "", "", _number(median("dyads")), _number(ratio))
    return f"| median | {' | '.join((*cells, _number(median('evolution')), _number(median('swarm'))))} |"


def draw_errors(rows: Mapping[Key, Mapping[str, str]], path: Path) -> None:
    """Draw the errors of all over the best published value, or over the best of all where there is none."""
    from graphsynth.drawing.palette import LIGHT
    from graphsynth.drawing.plots import new_figure, themed_svg

    shown = [trial for trial in CLASSICAL if (trial.name, "ours") in rows]
    figure = new_figure((7.6, 0.32 * len(shown) + 1.3))
    axes = figure.add_subplot()
    marks = {"ours": ("o", "a"), "dyads": ("s", "b"), "evolution": ("^", "c"), "swarm": ("v", "d")}
    for by, (mark, colour) in marks.items():
        points = [
            (max(float(rows[trial.name, by]["error"]), _LEAST), k)
            for k, trial in enumerate(shown)
            if (trial.name, by) in rows and math.isfinite(float(rows[trial.name, by]["error"]))
        ]
        if points:
            axes.scatter(*zip(*points), marker=mark, s=34, color=LIGHT[colour], label=NAMES[by], zorder=3)
    published = [(max(t.published[0], _LEAST), k) for k, t in enumerate(shown) if math.isfinite(t.published[0])]
    if published:
        axes.scatter(*zip(*published), marker="|", s=220, color=LIGHT["ink"], label="best published", zorder=2)
    axes.set_xscale("log")
    axes.set_yticks(range(len(shown)), [f"{trial.title} ({trial.unit})" for trial in shown], color=LIGHT["ink"])
    axes.invert_yaxis()
    axes.tick_params(colors=LIGHT["ink"])
    axes.grid(True, axis="both", color=LIGHT["soft"], alpha=0.3, lw=0.6)
    axes.set_xlabel(f"error in the unit of each task; {_LEAST:g} stands for all that is less", color=LIGHT["ink"])
    legend = axes.legend(loc="lower left", bbox_to_anchor=(-0.45, 1.0), ncols=5, frameon=False)
    for text in legend.get_texts():
        text.set_color(LIGHT["ink"])
    path.write_text(themed_svg(figure) + "\n", "utf-8")


_LEAST = 1e-10


def draw_curves(trials: Iterable[Trial], curves: Mapping[str, Any], path: Path, columns: int) -> None:
    """Draw what is wanted and what the answers draw, one field for each trial; ``curves`` by "task by"."""
    from graphsynth.drawing.palette import LIGHT
    from graphsynth.drawing.plots import new_figure, themed_svg

    shown = [trial for trial in trials if f"{trial.name} ours" in curves and trial.goals is not None]
    rows = -(-len(shown) // columns)
    figure = new_figure((8.4, 8.4 / columns * rows))
    for k, trial in enumerate(shown):
        axes = figure.add_subplot(rows, columns, k + 1)
        goals = trial.goals
        assert goals is not None
        if trial.kind == "curve":
            axes.fill(goals.real, goals.imag, color=LIGHT["jam"], alpha=0.25, lw=0)
        for by, colour, wide in (("dyads", "b", 0.9), ("ours", "a", 1.4)):
            z = curves.get(f"{trial.name} {by}")
            if z is not None:
                z = np.asarray(z)[:: max(1, len(z) // 120)]
                z = np.append(z, z[0]) if trial.kind == "curve" else z
                axes.plot(z.real, z.imag, color=LIGHT[colour], lw=wide)
        if trial.kind != "curve":
            axes.plot(goals.real, goals.imag, "o", color=LIGHT["jam"], ms=3)
        axes.set_aspect("equal")
        axes.set_axis_off()
        if trial.kind != "curve":
            axes.set_title(trial.title, fontsize=8, color=LIGHT["ink"])
    path.write_text(themed_svg(figure) + "\n", "utf-8")
