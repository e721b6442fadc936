"""Planetary gear trains: published counts, brute force with networkx, ranks of the equations; textbook ratios."""

from __future__ import annotations

import random
import tomllib
from collections import Counter
from fractions import Fraction
from functools import partial
from itertools import combinations, islice, permutations
from pathlib import Path

import gear_symmetries
import networkx as nx
import pytest
import sympy
from networkx.algorithms.isomorphism import categorical_edge_match, categorical_node_match

from graphsynth import (
    MechanismGraph,
    PlanetaryGearTrain,
    count_planetary_gear_trains,
    enumerate_multiple_joint_chains,
    enumerate_planetary_gear_trains,
    enumerate_slider_chains,
)
from graphsynth.cli.main import main
from graphsynth.core.errors import FormatError, GraphError, SpecError, TooLargeError
from graphsynth.structure.canonical import label_coloured
from graphsynth.synthesis import geared_trees
from graphsynth.synthesis.geared_trees import _kept_choice, _move

PUBLISHED = tomllib.loads((Path(__file__).parents[2] / "catalog/counts/published.toml").read_text())["gear_trains"]
PRIME = 2_147_483_629
#: Sun 0, ring 1 and carrier 2 on one axis, planet 3.
SIMPLE = PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [(0, 3), (1, 3)])
#: Common sun 0, planets 1 and 2, first carrier with the second ring 3, first ring 4, second carrier 5.
SIMPSON = PlanetaryGearTrain.from_axes(6, [(0, 3, 4, 5), (3, 1), (5, 2)], [(0, 1), (1, 4), (0, 2), (2, 3)])
#: Small sun 0, large sun 1, ring 2, carrier 3, short planet 4, long planet 5.
RAVIGNEAUX = PlanetaryGearTrain.from_axes(6, [(0, 1, 2, 3), (3, 4), (3, 5)], [(0, 4), (4, 5), (1, 5), (2, 5)])
#: Two suns 0 and 1, carrier 2, a planet 3 with two wheels.
STEPPED = {(0, 3): (99, 101), (1, 3): (100, 100)}


def equations(links, pairs, rng):
    """Return the equations with random coefficients modulo a prime."""
    rows = []
    for a, b, carrier in pairs:
        row = [0] * links
        row[a], row[b] = rng.randrange(1, PRIME), rng.randrange(1, PRIME)
        row[carrier] = -row[a] - row[b]
        rows.append(row)
    return rows


def moves_freely(links, pairs, rng):
    """Whether the equations have rank N - 2 and tell all links apart, with random coefficients modulo a prime."""
    rows = equations(links, pairs, rng)
    for fixed, turned in combinations(range(links), 2):  # else they always turn alike
        place = [link for link in range(links) if link not in (fixed, turned)]
        square = [[row[link] for link in place] for row in rows]
        if determinant(square) == 0:
            return False
    return True


def determinant(square):
    """Return the determinant modulo the prime."""
    rows, value = [list(row) for row in square], 1
    for at in range(len(rows)):
        pivot = next((i for i in range(at, len(rows)) if rows[i][at] % PRIME), None)
        if pivot is None:
            return 0
        rows[at], rows[pivot] = rows[pivot], rows[at]
        value = value * rows[at][at] % PRIME
        inverse = pow(rows[at][at], -1, PRIME)
        for i in range(at + 1, len(rows)):
            factor = rows[i][at] * inverse % PRIME
            rows[i] = [(x - factor * y) % PRIME for x, y in zip(rows[i], rows[at])]
    return value


