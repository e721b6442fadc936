"""Scene files: every mistake gives one sentence that names the file, the key and what was expected."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import FormatError, GraphsynthError, SceneError
from graphsynth.pipeline.scene import Scene, available_scenes, find_scene, load_scene


def test_shipped_scenes_are_found_by_name_and_by_path() -> None:
    assert {"didenko", "lambda"} <= set(available_scenes())
    assert load_scene("lambda") == load_scene(find_scene("lambda"))
    assert [load_scene(name).name for name in available_scenes()] == list(available_scenes())


def test_lambda_scene_has_the_published_dimensions() -> None:
    mechanism = load_scene("lambda").mechanism
    assert (mechanism.lengths.frame, mechanism.lengths.crank, mechanism.lengths.coupler, mechanism.lengths.rocker) == (
        2.0,
        1.0,
        2.5,
        2.5,
    )
    assert mechanism.tilt.alpha == 1 / 30
    assert (mechanism.bearing.radius_mm, mechanism.bearing.height_mm, mechanism.bearing.clearance_mm) == (
        17.5,
        10,
        0.03,
    )


def test_unknown_scene_names_the_available_ones() -> None:
    with pytest.raises(SceneError, match=r"'lambada'.*'didenko'.*'lambda'.*; did you mean 'lambda'"):
        find_scene("lambada")


@pytest.mark.parametrize("name", ["../scenes/lambda", "/etc/passwd", "", "lambda/../lambda"])
def test_a_name_cannot_leave_the_folders_of_shipped_scenes(name: str) -> None:
    with pytest.raises(SceneError):
        find_scene(name)


def spoil(tables: dict[str, Any], path: str, value: object) -> dict[str, Any]:
    *parents, last = path.split(".")
    at = tables
    for key in parents:
        at = at[key]
    if value is ...:
        del at[last]
    else:
        at[last] = value
    return tables


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("mechansim", {}, r"x\.toml has an unknown table \[mechansim\]; did you mean 'mechanism'"),
        ("scene.titel", "x", r"x\.toml: \[scene\] has an unknown key 'titel'; did you mean 'title'"),
        ("scene", ..., r"x\.toml lacks the table \[scene\]"),
        ("scene.name", ..., r"\[scene\] lacks the key 'name' \(a string\)"),
        ("scene.name", "../x", r"names a folder"),
        ("mechanism.lengths.crank", "long", r"\[mechanism.lengths.crank\] must be a finite number.*not 'long'"),
        ("mechanism.lengths.crank", "1/0", r"\[mechanism.lengths.crank\] must be a finite number"),
        ("mechanism.lengths.crank", float("nan"), r"must be a finite number"),
        ("mechanism.lengths.crank", True, r"must be a finite number.*not True"),
        ("mechanism.lengths.crank", -1, r"\[mechanism.lengths\] has crank = -1.0; a length must be positive"),
        ("mechanism.lengths.crank", 10**400, r"must be a finite number"),
        ("mechanism.bearing.condition", "C", r"must be one of 'A', 'B', not 'C'"),
        ("mechanism.branch", True, r"must be one of 1, -1, not True"),
        ("mechanism.tilt.axis", [1, 0], r"must be a list of 3 values, not 2"),
        ("mechanism.tilt.axis", [0, 0, 0], r"must not vanish"),
        ("mechanism.tilt.axis", [0, "x", 0], r"\[mechanism.tilt.axis.1\] must be a finite number"),
        ("mechanism.positions", 3, r"positions = 3; use 8 to 1000000"),
        ("mechanism.positions", 36.0, r"must be an integer, not 36.0"),
        ("mechanism.module", "lambda_linkge", r"did you mean 'lambda_linkage'"),
        ("mechanism.module", ..., r"lacks the key 'module'"),
        ("mechanism", 3, r"\[mechanism\] must be a table"),
        ("structure.question", 3, r"\[structure.question\] must be a table, not 3"),
        ("structure.generate", {"symmetry": 5}, r"\[structure.generate\] has symmetry 5; 2 and 3 are known"),
        ("structure.generate", {"fixed_moving_links": 2}, r"without a rotation; add symmetry = 3"),
        ("structure.generate", {"fixed_moving_links": 2, "symmetry": 2}, r"without a rotation; add symmetry = 3"),
        ("outputs.products", [], r"at least one output"),
        ("outputs.products", ["tables", "tables"], r"twice"),
        ("outputs.products", "tables", r"must be a list, not 'tables'"),
    ],
)
def test_a_spoilt_scene_says_where_and_what(
    lambda_tables: dict[str, Any], path: str, value: object, message: str
) -> None:
    with pytest.raises(SceneError, match=message):
        Scene.from_mapping(spoil(lambda_tables, path, value), "x.toml")


def test_not_toml_and_not_utf8_give_the_place(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text("[scene\n", encoding="utf-8")
    with pytest.raises(FormatError, match=r"bad\.toml: not TOML.*line 1"):
        load_scene(path)
    path.write_bytes(b'[scene]\nname = "\xff"\n')
    with pytest.raises(FormatError, match=r"bad\.toml, byte 16: not UTF-8"):
        load_scene(path)
    path.write_text("a = " + "9" * 5000, encoding="utf-8")
    with pytest.raises(FormatError, match="not TOML"):
        load_scene(path)


json_like = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
PATHS = [
    "scene",
    "scene.name",
    "structure",
    "structure.question",
    "mechanism",
    "mechanism.module",
    "mechanism.lengths",
    "mechanism.tilt.axis",
    "mechanism.bearing.condition",
    "outputs",
    "outputs.products",
]


@given(path=st.sampled_from(PATHS), value=json_like)
def test_any_value_anywhere_is_read_or_refused_with_a_sentence(path: str, value: object) -> None:
    import tomllib

    tables = copy.deepcopy(tomllib.loads(find_scene("lambda").read_text(encoding="utf-8")))
    try:
        Scene.from_mapping(spoil(tables, path, value), "x.toml")
    except GraphsynthError as error:
        assert "x.toml" in str(error)
