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
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from graphsynth.core.compilation import Kernel
from graphsynth.core.native.doctor import kernels
from graphsynth.core.native.library import FOLDER, LEVELS, target
from graphsynth.core.native.signatures import LIST, Signature, code_of, parse, read_list

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
_ENVIRONMENT = {"NUMBA_OPT": "0", "PYTHONHASHSEED": "0", "GRAPHSYNTH_NATIVE": "0", "NUMBA_DISABLE_INTEL_SVML": "1"}


class Entry(NamedTuple):
    """A kernel for given types, which the runtime reads from ``types`` and ``result``, and its numbers of slots."""

    signature: Signature
    types: str
    result: str
    slots_in: int
    slots_out: int


def lower(signatures: list[Signature], levels: int) -> tuple[bytes, str]:
    """Let numba lower the kernels, and what they call, as one module of LLVM code, not optimised; and their table."""
    import llvmlite.binding as ll
    from llvmlite import ir
    from numba.core.registry import cpu_target
    from numba.core.runtime import rtsys
    from numba.core.runtime.nrtdynmod import create_nrt_module

    Kernel.building = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    context = cpu_target.target_context
    rtsys.initialize(context)
    modules = _collect_modules()
    named: list[tuple[str, str]] = []

    def number(name: str, fields: str) -> int:
        if (name, fields) not in named:
            named.append((name, fields))
        return named.index((name, fields))

    entries: list[Entry] = []
    calls = ir.Module("entries")
    for signature in signatures:
        place, _, own = signature.kernel.rpartition(".")
        try:
            kernel = getattr(import_module(place), own)
        except (ImportError, AttributeError):
            name = signature.kernel
            raise SystemExit(
                f"{LIST.name} names {name}, which is not there: correct the line, or take it out"
            ) from None
        try:
            types = parse(signature.types)
            kernel.dispatcher.compile(types)
            compiled = kernel.dispatcher.overloads[types]
            compiled.library._ensure_finalized()
        except Exception as error:
            error.add_note(f"The list has {signature.kernel}({signature.types}).")
            raise
        result = compiled.signature.return_type
        code = code_of(result, number)
        if "<" in code:
            raise ValueError(f"{signature.kernel} returns a named tuple; the library returns plain ones only")
        kind = context.call_conv.get_function_type(result, types)
        slots = _write_entry(ir.Function(calls, kind, compiled.fndesc.llvm_func_name), f"entry_{len(entries)}")
        entries.append(Entry(signature, "".join(code_of(part, number) for part in types), code, *slots))
    merged = ll.parse_assembly(str(create_nrt_module(context)[0]))
    for name in sorted({function.name for module in modules for function in module.functions}):
        if name.startswith("__excinfo_unwrap_args"):  # would make Python objects of what an exception tells
            nothing = ir.Function(calls, ir.FunctionType(ir.PointerType(), [ir.PointerType()]), name)
            ir.IRBuilder(nothing.append_basic_block()).ret(ir.Constant(nothing.ftype.return_type, None))
    for module in modules:
        for function in module.functions:
            if not function.is_declaration:
                function.linkage = "weak_odr"
    for module in [ll.parse_assembly(str(calls)), *modules]:
        merged.link_in(module, preserve=True)
    for part in (*merged.functions, *merged.global_variables):
        if not part.is_declaration and not part.name.startswith("entry_"):
            part.linkage = "internal"
    inlined = {"inline": "always"}.items()
    parts = {
        name: kernel for name, kernel in kernels().items() if kernel.compiled or inlined <= kernel.targetoptions.items()
    }
    digests = {name: kernel.digest for name, kernel in parts.items()}
    return merged.as_bitcode(), table(entries, named, digests, levels)


def _collect_modules() -> list[Any]:
    """Make numba keep its LLVM code: nothing is linked, optimised or loaded, and exceptions tell no line."""
    from numba.core.callconv import CPUCallConv
    from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary, JITCPUCodegen

    modules: list[Any] = []
    told = CPUCallConv.build_excinfo_struct

    def finalize(library: Any) -> None:
        library._finalized = True
        modules.append(library._final_module)

    CPUCodeLibrary.finalize = finalize
    JITCodeLibrary.get_pointer_to_function = lambda library, name: 0
    JITCPUCodegen.set_env = lambda codegen, name, env: None
    CPUCallConv.build_excinfo_struct = lambda own, kind, values, loc, name: told(own, kind, values, None, name)
    return modules


