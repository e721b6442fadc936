"""What a four-bar survey says on the first screen: how many sets were looked at, kept, turned down and why, proved."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from graphsynth.pipeline.products import Finding, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.four_bar_survey import results as survey_results
from graphsynth.systems.four_bar_survey.order import edges_of
from graphsynth.systems.four_bar_survey.results import Certificate, Survey

__all__ = ["findings", "judge"]


def judge(
    context: Context, survey: Survey, certificates: tuple[Certificate, ...]
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the records and tables of the survey, the first table with the answer of the survey."""
    records, tables = survey_results.judge(context, survey, certificates)
    return records, (replace(tables[0], findings=findings(survey, certificates)), *tables[1:])


def findings(survey: Survey, certificates: tuple[Certificate, ...]) -> tuple[Finding, ...]:
    """Return the numbers of the survey and, in words, what was turned down and how sure all that is."""
    proved = Counter(certificate.free for certificate in certificates)
    found = [
        Finding("dimension sets looked at", value=_number(survey.sets)),
        Finding("keep all limits", value=_number(survey.passing)),
        Finding("of the best proved free", True if proved[True] else None, _number(proved[True])),
    ]
    if proved[False]:
        found.append(Finding("of the best proved to jam within the tolerances", False, _number(proved[False])))
    if proved[None]:
        found.append(Finding("of the best undecided", None, _number(proved[None])))
    if survey.failed:
        found.append(Finding("shards failed", False, _number(len(survey.failed))))
    return (*found, *_edge(survey), _turned_down(survey), _motion(survey))


def _edge(survey: Survey) -> list[Finding]:
    """Warn if the best set is at the edge of the lattice."""
    import numpy as np

    if not survey.chosen:
        return []
    lengths = survey.lattice.lengths(np.array(survey.chosen[:1]))[0].tolist()
    edges = edges_of(survey.lattice, lengths)
    if not edges:
        return []
    words = f"The best set is on the edge of the lattice ({', '.join(edges)} of its range)"
    return [Finding(f"{words}: better ones may lie beyond; widen the range.", False)]


def _number(count: int) -> str:
    """Group thousands with a thin space, as ISO 80000 does."""
    return f"{count:,}".replace(",", "\u202f")


def _turned_down(survey: Survey) -> Finding:
    counts = sorted(survey.turned_down.items(), key=lambda item: (-item[1], item[0]))
    reasons = "; ".join(f"{_number(count)} because {reason}" for reason, count in counts if count)
    total = sum(survey.turned_down.values())
    share = f"{100.0 * survey.passing / survey.sets:.3g} %" if survey.sets else "none"
    return Finding(
        f"Of {_number(survey.sets)} sets {_number(survey.passing)} ({share}) keep all limits. "
        f"Turned down: {_number(total)}{': ' + reasons if reasons else ''} (each counted at the first limit it misses)."
    )


def _motion(survey: Survey) -> Finding:
    """Compare the motion with the exact class, and say what rests on floating point."""
    agree = survey.disagreements == 0
    words = (
        "in every set the motion found is the one that whole numbers prove"
        if agree
        else f"in {_number(survey.disagreements)} sets the motion found is not the one that whole numbers prove"
    )
    return Finding(
        f"Whether a crank turns is decided exactly; {words}. The bearing is certified for the "
        f"{_number(len(survey.chosen))} best, tolerances included; for the others it is estimated in closed form.",
        None if agree else False,
    )
