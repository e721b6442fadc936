"""Poles, polodes, circles, mechanical advantage: against closed forms of textbooks and against mpmath."""

import math
from functools import partial

import mpmath
import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError

mpmath.mp.dps = 40


@pytest.fixture(scope="module")
def rocker():
    return gs.Mechanism.four_bar(4, 1, 3.5, 3, coupler_point=(1.5, 1.2)).simulate(np.linspace(0.1, 2 * math.pi, 37))


def crossing(p, q, r, s):
    """Where the lines p-q and r-s meet, (n, 2) each."""
    p, q, r, s = (z[:, 0] + 1j * z[:, 1] for z in (p, q, r, s))
    t = ((r - p).conj() * (s - r)).imag / ((q - p).conj() * (s - r)).imag
    z = p + t * (q - p)
    return np.column_stack([z.real, z.imag])


def test_the_coupler_turns_about_the_crossing_of_crank_and_rocker(rocker):
    """Kennedy's theorem: poles of three links lie on one line."""
    ends = [(0, (0, 0)), (1, (1, 0)), (0, (4, 0)), (2, (3.5, 0))]
    A0, A, B0, B = (rocker.point(*end).position for end in ends)
    assert np.allclose(rocker.instant_centre(2), crossing(A0, A, B0, B), rtol=1e-9)
    # and crank against rocker about the crossing of frame and coupler
    assert np.allclose(rocker.instant_centre(3, 1)[:, 0] * 0, 0.0)
    place = rocker.instant_centre(3, 1)
    turn = np.exp(1j * rocker.poses[:, 1, 2]) * (place[:, 0] + 1j * place[:, 1])
    assert np.allclose(np.column_stack([turn.real, turn.imag]), crossing(A0, B0, A, B), rtol=1e-8)


def test_the_polodes_of_a_trammel_are_cardan_circles():
    """Elliptic trammel of length L: a circle of diameter L rolls in one of radius L."""
    L = 2.0
    places = {
        "A": (L * math.cos(0.4), 0),
        "B": (0, L * math.sin(0.4)),
        "U": (-5, 0),
        "V": (5, 0),
        "S": (0, -5),
        "T": (0, 5),
    }
    trammel = gs.Mechanism.from_points(places, ["AB"], "UVST", driver=(0, 2), slides={"A": "UV", "B": "ST"})
    motion = trammel.simulate(np.linspace(-0.8, 0.1, 31))
    fixed, moving = motion.polodes(1)
    assert np.allclose(np.hypot(*fixed.T), L, atol=1e-12)
    middle = np.add(places["A"], places["B"]) / 2
    assert np.allclose(np.hypot(*(moving - middle).T), L / 2, atol=1e-12)
    circle = motion.inflection_circle(1)  # it is the moving Cardan circle, in the fixed frame
    assert np.allclose(circle.diameter, L, atol=1e-10)
    assert np.allclose(circle.centre, motion.point(1, middle).position, atol=1e-10)


def exact_four_bar(phi):
    """Angle of the coupler and place of the crank pin at high precision."""
    l1, l2, l3, l4 = mpmath.mpf(4), mpmath.mpf(1), mpmath.mpf("3.5"), mpmath.mpf(3)
    A = l2 * mpmath.expj(phi)
    D = l1 - A
    d = abs(D)
    along = (d**2 + l3**2 - l4**2) / (2 * d)
    B = A + D / d * (along + 1j * mpmath.sqrt(l3**2 - along**2))
    return A, mpmath.arg(B - A)


def exact_point(phi, at):
    A, theta = exact_four_bar(phi)
    return A + mpmath.expj(theta) * mpmath.mpc(*at)


