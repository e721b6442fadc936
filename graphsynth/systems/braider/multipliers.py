"""The braider in nine absolute coordinates with Lagrange multipliers: the independent second formulation.

Nothing is taken from the closed form of the linkage or from Newton and Euler for its links: bodies, constraints, their
Jacobian and the quadratic velocity terms alone.  See theory/braider 5 and theory/planar-dynamics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from graphsynth.systems.braider.model import Braider

__all__ = ["MultiplierSolution", "solve_with_multipliers"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MultiplierSolution:
    """Accelerations of the three bodies (3, 3), joint forces O1, A, B, O2 (4, 2) in N, shaft torque in N m.

    Forces have the signs of `graphsynth.systems.braider.reactions.Reactions`; ``closure`` is the largest gap (m) and
    ``condition`` the condition number of the scaled linear system.
    """

    acceleration: Array
    forces: Array
    torque: float
    closure: float
    condition: float


@dataclass(frozen=True)
class _Body:
    """Bar-like body: mass, central inertia, joint positions in its own frame (from the mass centre)."""

    mass: float
    inertia: float
    near: complex
    far: complex
    tip: complex = 0j


def solve_with_multipliers(
    braider: Braider, theta: float, speed: float, *, acceleration: float | None = None, torque: float | None = None
) -> MultiplierSolution:
    """Accelerations and joint forces by multipliers, with the crank acceleration or the driving torque given.

    Parameters
    ----------
    braider : Braider
    theta, speed : float
        Crank angle and speed, rad and rad/s.
    acceleration : float, optional
        Prescribed crank acceleration, rad/s^2; the shaft torque follows.
    torque : float, optional
        Torque at the crank axis before the reflected inertia (``G eta T_e - G^2 b_m w``), N m; the acceleration
        follows, and the shaft torque is what reaches the crank.

    Raises
    ------
    SpecError
        If not exactly one of the two is given.

    Examples
    --------
    >>> from graphsynth.systems.braider.model import Braider
    >>> round(solve_with_multipliers(Braider(), 0.0, 1.803, acceleration=0.0).torque, 15)
    -7.9020145597e-05
    """
    if (acceleration is None) == (torque is None):
        raise SpecError("give either acceleration or torque, and only one of them")
    bodies = _bodies(braider)
    angles = _assemble(braider, theta)
    arms = [(b.near * np.exp(1j * p), b.far * np.exp(1j * p)) for b, p in zip(bodies, angles)]
    centre = [-arms[0][0], 2.0 * 0.0 - arms[0][0] + arms[0][1] - arms[1][0], braider.linkage.frame - arms[2][0]]
    gaps = _gaps(braider, centre, arms)
    jac = _jacobian(arms)
    rates = _rates(jac, speed)
    rhs_constraint = np.concatenate([
        _pair(rates[p] ** 2 * first) - _pair(rates[q] ** 2 * second) for p, q, first, second in _ends(arms)
    ])  # fmt: skip
    reflected = braider.reflected_inertia
    mass = np.concatenate([[b.mass, b.mass, b.inertia] for b in bodies])
    applied = np.zeros(9)
    tip = bodies[2].tip * np.exp(1j * angles[2])
    load = complex(braider.thread.force(centre[2] + tip))
    applied[6:9] = load.real, load.imag, (np.conj(tip) * load).imag
    matrix = np.zeros((18, 18)) if torque is None else np.zeros((17, 17))
    matrix[:9, :9] = np.diag(mass)
    matrix[:9, 9:17], matrix[9:17, :9] = jac.T, jac
    rhs = np.concatenate([applied, rhs_constraint, [] if acceleration is None else [acceleration]])
    if torque is None:
        matrix[2, 17], matrix[17, 2] = -1.0, 1.0
    else:
        matrix[2, 2] += reflected
        rhs[2] += torque
    solution, condition = _solve(matrix, rhs)
    forces = -solution[9:17].reshape(4, 2)  # on the body named first in the constraint
    shaft = float(solution[17]) if torque is None else float(torque - reflected * solution[2])
    signs = np.array([1.0, -1.0, -1.0, 1.0])[:, None]
    return MultiplierSolution(solution[:9].reshape(3, 3), signs * forces, shaft, gaps, condition)


def _bodies(braider: Braider) -> tuple[_Body, _Body, _Body]:
    m1, m2, m3, m4 = braider.masses
    bar = braider.linkage
    direction = np.exp(1j * braider.switch_angle)
    total = m3 + m4
    centre = (0.5 * m3 * bar.rocker + 0.5 * m4 * braider.switch * direction) / total if total else 0j
    about = (m3 * bar.rocker**2 + m4 * braider.switch**2) / 3.0 - total * abs(centre) ** 2
    return (
        _Body(m1, m1 * bar.crank**2 / 12.0, -0.5 * bar.crank + 0j, 0.5 * bar.crank + 0j),
        _Body(m2, m2 * bar.coupler**2 / 12.0, -0.5 * bar.coupler + 0j, 0.5 * bar.coupler + 0j),
        _Body(
            total, about, -complex(centre), bar.rocker - complex(centre), complex(braider.switch * direction - centre)
        ),
    )


def _assemble(braider: Braider, theta: float) -> list[float]:
    """Body angles by Newton's method on the loop equation from the mode's law of cosines."""
    bar = braider.linkage
    base = bar.frame - bar.crank * complex(math.cos(theta), math.sin(theta))
    d = abs(base)
    cosine = (bar.coupler**2 + d * d - bar.rocker**2) / (2.0 * bar.coupler * d)
    if abs(cosine) > 1.0:
        raise SpecError(f"the linkage cannot be assembled at theta = {theta:g} rad; stay within linkage.reach()")
    phi2 = math.atan2(base.imag, base.real) + bar.branch * math.acos(cosine)
    end = bar.coupler * complex(math.cos(phi2), math.sin(phi2)) - base
    phi3 = math.atan2(end.imag, end.real)
    for _ in range(3):
        gap = bar.coupler * np.exp(1j * phi2) - base - bar.rocker * np.exp(1j * phi3)
        u, v = 1j * bar.coupler * np.exp(1j * phi2), -1j * bar.rocker * np.exp(1j * phi3)
        det = u.real * v.imag - u.imag * v.real
        phi2 -= (gap.real * v.imag - gap.imag * v.real) / det
        phi3 -= (u.real * gap.imag - u.imag * gap.real) / det
    return [theta, float(phi2), float(phi3)]


def _ends(arms: list[tuple[complex, complex]]) -> list[tuple[int, int, complex, complex]]:
    """Joint O1, A, B, O2: bodies (-1 the frame) and their arms; each constraint is first point minus second point."""
    return [(0, -1, arms[0][0], 0j), (0, 1, arms[0][1], arms[1][0]), (1, 2, arms[1][1], arms[2][1]),
            (2, -1, arms[2][0], 0j)]  # fmt: skip


def _gaps(braider: Braider, centre: list[complex], arms: list[tuple[complex, complex]]) -> float:
    frame = {0: 0j, 3: complex(braider.linkage.frame)}
    found = []
    for k, (p, q, first, second) in enumerate(_ends(arms)):
        other = frame[k] if q < 0 else centre[q] + second
        found.append(abs(centre[p] + first - other))
    return float(max(found))


def _jacobian(arms: list[tuple[complex, complex]]) -> Array:
    jac = np.zeros((8, 9))
    for k, (p, q, first, second) in enumerate(_ends(arms)):
        for body, arm, sign in ((p, first, 1.0), (q, second, -1.0)):
            if body >= 0:
                jac[2 * k, 3 * body], jac[2 * k + 1, 3 * body + 1] = sign, sign
                jac[2 * k : 2 * k + 2, 3 * body + 2] = sign * _pair(1j * arm)
    return jac


def _pair(z: complex) -> Array:
    return np.array([complex(z).real, complex(z).imag])


def _rates(jac: Array, speed: float) -> dict[int, float]:
    """Angular velocities of the bodies from the velocity constraints; the frame (-1) rests."""
    system = np.vstack([jac, np.eye(9)[2]])
    velocity, _ = _solve(system, np.concatenate([np.zeros(8), [speed]]))
    return {-1: 0.0, 0: float(velocity[2]), 1: float(velocity[5]), 2: float(velocity[8])}


def _solve(matrix: Array, rhs: Array) -> tuple[Array, float]:
    """Row and column scaling by powers of two, one step of refinement; the condition number of the scaled matrix."""
    with np.errstate(divide="ignore"):
        rows = np.exp2(-np.round(np.log2(np.abs(matrix).max(axis=1))))
        scaled = matrix * rows[:, None]
        columns = np.exp2(-np.round(np.log2(np.abs(scaled).max(axis=0))))
    scaled = scaled * columns
    found = np.linalg.solve(scaled, rows * rhs)
    found += np.linalg.solve(scaled, rows * rhs - scaled @ found)
    return columns * found, float(np.linalg.cond(scaled))
