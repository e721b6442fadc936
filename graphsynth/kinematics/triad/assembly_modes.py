"""Direct problem of the planar platform: every pose for given anchors and leg lengths (3-RPR).

The compiled solver (``kernels.modes``) isolates the real roots of the sextic with bounds on derivatives and polishes
every pose on the closure equations.  What it cannot decide in double precision it flags; `escalate` then works with 50
digits (mpmath, milliseconds per problem), with the same isolation by a bound on the second derivative.

The sextic ``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)``, ``z = exp(i alpha)``, is a trigonometric polynomial of
degree three, so nothing special happens at alpha = pi.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import LARGEST, SMALLEST, check_largest, positive
from graphsynth.core.errors import GeometryError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
#: (pivots, arms, angles): lets the anchors be recomputed at higher precision
Arms = tuple[tuple[complex, complex, complex], tuple[float, float, float], Sequence[float]]

_DIGITS = 50
_COINCIDENT = 1e-12  # relative; the given numbers are rounded at 1e-16
_TRANSLATES = "congruent triangles and equal legs: the platform translates on a circle at one orientation"
_LARGEST_WORK = 20000  # intervals
_MERGED = 1e-20  # width at which two modes are reported as one double mode


def sextic(anchors: Complex, vertices: Complex, lengths: Array) -> Sextic:
    """Coefficients for anchors A_k, platform vertices b_k and leg lengths, each of shape (..., 3).

    Unit of g: length^6.  Scale the lengths to about one before use.

    Examples
    --------
    >>> s = sextic(np.array([0, 2, 1 + 1j]), np.array([0, 1, 0.5 + 1j]), np.array([1.0, 1.5, 1.25]))
    >>> b2, b3, a2, a3 = 1, 0.5 + 1j, 2, 1 + 1j  # the leading coefficient has a closed form
    >>> bool(abs(s.g[3] - b2 * b3 * (b3 - b2) * np.conj(a2 * a3 * (a2 - a3))) < 1e-14)
    True
    """
    A, b, legs = ([np.asarray(rows)[..., k] for k in range(3)] for rows in (anchors, vertices, lengths))
    return coefficients([a + 0j for a in A], [v + 0j for v in b], legs, np.conj)


@dataclass(frozen=True, eq=False)
class AssemblyModes:
    """All assembly modes of one problem, sorted by alpha.

    `poses` (m, 3): ``(x, y, alpha)`` with alpha in (-pi, pi]; m is 0 to 6, or 0 with `self_motion`, the description of
    a continuous family of poses.  `determinants` (m,): ``det JX``, length^4.  `residuals` (m,): largest ``|f_k|``
    relative to the square of the largest length.  `near_double_root`: two modes are closer than float64 coefficients
    can separate (type-II singularity); `escalated`: the modes were then computed at 50 digits from the given
    double-precision input; `double` (m,): those that stay merged even there, they count twice.  `consistent`: the
    number of modes is even and the signs of ``det JX`` cancel (theory/platform-direct 4).  `note`: for instance on a
    drop of the degree; `method`: how the modes were counted.
    """

    poses: Array
    determinants: Array
    residuals: Array
    near_double_root: bool
    escalated: bool
    double: Mask
    self_motion: str
    consistent: bool
    note: str
    method: str

    def __len__(self) -> int:
        return len(self.poses)

    def separation(self, Lc: float) -> Array:
        """Distance of every mode from its nearest neighbour, ``sqrt(dx^2 + dy^2 + Lc^2 dalpha^2) / Lc``, shape (m,).

        ``Lc`` is the characteristic length; infinite for a mode without neighbour.
        """
        d = self.poses[:, None] - self.poses[None]
        turn = np.angle(np.exp(1j * d[..., 2]))
        distance = np.sqrt((d[..., 0] ** 2 + d[..., 1] ** 2) / positive("Lc", Lc) ** 2 + turn**2)
        np.fill_diagonal(distance, np.inf)
        return np.asarray(distance.min(axis=1, initial=np.inf))


@dataclass(frozen=True, eq=False)
class AssemblyModeBatch:
    """Assembly modes of N problems in one list of M, by problem and then by alpha.

    Of every mode: its `problem` (M,), `poses` (M, 3), `determinants` (M,), as in `AssemblyModes`.  Of every problem
    (N,) `counts` of modes; `near_double_root`: double precision does not decide it, and its modes are incomplete or
    inaccurate unless `escalated`, solved again at 50 digits; `consistent`: even number of modes and vanishing sum of
    ``sign(det JX)`` (theory/platform-direct 4), double modes left out.  `remarks`: for escalated problems a
    self-motion, or why the problem is not decided; such problems have no modes here.
    """

    problem: NDArray[np.intp]
    poses: Array
    determinants: Array
    counts: NDArray[np.intp]
    near_double_root: Mask
    consistent: Mask
    escalated: Mask
    remarks: dict[int, str] = field(default_factory=dict)


def _rows(name: str, values: ArrayLike, dtype: type) -> NDArray[Any]:
    """Finite array (n, 3) as the kernels need it: contiguous and writeable."""
    try:
        array: NDArray[Any] = np.atleast_2d(np.asarray(values, dtype=dtype))
    except (TypeError, ValueError) as error:
        raise GeometryError(f"{name} is not an array of numbers: {error}") from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise GeometryError(f"{name} has shape {array.shape}; give three per problem, shape (3,) or (N, 3)")
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        raise GeometryError(f"{name} of leg {bad[0, 1] + 1}, problem {bad[0, 0]}, is not finite; give finite numbers")
    return np.require(array, requirements=["C", "W"])


def assembly_modes_batch(
    anchors: ArrayLike,
    vertices: ArrayLike,
    lengths: ArrayLike,
    *,
    escalate: bool = True,
    arms: tuple[ArrayLike, ArrayLike, Array] | None = None,
) -> AssemblyModeBatch:
    """All assembly modes of N problems (3-RPR): about a million problems a second on one core.

    Anchors A_k in the fixed frame, vertices b_k in the platform frame (complex) and leg lengths, zero or more, each of
    shape (N, 3), or (3,) for all problems.  `escalate`: solve flagged problems again at 50 digits (tens of milliseconds
    each); else they stay flagged.  `arms` (pivots (3,), arms (3,), angles (N, 3)): from what the anchors came, so that
    50 digits can start from the given angles.

    The count is guaranteed for the computed coefficients where ``near_double_root`` is False (theory/platform-direct
    2); every pose is polished on the closure equations and accurate to about 3e-12 of the largest length, or flagged.

    `GeometryError` for numbers that are not finite, negative lengths, shapes that do not fit, a problem whose largest
    dimension is not between 1e-60 and 1e60.

    Examples
    --------
    >>> import numpy as np
    >>> corner = np.exp(2j * np.pi * np.arange(3) / 3)
    >>> batch = assembly_modes_batch(2 * corner, corner, [[1.5, 1.5, 1.5], [0.5, 0.5, 0.5]])
    >>> batch.counts.tolist()
    [2, 0]
    """
    A, b, l2 = _rows("anchor", anchors, complex), _rows("vertex", vertices, complex), _rows("length", lengths, float)
    if bool((l2 < 0.0).any()):
        problem, leg = np.argwhere(l2 < 0.0)[0]
        raise GeometryError(f"length of leg {leg + 1}, problem {problem}, is {l2[problem, leg]}; give zero or more")
    n = max(len(A), len(b), len(l2))
    if any(len(rows) not in (1, n) for rows in (A, b, l2)):
        raise GeometryError(f"{len(A)} anchors, {len(b)} platforms and {len(l2)} legs; give N or one of each")
    # determinants, length^4, are to be numbers
    tables = [np.abs(rows.view(np.float64)) for rows in (A, b, l2)]
    largest = max(float(table.max(initial=0.0)) for table in tables)
    if not (largest <= LARGEST and l2.min(initial=LARGEST) >= SMALLEST):  # else no problem can be out of range
        size = np.maximum.reduce(np.broadcast_arrays(*(table.max(axis=1) for table in tables)))
        for problem in np.flatnonzero((size > LARGEST) | ((size > 0.0) & (size < SMALLEST))):
            check_largest(float(size[problem]), f"dimension of problem {problem}")
    if len(A) < n:
        A = np.repeat(A, n, axis=0)
    from graphsynth.kinematics.triad.kernels.modes import INCONSISTENT, modes

    # rows that stay unused cost no memory
    found: tuple[Any, ...] = np.empty(6 * n, dtype=np.intp), np.empty((6 * n, 3)), np.empty(6 * n)
    counts, flags = np.empty(n, dtype=np.intp), np.empty(n, dtype=np.uint8)
    total = modes(A, b, l2, *found, counts, flags)
    problems, poses, determinants = (part[:total].copy() for part in found)
    flagged, consistent = (flags & ~np.uint8(INCONSISTENT)) != 0, (flags & INCONSISTENT) == 0
    batch = AssemblyModeBatch(problems, poses, determinants, counts, flagged, consistent, np.zeros(n, dtype=bool))
    if not escalate:
        return batch
    undecided = np.flatnonzero(batch.near_double_root | ~batch.consistent)
    if undecided.size == 0:
        return batch
    return _escalated(batch, undecided, A, np.broadcast_to(b, A.shape), np.broadcast_to(l2, A.shape), arms)


def _escalated(
    batch: AssemblyModeBatch,
    undecided: NDArray[np.intp],
    A: Complex,
    b: Complex,
    l2: Array,
    arms: tuple[ArrayLike, ArrayLike, Array] | None,
) -> AssemblyModeBatch:
    counts, consistent, escalated = batch.counts.copy(), batch.consistent.copy(), batch.escalated.copy()
    keep = ~np.isin(batch.problem, undecided)
    problems, poses, determinants = [batch.problem[keep]], [batch.poses[keep]], [batch.determinants[keep]]
    remarks = {}
    for i in undecided.tolist():
        given: Any = None
        if arms is not None:
            given = np.asarray(arms[0], dtype=complex).tolist(), np.asarray(arms[1], dtype=float).tolist(), arms[2][i]
        modes = _described(A[i], b[i], l2[i], bool(batch.near_double_root[i]), *escalate(A[i], b[i], l2[i], given))
        problems.append(np.full(len(modes), i, dtype=np.intp))
        poses.append(modes.poses)
        determinants.append(modes.determinants)
        counts[i], consistent[i], escalated[i] = len(modes), modes.consistent, True
        if modes.self_motion:
            remarks[i] = modes.self_motion
        elif not modes.consistent:
            remarks[i] = "parity of the modes violated after escalation: a mode is missing or singular; please report"
    problem = np.concatenate(problems)
    order = np.argsort(problem, kind="stable")
    return AssemblyModeBatch(
        problem[order],
        np.concatenate(poses)[order],
        np.concatenate(determinants)[order],
        counts,
        batch.near_double_root,
        consistent,
        escalated,
        remarks,
    )


def _described(
    A: Complex, b: Complex, l2: Array, flagged: bool, poses: Array, double: Mask | None = None, self_motion: str = ""
) -> AssemblyModes:
    """Modes with everything that can be recomputed from the poses; at 50 digits `double` is known."""
    arm = np.exp(1j * poses[:, 2:3]) * b
    d = poses[:, 0:1] + 1j * poses[:, 1:2] + arm - A  # the legs
    determinants = np.linalg.det(2.0 * np.stack([d.real, d.imag, arm.real * d.imag - arm.imag * d.real], axis=-1))
    size = np.abs(d)
    largest = float(max(np.abs(A - A[0]).max(), np.abs(b - b[0]).max(), l2.max())) or 1.0
    residuals = np.max(np.abs((size - l2) * (size + l2)), axis=-1, initial=0.0) / largest**2
    merged = np.zeros(len(poses), dtype=bool) if double is None else double
    single = np.sign(determinants[~merged])
    consistent = bool(single.size % 2 == 0 and single.sum() == 0) and not self_motion
    pairs = [
        f"{name} {first + 1} and {second + 1} coincide: the degree drops to at most four modes"
        for name, points in (("anchors", A), ("platform vertices", b))
        for first, second in ((0, 1), (0, 2), (1, 2))
        if points[first] == points[second]
    ]
    method = f"isolated by bounds on derivatives{', float64' if double is None else ' at 50 digits'}"
    return AssemblyModes(
        poses,
        determinants,
        residuals,
        flagged,
        double is not None,
        merged,
        self_motion,
        consistent,
        pairs[0] if pairs else "",
        method,
    )


def assembly_modes(
    anchors: ArrayLike, vertices: ArrayLike, lengths: ArrayLike, *, arms: Arms | None = None
) -> AssemblyModes:
    """All assembly modes of one problem: anchors A_k, platform vertices b_k, leg lengths, each of shape (3,).

    Problems whose modes nearly merge, or whose linear system degenerates at a mode, are solved again at 50 digits from
    the given double-precision numbers; ``arms`` lets the anchors be recomputed there from pivots, arms and angles.

    Examples
    --------
    >>> import numpy as np
    >>> corner = np.exp(2j * np.pi * np.arange(3) / 3)  # similar triangles: two mirror modes (theory/platform-direct 3)
    >>> modes = assembly_modes(2 * corner, corner, [1.5, 1.5, 1.5])
    >>> len(modes), modes.consistent
    (2, True)
    """
    A, b = np.asarray(anchors, dtype=np.complex128).reshape(-1), np.asarray(vertices, dtype=np.complex128).reshape(-1)
    l2 = np.asarray(lengths, dtype=np.float64).reshape(-1)
    batch = assembly_modes_batch(A, b, l2, escalate=False)
    flagged = bool(batch.near_double_root[0])
    if flagged or not batch.consistent[0]:
        return _described(A, b, l2, flagged, *escalate(A, b, l2, arms))
    return _described(A, b, l2, False, batch.poses)


# --- at 50 digits, for modes that float64 coefficients cannot separate


def escalate(anchors: Complex, vertices: Complex, lengths: Array, arms: Arms | None) -> tuple[Array, Mask, str]:
    """Poses (m, 3), which of them are double, and a description of a self-motion (empty if none)."""
    import mpmath

    with mpmath.workdps(_DIGITS):
        mp = mpmath.mp
        if arms is None:
            A = [mp.mpc(value) for value in anchors]
        else:
            pivots, rockers, angles = arms
            A = [mp.mpc(D) + mp.mpf(arm) * mp.expj(mp.mpf(angle)) for D, arm, angle in zip(pivots, rockers, angles)]
        unit = 2.0 ** int(np.frexp(np.max(np.abs(anchors - anchors[0]), initial=float(lengths.max())))[1])
        A = [value / unit for value in A]
        b = [mp.mpc(value) / unit for value in vertices]
        l2 = [mp.mpf(value) / unit for value in lengths]
        g, n, d = coefficients(A, b, l2, mp.conj)
        found: list[tuple[Any, Any, bool]] = []
        family = ""
        # congruent to its anchors, with equal legs, to the rounding of the input
        if b[1] != b[0] and A[1] != A[0] and max(abs(l2[k] - l2[0]) for k in (1, 2)) <= _COINCIDENT / 100:
            z = (A[1] - A[0]) / (b[1] - b[0])
            off = max(abs(abs(z) - 1), abs(z * (b[2] - b[0]) - (A[2] - A[0])))
            family = _TRANSLATES if off < _COINCIDENT / 100 else ""
        if max(abs(c) for c in g) < mp.mpf(10) ** -14:  # below the resolution of the given numbers
            family = "the sextic vanishes: a continuous family of poses"
        roots = [] if family else _roots(mp, g)
        if roots is None:
            family, roots = "not decided: a root of the sextic is too flat to isolate", []
        for alpha, merged in roots:
            z = mp.expj(alpha)
            N, Delta = ((n[0] * z + n[1]) * z + n[2]) + n[3] / z, d[0] + d[1] * z - mp.conj(d[1]) / z
            if abs(Delta) > mp.mpf(10) ** -15:
                found.append((A[0] + N / Delta - z * b[0], alpha, merged))
                continue
            family, points = _geometric(mp, A, b, l2, z)
            if family:
                break
            known = [q for q, other, _ in found if abs(other - alpha) < _COINCIDENT]  # a split double root comes twice
            found += [(p, alpha, False) for p in points if all(abs(p - q) > _COINCIDENT for q in known)]
        found = [] if family else found
        poses = [[float(p.real * unit), float(p.imag * unit), float(alpha)] for p, alpha, _ in found]
        return np.array(poses).reshape(-1, 3), np.array([merged for *_, merged in found], dtype=bool), family


class Sextic(NamedTuple):
    """Coefficients of G, of ``N(z)`` and of ``Delta(z)`` (theory/platform-direct 1), in any arithmetic.

    ``g = (g0, g1, g2, g3)``, ``n = (n2, n1, n0, nm)``, ``d = (d0, de)``.
    """

    g: tuple[Any, Any, Any, Any]
    n: tuple[Any, Any, Any, Any]
    d: tuple[Any, Any]


_Three = Sequence[Any]
_Map = Callable[[Any], Any]


def coefficients(A: _Three, b: _Three, lengths: _Three, c: _Map, i: _Map = lambda x: 1j * x) -> Sextic:
    """Coefficients for anchors, vertices and leg lengths; c conjugates in their arithmetic, i multiplies by i."""

    def square(z: Any) -> Any:
        return z.real * z.real + z.imag * z.imag

    def offset(k: int, a: Any, v: Any) -> Any:
        return (lengths[k] - lengths[0]) * (lengths[k] + lengths[0]) - square(a) - square(v)

    a2, a3, b2, b3, L = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0], lengths[0] * lengths[0]
    w20, w30, w21, w31 = offset(1, a2, b2), offset(2, a3, b3), b2 * c(a2), b3 * c(a3)
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + c(w21) * b3 + w30 * a2 - c(w31) * b2
    nm = -c(w21) * a3 + c(w31) * a2
    d0, de = i(2 * (c(b2) * b3 + c(a2) * a3).imag), b2 * c(a3) - c(a2) * b3
    g0 = square(n2) + square(n1) + square(n0) + square(nm) - L * (square(d0) + 2 * square(de))
    g1 = n2 * c(n1) + n1 * c(n0) + n0 * c(nm) + 2 * L * d0 * de
    g2 = n2 * c(n0) + n1 * c(nm) + L * de * de
    return Sextic((g0, g1, g2, n2 * c(nm)), (n2, n1, n0, nm), (d0, de))


def _roots(mp: Any, g: Sequence[Any]) -> list[tuple[Any, bool]] | None:
    """Real roots of G, sorted, with a mark on those that stay merged at this precision; None if undecided.

    G'' is bounded on each interval through its Taylor expansion to the fourth derivative, so that the work stays small
    beside a quadruple root (similar triangles, theory/platform-direct 3).
    """
    fourth = 2 * (abs(g[1]) + 16 * abs(g[2]) + 81 * abs(g[3]))
    eta = (abs(g[0]) + fourth) * mp.mpf(10) ** (5 - _DIGITS)

    def derivative(order: int, x: Any) -> Any:
        z = mp.expj(x)
        total = sum((mp.j * k) ** order * g[k] * z**k for k in (1, 2, 3))
        return 2 * total.real + (g[0] if order == 0 else 0)

    value, slope = partial(derivative, 0), partial(derivative, 1)
    shift = mp.mpf(1) / 1000  # no node on the symmetric positions
    nodes = [-mp.pi + shift + 2 * mp.pi * k / 32 for k in range(33)]
    stack = [(nodes[k], nodes[k + 1]) for k in range(32)]
    roots: list[tuple[Any, bool]] = []
    for _ in range(_LARGEST_WORK):
        if not stack:
            break
        low, high = stack.pop()
        at_low, at_high, width, middle = value(low), value(high), high - low, (low + high) / 2
        bend = abs(derivative(2, middle)) + abs(derivative(3, middle)) * width / 2 + fourth * width**2 / 8
        same = (at_low >= 0) == (at_high >= 0)
        if same and min(abs(at_low), abs(at_high)) > bend * width**2 / 8 + eta:
            continue
        if abs(slope(middle)) > bend * width / 2 + 3 * eta:
            if not same:
                roots.append((_bracketed(value, slope, low, high, at_low >= 0), False))
        elif width < _MERGED:
            roots.append((middle, True))
        elif max(abs(value(middle)), abs(slope(middle)) / 3, abs(derivative(2, middle)) * width**2 / 8) <= eta:
            return None  # too flat for these digits: no smaller interval decides either
        else:
            stack += [(low, middle), (middle, high)]
    if stack:
        return None
    wrapped = sorted(((x - 2 * mp.pi if x > mp.pi else x, merged) for x, merged in roots), key=lambda root: root[0])
    return [
        (x, merged)
        for k, (x, merged) in enumerate(wrapped)
        if not (k and merged and wrapped[k - 1][1] and abs(x - wrapped[k - 1][0]) < 100 * _MERGED)
    ]


def _bracketed(value: Any, slope: Any, low: Any, high: Any, positive: bool) -> Any:
    x = (low + high) / 2
    for _ in range(200):
        y = value(x)
        if (y >= 0) == positive:
            low = x
        else:
            high = x
        s = slope(x)
        new = x - y / s if s != 0 else (low + high) / 2
        if not low < new < high:
            new = (low + high) / 2
        if abs(new - x) < 1e-40:
            return new
        x = new
    return x


def _geometric(mp: Any, A: list[Any], b: list[Any], l2: list[Any], z: Any) -> tuple[str, list[Any]]:
    """Poses at an orientation where Delta vanishes: a line met with the circle ``|Q| = l2_1``.

    See theory/platform-direct 3.
    """
    e = [z * (b[k] - b[0]) - (A[k] - A[0]) for k in (1, 2)]
    w = [l2[k] ** 2 - l2[0] ** 2 - abs(e[k - 1]) ** 2 for k in (1, 2)]
    tiny = mp.mpf(10) ** -14
    if max(abs(v) for v in e) < tiny:
        if max(abs(l2[k] - l2[0]) for k in (1, 2)) < tiny:
            return _TRANSLATES, []
        return "", []
    k = 0 if abs(e[0]) >= abs(e[1]) else 1
    if abs(w[1 - k] * abs(e[k]) ** 2 - w[k] * (mp.conj(e[k]) * e[1 - k]).real) > tiny:
        return "", []  # parallel lines that do not coincide
    direction = e[k] / abs(e[k])
    along = w[k] / (2 * abs(e[k]))
    across2 = l2[0] ** 2 - along**2
    if across2 < -tiny:
        return "", []
    across = mp.sqrt(max(across2, mp.mpf(0)))
    sides = (across, -across) if across > tiny else (mp.mpf(0),)
    return "", [A[0] + direction * mp.mpc(along, side) - z * b[0] for side in sides]
