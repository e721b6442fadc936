"""The single-motor platform of a scene: recognise its graph, move it through a full turn, assess."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Attempt, Candidate, Quantity, Recognised, Record, Table, each, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import recognise_by_key, records_of
from graphsynth.systems.platform.system import PlatformTable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.systems.platform.motion import Motion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform


@dataclass(frozen=True, slots=True, eq=False)
class PlatformMotion:
    """One turn of the wheels, with every joint for the pictures.

    * `motion`: what the module computed; shorter than asked for if the branch ends.
    * `O`, `D` (shape (3,), complex): wheel axes and rocker pivots, fixed frame, millimetres.
    * `B`, `C`, `A`, `F` (shape (n, 3), complex): crank pins, drive joints of the rockers, platform joints of the
      rockers, platform corners.
    * `wheel_radius`: pitch radius, millimetres.
    """

    mechanism: SingleMotorPlatform
    motion: Motion
    O: NDArray[np.complex128]
    D: NDArray[np.complex128]
    B: NDArray[np.complex128]
    C: NDArray[np.complex128]
    A: NDArray[np.complex128]
    F: NDArray[np.complex128]
    wheel_radius: float


def _table(context: Context) -> PlatformTable:
    table = context.scene.mechanism
    assert isinstance(table, PlatformTable)  # the registry chose this stage by the module of the scene
    return table


def recognise(context: Context, candidates: tuple[Candidate, ...]) -> tuple[Recognised, ...]:
    """Mark the candidates isomorphic to the single-motor platform, frame and gear pairs respected."""
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    return recognise_by_key(candidates, SingleMotorPlatform().graph(), "single_motor_platform")


def kinematics(context: Context, recognised: tuple[Recognised, ...]) -> tuple[Attempt, ...]:
    """Move every recognised candidate through one turn with the dimensions of the scene."""
    table = _table(context)
    return each((Attempt(r.candidate, r) for r in recognised if r.module), lambda _: _move(table))


def platform_of(context: Context) -> SingleMotorPlatform:
    """Return the platform with the dimensions of the scene, not moved yet.

    Raises `GeometryError` for dimensions that no platform can have.
    """
    return _mechanism(_table(context))


def _mechanism(table: PlatformTable) -> SingleMotorPlatform:
    """Embody the scene's dimensions; one leg is repeated three times."""
    from graphsynth.systems.platform.drive import GearTrain
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    def thrice(value: float) -> tuple[float, float, float]:
        return (value, value, value)

    def point(pair: tuple[float, float]) -> tuple[complex, complex, complex]:
        return (complex(*pair),) * 3

    first, second, third = table.leg_directions
    return SingleMotorPlatform(
        crank=table.crank_mm,
        phase=table.crank_phase,
        coupler=thrice(table.coupler_mm),
        rocker=thrice(table.rocker_mm),
        axis=point(table.wheel_axis_mm),
        pivot=point(table.rocker_pivot_mm),
        vertex=point(table.platform_vertex_mm),
        l1=thrice(table.arm_mm),
        l2=thrice(table.intermediate_mm),
        frame_angle=(first, second, third),
        delta=thrice(table.rocker_angle),
        tau=(table.drive_branch,) * 3,
        gears=GearTrain(table.pinion_teeth, table.wheel_teeth),
    )


def _move(table: PlatformTable) -> PlatformMotion:
    import numpy as np

    from graphsynth.core.errors import GeometryError

    mechanism = _mechanism(table)
    motion = mechanism.full_turn(table.positions + 1)
    if motion.label.sigma != table.working_mode:
        raise GeometryError(
            f"the home pose has working mode {list(motion.label.sigma)}, the scene says working_mode = "
            f"{list(table.working_mode)}; correct the scene or the dimensions"
        )
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    O = np.array(mechanism.axis) * turn
    D = np.array(mechanism.platform.D)
    crank = np.array(mechanism.crank) * np.exp(1j * (motion.psi[:, None] + np.array(mechanism.phase)))
    arm = np.array(mechanism.rocker) * np.exp(1j * (motion.theta - np.array(mechanism.delta)))
    share = table.wheel_teeth / (table.pinion_teeth + table.wheel_teeth)
    return PlatformMotion(
        mechanism=mechanism,
        motion=motion,
        O=O,
        D=D,
        B=O + crank,
        C=D + arm,
        A=mechanism.platform.elbows(motion.theta),
        F=mechanism.platform.vertices(motion.pose),
        wheel_radius=float(abs(O[0])) * share,
    )


