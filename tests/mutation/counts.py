"""Change the orbit engine a little, many times, and see whether any change gives all the counts it should not.

``python tests/mutation/counts.py --count 200`` draws changes of the modules that make and count labellings and makes
each in a fork of this process, where the kernels are interpreted: a second or two for each, where compiling takes half
a minute.  A change is noticed when an answer differs, an error is raised, or the processor time is used up.  What is
not noticed is listed; ``known.toml`` says which changes alter nothing that can be seen, and ``run.py`` runs the tests
against any one.
"""

from __future__ import annotations

import argparse
import importlib.abc
import importlib.util
import os
import random
import resource
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"  # before numba is imported

import numpy as np
from run import _line, known
from sites import Change, changes

from graphsynth import MechanismGraph, StructuralSpec

ROOT = Path(__file__).parents[2]
ENGINE = ROOT / "graphsynth/synthesis"
NAMES = ("edge_labels", "families", "fractionated", "rigid_blocks", "totals", "wishes")
KERNELS = ("colouring", "contracted", "counting", "covers", "expanding", "gears")
KERNELS += ("growing", "listing", "moving", "splitting", "variables")
MODULES = [*(ENGINE / f"{name}.py" for name in NAMES), *(ENGINE / "kernels" / f"{name}.py" for name in KERNELS)]
#: What only estimates work or room, and what is not counted here.
BESIDE = {"weigh_block", "_visited", "_least", "_stays", "labellings", "_ways", "_known_ways", "_costs", "weight",
          "make_work", "open_fixed", "decode_fixed", "_nth_label", "expand_text", "_put_number", "_put_plain",
          "by_vertices", "_stream", "_lay_pairs", "_is_ordered", "_smallest_sets_first", "refine",
          "is_counted_together", "_search_order", "identity_sums"}  # fmt: skip
SECONDS = 20
LEVELS: list[dict[int, Any]] = [{-1: 1}, {3: 2}, {2: (3, None)}]
SAMPLED = ["1CAvElhAw", "1CAvIkEjQ", "1CAvQWghQ"]  # by the same draws always


