"""Why a structural question has no answer: the fewest equations and values that contradict each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from graphsynth.core.errors import InfeasibleSpecError
from graphsynth.structure.system.equations import (
    EQUATIONS,
    NATURAL,
    Domains,
    Problem,
    Row,
    domains_of,
    propagate,
    rows_of,
)
from graphsynth.structure.system.variables import SPACES, Range, show_range

_BUDGET = 400  # search nodes of one feasibility test; a test that runs out counts as "feasible": sound, not minimal
_TRIES = 40  # values tried of a variable without an upper bound


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
    equations = _fewest_equations(problem)
    needed = list(items)
    for item in items:
        fewer = [other for other in needed if other is not item]
        if not _possible(_only(problem, fewer), equations, NATURAL):
            needed = fewer
    rules = [rule for rule in NATURAL if _possible(_only(problem, needed), equations, set(NATURAL) - {rule})]
    if not equations and not rules:  # only a joint mobility that the space does not have leaves this trace
        rules = ["i <= Pi - 1"]
    return _sentence(needed, [*equations, *rules], default_mobilities)


def _fewest_equations(problem: Problem) -> tuple[str, ...]:
    for size in range(len(EQUATIONS)):  # size 0: the natural bounds alone
        for chosen in combinations(EQUATIONS, size):
            if not _possible(problem, chosen, NATURAL):
                return chosen
    return EQUATIONS


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
    """Whether some integers satisfy these equations; True also when the search gives up."""
    lowest, highest = problem.range("Pi")
    for space in SPACES:
        if not (lowest or 0) <= space <= (highest or SPACES[-1]):
            continue
        rows = rows_of(problem, space, equations)
        if _Search(problem, rows, tuple(natural)).run(domains_of(problem, space, natural)):
            return True
    return False


class _Search:
    """Depth-first search for one integer point, with propagation and a node budget."""

    def __init__(self, problem: Problem, rows: list[Row], natural: tuple[str, ...]) -> None:
        self.problem, self.rows, self.natural, self.nodes = problem, rows, natural, 0

    def run(self, domains: Domains) -> bool:
        self.nodes += 1
        if self.nodes > _BUDGET:
            return True
        if not propagate(self.problem, domains, self.rows, self.natural):
            return False
        used = {name for row in self.rows for name, _ in row.terms}
        open_names = [name for name in sorted(used) if domains[name][0] is None or domains[name][0] != domains[name][1]]
        if not open_names:
            return True
        name = min(open_names, key=lambda candidate: _width(domains[candidate]))
        values, complete = _candidates(domains[name])
        return any(self.run({**domains, name: (value, value)}) for value in values) or not complete


def _width(domain: Range) -> tuple[bool, int]:
    lo, hi = domain
    return (True, 0) if lo is None or hi is None else (False, hi - lo)


def _candidates(domain: Range) -> tuple[list[int], bool]:
    """Values to try, and whether they are all there are."""
    lo, hi = domain
    if lo is not None and hi is not None:
        return list(range(lo, hi + 1)), True
    if lo is not None:
        return list(range(lo, lo + _TRIES)), False
    if hi is not None:
        return list(range(hi, hi - _TRIES, -1)), False
    return sorted(range(-_TRIES, _TRIES), key=abs), False


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
