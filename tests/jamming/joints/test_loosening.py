"""Which joint to loosen first: solved again from scratch; pictures; offsets of the axes; error against time."""

import math

import mpmath
import numpy as np
import pytest
from coupled_oracles import driven_pair, embodied, four_bar

from graphsynth import simulate
from graphsynth.core.errors import GeometryError
from graphsynth.drawing.coupled_pictures import clearance_picture, sensitivity_picture
from graphsynth.jamming import Bearing
from graphsynth.jamming.joints import (
    RIGID,
    SPHERICAL,
    JointLimits,
    Misalignment,
    assess_coupled,
    bearing_limits,
    compare_sensitivities,
)


@pytest.fixture(scope="module")
def eight():
    mechanism = embodied(8, 3)
    base, link = driven_pair(mechanism)
    motion = simulate(mechanism, np.linspace(0.0, 2.0 * math.pi, 13))
    limits = {joint.pair: JointLimits(0.006, 0.002) for joint in mechanism.joints}
    return motion, limits, Misalignment(base, link, 0.012, 0.3)


@pytest.mark.slow
def test_every_row_solved_again(eight):
    """Each limit of an eight-link mechanism: the whole motion assessed anew with that limit larger, and without it."""
    motion, limits, tilt = eight
    table = compare_sensitivities(motion, limits, tilt, by=0.1)
    plain = assess_coupled(motion, limits, tilt)
    assert table.scale == plain.smallest_scale and table.worst_input == plain.smallest_scale_input
    driven = (min(tilt.base, tilt.link), max(tilt.base, tilt.link))
    assert {(row.joint, row.what) for row in table.rows} == {
        (pair, what) for pair in limits for what in ("tilt", "play") if pair != driven
    }

    def anew(row, factor):
        old = limits[row.joint]
        new = (
            JointLimits(old.tilt * factor, old.axial_clearance)
            if row.what == "tilt"
            else JointLimits(old.tilt, old.axial_clearance * factor)
        )
        return assess_coupled(motion, {**limits, row.joint: new}, tilt).smallest_scale

    for row in table.rows[:4] + table.rows[-1:]:
        assert row.scale == pytest.approx(anew(row, 1.1), rel=1e-11)
        assert row.without == pytest.approx(anew(row, math.inf), rel=1e-9)
        assert row.gain <= row.promised + 1e-9 and row.scale <= row.without * (1 + 1e-12)
    gains = [round(row.gain, 9) for row in table.rows]
    assert gains == sorted(gains, reverse=True) and gains[0] > 0.05 and gains[-1] == 0.0
    assert {(one.joint, one.what): one.gain for one in plain.sensitivities} == pytest.approx(
        {(row.joint, row.what): row.promised for row in table.rows if row.promised > 1e-9}
    )


def test_another_input_binds_next():
    """Lambda linkage over the turn: loosening B gains nothing at 90 degrees, where p is B."""
    motion = simulate(four_bar(), np.radians(np.arange(0.0, 361.0, 10.0)))
    table = compare_sensitivities(motion, Bearing(), Misalignment(0, 1, 0.01), by=0.2)
    rows = {row.joint: row for row in table.rows}
    assert rows[(2, 3)].gain == 0.0 and rows[(2, 3)].without == table.scale
    for pair in ((1, 2), (0, 3)):
        assert rows[pair].promised == pytest.approx(0.5) and 0.0 < rows[pair].gain <= 0.5
    text = str(table)
    assert "joint 0-3 tilt" in text and "+20%" in text and "1 other limits" in text
    frame = table.to_pandas()
    assert list(frame.columns)[:3] == ["joint", "what", "scale"] and len(frame) == 3


@pytest.mark.parametrize(
    ("by", "inputs", "text"), [(0.0, [0.0], "by = 0.0"), (-1.0, [0.0], "by"), (math.nan, [0.0], "by")]
)
def test_bad_growth(by, inputs, text):
    with pytest.raises(GeometryError, match=text):
        compare_sensitivities(simulate(four_bar(), inputs), Bearing(), Misalignment(0, 1, 0.01), by=by)


