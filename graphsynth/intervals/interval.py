"""`Interval`: arrays of closed intervals with outward rounding.

An `Interval` holds two float64 arrays ``lo`` and ``hi`` of one shape.  Every operation returns bounds that hold all
exact results for all points of the arguments; rounding errors are included.  Empty is ``(inf, -inf)``; unbounded ends
are infinite; NaN is refused on input and never made.

Decorations record what an operation had to do: a clipped argument, a discontinuity, an input that was a float.  They
are carried through every further operation, so the last result tells whether a certificate may rest on it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from graphsynth.core.errors import FormatError, IntervalError
from graphsynth.intervals import operations
from graphsynth.intervals.guard import default_mode, in_default_mode
from graphsynth.intervals.measures import Measures, fill
from graphsynth.intervals.operations import Array, Flags, Mask
from graphsynth.intervals.reading import CLIPPED, NO_FLAGS, OF_FLOAT, OF_ONE, decimal_outward, read_bounds, read_points

_MOST = int(np.finfo(np.float64).max)
_EXACT = 2**53  # integers up to this are floats


def _both(*flags: Flags) -> Flags:
    result = flags[0]
    for flag in flags[1:]:
        if result is NO_FLAGS:
            result = flag
        elif flag is not result and flag is not NO_FLAGS:
            single = not (result.ndim or flag.ndim)
            result = OF_ONE[result.item() | flag.item()] if single else np.asarray(np.bitwise_or(result, flag))
    return result


def _operator(name: str, reverse: bool = False) -> Callable[[Interval, Any], Interval]:
    """Return the method of an operator: `Interval._binary`, with a short way for single intervals and numbers.

    What could be told in fewer lines is written out there: each look-up and call is a tenth of the time.
    """
    kernel: Callable[..., tuple[float, float]] | None = None
    divides = name == "divide"

    def operator(self: Interval, other: Any) -> Interval:
        nonlocal kernel
        kind, p, q = type(other), self._ends, None
        if kind is Interval:
            q, flags = other._ends, other._flags
        elif kind is int and -_EXACT <= other <= _EXACT:
            number = float(other)
            q, flags = (number, number), NO_FLAGS
        elif kind is float and other - other == 0.0:  # finite
            q, flags = (other, other), OF_FLOAT
        if p and q:
            if reverse:
                p, q = q, p
            if not divides or q[0] > 0.0 or q[1] < 0.0:
                kernel = kernel or operations.single(name)
                ends = kernel(p[0], p[1], q[0], q[1], 1.0)
                if ends[0] == ends[0]:  # else the processor is not in its default mode, which `_apply` sees to
                    result = _new(Interval)
                    own = self._flags
                    result._ends, result._flags = ends, flags if own is flags else _both(own, flags)
                    return result
        return self._binary(name, other, reverse)

    return operator


class Interval(Measures):
    """Array of closed intervals; immutable in use, arithmetic by operators with outward rounding.

    Parameters
    ----------
    value : number, str, Fraction, Decimal, Interval, or nested sequence or array of these
        One argument: points (or text with bounds, ``"[0.1, 0.2]"``, ``"17.5 +- 0.005"``).  Text, integers, fractions
        and decimals are enclosed exactly; floats are taken as they are and marked `Decoration.FLOAT_INPUT`.
    upper : the same, optional
        With two arguments ``value`` gives the lower and ``upper`` the upper bounds, rounded outward.  Floats are then
        meant as bounds and not marked; ``-inf`` and ``inf`` are allowed.

    Attributes
    ----------
    lo, hi : ndarray of float64
        Bounds, read-only; empty is ``(inf, -inf)``.
    flags : ndarray of uint8
        Decorations, of the shape of ``lo`` or a scalar for all.

    Raises
    ------
    IntervalError
        For NaN, reversed bounds, shapes that do not fit.
    FormatError
        For text or objects that are no numbers.

    Notes
    -----
    Guarantee: certified.  + - * /, squares and square roots give the tightest bounds for operands of any size;
    elementary functions at most one or two steps more; a power n at most 2 n steps more.  Every operation gives
    the same bits whatever floating-point mode the processor is in.  Source: theory/interval-tests 4; [Dekker 1971];
    Rump, Zimmermann, Boldo, Melquiond (2009); proofs in ``docs/explanation/intervals.md``.

    Examples
    --------
    >>> x = Interval("0.1")
    >>> x.contains(0.1), (x + x + x).contains("0.3")
    (True, True)
    >>> Interval(1, 2) / Interval(3, 4)
    Interval([0.25, 0.66666666666666675])
    """

    __slots__ = ()
    __array_ufunc__ = None  # numpy arrays leave mixed operations to this class
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: Any, upper: Any = None) -> None:
        if upper is None:
            lo, hi, flags = (value.lo, value.hi, value.flags) if isinstance(value, Interval) else read_points(value)
        else:
            lo, hi = read_bounds(value, upper)
            flags = NO_FLAGS
        fill(self, np.asarray(lo, dtype=np.float64), np.asarray(hi, dtype=np.float64), flags)

    def __reduce__(self) -> tuple[Any, ...]:
        return _make, (self.lo, self.hi, self.flags)

    @classmethod
    def from_bounds(cls, lo: ArrayLike, hi: ArrayLike) -> Interval:
        """Make intervals from float bounds; ``(inf, -inf)`` is the empty one, `FormatError` for what is no float.

        Examples
        --------
        >>> Interval.from_bounds([0.0, 1.0], [1.0, float("inf")]).width.tolist()
        [1.0, inf]
        """
        try:
            low, high = np.asarray(lo, dtype=np.float64), np.asarray(hi, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise FormatError(f"bounds that are no floats ({error}); give floats, or Interval(lower, upper)") from error
        return cls(low, high)

    @classmethod
    def midrad(cls, mid: Any, rad: Any) -> Interval:
        """Enclose ``mid - rad`` to ``mid + rad``; both exact text or numbers, or floats taken as they are.

        A negative radius is an `IntervalError`.

        Examples
        --------
        >>> Interval.midrad("17.5", "0.005")
        Interval([17.494999999999997, 17.505000000000003])
        """
        centre, radius = cls(mid), cls(rad)
        if bool((radius.lo < 0.0).any()):
            raise IntervalError(f"radius {rad!r} is negative; give a radius of at least 0")
        low, high = centre - radius, centre + radius
        return _make(low.lo, high.hi, low.flags)

    @classmethod
    def empty(cls, shape: int | tuple[int, ...] = ()) -> Interval:
        """Empty intervals."""
        return _full(shape, np.inf, -np.inf)

    @classmethod
    def entire(cls, shape: int | tuple[int, ...] = ()) -> Interval:
        """Intervals over the whole line."""
        return _full(shape, -np.inf, np.inf)

    @classmethod
    def zeros(cls, shape: int | tuple[int, ...] = ()) -> Interval:
        """Point intervals at 0."""
        return _full(shape, 0.0, 0.0)

    @classmethod
    def stack(cls, parts: Iterable[Interval], axis: int = 0) -> Interval:
        """Join intervals of one shape along a new axis; `IntervalError` for nothing to join, or no such axis."""
        if not isinstance(parts, Iterable):
            raise IntervalError(f"{parts!r} is no list of intervals; give a list")
        parts = [interval(part) for part in parts]
        if not parts:
            raise IntervalError("nothing to stack; give one interval at least")
        common_shape = operations.common_shape(*[p.lo for p in parts])
        if not isinstance(axis, int | np.integer) or not -len(common_shape) - 1 <= axis <= len(common_shape):
            raise IntervalError(f"axis = {axis!r} is none of the axes 0 to {len(common_shape)}")
        lo, hi = np.broadcast_arrays(*[p.lo for p in parts]), np.broadcast_arrays(*[p.hi for p in parts])
        flags = NO_FLAGS
        if any(p.flags is not NO_FLAGS for p in parts):
            flags = np.stack([np.broadcast_to(p.flags, low.shape) for p, low in zip(parts, lo)], axis)
        return _make(np.stack(lo, axis), np.stack(hi, axis), flags)

    def __len__(self) -> int:
        return len(self.lo)

    def __getitem__(self, key: Any) -> Interval:
        flags = self.flags if self.flags.ndim == 0 else np.asarray(self.flags[key])
        return _make(np.asarray(self.lo[key]), np.asarray(self.hi[key]), flags)

    def __iter__(self) -> Any:
        return (self[k] for k in range(len(self)))

    def reshape(self, *shape: int) -> Interval:
        """Return the same intervals in another shape; `IntervalError` for one of another size."""
        try:
            lo, hi = self.lo.reshape(*shape), self.hi.reshape(*shape)
        except (TypeError, ValueError, OverflowError) as error:
            raise IntervalError(
                f"{self.size} intervals do not fit shape {shape} ({error}); give one of as many"
            ) from None
        return _make(lo, hi, self.flags if self.flags.ndim == 0 else self.flags.reshape(*shape))

    def sum(self, axis: int | None = None) -> Interval:
        """Sum along an axis (all for None), added in order, so independent of threads.

        An axis that there is not is an `IntervalError`.
        """
        if axis is None:
            return self.reshape(-1).sum(0)
        if not isinstance(axis, int | np.integer) or not -self.ndim <= axis < self.ndim:
            raise IntervalError(
                f"axis = {axis!r} is none of the {self.ndim} axes of shape {self.shape}; give one, or None"
            )
        moved = [np.moveaxis(a, axis, 0) for a in (self.lo, self.hi)]
        total = Interval.zeros(moved[0].shape[1:])
        for lo, hi in zip(*moved):
            total = total + _make(lo, hi)
        flags = self.flags if self.flags.ndim == 0 else np.asarray(np.bitwise_or.reduce(self.flags, axis=axis))
        return _make(total.lo, total.hi, flags)

    def dot(self, other: Any) -> Interval:
        """Sum of products over the last axis of both.

        Examples
        --------
        >>> Interval([1, 2]).dot(Interval(["0.5", "0.25"]))
        Interval([1, 1])
        """
        product: Interval = self * other
        return product.sum(-1)

    def times(self, other: Interval) -> Interval:
        """Products of matrices (N, n, n) with matrices or vectors (N, n), added in order."""
        if other.ndim < self.ndim:
            return (self * other.reshape(*other.shape[:-1], 1, other.shape[-1])).sum(-1)
        total = self[..., :, 0:1] * other[..., 0:1, :]
        for k in range(1, self.shape[-1]):
            total = total + self[..., :, k : k + 1] * other[..., k : k + 1, :]
        return total

    def _beside(self, other: Any) -> Interval:
        """Read the other operand; its shape must fit."""
        read: Interval = interval(other)
        operations.common_shape(self.lo, read.lo)
        return read

    @in_default_mode
    def certainly_less(self, other: Any) -> Mask:
        """Whether every point lies below every point of the other; true for an empty one."""
        other = self._beside(other)
        return np.asarray((self.hi < other.lo) | self.is_empty | other.is_empty)

    @in_default_mode
    def certainly_less_equal(self, other: Any) -> Mask:
        """Whether no point lies above a point of the other; true for an empty one."""
        other = self._beside(other)
        return np.asarray((self.hi <= other.lo) | self.is_empty | other.is_empty)

    @in_default_mode
    def possibly_less(self, other: Any) -> Mask:
        """Whether some point lies below some point of the other."""
        other = self._beside(other)
        return np.asarray((self.lo < other.hi) & ~self.is_empty & ~other.is_empty)

    def possibly_equal(self, other: Any) -> Mask:
        """Whether they have a point in common."""
        return ~self.intersect(other).is_empty

    @in_default_mode
    def subset(self, other: Any) -> Mask:
        """Whether inside the other; the empty one always is."""
        other = self._beside(other)
        return np.asarray(self.is_empty | ((other.lo <= self.lo) & (self.hi <= other.hi)))

    @in_default_mode
    def interior(self, other: Any) -> Mask:
        """Whether inside the interior of the other, in the topology of the line."""
        other = self._beside(other)
        left = (other.lo < self.lo) | ((other.lo == -np.inf) & (self.lo == -np.inf))
        right = (self.hi < other.hi) | ((other.hi == np.inf) & (self.hi == np.inf))
        return np.asarray(self.is_empty | (left & right))

    def disjoint(self, other: Any) -> Mask:
        """Whether without a common point."""
        return self.intersect(other).is_empty

    @in_default_mode
    def equal(self, other: Any) -> Mask:
        """Whether the bounds are the same."""
        other = self._beside(other)
        return np.asarray((self.lo == other.lo) & (self.hi == other.hi))

    @in_default_mode
    def intersect(self, other: Any) -> Interval:
        """Return the common part."""
        other = self._beside(other)
        lo, hi = np.maximum(self.lo, other.lo), np.minimum(self.hi, other.hi)
        void = lo > hi
        return _make(np.where(void, np.inf, lo), np.where(void, -np.inf, hi), _both(self.flags, other.flags))

    @in_default_mode
    def hull(self, other: Any) -> Interval:
        """Return the smallest interval around both."""
        other = self._beside(other)
        return _make(np.minimum(self.lo, other.lo), np.maximum(self.hi, other.hi), _both(self.flags, other.flags))

    @in_default_mode
    def inflate(self, relative: float = 0.1, absolute: float = 0.0) -> Interval:
        """Widen both ends by ``relative`` times the radius plus ``absolute``, and at least one step.

        `IntervalError` for a number that is negative or not finite.
        """
        for name, value in (("relative", relative), ("absolute", absolute)):
            if not isinstance(value, int | float | np.number) or not 0.0 <= value <= _MOST:
                raise IntervalError(f"{name} = {value!r} must be a finite number of zero or more; correct the value")
        radius = self.rad
        radius = np.where(np.isfinite(radius), radius, 0.0)  # an infinite end stays where it is, the empty set too
        grow = _make(0.0, relative) * _make(radius, radius) + _make(absolute, absolute) + _make(5e-324, 5e-324)
        return _make((self - grow).lo, (self + grow).hi, self.flags)

    @in_default_mode
    def bisect(self) -> tuple[Interval, Interval]:
        """Cut at the midpoint; both halves hold it, those of the empty set are empty."""
        mid = self.mid
        void = self.is_empty
        low, high = np.where(void, -np.inf, mid), np.where(void, np.inf, mid)
        return _make(self.lo, low, self.flags), _make(high, self.hi, self.flags)

    def _binary(self, name: str, other: Any, reverse: bool = False) -> Interval:
        try:
            other = interval(other)
        except TypeError:
            return NotImplemented  # type: ignore[no-any-return]
        a, b = (other, self) if reverse else (self, other)
        result = _apply(name, a, b)
        return _mark(result, _hold_zero, b) if name == "divide" else result

    __add__ = __radd__ = _operator("add")
    __sub__, __rsub__ = _operator("subtract"), _operator("subtract", reverse=True)
    __mul__ = __rmul__ = _operator("multiply")
    __truediv__, __rtruediv__ = _operator("divide"), _operator("divide", reverse=True)

    def __neg__(self) -> Interval:
        if ends := self._ends:
            return _make_single((-ends[1], -ends[0]), self._flags)
        return _make(-self.hi, -self.lo, self.flags)

    def __pos__(self) -> Interval:
        return self

    def __abs__(self) -> Interval:
        if (ends := self._ends) and (ends[0] > 0.0 or ends[1] < 0.0):  # the empty one too
            return self if ends[0] > 0.0 else -self
        return self._larger_sides()

    @in_default_mode
    def _larger_sides(self) -> Interval:
        """Absolute values of any intervals."""
        void = self.is_empty
        lo, hi = np.maximum(np.maximum(self.lo, -self.hi), 0.0), np.maximum(-self.lo, self.hi)
        return _make(np.where(void, np.inf, lo), np.where(void, -np.inf, hi), self.flags)

    def __pow__(self, exponent: int) -> Interval:
        if not isinstance(exponent, int) and not isinstance(exponent, np.integer):
            raise IntervalError(f"exponent {exponent!r} is not an integer; use exp(b * log(a)) for other powers")
        if exponent == 2:
            return self.sqr()
        if abs(power := int(exponent)) >= 2**31:
            raise IntervalError(f"exponent {exponent} is too large; powers of at most 2^31 - 1 are taken")
        result = _apply("power", self, extra=(power,))
        return _mark(result, _hold_zero, self) if power < 0 else result

    def sqr(self) -> Interval:
        """Square: never negative, and tighter than ``x * x``."""
        return _apply("square", self)

    def sqrt(self) -> Interval:
        """Square root; a negative part of the argument is clipped and recorded."""
        root = _apply("root", self)
        return root if (ends := self._ends) and ends[0] > 0.0 else _mark(root, lambda lo, hi: lo < 0.0, self)

    def __eq__(self, other: object) -> Any:
        raise TypeError("intervals have no ==; use equal, certainly_less, possibly_equal or subset")

    def __bool__(self) -> bool:
        raise TypeError("an Interval is neither true nor false; use is_empty, contains or a comparison")

    def __repr__(self) -> str:
        if self.ndim == 0:
            return f"Interval({_one(float(self.lo), float(self.hi))})"
        if self.size <= 12 and self.ndim == 1:
            return f"Interval([{', '.join(_one(a, b) for a, b in zip(self.lo.tolist(), self.hi.tolist()))}])"
        return f"<Interval array of shape {self.shape}, mid about {self.mid.ravel()[:3].tolist()}...>"


def _one(lo: float, hi: float) -> str:
    return "empty" if lo > hi else f"[{decimal_outward(lo, -1)}, {decimal_outward(hi, 1)}]"


def _apply(name: str, x: Interval, y: Interval | None = None, extra: tuple[Any, ...] = ()) -> Interval:
    """Run a compiled operation over one or two broadcast arguments; decorations of both are joined."""
    p: tuple[float, ...] | None = x._ends
    q, flags = ((), x._flags) if y is None else (y._ends, _both(x._flags, y._flags))
    if p and q is not None:
        kernel, bounds = operations.single(name), (*p, *q, *extra, 1.0)
        ends = kernel(*bounds)
        if ends[0] != ends[0]:  # the processor is not in its default mode
            with default_mode():
                ends = kernel(*bounds)
        return _make_single(ends, flags)
    return _make(*operations.run(name, *_sides(x, y), extra=extra), flags)


@in_default_mode
def _mark(
    result: Interval, where: Callable[..., Any], x: Interval, y: Interval | None = None, mark: np.uint8 = CLIPPED
) -> Interval:
    """Record that arguments were clipped, or crossed a discontinuity, where ``where(lo, hi, ...)`` of them holds."""
    if ends := result._ends:
        found = where(*(x._ends or ()), *((y is not None and y._ends) or ()))
        return _make_single(ends, _both(result._flags, OF_ONE[mark])) if found else result
    found = where(*_sides(x, y))
    if not found.any():
        return result
    return _make(result.lo, result.hi, np.asarray(np.bitwise_or(result.flags, np.where(found, mark, np.uint8(0)))))


def _sides(x: Interval, y: Interval | None) -> tuple[Array, ...]:
    return (x.lo, x.hi) if y is None else (x.lo, x.hi, y.lo, y.hi)


def _hold_zero(lo: Any, hi: Any) -> Any:
    return (lo <= 0.0) & (hi >= 0.0)


_new = object.__new__  # looked up once


def _make_single(ends: tuple[float, float], flags: Flags) -> Interval:
    """Make one interval from bounds known to be right."""
    result = _new(Interval)
    result._ends, result._flags = ends, flags
    return result


def _make(lo: ArrayLike, hi: ArrayLike, flags: Flags = NO_FLAGS) -> Interval:
    """Make an interval from bounds known to be right; views of others' arrays are not frozen."""
    result = _new(Interval)
    fill(result, np.asarray(lo, dtype=np.float64).view(), np.asarray(hi, dtype=np.float64).view(), flags)
    return result


def _full(shape: int | tuple[int, ...], lo: float, hi: float) -> Interval:
    try:
        if shape is None:  # older numpy takes it for (), with a warning
            raise TypeError("None is no shape")
        return _make(np.full(shape, lo), np.full(shape, hi))
    except (TypeError, ValueError, OverflowError, MemoryError) as error:
        raise IntervalError(
            f"shape = {str(shape)[:60]} cannot be one ({error}); give whole numbers, zero or more"
        ) from None


def interval(value: Any) -> Interval:
    """Return an `Interval` as it is; take anything else as points.

    `TypeError` for a type that brings its own arithmetic, so that Python asks it instead.
    """
    if isinstance(value, Interval):
        return value
    if type(value) is int and -_EXACT <= value <= _EXACT:
        number = float(value)
        return _make_single((number, number), NO_FLAGS)
    if type(value) is float and value - value == 0.0:  # finite
        return _make_single((value, value), OF_FLOAT)
    if hasattr(value, "__interval_priority__"):
        raise TypeError
    return Interval(value)
