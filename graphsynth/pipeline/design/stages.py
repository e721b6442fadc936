"""Stages from a task to a report: search, records, tables, pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.design.task.targets import FunctionTarget, LinkTarget, PathTarget, PosesTarget, SwingTarget, Target
from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Columns, Finding, Picture, Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.steps import read_mechanism

if TYPE_CHECKING:
    from graphsynth.design.task.answers import DesignedMechanism
    from graphsynth.design.task.search import Designs, Progress
    from graphsynth.design.task.task import DesignTask
    from graphsynth.drawing.plots import Line
    from graphsynth.drawing.shapes import Shape
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.pipeline.design.tables import DesignTable

#: Frames of a picture in motion; answers in one chart.
_FRAMES, _CURVES = 90, 3
_WIDE, _HIGH = 460.0, 400.0
#: Reasons, of `faults`, against a motion over the whole range, and against one branch.
_STOPS = ("the range is not completed", "not closed after the turn")
_CHANGES = ("the range is not completed", "two assembly modes meet or nearly meet", "an assembly mode changes")
#: Distance of the bounds of the misalignment that is forgiven, and the time of its proof.
_GAP, _SECONDS = 0.02, 5.0


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

    last: list[tuple[DesignedMechanism, ...]] = [()]

    def progress(p: Progress) -> None:
        if own.kept and p.answers != last[0]:
            last[0] = p.answers
            write_mechanisms([answer.mechanism for answer in p.answers], context.scene.folder / own.kept)
        if told is not None:
            told(f"search: {p.pieces} pieces, best {p.error:.2g} tolerances, {p.accepted} accepted")

    try:
        return design(
            own.task(),
            seconds=own.seconds,
            processor_seconds=own.processor_seconds,
            count=own.answers,
            seed=context.scene.scene.seed,
            executor=context.executor,
            starts=starts,
            progress=progress,
        )
    except GeometryError as error:
        raise (context.scene.place / "mechanism").error(f"asks for what cannot be: {error}") from error


def write_mechanisms(mechanisms: Sequence[Mechanism], folder: Path) -> list[Path]:
    """Write ``mechanism-1.toml`` and so on, and remove those of an earlier search beyond; return the files."""
    from graphsynth.formats.registry import write

    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"mechanism-{place}.toml" for place in range(1, len(mechanisms) + 1)]
    for mechanism, file in zip(mechanisms, files, strict=True):
        write(mechanism, file)
    for old in {*folder.glob("mechanism-*.toml")} - {*files}:
        old.unlink()
    return files


def records(context: Context, designs: Designs) -> tuple[Record, ...]:
    """Return a record for every answer, the best first."""
    found = []
    for number, answer in enumerate(designs.answers, 1):
        proof = "its motion is certified" if answer.certified else "its motion is estimated"
        margins = (
            *(
                Quantity.of_si(f"error of the {name}", error, "deg" if angular else "")
                for name, error, angular in zip(_titles(designs), answer.errors, _angular(designs))
            ),
            exact("links", answer.links),
            Quantity("size", answer.size),
            Quantity.of_si("transmission angle", answer.transmission, "deg"),
            Quantity("length ratio", answer.ratio),
        )
        if math.isfinite(answer.jam_margin):
            margins = (*margins, Quantity("margin of binding", answer.jam_margin, "", "certified"))
        if answer.accepted and (layers := _layers(answer.motion)[0]):
            margins = (*margins, Quantity("layers of sheets", layers))
        words = f"does the task, {proof}" if answer.accepted else "does not do the task"
        reason = "; ".join(answer.reasons)
        found.append(
            Record(number, answer.key, "", verdict=words, good=answer.accepted, margins=margins, reason=reason)
        )
    return tuple(found)


def tables(context: Context, designs: Designs) -> tuple[Table, ...]:
    """Return the ranked answers, what is proved of them, and why others were rejected."""
    errors = (
        f"error of the {name} [°] | .2g" if angular else f"error of the {name} | .2g"
        for name, angular in zip(_titles(designs), _angular(designs))
    )
    columns = ("place", "links", "sliders", *errors, "transmission [°] | .1f", "size | .4g", "does the task")
    rows = [
        (
            str(place),
            str(a.links),
            str(sum(joint.kind == "P" for joint in a.mechanism.joints)),
            *a.errors,
            a.transmission,
            a.size,
            "; ".join(("yes", *map("misses the wish {}".format, a.wishes))) if a.accepted else "; ".join(a.reasons),
        )
        for place, a in enumerate(designs.answers, 1)
    ]
    answers = Finding(f"{designs.statement[:1].upper()}{designs.statement[1:]}.", designs.accepted)
    note = "Errors are the largest over each target; of paths and poses over their size. Simulated anew, estimated."
    found = [table("Answers", columns, rows, note, answers)]
    if designs.answers:
        found.append(_verdicts(designs))
    if designs.rejected:
        reasons = [(reason, str(count)) for reason, count in designs.rejected.items()]
        found.append(table("Why others were rejected", ("reason", "how often"), reasons))
    return tuple(found)


def _verdicts(designs: Designs) -> Table:
    """Say of every answer whether it turns, stays on its branch, and how much misalignment its joints forgive."""
    task, rows = designs.task, []
    for place, answer in enumerate(designs.answers, 1):
        proof = answer.certificate
        proved = proof is not None and proof.certified
        whole = task.drive == "rotation"
        turns = proved and (not whole or (proof is not None and proof.closed))
        drive = _known("turns fully" if whole else "moves over its range", turns, answer, _STOPS)
        row: list[object] = [str(place), drive, _known("one branch", proved, answer, _CHANGES)]
        row += [_forgiven(designs, answer)] if not task.linear else []
        layers, collision = _layers(answer.motion) if answer.accepted else (0, "")
        rows.append([*row, f"{layers} layer{'s' * (layers > 1)}" if layers else collision and f"none: {collision}"])
    columns = ["place", "drive", "branch"] + (["forgives a tilted axis [°] | .2f"] if not task.linear else [])
    columns.append("as sheets")
    note = "Proved: over the whole range, between the samples too, for the dimensions as they are. As sheets: layers "
    note += "above the board in which nothing collides, estimated for the sizes that graphsynth parts takes by itself. "
    if not task.linear:
        tilt = f"Tilt of the driver's axis that the joints can share if each tilts by {_degrees(task.joint_tilt)}"
        note += f"{tilt}, certified for small tilts."
    return table("Verdicts", columns, rows, note.strip())


def _known(what: str, proved: bool, answer: DesignedMechanism, against: tuple[str, ...]) -> str:
    """Say that something holds, and how that is known; or what tells against it."""
    wrong = next((reason for reason in answer.reasons if reason in against), "")
    return wrong or f"{what}, {'proved' if proved else 'estimated'}"


@lru_cache(maxsize=100)
def _layers(motion: Motion) -> tuple[int, str]:
    """Return in how many layers above the board links can be sheets, else 0 and what would collide first."""
    from graphsynth.design.parts.api import parts

    try:
        return max(parts(motion, prove=False).layers), ""
    except GeometryError as error:
        return 0, str(error).partition(";")[0].partition(" at input")[0].rpartition(": ")[2]


def _forgiven(designs: Designs, answer: DesignedMechanism) -> float | None:
    """Return the tilt of the driver's axis at which joints begin to bind, a certified lower bound; None if rejected."""
    from graphsynth.jamming.questions import largest_scale

    task = designs.task
    if task.misalignment is not None and math.isfinite(answer.jam_margin):
        return answer.jam_margin * task.misalignment
    if not answer.accepted:
        return None
    unit = task.joint_tilt
    return unit * largest_scale(answer.motion, task.joint_tilt, unit, relative_gap=_GAP, seconds=_SECONDS).low


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.3g}°"


