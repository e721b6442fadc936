"""The moving tribometer: valid SVG for every drive, the rod keeps its length, refusals."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.animation import tribometer_animation, tribometer_sketch
from graphsynth.systems.tribometer.model import Tribometer
from graphsynth.systems.tribometer.platforms import BeltDrive, HarmonicDrive, TwoCoefficientLaw

PLAIN = TwoCoefficientLaw(0.4, 0.25)
MODELS = [
    Tribometer(),
    Tribometer(law=PLAIN, drive=HarmonicDrive(0.03, 2.0), damping=0.0),
    Tribometer(law=PLAIN, drive=BeltDrive(-0.02)),
    Tribometer(law=PLAIN, drive=BeltDrive(0.0)),
]


@pytest.mark.parametrize("model", MODELS, ids=["crank", "harmonic", "belt", "rest"])
def test_every_drive_gives_valid_svg(model):
    motion = model.event_driven(4.0, times=np.linspace(0.0, 4.0, 401), estimate=False)
    for svg in (tribometer_animation(motion, frames=60), tribometer_sketch(motion, 0.5)):
        root = ElementTree.fromstring(svg)
        assert root.tag.endswith("svg") and "nan" not in svg
    lists = [e.attrib["values"] for e in ElementTree.fromstring(tribometer_animation(motion, frames=60)).iter()
             if e.tag.endswith("animate")]  # fmt: skip
    assert all(len(values.split(";")) == 60 for values in lists)
    assert lists
    assert "<animate" not in tribometer_sketch(motion)


def test_the_rod_keeps_its_length_on_the_page():
    motion = Tribometer().event_driven(3.2, times=np.linspace(0.0, 3.2, 201), estimate=False)
    root = ElementTree.fromstring(tribometer_animation(motion, frames=40))
    moving = [e for e in root.iter() if e.tag.endswith("animate") and e.attrib["attributeName"] == "d"]
    rods = []
    for part in moving:
        runs = [[tuple(map(float, p.split())) for p in d[1:].split(" L")] for d in part.attrib["values"].split(";")]
        if all(len(run) == 2 for run in runs):
            lengths = [np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in runs]
            rods.append((max(lengths) - min(lengths), np.mean(lengths)))
    crank, rod = sorted((mean, spread) for spread, mean in rods if spread < 0.5 and mean > 20.0)
    assert rod[0] / crank[0] == pytest.approx(4.0, rel=2e-3)


def test_refusals():
    motion = Tribometer().event_driven(1.0, times=[0.5], estimate=False)
    with pytest.raises(SpecError, match="nothing to draw"):
        tribometer_animation(motion)
    with pytest.raises(SpecError, match="number of frames is 1"):
        tribometer_animation(Tribometer().event_driven(1.0, estimate=False), frames=1)
