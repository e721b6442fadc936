"""Constant-orientation workspace of the platform: exact boundary of circular arcs, area, perimeter, joint limits."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, finite_array, not_negative, three
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import BoundaryCircle, Limits, leg_circles, meet, poses_at, working_mode
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

#: Circles closer to tangency than this fraction of the largest length are treated and reported as tangent.
TOLERANCE = 1e-12


class Arc(NamedTuple):
    """A piece of the boundary: ``circle`` counter-clockwise from angle ``start`` to ``stop`` (ascending)."""

    circle: BoundaryCircle
    start: float
    stop: float

    @checked
    def point(self, t: ArrayLike) -> NDArray[np.complex128]:
        """Points of the circle at angles ``t``."""
        return np.asarray(self.circle.centre + self.circle.radius * np.exp(1j * finite_array("t", t, nan=True)))

    @property
    def length(self) -> float:
        """Length of the arc."""
        return self.circle.radius * (self.stop - self.start)

    @property
    def ends(self) -> tuple[complex, complex]:
        """First and last point in the direction that has the workspace on the left."""
        first, last = complex(self.point(self.start)), complex(self.point(self.stop))
        return (last, first) if self.circle.sense < 0 else (first, last)


class Contact(NamedTuple):
    """Two boundary circles that touch or coincide (within the tolerance).

    ``points`` holds the point of tangency (empty for coincident circles); ``on_workspace`` tells whether it belongs to
    the workspace.
    """

    kind: str
    first: BoundaryCircle
    second: BoundaryCircle
    points: tuple[complex, ...]
    on_workspace: bool


@dataclass(frozen=True, eq=False)
class Workspace:
    """Positions that the platform reaches at one orientation.

    Exact but for rounding, unless ``contacts`` reports circles that touch: there the arcs depend on the last digits.

    * `sigma`: working mode of the joint limits; None without limits (the workspace is then the same for all modes).
    * `limits`: range of each rocker angle, or None.
    * `arcs`: the boundary, with leg and side of every piece.
    * `area`, `perimeter`: length^2 and length.  A workspace that has shrunk to a curve has area 0 and its length as
      perimeter.
    * `loops`: arcs (indices) in order around each closed boundary.
    * `isolated`: single points that belong to the workspace but to no arc.
    * `dimension`: 2, or 1 for a curve, 0 for single points, -1 if the workspace is empty.
    * `tolerance`: distance below which circles count as touching, length.
    """

    platform: ParallelPlatform
    alpha: float
    sigma: tuple[int, ...] | None
    limits: tuple[Limits, ...]
    arcs: tuple[Arc, ...]
    area: float
    perimeter: float
    loops: tuple[tuple[int, ...], ...]
    components: int
    holes: int
    isolated: tuple[complex, ...]
    contacts: tuple[Contact, ...]
    dimension: int
    tolerance: float

    @property
    def empty(self) -> bool:
        """True if no position is reachable."""
        return self.dimension < 0

    @checked
    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which positions (complex, any shape) belong to the workspace, its boundary included.

        Decided by the signs of compensated sums for the vertices as computed, not by a tolerance.
        """
        found = self.platform.inverse(poses_at(points, self.alpha), self.sigma or (1, 1, 1))
        inside = (found.deficit <= 0.0).all(axis=-1)
        for k, bounds in enumerate(self.limits):
            if bounds is not None:
                inside &= np.mod(found.theta[..., k] - bounds[0], math.tau) <= bounds[1] - bounds[0]
        return np.asarray(inside)

    def box(self) -> tuple[float, float, float, float]:
        """Smallest rectangle around the workspace, ``(x_min, x_max, y_min, y_max)``; NaN if it is empty."""
        points = [*self.isolated]
        for arc in self.arcs:
            quarters = np.arange(math.ceil(arc.start / (math.pi / 2)), arc.stop / (math.pi / 2)) * (math.pi / 2)
            points += list(arc.point(np.concatenate([[arc.start, arc.stop], quarters])))
        x, y = np.real(points or [math.nan]), np.imag(points or [math.nan * 1j])
        return float(x.min()), float(x.max()), float(y.min()), float(y.max())


