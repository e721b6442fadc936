"""Parts of a data set: chains and mechanisms of some pieces of a family as Parquet, made anywhere."""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import dataclass
from hashlib import sha256
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.atlas import facts
from graphsynth.atlas.building import is_planar
from graphsynth.atlas.making import Task, blocks_of
from graphsynth.core.extras import need

#: Bound on the labellings of a part; about a quarter of them are chains.
PART = 400_000.0
#: Chains that are compressed together: one of them is read in some milliseconds.
TOGETHER = 8192


@dataclass(frozen=True, slots=True)
class Job:
    """A part to make: its number in the family, its pieces, and whether mechanisms are listed."""

    number: int
    tasks: tuple[Task, ...]
    mechanisms: bool


@dataclass(frozen=True, slots=True)
class Part:
    """A part that was made: Parquet of each table (empty for no rows), numbers of rows, and labelled chains.

    ``labelled`` is the sum of ``links! / automorphisms``: how many chains there are with links that have names.
    """

    number: int
    tables: dict[str, bytes]
    rows: dict[str, int]
    labelled: int

    def record(self) -> dict[str, Any]:
        """Say what a manifest keeps of it."""
        sums = {name: sha256(data).hexdigest() for name, data in self.tables.items()}
        return {"part": self.number, "rows": self.rows, "labelled": str(self.labelled), "sha256": sums}


def jobs_of(tasks: list[Task], mechanisms: bool) -> list[Job]:
    """Join pieces of a family to parts, which depend on the family alone."""
    jobs: list[Job] = []
    own: list[Task] = []
    for task in tasks:
        if own and sum(one.piece.weight for one in own) + task.piece.weight > PART:
            jobs.append(Job(len(jobs), tuple(own), mechanisms))
            own = []
        own.append(task)
    return [*jobs, Job(len(jobs), tuple(own), mechanisms)]


def make_part(job: Job) -> Part:
    """Make a part (computed in the worker)."""
    rows, names = facts.Rows(), ("keys", "order", "orbits", "girth", "cuts", "count", "kinds", "types")
    columns: dict[str, list[Any]] = {name: [] for name in names}
    shapes: list[int] = []
    driven: list[tuple[NDArray[Any], ...]] = []
    start = 0
    for block in (block for task in job.tasks for block in blocks_of(task)):
        n = block.orbit.shape[1]
        orbits = (block.orbit == np.arange(n)).sum(axis=1)
        values = (block.keys, block.order, orbits, block.girth, block.cuts != 0, block.mechanisms)
        for column, value in zip(columns.values(), (*values, facts.assortments(block), facts.mobility_types(block))):
            column.append(np.array(value))
        shapes += facts.contracted_of(block, rows)
        if job.mechanisms:
            chains, frames, drives, structures = facts.mechanisms_of(block, rows)
            driven.append((start + chains, frames, drives, structures))
        start += len(block.keys)
    if not start:
        return Part(job.number, {}, {"chains": 0, "mechanisms": 0}, 0)
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    order = np.lexsort(whole["keys"].T[::-1])  # neighbours are alike: half the bytes
    links = job.tasks[0].links
    tables = {"chains": _chains(links, whole, shapes, rows, order)}
    count = 0
    if driven:
        mechanisms = [np.concatenate(parts) for parts in zip(*driven)]
        count = len(mechanisms[0])
        tables["mechanisms"] = _mechanisms(mechanisms, rows, np.argsort(order))
    return Part(job.number, tables, {"chains": start, "mechanisms": count}, labelled_of(links, whole["order"]))


def labelled_of(links: int, orders: NDArray[Any]) -> int:
    """Count chains whose links have names: ``links!`` over the order of each automorphism group."""
    return sum(times * (factorial(links) // order) for order, times in Counter(orders.tolist()).items())


def _chains(
    links: int,
    whole: dict[str, NDArray[Any]],
    shapes: list[int],
    rows: facts.Rows,
    order: NDArray[np.int64],
) -> bytes:
    contracted = list(rows.contracted)
    planar = np.array([is_planar(edges) for _, edges in contracted])
    vertices = np.array([size for size, _ in contracted], np.uint8)
    shape = np.array(shapes)[order]
    kinds, types = (_arrow().array(whole[name][order]).dictionary_encode() for name in ("kinds", "types"))
    return _parquet(
        {
            "graph6": facts.graph6_of(links, whole["keys"][order]),
            "assortment": kinds,
            "automorphisms": whole["order"][order],
            "inversions": whole["orbits"][order].astype(np.uint8),
            "mechanisms": whole["count"][order].astype(np.uint16),
            "girth": whole["girth"][order],
            "contracted_vertices": vertices[shape],
            "planar": planar[shape],
            "fractionated": whole["cuts"][order],
            "mobility_type": types,
        },
        {"graph6": "DELTA_LENGTH_BYTE_ARRAY"},
        together=TOGETHER,
    )


def _mechanisms(mechanisms: list[NDArray[Any]], rows: facts.Rows, place: NDArray[np.int64]) -> bytes:
    pa = _arrow()
    chains, frames, drives, structures = place[mechanisms[0]], *mechanisms[1:]
    order = np.lexsort((drives, frames, chains))
    groups = list(rows.groups)
    known = np.array(
        [
            (
                max((groups[at].group_class for at in own), default=1),
                max((groups[at].order for at in own), default=0),
                len(own),
                max((groups[at].links for at in own), default=0),
                facts.modes_of_all(groups[at].modes for at in own) or -1,
            )
            for own in rows.structures
        ],
        dtype=np.int64,
    )[structures[order]]
    names = {mask: str(facts.driven_text(mask)) for mask in set(drives.tolist())}
    return _parquet(
        {
            "chain": chains[order].astype(np.uint32),
            "frame": frames[order],
            "drivers": pa.array([names[mask] for mask in drives[order].tolist()]).dictionary_encode(),
            "class": known[:, 0].astype(np.uint8),
            "order": known[:, 1].astype(np.uint8),
            "groups": known[:, 2].astype(np.uint8),
            "largest_group": known[:, 3].astype(np.uint8),
            "modes": known[:, 4],
        },
        {"chain": "DELTA_BINARY_PACKED"},
    )


def _parquet(columns: dict[str, Any], encodings: dict[str, str], together: int | None = None) -> bytes:
    parquet = need("pyarrow.parquet", "parquet", "A data set")
    plain = [name for name in columns if name not in encodings]
    levels = {name: 19 if name == "graph6" else 6 for name in columns}  # graphs are half of the bytes
    out = io.BytesIO()
    looks = {"compression": "zstd", "compression_level": levels, "use_dictionary": plain, "column_encoding": encodings}
    parquet.write_table(_arrow().table(columns), out, row_group_size=together, **looks)
    return out.getvalue()


def _arrow() -> Any:
    return need("pyarrow", "parquet", "A data set")
