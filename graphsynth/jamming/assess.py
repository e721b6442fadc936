"""Assess jamming: one tilted bearing of a linkage over a full rotation, or all joints of a mechanism over a motion."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.arcs import JamArcs, covers, jam_arcs
from graphsynth.jamming.bearing.areas import CrescentAreas, lid_area, rim_area, surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.limits import Limit, largest_misalignment, smallest_clearance
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.questions import asked, is_exact
from graphsynth.jamming.verdict import METHOD_CERTIFIED, METHOD_CLOSED_FORM, Assessment, Verdict
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.rotatability import FullTurn

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.jamming.bearing.certify import JamCertificate
    from graphsynth.jamming.joints.assess import CoupledReport
    from graphsynth.jamming.joints.drawing import Tolerances
    from graphsynth.jamming.joints.limits import Misalignment
    from graphsynth.jamming.joints.program import Bearings
    from graphsynth.kinematics.engine.result import Motion


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JammingTable:
    """Values over the crank angles ``f``; every array has the shape of ``f``.

    Angles in radians, interferences in mm, areas in mm^2.  ``status`` is an `AssemblyStatus`; the other columns are NaN
    where the linkage cannot be assembled, and the two areas of the surrogate E4 also where its ellipse is not defined.
    ``rim_by_quadrature`` marks the angles at which the area of the rim is not a closed form.
    """

    f: Array
    status: NDArray[np.int8]
    theta: Array
    interference_a: Array
    interference_b: Array
    interference: Array
    surrogate_gap_area: Array
    surrogate_interference_area: Array
    lid_area: Array
    rim_area: Array
    rim_by_quadrature: NDArray[np.bool_]

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a `pandas.DataFrame` (pandas is imported here)."""
        import pandas as pd

        return pd.DataFrame({name: getattr(self, name) for name in self.__dataclass_fields__})


def table_over(linkage: TiltedFourBar, bearing: Bearing, condition: Condition, f: Array) -> JammingTable:
    """Fill the table at crank angles ``f`` (radians)."""
    path = linkage.positions(f)
    S, C = np.where(path.assembled, path.sin_theta, 0.0), np.where(path.assembled, path.cos_theta, 1.0)
    hide = np.where(path.assembled, 0.0, np.nan)
    if bearing.clearance >= 0.0:
        crescent = surrogate_areas(bearing, S, C)
        lid, (rim, by_quadrature) = lid_area(bearing, S, C), rim_area(bearing, S, C)
    else:  # an interference fit has no free position to measure from
        lid = rim = hide * np.nan
        crescent = CrescentAreas(lid, rim)
        by_quadrature = np.zeros(f.shape, dtype=bool)
    return JammingTable(
        f=f,
        status=path.status,
        theta=path.theta,
        interference_a=bearing.interference(S, C, "A") + hide,
        interference_b=bearing.interference(S, C, "B") + hide,
        interference=bearing.interference(S, C, condition) + hide,
        surrogate_gap_area=crescent[0] + hide,
        surrogate_interference_area=crescent[1] + hide,
        lid_area=lid + hide,
        rim_area=rim + hide,
        rim_by_quadrature=by_quadrature,
    )


_MOST_SAMPLES = 10_000_000


