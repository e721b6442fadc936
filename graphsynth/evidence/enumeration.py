"""Enumeration: time against the number of graphs, its growth, and what that says of larger questions.

Results are exact, so the error is a count: what was found minus the number published, by programs that are not ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.rows import Effort, Problem, Row, best_of

#: Planar kinematic chains of mobility 1 by links: The On-Line Encyclopedia of Integer Sequences, A233288.
PUBLISHED: Mapping[int, int] = {4: 1, 6: 2, 8: 16, 10: 230, 12: 6856, 14: 318_162, 16: 19_819_281, 18: 1_535_380_884}
_GRAPHS = "graphs"
_NOTE = (
    "Measured on kinematic chains of mobility 1, whose counts are published, and not on the question of the scene. "
    "Extrapolations assume one process, and that the law continues."
)


@dataclass(frozen=True)
class Growth:
    """Power law ``seconds = factor * graphs ** exponent`` through the largest runs.

    `spread` is the largest ratio between a run and the law (1: all on the line), `rows` the number of runs used.
    """

    exponent: float
    factor: float
    spread: float
    rows: int

    def seconds(self, graphs: float) -> float:
        """Return the time that the law gives for a number of graphs (extrapolated beyond the largest run)."""
        return float(self.factor * graphs**self.exponent)


def growth(graphs: Sequence[float], seconds: Sequence[float], least: float = 100.0) -> Growth | None:
    """Fit a power law by least squares of the logarithms, to runs of ``least`` graphs and more; None below two runs.

    Examples
    --------
    >>> law = growth([100, 1000, 10_000], [0.01, 0.1, 1.0])
    >>> round(law.exponent, 12), round(law.seconds(1e6), 9)
    (1.0, 100.0)
    """
    import numpy as np

    pairs = [(math.log(n), math.log(t)) for n, t in zip(graphs, seconds) if n >= least and t > 0.0]
    if len(pairs) < 2:
        return None
    x, y = np.array(pairs).T
    slope, offset = np.polyfit(x, y, 1)
    spread = float(np.exp(np.abs(y - slope * x - offset).max()))
    return Growth(float(slope), math.exp(float(offset)), spread, len(pairs))


def enumeration_problem(effort: Effort | None = None) -> Problem:
    """Count and list the kinematic chains of mobility 1, by links; fit the growth and extrapolate.

    Examples
    --------
    >>> problem = enumeration_problem(Effort(rounds=1, quick=True))
    >>> {row.error for row in problem.rows}, problem.count
    ({0.0}, 'graphs')
    """
    from graphsynth.synthesis import count_chains, enumerate_chains

    effort = effort or Effort()
    links = (6, 8, 10, 12) if effort.quick else (8, 10, 12, 14, 16)
    rows: list[Row] = []
    laws = {}
    for method, run, most in (
        ("count", count_chains, links),
        ("list as graphs", lambda n: sum(1 for _ in enumerate_chains(n)), links[:-1]),
    ):
        own = [_row(method, run, n, effort) for n in most]
        rows += own
        laws[method] = _law(method, own)
    question = "Kinematic chains of mobility 1: time against their number"
    found = Problem("enumeration", question, "graphs", tuple(rows), "enumeration", _NOTE, _GRAPHS)
    return replace(found, sentences=laws)


def _row(method: str, run: Callable[[int], int], links: int, effort: Effort) -> Row:
    found, *timed = best_of(lambda: run(links), effort, warm=links < 14)  # the small ones have compiled it all
    wrong = float(abs(found - PUBLISHED[links]))
    why = f"{found} instead of {PUBLISHED[links]}" if wrong else ""
    more: dict[str, Any] = {"kind": "difference from the published number", "reference": "OEIS A233288"}
    more["more"] = {_GRAPHS: float(found), "graphs per second": found / timed[0]}
    return Row.of(method, f"{links} links", wrong, timed, why, **more)


def _law(method: str, rows: Sequence[Row]) -> str:
    """State the growth law, and what it says of the next numbers of links."""
    law = growth([row.more[_GRAPHS] for row in rows], [row.seconds for row in rows])
    if law is None:
        return f"{method}: too few large runs for a growth law."
    top = max(rows, key=lambda row: row.more[_GRAPHS])
    ahead = [n for n in PUBLISHED if PUBLISHED[n] > top.more[_GRAPHS]][:2]
    said = ", ".join(f"{n} links ({PUBLISHED[n]:.3g} graphs): {seconds_text(law.seconds(PUBLISHED[n]))}" for n in ahead)
    return (
        f"{method}: {top.more[_GRAPHS]:.3g} graphs ({top.setting}) in {seconds_text(top.seconds)}; time ~ "
        f"graphs^{law.exponent:.2f}, within a factor {law.spread:.2g} of {law.rows} runs"
        + (f"; extrapolated: {said}" if said else "")
        + "."
    )


def of_scene(context: Any, effort: Effort) -> Problem:
    """Measure time against the number of graphs, for a scene with a structural question."""
    return enumeration_problem(effort)
