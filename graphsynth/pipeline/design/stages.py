"""Stages from a task to a report: search, records, tables, pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Columns, Finding, Picture, Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import read_mechanism

if TYPE_CHECKING:
    from graphsynth.design.task.answers import DesignedMechanism
    from graphsynth.design.task.search import Designs, Progress
    from graphsynth.design.task.targets import Target
    from graphsynth.design.task.task import DesignTask
    from graphsynth.drawing.plots import Line
    from graphsynth.drawing.shapes import Shape
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.pipeline.design.tables import DesignTable

#: Frames of a picture in motion; answers in one chart.
_FRAMES, _CURVES = 90, 3
_WIDE, _HIGH = 460.0, 400.0


def search(context: Context) -> Designs:
    """Find mechanisms for the task; a `SceneError` if it contradicts itself."""
    from graphsynth.design.curves.index import CurveIndex
    from graphsynth.design.task.search import design
    from graphsynth.design.task.starts import index_starts

    own: DesignTable = context.scene.mechanism
    told, place = context.told, context.scene.place / "mechanism"
    given = [read_mechanism(context, name, place / "begin" / str(k))[0] for k, name in enumerate(own.begin)]
    index = index_starts(CurveIndex(context.scene.folder / own.index)) if own.index else None

    def starts(task: DesignTask) -> list[Mechanism]:
        return [*given, *(index(task) if index is not None else ())]

    def progress(p: Progress) -> None:
        if told is not None:
            told(f"search: {p.pieces} pieces, best {p.error:.2g} tolerances, {p.accepted} accepted")

    try:
        return design(
            own.task(),
            seconds=own.seconds,
            count=own.answers,
            seed=context.scene.scene.seed,
            executor=context.executor,
            starts=starts,
            progress=progress,
        )
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"asks for what cannot be: {error}") from error


def records(context: Context, designs: Designs) -> tuple[Record, ...]:
    """Return a record for every answer, the best first."""
    found = []
    for number, answer in enumerate(designs.answers, 1):
        proof = "its motion is certified" if answer.certified else "its motion is estimated"
        margins = (
            *(Quantity(f"error {name}", e) for name, e in zip(_titles(designs), answer.errors)),
            exact("links", answer.links),
            Quantity("size", answer.size),
            Quantity.of_si("transmission angle", answer.transmission, "deg"),
            Quantity("length ratio", answer.ratio),
        )
        if math.isfinite(answer.jam_margin):
            margins = (*margins, Quantity("margin of binding", answer.jam_margin, "", "certified"))
        words = f"does the task, {proof}" if answer.accepted else "does not do the task"
        reason = "; ".join(answer.reasons)
        found.append(
            Record(number, answer.key, "", verdict=words, good=answer.accepted, margins=margins, reason=reason)
        )
    return tuple(found)


def tables(context: Context, designs: Designs) -> tuple[Table, ...]:
    """Return the ranked answers, and why others were rejected."""
    names = _titles(designs)
    columns = (
        "place",
        "links",
        "sliders",
        *(f"error {n} | .3g" for n in names),
        "transmission [°] | .1f",
        "size | .4g",
    )
    rows = [
        (
            str(place),
            str(a.links),
            str(sum(joint.kind == "P" for joint in a.mechanism.joints)),
            *a.errors,
            a.transmission,
            a.size,
            "certified" if a.certified else "estimated",
            "yes" if a.accepted else "; ".join(a.reasons),
        )
        for place, a in enumerate(designs.answers, 1)
    ]
    answers = Finding(f"{designs.statement[:1].upper()}{designs.statement[1:]}.", designs.accepted)
    note = "Errors are the largest over each target: of paths and poses over their size, else radians or lengths."
    found = [table("Answers", (*columns, "motion", "does the task"), rows, note, answers)]
    if designs.rejected:
        reasons = [(reason, str(count)) for reason, count in designs.rejected.items()]
        found.append(table("Why others were rejected", ("reason", "how often"), reasons))
    return tuple(found)


def _titles(designs: Designs) -> list[str]:
    """Name every target; numbers tell those of one kind apart."""
    kinds = [type(target).__name__.removesuffix("Target").lower() for target in designs.task.targets]
    return [kind if kinds.count(kind) == 1 else f"{kind} {kinds[: k + 1].count(kind)}" for k, kind in enumerate(kinds)]


def pictures(context: Context, designs: Designs) -> tuple[Picture, ...]:
    """Show the answers in motion over their targets."""
    from graphsynth.drawing.animation import animated_svg

    found = []
    for place, answer in enumerate(designs.answers, 1):
        title, behind = f"Place {place}: {answer.links} links", _drawn_targets(designs)
        svg = animated_svg(answer.motion, frames=_FRAMES, title=title, width=_WIDE, height=_HIGH, behind=behind)
        found.append(Picture(title, svg, _caption(designs, answer)))
    return tuple(found)


def _caption(designs: Designs, answer: DesignedMechanism) -> str:
    errors = ", ".join(f"{name} {error:.2g}" for name, error in zip(_titles(designs), answer.errors))
    degrees = math.degrees(answer.transmission)
    motion = "certified" if answer.certified else "estimated"
    links = ", ".join(f"{name}: link {link}" for name, link in answer.carriers.items())
    figures = f"Smallest transmission angle {degrees:.1f}°, size {answer.size:.3g}; motion {motion}"
    return f"Errors: {errors}. {figures}. {links[:1].upper()}{links[1:]}."


def _drawn_targets(designs: Designs) -> tuple[Shape, ...]:
    """Return the targets that have places, to be drawn behind the mechanism."""
    from graphsynth.design.task.targets import PathTarget, PosesTarget
    from graphsynth.drawing.shapes import Path, Style

    found: list[Shape] = []
    for target in designs.task.targets:
        if not isinstance(target, PathTarget | PosesTarget):
            continue
        z = tuple(target.goal.tolist())
        closed = isinstance(target, PathTarget) and target.closed
        found.append(Path((z,), Style("jam", 7.0, round_ends=True, fill_opacity=0.0), closed=closed, layer="trace"))
        if isinstance(target, PosesTarget):
            arm = 0.15 * target.size
            ends = tuple((p, p + arm * complex(math.cos(a), math.sin(a))) for p, (_, _, a) in zip(z, target.poses))
            found.append(Path(ends, Style("jam", 3.0, round_ends=True), layer="trace"))
    return tuple(found)


def curves(context: Context, designs: Designs) -> tuple[Picture, ...]:
    """Draw what the best answers do over what is wanted: paths, or angles of links over the input."""
    import numpy as np

    from graphsynth.drawing.plots import Chart, Line

    found, task = [], designs.task
    unit = 1.0 if task.linear else math.degrees(1.0)
    for name, target in zip(_titles(designs), task.targets):
        lines, point = list(_wanted(target, unit)), str(getattr(target, "point", ""))
        for k, answer in enumerate(designs.answers[:_CURVES]):
            if point:
                x, y = answer.motion.point(point).position.T
            else:
                link = answer.carriers[str(getattr(target, "link", ""))]
                x, y = unit * answer.motion.inputs, np.degrees(np.unwrap(answer.motion.poses[:, link, 2]))
                y = y - y[0]
            lines.append(Line(x, y, f"place {k + 1}", "acd"[k]))
        labels = ("x", "y") if point else ("part of the stroke" if task.linear else "input [°]", "output [°]")
        chart = Chart(lines, *labels, equal=bool(point), size=(5.4, 3.8))
        found.append(Picture(f"Target and answers: {name}", chart.svg(), "What is wanted dashed, the answers over it."))
    return tuple(found) if designs.answers else ()


def _wanted(target: Target, unit: float) -> Iterator[Line]:
    """Yield the line of a target over its points, or over inputs in a unit; none for strokes and free starts."""
    import numpy as np

    from graphsynth.design.task.targets import FunctionTarget, PathTarget, PosesTarget
    from graphsynth.drawing.plots import Line

    if isinstance(target, PathTarget | PosesTarget):
        z = target.goal
        z = np.append(z, z[0]) if isinstance(target, PathTarget) and target.closed else z
        yield Line(z.real, z.imag, "target", "jam", "--")
    elif isinstance(target, FunctionTarget) and not target.own_start and target.inputs is not None:
        outputs = np.degrees(np.array(target.outputs))
        yield Line(unit * np.array(target.inputs), outputs - outputs[0], "target", "jam", "--")


def mechanisms(context: Context, designs: Designs) -> Columns:
    """Lay out the answers, each in the JSON of ``Mechanism.from_json``."""
    texts = [answer.mechanism.to_json() for answer in designs.answers]
    keys = [answer.key for answer in designs.answers]
    return Columns("mechanisms", {"place": list(range(1, len(texts) + 1)), "key": keys, "mechanism": texts})
