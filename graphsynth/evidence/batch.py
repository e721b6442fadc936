"""Positions of many dimension sets at once: the batch engine beside one set after another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from graphsynth.evidence.position import NODES, Closed, four_bar, precise_points
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism

__all__ = ["batch_problem"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_Made = tuple[Mechanism, Closed]
_POSITIONS = 6 * NODES + 1
_KIND = "largest distance from the reference over the longest link"


def batch_problem(crank: float, largest: float, effort: Effort | None = None) -> Problem:
    """Move crank-rockers with one crank and other lengths up to ``largest``, at 73 crank angles each.

    Parameters
    ----------
    crank, largest : float
        In one unit; ``largest`` is at least four cranks.
    effort : Effort, optional

    Examples
    --------
    >>> problem = batch_problem(1.0, 5.0, Effort(rounds=1, quick=True))
    >>> max(row.error for row in problem.rows) < 1e-13
    True
    """
    effort = effort or Effort()
    linkages = _crank_rockers(crank, largest, 4 if effort.quick else 12)
    f = np.linspace(0.0, math.tau, _POSITIONS)
    made = [four_bar(linkage) for linkage in linkages]
    nodes = f[:: (_POSITIONS - 1) // NODES]
    truth = np.array([precise_points(mechanism, nodes) for mechanism, _ in made])
    size = np.array([max(linkage.l1, linkage.l3, linkage.l4) for linkage in linkages])
    rows = []
    for sets in (len(made), 40, 400) if effort.quick else (1, len(made), 240, 2400, 24_000):
        for rates in (False, True):
            name = "batch engine" + (" with derivatives" if rates else "")
            run = partial(_batch, [m for m, _ in made], f, sets, rates)
            found, seconds, rounds = best_of(run, effort)
            rows.append(_row(name, f"{sets} sets", found, truth, size, seconds / (sets * len(f)), rounds))
    for name, each in (("engine, set by set", _engine), ("closed form, set by set", _closed)):
        for count in (1, len(made) // 2, len(made)):
            found, seconds, rounds = best_of(partial(each, made[:count], f), effort)
            rows.append(_row(name, f"{count} sets", found, truth, size, seconds / (count * len(f)), rounds))
    question = f"Positions of crank-rockers of many dimensions, {len(f)} crank angles each"
    return Problem("many-sets", question, "relative", tuple(rows), "position")


def _crank_rockers(crank: float, largest: float, count: int) -> list[TiltedFourBar]:
    """Draw crank-rockers well away from change points, always the same ones."""
    random = np.random.default_rng(0)
    found: list[TiltedFourBar] = []
    while len(found) < count:
        l1, l3, l4 = random.uniform(1.2 * crank, largest, 3)
        sides = sorted((l1, l3, l4))
        if crank + sides[2] < sides[0] + sides[1] - 0.05 * crank:
            found.append(TiltedFourBar(float(l1), crank, float(l3), float(l4)))
    return found


def _batch(mechanisms: list[Mechanism], f: Array, sets: int, rates: bool) -> Complex:
    from graphsynth.kinematics.simulation import simulate_batch

    dimensions = np.stack([mechanisms[k % len(mechanisms)].dimensions for k in range(sets)])
    found = simulate_batch(mechanisms[0], f, dimensions, rates=rates, keep=(3,))
    # joint B is the end of the rocker, link 3
    x, y, cosine, sine = np.moveaxis(found.frames[: len(mechanisms), :, 0], -1, 0)
    ends = np.array([_end(mechanism) for mechanism in mechanisms])[: len(x), None]
    return np.asarray(x + 1j * y + ends * (cosine + 1j * sine))


def _end(mechanism: Mechanism) -> float:
    """Length of the rocker, link 3."""
    joint = next(joint for joint in mechanism.joints if joint.pair == (2, 3))
    assert isinstance(joint, Revolute)
    return joint.at_b[0]


def _engine(made: Sequence[_Made], f: Array) -> Complex:
    from graphsynth.kinematics.simulation import simulate

    found = []
    for mechanism, _ in made:
        pose = simulate(mechanism, f).poses[:, 3]
        found.append(pose[:, 0] + 1j * pose[:, 1] + _end(mechanism) * np.exp(1j * pose[:, 2]))
    return np.array(found)


def _closed(made: Sequence[_Made], f: Array) -> Complex:
    return np.array([closed(f) for _, (_, closed) in made])


def _row(method: str, setting: str, found: Complex, truth: Complex, size: Array, seconds: float, rounds: int) -> Row:
    nodes = found[:, :: (_POSITIONS - 1) // NODES]
    error = float((np.abs(nodes - truth[: len(found)]) / size[: len(found), None]).max())
    lost = not math.isfinite(error)
    return Row(
        method, setting, error, seconds, rounds, _KIND, "Newton's method with 50 digits on the joint equations",
        RowStatus.FAILED if lost else RowStatus.OK, "a set stopped" if lost else "",
    )  # fmt: skip
