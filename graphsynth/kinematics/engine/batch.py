"""One mechanism with many dimension sets over the same inputs.

Beside it: batches of single RRR dyads, the joint C from the points A and B.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, link_number
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.follow import Trace, Tracker, run_program, workspace
from graphsynth.kinematics.engine.inputs import monotonic, warn_of_degrees
from graphsynth.kinematics.engine.program import Program, compile_program
from graphsynth.kinematics.engine.start import initial, lines_of_centres, sign_table, started, with_turns
from graphsynth.mechanism.joints import COLUMNS, Gear
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

_REASONS = {
    codes.DONE: "",
    codes.UNREACHABLE: "cannot be assembled",
    codes.STEP_TOO_LONG: "moves too far in one step to be sure of its branch; give finer inputs or use simulate",
    codes.NO_CONVERGENCE: "does not converge; give finer inputs or a better start",
    codes.SINGULAR: "is singular",
    codes.BAD_INPUT: "has no driver value",
}


@dataclass(frozen=True, eq=False)
class BatchMotion:
    """Branches of many dimension sets over `inputs` (n,), estimated: floating point; NaN where a branch does not reach.

    `frames` (sets, n, len(links), 4): ``(x, y, cos theta, sin theta)`` of the `links` kept; `velocities` and
    `accelerations` (sets, n, len(links), 3): derivatives of ``(x, y, theta)`` by the input, empty if not asked for;
    `margins` (sets, n, groups): as in `Motion.margins`; by set `reached`, the number of inputs reached, and why it
    stopped, `code`, and in which `group` (-1 for none); see `reason`.
    """

    inputs: Array
    links: tuple[int, ...]
    frames: Array
    velocities: Array
    accelerations: Array
    margins: Array
    reached: NDArray[np.int64]
    code: NDArray[np.int64]
    group: NDArray[np.int64]

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """True where a pose exists, shape (sets, n)."""
        return np.asarray(np.arange(len(self.inputs)) < self.reached[:, None])

    @property
    def completed(self) -> NDArray[np.bool_]:
        """True for sets that reached every input.

        Gaps narrower than a step, and pins passing the pivot of their slot, are not looked for: confirm by `simulate`.
        """
        return np.asarray(self.reached == len(self.inputs))

    @property
    def poses(self) -> Array:
        """``(x, y, theta)`` of the links kept, theta in (-pi, pi], shape (sets, n, len(links), 3)."""
        angle = np.arctan2(self.frames[..., 3], self.frames[..., 2])
        return np.concatenate([self.frames[..., :2], angle[..., None]], axis=-1)

    def point(self, link: int, local: ArrayLike) -> Array:
        """Positions of a point (x, y) of a link that was kept, shape (sets, n, 2); ``local`` may differ by set."""
        at = finite_array("local", local)
        px, py = at[..., 0:1], at[..., 1:2]
        if link not in self.links:
            raise GeometryError(f"link {link} was not kept; the links kept are {', '.join(map(str, self.links))}")
        x, y, c, s = (self.frames[:, :, self.links.index(link), k] for k in range(4))
        return np.stack([x + c * px - s * py, y + s * px + c * py], axis=-1)

    def reason(self, index: int) -> str:
        """Why a set stopped, in one sentence; empty if it did not."""
        if self.code[index] == codes.DONE:
            return ""
        at = self.inputs[self.reached[index]]
        who = f"group {self.group[index]}" if self.group[index] >= 0 else "a driven link"
        return f"{who} {_REASONS[int(self.code[index])]} (at the input {at:.12g})"


def simulate_batch(
    mechanism: Mechanism,
    inputs: ArrayLike,
    dimensions: ArrayLike,
    *,
    modes: Mapping[int, int] | None = None,
    start: ArrayLike | None = None,
    rates: bool = True,
    keep: Sequence[int] | None = None,
) -> BatchMotion:
    """Move many dimension sets of one mechanism over the same inputs.

    Parameters
    ----------
    mechanism : Mechanism
        Gives graph, joint kinds, drivers and laws.
    inputs : array_like, shape (n,)
        Strictly increasing or decreasing.
    dimensions : array_like, shape (sets, joints, 10)
        In the form of ``mechanism.dimensions``.
    modes : mapping of int to int, optional
        As for `simulate`, the same for every set.
    start : array_like, shape (links, 3) or (sets, links, 3), optional
        Poses close to the branch at the first input; ``mechanism.pose`` by default.  The first of them gives the modes
        of dyads that ``modes`` leaves open.
    rates : bool, optional
        Also velocities and accelerations.  They are computed anyway if a group needs Newton.
    keep : sequence of int, optional
        Links whose motion is wanted; all by default.  What is not asked for is neither stored nor, where possible,
        computed.

    Returns
    -------
    BatchMotion
        Without step refinement and events: a set whose step is too long to be sure of the branch stops and says so.

    Raises
    ------
    GeometryError
        Shapes that do not fit, numbers that are not finite, impossible lengths and radii, modes that do not exist.

    Examples
    --------
    >>> base = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    >>> sets = np.repeat(base.dimensions[None], 3, axis=0)
    >>> sets[:, 1, 0] = [2.0, 2.6, 9.0]  # x of joint 0-3 on the frame
    >>> simulate_batch(base, np.linspace(0.0, 6.28, 91), sets).completed.tolist()
    [True, True, False]
    """
    u = monotonic(inputs)
    if not isinstance(mechanism, Mechanism):
        raise GeometryError(f"{type(mechanism).__name__} is not a Mechanism; give one")
    sizes = np.ascontiguousarray(finite_array("dimensions", dimensions))
    if sizes.ndim != 3 or sizes.shape[1:] != mechanism.dimensions.shape:
        raise GeometryError(
            f"dimensions have shape {sizes.shape}; give (sets, {', '.join(map(str, mechanism.dimensions.shape))})"
        )
    warn_of_degrees(mechanism, u)
    _check_gears(mechanism, sizes)
    program = compile_program(mechanism, sizes)
    signs = sign_table(program, modes or {})
    poses, found = _starts(program, signs, float(u[0]), modes or {}, start)
    centres = np.zeros((len(sizes), max(1, len(program.gears))))
    if len(sizes) and (start is not None or mechanism.pose is not None):
        signs = started(_one_set(program, 0), float(u[0]), modes or {}, poses[0]).modes
        program = with_turns(program, poses, Tracker(program, signs).values(u[:1])[:, 0, 0])
        centres = lines_of_centres(program, poses)
    count = mechanism.graph.links
    kept = list(range(count)) if keep is None else [link_number("link in keep", link) for link in keep]
    if max(kept, default=0) >= count:
        raise GeometryError(f"keep names link {max(kept)}, but the links are 0..{count - 1}")
    return _run(program, signs, u, poses, centres, found, rates, kept)


def _check_gears(mechanism: Mechanism, sizes: Array) -> None:
    """Radii of gears are positive, of internal pairs different: what a single mechanism checks when it is made."""
    for k, joint in enumerate(mechanism.joints):
        if not isinstance(joint, Gear):
            continue
        radii = sizes[:, k][:, [COLUMNS.index("radius_a"), COLUMNS.index("radius_b")]]
        bad = np.flatnonzero(~(radii > 0.0).all(axis=1) | (joint.internal & (radii[:, 0] == radii[:, 1])))
        if bad.size:
            a, b = radii[bad[0]].tolist()
            raise GeometryError(
                f"set {bad[0]} has the radii {a:.6g} and {b:.6g} at gear {joint.a}-{joint.b}; give positive radii"
                + (" that differ" if joint.internal else "")
            )
        if (sizes[:, k, COLUMNS.index("sign")] != (-1.0 if joint.internal else 1.0)).any():
            raise GeometryError(f"gear {joint.a}-{joint.b} is of another sign in a set; use a mechanism of its own")


def _starts(
    program: Program, signs: Array, u0: float, modes: Mapping[int, int], start: ArrayLike | None
) -> tuple[Array, NDArray[np.bool_]]:
    """Start poses by set, and whether they were found."""
    sets, links = len(program.tables.row_table), program.mechanism.graph.links
    poses, found = np.zeros((sets, links, 3)), np.ones(sets, dtype=np.bool_)
    given = start if start is not None else program.mechanism.pose
    if given is not None:
        values = finite_array("start", given)
        if values.shape not in ((links, 3), (sets, links, 3)):
            raise GeometryError(f"start has shape {values.shape}; give ({links}, 3) or ({sets}, {links}, 3)")
        poses[:] = values
    elif any(step.iterative for step in program.steps):
        for b in range(sets):
            poses[b], code, _ = initial(Tracker(_one_set(program, b), signs), u0, modes, None)
            found[b] = code == codes.DONE
    return poses, found


def _one_set(program: Program, b: int) -> Program:
    names = ("row_table", "eliminated_table", "drive_table")
    own = {name: getattr(program.tables, name)[b : b + 1] for name in names}
    return replace(program, tables=program.tables._replace(**own))


def _run(
    program: Program,
    signs: Array,
    u: Array,
    poses: Array,
    centres: Array,
    found: NDArray[np.bool_],
    rates: bool,
    kept: list[int],
) -> BatchMotion:
    sets, n = len(poses), len(u)
    frame = program.mechanism.frame
    poses[:, frame] = 0.0
    needed = rates or any(step.iterative for step in program.steps)
    groups = np.array([k for k, step in enumerate(program.steps) if step.group >= 0], dtype=np.int64)
    # eliminated links are placed if they are kept or carry something else
    wanted = np.zeros(program.mechanism.graph.links, dtype=np.bool_)
    wanted[kept] = wanted[program.tables.touched] = wanted[program.tables.eliminated[:, 2:4].ravel()] = True
    width = n if rates else 0
    links = kept or [frame]  # the kernel delivers margins with links only
    out = codes.Delivery(
        poses,
        centres,
        np.array(links, dtype=np.int64),
        groups,
        np.empty((sets, len(links), 4, n)),
        np.empty((sets, len(links), 3, width)),
        np.empty((sets, len(links), 3, width)),
        np.empty((sets, len(groups), n)),
    )
    trace = Trace(u, Tracker(program, signs).values(u), workspace(program, n, needed))
    done, why = run_program(program, signs, trace, 0, needed, wanted, out)
    done[~found], why[~found, 0] = 0, codes.UNREACHABLE
    for array in (out.frames, out.velocities, out.accelerations, out.margins):
        array[~found] = np.nan
    group = np.array([step.group for step in program.steps] + [-1], dtype=np.int64)[why[:, 1]]
    frames, V, W = (
        np.moveaxis(array, -1, 1)[:, :, : len(kept)] for array in (out.frames, out.velocities, out.accelerations)
    )
    M = np.moveaxis(out.margins, -1, 1)
    return BatchMotion(u, tuple(kept), frames, V, W, M, done, why[:, 0], group)


def solve_rrr(A: ArrayLike, B: ArrayLike, l1: ArrayLike, l2: ArrayLike, sign: int = 1) -> tuple[Array, Array]:
    """Joint C of RRR dyads with ``|AC| = l1`` and ``|BC| = l2``; closed form, compiled.

    `A`, `B` (n, 2): outer joints; `l1`, `l2`: positive lengths, one or n; `sign`: +1 puts C left of the way from A to
    B, -1 right.  Returns C (n, 2), NaN where the circles do not meet, and the square of the sine of the transmission
    angle (n,), negative there.  `GeometryError` for other signs, lengths and shapes.

    Examples
    --------
    >>> C, margin = solve_rrr([[0.0, 0.0]], [[5.0, 0.0]], 3.0, 4.0)
    >>> C.round(12).tolist(), margin.round(12).tolist()
    ([[1.8, 2.4]], [1.0])
    """
    from graphsynth.kinematics.engine.kernels.loops import rrr

    if sign not in (1, -1):
        raise GeometryError(f"sign = {sign!r} must be +1 or -1")
    first, second = (np.ascontiguousarray(finite_array(name, points)) for name, points in (("A", A), ("B", B)))
    if first.ndim != 2 or first.shape[1] != 2 or first.shape != second.shape:
        raise GeometryError(f"A and B have shapes {first.shape} and {second.shape}; give (n, 2) twice")
    lengths = []
    for name, given in (("l1", l1), ("l2", l2)):
        values = finite_array(name, given)
        if values.shape not in ((), (1,), (len(first),)) or not (values > 0.0).all():
            raise GeometryError(f"{name} must be one positive length or one for each of the {len(first)} dyads")
        lengths.append(np.ascontiguousarray(np.atleast_1d(values)))
    C, margin = np.empty_like(first), np.empty(len(first))
    rrr(first, second, lengths[0], lengths[1], float(sign), C, margin)
    return C, margin
