"""Bearings and tilts at the ends of double precision."""

from __future__ import annotations

import math

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.jamming import Bearing, Verdict, assess_jamming, jam_arcs
from graphsynth.mechanism.four_bar import TiltedFourBar


@pytest.mark.parametrize("unit", [1e-300, 1e-160, 1e-80, 1e80, 1e155, 1e300])
def test_bearings_out_of_range_are_refused(unit: float) -> None:
    with pytest.raises(GeometryError, match="of Bearing is not between 1e-60 and 1e\\+60; change the unit"):
        Bearing(17.5 * unit, 10 * unit, 0.03 * unit)
    with pytest.raises(GeometryError, match="Hb"):
        Bearing(Hb=unit)
    with pytest.raises(GeometryError, match="hole_length"):
        Bearing(hole_length=unit)


@pytest.mark.parametrize("clearance", [1e-300, 5e-324])
def test_tiny_clearance_is_as_good_as_none(clearance: float) -> None:
    """To first order the critical sine is clearance / (half height)."""
    arcs = jam_arcs(TiltedFourBar(alpha=1 / 30), Bearing(clearance=clearance))
    assert [arc.length for arc in arcs.arcs] == pytest.approx([math.pi, math.pi], rel=1e-15)


@pytest.mark.parametrize("alpha", [1e-160, -1e-200, 1e-310, 5e-324])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8)])
@pytest.mark.parametrize("rod", ["rigid", "deck"])
def test_any_tilt_jams_without_clearance(alpha: float, axis: tuple[float, float, float], rod: str) -> None:
    own = TiltedFourBar(alpha=alpha, axis=axis, rod=rod)
    arcs = jam_arcs(own, Bearing(clearance=0.0))
    assert [arc.length for arc in arcs.arcs] == [math.pi, math.pi] and arcs.kappa == 0.0
    assert jam_arcs(own, Bearing(clearance=1e-300)).arcs == () if abs(alpha) < 1e-300 else True
    assert assess_jamming(own, Bearing(clearance=0.0), samples=3, certify=False).verdict is Verdict.JAMMED_ESTIMATED


def test_no_tilt_about_the_motor_axis() -> None:
    """A turn about z lifts nothing, however large."""
    own = TiltedFourBar(alpha=1.0, axis=(0.0, 0.0, 1.0))
    assert not own.tilted
    assert "touching at every angle" in jam_arcs(own, Bearing(clearance=0.0)).reason