@checked
def constant_orientation_workspace(
    platform: ParallelPlatform,
    alpha: float,
    *,
    sigma: Sequence[int] | None = None,
    limits: Sequence[Limits] | None = None,
    tolerance: float = TOLERANCE,
) -> Workspace:
    """Workspace at a fixed orientation: the intersection of three annuli, as circular arcs.

    `alpha`: orientation, radians. `sigma` (of {+1, -1}): working mode; needed with ``limits``, without effect
    otherwise. `limits`: ranges of the rocker angles theta_k, radians, ``low < high < low + 2 pi``.  The boundary stays
    made of arcs. `tolerance`: circles closer to touching than this fraction of the largest length are reported as
    contacts. Raises `GeometryError`: limits without a working mode, an empty range, or limits on a leg with a link of
    length zero. See theory/platform-workspace 1; a rocker at its limit adds the circle of radius l2 about its end.

    >>> work = constant_orientation_workspace(ParallelPlatform.mock(), 0.0)
    >>> round(work.area, 6), round(work.perimeter, 9), sorted({arc.circle.side for arc in work.arcs})
    (3808.301448, 239.558260217, ['outer'])
    """
    alpha = finite("alpha", alpha)
    mode, bounds = _checked(platform, sigma, limits)
    circles = leg_circles(platform, alpha, mode, bounds)
    scale = max(max(c.radius for c in circles), max(abs(c.centre - circles[0].centre) for c in circles))
    problem = _Problem(platform, circles, mode, bounds, not_negative("tolerance", tolerance) * scale)
    thin = problem.thin()
    arcs = problem.arcs() if thin is None else problem.curve(thin)
    isolated = problem.isolated(arcs)
    loops = () if thin is not None else _chain(arcs)
    signed = [sum(_sector(arcs[i], circles[0].centre) for i in loop) for loop in loops]
    dimension = (2 if thin is None else 1) if arcs else (0 if isolated else -1)
    perimeter, holes = math.fsum(arc.length for arc in arcs), sum(part < 0.0 for part in signed)
    components = sum(part > 0.0 for part in signed) if thin is None else 0
    sizes, points = (math.fsum(signed), perimeter, loops, components, holes), (tuple(isolated), tuple(problem.contacts))
    return Workspace(platform, alpha, mode, bounds, tuple(arcs), *sizes, *points, dimension, problem.tolerance)


def _checked(
    platform: ParallelPlatform, sigma: Sequence[int] | None, limits: Sequence[Limits] | None
) -> tuple[tuple[int, ...] | None, tuple[Limits, ...]]:
    mode = None if sigma is None else working_mode(sigma)
    limits = (None, None, None) if limits is None else three("limits", limits)
    if all(bound is None for bound in limits):
        return None, limits
    if mode is None:
        raise GeometryError("limits of the rocker angles need a working mode; give sigma")
    for leg, bound in enumerate(limits, start=1):
        if bound is None:
            continue
        pair = finite_array(f"limits of leg {leg}", bound)
        if pair.shape != (2,):
            raise GeometryError(f"limits of leg {leg} = {bound!r} are no pair; give (low, high) or None")
        low, high = pair
        if not low < high < low + math.tau:
            raise GeometryError(f"limits ({low}, {high}) of leg {leg} must satisfy low < high < low + 2 pi")
        if min(platform.l1[leg - 1], platform.l2[leg - 1]) == 0.0:
            raise GeometryError(f"leg {leg} has a link of length zero: its rocker angle has no limits to apply")
    return mode, limits


