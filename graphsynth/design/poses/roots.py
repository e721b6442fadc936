"""All complex solutions of the equations of a revolute dyad, isolated and proved (theory/poses 2, 3).

A row holds the coefficients of ``xp + yq, yp - xq, x, y, p, q, 1`` in one equation, with the moving pivot (x, y) at
the first pose and the fixed pivot (p, q).
"""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import flint

Row = list[Any]
#: Ways to place the parameter t in the plane of solutions of the linear equations; one is as good as another.
_SLOPES = ((7, 16), (-5, 8), (3, 2))
#: Steps of Newton's method before a box is put around the result.
_ROUNDS = 3


class Roots(NamedTuple):
    """Solutions (x, y, p, q) as balls that are proved to hold one solution each, and why they may not be all.

    The real ones have real balls; ``bound`` is the number of complex solutions in general.
    """

    found: list[list[Any]]
    bound: int
    reason: str

    @property
    def real(self) -> list[list[Any]]:
        """The real solutions."""
        return [v for v in self.found if isinstance(v[0], flint.arb)]


def rows_of(displacements: list[tuple[Any, Any]]) -> list[Row]:
    """Equations "as far from the fixed pivot as in the first pose", divided by two."""
    rows = []
    for u, d in displacements:
        turned, less = u * d.conjugate(), u.real - 1
        square = d.real * d.real + d.imag * d.imag
        rows.append([-less, u.imag, turned.real, -turned.imag, -d.real, -d.imag, square / 2])
    return rows


def swapped(row: Row) -> Row:
    """Row of the same equation with fixed and moving pivots exchanged."""
    a, b, x, y, p, q, one = row
    return [a, -b, p, q, x, y, one]


def value(row: Row, v: list[Any]) -> Any:
    """Value of an equation."""
    x, y, p, q = v
    return (
        row[0] * (x * p + y * q) + row[1] * (y * p - x * q) + row[2] * x + row[3] * y + row[4] * p + row[5] * q + row[6]
    )


def gradient(row: Row, v: list[Any]) -> list[Any]:
    """Return the derivatives of an equation."""
    (x, y, p, q), (a, b, *rest) = v, row
    return [rest[0] + a * p - b * q, rest[1] + a * q + b * p, rest[2] + a * x + b * y, rest[3] + a * y - b * x]


def proved(rows: list[Row], v: list[Any], real: bool = False) -> list[Any] | None:
    """Krawczyk's test of the four equations on a box around v, in the complex numbers; None if it decides nothing.

    Around a real midpoint the box is its own mirror image, and so is the only solution in it.
    """
    step = [flint.acb(part) for part in v]
    for _ in range(_ROUNDS):  # Newton's method
        mid = [flint.acb(part.real.mid()) if real else part.mid() for part in step]
        step = _krawczyk(rows, mid)
        if step is None:
            return None
    sizes = [float(abs(flint.acb(part)).upper()) for part in mid]
    size = 4 * max(float(abs(a - b).upper()) for a, b in zip(step, mid)) + (max(sizes) + 1.0) * 2.0 ** (
        12 - flint.ctx.prec
    )
    box = [part + flint.acb(flint.arb(0, size), flint.arb(0, size)) for part in mid]
    image = _krawczyk(rows, box)
    if image is None or not all(part.contains_interior(own) for part, own in zip(box, image)):
        return None
    image = _krawczyk(rows, image) or image  # what solves the equations in a box lies in its image too
    return [part.real for part in image] if real else image


def _krawczyk(rows: list[Row], box: list[Any]) -> Any:
    """Krawczyk's image of a box, in which every solution in the box lies; None where the derivative has no inverse."""
    mid = [part.mid() for part in box]
    try:
        Y = flint.acb_mat([gradient(row, mid) for row in rows]).inv().mid()
    except ZeroDivisionError:
        return None
    slack = flint.acb_mat(4, 4, [int(j == k) for j in range(4) for k in range(4)])
    slack -= Y * flint.acb_mat([gradient(row, box) for row in rows])
    step = Y * flint.acb_mat(4, 1, [value(row, mid) for row in rows])
    image = flint.acb_mat(4, 1, mid) - step + slack * flint.acb_mat(4, 1, [a - b for a, b in zip(box, mid)])
    return [image[k, 0] for k in range(4)]