@dataclass(frozen=True, eq=False, repr=False)
class JammingReport(Assessment):
    """Result of `assess_jamming` for one tilted bearing.

    Attributes
    ----------
    verdict, method : Verdict, str
        Over the full rotation: that of the certificate, or an estimate if none was asked for; how it is known.
    arcs : JamArcs
        Closed-form jam arcs of the nominal dimensions, radians (estimated; proved bounds are in the certificate).
    worst_interference, worst_angle : float
        Largest interference over the crank angles that can be assembled (mm; negative is the clearance left) and one at
        which it is reached; NaN if there are none.
    largest_tilt, critical_tilt : float or None
        Radians; None if there is no critical tilt, with the sentence in ``arcs.reason``.
    full_turn, table : FullTurn, JammingTable
        Whether the crank makes a full rotation at all; values over the sampled crank angles.
    smallest_clearance, largest_misalignment : Limit
        Inverse questions for conditions "A" and "B" (None for "general").
    notes : tuple of str
        What a reader must know: angles that cannot be assembled, special cases.
    certificate : JamCertificate or None
        What is proved, with evidence: bounds of the interference, inner and outer arcs, witness.
    """

    linkage: TiltedFourBar
    bearing: Bearing
    verdict: Verdict
    method: str
    condition: str
    arcs: JamArcs
    worst_interference: float
    worst_angle: float
    largest_tilt: float
    critical_tilt: float | None
    full_turn: FullTurn
    table: JammingTable
    smallest_clearance: Limit | None
    largest_misalignment: Limit | None
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)
    certificate: JamCertificate | None = None

    def _figures(self) -> list[tuple[str, str]]:
        critical = "none" if self.critical_tilt is None else f"{self.critical_tilt:.6g} rad"
        arcs = ", ".join(f"{math.degrees(a.start):.2f}° to {math.degrees(a.stop):.2f}°" for a in self.arcs.arcs)
        rows = [
            ("interference", f"{self.worst_interference:.6g} mm at most, at {math.degrees(self.worst_angle):.2f}°"),
            ("tilt", f"{self.largest_tilt:.6g} rad at most, critical {critical}"),
            ("binds", f"{arcs or 'at no crank angle'} (nominal dimensions)"),
        ]
        for name, limit, side, unit in (
            ("clearance", self.smallest_clearance, "from", "mm"),
            ("misalignment", self.largest_misalignment, "up to", "rad"),
        ):
            if limit is not None and limit.value is not None:
                rows.append((name, f"free {side} {limit.value:.6g} {unit}"))
        return rows

    @property
    def statement(self) -> str:
        """The proved sentence, or the estimated verdict in words."""
        return self.certificate.statement if self.certificate else self.verdict.value

    def to_pandas(self) -> pd.DataFrame:
        """Return the table over the crank angles with the columns ``certainly_jams`` and ``certainly_free`` added.

        Both come from the certificate and are False where nothing is proved, or without a certificate; "jams" also says
        that the linkage is proved to be assembled there.
        """
        frame = self.table.to_pandas()
        for name, kind in (("certainly_jams", "inner"), ("certainly_free", "free")):
            spans = getattr(self.certificate.arcs, kind) if self.certificate else ()
            frame[name] = [covers(spans, angle, angle) for angle in self.table.f]
        if self.certificate and self.certificate.assembles != "always":
            from graphsynth.intervals import Interval
            from graphsynth.jamming.bearing.corners import pose

            f = Interval.from_bounds(self.table.f, self.table.f)
            frame["certainly_jams"] &= pose(self.certificate.box, f).assembled
        return frame

    def summary(self) -> dict[str, Any]:
        """Plain values (floats, strings, lists; angles in radians) for a report or a JSON file."""
        return {
            "verdict": self.verdict.name,
            **{name: getattr(self, name) for name in ("statement", "method", "condition")},
            "arcs": [[arc.start, arc.stop] for arc in self.arcs.arcs],
            "touching": list(self.arcs.touching),
            "kappa": self.arcs.kappa,
            "worst_interference_mm": self.worst_interference,
            "worst_angle": self.worst_angle,
            "largest_tilt": self.largest_tilt,
            "critical_tilt": self.critical_tilt,
            "smallest_clearance_mm": self.smallest_clearance.value if self.smallest_clearance else None,
            "largest_misalignment": self.largest_misalignment.value if self.largest_misalignment else None,
            "full_turn": self.full_turn.statement,
            "notes": list(self.notes),
            "seconds": self.seconds,
            "certificate": self.certificate.summary() if self.certificate else None,
        }


@overload
def assess_jamming(
    subject: TiltedFourBar | ToleranceBox,
    bearing: Bearing | None = None,
    condition: Condition = "A",
    samples: int | ArrayLike = 361,
    *,
    certify: bool = True,
) -> JammingReport:
    """Assess the tilted bearing at B of a four-bar over a full rotation of the crank (model L0)."""


@overload
def assess_jamming(
    subject: Motion,
    *,
    tilt: Misalignment | Iterable[Misalignment] | float | str,
    joints: Bearings | float | str | None = None,
    condition: Condition = "A",
    certify: bool = True,
    tolerances: Tolerances = 0.0,
    seconds: float = 20.0,
    model: str = "small",
) -> CoupledReport:
    """Assess all joints of a mechanism over its motion (model L1, or the exact closure in space)."""


