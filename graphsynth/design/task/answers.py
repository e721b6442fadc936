"""From a candidate to an answer: the mechanism, simulated anew, judged by what the task asks, certified if it can be.

Nothing is accepted on the word of the search.  Errors are those of the new motion, the largest over each target.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.shown import Shown
from graphsynth.design.task.aims import TimedAim, beside, extreme
from graphsynth.design.task.bounds import broken_bounds, missed_wishes, places_of
from graphsynth.design.task.model import Moved
from graphsynth.design.task.plans import Plan
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.targets import (
    DwellTarget,
    FunctionTarget,
    LinkTarget,
    PathTarget,
    PosesTarget,
    SwingTarget,
    Target,
)
from graphsynth.design.task.task import DesignTask
from graphsynth.jamming.questions import largest_scale
from graphsynth.kinematics.dimensional.design import World
from graphsynth.kinematics.dimensional.matching import MovingLink, Wanted, at_times, passed
from graphsynth.kinematics.dimensional.problem import carried, lying
from graphsynth.kinematics.dimensional.verify import (
    SAMPLES,
    SLACK,
    arm_lengths,
    faults,
    length_ratio,
    side_lengths,
    smallest_transmission,
)
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.scaling import rounded

if TYPE_CHECKING:
    from graphsynth.kinematics.certify.poses import MotionCertificate
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: What is said of targets, not of bounds.
_MISSED = " is missed"
#: Samples of a motion that is certified, and boxes it may take.
_PROVED, _BOXES = 181, 20_000
#: Distance of the bounds of the margin of binding, and the time of its proof.
_GAP, _SECONDS = 0.02, 5.0


#: Key of a graph, and links that carry what is named.
Chain = tuple[str, tuple[int, ...]]


class Origin(NamedTuple):
    """What a model of candidates is made of: a plan, the number of its first piece, the mechanism it began with."""

    plan: Plan
    number: int
    given: Mechanism | None


class Candidate(NamedTuple):
    """What a search found: its error in tolerances, vector and mechanism; starts of targets with their own."""

    error: float
    origin: Origin
    x: Array
    mechanism: Mechanism
    starts: tuple[float, ...]

    @property
    def plan(self) -> Plan:
        """All but its numbers."""
        return self.origin.plan

    @property
    def chain(self) -> Chain:
        """Its graph and the links that carry what is named."""
        return self.plan.design.graph.key, self.plan.carriers


def built(problem: TaskProblem, x: Array) -> tuple[Mechanism, tuple[float, ...]]:
    """Return the mechanism of a vector, in its pose at the input 0, and where targets with their own start begin."""
    model = problem.model
    u = model.read(x[None])
    frames, design = model.move(u).frames[0, 0], model.plan.design
    table = design.dimensions(u.places, u.numbers)[0]
    world = [
        carried(World.read(row), frames[joint.a], frames[joint.b], (1.0 + 0j, 0j))
        for joint, row in zip(design.graph.joints, table)
    ]
    points: dict[str, tuple[int, complex]] = {}
    for k, name in enumerate(name for name, of_point in model.task.names.items() if of_point):
        x0, y0, c, s = frames[model.carrier(name)]
        points[name] = model.carrier(name), complex(x0, y0) + complex(c, s) * complex(*u.points[0, k])
    starts = tuple(float(x[aim.start]) for aim in problem.aims if isinstance(aim, TimedAim) and aim.start >= 0)
    mechanism = lying(design, world, points, model.sense * float(u.stroke[0]))
    links = {name: model.carrier(name) for name, of_point in model.task.names.items() if not of_point}
    return rounded(replace(mechanism, input_range=(0.0, model.task.span), link_names=links)), starts


@dataclass(frozen=True, eq=False, repr=False)
class DesignedMechanism(Shown):
    """An answer to a task.

    Attributes
    ----------
    mechanism : Mechanism
        In the coordinates of the task, with its named points; inputs run from 0 over the range of the drive.
    motion : Motion
        Simulated anew over the range.
    errors : tuple of float
        Of every target, in the unit of its tolerance.
    accepted : bool
        Every target met and every bound kept.
    reasons : tuple of str
        Why it is not accepted.
    links : int
    size : float
        Diagonal of the box that holds all joints and points over the motion.
    transmission : float
        Smallest transmission angle, radians.
    ratio : float
        Longest over shortest length.
    jam_margin : float
        Misalignment of the driver's axis at which the joints begin to bind, over the one of the task: a certified lower
        bound for small tilts; NaN if the task names none, or another reason rejects the mechanism.
    score : float
        What it is ranked by; less is better.
    certificate : MotionCertificate or None
        Proof that the motion is one branch over the whole range; None if it was not tried.
    carriers : mapping of str to int
        Link of every name of the task.
    wishes : mapping of str to float
        Soft bounds that are missed, and by how much: radians, parts of a length, parts of the size of the task.
    """

    mechanism: Mechanism
    motion: Motion
    errors: tuple[float, ...]
    accepted: bool
    reasons: tuple[str, ...]
    links: int
    size: float
    transmission: float
    ratio: float
    jam_margin: float
    score: float
    certificate: MotionCertificate | None
    carriers: Mapping[str, int]
    wishes: Mapping[str, float] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Canonical key of its graph."""
        return str(self.mechanism.graph.key)

    @property
    def kept(self) -> bool:
        """Whether it keeps every bound, though it may miss targets."""
        return all(reason.endswith(_MISSED) for reason in self.reasons)

    @property
    def certified(self) -> bool:
        """Whether its motion is proved over the whole range."""
        return self.certificate is not None and self.certificate.certified

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("accepted", "yes" if self.accepted else "; ".join(self.reasons)),
            ("errors", ", ".join(f"{error:.3g}" for error in self.errors)),
            ("transmission angle", f"{math.degrees(self.transmission):.1f} deg"),
            ("size", f"{self.size:.4g}"),
            *((f"wish {name}", f"missed by {by:.2g}") for name, by in self.wishes.items()),
            ("motion", "certified" if self.certified else "estimated"),
        ]
        return f"Mechanism of {self.links} links", rows

    def _picture(self) -> str:
        return str(self.motion._picture())


