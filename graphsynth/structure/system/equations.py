"""The eight equations of the structural system as data, exact bound propagation over them, and why they contradict.

For a given Pi every equation is linear.  A row is ``lowest <= sum coefficient * variable <= highest``; the domains
of the variables shrink until no row can shrink them further.  Integers only, ``None`` is infinity.

The kinds of links beyond the largest one that the question mentions are gathered in two variables: ``k``, how many
such links there are, and ``e``, how many joints they have together.  Any k, e with (A+1)*k <= e <= A_max*k can be
realised by integers, so nothing is lost.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TypeAlias

from graphsynth.core.errors import InfeasibleSpecError
from graphsynth.structure.system.variables import SPACES, Range, show_range

Domains: TypeAlias = "dict[str, Range]"

#: Printed form of the equations, in the order of docs/explanation/structural-system.md.
EQUATIONS = (
    "W = G - v*Pi",
    "p = sum p_i",
    "v = p - n",
    "n = sum n_a",
    "v = v_ct + v_P",
    "t0 = v_ct + 1",
    "2p = t0 + sum a*n_a",
    "G = sum i*p_i",
)

#: Natural bounds that are rules rather than signs; they can be named in a contradiction.
NATURAL = ("t0 >= 2", "a <= v + 1")

_TAIL = "the other kinds of links"
_ROUNDS = 200
_HUGE = 10**9  # a vertex of the system has far smaller coordinates: a lower bound above it means "no solution"


@dataclass(frozen=True, slots=True)
class IntegerProblem:
    """A structural question with every rule of reading it made explicit."""

    #: tuple of (symbol, range): What the question fixes or bounds; ``n`` instead of ``N``, ``Pi`` always present
    ranges: tuple[tuple[str, Range], ...]
    mobilities: tuple[int, ...] = (1,)  # joint mobilities i whose p_i may be positive
    link_limit: int | None = None  # most joints on a moving link; None for the natural bound alone
    fractionated: bool = False  # Whether the mechanism may fall apart (c >= 1 parts) without its frame

    def range(self, symbol: str) -> Range:
        """Return what the question says about ``symbol``."""
        return dict(self.ranges).get(symbol, (None, None))

    @property
    def kinds(self) -> dict[int, Range]:
        """What the question says about links with a joints, by a."""
        return {int(symbol[1:]): own for symbol, own in self.ranges if symbol[0] == "n" and symbol != "n"}

    @property
    def largest_kind(self) -> int:
        """A: the largest number of joints of a link that has a variable of its own."""
        return max([3, *self.kinds])


@dataclass(frozen=True, slots=True)
class EquationRow:
    """``lowest <= sum coefficient * variable <= highest``."""

    label: str
    terms: tuple[tuple[str, int], ...]
    lowest: int | None = 0
    highest: int | None = 0


def rows_of(problem: IntegerProblem, space: int, equations: Collection[str] = EQUATIONS) -> list[EquationRow]:
    """Return the given equations for Pi = ``space``.

    Two consequences that make propagation strong are added when the equations imply them:
    W = Pi*n - sum (Pi-i)*p_i and 2v = t0 + sum (a-2)*n_a.
    """
    freedoms = [(f"p{i}", i) for i in range(1, space)]
    kinds = [(f"n{a}", a) for a in range(2, problem.largest_kind + 1)]
    excess = ((name, a - 2) for name, a in kinds if a > 2)
    freedom = ((name, i - space) for name, i in freedoms)
    terms: tuple[tuple[tuple[str, int], ...], ...] = (
        (("G", 1), ("v", -space), ("W", -1)),
        (("p", -1), *((name, 1) for name, _ in freedoms)),
        (("p", 1), ("n", -1), ("v", -1)),
        (("n", -1), *((name, 1) for name, _ in kinds), ("k", 1)),
        (("v_ct", 1), ("v_P", 1), ("v", -1)),
        (("v_ct", 1), ("c", 1), ("t0", -1)),
        (("p", -2), ("t0", 1), *kinds, ("e", 1)),
        (("G", -1), *freedoms),
    )
    rows = [EquationRow(label, own) for label, own in zip(EQUATIONS, terms) if label in equations]
    rows.append(EquationRow(_TAIL, (("e", 1), ("k", -problem.largest_kind - 1)), 0, None))
    if problem.link_limit is not None:
        rows.append(EquationRow(_TAIL, (("e", -1), ("k", problem.link_limit)), 0, None))
    consequences = (
        ((0, 1, 2, 7), EquationRow("", (("n", space), ("W", -1), *freedom))),
        ((2, 3, 6), EquationRow("", (("v", -2), ("t0", 1), *excess, ("e", 1), ("k", -2)))),
    )
    return rows + [row for parents, row in consequences if all(EQUATIONS[parent] in equations for parent in parents)]


def domains_of(problem: IntegerProblem, space: int, natural: Iterable[str] = NATURAL) -> Domains:
    """Return the domain of every variable before propagation: the natural bounds and the question's own."""
    domains: Domains = {"W": (None, None), "n": (1, None), "p": (1, None)}
    domains.update(dict.fromkeys(("v", "v_ct", "v_P", "G", "k", "e"), (0, None)))
    domains["t0"] = (2 if "t0 >= 2" in natural else 1, None)
    domains["c"] = (1, None if problem.fractionated else 1)
    domains.update({f"n{a}": (0, None) for a in range(2, problem.largest_kind + 1)})
    domains.update({f"p{i}": (0, None if i in problem.mobilities else 0) for i in range(1, space)})
    for symbol, own in problem.ranges:
        if symbol != "Pi":
            # A joint mobility that the space does not have: p_i = 0 is the natural bound i <= Pi - 1.
            domains[symbol] = _meet(domains.get(symbol, (0, 0)), own)
    return domains


