"""Pictures of mechanisms in space: links between the axes of their joints, seen from afar, and how far axes tilt.

Parallel projection; what is further away is drawn first.  See explanation/jamming-in-space.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.svg import number, painted, picture, words

if TYPE_CHECKING:
    from graphsynth.jamming.space import Seat, SpaceModel

Array = NDArray[np.float64]
#: Pixels round the mechanism, of a letter and of a line, from a joint to its label at most; colours of links.
_MARGIN, _LETTER, _LINE, _FAR, _COLOURS = 44.0, 8.0, 18.0, 60.0, ("a", "c", "d", "b")


def mechanism_in_space(
    model: SpaceModel,
    q: Array | None = None,
    *,
    view: tuple[float, float] = (-60.0, 25.0),
    magnified: float = 1.0,
    names: Mapping[int, str] | None = None,
    title: str = "A mechanism in space",
    centre: tuple[float, float, float] | None = None,
    width: float = 420.0,
) -> str:
    """Draw a mechanism in space as SVG.

    Every link is a bar, or a plate, between its joints.  At a joint the axis of link a is a broken line, that of link b
    a solid one in its colour; a disc stands across it.  Beside it stands the share of its limit on tilt that is used.

    Parameters
    ----------
    model : SpaceModel
    q : ndarray, shape (width,), optional
        Unknowns and given coordinates, as of ``prove_pose(...).optimum.q``; the reference by default.
    view : (float, float)
        Azimuth and elevation of the eye, degrees.
    magnified : float
        Factor on the tilts that are shown; places and bars are true.
    names : mapping of int to str, optional
        Letters of the joints, by number.
    title : str
    centre : (float, float, float), optional
        Point that thin lines join with every joint, as that of a spherical linkage.
    width : float
        Pixels.

    Returns
    -------
    str

    Raises
    ------
    GeometryError
        A wrong number of coordinates; a size or factor that is not positive.
    """
    q = np.zeros(model.width) if q is None else np.asarray(q, dtype=np.float64)
    if q.shape != (model.width,) or not np.isfinite(q).all():
        raise GeometryError(f"q has the shape {q.shape}, or is not finite; give {model.width} coordinates of the model")
    if not (magnified > 0.0 and width > 0.0):
        raise GeometryError(f"magnified = {magnified} and width = {width} must be positive; correct the values")
    frames = _frames(model, q)
    joints = [_Seen(model, k, q, frames, magnified) for k in range(len(model.joints))]
    places = [joint.place for joint in joints] + ([] if centre is None else [np.array(centre)])
    page = _Page(view, np.array(places), width)
    thin = painted(stroke="soft", width=1.0)
    colours = ["soft" if k == model.frame else _COLOURS[(k - 1) % len(_COLOURS)] for k in range(model.links)]
    body = [page.path([np.array(centre), joint.place], thin) for joint in joints if centre is not None]
    parts = []
    for link in range(model.links):
        corners = np.array([joint.place for joint in joints if link in joint.links])
        parts.append(page.link(corners, colours[link], link == model.frame))
    body += [text for _, text in sorted(parts, key=lambda part: part[0])]
    ahead = sorted(joints, key=lambda joint: page.depth(joint.place))
    body += [page.joint(joint, colours[joint.links[1]]) for joint in ahead]
    texts = [(joint.place, _text(joint, (names or {}).get(joint.number, ""))) for joint in joints]
    body += page.labels([(place, text) for place, text in texts if text])
    return picture(body, width, page.height, title)


def _text(joint: _Seen, name: str) -> str:
    """Write the name of a joint, the use of its limit, and how far its axis was made wrong."""
    share = f"{100.0 * joint.share:.0f} %" if math.isfinite(joint.share) else ""
    return " · ".join(filter(None, (name, share, f"{joint.off:.2g}° off" if joint.off > 1e-6 else "")))


def _seated(seat: Seat) -> Array:
    """Rotation of a seat on its link."""
    return _turned(seat.turn) @ _turned((0.0, 0.0, seat.spin))


def _turned(vector: Sequence[float] | Array) -> Array:
    """Rotation about a vector by its length."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K))


