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
    from graphsynth.jamming.bearing.arcs import JamArc
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
    for p, q, colour in ((O, a, "b"), (C, b, "link"), (a, m, "link")):
        sketch.bar(p, q, colour)
    if ring:
        sketch.dot(b, "jam", 10)
    for p in (O, C, a, b):
        sketch.joint(p)
    sketch.dot(m, "a", 5)
    if labels:
        names = {"O": (O, -18 + 8j), "A": (a, -14 + 10j), "C": (C, 18 + 8j), "B": (b, 20 - 4j), "M": (m, 14 + 14j)}
        for name, (point, offset) in names.items():
            sketch.label(point, name, offset)
    return sketch


def _background(
    linkage: TiltedFourBar, width: float, title: str, stroke: tuple[float, float] | None
) -> tuple[Sketch, complex, complex]:
    """Draw what does not move: ground, crank circle, path of M; return the corners of the picture too."""
    turn = _turn(linkage)
    A, B, M = (_plane(points) for points in (turn.A, turn.B, turn.M))
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
        sketch.trace(_plane(linkage.positions(np.linspace(*stroke, 121)).M), "c", 4.2)
    return sketch, lower, upper


def lambda_animation(
    linkage: TiltedFourBar,
    jams: Callable[[float], bool] | None = None,
    *,
    frames: int = 90,
    width: float = 420.0,
    seconds: float = 6.0,
) -> str:
    """Return a turn of the crank as one ``<svg>`` that moves by itself; it says where the bearing at B jams.

    `jams`: tells of a crank angle whether the bearing jams there. `frames`: crank angles shown; of a linkage without a
    full turn those at which it is assembled. `width`: pixels. `seconds`: time of a turn. Raises `GeometryError` if the
    linkage cannot be assembled at any of them.
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
    notes = {"B jams": stuck, "B is free": [not s for s in stuck]} if jams is not None else {}
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


def _plane(points: Array) -> list[complex]:
    """Project positions of shape (n, 3) on the plane of the linkage."""
    return [complex(x, y) for x, y in points[:, :2].tolist()]


def _exaggeration(linkage: TiltedFourBar) -> float:
    """Return the factor 1, 2, 5, 10, ... that makes the largest height of the crank pin about 0.6 of the crank."""
    if linkage.pin_height <= 0.0:
        return 1.0
    wanted = 0.6 * linkage.l2 / linkage.pin_height
    decade = 10.0 ** math.floor(math.log10(wanted)) if wanted >= 1.0 else 1.0
    return max(1.0, *(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= wanted * 1.001))


def lambda_sketch_3d(
    linkage: TiltedFourBar, f: float, *, exaggeration: float | None = None, width: float = 520.0
) -> Sketch:
    """Build a picture of the linkage in space: the tilted motor axis, the crank's circle, the rod out of the plane.

    `f`: crank angle, radians, at which the linkage can be assembled. `exaggeration`: factor of all heights above the
    plane; by default one of 1, 2, 5, 10, ... that makes the tilt visible.  It is written in the picture. `width`:
    pixels. An orthographic projection; dashed lines drop from A and M to the plane of the frame. Raises
    `GeometryError`: a factor that is not positive, or an angle at which the linkage cannot be assembled.
    """
    k = _exaggeration(linkage) if exaggeration is None else exaggeration
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
    corners = _ground_plane(np.concatenate([circle, path, turn.B[turn.assembled], [O, C]]))
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
    for p, q, colour in ((O, here.A, "b"), (C, here.B, "link"), (here.A, here.M, "link")):
        sketch.bar(view(p), view(q), colour)
    for p in (O, C, here.A, here.B):
        sketch.joint(view(p))
    sketch.dot(view(here.M), "a", 5)
    sketch.label(ends[1], "motor axis", 10j, "middle", "b", 12.5)
    points = {"O": O, "A": here.A, "C": C, "B": here.B, "M": here.M}
    for (name, point), offset in zip(points.items(), (-16 - 10j, -14 + 11j, 16 - 9j, 18 - 3j, 14 + 12j)):
        sketch.label(view(point), name, offset)
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
        """Project many points; NaN stays NaN."""
        return [self(point) for point in points]

    def normal(self, axis: Array) -> Array:
        """Return the unit normal of the plane that the exaggeration makes of the plane across ``axis``."""
        made = np.array([self.factor * axis[0], self.factor * axis[1], axis[2]])
        return np.asarray(made / np.linalg.norm(made))


def _flat(points: Array) -> Array:
    return np.asarray(points) * [1.0, 1.0, 0.0]


def _ground_plane(points: Array) -> Array:
    """Corners of a rectangle in the plane of the frame around the plan of all points."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    edge = 0.06 * (high - low).max()
    (x0, y0), (x1, y1) = low - edge, high + edge
    return np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])


