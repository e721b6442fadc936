"""What must hold for every dimensioned mechanism, drawn with the strategies that are offered to users."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import event, given, settings, strategies as st

from graphsynth import Mechanism, StructuralSpec, enumerate_mechanisms, simulate
from graphsynth.kinematics.certify import certify_four_bar
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.testing import four_bar_mechanisms, four_bars, mechanisms

SOME = settings(max_examples=30, deadline=None)


@SOME
@given(mechanisms(4, 10, prismatic=True))
def test_it_closes_in_its_pose_and_its_files_keep_every_bit(mechanism):
    event(f"{mechanism.graph.links} links")
    assert np.abs(residual(mechanism.joints, np.array(mechanism.pose))).max() < 1e-13
    for again in (Mechanism.from_json(mechanism.to_json()), Mechanism.from_toml(mechanism.to_toml())):
        assert again == mechanism and again.dimensions.tobytes() == mechanism.dimensions.tobytes()


@SOME
@given(mechanisms(4, 8))
def test_rank_never_exceeds_the_count_of_constraints(mechanism):
    """Freedoms by rank are at least those by count, and equal at almost every pose."""
    report = mechanism.mobility()
    assert report.count == 1 <= report.by_rank
    event("singular" if report.by_rank > 1 else "regular")
    J = jacobian(mechanism.joints, np.array(mechanism.pose))
    moving = [3 * k + c for k in range(mechanism.graph.links) if k != mechanism.frame for c in range(3)]
    assert report.by_rank >= len(moving) - J.shape[0]


@SOME
@given(mechanisms(4, 6), st.floats(-3.0, 3.0), st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)))
def test_residual_does_not_see_a_motion_of_the_whole(mechanism, turn, shift):
    pose = np.array(mechanism.pose)
    c, s = math.cos(turn), math.sin(turn)
    moved = np.column_stack(
        [c * pose[:, 0] - s * pose[:, 1] + shift[0], s * pose[:, 0] + c * pose[:, 1] + shift[1], pose[:, 2] + turn]
    )
    assert np.abs(residual(mechanism.joints, moved)).max() < 1e-13


@SOME
@given(four_bars())
def test_exact_class_decides_the_full_turn(bar):
    """Grashof's rule against the reach of the coupler over a turn, both exact."""
    kind = certify_four_bar(bar.ground, bar.crank, bar.coupler, bar.rocker).kind
    event(bar.type)
    if bar.type in ("crank-rocker", "double crank"):
        assert kind == "full turn"
    elif bar.type in ("rocker-crank", "double rocker", "triple rocker"):
        assert kind == "limited"
    elif bar.type == "immovable":
        assert kind == "immovable"
    else:
        assert kind in ("change point", "limited", "full turn")  # the crank may pass where two other links line up


@settings(max_examples=25, deadline=None)
@given(four_bar_mechanisms(), st.sampled_from((1, -1)))
def test_a_motion_keeps_its_lengths(found, mode):
    mechanism, kind = found
    motion = simulate(mechanism, np.linspace(0.1, 6.2, 30), modes={0: mode})
    event(f"{kind}: {'complete' if motion.completed else 'stopped'}")
    assert motion.completed or motion.reason
    shown = motion.assembled
    assert np.isnan(motion.poses[~shown]).any(axis=(1, 2)).all()
    for pose in motion.poses[shown]:
        assert np.abs(residual(mechanism.joints, pose)).max() <= 1e-13 * motion.Lc


def test_every_graph_of_six_links_can_be_drawn():
    wanted = {g.key for g in enumerate_mechanisms(StructuralSpec(W=1, links=6))}
    seen = set()

    @settings(max_examples=100, deadline=None, database=None, derandomize=True)
    @given(mechanisms(6, 6))
    def look(mechanism):
        seen.add(mechanism.graph.key)

    look()
    assert seen == wanted
