"""Layers of links: the least number in which nothing meets, by integer programming (HiGHS).

``x[a, k]`` is 1 where link a lies in layer k.  Links that would meet have different layers, wheels that mesh the same
one; a link that would hit a pin does not lie between two links of that pin; pins that would hit each other do not pass
through the same layer, except where their links lie (theory/parts 3).  The frame is layer 0.  Of all layerings with
the least number, one with the shortest pins is taken.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from graphsynth.core.errors import GeometryError

Row = tuple[dict[int, float], float]  #: coefficients by column, and the upper bound


@dataclass(frozen=True)
class Stacking:
    """What layers must obey.

    ``links``: number of links, of which ``frame`` is layer 0; ``pins``: links on each pin; ``same``: pairs of links
    that must not share a layer, ``through``: (pin, link) where the link must not lie between links of the pin,
    ``crossing``: pairs of pins that must not pass through one layer, ``together``: pairs that must share a layer.
    """

    links: int
    frame: int
    pins: Sequence[tuple[int, ...]]
    same: Collection[tuple[int, int]]
    through: Collection[tuple[int, int]]
    crossing: Collection[tuple[int, int]] = ()
    together: Collection[tuple[int, int]] = ()

    def violated(self, layers: Sequence[int]) -> bool:
        """Whether a layering breaks any of it: the definition, for checks."""
        span = [(min(own), max(own)) for own in ([layers[link] for link in pin] for pin in self.pins)]
        return (
            any(layers[a] == layers[b] for a, b in self.same)
            or any(layers[a] != layers[b] for a, b in self.together)
            or any(span[p][0] < layers[c] < span[p][1] for p, c in self.through)
            or any(max(span[p][0], span[q][0]) + 1 < min(span[p][1], span[q][1]) for p, q in self.crossing)
        )


def least_layers(stacking: Stacking) -> tuple[int, ...] | None:
    """Layer of every link, with the least number of layers above the frame; None if no layering is possible."""
    most = stacking.links - 1  # only the order of links counts, so more layers do not help
    if layered(stacking, most, shortest=False) is None:
        return None
    for count in range(1, most + 1):
        found = layered(stacking, count)
        if found is not None:
            return found
    return None


def layered(stacking: Stacking, count: int, *, shortest: bool = True) -> tuple[int, ...] | None:
    """Return a layering with ``count`` layers above the frame, with the shortest pins or any."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csr_matrix

    wide = count + 1
    cells, pins = stacking.links * wide, len(stacking.pins)
    rows = list(_rows(stacking, count))
    entries = [(i, j, v) for i, (row, _) in enumerate(rows) for j, v in row.items()]
    i, j, v = zip(*entries) if entries else ((), (), ())
    matrix = csr_matrix((v, (i, j)), shape=(len(rows), cells + pins))
    placed = csr_matrix(
        (np.ones(cells), (np.repeat(np.arange(stacking.links), wide), np.arange(cells))),
        shape=(stacking.links, cells + pins),
    )
    upper = np.concatenate([np.ones(cells), np.full(pins, float(count))])
    for link in range(stacking.links):  # the frame is layer 0, and nothing else is
        own = (
            slice(link * wide + 1, (link + 1) * wide) if link == stacking.frame else slice(link * wide, link * wide + 1)
        )
        upper[own] = 0.0
    answer = milp(
        np.concatenate([np.zeros(cells), np.full(pins, float(shortest))]),
        integrality=np.concatenate([np.ones(cells), np.zeros(pins)]),
        bounds=Bounds(0.0, upper),
        constraints=[LinearConstraint(matrix, -np.inf, [b for _, b in rows]), LinearConstraint(placed, 1.0, 1.0)],
    )
    if answer.status == 2:
        return None
    if answer.x is None:
        raise GeometryError(f"the search for layers ended without an answer: {answer.message}")
    layers = tuple(int(k) for k in answer.x[:cells].reshape(stacking.links, wide).argmax(axis=1))
    assert not stacking.violated(layers)
    return layers


def _rows(stacking: Stacking, count: int) -> Iterator[Row]:
    """Return the inequalities of a layering."""
    wide = count + 1

    def below(link: int, k: int) -> dict[int, float]:
        return {link * wide + i: 1.0 for i in range(k)}

    def above(link: int, k: int) -> dict[int, float]:
        return {link * wide + i: 1.0 for i in range(k + 1, wide)}

    for a, b in stacking.same:
        yield from (({a * wide + k: 1.0, b * wide + k: 1.0}, 1.0) for k in range(1, wide))
    for pair in stacking.together:
        yield from (({a * wide + k: 1.0, b * wide + k: -1.0}, 0.0) for k in range(wide) for a, b in permutations(pair))
    for p, c in stacking.through:
        for a, b in permutations(stacking.pins[p], 2):
            yield from ((below(a, k) | {c * wide + k: 1.0} | above(b, k), 2.0) for k in range(1, count))
    for p, q in stacking.crossing:
        for a, b in permutations(stacking.pins[p], 2):
            for c, d in permutations(stacking.pins[q], 2):
                for k in range(1, count):
                    row: dict[int, float] = {}
                    for part in (below(a, k), above(b, k), below(c, k), above(d, k)):
                        for column, value in part.items():
                            row[column] = row.get(column, 0.0) + value
                    yield row, 3.0
    cells = stacking.links * wide
    for p, pin in enumerate(stacking.pins):  # the span of a pin is at least the difference of any two of its layers
        for a, b in permutations(pin, 2):
            row = {b * wide + k: float(k) for k in range(1, wide)}
            row |= {a * wide + k: -float(k) for k in range(1, wide)}
            yield row | {cells + p: -1.0}, 0.0
