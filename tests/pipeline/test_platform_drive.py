"""The scene of the motor-driven platform: printed tables in its report, the claim as it is, refusals, failures."""

from __future__ import annotations

import copy
import re
import tomllib
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import Scene, find_scene

SHIPPED = tomllib.loads(find_scene("didenko_drive").read_text("utf-8"))


@pytest.fixture
def tables() -> dict[str, Any]:
    """The shipped scene with a small map."""
    found = copy.deepcopy(SHIPPED)
    found["mechanism"]["claim"] |= {"map_resistances": 2, "map_inductances_H": [0.2, 0.01]}
    return found


def run(tables: dict[str, Any], *products: str) -> Any:
    changed = copy.deepcopy(tables)
    changed["outputs"]["products"] = list(products)
    return execute(Scene.from_mapping(changed, "x.toml"))


@pytest.fixture(scope="module")
def report() -> Any:
    tables = copy.deepcopy(SHIPPED)
    tables["mechanism"]["claim"] |= {"map_resistances": 2, "map_inductances_H": [0.2, 0.01]}
    return run(tables, "runs", "without_inertia", "claim", "limit", "records", "tables")


# theory/motor-drive 5: speed (rad/s) and current (A), peak to peak
PRINTED = [
    [(20.46, 42.8), (20.96, 42.5), (21.44, 41.2), (20.05, 34.1), (16.26, 22.5), (13.91, 12.3)],
    [(3.43, 28.9), (3.78, 28.1), (4.33, 26.3), (6.02, 21.9), (9.04, 17.5), (11.53, 11.5)],
    [(0.66, 20.6), (1.11, 20.6), (2.09, 20.6), (4.82, 19.3), (8.06, 16.2), (10.99, 11.0)],
    [(43.46, 370), (32.44, 269), (29.62, 211), (34.65, 132), (37.76, 74.6), (38.65, 38.7)],
]


@pytest.mark.long
def test_ripples_are_the_printed_ones(report: Any) -> None:
    for effect, expected in zip(report["claim"].effects.values(), PRINTED, strict=True):
        speeds = [s for s, _ in expected]
        # printed from samples: where the transient dies slowly the peaks lie between them (20.484, not 20.46)
        assert effect.simulated_speed[:2] == pytest.approx(speeds[:2], abs=0.025)
        assert effect.simulated_speed[2:] == pytest.approx(speeds[2:], abs=0.0051)
        assert effect.simulated_current == pytest.approx([i for _, i in expected], rel=5e-3)
    ratios = [effect.frequency_ratio for effect in report["claim"].effects.values()]
    assert ratios == pytest.approx([0.84, 0.42, 0.19, 0.56], abs=0.006)
    table = next(t for t in report["tables"] if t.title.startswith("Does a larger"))
    assert [row[3] for row in table.rows] == ["rises, then falls", "rises", "rises", "falls, then rises"]


@pytest.mark.long
def test_two_resistances_behave_as_the_source_says(report: Any) -> None:
    first, second = report["records"]
    one, two = ({m.name: m for m in record.margins} for record in (first, second))
    for name in ("steady speed ripple, peak to peak", "steady torque ripple, peak to peak"):
        assert two[name].value < one[name].value
    assert one["steady speed ripple, peak to peak"].value == pytest.approx(20.05, abs=0.006)
    assert two["steady torque ripple, peak to peak"].value == pytest.approx(1.23, abs=0.006)
    for item in report["runs"]:
        assert item.run.energy_error < 1e-9 and item.run.electric_error < 1e-9
        late = item.run.time > 1.0
        assert np.ptp(item.run.speed[late]) == pytest.approx({5.0: 20.048, 20.0: 13.910}[item.resistance], rel=5e-3)


@pytest.mark.long
def test_dead_centres_are_the_printed_ones(report: Any) -> None:
    table = next(t for t in report["tables"] if t.title.startswith("Without inertia"))
    printed = [
        (0.5, 0.10162899343909495, 0.12837435064682285, 1.1803822394017044, -0.55390988862672136),
        (1.5, 0.24299954470626854, 0.33389052895675168, 0.77086394522185665, -4.4089115912755996),
        (2.5, 0.41424883707612718, 0.59312004511856827, 1.1818024084368280, -5.7647724368264964),
    ]
    assert len(table.rows) == 3
    for row, expected in zip(table.rows, printed):
        assert row[0] == "dead centre" and [float(x) for x in row[1:]] == pytest.approx(expected, rel=2e-12)
    limit = next(t for t in report["tables"] if t.title.startswith("The model without"))
    angles = [float(row[1]) for row in limit.rows]
    assert angles == pytest.approx([9.35025947738, 9.28633740927, 9.28519324711, 9.28517685060], abs=2e-11)


@pytest.mark.long
def test_limit_is_of_first_order(report: Any) -> None:
    assert report["limit"].order[0] > 0.85 and report["limit"].order[1:] == pytest.approx(1.0, abs=0.01)
    assert report["limit"].steps.max() < 1.6 * report["limit"].steps.min()


