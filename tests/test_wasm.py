"""WebAssembly modules of kernels: they are those of the sources, and give the bits of native code."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.native.signatures import Signature
from graphsynth.core.native.wasm import MODULES, read_modules
from graphsynth.workbench import modules

from .kernel_bits import kernel_of
from .wasm_bits import Bits, Recorded, computations
from .wasm_calls import Remote, node, tables

ROOT = Path(__file__).parents[1]
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
LISTED = [(module, signature) for module, signatures in read_modules().items() for signature in signatures]


def case(module: str, signature: Signature) -> Any:
    """One kernel as a case; those with the workspace of enumeration, twenty megabytes, are for the long run."""
    marks = [pytest.mark.long] if ".synthesis." in signature.kernel else []
    return pytest.param(module, signature, id=signature.kernel.removeprefix("graphsynth."), marks=marks)


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


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    return computations(many=False)


@needs_node
@pytest.mark.parametrize(("module", "signature"), [case(*listed) for listed in LISTED])
def test_some_calls_give_the_bits_of_native_code(
    remote: Remote, recorded: Recorded, module: str, signature: Signature
) -> None:
    bits = Bits(remote, module, signature)
    done, wrong = bits.run(recorded.get(signature.kernel, []), 200, 0.2, np.random.default_rng(7))
    assert done and not wrong


@pytest.mark.slow  # minutes
@needs_node
def test_many_calls_give_the_bits_of_native_code(remote: Remote) -> None:
    kept, wrong = computations(many=True), []
    for module, signature in LISTED:
        most = int(os.environ.get("GRAPHSYNTH_BITS_CALLS_EACH", "1000000"))
        done, bad = Bits(remote, module, signature).run(
            kept.get(signature.kernel, []), most, 60.0, np.random.default_rng(9)
        )
        print(f"{done:>9}  {signature.kernel}", flush=True)
        wrong += [signature.kernel] * (bad > 0)
    assert not wrong
