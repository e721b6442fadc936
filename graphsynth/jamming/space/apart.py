"""Proofs of freedom with links as bodies: every equation and limit depends on two links.

Places round every loop add up to zero, and the axes of every joint are within its limit: where no driven joint tilts,
that is all that closing within the limits means.  Over wide boxes of given coordinates these equations bend less than
the product of all motions round a loop, whose enclosure widens by the sum of all angles.
See theory/closure-in-space 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import Balls, exact
from graphsynth.jamming.space.binding import At, at, coordinates, hessian, pair_slopes
from graphsynth.jamming.space.bodies import Bodies, stands_apart
from graphsynth.jamming.space.closure import times
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.proof import Ints, bend_of, pivots, sides

Array = NDArray[np.float64]
_UP, _STEPS = 1.0 + 1e-12, 6
#: Step of the differences that turn rates of joints into those of bodies; worth of a lean beside that of a spin.
_STEP, _LEAN = 1e-6, 1e-3


def closes_apart(model: SpaceModel, q: Array, rate: Array, given: Array) -> bool:
    """Whether the mechanism is proved to close within its limits for a box of given coordinates (certified).

    Arguments as of `graphsynth.jamming.space.proof.closes`.  False too where a driven joint tilts, or a loop has none
    but joints that cannot tilt.
    """
    if not stands_apart(model):
        return False
    bodies = Bodies(model, q)
    if bodies.conditions[1] or bodies.closing or not bodies.conditions[3]:
        return False
    centre = coordinates(bodies, q)
    along = _along(bodies, q, rate)
    here = at(bodies, exact(centre[None]))
    weight = np.ones(bodies.size)
    for link in bodies.charts:
        weight[list(bodies.bodies[bodies.of_link[link]].columns[:2])] = _LEAN
    for own in bodies.slides.values():
        weight[own] = _LEAN
    basic = pivots(here.J.mid[0][:, : bodies.size], weight)
    if len(basic) < here.V.mid.shape[1]:
        return False
    inverse = exact(np.linalg.pinv(here.J.mid[:, :, basic]))
    start = times(inverse, here.V[..., None])[0, :, 0].size
    start = start + sides(times(inverse, times(here.J, exact(along[None])))[0].size, given)
    rest = (exact(np.eye(len(basic))) - times(inverse, here.J[:, :, basic])[0]).size
    reach, still = 2.0 * start + 1e-15, sides(np.abs(along), given)
    for _ in range(_STEPS):
        if not (np.isfinite(reach).all() and reach.max() <= 1.0):
            return False
        whole = still.copy()
        whole[basic] += reach
        far = at(bodies, Balls(centre[None], whole[None]))
        H = hessian(far, inverse, [])[0]
        image = (start + sides(rest, reach) + 0.5 * bend_of(H, along, given, basic, reach)) * _UP
        if (image < reach).all():
            return _allowed(here, far, (along, given), (basic, reach))
        reach = np.maximum(1.5 * image, reach) + 1e-300
    return False


def _along(bodies: Bodies, q: Array, rate: Array) -> Array:
    """Change of the coordinates of bodies with the given ones, (width, given), from that of the joints (estimated)."""
    count = rate.shape[1]
    whole = np.concatenate([rate, np.eye(count)])
    found = np.zeros((bodies.width, count))
    for k, own in enumerate(whole.T):
        step = _STEP / max(1.0, float(np.abs(own).max()))
        found[:, k] = (coordinates(bodies, q + step * own) - coordinates(bodies, q - step * own)) / (2.0 * step)
    found[bodies.size :] = np.eye(count)
    return found


def _allowed(here: At, far: At, given: tuple[Array, Array], basic: tuple[Ints, Array]) -> bool:
    """Whether all limits are obeyed over the box: by value and slope in the middle, and curvature over the box."""
    bodies, (along, half), (columns, reach) = here.bodies, given, basic
    model, none = bodies.model, exact(np.zeros((1, here.V.mid.shape[1])))
    low = model.limit_bounds[0]
    for pair in bodies.conditions[2]:
        value, slope = pair_slopes(here, pair)
        quarter = exact(low[pair.row]) * exact(low[pair.row]) * 0.25
        cosine = (1.0 - quarter) / (1.0 + quarter)
        first = sides(times(slope[:, None], exact(along[None]))[0].size, half)[0]
        first = first + float((slope.size[0, columns] * reach).sum()) * _UP
        H = hessian(far, none, [(pair, 1.0)])
        total = value + cosine
        most = float(total.mid[0] + total.rad[0]) + (first + 0.5 * bend_of(H, along, half, columns, reach)[0]) * _UP
        if not most < -1e-15:
            return False
    for bound, limit in zip(model.bounds, low):
        if not bound.angular:
            own = [bodies.slides[column] for column in bound.columns]
            size = (np.abs(far.u.mid[0, own]) + far.u.rad[0, own]) * _UP
            if not float(np.sqrt((size**2).sum() * _UP)) * _UP < limit:
                return False
    return True
