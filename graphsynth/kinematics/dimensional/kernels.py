"""The relaxation of the automatic sketch, compiled: springs, repulsion and the room of the faces.

Forces are gathered vertex by vertex in arrays; nothing is allocated inside the loop over the steps.  What the forces
mean is told in :mod:`graphsynth.kinematics.dimensional.sketch`, which holds their strengths.
"""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import hypot


@kernel
def _doubled_area(x, y, a, b, c):
    """Twice the signed area of a triangle."""
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])


@kernel
def _springs(x, y, fx, fy, joints, sides, stiffness, apart):
    """Pull sides to length 1 and push all vertices apart; hubs, the vertices after the joints, push weakly."""
    for i in range(x.size):
        for j in range(i):
            dx, dy = x[i] - x[j], y[i] - y[j]
            square = dx * dx + dy * dy
            both = i < joints and j < joints
            weight = 0.35 if both else (0.07 if i < joints or j < joints else 0.014)
            push = weight / (square * square)
            if both:
                distance = np.sqrt(square)
                push += 3.0 * max(0.0, apart - distance) / distance
            fx[i] += push * dx
            fy[i] += push * dy
            fx[j] -= push * dx
            fy[j] -= push * dy
    for s in range(len(sides)):
        i, j = sides[s, 0], sides[s, 1]
        dx, dy = x[j] - x[i], y[j] - y[i]
        pull = stiffness[s] * (1.0 - 1.0 / max(hypot(dx, dy), 1e-9))
        fx[i] += pull * dx
        fy[i] += pull * dy
        fx[j] -= pull * dx
        fy[j] -= pull * dy


@kernel
def _clearing(x, y, fx, fy, joints, sides, clear, strength):
    """Drive joints away from sides they are not on."""
    for s in range(len(sides)):
        p, q = sides[s, 0], sides[s, 1]
        sx, sy = x[q] - x[p], y[q] - y[p]
        square = max(sx * sx + sy * sy, 1e-12)
        for k in range(joints):
            if k in (p, q):
                continue
            wx, wy = x[k] - x[p], y[k] - y[p]
            at = min(max((wx * sx + wy * sy) / square, 0.0), 1.0)
            gx, gy = wx - at * sx, wy - at * sy
            distance = max(hypot(gx, gy), 1e-9)
            if distance >= clear:
                continue
            push = strength * (clear - distance) / distance
            fx[k] += push * gx
            fy[k] += push * gy
            fx[p] -= (1.0 - at) * push * gx
            fy[p] -= (1.0 - at) * push * gy
            fx[q] -= at * push * gx
            fy[q] -= at * push * gy


@kernel
def _room(x, y, fx, fy, triangles, sense, areas, barrier):
    """Logarithmic barrier: every triangle wants some area."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        push = sense[t] * barrier / max(areas[t], 1e-3)
        fx[a] -= push * (y[c] - y[b])  # across the opposite side
        fy[a] += push * (x[c] - x[b])
        fx[b] -= push * (y[a] - y[c])
        fy[b] += push * (x[a] - x[c])
        fx[c] -= push * (y[b] - y[a])
        fy[c] += push * (x[b] - x[a])


@kernel
def _raise_corners(x, y, fx, fy, corners, turned, height):
    """Push corners of flat plates out: springs alone leave them nearly on a line."""
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        sx, sy = x[c] - x[a], y[c] - y[a]
        length = max(hypot(sx, sy), 1e-9)
        push = -4.0 * max(0.0, height - _doubled_area(x, y, a, b, c) * turned[t] / length) * turned[t] / length
        px, py = -push * sy, push * sx
        fx[a] -= 0.5 * px
        fy[a] -= 0.5 * py
        fx[b] += px
        fy[b] += py
        fx[c] -= 0.5 * px
        fy[c] -= 0.5 * py


@kernel
def _limit(x, y, fx, fy, step):
    """Turn forces into moves that are short where vertices are close."""
    for i in range(x.size):
        near = np.inf
        for j in range(x.size):
            if j != i:
                near = min(near, hypot(x[i] - x[j], y[i] - y[j]))
        share = min(step, 0.2 * min(near, 1.0) / max(hypot(fx[i], fy[i]), 1e-9))
        fx[i] *= share
        fy[i] *= share


@kernel
def even_out(x, y, joints, sides, stiffness, triangles, sense, corners, turned, steps, crowded, strengths):
    """Move the vertices by forces; a step keeps a share of the area of every triangle.

    ``strengths``: apart, clear, clearing, barrier, height, kept, retries.  ``x`` and ``y`` are changed in place.
    ``crowded``: no vertex moves by more than a share of the distance to its nearest one; else all move alike.
    """
    apart, clear, clearing, barrier, height, kept, retries = strengths
    count = len(triangles)
    fx, fy, areas = np.empty_like(x), np.empty_like(y), np.empty(count)
    nx, ny, held = np.empty_like(x), np.empty_like(y), np.empty(x.size, dtype=np.bool_)
    step = 0.15
    for _ in range(steps):
        # forces
        for t in range(count):
            areas[t] = _doubled_area(x, y, triangles[t, 0], triangles[t, 1], triangles[t, 2]) * sense[t]
        for v in range(x.size):
            fx[v] = fy[v] = 0.0
        _springs(x, y, fx, fy, joints, sides, stiffness, apart)
        _room(x, y, fx, fy, triangles, sense, areas, barrier)
        _clearing(x, y, fx, fy, joints, sides, clear, clearing)
        _raise_corners(x, y, fx, fy, corners, turned, height)
        if crowded:
            _limit(x, y, fx, fy, step)
        else:
            largest = 0.0  # of the squared forces; a NaN stays
            for v in range(x.size):
                square = fx[v] * fx[v] + fy[v] * fy[v]
                if square > largest or square != square:
                    largest = square
            share = min(step, 0.2 / max(np.sqrt(largest), 1e-9))
            for v in range(x.size):
                fx[v] *= share
                fy[v] *= share
        # moves, shortened until every triangle keeps its share
        done = False
        for _ in range(3 * int(retries) if crowded else int(retries)):
            for v in range(x.size):
                nx[v], ny[v] = x[v] + fx[v], y[v] + fy[v]
                held[v] = False
            for t in range(count):
                a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                if not _doubled_area(nx, ny, a, b, c) * sense[t] >= kept * areas[t]:
                    held[a] = held[b] = held[c] = True
            done = not held.any()
            if done:
                break
            for v in range(x.size):
                if held[v]:  # the vertices of a triangle that would become too small move less
                    fx[v] *= 0.3
                    fy[v] *= 0.3
        if done:
            for v in range(x.size):
                x[v], y[v] = nx[v], ny[v]
            step = min(0.3, step * 1.2)
        else:
            step *= 0.5
        if step < 1e-3:
            break
