"""Checking stored evaluations: dimensions turned anew, transmission by its definition, verdicts proved again."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Callable
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.atlas.evaluating import VERDICTS, jamming_proof, motion_of, turn_is_proved
from graphsynth.atlas.references import Reference
from graphsynth.atlas.stored import TIED, data_of, fingerprint
from graphsynth.atlas.turning import Turning

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
        ratio = _length_ratio(self.data["mechanism"]["joints"])
        self._close("length ratio", self.data["length_ratio"], ratio, 1e-9 * ratio)
        self.same(
            "evaluations: length ratio in bounds", self.where, ratio <= self._goal("max_length_ratio", 1e-6), True
        )
        if guarantee == "certified" and self.right and _has_flint():
            proved = turn_is_proved(motion_of(self.mechanism, 721))
            self.same("evaluations: turn proved", self.where, proved, True)
        self._ties(kinds)
        jamming = kinds.get("jamming")
        if self.right and jamming is not None and jamming[4] is not None:
            self._jamming(jamming[0], jamming[3], data_of(jamming[4]))

    def _ties(self, kinds: dict[str, tuple[Any, ...]]) -> None:
        """Results that name their dimensions name these."""
        named = fingerprint(self.data["mechanism"])
        for kind in TIED:
            data = data_of(kinds[kind][4]) if kind in kinds and kinds[kind][4] else None
            if isinstance(data, dict) and "dimensions" in data:
                self.same(f"evaluations: dimensions of {kind}", self.where, data["dimensions"], named)

    def _goal(self, name: str, slack: float) -> float:
        return float(self.data["goals"][name]) * (1.0 + slack)

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
            inside = angle >= self._goal("min_transmission_angle", 0.0) - _ANGLE
            self.same("evaluations: transmission in bounds", self.where, inside, True)

    def _jamming(self, status: str, guarantee: str | None, question: dict[str, Any]) -> None:
        """Prove the verdict again; what is free must also be free in samples, by optimisation."""
        if "tilt" not in question or "joint_limit" not in question:
            return
        tilt, limit = question["tilt"], question["joint_limit"]
        proof = jamming_proof(self.mechanism, tilt, limit)
        wanted = VERDICTS.get(proof.verdict.name, ("undecided", None))
        self.same("evaluations: jamming", self.where, (status, guarantee), wanted)
        if status == "free":
            self.same("evaluations: free in samples", self.where, self._free_in_samples(tilt, limit), True)

    def _free_in_samples(self, tilt: float, limit: float) -> bool:
        from graphsynth.jamming.joints import JointLimits, Misalignment, assess_coupled

        driver = self.mechanism.drivers[0]
        motion = motion_of(self.mechanism, _SAMPLES)
        for k in range(_DIRECTIONS):
            motor = Misalignment(driver.base, driver.link, tilt, direction=k * math.pi / _DIRECTIONS)
            if not (assess_coupled(motion, JointLimits(limit), motor).factor <= 1.0 + 1e-9).all():
                return False
        return True


def _length_ratio(joints: list[dict[str, Any]]) -> float:
    """Longest over shortest distance of two joints on one link."""
    places: dict[int, list[list[float]]] = {}
    for joint in joints:
        places.setdefault(joint["a"], []).append(joint["at_a"])
        places.setdefault(joint["b"], []).append(joint["at_b"])
    lengths = [math.dist(p, q) for own in places.values() for p, q in combinations(own, 2)]
    return max(lengths) / min(lengths)


def _has_flint() -> bool:
    from importlib.util import find_spec

    return find_spec("flint") is not None
