"""Chains that may do a task: which link is fixed, which is driven, which link carries each named point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, permutations, product

from graphsynth.design.task.targets import Point
from graphsynth.design.task.task import DesignTask
from graphsynth.kinematics.dimensional.design import Design, choices
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph


@dataclass(frozen=True)
class Plan:
    """All but the numbers.

    ``carriers``: the link of every name of the task, in its order; ``given``: joints on the frame whose places are
    given, and these; ``pins``: of a cylinder its driven joint and the joints at its two ends.
    """

    design: Design
    carriers: tuple[int, ...]
    given: tuple[tuple[int, Point], ...] = ()
    pins: tuple[int, int, int] | None = None

    @property
    def text(self) -> str:
        """Structure in words: links, sliders, driver, carriers."""
        sliders = self.design.kinds.count("P") - (self.pins is not None)
        drive = "-".join(map(str, self.design.drivers[0]))
        return f"{self.design.graph.links} links, {sliders} sliders, driven {drive}, carried by {self.carriers}"


def plans(task: DesignTask, links: int) -> Iterator[Plan]:
    """Yield every plan with so many links, simple ones first."""
    from graphsynth.synthesis import enumerate_chains

    for chain in enumerate_chains(links):
        for graph, driver in _driven(task, chain):
            for design in _kinds(task, graph, driver):
                yield from fitting(task, design)


def fitting(task: DesignTask, design: Design) -> Iterator[Plan]:
    """Yield the plans of a design: carriers of names and given pivots in every way."""
    if task.dyads_only and not decompose(design.graph, design.drivers).dyadic:
        return
    if task.crank_start is not None and sum(design.kinds[k] == "R" for k in design.joints_of(design.drivers[0][1])) < 2:
        return  # a driven link without a second joint that turns has no direction
    pins = None
    if task.drive == "cylinder":
        (own,) = design.driver_joints
        first, second = (next(k for k in design.joints_of(link) if k != own) for link in design.drivers[0])
        pins = own, first, second
    for carriers in _carriers(task, design):
        for given in _given(task, design):
            yield Plan(design, carriers, given, pins)


def _driven(task: DesignTask, chain: MechanismGraph) -> Iterator[tuple[MechanismGraph, tuple[int, int]]]:
    """Yield frames and drivers."""
    if task.drive != "cylinder":
        yield from ((graph, drivers[0]) for graph, drivers in choices(chain, None))
        return
    for graph in chain.inversions():
        for a, b, _ in graph.joints:
            binary = graph.degrees[a] == graph.degrees[b] == 2  # barrel and rod have two joints each
            if graph.frame not in (a, b) and binary and find_fault(graph, ((a, b),)) is None:
                yield graph, (a, b)


def _kinds(task: DesignTask, graph: MechanismGraph, driver: tuple[int, int]) -> Iterator[Design]:
    """Yield designs with all choices of sliders; the ends of a cylinder turn."""
    pairs = [(joint.a, joint.b) for joint in graph.joints]
    driven = pairs.index((min(driver), max(driver)))
    others = [k for k in range(len(pairs)) if k != driven]
    if task.drive == "cylinder":
        others = [k for k in others if not {*pairs[k]} & {*driver}]
    for count in range(task.sliders + 1):
        for chosen in combinations(others, count):
            sliding = {*chosen, driven} if task.linear else {*chosen}
            blocks = [sum(link in pairs[k] for k in sliding) for link in range(graph.links)]
            if all(n < graph.degrees[link] for link, n in enumerate(blocks)):  # no link is held by guides alone
                kinds = tuple("P" if k in sliding else "R" for k in range(len(pairs)))
                yield Design(graph, (driver,), kinds)


def _carriers(task: DesignTask, design: Design) -> Iterator[tuple[int, ...]]:
    """Yield a link for each name: of points no link that turns about a pivot, of outputs one that does."""
    graph, frame = design.graph, design.graph.frame
    assert frame is not None
    near = {link for link in range(graph.links) if graph.neighbours[frame] >> link & 1}
    driven = {*design.drivers[0]} if task.drive == "cylinder" else {design.drivers[0][1]}
    free = [link for link in range(graph.links) if link != frame and link not in near | driven]
    guided = {
        link for k, pair in enumerate(graph.joints) if design.kinds[k] == "P" for link in pair[:2] if frame in pair[:2]
    }
    outputs = {
        slides: [link for link in sorted(near - driven) if (link in guided) == slides] for slides in (True, False)
    }
    yield from product(*(free if of_point else outputs[name in task.sliding] for name, of_point in task.names.items()))


def _given(task: DesignTask, design: Design) -> Iterator[tuple[tuple[int, Point], ...]]:
    """Yield the ways in which joints on the frame take the given pivots."""
    assert design.graph.frame is not None
    own = [k for k in design.joints_of(design.graph.frame) if design.kinds[k] == "R"]
    for chosen in permutations(own, len(task.pivots)):
        yield tuple(zip(chosen, task.pivots, strict=True))
