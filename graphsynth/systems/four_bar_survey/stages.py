"""Stages of a four-bar survey for each shard of its lattice of exact lengths: class, motion, bearing, what is kept."""

from __future__ import annotations

import math
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.rotatability import KINDS, TYPES, grashof_type, rotation_kind
from graphsynth.pipeline.products import Columns, Objective
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.tables import exact_number, fields_of, suggest
from graphsynth.pipeline.units import Unit
from graphsynth.systems.four_bar_survey.motion import Ints, Jamming, Moved, close_form, move
from graphsynth.systems.four_bar_survey.system import RangeTable, SurveyTable

Array = NDArray[np.float64]

#: Margins of a set that objectives may name, with their units.
QUANTITIES = {
    "transmission angle": "deg",
    "rocker swing": "deg",
    "size": "",
    "largest tilt": "deg",
    "largest axis tilt": "deg",
    "smallest clearance": "mm",
    "jammed part": "",
}
_UNITS = QUANTITIES | {"frame": "", "coupler": "", "rocker": "", "type": "", "kind": "", "passes": ""}
_DEFAULT = (Objective("transmission angle", "max"), Objective("largest axis tilt", "max"), Objective("size", "min"))


#: Lengths in units of the lattice: products of four stay exact, and margins stay clear of rounding.
LONGEST = 20_000


@dataclass(frozen=True, slots=True)
class Lattice:
    """Dimension sets by number: the rocker runs fastest, then the coupler, then the frame.

    All lengths are whole multiples of `unit`; the crank and the ranges are in units.

    Examples
    --------
    >>> lattice = Lattice(Fraction(1, 2), 2, range(3, 5), range(4, 6), range(4, 7))
    >>> len(lattice), lattice.lengths(np.array([0, 11])).tolist()
    (12, [[3, 2, 4, 4], [4, 2, 5, 6]])
    """

    unit: Fraction
    crank: int
    frame: range
    coupler: range
    rocker: range

    def __len__(self) -> int:
        return len(self.frame) * len(self.coupler) * len(self.rocker)

    def lengths(self, sets: Ints) -> Ints:
        """Return frame, crank, coupler and rocker of sets in units (exact), shape (n, 4)."""
        rest, rocker = np.divmod(sets, len(self.rocker))
        frame, coupler = np.divmod(rest, len(self.coupler))
        parts = [r.start + r.step * k for r, k in ((self.frame, frame), (self.coupler, coupler), (self.rocker, rocker))]
        return np.stack([parts[0], np.full(len(sets), self.crank), parts[1], parts[2]], axis=1).astype(np.int64)


def lattice_of(context: Context) -> Lattice:
    """Read the lattice from a scene: numbers are the decimals (or fractions) that stand in the file.

    A `SceneError` refuses a range that does not end on a step, and lengths without a common unit that is coarse enough.
    """
    table: SurveyTable = context.scene.mechanism
    place = context.scene.place / "mechanism" / "lengths"
    crank = exactly(context, "lengths", "crank")
    ranges: list[tuple[Fraction, Fraction, int]] = []
    for name in ("frame", "coupler", "rocker"):
        own: RangeTable = getattr(table.lengths, name)
        first, last, step = (exactly(context, "lengths", name, key) for key in ("first", "last", "step"))
        count = (last - first) / step
        if count.denominator != 1:
            raise (place / name).error(
                f"runs from {own.first:g} to {own.last:g} in steps of {own.step:g} and misses its last length; "
                "let last be first plus a whole number of steps"
            )
        ranges.append((first, step, int(count) + 1))
    values = [crank, *(value for first, step, _ in ranges for value in (first, step))]
    below = math.lcm(*(value.denominator for value in values))
    unit = Fraction(math.gcd(*(int(value * below) for value in values)), below)
    longest = max(crank, *(first + step * (count - 1) for first, step, count in ranges)) / unit
    if longest > LONGEST:
        raise place.error(
            f"has lengths whose common unit is {float(unit):g}, {float(longest):g} of them in the longest; at most "
            f"{LONGEST} are exact: give rounder lengths"
        )
    spans = []
    for begin, each, number in ranges:
        low, apart = int(begin / unit), int(each / unit)
        spans.append(range(low, low + apart * number, apart))
    return Lattice(unit, int(crank / unit), *spans)


def exactly(context: Context, *path: str) -> Fraction:
    """Return a number of ``[mechanism]`` as it stands in the file, in the unit of its key.

    If the scene was changed after reading, the double that it is; for a plain number its shortest decimal.
    """
    raw: Any = context.scene.raw.get("mechanism", {})
    own = context.scene.mechanism
    for key in path[:-1]:
        raw, own = raw.get(key, {}) if isinstance(raw, Mapping) else {}, getattr(own, key)
    schema: Any = type(own)
    field = next(field for field in fields_of(schema) if field.name == path[-1])
    value, written = getattr(own, field.name), raw.get(field.key, raw.get(field.alias)) if raw else None
    number = exact_number(written, field.unit)
    if number is not None and (field.unit.to_si(float(number)) if field.si else float(number)) == value:
        return number
    return Fraction(field.unit.from_si(value) if field.si else value if field.unit.text else repr(float(value)))


