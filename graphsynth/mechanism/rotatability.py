"""Rotatability of a crank, decided exactly: Grashof's rule and the extremes of a reach, for integers and fractions.

A crank turns the pin of a dyad.  The dyad can be assembled while the reach of the pin stays within two bounds, so the
extremes of the reach over a turn decide.  Of a four-bar the reach is the distance of the pin from the rocker's pivot,
between ``|g - a|`` and ``g + a``, and the bounds are ``|b - c|`` and ``b + c`` (Grashof 1883).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class FullTurn:
    """Whether a crank turns fully: one of `KINDS`, and the result in one sentence.

    The angles (radians, in [0, 2 pi)) are those of the dead points and of the change points, behind which the branch is
    ambiguous; the limit angle of an immovable linkage is the one at which it lies stretched.  ``method`` is "exact"
    (rational arithmetic on the given lengths) or "estimated" (sampled and refined).
    """

    kind: str
    limit_angles: tuple[float, ...]
    change_angles: tuple[float, ...]
    method: str
    statement: str

    @property
    def possible(self) -> bool:
        """Whether the crank passes every angle on one branch."""
        return self.kind == "full turn"


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
    """Place in `KINDS`, from the exact nearest or farthest reach minus the least or most that can be spanned.

    The four differences, or their signs, are numbers or arrays of numbers.
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

    >>> four_bar_rotation(Fraction(4), Fraction(1), Fraction(5, 2), Fraction(5, 2)).kind
    'full turn'
    >>> four_bar_rotation(Fraction(4), Fraction(2), Fraction(1), Fraction(1)).limits
    (('stretched', Fraction(2, 1)),)
    """
    least, most = abs(rocker - coupler), rocker + coupler
    # signs of |frame - crank| - bound and of frame + crank - bound for bounds that are not negative
    near = [max(_order(square, crank + bound), -_order(square, crank - bound)) for bound in (least, most)]
    far = [_order(square, bound - crank) for bound in (least, most)]
    signs = near[0], far[1], near[1], far[0]
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

    >>> type_of(Fraction(3), Fraction(1), Fraction(1), Fraction(1))  # it can only lie stretched
    'immovable'
    """
    return TYPES[int(grashof_type(np.array([lengths], dtype=object))[0])]
