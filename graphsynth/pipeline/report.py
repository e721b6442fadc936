"""The report of a run: a summary on the terminal, and a folder with a page, a table and the scene as it was run."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.core.errors import SceneError
from graphsynth.core.journal import writing
from graphsynth.pipeline.measure import costs
from graphsynth.pipeline.page import report_html
from graphsynth.pipeline.store import JOURNAL, REMEDY, data_files, mark_reported, write_whole
from graphsynth.pipeline.summary import facts, sentences, summary_tables

if TYPE_CHECKING:
    from rich.console import Console, Group
    from rich.text import Text

    from graphsynth.pipeline.products import Table
    from graphsynth.pipeline.stages import Report

_KINDS = {".html", ".csv", ".parquet", ".json", ".jsonl"}


def write_report(report: Report, folder: Path) -> Path:
    """Write ``report.html``, ``scene.json`` and, of records and columns, CSV and Parquet; return the folder.

    Each file appears whole or not at all: it is written beside its place and then moved there.
    """
    files = {"report.html": report_html(report).encode(), "scene.json": scene_json(report).encode()}
    files |= data_files(report)
    with writing(f"the report into {folder}", REMEDY, SceneError):
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in files.items():
            write_whole(folder / name, data)
        mark_reported(folder / JOURNAL)
    return folder


def scene_json(report: Report) -> str:
    """Return the scene as read, versions, seed and times as JSON."""
    scene = report.scene
    content = {
        "scene": scene.raw,
        "source": scene.source,
        "sha256": scene.digest or None,
        "seed": scene.scene.seed,
        "versions": dict(report.versions),
        "platform": f"{platform.system()} {platform.machine()}",
        "seconds": round(report.seconds, 6),
        "stages": [{"stage": time.stage, **costs(time)} for time in report.times],
        "notes": list(report.notes),
    }
    return json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n"


def print_summary(report: Report, console: Console, tables: Sequence[Table] | None = None) -> None:
    """Print the summary of a run on a rich console: the answer, the tables, and where the files are.

    The answer stands first; on a terminal that shows only the end of a long report it is said again at the end.
    ``tables``: those to show, if not all.
    """
    from rich.markup import escape

    tones = {True: "green", False: "red", None: "default"}
    answer = [f"[yellow]{escape(text)}[/yellow]" for text in report.notes]
    answer += [f"[{tones[told.good]}]{escape(told.text)}[/]" for told in sentences(report)]
    answer.append(" · ".join(f"[bold]{escape(fact.value)}[/bold] {escape(fact.text)}" for fact in facts(report)))
    for line in (f"[bold]{escape(report.scene.scene.title)}[/bold]", *answer):
        console.print(line, highlight=False)
    shown = [_fitted(table, console.width) for table in (summary_tables(report) if tables is None else tables)]
    for table in shown:
        console.print(table)
    room = console.height - 1 - len(answer)
    if console.is_terminal and sum(len(console.render_lines(table)) for table in shown) > room:
        for line in ("", *answer):
            console.print(line, highlight=False)
    if report.folder is not None:
        names = sorted(path.name for path in report.folder.iterdir() if path.suffix in _KINDS)
        console.print(f"Report: {escape(str(report.folder))} ({', '.join(names)})")


#: Words up to this length are not broken on the terminal; longer ones are keys and digests.
_WORD = 24


def _fitted(table: Table, width: int) -> Group | Text:
    """Lay out a table so that no word or number is broken; where that cannot be, say where the table is."""
    from rich.box import HEAVY_HEAD, SIMPLE_HEAD
    from rich.console import Group
    from rich.markup import escape
    from rich.table import Table as Grid
    from rich.text import Text

    count = len(table.columns)
    framed, bare = (column_widths(table, width - used) for used in (3 * count + 1, 2 * count - 1))
    if bare is None:
        size = f"{len(table.rows)} x {count} cells"
        return Text.assemble((table.title, "italic"), f"\n{size} are too wide for this terminal; see report.html.")
    shown = Grid(box=HEAVY_HEAD) if framed else Grid(box=SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0))
    shown.show_header = any(table.columns)
    for column, columns in zip(table.columns, framed or bare, strict=True):
        shown.add_column(escape(column), overflow="fold", width=columns)
    for row in table.rows:
        shown.add_row(*map(escape, row))
    note = (Text(table.note, "dim"),) if table.note else ()
    # not as title and caption: these are as narrow as the table
    return Group(Text(table.title, "italic"), shown, *note)


def column_widths(table: Table, room: int) -> list[int] | None:
    """Share the room of a line among the columns of a table so that no word is broken; None if it does not suffice.

    >>> from graphsynth.pipeline.products import Table
    >>> table = Table("", ("name", "what it means"), (("12345678", "ten words or so"),))
    >>> column_widths(table, 40), column_widths(table, 20), column_widths(table, 12)
    ([8, 15], [8, 12], None)
    """
    from rich.cells import cell_len

    texts = list(zip(table.columns, *table.rows, strict=True))
    least = [max((min(_WORD, cell_len(word)) for text in cell for word in text.split()), default=1) for cell in texts]
    most = [max(cell_len(line) for text in cell for line in text.splitlines() or [" "]) for cell in texts]
    wanted = [max(a, b) - a for a, b in zip(least, most, strict=True)]
    spare = room - sum(least)
    if spare < 0:
        return None
    for left, k in zip(range(len(least), 0, -1), sorted(range(len(least)), key=wanted.__getitem__)):
        share = min(wanted[k], spare // left)  # who wants little gets it all, the rest share alike
        least[k] += share
        spare -= share
    return least
