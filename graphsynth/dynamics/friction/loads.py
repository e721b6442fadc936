"""Friction elements of a compiled model, locks that hold those that stick, and the loads of those that slide.

Loads ``x >= 0`` satisfy ``x = load(start + slopes x)``: what friction in joints that slide asks of itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics import kernels
from graphsynth.dynamics.elements import JointFriction
from graphsynth.dynamics.tables import Compiled, driver_row
from graphsynth.mechanism.laws import Driver

Array = NDArray[np.float64]

#: Relative residual of loads that count as solved, difference of loads that count as equal, and rounding of sums.
_SOLVED, _SAME, _ROUNDING = 1e-11, 1e-9, 1e-13
_ROUNDS = 400


def fitting_loads(elements: Sequence[FrictionElement], start: Array, slopes: Array) -> tuple[list[Array], bool]:
    """Return all loads of elements that slide which fit, and whether these are known to be all.

    ``start`` (m,) are the multipliers without their friction, ``slopes`` (m, elements) their change with each
    load.  Where loads return to themselves with a factor below 1 there is one set, by substitution and Newton's
    method.  Beyond, guides are taken piece by piece (their loads are piecewise linear), and pins by the roots of
    quadratics; with three pins or more that act on each other so strongly, not all solutions are known to be found.
    """
    count = len(elements)
    if not count:
        return [np.zeros(0)], True
    K = np.array([[e.load(slopes[:, g]) for g in range(count)] for e in elements])
    if float(np.abs(np.linalg.eigvals(K)).max()) < 1.0 - 1e-9:
        return [_unique(elements, start, slopes)], True
    found: list[Array] = []
    size = max(max(e.load(start) for e in elements), 1e-300)
    pins = [f for f, e in enumerate(elements) if e.pin]
    known = len(pins) <= 2
    for x in _candidates(elements, start, slopes, pins):
        if x is None:
            known = False
            continue
        for _ in range(3):  # a few steps of Newton's method, if they help
            fresh, rest = _newton(elements, start, slopes, x)
            if not np.isfinite(fresh).all() or _newton(elements, start, slopes, fresh)[1] >= rest:
                break
            x = fresh
        scale = max(size, float(np.abs(x).max()))
        summed = loads_of(elements, np.abs(start) + np.abs(slopes) @ np.abs(x))  # what cancels leaves its rounding
        fits = (np.abs(loads_of(elements, start + slopes @ x) - x) <= _SOLVED * np.maximum(summed, scale)).all()
        apart = _SAME * float(np.abs(x).max()) + _ROUNDING * float(summed.max())
        if fits and not any(float(np.abs(x - y).max()) <= apart for y in found):
            found.append(x)
    return found, known


def sliding_loads(elements: Sequence[FrictionElement], start: Array, slopes: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the loads of n samples at once, and where they are found: guides with one normal force that contract.

    ``start`` (n, m) and ``slopes`` (n, m, elements) are those of `fitting_loads`, for every sample.
    """
    if any(e.pin or e.length > 0.0 for e in elements):
        return np.zeros((len(start), len(elements))), np.zeros(len(start), dtype=np.bool_)
    rows = [e.row for e in elements]
    base, change = start[:, rows], slopes[:, rows]
    known = np.abs(np.linalg.eigvals(np.abs(change))).max(axis=1) < 1.0 - 1e-9
    x, identity = np.abs(base), np.eye(len(rows))
    for _ in range(2 ** len(rows) + 4):  # Newton's method among the pieces, each a choice of signs
        signs = np.copysign(1.0, base + np.einsum("nfg,ng->nf", change, x))
        matrix = np.where(known[:, None, None], identity - signs[:, :, None] * change, identity)
        x = np.linalg.solve(matrix, (signs * base)[:, :, None])[:, :, 0]
    normal = base + np.einsum("nfg,ng->nf", change, x)
    rounding = 1e-14 * (np.abs(base) + np.einsum("nfg,ng->nf", np.abs(change), np.abs(x))).max(axis=1, keepdims=True)
    return np.abs(normal), known & (np.abs(np.abs(normal) - x) <= rounding).all(axis=1)


def loads_of(elements: Sequence[FrictionElement], lam: Array) -> Array:
    """Return the loads of elements, N, from the multipliers."""
    return np.array([e.load(lam) for e in elements])


def _slope(e: FrictionElement, lam: Array) -> Array:
    """Gradient of a load by the multipliers."""
    g = np.zeros(len(lam))
    r = e.row
    if e.pin:
        size = float(np.hypot(lam[r], lam[r + 1]))
        if size > 0.0:
            g[r : r + 2] = lam[r : r + 2] / size
    elif e.length > 0.0 and 2.0 * abs(lam[r + 1]) > e.length * abs(lam[r]):
        g[r + 1] = np.copysign(2.0 / e.length, lam[r + 1])
    else:
        g[r] = np.copysign(1.0, lam[r])
    return g


