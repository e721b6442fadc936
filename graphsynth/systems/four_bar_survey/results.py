"""Stages of a four-bar survey over all shards: gather, certify the best, records, tables and the answer."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from graphsynth.mechanism.rotatability import KINDS, TYPES
from graphsynth.pipeline.products import Finding, Outcome, Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.systems.four_bar_survey.lattice import Lattice, lattice_of
from graphsynth.systems.four_bar_survey.order import Order, edges_of, order_of
from graphsynth.systems.four_bar_survey.system import SurveyTable

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.parameters import ToleranceBox

_PIECE = 20  # certificates made in one go


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """All shards together.

    Attributes
    ----------
    lattice : Lattice
    sets, positions, passing : int
        Dimension sets and crank positions computed, sets that keep the limits.
    classes : dict of (type, kind, kind found) to int
        Places in `TYPES` and `KINDS`.
    turned_down : dict of str to int
    maps : dict of str to list
        Columns by pair of frame and coupler.
    order : Order
        Of all sets that pass, as far as it is used.
    failed : tuple of str
        Shards that failed, with the reason.
    """

    lattice: Lattice
    sets: int
    positions: int
    passing: int
    classes: dict[tuple[int, int, int], int]
    turned_down: dict[str, int]
    maps: dict[str, list[Any]]
    order: Order
    failed: tuple[str, ...]

    @property
    def front(self) -> tuple[int, ...]:
        """Sets that pass and that no other set beats in every objective."""
        return self.order.front

    @property
    def chosen(self) -> tuple[int, ...]:
        """The best sets of all that pass, the best first; as many as are certified."""
        return self.order.best

    @property
    def disagreements(self) -> int:
        """Sets whose motion is not the one that integer arithmetic proves."""
        return sum(count for (_, kind, found), count in self.classes.items() if kind != found)


def gather(context: Context, outcomes: tuple[Outcome, ...]) -> Survey:
    """Put the shards together: counts, maps, the Pareto front of all sets, the best by score."""
    done: list[Any] = [outcome.products["surveyed"] for outcome in outcomes if outcome.status == "assessed"]
    classes: Counter[tuple[int, int, int]] = Counter()
    turned_down: Counter[str] = Counter()
    maps: dict[str, list[Any]] = {}
    for shard in done:
        for type_, kind, found, count in shard["classes"]:
            classes[type_, kind, found] += count
        turned_down.update(shard["rejected"])
        for name, column in shard["maps"].items():
            maps.setdefault(name, []).extend(column)
    return Survey(
        lattice_of(context),
        sum(shard["sets"] for shard in done),
        sum(shard["positions"] for shard in done),
        sum(shard["passing"] for shard in done),
        dict(classes),
        dict(turned_down),
        maps,
        order_of(context, done),
        tuple(f"{o.key}: {o.reason}" for o in outcomes if o.status == "failed"),
    )


@dataclass(frozen=True, slots=True)
class Certificate:
    """What is proved about one set, with the tolerances of the scene.

    Attributes
    ----------
    verdict, reason : str
        Of `certify_jamming`.
    free : bool or None
        Proved free, proved jammed (for all or for some), or neither.
    assembles : str
        At how much of the turn the tilted linkage is proved to be assembled.
    clearance_left, critical_tilt : tuple of float
        Bounds of the clearance left at the worst angle (mm), and of the critical tilt (radians).
    """

    number: int
    verdict: str
    free: bool | None
    assembles: str
    reason: str
    clearance_left: tuple[float, float]
    critical_tilt: tuple[float, float]


def certify(context: Context, survey: Survey) -> tuple[Certificate, ...]:
    """Prove for the best sets whether the bearing jams, in pieces on the executor."""
    from graphsynth.core.ordered import in_order

    pieces = [survey.chosen[k : k + _PIECE] for k in range(0, len(survey.chosen), _PIECE)]
    work = partial(_prove, replace(context, executor=None), survey.lattice)
    return tuple(proof for piece in in_order(context.executor, work, pieces) for proof in piece)


def _prove(context: Context, lattice: Lattice, sets: tuple[int, ...]) -> list[Certificate]:
    import numpy as np

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
                (found.critical_tilt.lo, found.critical_tilt.hi),
            )
        )
    return proofs


def box_of(context: Context, lattice: Lattice, lengths: list[int]) -> ToleranceBox:
    """Return the exact dimensions of a set with the tolerances of the scene."""
    from graphsynth.jamming.bearing.parameters import ToleranceBox, spread

    table: SurveyTable = context.scene.mechanism
    relative = _written(context, ("tolerances",), "lengths_percent", table.tolerances) / 100
    given: dict[str, Any] = {
        name: spread(length * lattice.unit, 0, relative) for name, length in zip(("l1", "l2", "l3", "l4"), lengths)
    }
    places = {"Rb": "radius_mm", "Hb": "height_mm", "clearance": "clearance_mm"}
    for name, field in places.items():
        nominal = _written(context, ("bearing",), field, table.bearing)
        given[name] = spread(nominal, _written(context, ("tolerances",), field, table.tolerances), 0)
    alpha = _written(context, ("tilt",), "alpha_rad", table.tilt)
    given["alpha"] = spread(alpha, _written(context, ("tolerances",), "alpha_rad", table.tolerances), 0)
    given["azimuth"] = spread(0, _written(context, ("tolerances",), "azimuth_rad", table.tolerances), 0)
    return ToleranceBox(**given, axis=list(table.tilt.axis))


def _written(context: Context, path: tuple[str, ...], field: str, table: object) -> Fraction:
    """Return a number as it stands in the file; as the double it is if the scene was changed after reading."""
    from graphsynth.pipeline.tables import written
    from graphsynth.pipeline.units import split_suffix

    raw: Any = context.scene.raw.get("mechanism", {})
    for key in path:
        raw = raw.get(key, {}) if isinstance(raw, dict) else {}
    value = float(getattr(table, field if hasattr(table, field) else split_suffix(field)[0]))
    number = written(raw, field)
    return number if number is not None and float(number) == value else Fraction(value)


def _records(context: Context, survey: Survey, certificates: tuple[Certificate, ...]) -> tuple[Record, ...]:
    import numpy as np

    from graphsynth.systems.four_bar_survey.stages import QUANTITIES, evaluate_sets

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


def _summary(context: Context, survey: Survey) -> Table:
    table: SurveyTable = context.scene.mechanism
    lattice = survey.lattice
    spans = [
        f"{name} {float(r[0] * lattice.unit):g} to {float(r[-1] * lattice.unit):g} ({len(r)})"
        for name, r in (("frame", lattice.frame), ("coupler", lattice.coupler), ("rocker", lattice.rocker))
    ]
    rows = (
        ("dimension sets", str(survey.sets)),
        ("lengths", f"crank {float(lattice.crank * lattice.unit):g}, {', '.join(spans)}"),
        ("crank positions computed", str(survey.positions)),
        ("motion against the exact class", f"{survey.disagreements} sets of {survey.sets} disagree"),
        ("keep all limits", str(survey.passing)),
        ("of these, on the Pareto front", str(len(survey.front))),
        ("certified", str(len(survey.chosen))),
    )
    note = f"{table.positions} crank positions a turn; the front is that of all sets, not only of the certified ones."
    return Table("The survey", ("", ""), rows, note)


def _class_table(survey: Survey) -> Table:
    """Exact type and kind against the kind found in motion."""
    rows = [
        (TYPES[type_], KINDS[kind], KINDS[found], str(count), "yes" if kind == found else "NO")
        for (type_, kind, found), count in sorted(survey.classes.items())
    ]
    note = (
        "Type and kind are decided in exact arithmetic (Grashof's rule, exact); the motion is that of the engine in "
        "floating point at the sampled crank angles, which contain both positions in line with the frame."
    )
    columns = ("type (exact)", "crank (exact)", "crank (found in motion)", "sets", "agree")
    return Table("Grashof's classes, proved and found", columns, tuple(rows), note)


def _limits_table(survey: Survey) -> Table:
    rows = tuple((str(count), reason) for reason, count in survey.turned_down.items())
    return Table("Rejected sets, by limit", ("sets", "first limit missed"), (*rows, (str(survey.passing), "none")))


def _proof_table(certificates: tuple[Certificate, ...]) -> Table:
    counts = Counter((proof.verdict, proof.assembles, proof.reason) for proof in certificates)
    rows = tuple((str(count), *what) for what, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])))
    note = "For the whole turn and every combination of the tolerances, with outward rounding."
    return Table("What is proved about the best sets", ("sets", "verdict", "assembled", "reason"), rows, note)


def assess(
    context: Context, survey: Survey, certificates: tuple[Certificate, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per certified set, and the tables of the survey, the first with its answer."""
    records = _records(context, survey, certificates)
    summary = replace(_summary(context, survey), findings=findings(survey, certificates))
    tables = [summary, _class_table(survey), _limits_table(survey), _proof_table(certificates)]
    if survey.failed:
        rows = tuple((text,) for text in survey.failed)
        tables.insert(0, Table(f"Shards that failed: {len(rows)}", ("shard and reason",), rows))
    return records, tuple(tables)


