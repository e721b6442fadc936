"""The measurements: errors as they should be, failures as failures, and a wrong method found out."""

import math

import numpy as np
import pytest

from graphsynth import LambdaLinkage, ParallelPlatform
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.motors import DCMotor
from graphsynth.evidence import Effort, RowStatus, knees
from graphsynth.evidence.crossing import area_problem, crossing_problem
from graphsynth.evidence.drives import drive_work_precision
from graphsynth.evidence.enumeration import enumeration_problem
from graphsynth.evidence.jamming import arc_problem, exact_largest, lambda_problem
from graphsynth.evidence.position import NODES, _closed_row, four_bar, position_problem, precise_points
from graphsynth.jamming import Bearing, ToleranceBox
from graphsynth.systems.platform.evidence import double_root_problem
from graphsynth.systems.platform.evidence_direct import mode_problem
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

QUICK = Effort(rounds=1, quick=True)
SINE = "0.0133308643347"


def by(problem, method):
    rows = problem.of(method)
    assert rows, (method, problem.methods)
    return rows


def test_crossing():
    problem = crossing_problem(Bearing(), SINE, QUICK)
    errors = [row.error for row in by(problem, "Krawczyk boxes")]
    assert errors == sorted(errors, reverse=True) and errors[-1] < 1e-11
    assert by(problem, "exact hull")[0].error < 1e-14
    assert all(row.proved for row in problem.rows)
    assert by(problem, "Krawczyk boxes")[-1].default


def test_a_hull_without_the_crossing_is_a_failure(monkeypatch):
    from types import SimpleNamespace

    from graphsynth.evidence import crossing
    from graphsynth.jamming.intersection import surrogate_problem

    real = crossing.exact_hull

    def shifted(problem):
        found = real(problem)
        return SimpleNamespace(hull=found.hull + 1e-9)

    truth = crossing.precise_crossing(problem := surrogate_problem(Bearing(), SINE))
    assert crossing._hull_row(problem, truth, QUICK)[1].status is RowStatus.OK
    monkeypatch.setattr(crossing, "exact_hull", shifted)
    row = crossing._hull_row(problem, truth, QUICK)[1]
    assert row.status is RowStatus.FAILED and not row.good


def test_enclosures_that_miss_are_failures_however_narrow(monkeypatch):
    from graphsynth.evidence import crossing

    real = crossing.precise_crossing
    monkeypatch.setattr(crossing, "precise_crossing", lambda problem: tuple(v + 1e-9 for v in real(problem)))
    rows = crossing.crossing_problem(Bearing(), SINE, QUICK).rows
    assert rows[0].reason == "the hull does not hold the crossing"
    assert rows[-1].reason == "the enclosure does not hold the crossing" and rows[-1].default
    right = crossing.precise_area(Bearing(), SINE)
    monkeypatch.setattr(crossing, "precise_area", lambda bearing, sine: right + 1e-9)
    rows = by(crossing.area_problem(Bearing(), SINE, QUICK), "closed form, enclosed")
    assert {row.reason for row in rows} == {"the enclosure does not hold the area"}


def test_a_search_that_ends_with_its_start_box_has_no_result():
    first = by(crossing_problem(Bearing(), SINE, QUICK), "Krawczyk boxes")[0]
    assert first.status is RowStatus.FAILED and "start box" in first.reason


@pytest.mark.long
def test_coupled_joints_of_the_source():
    problem = lambda_problem(LambdaLinkage(), Bearing(), effort=QUICK)
    assert all(row.good for row in problem.rows)
    assert "closed form with 50 digits" in by(problem, "samples")[0].reference
    default = next(row for row in problem.rows if row.default)
    assert default.proved and default.error < 1e-4
    assert by(problem, "samples")[-1].error < 1e-3


def test_the_torque_of_binding_has_errors_of_its_sampling():
    from graphsynth.evidence.binding import binding_problem, exact_torque

    f = np.linspace(0.0, np.pi, 100_001)
    c = 0.03 * 0.1 / 0.25
    assert exact_torque() == pytest.approx(
        (900.0 * np.maximum(c * np.sin(f) - 0.006, 0.0) * c * np.cos(f)).max(), rel=1e-8
    )
    problem = binding_problem(QUICK)
    assert all(row.good for row in problem.rows)
    assert by(problem, "derivative of the energy")[-1].error < 1e-4


