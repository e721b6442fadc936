"""The same bytes whoever does the work: threads, processes, a dask cluster, shards, a resumed run."""

from __future__ import annotations

import hashlib
import random
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import pytest

from graphsynth import StructuralSpec, count_chains, count_mechanisms, enumerate_chains, enumerate_mechanisms
from graphsynth.cli import main
from graphsynth.core.errors import GraphsynthError, SpecError
from graphsynth.core.ordered import AHEAD, in_order
from graphsynth.synthesis import problem as parallel
from graphsynth.synthesis.problem import EnumerationProblem
from graphsynth.synthesis.shards import shard_of
from graphsynth.synthesis.writing import count_with_checkpoint, write_listing

QUESTION = StructuralSpec(W=1, links=10)
LONG = EnumerationProblem.mechanisms(StructuralSpec(W=1, links=12), None)  # 75397 lines


def digest(executor):
    """Digest everything an executor is asked for: two listings as graphs, one as text, two counts."""
    sha = hashlib.sha256()
    for graph in enumerate_mechanisms(QUESTION, executor=executor):
        sha.update(f"{graph.to_text()}\n".encode())
    for graph in enumerate_chains(9, 2, fractionated=True, executor=executor):
        sha.update(f"{graph.to_text()}\n".encode())
    for data, _ in parallel.texts(LONG.work_items(listing=True), executor):
        sha.update(data)
    sha.update(f"{count_chains(12, executor=executor)} {count_mechanisms(QUESTION, executor=executor)}".encode())
    return sha.hexdigest()


@pytest.fixture(scope="module")
def alone():
    return digest(None)


def test_there_is_something_to_share():
    assert len(LONG.work_items(listing=True)) >= 14


@pytest.mark.long
@pytest.mark.parametrize("workers", [1, 2, 7])
def test_threads(alone, workers):
    with ThreadPoolExecutor(workers) as executor:
        assert digest(executor) == alone


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2, pytest.param(7, marks=pytest.mark.slow)])
def test_processes(alone, workers):
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
        assert digest(executor) == alone


@pytest.mark.long
def test_the_pool_of_the_command_line(alone):
    with parallel.processes(2) as executor:
        assert isinstance(executor, Executor)
        assert digest(executor) == alone
    with parallel.processes(1) as executor:
        assert executor is None


@pytest.mark.slow
def test_dask_cluster(alone):
    import distributed

    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster) as client, client.get_executor() as executor:
        assert digest(executor) == alone