def _titles(designs: Designs) -> list[str]:
    """Name every target; numbers tell those of one kind apart."""
    kinds = [type(target).__name__.removesuffix("Target").lower() for target in designs.task.targets]
    return [kind if kinds.count(kind) == 1 else f"{kind} {kinds[: k + 1].count(kind)}" for k, kind in enumerate(kinds)]


def _angular(designs: Designs) -> list[bool]:
    """Whether the error of every target is an angle: not over a size, nor a length of a slider."""
    return [
        not isinstance(target, PathTarget | PosesTarget) and not getattr(target, "slides", False)
        for target in designs.task.targets
    ]


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
    errors = ", ".join(
        f"{name} {_degrees(error) if angular else format(error, '.2g')}"
        for name, error, angular in zip(_titles(designs), answer.errors, _angular(designs))
    )
    motion = "certified" if answer.certified else "estimated"
    links = ", ".join(f"{name}: link {link}{_swing(designs, answer, name)}" for name, link in answer.carriers.items())
    figures = f"Smallest transmission angle {_degrees(answer.transmission)}, size {answer.size:.3g}; motion {motion}"
    wanted = "Orange: what is wanted. " if _drawn_targets(designs) else ""
    return f"{wanted}Errors: {errors}. {figures}. {links[:1].upper()}{links[1:]}."