@pytest.mark.slow
def test_small_tilts_err_by_their_square():
    """Against the exact closure of the shipped press, tilted ten times as much."""
    from graphsynth.evidence.binding import small_tilts_problem
    from graphsynth.jamming.joints import JointLimits, Misalignment
    from graphsynth.mechanism.model import Mechanism

    press = Mechanism.slider_crank(0.04, 0.08)
    given = {"tilt": Misalignment(0, 1, 0.05, 0.5), "joints": JointLimits(0.025), "stiffness": 4e4}
    problem = small_tilts_problem(press, given, "a press", math.tau, QUICK)
    assert all(row.good for row in problem.rows)
    assert 1e-5 < by(problem, "small tilts")[-1].error < 0.05**2
    with pytest.raises(GeometryError, match="free"):
        small_tilts_problem(press, given | {"joints": JointLimits(0.4)}, "a press", math.tau, QUICK)


@pytest.mark.slow
def test_coupled_joints_of_another_linkage_have_proved_bounds():
    linkage = LambdaLinkage(2.2, 1.0, 2.4, 2.3)
    assert exact_largest(linkage, Bearing()) is None
    problem = lambda_problem(linkage, Bearing(clearance=0.02), 0.3, effort=QUICK)
    assert all(row.good for row in problem.rows) and "(2.2, 1, 2.4, 2.3)" in problem.question
    assert "proved bounds of the certificate itself" in by(problem, "samples")[0].reference


def test_a_certificate_beside_the_reference_or_too_wide_is_a_failure():
    from graphsynth.evidence.jamming import _gap_row
    from graphsynth.jamming.joints.scale import ScaleCertificate

    def row(low, high, gap=0.1, reason=""):
        found = ScaleCertificate(low, high, 0.0, 10, reason, 0.1)
        return _gap_row(found, gap, (1.21, 1.21, "closed form"), (0.1, 1), default=False)

    assert row(1.2, 1.22).good and row(1.21, 1.22).good
    assert row(1.22, 1.23).status is row(1.19, 1.2).status is RowStatus.FAILED
    assert row(1.2, 1.22, 1e-4, "out of pieces").reason == "out of pieces"


def test_areas():
    problem = area_problem(Bearing(), SINE, QUICK)
    polygon = by(problem, "polygon, double precision")
    # of second order in the corners, so the errors fall with their square
    corners = [int(row.setting.split()[0]) for row in polygon]
    orders = [
        math.log(a.error / b.error) / math.log(n / m) for a, b, m, n in zip(polygon, polygon[1:], corners, corners[1:])
    ]
    assert all(1.5 < order < 2.5 for order in orders)
    assert by(problem, "closed form, enclosed")[0].error < 1e-12
    # boxes overlap so much that their sum says nothing: a failure, not a large error
    assert {row.status for row in by(problem, "interval shoelace sum")} == {RowStatus.FAILED}


def test_arc_ends():
    problem = arc_problem(ToleranceBox(alpha="1/30"), "A", QUICK)
    assert all(row.good for row in problem.rows)
    sweep = by(problem, "interval sweep")
    assert [row.default for row in sweep].count(True) == 1
    assert sweep[-1].error < 1e-11 and by(problem, "closed form, enclosed")[0].error < 1e-13
    assert [k.method for k in knees(problem) if k.default] == ["interval sweep"]


def test_arcs_that_miss_an_end_are_failures(monkeypatch):
    from graphsynth.evidence import jamming

    real = jamming.precise_arc_ends
    monkeypatch.setattr(
        jamming, "precise_arc_ends", lambda box, condition: tuple(end + 1e-3 for end in real(box, condition))
    )
    problem = jamming.arc_problem(ToleranceBox(alpha="1/30"), "A", QUICK)
    assert by(problem, "closed form, enclosed")[0].status is RowStatus.FAILED
    assert by(problem, "interval sweep")[-1].status is RowStatus.FAILED


def test_samples_that_jump_over_an_arc_are_unreliable():
    # a tilt just above the critical one: arcs of 2.5 degrees, in the middle of a step of 3.6 degrees
    problem = arc_problem(ToleranceBox(alpha="0.015165", azimuth="0.0314159"), "A", QUICK)
    coarse = by(problem, "samples, float64")[0]
    assert coarse.status is RowStatus.UNRELIABLE
    assert by(problem, "closed form, enclosed")[0].good


def test_a_bearing_that_never_jams_has_no_arc_ends():
    with pytest.raises(GeometryError, match="jams nowhere"):
        arc_problem(ToleranceBox(alpha="0.001"), "A", QUICK)


@pytest.fixture(scope="module")
def modes():
    theta = np.random.default_rng(3).uniform(-0.2, 0.2, (3, 3))
    return mode_problem(ParallelPlatform.g1(), theta, 0.5, "G1", QUICK)


