"""Pictures of the antenna: in space, two models over a sweep, maps of differences, tolerances and folds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import LIGHT, WHITE
from graphsynth.drawing.plots import Line, new_figure, themed_svg
from graphsynth.pipeline.display import chart, unit_in
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.antenna.animation import pointing_animation
from graphsynth.systems.antenna.closed_form import Convention, ModelComparison
from graphsynth.systems.antenna.mechanism import PointingMechanism
from graphsynth.systems.antenna.model import Leg, crank_direction, joints, legs, orientation
from graphsynth.systems.antenna.scene import antenna_of, other_model, table_of, widths_of
from graphsynth.systems.antenna.stages import AntennaMotion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_LEG_Y, _LEG_X, _REST = LIGHT["a"], LIGHT["b"], LIGHT["soft"]


def pointing_picture(
    mechanism: PointingMechanism,
    phi_x: float,
    phi_y: float,
    *,
    s_y: int = 1,
    s_x: int = -1,
    size: tuple[float, float] = (6.6, 6.0),
    plain: bool = False,
) -> Figure:
    """Draw the mechanism in space in one pose: reflector, gimbal axes, both legs, rest position of the reflector.

    Crank angles in radians; `s_y`, `s_x` choose the assembly mode; `plain` leaves out the legend and the axes, for
    small pictures. A `GeometryError` says that the mechanism cannot be assembled there.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> pointing_picture(PointingMechanism(), 0.5, 0.3).axes[0].get_zlabel()
    'z [m]'
    """
    from matplotlib.ticker import MaxNLocator

    poses = mechanism.poses(phi_x, phi_y, s_y, s_x)
    if not poses.assembled:
        raise GeometryError(f"no picture at phi_x = {phi_x}, phi_y = {phi_y}: {poses.reasons()[0]}")
    figure = new_figure(size)
    axes: Any = figure.add_subplot(projection="3d")
    placed, l1, R = joints(mechanism, poses), mechanism.l1, poses.rotation
    _reflector(axes, l1, R, mechanism.order)
    for leg, points, colour in zip(legs(mechanism), placed, (_LEG_Y, _LEG_X)):
        _leg(axes, leg, points, colour)
    everything = np.array([*placed[0], *placed[1], l1 * R[:, 2], [-l1, -l1, 0.0], [l1, l1, 0.0]])
    low, high = everything.min(axis=0), everything.max(axis=0)
    middle, reach = 0.5 * (low + high), 0.55 * float((high - low).max())
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle):
        set_limits(centre - reach, centre + reach)
    axes.set_box_aspect((1, 1, 1), zoom=0.9 if plain else 1.08)
    axes.view_init(elev=22, azim=38)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.tick_params(labelsize=7)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))  # the paper of the page, light or dark
    if plain:
        axes.set_axis_off()
    else:
        figure.legend(loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    cranks = f"cranks φx = {math.degrees(phi_x):.4g}°, φy = {math.degrees(phi_y):.4g}°"
    outputs = f"elevation {math.degrees(float(poses.a)):.4f}°, azimuth {math.degrees(float(poses.b)):.4f}°"
    axes.set_title(outputs if plain else f"{cranks}\n{outputs} (order {mechanism.order})", fontsize=10)
    return figure


def _reflector(axes: Any, l1: float, R: Array, order: str) -> None:
    """Draw the reflector, the outline of its rest position, its normal, and both gimbal axes."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    turn = np.linspace(0.0, math.tau, 73)
    circle = l1 * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], -1)
    axes.plot(*circle.T, color=_REST, lw=0.9, ls=":", label="reflector at rest")
    disc = circle @ R.T
    axes.add_collection3d(Poly3DCollection([disc], facecolor=LIGHT["fill"], edgecolor=LIGHT["ink"], alpha=0.55))
    tip = l1 * R[:, 2]
    axes.plot(*np.array([np.zeros(3), tip]).T, color=LIGHT["c"], lw=1.8, label="normal of the reflector")
    fixed, carried = (np.eye(3)[1], R[:, 0]) if order == "YX" else (np.eye(3)[0], R[:, 1])
    for direction, style, label in ((fixed, "-.", "gimbal axis fixed to the ground"), (carried, "--", "carried axis")):
        axes.plot(*np.outer([-1.25 * l1, 1.25 * l1], direction).T, color=LIGHT["note"], lw=1.0, ls=style, label=label)


