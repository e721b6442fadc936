"""Writing long listings to a file that survives an interruption, and counting with a checkpoint.

Beside ``FILE`` stands ``FILE.progress`` until the work is done: a journal with the bytes, the lines and a checksum of
each item.  A resumed run cuts the file back to whole items and goes on, so the result is the same to the byte.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.journal import Journal, Work, digest_of
from graphsynth.core.ordered import in_order
from graphsynth.structure.gear_trains import PlanetaryGearTrain
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.multiple_joints import MultipleJointChain
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.synthesis.chunks import Chunk
from graphsynth.synthesis.problem import EnumerationProblem, WorkItem, counts, graphs, texts, whole_sum
from graphsynth.synthesis.shards import run_of, shard_of
from graphsynth.synthesis.totals import Grown, Total

_SAMPLED = 16  # items made to estimate the size of a listing


@dataclass(frozen=True)
class Step:
    """How far the work is."""

    graphs: int  # graphs counted or written so far
    done: float  # share of the work done, 0..1, by the bounds on the items


def _work(
    problem: EnumerationProblem,
    items: Sequence[WorkItem | Total],
    form: str,
    remedy: str,
    again: str = "the same command",
) -> Work:
    """State what a journal is of: the question and its cut."""
    cut = [(repr(item.weight), *(getattr(item, name, 0) for name in ("start", "stop", "part"))) for item in items]
    return Work(form, problem.title, digest_of(problem.signature, form, cut), remedy=remedy, again=again)


def _json_line(chain: Any) -> str:
    record: dict[str, Any] = {"key": chain.key, "links": chain.links}
    if isinstance(chain, MechanismGraph):
        record |= {"space": chain.space, "frame": chain.frame, "joints": [list(joint) for joint in chain.joints]}
        if chain.frame is not None:
            record["levels"] = [list(level) for level in chain.levels]
    elif isinstance(chain, PlanetaryGearTrain):
        record |= {"frame": chain.frame, "axes": chain.axes, "gears": chain.gears}
    else:
        record |= {"frame": chain.frame, "joints": chain.joints}
    if isinstance(chain, SliderChain):
        record["sliders"] = chain.sliders
    if not isinstance(chain, MechanismGraph):  # chains of joints of mobility 1 alone have a catalogue
        record |= {"mobility": chain.mobility, "symmetries": chain.automorphism_order}
    if isinstance(chain, SliderChain | MultipleJointChain):
        graph = chain.graph if isinstance(chain, SliderChain) else chain
        record |= {"girth": graph.girth, "mobility_type": graph.mobility_type}
    return json.dumps(record) + "\n"


def _json_lines(item: WorkItem) -> tuple[bytes, int]:
    lines = [_json_line(item.chain(graph)) for graph in item.graphs()]
    return "".join(lines).encode(), len(lines)


def write_listing(
    problem: EnumerationProblem,
    path: Path,
    *,
    shard: tuple[int, int] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    executor: Executor | None = None,
    watch: Callable[[Step], None] | None = None,
) -> int:
    """List a problem to a file, one graph a line; return the number of lines.

    ``path``: ``.jsonl`` gives JSON lines; anything else the text form (graph6 for chains
    of mobility-1 joints); ``shard`` (int, int), optional: shard i of m; ``resume``: go on with an interrupted file of
    the same problem; of a complete one nothing is left to do; ``overwrite``: replace a file that exists;
    ``executor``: who does the work; the bytes are the same for any; ``watch``: called after each item. Raises
    `GraphsynthError` if the file exists and is neither resumed nor overwritten, or belongs to another problem.
    """
    form = _form(path)
    note = path.with_name(path.name + ".progress")
    items = shard_of(problem.work_items(listing=True), shard)
    if not path.parent.is_dir():
        raise GraphsynthError(f"the folder {path.parent} does not exist: create it, or name another file")
    if path.exists() and not note.exists() and not overwrite:
        if not resume:
            raise GraphsynthError(f"{path} exists: name another file, or replace it with --force")
        return _graphs_of_complete(path, items, form)
    remedy, again = "give the same options, or start anew with --force", "the same command with --resume"
    with Journal(note, _work(problem, items, form, remedy, again), fresh=overwrite and not resume) as journal:
        if journal.entries and not resume:
            raise GraphsynthError(f"{path} is an interrupted listing: go on with --resume, or start anew with --force")
        with journal.writing(path):
            file = path.open("r+b" if path.exists() else "w+b")
        with closing(file):
            with journal.writing(path):
                graphs = _cut_back(file, journal, len(items))
            done = sum(item.weight for item in items[: len(journal.entries)])
            total = sum(item.weight for item in items) or 1.0
            rest = items[len(journal.entries) :]
            for item, (data, lines) in zip(rest, _blocks(rest, form, executor)):
                with journal.writing(path):
                    file.write(data)
                    file.flush()
                journal.append(json.dumps([len(data), lines, zlib.crc32(data)]))
                graphs += lines
                done += item.weight
                if watch:
                    watch(Step(graphs, done / total))
            with journal.writing(path):
                os.fsync(file.fileno())
        journal.remove()
    return graphs


def _blocks(items: Sequence[WorkItem], form: str, executor: Executor | None) -> Iterator[tuple[bytes, int]]:
    return in_order(executor, _json_lines, items) if form == "jsonl" else texts(items, executor)


def estimated_size(
    problem: EnumerationProblem, path: Path, shard: tuple[int, int] | None = None, *, enough: float = 0.0
) -> tuple[float, float]:
    """Return about how many graphs, and bytes, a listing to a file has; their bounds if these bytes are enough.

    The bounds on the graphs are sure; items all over the listing, made for that, tell what share of them there is.
    What is made one by one (rings, fractionated chains) is little and left out.
    """
    chunks = [item for item in shard_of(problem.work_items(listing=True), shard) if isinstance(item, Chunk)]
    weight = sum(chunk.weight for chunk in chunks)
    links = max((chunk.family.links for chunk in chunks), default=1)
    form = _form(path)
    line = links * links / 12 + 24 if form == "text" else 60.0 * links  # bytes at most
    if weight * line <= enough or not chunks:
        return weight, weight * line
    chosen = chunks[:: max(1, len(chunks) // _SAMPLED)]
    made = [sum(lines for _, lines in chunk.texts()) for chunk in chosen]
    some = [(next(graphs([chunk], None)), chunk) for chunk, lines in zip(chosen, made) if lines]
    size = sum(
        len(_json_line(item.chain(graph))) if form == "jsonl" else len(graph.to_text()) + 1 for graph, item in some
    )
    number = weight * sum(made) / sum(chunk.weight for chunk in chosen)
    return number, number * size / max(len(some), 1)


def _form(path: Path) -> str:
    return "jsonl" if path.suffix.lower() in (".jsonl", ".ndjson") else "text"


def _cut_back(file: BinaryIO, journal: Journal, items: int) -> int:
    """Cut a file, and the journal of it, back to the whole items that are in it; return the number of its lines."""
    graphs = place = 0
    noted = [json.loads(entry) for entry in journal.entries[:items]]
    kept = 0
    for size, lines, check in noted:
        data = file.read(size)
        if len(data) < size or zlib.crc32(data) != check:
            break
        kept, place, graphs = kept + 1, place + size, graphs + lines
    journal.keep(kept)
    file.seek(place)
    file.truncate()
    return graphs


def _graphs_of_complete(path: Path, items: Sequence[WorkItem], form: str) -> int:
    """Return the number of lines of a file that is the whole listing, as far as its first and last lines tell.

    Raises `GraphsynthError` if it is not.
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        ends = [next((data for data, _ in _blocks(some, form, None) if data), b"") for some in (items, items[::-1])]
        for data, place in zip(ends, (0, size - len(ends[1]))):
            file.seek(max(0, place))
            if file.read(len(data)) != data or (size and not data):
                raise GraphsynthError(
                    f"{path} was not written by this question, or is not complete: name another file, or replace it "
                    "with --force"
                )
        file.seek(0)
        return sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b""))


