"""Poses, functions and cognates: error against run time, where the linkage is known."""

from __future__ import annotations

import math
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.mechanism.model import Mechanism, TracePoint

_INPUTS = np.array([0.2, 1.1, 1.9, 3.0, 4.4])
#: Frame, crank, coupler and rocker.
_SIDES = (2.2, 1.0, 2.4, 2.3)


def five_poses(context: Any, effort: Effort) -> Problem:
    """Find crank and rocker of a four-bar from five poses of its coupler, beside Newton's method from random starts."""
    from graphsynth.design import dyads

    motion = Mechanism.four_bar(*_SIDES).simulate(_INPUTS)
    poses, pivots = motion.poses[:, 2], np.array([0.0, _SIDES[0]])
    found, *timed = best_of(lambda: dyads(poses), effort)
    why = "" if found.complete else "not all dyads are proved"
    more: dict[str, Any] = {"kind": "largest distance of a known pivot", "reference": "the four-bar"}
    error = _farthest(np.array([own.pivot for own in found]), pivots)
    rows = [Row.of("dyads", f"{len(found)} of at most 4", error, timed, why, proved=True, **more)]
    for starts in (1, 10, 100):
        begin = perf_counter()
        ends = _newton(poses, starts)
        error, spent = _farthest(ends, pivots), perf_counter() - begin
        why = "" if error < 1e-3 else "a known dyad is not among the roots found"
        rows.append(Row.of("fsolve (scipy)", f"{starts} random starts", error, (spent, 1), why, **more))
    note = "Only `dyads` says that there is no other one. Newton's method does not know when to stop."
    return Problem("five-poses", "Links that guide a body through five poses", "", tuple(rows), note=note)


def _farthest(found: Any, pivots: Any) -> float:
    """Largest distance of a known pivot, on the x axis, from the nearest found."""
    if not len(found):
        return math.inf
    places = np.asarray(found) @ [1.0, 1j]
    return float(np.abs(places - pivots[:, None]).min(axis=1).max())


def _newton(poses: Any, starts: int) -> Any:
    """Pivots of roots of the five-pose equations that scipy finds from random starts."""
    from scipy.optimize import fsolve

    z, u = poses[:, :2] @ [1.0, 1j], np.exp(1j * poses[:, 2])

    def equations(x: Any) -> Any:
        square = np.abs(z + u * complex(x[2], x[3]) - complex(x[0], x[1])) ** 2
        return square[1:] - square[0]

    rng, ends = np.random.default_rng(0), []
    for _ in range(starts):
        x, _, state, _ = fsolve(equations, 3.0 * rng.normal(size=4), full_output=True, xtol=1e-13)
        if state == 1:
            ends.append(x[:2])
    return np.array(ends)


def function_positions(context: Any, effort: Effort) -> Problem:
    """Find a four-bar again from three to five positions of its function."""
    from graphsynth.design import function_generators

    outputs = np.unwrap(Mechanism.four_bar(*_SIDES).simulate(_INPUTS).poses[:, 3, 2])
    rows = []
    for count, given in ((3, {"input_start": 0, "output_start": 0}), (4, {"output_start": 0}), (5, {})):
        starts = {name: (_INPUTS, outputs)[name == "output_start"][0] for name in given}
        asked = (_INPUTS - _INPUTS[0])[:count], (outputs - outputs[0])[:count]
        found, *timed = best_of(partial(function_generators, *asked, **starts), effort)
        known = np.array([_SIDES[1], _SIDES[3]]) / _SIDES[0]
        away = [np.abs([dyad.length for dyad in own.dyads] - known).max() for own in found]
        more = {"kind": "distance of crank and rocker", "reference": "the four-bar", "proved": True}
        why = "" if found.complete else "not all are proved"
        setting = f"{count} positions: {len(found)}"
        rows.append(Row.of("function_generators", setting, min(away, default=math.inf), timed, why, **more))
    question = "Four-bars whose output follows given angles"
    note = "The length of the frame is 1; with three and four positions starting angles are given."
    return Problem("function-positions", question, "", tuple(rows), note=note)


def cognates(context: Any, effort: Effort) -> Problem:
    """How far the curves of all cognates are from the given one."""
    from graphsynth.design import cognates as find

    watt = Mechanism.six_bar("watt", (2.0, 1.0, 2.5, 2.5), joint=(1.2, 0.8), link=2.6, output=2.2, pivot=(4.2, 0.5))
    cases = {"four-bar": Mechanism.four_bar(*_SIDES, coupler_point=(1.1, 0.9))}
    cases["six-bar with a point of its first coupler"] = Mechanism(
        watt.graph, watt.joints, watt.drivers, {"P": TracePoint(2, (0.7, 0.6))}, watt.pose
    )
    rows, inputs = [], np.linspace(0.2, 1.2, 11)
    for setting, mechanism in cases.items():
        found, *timed = best_of(partial(find, mechanism), effort)
        path = mechanism.simulate(inputs).point("P").position
        same = [own.mechanism.simulate(inputs).point("P").position for own in found if own.timed]
        error = max(float(np.abs(own - path).max()) for own in same) / float(np.ptp(path))
        setting = f"{setting}: {len(same)} of {len(found)}"
        more = {"kind": "largest distance over the size of the curve", "reference": "the given curve"}
        rows.append(Row.of("cognates", setting, error, timed, **more))
    note = "Those whose driver turns as the given one are compared at the same inputs."
    return Problem("cognates", "Other linkages that draw the same curve", "relative", tuple(rows), note=note)