def test_points_of_the_inflection_circle_run_straight_and_of_bresses_have_no_tangential_acceleration(rocker):
    """Derivatives by finite differences of the closed form, 40 digits."""
    for k in (3, 11, 25):
        for circle, normal in ((rocker.inflection_circle(2), True), (rocker.bresse_circle(2), False)):
            for turn in (0.7, 2.9):
                z = complex(*circle.centre[k]) + circle.diameter[k] / 2 * np.exp(1j * turn)
                x, y, theta = rocker.poses[k, 2]
                place = (z - complex(x, y)) * np.exp(-1j * theta)
                path = partial(exact_point, at=(place.real, place.imag))
                v, a = (mpmath.diff(path, mpmath.mpf(rocker.inputs[k]), order) for order in (1, 2))
                product = mpmath.conj(v) * a
                assert abs(product.imag if normal else product.real) < 1e-9 * abs(v) * max(abs(a), abs(v))


def test_both_circles_of_bresse_meet_in_the_acceleration_pole(rocker):
    first, second = rocker.inflection_circle(2), rocker.bresse_circle(2)
    pole, c1, c2 = (z[:, 0] + 1j * z[:, 1] for z in (first.pole, first.centre, second.centre))
    other = c1 + (pole - c1).conj() * ((c2 - c1) / np.conj(c2 - c1))  # the pole mirrored at the line of centres
    pose, v, w = (array[:, 2] for array in (rocker.poses, rocker.velocities, rocker.accelerations))
    still = w[:, 0] + 1j * w[:, 1] + (1j * w[:, 2] - v[:, 2] ** 2) * (other - pose[:, 0] - 1j * pose[:, 1])
    assert np.abs(still).max() < 1e-11 * max(1.0, np.abs(other).max())


def test_mechanical_advantage_of_the_four_bar(rocker):
    """The ratio of the distances of the poles (Freudenstein), and sin mu / sin nu."""
    advantage = rocker.mechanical_advantage(3)
    place = rocker.instant_centre(3, 1)
    x = ((place[:, 0] + 1j * place[:, 1]) * np.exp(1j * rocker.poses[:, 1, 2])).real
    assert np.allclose(advantage, (x - 4.0) / x, rtol=1e-9)
    crank, coupler, out = (rocker.poses[:, k, 2] for k in (1, 2, 3))
    assert np.allclose(advantage, 3 * np.sin(coupler - out) / (1 * np.sin(coupler - crank)), rtol=1e-9)
    assert np.allclose(rocker.transmission_index()[0], np.abs(np.sin(coupler - out)), atol=1e-12)


def test_mechanical_advantage_of_the_slider_crank():
    motion = gs.Mechanism.slider_crank(1, 3).simulate(np.linspace(0.2, 2.9, 28))
    phi = motion.inputs
    beta = np.arcsin(np.sin(phi) / 3)
    assert np.allclose(motion.mechanical_advantage(3), -np.cos(beta) / np.sin(phi + beta), rtol=1e-10)


def test_static_forces_do_the_work_of_the_load(rocker):
    """Virtual work: the torque is minus the force times the velocity of its point; the joints balance each link."""
    forces = rocker.forces({"P": (3.0, -7.0)})
    speed = rocker.point("P").velocity
    assert np.allclose(forces.efforts[:, 0], -(speed @ (3.0, -7.0)), atol=1e-11)
    assert np.allclose(forces.between(1, 2) + forces.between(3, 2) + (3.0, -7.0), 0.0, atol=1e-11)
    along = forces.between(2, 3)  # the rocker is a two-force member
    out = rocker.poses[:, 3, 2]
    assert np.allclose(along[:, 0] * np.sin(out), along[:, 1] * np.cos(out), atol=1e-11)
    assert len(repr(forces).splitlines()) <= 10
    torque = rocker.forces({3: 2.0})
    assert np.allclose(torque.efforts[:, 0], -2.0 / rocker.mechanical_advantage(3), atol=1e-11)
    with pytest.raises(GeometryError, match="point 'Q' of a load is not defined; the mechanism has P"):
        rocker.forces({"Q": (0, 1)})


def test_links_that_are_none(rocker):
    with pytest.raises(GeometryError, match=r"give two of the links 0\.\.3"):
        rocker.instant_centre(2, 2)
    with pytest.raises(GeometryError):
        rocker.polodes(9)
