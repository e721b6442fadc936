"""What became of candidates drawn at random, and what that says of all mechanisms of the question."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Finding
from graphsynth.pipeline.units import grouped

if TYPE_CHECKING:
    from graphsynth.pipeline.products import Record, Table
    from graphsynth.pipeline.stages import Context

_CONFIDENCE = 0.95
_SEARCHED = (
    "A mechanism that does not move is one for which the search found no dimensions within its effort, which is no "
    "proof that there are none."
)


def shares(context: Context, records: tuple[Record, ...]) -> tuple[Table, ...]:
    """Count verdicts and reasons of a sample, each share with its interval of Clopper and Pearson [1934].

    The number of all mechanisms is exact, the sample uniform among them; without a sample shares are exact.
    """
    from scipy.stats import binomtest

    from graphsynth.pipeline.steps import count_of, spec_of

    every, drawn = count_of(spec_of(context)), len(records)
    rows: list[tuple[object, ...]] = []
    moving = sum(record.status == "assessed" for record in records)
    told = Counter(_told(record) for record in records)
    if drawn == every:
        rows = [(name, count, f"{100.0 * count / every:.1f} %") for name, count in told.most_common()]
        moves = f"{moving} {'moves' if moving == 1 else 'move'} as asked"
        said = Finding(f"All {every} mechanisms were examined; {moves}." if every > 1 else f"There is one; {moves}.")
        return (
            table("What became of the mechanisms", ("what became of it", "number", "share"), rows, _SEARCHED, said),
        )
    verdicts = {record.verdict for record in records if record.status == "assessed"}
    listed = [(name, count) for name, count in told.most_common() if len(verdicts) > 1 or name not in verdicts]
    for name, count in [("moves as asked", moving), *listed]:
        low, high = binomtest(count, drawn).proportion_ci(_CONFIDENCE, "exact")
        few, many = (grouped(_rounded(end * every)) for end in (low, high))
        rows.append((name, count, f"{100.0 * low:.1f} to {100.0 * high:.1f} %", f"{few} to {many}"))
    low, high = (100.0 * end for end in binomtest(moving, drawn).proportion_ci(_CONFIDENCE, "exact"))
    said = Finding(
        f"Of {grouped(every)} mechanisms, {drawn} were drawn at random; {moving} move as asked. So {low:.1f} to "
        f"{high:.1f} % of all do with dimensions that this search finds ({_CONFIDENCE:.0%} confidence)."
    )
    note = f"Intervals of Clopper and Pearson, 95 % each. {_SEARCHED}"
    columns = ("what became of it", "of the sample", "share of all", "mechanisms")
    return (table(f"Shares of {grouped(every)} mechanisms", columns, rows, note, said),)


def _rounded(count: float) -> int:
    """Round to three digits.

    >>> _rounded(57_345_678.9), _rounded(12.3)
    (57300000, 12)
    """
    return int(float(f"{count:.3g}"))


def _told(record: Record) -> str:
    if record.status == "assessed":
        return record.verdict
    return record.cause.removeprefix("embody: ") if record.status == "rejected" else "failed"
