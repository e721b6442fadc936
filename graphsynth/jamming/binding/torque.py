"""The torque that binding costs over a motion: elastic, from the derivative of the least energy, and of friction.

In the plane pins shift (`graphsynth.jamming.binding.shifts`); out of it joints tilt, at the poses that are left.
"""

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
from graphsynth.jamming.binding.shifts import Shifted, shifted
from graphsynth.jamming.joints.closure import ROUND, force_rows
from graphsynth.jamming.joints.limits import JointLimits, Misalignment
from graphsynth.jamming.joints.program import JointProblem, check_motion, problem

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
_RIGID = JointStiffness(math.inf)
#: Elastic tilts beyond this are no small ones any more (radians).
_SMALL = 0.1
#: Shifts of pins beyond this, over the size of the mechanism, are no work of clearances and contacts.
_FAR = 0.02


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
    closes all loops (small tilts) gives the loads, and its derivative by the input the torque.  Where the mechanism
    does not close in its plane, pins shift within their radial clearance and are pressed beyond it; so the lengths may
    be wrong, or there may be a link too many.  See theory/what-binding-costs.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; any planar mechanism.  For one with more joints than that takes give
        `unclosed_motion`.
    tilt, joints
        As in `graphsynth.assess_jamming`: misaligned axes, or the tilt of the first driver's axis, radians or text;
        limits of the joints, or one tilt for all.  Radial clearances of `JointLimits` count where the mechanism does
        not close without them.
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
    plane = shifted(motion, given.limits, parts.springs, size)
    motion = plane.motion
    keep = np.flatnonzero(motion.assembled)
    poses, rates = motion.poses[keep], motion.velocities[keep]
    moving = np.asarray(np.isfinite(rates).all(axis=(1, 2)))  # not in a dead-centre position, nor at a change point
    rates = np.where(moving[:, None, None], rates, 0.0)
    loaded = _loaded(given, parts.springs, rows_of(given, parts.springs, parts.beams, poses, rates, size), size)
    rubbing, rate = parts.rubbing, driven_rate(motion, size)[keep]
    sliding = _sliding(given, rubbing, *joint_rates(motion.mechanism, poses, rates), size)
    loaded = loaded.pressed(given, plane, keep)
    ends, push = loaded.ends(given, rubbing), np.sqrt((loaded.push**2).sum(-1))
    # at the worse end of a bearing, at both and its face
    worse, contact = ends.max(axis=0, initial=0.0), ends.sum(axis=0) + np.abs(loaded.force)
    coefficient = np.array([0.0 if own is None else own.coefficient for own in _of(given, rubbing)])
    known = np.where(moving & (rate != 0.0), rate, math.nan)
    elastic, losses = loaded.slope / known + plane.torque[keep], (contact * sliding) @ coefficient / np.abs(known)
    elastic[loaded.least.stiff] = math.inf
    # the columns of the report, NaN where the mechanism is not assembled
    columns = {
        "energy": loaded.least.energy + plane.energy[keep],
        "elastic_torque": elastic,
        "friction_torque": losses,
        "moment": loaded.moment,
        "force": np.abs(loaded.force),
        "tilt": loaded.tilt,
        "error": loaded.least.error,
        "push": push,
        "shift": plane.shift[keep][:, list(given.layout.joints)],
    }
    whole = {name: _spread(values, keep, len(motion.inputs)) for name, values in columns.items()}
    whole["energy"][plane.blocked] = whole["elastic_torque"][plane.blocked] = math.inf
    whole["friction_torque"][plane.blocked] = 0.0
    return BindingReport(
        motion=motion,
        **whole,
        blocked=plane.blocked | np.isin(np.arange(len(motion.inputs)), keep[loaded.least.stiff]),
        names=given.names,
        joints=given.pairs,
        wear=_wear(given, rubbing, motion.inputs[keep], loaded, (push, worse, contact, sliding)),
        motor_torque=limit,
        unit=size,
        problem=given,
        springs=tuple(parts.springs),
        bent=any(beam is not None for beam in parts.beams),
        notes=_notes(motion, given, known, loaded, plane),
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
    """Solution, derivative of the energy by the input (N,), moments and axial forces (N, joints), tilts (N, blocks).

    ``couple``, ``push`` (N, joints, 2): moments of round joints as vectors, and forces in the plane; ``guided``,
    ``turning`` (N, joints): moments of guides out of the plane and in it.
    """

    least: Least
    slope: Array
    moment: Array
    force: Array
    tilt: Array
    couple: Array
    guided: Array
    push: Array
    turning: Array

    def pressed(self, given: JointProblem, plane: Shifted, keep: NDArray[np.intp]) -> _Loaded:
        """Add what presses on the joints in the plane."""
        own = list(given.layout.joints)
        return self._replace(push=plane.force[keep][:, own], turning=plane.turning[keep][:, own])

    def ends(self, given: JointProblem, rubbing: Sequence[ContactFriction | None]) -> Array:
        """Return forces at both ends of all bearings, N, (2, N, joints): half the push and the couple of the moment."""
        lengths = np.array([math.inf if own is None else own.length for own in _of(given, rubbing)])
        half, q = 0.5 * self.push, (self.couple @ np.array([[0.0, -1.0], [1.0, 0.0]])) / lengths[:, None]
        rest = (self.guided + self.turning) / lengths
        return np.stack([np.sqrt(((half + sign * q) ** 2).sum(-1)) + rest for sign in (1.0, -1.0)])


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
    guided, couple = np.zeros((count, joints)), np.zeros((count, joints, 2))
    for b, place in enumerate(layout.block_joint.tolist()):
        if layout.block_axis[b] == ROUND:
            couple[:, place] = np.where(size[:, b, None] > 0.0, m[:, b], 0.0)
        else:
            guided[:, place] = np.hypot(guided[:, place], size[:, b])
    moment = np.hypot(guided, np.hypot(couple[..., 0], couple[..., 1]))
    soft = np.array([springs[layout.joints[place]].tilt for place in layout.block_joint.tolist()])
    tilts, none = _tilts(layout.limit, soft, size), np.zeros_like(couple)
    return _Loaded(least, slope, moment, y @ F.T, tilts, couple, guided, none, none[..., 0])


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
    given: JointProblem, rubbing: Sequence[ContactFriction | None], u: Array, loaded: _Loaded, rubs: Sequence[Array]
) -> tuple[JointWear, ...]:
    """Rows of all joints, those that wear most first; sizes that are not known leave NaN.

    ``rubs``: force in the plane, at the worse end of the bearing, of all contacts; how it slides; all (N, joints).
    """
    push, ends, contact, sliding = rubs
    found = []
    for place, (pair, own) in enumerate(zip(given.pairs, _of(given, rubbing))):
        moment, force, pressed = (
            float(np.abs(v[:, place]).max(initial=0.0)) for v in (loaded.moment, loaded.force, push)
        )
        if own is None:
            found.append(JointWear(pair, moment, force, math.nan, math.nan, math.nan, math.nan, pressed))
            continue
        end = ends[:, place]
        way = sliding[:, place]
        worn = float(np.trapezoid(end / (own.radius * own.length) * way, u))
        lost = float(np.trapezoid(own.coefficient * contact[:, place] * way, u))
        slid, worn, lost = (abs(total) for total in (float(np.trapezoid(way, u)), worn, lost))  # inputs may fall
        found.append(JointWear(pair, moment, force, float(end.max(initial=0.0)), slid, worn, lost, pressed))
    return tuple(sorted(found, key=lambda row: (-np.nan_to_num(row.wear, nan=-1.0), -row.moment)))


def _notes(motion: Motion, given: JointProblem, known: Array, loaded: _Loaded, plane: Shifted) -> tuple[str, ...]:
    notes = []
    if used := int((plane.shift.max(axis=1, initial=0.0) > 0.0).sum()):
        notes.append(f"at {used} samples the mechanism closes only with its pins shifted")
    if (way := float(plane.shift.max(initial=0.0)) / motion.Lc) > _FAR:
        notes.append(f"pins are pressed {100.0 * way:.2g} % of the mechanism's size aside: it would break before that")
    if given.layout.loops == 0 and not (plane.energy.any() or plane.blocked.any()):
        notes.append("no closed loop of guided joints: nothing can bind")
    if missing := int((~motion.assembled & ~plane.blocked).sum()):
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
