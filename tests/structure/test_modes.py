"""Assembly modes counted: beside published numbers, a recursion over bars, and paths followed in floating point."""

import itertools
import math
from collections import Counter
from functools import cache

import numpy as np
import pytest

from graphsynth import (
    Mechanism,
    MechanismGraph,
    MultipleJointChain,
    count_assembly_modes,
    coupler_curve_degree,
    coupler_curve_genus,
    enumerate_baranov_trusses,
    enumerate_chains,
    enumerate_multiple_joint_chains,
)
from graphsynth.core.errors import GraphError
from graphsynth.structure.assur import decompose
from graphsynth.structure.matroids import count_modes, fill_ranks


def number_of(bodies, body, pin):
    """What the kernels count where ``body[k]`` holds ``pin[k]``: any number of pins, and of bodies at a pin."""
    ranks = np.empty(1 << bodies, dtype=np.int8)
    fill_ranks(bodies, np.array(body), np.array(pin), ranks)
    keys, counts = (np.empty(1 << 16, dtype=np.int64) for _ in range(2))
    return count_modes(bodies, ranks, (1 << bodies) - 1, 0, 0, keys, counts, np.empty((bodies + 1, 5), dtype=np.int64))


PRISM = [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)]


@pytest.mark.parametrize(
    ("bars", "number"),
    [
        ([(0, 1)], 1),
        ([(0, 1), (1, 2), (0, 2)], 2),
        ([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3)], 4),
        (PRISM, 24),
        ([(a, b) for a in (0, 1, 2) for b in (3, 4, 5)], 16),
    ],
    ids=["bar", "triangle", "two triangles", "prism", "K33"],
)
def test_numbers_of_bar_frameworks_are_those_published(bars, number):
    """Capco and others (2018), section 1 and table 1: 24 is the most of six points."""
    assert number_of(len(bars), np.repeat(np.arange(len(bars)), 2), np.array(bars).reshape(-1)) == number


def bars_of(truss):
    """Joints as points, links of k joints as triangles in a row: each of k - 2 points has two places on its link."""
    at = {link: [] for link in range(truss.links)}
    for point, joint in enumerate(truss.joints):
        at[joint.a].append(point)
        at[joint.b].append(point)
    return bars_between(at.values())


def bars_between(bodies):
    """Bars that hold the points of each body together, and how many of them are free to be mirrored."""
    bars, doubled = [], 0
    for first, second, *others in bodies:
        bars += [(first, second), *((end, point) for point in others for end in (first, second))]
        doubled += len(others)
    return tuple(bars), doubled


def named_anew(bars):
    names = {}
    return tuple((names.setdefault(a, len(names)), names.setdefault(b, len(names))) for a, b in bars)


def rank_of(bars):
    parent = {}

    def root(point):
        while parent.setdefault(point, point) != point:
            point = parent[point]
        return point

    found = 0
    for a, b in bars:
        found += root(a) != root(b)
        parent[root(a)] = root(b)
    return found


@cache
def laman(one, two):
    """Count for two multigraphs with common edges: one edge is in either part of a cut, and contracted in both."""
    if any(a == b for a, b in one + two):
        return 0
    if len(one) == 1:
        return 1
    total = 0
    edges = range(1, len(one))
    for size in range(len(one)):
        for chosen in itertools.combinations(edges, size):
            large = (0, *chosen)
            small = (0, *(k for k in edges if k not in chosen))
            parts = ((one, two, large, small[1:]), (two, one, small, large[1:]))
            product = 1
            for contracted, kept, inside, left in parts:
                if product and left:
                    parent = list(range(2 * len(one) + 2))
                    for k in inside:
                        a, b = (parent[v] for v in contracted[k])
                        parent = [a if v == b else v for v in parent]
                    sides = (
                        named_anew((parent[contracted[k][0]], parent[contracted[k][1]]) for k in left),
                        named_anew(kept[k] for k in left),
                    )
                    product *= laman(*sides) if sum(map(rank_of, sides)) == len(left) + 1 else 0
            total += product
    return total


@pytest.mark.parametrize("links", [3, 5])
def test_trusses_beside_the_recursion_over_bars(links):
    """The published recursion, by all subsets of bars, with two places for each further point of a link."""
    for truss in enumerate_baranov_trusses(links):
        bars, doubled = bars_of(truss)
        assert count_assembly_modes(truss) << doubled == laman(named_anew(bars), named_anew(bars))