def _leg(axes: Any, leg: Leg, points: tuple[Array, Array, Array], colour: str) -> None:
    """Draw crank, rod and arm of one leg, the circle of its crank and the crank axis."""
    pivot, ball, cardan = points
    circle = leg.crank * crank_direction(leg.name, np.linspace(0.0, math.tau, 73))
    axis = np.eye(3)[0 if leg.name == "Y" else 1]
    axes.plot(*(pivot + circle).T, color=colour, lw=0.7, ls=":")
    axes.plot(*(pivot + 0.4 * leg.crank * np.outer([-1.0, 1.0], axis)).T, color=colour, lw=4.5, solid_capstyle="butt")
    axes.plot(*np.array([pivot, ball]).T, color=colour, lw=3.2, label=f"leg {leg.name}: crank (thick) and rod")
    axes.plot(*np.array([ball, cardan]).T, color=colour, lw=1.7)
    axes.plot(*np.array([np.zeros(3), cardan]).T, color=LIGHT["ink"], lw=1.0)
    axes.plot(*ball, "o", color="white", mec=colour, mew=1.8, ms=7)
    axes.plot(*cardan, "s", color="white", mec=colour, mew=1.8, ms=6)
    axes.plot(*pivot, "o", color=colour, ms=6)


def comparison_picture(
    mechanism: PointingMechanism,
    other: PointingMechanism | None = None,
    *,
    reading: Convention | None = None,
    other_reading: Convention | None = None,
    largest: float = math.radians(40.0),
    samples: int = 161,
    working: float = math.radians(15.0),
    size: tuple[float, float] = (11.0, 4.0),
) -> Figure:
    """Draw two models over equal crank angles as the source does (Figure 4): each model, then the means.

    Curves: 1 elevation, 2 azimuth, 3 and 4 the means of the two models, with their difference in minutes of arc.

    `mechanism` is the model of panel b (analytical), `other` that of panel a (block diagram): by default the same
    lengths with the other gimbal order. The sweep ends at `largest`; a dotted line marks `working` (radians).
    """
    other = other or mechanism.other_order()
    phi = np.linspace(0.0, largest, samples)
    found = mechanism.compare(other, phi, reading=reading, other_reading=other_reading)
    degrees = np.degrees(phi)
    figure = new_figure(size)
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, which, name in (
        (panels[0], 1, f"a: model of order {other.order}"),
        (panels[1], 0, f"b: model of order {mechanism.order}"),
    ):
        axes.plot(degrees, np.degrees(found.a[which]), color=_LEG_Y, lw=1.8, label="1 about X (elevation)")
        axes.plot(degrees, np.degrees(found.b[which]), color=_LEG_X, lw=1.8, ls="--", label="2 about Y (azimuth)")
        axes.set_title(name, fontsize=10)
    _means(panels[2], degrees, found, (mechanism.order, other.order))
    for axes in panels:
        axes.axvline(math.degrees(working), color=_REST, lw=0.8, ls=":")
        axes.grid(alpha=0.25)
        axes.set_xlabel("crank angle [°]")
        axes.set_xlim(0.0, degrees[-1])
        axes.set_ylim(bottom=0.0)
    panels[0].set_ylabel("reflector angle [°]")
    for axes in panels[:2]:
        axes.legend(loc="upper left", fontsize=8, frameon=False)
    return figure


def _means(axes: Any, degrees: Array, found: ModelComparison, orders: tuple[str, str]) -> None:
    """Draw the means of both models and, on an axis of its own, their difference."""
    means, difference = np.degrees(found.means), found.arcminutes
    axes.plot(degrees, means[1], color=LIGHT["d"], lw=1.8, label=f"3 mean, order {orders[1]}")
    axes.plot(degrees, means[0], color=LIGHT["c"], lw=1.8, ls="--", label=f"4 mean, order {orders[0]}")
    axes.set_title("c: means of both models", fontsize=10)
    own = axes.get_lines()[-2:]
    twin = axes.twinx()
    twin.plot(degrees, difference, color=LIGHT["note"], lw=1.2, label="difference")
    twin.set_ylabel("difference of means [′]", color=LIGHT["note"])
    seen = difference[np.isfinite(difference)]
    size = max(1.0, float(np.abs(seen).max(initial=0.0)))
    twin.set_ylim((-1.2 * size if seen.min(initial=0.0) < -0.05 * size else 0.0), 4.0 * size)
    if np.isfinite(difference[-1]):
        text = f"{difference[-1]:.2f}′"
        twin.annotate(text, (degrees[-1], difference[-1]), (-6, 8), textcoords="offset points", ha="right", fontsize=9)
    lines = [*own, *twin.get_lines()]
    axes.legend(lines, [line.get_label() for line in lines], loc="upper left", fontsize=8, frameon=False)


