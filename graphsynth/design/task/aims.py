"""Errors of every kind of target over many candidates: when it is looked at, by how much it is missed, why.

All are in tolerances of their target, spread over its samples, so that targets add up by their weights.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.model import Model, Moved, Rows, Unknowns
from graphsynth.design.task.targets import DwellTarget, FunctionTarget, LinkTarget, PathTarget, PosesTarget, SwingTarget
from graphsynth.kinematics.dimensional.matching import MovingLink, Wanted, followed, matched

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Samples of a dwell; inputs next to a dead centre, and weights of the values there that give its speed (order six).
_STILL, _NEAR = 13, 0.004
_OFFSETS, _DIFFERENCE = (
    np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0]),
    np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0,
)
#: Samples all over a curve that shall draw a closed path.
_WHOLE = 48
#: Half the width of the band that holds it, over a side: at most, and for each radian by which the polygon turns at an
#: end, twice the sagitta of an arc; what turns more than this is a corner of the curve.
_BAND, _SAGITTA, _SHARP = 0.2, 0.25, 1.2
#: Steps of the times of a path after each step of its mechanism.
_ROUNDS = 2


class Aim(ABC):
    """A target for the candidates of one model; ``at`` is where its own unknowns begin in the vector.

    ``unknowns``: how many it has.
    """

    unknowns = 0

    def __init__(self, model: Model, at: int, weight: float) -> None:
        self.model, self.at, self.weight = model, at, weight

    @abstractmethod
    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Return the inputs (sets, n) at which it is looked at, near those before, if any."""

    def looked(self, moved: Moved, times: Array) -> tuple[Array, Array]:
        """Return frames (sets, n, links, 4) and rates (sets, n, links, 3) of all links there."""
        return moved.at(times)

    @abstractmethod
    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Return errors at frames (sets, n, links, 4) and rates (sets, n, links, 3)."""

    def begin(self, times: Array, moved: Moved, u: Unknowns, random: np.random.Generator) -> Array:
        """Return first values (sets, unknowns) of its own unknowns."""
        return np.zeros((len(moved.frames), self.unknowns))

    def blank(self, sets: int, deep: int, n: int) -> tuple[Array, Array]:
        """Return loads and direct derivatives, all zero."""
        return np.zeros((sets, deep, self.model.links, 3, n)), np.zeros((sets, deep, n, self.model.size))

    def own(self, u: Unknowns, k: int) -> Array:
        """Return one of its own unknowns (sets, 1)."""
        first = self.at - self.model.own_at + k
        return u.own[:, first : first + 1]


class TimedAim(Aim):
    """Times of a target: given from the common start, from a start of its own, or found (``wanted``)."""

    wanted: Wanted | None = None

    def __init__(self, model: Model, at: int, weight: float, inputs: tuple[float, ...] | None, own_start: bool) -> None:
        super().__init__(model, at, weight)
        self.inputs, self.own_start = inputs, own_start
        self.unknowns = int(own_start and inputs is not None)

    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Given, shifted, or followed along the motion of the named point."""
        sets = len(moved.frames)
        if self.inputs is not None:
            return np.array(self.inputs) + (self.own(u, self.unknowns - 1) if self.own_start else np.zeros((sets, 1)))
        own = self.seen(moved, u)
        assert self.wanted is not None
        return matched(own, self.wanted) if before is None else followed(own, before, self.wanted, _ROUNDS)

    def seen(self, moved: Moved, u: Unknowns) -> MovingLink:
        """Return the motion of the link with its origin in the named point."""
        raise NotImplementedError

    @property
    def start(self) -> int:
        """Where the start of its own stands in the vector; -1 if there is none."""
        return self.at + self.unknowns - 1 if self.own_start and self.inputs is not None else -1


