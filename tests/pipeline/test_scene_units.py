"""Units written in scenes, and the line on which a key stands."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import given, strategies as st
from mpmath import mp, mpf

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.lines import key_lines
from graphsynth.pipeline.scene import Scene, find_scene, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import ANY_LENGTH, Place, read_table
from graphsynth.pipeline.units import SUFFIXES, Unit, convert, split_value
from graphsynth.systems.lambda_linkage.stages import tolerance_box


@dataclasses.dataclass(frozen=True)
class Sample:
    radius_mm: float = 0.0
    angle_rad: float = 0.0
    swing_deg: float = 0.0
    speed_rad_s: float = 0.0
    share: float = 0.0
    points_mm: tuple[tuple[float, float], ...] = ()
    spring: Annotated[float, Unit.parse("N m/rad")] = 0.0
    a: Annotated[float, ANY_LENGTH] = 0.0
    b: Annotated[float, ANY_LENGTH] = 0.0


# from the definitions of the units: value, key, number expected
READ = [
    ("radius_mm", "17.5 mm", 17.5),
    ("radius", "1.75 cm", 17.5),
    ("radius", "1 in", 25.4),
    ("radius_mm", "1/3 m", 1000 / 3),
    ("radius", "17500 um", 17.5),
    ("radius", "-2e-2 m", -20.0),
    ("angle_rad", "180 deg", math.pi),
    ("angle", "1 turn", math.tau),
    ("angle", "60 arcsec", math.pi / 10800),
    ("swing", "0.5 turn", 180.0),
    ("swing_deg", "3600 arcsec", 1.0),
    ("speed", "60 rpm", math.tau),
    ("speed", "360 deg/s", math.tau),
    ("share", "0.01 %", 1e-4),
    ("share", "5 ppm", 5e-6),
    ("spring", "2 N mm/rad", 0.002),
    ("spring", "2 N m", 2.0),
    ("spring", "3 kg m^2/s^2/rad", 3.0),
    ("radius", "1/10 mm", 0.1),
]


@pytest.mark.parametrize(("key", "text", "value"), READ)
def test_a_written_unit_is_converted(key: str, text: str, value: float) -> None:
    read = read_table(Sample, {key: text}, Place("x"))
    (changed,) = (v for f, v in dataclasses.asdict(read).items() if v != getattr(Sample(), f))
    assert changed == pytest.approx(value, rel=2**-53, abs=0)


REFUSED = [
    ("radius_mm", "2 deg", r'\[radius_mm\] must be a finite number in mm, or a length such as "17.5 mm", .* an angle'),
    ("radius_mm", "2 mmm", r"unknown unit 'mmm'"),
    ("radius", 2, r'\[radius\] must be a length with its unit, such as "17.5 mm", not 2'),
    ("radius", "2", r"must be a length with its unit"),
    ("radius_mm", "2 mm 3", r"unknown unit '3'"),
    ("radius_mm", "2 mm/", r"unknown unit 'mm/'"),
    ("angle_rad", "2 %", r"an angle such as \"17.5 rad\".*, which is a plain number"),
    ("angle_rad", "2 mm", r"which is a length"),
    ("share", "2 mm", r"which is a length"),
    ("speed_rad_s", "2 rad", r"an angular velocity such as"),
    ("speed_rad_s", "2 1/s", r"which is"),
    ("radius_mm", "1e999 mm", r"must be a finite number"),
    ("radius_mm", "nan mm", r"must be a finite number"),
    ("radius_mm", "1/0 mm", r"must be a finite number"),
    ("radius_mm", "mm", r"must be a finite number"),
    ("radius_mm", "17,5 mm", r"unknown unit"),
    ("points", [["1 mm", 2]], r"\[points.0.1\] must be a length with its unit"),
    ("points_mm", [["1 mm", "2 deg"]], r"\[points_mm.0.1\].*an angle"),
]


@pytest.mark.parametrize(("key", "value", "message"), REFUSED)
def test_a_wrong_unit_is_refused_with_what_was_expected(key: str, value: object, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        read_table(Sample, {key: value}, Place("x.toml"))


def test_one_value_given_twice_and_units_for_some_only() -> None:
    with pytest.raises(SceneError, match="gives both 'radius' and 'radius_mm'; remove one"):
        read_table(Sample, {"radius": "1 mm", "radius_mm": 1}, Place("x.toml"))
    with pytest.raises(SceneError, match="gives b without a unit and others with one"):
        read_table(Sample, {"a": "1 mm", "b": 2}, Place("x.toml"))
    assert read_table(Sample, {"a": "1 cm", "b": "2 mm"}, Place("x")).a == 10.0


@given(st.fractions(-(10**6), 10**6, max_denominator=10**6), st.sampled_from(sorted(set(SUFFIXES.values()))))
def test_conversion_to_si_and_back_is_the_identity(number: Fraction, text: str) -> None:
    unit = Unit.parse(text)
    si = Unit("", Fraction(1), 0, unit.dimensions)
    there, _ = convert(number, unit, si)
    back, _ = convert(there, si, unit)
    assert abs(back - number) <= abs(number) * Fraction(1, 10**50)


def test_angles_are_rounded_once() -> None:
    with mp.workdps(60):
        for text in ("17.5", "0.1", "359.999", "1e-7"):
            number, exact = convert(split_value(text)[0], Unit.parse("deg"), Unit.parse("rad"))
            assert float(number) == float(mpf(text) * mp.pi / 180) and not exact


def shipped_with(old: str, new: str) -> Scene:
    text = find_scene("lambda").read_text(encoding="utf-8")
    assert old in text
    text = text.replace(old, new)
    return Scene.from_mapping(tomllib.loads(text), "x.toml", text=text)


def test_the_lambda_scene_with_units_is_the_same_mechanism_and_as_exact() -> None:
    plain = load_scene("lambda")
    scene = shipped_with("radius_mm = 17.5", 'radius = "1.75 cm"')
    assert scene.mechanism == plain.mechanism
    assert tolerance_box(Context(scene)).describe() == tolerance_box(Context(plain)).describe()
    assert tolerance_box(Context(scene)).exact_input
    written = shipped_with("radius_mm = 0.005", 'radius_mm = "5 um"')
    assert tolerance_box(Context(written)).describe() == tolerance_box(Context(plain)).describe()
    degrees = tolerance_box(Context(shipped_with("azimuth_rad = 0.05", 'azimuth_rad = "9 deg"')))
    with mp.workdps(60):
        azimuth = degrees["azimuth"]
        assert float(mpf(azimuth.upper.numerator) / azimuth.upper.denominator) == float(mp.pi / 20)
        assert mpf(azimuth.upper.numerator) / azimuth.upper.denominator > mp.pi / 20  # outward


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius_mm = 17.5", 'radius_mm = "2 deg"', r"x\.toml, line (\d+): \[mechanism.bearing.radius_mm\] must be"),
        ("radius_mm = 17.5", "radios_mm = 17.5", r"x\.toml, line (\d+): \[mechanism.bearing\] has an unknown key"),
        ("radius_mm = 17.5", "radius_mm = -17.5", r"x\.toml, line (\d+): \[mechanism.bearing\] has radius_mm = -17.5"),
        ("crank = 1\n", 'crank = "1 cm"\n', r"x\.toml, line 24: \[mechanism.lengths\] gives frame without a unit"),
        ("[outputs]", "[output]", r"x\.toml, line (\d+) has an unknown table \[output\]"),
        ('condition = "A"', 'condition = "C"', r"x\.toml, line (\d+): \[mechanism.bearing.condition\] must be one of"),
        ('module = "lambda_linkage"', 'module = "lambda_link"', r"x\.toml, line (\d+): \[mechanism\] has module"),
    ],
)
def test_a_message_tells_the_line(old: str, new: str, message: str) -> None:
    import re

    with pytest.raises(SceneError, match=message) as caught:
        shipped_with(old, new)
    line = re.search(message, str(caught.value))
    assert line is not None
    text = find_scene("lambda").read_text(encoding="utf-8").replace(old, new).splitlines()
    if line.groups():
        assert new.strip() in text[int(line[1]) - 1]


NASTY = '''# [a]
"a.b" = """x
[c]
y = 1 \\""" still """""
lit = \'\'\'
k = 2
\'\'\' # k = 3
[t . "u v"]
list = [ # [not.this]
  1, "a]#", [ 2,
  3 ], {p.q = 1, r = [{s = "}"}]}
]
date = 1979-05-27T07:32:00Z
[[arr]]
x = 1
[[arr]]
x = 2
[arr.sub]
z = 3
[[arr.deep]]
w = "\\u0041"
'''


def flat(value: Any, path: tuple[str, ...] = ()) -> set[tuple[str, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = {path} if path else set()
    for key, inner in items:
        found |= flat(inner, (*path, str(key)))
    return found


@pytest.mark.parametrize("path", [None, *sorted(find_scene("lambda").parents[1].rglob("*.toml"))])
def test_the_locator_finds_every_key_tomllib_finds_and_no_other(path: Path | None) -> None:
    text = NASTY if path is None else path.read_text(encoding="utf-8")
    lines = key_lines(text)
    assert set(lines) == flat(tomllib.loads(text))
    rows = text.splitlines()
    for keys, line in lines.items():
        name = next(k for k in reversed(keys) if not k.isdigit())
        inside = any(k.isdigit() for k in keys)
        assert inside or name in rows[line - 1]


def test_lines_of_a_nasty_text() -> None:
    lines = key_lines(NASTY)
    assert lines["a.b",] == 2 and lines["lit",] == 5 and lines["t", "u v", "list"] == 9
    assert lines["t", "u v", "list", "2", "1"] == 11 and lines["t", "u v", "list", "3", "r", "0", "s"] == 11
    assert (
        lines["arr", "1", "x"] == 17
        and lines["arr", "1", "sub", "z"] == 19
        and lines["arr", "1", "deep", "0", "w"] == 21
    )


@given(st.text(max_size=60))
def test_any_text_is_walked_without_an_exception(text: str) -> None:
    key_lines(text)
