"""Bounds of the search box where propagation leaves a side open: against linear programs in floats."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from graphsynth import StructuralSpec
from graphsynth.structure.system.equations import IntegerProblem, domains_of, propagate, rows_of
from graphsynth.structure.system.solving import _box


@pytest.mark.parametrize(
    "question",
    [
        {"W": (1, 1), "n2": (3, 5), "n3": (2, 2)},
        {"W": (1, 1), "n2": (4, 4), "n3": (0, 4)},
        {"v": (3, 3), "n2": (5, 5)},
        {"v": (4, 4), "n2": (2, 7), "n3": (1, 3)},
    ],
)
def test_open_sides_are_closed_at_the_extreme(question):
    problem = IntegerProblem((("Pi", (3, 3)), *sorted(question.items())))
    box = _box(problem, 3)
    domains, rows = domains_of(problem, 3), rows_of(problem, 3)
    assert propagate(problem, domains, rows) and domains["n"][1] is None and box is not None
    names = sorted({name for row in rows for name, _ in row.terms} | set(domains))
    upper, limits = [], []
    for row in rows:
        terms = dict(row.terms)
        line = np.array([terms.get(name, 0) for name in names], dtype=float)
        upper += [line] if row.highest is not None else []
        limits += [row.highest] if row.highest is not None else []
        upper += [-line] if row.lowest is not None else []
        limits += [-row.lowest] if row.lowest is not None else []
    found = linprog([-float(name == "n") for name in names], upper, limits,
                    bounds=[domains.get(name, (0, None)) for name in names])  # fmt: skip
    assert found.status == 0 and box["n"][1] == math.floor(-found.fun + 1e-7)


def test_bounds_of_higher_pairs_hold_on_both_sides():
    """Solutions within bounds are those of wider bounds that lie within."""
    wide = StructuralSpec(W=1, p=(6, 10), p2=(0, 10)).solve()
    for low, high in ((0, 0), (1, 2), (2, 2), (1, 10)):
        wanted = {str(s) for s in wide if low <= dict(enumerate(s.p_i, 1)).get(2, 0) <= high}
        found = StructuralSpec(W=1, p=(6, 10), p2=(low, high)).solve()
        assert {str(s) for s in found} == wanted and len(found) == len(wanted)
