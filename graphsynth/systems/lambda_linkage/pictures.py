"""Pictures of the lambda linkage: in its plane, in space with the tilt made visible, its bearing; those of a scene."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.sketch import Sketch, degrees
from graphsynth.pipeline.products import Attempt, Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.drawing.plots import Band, Chart, Line
    from graphsynth.jamming.assess import JammingReport
    from graphsynth.mechanism.four_bar import FourBarPositions, TiltedFourBar
    from graphsynth.systems.lambda_linkage.stages import LambdaMotion

Array = NDArray[np.float64]

#: Crank angles between which the tracing point of the lambda proportions moves nearly straight.
STROKE = (0.5 * math.pi, 1.5 * math.pi)
_SAMPLES = 361
# orthographic projection: seen from the front, the right and above
_TURN, _RAISED = math.radians(-24.0), math.radians(40.0)


def _turn(linkage: TiltedFourBar) -> FourBarPositions:
    return linkage.positions(np.linspace(0.0, math.tau, _SAMPLES))


def lambda_sketch(
    linkage: TiltedFourBar,
    f: float,
    *,
    width: float = 420.0,
    labels: bool = True,
    ring: bool = False,
    stroke: tuple[float, float] | None = STROKE,
) -> Sketch:
    """Build the picture of a lambda linkage in its plane at one crank angle, with the path of the tracing point M.

    `linkage`: with a tilted motor axis its projection on the plane is drawn. `f`: crank angle, radians. `width`:
    pixels. `labels`: name the points O, A, B, C, M. `ring`: put a coloured ring around the bearing at B. `stroke`:
    crank angles of the working stroke, drawn thick; None for none. An angle at which the linkage cannot be assembled
    shows the frame, the path and a word.
    """
    here = linkage.positions(f)
    sketch, lower, upper = _background(
        linkage, width, f"Lambda linkage, crank at {degrees(f)}", stroke if labels else None
    )
    O, C = 0j, complex(linkage.l1, 0.0)
    if not here.assembled:
        sketch.label((lower + upper) / 2, "cannot be assembled")
        return sketch
    a, b, m = (complex(float(p[0]), float(p[1])) for p in (here.A, here.B, here.M))
    offsets = (-18 + 8j, -14 + 10j, 18 + 8j, 20 - 4j, 14 + 14j)
    _draw_links(sketch, (O, a, C, b, m), offsets if labels else (), ring)
    return sketch


def _draw_links(sketch: Sketch, places: Sequence[complex], offsets: Sequence[complex], ring: bool = False) -> None:
    """Draw crank, rocker and coupler with the joints at O, A, C, B and the point M; name those with an offset."""
    O, A, C, B, M = places
    for p, q, colour in ((O, A, "b"), (C, B, "link"), (A, M, "link")):
        sketch.bar(p, q, colour)
    if ring:
        sketch.dot(B, "jam", 10)
    for p in (O, C, A, B):
        sketch.joint(p)
    sketch.dot(M, "a", 5)
    for name, place, offset in zip("OACBM", places, offsets):
        sketch.label(place, name, offset)


def _background(
    linkage: TiltedFourBar, width: float, title: str, stroke: tuple[float, float] | None
) -> tuple[Sketch, complex, complex]:
    """Draw what does not move: ground, crank circle, path of M; return the corners of the picture too."""
    turn = _turn(linkage)
    A, B, M = ((points[:, 0] + 1j * points[:, 1]).tolist() for points in (turn.A, turn.B, turn.M))
    O, C = 0j, complex(linkage.l1, 0.0)
    lower, upper = _corners([p for p in (O, C, *A, *B, *M) if cmath.isfinite(p)])
    # a linkage that cannot be assembled anywhere has no height
    upper += 1j * max(0.0, 0.3 * linkage.l1 - (upper - lower).imag)
    sketch = Sketch(lower, upper, width, title=title)
    sketch.circle(O, linkage.l2, dash=(4.0, 4.0))
    sketch.ground(O)
    sketch.ground(C)
    sketch.trace(M, "a", 2.2, closed=True)
    if stroke is not None:
        path = linkage.positions(np.linspace(*stroke, 121)).M
        sketch.trace((path[:, 0] + 1j * path[:, 1]).tolist(), "c", 4.2)
    return sketch, lower, upper


def lambda_animation(
    linkage: TiltedFourBar,
    jams: Callable[[float], bool] | None = None,
    *,
    frames: int = 90,
    width: float = 420.0,
    seconds: float = 6.0,
) -> str:
    """Return a rotation of the crank as one ``<svg>`` that moves by itself; it says where the bearing at B binds.

    `jams`: tells of a crank angle whether the bearing binds there. `frames`: crank angles shown; of a linkage without a
    full rotation those at which it is assembled. `width`: pixels. `seconds`: time of a rotation. Raises
    `GeometryError` if the linkage cannot be assembled at any of them.
    """
    from graphsynth.drawing.moving import Bar, linkage_animation

    f = np.linspace(0.0, math.tau, frames + 1)
    turn = linkage.positions(f)
    good = np.asarray(turn.assembled, dtype=bool)
    if not good.any():
        raise GeometryError("the linkage cannot be assembled at any crank angle: nothing moves; change its lengths")
    f = f[good]
    tracks: dict[str, ArrayLike] = {
        name: (points[good, 0] + 1j * points[good, 1]) for name, points in (("A", turn.A), ("B", turn.B), ("M", turn.M))
    }
    stuck = [jams is not None and jams(float(angle)) for angle in f]
    notes = {"B binds": stuck, "B is free": [not s for s in stuck]} if jams is not None else {}
    return linkage_animation(
        _background(linkage, width, "Lambda linkage in motion", STROKE)[0],
        {"O": 0j, "C": complex(linkage.l1, 0.0), **tracks},
        bars=(Bar("O", "A", "b"), Bar("C", "B"), Bar("A", "M")),
        joints=("O", "C", "A", "B"),
        dots=("M",),
        notes=notes,
        seconds=seconds,
    )


def _corners(points: Sequence[complex]) -> tuple[complex, complex]:
    """Return the lower left and the upper right corner of a box around points."""
    x, y = [p.real for p in points], [p.imag for p in points]
    return complex(min(x), min(y)), complex(max(x), max(y))


def lambda_sketch_3d(
    linkage: TiltedFourBar, f: float, *, exaggeration: float | None = None, width: float = 520.0
) -> Sketch:
    """Build a picture of the linkage in space: the tilted motor axis, the crank's circle, the rod out of the plane.

    `f`: crank angle, radians, at which the linkage can be assembled. `exaggeration`: factor of all heights above the
    plane; by default one of 1, 2, 5, 10, ... that makes the tilt visible.  It is written in the picture. `width`:
    pixels. An orthographic projection; dashed lines drop from A and M to the plane of the frame. Raises
    `GeometryError`: a factor that is not positive, or an angle at which the linkage cannot be assembled.
    """
    k = exaggeration
    if k is None:  # the largest height of the crank pin becomes about 0.6 of the crank
        wanted = 0.6 * linkage.l2 / linkage.pin_height if linkage.pin_height > 0.0 else 1.0
        decade = 10.0 ** math.floor(math.log10(wanted)) if wanted >= 1.0 else 1.0
        k = max(1.0, *(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= wanted * 1.001))
    if not (math.isfinite(k) and k > 0.0):
        raise GeometryError(f"exaggeration = {k} must be positive and finite")
    here = linkage.positions(f)
    if not here.assembled:
        raise GeometryError(f"the linkage cannot be assembled at the crank angle {f} ({'; '.join(here.reasons())})")
    turn = _turn(linkage)
    view = _View(k)
    O, C = np.zeros(3), np.array([linkage.l1, 0.0, 0.0])
    circle = linkage.l2 * np.stack(
        [np.cos(t) * linkage.rotation[:, 0] + np.sin(t) * linkage.rotation[:, 1] for t in turn.f]
    )
    path = turn.M[turn.assembled]
    # corners of a rectangle in the plane of the frame around the plan of all points
    plan = np.concatenate([circle, path, turn.B[turn.assembled], [O, C]])[:, :2]
    low, high = plan.min(axis=0), plan.max(axis=0)
    edge = 0.06 * (high - low).max()
    (x0, y0), (x1, y1) = low - edge, high + edge
    corners = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    axis = view.normal(linkage.rotation[:, 2])
    long = 1.8 * linkage.l2
    ends = [view(O), view(O) + view.raw(axis * long), view(O) + view.raw(np.array([0.0, 0.0, long]))]
    every = [*view.all(corners), *view.all(circle), *view.all(path), *ends]
    lower, upper = _corners(every)
    title = f"Lambda linkage in space, crank at {degrees(f)}, heights times {k:g}"
    sketch = Sketch(lower, upper, width, 30.0, title)
    sketch.plate(view.all(corners), "soft", 0.8, 0.45)
    sketch.trace(view.all(_flat(circle)), "soft", 1.2, dash=(4.0, 4.0))
    sketch.trace(view.all(circle), "b", 1.6)
    sketch.trace(view.all(turn.M), "a", 2.2)
    sketch.trace([ends[0], ends[2]], "soft", 1.4, dash=(2.0, 3.0))
    sketch.trace([ends[0], ends[1]], "b", 2.2, dash=(9.0, 3.0, 2.0, 3.0))
    for point in (here.A, here.M):
        sketch.trace([view(point), view(_flat(point))], "soft", 1.4, dash=(2.0, 3.0))
        sketch.dot(view(_flat(point)), "soft", 2.6)
    places = [view(point) for point in (O, here.A, C, here.B, here.M)]
    _draw_links(sketch, places, (-16 - 10j, -14 + 11j, 16 - 9j, 18 - 3j, 14 + 12j))
    sketch.label(ends[1], "motor axis", 10j, "middle", "b", 12.5)
    words = "heights to scale" if k == 1.0 else f"heights × {k:g}"
    sketch.label(complex(upper.real, lower.imag), words, -14j, "end", "note", 12.5)
    return sketch


class _View:
    """Orthographic projection of points of space, heights multiplied by a factor first."""

    def __init__(self, factor: float) -> None:
        self.factor = factor
        s, c = math.sin(_TURN), math.cos(_TURN)
        up, back = math.cos(_RAISED), math.sin(_RAISED)
        self._x = np.array([c, -s, 0.0])
        self._y = np.array([s * back, c * back, up])

    def raw(self, point: Array) -> complex:
        """Project a vector whose height is exaggerated already."""
        return complex(float(self._x @ point), float(self._y @ point))

    def __call__(self, point: Array) -> complex:
        return self.raw(np.asarray(point) * [1.0, 1.0, self.factor])

    def all(self, points: Array) -> list[complex]:
        return [self(point) for point in points]

    def normal(self, axis: Array) -> Array:
        """Return the unit normal of the plane that the exaggeration makes of the plane across ``axis``."""
        made = np.array([self.factor * axis[0], self.factor * axis[1], axis[2]])
        return np.asarray(made / np.linalg.norm(made))


def _flat(points: Array) -> Array:
    return np.asarray(points) * [1.0, 1.0, 0.0]


def lambda_tilt_chart(linkage: TiltedFourBar, *, bands: Sequence[Band] = (), levels: Sequence[Line] = ()) -> Chart:
    """Tilt of the coupler at the bearing B over a rotation of the crank, in milliradians; a gap where not assembled.

    `bands`: shaded ranges of crank angle, for example intervals of binding. `levels`: thresholds.
    """
    from graphsynth.drawing.plots import Chart, Line

    turn = _turn(linkage)
    tilt = Line(turn.f, turn.theta * 1e3, "tilt of the coupler")
    return Chart([tilt], "crank angle [rad]", "tilt [mrad]", bands, levels=levels, in_pi=True)


_SHOWN = 6  # crank angles drawn one by one


def _of_scene(
    context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]
) -> tuple[LambdaMotion | None, JammingReport | None]:
    """Return the first motion that was computed, and the first assessment under the condition of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    motion, reports = (next((a.value for a in some if not a.failed), None) for some in (motions, assessments))
    return motion, reports[table.bearing.condition] if reports else None


