"""Random mechanisms at exact poses: start kept, branch kept, no dead centre lost, every end called what it is.

The default run takes some dozens with fixed seeds; ``GRAPHSYNTH_CAMPAIGN=20000 pytest -m slow
tests/kinematics/test_engine_campaign.py`` as many as you like.  What is expected comes from the poses alone: residuals,
signs of differences on a dense grid that closes in on the end of the branch, growth of coordinates, coincident centres.
"""

from __future__ import annotations

import math
import os
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.engine.result import Motion, MotionEvent
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.joints import Gear, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

sys.path.insert(0, str(Path(__file__).parent))
from random_mechanisms import held_jacobian, random_mechanism

#: Distances from the end of the branch, in parts of its length, that the dense scan takes beside its even steps.
TAIL = np.geomspace(1e-3, 1e-8, 31)
STEPS = 400
#: Nearer to the end no pose has digits enough to judge by.
CLOSE = 3e-9


def sizes(mechanism: Mechanism, poses: np.ndarray) -> np.ndarray:
    """Largest coordinate of a joint point at every pose."""
    found = [np.zeros(len(poses))]
    for joint in mechanism.joints:
        found += [np.abs(place(poses, joint.a, joint.at_a)), np.abs(place(poses, joint.b, joint.at_b))]
    return np.max(found, axis=0)


def place(poses: np.ndarray, link: int, local: tuple[float, float]) -> np.ndarray:
    return poses[:, link, 0] + 1j * poses[:, link, 1] + np.exp(1j * poses[:, link, 2]) * complex(*local)


def coordinates(mechanism: Mechanism, poses: np.ndarray) -> dict[int, np.ndarray]:
    """Coordinates of the undriven lower pairs on the frame, by the link."""
    found = {}
    for joint in mechanism.joints:
        if mechanism.frame not in joint.pair or joint.pair == mechanism.drivers[0].pair:
            continue
        link = joint.b if joint.a == mechanism.frame else joint.a
        if isinstance(joint, Revolute):
            found[link] = poses[:, link, 2]
        elif isinstance(joint, Prismatic):
            angle = joint.angle_a if joint.a == mechanism.frame else joint.angle_b
            d = place(poses, joint.b, joint.at_b) - place(poses, joint.a, joint.at_a)
            found[link] = (d * np.exp(-1j * angle)).real
    return found


def start_fault(mechanism: Mechanism, motion: Motion) -> str:
    """The start pose is exact, so it is kept (to rounding); an exactly singular one may be refused."""
    given = np.array(mechanism.pose)
    smallest = np.linalg.svd(held_jacobian(mechanism, given[None])[0], compute_uv=False)[-1]
    if smallest < 1e-9:
        return ""
    if not motion.assembled[0]:
        return f"refused: {motion.reason}"
    moved = motion.poses[0] - given
    moved[:, 2] = np.angle(np.exp(1j * moved[:, 2]))
    far = float(np.abs(moved).max())
    return f"replaced: {far:.3g} away" if far > 1e-11 / min(smallest, 1.0) else ""


def dead_centre_faults(motion: Motion, inputs: np.ndarray, poses: np.ndarray) -> list[str]:
    """Between the samples of a dense scan the sign of every coordinate's difference tells its reversals."""
    faults = []
    sense = np.sign(inputs[-1] - inputs[0])
    for link, q in coordinates(motion.mechanism, poses).items():
        steps = np.diff(q)
        sure = np.flatnonzero(np.abs(steps) > 1e-11 * max(1.0, np.abs(q).max()))
        turns = sure[1:][np.sign(steps[sure[1:]]) != np.sign(steps[sure[:-1]])]
        before = sure[:-1][np.sign(steps[sure[1:]]) != np.sign(steps[sure[:-1]])]
        events = [sense * e.input for e in motion.events if e.kind == "dead centre" and e.links == (link,)]
        known = [sense * e.input for e in motion.events if e.kind in ("dead centre", "dwell") and e.links == (link,)]
        windows: list[tuple[float, float, int]] = []  # those of reversals in neighbouring steps overlap: taken as one
        for first, last in zip(before, turns):
            low, high, count = sense * inputs[first], sense * inputs[last + 1], 1
            if windows and low < windows[-1][1]:
                low, _, more = windows.pop()
                count += more
            windows.append((low, high, count))
        for low, high, count in windows:
            found_there = sum(low <= at <= high for at in known)
            if found_there < count or (found_there - count) % 2:
                faults.append(f"{count} dead centres of link {link} in {low:.9g}..{high:.9g}, {found_there} found")
        reach = sense * inputs[-1]
        if len([at for at in events if at < reach]) < len(turns):
            faults.append(f"link {link}: {len(events)} dead centres for {len(turns)} reversals")
    return faults


