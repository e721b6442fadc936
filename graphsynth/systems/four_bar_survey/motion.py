"""Many four-bars at once: their motion by the planar engine, and the tilted bearing in closed form (model L0)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.kinematics.engine.batch import BatchMotion, simulate_batch
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import COLUMNS
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.rotatability import KINDS
from graphsynth.systems.four_bar_survey.system import SurveyTable

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_POSITIONS = 180_000  # computed at once: poses stay in the cache, and memory is used again
#: Squared sine of the transmission angle below which modes meet; sets of the lattice that keep clear are above 1e-9.
_MEETING = 1e-12


class Moved(NamedTuple):
    """What motion says of sets (estimated: floating point at the sampled crank angles), arrays of shape (n,).

    `kind`: as found, place in `KINDS`; `transmission`: smallest transmission angle over a full rotation, radians, NaN
    where there is none (the samples contain both positions in which crank and frame are in line, where it is smallest:
    no sampling error); `swing`: range of the rocker's angle, radians, 2 pi if it turns fully, NaN as above;
    `positions`: computed.
    """

    kind: NDArray[np.int8]
    transmission: Array
    swing: Array
    positions: int


#: A four-bar driven at its crank, of which all others are dimension sets; the branch is that of the motion.
_FOUR_BAR = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)


def _driven(angles: ArrayLike, sizes: Array, turned: Array | float = 0.0, keep: tuple[int, ...] = ()) -> BatchMotion:
    """Drive sets (frame, crank, coupler, rocker) to crank angles; `turned` turns the line of the frame, radians."""
    place = {joint.pair: k for k, joint in enumerate(_FOUR_BAR.joints)}
    found = np.repeat(_FOUR_BAR.dimensions[None], len(sizes), axis=0)
    g, a, b, c = sizes.T
    found[:, place[1, 2], 0], found[:, place[2, 3], 0], found[:, place[2, 3], COLUMNS.index("bx")] = a, b, c
    found[:, place[0, 3], 0], found[:, place[0, 3], 1] = g * np.cos(turned), g * np.sin(turned)
    return simulate_batch(_FOUR_BAR, angles, found, modes={0: 1}, rates=False, keep=keep)


def move(lengths: Ints, positions: int) -> Moved:
    """Move sets (frame, crank, coupler, rocker) through a rotation of the crank, and find out how far each can turn.

    The number of positions per rotation is even.

    Examples
    --------
    >>> found = move(np.array([[4, 2, 5, 5], [4, 2, 3, 5], [4, 3, 2, 2]]), 36)
    >>> [KINDS[k] for k in found.kind], np.degrees(found.transmission).round(6).tolist()
    (['full turn', 'change point', 'limited'], [23.073918, nan, nan])
    """
    piece = max(1, _POSITIONS // positions)
    parts = [_move(lengths[k : k + piece], positions) for k in range(0, len(lengths), piece)]
    joined = [np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "transmission", "swing")]
    return Moved(joined[0], joined[1], joined[2], sum(part.positions for part in parts))


def _move(lengths: Ints, positions: int) -> Moved:
    sizes = lengths.astype(np.float64)
    turn = np.linspace(0.0, math.tau, positions + 1)
    batch = _driven(turn, sizes, keep=(3,))
    done = batch.completed
    sine2 = np.where(done, batch.margins[..., 0].min(axis=1), np.nan)
    meets = np.where(done, sine2 <= _MEETING, False)
    kind = np.full(len(lengths), KINDS.index("never assembled"), dtype=np.int8)
    kind[done] = KINDS.index("full turn")
    kind[meets] = KINDS.index("change point")
    kind[(batch.reached > 0) & ~done] = KINDS.index("limited")
    left = np.flatnonzero(batch.reached == 0)
    # a crank that is assembled anywhere is so at 0, at pi, or where coupler and rocker are at right angles
    g, a, b, c = sizes[left].T
    square = np.clip((g * g + a * a - b * b - c * c) / (2.0 * g * a), -1.0, 1.0)
    across, ahead = _driven([0.0], sizes[left], -np.arccos(square)), _driven([math.pi], sizes[left])
    kind[left[across.completed | ahead.completed]] = KINDS.index("limited")
    at_pi = ahead.completed & (ahead.margins[:, 0, 0] <= _MEETING)
    begins = np.flatnonzero((batch.reached > 0) & ~done & (batch.margins[:, 0, 0] <= _MEETING))
    for stretched, angle in ((begins, 0.0), (left[at_pi], math.pi)):
        # beside it the pin comes nearer or goes farther by less than the dyad can give: g a (1 - cos) <= b c / 2
        g, a, b, c = sizes[stretched].T
        beside = angle + np.minimum(0.5, np.sqrt(b * c / (g * a)))
        kind[stretched[~_driven([0.0], sizes[stretched], -beside).completed]] = KINDS.index("immovable")
    g, a, b, c = lengths.T
    folded = np.flatnonzero((g == a) & (b == c))  # kites: at angle 0 the pin is on the pivot, the dyad is free to turn
    kind[folded[_driven(turn[1:-1], sizes[folded]).completed]] = KINDS.index("change point")
    turns = done & ~meets
    transmission = np.where(turns, np.arcsin(np.sqrt(np.clip(sine2, 0.0, 1.0))), np.nan)
    swing = np.full(len(lengths), np.nan)
    # range of the rocker's angle, unless that turns fully; the extremes by parabolas through three samples
    frames = batch.frames[turns, :, 0]
    turned = np.unwrap(np.arctan2(frames[..., 3], frames[..., 2]), axis=1)
    full: NDArray[np.bool_] = np.abs(turned[:, -1] - turned[:, 0]) > math.pi
    swing[turns] = np.where(full, math.tau, _extreme(turned[:, :-1]) + _extreme(-turned[:, :-1]))
    return Moved(kind, transmission, swing, int(batch.reached.sum()) + 2 * len(left))


def _extreme(values: Array) -> Array:
    """Largest value of periodic rows, refined."""
    n = values.shape[1]
    k = values.argmax(axis=1)
    row = np.arange(len(values))
    low, top, high = values[row, (k - 1) % n], values[row, k], values[row, (k + 1) % n]
    bend = np.minimum(low - 2.0 * top + high, 0.0)
    return np.asarray(top - np.where(bend < 0.0, (high - low) ** 2 / (8.0 * np.where(bend < 0.0, bend, 1.0)), 0.0))


class Jamming(NamedTuple):
    """What the bearing between coupler and rocker does, by set (estimated: closed forms in floating point).

    `tilt`: largest tilt of the coupler over the rotation, radians; `axis_tilt`: largest tilt of the motor axis for
    which all of it is free, radians, pi/2 if every tilt is; `clearance`: smallest radial clearance for which all of it
    is free, mm; `part`: of the rotation in which the bearing binds, 0 to 1.
    """

    tilt: Array
    axis_tilt: Array
    clearance: Array
    part: Array


def close_form(table: SurveyTable, lengths: NDArray[np.int64]) -> Jamming:
    """Assess the bearing for sets of lengths (frame, crank, coupler, rocker); only crank over coupler matters.

    As `jam_arcs`, `largest_misalignment` and `smallest_clearance` of :mod:`graphsynth.jamming`, set by set
    (theory/bearing-contact 7 and theory/jam-arcs 1, 4).
    """
    own = table.bearing
    bearing = Bearing(own.radius_mm, own.height_mm, own.clearance_mm)
    unit = TiltedFourBar(1.0, 1.0, 1.0, 1.0, alpha=table.tilt.alpha, axis=table.tilt.axis)
    ratios, which = np.unique(lengths[:, 1] / lengths[:, 2], return_inverse=True)
    sine = np.minimum(unit.pin_height * ratios, 1.0)
    critical = bearing.critical_tilt(own.condition)
    if critical.sine is None or critical.reason:  # a clearance is never negative here: free at any tilt
        part, axis = np.zeros(len(ratios)), np.full(len(ratios), 0.5 * math.pi)
    else:
        # two intervals of 2 arccos kappa each, kappa the critical sine over the largest (16 units are touching)
        height = unit.pin_height * ratios
        with np.errstate(divide="ignore", invalid="ignore"):
            kappa = np.where(height > 0.0, critical.sine / height, np.inf)
        part = np.where(kappa < 1.0 - 16 * 2.0**-52, 2.0 / math.pi * np.arccos(np.minimum(kappa, 1.0)), 0.0)
        # tilt of the axis at which the pin is as high as the critical tilt needs: q times the crank
        q, inclination = critical.sine / ratios, unit.axis[0] ** 2 + unit.axis[1] ** 2
        inside = np.minimum(q, 1.0)
        deficit = inside * inside / (1.0 + np.sqrt((1.0 - inside) * (1.0 + inside)))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(deficit <= 2.0 * inclination, 0.5 * deficit / inclination, np.nan)
        reached = np.isfinite(share) & (q < 1.0)
        axis = np.where(reached, 2.0 * np.arcsin(np.sqrt(np.where(reached, share, 0.0))), 0.5 * math.pi)
    clearance = _smallest_clearance(sine, bearing.Rb, bearing.h, own.condition)
    return Jamming(np.arcsin(sine)[which], axis[which], clearance[which], part[which])


def _smallest_clearance(sine: Array, radius: float, half: float, condition: str) -> Array:
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    bulge = radius * sine * sine / (1.0 + cosine)
    if condition == "B":
        with np.errstate(divide="ignore"):
            return np.where(cosine > 0.0, (half * sine + bulge) / cosine, np.inf)
    rim = half * half / (math.hypot(radius, half) + radius)
    return np.where(half * cosine < radius * sine, rim, half * sine - bulge)
