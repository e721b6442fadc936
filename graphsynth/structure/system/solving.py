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
from graphsynth.structure.system.equations import (
    EquationRow,
    IntegerProblem,
    domains_of,
    kind_limit,
    propagate,
    rows_of,
)
from graphsynth.structure.system.variables import LARGEST, SPACES, Counts, Range

_WORDS = {"n": "n (moving links)", "p": "p (joints)", "W": "W (mobility)"}


def solutions(problem: IntegerProblem) -> Iterator[LinkAssortment]:
    """Yield every integer solution, lexicographically by (W, Pi, n, p, p_1.., t0, v_ct, n_2, n_3, ...).

    Raises `SpecError` before the first solution, if the question does not bound the search; names the variable to
    bound.

    >>> next(solutions(IntegerProblem((("Pi", (3, 3)), ("W", (1, 1)), ("n", (3, 3)))))).frame_joints
    2
    """
    for mobility, space, links, joints in _sizes(problem):
        loops = joints - links
        sub_edges = mobility + space * loops
        ranges = _mobility_ranges(problem, space)
        attachments = list(_attachments(problem, mobility, links, loops))
        largest = kind_limit(problem, loops, mobility)
        for freedoms in compositions(joints, sub_edges, 1, space - 1, ranges):
            for frame_joints, parts in attachments:
                for kinds in compositions(links, 2 * joints - frame_joints, 2, largest, problem.kinds):
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


def _box(problem: IntegerProblem, space: int) -> dict[str, tuple[int, int]] | None:
    """Finite bounds of W, n and p for one space, or None if it has no solution."""
    lowest, highest = problem.range("Pi")
    if not (lowest or 0) <= space <= (highest or SPACES[-1]):
        return None
    domains, rows = domains_of(problem, space), rows_of(problem, space)
    if not propagate(problem, domains, rows):
        return None
    box: dict[str, tuple[int, int]] = {}
    for symbol in ("n", "p", "W"):
        lo, hi = domains[symbol]
        if lo is None or hi is None:  # propagation did not bound it: exact linear programming
            try:
                most = maximum({symbol: 1}, rows, domains) if hi is None else Fraction(hi)
                least = maximum({symbol: -1}, rows, domains) if lo is None else Fraction(-lo)
            except ValueError:
                return None
            domains[symbol] = (None if least is None else ceil(-least), None if most is None else floor(most))
            if not propagate(problem, domains, rows):
                return None
            lo, hi = domains[symbol]
        if lo is None or hi is None:
            wanted = _WORDS[symbol]
            if symbol == "p" and None in domains["W"]:
                wanted = f"{_WORDS['W']} or {wanted}"
            raise SpecError(
                f"the question leaves the size open, so there may be infinitely many solutions: bound {wanted}, "
                f"for example {symbol} = (1, 15) or a fixed value"
            )
        box[symbol] = lo, hi
    return box