def apart(one: MotionEvent, other: MotionEvent) -> bool:
    """Whether two ends are not the same one."""
    return one.kind != other.kind or abs(one.input - other.input) > CLOSE + one.uncertainty + other.uncertainty


def centres_apart(mechanism: Mechanism, poses: np.ndarray) -> float:
    """Least distance of the centres of a gear pair."""
    gears = [joint for joint in mechanism.joints if isinstance(joint, Gear)]
    found = [np.abs(place(poses, j.b, j.at_b) - place(poses, j.a, j.at_a)).min() for j in gears]
    return float(min(found, default=math.inf))


def end_fault(motion: Motion, inputs: np.ndarray, poses: np.ndarray) -> str:
    """Growth of the coordinates over the last factors ten of the way tells an escape from a fold."""
    end = next(event for event in motion.events if event.ends_motion)
    size = sizes(motion.mechanism, poses)
    left = np.abs(end.input - inputs)
    close = (left < 1e-6 * abs(end.input)) & (left > 1e-8 * abs(end.input))  # far from a fold much grows for a while
    if close.sum() < 5:
        return ""
    power = -np.polyfit(np.log(left[close]), np.log(size[close]), 1)[0]
    grows = bool(size[close][-1] > 30.0 * size.min() and power > 0.2)
    if grows != (end.kind == "escape"):
        return f"{end.kind} at {end.input:.9g}, but the distances grow like the power {power:.3f}"
    if grows:  # 1/size is followed to where it vanishes, from samples that have digits
        grown = size / size.min()
        first = max(30.0, grown[np.argmin(np.abs(left - 1e-3 * abs(end.input)))])
        parts = np.geomspace(first, min(grown[-1], 300.0 * first), 6)
        k = np.unique([np.argmin(np.abs(np.log(grown / part))) for part in parts])
        u, y = inputs[k], size[k] ** (-1.0 / round(2 * power) * 2.0)
        terms = [np.delete(y, i) / (np.delete(y, i) - y[i]) for i in range(len(k))]
        at = float(sum(u[i] * np.prod(term) for i, term in enumerate(terms)))
        if abs(at - end.input) > 1e-9 * max(1.0, abs(at)):
            return f"escape at {end.input:.12g} instead of {at:.12g}"
    meet = centres_apart(motion.mechanism, poses[-1:]) < 1e-4
    if not meet and "centres of the gear" in end.statement:  # a fold would follow soon: they meet very late
        last = simulate(motion.mechanism, [0.0, end.input - math.copysign(1e-11, end.input)], events=False).poses[-1:]
        meet = centres_apart(motion.mechanism, last) < 1e-5
    if meet != ("centres of the gear" in end.statement):
        return f"{end.statement}; centres {centres_apart(motion.mechanism, poses[-1:]):.3g} apart"
    if end.kind == "fold" and not meet:
        smallest = np.linalg.svd(held_jacobian(motion.mechanism, poses[[0, -1]]), compute_uv=False)[:, -1]
        if not smallest[1] < 1e-2:
            return f"fold at {end.input:.9g} with a regular matrix {smallest}"
    return "" if end.kind in ("fold", "escape") or meet else f"{end.kind}: {end.statement}"