def judged(task: DesignTask, found: Candidate) -> DesignedMechanism:
    """Simulate a candidate anew and judge it."""
    inputs = np.linspace(0.0, task.span, SAMPLES + 1)
    motion = simulate(found.mechanism, inputs)
    done = motion.completed
    carriers = dict(zip(task.names, found.plan.carriers))
    errors = _errors(task, motion, carriers, found.starts) if done else (math.inf,) * len(task.targets)
    angle, ratio = smallest_transmission(motion), length_ratio(motion.mechanism)
    places = places_of(motion)
    wrong = {
        **faults(motion, task.drive == "rotation"),
        "the transmission angle is too small": "transmission" not in task.soft
        and not angle >= task.transmission - SLACK,
        "the length ratio is too large": "length_ratio" not in task.soft
        and not ratio <= task.length_ratio * (1.0 + SLACK),
        **broken_bounds(task, motion, places, found.plan),
    }
    for target, error in zip(task.targets, errors):
        name = type(target).__name__.removesuffix("Target").lower().replace("poses", "motion")
        wrong[f"the {name}{_MISSED}"] = wrong.get(f"the {name}{_MISSED}", False) or not error <= target.tolerance
    margin = math.nan
    if task.misalignment is not None and not any(wrong.values()):
        scale = largest_scale(motion, task.joint_tilt, task.misalignment, relative_gap=_GAP, seconds=_SECONDS)
        margin = scale.low
        wrong["its joints bind at the misalignment"] = not margin >= 1.0
    wishes = missed_wishes(task, places, motion.mechanism, (angle, ratio)) if done else {}
    reasons = tuple(reason for reason, is_so in wrong.items() if is_so)
    size = float(abs(complex(*np.ptp(places.reshape(-1, 2), axis=0)))) if done else math.inf
    worst = max(error / target.tolerance * target.weight for target, error in zip(task.targets, errors))
    if done and any(isinstance(target, PathTarget) and target.outline for target in task.targets):
        worst = found.error  # a curve is as good as its mean distance
    links, weight = found.mechanism.graph.links, task.rank
    score = weight["error"] * worst + weight["links"] * links + weight["size"] * size / task.size
    score += sum(task.soft[name] * 100.0 * by for name, by in wishes.items())
    score -= weight["transmission"] * (angle if done else 0.0)
    score -= weight["jam"] * (min(margin, 4.0) if margin == margin else 0.0)
    return DesignedMechanism(
        found.mechanism,
        motion,
        errors,
        not reasons,
        reasons,
        links,
        size,
        angle,
        ratio,
        margin,
        score,
        None,
        carriers,
        wishes,
    )


