"""What the orbit engine and the second count are asked: small questions whose answers are published or certain."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from fractions import Fraction
from functools import partial
from io import StringIO
from itertools import combinations, permutations
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from graphsynth import MechanismGraph, StructuralSpec
from graphsynth.core.errors import SpecError, TooLargeError

__all__ = ["Question", "of_the_engine", "of_the_second_count"]

Question = tuple[str, Callable[[], Any], Any]
LEVELS: list[dict[int, Any]] = [{-1: 1}, {3: 2}, {2: (3, None)}]
ROLES: list[dict[str, Any]] = [{}, {"framed": True}, {"drive": "any"}, {"drive": "coaxial"}]
SAMPLED = ["1CAvElhAw", "1CAvIkEjQ", "1CAvQWghQ"]  # by the same draws always


def of_the_engine() -> list[Question]:
    """Name, question and answer; the answers are published or those of trying everything (``tests/synthesis``)."""
    from kernel_questions import of_the_kernels

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
        *_beside_counts(),
        *of_the_kernels(),
    ]  # fmt: skip


def _beside_counts() -> list[Question]:
    """Ask what ``some_questions`` has, and for bounds, texts, roles, and chains of blocks by arithmetic."""
    from some_questions import ASKED

    return [
        *((f"asked {at}", partial(_numbers_of, question), [number] * 3) for at, (question, number) in enumerate(ASKED)),
        ("refused", _refused, [False, True, True, True, False, True, False, True, True, False, False, True]),
        ("rooms", _rooms, [True, False, False, True, True, False, True]),
        ("taken over", _taken_over, "3-3 3-15 4-4,3-3 girth 4 girth 7"),
        (
            "texts of rings",
            _rings,
            ["Cl f0 P:0-3", "Cl f0 P:2-3", "Cl f0 P:0-3,1-2", "A_ f0", "A_ 2:0-1", "Bw f0 2:0-2", "Bw f0 2:1-2"],
        ),
        ("levels of joined chains", _levels, [7, 10, 8, 1, 14]),
        ("assortments of joined chains", _assortments, {("2", 0), ("2", 8), ("3", 0), ("3", 3), ("4", 1)}),
        ("assortment given", _given_assortment, 4),
        ("frames of joined chains", lambda: _joined(True), [34, 167, 32, 0, 104, 1006, 96]),
        ("joined chains", lambda: _joined(False), [5, 24, 6, 0, 17, 165, 20]),
        ("roles told apart", _roles, [50, 109, 37]),
        ("made of blocks", _made_of_blocks, 17),
        ("drawn from the list", _drawn_from_the_list, True),
        ("choices that move", _choices_that_move, True),
    ]


def _numbers_of(question: Any) -> list[int]:
    from some_questions import asked

    listed, count = asked(question)
    return [count, len(listed), len({answer.key for answer in listed})]


def _is_refused(call: Callable[[], Any], error: type[Exception] = SpecError) -> bool:
    try:
        call()
    except error:
        return True
    return False


def _refused() -> list[bool]:
    """Tell which numbers are refused: links, mobilities, spaces and joints at their bounds and beyond."""
    from graphsynth import count_chains

    def said_of_trusses() -> bool:
        try:
            return count_chains(4, 0) == 0
        except SpecError as error:
            return "Baranov" in str(error)

    numbers: list[tuple[int, int, int, dict[int, int] | None]] = [
        (2, 1, 3, None), (1, 1, 3, None), (4, 0, 3, None), (60, 50, 3, None), (60, 51, 3, None), (5, 1, 6, None),
        (5, 1, 7, None), (3, 1, 3, {3: 1}), (3, 1, 3, {2: 0}), (3, 1, 3, {2: 100}), (3, 1, 3, {2: 101}),
    ]  # fmt: skip
    asked = [
        _is_refused(lambda n=n, w=w, pi=pi, p=p: count_chains(n, w, space=pi, joints_by_mobility=p))
        for n, w, pi, p in numbers
    ]
    return [*asked[:3], said_of_trusses(), *asked[3:]]


def _rooms() -> list[bool]:
    """Tell what is too large: kinds of two parallel paths, of which there are four; states of resources."""
    from graphsynth.synthesis import edge_labels

    labels = edge_labels.EdgeLabels(3, 1, 4, (), (2,), False)
    found = []
    for bound in (3, 4):
        with mock.patch.object(edge_labels, "_MAX_LABELS", bound):
            found.append(_is_refused(lambda: labels.labels(2, False), TooLargeError))
    for binary, *higher in ((100,), (101,), (0, 101), (99, 99, 4), (99, 99, 4, 1)):
        some = edge_labels.EdgeLabels(6, 1, binary, tuple(enumerate(higher, 2)), (1,), False)
        vars(some)["by_kind"] = [[], [], [], []]
        found.append(_is_refused(lambda some=some: some.tables, TooLargeError))
    return found


def _taken_over() -> str:
    """Say which of some wishes the search takes over, so that no chain is made to be counted."""
    from graphsynth.synthesis.problem import EnumerationProblem
    from graphsynth.synthesis.wishes import Wishes

    pairs: list[Any] = [(3, 3), (3, 2), (2, 3), (1, 3), (3, 15), (3, 16), ("frame", 3)]
    wishes = {f"{one}-{other}": Wishes(jointed=[(one, other)]) for one, other in pairs}
    wishes["4-4,3-3"] = Wishes(jointed=[(3, 4)], apart=[(4, 4), (3, 3)])
    wishes |= {"planar": Wishes(apart=[(3, 3)], planar=True), "not planar": Wishes(planar=False)}
    wishes["total"] = Wishes(mobility_type="total")
    pinned = EnumerationProblem.multiple_joints(8, 1, 1)
    girths = [f"girth {n}" for n in (4, 7, 8) if pinned.wishing(Wishes(girth=n)).wishes is None]
    return " ".join([*(name for name, wish in wishes.items() if wish.is_searched), *girths])


def _rings() -> list[str]:
    """List rings of four links with one slider or two, of two links, and of three links with a joint of mobility 2."""
    from graphsynth import enumerate_slider_chains
    from graphsynth.synthesis.families import rings

    four = [chain.to_text() for chain in enumerate_slider_chains(4, 1, framed=True)]
    four += [chain.to_text() for chain in enumerate_slider_chains(4, 2, framed=True, sliding_loops=True)]
    others = (2, 1, 3, {}, True), (2, 2, 3, {2: 1}, False), (3, 1, 3, {2: 1}, True)
    return [*four, *(graph.to_text() for other in others for graph in rings(*other))]


def _levels() -> list[int]:
    """Count mechanisms of seven links and two freedoms, fractionated ones among them, by sizes of levels."""
    from graphsynth import count_mechanisms

    asked: list[dict[int, Any]] = [{-1: 1}, {1: 2}, {2: (3, None)}, {4: 1}, {5: 0}]
    return [count_mechanisms(StructuralSpec(W=2, links=7, fractionated=True, levels=at)) for at in asked]


def _assortments() -> set[tuple[str, int]]:
    """Count the same by assortment; those that fall apart at their frame are one."""
    from graphsynth import count_mechanisms

    found = StructuralSpec(W=2, links=7, fractionated=True).solve()
    return {(str(assortment.t0), count_mechanisms(assortment)) for assortment in found}


def _made_of_blocks() -> int:
    """List fractionated chains with joints of mobility 2 and 3."""
    from graphsynth.synthesis.fractionated import fractionated_chains

    return len({chain.key for chain in fractionated_chains(7, 3, 4, ((2, 1), (3, 1)))})


def _drawn_from_the_list() -> bool:
    """Tell whether rotation graphs, and trains of two freedoms, are drawn that are listed, and each is sometimes."""
    from graphsynth import enumerate_planetary_gear_trains
    from graphsynth.synthesis.geared_trees import geared_trees

    for links, rotation, mobility in ((5, True, 1), (6, False, 2)):
        listed = {train.key for train in enumerate_planetary_gear_trains(links, mobility, rotation=rotation)}
        draw = Random(1)
        drawn = {
            item.chain(graph).key
            for item in geared_trees(links, rotation, mobility, 0)
            for _, urn in item.urns()
            for graph in (urn(draw) for _ in range(40))
            if graph is not None
        }
        if drawn != listed:
            return False
    return True


def _choices_that_move() -> bool:
    """Tell whether any three gear pairs on trees of five links are locked when a set of links has too many of them."""
    from graphsynth.synthesis.geared_trees import _moves_freely, _possible_pairs, trees_of_axes

    sets = [set(some) for size in (2, 3, 4, 5) for some in combinations(range(5), size)]
    for tree in trees_of_axes(5):
        joined = {frozenset(joint[:2]) for joint in tree.joints}
        pairs = _possible_pairs(tree)
        carriers = [next(c for c in range(5) if {frozenset((a, c)), frozenset((b, c))} <= joined) for a, b, _ in pairs]
        held = [{a, b, carrier} for (a, b, _), carrier in zip(pairs, carriers)]
        for chosen in combinations(range(len(pairs)), 3):
            right = all(sum(held[at] <= some for at in chosen) <= len(some) - 2 for some in sets)
            if _moves_freely(5, tree, [pairs[at] for at in chosen]) != right:
                return False
    return True


def _given_assortment() -> int:
    """Count mechanisms of four links with three joints each, by an assortment with a mapping of one's own."""
    from graphsynth import count_mechanisms

    solutions = StructuralSpec(W=1, links=4, p2=4).solve()
    assortment = next(one for one in solutions if one.n_a[3] == 3)
    return count_mechanisms(replace(assortment, n_a={3: 3}))