def difference_map_picture(
    mechanism: PointingMechanism,
    other: PointingMechanism | None = None,
    *,
    reading: Convention | None = None,
    other_reading: Convention | None = None,
    span: float = math.radians(40.0),
    nodes: int = 81,
    size: tuple[float, float] = (10.0, 4.4),
) -> Figure:
    """Draw the difference of two models over both crank angles, minutes of arc: of the means, and of the beams.

    Models as for `comparison_picture`; `span` is the largest crank angle, radians, `nodes` the grid points along each
    axis. Left: difference of the means of elevation and azimuth. Right: angle between the normals of the reflectors.
    """
    grid = _grid(span, nodes)
    other = other or mechanism.other_order()
    found = mechanism.compare(other, grid[:, None], grid[None, :], reading=reading, other_reading=other_reading)
    orders = (mechanism.order, other.order)
    normals = [orientation(found.a[k], found.b[k], orders[k])[..., :, 2] for k in (0, 1)]
    half = np.minimum(0.5 * np.linalg.norm(normals[0] - normals[1], axis=-1), 1.0)  # of the chord
    drawn = []
    for values, title, colours, below in (
        (found.arcminutes, "difference of the means", "RdBu_r", -1.0),
        (60.0 * np.degrees(2.0 * np.arcsin(half)), "angle between the two beams", "magma_r", 0.0),
    ):
        largest = max(float(np.nanmax(np.abs(values), initial=0.0)), 1e-9)
        drawn.append((values, title, {"cmap": colours, "vmin": below * largest, "vmax": largest}))
    return _maps(grid, drawn, "angle [′]", size)


def _maps(grid: Array, drawn: Any, label: str, size: tuple[float, float]) -> Figure:
    """Draw maps over both crank angles side by side: values, title and options of each."""
    figure, degrees = new_figure(size), np.degrees(grid)
    for axes, (values, title, options) in zip(figure.subplots(1, len(drawn), squeeze=False, sharey=True)[0], drawn):
        axes.set_facecolor(LIGHT["pale"])
        image = axes.pcolormesh(degrees, degrees, values.T, rasterized=True, **options)
        figure.colorbar(image, ax=axes, label=label)
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("φx, crank of leg Y [°]")
        axes.set_aspect("equal")
    figure.axes[0].set_ylabel("φy, crank of leg X [°]")
    return figure


def _grid(span: float, nodes: int, least: int = 2) -> Array:
    """Crank angles from minus to plus the span, radians."""
    if not (math.isfinite(span) and 0.0 < span <= math.pi):
        raise GeometryError(f"span = {span} must be above 0 and at most pi; give the largest crank angle in radians")
    if nodes < least:
        raise GeometryError(f"nodes = {nodes} must be at least {least}")
    return np.linspace(-span, span, nodes)


def fold_map_picture(
    mechanism: PointingMechanism,
    *,
    span: float = math.pi,
    nodes: int = 241,
    s_y: int = 1,
    s_x: int = -1,
    size: tuple[float, float] = (7.4, 5.8),
) -> Figure:
    """Draw how far the mechanism is from a fold over both crank angles, with the folds and dead points themselves.

    `span` is the largest crank angle, radians; at least 16 `nodes` along each axis. Colour: sine of the angle to the
    nearest fold; white: cannot be assembled.
    """
    grid = _grid(span, nodes, 16)
    poses = mechanism.poses(grid[:, None], grid[None, :], s_y, s_x)
    margin = np.where(poses.assembled, np.minimum(poses.margin_y, poses.margin_x), np.nan)
    mode = f"mode ({'+' if s_y > 0 else '−'} {'+' if s_x > 0 else '−'})"
    share = 100.0 * float(poses.assembled.mean())
    title = f"order {mechanism.order}, {mode}: {share:.1f} % of this square can be assembled"
    drawn = [(margin, title, {"cmap": "viridis", "vmin": 0.0, "vmax": 1.0})]
    figure = _maps(grid, drawn, "sine of the angle to the nearest fold", size)
    axes = figure.axes[0]
    axes.set_facecolor(WHITE)
    _singular_points(axes, mechanism, grid, s_y, s_x)
    ends = (math.degrees(grid[0]), math.degrees(grid[-1]))
    axes.set(xlim=ends, ylim=ends)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=2, fontsize=8, frameon=False, markerscale=2.0)
    return figure


