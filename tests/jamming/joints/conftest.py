"""Mechanisms of the coupled model's tests."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from coupled_oracles import four_bar


@pytest.fixture(scope="session")
def lambda_mechanism():
    return four_bar()


@pytest.fixture(scope="session")
def turn():
    return np.linspace(0.0, 2.0 * np.pi, 73)
