"""Strategies for dimensioned mechanisms: four-bars of a known class, chains assembled at a pose, parallel platforms."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from graphsynth.core.errors import SpecError
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.rotatability import TYPES, type_of
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.testing.extra import assume, check_range, ready, st
from graphsynth.testing.structures import mechanism_graphs

#: Classes, seen from the crank; the last is drawn only where it is asked for.
CLASSES = (*(kind for kind in TYPES if kind != "never assembled"), "never assembled")


@dataclass(frozen=True)
class FourBarLengths:
    """Lengths of a four-bar in the order of the loop, exact, and its class, one of ``CLASSES``.

    That is Grashof's rule with the shortest link, or "triple rocker" (not Grashof), "change point" (equality),
    "immovable" (the longest is as long as the others together: it can only lie stretched), "never assembled".
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
    more = part if kind in _SHORT else st.integers(0, 20 * scale)
    if kind in ("immovable", "never assembled"):
        three = [draw(part) for _ in range(3)]
        lengths = [*three, sum(three) + (0 if kind == "immovable" else draw(near))]
    else:
        # shortest s; the two middle ones s + x, s + y; the longest below their sum less s, that sum, or up to 2 s above
        s, x, y = draw(st.integers(2, 20 * scale) if kind == "triple rocker" else part), draw(more), draw(more)
        above = 0
        if kind in _SHORT:
            above = -min(draw(near), x, y)
        elif kind == "triple rocker":
            above = min(draw(near), 2 * s - 1)
        lengths = [s, s + x, s + y, s + x + y + above]
    if kind in _SHORT:
        middle = draw(st.permutations(lengths[1:]))
        lengths = [*middle[: _SHORT[kind]], lengths[0], *middle[_SHORT[kind] :]]
    else:
        lengths = list(draw(st.permutations(lengths)))
    ground, crank, coupler, rocker = (Fraction(length, scale) for length in lengths)
    assume(type_of(ground, crank, coupler, rocker) == kind)
    return FourBarLengths(ground, crank, coupler, rocker, kind)