@checked
def assess_jamming(
    subject: Motion | TiltedFourBar | ToleranceBox | None = None,
    bearing: Bearing | None = None,
    condition: Condition = "A",
    samples: int | ArrayLike | None = None,
    *,
    certify: bool = True,
    **of_a_motion: Any,
) -> JammingReport | CoupledReport:
    """Assess whether joints bind if an axis is tilted: all of a mechanism over its motion, or one of a four-bar.

    Parameters
    ----------
    subject : Motion, TiltedFourBar or ToleranceBox
        A `Motion` of `graphsynth.simulate` is assessed with all its joints (model L1), and needs ``tilt`` and
        ``joints``; a `TiltedFourBar` with its tilted motor axis by the model of the source (L0).  With a `ToleranceBox`
        the verdict of L0 holds for the whole box; table and closed-form arcs are those of its middle.
    bearing : Bearing, optional
        L0: the bearing at B, by default that of the box, else of the source (17.5 mm, 10 mm, 0.03 mm).
    condition, certify : {"A", "B", "general"}, bool
        Contact condition; "A" (short bearing in a long hole) is what the source means.  With ``certify=False`` the
        verdict is an estimate in double precision, and says so.
    samples : int or array_like, optional
        L0: number of crank angles of the table over [0, 2 pi] (361), or the angles themselves (radians).
    **of_a_motion
        L1: ``tilt``, the misaligned axes (`Misalignment` or several), or the tilt of the first driver's axis in radians
        or as text, "0.5 deg".  ``joints``, what the joints allow: a `Bearing`, `JointLimits` or `SlideLimits` for all,
        a mapping of pairs of links to these, or the tilt that every joint allows, radians or text.
        ``tolerances``, one relative number for all lengths (0), or tolerances of parts (`graphsynth.tolerances`), where
        fits may stand for ``joints``; ``seconds``, the time of the proof (20).
        ``model``: "small" (L1), or "exact", which closes every loop in space with finite tilts and is slower
        (theory/closure-in-space); verdict and tables are then about that, and every sample takes some 0.1 s.  With
        small tilts the report states the error of its figures.

    Returns
    -------
    JammingReport or CoupledReport
        Both print one sentence and a table; ``details()`` gives all.  The verdict is certified by default: for all
        tolerances, or for the doubles given, which it says.  It never comes from the samples.

    Raises
    ------
    GeometryError
        Bad dimensions, an unknown condition, fewer than two samples, no subject, arguments of the other model.

    Examples
    --------
    >>> report = assess_jamming(ToleranceBox(alpha="1/30", clearance="0.03 +- 0.003"))
    >>> report.verdict.name, round(report.worst_interference, 12)
    ('CERTIFIED_JAMMED', 0.035099273074)

    With three bearings of that kind, at A, B and C, over half a rotation:

    >>> from graphsynth import Mechanism
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate("0..180 deg")
    >>> assess_jamming(motion, tilt=0.011, joints=Bearing()).verdict.name
    'CERTIFIED_FREE'
    """
    if isinstance(subject, TiltedFourBar | ToleranceBox):
        for name in of_a_motion:
            raise GeometryError(f"{name} does not go with a TiltedFourBar or a ToleranceBox; it belongs to a motion")
        samples = 361 if samples is None else samples
        if isinstance(subject, TiltedFourBar):
            return assess_bearing(subject, bearing or Bearing(), condition, samples, None, certify)
        linkage, own = subject.nominal()
        return assess_bearing(linkage, bearing or own, condition, samples, subject, certify)
    for name, given in (("samples", samples), ("bearing", bearing)):
        if given is not None:
            remedy = "give joints=..." if name == "bearing" else "it belongs to a TiltedFourBar or a ToleranceBox"
            raise GeometryError(f"{name} does not go with a motion; {remedy}")
    return _of_a_motion(subject, condition=condition, certify=certify, **of_a_motion)


def _of_a_motion(
    motion: Any,
    tilt: Misalignment | Iterable[Misalignment] | float | str | None = None,
    joints: Bearings | float | str | None = None,
    **options: Any,
) -> CoupledReport:
    """Assess a motion; refuse what is none, and one without limits of its joints or tilted axes."""
    from graphsynth.jamming.joints.assess import assess_coupled

    if unknown := set(options) - {"condition", "certify", "tolerances", "seconds", "model"}:
        raise GeometryError(f"{unknown.pop()} is no argument of an assessment; give tilt, joints, tolerances")
    tolerances = options.get("tolerances", 0.0)
    motion, limits, axes = asked(motion, tilt, joints, isinstance(tolerances, Iterable))
    if is_exact(options.pop("model", "small")):
        from graphsynth.jamming.space.assess import assess_in_space

        return assess_in_space(motion, limits, axes, **options)
    report = assess_coupled(motion, limits, axes, **options)
    if report.verdict is Verdict.CANNOT_ASSEMBLE:
        return report
    from graphsynth.jamming.space.assess import small_tilt_error

    return replace(report, small_tilt_error=small_tilt_error(motion, report, options.get("condition", "A")))


