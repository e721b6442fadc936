"""`certify`: proof that a simulated motion of any planar mechanism is one branch of exact assemblies."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import positive, whole
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, exact, tau_times
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.moving import Budget, Cover, Nodes, cover, prove_nodes, whole_turns
from graphsynth.kinematics.certify.equations import MechanismSystem, whole_periods
from graphsynth.kinematics.engine.result import Motion
from graphsynth.mechanism.joints import Gear, Prismatic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class MotionCertificate:
    """What is proved about a simulated motion.

    Attributes
    ----------
    certified : bool
        Every sample has its exact assembly, and (with ``between``) all samples lie on one branch that is continuous and
        regular over the whole range of inputs; else it is undecided.
    poses : ndarray of bool, shape (n,)
        Samples for which exactly one exact assembly within the stated radii is proved.
    position_radius, angle_radius : ndarray, shape (n,)
        The exact assembly is within this distance of the origin of every link (length) and within this angle of every
        link (radians) of the sample; NaN where nothing is proved.
    unique_within : ndarray, shape (n,)
        No other exact assembly has all link origins within ``unique_within * Lc`` and all angles within
        ``unique_within`` of the sample; NaN where nothing is proved.
    intervals : ndarray of bool, shape (n - 1,)
        Intervals between samples for which one regular branch is proved; all False if ``between`` is False.
    closed : bool
        The assembly after the full turn is proved to be the first one again.
    undecided : tuple of (float, float)
        Intervals of the input, of the smallest size tried, where nothing is proved.
    reason : str
        Why it is undecided; empty if it is not.
    boxes : int
        Moving boxes tested.
    Lc : float
        Characteristic length.
    seconds : float
        Run time.
    statement : str
        The result in one sentence.
    """

    certified: bool
    poses: Mask
    position_radius: Array
    angle_radius: Array
    unique_within: Array
    intervals: Mask
    closed: bool
    undecided: tuple[tuple[float, float], ...]
    reason: str
    boxes: int
    Lc: float
    seconds: float
    statement: str


def certify(
    motion: Motion, *, between: bool = True, max_boxes: int = 100_000, seconds: float = 60.0
) -> MotionCertificate:
    """Prove that a motion of `graphsynth.simulate` shows exact assemblies of one branch.

    Parameters
    ----------
    motion : Motion
        Of any planar mechanism (R, P, pin-slot, gears, cams; any groups), with as many drivers as freedoms.  Its
        dimensions and inputs are taken as exact numbers.
    between : bool, optional
        Prove the branch between the samples as well, and its closing after a full turn.
    max_boxes, seconds : optional
        Limits of the work; what is not proved within them is undecided.

    Returns
    -------
    MotionCertificate
        Certified: by Krawczyk's test on all joint equations with the driver coordinates held, in ball arithmetic.

    Raises
    ------
    GeometryError
        If the drivers do not fit the mobility.

    Notes
    -----
    [Krawczyk 1969]; [Neumaier 1990], theory/circle-and-ellipse 1; theory/platform-drive 5.
    See ``docs/explanation/certificates.md``.

    Examples
    --------
    >>> from graphsynth import Mechanism, simulate
    >>> rocker = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    >>> proof = certify(simulate(rocker, np.linspace(0.0, 2.0 * np.pi, 37)))
    >>> proof.certified, proof.closed, bool(proof.position_radius.max() < 1e-12)
    (True, True, True)
    """
    if not isinstance(motion, Motion):
        raise GeometryError(f"{type(motion).__name__} is not a motion of graphsynth.simulate; give one")
    begin, budget = perf_counter(), Budget(whole("max_boxes", max_boxes, 1, 10**9), positive("seconds", seconds))
    check_rounding()
    system, asked, turns, end, nodes, radii, found = _proved(motion, between, budget, begin)
    closed = turns is not None and end
    closed = closed and bool(found.covered.all()) and _closes(system, nodes, turns)
    n = len(motion.inputs)
    poses, intervals = np.zeros(n, dtype=bool), np.zeros(max(n - 1, 0), dtype=bool)
    proved = np.isfinite(radii[2])
    poses[asked] = proved
    intervals[: len(found.covered)] = found.covered & proved[:-1] & proved[1:]
    position, angle, room = np.full((3, n), np.nan)
    for target, part in zip((position, angle, room), radii):
        target[asked] = part
    reason = _reason(motion, between, poses, intervals, found)
    return MotionCertificate(
        certified=not reason,
        poses=poses,
        position_radius=position,
        angle_radius=angle,
        unique_within=room,
        intervals=intervals,
        closed=bool(closed and not reason),
        undecided=tuple(sorted(found.undecided)),
        reason=reason,
        boxes=found.tested,
        Lc=motion.Lc,
        seconds=perf_counter() - begin,
        statement=_statement(reason, between, int(poses.sum()), n, closed, turns is not None),
    )


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Moving boxes that hold a proved branch: poses ``x + V (u - u_mid)``, each within ``radius``.

    ``u_mid``, ``u_rad`` (N,): inputs; ``x``, ``V``, ``radius`` (N, links, 3): ``(x, y, theta)``.  ``reason`` tells why
    they do not hold the whole motion; empty if they do.
    """

    u_mid: Array
    u_rad: Array
    x: Array
    V: Array
    radius: Array
    reason: str


