"""Pictures of candidate graphs."""

from __future__ import annotations

from graphsynth.drawing.levels import draw_levels
from graphsynth.pipeline.products import Picture, Recognised
from graphsynth.pipeline.stages import Context

__all__ = ["pictures"]

_MOST = 60  # a contact sheet nobody can look through is no help


def pictures(
    context: Context, candidates: tuple[object, ...], recognised: tuple[Recognised, ...]
) -> tuple[Picture, ...]:
    """Draw every candidate by adjacency levels, the recognised ones first and larger; at most sixty."""
    chosen = sorted(recognised, key=lambda r: (r.module is None, r.candidate.number))[:_MOST]
    return tuple(_picture(item) for item in chosen)


def _picture(item: Recognised) -> Picture:
    graph, known = item.candidate.graph, item.module is not None
    title = f"No. {item.candidate.number}"
    caption = (
        f"Recognised as {item.module}; {item.candidate.solution}, levels of {_sizes(graph)} links" if known else ""
    )
    return Picture(
        title, draw_levels(graph, 460 if known else 210, f"{title}, by levels"), caption, "wide" if known else "small"
    )


def _sizes(graph: object) -> str:
    return ", ".join(str(len(level)) for level in graph.levels)  # type: ignore[attr-defined]
