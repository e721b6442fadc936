"""Mechanisms from lengths, coordinates, sketches and graphs."""

import json
import math

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import residual

PLACES = {"A": (0, 0), "B": (0, 1), "C": (3, 3), "D": (4, 0), "P": (2, 4)}


def closes(mechanism):
    return np.abs(residual(mechanism.joints, mechanism.pose)).max() < 1e-12


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("lengths", [(2, 1, 2.5, 2.5), (3, 2, 2.5, 2), (1, 3, 3.2, 3.1), (4, 2, 1, 1.4)])
def test_four_bar_is_assembled_where_it_starts(lengths, branch):
    linkage = gs.Mechanism.four_bar(*lengths, coupler_point=(1, 0.5), branch=branch)
    assert closes(linkage)
    motion = linkage.simulate()
    assert motion.completed and motion.assembled.all()
    B, A, D = (
        motion.point(*where).position for where in ((3, (lengths[3], 0)), (1, (lengths[1], 0)), (0, (lengths[0], 0)))
    )
    side = (D - A)[:, 0] * (B - A)[:, 1] - (D - A)[:, 1] * (B - A)[:, 0]
    assert (np.sign(side) == branch).all()


def test_four_bar_agrees_with_the_closed_form():
    closed = gs.LambdaLinkage().positions(np.linspace(0, 2 * np.pi, 361))
    path = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0)).simulate().point("P").position
    assert np.abs(path - closed.M[:, :2]).max() < 1e-13


@pytest.mark.parametrize("lengths", [(9, 1, 2, 3), (1, 2, 9, 3)])
def test_four_bar_that_cannot_be_assembled(lengths):
    with pytest.raises(GeometryError, match=r"longest link, 9, is longer .* 6: "):
        gs.Mechanism.four_bar(*lengths)


def test_four_bar_at_an_angle_it_does_not_reach():
    with pytest.raises(GeometryError, match="do not meet over the distance 5"):
        gs.Mechanism.four_bar(3, 2, 2.5, 2, crank_angle="180 deg")


@pytest.mark.parametrize("crank, rod, offset", [(1, 3, 0), (1, 3, 0.4), (3, 1, 0.2), (1, 2, -2.5)])
@pytest.mark.parametrize("branch", [1, -1])
def test_slider_crank_agrees_with_its_formula(crank, rod, offset, branch):
    linkage = gs.Mechanism.slider_crank(crank, rod, offset, branch=branch)
    assert closes(linkage)
    motion = linkage.simulate()
    assert motion.completed
    phi = motion.inputs
    x = crank * np.cos(phi) + branch * np.sqrt(rod**2 - (offset - crank * np.sin(phi)) ** 2)
    assert np.abs(motion.point("C").position - np.column_stack([x, np.full_like(x, offset)])).max() < 1e-12