def _write_entry(kernel: Any, name: str) -> tuple[int, int]:
    """Write a function that takes the arguments from slots and puts the results into slots; how many there are."""
    from llvmlite import ir

    slot, word = ir.IntType(64), ir.IntType(64).as_pointer()
    ret, about, *kinds = kernel.function_type.args
    entry = ir.Function(kernel.module, ir.FunctionType(ir.IntType(32), [word, word, about]), name)
    builder = ir.IRBuilder(entry.append_basic_block())
    given = []
    for k, kind in enumerate(kinds):
        place = builder.gep(entry.args[0], [slot(k)])
        if isinstance(kind, ir.IntType) and kind.width < 64:
            given.append(builder.trunc(builder.load(place), kind))
        else:
            given.append(builder.load(builder.bitcast(place, kind.as_pointer())))
    row = builder.alloca(ret.pointee)
    builder.store(ir.Constant(ret.pointee, None), row)
    code = builder.call(kernel, [row, entry.args[2], *given])
    count = 0
    waiting = [builder.load(row)]
    while waiting:
        value = waiting.pop()
        if isinstance(value.type, ir.LiteralStructType | ir.ArrayType):
            waiting += [builder.extract_value(value, k) for k in reversed(range(len(value.type)))]
            continue
        if isinstance(value.type, ir.IntType) and value.type.width < 64:
            value = builder.zext(value, slot)
        place = builder.gep(entry.args[1], [slot(count)])
        builder.store(value, builder.bitcast(place, value.type.as_pointer()))
        count += 1
    builder.ret(code)
    return len(kinds), count


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
    plain, full = (ll.create_pipeline_tuning_options(speed) for speed in (0, 3))
    full.loop_vectorization = full.slp_vectorization = True
    for function in module.functions:
        if not function.is_declaration:
            builder = ll.create_pass_builder(machine, full)
            passes = builder.getFunctionPassManager()
            passes.add_refprune_pass()
            passes.run(function, builder)
    builder = ll.create_pass_builder(machine, plain)
    passes = builder.getModulePassManager()
    passes.add_loop_rotate_pass()
    passes.add_instruction_combine_pass()
    passes.add_jump_threading_pass()
    passes.add_refprune_pass()
    passes.run(module, builder)
    builder = ll.create_pass_builder(machine, full)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    passes.run(module, builder)
    wanted = {part.name for part in module.functions if part.is_declaration and not part.name.startswith("llvm.")}
    if wanted - ALLOWED:
        raise SystemExit(f"kernels call what the runtime does not have: {', '.join(sorted(wanted - ALLOWED))}")
    return bytes(machine.emit_object(module))


def table(entries: list[Entry], named: list[tuple[str, str]], digests: dict[str, str], levels: int) -> str:
    """Return the table of kernels in C."""
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
    code, header = lower(sorted(set(read_list())), len(processors))
    with TemporaryDirectory() as name, ThreadPoolExecutor(2) as pool:
        folder = Path(name)
        (folder / "kernels.bc").write_bytes(code)
        (folder / "table.h").write_text(header)
        emit_one = [*_BUILD, "--emit", str(folder), f"{machine}-{triple}"]
        own = [[*emit_one, processor, str(k)] for k, processor in enumerate(processors)]
        list(pool.map(lambda command: subprocess.run(command, check=True), own))
        place = f"{wanted}.2.17" if system == "linux-gnu" else wanted
        objects = " ".join(f"{k}.o" for k in range(len(processors)))
        options = (
            f"cc -target {place} -std=c11 -O2 -shared -fPIC -fvisibility=hidden -fno-sanitize=all "
            f"-DLEVELS={len(processors)} -I . -Wl,--gc-sections,--build-id=none -s -o out.so runtime.c {objects} -lm"
        )
        (folder / "runtime.c").write_bytes((FOLDER / "runtime.c").read_bytes())
        subprocess.run([sys.executable, "-m", "ziglang", *options.split()], cwd=folder, check=True)
        path.write_bytes((folder / "out.so").read_bytes())


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
    if any(os.environ.get(name) != value for name, value in _ENVIRONMENT.items()):
        os.execve(sys.executable, [*_BUILD, *sys.argv[1:]], os.environ | _ENVIRONMENT)
    build(options.target, options.output or FOLDER / f"{options.target}.so")


if __name__ == "__main__":
    main()
