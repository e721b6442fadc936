"""Circle and ellipse with tolerances: the interval problem of the source, solved exactly and by Krawczyk's method."""

from __future__ import annotations

from graphsynth.jamming.circle_ellipse.boxes import CrossingBoxes, krawczyk_boxes
from graphsynth.jamming.circle_ellipse.check import CrossCheck, cross_check
from graphsynth.jamming.circle_ellipse.hull import CrossingHull, exact_hull, mirrored
from graphsynth.jamming.circle_ellipse.problem import CircleEllipse, circle_ellipse, surrogate_problem
from graphsynth.jamming.circle_ellipse.readings import (
    Reading,
    TiltedEllipse,
    reading_areas,
    reading_ellipse,
    reading_problem,
)
from graphsynth.jamming.circle_ellipse.reasons import Reason

__all__ = [
    "CircleEllipse",
    "CrossCheck",
    "CrossingBoxes",
    "CrossingHull",
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
