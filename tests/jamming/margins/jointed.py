"""Mechanisms with toleranced joints, and the margin of one member, simulated and solved by itself."""

from dataclasses import replace

import numpy as np

import graphsynth as gs
from graphsynth.jamming import joints_margin
from graphsynth.jamming.joints.limits import SPHERICAL, JointLimits, Misalignment, SlideLimits
from graphsynth.jamming.margins.margin import JointsMargin
from graphsynth.tolerances import AxisAngle, EndFloat, FitClearance, HolePosition, LengthTolerance, ThermalExpansion

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
        "tilt": Misalignment(0, 1, 0.013, 0.3, alpha_range=(0.012, 0.019), direction_range=(0.1, 0.5)),
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


def leaning_rail() -> JointsMargin:
    """A rail that leans about its own point, from which the slider is far away; its place and lean are toleranced."""
    motion = gs.Mechanism.slider_crank(1.0, 3.0).simulate("10..120 deg")
    guide = next(joint for joint in motion.mechanism.joints if joint.kind == "P")
    pins = [joint.pair for joint in motion.mechanism.joints if joint.kind == "R"]
    limits = {pair: JointLimits(0.004, 0.003, tilt_range=(0.003, 0.005)) for pair in pins}
    limits[guide.pair] = SlideLimits(0.003, 0.004, 0.01)
    tilt = Misalignment(guide.a, guide.b, 0.008, 1.2, rigid=False, alpha_range=(0.004, 0.014))
    return joints_margin(motion, limits, tilt, [HolePosition(guide.a, pins[0][1], 0.04)])


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
    tilt = Misalignment(0, 1, 0.006, 0.3, alpha_range=(0.005, 0.0105))
    return four_bar(joints=None, tilt=tilt, tolerances=[*fits, *rest, AxisAngle(2, 3, 0.0005), heat])


def spherical() -> JointsMargin:
    tilt = Misalignment(0, 1, 0.03, 0.3, alpha_range=(0.02, 0.035), direction_range=(0.2, 0.4))
    return four_bar(joints=PLAIN | {(1, 2): SPHERICAL}, tilt=tilt, tolerances=(LengthTolerance(1, (0, 2), 0.005),))


def true_margin(margin: JointsMargin, x: np.ndarray, count: int = 121) -> float:
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


CASES = {f.__name__: f for f in (four_bar, crank_slider, leaning_rail, six_bar, fitted, spherical)}
