"""What the verbs print: results on standard output, progress and notes on standard error."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

    from graphsynth.synthesis.writing import Step


def put(text: str) -> None:
    """Print a result."""
    sys.stdout.write(text + "\n")


def put_json(document: Any) -> None:
    """Print a result as one JSON document."""
    put("".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in json.dumps(document, ensure_ascii=False)))


def note(text: str) -> None:
    """Print a remark for people; nobody need be there to read it."""
    with suppress(OSError):
        sys.stderr.write(text + "\n")
    settle(sys.stderr)


def settle(stream: TextIO) -> None:
    """Write out what is left for a stream; if nobody takes it, it goes nowhere, as all that follows."""
    try:
        stream.flush()
    except OSError:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), stream.fileno())


def screen(width: int | None = None) -> Console:
    """Return a rich console on standard output; a reader who has seen enough raises BrokenPipeError, as elsewhere."""
    from rich.console import Console

    class Screen(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError  # rich itself would end the process with status 1

    return Screen(width=width)


def table(title: str, header: list[str], rows: list[list[str]]) -> None:
    """Print a table on standard output."""
    from rich.table import Table

    shown = Table(title=title, title_justify="left")
    for name in header:
        shown.add_column(name, justify="right")
    for row in rows:
        shown.add_row(*row)
    screen().print(shown)


@contextmanager
def progress(what: str) -> Iterator[Callable[[Step], None] | None]:
    """Show count, rate and remaining time while standard error is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[graphs]:,} graphs, {task.fields[rate]:,.0f}/s"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0, graphs=0, rate=0.0)

        def watch(step: Step) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = step.graphs / elapsed if elapsed else 0.0
            bar.update(task, completed=step.done, graphs=step.graphs, rate=rate)

        yield watch
