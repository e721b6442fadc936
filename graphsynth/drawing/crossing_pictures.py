"""Pictures of circle and ellipse: the crossings with their boxes, and the region between the curves.

From certified results; every function returns a matplotlib figure that belongs to no window.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.intervals.interval import Interval
    from graphsynth.jamming.intersection.boxes import IntersectionBoxes
    from graphsynth.jamming.intersection.hull import CircleEllipse

Array = NDArray[np.float64]


def dress(axes: Any, title: str, x: str = "x", y: str = "y") -> None:
    """Give axes a title and labels in the style of these pictures."""
    axes.set_title(title, fontsize=10, color=LIGHT["ink"])
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8)


def _middles(problem: CircleEllipse) -> tuple[float, float, float]:
    """Radius of the circle and semi-axes of the ellipse at the middle of their ranges."""
    R, a, b = (float((r.lo + r.hi) / 2) for r in (problem.R1, problem.a, problem.b))
    return R, a, b


def _distance(R: float, a: float, b: float, t: Array) -> Array:
    """Distance of the ellipse from the circle in the directions t (radians)."""
    return np.asarray(1.0 / np.hypot(np.cos(t) / a, np.sin(t) / b) - R)


def crossing_picture(problem: CircleEllipse, boxes: IntersectionBoxes | None = None) -> Figure:
    """Draw the four crossings of a circle and an ellipse with tolerances; one of them enlarged, and unrolled.

    `boxes`: result of Krawczyk's method to be drawn into the detail.

    >>> from graphsynth.jamming.intersection.hull import circle_ellipse
    >>> len(crossing_picture(circle_ellipse(5, 6, 4, "0.1", "0.01")).axes)
    3
    """
    from graphsynth.jamming.intersection.hull import exact_hull

    found = exact_hull(problem)
    figure = new_figure((13.5, 4.6))
    whole, detail, unrolled = figure.subplots(1, 3)
    (R, a, b), t = _middles(problem), np.linspace(0.0, math.tau, 1441)
    for axes in (whole, detail):
        axes.plot(R * np.cos(t), R * np.sin(t), color=LIGHT["a"], lw=1.3, label="circle")
        axes.plot(a * np.cos(t), b * np.sin(t), color=LIGHT["b"], lw=1.3, label="ellipse")
    rows = found.four
    for k in range(len(rows)):
        _box(whole, rows[k], edgecolor=LIGHT["ink"], lw=1.2, zorder=4)
        middle = rows[k].mid
        whole.plot(*middle, "o", ms=9, mfc="none", mec=LIGHT["ink"], zorder=4)
        corner = np.where(middle < 0.0, rows[k].lo, rows[k].hi)
        away = 16.0 * middle / (float(np.hypot(*middle)) or 1.0)  # points, from the centre outward
        whole.annotate(f"{k + 1}", corner, textcoords="offset points", xytext=away, ha="center", va="center")
    whole.set_aspect("equal")
    dress(whole, f"{len(rows)} box{'es' * (len(rows) != 1)} ({found.status.name}), ringed")
    if found.hull.is_empty.any():
        for axes in (detail, unrolled):
            dress(axes, "no crossing")
        return figure
    points = _region(problem)
    _shape(detail, points)
    _unrolled_region(unrolled, problem, points, found.hull)
    if boxes is not None:
        _paving(detail, boxes)
    _box(detail, found.hull, edgecolor=LIGHT["ink"], lw=1.4, ls="--", zorder=5, label="exact hull")
    for k, limit in enumerate((detail.set_xlim, detail.set_ylim)):  # a margin; a point gets one of its own scale
        lo, hi = float(found.hull.lo[k]), float(found.hull.hi[k])
        edge = max(0.35 * (hi - lo), 1e-6 * max(abs(hi), 1e-300))
        limit(lo - edge, hi + edge)
    dress(detail, "box 1" if boxes is None else "box 1 and Krawczyk's boxes")
    detail.ticklabel_format(useOffset=False)
    detail.tick_params(axis="x", rotation=20)
    figure.legend(*detail.get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    return figure


def _box(axes: Any, box: Interval, **style: Any) -> None:
    from matplotlib.patches import Rectangle

    width, height = (box.hi - box.lo).tolist()
    axes.add_patch(Rectangle((box.lo[0], box.lo[1]), width, height, **{"facecolor": "none", **style}))


def _region(problem: CircleEllipse) -> Array:
    """Outline of the solution set: a parallelogram in the squares, its edges sampled and carried to (x, y)."""
    corners = _clipped(problem)
    steps = np.linspace(0.0, 1.0, 60)[:-1, None]
    edges = [p + steps * (q - p) for p, q in zip(corners, np.roll(corners, -1, axis=0))]
    return np.asarray(np.sqrt(np.maximum(np.concatenate([np.zeros((0, 2)), *edges]), 0.0)))


def _shape(axes: Any, points: Array) -> None:
    from matplotlib.patches import Polygon

    if len(points):
        look: dict[str, Any] = {"facecolor": LIGHT["c"], "alpha": 0.35, "edgecolor": LIGHT["c"], "lw": 1}
        axes.add_patch(Polygon(points, label="solutions", zorder=3, **look))


def _unrolled_region(axes: Any, problem: CircleEllipse, points: Array, hull: Interval) -> None:
    """Draw the solutions over the arc of the circle, against the distance from it: the shape that (x, y) hides."""
    R, a, b = _middles(problem)
    ends = np.arctan2(points[:, 1], points[:, 0]) if len(points) else np.arctan2(hull.lo[1], hull.lo[0]) * np.ones(1)
    edge = max(0.3 * float(np.ptp(ends)), 1e-4)
    t = np.linspace(ends.min() - edge, ends.max() + edge, 400)
    axes.axhline(0.0, color=LIGHT["a"], lw=1.3)
    axes.plot(np.degrees(t), _distance(R, a, b, t), color=LIGHT["b"], lw=1.3)
    if len(points):
        height = np.hypot(*points.T) - R
        _shape(axes, np.column_stack([np.degrees(ends), height]))
        if np.ptp(height) > 0.0:
            axes.set_ylim(height.min() - 0.6 * np.ptp(height), height.max() + 0.6 * np.ptp(height))
    axes.set_xlim(np.degrees(t[0]), np.degrees(t[-1]))
    dress(axes, "box 1 unrolled", "direction from the centre [°]", "distance from the circle")


def _clipped(problem: CircleEllipse) -> Array:
    """Corners of the parallelogram in (x^2, y^2), clipped to the quadrant; of the middle radii."""
    _, a, b = _middles(problem)
    if a == b:
        return np.zeros((0, 2))
    circle, level = ([float(v) for v in bounds] for bounds in (problem.circle_bounds, problem.level_bounds))
    span = (a - b) * (a + b)
    corners = [
        np.array([a * a * (Q - b * b * E) / span, b * b * (a * a * E - Q) / span])
        for Q, E in ((circle[0], level[0]), (circle[1], level[0]), (circle[1], level[1]), (circle[0], level[1]))
    ]
    for axis in (0, 1):
        kept = []
        for p, q in zip(corners, corners[1:] + corners[:1]):
            if p[axis] >= 0.0:
                kept.append(p)
            if (p[axis] < 0.0) != (q[axis] < 0.0):
                kept.append(p + (q - p) * p[axis] / (p[axis] - q[axis]))
        corners = kept
    return np.array(corners).reshape(-1, 2)


def _paving(axes: Any, boxes: IntersectionBoxes) -> None:
    from matplotlib.collections import PolyCollection

    nothing = (0.0, 0.0, 0.0, 0.0)
    styles: tuple[tuple[Interval, str, dict[str, Any]], ...] = (
        (boxes.boundary, "boundary boxes (undecided)", {"facecolor": nothing, "edgecolor": LIGHT["soft"], "lw": 0.4}),
        (boxes.inner, "inner boxes", {"facecolor": LIGHT["c"], "alpha": 0.5, "edgecolor": LIGHT["ink"], "lw": 0.3}),
        (boxes.proved, "proved crossing", {"facecolor": nothing, "edgecolor": LIGHT["jam"], "lw": 2.0}),
    )
    for group, label, style in styles:
        if len(group):
            (x0, y0), (x1, y1) = group.lo.T, group.hi.T
            corners = np.stack([np.column_stack(p) for p in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))], axis=1)
            axes.add_collection(PolyCollection(list(corners), zorder=4, label=label, **style), autolim=False)


def region_picture(problem: CircleEllipse, exaggeration: float | None = None) -> Figure:
    """Draw both differences of circle and ellipse: the free gap and the interference.

    `exaggeration`: factor on the radial distance from the circle in the left picture; by default such that the larger
    difference of the radii becomes a fifth of the radius.  It is written on the picture. Raises `GeometryError` for an
    exaggeration that is not positive.

    >>> from graphsynth.jamming.intersection.hull import circle_ellipse
    >>> len(region_picture(circle_ellipse(5, 6, 4)).axes)
    2
    """
    R, a, b = _middles(problem)
    if exaggeration is None:
        exaggeration = 0.2 * R / max(abs(a - R), abs(R - b), 1e-12 * R)
        unit = 10.0 ** math.floor(math.log10(exaggeration))  # one significant digit, rounded down
        exaggeration = max(1.0, math.floor(exaggeration / unit) * unit)
    if not 0.0 < exaggeration < math.inf:
        raise GeometryError(f"exaggeration = {exaggeration} must be positive; 1 draws to scale")
    # from a crossing, or the end of the nearer axis if there is none
    start = 0.0 if abs(a - R) <= abs(R - b) else 0.5 * math.pi
    if b < R < a:
        start = math.atan2(b * math.sqrt((a - R) * (a + R)), a * math.sqrt((R - b) * (R + b)))
    turn = np.linspace(0.0, math.tau, 2881)
    t = start + turn
    figure = new_figure((10.5, 4.6))
    whole, unrolled = figure.subplots(1, 2)
    _shade(whole, np.stack([np.cos(t), np.sin(t)]), R, R + exaggeration * _distance(R, a, b, t))
    whole.set_aspect("equal")
    scale = "to scale" if exaggeration == 1.0 else f"distance from the circle × {exaggeration:g}"
    dress(whole, f"both differences, {scale}")
    whole.legend(fontsize=8, loc="center")
    distance = _distance(R, a, b, turn)
    for sign, colour in ((1.0, LIGHT["a"]), (-1.0, LIGHT["jam"])):
        where, look = sign * distance > 0.0, {"color": colour, "alpha": 0.45, "lw": 0}
        unrolled.fill_between(np.degrees(turn), distance, 0.0, where=where, interpolate=True, **look)
    unrolled.axhline(0.0, color=LIGHT["ink"], lw=1.2)
    unrolled.plot(np.degrees(turn), distance, color=LIGHT["b"], lw=1.2)
    unrolled.margins(x=0)
    unrolled.set_xticks(np.arange(0.0, 361.0, 45.0))
    dress(unrolled, "unrolled, not exaggerated", "direction from the centre [°]", "distance from the circle")
    return figure


def _shade(axes: Any, along: Array, R: float, oval: Array) -> None:
    circle, ellipse = R * along, oval * along
    for mask, colour, label in (
        (oval > R, LIGHT["a"], "ellipse \\ circle: free gap"),
        (oval < R, LIGHT["jam"], "circle \\ ellipse: interference"),
    ):
        inner, outer = np.minimum(oval, R) * along, np.maximum(oval, R) * along
        edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
        for k, (start, stop) in enumerate(edges.reshape(-1, 2)):
            ring = np.concatenate([outer[:, start:stop], inner[:, start:stop][:, ::-1]], axis=1)
            axes.fill(*ring, color=colour, alpha=0.45, lw=0, label=label if k == 0 else None)
    axes.plot(*circle, color=LIGHT["ink"], lw=1.2, label="circle")
    axes.plot(*ellipse, color=LIGHT["b"], lw=1.2, label="ellipse")
