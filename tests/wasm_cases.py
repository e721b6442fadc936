"""Calls of kernels of the page's modules to be compared: recorded from small computations, a few from larger ones.

Small ones are many and differ in what they ask, so that a million of them takes minutes and meets all branches.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from graphsynth.core.compilation import Deferred, Kernel
from graphsynth.core.native import library

from .kernel_calls import duplicate

_KEPT, _MOST = 12, 40
Recorded = dict[str, list[tuple[Any, ...]]]


@contextmanager
def recording(kept: Recorded, *, all_calls: bool = False) -> Iterator[None]:
    """Keep copies of the arguments of calls from Python, by kernel: all, or the first ones and then ever rarer ones."""
    seen: dict[str, int] = {}

    def call(own: Any, *args: Any) -> Any:
        name = own.entry()[0] if own.entry() else f"{own.__module__}.{getattr(own, '__qualname__', '')}"
        count = seen[name] = seen.get(name, 0) + 1
        if all_calls or (len(kept.get(name, [])) < _KEPT and count & (count - 1) == 0):
            kept.setdefault(name, []).append(duplicate(args))
        return library.Native.__call__(own, *args)

    Kernel.__call__ = Deferred.__call__ = call  # type: ignore[attr-defined]
    try:
        yield
    finally:
        del Kernel.__call__, Deferred.__call__  # type: ignore[attr-defined]


def thinned(kept: Recorded) -> Recorded:
    """Keep so many calls of each kernel at most, drawn at random."""
    rng = np.random.default_rng(1)
    return {name: [calls[k] for k in np.sort(rng.permutation(len(calls))[:_MOST])] for name, calls in kept.items()}


def computations(*, many: bool) -> Recorded:
    """Record the calls of computations that use the kernels of all modules."""
    import graphsynth as gs
    from graphsynth.jamming.intersection import circle_ellipse, krawczyk_boxes
    from graphsynth.kinematics.dimensional.sketch import layout
    from graphsynth.mechanism import gallery
    from graphsynth.structure.canonical import _label

    kept: Recorded = {}
    turn = np.linspace(0.0, 2.0 * np.pi, 361 if many else 25)
    crank, slider = gs.Mechanism.four_bar(4.0, 1.2, 3.5, 3.0, coupler_point=(1.8, 1.4)), gs.Mechanism.slider_crank(1, 3)
    with recording(kept, all_calls=True):
        for mechanism in (crank, slider) if many else ():
            for count in (1, 2, 3, 5):
                gs.simulate(mechanism, 0.3 + 0.1 * np.arange(count))
        for links in (4, 6, 8, 10) if many else (6,):
            for chain in list(gs.enumerate_chains(links))[:12]:
                _label(chain, [0] * chain.links, compiled=True)
        for most in (1, 2, 4, 8, 30) if many else (200,):
            for width in ("1e-9", "0.01"):
                krawczyk_boxes(circle_ellipse(5, 6, 4, eps=width), max_boxes=most)
    with recording(kept):
        gs.simulate(crank, turn)
        gs.simulate(slider, turn)
        for name in gallery.__all__ if many else ():
            gs.simulate(getattr(gallery, name)(), turn)
        for links in (4, 6, 8, 10) if many else (6,):
            for chain in list(gs.enumerate_chains(links))[:12]:
                layout(chain)
    relaxed = kept[f"{_SKETCH}.even_out"]
    relaxed += [(*args[:9], steps, *args[10:]) for args in relaxed for steps in ((1, 2, 4) if many else ())]
    with recording(kept, all_calls=True):
        lists(many=many)
    return thinned(kept)


_SKETCH = "graphsynth.kinematics.dimensional.kernels"


def small_room(family: Any, group: int, key_words: int) -> Any:
    """Return a workspace that is laid out for one family of few contracted vertices alone, not for all there are."""
    from graphsynth.synthesis.kernels import layout as lay

    k, tables = family.vertices, family.edge_labels.tables
    classes, sets = min(k * (k - 1) // 2, family.loops + k - 1), 8 + (1 << k)
    most = {
        "MAX_VERTICES": k,
        "MAX_CLASSES": classes,
        "MAX_SETS": sets,
        "MAX_ENTRIES": classes * tables.groups.shape[1],
    }
    most |= {} if tables.rules else {"COVERS": 1}  # not looked at without rules
    before = {name: getattr(lay, name) for name in most}
    try:
        vars(lay).update(most)
        return lay.make_work(tables.resources.shape[1], group, key_words)
    finally:
        vars(lay).update(before)


def lists(*, many: bool) -> None:
    """Count, list and draw chains of up to eight links (ten, if ``many``), a few rows at a time, in small rooms."""
    from graphsynth.synthesis.chunks import expansion_of
    from graphsynth.synthesis.kernels.counting import count_block, decode_fixed, open_fixed
    from graphsynth.synthesis.kernels.expanding import expand_packed
    from graphsynth.synthesis.kernels.layout import HEADER
    from graphsynth.synthesis.kernels.listing import list_rows, rewind
    from graphsynth.synthesis.problem import EnumerationProblem

    asked = [(6, 1, False, None), (7, 2, True, None), (8, 1, False, None), (8, 1, True, None), (8, 1, False, 2)]
    for links, mobility, framed, symmetry in [*asked, *([(10, 1, False, None), (9, 2, True, None)] if many else [])]:
        problem = EnumerationProblem.chains(links, mobility, 3, None, False, symmetry, framed=framed)
        for family in [own for own in problem.families if own.vertices <= 6 and len(own.graphs)]:
            tables, graphs, k, count = family.edge_labels.tables, family.graphs, family.vertices, len(family.graphs)
            for group, key_words in ((80, 128), (80, 16), (2, 128)):  # enough, and too small
                work, pairs = small_room(family, group, key_words), np.zeros((40, 5), np.int64)
                block = k, graphs, 0, count, family.frames, family.frame_degree, tables, work
                count_block(*block, np.zeros(count, np.int64), pairs[:0])
                count_block(*block, np.zeros(count, np.int64), pairs)
                rewind(0, 0, 1, work)
                for most in (3, 1, 8, 60, 60):
                    rows = np.zeros((most, HEADER + family.loops + k), np.int32)
                    wanted = (k, graphs, count, family.frames, family.frame_degree, symmetry or 0, tables, work)
                    if (found := list_rows(*wanted, rows)) <= 0:
                        break
                    out = np.zeros((found, 3 * family.joints), np.uint8)
                    expand_packed(k, family.links, graphs, rows, found, expansion_of(family.edge_labels, ()), out)
            work = small_room(family, 80, 16)
            for graph in graphs[:4]:
                *laid, ways = open_fixed(k, graph, 1, 0, 0, tables, work)
                for number in {0, ways // 2, ways - 1} if ways else ():
                    decode_fixed(*laid, number, tables, work, np.zeros(HEADER + family.loops + k, np.int32))


#: Kernels of the page's engine alone; natively they are compiled when a test asks for them.
PAGE = ("engine.kernels.planning.", "engine.kernels.advancing.", "engine.kernels.dragging.", "jamming.joints.kernels.",
        "design.poses.kernels.", "certify.kernels.")  # fmt: skip


def _open_chain(links: int) -> tuple[Any, np.ndarray]:
    """Return bars in a row, every joint driven, with a pose."""
    from graphsynth import Mechanism, MechanismGraph
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.laws import Driver

    pairs, turn = [(k, k + 1) for k in range(links - 1)], np.array([0.0, 0.7, 1.2])
    joints = [Revolute(a, b, (0.1 + a, 0.2), (0.0, 0.0)) for a, b in pairs]
    pose = np.zeros((links, 3))
    for a, b in pairs:
        c, s = np.cos(turn[a]), np.sin(turn[a])
        pose[b] = *(pose[a, :2] + np.array([[c, -s], [s, c]]) @ (0.1 + a, 0.2)), turn[b]
    return Mechanism(MechanismGraph(links, pairs, frame=0), joints, [Driver(*pair) for pair in pairs]), pose


def page_computations() -> Recorded:
    """Record the calls with which the page moves mechanisms: planned, settled, followed, swept and pulled."""
    import graphsynth as gs
    from graphsynth.kinematics.engine.program import compile_program
    from graphsynth.mechanism import gallery

    kept: Recorded = {}
    crank, rocker = gs.Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), gs.Mechanism.four_bar(4.0, 3.0, 2.0, 2.5)
    closed = [(own, gs.simulate(own, [0.7]).poses[0]) for own in (crank, rocker, gs.Mechanism.slider_crank(1.0, 3.0))]
    for mechanism, pose in [_open_chain(2), _open_chain(3), *closed]:
        with recording(kept, all_calls=True):
            _moved(mechanism, pose)
            _pulled(mechanism, pose)
            _proved(mechanism, pose)
    with recording(kept, all_calls=True):
        for name in gallery.__all__:
            compile_program(getattr(gallery, name)())
    for mechanism, pose in closed:
        with recording(kept, all_calls=True):
            _tilted(mechanism, np.ascontiguousarray(pose[None]))
            _walked(mechanism)
    with recording(kept, all_calls=True):
        _through_poses()
    return thinned(kept)


def _moved(mechanism: Any, pose: np.ndarray) -> None:
    """Follow a mechanism over short ways, and one long one."""
    from graphsynth.kinematics.engine import codes, outlines
    from graphsynth.kinematics.engine.kernels import advancing, planning
    from graphsynth.kinematics.engine.program import compile_program, drawn

    links, sizes, drivers = mechanism.graph.links, mechanism.dimensions[None], len(mechanism.drivers)
    tables = compile_program(mechanism).tables
    given, q, one = drawn(mechanism.joints, sizes, mechanism.drivers), np.zeros(drivers), np.ones(drivers)
    length = planning.sizes_of(given, links)
    steps, n = len(tables.steps), advancing.SAMPLES
    shapes = ((links, 4, n), (links, n), (links, 3, n), (links, 3, n), (1, n), (steps, n))
    state, modes, found = codes.State(*map(np.zeros, shapes)), np.ones(steps), np.zeros(5)
    advancing.driver_coordinates(given, pose, q)
    advancing.settle(tables, modes, state, q, one, pose, length)
    for way in (0.02, -0.05, 0.15, 0.3):
        advancing.advance(tables, modes, state, q, q + way, one, length, found[:3].copy())
        q = q + way
    watched = np.array([[links - 1.0, 0.0, 0.0]])
    for count, way in ((1, 0.0), (2, 0.03), (2, -0.05), (3, 0.1), (3, -0.02), (9, 1.6)):
        rows = [np.zeros((count, links, 3)) for _ in range(3)]
        out = outlines.Samples(*rows, np.zeros((count, steps)), np.zeros((4, 2)))
        own = codes.State(*(part.copy() for part in state))
        advancing.sweep(tables, modes, own, q, q + way, 1.0, watched, out, length, found)
        for x, y in ((0.0, 0.0), (0.3, -0.2)):
            advancing.point_motion(*out[:3], links - 1, x, y, np.zeros((count, 6)))
    advancing.instant_centres(state.X, state.V, np.zeros((links, links, 2)))


def _pulled(mechanism: Any, pose: np.ndarray) -> None:
    """Pull a point a little, not at all, backwards, far, and where nothing moves or closes."""
    from graphsynth.kinematics.engine.kernels import dragging
    from graphsynth.kinematics.engine.program import equations
    from graphsynth.mechanism.constraints import characteristic_length

    links, at = len(pose), np.array([0.3, 0.2])
    rows, table = equations(mechanism.joints, mechanism.dimensions[None])
    scale = float(characteristic_length(mechanism))
    moved = (np.arange(links) > 0)[:, None]
    for off in (1e-3, 1e-12):
        dragging.closed_pose(rows, table[0], 0, pose + off * moved, scale)
    near, way, found = pose.copy(), np.zeros(3 * links - 3), np.zeros(3)
    for link, x, y in (
        (-1, 1e-3, 2e-3),
        (-1, 0.0, 0.0),
        (-1, -0.01, 0.02),
        (1, 0.02, -0.01),
        (0, 0.1, 0.1),
        (-1, 2, 1),
    ):
        own = link % links
        c, s = np.cos(near[own, 2]), np.sin(near[own, 2])
        target = near[own, :2] + np.array([[c, -s], [s, c]]) @ at + (x, y)
        dragging.drag(rows, table[0], 0, near, own, at, target, way, scale, found)
    dragging.drag(rows, table[0], 0, pose + 0.1 * moved, 1, at, np.ones(2), way, scale, found)


def _proved(mechanism: Any, pose: np.ndarray) -> None:
    """Prove a motion: the first node, a box or two, to a near goal, back, more boxes, and what cannot be proved."""
    from graphsynth.kinematics.certify.kernels import marching
    from graphsynth.kinematics.engine.program import equations

    rows, (table,) = equations(mechanism.joints, mechanism.dimensions[None], mechanism.drivers)
    inputs = np.diff(pose[:, 2])[: len(mechanism.drivers)].copy()
    turns, start, frame = np.zeros(len(rows)), inputs[0], mechanism.frame

    def march(rows: np.ndarray, box: np.ndarray, state: np.ndarray, goal: float, limit: int) -> None:
        marching.march(rows, table, frame, inputs, 0, goal, 2.0, turns, box, state, limit)

    def fresh(step: float) -> tuple[np.ndarray, np.ndarray]:
        return np.stack([pose, *np.zeros((3, *pose.shape))]), np.array([start, step, 0.0, 0.0])

    box, state = fresh(0.05)
    for limit in (0, 1, 2):
        march(rows, box, state, start + 2.0 * np.pi, limit)
        if limit == 0:
            first = box.copy()
            marching.closes(rows, table, frame, 0, first, start, first + 0.0, start, 0)
            march(rows, first.copy(), state.copy(), start + 0.01, 3)
            march(rows, first.copy(), state * (1.0, -1.0, 1.0, 1.0), start - 0.02, 3)
    for rounds in (0, 1):
        end = box.copy()
        end[0, :, 2] += 2.0 * np.pi * rounds * (np.arange(len(pose)) > 0)
        marching.closes(rows, table, frame, 0, first, start, end, state[0], rounds)
        end[:] = first
        end[0, :, 2] += 2.0 * np.pi * rounds * (np.arange(len(pose)) > 0)
        marching.closes(rows, table, frame, 0, first, start, end, start + 2.0 * np.pi * rounds, rounds)
    march(rows, box, state, start + 2.0 * np.pi, 8)
    march(rows, *fresh(0.4), start + 1.0, 1)
    box, state = fresh(0.05)
    box[0, -1] += 0.01
    march(rows, box, state, start + 1.0, 1)
    march(np.full_like(rows, 99), *fresh(0.05), start + 1.0, 1)


def _walked(mechanism: Any) -> None:
    """Prove where a misaligned axis binds: free, on the verge and bound."""
    from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits
    from graphsynth.jamming.joints.kernels import walking
    from graphsynth.jamming.joints.program import problem
    from graphsynth.jamming.joints.walked import Walk

    motion = mechanism.simulate(np.linspace(0.7, 1.2, 5), events=False)
    limits = {
        own.pair: JointLimits(0.01, 0.001) if own.kind == "R" else SlideLimits(0.01, 0.02, 0.001)
        for own in mechanism.joints
    }
    for alpha in (0.004, 0.026, 0.2):
        walk = Walk(problem(mechanism, limits, Misalignment(0, 1, alpha, 0.3)), motion, 1e-3, 10)
        asked = walk.asked  # with room on both sides, so that numbers that change remain in order
        asked = asked._replace(low=0.9 * asked.limits, high=1.1 * asked.limits)
        asked.tilts[:, 1::2] += 1e-6 * np.abs(asked.tilts[:, 1::2])
        for limit in (0, 1, 2, 9):
            walking.walk(
                walk.task, asked, walk.goal, walk.length, walk.box, walk.state, limit, walk.widths, walk._found
            )


def _through_poses() -> None:
    """Find dyads of two to five poses."""
    from graphsynth.design.poses.kernels import candidates, cranks

    random = np.random.default_rng(3)
    for count in (2, 3, 4, 5):
        poses = np.column_stack([random.normal(size=(count, 2)), random.uniform(-3.0, 3.0, count)])
        for samples, most in ((4, 3), (12, 20), (60, 400)):
            candidates(poses, samples, np.zeros((most, 4)))
        for most in (2, 100):
            cranks(poses, random.uniform(-3.0, 3.0, count - 1), np.zeros((most, 4)))


def _tilted(mechanism: Any, poses: np.ndarray) -> None:
    """Tell whether joints bind."""
    from graphsynth.jamming.joints.kernels import sharing

    joints = mechanism.joints
    pairs = np.array([(joint.a, joint.b) for joint in joints])
    guided = np.array([int(joint.kind != "R") for joint in joints])
    room, shape = np.zeros((len(joints), len(joints))), (len(poses), len(joints), 3)
    sharing.critical_tilt(17.5, 5.0, 0.03, False)
    sharing.critical_tilt(17.5, 5.0, 0.03, True)
    found = sharing.loops(pairs, mechanism.graph.links, mechanism.frame, room)
    for loose, tilt in ((0.0, 0.012), (0.01, 0.012), (0.0, 0.0)):
        limits, tilts = np.full((len(joints), 3), 0.01), np.tile([0.0, 0.0, 1.0], (len(joints), 1))
        limits[0], tilts[0] = loose, (tilt, 0.1 * tilt, 1.0)
        seats = sharing.Seats(pairs, guided, mechanism.dimensions.copy(), limits, tilts)
        factors = np.zeros((len(poses), 2))
        sharing.share(seats, room[:found].copy(), poses, factors, np.zeros(shape), np.zeros(shape))
