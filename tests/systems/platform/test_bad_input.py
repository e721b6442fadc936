"""Bad input of the platform's functions: one sentence that names the argument, never another exception."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.attainable import ellipticity
from graphsynth.systems.platform.field import singular_conic
from graphsynth.systems.platform.inverse_design import linear_design, rotation_about, translation_along
from graphsynth.systems.platform.maps import aspects, platform_map, quality
from graphsynth.systems.platform.orientations import orientations, reachable_workspace
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
from graphsynth.systems.platform.singular_loci import singular_loci
from graphsynth.systems.platform.singularity import singularity_distance
from graphsynth.systems.platform.workspace import constant_orientation_workspace

G1, POSE, UP = ParallelPlatform.g1(), [1.2, 0.9, 0.15], (1, 1, 1)
MACHINE = SingleMotorPlatform()

CALLS: dict[str, Callable[[Any], Any]] = {
    "sigma of a workspace": lambda bad: constant_orientation_workspace(G1, 0.0, sigma=bad),
    "limits of a workspace": lambda bad: constant_orientation_workspace(G1, 0.0, sigma=UP, limits=bad),
    "tolerance of a workspace": lambda bad: constant_orientation_workspace(G1, 0.0, tolerance=bad),
    "sigma of a map": lambda bad: platform_map(G1, 0.0, bad, nodes=4),
    "nodes of a map": lambda bad: platform_map(G1, 0.0, UP, nodes=bad),
    "nodes of loci": lambda bad: singular_loci(G1, 0.0, nodes=bad),
    "sigma of aspects": lambda bad: aspects(G1, bad, 0.0, nodes=4),
    "sigma of a distance": lambda bad: singularity_distance(G1, POSE, bad, rays=4),
    "rays of a distance": lambda bad: singularity_distance(G1, POSE, UP, rays=bad),
    "poses of quality": lambda bad: quality(G1, bad, UP),
    "point of orientations": lambda bad: orientations(G1, bad),
    "anchors of a conic": lambda bad: singular_conic(bad, G1.b, 0.0),
    "vertices of a conic": lambda bad: singular_conic(G1.D, bad, 0.0),
    "wanted of a design": lambda bad: linear_design(MACHINE, bad),
    "samples of a design": lambda bad: linear_design(MACHINE, [0.1, 0.1j, 0.0], samples=bad),
    "amplitude of a rotation": rotation_about,
    "angle of a translation": lambda bad: translation_along(1.0, bad),
    "phasor of an ellipse": lambda bad: ellipticity(bad, 1.0),
    "samples of a turn": MACHINE.full_turn,
    "angle of a drive": MACHINE.drive,
}


@pytest.mark.parametrize(
    "bad",
    ["x", np.nan, np.inf, (1, 1, "a"), (1.0, np.nan, 0.0), object()],
    ids=lambda bad: type(bad).__name__ + repr(bad)[:5],
)
@pytest.mark.parametrize("name", CALLS)
def test_bad_input_is_a_geometry_error(name: str, bad: object) -> None:
    with pytest.raises(GeometryError):
        CALLS[name](bad)


def test_legs_that_cannot_meet_have_an_empty_workspace() -> None:
    apart = ParallelPlatform((0, 100, 50j), (0, 0.5, 0.2 + 0.3j), 1.0, 1.0)
    assert reachable_workspace(apart, 0.05).high == 0.0
    assert orientations(apart, 0j) == ()
