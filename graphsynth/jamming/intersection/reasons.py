"""Why the crossing of a circle and an ellipse is what it is; one sentence each."""

from __future__ import annotations

from enum import Enum

__all__ = ["Reason"]


class Reason(Enum):
    """Reason of a status; the value is a sentence for the reader.

    Examples
    --------
    >>> Reason.TOUCHES_X.value
    'touches axis x = 0: for some parameters the crossing lies on it, or there is none'
    """

    CROSSING = "one crossing in each quadrant for every choice of the parameters"
    CIRCLE_OUTSIDE = "the circle encloses the ellipse: no crossing"
    CIRCLE_INSIDE = "the ellipse encloses the circle: no crossing"
    TOUCHES_X = "touches axis x = 0: for some parameters the crossing lies on it, or there is none"
    TOUCHES_Y = "touches axis y = 0: for some parameters the crossing lies on it, or there is none"
    TANGENT_LONG = "tangent at the ends of the long axis: a double point on y = 0"
    TANGENT_SHORT = "tangent at the ends of the short axis: a double point on x = 0"
    COINCIDENT = "coincident: circle and ellipse are the same curve, every point of it is a solution"
    RING = "a = b: the solutions form a ring, not separate crossings"
    NOT_SEPARATED = "the ranges of a and b overlap: the ellipse may be a circle"
    BOXES = "the limit in boxes was reached"
    SECONDS = "the limit in seconds was reached"
    RESOLUTION = "boxes at the limit of the resolution are left: the solution set is thick, or a solution is multiple"
