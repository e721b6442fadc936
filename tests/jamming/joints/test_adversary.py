"""The certificates against an exact judge, the closed form of one bearing, and random tilts and wrenches."""

import math
from collections import Counter
from fractions import Fraction
from itertools import islice

import numpy as np
import pytest
from coupled_oracles import embodied, factor_bounds, four_bar
from exact_oracle import Position, exact_lower, exact_upper, judge, slip_row, tilt_row

from graphsynth import Mechanism, Revolute, enumerate_chains, simulate
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment, SlideLimits
from graphsynth.jamming.joints.closure import Leans, joint_places, lay_out, leans
from graphsynth.jamming.joints.enclosure import Pieces
from graphsynth.jamming.joints.program import problem, solve_poses

MARGINS = (1e-3, 1e-6, 1e-9)


def anywhere(links, rng, count):
    """Return a random chain with its joints at random places: dimensions that close by being measured."""
    numbers = {4: 1, 6: 2, 8: 16, 10: 230}
    chain = next(islice(enumerate_chains(links), int(rng.integers(numbers[links])), None))
    joints = [
        Revolute(joint.a, joint.b, tuple(rng.uniform(-1, 1, 2)), tuple(rng.uniform(-1, 1, 2))) for joint in chain.joints
    ]
    mechanism = Mechanism(chain.with_frame(0), joints)
    return mechanism, rng.uniform(-1, 1, (count, len(joints), 2))


def turning(links, rng, count):
    """Return a mechanism with dimensions that let it turn, at random inputs."""
    mechanism = embodied(links, int(rng.integers({4: 1, 6: 2, 8: 8, 10: 3}[links])))
    motion = simulate(mechanism, np.sort(rng.uniform(0.0, 2.0 * math.pi, count)), events=False)
    poses = motion.poses[motion.assembled]
    return mechanism, joint_places(mechanism, tuple(range(len(mechanism.joints))), poses)[0]


def varied(mechanism, rng):
    """Limits of every joint; the first joint of the frame is a motor without clearance."""
    limits = []
    driven = next(joint for joint in mechanism.joints if 0 in joint.pair)
    for joint in mechanism.joints:
        play = float(rng.choice([0.0, 0.0, 0.02, 0.3]))
        if joint is driven:
            limits.append(RIGID)
        elif rng.random() < 0.2:  # along x and y: the whole is a linear program there
            limits.append(SlideLimits(*rng.uniform(0.3, 2.0, 2), play))
        else:
            limits.append(JointLimits(float(rng.uniform(0.3, 2.0)), play))
    tilts = [Misalignment(0, max(driven.pair), 0.1)]
    if rng.random() < 0.5:
        other = next(joint for joint in mechanism.joints if joint is not driven)
        tilts.append(Misalignment(*other.pair, 0.1, rigid=False))
    return tuple(limits), tuple(tilts)


def attack(make, links, rng, count):
    """Compare at ``count`` positions; return how many of which outcome."""
    mechanism, r = make(links, rng, count)
    limits, tilts = varied(mechanism, rng)
    layout = lay_out(mechanism, limits, tilts)
    assert layout.joints == tuple(range(len(mechanism.joints)))
    count = len(r)
    e = np.zeros_like(r)
    e[..., 0] = 1.0
    d = np.zeros_like(r)
    for place, _, _ in layout.misalignments:
        d[:, place] = rng.normal(size=(count, 2))
    found = solve_poses(layout, r, e, Leans(d, r), "scale")
    side, margin = rng.choice([-1.0, 1.0], count), rng.choice(MARGINS, count)
    assert (found.lower > 0.0).all() and np.isfinite(found.lower).all()
    k = (1.0 + side * margin) / found.lower
    moved = d * k[:, None, None]
    at = Pieces(*(Interval.from_bounds(v, v) for v in (r, e, moved, r)))
    lower, upper = factor_bounds(layout, at, solve_poses(layout, r, e, Leans(moved, r), "scale"))
    outcome = Counter(positions=count)
    tilt = tuple(own.tilt if isinstance(own, JointLimits) else (own.roll, own.pitch) for own in limits)
    pairs, play = tuple(map(tuple, layout.pairs.tolist())), tuple(own.axial_clearance for own in limits)
    for n in range(count):
        (x, moments, forces), _, _ = judge(Position(mechanism.graph.links, pairs, r[n], d[n], tilt, play))
        here = Position(mechanism.graph.links, pairs, r[n], moved[n], tilt, play)
        below, above = exact_lower(here, moments, forces), exact_upper(here, x * k[n])
        assert above is not None and below**2 <= above
        # never a false bound: the true factor lies between both pairs
        assert Fraction(lower[n]) ** 2 <= above, "false bound of a jam"
        assert not math.isfinite(upper[n]) or Fraction(upper[n]) >= below, "false bound of freedom"
        outcome["jam, exact"] += below > 1
        outcome["free, exact"] += above < 1
        outcome["judge open"] += below <= 1 <= above
        said = "jam" if lower[n] > 1.0 else "free" if upper[n] < 1.0 else "undecided"
        assert not (said == "jam" and above <= 1) and not (said == "free" and below >= 1), "false certificate"
        assert said in ("undecided", "jam" if side[n] > 0 else "free")
        outcome[said] += 1
        outcome["both decide"] += said != "undecided" and (below > 1 or above < 1)
    return outcome


@pytest.mark.long
@pytest.mark.parametrize("make", [anywhere, turning])
def test_no_false_certificate(make):
    """Exact judge at a few positions of 4, 6 and 8 links; thousands in the slow test."""
    rng, total = np.random.default_rng(12), Counter()
    for links in (4, 6, 8):
        total += attack(make, links, rng, 3)
    assert total["positions"] == 9 and total["undecided"] == 0 and total["both decide"] >= 8


