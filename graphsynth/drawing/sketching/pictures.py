"""Pictures of sketches in files, by suffix: SVG, PNG, PDF, TikZ, DXF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from graphsynth.core.errors import GraphsynthError
from graphsynth.drawing import canvas
from graphsynth.drawing.sketch import Sketch

#: Suffixes of pictures.
SUFFIXES = (".svg", ".png", ".pdf", ".tikz", ".tex", ".dxf")

Pose = Sequence[Sequence[float]]


def save(path: str | Path, sketches: Sequence[Sketch], poses: Sequence[Pose | None]) -> None:
    """Write sketches side by side as the suffix says.

    ``.svg``, ``.tikz`` (a picture to be read into a paper) and ``.tex`` (a document) need no other package; ``.png``
    and ``.pdf`` use matplotlib, ``.dxf`` ezdxf.

    `sketches`, `poses`: a pose for every sketch; None for one that does not move. Raises `GraphsynthError`: another
    suffix, several sketches in one DXF, a package that is not installed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise GraphsynthError(f"{path} must end in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    if suffix == ".dxf":
        from graphsynth.drawing.sketching.dxf import save_dxf

        if len(sketches) != 1:
            raise GraphsynthError("a DXF file holds one sketch; write each to its own")
        save_dxf(path, sketches[0], poses[0])
    elif suffix in (".tikz", ".tex"):
        from graphsynth.drawing.sketching.tikz import document, tikz

        pictures = [tikz(sketch, pose) for sketch, pose in zip(sketches, poses)]
        path.write_text(document(pictures) if suffix == ".tex" else "".join(pictures), "utf-8")
    else:
        canvas.save(path, sketches, poses)
