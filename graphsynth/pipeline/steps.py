"""Stages that every system shares: from the question to candidates, recognition by key, records, ranking, pictures."""

from __future__ import annotations

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from operator import le
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError, GraphError, GraphsynthError, SceneError, SpecError, TooLargeError
from graphsynth.pipeline.products import (
    Attempt,
    Candidate,
    Objective,
    Outcome,
    Picture,
    Quantity,
    Ranking,
    Recognised,
    Record,
)
from graphsynth.pipeline.scene import StructureTable
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import Place, suggest

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment
    from graphsynth.structure.system.spec import StructuralSpec


def solve(context: Context) -> tuple[LinkAssortment, ...]:
    """Return every integer solution of the scene's structural question (exact); none if graphs are given instead.

    A `SceneError` says that graphs are given and the solutions are asked for.
    """
    if _structure(context).graphs:
        if "solutions" in context.scene.outputs.products:
            raise (context.scene.place / "outputs").error(
                "asks for 'solutions', but graphs are given and there is no question to solve; remove it"
            )
        return ()
    return tuple(spec_of(context).solve())


def _structure(context: Context) -> StructureTable:
    table = context.scene.structure
    assert table is not None  # a scene without [structure] has none of these stages
    return table


def spec_of(context: Context) -> StructuralSpec:
    """Return the structural question of a scene; a `SceneError` if it cannot be read."""
    from graphsynth.structure.system.spec import StructuralSpec

    place = context.scene.place / "structure" / "question"
    try:
        return StructuralSpec.from_mapping(_structure(context).question or {})
    except (FormatError, SpecError) as error:
        # a FormatError about a key says which one
        key = getattr(error, "place", "").removeprefix("key ").strip("'")
        raise place.error(f"cannot be read: {error}", key) from error


@lru_cache
def count_of(spec: StructuralSpec) -> int:
    """Return how many mechanisms answer a structural question, counted once."""
    from graphsynth.synthesis import count_mechanisms

    return count_mechanisms(spec)


def generate(context: Context, solutions: tuple[LinkAssortment, ...]) -> Iterator[Candidate]:
    """Yield the mechanisms of the question, each once up to isomorphism, filtered as ``[structure.generate]`` says.

    A `TooLargeError` says that there are more than ``limit``, a `SceneError` that there is none.
    """
    for number, graph in enumerate(mechanisms(context, solutions), 1):
        yield Candidate(number, graph, assortment_text(graph))


def mechanisms(context: Context, solutions: tuple[LinkAssortment, ...]) -> Iterator[MechanismGraph]:
    """Yield what passes the filters, as long as listing alone does not use up the time of ``[budget]``.

    It raises what `generate` raises.
    """
    budget, limit = context.scene.budget.time, _structure(context).generate.limit
    spent, listed = 0.0, 0
    start = time.perf_counter()
    for graph in _filtered(context):
        spent += time.perf_counter() - start
        if budget is not None and spent > budget:
            raise SceneError(
                f"{context.scene.place / 'budget'} stops the run while candidates are listed ({listed} so far): the "
                f"time of {budget:g} s is used up; raise it, or fix more variables of the question"
            )
        if listed == limit:
            raise TooLargeError(
                f"{context.scene.place / 'structure' / 'generate'} the question has more than limit = {limit} "
                "mechanisms; raise the limit, or fix more variables of the question"
            )
        listed += 1
        yield graph
        start = time.perf_counter()
    if not listed:
        raise SceneError(
            f"{context.scene.place / 'structure'} gives no candidate ({len(solutions)} integer solutions): nothing "
            "passes the filters of [structure.generate]; relax them"
        )


def _filtered(context: Context) -> Iterator[MechanismGraph]:
    """Yield of the graphs that are given, or drawn, or answer the question those that pass the filters."""
    from graphsynth.synthesis import enumerate_mechanisms, sample_mechanisms

    table, options = _structure(context), _structure(context).generate
    found: Iterable[MechanismGraph]
    if table.graphs:
        found = (_read(context, i, text) for i, text in enumerate(table.graphs))
    elif options.sample is not None and count_of(spec_of(context)) > options.sample:
        drawn = sample_mechanisms(spec_of(context), options.sample, context.scene.scene.seed)
        found = {graph.key: graph for graph in drawn}.values()
    else:
        found = enumerate_mechanisms(spec_of(context), symmetry=options.symmetry)
    fixed = options.fixed_moving_links
    for graph in found:
        symmetric = (
            mirror_symmetric(graph) if options.symmetry == 2 else fixed is None or threefold_symmetry(graph, fixed)
        )
        if symmetric and (not options.planar or graph.is_planar):
            yield graph


