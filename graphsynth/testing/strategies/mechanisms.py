"""Strategies for dimensioned mechanisms, assembled in the pose they carry."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from graphsynth.core.errors import SpecError
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.testing.strategies.extra import check_range, ready, st
from graphsynth.testing.strategies.four_bars import CLASSES, four_bars
from graphsynth.testing.strategies.graphs import mechanism_graphs

_GRID = st.integers(-16, 16)
_ANGLE = st.floats(-math.pi, math.pi)
_TURN = st.sampled_from((0.0, math.pi / 2)) | st.floats(-math.pi, math.pi, allow_subnormal=False)


@cache
def _places(count: int) -> st.SearchStrategy[list[tuple[int, int]]]:
    """Different points, kept: making and checking a strategy takes longer than drawing from it."""
    return st.lists(st.tuples(_GRID, _GRID), min_size=count, max_size=count, unique=True)


@cache
def _one_or_none(count: int) -> st.SearchStrategy[int | None]:
    return st.none() | st.integers(0, count - 1)


@st.composite
def _mechanisms(draw: st.DrawFn, of: st.SearchStrategy[MechanismGraph], prismatic: bool) -> Mechanism:
    graph = draw(of)
    places = [(x / 8.0, y / 8.0) for x, y in draw(_places(len(graph.joints)))]
    on_frame = [k for k, joint in enumerate(graph.joints) if graph.frame in (joint.a, joint.b)]
    driven = draw(st.sampled_from(on_frame))
    sliding = draw(_one_or_none(len(places))) if prismatic else None
    turns = [0.0 if k == graph.frame else draw(_TURN) for k in range(graph.links)]
    joints: list[Any] = []
    for k, (joint, place) in enumerate(zip(graph.joints, places)):
        a, b = (_seen_from(place, turns[link]) for link in (joint.a, joint.b))
        if k == sliding:
            angle = draw(_ANGLE)
            joints.append(Prismatic(joint.a, joint.b, a, b, angle - turns[joint.a], angle - turns[joint.b]))
        else:
            joints.append(Revolute(joint.a, joint.b, a, b))
    joint = graph.joints[driven]
    frame, link = (joint.a, joint.b) if joint.a == graph.frame else (joint.b, joint.a)
    pose = tuple((0.0, 0.0, angle) for angle in turns)
    return Mechanism(graph, tuple(joints), (Driver(frame, link),), pose=pose)


def _seen_from(place: tuple[float, float], turn: float) -> tuple[float, float]:
    """Coordinates of a point in a frame at the origin that is turned by ``turn``."""
    c, s = math.cos(turn), math.sin(turn)
    return c * place[0] + s * place[1], -s * place[0] + c * place[1]


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

    Raises
    ------
    SpecError
        Sizes out of range.

    Examples
    --------
    >>> from hypothesis import given, settings
    >>> @settings(max_examples=5)
    ... @given(mechanisms(4, 4))
    ... def four_links(m):
    ...     assert m.graph.links == 4
    >>> four_links()
    """
    check_range("links", min_links, max_links, 4, 10)
    of = mechanism_graphs(min_links, max_links)
    return st.deferred(lambda: _mechanisms(ready(of), prismatic))


@st.composite
def _four_bar_mechanisms(draw: st.DrawFn, types: tuple[str, ...]) -> tuple[Mechanism, str]:
    bar = draw(four_bars(*types))
    ground, crank, coupler, rocker = bar.floats
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = (
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (ground, 0.0)),
    )  # fmt: skip
    return Mechanism(graph, joints, (Driver(0, 1),)), bar.type


_BORDERLINE = ("change point", "immovable", "never assembled")


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

    Raises
    ------
    SpecError
        An unknown class.

    Examples
    --------
    >>> from hypothesis import given, settings
    >>> @settings(max_examples=5)
    ... @given(four_bar_mechanisms("double crank"))
    ... def is_double_crank(found):
    ...     assert found[1] == "double crank"
    >>> is_double_crank()
    """
    for kind in types:
        if kind not in CLASSES:
            raise SpecError(f"{kind!r} is no class of four-bars; use {', '.join(CLASSES)}")
    return _four_bar_mechanisms(types or tuple(kind for kind in CLASSES if kind not in _BORDERLINE))
