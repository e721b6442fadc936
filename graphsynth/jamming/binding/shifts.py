"""A mechanism followed through inputs at which it closes only since pins shift in their holes, or are pressed there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.angles import angles
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.binding.parts import JointStiffness
from graphsynth.jamming.binding.plane import Contacts, Plane, Rest, settled
from graphsynth.jamming.joints.limits import Limits
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import Cam, Prismatic
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Push beside the position of links in line, of the size of the mechanism: they go on as they came.
_PUSH = 2e-3
#: Contacts pressed less than this, of the size of the mechanism, are a matter of rounding.
_NOTHING = 1e-11


class Shifted(NamedTuple):
    """A motion that goes on where pins shift, and what that costs; zeros where the mechanism closes by itself.

    ``energy`` (n,) J, ``torque`` (n,) its derivative by the driven coordinate; ``force`` (n, joints, 2) of the pins in
    the plane, N, ``turning`` (n, joints) moments in the plane of guides, N m; ``shift`` (n, joints) in the mechanism's
    unit of length; ``blocked`` (n,): nothing gives way.
    """

    motion: Motion
    energy: Array
    torque: Array
    force: Array
    turning: Array
    shift: Array
    blocked: NDArray[np.bool_]


@checked
def unclosed_motion(mechanism: Mechanism, inputs: Any) -> Motion:
    """Make a motion in which no sample is solved yet, for `binding_torque`: of a mechanism with a link too many.

    Parameters
    ----------
    mechanism : Mechanism
        With a driver and a pose at which its joints close, or nearly so.
    inputs : array_like or str
        As for `graphsynth.simulate`, which refuses such mechanisms.

    Returns
    -------
    Motion
        NaN everywhere; `BindingReport.motion` holds the poses that are found.

    Raises
    ------
    GeometryError
        No driver, no pose, inputs that are not finite or not monotonic.
    """
    from graphsynth.kinematics.engine.inputs import monotonic
    from graphsynth.kinematics.engine.result import Closure, Motion

    if mechanism.pose is None or not mechanism.drivers:
        raise GeometryError("the mechanism has no pose or no driver to start from; give both")
    u, links = monotonic(angles("inputs", inputs)), mechanism.graph.links
    none, groups = np.full((len(u), links, 3), math.nan), np.zeros((len(u), 0))
    closure = Closure(False, False, math.nan, 0, (), "not tested")
    return Motion(
        mechanism,
        u,
        none,
        none,
        none,
        modes=groups.astype(np.int8),
        margins=groups,
        assembled=np.zeros(len(u), dtype=bool),
        steps=(),
        events=(),
        completed=False,
        reason="it does not close in its plane, nor with its pins shifted",
        stopped_at=float(u[0]),
        closure=closure,
        Lc=characteristic_length(mechanism),
        seconds=0.0,
    )


def at_rest(motion: Motion) -> Shifted:
    """Nothing shifts: the motion as it is."""
    n, joints = len(motion.inputs), len(motion.mechanism.joints)
    none = np.zeros((n, joints))
    return Shifted(
        motion, np.zeros(n), np.zeros(n), np.zeros((n, joints, 2)), none, none.copy(), np.zeros(n, dtype=bool)
    )


def shifted(motion: Motion, limits: Sequence[Limits], springs: Sequence[JointStiffness], unit: float) -> Shifted:
    """Follow a motion through the samples at which it is not assembled; see theory/what-binding-costs 10."""
    clearance = np.array([own.radial_clearance for own in limits])
    stiff = np.array([own.radial for own in springs])
    soft = (clearance > 0.0) | np.isfinite(stiff)
    out = at_rest(motion)
    if not soft.any() or motion.assembled.all():
        return out
    given = np.isfinite(stiff)
    for joint in (own for own, gives in zip(motion.mechanism.joints, given.tolist()) if gives and isinstance(own, Cam)):
        raise GeometryError(
            f"joint {joint.a}-{joint.b} is a cam contact, which is held in the plane; leave its radial stiffness out"
        )
    if given.any() and (soft & ~given).any():
        pair = motion.mechanism.joints[int(np.flatnonzero(soft & ~given)[0])].pair
        raise GeometryError(
            f"joint {pair[0]}-{pair[1]} has a radial_clearance but does not give way beyond it, where others do; give "
            "JointStiffness(tilt, radial=...) for it too"
        )
    contacts = Contacts(clearance, np.where(soft, np.where(given, stiff, 1.0) * unit**2, math.inf))
    return _Followed(motion, contacts, rigid=not given.any(), unit=unit).all()


class _Followed:
    """Samples of a motion, solved one after the other, from those that are assembled."""

    def __init__(self, motion: Motion, contacts: Contacts, *, rigid: bool, unit: float) -> None:
        self.motion, self.contacts, self.rigid, self.unit = motion, contacts, rigid, unit
        self.plane = Plane(motion.mechanism, np.isfinite(contacts.stiffness))
        laws = [driver.law(motion.inputs) for driver in motion.mechanism.drivers]
        self.drive, self.rates = (np.stack([law[k] for law in laws], axis=1) for k in (0, 1))
        self.out = at_rest(motion)
        self.poses, self.velocities = motion.poses.copy(), motion.velocities.copy()
        self.assembled = motion.assembled.copy()

    def all(self) -> Shifted:
        """Solve all samples that are not assembled."""
        known = np.flatnonzero(self.assembled)
        if known.size == 0:
            start = _start(self.motion.mechanism, self.motion.inputs, self.drive)
            if start is None:
                return self.out
            first, z = start[0], self.plane.state(start[1])
            self._solve(first, z)
            known = np.array([first])
        count = len(self.assembled)
        self._sweep(range(int(known[-1]) + 1, count), -1)
        self._sweep(range(int(known[0]) - 1, -1, -1), 1)
        whole = bool(self.assembled.all())
        own: Any = {"completed": True, "reason": "", "stopped_at": math.nan} if whole else {}
        parts: Any = {"poses": self.poses, "velocities": self.velocities, "assembled": self.assembled}
        return self.out._replace(motion=replace(self.motion, **parts, **own))

    def _sweep(self, samples: range, back: int) -> None:
        """Go on from sample to sample; links that come to lie in line go on as they came."""
        push: Any = 0.0
        for i in samples:
            before, again = i + back, i + 2 * back
            if not self.assembled[before]:
                return
            z = self.plane.state(self.poses[before])
            way: Any = 0.0
            if 0 <= again < len(self.assembled) and self.assembled[again]:
                way = z - self.plane.state(self.poses[again])
            self._solve(i, z + way + push)
            if i == samples[0] and self.assembled[i] and self.motion.assembled[before]:
                own = self.plane.state(self.poses[i]) - z  # the way into the line, mostly
                push = _PUSH * self.plane.Lc * own / max(float(np.abs(own).max()), 1e-300)

    def _solve(self, i: int, z: Array) -> None:
        """Least energy without clearance first, which is the place of the least shifts; then that with it."""
        given = self.plane, self.drive[i], self.rates[i]
        tight = settled(given[0], z, *given[1:], self.contacts._replace(clearance=0.0 * self.contacts.clearance))
        found = None if tight is None else self._loose(tight, given)
        if tight is None or found is None:
            self.out.blocked[i] = True
            return
        free = self._open(found)
        if self.rigid and not free:
            self.out.blocked[i] = True
            return
        self.assembled[i] = True
        self.poses[i] = self.plane.pose(found.z)
        self.velocities[i] = self.plane.pose((tight if free else found).rate)
        for k, way in self._ways(found):
            self.out.shift[i, k] = way if way > _NOTHING * self.plane.Lc else 0.0
        if not free:
            self._write(i, found)

    def _loose(self, tight: Rest, given: tuple[Any, Any, Any]) -> Rest | None:
        """With clearance, from the place of the least shifts."""
        return tight if self._open(tight) else settled(given[0], tight.z, *given[1:], self.contacts)

    def _open(self, rest: Rest) -> bool:
        """Whether no contact is pressed."""
        return all(way <= self.contacts.clearance[k] + _NOTHING * self.plane.Lc for k, way in self._ways(rest))

    def _ways(self, rest: Rest) -> list[tuple[int, float]]:
        """Return joints that may shift, and by how much they do."""
        return [(k, float(np.sqrt((rest.rows[rows] ** 2).sum()))) for k, rows in self.plane.springs.items()]

    def _write(self, i: int, found: Rest) -> None:
        """Write forces of a loaded sample, newtons; the effort of the driver is the derivative of the energy."""
        mechanism, out = self.motion.mechanism, self.out
        forces = found.forces * self.plane.length
        out.energy[i] = found.energy
        drivers = len(mechanism.drivers)
        efforts = -forces[len(forces) - drivers :]
        size = self.unit if isinstance(mechanism.joint(*mechanism.drivers[0].pair), Prismatic) else 1.0
        out.torque[i] = efforts[0] / size if drivers == 1 else efforts @ self.rates[i]
        for k, (joint, rows) in enumerate(zip(mechanism.joints, self.plane.of_joint)):
            own = forces[rows]
            if isinstance(joint, Prismatic):
                out.force[i, k, 0], out.turning[i, k] = own[0] / self.unit, abs(own[1])
            else:
                out.force[i, k, : len(own)] = own / self.unit


def _start(mechanism: Mechanism, inputs: Array, drive: Array) -> tuple[int, Array] | None:
    """Return an input at which the mechanism closes, or comes near it, and the pose: its own, or one that is found."""
    from graphsynth.kinematics.simulation import simulate

    if mechanism.pose is not None and mechanism.drivers:
        pose = np.array(mechanism.pose)
        driver = mechanism.drivers[0]
        joint = mechanism.joint(*driver.pair)
        if not isinstance(joint, Prismatic):
            angle = pose[driver.link, 2] - pose[driver.base, 2]
            return int(np.argmin(np.abs(np.sin(0.5 * (drive[:, 0] - angle))))), pose
    for i in range(0, len(inputs), max(len(inputs) // 24, 1)):
        try:
            found = simulate(mechanism, inputs[i : i + 1], events=False)
        except GeometryError:
            return None
        if found.assembled[0]:
            return i, found.poses[0]
    return None