@pytest.mark.parametrize(
    ("links", "most", "found"),
    [
        (6, 9, {4: 13, 6: 1}),
        pytest.param(8, 9, {8: 495, 12: 180, 14: 41, 16: 38, 18: 7}, marks=pytest.mark.long),
        pytest.param(8, 11, {8: 495, 12: 180, 14: 41, 16: 38, 18: 7}, marks=pytest.mark.slow),
    ],
)
def test_mechanisms_with_multiple_joints_beside_the_recursion_over_bars(links, most, found):
    """Frame and driven link are one body; a joint is a point, whatever the number of links on it."""
    numbers, compared = Counter(), Counter()
    for chain in enumerate_multiple_joint_chains(links, framed=True):
        for driver in (link for link in range(1, links) if chain.neighbours[0] >> link & 1):
            number = count_assembly_modes(chain, [driver])
            bodies = [{0, driver}, *({link} for link in range(links) if link not in (0, driver))]
            joints = [set(joint) for joint in chain.joints]
            bars, doubled = bars_between(
                [[k for k, joint in enumerate(joints) if body & joint and joint - body] for body in bodies]
            )
            if len(bars) <= most:
                assert number << doubled == laman(named_anew(bars), named_anew(bars)), (chain, driver)
                compared[number] += 1
            numbers[number] += 1
    assert numbers == found and set(compared) >= {min(found)} and compared.total() >= 14


def test_multiple_joints_of_two_links_are_simple_ones():
    for chain in enumerate_chains(8):
        mechanism = chain.with_frame(0)
        for driver in mechanism.levels[1]:
            same = count_assembly_modes(MultipleJointChain(mechanism, 0), [(driver, 0)])
            assert same == count_assembly_modes(mechanism, [driver])
    triangle = MultipleJointChain.from_joints(3, [(0, 1), (1, 2), (0, 2)])
    assert count_assembly_modes(triangle) == 2
    star = MultipleJointChain.from_joints(6, [(0, 1, 2), (0, 3), (1, 4), (2, 5), (3, 4), (3, 5)], frame=0)
    for drivers, said in (([], "takes as many drivers"), ([4], "share no joint"), ([7], "share no joint")):
        with pytest.raises(GraphError, match=said):
            count_assembly_modes(star, drivers)
    two = next(enumerate_multiple_joint_chains(7, 2, framed=True))
    with pytest.raises(GraphError, match="are held already"):
        count_assembly_modes(two, [(0, two.joints[0][1])] * 2)


def loops(pairs, bodies, draw):
    """Equations of closed loops for unit vectors and for their inverses, with random complex dimensions, unlike."""
    tree = {0: []}  # ways to each body: pins, and the bodies before and behind
    for _ in range(bodies):
        for k, (a, b) in enumerate(pairs):
            if (a in tree) != (b in tree):
                a, b = (a, b) if a in tree else (b, a)
                tree[b] = [*tree[a], (k, a, b)]
    used = {step[0] for path in tree.values() for step in path}
    chords = [k for k in range(len(pairs)) if k not in used]
    for _ in range(2):
        pin = {(k, body): draw(1)[0] for k, pair in enumerate(pairs) for body in pair}
        rows = np.zeros((len(chords), bodies), dtype=complex)
        for row, k in zip(rows, chords):
            a, b = pairs[k]
            for sign, path in ((1.0, [*tree[a], (k, a, b)]), (-1.0, tree[b])):
                for j, here, there in path:  # the origin of each body is where: out at one pin, in at the other
                    row[here] += sign * pin[j, here]
                    row[there] -= sign * pin[j, there]
        yield rows


def complex_numbers(seed):
    rng = np.random.default_rng(seed)
    return lambda *shape: rng.normal(size=shape) + 1j * rng.normal(size=shape)


