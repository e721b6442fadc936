"""Curves and functions of hidden random mechanisms with four to eight links, of which the search knows nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from graphsynth.design import DesignTask, FunctionTarget, PathTarget, design
from graphsynth.design.curves.families import Family, families
from graphsynth.design.curves.sampling import draw
from graphsynth.design.task.targets import evenly
from graphsynth.kinematics.simulation import simulate

pytestmark = pytest.mark.slow
#: Error over the size; pieces of a search; hidden mechanisms of each kind.
NEAR, PIECES, COUNT = 1e-3, 40, 20


def hidden(random: np.random.Generator) -> Iterator[tuple[Family, Any, int]]:
    """Random mechanisms that turn fully, each with one of its closed curves: family, what was drawn, its row."""
    by_links = {n: families([n], 0) for n in (4, 6, 8)}
    while True:
        every = by_links[int(random.choice([4, 6, 8], p=[0.1, 0.3, 0.6]))]
        family = every[int(random.integers(len(every)))]
        drawn = draw(family, 4, random)
        rows = np.flatnonzero(drawn.closed)
        if len(rows):
            yield family, drawn, int(random.choice(rows))


def curve_of(family: Family, drawn: Any, row: int, random: np.random.Generator) -> PathTarget:
    z = evenly(drawn.curves[row], 24, True)
    return PathTarget(points=[(p.real, p.imag) for p in z.tolist()], closed=True, tolerance=NEAR)


def function_of(family: Family, drawn: Any, row: int, random: np.random.Generator) -> FunctionTarget | None:
    design_, graph = family.design, family.design.graph
    own = design_.mechanism(drawn.places[row].astype(float), drawn.numbers[row].astype(float))
    motion = simulate(own, np.arange(24) * math.tau / 24)
    outputs = [k for k in range(1, graph.links) if graph.neighbours[0] >> k & 1 and k != family.driven]
    theta = np.unwrap(motion.poses[:, int(random.choice(outputs)), 2])
    swing = float(np.ptp(theta))
    if not motion.completed or swing < 0.1:
        return None
    inputs = (motion.inputs - motion.inputs[0]).tolist()
    return FunctionTarget(inputs=inputs, outputs=(theta - theta[0]).tolist(), tolerance=NEAR * swing)


@pytest.mark.parametrize(("kind", "least"), [(function_of, 0.9), (curve_of, 0.5)])
def test_hidden_mechanisms_are_found(kind: Any, least: float) -> None:
    random = np.random.default_rng(4321)
    found: list[bool] = []
    for family, drawn, row in hidden(random):
        target = kind(family, drawn, row, random)
        if target is None:
            continue

        def enough(progress: Any) -> None:
            if progress.pieces >= PIECES:
                raise KeyboardInterrupt

        free: dict[str, Any] = {"transmission": 0.0, "length_ratio": 1e3, "lengths": (1e-3, 1e3)}
        task = DesignTask(targets=[target], links=[4, 6, 8], **free)
        found.append(design(task, seconds=1e6, count=1, seed=len(found), progress=enough).accepted)
        if len(found) == COUNT:
            break
    assert np.mean(found) >= least, found
