"""The jamming stage of the lambda scene: exact decimals, tolerances, tables that say what is proved."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction as F

import pytest

from graphsynth.core.errors import SceneError
from graphsynth.jamming import Verdict
from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.scene import OutputsTable, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.systems.lambda_linkage.model import LambdaLinkage
from graphsynth.systems.lambda_linkage.space import beside_small_tilts
from graphsynth.systems.lambda_linkage.stages import tolerance_box

EXAMPLE = {  # theory/jam-arcs 7
    "crank": "1e-2 %", "coupler": "1e-2 %", "alpha_rad": "1e-2 %", "azimuth_rad": 0.05, "radius_mm": 0.005,
    "height_mm": 0.05, "clearance_mm": 0.003,
}  # fmt: skip


def scene(tolerances=None, **mechanism):
    shipped = load_scene("lambda")
    return replace(shipped, mechanism=replace(shipped.mechanism, tolerances=tolerances or {}, **mechanism))


def test_numbers_of_the_file_are_decimals():
    box = tolerance_box(Context(scene()), tolerances=False)
    assert box.exact_input and box.is_point
    assert (box["clearance"].lower, box["alpha"].lower, box["l3"].lower) == (F(3, 100), F(1, 30), F(5, 2))


def test_a_dimension_changed_after_reading_is_the_double_it_is():
    changed = scene()
    changed = replace(
        changed, mechanism=replace(changed.mechanism, bearing=replace(changed.mechanism.bearing, clearance_mm=0.07))
    )
    box = tolerance_box(Context(changed), tolerances=False)
    assert box["clearance"].lower == F(0.07) and not box.exact_input


def test_the_tolerances_of_a_scene():
    box = tolerance_box(Context(scene(EXAMPLE)))
    assert (box["clearance"].lower, box["clearance"].upper) == (F(27, 1000), F(33, 1000))
    assert (box["l3"].lower, box["l3"].upper) == (F("2.49975"), F("2.50025"))
    assert (box["azimuth"].lower, box["Hb"].upper, box["l1"].is_point) == (F(-1, 20), F("10.05"), True)
    for bad, words in [({"crnk": 1}, "crank"), ({"crank": -1}, "zero or more"), ({"crank": "x %"}, "zero or more"),
                       ({"crank": True}, "zero or more")]:  # fmt: skip
        with pytest.raises(SceneError, match=words):
            tolerance_box(Context(scene(bad)))


def test_the_report_says_what_is_proved():
    wanted = replace(scene(EXAMPLE), outputs=OutputsTable(("records", "tables", "assessments")))
    report = execute(wanted)
    (record,) = report["records"]
    assert record.good is False and "for all parameters given (certified)" in record.verdict
    assert {m.name: m.guarantee for m in record.margins}["largest axis tilt"] == "certified"
    assert all(m.error < 1e-15 for m in record.margins if m.guarantee == "certified")
    (attempt,) = report["assessments"]
    certificate = attempt.value["A"].certificate
    assert certificate.verdict is Verdict.CERTIFIED_JAMMED
    assert certificate.largest_interference.lo > 0.0384521525 and certificate.smallest_worst_interference.lo > 0.0317465
    tables = {t.title: t for t in report["tables"]}
    proof = {row[0]: row[1:] for row in tables["What is proved about the bearing"].rows}
    assert proof["statement"][0].startswith("proved: every bearing of the tolerance box binds")
    assert proof["without tolerances"][0].startswith("proved: the bearing binds")
    assert "clearance [0.027, 0.033]" in tables["What is proved about the bearing"].note
    fits = {row[0]: row[2] for row in tables["Standard fits (ISO 286)"].rows}
    assert (fits["H7/g6"], fits["H11/b11"]) == ("every pair binds", "every pair is free")


def compared(**changes):
    """The table beside small tilts of the shipped scene with another tilt, as rows, note and what is said first."""
    table = load_scene("lambda").mechanism
    table = replace(table, tilt=replace(table.tilt, **changes))
    tilt = table.tilt
    linkage = LambdaLinkage(2, 1, 2.5, 2.5, alpha=tilt.alpha, axis=tilt.axis)
    found, said = beside_small_tilts(table, linkage)
    return found.rows, found.note, said


@pytest.mark.long
@pytest.mark.parametrize("alpha", [1 / 30, 0.3])
def test_the_scene_tells_exact_closure_beside_small_tilts(alpha):
    (alone, shared), note, (finding,) = compared(alpha=alpha)
    critical = 0.006064396559156420060266102798724801172486
    exact, small = math.asin(0.4 * math.sin(alpha)), 0.4 * alpha
    assert alone[1] == "90°" and alone[2:4] == (f"{exact / critical:.7g}", f"{small / critical:.7g}")
    assert alone[4] == f"{100 * (small / exact - 1):+.2g} %"
    assert "binds" in alone[-1] and "certified" in alone[-1] and "exact" in note
    if alpha == 1 / 30:  # 1/60 by theory: three equal bearings at 90 degrees (first order)
        assert (
            shared[3] == f"{1 / 60 / critical:.7g}" and "2.7483" in finding.text and "binds (certified)" in finding.text
        )


def test_a_free_linkage_is_told_too_and_others_are_left_out():
    (alone, shared), _, (finding,) = compared(alpha=0.01)
    assert alone[-1] == shared[-1] == "free there (certified)" and "it closes (certified)" in finding.text
    for changes in ({"axis": (1.0, 0.0, 0.1)}, {"alpha": 0.6}, {"alpha": 0.0}):
        rows, note, said = compared(**changes)
        assert rows == () and said == () and note.startswith("Only for")
