"""``graphsynth enumerate``."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Iterable
from io import BytesIO
from typing import TYPE_CHECKING

from graphsynth.cli import console
from graphsynth.cli.question import problem_of, special_of
from graphsynth.core.errors import GraphsynthError, SpecError, TooLargeError

if TYPE_CHECKING:
    from pathlib import Path

    from graphsynth.synthesis.problem import EnumerationProblem

BIG = 5e7  # labellings (before sparsity) from which all cores are used


def run(options: argparse.Namespace) -> int:
    """List to a file, or to standard output."""
    if options.json and (options.output is None or options.output.suffix.lower() not in (".jsonl", ".ndjson")):
        raise SpecError("--json needs -o FILE.jsonl here: the graphs go to the file, a summary to standard output")
    if options.output is None and (options.resume or options.force):
        raise SpecError("--resume and --force need -o FILE")
    from graphsynth.synthesis.problem import processes, texts
    from graphsynth.synthesis.shards import shard_of
    from graphsynth.synthesis.writing import write_listing

    begin = time.perf_counter()
    entry = _other_format(options.output) if options.output else None
    problem = problem_of(options)
    if options.sample is not None:
        from graphsynth.synthesis.sampling import sampled

        problem = sampled(problem, options.sample, options.seed)
    if problem.reason:
        console.note(f"nothing to list: {problem.reason}")
    items = problem.work_items(listing=True)
    with processes(console.workers_for(options.workers, sum(item.weight for item in items) > BIG)) as executor:
        blocks = (data for data, _ in texts(shard_of(items, options.shard), executor))
        if options.output is None:
            for data in blocks:
                sys.stdout.buffer.write(data)
            return 0
        if entry is not None and special_of(options):
            raise SpecError(f"{options.output.suffix} has no place for such joints: use .txt or .jsonl")
        if entry is not None and (options.resume or options.json):
            raise SpecError(
                f"{options.output.suffix} is written in one piece: use .g6 or .jsonl with --resume or --json"
            )
        if not options.force:
            _check_disk(problem, options)
        if entry is not None:
            graphs = _write_whole(blocks, options)
        else:
            try:
                with console.progress("listing") as watch:
                    graphs = write_listing(
                        problem,
                        options.output,
                        shard=options.shard,
                        resume=options.resume,
                        overwrite=options.force,
                        executor=executor,
                        watch=watch,
                    )
            except KeyboardInterrupt:
                console.note(f"{options.output} holds whole lines so far: go on with the same command and --resume")
                raise
    seconds = time.perf_counter() - begin
    if options.json:
        console.put_json(
            {"question": problem.title, "file": str(options.output), "count": graphs, "seconds": round(seconds, 3)}
        )
    else:
        console.note(f"{problem.title}: {graphs} graphs written to {options.output} ({seconds:.2f} s)")
    return 0


def _other_format(path: Path) -> str | None:
    """Return the name of a format that is not written line by line, None for lines of text or JSON.

    Raises `SpecError` for a suffix that names no format, or one that holds a single graph.
    """
    from graphsynth.formats.registry import FORMATS

    suffix = path.suffix.lower()
    if not suffix:
        return None
    entry = next((entry for entry in FORMATS.values() if suffix in entry.suffixes), None)
    if entry is None or not entry.many:
        able = ", ".join(suffix for other in FORMATS.values() if other.many for suffix in other.suffixes)
        why = "names no format of graphs" if entry is None else "holds one graph"
        raise SpecError(f"{path.name}: {path.suffix} {why}; use one of {able}")
    return None if entry.line else entry.name


def _write_whole(blocks: Iterable[bytes], options: argparse.Namespace) -> int:
    """Write all graphs in another format; the file appears when it is complete."""
    from graphsynth.formats.registry import read_stream, write

    if options.output.exists() and not options.force:
        raise GraphsynthError(f"{options.output} exists; choose another name, or replace it with --force")
    return write((graph for data in blocks for graph in read_stream(BytesIO(data), "text")), options.output)


def _check_disk(problem: EnumerationProblem, options: argparse.Namespace) -> None:
    """Refuse at once a listing that cannot fit the disk."""
    from graphsynth.synthesis.writing import estimated_size

    folder = options.output.absolute().parent
    free = shutil.disk_usage(folder).free if folder.is_dir() else 0
    if options.output.exists():
        free += options.output.stat().st_size
    graphs, needed = estimated_size(problem, options.output, options.shard, enough=free)
    if free and needed > free:
        wanted, there = (f"{n / 1e9:.3g} GB" if n >= 1e9 else f"{n / 1e6:.3g} MB" for n in (needed, free))
        raise TooLargeError(
            f"about {graphs:.2g} graphs need about {wanted}, and {there} are free for {options.output}: list a part "
            f"with --shard i/{int(needed / free) + 1}, name a file on another disk, or only count them; --force "
            "writes as much as fits",
            graphs,
        )
