"""Assembly modes that are proved: all there can be, or as many as are told, and nothing false."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest

from graphsynth.kinematics.certify import certify_modes, modes
from graphsynth.kinematics.triad.assembly_modes import assembly_modes as modes_of_triad
from graphsynth.mechanism import gallery
from graphsynth.mechanism.model import Mechanism


def six_modes() -> Mechanism:
    """A triad behind a crank, with dimensions for which its sextic has six real roots."""
    fixed, carried = (0j, 2.0 + 0j, 0.73 + 1.56j), (0j, 1.41 + 0j, 1.17 - 0.97j)
    x, y, turn = modes_of_triad(fixed, carried, (1.76, 1.94, 1.7)).poses[0]
    places = [*fixed, *(complex(x, y) + cmath.exp(1j * turn) * vertex for vertex in carried), -0.5 + 0j]
    points = {name: (z.real, z.imag) for name, z in zip("ABCPQRO", places, strict=True)}
    return Mechanism.from_points(points, links=["OA", "AP", "BQ", "CR", "PQR"], frame="OBC", driver="OA")


@pytest.mark.parametrize(
    ("mechanism", "number"),
    [(six_modes, 6), (gallery.jansen, 8), (gallery.stephenson_six_bar, 4), (gallery.watt_six_bar, 4)],
)
def test_all_there_can_be_are_proved(mechanism: Callable[[], Mechanism], number: int) -> None:
    proof = certify_modes(mechanism(), "30 deg")
    assert proof.complete and len(proof) == len(proof.modes) == proof.most == number
    assert proof.statement == f"all {number} of at most {number} assembly modes found, each proved"
    assert 0.0 < proof.position_radius.max() < 1e-11


def test_the_exact_pin_is_within_the_radius() -> None:
    """Circle and circle with 50 digits."""
    mechanism = Mechanism.four_bar(2, 1, 2.5, 2.5)
    proof = certify_modes(mechanism, 0.5)
    with mp.workdps(50):
        crank = mp.expj(mp.mpf(0.5))
        way = 2 - crank  # from the crank pin to the pivot of the rocker, half of it along as both lengths are equal
        across = mp.sqrt(mp.mpf(2.5) ** 2 - abs(way) ** 2 / 4) * 1j * way / abs(way)
        exact = [crank + way / 2 + side * across for side in (1, -1)]
    for mode, radius in zip(proof.modes, proof.position_radius):
        x, y, turn = map(mp.mpf, mode.pose[2])
        assert mode.pose[2, 2] != 0.0
        with mp.workdps(50):
            pins = [mp.mpc(x, y) + mp.mpf(2.5) * mp.expj(turn)]
            gap = min(abs(pin - own) for pin in pins for own in exact)
        assert gap < 10 * radius


def test_what_cannot_be_assembled_has_no_modes() -> None:
    proof = certify_modes(Mechanism.four_bar(3, 1, 1.5, 1), "180 deg")
    assert len(proof) == 0 and proof.most == 2 and not proof.complete
    assert proof.statement == "0 assembly modes proved; at most 2 exist, complex ones included"


def test_modes_that_meet_are_not_proved() -> None:
    """The rocker of 3, 1, 1.5, 2.5 is stretched with the coupler where the pins are 4 apart: one double root."""
    proof = certify_modes(Mechanism.four_bar(3, 1, 1.5, 2.5), math.pi)
    assert len(proof.modes) > 0 and len(proof) == 0 and not proof.complete
    assert "found but not proved" in proof.statement


def test_a_mode_found_twice_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    mechanism = Mechanism.four_bar(2, 1, 2.5, 2.5)
    first, second = mechanism.modes("30 deg")
    monkeypatch.setattr(modes, "assembly_modes", lambda *_: [first, first, second])
    proof = certify_modes(mechanism, "30 deg")
    assert proof.proved.tolist() == [True, False, True] and proof.complete
    turned = type(first)(
        first.modes, first.pose + np.array([0.0, 0.0, 2.0 * np.pi])
    )  # the same, its angles one turn further
    monkeypatch.setattr(modes, "assembly_modes", lambda *_: [first, turned])
    assert len(certify_modes(mechanism, "30 deg")) == 1


def test_a_pose_that_is_none_is_not_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    mechanism = Mechanism.four_bar(2, 1, 2.5, 2.5)
    first, _ = mechanism.modes("30 deg")
    wrong = type(first)(first.modes, first.pose + 0.3)
    monkeypatch.setattr(modes, "assembly_modes", lambda *_: [wrong])
    assert len(certify_modes(mechanism, "30 deg")) == 0


def test_the_number_for_sliders_is_not_known() -> None:
    proof = certify_modes(Mechanism.slider_crank(1, 3), "30 deg")
    assert proof.most is None and not proof.complete
    assert proof.statement == "2 assembly modes proved; more are not excluded"
