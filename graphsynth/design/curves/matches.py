"""What an index finds: mechanisms, placed so that they draw the curve that was asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.curves.families import Family
from graphsynth.design.curves.sampling import TURN, move, reach
from graphsynth.kinematics.dimensional.design import Design, World
from graphsynth.kinematics.dimensional.goals import Goals
from graphsynth.kinematics.dimensional.problem import DimensionProblem, lying
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Positions per position of the index, with which a mechanism that was found is moved anew.
_FINER = 4


class Traced(NamedTuple):
    """A mechanism of the index moved anew: inputs (n,), curve and direction of its link (n,) as complex numbers."""

    inputs: Array
    curve: Complex
    turn: Complex


class Entry(NamedTuple):
    """One row of an index: a mechanism with a tracing point, as it was drawn."""

    family: Family
    row: NDArray[Any]

    @property
    def closed(self) -> bool:
        """Whether the driver turns fully and the curve is closed."""
        return bool(self.row["closed"])

    @property
    def places(self) -> Array:
        """Places of the joints at the input 0."""
        return np.asarray(self.row["places"][: len(self.family.design.graph.joints)], dtype=np.float64)

    @property
    def numbers(self) -> Array:
        """Directions of the slides there."""
        return np.asarray(self.row["numbers"][: len(self.family.design.numbers)], dtype=np.float64)

    @property
    def point(self) -> complex:
        """The tracing point there."""
        x, y = self.row["point"].tolist()
        return complex(x, y)

    def frames(self, inputs: Array) -> Array:
        """Poses of all links over inputs from 0."""
        given = self.places[None], self.numbers[None]
        return np.asarray(move(self.family, int(self.row["modes"]), inputs, *given)[0][0])

    def traced(self) -> Traced:
        """Move the mechanism over its range, four times as fine as for the index."""
        first, last = (float(value) for value in self.row["inputs"])
        if self.closed:
            last = math.tau
        parts = []
        for end in (first, last):
            if (end < 0.0 and end == first) or (end > 0.0 and end == last):
                inputs = _inputs(self.family, end)
                parts.append((inputs, self.frames(inputs)[:, self.row["link"]]))
        inputs, own = parts[-1]
        if len(parts) > 1:
            inputs = np.concatenate([parts[0][0][:0:-1], inputs])
            own = np.concatenate([parts[0][1][:0:-1], own])
        elif last <= 0.0:
            inputs, own = inputs[::-1], own[::-1]
        step = reach(self.family) / (TURN * _FINER)
        kept = (inputs >= first - 0.5 * step) & (inputs <= last + 0.5 * step) & np.isfinite(own).all(axis=1)
        turn = own[kept, 2] + 1j * own[kept, 3]
        return Traced(inputs[kept], own[kept, 0] + 1j * own[kept, 1] + turn * self.point, turn)


def _inputs(family: Family, end: float) -> Array:
    """Return inputs from 0 to an end, in the finer steps."""
    if end == 0.0:
        return np.zeros(1)
    return np.linspace(0.0, end, max(2, math.ceil(abs(end) / reach(family) * TURN * _FINER - 1e-3) + 1))


@dataclass(frozen=True, eq=False)
class CurveStart:
    """Where a search for dimensions may begin.

    Attributes
    ----------
    design : Design
        Graph with frame, driver and kinds of joints.
    link : int
        The link that traces.
    places, numbers : ndarray, shapes (joints, 2) and (numbers,)
        Unknowns of the design at the first input; the curve lies where it is wanted.
    point : complex
        The tracing point at the first input.
    sense : int
        +1 if the driver turns left, -1 right.
    span : float
        Range of the input, 2 pi for a full rotation.
    closed : bool
        Whether the driver turns fully.
    """

    design: Design
    link: int
    places: Array
    numbers: Array
    point: complex
    sense: int
    span: float
    closed: bool

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism, with the tracing point "P"; it draws the curve over the inputs 0 to ``span``."""
        design = self.design
        world = [World.read(row) for row in design.dimensions(self.places[None], self.numbers[None])[0]]
        return lying(design, world, {"P": (self.link, self.point)}, float(self.sense))

    def problem(self, goals: Goals) -> tuple[DimensionProblem, Array]:
        """Return the search problem that begins here, and the vector of this mechanism in it.

        Lengths are over their mean, as in a sketch; so is the span of ``goals`` if the driver slides.
        """
        sides = self.design.sides
        apart = self.places[sides[:, 0]] - self.places[sides[:, 1]]
        size = float(np.hypot(*apart.T).mean()) if len(apart) else 1.0
        places = (self.places - self.places.mean(axis=0)) / size
        given = places, self.numbers
        problem = DimensionProblem(self.design, goals, np.random.default_rng(0), int(self.sense < 0), given)
        extras = problem.bounds()[problem.size - problem.extras :].mean(axis=1)
        return problem, np.concatenate([places[problem.free].ravel(), self.numbers, extras])


