"""Assess jamming: one tilted bearing of a linkage over a full rotation, or all joints of a mechanism over a motion."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.angles import angle
from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Printed
from graphsynth.jamming.bearing.arcs import JamArcs, jam_arcs, strictly_inside
from graphsynth.jamming.bearing.areas import CrescentAreas, lid_area, rim_area, surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.limits import Limit, largest_misalignment, smallest_clearance
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.verdict import METHOD_CERTIFIED, METHOD_CLOSED_FORM, Verdict
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.rotatability import FullTurn

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.jamming.bearing.certify import JamCertificate
    from graphsynth.jamming.joints.assess import CoupledReport
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
class JammingReport(Printed):
    """Result of `assess_jamming`.

    Attributes
    ----------
    verdict : Verdict
        Over the whole turn: that of the certificate, or an estimate if none was asked for; see ``method``.
    method : str
        How the verdict was had.
    condition : str
        Contact condition used.
    arcs : JamArcs
        Closed-form jam arcs of the nominal dimensions, radians (estimated; proved bounds are in the certificate).
    worst_interference, worst_angle : float
        Largest interference over the crank angles that can be assembled (mm; negative is the clearance left) and one at
        which it is reached; NaN if there are none.
    largest_tilt, critical_tilt : float or None
        Radians; None if there is no critical tilt, with the sentence in ``arcs.reason``.
    full_turn : FullTurn
        Whether the crank makes a full turn at all.
    table : JammingTable
        Values over the sampled crank angles.
    smallest_clearance, largest_misalignment : Limit
        Inverse questions for conditions "A" and "B" (None for "general").
    notes : tuple of str
        What a reader must know: angles that cannot be assembled, special cases.
    seconds : float
        Run time.
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

    def __repr__(self) -> str:
        limits = [
            f"{text}: {limit.value:.6g} {unit}"
            for text, limit, unit in (
                ("smallest clearance", self.smallest_clearance, "mm"),
                ("largest misalignment", self.largest_misalignment, "rad"),
            )
            if limit is not None and limit.value is not None
        ]
        critical = "none" if self.critical_tilt is None else f"{self.critical_tilt:.6g} rad"
        arcs = ", ".join(f"{math.degrees(a.start):.2f} to {math.degrees(a.stop):.2f} deg" for a in self.arcs.arcs)
        lines = [
            self.statement,
            f"  interference at worst: {self.worst_interference:.6g} mm at {math.degrees(self.worst_angle):.2f} deg",
            f"  largest tilt: {self.largest_tilt:.6g} rad; critical tilt: {critical}",
            f"  binds at crank angles: {arcs or 'none'} (nominal dimensions)",
            *(f"  {text}" for text in limits),
            "  more: .table, .arcs, .certificate, .summary(), .to_pandas()",
        ]
        return "\n".join(lines)

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
            frame[name] = [strictly_inside(spans, angle) for angle in self.table.f]
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
            "statement": self.statement,
            "method": self.method,
            "condition": self.condition,
            "arcs": [[arc.start, arc.stop] for arc in self.arcs.arcs],
            "touching": list(self.arcs.touching),
            "kappa": self.arcs.kappa,
            "worst_gap_mm": self.worst_interference,
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


# one tilted bearing of a four-bar (model L0)
@overload
def assess_jamming(
    subject: TiltedFourBar | ToleranceBox,
    bearing: Bearing | None = None,
    condition: Condition = "A",
    samples: int | ArrayLike = 361,
    *,
    certify: bool = True,
) -> JammingReport: ...


# all joints of any mechanism over its motion (model L1)
@overload
def assess_jamming(
    subject: Motion,
    bearing: Bearings | float | str,
    condition: Condition = "A",
    *,
    tilts: Misalignment | Iterable[Misalignment] | float | str,
    certify: bool = True,
    length_tolerance: float = 0.0,
    seconds: float = 20.0,
) -> CoupledReport: ...