def _meet(first: Range, second: Range) -> Range:
    lows = [side for side in (first[0], second[0]) if side is not None]
    highs = [side for side in (first[1], second[1]) if side is not None]
    return max(lows, default=None), min(highs, default=None)


def propagate(
    problem: IntegerProblem, domains: Domains, rows: list[EquationRow], natural: Iterable[str] = NATURAL
) -> bool:
    """Shrink ``domains`` in place by every row until nothing changes.

    Returns False if some domain is empty: then there is no integer solution.  True proves nothing.
    """
    if any(lo is not None and hi is not None and lo > hi for lo, hi in domains.values()):
        return False
    bounded_kinds = "a <= v + 1" in natural
    for _ in range(_ROUNDS):
        before = dict(domains)
        if not _limit_kinds(problem, domains, bounded_kinds):
            return False
        for row in rows:
            if not _tighten(row, domains):
                return False
        if domains == before:
            return True
        if any(lo is not None and lo > _HUGE for lo, _ in domains.values()):
            return False
    return True


def kind_limit(problem: IntegerProblem, loops: int, mobility: int) -> int:
    """Return the largest possible number of joints on a moving link.

    A link with a joints leaves v - a + c' >= 0 loops when it is taken away, c' the number of parts left: a <= v + c'.
    A non-fractionated chain has c' = 1; otherwise each part moves on its own, so c' <= W.
    """
    natural = loops + (max(1, mobility) if problem.fractionated else 1)
    return natural if problem.link_limit is None else min(natural, problem.link_limit)


def _limit_kinds(problem: IntegerProblem, domains: Domains, bounded_kinds: bool) -> bool:
    """Apply a <= limit to the domains of the link kinds, and 1 <= c <= max(1, W)."""
    limit = problem.link_limit
    loops, mobility = domains["v"][1], domains["W"][1]
    if problem.fractionated and mobility is not None:
        domains["c"] = _meet(domains["c"], (1, max(1, mobility)))
    if bounded_kinds and loops is not None and (mobility is not None or not problem.fractionated):
        limit = kind_limit(problem, loops, mobility or 0)
    if limit is None:
        return True
    for a in range(limit + 1, problem.largest_kind + 1):
        if a >= 2:
            domains[f"n{a}"] = _meet(domains[f"n{a}"], (0, 0))
    if limit <= problem.largest_kind:
        domains["k"] = domains["e"] = (0, 0)
    row = EquationRow(_TAIL, (("e", -1), ("k", limit)), 0, None)
    empty = any(lo is not None and hi is not None and lo > hi for lo, hi in domains.values())
    return not empty and _tighten(row, domains)


def _tighten(row: EquationRow, domains: Domains) -> bool:
    """Shrink the domains of one row's variables; False if one becomes empty."""
    least, most, open_below, open_above = 0, 0, 0, 0
    spans: list[Range] = []
    for name, coefficient in row.terms:
        lo, hi = domains[name]
        if coefficient < 0:
            lo, hi = hi, lo
        low = None if lo is None else coefficient * lo
        high = None if hi is None else coefficient * hi
        spans.append((low, high))
        if low is None:
            open_below += 1
        else:
            least += low
        if high is None:
            open_above += 1
        else:
            most += high
    for (name, coefficient), (low, high) in zip(row.terms, spans):
        ceiling = floor = None
        if row.highest is not None and open_below - (low is None) == 0:
            ceiling = row.highest - (least - (low or 0))
        if row.lowest is not None and open_above - (high is None) == 0:
            floor = row.lowest - (most - (high or 0))
        if coefficient < 0:
            floor, ceiling = ceiling, floor
        lower = None if floor is None else -(-floor // coefficient)
        upper = None if ceiling is None else ceiling // coefficient
        new = _meet(domains[name], (lower, upper))
        if new[0] is not None and new[1] is not None and new[0] > new[1]:
            return False
        domains[name] = new
    return True


_BUDGET = 400  # search nodes of one feasibility test; a test that runs out counts as "feasible": sound, not minimal


@dataclass(frozen=True, slots=True)
class _Item:
    """One thing the user said, or one default: the text, and whether it is a default."""

    text: str
    symbol: str
    default: bool = False


def explain(problem: IntegerProblem, default_space: bool, default_mobilities: bool) -> InfeasibleSpecError:
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
    broken = (*equations, *rules)
    said = [item.text + (" (default)" if item.default and item.symbol == "Pi" else "") for item in needed]
    verb = "clashes with" if len(said) == 1 else "clash in"
    remedy = "free or change one of these values"
    if any(item.symbol == "mobilities" for item in needed) and default_mobilities:
        remedy += ", or allow higher pairs with max_joint_mobility"
    values = _listed(said, "and") if said else "the natural bounds"
    message = f"no integer solution: {values} {verb} {_listed(broken, 'and')}; {remedy}"
    return InfeasibleSpecError(message, (*said, *broken))


def _only(problem: IntegerProblem, items: Iterable[_Item]) -> IntegerProblem:
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


def _possible(problem: IntegerProblem, equations: Sequence[str], natural: Iterable[str]) -> bool:
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
