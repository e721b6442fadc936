"""Builds the WebAssembly modules of kernels: ``python -m graphsynth.core.native.wasm [--output FOLDER] [MODULE ...]``.

The kernels of ``wasm.txt`` are lowered as those of the library are, optimised for WebAssembly, compiled with ``wasm.c``
and linked, module by module.  Beside every ``NAME.wasm`` stands ``NAME.json``, which tells a caller the types of its
kernels, and a test the digests of their sources.  The same sources give the same bytes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from graphsynth.core.native.library import FOLDER
from graphsynth.core.native.lowering import ENVIRONMENT, Lowered, lower, optimise
from graphsynth.core.native.signatures import Signature, read_list

MODULES = FOLDER.parents[1] / "workbench" / "modules"
#: What code of kernels may call: no elementary function, for those of a C library have bits of their own.  One that
#: LLVM would take from there is missed by the linker.
_CALLED = (
    "NRT_Allocate NRT_Free NRT_MemInfo_alloc NRT_MemInfo_alloc_aligned NRT_MemInfo_alloc_safe_aligned "
    "NRT_MemInfo_call_dtor numba_frexp numba_ldexp numba_nextafter memcpy memmove memset fma sqrt floor ceil trunc "
    "rint fabs"
)
ALLOWED = frozenset(_CALLED.split())
FEATURES = "bulk-memory simd128 sign-ext nontrapping-fptoint mutable-globals"
_TRIPLE = "wasm32-unknown-unknown"
_STACK = 1 << 20
_WASM = (sys.executable, "-m", "graphsynth.core.native.wasm")


def read_modules(path: Path = FOLDER / "wasm.txt") -> dict[str, list[Signature]]:
    """Return the kernels of every module, with their types."""
    known = read_list()
    found: dict[str, list[Signature]] = {}
    for line in path.read_text("utf-8").splitlines():
        if line.startswith("["):
            own = found[line.strip("[]")] = []
        elif "(" in line:
            own.append(Signature(*line[:-1].split("(", 1)))
        elif line and not line.startswith("#"):
            alike = [signature for signature in known if signature.kernel == line]
            if not alike:
                raise SystemExit(f"{path.name} names {line} without types, which signatures.txt does not have")
            own += alike
    return {name: sorted(set(signatures)) for name, signatures in found.items()}


def emit(code: bytes) -> bytes:
    """Optimise for WebAssembly and return an object file."""
    import llvmlite.binding as ll

    ll.initialize_all_targets()
    ll.initialize_all_asmprinters()
    features = ",".join(f"+{feature}" for feature in FEATURES.split())
    machine = ll.Target.from_triple(_TRIPLE).create_target_machine(
        cpu="generic", features=features, opt=3, reloc="static", codemodel="default"
    )
    module = ll.parse_bitcode(code)
    module.triple, module.data_layout = _TRIPLE, str(machine.target_data)
    optimise(module, machine)
    called = {part.name for part in module.functions if part.is_declaration and not part.name.startswith("llvm.")}
    if called - ALLOWED:
        raise SystemExit(f"kernels call what WebAssembly does not have: {', '.join(sorted(called - ALLOWED))}")
    return bytes(machine.emit_object(module))


def link(folder: Path, exported: list[str], path: Path) -> None:
    """Link the object file of the kernels with the runtime."""
    ziglang = [sys.executable, "-m", "ziglang"]
    features = " ".join(f"-m{feature}" for feature in FEATURES.split())
    for source in ("wasm.c", "support.h"):
        (folder / source).write_bytes((FOLDER / source).read_bytes())
    options = (
        f"cc -target wasm32-freestanding -std=c11 -O2 {features} -ffreestanding -fno-sanitize=all -fno-builtin "
        "-c -o runtime.o wasm.c"
    )
    subprocess.run([*ziglang, *options.split()], cwd=folder, check=True)
    options = (
        f"wasm-ld --no-entry --gc-sections --strip-all --fatal-warnings --stack-first -z stack-size={_STACK} "
        f"--export-memory -O2 -o out.wasm kernels.o runtime.o {' '.join(f'--export={name}' for name in exported)}"
    )
    subprocess.run([*ziglang, *options.split()], cwd=folder, check=True)
    path.write_bytes((folder / "out.wasm").read_bytes())


def describe(lowered: Lowered) -> dict[str, Any]:
    """Return the table of a module: named tuples, kernels with their digests, and every entry with its types."""
    kernels: dict[str, Any] = {}
    for k, (signature, types, result, *slots) in enumerate(lowered.entries):
        own = kernels.setdefault(
            signature.kernel.removeprefix("graphsynth."), {"digest": lowered.digests[signature.kernel], "calls": []}
        )
        own["calls"].append([f"entry_{k}", types, result, *slots])
    return {"tuples": [[name, fields.split(",")] for name, fields in lowered.named], "kernels": kernels}


def build(name: str, output: Path) -> None:
    """Build one module into a folder."""
    lowered = lower(read_modules()[name])
    with TemporaryDirectory() as folder:
        (Path(folder) / "kernels.o").write_bytes(emit(lowered.code))
        exported = [f"entry_{k}" for k in range(len(lowered.entries))]
        link(Path(folder), exported, output / f"{name}.wasm")
    (output / f"{name}.json").write_text(f"{json.dumps(describe(lowered), indent=1)}\n", "utf-8")


def main() -> None:
    """Build the modules of the package."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=MODULES, help="folder (default: that of the package)")
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="modules to build (default: all)")
    options = parser.parse_args()
    names = options.modules or list(read_modules())
    if len(names) == 1 and all(os.environ.get(name) == value for name, value in ENVIRONMENT.items()):
        build(names[0], options.output)
        return
    for name in names:  # each in a process of its own, so that it does not depend on the others
        subprocess.run([*_WASM, "--output", str(options.output), name], env=os.environ | ENVIRONMENT, check=True)


if __name__ == "__main__":
    main()
