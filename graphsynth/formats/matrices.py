"""Adjacency and incidence matrices of a mechanism graph, as arrays and as text.

Entries are joint mobilities: 0 where there is no joint.  As text, one row per line; frame and space stand in the head.
Brackets and commas are read as spaces, so that a matrix can be pasted from other programs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked
from graphsynth.core.errors import FormatError
from graphsynth.formats.lines import Row, head_of, read_rows, within
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX

Matrix = NDArray[np.int64]


@checked
def adjacency_matrix(graph: MechanismGraph) -> Matrix:
    """Return the symmetric matrix of joint mobilities, shape (links, links).

    Parameters
    ----------
    graph : MechanismGraph

    Returns
    -------
    ndarray of int, shape (links, links)
        Exact.

    Examples
    --------
    >>> adjacency_matrix(MechanismGraph(3, [(0, 1), (1, 2, 2)])).tolist()
    [[0, 1, 0], [1, 0, 2], [0, 2, 0]]
    """
    A = np.zeros((graph.links, graph.links), dtype=np.int64)
    for a, b, mobility in graph.joints:
        A[a, b] = A[b, a] = mobility
    return A


@checked
def incidence_matrix(graph: MechanismGraph) -> Matrix:
    """Return links against joints, shape (links, joints), joints in the order of ``graph.joints``.

    A column holds the mobility of its joint at its two links, 0 elsewhere.

    Parameters
    ----------
    graph : MechanismGraph

    Returns
    -------
    ndarray of int, shape (links, joints)
        Exact.
    """
    B = np.zeros((graph.links, len(graph.joints)), dtype=np.int64)
    for k, (a, b, mobility) in enumerate(graph.joints):
        B[a, k] = B[b, k] = mobility
    return B


def graph_from_adjacency(matrix: ArrayLike, *, frame: int | None = None, space: int = 3) -> MechanismGraph:
    """Build the graph of a symmetric matrix of joint mobilities (exact).

    Parameters
    ----------
    matrix : array_like, shape (links, links)
        Mobility of the joint between two links, 0 where there is none.
    frame : int, optional
        The fixed link; none by default.
    space : int, optional
        Mobility of the space; 3 is the plane.

    Returns
    -------
    MechanismGraph

    Raises
    ------
    FormatError
        A matrix that is not square and symmetric with zeros on the diagonal, or an entry that is no mobility.

    Examples
    --------
    >>> graph_from_adjacency([[0, 1, 1], [1, 0, 1], [1, 1, 0]], frame=0).to_text()
    'Bw f0'
    """
    A = _whole(matrix)
    if A.shape[0] != A.shape[1]:
        raise FormatError(f"{A.shape[0]} rows of {A.shape[1]} numbers; an adjacency matrix is square", "shape")
    bad = np.argwhere(A != A.T)
    if bad.size:
        i, j = map(int, bad[0])
        raise FormatError(f"entry ({i}, {j}) is {A[i, j]}, entry ({j}, {i}) is {A[j, i]}", f"row {i + 1}")
    if A.diagonal().any():
        i = int(np.flatnonzero(A.diagonal())[0])
        raise FormatError(f"link {i} is jointed to itself; the diagonal must be 0", f"row {i + 1}")
    pairs = np.argwhere(np.triu(A)).tolist()
    return MechanismGraph(len(A), [(i, j, int(A[i, j])) for i, j in pairs], frame=frame, space=space)


def graph_from_incidence(matrix: ArrayLike, *, frame: int | None = None, space: int = 3) -> MechanismGraph:
    """Build the graph of a matrix of links against joints (exact).

    Parameters
    ----------
    matrix : array_like, shape (links, joints)
        In each column the mobility of the joint, at its two links.
    frame : int, optional
        The fixed link; none by default.
    space : int, optional
        Mobility of the space; 3 is the plane.

    Returns
    -------
    MechanismGraph

    Raises
    ------
    FormatError
        A column without exactly two equal entries, two columns for one pair of links.
    """
    B = _whole(matrix)
    joints = []
    for k, column in enumerate(B.T):
        ends = np.flatnonzero(column)
        if len(ends) != 2 or column[ends[0]] != column[ends[1]]:
            raise FormatError("a joint has two equal entries, at the links it joins", f"column {k + 1}")
        joints.append((int(ends[0]), int(ends[1]), int(column[ends[0]])))
    return MechanismGraph(len(B), joints, frame=frame, space=space)


def _whole(matrix: ArrayLike) -> Matrix:
    """Return a matrix of small whole numbers that a graph can have."""
    try:
        M: NDArray[Any] = np.asarray(matrix)
    except (ValueError, TypeError, OverflowError):
        raise FormatError("the rows have different lengths", "shape") from None
    if M.ndim != 2 or not 1 <= M.shape[0] <= LINKS_MAX or M.shape[1] > LINKS_MAX * LINKS_MAX:
        raise FormatError(f"shape {M.shape}; a matrix has one row for each of 1 to {LINKS_MAX} links", "shape")
    if M.dtype.kind not in "biuf" or not np.isfinite(M).all() or (np.trunc(M) != M).any():
        raise FormatError("the entries must be whole numbers", "entries")
    if (M < 0).any() or (M > 5).any():
        raise FormatError(f"entries from {M.min()} to {M.max()}; a joint mobility is 1 to 5, 0 is no joint", "entries")
    return M.astype(np.int64)


def compose_adjacency(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write the adjacency matrix of one graph."""
    for graph in graphs:
        yield head_of(graph) + _rows(adjacency_matrix(graph))


def compose_incidence(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write the incidence matrix of one graph."""
    for graph in graphs:
        yield within(head_of(graph) + _rows(incidence_matrix(graph)), "incidence matrix")


def _rows(matrix: Matrix) -> str:
    return "".join(" ".join(map(str, row)) + "\n" for row in matrix.tolist())


def parse_adjacency(text: str) -> list[MechanismGraph]:
    """Read an adjacency matrix; anything else is a `FormatError`."""
    head, rows = _matrix(text)
    return [graph_from_adjacency([row.numbers for row in rows], frame=head.get("frame"), space=head.get("space", 3))]


def parse_incidence(text: str) -> list[MechanismGraph]:
    """Read an incidence matrix; anything else is a `FormatError`."""
    head, rows = _matrix(text)
    if not rows:  # links without joints
        return [MechanismGraph(head["links"], [], frame=head.get("frame"), space=head.get("space", 3))]
    return [graph_from_incidence([row.numbers for row in rows], frame=head.get("frame"), space=head.get("space", 3))]


def _matrix(text: str) -> tuple[dict[str, int], list[Row]]:
    """Return the head and rows of equal length; a bracket that closes ends a row."""
    head, rows = read_rows(text.replace("]", "\n") if "]" in text else text, LINKS_MAX, "[()")
    if not rows and "links" not in head:
        raise FormatError("no row of numbers", "end")
    if rows and head.get("links", len(rows)) != len(rows):
        raise FormatError(f"{len(rows)} rows, but the head says {head['links']} links", "head")
    for row in rows:
        if len(row.numbers) != len(rows[0].numbers):
            counts = f"{len(row.numbers)} numbers; the first row has {len(rows[0].numbers)}"
            raise FormatError(counts, row.place)
    return head, rows
