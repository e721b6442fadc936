"""`effort` of `embody`: less of it is less work, the same standard of acceptance, the same bytes every time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.dimensional import Embodiment, Goals, LineGoal, embody
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
LEAST, RATIO = math.radians(20.0), 5.0
LINE = Goals(min_transmission_angle=LEAST, max_length_ratio=RATIO, target=LineGoal(length=4.0, on_bar=True))
#: The two extreme cosines of the transmission angle differ by 2 frame crank / (coupler rocker): at least 0.89 with this
#: ratio of lengths, at most 0.04 with this angle.  Nothing is accepted, so no search ends early.
OUT_OF_REACH = Goals(min_transmission_angle=math.radians(89.0), max_length_ratio=1.5)
EFFORTS = (0.02, 0.06)


def four_bar_figures(found: Embodiment) -> tuple[float, float]:
    """Smallest transmission angle of a full turn, and longest length over shortest, by elementary geometry."""
    assert found.mechanism is not None
    lengths = []
    for link in range(4):
        at = [complex(*(j.at_a if j.a == link else j.at_b)) for j in found.mechanism.joints if link in j.pair]
        lengths.append(abs(at[0] - at[1]))
    driver = found.mechanism.drivers[0]
    other = next(k for k in range(4) if k not in (driver.base, driver.link) and (k + 2) % 4 != driver.base)
    frame, crank, follower = lengths[driver.base], lengths[driver.link], lengths[other]
    coupler = lengths[6 - driver.base - driver.link - other]
    angles = []
    for distance in (abs(frame - crank), frame + crank):
        cosine = (coupler**2 + follower**2 - distance**2) / (2.0 * coupler * follower)
        assert abs(cosine) < 1.0  # assembled in both positions in line with the frame: the crank turns fully
        angles.append(min(math.acos(cosine), math.pi - math.acos(cosine)))
    tracers = [  # a tracing point makes bars of its own on its link
        abs(complex(*point.at) - complex(*(j.at_a if j.a == point.link else j.at_b)))
        for point in found.mechanism.points.values()
        for j in found.mechanism.joints
        if point.link in j.pair
    ]
    return min(angles), max(lengths + tracers) / min(lengths)


def strip_width(points: np.ndarray) -> float:
    """Width of the narrowest strip around points, by trying directions near that of the chord."""
    chord = points[-1] - points[0]
    turns = math.atan2(chord[1], chord[0]) + np.linspace(-0.05, 0.05, 4001)
    return float(np.ptp(points @ np.stack([-np.sin(turns), np.cos(turns)]), axis=0).min())


@pytest.mark.parametrize("goals", [OUT_OF_REACH, LINE], ids=["bounds", "line"])
def test_less_effort_is_fewer_evaluations(goals: Goals) -> None:
    work = [embody(CYCLE, goals, driver=1, tries=1, effort=effort).evaluations for effort in EFFORTS]
    assert work == sorted(set(work))
    assert work[0] < 0.7 * work[-1]


def test_one_is_the_default_and_more_is_more() -> None:
    usual, said = embody(CYCLE, OUT_OF_REACH, tries=1), embody(CYCLE, OUT_OF_REACH, tries=1, effort=1.0)
    assert (usual.evaluations, usual.history) == (said.evaluations, said.history)
    assert embody(CYCLE, OUT_OF_REACH, tries=1, effort=2.0).evaluations > usual.evaluations


@pytest.mark.parametrize("effort", EFFORTS)
def test_what_is_out_of_reach_is_not_accepted_at_any_effort(effort: float) -> None:
    found = embody(CYCLE, OUT_OF_REACH, tries=2, effort=effort)
    assert not found.accepted and "nothing was accepted" in found.statement


@settings(max_examples=6, deadline=None)
@given(st.floats(0.01, 0.08), st.integers(0, 999), st.booleans())
def test_what_is_accepted_keeps_the_goals_whatever_the_effort(effort: float, seed: int, aimed: bool) -> None:
    check_goals(effort, seed, aimed)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 1.0), st.integers(0, 999), st.booleans())
def test_what_is_accepted_keeps_the_goals_up_to_the_usual_effort(effort: float, seed: int, aimed: bool) -> None:
    check_goals(effort, seed, aimed)


def check_goals(effort: float, seed: int, aimed: bool) -> None:
    goals = LINE if aimed else Goals(min_transmission_angle=LEAST, max_length_ratio=RATIO)
    found = embody(CYCLE, goals, seed, driver=1, tries=1, effort=effort)
    if not found.accepted:
        assert "nothing was accepted" in found.statement
        return
    angle, ratio = four_bar_figures(found)
    assert angle >= LEAST - 1e-4 and ratio <= RATIO * (1 + 1e-6)
    if aimed:
        assert found.mechanism is not None and found.figures is not None and goals.target is not None
        path = simulate(found.mechanism, np.linspace(0.0, 2.0 * math.pi, 1441)).point("P").position
        segment = path[:721]
        stroke = float(np.hypot(*(segment[-1] - segment[0])))
        assert strip_width(segment) / stroke <= goals.target.tolerance * 1.02


@pytest.mark.long
@pytest.mark.parametrize("effort", [0.02, 0.3])
def test_same_seed_same_bytes(effort: float) -> None:
    chain = next(iter(enumerate_chains(6)))
    runs = [embody(chain, LINE if effort < 0.1 else None, 3, tries=2, effort=effort) for _ in range(2)]
    texts = [found.mechanism.to_json() for found in runs if found.mechanism is not None]
    assert len(texts) == 2 and texts[0] == texts[1]
    assert runs[0].history == runs[1].history and runs[0].evaluations == runs[1].evaluations
    assert (runs[0].accepted, runs[0].statement) == (runs[1].accepted, runs[1].statement)


@pytest.mark.parametrize("effort", [0.0, -1.0, math.nan, math.inf, "much", None])
def test_effort_that_makes_no_sense(effort: object) -> None:
    with pytest.raises(GeometryError, match="effort"):
        embody(CYCLE, effort=effort)
