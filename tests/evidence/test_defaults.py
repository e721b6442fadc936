"""The defaults that the page shows are those of the code, and every one that is measured is on the page."""

import re
from inspect import signature
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "accuracy.md"


def _functions():
    from graphsynth.dynamics.driven.setup import DriveOptions
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.jamming.bearing.sweep import sweep_linkage
    from graphsynth.jamming.intersection.boxes import krawczyk_boxes
    from graphsynth.jamming.joints.scale import largest_scale
    from graphsynth.kinematics.dimensional.api import embody
    from graphsynth.systems.platform import certify_full_turn
    from graphsynth.systems.platform.certified_assembly_modes import certify_direct
    from graphsynth.systems.tribometer.model import Tribometer

    named = (krawczyk_boxes, sweep_linkage, largest_scale, certify_direct, certify_full_turn, simulate_dynamics, embody)
    return {
        **{function.__name__: function for function in named}, "event_driven": Tribometer.event_driven,
        "time_stepping": Tribometer.time_stepping, "regularised": Tribometer.regularised, "simulate": DriveOptions,
    }  # fmt: skip


def _shown():
    """Rows of the table: function, parameters, values as written, verdict."""
    text = PAGE.read_text(encoding="utf-8")
    table = text[text.index("## The defaults") :]
    found = []
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `"):
            name = re.search(r"`(\w+)", cells[0])[1]
            parameters = re.search(r"\(`?([\w, ]+)`?\)", cells[0])[1].split(", ")
            found.append((name, parameters, cells[1].split(", "), cells[2]))
    return found


def _value(text):
    """Number at the begin of a cell, its unit left out; or the word itself."""
    number = re.match(r"\d[\d ]*(\.\d+)?(e-?\d+)?", text)
    return float(number[0].replace(" ", "")) if number else text


@pytest.mark.parametrize("row", _shown(), ids=lambda row: row[0])
def test_the_page_shows_the_defaults_of_the_code(row):
    name, parameters, values, verdict = row
    given = signature(_functions()[name]).parameters
    assert [given[parameter].default for parameter in parameters] == [_value(value) for value in values]
    assert re.match(r"(yes|\*\*coarser\*\*|finer|speed yes|within the noise|slower)", verdict), verdict


def test_every_default_that_is_measured_is_on_the_page():
    assert {name for name, *_ in _shown()} == set(_functions())
    # what asks the code for a default: nothing is marked as one by a number written down
    room = PAGE.parents[2] / "graphsynth" / "evidence"
    for path in [*room.glob("*.py")]:
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"default=\w+ == [\d.]", text), path
