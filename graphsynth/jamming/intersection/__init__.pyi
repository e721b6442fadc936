from .boxes import IntersectionBoxes as IntersectionBoxes, cross_check as cross_check, krawczyk_boxes as krawczyk_boxes
from .hull import (
    CircleEllipse as CircleEllipse,
    IntersectionHull as IntersectionHull,
    Reason as Reason,
    circle_ellipse as circle_ellipse,
    exact_hull as exact_hull,
    mirrored as mirrored,
    surrogate_problem as surrogate_problem,
)
