"""Least tilt T* of every pose, with a lower bound from equilibrium and an upper bound from closure.

Two quantities, of the same program:

* ``"tilt"``: T*, the smallest factor on the tilt limits that lets the mechanism assemble, axial plays as they are;
* ``"scale"``: the smallest factor on tilt limits and plays together.  It is proportional to the misalignment, so its
  inverse is the factor by which all misalignments may grow.  Both pass 1 together.

`problem` puts a mechanism, its limits and its misalignments together for it and for the certificates.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.joints.closure import (
    KINDS,
    Layout,
    Leans,
    force_rows,
    joint_places,
    lay_out,
    leans,
    moment_rows,
    work_row,
)
from graphsynth.jamming.joints.cones import ConeSolution, loads, polish, solve_cones
from graphsynth.jamming.joints.limits import Limits, Misalignment, complete

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Mode = Literal["tilt", "scale"]
_RANK = 1e-11


class Units(NamedTuple):
    """Centre and length that positions are measured in, and the scale of the misalignments."""

    centre: Array
    length: float
    tilt: float


class PoseSolution(NamedTuple):
    """Solutions of N poses.

    ``lower`` and ``upper`` bound T (estimated: rounding only); ``y`` (N, 3 loops) are loop wrenches
    about ``units.centre``, forces times ``units.length``; ``tau`` (N, blocks, 2) radians, ``zeta`` (N, joints) lengths:
    NaN where a joint has no limit; ``moment`` (N, blocks) and ``force`` (N, joints) the shares ``t_b |m_b|`` and
    ``s_j |f_j|`` of the dual over ``sum t |m|``.
    """

    lower: Array
    upper: Array
    y: Array
    tau: Array
    zeta: Array
    moment: Array
    force: Array
    units: Units
    rounds: int


def solve_poses(layout: Layout, r: Array, e: Array, lean: Leans, mode: Mode = "tilt") -> PoseSolution:
    """Solve the program at N poses (theory/joints-that-share-a-tilt 3, 4; loop form); estimated.

    Positions r, guide directions e, misalignments and the points they lean about are (N, joints, 2).  ``lower ==
    upper == inf`` where no factor is enough.  Raises `GeometryError` if a position is not finite.
    """
    d, about = lean
    if not all(np.isfinite(part).all() for part in (r, e, d, about)):
        raise GeometryError("a joint position is not finite; give assembled poses only")
    units, flat = Units(np.zeros(2), 1.0, 1.0), np.concatenate([r, about], axis=1).reshape(-1, 2)
    if flat.size:  # every number of the program is then of the order of 1
        centre = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
        length = float(np.abs(flat - centre).max()) or 1.0
        units = Units(centre, length, float(np.sqrt((d**2).sum(-1)).max(initial=0.0)) or 1.0)
    places, about = ((part - units.centre) / units.length for part in (r, about))
    rows = _Rows(layout, places, e, Leans(d / units.tilt, about), units)
    blocks, joints = len(layout.limit), len(layout.joints)
    shapes = (), (), (3 * layout.loops,), (blocks, 2), (joints,), (blocks,), (joints,)
    out = PoseSolution._make([*(np.zeros((len(r), *shape)) for shape in shapes), units, 0])
    if layout.loops == 0 or len(r) == 0:
        return out
    rounds = 0
    for basis, poses in _allowed(rows):
        rounds = max(rounds, _solve_group(rows, basis, poses, mode, out))
    return out._replace(rounds=rounds)


class _Rows:
    """Rows of moments, forces and work, in units; limits in units of the largest."""

    def __init__(self, layout: Layout, r: Array, e: Array, lean: Leans, units: Units) -> None:
        self.layout = layout
        self.M = moment_rows(layout, r, e)
        self.F = force_rows(layout)
        self.W = work_row(layout, lean)
        limit, play = layout.limit, layout.end_float
        finite = limit[np.isfinite(limit)]
        self.unit = float(finite.max(initial=0.0)) or 1.0
        self.t = limit / self.unit
        self.s = play / (units.length * units.tilt)
        self.factor = units.tilt / self.unit  # T = factor times T of the scaled program in mode "tilt"
        self.units = units
        #: Blocks and forces that cost something.
        self.costly = np.isfinite(self.t) & (self.t > 0.0)
        self.pushed = np.isfinite(self.s) & (self.s > 0.0)


def _allowed(rows: _Rows) -> list[tuple[Array, NDArray[np.intp]]]:
    """Bases of what joints without limit let pass, grouped by their dimension: [(basis (n, k, free), poses (n,))]."""
    count, k = len(rows.M), rows.F.shape[1]
    force = rows.F[np.isinf(rows.s)]
    moments = rows.M[:, np.isinf(rows.t)].reshape(count, -1, k)
    forbidden = np.concatenate([moments, np.broadcast_to(force, (count, *force.shape))], axis=1)
    if forbidden.shape[1] == 0:
        return [(np.broadcast_to(np.eye(k), (count, k, k)), np.arange(count))]
    _, values, right = np.linalg.svd(forbidden, full_matrices=True)
    rank = (values > _RANK * np.maximum(values[:, :1], 1.0)).sum(axis=1)
    return [(right[rank == n, n:].transpose(0, 2, 1), np.flatnonzero(rank == n)) for n in np.unique(rank)]


def _solve_group(rows: _Rows, basis: Array, poses: NDArray[np.intp], mode: Mode, out: PoseSolution) -> int:
    """Solve poses with null spaces of one dimension, again grouped by the rank of what costs anything."""
    if basis.shape[2] == 0:
        _write(rows, poses, np.zeros((len(poses), rows.F.shape[1])), None, mode, out)
        return 0
    M, F, W = _scaled(rows, poses, mode)
    M, F, W = M @ basis[:, None], F @ basis, (W[:, None] @ basis)[:, 0]
    stacked = np.concatenate([M.reshape(len(poses), -1, M.shape[3]), F], axis=1)
    if stacked.shape[1] == 0:
        stacked = np.zeros((len(poses), 1, M.shape[3]))
    _, values, right = np.linalg.svd(stacked, full_matrices=True)
    rank = (values > _RANK).sum(axis=1)
    rounds = 0
    for n in np.unique(rank):
        chosen = np.flatnonzero(rank == n)
        span, idle = right[chosen, :n].transpose(0, 2, 1), right[chosen, n:]
        work = (idle @ W[chosen, :, None])[..., 0]
        lost = np.abs(work).max(axis=1, initial=0.0) > 1e-12
        if lost.any():  # a wrench costs nothing and does work: no factor on the limits is enough
            q = (idle[lost].transpose(0, 2, 1) @ work[lost, :, None])[..., 0]
            never = poses[chosen[lost]]
            out.y[never] = (basis[chosen[lost]] @ q[:, :, None])[..., 0]
            out.lower[never] = out.upper[never] = math.inf
            for part in (out.tau, out.zeta, out.moment, out.force):
                part[never] = np.nan
        chosen, span = chosen[~lost], span[~lost]
        if chosen.size == 0:
            continue
        if n == 0:  # nothing costs anything, and nothing does work
            _write(rows, poses[chosen], np.zeros((len(chosen), rows.F.shape[1])), None, mode, out)
            continue
        parts = M[chosen] @ span[:, None], F[chosen] @ span, (W[chosen, None] @ span)[:, 0]
        rounds = max(rounds, _solve_regular(rows, basis[chosen] @ span, poses[chosen], parts, mode, out))
    return rounds


def _scaled(rows: _Rows, poses: NDArray[np.intp], mode: Mode) -> tuple[Array, Array, Array]:
    """Blocks and forces that cost something, times their limits; in mode "scale" forces are blocks."""
    t, s, costly, pushed = rows.t, rows.s, rows.costly, rows.pushed
    M = rows.M[poses][:, costly] * t[costly, None, None]
    F = np.broadcast_to(rows.F[pushed] * s[pushed, None], (len(poses), int(pushed.sum()), rows.F.shape[1]))
    if mode == "scale":
        # the factor of the units stands between plays, measured by the misalignment, and limits, by the largest
        block = np.zeros((len(poses), F.shape[1], 2, F.shape[2]))
        block[:, :, 0] = F * rows.factor
        M, F = np.concatenate([M, block], axis=1), F[:, :0]
    return M, F, rows.W[poses]


def _solve_regular(
    rows: _Rows, basis: Array, poses: NDArray[np.intp], parts: tuple[Array, Array, Array], mode: Mode, out: PoseSolution
) -> int:
    """Solve poses whose costs bound every wrench."""
    M, F, W = parts
    size = np.sqrt((W**2).sum(axis=1))
    quiet = size <= 1e-300
    unit = np.where(quiet, 1.0, size)
    if M.shape[1] == 0:  # only forces cost: any excess of work over them is beyond every factor
        M = np.zeros((len(W), 1, 2, W.shape[1]))
    F, W = F / unit[:, None, None], W / unit[:, None]
    # the best lower and the best upper bound found so far, each with what proves it
    found = solve_cones(M, F, W)
    q, zeta = found.q.copy(), found.zeta.copy()
    lower, upper, tau = _bounds(M, F, W, found)
    for robust, enough in ((False, 2e-15), (True, 1e-13)):
        with np.errstate(invalid="ignore"):
            left = np.flatnonzero(~(upper - lower <= enough * upper))
        if left.size:
            program = M[left], F[left], W[left]
            part = ConeSolution(found.q[left], found.tau[left], found.zeta[left], found.rounds)
            part = polish(*program, part, robust=robust)
            least, most, own = _bounds(*program, part)
            more, less = least > lower[left], most < upper[left]
            lower[left[more]], q[left[more]] = least[more], part.q[more]
            upper[left[less]], tau[left[less]] = most[less], own[less]
            zeta[left[less]] = np.clip(part.zeta[less], -1.0, 1.0)
    bounds = np.where(quiet, 0.0, np.stack([lower, upper]) * unit) * rows.factor
    y = (basis @ np.where(quiet[:, None], 0.0, q)[:, :, None])[..., 0]
    _write(rows, poses, y, (bounds, tau * unit[:, None, None], zeta), mode, out)
    return found.rounds


@np.errstate(all="ignore")
def _bounds(M: Array, F: Array, W: Array, found: ConeSolution) -> tuple[Array, Array, Array]:
    """Lower bound from q, upper bound from tau after the closure has been restored, and that tau."""
    m, f = loads(M, F, found.q)
    cost = np.hypot(m[..., 0], m[..., 1]).sum(axis=1)
    lower = (np.abs((W * found.q).sum(axis=1)) - np.abs(f).sum(axis=1)) / cost
    zeta = np.clip(found.zeta, -1.0, 1.0)
    flat = M.reshape(len(W), -1, W.shape[1])
    tau = found.tau.reshape(len(W), -1)
    inverse = np.linalg.pinv(flat, rcond=1e-13).transpose(0, 2, 1)
    for again in (True, True, False):
        off = W + (flat.transpose(0, 2, 1) @ tau[:, :, None])[..., 0]
        off = off + (F.transpose(0, 2, 1) @ zeta[:, :, None])[..., 0]
        if again:
            tau = tau - (inverse @ np.where(np.isfinite(off), off, 0.0)[:, :, None])[..., 0]
    closed = np.abs(off).max(axis=1, initial=0.0) <= 1e-12 * (1.0 + np.abs(flat).max(axis=(1, 2), initial=0.0))
    tau = tau.reshape(*M.shape[:3])
    upper = np.where(closed, np.hypot(tau[..., 0], tau[..., 1]).max(axis=1, initial=0.0), np.inf)
    return np.where(np.isnan(lower), 0.0, np.maximum(lower, 0.0)), upper, tau


_Scaled: TypeAlias = tuple[Array, Array, Array] | None


def _write(rows: _Rows, poses: NDArray[np.intp], y: Array, found: _Scaled, mode: Mode, out: PoseSolution) -> None:
    """Write bounds, tilts and slips of the scaled program into ``out``; without them only the wrenches."""
    t, s, costly, pushed = rows.t, rows.s, rows.costly, rows.pushed
    out.tau[np.ix_(poses, np.flatnonzero(np.isinf(t)))] = np.nan
    out.zeta[np.ix_(poses, np.flatnonzero(np.isinf(s)))] = np.nan
    out.y[poses] = y
    if found is None:
        return
    (lower, upper), tau, zeta = found
    out.lower[poses], out.upper[poses] = lower, upper
    tilt, length = rows.units.tilt, rows.units.length
    n = int(costly.sum())
    # the scaled program has tau' = tau / (t times tilt), so tau = tilt t tau'
    out.tau[np.ix_(poses, np.flatnonzero(costly))] = tau[:, :n] * (tilt * t[costly])[:, None]
    where = np.ix_(poses, np.flatnonzero(pushed))
    if mode == "tilt":
        out.zeta[where] = zeta * (s[pushed] * length * tilt)
    else:
        out.zeta[where] = tau[:, n:, 0] * (rows.factor * s[pushed] * length * tilt)
    m = (rows.M[poses] @ y[:, None, :, None])[..., 0]
    moment = np.where(costly, t, 0.0) * np.hypot(m[..., 0], m[..., 1])
    force = np.where(pushed, s, 0.0) * np.abs(y @ rows.F.T)
    cost = moment.sum(axis=1) if mode == "tilt" else moment.sum(axis=1) + rows.factor * force.sum(axis=1)
    with np.errstate(all="ignore"):
        share = np.where(cost > 0.0, 1.0 / cost, 0.0)
    out.moment[poses] = moment * share[:, None]
    out.force[poses] = force * rows.factor * share[:, None]


Bearings: TypeAlias = Bearing | Limits | Mapping[tuple[int, int], Bearing | Limits]


@dataclass(frozen=True, eq=False)
class JointProblem:
    """A mechanism with limits and misalignments; what the solvers and the certificates start from."""

    mechanism: Mechanism
    limits: tuple[Limits, ...]
    misalignments: tuple[Misalignment, ...]
    layout: Layout

    @property
    def names(self) -> tuple[tuple[tuple[int, int], str], ...]:
        """Joint and kind of every limit on tilt."""
        blocks = zip(self.layout.block_joint, self.layout.block_axis)
        return tuple((self.pairs[place], KINDS[axis]) for place, axis in blocks)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Links of every joint of the layout."""
        return tuple(self.mechanism.joints[k].pair for k in self.layout.joints)

    def solve(self, poses: Array, mode: Mode = "tilt", turned: float = 0.0) -> PoseSolution:
        """Solve at poses (N, links, 3); all misalignments turned by ``turned`` radians."""
        at = joint_places(self.mechanism, self.layout.joints, poses)
        return solve_poses(self.layout, at.r, at.e, leans(self.layout, at, turned), mode)


