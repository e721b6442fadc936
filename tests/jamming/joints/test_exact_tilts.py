"""Exact tilts: no certificate contradicts that of a single bearing, or links placed in space by brute force."""

import math

import numpy as np
import pytest
from coupled_oracles import embodied, four_bar
from spatial_oracle import spatial

from graphsynth import Driver, Mechanism, MechanismGraph, Prismatic, Revolute, simulate
from graphsynth.intervals import Interval
from graphsynth.jamming import Bearing, ToleranceBox, Verdict, certify_jamming
from graphsynth.jamming.assembly import positions
from graphsynth.jamming.assembly.tubes import prove_tubes
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    SlideLimits,
    assess_coupled,
    certify_coupled,
    largest_scale,
)
from graphsynth.jamming.joints.closure import Leans, joint_places, leans
from graphsynth.jamming.joints.enclosure import Pieces, lower_bounds, upper_bounds
from graphsynth.jamming.joints.exact import Neglected, _movements, neglected
from graphsynth.jamming.joints.pieces import Work
from graphsynth.jamming.joints.program import problem, solve_poses

FREE, JAMMED = Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED
NEAR_WORST = np.linspace(1.5, 1.64, 3)


def bearing_with(tilt, large):
    """A bearing whose critical tilt (condition A) is the one wanted."""
    R, H = (17.5, 60.0) if large else (17.5, 10.0)
    S, C = math.sin(tilt), math.cos(tilt)
    return Bearing(Rb=R, Hb=H, clearance=H / 2 * S - R * S * S / (1 + C))


@pytest.mark.parametrize(
    ("lengths", "alpha"),
    [
        ((1, 3, 2, 3.5), 0.05),
        ((1, 3, 2, 3.5), 0.4),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                ((1, 3, 2, 3.5), 0.02),
                ((1, 3, 2, 3.5), 0.2),
                ((2, 1, 2.5, 2.5), 1 / 30),
                ((2, 1, 2.5, 2.5), 0.3),
            )
        ),
    ],
)
def test_two_certificates_of_one_bearing_never_contradict(lengths, alpha):
    """Spherical at A and rigid at C leave all to B, whose critical tilt lies between the exact and the linear one."""
    linear, exact = lengths[1] / lengths[2] * alpha, math.asin(lengths[1] / lengths[2] * math.sin(alpha))
    motion = simulate(four_bar(*lengths), NEAR_WORST)
    bearing = bearing_with(0.5 * (linear + exact), alpha > 0.1)
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): bearing, (0, 3): RIGID}
    shared = certify_coupled(motion, joints, Misalignment(0, 1, alpha), resolution=1e-2)
    alone = certify_jamming(ToleranceBox(*lengths, alpha=alpha, Rb=bearing.Rb, Hb=bearing.Hb,
                                         clearance=bearing.clearance))  # fmt: skip
    assert alone.verdict in (FREE, JAMMED)
    assert shared.verdict is Verdict.UNDECIDED and shared.small_tilts not in (alone.verdict, Verdict.UNDECIDED)
    assert "second order" in shared.reason and "small tilts (first order)" in shared.reason
    report = assess_coupled(motion, joints, Misalignment(0, 1, alpha), certify=True, seconds=1.0)
    assert report.verdict is Verdict.UNDECIDED and "exact tilts" in report.model == report.summary()["model"]
    assert "small tilts" in assess_coupled(motion, joints, Misalignment(0, 1, alpha)).model


@pytest.mark.long
@pytest.mark.parametrize(("alpha", "margin"), [(1 / 30, 0.01), (0.1, 0.06)])
def test_outside_the_margin_both_are_certified(alpha, margin):
    exact = math.asin(0.4 * math.sin(alpha))
    motion = simulate(four_bar(), NEAR_WORST)
    for side, wanted in ((1, FREE), (-1, JAMMED)):
        bearing = bearing_with(exact * (1 + side * margin), False)
        joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): bearing, (0, 3): RIGID}
        shared = certify_coupled(motion, joints, Misalignment(0, 1, alpha))
        alone = certify_jamming(ToleranceBox(2, 1, 2.5, 2.5, alpha=alpha, Rb=bearing.Rb, Hb=bearing.Hb,
                                             clearance=bearing.clearance))  # fmt: skip
        assert shared.verdict is alone.verdict is shared.small_tilts is wanted
        assert "exact tilts" in shared.summary()["model"] and "exact tilt" in alone.statement
        assert "L0" in alone.summary()["model"]


