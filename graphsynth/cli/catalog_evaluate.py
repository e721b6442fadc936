"""``graphsynth catalog evaluate``."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.cli import console
from graphsynth.cli.workers import workers_for
from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from graphsynth.atlas.catalogue import Catalogue
    from graphsynth.atlas.evaluating import EvaluationStep

_DEFAULT_LIMIT = 0.3


def add_evaluate(
    own: argparse._SubParsersAction[argparse.ArgumentParser],
    numbers: Callable[[str], list[int]],
    limit: Callable[[str], int],
    workers: Callable[[str], int],
) -> None:
    """Add the action; the functions read N..M, a number that may be 0, and a number of processes."""
    summary = (
        "Find dimensions with which mechanisms turn; store them with transmission and, if asked, a jamming verdict."
    )
    parser = own.add_parser("evaluate", help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(module="catalog_evaluate")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("file", type=Path, metavar="FILE", help="the catalogue")
    parser.add_argument("--links", type=numbers, metavar="N..M", help="numbers of links (default all)")
    parser.add_argument("--mobility", type=numbers, metavar="W..V", help="mobilities (default all)")
    parser.add_argument(
        "--per-chain", type=limit, default=1, metavar="N",
        help="mechanisms of each chain, those of the smallest groups first (default 1; 0: all)",
    )  # fmt: skip
    parser.add_argument(
        "--limit", type=limit, metavar="N", default=0, help="evaluate at most N mechanisms now (default 0: all)"
    )
    parser.add_argument("--seed", type=limit, default=0, metavar="S", help="of the search for dimensions (default 0)")
    parser.add_argument("--tries", type=limit, default=4, metavar="N", help="searches for each mechanism (default 4)")
    parser.add_argument(
        "--tilt", type=float, metavar="DEGREES",
        help="prove whether it jams when the axis of the first driver is tilted by at most this, in any direction",
    )  # fmt: skip
    parser.add_argument(
        "--joint-limit", type=float, metavar="DEGREES",
        help=f"tilt that every joint takes up, with --tilt (default {_DEFAULT_LIMIT})",
    )  # fmt: skip
    parser.add_argument("--workers", type=workers, metavar="K", help="worker processes (default one)")


def run(options: argparse.Namespace) -> int:
    """Evaluate, and say what the catalogue now holds."""
    from graphsynth.atlas.catalogue import Catalogue
    from graphsynth.core.ordered import processes

    if options.joint_limit is not None and options.tilt is None:
        raise SpecError("--joint-limit goes with --tilt; give both, or neither")
    jamming = None
    if options.tilt is not None:
        limit = _DEFAULT_LIMIT if options.joint_limit is None else options.joint_limit
        jamming = math.radians(options.tilt), math.radians(limit)
    begin = time.perf_counter()
    with Catalogue(options.file) as catalogue:
        try:
            with processes(workers_for(options.workers, False)) as executor, _progress() as watch:
                done = catalogue.evaluate(
                    options.links, options.mobility, per_chain=options.per_chain, limit=options.limit or None,
                    seed=options.seed, tries=options.tries, jamming=jamming, executor=executor, watch=watch,
                )  # fmt: skip
        except KeyboardInterrupt:
            console.note(f"{options.file} keeps what is evaluated: give the same command to go on")
            raise
        held = _held(catalogue)
    seconds = round(time.perf_counter() - begin, 3)
    if options.json:
        console.put_json({"file": str(options.file), "evaluated": done, "held": held, "seconds": seconds})
        return 0
    for row in held:
        sure = f" ({row['guarantee']})" if row["guarantee"] else ""
        console.put(f"{row['kind']:12}  {row['status']}{sure}: {row['count']}{_range(row)}")
    console.put(f"{options.file}: {done} evaluated now ({seconds:.1f} s)")
    return 0


def _held(catalogue: Catalogue) -> list[dict[str, Any]]:
    """Count what is stored, by kind, status and guarantee."""
    rows: list[dict[str, Any]] = catalogue.sql(
        "SELECT kind, status, COALESCE(guarantee, '') AS guarantee, COUNT(*) AS count, MIN(value) AS least, "
        "MAX(value) AS most FROM evaluations GROUP BY kind, status, guarantee ORDER BY kind, status, guarantee"
    ).to_dict("records")
    return [
        {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in row.items()}
        for row in rows
    ]


def _range(row: dict[str, Any]) -> str:
    if row["kind"] != "transmission" or row["least"] is None:
        return ""
    return f", {math.degrees(row['least']):.1f} to {math.degrees(row['most']):.1f} degrees"


@contextmanager
def _progress() -> Iterator[Callable[[EvaluationStep], None] | None]:
    """Show how many mechanisms are evaluated."""
    from graphsynth.synthesis.writing import Step

    with console.progress("evaluating") as watch:
        yield None if watch is None else lambda step: watch(Step(step.done, step.done / max(step.total, 1)))