def enclosures(motion: Motion, *, max_boxes: int = 100_000, seconds: float = 60.0) -> Enclosures:
    """Return the boxes behind `certify`, for proofs of what depends on the poses between samples too.

    Raises
    ------
    GeometryError
        As `certify`.
    """
    check_rounding()
    system, _, _, _, _, radii, found = _proved(motion, True, Budget(max_boxes, seconds), perf_counter())
    proved = np.isfinite(radii[2])
    reason = _reason(motion, True, proved, found.covered & proved[:-1] & proved[1:], found)
    count = sum(len(boxes.x) for boxes, _ in found.boxes)
    wide = np.zeros((3, count, motion.mechanism.graph.links, 3))
    for target, parts in zip(
        wide,
        ([b.x for b, _ in found.boxes], [b.V for b, _ in found.boxes], [tight for _, tight in found.boxes]),
    ):
        if parts:
            target[:, system.moving] = np.concatenate(parts).reshape(count, len(system.moving), 3)
    u = [boxes.u for boxes, _ in found.boxes]
    mid, rad = (np.concatenate([getattr(ball, name) for ball in u] or [np.zeros(0)]) for name in ("mid", "rad"))
    return Enclosures(mid, rad, wide[0], wide[1], wide[2], reason)


def _proved(
    motion: Motion, between: bool, budget: Budget, begin: float
) -> tuple[MechanismSystem, NDArray[np.intp], Fraction | None, bool, Nodes, tuple[Array, Array, Array], Cover]:
    """Prove nodes and, if asked, moving boxes between; up to the first gap: a branch has no holes."""
    system = MechanismSystem(motion.mechanism)
    reached = motion.assembled & np.isfinite(motion.poses).all(axis=(1, 2))
    asked = np.arange(int(np.argmin(np.append(reached, False))))
    samples = motion.poses[asked][:, system.moving].reshape(len(asked), system.size)
    turns = _full_turn(motion) if between and len(asked) == len(motion.inputs) else None
    u, end = _inputs(motion.inputs[asked], turns)
    nodes = prove_nodes(system, u, samples)
    found = Cover(np.zeros(max(len(asked) - 1, 0), dtype=bool))
    if between and len(asked) > 1 and all(hasattr(d.law, "at") for d in motion.mechanism.drivers):
        found = cover(system, nodes, budget, begin)
    return system, asked, turns, end, nodes, radii_of(system, nodes, samples), found


def _full_turn(motion: Motion) -> Fraction | None:
    """Return the turns of the input, ``u_end - u_0 = 2 pi turns``, after which every driver is in its place again."""
    if len(motion.inputs) < 2:
        return None
    span = float(motion.inputs[-1] - motion.inputs[0]) / math.tau
    turns = Fraction(span).limit_denominator(360)
    if turns == 0 or abs(span - float(turns)) > 1e-12 * abs(span):
        return None
    mechanism = motion.mechanism
    for driver in mechanism.drivers:
        slides = isinstance(mechanism.joint(*driver.pair), Prismatic)
        if whole_periods(driver.law, turns, slides) is None:
            return None
    return turns


def _inputs(u: Array, turns: Fraction | None) -> tuple[Balls, bool]:
    """Return the inputs as balls; the last one also holds the end of the exact turn, if the samples make one."""
    balls = exact(u)
    if turns is None or len(u) < 2:
        return balls, False
    stop = exact(u[0]) + tau_times(float(turns.numerator)) / exact(float(turns.denominator))
    gap = (stop - exact(u[-1])).size
    rad = balls.rad.copy()
    rad[-1] = gap
    return Balls(balls.mid, rad), bool(gap < 1e-9 * (1.0 + abs(u[-1])))