def classify(lengths: Ints) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Decide in integers whether the crank turns, and Grashof's type (exact): places in `KINDS` and `TYPES`, int8 (n,).

    Lengths of shape (n, 4): frame, crank, coupler, rocker; at most 2**60.

    Examples
    --------
    >>> kind, type_ = classify(np.array([[4, 2, 5, 5], [4, 2, 3, 5], [4, 3, 2, 2], [1, 1, 1, 9], [3, 1, 1, 1]]))
    >>> [KINDS[k] for k in kind], [TYPES[k] for k in type_]
    ... # doctest: +NORMALIZE_WHITESPACE
    (['full turn', 'change point', 'limited', 'never assembled', 'immovable'],
     ['crank-rocker', 'change point', 'triple rocker', 'never assembled', 'immovable'])
    """
    g, a, b, c = lengths.T
    nearest, farthest, least, most = np.abs(g - a), g + a, np.abs(b - c), b + c
    return rotation_kind(nearest - least, farthest - most, nearest - most, farthest - least), grashof_type(lengths)


@dataclass(frozen=True, slots=True)
class Shard:
    """Sets `start` to `stop` (without it) of the lattice: one candidate of the stream."""

    number: int
    start: int
    stop: int

    @property
    def key(self) -> str:
        """What it is, for the journal."""
        return f"sets {self.start} to {self.stop - 1}"


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """Sets of the lattice with everything that is known of each, arrays of shape (n,).

    `lengths` (n, 4): frame, crank, coupler, rocker in units of the lattice (exact); `kind`, `type`: exact, see
    `classify`; `size`: longest length over the crank; `passes`: keeps the limits of the scene;
    `rejected`: sets by the first limit that they miss.
    """

    sets: Ints
    lengths: Ints
    kind: NDArray[np.int8]
    type: NDArray[np.int8]
    moved: Moved
    jamming: Jamming
    size: Array
    passes: NDArray[np.bool_]
    rejected: dict[str, int]

    def quantity(self, name: str) -> Array:
        """Return a margin of `QUANTITIES` by set, in its unit."""
        values = (self.moved.transmission, self.moved.swing, self.size, *self.jamming)
        found = dict(zip(QUANTITIES, values, strict=True))[name]
        return Unit.parse("deg").from_si(found) if QUANTITIES[name] == "deg" else found

    def rounded(self, name: str) -> Array:
        """Return a margin to the 9 decimals by which sets are rejected, ranked and stored: rounding decides nothing.

        What is 30 degrees but for rounding keeps a limit of 30 degrees, and what differs by rounding alone is a tie.
        """
        return np.round(self.quantity(name), 9)


def shards(context: Context) -> Iterator[Shard]:
    """Cut the lattice into runs of sets; a shard depends on the scene and its number only."""
    lattice = lattice_of(context)
    objectives_of(context)
    size = context.scene.mechanism.shard
    whole = len(lattice.rocker)  # a pair of frame and coupler stays together, so that its maps are whole
    step = max(1, size // whole) * whole
    for number, start in enumerate(range(0, len(lattice), step), 1):
        yield Shard(number, start, min(start + step, len(lattice)))


def objectives_of(context: Context) -> tuple[Objective, ...]:
    """Return the objectives of ``[ranking]``, or the usual ones; a `SceneError` if one names no margin of a set."""
    table = context.scene.ranking
    if table is None:
        return _DEFAULT
    for i, objective in enumerate(table.objectives):
        if objective.quantity not in QUANTITIES:
            raise (context.scene.place / "ranking" / "objectives" / str(i)).error(
                f"has quantity = {objective.quantity!r}, which no set has{suggest(objective.quantity, QUANTITIES)}",
                "quantity",
            )
    return tuple(Objective(o.quantity, o.goal if o.target is None else o.target, o.weight) for o in table.objectives)


def evaluate_sets(context: Context, lattice: Lattice, sets: Ints) -> Evaluated:
    """Classify (exact), move and assess (estimated) some sets of the lattice."""
    table: SurveyTable = context.scene.mechanism
    lengths = lattice.lengths(sets)
    kind, types = classify(lengths)
    moved = move(lengths, table.positions)
    jamming = close_form(table, lengths)
    size = lengths.max(axis=1) / lattice.crank
    done = Evaluated(sets, lengths, kind, types, moved, jamming, size, np.ones(len(sets), dtype=np.bool_), {})
    least = round(Unit.parse("deg").from_si(table.limits.transmission), 9)
    limits = {
        "the crank does not turn fully": done.kind == KINDS.index("full turn"),
        f"not {' or '.join(table.limits.types)}": np.isin(done.type, [TYPES.index(t) for t in table.limits.types]),
        "the transmission angle is too small": done.rounded("transmission angle") >= least,
        "the bearing binds at the tilt of the scene": (jamming.part == 0.0) | (not table.limits.free),
    }
    for words, kept in limits.items():
        done.rejected[words] = int(np.sum(done.passes & ~kept))
        done.passes[~kept] = False
    return done


def evaluate(context: Context, shard: Shard) -> tuple[Evaluated, dict[str, Any]]:
    """Evaluate a shard; give its sets for the rows, and what the survey keeps of it.

    `classes`: rows (exact type, exact kind, kind found in motion, count); `front`: the sets of the shard's own Pareto
    front; `losses`: by what the sets that pass are ranked, rows of numbers bit by bit.
    """
    lattice = lattice_of(context)
    done = evaluate_sets(context, lattice, np.arange(shard.start, shard.stop))
    classes = Counter(zip(done.type.tolist(), done.kind.tolist(), done.moved.kind.tolist()))
    passing = np.flatnonzero(done.passes)
    losses = losses_of(objectives_of(context), done, passing)
    return done, {
        "start": shard.start,
        "sets": len(done.sets),
        "positions": int(done.moved.positions),
        "classes": [[*what, count] for what, count in sorted(classes.items())],
        "rejected": done.rejected,
        "maps": _maps(lattice, done),
        "passing": len(passing),
        "front": done.sets[passing[front_of(losses)]].tolist(),
        "losses": b64encode(np.column_stack([done.sets[passing], losses]).astype("<f8").tobytes()).decode(),
    }


def _maps(lattice: Lattice, done: Evaluated) -> dict[str, list[Any]]:
    """Reduce over the rocker: by pair (frame, coupler) the best transmission angle, and the best tilt that passes."""
    pairs = done.lengths[:, [0, 2]].reshape(-1, len(lattice.rocker), 2)[:, 0]
    turns = (done.kind == KINDS.index("full turn")).reshape(len(pairs), -1)
    by_pair = {
        name: np.where(mask, done.quantity(name).reshape(len(pairs), -1), -1.0).max(axis=1)
        for name, mask in (("transmission angle", turns), ("largest axis tilt", done.passes.reshape(len(pairs), -1)))
    }
    kept = by_pair["transmission angle"] >= 0.0
    return {
        "frame": pairs[kept, 0].tolist(),
        "coupler": pairs[kept, 1].tolist(),
        "turning": turns.sum(axis=1)[kept].tolist(),
        **{name: np.round(values[kept], 6).tolist() for name, values in by_pair.items()},
    }


def losses_of(objectives: tuple[Objective, ...], done: Evaluated, which: NDArray[np.intp]) -> Array:
    """Return what is to be small, shape (n, objectives)."""
    losses = np.empty((len(which), len(objectives)))
    sign = {"min": 1.0, "max": -1.0}
    for k, objective in enumerate(objectives):
        values, goal = done.rounded(objective.quantity)[which], objective.goal
        losses[:, k] = sign[goal] * values if isinstance(goal, str) else np.abs(values - goal)
    losses[~np.isfinite(losses)] = np.inf
    return losses


def front_of(losses: Array) -> NDArray[np.intp]:
    """Return the rows that no other row beats: at most as large everywhere and smaller somewhere.

    The row of least sum among those left is of the front; what it beats is dropped; and so on.

    Examples
    --------
    >>> front_of(np.array([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]])).tolist()
    [0, 1, 3]
    """
    left = np.flatnonzero(np.isfinite(losses).all(axis=1))
    if not len(left):
        return left
    span = np.ptp(losses[left], axis=0)
    left = left[np.argsort((losses[left] / np.where(span > 0.0, span, 1.0)).sum(axis=1), kind="stable")]
    front: list[NDArray[np.intp]] = []
    while len(left):
        row = losses[left[0]]
        rows = losses[left]
        beats = (rows <= row).all(axis=1) & (rows < row).any(axis=1)
        if beats.any():  # rounding of the sum put the loser first
            left = np.concatenate([left[beats], left[~beats]])
            continue
        same = (rows == row).all(axis=1)
        front.append(left[same])
        left = left[~((rows >= row).all(axis=1))]
    return np.sort(np.concatenate(front))


def store(context: Context, evaluated: Evaluated) -> Columns:
    """Lay out the rows of a shard: the columns the scene names, of all sets or of those that pass."""
    table: SurveyTable = context.scene.mechanism
    which = slice(None) if table.rows == "all" else np.flatnonzero(evaluated.passes)
    unit = float(lattice_of(context).unit)
    columns: dict[str, Any] = {"set": evaluated.sets[which]}
    for name in table.columns:
        header = f"{name} [{_UNITS[name]}]" if _UNITS[name] else name
        columns[header] = _column(evaluated, name, unit)[which]
    return Columns("rows", columns)


def _column(done: Evaluated, name: str, unit: float) -> NDArray[Any]:
    if name in ("frame", "coupler", "rocker"):
        values = done.lengths[:, ("frame", "crank", "coupler", "rocker").index(name)] * unit
        return np.asarray([float(f"{v:.12g}") for v in np.unique(values)])[np.unique(values, return_inverse=True)[1]]
    if name == "type":
        return np.array(TYPES)[done.type]
    if name == "kind":
        return np.array(KINDS)[done.kind]
    if name == "passes":
        return done.passes.astype(np.int8)
    values = done.rounded(name)
    return np.where(np.isfinite(values), values, math.nan)
