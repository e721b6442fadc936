"""Monte-Carlo samples and a search over corners, beside the certified bound (specification, section 10.4).

Samples prove nothing about freedom.  They are here to show how far the certified bound is from what is seen: a sample
above the bound would be a bug, a large gap would mean overestimation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.arguments import Count
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.parameters import ToleranceBox

__all__ = ["Samples", "sample_gaps"]

Array = NDArray[np.float64]
_BATCH = 100_000


@dataclass(frozen=True)
class Samples:
    """What was sampled, beside what is proved.

    Attributes
    ----------
    count : int
        Parameter vectors with a crank angle, uniform in the box and over the turn.
    largest_gap : float
        Largest gap seen, mm (estimated).
    jamming_positions : float
        Part of the samples with a positive gap: the share of crank positions, over all parameter vectors.
    jamming_mechanisms : float
        Part of the parameter vectors that have a positive gap somewhere in the turn: the probability that a mechanism
        drawn from the box jams (estimated), whether that position can be assembled or not.
    jamming_mechanisms_range : (float, float)
        Confidence interval of that probability, 95 %, exact for the binomial distribution (Clopper and Pearson 1934).
    corner_gap : float
        Largest gap over all corners of the box at the worst angle, mm (estimated).
    corners : int
        Corners tried.
    bound : float
        Certified upper bound of the gap, mm.
    outside : int
        Samples above the bound; anything but 0 is a bug.
    seconds : float
        Run time.
    """

    count: int
    largest_gap: float
    jamming_positions: float
    jamming_mechanisms: float
    jamming_mechanisms_range: tuple[float, float]
    corner_gap: float
    corners: int
    bound: float
    outside: int
    seconds: float = field(default=0.0, compare=False)

    @property
    def overestimation(self) -> float:
        """Certified bound minus the largest gap seen, at the corners or in the samples, mm."""
        return self.bound - max(self.largest_gap, self.corner_gap)


@checked
def sample_gaps(box: ToleranceBox, condition: Condition = "A", count: Count = 200_000, seed: int = 0) -> Samples:
    """Draw parameter vectors and crank angles, search the corners, and compare with the certified bound.

    Parameters
    ----------
    box : ToleranceBox
        The tolerance box; uniform and independent in every range.
    condition : {"A", "B", "general"}
        Contact condition.
    count : int
        Number of samples.
    seed : int
        Seed of the generator.

    Returns
    -------
    Samples
        Largest gap met, mm, whether it respects the certified bound, and how often positions and mechanisms jam.

    Raises
    ------
    GeometryError
        Unless ``count`` is a positive integer and ``seed`` one of zero or more, and what `certify_jamming` raises.

    Examples
    --------
    >>> box = ToleranceBox(alpha="0.0130 +- 0.00013", clearance="0.03 +- 0.003")
    >>> seen = sample_gaps(box, count=2000)
    >>> seen.outside, seen.jamming_positions, seen.jamming_mechanisms, 0 <= seen.overestimation < 1e-15
    (0, 0.0, 0.0, True)
    >>> seen.jamming_mechanisms_range[1] < 0.002
    True
    """
    if seed < 0:
        raise GeometryError(f"seed = {seed!r} must be a whole number of zero or more")
    begin = perf_counter()
    bound = certify_jamming(box, condition).largest_gap.hi
    generator = np.random.default_rng(seed)
    best, jams, ever, outside = -math.inf, 0, 0, 0
    for start in range(0, count, _BATCH):
        size = min(_BATCH, count - start)
        values = {name: _uniform(generator, box, name, size) for name in box.ranges}
        gap = _gaps(box, condition, values, np.sin(generator.uniform(0.0, math.tau, size)))
        best = max(best, float(gap.max()))
        jams += int((gap > 0.0).sum())
        ever += int((_gaps(box, condition, values, np.ones(size)) > 0.0).sum())  # the tilt is largest there
        outside += int((gap > bound).sum())
    corner, tried = _corners(box, condition)
    return Samples(
        count, best, jams / count, ever / count, _binomial_range(ever, count), corner, tried, bound, outside,
        perf_counter() - begin,
    )  # fmt: skip


def _binomial_range(hits: int, count: int) -> tuple[float, float]:
    """Clopper and Pearson's interval of a probability, 95 %."""
    from scipy.special import betaincinv

    low = 0.0 if hits == 0 else float(betaincinv(hits, count - hits + 1, 0.025))
    return low, 1.0 if hits == count else float(betaincinv(hits + 1, count - hits, 0.975))


def _uniform(generator: np.random.Generator, box: ToleranceBox, name: str, size: int) -> Array:
    (_, low), (high, _) = box[name].ends
    return np.full(size, low) if low >= high else generator.uniform(low, high, size)


def _gaps(box: ToleranceBox, condition: str, v: dict[str, Array], wave: Array) -> Array:
    """Gap function in doubles for parameter vectors and ``sin(f - psi1)``, stable form."""
    flat = v["n1"] ** 2 + v["n2"] ** 2
    deficit = 2.0 * np.sin(0.5 * v["alpha"]) ** 2 * flat / (flat + v["n3"] ** 2)
    ratio = v["l2"] / v["l3"] * np.sqrt(deficit * (2.0 - deficit)) * np.abs(wave)
    S = np.minimum(ratio, 1.0) if box.rod == "rigid" else ratio / np.hypot(1.0, ratio)
    C = np.sqrt((1.0 - S) * (1.0 + S))
    R, h, c = v["Rb"], 0.5 * v["Hb"], v["clearance"]
    if condition == "B":
        return np.asarray(h * S - c + (R + c) * S * S / (1.0 + C))
    saturated = (h * h - c * (2.0 * R + c)) / (np.hypot(R, h) + R + c)
    a = np.where(h * C >= R * S, h * S - c - R * S * S / (1.0 + C), saturated)
    if condition == "A":
        return np.asarray(a)
    with np.errstate(divide="ignore"):
        return np.minimum(a, (0.5 * v["hole_length"] * S - c + (R + c) * S * S / (1.0 + C)) / C)


def _corners(box: ToleranceBox, condition: str) -> tuple[float, int]:
    """Largest gap over the corners of the ranges that have a width, at the worst angle."""
    wide = [name for name in box.ranges if not box[name].is_point]
    signs = np.array(list(product((0, 1), repeat=len(wide)))).reshape(2 ** len(wide), len(wide))
    values = {name: np.full(len(signs), box[name].middle) for name in box.ranges}
    for column, name in enumerate(wide):
        ends = np.array([float(box[name].lower), float(box[name].upper)])
        values[name] = ends[signs[:, column]]
    return float(_gaps(box, condition, values, np.ones(len(signs))).max()), len(signs)
