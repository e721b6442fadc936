"""Kernels of the library as WebAssembly, ``NAME.wasm`` and its table ``NAME.json``, and as scripts."""

from __future__ import annotations

import json
from base64 import b64encode
from importlib.resources import files
from zlib import compress


def names() -> list[str]:
    """Return the names of the modules."""
    return sorted(path.name.removesuffix(".wasm") for path in files(__name__).iterdir() if path.name.endswith(".wasm"))


def script(name: str) -> str:
    """Return the script that hands a module to the loader ``kernels.js``: from a disk, a page reads scripts alone."""
    folder = files(__name__)
    table = json.loads(folder.joinpath(f"{name}.json").read_text("utf-8"))
    for kernel in table["kernels"].values():
        del kernel["digest"]  # is for tests
    code = b64encode(compress(folder.joinpath(f"{name}.wasm").read_bytes(), 9)).decode()
    return f"Kernels.register({json.dumps(name)}, {json.dumps(table, separators=(',', ':'))}, {json.dumps(code)});\n"