def radii_of(system: MechanismSystem, nodes: Nodes, samples: Array) -> tuple[Array, Array, Array]:
    """Distance of the exact assembly from the sample, and the room around the sample in which it is the only one."""
    proof, w = nodes.proof, system.weights
    with np.errstate(all="ignore"):
        apart = (exact(samples) - exact(nodes.x)).size
        distance = (apart + proof.tight) * (1.0 + 1e-14)
        room = ((proof.radius * (1.0 - 1e-14) - apart) / w).min(axis=1) * (1.0 - 1e-14)
        reach = (distance / w).max(axis=1)
        good = proof.proved & (reach < room)
        position = np.hypot(distance[:, 0::3], distance[:, 1::3]).max(axis=1, initial=0.0) * (1.0 + 1e-14)
    angle = distance[:, 2::3].max(axis=1, initial=0.0)
    return np.where(good, position, np.nan), np.where(good, angle, np.nan), np.where(good, room, np.nan)


def _closes(system: MechanismSystem, nodes: Nodes, turns: Fraction | None) -> bool:
    """Whether the solution at the end of the turn, with whole turns taken off, is the one at the start."""
    assert turns is not None
    made = whole_turns(nodes, np.tile([False, False, True], len(system.moving)))
    if made is None:
        return False
    mechanism, angle = system.mechanism, dict.fromkeys(range(system.mechanism.graph.links), 0)
    angle |= {link: made[3 * k + 2] for k, link in enumerate(system.moving)}
    expected, gear = [], 0
    for joint in mechanism.joints:
        if isinstance(joint, Prismatic):
            expected.append(angle[joint.b] - angle[joint.a])
        elif isinstance(joint, Gear):
            # the equation is the same after the turns that wheels and line of centres have made, exactly
            line = round(float(nodes.directions[-1, gear].mid - nodes.directions[0, gear].mid) / math.tau)
            made_by_line = tau_times(float(line))
            if not bool((nodes.directions[-1, gear] - nodes.directions[0, gear] - made_by_line).size < 3.0):
                return False
            first, second = map(Fraction, joint.turns()[0])
            if first * (angle[joint.a] - line) + second * (angle[joint.b] - line) != 0:
                return False
            gear += 1
    for driver, joint in system.driven:
        if not isinstance(joint, Prismatic):
            own = whole_periods(driver.law, turns, False)
            assert own is not None
            expected.append(angle[driver.link] - angle[driver.base] - own)
    return bool((nodes.turns[-1] - nodes.turns[0] == np.array(expected, dtype=np.int64)).all())


def _reason(motion: Motion, between: bool, poses: Mask, intervals: Mask, found: Cover) -> str:
    """Return why not everything is proved; empty if it is."""
    if not motion.assembled.all():
        return f"the motion itself is incomplete: {motion.reason or 'a sample is not assembled'}"
    if not poses.all():
        where = float(motion.inputs[int(np.argmin(poses))])
        return f"no exact assembly is proved beside the sample at input {where:.9g}: singular there, or no assembly"
    if not between or intervals.all():
        return ""
    unknown = [d for d in motion.mechanism.drivers if not hasattr(d.law, "at")]
    if unknown:
        pair = f"{unknown[0].base}-{unknown[0].link}"
        return f"the law of driver {pair} is known at points only, so nothing is proved between samples"
    if found.exhausted:
        done = int(intervals.sum())
        return (
            f"the limit of work was reached after {found.tested} boxes: {done} of {len(intervals)} intervals are proved"
        )
    a, b = sorted(found.undecided)[0] if found.undecided else (math.nan, math.nan)
    return (
        f"no single regular branch is proved between inputs {a:.12g} and {b:.12g}: a singularity, two modes that "
        "nearly meet, or samples of different branches"
    )


def _statement(reason: str, between: bool, count: int, asked: int, closed: bool, turned: bool) -> str:
    if reason:
        return f"undecided: {reason} ({count} of {asked} poses proved)"
    text = f"certified: each of the {count} samples has exactly one exact assembly within its radius"
    if not between:
        return text + "; nothing is stated between samples"
    text += ", and all lie on one branch without a singularity"
    if closed:
        return text + "; after the full turn the mechanism is proved to be where it began"
    return text + ("; closing after the turn is not proved" if turned else "")