def _tilt(x: float, y: float) -> Array:
    """Rotation vector of a tilt from its chart."""
    size = math.hypot(x, y)
    return np.array([x, y, 0.0]) * (2.0 * math.atan(0.5 * size) / size if size > 0.0 else 0.0)


def _frames(model: SpaceModel, q: Array) -> dict[int, tuple[Array, Array]]:
    """Rotation and place of every link, from the frame along a tree of joints; of link b from a, or back."""
    frames = {model.frame: (np.eye(3), np.zeros(3))}
    while len(frames) < model.links:
        for joint, column in zip(model.joints, model.column):
            turn, x, y, *shift = (float(q[c]) if c >= 0 else 0.0 for c in column)
            R, S = (_seated(seat) for seat in (joint.seat_a, joint.seat_b))
            moved = R @ _turned(_tilt(x, y)) @ _turned((0.0, 0.0, turn)) @ S.T
            place = np.array(joint.seat_a.point) + model.unit * (R @ shift) - moved @ np.array(joint.seat_b.point)
            if joint.a in frames and joint.b not in frames:
                own, at = frames[joint.a]
                frames[joint.b] = own @ moved, at + own @ place
            elif joint.b in frames and joint.a not in frames:
                own, at = frames[joint.b]
                frames[joint.a] = own @ moved.T, at - own @ moved.T @ place
    return frames


class _Seen:
    """A joint as it is drawn: place, axes of both links with the tilt between them magnified, use of its limit."""

    def __init__(self, model: SpaceModel, k: int, q: Array, frames: dict[int, tuple[Array, Array]], m: float) -> None:
        joint, column = model.joints[k], model.column[k]
        self.number, self.links, self.driven = k, (joint.a, joint.b), joint.driven
        own, at = frames[joint.a]
        seat = own @ _seated(joint.seat_a)
        self.place = at + own @ np.array(joint.seat_a.point)
        x, y = (float(q[column[c]]) if column[c] >= 0 else 0.0 for c in (1, 2))
        self.axis = seat[:, 2]
        self.leaning = (seat @ _turned(m * _tilt(x, y)))[:, 2]
        self.tilt = float(np.linalg.norm(_tilt(x, y)))
        limit = joint.limits.tilt if hasattr(joint.limits, "tilt") else math.inf
        self.share = self.tilt / limit if 0.0 < limit < math.inf else math.nan
        off = _turned(joint.seat_a.turn)[:, 2] @ _turned(joint.seat_b.turn)[:, 2]
        self.off = math.degrees(math.acos(min(1.0, float(off))))


