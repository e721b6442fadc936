"""Which limit to loosen first, and which direction of a misaligned axis is the worst, with exact closure in space.

Estimated at the samples of a motion: shadow prices come from the multipliers of the optimum, gains from solving again.
See theory/closure-in-space 7.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.jamming.joints.program import Bearings, check_motion, problem
from graphsynth.jamming.joints.scale import DirectionMap, LimitSensitivity, SensitivityTable
from graphsynth.jamming.space.along import NOTHING, Along, Change, Least
from graphsynth.jamming.space.model import MODEL, SpaceModel, Unsupported
from graphsynth.jamming.space.optimum import Optimum

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Relative gains below this are rounding.
_NOTHING = 1e-8
#: Inputs whose factor is so much above the smallest may become the smallest when a limit is loosened (times `by`).
_ROOM = 1.1
_MOST = 100_000


def prices(model: SpaceModel, found: Optimum) -> Array:
    """Relative fall of the least factor per relative growth of every limit, (bounds,); their sum is 1."""
    if not 0.0 < found.scale < math.inf:
        return np.zeros(len(model.bounds))
    rise = np.array([bound.chart(found.scale) * bound.slope(found.scale) for bound in model.bounds])
    return np.asarray(2.0 * found.weight * rise)


def assembled(
    motion: Motion, bearings: Bearings, tilts: Misalignment | Iterable[Misalignment], condition: Condition
) -> Along:
    """Put a question together; `GeometryError` where no sample is assembled or the model does not describe it."""
    check_motion(motion)
    given = problem(motion.mechanism, bearings, tilts, condition)
    if not motion.assembled.any():
        raise GeometryError(f"no sample is assembled: {motion.reason}; choose other inputs")
    try:
        return Along(given, motion)
    except Unsupported as error:
        raise GeometryError(f'{error} (model="small")') from error


def direction_map(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    directions: int = 12,
) -> DirectionMap:
    """Turn all misalignments together through half a turn and find the worst direction, with exact closure in space.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; every sample takes about 0.1 s for each direction.
    directions : int
        Number of directions over half a turn, at least 3.  Turning by pi mirrors the mechanism, and changes nothing.

    Returns
    -------
    DirectionMap
        Estimated: solved for where smallest, followed from the slope at the optimum elsewhere.  ``bound`` is NaN: the
        closure is not linear in the misalignments, so that the grid bounds nothing between its directions.

    Raises
    ------
    GeometryError
        Fewer than 3 directions; a motion without an assembled sample; a mechanism that the model does not describe.
    """
    if not isinstance(directions, int | np.integer) or not 3 <= directions <= _MOST:
        raise GeometryError(f"directions = {directions} are no number for a map; give a whole number, 3 to {_MOST}")
    along = assembled(motion, bearings, tilts, condition)
    keep, inputs = along.keep, motion.inputs
    angles = math.pi * np.arange(directions) / directions
    scale = np.full((directions, len(inputs)), np.nan)
    for k, angle in enumerate(angles.tolist()):
        scale[k, keep] = along.allowed_at(inputs[keep], motion.poses[keep], Change(turned=angle))[0]
    if np.isnan(scale).all():
        raise GeometryError('no closure in space was found at any sample; compare model="small"')
    at = np.unravel_index(int(np.nanargmin(scale)), scale.shape)
    worst = float(angles[at[0]]), float(inputs[at[1]]), float(scale[at])
    return DirectionMap(angles, inputs, scale, *worst, math.nan, MODEL)


def compare_sensitivities(
    motion: Motion,
    bearings: Bearings,
    tilts: Misalignment | Iterable[Misalignment],
    *,
    condition: Condition = "A",
    by: float = 0.1,
) -> SensitivityTable:
    """Loosen every limit by itself and tell how much more misalignment a motion then takes, with exact closure.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`.
    by : float
        Relative growth of a limit: 0.1 is ten percent.

    Returns
    -------
    SensitivityTable
        Estimated, at the samples of the motion; ``promised`` follows from the multipliers at the worst one.
        ``without`` is infinite if then no misalignment up to 0.5 rad binds.

    Raises
    ------
    GeometryError
        ``by`` not positive; a motion without an assembled sample; a mechanism that the model does not describe.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming import Bearing
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate(np.radians([90.0]))
    >>> table = compare_sensitivities(motion, Bearing(), Misalignment(0, 1, 0.01))
    >>> sorted((row.joint, row.what, round(row.promised, 4)) for row in table.rows)
    [((0, 3), 'tilt', 0.5), ((1, 2), 'tilt', 0.5), ((2, 3), 'tilt', 0.0)]
    """
    if not finite("by", by) > 0.0:
        raise GeometryError(f"by = {by} must be a positive relative growth of a limit; 0.1 is ten percent")
    along = assembled(motion, bearings, tilts, condition)
    poses, inputs = motion.poses[along.keep], motion.inputs[along.keep]
    allowed, found = along.allowed_at(inputs, poses)
    if np.isnan(allowed).all():
        raise GeometryError('no closure in space was found at any sample; compare model="small"')
    worst = int(np.nanargmin(allowed))
    scale, at = float(allowed[worst]), float(inputs[worst])
    near = np.flatnonzero(allowed <= scale * (1.0 + _ROOM * by))
    rows = []
    for joint, what, promised in _promises(along, found[worst]):
        pair = along.given.mechanism.joints[joint].pair
        row = LimitSensitivity(pair, what, scale, 0.0, promised, at, scale)
        if promised > _NOTHING and 0.0 < scale < math.inf:
            now = along.allowed_at(inputs[near], poses[near], _loosened(along, joint, what, 1.0 + by))[0]
            least = int(np.nanargmin(now))
            gain = (float(now[least]) / scale - 1.0) / by
            without = math.nan  # of a shift: links without that limit are not joined
            if what != "shift":
                without = float(np.nanmin(along.allowed_at(inputs, poses, _loosened(along, joint, what, math.inf))[0]))
            own = float(now[least]), gain if gain > _NOTHING else 0.0, promised, float(inputs[near[least]]), without
            row = LimitSensitivity(pair, what, *own)
        rows.append(row)
    rows.sort(key=lambda row: (-round(row.gain, 6), -row.promised, row.joint, row.what))
    return SensitivityTable(by, scale, at, tuple(rows), MODEL)


def _promises(along: Along, least: Least) -> Iterator[tuple[int, str, float]]:
    """Joint, limit and relative growth of the misalignments allowed per relative growth of the limit."""
    model = along.model(NOTHING)
    for bound, price in zip(model.bounds, prices(model, least.optimum).tolist()):
        yield bound.joint, bound.kind, price / least.slope


def _loosened(along: Along, joint: int, what: str, factor: float) -> Change:
    """Return the change of one limit by a factor."""
    own = along.given.limits[joint]
    name = {"play": "axial_clearance", "shift": "radial_clearance"}.get(what, what)
    more: dict[str, Any] = {name: getattr(own, name) * factor, f"{name}_range": None}
    return Change(other=((joint, replace(own, **more)),))
