"""The same bits from the library of kernels and from numba: recorded calls, changed many times over."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import repeat
from typing import Any

import numpy as np

from graphsynth.core.native import library
from graphsynth.core.native.signatures import Signature

from .kernel_calls import duplicate, flattened, size_of

#: Kernels whose results hold memory as it was found.
UNSET = {"graphsynth.structure.kernels.canon_workspace"}
SPECIAL = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, -5e-324, 2.2e-308, 1.8e308, -1.8e308, 1.0, -1.0])
MOST, LEAST = 1_000_000, 50  # calls of a kernel
CHUNK, CHUNK_BYTES, CHUNK_SECONDS = 4096, 16_000_000, 1.0  # of calls that are made one after another


def kernel_of(name: str) -> Any:
    module, _, function = name.rpartition(".")
    return getattr(import_module(module), function)


def calls_of(kernel: Any) -> int:
    entry = kernel.entry()
    return sum(calls for _, calls in entry[2]) if entry else 0


def levels() -> list[int | None]:
    """Versions of the code in the library that this processor can run."""
    both = library.target().startswith("x86_64") and library.reason == "x86-64-v3"
    return list(range(len(library.LEVELS["x86_64"]))) if both else [None]


# -- bits ------------------------------------------------------------------------------------------------------------


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays have the same type, shape and bits; any NaN equals any other."""
    if (a.dtype, a.shape) != (b.dtype, b.shape):
        return False
    x, y = (np.ascontiguousarray(array).ravel() for array in (a, b))
    if np.array_equal(x.view(np.uint8), y.view(np.uint8)):
        return True
    if x.dtype.kind not in "fc":
        return False
    real = np.float32 if x.dtype in (np.float32, np.complex64) else np.float64
    bits = np.int32 if real is np.float32 else np.int64
    x, y = x.view(real), y.view(real)
    return bool(np.all((x.view(bits) == y.view(bits)) | (np.isnan(x) & np.isnan(y))))


def same_results(ours: list[Any], theirs: list[Any]) -> bool:
    """Whether two lists of results agree, each in types, shapes and bits."""
    kinds = list(map(type, ours))
    if kinds != list(map(type, theirs)):
        return False
    if len(set(kinds)) > 1:  # some calls have raised
        return all(same_results([a], [b]) for a, b in zip(ours, theirs, strict=True))
    if kinds[0] is np.ndarray:
        alike = [(x.dtype, x.shape) for x in ours] == [(x.dtype, x.shape) for x in theirs]
        return alike and same_bits(*(np.concatenate([x.ravel() for x in found]) for found in (ours, theirs)))
    if issubclass(kinds[0], tuple):
        pairs = zip(zip(*ours, strict=True), zip(*theirs, strict=True), strict=True)
        return all(same_results(list(a), list(b)) for a, b in pairs)
    if issubclass(kinds[0], float | complex | np.generic):
        return same_bits(np.array(ours), np.array(theirs))
    return ours == theirs


# -- changed calls ---------------------------------------------------------------------------------------------------


def leaves(value: Any) -> Iterator[Any]:
    """Yield what the tuples of arguments hold."""
    if isinstance(value, tuple):
        for part in value:
            yield from leaves(part)
    else:
        yield value


def rebuilt(like: Any, row: Iterator[Any]) -> Any:
    """Put values where ``leaves`` found others."""
    if not isinstance(like, tuple):
        return next(row)
    parts = [rebuilt(part, row) for part in like]
    return type(like)(*parts) if hasattr(like, "_fields") else tuple(parts)


def changed(args: tuple[Any, ...], count: int, rng: np.random.Generator) -> list[Any]:
    """Return ``count`` values for each leaf: arrays with one more axis.

    Floats are changed by a part of 1e-15 to 0.1, some by nothing; numbers of things and choices stay.
    """
    found = []
    for leaf in leaves(args):
        if isinstance(leaf, float):
            leaf = np.float64(leaf)
        elif not isinstance(leaf, np.ndarray):
            found.append(leaf)
            continue
        block = np.repeat(np.asarray(leaf)[None], count, axis=0)
        if block.dtype.kind in "fc" and block.size:
            each = (count, *[1] * (block.ndim - 1))
            size = 10.0 ** rng.uniform(-15, -1, each) * (rng.random(block.shape) < rng.random(each))
            with np.errstate(all="ignore"):  # of results that nobody has written yet
                block *= 1.0 + size * rng.standard_normal(block.shape)
        found.append(block)
    return found


