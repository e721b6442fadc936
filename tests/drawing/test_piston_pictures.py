"""Pictures of the floating piston: what is drawn is where the mechanism is."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.piston import FloatingPiston
from graphsynth.systems.piston.loads import CompressorCycle, PistonFriction, PistonMasses
from graphsynth.systems.piston.machine import PistonMachine
from graphsynth.systems.piston.pictures import (
    indicator_chart,
    piston_animation,
    piston_motion_chart,
    piston_sketch,
    reaction_chart,
    side_load_chart,
    torque_chart,
)

SLIDER = FloatingPiston.crank_slider(0.05, 0.2, 0.01, lead=0.13, cylinder_angle=0.05)
YOKE = FloatingPiston.scotch_yoke(0.05, lead=0.22)
MACHINES = {
    name: PistonMachine(
        mechanism, PistonMasses(2.0, 1.0, 3.0, 1.0), CompressorCycle(0.1, 1e5, 6e5),
        PistonFriction(0.05, 0.1, 0.08), speed=50.0,
    )
    for name, mechanism in (("slider", SLIDER), ("yoke", YOKE))
}  # fmt: skip


@pytest.mark.parametrize("mechanism", [SLIDER, YOKE, SLIDER.without_group(), YOKE.without_group()])
@pytest.mark.parametrize("angle", [0.0, 1.0, 4.0])
def test_everything_lies_in_the_picture(mechanism, angle):
    sketch = piston_sketch(mechanism, angle)
    root = ET.fromstring(sketch.svg())
    width, height = (float(v) for v in root.get("viewBox").split()[2:])
    for shape in sketch.shapes:
        points = [p for run in getattr(shape, "runs", ()) for p in run] or [getattr(shape, "at", None) or 0j]
        for point in points:
            x, y = sketch.xy(point)
            assert 0.0 <= x <= width
            assert 0.0 <= y <= height
    letters = {element.text for element in root.iter() if element.tag.endswith("text")}
    assert letters == {"1", "2", "3"} | ({"4"} if mechanism.group is not None else set())


def test_the_piston_is_drawn_where_it_is():
    for angle in (0.3, 2.0, 5.0):
        sketch = piston_sketch(SLIDER, angle, numbers=False)
        circles = [shape.centre for shape in sketch.shapes if hasattr(shape, "centre")]
        pose = SLIDER.poses([angle])[0]
        for link in (2, 3):  # crank pin, crosshead pin
            assert min(abs(complex(*pose[link, :2]) - centre) for centre in circles) < 1e-12
        blocks = [np.mean(s.runs[0]) for s in sketch.shapes if getattr(s, "closed", False) and s.style.fill == "fill"]
        assert min(abs(complex(*pose[4, :2]) - centre) for centre in blocks) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_charts_show_the_loads(machine):
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    loads, plain = machine.loads(angle), machine.without_group().loads(angle)
    chart = side_load_chart(machine, length=0.1)
    kilo = 1e-3 if "kN" in chart.ylabel else 1.0
    by_name = {line.label: np.asarray(line.y) for line in chart.lines}
    slider = machine.mechanism is SLIDER
    shown = (plain.wall, loads.wall, loads.guide) if slider else (
        plain.edges(0.1)[1], loads.edges(0.1)[1], loads.edges(0.1, "guide")[1]
    )  # fmt: skip
    for name, values in zip(("plain piston", "floating piston", "its crosshead"), shown):
        assert np.array_equal(by_name[name], kilo * values)
    assert bool(chart.levels) is not slider  # the slider's slot slides
    assert np.array_equal(np.asarray(torque_chart(machine).lines[0].y), loads.torque)
    polar = {line.label: np.column_stack([line.x, line.y]) for line in reaction_chart(machine).lines}
    assert np.allclose(np.hypot(*polar["bearing"].T), 1e-3 * np.hypot(*loads.bearing.T), rtol=1e-14)
    assert ("crosshead pin" in polar) is slider
    ring = indicator_chart(machine).lines[0]
    x, y = np.asarray(ring.x), np.asarray(ring.y)
    area = 0.5 * ((y[1:] + y[:-1]) * np.diff(x)).sum()
    assert area == pytest.approx(machine.gas.work(machine.mechanism.stroke), rel=1e-3)  # mm times kN is J
    for drawn in (chart, reaction_chart(machine), torque_chart(machine)):
        assert drawn.svg().startswith('<svg class="gs"')


def test_motion_charts():
    for order in range(3):
        chart = piston_motion_chart(SLIDER, order)
        motion = SLIDER.motion(np.linspace(0.0, 2.0 * np.pi, 721))
        shown = np.asarray(chart.lines[0].y) * 1e-3
        assert np.ptp(shown - motion.piston[order]) < 1e-15
        assert len(chart.marks) == 2
    assert len(piston_motion_chart(SLIDER.without_group()).lines) == 1


def test_animation_is_one_page():
    page = piston_animation(SLIDER, title="Floating piston", frames=24)
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert not re.search(r'(?:src|href)="http', page)
    assert '"loop":true' in page


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: piston_motion_chart(SLIDER, 3), "order = 3"),
        (lambda: side_load_chart(MACHINES["slider"].without_group()), "no second group"),
        (lambda: piston_sketch(SLIDER, float("nan")), "angle"),
    ],
)
def test_bad_input_gets_a_sentence(make, sentence):
    with pytest.raises(GeometryError, match=sentence):
        make()