class Shuffled(Executor):
    """Finishes what it is given late and in a random order."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.pool = ThreadPoolExecutor(7)
        self.most = self.under_way = 0

    def submit(self, function, /, *arguments, **options):
        self.under_way += 1
        self.most = max(self.most, self.under_way)
        future = Future()
        wait = self.random.uniform(0, 0.003)

        def work():
            time.sleep(wait)
            future.set_result(function(*arguments, **options))

        self.pool.submit(work)
        future.add_done_callback(lambda _: setattr(self, "under_way", self.under_way - 1))
        return future


def test_order_and_memory_do_not_depend_on_who_is_first():
    executor = Shuffled(1)
    asked = []

    def pieces():
        for i in range(200):
            asked.append(i)
            yield i

    results = in_order(executor, lambda i: i * i, pieces())
    for i, result in enumerate(results):
        assert result == i * i
        assert len(asked) <= i + AHEAD + 1  # no piece is asked for long before it can be read
    assert i == 199
    executor.pool.shutdown()


def test_stopping_early_cancels_the_rest():
    with ThreadPoolExecutor(1) as executor:
        results = in_order(executor, lambda i: time.sleep(0.01) or i, iter(range(10**9)))
        assert next(results) == 0
        results.close()


# --- shards and resumed runs ------------------------------------------------------------------------------------------


def read(path):
    return path.read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("shards", [1, 3, 8])
def test_shard_files_one_after_the_other_are_the_whole_file(tmp_path, shards):
    whole = tmp_path / "whole.txt"
    lines = write_listing(LONG, whole)
    parts = [tmp_path / f"{i}.txt" for i in range(1, shards + 1)]
    counts = [write_listing(LONG, path, shard=(i, shards)) for i, path in enumerate(parts, 1)]
    assert sum(counts) == lines == 75397
    assert b"".join(map(read, parts)) == read(whole)
    assert sum(count_with_checkpoint(LONG, shard=(i, shards)) for i in range(1, shards + 1)) == lines
    if shards > 1:
        assert max(counts) < 0.8 * lines  # a shard is a share of the work


@pytest.mark.parametrize("shard", [(0, 2), (3, 2), (1, 0), (-1, 2)])
def test_shards_out_of_bounds(shard):
    with pytest.raises(SpecError, match=f"{shard[0]}/{shard[1]}"):
        shard_of(LONG.work_items(listing=True), shard)


class Interrupted(Exception):
    pass


def test_a_complete_listing_is_kept_unless_it_is_to_be_replaced(tmp_path):
    problem, path = EnumerationProblem.chains(8, 1, 3, None, False, None), tmp_path / "listing.txt"
    lines = write_listing(problem, path)
    whole = read(path)
    with pytest.raises(GraphsynthError, match="exists: name another file, or replace it with --force"):
        write_listing(problem, path)
    assert write_listing(problem, path, resume=True) == lines and read(path) == whole  # nothing is left to do
    path.write_bytes(b"something else")
    assert write_listing(problem, path, overwrite=True) == lines and read(path) == whole


@pytest.mark.parametrize("stop", [1, 5, 11])
@pytest.mark.parametrize("junk", [b"", b"half a li"])
def test_a_resumed_listing_is_the_same_to_the_byte(tmp_path, stop, junk):
    whole, path = tmp_path / "whole.txt", tmp_path / "listing.txt"
    write_listing(LONG, whole)
    steps = []

    def interrupt(step):
        steps.append(step)
        if len(steps) == stop:
            raise Interrupted

    with pytest.raises(Interrupted):
        write_listing(LONG, path, watch=interrupt)
    assert read(whole).startswith(read(path))  # what is there is whole lines of the result
    assert read(path).endswith(b"\n") and len(read(path)) < len(read(whole))
    with path.open("ab") as file:
        file.write(junk)  # written, but not yet recorded as done
    with pytest.raises(GraphsynthError, match="--resume"):
        write_listing(LONG, path)
    with pytest.raises(GraphsynthError, match="another question"):
        write_listing(EnumerationProblem.chains(10, 1, 3, None, False, None), path, resume=True)
    assert write_listing(LONG, path, resume=True) == 75397
    assert read(path) == read(whole)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["listing.txt", "whole.txt"]


def test_progress_grows_to_one(tmp_path):
    steps = []
    write_listing(LONG, tmp_path / "listing.txt", watch=steps.append)
    shares = [step.done for step in steps]
    assert shares == sorted(shares) and shares[-1] == pytest.approx(1.0)
    assert steps[-1].graphs == 75397


@pytest.mark.parametrize("keep", [0, 1, 3])
def test_a_count_goes_on_from_its_checkpoint(tmp_path, keep):
    problem = EnumerationProblem.chains(14, 1, 3, None, False, None)
    path = tmp_path / "count.txt"
    assert count_with_checkpoint(problem, checkpoint=path) == 318162
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: 1 + keep]) + lines[1 + keep][:1].rstrip("\n"))  # the last line cut short
    assert count_with_checkpoint(problem, checkpoint=path) == 318162
    assert path.read_text().splitlines() == [line.rstrip("\n") for line in lines]
    with pytest.raises(GraphsynthError, match="another question"):
        count_with_checkpoint(LONG, checkpoint=path)


def test_the_command_line_shards_and_resumes(tmp_path, capsys):
    whole = tmp_path / "whole.g6"
    assert main(["enumerate", "--links", "10", "-o", str(whole)]) == 0
    parts = [tmp_path / f"{i}.g6" for i in (1, 2, 3)]
    for i, path in enumerate(parts, 1):
        assert main(["enumerate", "--links", "10", "--shard", f"{i}/3", "-o", str(path)]) == 0
    assert b"".join(map(read, parts)) == read(whole)
    capsys.readouterr()
    counts = []
    for i in (1, 2, 3):
        assert main(["count", "--links", "10", "--shard", f"{i}/3"]) == 0
        counts.append(int(capsys.readouterr().out.splitlines()[-1]))
    assert sum(counts) == 230
    assert main(["count", "--links", "12"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "6856"