def _singular_points(axes: Any, mechanism: PointingMechanism, grid: Array, s_y: int, s_x: int) -> None:
    """Mark folds and dead points of both legs that lie on the drawn mode."""
    wanted = (s_y, s_x)
    for leg, colour in (("Y", "#d62728"), ("X", "#ff9e4a")):
        folded: list[tuple[float, float]] = []
        dead: list[tuple[float, float]] = []
        s_other = s_x if leg == "Y" else s_y
        for other in grid.tolist():
            try:
                folds = mechanism.folds(leg, other, s_other=s_other)
                points = mechanism.dead_points(leg, other, s_other=s_other)
            except GeometryError:  # the other leg does not reach there
                continue
            folded += [(f.phi_x, f.phi_y) for f in folds if math.isfinite(f.a) and math.isfinite(f.b)]
            dead += [(p.phi_x, p.phi_y) for p in points if (p.s_y, p.s_x) == wanted]
        for pairs, marker, size, kind in ((folded, "s", 2.2, "folds"), (dead, ".", 2.0, "dead centres")):
            if pairs:
                shade = colour if kind == "folds" else (WHITE if leg == "Y" else "#ff66cc")
                x, y = np.degrees(np.array(pairs)).T
                edge = {"mec": "#555555", "mew": 0.3} if shade == WHITE else {}
                axes.plot(x, y, marker, ms=size + 1.5 * bool(edge), color=shade, label=f"{kind} of leg {leg}", **edge)


def tolerance_map_picture(
    mechanism: PointingMechanism,
    widths: float | tuple[float, ...] = 5e-5,
    *,
    span: float = math.radians(40.0),
    nodes: int = 17,
    size: tuple[float, float] = (10.0, 4.4),
) -> Figure:
    """Draw the largest certified deviation of each output over both crank angles, seconds of arc (mean-value form).

    `widths` are the tolerances of the lengths, one or five; `span` is the largest crank angle, radians; each of the
    `nodes` along both axes is an interval proof of about ten milliseconds. Undecided cells (a fold in the box, or no
    pose) are hatched.
    """
    grid = _grid(span, nodes)
    worst = np.full((2, nodes, nodes), np.nan)
    for i, x in enumerate(grid.tolist()):
        for j, y in enumerate(grid.tolist()):
            found = mechanism.tolerance(x, y, widths, method="mean_value")
            worst[:, i, j] = [max(map(abs, bounds.deviation)) for bounds in (found.a, found.b)]
    names = (f"{name}, order {mechanism.order}" for name in ("elevation", "azimuth"))
    drawn = [(values, name, {"cmap": "magma_r", "shading": "nearest"}) for values, name in zip(worst, names)]
    figure = _maps(grid, drawn, "largest certified deviation [″]", size)
    for axes in figure.axes[:2]:
        axes.patch.set_hatch("////")
    given = (widths,) if isinstance(widths, int | float) else tuple(dict.fromkeys(widths))
    text = ", ".join(f"{1e3 * w:g}" for w in (given if len(given) == 1 else np.ravel(widths)))
    figure.suptitle(f"lengths ±{text} mm; hatched: undecided", fontsize=11)
    return figure


