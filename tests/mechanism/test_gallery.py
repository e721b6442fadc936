"""Every classic has the property it is known for."""

import math

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import residual

gallery = gs.gallery


@pytest.mark.parametrize("name", gallery.__all__)
def test_each_is_assembled_moves_is_drawn_and_has_a_source(name):
    make = getattr(gallery, name)
    linkage = make()
    assert np.abs(residual(linkage.joints, linkage.pose)).max() < 1e-12
    assert linkage.graph.mobility == len(linkage.drivers)
    motion = linkage.simulate(events=False)
    assert motion.completed and motion.residual < 1e-12
    assert linkage.draw().svg.startswith("<svg")
    assert "Source: " in make.__doc__


@pytest.mark.parametrize(
    "name",
    [
        "chebyshev_lambda",
        "watt_six_bar",
        "stephenson_six_bar",
        "whitworth_quick_return",
        "klann",
        "jansen",
        "toggle_press",
    ],
)
def test_cranks_turn_fully(name):
    assert getattr(gallery, name)().simulate().closure.closed


def test_chebyshevs_lambda_is_nearly_straight_over_half_a_turn():
    path = gallery.chebyshev_lambda().simulate("90..270 deg").point("P")
    assert np.ptp(path.position[:, 0]) == pytest.approx(4.0, abs=2e-3)
    assert np.ptp(path.position[:, 1]) < 0.011 * 4.0


def test_watts_linkage_is_nearly_straight_in_the_middle_of_its_stroke():
    path = gallery.watt_straight_line().simulate("-12..12 deg").point("P").position
    assert np.ptp(path[:, 0]) < 2e-3 * np.ptp(path[:, 1])
    slope = np.diff(path[170:191, 0]) / np.diff(path[170:191, 1])
    assert np.abs(slope).max() < 1e-5  # contact of fifth order


def test_stephensons_and_watts_chains_are_the_two_of_six_links():
    keys = {gallery.watt_six_bar().graph.without_frame().key, gallery.stephenson_six_bar().graph.without_frame().key}
    assert keys == {chain.key for chain in gs.enumerate_chains(6)}


@pytest.mark.parametrize("sides", [(5.0, 3.0, 1.5), (4.0, 1.5, 2.0)])
def test_peaucelliers_line_is_straight_to_rounding(sides):
    long, short, crank = sides
    path = gallery.peaucellier(*sides).simulate().point("P").position
    assert np.ptp(path[:, 1]) > 0.5 * long
    assert np.abs(path[:, 0] - (long**2 - short**2) / (2 * crank)).max() < 1e-12 * long


def test_scott_russells_line_is_straight_to_rounding():
    path = gallery.scott_russell(2.0).simulate().point("P").position
    assert np.ptp(path[:, 1]) > 3.5 and np.abs(path[:, 0]).max() < 1e-12


@pytest.mark.parametrize("scale", [1.5, 2.0, 5.0])
def test_the_pantograph_enlarges(scale):
    motion = gallery.pantograph(scale).simulate()
    T, P = (motion.point(name).position for name in "TP")
    assert np.ptp(T[:, 1]) > 1.0 and np.allclose(P, scale * T, atol=1e-12)


@pytest.mark.parametrize("ratio", [1.5, 2.0, 3.0])
def test_whitworths_ratio_of_times(ratio):
    """The ram reverses twice a turn; slow and fast stroke take crank angles in the ratio wanted."""
    motion = gallery.whitworth_quick_return(ratio).simulate()
    turns = sorted(event.input for event in motion.events if event.kind == "dead centre" and 5 in event.links)
    turns = sorted({round(u % math.tau, 9) for u in turns})
    assert len(turns) == 2
    part = turns[1] - turns[0]
    assert max(part, math.tau - part) / min(part, math.tau - part) == pytest.approx(ratio, rel=1e-8)


def test_the_toggle_presses_with_a_force_without_bound():
    """The ratio of speeds, 2 L sin(theta) of the toggle, vanishes where it is stretched."""
    motion = gallery.toggle_press().simulate("0..360 deg", events=False)
    ram = motion.mechanism.graph.links - 1
    lean = motion.point("R").position[:, 1] / -2.0
    sine = np.sqrt(1.0 - np.minimum(lean, 1.0) ** 2)
    expected = 2.0 * sine * np.abs(motion.velocities[:, 3, 2])
    assert np.allclose(1.0 / np.abs(motion.mechanical_advantage(ram)), expected, atol=1e-7)
    assert np.abs(motion.mechanical_advantage(ram)).max() > 100.0


def test_klanns_foot_is_level_for_half_a_turn():
    """US patent 6260862: half the turn on the ground, the other half lifted over obstacles."""
    foot = gallery.klann().simulate("0..360 deg").point("P").position[:-1]
    stride, height = np.ptp(foot, axis=0)
    low = foot[:, 1] < foot[:, 1].min() + 0.05 * stride
    assert 0.45 < low.mean() < 0.55 and np.ptp(foot[low, 0]) > 0.99 * stride and height > 0.4 * stride


def test_jansens_foot_is_level_for_more_than_half_a_turn():
    foot = gallery.jansen().simulate("0..360 deg").point("P").position[:-1]
    stride, height = np.ptp(foot, axis=0)
    low = foot[:, 1] < foot[:, 1].min() + 0.03 * stride
    assert 0.5 < low.mean() < 0.6 and np.ptp(foot[low, 0]) > 0.95 * stride and 0.3 * stride < height < 0.4 * stride


def test_the_cylinders_of_the_excavator_move_what_lies_behind_them():
    arm = gallery.excavator_arm()
    motion = arm.simulate(np.linspace(0.0, 0.1, 11))
    assert motion.completed
    for driver in arm.drivers:
        (a, p), (b, q) = (
            next(
                (motion.point(link, joint.at_a if joint.a == link else joint.at_b).position, joint)
                for joint in arm.joints
                if link in joint.pair and joint.kind == "R"
            )
            for link in (driver.base, driver.link)
        )
        length = np.hypot(*(b - a).T)
        assert np.allclose(length - length[0], motion.inputs, atol=1e-12), (p, q)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gallery.peaucellier(5, 2, 1.5),
        lambda: gallery.pantograph(1.0),
        lambda: gallery.whitworth_quick_return(math.nan),
    ],
)
def test_proportions_that_do_not_fit(make):
    with pytest.raises(GeometryError):
        make()
