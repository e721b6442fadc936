"""What every mechanism module does alike: recognise a graph by its canonical key, and keep one record per candidate."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.products import Attempt, Candidate, Quantity, Recognised, Record

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

#: Words, whether they are good news, and margins, from the value of an outcome.
Verdict = Callable[[Any], tuple[str, bool, tuple[Quantity, ...]]]

__all__ = ["UNKNOWN", "recognise_by_key", "records_of"]

#: The reason of a candidate that no module knows: not a failure.
UNKNOWN = "no kinematic module yet recognises this graph"


def recognise_by_key(candidates: tuple[Candidate, ...], known: MechanismGraph, module: str) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to `known` (frame and joint mobilities respected) as belonging to `module`."""
    return tuple(
        Recognised(c, module) if c.graph.key == known.key else Recognised(c, None, UNKNOWN) for c in candidates
    )


def records_of(
    recognised: tuple[Recognised, ...],
    outcomes: tuple[Attempt, ...],
    verdict: Verdict,
) -> tuple[Record, ...]:
    """Return one record per candidate, in their order; `verdict` reads the value of an outcome."""
    by_number = {outcome.candidate.number: outcome for outcome in outcomes}
    return tuple(_record(item, by_number.get(item.candidate.number), verdict) for item in recognised)


def _record(item: Recognised, outcome: Attempt | None, verdict: Verdict) -> Record:
    candidate = item.candidate
    number, key, solution = candidate.number, candidate.graph.key, candidate.solution
    if outcome is None or item.module is None:
        return Record(number, key, solution, "not recognised", reason=item.reason)
    if outcome.failed:
        return Record(number, key, solution, "failed", item.module, reason=outcome.reason)
    words, good, margins = verdict(outcome.value)
    return Record(number, key, solution, "assessed", item.module, words, good, margins)
