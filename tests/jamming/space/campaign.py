"""Campaigns against proofs with exact closure in space: random questions by seed, a line of JSON for each.

    export PYTHONPATH=.:tests/jamming/joints
    python tests/jamming/space/campaign.py mechanisms --count 1000 --results FILE [--seconds 300]
    python tests/jamming/space/campaign.py bearings --count 1000 --results FILE [--seconds 300]
    python tests/jamming/space/campaign.py rails --count 300 --results FILE [--seconds 300]

A run goes on where the file ends.  *mechanisms*: poses of 4 to 8 links beside a search from many starts, whose winner
is refined and checked with 50 digits, and for a part beside links placed by rotation matrices and a general optimizer.
*bearings*: four-bars whose bearing at B takes all the tilt, beside the certificate of the single bearing.  *rails*:
ranges of mechanisms with guides whose seats lean, the certificate of small tilts with bounds beside the exact one, and
both beside the least factor of a search at five inputs.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
from coupled_oracles import four_bar
from rails import MAKES, case as guided, question
from space_oracles import case, joint_limits
from spatial_oracle import spatial
from test_poses import refined

from graphsynth import simulate
from graphsynth.jamming import Bearing, ToleranceBox, certify_jamming
from graphsynth.jamming.bearing.arcs import contains
from graphsynth.jamming.joints import RIGID, SPHERICAL, Misalignment, bearing_limits, certify_coupled
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space.along import NOTHING, Along
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import TURN
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.pose import prove_pose
from graphsynth.jamming.space.turn import certify_in_space

STARTS = 6
#: Every so many jams of a kind are searched for by the general optimizer too.
SEARCHED = {4: 2, 6: 10, 8: 40}


def mechanism(seed):
    """One random pose with limits 1e-6 to 0.3 (relative) away from the verge."""
    mpmath.mp.dps = 50
    rng = np.random.default_rng([seed, 77])
    links = int(rng.choice([4, 6, 8]))
    plane, motion, tilt, limits, _ = case(rng, links)
    away = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, -0.5))
    model = in_space(problem(plane, joint_limits(limits, 1.0, tilt), tilt))
    q = start(model, plane, motion.poses[0])
    scale = least_scale(Closure(model, False), q).scale * (1.0 + away)
    model = in_space(problem(plane, joint_limits(limits, scale, tilt), tilt))
    begin = time.process_time()
    proof = prove_pose(model, q)
    row = {"seed": seed, "links": links, "alpha": tilt.alpha, "away": away, "state": proof.state,
           "seconds": round(time.process_time() - begin, 3), "wrong": False}  # fmt: skip
    if proof.state == 1:
        misfit, most = refined(model, proof.optimum.q)
        row["wrong"] = not (misfit < 1e-20 and most < 1.0)
    elif proof.state == -1:
        row["wrong"] = found_inside(model, q, proof.reach, rng)
        if seed % SEARCHED[links] == 0:
            own = {pair: (t * scale, s * scale) for pair, (t, s) in limits.items()}
            least, missed = spatial(plane, motion.poses[0], tilt, own).least_factor(2 if links < 8 else 1)
            row["searched"] = least
            row["wrong"] |= bool(least < 1.0 - 1e-8 and missed < 1e-9)
    return row


def found_inside(model, q, reach, rng):
    """Whether a search from many starts finds a closure within all limits and within reach, checked with 50 digits."""
    closure = Closure(model, False)
    turns = [int(c[TURN]) for c in model.column if 0 <= c[TURN] < model.size]
    for k in range(STARTS):
        at = q.copy()
        at[: model.size] += (k > 0) * rng.uniform(-1.0, 1.0, model.size) * min(reach, 0.2)
        found = least_scale(closure, at)
        if found.scale < 1.0 and found.missed < 1e-9 and np.abs(found.q - q)[turns].max(initial=0.0) < reach:
            misfit, most = refined(model, found.q)
            if misfit < 1e-20 and most < 1.0:
                return True
    return False


def one_bearing(seed):
    """One linkage with |alpha| up to 0.3: crank angles beside the ends of its arcs, and a range of them."""
    rng = np.random.default_rng([seed, 78])
    while True:
        lengths = (rng.uniform(1.5, 3.0), 1.0, rng.uniform(2.0, 3.5), rng.uniform(2.0, 3.5))
        motion = simulate(four_bar(*lengths), np.linspace(0.0, math.tau, 9))
        if motion.assembled.all():
            break
    alpha = float(rng.choice([-1.0, 1.0]) * 0.3 * 10.0 ** rng.uniform(-2.0, 0.0))
    part = rng.uniform(0.3, 1.1)  # of the largest tilt: above 1 it never binds
    critical = math.asin(math.sin(abs(alpha)) / lengths[2] * part)
    size, c = math.sin(critical), math.cos(critical)
    height = 2.0 * 17.5 * size / (1.0 + c) * 3.0
    bearing = Bearing(17.5, height, 0.5 * height * size - 17.5 * size * size / (1.0 + c))
    box = ToleranceBox(*lengths, alpha=alpha, Rb=17.5, Hb=bearing.Hb, clearance=bearing.clearance)
    proof = certify_jamming(box)
    joints = {(1, 2): SPHERICAL, (2, 3): bearing_limits(bearing), (0, 3): RIGID}
    tilt = Misalignment(0, 1, alpha)
    along = Along(problem(motion.mechanism, joints, tilt), motion)
    edge = math.asin(min(1.0, part))
    angles = [edge + side * 10.0 ** rng.uniform(-6.0, -1.0) for side in (-1.0, 1.0)] + [rng.uniform(0.0, 6.28)]
    row = {"seed": seed, "alpha": alpha, "wrong": False, "states": [], "known": []}
    begin = time.process_time()
    for f in angles:
        pose, fine = along.poses(np.array([f]))
        q, given = along.start(f, pose[0], NOTHING)
        state = prove_pose(along.model(NOTHING), q, given=given).state if fine[0] else 0
        known = -1 if contains(proof.arcs.inner, f) else 1 if contains(proof.arcs.free, f) else 0
        row["states"].append(state)
        row["known"].append(known)
        row["wrong"] |= state * known < 0
    if seed % 10 == 0:
        low = rng.uniform(0.0, 6.0)
        part = simulate(motion.mechanism, np.linspace(low, low + 0.1, 3))
        found = certify_in_space(part, joints, tilt, resolution=0.05, seconds=5.0)
        for side, spans in ((1, proof.arcs.inner), (-1, proof.arcs.free)):
            for a, b in found.arcs(side):
                row["wrong"] |= any(contains(spans, u) for u in np.linspace(a, b, 7))
        row["range"] = found.verdict.name
    row["seconds"] = round(time.process_time() - begin, 3)
    return row


def rail(seed):
    """One range of a mechanism whose rail, or slider, leans: limits 1e-3 to 0.3 (relative) away from the verge."""
    rng = np.random.default_rng([seed, 79])
    name = list(MAKES)[seed % len(MAKES)]
    while True:
        plane, motion, pair = guided(rng, name)
        limits, tilts = question(rng, plane, pair, 0.1 * 10.0 ** rng.uniform(-2.0, 0.0))
        inputs = np.linspace(motion.inputs[0], motion.inputs[-1], 5)
        poses = simulate(plane, inputs, start=motion.poses[0]).poses
        factors = [factor(plane, pose, limits, tilts)[0] for pose in poses]
        if 0.05 < max(factors) < 5.0 and max(factors) * max(own.alpha for own in tilts) < 0.5:
            break
    away = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, -0.5))
    grown = max(factors) * (1.0 + away)
    limits = {pair: grow(own, grown) for pair, own in limits.items()}
    begin = time.process_time()
    first = certify_coupled(motion, limits, tilts, resolution=0.02, max_pieces=400)
    second = certify_in_space(motion, limits, tilts, resolution=0.1, max_pieces=60, seconds=20.0)
    row = {"seed": seed, "name": name, "rail": plane.joint(*pair).a == pair[0], "away": away,
           "verdicts": [first.verdict.name, second.verdict.name],
           "seconds": round(time.process_time() - begin, 3)}  # fmt: skip
    row["wrong"] = any(
        max(a, c) <= min(b, d) for side in (1, -1) for a, b in first.arcs(side) for c, d in second.arcs(-side)
    )
    for u, pose in zip(inputs, poses):
        scale, missed = factor(plane, pose, limits, tilts)
        for proof in (first, second):
            found = -1 if scale > 1.0 + 1e-6 else 1 if scale < 1.0 - 1e-9 and missed < 1e-9 else 0
            row["wrong"] |= found != 0 and any(low <= u <= high for low, high in proof.arcs(-found))
    return row


def factor(plane, pose, limits, tilts):
    """Least factor on all limits at a pose, as a search finds it, and what its loops miss."""
    model = in_space(problem(plane, limits, tilts))
    found = least_scale(Closure(model, False), start(model, plane, pose))
    return found.scale, found.missed


def grow(own, by):
    return replace(own, **{name: getattr(own, name) * by for name in (*own.tilts, "axial_clearance")},
                   **{f"{name}_range": None for name in (*own.tilts, "axial_clearance")})  # fmt: skip


KINDS = {"mechanisms": mechanism, "bearings": one_bearing, "rails": rail}


def campaign(kind, count, results, seconds=math.inf):
    """Ask the questions that are not yet in a file; return all rows."""
    path = Path(results)
    rows = [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []
    done, end = {row["seed"] for row in rows}, time.monotonic() + seconds
    with path.open("a", encoding="utf-8") as file:
        for seed in range(count):
            if seed in done or time.monotonic() > end:
                continue
            rows.append(KINDS[kind](seed))
            file.write(json.dumps(rows[-1]) + "\n")
            file.flush()
    return rows


def told(kind, rows):
    """One paragraph on the rows."""
    wrong = [row["seed"] for row in rows if row["wrong"]]
    text = [f"{kind}: {len(rows)} questions, wrong certificates: {len(wrong)} {wrong or ''}"]
    if kind == "mechanisms":
        for links in (4, 6, 8):
            own = [row for row in rows if row["links"] == links]
            states = Counter(row["state"] for row in own)
            cost = np.array([row["seconds"] for row in own] or [0.0])
            told = sum("searched" in row for row in own)
            text.append(f"  {links} links: {len(own)}, free {states[1]}, jammed {states[-1]}, undecided {states[0]} "
                        f"({100 * states[0] / max(len(own), 1):.1f} %), CPU {np.median(cost):.2f} s, at most "
                        f"{cost.max():.1f} s; {told} searched by the optimizer")  # fmt: skip
    elif kind == "rails":
        pairs = Counter(tuple(row["verdicts"]) for row in rows)
        text += [f"  small tilts with bounds {a}, exact {b}: {n}" for (a, b), n in sorted(pairs.items())]
        text.append(f"  rails: {sum(row['rail'] for row in rows)}, seats on the slider: "
                    f"{sum(not row['rail'] for row in rows)}, "
                    f"CPU {np.median([row['seconds'] for row in rows]):.2f} s")  # fmt: skip
    else:
        pairs = Counter((s, k) for row in rows for s, k in zip(row["states"], row["known"]))
        text.append(
            "  crank angles (exact, single bearing): " + ", ".join(f"{k}: {n}" for k, n in sorted(pairs.items()))
        )
        text.append(f"  ranges: {dict(Counter(row['range'] for row in rows if 'range' in row))}")
    return "\n".join(text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=sorted(KINDS))
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--results", required=True)
    parser.add_argument("--seconds", type=float, default=math.inf)
    given = parser.parse_args()
    print(told(given.kind, campaign(given.kind, given.count, given.results, given.seconds)))
