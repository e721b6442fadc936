"""WebAssembly modules of kernels: they are those of the sources, and give the bits of native code."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from graphsynth.core.native.signatures import Signature
from graphsynth.core.native.wasm import MODULES, read_modules
from graphsynth.workbench import modules

from .kernel_bits import kernel_of, same_bits, same_results
from .test_native import interval_numbers
from .wasm_calls import Remote, node, tables

ROOT = Path(__file__).parents[1]
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
LISTED = [(module, signature) for module, signatures in read_modules().items() for signature in signatures]

LOOPS = [signature for _, signature in LISTED if ".loops." in signature.kernel and ".exp" not in signature.kernel]


@pytest.fixture(scope="module")
def remote() -> Iterator[Remote]:
    remote = node()
    yield remote
    remote.close()


def test_the_modules_are_of_these_sources_and_this_list() -> None:
    listed = {(module, signature.kernel.removeprefix("graphsynth.")) for module, signature in LISTED}
    held = {(module, kernel) for module, table in tables().items() for kernel in table["kernels"]}
    assert held == listed
    assert modules.names() == sorted(read_modules())
    changed = [
        kernel
        for table in tables().values()
        for kernel, own in table["kernels"].items()
        if kernel_of(f"graphsynth.{kernel}").digest != own["digest"]
    ]
    assert not changed, "build the modules anew: python -m graphsynth.core.native.wasm"


@pytest.mark.slow  # numba lowers every kernel
@pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang is not installed")
def test_the_same_sources_give_the_same_bytes(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "graphsynth.core.native.wasm", "--output", str(tmp_path)]
    subprocess.run(command, check=True, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)})
    made, shipped = (
        {path.name: path.read_bytes() for path in folder.glob("*.[wj][as]*")} for folder in (tmp_path, MODULES)
    )
    assert made == shipped


@needs_node
@pytest.mark.parametrize("signature", LOOPS, ids=lambda signature: signature.kernel.rpartition(".")[2])
def test_interval_loops_give_the_bits_of_native_code_for_any_numbers(remote: Remote, signature: Signature) -> None:
    args = interval_numbers(signature, 300, np.random.default_rng(7))
    kernel = kernel_of(signature.kernel)
    copies = tuple(arg.copy() if isinstance(arg, np.ndarray) else arg for arg in args)
    blocks = [arg[None] if isinstance(arg, np.ndarray) else arg for arg in args]
    found, arrays = remote.call("binding", signature.kernel.removeprefix("graphsynth."), args, blocks, 1)
    assert same_results(found, [kernel(*copies)])
    ours = [arg for arg in copies if isinstance(arg, np.ndarray)]
    assert all(same_bits(a, b[0]) for a, b in zip(ours, arrays, strict=True))
