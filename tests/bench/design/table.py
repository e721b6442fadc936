"""Results of the trials: kept as CSV while they come, shown as tables and pictures."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
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
    """Markdown of the letters: Chamfer distances in parts of the size; who was not run has no column."""
    own = [trial.name for trial in EVERY[len(CLASSICAL) :] if (trial.name, "ours") in rows]
    peers = [by for by in ("evolution", "swarm") if any((name, by) in rows for name in own)]
    names = ["letter", NAMES["ours"], "proved", "links", "larger groups", NAMES["dyads"], "ratio"]
    names += [NAMES[by] for by in peers]
    lines = [f"| {' | '.join(names)} |\n|{'---|' * len(names)}"]
    for name in own:
        row, other = rows[name, "ours"], rows.get((name, "dyads"))
        found = math.isfinite(float(row["error"]))
        links, groups = (row["links"], "no" if row["dyadic"] == "yes" else "yes") if found else ("—", "—")
        cells = [name[-1], _cell(row), row["certified"] or "—", links, groups, _cell(other), _ratio(row, other)]
        lines.append(f"| {' | '.join([*cells, *(_cell(rows.get((name, by))) for by in peers)])} |")
    proved = sum(rows[name, "ours"]["certified"] == "yes" for name in own)
    every = [_median(rows, own, by) for by in ("ours", "dyads", *peers)]
    cells = ["median", every[0], f"{proved} of {len(own)}", "", "", every[1], "", *every[2:]]
    return "\n".join([*lines, f"| {' | '.join(cells)} |"])


def _ratio(row: Mapping[str, str], other: Mapping[str, str] | None) -> str:
    if other is None or not all(math.isfinite(float(one["error"])) for one in (row, other)):
        return "—"
    return _number(float(row["error"]) / float(other["error"]))


def _median(rows: Mapping[Key, Mapping[str, str]], names: Sequence[str], by: str) -> str:
    found = [float(rows[name, by]["error"]) for name in names if (name, by) in rows]
    return _number(float(np.median(found)) if found else math.nan)


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
    axes.set_xlabel(f"error in the unit of each task, at least {_LEAST:g}", color=LIGHT["ink"])
    legend = figure.legend(loc="outside upper center", ncols=5, frameon=False, columnspacing=1.0, handletextpad=0.2)
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
                z = np.asarray(z)[:: max(1, len(z) // (360 if trial.kind == "curve" else 80))]
                z = np.append(z, z[0]) if trial.kind == "curve" else z
                axes.plot(z.real, z.imag, color=LIGHT[colour], lw=wide)
        if trial.kind != "curve":
            axes.plot(goals.real, goals.imag, "o", color=LIGHT["jam"], ms=3)
        axes.set_aspect("equal")
        axes.set_axis_off()
        if trial.kind != "curve":
            axes.set_title(trial.title, fontsize=8, color=LIGHT["ink"])
    path.write_text(themed_svg(figure) + "\n", "utf-8")
