"""Motor of the platform: no inertia, reversal, stiff limits, long runs (platform page, 12.24 to 12.30, 14.8)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.dynamics.motors import DCMotor
    from graphsynth.evidence.stress.checks import Checks

__all__ = [
    "long_run", "no_inductance", "no_inertia", "no_platform", "no_resistance", "reversal", "small_inertia",
    "tiny_inductance",
]  # fmt: skip

#: Section 14.8: states at t = 0.05 s.
STIFF = {
    1e-6: ("0.940717161447994218394380038881", "20.4030285819691589682485989619", "-10.1009777719170149298445974132"),
    1e-9: ("0.940716705441054679889256091084", "20.4030319415180893104534063744", "-10.1009421277850056098482447579"),
}
#: Section 14.8: J_0 and states at 0.1, 0.2, 0.5 s.
SMALL = {
    1e-4: (
        ("1.21979266736218662224112769802", "61.6927711834940696615650480829", "5.77152817789562734626736336317"),
        ("3.60512421059527404973206858377", "13.9722363676436804524076444023", "1.993122707195798786532048382"),
        ("9.35025947738877072889303083696", "8.00542252687191983085631475378", "3.87735847227900910412640581411"),
    ),
    1e-6: (
        ("1.29295237539991679678429452859", "84.2026011809437718722278079648", "4.42427873532167001792759917759"),
        ("3.54799564962704615979175181689", "13.0358994626973162956765080881", "3.23609589385503273"),
        ("9.28633740927496304810393168956", "7.24098426349515412323862578814", "4.7721594188015673601815684463"),
    ),
    1e-8: (
        ("1.2938784139148299069932939387", "84.5956536480073229990564966482", "4.40698930157059532677961809341"),
        ("3.54693177723573350609728240955", "13.0209084180801234965431986004", "3.25734340642864307936082882162"),
        ("9.28519324710334633796453551845", "7.22812793274174504451820045214", "4.78573532259888253"),
    ),
}
#: Section 14.9, dead centres: angle over pi, t, fictitious time, u, M.
DEAD = (
    ("0.5", "0.1016289934390949297632169750667", "0.12837435064682284956417397624884",
     "1.1803822394017043594223754550868", "-0.055390988862672136313821516657711"),
    ("1.5", "0.24299954470626853795806190190837", "0.33389052895675168217928015367069",
     "0.77086394522185664644816921334545", "-0.4408911591275599431622326276029"),
    ("2.5", "0.41424883707612718411229424354903", "0.59312004511856826598673231614457",
     "1.1818024084368280262198119133523", "-0.57647724368264963907228808699796"),
)  # fmt: skip


def _motor(resistance: float = 1.0, inductance: float = 0.2) -> DCMotor:
    from graphsynth.dynamics.motors import DCMotor

    return DCMotor(resistance, inductance, 0.1, 0.1, 20.0, 20.0)


def _source(motor: Any, **more: Any) -> Any:
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    return MotorDrivenPlatform.source(motor, **more)


def small_inertia(check: Checks) -> None:
    """``J_0`` down to 1e-8 against printed states, to 1e-14 by the energy balance and the distance to model S."""
    for base, right in SMALL.items():
        found = _source(_motor(10.0, 1.0), base_inertia=base).simulate([0.0, 0.1, 0.2, 0.5], speed=1.0, rtol=1e-13)
        for k, (name, given) in enumerate((("q", found.angle), ("w", found.speed), ("I", found.currents[:, 0]))):
            column = [row[k] for row in right]
            check.values(f"J_0 = {base:g}: {name}", given[1:], column, relative=3e-13)
        check.below(f"J_0 = {base:g}: energy balance", found.energy_error, 1e-13)
    limit = _source(_motor(10.0, 1.0), base_inertia=0.0).simulate([0.0, 0.2], speed=1.0, rtol=1e-12).angle[1]
    gaps = []
    for base in (1e-10, 1e-12, 1e-14):
        drive = _source(_motor(10.0, 1.0), base_inertia=base)
        found = drive.simulate([0.0, 0.2], speed=1.0, rtol=1e-11, estimate=False)
        # the angle has a unit of 2e-16 while the spike is sqrt(J_0 / (m L^2)) wide
        check.below(f"J_0 = {base:g}: energy balance", found.energy_error, 1e-12 + 2.3e-16 / math.sqrt(base / 0.005))
        gaps.append(abs(found.angle[-1] - limit))
    check.agrees("distance to model S falls with J_0", gaps[0] > 50 * gaps[1] > 2500 * gaps[2], str(gaps))


def no_inertia(check: Checks) -> None:
    """Model S: the printed dead centres, a warning about the spikes, friction refused."""
    from graphsynth.dynamics.driven.inertia import EffectiveInertia
    from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

    found = _source(_motor(10.0, 1.0), base_inertia=0.0).simulate([0.0, 0.1, 0.2, 0.5], speed=1.0, rtol=1e-12)
    check.mentions("model", found.model, "S")
    check.mentions("warning", " ".join(found.notes), "artefact")
    scale = 0.05 * math.sqrt(2.0)
    check.says("dead centres", [event.kind for event in found.events], ["dead centre"] * 3)
    for event, (turns, t, s, u, M) in zip(found.events, DEAD):
        what = f"q = {turns} pi"
        check.value(f"{what}: angle / pi", event.angle / math.pi, turns, relative=1e-15, source="section 14.9")
        check.value(f"{what}: t", event.time, t, relative=1e-14, source="section 14.9")
        check.value(f"{what}: s", event.fictitious_time * scale, s, relative=1e-14, source="section 14.9")
        check.value(f"{what}: u", event.motion / math.sqrt(2.0), u, relative=1e-14, source="section 14.9")
        check.value(f"{what}: M", 0.1 * event.currents[0], M, relative=1e-12, source="section 14.9")
    rubbing = MotorDrivenPlatform(EffectiveInertia.of_slider(2, 0.05), _motor(), friction=0.1)
    check.refused("b > 0", lambda: rubbing.simulate([0, 1], speed=1.0), "viscous friction")
    check.refused(
        "model J without inertia",
        lambda: _source(_motor(), base_inertia=0.0).simulate([0, 1], speed=1.0, model="J"), "inertia vanishes",
    )  # fmt: skip


def reversal(check: Checks) -> None:
    """Kinetic energy reaches zero: events with time and angle, and the motion goes on through the reversal."""
    found = _source(_motor(1.0, 0.1), base_inertia=0.0).simulate(np.linspace(0.0, 1.0, 101), speed=1.0)
    stalls = [event for event in found.events if event.kind == "stall"]
    check.agrees("there are stalls", bool(stalls), str(len(stalls)))
    check.equals("the run is complete", found.complete, True)
    check.below("u at the stalls", max((abs(e.motion) for e in stalls), default=math.inf), 1e-10)
    inside = all(0.0 < event.time < 1.0 and math.isfinite(event.angle) for event in stalls)
    check.agrees("each has its time and angle", inside)
    check.below("energy balance", found.energy_error, 1e-12)
    reversed_ = (np.sign(found.speed[1:]) != np.sign(found.speed[:-1])).sum()
    check.agrees("the speed changes its sign", reversed_ >= 1, str(int(reversed_)))


def tiny_inductance(check: Checks) -> None:
    """``L_a`` from 1e-6 to 1e-12 H costs the same; printed states; first order to the limit."""
    for inductance, right in STIFF.items():
        found = _source(_motor(1.0, inductance)).simulate([0.0, 0.05], rtol=1e-12, reduce=False)
        given = [found.angle[1], found.speed[1], found.currents[1, 0]]
        check.values(f"L_a = {inductance:g}: q, w, I", given, right, relative=2e-14, source="section 14.8")
    study = _source(_motor()).inductance_study([0.0, 0.05], [10.0**-k for k in (5, 6, 7, 8, 9, 10, 11, 12)])
    check.agrees("steps for 1e-5 to 1e-12", study.steps.max() < 1.3 * study.steps.min() + 20, str(study.steps.tolist()))
    check.values("order between 1e-5 and 1e-8", study.order[:3], [1, 1, 1], absolute=2e-3, source="section 11.4")
    slope = abs(study.runs[1].angle[-1] - study.limit.angle[-1]) / 1e-6
    check.value("angle over inductance, rad/H", slope, "0.46", absolute=0.005, source="section 11.4")
    tiny = _source(_motor(1.0, 1e-12)).simulate([0.0, 0.05])
    full = study.runs[-1]
    check.value("L_a = 1e-12, reduced by itself", tiny.angle[-1], full.angle[-1], absolute=1e-10, source="full model")
    check.mentions("its note", " ".join(tiny.notes), "first order")


def no_inductance(check: Checks) -> None:
    """``L_a = 0``: the reduced model, said to be exact; against the closed form without platform."""
    found = _source(_motor(1.0, 0.0)).simulate([0.0, 0.05])
    check.mentions("note", " ".join(found.notes), "reduced model, exact")
    check.equals("currents kept", found.currents.shape[1], 0)
    near = _source(_motor(1.0, 1e-12)).simulate([0.0, 0.05], reduce=False, rtol=1e-12)
    check.value(
        "angle against L_a = 1e-12", found.angle[1], near.angle[1], absolute=1e-9, source="limit of the full model"
    )
    free = _source(_motor(1.0, 0.0), mass=0.0).simulate([0.0, 0.001, 0.01])
    # J w' = K_m (K (w_d - w) - c_e w) / r
    import mpmath as mp

    with mp.workdps(30):
        rate = mp.mpf("0.1") * mp.mpf("20.1") / mp.mpf("0.002")
        for k, t in ((1, "0.001"), (2, "0.01")):
            right = mp.mpf(400) / mp.mpf("20.1") * (1 - mp.exp(-rate * mp.mpf(t)))
            check.value(f"m = 0, t = {t}: w", free.speed[k], right, relative=1e-9, source="closed form of 14.10")
    check.refused("unreduced", lambda: _source(_motor(1.0, 0.0)).simulate([0, 1], reduce=False), "inductance = 0")


def no_resistance(check: Checks) -> None:
    """``r_a = 0`` works with an inductance, by the closed form; without one it is an input error."""
    from graphsynth.dynamics.motors import DCMotor

    _linear(check, 0.0)
    check.refused(
        "r_a = L_a = 0", lambda: DCMotor(0.0, 0.0, 0.1, 0.1, 20.0, 20.0), "resistance and inductance are both zero"
    )


def no_platform(check: Checks) -> None:
    """``m = 0``: under-damped, critical and over-damped, against the formulas of section 14.10 with 40 digits."""
    for resistance in (1.0, 4.0, 2.0 * 0.2 * math.sqrt(0.1 * 20.1 / (0.2 * 0.002)), 100.0, 1e5):
        _linear(check, resistance)


def _linear(check: Checks, resistance: float) -> None:
    import mpmath as mp

    times = [0.0, 0.003, 0.02, 0.1, 0.4]
    found = _source(_motor(resistance), mass=0.0).simulate(times, rtol=1e-12, reduce=False)
    with mp.workdps(60):
        L, J, Km, K, ce, wd = (mp.mpf(x) for x in (0.2, 0.002, 0.1, 20.0, 0.1, 20.0))
        a, wn2 = mp.mpf(resistance) / (2 * L), Km * (K + ce) / (L * J)
        wf, w_inf = mp.sqrt(mp.mpc(wn2 - a * a)), K * wd / (K + ce)
        speeds, currents = [], []
        for t in map(mp.mpf, times[1:]):
            decay = mp.exp(-a * t)
            sine = t if abs(wf) < mp.mpf(10) ** -20 else mp.sin(wf * t) / wf
            speeds.append((w_inf * (1 - decay * (mp.cos(wf * t) + a * sine))).real)
            currents.append((w_inf * J / Km * decay * wn2 * sine).real)
        size = max(abs(c) for c in currents)
    what, source = f"r_a = {resistance:.6g}", "closed form of 14.10"
    check.values(f"{what}: w", found.speed[1:], speeds, absolute=2e-10, source=source)
    check.values(f"{what}: I", found.currents[1:, 0], currents, absolute=float(1e-10 * size), source=source)


def long_run(check: Checks) -> None:
    """1e5 and 1e7 turns of a free body: angle modulo a turn kept, turns counted."""
    import mpmath as mp

    from graphsynth.dynamics.driven.run import Plant, run
    from graphsynth.dynamics.motors import LinearCharacteristic
    from graphsynth.dynamics.trains import Train

    for turns in (10**5, 10**7):
        end = float(turns)
        found = run(Plant(np.zeros((1, 1)), 1.0), LinearCharacteristic(0.0), Train(), [0.0, end], speed=2 * math.pi)
        with mp.workdps(40):
            right = mp.mpf(2 * math.pi) * turns
            given = mp.mpf(int(found.turns[-1])) * 2 * mp.pi + mp.mpf(float(found.reduced_angle[-1]))
            check.value(f"{turns:g} turns: angle", given, right, relative=2.3e-16, source="constant speed")
        check.agrees(
            f"{turns:g} turns: reduced", abs(found.reduced_angle[-1]) <= 4 * math.pi, str(found.reduced_angle[-1])
        )
        check.agrees(f"{turns:g} turns: counted", abs(int(found.turns[-1]) - turns) <= 1, str(int(found.turns[-1])))
