"""What a run says in a few tables, for the terminal and for the page alike."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from graphsynth.scenes.products import Record, Table

if TYPE_CHECKING:
    from graphsynth.scenes.runner import Report

__all__ = ["summary_tables"]


def summary_tables(report: Report) -> tuple[Table, ...]:
    """Return what the terminal and the top of the page show: solutions, candidates, results, times."""
    tables = []
    products = report.products
    if "solutions" in products:
        tables.append(_solutions_table(products["solutions"]))
    if "records" in products:
        tables.append(_verdict_table(products["records"]))
    tables += products.get("tables", ())
    rows = [(t.stage, f"{t.import_seconds:.3f}", f"{t.seconds:.3f}") for t in report.times]
    total = (sum(t.import_seconds for t in report.times), sum(t.seconds for t in report.times))
    rows.append(("total", f"{total[0]:.3f}", f"{total[1]:.3f}"))
    tables.append(
        Table("Time per stage", ("stage", "import [s]", "run [s]"), tuple(rows), "Wall clock, one measurement.")
    )
    return tuple(tables)


def _solutions_table(solutions: tuple[Any, ...]) -> Table:
    """Lay out the integer solutions; variables that are the same in all of them are shown once, in the note."""
    values = [solution_values(solution) for solution in solutions]
    names = list(dict.fromkeys(name for value in values for name in value))
    varying = [n for n in names if len(values) == 1 or len({value.get(n, 0) for value in values}) > 1]
    rows = tuple((str(i + 1), *(str(value.get(n, 0)) for n in varying)) for i, value in enumerate(values))
    common = ", ".join(f"{n} = {values[0].get(n, 0)}" for n in names if n not in varying) if values else ""
    note = f"In all of them {common}." if common else ""
    return Table(f"Integer solutions of the structural system: {len(values)}", ("no.", *varying), rows, note)


def solution_values(solution: Any) -> dict[str, int]:
    """Return the variables of a solution by name, ``n_a`` and ``p_i`` spelled out."""
    return dict(solution.as_dict()) if hasattr(solution, "as_dict") else dict(solution)


def _verdict_table(records: tuple[Record, ...]) -> Table:
    counts = Counter(
        (r.solution, r.status, r.recognised_as, r.verdict, "" if r.status == "assessed" else r.reason) for r in records
    )
    rows = tuple((str(count), *key) for key, count in counts.items())
    return Table(
        f"Candidates: {len(records)}", ("count", "assortment", "status", "recognised as", "verdict", "reason"), rows
    )
