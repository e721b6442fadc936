"""Errors of candidates with exact derivatives: all targets and bounds in one pass back through the mechanism.

Theory: docs/explanation/embodiment.md, "Many targets at once".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.aims import aims_of
from graphsynth.design.task.model import Model, Rows, Unknowns
from graphsynth.design.task.wishes import direct_wishes, sampled_wishes
from graphsynth.kinematics.engine.gradients import pose_gradients

Array = NDArray[np.float64]


class Linearised(NamedTuple):
    """Root mean square of all numbers (infinite: no motion), numbers (sets, m), derivatives (sets, m, size)."""

    error: Array
    values: Array
    slopes: Array


class TaskProblem:
    """What the candidates of a model shall achieve; ``few``: at so many points of a path, for a first look."""

    def __init__(self, model: Model, few: int = 0) -> None:
        self.model = model
        self.aims = aims_of(model, few)

    def linearise(
        self, X: Array, times: list[Array] | None, strict: float, stress: list[Array] | None = None
    ) -> tuple[Linearised, list[Array]]:
        """Return errors and derivatives of candidates (sets, size), and the times found, from those given if any.

        ``strict``: weight of the bounds; ``stress``: factors (sets, n) of the samples of every target.
        """
        model = self.model
        u = model.read(X)
        moved = model.move(u)
        before = [None] * len(self.aims) if times is None else times
        times = [aim.times(moved, u, own) for aim, own in zip(self.aims, before)]
        every: list[tuple[Rows, Array, Array]] = []
        for aim, own in zip(self.aims, times):
            frames, rates = moved.at(own)
            every.append((aim.rows(own, frames, rates, u), frames, rates))
        if stress is not None:
            every = [
                (rows if rows.mix is not None else rows.stressed(own), frames, rates)
                for own, (rows, frames, rates) in zip(stress, every)
            ]
        every += [(rows, *moved.at(rows.times)) for rows in sampled_wishes(model, moved, u, strict)]
        values, slopes = self._pulled(every, u)
        more, steep = direct_wishes(model, u, strict)
        values, slopes = np.concatenate([values, more], axis=1), np.concatenate([slopes, steep], axis=1)
        error = np.sqrt((values**2).sum(axis=1))
        bad = ~moved.complete | ~np.isfinite(slopes).all(axis=(1, 2)) | ~np.isfinite(error)
        values[bad], slopes[bad] = 0.0, 0.0
        return Linearised(np.where(bad, np.inf, error), values, slopes), times

    def sizes(self, X: Array, times: list[Array]) -> list[Array]:
        """Return errors (sets, n) of the samples of every target at its times."""
        u = self.model.read(X)
        moved = self.model.move(u)
        return [aim.rows(own, *moved.at(own), u).sizes for aim, own in zip(self.aims, times)]

    def _pulled(self, every: list[tuple[Rows, Array, Array]], u: Unknowns) -> tuple[Array, Array]:
        """Take loads on the poses back to the unknowns, all targets in one pass."""
        model, sets, scale = self.model, len(u.places), u.stroke[:, None, None, None]
        deep = max(rows.loads.shape[1] for rows, _, _ in every)
        frames = np.concatenate([frames for _, frames, _ in every], axis=1)
        frames[..., :2] /= scale
        loads = np.zeros((sets, deep, model.links, 3, frames.shape[1]))
        at = np.cumsum([0, *(rows.loads.shape[4] for rows, _, _ in every)])
        for k, (rows, _, _) in enumerate(every):
            loads[:, : rows.loads.shape[1], ..., at[k] : at[k + 1]] = rows.loads
        loads[..., :2, :] *= scale[..., None]
        table = model.plan.design.dimensions(u.places / scale[:, 0], u.numbers)
        by = pose_gradients(model.base, table, frames, loads).dimensions
        pulled = model.plan.design.pulled(by, u.places / scale[:, 0], u.numbers)  # (sets, d, n, 2 joints + numbers)
        pulled[..., : 2 * model.joints] /= scale
        slopes = np.zeros((*pulled.shape[:3], model.size))
        wide = 2 * model.joints
        places = pulled[..., :wide].reshape(*pulled.shape[:3], model.joints, 2)
        if model.plan.pins is not None:
            own, first, _ = model.plan.pins  # its guide turns with its ends, which moves no other link (to first order)
            places[..., first, :] += places[..., own, :]
        slopes[..., : 2 * len(model.free)] = places[..., model.free, :].reshape(*pulled.shape[:3], -1)
        slopes[..., 2 * len(model.free) : model.points_at] = pulled[..., wide + np.array(model.angles, dtype=np.intp)]
        if model.task.linear:  # a longer stroke: a smaller mechanism with stroke 1, seen larger
            inner = np.einsum("sdlan,snla->sdn", loads[..., :2, :], frames[..., :2])
            slopes[..., model.stroke_at] = (
                inner - np.einsum("sdnjk,sjk->sdn", _unpinned(places, model), u.places)
            ) / u.stroke[:, None, None]
        found, slope = [], []
        for k, (rows, _, rates) in enumerate(every):
            J = slopes[:, : rows.loads.shape[1], at[k] : at[k + 1]] + rows.direct
            along = np.einsum("sdlan,snla->sdn", rows.loads, rates)
            if rows.start >= 0:
                J[..., rows.start] += along
            if rows.free:
                unit = along / np.maximum(np.sqrt((along**2).sum(axis=1, keepdims=True)), 1e-300)
                J = J - unit[..., None] * (unit[..., None] * J).sum(axis=1, keepdims=True)
            if rows.mix is not None:
                J = np.einsum("mn,sdni->sdmi", rows.mix, J)
            found.append(rows.weight * rows.values.reshape(sets, -1))
            slope.append(rows.weight * J.reshape(sets, -1, model.size))
        return np.concatenate(found, axis=1), np.concatenate(slope, axis=1)


def _unpinned(places: Array, model: Model) -> Array:
    """Return derivatives by the places without that of a cylinder's guide, which follows its ends."""
    if model.plan.pins is None:
        return places
    rest = places.copy()
    rest[..., model.plan.pins[0], :] = 0.0
    return rest
