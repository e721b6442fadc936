"""The same bits from WebAssembly and from native code: ``python -m tests.wasm_bits CALLS node|browser [KERNEL ...]``.

Real calls are recorded from a few computations, then changed many times over, as `kernel_bits` does, for
GRAPHSYNTH_BITS_SECONDS each.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

import numpy as np

from graphsynth.core.compilation import Deferred, Kernel
from graphsynth.core.native import library
from graphsynth.core.native.signatures import Signature
from graphsynth.core.native.wasm import read_modules

from .kernel_bits import (
    OTHERS,
    any_numbers,
    changed,
    interval_numbers,
    kernel_of,
    leaves,
    results,
    rows_of,
    same_bits,
    same_results,
)
from .kernel_calls import duplicate, size_of
from .wasm_calls import Remote, browser, node

_KEPT, _CHUNK, _BYTES = 12, 4096, 8_000_000
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


def computations(*, many: bool) -> Recorded:
    """Record the calls of computations that use the kernels of all modules."""
    import graphsynth as gs
    from graphsynth.jamming.intersection import circle_ellipse, krawczyk_boxes
    from graphsynth.kinematics.dimensional.sketch import layout
    from graphsynth.mechanism import gallery
    from graphsynth.structure.canonical import _label
    from graphsynth.synthesis.problem import EnumerationProblem
    from graphsynth.synthesis.sampling import sample

    kept: Recorded = {}
    turn = np.linspace(0.0, 2.0 * np.pi, 361 if many else 25)
    with recording(kept):
        gs.simulate(gs.Mechanism.four_bar(4.0, 1.2, 3.5, 3.0, coupler_point=(1.8, 1.4)), turn)
        gs.simulate(gs.Mechanism.slider_crank(1.0, 3.0), turn)
        for name in gallery.__all__ if many else ():
            gs.simulate(getattr(gallery, name)(), turn)
        gs.count_chains(10 if many else 6)
        for chain in list(gs.enumerate_chains(10 if many else 6))[:40]:
            layout(chain)
            _label(chain, [0] * chain.links, compiled=True)
        sample(EnumerationProblem.chains(8, 1, 3, None, False, None, framed=True), 6, 1)
        for width in ("1e-9", "0.01"):
            krawczyk_boxes(circle_ellipse(5, 6, 4, eps=width), max_boxes=200)
    return kept


#: Kernels of the page's engine alone; natively they are compiled when a test asks for them.
PAGE = ("engine.kernels.planning.", "engine.kernels.advancing.", "engine.kernels.dragging.", "jamming.joints.kernels.",
        "design.poses.kernels.", "certify.kernels.")  # fmt: skip


def page_computations() -> Recorded:
    """Record the calls with which the page moves mechanisms: planned, settled, followed, swept and pulled."""
    import graphsynth as gs
    from graphsynth.kinematics.engine import codes, outlines
    from graphsynth.kinematics.engine.kernels import advancing, dragging, planning
    from graphsynth.kinematics.engine.program import compile_program, drawn, equations

    kept: Recorded = {}
    crank, rocker = gs.Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), gs.Mechanism.four_bar(4.0, 3.0, 2.0, 2.5)
    for mechanism in (crank, rocker, gs.Mechanism.slider_crank(1.0, 3.0)):
        pose = gs.simulate(mechanism, [0.7]).poses[0]
        links, sizes = mechanism.graph.links, mechanism.dimensions[None]
        with recording(kept, all_calls=True):
            tables = compile_program(mechanism).tables
            rows, table = equations(mechanism.joints, sizes)
            given, q, one = drawn(mechanism.joints, sizes, mechanism.drivers), np.zeros(1), np.ones(1)
            length = planning.sizes_of(given, links)
            steps, n = len(tables.steps), advancing.SAMPLES
            shapes = ((links, 4, n), (links, n), (links, 3, n), (links, 3, n), (1, n), (steps, n))
            state, modes, found = codes.State(*map(np.zeros, shapes)), np.ones(steps), np.zeros(5)
            advancing.driver_coordinates(given, pose, q)
            advancing.settle(tables, modes, state, q, one, pose, length)
            advancing.advance(tables, modes, state, q, q + 0.4, one, length, found[:3].copy())
            out = outlines.Samples(*(np.zeros((9, links, 3)) for _ in range(3)), np.zeros((9, steps)), np.zeros((4, 2)))
            watched = np.array([[links - 1.0, 0.0, 0.0]])
            advancing.sweep(tables, modes, state, q + 0.4, q + 2.0, 1.0, watched, out, length, found)
            advancing.instant_centres(state.X, state.V, np.zeros((links, links, 2)))
            for x, y in ((0.0, 0.0), (0.3, -0.2)):
                advancing.point_motion(*out[:3], links - 1, x, y, np.zeros((9, 6)))
            dragging.closed_pose(rows, table[0], 0, pose + 1e-3 * (np.arange(links) > 0)[:, None], length[0])
            way, near = np.zeros(3 * links - 3), pose.copy()
            for target in ([2.0, 1.0], [1.0, 2.0]):
                at = np.array([0.3, 0.2])
                dragging.drag(rows, table[0], 0, near, 2, at, np.array(target), way, length[0], found[:3].copy())
        _tilted(mechanism, np.ascontiguousarray(pose[None]), kept)
        _proved(mechanism, pose, kept)
        _walked(mechanism, kept)
    _through_poses(kept)
    return kept


def _proved(mechanism: Any, pose: np.ndarray, kept: Recorded) -> None:
    """Record the calls with which the page proves a motion, a few boxes at a time."""
    from graphsynth.kinematics.certify import kernels
    from graphsynth.kinematics.engine.program import equations

    rows, (table,) = equations(mechanism.joints, mechanism.dimensions[None], mechanism.drivers)
    inputs, box, turns = np.array([pose[1, 2]]), np.zeros((4, *pose.shape)), np.zeros(len(rows))
    box[0], state, end = pose, np.array([inputs[0], 0.05, 0.0, 0.0]), inputs[0] + 2.0 * np.pi
    with recording(kept, all_calls=True):
        march = rows, table, mechanism.frame, inputs, 0, end, 2.0, turns, box, state
        kernels.march(*march, 0)
        first = box.copy()
        for limit in (3, 6):
            kernels.march(*march, limit)
        kernels.closes(rows, table, mechanism.frame, 0, first, inputs[0], first + 0.0, inputs[0], 0)
        kernels.closes(rows, table, mechanism.frame, 0, first, inputs[0], box, end, 1)


def _walked(mechanism: Any, kept: Recorded) -> None:
    """Record calls with which the page proves where a misaligned axis binds: free, on the verge and bound."""
    from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits
    from graphsynth.jamming.joints.kernels import walking
    from graphsynth.jamming.joints.program import problem
    from graphsynth.jamming.joints.walked import Walk

    motion = mechanism.simulate(np.linspace(0.7, 1.2, 5), events=False)
    limits = {
        own.pair: JointLimits(0.01, 0.001) if own.kind == "R" else SlideLimits(0.01, 0.02, 0.001)
        for own in mechanism.joints
    }
    with recording(kept, all_calls=True):
        for alpha in (0.004, 0.026, 0.2):
            walk = Walk(problem(mechanism, limits, Misalignment(0, 1, alpha, 0.3)), motion, 1e-3, 40)
            for limit in (0, 4, 9):
                walking.walk(
                    walk.task, walk.asked, walk.goal, walk.length, walk.box, walk.state, limit, walk.widths, walk._found
                )


def _through_poses(kept: Recorded) -> None:
    """Record the calls with which the page finds dyads of two to five poses."""
    from graphsynth.design.poses.kernels import candidates, cranks

    random = np.random.default_rng(3)
    with recording(kept, all_calls=True):
        for count in (2, 3, 4, 5):
            poses = np.column_stack([random.normal(size=(count, 2)), random.uniform(-3.0, 3.0, count)])
            candidates(poses, 60, np.zeros((400, 4)))
            cranks(poses, random.uniform(-3.0, 3.0, count - 1), np.zeros((100, 4)))


def _tilted(mechanism: Any, poses: np.ndarray, kept: Recorded) -> None:
    """Record the calls with which the page tells whether joints bind."""
    from graphsynth.jamming.joints.kernels import sharing

    joints = mechanism.joints
    pairs = np.array([(joint.a, joint.b) for joint in joints])
    guided = np.array([int(joint.kind != "R") for joint in joints])
    limits, tilts = np.full((len(joints), 3), 0.01), np.tile([0.0, 0.0, 1.0], (len(joints), 1))
    limits[0], tilts[0] = 0.0, (0.012, 0.001, 1.0)
    room, shape = np.zeros((len(joints), len(joints))), (len(poses), len(joints), 3)
    with recording(kept, all_calls=True):
        sharing.critical_tilt(17.5, 5.0, 0.03, False)
        sharing.critical_tilt(17.5, 5.0, 0.03, True)
        found = sharing.loops(pairs, mechanism.graph.links, mechanism.frame, room)
        seats = sharing.Seats(pairs, guided, mechanism.dimensions.copy(), limits, tilts)
        factors = np.zeros((len(poses), 2))
        sharing.share(seats, room[:found].copy(), poses, factors, np.zeros(shape), np.zeros(shape))


# -- comparing ---------------------------------------------------------------------------------------------------------


def stacked(rows: list[tuple[Any, ...]]) -> list[Any] | None:
    """Return all values of each leaf of calls, arrays with one more axis; None if shapes or whole numbers differ."""
    blocks: list[Any] = []
    for column in zip(*map(leaves, rows), strict=True):
        first = column[0]
        if isinstance(first, np.ndarray):
            if any(part.shape != first.shape for part in column):
                return None
            blocks.append(np.stack(column))
        elif isinstance(first, float):
            blocks.append(np.array(column))
        elif any(part != first for part in column):
            return None
        else:
            blocks.append(first)
    return blocks


class Bits:
    """One kernel of a module, in both forms."""

    def __init__(self, remote: Remote, module: str, signature: Signature) -> None:
        self.remote, self.module, self.signature = remote, module, signature
        self.kernel = kernel_of(signature.kernel)
        self.name = signature.kernel.removeprefix("graphsynth.")
        self.seconds = np.zeros(3)  #: native calls, the module's with the way there and back, making and comparing

    def agree(self, args: tuple[Any, ...], blocks: list[Any], count: int) -> bool:
        """Make the same calls in both: whether all results and all arrays have the same bits."""
        begin = perf_counter()
        copies, calls = rows_of(args, blocks)
        made = perf_counter()
        wanted = [found.__name__ if isinstance(found, type) else found for found in results(self.kernel, calls)]
        native = perf_counter()
        found, arrays = self.remote.call(self.module, self.name, args, blocks, count)
        remote = perf_counter()
        same = same_results(found, wanted) and all(map(same_bits, arrays, copies))
        self.seconds += native - made, remote - native, made - begin + perf_counter() - remote
        return same

    def agree_on(self, args: tuple[Any, ...]) -> bool:
        """Compare one call."""
        blocks = [np.asarray(leaf)[None] if isinstance(leaf, np.ndarray | float) else leaf for leaf in leaves(args)]
        return self.agree(args, blocks, 1)

    def run(self, kept: list[tuple[Any, ...]], most: int, seconds: float, rng: np.random.Generator) -> tuple[int, int]:
        """Compare up to ``most`` calls, as long as time allows; how many, and how many chunks were wrong."""
        types = self.signature.types
        if ".loops." in self.name:
            return most, int(not self.agree_on(interval_numbers(self.signature, most, rng)))
        if set(types.split(", ")) == {"f8"}:
            kept = [(1.0,) * len(types.split(", "))]
        other = OTHERS.get(self.name)
        done = wrong = chunk = 0
        count = 1
        start = perf_counter()
        while done < most and (done < len(kept) or perf_counter() - start < seconds):
            args = kept[chunk % len(kept)]
            chunk += 1
            if done < len(kept):
                wrong += not self.agree_on(args)
                done += 1
                continue
            began = perf_counter()
            size = max(1, min(count, most - done, _BYTES // (1 + size_of(args))))
            if other:
                rows = [other(args, rng) for _ in range(size)]
                blocks = stacked(rows)
                wrong += not (self.agree(rows[0], blocks, size) if blocks else all(map(self.agree_on, rows)))
            else:
                plain = set(types.split(", ")) == {"f8"}
                blocks = [any_numbers((size,), rng) for _ in args] if plain else changed(args, size, rng)
                wrong += not self.agree(args, blocks, size)
            done += size
            if perf_counter() - began < 1.0:
                count = min(2 * count, _CHUNK)
        return done, wrong


def main(most: int, place: str, *wanted: str) -> None:
    """Compare kernels of all modules, or those whose names hold a text; print how many calls."""
    seconds = float(os.environ.get("GRAPHSYNTH_BITS_SECONDS", "300"))
    kept = computations(many=True) | page_computations()
    remote = {"node": node, "browser": browser}[place]()
    bad = 0
    for module, signatures in read_modules().items():
        for signature in signatures:
            if wanted and not any(text in signature.kernel for text in wanted):
                continue
            bits = Bits(remote, module, signature)
            calls, wrong = bits.run(kept.get(signature.kernel, []), most, seconds, np.random.default_rng(20))
            bad += wrong
            each = " ".join(f"{1e6 * part / calls:9.1f}" for part in bits.seconds)
            print(f"{calls:>9} calls, {wrong} chunks differ, us {each}  {module}: {bits.name}", flush=True)
    remote.close()
    sys.exit(bad > 0)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])