def followed(pairs, bodies, seed):
    """Solutions with random dimensions, complex and unlike their conjugates, by paths from products of linear forms."""
    draw, columns = complex_numbers(seed), len(pairs) - bodies + 1
    spaces = [np.linalg.svd(rows)[2][columns:].conj().T for rows in loops(pairs, bodies, draw)]
    r = bodies - columns
    patches, gamma = draw(2, r), draw(1)[0]
    forms = draw(2, bodies - 1, r)

    def system(s, t, tau):
        x, y = spaces[0] @ s, spaces[1] @ t
        f, g = forms[0] @ s, forms[1] @ t
        value = tau * (x[1:] * y[1:] - x[0] * y[0]) + (1.0 - tau) * gamma * f * g
        ds = tau * (y[1:, None] * spaces[0][1:] - y[0] * spaces[0][0]) + (1.0 - tau) * gamma * g[:, None] * forms[0]
        dt = tau * (x[1:, None] * spaces[1][1:] - x[0] * spaces[1][0]) + (1.0 - tau) * gamma * f[:, None] * forms[1]
        slope = (x[1:] * y[1:] - x[0] * y[0]) - gamma * f * g
        jacobian = np.zeros((bodies + 1, 2 * r), dtype=complex)
        jacobian[:-2, :r], jacobian[:-2, r:] = ds, dt
        jacobian[-2, :r], jacobian[-1, r:] = patches
        return np.append(value, [patches[0] @ s - 1.0, patches[1] @ t - 1.0]), jacobian, np.append(slope, [0.0, 0.0])

    ends = []
    for chosen in itertools.combinations(range(bodies - 1), r - 1):
        other = [k for k in range(bodies - 1) if k not in chosen]
        one = np.append(np.zeros(r - 1), 1.0)
        s = np.linalg.solve(np.vstack([forms[0][list(chosen)], patches[0]]), one)
        t = np.linalg.solve(np.vstack([forms[1][other], patches[1]]), one)
        z, tau, step = np.concatenate([s, t]), 0.0, 1e-3
        while tau < 1.0 - 1e-9 and step > 1e-13:
            step = min(step, 1.0 - tau)
            _, jacobian, slope = system(z[:r], z[r:], tau)
            trial = z - step * np.linalg.solve(jacobian, slope)
            for _ in range(3):
                value, jacobian, _ = system(trial[:r], trial[r:], tau + step)
                move = np.linalg.solve(jacobian, value)
                trial = trial - move
            if np.abs(move).max() < 1e-9 * np.abs(trial).max():
                z, tau, step = trial, tau + step, 1.5 * step
            else:
                step *= 0.4
        unit_vectors = spaces[0] @ z[:r]
        ends.append((abs(unit_vectors[0] * (spaces[1] @ z[r:])[0]), unit_vectors))
    return ends