def rank(rows):
    """Return the rank modulo the prime."""
    rows, found = [list(row) for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((i for i in range(found, len(rows)) if rows[i][column] % PRIME), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        inverse = pow(rows[found][column], -1, PRIME)
        for i in range(found + 1, len(rows)):
            factor = rows[i][column] * inverse % PRIME
            rows[i] = [(x - factor * y) % PRIME for x, y in zip(rows[i], rows[found])]
        found += 1
    return found


def moves_with(links, pairs, rng):
    """Whether no two links always turn alike, by rank, and no link holds the gear pairs together alone."""
    rows = equations(links, pairs, rng)
    held = nx.Graph(ends for pair in pairs for ends in combinations(pair, 2))
    if len(held) < links or not nx.is_biconnected(held):
        return False
    alike = ([(link == a) - (link == b) for link in range(links)] for a, b in combinations(range(links), 2))
    return rank(rows) == len(rows) and all(rank([*rows, row]) > len(rows) for row in alike)


def block_graphs(links):
    """Connected graphs all of whose blocks are complete, from the atlas of networkx: trees of links and axes."""
    for graph in nx.graph_atlas_g():
        blocks = list(nx.biconnected_components(graph)) if len(graph) == links and nx.is_connected(graph) else []
        if blocks and all(graph.subgraph(b).size() == len(b) * (len(b) - 1) // 2 for b in blocks):
            yield graph


def brute_force(links, mobility=1):
    """Return one train of each class as (axes graph with gear pairs, gear pairs with carriers)."""
    rng, found = random.Random(1), {}
    for graph in block_graphs(links):
        far = dict(nx.all_pairs_shortest_path(graph))
        pairs = [(a, b, far[a][b][1]) for a, b in combinations(range(links), 2) if len(far[a][b]) == 3]
        for chosen in combinations(pairs, links - 1 - mobility):
            if not (moves_freely if mobility == 1 else moves_with)(links, chosen, rng):
                continue
            train = nx.Graph()
            train.add_edges_from(graph.edges, kind=1)
            train.add_edges_from([pair[:2] for pair in chosen], kind=2)
            alike = found.setdefault(nx.weisfeiler_lehman_graph_hash(train, edge_attr="kind"), [])
            same = {"edge_match": categorical_edge_match("kind", 0)}
            if not any(nx.is_isomorphic(train, other, **same) for other, _ in alike):
                alike.append((train, chosen))
    return [entry for alike in found.values() for entry in alike]


def rotation_classes(trains):
    """Number of classes of sets of (gear, gear; carrier)."""
    found = {}
    for _, pairs in trains:
        graph = nx.Graph()
        for number, (a, b, carrier) in enumerate(pairs):
            graph.add_node(("pair", number), kind="pair")
            graph.add_nodes_from((a, b, carrier), kind="link")
            graph.add_edges_from([(a, ("pair", number)), (b, ("pair", number))], kind="gear")
            graph.add_edge(carrier, ("pair", number), kind="carrier")
        alike = found.setdefault(nx.weisfeiler_lehman_graph_hash(graph, edge_attr="kind"), [])
        same = {"node_match": categorical_node_match("kind", 0), "edge_match": categorical_edge_match("kind", 0)}
        if not any(nx.is_isomorphic(graph, other, **same) for other in alike):
            alike.append(graph)
    return sum(map(len, found.values()))


@pytest.mark.parametrize("row", PUBLISHED["rows"], ids=lambda row: f"{row[0]} links")
def test_published_numbers(row):
    links, displacement, rotation = row
    assert count_planetary_gear_trains(links) == displacement
    assert count_planetary_gear_trains(links, rotation=True) == rotation


@pytest.mark.slow
@pytest.mark.parametrize("row", PUBLISHED["own"], ids=lambda row: f"{row[0]} links")
def test_own_numbers(row):
    test_published_numbers(row)


@pytest.mark.parametrize("links", [3, 4, *(pytest.param(links, marks=pytest.mark.slow) for links in (5, 6, 7))])
def test_brute_force_finds_the_same_trains(links):
    trains = brute_force(links)
    keys = {
        MechanismGraph(links, [(a, b, kind) for a, b, kind in train.edges(data="kind")]).key[1:] for train, _ in trains
    }
    found = list(enumerate_planetary_gear_trains(links))
    assert len(keys) == len(trains) == len(found)
    assert {train.key.removeprefix("1g.") for train in found} == keys
    assert rotation_classes(trains) == count_planetary_gear_trains(links, rotation=True)


@pytest.mark.parametrize("row", PUBLISHED["two_freedoms"], ids=lambda row: f"{row[0]} links")
def test_trains_of_two_freedoms_are_those_of_tsai_and_lin(row):
    links, rotation = row
    assert count_planetary_gear_trains(links, 2, rotation=True) == rotation


@pytest.mark.parametrize(
    ("links", "mobility"),
    [(5, 2), pytest.param(6, 2, marks=pytest.mark.slow), pytest.param(7, 2, marks=pytest.mark.slow),
     pytest.param(7, 3, marks=pytest.mark.slow)],
)  # fmt: skip
def test_brute_force_finds_the_same_trains_of_more_freedoms(links, mobility):
    trains = brute_force(links, mobility)
    keys = {
        MechanismGraph(links, [(a, b, kind) for a, b, kind in train.edges(data="kind")]).key[1:] for train, _ in trains
    }
    found = list(enumerate_planetary_gear_trains(links, mobility))
    assert len(keys) == len(trains) == len(found) == count_planetary_gear_trains(links, mobility)
    assert {train.key.removeprefix("1g.") for train in found} == keys
    assert not any(train.is_fractionated for train in found)
    assert rotation_classes(trains) == count_planetary_gear_trains(links, mobility, rotation=True)


def roles_by_hand(train, which):
    """Choices of a fixed link, of (fixed, input, output) on axes of the fixed one, or on one axis, up to symmetries."""
    near = {link: {other for other in train[link] if train[link][other]["kind"] == 1} for link in train}
    ways = [(f,) for f in train]
    if which != "frame":
        ways = [(f, a, b) for f in train for a, b in permutations(sorted(near[f]), 2)]
    if which == "coaxial":
        ways = [(f, a, b) for f, a, b in ways if b in near[a]]
    matcher = nx.isomorphism.GraphMatcher(train, train, edge_match=categorical_edge_match("kind", 0))
    moves = list(matcher.isomorphisms_iter())
    return {min(tuple(move[link] for link in way) for move in moves) for way in ways}


@pytest.mark.parametrize("links", [4, *(pytest.param(links, marks=pytest.mark.slow) for links in (5, 6))])
def test_roles_are_the_orbits_of_brute_force(links):
    trains = [train for train, _ in brute_force(links)]
    for which, asked in {"frame": {"framed": True}, "any": {"drive": "any"}, "coaxial": {"drive": "coaxial"}}.items():
        number = sum(len(roles_by_hand(train, which)) for train in trains)
        found = list(enumerate_planetary_gear_trains(links, **asked))
        assert number == len(found) == count_planetary_gear_trains(links, **asked)
        assert {train.frame for train in found} == {0}
        assert len({role_key(train, which) for train in found}) == number
    assert count_planetary_gear_trains(links, framed=True, rotation=True) == sum(
        len(train.coloured.orbits) for train in enumerate_planetary_gear_trains(links, rotation=True)
    )


def role_key(train, which="any"):
    """Return a form that two trains share if one is the other, links 0, or 0 to 2, being what they are."""
    first = [0] if which == "frame" else [0, 1, 2]
    rest = range(len(first), train.links)
    places = ([*first, *order] for order in permutations(rest))
    return min(train.coloured.relabelled(place).packed for place in places)


@pytest.mark.parametrize("asked", [{"framed": True}, {"drive": "any"}, {"drive": "coaxial"}])
def test_lists_of_roles_are_as_long_as_their_counts(asked):
    for links, mobility in ((5, 1), (6, 1), *(((7, 2),) if "framed" in asked else ())):
        found = sum(1 for _ in enumerate_planetary_gear_trains(links, mobility, **asked))
        assert found == count_planetary_gear_trains(links, mobility, **asked)


@pytest.mark.slow
@pytest.mark.parametrize("links", [6, 7, 8, 9])
def test_orbits_add_up_to_all_independent_choices(links):
    import gear_ranks

    trains = 0
    for by_rank, orbits, number in gear_ranks.sums_by_tree(links):
        assert by_rank == orbits
        trains += number
    assert trains == count_planetary_gear_trains(links)


@pytest.mark.parametrize("links", [5, pytest.param(6, marks=pytest.mark.slow)])
def test_orbits_add_up_to_all_choices_without_locked_links(links):
    """No subset rule and no symmetry on the one side; orbit and stabiliser on the other."""
    rng = random.Random(links)
    by_tree = {}
    for train in enumerate_planetary_gear_trains(links):
        tree = MechanismGraph(links, [(a, b) for a, b, kind in train.coloured.joints if kind == 1])
        entry = by_tree.setdefault(tree.key, [tree, 0])
        entry[1] += tree.automorphism_order // train.automorphism_order
    for tree, orbits in by_tree.values():
        far = dict(nx.all_pairs_shortest_path(tree.to_networkx()))
        pairs = [(a, b, far[a][b][1]) for a, b in combinations(range(links), 2) if len(far[a][b]) == 3]
        assert sum(moves_freely(links, chosen, rng) for chosen in combinations(pairs, links - 2)) == orbits


@pytest.mark.parametrize(("links", "gears", "roles"), [(4, 2, r) for r in range(4)] + [(5, 3, 0), (5, 3, 2), (5, 2, 1)])
def test_symmetries_are_drawn_by_the_choices_they_keep(links, gears, roles):
    """Every number that can be drawn, against all permutations, all sets of gear pairs and all roles."""
    for at, tree in enumerate(geared_trees.trees_of_axes(links)):
        weights, (order, total, _) = gear_symmetries.weights(tree, gears, roles), _move(links, at, gears, roles, -1)
        assert total == sum(weights.values())
        assert total == 0 or order == tree.automorphism_order
        assert Counter(tuple(_move(links, at, gears, roles, target)[2]) for target in range(total)) == weights


@pytest.mark.parametrize(("links", "gears"), [(4, 2), (5, 2)])
def test_choices_that_a_symmetry_keeps_are_equally_likely(links, gears):
    for tree in geared_trees.trees_of_axes(links):
        pairs = geared_trees._possible_pairs(tree)
        for move in gear_symmetries.weights(tree, gears, 0):
            chances = Counter()
            for places, chance in gear_symmetries.every_draw(partial(_kept_choice, pairs, move, gears)):
                chances[frozenset(frozenset(pairs[at][:2]) for at in places)] += chance
            wanted = gear_symmetries.kept_choices(tree, gears, move)
            assert chances == {chosen: Fraction(1, len(wanted)) for chosen in wanted}


@pytest.mark.parametrize(
    ("links", "asked"),
    [(4, {}), (4, {"roles": 2}), (4, {"rotation": True}), pytest.param(5, {"mobility": 2}, marks=pytest.mark.slow)],
)
def test_every_train_of_a_tree_is_equally_likely(links, asked):
    """A tree is drawn by its orbits, locked ones included, so each train has one over their number, exactly."""
    asked = {"rotation": False, "mobility": 1, "roles": 0, **asked}
    found = 0
    for at in range(len(geared_trees.trees_of_axes(links))):
        for orbits, draw in geared_trees.GearedTrees(links, at, at + 1, **asked).urns():
            chances = Counter()
            for graph, chance in gear_symmetries.every_draw(draw):
                if graph is not None:
                    key = role_key(PlanetaryGearTrain(graph)) if asked["roles"] else graph.key
                    chances[key] += chance
            assert set(chances.values()) <= {Fraction(1, orbits)}
            found += len(chances)
    more = {"drive": "any"} if asked["roles"] else {"rotation": asked["rotation"]}
    assert found == count_planetary_gear_trains(links, asked["mobility"], **more)


@pytest.mark.parametrize("links", [4, 5, 6])
def test_rotation_graphs_are_the_classes_of_the_equations(links):
    keys = [train.rotation_graph().key for train in enumerate_planetary_gear_trains(links)]
    finest = [train.key for train in enumerate_planetary_gear_trains(links, rotation=True)]
    assert set(keys) == set(finest)
    assert len(finest) == len(set(finest))


@pytest.mark.parametrize("links", [5, pytest.param(8, marks=pytest.mark.slow)])
def test_the_equations_fall_into_as_many_classes(links):
    """Links and gear pairs as vertices, the carrier on an edge of another colour: no blocks and no axes."""
    found = set()
    for train in enumerate_planetary_gear_trains(links):
        pairs = len(train.gears)
        edges = [(x, links + i, 1 + (x == pair.carrier)) for i, pair in enumerate(train.gears) for x in pair]
        graph = MechanismGraph(links + pairs, edges)
        labelling = label_coloured(graph, [0] * links + [1] * pairs)
        found.add(graph.relabelled(labelling.permutation).packed)
    assert len(found) == count_planetary_gear_trains(links, rotation=True)


def test_a_train_is_its_text_and_its_key():
    for train in enumerate_planetary_gear_trains(6):
        assert PlanetaryGearTrain.from_text(train.to_text()) == train
        shuffled = train.coloured.relabelled(random.Random(train.key).sample(range(6), 6))
        assert PlanetaryGearTrain(shuffled).key == train.key
        assert PlanetaryGearTrain.from_key(train.key) == train.canonical()
        assert train.mobility == 1
        assert len(train.gears) == 4
        assert sum(len(axis) - 1 for axis in train.axes) == 5


def test_ratios_of_the_simple_train_are_those_of_the_textbook():
    s, p, r = sympy.symbols("s p r", positive=True)
    teeth = {(0, 3): (s, p), (1, 3): (-r, p)}
    assert sympy.simplify(SIMPLE.ratio(0, 2, 1, teeth=teeth) - (1 + r / s)) == 0
    assert sympy.simplify(SIMPLE.ratio(1, 2, 0, teeth=teeth) - (1 + s / r)) == 0
    assert sympy.simplify(SIMPLE.ratio(0, 1, 2, teeth=teeth) + r / s) == 0
    assert SIMPLE.ratio(0, 2, 1).free_symbols == set(sympy.symbols("z0_3 z3_0 z1_3 z3_1"))


def test_speeds_of_the_simpson_and_the_ravigneaux_train():
    s, r, p, t, small = sympy.symbols("s r p t small", positive=True)
    teeth = {(0, 1): (s, p), (1, 4): (p, -r), (0, 2): (s, p), (2, 3): (p, -r)}
    wanted = {(4, 3, 5): 2 + s / r, (4, 3, 0): 1 + s / r, (0, 3, 5): -r / s}
    for (driven, driving, fixed), value in wanted.items():
        assert sympy.simplify(SIMPSON.ratio(driven, driving, fixed, teeth=teeth) - value) == 0
    teeth = {(0, 4): (small, p), (4, 5): (p, t), (1, 5): (s, t), (2, 5): (-r, t)}
    wanted = {(0, 2, 3): r / small, (0, 2, 1): r * (small + s) / (small * (s + r)), (1, 2, 3): -r / s}
    for (driven, driving, fixed), value in wanted.items():
        assert sympy.simplify(RAVIGNEAUX.ratio(driven, driving, fixed, teeth=teeth) - value) == 0


def test_the_differential_needs_two_inputs():
    train = PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [(0, 3), (1, 3)])
    found = train.speeds({0: 30, 1: 10}, teeth={(0, 3): (16, 10), (1, 3): (-16, 10)})
    assert found[2] == 20
    with pytest.raises(GraphError, match="left open: give more"):
        train.speeds({0: 30})
    with pytest.raises(GraphError, match="contradict"):
        train.speeds({0: 30, 1: 10, 2: 0}, teeth={(0, 3): (16, 10), (1, 3): (-16, 10)})


@pytest.mark.parametrize("way", [(0, 2, 1), (2, 0, 1), (1, 2, 0), (2, 1, 0), (0, 1, 2)])
def test_efficiencies_of_the_simple_train(way):
    """The closed forms for a negative basic ratio i, eta being that of both meshes with the carrier at rest."""
    eta, i = Fraction(97, 100) ** 2, -3
    wanted = {
        (0, 2, 1): (i * eta - 1) / (i - 1),
        (2, 0, 1): (i - 1) / (i / eta - 1),
        (1, 2, 0): (eta - i) / (1 - i),
        (2, 1, 0): (1 - i) / (1 / eta - i),
        (0, 1, 2): eta,
    }
    found = SIMPLE.efficiency(*way, teeth={(0, 3): (20, 20), (1, 3): (-60, 20)}, mesh="0.97")
    assert Fraction(int(found.efficiency.p), int(found.efficiency.q)) == wanted[way]


def test_a_stepped_planet_loses_nearly_all_and_locks_itself():
    """Basic ratio i = 99 / 101: driven at the carrier (1 - i) / (1 - i eta), not at all from the sun."""
    i, eta = Fraction(99 * 100, 101 * 100), Fraction(49, 50) ** 2
    found = SIMPLE.efficiency(2, 1, 0, teeth=STEPPED, mesh=0.98)
    assert SIMPLE.ratio(2, 1, 0, teeth=STEPPED) == sympy.Rational(101, 2)
    assert Fraction(str(found.efficiency)) == (1 - i) / (1 - i * eta)
    back = SIMPLE.efficiency(1, 2, 0, teeth=STEPPED, mesh=0.98)
    assert (back.efficiency, back.torques) == (0, {})


def test_meshes_in_a_row_multiply_whatever_the_order_of_the_teeth():
    teeth = {(4, 5): (18, 30), (5, 2): (30, -72), (0, 4): (28, 18), (1, 5): (36, 30)}
    found = RAVIGNEAUX.efficiency(0, 2, 3, teeth=teeth, mesh={(0, 4): "0.9", (5, 4): "0.8", (2, 5): "0.7", (1, 5): 1})
    assert found.efficiency == sympy.Rational(504, 1000)
    assert found.powers[1, 5] == 0
    assert RAVIGNEAUX.ratio(0, 2, 3, teeth=teeth) == sympy.Rational(72, 28)


@pytest.mark.long
def test_power_and_torque_are_balanced():
    rng = random.Random(4)
    for train in (SIMPLE, RAVIGNEAUX, *islice(enumerate_planetary_gear_trains(5), 0, None, 5)):
        teeth = {pair[:2]: tuple(rng.choice((-1, 1)) * rng.randint(15, 80) for _ in range(2)) for pair in train.gears}
        for way in train.arrangements():
            try:
                found = train.efficiency(*way, teeth=teeth, mesh="0.95")
            except GraphError:
                continue  # the output stands still
            w = train.speeds({way.fixed: 0, way.input: 1}, teeth=teeth)
            assert all((w[a] - w[c]) * teeth[a, b][0] == -(w[b] - w[c]) * teeth[a, b][1] for a, b, c in train.gears)
            if found.efficiency == 0:
                continue
            lost = sum(
                (1 - sympy.Rational(19, 20)) * power if power > 0 else (1 - 1 / sympy.Rational(19, 20)) * power
                for power in found.powers.values()
            )
            assert sum(found.torques.values()) == 0
            assert found.efficiency == 1 - lost
            assert 0 < found.efficiency <= 1


def test_arrangements_are_one_of_each_orbit():
    assert len(SIMPLE.arrangements(coaxial=True)) == 3  # a train does not know its sun from its ring
    every = {(a, b, c) for a in range(3) for b in range(3) for c in range(3) if len({a, b, c}) == 3}
    swap = {0: 1, 1: 0, 2: 2}
    kept = {tuple(way) for way in SIMPLE.arrangements(coaxial=True)}
    assert {image for way in kept for image in (way, tuple(swap[link] for link in way))} == every
    framed = PlanetaryGearTrain(SIMPLE.coloured.with_frame(1))
    assert {way.fixed for way in framed.arrangements()} == {0}


def test_bad_trains_and_teeth_get_one_sentence():
    cases = [
        (lambda: PlanetaryGearTrain.from_axes(4, [(0, 1), (1, 2), (2, 3), (3, 0)], []), "close a loop"),
        (lambda: PlanetaryGearTrain.from_axes(4, [(0, 1), (2, 3)], []), "on no axis of the others"),
        (lambda: PlanetaryGearTrain.from_axes(4, [(0, 1), (1, 2), (2, 3)], [(0, 3)]), "no link that carries"),
        (lambda: PlanetaryGearTrain.from_axes(3, [(0,)], []), "two links or more"),
        (lambda: PlanetaryGearTrain.from_text("C~ 2:0-3"), "no joints of mobility 2"),
        (lambda: PlanetaryGearTrain.from_key("1p.BBP8AEg"), "begins with 1g."),
        (lambda: SIMPLE.ratio(0, 2), "no link is fixed"),
        (lambda: SIMPLE.ratio(0, 9, 1), "no link 9"),
        (lambda: SIMPLE.speeds(3), "must be a mapping"),
        (lambda: SIMPLE.ratio(0, 0, 1), "must be different links"),
        (lambda: SIMPLE.ratio(0, 2, 1, teeth={(0, 3): (20, 20)}), "are missing"),
        (lambda: SIMPLE.ratio(0, 2, 1, teeth={(0, 1): (20, 20)}), "no gear pair"),
        (lambda: SIMPLE.ratio(0, 2, 1, teeth={(0, 3): (0, 20)}), "must not be 0"),
        (lambda: SIMPLE.efficiency(0, 2, 1, teeth={(0, 3): (20, 20), (1, 3): (-60, 20)}, mesh=1.2), "at most 1"),
        (lambda: count_planetary_gear_trains(2), "at least 3|3"),
        (lambda: count_planetary_gear_trains(12), "11 links at most"),
        (lambda: count_planetary_gear_trains(6, drive="all"), "'any', 'coaxial' or None"),
        (lambda: count_planetary_gear_trains(6, drive="any", rotation=True), "leave out rotation, or drive"),
        (lambda: count_planetary_gear_trains(6, 2, drive="any"), "leave out mobility, or drive"),
    ]
    for call, words in cases:
        with pytest.raises((FormatError, GraphError, SpecError, TooLargeError), match=words):
            call()


def test_the_command_line_counts_lists_and_shows(capsys, tmp_path):
    assert main(["count", "--links", "6", "--gear-trains"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "81"
    assert main(["count", "--links", "6", "--gear-trains", "--rotation-graphs", "--shard", "1/2"]) == 0
    assert int(capsys.readouterr().out.splitlines()[-1]) <= 27
    file = tmp_path / "trains.txt"
    assert main(["enumerate", "--links", "5", "--gear-trains", "-o", str(file)]) == 0
    trains = [PlanetaryGearTrain.from_text(line) for line in file.read_text().splitlines()]
    assert len({train.key for train in trains}) == 13
    capsys.readouterr()
    assert main(["show", SIMPLE.to_text(), "-o", str(tmp_path / "train.svg")]) == 0
    assert "0-3 on 2" in capsys.readouterr().out
    assert (tmp_path / "train.svg").read_text().startswith("<svg")
    for more, number in {"--frame": 408, "--drive any": 1316, "--mobility 2": 3}.items():
        assert main(["count", "--links", "6", "--gear-trains", *more.split()]) == 0
        assert capsys.readouterr().out.splitlines()[-1] == str(number)
    assert main(["count", "--links", "6", "--gear-trains", "--space", "6"]) == 2
    assert main(["count", "--links", "6", "--drive", "any"]) == 2


def test_a_list_has_places_and_pictures():
    trains = enumerate_planetary_gear_trains(4)
    assert [trains[k] for k in range(3)] == list(trains)
    assert trains._repr_html_().count("<svg") == 3
    assert enumerate_slider_chains(4, 1)._repr_html_().count("<svg") == 1
    assert enumerate_multiple_joint_chains(6)._repr_html_().count("<svg") == 2
