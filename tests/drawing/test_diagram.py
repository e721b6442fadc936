"""Kinematic diagrams: every part once, in its place, the same through both writers."""

from __future__ import annotations

import cmath
import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from graphsynth import gallery
from graphsynth.core.errors import GeometryError
from graphsynth.drawing.bodies import hull, outline, rounded, thickness
from graphsynth.drawing.diagram import draw_mechanism, mechanism_sketch, mechanism_svg
from graphsynth.drawing.export import figure_of
from graphsynth.drawing.palette import DARK, LIGHT
from graphsynth.drawing.shapes import Circle, Path, Text, placement
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

SVG = "{http://www.w3.org/2000/svg}"


def parts(svg: str) -> Counter[str]:
    return Counter(e.get("data-part") for e in ET.fromstring(svg).iter() if e.get("data-part"))


def found(svg: str, part: str) -> ET.Element:
    (one,) = [e for e in ET.fromstring(svg).iter() if e.get("data-part") == part]
    return one


def reached(motion: Any) -> np.ndarray:
    return motion.poses[motion.assembled]


def carried(pose: np.ndarray, at: tuple[float, float]) -> complex:
    return complex(pose[0], pose[1]) + cmath.exp(1j * pose[2]) * complex(*at)


def test_every_joint_is_drawn_once(motion: Any) -> None:
    svg = mechanism_svg(motion, 1)
    counted = parts(svg)
    for joint in motion.mechanism.joints:
        name = f"{joint.a}-{joint.b}"
        if isinstance(joint, Revolute | PinSlot):
            assert counted[f"joint {name}"] == 1
        if isinstance(joint, Prismatic):
            assert counted[f"block {name}"] == 1
        if isinstance(joint, PinSlot):
            assert counted[f"slot {name}"] == 1
        if isinstance(joint, Cam):
            assert counted[f"cam {name}"] == 1 and counted[f"roller {name}"] == 2  # a circle and its centre
        if isinstance(joint, Gear):
            # a circle and, unless the wheel is fixed, a spoke; a ring has a second circle
            assert counted[f"gear {name} of {joint.a}"] >= 1 and counted[f"gear {name} of {joint.b}"] >= 2
        on_frame = 0 in (joint.a, joint.b) and not isinstance(joint, Gear)
        assert (counted[f"ground {name}"] > 0) == on_frame
    for link in range(motion.mechanism.graph.links):
        assert counted[f"number {link}"] == 1
        assert counted[f"link {link}"] <= 1
    for name in motion.mechanism.points:
        assert counted[f"point {name}"] == counted[f"name {name}"] == 1
    assert sum(part.startswith("driver") for part in counted) == 1
    assert not re.search(r"\bnan\b", svg)


def test_joints_are_where_the_display_transform_puts_them(motion: Any) -> None:
    pose = reached(motion)[2]
    sketch = mechanism_sketch(motion.mechanism, reached(motion))
    svg = sketch.svg(pose.tolist())
    for joint in motion.mechanism.joints:
        if isinstance(joint, Gear | Prismatic | Cam):
            continue
        x, y = sketch.xy(carried(pose[joint.b], joint.at_b))
        circle = found(svg, f"joint {joint.a}-{joint.b}")
        assert float(circle.get("cx")) == pytest.approx(x, abs=0.0051)
        assert float(circle.get("cy")) == pytest.approx(y, abs=0.0051)
        assert 0 <= x <= sketch.width and 0 <= y <= sketch.height


def test_four_bar_positions_in_closed_form(motions: dict[str, Any]) -> None:
    """f = 90 degrees of the lambda linkage: A (0, 1), B (2, 5/2), M (4, 4)."""
    motion = motions["lambda"]
    sketch = mechanism_sketch(motion.mechanism, motion.poses)
    svg = sketch.svg(motion.poses[45].tolist())
    for part, point in (("joint 1-2", 1j), ("joint 2-3", 2 + 2.5j), ("joint 0-3", 2 + 0j), ("point M", 4 + 4j)):
        circle = found(svg, part)
        assert (float(circle.get("cx")), float(circle.get("cy"))) == pytest.approx(sketch.xy(point), abs=0.0051)


