"""Loops in spaces of different mobility: count, rank, the redundant couple, the two mechanisms of the source."""

import math

import numpy as np
import pytest

from graphsynth.core.errors import GraphError
from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import Gear, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, MechanismGraph
from graphsynth.systems.piston import FloatingPiston, ScotchYoke, loop_spaces, rotary_assignments
from graphsynth.systems.piston.model import FloatingGroup

BOTH = {
    "slider-crank": FloatingPiston.crank_slider(0.05, 0.2, 0.01, cylinder_angle=0.1, lead=0.05),
    "Scotch yoke": FloatingPiston(ScotchYoke(0.05, 0.01, 1.3), FloatingGroup(slot_angle=1.5)),
}


@pytest.mark.parametrize("machine", BOTH.values(), ids=BOTH)
def test_both_source_mechanisms(machine):
    for at in np.linspace(0.1, 6.2, 9):
        mechanism = machine.mechanism(at=float(at))
        found = loop_spaces(mechanism)
        assert [loop.links for loop in found.loops] == [(0, 1, 2, 3), (0, 3, 4)]
        assert found.spaces == (3, 2)
        assert [loop.own for loop in found.loops] == [3, 2]
        assert (found.sub_edges, found.mobility, found.uniform, found.redundant) == (6, 1, 0, 1)
        assert found.agrees
        # the second group: one link, two joints, no mobility of its own
        second = found.loops[1]
        assert second.fresh == ((3, 4), (0, 4))
        assert second.mobility == 0
        report = mechanism.mobility()
        assert (report.count, report.by_rank, report.redundant) == (0, 1, 1)
    assert machine.graph.mobility == 0
    assert machine.graph.loops == 2


def test_the_load_that_circulates_is_a_couple():
    second = loop_spaces(BOTH["slider-crank"].mechanism()).loops[1]
    assert second.idle.shape == (1, 3)
    assert np.abs(np.abs(second.idle[0]) - [1.0, 0.0, 0.0]).max() < 1e-12


def test_uniform_count_of_the_graph_is_the_generic_one():
    # at random geometry (no three parallel directions) the same graph is a structure
    assert BOTH["slider-crank"].graph.generic_mobility().mobility == 0


def test_crowned_slot_makes_the_uniform_count_right():
    found = loop_spaces(BOTH["slider-crank"].mechanism("crowned"))
    assert (found.sub_edges, found.spaces, found.mobility, found.uniform, found.redundant) == (7, (3, 3), 1, 1, 0)


def test_the_choice_of_loops_changes_spans_but_not_the_mobility():
    mechanism = BOTH["slider-crank"].mechanism()
    found = loop_spaces(mechanism, loops=[(0, 1, 2, 3), (0, 1, 2, 3, 4)])
    assert [loop.own for loop in found.loops] == [3, 3]
    assert found.own_count == 0  # spans taken loop by loop miss the freedom
    assert found.spaces == (3, 2)
    assert found.mobility == 1
    other = loop_spaces(mechanism, loops=[(0, 4, 3), (3, 2, 1, 0)])
    assert other.spaces == (2, 3)
    assert other.mobility == 1


def test_parallel_slot_adds_a_freedom():
    """All three directions parallel: the second loop moves in a space of mobility 1, and the piston is loose."""
    pairs = [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (0, 4)]
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3),
              Prismatic(3, 4), Prismatic(0, 4)]  # fmt: skip
    turn = 0.5
    x = math.cos(turn) + math.sqrt(9.0 - math.sin(turn) ** 2)
    pose = [(0, 0, 0), (0, 0, turn), (math.cos(turn), math.sin(turn), -math.asin(math.sin(turn) / 3.0)), (x, 0, 0),
            (x, 0, 0)]  # fmt: skip
    found = loop_spaces(Mechanism(MechanismGraph(5, pairs, frame=0), joints, pose=pose))
    assert found.spaces == (3, 1)
    assert found.mobility == 2
    assert found.agrees


def test_other_mechanisms():
    # parallelogram with a third parallel bar: W = 1 with one redundant constraint
    graph = MechanismGraph(5, [(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (2, 4)], frame=0)
    bars = [Revolute(0, k, (x, 0.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    tops = [Revolute(2, k, (x, 0.0), (0.0, 1.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    pose = [(0, 0, 0), (0, 0, 0.0), (0, 1, 0), (2, 0, 0), (1, 0, 0)]
    found = loop_spaces(Mechanism(graph, bars + tops, pose=pose))
    assert sorted(found.spaces) == [2, 3]
    assert found.mobility == found.by_constraints == 1
    # a gear pair: joint of mobility 2
    gears = Mechanism(
        MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0),
        [Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), Gear(1, 2, radius_a=1.0, radius_b=2.0)],
        pose=[(0, 0, 0), (0, 0, 0), (3, 0, 0)],
    )
    found = loop_spaces(gears)
    assert (found.sub_edges, found.spaces, found.mobility) == (4, (3,), 1)
    assert found.agrees


def test_ranks_do_not_depend_on_the_unit():
    for size in (1e-6, 1.0, 1e6):
        machine = FloatingPiston.crank_slider(0.05 * size, 0.2 * size, 0.01 * size, cylinder_angle=0.1)
        assert loop_spaces(machine.mechanism()).spaces == (3, 2)


@pytest.mark.parametrize("seed", range(4))
def test_exactly_two_assignments_turn_fully(seed):
    found = rotary_assignments(seed)
    assert [(a.kinds, a.full_turn) for a in found] == [("RRRPPP", True), ("RRPPPP", True), ("RPRPPP", False)]
    assert all(a.spaces.agrees and a.spaces.redundant == 1 for a in found)


def test_the_third_assignment_stops_before_a_quarter_turn():
    pairs = [(0, 1), (1, 2), (2, 3), (0, 3)]
    joints = [Revolute(0, 1), Prismatic(1, 2), Revolute(2, 3), Prismatic(0, 3, (0.0, 1.0))]
    swinging = Mechanism(MechanismGraph(4, pairs, frame=0), joints, [Driver(0, 1)])
    assert simulate(swinging, np.linspace(0.2, 3.0, 50)).completed
    assert not simulate(swinging, np.linspace(0.2, 3.5, 50)).completed


@pytest.mark.parametrize(
    ("loops", "sentence"),
    [
        ([(0, 1, 2, 3)], "1 loops are given, but the graph has 2"),
        ([(0, 1, 2, 3), (0, 1, 3)], "from link 1 to link 3, which have no joint"),
        ([(0, 1, 2, 3), (3, 2, 1, 0)], "depend on each other"),
        ([(0, 1, 2, 3), (0, 3)], "at least three links"),
    ],
)
def test_bad_loops(loops, sentence):
    with pytest.raises(GraphError, match=sentence):
        loop_spaces(BOTH["slider-crank"].mechanism(), loops=loops)
