"""Arguments are what a function's annotations say; anything else is refused with a sentence, before work begins."""

from __future__ import annotations

import ast
import inspect
import math
import operator
import re
from collections.abc import Callable, Mapping
from functools import cache, partial, wraps
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wording import shown

#: Packages whose classes are told apart.
_TOLD_APART = ("graphsynth", "fractions")
F = TypeVar("F", bound=Callable[..., Any])
#: Looks at a value: what is wrong with it, as the end of a sentence that begins with its name; "" for nothing.
Look = Callable[[Any], str]

#: Annotations that say more than ``float`` and ``int`` do.
Real = float  # infinite or NaN too
Positive = float  # above zero and finite
Budget = float  # above zero; infinite is no limit
Count = int  # 1 or more


def checker(error: type[GraphsynthError], aliases: Mapping[str, str] | None = None) -> Callable[[F], F]:
    """Return a decorator that lets a function, or a dataclass, keep what its annotations say.

    Kept are ``float`` (finite), ``int``, ``bool``, ``str``, ``Real``, ``Positive``, ``Budget``, ``Count``,
    ``ArrayLike`` (numbers, NaN among them), ``Path``, ``Callable``, classes of the package and fractions, iterables
    and mappings of these, and what is joined by ``|``; any other annotation is left to the function.  What a name is
    says the function's module, its imports for type checking among them, which are followed for a value of another
    class only: no module is loaded for what is right.  ``error`` is the exception of the caller's room, ``aliases`` are
    other names of annotations.

    >>> from graphsynth.core.errors import GeometryError
    >>> @checker(GeometryError)
    ... def half(size: float, parts: "Count" = 2) -> float:
    ...     return size / parts
    >>> half("x")
    Traceback (most recent call last):
        ...
    graphsynth.core.errors.GeometryError: size = 'x' is not a real number; give a finite one
    """
    known = _SIMPLE | {name: _SIMPLE[meaning] for name, meaning in (aliases or {}).items()}

    def decorate(function: Any) -> Any:
        if isinstance(function, type):
            function.__init__ = decorate(function.__init__)  # type: ignore[misc]
            return function
        signature, module = inspect.signature(function), getattr(function, "__globals__", {})
        looks = {}
        for name, parameter in signature.parameters.items():
            annotation = parameter.annotation
            look = _union(
                annotation if isinstance(annotation, str) else getattr(annotation, "__name__", ""), known, module
            )
            if look is not None:
                looks[name] = look

        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            for name, value in signature.bind(*args, **kwargs).arguments.items():
                if name in looks and (wrong := looks[name](value)):
                    raise error(f"{name} {wrong}")
            return function(*args, **kwargs)

        return call

    return decorate