def test_the_margin_is_of_the_order_of_alpha_squared():
    """Lambda linkage with equal bearings: decided at ten times alpha squared, on both sides."""
    motion = simulate(four_bar(), NEAR_WORST)
    critical = Bearing().critical_tilt("A").angle
    margin = 10.0 * (2 * critical) ** 2
    for side, wanted in ((-1, FREE), (1, JAMMED)):
        tilt = Misalignment(0, 1, 2 * critical * (1 + side * margin))
        assert certify_coupled(motion, Bearing(), tilt).verdict is wanted
    assert "small tilts (first order)" in largest_scale(motion, Bearing(), tilt, relative_gap=0.1).model


def case(rng, kind):
    """A four-bar with random limits, its pose, and the first-order factor."""
    while True:
        mechanism = four_bar(rng.uniform(1.5, 3.0), 1.0, rng.uniform(2.0, 3.5), rng.uniform(2.0, 3.5))
        u = rng.uniform(0.0, 6.28)
        motion = simulate(mechanism, [u, u + 0.01])
        if not motion.assembled.all():
            continue
        alpha = rng.choice([0.05, 0.1, 0.2])
        tilt = Misalignment(0, 1, alpha, rng.uniform(0.0, 6.28))
        limits = {j.pair: (rng.uniform(0.15, 0.6) * alpha, rng.choice([0.0, rng.uniform(0.0, 0.3) * alpha]))
                  for j in mechanism.joints}  # fmt: skip
        if kind == "spherical":
            limits[1, 2] = (math.inf, limits[1, 2][1])
        if kind == "rigid":
            limits[0, 3] = (0.0, 0.0)
        given = problem(mechanism, joint_limits(limits), tilt)
        factor = given.solve(motion.poses[:1], "scale").lower[0]
        if 0.1 < factor < 10.0:
            return mechanism, motion, tilt, limits, float(factor)


def joint_limits(limits, scale=1.0):
    return {pair: JointLimits(t * scale, s * scale) for pair, (t, s) in limits.items() if pair != (0, 1)}


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 12))])
@pytest.mark.parametrize("kind", ["bearings", "spherical", "rigid"])
def test_links_placed_in_space_agree(kind, seed):
    """Near the verge, where exact and small tilts differ: what is proved is what optimization in space finds."""
    rng = np.random.default_rng([seed, len(kind)])
    mechanism, motion, tilt, limits, factor = case(rng, kind)
    for away in (rng.uniform(-3, 3), rng.choice([-15.0, 15.0])):
        scale = factor * (1.0 + away * tilt.alpha**2)
        given = problem(mechanism, joint_limits(limits, scale), tilt)
        u = motion.inputs[:1]
        sure = int(Work(given, motion, 0.0).evaluate(u, u).sure[0])
        own = {pair: (t * scale, s * scale) for pair, (t, s) in limits.items()}
        least, missed = spatial(mechanism, motion.poses[0], tilt, own).least_factor(6 if seed else 1)
        assert missed < 1e-6
        assert sure == 0 or (least < 1.0 + 1e-7 if sure > 0 else least > 1.0 - 1e-7)
        if abs(away) == 15.0 and kind == "rigid":
            assert sure == np.sign(away)


def bounds_at(given, motion):
    """What exact tilts change at the first pose, for a proof of a jam."""
    work = Work(given, motion, 0.0)
    u = Interval.from_bounds(motion.inputs[:1], motion.inputs[:1])
    x, _ = work.system.coordinates(motion.poses[:1], motion.velocities[:1])
    counted = work.system.count(motion.poses[:1])
    tubes = prove_tubes(work.system, given.layout.joints, u, x, counted)
    none = np.full((1, len(given.layout.limit)), math.inf)
    return tubes, neglected(work.system, given.layout, tubes, u, counted, none)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2))
def test_joints_move_no_further_than_bounded(seed):
    """Exact positions within the limits: joints, tilts and the rest of the closure stay inside the bounds."""
    rng = np.random.default_rng([7, seed])
    mechanism, motion, tilt, limits, factor = case(rng, "bearings")
    scale = 1.05 * factor
    given = problem(mechanism, joint_limits(limits, scale), tilt)
    tubes, exact = bounds_at(given, motion)
    assert exact.sound.all()
    own = {pair: (t * scale, s * scale) for pair, (t, s) in limits.items()}
    here = spatial(mechanism, motion.poses[0], tilt, own)
    x, least = here.solve()
    assert least <= 1.0  # a member of what the bounds are about
    links = here.links(x)
    normals = {k: R.apply([0.0, 0.0, 1.0]) for k, (R, _) in links.items()}
    for place, k in enumerate(given.layout.joints):
        joint = mechanism.joints[k]
        R, p = links[joint.b]
        centre = (p + R.apply([*joint.at_b, 0.0]))[:2]
        assert math.dist(centre, tubes.r.mid[0, place]) <= exact.r[0, place] + 1e-9
        if joint.pair == (0, 1):
            continue
        block = list(given.layout.block_joint).index(place)
        change = normals[joint.b][:2] - normals[joint.a][:2]
        angle = math.acos(min(1.0, normals[joint.b] @ normals[joint.a]))
        assert np.hypot(*change) <= exact.wide[0, block] + 1e-9
        assert exact.narrow[0, block] <= given.layout.limit[block] and angle <= given.layout.limit[block] * (1 + 1e-7)
    assert (exact.r < 5.0 * tilt.alpha**2 * 10.0).all()  # and they are of second order


