"""The files of an index: one folder for every shard, in it one numpy array for every column, and a manifest.

Schema: docs/reference/design.md, "Files of an index".  Nothing is pickled; what does not fit is a `FormatError`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

import graphsynth
from graphsynth.core.errors import FormatError, GraphError
from graphsynth.core.wholefiles import replacing
from graphsynth.design.curves.families import Family
from graphsynth.design.curves.fourier import coefficients, halved, uniform, unit
from graphsynth.design.curves.sampling import Drawn
from graphsynth.structure.graph import MechanismGraph

FORMAT = "graphsynth-curves-1"
MANIFEST = "manifest.json"
#: Harmonics of curves over their arc length, and of motions over the input.
ARC, TIMED = 16, 8
#: Unit of stored coefficients.
STEP = 1.0 / 32767.0
_LICENCE = "CC0-1.0"


def columns(joints: int, numbers: int) -> dict[str, np.dtype[Any]]:
    """Columns of an index: names and types of one row."""
    mechanism = [
        ("family", "<u2"),
        ("link", "u1"),
        ("modes", "u1"),
        ("closed", "?"),
        ("inputs", "<f4", (2,)),
        ("point", "<f4", (2,)),
        ("places", "<f4", (joints, 2)),
        ("numbers", "<f4", (numbers,)),
    ]
    return {
        "arc": np.dtype(("<i2", (2 * ARC, 2))),
        "timed": np.dtype(("<i2", (2 * TIMED, 2))),
        "turn": np.dtype(("<i2", (2 * TIMED + 1, 2))),
        "mechanism": np.dtype(mechanism),
    }


def packed(found: NDArray[np.complex128]) -> NDArray[np.int16]:
    """Complex numbers of size 1 at most as pairs of whole numbers, in units of `STEP`."""
    return np.rint(np.stack([found.real, found.imag], axis=-1) / STEP).astype("<i2")


def unpacked(stored: NDArray[np.int16]) -> NDArray[np.complex64]:
    """Return what `packed` stored, in single precision."""
    return (np.ascontiguousarray(stored).astype(np.float32) * np.float32(STEP)).view(np.complex64)[..., 0]


def rows_of(drawn: Drawn, family: int, kinds: dict[str, np.dtype[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of drawn curves."""
    timed = uniform(drawn.curves, drawn.closed, drawn.samples, TIMED)
    turn = uniform(drawn.turns, drawn.closed, drawn.samples, TIMED)
    own = np.zeros(len(drawn.link), dtype=kinds["mechanism"])
    own["family"], own["link"], own["modes"], own["closed"] = family, drawn.link, drawn.modes, drawn.closed
    own["inputs"], own["point"] = np.stack([drawn.first, drawn.last], axis=1), drawn.point
    own["places"][:, : drawn.places.shape[1]] = drawn.places
    own["numbers"][:, : drawn.numbers.shape[1]] = drawn.numbers
    return {
        "arc": packed(unit(coefficients(halved(drawn.curves, drawn.closed, drawn.samples), drawn.closed, ARC))),
        "timed": packed(unit(np.delete(timed, TIMED, axis=1))),
        "turn": packed(turn),
        "mechanism": own,
    }


