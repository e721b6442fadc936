from __future__ import annotations

import copy
import tomllib
from typing import Any

import pytest

from graphsynth.scenes.scene import find_scene


@pytest.fixture
def lambda_tables() -> dict[str, Any]:
    """The tables of the shipped lambda scene, free to be spoiled."""
    return copy.deepcopy(tomllib.loads(find_scene("lambda").read_text(encoding="utf-8")))
