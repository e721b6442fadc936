"""The JSON Schema shipped for editors: made from the dataclasses, and it takes what the reader takes."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from graphsynth.cli.main import main
from graphsynth.pipeline.scene import available_scenes, find_scene
from graphsynth.pipeline.schema import scene_schema, schema_text

SHIPPED = Path(__file__).parents[2] / "docs" / "reference" / "scene.schema.json"
TYPES: dict[str, type | tuple[type, ...]] = {
    "object": dict,
    "array": list,
    "string": str,
    "integer": int,
    "number": (int, float),
    "boolean": bool,
}


def valid(value: Any, schema: Any) -> bool:
    """JSON Schema, draft 2020-12, as far as the scene schema uses it."""
    if isinstance(schema, bool):
        return schema
    kind = schema.get("type")
    if kind and (not isinstance(value, TYPES[kind]) or (isinstance(value, bool) and kind in ("integer", "number"))):
        return False
    rules = [
        value in schema.get("enum", [value]) and value == schema.get("const", value),
        all(valid(value, part) for part in schema.get("allOf", ())),
        any(valid(value, part) for part in schema.get("anyOf", [True])),
        sum(valid(value, part) for part in schema.get("oneOf", [True])) == 1,
        "not" not in schema or not valid(value, schema["not"]),
        "if" not in schema or not valid(value, schema["if"]) or valid(value, schema["then"]),
        not isinstance(value, str) or re.search(schema.get("pattern", ""), value) is not None,
    ]
    if isinstance(value, dict):
        known = schema.get("properties", {})
        rules += [set(schema.get("required", ())) <= set(value)]
        rules += [valid(inner, known[key]) for key, inner in value.items() if key in known]
        rules += [schema.get("additionalProperties", True) or set(value) <= set(known)]
    if isinstance(value, list):
        first = schema.get("prefixItems", [])
        rules += [len(value) >= schema.get("minItems", 0)]
        rules += [valid(inner, part) for inner, part in zip(value, first)]
        rules += [valid(inner, schema.get("items", True)) for inner in value[len(first) :]]
    return all(rules)


def test_the_shipped_schema_is_the_one_of_the_dataclasses() -> None:
    assert SHIPPED.read_text(encoding="utf-8") == schema_text(), "graphsynth schema > docs/reference/scene.schema.json"


def test_the_command_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == scene_schema()


@pytest.mark.parametrize("name", available_scenes())
def test_shipped_scenes_are_valid(name: str) -> None:
    assert valid(tomllib.loads(find_scene(name).read_text(encoding="utf-8")), scene_schema())


@pytest.mark.parametrize(
    ("path", "value", "fine"),
    [
        ("mechanism.bearing.radius_mm", "1.75 cm", True),
        ("mechanism.bearing.radius_mm", True, False),
        ("mechanism.bearing.radius_mm", "wide", False),
        ("mechanism.bearing.radios_mm", 1.0, False),
        ("mechanism.bearing.radius", "1.75 cm", False),  # besides radius_mm
        ("mechanism.bearing.radius_mm", ..., False),
        ("mechanism.bearing.condition", "C", False),
        ("mechanism.tilt.axis", [1, 0], False),
        ("mechanism.tilt.axis", [1, 0, 0, 0], False),
        ("mechanism.positions", 36.5, False),
        ("mechanism.module", "single_motor_platform", False),
        ("structure", ..., False),
        ("outputs", ..., False),
        ("colours", {}, False),
        ("budget", {"time": "10 s"}, True),
        ("budget", {"time": 10}, False),
        ("ranking", {"objectives": [{"quantity": "mass", "goal": "max"}]}, True),
        ("ranking", {"objectives": [{"goal": "max"}]}, False),
    ],
)
def test_the_schema_tells_right_from_wrong(lambda_tables: dict[str, Any], path: str, value: Any, fine: bool) -> None:
    *parents, last = path.split(".")
    at = lambda_tables
    for key in parents:
        at = at[key]
    if value is ...:
        del at[last]
    else:
        at[last] = value
    assert valid(lambda_tables, scene_schema()) is fine
