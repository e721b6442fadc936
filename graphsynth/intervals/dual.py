"""`Dual`: a value with its derivatives, both in intervals; forward differentiation of formulas written once.

A formula made of operators and the functions of `graphsynth.intervals` takes intervals and duals alike.
Where a function is not differentiable but Lipschitz (``abs``, minimum, maximum) the derivative is an interval that
holds all its generalised gradients (Clarke), which by the mean value theorem of Lebourg is enough for Krawczyk's test.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from graphsynth.core.errors import GraphsynthError, IntervalError
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.interval import Interval, _make, interval


class Dual:
    """Value of shape S and derivatives of shape (n,) + S by n variables.

    Examples
    --------
    >>> x, y = variables(Interval([[1, 2]]))
    >>> (x * x * y).grad.mid[:, 0].tolist()
    [4.0, 1.0]
    """

    __slots__ = ("grad", "value")
    __array_ufunc__ = None
    __interval_priority__ = True
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: Interval, grad: Interval) -> None:
        self.value = value
        self.grad = grad

    def chain(self, value: Interval, slope: Interval) -> Dual:
        """Return a function of this with a given value and slope."""
        return Dual(value, slope * self.grad)

    def __add__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.grad + other.grad)
        return Dual(self.value + other, self.grad)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.grad)

    def __pos__(self) -> Dual:
        return self

    def __sub__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value - other.value, self.grad - other.grad)
        return Dual(self.value - other, self.grad)

    def __rsub__(self, other: Any) -> Dual:
        return Dual(other - self.value, -self.grad)

    def __mul__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, self.value * other.grad + other.value * self.grad)
        other = interval(other)
        return Dual(self.value * other, other * self.grad)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            other = interval(other)
            return Dual(self.value / other, self.grad / other)
        value = self.value / other.value
        return Dual(value, (self.grad - value * other.grad) / other.value)

    def __rtruediv__(self, other: Any) -> Dual:
        value = interval(other) / self.value
        return Dual(value, -(value / self.value) * self.grad)

    def __pow__(self, exponent: int) -> Dual:
        if not isinstance(exponent, int | np.integer):
            raise IntervalError(f"exponent {exponent!r} is not an integer; use exp(b * log(a)) for other powers")
        if exponent == 0:
            return self.chain(self.value**0, Interval(0))
        if exponent == 2:
            return self.sqr()
        return self.chain(self.value**exponent, (self.value ** (exponent - 1)) * int(exponent))

    def __abs__(self) -> Dual:
        lo = np.where(self.value.lo >= 0.0, 1.0, -1.0)
        hi = np.where(self.value.hi <= 0.0, -1.0, 1.0)
        return self.chain(abs(self.value), _make(np.minimum(lo, hi), np.maximum(lo, hi)))

    def sqr(self) -> Dual:
        """Square."""
        return self.chain(self.value.sqr(), self.value * 2)

    def sqrt(self) -> Dual:
        """Square root; without a bounded derivative where the argument reaches 0."""
        value = self.value.sqrt()
        return self.chain(value, 1 / (value * 2))


def variables(box: Interval) -> list[Dual]:
    """Return the unknowns of boxes of shape (N, n) as n duals of shape (N,) with unit derivatives.

    Parameters
    ----------
    box : Interval, shape (N, n)

    Returns
    -------
    list of Dual
        Of length n.

    Raises
    ------
    IntervalError
        One interval instead of a vector of them.
    """
    box = interval(box)
    if box.ndim == 0:
        raise IntervalError("one interval is no box; give a vector of them, shape (n,) or (N, n)")
    n = box.shape[-1]
    unit = np.eye(n).reshape((n, n) + (1,) * (box.ndim - 1))
    return [Dual(box[..., i], _make(unit[i], unit[i])) for i in range(n)]


def evaluate(
    f: Callable[..., Sequence[Any]], x: Sequence[Any], parameters: Interval | None, shape: tuple[int, ...]
) -> Sequence[Any]:
    """Return the equations at unknowns of a shape; parameters of shape (m,) or that shape + (m,)."""
    if not callable(f):
        raise IntervalError(f"the system {f!r} cannot be called; give a function that returns equations")
    if parameters is not None and (parameters.ndim == 0 or parameters.shape[:-1] not in ((), shape)):
        raise IntervalError(
            f"parameters of shape {parameters.shape} do not fit boxes of shape {shape}; give (m,) or a row for each"
        )
    values = () if parameters is None else ([parameters[..., j] for j in range(parameters.shape[-1])],)
    try:
        results = f(x, *values)
    except GraphsynthError:
        raise
    except Exception as error:
        raise IntervalError(
            f"the system cannot be evaluated with intervals ({error}); write it with operators and the functions of "
            "graphsynth.intervals, as f(x), or f(x, p) if there are parameters"
        ) from error
    if not isinstance(results, Sequence | np.ndarray | Interval):
        raise IntervalError(f"the system returns {results!r}; it must return a list of equations, one for each unknown")
    return results


def values_of(results: Sequence[Any], shape: tuple[int, ...]) -> Interval:
    """Stack the values of equations to shape S + (equations,)."""
    parts = [r.value if isinstance(r, Dual) else interval(r) for r in results]
    return Interval.stack([_spread(part, shape) for part in parts], axis=-1)


def jacobian_of(results: Sequence[Any], n: int, shape: tuple[int, ...]) -> Interval:
    """Stack the derivatives of equations to shape S + (equations, n)."""
    rows = []
    for result in results:
        grad = result.grad if isinstance(result, Dual) else Interval.zeros((n,) + (1,) * len(shape))
        rows.append(Interval.stack([_spread(grad[j], shape) for j in range(n)], axis=-1))
    return Interval.stack(rows, axis=-2)


def jacobian(f: Callable[..., Sequence[Any]], box: Any, parameters: Any = None) -> tuple[Interval, Interval]:
    """Enclose a system and its derivatives over boxes.

    Parameters
    ----------
    f : callable
        ``f(x)`` or ``f(x, p)``, written with operators and the functions of `graphsynth.intervals`; any number of
        equations.
    box : Interval or anything it takes, shape (n,) or (N, n)
    parameters : Interval or anything it takes, shape (m,) or (N, m), optional

    Returns
    -------
    values : Interval, shape (equations,) or (N, equations)
    derivatives : Interval, shape (equations, n) or (N, equations, n)
        Certified; where ``guaranteed`` is False something was undefined or discontinuous, and no mean value theorem
        holds over the box.

    Examples
    --------
    >>> values, slopes = jacobian(lambda x: [x[0] * x[1], x[0] ** 2], ["[1, 2]", 3])
    >>> values
    Interval([[3, 6], [1, 4]])
    >>> slopes[1, 0], slopes[0, 1]
    (Interval([2, 4]), Interval([1, 2]))
    """
    check_rounding()
    boxes = interval(box)
    unknowns, shape = variables(boxes), boxes.shape[:-1]
    results = evaluate(f, unknowns, None if parameters is None else interval(parameters), shape)
    return values_of(results, shape), jacobian_of(results, boxes.shape[-1], shape)


def _spread(part: Interval, shape: tuple[int, ...]) -> Interval:
    if part.shape == shape:
        return part
    flags = part.flags if part.flags.ndim == 0 else np.broadcast_to(part.flags, shape)
    return _make(np.broadcast_to(part.lo, shape), np.broadcast_to(part.hi, shape), flags)