class PointAim(TimedAim):
    """A point passes points, or a link poses; for poses one more unknown, the line from which angles are measured."""

    def __init__(self, model: Model, at: int, target: PathTarget | PosesTarget, few: int) -> None:
        super().__init__(model, at, target.weight / target.tolerance, target.inputs, target.own_start)
        self.goal, self.size, n = target.goal, target.size, len(target.goal)
        self.turn = target.turn if isinstance(target, PosesTarget) else None
        closed = isinstance(target, PathTarget) and target.closed
        coarse = few > 0 and self.inputs is None
        if coarse and few < n:
            kept = np.linspace(0, n if closed else n - 1, few, endpoint=not closed).round().astype(int)
            self.goal, self.turn = self.goal[kept], None if self.turn is None else self.turn[kept]
        self.unknowns += self.turn is not None
        self.link, self.point = model.carrier(target.point), model.point_at(target.point)
        self.wanted = Wanted(self.goal, self.turn, self.size, closed, free=False)
        self.whole = (
            np.linspace(0.0, model.task.span, _WHOLE, endpoint=False)
            if closed and self.inputs is None and not coarse
            else np.zeros(0)
        )
        self.weight /= math.sqrt(len(self.goal) + len(self.whole))

    def place(self, u: Unknowns) -> Complex:
        """Place of the point on its link, (sets, 1)."""
        k = (self.point - self.model.points_at) // 2
        return u.points[:, k : k + 1, 0] + 1j * u.points[:, k : k + 1, 1]

    def seen(self, moved: Moved, u: Unknowns) -> MovingLink:
        """Return the motion of the link with its origin in the named point."""
        own, p = moved.link(self.link), self.place(u)
        arm = (own.frames[..., 2] + 1j * own.frames[..., 3]) * p
        frames, rates = own.frames.copy(), own.rates.copy()
        frames[..., 0] += arm.real
        frames[..., 1] += arm.imag
        rates[..., 0] -= arm.imag * own.rates[..., 2]
        rates[..., 1] += arm.real * own.rates[..., 2]
        return MovingLink(own.u, frames, rates, own.period)

    def begin(self, times: Array, moved: Moved, u: Unknowns, random: np.random.Generator) -> Array:
        """Measure angles from the line that suits best; begin anywhere."""
        found = random.uniform(0.0, self.model.task.span, (len(times), self.unknowns))
        if self.turn is not None:
            frames, _ = moved.at(times)
            w = frames[:, :, self.link, 2] + 1j * frames[:, :, self.link, 3]
            found[:, 0] = np.angle((w * np.exp(-1j * self.turn)).sum(axis=1))
        return found

    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Those of the points; of a closed path also some all over the curve."""
        n = len(self.goal)
        found = super().times(moved, u, None if before is None else before[:, :n])
        return np.concatenate([found, np.tile(self.whole, (len(found), 1))], axis=1) if len(self.whole) else found

    def put(self, loads: Array, direct: Array, arm: Complex, w: Complex) -> None:
        """Write how the place of the point over the size changes into the first two rows."""
        loads[:, 0, self.link, 0] = loads[:, 1, self.link, 1] = 1.0 / self.size
        loads[:, 0, self.link, 2], loads[:, 1, self.link, 2] = -arm.imag / self.size, arm.real / self.size
        direct[:, 0, :, self.point], direct[:, 1, :, self.point] = w.real / self.size, w.imag / self.size
        direct[:, 0, :, self.point + 1], direct[:, 1, :, self.point + 1] = -w.imag / self.size, w.real / self.size

    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Real and imaginary parts of distances over the size, and angles."""
        own = frames[:, :, self.link]
        z, w = own[..., 0] + 1j * own[..., 1], own[..., 2] + 1j * own[..., 3]
        arm = w * self.place(u)
        goal = np.broadcast_to(self.goal, (len(z), len(self.goal)))
        if len(self.whole):  # no part of the curve may be elsewhere
            goal = np.concatenate([goal, beside((z + arm)[:, len(self.goal) :], self.goal)], axis=1)
        e = (z + arm - goal) / self.size
        sets, n = z.shape
        loads, direct = self.blank(sets, 2 + (self.turn is not None), n)
        self.put(loads, direct, arm, w)
        if len(self.whole):
            inside = e == 0.0
            loads, direct = loads * ~inside[:, None, None, None], direct * ~inside[:, None, :, None]
        values = [e.real, e.imag]
        if self.turn is not None:
            values.append(np.angle(w * np.exp(-1j * (self.turn + self.own(u, 0)))))
            loads[:, 2, self.link, 2] = 1.0
            direct[:, 2, :, self.at] = -1.0
        free = self.inputs is None
        return Rows(times, np.stack(values, axis=1), loads, direct, self.weight, free, start=self.start)