def test_a_run_that_fails_is_told(tables: dict[str, Any]) -> None:
    tables["mechanism"]["platform"] |= {"inertia_kg_m2": 1e-17}
    tables["mechanism"]["claim"] |= {"cases": [], "resistances_ohm": [5, 20], "map_inductances_H": [0.2]}
    tables["mechanism"] |= {"tolerance": 1e-13}
    report = run(tables, "runs", "records", "tables")
    for item, record in zip(report["runs"], report["records"]):
        if item.run.complete:  # nothing is claimed about where double precision ends, only that it is said
            assert record.status == "assessed"
        else:
            assert record.status == "failed" and "step size vanished" in record.reason
            assert np.isnan(item.run.speed[item.run.reached :]).all()


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("motor", "inductance_H"), -0.1, r"inductance = -0.1 must be zero or more"),
        (("platform", "mass_kg"), -1, r"mass = -1.0 must be zero or more"),
        (("resistances_ohm",), [-5.0], r"resistance = -5.0 must be zero or more"),
        (("resistances_ohm",), [], r"has 0 resistances_ohm"),
        (("samples",), 2, r"samples = 2; use 20"),
        (("end_s",), -1.0, r"end_s = -1"),
        (("tolerance",), 1.0, r"rtol = 1 must be from"),
        (("claim", "resistances_ohm"), [5, 2], r"in increasing order"),
        (("motor", "gain"), "20 kg", r"gain"),
    ],
)
def test_bad_numbers_give_one_sentence(tables: dict[str, Any], place: tuple[str, ...], value: Any, said: str) -> None:
    at = tables["mechanism"]
    for key in place[:-1]:
        at = at[key]
    if place[-1] == "gain":
        del at["gain_V_per_rad_s"]
    at[place[-1]] = value
    with pytest.raises(SceneError, match=said) as caught:
        run(tables, "runs")
    assert "\n" not in str(caught.value) and "x.toml" in str(caught.value)


def test_friction_without_inertia_is_refused_with_its_place(tables: dict[str, Any]) -> None:
    tables["mechanism"]["platform"]["friction_Nm_s_per_rad"] = 0.01
    with pytest.raises(SceneError, match=r"without_inertia.*viscous friction"):
        run(tables, "without_inertia")


def test_zero_inductance_takes_the_reduced_motor(tables: dict[str, Any]) -> None:
    tables["mechanism"]["motor"]["inductance_H"] = 0
    (first, _) = run(tables, "runs")["runs"]
    assert first.run.currents.shape[1] == 0 and "reduced model, exact" in first.run.notes[0]


@pytest.mark.slow
def test_pictures_of_the_scene(tables: dict[str, Any]) -> None:
    report = run(tables, "mechanism_pictures", "animations", "plots")
    assert len(report["mechanism_pictures"]) == 2 and len(report["plots"]) == 10
    (moving,) = report["animations"]
    assert "<animateTransform" in moving.svg and "5 ohm" in moving.caption
    for picture in (*report["plots"], *report["mechanism_pictures"]):
        assert picture.svg.startswith("<svg") and not re.search(r"\bnan\b", picture.svg)


def test_the_real_machine_has_its_motor_in_its_own_scene() -> None:
    """Of `didenko`: energy, mean speed by the balance of the motor, and the claim that fails for the speed."""
    from graphsynth.pipeline.products import Attempt
    from graphsynth.pipeline.scene import load_scene
    from graphsynth.pipeline.stages import Context
    from graphsynth.systems.platform.motor_stages import drive_machine, tables
    from graphsynth.systems.platform.stages import PlatformMotion, platform_of

    scene = load_scene("didenko")
    assert {"drive_tables", "drive_curves"} <= set(scene.outputs.products)
    machine = platform_of(Context(scene))
    moved = PlatformMotion(machine, *[None] * 8)  # type: ignore[arg-type]  # the drive needs the mechanism alone
    runs = drive_machine(Context(scene), (Attempt(None, moved),))  # type: ignore[arg-type]
    assert [item.label for item in runs] == ["5 ohm", "20 ohm"]
    assert runs[0].drive.constant_inertia == pytest.approx(4 * (3e-6 + 2e-7) + 3 * 4e-6, rel=1e-14)
    for item in runs:
        assert item.run.complete and item.run.energy_error < 1e-9 and item.run.electric_error < 1e-9
        late = item.run.time >= 0.3
        mean = (item.run.angle[-1] - item.run.angle[late][0]) / (item.run.time[-1] - item.run.time[late][0])
        assert mean == pytest.approx(0.5 * 60 / 0.55 / 2, rel=5e-3)  # no load: the speed at which the current vanishes
    ripple = [np.ptp(item.run.speed[item.run.time >= 0.3]) for item in runs]
    torque = [np.ptp(item.run.motor_torque[item.run.time >= 0.3]) for item in runs]
    assert ripple[1] > 3 * ripple[0] and torque[1] < torque[0]
    assert tables(Context(scene), runs)[0].title == "Inertia seen by the motor"
    assert drive_machine(Context(scene), ()) == ()
