"""Numbers on the page of errata, computed anew from formulas, without the library where that is possible.

Not here: events and chatter of the tribometer (tests/systems/tribometer), the settling time of the braider, the
count of starts from which the printed antenna equations are solved, the error floors of MuJoCo (they need it), and
the jam of three equal bearings at every input (tests/jamming/joints).  The interval shoelace sum and the counts are
the library's own; the counts have a second producer in catalog/counts.
"""

import math
from itertools import product
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq

PAGE = (Path(__file__).parents[1] / "docs" / "explanation" / "errata.md").read_text("utf-8")
# critical tilt of the deck's bearing, theory/bearing-contact 7
T_A = 2 * math.atan(0.03 / (5 + math.sqrt(5**2 - 0.03 * (35 + 0.03))))
TILT = math.asin(0.4 * math.sin(1 / 30))  # largest tilt of the coupler, theory/four-bar-and-tilt 8
R, RH, HALF = 17.5, 17.53, 5.0


def printed(*texts):
    """The page shows these words, so that a number cannot be changed there alone."""
    for text in texts:
        assert text in PAGE, text


def test_worked_example():
    """Figure 3 has 22 edges and 25 sub-edges; five, and twenty-eight, ways to share out its joints."""
    printed("22 edges, 25 sub-edges (19 joints of mobility 1, 3 of mobility 2)", "five solutions", "28 without")
    legs = [(0, 1), (0, 2), (0, 3), (0, 4)]
    for k in range(3):
        legs += [(2 + k, 5 + k), (5 + k, 8 + k), (0, 8 + k), (8 + k, 11 + k), (11 + k, 14)]
    gears = [(1, 2), (1, 3), (1, 4)]
    assert (len(legs), len(gears), len(legs) + 2 * len(gears)) == (19, 3, 25)
    loops, frame = 22 - 14, sum(0 in edge for edge in legs)
    assert (loops, frame, 25 - 3 * loops) == (8, 7, 1)
    # n links with a joints each, 14 in all, 2 p = t0 + sum a n_a: partitions of 44 - 7 - 2*14 = 9 into a - 2 = 1..7
    partitions = [
        m for m in product(*(range(9 // k + 1) for k in range(1, 8))) if sum(k * m[k - 1] for k in range(1, 8)) == 9
    ]
    assert len(partitions) == 28
    assert sorted((14 - sum(m), m[0], m[1]) for m in partitions if not any(m[2:])) == [
        (5, 9, 0), (6, 7, 1), (7, 5, 2), (8, 3, 3), (9, 1, 4),
    ]  # fmt: skip


def test_second_harmonic_of_a_leg():
    """The rocker of a right-angle home, moved by a small crank: second harmonic over the first."""
    printed("`l_B / (4 l_BC)`")
    O, D, coupler, rocker = 45.0, 105 + 45j, 45.0, 60.0  # the mock-up; home: B = O + l_B at 90 degrees to the rocker

    def angle(psi, crank):
        d = O + crank * np.exp(1j * psi) - D
        x = (abs(d) ** 2 + rocker**2 - coupler**2) / (2 * abs(d))
        return np.unwrap(np.angle(d / abs(d) * (x - 1j * np.sqrt(rocker**2 - x * x))))

    psi = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    for crank in (0.02, 0.01):
        waves = np.abs(np.fft.rfft(angle(psi, crank)))
        assert waves[2] / waves[1] == pytest.approx(crank / (4 * coupler), rel=2e-3)


def test_share_of_energy_off_the_direction():
    """Equal global crank angles: the best first-order approximation to a translation; home Jacobian.

    See theory/values-of-the-platform 5.
    """
    printed("17.6 %")
    jacobian = np.array([
        [-7.1253866082107153671847253656753, -21.674613391789284632815274634325, 28.8],
        [29.141531628991833026795227317685, -20.741531628991833026795227317685, -8.4],
        [-25 / 72] * 3,
    ])  # fmt: skip
    jacobian[2] *= 45  # the characteristic length of the platform
    gains = jacobian * np.exp(-2j * np.pi / 3 * np.arange(3))
    whole = (gains.conj().T @ gains).real
    for direction in np.linspace(0, np.pi, 7):
        along = np.array([math.cos(direction), math.sin(direction), 0]) @ gains
        best = np.linalg.eigvals(np.linalg.solve(whole, np.outer(along.conj(), along).real)).real.max()
        assert 1 - best == pytest.approx(0.17585818795723, abs=1e-9)


def test_tilted_linkage():
    printed("2.500222", "1.9099 degrees", "0.01213 rad, not 0.01516", "0.0003701532130066807")
    assert math.hypot(2.5, math.sin(1 / 30)) == pytest.approx(2.500222130061535, abs=1e-14)
    assert round(math.degrees(1 / 30), 4) == 1.9099
    assert round(math.asin(math.sin(T_A) / 0.4), 5) == 0.01516
    # tilt alpha/2 at every one of three equal bearings, theory/joints-that-share-a-tilt 6
    assert round(2 * T_A, 5) == 0.01213
    with mp.workdps(40):
        n, c, s = mp.matrix([2, -1, 2]) / 3, mp.cos(mp.mpf(1) / 30), mp.sin(mp.mpf(1) / 30)
        skew = mp.matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        right = c * mp.eye(3) + (1 - c) * n * n.T - s * skew
        assert mp.mnorm(right.T * right - mp.eye(3), "inf") < 1e-35
        right[1, 2] = n[0] * n[2] * (1 - c) + n[0] * s
        wrong = right.T * right - mp.eye(3)
        assert max(abs(x) for x in wrong) == pytest.approx(0.0003701532130066807, rel=1e-14)


def test_areas_of_the_deck():
    """Ellipse without the circle at the onset and at the worst pose; half of the latter is one crescent."""
    printed("*falls* from 1.6493 to 0.9750 mm²", "an area of 0.4875 mm²")

    def gap(t):
        a, b = RH, RH * math.cos(t) - HALF * math.sin(t)
        angles = (np.arange(2_000_000) + 0.5) * (2 * math.pi / 2_000_000)
        radius2 = 1 / ((np.cos(angles) / a) ** 2 + (np.sin(angles) / b) ** 2)
        return np.maximum(radius2 - R * R, 0).mean() * math.pi, b

    onset = brentq(lambda t: gap_width(t), 1e-3, 1e-2, xtol=1e-15)
    assert gap(onset)[0] == pytest.approx(1.6493, abs=5e-5)
    worst, b = gap(TILT)
    assert (worst, worst / 2) == (pytest.approx(0.9750, abs=5e-5), pytest.approx(0.4875, abs=5e-5))
    assert b < R  # it jams there, and the free gap is smaller all the same


def gap_width(t):
    """Half width of the surrogate ellipse less the radius of the shaft."""
    return RH * math.cos(t) - HALF * math.sin(t) - R


def test_interval_shoelace():
    printed("`[-443, 444]`")
    from graphsynth.jamming.intersection.readings import crescent_boxes, interval_shoelace

    b = RH * math.cos(TILT) - HALF * math.sin(TILT)
    for count in (60, 1000):
        found = interval_shoelace(crescent_boxes(R, RH, b, count))
        assert (round(float(found.lo)), round(float(found.hi))) == (-443, 444)


def test_worst_inputs_of_the_lambda_linkage():
    """The rocker is upright where A lies at 2.5 from (2, 2.5)."""
    printed("12.68 degrees", "two zones, half a turn apart")

    def miss(f):
        return math.hypot(2 - math.cos(f), 2.5 - math.sin(f)) - 2.5

    assert math.degrees(brentq(miss, 0, 1)) == pytest.approx(12.68, abs=5e-3)
    assert miss(math.pi / 2) == 0


def rotation(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def shift(axis, length):
    matrix = np.eye(4)
    matrix["xyz".index(axis), 3] = length
    return matrix


def antenna_equations(x, leg_y):
    """Twelve residuals at rest, theory/antenna 3; ``leg_y`` names the axes of x4 and x3."""
    l1, l2, l3 = 0.1, 0.15, 0.0592
    first = rotation("y", x[4]) @ shift("y", l3) @ rotation(leg_y[0], x[3]) @ rotation(leg_y[1], x[2])
    first = first @ shift("z", l2) @ rotation("y", x[1]) @ rotation("x", x[0])
    first = first @ rotation("z", math.pi / 2) @ shift("x", -l1)
    other = rotation("x", x[10]) @ shift("x", l3) @ rotation("z", x[9]) @ rotation("y", x[8])
    other = other @ shift("z", l2) @ rotation("x", x[7]) @ rotation("y", x[6]) @ shift("x", -l1)
    gimbal = rotation("x", -x[5]) @ rotation("y", -x[11])
    dy, dx = gimbal @ first @ rotation("z", -math.pi / 2), gimbal @ other
    places = [(first[:3, 3] - [0, l3 - l1, l2]) / l1, (other[:3, 3] - [l3 - l1, 0, l2]) / l1]
    return np.concatenate([*places, dy[:2, 2], dx[:2, 2], [dy[1, 0], dx[1, 0]]])


def test_printed_antenna_equations_are_singular_at_rest():
    printed("rank 11 of 12")
    for axes, rank in (("xy", 11), ("zx", 12)):
        assert abs(antenna_equations(np.zeros(12), axes)).max() < 1e-15
        h = 1e-6
        columns = [(antenna_equations(h * e, axes) - antenna_equations(-h * e, axes)) / (2 * h) for e in np.eye(12)]
        assert np.linalg.matrix_rank(np.array(columns).T, tol=1e-6) == rank


def test_two_nestings_of_the_gimbal():
    """Mean of both angles, order Y-X against X-Y, for equal cranks; both distances solved by bisection."""
    printed("30.99′ at 40 degrees", "the difference is 0.66′")
    l1, l2, l3 = 0.1, 0.15, 0.0592

    def angles(phi, order):
        sy = np.array([0, l1 - l3 + l3 * math.cos(phi), -l2 + l3 * math.sin(phi)])
        sx = np.array([l1 - l3 + l3 * math.cos(phi), 0, -l2 - l3 * math.sin(phi)])

        def turned(a, b):
            x, y = rotation("x", a)[:3, :3], rotation("y", b)[:3, :3]
            return y @ x if order == "YX" else x @ y

        def leg_y(a, b):
            return np.linalg.norm(turned(a, b)[:, 1] * l1 - sy) - l2

        def leg_x(a, b):
            return np.linalg.norm(turned(a, b)[:, 0] * l1 - sx) - l2

        if order == "YX":
            b = brentq(lambda b: leg_x(0.0, b), -0.2, 0.8, xtol=1e-15)
            return brentq(lambda a: leg_y(a, b), -0.2, 0.8, xtol=1e-15), b
        a = brentq(lambda a: leg_y(a, 0.0), -0.2, 0.8, xtol=1e-15)
        return a, brentq(lambda b: leg_x(a, b), -0.2, 0.8, xtol=1e-15)

    for degrees, minutes in ((15, 0.656), (40, 30.990)):
        phi = math.radians(degrees)
        difference = (sum(angles(phi, "XY")) - sum(angles(phi, "YX"))) / 2
        assert math.degrees(difference) * 60 == pytest.approx(minutes, abs=1e-3)


@pytest.mark.slow
def test_published_counts():
    """By the enumerator, the second producer beside `geng` and a test of every set of links (catalog/counts)."""
    printed("| 5438 |", "29685 and 2422")
    from graphsynth import count_assur_groups, count_chains

    counts = (Path(__file__).parents[1] / "catalog" / "counts" / "published.toml").read_text("utf-8")
    assert "with_fractionated = 29685" in counts and "with_fractionated = 2422" in counts
    assert count_assur_groups(10) == 5438
    assert count_chains(12, 3, fractionated=True) == 2422
    assert count_chains(13, 2, fractionated=True) == 29685


def test_corrected_values_of_the_specification():
    printed("1.2938877976189777", "`m g * 0.02 m` = 0.15696 J", "400 V at the start")
    with mp.workdps(30):  # u = L |cos q| w, with w and u as stated in 14.9
        speed, u = mp.mpf("84.599656034566326135399057382692"), mp.mpf("1.1564064790191468307292970615872")
        assert float(mp.acos(u / (mp.mpf("0.05") * speed))) == pytest.approx(1.2938877976189777, abs=2e-16)
    assert math.isclose(0.8 * 9.81 * 0.02, 0.15696)  # the slider of G3, 2 cm above the crank's pivot
    assert math.isclose(20 * 20, 400)  # K w_d


def test_least_inertia_of_the_linear_design():
    """Platform of the mock-up by Newton's method, velocities by implicit differentiation, a fine search (mm)."""
    printed("3.6e-6 mm²")
    from scipy.optimize import minimize_scalar

    cranks = np.array(
        [2.10617329135206267553490883987, 5.29647666822047661716481396937, 3.19030337686841394162990512951]
    )
    phases = np.radians([-166.260204708311957406289, 133.739795291688042593711, 73.7397952916880425937112])
    legs = np.exp(1j * np.array([-5 * math.pi / 6, -math.pi / 6, math.pi / 2]))
    O, D, F, coupler, rocker, arm, link = 45.0, 105 + 45j, 45 + 0j, 45.0, 60.0, 45.0, 60.0

    def elbows(psi):  # ends of the rocker arms, each in the frame of its leg
        d = O + cranks * np.exp(1j * (psi + phases - np.angle(legs))) - D
        x = (abs(d) ** 2 + rocker**2 - coupler**2) / (2 * abs(d))
        direction = d / abs(d) * (x + 1j * np.sqrt(rocker**2 - x * x)) / rocker
        return D - 1j * arm * direction  # the bell crank has a right angle

    def miss(pose, psi):
        places = (pose[0] + 1j * pose[1] + np.exp(1j * pose[2]) * F * legs) / legs
        return abs(places - elbows(psi)) - link

    def by_differences(function, at, h=1e-4):
        return (8 * (function(at + h) - function(at - h)) - (function(at + 2 * h) - function(at - 2 * h))) / (12 * h)

    def slopes(pose, psi):
        return np.array(
            [by_differences(lambda x, k=k: miss(np.where(np.arange(3) == k, x, pose), psi), pose[k]) for k in range(3)]
        ).T

    def inertia(psi):
        pose = np.zeros(3)
        for _ in range(12):
            pose = pose - np.linalg.solve(slopes(pose, psi), miss(pose, psi))
        assert abs(miss(pose, psi)).max() < 1e-12
        rate = np.linalg.solve(slopes(pose, psi), -by_differences(lambda x: miss(pose, x), psi))
        return rate[0] ** 2 + rate[1] ** 2 + (20 * rate[2]) ** 2

    grid = np.linspace(0, 2 * math.pi, 73)
    values = [inertia(psi) for psi in grid]
    assert max(values) == pytest.approx(16.102, abs=0.05)  # the table of 11.2 has 16.102
    step = grid[1]
    lows = [grid[k] for k in range(1, 72) if values[k] < min(values[k - 1], values[k + 1])]
    found = [
        minimize_scalar(inertia, bounds=(x - step, x + step), method="bounded", options={"xatol": 1e-9}).fun
        for x in lows
    ]
    assert min(found) == pytest.approx(3.6e-6, abs=1e-7)


@pytest.mark.slow
def test_ripples_of_the_drive():
    """Steady peaks between samples: the interpolant of DOP853, searched finely around each."""
    printed("20.484 and 3.446", "from 20.55 to 20.61 A")
    from scipy.integrate import solve_ivp

    def peaks(resistance, inductance):
        def rhs(_t, y):
            q, w, i = y
            inertia = 0.002 + 0.005 * math.cos(q) ** 2
            voltage = 20 * (20 - w) - resistance * i - 0.1 * w
            return [w, (0.1 * i + 0.0025 * math.sin(2 * q) * w * w) / inertia, voltage / inductance]

        end = 40 * math.tau / (400 / 20.1)
        run = solve_ivp(rhs, (0, end), [0, 0, 0], "DOP853", dense_output=True, rtol=1e-9, atol=1e-9)
        return np.ptp(run.sol(np.linspace(end / 2, end, 400_001))[1:], axis=1)

    assert [round(float(peaks(0.5, inductance)[0]), 3) for inductance in (0.2, 0.05)] == [20.484, 3.446]
    assert [round(float(peaks(resistance, 0.01)[1]), 2) for resistance in (0.5, 1.0)] == [20.55, 20.61]
