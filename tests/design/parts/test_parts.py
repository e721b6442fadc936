"""Parts of mechanisms: what is proved is never contradicted, what collides is found, and masses are right."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings

import graphsynth as gs
from graphsynth import testing
from graphsynth.core.errors import GeometryError
from graphsynth.design import PartSizes, Rounded
from graphsynth.design.parts.gaps import Solid, Tube, apart, gaps, proved_gap, proved_travel
from graphsynth.dynamics import DynamicModel
from graphsynth.mechanism.joints import Prismatic

from .moving import carried, nearest, outline, sharing
from .test_outline import polygon_moments

LAMBDA = gs.gallery.chebyshev_lambda()


@pytest.fixture(scope="module")
def lambda_parts():
    return gs.parts(gs.simulate(LAMBDA), unit=40.0)


def contradictions(made, inputs, spacing=4.0):
    """Pairs of one layer that come nearer than the clearance at inputs between the samples."""
    poses = made.motion.mechanism.simulate(inputs, start=made.motion.poses[0]).poses
    poses = poses[np.isfinite(poses).all(axis=(1, 2))]
    assert len(poses) > len(inputs) // 2
    for one, other in sharing(made):
        P, Q = (carried(outline(shape, spacing), poses, link, made.unit) for _, link, shape, _ in (one, other))
        if nearest(P, Q) < made.sizes.clearance * (1 - 1e-9):
            yield one[0], other[0]


def test_the_lambda_linkage_needs_two_layers(lambda_parts):
    assert lambda_parts.layers == (0, 1, 2, 1)
    assert lambda_parts.certified and lambda_parts.reason == ""
    assert [str(c)[:25] for c in lambda_parts.collisions] == ["link 2 and shaft 0-1 over"]
    assert not list(contradictions(lambda_parts, np.linspace(0, 2 * np.pi, 97)))
    # crank and rocker are nearest when the crank points to the rocker's pivot, or near it
    assert lambda_parts.gap <= 40.0 - 2 * lambda_parts.sizes.boss


def test_every_pin_is_held_by_one_link_and_loose_in_the_others(lambda_parts):
    assert [pin.kind for pin in lambda_parts.plan.pins].count("shaft") == 1
    for pin in lambda_parts.plan.pins:
        for sheet, place in zip(pin.sheets, pin.places):
            [hole] = [hole for hole in lambda_parts.plan.holes[sheet] if hole.hull == (place,)]
            held = sheet == (1 if pin.kind == "shaft" else pin.link)  # the motor's shaft drives the crank
            assert 2 * hole.radius == (lambda_parts.sizes.pin if held else lambda_parts.sizes.hole)
    assert lambda_parts.sizes.hole > lambda_parts.sizes.pin


def moved(mechanism, way, count):
    """Motion from the pose on, by an angle or a length of the driver."""
    driver = mechanism.drivers[0]
    turns = [row[2] for row in mechanism.pose]
    start = turns[driver.link] - turns[driver.base]
    return gs.simulate(mechanism, start + np.linspace(0, way, count), start=np.array(mechanism.pose))


def outside_slots(made, inputs):
    """Joints whose pin leaves its slot at inputs between the samples."""
    motion = made.motion.mechanism.simulate(inputs, start=made.motion.poses[0])
    for joint in made.motion.mechanism.joints:
        if isinstance(joint, Prismatic):
            guides = [pin.at for pin in made.plan.pins if pin.kind == "guide" and pin.name == f"{joint.a}-{joint.b}"]
            middle = sum(guides) / (2 * made.unit)
            way = motion.point(joint.b, (middle.real, middle.imag)).position
            way = way - motion.point(joint.a, joint.at_a).position
            s = made.unit * (way @ [1, 1j] * np.exp(-1j * (motion.poses[:, joint.a, 2] + joint.angle_a))).real
            [slot] = [hole for hole in made.plan.holes[joint.a] if len(hole.hull) > 1]
            ends = (np.array(slot.hull) - made.unit * complex(*joint.at_a)) * np.exp(-1j * joint.angle_a)
            half = abs(guides[0] - guides[1]) / 2
            if s.min() - half < ends.real.min() or s.max() + half > ends.real.max():
                yield joint


@pytest.mark.long
@given(testing.mechanisms(4, 6, prismatic=True))
@settings(max_examples=5, deadline=None)
def test_what_is_certified_is_never_contradicted(mechanism):
    never_contradicted(mechanism)


@pytest.mark.slow
@given(testing.mechanisms(4, 8, prismatic=True))
@settings(max_examples=120, deadline=None)
def test_what_is_certified_of_many_is_never_contradicted(mechanism):
    never_contradicted(mechanism)


def never_contradicted(mechanism):
    motion = moved(mechanism, 0.5, 9)
    assume(motion.completed)
    try:
        made = gs.parts(motion, unit=60.0)
    except GeometryError as error:
        assume("holes of joints" not in str(error) and "has two points" not in str(error))
        assert "no layers without a collision: " in str(error)
        return
    assume(made.certified)
    inputs = motion.inputs[0] + np.linspace(0, 0.5, 23)
    assert not list(contradictions(made, inputs))
    assert not list(outside_slots(made, inputs))


def parallelogram(angle, way):
    mechanism = gs.Mechanism.four_bar(2.0, 3.0, 2.0, 3.0)
    return gs.simulate(mechanism, np.linspace(angle, angle + way, 801))


@pytest.mark.parametrize(("share", "status"), [(1 - 1e-6, "free"), (1 + 1e-6, "hit")])
def test_the_gap_of_parallel_cranks_decides_to_a_millionth(share, status):
    # cranks of a parallelogram at the angle t are 2 sin(t) apart; least at the beginning
    start = math.radians(50)
    motion = parallelogram(start, 0.5)
    sizes = {"pin": 2.0, "hole": 2.0, "wall": 2.0}
    gap = 40.0 * 2.0 * math.sin(start) - 2 * 3.0
    made = gs.parts(motion, unit=40.0, sizes=PartSizes(clearance=gap * share, **sizes))
    assert made.certified
    assert (made.layers[1] == made.layers[3]) is (status == "free")
    assert [c.status for c in made.collisions if {c.one, c.other} == {"link 1", "link 3"}] == ["hit"] * (
        status == "hit"
    )


@pytest.mark.parametrize(("share", "hit"), [(1 - 1e-6, False), (1 + 1e-6, True)])
def test_a_pin_counts_with_its_spacer(share, hit):
    # at first the other crank's pivot is 80 sin(t) from this crank; its spacer is as wide as hole and one wall
    start = math.radians(50)
    gap = 40.0 * 2.0 * math.sin(start) - 3.0 - 2.0
    sizes = PartSizes(clearance=gap * share, pin=2.0, hole=2.0, wall=2.0)
    made = gs.parts(parallelogram(start, 0.5), unit=40.0, sizes=sizes, prove=False)
    assert any({c.one, c.other} == {"link 1", "pin 0-3"} for c in made.collisions) is hit


def test_cranks_that_sweep_over_each_others_pins_have_no_layering():
    drag = gs.Mechanism.four_bar(1.0, 2.5, 2.0, 2.5)
    with pytest.raises(GeometryError, match=r"no layers without a collision: .*link 1 and .*link 3 and ") as told:
        gs.parts(gs.simulate(drag), unit=40.0)
    assert "pin 0-3" in str(told.value) and "shaft 0-1" in str(told.value) and "input" in str(told.value)


def crankshaft():
    """Return a six-bar whose ternary crank turns fully beneath two rods."""
    places = {"O": (0, 0), "B": (-1.875, 0), "C": (0.383, 0.432), "D": (-0.164, 0.727)}
    places |= {"E": (-1.051, 1.131), "F": (-2.157, 1.481), "G": (-0.532, 2.335)}
    return gs.Mechanism.from_points(places, ["OCD", "BEF", "CE", "DG", "FG"], "OB", "OC")


def test_a_crank_under_two_rods_becomes_two_sheets():
    made = gs.parts(gs.simulate(crankshaft()), unit=100.0)
    assert made.certified and made.plan.links == (0, 1, 2, 3, 4, 5, 1)
    assert "two sheets      link 1, joined by the pin of joint 1-" in repr(made)
    [joining] = [pin for pin in made.plan.pins if {1, 6} <= set(pin.sheets)]
    for sheet, place in zip(joining.sheets, joining.places):
        [hole] = [hole for hole in made.plan.holes[sheet] if hole.hull == (place,)]
        assert hole.radius == (made.sizes.pin if made.plan.links[sheet] == 1 else made.sizes.hole) / 2
    # every joint of the link is on one of its sheets or on both, and the whole crank counts as one body
    on = [sum(made.plan.links[sheet] == 1 for sheet in pin.sheets) for pin in made.plan.pins]
    assert sorted(on) == [0, 0, 0, 0, 1, 1, 2]
    sheets = sum(made.moments(k).area for k in (1, 6)) * made.sizes.thickness * 1e-9 * 680.0
    assert sheets < made.bodies()[1].mass < 1.5 * sheets
    assert not list(contradictions(made, np.linspace(0, 2 * np.pi, 41)))


def turning(rate, width, count):
    """Two links: the frame, and one that turns about the origin from angle 0 on."""
    h = width / count
    mid = h * (np.arange(count) + 0.5)
    x, V = np.zeros((count, 2, 3)), np.zeros((count, 2, 3))
    x[:, 1, 2], V[:, 1, 2] = rate * mid, rate
    return Tube(mid, np.full(count, h / 2), x, V, np.zeros((count, 2, 3)))


@pytest.mark.parametrize("boxes", [1, 7])
def test_a_collision_between_samples_is_found(boxes):
    bar, disc = Solid(1, Rounded.around([0j, 10 + 0j], 0.5)), Solid(0, Rounded.around([9 * np.exp(2j)], 0.01))
    found = proved_gap(bar, disc, turning(1.0, 3.0, boxes), 0.1)
    # the bar is within reach while 9 sin(u - 2) < 0.61
    assert found.status == "hit" and abs(found.input - 2.0) < math.asin(0.61 / 9) + 1e-9
    short = proved_gap(bar, disc, turning(1.0, 2.0 - math.asin(0.61 / 9) - 1e-5, boxes), 0.1)
    assert short.status == "free" and 0.1 <= short.gap <= 0.1 + 2e-4
    wide = turning(1.0, 1.9, boxes)
    wide.radius[:, 1, 2] = 0.2  # the angle is known to 0.2 only
    assert proved_gap(bar, disc, wide, 0.1).status == "undecided"


def test_a_gap_that_is_largest_in_the_middle_is_not_taken_for_the_least():
    # a point on a circle above a wall: at the top it moves along the wall, and at both ends it is 2.955 from it
    point, wall = Solid(1, Rounded((10 + 0j,), 0.0)), Solid(0, Rounded.around([-20 + 0j, 20 + 0j], 0.0))
    way = math.pi - 0.6
    tube = turning(1.0, way, 1)
    tube.x[:, 1, 2] += 0.3
    least = 10 * math.sin(0.3)
    assert proved_gap(point, wall, tube, least + 0.01).status == "hit"
    found = proved_gap(point, wall, tube, least - 1e-6)
    assert found.status == "free" and found.gap <= least


def test_travel_in_a_slot_is_proved_only_if_it_is_long_enough():
    guide, line = Solid(1, Rounded((10 + 0j,), 0.0)), Solid(0, Rounded((1 + 0j,), 0.0))
    tube = turning(1.0, 3.0, 2)  # x = 10 cos(u) - 1 from 9 down to -10.8999
    low = 10 * math.cos(3.0) - 1
    turned = Solid(1, Rounded((0j,), 0.0)), Solid(0, Rounded((10 + 0j,), 0.0))  # the line turns, the point is at rest
    assert proved_travel(turned[1], turned[0], 0.0, tube, (low + 1 - 1e-6, 10.0 + 1e-6))
    assert not proved_travel(turned[1], turned[0], 0.0, tube, (low + 1 + 1e-3, 10.0 + 1e-6))
    assert proved_travel(guide, line, 0.0, tube, (low - 1e-6, 9.0 + 1e-6))
    assert not proved_travel(guide, line, 0.0, tube, (low + 1e-3, 9.0 + 1e-6))
    assert not proved_travel(guide, line, 0.0, tube, (low - 1e-3, 9.0 - 1e-3))


def test_gaps_of_segments_and_polygons():
    poses = np.zeros((1, 2, 3))
    square = Solid(0, Rounded.around([0j, 4 + 0j, 4 + 4j, 4j], 0.25))
    for hull, expected in (
        ([6 + 2j], 2.0),
        ([7 + 8j], 5.0),
        ([2 + 2j], 0.0),
        ([-1 + 2j, 9 + 2j], 0.0),
        ([6 + 6j, 6 - 6j], 2.0),
        ([5 + 5j, 9 + 1j], math.sqrt(2)),
        ([1 + 1j, 2 + 1j, 2 + 2j], 0.0),
    ):
        found = gaps(square, Solid(1, Rounded.around(hull, 0.5)), poses)[0]
        assert found == pytest.approx(expected - 0.75, abs=1e-12), hull


def test_a_pin_in_the_middle_of_a_slider_may_reach_through_the_slot():
    made = gs.parts(gs.simulate(gs.Mechanism.slider_crank(1.0, 3.0)), unit=40.0)
    [pin] = [pin for pin in made.plan.pins if pin.passes]
    [slot] = [sheet for sheet, holes in enumerate(made.plan.holes) if any(len(hole.hull) > 1 for hole in holes)]
    assert pin.passes == (slot,) and pin.kind == "pin" and slot not in pin.sheets


def test_a_slider_has_a_slot_with_two_guides():
    made = gs.parts(gs.simulate(gs.Mechanism.slider_crank(1.0, 3.0)), unit=40.0)
    assert made.certified
    slots = [hole for hole in made.plan.holes[0] if len(hole.hull) > 1]
    guides = [pin for pin in made.plan.pins if pin.kind == "guide"]
    assert len(slots) == 1 and len(guides) == 2
    length = abs(slots[0].hull[1] - slots[0].hull[0])
    apart = abs(guides[1].at - guides[0].at)
    assert length == pytest.approx(2 * 40.0 + apart + 2 * made.sizes.clearance, rel=1e-4)
    assert not list(contradictions(made, np.linspace(0, 2 * np.pi, 41)))


def test_guides_of_a_cylinder_move_along_its_axis_until_the_slot_is_clear_of_its_eye():
    """At its shortest, the rod of the cylinder from B to C ends in the eye of the barrel."""
    places = {"A": (0, 0), "B": (3, 0), "C": (2, 2)}
    crane = gs.Mechanism.from_points(places, ["AC"], "AB", ["BC"], cylinders=["BC"])
    inputs = np.linspace(0, 1, 41)
    made = gs.parts(gs.simulate(crane, inputs), unit=50.0)
    assert made.certified and list(outside_slots(made, np.linspace(0, 1, 97))) == []
    guides = [pin for pin in made.plan.pins if pin.kind == "guide"]
    eye = next(joint for joint in crane.joints if joint.kind == "P")
    [slot] = [hole for hole in made.plan.holes[eye.a] if len(hole.hull) > 1]
    round_holes = [hole for hole in made.plan.holes[eye.a] if len(hole.hull) == 1]
    assert round_holes
    for hole in round_holes:
        assert apart(slot.hull, hole.hull) >= slot.radius + hole.radius + made.sizes.wall / 2
    way = np.exp(1j * eye.angle_b)  # the guides stay on the axis
    assert [((pin.at / 50 - complex(*eye.at_b)) / way).imag for pin in guides] == pytest.approx([0, 0], abs=1e-12)


@pytest.mark.long
def test_a_pin_by_default_is_small_enough_for_the_holes():
    # crank and slotted link sweep over each other's pivots: with a pin that fits, this is what is wrong
    with pytest.raises(
        GeometryError, match=r"no layers without a collision: .*link 1 and pin 0-2 .*link 2 and shaft 0-1"
    ):
        gs.parts(gs.simulate(gs.gallery.whitworth_quick_return()), unit=40.0)
    with pytest.raises(GeometryError, match="holes of joints 0-2 and 2-4 in link 2 are"):
        gs.parts(gs.simulate(gs.gallery.whitworth_quick_return()), unit=40.0, sizes=PartSizes(pin=5.0))


def test_mass_centre_and_inertia_by_fine_polygons(lambda_parts):
    density, t = 700.0, lambda_parts.sizes.thickness
    bodies = lambda_parts.bodies(density)
    assert sorted(bodies) == [1, 2, 3]
    for link, body in bodies.items():
        total = np.array(polygon_moments(lambda_parts.plan.outlines[link].flat(1e-6)), dtype=complex)
        for hole in lambda_parts.plan.holes[link]:
            total -= polygon_moments(hole.flat(1e-6))
        total *= t
        for k, pin in enumerate(lambda_parts.plan.pins):
            if pin.link == link and pin.kind != "shaft":
                area, first, second = polygon_moments(Rounded((pin.at,), lambda_parts.sizes.pin / 2).flat(1e-6))
                total += np.array([area, first, second]) * lambda_parts.pin_length(k)
        volume, first, second = total[0].real, total[1], total[2].real
        assert body.mass == pytest.approx(density * volume * 1e-9, rel=1e-5)
        assert complex(*body.centre) == pytest.approx(first / volume * 1e-3, rel=1e-5)
        central = second - abs(first) ** 2 / volume
        assert body.inertia == pytest.approx(density * central * 1e-15, rel=1e-5)


def test_dynamics_has_the_mechanism_in_metres(lambda_parts):
    model = lambda_parts.dynamics(gravity=(0.0, 0.0))
    assert isinstance(model, DynamicModel) and model.bodies == lambda_parts.bodies()
    inputs = np.linspace(0, 6, 5)
    small, large = (gs.simulate(m, inputs).poses for m in (model.mechanism, LAMBDA))
    np.testing.assert_allclose(small, large * [0.04, 0.04, 1.0], rtol=1e-12, atol=1e-14)


def test_the_bill_adds_up(lambda_parts):
    table = lambda_parts.to_pandas()
    pins = table[table.part.isin(["pin", "shaft"])]
    assert int(pins["number"].sum()) == 4
    moving = sum(body.mass for body in lambda_parts.bodies().values())
    rows = {row.part: row for row in lambda_parts.bill}
    held = [k for k, pin in enumerate(lambda_parts.plan.pins) if pin.link and pin.kind == "pin"]
    assert moving * 1e3 == pytest.approx(
        sum(rows[f"link {k}"].mass for k in (1, 2, 3)) + len(held) * rows["pin"].mass, rel=1e-12
    )
    assert (rows["link 2"].length, rows["link 2"].width) == pytest.approx(
        (200 + 2 * lambda_parts.sizes.boss, 2 * lambda_parts.sizes.boss), rel=1e-12
    )
    assert len(repr(lambda_parts).splitlines()) <= 10


def test_heads_have_room_where_nothing_sweeps_over_the_end_of_a_pin(lambda_parts):
    """By the definition, at samples of its own: a disc on the end of the pin against what lies in the next layer."""
    heads = {pin.title: lambda_parts.heads(k) for k, pin in enumerate(lambda_parts.plan.pins)}
    above = {"pin 1-2": (False, True), "pin 2-3": (False, True)}
    assert heads == {"shaft 0-1": (True, False), "pin 0-3": (True, True), **above}
    for made in (lambda_parts, gs.parts(gs.simulate(crankshaft()), unit=100.0)):
        poses = made.motion.poses * [made.unit, made.unit, 1.0]
        for k, pin in enumerate(made.plan.pins):
            disc = Solid(pin.link, Rounded((pin.at,), made.sizes.spacer))
            _, high = made.span(k)
            above = [
                Solid(made.plan.links[sheet], made.plan.outlines[sheet])
                for sheet, layer in enumerate(made.layers)
                if layer == high + 1
            ]
            above += [
                Solid(other.link, Rounded((other.at,), made.sizes.spacer))
                for j, other in enumerate(made.plan.pins)
                if made.span(j)[0] <= high + 1 <= made.span(j)[1]
            ]
            free = all(gaps(disc, body, poses).min() >= made.sizes.clearance for body in above)
            assert made.heads(k)[1] == free


def test_spacers_fill_the_way_between_links_that_are_not_neighbours():
    made = gs.parts(gs.simulate(gs.gallery.klann()), unit=200.0)
    s = made.sizes
    for k, pin in enumerate(made.plan.pins):
        low, high = made.span(k)
        stack = len(pin.sheets) * s.thickness + sum(made.spacers(k)) + made.washers(k) * s.washer
        assert stack == pytest.approx(made.pin_length(k), rel=1e-12)
        assert made.pin_length(k) == pytest.approx((high - low) * (s.thickness + s.washer) + s.thickness, rel=1e-12)
    assert any(made.spacers(k) for k in range(len(made.plan.pins)))


def test_bad_input_is_told():
    motion = gs.simulate(LAMBDA)
    with pytest.raises(GeometryError, match=r"unit = 0\.0 must be positive"):
        gs.parts(motion, unit=0.0)
    with pytest.raises(GeometryError, match=r"unit = 1e\+300 mm is no unit"):
        gs.parts(motion, unit=1e300)
    with pytest.raises(GeometryError, match=r"pin = -1\.0 must be positive"):
        PartSizes(pin=-1.0)
    with pytest.raises(GeometryError, match="hole = 3 is smaller than the pin, 5"):
        gs.parts(motion, unit=40.0, sizes=PartSizes(hole=3.0, pin=5.0))
    with pytest.raises(
        GeometryError, match=r"holes of joints .* in link 1 are 40 mm apart, and need 55.2; make the pin"
    ):
        gs.parts(motion, unit=40.0, sizes=PartSizes(pin=30.0))
    with pytest.raises(GeometryError, match="is not a motion"):
        gs.parts(LAMBDA)


def test_without_a_proof_it_is_estimated():
    made = gs.parts(gs.simulate(LAMBDA), unit=40.0, prove=False)
    assert not made.certified and made.statement.startswith("estimated at ") and "no proof was asked for" in made.reason
    assert made.layers == (0, 1, 2, 1)