_FRAMES = 97


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw the mechanism in space, then every assembly mode at the same crank angles."""
    antenna, shown = antenna_of(context), table_of(context).shown
    x, y = shown
    modes = antenna.solve(x, y)
    there = [signs for k, signs in enumerate(modes.signs) if modes.distinct[k]]
    at = f"cranks at {math.degrees(x):g}° and {math.degrees(y):g}°"
    pictures = []
    if (1, -1) in there:
        caption = (
            "Leg Y (crank axis parallel to x) gives the elevation, leg X the azimuth. Squares are universal joints, "
            "open circles ball joints, dotted circles the paths of the crank pins."
        )
        svg = themed_svg(pointing_picture(antenna, x, y))
        pictures.append(Picture(f"The mechanism in space, {at}", svg, caption, "wide"))
    for sy, sx in there:
        name = f"Assembly mode ({'+' if sy > 0 else '−'}, {'+' if sx > 0 else '−'})"
        svg = themed_svg(pointing_picture(antenna, x, y, s_y=sy, s_x=sx, size=(4.4, 4.0), plain=True))
        pictures.append(Picture(name, svg, "The rest pose lies on it." if (sy, sx) == (1, -1) else ""))
    return tuple(pictures)


def animations(context: Context, motion: AntennaMotion) -> tuple[Picture, ...]:
    """Let the reflector scan a figure of eight, or follow equal cranks where a fold forbids that."""
    antenna, largest = antenna_of(context), table_of(context).sweep.largest
    turn = np.linspace(0.0, math.tau, _FRAMES)
    x, y = largest * np.sin(turn), largest * np.sin(2.0 * turn)
    words = "The cranks swing by the largest angle of the sweep, leg X twice as fast as leg Y"
    clear = antenna.poses(np.linspace(-largest, largest, 25)[:, None], np.linspace(-largest, largest, 25))
    if not (clear.assembled.all() and antenna.poses(x, y).assembled.all()):
        far = float(motion.phi[motion.path.reached].max(initial=0.0))
        if far == 0.0:
            return ()
        x = y = far * 0.5 * (1.0 - np.cos(turn))
        words = f"Equal cranks, to and fro up to {math.degrees(far):.4g}°: beyond that the mechanism folds"
    caption = f"{words}. Right: where the beam goes."
    return (Picture("A scan", pointing_animation(antenna, x, y), caption, "wide"),)


def plots(context: Context, motion: AntennaMotion, comparison: ModelComparison) -> tuple[Picture, ...]:
    """Draw Figure 4, the growth of the difference, velocities, passive angles, maps of tolerances and folds."""
    table, antenna = table_of(context), antenna_of(context)
    other, reading = other_model(context)
    largest = table.sweep.largest
    given: dict[str, Any] = {"samples": table.sweep.samples, "working": table.sweep.working, "size": (8.6, 3.7)}
    figure = comparison_picture(antenna, other, other_reading=reading, largest=largest, **given)
    words = "As Figure 4 of the article; a: second model, b: first, c: means and difference. Dotted: working limit."
    pictures = [Picture("Two models over equal crank angles", themed_svg(figure), words, "wide")]
    pictures += _curves(motion, comparison)
    figure = difference_map_picture(antenna, other, other_reading=reading, span=largest)
    words = "Left: what the article compares. Right: how far apart the two models really point."
    pictures.append(Picture("Map of the difference of the two models", themed_svg(figure), words, "wide"))
    widths = tuple(widths_of(context))
    if any(widths):
        figure = tolerance_map_picture(antenna, widths, span=largest, nodes=table.tolerances.map_nodes)
        words = "Mean-value form at every node."
        pictures.append(Picture("Map of the certified deviations", themed_svg(figure), words, "wide"))
    figure = fold_map_picture(antenna, nodes=61, size=(6.4, 6.2))
    pictures.append(Picture("Map of folds and dead centres", themed_svg(figure), "Mode of the rest pose.", "wide"))
    return tuple(pictures)


def _curves(motion: AntennaMotion, comparison: ModelComparison) -> list[Picture]:
    phi, poses, J, passive = motion.phi, motion.path.poses, motion.rates.jacobian, motion.passive.x
    x, minute = "crank angle [°]", unit_in("[′]").to_si(1.0)
    growth = [
        Line(phi, comparison.arcminutes * minute, "means of two models", "a"),
        Line(phi, poses.a - poses.b, "a − b of one model", "b", "--"),
    ]
    slopes = [
        Line(phi, J[:, row, column], f"∂{angle}/∂φ{crank}", colour, style)
        for (row, column, angle, crank), colour, style in zip(
            ((0, 0, "a", "x"), (0, 1, "a", "y"), (1, 0, "b", "x"), (1, 1, "b", "y")), "abcd", ("-", "--", ":", "-.")
        )
    ]
    ratios = "Of the reflector (a elevation, b azimuth) to the cranks (φx leg Y, φy leg X)."
    looks = list(zip(("a", "b", "c", "d", "note"), ("-", "--", "-.", ":", "-")))
    leg_y, leg_x = (
        [Line(phi, passive[:, k], f"x{k + 1}", *look) for k, look in enumerate(looks, first)] for first in (0, 6)
    )
    return [
        chart("Growth of the differences", growth, x, "difference [′]", "Equal cranks; a: elevation, b: azimuth."),
        chart("Velocity ratios", slopes, x, "velocity ratio", ratios),
        chart("Passive angles of leg Y", leg_y, x, "angle [°]", "x1, x2: universal joint; x3, x4, x5: ball joint."),
        chart("Passive angles of leg X", leg_x, x, "angle [°]", "x7, x8: universal joint; x9, x10, x11: ball joint."),
    ]
