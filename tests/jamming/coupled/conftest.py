"""Mechanisms of the coupled model's tests."""

import numpy as np
import pytest

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute


def four_bar(ground=2.0, crank=1.0, coupler=2.5, rocker=2.5, scale=1.0):
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (scale * crank, 0.0)),
        Revolute(2, 3, (scale * coupler, 0.0), (scale * rocker, 0.0)), Revolute(0, 3, (scale * ground, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


@pytest.fixture(scope="session")
def lambda_mechanism():
    return four_bar()


@pytest.fixture(scope="session")
def turn():
    return np.linspace(0.0, 2.0 * np.pi, 73)