def test_a_link_without_any_limit_leaves_a_jam_unproved():
    """Nothing bounds the roll of a link between two spherical joints: a jam of small tilts is not certified."""
    motion = simulate(four_bar(), NEAR_WORST)
    joints = {(1, 2): SPHERICAL, (2, 3): JointLimits(math.inf, 0.0), (0, 3): RIGID}
    tilt = Misalignment(0, 1, 0.05)
    found = certify_coupled(motion, {**joints, (2, 3): SPHERICAL}, tilt, resolution=1e-2)
    assert found.verdict is found.small_tilts is FREE  # the heights of A are taken by the coupler
    steep = certify_coupled(motion, JointLimits(0.7), Misalignment(0, 1, 0.001), resolution=1e-2)
    assert steep.verdict is FREE  # the limits are wide, the tilts that are needed are not


@pytest.mark.long
def test_guides_and_more_loops_are_decided_too():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3, (0.0, 0.2))]
    pins = {(1, 2): JointLimits(0.01, 0.01), (2, 3): JointLimits(0.01), (0, 3): SlideLimits(0.01, 0.008, 0.002)}
    slider = Mechanism(graph, joints, [Driver(0, 1)]), pins, Misalignment(0, 1, 0.01, 0.8)
    chain = embodied(6, 1)
    base, link = chain.drivers[0].pair
    watt = chain, {j.pair: JointLimits(0.006, 0.001) for j in chain.joints}, Misalignment(base, link, 0.01, 0.3)
    for mechanism, limits, tilt in (slider, watt):
        motion = simulate(mechanism, np.linspace(0.3, 0.5, 3))
        scale = assess_coupled(motion, limits, tilt).smallest_scale
        for change, wanted in ((0.98, FREE), (1.02, JAMMED)):
            own = Misalignment(tilt.base, tilt.link, tilt.alpha * scale * change, tilt.direction)
            found = certify_coupled(motion, limits, own, resolution=1e-2)
            assert found.verdict is wanted, found.reason


def disturbed_bounds(given, poses, **changes):
    """Bounds of the factor with chosen disturbances of everything, at float positions."""
    places = joint_places(given.mechanism, given.layout.joints, poses)
    here = places.r, places.e, *leans(given.layout, places)
    at = Pieces(*(Interval.from_bounds(v, v) for v in here))
    layout, count = given.layout, len(poses)
    joints = len(layout.joints)
    none = np.zeros((count, joints))
    values = {
        "r": none, "e": none, "d": none, "about": none, "lift": np.zeros((count, layout.loops)),
        "wide": np.tile(layout.limit, (count, 1)), "narrow": np.tile(layout.limit, (count, 1)),
        "end_float": np.tile(layout.end_float, (count, 1)), "sound": np.ones(count, dtype=bool), **changes,
    }  # fmt: skip
    found = given.solve(poses, "scale")
    exact = Neglected(**values)
    return lower_bounds(layout, at, found, exact), upper_bounds(layout, at, found, exact), found, here


def slider_and_four_bar():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    guide = Prismatic(0, 3, (0.0, 0.2), (0.0, 0.0), 0.4)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), guide]
    pins = {(1, 2): JointLimits(0.01, 0.01), (2, 3): JointLimits(0.01), (0, 3): SlideLimits(0.02, 0.008, 0.02)}
    yield Mechanism(graph, joints, [Driver(0, 1)]), pins, Misalignment(0, 1, 0.03, 0.8)
    bearings = {(1, 2): JointLimits(0.02, 0.01), (2, 3): JointLimits(0.01), (0, 3): JointLimits(0.015, 0.02)}
    yield four_bar(), bearings, Misalignment(0, 1, 0.03, 0.3)
    yield Mechanism(graph, joints, [Driver(0, 1)]), {**pins, (0, 1): RIGID}, Misalignment(0, 3, 0.02, 1.8, rigid=False)