def _questions() -> list[tuple[str, Callable[[], Any], Any]]:
    """Name, question and answer; the answers are published or those of trying everything (``tests/synthesis``)."""
    import graphsynth as gs

    trains, ways = gs.count_planetary_gear_trains, ("any", "coaxial")
    four = MechanismGraph.from_text("Cl")
    wish, eight = gs.Wishes, StructuralSpec(W=1, links=8)

    def keys(graphs: Any) -> int:
        return len({graph.key for graph in graphs})

    def mechanisms(**more: Any) -> Any:
        return gs.enumerate_mechanisms(eight, **more)

    return [
        ("chains", lambda: [gs.count_chains(n) for n in (4, 6, 8, 10)], [1, 2, 16, 230]),
        ("listed", lambda: [keys(gs.enumerate_chains(n)) for n in (6, 8, 10)], [2, 16, 230]),
        ("lines", lambda: sum(1 for _ in gs.enumerate_chains(10)), 230),
        ("two freedoms", lambda: [gs.count_chains(n, 2) for n in (7, 9, 11)], [3, 35, 753]),
        ("fractionated", lambda: [gs.count_chains(n, 2, fractionated=True) for n in (7, 9, 11)], [4, 40, 839]),
        ("three freedoms", lambda: gs.count_chains(10, 3, fractionated=True), 98),
        ("listed, three freedoms", lambda: keys(gs.enumerate_chains(8, 3, fractionated=True)), 7),
        ("four freedoms", lambda: gs.count_chains(11, 4, fractionated=True), 189),
        ("higher pairs", lambda: gs.count_chains(6, joints_by_mobility={2: 2}), 52),
        ("higher pairs only", lambda: gs.count_chains(3, 3, joints_by_mobility={2: 3}), 1),
        ("levels", lambda: [gs.count_mechanisms(eight.replace(levels=at)) for at in LEVELS], [28, 23, 62]),
        ("space", lambda: [gs.count_chains(n, 1, space=2) for n in (5, 6)], [3, 13]),
        ("mechanisms", lambda: [gs.count_mechanisms(StructuralSpec(W=1, links=n)) for n in (6, 8, 10)], [5, 71, 1834]),
        ("listed mechanisms", lambda: keys(mechanisms()), 71),
        ("symmetric", lambda: [keys(gs.enumerate_chains(10, symmetry=p)) for p in (2, 3, 5)], [143, 2, 0]),
        ("symmetric six-bars", lambda: gs.count_mechanisms(StructuralSpec(W=1, links=6), symmetry=2), 4),
        ("given joints", lambda: gs.count_chains(6, joints_by_mobility={1: 7}), 2),
        ("symmetric mechanisms", lambda: [sum(1 for _ in mechanisms(symmetry=p)) for p in (2, 3)], [39, 1]),
        ("trusses", lambda: [gs.count_baranov_trusses(n) for n in (3, 5, 7, 9)], [1, 1, 3, 28]),
        ("groups", lambda: [keys(gs.enumerate_assur_groups(n)) for n in (2, 4, 6, 8)], [1, 2, 10, 173]),
        ("sliders", lambda: [gs.count_slider_chains(6, k) for k in (1, 2, 3)], [6, 13, 10]),
        ("loops that turn", lambda: [gs.count_slider_chains(8, k) for k in (3, 4)], [555, 510]),
        ("rings", lambda: [gs.count_slider_chains(4, 2, sliding_links=yes) for yes in (False, True)], [1, 2]),
        ("sliding loops", lambda: [gs.count_slider_chains(8, k, sliding_loops=True) for k in (1, 3)], [84, 574]),
        ("sliding links", lambda: keys(gs.enumerate_slider_chains(6, 3, sliding_links=True)), 20),
        ("cylinders", lambda: gs.count_slider_chains(9, 2, 2, cylinders=True, framed=True), 183),
        ("sampled", lambda: [graph.key for graph in gs.sample_mechanisms(StructuralSpec(W=1, links=8), 3, 1)], SAMPLED),
        ("listed sliders", lambda: keys(gs.enumerate_slider_chains(6, 2, framed=True)), 56),
        ("multiple", lambda: [gs.count_multiple_joint_chains(8, multiple=k) for k in (1, 2, 3, 4)], [22, 18, 3, 1]),
        ("multiple, two freedoms", lambda: gs.count_multiple_joint_chains(9, 2), 174),
        ("listed multiple", lambda: keys(gs.enumerate_multiple_joint_chains(8, multiple=1, framed=True)), 144),
        ("girth", lambda: [gs.count_chains(n, wishes=wish(girth=5)) for n in (8, 10)], [1, 10]),
        ("listed girth", lambda: keys(gs.enumerate_chains(10, wishes=wish(girth=5))), 10),
        ("jointed", lambda: gs.count_chains(10, wishes=wish(jointed=[(4, 4)], apart=[(3, 3)])), 14),
        ("not jointed", lambda: keys(gs.enumerate_chains(10, wishes=wish(apart=[(3, 4)]))), 83),
        ("holds", lambda: gs.count_chains(8, wishes=wish(without=[four])), 1),
        ("gear trains", lambda: [trains(n) for n in (5, 6)], [13, 81]),
        ("rotation graphs", lambda: [trains(n, w, rotation=True) for n, w in ((5, 1), (6, 1), (6, 2))], [6, 27, 2]),
        ("roles of trains", lambda: [trains(5, framed=True), *(trains(5, drive=d) for d in ways)], [50, 109, 37]),
        ("all identities", _together, [16, 230]),
        ("splits", _splits, [1, 4, 17, 118]),
        ("grown", _grown, [3, 13, 24, 38, 23, 16, 87]),
    ]  # fmt: skip


def _interpret() -> None:
    """Give the operations of the processor to interpreted kernels."""
    from graphsynth.core import intrinsics

    intrinsics.popcount = lambda mask: int(mask).bit_count()
    intrinsics.lowest_bit = lambda mask: (int(mask) & -int(mask)).bit_length() - 1 if mask else 64


