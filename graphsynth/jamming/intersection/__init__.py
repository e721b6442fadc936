"""Circle and ellipse with tolerances: the interval problem of the source, solved exactly and by Krawczyk's method."""

from __future__ import annotations

from graphsynth.jamming.intersection.boxes import CrossCheck, IntersectionBoxes, cross_check, krawczyk_boxes
from graphsynth.jamming.intersection.hull import IntersectionHull, exact_hull, mirrored
from graphsynth.jamming.intersection.problem import CircleEllipse, Reason, circle_ellipse, surrogate_problem
from graphsynth.jamming.intersection.readings import (
    Reading,
    TiltedEllipse,
    reading_areas,
    reading_ellipse,
    reading_problem,
)

__all__ = [
    "CircleEllipse",
    "CrossCheck",
    "IntersectionBoxes",
    "IntersectionHull",
    "Reading",
    "Reason",
    "TiltedEllipse",
    "circle_ellipse",
    "cross_check",
    "exact_hull",
    "krawczyk_boxes",
    "mirrored",
    "reading_areas",
    "reading_ellipse",
    "reading_problem",
    "surrogate_problem",
]
