"""From outcomes of candidates to records: those that came through, and those that did not with their reasons."""

from __future__ import annotations

from dataclasses import replace

from graphsynth.pipeline.products import Outcome, Record
from graphsynth.pipeline.stages import Context

__all__ = ["records"]


def records(context: Context, outcomes: tuple[Outcome, ...]) -> tuple[Record, ...]:
    """Return one record per candidate, in their order.

    Examples
    --------
    >>> records(None, (Outcome(2, "k", status="rejected", stage="goals", cause="too long", reason="too long: 3 m"),))[0]
    ... # doctest: +ELLIPSIS
    Record(number=2, key='k', ..., status='rejected', ..., reason='too long: 3 m', cause='goals: too long')
    """
    return tuple(map(_record, outcomes))


def _record(outcome: Outcome) -> Record:
    if outcome.status == "assessed":
        record: Record = outcome.products["record"]
        return replace(record, number=outcome.number, key=outcome.key, solution=outcome.solution)
    return Record(
        outcome.number,
        outcome.key,
        outcome.solution,
        outcome.status,
        reason=outcome.reason,
        cause=f"{outcome.stage}: {outcome.cause}",
    )
