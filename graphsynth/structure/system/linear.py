"""An exact linear programme in fractions: how large a variable can become, or that nothing stops it.

Used only when bound propagation leaves a variable of the structural system open, so clarity goes before speed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

from graphsynth.structure.system.equations import Row
from graphsynth.structure.system.variables import Range

_Terms = dict[str, Fraction]


def maximum(objective: Mapping[str, int], rows: Iterable[Row], domains: Mapping[str, Range]) -> Fraction | None:
    """Maximise ``sum coefficient * variable`` over the rows and domains, in rational numbers.

    Returns the exact maximum; None if it is infinite. Raises `ValueError` if no rational point satisfies the rows.
    Two-phase tableau simplex with Bland's rule (R. G. Bland, Math. Oper. Res. 2 (1977) 103), which cannot cycle.

    >>> maximum({"x": 1}, [Row("", (("x", 2), ("y", 1)), None, 7)], {"x": (0, None), "y": (1, None)})
    Fraction(3, 1)
    >>> maximum({"y": 1}, [Row("", (("x", 1), ("y", -1)), 0, None)], {"x": (0, None), "y": (1, None)}) is None
    True
    """
    listed = list(rows)
    used = {name for row in listed for name, _ in row.terms} | set(objective)
    limits = [(_split(dict(row.terms), domains), side, sign) for row in listed for side, sign in _sides(row)]
    for name in used:
        hi = domains[name][1]
        if hi is not None:
            limits.append((_split({name: 1}, domains), hi, 1))
    tableau = _Tableau([_shifted(terms, side, sign, domains) for (terms, side, sign) in limits])
    tableau.make_feasible()
    offset = sum(
        (Fraction(coefficient * (domains[name][0] or 0)) for name, coefficient in objective.items()), Fraction(0)
    )
    best = tableau.maximise(_split(dict(objective), domains))
    return None if best is None else best + offset


def _sides(row: Row) -> list[tuple[int, int]]:
    sides = [] if row.highest is None else [(row.highest, 1)]
    return sides if row.lowest is None else [*sides, (row.lowest, -1)]


def _split(terms: Mapping[str, int], domains: Mapping[str, Range]) -> _Terms:
    """Write a variable without lower bound as a difference of two non-negative ones."""
    split: _Terms = {}
    for name, coefficient in terms.items():
        split[name] = Fraction(coefficient)
        if domains[name][0] is None:
            split[name + "-"] = Fraction(-coefficient)
    return split


def _shifted(terms: _Terms, side: int, sign: int, domains: Mapping[str, Range]) -> tuple[_Terms, Fraction]:
    """Return (terms, bound) of ``terms <= bound`` in variables measured from their lower bounds."""
    shift = sum((own * (domains[name][0] or 0) for name, own in terms.items() if name in domains), Fraction(0))
    return {name: sign * own for name, own in terms.items()}, sign * (side - shift)


class _Tableau:
    """Dictionary form: each basic variable = constant + sum coefficient * non-basic variable, all >= 0."""

    def __init__(self, limits: list[tuple[_Terms, Fraction]]) -> None:
        self.basic: dict[str, _Terms] = {}
        self.constant: dict[str, Fraction] = {}
        for number, (terms, bound) in enumerate(limits):
            slack = f"~{number}"
            self.basic[slack] = {name: -own for name, own in terms.items()}
            self.constant[slack] = bound

    def make_feasible(self) -> None:
        """Phase one: minimise one artificial variable."""
        if min(self.constant.values(), default=Fraction(0)) >= 0:
            return
        for terms in self.basic.values():
            terms["!"] = Fraction(1)
        self._pivot("!", min(self.constant, key=lambda name: (self.constant[name], name)))
        best = self.maximise({"!": Fraction(-1)})
        if best is None or best < 0:
            raise ValueError("no rational point satisfies the rows")
        if "!" in self.basic:
            entering = next(name for name, own in sorted(self.basic["!"].items()) if own)
            self._pivot(entering, "!")
        for terms in self.basic.values():
            terms.pop("!", None)

    def maximise(self, objective: _Terms) -> Fraction | None:
        while True:
            cost, value = self._reduced(objective)
            entering = min((name for name, own in cost.items() if own > 0), default=None)
            if entering is None:
                return value
            ratios = [
                (-self.constant[name] / terms[entering], name)
                for name, terms in self.basic.items()
                if terms.get(entering, 0) < 0
            ]
            if not ratios:
                return None
            self._pivot(entering, min(ratios)[1])

    def _reduced(self, objective: _Terms) -> tuple[_Terms, Fraction]:
        """Write the objective in terms of the non-basic variables."""
        cost: _Terms = {}
        value = Fraction(0)
        for name, own in objective.items():
            if name in self.basic:
                value += own * self.constant[name]
                for other, inner in self.basic[name].items():
                    cost[other] = cost.get(other, Fraction(0)) + own * inner
            else:
                cost[name] = cost.get(name, Fraction(0)) + own
        return cost, value

    def _pivot(self, entering: str, leaving: str) -> None:
        terms, constant = self.basic.pop(leaving), self.constant.pop(leaving)
        factor = terms.pop(entering)
        solved = {name: -own / factor for name, own in terms.items() if own}
        solved[leaving] = 1 / factor
        constant = -constant / factor
        for name, others in self.basic.items():
            own = others.pop(entering, None)
            if own:
                self.constant[name] += own * constant
                for other, inner in solved.items():
                    others[other] = others.get(other, Fraction(0)) + own * inner
        self.basic[entering], self.constant[entering] = solved, constant