def lambda_tilt_chart(linkage: TiltedFourBar, *, bands: Sequence[Band] = (), levels: Sequence[Line] = ()) -> Chart:
    """Tilt of the coupler at the bearing B over a turn of the crank, in milliradians; a gap where not assembled.

    `bands`: shaded ranges of crank angle, for example jam arcs. `levels`: thresholds.
    """
    from graphsynth.drawing.plots import Chart, Line

    turn = _turn(linkage)
    tilt = Line(turn.f, turn.theta * 1e3, "tilt of the coupler")
    return Chart([tilt], "crank angle [rad]", "tilt [mrad]", bands, levels=levels, in_pi=True)


_SHOWN = 6  # crank angles drawn one by one


def _first(attempts: tuple[Attempt, ...]) -> Attempt | None:
    return next((a for a in attempts if not a.failed), None)


def sketches(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Draw the linkage with the path of M, then at six crank angles; a bearing that jams has a coloured ring."""
    moved, assessed = _first(motions), _first(assessments)
    if moved is None:
        return ()
    motion: LambdaMotion = moved.value
    arcs = assessed.value[_condition(context)].arcs.arcs if assessed else ()
    count = len(motion.tilted.f) - 1
    chosen = [round(i * count / _SHOWN) for i in range(_SHOWN)]
    shown = degrees(float(motion.tilted.f[chosen[1]]))
    caption = (
        f"Crank at {shown}. M traces the blue curve; the thick part is the nearly straight working stroke. "
        "A ring around B marks a position in which the bearing jams."
    )
    pictures = [Picture("The linkage and the path of M", _sketch(motion, chosen[1], 420, arcs, True), caption, "wide")]
    pictures += _in_space(motion, chosen[1])
    for i in chosen:
        angle = float(motion.tilted.f[i])
        caption = f"The bearing at B {'jams' if _jams(arcs, angle) else 'is free'}."
        sketch = _sketch(motion, i, 250, arcs, False)
        pictures.append(Picture(f"Crank at {degrees(angle)}", sketch, caption, "small"))
    return tuple(pictures)


def animations(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Show one turn of the crank; words say where the bearing jams."""
    moved, assessed = _first(motions), _first(assessments)
    if moved is None:
        return ()
    arcs = assessed.value[_condition(context)].arcs.arcs if assessed else ()
    svg = lambda_animation(moved.value.linkage, lambda angle: _jams(arcs, angle))
    return (Picture("One turn of the crank", svg, "Blue: the path of M; green: its nearly straight part.", "wide"),)


def _in_space(motion: LambdaMotion, i: int) -> list[Picture]:
    """Draw the tilted linkage in space, if it is tilted and assembled there."""
    angle = float(motion.tilted.f[i])
    if motion.linkage.pin_height <= 0.0 or not motion.tilted.assembled[i]:
        return []
    caption = (
        "The motor axis is tilted, so the crank pin A leaves the plane of the frame and the rod tilts in its "
        "bearing at B. Heights are drawn larger by the factor written in the picture."
    )
    return [Picture("In space", lambda_sketch_3d(motion.linkage, angle).svg(), caption, "wide")]


def _condition(context: Context) -> str:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table.bearing.condition


def _jams(arcs: tuple[JamArc, ...], angle: float) -> bool:
    return any(arc.contains(angle) for arc in arcs)


def _sketch(motion: LambdaMotion, i: int, width: float, arcs: tuple[JamArc, ...], labels: bool) -> str:
    """Draw one position in the plane; a bearing that jams has a coloured ring."""
    angle = float(motion.tilted.f[i])
    return lambda_sketch(motion.linkage, angle, width=width, labels=labels, ring=_jams(arcs, angle)).svg()


def plots(context: Context, motions: tuple[Attempt, ...], assessments: tuple[Attempt, ...]) -> tuple[Picture, ...]:
    """Plot the tilt of the coupler and the interference of the bearing over the crank angle, jam arcs shaded."""
    assessed = _first(assessments)
    if assessed is None:
        return ()
    from graphsynth.drawing.plots import Line
    from graphsynth.pipeline.display import TURN, chart, unit_in

    condition = _condition(context)
    report: JammingReport = assessed.value[condition]
    table, bands, critical = report.table, _jam_bands(report), report.critical_tilt
    shaded = f"Shaded: the bearing jams under condition {condition}."
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


def _jam_bands(report: JammingReport) -> list[Band]:
    """Return the jam arcs, cut at a full rotation, the first one labelled."""
    from graphsynth.drawing.plots import Band

    spans = [_within_turn(arc.start, arc.stop) for arc in report.arcs.arcs]
    pieces = [piece for span in spans for piece in span]
    return [Band(start, stop, "jams" if i == 0 else "") for i, (start, stop) in enumerate(pieces)]


def _within_turn(start: float, stop: float) -> list[tuple[float, float]]:
    """Cut an arc that runs past a full rotation into pieces inside."""
    return [(start, stop)] if stop <= math.tau else [(start, math.tau), (0.0, stop - math.tau)]
