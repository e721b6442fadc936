"""Pictures of the tribometer: what they show, units on the axes, failures shown as failures."""

from __future__ import annotations

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.friction.laws import TwoCoefficientLaw
from graphsynth.systems.tribometer.accuracy import regularisation_study, step_study
from graphsynth.systems.tribometer.drives import BeltDrive
from graphsynth.systems.tribometer.events import EventGuard
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.pictures import (
    error_picture,
    friction_picture,
    phase_picture,
    platforms_picture,
    save_tribometer_gif,
    stiffness_picture,
)

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


def test_failures_stay_in_the_error_picture():
    bad = regularisation_study(MODEL, 0.5, speeds=[1e-3, 1e-5], solvers=["DOP853"], most_calls=5000)
    good = step_study(MODEL, 0.5, steps=[1e-3, 1e-4])
    for over in ("time", "parameter"):
        (axes,) = error_picture([bad, good], over=over).axes
        crosses = [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
        assert len(crosses) == 1
        assert "failed or unreliable" in [text.get_text() for text in axes.get_legend().get_texts()]
        assert axes.get_ylabel() == "largest error of the position [m]"
    with pytest.raises(SpecError, match="abscissa"):
        error_picture([good], over="weight")


def test_stiffness_picture():
    (axes,) = stiffness_picture(MODEL, factors=(1.0, 1e2), duration=1.0).axes
    assert len(axes.lines) == 3
    assert axes.lines[-1].get_ydata() == pytest.approx(MODEL.limit_force(axes.lines[-1].get_xdata()))


@pytest.mark.parametrize(
    "model", [MODEL, Tribometer(law=TwoCoefficientLaw(0.4, 0.25), drive=BeltDrive(0.02))], ids=["crank", "belt"]
)
def test_animation(tmp_path, model):
    from PIL import Image

    path = tmp_path / "moving.gif"
    assert save_tribometer_gif(model.event_driven(1.0), path, frames=4, dpi=40) == 4
    with Image.open(path) as picture:
        assert picture.n_frames == 4


def test_nothing_to_draw():
    failed = MODEL.regularised(1.0, speed=1e-5, solver="DOP853", most_calls=100)
    with pytest.raises(SpecError, match="nothing to draw"):
        platforms_picture(failed)
    with pytest.raises(SpecError, match="frames"):
        save_tribometer_gif(MODEL.event_driven(0.1), "never.gif", frames=1)
