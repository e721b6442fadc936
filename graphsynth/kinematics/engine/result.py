"""The result of a simulation: arrays over the inputs, branch identity, events, closure, errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import link_number, point
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.methods import GroupSamples, MotionMethods
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.program import Step
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


class MotionEvent(NamedTuple):
    """Something that happens at one input.

    ``kind`` is "fold" (two assembly modes of a group merge and end), "change point" (two modes meet and both go on),
    "near fold" (two modes nearly meet; the motion goes on), "escape" (a link moves off to infinity), "singular" (a
    group is not held, or the centres of a gear pair coincide), "not assembled", "dead centre" (the coordinate of a
    joint on the frame reverses), "dwell" (it stands still and goes on in the same sense), or "input" (the driver has no
    value).  ``order`` is the number of modes that meet (0: not known), or of a dead centre or dwell the first
    derivative that does not vanish.
    ``group`` is the index of the Assur group, -1 for none; ``links`` those concerned; ``uncertainty`` the estimated
    error of ``input``; ``ends_motion`` tells whether the branch ends there.
    """

    kind: str
    input: float
    group: int
    links: tuple[int, ...]
    order: int
    uncertainty: float
    ends_motion: bool
    statement: str


class Closure(NamedTuple):
    """Whether the mechanism returns to its first pose after the driver has turned fully.

    ``tested`` is False if the inputs are no full turn or the motion is incomplete; ``error`` is the largest
    distance of link poses after one pass over the inputs, over the characteristic length; ``period`` the number of
    passes until closure, 0 if none was found; ``changed`` the groups that are elsewhere after one pass.
    """

    tested: bool
    closed: bool
    error: float
    period: int
    changed: tuple[int, ...]
    statement: str


class PointPath(NamedTuple):
    """A point of a link: positions, first and second derivatives by the input, each (inputs, 2)."""

    position: Array
    velocity: Array
    acceleration: Array

    def straightness(self) -> float:
        """Largest distance of the sampled points from the chord between the first and the last (NaN left out).

        `GeometryError` for a path without two different ends.
        """
        p = self.position[np.isfinite(self.position).all(axis=1)]
        if len(p) < 2 or not (p[-1] - p[0]).any():
            raise GeometryError("straightness needs a path with two different ends; choose other inputs")
        chord = p[-1] - p[0]
        return float(np.abs(chord[0] * (p[:, 1] - p[0, 1]) - chord[1] * (p[:, 0] - p[0, 0])).max() / np.hypot(*chord))


@dataclass(frozen=True, eq=False, repr=False)
class Motion(MotionMethods):
    """One branch of a mechanism over the inputs (estimated: floating point; NaN where the branch does not reach).

    Attributes
    ----------
    mechanism : Mechanism
    inputs : ndarray, shape (n,)
    poses, velocities, accelerations : ndarray, shape (n, links, 3)
        ``(x, y, theta)`` of every link, theta continuous, and derivatives by the input.
    modes : ndarray of int8, shape (n, groups)
        +1 or -1: the assembly mode of a dyad, the sign of the determinant of a larger group; 0 for a group with one
        mode, and where the branch does not reach.
    margins : ndarray, shape (n, groups)
        Distance to singularity: of a dyad the square of the sine of the angle at the joint that closes it (0 when
        stretched or folded); of a larger group the determinant of its reduced system with the length ``Lc``.
    assembled : ndarray of bool, shape (n,)
    steps : tuple of Step
        Drivers and groups in the order of assembly.
    events : tuple of MotionEvent
        In the order of the motion.
    completed : bool
        All inputs were reached.
    reason : str
        Why the motion is not complete; empty if it is.
    stopped_at : float
        Input at which it stops; NaN if complete.
    closure : Closure
    Lc : float
        Characteristic length.
    seconds : float
        Run time.
    """

    mechanism: Mechanism
    inputs: Array
    poses: Array
    velocities: Array
    accelerations: Array
    modes: NDArray[np.int8]
    margins: Array
    assembled: NDArray[np.bool_]
    steps: tuple[Step, ...]
    events: tuple[MotionEvent, ...]
    completed: bool
    reason: str
    stopped_at: float
    closure: Closure
    Lc: float
    seconds: float

    @cached_property
    def residuals(self) -> Array:
        """Largest violation of the joints' own equations at every sample, over ``Lc``; shape (n,)."""
        return np.asarray(np.abs(residual(self.mechanism.joints, self.poses)).max(axis=1, initial=0.0) / self.Lc)

    @property
    def residual(self) -> float:
        """Largest of `residuals` over the samples reached; NaN if there are none."""
        found = self.residuals[self.assembled]
        return float(found.max()) if found.size else float("nan")

    @cached_property
    def errors(self) -> Array:
        """Estimated error of the poses at every sample, over ``Lc``; shape (n,).

        Norm of the inverse constraint matrix times (residual + 4 units of rounding of the largest coordinate): first
        order, so it is an estimate, and infinite at a singular pose.
        """
        size = np.abs(self.poses[:, :, :2]).max(axis=(1, 2)) / self.Lc
        unit = np.finfo(np.float64).eps
        with np.errstate(divide="ignore"):
            return np.asarray((self.residuals + 4.0 * unit * np.maximum(size, 1.0)) / self.singularity_distance)

    @cached_property
    def singularity_distance(self) -> Array:
        """Smallest singular value of the constraint matrix with the drivers held, at every sample; shape (n,).

        Rows and unknowns are in units of ``Lc`` and radians, so the size of the mechanism does not matter; 0 at a
        singular pose, NaN where the branch does not reach.
        """
        found = np.full(len(self.inputs), np.nan)
        if not self.assembled.any():
            return found
        mechanism = self.mechanism
        links, poses = mechanism.graph.links, self.poses[self.assembled]
        held = np.zeros((len(poses), len(mechanism.drivers), 3 * links))
        for k, driver in enumerate(mechanism.drivers):
            joint = mechanism.joint(*driver.pair)
            if isinstance(joint, Prismatic):
                t = poses[:, joint.a, 2] + joint.angle_a
                for link, sign in ((joint.a, -1.0), (joint.b, 1.0)):
                    held[:, k, 3 * link], held[:, k, 3 * link + 1] = sign * np.cos(t), sign * np.sin(t)
            else:
                held[:, k, 3 * driver.link + 2], held[:, k, 3 * driver.base + 2] = 1.0, -1.0
        moving = [3 * k + c for k in range(links) if k != mechanism.frame for c in range(3)]
        # every row in lengths: second rows of P joints and turning drivers are angles
        angular: list[bool] = []
        for joint in mechanism.joints:
            angular += [False, isinstance(joint, Prismatic)] if joint.mobility == 1 else [False]
        angular += [not isinstance(mechanism.joint(*driver.pair), Prismatic) for driver in mechanism.drivers]
        size = np.where(angular, self.Lc, 1.0)
        matrix = np.concatenate([jacobian(mechanism.joints, poses), held], axis=1)[:, :, moving] * size[:, None]
        matrix = matrix * np.tile([1.0, 1.0, 1.0 / self.Lc], links)[moving]
        found[self.assembled] = np.linalg.svd(matrix, compute_uv=False)[:, -1]
        return found

    def point(self, name_or_link: str | int, local: ArrayLike | None = None) -> PointPath:
        """Path of a named point, or of the point ``local`` (x, y) of a link, with derivatives by the input.

        `GeometryError` for a name or a link that the mechanism does not have.
        """
        if isinstance(name_or_link, str):
            if name_or_link not in self.mechanism.points:
                known = ", ".join(self.mechanism.points) or "none"
                raise GeometryError(f"point {name_or_link!r} is not defined; the mechanism has {known}")
            link, at = self.mechanism.points[name_or_link]
        else:
            link = link_number("link of the point", name_or_link)
            if link >= self.mechanism.graph.links:
                raise GeometryError(f"link {link} does not exist; the links are 0..{self.mechanism.graph.links - 1}")
            at = point("local", (0.0, 0.0) if local is None else local)
        pose, v, w = self.poses[:, link], self.velocities[:, link], self.accelerations[:, link]
        arm = np.exp(1j * pose[:, 2]) * complex(*at)
        P = pose[:, 0] + 1j * pose[:, 1] + arm
        P1 = v[:, 0] + 1j * v[:, 1] + 1j * v[:, 2] * arm
        P2 = w[:, 0] + 1j * w[:, 1] + (1j * w[:, 2] - v[:, 2] ** 2) * arm
        return PointPath(*(np.column_stack([z.real, z.imag]) for z in (P, P1, P2)))

    def transmission_angle(self) -> GroupSamples:
        """Transmission angle of every dyad with two modes, by group, radians in [0, pi/2].

        The sine of the angle is the square root of the margin: the angle at the inner joint of RRR; of RRP, RPR and
        PRR the angle between the link (or the line from pivot to pin) and the normal of the guide.  0 where the dyad
        is stretched or folded.
        """
        groups = [step.group for step in self.steps if step.group >= 0 and step.has_two_modes]
        return GroupSamples((group, np.arcsin(np.sqrt(np.clip(self.margins[:, group], 0, 1)))) for group in groups)

    def pressure_angle(self) -> GroupSamples:
        """Pressure angle of every dyad with two modes, by group: the complement of the transmission angle."""
        return GroupSamples((group, 0.5 * np.pi - angle) for group, angle in self.transmission_angle().items())

    def to_pandas(self) -> Any:
        """Return a table: input, pose, velocity and acceleration of every moving link, modes, residual, error."""
        import pandas as pd

        columns: dict[str, Any] = {"input": self.inputs, "assembled": self.assembled}
        for link in range(self.mechanism.graph.links):
            if link == self.mechanism.frame:
                continue
            for name, array in (("", self.poses), ("d_", self.velocities), ("dd_", self.accelerations)):
                for axis, label in enumerate(("x", "y", "theta")):
                    columns[f"{name}{label}_{link}"] = array[:, link, axis]
        for group in range(self.modes.shape[1]):
            columns[f"mode_{group}"] = self.modes[:, group]
            columns[f"margin_{group}"] = self.margins[:, group]
        columns["residual"], columns["error"] = self.residuals, self.errors
        return pd.DataFrame(columns)
