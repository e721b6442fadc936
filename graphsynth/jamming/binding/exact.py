"""The same energy with every loop closed exactly in space, finite tilts: an independent check of the small-tilt model.

The closure of `graphsynth.jamming.space` is linearised at the displacements found so far, turns and other free
coordinates are eliminated, and what is left is the program of `graphsynth.jamming.binding.energy`; at its fixed point
the loops close.  Springs act in the chart of the tilts, ``2 tan(t/2)``, which is t to 1e-3 for 0.1 rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.binding.energy import least_energy
from graphsynth.jamming.binding.parts import JointStiffness
from graphsynth.jamming.joints.limits import JointLimits
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.plane import in_space, start

if TYPE_CHECKING:
    from graphsynth.jamming.joints.limits import Limits
    from graphsynth.jamming.joints.program import JointProblem

Array = NDArray[np.float64]
_ROUNDS = 60
_RANK = 1e-9
#: Stands for a limit of zero, which would have no unknown that a spring could move.
_NONE = 1e-12


class ExactBinding(NamedTuple):
    """Energies (J) and elastic torques (N m or N) at some samples; largest error of the closure left."""

    energy: Array
    torque: Array
    missed: float


def exact_binding(given: JointProblem, springs: Sequence[JointStiffness], poses: Array, unit: float) -> ExactBinding:
    """Solve at plane poses (N, links, 3), links rigid; NaN where the iteration does not come to rest."""
    limits = tuple(_movable(own, spring) for own, spring in zip(given.limits, springs))
    model = in_space(replace(given, limits=limits))
    closure = Closure(model, False)
    found = [_solved(closure, start(model, given.mechanism, pose), springs, unit * model.unit) for pose in poses]
    driver = given.mechanism.drivers[0]
    joint = given.mechanism.joint(*driver.pair)
    sense = 1.0 if joint.a == driver.base else -1.0
    size = unit * model.unit if model.joints[given.mechanism.joints.index(joint)].guide else 1.0
    energy, slope, missed = (np.array(part) for part in zip(*found))
    return ExactBinding(energy, sense * slope / size, float(np.nanmax(missed, initial=0.0)))


def _movable(own: Limits, spring: JointStiffness) -> Limits:
    """Limits of zero that a spring gives way beyond, as small ones."""
    names = [name for name in own.tilts if math.isfinite(spring.tilt)]
    names += ["axial_clearance"] if math.isfinite(spring.axial) else []
    changed = {name: _NONE for name in names if getattr(own, name) == 0.0}
    changed |= {"radial_clearance": 0.0} if isinstance(own, JointLimits) else {}  # takes no part: theory 9
    return replace(own, **changed, **{f"{name}_range": None for name in changed})  # type: ignore[arg-type]


def _solved(closure: Closure, q: Array, springs: Sequence[JointStiffness], unit: float) -> tuple[float, float, float]:
    """Energy, its derivative by the driven coordinate, and the error of the closure at one pose."""
    model, energy = closure.model, math.nan
    for _ in range(_ROUNDS):
        loops = closure.loops(q[None])
        values, J = closure.values(loops)[0], closure.jacobian(loops)[0]
        before, missed = energy, float(np.abs(values).max(initial=0.0))
        q, energy, by = _step(model, q, values, J, springs, unit)
        if not math.isfinite(energy):
            return math.nan, math.nan, math.nan
        if abs(energy - before) <= 1e-11 * energy and missed < 1e-10:
            return energy, float(by @ J[:, model.size]), missed
    return math.nan, math.nan, math.nan


def _step(
    model: SpaceModel, q: Array, values: Array, J: Array, springs: Sequence[JointStiffness], unit: float
) -> tuple[Array, float, Array]:
    """Solve the linearised program: displacements, energy, and multipliers of the closure."""
    bounds = model.bounds
    tied = np.zeros(len(q), dtype=bool)
    for bound in bounds:
        tied[list(bound.columns)] = True
    slack = ~tied & (np.arange(len(q)) < model.size)
    left, sizes, _ = np.linalg.svd(J[:, slack], full_matrices=True)
    null = left[:, int((sizes > _RANK * max(sizes.max(initial=0.0), 1e-300)).sum()) :]
    M = np.zeros((len(bounds), 2, null.shape[1]))
    soft = np.zeros(len(bounds))
    for k, bound in enumerate(bounds):
        M[k, : len(bound.columns)] = J[:, list(bound.columns)].T @ null
        spring = springs[bound.joint]
        soft[k] = 1.0 / (spring.axial * unit**2 if bound.kind == "play" else spring.tilt)
    W = (values - J[:, tied] @ q[tied]) @ null
    K = np.einsum("biu,b,biv->uv", M, soft, M)
    least = least_energy(M[None], np.array([b.chart(1.0) for b in bounds]), W[None], K[None])
    y = least.y[0]
    found = q.copy()
    moved = -(least.g[0] + soft[:, None] * (M @ y))
    for k, bound in enumerate(bounds):
        found[list(bound.columns)] = moved[k, : len(bound.columns)]
    rest = values + J[:, tied] @ (found - q)[tied]
    found[slack] = q[slack] - np.linalg.lstsq(J[:, slack], rest, rcond=_RANK)[0]
    return found, float(least.energy[0]), null @ y