def _sizes(problem: IntegerProblem) -> Iterator[tuple[int, int, int, int]]:
    """Yield (W, Pi, n, p) in order: W = Pi*n - sum (Pi-i)*p_i bounds p on both sides once n is known."""
    boxes = {space: box for space in SPACES if (box := _box(problem, space)) is not None}
    reached = [mobility for box in boxes.values() for mobility in box["W"]]
    for mobility in range(min(reached), max(reached) + 1) if reached else ():
        for space, box in boxes.items():
            usable = [i for i in problem.mobilities if i < space] or [1]
            for links in range(box["n"][0], box["n"][1] + 1) if _within(box["W"], mobility) else ():
                constraint = space * links - mobility
                least = -(-constraint // (space - min(usable)))
                most = constraint // (space - max(usable))
                for joints in range(max(least, box["p"][0]), min(most, box["p"][1]) + 1):
                    loops = joints - links
                    if _within(problem.range("v"), loops) and _within(problem.range("G"), mobility + space * loops):
                        yield mobility, space, links, joints


def number_of_solutions(problem: IntegerProblem, enough: int) -> int:
    """Count the solutions without listing them: exactly, or the first number beyond ``enough`` that is found.

    A number above ``enough`` need not be the exact one.

    >>> question = IntegerProblem((("Pi", (3, 3)), ("n", (40, 40)), ("p", (59, 59))))
    >>> number_of_solutions(question, 10**6)
    93339
    """
    total = 0
    for largest in (5, LARGEST):  # with links of few joints there may be enough already
        total = 0
        for mobility, space, links, joints in _sizes(problem):
            loops = joints - links
            freedoms = _counts(joints, 1, space - 1, _mobility_ranges(problem, space)).get(mobility + space * loops, 0)
            if freedoms:
                most = min(largest, kind_limit(problem, loops, mobility))
                kinds = _counts(links, 2, most, problem.kinds, 2 * joints)
                attachments = _attachments(problem, mobility, links, loops)
                total += freedoms * sum(kinds.get(2 * joints - frame_joints, 0) for frame_joints, _ in attachments)
                if total > enough:
                    return total
    return total


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


def _attachments(problem: IntegerProblem, mobility: int, links: int, loops: int) -> Iterator[tuple[int, int]]:
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


def _mobility_ranges(problem: IntegerProblem, space: int) -> dict[int, Range]:
    ranges = {i: problem.range(f"p{i}") for i in range(1, space)}
    return {i: (lo or 0, hi if i in problem.mobilities else 0) for i, (lo, hi) in ranges.items()}


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


def maximum(objective: Mapping[str, int], rows: Iterable[EquationRow], domains: Mapping[str, Range]) -> Fraction | None:
    """Maximise ``sum coefficient * variable`` over the rows and domains, in rational numbers.

    Returns the exact maximum; None if it is infinite. Raises `ValueError` if no rational point satisfies the rows.
    Two-phase simplex with Bland's rule (R. G. Bland, Math. Oper. Res. 2 (1977) 103), which cannot cycle.

    >>> maximum({"x": 1}, [EquationRow("", (("x", 2), ("y", 1)), None, 7)], {"x": (0, None), "y": (1, None)})
    Fraction(3, 1)
    >>> maximum({"y": 1}, [EquationRow("", (("x", 1), ("y", -1)), 0, None)], {"x": (0, None), "y": (1, None)}) is None
    True
    """
    limits = [
        ({name: sign * own for name, own in row.terms}, sign * side)
        for row in rows
        for side, sign in ((row.highest, 1), (row.lowest, -1))
        if side is not None
    ]
    used = sorted({name for terms, _ in limits for name in terms} | set(objective))
    limits += [({name: 1}, hi) for name in used if (hi := domains[name][1]) is not None]
    # a variable without lower bound is a difference of two, the others are measured from their lower bounds
    columns = [(name, sign) for name in used for sign in ((1, -1) if domains[name][0] is None else (1,))]
    table: list[list[Fraction]] = []  # basic variable + sum coefficient * free variable = last entry
    for terms, side in [*limits, ({name: -own for name, own in objective.items()}, 0)]:
        side -= sum(own * (domains[name][0] or 0) for name, own in terms.items())
        table.append([Fraction(sign * terms.get(name, 0)) for name, sign in columns] + [Fraction(side)])
    free = list(range(len(columns)))
    basic = list(range(len(columns), len(columns) + len(limits)))
    lowest = min(range(len(limits)), key=lambda row: table[row][-1], default=-1)
    if limits and table[lowest][-1] < 0:  # phase one: minimise an artificial variable, number -1
        free.append(-1)
        for line in table:
            line.insert(-1, Fraction(-1 if line is not table[-1] else 0))
        table.append([Fraction(0)] * len(columns) + [Fraction(1), Fraction(0)])
        _pivot(table, basic, free, lowest, len(columns))
        _climb(table, basic, free)
        if table.pop()[-1] < 0:
            raise ValueError("no rational point satisfies the rows")
        if -1 in basic:
            row = basic.index(-1)
            _pivot(table, basic, free, row, next(column for column, own in enumerate(table[row]) if own))
        column = free.index(-1)
        del free[column]
        for line in table:
            del line[column]
    return table[-1][-1] if _climb(table, basic, free) else None


def _climb(table: list[list[Fraction]], basic: list[int], free: list[int]) -> bool:
    """Exchange variables until the last line, the objective, can grow no more; False if nothing bounds it."""
    while rising := [(label, column) for column, label in enumerate(free) if table[-1][column] < 0]:
        column = min(rising)[1]
        ratios = [
            (line[-1] / line[column], label, row)
            for row, (label, line) in enumerate(zip(basic, table))
            if line[column] > 0
        ]
        if not ratios:
            return False
        _pivot(table, basic, free, min(ratios)[2], column)
    return True


def _pivot(table: list[list[Fraction]], basic: list[int], free: list[int], row: int, column: int) -> None:
    """Exchange a basic variable and a free one."""
    basic[row], free[column] = free[column], basic[row]
    pivot = table[row][column]
    solved = [own / pivot for own in table[row]]
    solved[column] = 1 / pivot
    for line in table:
        factor, line[column] = line[column], Fraction(0)
        if factor:
            line[:] = [own - factor * other for own, other in zip(line, solved)]
    table[row][:] = solved
