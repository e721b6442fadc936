"""The four-bar linkage of the braider in a form that keeps its digits when the linkage is nearly flat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite_array, positive
from graphsynth.core.errors import GeometryError, SpecError

Array = NDArray[np.float64]


class FourBarState(NamedTuple):
    """Coupler and rocker at crank angles theta: angles (rad), first and second derivatives by theta; NaN out of reach.

    ``crank``, ``coupler``, ``rocker`` are the vectors O1A, AB and O2B as complex numbers, m.
    """

    phi2: Array
    phi3: Array
    k2: Array
    k3: Array
    f2: Array
    f3: Array
    crank: NDArray[np.complex128]
    coupler: NDArray[np.complex128]
    rocker: NDArray[np.complex128]


@dataclass(frozen=True)
class ChangePoint:
    """Crank angle at which all links lie on one line: both assembly modes meet, each with its own velocity ratios.

    ``ratios[branch]`` is ``(k2, k3)`` of the mode ``branch`` in {+1, -1}, taken from ``theta`` decreasing towards the
    point; a motion that goes on smoothly leaves in the other mode.  ``tolerance`` (m) decided that the sums of the
    lengths are equal.
    """

    theta: float
    ratios: dict[int, tuple[float, float]]
    tolerance: float


@dataclass(frozen=True)
class FourBar:
    """Crank O1A, coupler AB, rocker BO2, frame O1O2 along +x; lengths in m, positive (theory/braider 2, 8).

    Parameters
    ----------
    crank, coupler, rocker, frame : float
    branch : {+1, -1}
        Assembly mode: B lies to the left (+1) or right of the line from A to O2.

    Raises
    ------
    GeometryError
        A length that is not positive and between 1e-60 and 1e60, or another branch.

    Examples
    --------
    >>> state = FourBar().motion(np.pi / 3)
    >>> round(float(state.k2), 15), round(float(state.k3), 15)
    (-0.142857142857143, 0.357142857142857)
    """

    crank: float = 0.020
    coupler: float = 0.060
    rocker: float = 0.040
    frame: float = 0.060
    branch: int = 1

    def __post_init__(self) -> None:
        for name in ("crank", "coupler", "rocker", "frame"):
            try:
                object.__setattr__(self, name, positive(name, getattr(self, name), SpecError))
            except SpecError as error:
                raise GeometryError(str(error)) from None
        check_fields(self, ("crank", "coupler", "rocker", "frame"))
        if not isinstance(self.branch, int | float) or self.branch not in (1, -1):
            raise GeometryError(f"branch = {self.branch!r} must be +1 or -1")

    @property
    def tolerance(self) -> float:
        """Difference of lengths (m) below which their sums count as equal: four units in the last place."""
        return 4.0 * math.ulp(max(self.crank + self.frame, self.coupler + self.rocker))

    @property
    def excess(self) -> tuple[float, float]:
        """``b + c - a - g`` (m) and ``(g - a)^2 - (b - c)^2`` (m^2), rounded once, zero within `tolerance`."""
        a, b, c, g = self.crank, self.coupler, self.rocker, self.frame
        far = math.fsum((b, c, -a, -g))
        low, high = math.fsum((g, -a, -b, c)), math.fsum((g, -a, b, -c))
        cut = self.tolerance
        far, low, high = (0.0 if abs(x) <= cut else x for x in (far, low, high))
        return far, low * high

    def motion(self, theta: ArrayLike) -> FourBarState:
        """Angles and derivatives at crank angles ``theta`` (rad, any shape).

        First derivatives keep their digits up to a change point; second derivatives are differences divided by the
        sine that vanishes there.
        """
        angle = finite_array("theta", theta, nan=True)
        k2, k3, f2, f3, *ends = self.table(angle)[3:11]
        coupler, rocker = ends[0] + 1j * ends[1], ends[2] + 1j * ends[3]
        crank = np.asarray(self.crank * (np.cos(angle) + 1j * np.sin(angle)))
        phi2, phi3 = np.asarray(np.angle(coupler)), np.asarray(np.angle(rocker))
        return FourBarState(phi2, phi3, k2, k3, f2, f3, crank, np.asarray(coupler), np.asarray(rocker))

    def parameters(self, more: Sequence[float] = (0.0,) * 11) -> Array:
        """Parameters of the kernel `four_bar`; ``more`` are those between the branch and the excesses."""
        return np.array([self.crank, self.coupler, self.rocker, self.frame, self.branch, *more, *self.excess])

    def table(self, theta: Array, more: Sequence[float] = (0.0,) * 11) -> Array:
        """Return what the kernel `four_bar` gives, along the first axis, at crank angles of any shape."""
        from graphsynth.dynamics.driven.kernels import systems as s

        values, found = np.zeros(s.SIZE), np.zeros((theta.size, 16))
        values[s.LINKAGE :] = self.parameters(more)
        setup = np.array([s.FOUR_BAR, s.LINEAR, s.INERTIA, 0, 1])
        s.tabulate(setup, theta.ravel(), values, np.zeros((1, 1)), found)
        return found.T.reshape(16, *theta.shape)

    def reach(self) -> tuple[tuple[float, float], ...]:
        """Return the closed arcs of crank angles (rad) that can be assembled; ``(-pi, pi)`` for a full turn."""
        a, b, c, g = self.crank, self.coupler, self.rocker, self.frame
        far, near = self.excess
        # cos(theta/2)^2 >= low,  sin(theta/2)^2 >= high
        low, high = -far * (a + b + c + g) / (4.0 * a * g), -near / (4.0 * a * g)
        if low > 1.0 or high > 1.0:
            return ()
        outer = math.pi if low <= 0.0 else 2.0 * math.acos(math.sqrt(low))
        inner = 0.0 if high <= 0.0 else 2.0 * math.asin(math.sqrt(high))
        if inner > outer:
            return ()
        return ((-outer, outer),) if inner == 0.0 else ((-outer, -inner), (inner, outer))

    @property
    def turns_fully(self) -> bool:
        """Whether the crank makes a whole turn, maybe through a change point."""
        return self.reach() == ((-math.pi, math.pi),)

    def change_points(self) -> tuple[ChangePoint, ...]:
        """All change points with both pairs of velocity ratios, from the loop equation of second order."""
        far, near = self.excess
        found = []
        if far == 0.0:
            found.append(self._change_point(math.pi, -1.0))
        if near == 0.0 and self.frame != self.crank:
            found.append(self._change_point(0.0, 1.0))
        return tuple(found)

    def _change_point(self, theta: float, side: float) -> ChangePoint:
        a, b, c, g = side * self.crank, self.coupler, self.rocker, self.frame
        # signs of the coupler and the rocker on the line: a + s2 b = g + s3 c
        s2, s3 = min(((p, q) for p in (1.0, -1.0) for q in (1.0, -1.0)), key=lambda s: abs(a + s[0] * b - g - s[1] * c))
        p, q = s2 * b, s3 * c
        # a + p k2 = q k3  and  a + p k2^2 = q k3^2
        lead, middle, last = p * (q - p), -2.0 * a * p, a * (q - a)
        root = math.sqrt(max(middle * middle - 4.0 * lead * last, 0.0))
        large = -0.5 * (middle + math.copysign(root, middle))
        pair = [large / lead, last / large] if large else [0.0, 0.0]
        near = FourBar(self.crank, b, c, g, 1).motion(theta - 1e-4)
        pair.sort(key=lambda k: abs(k - float(near.k2)))
        return ChangePoint(theta, {s: (k, (a + p * k) / q) for s, k in zip((1, -1), pair)}, self.tolerance)

    def rocker_range(self) -> tuple[float, float]:
        """Least and largest rocker angle (rad) over a full turn; the rocker reverses where crank and coupler align.

        Raises
        ------
        GeometryError
            If the crank does not turn fully, or modes meet on the way.
        """
        if not self.turns_fully or self.change_points():
            raise GeometryError("the crank does not turn fully in one mode; ask motion() within reach() instead")
        ends = []
        for reach in (self.coupler + self.crank, self.coupler - self.crank):
            cosine = (self.rocker**2 + self.frame**2 - reach**2) / (2.0 * self.rocker * self.frame)
            ends.append(self.branch * (math.pi - math.acos(cosine)))
        return min(ends), max(ends)
