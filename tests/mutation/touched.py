"""Write down which tests run which functions of the package: a plugin of pytest for the choice of tests in ``run.py``.

``PYTHONPATH=.:tests/mutation python -m pytest -p touched`` writes ``touched.N.json`` for each process into the folder
that ``TOUCHED`` names.  What a process does while it prepares a test counts for the whole file.  Compiled functions
leave no trace; the functions that name them do.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Generator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = str(Path(__file__).parents[2]) + os.sep
_codes: dict[int, CodeType] = {}
_tests: dict[str, dict[str, Any]] = {}
_files: dict[str, list[str]] = {}


def _note(frame: FrameType, event: str, _: Any) -> None:
    if event == "call":
        _codes[id(frame.f_code)] = frame.f_code


def _taken() -> list[str]:
    """Functions of the package that ran since the last call."""
    sys.setprofile(None)
    inside = {(c.co_filename.removeprefix(ROOT), c.co_name) for c in _codes.values() if c.co_filename.startswith(ROOT)}
    _codes.clear()
    sys.setprofile(_note)
    return sorted(f"{path}::{name}" for path, name in inside if path.startswith("graphsynth"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, Any, Any]:
    _taken()
    done = yield
    file = item.nodeid.partition("::")[0]
    _files[file] = sorted({*_files.get(file, []), *_taken()})
    return done


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    _taken()
    done = yield
    _tests.setdefault(item.nodeid, {})["functions"] = _taken()
    return done


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.when == "call":
        _tests.setdefault(report.nodeid, {})["seconds"] = round(report.duration, 3)


def pytest_unconfigure() -> None:
    sys.setprofile(None)
    path = Path(os.environ["TOUCHED"], f"touched.{os.getpid()}.json")
    path.write_text(json.dumps({"tests": _tests, "files": _files}), "utf-8")
