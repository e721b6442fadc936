"""The shipped tribometer scene against published values, other tribometers, and bad input."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import OutputsTable, Scene, find_scene, load_scene

SAID = ("records", "tables")
QUICK = {"tolerances": [1e-8], "steps_s": [1e-3], "speeds_m_s": [1e-3], "solvers": ["LSODA"]}
BELT = {
    "drive": {"kind": "belt", "belt_m_s": 0.02},
    "platform": {"mass_kg": 1, "stiffness_N_per_m": 400},
    "friction": {"static": 0.4, "kinetic": 0.25},
}


def changed(*products: str, **mechanism: Any) -> Scene:
    """The shipped scene with other products; tables of [mechanism] given here replace those of the file."""
    tables = tomllib.loads(find_scene("tribometer").read_text("utf-8"))
    tables["mechanism"] |= {"methods": QUICK} | mechanism
    tables["outputs"]["products"] = list(products)
    return Scene.from_mapping(tables)


@pytest.fixture(scope="module")
def report() -> Any:
    return execute(replace(load_scene("tribometer"), outputs=OutputsTable(SAID)))


def table(report: Any, title: str) -> Any:
    return next(t for t in report["tables"] if t.title.startswith(title))


@pytest.mark.long
def test_published_events(report: Any) -> None:
    """theory/tribometer 9, to the printed digits (accurate to about 1e-14)."""
    rows = table(report, "Events: 37").rows
    printed = [
        (0.365311879706055, "SLIP(-1)", -9.33904293982135), (0.608830310579125, "STICK", -2.62488891175237),
        (0.720893078952936, "SLIP(-1)", -9.53879049414652), (0.954741972884760, "STICK", -1.77238132861263),
    ]  # fmt: skip
    for row, (time, state, position) in zip(rows, printed):
        assert float(row[1]) == pytest.approx(time, abs=1e-14)
        assert row[3] == state
        assert float(row[4]) == pytest.approx(position, abs=3e-11)


def test_verdict_cycle_and_energies(report: Any) -> None:
    (record,) = report["records"]
    assert record.good and "37 changes" in record.verdict and "stick-slip cycle of 3.14159 s" in record.verdict
    value = {m.name: m.value for m in record.margins}
    assert value["relative error of the energy balance"] < 1e-9
    assert value["largest multiplier of the cycle"] == pytest.approx(0.0765, abs=1e-4)
    rows = dict(table(report, "Energy").rows)
    energies = {name: float(text.split()[0]) for name, text in rows.items()}
    rest = (
        energies["work of the drive"]
        - energies["heat of friction"]
        - energies["loss in the damper"]
        - energies["gained by platform and spring"]
    )
    assert abs(rest) < 1e-11 and "WARNING" not in rows["largest relative error of the balance"]


def test_methods_keep_failures(report: Any) -> None:
    """theory/tribometer 10: errors of the smoothed law, and what LSODA does at the end of the range."""
    rows = table(report, "The other methods").rows
    smooth = {row[1]: row for row in rows if row[0] == "LSODA"}
    for speed, error in (
        ("1e-02", 7.1e-3),
        ("1e-03", 1.14e-3),
        ("1e-04", 1.27e-4),
        ("1e-05", 1.62e-5),
        ("1e-06", 2e-6),
    ):
        assert float(smooth[speed][2]) == pytest.approx(error, rel=0.03)
    assert smooth["1e-07"][6] in ("unreliable", "complete")
    if smooth["1e-07"][6] == "complete":
        assert float(smooth["1e-07"][2]) < 3e-6
    assert smooth["1e-08"][6] == "failed" or float(smooth["1e-08"][2]) < 3e-7
    own = [row for row in rows if row[0] == "event-driven"]
    assert float(own[-1][2]) < 1e-12


@pytest.mark.long
def test_the_page(tmp_path: Any) -> None:
    run(changed("records", "tables", "mechanism_pictures", "animations", "plots"), out=tmp_path)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert page.count("<figure") == 1 + 1 + 10
    for words in ("Figure 7b", "Limit cycle", "Phase portrait", "Error of the energy", "prefers-reduced-motion"):
        assert words in page


def test_exact_belt_cycle() -> None:
    report = execute(changed(*SAID, **BELT))
    rows = dict(table(report, "Limit cycle").rows)
    # theory/tribometer 7
    assert float(rows["exact: period"].split()[0]) == pytest.approx(0.551496439575209089, abs=1e-15)
    assert float(rows["period"].split()[0]) == pytest.approx(0.551496439575209089, abs=1e-12)
    (record,) = report["records"]
    assert "(exact)" in record.verdict and record.good
    refused = [row for row in table(report, "The other methods").rows if row[0] == "LSODA"]
    assert refused and all(row[6] == "failed" and "two-coefficient" in row[7] for row in refused)


@pytest.mark.long
def test_event_storm_is_said() -> None:
    platform = {"mass_kg": 1, "stiffness_N_per_m": 4e8, "damping_N_s_per_m": 2}
    report = execute(changed(*SAID, "plots", "animations", platform=platform, run={"duration_s": 2, "samples": 401}))
    (record,) = report["records"]
    assert record.good is False and "Zeno behaviour" in record.verdict and "time_stepping" in record.verdict
    assert report["plots"] and report["animations"]
    assert not any(t.title == "The other methods" for t in report["tables"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "drive", [{"kind": "harmonic", "radius_mm": 30, "speed_rad_s": 2}, {"kind": "belt", "belt_m_s": 0}]
)
def test_other_drives_are_drawn(drive: Any) -> None:
    report = execute(
        changed(*SAID, "mechanism_pictures", "animations", "plots", drive=drive, run={"duration_s": 1, "samples": 201})
    )
    assert report["plots"] and report["animations"] and report["mechanism_pictures"]


@pytest.mark.parametrize(
    ("mechanism", "words"),
    [
        ({"friction": {"static": 0.25, "kinetic": 0.4}}, "kinetic friction coefficient 0.4 is above the static one"),
        ({"platform": {"mass_kg": -1, "stiffness_N_per_m": 400}}, "mass = -1.0 must be positive"),
        ({"platform": {"mass_kg": 1, "stiffness_N_per_m": 400, "load_N": -20}}, "platforms separate"),
        ({"drive": {"kind": "crank", "radius_mm": 30, "rod_mm": 30, "speed_rad_s": 2}}, "crank could not turn"),
        ({"drive": {"kind": "crank", "radius_mm": 30, "speed_rad_s": 2}}, "lacks rod_mm"),
        ({"drive": {"kind": "belt", "belt_m_s": 1, "rod_mm": 3}}, "has rod_mm"),
        ({"drive": {"kind": "rope"}}, "rope"),
        ({"run": {"duration_s": -1}}, "duration_s = -1"),
        ({"run": {"tolerance": 1.0}}, "relative tolerance is 1"),
        ({"methods": QUICK | {"steps_s": [-1.0]}}, "step = -1.0 must be positive"),
        ({"friction": {"static": 0.4, "kinetik": 0.25}}, "did you mean 'kinetic'"),
    ],
)
def test_bad_scenes_get_one_sentence(mechanism: Any, words: str) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        execute(changed(*SAID, **mechanism))
    assert "\n" not in str(caught.value)