def test_all_ways_to_the_modes_are_right(modes):
    assert all(row.good for row in modes.rows)
    assert max(row.error for row in by(modes, "sextic and Newton")) < 1e-14
    assert max(row.error for row in by(modes, "certified, one by one")) < 1e-12
    assert all(row.proved == row.method.startswith("certified") for row in modes.rows)


def test_newton_improves_the_eigenvalues(modes):
    raw, _, polished = by(modes, "companion eigenvalues")
    assert polished.error <= raw.error


def test_a_missing_mode_is_a_failure(monkeypatch):
    from graphsynth.systems.platform import evidence_direct as direct

    real = direct.precise_modes
    monkeypatch.setattr(direct, "precise_modes", lambda *given: real(*given)[:-1])
    problem = direct.mode_problem(ParallelPlatform.g1(), np.zeros((1, 3)), 0.5, "G1", QUICK)
    assert not any(row.good for row in problem.rows if not row.method.startswith("scipy"))


def test_a_proof_of_something_else_is_a_failure(monkeypatch):
    from graphsynth.systems.platform import evidence_direct as direct

    real = direct.precise_modes
    monkeypatch.setattr(direct, "precise_modes", lambda *given: real(*given) + 1e-8)
    problem = direct.mode_problem(ParallelPlatform.g1(), np.zeros((1, 3)), 0.5, "G1", QUICK)
    for method in ("certified, balls of floats", "certified, one by one"):
        assert {row.status for row in by(problem, method)} == {RowStatus.FAILED}


@pytest.mark.long
def test_near_a_double_root_doubles_give_up_and_say_so():
    problem = double_root_problem(QUICK)
    assert all(row.good for row in by(problem, "sextic and Newton"))
    doubles = by(problem, "the same, double precision only")
    assert doubles[0].good and not doubles[-1].good and doubles[-1].reason
    assert all(row.good for row in by(problem, "certified, up to 512 bits"))
    assert "right down to a distance 1e-13" in problem.sentences["sextic and Newton"]


@pytest.mark.long
def test_positions_of_a_four_bar():
    mechanism, closed = four_bar(LambdaLinkage())
    problem = position_problem(mechanism, "the lambda linkage", closed, effort=QUICK)
    assert all(row.good for row in problem.rows)
    for method in ("closed form", "engine, with events and derivatives"):
        assert max(row.error for row in by(problem, method)) < 2e-15
    assert max(row.error for row in by(problem, "engine and certificate")) < 1e-12
    scipy = [row.error for row in by(problem, "scipy root, pose by pose")]
    assert scipy[0] > 100 * scipy[-1]


def test_a_wrong_closed_form_has_its_error():
    mechanism, (name, closed) = four_bar(LambdaLinkage())
    grid = np.linspace(0.0, math.tau, NODES + 1)
    truth = precise_points(mechanism, grid)
    row = _closed_row((name, lambda f: closed(f) + 1e-5), grid, truth, 2.0, QUICK)
    assert abs(row.error - 0.5e-5) < 1e-12


def test_a_range_that_cannot_be_moved_is_refused():
    mechanism, closed = four_bar(LambdaLinkage(4.0, 3.0, 2.0, 2.5))
    with pytest.raises(GeometryError, match="motion ends"):
        position_problem(mechanism, "no turn", closed, effort=QUICK)


def test_enumeration_counts_right_and_states_its_growth():
    problem = enumeration_problem(QUICK)
    assert {row.error for row in problem.rows} == {0.0}
    assert "graphs^" in problem.sentences["count"] and "extrapolated: 14 links" in problem.sentences["count"]


def test_a_wrong_count_is_a_failure(monkeypatch):
    import graphsynth.synthesis as synthesis

    monkeypatch.setattr(synthesis, "count_chains", lambda n: 15 if n == 8 else {6: 2, 10: 230, 12: 6856}[n])
    problem = enumeration_problem(QUICK)
    assert [row.status for row in by(problem, "count")] == [RowStatus.OK, RowStatus.FAILED, RowStatus.OK, RowStatus.OK]


def test_what_an_integrator_does_not_finish_is_a_failure():
    machine = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, 0.1, 0.1, 20.0, 20.0))
    options = {"tolerances": (1e-8,), "solvers": ("DOP853",), "rounds": 1, "most_calls": 50}
    own, scipy = drive_work_precision(machine, [0.0, 0.1, 0.2], **options).rows
    assert own.status is RowStatus.OK and scipy.status is RowStatus.FAILED and math.isnan(scipy.error)
    assert scipy.reason == "more than 50 calls" and scipy.reference.endswith("(the same method)")