def proved(answer: DesignedMechanism, span: float) -> MotionCertificate:
    """Certify the motion of an answer over the range."""
    from graphsynth.kinematics.certify.poses import certify

    motion = simulate(answer.mechanism, np.linspace(0.0, span, _PROVED))
    return certify(motion, max_boxes=_BOXES, seconds=10.0)


def signature(task: DesignTask, answer: DesignedMechanism) -> Array:
    """Return the logarithms of lengths and arms in order: near copies, renumbered or moved, have nearly the same.

    So have, for a task without a length, those of another size.
    """
    found = side_lengths(answer.mechanism) + arm_lengths(answer.mechanism)
    logarithms = np.log(np.maximum(np.sort(found), 1e-12))
    return np.asarray(logarithms if task.sized else logarithms - logarithms.mean())


# --- errors of targets, from the new motion


def _errors(
    task: DesignTask, motion: Motion, carriers: Mapping[str, int], starts: tuple[float, ...]
) -> tuple[float, ...]:
    """Errors of all targets, in their order."""
    left, found = iter(starts), []
    for target in task.targets:
        timed = getattr(target, "inputs", None)
        own = timed is not None and getattr(target, "own_start", False)
        own = own or (isinstance(target, DwellTarget) and target.start is None)
        start = next(left) if own else 0.0
        if isinstance(target, SwingTarget):
            found.append(_swing_error(task, target, motion, *pair_of(target, motion.mechanism, carriers)))
        elif isinstance(target, PathTarget | PosesTarget):
            found.append(_point_error(task, target, motion, carriers[target.point], start))
        else:
            found.append(_angle_error(task, target, motion, carriers, start))
    return tuple(found)


def _seen(task: DesignTask, motion: Motion, link: int, name: str = "") -> MovingLink:
    """Motion of a link, with its origin in a named point."""
    poses, rates = motion.poses[:, link], motion.velocities[:, link]
    z, v = poses[:, 0] + 1j * poses[:, 1], rates[:, 0] + 1j * rates[:, 1]
    if name:
        path = motion.point(name)
        z, v = path.position @ [1.0, 1.0j], path.velocity @ [1.0, 1.0j]
    frames = np.stack([z.real, z.imag, np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=-1)
    period = task.span if task.drive == "rotation" else 0.0
    return MovingLink(motion.inputs, frames[None], np.stack([v.real, v.imag, rates[:, 2]], axis=-1)[None], period)


def _point_error(task: DesignTask, target: PathTarget | PosesTarget, motion: Motion, link: int, start: float) -> float:
    """Largest distance over the size, or their mean; of poses also the largest angle, from the line that suits best."""
    own = _seen(task, motion, link, target.point)
    turn = target.turn if isinstance(target, PosesTarget) else None
    if isinstance(target, PathTarget) and target.outline:  # passed by, and the curve is nowhere else
        z = own.frames[0, :, 0] + 1j * own.frames[0, :, 1]
        return max(_passed(z, target.goal), float(np.abs(z - beside(z, target.goal)).max())) / target.size
    if target.inputs is not None:
        times = np.array(target.inputs)[None] + start
    else:
        times = passed(own, Wanted(target.goal, turn, target.size, False, free=False))
    at = at_times(own, times)[0][0]
    away = np.abs(at[:, 0] + 1j * at[:, 1] - target.goal) / target.size
    mean = isinstance(target, PathTarget) and target.mean
    far = float(np.sqrt((away**2).mean()) if mean else away.max())
    if turn is None:
        return far
    rest = (at[:, 2] + 1j * at[:, 3]) * np.exp(-1j * turn)
    return max(far, float(np.abs(np.angle(rest * np.conj(rest.sum()))).max()))


def _passed(z: Complex, corners: Complex) -> float:
    """Largest distance of corners of a closed polygon from a curve where it runs the same way as a side there."""
    side, ways = np.diff(z), np.roll(corners, -1) - corners
    part = np.clip((np.conj(side) * (corners[:, None] - z[:-1])).real / np.maximum(np.abs(side) ** 2, 1e-300), 0.0, 1.0)
    along = [(np.conj(side) * own[:, None]).real for own in (ways, np.roll(ways, 1))]
    far = np.abs(corners[:, None] - z[:-1] - part * side)
    return float(np.where(np.maximum(*along) > 0.0, far, np.inf).min(axis=1).max())


def output(motion: Motion, link: int, base: int) -> tuple[Array, Array]:
    """Return what a link does against another over a motion, and its rate: an angle, or a place along their guide."""
    joint = _guide(motion.mechanism, link, base)
    turned, spin = (own[:, link, 2] - own[:, base, 2] for own in (motion.poses, motion.velocities))
    if joint is None:
        return np.unwrap(turned), spin
    a, b = (motion.point(n, at) for n, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))
    along = np.exp(1j * (motion.poses[:, joint.a, 2] + joint.angle_a)) * (1.0 if link == joint.b else -1.0)
    way, speed = ((q - p) @ [1.0, 1.0j] for p, q in ((a.position, b.position), (a.velocity, b.velocity)))
    seen = np.conj(along) * way
    return seen.real, (np.conj(along) * speed).real + motion.velocities[:, joint.a, 2] * seen.imag


