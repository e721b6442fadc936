"""Where a branch starts: assembly modes of the groups at one input, and all those of a mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.follow import Trace, Tracker
from graphsynth.kinematics.engine.inputs import input_of
from graphsynth.kinematics.engine.program import Program, compile_program
from graphsynth.kinematics.engine.triads import conditions, triad_modes
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

_STARTS = 200


def sign_table(program: Program, modes: Mapping[int, int]) -> Array:
    """Mode signs by step; +1 unless given.

    `GeometryError` for a group that does not exist, or a mode that is not +1 or -1 (a rank for larger groups).
    """
    signs = np.ones(len(program.steps))
    if not isinstance(modes, Mapping):
        raise GeometryError(f"modes = {modes!r} is not a mapping; give the mode by group, as in {{0: 1}}")
    by_group = {step.group: k for k, step in enumerate(program.steps) if step.group >= 0}
    for group, mode in modes.items():
        if group not in by_group:
            raise GeometryError(f"modes names group {group}, but the groups are 0..{len(by_group) - 1}")
        step = program.steps[by_group[group]]
        if isinstance(mode, bool | np.bool_) or not isinstance(mode, int | np.integer):
            raise GeometryError(f"mode {mode!r} of group {group} is not an integer")
        if step.has_two_modes and mode not in (1, -1):
            raise GeometryError(f"mode {mode} of group {group} ({step.kind}) must be +1 or -1")
        if step.iterative and mode < 0:
            raise GeometryError(f"mode {mode} of group {group} ({step.kind}) is a rank among its modes: 0 or more")
        if step.has_two_modes:
            signs[by_group[group]] = mode
    return signs


def started(program: Program, u0: float, modes: Mapping[int, int], guess: Array | None) -> Tracker:
    """Return a tracker on the modes given, or those of the pose ``guess`` (links, 3), whose turns it counts on."""
    signs = sign_table(program, modes)
    tracker = Tracker(program, signs)
    if guess is None:
        return tracker
    program = with_turns(program, guess[None], tracker.values(np.array([u0]))[:, 0, 0])
    tracker = Tracker(program, signs, lines_of_centres(program, guess[None])[0], guess[:, 2])
    # the sign of every dyad left open brings its links closest to the guess
    trace = tracker.blank(np.array([u0]))
    for k, step in enumerate(program.steps):
        if not step.has_two_modes or step.group in modes:
            continue
        errors = []
        for sign in (1.0, -1.0):
            tracker.modes[k] = sign
            tracker.seed(trace, guess)
            done, _, where = tracker.run(trace, 0)
            if done == 0 and where <= k:
                errors.append(math.inf)
                continue
            own = list(step.links)
            X, pose = trace.X[0, own], guess[own]
            turned = (X[:, 2] - np.cos(pose[:, 2])) ** 2 + (X[:, 3] - np.sin(pose[:, 2])) ** 2
            apart = ((X[:, :2] - pose[:, :2]) ** 2).sum(axis=1) / program.Lc**2
            errors.append(float((turned + apart).sum()))
        tracker.modes[k] = 1.0 if errors[0] <= errors[1] else -1.0
    return tracker


def lines_of_centres(program: Program, poses: Array) -> Array:
    """Directions of the lines of centres of all gear pairs at poses (sets, links, 3), shape (sets, gears) or (sets, 1).

    A pose tells them modulo a turn; the turn is that with which the angles of the two wheels fit best.
    """
    phi = np.zeros((len(poses), max(1, len(program.gears))))
    if len(program.gears):
        (lines,) = named("graphsynth.kinematics.engine.kernels.advancing", "lines_of_centres")
        for numbers, pose, own in zip(program.tables.row_table, np.ascontiguousarray(poses), phi, strict=True):
            lines(program.tables.rows, numbers, pose, own)
    return phi


def with_turns(program: Program, poses: Array, q: Array) -> Program:
    """Count the angles of driven links from those of the poses (sets, links, 3), which may differ by whole turns.

    ``q`` (drivers,) are the coordinates of the drivers there.  Only gears need turns.
    """
    if not len(program.gears) or not np.isfinite(q).all():
        return program
    table = program.tables.drive_table.copy()
    for k, (code, base, link, driver) in enumerate(program.tables.drives):
        angle = table[:, k, 7] + (table[:, k, 6] * q[driver] if code == codes.DRIVE_R else 0.0)
        table[:, k, 7] += math.tau * np.round((poses[:, link, 2] - poses[:, base, 2] - angle) / math.tau)
    return replace(program, tables=program.tables._replace(drive_table=table))


def initial(tracker: Tracker, u0: float, modes: Mapping[int, int], guess: Array | None) -> tuple[Array, int, int]:
    """Poses (links, 3) close to the branch at ``u0``; also a code and step where no pose was found.

    Groups solved by Newton start from ``guess`` if there is one, else from the mode of the given rank (0 by default)
    among all modes found; `GeometryError` for a mode that does not exist.
    """
    program = tracker.program
    links = program.mechanism.graph.links
    poses = np.zeros((links, 3)) if guess is None else np.array(guess, dtype=np.float64)
    for k, step in enumerate(program.steps):
        if not step.iterative or (guess is not None and step.group not in modes):
            continue
        trace = tracker.blank(np.array([u0]))
        tracker.seed(trace, poses)
        done, code, where = tracker.run(trace, 0)
        if done == 0 and where < k:
            return poses, code, where
        found = group_modes(tracker, trace, k)
        if found is None:
            return poses, codes.SINGULAR, k
        rank = modes.get(step.group, 0)
        if not len(found):
            return poses, codes.UNREACHABLE, k
        if rank >= len(found):
            raise GeometryError(
                f"mode {rank} of group {step.group} ({step.kind}) does not exist: {len(found)} modes were found"
            )
        poses[list(step.core)] = found[rank]
    return poses, codes.DONE, -1


def group_modes(tracker: Tracker, trace: Trace, k: int) -> Array | None:
    """All assembly modes found of the group of step ``k``, core poses (modes, core links, 3), sorted by angle.

    One kept link held by three distances: the explicit sextic; by distances, lines and directions: the eliminant of
    :mod:`.triads`; all modes in both cases.  Otherwise Newton from many starts (modes may be missing).  None if the
    group has a continuum of poses: special dimensions let it move by itself.
    """
    program = tracker.program
    held = conditions(program, k, trace.X[0])
    if held is None:
        return _searched_modes(tracker, trace, k)
    if any(one.kind != codes.DIST for one in held):
        return triad_modes(held, program.Lc)[:, None, :]
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes

    found = assembly_modes([one.far for one in held], [one.own for one in held], [one.size for one in held])
    return None if found.self_motion else np.asarray(found.poses)[:, None, :]


def _searched_modes(tracker: Tracker, trace: Trace, k: int) -> Array:
    from graphsynth.kinematics.engine.kernels.newton import newton
    from graphsynth.kinematics.engine.kernels.running import make_room

    p, t = tracker.program, tracker.program.tables
    row0, count, core0, cores = (int(v) for v in t.steps[k, 1:5])
    step, group = p.steps[k], codes.Group(t.rows, t.row_table[0], row0, count, t.core, core0, cores)
    random = np.random.default_rng(20190 + k)
    reached = trace.X[0, sorted({link for s in p.steps[:k] for link in s.links} | {p.mechanism.frame}), :2]
    centre, size = reached.mean(axis=0), 2.0 * max(p.Lc, float(np.ptp(reached, axis=0).max()))
    room = make_room.py_func(count, p.mechanism.graph.links, len(trace.PHI[0]), len(p.steps), len(trace.q), 1)
    state, room.phi[:], room.ql[:] = room.x, trace.PHI[0], trace.q[:, :3, 0]
    found: list[Array] = []
    for _ in range(_STARTS * cores):
        state[:, :4], state[:, 4] = trace.X[0], trace.TH[0]
        for link in step.core:
            angle = random.uniform(-np.pi, np.pi)
            where = centre + random.uniform(-size, size, 2)
            state[link, :5] = (*where, np.cos(angle), np.sin(angle), angle)
        code = newton(group, state, room.phi, room.ql, room, p.Lc)
        if code:
            continue
        core = state[list(step.core), :4]
        if all(np.abs((core - other) / [p.Lc, p.Lc, 1.0, 1.0]).max() > 1e-7 for other in found):
            found.append(core)
    poses = [np.column_stack([core[:, 0], core[:, 1], np.arctan2(core[:, 3], core[:, 2])]) for core in found]
    return np.array(sorted(poses, key=lambda pose: tuple(pose[:, 2]))).reshape(-1, cores, 3)


# --- all assembly modes of a mechanism


class AssemblyMode(NamedTuple):
    """One way to assemble a mechanism: the mode of every group, as `simulate` takes them, and the pose (links, 3)."""

    modes: dict[int, int]
    pose: Array

    def __repr__(self) -> str:
        return f"AssemblyMode(modes={self.modes}, pose of {len(self.pose)} links)"


def assembly_modes(mechanism: Mechanism, input: float | str | None = None) -> list[AssemblyMode]:
    """Find all assembly modes of a mechanism at one input.

    Parameters
    ----------
    mechanism : Mechanism
        With as many drivers as its mobility.
    input : float or str, optional
        Input u, or an angle such as "30 deg"; by default that of the mechanism's pose, else 0.

    Returns
    -------
    list of AssemblyMode
        Poses and the modes of all groups: +1 or -1 for dyads, the rank for larger groups.  Empty if there is none.
        Complete for dyads and for triads of binary outer links (closed forms and eliminants, float64); for larger
        groups they are searched for by Newton's method from many starts, and some may be missing: `certify_modes`
        tells whether all are there (revolute joints).

    Raises
    ------
    GeometryError
        Drivers that do not fit the mobility, an input that is no number, a group with a continuum of poses.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> [mode.modes for mode in Mechanism.four_bar(2, 1, 2.5, 2.5).modes("30 deg")]
    [{0: 1}, {0: -1}]
    """
    u = input_of(mechanism, input)
    program = compile_program(mechanism)
    dyads = [step.group for step in program.steps if step.has_two_modes]
    found: list[AssemblyMode] = []
    for signs in product((1, -1), repeat=len(dyads)):
        chosen = dict(zip(dyads, signs))
        tracker = started(program, u, chosen, None)
        trace = tracker.blank(np.array([u]))
        found += _assembled(tracker, trace, np.zeros((mechanism.graph.links, 3)), chosen, 0)
    return found


def _assembled(tracker: Tracker, trace: Trace, poses: Array, chosen: dict[int, int], first: int) -> list[AssemblyMode]:
    """Complete a choice of modes by those of the larger groups from step ``first`` on."""
    steps = tracker.program.steps
    k = next((k for k in range(first, len(steps)) if steps[k].iterative), len(steps))
    tracker.seed(trace, poses)
    done, _, where = tracker.run(trace, 0)
    if k == len(steps):
        pose = np.column_stack([trace.X[0, :, :2], trace.angles(tracker.program, 0)])
        return [AssemblyMode(dict(sorted(chosen.items())), pose)] if done else []
    if not done and where < k:
        return []
    modes = group_modes(tracker, trace, k)
    if modes is None:
        raise GeometryError(f"group {steps[k].group} has a continuum of poses at this input; give another input")
    found: list[AssemblyMode] = []
    for rank, core in enumerate(modes):
        own = poses.copy()
        own[list(steps[k].core)] = core
        found += _assembled(tracker, trace, own, {**chosen, steps[k].group: rank}, k + 1)
    return found
