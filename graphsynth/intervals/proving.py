"""Krawczyk's test for systems of equations, with interval parameters and automatic derivatives.

For a system ``F(x, p) = 0`` on a box X, with z in X, L an enclosure of the Jacobian over X and all p, and a real
matrix Y near the inverse of mid L,

    K(X) = z - Y F(z, [p]) + (I - Y L) (X - z).

What follows from K(X) is listed in `Status`; nothing follows from a mere overlap.  Sources: [Krawczyk 1969], [Moore
1977], [Neumaier 1990]; theory/interval-tests 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Count
from graphsynth.core.errors import IntervalError
from graphsynth.intervals.boxes import Status, bounded
from graphsynth.intervals.dual import evaluate, jacobian_of, values_of, variables
from graphsynth.intervals.guard import check_rounding, checked
from graphsynth.intervals.interval import Interval, _make, interval
from graphsynth.intervals.operations import Array, Mask

#: ``f(x)`` or ``f(x, p)``: sequences of unknowns and parameters in, a sequence of as many equations as unknowns out.
System = Callable[..., Sequence[Any]]

_ROUNDS = 12
_GAIN = 0.9


@dataclass(frozen=True, eq=False)
class Image:
    """Krawczyk images of N boxes with n unknowns, and what they prove.

    Attributes
    ----------
    status : ndarray of int8, shape (N,)
        `Status` of every box.
    box : Interval, shape (N, n)
        The intersection of box and image: every solution of the box lies in it.
    image : Interval, shape (N, n)
        K(X).
    factor : ndarray, shape (N, n, n)
        Upper bounds of ``|I - Y L|``.
    guaranteed : ndarray of bool, shape (N,)
        Whether the equations are defined and continuous on the whole box.
    singular : ndarray of bool, shape (N,)
        Whether the midpoint of L had no usable inverse; the box must then be cut.
    exact_input : bool
        False if a plain float came into the equations or parameters: what rounding did to it is not included.
    """

    status: NDArray[np.int8]
    box: Interval
    image: Interval
    factor: Array
    guaranteed: Mask
    singular: Mask
    exact_input: bool


@dataclass(frozen=True, eq=False)
class KrawczykResult:
    """Outcome of `krawczyk` for one box.

    Attributes
    ----------
    status : Status
        What is proved about the box that was given (rounding included: certified).
    box : Interval, shape (n,)
        Every solution in the given box lies here, for all parameter values; empty for ``EMPTY``.
    domain : Interval, shape (n,)
        For ``UNIQUE`` the largest tested box around it in which the solution is the only one.
    image : Interval, shape (n,)
        Last Krawczyk image.
    spectral_radius : float
        Estimate of ``rho(|I - Y L|)`` on the last box; the textbook condition ``< 1`` is necessary for success but
        not sufficient (theory/interval-tests 3).
    contraction : float
        Largest ratio of the radii of the image and of the box it came from; below 1 where the test succeeds.
    rounds : int
        Boxes tested.
    reason : str
        One sentence.
    exact_input : bool
        False if a plain float came in as a constant or parameter: the proof is for that float, not for the decimal
        it was written as.
    """

    status: Status
    box: Interval
    domain: Interval
    image: Interval
    spectral_radius: float
    contraction: float
    rounds: int
    reason: str
    exact_input: bool


def inverses(matrices: Array) -> tuple[Array, Mask]:
    """Return inverses (zero where there is none) and where there is none."""
    fine: Mask = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    guarded = matrices if fine.all() else np.where(fine[:, None, None], matrices, np.eye(matrices.shape[-1]))
    try:
        inverse: Array = np.linalg.inv(guarded).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        inverse = np.full_like(guarded, np.nan)
        for k, matrix in enumerate(guarded):
            with suppress(np.linalg.LinAlgError):
                inverse[k] = np.linalg.inv(matrix)
    fine = np.asarray(fine & np.isfinite(inverse).all(axis=(1, 2)))
    return (inverse if fine.all() else np.where(fine[:, None, None], inverse, 0.0)), ~fine


def points(values: Array) -> Interval:
    """Real numbers as intervals."""
    return _make(values, values)


def _square(f: System, x: Sequence[Any], parameters: Interval | None, shape: tuple[int, ...]) -> Sequence[Any]:
    """Return the equations at ``x``, as many as there are unknowns."""
    results = evaluate(f, x, parameters, shape)
    if len(results) != len(x):
        raise IntervalError(
            f"the system returns {len(results)} equations for {len(x)} unknowns; Krawczyk's test needs as many"
        )
    return results


def image(f: System, boxes: Interval, parameters: Interval | None = None) -> Image:
    """Apply Krawczyk's test once to boxes of shape (N, n).

    Parameters
    ----------
    f : callable
        ``f(x)`` or ``f(x, p)``, written with operators and the functions of `graphsynth.intervals`.
    boxes : Interval, shape (N, n)
    parameters : Interval, shape (m,) or (N, m), optional

    Returns
    -------
    Image
        Certified; the semantics of `Status`.

    Raises
    ------
    IntervalError
        Boxes that are no list of boxes.

    Examples
    --------
    >>> boxes = Interval([["[1, 2]"], ["[3, 4]"]])
    >>> [Status(s).name for s in image(lambda x: [x[0] ** 2 - 2], boxes).status]
    ['UNIQUE', 'EMPTY']
    """
    check_rounding()
    boxes, parameters = interval(boxes), None if parameters is None else interval(parameters)
    if boxes.ndim != 2:
        raise IntervalError(f"boxes of shape {boxes.shape} are no list of boxes; give shape (N, n)")
    count, n = boxes.shape
    shape = (count,)
    with np.errstate(all="ignore"):
        duals = _square(f, variables(boxes), parameters, shape)
        over, slopes = values_of(duals, shape), jacobian_of(duals, n, shape)
        z = boxes.mid
        z = np.where(np.isfinite(z), z, 0.0)
        centre = points(z)
        at = values_of(_square(f, [centre[:, i] for i in range(n)], parameters, shape), shape)
        Y, singular = inverses(slopes.mid)
        real = points(Y)
        rest = points(np.eye(n)) - real.times(slopes)
        K = centre - real.times(at) + rest.times(boxes - centre)
    void: Mask = np.asarray(boxes.is_empty.any(axis=1))
    smooth = _all_guaranteed(over, 1) & _all_guaranteed(slopes, 2) & _all_guaranteed(at, 1)
    smooth = np.asarray(smooth & boxes.is_bounded.all(axis=1) & ~singular)
    K = _where(smooth, K, Interval.entire(K.shape))
    meet = _where(~void, boxes.intersect(K), Interval.empty(K.shape))
    none = (~over.contains(np.zeros(over.shape))).any(axis=1) | meet.is_empty.any(axis=1) | void
    exact = bool(over.exact_input.all() and slopes.exact_input.all())
    inside = smooth & K.interior(boxes).all(axis=1)
    within = smooth & K.subset(boxes).all(axis=1) & ~inside
    if within.any():  # existence alone needs Y nonsingular, as is proved by |I - Y mid L| < 1 in the maximum norm
        with np.errstate(all="ignore"):
            near = points(np.eye(n)) - real.times(points(slopes.mid))
            within = within & (_make(np.zeros_like(near.mag), near.mag).sum(-1).hi.max(axis=-1) < 1.0)
    status = np.where(
        none, Status.EMPTY, np.where(inside, Status.UNIQUE, np.where(within, Status.EXISTS, Status.UNDECIDED))
    )
    box = _where(~none, meet, Interval.empty(K.shape))
    return Image(status.astype(np.int8), box, K, np.where(rest.is_empty, np.inf, rest.mag), smooth, singular, exact)


def _all_guaranteed(a: Interval, axes: int) -> Mask:
    """Whether all entries of each box rest on operations defined, continuous, and not empty."""
    last = tuple(range(-axes, 0))
    return np.asarray(np.broadcast_to(a.guaranteed, a.shape).all(axis=last) & ~a.is_empty.any(axis=last))


def _where(mask: Mask, a: Interval, b: Interval) -> Interval:
    pick = mask.reshape(mask.shape + (1,) * (a.ndim - mask.ndim))
    return _make(np.where(pick, a.lo, b.lo), np.where(pick, a.hi, b.hi))


def spectral_radius(factor: Array) -> float:
    """Estimate of the spectral radius of a nonnegative matrix; infinity if an entry is not finite."""
    if not np.isfinite(factor).all():
        return float("inf")
    return float(np.abs(np.linalg.eigvals(factor)).max(initial=0.0))


@checked
def krawczyk(
    f: System, box: Any, parameters: Any = None, *, rounds: Count = _ROUNDS, inflate: bool = True
) -> KrawczykResult:
    """Decide whether a box holds a solution of ``f = 0``, with proof.

    Parameters
    ----------
    f : callable
        ``f(x)`` or ``f(x, p)``: n unknowns (and m parameters) in, n equations out, written with operators and the
        functions of `graphsynth.intervals` (``sin``, ``sqrt``, ...).  Derivatives are automatic.
    box : Interval or anything `Interval` takes, shape (n,)
        Start box; bounded.
    parameters : Interval or anything it takes, shape (m,), optional
        Interval parameters; the status holds for every value in them.
    rounds : int
        Limit on contractions, and again on inflations.
    inflate : bool
        Test enlarged boxes too (epsilon-inflation): needed for solutions near a face.

    Returns
    -------
    KrawczykResult
        Certified.

    Raises
    ------
    IntervalError
        For a box that is empty, unbounded or not a vector, and for a number of equations that differs from n.

    Notes
    -----
    Source: theory/interval-tests 1 to 3.  UNIQUE from an enlarged box is given only if its image lies inside the
    given box: all solutions of the given box lie in the enlarged one, which has exactly one, in the image.

    Examples
    --------
    >>> circle_and_parabola = lambda x: [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2]
    >>> result = krawczyk(circle_and_parabola, ["[0.5, 0.7]", "[0.7, 0.9]"])
    >>> result.status.name, bool(result.box.width.max() < 1e-14)
    ('UNIQUE', True)
    """
    check_rounding()
    start = bounded("box", box)
    parameters = read_parameters(parameters)
    X, tested, proved, domain = start, 0, Status.UNDECIDED, start
    for _ in range(rounds):
        step = image(f, X.reshape(1, -1), parameters)
        tested += 1
        status = Status(int(step.status[0]))
        if status is Status.EMPTY:
            return _report(status, step, X, X, tested, "no solution: the equations or the image exclude the box")
        if status < proved:  # the first proof of uniqueness (its box is the largest), else the first of existence
            proved, domain = status, X
        width = X.width
        X = step.box[0]
        if not (X.width < _GAIN * width).any():
            break
    if proved is not Status.UNDECIDED:
        wording = "exactly one solution" if proved is Status.UNIQUE else "at least one solution"
        return _report(proved, step, X, domain, tested, f"{wording}: the image lies in a box tested")
    if inflate and bool(step.guaranteed[0]):
        found = _inflated(f, X, start, parameters, rounds, tested)
        if found is not None:
            return found
    reason = "the image is not inside the box: the box is too wide, or a solution is multiple or near a face"
    if step.singular[0]:
        reason = "the midpoint of the Jacobian is singular: cut the box"
    elif not step.guaranteed[0]:
        reason = "the equations or their derivatives are undefined, unbounded or discontinuous somewhere in the box"
    return _report(Status.UNDECIDED, step, X, X, tested, reason)


def read_parameters(parameters: Any) -> Interval | None:
    """Read a vector of parameters; `IntervalError` for another shape and for empty ones."""
    if parameters is None:
        return None
    p = interval(parameters)
    if p.ndim != 1 or p.is_empty.any():
        raise IntervalError(f"the parameters {p!r} are not a vector of nonempty intervals; give a list, shape (m,)")
    return p


def _inflated(
    f: System, X: Interval, start: Interval, parameters: Interval | None, rounds: int, tested: int
) -> KrawczykResult | None:
    """Test boxes enlarged around X; X holds every solution of the start box."""
    trial = X
    for k in range(rounds):
        trial = trial.inflate(0.1, 1e-300)
        step = image(f, trial.reshape(1, -1), parameters)
        K, status, reason = step.image[0], Status(int(step.status[0])), ""
        if status is Status.EMPTY:
            reason = "no solution: the image excludes an enlarged box"
        elif status is Status.UNIQUE and K.subset(start).all():
            reason = "exactly one solution: the image lies inside an enlarged box"
        elif status is Status.UNIQUE and K.disjoint(start).any():
            status, reason = Status.EMPTY, "no solution: the only one near lies outside the box"
        elif status is Status.UNIQUE:
            reason = "exactly one solution in an enlarged box, but it may lie outside the given one: see domain, image"
            status = Status.UNDECIDED
        if reason:
            box = step.box[0].intersect(start) if status is Status.UNIQUE else X
            return _report(status, step, box, trial, tested + k + 1, reason)
        if not step.guaranteed[0]:
            return None
        trial = K.hull(X) if (K.width < 4.0 * trial.width).all() else trial
    return None


def _report(status: Status, step: Image, box: Interval, domain: Interval, rounds: int, reason: str) -> KrawczykResult:
    box = Interval.empty(box.shape) if status is Status.EMPTY else box
    with np.errstate(all="ignore"):
        factor = (step.factor[0] @ domain.rad) / domain.rad
    contraction = float(np.max(factor)) if np.isfinite(factor).all() else float("inf")
    radius = spectral_radius(step.factor[0])
    return KrawczykResult(status, box, domain, step.image[0], radius, contraction, rounds, reason, step.exact_input)
