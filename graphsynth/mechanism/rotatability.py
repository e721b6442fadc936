"""Rotatability of a crank, decided exactly: Grashof's rule and the extremes of a reach, for integers and fractions.

A crank turns the pin of a dyad.  The dyad can be assembled while the reach of the pin stays within two bounds, so the
extremes of the reach over a turn decide.  Of a four-bar the reach is the distance of the pin from the rocker's pivot,
between ``|g - a|`` and ``g + a``, and the bounds are ``|b - c|`` and ``b + c`` (Grashof 1883).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite, whole
from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.mechanism.four_bar import Straightness, TiltedFourBar

Array = NDArray[np.float64]
_SAMPLES = 1440


@dataclass(frozen=True)
class FullTurn:
    """Whether a crank turns fully.

    Attributes
    ----------
    possible : bool
        True if the crank passes every angle on one branch.
    kind : {"full turn", "change point", "limited", "immovable", "never assembled"}
        "change point": the branches meet but the crank can pass; the branch after it is ambiguous.  "immovable": the
        linkage can only lie stretched, at one angle, which is its limit angle.
    limit_angles, change_angles : tuple of float
        Crank angles (radians, in [0, 2 pi)) of the dead points and of the change points.
    method : str
        "exact" (rational arithmetic on the given lengths) or "estimated" (sampled and refined).
    statement : str
        The result in one sentence.
    """

    possible: bool
    kind: str
    limit_angles: tuple[float, ...]
    change_angles: tuple[float, ...]
    method: str
    statement: str


def full_turn(linkage: TiltedFourBar) -> FullTurn:
    """See `TiltedFourBar.full_turn`."""
    if linkage.pin_height == 0.0:
        return _planar_turn(linkage)
    return _tilted_turn(linkage)


def _planar_turn(linkage: TiltedFourBar) -> FullTurn:
    """Compare the extremes of D with |l4 - l3| and l3 + l4 in exact arithmetic (theory/four-bar-and-tilt 3)."""
    l1, l2, l3, l4 = (Fraction(length) for length in (linkage.l1, linkage.l2, linkage.l3, linkage.l4))
    kind, touches, bounds = four_bar_rotation(l1 * l1, l2, l3, l4)
    if kind == "never assembled":
        return FullTurn(False, kind, (), (), "exact", "the linkage cannot be assembled at any crank angle")
    rotation = linkage.rotation  # about e_z, or a half turn about an axis in the plane: f is shifted or reversed
    phase, sense = math.atan2(rotation[1, 0], rotation[0, 0]), math.copysign(1.0, rotation[2, 2])
    changes = [angle for angle, met in zip((0.0, math.pi), touches) if met]
    limits: list[float] = []
    for _, reach in bounds:
        half = (reach * reach - (l1 - l2) ** 2) / (4 * l1 * l2)  # sin^2(f/2)
        angle = 2.0 * math.atan2(math.sqrt(half), math.sqrt(1 - half))
        limits += [angle, -angle] if 0 < half < 1 else [angle]
    limits_t = tuple(sorted(sense * (angle - phase) % math.tau for angle in limits))
    changes_t = tuple(sorted(sense * (angle - phase) % math.tau for angle in changes))
    if kind == "immovable":
        text = f"nothing moves: the linkage can only lie stretched, at {math.degrees(limits_t[0]):.6g} degrees"
        return FullTurn(False, kind, limits_t, (), "exact", text)
    if limits_t:
        degrees = ", ".join(f"{math.degrees(angle):.6g}" for angle in limits_t)
        text = f"the crank cannot make a full turn: dead points at {degrees} degrees"
        return FullTurn(False, "limited", limits_t, changes_t, "exact", text)
    if changes_t:
        degrees = ", ".join(f"{math.degrees(angle):.6g}" for angle in changes_t)
        text = f"the crank passes every angle, but the branches meet at the change points {degrees} degrees"
        return FullTurn(False, "change point", (), changes_t, "exact", text)
    text = "the crank makes a full turn without dead points or change points"
    return FullTurn(True, "full turn", (), (), "exact", text)


def _margins(linkage: TiltedFourBar, f: Array) -> Array:
    """Smallest of the three quantities that must stay positive, relative to the square of the largest length."""
    A, _, _, near, far, _ = linkage._closure(f)
    scale = max(linkage.l1, linkage.l2, linkage.l3, linkage.l4) ** 2
    rod = linkage.l3**2 - A[:, 2] ** 2 if linkage.rod == "rigid" else math.inf
    return np.asarray(np.minimum(np.minimum(near, far), rod) / scale)


def _margin(linkage: TiltedFourBar, f: float) -> float:
    """Return the margin at one angle."""
    return float(_margins(linkage, np.array([f]))[0])


def _tilted_turn(linkage: TiltedFourBar) -> FullTurn:
    from scipy.optimize import brentq, minimize_scalar

    grid = np.linspace(0.0, math.tau, _SAMPLES + 1)
    values = _margins(linkage, grid)
    step = math.tau / _SAMPLES
    nodes = list(zip(grid, values))
    for index in range(_SAMPLES):  # a minimum between samples may dip below zero unseen
        before, here, after = values[index - 1], values[index], values[index + 1]
        if here <= before and here <= after and not before == here == after:  # flat where the tilt is below rounding
            found = minimize_scalar(
                lambda f: _margin(linkage, f),
                bounds=(grid[index] - step, grid[index] + step),
                method="bounded",
                options={"xatol": 1e-12},
            )
            nodes.append((float(found.x) % math.tau, float(found.fun)))
    nodes.sort()
    worst = min(value for _, value in nodes)
    best = max(nodes, key=lambda node: node[1])
    if abs(best[1]) <= 64 * np.finfo(float).eps:
        text = "the largest margin is at the rounding level: immovable or never assembled, not decided"
        return FullTurn(False, "immovable", (best[0],), (), "estimated", text)
    if best[1] < 0.0:
        text = "the linkage cannot be assembled at any sampled crank angle"
        return FullTurn(False, "never assembled", (), (), "estimated", text)
    limits = tuple(
        float(brentq(lambda f: _margin(linkage, f), f0, f1, xtol=1e-14)) % math.tau
        for (f0, v0), (f1, v1) in pairwise(nodes)
        if v0 * v1 < 0.0
    )
    if limits:
        degrees = ", ".join(f"{math.degrees(angle):.6g}" for angle in limits)
        text = f"the crank cannot make a full turn: dead points near {degrees} degrees"
        return FullTurn(False, "limited", limits, (), "estimated", text)
    if worst <= 64 * np.finfo(float).eps:
        touch = tuple(f for f, value in nodes if value == worst)
        text = "the smallest margin is at the rounding level: change point or dead point, not decided"
        return FullTurn(False, "change point", (), touch, "estimated", text)
    text = f"the crank makes a full turn; smallest relative margin {worst:.3g}"
    return FullTurn(True, "full turn", (), (), "estimated", text)


def straightness(linkage: TiltedFourBar, start: float, stop: float, samples: int) -> Straightness:
    """See `TiltedFourBar.straightness`."""
    from scipy.optimize import minimize_scalar

    from graphsynth.mechanism.four_bar import Straightness

    start, stop = finite("start", start), finite("stop", stop)
    f = np.linspace(start, stop, whole("samples", samples, 2))
    path = linkage.positions(f)
    if not path.assembled.all():
        raise GeometryError(
            f"the stroke from {start} to {stop} rad is not assembled everywhere ({'; '.join(path.reasons())}); "
            "choose a stroke inside the range of motion"
        )
    first, last = path.M[0, :2], path.M[-1, :2]
    chord = float(np.hypot(*(last - first)))
    if chord == 0.0:
        raise GeometryError("both ends of the stroke have the same tracing point; choose another stroke")
    normal = np.array([first[1] - last[1], last[0] - first[0]]) / chord
    if normal @ np.array([0.0, 1.0]) < 0.0:
        normal = -normal  # positive means upwards, whichever way M runs

    def offset(angle: float) -> float:
        return float((linkage.positions([angle]).M[0, :2] - first) @ normal)

    def extreme(direction: int) -> tuple[float, float]:
        signed = direction * ((path.M[:, :2] - first) @ normal)
        index = int(np.argmax(signed))
        bounds = (f[max(index - 1, 0)], f[min(index + 1, samples - 1)])
        found = minimize_scalar(
            lambda x: -direction * offset(x), bounds=tuple(sorted(bounds)), method="bounded", options={"xatol": 1e-12}
        )
        if -found.fun > signed[index]:
            return float(found.x), -direction * float(found.fun)
        return float(f[index]), direction * float(signed[index])

    (f_low, low), (f_high, high) = extreme(-1), extreme(1)
    return Straightness(chord, low, high, f_low, f_high, float(np.abs(path.M[:, 2]).max()))


#: Whether the crank turns.  "change point": it passes every angle, but the assembly modes meet.  "limited": some angles
#: cannot be assembled.  "immovable": only one can.
KINDS = ("full turn", "change point", "limited", "never assembled", "immovable")
#: Types of four-bars by Grashof's rule, seen from the crank.
TYPES = (
    "crank-rocker",
    "double crank",
    "rocker-crank",
    "double rocker",
    "change point",
    "triple rocker",
    "never assembled",
    "immovable",
)


class FourBarRotation(NamedTuple):
    """Exact statement on the crank of a four-bar, its angle counted from the direction to the rocker's pivot.

    ``kind`` is one of `KINDS`.  ``touches`` says whether the modes meet at 0 and at pi (at a limit or not).  ``limits``
    holds, for each bound that stops the crank, "stretched" or "folded" and the reach of the dyad there.
    """

    kind: str
    touches: tuple[bool, bool]
    limits: tuple[tuple[str, Fraction], ...]


def rotation_kind(near_least: Any, far_most: Any, near_most: Any, far_least: Any) -> NDArray[np.int8]:
    """Place in `KINDS`, from the signs of the nearest or farthest reach minus the least or most that can be spanned.

    Parameters
    ----------
    near_least, far_most, near_most, far_least : number or array of numbers
        Differences, or their signs; exact.
    """
    cases = [
        (near_most > 0) | (far_least < 0),
        (near_most == 0) | (far_least == 0),
        (near_least > 0) & (far_most < 0),
        (near_least >= 0) & (far_most <= 0),
    ]
    codes = [KINDS.index(kind) for kind in ("never assembled", "immovable", "full turn", "change point")]
    return np.select(cases, codes, KINDS.index("limited")).astype(np.int8)


def four_bar_rotation(square: Fraction, crank: Fraction, coupler: Fraction, rocker: Fraction) -> FourBarRotation:
    """Decide whether the crank turns; ``square`` is that of the frame, whose length may be irrational.

    Examples
    --------
    >>> four_bar_rotation(Fraction(4), Fraction(1), Fraction(5, 2), Fraction(5, 2)).kind
    'full turn'
    >>> four_bar_rotation(Fraction(4), Fraction(2), Fraction(1), Fraction(1)).limits
    (('stretched', Fraction(2, 1)),)
    """
    least, most = abs(rocker - coupler), rocker + coupler

    def near(bound: Fraction) -> int:
        """Sign of ``|frame - crank| - bound`` for a bound that is not negative."""
        return max(_order(square, crank + bound), -_order(square, crank - bound))

    def far(bound: Fraction) -> int:
        return _order(square, bound - crank)

    signs = near(least), far(most), near(most), far(least)
    blocked = ("stretched", most, signs[1] > 0), ("folded", least, signs[0] < 0)
    return FourBarRotation(
        KINDS[int(rotation_kind(*signs))],
        (signs[0] == 0, signs[1] == 0),
        tuple((place, reach) for place, reach, blocks in blocked if blocks),
    )


def _order(square: Fraction, bound: Fraction) -> int:
    """Sign of ``sqrt(square) - bound``, exactly; of a negative bound that of the larger number."""
    if bound < 0:
        return 1
    return (square > bound * bound) - (square < bound * bound)


def grashof_type(lengths: NDArray[Any]) -> NDArray[np.int8]:
    """Places in `TYPES` of frame, crank, coupler and rocker (n, 4), integers below 2**60 or fractions (exact).

    The sum of the shortest and the longest link against that of the other two (Grashof 1883): where it is smaller, the
    shortest link turns against all others.  Where the longest link is as long as the others together, they can only lie
    stretched along it.

    Examples
    --------
    >>> [TYPES[k] for k in grashof_type(np.array([[4, 2, 5, 5], [4, 2, 3, 5], [4, 3, 2, 2], [1, 1, 1, 9]]))]
    ['crank-rocker', 'change point', 'triple rocker', 'never assembled']
    """
    s, p, q, longest = np.sort(lengths, axis=1).T
    names = ("double crank", "crank-rocker", "double rocker", "rocker-crank")
    codes = np.array([TYPES.index(name) for name in names], dtype=np.int8)
    types: NDArray[np.int8] = codes[np.argmin(lengths, axis=1)]
    types[s + longest > p + q] = TYPES.index("triple rocker")
    types[s + longest == p + q] = TYPES.index("change point")
    types[longest == s + p + q] = TYPES.index("immovable")
    types[longest > s + p + q] = TYPES.index("never assembled")
    return types


def type_of(*lengths: Fraction) -> str:
    """Type of one four-bar: frame, crank, coupler, rocker.

    Examples
    --------
    >>> type_of(Fraction(3), Fraction(1), Fraction(1), Fraction(1))  # it can only lie stretched
    'immovable'
    """
    return TYPES[int(grashof_type(np.array([lengths], dtype=object))[0])]
