"""Which parts would meet, at samples and proved over a whole motion; what a layering relies on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.parts.gaps import Found, Solid, Tube, gaps, proved_gap
from graphsynth.design.parts.layers import Stacking, layered
from graphsynth.design.parts.outline import Rounded
from graphsynth.design.parts.plan import PartsPlan

Array = NDArray[np.float64]
Pair = tuple[int, int]
#: What is known about the parts of a body, what tells most about the whole first.
_WORST = ("hit", "undecided", "free")


class Collision(NamedTuple):
    """Two parts that are nearer than the clearance: names, gap in mm (negative: they overlap), input, what is known."""

    one: str
    other: str
    gap: float
    input: float
    status: str  #: "hit", or "undecided": kept in different layers for want of a proof

    def __str__(self) -> str:
        how = "overlap" if self.gap <= 0.0 else f"come within {self.gap:.3g} mm"
        if self.status == "undecided":
            how = "are not proved apart"
        return f"{self.one} and {self.other} {how} at input {self.input:.6g}"


class Hazards:
    """The workspace of the search: bodies are the sheets, then the pins with their spacers."""

    def __init__(self, plan: PartsPlan, frame: int, poses: Array, inputs: Array) -> None:
        self.plan, self.frame, self.sheets = plan, frame, len(plan.outlines)
        self.bodies = [
            [Solid(link, part) for part in getattr(outline, "sectors", ()) or (outline,)]
            for link, outline in zip(plan.links, plan.outlines)
        ]
        self.bodies += [[Solid(pin.link, Rounded((pin.at,), plan.sizes.spacer))] for pin in plan.pins]
        self.jointed = {pair for pin in plan.pins for pair in combinations(sorted(pin.sheets), 2)}
        self.known: dict[Pair, Found] = {}
        for one, other in self._pairs():
            found = np.min([gaps(a, b, poses) for a, b in self._solids(one, other)], axis=0)
            k = int(found.argmin())
            status = "hit" if found[k] < plan.sizes.clearance else "sampled"
            self.known[one, other] = Found(status, float(found[k]), float(inputs[k]))

    def _pairs(self) -> Iterator[Pair]:
        """Pairs that may meet in a layer: links, links and pins, pins."""
        moving = [link for link in range(self.sheets) if link != self.frame]
        yield from (pair for pair in combinations(moving, 2) if pair not in self.jointed | {*self.plan.touching})
        pins = list(enumerate(self.plan.pins, self.sheets))
        clear = {p: (*pin.sheets, *pin.passes, *self.plan.through(pin)) for p, pin in pins}
        yield from ((link, p) for link in moving for p in clear if link not in clear[p])
        yield from ((p, q) for (p, _), (q, _) in combinations(pins, 2))

    def _solids(self, one: int, other: int) -> Iterator[tuple[Solid, Solid]]:
        """All pairs of what two bodies consist of."""
        return product(self.bodies[one], self.bodies[other])

    @property
    def kept_apart(self) -> list[Pair]:
        """Pairs that must not meet in a layer, without those that share a pin."""
        return [pair for pair, found in self.known.items() if found.status in ("hit", "undecided")]

    def stacking(self, pairs: Sequence[Pair] | None = None) -> Stacking:
        """Return what layers must obey, for all pairs kept apart or those given."""
        n, apart = self.sheets, self.kept_apart if pairs is None else pairs
        return Stacking(
            n,
            self.frame,
            [pin.sheets for pin in self.plan.pins],
            sorted(self.jointed) + [(a, b) for a, b in apart if b < n],
            [(p - n, c) for c, p in apart if c < n <= p],
            [(p - n, q - n) for p, q in apart if p >= n],
            self.plan.touching,
        )

    def length(self, layers: Sequence[int]) -> int:
        """Return how many layers all pins together reach over."""
        return sum(high - low for low, high in self._spans(layers))

    def _spans(self, layers: Sequence[int]) -> list[tuple[int, int]]:
        """Lowest and highest layer of every pin."""
        return [(min(own), max(own)) for own in ([layers[k] for k in pin.sheets] for pin in self.plan.pins)]

    def relied(self, layers: Sequence[int]) -> list[Pair]:
        """Pairs that share a layer somewhere, so that their gap counts."""
        n = self.sheets
        spans = self._spans(layers)

        def meet(one: int, other: int) -> bool:
            if other < n:
                return layers[one] == layers[other]
            if one < n:
                return spans[other - n][0] < layers[one] < spans[other - n][1]
            (a, b), (c, d) = spans[one - n], spans[other - n]
            return max(a, c) + 1 < min(b, d)

        return [pair for pair in self.known if meet(*pair)]

    def refuted(self, layers: Sequence[int], tube: Tube) -> bool:
        """Prove the gaps a layering relies on; whether one of them failed, so that another layering is needed."""
        failed = False
        for pair in self.relied(layers):
            if self.known[pair].status == "sampled":
                found = [proved_gap(a, b, tube, self.plan.sizes.clearance) for a, b in self._solids(*pair)]
                self.known[pair] = min(found, key=lambda one: (_WORST.index(one.status), one.gap))
                failed |= self.known[pair].status != "free"
        return failed

    def collision(self, pair: Pair) -> Collision:
        """Say what is known about a pair."""
        found = self.known[pair]
        return Collision(self.name(pair[0]), self.name(pair[1]), found.gap, found.input, found.status)

    def name(self, body: int) -> str:
        """Name a link or a pin."""
        return f"link {self.plan.label(body)}" if body < self.sheets else self.plan.pins[body - self.sheets].title

    def impossible(self) -> list[Collision]:
        """Return collisions that exclude every layering, none of which can be left out."""
        core = self.kept_apart
        for pair in list(core):
            rest = [other for other in core if other != pair]
            if layered(self.stacking(rest), self.sheets - 1, shortest=False) is None:
                core = rest
        return [self.collision(pair) for pair in core]