class _Page:
    """Parallel projection to a page that holds all places."""

    def __init__(self, view: tuple[float, float], places: Array, width: float) -> None:
        turn, rise = (math.radians(angle) for angle in view)
        eye = np.array([math.cos(rise) * math.cos(turn), math.cos(rise) * math.sin(turn), math.sin(rise)])
        right = np.array([-math.sin(turn), math.cos(turn), 0.0])
        self.eye, self.plane = eye, np.array([right, np.cross(eye, right)])
        flat = places @ self.plane.T
        low, high = flat.min(0), flat.max(0)
        #: Half length of an axis, in units of the mechanism.
        self.reach = 0.16 * float(np.linalg.norm(places.max(0) - places.min(0)))
        low, high = low - self.reach, high + self.reach
        self.width = width
        self.scale = (width - 2.0 * _MARGIN) / float(max(high[0] - low[0], 1e-300))
        self.height = float(high[1] - low[1]) * self.scale + 2.0 * _MARGIN
        self.corner = np.array([low[0], high[1]])
        self.taken: list[Array] = []  # points along all that is drawn

    def xy(self, point: Array) -> Array:
        """Place on the page."""
        right, up = self.plane @ point - self.corner
        return np.array([_MARGIN + right * self.scale, _MARGIN - up * self.scale])

    def depth(self, point: Array) -> float:
        """How near the eye a point is."""
        return float(point @ self.eye)

    def path(self, points: Sequence[Array], paint: str, closed: bool = False) -> str:
        """Write a polyline."""
        corners = [self.xy(point) for point in points]
        for p, q in pairwise([*corners, *corners[: int(closed)]]):
            self.taken += [p + s * (q - p) for s in np.linspace(0.0, 1.0, 2 + int(np.hypot(*(q - p)) / 4.0))]
        at = " L".join(" ".join(map(number, corner)) for corner in corners)
        return f'<path d="M{at}{"Z" if closed else ""}" {paint} stroke-linejoin="round" stroke-linecap="round"/>'

    def link(self, corners: Array, colour: str, still: bool) -> tuple[float, str]:
        """Draw a link as a bar, or as a plate; that which stands still is broken."""
        plate = len(corners) > 2
        paint = painted(colour if plate else "", colour, 3.0 if still else 6.0, opacity=0.25)
        dash = ' stroke-dasharray="7 7"' if still else ""
        return self.depth(corners.mean(0)), self.path(list(corners), paint + dash, plate)

    def joint(self, joint: _Seen, colour: str) -> str:
        """Draw the axes of both links and a disc across the first."""
        ends = [joint.place - self.reach * joint.axis, joint.place + self.reach * joint.axis]
        lean = [joint.place - self.reach * joint.leaning, joint.place + self.reach * joint.leaning]
        first = np.cross(joint.axis, [1.0, 0.0, 0.0] if abs(joint.axis[0]) < 0.9 else [0.0, 1.0, 0.0])
        first /= np.linalg.norm(first)
        second = np.cross(joint.axis, first)
        round_it = [first * math.cos(a) + second * math.sin(a) for a in np.linspace(0.0, math.tau, 33)[:-1]]
        disc = self.path([joint.place + 0.28 * self.reach * v for v in round_it], painted("paper", "ink", 1.6), True)
        x, y = map(number, self.xy(joint.place))
        dot = f'<circle cx="{x}" cy="{y}" r="{3.5 if joint.driven else 2}" {painted("b" if joint.driven else "ink")}/>'
        dashes = f'{painted(stroke="ink", width=1.3)} stroke-dasharray="9 3 2 3"'
        return disc + self.path(ends, dashes) + self.path(lean, painted(stroke=colour, width=2.6)) + dot

    def labels(self, labels: Sequence[tuple[Array, str]]) -> list[str]:
        """Write texts near points: where they cover least of the lines and of each other, and are not far away."""
        lines, points = np.array(self.taken), np.array([self.xy(point) for point, _ in labels])
        halves = [0.5 * np.array([_LETTER * len(text), _LINE]) for _, text in labels]
        places = []
        for k, half in enumerate(halves):
            near = np.stack(np.meshgrid(*(np.arange(-far, far + 1.0, 5.0) for far in half + _FAR)), -1).reshape(-1, 2)
            spots = np.clip(points[k] + near, half + 2.0, np.maximum([self.width, self.height] - half - 2.0, half))
            away = np.hypot(*np.maximum(np.abs(spots[:, None] - points) - half, 0.0).T)
            cost = 3.0 * (np.abs(lines - spots[:, None]) < half + 5.0).all(-1).sum(-1) + 0.12 * away[k]
            places.append((spots, cost + 0.4 * np.maximum(away[k] - np.delete(away, k, 0) + 9.0, 0.0).sum(0)))
        at = points + np.inf
        for weight, k in product((0.001, 0.01, 0.1, 1.0, 1.0), range(len(labels))):
            (spots, cost), at[k] = places[k], np.inf
            for half, other in zip(halves, at):
                cost = cost + weight * np.maximum(half + halves[k] - np.abs(spots - other), 0.0).prod(-1)
            at[k] = spots[np.argmin(cost)]
        look: dict[str, Any] = {"size": 15.0, "colour": "ink", "anchor": "middle", "halo": 4.0}
        return [words(text, x, y + 5.4, **look) for (_, text), (x, y) in zip(labels, at)]
