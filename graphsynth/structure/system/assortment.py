"""One integer solution of the structural system: :class:`LinkAssortment`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from graphsynth.core.errors import SpecError
from graphsynth.core.wording import shown, whole
from graphsynth.structure.system.variables import ALIASES, LARGEST, Counts

_KIND = re.compile(r"([np])([1-9][0-9]{0,3})")
#: Symbol -> field.
_NAMES = {
    symbol: name for name, symbol in ALIASES.items() if name not in ("links", "joints_by_mobility", "links_by_joints")
}


@dataclass(frozen=True, slots=True)
class LinkAssortment:
    """How many links and joints of each kind a mechanism has.

    Every quantity can be read by its symbol (``n4``, ``p2``, ``v_ct``, ...) and by its descriptive name.  All are
    exact integers.

    Attributes
    ----------
    mobility : int
        Mobility W.
    space : int
        Pi, the mobility of the space (3 for the plane).
    moving_links : int
        n; ``links`` (N) is n + 1.
    joints : int
        Joints p.
    p_i : tuple of int
        (p_1, ..., p_{Pi-1}): joints of each mobility.  ``joints_by_mobility`` is the same as a mapping.
    n_a : Counts
        Moving links with a joints, a mapping ``{a: n_a}`` that answers 0 for a kind that does not occur; also
        ``links_by_joints``.
    loops : int
        v, independent loops.
    frame_loops : int
        v_ct, loops through the frame.
    moving_loops : int
        v_P, loops among moving links.
    frame_joints : int
        t0, joints on the frame.
    sub_edges : int
        Sub-edges G: a joint of mobility i counts i.
    frame_parts : int
        c, connected parts into which the mechanism falls when the frame is taken away: 1 unless fractionated.

    Examples
    --------
    >>> from graphsynth import StructuralSpec
    >>> four_bar, = StructuralSpec(W=1, n=3).solve()
    >>> print(four_bar)
    n2=3 | p1=4 | t0=2
    >>> four_bar.N, four_bar.loops, four_bar.n2, four_bar.n5
    (4, 1, 3, 0)
    """

    mobility: int
    space: int
    moving_links: int
    joints: int
    p_i: tuple[int, ...]
    n_a: Counts
    loops: int
    frame_loops: int
    moving_loops: int
    frame_joints: int
    sub_edges: int
    frame_parts: int = 1

    @property
    def joints_by_mobility(self) -> Counts:
        """Joints of each mobility, a mapping ``{i: p_i}``."""
        return Counts(enumerate(self.p_i, start=1))

    @property
    def links_by_joints(self) -> Counts:
        """Moving links with a joints, a mapping ``{a: n_a}``."""
        return self.n_a

    @property
    def max_link_joints(self) -> int:
        """Largest number of joints on a moving link."""
        return max(self.n_a)

    def __getattr__(self, name: str) -> int:
        if name in ("N", "links"):
            return self.moving_links + 1
        if name in _NAMES:
            value: int = getattr(self, _NAMES[name])
            return value
        kind = _KIND.fullmatch(name)
        if kind is None:
            raise AttributeError(f"'LinkAssortment' object has no attribute {name!r}")
        number = int(kind[2])
        if kind[1] == "n":
            return self.n_a[number]
        return self.p_i[number - 1] if number <= len(self.p_i) else 0

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), "N", "links", *_NAMES]

    def check(self) -> None:
        """Verify all eight equations and the natural bounds again.

        `SpecError` names the first equation that does not hold, or the value that is no whole number.
        """
        self._check_types()
        freedoms = [(mobility, number) for mobility, number in enumerate(self.p_i, start=1)]
        kinds = list(self.n_a.items())
        equations = (
            ("W = G - v*Pi", self.mobility == self.sub_edges - self.loops * self.space),
            ("p = sum p_i", self.joints == sum(number for _, number in freedoms)),
            ("v = p - n", self.loops == self.joints - self.moving_links),
            ("n = sum n_a", self.moving_links == sum(number for _, number in kinds)),
            ("v = v_ct + v_P", self.loops == self.frame_loops + self.moving_loops),
            ("t0 = v_ct + c", self.frame_joints == self.frame_loops + self.frame_parts),
            ("2p = t0 + sum a*n_a", 2 * self.joints == self.frame_joints + sum(a * number for a, number in kinds)),
            ("G = sum i*p_i", self.sub_edges == sum(i * number for i, number in freedoms)),
            ("2 <= Pi <= 6, 1 <= i <= Pi - 1", 2 <= self.space <= 6 and len(self.p_i) == self.space - 1),
            ("p_i >= 0", all(number >= 0 for _, number in freedoms)),
            ("a >= 2, n_a >= 0", all(a >= 2 and number > 0 for a, number in kinds)),
            ("v_ct >= 0, v_P >= 0, t0 >= 2", min(self.frame_loops, self.moving_loops, self.frame_joints - 2) >= 0),
            ("1 <= c <= t0", 1 <= self.frame_parts <= self.frame_joints),
        )
        for text, holds in equations:
            if not holds:
                raise SpecError(f"the assortment {self} breaks {text}; solutions of StructuralSpec.solve() never do")

    def _check_types(self) -> None:
        for part in fields(self):
            value = getattr(self, part.name)
            values = [value]
            if part.name in ("p_i", "n_a"):
                if not isinstance(value, tuple if part.name == "p_i" else Mapping):
                    raise SpecError(
                        f"{part.name} = {shown(value)}: give a tuple p_i and a mapping n_a, as solve() does"
                    )
                values = [*value, *(value.values() if isinstance(value, Mapping) else ())]
            for number in values:
                whole(number, part.name, -LARGEST, LARGEST)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data by symbol, ready for JSON."""
        symbols = ("W", "Pi", "n", "N", "p", "p_i", "n_a", "v", "v_ct", "v_P", "t0", "G")
        families = {"p_i": list(self.p_i), "n_a": {str(a): number for a, number in self.n_a.items()}}
        return {symbol: getattr(self, symbol) for symbol in symbols} | families | {"c": self.frame_parts}

    def __str__(self) -> str:
        links = " ".join(f"n{a}={number}" for a, number in self.n_a.items())
        joints = " ".join(f"p{i}={number}" for i, number in enumerate(self.p_i, start=1) if number)
        parts = f" | c={self.frame_parts}" if self.frame_parts != 1 else ""
        return f"{links} | {joints} | t0={self.frame_joints}{parts}"


