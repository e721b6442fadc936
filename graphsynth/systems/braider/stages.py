"""The braider of a scene: start-up, sensors over a turn, the limit L -> 0, what is said about them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.pipeline.display import balance_rows, limit_table, quantity_table
from graphsynth.pipeline.products import Finding, Quantity, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.braider.system import BraiderTable

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.systems.braider.model import Braider
    from graphsynth.systems.braider.reactions import Reactions

#: Joint, body that is acted on and by which.
JOINTS = ("O1: frame on crank", "A: crank on coupler", "B: coupler on rocker", "O2: frame on rocker")


def table_of(context: Context) -> BraiderTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, BraiderTable)
    return table


def braider_of(context: Context) -> Braider:
    """Build the mechanism of the scene; a number that makes no sense is an error of the scene."""
    from graphsynth.dynamics.motors import SynchronousMotor, Train
    from graphsynth.systems.braider.linkage import FourBar
    from graphsynth.systems.braider.model import Braider, Thread

    t = table_of(context)
    m = t.motor
    try:
        return Braider(
            linkage=FourBar(
                t.linkage.crank_mm / 1e3, t.linkage.coupler_mm / 1e3, t.linkage.rocker_mm / 1e3,
                t.linkage.frame_mm / 1e3, t.linkage.branch,
            ),
            switch=t.switch.length_mm / 1e3,
            switch_angle=math.radians(t.switch.angle_deg),
            masses=(t.masses.crank_g / 1e3, t.masses.coupler_g / 1e3, t.masses.rocker_g / 1e3, t.masses.switch_g / 1e3),
            thread=Thread(
                t.thread.weight_g / 1e3, complex(*t.thread.guide_mm) / 1e3, t.thread.height_mm / 1e3,
                t.thread.gravity_m_s2,
            ),
            motor=SynchronousMotor(
                m.pole_pairs, m.resistance_ohm, m.inductance_H, m.flux_V_s, m.ud_V, m.uq_V, m.rotor_inertia_kg_m2,
                m.friction_Nm_s_per_rad,
            ),
            train=Train.of_teeth(t.train.stages, t.train.efficiency, t.train.inertia_kg_m2),
        )  # fmt: skip
    except (SpecError, GeometryError) as error:
        raise (context.scene.place / "mechanism").error(f"cannot be built: {error}") from error


def start_up(context: Context) -> DriveRun:
    """Integrate from rest with all currents."""
    import numpy as np

    start = table_of(context).start
    braider = braider_of(context)
    try:
        times = start.end_s * np.linspace(0.0, 1.0, start.samples) ** 2  # close together where the current rises
        return braider.simulate(times, rtol=start.tolerance)
    except SpecError as error:
        raise (context.scene.place / "mechanism").error(f"cannot be started: {error}") from error


def sensors(context: Context) -> Reactions:
    """Return the reactions of the four joints over a turn at constant crank speed."""
    import numpy as np

    from graphsynth.systems.braider.reactions import reactions

    table = table_of(context)
    theta = np.linspace(0.0, math.tau, table.positions + 1)
    return reactions(braider_of(context), theta, table.speed_rad_s, 0.0)


def inductance(context: Context) -> ReductionStudy | None:
    """Compare several inductances with the limit L -> 0; None if the scene names none."""
    import numpy as np

    table = table_of(context)
    if not table.inductances_H:
        return None
    times = np.linspace(0.0, table.start.end_s, 51)
    try:
        return braider_of(context).inductance_study(times, table.inductances_H)
    except SpecError as error:
        raise (context.scene.place / "mechanism").error(f"has inductances_H that cannot be compared: {error}") from None


def judge(
    context: Context, run: DriveRun, turn: Reactions, study: ReductionStudy | None
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict on the start-up and the tables."""
    braider = braider_of(context)
    tables = [Table("How the start-up was had", ("", ""), balance_rows(run))]
    if not run.complete:
        record = Record(status="failed", recognised_as="braider", reason=run.reason)
    else:
        margins = _margins(context, braider, run)
        record = _verdict(context, margins)
        tables.insert(
            0, quantity_table("Start-up", margins, "Settling: the first time after which the speed stays inside.")
        )
        tables.append(_along_table(braider, run))
    tables += [_sensor_table(context, braider, turn), _second_way_table(braider, turn)]
    if study is not None:
        tables.append(limit_table(study))
    return (record,), tuple(tables)