def five_poses(rows: list[Row]) -> Roots:
    """All common solutions of four equations: at most four."""
    for slope in _SLOPES:
        reduced = _two_conics(rows, flint.arb(flint.fmpq(*slope)))
        if isinstance(reduced, str):
            return Roots([], 4, reduced)
        (a1, b1, c1), (a2, b2, c2), back = reduced
        D1, D2, D3 = a1 * c2 - a2 * c1, a1 * b2 - a2 * b1, b1 * c2 - b2 * c1

        def solution(t: Any, D1: Any = D1, D2: Any = D2, back: Any = back) -> list[Any] | None:
            below = flint.acb_poly(D2)(t)
            return None if below.contains(0) else back(-flint.acb_poly(D1)(t) / below, t)

        result = _all_roots(rows, D1 * D1 - D2 * D3, 4, solution)
        if not result.reason:
            break
    return result


def _two_conics(rows: list[Row], slope: Any) -> Any:
    """Two conics in (s, t), as polynomials in t before s^2, s and 1, and the way back; a sentence if there is none."""
    first = max(combinations(range(4), 2), key=lambda ij: _size(rows[ij[0]], rows[ij[1]], 0, 1))
    i, j = first
    below = rows[i][0] * rows[j][1] - rows[j][0] * rows[i][1]
    if below.contains(0):
        return "fewer than three of the angles are known to differ"
    products = [
        [(rows[j][k] * rows[i][1] - rows[i][k] * rows[j][1]) / below for k in range(2, 7)],
        [(rows[i][k] * rows[j][0] - rows[j][k] * rows[i][0]) / below for k in range(2, 7)],
    ]
    linear = [
        [row[k + 2] + row[0] * products[0][k] + row[1] * products[1][k] for k in range(5)]
        for n, row in enumerate(rows)
        if n not in first
    ]
    m, n = max(combinations(range(4), 2), key=lambda mn: _size(linear[0], linear[1], *mn))
    below = linear[0][m] * linear[1][n] - linear[1][m] * linear[0][n]
    if below.contains(0):
        return "two equations depend on the others: the poses are special, and dyads may be at infinity or a family"
    free = [k for k in range(4) if k not in (m, n)]
    affine: list[Any] = [None] * 4
    affine[free[0]], affine[free[1]] = [flint.arb(0), flint.arb(1), slope], [flint.arb(0), -slope, flint.arb(1)]
    for target, other, sign in ((m, n, 1), (n, m, -1)):
        c = [sign * (linear[1][k] * linear[0][other] - linear[0][k] * linear[1][other]) / below for k in (4, *free)]
        affine[target] = [c[0], c[1] - slope * c[2], slope * c[1] + c[2]]

    def back(s: Any, t: Any) -> list[Any]:
        return [v[0] + v[1] * s + v[2] * t for v in affine]

    x, y, p, q = [(flint.arb_poly([v[0], v[2]]), v[1]) for v in affine]
    conics = []
    for own, pairs in zip(products, (((x, p, 1), (y, q, 1)), ((y, p, 1), (x, q, -1)))):
        a, b, c = flint.arb_poly([0]), flint.arb_poly([0]), flint.arb_poly([-own[4]])
        for (f0, f1), (g0, g1), sign in pairs:
            a, b, c = a + sign * f1 * g1, b + sign * (f1 * g0 + g1 * f0), c + sign * (f0 * g0)
        for k, (f0, f1) in enumerate((x, y, p, q)):
            b, c = b - own[k] * f1, c - own[k] * f0
        conics.append((a, b, c))
    return conics[0], conics[1], back


def _size(a: Row, b: Row, m: int, n: int) -> float:
    """Size of a determinant of two rows, for a choice between several."""
    return float(abs((a[m] * b[n] - b[m] * a[n]).mid()))


