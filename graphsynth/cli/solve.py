"""``graphsynth solve``."""

from __future__ import annotations

import argparse

from graphsynth.cli import console
from graphsynth.cli.question import spec_of

__all__ = ["run"]


def run(options: argparse.Namespace) -> int:
    """Print the integer solutions."""
    from graphsynth.structure.spec import solutions_table

    spec = spec_of(options)
    solutions = spec.solve()
    if options.json:
        console.put_json([solution.as_dict() for solution in solutions])
        return 0
    header, rows = solutions_table(solutions)
    console.put(spec.describe())
    console.table(f"{len(solutions)} integer solutions", list(header), [list(map(str, row)) for row in rows])
    return 0
