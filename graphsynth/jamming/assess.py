"""Assess a lambda linkage and its bearing over a turn: verdict, jam arcs, margins, table."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.errors import GeometryError
from graphsynth.jamming.areas import CrescentAreas, lid_area, rim_area, surrogate_areas
from graphsynth.jamming.bearing import Bearing, Condition
from graphsynth.jamming.circle_sets import strictly_inside
from graphsynth.jamming.inverse import Limit, largest_misalignment, smallest_clearance
from graphsynth.jamming.parameters import ToleranceBox
from graphsynth.jamming.tilt_arcs import JamArcs, jam_arcs
from graphsynth.jamming.verdict import METHOD_CERTIFIED, METHOD_CLOSED_FORM, Verdict
from graphsynth.kinematics._checks import finite_array
from graphsynth.kinematics._turn import FullTurn
from graphsynth.kinematics.lambda_linkage import LambdaLinkage

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.jamming.certify import JamCertificate

__all__ = ["JammingReport", "JammingTable", "assess_jamming"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JammingTable:
    """Values over the crank angles ``f``; every array has the shape of ``f``.

    Angles in radians, gaps in mm, areas in mm^2.  ``status`` is an `AssemblyStatus`; the other columns are NaN where
    the linkage cannot be assembled, and the two areas of the surrogate E4 also where its ellipse is not defined.
    ``rim_by_quadrature`` marks the angles at which the area of the rim is not a closed form.
    """

    f: Array
    status: NDArray[np.int8]
    theta: Array
    gap_a: Array
    gap_b: Array
    gap: Array
    surrogate_gap_area: Array
    surrogate_interference_area: Array
    lid_area: Array
    rim_area: Array
    rim_by_quadrature: NDArray[np.bool_]

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a `pandas.DataFrame` (pandas is imported here)."""
        import pandas as pd

        return pd.DataFrame({name: getattr(self, name) for name in self.__dataclass_fields__})


