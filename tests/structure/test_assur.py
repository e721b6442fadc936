import itertools
import random

import pytest

from graphsynth.core.errors import GraphError
from graphsynth.structure.assur import contour_class, decompose, find_fault, is_assur_group, is_baranov_truss
from graphsynth.structure.graph import MechanismGraph

FOUR_BAR = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (3, 0)], frame=0)
FIGURE_3 = MechanismGraph.from_text("N}o__QC_cA?C?C?A??w f0 2:1-2,1-3,1-4")


def summary(decomposition):
    return [(g.links, g.group_class, g.order) for g in decomposition.groups]


def test_four_bar_is_a_driver_and_a_dyad():
    found = decompose(FOUR_BAR, [1])
    (group,) = found.groups
    assert (group.links, group.group_class, group.order, group.stage) == ((2, 3), 2, 2, 1)
    assert [tuple(j[:2]) for j in group.inner] == [(2, 3)]
    assert [tuple(j[:2]) for j in group.outer] == [(0, 3), (1, 2)]
    assert found.driven == (0, 1)
    assert found.mechanism_class == 2
    assert str(found) == "mechanism of class II: class II order 2: links 2, 3"


def test_driver_as_a_pair_and_as_a_link():
    assert decompose(FOUR_BAR, [(1, 0)]) == decompose(FOUR_BAR, [1])


def test_driven_coupler_joint_makes_one_body():
    # Driving joint 1-2 locks links 1 and 2 together; the body and link 3 are a dyad.
    (group,) = decompose(FOUR_BAR, [(1, 2)]).groups
    assert group.bodies == ((1, 2), (3,))
    assert (group.group_class, group.order) == (2, 2)


# Textbook results: a Watt mechanism is of class II with any crank; a Stephenson chain only when its four-link loop is
# driven first.
WATT_ON_BINARY = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (3, 0), (2, 4), (4, 5), (5, 3)], frame=0)
WATT_ON_TERNARY = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (3, 0), (3, 4), (4, 5), (5, 0)], frame=0)
STEPHENSON_III = MechanismGraph(6, [(0, 1), (0, 2), (0, 5), (1, 3), (2, 3), (3, 4), (4, 5)], frame=0)
STEPHENSON_II = MechanismGraph(6, [(0, 1), (0, 5), (1, 2), (1, 3), (2, 4), (3, 4), (4, 5)], frame=0)
STEPHENSON_I = MechanismGraph(6, [(0, 1), (0, 4), (1, 2), (2, 4), (1, 3), (3, 5), (4, 5)], frame=0)


@pytest.mark.parametrize(
    ("mechanism", "driver", "expected"),
    [
        (WATT_ON_BINARY, 1, [((2, 3), 2, 2), ((4, 5), 2, 2)]),
        (WATT_ON_BINARY, 3, [((1, 2), 2, 2), ((4, 5), 2, 2)]),
        (WATT_ON_TERNARY, 1, [((2, 3), 2, 2), ((4, 5), 2, 2)]),
        (WATT_ON_TERNARY, 5, [((3, 4), 2, 2), ((1, 2), 2, 2)]),
        (STEPHENSON_III, 1, [((2, 3), 2, 2), ((4, 5), 2, 2)]),
        (STEPHENSON_III, 5, [((1, 2, 3, 4), 3, 3)]),
        (STEPHENSON_II, 5, [((1, 2, 3, 4), 4, 2)]),
        (STEPHENSON_II, 1, [((2, 3, 4, 5), 3, 3)]),
        (STEPHENSON_I, 1, [((2, 4), 2, 2), ((3, 5), 2, 2)]),
    ],
)
def test_six_link_mechanisms(mechanism, driver, expected):
    assert sorted(summary(decompose(mechanism, [driver]))) == sorted(expected)


def test_figure_3_of_the_source():
    found = decompose(FIGURE_3, [1])
    assert summary(found) == [
        ((2,), 2, 2),
        ((3,), 2, 2),
        ((4,), 2, 2),
        ((5, 8), 2, 2),
        ((6, 9), 2, 2),
        ((7, 10), 2, 2),
        ((11, 12, 13, 14), 3, 3),
    ]
    assert [g.stage for g in found.groups] == [1, 1, 1, 2, 2, 2, 3]
    assert found.mechanism_class == 3


def test_eight_links_with_two_ternary_links_in_a_row():
    # Driver 1; links 2..7: a group of class III and order 4 (ternary links 3 and 4, four legs).
    mechanism = MechanismGraph(
        8, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 5), (5, 3), (0, 6), (6, 4), (0, 7), (7, 4)], frame=0
    )
    assert mechanism.mobility == 1
    assert mechanism.rigid_subchain() is None
    assert summary(decompose(mechanism, [1])) == [((2, 3, 4, 5, 6, 7), 3, 4)]


