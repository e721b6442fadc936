"""All assembly modes of a link held by three conditions: every triad with one ternary link.

With pose (p, z), z = exp(i alpha), each condition (a distance, a point of the link on a fixed line, a line of the link
through a fixed point) reads ``q p conj(p) + m(z) p + conj(m(z) p) + c(z) = 0``, q = 1 for a distance, else 0, with m
and c of degree one in z and 1/z.  Their solution: docs/explanation/planar-engine.md, "Triads with prismatic joints".
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.program import Program

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NODES = 32
#: Roots this close to the unit circle are tried: the polish decides.
_RING = 1e-2
_ITERATIONS = 30


class Condition(NamedTuple):
    """One condition on the pose: ``kind`` of :mod:`.codes`, whether the link carries the line, and its numbers.

    ``own`` is the point in the link's frame, ``far`` the point in the fixed frame, ``line`` the direction of the line
    (in the frame of whoever carries it), ``size`` the distance or the offset; for ANGLE ``size`` is the link's angle.
    """

    kind: int
    carried: bool
    own: complex
    far: complex
    line: complex
    size: float

    def terms(self, z: Complex) -> tuple[float, Complex, Complex]:
        """Return q, m(z), c(z)."""
        if self.kind == codes.DIST:
            m = np.conj(z * self.own - self.far)
            return 1.0, m, np.asarray(np.abs(m) ** 2 - self.size**2, dtype=np.complex128)
        n = 1j * self.line
        if self.carried:
            m = -np.conj(z * n)
            c = -2.0 * (m * self.far).real - 2.0 * (np.conj(n) * self.own).real - 2.0 * self.size
        else:
            m = np.full(z.shape, np.conj(n))
            c = 2.0 * (m * (z * self.own - self.far)).real - 2.0 * self.size
        return 0.0, m, np.asarray(c, dtype=np.complex128)


def conditions(program: Program, step: int, frames: Array) -> list[Condition] | None:
    """Conditions on the one kept link of a group, from the frames (links, 4) already placed; None if others occur."""
    row0, count, core0, cores = (int(v) for v in program.tables.steps[step, 1:5])
    if cores != 1:
        return None
    own, found = int(program.tables.core[core0]), []
    for r in range(row0, row0 + count):
        kind, a, b, _, _ = (int(v) for v in program.tables.rows[r])
        p = program.tables.row_table[0, r]
        if kind not in (codes.DIST, codes.LINE, codes.ANGLE):
            return None
        pa, pb, line, h = complex(*p[0:2]), complex(*p[2:4]), complex(p[codes.TX], p[codes.TY]), float(p[codes.H])
        other, far, near = (b, pb, pa) if a == own else (a, pa, pb)
        x, y, c, s = frames[other]
        turn = complex(c, s)
        if kind == codes.ANGLE:
            angle = float(np.angle(turn)) + (-h if a == own else h)
            found.append(Condition(kind, False, 0j, 0j, 0j, angle))
            continue
        carried = a == own
        direction = line if kind == codes.DIST or carried else turn * line
        found.append(Condition(kind, carried, near, complex(x, y) + turn * far, direction, h))
    return found


def triad_modes(found: list[Condition], Lc: float) -> Array:
    """All poses (x, y, alpha) that meet three conditions, shape (modes, 3), by alpha (estimated: floating point)."""
    angles = [one for one in found if one.kind == codes.ANGLE]
    rest = sorted((one for one in found if one.kind != codes.ANGLE), key=lambda one: one.kind != codes.DIST)
    if len(angles) > 1 or len(found) != 3:
        return np.empty((0, 3))
    z = np.exp(1j * np.array([angles[0].size])) if angles else _orientations(rest)
    poses = [pose for one in z for pose in _places(rest, one)]
    kept: list[Array] = []
    for pose in poses:
        polished = _polish(rest, pose, Lc, bool(angles))
        if polished is not None and all(_apart(polished, other, Lc) > 1e-8 for other in kept):
            kept.append(polished)
    return np.array(sorted(kept, key=lambda pose: pose[2])).reshape(-1, 3)


def _orientations(rest: list[Condition]) -> Complex:
    """Candidates for z: zeros of the eliminant, which vanishes where the three conditions have a common place."""
    alpha = 2.0 * np.pi * np.arange(_NODES) / _NODES
    (q, m0, c0), first, second = _reduced(rest, np.exp(1j * alpha))
    N, D = _meeting(first, second)
    eliminant = np.abs(N) ** 2 + 2.0 * (m0 * N * np.conj(D)).real + c0.real * np.abs(D) ** 2
    if q == 0.0:  # three lines through one point
        eliminant = (m0 * N - np.conj(m0 * N) + c0 * D).imag
    coefficients = np.fft.fft(eliminant) / _NODES
    size = float(np.abs(coefficients).max())
    degree = max((k for k in range(_NODES // 2) if abs(coefficients[k]) > 1e-13 * size), default=0)
    if not size > 0.0 or degree == 0:
        return np.empty(0, dtype=np.complex128)
    roots = np.roots(np.concatenate([coefficients[degree:0:-1], coefficients[:1], coefficients[-1 : -degree - 1 : -1]]))
    near = roots[np.abs(np.abs(roots) - 1.0) < _RING]
    return np.asarray(near / np.abs(near))


def _reduced(rest: list[Condition], z: Complex) -> tuple[tuple[float, Complex, Complex], ...]:
    """Terms of the first condition, and of the others freed of p conj(p)."""
    first, *others = (one.terms(z) for one in rest)
    return first, *((0.0, m - q * first[1], c - q * first[2]) for q, m, c in others)


def _meeting(first: tuple[float, Complex, Complex], second: tuple[float, Complex, Complex]) -> tuple[Complex, Complex]:
    """Numerator and denominator of p for two linear conditions; the denominator is imaginary."""
    (_, m1, c1), (_, m2, c2) = first, second
    return c2 * np.conj(m1) - c1 * np.conj(m2), m1 * np.conj(m2) - m2 * np.conj(m1)


def _places(held: list[Condition], z: complex) -> list[Array]:
    """Poses at one orientation that meet two conditions (the third is met by the choice of z)."""
    at = np.array([z])
    (q, m0, c0), *linear = _reduced(held, at)
    alpha = float(np.angle(z))
    if q == 0.0:
        linear = [(q, m0, c0), *linear]
    found: list[complex] = []
    for one, other in itertools.combinations(linear, 2):
        N, D = _meeting(one, other)
        if abs(D[0]) > 1e-9 * abs(one[1][0]) * abs(other[1][0]):
            found.append(complex(N[0] / D[0]))
    if not found and q == 1.0:  # parallel lines, or only one: the line with the larger gradient, and the circle
        _, m, c = max(linear, key=lambda one: float(abs(one[1][0])))
        if m[0] == 0.0:
            return []
        # 2 Re(m p) + c = 0 and |p|^2 + 2 Re(m0 p) + c0 = 0
        centre, square = -np.conj(m0[0]), abs(m0[0]) ** 2 - c0[0].real
        unit = np.conj(m[0]) / abs(m[0])
        distance = -(c[0].real + 2.0 * (m[0] * centre).real) / (2.0 * abs(m[0]))
        rest = square - distance**2
        along = np.sqrt(max(rest, 0.0))
        sides = (1.0, -1.0) if rest >= -1e-9 * abs(square) else ()
        found = [complex(centre + unit * (distance + side * 1j * along)) for side in sides]
    return [np.array([p.real, p.imag, alpha]) for p in found]


def _polish(rest: list[Condition], pose: Array, Lc: float, fixed: bool) -> Array | None:
    """Newton's method on the conditions; None if it does not converge or moves far away."""
    start, last = pose, np.inf
    size = 2 if fixed else 3
    for _ in range(_ITERATIONS):
        f, J = _residuals(rest, pose)
        try:
            step = np.linalg.solve(J[:, :size] * [1.0, 1.0, 1.0 / Lc][:size], f) / [1.0, 1.0, Lc][:size]
        except np.linalg.LinAlgError:
            return None
        pose = pose - np.append(step, [0.0] * (3 - size))
        moved = float(np.abs(step * [1.0, 1.0, Lc][:size]).max()) / Lc
        if not np.isfinite(moved):
            return None
        if moved <= 1e-14 or (moved < 1e-9 and moved >= 0.5 * last):
            break
        last = moved
    else:
        return None
    pose[2] = np.angle(np.exp(1j * pose[2]))
    return pose if _apart(pose, start, Lc) < 0.05 else None


def _residuals(rest: list[Condition], pose: Array) -> tuple[Array, Array]:
    """Conditions in lengths, and their gradient by (x, y, alpha)."""
    p, z = complex(pose[0], pose[1]), np.exp(1j * pose[2])
    f, J = np.empty(len(rest)), np.empty((len(rest), 3))
    for k, one in enumerate(rest):
        arm = z * one.own
        d = p + arm - one.far
        if one.kind == codes.DIST:
            e = d / abs(d) if d else 1.0 + 0j
            f[k], J[k] = abs(d) - one.size, (e.real, e.imag, (np.conj(e) * 1j * arm).real)
            continue
        n = 1j * one.line * (z if one.carried else 1.0)
        sign = -1.0 if one.carried else 1.0
        f[k] = sign * (np.conj(n) * d).real - one.size
        turn = (np.conj(n) * 1j * arm).real + ((np.conj(1j * n) * d).real if one.carried else 0.0)
        J[k] = sign * n.real, sign * n.imag, sign * turn
    return f, J


def _apart(a: Array, b: Array, Lc: float) -> float:
    turn = np.abs(np.exp(1j * a[2]) - np.exp(1j * b[2]))
    return float(max(np.abs(a[:2] - b[:2]).max() / Lc, turn))
