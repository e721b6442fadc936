"""The picture of parts: which label belongs to which part."""

from __future__ import annotations

import math

import numpy as np
import pytest

import graphsynth as gs
from graphsynth import Mechanism
from graphsynth.drawing.parts_picture import _apart
from graphsynth.drawing.shapes import Path, Text

from .moving import inside
from .test_cams import CAMS, follower
from .test_wheels import distances, train

PLACES = {"O": (0, 0), "B": (-1.875, 0), "C": (0.383, 0.432), "D": (-0.164, 0.727), "E": (-1.051, 1.131)}
PLACES |= {"F": (-2.157, 1.481), "G": (-0.532, 2.335)}


@pytest.mark.long
@pytest.mark.parametrize(
    "mechanism",
    [Mechanism.from_points(PLACES, ["OCD", "BEF", "CE", "DG", "FG"], "OB", "OC"), train(), follower(CAMS["hollow"])],
    ids=["two sheets", "wheels in a ring", "a cam"],
)
def test_labels_lie_beside_their_own_parts(mechanism):
    """The nearest outline is that of the label's own part, and no other part lies below it."""
    made = gs.parts(gs.simulate(mechanism, np.linspace(0.0, math.tau, 25)), unit=60.0, prove=False)
    sketch = _apart(made, 420.0)
    sheets = {s.part.removeprefix("link-"): s.runs for s in sketch.shapes if isinstance(s, Path) and s.closed}
    labels = [s for s in sketch.shapes if isinstance(s, Text)]
    assert sorted(sheets) == sorted(label.text for label in labels)
    for label in labels:
        at = label.at + label.offset * sketch.pixel
        for name, (outline, *holes) in sheets.items():
            if name != label.text:
                for dx in (-3.0 * len(name), 0.0, 3.0 * len(name)):
                    corner = at + dx * sketch.pixel
                    below = inside(corner, np.array(outline))
                    assert not below or any(inside(corner, np.array(hole)) for hole in holes), (label.text, name)
        far = {k: distances(np.array([at]), np.array(own[0]))[0] / sketch.pixel for k, own in sheets.items()}
        assert min(far, key=lambda name: far[name]) == label.text and far[label.text] < 25.0
