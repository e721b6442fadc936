"""Stages of a four-bar survey over all shards: gather, order, certify the best, records, tables and the answer."""

from __future__ import annotations

import math
from base64 import b64decode
from collections import Counter
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.ordered import in_order
from graphsynth.mechanism.rotatability import KINDS, TYPES
from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Finding, Outcome, Quantity, Ranking, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import DIGITS
from graphsynth.pipeline.units import grouped
from graphsynth.systems.four_bar_survey.stages import (
    QUANTITIES,
    Lattice,
    evaluate_sets,
    exactly,
    front_of,
    lattice_of,
    objectives_of,
)

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.parameters import ToleranceBox

_PIECE = 20  # certificates made in one go
_SHOWN = tuple(kind.replace("turn", "rotation") for kind in KINDS)
_CLASS_COLUMNS = ("type (exact)", "crank (exact)", "crank (found in motion)", "sets", "agree")
_CLASS_NOTE = (
    "Type and kind are decided in exact arithmetic (Grashof's rule, exact); the motion is that of the engine in "
    "floating point at the sampled crank angles, which contain both positions in line with the frame."
)
_PROOF_NOTE = "For a full rotation and every combination of the tolerances, with outward rounding."


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """All shards together.

    `sets`, `positions`, `passing`: dimension sets and crank positions computed, sets that keep the limits; `classes`:
    (type, kind, kind found), places in `TYPES` and `KINDS`, to the number of sets; `maps`: columns by pair of frame and
    coupler; `failed`: shards that failed, with the reason.

    What `ranking_of` would say of all sets that pass: `ranked` have all objectives; no other set beats those of `front`
    in every objective; `chosen`: the best, the best first, as many as are certified; their `scores`, the weighted mean
    of the objectives, each scaled to 0 (worst of all that pass) .. 1 (best of all), and `places`: by objective, how
    many of all that pass are better.
    """

    lattice: Lattice
    sets: int
    positions: int
    passing: int
    classes: dict[tuple[int, int, int], int]
    rejected: dict[str, int]
    maps: dict[str, list[Any]]
    failed: tuple[str, ...]
    ranked: int = 0
    front: tuple[int, ...] = ()
    chosen: tuple[int, ...] = ()
    scores: tuple[float, ...] = ()
    places: tuple[tuple[int, ...], ...] = ()

    @property
    def disagreements(self) -> int:
        """Sets whose motion is not the one that integer arithmetic proves."""
        return sum(count for (_, kind, found), count in self.classes.items() if kind != found)


def gather(context: Context, outcomes: tuple[Outcome, ...]) -> Survey:
    """Put the shards together: counts, maps, the Pareto front of all sets, the best by score."""
    done: list[Any] = [outcome.products["surveyed"] for outcome in outcomes if outcome.status == "assessed"]
    classes: Counter[tuple[int, int, int]] = Counter()
    rejected: Counter[str] = Counter()
    maps: dict[str, list[Any]] = {}
    for shard in done:
        for type_, kind, found, count in shard["classes"]:
            classes[type_, kind, found] += count
        rejected.update(shard["rejected"])
        for name, column in shard["maps"].items():
            maps.setdefault(name, []).extend(column)
    survey = Survey(
        lattice_of(context),
        sum(shard["sets"] for shard in done),
        sum(shard["positions"] for shard in done),
        sum(shard["passing"] for shard in done),
        dict(classes),
        dict(rejected),
        maps,
        tuple(f"{o.key}: {o.reason}" for o in outcomes if o.status == "failed"),
    )
    return _ordered(context, survey, done)


@dataclass(frozen=True, slots=True)
class Certificate:
    """What is proved about one set, with the tolerances of the scene.

    `verdict`, `reason`: of `certify_jamming`; `free`: proved free, proved binding (for all or for some), or None;
    `assembles`: at how much of the rotation the tilted linkage is proved to be assembled; `clearance_left`: bounds of
    it at the worst angle, mm.
    """

    number: int
    verdict: str
    free: bool | None
    assembles: str
    reason: str
    clearance_left: tuple[float, float]


def certify(context: Context, survey: Survey) -> tuple[Certificate, ...]:
    """Prove for the best sets whether the bearing binds, in pieces on the executor."""
    pieces = [survey.chosen[k : k + _PIECE] for k in range(0, len(survey.chosen), _PIECE)]
    work = partial(_prove, replace(context, executor=None), survey.lattice)
    return tuple(proof for piece in in_order(context.executor, work, pieces) for proof in piece)


def _prove(context: Context, lattice: Lattice, sets: tuple[int, ...]) -> list[Certificate]:
    from graphsynth.jamming.bearing.certify import certify_jamming

    condition = context.scene.mechanism.bearing.condition
    proofs = []
    for number, lengths in zip(sets, lattice.lengths(np.array(sets)).tolist(), strict=True):
        found = certify_jamming(box_of(context, lattice, lengths), condition)
        verdict = found.verdict
        proofs.append(
            Certificate(
                number,
                verdict.value,
                True if verdict.is_free else False if verdict.is_jammed else None,
                found.assembles,
                found.reason,
                (found.clearance_left.lo, found.clearance_left.hi),
            )
        )
    return proofs