def assess_bearing(
    linkage: TiltedFourBar,
    bearing: Bearing,
    condition: Condition,
    samples: int | ArrayLike,
    box: ToleranceBox | None,
    certify: bool,
) -> JammingReport:
    """Assess one tilted bearing: the verdict for ``box`` (without one for the doubles given), the table for them."""
    begin = perf_counter()
    if isinstance(samples, int | np.integer):
        if not 2 <= samples <= _MOST_SAMPLES:
            few = "few" if samples < 2 else "many"
            raise GeometryError(
                f"samples = {samples} is too {few} for a table; give 2 to {_MOST_SAMPLES}, or an array of angles"
            )
        samples = np.linspace(0.0, math.tau, int(samples))
    table = table_over(linkage, bearing, condition, np.atleast_1d(finite_array("samples", samples)))
    arcs = jam_arcs(linkage, bearing, condition)
    turn = linkage.full_turn()
    worst = _worst(linkage, bearing, condition, turn)
    certificate, verdict = None, Verdict.FREE_ESTIMATED
    if bearing.clearance < 0.0 or turn.kind == "never assembled":
        verdict = Verdict.CANNOT_ASSEMBLE
    elif arcs.arcs or arcs.touching:
        verdict = Verdict.JAMMED_ESTIMATED if arcs.arcs else Verdict.TOUCHING_ESTIMATED
    if certify:
        from graphsynth.jamming.bearing.certify import certify_jamming

        certificate = certify_jamming(ToleranceBox.of(linkage, bearing) if box is None else box, condition)
        verdict = certificate.verdict
    notes = [arcs.reason] if arcs.reason else []
    if not turn.possible:
        notes.append(f"{turn.statement}; the arcs hold for the assembled crank angles only")
    if table.rim_by_quadrature.any():
        notes.append("R S > h C at some angles: the area of the rim is a quadrature there")
    if certificate and certificate.reason and certificate.reason not in notes:
        notes.append(certificate.reason)
    inverse = condition != "general" and linkage.rod == "rigid" and linkage.pin_height <= linkage.l3
    return JammingReport(
        linkage=linkage,
        bearing=bearing,
        verdict=verdict,
        method=METHOD_CERTIFIED if certificate else METHOD_CLOSED_FORM,
        condition=condition,
        arcs=arcs,
        worst_interference=worst[0],
        worst_angle=worst[1],
        largest_tilt=linkage.largest_tilt[0],
        critical_tilt=bearing.critical_tilt(condition).angle,
        full_turn=turn,
        table=table,
        smallest_clearance=smallest_clearance(linkage, bearing, condition) if inverse else None,
        largest_misalignment=largest_misalignment(linkage, bearing, condition) if inverse else None,
        notes=tuple(notes),
        seconds=perf_counter() - begin,
        certificate=certificate,
    )


def _worst(linkage: TiltedFourBar, bearing: Bearing, condition: Condition, turn: FullTurn) -> tuple[float, float]:
    """Largest interference over the assembled part of the turn, and a crank angle of it.

    That is a quarter turn before or after the phase, or a dead-centre position if neither can be reached.
    """
    if turn.kind == "never assembled":
        return math.nan, math.nan
    tilt, sine = linkage.largest_tilt
    angle = (linkage.pin_phase + 0.5 * math.pi) % math.tau
    both = np.array([angle, (angle + math.pi) % math.tau])
    reached = linkage.positions(both).assembled
    if turn.possible or reached.any() or not turn.limit_angles:
        at = int(reached[1] and not reached[0])
        return float(bearing.interference(sine, math.cos(tilt), condition)), float(both[at])
    rise = linkage.pin_height / linkage.l3 * np.abs(np.sin(np.array(turn.limit_angles) - linkage.pin_phase))
    S = rise if linkage.rod == "rigid" else rise / np.hypot(1.0, rise)
    interference = bearing.interference(S, np.sqrt((1.0 - S) * (1.0 + S)), condition)
    best = int(np.argmax(interference))
    return float(interference[best]), turn.limit_angles[best]