class ColumnFile:
    """An array on disk that grows by rows; ``rows`` says how many are there."""

    def __init__(self, path: Path, kind: np.dtype[Any], rows: int) -> None:
        self.path, self.kind, self.rows = path, kind, rows
        path.touch()
        self._stream: BinaryIO = path.open("r+b")
        size = len(self._header(0)) + rows * kind.itemsize
        if path.stat().st_size < size and rows:
            raise FormatError("is shorter than its journal says; delete the folder and build anew", str(path))
        self._stream.truncate(size)
        self._stream.seek(0)
        self._stream.write(self._header(rows))
        self._stream.seek(size)

    def _header(self, rows: int) -> bytes:
        """Head of a .npy file, of the same length for any number of rows."""
        base, shape = self.kind.subdtype or (self.kind, ())
        described = np.lib.format.dtype_to_descr(base)
        text = f"{{'descr': {described!r}, 'fortran_order': False, 'shape': {(rows, *shape)!r}, }}"
        length = -(-(10 + len(text) + 21) // 64) * 64
        return b"\x93NUMPY\x01\x00" + (length - 10).to_bytes(2, "little") + text.encode().ljust(length - 11) + b"\n"

    def append(self, values: NDArray[Any]) -> None:
        """Write rows behind the last."""
        self._stream.write(np.ascontiguousarray(values).tobytes())
        self._stream.flush()
        self.rows += len(values)

    def finish(self) -> None:
        """Write into the head how many rows there are."""
        self._stream.seek(0)
        self._stream.write(self._header(self.rows))
        self._stream.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    found = sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            found.update(block)
    return found.hexdigest()


def seal(folder: Path, about: dict[str, Any], own: list[Family], kinds: dict[str, np.dtype[Any]]) -> None:
    """Write the manifest of a finished shard."""
    files = {name: folder / f"{name}.npy" for name in kinds}
    document = {
        "format": FORMAT,
        "graphsynth": graphsynth.__version__,
        "licence": _LICENCE,
        **about,
        "rows": len(np.load(files["mechanism"], mmap_mode="r", allow_pickle=False)),
        "families": [[family.key, family.driven, list(family.sliders)] for family in own],
        "columns": {name: {"sha256": digest(path), "bytes": path.stat().st_size} for name, path in files.items()},
    }
    with replacing(folder / MANIFEST) as fresh:
        fresh.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


@dataclass(frozen=True, eq=False)
class Shard:
    """One shard of an index, its columns mapped into memory."""

    folder: Path
    manifest: dict[str, Any]
    families: tuple[Family, ...]
    columns: dict[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.columns["mechanism"])


def _family(key: str, driven: int, sliders: list[int]) -> Family:
    """Read a family; ValueError for one that is none."""
    own = Family(key, driven, tuple(sliders))
    graph = MechanismGraph.from_key(key)
    if graph.frame != 0 or not graph.neighbours[0] >> driven & 1 or not {*sliders} <= {*range(len(graph.joints))}:
        raise ValueError
    return own


def opened(folder: Path) -> Shard:
    """Open a finished shard; `FormatError` for anything else."""
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_bytes())
        if manifest["format"] != FORMAT:
            raise FormatError(f"is of the format {manifest['format']!r}, not {FORMAT}; build the index anew", str(path))
        rows, (i, m) = int(manifest["rows"]), map(int, manifest["shard"])
        own = tuple(_family(*about) for about in manifest["families"])
        sizes = {name: int(about["bytes"]) for name, about in manifest["columns"].items()}
        sums = [str(about["sha256"]) for about in manifest["columns"].values()]
        kinds = columns(int(manifest["asked"]["joints"]), int(manifest["asked"]["numbers"]))
        if not (own and len(sums) == len(kinds) and 1 <= i <= m):
            raise ValueError
    except (ValueError, LookupError, TypeError, RecursionError, GraphError, AttributeError) as error:
        if isinstance(error, FormatError) and error.place == str(path):
            raise
        raise FormatError("is not the manifest of an index of curves; build the index anew", str(path)) from error
    found = {}
    for name, kind in kinds.items():
        file = folder / f"{name}.npy"
        if name not in sizes or not file.is_file() or file.stat().st_size != sizes[name]:
            raise FormatError("is missing or not as long as the manifest says; copy it again or build anew", str(file))
        try:
            values = np.load(file, mmap_mode="r", allow_pickle=False)
        except (ValueError, EOFError, OSError) as error:
            raise FormatError("is not a numpy array; copy it again or build anew", str(file)) from error
        base, shape = kind.subdtype or (kind, ())
        if values.dtype != base or values.shape != (rows, *shape):
            raise FormatError(
                f"holds {values.dtype} in shape {values.shape}, not {base} in {(rows, *shape)}; build the index anew",
                str(file),
            )
        found[name] = values
    return Shard(folder, manifest, own, found)
