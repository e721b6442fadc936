"""What kernels are asked one by one: what they lay out, with little room, past their bounds, and graph by graph."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from itertools import combinations, combinations_with_replacement, permutations, product
from math import prod
from typing import Any
from unittest import mock

import networkx as nx
import numpy as np

import graphsynth
from graphsynth import StructuralSpec
from graphsynth.structure.kernels import canon_workspace
from graphsynth.synthesis import families as fam
from graphsynth.synthesis.chunks import Chunk
from graphsynth.synthesis.contracted import contracted_graphs
from graphsynth.synthesis.kernels import (
    colouring,
    counting,
    covers,
    gears,
    growing,
    layout as lay,
    listing,
    moving,
    splitting,
    variables,
)
from graphsynth.synthesis.rigid_blocks import identity_sums

__all__ = ["of_the_kernels"]

TOO_LARGE = counting.TOO_LARGE
Question = tuple[str, Callable[[], Any], Any]


def of_the_kernels() -> list[Question]:
    """Name, question and answer; each compares a kernel with what it says it does, or with trying everything."""
    return [
        ("states are stored", _stored, [8, [20 + i for i in range(8)], -1, [1, 2, 3, 4, 5, 6, 7, 8, -1]]),
        ("critical sets", _critical, True),
        ("needs of links and loops", _covered, True),
        ("laid out", _laid_out, True),
        ("many sets", lambda: [_of_each(k, at) for k, at in MANY], [_tried(k, at) for k, at in MANY]),
        ("few rows", _few_rows, True),
        ("parts of a graph", _parts, True),
        ("no room", _no_room, True),
        ("past 2**62", _past, [2**61, TOO_LARGE, 2**62, TOO_LARGE, 2**62, TOO_LARGE]),
        ("pairs of frame and symmetry", _pairs, True),
        ("coloured graphs", _coloured, True),
        ("few codes", _few_codes, True),
        ("texts", _texts, True),
        ("level of the frame", _first_level, 71),
        ("listed multiple joints", _multiple, [18, 3, 1]),
        ("identities", _identities, True),
        ("splits one by one", _splits, True),
        ("canonical pair", _canonical_pair, [1, 1]),
        ("links of trains renumbered", _renumbered, [6, 6, 6, 27, 27, 27, 2, 2, 2]),
    ]  # fmt: skip


#: Contracted graphs of twelve links with more critical sets than a word has bytes: vertices, and numbers in the list.
MANY = [(5, 4), (6, 4), (7, 4)]
#: Wishes: a link with three joints jointed to one with four, and none jointed to another one with three.
PAIRS = 3 + (4 << 4), 3 + (3 << 4) + (1 << 8)


def _family(links: int, vertices: int, mobility: int = 1, space: int = 3, **more: Any) -> fam.Family:
    lower = fam.chain_families(links, mobility, space, more.pop("higher", {}), bool(more.pop("framed", False)))
    return fam.replace(next(one for one in lower if one.vertices == vertices), **more)


@cache
def _room(resources: int) -> lay.Work:
    return lay.make_work(resources, key_words=1 << 12)


def _work(family: fam.Family, **changed: Any) -> lay.Work:
    return _room(max(256, family.edge_labels.resources))._replace(**changed)


def _stored() -> list[Any]:
    """Store states twice in a table of few slots, layer upon layer, until it is full."""
    keys, states = np.zeros(32, np.uint64), np.zeros((3, 16), np.int64)
    for layer, shift in ((1, 0), (2, 16)):
        number = 0
        for turn in (0, 1):
            for i in range(8):
                key = np.array([7 * i, 64 - i], np.uint64)
                number = counting._store(key, 2, number, layer, shift, 10 * turn + 5 + i // 2 * turn, keys, states)
                if not turn and number != i + 1:
                    return [layer, i]
        sums = states[lay.SUM, shift // 2 : shift // 2 + 8]
        if [*keys[shift : shift + 16]] != [x for i in range(8) for x in (7 * i, 64 - i)]:
            return [layer, "keys"]
        if [*sums] != [20 + i // 2 for i in range(8)]:
            return [layer, "sums"]
    sums += np.arange(8) - np.arange(8) // 2
    full = counting._store(np.ones(2, np.uint64), 2, 8, 2, 16, 1, keys, states)
    return [number, sums.tolist(), full, _crowded(keys)]


def _crowded(keys: Any) -> list[int]:
    """Store eight states that all begin at even slots, and one more."""
    chosen, numbers = [], [0]
    for i in range(64):
        states, key = np.zeros((3, 16), np.int64), np.array([i, 1], np.uint64)
        counting._store(key, 2, 0, 1, 0, 1, keys, states)
        if not np.flatnonzero(states[lay.STAMP]).item() % 2:
            chosen.append(key)
    states = np.zeros((3, 16), np.int64)
    for key in chosen[:9]:
        numbers.append(counting._store(key, 2, numbers[-1], 1, 0, 1, keys, states))
    return numbers[1:]


def _links(mask: int, k: int) -> list[int]:
    return [v for v in range(k) if mask >> v & 1]


def _wanted_sets(k: int, mult: Any, heaviest: Any, space: int) -> list[tuple[int, int]]:
    """Vertex sets that need something and more than each of their proper subsets; by their definition."""
    pins = sum(1 << v for v in range(k) if mult[v, v])
    need = {}
    for u in range(1, (1 << k) - (not pins)):
        inside = _links(u, k)
        if len(inside) < 2:
            continue
        multiple = [v for v in inside if pins >> v & 1]
        weight = sum(int(heaviest[mult[a, b]]) for a, b in combinations(inside, 2) if mult[a, b])
        need[u] = weight - (space * (len(inside) - 1) - 1 - len(multiple))
        between = any(mult[a, b] >> lay.KIND_SHIFT == lay.BETWEEN_PINS for a, b in combinations(multiple, 2))
        links = len(inside) - len(multiple)
        if multiple and links < 2 and (len(inside) == 2 or (links and not between)):  # labels alone tell
            need[u] = 0
    return [(u, n) for u, n in need.items() if n > 0 and all(need[t] < n for t in need if t & u == t and t != u)]


def _critical() -> bool:
    """Tell whether critical sets are those that need more than their subsets, with and without multiple joints."""
    asked = [_family(12, k) for k in (4, 5, 6, 7)] + [_family(9, 4, 2), _family(7, 5, space=2)]
    asked += [one for pins in (1, 2, 3) for one in fam.multiple_joint_families(10, 1, pins, False)]
    for family in asked:
        tables, work, k = family.edge_labels.tables, _work(family), family.vertices
        for mult in family.graphs[:: 1 + len(family.graphs) // 12]:
            m, sets = variables.load_graph(k, mult, tables, work)
            wanted = _wanted_sets(k, mult, tables.heaviest, tables.space)
            if [*zip(work.sets[lay.LEFT, :sets].tolist(), work.sets[lay.NEED, :sets].tolist())] != wanted:
                return False
            inside = [
                sum(1 << e for e in range(m) if {*work.classes[: lay.V + 1, e].tolist()} <= {*_links(u, k)})
                for u, _ in wanted
            ]
            if work.sets[lay.MASK, :sets].tolist() != inside:
                return False
            small = work._replace(sets=np.zeros((5, max(0, sets - 1)), np.int64))
            if sets and variables.load_graph(k, mult, tables, small)[1] != -1:
                return False
            if variables.load_graph(k, mult, tables, work._replace(sets=np.zeros((5, sets), np.int64)))[1] != sets:
                return False
    return True


def _covered() -> bool:
    """Tell whether links with few joints, pairs of links, and short loops are found, by the loops of a library."""
    some, none = PAIRS
    asked = [
        fam.replace(_family(10, k), higher=((fam.SLIDER, sliders),), rules=rules)
        for sliders, rules, k in product((1, 3), (1, 2, 3), (3, 4, 5))
    ]
    asked += [
        fam.replace(_family(10, k), rules=(pairs << lay.PAIRS) + (girth << lay.GIRTH))
        for girth, pairs, k in product((0, 4, 5), (some, none, some + (none << lay.PAIR)), (3, 4, 5))
    ]
    for family in asked:
        tables, k, work = family.edge_labels.tables, family.vertices, _work(family)
        for mult in family.graphs:
            critical = len(_wanted_sets(k, mult, tables.heaviest, tables.space))
            if variables.load_graph(k, mult, tables._replace(rules=np.int64(0)), work)[1] != critical:
                return False
            work.sets[:] = 77
            sets, start = variables.load_graph(k, mult, tables, work)[1], (critical + 7) // 8 * 8
            wanted = _wanted_needs(k, mult, family.rules, int(tables.sliders), work.class_of)
            found = work.sets[[lay.NEED, lay.VERTEX, lay.CYCLE], start:sets].T.tolist()
            if sorted((need, v, cycle if v < 0 else 0) for need, v, cycle in found) != wanted:
                return False
            if work.sets[lay.MASK, critical:sets].any() or work.sets[lay.NEED, critical:start].any():
                return False
            rooms = [critical - 1] * (critical > 0) + ([sets - 1, sets] if wanted else [])
            for room in rooms:
                small = work._replace(sets=np.zeros((5, room), np.int64))
                if variables.load_graph(k, mult, tables, small)[1] != (sets if room == sets else -1):
                    return False
    return True


def _wanted_needs(k: int, mult: Any, rules: int, sliders: int, number: Any) -> list[tuple[int, int, int]]:
    """(need, vertex, classes) of links, pairs of links and loops."""
    degrees = mult.sum(axis=1, dtype=int).tolist()
    graph = nx.from_numpy_array((mult > 0).astype(int))
    found: list[tuple[int, int, int]] = []
    if rules & lay.NO_SLIDING_LINK:
        found += [(1, v, 0) for v in range(k) if degrees[v] <= sliders]
    pairs, girth = rules >> lay.PAIRS, rules >> lay.GIRTH & lay.LONGEST
    while pairs:
        ends, apart = {pairs & 15, pairs >> 4 & 15}, pairs >> 8 & 1
        classes = [1 << int(number[a, b]) for a, b in graph.edges if {degrees[a], degrees[b]} == ends]
        found.append((len(classes) if apart else 1, lay.APART if apart else lay.JOINTED, sum(classes)))
        pairs >>= lay.PAIR
    if rules & lay.NO_SLIDING_LOOP or girth:
        for cycle in nx.simple_cycles(graph, length_bound=sliders + 1):
            closed = zip(cycle, cycle[1:] + cycle[:1])
            found.append((max(2, girth), -1, sum(1 << int(number[a, b]) for a, b in closed)))
    return sorted(found)


def _laid_out() -> bool:
    """Tell whether variables, their choices, and what they can use up and give are what they are said to be."""
    asked = [_family(12, 6), _family(10, 6), _family(8, 3, framed=True), _family(9, 4, 2), _family(6, 2, higher={2: 2})]
    asked += [fam.replace(_family(8, k), higher=((fam.SLIDER, 2),), rules=3) for k in (3, 4)]
    asked += [fam.replace(_family(8, 4), higher=((fam.SLIDER, 3),), rules=1)]
    asked += [fam.replace(_family(10, 5), rules=5 << lay.GIRTH)]
    asked += [fam.replace(_family(10, 3), rules=pairs << lay.PAIRS) for pairs in PAIRS]
    for family in asked:
        tables, work, k = family.edge_labels.tables, _work(family), family.vertices
        for mult in family.graphs[4:5] if family.links == 12 else family.graphs[:3]:
            order = counting.automorphisms(k, mult, work.perms)
            for g in range(min(3, order) if k < 6 else order):
                m, sets = variables.load_graph(k, mult, tables, work)
                count = variables.build_variables(m, sets, work.perms[g], tables, work)
                entries = variables.plain_entries(count, tables, work)
                top = variables.unconstrained_ways(count, False, tables, work)
                variables.lay_gains(count, tables, work)
                if not (entries and _is_laid(m, sets, count, top, tables, work) and _bytes(sets, count, work)):
                    return False
    return True


def _digits(packed: Any) -> tuple[int, ...]:
    return tuple(int(packed) >> shift & 127 for shift in range(0, 56, 8))


def _is_laid(m: int, sets: int, count: int, top: float, tables: lay.Tables, work: lay.Work) -> bool:
    """Compare rows, entries, and the tables of ways and gains with those made of the choices one by one."""
    states = {_digits(packed): r for r, packed in enumerate(tables.resources[lay.DIGITS].tolist())}
    ways, gains = tables.resources[lay.FINAL].tolist(), [0] * len(states)
    choices = []
    for j in range(count - 1, -1, -1):
        own = [e for e in range(m) if work.classes[lay.VAR, e] == j]
        rep, size = min(own), len(own)
        masks = [sum(mask >> e & 1 for e in own) for mask in work.sets[lay.MASK, :sets].tolist()]
        rows = work.rows[:, work.variables[lay.ROW, j] : work.variables[lay.ROW, j + 1]].T.tolist()
        kind = 2 * work.classes[lay.KIND, rep] + work.variables[lay.OWN, j]
        groups = tables.groups[:, slice(*tables.group_kinds[:, kind])].T.tolist()
        cost = [tuple(size * d for d in _digits(packed)) for _, _, packed, _, _ in groups]
        fit = [all(a <= b for a, b in zip(c, _digits(tables.resources[lay.DIGITS, tables.target]))) for c in cost]
        wanted = [
            (int(work.classes[lay.HEAVIEST, rep]) - weight, size * index, size * packed, copies, cover)
            for (weight, index, packed, copies, cover), yes in zip(groups, fit)
            if yes
        ]
        place = slice(work.variables[lay.ENTRY, j], work.variables[lay.ENTRY, j + 1])
        found = work.entries[[lay.GAIN, lay.INDEX, lay.PACKED, lay.COPIES, lay.COVER], place].T.tolist()
        if rows != [[s, c] for s, c in enumerate(masks) if c] or [*map(tuple, found)] != wanted:
            return False
        choices.append(sum(copies for *_, copies, _ in wanted))
        factor = max(masks, default=0)
        now, most = [0] * len(states), [0] * len(states)
        for have, r in states.items():
            for gain, _, packed, copies, _ in wanted:
                rest = states.get(tuple(a - b for a, b in zip(have, _digits(packed))))
                if rest is not None and ways[rest]:
                    now[r] += copies * ways[rest]
                    most[r] = max(most[r], gains[rest] + factor * gain)
        ways, gains = now, most
        if work.tables[lay.WAYS, j, : len(ways)].tolist() != ways:
            return False
        if work.tables[lay.GAINS, j, : len(gains)].tolist() != gains:
            return False
    return top == float(prod(choices)) and not work.tables[lay.GAINS, count, : len(states)].any()


def _bytes(sets: int, count: int, work: lay.Work) -> bool:
    """Compare what each variable, and the later ones, give to each set with sums; also where a byte is just enough."""
    if not sets:
        return True
    words, plain = (sets + 7) // 8, int(work.state[covers.PLAIN])
    work.lanes[:], work.covers[:] = 3, 3
    coefs, rests = np.zeros((count, 8 * words), int), np.zeros((count, 8 * words), int)
    largest, later = int(work.sets[lay.NEED, :sets].max()), np.zeros(8 * words, int)
    given = np.zeros((count, int(work.state[covers.LAID_COVERS]), 8 * words), int)
    for j in range(count - 1, -1, -1):
        rests[j] = later
        most = work.entries[lay.GAIN, work.variables[lay.ENTRY, j] : work.variables[lay.ENTRY, j + 1]].max(initial=0)
        for q in range(work.variables[lay.ROW, j], work.variables[lay.ROW, j + 1]):
            coefs[j, work.rows[lay.SET, q]] = work.rows[lay.COEF, q]
        largest = max(largest, int(coefs[j].max() * most))
        later = later + coefs[j] * most
        for s in range(8 * plain, sets):
            numbers = [_given(j, cover, s, work) for cover in range(given.shape[1])]
            given[j, :, s] = numbers
            later[s] += max(numbers)
    if not variables.lay_lanes(count, sets, words, work):
        return False
    lanes = work.lanes[: 2 * count * words].view(np.uint8).reshape(count, 2, 8 * words)
    if (lanes[:, 0] != coefs).any() or (lanes[:, 1] != np.minimum(rests, 127)).any():
        return False
    taken = work.covers[: count * lay.COVERS * words].view(np.uint8).reshape(count, lay.COVERS, 8 * words)
    if (taken[:, : given.shape[1], 8 * plain :] != given[..., 8 * plain :]).any():
        return False
    answers = []
    for bound in (largest, largest - 1):
        with mock.patch.object(lay, "BYTE", bound):
            answers.append(bool(variables.lay_lanes(count, sets, words, work)))
    return answers == [True, False]


def _given(j: int, cover: int, s: int, work: lay.Work) -> int:
    """What a variable gives to a link, a loop or a pair of links, class by class."""
    vertex, cycle, total = int(work.sets[lay.VERTEX, s]), int(work.sets[lay.CYCLE, s]), 0
    for e in np.flatnonzero(work.classes[lay.VAR, : work.state[covers.LAID]] == j).tolist():
        low, high = (2, 1) if work.classes[lay.FLIP, e] else (1, 2)
        if vertex == work.classes[lay.U, e]:
            total += bool(cover & low)
        elif vertex == work.classes[lay.V, e]:
            total += bool(cover & high)
        elif vertex < 0 and cycle >> e & 1:
            total += {lay.JOINTED: cover & 1, lay.APART: not cover & 1}.get(vertex, cover >> 2)
    return min(total, 127)


def _of_each(k: int, at: int) -> list[int]:
    """Count and list the chains of twelve links over one contracted graph."""
    family, out = _family(12, k), np.zeros(1, np.int64)
    search = family.graphs, at, at + 1, family.frames, 0, family.edge_labels.tables, _work(family), out
    counting.count_block(k, *search, np.zeros((0, 5), np.int64))
    return [int(out[0]), len(_listed(family, at, at + 1, 4096))]


@cache
def _tried(k: int, at: int) -> list[int]:
    """Count them by trying every distribution of binary links and every symmetry, all sets of links being looked at."""
    mult = contracted_graphs(5, k)[at].astype(int)
    pairs = [(a, b) for a, b in combinations(range(k), 2) if mult[a, b]]
    moves = [p for p in permutations(range(k)) if (mult[np.ix_(p, p)] == mult).all()]
    number = {pair: e for e, pair in enumerate(pairs)}
    moved = [[number[min(p[a], p[b]), max(p[a], p[b])] for a, b in pairs] for p in moves]
    options = [
        [paths for paths in combinations_with_replacement(range(3), mult[pair]) if 2 * len(paths) - sum(paths) <= 2]
        for pair in pairs
    ]
    inside = [
        [e for e, pair in enumerate(pairs) if {*pair} <= {*_links(u, k)}] + [3 * (u.bit_count() - 1) - 1]
        for u in range(1, 1 << k)
        if u.bit_count() > 1
    ]
    found = set()
    for label in product(*options):
        if sum(map(sum, label)) != 12 - k:
            continue
        weight = [2 * len(paths) - sum(paths) for paths in label]
        if all(sum(weight[e] for e in some) <= most for *some, most in inside):
            found.add(min(tuple(label[e] for e in move) for move in moved))
    return [len(found)] * 2


def _listed(
    family: fam.Family, start: int, stop: int, capacity: int, part: int = 0, parts: int = 1, copies: int = 1
) -> list[list[int]]:
    """List rows with room for so many at a time, one part of all; of each choice there are said to be more copies."""
    work, tables = _work(family), family.edge_labels.tables
    tables = tables._replace(groups=tables.groups * np.where(np.arange(5) == lay.COPIES, copies, 1)[:, None])
    rows = np.zeros((capacity, lay.HEADER + family.loops + family.vertices), np.int32)
    found: list[list[int]] = []
    listing.rewind(start, part, parts, work)
    count = capacity
    while count == capacity:
        search = family.vertices, family.graphs, stop, family.frames, family.frame_degree, 0, tables, work, rows
        count = listing.list_rows(*search)
        if count < 0:
            return [[count]]
        found += rows[:count].tolist()
    return found


def _few_rows() -> bool:
    """Tell whether a list comes out the same whatever room is left for rows, and what is said of it."""
    for family in (_family(8, 4), _family(8, 3, framed=True), _family(7, 2, 2)):
        every = _listed(family, 0, len(family.graphs), 4096)
        if any(_listed(family, 0, len(family.graphs), room) != every for room in (1, 2, 3, len(every))):
            return False
        if _listed(family, 0, len(family.graphs), 4096, copies=2**33) != every:  # more than an integer holds
            return False
    family = _family(12, 6)
    for at, mult in enumerate(family.graphs):
        if counting.automorphisms(6, mult, _work(family).perms) == 1:
            found, work = _listed(family, at, at + 1, 64), _work(family)
            sets = variables.load_graph(6, mult, family.edge_labels.tables, work)[1]
            return work.state[[listing.VISITED, listing.WORDS]].tolist() == [len(found), (sets + 7) // 8]
    return False


def _parts() -> bool:
    """Tell whether the parts of a list are the list, cut where one of the first five variables changes."""
    for (family, at), number in product(((_family(12, 6), 4), (_family(12, 4), 5), (_family(12, 3), 0)), (2, 3)):
        every = sorted(_listed(family, at, at + 1, 4096))
        order = _work(family).variables[lay.REP, : _work(family).state[listing.COUNT]] + lay.HEADER
        parts = [_listed(family, at, at + 1, 64, part, number) for part in range(number)]
        if sorted(row for part in parts for row in part) != every or not all(parts):
            return False
        most = min(5, len(order))
        begun = [[{tuple(row[e] for e in order[:n]) for row in part} for part in parts] for n in (most, most - 1)]
        if begun[0][0] & begun[0][1] or not begun[1][0] & begun[1][1]:
            return False
    return True


def _no_room() -> bool:
    """Tell whether it is noticed that there is no room for symmetries, choices or states, and only then."""
    family = _family(10, 4)
    k, mults, tables, work = 4, family.graphs, family.edge_labels.tables, _work(family)
    out, rows = np.zeros((2, 1), np.int64), np.zeros((64, lay.HEADER + 9), np.int32)
    none = np.zeros((0, 5), np.int64)

    def asked(at: int, given: lay.Work) -> list[int]:
        listing.rewind(at, 0, 1, given)
        return [
            int(counting.count_block(k, mults, at, at + 1, counting.FRAME_NONE, 0, tables, given, out[0], none)),
            int(moving.sum_moved(k, mults, at, at + 1, tables, given, out)),
            min(0, int(listing.list_rows(k, mults, at + 1, counting.FRAME_NONE, 0, 0, tables, given, rows))),
        ]

    for at, mult in enumerate(mults):
        order = counting.automorphisms(k, mult, work.perms)
        sets = variables.load_graph(k, mult, tables, work)[1]
        entries = _entries(k, mult, tables, work)
        alone = order == 1  # then no other symmetry is laid out
        for room, wrong in ((order, 0), (order - 1, TOO_LARGE)):
            if counting.automorphisms(k, mult, work.perms[:room]) != (order if not wrong else -1) and room:
                return False
            if room and asked(at, work._replace(perms=work.perms[:room])) != [wrong] * 3:
                return False
        for room, wrong in ((sets, 0), (sets - 1, TOO_LARGE)):
            given = work._replace(sets=np.zeros((5, max(room, 0)), np.int64))
            if room >= 0 and asked(at, given) != [wrong, 0 if alone else wrong, wrong]:
                return False
        for room, wrong in ((entries, 0), (entries - 1, TOO_LARGE)):
            with mock.patch.object(lay, "MAX_ENTRIES", room):
                found = asked(at, work)
            if [found[0], found[2]] != [wrong] * 2:
                return False
    with mock.patch.object(colouring, "automorphisms", lambda *_: -1):
        if colouring.colour_graphs(k, mults, 1, 0, np.zeros((0, k, k), np.uint8)) != -1:
            return False
    return _states_or_no_room()


def _entries(k: int, mult: Any, tables: lay.Tables, work: lay.Work) -> int:
    """How many choices the classes have that fit."""
    numbers = [int(mult[a, b]) for a, b in combinations(range(k), 2) if mult[a, b]]
    groups = [tables.groups[lay.PACKED, slice(*tables.group_kinds[:, 4 * n])] for n in numbers]
    return sum(int((own <= tables.resources[lay.DIGITS, tables.target]).sum()) for own in groups)


def _states_or_no_room() -> bool:
    """Tell whether counts in small tables of states are right, or say that there is no room."""
    out, seen = np.zeros(1, np.int64), Counter[int]()
    for family in [_family(10, k) for k in (4, 5, 6)] + [_family(12, 5)]:
        tables, every = family.edge_labels.tables, _work(family)
        for at in range(len(family.graphs)) if family.links == 10 else (4,):
            search = family.vertices, family.graphs, at, at + 1, family.frames, 0, tables
            counting.count_block(*search, every, out, np.zeros((0, 5), np.int64))
            right = int(out[0])
            for bits in range(2, 7):
                small = every._replace(keys=np.zeros(2 << bits, np.uint64), states=np.zeros((3, 1 << bits), np.int64))
                found = counting.count_block(*search, small, out, np.zeros((0, 5), np.int64))
                seen[int(found)] += 1
                if found not in (0, counting.NO_ROOM) or (found == 0 and out[0] != right):
                    return False
    return seen[0] > 3 and seen[counting.NO_ROOM] > 3


def _past() -> list[int]:
    """Count where each symmetry, or each frame, is said to keep so many labellings: 2**62 in all, or more."""
    family = _family(12, 4)
    tables, work, none = family.edge_labels.tables, _work(family), np.zeros((0, 5), np.int64)
    orders = [counting.automorphisms(4, mult, work.perms) for mult in family.graphs]

    def counted(order: int, kept: int, frames: int) -> int:
        at, out = orders.index(order), np.zeros(1, np.int64)
        with mock.patch.object(counting, "fixed_by", lambda *_: np.int64(kept)):
            status = counting.count_block(4, family.graphs, at, at + 1, frames, 0, tables, work, out, none)
        return int(status or out[0])

    def summed(kept: int) -> int:
        at, out = orders.index(2), np.zeros((2, 1), np.int64)
        with mock.patch.object(moving, "fixed_by", lambda *_: np.int64(kept)):
            status = moving.sum_moved(4, family.graphs, at, at + 1, tables, work, out)
        return int(status or out[1, 0])

    chains, frames = counting.FRAME_NONE, counting.FRAME_VERTEX
    found = [counted(2, 2**61 + more, chains) for more in (0, 1)]  # two symmetries
    found += [counted(1, 2**60 + more, frames) for more in (0, 1)]  # four frames
    return found + [summed(2**62 + more) for more in (0, 1)]


def _pairs() -> bool:
    """Tell whether each frame comes with the symmetries that keep it, and their means add up to the count."""
    for k, links in ((2, 6), (3, 8), (4, 8)):
        family = _family(links, k, framed=True)
        tables, work = family.edge_labels.tables, _work(family)
        for at, mult in enumerate(family.graphs):
            out, pairs = np.zeros(1, np.int64), np.zeros((4096, 5), np.int64)
            search = k, family.graphs, at, at + 1, family.frames, 0, tables, work, out
            rows = counting.count_block(*search, pairs)
            again = np.full((rows, 5), -1, np.int64)
            if counting.count_block(*search, again) != rows or (again != pairs[:rows]).any():
                return False
            if rows > 1 and counting.count_block(*search, again[1:].copy()) != TOO_LARGE:
                return False
            order = counting.automorphisms(k, mult, work.perms)
            variables.load_graph(k, mult, tables, work)
            total = 0
            for mode, frame in sorted({(int(a), int(b)) for a, b in again[:, :2]}):
                own = again[(again[:, 0] == mode) & (again[:, 1] == frame)]
                ends = [frame] if mode == counting.FRAME_VERTEX else work.classes[: lay.V + 1, frame].tolist()
                keep = [g for g in range(order) if sorted(work.perms[g, ends].tolist()) == ends]
                if own[:, 2].tolist() != keep or (own[:, 3] != len(keep)).any():
                    return False
                total += int(own[:, 4].sum()) // len(keep)
            if total != out[0]:
                return False
    return True


def _coloured() -> bool:
    """Tell whether graphs with multiple joints are all there are, each once, links first."""
    for mults in (contracted_graphs(3, 4), contracted_graphs(4, 4)):
        k = mults.shape[1]
        for pins, loose in product((1, 2, 3), (0, 1, 2)):
            out = np.zeros((400, k, k), np.uint8)
            count = colouring.colour_graphs(k, mults, pins, loose, out)
            found = [_canonical(one) for one in out[:count].astype(int)]
            wanted = {_canonical(one) for mult in mults.astype(int) for one in _colourings(mult, pins, loose)}
            if len(found) != len({*found}) or {*found} != wanted or out[count:].any():
                return False
            if any(np.diag(one).tolist() != [0] * (k - pins) + [1] * pins for one in out[:count]):
                return False
    return True


def _canonical(graph: Any) -> tuple[int, ...]:
    return min(tuple(graph[np.ix_(p, p)].ravel().tolist()) for p in permutations(range(len(graph))))


def _colourings(mult: Any, pins: int, loose: int) -> Iterator[Any]:
    """Yield every way to choose multiple joints, and loose classes between them."""
    for chosen in combinations(range(len(mult)), pins):
        between = [pair for pair in combinations(chosen, 2) if mult[pair] and loose]
        for number in range(min(loose, len(between)) + 1):
            for some in combinations(between, number):
                graph = np.diag([int(v in chosen) for v in range(len(mult))])
                for a, b in combinations(range(len(mult)), 2):
                    kind = lay.LOOSE if (a, b) in some else (a in chosen) + (b in chosen)
                    graph[a, b] = graph[b, a] = mult[a, b] + (kind << lay.KIND_SHIFT) if mult[a, b] else 0
                yield graph


def _few_codes() -> bool:
    """Tell whether graphs are split the same when the codes of only one or two of them have room."""
    parents, joined = contracted_graphs(4, 4), 1
    every = np.zeros((4096, 10), np.uint8)
    at, count = splitting.split_all(4, parents, 0, joined, 6, every)
    most = max(splitting.split_all(4, parents[i : i + 1], 0, joined, 6, every.copy())[1] for i in range(len(parents)))
    found: list[Any] = []
    begun, some = 0, np.zeros((most + 1, 10), np.uint8)
    while begun < len(parents):
        begun, written = splitting.split_all(4, parents, begun, joined, 6, some)
        found += some[:written].tolist()
    return at == len(parents) and found == every[:count].tolist()


def _renumbered() -> list[int]:
    """Count trains whose axes are as fine as can be, the links of all trees numbered otherwise."""
    from graphsynth.synthesis.geared_trees import _matrices

    found = []
    for links, number in ((5, 3), (6, 4), (6, 3)):
        for order in (range(links), range(links - 1, -1, -1), [*range(1, links, 2), *range(0, links, 2)]):
            trees = np.ascontiguousarray(_matrices(links)[:, order][:, :, order])
            perms, out = np.zeros((720, links), np.uint8), np.zeros((2, 64), np.int64)
            found.append(int(gears.choose_gears(links, trees, 0, len(trees), number, True, 0, perms, out)))
    return found


def _texts() -> bool:
    """Tell whether lines are the texts of the graphs that are listed."""
    for numbers in ((6, 1, 3, {2: 2}, False), (6, 1, 3, {2: 2}, True), (6, 1, 2, {}, True), (8, 1, 3, {}, False)):
        for family in fam.chain_families(*numbers):
            chunk = Chunk(family, 0, len(family.graphs))
            lines = b"".join(text for text, _ in chunk.texts()).decode().splitlines()
            if lines != [graph.to_text() for graph in chunk.graphs()]:
                return False
    return True


def _first_level() -> int:
    """Count eight-bars with one link on the level of the frame: all."""
    return graphsynth.count_mechanisms(StructuralSpec(W=1, links=8, levels={0: 1}))


def _multiple() -> list[int]:
    """List chains of eight links with two multiple joints or more."""
    make = graphsynth.enumerate_multiple_joint_chains
    return [len({graph.key for graph in make(8, multiple=number)}) for number in (2, 3, 4)]


def _identities() -> bool:
    """Tell whether the sums over all identities are those over one contracted graph after the other."""
    for links, space in ((8, 4), (11, 4), (14, 5)):
        for k, total in identity_sums(links, space).items():
            family, own = _family(links, k, space=space), Fraction(0)
            tables, work = family.edge_labels.tables, _work(family)
            for mult in family.graphs:
                order = counting.automorphisms(k, mult, work.perms)
                m, sets = variables.load_graph(k, mult, tables, work)
                own += Fraction(int(counting.fixed_by(0, m, sets, tables, work)), order)
            if own != total:
                return False
    return True


def _splits() -> bool:
    """Tell whether splits of a graph are all that leave three edges, and one to another vertex, to both halves."""
    growth = growing.make_growth(2000)
    for k, wanted in ((3, 5), (4, 5), (5, 6), (6, 5)):
        for mult in contracted_graphs(4, k).astype(int):
            growth.mults[0, :k, :k] = mult
            growing._begin(0, k, 4, 1, 1, growth)
            found = []
            while growing._next_split(k, 0, wanted, growth):
                found.append([*growth.at[0, 1:3].tolist(), *growth.given[0, :k].tolist()])
            every = []
            for joined, v in product(range(1, wanted - 2), range(k)):
                for given in product(*(range(number + 1) for number in mult[v, ::-1])):
                    moved, left = sum(given), int(mult[v].sum()) - sum(given)
                    if min(moved, left) > 0 and min(moved, left) + joined > 2:
                        every.append([joined, v, *given[::-1]])
            if found != every:
                return False
    return True


def _canonical_pair() -> list[int]:
    """Count the pairs that a graph is grown from, of two that only its automorphisms tell apart, in two numberings.

    A vertex with two edges to each of two others; these are joined to the vertices of a hexagon, and of two triangles.
    """
    found = []
    for turned in (False, True):
        mult = np.zeros((15, 15), np.uint8)
        ring = [(i, (i + 1) % 6) for i in range(6)]
        others = [(6 + i, 6 + (i + 1) % 3 + i // 3 * 3) for i in range(6)]
        edges = [*ring, *others, *((i, 6 + i) for i in range(6)), *((i, 12 + i // 6) for i in range(12))]
        for a, b in [*edges, (12, 14), (12, 14), (13, 14), (13, 14)]:
            mult[a, b] += 1
            mult[b, a] += 1
        order = [*range(6, 12), *range(6), 13, 12, 14] if turned else [*range(15)]
        growth = growing.make_growth(2000)
        growth.mults[1, :15, :15] = mult[np.ix_(order, order)]
        space, masks = canon_workspace(lay.MAX_VERTICES, 8), np.zeros((8, lay.MAX_VERTICES), np.uint64)
        kept = [growing._is_grown_here(15, v, 1, masks, space, growth) for v in (12, 13)]
        found.append(sum(order > 0 for order in kept))
    return found
