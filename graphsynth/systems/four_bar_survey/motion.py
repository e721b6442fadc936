"""Motion of many four-bars at once by the planar engine, and what the motion tells of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.rotatability import KINDS
from graphsynth.systems.four_bar_survey.lattice import Ints

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

_POSITIONS = 180_000  # computed at once: poses stay in the cache, and memory is used again
#: Squared sine of the transmission angle below which modes meet; sets of the lattice that keep clear are above 1e-9.
_MEETING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """What motion says of sets (estimated: floating point at the sampled crank angles).

    Attributes
    ----------
    kind : ndarray of int8, shape (n,)
        As found: place in `KINDS`.
    transmission : ndarray, shape (n,)
        Smallest transmission angle over a full turn, radians; NaN where the crank does not turn fully.  The samples
        contain both positions in which crank and frame are in line, where it is smallest: no sampling error.
    swing : ndarray, shape (n,)
        Range of the rocker's angle over the turn, radians; 2 pi if it turns fully; NaN as above.
    positions : int
        Crank positions computed.
    """

    kind: NDArray[np.int8]
    transmission: Array
    swing: Array
    positions: int


@cache
def four_bar(frame: float = 2.0, crank: float = 1.0, coupler: float = 2.5, rocker: float = 2.5) -> Mechanism:
    """Return a four-bar driven at its crank, of which all others are dimension sets."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = (
        Revolute(0, 1),
        Revolute(1, 2, (crank, 0.0)),
        Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    )
    return Mechanism(graph, joints, (Driver(0, 1),))


def _dimensions(lengths: Array, turned: Array | None = None) -> Array:
    """Dimension sets of `four_bar`; `turned` turns the line of the frame about the crank's pivot, radians."""
    from graphsynth.mechanism.joints import COLUMNS

    mechanism = four_bar()
    place = {joint.pair: k for k, joint in enumerate(mechanism.joints)}
    found = np.repeat(mechanism.dimensions[None], len(lengths), axis=0)
    g, a, b, c = lengths.T
    found[:, place[1, 2], 0], found[:, place[2, 3], 0], found[:, place[2, 3], COLUMNS.index("bx")] = a, b, c
    found[:, place[0, 3], 0] = g if turned is None else g * np.cos(turned)
    if turned is not None:
        found[:, place[0, 3], 1] = g * np.sin(turned)
    return found


