"""Pictures of the platform: what they show, units on the axes, limits around the data."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.map_pictures import harmonics_picture, loci_picture, map_picture, workspace_picture
from graphsynth.systems.platform.maps import platform_map
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
from graphsynth.systems.platform.singular_loci import singular_loci
from graphsynth.systems.platform.workspace import constant_orientation_workspace

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()


def test_workspace_picture_shows_every_arc() -> None:
    work = constant_orientation_workspace(G1, 0.15)
    figure = workspace_picture(work, unit="m")
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert len(axes.lines) == len(work.arcs)
    drawn = sum(np.abs(np.diff(line.get_xdata() + 1j * line.get_ydata())).sum() for line in axes.lines)
    assert drawn == pytest.approx(work.perimeter, rel=1e-3)
    (outline,) = axes.patches
    inside = outline.get_path().contains_points([[1.2, 0.9], [10.0, 0.0]])
    assert inside.tolist() == [True, False]
    assert f"{work.area:.6g} m²" in axes.get_title()


def test_empty_workspace_says_so() -> None:
    platform = ParallelPlatform((0, 10, 5j), (0, 0, 0), (1.0,) * 3, (1.0,) * 3)
    figure = workspace_picture(constant_orientation_workspace(platform, 0.0))
    assert "no position" in figure.axes[0].texts[0].get_text()


@pytest.mark.slow
def test_loci_picture_has_a_panel_for_every_mode() -> None:
    loci = singular_loci(MOCK, 0.5, nodes=40)
    figure = loci_picture(MOCK, loci)
    panels = [axes for axes in figure.axes if axes.get_title().startswith("working mode")]
    assert len(panels) == 8 and len({axes.get_title() for axes in panels}) == 8
    arcs = len(constant_orientation_workspace(MOCK, 0.5).arcs)
    assert sum(len(axes.lines) for axes in panels) == 8 * arcs + len(loci.curves) + len(loci.points)
    assert "28.65°" in figure.get_suptitle()


@pytest.mark.long
@pytest.mark.parametrize("quantity", ["dexterity", "smallest", "velocity_max", "link_force", "reach"])
def test_map_picture(quantity: str) -> None:
    found = platform_map(G1, 0.0, (1, 1, -1), nodes=60)
    figure = map_picture(found, quantity, unit="m")
    axes, bar = figure.axes
    assert axes.get_xlabel() == "x [m]" and "(+ + −)" in axes.get_title() and bar.get_ylabel()
    image = axes.collections[0].get_array()
    assert np.isfinite(np.ma.filled(image, np.nan)).sum() == np.isfinite(getattr(found.quality, quantity)).sum()
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    assert stream.getvalue().startswith(b"\x89PNG")


def test_unknown_quantity() -> None:
    with pytest.raises(GeometryError, match="dexterity"):
        map_picture(platform_map(MOCK, 0.0, (1, 1, 1), nodes=10), "beauty")


def test_harmonics_picture_has_logarithmic_axes_and_measured_points() -> None:
    figure = harmonics_picture(SingleMotorPlatform(crank=(8.0, 5.0, 3.0)), (0.25, 0.5, 1.0))
    axes = figure.axes[0]
    assert axes.get_xscale() == axes.get_yscale() == "log" and axes.get_xlabel() == "longest crank [mm]"
    measured = next(line for line in axes.lines if line.get_label() == "higher harmonics / first")
    np.testing.assert_allclose(measured.get_xdata(), [2.0, 4.0, 8.0])
    slope = np.diff(np.log(measured.get_ydata())) / math.log(2.0)
    np.testing.assert_allclose(slope, 1.0, atol=0.05)