def test_pitch_circles_touch_and_keep_their_size(motions: dict[str, Any]) -> None:
    for name in ("geared", "planet"):
        motion = motions[name]
        sketch = mechanism_sketch(motion.mechanism, motion.poses)
        place = placement(motion.poses[33].tolist())
        gear = next(j for j in motion.mechanism.joints if isinstance(j, Gear))
        radii = {gear.a: gear.radius_a, gear.b: gear.radius_b}
        wheels = [
            s
            for s in sketch.shapes
            if isinstance(s, Circle) and s.part.startswith("gear") and s.radius == radii[s.link]
        ]
        assert len(wheels) == 2 and all(wheel.style.dash for wheel in wheels)
        apart = abs(place(wheels[0].link, wheels[0].centre) - place(wheels[1].link, wheels[1].centre))
        assert apart == pytest.approx(gear.radius_a - gear.radius_b if gear.internal else gear.radius_a + gear.radius_b)


def test_roller_stays_on_the_cam(motions: dict[str, Any]) -> None:
    """Over the turn the roller's centre lies on the curve that is drawn, to the chord error of two degrees."""
    motion = motions["cam"]
    sketch = mechanism_sketch(motion.mechanism, motion.poses)
    curve = next(s for s in sketch.shapes if s.part == "cam 1-2")
    roller = next(s for s in sketch.shapes if s.part == "roller 1-2")
    assert isinstance(curve, Path) and isinstance(roller, Circle)
    for pose in motion.poses[::7]:
        place = placement(pose.tolist())
        centre = place(2, roller.centre)
        ring = [place(1, z) for z in curve.runs[0]]
        near = min(
            abs(((centre - p) / (q - p)).imag * abs(q - p))
            for p, q in zip(ring, [*ring[1:], ring[0]])
            if -1e-9 <= ((centre - p) / (q - p)).real <= 1 + 1e-9
        )
        assert near < 5e-4


def test_blocks_stay_on_their_guides(motions: dict[str, Any]) -> None:
    """Over the whole motion the middle of the block lies inside the guide that is drawn."""
    motion = motions["quick return"]
    sketch = mechanism_sketch(motion.mechanism, motion.poses)
    guide = next(s for s in sketch.shapes if s.part == "guide 3-2")
    block = next(s for s in sketch.shapes if s.part == "block 3-2")
    assert isinstance(guide, Path) and isinstance(block, Path)
    ((start, stop),) = guide.runs
    for pose in motion.poses:
        place = placement(pose.tolist())
        p, q = place(3, start), place(3, stop)
        corners = [place(2, z) for z in block.runs[0]]
        middle = sum(corners) / 4
        along = ((middle - p) / (q - p)).real
        assert abs(((middle - p) / (q - p)).imag) < 1e-12 and 0 < along < 1
        for corner in corners:  # the block is parallel to the guide and does not reach past its ends
            assert 0 < ((corner - p) / (q - p)).real < 1


def test_both_writers_agree(motion: Any) -> None:
    """Circles and texts of the SVG and of matplotlib are at the same pixels."""
    pose = reached(motion)[1].tolist()
    sketch = mechanism_sketch(motion.mechanism, reached(motion))
    figure, (canvas,) = figure_of([sketch], [pose])
    svg = sketch.svg(pose)
    height = figure.bbox.height
    compared = 0
    for shape, artist in canvas._moving:
        if isinstance(shape, Circle) and shape.part.startswith("joint"):
            x, y = artist.get_transform().transform((0.0, 0.0))  # of the unit circle
            circle = found(svg, shape.part)
            assert (float(circle.get("cx")), float(circle.get("cy"))) == pytest.approx((x, height - y), abs=0.02)
            compared += 1
        elif isinstance(shape, Text):
            x, y = canvas.axes.transData.transform(artist.xy)
            written = found(svg, shape.part)
            edge, text = written  # the halo, and the letters on it
            middle = float(text.get("y")) - 0.36 * float(written.get("font-size"))
            assert (float(text.get("x")), middle) == pytest.approx((x, height - y), abs=0.02)
            assert (edge.get("x"), edge.get("y"), edge.text) == (text.get("x"), text.get("y"), text.text)
            compared += 1
    assert compared >= motion.mechanism.graph.links