def findings(survey: Survey, certificates: tuple[Certificate, ...]) -> tuple[Finding, ...]:
    """Return the numbers of the survey and, in words, what was rejected and how sure all that is."""
    proved = Counter(certificate.free for certificate in certificates)
    found = [
        Finding("dimension sets looked at", value=_number(survey.sets)),
        Finding("keep all limits", value=_number(survey.passing)),
        Finding("of the best proved free", True if proved[True] else None, _number(proved[True])),
    ]
    if proved[False]:
        found.append(Finding("of the best proved to jam within the tolerances", False, _number(proved[False])))
    if proved[None]:
        found.append(Finding("of the best undecided", None, _number(proved[None])))
    if survey.failed:
        found.append(Finding("shards failed", False, _number(len(survey.failed))))
    return (*found, *_edge(survey), _rejected(survey), _motion(survey))


def _edge(survey: Survey) -> list[Finding]:
    """Warn if the best set is at the edge of the lattice."""
    import numpy as np

    if not survey.chosen:
        return []
    lengths = survey.lattice.lengths(np.array(survey.chosen[:1]))[0].tolist()
    edges = edges_of(survey.lattice, lengths)
    if not edges:
        return []
    words = f"The best set is on the edge of the lattice ({', '.join(edges)} of its range)"
    return [Finding(f"{words}: better ones may lie beyond; widen the range.", False)]


