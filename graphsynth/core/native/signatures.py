"""Types of arguments as text: in the list of what is compiled ahead of time, for numba, and for the library.

``f8`` is a number as numpy names it, ``f8[2C]`` an array with its dimensions and order (``f8[2Cr]``: read only),
``(f8, i8)`` a tuple, ``package.module.Name(a: f8, b: i8[1C])`` a named tuple, ``none`` None and ``=1.0`` an argument
that was left out, with its default value.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

LIST = Path(__file__).with_name("signatures.txt")
_HEAD = """\
# Calls of kernels that are compiled ahead of time: made by ``python -m graphsynth.core.native.record``, sorted.
# A capital letter with a number stands for a named tuple of the first part.
"""
_NUMBERS = "b1 i1 u1 i2 u2 i4 u4 i8 u8 f4 f8 c16"
_LETTERS = dict(zip(_NUMBERS.split(), "?bBhHiIlLfdD", strict=True))
_TOKEN = re.compile(r"\s*([\w.]+(?:\[\d[ACF]r?\])?|=[^,()]+|[(),:])")


class Signature(NamedTuple):
    """A kernel and the types of its arguments, as in ``package.module.name(f8, i8[1C])``."""

    kernel: str
    types: str


def read_list(path: Path = LIST) -> list[Signature]:
    """Read the list; abbreviations of named tuples are written out."""
    short: dict[str, str] = {}
    found = []
    for line in path.read_text("utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        if " = " in line.split("(")[0]:
            name, text = line.split(" = ", 1)
            short[name] = text
        else:
            kernel, types = line[:-1].split("(", 1)
            found.append(Signature(kernel, re.sub(r"\b[A-Z]\w*'\d+", lambda name: short[name.group()], types)))
    return found


def write_list(signatures: set[Signature], path: Path = LIST) -> None:
    """Write the list, sorted; named tuples are written once."""
    short: dict[str, str] = {}
    lines = []
    for kernel, types in sorted(signatures):
        for text in sorted(set(re.findall(r"[\w.]+\.[A-Z]\w*\([^()]*\)", types))):
            if text not in short:
                name = text.split("(")[0].rsplit(".", 1)[1]
                short[text] = f"{name}'{1 + sum(known.split(chr(39))[0] == name for known in short.values())}"
            types = types.replace(text, short[text])
        lines.append(f"{kernel}({types})")
    heads = sorted(f"{name} = {text}" for text, name in short.items())
    path.write_text("\n".join([_HEAD, *heads, "", *lines, ""]), "utf-8")


def text_of(kind: Any) -> str:
    """Return the text of a numba type; TypeError for one that the library does not take."""
    from numba import types

    if isinstance(kind, types.Array) and kind.aligned:
        return f"{text_of(kind.dtype)}[{kind.ndim}{kind.layout}{'' if kind.mutable else 'r'}]"
    if isinstance(kind, types.NamedTuple):
        cls = kind.instance_class
        fields = ", ".join(f"{name}: {text_of(part)}" for name, part in zip(kind.fields, kind.types, strict=True))
        return f"{cls.__module__}.{cls.__qualname__}({fields})"
    if isinstance(kind, types.BaseTuple):
        return f"({', '.join(text_of(part) for part in kind)})"
    if isinstance(kind, types.Boolean):
        return "b1"
    if isinstance(kind, types.Integer | types.Float):
        return f"{'f' if isinstance(kind, types.Float) else 'i' if kind.signed else 'u'}{kind.bitwidth // 8}"
    if isinstance(kind, types.Omitted):
        return f"={kind.value!r}"
    if kind == types.complex128:
        return "c16"
    if kind == types.none:
        return "none"
    raise TypeError(f"arguments of type {kind} are not for the library")


def parse(text: str) -> tuple[Any, ...]:
    """Return the numba types of a list of arguments."""
    tokens = _TOKEN.findall(text)
    if "".join(tokens) != re.sub(r"\s", "", text):
        raise ValueError(f"cannot read the types {text!r}")
    tokens.append(")")
    return tuple(kind for _, kind in _arguments(tokens))


def _arguments(tokens: list[str]) -> list[tuple[str, Any]]:
    """Take the tokens up to the closing bracket; names of fields, where there are any, and types."""
    found = []
    while (token := tokens.pop(0)) != ")":
        if token == ",":
            continue
        name = ""
        if tokens[0] == ":":
            name, _, token = token, tokens.pop(0), tokens.pop(0)
        found.append((name, _argument(token, tokens)))
    return found


def _argument(token: str, tokens: list[str]) -> Any:
    from ast import literal_eval

    from numba import types
    from numba.np.numpy_support import from_dtype
    from numpy import dtype

    if token == "(":
        return types.Tuple([kind for _, kind in _arguments(tokens)])
    if tokens and tokens[0] == "(":
        tokens.pop(0)
        module, name = token.rsplit(".", 1)
        cls, fields = getattr(import_module(module), name), _arguments(tokens)
        if cls._fields != tuple(field for field, _ in fields):
            raise ValueError(f"{token} has other fields than in the list; record its calls again")
        return types.NamedTuple([kind for _, kind in fields], cls)
    if token == "none":
        return types.none
    if token.startswith("="):
        return types.Omitted(literal_eval(token[1:]))
    number, _, rest = token.partition("[")
    kind = types.boolean if number == "b1" else from_dtype(dtype(number))
    return types.Array(kind, int(rest[0]), rest[1], readonly=rest[2] == "r") if rest else kind


def code_of(kind: Any, named: Callable[[str, str], int]) -> str:
    """Describe a numba type for runtime.c; ``named`` numbers named tuples by their name and fields."""
    from numba import types

    if isinstance(kind, types.Array):
        return f"A{code_of(kind.dtype, named)}{kind.ndim}{kind.layout}{'w' if kind.mutable else 'r'}"
    if isinstance(kind, types.NamedTuple):
        number = named(kind.instance_class.__name__, ",".join(kind.fields))
        return f"<{number:02d}{''.join(code_of(part, named) for part in kind)})"
    if isinstance(kind, types.BaseTuple):
        return f"({''.join(code_of(part, named) for part in kind)})"
    if isinstance(kind, types.Omitted):
        return "O"
    return "N" if kind == types.none else _LETTERS[text_of(kind)]