@checked
def assess_jamming(
    subject: Motion | TiltedFourBar | ToleranceBox | None = None,
    bearing: Bearings | float | str | None = None,
    condition: Condition = "A",
    samples: int | ArrayLike | None = None,
    *,
    tilts: Misalignment | Iterable[Misalignment] | float | str | None = None,
    certify: bool = True,
    length_tolerance: float = 0.0,
    seconds: float = 20.0,
) -> JammingReport | CoupledReport:
    """Assess whether bearings bind: all of a mechanism over its motion, or the one at B of a four-bar.

    Parameters
    ----------
    subject : Motion, TiltedFourBar or ToleranceBox
        A `Motion` of `graphsynth.simulate` is assessed with all its joints (model L1, needs ``tilts``); a
        `TiltedFourBar` with its tilted motor axis by the model of the source (L0).  With a `ToleranceBox` the verdict
        of L0 holds for the whole box; table and closed-form arcs are those of its middle.
    bearing : Bearing, float or str, optional
        L0: the bearing at B, by default that of the box, else of the source (17.5 mm, 10 mm, 0.03 mm).  L1: limits for
        all joints, or a mapping of pairs of links to limits, see `graphsynth.jamming.joints.assess_coupled`; or the
        tilt that every joint allows, radians or "0.5 deg".
    condition : {"A", "B", "general"}
        Contact condition; "A" (short bearing in a long hole) is what the source means.
    samples : int or array_like, optional
        L0: number of crank angles of the table over [0, 2 pi] (361), or the angles themselves (radians).
    tilts : Misalignment or several, float or str, optional
        L1: the axes that are tilted; or the tilt of the first driver's axis, radians or "0.5 deg".
    certify : bool
        If False the verdict is an estimate in double precision, and says so.
    length_tolerance, seconds : float
        L1: relative tolerance of all lengths, and the time that the proof may take.

    Returns
    -------
    JammingReport or CoupledReport
        Both have ``verdict`` (`Verdict`), ``statement``, ``method``, ``condition``, ``certificate``, ``notes``,
        ``seconds``, ``summary()`` and ``to_pandas()``.  The verdict is certified by default: for all tolerances, or for
        the doubles given, which it says.  It never comes from the samples.

    Raises
    ------
    GeometryError
        Bad dimensions, an unknown condition, fewer than two samples, no subject, arguments of the other model.

    Examples
    --------
    >>> report = assess_jamming(ToleranceBox(alpha="1/30", clearance="0.03 +- 0.003"))
    >>> report.verdict.name, round(report.worst_interference, 12)
    ('CERTIFIED_JAMMED', 0.035099273074)

    The same dimensions with three bearings of that kind, at A, B and C, over half a turn:

    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
    >>> from graphsynth.jamming.joints import Misalignment
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> linkage = Mechanism(graph, [
    ...     Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
    ...     Revolute(0, 3, (2.0, 0.0)),
    ... ], [Driver(0, 1)])
    >>> motion = simulate(linkage, np.linspace(0.0, np.pi, 19))
    >>> assess_jamming(motion, Bearing(), tilts=Misalignment(0, 1, 0.011)).verdict.name
    'CERTIFIED_FREE'
    """
    if isinstance(subject, TiltedFourBar | ToleranceBox):
        _refuse("a TiltedFourBar or a ToleranceBox", "the motion of a mechanism (simulate)",
                tilts=tilts is not None, length_tolerance=length_tolerance != 0.0)  # fmt: skip
        return _one_bearing(subject, bearing, condition, 361 if samples is None else samples, certify)
    _refuse("a motion", "a TiltedFourBar or a ToleranceBox", samples=samples is not None)
    from graphsynth.jamming.joints.assess import assess_coupled

    subject, bearing, tilts = _of_a_motion(subject, bearing, tilts)
    return assess_coupled(
        subject, bearing, tilts, condition=condition, certify=certify, length_tolerance=length_tolerance,
        seconds=seconds,
    )  # fmt: skip