def _joined(framed: bool) -> list[int]:
    """Count fractionated chains by arithmetic, where joints have mobility 1, 2 or 3 too."""
    from graphsynth.synthesis.fractionated import count_fractionated

    asked = (9, 2, 3, ()), (10, 3, 3, ()), (7, 3, 3, ((2, 1),)), (5, 2, 3, ()), (7, 3, 4, ((2, 1), (3, 1)))
    return [count_fractionated(*numbers, framed) for numbers in (*asked, (7, 3, 3, ((2, 3),)), (6, 4, 3, ((2, 3),)))]


def _roles() -> list[int]:
    """Count trains of five links by what they are when links with roles, the first of them fixed, are told apart."""
    from graphsynth import enumerate_planetary_gear_trains

    numbers = []
    for roles, asked in zip((1, 3, 3), ROLES[1:]):
        orders = [[*range(roles), *rest] for rest in permutations(range(roles, 5))]
        trains = [train.coloured for train in enumerate_planetary_gear_trains(5, **asked)]
        forms = {min(train.relabelled(order).packed for order in orders) for train in trains if train.frame == 0}
        numbers.append(len(forms))
    return numbers


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
            for shard in ("2/3", "1/3", "3/3"):
                second.main(8, Path(folder, "parts"), shard)
            assert second.read(Path(folder, "parts")) == second.read(path)
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
        ("written", written, ["16\n16\n16\n", "True"]),
    ]