@dataclass(frozen=True, eq=False)
class JammingReport:
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
    worst_gap, worst_angle : float
        Largest gap function over the turn (mm; negative is the clearance left) and a crank angle where it is reached.
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
        What is proved, with evidence: bounds of the gap, inner and outer arcs, witness.
    """

    linkage: LambdaLinkage
    bearing: Bearing
    verdict: Verdict
    method: str
    condition: str
    arcs: JamArcs
    worst_gap: float
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

    @property
    def statement(self) -> str:
        """The proved sentence, or the estimated verdict in words."""
        return self.certificate.statement if self.certificate else self.verdict.value

    def to_pandas(self) -> pd.DataFrame:
        """Return the table over the crank angles with the columns ``certainly_jams`` and ``certainly_free`` added.

        Both come from the certificate and are False where nothing is proved, or without a certificate.
        """
        frame = self.table.to_pandas()
        for name, kind in (("certainly_jams", "inner"), ("certainly_free", "free")):
            spans = getattr(self.certificate.arcs, kind) if self.certificate else ()
            frame[name] = [strictly_inside(spans, angle) for angle in self.table.f]
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
            "worst_gap_mm": self.worst_gap,
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


def assess_jamming(
    linkage: LambdaLinkage | None = None,
    bearing: Bearing | None = None,
    condition: Condition = "A",
    samples: int | ArrayLike = 361,
    *,
    box: ToleranceBox | None = None,
    certify: bool = True,
) -> JammingReport:
    """Assess whether the bearing at B jams while the crank makes a turn.

    Parameters
    ----------
    linkage : LambdaLinkage, optional
        With its tilted motor axis; needed unless ``box`` is given.
    bearing : Bearing, optional
        Defaults to the bearing of the source (17.5 mm, 10 mm, 0.03 mm).
    condition : {"A", "B", "general"}
        Contact condition; "A" (short bearing in a long hole) is what the source means.
    samples : int or array_like
        Number of crank angles of the table over [0, 2 pi], or the angles themselves (radians).
    box : ToleranceBox, optional
        Exact dimensions with tolerances; the verdict then holds for the whole box, table and closed-form arcs for its
        middle unless ``linkage`` and ``bearing`` say otherwise.
    certify : bool
        If False the verdict is an estimate from closed forms in double precision, and says so.

    Returns
    -------
    JammingReport
        The verdict is certified (`certify_jamming`) by default: for the whole box, or for the doubles given, which it
        says.  It never comes from the samples.

    Raises
    ------
    GeometryError
        Bad dimensions, an unknown condition, fewer than two samples, neither a linkage nor a box.

    Examples
    --------
    >>> report = assess_jamming(box=ToleranceBox(alpha="1/30", clearance="0.03 +- 0.003"))
    >>> report.verdict.name, round(report.worst_gap, 12)
    ('CERTIFIED_JAMMED', 0.035099273074)
    """
    begin = perf_counter()
    linkage, bearing, box = _given(linkage, bearing, box)
    f = _angles(samples)
    table = _table(linkage, bearing, condition, f)
    arcs = jam_arcs(linkage, bearing, condition)
    turn = linkage.full_turn()
    tilt, sine = linkage.largest_tilt
    certificate = _certificate(box, condition) if certify else None
    inverse = condition != "general" and linkage.rod == "rigid" and linkage.pin_height <= linkage.l3
    return JammingReport(
        linkage=linkage,
        bearing=bearing,
        verdict=certificate.verdict if certificate else _verdict(bearing, arcs, turn),
        method=METHOD_CERTIFIED if certificate else METHOD_CLOSED_FORM,
        condition=condition,
        arcs=arcs,
        worst_gap=float(bearing.gap(sine, math.cos(tilt), condition)),
        worst_angle=(linkage.pin_phase + 0.5 * math.pi) % math.tau,
        largest_tilt=tilt,
        critical_tilt=bearing.critical_tilt(condition).angle,
        full_turn=turn,
        table=table,
        smallest_clearance=smallest_clearance(linkage, bearing, condition) if inverse else None,
        largest_misalignment=largest_misalignment(linkage, bearing, condition) if inverse else None,
        notes=_notes(arcs, turn, table, certificate),
        seconds=perf_counter() - begin,
        certificate=certificate,
    )


def _given(
    linkage: LambdaLinkage | None, bearing: Bearing | None, box: ToleranceBox | None
) -> tuple[LambdaLinkage, Bearing, ToleranceBox]:
    """Complete what was given: the box of the models, or the models in the middle of the box."""
    if box is None:
        if linkage is None:
            raise GeometryError(
                "neither a linkage nor a box is given; give LambdaLinkage(...) or box=ToleranceBox(...)"
            )
        bearing = Bearing() if bearing is None else bearing
        return linkage, bearing, ToleranceBox.of(linkage, bearing)
    middle = box.nominal()
    return linkage or middle[0], bearing or middle[1], box


def _certificate(box: ToleranceBox, condition: Condition) -> JamCertificate:
    from graphsynth.jamming.certify import certify_jamming

    return certify_jamming(box, condition)


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
        if samples < 2:
            raise GeometryError(f"samples = {samples} is too few for a table; give 2 or more, or an array of angles")
        return np.linspace(0.0, math.tau, int(samples))
    return np.atleast_1d(finite_array("samples", samples))


def _table(linkage: LambdaLinkage, bearing: Bearing, condition: Condition, f: Array) -> JammingTable:
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
        gap_a=bearing.gap(S, C, "A") + hide,
        gap_b=bearing.gap(S, C, "B") + hide,
        gap=bearing.gap(S, C, condition) + hide,
        surrogate_gap_area=crescent[0] + hide,
        surrogate_interference_area=crescent[1] + hide,
        lid_area=lid + hide,
        rim_area=rim + hide,
        rim_by_quadrature=by_quadrature,
    )


def _verdict(bearing: Bearing, arcs: JamArcs, turn: FullTurn) -> Verdict:
    if bearing.clearance < 0.0 or turn.kind == "never assembled":
        return Verdict.CANNOT_ASSEMBLE
    if arcs.arcs:
        return Verdict.JAMMED_ESTIMATED
    return Verdict.TOUCHING_ESTIMATED if arcs.touching else Verdict.FREE_ESTIMATED