@pytest.mark.long
@pytest.mark.parametrize("part", ["r", "e", "d", "about"])
def test_bounds_hold_for_every_disturbance_within(part):
    """Positions, guides and misalignments moved by what is allowed: the factor of none lies beyond the bounds."""
    rng = np.random.default_rng(3)
    size, reached = {"r": 0.05, "e": 0.04, "d": 0.002, "about": 0.05}[part], False
    for mechanism, limits, tilt in slider_and_four_bar():
        given = problem(mechanism, limits, tilt)
        poses = simulate(mechanism, [0.7, 1.9]).poses
        rails = np.isin(np.arange(len(given.layout.joints)), given.layout.rails)
        if part == "about" and not rails.any():
            continue
        amount = {part: np.full((2, len(given.layout.joints)), size)}
        if part == "r":  # other joints than rails lean where they are
            amount["about"] = np.where(rails, 0.0, amount["r"])
        lower, upper, found, places = disturbed_bounds(given, poses, **amount)
        assert (lower <= found.lower).all() and (upper >= found.upper).all()
        least, most = found.upper.copy(), found.lower.copy()
        for _ in range(24):
            r, e, d, about = (v.copy() for v in places)
            turned = {"r": r, "e": e, "d": d, "about": about}[part]
            angle = rng.uniform(0.0, 2.0 * np.pi, turned.shape[:2])
            step = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * size
            turned += step if part != "d" else step * (np.abs(d).sum(axis=-1, keepdims=True) > 0.0)
            about = np.where(rails[:, None], about, r)
            other = solve_poses(given.layout, r, e, Leans(d, about), "scale")
            least, most = np.minimum(least, other.upper), np.maximum(most, other.lower)
        assert (lower <= least * (1 + 1e-9)).all() and (upper >= most * (1 - 1e-9)).all()
        reached |= bool(((least < found.lower - 0.1 * (found.lower - lower)) & (most > found.upper)).any())
    assert reached  # samples come near: the test can fail


def test_limits_rest_and_soundness_of_disturbed_bounds():
    mechanism, limits, tilt = list(slider_and_four_bar())[1]
    given = problem(mechanism, limits, tilt)
    poses = simulate(mechanism, [0.7, 1.9]).poses
    lower, upper, found, _ = disturbed_bounds(given, poses)
    assert lower == pytest.approx(found.lower, rel=1e-9) and upper == pytest.approx(found.upper, rel=1e-9)
    layout = given.layout
    rigid = problem(mechanism, {pair: JointLimits(own.tilt) for pair, own in limits.items()}, tilt)
    plain = disturbed_bounds(rigid, poses)
    doubled = disturbed_bounds(rigid, poses, wide=2.0 * np.tile(layout.limit, (2, 1)))
    assert doubled[0] == pytest.approx(0.5 * plain[0], rel=1e-9)
    halved = disturbed_bounds(rigid, poses, narrow=0.5 * np.tile(layout.limit, (2, 1)))
    assert halved[1] == pytest.approx(2.0 * plain[1], rel=1e-9)
    less = disturbed_bounds(given, poses, end_float=0.5 * np.tile(layout.end_float, (2, 1)))
    assert (less[1] >= upper).all() and (less[1] > upper * 1.0001).any()
    rest = disturbed_bounds(rigid, poses, lift=np.full((2, layout.loops), 0.01))
    assert (rest[0] < 0.999 * plain[0]).all() and (rest[1] > 1.001 * plain[1]).all()
    unsound = disturbed_bounds(given, poses, sound=np.array([False, True]))
    assert unsound[0][0] == 0.0 and unsound[1][0] == math.inf and unsound[0][1] == lower[1]


