"""Pictures of the tribometer: what they show, units on the axes, failures shown as failures."""

from __future__ import annotations

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.cycles import limit_cycle
from graphsynth.systems.tribometer.evidence import method_study
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.motion import EventGuard
from graphsynth.systems.tribometer.pictures import friction_picture, phase_picture, platforms_picture, plots

MODEL = Tribometer()


@pytest.fixture(scope="module")
def motion():
    return MODEL.event_driven(2.0)


def test_platforms_picture(motion):
    above, below = platforms_picture(motion).axes
    lower, upper = above.lines
    assert np.array_equal(lower.get_ydata(), 1e3 * motion.x1)
    assert np.array_equal(upper.get_ydata(), 1e3 * motion.x2)
    assert (above.get_ylabel(), below.get_ylabel(), below.get_xlabel()) == (
        "displacement [mm]", "friction force [N]", "time [s]",
    )  # fmt: skip
    shaded = [patch.get_x() for patch in above.patches]
    assert shaded == pytest.approx([0.0] + [event.time for event in motion.events if event.state == 0])
    low, high = below.get_ylim()
    assert low < motion.friction.min() < motion.friction.max() < high


def test_incomplete_run_is_marked():
    stormy = MODEL.stiffened(1e4, scaled_damping=False).event_driven(1.0, guard=EventGuard(rate=300.0))
    above, _ = platforms_picture(stormy).axes
    assert above.get_title(loc="left") == "Zeno behaviour"


def test_phase_picture(motion):
    (axes,) = phase_picture(motion, settled=1.0).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["stick", "slip"]
    drawn = np.concatenate([line.get_xdata() for line in axes.lines])
    assert np.nanmin(drawn) <= 1e3 * motion.x2.min()
    assert np.nanmax(drawn) >= 1e3 * motion.x2.max()


def test_friction_picture(motion):
    (axes,) = friction_picture(motion).axes
    slip, stick = axes.lines[-2:]
    assert (stick.get_xdata() == 0.0).all()
    assert len(slip.get_xdata()) == (motion.state != 0).sum()
    assert axes.get_xlabel() == "sliding velocity [mm/s]"


@pytest.mark.long
def test_failures_stay_in_the_pictures_of_errors():
    study = method_study(
        MODEL, 0.5, tolerances=[], steps=[1e-3, 1e-4], speeds=[1e-3, 1e-5], solvers=["DOP853"], most_calls=5000
    )
    cycle = limit_cycle(MODEL, most_turns=1)
    pictures = {picture.title: picture for picture in plots(None, MODEL.event_driven(0.5), cycle, study)}
    assert "Limit cycle" not in pictures
    for over in ("run time", "tolerance, step and smoothing velocity"):
        svg = pictures[f"Error against {over}"].svg
        assert "failed (upper edge) or unreliable" in svg and "error [m]" in svg


def test_nothing_to_draw():
    failed = MODEL.regularised(1.0, speed=1e-5, solver="DOP853", most_calls=100)
    with pytest.raises(SpecError, match="nothing to draw"):
        platforms_picture(failed)