def bands(corners: Complex) -> Array:
    """Return half the widths of the bands about the sides of a closed polygon that hold a smooth curve through them.

    Where the polygon goes straight on, or has a sharp corner, so does the curve.

    >>> (bands(np.exp(0.1j * math.pi * np.arange(20))) / abs(np.exp(0.1j * math.pi) - 1)).round(3)[:2].tolist()
    [0.079, 0.079]
    """
    side = np.roll(corners, -1) - corners
    turn = np.abs(np.angle(side * np.conj(np.roll(side, 1))))
    turn[turn > _SHARP] = 0.0
    return np.abs(side) * np.minimum(_BAND, _SAGITTA * np.maximum(turn, np.roll(turn, -1)))


def beside(z: Complex, corners: Complex) -> Complex:
    """Return points (any shape) themselves within the bands about a closed polygon, else the nearest ones there."""
    side = np.roll(corners, -1) - corners
    part = (np.conj(side) * (z[..., None] - corners)).real / np.maximum(np.abs(side) ** 2, 1e-300)
    on = corners + np.clip(part, 0.0, 1.0) * side
    away = np.maximum(np.abs(z[..., None] - on), 1e-300)
    over = np.maximum(away - bands(corners), 0.0)
    k = over.argmin(axis=-1)[..., None]
    way = (z[..., None] - on) * over / away
    return np.asarray(z - np.take_along_axis(way, k, axis=-1)[..., 0])


class Measure:
    """What a link does at its joint with the frame or another link: its angle, or its place along the guide there."""

    def __init__(self, model: Model, target: LinkTarget) -> None:
        design, self.link = model.plan.design, model.carrier(target.link)
        assert design.graph.frame is not None
        self.base = model.carrier(target.base) if target.base else design.graph.frame
        self.frame = design.graph.frame
        joints = [k for k, (a, b, _) in enumerate(design.graph.joints) if {a, b} == {self.base, self.link}]
        self.joint = joints[0] if joints else -1
        self.guide = model.angle_at(joints[0]) if joints and design.kinds[joints[0]] == "P" else -1
        self.model = model

    def _slid(self, frames: Array, u: Unknowns) -> tuple[Complex, Complex, Complex, Complex]:
        """Direction of the guide, way along it, arms of the link's and of the base's point, all (sets, n)."""
        number = self.model.angles[self.guide - 2 * len(self.model.free)]
        own, at = frames.view(np.complex128), (u.places[:, self.joint] @ [1.0, 1.0j])[:, None]
        arm, foot = own[:, :, self.link, 1] * at, own[:, :, self.base, 1] * at
        along = own[:, :, self.base, 1] * np.exp(1j * u.numbers[:, number : number + 1])
        return along, own[:, :, self.link, 0] + arm - own[:, :, self.base, 0] - foot, arm, foot

    def values(self, frames: Array, u: Unknowns) -> Array:
        """Values (sets, n): angles in (-pi, pi]."""
        frames = np.ascontiguousarray(frames)
        if self.guide < 0:
            own = frames.view(np.complex128)
            return np.asarray(np.angle(own[:, :, self.link, 1] * np.conj(own[:, :, self.base, 1])))
        along, way, _, _ = self._slid(frames, u)
        return np.asarray((np.conj(along) * way).real)

    def rates(self, frames: Array, rates: Array, u: Unknowns) -> Array:
        """Return derivatives by the input (sets, n)."""
        own, base = rates[:, :, self.link], rates[:, :, self.base]
        if self.guide < 0:
            return np.asarray(own[..., 2] - base[..., 2])
        along, way, arm, foot = self._slid(np.ascontiguousarray(frames), u)
        v = (own[..., 0] + 1j * own[..., 1]) - (base[..., 0] + 1j * base[..., 1])
        v += 1j * (own[..., 2] * arm - base[..., 2] * foot)
        return np.asarray((np.conj(along) * v).real + base[..., 2] * (np.conj(along) * way).imag)

    def put(self, loads: Array, direct: Array, frames: Array, u: Unknowns) -> None:
        """Write the derivatives of the values into the first row of loads and direct derivatives."""
        if self.guide < 0:
            loads[:, 0, self.link, 2] = 1.0
            if self.base != self.frame:
                loads[:, 0, self.base, 2] = -1.0
            return
        along, way, arm, foot = self._slid(np.ascontiguousarray(frames), u)
        turned = (np.conj(along) * way).imag
        moments = (np.conj(along) * 1j * arm).real, (np.conj(along) * 1j * foot).real - turned
        for link, sign, moment in ((self.link, 1.0, moments[0]), (self.base, -1.0, moments[1])):
            if link != self.frame:
                loads[:, 0, link, 0], loads[:, 0, link, 1] = sign * along.real, sign * along.imag
                loads[:, 0, link, 2] = sign * moment
        direct[:, 0, :, self.guide] = turned

    def wrapped(self, values: Array) -> Array:
        """Differences of angles in (-pi, pi], of places as they are."""
        return values if self.guide >= 0 else np.asarray(np.mod(values + math.pi, math.tau) - math.pi)


