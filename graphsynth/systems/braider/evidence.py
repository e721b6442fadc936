"""``module = "braider"``: what is measured of the braiding mechanism, and its linkage in long doubles as the reference.

The loop ``a e^(i t) + b e^(i f2) = g + c e^(i f3)`` is closed by two circles and differentiated twice; velocities and
accelerations of the centres of mass follow.  It shares no code with `graphsynth.kinematics` and `graphsynth.dynamics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.dynamics.start import StartReport, consistent_start
from graphsynth.evidence.drives import drive_problem
from graphsynth.evidence.dynamics import Truth, dynamics_problem
from graphsynth.evidence.position import four_bar, position_problem
from graphsynth.evidence.precise_drive import NAME, Long, Shape, precise_drive
from graphsynth.evidence.rows import Effort, Problem
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.systems.braider.linkage import FourBar
from graphsynth.systems.braider.model import Braider
from graphsynth.systems.braider.stages import braider_of

Array = NDArray[np.float64]


def start_up(context: Any, effort: Effort) -> Problem:
    """Start from rest with all currents."""
    b = braider_of(context)
    end = context.scene.mechanism.start.end
    return drive_problem(b.plant(), b.motor, b.train, end, effort, shape=shape_of_braider(b))


def linkage_dynamics(context: Any, effort: Effort) -> Problem:
    """Measure the linkage without motor and thread, free to move from the speed of the scene."""
    braider, speed = braider_of(context), context.scene.mechanism.speed
    model, start = free_linkage(braider, speed)
    end, name = 1.0 if effort.quick else 2.0, "the braider's linkage, free"
    truth = Truth(lambda times: precise_swing(braider, speed, times, model.gravity), f"closed loop, {NAME}")
    return dynamics_problem(model, start, end, name, effort, truth=truth)


def positions(context: Any, effort: Effort) -> Problem:
    """Measure positions of the linkage over a turn."""
    mechanism, closed = _mechanism(braider_of(context).linkage)
    return position_problem(mechanism, "the braider's linkage", closed, effort=effort)


def _mechanism(bar: FourBar) -> tuple[Any, Any]:
    """Return the linkage as a mechanism, and its positions in closed form."""
    return four_bar(TiltedFourBar(bar.frame, bar.crank, bar.coupler, bar.rocker, sgn=bar.branch))


class _Link(NamedTuple):
    """Origin and direction of a link, its rates per crank rate, and those of the origin: first and second."""

    origin: Any
    along: Any
    first: Any
    second: Any
    origin_first: Any
    origin_second: Any


def _cross(u: Any, v: Any) -> Any:
    return (u.conjugate() * v).imag


def _links(bar: FourBar, t: Any) -> tuple[_Link, _Link, _Link]:
    """Crank, coupler and rocker at a crank angle."""
    a, b, c, g = map(Long, (bar.crank, bar.coupler, bar.rocker, bar.frame))
    turn = np.exp(1j * Long(t))
    A = a * turn
    line = g - A
    d = abs(line)
    reach = (b * b - c * c + d * d) / (2 * d)
    u = line / d * (reach + 1j * (bar.branch * np.sqrt(b * b - reach * reach)))
    v = A + u - g
    sine, nothing = _cross(u, v), Long(0)
    k2, k3 = -_cross(A, v) / sine, -_cross(A, u) / sine  # A + k2 u = k3 v
    rest = A + u * k2 * k2 - v * k3 * k3  # i rest + f2 u = f3 v
    f2, f3 = (rest * v.conjugate()).real / sine, (rest * u.conjugate()).real / sine
    return (
        _Link(nothing, turn, Long(1), nothing, nothing, nothing),
        _Link(A, u / b, k2, f2, 1j * A, -A),
        _Link(g, v / c, k3, f3, nothing, nothing),
    )


def shape_of_four_bar(bar: FourBar, bodies: Mapping[int, Body], gravity: tuple[float, float] = (0.0, 0.0)) -> Shape:
    """Shape of a four-bar linkage: link 1 is the crank, 2 the coupler, 3 the rocker, each along its bar.

    What gravity (m/s^2) does is the load.

    Examples
    --------
    >>> from graphsynth.systems.braider.model import Braider
    >>> braider = Braider()
    >>> J, half, load = shape_of_four_bar(braider.linkage, braider.bodies)(0.3)
    >>> abs(float(J) + braider.reflected_inertia - float(braider.effective_inertia(0.3)[0])) < 1e-17, float(load)
    (True, 0.0)
    """
    weight = np.clongdouble(complex(*gravity))

    def shape(t: Any) -> tuple[Any, Any, Any]:
        inertia = half = load = Long(0)
        for number, link in enumerate(_links(bar, t), 1):
            body = bodies[number]
            m, I, arm = Long(body.mass), Long(body.inertia), link.along * np.clongdouble(complex(*body.centre))
            velocity = link.origin_first + 1j * link.first * arm
            change = link.origin_second + (1j * link.second - link.first**2) * arm
            inertia += m * abs(velocity) ** 2 + I * link.first**2
            half += m * (velocity.conjugate() * change).real + I * link.first * link.second
            load += m * (weight.conjugate() * velocity).real
        return inertia, half, load

    return shape


def places(bar: FourBar, bodies: Mapping[int, Body], t: Any) -> list[Any]:
    """Centres of mass and angles of crank, coupler and rocker at a crank angle: x, y, angle of each."""
    found: list[Any] = []
    for number, link in enumerate(_links(bar, t), 1):
        centre = link.origin + link.along * np.clongdouble(complex(*bodies[number].centre))
        found += [centre.real, centre.imag, np.arctan2(link.along.imag, link.along.real)]
    return found


def shape_of_braider(braider: Braider) -> Shape:
    """Shape of the braider as its motor feels it: the linkage, and the thread at the tip of the switch."""
    linkage, thread = shape_of_four_bar(braider.linkage, braider.bodies), braider.thread
    arm0 = Long(braider.switch) * np.exp(1j * Long(braider.switch_angle))
    pull, height = Long(thread.weight) * Long(thread.gravity), Long(thread.height)
    guide = np.clongdouble(thread.guide)

    def shape(t: Any) -> tuple[Any, Any, Any]:
        rocker = _links(braider.linkage, t)[2]
        arm = rocker.along * arm0
        reach = guide - rocker.origin - arm
        force = pull * reach / np.sqrt(abs(reach) ** 2 + height * height)
        inertia, half, load = linkage(t)
        return inertia + Long(braider.inertia), half, load + _cross(arm, force) * rocker.first

    return shape


def free_linkage(braider: Braider, speed: float) -> tuple[DynamicModel, StartReport]:
    """Return the linkage of a braider without motor and thread, and a start at crank angle zero (speed in rad/s)."""
    mechanism, _ = _mechanism(braider.linkage)
    model = DynamicModel(mechanism, braider.bodies)
    return model, consistent_start(model, pose=mechanism.pose, keep={(0, 1): 0.0}, keep_rates={(0, 1): speed})


def precise_swing(braider: Braider, speed: float, times: Array, gravity: tuple[float, float]) -> Array:
    """Free motion of `free_linkage` by `precise_drive`: centres of mass and angles, shape (n, 9)."""
    bodies = braider.bodies
    shape = shape_of_four_bar(braider.linkage, bodies, gravity)
    found = precise_drive(shape, None, 1.0, 0.0, 0.0, times.tolist(), speed=speed)
    return np.array([places(braider.linkage, bodies, angle) for angle in found[:, 0]], dtype=np.float64)
