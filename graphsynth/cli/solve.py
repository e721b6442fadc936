"""``graphsynth solve``."""

from __future__ import annotations

import argparse

from graphsynth.cli import console
from graphsynth.cli.question import spec_of
from graphsynth.structure.system.assortment import solutions_table

MOST_DRAWN = 1000  # rows of a table with lines, which takes a millisecond a row


def run(options: argparse.Namespace) -> int:
    """Print the integer solutions."""
    spec = spec_of(options)
    solutions = spec.solve()
    if options.json:
        console.put_json([solution.as_dict() for solution in solutions])
        return 0
    header, rows = solutions_table(solutions)
    console.put(spec.describe())
    title = f"{len(solutions)} integer solution{'s' * (len(solutions) != 1)}"
    cells = [list(map(str, row)) for row in rows]
    if len(rows) <= MOST_DRAWN:
        console.table(title, list(header), cells)
        return 0
    widths = [max(map(len, column)) for column in zip(header, *cells)]
    console.put(title)
    for row in (header, *cells):
        console.put(" ".join(cell.rjust(width) for cell, width in zip(row, widths)))
    return 0
