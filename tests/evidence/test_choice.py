"""Sentences, fronts and knees follow from the rows alone."""

import math

from hypothesis import given, strategies as st

from graphsynth.evidence import Problem, Row, RowStatus, advice, front, knee, knees
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.enumeration import growth


def row(method, error, seconds, setting="", **more):
    return Row(method, setting, error, seconds, 3, "distance", "exact", **more)


errors = st.floats(1e-15, 1e3)
times = st.floats(1e-7, 1e2)
rows = st.lists(st.builds(row, st.sampled_from("abc"), errors, times), max_size=12)


@given(rows)
def test_nothing_beats_the_front_and_everything_else_is_beaten(given):
    best = front(given)
    assert [r.seconds for r in best] == sorted(r.seconds for r in best)
    for r in given:
        if r in best:
            assert not any(o.seconds < r.seconds and o.error < 0.5 * r.error for o in given)
        else:  # something not slower is as good, up to the factor within which errors are luck
            assert any(o.seconds <= r.seconds and o.error <= 2.0 * r.error for o in best)


@given(rows)
def test_failures_are_on_no_front(given):
    lost = [row("lost", 0.0, 1e-9, status=RowStatus.FAILED, reason="no"), row("nan", math.nan, 1e-9)]
    assert front([*lost, *given]) == front(given)


@given(rows.filter(bool))
def test_every_method_gets_one_sentence_that_names_it(given):
    problem = Problem("p", "q", "mm", tuple(given))
    said = advice(problem)
    assert list(said) == list(dict.fromkeys(r.method for r in given))
    assert all(text.startswith(f"{method}: ") and text.endswith(".") for method, text in said.items())


@given(rows.filter(bool))
def test_for_every_wanted_error_exactly_one_method_is_the_choice(given):
    # the fastest row that reaches an error of the front is the row of the front itself
    best = front(given)
    for wanted in best:
        reach = [r for r in given if r.error <= wanted.error]
        assert min(r.seconds for r in reach) == wanted.seconds


def test_sentences_of_a_small_table():
    table = (
        row("polygon", 1e-2, 1e-5, "16 corners"), row("polygon", 1e-4, 1e-3, "160 corners"),
        row("closed form", 1e-15, 1e-4),
        row("sweep", 1e-3, 1e-2, "coarse", proved=True), row("sweep", 1e-6, 1e-1, "fine", proved=True),
        row("sweep", math.nan, 1.0, "finest", proved=True, status=RowStatus.FAILED, reason="out of boxes"),
        row("guess", math.nan, 1.0, "any", status=RowStatus.FAILED, reason="it never converges"),
        row("slow", 1e-10, 1.0, "x"),
    )  # fmt: skip
    said = advice(Problem("p", "q", "mm", table))
    assert said["polygon"] == (
        "polygon: fastest for errors down to 0.01 mm (16 corners, 10 µs); for smaller errors closed form is faster; "
        "measured at 2 settings only."
    )
    assert said["closed form"].startswith("closed form: fastest for errors from 0.01 mm down to 1e-15 mm (100 µs)")
    assert said["closed form"].endswith("; it has no setting.")
    assert said["sweep"].startswith("sweep: fastest with a proof, for errors down to 1e-06 mm (fine, 100 ms)")
    assert said["sweep"].endswith("; 1 of 3 settings failed or gave a wrong result (finest).")
    assert said["guess"] == (
        "guess: not usable here, no setting gave a reliable result (it never converges); measured at 1 setting only."
    )
    assert "closed form is better: 1e-15 mm in 100 µs, 10000 times faster" in said["slow"]


def test_an_unreliable_result_is_never_recommended():
    table = (row("a", 1e-12, 1e-6, "wrong", status=RowStatus.UNRELIABLE, reason="no"), row("b", 1e-3, 1e-1, "slow"))
    said = advice(Problem("p", "q", "mm", table))
    assert said["a"].startswith("a: not usable here")
    assert said["b"].startswith("b: fastest for errors down to 0.001 mm")


def test_the_knee_of_a_method_of_first_order_is_its_first_setting():
    assert knee([row("a", 10.0**-k, 10.0**k, str(k)) for k in range(5)]).setting == "0"


def test_the_knee_of_a_method_of_high_order_is_where_rounding_begins():
    given = [row("a", 10.0 ** (-2 * k), 1.3**k, str(k)) for k in range(6)] + [row("a", 5e-11, 9.0, "floor")]
    assert knee(given).setting == "5"


def test_one_slow_run_does_not_end_the_search_for_the_knee():
    times = (1.0, 9.0, 9.5, 10.0, 40.0)
    given = [row("a", 10.0 ** (-3 * k), t, str(k)) for k, t in enumerate(times[:4])] + [row("a", 1e-10, 40.0, "slow")]
    assert knee(given).setting == "3"


def test_defaults_are_compared_with_the_knee():
    def verdict(name):
        errors, times = (1e-2, 1e-4, 1e-6, 1e-7), (1.0, 1.5, 2.0, 40.0)
        given = tuple(row("a", e, t, n, default=n == name) for e, t, n in zip(errors, times, "wxyz"))
        return knees(Problem("p", "q", "mm", given))[0]

    assert [verdict(name).verdict for name in "wxyz-"] == ["coarser", "coarser", "at the knee", "finer", "no default"]
    assert verdict("z").sentence == (
        "a: the default z (1.0e-07 in 40 s) is finer than the knee; the knee is y (1.0e-06 in 2 s)"
    )


def test_a_default_that_costs_time_and_gains_nothing():
    given = (
        row("a", 1e-2, 1.0, "x"),
        row("a", 1e-4, 1.5, "y"),
        row("a", 1e-6, 2.0, "z"),
        row("a", 1e-3, 9.0, "w", default=True),
    )
    found = knees(Problem("p", "q", "mm", given))[0]
    assert found.verdict == "slower, no gain"
    assert found.sentence == (
        "a: the default w (1.0e-03 in 9 s) is slower than the knee and gains nothing; the knee is z (1.0e-06 in 2 s)"
    )


def test_a_failed_default_is_said():
    given = (*(row("a", 10.0**-k, 1.2**k, str(k)) for k in range(3)),
             row("a", math.nan, 1.0, "own", default=True, status=RowStatus.FAILED, reason="no"))  # fmt: skip
    assert knees(Problem("p", "q", "mm", given))[0].verdict == "failed"


@given(st.floats(0.2, 3.0), st.floats(1e-9, 1e-3))
def test_growth_finds_a_power_law(exponent, factor):
    graphs = [100.0, 1e3, 1e5, 1e6]
    law = growth(graphs, [factor * n**exponent for n in graphs])
    assert math.isclose(law.exponent, exponent, rel_tol=1e-9)
    assert math.isclose(law.seconds(1e8), factor * 1e8**exponent, rel_tol=1e-6)
    assert law.spread < 1.0 + 1e-9


def test_growth_needs_two_large_runs():
    assert growth([2, 16, 230], [1.0, 1.0, 1.0]) is None


def test_times_are_written_with_two_digits():
    assert [seconds_text(t) for t in (5.42e-4, 0.0123, 61.0, math.nan, 2e-8)] == [
        "540 µs",
        "12 ms",
        "61 s",
        "no time",
        "20 ns",
    ]


@given(rows.filter(bool))
def test_fewer_than_three_settings_are_said(given):
    problem = Problem("p", "q", "mm", tuple(given))
    for method, text in advice(problem).items():
        few = "it has no setting" in text or "only" in text
        assert few == (len(problem.of(method)) < 3)
