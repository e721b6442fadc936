"""JSON Schema of scene files, made from the dataclasses that read them: what an editor completes is what is read."""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Mapping
from typing import Any, Literal, Union, cast

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.scene import TABLES
from graphsynth.pipeline.system import system, system_names
from graphsynth.pipeline.tables import fields_of

_DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema_text() -> str:
    """Return the schema of scene files as JSON text, as shipped in ``docs/reference/scene.schema.json``."""
    return json.dumps(scene_schema(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def scene_schema() -> dict[str, Any]:
    """Return the schema of scene files (JSON Schema, draft 2020-12) for the families of graphsynth.

    >>> scene_schema()["required"]
    ['scene', 'mechanism', 'outputs']
    """
    rules: list[dict[str, Any]] = []
    names: list[str] = []
    for name in system_names():
        try:
            found = system(name)
        except SceneError:
            continue  # a system that this installation does not have
        names.append(name)
        then: dict[str, Any] = {"properties": {"mechanism": table_schema(found.table)}}
        if found.structure == "required":
            then["required"] = ["structure"]
        if found.structure == "none":
            then["properties"]["structure"] = False
        chosen = {"properties": {"mechanism": {"properties": {"module": {"const": name}}, "required": ["module"]}}}
        rules.append({"if": chosen, "then": then})
    module = {"type": "string", "examples": names, "description": "The system of mechanisms."}
    properties: dict[str, Any] = {name: table_schema(schema) for name, schema in TABLES.items()}
    properties["mechanism"] = {"type": "object", "properties": {"module": module}, "required": ["module"]}
    return {
        "$schema": _DRAFT,
        "title": "graphsynth scene",
        "type": "object",
        "properties": properties,
        "required": ["scene", "mechanism", "outputs"],
        "additionalProperties": False,
        "allOf": rules,
    }


def table_schema(schema: type) -> dict[str, Any]:
    """Return the schema of one table from its frozen dataclass.

    >>> @dataclasses.dataclass(frozen=True)
    ... class Bearing:
    ...     '''A bearing.'''
    ...     radius_mm: float
    >>> found = table_schema(Bearing)
    >>> sorted(found["properties"]), found["description"]
    (['radius', 'radius_mm'], 'A bearing.')
    """
    properties: dict[str, Any] = {}
    required: list[str] = []
    either: list[dict[str, Any]] = []
    for field in fields_of(schema):
        unit = field.unit.text
        value = _value(field.kind, unit, True)
        if isinstance(field.default, str | int | float) and str(field.default) not in ("nan", "inf", "-inf"):
            written = isinstance(field.default, float) and field.si
            value = {
                **value,
                "default": float(f"{field.unit.from_si(field.default):.12g}") if written else field.default,
            }
        properties[field.key] = value
        if field.alias:
            properties[field.alias] = _value(field.kind, unit, False)
            names = [{"required": [field.key]}, {"required": [field.alias]}]
            either.append({"oneOf": names} if field.required else {"not": {"required": [field.key, field.alias]}})
        elif field.required:
            required.append(field.key)
    found: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    summary = (schema.__doc__ or "").strip().partition("\n")[0]
    if summary and not summary.startswith(schema.__name__ + "("):
        found["description"] = summary.replace("``", "")
    return found | ({"required": required} if required else {}) | ({"allOf": either} if either else {})


def _value(kind: Any, unit: str, bare: bool) -> dict[str, Any]:
    """Return the schema of a value; `bare` says whether a number without a unit may stand there."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return table_schema(cast(type, kind))
    if origin is Literal:
        return {"enum": list(inner)}
    if origin in (Union, types.UnionType):
        return _value(next(part for part in inner if part is not type(None)), unit, bare)
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return {"type": "array", "items": _value(inner[0], unit, bare)}
        items = [_value(part, unit, bare) for part in inner]
        return {"type": "array", "prefixItems": items, "items": False, "minItems": len(items)}
    if origin is not None and issubclass(origin, Mapping):
        return {"type": "object"}
    if kind is float:
        return _number(unit, bare)
    return {"type": {str: "string", int: "integer", bool: "boolean"}[kind]}


def _number(unit: str, bare: bool) -> dict[str, Any]:
    text: dict[str, Any] = {"type": "string", "pattern": "^\\s*[+-]?[0-9.]"}
    if unit:
        text["examples"] = [f"17.5 {unit}"]
    if not bare:
        return {**text, "description": f"with its unit, such as {unit}"}
    about = {"description": f"in {unit}, or text with a unit"} if unit else {}
    return {"anyOf": [{"type": "number"}, text], **about}
