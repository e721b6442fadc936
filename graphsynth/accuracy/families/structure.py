"""``[structure]``: what is measured of the enumerator, for scenes that ask it."""

from __future__ import annotations

from typing import Any

from graphsynth.accuracy.rows import Effort, Problem

__all__ = ["enumeration"]


def enumeration(context: Any, effort: Effort) -> Problem:
    """Time against the number of graphs."""
    from graphsynth.accuracy.enumeration import enumeration_problem

    return enumeration_problem(effort)
