"""Chains that may do a task: which link is fixed, which is driven, which link carries each named point."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product

from graphsynth.design.task.places import Box, Place, Point
from graphsynth.design.task.targets import LinkTarget, PathTarget
from graphsynth.design.task.task import DesignTask
from graphsynth.kinematics.dimensional.design import Design, choices
from graphsynth.kinematics.dimensional.mirror import Image, images, mirrors
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph


@dataclass(frozen=True)
class Plan:
    """All but the numbers.

    ``carriers``: the link of every name of the task, in its order; ``given``, ``regions``: joints on the frame whose
    places are given or bounded, and these; ``pins``: of a cylinder its driven joint and the joints at its two ends;
    ``idling``: named points and joints of their links (indices); where these coincide, other links do nothing;
    ``mirror``: of a mechanism that is its own mirror image, the image of every link.
    """

    design: Design
    carriers: tuple[int, ...]
    given: tuple[tuple[int, Point], ...] = ()
    pins: tuple[int, int, int] | None = None
    regions: tuple[tuple[int, Box], ...] = ()
    idling: tuple[tuple[str, int], ...] = ()
    mirror: Image = ()

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
    if task.dyads_only and not design.dyadic:
        return
    if task.crank_start is not None and sum(design.kinds[k] == "R" for k in design.joints_of(design.drivers[0][1])) < 2:
        return  # a driven link without a second joint that turns has no direction
    pins = None
    if task.drive == "cylinder":
        (own,) = design.driver_joints
        first, second = (next(k for k in design.joints_of(link) if k != own) for link in design.drivers[0])
        pins = own, first, second
    moved_by = needs(design)
    for carriers in _carriers(task, design):
        if len(set().union(*(moved_by[link] for link in carriers))) < design.graph.links:
            continue  # some links would do nothing
        if task.plates and _plates(task, design, carriers) < len(task.plates):
            continue
        idling = tuple(_idling(task, design, carriers, moved_by))
        for taken in _given(task, design, carriers):
            given = tuple((k, (p[0], p[1])) for k, p in taken if len(p) == 2)
            regions = tuple((k, p) for k, p in taken if len(p) == 4)
            plan = Plan(design, carriers, given, pins, regions, idling)
            yield from _mirrored(task, plan) if task.mirrored else (plan,)


def _mirrored(task: DesignTask, plan: Plan) -> Iterator[Plan]:
    """Yield a plan with every mirror that leaves given pivots free of each other and has the named points on its axis.

    Such a point is the joint of a link with its image; it is named as one of the link that comes first.
    """
    points = [link for link, of_point in zip(plan.carriers, task.names.values(), strict=True) if of_point]
    pivots = [k for k, _ in (*plan.given, *plan.regions)]
    pairs = {frozenset(joint[:2]) for joint in plan.design.graph.joints}
    for mirror in mirrors(plan.design):
        own = images(plan.design, mirror)
        on_axis = all(link < mirror[link] and frozenset((link, mirror[link])) in pairs for link in points)
        if on_axis and not any(own[k] in pivots for k in pivots if own[k] != k):
            yield replace(plan, mirror=mirror)


def _plates(task: DesignTask, design: Design, carriers: tuple[int, ...]) -> int:
    """Return the number of moving links with three places or more: joints that turn, named points."""
    count = Counter(link for link, of_point in zip(carriers, task.names.values(), strict=True) if of_point)
    for joint, kind in zip(design.graph.joints, design.kinds, strict=True):
        count.update(joint[:2] if kind == "R" else ())
    return sum(n >= 3 for link, n in count.items() if link != design.graph.frame)


def needs(design: Design) -> list[set[int]]:
    """Return for every link those that move it: without all others it moves as it does.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> watt = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (3, 5)], frame=0)
    >>> needs(Design(watt, ((0, 1),), ("R",) * 7))[2:5]
    [{0, 1, 2, 3}, {0, 1, 2, 3}, {0, 1, 2, 3, 4, 5}]
    """
    graph = design.graph
    driven = {graph.frame or 0}.union(*design.drivers)
    found = [{*driven, link} for link in range(graph.links)]
    placed = {*driven}
    for group in decompose(graph, design.drivers).groups:
        own = {*group.links}
        before = {n for a, b, _ in graph.joints if {a, b} & own for n in (a, b)} & placed
        placed |= own
        whole = own.union(*(found[n] for n in before))
        for link in own:
            found[link] = whole
    return found


def _idling(
    task: DesignTask, design: Design, carriers: tuple[int, ...], moved_by: list[set[int]]
) -> Iterator[tuple[str, int]]:
    """Yield points of paths and the joints that would do as well, as points of a link that needs fewer others."""
    posed = {str(getattr(t, "point", "")) for t in task.targets if not isinstance(t, PathTarget)}
    for n, (name, carrier) in enumerate(zip(task.names, carriers, strict=True)):
        for k in design.joints_of(carrier) if task.names[name] and name not in posed else ():
            (other,) = {*design.graph.joints[k][:2]} - {carrier}
            links = (*carriers[:n], other, *carriers[n + 1 :])
            if design.kinds[k] == "R" and len(set().union(*(moved_by[link] for link in links))) < design.graph.links:
                yield name, k


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
    """Yield a link for each name: of points no link that turns about a pivot, of outputs one that does.

    Outputs against another link have a joint with it that is not driven.
    """
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
    own = [target for target in task.targets if isinstance(target, LinkTarget)]
    on_frame = {target.link for target in own if not target.base}
    moving = [link for link in range(graph.links) if link != frame]
    every = [
        free if of_point else outputs[name in task.sliding] if name in on_frame else moving
        for name, of_point in task.names.items()
    ]
    kinds = {frozenset(pair[:2]): kind for pair, kind in zip(graph.joints, design.kinds, strict=True)}
    kinds.pop(frozenset(design.drivers[0]))
    for carriers in product(*every):
        links = dict(zip(task.names, carriers, strict=True))
        pairs = [(frozenset((links[t.link], links[t.base])), t.slides) for t in own if t.base]
        if all(kinds.get(pair) == ("P" if slides else "R") for pair, slides in pairs):
            yield carriers


def _given(task: DesignTask, design: Design, carriers: tuple[int, ...]) -> Iterator[tuple[tuple[int, Place], ...]]:
    """Yield the ways in which joints on the frame take the given pivots, whose links may be known."""
    frame = design.graph.frame
    assert frame is not None
    own = [k for k in design.joints_of(frame) if design.kinds[k] == "R"]
    links = dict(zip(task.names, carriers, strict=True))
    asked = [(target.pivot, {links[target.link]}) for target in task.targets if isinstance(target, LinkTarget)]
    named: dict[int, Place] = {}
    for place, turning in [(task.drive_pivot, {*design.drivers[0]} - {frame}), *asked]:
        if place is None:
            continue
        joint = next((k for k in own if {*design.graph.joints[k][:2]} & turning), -1)
        if joint < 0 or named.setdefault(joint, place) != place:
            return
    free = [place for place in task.pivots if place not in named.values()]
    for chosen in permutations([k for k in own if k not in named], len(free)):
        yield (*named.items(), *zip(chosen, free, strict=True))
