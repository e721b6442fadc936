"""Limits of the time of a search: of the clock, and of the processor in all processes that share the work."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Callable
from time import perf_counter, process_time
from typing import TypeVar

P = TypeVar("P")
T = TypeVar("T")


def here() -> str:
    """Name this process, among all machines."""
    return f"{platform.node()} {os.getpid()}"


def told(function: Callable[[P], T], home: str, piece: P) -> tuple[T, float]:
    """Do a piece of work; return the result and the processor time it took, 0 at home, where a clock counts it."""
    begin = process_time()
    return function(piece), 0.0 if home == here() else process_time() - begin


class Clock:
    """Time since it was made; ``elsewhere`` is the processor time of other processes, which they tell.

    >>> Clock(60.0).over, Clock(60.0, 1e-9).over
    ('', 'the limit of processor time')
    """

    def __init__(self, seconds: float, processor: float = math.inf) -> None:
        self.seconds, self.processor, self.elsewhere = seconds, processor, 0.0
        self._begin, self._own = perf_counter(), process_time()

    @property
    def passed(self) -> float:
        """Seconds of the clock."""
        return perf_counter() - self._begin

    @property
    def spent(self) -> float:
        """Seconds of the processor, of all processes."""
        return process_time() - self._own + self.elsewhere

    @property
    def over(self) -> str:
        """Which limit is passed; empty if none is."""
        if self.passed > self.seconds:
            return "the time limit"
        return "the limit of processor time" if self.spent > self.processor else ""
