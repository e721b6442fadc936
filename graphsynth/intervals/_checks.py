"""Arguments of this room's functions."""

from __future__ import annotations

from graphsynth.core.arguments import checker
from graphsynth.core.errors import IntervalError

__all__ = ["checked"]

#: Lets a function keep what its annotations say; an `IntervalError` names the argument that is something else.
checked = checker(IntervalError, ("Interval",), {"System": "Callable"})
