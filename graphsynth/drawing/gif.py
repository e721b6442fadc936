"""Animations as GIF files: frames through matplotlib, one palette for all, written by Pillow."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.canvas import figure_of
from graphsynth.drawing.diagram import mechanism_sketch
from graphsynth.drawing.frames import Frames, frames_of
from graphsynth.drawing.palette import LIGHT

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion


def save_gif(
    motion: Motion,
    path: str | Path,
    *,
    frames: int = 60,
    title: str = "",
    seconds: float = 5.0,
    width: float = 440.0,
    height: float = 380.0,
) -> int:
    """Write an endless GIF of a motion.

    Parameters
    ----------
    motion : Motion
        One that does not close is shown to and fro over the part it reaches, with the reason underneath.
    path : path-like
    frames : int
        Pictures of one pass, 2..2000.
    title : str
        Written above the picture.
    seconds : float
        Time of one pass; a GIF counts hundredths of a second, and most viewers show at most 50 pictures a second.
    width, height : float
        Largest size of the picture in pixels.

    Returns
    -------
    int
        Number of pictures in the file.

    Raises
    ------
    GeometryError
        Nothing of the motion is assembled, or a number is out of its bounds.
    """
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise GeometryError(f"seconds = {seconds} must be positive and finite; give the time of one pass")
    shown = frames_of(motion, frames)
    pictures = _pictures(shown, title, width, height)
    passes = max(len(shown.poses) - 1, 1)
    duration = max(20, round(seconds / passes * 100.0) * 10)
    first, *rest = [pictures[k] for k in shown.order]
    first.save(
        Path(path),
        format="GIF",
        save_all=True,
        append_images=rest,
        duration=duration,
        loop=0,
        optimize=True,
        disposal=1,
    )
    return 1 + len(rest)


def _pictures(shown: Frames, title: str, width: float, height: float) -> list[Any]:
    """Draw every frame once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    sketch = mechanism_sketch(shown.mechanism, shown.poses, width=width, height=height)
    figure, (canvas,) = figure_of([sketch], [shown.poses[0].tolist()], above=title, below=_lines(shown, sketch.width))
    agg = FigureCanvasAgg(figure)
    found: list[Any] = []
    palette = _palette()
    for pose in shown.poses:
        canvas.move(pose.tolist())
        agg.draw()
        image = Image.fromarray(np.asarray(agg.buffer_rgba())).convert("RGB")
        found.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
    return found


def _palette() -> Any:
    """Every ink in seven steps to the paper, and the ink of links in steps to the fill of plates."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    inks = dict.fromkeys(LIGHT[name] for name in ("link", "soft", "note", "a", "b", "c", "d"))
    pairs = [(ink, LIGHT["paper"]) for ink in inks] + [(LIGHT["link"], LIGHT["fill"])]
    colours = dict.fromkeys(
        tuple(round(255 * (p * k + q * (6 - k)) / 6) for p, q in zip(to_rgb(ink), to_rgb(ground)))
        for ink, ground in pairs
        for k in range(7)
    )
    # Pillow looks colours up in boxes of eight: nothing may lie as close to the paper as the edge of a plate
    image = Image.new("P", (1, 1))
    image.putpalette([value for colour in colours for value in colour])
    return image


def _lines(shown: Frames, width: float) -> list[str]:
    return wrap(shown.note, max(20, int(width / 6.6))) if shown.note else []