class Fitted(NamedTuple):
    """How the curve of an entry comes to where it is wanted: ``factor z + offset``, z conjugate if reflected.

    ``start`` is the input at which the wanted curve begins, ``span`` the range, ``backwards`` says whether it is run
    against the input; ``arm`` leads to the point of the link that is meant, in units of its direction.
    """

    factor: complex
    offset: complex
    reflected: bool
    start: float
    span: float
    backwards: bool
    arm: complex = 0j


def begun(entry: Entry, fitted: Fitted) -> CurveStart:
    """Place a mechanism of the index, at the pose where the wanted curve begins."""
    design, link = entry.family.design, int(entry.row["link"])
    pose = entry.frames(_inputs(entry.family, fitted.start))[-1]
    origin, turn = pose[:, 0] + 1j * pose[:, 1], pose[:, 2] + 1j * pose[:, 3]
    of_b, of_a = (np.array([joint[k] for joint in design.graph.joints]) for k in (1, 0))
    places = origin[of_b] + turn[of_b] * (entry.places @ [1.0, 1.0j])
    sliding = [k for k, _ in design.numbers]
    ways = turn[of_a[sliding]] * np.exp(1j * entry.numbers)
    point = origin[link] + turn[link] * entry.point
    if fitted.reflected:
        places, ways, point = np.conj(places), np.conj(ways), np.conj(point)
    point += fitted.arm * (np.conj(turn[link]) if fitted.reflected else turn[link])
    places, ways = fitted.factor * places + fitted.offset, fitted.factor * ways
    sense = -1.0 if fitted.backwards else 1.0
    size = 1.0
    if entry.family.turns:
        sense = -sense if fitted.reflected else sense
    else:
        size = abs(fitted.factor)
    return CurveStart(
        design,
        link,
        np.column_stack([places.real, places.imag]),
        np.angle(ways),
        complex(fitted.factor * point + fitted.offset),
        int(sense),
        math.tau if entry.closed else fitted.span * size,
        entry.closed,
    )


@dataclass(frozen=True, eq=False)
class CurveMatch:
    """A mechanism of an index whose curve is near the wanted one; estimated: floating point.

    Attributes
    ----------
    error : float
        Root mean square distance of the curves, point by point over the arc length (or the input), over the root mean
        square distance of the wanted curve from its centre; of motions see `CurveIndex.find_motion`.
    key : str
        Canonical key of the graph with its frame.
    links : int
    dyadic : bool
        Whether all structural groups are dyads.
    number : int
        Row of the index.
    start : CurveStart
        The mechanism as unknowns of a search.
    """

    error: float
    key: str
    links: int
    dyadic: bool
    number: int
    entry: Entry = field(repr=False)
    fitted: Fitted = field(repr=False)

    @cached_property
    def start(self) -> CurveStart:
        """The mechanism as unknowns of a search."""
        return begun(self.entry, self.fitted)

    @property
    def turns(self) -> bool:
        """Whether the driver turns; else it slides."""
        return self.entry.family.turns

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism, placed on the wanted curve, which its point "P" draws over ``inputs``."""
        return self.start.mechanism

    @property
    def inputs(self) -> Array:
        """Inputs of one pass over the curve."""
        return np.linspace(0.0, self.start.span, TURN * _FINER + 1)
