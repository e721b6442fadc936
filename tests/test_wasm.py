"""WebAssembly modules of kernels: they are those of the sources, and give the bits of native code."""

from __future__ import annotations

import json
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

from graphsynth.core.native.library import FOLDER
from graphsynth.core.native.signatures import Signature
from graphsynth.core.native.wasm import MODULES, read_modules
from graphsynth.workbench import modules

from .kernel_bits import kernel_of
from .wasm_bits import Bits
from .wasm_calls import LOADER, Remote, node, tables
from .wasm_cases import PAGE, Recorded, computations, page_computations

ROOT = Path(__file__).parents[1]
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
LISTED = [(module, signature) for module, signatures in read_modules().items() for signature in signatures]


def case(module: str, signature: Signature) -> Any:
    """One kernel as a case: the workspace of enumeration is large, native kernels of the page are compiled."""
    long = ".synthesis." in signature.kernel or "canon_packed" in signature.kernel
    slow = any(part in signature.kernel for part in PAGE)
    marks = [pytest.mark.slow] if slow else [pytest.mark.long] if long else []
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


def test_nothing_inside_tells_of_the_machine_that_built_it() -> None:
    built = [*MODULES.glob("*.wasm"), *FOLDER.glob("*.so")]
    assert len(built) > 4
    assert not [path.name for path in built if b".py" in path.read_bytes()]


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


@pytest.fixture(scope="module")
def paged() -> Recorded:
    return page_computations()


@needs_node
@pytest.mark.parametrize(("module", "signature"), [case(*listed) for listed in LISTED])
def test_some_calls_give_the_bits_of_native_code(
    request: pytest.FixtureRequest, remote: Remote, module: str, signature: Signature
) -> None:
    bits = Bits(remote, module, signature)
    page = any(part in signature.kernel for part in PAGE)
    recorded: Recorded = request.getfixturevalue("paged" if page else "recorded")
    done, wrong = bits.run(recorded.get(signature.kernel, []), 200, 0.2, np.random.default_rng(7))
    assert done and not wrong


@pytest.mark.slow  # minutes
@needs_node
def test_many_calls_give_the_bits_of_native_code(remote: Remote) -> None:
    kept, wrong = computations(many=True) | page_computations(), []
    seconds = float(os.environ.get("GRAPHSYNTH_BITS_SECONDS", "20"))
    for module, signature in LISTED:
        bits, calls = Bits(remote, module, signature), kept.get(signature.kernel, [])
        done, bad = bits.run(calls, 1_000_000, seconds, np.random.default_rng(9))
        print(f"{done:>9}  {signature.kernel}", flush=True)
        wrong += [signature.kernel] * (bad > 0)
    assert not wrong


# -- the loader --------------------------------------------------------------------------------------------------------

LOADER_TESTS = """
const fs = require("fs"), [loader, modules] = process.argv.slice(2), Kernels = require(loader);
const said = (action) => { try { return action(); } catch (error) { return [error.name, error.kind, error.message]; } };
async function main() {
  const table = (name) => JSON.parse(fs.readFileSync(`${modules}/${name}.json`));
  const open = (name) => Kernels.open(name, fs.readFileSync(`${modules}/${name}.wasm`), table(name));
  const binding = await open("binding"), labels = await open("labels");
  const add = "intervals.kernels.loops.add", found = {};
  const low = new Float64Array(1), high = new Float64Array(1), given = [1];
  binding.call(add, given, Float64Array.of(1), { data: [2], shape: [1] }, [2], low, high);
  found.sum = [low[0], high[0], given[0]];
  found.unknown = said(() => binding.call("no.kernel"));
  found.few = said(() => binding.call(add, [1]));
  found.shape = said(() => binding.call(add, 1, [1], [2], [2], low, high));
  found.flat = said(() => binding.call(add, { data: [1, 2], shape: [2, 1] }, [1], [2], [2], low, high));
  found.short = said(() => binding.call(add, { data: [1], shape: [2] }, [1], [2], [2], low, high));
  found.raised = said(() => labels.call("structure.kernels.canon_packed", -1, [], []));
  const kept = binding.array("f8", [2, 3]);
  kept.data.set([1, 2, 3, 4, 5, 6]);
  const before = kept.data, bytes = binding.memory.buffer.byteLength;
  binding.free(binding.array("u1", bytes));
  found.moved = [before.length, [...kept.data], binding.memory.buffer.byteLength > bytes];
  const size = binding.memory.buffer.byteLength;
  for (let k = 0; k < 1000; k++) binding.free(binding.array("f8", [100, 1000]), binding.array("i2", 7));
  for (let k = 0; k < 1000; k++) labels.call("structure.kernels.canon_packed", 2, [0, 1, 1], [0, 0]);
  found.kept = binding.memory.buffer.byteLength - size;
  found.labels = labels.memory.buffer.byteLength;
  found.places = [kept.place % 16, binding.array("u1", 3).place % 16];
  new Function("Kernels", fs.readFileSync(process.argv[4], "utf8"))(Kernels);
  const motion = await Kernels.load("motion");
  found.registered = [motion === (await Kernels.load("motion")), motion.call("intervals.kernels.nearest.hypot", 3, 4)];
  found.absent = await Kernels.load("nothing").catch((error) => error.message);
  console.log(JSON.stringify(found));
}
main();
"""


@needs_node
@pytest.mark.long
def test_the_loader_takes_what_fits_says_what_does_not_and_loses_no_memory(tmp_path: Path) -> None:
    program, script = tmp_path / "program.js", tmp_path / "motion.js"
    program.write_text(LOADER_TESTS)
    script.write_text(modules.script("motion"))
    command = ["node", str(program), str(LOADER), str(MODULES), str(script)]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert found["sum"] == [3, 3, 1]
    assert found["unknown"][2] == "module binding has no kernel no.kernel"
    assert found["few"][2] == "intervals.kernels.loops.add takes 6 arguments, not 1"
    assert found["shape"][2] == "argument 1 of intervals.kernels.loops.add must be an array"
    assert found["flat"][2] == "argument 1 of intervals.kernels.loops.add must have 1 dimensions"
    assert found["short"][2] == "argument 1 of intervals.kernels.loops.add has 1 numbers, not 2"
    with pytest.raises(ValueError) as native:
        kernel_of("graphsynth.structure.kernels.canon_packed")(-1, np.zeros(0, np.uint8), np.zeros(0, np.int64))
    assert found["raised"] == ["Error", "ValueError", str(native.value)]
    assert found["moved"] == [0, [1, 2, 3, 4, 5, 6], True]  # the old view is empty, the new one holds all
    assert found["kept"] <= 1 << 20  # one array, not a thousand
    assert found["labels"] < 4_000_000 and found["places"] == [0, 0]
    assert found["registered"] == [True, 5] and found["absent"] == "the script of module nothing was not read"
