"""What an assessment of the coupled model says: tables over the inputs, margins, prices, the proof if asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.verdict import METHOD_CERTIFIED, Verdict

if TYPE_CHECKING:
    from graphsynth.jamming.joints.limits import Limits, Misalignment
    from graphsynth.jamming.joints.turn import TurnCertificate

__all__ = ["CoupledReport", "Loosen"]

Array = NDArray[np.float64]

METHOD_SAMPLES = "convex program at the samples, double precision, not certified"


class Loosen(NamedTuple):
    """What loosening one joint gains at the worst input.

    ``gain`` is the relative growth of the allowed misalignment per relative growth of the joint's limit ``what``
    ("tilt", "roll", "pitch" or "play"): 0.5 means that one percent more limit allows at most half a percent more
    misalignment there.  `graphsynth.jamming.joints.compare_loosening` solves for what it allows over the motion.
    """

    joint: tuple[int, int]
    what: str
    gain: float


@dataclass(frozen=True, eq=False)
class CoupledReport:
    """Result of `assess_coupled`; arrays over the n inputs, NaN where the mechanism is not assembled.

    Attributes
    ----------
    verdict : Verdict
    reason : str
        One sentence.
    inputs : ndarray, shape (n,)
    factor : ndarray, shape (n,)
        T*: the least factor on all tilt limits with which the pose can be assembled, plays as they are; above 1 it
        jams, infinite if no factor helps.
    gap : ndarray, shape (n,)
        Primal minus dual value of T*, relative: the factor is known to this (estimated: rounding only).
    allowed_scale : ndarray, shape (n,)
        Factor by which all misalignments may grow before the pose jams; below 1 where it jams, infinite if never.
    consumption : ndarray, shape (n, blocks)
        ``|tau| / (T* t)`` of every limit on tilt: 1 where it is used up.  One optimal sharing; joints that are not
        binding may have others.
    play_used : ndarray, shape (n, joints)
        ``|zeta| / s`` of every joint with finite play.
    price : ndarray, shape (n, blocks)
        Dual price: relative fall of T* per relative growth of the limit; positive where the limit is binding; the
        sum is 1.
    play_price : ndarray, shape (n, joints)
        Fall of T* per relative growth of the axial play.
    names, joints : tuple
        ``((a, b), "tilt" | "roll" | "pitch")`` of the blocks; pairs ``(a, b)`` of the joints.
    worst_input, worst_factor : float
        Where T* is largest among the samples, and its value there.
    smallest_scale : float
        Smallest of ``allowed_scale``, and ``smallest_scale_input`` where.
    loosen : tuple of Loosen
        Limits in the order of what loosening them gains at ``smallest_scale_input``.
    limits, misalignments : tuple
        As used.
    certificate : TurnCertificate or None
        The proof, if it was asked for.
    notes : tuple of str
    seconds : float
    """

    verdict: Verdict
    reason: str
    inputs: Array
    factor: Array
    gap: Array
    allowed_scale: Array
    consumption: Array
    play_used: Array
    price: Array
    play_price: Array
    names: tuple[tuple[tuple[int, int], str], ...]
    joints: tuple[tuple[int, int], ...]
    worst_input: float
    worst_factor: float
    smallest_scale: float
    smallest_scale_input: float
    loosen: tuple[Loosen, ...]
    limits: tuple[Limits, ...]
    misalignments: tuple[Misalignment, ...]
    condition: str = "A"
    certificate: TurnCertificate | None = None
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)
    small_tilts: str = "L1 with small tilts (first order): neglects terms of relative order alpha squared"

    @property
    def model(self) -> str:
        """What the verdict is about and what that neglects; the tables are those of small tilts."""
        return self.small_tilts if self.certificate is None else self.certificate.model

    @property
    def method(self) -> str:
        """How the verdict was had."""
        return METHOD_CERTIFIED if self.certificate is not None else METHOD_SAMPLES

    @property
    def statement(self) -> str:
        """The verdict in one sentence: what is proved, or what was found at the samples."""
        return self.reason

    @property
    def binding(self) -> NDArray[np.bool_]:
        """Limits that are binding (price above 1e-9), shape (n, blocks)."""
        return np.asarray(self.price > 1e-9)

    def summary(self) -> dict[str, Any]:
        """Plain values (numbers, strings, lists) for a report or a JSON file."""
        return {
            "verdict": self.verdict.name,
            "statement": self.statement,
            "method": self.method,
            "model": self.model,
            "condition": self.condition,
            "worst_input": self.worst_input,
            "worst_factor": self.worst_factor,
            "smallest_scale": self.smallest_scale,
            "smallest_scale_input": self.smallest_scale_input,
            "largest_gap": float(np.nanmax(self.gap, initial=0.0)),
            "loosen": [{"joint": list(one.joint), "what": one.what, "gain": one.gain} for one in self.loosen],
            "certificate": None if self.certificate is None else self.certificate.summary(),
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def to_pandas(self) -> Any:
        """Return a table over the inputs: factor, gap, allowed scale, and consumption and price of every limit."""
        import pandas as pd

        columns: dict[str, Array] = {
            "input": self.inputs, "factor": self.factor, "gap": self.gap, "allowed_scale": self.allowed_scale,
        }  # fmt: skip
        for k, ((a, b), what) in enumerate(self.names):
            columns[f"consumption_{a}_{b}_{what}"] = self.consumption[:, k]
            columns[f"price_{a}_{b}_{what}"] = self.price[:, k]
        return pd.DataFrame(columns)
