"""The braider of a scene: start-up, sensors over a turn, the limit L -> 0; what is said and drawn of them."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.dynamics.motors import SynchronousMotor, Train
from graphsynth.pipeline.display import TURN, balance_rows, chart, limit_table, quantity_table, table
from graphsynth.pipeline.products import Finding, Picture, Quantity, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.braider.linkage import FourBar
from graphsynth.systems.braider.model import Braider, Thread
from graphsynth.systems.braider.reactions import JointForces, reactions, run_reactions

if TYPE_CHECKING:
    from graphsynth.drawing.plots import Line
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun

#: Joint, body that is acted on and by which.
JOINTS = ("O1: frame on crank", "A: crank on coupler", "B: coupler on rocker", "O2: frame on rocker")
_SHORT = ("O1", "A", "B", "O2")
_SHOWN = 6  # crank angles drawn one by one
_CRANK, _ANGLE, _RATE = "crank angle [°]", "angle of the link [°]", "angular velocity [rad/s]"
_SIZE = "size of the reaction [mN]"
_ROTOR = "In the frame of the rotor; i_q makes the torque."


def braider_of(context: Context) -> Braider:
    """Build the mechanism of the scene; a number that makes no sense is an error of the scene."""

    def values(part: Any) -> list[Any]:
        return [getattr(part, item.name) for item in fields(part)]

    t: Any = context.scene.mechanism
    try:
        return Braider(
            linkage=FourBar(*values(t.linkage)),
            switch=t.switch.length,
            switch_angle=t.switch.angle,
            masses=tuple(values(t.masses)),
            thread=Thread(t.thread.weight, complex(*t.thread.guide), t.thread.height, t.thread.gravity),
            motor=SynchronousMotor(*values(t.motor)),
            train=Train.of_teeth(*values(t.train)),
        )
    except (SpecError, GeometryError) as error:
        raise (context.scene.place / "mechanism").error(f"cannot be built: {error}") from error


def start_up(context: Context) -> DriveRun:
    """Integrate from rest with all currents."""
    start: Any = context.scene.mechanism.start
    braider = braider_of(context)
    try:
        times = start.end * np.linspace(0.0, 1.0, start.samples) ** 2  # close together where the current rises
        return braider.simulate(times, rtol=start.tolerance)
    except SpecError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be started: {error}") from error


def sensors(context: Context) -> JointForces:
    """Return the reactions of the four joints over a turn at constant crank speed."""
    own: Any = context.scene.mechanism
    return reactions(braider_of(context), np.linspace(0.0, math.tau, own.positions + 1), own.speed, 0.0)


def inductance(context: Context) -> ReductionStudy | None:
    """Compare several inductances with the limit L -> 0; None if the scene names none."""
    own: Any = context.scene.mechanism
    if not own.inductances_H:
        return None
    try:
        return braider_of(context).inductance_study(np.linspace(0.0, own.start.end, 51), own.inductances_H)
    except SpecError as error:
        raise (context.scene.place / "mechanism").error(f"has inductances_H that cannot be compared: {error}") from None


def assess(
    context: Context, run: DriveRun, turn: JointForces, study: ReductionStudy | None
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict on the start-up and the tables."""
    braider = braider_of(context)
    tables = [Table("How the start-up was computed", ("", ""), balance_rows(run))]
    if not run.complete:
        record = Record(status="failed", recognised_as="braider", reason=run.reason)
    else:
        margins = _margins(context, braider, run)
        record = _verdict(context, margins)
        note = "Settling: the first time after which the speed stays inside."
        tables.insert(0, quantity_table("Start-up", margins, note))
        tables.append(_along_table(braider, run))
    tables += [_sensor_table(braider, turn), _second_way_table(braider, turn)]
    if study is not None:
        tables.append(limit_table(study))
    return (record,), tuple(tables)


def _band(start: Any) -> str:
    return f"±{100 * start.band:g} % of {start.target:g} rad/s"


