"""Sizes at the ends of double precision: right from 1e-60 to 1e60, refused beyond; no exception but the library's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.assembly_modes import assembly_modes, assembly_modes_batch
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.systems.platform.drive import FourBarDrive
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

OUTSIDE = [1e-300, 1e-200, 1e-160, 1e-80, 1e80, 1e120, 1e155, 1e300]
INSIDE = [2.0**-190, 2.0**190]  # powers of two: the ratios of the lengths stay what they are


def linkage(unit: float) -> TiltedFourBar:
    return TiltedFourBar(2 * unit, unit, 2.5 * unit, 2.5 * unit, alpha=1 / 30)


def drive(unit: float, crank: float = 62.0) -> FourBarDrive:
    return FourBarDrive(45 * unit, (105 + 45j) * unit, crank * unit, 45 * unit, 60 * unit)


def machine(unit: float) -> SingleMotorPlatform:
    names = ("crank", "coupler", "rocker", "axis", "pivot", "vertex", "l1", "l2")
    source = SingleMotorPlatform()
    sizes: dict[str, Any] = {name: tuple(unit * value for value in getattr(source, name)) for name in names}
    return SingleMotorPlatform(**sizes)


def platform(unit: float) -> ParallelPlatform:
    source = ParallelPlatform.g1()
    parts: list[Any] = [np.array(part) * unit for part in (source.D, source.b, source.l1, source.l2)]
    return ParallelPlatform(*parts)


@pytest.mark.parametrize("make", [linkage, drive, machine, platform])
@pytest.mark.parametrize("unit", OUTSIDE)
def test_refused_beyond_the_range(make: Any, unit: float) -> None:
    with pytest.raises(GeometryError, match=r"not between 1e-60 and 1e\+60; change the unit"):
        make(unit)


@pytest.mark.parametrize("unit", OUTSIDE)
def test_assembly_modes_beyond_the_range(unit: float) -> None:
    """In a batch the problem is named."""
    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    with pytest.raises(GeometryError, match=r"problem 0 is .*change the unit"):
        assembly_modes(2 * corner * unit, corner * unit, [1.5 * unit] * 3)
    with pytest.raises(GeometryError, match=r"problem 1 is .*change the unit"):
        assembly_modes_batch([2 * corner, 2 * corner * unit], [corner, corner * unit], [[1.5] * 3, [1.5 * unit] * 3])


def test_assembly_modes_of_a_platform_that_is_a_point_at_the_anchors() -> None:
    """All dimensions zero are no matter of units."""
    assert assembly_modes_batch([0, 0, 0], [0, 0, 0], [0, 0, 0], escalate=False).counts.size == 1


@pytest.mark.parametrize("unit", INSIDE)
def test_lambda_linkage_in_any_unit(unit: float) -> None:
    f = np.linspace(0.0, 6.2, 23)
    one, own = linkage(1.0).positions(f), linkage(unit).positions(f)
    for name in ("A", "B", "M", "dA", "dB", "dM"):
        np.testing.assert_array_equal(getattr(own, name) / unit, getattr(one, name))
    for name in ("status", "theta", "dtheta"):
        np.testing.assert_array_equal(getattr(own, name), getattr(one, name))
    assert linkage(unit).full_turn().kind == "full turn"


@pytest.mark.parametrize("unit", INSIDE)
def test_drive_in_any_unit(unit: float) -> None:
    """Powers of two change no digit."""
    for crank in (12.0, 62.0):
        one, own = drive(1.0, crank), drive(unit, crank)
        assert own.turn() == one.turn()
        assert own.dead_points() == one.dead_points()
        assert own.barriers() == one.barriers()
        np.testing.assert_array_equal(own.motion([0.1, 0.5, 0.7]).phi1, one.motion([0.1, 0.5, 0.7]).phi1)


@pytest.mark.parametrize("unit", INSIDE)
def test_platform_in_any_unit(unit: float) -> None:
    one, own = platform(1.0).direct((0.0, 0.0, 0.0)), platform(unit).direct((0.0, 0.0, 0.0))
    np.testing.assert_allclose(own.poses[:, 2], one.poses[:, 2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(own.determinants / unit**4, one.determinants, rtol=1e-13)


@pytest.mark.parametrize("unit", [2.0**-186, 2.0**186])
def test_single_motor_platform_in_any_unit(unit: float) -> None:
    """Determinants are lengths^4; their product, length^8, once ended the branch at its start."""
    one, own = machine(1.0).full_turn(37), machine(unit).full_turn(37)
    assert own.complete and one.complete
    scale = np.array([unit, unit, 1.0])
    for name in ("pose", "velocity", "acceleration"):
        want = getattr(one, name)
        np.testing.assert_allclose(getattr(own, name) / scale, want, rtol=0, atol=1e-13 * np.abs(want).max())


@pytest.mark.parametrize("length", [1e-55, 1e-12])
def test_tiny_crank_beside_ordinary_links(length: float) -> None:
    """To first order in the crank, B moves by the crank's component along the coupler; the height of A is exact."""
    own = TiltedFourBar(2.0, length, 2.5, 2.5, alpha=1 / 30)
    f = np.array([0.3, 2.0])
    found = own.positions(f)
    still = TiltedFourBar(2.0, 1e-60, 2.5, 2.5).positions(f)
    np.testing.assert_allclose(found.theta, np.sin(f) * math.sin(1 / 30) * length / 2.5, rtol=1e-12)
    np.testing.assert_allclose(found.B, still.B, rtol=0, atol=2 * length + 1e-15)


@pytest.mark.parametrize("alpha", [1e-100, 1e-160, 1e-200, -1e-290])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (0.0, 1.0, 0.0)])
def test_pin_height_of_a_tilt_whose_square_underflows(alpha: float, axis: tuple[float, float, float]) -> None:
    own = TiltedFourBar(alpha=alpha, axis=axis)
    assert own.pin_height == pytest.approx(abs(alpha) * math.hypot(axis[0], axis[1]), rel=1e-15)
    assert own.largest_tilt[0] == pytest.approx(own.pin_height / 2.5, rel=1e-15)


def test_pin_height_against_the_rotation() -> None:
    """Largest third component over a turn of ``l2 (R e1 cos f + R e2 sin f)``; a half turn about z lifts nothing."""
    for alpha in (0.1, 1.5, math.pi, 4.0, 2 * math.pi - 1e-8):
        for axis in ((1.0, 0.0, 0.0), (0.3, -0.5, 0.8), (0.0, 0.0, 1.0), (1e-9, 0.0, 1.0)):
            own = TiltedFourBar(alpha=alpha, axis=axis)
            right = math.hypot(own.rotation[2, 0], own.rotation[2, 1])
            assert own.pin_height == pytest.approx(right, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("k", [2e60, -1e61, 1e300])
def test_tracing_point_out_of_range(k: float) -> None:
    with pytest.raises(GeometryError, match="change the unit"):
        TiltedFourBar(k=k)


@pytest.mark.parametrize("f", [1e-139, 1e-150, 1e-174, -1e-200, 1e-300])
def test_pin_beside_the_rocker_axis(f: float) -> None:
    """Rhombus at f = 0: A runs into C, D^2 underflows; B stays half a coupler's turn away, on the chosen side."""
    for sgn in (1, -1):
        found = TiltedFourBar(1.0, 1.0, 1.0, 1.0, sgn=sgn).positions([f])
        assert found.status.tolist() == [0]
        # B = A + C - O, or B = O
        want = [1.0 + sgn * math.copysign(1.0, f), 0.0, 0.0]
        np.testing.assert_allclose(found.B[0], want, rtol=1e-15, atol=1e-130)
