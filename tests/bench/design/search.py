"""This package on a trial: the search for a given processor time, with every mechanism or with dyadic ones alone."""

from __future__ import annotations

import dataclasses
from time import process_time
from typing import Any

import numpy as np

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import (
    CurveIndex,
    DesignedMechanism,
    Designs,
    DesignTask,
    design,
    dyads,
    four_bars_for_poses,
    index_starts,
)
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import decompose
from tests.bench.design import measure
from tests.bench.design.four_bars import FourBar, of_mechanism
from tests.bench.design.tasks import Trial

#: Answers of one search, of four-bars and of longer chains, of which there are many; by how much the tolerance falls
#: from one search to the next; samples of a turn that is proved.
_COUNT, _TIGHTER, _PROVED = (1, 3), 0.5, 181
#: Curves of an index to begin with, for a second of the processor, and in how many searches.
_STARTS, _AGAIN = 12, 3
_FOREVER = 1e6


@dataclasses.dataclass(frozen=True)
class Result:
    """What one competitor found; ``transmission`` in degrees, ``seconds`` of the processor, ``curve`` to be drawn."""

    error: float
    certified: bool | None = None
    links: int = 4
    dyadic: bool = True
    transmission: float = float("nan")
    seconds: float = 0.0
    curve: Any = None
    note: str = ""


def dyadic(graph: Any, drivers: Any) -> bool:
    """Tell whether a mechanism is assembled dyad by dyad."""
    return decompose(graph, drivers).dyadic


def ours(trial: Trial, seconds: float, *, only_dyads: bool = False, index: CurveIndex | None = None) -> Result:
    """Search until the processor time is spent, ever tighter: each search begins with the best of the last one."""
    if trial.kind == "poses":
        return algebra(trial)
    begin, tolerance, seed = process_time(), trial.tolerance, 0
    best: tuple[float, DesignedMechanism | None] = (float("inf"), None)
    near: list[Mechanism] = []
    while (left := seconds - (process_time() - begin)) > 0.0 and best[0] > 1e-12:
        task = dataclasses.replace(trial.task(tolerance), dyads_only=only_dyads)
        if seed == 0 and index is not None:
            near = [*index_starts(index, int(min(_STARTS * seconds, 400)))(task)]
        given = ([] if best[1] is None else [best[1].mechanism]) + (near if seed < _AGAIN else [])

        def starts(_: DesignTask, given: list[Mechanism] = given) -> list[Mechanism]:
            return given

        count = _COUNT[max(task.links) > 4]
        try:
            found = design(task, seconds=_FOREVER, processor_seconds=left, seed=seed, count=count, starts=starts)
        except GeometryError as fault:  # no chain fits
            return Result(float("inf"), seconds=process_time() - begin, note=str(fault).partition(":")[0])
        for answer in found.answers:
            if answer.kept:
                error = measured(trial, answer)
                best = min(best, (error, answer), key=lambda pair: pair[0])
        if found.accepted:
            tolerance = max(min(tolerance * _TIGHTER, _TIGHTER * _near(found)), 1e-9)
        seed += 1
    return _result(trial, best[1], best[0], begin)


def algebra(trial: Trial) -> Result:
    """Return the four-bar through the poses that transmits best, of all for five, of some for fewer poses."""
    begin, poses = process_time(), trial.wanted
    if len(poses) == 3:
        links = [dyads(poses, pivot=(x, y))[0] for x in (-2.0, 0.0, 2.0) for y in (-2.0, 0.0, 2.0)]
        found = four_bars_for_poses(poses, links=links)
    else:
        found = four_bars_for_poses(poses, **({"count": 12} if len(poses) == 4 else {}))
    good = [one for one in found if not one.defects]
    if not good:
        return Result(float("inf"), seconds=process_time() - begin, note="all have defects")
    best = max(good, key=lambda one: one.transmission)
    proof, angle = best.certify(), float(np.degrees(best.transmission))
    error = of_four_bar(trial, of_mechanism(best.mechanism, "P"))
    return Result(error, proof.certified, 4, True, angle, process_time() - begin)


