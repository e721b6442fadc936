"""Contracted graphs: what is left of a chain when every path of binary links becomes one edge.

They are the 2-connected loopless multigraphs of minimum degree 3 with a given number of independent loops
(``docs/explanation/enumeration.md``).  There are few of them, so the lists up to eight loops are shipped as package
data.  ``python -m graphsynth.synthesis.contracted LOOPS FOLDER`` makes the lists anew, or those for more loops; the
environment variable ``GRAPHSYNTH_CONTRACTED`` names a folder where lists for more than eight loops are looked for.
"""

from __future__ import annotations

import lzma
import os
import sys
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import FormatError, TooLargeError

SHIPPED_LOOPS = 8
#: With one loop more, graphs of so few vertices are made when they are asked for: some minutes and 0.7 GB at most.
MADE_VERTICES = 11
FOLDER_VARIABLE = "GRAPHSYNTH_CONTRACTED"
_MAGIC = b"gsH1"

Layers = dict[int, NDArray[np.uint8]]
"""Multiplicity matrices ``(graphs, k, k)`` by number of vertices k."""


def encode(layers: Layers) -> bytes:
    """Pack contracted graphs: for each k the upper triangles, transposed (like with like), then compressed."""
    parts = [_MAGIC, bytes([len(layers)])]
    for k, mults in sorted(layers.items()):
        upper = mults[:, *np.triu_indices(k, 1)]
        parts.append(bytes([k]) + len(mults).to_bytes(4, "little"))
        parts.append(np.ascontiguousarray(upper.T).tobytes())
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 9, "lc": 0, "lp": 0, "pb": 0}]
    return lzma.compress(b"".join(parts), format=lzma.FORMAT_XZ, filters=filters)


def decode(data: bytes) -> Layers:
    """Unpack what ``encode`` packed.

    Raises `FormatError` if the data are not a list of contracted graphs.
    """
    at, layers = 5, Layers()
    try:
        raw = lzma.decompress(data)
        if raw[:4] != _MAGIC:
            raise FormatError(f"starts with {raw[:4]!r}, expected {_MAGIC!r}")
        for _ in range(raw[4]):
            k, count = raw[at], int.from_bytes(raw[at + 1 : at + 5], "little")
            size = k * (k - 1) // 2 * count
            upper = np.frombuffer(raw, np.uint8, size, at + 5).reshape(-1, count).T
            at += 5 + size
            layers[k] = _from_upper(upper, k)
    except (lzma.LZMAError, IndexError, ValueError) as error:  # ValueError: FormatError, or fewer bytes than said
        raise FormatError(f"not a list of contracted graphs ({error}): make it anew", "contracted graphs") from None
    return layers


def _from_upper(upper: NDArray[np.uint8], k: int) -> NDArray[np.uint8]:
    """Return multiplicity matrices by their upper triangles, a row each."""
    mults = np.zeros((len(upper), k, k), np.uint8)
    rows, columns = np.triu_indices(k, 1)
    mults[:, rows, columns] = upper
    mults[:, columns, rows] = upper
    return mults


@lru_cache(maxsize=4)
def _layers(loops: int) -> Layers:
    name = f"contracted-{loops}.xz"
    if 2 <= loops <= SHIPPED_LOOPS:
        data = files("graphsynth.synthesis").joinpath("data", name).read_bytes()
    else:
        data = (Path(os.environ[FOLDER_VARIABLE]) / name).read_bytes()
    layers = decode(data)
    for k, mults in layers.items():
        if loops > SHIPPED_LOOPS and (mults.sum(axis=(1, 2), dtype=np.int64) != 2 * (loops + k - 1)).any():
            raise FormatError(f"holds graphs with other numbers of loops than {loops}: make it anew", name)
        mults.setflags(write=False)
    return layers


def has_contracted_graphs(loops: int, vertices: int | None = None) -> bool:
    """Tell whether the graphs of up to so many vertices (all, for None) are shipped, made by the user or soon made."""
    if loops <= SHIPPED_LOOPS:
        return True
    folder = os.environ.get(FOLDER_VARIABLE)
    if folder and (Path(folder) / f"contracted-{loops}.xz").is_file():
        return True
    return loops == SHIPPED_LOOPS + 1 and vertices is not None and vertices <= MADE_VERTICES


