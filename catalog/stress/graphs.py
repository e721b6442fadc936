"""Graphs by hand, and exceptions to look at."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import combinations
from typing import Any

import numpy as np

from graphsynth.core.errors import GraphsynthError


def rod_and_slider(theta: float) -> list[tuple[float, float, float]]:
    import math

    x, y = math.cos(theta), math.sin(theta)
    tilt = math.asin(-y / 3.0)
    return [(x, y, tilt), (x + 3.0 * math.cos(tilt), 0.0, 0.0)]


def rigid_sets(links: int, joints: list[tuple[int, int]]) -> list[set[int]]:
    """List the sets of two links or more of mobility 0 or less."""
    found = []
    for size in range(2, links + 1):
        for chosen in combinations(range(links), size):
            inside = sum(a in chosen and b in chosen for a, b in joints)
            if 3 * (size - 1) - 2 * inside <= 0:
                found.append(set(chosen))
    return found


def refusal_of(call: Callable[..., object], *arguments: object) -> GraphsynthError:
    """Return the exception that a call raises."""
    try:
        found = call(*arguments)
    except GraphsynthError as error:
        return error
    raise AssertionError(f"no refusal but {found!r}")


def count_spectra(chains: Iterable[Any]) -> int:
    """Count the different characteristic polynomials of ten-link chains."""
    spectra = set()
    for chain in chains:
        A = np.zeros((10, 10))
        for a, b, _ in chain.joints:
            A[a, b] = A[b, a] = 1.0
        spectra.add(tuple(np.round(np.poly(A)).astype(int).tolist()))
    return len(spectra)
