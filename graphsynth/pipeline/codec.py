"""Values of candidates as JSON and back: what a journal keeps and what travels between processes is the same text."""

from __future__ import annotations

import dataclasses
import json
import math
import typing
from collections.abc import Mapping
from typing import Any

from graphsynth.core.errors import FormatError, SceneError
from graphsynth.pipeline import products

__all__ = ["decode", "encode"]

_TAG = "~"  # names the dataclass, or "number" for one that JSON has no sign for
_CLASSES: dict[str, type] = {
    name: getattr(products, name)
    for name in ("Finding", "Objective", "Outcome", "Part", "Picture", "Quantity", "Ranking", "Record", "Table")
}


def encode(value: object) -> str:
    """Return a value as one line of JSON, the same for equal values.

    Parameters
    ----------
    value : object
        Text, numbers, booleans, None, lists, tuples, dictionaries with text keys, numpy scalars, and the frozen
        dataclasses of :mod:`graphsynth.pipeline.products`; nested.

    Raises
    ------
    SceneError
        For anything else; the message names the type.

    Examples
    --------
    >>> encode({"b": (1, 2.5), "a": float("inf")})
    '{"a": {"is": "inf", "~": "number"}, "b": [1, 2.5]}'
    """
    return json.dumps(_plain(value), ensure_ascii=False, sort_keys=True, allow_nan=False)


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {_TAG: "number", "is": repr(float(value))}
    if type(value).__name__ in _CLASSES and type(value) is _CLASSES[type(value).__name__]:
        fields = {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(typing.cast(Any, value))}
        return {_TAG: type(value).__name__, **fields}
    if isinstance(value, Mapping) and all(isinstance(key, str) and key != _TAG for key in value):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        return _plain(value.item())
    raise SceneError(
        f"a stage for each candidate gave a {type(value).__name__}, which cannot be kept as text; give text, numbers, "
        "tuples, dictionaries with text keys, or the dataclasses of graphsynth.pipeline.products"
    )


def decode(line: str) -> Any:
    """Return the value of a line; lists come back as tuples.

    Raises
    ------
    FormatError
        If the line is not one that :func:`encode` writes.

    Examples
    --------
    >>> decode(encode({"b": [1, float("-inf")]}))
    {'b': (1, -inf)}
    """
    try:
        return _value(json.loads(line))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise FormatError(f"not a line of results: {type(error).__name__}: {error}") from None


def _value(plain: Any) -> Any:
    if isinstance(plain, list):
        return tuple(map(_value, plain))
    if not isinstance(plain, dict):
        return plain
    tag = plain.get(_TAG)
    inner = {key: _value(value) for key, value in plain.items() if key != _TAG}
    if tag is None:
        return inner
    return float(inner["is"]) if tag == "number" else _CLASSES[tag](**inner)
