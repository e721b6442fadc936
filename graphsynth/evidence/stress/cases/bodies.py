"""Bodies and joints: starts, singular passages, light links, long runs, pulses (instruments page, 9.18 to 9.24)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.evidence.stress.cases.linkages import built, four_bar, wheel

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["long_run", "massless", "pulse", "rotor", "singular_passage", "starts", "train_ratio"]


def _bar(mass: float, length: float) -> Any:
    from graphsynth.dynamics import Body

    return Body.bar(mass, (0.0, 0.0), (length, 0.0))


def _g1(**changes: Any) -> Any:
    """Crank-rocker G1 of section 5.9."""
    from graphsynth.dynamics import DynamicModel

    bodies = {1: _bar(0.2, 0.2), 2: _bar(0.6, 0.6), 3: _bar(0.4, 0.4)}
    return DynamicModel(four_bar(0.2, 0.6, 0.4, 0.6), **{"bodies": bodies, **changes})


def _slider_crank(shift: float | None = None) -> Any:
    """G3 of section 5.9, with a second guide shifted sideways if asked for."""
    from graphsynth.dynamics import Body, DynamicModel, Spring
    from graphsynth.mechanism.joints import Prismatic, Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (0.1, 0.0)), Revolute(2, 3, (0.3, 0.0)), Prismatic(0, 3, (0.0, 0.02))]
    spring = Spring(0, 3, (0.0, 0.02), stiffness=300.0, free_length=0.35, damping=4.0)
    more = {} if shift is None else {"additional": [Prismatic(0, 3, (0.0, 0.02 + shift))]}
    bodies = {1: _bar(0.2, 0.1), 2: _bar(0.5, 0.3), 3: Body(0.8, 1e-3)}
    return DynamicModel(built(graph, joints), bodies, [spring], **more)


#: Flat pose of the four-bar of section 4.8.
FLAT = [(0.0, 0.0, 0.0), (0.0, 0.0, math.pi), (-0.02, 0.0, 0.0), (0.06, 0.0, math.pi)]


def _flat_model() -> Any:
    from graphsynth.dynamics import DynamicModel

    bodies = {1: _bar(1.0, 0.02), 2: _bar(1.0, 0.05), 3: _bar(1.0, 0.03)}
    return DynamicModel(four_bar(0.02, 0.05, 0.03, 0.06), bodies, gravity=(0.0, 0.0))


def starts(check: Checks) -> None:
    """Table of section 5.6: redundant, violated, singular, contradicting."""
    from graphsynth.dynamics import consistent_start, simulate_dynamics

    at = {"keep": {(0, 1): 0.5}, "keep_rates": {(0, 1): 15.0}, "modes": {0: 1}}
    double = consistent_start(_slider_crank(0.0), **at)
    given = (len(double.rows), double.rank, double.freedom, double.pose_class)
    check.says("second guide: rows, rank, freedom, class", given, (10, 8, 1, "redundant"))
    check.says("second guide: undetermined multipliers", int((~double.determined).sum()), 4)
    ends = [
        simulate_dynamics(m, [0.0, 0.25], start=consistent_start(m, **at), form="augmented", rtol=1e-12)
        for m in (_slider_crank(), _slider_crank(0.0))
    ]
    check.value(
        "second guide: theta(0.25)",
        ends[1].poses[-1, 1, 2],
        "0.9331749819915449920",
        absolute=1e-10,
        source="section 5.9",
    )
    check.below("second guide: same motion", float(np.abs(ends[0].poses - ends[1].poses).max()), 1e-10)
    shifted = consistent_start(_slider_crank(1e-4), **at)
    check.says("shifted by 0.1 mm: status", shifted.status, "violated")
    residuals = sorted(abs(v) for name, v in shifted.violated.items() if "normal" in name)
    check.values("shifted: residuals, m", residuals, ["5e-5", "5e-5"], relative=1e-9)
    check.refused(
        "shifted: no motion", lambda: simulate_dynamics(_slider_crank(1e-4), [0.0, 1.0], **at), "do not close"
    )
    flat = consistent_start(_flat_model(), pose=FLAT)
    found = (flat.rank, flat.nearby_rank, flat.freedom, flat.pose_class, flat.tangents.kind)
    check.says("flat four-bar", found, (7, 8, 2, "singular", "change point"))
    ratios = sorted((m[2, 2] / m[1, 2], m[3, 2] / m[1, 2]) for m in flat.tangents.motions)
    root = math.sqrt(5.0)
    right = sorted([((5 - 3 * root) / 20, (1 + root) / 4), ((5 + 3 * root) / 20, (1 - root) / 4)])
    check.values(
        "flat: ratios of both branches", [v for r in ratios for v in r], [v for r in right for v in r], absolute=1e-9
    )
    bad = consistent_start(_g1(), keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0, (0, 3): 5.0}, modes={0: 1})
    check.says("contradicting rates: status, rank", (bad.status, bad.rank), ("contradicting rates", 8))
    check.agrees(
        "contradicting rates: rows named", {"kept (0, 1)", "kept (0, 3)"} <= set(bad.violated), str(list(bad.violated))
    )


def singular_passage(check: Checks) -> None:
    """Parallelogram through its flat poses: events, both modes, the branch of the velocity; 1e-9 changes little."""
    from graphsynth.dynamics import DynamicModel, consistent_start, simulate_dynamics

    bodies = {1: _bar(1.0, 0.2), 2: _bar(2.0, 0.5), 3: _bar(1.0, 0.2)}
    model = DynamicModel(four_bar(0.2, 0.5, 0.2, 0.5), bodies, gravity=(0.0, 0.0))
    ends = []
    for delta in (0.0, 1e-9):
        pose = [
            (0, 0, 0), (0, 0, 1.0 + delta), (0.2 * math.cos(1.0 + delta), 0.2 * math.sin(1.0 + delta), 0),
            (0.5, 0, 1.0 + delta),
        ]  # fmt: skip
        start = consistent_start(model, pose=pose, keep_rates={(0, 1): 3.0})
        motion = simulate_dynamics(model, np.linspace(0.0, 3.0, 31), start=start)
        ends.append(motion)
    motion = ends[0]
    passed = [event for event in motion.events if event.kind == "singular pose"]
    check.values(
        "times of the flat poses",
        [e.time for e in passed],
        [(k * math.pi - 1.0) / 3.0 for k in (1, 2, 3)],
        absolute=1e-6,
    )
    check.agrees("both branches are named", all("two branches meet" in e.statement for e in passed))
    # no force in the plane: the crank turns at constant speed, the coupler does not turn
    check.below("angle of the coupler", float(np.abs(motion.poses[:, 2, 2]).max()), 1e-7, source="closed form")
    check.below(
        "crank", float(np.abs(motion.poses[:, 1, 2] - (1.0 + 3.0 * motion.times)).max()), 1e-7, source="closed form"
    )
    apart = float(np.abs(ends[1].poses[:, 1:, 2] - motion.poses[:, 1:, 2]).max())
    check.below("1e-9 at the start changes the end by", apart, 1e-6)
    _rest_at_a_change_point(check)


def _rest_at_a_change_point(check: Checks) -> None:
    """At rest and under load nothing says which branch: a failure with a reason, soon."""
    from graphsynth.dynamics import DynamicModel, Torque, consistent_start, simulate_dynamics

    plain = _flat_model()
    model = DynamicModel(plain.mechanism, plain.bodies, [Torque(0, 1, 0.1)], (0.0, 0.0))
    motion = simulate_dynamics(model, np.linspace(0.0, 0.05, 6), start=consistent_start(model, pose=FLAT))
    check.says("rest at a change point: status", motion.status, "failed")
    check.agrees("its reason", bool(motion.message), motion.message)
    check.agrees(
        "no pose beyond, few steps", bool(np.isnan(motion.poses[-1]).all()) and motion.steps < 2000, str(motion.steps)
    )


def massless(check: Checks) -> None:
    """Coupler times 1e-9: condition number, error against the massless limit of the one-coordinate form."""
    from graphsynth.dynamics import Body, simulate_dynamics

    light = {1: _bar(0.2, 0.2), 2: Body(0.6e-9, 0.018e-9, (0.3, 0.0)), 3: _bar(0.4, 0.4)}
    none = {**light, 2: Body(0.0, 0.0, (0.3, 0.0))}
    at = {"keep": {(0, 1): 0.0}, "keep_rates": {(0, 1): 10.0}, "modes": {0: 1}}
    limit = simulate_dynamics(_g1(bodies=none), [0.0, 1.0], form="one-coordinate", **at)
    near = simulate_dynamics(_g1(bodies=light), [0.0, 1.0], form="augmented", **at)
    check.agrees(
        "completed, with its condition number",
        near.completed and near.start.condition < 1e3,
        f"{near.start.condition:.3g}",
    )
    gap = float(np.abs(near.poses[-1] - limit.poses[-1]).max())
    check.below("distance to the massless limit", gap, 1e-7, source="one-coordinate form")
    check.below("d'Alembert", near.checks.dalembert, 1e-9)
    check.refused(
        "no mass at all in the augmented form",
        lambda: simulate_dynamics(_g1(bodies=none), [0.0, 1.0], form="augmented", **at), "links [2] have no mass",
    )  # fmt: skip


def train_ratio(check: Checks) -> None:
    """Ratio of 1000: reflected inertia, both formulations, energy."""
    from graphsynth.dynamics import TorqueSource, effective_inertia, simulate_dynamics

    G, Jm = 1e3, 8.2e-6
    model = _g1(elements=[TorqueSource(0, 1, 1e-3, G, rotor_inertia=Jm)])
    at = {"keep": {(0, 1): 0.0}, "modes": {0: 1}}
    one, two = (
        simulate_dynamics(model, np.linspace(0.0, 1.0, 5), form=f, **at) for f in ("augmented", "one-coordinate")
    )
    check.below(
        "two formulations, poses", float(np.abs(one.poses - two.poses).max()), 1e-8, source="second formulation"
    )
    check.below("energy", one.checks.energy, 1e-9)
    check.below("accelerations of the second form", one.checks.second_form, 1e-9)
    plain, geared = (effective_inertia(m, np.linspace(0.0, 6.0, 7), modes={0: 1}).inertia for m in (_g1(), model))
    # a sum: the smaller term keeps its absolute accuracy
    check.values("J with the train, less J without", geared - plain, ["8.2"] * 7, absolute=4e-15, source="G^2 Jm")


def long_run(check: Checks) -> None:
    """G1 for 1000 s without damping: energy, closure, phase within its own estimate."""
    from graphsynth.dynamics import simulate_dynamics

    motion = simulate_dynamics(
        _g1(), np.linspace(0.0, 1000.0, 101), keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1},
        form="augmented", rtol=1e-12, estimate_error=True,
    )  # fmt: skip
    check.equals("completed", motion.completed, True)
    check.below("energy drift", motion.checks.energy, 1e-9)
    # the crank's angle is some 9000 rad at the end: the joints close to its last digit
    turned = float(np.spacing(np.abs(motion.poses[:, 1, 2]).max()))
    check.below("closure", motion.checks.position_drift, turned)
    check.below("estimated phase error, rad", float(motion.error_estimate[-1]), 1e-3)


def pulse(check: Checks) -> None:
    """Torque of a microsecond: the impulse arrives whole, and its edges are events."""
    from graphsynth.dynamics import Body, DynamicModel, Pulse, Torque, simulate_dynamics

    shock = Torque(0, 1, Pulse(0.1, 1e-6, 5e4))
    model = DynamicModel(wheel(), {1: Body(1.0, 0.2)}, [shock], (0.0, 0.0))
    motion = simulate_dynamics(model, [0.0, 0.05, 0.2], keep={(0, 1): 0.0})
    # the double nearest to 0.1 + 1e-6 gives a pulse that is longer by up to 1.4e-17 s
    right = [0, 0, "0.25"]
    check.values(
        "speed before, before and after", motion.velocities[:, 1, 2], right, relative=1e-9, source="impulse / inertia"
    )
    check.says("events", [event.kind for event in motion.events], ["break", "break"])
    check.below("energy", motion.checks.energy, 1e-9)
    hit = simulate_dynamics(_g1(elements=[shock]), [0.0, 0.05, 0.15], keep={(0, 1): 0.0}, modes={0: 1}, rtol=1e-11)
    check.below("the same on a crank-rocker: energy", hit.checks.energy, 1e-8)


def rotor(check: Checks) -> None:
    """Coordinate that grows without bound under implicit solvers: no NaN, the closed form to tolerance."""
    from graphsynth.dynamics import Body, DynamicModel, Torque, simulate_dynamics

    drag = Torque(0, 1, lambda t, angle, speed: 1.0 - 0.01 * speed)
    model = DynamicModel(wheel(), {1: Body(1.0, 0.1)}, [drag], (0.0, 0.0))
    # J w' = 1 - 0.01 w
    speed = 100.0 * (1.0 - math.exp(-0.1 * 50.0))
    angle = 100.0 * 50.0 - 1000.0 * (1.0 - math.exp(-0.1 * 50.0))
    for method in ("Radau", "BDF", "LSODA"):
        motion = simulate_dynamics(model, np.linspace(0.0, 50.0, 6), keep={(0, 1): 0.0}, method=method, rtol=1e-7)
        check.agrees(f"{method}: no NaN", motion.completed and bool(np.isfinite(motion.poses).all()))
        check.value(f"{method}: speed", motion.velocities[-1, 1, 2], speed, relative=1e-5, source="closed form")
        check.value(f"{method}: angle", motion.poses[-1, 1, 2], angle, relative=1e-5, source="closed form")
