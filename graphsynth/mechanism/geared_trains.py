"""A planetary gear train with numbers of teeth as a planar mechanism that can be moved."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from graphsynth.core.errors import GraphError, SpecError
from graphsynth.mechanism.joints import Gear, JointGeometry, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.gear_speeds import Teeth, teeth_of
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.structure.gear_trains import PlanetaryGearTrain


def train_mechanism(train: PlanetaryGearTrain, inputs: Sequence[int], fixed: int, teeth: Teeth) -> Mechanism:
    """Work of `PlanetaryGearTrain.mechanism`.

    The first axis of the fixed link is at the origin; axes around another one lie where the teeth of a pair between
    them say, with module 1, in directions of their own.  Pitch radii of other pairs, such as two planets, follow from
    the distance of their axes: every pair has the module that fits.
    """
    if len(set(inputs)) != train.mobility:
        raise GraphError(f"a train of mobility {train.mobility} takes as many inputs, not {list(inputs)}")
    for link in inputs:
        if link == fixed or not any({link, fixed} <= set(axis) for axis in train.axes):
            raise GraphError(
                f"link {link} does not turn about an axis of link {fixed}, which is fixed: choose another input"
            )
    numbers = {pair: _sizes(pair, own) for pair, own in teeth_of(train, teeth).items()}
    ends = {pair[:2]: tuple(_axis(train, gear, pair.carrier) for gear in pair[:2]) for pair in train.gears}
    where = _places(train, fixed, {frozenset(ends[pair]): abs(za + zb) / 2 for pair, (za, zb) in numbers.items()})
    joints: list[JointGeometry] = []
    for axis, links in enumerate(train.axes):
        hub = fixed if fixed in links else max(links, key=lambda link: (sum(link in own for own in train.axes), -link))
        at = (where[axis].real, where[axis].imag)
        joints += [Revolute(min(hub, link), max(hub, link), at, at) for link in links if link != hub]
    for (a, b), (za, zb) in numbers.items():
        one, other = (where[axis] for axis in ends[a, b])
        way, internal = other - one, za * zb < 0
        ra, rb = (abs(way) * abs(z / (za + zb)) for z in (za, zb))
        offset = -cmath.phase(way) * (1 + ra / rb * (-1 if internal else 1))  # teeth meet as the train is drawn
        joints.append(Gear(a, b, (one.real, one.imag), (other.real, other.imag), ra, rb, internal, offset))
    graph = MechanismGraph(train.links, [(joint.a, joint.b, joint.mobility) for joint in joints], frame=fixed)
    return Mechanism(
        graph, tuple(joints), tuple(Driver(fixed, link) for link in inputs), pose=((0.0, 0.0, 0.0),) * train.links
    )


def _sizes(pair: tuple[int, int], teeth: tuple[object, object]) -> tuple[float, float]:
    """Return numbers of teeth as floats; `SpecError` for symbols, and rings that do not hold their pinions."""
    try:
        za, zb = float(teeth[0]), float(teeth[1])  # type: ignore[arg-type]
    except TypeError:
        raise SpecError(f"the teeth of gear pair {pair} must be numbers to be given a size, not {teeth}") from None
    if za + zb >= 0 > min(za, zb) or max(za, zb) < 0:
        raise SpecError(f"gear pair {pair} has {za:g} and {zb:g} teeth: the internal gear must be the larger one")
    return za, zb


def _axis(train: PlanetaryGearTrain, gear: int, carrier: int) -> int:
    return next(k for k, links in enumerate(train.axes) if gear in links and carrier in links)


def _places(train: PlanetaryGearTrain, fixed: int, distances: dict[frozenset[int], float]) -> dict[int, complex]:
    """Place the axes, those of the fixed link first, each at its distance from the one it is reached from."""
    usual = max(distances.values())
    waiting = [next(k for k, links in enumerate(train.axes) if fixed in links)]
    where = {waiting[0]: 0j}
    for axis in waiting:
        for link in train.axes[axis]:
            others = [k for k, links in enumerate(train.axes) if link in links and k not in where]
            for turn, other in enumerate(others):
                direction = 2 * math.pi * (turn / len(others) + 0.13 * len(waiting))
                where[other] = where[axis] + cmath.rect(distances.get(frozenset((axis, other)), usual), direction)
            waiting += others
    return where
