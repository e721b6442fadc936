"""What the verbs share: results on standard output, progress and notes on standard error, how many processes."""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from argparse import Namespace
    from concurrent.futures import Executor

    from rich.console import Console
    from rich.progress import Progress, ProgressColumn

    from graphsynth.synthesis.writing import Step


def put(text: str) -> None:
    """Print a result."""
    sys.stdout.write(text + "\n")


def put_json(document: Any) -> None:
    """Print a result as one JSON document."""
    put("".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in json.dumps(document, ensure_ascii=False)))


def columns() -> int | None:
    """Return the width of the terminal; None if there is none, and lines may have any length."""
    return shutil.get_terminal_size((0, 0)).columns or None


def wrapped(text: str, indent: int = 0) -> str:
    """Break a line between words where the terminal ends; what follows is indented."""
    width = columns()
    if width is None or len(text) <= width:
        return text
    return textwrap.fill(text, width, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)


def facts(rows: Iterable[tuple[str, str]]) -> None:
    """Print names and values in two columns; a name that is empty goes on with the one before."""
    rows = list(rows)
    wide = max((len(name) for name, _ in rows), default=0) + 2
    for name, value in rows:
        put(wrapped(f"{name:{wide}}{value}", wide))


def note(text: str) -> None:
    """Print a remark for people, one line whatever the terminal's width; nobody need be there to read it."""
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


def workers_for(asked: int | None, big: bool) -> int:
    """Return the number of worker processes: as asked, else all cores for big work and one for small."""
    if asked is not None:
        return asked
    return (os.cpu_count() or 1) if big else 1


def executor(
    options: Namespace, processes: Callable[[int], AbstractContextManager[Executor | None]], big: bool
) -> AbstractContextManager[Executor | None]:
    """Give the workers of a dask cluster or processes of this machine, as the options say; all cores for big work."""
    if (options.executor == "dask") != (options.scheduler is not None):
        raise SpecError("--executor dask and --scheduler ADDRESS go together; give both, or neither")
    if options.scheduler and options.workers:
        raise SpecError("--workers is for processes of this machine; a dask cluster has its own")
    if options.executor == "dask":
        from graphsynth.atlas.cluster import dask_executor

        return dask_executor(options.scheduler)
    return processes(workers_for(options.workers, big))


@contextmanager
def progress(what: str) -> Iterator[Callable[[Step], None] | None]:
    """Show count, rate and remaining time while standard error is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import TextColumn, TimeRemainingColumn

    graphs = TextColumn("{task.fields[graphs]:,} graphs, {task.fields[rate]:,.0f}/s")
    with _bar(graphs, TextColumn("left"), TimeRemainingColumn()) as bar:
        task = bar.add_task(what, total=1.0, graphs=0, rate=0.0)

        def watch(step: Step) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = step.graphs / elapsed if elapsed else 0.0
            bar.update(task, completed=step.done, graphs=step.graphs, rate=rate)

        yield watch


@contextmanager
def counting() -> Iterator[Callable[[str, int, int | None], None] | None]:
    """Show what is under way, how many are done and of how many, while standard error is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import MofNCompleteColumn

    with _bar(MofNCompleteColumn()) as bar:
        task = bar.add_task("starting", total=None)
        yield lambda name, done, total: bar.update(task, description=name, completed=done, total=total)


def _bar(counted: ProgressColumn, *after: ProgressColumn) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), counted, TimeElapsedColumn(), *after)
    return Progress(*columns, console=Console(stderr=True), transient=True)
