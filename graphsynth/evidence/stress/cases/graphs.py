"""Structural questions and counts at their ends (structural page, sections 2 to 5)."""

from __future__ import annotations

from collections import Counter
from itertools import combinations
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = [
    "contradiction", "fractionated", "key_separates", "large_counts", "rigid_parts", "small_ends", "under_determined",
    "unequal_spaces",
]  # fmt: skip


def under_determined(check: Checks) -> None:
    """Worked example leaves five assortments; the source takes one, for which one more rule is needed."""
    from graphsynth.structure.system.spec import StructuralSpec

    spec = StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7)
    found = [(s.n_a[2], s.n_a[3], s.n_a[4]) for s in spec.solve()]
    check.equals("solutions", sorted(found), [(5, 9, 0), (6, 7, 1), (7, 5, 2), (8, 3, 3), (9, 1, 4)])
    for s in spec.solve():
        forced = (s.p_i[0], s.G, s.v, s.v_P)
        check.equals(f"{s}: p1, G, v, v_P", forced, (19, 25, 8, 2))
    one = [(s.n_a[2], s.n_a[3], s.n_a[4]) for s in spec.replace(n4=1).solve()]
    check.equals("with n4 = 1", one, [(6, 7, 1)])


def contradiction(check: Checks) -> None:
    """Questions without an answer name what clashes; open and huge ones are refused with a remedy."""
    from graphsynth.core.errors import InfeasibleSpecError
    from graphsynth.structure.system.spec import StructuralSpec

    question: dict[str, int]
    for name, question in (
        ("W = 1 with five links and mobility-1 joints", {"W": 1, "links": 5, "p2": 0}),
        ("more frame joints than joints", {"W": 1, "links": 4, "p": 4, "t0": 5}),
    ):
        try:
            StructuralSpec(**question).solve()
        except InfeasibleSpecError as error:
            check.agrees(
                f"{name}: refused, with what clashes", bool(error.clashes) and "\n" not in str(error), str(error)
            )
        else:
            check.says(name, "solutions", "none")
    check.refused("size left open", lambda: StructuralSpec(W=1).solve(), "bound")
    check.refused("mobility beyond the space", lambda: StructuralSpec(W=1, Pi=7, links=4), "Pi")


def unequal_spaces(check: Checks) -> None:
    """Crank-slider whose slider pushes a wedge: 0 by the uniform count, 1 by the rank of the loop matrix.

    Three sliders of one direction, instead of a wedge, leave the span of their loop one-dimensional: one freedom more.
    """
    import math

    from graphsynth.evidence.stress.cases.linkages import built
    from graphsynth.mechanism.joints import Prismatic, Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (0, 4)], frame=0)
    check.says("by count with Pi = 3", graph.mobility, 0)
    (rod, slider), quarter = _slider(0.5), math.pi / 4
    for name, slope, wall, right in (("wedge", quarter, 2 * quarter, 1), ("three parallel sliders", 0.0, 0.0, 2)):
        at = (1.0, 1.0 - slider[0]) if slope else (1.0, 0.0)
        joints = [
            Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3),
            Prismatic(3, 4, angle_a=slope, angle_b=slope), Prismatic(0, 4, at, (0.0, 0.0), wall, wall),
        ]  # fmt: skip
        pose = [(0, 0, 0), (0, 0, 0.5), rod, slider, (*at, 0.0)]
        report = built(graph, joints, pose).mobility()
        check.says(f"{name}: by count", report.count, 0)
        check.equals(f"{name}: by rank", report.by_rank, right, source="sum of freedoms less dimensions of the loops")


def _slider(theta: float) -> list[tuple[float, float, float]]:
    import math

    x, y = math.cos(theta), math.sin(theta)
    tilt = math.asin(-y / 3.0)
    return [(x, y, tilt), (x + 3.0 * math.cos(tilt), 0.0, 0.0)]


def rigid_parts(check: Checks) -> None:
    """Chains of the right mobility with a rigid or over-constrained part: found and named, against all subsets."""
    from graphsynth.structure.graph import MechanismGraph

    triangle = [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (4, 5), (5, 0)]
    prism = [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3)]
    braced = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (3, 4), (4, 5), (5, 6), (6, 7), (7, 1)]
    for name, links, joints in (
        ("triangle in six links", 6, triangle),
        ("two triangles", 6, prism),
        ("braced", 8, braced),
    ):
        graph = MechanismGraph(links, joints)
        worst = _rigid(links, joints)
        found = graph.rigid_subchain()
        check.says(f"{name}: has a rigid part", found is not None, bool(worst), source="all subsets of links")
        if found is not None:
            check.agrees(
                f"{name}: the part named is one", set(found.links) in worst, str(found), source="all subsets of links"
            )
    free = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])
    check.equals("four-bar: none", free.rigid_subchain(), None)


