"""Contacts with clearance: shifts of pins, loads in the plane, friction of the contacts of one bearing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import graphsynth as gs
from graphsynth.jamming import Bearing, ToleranceBox
from graphsynth.jamming.bearing.friction import wedging
from graphsynth.jamming.binding import ContactFriction, JointStiffness, LinkSection
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits
from graphsynth.mechanism.joints import Prismatic

Array = NDArray[np.float64]


def shifted(mechanism: gs.Mechanism, ways: Array) -> gs.Mechanism:
    """The mechanism with every pin shifted in its hole."""
    joints = tuple(
        joint if isinstance(joint, Prismatic) else replace(joint, at_b=(joint.at_b[0] + x, joint.at_b[1] + y))
        for joint, (x, y) in zip(mechanism.joints, ways)
    )
    return replace(mechanism, joints=joints)


@pytest.mark.parametrize("name", ["press", "four-bar", "six-bar"])
def test_shifts_of_pins_change_the_energy_by_the_clearance_over_the_length(name: str) -> None:
    """Linear in the shifts, so second order with the tilt; a few times c / l of the energy."""
    mechanism, length = {
        "press": (gs.Mechanism.slider_crank(0.04, 0.08), 0.04),
        "four-bar": (gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25), 0.1),
        "six-bar": (gs.gallery.watt_six_bar(), 1.0),
    }[name]
    inputs = np.array([0.3, 0.9, 2.2, 4.0])
    bar = LinkSection.rectangular(2.1e11, 0.03, 0.012)
    given: Any = {"tilt": 0.01, "joints": 0.001, "stiffness": 4e4, "links": bar}
    base = mechanism.simulate(inputs).binding(**given).energy
    assert (base > 0.0).all()
    random = np.random.default_rng(3)
    for _ in range(6):
        way = random.normal(size=(len(mechanism.joints), 2))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        c = 1e-3 * length
        once, half = (
            shifted(mechanism, size * way).simulate(inputs).binding(**given).energy / base - 1.0
            for size in (c, 0.5 * c)
        )
        assert np.abs(once).max() < 20.0 * c / length
        np.testing.assert_allclose(once, 2.0 * half, atol=100.0 * (c / length) ** 2)


class Ends:
    """A pin and its hole at both ends: energy by shift and tilt (the way of the upper end), plane vectors."""

    def __init__(self, stiffness: float, clearance: float) -> None:
        self.k, self.c = stiffness, clearance

    def energy(self, shift: Array, end: Array) -> Array:
        over = [np.maximum(np.hypot(*np.moveaxis(shift + sign * end, -1, 0)) - self.c, 0.0) for sign in (1.0, -1.0)]
        return np.asarray(0.5 * self.k * (over[0] ** 2 + over[1] ** 2))

    def least(self, end: Array, load: Array) -> float:
        """Least energy less the work of a load, by a grid that gets finer."""
        middle, size, best = np.zeros(2), 2.0 * self.c + float(np.hypot(*load)) / self.k + float(np.hypot(*end)), 0.0
        for _ in range(40):
            x, y = np.meshgrid(*[np.linspace(-size, size, 21)] * 2, indexing="ij")
            tried = middle + np.stack([x, y], -1)
            values = self.energy(tried, end) - tried @ load
            at = np.unravel_index(int(values.argmin()), values.shape)
            middle, best, size = tried[at], float(values[at]), 0.6 * size
        return best


def test_the_spring_of_a_bearing_is_its_contacts_with_the_pin_in_the_middle() -> None:
    """Of all shifts none lowers the energy: ``k (|tau| - t)^2 / 2`` is that of both ends."""
    k, c, height = 2e6, 1e-4, 0.03
    ends, spring = Ends(k, c), JointStiffness.of_contacts(k, height)
    for tau in (0.004, 2.0 * c / height, 0.01, 0.03):
        own = 0.5 * spring.tilt * max(tau - 2.0 * c / height, 0.0) ** 2
        assert ends.least(np.array([0.5 * height * tau, 0.0]), np.zeros(2)) == pytest.approx(own, rel=1e-9, abs=1e-12)


def test_loads_in_the_plane_change_the_energy_by_their_clearance_at_most() -> None:
    """Between ``phi - P c - P^2 / 4 k`` and phi, in every direction; both ends are reached."""
    random = np.random.default_rng(8)
    ends = Ends(2e6, 1e-4)
    nearest = math.inf
    for _ in range(60):
        end = random.normal(size=2) * random.choice([0.3, 1.0, 3.0]) * ends.c
        load = random.normal(size=2) * 10.0 ** random.uniform(-1.0, 3.0)
        size = float(np.hypot(*load))
        alone, found = float(ends.energy(np.zeros(2), end)), ends.least(end, load)
        most = size * ends.c + size**2 / (4.0 * ends.k)
        assert alone - most * (1.0 + 1e-9) <= found <= alone + 1e-15
        nearest = min(nearest, (found - alone + most) / most)
    assert nearest < 0.3
    along = np.array([0.0, 50.0])
    assert ends.least(np.zeros(2), along) == pytest.approx(-50.0 * ends.c - 50.0**2 / (4.0 * ends.k), rel=1e-6)


@pytest.mark.parametrize(("radius", "height", "clearance"), [(15.0, 40.0, 0.05), (17.5, 10.0, 0.03)])
def test_friction_of_one_bearing_with_two_contacts(radius: float, height: float, clearance: float) -> None:
    """The friction torque of a tilted bearing by its two contacts is a little larger, as the theory page says."""
    motion = gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25).simulate(np.linspace(0.0, math.tau, 31))
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(0.0), (0, 3): RIGID}
    own = ContactFriction(0.1, 1e-3 * radius, 1e-3 * height)
    report = motion.binding(tilt=0.03, joints=joints, stiffness={(2, 3): 700.0}, friction={(2, 3): own})
    at = report.joints.index((2, 3))
    moment, force = report.moment[:, at], report.force[:, at]
    turn = np.abs(motion.velocities[:, 3, 2] - motion.velocities[:, 2, 2])
    box = ToleranceBox(Rb=str(radius), Hb=str(height), clearance=str(clearance))
    amplification = wedging(box, "0.1").amplification
    two = 0.5 * (amplification.lo + amplification.hi) * moment * turn
    mine = report.friction_torque - 0.1 * force * own.radius * turn
    h = 0.5 * height
    factor = (1.0 + clearance / radius) / math.sqrt(1.0 - clearance * (2.0 * radius + clearance) / h**2)
    assert 1.0 < factor < 1.03
    np.testing.assert_allclose(two, factor * mine, rtol=1e-9, atol=1e-15)


def test_the_ends_of_a_bearing_are_the_least_friction_of_a_moment() -> None:
    """Random pressures with the same moment press more, a linear one half as much again; loads share the ends."""
    random, height, moment = np.random.default_rng(2), 0.04, 3.0
    s = (np.arange(2000) + 0.5) / 2000 * height - 0.5 * height
    linear = s * moment / (s**2).sum()
    assert np.abs(linear).sum() == pytest.approx(3.0 * moment / height, rel=1e-3)
    for _ in range(50):
        pressure = random.normal(size=len(s)) * (random.uniform(size=len(s)) < 0.01)
        pressure *= moment / (pressure @ s)
        assert np.abs(pressure).sum() >= 2.0 * moment / height
        load, q = random.normal(size=(2, 2))
        both = np.hypot(*(0.5 * load + q)) + np.hypot(*(0.5 * load - q))
        sizes = np.hypot(*load), 2.0 * np.hypot(*q)
        assert max(sizes) - 1e-12 <= both <= sum(sizes) + 1e-12


def test_two_bearings_of_a_link_at_one_place() -> None:
    """A slider whose pin is at its guide bends as little as a rigid one; it used to fail by dividing by its length."""
    motion = gs.Mechanism.slider_crank(0.04, 0.08).simulate(np.linspace(0.0, math.tau, 13))
    bar = LinkSection.rectangular(2.1e11, 0.03, 0.012)
    given: Any = {"tilt": 0.01, "joints": Bearing(15.0, 40.0, 0.05).critical_tilt("A").angle, "stiffness": 4e4}
    whole, named = motion.binding(**given, links=bar), motion.binding(**given, links={1: bar, 2: bar})
    assert np.isfinite(whole.energy).all()
    np.testing.assert_allclose(whole.energy, named.energy, rtol=1e-12)
    np.testing.assert_allclose(whole.elastic_torque, named.elastic_torque, rtol=1e-9, atol=1e-12)
