"""Mechanisms with higher pairs against a C program: multigraphs of nauty, Burnside's lemma, every labelling listed."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from pathlib import Path

import nauty
import pytest

from graphsynth import StructuralSpec, count_mechanisms

SOURCE = Path(__file__).with_name("burnside.c")


@pytest.fixture(scope="module")
def burnside(tmp_path_factory):
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("needs a C compiler")
    program = tmp_path_factory.mktemp("burnside") / "burnside"
    subprocess.run([compiler, "-O3", "-o", str(program), str(SOURCE)], check=True)

    def count(solution):
        """Count the mechanisms of one solution whose frame has a degree of its own, at least 3."""
        degrees = [solution.t0, *(a for a, n in solution.n_a.items() if a >= 3 for _ in range(n))]
        lines = multigraphs(len(degrees), solution.v + len(degrees) - 1, max(degrees))
        words = [str(solution.n_a.get(2, 0)), str(solution.p_i[1]), *map(str, degrees)]
        done = subprocess.run(
            [str(program), *words], input="\n".join(lines), capture_output=True, text=True, check=True
        )
        return int(done.stdout.split()[1])

    return count


@cache
def multigraphs(vertices, edges, widest):
    if vertices == 2:
        return (f"2 1 0 1 {edges}",)
    simple = nauty.run("geng", "-C", f"-D{widest}", str(vertices), f"{vertices}:{edges}")
    return tuple(nauty.run("multig", f"-e{edges}", f"-D{widest}", "-T", data=simple))


@pytest.mark.parametrize(
    "question",
    [
        {"links": 8, "t0": (3, 9)},
        {"links": 10, "t0": (4, 9)},
        {"links": 6, "p2": 2, "t0": (3, 9)},
        {"links": 7, "p2": 3, "t0": (3, 9)},
        {"links": 8, "p2": 2, "t0": (3, 9)},
        {"links": 9, "p2": 1, "t0": (4, 9)},
    ],
    ids=str,
)
def test_small_assortments(burnside, question):
    solutions = [s for s in StructuralSpec(W=1, **question).solve() if s.t0 >= 3 and not s.n_a.get(s.t0, 0)]
    counts = {s: count_mechanisms(s) for s in solutions}
    assert any(counts.values())
    assert counts == {s: burnside(s) for s in solutions}


@pytest.mark.parametrize(
    ("numbers", "count"),
    [
        ({"n2": 9, "n3": 1, "n4": 4}, 9663907),
        pytest.param({"n2": 6, "n3": 7, "n4": 1}, 187985407, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_worked_example(burnside, numbers, count):
    (solution,) = StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7, **numbers).solve()
    assert burnside(solution) == count_mechanisms(solution) == count