def _newton(elements: Sequence[FrictionElement], start: Array, slopes: Array, x: Array) -> tuple[Array, float]:
    """One step of Newton's method, and the residual before it."""
    lam = start + slopes @ x
    rest = loads_of(elements, lam) - x
    matrix = np.eye(len(x)) - np.array([_slope(e, lam) for e in elements]) @ slopes
    try:
        return x + np.linalg.solve(matrix, rest), float(np.abs(rest).max())
    except np.linalg.LinAlgError:
        return x + rest, float(np.abs(rest).max())


def _unique(elements: Sequence[FrictionElement], start: Array, slopes: Array) -> Array:
    """Return the loads where substitution contracts."""
    x = loads_of(elements, start)
    best, least = x, np.inf
    for step in range(_ROUNDS):
        fresh, size = _newton(elements, start, slopes, x)
        if size < least:
            best, least = x, size
        if size <= 1e-15 * max(float(np.abs(x).max()), 1e-300) or (step > 8 and size <= 1e-13 * float(np.abs(x).max())):
            break
        if step > 8 and step % 2:  # Newton's method may go in circles among the pieces
            fresh = loads_of(elements, start + slopes @ x)
        x = fresh
    return best


def _candidates(
    elements: Sequence[FrictionElement], start: Array, slopes: Array, pins: list[int]
) -> Iterator[Array | None]:
    """Yield loads that solve the equations of some pieces, not all of which fit; None where a piece has many."""
    guides = [f for f in range(len(elements)) if f not in pins]
    if len(pins) > 2:
        yield _unique(elements, start, slopes)
        return
    for pieces in product(*[_pieces(elements[f], len(start)) for f in guides]):
        rows: Array = np.array(pieces).reshape(len(guides), len(start))
        matrix = np.eye(len(guides)) - rows @ slopes[:, guides]
        if guides and np.linalg.svd(matrix, compute_uv=False)[-1] < 1e-12:
            side = np.linalg.lstsq(matrix, rows @ start, rcond=1e-12)[0]
            if float(np.abs(matrix @ side - rows @ start).max()) <= 1e-9 * float(np.abs(rows @ start).max(initial=0.0)):
                yield None
            continue
        solve = np.linalg.solve if guides else lambda m, r: r
        base, tilt = solve(matrix, rows @ start), solve(matrix, rows @ slopes[:, pins])
        for y in _pin_loads(
            [elements[f].row for f in pins],
            start + slopes[:, guides] @ base,
            slopes[:, pins] + slopes[:, guides] @ tilt,
        ):
            x = np.zeros(len(elements))
            x[pins] = y
            x[guides] = base + tilt @ y
            if (x >= -1e-12 * max(float(np.abs(x).max()), 1e-300)).all():
                yield np.maximum(x, 0.0)


def _pieces(e: FrictionElement, m: int) -> list[Array]:
    """Linear pieces of a guide's load, as rows over the multipliers."""
    found = []
    for sign in (1.0, -1.0):
        row = np.zeros(m)
        row[e.row] = sign
        found.append(row)
        if e.length > 0.0:
            row = np.zeros(m)
            row[e.row + 1] = 2.0 * sign / e.length
            found.append(row)
    return found


def _pin_loads(rows: list[int], lam: Array, slopes: Array) -> list[Array]:
    """Return non-negative loads of at most two pins, ``x_i = |lam_i + slopes_i x|``: roots of quadratics."""
    if not rows:
        return [np.zeros(0)]
    forms = []  # coefficients of 1, x, y, x^2, x y, y^2 in |lam + slopes x|^2 - x_i^2
    for i, r in enumerate(rows):
        own, p = lam[r : r + 2], slopes[r : r + 2]
        u, w = p[:, 0], p[:, 1] if len(rows) > 1 else np.zeros(2)
        form = np.array([own @ own, 2 * own @ u, 2 * own @ w, u @ u, 2 * u @ w, w @ w])
        form[3 if i == 0 else 5] -= 1.0
        forms.append(form)
    if len(rows) == 1:
        f = forms[0]
        return [np.array([x]) for x in _real_roots(np.array([f[0], f[1], f[3]])) if x >= 0.0]
    f, g = forms
    poly = np.polynomial.polynomial
    a = [np.array([h[5]]) for h in forms]
    b = [np.array([h[2], h[4]]) for h in forms]
    c = [np.array([h[0], h[1], h[3]]) for h in forms]
    ac = poly.polysub(poly.polymul(a[0], c[1]), poly.polymul(a[1], c[0]))
    ab = poly.polysub(poly.polymul(a[0], b[1]), poly.polymul(a[1], b[0]))
    bc = poly.polysub(poly.polymul(b[0], c[1]), poly.polymul(b[1], c[0]))
    found: list[Array] = []
    for x in _real_roots(poly.polysub(poly.polymul(ac, ac), poly.polymul(ab, bc))):
        if x < 0.0:
            continue
        for h in (f, g):
            for y in _real_roots(np.array([h[0] + h[1] * x + h[3] * x * x, h[2] + h[4] * x, h[5]])):
                found += [np.array([x, y])] if y >= 0.0 else []
    return found


