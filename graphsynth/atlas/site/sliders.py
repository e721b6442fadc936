"""Which joints of a chain may slide: all choices of prismatic joints of small chains, for the page."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

from graphsynth.atlas.site.families import Family, script
from graphsynth.synthesis.sliders import enumerate_slider_chains

#: Most links of chains whose choices are listed, and most prismatic joints of a choice.
MOST_LINKS, MOST_SLIDERS = 8, 3


def choices(links: int, mobility: int) -> dict[str, list[int]]:
    """Return choices of prismatic joints up to symmetry by the key of the chain, fewest joints first.

    A choice is a number whose bit k tells of the k-th joint of the chain that the key gives.

    >>> choices(4, 1)
    {'1BAN4': [2, 6]}
    """
    found: dict[str, list[int]] = {}
    for count in range(1, MOST_SLIDERS + 1):
        for chain in enumerate_slider_chains(links, count, mobility):
            to = chain.graph.labelling.permutation
            sliding = {tuple(sorted((to[a], to[b]))) for a, b in chain.sliders}
            joints = chain.graph.canonical().joints
            bits = sum(1 << k for k, (a, b, _) in enumerate(joints) if (a, b) in sliding)
            found.setdefault(chain.graph.key, []).append(bits)
    return {key: sorted(own, key=_order) for key, own in found.items()}


def _order(bits: int) -> tuple[int, list[int]]:
    return bits.bit_count(), [k for k in range(bits.bit_length()) if bits >> k & 1]


def sliders_script(found: Sequence[Family]) -> str:
    """Write the part of the page that shows choices, with those of all chains of these families that are listed."""
    listed = {}
    for family in found:
        if family.links <= MOST_LINKS:
            own = choices(family.links, family.mobility)
            listed[family.name] = [own.get(row["key"], []) for row in family.rows]
    pages = files("graphsynth.atlas.site").joinpath("pages")
    page = "".join(pages.joinpath(name).read_text("utf-8") for name in ("blocks.js", "sliders.js"))
    return page + script("takeSliders", {"links": MOST_LINKS, "sliders": MOST_SLIDERS, "choices": listed})