def _verdict(context: Context, margins: tuple[Quantity, ...]) -> Record:
    start: Any = context.scene.mechanism.start
    settling, band = margins[0].value, _band(start)
    good = math.isfinite(settling)
    words = f"stays within {band} from {settling:.4f} s on" if good else f"does not stay within {band}"
    return Record(recognised_as="braider", verdict=f"{words} (estimated)", good=good, margins=margins)


def _margins(context: Context, braider: Braider, run: DriveRun) -> tuple[Quantity, ...]:
    start: Any = context.scene.mechanism.start
    w_error, inertia, ratio = float(run.error[1]), braider.reflected_inertia, braider.train.ratio
    bands = (start.band, start.band / 2)
    fine, coarse = (
        [braider.settling(start.target, band, start.end, samples=n).time for band in bands] for n in (2001, 1001)
    )
    (least, most), rough = (braider.steady_range(samples=n) for n in (720, 500))
    peak, spacing = braider.largest_current(run), float(np.diff(run.time).max())
    moment = float(np.nanmax(np.abs(braider.load_moment(np.linspace(0.0, math.tau, 361)))))
    ripple_error = abs(least - rough[0]) + abs(most - rough[1])
    settled = [
        Quantity(f"settling time, ±{100 * band:g} %", a, "s", "estimated", abs(a - b) + 1e-12)
        for band, a, b in zip(bands, fine, coarse)
    ]
    return (
        *settled,
        Quantity(f"crank speed at {start.end:g} s", float(run.speed[-1]), "rad/s", "estimated", w_error),
        Quantity(f"crank angle at {start.end:g} s", float(run.angle[-1]), "rad", "estimated", float(run.error[0])),
        Quantity("ripple of the steady speed, peak to peak", most - least, "rad/s", "estimated", ripple_error),
        Quantity("largest current i_q", peak.value, "A", "estimated", peak.error + float(run.error[-1])),
        Quantity("smallest speed of the steady motion", least, "rad/s", "estimated", abs(least - rough[0])),
        Quantity("largest speed of the steady motion", most, "rad/s", "estimated", abs(most - rough[1])),
        Quantity("time of the largest current", peak.time, "s", "estimated", spacing / 200.0),
        Quantity("largest moment of the thread about O2", 0.0 if moment < 1e-15 else moment, "N m", "estimated", 1e-15),
        Quantity("inertia of rotor and train at the crank", inertia, "kg m^2", "exact", 4.0 * math.ulp(inertia)),
        Quantity("ratio of the train", ratio, "", "exact", 4.0 * math.ulp(ratio)),
    )


def _along_table(braider: Braider, run: DriveRun) -> Table:
    """Reactions during the start-up at a few of its times."""
    found = run_reactions(braider, run)
    last = run.time.size - 1
    shares = (0.002, 0.01, 0.02, 0.04, 0.1, 0.22, 0.5, 1.0)
    chosen = sorted({max(1, round(last * math.sqrt(share))) for share in shares})
    sizes = found.magnitudes()
    rows = ((run.time[k], found.speed[k], found.acceleration[k], *sizes[k], found.torque[k]) for k in chosen)
    columns = (
        "time [s] | .4g",
        "speed [rad/s] | .8g",
        "acceleration [rad/s²] | .6g",
        *(f"{name} [mN] | .7g" for name in _SHORT),
        "torque [mN m] | .7g",
    )
    note = f"Sizes of the reactions, on estimated states; power balance to {found.power_error:.0e}."
    return table("Reactions during the start-up", columns, rows, note, *_largest("During the start-up", found))


def _largest(when: str, found: JointForces) -> tuple[Finding, ...]:
    """Say what each joint carries at most; nothing if the linkage is never assembled."""
    sizes = found.magnitudes()
    sizes = sizes[np.isfinite(sizes).all(axis=1)]
    if not sizes.size:
        return ()
    largest = ", ".join(f"{1e3 * size:.4g}" for size in sizes.max(axis=0))
    return (Finding(f"{when} the joints O1, A, B, O2 carry at most {largest} mN (estimated, largest sample)."),)


