"""Assess any mechanism whose joints share the misalignment: least tilt, shadow prices, verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import checked
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.drawing import Tolerances, drawn
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.program import Bearings, JointProblem, check_motion, problem
from graphsynth.jamming.verdict import METHOD_CERTIFIED, Assessment, Verdict
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.jamming.joints.certify import TurnCertificate
    from graphsynth.jamming.joints.limits import Limits, Misalignment
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
METHOD_SAMPLES = "convex program at the samples, double precision, not certified"

_EXTREMES = ("worst_input", "worst_factor", "smallest_scale", "smallest_scale_input")


class Sensitivity(NamedTuple):
    """How sensitive the allowed misalignment at the worst input is to one limit.

    ``gain`` is the relative growth of the allowed misalignment per relative growth of the joint's limit ``what``
    ("tilt", "roll", "pitch" or "play"): 0.5 means that one percent more limit allows at most half a percent more
    misalignment there.  `graphsynth.jamming.joints.compare_sensitivities` solves for what it allows over the motion.
    """

    joint: tuple[int, int]
    what: str
    gain: float


@dataclass(frozen=True, eq=False, repr=False)
class CoupledReport(Assessment):
    """Result of `assess_coupled`; arrays over the n inputs, NaN where the mechanism is not assembled.

    Attributes
    ----------
    factor : ndarray, shape (n,)
        T*: the least factor on all tilt limits with which the pose can be assembled, axial clearances as they are;
        above 1 it binds, infinite if no factor helps.  Largest at ``worst_input``: ``worst_factor``.
    duality_gap : ndarray, shape (n,)
        Primal minus dual value of T*, relative: the factor is known to this (estimated: rounding only).
    allowed_scale : ndarray, shape (n,)
        Factor by which all misalignments may grow before the pose binds; below 1 where it binds, infinite if never.
        Smallest at ``smallest_scale_input``: ``smallest_scale``.
    consumption, axial_clearance_used : ndarray, shapes (n, blocks) and (n, joints)
        ``|tau| / (T* t)`` of every limit on tilt: 1 where it is used up; ``|zeta| / s`` of every joint with finite
        axial clearance.  One optimal sharing; joints that are not binding may have others.
    shadow_price, axial_shadow_price : ndarray, shapes (n, blocks) and (n, joints)
        Shadow price (dual multiplier): relative fall of T* per relative growth of the limit; positive where the limit
        is binding; the sum is 1.  The same for the axial clearances.
    names, joints : tuple
        ``((a, b), "tilt" | "roll" | "pitch")`` of the blocks; pairs ``(a, b)`` of the joints.
    sensitivities : tuple of Sensitivity
        Limits in the order of their shadow prices at ``smallest_scale_input``.
    certificate : TurnCertificate or None
        The proof, if it was asked for; verdict, reason and model are then those of the proof.
    small_tilts, small_tilt_error : str, float
        What the tables are about; the relative error of those of small tilts at the worst input (estimated from the
        exact closure there), NaN if it was not asked for or the tables are exact.
    """

    verdict: Verdict
    reason: str
    inputs: Array
    factor: Array
    duality_gap: Array
    allowed_scale: Array
    consumption: Array
    axial_clearance_used: Array
    shadow_price: Array
    axial_shadow_price: Array
    names: tuple[tuple[tuple[int, int], str], ...]
    joints: tuple[tuple[int, int], ...]
    worst_input: float
    worst_factor: float
    smallest_scale: float
    smallest_scale_input: float
    sensitivities: tuple[Sensitivity, ...]
    limits: tuple[Limits, ...]
    misalignments: tuple[Misalignment, ...]
    condition: str = "A"
    certificate: TurnCertificate | None = None
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)
    small_tilts: str = "L1 with small tilts (first order): neglects terms of relative order alpha squared"
    small_tilt_error: float = math.nan
    input_unit: str = "rad"  # empty for a driven guide

    def _figures(self) -> list[tuple[str, str]]:
        used, growth = f"used to {100.0 * self.worst_factor:.4g} %", f"may be {self.smallest_scale:.6g} times as large"
        at, by = (f"{u:.6g} {self.input_unit}".strip() for u in (self.worst_input, self.smallest_scale_input))
        rows = [("limits", f"{used} at most, at input {at}"), ("misalignments", f"{growth}, by input {by}")]
        for (a, b), what, gain in self.sensitivities[:3]:
            rows.append((f"joint {a}-{b}", f"1 % more {what} allows at most {gain:.3f} % more misalignment"))
        about = self.small_tilts.partition(":")[0]
        if not math.isnan(self.small_tilt_error):
            about = f"{about}, off by about {100.0 * self.small_tilt_error:.2g} % at that input"
        proof = [] if self.certificate is None else [("proof of", self.certificate.model.partition(":")[0])]
        return [*rows, ("figures of", about), *proof]

    @property
    def model(self) -> str:
        """What the verdict is about and what that neglects; the tables are those of small tilts."""
        return self.small_tilts if self.certificate is None else self.certificate.model

    @property
    def method(self) -> str:
        """How the verdict is known."""
        return METHOD_CERTIFIED if self.certificate is not None else METHOD_SAMPLES

    @property
    def statement(self) -> str:
        """The verdict in one sentence: what is proved, or what was found at the samples."""
        return self.reason

    @property
    def binding(self) -> NDArray[np.bool_]:
        """Limits that are binding (shadow price above 1e-9), shape (n, blocks)."""
        return np.asarray(self.shadow_price > 1e-9)

    def summary(self) -> dict[str, Any]:
        """Plain values (numbers, strings, lists) for a report or a JSON file."""
        return {
            "verdict": self.verdict.name,
            **{name: getattr(self, name) for name in ("statement", "method", "model", "condition", *_EXTREMES)},
            "small_tilt_error": None if math.isnan(self.small_tilt_error) else self.small_tilt_error,
            "largest_duality_gap": float(np.nanmax(self.duality_gap, initial=0.0)),
            "sensitivities": [one._asdict() | {"joint": list(one.joint)} for one in self.sensitivities],
            "certificate": None if self.certificate is None else self.certificate.summary(),
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def to_pandas(self) -> Any:
        """Return a table over the inputs: factor, gap, allowed scale, consumption and shadow price of every limit."""
        import pandas as pd

        columns = {"input": self.inputs, "factor": self.factor}
        columns |= {"gap": self.duality_gap, "allowed_scale": self.allowed_scale}
        for k, ((a, b), what) in enumerate(self.names):
            columns[f"consumption_{a}_{b}_{what}"] = self.consumption[:, k]
            columns[f"price_{a}_{b}_{what}"] = self.shadow_price[:, k]
        return pd.DataFrame(columns)


#: Differences from 1 below this are a matter of rounding.
_TOUCH = 1e-12


@checked
def assess_coupled(
    motion: Motion,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    certify: bool = False,
    tolerances: Tolerances = 0.0,
    seconds: float = 20.0,
) -> CoupledReport:
    """Assess whether all joints together can take up misaligned axes at every pose of a motion (model L1).

    See theory/joints-that-share-a-tilt.

    Parameters
    ----------
    motion : Motion
        Of `graphsynth.simulate`; any planar mechanism.
    bearings : Bearing, JointLimits, SlideLimits, or mapping of (link, link) to one of these
        Limits of every joint.  Gear, cam and slot contacts that are not named guide nothing out of the plane.
    tilts : Misalignment or several
        Which axes are tilted; a rigid one (a motor shaft) takes no clearance of its own.
    condition, certify : {"A", "B", "general"}, bool
        Contact condition of every `Bearing`; whether to prove the verdict between the samples too (`certify_coupled`),
        over the tolerance boxes.
    tolerances : float or iterable of PartTolerance
        For the proof: one relative tolerance of lengths, or tolerances of parts (`graphsynth.tolerances`); a fit or an
        end float among them also gives its joint the limits.
    seconds : float
        Time of the proof.

    Returns
    -------
    CoupledReport
        Estimated at the samples, with primal and dual values and their gap; with ``certify`` the verdict and the
        reason are those of the proof.  `GeometryError` for limits or misalignments that do not fit the mechanism.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming import Bearing
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.radians([0.0, 90.0, 180.0]))
    >>> report = assess_coupled(motion, Bearing(), Misalignment(0, 1, 0.012))
    >>> report.verdict.name, [round(float(f), 4) for f in report.factor]
    ('FREE_ESTIMATED', [0.9694, 0.9894, 0.7915])
    """
    begin = perf_counter()
    check_motion(motion)
    tilts = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    tolerances = tuple(tolerances) if isinstance(tolerances, Iterable) else tolerances
    limits, axes, _ = drawn(motion.mechanism, bearings, tilts, tolerances)
    report = _report(problem(motion.mechanism, limits, axes, condition), motion, condition, begin)
    if not certify or not motion.assembled.any():
        return report
    if int(motion.assembled.sum()) == 1:
        reason = "a proof needs a range of inputs; the motion has one assembled sample"
        return replace(report, verdict=Verdict.UNDECIDED, reason=reason, notes=(*report.notes, report.reason))
    from graphsynth.jamming.joints.certify import certify_coupled

    options: Any = {"condition": condition, "tolerances": tolerances, "seconds": seconds}
    proof = certify_coupled(motion, bearings, tilts, **options)
    # where nothing is proved, what the samples say is still worth reading
    notes = (*report.notes, f"at the samples: {report.reason}") if proof.verdict is Verdict.UNDECIDED else report.notes
    changes: Any = {"verdict": proof.verdict, "reason": proof.reason, "notes": notes, "certificate": proof}
    return replace(report, **changes, seconds=perf_counter() - begin)


def _report(given: JointProblem, motion: Motion, condition: Condition, begin: float) -> CoupledReport:
    """Assess at the samples."""
    keep = np.flatnonzero(motion.assembled)
    layout, tilt = given.layout, given.solve(motion.poses[keep])
    played = np.isfinite(layout.end_float) & (layout.end_float > 0.0)  # without any both factors are one
    scale = given.solve(motion.poses[keep], "scale") if played.any() else tilt

    def spread(values: Array) -> Array:
        """Repeat for all inputs; NaN where the mechanism is not assembled."""
        full = np.full((len(motion.inputs), *values.shape[1:]), np.nan)
        full[keep] = values
        return full

    with np.errstate(all="ignore"):
        gap = np.where(tilt.upper > tilt.lower, (tilt.upper - tilt.lower) / tilt.upper, 0.0)
        allowed = np.where(scale.lower > 0.0, 1.0 / scale.lower, math.inf)
        lean = np.hypot(tilt.tau[..., 0], tilt.tau[..., 1])
        used = np.where(layout.limit > 0.0, lean / (tilt.lower[:, None] * layout.limit), 0.0)
        slip = np.where(played, np.abs(tilt.zeta) / layout.end_float, 0.0)
    used = np.where(tilt.lower[:, None] > 0.0, used, 0.0)
    verdict, reason = _verdict(scale.lower, motion, keep)
    inputs, rows, notes = motion.inputs[keep], [], []
    worst_input = worst_factor = smallest_scale = smallest_scale_input = math.nan
    if keep.size:
        worst, tight = int(np.argmax(tilt.lower)), int(np.argmin(allowed))
        worst_input, worst_factor = float(inputs[worst]), float(tilt.lower[worst])
        smallest_scale_input, smallest_scale = float(inputs[tight]), float(allowed[tight])
        rows = [Sensitivity(*name, float(scale.moment[tight, k])) for k, name in enumerate(given.names)]
        rows += [Sensitivity(pair, "play", float(scale.force[tight, k])) for k, pair in enumerate(given.pairs)]
    if layout.loops == 0:
        notes.append("no closed loop of guided joints: nothing can bind")
    if keep.size < len(motion.inputs):
        notes.append(f"{len(motion.inputs) - keep.size} samples are not assembled: {motion.reason}")
    return CoupledReport(
        verdict=verdict,
        reason=reason,
        inputs=motion.inputs,
        factor=spread(tilt.lower),
        duality_gap=spread(gap),
        allowed_scale=spread(allowed),
        consumption=spread(used),
        axial_clearance_used=spread(slip),
        shadow_price=spread(tilt.moment),
        axial_shadow_price=spread(tilt.force),
        names=given.names,
        joints=given.pairs,
        worst_input=worst_input,
        worst_factor=worst_factor,
        smallest_scale=smallest_scale,
        smallest_scale_input=smallest_scale_input,
        sensitivities=tuple(sorted((row for row in rows if row.gain > 1e-9), key=lambda row: -row.gain)),
        limits=given.limits,
        misalignments=given.misalignments,
        condition=condition,
        notes=tuple(notes),
        seconds=perf_counter() - begin,
        input_unit="" if isinstance(motion.mechanism.joint(*motion.mechanism.drivers[0].pair), Prismatic) else "rad",
    )


def _verdict(value: Array, motion: Motion, keep: NDArray[np.intp]) -> tuple[Verdict, str]:
    if keep.size == 0:
        return Verdict.CANNOT_ASSEMBLE, f"no sample is assembled: {motion.reason}"
    jammed = value > 1.0 + _TOUCH
    if jammed.any():
        return Verdict.JAMMED_ESTIMATED, f"binds at {int(jammed.sum())} of {keep.size} samples (estimated)"
    if (value >= 1.0 - _TOUCH).any():
        return Verdict.TOUCHING_ESTIMATED, "no clearance is left at one sample or more (estimated)"
    if not motion.completed:
        return Verdict.FREE_ESTIMATED, f"free at {keep.size} samples; the motion ends: {motion.reason}"
    return Verdict.FREE_ESTIMATED, f"free at all {keep.size} samples (estimated)"