def check_motion(motion: Any) -> None:
    """Refuse anything that is no `Motion`."""
    from graphsynth.kinematics.engine.result import Motion

    if not isinstance(motion, Motion):
        raise GeometryError(f"motion = {motion!r} is no Motion; give the result of simulate(mechanism, inputs)")


def problem(
    mechanism: Mechanism, bearings: Bearings, tilts: Misalignment | Iterable[Misalignment], condition: Condition = "A"
) -> JointProblem:
    """Put a mechanism, limits and misalignments together; see `assess_coupled` for the arguments.

    Raises `GeometryError` for a joint without limits, limits that do not fit a joint, a misalignment of a joint that
    does not exist.
    """
    chosen = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    by_pair: dict[tuple[int, int], Misalignment] = {}
    for tilt in chosen:
        if not isinstance(tilt, Misalignment):
            raise GeometryError(
                f"tilts = {tilt!r} is no misalignment; give Misalignment(base, link, alpha), or several"
            )
        pair = tilt.pair
        mechanism.joint(*pair)  # raises if there is none
        if pair in by_pair:
            raise GeometryError(f"joint {pair[0]}-{pair[1]} has two misalignments; give their sum")
        by_pair[pair] = tilt
    limits = complete(mechanism.joints, bearings, by_pair, condition)
    return JointProblem(mechanism, limits, chosen, lay_out(mechanism, limits, chosen))