def examine(mechanism: Mechanism, span: float, part: float) -> tuple[str, list[str]]:
    """How the motion ends, and everything wrong with it; ``part`` of the branch is run a second time."""
    try:
        motion = simulate(mechanism, np.linspace(0.0, span, 73))
    except GeometryError as error:  # a direction fixed twice by guides
        return "no mechanism", [] if "direction fixed twice" in str(error) else [str(error)]
    fault = start_fault(mechanism, motion)
    if fault or not motion.assembled[0]:
        return "start", [fault] if fault else []
    end = span if motion.completed else motion.stopped_at
    dense = np.linspace(0.0, end, STEPS)
    if not motion.completed:
        dense = np.unique(np.abs(np.concatenate([dense[:-1], end * (1.0 - TAIL)]))) * np.sign(end)
        dense = dense[np.abs(end - dense) > CLOSE]
        if len(dense) < 3:
            return "at once", []
    scan = simulate(mechanism, dense, events=False)
    faults = []
    if not scan.completed:  # so close to the end that the branch is lost
        ends = [next(e for e in run.events if e.ends_motion) for run in (motion, scan) if not run.completed]
        if len(ends) < 2 or apart(ends[0], ends[1]):
            return "faults", [f"the branch ends at {scan.stopped_at:.12g} instead of {end:.12g}"]
        dense = dense[scan.assembled]
    poses = scan.poses[scan.assembled]
    # a pose far away, or with a line of centres of hardly any length, has a direction of few digits
    lines = [np.abs(place(poses, j.b, j.at_b) - place(poses, j.a, j.at_a)) for j in mechanism.joints
             if isinstance(j, Gear)]  # fmt: skip
    digits = np.minimum(1.0, np.min([np.ones(len(dense)), *lines], axis=0)) / np.maximum(1.0, sizes(mechanism, poses))
    if (np.abs(residual(mechanism.joints, poses)).max(axis=1) * digits).max() > 1e-13:
        faults.append("open joints")
    faults += dead_centre_faults(motion, dense, poses)
    if not motion.completed:
        faults += [fault for fault in [end_fault(motion, dense, poses)] if fault]
    # a run that stops before the end tells the same events
    stop = end * part
    short = simulate(mechanism, np.linspace(0.0, stop, 50))
    told = [[(e.kind, e.links) for e in run.events if not e.ends_motion and abs(e.input) < abs(stop) * (1 - 1e-9)]
            for run in (motion, short)]  # fmt: skip
    lost = not short.completed and (motion.completed or apart(short.events[-1], motion.events[-1]))
    if lost or (short.completed and Counter(told[0]) != Counter(told[1])):
        faults.append(f"to {stop:.12g}: {told[1]} {short.reason} instead of {told[0]}")
    return "complete" if motion.completed else motion.events[-1].kind, faults


def campaign(seed: int, count: int) -> tuple[Counter[str], list[tuple[int, str]]]:
    """Every mechanism has a seed of its own, so that a fault can be looked at alone."""
    ends: Counter[str] = Counter()
    faults: list[tuple[int, str]] = []
    for number in range(seed, seed + count):
        kind, found = one(number)
        ends[kind] += 1
        faults += [(number, fault) for fault in found]
        if faults and faults[-1][0] == number:
            print(number, found, flush=True)
        if number % 500 == 499:
            print(number + 1, dict(ends), flush=True)
    return ends, faults


def one(number: int) -> tuple[str, list[str]]:
    random = np.random.default_rng(number)
    mechanism = random_mechanism(random)
    span = float(random.choice([-6.28, 6.28]))
    before = 10.0 ** random.uniform(-6.0, -1.0)
    return examine(mechanism, span, 1.0 - before)


@pytest.mark.long
def test_random_mechanisms() -> None:
    ends, faults = campaign(0, 40)
    assert not faults
    assert ends["fold"] > 10 and ends["complete"] > 3


@pytest.mark.slow
def test_campaign() -> None:
    ends, faults = campaign(0, int(os.environ.get("GRAPHSYNTH_CAMPAIGN", "300")))
    assert not faults, f"{len(faults)} faults among {dict(ends)}"
