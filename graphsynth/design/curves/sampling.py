"""Mechanisms of a family drawn at random and moved, and the curves of their links."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.curves.families import Family
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.kinematics.engine.batch import simulate_batch

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Positions per rotation of the driver, and of a slide.
TURN = 128
#: Fewest positions of an open curve, and the chances to keep a partial range, and part of a full rotation.
_FEWEST, _PARTIAL, _PART = 16, 0.5, 0.2
#: A link is at its place again, and a curve is a curve if it is larger than this part of its mechanism.
_SAME, _SMALLEST = 1e-6, 0.02
#: Standard deviation of joints about the sketch and of tracing points about a link, in mean sides; sizes of cranks.
_SHAKEN, _CRANKS, _ARM = (0.05, 0.7), (0.1, 1.0), 0.8
#: Longest slide of a driver, in mean sides.
_SLIDE = 2.0


class Drawn(NamedTuple):
    """Curves of one family: numbers in single precision, as stored, and the curves (curves, TURN + 1).

    ``places`` (curves, joints, 2) and ``numbers`` are those of a `Design`; ``point`` is the tracing point, where it is
    at the first input 0; the curve is drawn over the inputs from ``first`` to ``last``, with ``modes`` of the dyads as
    bits.  A curve of fewer points repeats its last one; ``samples`` tells how many it has; ``turns`` are
    the directions of the link there.
    """

    places: NDArray[np.float32]
    numbers: NDArray[np.float32]
    link: NDArray[np.uint8]
    point: NDArray[np.float32]
    first: NDArray[np.float32]
    last: NDArray[np.float32]
    modes: NDArray[np.uint8]
    closed: NDArray[np.bool_]
    samples: NDArray[np.int64]
    curves: Complex
    turns: Complex


def reach(family: Family) -> float:
    """Range of a driver: a rotation, or the longest slide."""
    return math.tau if family.turns else _SLIDE


def draw(family: Family, count: int, random: np.random.Generator) -> Drawn:
    """Draw mechanisms and move them; return the curves of those that move, one for every tracing link."""
    places, numbers = _dimensions(family, count, random)
    modes = start_modes(family, places, numbers)
    links = family.tracing
    arms = random.normal(0.0, _ARM, (count, len(links), 2)) * random.random((count, len(links), 1))
    chance, cut = random.random((2, count)), random.random((2, count))
    parts = [
        _of_modes(family, bits, at, places[at], numbers[at], arms[at], chance[:, at], cut[:, at])
        for bits in range(2 ** len(_dyads(family)))
        for at in [np.flatnonzero(modes == bits)]
    ]
    order = np.argsort(np.concatenate([own for own, _ in parts]), kind="stable")
    return Drawn(*(np.concatenate(column)[order] for column in zip(*(drawn for _, drawn in parts))))


def _dimensions(family: Family, count: int, random: np.random.Generator) -> tuple[Array, Array]:
    """Places about the sketch, cranks of many sizes, directions; rounded to what is stored."""
    design = family.design
    sketch = layout(design.graph).positions
    places = sketch + random.normal(0.0, 1.0, (count, *sketch.shape)) * random.uniform(*_SHAKEN, (count, 1, 1))
    sizes = random.uniform(math.log(_CRANKS[0]), math.log(_CRANKS[1]), (len(design.cranks), count))
    places = design.with_cranks(places, np.exp(sizes))
    numbers = random.uniform(0.0, math.pi, (count, len(design.numbers)))
    return places.astype(np.float32).astype(np.float64), numbers.astype(np.float32).astype(np.float64)


def _dyads(family: Family) -> list[int]:
    return [k for k, size in enumerate(family.groups) if size == 2]


def start_modes(family: Family, places: Array, numbers: Array) -> NDArray[np.int64]:
    """Modes of the dyads, as bits (1: negative), with which a mechanism is assembled as its joints lie; -1 for none."""
    found = np.full(len(places), -1)
    for bits in range(2 ** len(_dyads(family))):
        frames, _ = move(family, bits, np.zeros(1), places, numbers)
        with np.errstate(invalid="ignore"):
            there = np.abs(frames[:, 0] - [0.0, 0.0, 1.0, 0.0]).max(axis=(1, 2)) < _SAME
        found[there & (found < 0)] = bits
    return found


def move(family: Family, bits: int, inputs: Array, places: Array, numbers: Array) -> tuple[Array, NDArray[np.int64]]:
    """Poses x, y, cos, sin of all links (sets, n, links, 4) over inputs from 0, and how many inputs were reached."""
    design = family.design
    mechanism = design.mechanism(places[0], numbers[0])
    modes = {group: -1 if bits >> k & 1 else 1 for k, group in enumerate(_dyads(family))}
    rest = np.zeros((design.graph.links, 3))
    motion = simulate_batch(mechanism, inputs, design.dimensions(places, numbers), modes=modes, start=rest, rates=False)
    return motion.frames, motion.reached


def _of_modes(
    family: Family,
    bits: int,
    at: NDArray[np.int64],
    places: Array,
    numbers: Array,
    arms: Array,
    chance: Array,
    cut: Array,
) -> tuple[NDArray[np.int64], Drawn]:
    """Move mechanisms of the same modes; which of those drawn they are, once for every curve, and the curves."""
    design, links = family.design, list(family.tracing)
    n = TURN + 1
    inputs = np.linspace(0.0, reach(family), n)
    frames = np.zeros((len(places), 2 * TURN + 1, design.graph.links, 4))
    first, last = np.full(len(places), TURN), np.full(len(places), 2 * TURN)
    closed = np.zeros(len(places), dtype=np.bool_)
    if len(places):
        ahead, reached = move(family, bits, inputs, places, numbers)
        frames[:, TURN:], last = ahead, TURN + reached - 1
        with np.errstate(invalid="ignore"):
            closed = (reached == n) & (np.abs(ahead[:, -1] - ahead[:, 0]).max(axis=(1, 2)) < _SAME) & family.turns
        back = np.flatnonzero(reached < n)
        if back.size:
            behind, reached = move(family, bits, -inputs, places[back], numbers[back])
            frames[back, :TURN], first[back] = behind[:, :0:-1], TURN - reached + 1
    # part of a full rotation is an open curve, too
    part = closed & (chance[0] < _PART)
    span = _FEWEST + cut[0] * (TURN - 2 * _FEWEST)
    first = np.where(part, TURN + cut[1] * (TURN - span), first).astype(np.int64)
    last = np.where(part, first + span, last).astype(np.int64)
    closed &= ~part
    last = np.minimum(last, first + TURN)  # not over more than a rotation
    kept = closed | part | ((last - first >= _FEWEST) & (chance[1] < _PARTIAL))
    # a point on every link that traces, and where it goes
    which, trace = (index.ravel() for index in np.meshgrid(np.flatnonzero(kept), np.arange(len(links)), indexing="ij"))
    link = np.array(links)[trace]
    centre = np.stack([places[:, design.joints_of(k)].mean(axis=1) for k in links], axis=1)
    point = (centre + arms)[which, trace].astype(np.float32)
    window = np.minimum(first[which, None] + np.arange(n), last[which, None])
    x, y, c, s = np.moveaxis(frames[which[:, None], window, link[:, None]], -1, 0)
    local = point[:, :1].astype(np.float64) + 1j * point[:, 1:].astype(np.float64)
    curves = x + 1j * y + (c + 1j * s) * local
    spread = np.abs(curves - curves.mean(axis=1, keepdims=True)).max(axis=1)
    size = np.abs(places - places.mean(axis=1, keepdims=True)).max(axis=(1, 2))
    good = spread > _SMALLEST * size[which]
    own = which[good]
    return at[own], Drawn(
        places[own].astype(np.float32),
        numbers[own].astype(np.float32),
        link[good].astype(np.uint8),
        point[good],
        ((first[own] - TURN) * inputs[1]).astype(np.float32),
        ((last[own] - TURN) * inputs[1]).astype(np.float32),
        np.full(len(own), bits, dtype=np.uint8),
        closed[own],
        (last - first + 1)[own],
        curves[good],
        (c + 1j * s)[good],
    )
