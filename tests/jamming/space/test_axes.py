"""Mechanisms in space from the axes of their joints: where they close, what they refuse."""

import math

import mpmath
import numpy as np
import pytest
from space_oracles import placed

from graphsynth.core.errors import GeometryError
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, SlideLimits
from graphsynth.jamming.space import Axis, from_axes, prove_pose, reference

UP = (0.0, 0.0, 1.0)
CORNERS = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (2.0, 2.5, 0.0), (2.0, 0.0, 0.0))


def bennett(twist=1.0, limit=RIGID):
    """Bennett's linkage by Denavit and Hartenberg; another ``twist`` than 1 breaks its condition."""
    a, b, first = 1.0, 1.5, math.radians(30)
    second = math.asin(b * math.sin(first) / a) * twist
    other = 2.0 * math.atan(math.sin((second + first) / 2) / math.sin((second - first) / 2) / math.tan(0.95))
    frame, axes = np.eye(4), []
    for k, (angle, length, alpha) in enumerate(
        ((1.9, a, first), (other, b, second), (-1.9, a, first), (-other, b, second))
    ):
        axes.append(Axis((k - 1) % 4, k, frame[:3, 3], frame[:3, 2], limit, k == 0))
        c, s, u, v = math.cos(angle), math.sin(angle), math.cos(alpha), math.sin(alpha)
        frame = frame @ [[c, -s * u, s * v, length * c], [s, c * u, -c * v, length * s], [0, v, u, 0], [0, 0, 0, 1]]
    return axes


@pytest.mark.parametrize("given", [-0.7, 0.0, 0.5])
def test_bennetts_linkage_closes_with_rigid_joints_at_every_input(given):
    axes = bennett()
    q = reference(axes, [given])
    assert q[-1] == given and float(placed(from_axes(axes), [mpmath.mpf(v) for v in q])) < 1e-11


def test_without_its_condition_it_is_a_structure():
    with pytest.raises(GeometryError, match="do not close with the driven turns"):
        reference(bennett(1.02), [0.5])
    reference(bennett(1.02), [0.0])  # where it stands it closes, whatever its axes


def test_directions_are_any_and_seats_are_alike():
    axes = bennett(limit=JointLimits(0.01, 0.01))
    model = from_axes(axes)
    for own, (at, _), joint in zip(axes, model.seats, model.joints):
        assert joint.seat_a == joint.seat_b
        assert np.allclose(at[0].mid[:, 2], own.direction, atol=1e-15)
    down = from_axes([Axis(k, (k + 1) % 4, p, (0, 0, -2), driven=k == 0) for k, p in enumerate(CORNERS)])
    assert np.allclose(down.seats[0][0][0].mid[:, 2], (0, 0, -1), atol=1e-15)


def test_one_bearing_has_its_closed_form():
    alpha, limit = 1.0 / 30.0, 0.006
    made = (CORNERS[0], (0.0, -math.sin(alpha), math.cos(alpha)))
    limits = (RIGID, SPHERICAL, JointLimits(limit), RIGID)
    axes = [Axis(k, (k + 1) % 4, p, UP, own, k == 0, made if k == 0 else None)
            for k, (p, own) in enumerate(zip(CORNERS, limits))]  # fmt: skip
    found = prove_pose(from_axes(axes), reference(axes, [0.0]))
    assert found.state == -1 and found.scale == pytest.approx(math.asin(0.4 * math.sin(alpha)) / limit, rel=1e-9)


def square(**changes):
    return [Axis(**({"a": k, "b": (k + 1) % 4, "point": p, "direction": UP} | (changes if k == 1 else {})))
            for k, p in enumerate(CORNERS)]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"a": 2}, "joins no two links"),
        ({"a": -1}, "joins no two links"),
        ({"point": (0, 1)}, "three numbers"),
        ({"point": (0, 1, math.nan)}, "point of axis 1-2"),
        ({"direction": (0, 0, 0)}, "no length"),
        ({"limits": SlideLimits(0.1, 0.1)}, "JointLimits"),
        ({"made": ((0, 1, 0), (1, 0, 0))}, "another axis"),
        ({"b": 5}, "no axis names link 4"),
        ({"a": 0, "b": 1}, "which is one joint"),
        ({"a": 0, "b": 4}, None),
    ],
)
def test_what_is_no_mechanism_is_refused(changes, message):
    if message is None:  # a link that hangs from one joint and a loop that is cut
        with pytest.raises(GeometryError, match="parts open"):
            from_axes(square(**changes))
    else:
        with pytest.raises(GeometryError, match=message):
            from_axes(square(**changes))


def test_the_rest_is_refused_in_words():
    with pytest.raises(GeometryError, match="no Axis"):
        from_axes([(0, 1)])
    with pytest.raises(GeometryError, match="parts open"):
        from_axes(square()[:3])
    with pytest.raises(GeometryError, match="frame = 7"):
        from_axes(square(), frame=7)
    with pytest.raises(GeometryError, match="1 turns for 0 driven"):
        reference(square(), [0.1])
    with pytest.raises(GeometryError, match="give at least"):
        from_axes([])