def test_axes_of_the_user_show_the_mechanism_in_its_own_units(motions: dict[str, Any]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4))
    axes = figure.add_subplot(1, 2, 1)
    assert draw_mechanism(motions["lambda"], 45, ax=axes) is axes
    assert axes.get_aspect() == 1.0
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert low < -1 and high > 4.2 and bottom < -1 and top > 4.9
    own = draw_mechanism(motions["lambda"], 45)
    assert own.figure.get_size_inches()[0] > 2  # type: ignore[attr-defined]


def test_same_picture_same_bytes(motion: Any) -> None:
    assert mechanism_svg(motion, 1) == mechanism_svg(motion, 1)


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_units_do_not_matter(size: float) -> None:
    graph_pose = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.7), (0.0, 0.0, 0.2), (0.0, 0.0, 1.0)]

    def scaled(k: float) -> str:
        from graphsynth.structure.graph import MechanismGraph

        graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
        z = [0j, cmath.exp(0.7j), 2 + 2j, 2 + 0j]
        at = [
            [(w * cmath.exp(-1j * row[2]) * k) for w in z] for row in graph_pose
        ]  # the four joints in the frame of every link
        joints = [
            Revolute(a, b, (at[a][j].real, at[a][j].imag), (at[b][j].real, at[b][j].imag))
            for j, (a, b) in enumerate([(0, 1), (1, 2), (2, 3), (0, 3)])
        ]
        return mechanism_svg(Mechanism(graph, joints, pose=tuple(graph_pose)))

    one, other = (list(ET.fromstring(scaled(k)).iter()) for k in (1.0, size))
    assert [e.tag for e in one] == [e.tag for e in other]
    for first, second in zip(one, other):
        for key in ("cx", "cy", "r", "x", "y", "width"):
            if first.get(key) is not None:
                assert float(first.get(key)) == pytest.approx(float(second.get(key)), abs=0.02)


def test_what_cannot_be_drawn_is_said_in_a_sentence(motions: dict[str, Any]) -> None:
    stops = motions["stops"]
    with pytest.raises(GeometryError, match=r"sample 100 cannot be drawn, it is not assembled: group 0"):
        mechanism_svg(stops, 100)
    with pytest.raises(GeometryError, match="sample 999 does not exist; the motion has 181"):
        mechanism_svg(stops, 999)
    with pytest.raises(GeometryError, match="no pose to draw"):
        mechanism_svg(stops.mechanism)
    with pytest.raises(GeometryError, match="not finite cannot be drawn"):
        mechanism_svg(stops.mechanism, np.full((4, 3), math.nan))
    with pytest.raises(GeometryError, match="for each of the 4 links"):
        mechanism_svg(stops.mechanism, np.zeros((3, 3)))


def test_paths_of_named_points_have_no_part_beyond_the_end(motions: dict[str, Any]) -> None:
    stops = motions["stops"]
    sketch = mechanism_sketch(stops.mechanism, reached(stops))
    path = next(s for s in sketch.shapes if s.part == "path M")
    assert isinstance(path, Path) and len(path.runs) == 1
    assert len(path.runs[0]) == int(stops.assembled.sum())
    np.testing.assert_allclose(path.runs[0], stops.point("M").position[stops.assembled] @ [1, 1j], atol=1e-14)


def test_driven_link_and_arrow_have_their_own_colour(motions: dict[str, Any]) -> None:
    svg = mechanism_svg(motions["lambda"], 0)
    assert found(svg, "link 1").get("stroke") == LIGHT["b"] != LIGHT["link"] == found(svg, "link 3").get("stroke")


def test_arrow_turns_with_the_sense_of_the_driver(motions: dict[str, Any]) -> None:
    from dataclasses import replace

    from graphsynth.mechanism.laws import Driver, Linear

    def swept(rate: float) -> float:
        old = motions["lambda"].mechanism
        mechanism = replace(old, drivers=(Driver(0, 1, Linear(rate)),))
        sketch = mechanism_sketch(mechanism, motions["lambda"].poses[:5])
        arc = next(s for s in sketch.shapes if s.part == "driver 0-1")
        assert isinstance(arc, Path)
        return sum(cmath.phase(q / p) for p, q in zip(arc.runs[0], arc.runs[0][1:]))  # about the pivot, the origin

    assert swept(2.0) == pytest.approx(math.radians(160)) and swept(-1.0) == pytest.approx(-math.radians(160))


