"""The lambda linkage in interval arithmetic: where it can be assembled, and how much it tilts, over a tolerance box.

This is the kinematics of sections 2.2 and 3.2 to 3.4 evaluated for whole pieces of the turn at once.  It shares no
formula with the closed form of the arcs, so that each checks the other.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval, cos, pi, sin
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.corners import check_condition, gap_values, sine_of, slanted
from graphsynth.jamming.bearing.parameters import ToleranceBox

__all__ = ["Pose", "corner_gap", "grid", "pose", "pose_gap", "turn_pieces", "turns_freely"]

Mask = NDArray[np.bool_]


class Pose(NamedTuple):
    """Enclosures over pieces of the turn, for all parameters of a box.

    Attributes
    ----------
    assembled, missing : ndarray of bool
        Proved that the linkage can be assembled at every point of the piece, or at none, for every parameter vector.
    sine : Interval
        Sine of the tilt, without sign.
    """

    assembled: Mask
    missing: Mask
    sine: Interval


def turn_pieces(count: int) -> Interval:
    """Cut [0, 2 pi] into pieces that overlap by rounding only and cover the turn."""
    edges = np.linspace(0.0, float(np.nextafter(2.0 * np.pi, 7.0)), count + 1)
    return Interval.from_bounds(edges[:-1], edges[1:])


def turns_freely(box: ToleranceBox, amplitude: float) -> bool:
    """Whether a few exact inequalities prove that every parameter vector is assembled at every crank angle.

    Parameters
    ----------
    box : ToleranceBox
        The linkage.
    amplitude : float
        Upper bound over the box of the largest ``|A_z| / l3`` of a turn.

    Returns
    -------
    bool
        True is a proof; False says nothing (then `pose` decides piece by piece).

    Notes
    -----
    With ``z`` the largest ``|A_z|``: the pin runs at a plan radius in ``[sqrt(l2^2 - z^2), l2]``, the plan length s3 of
    the coupler lies in ``[sqrt(l3^2 - z^2), l3]``, and ``sqrt(1 - x^2) >= 1 - x^2`` keeps all bounds rational.  Then
    ``|l4 - s3| <= D <= l4 + s3`` (specification 2.3 and 3.3) holds for every D between the bounds of ``|A - C|``.

    Examples
    --------
    >>> turns_freely(ToleranceBox(), 0.014), turns_freely(ToleranceBox(2, 1, 1, 1), 0.0)
    (True, False)
    """
    if not amplitude < 1.0:
        return False
    l1, l2, l3, l4 = (box[name] for name in ("l1", "l2", "l3", "l4"))
    z = Fraction(amplitude) * l3.lower  # the largest ratio is that of the largest crank and the smallest coupler
    radius = l2.lower - z * z / l2.lower
    plan = l3.lower if box.rod == "deck" else l3.lower - z * z / l3.lower
    nearest = max(l1.lower - l2.upper, radius - l1.upper)
    apart = max(l4.upper - plan, l3.upper - l4.lower, Fraction(0))
    return nearest > 0 and nearest >= apart and l1.upper + l2.upper <= l4.lower + plan


def pose(box: ToleranceBox, f: Interval) -> Pose:
    """Enclose assembly and tilt over pieces ``f`` (shape (m,)) of the turn.

    Guarantee: certified for every parameter vector of the box.

    Examples
    --------
    >>> found = pose(ToleranceBox(alpha="1/30"), turn_pieces(256))
    >>> bool(found.assembled.all()), bool(found.missing.any())
    (True, False)
    """
    import graphsynth.intervals.kernels.loops  # noqa: F401  # long arrays take the compiled path, once it is loaded

    # one shape for all, so that every operation takes it
    l1, l2, l3, l4, turn = (_spread(box.outer(name), f) for name in ("l1", "l2", "l3", "l4", "azimuth"))
    n1, n2, n3, alpha = (_spread(value, f) for value in _direction(box))
    phi = f - turn  # the axis turned by the azimuth: the same motion, seen in a turned frame
    cf, sf = cos(phi), sin(phi)
    s, c, v = sin(alpha), cos(alpha), sin(alpha / 2).sqr() * 2
    x = l2 * (cf * (c + n1.sqr() * v) + sf * (n1 * n2 * v - n3 * s))
    y = l2 * (cf * (n1 * n2 * v + n3 * s) + sf * (c + n2.sqr() * v))
    z = l2 * (cf * (n1 * n3 * v - n2 * s) + sf * (n2 * n3 * v + n1 * s))
    dx, dy = x - l1 * cos(turn), y + l1 * sin(turn)
    square = dx.sqr() + dy.sqr()
    ratio = abs(z) / l3
    plan = l3 if box.rod == "deck" else ((l3 - z) * (l3 + z)).sqrt()
    near, far = square - (l4 - plan).sqr(), (l4 + plan).sqr() - square
    assembled = (near.lo >= 0.0) & (far.lo >= 0.0) & (square.lo > 0.0)
    missing = (near.hi < 0.0) | (far.hi < 0.0)
    if box.rod == "rigid":
        assembled = assembled & (ratio.hi <= 1.0)
        missing = missing | (ratio.lo > 1.0)
    return Pose(np.asarray(assembled), np.asarray(missing), sine_of(ratio, box.rod))


def _spread(value: Interval, f: Interval) -> Interval:
    """Repeat one interval over the pieces."""
    return Interval.from_bounds(np.broadcast_to(value.lo, f.shape), np.broadcast_to(value.hi, f.shape))


def _direction(box: ToleranceBox) -> tuple[Interval, Interval, Interval, Interval]:
    """Return the unit direction of the tilt axis and the angle of the active rotation."""
    n = [box.outer(f"n{i}") for i in (1, 2, 3)]
    alpha = box.outer("alpha") if box.convention == "spec" else -box.outer("alpha")
    known = [box[f"n{i}"] for i in (1, 2, 3)]
    if all(part.is_point for part in known) and sum(part.lower**2 for part in known) == 1:
        return n[0], n[1], n[2], alpha
    length = (n[0].sqr() + n[1].sqr() + n[2].sqr()).sqrt()
    one = Interval.from_bounds(-1.0, 1.0)
    unit = [(part / length).intersect(one) for part in n]
    return unit[0], unit[1], unit[2], alpha


def pose_gap(box: ToleranceBox, f: Interval, condition: Condition) -> tuple[Interval, Pose]:
    """Enclose the gap g (mm) over pieces of the turn for all parameters of the box, with the poses.

    The lower bound holds for every parameter vector and angle of a piece, and so does the upper bound.
    """
    check_condition(box, condition)
    found = pose(box, f)
    low, high = found.sine.lo, found.sine.hi
    lower = corner_gap(box, Interval.from_bounds(low, low), condition, 0).lo
    upper = corner_gap(box, Interval.from_bounds(high, high), condition, 1).hi
    return Interval.from_bounds(lower, upper), found


def corner_gap(box: ToleranceBox, sine: Interval, condition: Condition, corner: int) -> Interval:
    """Gap at the sine given and at the corner of the bearing that makes it smallest (0) or largest (1)."""

    def end(name: str, rising: bool) -> Interval:
        low, high = box[name].ends[corner if rising else 1 - corner]
        return _spread(Interval.from_bounds(low, high), sine)

    h, c = end("Hb", True) / 2, end("clearance", False)
    if condition != "general":
        return gap_values(sine, end("Rb", condition == "B"), h, c, None, condition)
    a = gap_values(sine, end("Rb", False), h, c, None, "A")
    # gA falls and gB / C rises with the radius: each at its own end bounds the smaller of both from either side
    b = slanted(sine, end("Rb", True), end("hole_length", True) / 2, c)
    return Interval.from_bounds(np.minimum(a.lo, b.lo), np.minimum(a.hi, b.hi))


def grid(count: int) -> Interval:
    """Return ``count`` angles over the turn, a multiple of four, so that the quarter turns are among them."""
    return pi() * Interval.from_bounds(2.0 * np.arange(count) / count, 2.0 * np.arange(count) / count)
