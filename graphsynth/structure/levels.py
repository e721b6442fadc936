"""Adjacency levels: L0 is the frame, L(k+1) the links jointed to Lk and in no earlier level.

Joints run inside a level or between neighbouring levels.  Source: structural synthesis by adjacency levels,
``docs/explanation/mechanism-graph.md``, section *Levels*.
"""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["bits", "breadth_first", "component_of", "components_of"]


def bits(mask: int) -> list[int]:
    """Return the positions of the set bits, ascending.

    >>> bits(0b10110)
    [1, 2, 4]
    """
    found = []
    while mask:
        low = mask & -mask
        found.append(low.bit_length() - 1)
        mask ^= low
    return found


def breadth_first(neighbours: Sequence[int], start: int, within: int = -1) -> list[int]:
    """Return the breadth-first levels from one link as bit masks.

    Parameters
    ----------
    neighbours : sequence of int
        For each link the bit mask of the links jointed to it.
    start : int
        The link that makes level 0.
    within : int, optional
        Bit mask of the links that may be visited; all by default.

    Returns
    -------
    list of int
        One bit mask per level; links that cannot be reached are in none.

    Examples
    --------
    >>> breadth_first([0b0010, 0b0101, 0b1010, 0b0100], 0)
    [1, 2, 4, 8]
    """
    level = 1 << start
    seen = level
    levels = []
    while level:
        levels.append(level)
        reached = 0
        for link in bits(level):
            reached |= neighbours[link]
        level = reached & within & ~seen
        seen |= level
    return levels


def component_of(neighbours: Sequence[int], start: int, within: int = -1) -> int:
    """Return the bit mask of the links that can be reached from ``start``.

    >>> component_of([0b010, 0b001, 0b000], 0)
    3
    """
    mask = 0
    for level in breadth_first(neighbours, start, within):
        mask |= level
    return mask


def components_of(neighbours: Sequence[int], within: int) -> list[int]:
    """Return the connected parts of the links in ``within``, each as a bit mask, by smallest link.

    >>> components_of([0b010, 0b001, 0b000], 0b111)
    [3, 4]
    """
    parts = []
    while within:
        part = component_of(neighbours, (within & -within).bit_length() - 1, within)
        within &= ~part
        parts.append(part)
    return parts
