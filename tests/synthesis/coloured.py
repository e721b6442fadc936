"""Coloured questions at random, answered by trying everything: plain graphs of nauty or of the atlas of networkx, every
choice of frame, prismatic joints, mobilities and drivers, one of each class under the automorphisms, wishes read
literally.  Of graphsynth only the keys of the answers are used.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import combinations, product

import brute_force as bf
import multiple_joints
import nauty
import networkx as nx

from graphsynth import MechanismGraph, MultipleJointChain, SliderChain, Wishes

FOUR_BAR, FIVE_BAR = (MechanismGraph(n, [(i, (i + 1) % n) for i in range(n)]) for n in (4, 5))
FORK = MechanismGraph(4, [(0, 1), (0, 2), (0, 3)])
STAR_FRAME = MechanismGraph(4, [(0, 1), (0, 2), (0, 3)], frame=0)
RULES = [(False, False, False), (False, True, False), (True, False, False), (True, True, False), (False, False, True)]
PARTS = (FOUR_BAR, FIVE_BAR, FORK, STAR_FRAME)


@dataclass(frozen=True)
class Question:
    kind: str  # "plain", "sliders" or "multiple"
    links: int
    mobility: int
    framed: bool
    higher: int = 0  # joints of mobility 2, prismatic joints or multiple joints
    rules: tuple[bool, bool, bool] = (False, False, False)  # sliding_links, sliding_loops, cylinders
    fractionated: bool = False
    symmetry: int | None = None
    wishes: Wishes = field(default_factory=Wishes)
    roles: tuple[int, int] = (0, 0)  # drivers, outputs


@cache
def plain_graphs(links: int, joints: int, fractionated: bool) -> tuple[nx.Graph, ...]:
    """Connected graphs in which every link has two joints, 2-connected unless ``fractionated``."""
    if links > 7:
        lines = nauty.chains(links, joints, fractionated=fractionated)
        return tuple(nx.from_graph6_bytes(line.encode()) for line in lines)
    return tuple(g for g in bf.graphs(links, joints) if fractionated or nx.is_biconnected(g))


def _joined(g: nx.Graph, frame: int | None, pair: tuple[object, object]) -> bool:
    def plays(link: int, role: object) -> bool:
        return link == frame if role == "frame" else g.degree(link) == role

    one, other = pair
    return any((plays(a, one) and plays(b, other)) or (plays(b, one) and plays(a, other)) for a, b in g.edges)


def holds(g: nx.Graph, frame: int | None, part: MechanismGraph) -> bool:
    """Place the links of the part one after the other; joints have the same mobility."""

    def place(chosen: tuple[int, ...]) -> bool:
        k = len(chosen)
        if k == part.links:
            return True
        for link in set(g) - set(chosen):
            if part.frame == k and link != frame:
                continue
            joints = [(chosen[a], f) for a, b, f in part.joints if b == k]
            if all(g.has_edge(link, a) and g.edges[link, a]["f"] == f for a, f in joints) and place((*chosen, link)):
                return True
        return False

    return place(())


def type_of_mobility(g: nx.Graph) -> str:
    if not nx.is_biconnected(g):
        return "fractionated"

    def dof(links: Iterable[int]) -> int:
        part = g.subgraph(links)
        return 3 * (len(part) - 1) - sum(3 - f for _, _, f in part.edges(data="f"))

    sets = (s for size in range(3, len(g) + 1) for s in combinations(g, size))
    closed = (s for s in sets if min(d for _, d in g.subgraph(s).degree()) >= 2)
    return "partial" if any(dof(s) < dof(g) for s in closed) else "total"


def fits(g: nx.Graph, frame: int | None, wishes: Wishes) -> bool:
    return (
        nx.girth(g) >= wishes.girth
        and all(_joined(g, frame, pair) for pair in wishes.jointed)
        and not any(_joined(g, frame, pair) for pair in wishes.apart)
        and all(holds(g, frame, part) for part in wishes.contains)
        and not any(holds(g, frame, part) for part in wishes.without)
        and wishes.planar in (None, nx.check_planarity(g)[0])
        and wishes.mobility_type in (None, type_of_mobility(g))
    )


def keeps_rules(
    g: nx.Graph, sliders: Iterable[tuple[int, int]], sliding_links: bool, sliding_loops: bool, cylinders: bool
) -> bool:
    sliding = {frozenset(pair) for pair in sliders}
    for link in g:
        own = [frozenset((link, other)) in sliding for other in g[link]]
        if not sliding_links and all(own):
            return False
    for a, b in sliders if cylinders else ():
        for link, other in ((a, b), (b, a)):
            if g.degree(link) != 2 or any(frozenset((link, w)) in sliding for w in g[link] if w != other):
                return False
    for loop in nx.simple_cycles(g) if not sliding_loops else ():
        joints = [frozenset(pair) for pair in zip(loop, [*loop[1:], loop[0]])]
        if sum(joint not in sliding for joint in joints) < 2:
            return False
    return True


def _answers(question: Question) -> Iterator[tuple[int, bf.Coloured, list[dict[int, int]]]]:
    """Yield (frame or -1, joints with their colour, automorphisms) of one answer of each class."""
    slides = question.kind == "sliders"
    lost = 0 if slides else question.higher  # a joint of mobility 2 takes one freedom, not two
    joints = (3 * (question.links - 1) - question.mobility + lost) // 2
    checked = question.links > 7 and not lost  # by nauty.chains
    for g in plain_graphs(question.links, joints, question.fractionated):
        moves = bf.automorphisms(g)
        pairs = sorted(tuple(sorted(pair)) for pair in g.edges)
        seen = set()
        for chosen in combinations(pairs, question.higher):
            coloured = tuple((a, b, 1 + ((a, b) in chosen)) for a, b in pairs)
            if slides and not keeps_rules(g, chosen, *question.rules):
                continue
            free = [(a, b, 1 if slides else f) for a, b, f in coloured]
            if not checked and bf.worst_subset(question.links, free, 3) < 1:
                continue
            nx.set_edge_attributes(g, {(a, b): f for a, b, f in free}, "f")
            for frame in sorted(g) if question.framed else [None]:
                images = [bf.image(coloured, frame, move) for move in moves]
                if min(images) in seen:
                    continue
                seen.add(min(images))
                still = bf.image(coloured, frame, {v: v for v in g})
                own = [move for move, image in zip(moves, images) if image == still]
                if question.symmetry and len(own) % question.symmetry:
                    continue
                if fits(g, frame, question.wishes):
                    yield -1 if frame is None else frame, coloured, own


def _roles(question: Question, frame: int, joints: bf.Coloured, moves: list[dict[int, int]]) -> int:
    """Number of classes of drivers and outputs of a mechanism."""
    drivers, outputs = question.roles
    near = [a + b - frame for a, b, _ in joints if frame in (a, b)]
    found = set()
    for driven in combinations(near, drivers):
        for others in combinations([v for v in range(question.links) if v != frame and v not in driven], outputs):
            found.add(min(tuple(tuple(sorted(m[v] for v in part)) for part in (driven, others)) for m in moves))
    return len(found)


def answers(question: Question) -> tuple[set[str], int]:
    """Return the keys of all answers, and the number of choices of their drivers and outputs."""
    if question.kind == "multiple":
        lines = multiple_joints.chains(question.links, question.mobility, question.higher)
        if question.framed:
            lines = multiple_joints.with_frames(lines, question.links)
        graphs = (nx.from_graph6_bytes(line.encode()) for line in lines)
        wanted = (g for g in graphs if fits_pins(g, question.links, 0 if question.framed else None, question.wishes))
        return {_key_of_pins(g, question) for g in wanted}, 0
    keys, choices = set(), 0
    for frame, joints, moves in _answers(question):
        number = None if frame < 0 else frame
        graph = MechanismGraph(question.links, joints, frame=number)
        keys.add(SliderChain(graph).key if question.kind == "sliders" else graph.key)
        if question.roles != (0, 0):
            choices += _roles(question, frame, joints, moves)
    return keys, choices


def fits_pins(g: nx.Graph, links: int, frame: int | None, wishes: Wishes) -> bool:
    """Wishes read from the graph of links and joints, which may join more links than two."""
    joints = [set(g[joint]) for joint in range(links, len(g))]

    def jointed(pair: tuple[object, object]) -> bool:
        one, other = ({v for v in range(links) if role == (g.degree(v) if role != "frame" else "frame" * (v == frame))}
                      for role in pair)  # fmt: skip
        return any(a != b for joint in joints for a in joint & one for b in joint & other)

    def holds_part(part: MechanismGraph, chosen: tuple[int, ...], left: list[set[int]]) -> bool:
        """Place links, and joints with those before, one after the other, each on a joint of its own."""
        k = len(chosen)
        return k == part.links or any(
            holds_part(part, (*chosen, link), [joint for joint in left if joint not in used])
            for link in set(range(links)) - set(chosen)
            if part.frame != k or link == frame
            for used in product(*([j for j in left if {link, chosen[a]} <= j] for a, b, _ in part.joints if b == k))
            if all(one != other for one, other in combinations(used, 2))
        )

    def free(s: tuple[int, ...]) -> int:
        return 3 * (len(s) - 1) - 2 * sum(max(0, len(joint & set(s)) - 1) for joint in joints)

    def kind() -> str:
        sets = (s for size in range(3, links + 1) for s in combinations(range(links), size))
        loops = (s for s in sets if all(sum(v in j and len(j & set(s)) > 1 for j in joints) > 1 for v in s))
        return "partial" if any(free(s) < free(tuple(range(links))) for s in loops) else "total"

    return (
        nx.girth(g) >= 2 * wishes.girth
        and all(jointed(pair) for pair in wishes.jointed)
        and not any(jointed(pair) for pair in wishes.apart)
        and all(holds_part(part, (), joints) for part in wishes.contains)
        and not any(holds_part(part, (), joints) for part in wishes.without)
        and wishes.planar in (None, nx.check_planarity(g)[0])
        and wishes.mobility_type in (None, kind())
    )


def _key_of_pins(graph: nx.Graph, question: Question) -> str:
    joints = [tuple(sorted(graph[joint])) for joint in range(question.links, len(graph))]
    return MultipleJointChain.from_joints(question.links, joints, frame=0 if question.framed else None).key


def _wishes(draw: random.Random, links: int, mobility: int, framed: bool) -> Wishes:
    roles = [2, 3, 3, 4, *(["frame"] * 2 * framed)]
    asked = Wishes()
    names = ["girth", "jointed", "apart", "contains", "without", "planar", *(["mobility_type"] if mobility > 1 else [])]
    for name in draw.sample(names, draw.choice((0, 0, 1, 1, 1, 2, 3))):
        value = {
            "girth": lambda: draw.choice((4, 4, 5, 5, 6)),
            "jointed": lambda: [draw.choices(roles, k=2)],
            "apart": lambda: [draw.choices(roles, k=2) for _ in range(draw.choice((1, 1, 2)))],
            "contains": lambda: [draw.choice(PARTS[: 3 + framed])],
            "without": lambda: [draw.choice(PARTS[: 3 + framed])],
            "planar": lambda: draw.random() < 0.8,
            "mobility_type": lambda: draw.choice(("total", "partial", "fractionated")),
        }[name]()
        asked = replace(asked, **{name: value})
    return asked


#: links and mobility; joints of mobility 2, prismatic joints, multiple joints at most
_SMALL = {
    "plain": [(6, 1, 2), (7, 2, 0), (6, 3, 2), (5, 1, 3), (5, 2, 2), (6, 2, 1)],
    "sliders": [(4, 1, 3), (6, 1, 4), (5, 2, 3), (7, 2, 2)],
    "multiple": [(6, 1, 2), (7, 2, 2), (8, 3, 2)],
}
_LARGE = {
    "plain": [*_SMALL["plain"], (8, 1, 0), (8, 3, 0), (9, 2, 0), (10, 1, 0), (9, 4, 0), (7, 1, 1)],
    "sliders": [*_SMALL["sliders"], (8, 1, 1), (8, 3, 2)],
    "multiple": [*_SMALL["multiple"], (8, 1, 4), (9, 2, 3), (9, 4, 2)],
}


def question(number: int, *, large: bool) -> Question:
    draw = random.Random(number)
    kind = draw.choices(("plain", "sliders", "multiple"), (6, 4, 1))[0]
    links, mobility, most = draw.choice((_LARGE if large else _SMALL)[kind])
    framed = draw.random() < 0.6
    asked = Question(kind, links, mobility, framed)
    more = draw.randint(1, most) if kind == "multiple" else 0
    wishes = _wishes(draw, links, mobility, framed)
    if kind == "multiple":
        return replace(asked, higher=more, wishes=wishes)
    if kind == "sliders":
        rules = draw.choice(RULES)
        return replace(asked, higher=draw.randint(1, most), rules=rules, wishes=wishes)
    higher = draw.choice([n for n in range(most + 1) if (3 * (links - 1) - mobility + n) % 2 == 0] or [most])
    return replace(
        asked,
        higher=higher,
        wishes=wishes,
        fractionated=mobility > 1 and draw.random() < 0.3,
        symmetry=draw.choice((None, None, None, 2, 3)),
        roles=draw.choice([(0, 0), (1, 0), (1, 1), (2, 1), (2, 0)]) if framed else (0, 0),
    )
