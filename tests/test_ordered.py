"""Work in order with the help of others: a crew of this process and some more."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing import get_context, parent_process
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import GraphsynthError, SpecError
from graphsynth.core.ordered import AHEAD, RETRIES, Crew, in_order, processes


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


def _killed(marks, i):
    """Work whose process is killed the first ``marks`` times it gets to a multiple of five."""
    folder, times = marks
    if parent_process() is not None and i % 5 == 0:
        for attempt in range(times):
            with suppress(FileExistsError):
                (Path(folder) / f"{i}-{attempt}").touch(exist_ok=False)
                os.kill(os.getpid(), signal.SIGKILL)
    return i * i


def test_a_killed_worker_is_replaced_and_its_piece_done_again(tmp_path):
    with processes(2) as crew:
        crew.submit(int).result()
        found = list(in_order(crew, partial(_killed, (tmp_path, 1)), range(1, 17)))
    assert found == [i * i for i in range(1, 17)]
    assert crew.submit(int).exception() is not None  # it is closed


@pytest.mark.long
def test_work_that_kills_every_worker_is_one_sentence(tmp_path):
    with processes(2) as crew, pytest.raises(GraphsynthError, match="killed while they worked, again and again"):
        crew.submit(_killed, (tmp_path, 100), 5).result()
    assert len(list(tmp_path.iterdir())) == 1 + RETRIES


def test_the_broken_pool_of_a_caller_is_one_sentence(tmp_path):
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool,
        pytest.raises(GraphsynthError, match="killed while they worked"),
    ):
        list(in_order(pool, partial(_killed, (tmp_path, 1)), [5, 6]))


@pytest.mark.parametrize("wrong", [4, "processes", True])
def test_what_is_no_executor_is_refused(wrong):
    with pytest.raises(SpecError, match=f"executor = {wrong!r} must be a concurrent.futures.Executor"):
        in_order(wrong, abs, [1])


PARENT = """
import os, sys, time
from graphsynth.core.ordered import processes
from tests_busy import busy
if __name__ == "__main__":
    with processes(3) as crew:
        for _ in range(2):
            crew.submit(busy, sys.argv[1])
        time.sleep(60)
"""
BUSY = """
import ctypes, os, pathlib
def busy(folder):
    (pathlib.Path(folder) / f"pid{os.getpid()}").touch()
    ctypes.PyDLL(None).sleep(60)  # compiled code that keeps every other thread from running
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a worker ends when its compiled code returns")
def test_no_worker_outlives_its_parent(tmp_path):
    (tmp_path / "tests_busy.py").write_text(BUSY)
    (tmp_path / "parent.py").write_text(PARENT)
    parent = subprocess.Popen([sys.executable, tmp_path / "parent.py", tmp_path])
    end = time.monotonic() + 30
    while len(workers := [int(path.name[3:]) for path in tmp_path.glob("pid*")]) < 2:
        assert parent.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    parent.kill()
    parent.wait()
    end = time.monotonic() + 2
    while any(_runs(pid) for pid in workers):
        assert time.monotonic() < end
        time.sleep(0.01)


def _runs(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_a_script_without_a_guard_is_told_to_have_one(tmp_path):
    script = tmp_path / "mine.py"
    lines = ["from graphsynth.core.ordered import in_order, processes", "with processes(2) as crew:"]
    script.write_text("\n".join([*lines, "    list(in_order(crew, abs, range(40)))"]), "utf-8")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "came to the line that starts workers" in done.stderr  # the worker
    assert done.stderr.splitlines()[-1].endswith("has to stand below 'if __name__ == \"__main__\":'")  # this process
