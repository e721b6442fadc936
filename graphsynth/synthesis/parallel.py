"""Doing pieces anywhere, and giving their results in the order of the pieces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from itertools import chain

from graphsynth.core import ordered
from graphsynth.core.ordered import AHEAD, in_order
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.problem import Piece, Problem, count_piece, graphs_of_piece, text_of_piece

__all__ = ["AHEAD", "counts", "graphs", "in_order", "processes", "texts"]


def _text(piece: Piece) -> tuple[bytes, int]:
    blocks = list(text_of_piece(piece))
    return b"".join(block for block, _ in blocks), sum(lines for _, lines in blocks)


def _packed(piece: Piece) -> list[MechanismGraph]:
    return list(graphs_of_piece(piece))


def counts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[int]:
    """Yield the number of graphs of each piece."""
    return in_order(executor, count_piece, pieces)


def texts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[tuple[bytes, int]]:
    """Yield each piece as (lines of the text form, number of lines)."""
    return in_order(executor, _text, pieces)


def graphs(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[MechanismGraph]:
    """Yield the graphs of all pieces, in order."""
    return chain.from_iterable(
        map(graphs_of_piece, pieces) if executor is None else in_order(executor, _packed, pieces)
    )


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Give a pool of worker processes, or None for one worker (then everything is done in this process).

    The kernels are compiled here first, so that the workers find them in the cache.  When the block is left by an
    exception (Ctrl-C), the workers are stopped at once; what was already written stays.
    """
    return ordered.processes(workers, _compile_kernels)


def _compile_kernels() -> None:
    smallest = Problem.chains(6, 1, 3, None, False, None)
    for piece in smallest.pieces(listing=False):
        count_piece(piece)
    for piece in smallest.pieces(listing=True):
        _text(piece)
