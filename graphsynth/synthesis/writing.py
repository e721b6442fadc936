"""Writing long listings to a file that survives an interruption, and counting with a checkpoint.

Beside ``FILE`` stands ``FILE.progress`` until the work is done: the problem, the pieces written, the bytes they take.
A resumed run cuts the file back to whole pieces and goes on, so the result is the same to the byte.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from graphsynth.errors import FormatError, GraphsynthError, SpecError
from graphsynth.synthesis import parallel
from graphsynth.synthesis.problem import Piece, Problem, graphs_of_piece

__all__ = ["Step", "count_with_checkpoint", "shard_of", "write_listing"]


@dataclass(frozen=True)
class Step:
    """How far the work is.

    Attributes
    ----------
    graphs : int
        Graphs counted or written so far.
    done : float
        Share of the work done, 0..1, by the bounds on the pieces.
    """

    graphs: int
    done: float


def shard_of(pieces: Sequence[Piece], shard: tuple[int, int] | None) -> list[Piece]:
    """Return shard i of m (1 <= i <= m): a run of consecutive pieces; the shards one after the other are the whole.

    Raises
    ------
    SpecError
        For i out of 1..m.
    """
    if shard is None:
        return list(pieces)
    i, m = shard
    if m < 1 or not 1 <= i <= m:
        raise SpecError(f"shard {i}/{m} must be i/m with 1 <= i <= m")
    sums = list(accumulate(piece.weight for piece in pieces))
    if not sums:
        return []
    return [
        piece for piece, upto in zip(pieces, sums) if min(m, int((upto - piece.weight / 2) / sums[-1] * m) + 1) == i
    ]


def _signature(problem: Problem, shard: tuple[int, int] | None, form: str) -> str:
    return f"{problem.signature} {shard[0]}/{shard[1]} {form}" if shard else f"{problem.signature} 1/1 {form}"


def _read_progress(path: Path) -> dict[str, Any]:
    try:
        progress = json.loads(path.read_text())
        return {key: progress[key] for key in ("problem", "title", "pieces", "bytes", "graphs")}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FormatError(f"cannot be read as a progress file ({error}); delete it to start anew", str(path)) from None


def _write_progress(path: Path, **progress: Any) -> None:
    fresh = path.with_name(path.name + ".new")
    fresh.write_text(json.dumps(progress) + "\n")
    fresh.replace(path)


def _json_lines(piece: Piece) -> tuple[bytes, int]:
    lines = []
    for graph in graphs_of_piece(piece):
        record: dict[str, Any] = {"key": graph.key, "links": graph.links, "space": graph.space, "frame": graph.frame}
        record["joints"] = [list(joint) for joint in graph.joints]
        if graph.frame is not None:
            record["levels"] = [list(level) for level in graph.levels]
        lines.append(json.dumps(record) + "\n")
    return "".join(lines).encode(), len(lines)


def write_listing(
    problem: Problem,
    path: Path,
    *,
    shard: tuple[int, int] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    executor: Executor | None = None,
    watch: Callable[[Step], None] | None = None,
) -> int:
    """List a problem to a file, one graph a line; return the number of lines.

    Parameters
    ----------
    problem : Problem
        What to list.
    path : Path
        ``.jsonl`` gives JSON lines; anything else the text form (graph6 for chains of mobility-1 joints).
    shard : (int, int), optional
        Shard i of m.
    resume : bool
        Go on with an interrupted file of the same problem.
    overwrite : bool
        Replace a file that exists.
    executor : concurrent.futures.Executor, optional
        Who does the work; the bytes are the same for any.
    watch : callable, optional
        Called after each piece.

    Raises
    ------
    GraphsynthError
        If the file exists and is neither resumed nor overwritten, or belongs to another problem.
    """
    form = "jsonl" if path.suffix == ".jsonl" else "text"
    note = path.with_name(path.name + ".progress")
    signature = _signature(problem, shard, form)
    pieces = shard_of(problem.pieces(listing=True), shard)
    total = sum(piece.weight for piece in pieces) or 1.0
    start, size, graphs = _where_to_start(path, note, signature, problem.title, resume, overwrite)
    done = sum(piece.weight for piece in pieces[:start])
    rest = pieces[start:]
    if form == "jsonl":
        blocks: Iterator[tuple[bytes, int]] = parallel.in_order(executor, _json_lines, rest)
    else:
        blocks = parallel.texts(rest, executor)
    state = {"problem": signature, "title": problem.title}
    with path.open("r+b" if start else "wb") as file:
        file.truncate(size)
        file.seek(size)
        _write_progress(note, **state, pieces=start, bytes=size, graphs=graphs)
        for number, (piece, (data, lines)) in enumerate(zip(rest, blocks), start + 1):
            file.write(data)
            file.flush()
            size += len(data)
            graphs += lines
            done += piece.weight
            _write_progress(note, **state, pieces=number, bytes=size, graphs=graphs)
            if watch:
                watch(Step(graphs, done / total))
    note.unlink()
    return graphs


def _where_to_start(
    path: Path, note: Path, signature: str, title: str, resume: bool, overwrite: bool
) -> tuple[int, int, int]:
    """Return (pieces, bytes, graphs) already written."""
    if not path.parent.is_dir():
        raise GraphsynthError(f"the folder {path.parent} does not exist: create it, or name another file")
    if resume and note.exists():
        progress = _read_progress(note)
        if progress["problem"] != signature:
            raise GraphsynthError(
                f"{note} belongs to another question ({progress['title']}): give the same options, or delete it"
            )
        if not path.exists() or path.stat().st_size < progress["bytes"]:
            raise GraphsynthError(f"{path} is shorter than {note} says ({progress['bytes']} bytes): delete both")
        return progress["pieces"], progress["bytes"], progress["graphs"]
    if resume and path.exists():
        raise GraphsynthError(f"{path} is complete, or was not written by graphsynth: nothing to resume")
    if note.exists() and not overwrite:
        raise GraphsynthError(f"{path} is an interrupted listing: go on with --resume, or start anew with --force")
    if path.exists() and not overwrite:
        raise GraphsynthError(f"{path} exists: name another file, or replace it with --force")
    return 0, 0, 0


def count_with_checkpoint(
    problem: Problem,
    *,
    shard: tuple[int, int] | None = None,
    checkpoint: Path | None = None,
    executor: Executor | None = None,
    watch: Callable[[Step], None] | None = None,
) -> int:
    """Count a problem; with a checkpoint file the pieces already counted there are not counted again (exact).

    Raises
    ------
    GraphsynthError
        If the checkpoint belongs to another problem.
    """
    pieces = shard_of(problem.pieces(listing=False), shard)
    total = sum(piece.weight for piece in pieces) or 1.0
    signature = _signature(problem, shard, "count")
    known = _read_counts(checkpoint, signature, problem.title) if checkpoint else []
    count = sum(known)
    done = sum(piece.weight for piece in pieces[: len(known)])
    rest = pieces[len(known) :]
    file = checkpoint.open("a") if checkpoint else None
    try:
        if file and not known and file.tell() == 0:
            file.write(json.dumps({"problem": signature, "title": problem.title}) + "\n")
        for piece, found in zip(rest, parallel.counts(rest, executor)):
            count += found
            done += piece.weight
            if file:
                file.write(f"{found}\n")
                file.flush()
            if watch:
                watch(Step(count, done / total))
    finally:
        if file:
            file.close()
    return count


def _read_counts(checkpoint: Path, signature: str, title: str) -> list[int]:
    if not checkpoint.exists():
        return []
    data = checkpoint.read_text()
    whole = data[: data.rfind("\n") + 1]  # a line cut short by a crash does not count
    if whole != data:
        checkpoint.write_text(whole)
    lines = whole.splitlines()
    if not lines:
        return []
    try:
        head = json.loads(lines[0])
        owner, counts = head["problem"], [int(line) for line in lines[1:]]
    except (ValueError, KeyError, TypeError):
        raise FormatError("is not a checkpoint of graphsynth; name another file", str(checkpoint)) from None
    if owner != signature:
        raise GraphsynthError(
            f"{checkpoint} belongs to another question ({head.get('title')}), not to {title}: name another file"
        )
    return counts
