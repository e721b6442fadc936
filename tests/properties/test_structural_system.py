"""The structural system against a brute-force oracle that shares no code with the solver.

The oracle lists every tuple of joint mobilities and every multiset of link degrees in a small box and keeps those
that satisfy the eight equations and the natural bounds.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement, product

import pytest
from hypothesis import example, given, settings, strategies as st

from graphsynth import StructuralSpec
from graphsynth.core.errors import InfeasibleSpecError, SpecError

MOST_LINKS, MOST_JOINTS = 5, 8
PLAIN = ("W", "Pi", "n", "p", "v", "v_ct", "v_P", "t0", "G")
KINDS = tuple(f"n{a}" for a in range(2, 7))
FREEDOMS = ("p1", "p2", "p3")


@cache
def box(space: int, fractionated: bool) -> tuple[dict[str, int], ...]:
    """All solutions with n <= 5, p <= 8 for one space, in no particular order."""
    found = []
    for freedoms in product(range(MOST_JOINTS + 1), repeat=space - 1):
        p = sum(freedoms)
        if not 1 <= p <= MOST_JOINTS:
            continue
        G = sum(i * number for i, number in enumerate(freedoms, start=1))
        for n in range(1, min(p, MOST_LINKS + 1)):
            v = p - n
            W = G - v * space
            freedom = max(1, W) if fractionated else 1
            for degrees in combinations_with_replacement(range(2, v + freedom + 1), n):
                t0 = 2 * p - sum(degrees)
                for c in range(1, min(freedom, n, max(t0, 0)) + 1):
                    v_ct = t0 - c
                    if t0 < 2 or not 0 <= v_ct <= v:
                        continue
                    totals = {
                        "W": W,
                        "Pi": space,
                        "n": n,
                        "p": p,
                        "v": v,
                        "v_ct": v_ct,
                        "v_P": v - v_ct,
                        "t0": t0,
                        "G": G,
                    }
                    totals |= {f"p{i}": (*freedoms, 0, 0, 0, 0)[i - 1] for i in range(1, 6)}
                    totals |= {f"n{a}": degrees.count(a) for a in range(2, 20)}
                    found.append({**totals, "c": c})
    return tuple(found)


def key(values: dict[str, int]) -> tuple[int, ...]:
    head = [values[symbol] for symbol in ("W", "Pi", "n", "p", "p1", "p2", "p3", "p4", "p5", "t0", "v_ct")]
    return (*head, *(values[f"n{a}"] for a in range(2, 20)))


def flat(solution) -> dict[str, int]:
    values = {symbol: getattr(solution, symbol) for symbol in PLAIN}
    values |= {f"p{i}": getattr(solution, f"p{i}") for i in range(1, 6)}
    values |= {f"n{a}": getattr(solution, f"n{a}") for a in range(2, 20)}
    return {**values, "c": solution.frame_parts}


def within(value: int, bound) -> bool:
    lo, hi = bound if isinstance(bound, tuple) else (bound, bound)
    return (lo is None or lo <= value) and (hi is None or value <= hi)


def oracle(question: dict, spaces, fractionated: bool, most_mobility: int, most_joints: int) -> list[dict[str, int]]:
    kept = [
        values
        for space in spaces
        for values in box(space, fractionated)
        if all(values[f"p{i}"] == 0 for i in range(most_mobility + 1, 6))
        and all(values[f"n{a}"] == 0 for a in range(most_joints + 1, 20))
        and all(within(values[symbol], bound) for symbol, bound in question.items())
    ]
    return sorted(kept, key=key)


@st.composite
def questions(draw):
    """A random subset of the variables, fixed or bounded, near a random solution or at random."""
    fractionated = draw(st.booleans())
    space = draw(st.sampled_from((2, 3, 3, 4)))
    near = draw(st.sampled_from(box(space, fractionated)))
    honest = draw(st.booleans())
    question: dict = {}
    for symbol in draw(st.sets(st.sampled_from((*PLAIN, *KINDS, *FREEDOMS)), max_size=8)):
        if symbol == "Pi":
            continue
        value = near[symbol] if honest or draw(st.booleans()) else draw(st.integers(0, 9))
        least = 1 if symbol in ("n", "p", "t0") else -30 if symbol == "W" else 0
        value = max(value, least)
        kind = draw(st.sampled_from(("fixed", "pair", "least", "most")))
        lo = max(least, value - draw(st.integers(0, 2)))
        hi = value + draw(st.integers(0, 2))
        question[symbol] = {"fixed": value, "pair": (lo, hi), "least": (lo, None), "most": (None, hi)}[kind]
    spaces = draw(st.sampled_from(((space,), (2, 3), (2, 3, 4))))
    # The oracle's box: n and p are always bounded.
    for symbol, most in (("n", MOST_LINKS), ("p", MOST_JOINTS)):
        bound = question.get(symbol, (None, None))
        lo, hi = bound if isinstance(bound, tuple) else (bound, bound)
        hi = most if hi is None else min(hi, most)
        lo = None if lo is None else min(lo, hi)
        question[symbol] = (lo, hi)
    options = {
        "fractionated": fractionated,
        "max_joint_mobility": draw(st.integers(1, 3)),
        "max_link_joints": draw(st.sampled_from(("all", 2, 3, 4))),
    }
    return question, spaces, options


def answer(question, spaces, options):
    whole = {**question, "Pi": (spaces[0], spaces[-1])}
    return StructuralSpec(**whole, **options).solve()


def expected(question, spaces, options):
    most_joints = 19 if options["max_link_joints"] == "all" else options["max_link_joints"]
    return oracle(question, spaces, options["fractionated"], options["max_joint_mobility"], most_joints)


@pytest.mark.parametrize("examples", [20, pytest.param(1500, marks=pytest.mark.long)])
def test_all_solutions_and_no_others_in_the_stated_order(examples):
    settings(max_examples=examples, deadline=None)(given(questions())(compare))()


def compare(case):
    question, spaces, options = case
    wanted = expected(question, spaces, options)
    try:
        found = answer(question, spaces, options)
    except InfeasibleSpecError:
        assert wanted == []
        return
    assert [key(flat(solution)) for solution in found] == [key(values) for values in wanted]
    assert [solution.frame_parts for solution in found] == [values["c"] for values in wanted]
    for solution in found:
        solution.check()


def check_eight_equations(s) -> None:
    freedoms = list(enumerate(s.p_i, start=1))
    assert s.G - s.v * s.Pi == s.W
    assert s.p == sum(number for _, number in freedoms)
    assert s.v == s.p - s.n
    assert s.n == sum(s.n_a.values())
    assert s.v == s.v_ct + s.v_P
    assert s.t0 == s.v_ct + 1
    assert 2 * s.p == s.t0 + sum(a * number for a, number in s.n_a.items())
    assert sum(i * number for i, number in freedoms) == s.G


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 4), st.integers(3, 12), st.integers(2, 6), st.integers(1, 3))
def test_every_solution_satisfies_the_eight_equations(mobility, moving, space, most):
    spec = StructuralSpec(W=mobility, n=moving, Pi=space, max_joint_mobility=min(most, 2), v=(1, 5))
    try:
        solutions = list(spec.iter_solutions())
    except InfeasibleSpecError:
        return
    for solution in solutions:
        check_eight_equations(solution)


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(questions())
def test_a_contradiction_is_true_and_speaks_only_of_what_was_said(case):
    question, spaces, options = case
    if expected(question, spaces, options):
        return
    with pytest.raises(InfeasibleSpecError) as caught:
        answer(question, spaces, options)
    clashes = set(caught.value.clashes)
    named = {symbol: bound for symbol, bound in question.items() if any(c.startswith(f"{symbol} = ") for c in clashes)}
    most = options["max_joint_mobility"] if any(c.startswith("joints of mobility") for c in clashes) else 5
    limit = options["max_link_joints"] if any(c.startswith("at most") for c in clashes) else 19
    spoken = spaces if any(c.startswith("Pi = ") for c in clashes) else (2, 3, 4)
    # The named values alone leave the oracle's box empty.
    assert oracle(named, spoken, options["fractionated"], most, 19 if limit == "all" else limit) == []


def has_solution(spec):
    try:
        return any(True for _ in spec.iter_solutions())
    except InfeasibleSpecError:
        return False


@pytest.mark.long
@settings(max_examples=10, deadline=None)
@example({"t0": 2, "n3": 1}, 1, 4)  # 2p = t0 + sum a*n_a is odd on the right
@given(
    st.dictionaries(st.sampled_from(("n2", "n3", "n4", "t0", "v_P")), st.integers(0, 4), min_size=1),
    st.integers(1, 3),
    st.sampled_from(("all", 3, 4)),
)
def test_a_question_is_called_open_exactly_when_its_answers_never_end(question, mobility, most):
    """Small links counts are fixed, the size is not: 3n - 2p = W bounds it or leaves it open."""
    spec = StructuralSpec(W=mobility, **question, max_link_joints=most) if question.get("t0", 2) else None
    if spec is None:
        return
    try:
        found = spec.solve()
    except InfeasibleSpecError:
        found = []
    except SpecError as error:
        assert "bound n" in str(error)
        # open in rational numbers; whole numbers may still have no solution of any size, by parity
        assert has_solution(spec.replace(n=(25, 30))) or not has_solution(spec.replace(n=(1, 31)))
        return
    try:
        assert spec.replace(n=(1, 31)).solve() == found
    except InfeasibleSpecError:
        assert found == []


@settings(max_examples=100, deadline=None)
@given(questions())
def test_text_forms_give_the_question_back(case):
    import tomllib

    question, spaces, options = case
    spec = StructuralSpec(**question, Pi=(spaces[0], spaces[-1]), **options)
    assert StructuralSpec.from_mapping(tomllib.loads(spec.to_toml())) == spec
    lines = [line for line in spec.to_toml().replace('"', "").splitlines() if line]
    ranged = [line.replace("[", "").replace("]", "").replace(", ", "..") for line in lines]
    assert StructuralSpec.from_assignments(ranged) == spec


@settings(max_examples=300, deadline=None)
@given(
    st.dictionaries(
        st.one_of(st.sampled_from(("W", "n", "links", "p2", "n3", "levels", "p_i")), st.text(max_size=6)),
        st.one_of(
            st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8),
            st.lists(st.integers(), max_size=3),
            st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
        ),
        max_size=4,
    )
)  # fmt: skip
def test_any_mapping_gives_a_question_or_one_sentence(mapping):
    from graphsynth.core.errors import FormatError

    try:
        spec = StructuralSpec.from_mapping(mapping, "file.toml")
    except FormatError as error:
        assert str(error).startswith("file.toml")
        assert "\n" not in str(error)
    else:
        assert StructuralSpec(**spec.as_dict()) == spec
