"""Hypothesis strategies for property tests of mechanisms, for users' test suites and for our own.

::

    from hypothesis import given
    from graphsynth.testing import chains

    @given(chains())
    def test_something(chain): ...

Every strategy reaches the corners that break code: smallest sizes, changes of class, empty and unbounded intervals,
legs out of reach.  hypothesis is imported when the first strategy is asked for, and only here.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC = {
    "FourBarLengths": "strategies.four_bars",
    "chains": "strategies.graphs",
    "finite_numbers": "strategies.intervals",
    "four_bar_mechanisms": "strategies.mechanisms",
    "four_bars": "strategies.four_bars",
    "graphs": "strategies.graphs",
    "intervals": "strategies.intervals",
    "intervals_and_members": "strategies.intervals",
    "mechanism_graphs": "strategies.graphs",
    "mechanisms": "strategies.mechanisms",
    "platform_poses": "strategies.platforms",
    "platforms": "strategies.platforms",
    "scenes": "strategies.scenes",
    "specs": "strategies.specs",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
