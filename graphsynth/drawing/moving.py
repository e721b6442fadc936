"""Shapes of an SVG that move by themselves: every shape holds its own frames, no script runs.

All of them begin with the picture and take the same time, so the one clock of the ``<svg>`` keeps them in step however
slowly the page around it is read.  Readers who ask for reduced motion see the shapes as they stand at a chosen frame;
programs that show no motion see the first.  A linkage is drawn from the tracks of its joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.svg import element, number, painted, picture, words

Points = NDArray[np.float64]


class Moving:
    """A drawing on a page of ``width`` by ``height`` pixels, y down, some shapes of which move.

    `seconds`: time of one pass. `still`: frame shown to readers who ask for reduced motion.

    >>> from graphsynth.drawing.svg import painted
    >>> drawing = Moving(100.0, 50.0, 2.0)
    >>> drawing.circle([[10.0, 20.0], [90.0, 30.0]], 4.0, painted("a"))
    >>> drawing.svg("A dot").count("<animate ")
    2
    """

    def __init__(self, width: float, height: float, seconds: float, still: int = 0) -> None:
        self.width, self.height, self.seconds, self.frame = width, height, seconds, still
        self._moving: list[str] = []
        self._resting: list[str] = []

    def fixed(self, markup: str) -> None:
        """Add what does not move, in the order of drawing."""
        self._moving.append(markup)
        self._resting.append(markup)

    def path(self, frames: Sequence[Points] | Points, paint: str, *, closed: bool = False) -> None:
        """Add a line through points, shape (frames, points, 2)."""
        self._add("path", paint, d=[_data(points, closed) for points in frames])

    def circle(self, frames: Sequence[Sequence[float]] | Points, radius: float, paint: str) -> None:
        """Add a circle whose centre moves, shape (frames, 2)."""
        x, y = ([number(float(value)) for value in column] for column in np.asarray(frames, float).T)
        self._add("circle", f'r="{number(radius)}" {paint}', cx=x, cy=y)

    def box(self, x: Iterable[float], top: float, width: float, height: float, paint: str) -> None:
        """Add a rectangle that moves sideways; ``x`` are its left edges."""
        size = f'y="{number(top)}" width="{number(width)}" height="{number(height)}" {paint}'
        self._add("rect", size, x=[number(float(value)) for value in x])

    def _add(self, tag: str, same: str, **tracks: list[str]) -> None:
        """Add an element with attributes that stay the same, and some that change from frame to frame."""
        first, rest = (
            " ".join(f'{name}="{values[frame]}"' for name, values in tracks.items()) for frame in (0, self.frame)
        )
        moves = "".join(self._animate(name, values) for name, values in tracks.items())
        self._resting.append(f"<{tag} {rest} {same}/>")
        self._moving.append(f"<{tag} {first} {same}>{moves}</{tag}>")

    def carried(self, track: Points, markup: str, more: str = "") -> None:
        """Add a group that is shifted and turned as a whole.

        `track` (shape (frames, 2) or (frames, 3)): place of its origin in pixels, and its turn in degrees clockwise.
        `markup`: what is carried, drawn about the origin. `more`: attributes of the group.
        """
        moving = resting = markup
        for kind, columns, digits, extra in (("rotate", track[:, 2:], 2, ""), ("translate", track[:, :2], 1, more)):
            values = [" ".join(map(number, place)) for place in columns.round(digits).tolist()]
            if not values[0]:  # upright
                continue
            steps = self._animate("transform", values, f' type="{kind}"', "animateTransform")
            moving, resting = (
                f'<g{extra} transform="{kind}({values[frame]})">{inside}</g>'
                for frame, inside in ((0, moving + steps), (self.frame, resting))
            )
        self._moving.append(moving)
        self._resting.append(resting)

    def shown(self, when: Sequence[bool], markup: str) -> None:
        """Add something that is seen in some frames only."""
        # not visibility: Inkscape does not hand it down to what is in the group
        values = ["inline" if seen else "none" for seen in when]
        self._resting.append(f'<g display="{values[self.frame]}">{markup}</g>')
        steps = self._animate("display", values, ' calcMode="discrete"')
        self._moving.append(f'<g display="{values[0]}">{markup}{steps}</g>')

    def _animate(self, attribute: str, values: Sequence[str], more: str = "", element: str = "animate") -> str:
        if len(set(values)) == 1:
            return ""
        time = f'dur="{max(self.seconds, 1e-3):.3f}s" repeatCount="indefinite"'
        return f'<{element} attributeName="{attribute}" {time}{more} values="{";".join(values)}"/>'

    def svg(self, title: str) -> str:
        """Return one ``<svg class="gs">``, light or dark with the page."""
        if self._moving == self._resting:
            return picture(self._moving, self.width, self.height, title)
        body = [
            f'<g class="move">{"".join(self._moving)}</g>',
            f'<g class="rest" display="none">{"".join(self._resting)}</g>',
        ]
        return picture(body, self.width, self.height, title)


def _data(points: Points, closed: bool) -> str:
    return "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in np.asarray(points, float)) + ("Z" if closed else "")


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
) -> str:
    """Return one ``<svg>`` in which a linkage moves; it needs nothing else and no script.

    `background`: the part of the plane shown, and what does not move. `tracks`: places of every named joint, one for
    each frame, in the units of the sketch; a single place for a joint at rest. `bars`, `plates`, `joints`, `dots`:
    links with two joints, links with more (names of their corners), open circles, filled dots. `notes`: words written
    at the top left in those frames that are true. `seconds`: time of one pass.
    Raises `ValueError` if tracks differ in length or a place is not finite.

    >>> crank = np.exp(1j * np.linspace(0.0, 6.28, 5))
    >>> svg = linkage_animation(Sketch(-1 - 1j, 1 + 1j), {"O": 0j, "A": crank}, bars=[Bar("O", "A")], joints=["O", "A"])
    >>> svg.startswith("<svg"), svg.count("<path") > 0
    (True, True)
    """
    arrays = {name: np.atleast_1d(np.asarray(track, dtype=np.complex128)) for name, track in tracks.items()}
    count = max(len(array) for array in arrays.values())
    frames: dict[str, Points] = {}  # on the page, all of the same length
    for name, array in arrays.items():
        if len(array) not in (1, count):
            raise ValueError(f"the track of {name} has {len(array)} places; give {count}, or one for a joint at rest")
        if not np.isfinite(array).all():
            raise ValueError(f"the track of {name} has a place that is not finite; show assembled positions only")
        frames[name] = np.array([background.xy(complex(point)) for point in np.broadcast_to(array, count)])
    drawing = Moving(background.width, background.height, seconds)
    for shape in background.ordered():
        drawing.fixed(element(shape, background.xy, background.scale, background.symbol))
    for corners in plates:
        drawing.path(
            np.stack([frames[name] for name in corners], axis=1), _paint("link", 2.6, "fill", 0.8), closed=True
        )
    for bar in bars:
        ends = np.stack([frames[bar.start], frames[bar.end]], axis=1)
        drawing.path(ends, _paint(bar.colour, bar.width * background.symbol))
    for name in joints:
        drawing.circle(frames[name], 5.0 * background.symbol, _paint("link", 2.0, "paper"))
    for name in dots:
        drawing.circle(frames[name], 4.5 * background.symbol, painted("a"))
    for text, when in (notes or {}).items():
        drawing.shown(list(when), words(text, 12.0, 22.0, colour="ink"))
    return drawing.svg(background.title)


def _paint(stroke: str, width: float, fill: str = "", opacity: float = 1.0) -> str:
    return f'{painted(fill, stroke, width, opacity=opacity)} stroke-linecap="round" stroke-linejoin="round"'