def _swing(designs: Designs, answer: DesignedMechanism, name: str) -> str:
    """How far a link turns or slides on the frame, or against another one, if a target names it."""
    own = (t for t in designs.task.targets if isinstance(t, LinkTarget) and t.link == name)
    if (target := next(own, None)) is None:
        return ""
    against = f" against {target.base}" if target.base else ""
    way = f"{np.ptp(_output(designs, answer, target)):.4g}"
    return f", which {f'slides by {way}' if target.slides else f'turns through {way}°'}{against}"


def _drawn_targets(designs: Designs) -> tuple[Shape, ...]:
    """Return the targets that have places, to be drawn behind the mechanism."""
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
    from graphsynth.drawing.plots import Chart, Line

    found, task = [], designs.task
    unit = 1.0 if task.linear else math.degrees(1.0)
    for name, target in zip(_titles(designs), task.targets):
        wanted = list(_wanted(target, unit, task.span))
        lines, point = [], str(getattr(target, "point", ""))
        for k, answer in enumerate(designs.answers[:_CURVES]):
            if point:
                x, y = answer.motion.point(point).position.T
            elif isinstance(target, LinkTarget):
                x, y = unit * answer.motion.inputs, _output(designs, answer, target)
                y = y - (y.min() if isinstance(target, SwingTarget) else y[0])
            lines.append(Line(x, y, f"place {k + 1}", "acd"[k]))
        output = "output" if getattr(target, "slides", False) else "output [°]"
        labels = ("x", "y") if point else ("part of the stroke" if task.linear else "input [°]", output)
        chart = Chart([*lines, *wanted], *labels, equal=bool(point), size=(5.4, 3.8))
        said = "Dashed: what is wanted, over the best answers." if wanted else "The best answers over the input."
        if isinstance(target, SwingTarget) and wanted:
            said = "Dashed: the least and the most that is wanted; the best answers from their lowest place on."
        found.append(Picture(f"Target and answers: {name}", chart.svg(), said))
    return tuple(found) if designs.answers else ()


def _output(designs: Designs, answer: DesignedMechanism, target: LinkTarget) -> NDArray[np.float64]:
    """Angle of the link of a target in degrees, or the way of a slider."""
    from graphsynth.design.task.answers import output, pair_of

    values, _ = output(answer.motion, *pair_of(target, answer.mechanism, answer.carriers))
    if not target.slides:
        return np.degrees(values)
    way = values - values[0]
    return np.asarray(way * np.sign(way[np.abs(way).argmax()] or 1.0))


def _wanted(target: Target, unit: float, span: float) -> Iterator[Line]:
    """Yield the lines of a target over its points, or over inputs in a unit; none for dwells and free starts."""
    from graphsynth.drawing.plots import Line

    scale = 1.0 if getattr(target, "slides", False) else math.degrees(1.0)
    if isinstance(target, PathTarget | PosesTarget):
        z = target.goal
        z = np.append(z, z[0]) if isinstance(target, PathTarget) and target.closed else z
        yield Line(z.real, z.imag, "target", "jam", "--")
    elif isinstance(target, FunctionTarget) and not target.own_start and target.inputs is not None:
        outputs = scale * np.array(target.outputs)
        yield Line(unit * np.array(target.inputs), outputs - outputs[0], "target", "jam", "--")
    elif isinstance(target, SwingTarget):
        for limit, label in ((target.least, "least"), (target.most, "most")):
            if 0.0 < limit < math.inf:
                yield Line([0.0, unit * span], [scale * limit] * 2, label, "jam", "--")


def mechanisms(context: Context, designs: Designs) -> Columns:
    """Lay out the answers, each in the JSON of ``Mechanism.from_json``."""
    texts = [answer.mechanism.to_json() for answer in designs.answers]
    keys = [answer.key for answer in designs.answers]
    return Columns("mechanisms", {"place": list(range(1, len(texts) + 1)), "key": keys, "mechanism": texts})
