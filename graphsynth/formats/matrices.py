"""Plain text of small whole numbers with a head of ``# name value`` lines: edge lists and matrices, and their arrays.

An edge list has one joint ``a b`` or ``a b mobility`` on a line.  Matrices hold joint mobilities, 0 where there is no
joint, one row per line; brackets and commas are read as spaces, so that a matrix can be pasted from other programs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked
from graphsynth.core.errors import FormatError, GraphError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX

#: Characters of a text; larger graphs need a sparse format.
LENGTH_MAX = 4_000_000
#: Lines of a text, comments and empty ones too.
LINES_MAX = 100_000
#: Numbers on a line: an incidence matrix has a column for every joint.
WORDS_MAX = LINKS_MAX * (LINKS_MAX - 1) // 2
_HEAD = re.compile(r"#\s*+(links|frame|space)\s*+[=:]?\s*+([0-9]{1,4})\s*+", re.ASCII)
_NUMBERS = re.compile(r"(?:[0-9]{1,4}+(?:\s++|\Z))*+", re.ASCII)
_NUMBER = re.compile(r"[0-9]{1,4}", re.ASCII)


class NumberRow(NamedTuple):
    """The numbers of a line, and which line it is."""

    numbers: list[int]
    place: str


def head_of(graph: MechanismGraph) -> str:
    """Lines that say what rows of numbers cannot."""
    frame = "" if graph.frame is None else f"# frame {graph.frame}\n"
    return f"# links {graph.links}\n{frame}# space {graph.space}\n"


def read_rows(text: str, most: int, opening: str = "") -> tuple[dict[str, int], list[NumberRow]]:
    """Return the head and the rows, at most ``most``; ``opening`` are characters read as spaces besides commas.

    `FormatError` for a text too long, too many rows, a word that is not a whole number, something said twice.
    """
    if len(text) > LENGTH_MAX:
        raise FormatError(f"{len(text)} characters; at most {LENGTH_MAX} are read", "length")
    spaces = str.maketrans(dict.fromkeys(",;" + opening, " "))
    head: dict[str, int] = {}
    rows: list[NumberRow] = []
    lines = text.split("\n", LINES_MAX)
    if len(lines) > LINES_MAX:
        raise FormatError(f"more than {LINES_MAX} lines; no mechanism graph needs so many", f"line {LINES_MAX + 1}")
    for number, line in enumerate(lines, 1):
        if not line:
            continue
        place = f"line {number}"
        if line.lstrip().startswith("#"):
            match = _HEAD.fullmatch(line.strip())
            if match and match[1] in head:
                raise FormatError(f"{match[1]} is given twice", place)
            if match:
                head[match[1]] = int(match[2])
            continue
        numbers = _numbers(line.translate(spaces), place)
        if numbers and len(rows) >= most:
            raise FormatError(f"more than {most} rows; no mechanism graph needs so many", place)
        if numbers:
            rows.append(NumberRow(numbers, place))
    return head, rows


def _numbers(line: str, place: str) -> list[int]:
    words = line.split(None, WORDS_MAX)
    if len(words) > WORDS_MAX:
        raise FormatError(f"more than {WORDS_MAX} numbers; no mechanism graph needs so many", place)
    if not _NUMBERS.fullmatch(line.lstrip()):
        for word in words:
            if not _NUMBER.fullmatch(word):
                raise FormatError(f"{word[:24]!r} is not a whole number", place)
    return [int(word) for word in words]


_DICTIONARY = re.compile(r"\{(?:'mobility': ([0-9]))?\}", re.ASCII)  # what networkx.write_edgelist puts behind an edge


def compose_edges(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write one graph."""
    for graph in graphs:
        rows = (f"{a} {b}\n" if mobility == 1 else f"{a} {b} {mobility}\n" for a, b, mobility in graph.joints)
        yield head_of(graph) + "".join(rows)


def parse_edges(text: str) -> list[MechanismGraph]:
    """Read one graph; without ``# links`` it has one link more than its highest number."""
    head, rows = read_rows(_DICTIONARY.sub(lambda match: match[1] or "", text), WORDS_MAX)
    for row in rows:
        if len(row.numbers) not in (2, 3):
            raise FormatError(f"a joint is 'a b' or 'a b mobility', not {len(row.numbers)} numbers", row.place)
    highest = max((max(row.numbers[:2]) for row in rows), default=-1)
    links = head.get("links", highest + 1)
    if links < 1:
        raise FormatError("no joint and no '# links N'; a graph has at least one link", "end")
    joints = [(row.numbers[0], row.numbers[1], row.numbers[2] if len(row.numbers) > 2 else 1) for row in rows]
    return [MechanismGraph(links, joints, frame=head.get("frame"), space=head.get("space", 3))]


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
    frame, space : int, optional
        As for :func:`graph_from_adjacency`.

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
        text = head_of(graph) + _rows(incidence_matrix(graph))
        if len(text) > LENGTH_MAX:
            most = f"{len(text)} characters, at most {LENGTH_MAX}"
            raise GraphError(f"the incidence matrix of this graph has {most}; use graphml")
        yield text


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


def _matrix(text: str) -> tuple[dict[str, int], list[NumberRow]]:
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
