"""What the orbit engine and the second count are asked: small questions whose answers are published or certain."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout
from fractions import Fraction
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from graphsynth import MechanismGraph, StructuralSpec

__all__ = ["Question", "of_the_engine", "of_the_second_count"]

Question = tuple[str, Callable[[], Any], Any]
LEVELS: list[dict[int, Any]] = [{-1: 1}, {3: 2}, {2: (3, None)}]
ROLES: list[dict[str, Any]] = [{}, {"framed": True}, {"drive": "any"}, {"drive": "coaxial"}]
SAMPLED = ["1CAvElhAw", "1CAvIkEjQ", "1CAvQWghQ"]  # by the same draws always


def of_the_engine() -> list[Question]:
    """Name, question and answer; the answers are published or those of trying everything (``tests/synthesis``)."""
    import graphsynth as gs

    trains, ways = gs.count_planetary_gear_trains, ("any", "coaxial")
    listed = gs.enumerate_planetary_gear_trains
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
        ("listed trains", lambda: [keys(gs.enumerate_planetary_gear_trains(n)) for n in (4, 5)], [3, 13]),
        ("finest axes", lambda: trains(7, rotation=True), 152),
        ("rotation graphs", lambda: [trains(n, w, rotation=True) for n, w in ((5, 1), (6, 1), (6, 2))], [6, 27, 2]),
        ("roles of trains", lambda: [trains(5, framed=True), *(trains(5, drive=d) for d in ways)], [50, 109, 37]),
        ("drawn trains", _drawn_trains, True),
        ("urns", _urns, [3, 8, 10, 3]),
        ("listed roles", lambda: [sum(1 for _ in listed(5, **asked)) for asked in ROLES], [13, 50, 109, 37]),
        ("drawn choices", _drawn_choices, True),
        ("all identities", _together, [16, 230]),
        ("in parts", lambda: [_in_parts(shipped) for shipped in (3, 4)], [230, 230]),
        ("splits", _splits, [1, 4, 17, 118]),
        ("streamed", lambda: _streamed(4), [117, 117, True]),
        ("streamed from few", lambda: _streamed(2), [117, 117, True]),
        ("grown", _grown, [3, 13, 24, 38, 23, 16, 87]),
    ]  # fmt: skip


def _together() -> list[int]:
    """Count chains by all identities and the other automorphisms."""
    from graphsynth.synthesis.families import chain_families
    from graphsynth.synthesis.totals import _totals

    return [int(sum(part.count() for part in _totals(tuple(chain_families(n, 1, 3, {}, False))))) for n in (8, 10)]


def _in_parts(shipped: int) -> int:
    """Count chains of ten links as those of 18 or 20 are: by identities and by graphs of a list, or that grow."""
    from graphsynth.synthesis import totals
    from graphsynth.synthesis.families import chain_families

    families = tuple(chain_families(10, 1, 3, {}, False))
    with mock.patch.multiple(totals, SHIPPED_LOOPS=shipped, GROWN_LOOPS=shipped + 1, _GRAPHS=2, _ROOTS=1):
        return int(sum(part.count() for part in totals._totals.__wrapped__(families)))


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


def _streamed(known: int) -> list[object]:
    """Write the graphs of five loops, seven at a time: how many, how many different, and whether each is one."""
    from graphsynth.synthesis.contracted import contracted_graphs
    from graphsynth.synthesis.kernels.growing import grow, make_growth
    from graphsynth.synthesis.kernels.layout import MAX_VERTICES

    found: list[NDArray[np.uint8]] = []
    some = [(loops, k) for loops in range(2, known + 1) for k in range(2, 2 * loops - 1)]
    some += [(loops, 2) for loops in range(known + 1, 6)]
    roots = [(loops, k, contracted_graphs(loops, k)) for loops, k in some]
    for loops, k, graphs in roots:
        growth, written = make_growth(2000), 7
        while written == 7:
            out, sizes = np.zeros((7, MAX_VERTICES, MAX_VERTICES), np.uint8), np.zeros(7, np.int64)
            sums = np.zeros(MAX_VERTICES + 1, np.int64)
            written = grow(k, graphs, len(graphs), loops, known, 5, 8, False, growth, out, sizes, sums)
            found += [out[i, : sizes[i], : sizes[i]] for i in range(written)]
    right = all((g == g.T).all() and g.sum(1).min() > 2 and g.sum() == 2 * (len(g) + 4) for g in found)
    return [len(found), len({g.tobytes() for g in found}), right]


def _drawn_trains() -> bool:
    """Tell whether symmetries of trees are drawn as often as they keep gear pairs and roles, by trying everything."""
    from gear_symmetries import weights

    from graphsynth.synthesis.geared_trees import _move, trees_of_axes

    for links, gears, roles in ((4, 2, 0), (4, 1, 1), (4, 1, 2), (4, 2, 3), (5, 3, 0), (5, 2, 2)):
        for at, tree in enumerate(trees_of_axes(links)):
            order, total, _ = _move(links, at, gears, roles, -1)
            wanted = weights(tree, gears, roles)
            if total != sum(wanted.values()) or (total and order != tree.automorphism_order):
                return False
            if links == 4 and Counter(tuple(_move(4, at, gears, roles, t)[2]) for t in range(total)) != wanted:
                return False
    return True


def _drawn_choices() -> bool:
    """Tell whether choices of gear pairs that a symmetry keeps are equally likely, by every way to draw them."""
    from functools import partial

    from gear_symmetries import every_draw, kept_choices, weights

    from graphsynth.synthesis.geared_trees import _kept_choice, _possible_pairs, trees_of_axes

    for tree in trees_of_axes(4):
        pairs = _possible_pairs(tree)
        for move in weights(tree, 2, 0):
            chances: Counter[frozenset[frozenset[int]]] = Counter()
            for places, chance in every_draw(partial(_kept_choice, pairs, move, 2)):
                chances[frozenset(frozenset(pairs[at][:2]) for at in places)] += chance  # type: ignore[assignment]
            wanted = kept_choices(tree, 2, move)
            if chances != {chosen: Fraction(1, len(wanted)) for chosen in wanted}:
                return False
    return True


def _urns() -> list[Fraction]:
    """Sum the orbits of all urns, each by the chance that what is drawn is a train: trains of four links by roles."""
    from gear_symmetries import every_draw

    from graphsynth.synthesis.geared_trees import geared_trees

    sums = [Fraction(0)] * 4
    for roles in range(4):
        for item in geared_trees(4, False, 1, roles):
            for orbits, draw in item.urns():
                sums[roles] += orbits * sum(chance for train, chance in every_draw(draw) if train is not None)
    return sums


def of_the_second_count() -> list[Question]:
    """Name, question and answer of the count by permutations of links and rigid clusters."""
    import rigid_clusters as second

    def fractionated(mobility: int, *links: int) -> list[int]:
        return [second.with_fractionated(n, mobility) for n in links]

    def graphs(n: int) -> list[int]:
        clusters = second.Clusters(n, n * (n - 1) // 2)
        kept = {p: clusters.all(tuple((length, (1,)) for length in p)) for p in second.partitions(n, n)}
        numbers = range(clusters.most + 1)
        return [second.mean({p: clusters.coefficient(own, i) for p, own in kept.items()}) for i in numbers]

    def connected(links: int, most: int) -> list[tuple[int, int, Fraction]]:
        sums: Counter[tuple[int, int]] = Counter()
        for cycles, numbers in second.connected(second.Clusters(links, most), links).items():
            for joints, number in numbers.items():
                sums[sum(cycles), joints] += number  # type: ignore[assignment]
        return sorted((n, i, number) for (n, i), number in sums.items() if number)

    def pairs() -> list[int]:
        every = (second.pair_orbits(p) for p in second.partitions(6, 6))
        return sorted({sum(length * number for length, number in orbits.items()) for orbits in every})

    def written() -> list[str]:
        with TemporaryDirectory() as folder, redirect_stdout(StringIO()) as said:
            path = Path(folder, "kept")
            second.main(8, path)
            lines = path.read_text("utf-8").splitlines(keepends=True)
            path.write_text("".join(lines[:9])[:-2], "utf-8")  # in the middle of a number
            second.main(8, path)
            clusters = second.Clusters(8, 10)
            right = second.read(path) == {p: second.kept_by(clusters, p) for p in second.partitions(8, 8)}
            return [said.getvalue(), str(right and path.read_text("utf-8") == "".join(lines))]

    def asked(kept: int) -> tuple[str, int]:
        """What is printed, and how many kinds of permutation are asked for, if each kept so many."""
        calls: list[object] = []
        with TemporaryDirectory() as folder, redirect_stdout(StringIO()) as said:
            with mock.patch.object(second, "kept_by", lambda *of: calls.append(of) or kept):
                second.main(6, Path(folder, "kept"))
            return said.getvalue(), len(calls)

    trees = [
        (1, 0, 1),
        (2, 1, 1),
        (3, 2, 1),
        (4, 3, 2),
        (4, 4, 1),
        (5, 4, 3),
        (5, 5, 2),
        (6, 5, 6),
        (6, 6, 6),
        (6, 7, 2),
    ]
    return [
        ("second chains", lambda: [second.chains(n) for n in (4, 6, 8)], [1, 2, 16]),
        ("Laman graphs", lambda: [second.chains(n, 2) for n in (3, 4, 5, 6, 7)], [1, 1, 3, 13, 70]),
        ("links told apart", lambda: [second.labelled_chains(n) for n in (4, 6)], [3, 360]),
        ("second fractionated", lambda: fractionated(2, 5, 7, 9), [1, 4, 40]),
        ("second three freedoms", lambda: fractionated(3, 6, 8), [1, 7]),
        ("no joints", lambda: fractionated(1, 7), [0]),
        ("graphs", lambda: [graphs(4), sum(graphs(5)), sum(graphs(6))], [[1, 1, 2, 3, 2, 1, 1], 34, 156]),
        ("pairs", pairs, [15]),
        ("connected without joints", lambda: connected(14, 0), [(1, 0, 1)]),
        ("connected", lambda: connected(6, 7), trees),
        ("asked for", lambda: [asked(1), asked(0)], [("1\n", 11), ("0\n", 1)]),
        ("written", written, ["16\n16\n", "True"]),
    ]
