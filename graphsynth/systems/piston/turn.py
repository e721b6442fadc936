"""One turn of a crank drive with a piston: works and their balance, peaks; with and without the second group."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import positive
from graphsynth.core.errors import GeometryError
from graphsynth.systems.piston.machine import PistonLoads, PistonMachine
from graphsynth.systems.piston.model import CrankSlider

Array = NDArray[np.float64]

_TURN = 2.0 * math.pi
_NODES = 16
_WIDEST = math.pi / 8
#: Panels shrink towards a reversal of the sliding down to this fraction of the zone in which friction changes sides.
_FINEST = 0.25
_SAMPLES = 720


@dataclass(frozen=True, eq=False)
class PistonTurn:
    """Works of a turn at constant speed, J, and peaks of the loads, N (magnitudes).

    Estimated: Gauss quadrature on panels that end where a load has a kink.
    """

    motor: float
    gas: float  #: work taken by the gas
    friction: float
    kinetic: float  #: change of the kinetic energy over the turn: exactly 0, so it is an error
    weights: float  #: work of the weights: the same
    gas_closed_form: float  #: indicated work from the pressure-volume diagram; NaN if the gas law has none
    balance_error: float  #: ``|motor - gas - friction|`` over the largest work in play, the kinetic energy's included
    peak_wall: float  #: side load of the cylinder
    mean_wall: float
    peak_guide: float  #: of the crosshead's guide
    peak_edge: float  #: at an end of the piston
    peak_guide_edge: float  #: at an end of the crosshead's shoe
    peak_held: float  #: side load that the slot's static friction can add; 0 where the slot slides


@dataclass(frozen=True, eq=False)
class PistonComparison:
    """The same drive, gas and masses with and without the second group (estimated).

    Ratios are with over without it, NaN if there is nothing without, up to rounding.
    """

    floating: PistonTurn
    plain: PistonTurn
    wall_ratio: float  #: of the peak side loads of the cylinder
    edge_ratio: float  #: of the forces at the ends of the piston
    guide_share: float  #: peak force at an end of the shoe over that at an end of the plain piston
    friction_ratio: float  #: of the works lost
    #: Error of the right angle between slot and cylinder, radians, from which on the second group buys nothing whatever
    #: the gas force, masses aside: the steepest angle of the rod.  NaN for a Scotch yoke: its plain piston has no load.
    squareness: float

    @property
    def statement(self) -> str:
        """What the second group buys, in one sentence."""
        a, b = self.floating, self.plain
        text = (
            f"peak side load of the cylinder {a.peak_wall:.4g} N with the second group, {b.peak_wall:.4g} N without; "
            f"the crosshead's guide carries {a.peak_guide:.4g} N"
        )
        if a.peak_held > 0.0:
            text += f"; static friction in the slot may add {a.peak_held:.4g} N"
        return text


def piston_turn(machine: PistonMachine, length: float | None = None) -> PistonTurn:
    """Works and peaks of one turn.

    Parameters
    ----------
    machine : PistonMachine
        With an acceleration of 0.
    length : float, optional
        Of piston and shoe, for the forces at their ends, m; the stroke by default.

    Returns
    -------
    PistonTurn

    Raises
    ------
    GeometryError
        A crank at rest or accelerated; friction that jams somewhere.

    Examples
    --------
    >>> from graphsynth.systems.piston.loads import CompressorCycle
    >>> from graphsynth.systems.piston import FloatingPiston
    >>> gas = CompressorCycle(0.1, suction=1e5, discharge=6e5)
    >>> turn = piston_turn(PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=gas, speed=50.0))
    >>> turn.balance_error < 1e-12, abs(turn.gas / turn.gas_closed_form - 1.0) < 1e-12, turn.peak_wall < 1e-9
    (True, True, True)
    """
    size = machine.mechanism.stroke if length is None else positive("length of the piston", length)
    return _turn(machine, size)


@lru_cache(maxsize=32)  # the plain machine is the same for every error of the slot's angle
def _turn(machine: PistonMachine, size: float) -> PistonTurn:
    if machine.speed == 0.0 or machine.acceleration != 0.0:
        raise GeometryError(
            f"a turn needs a constant speed other than 0; speed = {machine.speed:g} rad/s and acceleration = "
            f"{machine.acceleration:g} rad/s^2; change them"
        )
    nodes, weights = _nodes(machine)
    loads = machine.loads(nodes)
    bad = np.flatnonzero(~np.isfinite(loads.torque))
    if len(bad):
        raise GeometryError(
            f"friction leaves no single solution at the crank angle {loads.angle[bad[0]] % _TURN:.6g} rad: the machine "
            "jams there, or may; reduce the friction coefficients, or make slot and cylinder square"
        )
    powers = (loads.driving, loads.gas_power, loads.friction_power, loads.kinetic_power, loads.weight_power)
    motor, gas, friction, kinetic, lifted = (float(weights @ p) / abs(machine.speed) for p in powers)
    moved = max(float(weights @ np.abs(p)) / abs(machine.speed) for p in powers[:4])
    wall, guide, edge, guide_edge = _peaks(machine, size, loads)
    return PistonTurn(
        motor=motor,
        gas=gas,
        friction=friction,
        kinetic=kinetic,
        weights=lifted,
        gas_closed_form=machine.gas.work(machine.mechanism.stroke),
        balance_error=abs(motor - gas - friction) / max(moved, 1e-300),
        peak_wall=wall,
        mean_wall=float(weights @ np.abs(loads.wall) / weights.sum()),
        peak_guide=guide,
        peak_edge=edge,
        peak_guide_edge=guide_edge,
        peak_held=float(loads.held.max()),
    )


def compare_pistons(machine: PistonMachine, length: float | None = None) -> PistonComparison:
    """Compare a machine with its plain form, whose crosshead is the piston.

    Parameters
    ----------
    machine : PistonMachine
        With a second group.
    length : float, optional
        Of both pistons and of the crosshead's shoe, m; the stroke by default.

    Returns
    -------
    PistonComparison

    Raises
    ------
    GeometryError
        A machine without a second group, or a cause of :func:`piston_turn`.

    Examples
    --------
    >>> from graphsynth.systems.piston.loads import ConstantForce
    >>> from graphsynth.systems.piston import FloatingPiston
    >>> machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=ConstantForce(1000.0))
    >>> found = compare_pistons(machine)
    >>> found.wall_ratio < 1e-12, round(found.guide_share, 12), round(found.plain.peak_wall, 3)
    (True, 1.0, 258.199)
    """
    if machine.mechanism.group is None:
        raise GeometryError("the machine has no second group to compare with; give a mechanism with a FloatingGroup")
    size = machine.mechanism.stroke if length is None else length
    floating, plain = piston_turn(machine, size), piston_turn(machine.without_group(), size)
    drive, least = machine.mechanism.drive, _rounding(machine)
    return PistonComparison(
        floating,
        plain,
        _ratio(floating.peak_wall, plain.peak_wall, least),
        _ratio(floating.peak_edge, plain.peak_edge, least),
        _ratio(floating.peak_guide_edge, plain.peak_edge, least),
        _ratio(floating.friction, plain.friction, 0.0),
        drive.steepest if isinstance(drive, CrankSlider) else math.nan,
    )


def _rounding(machine: PistonMachine) -> float:
    """Force below which one is nothing but rounding, N."""
    return 1e-10 * float(np.nanmax(np.abs(machine.loads(np.linspace(0.0, _TURN, 91)).crank_pin)))


def _ratio(one: float, other: float, least: float) -> float:
    """NaN where the other is 0, or not more than rounding."""
    return one / other if other > least else math.nan


def _nodes(machine: PistonMachine) -> tuple[Array, Array]:
    """Nodes and weights of a turn: panels end at kinks and shrink towards places where loads change fast."""
    outer, inner = machine.mechanism.dead_centres()
    start, narrow = outer.angle, _narrow(machine)
    kinks = [place for place, _ in narrow] + _sign_changes(machine)
    for gap, closing in machine.gas.kinks(machine.mechanism.stroke):
        place = min(max(outer.piston - gap, inner.piston), outer.piston)
        # turning backwards, the crank angles of the way to the head are those of the way back
        kinks.append(machine.mechanism.angle_at(place, closing if machine.speed > 0.0 else not closing))
    edges = {start, start + _TURN, *(start + (at - start) % _TURN for at in kinks)}
    for at, offset in narrow:
        while offset < _WIDEST:
            edges |= {start + (at + side * offset - start) % _TURN for side in (1.0, -1.0)}
            offset *= 2.0
    ends = np.array(sorted(edges))
    pieces = [np.linspace(a, b, max(1, math.ceil((b - a) / _WIDEST)) + 1)[:-1] for a, b in pairwise(ends) if b > a]
    ends = np.append(np.concatenate(pieces), ends[-1])
    x, w = np.polynomial.legendre.leggauss(_NODES)
    half = 0.5 * np.diff(ends)
    middle = 0.5 * (ends[1:] + ends[:-1])
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel()


def _narrow(machine: PistonMachine) -> list[tuple[float, float]]:
    """Crank angles where loads change fast, and over which angle.

    Friction changes sides at dead centres, and where the block of a yoke reverses; a rod that is hardly long enough
    swings fast where it is steepest: ``l - |z|`` has its zeros ``sqrt(2 (l - |z|) / r)`` beside the real axis.
    """
    drive = machine.mechanism.drive
    dead = [dead.angle for dead in machine.mechanism.dead_centres()]
    sides = (0.5 * math.pi, 1.5 * math.pi)
    if not isinstance(drive, CrankSlider):
        zone = _zone(machine, [*dead, *sides])
        return [(at, zone) for at in (*dead, *sides)]
    zone = _zone(machine, dead)
    slack = (drive.rod - drive.crank + drive.offset, drive.rod - drive.crank - drive.offset)
    steep = [(at, max(0.5 * math.sqrt(2.0 * gap / drive.crank), 1e-9)) for at, gap in zip(sides, slack)]
    return [*((at, zone) for at in dead), *steep]


def _zone(machine: PistonMachine, reversals: list[float]) -> float:
    """Smallest width of the panels at a reversal."""
    friction = machine.friction
    if not any((friction.guide, friction.cylinder, friction.slot, friction.yoke, friction.rings)):
        return _WIDEST
    motion = machine.mechanism.motion(np.array(reversals))
    steep = max(float(np.abs(part.second).max()) for part in (motion.crosshead, motion.piston, motion.slot))
    steep = max(steep, machine.mechanism.drive.crank)
    return max(_FINEST * friction.smoothing_velocity / (abs(machine.speed) * steep), 1e-9)


def _sign_changes(machine: PistonMachine) -> list[float]:
    """Crank angles where a normal force changes sign, so that its friction has a kink."""
    from scipy.optimize.elementwise import find_root

    def normals(angle: Array) -> Array:
        loads = machine.loads(angle)
        return np.array([loads.wall, loads.guide, loads.slot, loads.yoke])

    phi = np.linspace(0.0, _TURN, _SAMPLES + 1)
    values = normals(phi)
    loaded = np.abs(values).max(axis=1, keepdims=True) > _rounding(machine)
    contact, place = np.nonzero((values[:, :-1] * values[:, 1:] < 0.0) & loaded)
    if not len(place):
        return []
    found = find_root(
        lambda angle, own: normals(angle)[own.astype(int), np.arange(len(own))],
        (phi[place], phi[place + 1]),
        args=(contact,),
        tolerances={"xatol": 1e-13},
    )
    return [float(x) for x in found.x]


def _peaks(machine: PistonMachine, size: float, loads: PistonLoads) -> list[float]:
    """Largest wall and guide force, and largest force at an end of piston and shoe: at the nodes, and between."""

    def measures(own: PistonLoads) -> Array:
        ends = [np.maximum(*map(np.abs, own.edges(size, of))) for of in ("wall", "guide")]
        return np.array([np.abs(own.wall), np.abs(own.guide), *ends])

    rows, phi, values = np.arange(4), loads.angle, measures(loads)
    best, peaks = values.argmax(axis=1), values.max(axis=1)
    low, high = phi[np.maximum(best - 1, 0)], phi[np.minimum(best + 1, len(phi) - 1)]
    for _ in range(4):  # next to the largest node, ever finer
        fine = np.linspace(low, high, 33, axis=1)
        inner = measures(machine.loads(fine.ravel())).reshape(4, 4, 33)[rows, rows]
        k = np.nanargmax(inner, axis=1)
        peaks = np.maximum(peaks, inner[rows, k])
        low, high = fine[rows, np.maximum(k - 1, 0)], fine[rows, np.minimum(k + 1, 32)]
    return [float(peak) for peak in peaks]
