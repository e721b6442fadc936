"""Random mechanisms, and answers that share no code with the proofs: links placed by rotation matrices, 50 digits."""

import mpmath
from coupled_oracles import embodied, four_bar

from graphsynth import simulate
from graphsynth.jamming.joints import JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem

CHAINS = {6: 2, 8: 8}


def case(rng, links, largest=0.3):
    """A mechanism at one pose, its motor axis tilted, limits by pair and the first-order factor on them."""
    while True:
        if links == 4:
            mechanism = four_bar(rng.uniform(1.5, 3.0), 1.0, rng.uniform(2.0, 3.5), rng.uniform(2.0, 3.5))
        else:
            mechanism = embodied(links, int(rng.integers(CHAINS[links])))
        driver = mechanism.drivers[0]
        if mechanism.frame != 0 or driver.base != 0:
            continue
        u = rng.uniform(0.0, 6.28)
        motion = simulate(mechanism, [u, u + 0.01])
        if not motion.assembled.all():
            continue
        alpha = largest * 10.0 ** rng.uniform(-2.0, 0.0)
        tilt = Misalignment(driver.base, driver.link, alpha, rng.uniform(0.0, 6.28))
        size = rng.choice([0.0, 0.3])
        limits = {j.pair: (rng.uniform(0.15, 0.6) * alpha, float(rng.uniform(0.0, size) * alpha))
                  for j in mechanism.joints}  # fmt: skip
        factor = problem(mechanism, joint_limits(limits, 1.0, tilt), tilt).solve(motion.poses[:1], "scale").lower[0]
        if 0.1 < factor < 10.0:
            return mechanism, motion, tilt, limits, float(factor)


def joint_limits(limits, scale, tilt):
    """Limits on one scale, of all joints but the motor."""
    return {pair: JointLimits(t * scale, s * scale) for pair, (t, s) in limits.items() if pair != tilt.pair}


def placed(model, q, digits=50):
    """Frames of all links in mpmath from the coordinates of the joints along a tree, and the misfit of the others.

    Rotations by Rodrigues' formula from angle and axis; returns the largest misfit of a joint that closes a loop.
    """
    mpmath.mp.dps = digits
    frames = {model.frame: (mpmath.eye(3), mpmath.matrix(3, 1))}
    todo, misfit = list(range(len(model.joints))), mpmath.mpf(0)
    while todo:
        for k in list(todo):
            joint = model.joints[k]
            motion = moved(model, k, q)
            if joint.a in frames and joint.b in frames:
                R, p = product(frames[joint.a], motion)
                S, r = frames[joint.b]
                misfit = max(misfit, *(abs(v) for v in (R - S)), *(abs(v) for v in (p - r)))
            elif joint.a in frames:
                frames[joint.b] = product(frames[joint.a], motion)
            elif joint.b in frames:
                frames[joint.a] = product(frames[joint.b], inverse(motion))
            else:
                continue
            todo.remove(k)
    return misfit


def product(first, second):
    return first[0] * second[0], first[1] + first[0] * second[1]


def inverse(motion):
    return motion[0].T, -(motion[0].T * motion[1])


def rotation(vector):
    angle = mpmath.sqrt(sum(v * v for v in vector))
    if angle == 0:
        return mpmath.eye(3)
    x, y, z = (v / angle for v in vector)
    K = mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return mpmath.eye(3) + mpmath.sin(angle) * K + (1 - mpmath.cos(angle)) * (K * K)


def moved(model, k, q):
    """Motion from the frame of link a to that of link b through joint k."""
    joint, at = model.joints[k], [q[c] if c >= 0 else mpmath.mpf(0) for c in model.column[k]]
    seats = []
    for seat in (joint.seat_a, joint.seat_b):
        vector = seat.exact if hasattr(seat, "exact") else seat.turn
        place = mpmath.matrix([mpmath.mpf(v) / mpmath.mpf(model.unit) for v in seat.point])
        seats.append((rotation([mpmath.mpf(v) for v in vector]), place))
    x, y = at[1], at[2]
    size = mpmath.sqrt(x * x + y * y)
    lean = [v * (2 * mpmath.atan(size / 2) / size) if size else mpmath.mpf(0) for v in (x, y)]
    inner = rotation([*lean, mpmath.mpf(0)]) * rotation([0, 0, at[0]]), mpmath.matrix(at[3:])
    return product(product(seats[0], inner), inverse(seats[1]))