def _split(text: str, at: str) -> list[str]:
    """Split an annotation at commas or bars that stand in no brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[(") - (letter in "])")
        if letter == at and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def _union(annotation: str, words: Mapping[str, Look], module: Mapping[str, Any]) -> Look | None:
    """Return the look at values of a whole annotation; None if one of its parts says nothing."""
    parts = _split(annotation, "|")
    looks = [_part(part, words, module) for part in parts if part != "None"]
    known = [look for look in looks if look is not None]
    if not known or len(known) < len(looks):
        return None

    def look(value: Any) -> str:
        ours = {base.__name__ for base in type(value).__mro__ if base.__module__.startswith("graphsynth.")}
        if (value is None and "None" in parts) or ours & (set(parts) - words.keys()):
            return ""  # no other class is looked up, which would import its module
        said = [look(value) for look in known]
        if "" in said:
            return ""
        if len(said) > 1 and all(isinstance(look, partial) and look.func is _instance for look in known):
            return f"is {type(value).__name__}, neither a {' nor a '.join(p for p in parts if p != 'None')}; give one"
        return said[0]

    return look


def _part(annotation: str, words: Mapping[str, Look], module: Mapping[str, Any]) -> Look | None:
    if annotation in words:
        return words[annotation]
    match = re.fullmatch(r"(\w+)\[(.*)\]", annotation)
    head, inner = (match[1], _split(match[2], ",")) if match else (annotation, [])
    if head == "Callable":
        return words[head]
    if head == "Mapping" and len(inner) == 2:
        return partial(_entries, "mapping; give a dict", _union(inner[1], words, module))
    if inner and (head in ("Iterable", "Sequence", "list") or (head == "tuple" and inner[1:] == ["..."])):
        return partial(_entries, "list; give a list of entries", _union(inner[0], words, module))
    return partial(_instance, annotation, module) if re.fullmatch(r"[A-Z]\w+", annotation) else None


def _instance(name: str, module: Mapping[str, Any], value: Any) -> str:
    if name in (base.__name__ for base in type(value).__mro__):
        return ""
    meant = module.get(name) or _imported_for_types(name, str(module.get("__file__")))
    if not isinstance(meant, type) or meant.__module__.partition(".")[0] not in _TOLD_APART:
        return ""
    return f"is {type(value).__name__}, no {name}; give one"


@cache
def _imported_for_types(name: str, file: str) -> Any:
    """Return what a module imports under a name for type checkers alone; None for nothing."""
    if not Path(file).is_file():
        return None
    for node in ast.walk(ast.parse(Path(file).read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and not node.level:
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    return getattr(import_module(str(node.module)), alias.name, None)
    return None


def _real(value: Any) -> float | None:
    """Return a real number as a float; None for anything else, an integer beyond the floats among it."""
    if isinstance(value, bool | np.bool_ | str | bytes):
        return None
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return None


def _says(holds: Callable[[Any], bool], wrong: str) -> Look:
    """Return the look at values of which something holds, and what is said of others."""
    return lambda value: "" if holds(value) else f"= {shown(value)} {wrong}"


def _finite(value: Any) -> str:
    number = _real(value)
    if number is None:
        return f"= {shown(value)} is not a real number; give a finite one"
    return "" if math.isfinite(number) else f"= {shown(value)} is not finite; give a finite number"


def _is_complex(value: Any) -> bool:
    try:
        return not isinstance(value, bool | np.bool_ | str | bytes) and bool(np.isfinite(complex(value)))
    except (TypeError, ValueError, OverflowError):
        return False


def _whole(value: Any) -> str:
    try:
        number = operator.index(value)
    except TypeError:
        return f"= {shown(value)} is not a whole number; give one"
    if isinstance(value, bool) or not -(2**63) <= number < 2**63:
        return f"= {shown(value)} must be a whole number from -2^63 to 2^63 - 1; correct the value"
    return ""


def _numbers(value: Any) -> str:
    try:
        kind = np.asarray(value).dtype.kind
    except (TypeError, ValueError) as error:
        return f"is not an array of numbers: {error}"
    return "" if kind in "biufc" else f"= {shown(value)} is not an array of numbers; give finite ones"


def _entries(kind: str, look: Look | None, value: Any) -> str:
    """Look at the entries of a mapping, or of a list."""
    needed = "items" if kind.startswith("mapping") else "__iter__"
    if isinstance(value, str | bytes) or not hasattr(value, needed):
        return f"= {shown(value)} is no {kind}"
    if look is not None and hasattr(value, "__len__"):  # a generator can be read only once
        for place, entry in value.items() if needed == "items" else enumerate(value):
            if wrong := look(entry):
                return f"[{place!r}] {wrong}"
    return ""


_SIMPLE: dict[str, Look] = {
    "float": _finite,
    "int": _whole,
    "ArrayLike": _numbers,
    "bool": _says(
        lambda value: isinstance(value, bool | np.bool_) or (isinstance(value, int) and value in (0, 1)),
        "is neither True nor False; give one of them",
    ),
    "str": _says(lambda value: isinstance(value, str), "is no text; give text"),
    "complex": _says(_is_complex, "is not a finite complex number; give one"),
    "Real": _says(lambda value: _real(value) is not None, "is not a real number; give one"),
    "Positive": _says(
        lambda value: 0.0 < (_real(value) or 0.0) < math.inf, "must be positive and finite; give a number above 0"
    ),
    "Budget": _says(lambda value: (_real(value) or 0.0) > 0.0, "must be positive; give a number above 0"),
    "Count": _says(
        lambda value: not _whole(value) and operator.index(value) >= 1,
        "must be a positive integer; give 1 or more, below 2^63",
    ),
    "Path": _says(lambda value: isinstance(value, str | Path), "is no path; give text or a Path"),
    "Callable": _says(callable, "cannot be called; give a function"),
}
