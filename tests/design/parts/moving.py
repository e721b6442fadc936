"""Parts at poses, point by point: nothing here is taken from the code under test but outlines, layers and pins."""

from __future__ import annotations

import numpy as np


def outline(shape, spacing):
    """Points of a boundary, no further apart than about the spacing."""
    corners = np.array(shape.flat(0.02))
    found = []
    for p, q in zip(corners, np.roll(corners, -1)):
        found.append(p + (q - p) * np.linspace(0, 1, max(2, int(abs(q - p) / spacing) + 2))[:-1])
    return np.concatenate(found)


def carried(points, poses, link, unit):
    """Points of a link at all poses, (samples, points)."""
    x, y, angle = poses[:, link].T
    return unit * (x + 1j * y)[:, None] + np.exp(1j * angle)[:, None] * points


def inside(point, polygon):
    """Whether a point lies in a polygon, by its winding number."""
    turn = np.angle(np.roll(polygon - point, -1) / (polygon - point))
    return abs(turn.sum()) > 1.0


def nearest(one, other):
    """Least distance of points over all samples; 0 where one part holds a point of the other."""
    least = np.inf
    for P, Q in zip(one, other):
        if inside(P[0], Q) or inside(Q[0], P):
            return 0.0
        least = min(least, np.abs(P[:, None] - Q[None, :]).min())
    return least


def sharing(made):
    """Pairs of parts that are in one layer somewhere, as (name, link, boundary): links, pins that pass through."""
    frame = made.motion.mechanism.frame
    for k in range(1, made.count + 1):
        there = [
            (f"link {a}", made.plan.links[a], shape, {a})
            for a, shape in enumerate(made.plan.outlines)
            if made.layers[a] == k
        ]
        for n, pin in enumerate(made.plan.pins):
            own = [made.layers[a] for a in pin.sheets]
            if min(own) < k < max(own):
                disc = type(made.plan.outlines[0])((pin.at,), made.sizes.spacer)
                there.append((f"pin {n}", pin.link, disc, {*pin.sheets, *pin.passes}))
        for i, one in enumerate(there):
            for other in there[:i]:
                if not one[3] & other[3] and frame not in (one[1] if one[0][0] == "l" else -1,):
                    yield one, other
