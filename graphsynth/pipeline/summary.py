"""What a run says on terminal and page alike: the first screen in sentences and numbers, then a few tables."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Finding, Ranking, Record, Table
from graphsynth.pipeline.units import behind, grouped

if TYPE_CHECKING:
    from graphsynth.pipeline.stages import Report
    from graphsynth.structure.system.assortment import LinkAssortment

#: Verdicts told in words; more are read in the tables.
_VERDICTS = 4
#: Reasons of rejection told in words; all are counted in a table of their own.
_REASONS = 3
#: Margins of a single record that are shown as numbers.
_MARGINS = 6


def sentences(report: Report) -> tuple[Finding, ...]:
    """Return the answer in words, the most important first; nothing without ``records``, ``ranking`` or ``tables``."""
    records: tuple[Record, ...] = report.products.get("records", ())
    rankings = [value for value in report.products.values() if isinstance(value, Ranking)]
    found = [told for ranking in rankings for told in _best(ranking, records)]
    given = [finding for table in _given(report) for finding in table.findings if not finding.value]
    few = sum(record.status == "assessed" for record in records) <= _VERDICTS
    found += (_verdicts(records) if few or not given else []) + given
    found += _nothing_left(records) + (_rejected(records) if len(records) > 1 else [])
    found += [told for ranking in rankings for told in _how_sure(ranking, records)]
    return tuple(found)


def facts(report: Report) -> tuple[Finding, ...]:
    """Return the numbers of the first screen: `Finding` with a value, what it counts, and its tone."""
    products = report.products
    found = [finding for table in _given(report) for finding in table.findings if finding.value]
    records: tuple[Record, ...] = products.get("records", ())
    counts: Counter[str] = Counter(record.status for record in records)
    if counts["assessed"] == 1 and not counts["rejected"] + counts["failed"]:
        for margin in next(record for record in records if record.status == "assessed").margins[:_MARGINS]:
            number = f"{margin.value:.4g}{behind(margin.unit)}"
            found.append(Finding(f"{margin.name} ({margin.guarantee})", value=number))
    plain = len(records) == counts["assessed"] == 1  # one answer: nothing was chosen from
    if "solutions" in products and not (plain and len(products["solutions"]) == 1):
        count = len(products["solutions"])
        found.append(Finding("integer solutions" if count != 1 else "integer solution", value=str(count)))
    if any(record.key for record in records) and not plain:
        found.append(Finding(f"candidate mechanism{'s' * (len(records) > 1)}", value=str(len(records))))
        for status, good in (("assessed", None), ("not recognised", None), ("rejected", None), ("failed", False)):
            if counts[status] or status == "assessed":
                found.append(Finding(status, good, str(counts[status])))
    fronts = [value.front_size for value in products.values() if isinstance(value, Ranking) and value.front]
    found += [Finding("on the Pareto front", value=str(size)) for size in fronts]
    return (*found, *_per_candidate(report), Finding("run time", value=f"{report.seconds:.1f} s"))


def _per_candidate(report: Report) -> list[Finding]:
    """Time of all stages for each candidate over the number of those that this run took up."""
    each = {stage.name for stage in report.stages if stage.each}
    spent = [time for time in report.times if time.stage in each]
    count = max((time.runs for time in spent), default=0)
    if count < 2:
        return []
    return [Finding("time per candidate", value=f"{math.fsum(time.seconds for time in spent) / count:.2g} s")]


def _given(report: Report) -> list[Table]:
    """Return the tables of stages, which may have something to say."""
    tuples = [value for value in report.products.values() if isinstance(value, tuple)]
    return [item for value in tuples for item in value if isinstance(item, Table)]


def _best(ranking: Ranking, records: Sequence[Record]) -> list[Finding]:
    """Name the first of the ranking, and the first one with a good verdict if that is another one."""
    if not ranking.numbers:
        return [Finding("Nothing is left to rank: no candidate has all objectives.", False)] if records else []
    by_number = {record.number: record for record in records}
    order = [by_number[number] for number in ranking.numbers if number in by_number]
    if not order:
        return []
    which = f"Best of {grouped(ranking.ranked)} ranked" if ranking.ranked > 1 else "The only one left"
    found = [Finding(f"{which}: {_one(ranking, order[0])}.", order[0].good)]
    if order[0].good is not True:
        better = next((record for record in order if record.good), None)
        if better is not None:
            found.append(Finding(f"Best with a good verdict: {_one(ranking, better)}.", True))
        elif any(record.good is not None for record in order):
            found.append(Finding("None of the ranked candidates has a good verdict.", False))
    return found


def _one(ranking: Ranking, record: Record) -> str:
    """Describe a candidate: what it is, the values of the objectives with their places, its score, its verdict.

    A place is how a value stands among all ranked ones: ``"smallest"``, ``"3rd largest"``, ``"2nd nearest to 5"``.
    """
    place = ranking.numbers.index(record.number)
    units = {margin.name: behind(margin.unit) for margin in record.margins}
    words: dict[object, str] = {"min": "smallest", "max": "largest"}
    told = []
    for objective, value, better in zip(ranking.objectives, ranking.values[place], ranking.places[place], strict=True):
        word = words.get(objective.goal) or f"nearest to {objective.goal:g}"
        rank = f"{_ordinal(better + 1)} " if better else ""
        told.append(f"{objective.quantity} {value:.4g}{units.get(objective.quantity, '')} ({rank}{word})")
    known = f", {record.solution}" if record.solution else ""
    weights = ":".join(f"{objective.weight:g}" for objective in ranking.objectives)
    weighed = f" with weights {weights}" if len(ranking.objectives) > 1 else ""
    verdict = f"; {record.verdict}" if record.verdict else ""
    return f"no. {record.number}{known}: {', '.join(told)}; score {ranking.scores[place]:.2f} of 1{weighed}{verdict}"


def _ordinal(number: int) -> str:
    """Return a number as an ordinal.

    >>> [_ordinal(n) for n in (1, 2, 3, 4, 11, 12, 13, 21, 112)]
    ['1st', '2nd', '3rd', '4th', '11th', '12th', '13th', '21st', '112th']
    """
    ending = {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ending}"


def _verdicts(records: Sequence[Record]) -> list[Finding]:
    """Tell each verdict once, with the number of candidates it holds for if there are several."""
    assessed = [record for record in records if record.status == "assessed" and record.verdict]
    counts = Counter((record.verdict, record.good) for record in assessed)
    found, rest = [], len(assessed)
    for (verdict, good), count in counts.most_common(_VERDICTS):
        those = "All" if count == len(records) else f"{count} of the"
        several = f"{those} {len(records)} candidates have the verdict: {verdict}."
        found.append(Finding(several if len(assessed) > len(counts) else f"{verdict[:1].upper()}{verdict[1:]}.", good))
        rest -= count
    if len(counts) > _VERDICTS:
        found.append(Finding(f"{rest} more with {len(counts) - _VERDICTS} other verdicts: see results.csv."))
    return found


def _nothing_left(records: Sequence[Record]) -> list[Finding]:
    """Say so when no candidate came through."""
    stopped = [record for record in records if record.status in ("rejected", "failed")]
    if not stopped or any(record.status == "assessed" for record in records):
        return []
    if len(records) > 1:
        return [Finding(f"None of the {len(records)} candidates came through all stages.", False)]
    words, why = "was rejected" if stopped[0].status == "rejected" else "failed", stopped[0].reason or stopped[0].cause
    return [Finding(f"The only candidate {words}: {why.removesuffix('.')}.", False)]


def _rejected(records: Sequence[Record]) -> list[Finding]:
    """Count the reasons of those that were rejected."""
    ended = (r.cause or r.reason for r in records if r.status in ("rejected", "failed"))
    causes = _counted(re.sub(r"^[a-z_]+: ", "", cause) for cause in ended)  # the stage stands in the table of reasons
    total = sum(count for _, count in causes)
    if not causes:
        return []
    if len(causes) == 1 and total > 1:
        why = causes[0][0].removesuffix(".")
        return [Finding(f"Rejected: {total} of {len(records)}, all for the same reason: {why}.")]
    told = causes if len(causes) == _REASONS + 1 else causes[:_REASONS]
    listed = "; ".join(f"{count} ({cause.removesuffix('.')})" for cause, count in told)
    rest = sum(count for _, count in causes[len(told) :])
    more = f"; {rest} for {len(causes) - len(told)} other reasons" if rest else ""
    return [Finding(f"Rejected: {total} of {len(records)}: {listed}{more}.")]


def _how_sure(ranking: Ranking, records: Sequence[Record]) -> list[Finding]:
    """Say which of the objectives are proved and which are estimated."""
    ranked = set(ranking.numbers)
    kinds: dict[str, list[str]] = {}
    for objective in ranking.objectives:
        found = {m.guarantee for r in records if r.number in ranked for m in r.margins if m.name == objective.quantity}
        if found:
            weakest = next(kind for kind in ("estimated", "certified", "exact") if kind in found)
            kinds.setdefault(weakest, []).append(objective.quantity)
    words = {"certified": "certified (proved bounds)", "estimated": "estimated in floating point, not proved"}
    told = [f"{', '.join(names)}: {words.get(kind, kind)}" for kind, names in kinds.items()]
    return [Finding(f"Guarantee of the objectives: {'; '.join(told)}.")] if told else []


def summary_tables(report: Report) -> tuple[Table, ...]:
    """Return what the terminal and the top of the page show: solutions, candidates, results, times."""
    products, records = report.products, report.products.get("records", ())
    tables = [_solutions_table(products["solutions"])] if "solutions" in products else []
    if any(record.key for record in records):
        tables.append(_verdict_table(records))
    stopped = _counted((r.status, r.cause or r.reason) for r in records if r.status in ("rejected", "failed"))
    if stopped:
        rows = ((count, *key) for key, count in stopped)
        tables.append(table("Rejected and failed candidates, by reason", ("count", "status", "reason"), rows))
    tables += [_ranking_table(value, report) for value in products.values() if isinstance(value, Ranking)]
    return (*tables, *_given(report), _times_table(report))


def _times_table(report: Report) -> Table:
    rows: list[tuple[object, ...]] = [
        (t.stage, t.runs, t.import_seconds, t.seconds, 1e6 * t.peak_mb if math.isfinite(t.peak_mb) else "unknown")
        for t in report.times
    ]
    sums = (math.fsum(getattr(t, name) for t in report.times) for name in ("import_seconds", "seconds"))
    rows.append(("total", None, *sums, None))
    note = (
        "Wall clock and resident memory, one measurement; of stages for each candidate, the sum over candidates, in "
        f"whichever process. The run took {report.seconds:.1f} s."
    )
    columns = ("stage", "runs", "import [s] | .3f", "run [s] | .3f", "peak [MB] | .0f")
    return table("Time per stage", columns, rows, note)


def _counted(found: Iterable[Hashable]) -> list[tuple[Any, int]]:
    """Count, the most frequent first; those as frequent in their own order."""
    return sorted(Counter(found).items(), key=lambda item: (-item[1], item[0]))


def _ranking_table(ranking: Ranking, report: Report) -> Table:
    """List the best candidates with the values of their objectives."""
    most = report.scene.ranking.show if report.scene.ranking else len(ranking.numbers)
    places = list(enumerate(zip(ranking.numbers, ranking.scores, ranking.values), 1))[:most]
    rows = ((place, number, score, number in ranking.front, *row) for place, (number, score, row) in places)
    margins = (margin for record in report.products.get("records", ()) for margin in record.margins if margin.unit)
    units = {margin.name: f" [{behind(margin.unit).strip()}]" for margin in margins}
    sought = (o.goal if isinstance(o.goal, str) else f"near {o.goal:g}" for o in ranking.objectives)
    goals = (f"{o.quantity}{units.get(o.quantity, '')} ({goal})" for o, goal in zip(ranking.objectives, sought))
    weights = ", ".join(f"{o.weight:g}" for o in ranking.objectives)
    note = (
        f"On the Pareto front: {grouped(ranking.front_size)} of {grouped(ranking.ranked)} ranked; no other candidate "
        f"is at least as good in every objective and better in one. Score: weighted mean (weights {weights}) of the "
        "objectives, each scaled from 0 (worst of all) to 1 (best of all)."
    )
    if ranking.unranked:
        note += f" {len(ranking.unranked)} without all objectives are not ranked ({ranking.unranked[0][1]}, ...)."
    columns = ("place", "candidate", "score | .4f", "Pareto front", *(f"{goal} | .8g" for goal in goals))
    return table("Ranking", columns, rows, note)


def _solutions_table(solutions: tuple[LinkAssortment, ...]) -> Table:
    """Lay out the integer solutions; of several, what is the same in all of them is said once, in the note."""
    from graphsynth.structure.system.assortment import solutions_table

    header, rows = solutions_table(solutions)
    several = len(rows) > 1
    shown = [i for i, name in enumerate(header) if not several or len({row[i] for row in rows}) > 1]
    common = ", ".join(f"{name} = {rows[0][i]}" for i, name in enumerate(header) if i not in shown) if rows else ""
    title, cells = f"Integer solutions of the structural system: {len(rows)}", ([row[i] for i in shown] for row in rows)
    return table(title, [header[i] for i in shown], cells, f"In all of them {common}." if common else "")


#: Rows of the table of candidates; a search with more kinds of outcomes is read in results.csv.
_MOST = 40


def _verdict_table(records: tuple[Record, ...]) -> Table:
    """Count the candidates by what became of them; reasons of those rejected have a table of their own."""
    counts = Counter(
        (r.solution, r.status, r.recognised_as, r.verdict or (r.reason if r.status == "not recognised" else ""))
        for r in records
    )
    columns = ("count", "assortment", "status", "recognised as", "verdict or reason")
    rows = [(count, *key) for key, count in counts.items()]
    told = [i for i in range(len(columns)) if any(row[i] for row in rows)]
    shown = ([row[i] for i in told] for row in rows[:_MOST])
    note = f"{len(rows) - _MOST} more kinds of outcomes are in results.csv." if len(rows) > _MOST else ""
    return table(f"Candidates: {len(records)}", [columns[i] for i in told], shown, note)
