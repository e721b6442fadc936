"""Motions of chains, with the dimensions that the catalogue holds or that are found now: one page for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.structure.graph import MechanismGraph

#: Frames and drivers tried, and searches for dimensions with each.
_CHOICES, _TRIES = 3, 4
#: Samples of a turn with stored dimensions.
_SAMPLES = 721


@dataclass(frozen=True, slots=True)
class MotionTask:
    """A chain to be shown in motion."""

    label: str
    key: str
    #: a mechanism of the chain with dimensions, as JSON, from the evaluations of the catalogue
    stored: str | None = None
    search: bool = True  # look for dimensions where none are stored, or where those stored do not turn


@dataclass(frozen=True, slots=True)
class ShownMotion:
    """A chain in motion."""

    label: str
    page: str  # HTML; empty where no dimensions were accepted
    mechanism: str  # the mechanism as TOML
    facts: dict[str, Any]  # frame, drivers, statement and figures for the page


def choice_of(chain: MechanismGraph, most: int) -> list[tuple[int, list[int]]]:
    """Return the best frames with their drivers, in the numbers of the chain.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> choice_of(MechanismGraph.from_key("1BAN4"), 1)
    [(0, [2])]
    """
    from graphsynth.kinematics.dimensional.design import choices

    found = []
    frames = {chain.with_frame(link): link for link in reversed(range(chain.links))}
    for inversion, pairs in choices(chain, None)[:most]:
        frame = frames[inversion]
        # with_frame() moves the frame to the front and keeps the order of the rest
        own = [frame, *(link for link in range(chain.links) if link != frame)]
        found.append((frame, [own[link] for _, link in pairs]))
    return found


def motion_of(task: MotionTask) -> ShownMotion:
    """Show a chain moving, with stored dimensions or with such as are found; the numbers of the links are the key's.

    Deterministic.  Where nothing is accepted the page is empty and the statement says why.
    """
    shown = _stored(task) if task.stored is not None else None
    if shown is None and not task.search:
        return ShownMotion(task.label, "", "", {"statement": "those of the catalogue make no full turn"})
    return shown or _searched(task.label, task.key)


def _stored(task: MotionTask) -> ShownMotion | None:
    """Move the mechanism of the catalogue through a turn; None if it is of another chain or does not turn."""
    import numpy as np

    from graphsynth.core.errors import GraphsynthError
    from graphsynth.kinematics.dimensional.verify import length_ratio, smallest_transmission
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    try:
        mechanism = Mechanism.from_json(task.stored or "")
        if mechanism.graph.without_frame() != MechanismGraph.from_key(task.key) or not mechanism.drivers:
            return None
        motion = simulate(mechanism, np.linspace(0.0, 2.0 * np.pi, _SAMPLES))
    except GraphsynthError:
        return None
    if not motion.completed:
        return None
    figures = smallest_transmission(motion), length_ratio(mechanism)
    return _shown(task.label, motion, "dimensions of the catalogue", *figures)


def _shown(label: str, motion: Motion, statement: str, transmission: float, ratio: float) -> ShownMotion:
    from graphsynth.drawing.animation import animation_html
    from graphsynth.drawing.frames import with_trace_points

    mechanism = motion.mechanism
    page = animation_html(with_trace_points(motion), frames=90, title=f"Chain {label}")
    frame = mechanism.graph.frame
    facts = {
        "frame": frame,
        "drivers": [driver.link if driver.base == frame else driver.base for driver in mechanism.drivers],
        "statement": statement,
        "transmission": round(float(transmission), 4),
        "ratio": round(float(ratio), 3),
    }
    return ShownMotion(label, page, mechanism.to_toml(), facts)


def _searched(label: str, key: str) -> ShownMotion:
    from graphsynth.core.errors import GraphError
    from graphsynth.kinematics.dimensional import embody
    from graphsynth.structure.graph import MechanismGraph

    chain = MechanismGraph.from_key(key)
    statement = ""
    try:
        found_choices = choice_of(chain, _CHOICES)
    except GraphError as error:
        return ShownMotion(label, "", "", {"statement": str(error)})
    for frame, drivers in found_choices:
        framed = MechanismGraph(chain.links, chain.joints, frame=frame)
        found = embody(framed, driver=[(frame, link) for link in drivers], tries=_TRIES)
        statement = statement or found.statement
        if found.accepted and found.motion is not None and found.figures is not None:
            figures = found.figures.transmission_angle, found.figures.length_ratio
            return _shown(label, found.motion, found.statement, *figures)
    return ShownMotion(label, "", "", {"statement": statement})
