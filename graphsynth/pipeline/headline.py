"""The answer of a run in a few sentences and numbers: what the first screen of the page and of the terminal says.

Which candidate is best and by what measure, how many were looked at, kept and turned down for which reasons, and how
sure all that is.  A stage may answer in its own words: findings of a `Table` come first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from graphsynth.pipeline.products import Finding, Quantity, Ranking, Record, Table

if TYPE_CHECKING:
    from graphsynth.pipeline.runner import Report

__all__ = ["facts", "sentences"]

#: Verdicts told in words; more are read in the tables.
_VERDICTS = 4
#: Reasons of rejection told in words; all are counted in a table of their own.
_REASONS = 3
#: Margins of a single record that are shown as numbers.
_MARGINS = 6


def sentences(report: Report) -> tuple[Finding, ...]:
    """Return the answer in words, the most important sentence first.

    Parameters
    ----------
    report : Report
        Of a run with the products ``records``, ``ranking`` or ``tables``; without them there is nothing to say.
    """
    records: tuple[Record, ...] = report.products.get("records", ())
    found = [told for ranking in _rankings(report) for told in _best(ranking, records)]
    given = [finding for finding in _given(report) if not finding.value]
    few = sum(record.status == "assessed" for record in records) <= _VERDICTS
    found += (_verdicts(records) if few or not given else []) + given
    found += _nothing_left(records) + (_turned_down(records) if len(records) > 1 else [])
    found += [told for ranking in _rankings(report) for told in _how_sure(ranking, records)]
    return tuple(found)


def facts(report: Report) -> tuple[Finding, ...]:
    """Return the numbers of the first screen: `Finding` with a value, what it counts, and its tone."""
    products = report.products
    found = [finding for finding in _given(report) if finding.value]
    records: tuple[Record, ...] = products.get("records", ())
    assessed = [record for record in records if record.status == "assessed"]
    others = [record for record in records if record.status not in ("assessed", "not recognised")]
    if len(assessed) == 1 and not others:
        found += [_margin(margin) for margin in assessed[0].margins[:_MARGINS]]
    plain = len(records) == len(assessed) == 1  # one answer: nothing was chosen from
    if "solutions" in products and not (plain and len(products["solutions"]) == 1):
        count = len(products["solutions"])
        found.append(Finding("integer solutions" if count != 1 else "integer solution", value=str(count)))
    if any(record.key for record in records) and not plain:
        found += _counts(records)
    found += [
        Finding("on the Pareto front", value=str(ranking.front_size)) for ranking in _rankings(report) if ranking.front
    ]
    return (*found, Finding("run time", value=f"{report.seconds:.1f} s"))


def _given(report: Report) -> Iterable[Finding]:
    """Yield what stages say themselves."""
    for value in report.products.values():
        for item in value if isinstance(value, tuple) else ():
            if isinstance(item, Table):
                yield from item.findings


def _rankings(report: Report) -> list[Ranking]:
    return [value for value in report.products.values() if isinstance(value, Ranking)]


def _counts(records: Sequence[Record]) -> list[Finding]:
    found = [Finding("candidate mechanisms" if len(records) > 1 else "candidate mechanism", value=str(len(records)))]
    words = (("assessed", None), ("not recognised", None), ("rejected", None), ("failed", False))
    for status, good in words:
        count = sum(record.status == status for record in records)
        if count or status == "assessed":
            found.append(Finding(status, good, str(count)))
    return found


def _margin(margin: Quantity) -> Finding:
    unit = margin.unit if margin.unit in ("", "°", "′", "″") else f" {margin.unit}"
    return Finding(f"{margin.name} ({margin.guarantee})", value=f"{margin.value:.4g}{unit}")


def _best(ranking: Ranking, records: Sequence[Record]) -> list[Finding]:
    """Name the first of the ranking, and the first one with a good verdict if that is another one."""
    if not ranking.numbers:
        return [Finding("Nothing is left to rank: no candidate has all objectives.", False)] if records else []
    by_number = {record.number: record for record in records}
    order = [by_number[number] for number in ranking.numbers if number in by_number]
    if not order:
        return []
    first = _one(ranking, order[0])
    count = ranking.ranked
    found = [
        Finding(f"Best of {count} ranked: {first}." if count > 1 else f"The only one left: {first}.", order[0].good)
    ]
    if order[0].good is not True:
        better = next((record for record in order if record.good), None)
        if better is not None:
            found.append(Finding(f"Best with a good verdict: {_one(ranking, better)}.", True))
        elif any(record.good is not None for record in order):
            found.append(Finding("None of the ranked candidates has a good verdict.", False))
    return found


def _one(ranking: Ranking, record: Record) -> str:
    """Describe a candidate: what it is, the values of the objectives with their places, its score, its verdict."""
    place = ranking.numbers.index(record.number)
    units = {margin.name: margin.unit for margin in record.margins}
    values = [
        f"{objective.quantity} {value:.4g}{' ' + units[objective.quantity] if units.get(objective.quantity) else ''}"
        f" ({_rank_word(ranking, k, place)})"
        for k, (objective, value) in enumerate(zip(ranking.objectives, ranking.values[place], strict=True))
    ]
    known = f", {record.solution}" if record.solution else ""
    weights = ":".join(f"{objective.weight:g}" for objective in ranking.objectives)
    weighed = f" with weights {weights}" if len(ranking.objectives) > 1 else ""
    verdict = f"; {record.verdict}" if record.verdict else ""
    return f"no. {record.number}{known}: {', '.join(values)}; score {ranking.scores[place]:.2f} of 1{weighed}{verdict}"


def _rank_word(ranking: Ranking, which: int, place: int) -> str:
    """Say how a value stands among all ranked ones: ``"least"``, ``"3rd greatest"``, ``"2nd nearest to 5"``."""
    objective, better = ranking.objectives[which], ranking.places[place][which]
    words = {"min": "least", "max": "greatest"}
    word = words[objective.goal] if isinstance(objective.goal, str) else f"nearest to {objective.goal:g}"
    return word if not better else f"{_ordinal(better + 1)} {word}"


def _ordinal(number: int) -> str:
    """Return a number as an ordinal.

    Examples
    --------
    >>> [_ordinal(n) for n in (1, 2, 3, 4, 11, 12, 13, 21, 112)]
    ['1st', '2nd', '3rd', '4th', '11th', '12th', '13th', '21st', '112th']
    """
    ending = {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ending}"


def _verdicts(records: Sequence[Record]) -> list[Finding]:
    """Tell each verdict once, with the number of candidates it holds for if there are several."""
    assessed = [record for record in records if record.status == "assessed" and record.verdict]
    counts = Counter((record.verdict, record.good) for record in assessed)
    several = len(assessed) > len(counts)
    found = [
        Finding(f"{count} of {len(records)}: {verdict}." if several else f"{verdict[:1].upper()}{verdict[1:]}.", good)
        for (verdict, good), count in counts.most_common(_VERDICTS)
    ]
    if len(counts) > _VERDICTS:
        rest = sum(counts.values()) - sum(count for _, count in counts.most_common(_VERDICTS))
        found.append(Finding(f"{rest} more with {len(counts) - _VERDICTS} other verdicts: see results.csv."))
    return found


def _nothing_left(records: Sequence[Record]) -> list[Finding]:
    """Say so when no candidate came through."""
    stopped = [record for record in records if record.status in ("rejected", "failed")]
    if not stopped or any(record.status == "assessed" for record in records):
        return []
    if len(records) > 1:
        return [Finding(f"None of the {len(records)} candidates came through all stages.", False)]
    words = "was rejected" if stopped[0].status == "rejected" else "failed"
    return [Finding(f"The only candidate {words}: {_ended(stopped[0].reason or stopped[0].cause)}", False)]


def _ended(text: str) -> str:
    return text if text.endswith(".") else f"{text}."


def _turned_down(records: Sequence[Record]) -> list[Finding]:
    """Count the reasons of those that were turned down."""
    causes = Counter(r.cause or r.reason for r in records if r.status in ("rejected", "failed"))
    if not causes:
        return []
    listed = [
        f"{count} because {cause}" for cause, count in sorted(causes.items(), key=lambda item: (-item[1], item[0]))
    ]
    more = f"; {len(listed) - _REASONS} more reasons" if len(listed) > _REASONS else ""
    total = sum(causes.values())
    if len(causes) == 1 and total > 1:
        return [
            Finding(f"Turned down: {total} of {len(records)}, all for the same reason: {_ended(next(iter(causes)))}")
        ]
    return [Finding(f"Turned down: {total} of {len(records)}: {'; '.join(listed[:_REASONS])}{more}.")]


def _how_sure(ranking: Ranking, records: Sequence[Record]) -> list[Finding]:
    """Say which of the objectives are proved and which are estimated."""
    ranked = set(ranking.numbers)
    kinds: dict[str, list[str]] = {}
    for objective in ranking.objectives:
        found = {m.guarantee for r in records if r.number in ranked for m in r.margins if m.name == objective.quantity}
        if found:
            weakest = next(kind for kind in ("estimated", "certified", "exact") if kind in found)
            kinds.setdefault(weakest, []).append(objective.quantity)
    words = {
        "exact": "exact",
        "certified": "certified (proved bounds)",
        "estimated": "estimated in floating point, not proved",
    }
    told = [f"{', '.join(names)}: {words[kind]}" for kind, names in kinds.items()]
    return [Finding(f"How sure: {'; '.join(told)}.")] if told else []
