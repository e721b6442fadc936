"""An empty matplotlib figure for the pictures of this room; no global state of matplotlib is touched."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["legend_place", "new_figure"]

#: Points up to which the emptiest corner is found at once.
_FEW = 20_000


def new_figure(size: tuple[float, float]) -> Figure:
    """Return an empty figure of a size in inches."""
    from matplotlib.figure import Figure

    figure: Figure = Figure(figsize=size, layout="constrained")
    return figure


def legend_place(points: int) -> str:
    """Return where a legend goes: the emptiest corner, or a fixed one where so many points would take long to avoid.

    Examples
    --------
    >>> legend_place(100), legend_place(100_000)
    ('best', 'upper right')
    """
    return "best" if points <= _FEW else "upper right"