@pytest.mark.parametrize("links", [5, pytest.param(7, marks=pytest.mark.long), pytest.param(9, marks=pytest.mark.slow)])
def test_trusses_beside_paths_of_random_dimensions(links):
    """As many paths as two spaces of general directions have solutions; those that do not end at infinity count."""
    for number, truss in enumerate(itertools.islice(enumerate_baranov_trusses(links), 0, None, 9 if links == 9 else 1)):
        ends = followed([(joint.a, joint.b) for joint in truss.joints], links, number)
        assert len(ends) == math.comb(links - 1, (links - 1) // 2)
        finite = [unit_vectors for size, unit_vectors in ends if size > 1e-4]
        for here, there in itertools.combinations(range(links), 2):  # no mode has the direction of another anywhere
            turned = np.array([unit_vectors[here] / unit_vectors[there] for unit_vectors in finite])
            assert np.abs(np.subtract.outer(turned, turned) + np.eye(len(turned))).min() > 1e-6 * np.abs(turned).min()
        assert len(finite) == count_assembly_modes(truss)


def test_all_trusses_of_nine_links():
    """The recursion over bars and the program of its authors give these, too."""
    numbers = sorted(map(count_assembly_modes, enumerate_baranov_trusses(9)))
    assert numbers == [
        *(30, 36, 38, 40, 40, 40, 42, 42, 42, 44, 44, 46, 46, 46, 48, 48, 48, 48, 48, 50, 50, 50, 52, 52, 54, 54, 56),
        58,
    ]


def test_the_whole_counts_as_its_groups_do():
    """A driver that is held makes one body of two links: all bodies at once, and group by group."""
    seen = set()
    for links in (4, 6, 8):
        for chain, driver in ((own, joint) for own in enumerate_chains(links) for joint in own.joints):
            body = [k - (k > driver.b) if k != driver.b else driver.a for k in range(links)]
            held = [(body[joint.a], body[joint.b]) for joint in chain.joints if joint != driver]
            whole = number_of(links - 1, np.array(held).reshape(-1), np.repeat(np.arange(len(held)), 2))
            graph = MechanismGraph(links, chain.joints, frame=driver.a)
            assert count_assembly_modes(graph, [driver.b]) == whole
            if decompose(graph, [driver.b]).dyadic:
                assert whole == 2 ** (links // 2 - 1)
            seen.add(whole)
    assert seen == {2, 4, 6, 8, 12, 14, 16, 18}


def test_names_of_links_do_not_matter():
    rng = np.random.default_rng(2)
    for truss in itertools.islice(enumerate_baranov_trusses(9), 0, 28, 5):
        names = rng.permutation(9).tolist()
        other = MechanismGraph(9, [(names[joint.a], names[joint.b]) for joint in truss.joints])
        assert count_assembly_modes(other) == count_assembly_modes(truss)


def test_a_dyad_more_doubles_the_number():
    for truss in enumerate_baranov_trusses(7):
        pairs = [(joint.a, joint.b) for joint in truss.joints]
        grown = MechanismGraph(9, [*pairs, (0, 7), (7, 8), (8, 4)])
        assert count_assembly_modes(grown) == 2 * count_assembly_modes(truss)


def test_a_link_too_many_leaves_none():
    """Two triangles on one side of a bar: one loop with two freedoms, one with none left."""
    crowded = [(0, 1), (1, 2), (2, 0), (0, 3), (3, 1), (2, 3), (4, 5), (5, 6), (6, 0), (4, 0)]
    graph = MechanismGraph(7, [*crowded[:9]])
    assert graph.mobility == 0 and count_assembly_modes(graph) == 0


def test_assemblies_that_are_found_are_no_more():
    from graphsynth.mechanism import gallery

    for mechanism in (Mechanism.four_bar(2, 1, 2.5, 2.5), gallery.jansen(), gallery.stephenson_six_bar()):
        drivers = [driver.pair for driver in mechanism.drivers]
        assert 0 < len(mechanism.modes("30 deg")) <= count_assembly_modes(mechanism.graph, drivers)


def test_degrees_of_coupler_curves_are_those_published():
    """Sextics of four-bars; 14, 16 and 18 of six-bars (Primrose, Freudenstein and Roth 1967)."""
    degrees = set()
    for chain in enumerate_chains(6):
        for frame in range(6):
            mechanism = chain.with_frame(frame)
            degrees |= {coupler_curve_degree(mechanism, link) for link in range(6) if link != mechanism.frame}
    assert degrees == {2, 6, 14, 16, 18}  # circles and sextics of what is a four-bar already


def solved(value, jacobian, z):
    """Newton's method for rows of starts: the different ends, where it comes to one."""
    for _ in range(60):
        with np.errstate(all="ignore"):  # many starts end nowhere
            step = np.linalg.solve(jacobian(z), value(z)[..., None])[..., 0]
            step *= np.minimum(1.0, 0.5 * np.abs(z).max(1) / np.abs(step).max(1))[:, None]
            z = z - step
            fine = np.isfinite(z).all(1) & (np.abs(z).max(1) < 1e6)
        z, step = z[fine], step[fine]
    z = z[np.abs(step).max(1) < 1e-10 * np.abs(z).max(1)]
    return different(z)


def different(z):
    ends = z[:0]
    while len(z):
        ends = np.concatenate([ends, z[:1]])
        z = z[np.abs(z - z[0]).max(1) > 1e-6 * np.abs(z[0]).max()]
    return ends


def dead_centres(graph, driver, seed):
    """Count the dead centres of a driven link with random complex dimensions, from random starts."""
    n, draw = graph.links, complex_numbers(seed)
    one, two = loops([(joint.a, joint.b) for joint in graph.joints], n, draw)
    others = [k for k in range(n) if k not in (graph.frame, driver)]
    moving = [driver, *others]
    norm = draw(n - 2)

    def parts(z):  # unit vectors of moving links, the driver's first, and a motion of the others where it stands
        x, v = z[:, : n - 1], z[:, n - 1 :]
        first = one[:, graph.frame] + x @ one[:, moving].T
        second = two[:, graph.frame] + (1.0 / x) @ two[:, moving].T
        return x, v, np.concatenate([first, second], axis=1)

    def value(z):
        x, v, closed = parts(z)
        still = np.concatenate([v @ one[:, others].T, (v / x[:, 1:] ** 2) @ two[:, others].T], axis=1)
        return np.concatenate([closed, still, (v @ norm - 1.0)[:, None]], axis=1)

    def jacobian(z):
        x, v, _ = parts(z)
        rows, m = len(one), n - 1
        found = np.zeros((len(z), 2 * m - 1, 2 * m - 1), dtype=complex)
        found[:, :rows, :m] = one[:, moving]
        found[:, rows : 2 * rows, :m] = -two[:, moving] / x[:, None] ** 2
        found[:, 2 * rows : 3 * rows, m:] = one[:, others]
        found[:, 3 * rows : 4 * rows, m:] = two[:, others] / x[:, None, 1:] ** 2
        found[:, 3 * rows : 4 * rows, 1:m] = -2.0 * two[:, others] * (v / x[:, 1:] ** 3)[:, None]
        found[:, -1, m:] = norm
        return found

    ends = np.empty((0, 2 * n - 3), dtype=complex)
    idle = 0
    while idle < 4:  # batches of starts that end where others have ended
        starts = draw(2000, 2 * n - 3) * np.exp(draw(2000, 2 * n - 3).real)
        more = different(np.concatenate([ends, solved(value, jacobian, starts)]))
        idle = 0 if len(more) > len(ends) else idle + 1
        ends = more
    return len(ends)


def goes_round(graph, driver, modes, seed):
    """Whether all assembly modes change into one another when the driven link goes round in complex numbers."""
    n, draw = graph.links, complex_numbers(seed)
    one, two = loops([(joint.a, joint.b) for joint in graph.joints], n, draw)
    others = [k for k in range(n) if k not in (graph.frame, driver)]

    def system(at):
        fixed = [own[:, graph.frame] + factor * own[:, driver] for own, factor in ((one, at), (two, 1.0 / at))]
        return (
            lambda x: np.concatenate(
                [fixed[0] + x @ one[:, others].T, fixed[1] + (1.0 / x) @ two[:, others].T], axis=1
            ),
            lambda x: np.concatenate(
                [np.broadcast_to(one[:, others], (len(x), *one[:, others].shape)), -two[:, others] / x[:, None] ** 2],
                axis=1,
            ),
        )

    begin = draw(1)[0]
    first = solved(*system(begin), draw(2000, n - 2) * np.exp(draw(2000, n - 2).real))
    assert len(first) == modes
    reached, every = {0}, set(range(modes))
    for _ in range(30):
        corners = [begin, *draw(3), begin]
        x = first
        for at in np.concatenate([np.linspace(a, b, 400)[1:] for a, b in itertools.pairwise(corners)]):
            value, jacobian = system(at)
            x = x - np.linalg.solve(jacobian(x), value(x)[..., None])[..., 0]
            if not 1e-6 < np.abs(x).min() <= np.abs(x).max() < 1e6:
                break
        to = np.abs(x[:, None] - first).max(2)
        if sorted(to.argmin(1)) == sorted(every) and to.min(1).max() < 1e-3:  # none has jumped
            reached |= {int(to[k].argmin()) for k in reached}
        if reached == every:
            return True
    return False


@pytest.mark.long
@pytest.mark.parametrize("links", [4, pytest.param(6, marks=pytest.mark.slow)])
def test_genus_beside_dead_centres(links):
    """A driven link has d assembly modes, which are one curve; they meet at 2 g - 2 + 2 d dead centres (Hurwitz)."""
    seen = set()
    for chain in enumerate_chains(links):
        mechanisms = [MechanismGraph(links, chain.joints, frame=frame) for frame in range(links)]
        genus = max(coupler_curve_genus(own, k) for own in mechanisms for k in range(links) if k != own.frame)
        for joint in chain.joints:
            mechanism, driver = mechanisms[joint.a], joint.b
            modes = count_assembly_modes(mechanism, [driver])
            if (modes, genus) not in seen:
                assert dead_centres(mechanism, driver, 0) == 2 * genus - 2 + 2 * modes
                assert goes_round(mechanism, driver, modes, 0)
            seen.add((modes, genus))
    assert seen == ({(2, 1)} if links == 4 else {(4, 5), (4, 7), (6, 7)})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: count_assembly_modes(MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0), [1]), "mobility 2"),
        (lambda: count_assembly_modes(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], space=6)), "plane"),
        (lambda: count_assembly_modes(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])), "frame"),
        (lambda: coupler_curve_degree(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]), 2), "frame"),
        (lambda: coupler_curve_degree(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), 0), "moving"),
    ],
)
def test_what_is_no_question_is_refused(call, words):
    with pytest.raises(GraphError, match=words):
        call()