def sketches(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the linkage with the path of M, then at six crank angles; a bearing that binds has a coloured ring."""
    motion, report = _of_scene(context, motions, assessments)
    if motion is None:
        return ()
    count = len(motion.tilted.f) - 1
    chosen = [round(i * count / _SHOWN) for i in range(_SHOWN)]
    shown = degrees(float(motion.tilted.f[chosen[1]]))
    caption = (
        f"Crank at {shown}. M traces the blue curve; the thick part is the nearly straight working stroke. "
        "A ring around B marks a position in which the bearing binds."
    )
    sketch = _sketch(motion, chosen[1], 420, report, True)
    pictures = [Picture("The linkage and the path of M", sketch, caption, "wide")]
    if motion.linkage.pin_height > 0.0 and motion.tilted.assembled[chosen[1]]:
        caption = (
            "The motor axis is tilted, so the crank pin A leaves the plane of the frame and the rod tilts in its "
            "bearing at B. Heights are drawn larger by the factor written in the picture."
        )
        sketch = lambda_sketch_3d(motion.linkage, float(motion.tilted.f[chosen[1]])).svg()
        pictures.append(Picture("In space", sketch, caption, "wide"))
    for i in chosen:
        angle = float(motion.tilted.f[i])
        caption = f"The bearing at B {'binds' if _binds(report, angle) else 'is free'}."
        sketch = _sketch(motion, i, 250, report, False)
        pictures.append(Picture(f"Crank at {degrees(angle)}", sketch, caption, "small"))
    return tuple(pictures)


def animations(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Show one rotation of the crank; words say where the bearing binds."""
    motion, report = _of_scene(context, motions, assessments)
    if motion is None:
        return ()
    svg = lambda_animation(motion.linkage, lambda angle: _binds(report, angle))
    words = "Blue: the path of M; green: its nearly straight part."
    return (Picture("One rotation of the crank", svg, words, "wide"),)


def _binds(report: JammingReport | None, angle: float) -> bool:
    return report is not None and any(arc.contains(angle) for arc in report.arcs.arcs)


def _sketch(motion: LambdaMotion, i: int, width: float, report: JammingReport | None, labels: bool) -> str:
    """Draw one position in the plane; a bearing that binds has a coloured ring."""
    angle = float(motion.tilted.f[i])
    return lambda_sketch(motion.linkage, angle, width=width, labels=labels, ring=_binds(report, angle)).svg()


def plots(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot tilt of the coupler and interference of the bearing over the crank angle, intervals of binding shaded."""
    _, report = _of_scene(context, motions, assessments)
    if report is None:
        return ()
    from graphsynth.drawing.plots import Band, Line
    from graphsynth.pipeline.display import TURN, chart, unit_in

    condition = context.scene.mechanism.bearing.condition
    table, critical = report.table, report.critical_tilt
    shaded = f"Shaded: the bearing binds under condition {condition}."
    bands: list[Band] = []
    for arc in report.arcs.arcs:  # cut at a full rotation, the first one labelled
        parts = [(arc.start, arc.stop)]
        if arc.stop > math.tau:
            parts = [(arc.start, math.tau), (0.0, arc.stop - math.tau)]
        bands += [Band(start, stop, "" if bands or k else "binds") for k, (start, stop) in enumerate(parts)]
    levels = []
    if critical is not None:
        levels = [Line((), critical, "critical tilt", "soft", "--"), Line((), -critical, "", "soft", "--")]
    tilt = [Line(table.f, table.theta, "tilt of the coupler")]
    mm = unit_in("[mm]").to_si(1.0)
    gaps = [
        Line(table.f, table.interference_a * mm, "condition A"),
        Line(table.f, table.interference_b * mm, "condition B", "c", "--"),
    ]
    words, x = f"Negative: clearance left. {shaded}", "crank angle [°]"
    more: dict[str, Any] = {"bands": bands, "xticks": TURN}
    zero = [Line((), 0.0, "", "soft")]
    return (
        chart("Tilt of the coupler at B", tilt, x, "tilt [mrad]", shaded, levels=levels, **more),
        chart("Interference of bearing and hole", gaps, x, "interference [mm]", words, levels=zero, **more),
    )