def _together() -> list[int]:
    """Count chains by all identities and the other automorphisms."""
    from graphsynth.synthesis.families import chain_families
    from graphsynth.synthesis.totals import _totals

    return [int(sum(part.count() for part in _totals(tuple(chain_families(n, 1, 3, {}, False))))) for n in (8, 10)]


def _splits() -> list[int]:
    """Count contracted graphs of two to five loops."""
    from graphsynth.synthesis.contracted import generate

    return [sum(map(len, layers.values())) for layers in generate(5).values()]


def _grown() -> list[int]:
    """Count contracted graphs of five loops, as they grow from those of four, by vertices, and the symmetric ones."""
    from graphsynth.synthesis.contracted import contracted_graphs
    from graphsynth.synthesis.kernels.growing import grow, make_growth
    from graphsynth.synthesis.kernels.layout import MAX_VERTICES

    sums, symmetric = np.zeros(MAX_VERTICES + 1, np.int64), 0
    out, sizes = np.zeros((256, MAX_VERTICES, MAX_VERTICES), np.uint8), np.zeros(256, np.int64)
    roots = [(loops, k, contracted_graphs(loops, k)) for loops in range(2, 5) for k in range(2, 2 * loops - 1)]
    roots.append((5, 2, np.array([[[0, 6], [6, 0]]], np.uint8)))
    for loops, k, graphs in roots:
        growth = make_growth(2000)
        symmetric += grow(k, graphs, len(graphs), loops, 4, 5, 8, True, growth, out, sizes, sums)
    return [*sums[3:9].tolist(), symmetric]


class _Changed(importlib.abc.MetaPathFinder, importlib.abc.SourceLoader):
    """Gives one module the changed source."""

    def __init__(self, path: Path, source: str) -> None:
        self.name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        self.path, self.source = path, source

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> Any:
        return importlib.util.spec_from_loader(fullname, self, origin=str(self.path)) if fullname == self.name else None

    def get_filename(self, fullname: str) -> str:
        return str(self.path)

    def get_data(self, path: str) -> bytes:
        return self.source.encode()


def _answer(path: Path, source: str) -> str:
    """Return the first question that a source answers wrongly, or nothing."""
    sys.meta_path.insert(0, _Changed(path, source))
    for name, question, right in _questions():
        try:
            if (found := question()) != right:
                return f"{name}: {found}"
        except Exception as error:
            return f"{name}: {type(error).__name__}"
    return ""


def judge(path: Path, change: Change | None) -> dict[str, Any]:
    """Ask the questions of one change in a fork."""
    begin, (reading, writing) = time.monotonic(), os.pipe()
    if (child := os.fork()) == 0:
        with os.fdopen(writing, "w") as answer:
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            source = path.read_text("utf-8")
            answer.write("said " + _answer(path, source if change is None else change.applied(source)))
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as answer:
        said = answer.read()
    os.waitpid(child, 0)
    by = said.removeprefix("said ") if said else "time is up"
    place = {"module": str(path.relative_to(ROOT)), "status": "killed" if by else "survived", "by": by}
    fields = {} if change is None else vars(change)
    return {**fields, **place, "seconds": round(time.monotonic() - begin, 1)}


def main() -> int:
    """Run, and print what was not noticed; status 1 if that is anything whose reason is not known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--modules", nargs="+", default=[path.stem for path in MODULES], help="names to draw from")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    _interpret()
    if wrong := judge(MODULES[0], None)["by"]:
        print(f"the code as it is answers wrongly: {wrong}")
        return 1
    found = [(path, c) for path in MODULES if path.stem in options.modules for c in changes(path.read_text("utf-8"))]
    drawn = random.Random(options.seed).sample([one for one in found if one[1].function not in BESIDE], options.count)
    rows = []
    for path, change in drawn:
        rows.append(judge(path, change))
        print(f"{len(rows)}/{len(drawn)} {_line(rows[-1])}", flush=True)
    lived = [row for row in rows if row["status"] == "survived"]
    open_ = [row for row in lived if not known(row)]
    print(f"{len(rows)} changes: {len(rows) - len(lived)} noticed, {len(lived) - len(open_)} alter nothing")
    for row in open_:
        print("unnoticed:", _line(row))
    return bool(open_)


if __name__ == "__main__":
    raise SystemExit(main())
