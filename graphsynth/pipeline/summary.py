"""What a run says in a few tables, for the terminal and for the page alike."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from graphsynth.pipeline.products import Ranking, Record, Table

if TYPE_CHECKING:
    from graphsynth.pipeline.runner import Report
    from graphsynth.structure.system.assortment import LinkAssortment

__all__ = ["summary_tables"]


def summary_tables(report: Report) -> tuple[Table, ...]:
    """Return what the terminal and the top of the page show: solutions, candidates, results, times."""
    tables = []
    products = report.products
    if "solutions" in products:
        tables.append(_solutions_table(products["solutions"]))
    if any(record.key for record in products.get("records", ())):
        tables.append(_verdict_table(products["records"]))
    if any(record.status in ("rejected", "failed") for record in products.get("records", ())):
        tables.append(_reasons_table(products["records"]))
    tables += [_ranking_table(value, report) for value in products.values() if isinstance(value, Ranking)]
    for value in products.values():
        tables += [item for item in value if isinstance(item, Table)] if isinstance(value, tuple) else []
    tables.append(_times_table(report))
    return tuple(tables)


def _times_table(report: Report) -> Table:
    rows = [(t.stage, str(t.runs), f"{t.import_seconds:.3f}", f"{t.seconds:.3f}", _mb(t.peak_mb)) for t in report.times]
    imports, seconds = math.fsum(t.import_seconds for t in report.times), math.fsum(t.seconds for t in report.times)
    rows.append(("total", "", f"{imports:.3f}", f"{seconds:.3f}", ""))
    note = (
        "Wall clock and resident memory, one measurement; of stages for each candidate, the sum over candidates, in "
        f"whichever process. The run took {report.seconds:.1f} s."
    )
    return Table("Time per stage", ("stage", "runs", "import [s]", "run [s]", "peak [MB]"), tuple(rows), note)


def _mb(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "unknown"


def _reasons_table(records: tuple[Record, ...]) -> Table:
    """Count why candidates were rejected or failed, the most frequent reason first."""
    counts = Counter((r.status, r.cause or r.reason) for r in records if r.status in ("rejected", "failed"))
    rows = tuple((str(count), *key) for key, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])))
    return Table("Why candidates were turned down", ("count", "status", "reason"), rows)


def _ranking_table(ranking: Ranking, report: Report) -> Table:
    """List the best candidates with the values of their objectives."""
    most = report.scene.ranking.show if report.scene.ranking else len(ranking.numbers)
    rows = tuple(
        (
            str(place),
            str(number),
            f"{score:.4f}",
            "yes" if number in ranking.front else "no",
            *(f"{v:.8g}" for v in row),
        )
        for place, (number, score, row) in enumerate(zip(ranking.numbers, ranking.scores, ranking.values), 1)
    )[:most]
    goals = tuple(
        f"{o.quantity} ({o.goal if isinstance(o.goal, str) else f'near {o.goal:g}'})" for o in ranking.objectives
    )
    weights = ", ".join(f"{o.weight:g}" for o in ranking.objectives)
    note = (
        f"{ranking.front_size} of {ranking.ranked} ranked candidates are on the Pareto front: no other one is at "
        f"least as good in every objective and better in one. Score: weighted mean (weights {weights}) of the "
        "objectives, each scaled from 0 (worst of all) to 1 (best of all)."
    )
    if ranking.unranked:
        note += f" {len(ranking.unranked)} without all objectives are not ranked ({ranking.unranked[0][1]}, ...)."
    return Table("Ranking", ("place", "candidate", "score", "Pareto front", *goals), rows, note)


def _solutions_table(solutions: tuple[LinkAssortment, ...]) -> Table:
    """Lay out the integer solutions; of several, what is the same in all of them is said once, in the note."""
    from graphsynth.structure.system.assortment import solutions_table

    header, rows = solutions_table(solutions)
    several = len(rows) > 1
    shown = [i for i, name in enumerate(header) if not several or len({row[i] for row in rows}) > 1]
    common = ", ".join(f"{name} = {rows[0][i]}" for i, name in enumerate(header) if i not in shown) if rows else ""
    return Table(
        f"Integer solutions of the structural system: {len(rows)}",
        tuple(header[i] for i in shown),
        tuple(tuple(str(row[i]) for i in shown) for row in rows),
        f"In all of them {common}." if common else "",
    )


#: Rows of the table of candidates; a search with more kinds of outcomes is read in results.csv.
_MOST = 40


def _verdict_table(records: tuple[Record, ...]) -> Table:
    """Count the candidates by what became of them; reasons of those turned down have a table of their own."""
    counts = Counter(
        (r.solution, r.status, r.recognised_as, r.verdict or (r.reason if r.status == "not recognised" else ""))
        for r in records
    )
    columns = ("count", "assortment", "status", "recognised as", "verdict or reason")
    rows = [(str(count), *key) for key, count in counts.items()]
    told = [i for i in range(len(columns)) if any(row[i] for row in rows)]
    shown = tuple(tuple(row[i] for i in told) for row in rows[:_MOST])
    note = f"{len(rows) - _MOST} more kinds of outcomes are in results.csv." if len(rows) > _MOST else ""
    return Table(f"Candidates: {len(records)}", tuple(columns[i] for i in told), shown, note)
