"""Independent answers: the body form as a linear program with polygons for circles, and the single-loop search."""

import math
from functools import cache
from itertools import islice

import mpmath
import numpy as np
from scipy.optimize import linprog

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, enumerate_chains
from graphsynth.jamming.joints.closure import PITCH, ROLL
from graphsynth.jamming.joints.enclosure import lower_bounds, upper_bounds
from graphsynth.kinematics.dimensional import embody

SIDES = 96


def factor_bounds(layout, at, found):
    return lower_bounds(layout, at, found), upper_bounds(layout, at, found)


def four_bar(ground=2.0, crank=1.0, coupler=2.5, rocker=2.5, scale=1.0):
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (scale * crank, 0.0)),
        Revolute(2, 3, (scale * coupler, 0.0), (scale * rocker, 0.0)), Revolute(0, 3, (scale * ground, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


@cache
def embodied(links, number):
    """Return an enumerated chain with dimensions that let it turn."""
    chain = next(islice(enumerate_chains(links), number, None))
    found = embody(chain, seed=0)
    assert found.accepted
    return found.mechanism


def driven_pair(mechanism):
    driver = mechanism.drivers[0]
    return (driver.base, driver.link) if driver.base == mechanism.frame else (driver.link, driver.base)


def world(poses, link, at):
    x, y, theta = poses[link]
    c, s = math.cos(theta), math.sin(theta)
    return np.array([x + c * at[0] - s * at[1], y + s * at[0] + c * at[1]])


def polygon_bounds(mechanism, poses, tilt, play, driven, a, hold_play=True):
    """Bounds of T* of one pose from unknowns (omega_x, omega_y, w) of every body.

    ``tilt`` and ``play`` by pair; ``driven`` = (base, link) follows the tilt a without clearance.
    A polygon around the circle gives a lower bound; its size over cos(pi / sides) an upper one.
    """
    links = mechanism.graph.links
    unknowns = 3 * links + 1
    rows, right, equal, equal_right = [], [], [], []

    def slip(link, r):
        row = np.zeros(unknowns)
        row[3 * link : 3 * link + 3] = r[1], -r[0], 1.0
        return row

    for k in range(3):  # the frame
        row = np.zeros(unknowns)
        row[3 * mechanism.frame + k] = 1.0
        equal.append(row)
        equal_right.append(0.0)
    for joint in mechanism.joints:
        r = world(poses, joint.a, joint.at_a)
        d = np.zeros(2)
        limit, s = tilt[joint.pair], play[joint.pair]
        if joint.pair == (min(driven), max(driven)):
            d = np.array(a) if joint.a == driven[0] else -np.array(a)
            limit = s = 0.0
        if math.isfinite(limit):
            for side in range(SIDES):
                n = np.array([math.cos(math.tau * side / SIDES), math.sin(math.tau * side / SIDES)])
                row = np.zeros(unknowns)
                row[3 * joint.b : 3 * joint.b + 2], row[3 * joint.a : 3 * joint.a + 2] = n, -n
                if limit == 0.0:
                    if side in (0, SIDES // 4):
                        equal.append(row)
                        equal_right.append(n @ d)
                    continue
                row[-1] = -limit
                rows.append(row)
                right.append(n @ d)
        if math.isfinite(s):
            row = slip(joint.b, r) - slip(joint.a, r)
            if s == 0.0:
                equal.append(row)
                equal_right.append(0.0)
            for sign in (1.0, -1.0) if s > 0.0 else ():
                own = sign * row
                if not hold_play:
                    own[-1] = -s
                rows.append(own)
                right.append(s if hold_play else 0.0)
    cost = np.zeros(unknowns)
    cost[-1] = 1.0
    bounds = [(None, None)] * (unknowns - 1) + [(0.0, None)]
    found = linprog(cost, np.array(rows), right, np.array(equal), equal_right, bounds, method="highs")
    if found.status == 2:
        return math.inf, math.inf
    assert found.status == 0, found.message
    return found.fun, found.fun / math.cos(math.pi / SIDES)


def single_loop(points, limits, a, origin, slip, digits=30):
    """T* of one loop from 9.4: sup over p of (|cross(a, p - r_O)| - s) / sum t |p - r_j|, to many digits.

    On the line at height h over the line through O along a, the best p has the least sum of distances (convex in one
    number); over h the quotient is quasi-concave on each side.  Joints and infinity are tried too.
    """
    with mpmath.workdps(digits):
        size = mpmath.hypot(*map(mpmath.mpf, a))
        u = [mpmath.mpf(v) / size for v in a]
        local = []
        for x, y in points:
            dx, dy = mpmath.mpf(x) - origin[0], mpmath.mpf(y) - origin[1]
            local.append((u[0] * dx + u[1] * dy, u[0] * dy - u[1] * dx))
        t = [mpmath.mpf(v) for v in limits]

        def cost(x, h):
            return sum(k * mpmath.hypot(x - px, h - py) for k, (px, py) in zip(t, local))

        def narrowest(f, low, high):
            ratio = (mpmath.sqrt(5) - 1) / 2
            x1, x2 = high - ratio * (high - low), low + ratio * (high - low)
            f1, f2 = f(x1), f(x2)
            for _ in range(int(2.6 * digits)):
                if f1 < f2:
                    high, x2, f2 = x2, x1, f1
                    x1 = high - ratio * (high - low)
                    f1 = f(x1)
                else:
                    low, x1, f1 = x1, x2, f2
                    x2 = low + ratio * (high - low)
                    f2 = f(x2)
            return min(f1, f2)

        left, right = min(p[0] for p in local) - 1, max(p[0] for p in local) + 1
        reach = 1 + max(abs(p[1]) for p in local)
        best = size / sum(t)
        for px, py in local:
            value = cost(px, py)
            if value > 0:
                best = max(best, (size * abs(py) - slip) / value)
        for sign in (1, -1):
            # h = sign / g with g in (0, inf) covers the half plane up to infinity
            def quotient(g, sign=sign):
                h = sign / g
                return -(size / g - slip) / narrowest(lambda x: cost(x, h), left, right)

            best = max(best, -narrowest(quotient, mpmath.mpf("1e-6") / reach, 1000 / reach))
        return best


def body_rows(given, r, e):
    """Body form: tilts of the blocks (N, blocks, 2, 3 bodies) and slips (N, joints, 3 bodies) by ``(omega, w)``."""
    layout, bodies, frame, count = given.layout, given.mechanism.graph.links, given.mechanism.frame, len(r)
    slip = np.zeros((count, len(layout.joints), bodies, 3))
    tilt = np.zeros((count, len(layout.joints), 2, bodies, 3))
    for place, (a, b) in enumerate(layout.pairs.tolist()):
        for body, sign in ((a, -1.0), (b, 1.0)):
            if body == frame:
                continue
            tilt[:, place, 0, body, 0] = tilt[:, place, 1, body, 1] = sign
            slip[:, place, body, 0], slip[:, place, body, 1] = sign * r[:, place, 1], -sign * r[:, place, 0]
            slip[:, place, body, 2] = sign
    at = layout.block_joint
    flat = tilt.reshape(count, len(layout.joints), 2, -1)[:, at]
    lean = e[:, at]
    along = lean[:, :, 0, None] * flat[:, :, 0] + lean[:, :, 1, None] * flat[:, :, 1]
    across = -lean[:, :, 1, None] * flat[:, :, 0] + lean[:, :, 0, None] * flat[:, :, 1]
    for kind, value in ((ROLL, along), (PITCH, across)):
        mask = layout.block_axis == kind
        flat[:, mask, 0], flat[:, mask, 1] = value[:, mask], 0.0
    return flat, slip.reshape(count, len(layout.joints), -1)
