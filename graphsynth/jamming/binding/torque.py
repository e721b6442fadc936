"""The torque that binding costs over a motion: elastic, from the derivative of the least energy, and of friction."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.angles import angle
from graphsynth.core.checks import checked, positive
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.binding.energy import Least, least_energy
from graphsynth.jamming.binding.parts import (
    ContactFriction,
    JointStiffness,
    LinkSection,
    as_stiffness,
    by_joint,
    frictions,
    metres,
    sections,
)
from graphsynth.jamming.binding.report import BindingReport, JointWear
from graphsynth.jamming.binding.rows import Rows, driven_rate, joint_rates, rows_of
from graphsynth.jamming.joints.closure import force_rows
from graphsynth.jamming.joints.limits import JointLimits, Misalignment
from graphsynth.jamming.joints.program import JointProblem, check_motion, problem

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
_RIGID = JointStiffness(math.inf)
#: Elastic tilts beyond this are no small ones any more (radians).
_SMALL = 0.1


@checked
def binding_torque(
    motion: Motion,
    *,
    tilt: Any,
    joints: Any,
    stiffness: Any = None,
    links: Any = None,
    friction: Any = None,
    motor_torque: float | None = None,
    unit: Any = "m",
) -> BindingReport:
    """Find what misaligned axes cost where the joints' limits are exceeded: energy, contact loads and drive torque.

    Every joint is free within its limits and a spring beyond them; links may be beams.  The least elastic energy that
    closes all loops (small tilts) gives the loads, and its derivative by the input the torque.  See
    theory/what-binding-costs.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; any planar mechanism.
    tilt, joints
        As in `graphsynth.assess_jamming`: misaligned axes, or the tilt of the first driver's axis, radians or text;
        limits of the joints, or one tilt for all.
    stiffness : float, JointStiffness, or mapping of (link, link) to one of these, optional
        Of the joints beyond their limits; a number is N m/rad of tilt.  Joints that are not named do not give way.
    links : LinkSection, or mapping of link to LinkSection, optional
        Sections of all links but the frame, or of those named; the others are rigid.
    friction : float, ContactFriction, or mapping of (link, link) to one of these, optional
        Coulomb friction of the contacts; a number needs joints given as `Bearing`, whose sizes it takes.
    motor_torque : float, optional
        What the motor can give, N m (of a driven guide N).
    unit : str or float
        The mechanism's unit of length: "m", "mm", "cm", "in", or metres as a number.

    Returns
    -------
    BindingReport
        Estimated; says "free", "binds" or "blocks".

    Raises
    ------
    GeometryError
        Nothing that gives way, friction without the size of its contacts, arguments that do not fit the mechanism.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> motion = Mechanism.four_bar(0.2, 0.1, 0.25, 0.25).simulate("0..360 deg")
    >>> report = binding_torque(motion, tilt="2 deg", joints="0.35 deg", stiffness=2000.0)
    >>> report.answer, round(report.peak_torque, 2)
    ('binds', 0.13)
    """
    begin = perf_counter()
    check_motion(motion)
    mechanism = motion.mechanism
    given = _problem(motion, tilt, joints)
    if stiffness is None and links is None:
        raise GeometryError(
            "nothing gives way, so that binding has no torque; give stiffness=... of the joints (N m/rad), or "
            "links=LinkSection.rectangular(young, width, height)"
        )
    parts = _Parts(
        by_joint(mechanism, "stiffness", stiffness, as_stiffness, _RIGID),
        sections(mechanism, links),
        frictions(mechanism, friction, joints),
    )
    limit = None if motor_torque is None else positive("motor_torque", motor_torque)
    return _report(motion, given, parts, metres(unit), limit, begin)


class _Parts(NamedTuple):
    """Stiffness and friction of every joint, section of every link."""

    springs: list[JointStiffness]
    beams: list[LinkSection | None]
    rubbing: list[ContactFriction | None]


def _report(
    motion: Motion, given: JointProblem, parts: _Parts, size: float, limit: float | None, begin: float
) -> BindingReport:
    """Solve all assembled samples and lay out what is found."""
    keep = np.flatnonzero(motion.assembled)
    poses, rates = motion.poses[keep], motion.velocities[keep]
    moving = np.asarray(np.isfinite(rates).all(axis=(1, 2)))  # not in a dead-centre position, nor at a change point
    rates = np.where(moving[:, None, None], rates, 0.0)
    loaded = _loaded(given, parts.springs, rows_of(given, parts.springs, parts.beams, poses, rates, size), size)
    rubbing, rate = parts.rubbing, driven_rate(motion, size)[keep]
    sliding = _sliding(given, rubbing, *joint_rates(motion.mechanism, poses, rates), size)
    rubs = loaded.contact(given, rubbing) * sliding
    coefficient = np.array([0.0 if own is None else own.coefficient for own in _of(given, rubbing)])
    known = np.where(moving & (rate != 0.0), rate, math.nan)
    elastic, losses = loaded.slope / known, rubs @ coefficient / np.abs(known)
    elastic[loaded.least.stiff] = math.inf
    # the columns of the report, NaN where the mechanism is not assembled
    columns = {
        "energy": loaded.least.energy,
        "elastic_torque": elastic,
        "friction_torque": losses,
        "moment": loaded.moment,
        "force": np.abs(loaded.force),
        "tilt": loaded.tilt,
        "error": loaded.least.error,
    }
    return BindingReport(
        motion=motion,
        **{name: _spread(values, keep, len(motion.inputs)) for name, values in columns.items()},
        blocked=np.isin(np.arange(len(motion.inputs)), keep[loaded.least.stiff]),
        names=given.names,
        joints=given.pairs,
        wear=_wear(given, rubbing, motion.inputs[keep], loaded, sliding),
        motor_torque=limit,
        unit=size,
        problem=given,
        springs=tuple(parts.springs),
        bent=any(beam is not None for beam in parts.beams),
        notes=_notes(motion, given, known, loaded),
        seconds=perf_counter() - begin,
    )


def _problem(motion: Motion, tilt: Any, joints: Any) -> JointProblem:
    if tilt is None or joints is None:
        raise GeometryError('give tilt="0.5 deg", the misaligned axis, and joints="1 deg", the limits of the joints')
    if isinstance(tilt, float | int | str):
        driver = motion.mechanism.drivers[0]
        tilt = Misalignment(driver.base, driver.link, angle("tilt", tilt))
    elif isinstance(tilt, Iterable):
        tilt = tuple(tilt)
    if isinstance(joints, float | int | str):
        joints = JointLimits(angle("joints", joints))
    return problem(motion.mechanism, joints, tilt)


class _Loaded(NamedTuple):
    """Solution, derivative of the energy by the input (N,), moments and axial forces (N, joints), tilts (N, blocks)."""

    least: Least
    slope: Array
    moment: Array
    force: Array
    tilt: Array

    def contact(self, given: JointProblem, rubbing: Sequence[ContactFriction | None]) -> Array:
        """Sum of all contact forces of every joint, N: both ends of the bearing and its face; (N, joints)."""
        lengths = np.array([math.inf if own is None else own.length for own in _of(given, rubbing)])
        return np.asarray(2.0 * self.moment / lengths + np.abs(self.force))


def _of(given: JointProblem, parts: Sequence[Any]) -> list[Any]:
    """Parts of the joints of the layout."""
    return [parts[k] for k in given.layout.joints]


def _loaded(given: JointProblem, springs: Sequence[JointStiffness], rows: Rows, unit: float) -> _Loaded:
    """Solve all poses; the derivative of the least energy is that of the dual function with the wrenches held."""
    layout = given.layout
    F = force_rows(layout)
    count, joints, k = len(rows.W), len(layout.joints), 3 * layout.loops
    # an axial clearance is a limit like one on a tilt, of one component
    axial = np.zeros((count, joints, 2, k))
    axial[:, :, 0] = F
    limits = np.concatenate([layout.limit, unit * layout.end_float])
    least = least_energy(np.concatenate([rows.M, axial], axis=1), limits, rows.W, rows.K)
    y = np.where(least.stiff[:, None], 0.0, least.y)
    m, m_rate = ((part @ y[:, None, :, None])[..., 0] for part in (rows.M, rows.M_rate))
    size = np.hypot(m[..., 0], m[..., 1])
    size = np.where(size > 1e-10 * size.max(axis=1, initial=0.0, keepdims=True), size, 0.0)
    slope = (y * rows.W_rate).sum(axis=1) - (least.g[:, : m.shape[1]] * m_rate).sum(axis=(1, 2))
    slope -= 0.5 * np.einsum("ni,nij,nj->n", y, rows.K_rate, y)
    moment = np.zeros((count, joints))
    for b, place in enumerate(layout.block_joint.tolist()):
        moment[:, place] = np.hypot(moment[:, place], size[:, b])
    soft = np.array([springs[layout.joints[place]].tilt for place in layout.block_joint.tolist()])
    return _Loaded(least, slope, moment, y @ F.T, _tilts(layout.limit, soft, size))


def _tilts(limit: Array, soft: Array, size: Array) -> Array:
    """Relative tilt of the joints in contact, the limit and the spring; NaN where it is open within the limit."""
    bent = size / soft
    with np.errstate(all="ignore"):
        return np.where(size > 0.0, limit + bent, np.where(limit > 0.0, np.nan, 0.0))


def _sliding(
    given: JointProblem, rubbing: Sequence[ContactFriction | None], turn: Array, travel: Array, unit: float
) -> Array:
    """Sliding distance of every joint of the layout for a unit of the input, metres; 0 where its size is not known."""
    found = np.zeros((len(turn), len(given.layout.joints)))
    for place, k in enumerate(given.layout.joints):
        own = rubbing[k]
        if own is not None:
            found[:, place] = np.hypot(own.radius * turn[:, k], unit * travel[:, k])
    return found


def _spread(values: Array, keep: NDArray[np.intp], count: int) -> Array:
    full = np.full((count, *values.shape[1:]), np.nan)
    full[keep] = values
    return full


def _wear(
    given: JointProblem, rubbing: Sequence[ContactFriction | None], u: Array, loaded: _Loaded, sliding: Array
) -> tuple[JointWear, ...]:
    """Rows of all joints, those that wear most first; sizes that are not known leave NaN."""
    contact = loaded.contact(given, rubbing)
    found = []
    for place, (pair, own) in enumerate(zip(given.pairs, _of(given, rubbing))):
        moment, force = (float(np.abs(v[:, place]).max(initial=0.0)) for v in (loaded.moment, loaded.force))
        if own is None:
            found.append(JointWear(pair, moment, force, *[math.nan] * 4))
            continue
        end = loaded.moment[:, place] / own.length
        way = sliding[:, place]
        worn = float(np.trapezoid(end / (own.radius * own.length) * way, u))
        lost = float(np.trapezoid(own.coefficient * contact[:, place] * way, u))
        sums = (abs(total) for total in (float(np.trapezoid(way, u)), worn, lost))  # inputs may fall
        found.append(JointWear(pair, moment, force, float(end.max(initial=0.0)), *sums))
    return tuple(sorted(found, key=lambda row: (-np.nan_to_num(row.wear, nan=-1.0), -row.moment)))


def _notes(motion: Motion, given: JointProblem, known: Array, loaded: _Loaded) -> tuple[str, ...]:
    notes = []
    if given.layout.loops == 0:
        notes.append("no closed loop of guided joints: nothing can bind")
    if missing := len(motion.inputs) - len(known):
        notes.append(f"{missing} samples are not assembled: {motion.reason}")
    if still := int(np.isnan(known).sum()):
        notes.append(f"the torque is not known at {still} samples, in dead-centre positions or at change points")
    largest = max(float(np.nanmax(loaded.tilt, initial=0.0)), *(abs(own.alpha) for own in given.misalignments), 0.0)
    if largest > _SMALL:
        notes.append(f"tilts of {largest:.3g} rad: small tilts are a rough model there, errors {largest**2:.1g}")
    worst = float(loaded.least.error.max(initial=0.0))
    if worst > 1e-5:
        notes.append(f"the loads are known to {worst:.1e} of those without clearance only")
    if len(motion.mechanism.drivers) > 1:
        notes.append("several drivers: the torque is that of one shaft that turns them all, by the input")
    return tuple(notes)
