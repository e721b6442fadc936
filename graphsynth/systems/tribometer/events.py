"""The event loop of stick and slip: states, guards against Zeno behaviour, located events with error estimates."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.friction.laws import positive

Array = NDArray[np.float64]
_FIRST, _LARGEST = 256, 1 << 16


class RunStatus(Enum):
    """How a run ended; only `COMPLETE` reached the time asked for and is to be trusted as it stands."""

    COMPLETE = "complete"
    UNRELIABLE = "unreliable"
    STORM = "Zeno behaviour"
    STEP_LIMIT = "step limit"
    UNRESOLVED = "unresolved contact"
    FAILED = "failed"


_CODES = (
    RunStatus.COMPLETE,
    RunStatus.COMPLETE,
    RunStatus.STORM,
    RunStatus.STEP_LIMIT,
    RunStatus.UNRESOLVED,
    RunStatus.FAILED,
)


class StickSlipEvent(NamedTuple):
    """A change of the contact: time (s), new state (0 stick, +1 or -1 slip), position x2 (m), error of the time (s).

    The error is an estimate; it is NaN where nothing could be estimated.
    """

    time: float
    state: int
    position: float
    error: float

    @property
    def name(self) -> str:
        """Name of the new state: ``STICK``, ``SLIP(+1)`` or ``SLIP(-1)``."""
        return "STICK" if self.state == 0 else f"SLIP({self.state:+d})"


@dataclass(frozen=True)
class EventGuard:
    """Bounds beyond which the exact automaton stops with the status "Zeno behaviour".

    Parameters
    ----------
    rate : float
        Most events per second, over a window of ``window`` events.
    window : int
        Events over which the rate is taken; a shorter burst passes.
    dwell : float
        A dwell below this multiple of the spacing of floating-point times is too short; three in a row stop the run.
    steps : int
        Most steps of a run.

    Raises
    ------
    SpecError
        If a bound is not positive.

    Examples
    --------
    >>> EventGuard(rate=500).window
    64
    """

    rate: float = 2000.0
    window: int = 64
    dwell: float = 64.0
    steps: int = 1_000_000

    def __post_init__(self) -> None:
        positive("event rate bound", self.rate)
        positive("shortest dwell", self.dwell, or_zero=True)
        for name in ("window", "steps"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise SpecError(f"The {name} of an event guard is {getattr(self, name)!r}; give a whole number from 1.")


@dataclass(frozen=True, eq=False)
class EventPath:
    """The nodes of one run of the automaton.

    Attributes
    ----------
    nodes : ndarray, shape (n, 8)
        Time, x2, v2, state from here on, work of the drive, friction loss, damper loss since the start (J), 1 at an
        event.
    status : RunStatus
    data : ndarray
        Data of the kernels.
    tolerance : float
        Relative tolerance of the integrated pieces.
    steps : int
        Steps taken.
    """

    nodes: Array
    status: RunStatus
    data: Array = field(repr=False)
    tolerance: float
    steps: int

    @property
    def events(self) -> Array:
        """Rows of the nodes that are events, shape (e, 8)."""
        found: Array = self.nodes[self.nodes[:, 7] == 1.0]
        return found

    @property
    def end(self) -> float:
        """Time up to which the motion is known, s."""
        return float(self.nodes[-1, 0])

    def at(self, times: Array) -> Array:
        """Position, velocity, state, friction force at each time, shape (n, 4); NaN outside of the run."""
        from graphsynth.systems.tribometer.kernels.automaton import locate

        out = np.empty((times.size, 4))
        locate(self.data, self.nodes, times, self.tolerance, out)
        return out


def follow(
    data: Array, start: tuple[float, float, float, float], end: float, guard: EventGuard, tolerance: float
) -> EventPath:
    """Run the automaton.

    Parameters
    ----------
    data : ndarray
        Data of the kernels.
    start : tuple
        Time, x2, v2 and state.
    end : float
        Final time.
    guard : EventGuard
    tolerance : float
        Relative tolerance of integrated pieces.
    """
    from graphsynth.systems.tribometer.kernels.automaton import FULL, advance

    node = np.zeros(8)
    node[:4] = start
    bounds = np.array([guard.rate, guard.dwell])
    parts, steps, size, code = [node[None]], 0, _FIRST, FULL
    memory = np.concatenate([[0.0, 0.0, 0.0], np.full(guard.window, -math.inf)])
    while code == FULL:
        room = np.empty((size, 8))
        count, code, taken = advance(data, node, end, bounds, tolerance, guard.steps - steps, room, memory)
        parts.append(room[:count])
        steps += taken
        if count:
            node = room[count - 1]
        size = min(4 * size, _LARGEST)
    return EventPath(np.concatenate(parts), _CODES[code], data, tolerance, steps)
