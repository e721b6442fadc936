"""Strategy for four-bar linkages with their class, decided in exact arithmetic."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from graphsynth.core.errors import SpecError
from graphsynth.mechanism.rotatability import TYPES, type_of
from graphsynth.testing.strategies.extra import assume, st

#: Classes, seen from the crank; the last is drawn only where it is asked for.
CLASSES = (*(kind for kind in TYPES if kind != "never assembled"), "never assembled")


@dataclass(frozen=True)
class FourBarLengths:
    """Lengths of a four-bar in the order of the loop, exact, and its class.

    Attributes
    ----------
    ground, crank, coupler, rocker : Fraction
        Positive.
    type : str
        One of ``CLASSES``: Grashof's rule with the shortest link, or "triple rocker" (not Grashof), "change point"
        (equality), "immovable" (the longest is as long as the others together: it can only lie stretched), "never
        assembled" (it is longer).
    """

    ground: Fraction
    crank: Fraction
    coupler: Fraction
    rocker: Fraction
    type: str

    @property
    def floats(self) -> tuple[float, float, float, float]:
        """The lengths as doubles, each rounded: near a change point the class of the doubles may differ."""
        return float(self.ground), float(self.crank), float(self.coupler), float(self.rocker)


_SHORT = {"double crank": 0, "crank-rocker": 1, "double rocker": 2, "rocker-crank": 3}


@st.composite
def _of_class(draw: st.DrawFn, kind: str, scale: int) -> FourBarLengths:
    """Lengths built so that they have the class, as whole numbers over ``scale``."""
    part = st.integers(1, 20 * scale)
    near = st.just(1) | part  # one unit away from a change of the class
    if kind in _SHORT:
        # shortest s; the two middle ones s + x, s + y; longest s + x + y - d with 1 <= d: s + l < p + q
        s, x, y = draw(part), draw(part), draw(part)
        longest = s + x + y - min(draw(near), min(x, y))
        middle = draw(st.permutations((s + x, s + y, longest)))
        lengths = [*middle[: _SHORT[kind]], s, *middle[_SHORT[kind] :]]
    elif kind == "change point":
        s, x, y = draw(part), draw(st.integers(0, 20 * scale)), draw(st.integers(0, 20 * scale))
        lengths = list(draw(st.permutations((s, s + x, s + y, s + x + y))))
    elif kind == "triple rocker":
        # longest above p + q - s, below p + q + s
        s, x, y = draw(st.integers(2, 20 * scale)), draw(st.integers(0, 20 * scale)), draw(st.integers(0, 20 * scale))
        longest = s + x + y + min(draw(near), 2 * s - 1)
        lengths = list(draw(st.permutations((s, s + x, s + y, longest))))
    else:
        a, b, c = draw(part), draw(part), draw(part)
        more = 0 if kind == "immovable" else draw(near)
        lengths = list(draw(st.permutations((a, b, c, a + b + c + more))))
    ground, crank, coupler, rocker = (Fraction(length, scale) for length in lengths)
    assume(type_of(ground, crank, coupler, rocker) == kind)
    return FourBarLengths(ground, crank, coupler, rocker, kind)


def four_bars(*types: str, scale: int = 20) -> st.SearchStrategy[FourBarLengths]:
    """Four-bar linkages of given classes, each class as likely as the others, often one unit from a change of class.

    Parameters
    ----------
    *types : str
        Of ``CLASSES``; all but "never assembled" by default.
    scale : int
        The lengths are multiples of ``1 / scale``.

    Returns
    -------
    SearchStrategy
        Of `FourBarLengths`; the class is exact.

    Raises
    ------
    SpecError
        An unknown class, or a scale that is not positive.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(four_bars("crank-rocker"), lambda bar: True).type
    'crank-rocker'
    """
    for kind in types:
        if kind not in CLASSES:
            raise SpecError(f"{kind!r} is no class of four-bars; use {', '.join(CLASSES)}")
    if isinstance(scale, bool) or not isinstance(scale, int) or scale < 1:
        raise SpecError(f"scale = {scale!r}; give a whole number from 1 up")
    return st.one_of([_of_class(kind, scale) for kind in types or CLASSES[:-1]])