class _Problem:
    """The circles of one workspace, their common points, and the tests on points of a circle."""

    def __init__(
        self,
        platform: ParallelPlatform,
        circles: list[BoundaryCircle],
        sigma: tuple[int, ...] | None,
        limits: tuple[Limits, ...],
        tolerance: float,
    ) -> None:
        self.platform, self.circles, self.sigma, self.limits = platform, circles, sigma, limits
        self.tolerance = tolerance
        self.annuli = {c.leg: c.centre for c in circles if c.side == "outer"}
        self.cuts: list[list[complex]] = [[] for _ in circles]
        self.copies: dict[int, int] = {}  # circle -> an earlier one that coincides with it
        self.opposed: int | None = None  # a circle that coincides with one of the opposite sense
        self.contacts: list[Contact] = []
        for (i, a), (j, b) in combinations(enumerate(circles), 2):
            kind, points = meet(a, b, tolerance)
            self.cuts[i] += points
            self.cuts[j] += points
            if kind in ("tangent", "coincident") and a.leg != b.leg:
                on = any(self._near(point) for point in points) or kind == "coincident"
                self.contacts.append(Contact(kind, a, b, points, on))
            if kind == "coincident":
                if a.sense == b.sense:
                    self.copies[j] = i
                elif {a.side, b.side} <= {"outer", "inner"}:
                    self.opposed = i

    def thin(self) -> int | None:
        """Index of a circle that holds the whole workspace, if there is one."""
        for i, c in enumerate(self.circles):
            if c.side == "outer" and min(self.platform.l1[c.leg - 1], self.platform.l2[c.leg - 1]) == 0.0:
                return i
        return self.opposed

    def _allows(self, leg: int, p: complex, slack: float = 0.0) -> bool:
        """Whether a leg reaches the position p within its limits."""
        k = leg - 1
        l1, l2 = self.platform.l1[k], self.platform.l2[k]
        w = p - self.annuli[leg]
        rho = abs(w)
        if not abs(l1 - l2) - slack <= rho <= l1 + l2 + slack:
            return False
        bounds = self.limits[k]
        if bounds is None or self.sigma is None:
            return True
        cosine = (rho * rho + l1 * l1 - l2 * l2) / (2.0 * l1 * rho) if rho else 0.0
        theta = cmath.phase(w) + self.sigma[k] * math.acos(min(1.0, max(-1.0, cosine)))
        return _between(theta, bounds, slack / l1)

    def _near(self, p: complex) -> bool:
        return all(self._allows(leg, p, 4.0 * self.tolerance) for leg in (1, 2, 3))

    def _own(self, circle: BoundaryCircle, p: complex) -> bool:
        """Whether a point of a leg's own circle bounds that leg's reach in this working mode."""
        k = circle.leg - 1
        bounds = self.limits[k]
        if bounds is None or self.sigma is None:
            return True
        w = p - self.annuli[circle.leg]
        if circle.side in ("outer", "inner"):
            back = circle.side == "inner" and self.platform.l1[k] < self.platform.l2[k]
            return _between(cmath.phase(w) + (math.pi if back else 0.0), bounds, 0.0)
        lag = cmath.phase(p - circle.centre) - circle.angle
        return self.sigma[k] * math.sin(lag) < 0.0

    def _pieces(self, i: int) -> list[Arc]:
        circle = self.circles[i]
        angles = sorted(cmath.phase(p - circle.centre) % math.tau for p in self.cuts[i])
        if not angles:
            return [Arc(circle, 0.0, math.tau)]
        return [Arc(circle, a, b) for a, b in zip(angles, [*angles[1:], angles[0] + math.tau]) if b > a]

    def arcs(self) -> list[Arc]:
        """Pieces of the circles that bound the workspace."""
        kept = []
        for i, circle in enumerate(self.circles):
            if i in self.copies:
                continue
            others = [leg for leg in (1, 2, 3) if leg != circle.leg]
            same = [self.circles[j].leg for j, first in self.copies.items() if first == i]
            for arc in self._pieces(i):
                middle = complex(arc.point(0.5 * (arc.start + arc.stop)))
                if not self._own(circle, middle):
                    continue
                if all(self._allows(leg, middle, self.tolerance if leg in same else 0.0) for leg in others):
                    kept.append(arc)
        return kept

    def curve(self, i: int) -> list[Arc]:
        """Pieces of circle i that are the whole workspace."""
        pieces = self._pieces(i) if self.circles[i].radius > 0.0 else []
        return [arc for arc in pieces if self._near(complex(arc.point(0.5 * (arc.start + arc.stop))))]

    def isolated(self, arcs: list[Arc]) -> list[complex]:
        """Find common points of circles that belong to the workspace but to no arc."""
        points = [p for cut in self.cuts for p in cut]
        points += [c.centre for c in self.circles if c.radius == 0.0]
        ends = [complex(arc.point(t)) for arc in arcs for t in (arc.start, arc.stop)]
        near = max(1e-6 * max(c.radius for c in self.circles), 4.0 * self.tolerance)

        def on(arc: Arc, p: complex) -> bool:
            away = p - arc.circle.centre
            turn = (cmath.phase(away) - arc.start) % math.tau
            return abs(abs(away) - arc.circle.radius) <= 8.0 * self.tolerance and turn <= arc.stop - arc.start

        found: list[complex] = []
        for p in points:
            known = any(abs(p - q) <= near for q in [*ends, *found])
            if self._near(p) and not known and not any(on(arc, p) for arc in arcs):
                found.append(p)
        return found


def _between(angle: float, bounds: tuple[float, float], slack: float) -> bool:
    return (angle - bounds[0] + slack) % math.tau <= bounds[1] - bounds[0] + 2.0 * slack


def _sector(arc: Arc, origin: complex) -> float:
    """Signed area between the arc and ``origin`` (Green's theorem)."""
    c, R, t0, t1 = arc.circle.centre - origin, arc.circle.radius, arc.start, arc.stop
    chord = c.real * (math.sin(t1) - math.sin(t0)) - c.imag * (math.cos(t1) - math.cos(t0))
    return 0.5 * arc.circle.sense * (R * R * (t1 - t0) + R * chord)


def _chain(arcs: list[Arc]) -> tuple[tuple[int, ...], ...]:
    """Arcs in order around each closed boundary."""
    ends = [arc.ends for arc in arcs]
    left = set(range(len(arcs)))
    loops = []
    while left:
        loop = [min(left)]
        left.discard(loop[0])
        while left:
            here, home = ends[loop[-1]][1], ends[loop[0]][0]
            following = min(left, key=lambda i: abs(ends[i][0] - here))
            if abs(home - here) <= abs(ends[following][0] - here):
                break
            loop.append(following)
            left.discard(following)
        loops.append(tuple(loop))
    return tuple(loops)
