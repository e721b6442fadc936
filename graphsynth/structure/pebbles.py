"""The pebble game over flat arrays: sets of links with too many constraints, rigid bodies, structural groups.

What is found does not depend on how the game goes: the smallest tight set about two vertices, the bodies and the
groups are unique [Lee and Streinu 2008], only the assignment that proves them is not.  `graphsynth.structure.rigidity`
plays the same game in plain Python, because counting there must not load anything.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel

#: ``free`` (n,): pebbles that lie on each vertex; ``out`` (n, k): ends of the edges that each vertex pays for, -1 where
#: it pays for none; ``came`` and ``stack`` (n,): of a search.
Game = namedtuple("Game", "free out came stack")

#: What stands in the way of groups: nothing; a set with too many constraints; links that stay free and no such set; a
#: set of moving links with too many constraints among themselves.
SOUND, CROWDED, LOOSE_ONLY, CROWDED_INSIDE = 0, 1, 2, 3
#: Bits of the marks of links: in that set, free.
TOO_MANY, FREE = 1, 2


@kernel
def new_game(free, space):
    """Begin a game with ``free`` (n,) pebbles on the vertices, ``space`` at most."""
    n = free.shape[0]
    return Game(free, np.full((n, space), -1, np.int64), np.empty(n, np.int64), np.empty(n, np.int64))


@kernel
def pay(game, vertex, old, new):
    """Let a vertex pay for an edge to ``new`` with a pebble that paid for one to ``old`` (-1: a free one)."""
    c = 0
    while game.out[vertex, c] != old:
        c += 1
    game.out[vertex, c] = new


@kernel
def fetch(game, to, keep):
    """Bring one pebble to ``to`` along a reversed path, leaving those of ``keep``; whether there was one."""
    free, out, came, stack = game.free, game.out, game.came, game.stack
    came[:] = -1
    came[to], came[keep] = to, keep
    stack[0], height = to, 1
    while height:
        height -= 1
        vertex = stack[height]
        for c in range(out.shape[1]):
            other = out[vertex, c]
            if other < 0 or came[other] >= 0:
                continue
            came[other] = vertex
            if free[other]:
                free[other] -= 1
                free[to] += 1
                while other != to:  # reverse the path: each of its vertices pays for the edge before
                    tail = came[other]
                    pay(game, tail, other, -1)
                    pay(game, other, -1, tail)
                    other = tail
                return True
            stack[height] = other
            height += 1
    return False


@kernel
def gather(game, a, b, wanted):
    """Move pebbles to ``a`` and ``b`` until they hold ``wanted`` together; False if that is impossible."""
    while game.free[a] + game.free[b] < wanted:
        if not (fetch(game, a, b) or fetch(game, b, a)):
            return False
    return True


@kernel
def insert(game, a, b, spare):
    """Insert an edge if ``spare + 1`` pebbles can be gathered on its ends (``spare`` is l of the game)."""
    if not gather(game, a, b, spare + 1):
        return False
    if not game.free[a]:
        a, b = b, a
    game.free[a] -= 1
    pay(game, a, -1, b)
    return True


@kernel
def reach(game, a, b, seen):
    """Mark in ``seen`` (n,) the vertices that edges lead to from two of them, these included."""
    seen[:] = False
    game.stack[0], height = a, 1
    if b != a:
        game.stack[1], height = b, 2
    seen[a], seen[b] = True, True
    while height:
        height -= 1
        vertex = game.stack[height]
        for c in range(game.out.shape[1]):
            other = game.out[vertex, c]
            if other >= 0 and not seen[other]:
                seen[other] = True
                game.stack[height] = other
                height += 1


@kernel
def crowded(joints, within, space, spare, seen):
    """Mark a smallest set with more than ``space |S| - spare`` constraints; whether there is one.

    ``joints`` int64 (joints, 3): links a, b and mobility, parallel joints are allowed; ``within`` bool (links,): the
    links that count.  When an edge is refused, the vertices that edges lead to from its ends are the smallest tight set
    around it: no edge leaves a tight set whose spare pebbles lie on the two ends.
    """
    game = new_game(np.full(within.shape[0], space, np.int64), space)
    for k in range(joints.shape[0]):
        a, b = joints[k, 0], joints[k, 1]
        if within[a] and within[b]:
            for _ in range(space - joints[k, 2]):
                if not insert(game, a, b, spare):
                    reach(game, a, b, seen)
                    return True
    return False


@kernel
def divide(joints, within, base, space, body, group, marks):
    """Divide the links into what is placed and structural groups; returns what stands in the way (`SOUND` if nothing).

    ``joints`` int64 (joints, 4): links a and b, mobility, and whether it is driven; ``within`` bool (links,): the links
    that count; ``base``: the link that is placed.  To ``body`` (links,) goes the smallest link of the body that driven
    joints make, to ``group`` the number of the group in the order of assembly from 1 on, 0 for what is placed with the
    base, -1 for what does not count; to ``marks`` (links,) the bits `TOO_MANY` and `FREE`.
    """
    n, m = within.shape[0], joints.shape[0]
    # bodies: links joined by driven joints of mobility 1; a loop of such joints is one joint too many
    looped = -1
    for link in range(n):
        body[link], group[link], marks[link] = link, -1, 0
    for k in range(m):
        if joints[k, 3] and joints[k, 2] == 1:
            low, high = body[joints[k, 0]], body[joints[k, 1]]
            low, high = min(low, high), max(low, high)
            looped = low if low == high else looped
            for link in range(n):
                if body[link] == high:
                    body[link] = low
    placed = body[base]
    # constraints between bodies; each is paid for by one of its two, which has as many pebbles as freedoms
    edges, count = np.empty((m, 3), np.int64), 0
    for k in range(m):
        a, b, mobility, driven = joints[k, 0], joints[k, 1], joints[k, 2], joints[k, 3]
        if within[a] and within[b] and not (driven and mobility == 1):
            edges[count, 0], edges[count, 1], edges[count, 2] = body[a], body[b], mobility - driven
            count += 1
    free = np.zeros(n, np.int64)
    for link in range(n):
        if within[link] and body[link] != placed:
            free[body[link]] = space
        elif within[link]:
            group[link] = 0
    moving = free > 0
    game, seen, why = new_game(free, space), np.zeros(n, np.bool_), SOUND
    if looped >= 0:
        why, seen[body[looped]] = CROWDED, True
        mark(body, seen, TOO_MANY, marks)
    for k in range(count):
        a, b = edges[k, 0], edges[k, 1]
        for _ in range(space - edges[k, 2]):
            # a constraint inside one body is one too many, whatever the assignment
            if (a == b or not insert(game, a, b, 0)) and why == SOUND:
                why = CROWDED
                reach(game, a, b, seen)
                mark(body, seen, TOO_MANY, marks)
    # free: bodies from which edges lead to a pebble that is left; ``needs[k]`` are those from which k can be reached
    needs = np.zeros((n, n), np.bool_)
    for k in range(n):
        if moving[k]:
            reach(game, k, k, needs[k])
            seen[:] = False
            for other in range(n):
                seen[k] |= needs[k, other] and free[other] > 0
            mark(body, seen, FREE, marks)
            if seen[k] and why == SOUND:
                why = LOOSE_ONLY
    if why == SOUND:
        order(moving, needs, placed, body, group)
        why = crowded_inside(edges[:count], space, body, group, seen)
        if why != SOUND:
            mark(body, seen, TOO_MANY, marks)
    return why


@kernel
def mark(body, bodies, bit, marks):
    """Set a bit for the links of some bodies."""
    for link in range(body.shape[0]):
        if bodies[body[link]]:
            marks[link] |= bit


@kernel
def order(moving, needs, placed, body, group):
    """Give numbers to the groups, bodies that need each other: next that of the smallest link that needs no other."""
    n, number, done = moving.shape[0], 0, np.zeros(moving.shape[0], np.bool_)
    done[placed] = True
    k = 0
    while k < n:
        ready = moving[k] and not done[k]
        for other in range(n if ready else 0):
            if needs[k, other] and not (done[other] or needs[other, k]):
                ready = False
                break
        if not ready:
            k += 1
            continue
        number += 1
        for link in range(n):
            if needs[k, body[link]] and needs[body[link], k] and group[link] == -1:
                group[link] = number
        for other in range(n):
            done[other] |= needs[k, other] and needs[other, k]
        k = 0  # what waited for it may come next


@kernel
def crowded_inside(edges, space, body, group, seen):
    """Mark moving bodies that no assignment can save: more than space (|S| - 1) constraints among themselves."""
    n = body.shape[0]
    within, last = np.empty(n, np.bool_), 0
    for link in range(n):
        last = max(last, group[link])
    for number in range(1, last + 1):
        for link in range(n):
            within[link] = group[link] == number and body[link] == link
        if crowded(edges, within, space, space, seen):
            return CROWDED_INSIDE
    return SOUND
