"""How fast the enumerator is; ``docs/explanation/speed.md`` says how to run this and what was measured.

Run by the normal suite once each, without timing; with times:
``pytest tests/bench --benchmark-enable -n 0`` (add ``-m ""`` for the slow ones).
No time is asserted: machines differ.  Every benchmark checks its result.
"""

from __future__ import annotations

import shutil
import subprocess
import time
from pathlib import Path

import pytest

from graphsynth import StructuralSpec, count_chains, count_mechanisms, enumerate_chains
from graphsynth.synthesis.problem import EnumerationProblem
from graphsynth.synthesis.writing import write_listing

FILTER = Path(__file__).with_name("sparse_filter.c")
FIGURE_3 = StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7, n2=6, n3=7, n4=1)
N4 = StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7, n4=4)


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory):
    """Compile, or load from the cache, everything that is timed."""
    count_chains(8)
    count_mechanisms(StructuralSpec(W=1, links=8))
    write_listing(EnumerationProblem.chains(8, 1, 3, None, False, None), tmp_path_factory.mktemp("warm") / "chains.g6")


def repeat(benchmark, function, rounds=5):
    return benchmark.pedantic(function, rounds=rounds, warmup_rounds=0)


@pytest.fixture
def fresh(tmp_path):
    """Return a function that names a new file each time."""
    numbers = iter(range(10**6))
    return lambda: tmp_path / f"{next(numbers)}.g6"


def listing(links, path):
    """List chains to a file, as ``graphsynth enumerate --links N -o FILE`` does."""
    return write_listing(EnumerationProblem.chains(links, 1, 3, None, False, None), path)


@pytest.mark.parametrize(("links", "count"), [(12, 6856), (14, 318162), (16, 19819281)])
def test_count_chains(benchmark, links, count):
    assert repeat(benchmark, lambda: count_chains(links)) == count


@pytest.mark.parametrize(
    ("links", "count"), [(12, 6856), (14, 318162), pytest.param(16, 19819281, marks=pytest.mark.slow)]
)
def test_list_chains_to_disk(benchmark, fresh, links, count):
    assert repeat(benchmark, lambda: listing(links, fresh()), rounds=1 if links == 16 else 5) == count


@pytest.mark.long
@pytest.mark.parametrize(("links", "count"), [(12, 6856), (14, 318162)])
def test_list_chains_as_graphs(benchmark, links, count):
    assert repeat(benchmark, lambda: sum(1 for _ in enumerate_chains(links))) == count


def test_list_mechanisms_to_disk(benchmark, fresh):
    problem = EnumerationProblem.mechanisms(StructuralSpec(W=1, links=12), None)
    assert repeat(benchmark, lambda: write_listing(problem, fresh())) == 75397


def test_count_mechanisms(benchmark):
    spec = StructuralSpec(W=1, links=12)
    assert repeat(benchmark, lambda: count_mechanisms(spec)) == 75397


@pytest.mark.parametrize(("spec", "count"), [(N4, 9663907), (FIGURE_3, 187985407)], ids=["9-1-4", "6-7-1"])
def test_count_worked_example(benchmark, spec, count):
    assert repeat(benchmark, lambda: count_mechanisms(spec)) == count


@pytest.mark.slow
def test_count_eighteen_links(benchmark):
    assert repeat(benchmark, lambda: count_chains(18), rounds=1) == 1535380884


# --- against geng -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def baseline(tmp_path_factory):
    """Return a function that lists chains to a file with nauty's geng and a pebble game in C."""
    geng = shutil.which("nauty-geng") or shutil.which("geng")
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if geng is None or compiler is None:
        pytest.skip("needs nauty's geng and a C compiler")
    program = tmp_path_factory.mktemp("baseline") / "sparse_filter"
    subprocess.run([compiler, "-O3", "-o", str(program), str(FILTER)], check=True)

    def run(links, output):
        joints = (3 * links - 4) // 2
        generate = [geng, "-qCt", str(links), f"{joints}:{joints}"]  # a 1-DOF chain is 2-connected, without triangles
        keep = [str(program), *([] if output else ["-u"])]
        with subprocess.Popen(generate, stdout=subprocess.PIPE) as graphs:
            done = subprocess.run(keep, stdin=graphs.stdout, capture_output=True, check=True)
        if output:
            output.write_bytes(done.stdout)
            return done.stdout.count(b"\n")
        return int(done.stdout)

    return run


def best(function, times=3):
    """Return the shortest time of a few runs, in seconds, and the last result."""
    seconds = []
    for _ in range(times):
        start = time.perf_counter()
        result = function()
        seconds.append(time.perf_counter() - start)
    return min(seconds), result


@pytest.mark.long
@pytest.mark.parametrize(("links", "count"), [(12, 6856), (14, 318162)])
def test_ratio_to_geng(capsys, baseline, fresh, links, count):
    """Print how many times faster than geng with a C filter; geng and the filter have a core each."""
    rows = [
        ("counted", lambda: count_chains(links), lambda: baseline(links, None)),
        ("listed to a file", lambda: listing(links, fresh()), lambda: baseline(links, fresh())),
    ]
    for what, ours, theirs in rows:
        our_time, our_count = best(ours)
        their_time, their_count = best(theirs, 1 if links >= 14 else 3)
        assert our_count == their_count == count
        with capsys.disabled():
            print(
                f"\n{links} links {what}: graphsynth {our_time:.3f} s, geng + C filter {their_time:.3f} s, "
                f"ratio {their_time / our_time:.1f}"
            )