def _sensor_table(braider: Braider, turn: JointForces) -> Table:
    """Lay out the four sensors every 45 degrees of the crank."""
    relative, forces = _relative(braider, turn), turn.forces()
    rows = []
    for k in sorted({round(i * (turn.theta.size - 1) / 8) for i in range(8)}):
        plane = [f"({1e3 * x:.6g}, {1e3 * y:.6g})" for x, y in forces[k]]
        pairs = [part for pair in zip(relative[k], plane) for part in pair]
        rows.append((turn.theta[k], *pairs, turn.torque[k]))
    names = [name for joint in _SHORT for name in (f"{joint}: w [rad/s] | 12 .7g", f"{joint}: F [mN]")]
    speed = f"{turn.speed[0]:g} rad/s"
    note = (
        f"Crank at {speed}: relative angular velocity of the two links and force (x, y) in the fixed frame, "
        f"{'; '.join(JOINTS)}. From the general dynamics; power balance to {turn.power_error:.0e}."
    )
    columns = ("crank [°] | g", *names, "torque [µN m] | .7g")
    return table("Sensors over one rotation", columns, rows, note, *_largest(f"Over one rotation at {speed}", turn))


def _relative(braider: Braider, turn: JointForces) -> NDArray[np.float64]:
    """Angular velocities of the two links of each joint against each other, (n, 4)."""
    state = braider.linkage.motion(turn.theta)
    w2, w3 = state.k2 * turn.speed, state.k3 * turn.speed
    return np.stack([turn.speed, w2 - turn.speed, w3 - w2, w3], axis=1)


