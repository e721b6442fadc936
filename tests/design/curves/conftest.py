"""One small index for all tests."""

from pathlib import Path

import pytest

from graphsynth.design import CurveIndex


@pytest.fixture(scope="session")
def index(tmp_path_factory: pytest.TempPathFactory) -> CurveIndex:
    """Curves of four-bars and six-bars, with sliding joints."""
    folder: Path = tmp_path_factory.mktemp("curves")
    return CurveIndex.build(folder, 3000, links=[4, 6], sliders=1)
