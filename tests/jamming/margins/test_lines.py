"""Linear bounds of the margin against members that are simulated and solved by themselves."""

from dataclasses import replace

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.jamming import joints_margin
from graphsynth.jamming.chance.paving import linear
from graphsynth.jamming.chance.probability import ChanceProblem
from graphsynth.jamming.joints.limits import SPHERICAL, JointLimits, Misalignment, SlideLimits
from graphsynth.jamming.margins.margin import JointsMargin
from graphsynth.tolerances import (
    AxisAngle,
    EndFloat,
    FitClearance,
    HolePosition,
    LengthTolerance,
    ThermalExpansion,
)

FOUR = gs.Mechanism.four_bar(2, 1, 2.5, 2.5)
PLAIN = {
    (0, 3): JointLimits(0.006, tilt_range=(0.005, 0.007)),
    (1, 2): JointLimits(0.006, tilt_range=(0.0055, 0.0065)),
    (2, 3): JointLimits(0.006, 0.004, tilt_range=(0.005, 0.007), axial_clearance_range=(0.0, 0.008)),
}


def four_bar(span: str = "30..120 deg", **changes: object) -> JointsMargin:
    """A four-bar with ranges of all limits, of the misalignment, and of two lengths."""
    given = {
        "joints": PLAIN,
        "tilt": Misalignment(0, 1, 0.012, 0.3, alpha_range=(0.010, 0.016), direction_range=(0.1, 0.5)),
        "tolerances": (LengthTolerance(1, (0, 2), 0.01), HolePosition(2, 3, 0.02)),
    } | changes
    return joints_margin(FOUR.simulate(span), **given)  # type: ignore[arg-type]


def crank_slider() -> JointsMargin:
    motion = gs.Mechanism.slider_crank(1.0, 3.0).simulate("10..170 deg")
    pairs = [joint.pair for joint in motion.mechanism.joints if joint.kind == "R"][1:]
    guide = next(joint.pair for joint in motion.mechanism.joints if joint.kind == "P")
    limits = {pair: JointLimits(0.006, tilt_range=(0.004, 0.008)) for pair in pairs}
    limits[guide] = SlideLimits(0.004, 0.003, 0.01, roll_range=(0.003, 0.005), pitch_range=(0.002, 0.004))
    driver = motion.mechanism.drivers[0]
    return joints_margin(motion, limits, Misalignment(driver.base, driver.link, 0.01, 1.0, alpha_range=(0.006, 0.014)))


def six_bar() -> JointsMargin:
    from graphsynth.kinematics.dimensional import embody

    mechanism = embody(next(iter(gs.enumerate_chains(6))), seed=0).mechanism
    motion = gs.simulate(mechanism, np.linspace(0.0, 1.5, 25))
    joint = mechanism.joints[-1]
    driver = mechanism.drivers[0]
    tilt = Misalignment(driver.base, driver.link, 0.01, 0.5, alpha_range=(0.004, 0.02))
    parts = [LengthTolerance(joint.b, _joints_of(mechanism, joint.b)[:2], 0.01), AxisAngle(*_others(mechanism), 0.001)]
    return joints_margin(motion, JointLimits(0.006, tilt_range=(0.004, 0.008)), tilt, parts)


def _joints_of(mechanism: gs.Mechanism, link: int) -> tuple[int, ...]:
    return tuple(joint.a + joint.b - link for joint in mechanism.joints if link in joint.pair)


def _others(mechanism: gs.Mechanism) -> tuple[int, int]:
    driver = mechanism.drivers[0]
    joint = next(joint for joint in mechanism.joints if joint.pair != driver.pair)
    return joint.a, joint.b


def fitted() -> JointsMargin:
    fits = [FitClearance((1, 2), "35 F7/h6", 10.0, 0.1), FitClearance((2, 3), "35 G7/h6", 10.0)]
    rest = [FitClearance((0, 3), "35 F7/h6", 10.0, condition="B"), EndFloat((1, 2), 0.0, 0.2)]
    heat = ThermalExpansion(-20.0, 30.0, {1: 1.2e-5, 2: 2.4e-5})
    tilt = Misalignment(0, 1, 0.004, 0.3, alpha_range=(0.002, 0.006))
    return four_bar(joints=None, tilt=tilt, tolerances=[*fits, *rest, AxisAngle(2, 3, 0.0005), heat])


