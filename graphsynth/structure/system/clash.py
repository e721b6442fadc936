"""Why a structural question has no answer: the fewest equations and values that contradict each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from graphsynth.core.errors import InfeasibleSpecError
from graphsynth.structure.system.equations import EQUATIONS, NATURAL, Problem, domains_of, propagate, rows_of
from graphsynth.structure.system.variables import SPACES, Range, show_range

_BUDGET = 400  # search nodes of one feasibility test; a test that runs out counts as "feasible": sound, not minimal


@dataclass(frozen=True, slots=True)
class _Item:
    """One thing the user said, or one default: the text, and whether it is a default."""

    text: str
    symbol: str
    default: bool = False


def explain(problem: Problem, *, default_space: bool, default_mobilities: bool) -> InfeasibleSpecError:
    """Name a smallest set of equations, and in it a minimal set of values, that contradict each other.

    The subsets of the equations are tried by increasing size; then every value that is not needed is dropped (a
    deletion filter).  Dropping an equation or a value only ever enlarges the set of solutions, so what is left is a
    true contradiction.

    ``problem``: a question without solutions; ``default_space``, ``default_mobilities``: whether Pi = 3 and the joint
    mobilities are defaults and not the user's words.
    """
    items = [_Item(_text(symbol, own), symbol) for symbol, own in problem.ranges if symbol != "Pi"]
    items.append(_Item(_text("Pi", problem.range("Pi")), "Pi", default_space))
    items.append(_Item(f"joints of mobility {_listed(map(str, problem.mobilities), 'or')} only", "mobilities", True))
    if problem.link_limit is not None:
        items.append(_Item(f"at most {problem.link_limit} joints on a moving link", "link_limit"))
    # of size 0: the natural bounds alone
    subsets = (chosen for size in range(len(EQUATIONS)) for chosen in combinations(EQUATIONS, size))
    equations = next((chosen for chosen in subsets if not _possible(problem, chosen, NATURAL)), EQUATIONS)
    needed = list(items)
    for item in items:
        fewer = [other for other in needed if other is not item]
        if not _possible(_only(problem, fewer), equations, NATURAL):
            needed = fewer
    rules = [rule for rule in NATURAL if _possible(_only(problem, needed), equations, set(NATURAL) - {rule})]
    if not equations and not rules:  # only a joint mobility that the space does not have leaves this trace
        rules = ["i <= Pi - 1"]
    return _sentence(needed, [*equations, *rules], default_mobilities)


def _only(problem: Problem, items: Iterable[_Item]) -> Problem:
    """Return the problem with nothing but the given items; everything else is free."""
    said = {item.symbol for item in items}
    ranges = tuple((symbol, own) for symbol, own in problem.ranges if symbol in said)
    if "Pi" not in said:
        ranges = (*ranges, ("Pi", (SPACES[0], SPACES[-1])))
    return replace(
        problem,
        ranges=ranges,
        mobilities=problem.mobilities if "mobilities" in said else tuple(range(1, SPACES[-1])),
        link_limit=problem.link_limit if "link_limit" in said else None,
    )


def _possible(problem: Problem, equations: Sequence[str], natural: Iterable[str]) -> bool:
    """Whether some integers satisfy these equations; True also when the search gives up.

    Depth first for one integer point, with propagation and a budget of nodes; the narrowest domain is divided.
    """
    lowest, highest = problem.range("Pi")
    natural = tuple(natural)
    for space in SPACES:
        if not (lowest or 0) <= space <= (highest or SPACES[-1]):
            continue
        rows = rows_of(problem, space, equations)
        used = sorted({name for row in rows for name, _ in row.terms})
        waiting, nodes = [domains_of(problem, space, natural)], 0
        while waiting:
            domains, nodes = waiting.pop(), nodes + 1
            if nodes > _BUDGET:
                return True
            if not propagate(problem, domains, rows, natural):
                continue
            name, least, most = "", 0, 0
            for candidate in used:
                lo, hi = domains[candidate]
                if lo is not None and hi is not None and lo < hi and (not name or hi - lo < most - least):
                    name, least, most = candidate, lo, hi
            if not name:  # everything is fixed, or nothing bounds what is left
                return True
            values = range(min(most, least + _BUDGET), least - 1, -1)  # the smallest comes first
            waiting += [{**domains, name: (value, value)} for value in values]
    return False


def _text(symbol: str, own: Range) -> str:
    lo, hi = own
    return f"{symbol} = {show_range(own)}" if lo is None or hi is None or lo == hi else f"{symbol} = {lo}..{hi}"


def _listed(words: Iterable[str], last: str) -> str:
    listed = list(words)
    return listed[0] if len(listed) == 1 else f"{', '.join(listed[:-1])} {last} {listed[-1]}"


def _sentence(needed: Sequence[_Item], equations: Sequence[str], default_mobilities: bool) -> InfeasibleSpecError:
    said = [item.text + (" (default)" if item.default and item.symbol == "Pi" else "") for item in needed]
    verb = "clashes with" if len(said) == 1 else "clash in"
    remedy = "free or change one of these values"
    if any(item.symbol == "mobilities" for item in needed) and default_mobilities:
        remedy += ", or allow higher pairs with max_joint_mobility"
    values = _listed(said, "and") if said else "the natural bounds"
    message = f"no integer solution: {values} {verb} {_listed(equations, 'and')}; {remedy}"
    return InfeasibleSpecError(message, (*said, *equations))