def four_bars(*types: str, scale: int = 20) -> st.SearchStrategy[FourBarLengths]:
    """Four-bar linkages of given classes, each class as likely as the others, often one unit from a change of class.

    Parameters
    ----------
    *types : str
        Of ``CLASSES``, others are a `SpecError`; all but "never assembled" by default.
    scale : int
        The lengths are multiples of ``1 / scale``.

    Returns
    -------
    SearchStrategy
        Of `FourBarLengths`; the class is exact.

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


_GRID = st.integers(-16, 16)
_ANGLE = st.floats(-math.pi, math.pi)
_TURN = st.sampled_from((0.0, math.pi / 2)) | st.floats(-math.pi, math.pi, allow_subnormal=False)


@cache
def _places(count: int) -> st.SearchStrategy[list[tuple[int, int]]]:
    """Different points, kept: making and checking a strategy takes longer than drawing from it."""
    return st.lists(st.tuples(_GRID, _GRID), min_size=count, max_size=count, unique=True)


@st.composite
def _mechanisms(draw: st.DrawFn, of: st.SearchStrategy[MechanismGraph], prismatic: bool) -> Mechanism:
    graph = draw(of)
    places = [(x / 8.0, y / 8.0) for x, y in draw(_places(len(graph.joints)))]
    on_frame = [k for k, joint in enumerate(graph.joints) if graph.frame in (joint.a, joint.b)]
    driven = draw(st.sampled_from(on_frame))
    sliding = draw(st.none() | st.integers(0, len(places) - 1)) if prismatic else None
    turns = [0.0 if k == graph.frame else draw(_TURN) for k in range(graph.links)]
    joints: list[Any] = []
    for k, (joint, place) in enumerate(zip(graph.joints, places)):
        seen = [complex(*place) * cmath.exp(-1j * turns[link]) for link in (joint.a, joint.b)]
        a, b = ((point.real, point.imag) for point in seen)
        if k == sliding:
            angle = draw(_ANGLE)
            joints.append(Prismatic(joint.a, joint.b, a, b, angle - turns[joint.a], angle - turns[joint.b]))
        else:
            joints.append(Revolute(joint.a, joint.b, a, b))
    joint = graph.joints[driven]
    frame, link = (joint.a, joint.b) if joint.a == graph.frame else (joint.b, joint.a)
    pose = tuple((0.0, 0.0, angle) for angle in turns)
    return Mechanism(graph, tuple(joints), (Driver(frame, link),), pose=pose)


def mechanisms(min_links: int = 4, max_links: int = 8, *, prismatic: bool = False) -> st.SearchStrategy[Mechanism]:
    """Dimensioned planar mechanisms of one degree of freedom, assembled in ``mechanism.pose`` to rounding.

    The joints are put at random places and the links are what joins them there, so that nothing has to be searched:
    the mechanism is real at its pose, but how far it moves from there is open.  For mechanisms that turn fully see
    `four_bar_mechanisms`, or `graphsynth.embody`.

    Parameters
    ----------
    min_links, max_links : int
        Sizes, 4 to 10.
    prismatic : bool
        One joint may slide instead of turning.

    Returns
    -------
    SearchStrategy
        Every graph of `mechanism_graphs`, driven by any of its links on the frame; joints on different points of a
        grid of 1/8 in a square of side 4, often in line; link frames at the origin and turned at random.
    """
    check_range("links", min_links, max_links, 4, 10)
    of = mechanism_graphs(min_links, max_links)
    return st.deferred(lambda: _mechanisms(ready(of), prismatic))


def _assembled(bar: FourBarLengths) -> tuple[Mechanism, str]:
    ground, crank, coupler, rocker = bar.floats
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    moving = Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0))
    return Mechanism(graph, (*moving, Revolute(0, 3, (ground, 0.0))), (Driver(0, 1),)), bar.type


def four_bar_mechanisms(*types: str) -> st.SearchStrategy[tuple[Mechanism, str]]:
    """Four-bars of `four_bars` as mechanisms for `simulate`, with their class.

    Parameters
    ----------
    *types : str
        Classes; by default those whose class rounding of the lengths cannot change: all but "change point" and
        "immovable".

    Returns
    -------
    SearchStrategy
        Pairs of mechanism and class; link 1 is the crank and driven, the frame's second joint lies on +x.

    """
    return four_bars(*types or (*_SHORT, "triple rocker")).map(_assembled)


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
    """
    return _platforms(degenerate)


@st.composite
def _platform_poses(
    draw: st.DrawFn, degenerate: bool, reached: bool
) -> tuple[ParallelPlatform, Pose, tuple[int, int, int]]:
    platform = draw(_platforms(degenerate))
    alpha = draw(st.sampled_from((0.0, math.pi, -math.pi / 2)) | st.floats(-math.pi, math.pi))
    sign = st.sampled_from((1, -1))
    mode = (draw(sign), draw(sign), draw(sign))
    if not reached:
        leg = draw(st.integers(0, 2))
        # the vertex of one leg is put at a distance that the leg reaches: the others may reach theirs or not
        share = draw(st.sampled_from((0.0, 1.0)) | st.floats(0.0, 1.0))
        l1, l2 = platform.l1[leg], platform.l2[leg]
        far = abs(l1 - l2) + share * (l1 + l2 - abs(l1 - l2))
        vertex = platform.D[leg] + far * cmath.exp(1j * draw(st.floats(-math.pi, math.pi)))
        centre = vertex - cmath.exp(1j * alpha) * platform.b[leg]
        return platform, (centre.real, centre.imag, alpha), mode
    x, y = draw(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
    links = []
    for pivot, vertex, arm in zip(platform.D, platform.b, platform.l1):
        far = abs(complex(x, y) + cmath.exp(1j * alpha) * vertex - pivot)
        share = draw(st.floats(0.05, 0.95))
        links.append(abs(far - arm) + share * (far + arm - abs(far - arm)))  # any length between folded and stretched
    fitted = ParallelPlatform(platform.D, platform.b, platform.l1, (links[0], links[1], links[2]))
    assume(fitted.inverse((x, y, alpha)).reachable)  # a vertex on its pivot leaves the angle open
    return fitted, (x, y, alpha), mode


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
    """
    return _platform_poses(degenerate, reached)