def count_with_checkpoint(
    problem: EnumerationProblem,
    *,
    shard: tuple[int, int] | None = None,
    checkpoint: Path | None = None,
    executor: Executor | None = None,
    watch: Callable[[Step], None] | None = None,
) -> int | Fraction:
    """Count a problem; with a checkpoint file the items already counted there are not counted again (exact).

    The shards of chains that can only be counted together (nine loops) are fractions whose sum is the count.

    Raises `GraphsynthError` if the checkpoint belongs to another problem, or another process writes it. Raises
    `FormatError` if it is no checkpoint, or somebody changed it.
    """
    items = problem.parts()
    together = any(isinstance(item, Grown) for item in items)
    if shard:
        items = run_of(items, shard) if together else shard_of(problem.work_items(listing=False), shard, listing=False)
    total = sum(item.weight for item in items) or 1.0
    with Journal(checkpoint, _work(problem, items, "count", "name another file")) as journal:
        known = [Fraction(entry) for entry in journal.entries]
        count = sum(known, Fraction(0))
        done = sum(item.weight for item in items[: len(known)])
        rest = items[len(known) :]
        for item, found in zip(rest, counts(rest, executor)):
            count += found
            done += item.weight
            journal.append(str(found))
            if watch:
                watch(Step(int(count), done / total))
    return count if shard and together else whole_sum(count)
