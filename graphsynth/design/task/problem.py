"""Errors of candidates with exact derivatives: all targets and bounds in one pass back through the mechanism.

Theory: docs/explanation/embodiment.md, "Many targets at once".
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.aims import Aim, aims_of
from graphsynth.design.task.contours import ContourAim
from graphsynth.design.task.model import Model, Rows, Unknowns, turned_with
from graphsynth.design.task.targets import PathTarget
from graphsynth.design.task.wishes import Lengths, direct_wishes, sampled_wishes
from graphsynth.kinematics.engine.gradients import pose_gradients

Array = NDArray[np.float64]


class Linearised(NamedTuple):
    """Root mean square of all numbers (infinite: no motion), numbers (sets, m), derivatives (sets, m, size)."""

    error: Array
    values: Array
    slopes: Array


class Exact(NamedTuple):
    """One candidate where its motion is exact: errors (d, n) of every target and their slopes (d, n, size).

    ``bounds`` (m,) are kept where they are negative, ``steep`` (m, size) their slopes; ``times`` of the targets, None
    if it does not complete its range.
    """

    errors: list[tuple[Array, Array]]
    bounds: Array
    steep: Array
    times: list[Array] | None


#: Part of a range within which a time is at its end.
_END = 1e-9
#: Rounds in which samples come nearer to where bounds are worst; samples on either side, over the step before.
_PASSES, _AROUND = 3, np.linspace(-1.0, 1.0, 17)


class TaskProblem:
    """What the candidates of a model shall achieve.

    ``few``: at so many points of a path, for a first look; ``turned``: outlines as a whole, as of `ContourAim`.
    """

    def __init__(self, model: Model, few: int = 0, turned: float = 0.0) -> None:
        self.model = model
        outlines = [own for own in model.task.targets if isinstance(own, PathTarget) and own.drawn and turned > 0.0]
        made = {id(own): ContourAim(model, own, turned) for own in outlines}
        self.aims: list[Aim] = aims_of(model, few, made)
        self.lengths = Lengths(model)

    def linearise(self, X: Array, times: list[Array] | None, strict: float) -> tuple[Linearised, list[Array]]:
        """Return errors and derivatives of candidates (sets, size), and the times found, from those given if any.

        ``strict``: weight of the bounds.
        """
        model = self.model
        u = model.read(X)
        moved = model.move(u)
        before = [None] * len(self.aims) if times is None else times
        times = [aim.times(moved, u, own) for aim, own in zip(self.aims, before)]
        every: list[tuple[Rows, Array, Array]] = []
        for aim, own in zip(self.aims, times):
            frames, rates = aim.looked(moved, own)
            every.append((aim.rows(own, frames, rates, u), frames, rates))
        every += [(rows, *moved.at(rows.times)) for rows in sampled_wishes(model, moved, u, strict)]
        values, slopes = (np.concatenate(part, axis=1) for part in zip(*self._pulled(every, u)))
        more, steep = direct_wishes(model, u, strict, self.lengths)
        values, slopes = np.concatenate([values, more], axis=1), np.concatenate([slopes, steep], axis=1)
        slopes = model.through_ties(X, slopes)
        error = np.sqrt((values**2).sum(axis=1))
        bad = ~moved.complete | ~np.isfinite(slopes).all(axis=(1, 2)) | ~np.isfinite(error)
        values[bad], slopes[bad] = 0.0, 0.0
        return Linearised(np.where(bad, np.inf, error), values, slopes), times

    def exactly(self, x: Array, before: list[Array] | None) -> Exact:
        """Look at one candidate (size,) at exact points of its motion: its samples go to where it is looked at."""
        model = self.model
        u = model.read(x[None])
        moved, step, more = model.move(u), self.model.task.span / len(model.inputs), np.zeros(0)
        times: list[Array | None] = [None] * len(self.aims) if before is None else [*before]
        for k in range(_PASSES):
            if not moved.complete.all():
                return Exact([], np.zeros(0), np.zeros((0, model.size)), None)
            times = [aim.times(moved, u, own) for aim, own in zip(self.aims, times)]
            every = sampled_wishes(model, moved, u, math.inf) + sampled_wishes(model, moved, u, 1.0, soft=True)
            worst = [rows.times.ravel() for rows in every]
            near = [at + step * _AROUND[:, None] / (len(_AROUND) // 2) ** k for at in worst]
            more = np.concatenate([own.ravel() for own in (*times, *near) if own is not None])
            moved = model.move(u, more)
        found = [aim.times(moved, u, own) for aim, own in zip(self.aims, times)]
        seen = [aim.looked(moved, own) for aim, own in zip(self.aims, found)]
        looked = [(aim.rows(own, *at, u), *at) for aim, own, at in zip(self.aims, found, seen)]
        looked += [(rows, *moved.at(rows.times)) for rows in sampled_wishes(model, moved, u, 1.0, soft=True)]
        aimed = len(looked)
        looked += [(rows, *moved.at(rows.times)) for rows in sampled_wishes(model, moved, u, math.inf)]
        pulled = [(values[0], model.through_ties(x[None], slopes)[0]) for values, slopes in self._pulled(looked, u)]
        errors = [
            (values.reshape(rows.values.shape[1:]), slopes.reshape(*rows.values.shape[1:], -1))
            for (values, slopes), (rows, _, _) in zip(pulled, looked[:aimed])
        ]
        if model.task.soft:
            values, slopes = direct_wishes(model, u, 1.0, self.lengths, soft=True)
            errors += [(values, model.through_ties(x[None], slopes))] if values.size else []
        direct, steep = direct_wishes(model, u, math.inf, self.lengths)
        steep = model.through_ties(x[None], steep)
        bounds = np.concatenate([*(values for values, _ in pulled[aimed:]), direct[0]])
        steep = np.concatenate([*(slopes for _, slopes in pulled[aimed:]), steep[0]])
        good = moved.complete.all() and np.isfinite(steep).all() and all(np.isfinite(J).all() for _, J in errors)
        return Exact(errors, bounds, steep, found if good else None)

    def _pulled(self, every: list[tuple[Rows, Array, Array]], u: Unknowns) -> list[tuple[Array, Array]]:
        """Take loads on the poses back to the unknowns, all targets in one pass."""
        model, sets, scale = self.model, len(u.places), u.stroke[:, None, None, None]
        deep = max(rows.loads.shape[1] for rows, _, _ in every)
        frames = np.concatenate([frames for _, frames, _ in every], axis=1)
        centre = model.centre(u)
        loads = np.zeros((sets, deep, model.links, 3, frames.shape[1]))
        at = np.cumsum([0, *(rows.loads.shape[4] for rows, _, _ in every)])
        for k, (rows, _, _) in enumerate(every):
            loads[:, : rows.loads.shape[1], ..., at[k] : at[k + 1]] = rows.loads
        if centre.any():  # moments about it
            turned = turned_with(frames, centre)
            frames[..., :2] += turned - centre[:, None, None]
            loads[..., 2, :] += np.einsum("sdlan,snla->sdln", loads[..., :2, :], turned[..., ::-1] * [1.0, -1.0])
        frames[..., :2] /= scale
        loads[..., :2, :] *= scale[..., None]
        places = u.places - centre[:, None]
        table = model.plan.design.dimensions(places / scale[:, 0], u.numbers)
        by = pose_gradients(model.base, table, frames, loads).dimensions
        pulled = model.plan.design.pulled(by, places / scale[:, 0], u.numbers)  # (sets, d, n, 2 joints + numbers)
        pulled[..., : 2 * model.joints] /= scale
        slopes = np.zeros((*pulled.shape[:3], model.size))
        wide = 2 * model.joints
        steep = pulled[..., :wide].reshape(*pulled.shape[:3], model.joints, 2)
        if model.plan.pins is not None:
            own, first, _ = model.plan.pins  # its guide turns with its ends, which moves no other link (to first order)
            steep[..., first, :] += steep[..., own, :]
        slopes[..., : 2 * len(model.free)] = steep[..., model.free, :].reshape(*pulled.shape[:3], -1)
        slopes[..., 2 * len(model.free) : model.points_at] = pulled[..., wide + np.array(model.angles, dtype=np.intp)]
        if model.task.linear:  # a longer stroke: a smaller mechanism with stroke 1, seen larger
            inner = np.einsum("sdlan,snla->sdn", loads[..., :2, :], frames[..., :2])
            slopes[..., model.stroke_at] = (
                inner - np.einsum("sdnjk,sjk->sdn", _unpinned(steep, model), places)
            ) / u.stroke[:, None, None]
        found = []
        for k, (rows, _, rates) in enumerate(every):
            J = slopes[:, : rows.loads.shape[1], at[k] : at[k + 1]] + rows.direct
            along = np.einsum("sdlan,snla->sdn", rows.loads, rates)
            if rows.start >= 0:
                J[..., rows.start] += along
            if rows.free:
                unit = along / np.maximum(np.sqrt((along**2).sum(axis=1, keepdims=True)), 1e-300)
                if model.task.drive != "rotation":  # what is nearest to an end of the range cannot slide beyond it
                    part = rows.times / model.task.span
                    unit = unit * ((part > _END) & (part < 1.0 - _END))[:, None]
                J = J - unit[..., None] * (unit[..., None] * J).sum(axis=1, keepdims=True)
            if rows.picks is not None:
                J = rows.picks.of(J)
            if rows.mix is not None:
                J = np.einsum("mn,sdni->sdmi", rows.mix, J)
            J = rows.weight * J.reshape(sets, -1, model.size)
            found.append((rows.weight * rows.values.reshape(sets, -1), J))
        return found


def _unpinned(places: Array, model: Model) -> Array:
    """Return derivatives by the places without that of a cylinder's guide, which follows its ends."""
    if model.plan.pins is None:
        return places
    rest = places.copy()
    rest[..., model.plan.pins[0], :] = 0.0
    return rest
