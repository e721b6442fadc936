"""What each format holds and how much of it: the table of the reference page, and what the readers say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import formats
from graphsynth.core.errors import FormatError, GeometryError, GraphError
from graphsynth.formats import dot, graphml, plain
from graphsynth.mechanism.files import JSON_MAX, TOML_MAX
from graphsynth.mechanism.joints import Cam, Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.testing import mechanisms

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "formats.md"
BAR = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1, (0.1, 0.2))])
CHAIN = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])


def _rows() -> dict[str, list[str]]:
    lines = PAGE.read_text().splitlines()
    start = lines.index("| format | suffix | graph | mechanism | several | longest |") + 2
    found = {}
    for line in lines[start:]:
        if not line.startswith("|"):
            break
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        found[cells[0].strip("`")] = cells[1:]
    return found


def _holds(items: list[object], name: str) -> bool:
    try:
        text = formats.write_text(items, name)
    except GraphError:
        return False
    return formats.read_text(text, name) == items


def test_the_page_lists_the_formats() -> None:
    assert list(_rows()) == list(formats.FORMATS)


@pytest.mark.parametrize("name", formats.FORMATS)
def test_the_table_of_the_page_is_true(name: str) -> None:
    suffixes, graph, mechanism, several, longest = _rows()[name]
    entry = formats.FORMATS[name]
    assert tuple(re.findall(r"`(\.\w+)`", suffixes)) == entry.suffixes and longest == entry.bounds
    framed = MechanismGraph(3, [(0, 1), (1, 2, 2)], frame=1, space=4)
    assert _holds([framed], name) == (graph == "yes")
    assert _holds([CHAIN], name) == (graph != "no")
    assert _holds([BAR], name) == (mechanism == "yes") == entry.mechanisms
    assert _holds([CHAIN, CHAIN], name) == (several != "no") == entry.many


def test_one_number_is_said_once() -> None:
    assert formats.FORMATS["json"].limit == JSON_MAX and formats.FORMATS["toml"].limit == TOML_MAX
    assert formats.FORMATS["graphml"].piece == graphml.LENGTH_MAX and formats.FORMATS["dot"].limit == dot.LENGTH_MAX
    assert formats.FORMATS["csv"].piece == plain.ROW_MAX
    page = PAGE.read_text().replace(" 000", "000")
    for number in (formats.GRAPHS_MAX, formats.JOINTS_MAX, dot.TOKENS_MAX):
        assert str(number) in page


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8) | st.sampled_from(
    [
        '"',
        "'",
        "a,b",
        "a\nb",
        "\r\n",
        "]]>",
        "<&>",
        "\\",
        '\\"',
        "\x00",
        "\x7f",
        "\u2028",
        "é",
        "𝄞",
        "#",
        "//",
        "key = 1",
    ]
)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name, entry in formats.FORMATS.items() if entry.mechanisms])
@settings(max_examples=25)
@given(drawn=mechanisms(4, 6, prismatic=True), names=st.lists(NAMES, max_size=3, unique=True))
def test_every_mechanism_comes_back_with_any_names(name: str, drawn: Mechanism, names: list[str]) -> None:
    points = {point: (0, (0.1 * k, -0.0)) for k, point in enumerate(names)}
    mechanism = Mechanism(drawn.graph, drawn.joints, drawn.drivers, points, drawn.pose)
    (back,) = formats.read_text(formats.write_text(mechanism, name).encode(), name)
    assert back == mechanism and repr(back) == repr(mechanism)


def test_half_a_character_cannot_be_written(tmp_path: Path) -> None:
    broken = Mechanism(BAR.graph, BAR.joints, points={"\ud800": (0, (0.0, 0.0))})
    with pytest.raises(GraphError, match="half of a character"):
        formats.write(broken, tmp_path / "x.json")
    assert not list(tmp_path.iterdir())
    with pytest.raises(FormatError, match="half a character"):
        Mechanism.from_json(BAR.to_json().replace('"points": {}', '"points": {"\\ud800": {"link": 0, "at": [0, 0]}}'))


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), max_size=6), st.floats(0.1, 6))
def test_a_cam_is_refused_when_its_radius_is_not_positive(harmonics: list[tuple[float, float]], radius: float) -> None:
    free = Cam(0, 1, radius=20.0, harmonics=tuple(harmonics))
    count = 64 * (len(harmonics) + 1)
    turn = 2.0 * 3.141592653589793 / count
    least = radius - 20.0 + min(free.pitch_radius(turn * k)[0] for k in range(count))
    if least > 1e-9:
        assert Cam(0, 1, radius=radius, harmonics=tuple(harmonics)).radius == radius
    elif least < -1e-9:
        with pytest.raises(GeometryError, match="make it positive everywhere"):
            Cam(0, 1, radius=radius, harmonics=tuple(harmonics))


def test_absurd_harmonics() -> None:
    for harmonics in (((1e308, 1e308),) * 9, ((1e308, 0.0),), ((1.0, 0.0),) * 1025):
        with pytest.raises(GeometryError):
            Cam(0, 1, radius=2.0, harmonics=harmonics)
    Cam(0, 1, radius=9e307, harmonics=((4e307, 0.0), (4e307, 0.0)))