def rows_of(args: tuple[Any, ...], blocks: list[Any]) -> tuple[list[Any], list[tuple[Any, ...]]]:
    """Copy changed leaves; return the copies and the arguments of each call, views of these."""
    copies, columns = [], []
    for leaf, block in zip(leaves(args), blocks, strict=True):
        if isinstance(leaf, np.ndarray):
            assert leaf.flags.c_contiguous
            copies.append(block.copy())
            view = copies[-1].view()
            view.flags.writeable = leaf.flags.writeable
            columns.append(list(view))
        elif isinstance(block, list):
            columns.append(block)
        else:
            columns.append(block.tolist() if isinstance(leaf, float) else repeat(block))
    if not any(isinstance(part, tuple) for part in args):
        return copies, list(zip(*columns, strict=False))
    return copies, [rebuilt(args, iter(row)) for row in zip(*columns, strict=False)]


def results(function: Callable[..., Any], calls: list[tuple[Any, ...]]) -> list[Any]:
    """Results of calls; of one that raises, the class of the error."""
    found = []
    for args in calls:
        try:
            found.append(function(*args))
        except Exception as error:
            found.append(type(error))
    return found


def agree(kernel: Any, copies: Callable[[], tuple[list[Any], list[tuple[Any, ...]]]]) -> bool:
    """Make the same calls with numba and in every version of the library: whether all bits agree."""
    theirs, calls = copies()
    expected = results(kernel.dispatcher, calls)
    unset = f"{kernel.__module__}.{kernel.__qualname__}" in UNSET
    for level in levels():
        ours, calls = copies()
        if level is not None:
            library._library.set_level(level)
        before = calls_of(kernel)
        found = results(kernel, calls)
        assert calls_of(kernel) == before + len(calls), "the library was not used"
        if unset:
            found, wanted = ([[x.shape for x in arrays] for arrays in result] for result in (found, expected))
        else:
            wanted = expected
        if not same_results(found, wanted) or not all(map(same_bits, ours, theirs)):
            return False
    return True


def agree_on(kernel: Any, args: tuple[Any, ...]) -> bool:
    """Compare one call."""

    def copies() -> tuple[list[Any], list[tuple[Any, ...]]]:
        copy = duplicate(args)
        return flattened(copy), [copy]

    return agree(kernel, copies)


# -- any numbers -----------------------------------------------------------------------------------------------------


def interval_numbers(signature: Signature, each: int, rng: np.random.Generator) -> tuple[Any, ...]:
    """Arguments of a loop over intervals: any bits, usual numbers and special ones."""
    types = signature.types.split(", ")
    inputs = sum(kind == "f8[1Cr]" for kind in types)
    values = any_numbers((inputs, each), rng)
    for k in range(0, inputs, 2):  # bounds in order, mostly
        values[k : k + 2] = np.sort(values[k : k + 2], axis=0)
    arrays = iter(values)
    args = [int(rng.integers(-5, 9)) if kind == "i8" else next(arrays, None) for kind in types]
    return tuple(np.zeros(each) if value is None else value for value in args)