def test_two_drivers():
    five_bar = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)], frame=0)
    assert summary(decompose(five_bar, [1, 4])) == [((2, 3), 2, 2)]
    assert decompose(five_bar, [1, 4]).driven == (0, 1, 4)


def test_cylinder_in_a_loop_away_from_the_frame():
    # Joint 4-5 is driven: the loop 2-3-4-5 becomes one body, and with link 1 a dyad on the frame.
    mechanism = MechanismGraph(6, [(0, 1), (0, 2), (1, 3), (2, 3), (2, 4), (4, 5), (5, 3)], frame=0)
    (group,) = decompose(mechanism, [(4, 5)]).groups
    assert group.bodies == ((1,), (2, 3, 4, 5))
    assert (group.group_class, group.order) == (2, 2)
    assert [(g.links, g.group_class) for g in group.floating] == [((3, 4, 5), 2)]


def test_a_structure_has_groups_without_a_driver():
    dyad = MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], frame=0)
    assert summary(decompose(dyad, [])) == [((1, 2), 2, 2)]


@pytest.mark.parametrize(
    ("graph", "drivers", "kind", "message"),
    [
        (FOUR_BAR, [], "drivers", "mobility 1 needs 1 driver, not 0; links 1, 2, 3 remain free"),
        (FOUR_BAR, [1, 3], "drivers", "mobility 1 needs 1 driver, not 2; links 2 have too many"),
        (MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], frame=0), [1], "drivers", "mobility 0 needs 0 drivers, not 1"),
        (
            MechanismGraph(4, list(itertools.combinations(range(4), 2)), frame=0),
            [],
            "drivers",
            "no choice of drivers helps",
        ),
        (
            # A rigid triangle and a four-bar on the frame, the driver in the triangle.
            MechanismGraph(6, [(0, 1), (1, 2), (0, 2), (0, 3), (3, 4), (4, 5), (5, 0)], frame=0),
            [1],
            "over-constrained",
            "links 2 have too many constraints with these drivers, and links 3, 4, 5 remain free",
        ),
        (
            # Four links in a complete graph waste three constraints, which the count hides.
            MechanismGraph(5, list(itertools.combinations(range(1, 5), 2)), frame=0),
            [],
            "over-constrained",
            "among themselves",
        ),
        (
            # Three drivers in a loop, which floats; the count of freedoms hides it.
            MechanismGraph(4, [(0, 1), (1, 2), (0, 2)], frame=3),
            [(1, 2), (0, 1), (0, 2)],
            "over-constrained",
            "links 0, 1, 2 have too many constraints with these drivers",
        ),
    ],
)
def test_faults_name_the_links(graph, drivers, kind, message):
    fault = find_fault(graph, drivers)
    assert fault.kind == kind
    assert message in fault.message
    with pytest.raises(GraphError) as caught:
        decompose(graph, drivers)
    assert str(caught.value) == fault.message


def test_wrong_drivers():
    with pytest.raises(GraphError, match="no joint"):
        decompose(FOUR_BAR, [2])
    with pytest.raises(GraphError, match="no joint"):
        decompose(FOUR_BAR, [(1, 9)])
    with pytest.raises(GraphError, match="twice"):
        decompose(FOUR_BAR, [1, (0, 1)])
    with pytest.raises(GraphError, match="frame"):
        decompose(FOUR_BAR.without_frame(), [1])
    with pytest.raises(GraphError, match="frame"):
        is_assur_group(FOUR_BAR.without_frame())


# --- brute force: the definition, subset by subset


def brute_groups(graph, driver):
    """Groups by trying all subsets of the links not yet placed, smallest first."""
    placed = {0, driver}
    left = set(range(graph.links)) - placed
    groups = []
    while left:
        minimal = None
        for size in range(1, len(left) + 1):
            for chosen in map(set, itertools.combinations(sorted(left), size)):
                touching = [m for a, b, m in graph.joints if {a, b} & chosen and {a, b} <= chosen | placed]
                if graph.space * size == sum(graph.space - m for m in touching):
                    minimal = chosen
                    break
            if minimal:
                break
        if minimal is None:
            return None
        groups.append(tuple(sorted(minimal)))
        placed |= minimal
        left -= minimal
    return groups


def random_mechanism(rng):
    """A random mechanism of mobility 1 with a crank 0-1, planar, lower and higher pairs."""
    while True:
        links = rng.randint(3, 8)
        pairs = [pair for pair in itertools.combinations(range(links), 2) if pair != (0, 1)]
        rng.shuffle(pairs)
        joints, mobility = [(0, 1, 1)], 3 * (links - 1) - 2
        for pair in pairs:
            if mobility <= 1:
                break
            m = 2 if mobility == 2 or rng.random() < 0.3 else 1
            joints.append((*pair, m))
            mobility -= 3 - m
        graph = MechanismGraph(links, joints, frame=0)
        if mobility == 1 and graph.rigid_subchain() is None:
            return graph