def test_what_is_neglected_of_a_four_bar():
    """Angles, limits, misalignment, rest and movement against the formulas, written down for one loop."""
    alpha, tilts, slips = 0.1, {(1, 2): 0.05, (2, 3): 0.04, (0, 3): 0.03}, {(1, 2): 0.02, (2, 3): 0.0, (0, 3): 0.01}
    motion = simulate(four_bar(), [0.7, 0.8])
    tilt = Misalignment(0, 1, alpha, 0.4)
    given = problem(motion.mechanism, {pair: JointLimits(t, slips[pair]) for pair, t in tilts.items()}, tilt)
    _, exact = bounds_at(given, motion)
    angle = {0: 0.0, 1: alpha, 2: min(alpha + 0.05, 0.03 + 0.04), 3: 0.03}
    length = {0: 2.0, 1: 1.0, 2: 2.5, 3: 2.5}
    short = {k: length[k] * (1.0 - math.cos(angle[k])) for k in angle}
    slip, rest, order = 0.0, 0.0, list(given.layout.joints)
    for place, k in enumerate(order):
        a, b = motion.mechanism.joints[k].pair
        if (a, b) == (0, 1):
            assert exact.d[0, place] == pytest.approx(alpha**3 / 6, rel=1e-9)  # the frame neither tilts nor turns
            continue
        block, t = list(given.layout.block_joint).index(place), tilts[a, b]
        H = min(angle[a], angle[b])
        off = t * (H**2 + H * t) / (1.0 + math.cos(H))
        assert exact.wide[0, block] == pytest.approx(t + off, rel=1e-9)
        assert exact.narrow[0, block] == pytest.approx(t * (1.0 - t**2 / 5.0) - off, rel=1e-9)
        lean = math.sin(max(angle[a], angle[b]))
        assert exact.end_float[0, place] == pytest.approx(slips[a, b] * (1.0 - lean**2 / 2.0), rel=1e-9, abs=1e-15)
        assert exact.d[0, place] == 0.0
        rest += slips[a, b] * lean**2
        slip = max(slip, slips[a, b] * lean)
    rest += sum(math.sin(angle[k]) * short[k] for k in angle)
    assert exact.lift[0, 0] == pytest.approx(rest, rel=1e-9)
    moved = dict(zip((motion.mechanism.joints[k].pair for k in order), exact.r[0]))
    # A lies on the crank alone, and may slip; beyond it all links are too short
    assert moved[1, 2] >= short[1] + slips[1, 2] * math.sin(alpha)
    still = problem(motion.mechanism, {pair: JointLimits(t) for pair, t in tilts.items()}, tilt)
    place = [motion.mechanism.joints[k].pair for k in order].index((1, 2))
    assert moved[1, 2] - bounds_at(still, motion)[1].r[0, place] >= 0.99 * slips[1, 2] * math.sin(alpha)
    assert moved[2, 3] >= max(short[2], short[3], slip) and moved[2, 3] < 20.0 * (sum(short.values()) + 2 * slip)


def test_a_box_without_a_single_assembly_is_not_sound():
    """Next to a dead centre the disturbed linkage may have two positions, or none."""
    mechanism = four_bar(2.0, 1.0, 1.6, 1.5)
    dead = math.acos((1.0 + 4.0 - 3.1**2) / 4.0) if abs((1.0 + 4.0 - 3.1**2) / 4.0) <= 1 else math.pi - 1e-4
    motion = simulate(mechanism, [dead - 2e-3, dead - 1e-3])
    given = problem(mechanism, JointLimits(0.1), Misalignment(0, 1, 0.1))
    u = motion.inputs[:1]
    assert Work(given, motion, 0.0).evaluate(u, u).sure[0] in (0, 1)
    tight = problem(mechanism, JointLimits(0.02), Misalignment(0, 1, 0.4))
    assert not bounds_at(problem(mechanism, JointLimits(0.3), Misalignment(0, 1, 0.4)), motion)[1].sound.any()
    assert bounds_at(tight, motion)[1].r.max() > 0.0


@pytest.mark.long
@pytest.mark.parametrize(("lengths", "u"), [((2, 1, 1.6, 1.5), 2.5), ((2, 1, 2.5, 2.5), 1.0), ((2, 1, 1.2, 1.0), 1.0)])
def test_movements_that_lead_out_of_the_box_are_not_sound(monkeypatch, lengths, u):
    """The box is twice what is expected to first order: bounds of more say nothing, the equations may be regular."""
    monkeypatch.setattr(positions, "find_dyads", lambda *_: [])
    motion = simulate(four_bar(*lengths), [u, u + 1e-3])
    given = problem(motion.mechanism, JointLimits(0.1), Misalignment(0, 1, 0.1))
    work, at = Work(given, motion, 0.0), Interval.from_bounds(motion.inputs[:1], motion.inputs[:1])
    x, _ = work.system.coordinates(motion.poses[:1], motion.velocities[:1])
    counted = work.system.count(motion.poses[:1])
    tubes = prove_tubes(work.system, given.layout.joints, at, x, counted)

    def moved(size):
        offset = np.full((1, 4), size)
        (r, _), _, _, sound = _movements(work.system, given.layout, tubes, at, counted, offset, 0.0 * offset)
        return r.max() / size, bool(sound[0])

    first, sound = moved(1e-6)
    assert sound
    beyond = 0
    for size in np.geomspace(0.01, 0.08, 8):
        more, sound = moved(size)
        if 3.0 * first < more < math.inf:
            assert not sound
            beyond += 1
    assert beyond
