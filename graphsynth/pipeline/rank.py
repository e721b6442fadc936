"""Ranking records by the objectives of a scene."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from operator import le

from graphsynth.pipeline.products import Objective, Ranking, Record
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import suggest

#: Decimals of a score: what differs by rounding alone is a tie.
DIGITS = 12


def rank(context: Context, records: tuple[Record, ...]) -> Ranking:
    """Rank the assessed records by ``[ranking]``.

    Raises
    ------
    SceneError
        If no record has a margin of the name of an objective.
    """
    table = context.scene.ranking
    assert table is not None  # a scene without [ranking] has no such stage
    objectives = tuple(
        Objective(o.quantity, o.goal if o.target is None else o.target, o.weight) for o in table.objectives
    )
    known = {margin.name for record in records for margin in record.margins}
    for i, objective in enumerate(objectives):
        if known and objective.quantity not in known:
            place = context.scene.place / "ranking" / "objectives" / str(i)
            raise place.error(
                f"has quantity = {objective.quantity!r}, which no record has{suggest(objective.quantity, known)}",
                "quantity",
            )
    return ranking_of(objectives, records)


def ranking_of(objectives: tuple[Objective, ...], records: Sequence[Record]) -> Ranking:
    """Rank the assessed records that have a finite value for every objective.

    Candidates of the Pareto front come first, then the others; both by falling score, ties by number.  The score is
    the weighted mean of the objectives, each scaled linearly to 0 (worst of all ranked) .. 1 (best of all ranked), to
    12 decimals.

    Examples
    --------
    >>> from graphsynth.pipeline.products import Quantity
    >>> records = [Record(n, margins=(Quantity("mass", m), Quantity("stroke", s)))
    ...            for n, m, s in ((1, 2.0, 5.0), (2, 1.0, 5.0), (3, 3.0, 9.0))]
    >>> found = ranking_of((Objective("mass", "min"), Objective("stroke", "max", 3.0)), records)
    >>> found.numbers, found.front
    ((3, 2, 1), (3, 2))
    """
    values: dict[int, tuple[float, ...]] = {}
    unranked: list[tuple[int, str]] = []
    for record in records:
        if record.status != "assessed":
            continue
        margins = {margin.name: float(margin.value) for margin in record.margins}
        row = tuple(margins.get(objective.quantity, math.nan) for objective in objectives)
        lacking = [o.quantity for o, value in zip(objectives, row, strict=True) if not math.isfinite(value)]
        if lacking:
            unranked.append((record.number, "no " + ", no ".join(lacking)))
        else:
            values[record.number] = row
    losses = {number: tuple(map(_loss, objectives, row)) for number, row in values.items()}
    scores = _scores(objectives, losses)
    front = set(_front(losses))
    columns = [sorted(column) for column in zip(*losses.values(), strict=True)]
    numbers = sorted(values, key=lambda number: (number not in front, -scores[number], number))
    return Ranking(
        objectives,
        tuple(numbers),
        tuple(scores[n] for n in numbers),
        tuple(n for n in numbers if n in front),
        tuple(values[n] for n in numbers),
        tuple(unranked),
        tuple(tuple(map(bisect_left, columns, losses[n])) for n in numbers),
        len(numbers),
        len(front),
    )


def _loss(objective: Objective, value: float) -> float:
    """Return what is to be small."""
    if isinstance(objective.goal, str):
        return value if objective.goal == "min" else -value
    return abs(value - objective.goal)


def _scores(objectives: Sequence[Objective], losses: dict[int, tuple[float, ...]]) -> dict[int, float]:
    if not losses:
        return {}
    columns = list(zip(*losses.values(), strict=True))
    lows, spans = [min(c) for c in columns], [max(c) - min(c) for c in columns]
    total = math.fsum(o.weight for o in objectives)

    def score(row: tuple[float, ...]) -> float:
        parts = (1.0 - (x - low) / span if span else 1.0 for x, low, span in zip(row, lows, spans, strict=True))
        return round(math.fsum(o.weight * part for o, part in zip(objectives, parts, strict=True)) / total, DIGITS)

    return {number: score(row) for number, row in losses.items()}


def _front(losses: dict[int, tuple[float, ...]]) -> list[int]:
    """Return the numbers whose losses no other row beats: at most as large everywhere and smaller somewhere.

    In lexicographic order a row can only be beaten by an earlier one, and if so then by one of the front.
    """
    front: list[int] = []
    rows: list[tuple[float, ...]] = []  # of the front
    for number in sorted(losses, key=lambda n: (losses[n], n)):
        row = losses[number]
        if not any(all(map(le, other, row)) and other != row for other in rows):
            front.append(number)
            rows.append(row)
    return front
