"""Checking stored evaluations: dimensions turned anew, transmission by its definition, verdicts proved again."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.atlas.evaluating import VERDICTS, jamming_proof, motion_of, turn_is_proved
from graphsynth.atlas.references import Reference
from graphsynth.atlas.stored import TIED, data_of, fingerprint

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

#: ``same(field, where, stored, recomputed)``
Same = Callable[[str, str, Any, Any], None]

_ANGLE = 1e-6  # radians

_DIRECTIONS, _SAMPLES = 4, 13


def recheck(connection: sqlite3.Connection, same: Same, number: int, reference: Reference) -> None:
    """Compare all that is stored of the mechanisms of a chain and can be recomputed.

    Dimensions of status ``'found'``, the transmission that belongs to them, and verdicts that name their question.
    """
    stored: dict[tuple[int, int | str], dict[str, tuple[Any, ...]]] = {}
    for frame, driver, kind, *rest in connection.execute(
        "SELECT frame, driver, kind, status, value, unit, guarantee, data FROM evaluations WHERE chain_id = ?",
        (number,),
    ):
        stored.setdefault((frame, driver), {})[kind] = tuple(rest)
    for (frame, driver), kinds in stored.items():
        status, _, _, guarantee, text = kinds.get("dimensions", ("", None, None, None, None))
        if status == "found":
            drivers = tuple(int(link) for link in str(driver).split(","))
            where = f"chain {number}, frame {frame}, driver {driver}"
            _Recheck(same, where, reference, frame, drivers, data_of(text)).run(guarantee, kinds)


class _Recheck:
    """One mechanism with dimensions."""

    def __init__(
        self, same: Same, where: str, reference: Reference, frame: int, drivers: tuple[int, ...], data: dict[str, Any]
    ) -> None:
        from graphsynth.mechanism.model import Mechanism

        self._same, self.where, self.reference, self.right = same, where, reference, True
        self.frame, self.drivers, self.data = frame, drivers, data
        self.mechanism: Mechanism = Mechanism.from_json(json.dumps(data["mechanism"]))

    def same(self, field: str, where: str, stored: Any, wanted: Any) -> None:
        """Compare; proofs are not repeated for dimensions that are wrong."""
        self.right = self.right and stored == wanted
        self._same(field, where, stored, wanted)

    def run(self, guarantee: str | None, kinds: dict[str, tuple[Any, ...]]) -> None:
        """Compare dimensions, transmission and verdict."""
        pairs = sorted(joint.pair for joint in self.mechanism.joints)
        wanted = sorted((min(pair), max(pair)) for pair in self.reference.graph.edges)
        self.same("evaluations: graph of the dimensions", self.where, pairs, wanted)
        self.same("evaluations: frame of the dimensions", self.where, self.mechanism.frame, self.frame)
        self._turn(kinds.get("transmission"))
        places: dict[int, list[list[float]]] = {}
        for joint in self.data["mechanism"]["joints"]:
            places.setdefault(joint["a"], []).append(joint["at_a"])
            places.setdefault(joint["b"], []).append(joint["at_b"])
        lengths = [math.dist(p, q) for own in places.values() for p, q in combinations(own, 2)]
        ratio = max(lengths) / min(lengths)
        self._close("length ratio", self.data["length_ratio"], ratio, 1e-9 * ratio)
        inside = ratio <= float(self.data["goals"]["max_length_ratio"]) * (1.0 + 1e-6)
        self.same("evaluations: length ratio in bounds", self.where, inside, True)
        if guarantee == "certified" and self.right and find_spec("flint") is not None:
            proved = turn_is_proved(motion_of(self.mechanism, 721))
            self.same("evaluations: turn proved", self.where, proved, True)
        named = fingerprint(self.data["mechanism"])
        for kind in TIED:  # results that name their dimensions name these
            data = data_of(kinds[kind][4]) if kind in kinds and kinds[kind][4] else None
            if isinstance(data, dict) and "dimensions" in data:
                self.same(f"evaluations: dimensions of {kind}", self.where, data["dimensions"], named)
        jamming = kinds.get("jamming")
        if self.right and jamming is not None and jamming[4] is not None:
            self._jamming(jamming[0], jamming[3], data_of(jamming[4]))

    def _close(self, field: str, stored: Any, wanted: float, tolerance: float) -> None:
        """Compare numbers that two programs round differently."""
        near = isinstance(stored, float) and abs(stored - wanted) <= tolerance
        self.same(f"evaluations: {field}", self.where, stored if not near else wanted, wanted)

    def _turn(self, transmission: tuple[Any, ...] | None) -> None:
        """Turn by Newton's method on all joints at once, and measure the transmission on the way."""
        try:
            turning = Turning(self.data["mechanism"], self.frame, self.drivers)
            poses = turning.turn()
        except (ValueError, np.linalg.LinAlgError) as error:
            self.same("evaluations: dimensions turn", self.where, str(error), "")
            return
        self.same("evaluations: dimensions turn", self.where, "", "")
        groups = self.reference.members(self.frame, self.drivers)
        if transmission is not None and groups is not None:
            angle = turning.transmission(poses, groups)
            self._close("transmission", transmission[1], angle, _ANGLE)
            self.same("evaluations: unit of transmission", self.where, transmission[2], "rad")
            inside = angle >= float(self.data["goals"]["min_transmission_angle"]) - _ANGLE
            self.same("evaluations: transmission in bounds", self.where, inside, True)

    def _jamming(self, status: str, guarantee: str | None, question: dict[str, Any]) -> None:
        """Prove the verdict again; what is free must also be free in samples, by optimisation."""
        from graphsynth.jamming.joints import JointLimits, Misalignment, assess_coupled

        if "tilt" not in question or "joint_limit" not in question:
            return
        tilt, limit = question["tilt"], question["joint_limit"]
        proof = jamming_proof(self.mechanism, tilt, limit)
        wanted = VERDICTS.get(proof.verdict.name, ("undecided", None))
        self.same("evaluations: jamming", self.where, (status, guarantee), wanted)
        if status == "free":
            driver, motion = self.mechanism.drivers[0], motion_of(self.mechanism, _SAMPLES)
            directions = (k * math.pi / _DIRECTIONS for k in range(_DIRECTIONS))
            motors = (Misalignment(driver.base, driver.link, tilt, direction=angle) for angle in directions)
            factors = (assess_coupled(motion, JointLimits(limit), motor).factor for motor in motors)
            free = all((factor <= 1.0 + 1e-9).all() for factor in factors)
            self.same("evaluations: free in samples", self.where, free, True)