def _of_a_motion(
    subject: Any,
    bearing: Bearings | float | str | None,
    tilts: Misalignment | Iterable[Misalignment] | float | str | None,
) -> tuple[Motion, Bearings, Misalignment | Iterable[Misalignment]]:
    """Refuse what is no motion, and a motion without bearings or tilts."""
    from graphsynth.jamming.joints.limits import JointLimits, Misalignment
    from graphsynth.kinematics.engine.result import Motion

    if not isinstance(subject, Motion):
        raise GeometryError(
            f"subject = {subject!r} is neither a Motion (simulate) nor a TiltedFourBar or ToleranceBox; give one"
        )
    if isinstance(tilts, float | int | str):
        driver = subject.mechanism.drivers[0]
        tilts = Misalignment(driver.base, driver.link, angle("tilts", tilts))
    if isinstance(bearing, float | int | str):
        bearing = JointLimits(angle("bearing", bearing))
    if tilts is None:
        raise GeometryError("no axis is misaligned; give tilts=Misalignment(base, link, alpha)")
    if bearing is None:
        raise GeometryError("the joints have no bearings; give a Bearing or JointLimits, or {(link, link): ...}")
    return subject, bearing, tilts


def _one_bearing(
    subject: TiltedFourBar | ToleranceBox, bearing: Any, condition: Condition, samples: int | ArrayLike, certify: bool
) -> JammingReport:
    """Assess the models, or the box with the models in its middle."""
    if bearing is not None and not isinstance(bearing, Bearing):
        raise GeometryError(f"bearing = {bearing!r} does not fit a TiltedFourBar; give one Bearing(...)")
    if isinstance(subject, TiltedFourBar):
        return assess_bearing(subject, bearing or Bearing(), condition, samples, None, certify)
    linkage, own = subject.nominal()
    return assess_bearing(linkage, bearing or own, condition, samples, subject, certify)


def _refuse(subject: str, other: str, **given: bool) -> None:
    """Refuse arguments of the other model."""
    for name, there in given.items():
        if there:
            raise GeometryError(f"{name} does not go with {subject}; it belongs to {other}")


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
    table = table_over(linkage, bearing, condition, _angles(samples))
    arcs = jam_arcs(linkage, bearing, condition)
    turn = linkage.full_turn()
    worst = _worst(linkage, bearing, condition, turn)
    certificate = None
    if certify:
        from graphsynth.jamming.bearing.certify import certify_jamming

        certificate = certify_jamming(ToleranceBox.of(linkage, bearing) if box is None else box, condition)
    inverse = condition != "general" and linkage.rod == "rigid" and linkage.pin_height <= linkage.l3
    return JammingReport(
        linkage=linkage,
        bearing=bearing,
        verdict=certificate.verdict if certificate else _verdict(bearing, arcs, turn),
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
        notes=_notes(arcs, turn, table, certificate),
        seconds=perf_counter() - begin,
        certificate=certificate,
    )


def _notes(arcs: JamArcs, turn: FullTurn, table: JammingTable, certificate: JamCertificate | None) -> tuple[str, ...]:
    notes = [text for text in (arcs.reason,) if text]
    if not turn.possible:
        notes.append(f"{turn.statement}; the arcs hold for the assembled crank angles only")
    if table.rim_by_quadrature.any():
        notes.append("R S > h C at some angles: the area of the rim is a quadrature there")
    if certificate and certificate.reason and certificate.reason not in notes:
        notes.append(certificate.reason)
    return tuple(notes)


def _angles(samples: int | ArrayLike) -> Array:
    if isinstance(samples, int | np.integer):
        if not 2 <= samples <= _MOST_SAMPLES:
            few = "few" if samples < 2 else "many"
            raise GeometryError(
                f"samples = {samples} is too {few} for a table; give 2 to {_MOST_SAMPLES}, or an array of angles"
            )
        return np.linspace(0.0, math.tau, int(samples))
    return np.atleast_1d(finite_array("samples", samples))


def _worst(linkage: TiltedFourBar, bearing: Bearing, condition: Condition, turn: FullTurn) -> tuple[float, float]:
    """Largest interference over the assembled part of the turn, and a crank angle of it.

    That is a quarter turn before or after the phase, or a dead point if neither can be reached.
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


def _verdict(bearing: Bearing, arcs: JamArcs, turn: FullTurn) -> Verdict:
    if bearing.clearance < 0.0 or turn.kind == "never assembled":
        return Verdict.CANNOT_ASSEMBLE
    if arcs.arcs:
        return Verdict.JAMMED_ESTIMATED
    return Verdict.TOUCHING_ESTIMATED if arcs.touching else Verdict.FREE_ESTIMATED