def spherical() -> JointsMargin:
    return four_bar(joints=PLAIN | {(1, 2): SPHERICAL}, tolerances=(LengthTolerance(1, (0, 2), 0.005),))


def true_margin(margin: JointsMargin, x: np.ndarray, count: int = 241) -> float:
    """``1 - factor`` of one member, simulated with its own dimensions, at many inputs."""
    own = margin.quantities
    values = own.values([gs.Interval(float(v)) for v in x])
    mechanism = own.box.member(margin.motion.mechanism, x[: own.box.size]) if own.box.size else margin.motion.mechanism
    work = margin.stations.work
    motion = gs.simulate(mechanism, np.linspace(work.low, work.high, count), start=work.start)
    layout = own.layout
    limit = [0.0 if v is None else float(v.mid) for v in values.limits]
    play = [0.0 if v is None else float(v.mid) for v in values.plays]
    axes = []
    for (place, sign, axis), (a, b) in zip(layout.misalignments, values.vectors):
        a, b = float(a.mid), float(b.mid)
        axes.append((place, sign, replace(axis, alpha=float(np.hypot(a, b)), direction=float(np.arctan2(b, a)),
                     alpha_range=None, direction_range=None)))  # fmt: skip
    layout = replace(
        layout,
        limit=np.where(np.isinf(layout.limit), np.inf, limit),
        end_float=np.where(np.isinf(layout.end_float), np.inf, play),
        misalignments=tuple(axes),
    )
    given = replace(own.given, mechanism=mechanism, layout=layout)
    return float(1.0 - given.solve(motion.poses[motion.assembled], "scale").lower.max())


def check(margin: JointsMargin, sides: tuple[float, ...], members: int, seed: int) -> tuple[int, int]:
    """Random boxes with random members: what the lines prove must be so.  Return how many were proved of each kind."""
    rng = np.random.default_rng(seed)
    _, sources = ChanceProblem(margin, {}).model()
    n = len(sources.every)
    proved = [0, 0]
    for side in sides:
        low = np.round(rng.uniform(0.0, 1.0 - side, n) * 2**20) / 2**20
        lo, hi = low[None], np.minimum(low + np.round(side * 2**20) / 2**20, 1.0)[None]
        line, _ = linear(margin, sources, lo, hi, np.full(1, None, dtype=object))
        assert line.low[0] <= line.high[0]
        for _ in range(members):
            v = np.where(rng.random(n) < 0.5, rng.uniform(lo[0], hi[0]), np.where(rng.random(n) < 0.5, lo[0], hi[0]))
            at = float(line.weights[0] @ (v - 0.5 * (lo + hi)[0]))
            m = true_margin(margin, sources.sampled([np.array([value]) for value in v])[0])
            if at < line.low[0]:
                assert m < 1e-4, (side, m, at, line)  # the grid may miss the worst input by so much
                proved[0] += 1
            if at >= line.high[0]:
                assert m > -1e-9, (side, m, at, line)
                proved[1] += 1
    return proved[0], proved[1]


CASES = {f.__name__: f for f in (four_bar, crank_slider, six_bar, fitted, spherical)}


@pytest.mark.parametrize("name", list(CASES))
def test_what_the_lines_prove_holds_for_members(name: str) -> None:
    sides = (0.3, 0.1, 0.03, 0.003)
    binds, free = check(CASES[name](), sides, 6, seed=5)
    assert binds + free > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
@pytest.mark.parametrize("seed", range(8))
def test_what_the_lines_prove_holds_for_many_members(name: str, seed: int) -> None:
    binds, free = check(CASES[name](), (0.6, 0.3, 0.2, 0.1, 0.05, 0.03, 0.01, 0.003, 0.001), 20, seed)
    assert binds + free > 20
