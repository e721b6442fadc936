"""What a run says in a few tables, for the terminal and for the page alike."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from graphsynth.scenes.products import Record, Table

if TYPE_CHECKING:
    from graphsynth.scenes.runner import Report
    from graphsynth.structure.assortment import LinkAssortment

__all__ = ["summary_tables"]


def summary_tables(report: Report) -> tuple[Table, ...]:
    """Return what the terminal and the top of the page show: solutions, candidates, results, times."""
    tables = []
    products = report.products
    if "solutions" in products:
        tables.append(_solutions_table(products["solutions"]))
    if any(record.key for record in products.get("records", ())):
        tables.append(_verdict_table(products["records"]))
    for value in products.values():
        tables += [item for item in value if isinstance(item, Table)] if isinstance(value, tuple) else []
    rows = [(t.stage, f"{t.import_seconds:.3f}", f"{t.seconds:.3f}") for t in report.times]
    total = (sum(t.import_seconds for t in report.times), sum(t.seconds for t in report.times))
    rows.append(("total", f"{total[0]:.3f}", f"{total[1]:.3f}"))
    tables.append(
        Table("Time per stage", ("stage", "import [s]", "run [s]"), tuple(rows), "Wall clock, one measurement.")
    )
    return tuple(tables)


def _solutions_table(solutions: tuple[LinkAssortment, ...]) -> Table:
    """Lay out the integer solutions; of several, what is the same in all of them is said once, in the note."""
    from graphsynth.structure.assortment import solutions_table

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


def _verdict_table(records: tuple[Record, ...]) -> Table:
    counts = Counter(
        (r.solution, r.status, r.recognised_as, r.verdict, "" if r.status == "assessed" else r.reason) for r in records
    )
    columns = ("count", "assortment", "status", "recognised as", "verdict", "reason")
    rows = [(str(count), *key) for key, count in counts.items()]
    told = [i for i in range(len(columns)) if any(row[i] for row in rows)]
    shown = tuple(tuple(row[i] for i in told) for row in rows)
    return Table(f"Candidates: {len(records)}", tuple(columns[i] for i in told), shown)