def move(lengths: Ints, positions: int) -> Moved:
    """Move sets through a turn of the crank, and find out how far each can turn.

    Parameters
    ----------
    lengths : ndarray of int64, shape (n, 4)
        Frame, crank, coupler, rocker.
    positions : int
        Per turn; even.

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
    from graphsynth.kinematics.engine.batch import simulate_batch

    sizes = lengths.astype(np.float64)
    turn = np.linspace(0.0, math.tau, positions + 1)
    batch = simulate_batch(four_bar(), turn, _dimensions(sizes), modes={0: 1}, rates=False, keep=[3])
    done = batch.completed
    sine2 = np.where(done, batch.margins[..., 0].min(axis=1), np.nan)
    meets = np.where(done, sine2 <= _MEETING, False)
    kind = np.full(len(lengths), KINDS.index("never assembled"), dtype=np.int8)
    kind[done] = KINDS.index("full turn")
    kind[meets] = KINDS.index("change point")
    kind[(batch.reached > 0) & ~done] = KINDS.index("limited")
    left = np.flatnonzero(batch.reached == 0)
    elsewhere, at_pi = _assembled_elsewhere(sizes[left])
    kind[left[elsewhere]] = KINDS.index("limited")
    begins = np.flatnonzero((batch.reached > 0) & ~done & (batch.margins[:, 0, 0] <= _MEETING))
    for stretched, angle in ((begins, 0.0), (left[at_pi], math.pi)):
        kind[stretched[~_assembled_beside(sizes[stretched], angle)]] = KINDS.index("immovable")
    g, a, b, c = lengths.T
    folded = np.flatnonzero((g == a) & (b == c))  # kites: at angle 0 the pin is on the pivot, the dyad is free to turn
    kind[folded[_assembled_between(sizes[folded], turn)]] = KINDS.index("change point")
    turns = done & ~meets
    transmission = np.where(turns, np.arcsin(np.sqrt(np.clip(sine2, 0.0, 1.0))), np.nan)
    swing = np.full(len(lengths), np.nan)
    swing[turns] = _swing(batch.frames[turns, :, 0])
    return Moved(kind, transmission, swing, int(batch.reached.sum()) + 2 * len(left))


def _assembled_elsewhere(sizes: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether sets that cannot be assembled at crank angle 0 can be anywhere else; whether modes meet at pi.

    Tried are pi, and the angle at which coupler and rocker are at right angles: a crank that is assembled anywhere is
    assembled at one of the three.
    """
    from graphsynth.kinematics.engine.batch import simulate_batch

    if not len(sizes):
        return np.zeros(0, dtype=np.bool_), np.zeros(0, dtype=np.bool_)
    g, a, b, c = sizes.T
    square = np.clip((g * g + a * a - b * b - c * c) / (2.0 * g * a), -1.0, 1.0)
    across = simulate_batch(
        four_bar(), [0.0], _dimensions(sizes, -np.arccos(square)), modes={0: 1}, rates=False, keep=[]
    )
    ahead = simulate_batch(four_bar(), [math.pi], _dimensions(sizes), modes={0: 1}, rates=False, keep=[])
    return across.completed | ahead.completed, ahead.completed & (ahead.margins[:, 0, 0] <= _MEETING)


def _assembled_beside(sizes: Array, angle: float) -> NDArray[np.bool_]:
    """Whether sets whose dyad is in line at a crank angle can be assembled beside it too.

    Tried is an angle at which the pin comes nearer or goes farther by less than the dyad can give, if it can give at
    all: ``g a (1 - cos) <= b c / 2``.
    """
    from graphsynth.kinematics.engine.batch import simulate_batch

    if not len(sizes):
        return np.zeros(0, dtype=np.bool_)
    g, a, b, c = sizes.T
    beside = np.minimum(0.5, np.sqrt(b * c / (g * a)))
    turned = _dimensions(sizes, -(angle + beside))
    return simulate_batch(four_bar(), [0.0], turned, modes={0: 1}, rates=False, keep=[]).completed


def _assembled_between(sizes: Array, turn: Array) -> NDArray[np.bool_]:
    """Whether sets that are not determined at crank angle 0 pass all other angles."""
    from graphsynth.kinematics.engine.batch import simulate_batch

    if not len(sizes):
        return np.zeros(0, dtype=np.bool_)
    batch = simulate_batch(four_bar(), turn[1:-1], _dimensions(sizes), modes={0: 1}, rates=False, keep=[])
    return batch.completed


def _swing(frames: Array) -> Array:
    """Range of the angle of a link over closed turns, shape (n,), the extremes by parabolas through three samples."""
    angle = np.unwrap(np.arctan2(frames[..., 3], frames[..., 2]), axis=1)
    turns = np.abs(angle[:, -1] - angle[:, 0]) > math.pi
    range_ = _extreme(angle[:, :-1]) + _extreme(-angle[:, :-1])
    return np.where(turns, math.tau, range_)


def _extreme(values: Array) -> Array:
    """Largest value of periodic rows, refined."""
    n = values.shape[1]
    k = values.argmax(axis=1)
    row = np.arange(len(values))
    low, top, high = values[row, (k - 1) % n], values[row, k], values[row, (k + 1) % n]
    bend = np.minimum(low - 2.0 * top + high, 0.0)
    return np.asarray(top - np.where(bend < 0.0, (high - low) ** 2 / (8.0 * np.where(bend < 0.0, bend, 1.0)), 0.0))