@pytest.mark.long
def test_pictures(eight, tmp_path):
    motion, limits, tilt = eight
    report = assess_coupled(motion, limits, tilt)
    figure = clearance_picture(report)
    scale, uses = figure.axes[:2]
    assert scale.lines[0].get_ydata() == pytest.approx(report.allowed_scale)
    used = uses.collections[0].get_array()
    assert np.nanmax(used) == pytest.approx(report.factor.max())  # the binding joint uses all there is
    assert len(uses.get_yticklabels()) == used.shape[0] == 9  # the motor's joint has no clearance to use
    picture = sensitivity_picture(compare_sensitivities(motion, limits, tilt))
    assert "other limits gain nothing" in picture.axes[0].get_xlabel()
    figure.savefig(tmp_path / "clearance.png")
    proof = assess_coupled(simulate(four_bar(), [0.0, 0.5, 1.0]), Bearing(), Misalignment(0, 1, 0.01), certify=True)
    labels = clearance_picture(proof).axes[0].get_legend_handles_labels()[1]
    assert "free, proved" in labels and "jams, proved" not in labels


def test_pictures_of_nothing():
    motion = simulate(four_bar(), [0.0, 0.5])
    with pytest.raises(GeometryError, match="finite factor"):
        clearance_picture(assess_coupled(motion, RIGID, Misalignment(0, 1, 0.01)))
    with pytest.raises(GeometryError, match="clearance"):
        clearance_picture(assess_coupled(motion, SPHERICAL, Misalignment(0, 1, 0.01)))
    with pytest.raises(GeometryError, match="gains nothing"):
        sensitivity_picture(compare_sensitivities(motion, SPHERICAL, Misalignment(0, 1, 0.01)))


@pytest.mark.parametrize("condition", ["A", "B", "general"])
def test_offset_axis(condition):
    """Level L2: the tilted pin pushed aside by e, as a body in the hole: 40 digits, worst direction of the tilt."""
    bearing, e = Bearing(17.5, 10.0, 0.03, 8.0), 0.012
    limit = bearing_limits(bearing, condition, radial_offset=e)
    with mpmath.workdps(40):
        R, c = mpmath.mpf(bearing.Rb), mpmath.mpf(bearing.clearance)
        pin, hole = {"A": (5.0, mpmath.inf), "B": (mpmath.inf, 5.0), "general": (5.0, 4.0)}[condition]

        def reach(t):
            """Farthest point of the pin from the axis of the hole, inside the hole's length."""
            rim = R * mpmath.cos(t) + pin * mpmath.sin(t)  # if the pin's rim is inside
            mouth = (R + hole * mpmath.sin(t)) / mpmath.cos(t)  # if the hole's mouth is along the pin
            return min(rim, mouth) + e

        for t, side in ((limit.tilt_range[0], -1), (limit.tilt_range[1], 1)):
            assert side * (reach(mpmath.mpf(t)) - (R + c)) >= -(mpmath.mpf(10) ** -17)
    assert limit.tilt < bearing_limits(bearing, condition).tilt
    assert limit.tilt == pytest.approx(bearing_limits(Bearing(17.5, 10.0, 0.018, 8.0), condition).tilt, rel=1e-12)


@pytest.mark.parametrize(("offset", "text"), [(0.04, "pushed"), (-0.1, "zero or more"), (math.nan, "zero or more")])
def test_offsets_that_make_no_sense(offset, text):
    with pytest.raises(GeometryError, match=text):
        bearing_limits(Bearing(), radial_offset=offset)
    with pytest.raises(GeometryError, match="pushed"):
        bearing_limits(Bearing(), radial_offset=0.02, clearance_tolerance=0.02)
