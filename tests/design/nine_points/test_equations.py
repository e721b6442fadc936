"""The equations hold for linkages by their geometry; slopes and kernels agree with them; cognates are other roots."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from graphsynth.design.nine_points.equations import cognates, slopes, value
from graphsynth.design.nine_points.kernels import paths
from graphsynth.design.nine_points.monodromy import generic, planted


def unknowns(linkage):
    (a, b), (c, d), p = linkage.pivots, linkage.joints, linkage.points[0]
    return np.array([f(z - p) for z in (a, c, b, d) for f in (complex, np.conj)])


def test_linkages_satisfy_them_and_others_do_not(plant):
    linkage = plant(1, 9)
    z, p = unknowns(linkage), linkage.points[1:] - linkage.points[0]
    assert np.abs(value(z, p, p.conj())).max() < 1e-11
    for k in range(8):
        other = z.copy()
        other[k] += 1e-3
        assert np.abs(value(other, p, p.conj())).max() > 1e-6


@pytest.mark.long
def test_slopes_are_derivatives():
    symbols = sympy.symbols("a A x X b B y Y")
    p, q = sympy.symbols("p q")
    expression = value(symbols, p, q)
    for symbol, slope in zip(symbols, slopes(symbols, p, q)):
        assert sympy.expand(sympy.diff(expression, symbol) - slope) == 0


@pytest.mark.long
@pytest.mark.parametrize("pivots", [0, 1, 2])
def test_kernel_agrees(pivots):
    rng = np.random.default_rng(pivots)
    n = 8 - 2 * pivots
    free = np.array([k for k in range(8) if k % 4 > 1 or k // 4 >= pivots])
    given = np.setdiff1d(np.arange(8), free)
    z, d, speed = generic(rng, 8), generic(rng, n + 5, 2), generic(rng, n + 5, 2)
    M = np.empty((n, n + 2), dtype=np.complex128)
    paths.linearise(z, d, speed, free, given, M)

    def at(t, moved):
        p, q = (d[:n] + t * speed[:n]).T
        bend, pole = d[-1] + t * speed[-1]
        held = moved.copy()
        held[given] += t * np.array([speed[n + k // 2, k % 2] for k in given])
        p[-1] += bend / (held[free[n - 4]] - pole)
        return value(held, p, q)

    h = 1e-6
    numbers = [(at(0.0, z + h * np.eye(8)[k]) - at(0.0, z - h * np.eye(8)[k])) / (2.0 * h) for k in free]
    numbers += [at(0.0, z), (at(h, z) - at(-h, z)) / (2.0 * h)]
    assert np.abs(M - np.stack(numbers, axis=1)).max() < 1e-6 * np.abs(M).max()


@pytest.mark.long
def test_solution_of_linear_systems():
    rng = np.random.default_rng(5)
    A, b = generic(rng, 6, 6), generic(rng, 6, 2)
    M = np.concatenate([A, b], axis=1)
    assert paths.solve(M)
    assert np.abs(M[:, 6:] + np.linalg.solve(A, b)).max() < 1e-12
    M[:, 2] = 0.0
    assert not paths.solve(M)


def test_cognates_draw_the_same_path():
    x = tuple(Fraction(k, 7) for k in (3, -5, 8, 2, -6, 9, 4, 11))
    points = [(Fraction(k, 3), Fraction(2 - 5 * k, 11)) for k in (1, 2, 4)]
    for linkage in cognates(x)[1:]:
        # the quotient of both equations does not depend on the point
        ratios = [value(linkage, p, q) / value(x, p, q) for p, q in points]
        assert isinstance(ratios[0], Fraction) and ratios[0] == ratios[1] == ratios[2] != 0


def test_planted_generic_linkages_are_roots():
    for pivots in (0, 1, 2):
        start = planted(pivots, np.random.default_rng(pivots))
        n = 8 - 2 * pivots
        p, q = start.end[:n].T
        assert np.abs(value(start.z[0], p, q)).max() < 1e-9 * np.abs(start.end).max() ** 4
