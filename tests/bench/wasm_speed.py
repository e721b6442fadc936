"""Positions of a four-bar per second, natively and in WebAssembly: ``python -m tests.bench.wasm_speed``."""

from __future__ import annotations

from time import process_time

import numpy as np

import graphsynth as gs
from tests.kernel_bits import kernel_of
from tests.wasm_calls import browser, node
from tests.wasm_cases import Recorded, recording

RUN = "kinematics.engine.kernels.running.run"


def main() -> None:
    """Time one turn of a crank in a thousand steps, with and without velocities and accelerations."""
    kept: Recorded = {}
    with recording(kept, all_calls=True):
        gs.simulate(gs.Mechanism.four_bar(4.0, 1.2, 3.5, 3.0), np.linspace(0.0, 2.0 * np.pi, 1000))
    (turn,) = (args for args in kept[f"graphsynth.{RUN}"] if len(args[3]) == 1000)
    run = kernel_of(f"graphsynth.{RUN}")
    places = {name: start() for name, start in (("Node", node), ("Chromium", browser))}
    for what, rates in (("places", False), ("places, velocities, accelerations", True)):
        args = (*turn[:-1], rates)
        start, calls = process_time(), 0
        while process_time() - start < 1.0:
            run(*args)
            calls += 1
        print(f"{what}: native {1000 * calls / (process_time() - start):.3g}/s", end="")
        for name, remote in places.items():
            print(f", {name} {1000 / remote.seconds('motion', RUN, args, 3.0):.3g}/s", end="")
        print(flush=True)
    for remote in places.values():
        remote.close()


if __name__ == "__main__":
    main()