@lru_cache(maxsize=1)
def _known() -> dict[int, Layers]:
    return {loops: dict(_layers(loops)) for loops in range(2, SHIPPED_LOOPS + 1)}


def contracted_graphs(loops: int, vertices: int) -> NDArray[np.uint8]:
    """Return all contracted graphs with the given numbers of loops (at least 2) and vertices.

    Returns the multiplicity matrices, in the order of their canonical codes; shared and read-only. Raises
    `TooLargeError` for more loops than there are lists for.

    >>> [len(contracted_graphs(3, k)) for k in (2, 3, 4)]
    [1, 1, 2]
    """
    if loops < 2 or not has_contracted_graphs(loops, vertices):
        raise TooLargeError(
            f"there is no list of contracted graphs with {loops} loops (2..{SHIPPED_LOOPS} are shipped): make it with "
            f"'python -m graphsynth.synthesis.contracted {loops} FOLDER' and set {FOLDER_VARIABLE}=FOLDER"
        )
    if not has_contracted_graphs(loops):  # few vertices with one loop more than shipped: made once in a process
        found = generate(loops, vertices, _known())[loops][vertices]
        found.setflags(write=False)
        return found
    return _layers(loops).get(vertices, np.zeros((0, vertices, vertices), np.uint8))


def _unique_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the distinct rows in lexicographic order."""
    rows = np.ascontiguousarray(rows)
    keys = rows.view(np.dtype((np.void, rows.shape[1]))).ravel()
    return np.unique(keys).view(np.uint8).reshape(-1, rows.shape[1])


def generate(loops: int, vertices: int | None = None, smaller: dict[int, Layers] | None = None) -> dict[int, Layers]:
    """Make the contracted graphs with 2..loops loops and at most the given number of vertices, from the dipole up.

    Every 2-connected multigraph of minimum degree 3 on k > 2 vertices has two joined vertices whose merging leaves
    such a multigraph on k - 1 vertices (with as many loops less as there were parallel edges besides the first), so
    splitting vertices reaches all of them.

    ``loops``: largest number of loops; ``vertices``: largest number of vertices; default ``2 * (loops - 1)``, which
    makes the lists complete; ``smaller``: lists that are known already; completed in place and returned. Returns
    ``result[loops][vertices]``: the multiplicity matrices, in the order of their canonical codes.
    """
    from graphsynth.synthesis.kernels.splitting import split_all

    found: dict[int, Layers] = {} if smaller is None else smaller
    for v in range(2, loops + 1):
        layers = found.setdefault(v, {})
        dipole = np.array([[[0, v + 1], [v + 1, 0]]], np.uint8)
        layers.setdefault(2, dipole)
        for k in range(3, min(2 * (v - 1), vertices or 2 * (v - 1)) + 1):
            if k in layers:
                continue
            buffer = np.empty((1 << 18, k * (k - 1) // 2), np.uint8)
            codes = np.empty((0, buffer.shape[1]), np.uint8)
            for joined in range(1, v):
                parents = found[v - joined + 1].get(k - 1)
                at = 0
                while parents is not None and at < len(parents):
                    at, count = split_all(k - 1, parents, at, joined, v + 1, buffer)
                    codes = _unique_rows(np.concatenate([codes, _unique_rows(buffer[:count])]))
            layers[k] = _from_upper(codes, k)
    return found


def main(arguments: list[str]) -> int:
    """Make the lists for 2..LOOPS loops and write them to FOLDER."""
    if len(arguments) != 2 or not arguments[0].isdecimal() or not 2 <= int(arguments[0]) <= 10:
        sys.stderr.write("usage: python -m graphsynth.synthesis.contracted LOOPS FOLDER, with LOOPS from 2 to 10\n")
        return 2
    folder = Path(arguments[1])
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[int, Layers] = {}
    for loops in range(2, int(arguments[0]) + 1):
        found = generate(loops, smaller=found)
        data = encode(found[loops])
        (folder / f"contracted-{loops}.xz").write_bytes(data)
        count = sum(map(len, found[loops].values()))
        sys.stdout.write(f"{loops} loops: {count} contracted graphs, {len(data)} bytes\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
