"""From kernels to LLVM code: numba types and lowers them once, unoptimised and for no processor in particular."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from graphsynth.core.compilation import Kernel
from graphsynth.core.native.doctor import kernels
from graphsynth.core.native.signatures import LIST, Signature, code_of, parse

#: What numba must be told before it is imported, so that the same sources give the same code.
ENVIRONMENT = {"NUMBA_OPT": "0", "PYTHONHASHSEED": "0", "GRAPHSYNTH_NATIVE": "0", "NUMBA_DISABLE_INTEL_SVML": "1"}


class Entry(NamedTuple):
    """A kernel for given types, which the runtime reads from ``types`` and ``result``, and its numbers of slots."""

    signature: Signature
    types: str
    result: str
    slots_in: int
    slots_out: int


class Lowered(NamedTuple):
    """Kernels as one module of LLVM code, not optimised; ``named``: names and fields of named tuples, by number."""

    code: bytes
    entries: list[Entry]
    named: list[tuple[str, str]]
    digests: dict[str, str]


def lower(signatures: list[Signature]) -> Lowered:
    """Let numba lower the kernels, and what they call, for no processor in particular."""
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
    return Lowered(merged.as_bitcode(), entries, named, digests)


def _collect_modules() -> list[Any]:
    """Make numba keep its LLVM code: nothing is linked, optimised or loaded, and exceptions tell no line or file."""
    from numba.core.callconv import CPUCallConv
    from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary, JITCPUCodegen

    modules: list[Any] = []
    told = CPUCallConv.build_excinfo_struct

    def tell(own: Any, kind: Any, values: tuple[Any, ...] | None, loc: Any, name: Any) -> Any:
        """Leave out where this machine keeps the sources: numba writes it into some messages, too."""
        short = [value.partition("\nFile ")[0] if isinstance(value, str) else value for value in values or ()]
        return told(own, kind, values and tuple(short), None, name)

    def finalize(library: Any) -> None:
        library._finalized = True
        modules.append(library._final_module)

    CPUCodeLibrary.finalize = finalize
    JITCodeLibrary.get_pointer_to_function = lambda library, name: 0
    JITCPUCodegen.set_env = lambda codegen, name, env: None
    CPUCallConv.build_excinfo_struct = tell
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


def optimise(module: Any, machine: Any) -> None:
    """Run the passes that numba runs, in place."""
    import llvmlite.binding as ll

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