class FunctionAim(TimedAim):
    """A function of the input, or a dwell; one more unknown, the zero of the output."""

    def __init__(self, model: Model, at: int, target: FunctionTarget | DwellTarget) -> None:
        if isinstance(target, FunctionTarget):
            inputs, outputs, own_start = target.inputs, np.array(target.outputs), target.own_start
        else:
            inputs = tuple(((target.start or 0.0) + np.linspace(0.0, target.span, _STILL)).tolist())
            outputs, own_start = np.zeros(_STILL), target.start is None
        super().__init__(model, at, target.weight / target.tolerance / math.sqrt(len(outputs)), inputs, own_start)
        self.outputs, self.measure = outputs, Measure(model, target)
        self.unknowns += 1

    def begin(self, times: Array, moved: Moved, u: Unknowns, random: np.random.Generator) -> Array:
        """Begin where the output is nearest to what is wanted."""
        if not self.own_start:
            return np.zeros((len(moved.frames), 1))
        best = self.missed(moved, u).argmin(axis=1)
        return np.stack([np.zeros(len(best)), moved.inputs[best]], axis=1)

    def missed(self, moved: Moved, u: Unknowns) -> Array:
        """Return standard deviations (sets, samples) from the outputs if the inputs count from a sample."""
        values = self.measure.values(moved.frames, u)
        values = values if self.measure.guide >= 0 else np.unwrap(values, axis=1)
        starts = moved.inputs[:-1] if moved.period or self.own_start else moved.inputs[:1]
        at = np.array(self.inputs) + starts[:, None]
        turns = np.floor(at / moved.period) if moved.period else 0.0 * at
        rest, whole = at - turns * moved.period, values[:, -1] - values[:, 0]
        found = np.stack([np.interp(rest, moved.inputs, row) for row in values]) + turns * whole[:, None, None]
        return np.asarray((found - self.outputs).std(axis=2))

    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Differences from the outputs."""
        values = self.measure.wrapped(self.measure.values(frames, u) - self.outputs - self.own(u, 0))
        loads, direct = self.blank(len(values), 1, values.shape[1])
        self.measure.put(loads, direct, frames, u)
        direct[:, 0, :, self.at] -= 1.0
        return Rows(times, values[:, None], loads, direct, self.weight, start=self.start)

    def zero(self, times: Array, moved: Moved, u: Unknowns) -> Array:
        """Return the zero of the output (sets,) that suits best."""
        frames, _ = moved.at(times)
        left = self.measure.values(frames, u) - self.outputs
        return np.asarray(left.mean(axis=1) if self.measure.guide >= 0 else np.angle(np.exp(1j * left).sum(axis=1)))


class SwingAim(Aim):
    """How far a link swings: its values where they are largest and smallest."""

    def __init__(self, model: Model, at: int, target: SwingTarget) -> None:
        super().__init__(model, at, target.weight / target.tolerance)
        self.target, self.measure = target, Measure(model, target)

    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Return inputs of the largest and the smallest value (sets, 2)."""
        values = self.measure.values(moved.frames, u)
        values = values if self.measure.guide >= 0 else np.unwrap(values, axis=1)
        rates = self.measure.rates(moved.frames, moved.rates, u)
        return np.stack([extreme(moved, values, rates, 1.0), extreme(moved, values, rates, -1.0)], axis=1)

    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Return what the stroke lacks or has too much."""
        values = self.measure.values(frames, u)
        swing = values[:, :1] - values[:, 1:]
        swing = swing if self.measure.guide >= 0 else np.mod(swing, math.tau)
        loads, direct = self.blank(len(values), 1, 2)
        self.measure.put(loads, direct, frames, u)
        away = swing - np.clip(swing, self.target.least, self.target.most)
        active = (away != 0.0)[:, None, :, None]
        return Rows(
            times, away[:, None], loads * active[..., None], direct * active, self.weight, mix=np.array([[1.0, -1.0]])
        )


def extreme(moved: Moved, values: Array, rates: Array, sign: float) -> Array:
    """Input of the largest value times the sign (sets,), where the rate passes zero next to the largest sample."""
    k = (sign * values).argmax(axis=1)
    row = np.arange(len(k))
    rising = sign * rates[row, k] > 0.0
    low = np.where(rising, k, k - 1)
    last = len(moved.inputs) - 1
    low = np.mod(low, last) if moved.period else np.clip(low, 0, last - 1)
    h = moved.inputs[low + 1] - moved.inputs[low]
    a, b = sign * rates[row, low], sign * rates[row, low + 1]
    rise = sign * (values[row, low + 1] - values[row, low]) / h
    first, second = 6.0 * rise - 4.0 * a - 2.0 * b, 3.0 * (a + b) - 6.0 * rise  # rate a + first x + second x^2
    inside = (a > 0.0) & (b < 0.0)
    root = -first + np.sqrt(np.maximum(first**2 - 4.0 * a * second, 0.0)) * np.where(first > 0.0, -1.0, 1.0)
    x = np.where(np.abs(root) > 0.0, 2.0 * a / np.where(root == 0.0, 1.0, root), 0.5)
    other = np.where(second == 0.0, 0.5, root / np.where(second == 0.0, 1.0, 2.0 * second))
    x = np.where((x >= 0.0) & (x <= 1.0), x, other)
    part = np.where(inside, np.clip(x, 0.0, 1.0), np.where(low == k, 0.0, 1.0))
    return np.asarray(moved.inputs[low] + part * h)


class RatioAim(Aim):
    """Two dead centres, the slow stroke apart: speeds there, at a start of its own."""

    unknowns = 1

    def __init__(self, model: Model, at: int, target: SwingTarget) -> None:
        super().__init__(model, at, target.weight / target.tolerance)
        self.measure = Measure(model, target)
        ratio = target.time_ratio or 1.0
        self.slow = math.tau * ratio / (1.0 + ratio)

    def times(self, moved: Moved, u: Unknowns, before: Array | None) -> Array:
        """Just before and after both dead centres (sets, 12)."""
        near = _NEAR * _OFFSETS
        return np.asarray(self.own(u, 0) + np.concatenate([near, self.slow + near]))

    def begin(self, times: Array, moved: Moved, u: Unknowns, random: np.random.Generator) -> Array:
        """Begin at a dead centre, the largest or the smallest value."""
        values = self.measure.values(moved.frames, u)
        values = values if self.measure.guide >= 0 else np.unwrap(values, axis=1)
        up = random.choice([-1.0, 1.0], (len(values), 1))
        return np.asarray(moved.inputs[(up * values).argmax(axis=1)][:, None])

    def rows(self, times: Array, frames: Array, rates: Array, u: Unknowns) -> Rows:
        """Both speeds by differences, so that their derivatives are those of the poses."""
        mix = np.asarray(np.kron(np.eye(2), _DIFFERENCE / _NEAR), np.float64)
        values = self.measure.values(frames, u)
        if self.measure.guide < 0:
            values = np.unwrap(values, axis=1)
        loads, direct = self.blank(len(values), 1, len(mix.T))
        self.measure.put(loads, direct, frames, u)
        return Rows(times, (values @ mix.T)[:, None], loads, direct, self.weight, mix=mix, start=self.at)


def aims_of(model: Model, few: int, others: Mapping[int, Aim]) -> list[Aim]:
    """Return the aims of all targets, with their own unknowns one after the other.

    ``few``: points at most of a path or motion without times, for a first look; 0 for all.  ``others``: made
    already, by the id of their target.
    """
    found: list[Aim] = []
    at = model.own_at
    for target in model.task.targets:
        made: list[Aim] = []
        if id(target) in others:
            made.append(others[id(target)])
        elif isinstance(target, PathTarget | PosesTarget):
            made.append(PointAim(model, at, target, few))
        elif isinstance(target, FunctionTarget | DwellTarget):
            made.append(FunctionAim(model, at, target))
        elif isinstance(target, SwingTarget):
            made.append(SwingAim(model, at, target))
            if target.time_ratio is not None:
                made.append(RatioAim(model, at, target))
        found += made
        at += target.unknowns
    return found