def _read(context: Context, place: int, text: str) -> MechanismGraph:
    from graphsynth.structure.graph import MechanismGraph

    try:
        graph = MechanismGraph.from_key(text) if text.startswith("1") else MechanismGraph.from_text(text)
    except (FormatError, GraphError) as error:
        at = context.scene.place / "structure" / "graphs" / str(place)
        raise at.error(f"is neither a canonical key nor the text form of a graph: {error}") from error
    return graph


def read_mechanism(context: Context, name: str, at: Place) -> tuple[Mechanism, bytes]:
    """Read a file of a dimensioned mechanism, with its bytes; a `SceneError` at a place tells of one that is none."""
    from graphsynth.core.textfiles import read_bytes
    from graphsynth.mechanism.files import JSON_MAX
    from graphsynth.mechanism.model import Mechanism

    path = context.scene.folder / name
    try:
        data = read_bytes(path, JSON_MAX, "a mechanism", path.name)
    except FormatError as error:
        raise at.error(f"names {name!r}, which {str(error).removeprefix(f'{path.name}: ')}") from error
    try:
        return (Mechanism.from_json(data) if path.suffix == ".json" else Mechanism.from_toml(data)), data
    except GraphsynthError as error:  # FormatError: no mechanism as text; others: one that nobody can build
        raise at.error(f"names {name!r}, which is no mechanism: {error}") from error


def assortment_text(graph: MechanismGraph) -> str:
    """Return the assortment of moving links as text.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> assortment_text(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0))
    'n2=3'
    """
    return " ".join(f"n{joints}={count}" for joints, count in sorted(graph.assortment.items()) if count)


def mirror_symmetric(graph: MechanismGraph) -> bool:
    """Whether a mechanism can be its own mirror image, with one driver that turns on the frame."""
    from graphsynth.kinematics.dimensional.design import Design
    from graphsynth.kinematics.dimensional.mirror import mirrors

    kinds = tuple("R" if joint.mobility == 1 else "higher" for joint in graph.joints)
    frame = graph.frame or 0
    drivers = [(frame, link) for link in range(graph.links) if graph.neighbours[frame] >> link & 1]
    return any(True for pair in drivers for _ in mirrors(Design(graph, (pair,), kinds)))


def threefold_symmetry(graph: MechanismGraph, fixed_moving_links: int) -> tuple[int, ...]:
    """Return an automorphism of order 3 that fixes the frame and exactly this many moving links, or nothing (exact).

    It is given by the image of every link.

    Depth-first search: link by link, each either stays or starts a three-cycle, and every joint is checked as soon as
    both of its ends are placed. Exact whatever the automorphism group is, which link orbits alone are not: when 9
    divides the group's order, different three-fold symmetries may fix different numbers of links.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> star = MechanismGraph(5, [(0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (3, 4)], frame=0)
    >>> threefold_symmetry(star, 1), threefold_symmetry(star, 0)
    ((0, 2, 3, 1, 4), ())
    """
    mobility = {(j.a, j.b): j.mobility for j in graph.joints} | {(j.b, j.a): j.mobility for j in graph.joints}
    profile = [sorted(m for (a, _), m in mobility.items() if a == link) for link in range(graph.links)]
    image: dict[int, int] = {}

    def consistent(placed: tuple[int, ...]) -> bool:
        return all(mobility.get((a, b)) == mobility.get((image[a], image[b])) for a in placed for b in image)

    def search(free: tuple[int, ...], fixed_left: int) -> bool:
        if not free:
            return fixed_left == 0
        first, rest = free[0], free[1:]
        if fixed_left and place((first,), rest, fixed_left - 1):
            return True
        alike = [link for link in rest if profile[link] == profile[first]]
        return any(
            place((first, a, b), tuple(link for link in rest if link not in (a, b)), fixed_left)
            for a in alike
            for b in alike
            if a != b
        )

    def place(cycle: tuple[int, ...], free: tuple[int, ...], fixed_left: int) -> bool:
        image.update(zip(cycle, (*cycle[1:], cycle[0]), strict=True))
        found = consistent(cycle) and search(free, fixed_left)
        if not found:
            for link in cycle:
                del image[link]
        return found

    frame = graph.frame
    if frame is None or (graph.links - 1 - fixed_moving_links) % 3 or fixed_moving_links > graph.links - 4:
        return ()  # no three-cycle left, or the rest does not fall into three-cycles
    image[frame] = frame
    if not search(tuple(link for link in range(graph.links) if link != frame), fixed_moving_links):
        return ()
    return tuple(image[link] for link in range(graph.links))