def box_of(context: Context, lattice: Lattice, lengths: list[int]) -> ToleranceBox:
    """Return the exact dimensions of a set with the tolerances of the scene."""
    from graphsynth.jamming.bearing.parameters import ToleranceBox, spread

    relative = exactly(context, "tolerances", "lengths") / 100
    given: dict[str, Any] = {
        name: spread(length * lattice.unit, 0, relative) for name, length in zip(("l1", "l2", "l3", "l4"), lengths)
    }
    for name, own in (("Rb", "radius"), ("Hb", "height"), ("clearance", "clearance")):
        given[name] = spread(exactly(context, "bearing", f"{own}_mm"), exactly(context, "tolerances", own), 0)
    for name, nominal in (("alpha", exactly(context, "tilt", "alpha")), ("azimuth", 0)):
        given[name] = spread(nominal, exactly(context, "tolerances", name), 0)
    return ToleranceBox(**given, axis=list(context.scene.mechanism.tilt.axis))


def _records(context: Context, survey: Survey, certificates: tuple[Certificate, ...]) -> tuple[Record, ...]:
    if not certificates:
        return ()
    done = evaluate_sets(context, survey.lattice, np.array([proof.number for proof in certificates]))
    values = {name: done.quantity(name) for name in QUANTITIES}
    unit = survey.lattice.unit
    records = []
    for i, proof in enumerate(certificates):
        frame, crank, coupler, rocker = (f"{float(length * unit):.12g}" for length in done.lengths[i].tolist())
        margins = [exact("size", float(values["size"][i]))]
        margins += [
            Quantity(name, float(values[name][i]), unit_)
            for name, unit_ in QUANTITIES.items()
            if name != "size" and math.isfinite(values[name][i])
        ]
        low, high = proof.clearance_left
        if math.isfinite(low) and math.isfinite(high):
            middle = 0.5 * (low + high)
            error = math.nextafter(max(high - middle, middle - low), math.inf)
            margins.append(Quantity("clearance left", middle, "mm", "certified", error))
        records.append(
            Record(
                i + 1,
                solution=f"set {proof.number}: frame {frame}, crank {crank}, coupler {coupler}, rocker {rocker}",
                recognised_as=TYPES[done.type[i]],
                verdict=proof.verdict,
                good=proof.free,
                margins=tuple(margins),
                reason=proof.reason,
            )
        )
    return tuple(records)


def _summary(context: Context, survey: Survey, certificates: tuple[Certificate, ...]) -> Table:
    lattice = survey.lattice
    spans = [
        f"{name} {float(r[0] * lattice.unit):g} to {float(r[-1] * lattice.unit):g} ({len(r)})"
        for name, r in (("frame", lattice.frame), ("coupler", lattice.coupler), ("rocker", lattice.rocker))
    ]
    rows = (
        ("dimension sets", grouped(survey.sets)),
        ("lengths", f"crank {float(lattice.crank * lattice.unit):g}, {', '.join(spans)}"),
        ("crank positions computed", grouped(survey.positions)),
        ("motion against the exact class", f"{grouped(survey.disagreements)} sets of {grouped(survey.sets)} disagree"),
        ("keep all limits", grouped(survey.passing)),
        ("of these, on the Pareto front", grouped(len(survey.front))),
        ("certified", grouped(len(survey.chosen))),
    )
    positions = context.scene.mechanism.positions
    note = f"{positions} crank positions a rotation; the front is that of all sets, not only of the certified ones."
    return table("The survey", ("", ""), rows, note, *findings(survey, certificates))


