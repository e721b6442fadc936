"""Settings for the whole suite."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import settings

collect_ignore = ["mutation"]  # a program, not tests

# An example may have to compile a kernel, or wait for the other worker: no deadline for one.  The same examples every
# time, so that two runs of one state agree; `--hypothesis-profile=fresh` draws new ones.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None, print_blob=True)
settings.load_profile("fixed")


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Generator[None, list[Any], list[Any]]:
    """Look for examples in docstrings of the package only: here it would import every test file a second time."""
    found = yield
    return [collector for collector in found if not isinstance(collector, DoctestModule)]
