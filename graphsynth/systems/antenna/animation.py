"""The antenna pointing mechanism moving by itself, as an SVG: both legs in space, and where the beam goes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.moving import Moving
from graphsynth.drawing.svg import painted, words
from graphsynth.systems.antenna.mechanism import PointingMechanism
from graphsynth.systems.antenna.model import Poses, crank_direction, joints, legs

Array = NDArray[np.float64]
_ROUND = 'stroke-linecap="round" stroke-linejoin="round"'
_CIRCLE = 48


def project(points: Array, azimuth: float = math.radians(38.0), elevation: float = math.radians(24.0)) -> Array:
    """Project points of space along a direction of view: right and up, shape (..., 2).

    Examples
    --------
    >>> project(np.array([0.0, 0.0, 1.0]), 0.3, 0.0).tolist()
    [0.0, 1.0]
    """
    c, s = math.cos(azimuth), math.sin(azimuth)
    right = -s * points[..., 0] + c * points[..., 1]
    ahead = c * points[..., 0] + s * points[..., 1]
    return np.stack([right, math.cos(elevation) * points[..., 2] - math.sin(elevation) * ahead], -1)


def pointing_animation(
    mechanism: PointingMechanism,
    phi_x: ArrayLike,
    phi_y: ArrayLike,
    *,
    s_y: int = 1,
    s_x: int = -1,
    seconds: float = 8.0,
    title: str = "Antenna pointing mechanism",
) -> str:
    """Draw the mechanism over the crank angles of a scan that ends where it began, as one SVG.

    `phi_x` and `phi_y` of shape (n,), radians, on the assembly mode `s_y`, `s_x`; one pass takes so many `seconds`. A
    `GeometryError` says that some pose cannot be assembled.
    """
    poses = mechanism.poses(phi_x, phi_y, s_y, s_x)
    if poses.a.ndim != 1 or poses.a.size < 2 or not poses.assembled.all():
        raise GeometryError("an animation needs at least two poses, all of which can be assembled; shorten the scan")
    drawing = Moving(620.0, 400.0, seconds, int(poses.a.size // 8))
    _Space(mechanism, poses).draw(drawing)
    _beam(drawing, np.degrees(poses.b), np.degrees(poses.a))
    return drawing.svg(title)


class _Space:
    """Both legs and the reflector, projected to the left part of the page."""

    def __init__(self, mechanism: PointingMechanism, poses: Poses) -> None:
        l1, R = mechanism.l1, poses.rotation
        self.l1, self.R, self.order = l1, R, mechanism.order
        self.pivot, self.ball, self.cardan = zip(*joints(mechanism, poses))
        turn = np.linspace(0.0, math.tau, _CIRCLE, endpoint=False)
        self.rim = l1 * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], -1)
        self.circles = [
            pivot + leg.crank * crank_direction(leg.name, turn) for pivot, leg in zip(self.pivot, legs(mechanism))
        ]
        everything = project(
            np.concatenate([*self.ball, *self.cardan, *self.circles, self.rim, l1 * R[..., :, 2], -l1 * R[..., :, 1]])
        )
        self.low, high = everything.min(axis=0), everything.max(axis=0)
        self.scale = min(330.0 / (high - self.low)[0], 360.0 / (high - self.low)[1])
        self.top = 20.0 + 0.5 * (360.0 - self.scale * (high - self.low)[1])
        self.height = (high - self.low)[1]

    def page(self, points: Array) -> Array:
        """Pixels, y down."""
        flat = (project(np.asarray(points, float)) - self.low) * self.scale
        return np.stack([20.0 + flat[..., 0], self.top + self.scale * self.height - flat[..., 1]], -1)

    def draw(self, drawing: Moving) -> None:
        """Add everything from the back to the front."""
        l1, R = self.l1, self.R
        fixed = np.array([0.0, 1.25 * l1, 0.0]) if self.order == "YX" else np.array([1.25 * l1, 0.0, 0.0])
        drawing.fixed(_still(self.page(np.array([-fixed, fixed])), "soft", dash="9 4 2 4"))
        for circle, colour in zip(self.circles, "ab"):
            drawing.fixed(_still(self.page(circle), colour, dash="2 4", closed=True))
        drawing.fixed(_still(self.page(self.rim), "soft", dash="2 4", closed=True))
        for k, colour in enumerate("ab"):
            pivot = np.broadcast_to(self.pivot[k], self.ball[k].shape)
            self._lines(drawing, pivot, self.ball[k], colour, 6.0)
            self._lines(drawing, self.ball[k], self.cardan[k], colour, 3.0)
        disc = np.einsum("nij,pj->npi", R, self.rim)
        drawing.path(self.page(disc), f"{painted('fill', 'ink', 1.6, opacity=0.72)} {_ROUND}", closed=True)
        centre = np.zeros((len(R), 3))
        self._lines(drawing, centre, l1 * R[..., :, 2], "c", 2.4)
        for k, colour in enumerate("ab"):
            self._lines(drawing, centre, self.cardan[k], "ink", 1.2)
            x, y = map(float, self.page(self.pivot[k]))
            drawing.fixed(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" {painted(colour)}/>')
            drawing.circle(self.page(self.ball[k]), 5.0, painted("paper", colour, 2.0))
            drawing.circle(self.page(self.cardan[k]), 4.0, painted("paper", colour, 2.0))
            x, y = self.page(self.circles[k]).mean(0)[0], self.page(self.circles[k]).max(0)[1] + 16.0
            drawing.fixed(words(("leg Y", "leg X")[k], x, y, size=13.0, colour=colour, anchor="middle", halo=3.0))

    def _lines(self, drawing: Moving, start: Array, end: Array, colour: str, width: float) -> None:
        drawing.path(self.page(np.stack([start, end], 1)), f"{painted(stroke=colour, width=width)} {_ROUND}")


def _beam(drawing: Moving, azimuth: Array, elevation: Array) -> None:
    """Add the direction of the beam on the right: azimuth to the right, elevation upward, degrees."""
    largest = max(1.0, 1.1 * float(np.abs([azimuth, elevation]).max()))
    middle, half = np.array([490.0, 200.0]), 105.0
    points = middle + half / largest * np.stack([azimuth, -elevation], -1)
    for reach in (np.array([half, 0.0]), np.array([0.0, half])):
        drawing.fixed(_still(np.stack([middle - reach, middle + reach]), "soft"))
    drawing.fixed(_still(points, "c", 1.5, closed=True, opacity=0.6))
    drawing.circle(points, 5.0, painted("c"))
    x, y = middle
    drawing.fixed(words("azimuth", x + half, y + 18.0, size=13.0, anchor="end"))
    drawing.fixed(words("elevation", x + 6.0, y - half + 4.0, size=13.0))
    ticks = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 90.0)
    step = max((tick for tick in ticks if tick <= 0.85 * largest), default=0.5)
    for sign in (-1, 1):
        at = half * step / largest * sign
        drawing.fixed(_still(np.array([[x + at, y - 4], [x + at, y + 4]]), "soft"))
        drawing.fixed(_still(np.array([[x - 4, y - at], [x + 4, y - at]]), "soft"))
        drawing.fixed(words(f"{sign * step:g}°", x + at, y - 9.0, size=13.0, anchor="middle"))
        drawing.fixed(words(f"{sign * step:g}°", x - 9.0, y - at + 4.0, size=13.0, anchor="end"))


def _still(
    points: Array, colour: str, width: float = 1.0, *, dash: str = "", closed: bool = False, opacity: float = 1.0
) -> str:
    data = "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in points) + ("Z" if closed else "")
    more = (f' stroke-dasharray="{dash}"' if dash else "") + (f' stroke-opacity="{opacity:g}"' if opacity < 1.0 else "")
    return f'<path d="{data}" {painted(stroke=colour, width=width)} {_ROUND}{more}/>'