def assess(
    context: Context, survey: Survey, certificates: tuple[Certificate, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per certified set, and the tables of the survey, the first with its answer."""
    records = _records(context, survey, certificates)
    classes = (
        (TYPES[type_], _SHOWN[kind], _SHOWN[found], grouped(count), "yes" if kind == found else "NO")
        for (type_, kind, found), count in sorted(survey.classes.items())
    )
    limits = ((grouped(count), reason) for reason, count in (*survey.rejected.items(), ("none", survey.passing)))
    counts = Counter((proof.verdict, proof.assembles, proof.reason) for proof in certificates)
    proved = ((count, *what) for what, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])))
    tables = [
        _summary(context, survey, certificates),
        table("Grashof's classes, proved and found", _CLASS_COLUMNS, classes, _CLASS_NOTE),
        table("Rejected sets, by limit", ("sets", "first limit missed"), limits),
        table("What is proved about the best sets", ("sets", "verdict", "assembled", "reason"), proved, _PROOF_NOTE),
    ]
    if survey.failed:
        title = f"Shards that failed: {len(survey.failed)}"
        tables.insert(0, table(title, ("shard and reason",), ((text,) for text in survey.failed)))
    return records, tuple(tables)


def findings(survey: Survey, certificates: tuple[Certificate, ...]) -> tuple[Finding, ...]:
    """Return the numbers of the survey and, in words, what was rejected and how sure all that is."""
    proved = Counter(certificate.free for certificate in certificates)
    found = [
        Finding("dimension sets looked at", value=grouped(survey.sets)),
        Finding("keep all limits", value=grouped(survey.passing)),
        Finding("of the best proved free", True if proved[True] else None, grouped(proved[True])),
    ]
    if proved[False]:
        found.append(Finding("of the best proved to bind within the tolerances", False, grouped(proved[False])))
    if proved[None]:
        found.append(Finding("of the best undecided", None, grouped(proved[None])))
    if survey.failed:
        found.append(Finding("shards failed", False, grouped(len(survey.failed))))
    # lengths of the best set that are the first or last of their ranges
    lattice, edges = survey.lattice, []
    for frame, _, coupler, rocker in lattice.lengths(np.array(survey.chosen[:1], dtype=np.int64)).tolist():
        lengths = (("frame", frame), ("coupler", coupler), ("rocker", rocker))
        for (name, length), span in zip(lengths, (lattice.frame, lattice.coupler, lattice.rocker)):
            if len(span) > 1 and length in (span[0], span[-1]):
                end = "shortest" if length == span[0] else "longest"
                edges.append(f"{name} {float(length * lattice.unit):.12g} is the {end}")
    if edges:
        words = f"The best set is on the edge of the lattice ({', '.join(edges)} of its range)"
        found.append(Finding(f"{words}: better ones may lie beyond; widen the range.", False))
    return (*found, *_sentences(survey))


def _sentences(survey: Survey) -> tuple[Finding, Finding]:
    """Say what was rejected; compare the motion with the exact class, and say what rests on floating point."""
    counts = sorted(survey.rejected.items(), key=lambda item: (-item[1], item[0]))
    reasons = "; ".join(f"{grouped(count)} because {reason}" for reason, count in counts if count)
    total = sum(survey.rejected.values())
    share = f"{100.0 * survey.passing / survey.sets:.3g} %" if survey.sets else "none"
    agree = survey.disagreements == 0
    words = (
        "in every set the computed motion agrees with the exact class"
        if agree
        else f"in {grouped(survey.disagreements)} sets the computed motion disagrees with the exact class"
    )
    return (
        Finding(
            f"Of {grouped(survey.sets)} sets {grouped(survey.passing)} ({share}) keep all limits. "
            f"Rejected: {grouped(total)}{': ' + reasons if reasons else ''} "
            "(each counted at the first limit it misses)."
        ),
        Finding(
            f"Whether a crank turns is decided exactly; {words}. The bearing is certified for the "
            f"{grouped(len(survey.chosen))} best, tolerances included; for the others it is estimated in closed form.",
            None if agree else False,
        ),
    )


def _ordered(context: Context, survey: Survey, done: list[Any]) -> Survey:
    """Order the sets of all shards."""
    objectives = objectives_of(context)
    rows = np.frombuffer(b"".join(b64decode(shard["losses"]) for shard in done), dtype="<f8")
    table = rows.reshape(-1, 1 + len(objectives))
    table = table[np.isfinite(table).all(axis=1)]
    if not len(table):
        return survey
    sets, losses = table[:, 0].astype(np.int64), table[:, 1:]
    leading = np.flatnonzero(np.isin(sets, [number for shard in done for number in shard["front"]]))
    front = leading[front_of(losses[leading])]
    low, span = losses.min(axis=0), np.ptp(losses, axis=0)
    parts = 1.0 - (losses - low) / np.where(span > 0.0, span, 1.0)
    weights = np.array([objective.weight for objective in objectives])
    scores = np.round((parts * weights).sum(axis=1) / weights.sum(), DIGITS)
    behind = np.ones(len(sets), dtype=np.bool_)
    behind[front] = False
    best = np.lexsort((sets, -scores, behind))[: context.scene.mechanism.certify]
    places = [np.searchsorted(np.sort(column), column[best]).tolist() for column in losses.T]
    return replace(
        survey,
        ranked=len(sets),
        front=tuple(np.sort(sets[front]).tolist()),
        chosen=tuple(sets[best].tolist()),
        scores=tuple(scores[best].tolist()),
        places=tuple(zip(*places, strict=True)),
    )


def rank(context: Context, survey: Any, records: tuple[Record, ...]) -> Ranking:
    """Give the certified sets with their places among all sets that pass: they do not depend on how many there are."""
    objectives = objectives_of(context)
    margins = [{margin.name: margin.value for margin in record.margins} for record in records]
    front = set(survey.front)
    return Ranking(
        objectives,
        tuple(record.number for record in records),
        survey.scores,
        tuple(record.number for record, number in zip(records, survey.chosen, strict=True) if number in front),
        tuple(tuple(own.get(o.quantity, math.nan) for o in objectives) for own in margins),
        places=survey.places,
        ranked=survey.ranked,
        front_size=len(survey.front),
    )
