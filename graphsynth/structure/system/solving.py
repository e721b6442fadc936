"""The structural system solved exactly: every integer solution, once, in a stated order.

An outer search runs over W, Pi, n and p inside bounds found by propagation; the joint mobilities p_i and the link
kinds n_a are then compositions with two linear conditions, generated without dead ends as long as no upper bound on
a single kind interferes.  Where propagation leaves a variable open, an exact linear programme in fractions says how
large it can become, or that nothing stops it; it is seldom asked, so clarity goes before speed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from math import ceil, floor

from graphsynth.core.errors import SpecError
from graphsynth.structure.system.assortment import LinkAssortment
from graphsynth.structure.system.equations import Domains, Problem, Row, domains_of, kind_limit, propagate, rows_of
from graphsynth.structure.system.variables import LARGEST, SPACES, Counts, Range

_WORDS = {"n": "n (moving links)", "p": "p (joints)", "W": "W (mobility)"}


def solutions(problem: Problem) -> Iterator[LinkAssortment]:
    """Yield every integer solution, lexicographically by (W, Pi, n, p, p_1.., t0, v_ct, n_2, n_3, ...).

    Raises `SpecError` before the first solution, if the question does not bound the search; names the variable to
    bound.

    >>> next(solutions(Problem((("Pi", (3, 3)), ("W", (1, 1)), ("n", (3, 3)))))).frame_joints
    2
    """
    boxes = {space: box for space in SPACES if (box := _box(problem, space)) is not None}
    if not boxes:
        return
    for mobility in range(min(box["W"][0] for box in boxes.values()), max(box["W"][1] for box in boxes.values()) + 1):
        for space, box in boxes.items():
            if not box["W"][0] <= mobility <= box["W"][1]:
                continue
            for links, joints in _sizes(problem, space, mobility, box):
                yield from _of_size(problem, space, mobility, links, joints)


def _box(problem: Problem, space: int) -> dict[str, tuple[int, int]] | None:
    """Finite bounds of W, n and p for one space, or None if it has no solution."""
    lowest, highest = problem.range("Pi")
    if not (lowest or 0) <= space <= (highest or SPACES[-1]):
        return None
    domains, rows = domains_of(problem, space), rows_of(problem, space)
    if not propagate(problem, domains, rows):
        return None
    box: dict[str, tuple[int, int]] = {}
    for symbol in ("n", "p", "W"):
        if None in domains[symbol] and not _close(problem, symbol, domains, rows):
            return None
        lo, hi = domains[symbol]
        if lo is None or hi is None:
            raise _open_question(symbol, domains["W"])
        box[symbol] = lo, hi
    return box


def _close(problem: Problem, symbol: str, domains: Domains, rows: list[Row]) -> bool:
    """Bound one variable by exact linear programming where propagation did not; False if there is no solution."""
    lo, hi = domains[symbol]
    try:
        highest = maximum({symbol: 1}, rows, domains) if hi is None else Fraction(hi)
        lowest = maximum({symbol: -1}, rows, domains) if lo is None else Fraction(-lo)
    except ValueError:
        return False
    domains[symbol] = (None if lowest is None else ceil(-lowest), None if highest is None else floor(highest))
    return propagate(problem, domains, rows)


def _open_question(symbol: str, mobility: Range) -> SpecError:
    open_mobility = symbol == "p" and None in mobility
    wanted = f"{_WORDS['W']} or {_WORDS['p']}" if open_mobility else _WORDS[symbol]
    return SpecError(
        f"the question leaves the size open, so there may be infinitely many solutions: bound {wanted}, "
        f"for example {symbol} = (1, 15) or a fixed value"
    )


def _sizes(
    problem: Problem, space: int, mobility: int, box: Mapping[str, tuple[int, int]]
) -> Iterator[tuple[int, int]]:
    """Yield (n, p): W = Pi*n - sum (Pi-i)*p_i bounds p on both sides once n is known."""
    usable = [i for i in problem.mobilities if i < space] or [1]
    for links in range(box["n"][0], box["n"][1] + 1):
        constraint = space * links - mobility
        least = -(-constraint // (space - min(usable)))
        most = constraint // (space - max(usable))
        for joints in range(max(least, box["p"][0]), min(most, box["p"][1]) + 1):
            yield links, joints


def _of_size(problem: Problem, space: int, mobility: int, links: int, joints: int) -> Iterator[LinkAssortment]:
    """Yield the solutions with W, Pi, n and p known."""
    loops = joints - links
    sub_edges = mobility + space * loops
    if not (_within(problem.range("v"), loops) and _within(problem.range("G"), sub_edges)):
        return
    ranges = _mobility_ranges(problem, space)
    attachments = list(_attachments(problem, mobility, links, loops))
    largest = kind_limit(problem, loops, mobility)
    for freedoms in compositions(joints, sub_edges, 1, space - 1, ranges):
        for frame_joints, parts in attachments:
            for kinds in compositions(links, 2 * joints - frame_joints, 2, largest, _kind_ranges(problem)):
                yield LinkAssortment(
                    mobility=mobility,
                    space=space,
                    moving_links=links,
                    joints=joints,
                    p_i=tuple(freedoms.get(i, 0) for i in range(1, space)),
                    n_a=Counts(kinds),
                    loops=loops,
                    frame_loops=frame_joints - parts,
                    moving_loops=loops - frame_joints + parts,
                    frame_joints=frame_joints,
                    sub_edges=sub_edges,
                    frame_parts=parts,
                )


def number_of_solutions(problem: Problem, enough: int) -> int:
    """Count the solutions without listing them: exactly, or the first number beyond ``enough`` that is found.

    A number above ``enough`` need not be the exact one.

    >>> question = Problem((("Pi", (3, 3)), ("n", (40, 40)), ("p", (59, 59))))
    >>> number_of_solutions(question, 10**6)
    93339
    """
    boxes = {space: box for space in SPACES if (box := _box(problem, space)) is not None}
    total = 0
    for largest in (5, LARGEST):  # with links of few joints there may be enough already
        total = 0
        for space, box in boxes.items():
            for mobility in range(box["W"][0], box["W"][1] + 1):
                for links, joints in _sizes(problem, space, mobility, box):
                    total += _number_of_size(problem, space, mobility, links, joints, largest)
                    if total > enough:
                        return total
    return total


def _number_of_size(problem: Problem, space: int, mobility: int, links: int, joints: int, largest: int) -> int:
    loops = joints - links
    sub_edges = mobility + space * loops
    if not (_within(problem.range("v"), loops) and _within(problem.range("G"), sub_edges)):
        return 0
    freedoms = _counts(joints, 1, space - 1, _mobility_ranges(problem, space)).get(sub_edges, 0)
    if not freedoms:
        return 0
    largest = min(largest, kind_limit(problem, loops, mobility))
    kinds = _counts(links, 2, largest, _kind_ranges(problem), 2 * joints)
    return freedoms * sum(kinds.get(2 * joints - t0, 0) for t0, _ in _attachments(problem, mobility, links, loops))


def _counts(
    number: int, smallest: int, largest: int, ranges: Mapping[int, Range], most: int | None = None
) -> dict[int, int]:
    """Count the ways to choose x_a >= 0 with sum x_a = number, by sum a*x_a up to ``most``; see `compositions`."""
    if any(lo and not smallest <= a <= largest for a, (lo, _) in ranges.items()):
        return {}
    most = number * largest if most is None else most
    spare = most - number * smallest
    if any(lo for a, (lo, _) in ranges.items() if a > smallest + spare):
        return {}
    ways: list[dict[int, int]] = [{} for _ in range(number + 1)]  # by how many are chosen: sum above the smallest kind
    ways[0][0] = 1
    for a in range(smallest, min(largest, smallest + spare) + 1):
        lo, hi = ranges.get(a, (0, None))
        lo, step = lo or 0, a - smallest
        grown: list[dict[int, int]] = []
        for used in range(number + 1):  # one more of the kind a than one fewer, from lo to hi of them
            here = _moved(ways[used - lo], lo * step, spare) if used >= lo else {}
            for above, count in _moved(grown[-1], step, spare).items() if used else ():
                here[above] = here.get(above, 0) + count
            if hi is not None and used > hi:
                for above, count in _moved(ways[used - hi - 1], (hi + 1) * step, spare).items():
                    here[above] -= count
            grown.append({above: count for above, count in here.items() if count})
        ways = grown
    return {above + number * smallest: count for above, count in ways[number].items()}


def _moved(counts: Mapping[int, int], by: int, most: int) -> dict[int, int]:
    return {above + by: count for above, count in counts.items() if above + by <= most}


def _attachments(problem: Problem, mobility: int, links: int, loops: int) -> Iterator[tuple[int, int]]:
    """Yield (t0, c) by increasing t0, then increasing v_ct = t0 - c."""
    most_parts = max(1, min(mobility, links)) if problem.fractionated else 1
    for frame_joints in range(2, loops + most_parts + 1):
        for parts in range(min(most_parts, frame_joints), 0, -1):
            frame_loops = frame_joints - parts
            if (
                _within(problem.range("t0"), frame_joints)
                and _within(problem.range("v_ct"), frame_loops)
                and loops >= frame_loops
                and _within(problem.range("v_P"), loops - frame_loops)
            ):
                yield frame_joints, parts


def _within(bounds: Range, value: int) -> bool:
    lo, hi = bounds
    return (lo is None or lo <= value) and (hi is None or value <= hi)


def _mobility_ranges(problem: Problem, space: int) -> dict[int, Range]:
    ranges = {i: problem.range(f"p{i}") for i in range(1, space)}
    return {i: (lo or 0, hi if i in problem.mobilities else 0) for i, (lo, hi) in ranges.items()}


def _kind_ranges(problem: Problem) -> dict[int, Range]:
    return {int(symbol[1:]): own for symbol, own in problem.ranges if symbol[0] == "n" and symbol != "n"}


def compositions(
    number: int, total: int, smallest: int, largest: int, ranges: Mapping[int, Range]
) -> Iterator[dict[int, int]]:
    """Yield every way to choose x_a >= 0 with sum x_a = number and sum a*x_a = total.

    ``smallest``, ``largest``: smallest <= a <= largest; ``ranges``: bounds of single x_a; kinds not listed are free.
    Yields non-zero x_a by a, in lexicographic order of (x_smallest, x_smallest+1, ...).

    >>> [list(found.values()) for found in compositions(14, 37, 2, 4, {})]
    [[5, 9], [6, 7, 1], [7, 5, 2], [8, 3, 3], [9, 1, 4]]
    """
    floor = {a: lo for a, (lo, _) in ranges.items() if lo}
    if any(not smallest <= a <= largest for a in floor):
        return
    room = {a: hi - floor.get(a, 0) for a, (_, hi) in ranges.items() if hi is not None}
    number -= sum(floor.values())
    total -= sum(a * lo for a, lo in floor.items())
    for extra in _free_compositions(number, total, smallest, largest, room):
        merged = dict(floor)
        for a, x in extra:
            merged[a] = merged.get(a, 0) + x
        yield dict(sorted(merged.items()))


def _free_compositions(
    number: int, total: int, smallest: int, largest: int, room: Mapping[int, int]
) -> Iterator[tuple[tuple[int, int], ...]]:
    """Compositions with zero lower bounds; an explicit stack, since kinds can be thousands."""
    # An entry: the next kind a, what is left for the kinds from a on, and the non-zero choices so far.
    stack: list[tuple[int, int, int, tuple[tuple[int, int], ...]]] = [(smallest, number, total, ())]
    while stack:
        a, left, sum_left, chosen = stack.pop()
        if left == 0 and sum_left == 0:
            yield chosen
        if left <= 0 or a > largest or not a * left <= sum_left <= largest * left:
            continue
        most = left if a == largest else min(left, (largest * left - sum_left) // (largest - a))
        least = max(0, (a + 1) * left - sum_left)
        # Pushed from the largest down, so that the smallest x_a is taken first.
        stack.extend(
            (a + 1, left - x, sum_left - a * x, (*chosen, (a, x)) if x else chosen)
            for x in range(min(most, room.get(a, most)), least - 1, -1)
        )


_Terms = dict[str, Fraction]


def maximum(objective: Mapping[str, int], rows: Iterable[Row], domains: Mapping[str, Range]) -> Fraction | None:
    """Maximise ``sum coefficient * variable`` over the rows and domains, in rational numbers.

    Returns the exact maximum; None if it is infinite. Raises `ValueError` if no rational point satisfies the rows.
    Two-phase tableau simplex with Bland's rule (R. G. Bland, Math. Oper. Res. 2 (1977) 103), which cannot cycle.

    >>> maximum({"x": 1}, [Row("", (("x", 2), ("y", 1)), None, 7)], {"x": (0, None), "y": (1, None)})
    Fraction(3, 1)
    >>> maximum({"y": 1}, [Row("", (("x", 1), ("y", -1)), 0, None)], {"x": (0, None), "y": (1, None)}) is None
    True
    """
    listed = list(rows)
    used = {name for row in listed for name, _ in row.terms} | set(objective)
    limits = [(_split(dict(row.terms), domains), side, sign) for row in listed for side, sign in _sides(row)]
    for name in used:
        hi = domains[name][1]
        if hi is not None:
            limits.append((_split({name: 1}, domains), hi, 1))
    tableau = _Tableau([_shifted(terms, side, sign, domains) for (terms, side, sign) in limits])
    tableau.make_feasible()
    offset = sum(
        (Fraction(coefficient * (domains[name][0] or 0)) for name, coefficient in objective.items()), Fraction(0)
    )
    best = tableau.maximise(_split(dict(objective), domains))
    return None if best is None else best + offset


def _sides(row: Row) -> list[tuple[int, int]]:
    sides = [] if row.highest is None else [(row.highest, 1)]
    return sides if row.lowest is None else [*sides, (row.lowest, -1)]


def _split(terms: Mapping[str, int], domains: Mapping[str, Range]) -> _Terms:
    """Write a variable without lower bound as a difference of two non-negative ones."""
    split: _Terms = {}
    for name, coefficient in terms.items():
        split[name] = Fraction(coefficient)
        if domains[name][0] is None:
            split[name + "-"] = Fraction(-coefficient)
    return split


def _shifted(terms: _Terms, side: int, sign: int, domains: Mapping[str, Range]) -> tuple[_Terms, Fraction]:
    """Return (terms, bound) of ``terms <= bound`` in variables measured from their lower bounds."""
    shift = sum((own * (domains[name][0] or 0) for name, own in terms.items() if name in domains), Fraction(0))
    return {name: sign * own for name, own in terms.items()}, sign * (side - shift)


class _Tableau:
    """Dictionary form: each basic variable = constant + sum coefficient * non-basic variable, all >= 0."""

    def __init__(self, limits: list[tuple[_Terms, Fraction]]) -> None:
        self.basic: dict[str, _Terms] = {}
        self.constant: dict[str, Fraction] = {}
        for number, (terms, bound) in enumerate(limits):
            slack = f"~{number}"
            self.basic[slack] = {name: -own for name, own in terms.items()}
            self.constant[slack] = bound

    def make_feasible(self) -> None:
        """Phase one: minimise one artificial variable."""
        if min(self.constant.values(), default=Fraction(0)) >= 0:
            return
        for terms in self.basic.values():
            terms["!"] = Fraction(1)
        self._pivot("!", min(self.constant, key=lambda name: (self.constant[name], name)))
        best = self.maximise({"!": Fraction(-1)})
        if best is None or best < 0:
            raise ValueError("no rational point satisfies the rows")
        if "!" in self.basic:
            entering = next(name for name, own in sorted(self.basic["!"].items()) if own)
            self._pivot(entering, "!")
        for terms in self.basic.values():
            terms.pop("!", None)

    def maximise(self, objective: _Terms) -> Fraction | None:
        while True:
            cost, value = self._reduced(objective)
            entering = min((name for name, own in cost.items() if own > 0), default=None)
            if entering is None:
                return value
            ratios = [
                (-self.constant[name] / terms[entering], name)
                for name, terms in self.basic.items()
                if terms.get(entering, 0) < 0
            ]
            if not ratios:
                return None
            self._pivot(entering, min(ratios)[1])

    def _reduced(self, objective: _Terms) -> tuple[_Terms, Fraction]:
        """Write the objective in terms of the non-basic variables."""
        cost: _Terms = {}
        value = Fraction(0)
        for name, own in objective.items():
            if name in self.basic:
                value += own * self.constant[name]
                for other, inner in self.basic[name].items():
                    cost[other] = cost.get(other, Fraction(0)) + own * inner
            else:
                cost[name] = cost.get(name, Fraction(0)) + own
        return cost, value

    def _pivot(self, entering: str, leaving: str) -> None:
        terms, constant = self.basic.pop(leaving), self.constant.pop(leaving)
        factor = terms.pop(entering)
        solved = {name: -own / factor for name, own in terms.items() if own}
        solved[leaving] = 1 / factor
        constant = -constant / factor
        for name, others in self.basic.items():
            own = others.pop(entering, None)
            if own:
                self.constant[name] += own * constant
                for other, inner in solved.items():
                    others[other] = others.get(other, Fraction(0)) + own * inner
        self.basic[entering], self.constant[entering] = solved, constant
