"""Class of a structural group from its contours, after Artobolevsky.

Source: I. I. Artobolevsky, *Theory of Mechanisms and Machines*, structural classification; the choice of loops that
makes the class independent of the drawing is explained in ``docs/explanation/assur-groups.md``.
"""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["contour_class"]


def contour_class(joints: Iterable[tuple[int, int, int]]) -> int:
    """Return the class of a group: the largest number of joints on one of its contours, 2 at least.

    A contour is rigid, a link with three or more joints of the group; or movable, a closed loop of links of the
    group.  Of the loops those of a minimum cycle basis count; their lengths do not depend on the basis.  A joint of
    mobility 2 or more counts as a link with two joints in its place.

    Parameters
    ----------
    joints : iterable of (a, b, mobility)
        Inner joints, and outer joints with -1 for ``b``.

    Examples
    --------
    A dyad, a triad on its ternary link, and four links in a loop:

    >>> contour_class([(1, 2, 1), (1, -1, 1), (2, -1, 1)])
    2
    >>> contour_class([(0, 1, 1), (0, 2, 1), (0, 3, 1), (1, -1, 1), (2, -1, 1), (3, -1, 1)])
    3
    >>> contour_class([(0, 1, 1), (1, 2, 1), (2, 3, 1), (0, 3, 1), (0, -1, 1), (2, -1, 1)])
    4
    """
    degree: dict[int, int] = {}
    edges: list[tuple[object, object]] = []
    for a, b, mobility in joints:
        degree[a] = degree.get(a, 0) + 1
        if b < 0:
            continue
        degree[b] = degree.get(b, 0) + 1
        middle = ("joint", len(edges))
        edges += [(a, b)] if mobility == 1 else [(a, middle), (middle, b)]
    largest = max(2, *degree.values())
    nodes = {node for edge in edges for node in edge}
    if len(edges) < max(len(nodes), 1):
        return largest  # inner joints without a loop
    import networkx

    return max(largest, *map(len, networkx.minimum_cycle_basis(networkx.Graph(edges))))
