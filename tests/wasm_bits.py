"""The same bits from WebAssembly and from native code: ``python -m tests.wasm_bits CALLS PLACE [KERNEL ...]``.

PLACE is ``node``, ``browser`` or ``both``.

Real calls are recorded from a few computations, then changed many times over, as `kernel_bits` does, for
GRAPHSYNTH_BITS_SECONDS each.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator
from itertools import count as count_up
from time import perf_counter
from typing import Any

import numpy as np

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
from .kernel_calls import size_of
from .wasm_calls import Both, Remote, browser, node
from .wasm_cases import computations, page_computations

_CHUNK, _BYTES, _SECONDS = 16384, 8_000_000, 1.0


def stacked(rows: list[tuple[Any, ...]]) -> list[Any]:
    """Return all values of each leaf of calls, arrays of the same shapes with one more axis, whole numbers as lists."""
    blocks: list[Any] = []
    for column in zip(*map(leaves, rows), strict=True):
        first = column[0]
        if isinstance(first, np.ndarray):
            same = all(part is first for part in column)
            blocks.append(np.repeat(first[None], len(column), axis=0) if same else np.stack(column))
        elif isinstance(first, float):
            blocks.append(np.array(column))
        else:
            blocks.append(first if all(part == first for part in column) else list(column))
    return blocks


def alike(rows: list[tuple[Any, ...]]) -> Iterator[list[tuple[Any, ...]]]:
    """Yield the calls whose arrays have the same shapes together."""
    groups: dict[tuple[Any, ...], list[tuple[Any, ...]]] = {}
    for row in rows:
        groups.setdefault(tuple(getattr(leaf, "shape", None) for leaf in leaves(row)), []).append(row)
    yield from groups.values()


def varied(args: tuple[Any, ...], count: int, rng: np.random.Generator) -> list[Any]:
    """Change half of the floats of calls: by the same small part in half of the calls, so that most still fit together.

    In the others as `changed` does, each array by a part of its own.
    """
    blocks = changed(args, count, rng)
    gently, size = rng.random(count) < 0.5, 10.0 ** rng.uniform(-16, -3, count)
    for k, leaf in enumerate(leaves(args)):
        block = blocks[k]
        if isinstance(leaf, np.ndarray | float) and block.dtype.kind in "fc" and block.size:
            each = (count, *[1] * (block.ndim - 1))
            part = (size * (rng.random(count) < 0.5)).reshape(each) * rng.standard_normal(block.shape)
            with np.errstate(all="ignore"):
                blocks[k] = np.where(gently.reshape(each), np.asarray(leaf) * (1.0 + part), block)
    return blocks


#: By kernel: where, in the last array that it writes, the code stands that tells how it ended.
CODES = {"advancing.advance": 1, "advancing.sweep": 2, "dragging.drag": 1, "running.run": 0}


def _plain(result: Any) -> Any:
    if isinstance(result, np.ndarray):
        return result.tobytes()
    return tuple(map(_plain, result)) if isinstance(result, tuple) else result


class Seen:
    """How different the results of many calls are."""

    def __init__(self, kernel: str) -> None:
        self.place = CODES.get(".".join(kernel.split(".")[-2:]))
        self.marks: list[np.ndarray] = []
        self.codes: Counter[Any] = Counter()

    def note(self, found: list[Any], blocks: list[Any], arrays: list[np.ndarray]) -> None:
        """Note the results of calls, and what became of their arrays."""
        marks = np.array([hash(_plain(result)) for result in found]).view(np.uint64)
        for block, array in zip(blocks, arrays, strict=True):
            if len(array) and array[0].size and not same_bits(array, block):
                flat = np.ascontiguousarray(array).reshape(len(array), -1)
                words = flat.view(np.uint64) if flat.itemsize % 8 == 0 else flat.astype(np.uint64)
                odd = np.random.default_rng(words.shape[1]).integers(0, 2**63, words.shape[1], np.uint64) * np.uint64(2)
                marks = marks * np.uint64(0x9E3779B97F4A7C15) + words @ (odd + np.uint64(1))
        self.marks.append(np.unique(marks))
        codes = found if self.place is None else arrays[-1].reshape(len(found), -1)[:, self.place].tolist()
        if self.place is not None or isinstance(codes[0], int | str) or self.codes:
            self.codes.update(map(str, codes))

    def told(self) -> str:
        """Tell how many different results there were, and how often each code, if there are few."""
        text = f"{len(np.unique(np.concatenate(self.marks))):>8} results"
        if not 0 < len(self.codes) < 12:
            return text + (f", {len(self.codes)} codes" if self.codes else "")
        return text + " " + " ".join(f"{code}:{times}" for code, times in sorted(self.codes.items()))


class Bits:
    """One kernel of a module, in both forms."""

    def __init__(self, remote: Remote | Both, module: str, signature: Signature) -> None:
        self.remote, self.module, self.signature = remote, module, signature
        self.kernel = kernel_of(signature.kernel)
        self.name = signature.kernel.removeprefix("graphsynth.")
        self.seen = Seen(self.name)
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
        held = [block for leaf, block in zip(leaves(args), blocks, strict=True) if isinstance(leaf, np.ndarray)]
        self.seen.note(found, held, arrays)
        self.seconds += native - made, remote - native, made - begin + perf_counter() - remote
        return same

    def agree_on(self, args: tuple[Any, ...]) -> bool:
        """Compare one call."""
        blocks = [np.asarray(leaf)[None] if isinstance(leaf, np.ndarray | float) else leaf for leaf in leaves(args)]
        return self.agree(args, blocks, 1)

    def other_calls(self, args: tuple[Any, ...], count: int, rng: np.random.Generator) -> bool:
        """Compare calls like one: with other numbers."""
        other = OTHERS.get(self.name)
        if other is None:
            plain = not any(isinstance(leaf, np.ndarray) for leaf in leaves(args))
            numbers = plain and all(isinstance(leaf, float) for leaf in leaves(args))
            blocks = [any_numbers((count,), rng) for _ in args] if numbers else varied(args, count, rng)
            return self.agree(args, blocks, count)
        same = True
        for rows in alike([other(args, rng) for _ in range(count)]):
            for new, old in zip(leaves(rows[0]), leaves(args), strict=True):
                if new is not old and isinstance(new, np.ndarray):
                    new.flags.writeable = old.flags.writeable
            same &= self.agree(rows[0], stacked(rows), len(rows))
        return same

    def run(self, kept: list[tuple[Any, ...]], most: int, seconds: float, rng: np.random.Generator) -> tuple[int, int]:
        """Compare up to ``most`` calls, as long as time allows; how many, and how many chunks were wrong."""
        types = self.signature.types.split(", ")
        if ".loops." in self.name:
            return most, int(not self.agree_on(interval_numbers(self.signature, most, rng)))
        if set(types) == {"f8"}:
            kept = [(1.0,) * len(types)]
        done = wrong = 0
        for args in kept[:most]:
            wrong += not self.agree_on(args)
            done += 1
        counts, costs = [max(1, min(256, most // 100))] * len(kept), [0.0] * len(kept)
        start = perf_counter()
        for place in _turns(costs):
            if done >= most or perf_counter() - start >= seconds:
                break
            args, began = kept[place], perf_counter()
            size = max(1, min(counts[place], most - done, _BYTES // (1 + size_of(args))))
            wrong += not self.other_calls(args, size, rng)
            done += size
            took = perf_counter() - began
            costs[place] = took / size
            if took < _SECONDS:
                counts[place] = min(4 * counts[place], _CHUNK)
            elif took > 8.0 * _SECONDS:
                counts[place] = max(1, counts[place] // 4)
        return done, wrong


def _turns(costs: list[float]) -> Iterator[int]:
    """Yield whose turn it is: all but the dear ones one after another, and one of the dear ones."""
    for turn in count_up():
        usual = 4.0 * float(np.median(costs)) if turn > 6 else np.inf  # the first calls are slow
        dear = [place for place, cost in enumerate(costs) if cost > usual]
        yield from [place for place, cost in enumerate(costs) if cost <= usual]
        if dear:
            yield dear[turn % len(dear)]


def main(most: int, place: str, *wanted: str) -> None:
    """Compare kernels of all modules, or those whose names hold a text; print how many calls."""
    seconds = float(os.environ.get("GRAPHSYNTH_BITS_SECONDS", "300"))
    kept = computations(many=True) | page_computations()
    remote = {"node": node, "browser": browser, "both": Both}[place]()
    bad = 0
    for module, signatures in read_modules().items():
        for signature in signatures:
            if wanted and not any(text in signature.kernel for text in wanted):
                continue
            bits = Bits(remote, module, signature)
            calls, wrong = bits.run(kept.get(signature.kernel, []), most, seconds, np.random.default_rng(20))
            bad += wrong
            each = " ".join(f"{1e6 * part / calls:9.1f}" for part in bits.seconds)
            print(
                f"{calls:>9} calls, {wrong} chunks differ, us {each}  {module}: {bits.name}",
                bits.seen.told(),
                flush=True,
            )
    remote.close()
    sys.exit(bad > 0)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])