#: Words, whether they are good news, and margins, from the value of an outcome.
Verdict = Callable[[Any], tuple[str, bool, tuple[Quantity, ...]]]

#: The reason of a candidate that no module knows: not a failure.
UNKNOWN = "no kinematic module yet recognises this graph"


def recognise_by_key(candidates: tuple[Candidate, ...], known: MechanismGraph, module: str) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to `known` (frame and joint mobilities respected) as belonging to `module`."""
    return tuple(
        Recognised(c, module) if c.graph.key == known.key else Recognised(c, None, UNKNOWN) for c in candidates
    )


def records_of(
    recognised: tuple[Recognised, ...], outcomes: tuple[Attempt, ...], verdict: Verdict
) -> tuple[Record, ...]:
    """Return one record per candidate, in their order; `verdict` reads the value of an outcome."""
    by_number = {outcome.candidate.number: outcome for outcome in outcomes}
    found = []
    for item in recognised:
        outcome = by_number.get(item.candidate.number)
        own = item.candidate.number, item.candidate.key, item.candidate.solution
        if outcome is None or item.module is None:
            found.append(Record(*own, "not recognised", reason=item.reason))
        elif outcome.failed:
            found.append(Record(*own, "failed", item.module, reason=outcome.reason))
        else:
            found.append(Record(*own, "assessed", item.module, *verdict(outcome.value)))
    return tuple(found)


def records(context: Context, outcomes: tuple[Outcome, ...]) -> tuple[Record, ...]:
    """Return one record per candidate, in their order.

    >>> records(None, (Outcome(2, "k", status="rejected", stage="goals", cause="too long", reason="too long: 3 m"),))[0]
    ... # doctest: +ELLIPSIS
    Record(number=2, key='k', ..., status='rejected', ..., reason='too long: 3 m', cause='goals: too long')
    """
    found = []
    for outcome in outcomes:
        own = outcome.number, outcome.key, outcome.solution
        record = Record(*own, outcome.status, reason=outcome.reason, cause=f"{outcome.stage}: {outcome.cause}")
        if outcome.status == "assessed":
            record = replace(outcome.products["record"], number=own[0], key=own[1], solution=own[2])
        found.append(record)
    return tuple(found)


_MOST = 60  # more is not a contact sheet any more


def pictures(
    context: Context, candidates: tuple[object, ...], recognised: tuple[Recognised, ...]
) -> tuple[Picture, ...]:
    """Draw every candidate by adjacency levels, the recognised ones first and larger; at most sixty."""
    from graphsynth.drawing.graphs import draw_levels

    found = []
    for item in sorted(recognised, key=lambda r: (r.module is None, r.candidate.number))[:_MOST]:
        graph, title, known = item.candidate.graph, f"No. {item.candidate.number}", item.module is not None
        svg = draw_levels(graph, 460 if known else 210, f"{title}, by levels")
        sizes = ", ".join(str(len(level)) for level in graph.levels)
        caption = f"Recognised as {item.module}; {item.candidate.solution}, levels of {sizes} links" if known else ""
        found.append(Picture(title, svg, caption, "wide" if known else "small"))
    return tuple(found)


#: Decimals of a score: what differs by rounding alone is a tie.
DIGITS = 12
_SIGNS = {"min": 1.0, "max": -1.0}


def rank(context: Context, records: tuple[Record, ...]) -> Ranking:
    """Rank the assessed records by ``[ranking]``; a `SceneError` if no record has the quantity of an objective."""
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
    losses = {}  # what is to be small
    for number, row in values.items():
        pairs = zip(objectives, row, strict=True)
        losses[number] = tuple(x * _SIGNS[o.goal] if isinstance(o.goal, str) else abs(x - o.goal) for o, x in pairs)
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
    front: dict[int, tuple[float, ...]] = {}
    for row, number in sorted((row, number) for number, row in losses.items()):
        if not any(all(map(le, other, row)) and other != row for other in front.values()):
            front[number] = row
    return list(front)
