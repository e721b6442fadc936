"""Shapes of an SVG that move by themselves: every shape holds its own frames, no script runs.

Readers who ask for reduced motion see the shapes as they stand at a chosen frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from graphsynth.drawing.palette import STYLE
from graphsynth.drawing.svg import number, picture

__all__ = ["Moving"]

Points = NDArray[np.float64]


class Moving:
    """A drawing on a page of ``width`` by ``height`` pixels, y down, some shapes of which move.

    Parameters
    ----------
    width, height : float
    seconds : float
        Time of one pass.
    still : int
        Frame shown to readers who ask for reduced motion.

    Examples
    --------
    >>> drawing = Moving(100.0, 50.0, 2.0)
    >>> drawing.circle([[10.0, 20.0], [90.0, 30.0]], 4.0, 'fill="var(--a)"')
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
        data = [_data(points, closed) for points in frames]
        self._resting.append(f'<path d="{data[self.frame]}" {paint}/>')
        self._moving.append(f'<path d="{data[0]}" {paint}>{self._animate("d", data)}</path>')

    def circle(self, frames: Sequence[Sequence[float]] | Points, radius: float, paint: str) -> None:
        """Add a circle whose centre moves, shape (frames, 2)."""
        x, y = ([number(float(value)) for value in column] for column in np.asarray(frames, float).T)
        size = f'r="{number(radius)}" {paint}'
        self._resting.append(f'<circle cx="{x[self.frame]}" cy="{y[self.frame]}" {size}/>')
        moves = self._animate("cx", x) + self._animate("cy", y)
        self._moving.append(f'<circle cx="{x[0]}" cy="{y[0]}" {size}>{moves}</circle>')

    def box(self, x: Iterable[float], top: float, width: float, height: float, paint: str) -> None:
        """Add a rectangle that moves sideways; ``x`` are its left edges."""
        left = [number(float(value)) for value in x]
        size = f'y="{number(top)}" width="{number(width)}" height="{number(height)}" {paint}'
        self._resting.append(f'<rect x="{left[self.frame]}" {size}/>')
        self._moving.append(f'<rect x="{left[0]}" {size}>{self._animate("x", left)}</rect>')

    def shown(self, when: Sequence[bool], markup: str) -> None:
        """Add something that is seen in some frames only."""
        values = ["visible" if seen else "hidden" for seen in when]
        self._resting.append(f'<g visibility="{values[self.frame]}">{markup}</g>')
        steps = self._animate("visibility", values, ' calcMode="discrete"')
        self._moving.append(f'<g visibility="{values[0]}">{markup}{steps}</g>')

    def _animate(self, attribute: str, values: Sequence[str], more: str = "") -> str:
        if len(set(values)) == 1:
            return ""
        return (
            f'<animate attributeName="{attribute}" dur="{number(self.seconds)}s" repeatCount="indefinite"{more} '
            f'values="{";".join(values)}"/>'
        )

    def svg(self, title: str) -> str:
        """Return one ``<svg class="gs">`` in the colours of the page it is put in."""
        rules = (
            ".gs .rest{display:none}"
            "@media (prefers-reduced-motion:reduce){.gs .move{display:none}.gs .rest{display:inline}}"
        )
        body = [f'<g class="move">{"".join(self._moving)}</g>', f'<g class="rest">{"".join(self._resting)}</g>']
        return picture(body, self.width, self.height, STYLE + rules, title)


def _data(points: Points, closed: bool) -> str:
    return "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in np.asarray(points, float)) + ("Z" if closed else "")