def _verdict(context: Context, margins: tuple[Quantity, ...]) -> Record:
    start = table_of(context).start
    settling = margins[0].value
    band = f"±{100 * start.band:g} % of {start.target_rad_s:g} rad/s"
    good = math.isfinite(settling)
    words = f"stays within {band} from {settling:.4f} s on" if good else f"does not stay within {band}"
    return Record(recognised_as="braider", verdict=f"{words} (estimated)", good=good, margins=margins)


def _margins(context: Context, braider: Braider, run: DriveRun) -> tuple[Quantity, ...]:
    import numpy as np

    start = table_of(context).start
    w_error, inertia, ratio = float(run.error[1]), braider.reflected_inertia, braider.train.ratio
    bands = (start.band, start.band / 2)
    fine, coarse = (
        [braider.settling(start.target_rad_s, band, start.end_s, samples=n).time for band in bands]
        for n in (2001, 1001)
    )
    steady, rough = (braider.steady_range(samples=n) for n in (720, 500))
    peak = braider.largest_current(run)
    spacing = float(np.diff(run.time).max())
    moment = float(np.nanmax(np.abs(braider.load_moment(np.linspace(0.0, math.tau, 361)))))
    settled = [
        Quantity(f"settling time, ±{100 * band:g} %", a, "s", "estimated", abs(a - b) + 1e-12)
        for band, a, b in zip(bands, fine, coarse)
    ]
    return (
        *settled,
        Quantity(f"crank speed at {start.end_s:g} s", float(run.speed[-1]), "rad/s", "estimated", w_error),
        Quantity(f"crank angle at {start.end_s:g} s", float(run.angle[-1]), "rad", "estimated", float(run.error[0])),
        Quantity("least speed of the steady motion", steady[0], "rad/s", "estimated", abs(steady[0] - rough[0])),
        Quantity("largest speed of the steady motion", steady[1], "rad/s", "estimated", abs(steady[1] - rough[1])),
        Quantity("largest current i_q", peak.value, "A", "estimated", peak.error + float(run.error[-1])),
        Quantity("time of the largest current", peak.time, "s", "estimated", spacing / 200.0),
        Quantity("largest moment of the thread about O2", 0.0 if moment < 1e-15 else moment, "N m", "estimated", 1e-15),
        Quantity("inertia of rotor and train at the crank", inertia, "kg m^2", "exact", 4.0 * math.ulp(inertia)),
        Quantity("ratio of the train", ratio, "", "exact", 4.0 * math.ulp(ratio)),
    )  # fmt: skip


def _along_table(braider: Braider, run: DriveRun) -> Table:
    """Reactions during the start-up at a few of its times."""
    from graphsynth.systems.braider.reactions import run_reactions

    found = run_reactions(braider, run)
    last = run.time.size - 1
    shares = (0.002, 0.01, 0.02, 0.04, 0.1, 0.22, 0.5, 1.0)
    chosen = sorted({max(1, round(last * math.sqrt(share))) for share in shares})
    sizes = found.magnitudes()
    rows = tuple(
        (
            f"{run.time[k]:.4g}", f"{found.speed[k]:.8g}", f"{found.acceleration[k]:.6g}",
            *(f"{1e3 * size:.7g}" for size in sizes[k]), f"{1e3 * found.torque[k]:.7g}",
        )
        for k in chosen
    )  # fmt: skip
    columns = (
        "time [s]",
        "speed [rad/s]",
        "acceleration [rad/s²]",
        "O1 [mN]",
        "A [mN]",
        "B [mN]",
        "O2 [mN]",
        "torque [mN m]",
    )
    note = f"Sizes of the reactions. Closed form on estimated states; power balance to {found.power_error:.0e}."
    return Table("Reactions during the start-up", columns, rows, note, _largest("During the start-up", found))


