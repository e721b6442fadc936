"""A linkage in motion, drawn from the tracks of its joints: plates, bars and open circles that move by themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.drawing.moving import Moving
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import element, painted, words

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Bar:
    """A link with two joints: their names, a colour of the palette, a width in pixels."""

    start: str
    end: str
    colour: str = "link"
    width: float = 4.0


def linkage_animation(
    background: Sketch,
    tracks: Mapping[str, ArrayLike],
    *,
    bars: Sequence[Bar] = (),
    plates: Sequence[tuple[str, ...]] = (),
    joints: Sequence[str] = (),
    dots: Sequence[str] = (),
    notes: Mapping[str, Sequence[bool]] | None = None,
    seconds: float = 6.0,
    title: str = "",
) -> str:
    """Return one ``<svg>`` in which a linkage moves; it needs nothing else and no script.

    `background`: the part of the plane shown, and what does not move. `tracks`: places of every named joint, one for
    each frame, in the units of the sketch; a single place for a joint at rest. `bars`, `plates`, `joints`, `dots`:
    links with two joints, links with more (names of their corners), open circles, filled dots. `notes`: words written
    at the top left in those frames that are true. `seconds`: time of one pass. `title`: read out by screen readers.
    Raises `ValueError` if tracks differ in length or a place is not finite.

    >>> crank = np.exp(1j * np.linspace(0.0, 6.28, 5))
    >>> svg = linkage_animation(Sketch(-1 - 1j, 1 + 1j), {"O": 0j, "A": crank}, bars=[Bar("O", "A")], joints=["O", "A"])
    >>> svg.startswith("<svg"), svg.count("<path") > 0
    (True, True)
    """
    frames = _frames(background, tracks)
    drawing = Moving(background.width, background.height, seconds)
    for shape in background.ordered():
        drawing.fixed(element(shape, background.xy, background.scale, background.symbol))
    for corners in plates:
        drawing.path(_through(frames, corners), _paint("link", 2.6, "fill", 0.8), closed=True)
    for bar in bars:
        drawing.path(_through(frames, (bar.start, bar.end)), _paint(bar.colour, bar.width * background.symbol))
    for name in joints:
        drawing.circle(frames[name], 5.0 * background.symbol, _paint("link", 2.0, "paper"))
    for name in dots:
        drawing.circle(frames[name], 4.5 * background.symbol, painted("a"))
    for text, when in (notes or {}).items():
        drawing.shown(list(when), words(text, 12.0, 22.0, colour="ink"))
    return drawing.svg(title)


def _frames(background: Sketch, tracks: Mapping[str, ArrayLike]) -> dict[str, Points]:
    """Tracks on the page, all of the same length."""
    arrays = {name: np.atleast_1d(np.asarray(track, dtype=np.complex128)) for name, track in tracks.items()}
    count = max(len(array) for array in arrays.values())
    for name, array in arrays.items():
        if len(array) not in (1, count):
            raise ValueError(f"the track of {name} has {len(array)} places; give {count}, or one for a joint at rest")
        if not np.isfinite(array).all():
            raise ValueError(f"the track of {name} has a place that is not finite; show assembled positions only")
    return {
        name: np.array([background.xy(complex(point)) for point in np.broadcast_to(array, count)])
        for name, array in arrays.items()
    }


def _through(frames: Mapping[str, Points], names: Sequence[str]) -> Points:
    return np.stack([frames[name] for name in names], axis=1)


def _paint(stroke: str, width: float, fill: str = "", opacity: float = 1.0) -> str:
    return f'{painted(fill, stroke, width, opacity=opacity)} stroke-linecap="round" stroke-linejoin="round"'
