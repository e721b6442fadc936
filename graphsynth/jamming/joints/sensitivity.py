"""Which joint to loosen first: every limit is loosened by itself and the whole range solved again.

The allowed scale of one pose is a concave function of all limits and axial clearances together (more of each never
hurts), and so is the smallest over a range.  The shadow price of a limit therefore promises at most what loosening it
gains; a second joint, or another input, may bind next.  That is why the answer is solved for and not extrapolated.
See theory/joints-that-share-a-tilt 3, 4.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.program import Bearings, JointProblem, check_motion, problem

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion


Array = NDArray[np.float64]
#: Relative gains below this are rounding.
_NOTHING = 1e-9


class LimitSensitivity(NamedTuple):
    """One limit loosened by itself.

    ``scale`` is the smallest allowed scale over the range then, and ``binds_at`` the input where it is reached;
    ``gain`` its relative growth per relative growth of the limit (0.4: ten percent more limit, four percent more
    misalignment); ``promised`` the same from the shadow price at the worst input, never less; ``without`` the smallest
    scale if the joint had no such limit at all: no more can be had from this joint alone.
    """

    joint: tuple[int, int]
    what: str
    scale: float
    gain: float
    promised: float
    binds_at: float
    without: float


@dataclass(frozen=True, eq=False)
class SensitivityTable:
    """Result of `compare_sensitivities`: rows from the most useful limit to the least.

    Attributes
    ----------
    by : float
        Relative growth of each limit.
    scale, worst_input : float
        Smallest allowed scale as the mechanism is, and where.
    rows : tuple of LimitSensitivity
    """

    by: float
    scale: float
    worst_input: float
    rows: tuple[LimitSensitivity, ...]

    def __str__(self) -> str:
        """Return a table in plain text; limits that gain nothing are counted."""
        useful = [row for row in self.rows if row.gain > 0.0]
        lines = [f"smallest allowed scale {self.scale:.6g} at the input {self.worst_input:.6g}"]
        lines += [
            f"  joint {a}-{b} {row.what:5s} {self.by:+.0%}: scale {row.scale:.6g}, gain {row.gain:.3f}, binds at "
            f"{row.binds_at:.6g}; without limit {row.without:.6g}"
            for row in useful
            for a, b in [row.joint]
        ]
        rest = len(self.rows) - len(useful)
        return "\n".join([*lines, *([f"  {rest} other limits gain nothing alone"] if rest else [])])

    def to_pandas(self) -> Any:
        """Return the rows as a table."""
        import pandas as pd

        frame = pd.DataFrame(self.rows, columns=LimitSensitivity._fields)
        frame["joint"] = [f"{a}-{b}" for a, b in frame["joint"]]
        return frame


def compare_sensitivities(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    by: float = 0.1,
) -> SensitivityTable:
    """Sensitivity every limit by itself and tell how much more misalignment the whole motion then takes.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`.
    by : float
        Relative growth of a limit: 0.1 is ten percent.

    Returns
    -------
    SensitivityTable
        Estimated, at the samples of the motion; limits that are zero (rigid) or infinite have no row.

    Raises
    ------
    GeometryError
        ``by`` not positive; a motion without an assembled sample.

    Notes
    -----
    See theory/joints-that-share-a-tilt 3, 4.

    Examples
    --------
    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, simulate
    >>> from graphsynth.jamming import Bearing
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> joints = Revolute(0, 1), Revolute(1, 2, (1, 0)), Revolute(2, 3, (2.5, 0), (2.5, 0)), Revolute(0, 3, (2, 0))
    >>> motion = simulate(Mechanism(graph, joints, [Driver(0, 1)]), np.radians([90.0]))
    >>> table = compare_sensitivities(motion, Bearing(), Misalignment(0, 1, 0.01))
    >>> [(row.joint, row.what, round(row.promised, 6)) for row in table.rows]
    [((0, 3), 'tilt', 0.5), ((1, 2), 'tilt', 0.5), ((2, 3), 'tilt', 0.0)]
    """
    check_motion(motion)
    if not finite("by", by) > 0.0:
        raise GeometryError(f"by = {by} must be a positive relative growth of a limit; 0.1 is ten percent")
    given = problem(motion.mechanism, bearings, tilts, condition)
    keep = np.flatnonzero(motion.assembled)
    if keep.size == 0:
        raise GeometryError(f"no sample is assembled: {motion.reason}; choose other inputs")
    poses, inputs = motion.poses[keep], motion.inputs[keep]
    found = given.solve(poses, "scale")
    allowed = _allowed(found.lower)
    worst = int(np.argmin(allowed))
    here = _Here(poses, inputs, allowed, worst, by)
    rows = []
    for name, one in _each(given):
        promised = float((found.force if name[1] == "play" else found.moment)[worst, one.place])
        rows.append(_sensitivity(name, one, here, promised if math.isfinite(promised) else 0.0))
    rows.sort(key=lambda row: (-round(row.gain, 9), -row.promised, row.joint, row.what))
    return SensitivityTable(by, float(allowed[worst]), float(inputs[worst]), tuple(rows))


class _Here(NamedTuple):
    """The motion as it is: poses, inputs, allowed scales, the number of the worst, and the growth asked for."""

    poses: Array
    inputs: Array
    allowed: Array
    worst: int
    by: float


def _sensitivity(name: tuple[tuple[int, int], str], one: _One, here: _Here, promised: float) -> LimitSensitivity:
    scale, at = float(here.allowed[here.worst]), float(here.inputs[here.worst])
    if promised <= _NOTHING or scale == 0.0:  # concave and without slope: it will not grow later either
        return LimitSensitivity(*name, scale, 0.0, promised, at, scale)
    # no pose gains more than the factor itself: only those near the smallest can be the smallest then
    near = np.flatnonzero(here.allowed <= scale * (1.0 + here.by))
    now = _allowed(one.by(1.0 + here.by).solve(here.poses[near], "scale").lower)
    least = int(np.argmin(now))
    gain = (float(now[least]) / scale - 1.0) / here.by
    without = float(_allowed(one.by(math.inf).solve(here.poses, "scale").lower).min())
    gain = gain if gain > _NOTHING else 0.0
    return LimitSensitivity(*name, float(now[least]), gain, promised, float(here.inputs[near[least]]), without)


def _allowed(lower: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / lower)


class _One(NamedTuple):
    """One limit of a problem."""

    given: JointProblem
    field: str
    place: int

    def by(self, factor: float) -> JointProblem:
        """Return the problem with this limit so many times as large."""
        values = getattr(self.given.layout, self.field).copy()
        values[self.place] *= factor
        return replace(self.given, layout=replace(self.given.layout, **{self.field: values}))


def _each(given: JointProblem) -> list[tuple[tuple[tuple[int, int], str], _One]]:
    """Limits that can be loosened, with their names."""
    tilts = [(name, _One(given, "limit", k)) for k, name in enumerate(given.names)]
    plays = [((pair, "play"), _One(given, "end_float", k)) for k, pair in enumerate(given.pairs)]
    return [(name, one) for name, one in tilts + plays if 0.0 < getattr(given.layout, one.field)[one.place] < math.inf]