def _number(count: int) -> str:
    """Group thousands with a thin space, as ISO 80000 does."""
    return f"{count:,}".replace(",", "\u202f")


def _rejected(survey: Survey) -> Finding:
    counts = sorted(survey.turned_down.items(), key=lambda item: (-item[1], item[0]))
    reasons = "; ".join(f"{_number(count)} because {reason}" for reason, count in counts if count)
    total = sum(survey.turned_down.values())
    share = f"{100.0 * survey.passing / survey.sets:.3g} %" if survey.sets else "none"
    return Finding(
        f"Of {_number(survey.sets)} sets {_number(survey.passing)} ({share}) keep all limits. "
        f"Rejected: {_number(total)}{': ' + reasons if reasons else ''} (each counted at the first limit it misses)."
    )


def _motion(survey: Survey) -> Finding:
    """Compare the motion with the exact class, and say what rests on floating point."""
    agree = survey.disagreements == 0
    words = (
        "in every set the computed motion agrees with the exact class"
        if agree
        else f"in {_number(survey.disagreements)} sets the computed motion disagrees with the exact class"
    )
    return Finding(
        f"Whether a crank turns is decided exactly; {words}. The bearing is certified for the "
        f"{_number(len(survey.chosen))} best, tolerances included; for the others it is estimated in closed form.",
        None if agree else False,
    )