@pytest.mark.slow
@pytest.mark.parametrize("make", [anywhere, turning])
@pytest.mark.parametrize("links", [4, 6, 8, 10])
def test_no_false_certificate_at_thousands_of_positions(make, links):
    rng, total = np.random.default_rng(links), Counter()
    while total["positions"] < 320:
        total += attack(make, links, rng, 16)
    print(links, make.__name__, dict(total))
    assert total["undecided"] < 0.02 * total["positions"]
    assert total["both decide"] > 0.9 * total["positions"]


def test_closed_form_of_one_bearing_at_every_position():
    """Four-bars in which the bearing between coupler and rocker has all the clearance: ``t = l2 alpha |sin| / l3``."""
    rng = np.random.default_rng(2)
    undecided = count = 0
    for _ in range(8):
        coupler = rng.uniform(2.0, 4.0)
        rocker = coupler + rng.uniform(-0.8, 0.8)
        mechanism = four_bar(rng.uniform(1.6, 1.9), rng.uniform(0.2, 0.6), coupler, rocker)
        crank = mechanism.joint(1, 2).at_a[0]
        f = rng.uniform(0.0, 2.0 * math.pi, 64)
        motion = simulate(mechanism, np.sort(f), events=False)
        assert motion.completed
        turned = rng.uniform(0.0, math.pi)
        # what the spherical joint lifts: z = alpha cross((cos, sin)(turned), A)
        lift = np.abs(np.sin(motion.inputs - turned)) * crank / coupler
        side, margin = rng.choice([-1.0, 1.0], f.size), rng.choice(MARGINS, f.size)
        bearings = {(1, 2): SPHERICAL, (2, 3): Bearing(), (0, 3): RIGID}
        given = problem(mechanism, bearings, Misalignment(0, 1, 0.1, turned))
        critical = Bearing().critical_tilt("A").angle
        k = critical / lift * (1.0 + side * margin) / 0.1
        places = joint_places(mechanism, given.layout.joints, motion.poses)
        (r, e), (d, about) = places[:2], leans(given.layout, places)
        d = d * k[:, None, None]
        at = Pieces(*(Interval.from_bounds(v, v) for v in (r, e, d, about)))
        lower, upper = factor_bounds(given.layout, at, solve_poses(given.layout, r, e, Leans(d, about), "scale"))
        assert (lower <= (1.0 + side * margin) * (1 + 1e-11)).all()
        assert (upper >= (1.0 + side * margin) * (1 - 1e-11)).all()
        assert not ((lower > 1.0) & (side < 0)).any() and not ((upper < 1.0) & (side > 0)).any()
        undecided += int(((lower <= 1.0) & (upper >= 1.0)).sum())
        count += f.size
    assert undecided <= 0.02 * count


@pytest.mark.long
@pytest.mark.parametrize("links", [4, 8])
def test_random_tilts_and_wrenches_stay_outside(links):
    """Of 20000 tilts that close none is below a proved bound, of 20000 wrenches in equilibrium none above."""
    rng = np.random.default_rng(links)
    mechanism, r = anywhere(links, rng, 1)
    limits = tuple(JointLimits(float(t), 0.2) for t in rng.uniform(0.5, 1.5, len(mechanism.joints)))
    layout = lay_out(mechanism, limits, (Misalignment(*mechanism.joints[0].pair, 0.1, rigid=False),))
    e, d = np.zeros_like(r), np.zeros_like(r)
    e[..., 0] = 1.0
    d[:, 0] = rng.normal(size=2)
    found = solve_poses(layout, r, e, Leans(d, r), "scale")
    at = Pieces(*(Interval.from_bounds(v, v) for v in (r, e, d, r)))
    lower, upper = factor_bounds(layout, at, found)
    assert upper[0] - lower[0] <= 1e-11 * upper[0]
    pairs = tuple(map(tuple, layout.pairs.tolist()))
    here = Position(
        links, pairs, r[0], d[0], tuple(own.tilt for own in limits), tuple(own.axial_clearance for own in limits)
    )
    (x, *_), _, _ = judge(here)
    size = 10.0 ** rng.uniform(-8, 0, (20000, 1))
    fields = x[None, :-1] + size * rng.normal(size=(20000, len(x) - 1))
    fields[:, :3] = 0.0
    worst = np.zeros(20000)
    for k, own in enumerate(limits):
        tau = fields @ np.array([tilt_row(here, k, n)[:-1] for n in ((1.0, 0.0), (0.0, 1.0))]).T - d[0, k]
        worst = np.maximum(worst, np.hypot(*tau.T) / own.tilt)
        worst = np.maximum(worst, np.abs(fields @ slip_row(here, k)[:-1]) / own.axial_clearance)
    assert worst.min() >= lower[0] * (1 - 1e-12) and worst.min() < 1.01 * lower[0]
    loops = layout.incidence
    chosen = found.y[0] + size * rng.normal(size=(20000, found.y.shape[1])) * np.abs(found.y).max()
    wrench = np.einsum("lj,nlc->njc", loops, chosen.reshape(20000, -1, 3))
    centre, length = found.units.centre, found.units.length
    place = (r[0] - centre) / length
    m = wrench[..., :2] + wrench[..., 2:] * np.stack([-place[:, 1], place[:, 0]], axis=-1)
    cost = np.hypot(m[..., 0], m[..., 1]) @ [own.tilt for own in limits]
    cost += np.abs(wrench[..., 2]) @ [own.axial_clearance / length for own in limits]
    bound = np.abs((m * d[0]).sum(axis=(1, 2))) / cost
    assert bound.max() <= upper[0] * (1 + 1e-12) and bound.max() > 0.99 * upper[0]
