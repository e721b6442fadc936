"""Models J and S against the reference tables of the specification and against independent integrations."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.dynamics.driven.run import RunStatus, run
from graphsynth.dynamics.driven.setup import DriveOptions, Plant
from graphsynth.dynamics.motors import DCMotor, LinearCharacteristic, Train
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

SOURCE = MotorDrivenPlatform.source


def motor(resistance=1.0, inductance=0.2, **more):
    return DCMotor(resistance, inductance, 0.1, 0.1, 20.0, 20.0, **more)


# theory/values-of-the-platform 8
TABLE = [
    (0.1, 2.4033800571171583, 11.711831447227500, -46.798323567474699),
    (0.5, 9.8953258428489656, 17.565682938423782, -2.6052707386754443),
    (1.0, 19.940899571736962, 26.757075249208201904, -14.156969137848878541),
]
STIFF = {
    1e-6: (0.940717161447994218, 20.4030285819691589, -10.1009777719170149),
    1e-9: (0.940716705441054680, 20.4030319415180893, -10.1009421277850057),
}
SMALL = {
    1e-4: [
        (0.1, 1.21979266736218662, 61.6927711834940697, 5.77152817789562795),
        (0.2, 3.60512421059527404, 13.9722363676436805, 1.993122707195798787),
        (0.5, 9.35025947738877073, 8.00542252687191984, 3.87735847227900913),
    ],
    1e-6: [
        (0.1, 1.29295237539991679, 84.2026011809437719, 4.42427873532167002),
        (0.2, 3.54799564962704616, 13.0358994626973162, 3.23609589385503273),
        (0.5, 9.28633740927496304, 7.24098426349515412, 4.77215941880156736),
    ],
    1e-8: [
        (0.1, 1.29387841391482991, 84.5956536480073230, 4.40698930157059533),
        (0.2, 3.54693177723573351, 13.0209084180801235, 3.25734340642864307),
        (0.5, 9.28519324710334634, 7.22812793274174505, 4.78573532259888253),
    ],
}


def rows(found):
    return np.column_stack([found.angle, found.speed, found.currents])[1:]


def test_model_j_reference_table():
    found = SOURCE(motor()).simulate([0.0, *(row[0] for row in TABLE)], rtol=1e-12)
    assert found.complete and found.model.startswith("J")
    np.testing.assert_allclose(rows(found), [row[1:] for row in TABLE], rtol=5e-13)
    assert found.energy_error < 1e-13 and found.electric_error < 1e-13
    actual = np.abs(rows(found) - [row[1:] for row in TABLE]).max(axis=0)
    assert (actual <= found.error).all()


@pytest.mark.parametrize("inductance", STIFF)
def test_model_j_stiff(inductance):
    found = SOURCE(motor(1.0, inductance)).simulate([0.0, 0.05], rtol=1e-12, reduce=False)
    np.testing.assert_allclose(rows(found)[0], STIFF[inductance], rtol=2e-14)
    assert found.steps < 400


@pytest.mark.parametrize("base", SMALL)
def test_model_j_with_small_inertia(base):
    drive = SOURCE(motor(10.0, 1.0), base_inertia=base)
    found = drive.simulate([0.0, 0.1, 0.2, 0.5], speed=1.0, rtol=1e-13)
    np.testing.assert_allclose(rows(found), [row[1:] for row in SMALL[base]], rtol=3e-13)
    assert found.energy_error < 1e-13


# theory/values-of-the-platform 9: time, fictitious time, u, M at the dead centres; states
DEAD = [
    (0.5, 0.10162899343909495, 0.12837435064682285, 1.1803822394017044, -0.055390988862672136),
    (1.5, 0.24299954470626854, 0.33389052895675168, 0.77086394522185665, -0.44089115912755996),
    (2.5, 0.41424883707612718, 0.59312004511856827, 1.1818024084368280, -0.57647724368264964),
]
STATES = [
    (0.1, 1.2938877977189777, 84.599656034566326, 1.1564064790191468, 0.44068140735362958),
    (0.2, 3.5469165117087514, 13.020694396832455, 0.59828446421631017, 0.32576431765157384),
    (0.5, 9.2851768505979327, 7.2279416134070526, 0.35788125799683115, 0.47859201586647162),
]


@pytest.fixture(scope="module")
def model_s():
    drive = SOURCE(motor(10.0, 1.0), base_inertia=0.0)
    return drive.simulate([0.0, 0.1, 0.2, 0.5], speed=1.0, rtol=1e-12)


def test_model_s_dead_centres(model_s):
    assert model_s.model.startswith("S") and model_s.complete and "artefact" in model_s.notes[0]
    assert [event.kind for event in model_s.events] == ["dead centre"] * 3
    scale = 0.05 * math.sqrt(2.0)
    for event, (turns, t, s, u, M) in zip(model_s.events, DEAD):
        assert event.angle == pytest.approx(turns * math.pi, rel=1e-15)
        assert event.time == pytest.approx(t, rel=1e-14)
        assert event.fictitious_time * scale == pytest.approx(s, rel=1e-14)
        assert event.motion / math.sqrt(2.0) == pytest.approx(u, rel=1e-14)
        assert 0.1 * event.currents[0] == pytest.approx(M, rel=1e-12)


def test_model_s_states(model_s):
    found = np.column_stack([
        model_s.angle, model_s.speed, model_s.momentum / math.sqrt(2.0), model_s.motor_torque
    ])[1:]  # fmt: skip
    expected = np.array(STATES)[:, 1:]
    np.testing.assert_allclose(found[:, 1:], expected[:, 1:], rtol=1e-13)
    np.testing.assert_allclose(found[1:, 0], expected[1:, 0], rtol=1e-14)
    # the printed angle at 0.1 s contradicts the printed w and u, for u = L |cos q| w, in its eleventh digit
    from_speeds = math.acos(expected[0, 2] / (0.05 * expected[0, 1]))
    assert abs(from_speeds - expected[0, 0]) > 9e-11
    assert found[0, 0] == pytest.approx(from_speeds, rel=1e-14)
    assert model_s.energy_error < 1e-14


def test_model_s_is_the_limit_of_model_j(model_s):
    """The angle at 0.2 s approaches that of model S from above as J_0 falls; theory/motor-drive 3."""
    gaps = [abs(SMALL[base][1][1] - model_s.angle[2]) for base in (1e-4, 1e-6, 1e-8)]
    assert gaps[0] > 10 * gaps[1] > 100 * gaps[2] > 0.0


def test_inertia_down_to_1e_minus_14(model_s):
    """Spikes of 4e6 rad/s at dead centres; the distance to model S falls about in proportion to J_0.

    The angle is rounded to 2e-16 while the spike is sqrt(J_0 / (m L^2)) wide: that limits the energy balance.
    """
    gaps, peaks = [], []
    for base in (1e-10, 1e-12, 1e-14):
        drive = SOURCE(motor(10.0, 1.0), base_inertia=base)
        found = drive.simulate([0.0, DEAD[0][1], 0.2], speed=1.0, rtol=1e-11, estimate=False)
        assert found.complete and found.energy_error < 1e-12 + 2.3e-16 / math.sqrt(base / 0.005)
        gaps.append(abs(found.angle[-1] - model_s.angle[2]))
        peaks.append(found.speed[1])
    assert gaps[0] > 50 * gaps[1] > 2500 * gaps[2]
    assert peaks[0] > 5e4 and peaks[1] > 4e5 and peaks[2] > 4e6


def test_stiff_limits_cost_the_same_and_are_of_first_order():
    study = SOURCE(motor()).inductance_study([0.0, 0.02, 0.05], [10.0**-k for k in range(3, 13)])
    assert study.steps.max() < 250
    np.testing.assert_allclose(study.order[2:8], 1.0, atol=2e-3)
    at_end = abs(study.runs[3].angle[-1] - study.limit.angle[-1]) / 1e-6
    assert at_end == pytest.approx(0.46, abs=0.005)  # theory/motor-drive 4: about 0.46 rad per henry


def test_automatic_reduction_keeps_its_promise():
    times = np.linspace(0.0, 0.05, 6)
    kept = SOURCE(motor(1.0, 1e-9)).simulate(times)
    assert kept.currents.shape[1] == 1 and not kept.notes
    tiny = SOURCE(motor(1.0, 1e-12)).simulate(times)
    assert tiny.currents.shape[1] == 0 and "first order" in tiny.notes[0]
    full = SOURCE(motor(1.0, 1e-12)).simulate(times, reduce=False, rtol=1e-12)
    assert np.abs(tiny.angle - full.angle).max() < 1e-10
    zero = SOURCE(motor(1.0, 0.0)).simulate(times)
    assert "reduced model, exact" in zero.notes[0]
    forced = SOURCE(motor(1.0, 1e-6)).simulate(times, reduce=True, rtol=1e-12)
    said = float(forced.notes[0].split("angle ")[1].split(" rad")[0])
    real = np.abs(forced.angle - SOURCE(motor(1.0, 1e-6)).simulate(times, reduce=False, rtol=1e-12).angle).max()
    assert said == pytest.approx(real, rel=0.05)


def test_reversal_is_an_event():
    """Little inductance without inertia: the kinetic energy reaches zero near a dead centre (theory/motor-drive 3)."""
    found = SOURCE(motor(1.0, 0.1), base_inertia=0.0).simulate(np.linspace(0.0, 1.0, 101), speed=1.0)
    stalls = [event for event in found.events if event.kind == "stall"]
    assert found.complete and stalls
    assert all(abs(event.motion) < 1e-10 for event in stalls)
    assert found.energy_error < 1e-12


@pytest.mark.parametrize("count", [11, 321, 1281])
@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-8])
def test_error_is_estimated_from_above_however_dense_the_outputs(count, rtol):
    """Outputs that limit the steps of both runs must not hide the error."""
    found = SOURCE(motor()).simulate(np.linspace(0.0, 1.0, count), rtol=rtol)
    actual = np.abs(rows(found)[[(count - 1) // 2 - 1, -1]] - [row[1:] for row in TABLE[1:]]).max(axis=0)
    assert (actual <= found.error + 2e-13 * np.array([20.0, 30.0, 50.0])).all()


def test_rest_at_a_dead_centre_says_so():
    """The kinetic energy dies exactly where J vanishes: model S has no continuation there, and the reason says why."""
    drive = MotorDrivenPlatform(
        EffectiveInertia.of_slider(0.1332598003584945, 0.09162041481064319),
        DCMotor(
            2.310810549976273, 0.04469342315103243, 0.4783690154056197, 0.10447004049375043, 5.838930779194312,
            31.356057269576226,
        ),
        Train(3.5697091996194663), load=-0.02531458291571574,
    )  # fmt: skip
    for rtol in (1e-9, 1e-10, 1e-12):
        found = drive.simulate([0.0, 0.6, 1.3], angle=0.7671041258862648, speed=1.0997214360195429, rtol=rtol)
        assert (
            not found.complete
            and "rest at a dead centre, where model S ends" in found.reason
            and "J_0 > 0" in found.reason
        )
        assert np.isnan(found.angle[2]) and found.reached == 2
        last = found.events[-1]
        assert len(found.events) > 500 and abs(last.motion) < 1e-15 and abs(math.cos(last.angle)) < 1e-14


def test_regularised_form_of_any_inertia_agrees_with_the_form_with_inertia():
    """An inertia without zeros can be run in both forms."""
    inertia = EffectiveInertia(np.array([[0.08, 0.05, 0.01, 0.004, -0.01], [0.02, 0.0, 0.03, 0.01, 0.0]]))
    plant = Plant(inertia.rows, load_series=np.array([0.0, 0.02, -0.01]), load=-0.01)
    times = np.linspace(0.0, 1.0, 5)
    forms = (DriveOptions(speed=0.5, regular=regular, rtol=1e-12) for regular in (False, True))
    one, two = (run(plant, motor(1.0, 0.1), Train(), times, form) for form in forms)
    np.testing.assert_allclose(one.angle, two.angle, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(one.speed, two.speed, rtol=1e-11)
    np.testing.assert_allclose(one.currents, two.currents, rtol=1e-10, atol=1e-11)


def test_long_runs_keep_the_angle_within_a_turn():
    """A body that turns freely through 1e5 turns: one rounding of the whole angle, not one for every turn."""
    found = run(
        Plant(np.zeros((1, 1)), 1.0), LinearCharacteristic(0.0), Train(), [0.0, 1e5], DriveOptions(speed=2 * math.pi)
    )
    with mpmath.workdps(40):
        exact = mpmath.mpf(2 * math.pi) * 100000
        turns = mpmath.mpf(int(found.turns[-1])) * 2 * mpmath.pi
        assert abs(exact - turns - mpmath.mpf(float(found.reduced_angle[-1]))) < 2e-16 * exact
    assert abs(found.reduced_angle[-1]) <= 4 * math.pi and found.turns[-1] == 100000


def test_failures_are_reported():
    found = SOURCE(motor()).simulate([0.0, 0.1, 5.0], max_steps=100)
    assert found.status is RunStatus.TOO_MANY_STEPS and not found.complete and found.reached < 3
    assert np.isnan(found.angle[found.reached :]).all() and "max_steps" in found.reason


REFUSED = {
    "inertia vanishes": lambda: SOURCE(motor(), base_inertia=0.0).simulate([0, 1], speed=1.0, model="J"),
    "viscous friction": lambda: MotorDrivenPlatform(
        EffectiveInertia.of_slider(2, 0.05), motor(), friction=0.1
    ).simulate([0, 1], speed=1.0),
    "without inductance is unbounded": lambda: SOURCE(motor(1.0, 0.0), base_inertia=0.0).simulate([0, 1], speed=1.0),
    "voltage_limit = 24 is met": lambda: SOURCE(motor(voltage_limit=24.0), base_inertia=0.0).simulate([0, 1]),
    "leaves no singularity": lambda: SOURCE(motor()).simulate([0, 1], model="S"),
    "start is a dead centre": lambda: SOURCE(motor(), base_inertia=0.0).simulate(
        [0, 1], angle=EffectiveInertia.of_slider(2, 0.05).dead_centres[1], speed=1.0
    ),
    "inductance = 0 with the unreduced": lambda: SOURCE(motor(1.0, 0.0)).simulate([0, 1], reduce=False),
    "mass = -2": lambda: SOURCE(motor(), mass=-2.0),
    "base_inertia = -1": lambda: SOURCE(motor(), base_inertia=-1.0),
    "model = 'T'": lambda: SOURCE(motor()).simulate([0, 1], model="T"),
    "reduce = 'no'": lambda: SOURCE(motor()).simulate([0, 1], reduce="no"),
    "strictly increasing": lambda: SOURCE(motor()).simulate([0, 1, 1]),
    "1e-13 to 1e-3": lambda: SOURCE(motor()).simulate([0, 1], rtol=1e-16),
    "2 currents given": lambda: SOURCE(motor()).simulate([0, 1], currents=(0.0, 1.0)),
}


@pytest.mark.parametrize("said", REFUSED)
def test_refusals(said):
    with pytest.raises(SpecError, match=said) as caught:
        REFUSED[said]()
    assert "\n" not in str(caught.value)
