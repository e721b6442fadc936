"""Where pytest looks for examples in docstrings."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from _pytest.doctest import DoctestModule

_PACKAGE = Path(__file__).parent / "graphsynth"


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[Any], list[Any]]:
    """Look in the modules of the package that have any.

    In tests it would import every file a second time; a module of kernels would be compiled by every worker.
    """
    found = yield
    if file_path.suffix != ".py" or (file_path.is_relative_to(_PACKAGE) and ">>> " in file_path.read_text("utf-8")):
        return found
    return [collector for collector in found if not isinstance(collector, DoctestModule)]