def _rigid(links: int, joints: list[tuple[int, int]]) -> list[set[int]]:
    """List the sets of two links or more of mobility 0 or less."""
    found = []
    for size in range(2, links + 1):
        for chosen in combinations(range(links), size):
            inside = sum(a in chosen and b in chosen for a, b in joints)
            if 3 * (size - 1) - 2 * inside <= 0:
                found.append(set(chosen))
    return found


def fractionated(check: Checks) -> None:
    """Chains of mobility 2 to 4: published counts with and without those that fall apart at a link or a joint."""
    from graphsynth.synthesis.api import count_chains

    for mobility, links, connected, everything in (
        (2, 5, 1, 1), (2, 7, 3, 4), (2, 9, 35, 40), (3, 6, 1, 1), (3, 8, 5, 7), (3, 10, 74, 98), (4, 7, 1, 1),
        (4, 9, 6, 10), (4, 11, 126, 189),
    ):  # fmt: skip
        given = (count_chains(links, mobility), count_chains(links, mobility, fractionated=True))
        check.equals(f"W = {mobility}, {links} links", given, (connected, everything), source="section 5")


def key_separates(check: Checks) -> None:
    """Ten-link chains: the key tells all 230 apart, where cheap hashes find 216 and 228."""
    import numpy as np

    from graphsynth.synthesis.api import enumerate_chains

    chains = list(enumerate_chains(10))
    check.equals("chains", len(chains), 230, source="section 5")
    check.equals("keys", len({g.key for g in chains}), 230, source="section 4")
    spectra: Counter[tuple[int, ...]] = Counter()
    for g in chains:
        A = np.zeros((10, 10))
        for a, b, _ in g.joints:
            A[a, b] = A[b, a] = 1.0
        spectra[tuple(np.round(np.poly(A)).astype(int).tolist())] += 1
    check.equals("characteristic polynomials", len(spectra), 228, source="section 4")
    # relabelled at random the key stays
    rng = np.random.default_rng(0)
    moved = sum(g.relabelled(rng.permutation(10).tolist()).key != g.key for g in chains)
    check.equals("keys that change with the labels", int(moved), 0)


def small_ends(check: Checks) -> None:
    """Smallest questions: one chain, none of an impossible parity, groups and trusses at their start."""
    from graphsynth.structure.system.spec import StructuralSpec
    from graphsynth.synthesis.api import (
        count_assur_groups,
        count_baranov_trusses,
        count_chains,
        count_mechanisms,
        enumerate_chains,
    )

    check.equals("four links", count_chains(4), 1, source="section 5")
    check.equals("five links, W = 1: none", count_chains(5), 0, source="parity")
    check.equals("listing of none", list(enumerate_chains(5)), [])
    check.equals("mechanisms of four links", count_mechanisms(StructuralSpec(W=1, links=4)), 1, source="section 5")
    check.equals("smallest Assur group", count_assur_groups(2), 1, source="section 5")
    check.equals("Assur groups of three links", count_assur_groups(3), 0, source="3 n / 2 joints")
    check.equals("smallest truss", count_baranov_trusses(3), 1, source="section 5")
    check.refused("no links", lambda: count_chains(0), "links")
    half: Any = 4.5
    check.refused("half a link", lambda: count_chains(half), "links")


def large_counts(check: Checks) -> None:
    """Millions, without storing them: 16 links, and the worked example with higher pairs."""
    from graphsynth.structure.system.spec import StructuralSpec
    from graphsynth.synthesis.api import count_assur_groups, count_chains, count_mechanisms

    check.equals("14 links", count_chains(14), 318162, source="section 5")
    check.equals("16 links", count_chains(16), 19819281, source="section 5")
    check.equals("mechanisms of 12 links", count_mechanisms(StructuralSpec(W=1, links=12)), 75397, source="section 5")
    check.equals("Assur groups of 10 links", count_assur_groups(10), 5438, source="section 5")
    example = StructuralSpec(W=1, Pi=3, v_ct=6, p1=19, p2=3, n=14, t0=7, n2=9, n3=1, n4=4)
    check.equals("worked example, (9, 1, 4)", count_mechanisms(example), 9663907, source="section 5")
