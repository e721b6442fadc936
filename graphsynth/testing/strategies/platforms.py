"""Strategies for the parallel platform and its poses."""

from __future__ import annotations

import cmath
import math

from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.testing.strategies.extra import assume, st

Pose = tuple[float, float, float]


@st.composite
def _platforms(draw: st.DrawFn, degenerate: bool) -> ParallelPlatform:
    number = st.integers(-20, 20).map(lambda k: k / 10.0) | st.floats(-2.0, 2.0, allow_subnormal=False)
    length = st.integers(1, 30).map(lambda k: k / 10.0) | st.floats(0.05, 3.0)
    kinds = ["general", "general", "symmetric"] + ["collinear", "coincident", "congruent"] * degenerate
    kind = draw(st.sampled_from(kinds))
    if kind == "symmetric":
        size, small = draw(st.floats(0.5, 2.0)), draw(st.floats(0.1, 1.0))
        corners = [cmath.exp(2j * math.pi * k / 3) for k in range(3)]
        D, b = [size * c for c in corners], [small * c for c in corners]
    else:
        D, b = ([complex(draw(number), draw(number)) for _ in range(3)] for _ in range(2))
    l1, l2 = ([draw(length) for _ in range(3)] for _ in range(2))
    if kind == "collinear":
        D, b = [complex(d.real, 0.0) for d in D], [complex(v.real, 0.0) for v in b]
    elif kind == "coincident":
        b[1] = b[0]
    elif kind == "congruent":
        b, l1, l2 = list(D), [l1[0]] * 3, [l2[0]] * 3
    return ParallelPlatform((D[0], D[1], D[2]), (b[0], b[1], b[2]), (l1[0], l1[1], l1[2]), (l2[0], l2[1], l2[2]))


def platforms(*, degenerate: bool = True) -> st.SearchStrategy[ParallelPlatform]:
    """Three-leg platforms: general ones, symmetric ones, and degenerate ones.

    Parameters
    ----------
    degenerate : bool
        Also collinear and coincident points, and congruent triangles with equal legs (which move by themselves).

    Returns
    -------
    SearchStrategy
        Of `ParallelPlatform`; coordinates within 2, lengths 0.05 to 3.

    Examples
    --------
    >>> from hypothesis import given, settings
    >>> @settings(max_examples=5)
    ... @given(platforms())
    ... def three_legs(platform):
    ...     assert len(platform.b) == 3
    >>> three_legs()
    """
    return _platforms(degenerate)


@st.composite
def _platform_poses(draw: st.DrawFn, degenerate: bool) -> tuple[ParallelPlatform, Pose, tuple[int, int, int]]:
    platform = draw(_platforms(degenerate))
    alpha = draw(st.sampled_from((0.0, math.pi, -math.pi / 2)) | st.floats(-math.pi, math.pi))
    sign = st.sampled_from((1, -1))
    sigma = (draw(sign), draw(sign), draw(sign))
    leg = draw(st.integers(0, 2))
    # the vertex of one leg is put at a distance that the leg reaches: the others may reach theirs or not
    share = draw(st.sampled_from((0.0, 1.0)) | st.floats(0.0, 1.0))
    l1, l2 = platform.l1[leg], platform.l2[leg]
    far = abs(l1 - l2) + share * (l1 + l2 - abs(l1 - l2))
    vertex = platform.D[leg] + far * cmath.exp(1j * draw(st.floats(-math.pi, math.pi)))
    centre = vertex - cmath.exp(1j * alpha) * platform.b[leg]
    return platform, (centre.real, centre.imag, alpha), sigma


@st.composite
def _reached(draw: st.DrawFn, degenerate: bool) -> tuple[ParallelPlatform, Pose, tuple[int, int, int]]:
    platform = draw(_platforms(degenerate))
    x, y = draw(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
    alpha = draw(st.sampled_from((0.0, math.pi, -math.pi / 2)) | st.floats(-math.pi, math.pi))
    links = []
    for pivot, vertex, arm in zip(platform.D, platform.b, platform.l1):
        far = abs(complex(x, y) + cmath.exp(1j * alpha) * vertex - pivot)
        share = draw(st.floats(0.05, 0.95))
        links.append(abs(far - arm) + share * (far + arm - abs(far - arm)))  # any length between folded and stretched
    sign = st.sampled_from((1, -1))
    fitted = ParallelPlatform(platform.D, platform.b, platform.l1, (links[0], links[1], links[2]))
    assume(fitted.inverse((x, y, alpha)).reachable)  # a vertex on its pivot leaves the angle open
    return fitted, (x, y, alpha), (draw(sign), draw(sign), draw(sign))


def platform_poses(
    *, reached: bool = False, degenerate: bool = True
) -> st.SearchStrategy[tuple[ParallelPlatform, Pose, tuple[int, int, int]]]:
    """Platform, pose ``(x, y, alpha)`` and working mode: within reach of all legs, of some, or on their boundary.

    Parameters
    ----------
    reached : bool
        Only poses that all legs reach, away from their boundary: the links are then made to fit.
    degenerate : bool
        As for `platforms`.

    Returns
    -------
    hypothesis strategy
        Of triples ``(ParallelPlatform, Pose, mode)``.

    Examples
    --------
    >>> from hypothesis import given, settings
    >>> @settings(max_examples=5)
    ... @given(platform_poses(reached=True))
    ... def legs_reach(found):
    ...     assert found[0].inverse(*found[1:]).reachable
    >>> legs_reach()
    """
    return _reached(degenerate) if reached else _platform_poses(degenerate)
