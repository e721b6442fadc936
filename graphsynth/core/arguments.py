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
    class only: no module is loaded for what is right.

    Parameters
    ----------
    error : type
        Exception of the caller's room.
    aliases : mapping of str to str, optional
        Other names of annotations.

    Examples
    --------
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


def _shown(value: Any) -> str:
    try:
        return " ".join(repr(value).split())[:60]
    except Exception:  # an integer of more digits than Python writes, an object that cannot be shown
        return f"of type {type(value).__name__}"


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
        if value is None and "None" in parts:
            return ""
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
        return partial(_mapping, _union(inner[1], words, module))
    if inner and (head in ("Iterable", "Sequence", "list") or (head == "tuple" and inner[1:] == ["..."])):
        return partial(_iterable, _union(inner[0], words, module))
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


def _number(value: Any) -> str:
    return "" if _real(value) is not None else f"= {_shown(value)} is not a real number; give one"


def _finite(value: Any) -> str:
    number = _real(value)
    if number is None:
        return f"= {_shown(value)} is not a real number; give a finite one"
    return "" if math.isfinite(number) else f"= {_shown(value)} is not finite; give a finite number"


def _positive(value: Any) -> str:
    number = _real(value)
    if number is not None and 0.0 < number < math.inf:
        return ""
    return f"= {_shown(value)} must be positive and finite; give a number above 0"


def _budget(value: Any) -> str:
    number = _real(value)
    return "" if number is not None and number > 0.0 else f"= {_shown(value)} must be positive; give a number above 0"


def _complex(value: Any) -> str:
    try:
        number = complex(math.nan) if isinstance(value, bool | np.bool_ | str | bytes) else complex(value)
    except (TypeError, ValueError, OverflowError):
        number = complex(math.nan)
    if math.isfinite(number.real) and math.isfinite(number.imag):
        return ""
    return f"= {_shown(value)} is not a finite complex number; give one"


def _whole(value: Any) -> str:
    try:
        number = operator.index(value)
    except TypeError:
        return f"= {_shown(value)} is not a whole number; give one"
    if isinstance(value, bool) or not -(2**63) <= number < 2**63:
        return f"= {_shown(value)} must be a whole number from -2^63 to 2^63 - 1; correct the value"
    return ""


def _count(value: Any) -> str:
    if not _whole(value) and operator.index(value) >= 1:
        return ""
    return f"= {_shown(value)} must be a positive integer; give 1 or more, below 2^63"


def _truth(value: Any) -> str:
    if isinstance(value, bool | np.bool_) or (isinstance(value, int) and value in (0, 1)):
        return ""
    return f"= {_shown(value)} is neither True nor False; give one of them"


def _text(value: Any) -> str:
    return "" if isinstance(value, str) else f"= {_shown(value)} is no text; give text"


def _path(value: Any) -> str:
    return "" if isinstance(value, str | Path) else f"= {_shown(value)} is no path; give text or a Path"


def _numbers(value: Any) -> str:
    try:
        kind = np.asarray(value).dtype.kind
    except (TypeError, ValueError) as error:
        return f"is not an array of numbers: {error}"
    return "" if kind in "biufc" else f"= {_shown(value)} is not an array of numbers; give finite ones"


def _callable(value: Any) -> str:
    return "" if callable(value) else f"= {_shown(value)} cannot be called; give a function"


def _iterable(entries: Look | None, value: Any) -> str:
    if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
        return f"= {_shown(value)} is no list; give a list of entries"
    if entries is not None and hasattr(value, "__len__"):  # a generator can be read only once
        for place, entry in enumerate(value):
            if wrong := entries(entry):
                return f"[{place}] {wrong}"
    return ""


def _mapping(values: Look | None, value: Any) -> str:
    if not hasattr(value, "items"):
        return f"= {_shown(value)} is no mapping; give a dict"
    if values is not None:
        for key, entry in value.items():
            if wrong := values(entry):
                return f"[{key!r}] {wrong}"
    return ""


_SIMPLE: dict[str, Look] = {
    "float": _finite, "int": _whole, "bool": _truth, "str": _text, "complex": _complex, "Real": _number,
    "Positive": _positive, "Budget": _budget, "Count": _count, "ArrayLike": _numbers, "Path": _path,
    "Callable": _callable,
}  # fmt: skip