def _largest(when: str, found: Reactions) -> tuple[Finding, ...]:
    """Say what each joint carries at most; nothing if the linkage is never assembled."""
    import numpy as np

    sizes = found.magnitudes()
    sizes = sizes[np.isfinite(sizes).all(axis=1)]
    if not sizes.size:
        return ()
    largest = ", ".join(f"{1e3 * size:.4g}" for size in sizes.max(axis=0))
    return (Finding(f"{when} the joints O1, A, B, O2 carry at most {largest} mN (estimated, largest sample)."),)


def _sensor_table(context: Context, braider: Braider, turn: Reactions) -> Table:
    """Lay out the four sensors every 45 degrees of the crank."""
    import numpy as np

    state = braider.linkage.motion(turn.theta)
    w2, w3 = state.k2 * turn.speed, state.k3 * turn.speed
    relative = np.stack([turn.speed, w2 - turn.speed, w3 - w2, w3], axis=1)
    eighths = sorted({round(i * (turn.theta.size - 1) / 8) for i in range(8)})
    forces = turn.forces()
    rows = []
    for k in eighths:
        cells = [f"{math.degrees(turn.theta[k]):g}"]
        for joint in range(4):
            cells += [
                f"{round(float(relative[k, joint]), 12) + 0.0:.7g}",
                f"({1e3 * forces[k, joint, 0]:.6g}, {1e3 * forces[k, joint, 1]:.6g})",
            ]
        rows.append((*cells, f"{1e6 * turn.torque[k]:.7g}"))
    names = [f"{quantity} {name}" for name in ("O1", "A", "B", "O2") for quantity in ("w [rad/s]", "F [mN]")]
    columns = ("crank [°]", *(f"{n.split()[-1]}: {' '.join(n.split()[:-1])}" for n in names), "torque [µN m]")
    note = (
        f"Crank at {table_of(context).speed_rad_s:g} rad/s: relative angular velocity of the two links and force "
        f"(x, y) in the fixed frame, {'; '.join(JOINTS)}. Exact but for rounding; power balance to "
        f"{turn.power_error:.0e}."
    )
    told = _largest(f"Over a turn at {table_of(context).speed_rad_s:g} rad/s", turn)
    return Table("The four sensors over a turn", columns, tuple(rows), note, told)


def _second_way_table(braider: Braider, turn: Reactions) -> Table:
    """Compare with the multipliers of the planar model at twelve angles."""
    import numpy as np

    from graphsynth.systems.braider.reactions import general_reactions

    count = turn.theta.size - 1
    state = braider.linkage.motion(turn.theta)
    sine = np.abs((np.conj(state.coupler) * state.rocker).imag) / (braider.linkage.coupler * braider.linkage.rocker)
    # where coupler and rocker lie on one line the forces are undetermined
    reached = [k for k in sorted({round(i * count / 12) for i in range(12)}) if sine[k] > 1e-6]
    if not reached:
        return Table("Reactions had a second way", ("",), (), "The linkage cannot be assembled at any angle compared.")
    forces, torque = general_reactions(braider, turn.theta[reached], turn.speed[reached], turn.acceleration[reached])
    gap = np.abs(turn.forces()[reached] - forces).max(axis=(1, 2)) / np.abs(forces).max(axis=(1, 2))
    rows = (
        ("largest difference of a force, relative to the largest", f"{gap.max():.1e}"),
        ("largest difference of the torque", f"{np.abs(turn.torque[reached] - torque).max():.1e} N m"),
        ("crank angles compared", str(len(reached))),
    )
    note = "Multipliers of the planar model in nine absolute coordinates; nothing is shared but the data."
    return Table("Reactions had a second way", ("", ""), rows, note)


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time of the integrator and of scipy's; not part of the shipped outputs."""
    import numpy as np

    from graphsynth.evidence.drives import drive_work_precision
    from graphsynth.pipeline.display import work_table

    found = drive_work_precision(braider_of(context), np.linspace(0.0, table_of(context).start.end_s, 11))
    return (work_table(found),)
