"""Programs of mechanisms: those of the kernels beside those of plain Python, and what every program has to be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import find_fault
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.api import enumerate_chains

from .plain_program import plain_program
from .random_mechanisms import random_mechanism


def agree(mechanism: Mechanism, dimensions: Any = None) -> bool:
    """Whether both make the same program, numbers equal to rounding, or refuse it with the same sentence."""
    try:
        tables, steps, gears = plain_program(mechanism, dimensions)
    except (GeometryError, GraphError) as error:
        with pytest.raises(GeometryError) as found:
            compile_program(mechanism, dimensions)
        assert str(found.value).removeprefix("the mechanism cannot be simulated: ") == str(error)
        return False
    program = compile_program(mechanism, dimensions)
    assert [(s.code, s.group, s.links, s.kind, s.core) for s in program.steps] == steps
    assert program.gears.tolist() == gears
    for name, own, plain in zip(codes.Tables._fields, program.tables, tables):
        assert own.dtype == plain.dtype and own.shape == plain.shape and own.flags.c_contiguous, name
        if own.dtype == np.float64:  # sums of products are rounded once more or less
            assert np.abs(own - plain).max(initial=0.0) <= 1e-15 * max(1.0, float(np.abs(plain).max(initial=0.0))), name
        else:
            assert (own == plain).all(), name
    return True


@pytest.mark.long
def test_programs_of_random_mechanisms_are_those_of_plain_python() -> None:
    random, same = np.random.default_rng(7), 0
    for k in range(60):
        mechanism = random_mechanism(random, sliding=(0.0, 0.2, 0.6)[k % 3])
        sets = np.repeat(mechanism.dimensions[None], 3, axis=0)
        sets[:, :, :2] += random.normal(size=(3, sets.shape[1], 2))
        same += agree(mechanism) + agree(mechanism, sets)
    assert same > 90  # most are no fault


def dressed(graph: MechanismGraph, drivers: list[tuple[int, int]], sliding: float, random: Any) -> Mechanism:
    """Joints of random kinds and numbers."""
    joints: list[Any] = []
    for joint in graph.joints:
        a, b = (joint.a, joint.b) if random.random() < 0.5 else (joint.b, joint.a)
        ends = tuple(random.normal(size=2).tolist()), tuple(random.normal(size=2).tolist())
        if joint.mobility == 2:
            joints.append(PinSlot(a, b, *ends, float(random.normal())))
        elif random.random() < sliding:
            joints.append(Prismatic(a, b, *ends, *random.normal(size=2).tolist()))
        else:
            joints.append(Revolute(a, b, *ends))
    return Mechanism(graph, joints, [Driver(*pair) for pair in drivers])


def all_drivers(links: int) -> Any:
    """Mechanisms of mobility 1: every chain, frame and joint on the frame."""
    for chain in enumerate_chains(links=links, mobility=1):
        for frame in range(links):
            graph = chain.with_frame(frame)
            for joint in graph.joints:
                if graph.frame in (joint.a, joint.b):
                    yield graph, (joint.a, joint.b)


@pytest.mark.long
@pytest.mark.parametrize("links", [4, 6, 8, pytest.param(10, marks=pytest.mark.slow)])
def test_programs_of_all_chains_are_those_of_plain_python(links: int) -> None:
    random, count = np.random.default_rng(links), 0
    for graph, driver in all_drivers(links):
        count += 1
        for sliding in (0.0, 0.3):
            same = agree(dressed(graph, [driver], sliding, random))
            if not sliding:
                assert same == (find_fault(graph, [driver]) is None)
    assert count == {4: 8, 6: 28, 8: 320, 10: 5980}[links]


def test_several_drivers_and_drivers_away_from_the_frame() -> None:
    random = np.random.default_rng(3)
    found = 0
    for _ in range(200):
        links, mobility = int(random.integers(3, 9)), int(random.integers(2, 4))
        if (3 * (links - 1) - mobility) % 2:
            continue
        pairs = [(a, b) for a in range(links) for b in range(a + 1, links)]
        count = (3 * (links - 1) - mobility) // 2
        if not mobility <= count <= len(pairs):
            continue
        chosen = [pairs[k] for k in random.choice(len(pairs), count, replace=False)]
        graph = MechanismGraph(links, chosen, frame=int(random.integers(links)))
        found += agree(dressed(graph, chosen[:mobility], 0.3, random))
    assert found >= 5


def test_a_loop_of_drivers_is_over_constrained() -> None:
    graph = MechanismGraph(4, [(0, 2), (0, 3), (2, 3)], frame=1)
    fault = find_fault(graph, [(0, 3), (0, 2), (2, 3)])
    assert fault is not None and fault.kind == "over-constrained" and fault.links == (0, 2, 3)
