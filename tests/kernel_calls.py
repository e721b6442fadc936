"""Real calls of kernels: runs examples of the documentation with numba, keeps copies of arguments (``FILE [slow]``)."""

from __future__ import annotations

import copy
import pickle
import sys
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.compilation import Kernel
from graphsynth.core.native.signatures import Signature, text_of

MOST = 12  # calls of each kind that are kept
LARGE, HUGE = 1_000_000, 30_000_000  # bytes of arguments from which on only two or one are


def size_of(value: Any) -> int:
    return sum(map(size_of, value)) if isinstance(value, tuple) else getattr(value, "nbytes", 8)


def flattened(value: Any) -> list[np.ndarray]:
    """Return the arrays, and the numbers as arrays, that tuples hold."""
    if isinstance(value, tuple):
        return [part for item in value for part in flattened(item)]
    return [] if value is None else [np.asarray(value)]


def duplicate(value: Any) -> Any:
    """Copy arguments; arrays that may only be read stay so."""
    if isinstance(value, tuple):
        parts = [duplicate(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if not isinstance(value, np.ndarray):
        return copy.deepcopy(value)
    found = value.copy(order="K")
    found.flags.writeable = value.flags.writeable
    return found


class Calls:
    """Copies of arguments by kernel and types."""

    def __init__(self) -> None:
        self.kept: dict[Signature, list[tuple[Any, ...]]] = {}
        self.seen: dict[Signature, int] = {}

    def around(self, kernel: Kernel) -> Any:
        """What is called instead of a kernel."""
        from numba import typeof

        name = f"{kernel.__module__}.{kernel.__qualname__}"

        def call(*args: Any) -> Any:
            try:
                kind = Signature(name, ", ".join(text_of(typeof(value)) for value in args))
            except (TypeError, ValueError):
                return kernel.dispatcher(*args)
            count = self.seen[kind] = self.seen.get(kind, 0) + 1
            kept, size = self.kept.setdefault(kind, []), size_of(args)
            # of many calls the first ones, and then ever rarer ones
            most = MOST if size < LARGE else 2 if size < HUGE else 1
            if len(kept) < most and count & (count - 1) == 0:
                kept.append(duplicate(args))
            return kernel.dispatcher(*args)

        return call


def more_calls() -> None:
    """Call what no example of the documentation calls."""
    import graphsynth as gs
    from graphsynth import intervals
    from graphsynth.dynamics import Body, DynamicModel, simulate_dynamics
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.synthesis.contracted import generate
    from graphsynth.synthesis.kernels.counting import COUNTING, LISTING, MAKING
    from graphsynth.synthesis.problem import EnumerationProblem
    from graphsynth.synthesis.shards import works
    from graphsynth.systems.tribometer.model import Tribometer

    x, y = intervals.Interval("0.3", "0.4"), intervals.Interval("-0.1", 2)
    for _ in range(2):
        x, y = (x + y) * x - y / x, y.sqr().sqrt() - x
        for function in (intervals.sin, intervals.cos, intervals.exp, intervals.atan):
            y = function(y)
        intervals.log(y.sqr() + 1)
    generate(4)
    for family in EnumerationProblem.chains(10, 1, 3, None, False, None).families:
        for purpose in (LISTING, COUNTING, MAKING):
            works(family, 1.0, purpose)
    times = np.linspace(0.0, 2.0, 201)
    Tribometer().event_driven(2.0, times=times)
    Tribometer().time_stepping(2.0, step=1e-3, times=times)
    Tribometer().regularised(0.5, speed=1e-3, check=False)
    ring = gs.MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (0.2, 0)), Revolute(2, 3, (0.6, 0), (0.4, 0)), Revolute(0, 3, (0.6, 0))]
    bodies = {link: Body.bar(mass, (0, 0), (mass, 0)) for link, mass in ((1, 0.2), (2, 0.6), (3, 0.4))}
    model = DynamicModel(Mechanism(ring, joints, [Driver(0, 1)]), bodies)
    start = {"keep": {(0, 1): 0.0}, "keep_rates": {(0, 1): 10.0}, "modes": {0: 1}}
    simulate_dynamics(model, [0.0, 0.5, 1.0], form="partitioned", **start)
    chain = gs.enumerate_chains(8)[1]  # no group of three links whose poses are roots of a polynomial
    at = np.random.default_rng(1).normal(size=(len(chain.joints), 2)).tolist()
    joints = [Revolute(a, b, (x, y), (x, y)) for (a, b, _), (x, y) in zip(chain.joints, at, strict=True)]
    frame = gs.MechanismGraph(8, [joint.pair for joint in joints], frame=4)
    Mechanism(frame, joints, [Driver(4, 5)], pose=((0.0, 0.0, 0.0),) * 8).modes()


def main(path: Path, *slow: str) -> None:
    calls = Calls()
    fallback: Any = cached_property(calls.around)
    fallback.__set_name__(Kernel, "fallback")
    Kernel.fallback = fallback
    here = Path(__file__).parent
    options = ["-q", "-n", "0", "-p", "no:cacheprovider", *(["-m", ""] if slow else [])]
    pages = [f"{here / 'test_docs.py'}::test_examples_run", str(here / "test_doc_commands.py")]
    assert pytest.main([*options, *pages]) in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)  # that is for others
    more_calls()
    calls.kept = {kind: kept for kind, kept in calls.kept.items() if kept}
    path.write_bytes(pickle.dumps(calls.kept, protocol=5))  # the first that tells what may be written


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
