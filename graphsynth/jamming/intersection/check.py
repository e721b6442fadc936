"""The exact hull and Krawczyk's boxes check each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from graphsynth.core.checks import checked
from graphsynth.intervals.status import Status
from graphsynth.jamming.intersection.boxes import CrossingBoxes, krawczyk_boxes
from graphsynth.jamming.intersection.hull import CrossingHull, exact_hull
from graphsynth.jamming.intersection.problem import CircleEllipse

__all__ = ["CrossCheck", "cross_check"]


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """Both solutions of one problem, and whether they can be true together.

    Attributes
    ----------
    hull : CrossingHull
    boxes : CrossingBoxes
    hull_in_boxes : bool
        The exact hull lies in the hull of all boxes; implied if both are right and the hull is tight.
    inner_in_hull : bool
        The inner boxes, which are solutions, lie in the exact hull.
    statuses_agree : bool
        Neither has proved what the other has disproved.
    """

    hull: CrossingHull
    boxes: CrossingBoxes
    hull_in_boxes: bool
    inner_in_hull: bool
    statuses_agree: bool

    @property
    def consistent(self) -> bool:
        """Whether nothing contradicts; False means a defect of the program."""
        return self.hull_in_boxes and self.inner_in_hull and self.statuses_agree


@checked
def cross_check(problem: CircleEllipse, **limits: Any) -> CrossCheck:
    """Solve a problem by both methods and compare what they prove.

    Parameters
    ----------
    problem : CircleEllipse
    **limits
        As for `krawczyk_boxes`.

    Returns
    -------
    CrossCheck
        Both outcomes, and whether all they prove can hold together (certified).

    Examples
    --------
    >>> from graphsynth.jamming.intersection import circle_ellipse
    >>> found = cross_check(circle_ellipse(5, 6, 4, eps="1e-6"))
    >>> found.consistent, found.hull.status is found.boxes.status
    (True, True)
    """
    hull, boxes = exact_hull(problem), krawczyk_boxes(problem, **limits)
    covered = not hull.tight or bool(hull.hull.subset(boxes.outer).all())
    if boxes.status is Status.UNIQUE and hull.tight:
        covered = covered and bool(hull.hull.subset(boxes.proved[0]).all())
    return CrossCheck(hull, boxes, covered, bool(boxes.inside.subset(hull.hull).all()), _agree(hull, boxes))


def _agree(hull: CrossingHull, boxes: CrossingBoxes) -> bool:
    if boxes.status is Status.EMPTY or hull.status is Status.EMPTY:
        found = len(boxes.proved) + len(boxes.inner) > 0
        return not found and (boxes.status is not Status.EMPTY or hull.status is Status.EMPTY)
    # a crossing proved for every choice of the parameters cannot vanish or be double for some
    return len(boxes.proved) == 0 or hull.status is Status.UNIQUE or not hull.tight
