"""Work in order with the help of others: a crew of this process and some more."""

import os
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from graphsynth.ordered import AHEAD, Crew, in_order, processes


class Held(Executor):
    """Does what it is given only when told to."""

    def __init__(self):
        self.work = []

    def submit(self, function, /, *arguments, **named):
        future = Future()
        self.work.append((future, function, arguments))
        return future

    def do(self, count):
        for future, function, arguments in self.work[:count]:
            if future.set_running_or_notify_cancel():
                future.set_result(function(*arguments))
        del self.work[:count]


def test_while_the_others_are_busy_this_process_works_ahead_but_not_too_far():
    others, done_here, asked = Held(), [], []
    crew = Crew(others, 1)

    def square(i):
        done_here.append(i)
        if len(done_here) == AHEAD - crew.most:  # nothing more may be begun: now the others must come
            others.do(crew.most)
        return i * i

    results = in_order(crew, square, (asked.append(i) or i for i in range(1000)))
    assert next(results) == 0
    assert asked == list(range(AHEAD))
    assert done_here == [*range(crew.most, AHEAD), *range(crew.most)]
    results.close()
    assert all(future.cancelled() for future, *_ in others.work)


@given(hands=st.integers(1, 4), pieces=st.integers(0, 60), slow=st.integers(0, 3))
def test_the_order_is_that_of_the_pieces(hands, pieces, slow):
    with ThreadPoolExecutor(hands) as others:
        work = in_order(Crew(others, hands), lambda i: time.sleep(1e-4 * (i % (slow + 1))) or -i, range(pieces))
        assert list(work) == [-i for i in range(pieces)]


@pytest.mark.parametrize("bad", [0, 5, 11])
def test_an_error_is_raised_in_its_turn_whoever_met_it(bad):
    def work(i):
        if i == bad:
            raise ValueError(i)
        return i

    with ThreadPoolExecutor(1) as others:
        results = in_order(Crew(others, 1), work, range(12))
        assert [next(results) for _ in range(bad)] == list(range(bad))
        with pytest.raises(ValueError, match=str(bad)):
            next(results)


def _where(_):
    time.sleep(0.02)
    return os.getpid()


def test_a_crew_of_two_is_this_process_and_another():
    with processes(2) as crew:
        crew.submit(_where, 0).result()  # it has started
        found = list(in_order(crew, _where, range(30)))
    assert os.getpid() in found
    assert len(set(found)) == 2
