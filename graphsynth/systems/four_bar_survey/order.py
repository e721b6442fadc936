"""The order of all sets of a four-bar survey that pass: the Pareto front first, then the others, both by score."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from graphsynth.pipeline.products import Ranking, Record
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import DIGITS
from graphsynth.systems.four_bar_survey.lattice import Lattice


@dataclass(frozen=True, slots=True)
class Order:
    """What `ranking_of` would say of all sets that pass, as far as it is used.

    Attributes
    ----------
    ranked : int
        Sets that pass and have all objectives.
    front : tuple of int
        Sets that no other one beats in every objective, ascending.
    best : tuple of int
        The first sets of the order.
    scores : tuple of float
        Of `best`: weighted mean of the objectives, each scaled to 0 (worst of all that pass) .. 1 (best of all).
    places : tuple of tuple of int
        Of `best`: by objective, how many of all that pass are better.
    """

    ranked: int = 0
    front: tuple[int, ...] = ()
    best: tuple[int, ...] = ()
    scores: tuple[float, ...] = ()
    places: tuple[tuple[int, ...], ...] = ()


def order_of(context: Context, done: list[Any]) -> Order:
    """Order the sets of all shards."""
    import numpy as np

    from graphsynth.systems.four_bar_survey.stages import front_of, objectives_of, unpacked

    objectives = objectives_of(context)
    rows = [unpacked(shard["losses"], 1 + len(objectives)) for shard in done]
    table = np.concatenate(rows) if rows else np.empty((0, 1 + len(objectives)))
    table = table[np.isfinite(table).all(axis=1)]
    if not len(table):
        return Order()
    sets, losses = table[:, 0].astype(np.int64), table[:, 1:]
    leading = np.flatnonzero(np.isin(sets, [number for shard in done for number in shard["front"]]))
    front = leading[front_of(losses[leading])]
    low, span = losses.min(axis=0), np.ptp(losses, axis=0)
    parts = 1.0 - (losses - low) / np.where(span > 0.0, span, 1.0)
    weights = np.array([objective.weight for objective in objectives])
    scores = np.round((parts * weights).sum(axis=1) / weights.sum(), DIGITS)
    behind = np.ones(len(sets), dtype=np.bool_)
    behind[front] = False
    best = np.lexsort((sets, -scores, behind))[: context.scene.mechanism.certify]
    places = [np.searchsorted(np.sort(column), column[best]).tolist() for column in losses.T]
    return Order(
        len(sets),
        tuple(np.sort(sets[front]).tolist()),
        tuple(sets[best].tolist()),
        tuple(scores[best].tolist()),
        tuple(zip(*places, strict=True)),
    )


def rank(context: Context, survey: Any, records: tuple[Record, ...]) -> Ranking:
    """Give the certified sets with their places among all sets that pass: they do not depend on how many there are."""
    from graphsynth.systems.four_bar_survey.stages import objectives_of

    objectives, order = objectives_of(context), survey.order
    margins = [{margin.name: margin.value for margin in record.margins} for record in records]
    front = set(order.front)
    return Ranking(
        objectives,
        tuple(record.number for record in records),
        order.scores,
        tuple(record.number for record, number in zip(records, order.best, strict=True) if number in front),
        tuple(tuple(own.get(o.quantity, math.nan) for o in objectives) for own in margins),
        places=order.places,
        ranked=order.ranked,
        front_size=len(order.front),
    )


def edges_of(lattice: Lattice, lengths: list[int]) -> list[str]:
    """Say which lengths of a set (frame, crank, coupler, rocker) are the first or last of their ranges.

    Examples
    --------
    >>> from fractions import Fraction
    >>> edges_of(Lattice(Fraction(1, 2), 2, range(3, 9), range(4, 6), range(4, 5)), [8, 2, 4, 4])
    ['frame 4 is the longest', 'coupler 2 is the shortest']
    """
    found = []
    for name, span, length in zip(
        ("frame", "coupler", "rocker"), (lattice.frame, lattice.coupler, lattice.rocker), (lengths[0], *lengths[2:])
    ):
        if len(span) > 1 and length in (span[0], span[-1]):
            end = "shortest" if length == span[0] else "longest"
            found.append(f"{name} {float(length * lattice.unit):.12g} is the {end}")
    return found