def four_poses(rows: list[Row], line: tuple[Any, Any]) -> Roots:
    """All solutions of three equations with the fixed pivot on a line, a point and a direction: at most three."""
    at, along = line
    p, q = flint.arb_poly([at.real, along.real]), flint.arb_poly([at.imag, along.imag])
    table = [(r[2] + r[0] * p - r[1] * q, r[3] + r[0] * q + r[1] * p, r[6] + r[4] * p + r[5] * q) for r in rows]
    minors = [
        [(b[j] * c[k] - b[k] * c[j]) for j, k in ((1, 2), (2, 0), (0, 1))] for b, c in combinations(table, 2)
    ]  # rows 0 1, 0 2, 1 2
    cubic = sum((table[0][k] * minors[2][k] for k in range(3)), flint.arb_poly([0]))

    def solution(t: Any) -> list[Any] | None:
        at_t = [[flint.acb_poly(part)(t) for part in row] for row in minors]
        best = max(at_t, key=lambda row: float(abs(row[2].mid())))
        if best[2].contains(0):
            return None
        return [best[0] / best[2], best[1] / best[2], flint.acb_poly(p)(t), flint.acb_poly(q)(t)]

    across = [flint.arb(0)] * 4 + [along.imag, -along.real, along.real * at.imag - along.imag * at.real]
    return _all_roots([*rows, across], cubic, 3, solution)


def _all_roots(rows: list[Row], polynomial: Any, degree: int, solution: Any) -> Roots:
    """Isolate all roots; where that fails, prove those that can be told apart."""
    coefficients = polynomial.coeffs()
    coefficients += [flint.arb(0)] * (degree + 1 - len(coefficients))
    if all(part.contains(0) for part in coefficients):
        return Roots([], degree, "the eliminant may vanish: there may be a family of dyads")
    reason = ""
    if coefficients[-1].contains(0):
        reason = "a solution is at infinity, or too far to tell: a pivot there is a slider's"
        while coefficients[-1].contains(0):
            coefficients.pop()
    roots, exact = _isolated(coefficients)
    if not exact:
        reason = reason or "two solutions coincide, or are too close to be told apart"
    found: list[list[Any]] = []
    for t in roots:
        own = _proved_root(rows, solution(t))
        if own is not None and all(_apart(own, other) for other in found):
            found.append(own)
    if not reason and len(found) < degree:
        reason = "a solution is not regular, so nothing is proved of it"
    return Roots(found, degree, reason)


def _proved_root(rows: list[Row], at: list[Any] | None) -> list[Any] | None:
    """Prove a solution, and that it is real or that it is not."""
    if at is None:
        return None
    if all(part.imag.contains(0) for part in at) and (own := proved(rows, at, real=True)) is not None:
        return own
    own = proved(rows, at)
    return None if own is None or all(part.imag.contains(0) for part in own) else own


def _isolated(coefficients: list[Any]) -> tuple[list[Any], bool]:
    """Roots of a polynomial with balls for coefficients; of its midpoints, and False, if they are not isolated."""
    if len(coefficients) < 2:
        return [], True
    try:
        return flint.acb_poly(coefficients).roots(), True
    except ValueError:
        pass
    try:
        return flint.acb_poly([part.mid() for part in coefficients]).roots(), False
    except ValueError:
        return [], False


def _apart(v: list[Any], w: list[Any]) -> bool:
    return any(not flint.acb(a).overlaps(flint.acb(b)) for a, b in zip(v, w))


def linear(rows: list[Row], pivot: Any) -> list[Any] | None:
    """Return the moving pivot of three poses for a fixed one; None if the equations may have no single solution."""
    p, q = pivot.real, pivot.imag
    (a, b, e), (c, d, f) = (
        (r[2] + r[0] * p - r[1] * q, r[3] + r[0] * q + r[1] * p, r[6] + r[4] * p + r[5] * q) for r in rows
    )
    below = a * d - b * c
    if below.contains(0):
        return None
    return [(b * f - d * e) / below, (c * e - a * f) / below, p, q]