@pytest.mark.parametrize("kind, ternary", [("watt", {0, 3}), ("stephenson", {0, 2})])
def test_six_bars_have_the_chain_they_are_named_after(kind, ternary):
    linkage = gs.Mechanism.six_bar(kind, (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    assert closes(linkage)
    assert {k for k, degree in enumerate(linkage.graph.degrees) if degree == 3} == ternary
    adjacent = tuple(sorted(ternary)) in {(a, b) for a, b, _ in linkage.graph.joints}
    assert adjacent == (kind == "watt")


def test_points_resolve_a_joint_of_three_links():
    """Peaucellier's cell: three links meet twice, the graph has one joint for each link beyond the first."""
    s = math.sqrt(7.0)
    places = {"O": (0, 0), "Q": (1.5, 0), "R": (3, 0), "U": (4.5, s), "V": (4.5, -s), "W": (6, 0)}
    cell = gs.Mechanism.from_points(places, ["OU", "OV", "UR", "RV", "VW", "WU", "QR"], "OQ", "QR")
    assert cell.graph.links == 8 and len(cell.graph.joints) == 10 and cell.graph.mobility == 1
    assert closes(cell)
    assert cell.drivers[0].pair == (0, 7)
    assert set(cell.points) == set()


def test_points_of_one_link_are_traced_and_input_zero_is_the_drawing():
    linkage = gs.Mechanism.from_points(PLACES, ["AB", "BCP", "CD"], "AD", "AB")
    motion = linkage.simulate([0.0, 0.1])
    assert list(linkage.points) == ["P"]
    assert np.allclose(motion.point("P").position[0], PLACES["P"], atol=1e-15)


def test_names_of_several_letters_need_spaces():
    long = {f"{name}1": place for name, place in PLACES.items()}
    linkage = gs.Mechanism.from_points(long, ["A1 B1", "B1 C1 P1", ["C1", "D1"]], "A1 D1", "A1 B1")
    assert linkage.graph == gs.Mechanism.from_points(PLACES, ["AB", "BCP", "CD"], "AD").graph


def test_a_slide_is_a_slider_crank():
    drawn = gs.Mechanism.from_points(
        {"A": (0, 0), "B": (1, 0), "C": (4, 0.0), "E": (9, 0)}, ["AB", "BC"], "AE", slides={"C": "AE"}
    )
    known = gs.Mechanism.slider_crank(1, 3)
    assert drawn.graph.key == known.graph.key
    assert np.allclose(drawn.simulate().point(3, (4, 0)).position, known.simulate().point("C").position, atol=1e-12)


def test_a_cylinder_is_driven():
    lift = gs.Mechanism.from_points({"A": (0, 0), "B": (2, 0.5), "C": (1, -1)}, ["AB"], "AC", cylinders=["CB"])
    assert lift.graph.links == 4 and lift.drivers[0] == gs.Driver(2, 3)
    motion = lift.simulate(np.linspace(0.0, 0.3, 31))
    length = np.hypot(*(motion.point(1, (2, 0.5)).position - (1, -1)).T)
    assert np.allclose(length, math.hypot(1, 1.5) + motion.inputs, atol=1e-12)


@pytest.mark.parametrize(
    "change, said",
    [
        ({"links": ["AB", "BCZ", "CD"]}, "names the point 'Z', which has no place"),
        ({"links": ["AB", "B", "CD"]}, "link 2 has the points"),
        ({"driver": "BC1"}, "names the point '1'"),
        ({"driver": (1, 3)}, r"driver \(1, 3\) is no joint; .* one of 0-1, 0-3, 1-2, 2-3"),
        ({"links": ["AB", "ABCP", "CD"]}, "share two points, so they are one link"),
        ({"slides": {"P": "AP"}}, "no two points of one link"),
    ],
)
def test_drawings_that_are_none(change, said):
    with pytest.raises(GeometryError, match=said):
        gs.Mechanism.from_points(**{"points": PLACES, "links": ["AB", "BCP", "CD"], "frame": "AD", **change})


def test_sketch_of_the_atlas_page():
    """The example of the page's editor, in pixels with y down."""
    sketch = {
        "pivots": [[80, 280], [120, 140], [260, 80], [300, 200], [240, 280], [420, 120], [480, 280]],
        "links": [[0, 4, 6], [0, 1], [1, 2], [2, 3, 5], [3, 4], [5, 6]],
        "frame": 0,
    }
    linkage = gs.Mechanism.from_sketch(json.dumps(sketch))
    assert linkage.graph.links == 6 and linkage.graph.mobility == 1
    assert linkage.joint(0, 1).at_a == (80.0, -280.0)
    with pytest.raises(GeometryError, match="has no frame"):
        gs.Mechanism.from_sketch({**sketch, "frame": None})
    with pytest.raises(GeometryError, match="not read"):
        gs.Mechanism.from_sketch("{}")


def test_graph_with_places_and_without():
    graph = gs.MechanismGraph(4, [(0, 1), (0, 3), (1, 2), (2, 3)], frame=0)
    assert closes(gs.Mechanism.from_graph(graph, [(0, 0), (4, 0), (0, 1), (3, 3)], driver=(0, 3)))
    assert gs.Mechanism.from_graph(graph).simulate().closure.closed
    with pytest.raises(GeometryError, match="1 places for 4 joints"):
        gs.Mechanism.from_graph(graph, [(0, 0)])


def test_angles_with_units():
    assert gs.degrees(180) == math.pi
    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, crank_angle="30 deg")
    assert linkage.simulate().inputs[0] == pytest.approx(math.pi / 6)
    assert gs.simulate(linkage, ["0 deg", "90 deg"]).inputs[1] == math.pi / 2
    assert len(gs.simulate(linkage, "0..1 turn").inputs) == 361
    for wrong in ("thirty deg", "30", "30 mm"):
        with pytest.raises(GeometryError, match="is no angle"):
            gs.Mechanism.four_bar(2, 1, 2.5, 2.5, crank_angle=wrong)


def test_simulate_takes_what_embody_returns():
    found = gs.embody(gs.MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]))
    assert gs.simulate(found).closure.closed
    with pytest.raises(GeometryError, match="int is not a Mechanism"):
        gs.simulate(3)