def _second_way_table(braider: Braider, turn: JointForces) -> Table:
    """Say how far the reactions agree with the equilibrium of every body."""
    title = "Reactions, independent cross-check"
    if not math.isfinite(turn.second_way) or turn.second_way == 0.0:
        return Table(title, ("",), (), "The linkage cannot be assembled at any angle compared.")
    rows = (
        ("largest difference of a force, relative to the largest", f"{turn.second_way:.1e}"),
        ("power of torque and thread against the kinetic energy in closed form", f"{turn.power_error:.1e}"),
    )
    note = (
        "The reactions are the multipliers of the planar model in nine absolute coordinates; the cross-check is the "
        "equilibrium of every body, at up to forty crank angles."
    )
    return Table(title, ("", ""), rows, note)


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time of the integrator and of scipy's; not part of the shipped outputs."""
    from graphsynth.evidence.drives import drive_work_precision
    from graphsynth.pipeline.display import work_table

    found = drive_work_precision(braider_of(context), np.linspace(0.0, context.scene.mechanism.start.end, 11))
    return (work_table(found),)


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw the linkage large with its names and the path of the tip, then small at six crank angles."""
    braider = braider_of(context)
    turn = np.linspace(0.0, math.tau, 361)
    reached = turn[np.isfinite(braider.linkage.motion(turn).k3)]
    if reached.size == 0:
        return ()
    from graphsynth.drawing.sketch import degrees

    shown = float(reached[np.argmin(np.abs(reached - 1.0))])
    caption = (
        f"Crank at {degrees(shown)}. The crank O1A moves the rocker BO2 through the coupler AB; the switch O2C is "
        "rigid with the rocker. From its tip C the thread (dashed) runs to the guide G above the plane. The curves are "
        "the paths of B and C."
    )
    angles = [float(reached[round(i * (reached.size - 1) / _SHOWN)]) for i in range(_SHOWN)]
    small = [Picture(f"Crank at {degrees(x)}", _sketch(braider, x, reached, 250, False), "", "small") for x in angles]
    return (Picture("The mechanism", _sketch(braider, shown, reached, 620, True), caption, "wide"), *small)


def _points(braider: Braider, theta: Any) -> tuple[Any, Any, Any]:
    """Positions of A, B and C, m."""
    state = braider.linkage.motion(theta)
    return state.crank, braider.linkage.frame + state.rocker, braider.tip(theta)


def _sketch(braider: Braider, angle: float, reached: NDArray[np.float64], width: float, large: bool) -> str:
    from graphsynth.drawing.sketch import Sketch, degrees

    paths = _points(braider, reached)
    A, B, C = (complex(p) for p in _points(braider, angle))
    far, guide = complex(braider.linkage.frame), braider.thread.guide
    corners = [0j, far, guide, *paths[0], *paths[1], *paths[2]]
    lower = complex(min(z.real for z in corners), min(z.imag for z in corners))
    upper = complex(max(z.real for z in corners), max(z.imag for z in corners))
    sketch = Sketch(
        lower,
        upper,
        width,
        40 if large else 18,
        f"Braiding mechanism, crank at {degrees(angle)}",
        symbol=1.0 if large else 0.6,
    )
    sketch.trace(list(paths[1]), "c", 1.4)
    sketch.trace(list(paths[2]), "a", 1.8)
    sketch.plate((far, B, C))
    sketch.trace([C, guide], "b", 2.4, dash=(6.0, 5.0))
    sketch.ground(0j)
    sketch.ground(far)
    sketch.bar(0j, A, width=5)
    sketch.bar(A, B)
    for point in (0j, A, B, far):
        sketch.joint(point)
    sketch.dot(C, "a", 4.5)
    sketch.dot(guide, "b", 4.0)
    if large:
        middle = (A + B + C + far) / 4
        sketch.label(0j, "O1", -24 + 4j)
        for name, at in (("A", A), ("B", B), ("C", C)):
            sketch.label(at, name, 20 * (at - middle) / abs(at - middle))
        sketch.label(far, "O2", 26 + 4j)
        same = abs(guide - far) < 0.2 * braider.linkage.frame
        sketch.label(guide, "G", (24 + 22j) if same else (14 + 14j))
    return sketch.svg()


def animations(context: Context) -> tuple[Picture, ...]:
    """Let the linkage turn in the page at the crank speed of the sensors."""
    from graphsynth.drawing.animation import animated_svg

    own: Any = context.scene.mechanism
    bar = braider_of(context).linkage
    arcs = bar.reach()
    if not arcs:
        return ()
    low, high = (0.0, math.tau) if bar.turns_fully else arcs[-1]
    theta = np.linspace(low, high, 181)
    motion = braider_of(context).motion(theta[np.isfinite(bar.motion(theta).k3)])
    seconds = abs((high - low) / own.speed)
    svg = animated_svg(motion, title="Braiding mechanism", seconds=seconds, width=620)
    caption = f"In real time with the crank at {own.speed:g} rad/s; links 1 crank, 2 coupler, 3 rocker with switch."
    return (Picture("The linkage in motion", svg, caption, "wide"),)


def plots(context: Context, run: DriveRun, turn: JointForces, study: ReductionStudy | None) -> tuple[Picture, ...]:
    """Curves of the start-up, then of the turn, then the limit L -> 0."""
    from graphsynth.drawing.drive_pictures import reduction_picture
    from graphsynth.drawing.plots import themed_svg

    braider = braider_of(context)
    pictures = [*_start_pictures(context, braider, run), *_turn_pictures(braider, turn)]
    if study is not None:
        svg = themed_svg(reduction_picture(study, size=(5.4, 3.4)))
        words = "Largest differences from the motor without inductance after the electrical transient"
        pictures.append(Picture("The limit L → 0", svg, f"{words}: of first order in L."))
    return tuple(pictures)


def _lines(x: Any, columns: Any, names: tuple[str, ...]) -> list[Line]:
    from graphsynth.drawing.plots import Line

    styles = (("a", "-"), ("b", "--"), ("c", "-."), ("d", ":"))
    return [Line(x, columns[:, k], name, *styles[k]) for k, name in enumerate(names)]


def _start_pictures(context: Context, braider: Braider, run: DriveRun) -> list[Picture]:
    from graphsynth.drawing.plots import Line

    start: Any = context.scene.mechanism.start
    t, x, found, links = run.time, "time [ms]", run_reactions(braider, run), braider.link_motion(run).speed
    low, high = (Line((), start.target * (1.0 + sign * start.band), "", "soft", "--") for sign in (-1, 1))
    torques = _lines(t, np.column_stack([found.torque, run.motor_torque]), ("on the crank", "of the motor"))
    step = f"From rest by a step of the voltage; dashed: {_band(start)}."
    rest = "From rest (0, 0): the current rises at once, then the speed takes it down."
    phase, crank = [Line(run.currents[:, -1], run.speed)], [Line(t, run.speed, "crank speed")]
    names = ("crank", "coupler", "rocker, switch")
    shown: tuple[tuple[Any, ...], ...] = (
        ("currents of the motor", _lines(t, run.currents, ("i_d", "i_q")), x, "current [A]", _ROTOR),
        ("phase portrait", phase, "current i_q [A]", "crank speed [rad/s]", rest),
        ("angular velocities of the links", _lines(t, links, names), x, "angular velocity [rad/s]", ""),
        ("reactions in the joints", _lines(t, found.magnitudes(), _SHORT), x, _SIZE, ""),
        ("torque", torques, x, "torque [mN m]", "Behind the train, and of the motor before it."),
    )
    band = [replace(high, label="band"), low]
    first = chart("Start-up: crank speed", crank, x, "crank speed [rad/s]", step, levels=band)
    return [first, *(chart(f"Start-up: {title}", lines, *labels) for title, lines, *labels in shown)]


def _turn_pictures(braider: Braider, turn: JointForces) -> list[Picture]:
    from graphsynth.drawing.plots import Line

    theta, state, forces = turn.theta, braider.linkage.motion(turn.theta), turn.forces()
    at = f"Crank at {turn.speed[0]:g} rad/s."
    paths = [replace(line, x=forces[:, k, 0]) for k, line in enumerate(_lines((), forces[:, :, 1], _SHORT))]
    swings = [
        Line(state.phi3, state.k3 * turn.speed, "rocker, switch", "a"),
        Line(state.phi2, state.k2 * turn.speed, "coupler", "b", "--"),
    ]
    sizes, relative = _lines(theta, turn.magnitudes(), _SHORT), _lines(theta, _relative(braider, turn), _SHORT)
    inertia = [Line(theta, braider.effective_inertia(theta)[0] - braider.reflected_inertia)]
    moment = braider.load_moment(theta)
    both = _lines(theta, np.column_stack([moment, moment * state.k3]), ("on the switch", "at the crank"))
    pairs, drives = f"{at} Of the two links of each joint.", "At the crank: positive where it drives."
    constant = "The rotor behind the train adds a constant that is far larger."
    torque = "torque on the crank [µN m]"
    over, polar = {"xticks": TURN}, {"equal": True, "size": (5.4, 4.2)}
    vectors = f"{at} Paths of the force vectors in the fixed frame."
    shown: list[tuple[Any, ...]] = [
        ("Sensors: relative angular velocities", relative, _CRANK, _RATE, pairs, over),
        ("Sensors: reactions", sizes, _CRANK, _SIZE, f"{at} {'; '.join(JOINTS)}.", over),
        ("Sensors: polar plot of the reactions", paths, "F_x [mN]", "F_y [mN]", vectors, polar),
        ("Sensors: torque on the crank", [Line(theta, turn.torque)], _CRANK, torque, at, over),
        ("Phase portraits of coupler and rocker", swings, _ANGLE, _RATE, f"{at} Each closes after one rotation.", {}),
        ("Inertia of the links at the crank", inertia, _CRANK, "inertia of the links [kg mm²]", constant, over),
        ("Load of the thread", both, _CRANK, "moment of the thread [mN m]", drives, over),
    ]
    if not np.nanmax(np.abs(moment)) > 1e-12:  # a guide above O2 leaves no moment
        shown.pop()
    return [chart(*parts, **options) for *parts, options in shown]
