"""Chains from nauty's generators (B. D. McKay, A. Piperno) and a subset test: nothing here uses graphsynth."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable

import numpy as np
import pytest
from numba import njit


def program(name: str) -> str:
    """Return the path of a nauty program under either of its names, or skip the test."""
    path = shutil.which(f"nauty-{name}") or shutil.which(name)
    if path is None:
        pytest.skip(f"nauty's {name} is not installed")
    return path


def run(name: str, *arguments: str, data: Iterable[str] = ()) -> list[str]:
    text = "".join(f"{line}\n" for line in data)
    done = subprocess.run([program(name), "-q", *arguments], input=text, capture_output=True, text=True, check=True)
    return done.stdout.split("\n")[:-1]


def canonical(graphs: Iterable[str]) -> list[str]:
    """Return nauty's canonical graph6 line of each graph."""
    return run("labelg", "-g", data=graphs)


def adjacency(lines: list[str]) -> np.ndarray:
    """Decode graph6 lines of equal size (at most 62 vertices) into neighbour masks ``(graphs, n)``."""
    raw = np.frombuffer("".join(lines).encode(), np.uint8).reshape(len(lines), -1) - 63
    n = int(raw[0, 0])
    bits = np.unpackbits(raw[:, 1:, None], axis=2)[:, :, 2:].reshape(len(lines), -1)
    masks = np.zeros((len(lines), n), np.int64)
    at = 0
    for b in range(1, n):
        for a in range(b):
            masks[:, a] |= bits[:, at].astype(np.int64) << b
            masks[:, b] |= bits[:, at].astype(np.int64) << a
            at += 1
    return masks


@njit(cache=True)
def _loose(masks, proper, keep):
    """Mark the planar graphs whose every (proper) set of two or more links has DOF >= 1."""
    n = masks.shape[1]
    inside = np.zeros(1 << n, np.int16)
    size = np.zeros(1 << n, np.int16)
    last = (1 << n) - 1 - proper
    for g in range(masks.shape[0]):
        keep[g] = True
        for s in range(1, last + 1):
            low = 0
            while not s >> low & 1:
                low += 1
            rest = s & (s - 1)
            size[s] = size[rest] + 1
            joints = 0
            near = masks[g, low] & rest
            while near:
                near &= near - 1
                joints += 1
            inside[s] = inside[rest] + joints
            if rest and 3 * (size[s] - 1) - 2 * inside[s] < 1:
                keep[g] = False
                break


def chains(links: int, joints: int, *, fractionated: bool = False, proper: bool = False) -> list[str]:
    """Return graph6 lines of all planar chains with mobility-1 joints (trusses, if ``proper``)."""
    lines = run("geng", "-cd2" if fractionated else "-C", str(links), f"{joints}:{joints}")
    keep = np.zeros(len(lines), np.bool_)
    _loose(adjacency(lines), int(proper), keep)
    return [line for line, kept in zip(lines, keep, strict=True) if kept]
