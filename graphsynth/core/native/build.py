"""Builds the library of kernels: ``python -m graphsynth.core.native.build [--target TARGET]``.

numba types and lowers the kernels of the list once, unoptimised and for no processor in particular; LLVM optimises all
of them together for every version of the code, with the passes that numba uses; ``runtime.c`` is compiled and linked
with them by the C compiler of the package ``ziglang``.  The same sources give the same bytes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from graphsynth.core.native.library import FOLDER, LEVELS, target
from graphsynth.core.native.lowering import ENVIRONMENT, Lowered, lower, optimise
from graphsynth.core.native.signatures import read_list
from graphsynth.core.wholefiles import replacing

_RUNTIME = (
    "NRT_Allocate NRT_Free NRT_MemInfo_alloc_aligned NRT_MemInfo_alloc_safe_aligned NRT_MemInfo_call_dtor numba_frexp "
    "NRT_MemInfo_alloc numba_ldexp numba_nextafter memcpy memmove memset memcmp"
)
_MATHEMATICS = (
    "acos asin atan atan2 cbrt ceil copysign cos cosh exp exp2 expm1 fabs floor fma fmod frexp hypot ldexp log log10 "
    "log1p log2 nearbyint pow rint round sin sinh sqrt tan tanh trunc"
)
#: What code of kernels may call.
ALLOWED = frozenset(_RUNTIME.split() + _MATHEMATICS.split())
_BUILD = (sys.executable, "-m", "graphsynth.core.native.build")


def emit(code: bytes, triple: str, processor: str, level: int) -> bytes:
    """Optimise for a processor, as numba does, and return an object file."""
    import llvmlite.binding as ll

    ll.initialize_all_targets()
    ll.initialize_all_asmprinters()
    machine = ll.Target.from_triple(triple).create_target_machine(
        cpu=processor, opt=3, reloc="pic", codemodel="default"
    )
    module = ll.parse_bitcode(code)
    module.triple, module.data_layout = triple, str(machine.target_data)
    for function in module.functions:
        if function.name.startswith("entry_"):
            function.name = f"{function.name}_{level}"
            function.visibility = "hidden"
    optimise(module, machine)
    wanted = {part.name for part in module.functions if part.is_declaration and not part.name.startswith("llvm.")}
    if wanted - ALLOWED:
        raise SystemExit(f"kernels call what the runtime does not have: {', '.join(sorted(wanted - ALLOWED))}")
    return bytes(machine.emit_object(module))


def table(lowered: Lowered, levels: int) -> str:
    """Return the table of kernels in C."""
    _, entries, named, digests = lowered
    names = [[f"entry_{k}_{level}" for level in range(levels)] for k in range(len(entries))]
    sizes = {
        "MAX_IN": max(entry.slots_in for entry in entries) + 2,
        "MAX_OUT": max(entry.slots_out for entry in entries) + 1,
        "MAX_ARRAYS": max(entry.types.count("A") for entry in entries) + 1,
    }
    rows: dict[str, list[int]] = {name: [] for name in sorted(digests)}
    for k, entry in enumerate(entries):
        rows[entry.signature.kernel].append(k)
    overloads = (
        f'{{"{entry.types}", "{entry.result}", "{entry.signature.types}", {{{", ".join(code)}}}, 0}},'
        for entry, code in zip(entries, names, strict=True)
    )
    lines = [
        f"enum {{ {', '.join(f'{name} = {size}' for name, size in sizes.items())}, KERNELS = {len(rows)} }};",
        *(f"extern int32_t {name}(const uint64_t *, uint64_t *, void **);" for code in names for name in code),
        "static Named named[] = {",
        *(f'{{"{name}", "{fields}", NULL}},' for name, fields in [*named, ("", "")]),
        "};",
        "static Overload overloads[] = {",
        *overloads,
        "};",
        "static const Kernel kernels[] = {",
        *(f'{{"{name}", "{digests[name]}", {min(k, default=0)}, {len(k)}}},' for name, k in rows.items()),
        "};",
        "",
    ]
    return "\n".join(lines)


def build(wanted: str, path: Path) -> None:
    """Build the library for a kind of machine."""
    machine, _, system = wanted.partition("-")
    triple = {"linux-gnu": "unknown-linux-gnu", "macos": "apple-macosx11.0", "windows-gnu": "pc-windows-gnu"}[system]
    processors = LEVELS.get(machine, ("",))
    lowered = lower(sorted(set(read_list())))
    with TemporaryDirectory() as name, ThreadPoolExecutor(2) as pool:
        folder = Path(name)
        (folder / "kernels.bc").write_bytes(lowered.code)
        (folder / "table.h").write_text(table(lowered, len(processors)))
        emit_one = [*_BUILD, "--emit", str(folder), f"{machine}-{triple}"]
        own = [[*emit_one, processor, str(k)] for k, processor in enumerate(processors)]
        list(pool.map(lambda command: subprocess.run(command, check=True), own))
        place = f"{wanted}.2.17" if system == "linux-gnu" else wanted
        objects = " ".join(f"{k}.o" for k in range(len(processors)))
        options = (
            f"cc -target {place} -std=c11 -O2 -shared -fPIC -fvisibility=hidden -fno-sanitize=all "
            f"-DLEVELS={len(processors)} -I . -Wl,--gc-sections,--build-id=none -s -o out.so runtime.c {objects} -lm"
        )
        for source in ("runtime.c", "support.h"):
            (folder / source).write_bytes((FOLDER / source).read_bytes())
        subprocess.run([sys.executable, "-m", "ziglang", *options.split()], cwd=folder, check=True)
        with replacing(path) as fresh:  # a process that has the old one loaded keeps it
            fresh.write_bytes((folder / "out.so").read_bytes())


def main() -> None:
    """Build a library beside this file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--target", default=target(), help=f"kind of machine (default: {target()})")
    parser.add_argument("--output", type=Path, help="file to write (default: beside this one, named by the target)")
    parser.add_argument("--emit", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.emit:
        folder, triple, processor, level = options.emit
        code = (Path(folder) / "kernels.bc").read_bytes()
        (Path(folder) / f"{level}.o").write_bytes(emit(code, triple, processor, int(level)))
        return
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()):
        os.execve(sys.executable, [*_BUILD, *sys.argv[1:]], os.environ | ENVIRONMENT)
    build(options.target, options.output or FOLDER / f"{options.target}.so")


if __name__ == "__main__":
    main()
