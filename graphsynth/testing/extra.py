"""hypothesis, or one sentence that says it is missing."""

from __future__ import annotations

from typing import Any

from graphsynth.core.errors import MissingExtraError, SpecError

__all__ = ["assume", "check_range", "ready", "st"]

try:
    from hypothesis import assume, strategies as st
except ImportError as error:  # pragma: no cover - tested in a process of its own
    raise MissingExtraError(
        "graphsynth.testing draws its examples with hypothesis, which is not installed; pip install hypothesis"
    ) from error


def ready(strategy: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Let a strategy prepare what it draws from now: hypothesis times the draws, and preparing may compile kernels."""
    strategy.validate()
    return strategy


def check_range(name: str, low: int, high: int, least: int, most: int) -> None:
    """Refuse sizes that are not ordered or beyond what the strategy can draw."""
    for word, value in (("smallest", low), ("largest", high)):
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise SpecError(f"{word} number of {name} is {value!r}; give a whole number from {least} to {most}")
    if low > high:
        raise SpecError(f"smallest number of {name} is {low}, above the largest, {high}; exchange them")