def test_a_chain_has_no_ground_and_no_driver(motions: dict[str, Any]) -> None:
    motion = motions["lambda"]
    sketch = mechanism_sketch(motion.mechanism, motion.poses[3], grounded=False)
    counted = parts(sketch.svg(motion.poses[3].tolist()))
    assert not any(part.startswith(("ground", "driver")) for part in counted)
    assert counted["link 0"] == 1


def strokes(sketch: Any, pose: np.ndarray) -> np.ndarray:
    """Points of all that is drawn but the paths of points, every two pixels."""
    place, found = placement(pose.tolist()), []
    for shape in sketch.shapes:
        if isinstance(shape, Circle):
            found += [place(shape.link, shape.centre) + cmath.rect(shape.radius, k) for k in range(60)]
        elif isinstance(shape, Path) and shape.layer != "trace":
            for run in shape.runs:
                ends = [place(shape.link, point) for point in [*run, *run[: int(shape.closed)]]]
                for p, q in pairwise(ends):
                    found += list(np.linspace(p, q, 2 + int(abs(q - p) / (2.0 * sketch.pixel))))
    return np.array(found)


@pytest.mark.parametrize("name", gallery.__all__)
def test_letters_keep_off_lines(name: str) -> None:
    """Names of points in 85 % of the poses; of all letters two thirds, though joints of these linkages meet."""
    motion = getattr(gallery, name)().simulate()
    poses = reached(motion)[:: max(1, len(motion.poses) // 16)]
    sketch = mechanism_sketch(motion.mechanism, reached(motion))
    covered: dict[str, list[bool]] = {}
    for pose in poses:
        taken, place = strokes(sketch, pose), placement(pose.tolist())
        for text in (shape for shape in sketch.shapes if isinstance(shape, Text)):
            off = (taken - place(text.link, text.at)) / (text.size * sketch.pixel)
            covered.setdefault(text.text, []).append(bool(((abs(off.real) < 0.3) & (abs(off.imag) < 0.36)).any()))
    for point in motion.mechanism.points:
        assert np.mean(covered[point]) <= 0.15, point
    assert np.mean(list(covered.values())) < 0.34


def test_palette_has_the_same_names_for_light_and_dark_pages() -> None:
    assert LIGHT.keys() == DARK.keys()

    def luminance(colour: str) -> float:
        channels = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for theme in (LIGHT, DARK):  # WCAG contrast: 4.5 for letters, 3 for lines
        paper = luminance(theme["paper"])
        for name, least in (
            ("ink", 7),
            ("note", 4.5),
            ("link", 7),
            ("a", 3),
            ("b", 3),
            ("c", 3),
            ("d", 3),
            ("soft", 3),
        ):
            one, two = sorted((luminance(theme[name]), paper), reverse=True)
            assert (one + 0.05) / (two + 0.05) >= least, (name, theme[name])


POINTS = st.lists(st.complex_numbers(max_magnitude=1e3, allow_nan=False, allow_infinity=False), min_size=1, max_size=9)


@example([1 + 0j, 7.8e-146 + 0j, 1j, 7.8e-146 + 2j])  # in line but for an underflow
@given(POINTS)
def test_hull_holds_every_point_and_turns_left(points: list[complex]) -> None:
    corners = hull(points)
    size = max(abs(p - q) for p in points for q in points)
    if len(corners) < 3:
        assert set(corners) <= set(points)
        return
    for k, p in enumerate(corners):
        q = corners[(k + 1) % len(corners)]
        for z in points:
            assert ((q - p).conjugate() * (z - p)).imag >= -1e-8 * size * size


@given(POINTS, st.floats(0.1, 5.0))
def test_rounded_outline_keeps_its_distance(points: list[complex], radius: float) -> None:
    corners = outline(points, 1e-3)
    if len(corners) < 2:
        return
    ring = rounded(corners, radius)
    for z in ring:
        assert min(abs(z - c) for c in corners) == pytest.approx(radius, rel=1e-6)
    assert thickness(hull(ring)) >= 1.9 * radius
