"""Building an index: pieces drawn anywhere, written in order by one writer, each kept when it is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.core.journal import Journal, Work, digest_of, writing
from graphsynth.core.ordered import check_executor, in_order
from graphsynth.core.wording import whole
from graphsynth.design.curves.families import Family, families
from graphsynth.design.curves.sampling import draw
from graphsynth.design.curves.stored import MANIFEST, ColumnFile, columns, rows_of, seal

#: Curves of a piece; fewest and most mechanisms drawn at once; draws without a curve after which a family is left.
_PIECE, _LEAST, _BATCH, _VAIN = 2000, 8, 128, 8
#: Share of the mechanisms with sliding joints among those of a number of links.
_SLIDING = 1.0 / 3.0
_JOURNAL = "building.jsonl"


@dataclass(frozen=True)
class Piece:
    """So many curves of a family, drawn from a stream of random numbers of their own."""

    family: Family
    number: int
    part: int
    count: int
    seed: int
    joints: int
    numbers: int


def make_piece(piece: Piece) -> dict[str, NDArray[Any]]:
    """Draw the curves of a piece; fewer only where a family hardly moves."""
    random = np.random.default_rng([piece.seed, piece.number, piece.part])
    kinds = columns(piece.joints, piece.numbers)
    found: list[dict[str, NDArray[Any]]] = []
    have, vain = 0, 0
    while have < piece.count and vain < _VAIN:
        drawn = draw(piece.family, min(_BATCH, max(_LEAST, piece.count - have)), random)
        vain = 0 if len(drawn.link) else vain + 1
        found.append(rows_of(drawn, piece.number, kinds))
        have += len(drawn.link)
    return {name: np.concatenate([rows[name] for rows in found])[: piece.count] for name in kinds}


def pieces_of(own: Sequence[Family], curves: int, seed: int) -> list[Piece]:
    """Cut an index into pieces: shares of numbers of links N as (N - 2)^2, in them alike for every family."""
    joints = max(len(family.design.graph.joints) for family in own)
    numbers = max(1, *(len(family.design.numbers) for family in own))
    kinds = [(family.design.graph.links, bool(family.sliders)) for family in own]
    shares = {}
    for links in {links for links, _ in kinds}:
        both = {sliding for count, sliding in kinds if count == links}
        for sliding in both:
            part = 1.0 if len(both) == 1 else _SLIDING if sliding else 1.0 - _SLIDING
            shares[links, sliding] = (links - 2) ** 2 * part / kinds.count((links, sliding))
    ends = np.rint(np.cumsum([shares[kind] for kind in kinds]) / sum(shares[kind] for kind in kinds) * curves)
    quotas = np.diff(ends.astype(int), prepend=0).tolist()
    return [
        Piece(family, number, part, min(_PIECE, quota - part * _PIECE), seed, joints, numbers)
        for number, (family, quota) in enumerate(zip(own, quotas))
        for part in range(-(-quota // _PIECE))
    ]


def build(
    folder: str | Path,
    curves: int = 1_000_000,
    *,
    links: Sequence[int] = (4, 6, 8),
    sliders: int = 2,
    seed: int = 0,
    shard: tuple[int, int] = (1, 1),
    executor: Executor | None = None,
    watch: Callable[[int, int], None] | None = None,
) -> Path:
    """Build an index of curves, or a shard of it, or go on with one; return the folder of the shard.

    Parameters
    ----------
    folder : path
        Of the index; every shard has a folder in it.
    curves : int
        Curves of all shards together, 1000 to 10^10.
    links : sequence of int
        Numbers of links, of 4, 6, 8 and 10.
    sliders : int
        Sliding joints of four-bars and six-bars, 0 to 2.
    seed : int
        The same gives the same bytes, whatever the number of workers.
    shard : (int, int)
        Shard i of m.
    executor : concurrent.futures.Executor, optional
        Who does the work; this process by default.
    watch : callable, optional
        Told the number of pieces done and of all.

    Raises
    ------
    SpecError
        A value out of its bounds, or another index in the folder.
    GraphsynthError
        A place that cannot be written; the same call goes on.
    """
    asked = _asked(curves, links, sliders, seed)
    i, m = (whole(number, "shard", 1, 10**6) for number in shard)
    if i > m:
        raise SpecError(f"shard {i}/{m} is behind the last; give shard i of m with i <= m")
    check_executor(executor)
    own = families(asked["links"], asked["sliders"])
    every = pieces_of(own, asked["curves"], asked["seed"])
    asked |= {"joints": every[0].joints, "numbers": every[0].numbers}
    place = Path(folder) / f"shard-{i:06d}-of-{m:06d}"
    work = Work(
        "curves",
        f"{curves} curves, links {', '.join(map(str, asked['links']))}, seed {seed}",
        digest_of(asked, i, m),
        remedy="give the same options, or name another folder",
        place="name another folder",
        foreign="belongs to an index of other curves",
        error=SpecError,
    )
    with writing(place, work.place):
        place.mkdir(parents=True, exist_ok=True)
    if (place / MANIFEST).exists():
        return _finished(place, asked)
    kinds = columns(asked["joints"], asked["numbers"])
    with Journal(place / _JOURNAL, work) as journal:
        _write(place, kinds, journal, every[i - 1 :: m], executor, watch)
        with writing(place, work.place):
            seal(place, {"asked": asked, "shard": [i, m]}, own, kinds)
        journal.remove()
    return place


def _asked(curves: int, links: Sequence[int], sliders: int, seed: int) -> dict[str, Any]:
    """Check what an index is asked to be."""
    wanted = sorted({whole(count, "links", 4, 10) for count in links})
    if not wanted or any(count % 2 for count in wanted):
        raise SpecError(f"links = {wanted} must be some of 4, 6, 8 and 10")
    return {
        "curves": whole(curves, "curves", 1000, 10**10),
        "links": wanted,
        "sliders": whole(sliders, "sliders", 0, 2),
        "seed": whole(seed, "seed", 0, 2**63),
    }


def _write(
    place: Path,
    kinds: dict[str, np.dtype[Any]],
    journal: Journal,
    mine: Sequence[Piece],
    executor: Executor | None,
    watch: Callable[[int, int], None] | None,
) -> None:
    """Draw the pieces that are not there yet, and write them behind the others."""
    done, rows = len(journal.entries), sum(map(int, journal.entries))
    with ExitStack() as stack:
        with journal.writing(place):
            files = {
                name: stack.enter_context(ColumnFile(place / f"{name}.npy", kind, rows)) for name, kind in kinds.items()
            }
        for number, found in enumerate(in_order(executor, make_piece, mine[done:]), done + 1):
            with journal.writing(place):
                for name, file in files.items():
                    file.append(found[name])
            journal.append(str(len(found["mechanism"])))
            if watch:
                watch(number, len(mine))
        for file in files.values():
            file.finish()


def _finished(place: Path, asked: dict[str, Any]) -> Path:
    """Return a shard that is there, if it is the one asked for."""
    from graphsynth.design.curves.stored import opened

    held = opened(place).manifest["asked"]
    if held != asked:
        told = ", ".join(f"{name} {held.get(name)}" for name in asked if held.get(name) != asked[name])
        raise SpecError(f"{place} holds an index with {told}; give the same options, or name another folder")
    with suppress(OSError):
        (place / _JOURNAL).unlink()
    return place
