"""Beyond the specification: graphs at the limit of the kernels, questions that cannot be answered, budgets used up."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["budgets", "large_graphs", "too_large"]


def _graph(links: int, joined: Callable[[int, int], bool]) -> MechanismGraph:
    from graphsynth.structure.graph import MechanismGraph

    return MechanismGraph(links, [(a, b) for b in range(links) for a in range(b) if joined(a, b)])


def large_graphs(check: Checks) -> None:
    """Graphs that colour refinement cannot split, and the largest: automorphisms by formula, keys under relabelling."""
    squares = {x * x % 53 for x in range(1, 53)}
    shifts = {(0, 1), (0, 3), (1, 0), (3, 0), (1, 1), (3, 3)}
    rook = _graph(16, lambda a, b: (a // 4 == b // 4) != (a % 4 == b % 4))
    shrikhande = _graph(16, lambda a, b: ((a // 4 - b // 4) % 4, (a % 4 - b % 4) % 4) in shifts)
    graphs = (
        ("60 links, no joint", _graph(60, lambda a, b: False), math.factorial(60)),
        ("complete, 24 links", _graph(24, lambda a, b: True), math.factorial(24)),
        ("20 triangles", _graph(60, lambda a, b: a // 3 == b // 3), math.factorial(20) * 6**20),
        ("ring of 255 links", _graph(255, lambda a, b: b - a in (1, 254)), 510),
        ("cube in five dimensions", _graph(32, lambda a, b: (a ^ b).bit_count() == 1), 2**5 * math.factorial(5)),
        ("Paley's graph of 53", _graph(53, lambda a, b: (b - a) % 53 in squares), 53 * 26),
        ("rook's graph, 4 by 4", rook, 2 * math.factorial(4) ** 2),
        ("Shrikhande's graph", shrikhande, 192),
    )
    rng = np.random.default_rng(1)
    for name, graph, order in graphs:
        check.equals(f"{name}: automorphisms", graph.automorphism_order, order, source="group theory")
        moved = graph.relabelled(rng.permutation(graph.links).tolist())
        check.equals(f"{name}: key after relabelling", moved.key == graph.key, True)
    differ = rook.key != shrikhande.key
    check.equals(
        "two graphs with the same parameters (16, 6, 2, 2) have two keys", differ, True, source="Shrikhande 1959"
    )
    check.refused("256 links", lambda: _graph(256, lambda a, b: b == a + 1), "1 to 255", "256")


def too_large(check: Checks) -> None:
    """Questions beyond reach are refused at once, with an estimate; nonsense in one sentence."""
    from graphsynth.core.errors import TooLargeError
    from graphsynth.structure.system.spec import StructuralSpec
    from graphsynth.synthesis.api import count_assur_groups, count_chains

    for links in (40, 64, 254):
        check.refused(f"counting {links} links", partial(count_chains, links), str(links))
        check.refused(f"listing {links} links", partial(_first, links), str(links))
    try:
        count_chains(40)
    except TooLargeError as error:
        # the counts grow about seventyfold with every two links from 1.98e7 at 16 links
        estimate = math.log10(error.estimate)
        check.agrees(
            "the estimate for 40 links is no number of chains that fits", 25 < estimate < 45, f"1e{estimate:.0f}"
        )
    for name, call in (
        ("10^18 links", lambda: count_chains(10**18)), ("mobility 10^9", lambda: count_chains(4, 10**9)),
        ("-4 links", lambda: count_chains(-4)), ("a group of 10^6 links", lambda: count_assur_groups(10**6)),
        ("10^6 moving links", lambda: StructuralSpec(W=1, n=10**6).solve()),
        ("no size", lambda: StructuralSpec(W=1).solve()),
    ):  # fmt: skip
        check.refused(name, call, "")


def _first(links: int) -> object:
    from graphsynth.synthesis.api import enumerate_chains

    return next(iter(enumerate_chains(links)))


def budgets(check: Checks) -> None:
    """Budgets that are used up: undecided, with what was proved so far, and never a proof too many."""
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.intervals import pave
    from graphsynth.kinematics.certify.poses import certify
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.systems.platform import certify_full_turn
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    motion = simulate(four_bar(1.0, 2.5, 2.5, 2.0), np.linspace(0.0, math.tau, 73), modes={0: 1})
    proof = certify(motion, max_boxes=1)
    check.says("motion, one box: certified", proof.certified, False)
    check.mentions("its reason", proof.reason, "box")
    check.equals("motion, many boxes: certified", certify(motion).certified, True)
    turn = certify_full_turn(SingleMotorPlatform(), max_boxes=1)
    check.says("full turn, one box: certified", turn.certified, False)
    check.mentions("its reason", turn.reason, "box")
    # x^2 + y^2 = 1 and x = y^2 meet twice
    for boxes in (1, 3, 10):
        found = pave(lambda x: [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2], ["[-2, 2]", "[-2, 2]"], max_boxes=boxes)
        if not found.finished:
            check.says(f"paving, {boxes} boxes: finished", found.finished, False)
        check.agrees(f"paving, {boxes} boxes: at most two solutions proved", _proved(found.status) <= 2)
    done = pave(lambda x: [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2], ["[-2, 2]", "[-2, 2]"])
    check.equals(
        "paving: finished, solutions", (done.finished, _proved(done.status)), (True, 2), source="two parabolas"
    )


def _proved(status: object) -> int:
    from graphsynth.intervals import Status

    return sum(Status(int(s)) is Status.UNIQUE for s in np.atleast_1d(np.asarray(status)))
