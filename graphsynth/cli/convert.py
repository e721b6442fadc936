"""``graphsynth convert``: graphs and mechanisms from one format to another."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, cast

from graphsynth.cli import console
from graphsynth.core.errors import GraphError, GraphsynthError, SpecError

if TYPE_CHECKING:
    import io

    from graphsynth.formats.registry import Item

PIPE = "-"


def run(options: argparse.Namespace) -> int:
    """Read a file or standard input, write a file or standard output."""
    from graphsynth.formats.registry import FORMATS, format_of, read_all, read_stream, write, write_text

    for name in (options.source_format, options.target_format):
        format_of("", name or next(iter(FORMATS)))
    for place, name, option in (
        (options.source, options.source_format, "--from"),
        (options.output, options.target_format, "--to"),
    ):
        if place == PIPE and name is None:
            raise SpecError(f"a pipe has no suffix: give its format with {option}, one of {', '.join(FORMATS)}")
    if options.source == PIPE:
        stdin = cast("io.BufferedIOBase", sys.stdin.buffer)
        items = read_stream(stdin, options.source_format, "standard input")
    else:
        items = read_all(options.source, options.source_format)
    if options.graphs:
        items = (item.graph if hasattr(item, "graph") else item for item in items)
    if options.output == PIPE:
        for one in items if format_of("", options.target_format).feed == "lines" else (items,):
            sys.stdout.write(write_text(one, options.target_format))
        return 0
    path = Path(options.output)
    if path.is_dir():
        raise GraphsynthError(f"{path} is a folder; name a file")
    if not path.parent.is_dir():
        raise GraphsynthError(f"{path}: the folder {path.parent} does not exist; make it first")
    if path.exists() and not options.force:
        raise GraphsynthError(f"{path} exists; choose another name, or replace it with --force")
    entry = format_of(path, options.target_format)
    count = write(_some(items, options.source), path, entry.name)
    if options.json:
        console.put_json({"file": str(path), "format": entry.name, "count": count})
    else:
        console.note(f"{count} written to {path} ({entry.name})")
    return 0


def _some(items: Iterator[Item], source: str) -> Iterator[Item]:
    """Pass items on; refuse a source without any."""
    empty = True
    for item in items:
        empty = False
        yield item
    if empty:
        raise GraphError(f"{source} holds no graph; nothing is written")