Array = NDArray[np.float64]

#: Steps of a turn: half a degree, the grid of :mod:`graphsynth.kinematics.dimensional.verify`.
_STEPS, _STRIDE = 720, 10
_ITERATIONS = 30
#: Largest gap of a joint over the largest length, and largest change of an angle within a step, radians.
_GAP, _JUMP = 1e-11, 0.1


class Turning:
    """A mechanism of revolute joints, as its JSON document gives it.

    ``document`` is what :meth:`graphsynth.Mechanism.to_json` writes: R joints, and linear drivers that follow the
    input; ``drivers`` are the driven links, jointed to the frame. A `ValueError` refuses other drivers, joints, laws.
    """

    def __init__(self, document: dict[str, Any], frame: int, drivers: tuple[int, ...]) -> None:
        joints, laws = document["joints"], document["drivers"]
        if any(joint["kind"] != "R" for joint in joints):
            raise ValueError("only revolute joints are recomputed")
        if sorted((own["base"], own["link"]) for own in laws) != [(frame, link) for link in sorted(drivers)]:
            raise ValueError(f"the mechanism is not driven by the links {drivers} on frame {frame}")
        if any(own["law"]["kind"] != "linear" or own["law"]["rate"] != 1.0 for own in laws):
            raise ValueError("only drivers that follow the input are recomputed")
        self.frame = frame
        self.driven = np.array([own["link"] for own in laws])
        self.offsets = np.array([float(own["law"]["offset"]) for own in laws])
        self.ends = np.array([(joint["a"], joint["b"]) for joint in joints])
        self.arms = np.array([(joint["at_a"], joint["at_b"]) for joint in joints], float)
        self.start = np.array(document["pose"], float)
        self.size = float(np.abs(self.arms).max())

    def _turned(self, pose: Array) -> Array:
        """Arms from the origins of their links to the joints, turned with the links; shape (..., joints, 2, 2)."""
        angle = pose[..., self.ends, 2]
        c, s, x, y = np.cos(angle), np.sin(angle), self.arms[..., 0], self.arms[..., 1]
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)

    def residual(self, pose: Array, u: Array) -> Array:
        """Gaps of all joints, the frame at rest, and the drivers at the inputs, for poses of shape (n, links, 3)."""
        points = pose[:, self.ends, :2] + self._turned(pose)
        gaps = (points[..., 0, :] - points[..., 1, :]).reshape(len(pose), -1)
        angles = pose[:, self.driven, 2] - pose[:, [self.frame], 2] - self.offsets - u[:, None]
        return np.concatenate([gaps, pose[:, self.frame], angles], axis=1)

    def jacobian(self, pose: Array) -> Array:
        """Differentiate the residual by (x, y, theta) of every link, for poses of shape (..., links, 3)."""
        *many, links, _ = pose.shape
        arms, count = self._turned(pose), len(self.ends)
        found = np.zeros((*many, 2 * count + 3 + len(self.driven), 3 * links))
        x, y = 2 * np.arange(count), 2 * np.arange(count) + 1
        for side, sign in ((0, 1.0), (1, -1.0)):
            column = 3 * self.ends[:, side]
            found[..., x, column] = found[..., y, column + 1] = sign
            found[..., x, column + 2] = -sign * arms[..., :, side, 1]
            found[..., y, column + 2] = sign * arms[..., :, side, 0]
        base = 3 * self.frame
        found[..., 2 * count + np.arange(3), base + np.arange(3)] = 1.0
        row = 2 * count + 3 + np.arange(len(self.driven))
        found[..., row, 3 * self.driven + 2] = 1.0
        found[..., row, base + 2] = -1.0
        return found

    def assembled(self, pose: Array, u: Array) -> Array:
        """Solve for the poses at inputs, from poses close to them, shape (n, links, 3).

        Raises `ValueError` if the joints cannot be closed.
        """
        bound = _GAP * max(1.0, self.size)
        for _ in range(_ITERATIONS):
            gap = self.residual(pose, u)
            worst = np.abs(gap).max(axis=1)
            if worst.max() <= bound:
                return pose
            pose = pose - np.linalg.solve(self.jacobian(pose), gap[..., None]).reshape(pose.shape)
        raise ValueError(f"the joints do not close at the input {u[int(worst.argmax())]:.4f}")

    def turn(self) -> Array:
        """Return the poses of a full turn of all drivers, shape (721, links, 3).

        Every fifth degree is reached from the one before, the poses between from their neighbours.

        Raises `ValueError` if a joint opens, a link jumps, or the last pose is not the first.
        """
        coarse = np.linspace(0.0, math.tau, _STEPS // _STRIDE + 1)
        found = [self.assembled(self.start[None], coarse[:1])[0]]
        for u in coarse[1:]:
            found.append(self.assembled(found[-1][None], np.array([u]))[0])
        poses, u = np.array(found), np.linspace(0.0, math.tau, _STEPS + 1)
        part = (np.arange(_STEPS) % _STRIDE / _STRIDE)[:, None, None]
        first, second = np.repeat(poses[:-1], _STRIDE, axis=0), np.repeat(poses[1:], _STRIDE, axis=0)
        poses = np.concatenate([self.assembled((1.0 - part) * first + part * second, u[:-1]), poses[-1:]])
        steps = np.abs(np.diff(poses[..., 2], axis=0)).max(axis=1)
        if not steps.max() < _JUMP:
            raise ValueError(f"a link jumps behind the input {u[int(steps.argmax())]:.4f}")
        change = poses[-1] - poses[0]
        change[:, 2] -= math.tau * np.round(change[:, 2] / math.tau)
        if not np.abs(change).max() < 1e-8 * max(1.0, self.size):
            raise ValueError("the mechanism does not come back to its first pose after the turn")
        return np.asarray(poses, np.float64)

    def transmission(self, poses: Array, groups: Sequence[set[int]]) -> float:
        """Smallest transmission angle over poses and bars, radians; pi/2 without bars.

        A bar is a link with two joints in its group.  Let it grow at unit rate while the drivers rest: its ends part
        with a velocity w that is 1 along the bar, and sin mu = 1 / |w|; for a dyad mu is the angle of its links.

        ``poses`` have shape (n, links, 3); ``groups``: links of the groups in the order of assembly.
        """
        inverse = np.asarray(np.linalg.inv(self.jacobian(poses)), np.float64)
        arms = self._turned(poses)
        least = 1.0
        placed = {self.frame, *map(int, self.driven)}
        for group in groups:
            placed |= group
            for link in group:
                joints = [k for k, pair in enumerate(self.ends) if link in pair and set(map(int, pair)) <= placed]
                if len(joints) == 2:
                    least = min(least, float(self._sines(inverse, arms, link, joints).min()))
        return math.asin(least)

    def _sines(self, inverse: Array, arms: Array, link: int, joints: list[int]) -> Array:
        """Sine of the transmission angle of a bar at every pose."""
        first, second = ((k, 0 if self.ends[k, 0] == link else 1) for k in joints)
        along = arms[:, second[0], second[1]] - arms[:, first[0], first[1]]
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        sign = 1.0 if second[1] == 0 else -1.0
        rows = inverse[:, :, 2 * second[0] : 2 * second[0] + 2]
        velocity = -sign * np.einsum("nij,nj->ni", rows, along)

        def at(k: int, side: int) -> Array:
            """Velocity of the joint as a point of the other link."""
            own, arm = 3 * int(self.ends[k, 1 - side]), arms[:, k, 1 - side]
            turning: Array = velocity[:, own + 2, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
            return np.asarray(turning + velocity[:, own : own + 2], np.float64)

        return np.asarray(1.0 / np.maximum(np.linalg.norm(at(*second) - at(*first), axis=-1), 1.0), np.float64)