def _real_roots(coefficients: Array) -> list[float]:
    """Real roots of a polynomial, coefficients ascending; nearly double roots count as real."""
    c = np.trim_zeros(np.where(np.abs(coefficients) <= 1e-14 * np.abs(coefficients).max(), 0.0, coefficients), "b")
    if len(c) < 2:
        return []
    roots = np.roots(c[::-1])
    return [float(r.real) for r in roots if abs(r.imag) <= 1e-6 * max(abs(r), 1e-300)]


@dataclass(frozen=True)
class FrictionElement:
    """One friction element: its joint's rows, the lever of its force (m; 1 in a guide), coefficients."""

    name: str
    row: int
    pin: bool
    lever: float
    length: float
    kinetic: float
    static: float
    stribeck: float
    regular: float

    @property
    def smooth(self) -> bool:
        """Whether the law is regularised: it never sticks."""
        return self.regular > 0.0

    @property
    def sticks(self) -> bool:
        """Whether it can stick."""
        return not self.smooth and self.static > 0.0

    @property
    def onset(self) -> float:
        """Coefficient at the first instant of sliding."""
        return self.static if self.stribeck > 0.0 else self.kinetic

    def coefficient(self, speed: float) -> float:
        """Coefficient at a sliding speed other than 0 (m/s)."""
        fall = float(np.exp(-((speed / self.stribeck) ** 2))) if self.stribeck > 0.0 else 0.0
        return self.kinetic + (self.static - self.kinetic) * fall

    @property
    def rows(self) -> slice:
        """Rows whose multipliers make the load."""
        return slice(self.row, self.row + (2 if self.pin or self.length > 0.0 else 1))

    def load(self, lam: Array) -> float:
        """Load, N, from the multipliers."""
        if self.pin:
            return float(np.hypot(lam[self.row], lam[self.row + 1]))
        normal = abs(float(lam[self.row]))
        return max(normal, 2.0 * abs(float(lam[self.row + 1])) / self.length) if self.length > 0.0 else normal


class FrictionRows:
    """The friction elements of a model; a workspace that a run makes once."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled
        T = compiled.tables
        elements = [e for e in compiled.model.elements if isinstance(e, JointFriction)]
        self.joints = [compiled.model.mechanism.joint(e.a, e.b) for e in elements]
        self.elements = tuple(
            FrictionElement(
                f"{joint.kind} {joint.a}-{joint.b}",
                int(T.friction[f, 0]),
                pin,
                float(T.friction_table[f, 4]) if pin else 1.0,
                *map(float, T.friction_table[f, [5, 0, 1, 2, 3]]),
            )
            for f, (joint, pin) in enumerate(zip(self.joints, T.friction[:, 1] == 2))
        )
        self.all = locked(compiled, self, range(len(self.elements)), np.zeros(len(self.elements)))

    @cached_property
    def lower_inverse(self) -> Array:
        """Inverse of the Cholesky factor of the mass matrix; (0, 0) with massless links."""
        return np.asarray(np.linalg.inv(self.compiled.tables.lower))

    def directions(self, t: float, q: Array, v: Array, slots: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Jacobian and right side of the joints; of the elements: directions W, coordinates, ``udot - W a``.

        The sliding rates are ``u = W v`` (of b relative to a), and W^T phi is the generalised force of friction phi.
        """
        T, m = self.all.tables, len(self.compiled.info)
        C, J, gam, _ = kernels.constraint_system(T, kernels.state_rows(T, q, v), slots, self.all.driven(t))
        return J[:m], gam[:m], J[m:], C[m:], -gam[m:]


def locked(compiled: Compiled, rows: FrictionRows, which: Sequence[int], held: Array) -> Compiled:
    """Return the model with the coordinates of some friction elements' joints held at given values."""
    joints, first = [rows.joints[f] for f in which], len(compiled.laws)
    own = [
        driver_row(compiled.model, Driver(joint.a, joint.b), compiled.centres, first + k)
        for k, joint in enumerate(joints)
    ]
    at = (compiled.info[int(row)].joint for row in compiled.tables.friction[list(which), 0])
    return compiled.with_held(own, [(f"sticking {j.kind} {j.a}-{j.b}", k) for j, k in zip(joints, at)], held)