def _guide(mechanism: Mechanism, link: int, base: int) -> Prismatic | None:
    """Return the prismatic joint of two links, if there is one."""
    own = (j for j in mechanism.joints if {*j.pair} == {link, base} and isinstance(j, Prismatic))
    return next(own, None)


def pair_of(target: LinkTarget, mechanism: Mechanism, carriers: Mapping[str, int]) -> tuple[int, int]:
    """Return the link of a target and that against which it moves."""
    return carriers[target.link], carriers[target.base] if target.base else mechanism.frame


def _angle_error(task: DesignTask, target: Target, motion: Motion, carriers: Mapping[str, int], start: float) -> float:
    """Half the spread of the differences from a function; of a dwell half the spread of the output."""
    from scipy.interpolate import CubicHermiteSpline

    assert isinstance(target, FunctionTarget | DwellTarget)
    link, base = pair_of(target, motion.mechanism, carriers)
    values, rates = output(motion, link, base)
    spline = CubicHermiteSpline(motion.inputs, values, rates)
    whole = values[-1] - values[0]  # of a link that turns with the driver
    if isinstance(target, DwellTarget):
        start += target.start or 0.0
        at, wanted = start + np.linspace(0.0, target.span, 121), np.zeros(121)
    else:
        assert target.inputs is not None
        at, wanted = start + np.array(target.inputs), np.array(target.outputs)
    turns, rest = np.divmod(at, task.span) if task.drive == "rotation" else (0.0 * at, at)
    every = spline(rest) + turns * whole
    return min(
        float(0.5 * np.ptp(every - sign * wanted))
        for sign in ((1.0, -1.0) if _guide(motion.mechanism, link, base) else (1.0,))
    )


def _swing_error(task: DesignTask, target: SwingTarget, motion: Motion, link: int, base: int) -> float:
    """Return what the stroke lacks or has too much, and by what input, of a slider arc, the slow stroke is late."""
    from scipy.interpolate import CubicHermiteSpline

    values, rates = output(motion, link, base)
    ends = [_extreme(task, motion.inputs, values, rates, sign) for sign in (1.0, -1.0)]
    high, low = CubicHermiteSpline(motion.inputs, values, rates)(ends)
    swing = float(high - low)
    if not target.slides and abs(values[-1] - values[0]) > math.pi:
        return math.inf  # it goes round, not to and fro
    error = abs(swing - min(max(swing, target.least), target.most))
    if target.time_ratio is None:
        return error
    apart = abs(ends[0] - ends[1])
    late = abs(max(apart, math.tau - apart) - math.tau * target.time_ratio / (1.0 + target.time_ratio))
    return max(error, late * (swing if target.slides else 1.0))


def _extreme(task: DesignTask, u: Array, values: Array, rates: Array, sign: float) -> float:
    """Input of the largest value times the sign, where the rate passes zero."""
    period = task.span if task.drive == "rotation" else 0.0
    moved = Moved(u, np.zeros(0), np.zeros(0), np.ones(1, dtype=np.bool_), period)
    return float(extreme(moved, values[None], rates[None], sign)[0])