def _near(found: Designs) -> float:
    """Error of the best answer in its tolerance."""
    return min(answer.errors[0] for answer in found.answers if answer.accepted)


def _result(trial: Trial, answer: DesignedMechanism | None, error: float, begin: float) -> Result:
    if answer is None:
        return Result(float("inf"), seconds=process_time() - begin, note="none found within the bounds")
    span = trial.task(trial.tolerance).span
    proof = gs.certify(gs.simulate(answer.mechanism, np.linspace(0.0, span, _PROVED)), max_boxes=20_000, seconds=30.0)
    used = process_time() - begin
    dyads = dyadic(answer.mechanism.graph, [d.pair for d in answer.mechanism.drivers])
    curve = answer.motion.point("P").position @ [1.0, 1.0j] if "P" in answer.mechanism.points else None
    return Result(
        error, proof.certified, answer.links, dyads, float(np.degrees(answer.transmission)), used, curve,
        "" if proof.certified else str(proof.reason),
    )  # fmt: skip


def measured(trial: Trial, answer: DesignedMechanism) -> float:
    """Error of an answer by the common measure: a four-bar in closed form, other chains by their motion."""
    mechanism = answer.mechanism
    name = next(iter(mechanism.points), "")
    if mechanism.graph.links == 4 and all(joint.kind == "R" for joint in mechanism.joints):
        return of_four_bar(trial, of_mechanism(mechanism, name))
    if trial.kind == "curve":
        places = gs.simulate(mechanism, np.linspace(0.0, 2.0 * np.pi, 721)).point(name).position @ [1.0, 1.0j]
        return closed_curve(trial, places[:-1])
    if trial.kind == "foot":
        motion = gs.simulate(mechanism, np.asarray(trial.inputs))
        return float(np.abs(motion.point(name).position @ [1.0, 1.0j] - trial.goals).max())
    link = next(iter(answer.carriers.values()))
    if trial.kind == "cylinder":
        motion = gs.simulate(mechanism, np.linspace(0.0, 1.0, 101))
        return measure.function(np.unwrap(motion.poses[:, link, 2])[::25], trial.wanted)
    motion = gs.simulate(mechanism, np.linspace(0.0, 2.0 * np.pi, 1441))
    return measure.dwell(np.unwrap(motion.poses[:, link, 2]), *trial.wanted)


def closed_curve(trial: Trial, places: Any) -> float:
    """Chamfer distance of a closed curve from a letter, whose size is 1."""
    assert trial.goals is not None
    return float("inf") if np.isnan(places).any() else measure.chamfer(places, trial.goals, 1.0)


def of_four_bar(trial: Trial, bar: FourBar) -> float:
    """Error of a four-bar in closed form; infinite where it does not close."""
    turn = np.linspace(0.0, 2.0 * np.pi, 1441)
    if trial.kind == "curve":
        error = closed_curve(trial, bar.curve(turn[:-2:2]))
    elif trial.kind == "timed":
        error = measure.timed(bar.curve(trial.inputs), trial.goals)
    elif trial.kind == "foot":
        error = float(np.abs(bar.curve(trial.inputs) - trial.goals).max())
    elif trial.kind == "path":
        error = measure.passed(bar.curve, trial.goals)[0]
    elif trial.kind == "function":
        error = measure.function(bar.output(trial.inputs), trial.wanted)
    elif trial.kind == "poses":
        error = measure.posed(lambda u: _body(bar, u), trial.wanted)
    else:
        error = measure.stroke(bar, *trial.wanted) if bar.turns else float("inf")
    return error if np.isfinite(error) else float("inf")


def _body(bar: FourBar, inputs: Any) -> tuple[Any, Any]:
    a, b, p = bar.at(inputs)
    return p, (b - a) / bar.coupler
