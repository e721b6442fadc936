"""Chains counted and listed in the page: published numbers, and the library's list."""

from __future__ import annotations

import json
import shutil
import subprocess
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.native.wasm import MODULES
from graphsynth.structure.kernels import canon_packed
from graphsynth.workbench import chains

PAGES = MODULES.with_name("pages")
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
PROGRAM = """
const fs = require("fs"), [pages, modules, data, what] = process.argv.slice(2);
const Kernels = require(`${pages}/kernels.js`), Chains = require(`${pages}/chains.js`);
new Function("Chains", fs.readFileSync(data, "utf8"))(Chains);
async function main() {
  const table = JSON.parse(fs.readFileSync(`${modules}/chains.json`));
  const module = await Kernels.open("chains", fs.readFileSync(`${modules}/chains.wasm`), table);
  const found = {}, lists = {};
  for (const kind of JSON.parse(what).count) found[kind] = String(await Chains.count(module, ...kind));
  for (const kind of JSON.parse(what).list) {
    lists[kind] = [];
    for await (const chain of Chains.list(module, ...kind)) lists[kind].push([...chain]);
  }
  console.log(JSON.stringify({ counts: found, lists, kinds: await Chains.kinds() }));
}
main();
"""
#: Every chain of some kinds, its links numbered anew, is labelled; digests of all joints and of all labellings.
DIGESTS = """
const fs = require("fs"), [pages, modules, data, what] = process.argv.slice(2), { createHash } = require("crypto");
const Kernels = require(`${pages}/kernels.js`), Chains = require(`${pages}/chains.js`);
new Function("Chains", fs.readFileSync(data, "utf8"))(Chains);
const read = name => fs.readFileSync(`${modules}/${name}`);
const open = name => Kernels.open(name, read(`${name}.wasm`), JSON.parse(read(`${name}.json`)));
async function main() {
  const chains = await open("chains"), labels = await open("labels"), found = {};
  for (const [links, mobility] of JSON.parse(what)) {
    const joints = createHash("sha256"), labelled = createHash("sha256"), colours = new BigInt64Array(links);
    let k = 0;
    for await (const packed of Chains.list(chains, links, mobility)) {
      joints.update(packed);
      const shift = k++ % links, moved = (value, at) => (at % 3 === 2 ? value : (value + shift) % links);
      const parts = labels.call("structure.kernels.canon_packed", links, Uint8Array.from(packed, moved), colours);
      for (const part of parts) labelled.update(new Uint8Array(part.data.buffer));
    }
    found[`${links},${mobility}`] = [k, joints.digest("hex"), labelled.digest("hex")];
  }
  console.log(JSON.stringify(found));
}
main();
"""


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("chains")

    def ask(count: list[tuple[int, int]], listed: list[tuple[int, int]], text: str = PROGRAM) -> Any:
        program, data = folder / "program.js", folder / "data.js"
        program.write_text(text)
        data.write_text(chains.script())
        wanted = json.dumps({"count": count, "list": listed} if text is PROGRAM else listed)
        command = ["node", str(program), str(PAGES), str(MODULES), str(data), wanted]
        return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    return ask


def test_counts_are_those_of_the_literature_and_lists_those_of_the_library(answer: Any) -> None:
    kinds = [(8, 1), (9, 2), (8, 3)]
    found = answer([(4, 1), (6, 1), (8, 1), (10, 1), (12, 1), (14, 1), (9, 2), (10, 3)], kinds)
    published = {"4,1": 1, "6,1": 2, "8,1": 16, "10,1": 230, "12,1": 6856, "14,1": 318162, "9,2": 35, "10,3": 74}
    assert {key: int(count) for key, count in found["counts"].items()} == published
    for links, mobility in kinds:
        ours = [
            [list(joints[k : k + 3]) for k in range(0, len(joints), 3)]
            for joints in found["lists"][f"{links},{mobility}"]
        ]
        assert ours == [[list(joint) for joint in chain.joints] for chain in gs.enumerate_chains(links, mobility)]


def test_every_kind_has_the_library_s_count(answer: Any) -> None:
    kinds = [(links, mobility) for links, mobility in answer([], [])["kinds"] if links <= 12]
    assert len(kinds) > 10
    found = answer(kinds, [])["counts"]
    for links, mobility in kinds:
        assert int(found[f"{links},{mobility}"]) == gs.count_chains(links, mobility)


@pytest.mark.slow
def test_sixteen_links(answer: Any) -> None:
    assert answer([(16, 1)], [])["counts"] == {"16,1": "19819281"}


@pytest.mark.parametrize("kinds", [[(8, 1), (9, 2)], pytest.param([(14, 1), (13, 2)], marks=pytest.mark.slow)])
def test_lists_and_labels_have_the_bits_of_native_code(answer: Any, kinds: list[tuple[int, int]]) -> None:
    found = answer([], kinds, DIGESTS)
    for links, mobility in kinds:
        joints, labelled, k = sha256(), sha256(), 0
        colours = np.zeros(links, dtype=np.int64)
        for chain in gs.enumerate_chains(links, mobility):
            packed = np.frombuffer(chain.packed, dtype=np.uint8)
            joints.update(chain.packed)
            own = packed.copy()
            own.reshape(-1, 3)[:, :2] = (own.reshape(-1, 3)[:, :2] + k % links) % links
            own.flags.writeable = False
            for part in canon_packed(links, own, colours):
                labelled.update(part.tobytes())
            k += 1
        print(k, "chains of", links, "links")
        assert found[f"{links},{mobility}"] == [k, joints.hexdigest(), labelled.hexdigest()]
