"""Invariants of stick-slip for tribometers of any kind."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
from hypothesis import assume, given, settings, strategies as st

from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import BeltDrive, CrankDrive, HarmonicDrive, StribeckLaw, TwoCoefficientLaw


def number(low, high):
    return st.floats(low, high, allow_nan=False).map(lambda value: float(f"{value:.6g}"))


drives = st.one_of(
    st.builds(BeltDrive, number(-0.5, 0.5)),
    st.builds(HarmonicDrive, number(0.005, 0.1), number(0.5, 30.0)),
    st.builds(lambda r, q, w: CrankDrive(r, r * q, w), number(0.005, 0.1), number(1.01, 10.0), number(-30.0, -0.5)),
)
static, share = number(0.1, 0.8), number(0.0, 1.0)
laws = st.one_of(
    st.builds(lambda a, b: TwoCoefficientLaw(a, a * b), static, share),
    st.builds(lambda a, b, v, d: StribeckLaw(a, a * b, v, d), static, share, number(0.005, 0.2), number(1.0, 3.0)),
)
models = st.builds(
    Tribometer, mass=number(0.1, 5.0), stiffness=number(10.0, 1e4), damping=number(0.0, 50.0), law=laws, drive=drives,
    x2=number(-0.02, 0.02),
    # a sliding of 1e-300 m/s and none at all may go different ways with two coefficients
    v2=st.one_of(st.none(), st.integers(-300, 300).map(lambda value: 1e-3 * value)),
)  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(models)
def test_invariants(model):
    times = np.linspace(0.0, 1.0, 501)
    motion = model.event_driven(1.0, times=times)
    known = ~np.isnan(motion.x2)
    state, u = motion.state[known], motion.sliding[known]
    assert (times[known] <= motion.end).all()
    # the sliding velocity has the sign of the state, and is zero in stick
    slack = 1e-12 * (1.0 + np.abs(motion.v1[known]))
    assert (state * u >= -slack).all()
    assert (u[state == 0] == 0.0).all()
    # the friction cone
    bound = model.law.static * model.normal
    assert (np.abs(motion.friction[known][state == 0]) <= bound * (1.0 + 1e-9)).all()
    # friction only takes energy away, and the books are balanced
    assert (np.diff(motion.path.nodes[:, 5]) >= -1e-18).all()
    stored = model.mass * np.abs(motion.v1).max() ** 2 + model.stiffness * np.nanmax(np.abs(motion.x2)) ** 2
    if motion.friction_loss + motion.damper_loss > 1e-4 * stored:  # else rounding is all there is to balance
        assert motion.energy_residual < 1e-9
    # events alternate in time and change the state
    states = [event.state for event in motion.events]
    assert all(a != b for a, b in pairwise(states))
    assert (np.diff([event.time for event in motion.events]) >= 0.0).all()


def clear(motion):
    """Whether no event is close to another outcome: captures across the cone, slips that end with a grazing."""
    model = motion.model
    for event in motion.events:
        drive = model.drive.motion(event.time)
        force = model.mass * drive.a + model.stiffness * event.position + model.damping * drive.v
        share = abs(float(force)) / (model.law.static * model.normal)
        if event.state == 0 and not (share < 0.9 and share < 0.9 * model.law.static / model.law.kinetic):
            return False
        if event.state != 0 and abs(float(model.mass * drive.j + model.stiffness * drive.v)) < 1.0:
            return False
    return True


@settings(max_examples=12, deadline=None)
@given(models.filter(lambda model: model.law.kinetic > 0.05))
def test_time_stepping_agrees(model):
    """An independent method, wrong by a multiple of its step: no event of the automaton is missing or invented."""
    exact = model.event_driven(1.0, times=np.linspace(0.0, 1.0, 101))
    assume(exact.complete and len(exact.events) < 30 and clear(exact))
    other = model.time_stepping(1.0, step=1e-5, times=exact.t)
    assume(other.error < 1e-3 * model.reach)
    assert np.abs(other.x2 - exact.x2).max() < 1e-2 * model.reach  # an event more or less makes a full reach


@settings(max_examples=40, deadline=None)
@given(drives, number(0.0, 10.0))
def test_drive_kinematics(drive, t):
    """Velocity, acceleration and jerk against derivatives with 40 digits of the printed displacement."""

    def displacement(at):
        if isinstance(drive, BeltDrive):
            return drive.speed * at
        C, S = mpmath.cos(drive.speed * at), mpmath.sin(drive.speed * at)
        if isinstance(drive, HarmonicDrive):
            return drive.radius * C
        r, rod = mpmath.mpf(drive.radius), mpmath.mpf(drive.rod)
        return r * C + mpmath.sqrt(rod**2 - r**2 * S**2) - rod

    with mpmath.workdps(40):
        exact = [float(value) for value in mpmath.diffs(displacement, mpmath.mpf(t), 3)]
    found = drive.motion(t)
    w = abs(drive.speed)
    fine = 1.0
    if isinstance(drive, CrankDrive):
        fine = 1.0 - (drive.radius / drive.rod) ** 2
    length = getattr(drive, "radius", 1.0)
    for power, (a, b) in enumerate(zip(found, exact)):
        assert abs(a - b) <= 1e-13 * (1.0 + w * t) * max(abs(b), length * w**power / fine**power)


@settings(max_examples=60, deadline=None)
@given(number(-12.0, 0.5), number(0.0, 3.0), number(-6.0, 0.0), st.sampled_from([-1.0, 1.0]))
def test_drive_beside_the_dead_centre(power, turns, distance, side):
    """Where crank and rod are nearly equal and at right angles, no digit is lost but those of the angle itself."""
    from graphsynth.systems.tribometer.kernels.plant import drive as compiled

    drive = CrankDrive(0.03, 0.03 * (1.0 + 10.0**power), 2.0)
    t = (np.floor(turns) + 0.25) * np.pi + side * 10.0**distance
    with mpmath.workdps(60):
        r, rod, w = map(mpmath.mpf, (drive.radius, drive.rod, drive.speed))

        def displacement(at):
            return r * mpmath.cos(w * at) + mpmath.sqrt(rod**2 - (r * mpmath.sin(w * at)) ** 2) - rod

        exact = mpmath.diffs(displacement, mpmath.mpf(t), 3)
        exact = [float(value) for value in exact]
        scale = float(mpmath.sqrt((rod / r) ** 2 - 1 + mpmath.cos(w * t) ** 2))
    rounding = 4e-16 * (1.0 + 2.0 * t) / min(scale, 1.0)  # the relative error of the distance to the dead centre
    model = Tribometer(drive=drive)
    for found in (drive.motion(t), compiled(model.data(), t)):
        for order, (a, b) in enumerate(zip(found, exact)):
            size = max(abs(b), 0.03 * 2.0**order / min(scale, 1.0) ** max(2 * order - 3, 0))
            assert abs(a - b) <= 20.0 * rounding * size
