"""The library of kernels that were compiled ahead of time."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module

import pytest

from graphsynth.core.native import library
from graphsynth.core.native.signatures import Signature, read_list

needs_library = pytest.mark.skipif(not library.contents(), reason=library.reason)


def python(code: str, **environment: str) -> str:
    """Run a program in a process of its own; what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | environment, check=True
    )
    return done.stdout


@needs_library
def test_the_library_is_of_these_sources_and_this_list() -> None:
    held = {Signature(name, types) for name, _, overloads in library.contents() for types, _ in overloads}
    assert held == set(read_list())
    for name, digest, _ in library.contents():
        module, _, function = name.rpartition(".")
        assert getattr(import_module(module), function).digest == digest, f"{name}: build the library anew"


@needs_library
def test_counting_does_not_load_numba() -> None:
    code = "import sys, graphsynth as gs; print(gs.count_chains(12), 'numba' in sys.modules)"
    assert python(code).split() == ["6856", "False"]
    assert python(code, GRAPHSYNTH_NATIVE="0").split() == ["6856", "True"]
