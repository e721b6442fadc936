"""Structural groups and their faults in plain Python, with the pebble game of `graphsynth.structure.rigidity`.

It was the library's own until `graphsynth.structure.pebbles` took its place.
"""

from __future__ import annotations

from collections.abc import Iterable

from graphsynth.structure.connectivity import bits
from graphsynth.structure.graph import Joint, MechanismGraph
from graphsynth.structure.rigidity import PebbleGame


class PlainSystem:
    """Bodies, constraints between them, and their assignment to bodies."""

    def __init__(self, graph: MechanismGraph, drivers: tuple[Joint, ...]) -> None:
        self.space = graph.space
        self.body_of = list(range(graph.links))
        self.refused = 0
        for a, b, mobility in drivers:
            if mobility == 1:
                low, high = sorted((self.body_of[a], self.body_of[b]))
                self.refused |= (low == high or self.refused >> high & 1) << low
                self.body_of = [low if body == high else body for body in self.body_of]
        assert graph.frame is not None
        self.placed = self.body_of[graph.frame]
        self.constraints = [
            (self.body_of[j.a], self.body_of[j.b], j.mobility - (j in drivers))
            for j in graph.joints
            if not (j.mobility == 1 and j in drivers)
        ]
        self.moving = sorted({own for own in self.body_of if own != self.placed})
        self.game = PebbleGame(graph.space if link in self.moving else 0 for link in range(graph.links))
        #: bodies that have too many constraints, or 0
        self.crowded = self.refused
        for a, b, mobility in self.constraints:
            for _ in range(graph.space - mobility):
                if (a == b or not self.game.insert(a, b, 0)) and not self.crowded:
                    self.crowded = self.game.reach(a, b)

    def links_of(self, bodies: Iterable[int]) -> tuple[int, ...]:
        wanted = set(bodies)
        return tuple(link for link, body in enumerate(self.body_of) if body in wanted)

    def too_many(self) -> tuple[int, ...]:
        return self.links_of(bits(self.crowded & ~(1 << self.placed))) or self.links_of(bits(self.crowded))

    def free(self) -> tuple[int, ...]:
        game = self.game
        return self.links_of(body for body in self.moving if any(game.free[k] for k in bits(game.reach(body))))

    def groups(self) -> list[tuple[int, ...]]:
        """Links of the groups in the order of assembly."""
        reach = {body: self.game.reach(body) for body in self.moving}
        left: dict[int, int] = {}
        for body in self.moving:
            group = sum(1 << other for other in bits(reach[body]) if other in reach and reach[other] >> body & 1)
            left[group] = reach[body]
        placed, ordered = 1 << self.placed, []
        while left:
            group = next(group for group, needs in left.items() if not needs & ~(group | placed))
            del left[group]
            placed |= group
            ordered.append(self.links_of(bits(group)))
        return ordered

    def crowded_inside(self) -> tuple[int, ...]:
        """Moving links that have too many constraints among themselves, or none."""
        for links in self.groups():
            bodies = {self.body_of[link] for link in links}
            game = PebbleGame([self.space] * len(self.body_of))
            for a, b, mobility in self.constraints:
                for _ in range(self.space - mobility if {a, b} <= bodies else 0):
                    if not game.insert(a, b, self.space):
                        return self.links_of(bits(game.reach(a, b)))
        return ()
