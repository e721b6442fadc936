"""How likely the bearings of a planar mechanism bind, with proof, and which grades are worth their cost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphsynthError
from graphsynth.intervals.reading import shortened
from graphsynth.pipeline.display import table
from graphsynth.pipeline.planar.stages import Moved, Part, bearings_of
from graphsynth.pipeline.planar.tables import BearingsTable, RiskTable
from graphsynth.pipeline.products import Finding, Outcome, Picture, Quantity, Table
from graphsynth.pipeline.stages import Context

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.parameters import Range
    from graphsynth.jamming.chance.allocation import Grade
    from graphsynth.jamming.chance.distributions import Distribution
    from graphsynth.jamming.margins.margin import JointsMargin

#: Wall time is no limit of a scene: what it says may not depend on the machine.
_NEVER = 1e9
_CONFIDENCE = 0.999


def risk(context: Context, moved: Moved) -> tuple[Part, dict[str, Any]]:
    """Enclose the probability of binding, what each tolerance does to it, and buy grades; plain values."""
    from graphsynth.jamming.chance.allocation import pareto_curve
    from graphsynth.jamming.chance.probability import probability_of_jamming
    from graphsynth.jamming.margins.margin import joints_margin

    own: RiskTable = context.scene.mechanism.risk
    bearings: BearingsTable = context.scene.mechanism.bearings
    limits, tilt, parts = bearings_of(bearings, moved.motion.mechanism)
    margin = joints_margin(moved.motion, limits, tilt, parts, condition=bearings.condition)
    given = {name: _distribution(own.distribution, value) for name, value in margin.ranges.items()}
    grades = _grades(context, margin, own)
    found = probability_of_jamming(margin, given, width=own.width, seconds=_NEVER, samples=own.samples)
    changes = found.sensitivities(width=own.width, seconds=_NEVER).rows if own.sensitivities else ()
    curve = pareto_curve(margin, grades, own.allowed, given, seconds=_NEVER, trials=own.trials) if grades else None
    bought = curve.points if curve is not None else ()
    proved = [min(own.upper for own in bought if own.choice == one.choice) for one in bought]
    drawn = found.samples
    values = {
        "model": found.model,
        "lower": found.lower,
        "upper": found.upper,
        "samples": None if drawn is None else (drawn.binding, drawn.count, drawn.lower, drawn.upper),
        "quantities": [_row(name, value, given[name]) for name, value in margin.ranges.items()],
        "changes": [tuple(row) for row in changes],
        "bought": [
            (
                one.allowed,
                one.cost,
                upper,
                one.cheapest,
                {name: grade.name for name, grade in one.choice.items()},
            )
            for one, upper in zip(bought, proved)
        ],
    }
    upper = Quantity("probability of binding, at most", found.upper, "", "certified", found.upper - found.lower)
    words = f"made within its tolerances it binds with a probability of {_between(found.lower, found.upper)} (proved)"
    if found.upper == 0.0:
        words = "made within its tolerances it never binds (proved)"
    return Part(words, True if found.upper == 0.0 else None, (upper,)), values


def _distribution(kind: str, support: Any) -> Distribution:
    from graphsynth.jamming.chance.distributions import Distribution

    if support.is_point:
        return Distribution("uniform", support)
    return {"uniform": Distribution.uniform, "normal": Distribution.normal, "triangular": Distribution.triangular}[
        kind
    ](support)


def _grades(context: Context, margin: JointsMargin, own: RiskTable) -> dict[str, list[Grade]]:
    """Return the grades offered for each quantity; a `SceneError` refuses a quantity that does not exist."""
    from graphsynth.jamming.bearing.parameters import Range
    from graphsynth.jamming.chance.allocation import Grade
    from graphsynth.tolerances.iso286 import limit_deviations

    place = context.scene.place / "mechanism" / "risk" / "grades"
    sizes = {f"{a}-{b}": fit.partition(" ")[0] for (a, b), fit in _fits(context.scene.mechanism.bearings).items()}
    found: dict[str, list[Grade]] = {}
    for k, one in enumerate(own.grades):
        try:
            if one.quantity not in margin.ranges:
                raise GraphsynthError(f"there is no quantity {one.quantity!r}; use {', '.join(margin.ranges)}")
            if one.tolerance_class:
                limits = limit_deviations(one.tolerance_class, sizes[one.quantity.split(" ")[-1]])
                support = Range(limits.lower, limits.upper)
            else:
                support = Range.read(one.quantity, one.range)
            name = one.name or one.tolerance_class or str(support)
            found.setdefault(one.quantity, []).append(Grade(name, _distribution(own.distribution, support), one.cost))
        except GraphsynthError as error:
            raise (place / str(k)).error(f"offers what cannot be: {error}") from error
    return found


def _fits(bearings: BearingsTable) -> dict[tuple[int, int], str]:
    pairs: dict[tuple[int, int], str] = {}
    for own in bearings.tolerances:
        if own.fit is not None and own.joint is not None:
            pairs[min(own.joint), max(own.joint)] = own.fit
    return pairs


def _percent(value: float, side: int) -> str:
    """Return a probability rounded outward, in percent; a rare one as it is."""
    if 0.0 < value < 1e-4:
        return shortened(value, side, 3)
    return f"{shortened(100.0 * value, side, 3)} %"


def _row(name: str, value: Range, given: Distribution) -> tuple[str, str, str]:
    return name, f"{float(value.lower):.6g} to {float(value.upper):.6g}", given.kind


def _between(low: float, high: float) -> str:
    return f"{_percent(low, -1)} to {_percent(high, 1)}"


def tables(context: Context, risked: tuple[Outcome, ...]) -> tuple[Table, ...]:
    """Lay out what is proved of every candidate: the probability, what each tolerance does to it, what to buy."""
    several = len(risked) > 1
    found: list[Table] = []
    for outcome in risked:
        if outcome.status == "assessed":
            found += _of_one(outcome.products["risked"], f", candidate {outcome.number}" if several else "")
    return tuple(found)


def _of_one(values: Mapping[str, Any], whose: str) -> list[Table]:
    low, high = values["lower"], values["upper"]
    rows: list[tuple[str, ...]] = [("proved bounds", _between(low, high))]
    findings = []
    if values["samples"] is not None:
        binding, count, least, most = values["samples"]
        rows.append(("random members that bind", f"{binding} of {count}"))
        rows.append((f"their interval (Clopper and Pearson, {_CONFIDENCE:.1%})", _between(least, most)))
    note = f"Of {values['model']}. Random members, each solved by itself in floating point, stand beside it as a check."
    if values["bought"]:
        findings.append(_advice(values["bought"]))
    tables = [table(f"Probability of binding{whose}", ("what", "value"), rows, note, *findings)]
    units = (
        "Deviations of holes and shafts in mm, tilts in rad, lengths in m. A normal distribution is cut off at "
        "the ends of its range, at three standard deviations."
    )
    columns: tuple[str, ...] = ("quantity", "range", "distribution")
    tables.append(table(f"Toleranced quantities{whose}", columns, values["quantities"], units))
    if values["changes"]:
        lines = [(name, _between(a, b), _change(c, d)) for name, a, b, c, d in values["changes"]]
        columns = ("quantity", "probability with half its range", "change in percentage points")
        note = "Proved bounds; the most useful first. Both may contain no change at all: then more boxes would tell."
        tables.append(table(f"What each tolerance does{whose}", columns, lines, note))
    if values["bought"]:
        tables.append(_costs(values["bought"], whose))
    return tables


def _costs(bought: list[Any], whose: str) -> Table:
    """Lay out the choices of grades."""
    rows = []
    for allowed, cost, upper, cheapest, choice in bought:
        grades = ", ".join(f"{name} {grade}" for name, grade in choice.items())
        found = (f"{cost:g}", _percent(upper, 1)) if choice else ("none proved", "")
        rows.append((_asked(allowed), *found, "yes" if cheapest else "not proved", grades))
    columns = ("allowed", "cost", "proved at most", "cheapest of all", "grades")
    return table(f"What less risk costs{whose}", columns, rows, "Each choice is proved to keep what is allowed.")


def _asked(allowed: float) -> str:
    """Return a probability as it was asked for."""
    return f"{100.0 * allowed:.6g} %"


def _change(least: float, most: float) -> str:
    return f"{shortened(100.0 * least, -1, 3)} to {shortened(100.0 * most, 1, 3)}"


def _advice(bought: list[Any]) -> Finding:
    """Say what the strictest risk costs that was met."""
    met = [one for one in bought if one[4]]
    if not met:
        return Finding("No choice of the grades is proved to keep any of the risks allowed.", False)
    allowed, cost, upper, cheapest, choice = min(met, key=lambda one: one[0])
    grades = ", ".join(f"{name} {grade}" for name, grade in choice.items())
    words = "the cheapest choice" if cheapest else "the cheapest choice found"
    sure = "none binds" if upper == 0.0 else f"{_percent(upper, 1)} at most"
    return Finding(f"At most {_asked(allowed)} bind for a cost of {cost:g}, {words}: {grades} (proved: {sure}).", True)


def pictures(context: Context, risked: tuple[Outcome, ...]) -> tuple[Picture, ...]:
    """Draw cost over the proved probability of binding."""
    from graphsynth.jamming.chance.allocation import curve

    found = []
    for outcome in risked:
        if outcome.status != "assessed" or not (bought := outcome.products["risked"]["bought"]):
            continue
        chart = curve([(upper, cost) for _, cost, upper, _, choice in bought if choice])
        if chart is not None:
            text = (
                "Each mark is a choice of grades, its probability of binding proved; in between nothing can be bought"
            )
            found.append(
                Picture(
                    "Cost over risk" + (f", candidate {outcome.number}" if len(risked) > 1 else ""), chart.svg(), text
                )
            )
    return tuple(found)
