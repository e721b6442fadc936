"""``module = "planar"``: what is measured where any mechanism is given dimensions and moved."""

from __future__ import annotations

from typing import Any

from graphsynth.accuracy.rows import Effort, Problem

__all__ = ["dimensions", "path_dimensions", "positions"]


def positions(context: Any, effort: Effort) -> Problem:
    """Measure positions of an eight-link mechanism with a group of more than two links."""
    from graphsynth.accuracy.position import eight_link, position_problem

    return position_problem(eight_link(), "an eight-link mechanism with a larger Assur group", effort=effort)


def dimensions(context: Any, effort: Effort) -> Problem:
    """Measure the search for a straight line."""
    from graphsynth.accuracy.embodiment import line_problem

    return line_problem(effort)


def path_dimensions(context: Any, effort: Effort) -> Problem:
    """Measure the search for a path."""
    from graphsynth.accuracy.embodiment import path_problem

    return path_problem(effort)
