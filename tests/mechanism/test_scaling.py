"""A mechanism in another unit of length: equations are homogeneous, motions similar, sliding drivers keep up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Linear, Polynomial, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

FACTOR = 1000.0
#: Every kind of joint once.
EVERY = Mechanism(
    MechanismGraph(5, [(0, 1), (0, 2), (0, 3), (1, 2, 2), (2, 3, 2), (3, 4, 2), (0, 4)], frame=0),
    [
        Revolute(0, 1), Revolute(0, 2, (0.9, 0.1)), Prismatic(0, 3, (1.0, 2.0), (0.0, 0.1), 0.6, 0.7),
        Gear(1, 2, (0.1, 0.0), (0.0, 0.2), 0.3, 0.7, internal=True, offset=0.1),
        PinSlot(2, 3, (0.1, 0.2), (0.3, 0.4), 0.5), Revolute(0, 4, (2.0, 1.0)),
        Cam(3, 4, (0.3, 0.0), (0.2, 0.5), 0.4, 1.5, ((0.2, 0.1), (0.0, -0.3))),
    ],
    pose=[(0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (0.8, 0.3, 1.1), (1.2, 2.1, 0.2), (2.1, 1.3, 2.2)],
)  # fmt: skip
PRESS = Mechanism.slider_crank(1.0, 3.0)
U = np.linspace(0.0, 1.0, 7)


@pytest.mark.parametrize("law", [
    Linear(0.8, 2.5), Harmonic(3.0, 0.7, 2.0, 0.4), Polynomial((2.5, 0.1, 0.8, 0.2)),
    Table((0.0, 0.3, 0.6, 1.0), (2.5, 3.0, 2.8, 3.5)),
])  # fmt: skip
def test_a_sliding_driver_keeps_up_with_the_links(law: Any) -> None:
    """The coordinate of a slider is a length: with the links a thousand times as long, so is its stroke."""
    small = replace(PRESS, drivers=(Driver(0, 3, law),))
    before, after = small.simulate(U), small.scaled(FACTOR).simulate(U)
    assert before.completed and after.completed
    slid = law(U)[0]
    np.testing.assert_allclose(after.poses[:, 3, 0], FACTOR * slid, rtol=1e-12)
    np.testing.assert_allclose(after.poses[..., :2], FACTOR * before.poses[..., :2], atol=1e-12 * FACTOR)
    np.testing.assert_allclose(after.poses[..., 2], before.poses[..., 2], atol=1e-12)


def test_the_law_of_a_turning_driver_stays() -> None:
    law = Harmonic(0.2, 0.7)
    own = replace(PRESS, drivers=(Driver(0, 1, law),))
    assert own.scaled(FACTOR).drivers == own.drivers


def test_every_joint_is_homogeneous() -> None:
    """Every equation, that of angles in lengths too, grows by the factor: no dimension is left behind."""
    large = EVERY.scaled(FACTOR)
    before, after = residual(EVERY.joints, EVERY.pose), residual(large.joints, large.pose)
    assert np.abs(before).min() > 1e-3
    np.testing.assert_allclose(after, FACTOR * before, rtol=1e-12)
    assert large.joint(1, 2).offset == 0.1  # type: ignore[union-attr]  # an angle
    assert large.joint(3, 4).harmonics[0] == (200.0, 100.0)  # type: ignore[union-attr]


def test_back_again() -> None:
    own = EVERY.scaled(0.25).scaled(4.0)  # powers of two: exact
    assert own == EVERY


def test_a_law_that_cannot_be_scaled_is_told() -> None:
    def law(u: Any) -> Any:
        return u, 1.0 + 0.0 * u, 0.0 * u

    with pytest.raises(GeometryError, match=r"sliding driver 0-3 cannot be scaled; use one of"):
        replace(PRESS, drivers=(Driver(0, 3, law),)).scaled(2.0)
    assert replace(PRESS, drivers=(Driver(0, 1, law),)).scaled(2.0).drivers[0].law is law
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(GeometryError, match="factor"):
            PRESS.scaled(wrong)