def any_numbers(shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Any bits, usual numbers and special ones."""
    any_bits = rng.integers(-(2**63), 2**63 - 1, shape).view(np.float64)
    usual = rng.standard_normal(shape) * 10.0 ** rng.integers(-3, 4, shape)
    values = np.where(rng.random(shape) < 0.4, any_bits, usual)
    return np.where(rng.random(shape) < 0.2, rng.choice(SPECIAL, shape), values)


# -- other whole numbers ---------------------------------------------------------------------------------------------


def turned(masks: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Renumber the vertices of graphs that are given by bits: vertex ``order[v]`` becomes v."""
    vertices = np.arange(masks.shape[-1], dtype=np.uint64)
    bits = (masks[..., order][..., None] >> vertices[order]) & np.uint64(1)
    return np.bitwise_or.reduce(bits << vertices, axis=-1)


def renumbered(packed: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Renumber the links of joints (a, b, mobility)."""
    found = packed.copy()
    found[..., 0::3], found[..., 1::3] = order[packed[..., 0::3]], order[packed[..., 1::3]]
    return found


def at(args: tuple[Any, ...], **values: Any) -> tuple[Any, ...]:
    """Return arguments of which some are others, by place: ``_3=7``."""
    return tuple(values.get(f"_{place}", value) for place, value in enumerate(args))


def shuffled(args: tuple[Any, ...], *places: int, rng: np.random.Generator, count: int = -1) -> tuple[Any, ...]:
    """Permute the first rows of arrays, of all in the same way."""
    length = len(args[places[0]]) if count < 0 else count
    order = np.r_[rng.permutation(length), length : len(args[places[0]])]
    return at(args, **{f"_{place}": args[place][order] for place in places})


def _canon(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    order = rng.permutation(args[0])
    masks = args[2].copy()
    masks[:, : args[0]] = turned(masks[:, : args[0]], order)
    return at(args, _2=masks, _3=np.r_[args[3][order], args[3][args[0] :]])


def _canon_packed(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    order = rng.permutation(args[0])
    return at(args, _1=renumbered(args[1], np.argsort(order).astype(np.uint8)), _2=args[2][order])


def _renumbered_graphs(mults: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    order = rng.permutation(mults.shape[-1])
    return np.ascontiguousarray(mults[..., order, :][..., order])


def _count_block(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    start = int(rng.integers(args[2], args[3], endpoint=True))
    return at(args, _1=_renumbered_graphs(args[1], rng), _2=start, _3=min(start + int(rng.integers(9)), args[3]))


def _list_rows(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    from graphsynth.synthesis.kernels.listing import ACTIVE, GRAPH, ORDER, PART, PARTS

    args = at(args, _8=args[8][: int(rng.choice((1, 2, 1 + len(args[8]) // 2, len(args[8]))))])  # few shapes
    work, graphs = args[7], args[2]
    if work.state[ACTIVE] or work.state[ORDER] or not graphs:
        return args
    state, parts = work.state.copy(), int(rng.integers(1, 4))  # nothing begun: from anywhere on, a part
    state[GRAPH], state[PART], state[PARTS] = rng.integers(graphs), rng.integers(parts), parts
    return at(args, _1=_renumbered_graphs(args[1], rng), _7=work._replace(state=state))


def _expand(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    rows = int(rng.integers(min(args[4], 6), endpoint=True))
    return at(shuffled(args, 3, rng=rng, count=args[4]), _4=rows)


def _open_fixed(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    from graphsynth.synthesis.families import FRAME_NONE

    order = rng.permutation(args[0])
    return at(args, _1=args[1][np.ix_(order, order)], _2=int(FRAME_NONE), _3=0, _4=0)


def _outline(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    """Renumber links, hold another one, drive other joints; half of the time joint others, or let some slide."""
    drawn, _, out = args
    links, joints, drivers = len(out.structure), drawn.joints.copy(), drawn.drivers.copy()
    joints[:, 1:] = rng.permutation(links)[joints[:, 1:]]
    if rng.random() < 0.5:
        k = rng.integers(len(joints))
        joints[k, 2] = (joints[k, 1] + rng.integers(1, links)) % links
    low = (joints[:, 0] <= 2) & (rng.random(len(joints)) < 0.3 * rng.integers(2))
    joints[low, 0] = rng.choice((0, 0, 1, 2), low.sum())
    drivers[:, 0] = rng.permutation(len(joints))[: len(drivers)]
    drivers[:, 1] = joints[drivers[:, 0], rng.integers(1, 3, len(drivers))]
    return drawn._replace(joints=joints, drivers=drivers), int(rng.integers(links)), out


def _turns(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    """Change machines by so little that their branches go on: others are followed in ever smaller steps."""
    return at(args, _0=args[0] * (1.0 + 10.0 ** rng.uniform(-15, -9) * rng.standard_normal(args[0].shape)))


def _loops(args: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    """Join bodies anyhow, in one part or in several."""
    joints, bodies = len(args[0]), args[1]
    first = rng.integers(bodies, size=joints)
    pairs = np.stack([first, (first + rng.integers(1, bodies, joints)) % bodies], axis=1)
    return at(args, _0=pairs, _2=int(rng.integers(bodies)), _3=np.zeros((joints, joints)))


#: By kernel of whole numbers, or of data that must fit together: other arguments that it may be given.
OTHERS: dict[str, Callable[[tuple[Any, ...], np.random.Generator], tuple[Any, ...]]] = {
    "structure.kernels.canon": _canon,
    "structure.kernels.canon_packed": _canon_packed,
    "structure.kernels.canon_workspace": lambda args, rng: (int(rng.integers(64)), int(rng.integers(4))),
    "atlas.kernels.facts.analyse": lambda args, rng: at(
        args, _2=renumbered(args[2], rng.permutation(args[0]).astype(np.uint8))
    ),
    "atlas.kernels.facts.classes_of": lambda args, rng: shuffled(args, 0, 1, rng=rng),
    "synthesis.kernels.counting.count_block": _count_block,
    "synthesis.kernels.counting.weigh_block": lambda args, rng: shuffled(args, 2, rng=rng),
    "synthesis.kernels.counting.open_fixed": _open_fixed,
    "synthesis.kernels.counting.decode_fixed": lambda args, rng: at(args, _3=int(rng.integers(args[3] + 1))),
    "synthesis.kernels.expanding.expand_packed": _expand,
    "synthesis.kernels.expanding.expand_text": _expand,
    "synthesis.kernels.listing.list_rows": _list_rows,
    "synthesis.kernels.listing.rewind": lambda args, rng: at(args, _0=int(rng.integers(99)), _1=int(rng.integers(9))),
    "systems.platform.kernels.turns": _turns,
    "jamming.joints.kernels.sharing.loops": _loops,
    "kinematics.engine.kernels.planning.outline": _outline,
    "synthesis.kernels.splitting.split_all": lambda args, rng: at(
        shuffled(args, 1, rng=rng), _2=int(rng.integers(len(args[1]), endpoint=True))
    ),
}


# -- as many calls as time allows ------------------------------------------------------------------------------------


class Compared:
    """Calls of one kernel, compared until a time is over."""

    def __init__(self, signature: Signature, kept: list[tuple[Any, ...]], rng: np.random.Generator) -> None:
        self.kernel, self.kept, self.rng = kernel_of(signature.kernel), kept, rng
        self.other = OTHERS.get(signature.kernel.removeprefix("graphsynth."))
        self.calls = self.chunks = 0
        self.wrong: list[str] = []

    def run(self, seconds: float, most: int = MOST) -> None:
        """Compare the recorded calls, then changed ones: at least `LEAST`, at most ``most``."""
        for args in self.kept:  # compiles the kernel
            self._note(agree_on(self.kernel, args), 1)
        counts = [1] * len(self.kept)  # of a chunk; some recorded calls take much longer than others
        start = time.perf_counter()
        while self.calls < most and (self.calls < LEAST or time.perf_counter() - start < seconds):
            began = time.perf_counter()
            place = self.chunks % len(self.kept)
            args = self.kept[place]
            count = max(1, min(counts[place], most - self.calls, CHUNK_BYTES // (1 + size_of(args))))
            (self._one if self.other else self._chunk)(args, count)
            self.chunks += 1
            if time.perf_counter() - began < min(CHUNK_SECONDS, seconds / 8):
                counts[place] = min(2 * count, CHUNK)

    def _one(self, args: tuple[Any, ...], _: int) -> None:
        assert self.other is not None
        others = self.other(args, self.rng)
        for new, old in zip(others, args, strict=True):
            if new is not old and isinstance(new, np.ndarray):
                new.flags.writeable = old.flags.writeable
        self._note(agree_on(self.kernel, others), 1)

    def _chunk(self, args: tuple[Any, ...], count: int) -> None:
        blocks = changed(args, count, self.rng)
        self._note(agree(self.kernel, lambda: rows_of(args, blocks)), count)

    def _note(self, right: bool, count: int) -> None:
        self.calls += count
        if not right:
            self.wrong.append(f"{self.kernel.__qualname__}: call {self.calls - count} to {self.calls - 1}")


def table(found: dict[Signature, int]) -> str:
    """Show how many calls of each kernel were compared."""
    lines = [f"{number:>9}  {kind.kernel.removeprefix('graphsynth.')}" for kind, number in sorted(found.items())]
    least = min(found, key=lambda kind: found[kind])
    lines.append(f"{sum(found.values()):>9}  in all; fewest of {least.kernel}: {found[least]}")
    return "\n".join(lines)
