"""Pictures of drives: what is drawn is what was computed, units on the axes, failures visible."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.drawing.drive_pictures import drive_curves, reduction_picture
from graphsynth.drawing.palette import DARK, LIGHT
from graphsynth.drawing.plots import themed_svg
from graphsynth.dynamics.motors import DCMotor
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
from graphsynth.systems.platform.resistance import (
    resistance_effect,
    resistance_picture,
    ripple_map,
    ripple_map_picture,
    ripple_picture,
)

DRIVE = MotorDrivenPlatform.source(DCMotor(5.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0))


def drawn(figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=50)
    return stream.getvalue()


def test_drive_curves_show_every_run() -> None:
    times = np.linspace(0.0, 1.0, 101)
    runs = {"whole": DRIVE.simulate(times), "stopped": DRIVE.simulate(times, max_steps=120)}
    figure = drive_curves(runs)
    torque, speed = figure.axes
    assert (torque.get_ylabel(), speed.get_ylabel()) == ("torque [N m]", "crank speed [rad/s]")
    np.testing.assert_array_equal(torque.lines[0].get_ydata(), runs["whole"].motor_torque)
    np.testing.assert_array_equal(speed.lines[1].get_ydata(), runs["stopped"].speed)
    assert len(speed.lines) == 3  # the end of the failed run is marked
    assert len(drawn(figure)) > 5000
    with pytest.raises(SpecError, match="no run"):
        drive_curves({})


@pytest.mark.long
def test_resistance_picture_marks_the_criterion() -> None:
    effect = resistance_effect(DRIVE, [1.0, 5.0], simulate=True)
    figure = resistance_picture({"L = 0.2 H": effect})
    chart, ripples = figure.axes[:2]
    assert any(line.get_xdata()[0] == pytest.approx(1 / math.sqrt(2)) for line in chart.lines)
    np.testing.assert_array_equal(ripples.lines[0].get_ydata(), effect.speed)
    np.testing.assert_array_equal(ripples.lines[1].get_ydata(), effect.simulated_speed)
    assert len(drawn(figure)) > 5000
    with pytest.raises(SpecError, match="no effect"):
        resistance_picture({})


def test_reduction_picture_is_log_log() -> None:
    study = DRIVE.inductance_study([0.0, 0.02, 0.05], [1e-4, 1e-5, 1e-6])
    axes = reduction_picture(study).axes[0]
    assert axes.get_xscale() == axes.get_yscale() == "log"
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), study.speed)


def test_map_shows_the_simulated_slopes() -> None:
    found = ripple_map(DRIVE, [5.0, 10.0, 20.0], [0.2, 0.01], revolutions=20)
    figure = ripple_map_picture(found)
    (mesh,) = figure.axes[0].collections
    order = np.argsort(found.frequency_ratio)  # the slow forcing is drawn below
    np.testing.assert_array_equal(np.asarray(mesh.get_array()).ravel(), found.speed_slope[order].ravel())
    assert figure.axes[0].get_ylabel() == "Ω/ω_n" and drawn(figure)


@pytest.mark.parametrize("of", ["speed", "current"])
def test_ripples_over_the_resistance(of: str) -> None:
    effect = resistance_effect(DRIVE, [5.0, 20.0], simulate=True, revolutions=20)
    (axes,) = ripple_picture({"0.2 H": effect}, of).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), getattr(effect, of))
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), getattr(effect, f"simulated_{of}"))
    with pytest.raises(SpecError, match="nothing to draw of 'torque'"):
        ripple_picture({"0.2 H": effect}, "torque")


@pytest.mark.long
def test_themed_svg_follows_the_page() -> None:
    study = DRIVE.inductance_study([0.0, 0.05], [1e-4, 1e-6])
    one, two = (themed_svg(reduction_picture(study)) for _ in range(2))
    assert one == two and one.startswith('<svg class="gs"')
    rules, drawn = one.split("</style>", 1)
    assert LIGHT["a"] in drawn and LIGHT["ink"] in drawn and LIGHT["soft"] in drawn
    assert "#000000" not in drawn and "style" not in drawn and "var(" not in one
    assert f'[stroke="{LIGHT["a"]}"]{{stroke:{DARK["a"]}}}' in rules
    ids = re.findall(r'id="([^"]+)"', one)
    assert len(ids) == len(set(ids)) and all(re.match(r"[0-9a-f]{8}-", name) for name in ids)
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', one))
    assert used <= set(ids)
