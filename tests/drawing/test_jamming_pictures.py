"""Pictures of the jammed bearing show what the results say."""

import io
import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.crossing_pictures import crossing_picture, region_picture
from graphsynth.drawing.jamming_pictures import area_chart, area_picture, report_picture, section_picture, space_picture
from graphsynth.jamming import Bearing, ToleranceBox, assess_jamming
from graphsynth.jamming.bearing.areas_enclosed import area_curve
from graphsynth.jamming.intersection.boxes import krawczyk_boxes
from graphsynth.jamming.intersection.hull import circle_ellipse, exact_hull


def drawn(figure):
    """Write the figure, which lays it out; warnings are errors."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=40)
    assert stream.getbuffer().nbytes > 2000
    return figure


def rectangles(axes):
    return [p.get_bbox() for p in axes.patches if type(p).__name__ == "Rectangle"]


@pytest.mark.long
def test_boxes_of_the_crossings():
    problem = circle_ellipse(5, 6, 4, 1, "0.1")
    boxes = krawczyk_boxes(problem, tolerance=0.05)
    whole, detail, unrolled = drawn(crossing_picture(problem, boxes)).axes
    four = exact_hull(problem).four
    for shown, lo, hi in zip(rectangles(whole), four.lo, four.hi):
        np.testing.assert_allclose([shown.x0, shown.y0, shown.x1, shown.y1], [*lo, *hi])
    assert len(rectangles(whole)) == 4
    assert len(rectangles(detail)) == 1  # the exact hull
    assert sum(len(c.get_paths()) for c in detail.collections) == len(boxes.boxes)
    solutions = next(p for p in detail.patches if type(p).__name__ == "Polygon").get_xy()
    hull = exact_hull(problem).hull
    np.testing.assert_allclose(solutions.min(axis=0), hull.lo, rtol=1e-12)  # the outline spans its hull
    np.testing.assert_allclose(solutions.max(axis=0), hull.hi, rtol=1e-12)
    assert len(unrolled.patches) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "problem",
    [circle_ellipse(6, 6, 4), circle_ellipse(2, 2, 2), circle_ellipse(7, 6, 4), circle_ellipse(5, 6, 4, 20, "0.8")],
)  # fmt: skip
def test_extreme_problems_are_drawn(problem):
    whole = drawn(crossing_picture(problem, krawczyk_boxes(problem, tolerance=0.1))).axes[0]
    assert len(rectangles(whole)) == len(exact_hull(problem).four)
    drawn(region_picture(problem))


@pytest.mark.slow
def test_region_states_its_exaggeration():
    problem = circle_ellipse("17.5", "17.53", "17.46")
    assert "× 80" in drawn(region_picture(problem)).axes[0].get_title()
    assert "× 25" in region_picture(problem, 25).axes[0].get_title()
    assert "to scale" in region_picture(problem, 1).axes[0].get_title()
    labels = region_picture(problem).axes[0].get_legend_handles_labels()[1]
    assert {"ellipse \\ circle: free gap", "circle \\ ellipse: interference"} <= set(labels)
    with pytest.raises(GeometryError, match="exaggeration = 0"):
        region_picture(problem, 0)


def test_section_without_and_with_jamming():
    free, jammed = drawn(section_picture(Bearing(), (0.0023, 0.0133312592), ("free", "jammed"), 40.0)).axes
    assert "free: 0." in free.get_title()
    assert "jams: 0.0351 mm" in jammed.get_title()
    marks = [[t.get_text() for t in axes.texts] for axes in (free, jammed)]
    assert marks == [[], ["overlap", "overlap"]]
    # the ends of the bearing's wall, scaled back, are where the tilt puts them
    S, C = math.sin(0.0133312592), math.cos(0.0133312592)
    wall = next(line for line in jammed.lines if line.get_label() == "bearing")
    hole = next(line for line in jammed.lines if line.get_label() == "wall of the hole")
    beyond = (wall.get_xdata()[1] - hole.get_xdata()[0]) / 40.0
    assert beyond == pytest.approx(17.5 * C + 5 * S - 17.53, rel=1e-9)
    with pytest.raises(GeometryError, match="tilts is empty"):
        section_picture(Bearing(), ())
    with pytest.raises(GeometryError, match="exaggeration"):
        section_picture(Bearing(), (0.1,), exaggeration=math.nan)


@pytest.mark.long
def test_cylinders_in_space_without_and_with_jamming():
    from matplotlib.colors import to_rgb

    from graphsynth.drawing.jamming_pictures import wall
    from graphsynth.drawing.palette import LIGHT

    figure = drawn(space_picture(Bearing(), (0.0023, 0.0133312592), ("free", "jammed"), 60.0))
    free, jammed = figure.axes
    assert "free: 0." in free.get_title() and "jams: 0.0351 mm" in jammed.get_title()
    assert "× 60" in figure.get_suptitle()
    jam = np.array(to_rgb(LIGHT["jam"]))
    shares = []
    for axes in (free, jammed):
        colours = axes.collections[1].get_facecolor()[:, :3]
        shares.append(np.mean(np.linalg.norm(np.cross(colours, jam), axis=1) < 1e-9))
    assert shares[0] == 0.0 and 0.05 < shares[1] < 0.5  # only what stands out of the hole has the colour of a jam
    # the outermost point stands out by the gap of condition A, and is drawn where the factor puts it
    phi, z = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(-5, 5, 11))
    x, y, up, out = wall(Bearing(), 0.0133312592, 60.0, phi, z)
    S, C = math.sin(0.0133312592), math.cos(0.0133312592)
    assert out.max() == pytest.approx(17.5 * C + 5 * S - 17.53, rel=1e-9)
    assert np.hypot(x, y).max() == pytest.approx(17.5 + 60 * (17.5 * C + 5 * S - 17.5), rel=1e-12)
    assert up.max() == pytest.approx(5 * C + 17.5 * S)
    for text, arguments in [
        ("tilts is empty", (Bearing(), ())), ("exaggeration", (Bearing(), (0.1,), (), math.nan)),
        ("must lie between", (Bearing(), (1.6,))), ("must lie between", (Bearing(), (math.nan,))),
        ("interference fit", (Bearing(clearance=-0.01), (0.1,))),
    ]:  # fmt: skip
        with pytest.raises(GeometryError, match=text):
            space_picture(*arguments)


@pytest.mark.long
def test_areas_with_the_windows_of_the_source():
    curve = area_curve(f=np.radians(np.linspace(90, 450, 181)))
    figure = drawn(area_picture(curve))
    assert [axes.get_xlim() for axes in figure.axes[1:]] == [(90.0, 115.5), (414.0, 450.0)]
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines["ordinate of the source"], curve.source_ordinate)
    np.testing.assert_array_equal(lines["interference, one lid (B)"], curve.lid.mid)
    assert "measures no jamming" in figure._supxlabel.get_text()


def test_chart_is_themed_svg():
    curve = area_curve(f=np.radians(np.linspace(90, 450, 181)))
    text = area_chart(curve, (414.0, 450.0)).svg()
    assert text.startswith('<svg class="gs"')
    assert "ordinate of the source" in text
    with pytest.raises(GeometryError, match="holds no angle"):
        area_chart(curve, (500.0, 600.0))


def bands(axes):
    """Shaded pieces with their colours, degrees."""
    return [(p.get_x(), p.get_x() + p.get_width(), p.get_facecolor()[:3]) for p in axes.patches]


@pytest.mark.long
def test_report_shows_what_is_proved():
    report = assess_jamming(ToleranceBox(alpha="1/30", azimuth="0 +- 0.05"), samples=91)
    figure = drawn(report_picture(report))
    tilts, gaps = figure.axes
    assert report.statement == " ".join(tilts.get_title().split())  # set in several lines
    turn = np.linspace(0.05, 359.95, 700)
    shown = {f: [c for a, b, c in bands(gaps) if a < f < b] for f in turn}
    assert all(len(colours) == 1 for colours in shown.values())  # the bands cover the turn once
    assert len({colours[0] for colours in shown.values()}) == 3
    inner = report.certificate.arcs.inner[0]
    middle = math.degrees(0.5 * (inner.start + inner.stop))
    assert any(a < middle < b and b - a == pytest.approx(math.degrees(inner.length)) for a, b, _ in bands(tilts))
    assert bands(drawn(report_picture(assess_jamming(ToleranceBox(), certify=False, samples=31))).axes[0]) == []
    stops = report_picture(assess_jamming(ToleranceBox(2, 1, 1, 1, "0.05"), samples=31))
    assert any("where it can be assembled" in text.get_text() for text in stops.legends[0].get_texts())