def test_decomposition_against_all_subsets():
    rng = random.Random(31)
    several = 0
    for _ in range(300):
        graph = random_mechanism(rng)
        expected = brute_groups(graph, 1)
        assert expected is not None
        fault = find_fault(graph, [1])
        assert fault is None, fault
        found = decompose(graph, [1])
        assert sorted(g.links for g in found.groups) == sorted(expected)
        several += len(expected) > 1
        placed = set(found.driven)
        for group in found.groups:
            assert all(
                (j.a in placed) != (j.b in placed) and {j.a, j.b} <= placed | set(group.links) for j in group.outer
            )
            assert all({j.a, j.b} <= set(group.links) for j in group.inner)
            placed |= set(group.links)
            # 3 n = 2 p1 + p2 for each group.
            assert 3 * len(group.links) == sum(3 - j.mobility for j in (*group.inner, *group.outer))
        assert placed == set(range(graph.links))
    assert several > 100


def brute_stages(graph, driver):
    """Links, stage and order of every group: in each round all smallest sets that what is placed already places."""
    placed, found, stage = {0, driver}, [], 0
    while len(placed) < graph.links:
        stage += 1
        left, now = sorted(set(range(graph.links)) - placed), []
        for size in range(1, len(left) + 1):
            for chosen in map(set, itertools.combinations(left, size)):
                if any(smaller <= chosen for smaller, _ in now):
                    continue
                inner = [m for a, b, m in graph.joints if {a, b} <= chosen]
                outer = [m for a, b, m in graph.joints if len({a, b} & chosen) == 1 and {a, b} & placed]
                if graph.space * size == sum(graph.space - m for m in inner + outer):
                    now.append((chosen, len(outer)))
        found += [(tuple(sorted(chosen)), stage, order) for chosen, order in now]
        placed |= set().union(*(chosen for chosen, _ in now))
    return found


def test_stage_and_order_of_groups_against_all_subsets():
    rng = random.Random(33)
    stages = []
    for _ in range(300):
        graph = random_mechanism(rng)
        groups = decompose(graph, [1]).groups
        assert sorted((g.links, g.stage, g.order) for g in groups) == sorted(brute_stages(graph, 1))
        # of the groups that could come next, the one with the smallest link comes first
        left, placed = list(groups), {0, 1}
        while left:
            ready = [g for g in left if {end for j in g.outer for end in j[:2]} <= placed | set(g.links)]
            assert left[0] == min(ready, key=lambda g: g.links)
            placed |= set(left.pop(0).links)
        stages += [g.stage for g in groups]
    assert stages.count(2) > 50 and stages.count(3) > 10 and max(stages) > 3


def test_decomposition_does_not_depend_on_labels():
    rng = random.Random(32)
    for _ in range(100):
        graph = random_mechanism(rng)
        permutation = [0, *(1 + i for i in rng.sample(range(graph.links - 1), graph.links - 1))]
        found = decompose(graph, [1])
        other = decompose(graph.relabelled(permutation), [permutation[1]])
        mapped = sorted((tuple(sorted(permutation[i] for i in g.links)), g.group_class, g.order) for g in found.groups)
        assert mapped == sorted(summary(other))


def brute_truss(graph):
    def dof(chosen):
        inside = [m for a, b, m in graph.joints if a in chosen and b in chosen]
        return graph.space * (len(chosen) - 1) - sum(graph.space - m for m in inside)

    links = range(graph.links)
    proper = (set(s) for size in range(2, graph.links) for s in itertools.combinations(links, size))
    return dof(set(links)) == 0 and all(dof(s) >= 1 for s in proper)


def test_truss_against_all_subsets_and_groups_whichever_frame():
    rng = random.Random(33)
    found = 0
    for _ in range(600):
        links = rng.choice((3, 5, 5, 7))
        joints = rng.sample(list(itertools.combinations(range(links), 2)), 3 * (links - 1) // 2)
        graph = MechanismGraph(links, joints)
        expected = brute_truss(graph)
        found += expected
        assert is_baranov_truss(graph) == expected
        assert is_assur_group(graph.with_frame(rng.randrange(links))) == expected
    assert found > 20


def test_a_group_of_class_four():
    group = MechanismGraph(5, [(1, 2), (2, 3), (3, 4), (4, 1), (1, 0), (3, 0)], frame=0)
    assert is_assur_group(group)
    assert summary(decompose(group, [])) == [((1, 2, 3, 4), 4, 2)]


def test_contours_count_higher_pairs_as_a_link():
    # Two links with a gear contact and a pin each to the frame and to a third: loop of 3 joints, one of them higher.
    assert contour_class([(1, 2, 1), (2, 3, 1), (1, 3, 2), (1, -1, 1), (2, -1, 1)]) == 4