def assess(
    context: Context, recognised: tuple[Recognised, ...], motions: tuple[Attempt, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give one record per candidate and the tables of the first one moved."""
    records = records_of(recognised, motions, _verdict)
    moved: PlatformMotion | None = next((a.value for a in motions if not a.failed), None)
    return records, () if moved is None else (_turn_table(moved), _pose_table(moved.motion), _event_table(moved.motion))


def _verdict(moved: PlatformMotion) -> tuple[str, bool, tuple[Quantity, ...]]:
    motion = moved.motion
    good = motion.complete and motion.closed
    if good:
        words = (
            f"full turn on one branch, closed after {motion.period} turn{'s' if motion.period != 1 else ''} (estimated)"
        )
    elif motion.complete:
        words = "full turn on one branch, but it does not close (estimated)"
    else:
        words = f"no full turn: {motion.stop_reason() or 'the branch is lost'} (estimated)"
    return words, good, _margins(motion)


def _margins(motion: Motion) -> tuple[Quantity, ...]:
    import numpy as np

    x, y, alpha = motion.pose.T
    error = motion.closure_error * motion.Lc if math.isfinite(motion.closure_error) else None
    return (
        Quantity("travel in x", float(np.ptp(x)), "mm", "estimated", error),
        Quantity("travel in y", float(np.ptp(y)), "mm", "estimated", error),
        Quantity(
            "swing", float(np.ptp(alpha)), "rad", "estimated", motion.closure_error if error is not None else None
        ),
        Quantity("distance to the nearest other assembly mode", float(motion.gap.min()) * motion.Lc, "mm"),
        Quantity(
            "least |det JX| of the turn over that at its start",
            float(np.abs(motion.determinant / motion.determinant[0]).min()),
        ),
        exact("wheel positions computed", len(motion.psi)),
        Quantity("least |leg Jacobian|", float(np.abs(motion.leg).min()), "mm^2"),
        Quantity("closure of the turn", motion.closure_error * motion.Lc, "mm"),
        Quantity("relative closure residual", motion.residual),
    )


def _turn_table(moved: PlatformMotion) -> Table:
    """State what the turn is, its method and what the drives allow."""
    motion, mechanism = moved.motion, moved.mechanism
    drives = ", ".join(turn.kind for turn in mechanism.drive_turns())
    label = motion.label
    rows = [
        ("drives 1, 2, 3", drives, "exact"),
        (
            "branch at the start",
            f"tau = {_signs(label.tau)}, sigma = {_signs(label.sigma)}, det JX {_sign(label.sign)}",
            "estimated",
        ),
        ("the working mode is kept", "yes" if motion.working_mode_constant else "no", "estimated, at the samples"),
        *((q.name, q.text, q.guarantee) for q in _margins(motion)),
        ("time of the turn", f"{motion.seconds:.3f} s", "measured once"),
    ]
    return Table("The full turn", ("quantity", "value", "method"), tuple(rows), f"Method: {motion.method}.")


def _sign(value: int) -> str:
    return {1: "> 0", -1: "< 0"}.get(value, "= 0")


def _signs(values: tuple[int, ...]) -> str:
    return "(" + ", ".join("+" if value > 0 else "-" for value in values) + ")"


def _pose_table(motion: Motion) -> Table:
    """Give the pose and the determinant every 45 degrees of the wheel, as far as the motion reached."""
    eighths = sorted({round(i * (len(motion.psi) - 1) / 8) for i in range(9)})
    rows = tuple(
        (
            f"{math.degrees(motion.psi[i]):.6g}",
            *(f"{value:.12g}" for value in motion.pose[i]),
            f"{motion.determinant[i]:.12g}",
            "/".join(str(int(s)) for s in _working_mode(motion, i)),
        )
        for i in eighths
    )
    columns = ("wheel [°]", "x [mm]", "y [mm]", "alpha [rad]", "det JX [mm^4]", "sigma")
    return Table("Poses over the turn", columns, rows, "Estimated: Newton iteration in double precision.")


def _working_mode(motion: Motion, i: int) -> tuple[int, ...]:
    return tuple(1 if value > 0 else -1 for value in motion.leg[i])


def _event_table(motion: Motion) -> Table:
    """List dead points and everything else the module met on the way."""
    rows = ((event.psi, event.kind, event.statement) for event in motion.events)
    title = f"Events of the turn: {len(motion.events)}"
    return table(title, ("wheel [°] | .6f", "event", "what it means"), rows)