def solutions_table(solutions: Iterable[LinkAssortment]) -> tuple[list[str], list[list[int]]]:
    """Lay solutions out as a table of plain data: header and rows, one per solution in the given order.

    >>> from graphsynth import StructuralSpec
    >>> header, rows = solutions_table(StructuralSpec(W=1, n=3).solve())
    >>> dict(zip(header, rows[0]))
    {'#': 1, 'n2': 3, 'p1': 4, 'W': 1, 'Pi': 3, 'n': 3, 'p': 4, 'v': 1, 'v_ct': 1, 'v_P': 0, 't0': 2, 'G': 4}
    """
    listed = list(solutions)
    kinds = range(2, max((solution.max_link_joints for solution in listed), default=2) + 1)
    freedoms = range(1, max((max(solution.joints_by_mobility) for solution in listed), default=1) + 1)
    totals = ["W", "Pi", "n", "p", "v", "v_ct", "v_P", "t0", "G"]
    if any(solution.frame_parts != 1 for solution in listed):
        totals.append("c")
    header = ["#", *(f"n{a}" for a in kinds), *(f"p{i}" for i in freedoms), *totals]
    rows = []
    for number, solution in enumerate(listed, start=1):
        values = solution.as_dict()
        left = [solution.n_a[a] for a in kinds] + [getattr(solution, f"p{i}") for i in freedoms]
        rows.append([number, *left, *(int(values[symbol]) for symbol in totals)])
    return header, rows
