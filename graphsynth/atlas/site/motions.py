"""Motions of chains with dimensions found for them: one page with a player for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["ShownMotion", "choice_of", "motion_of"]

#: Frames and drivers tried, and searches for dimensions with each.
_CHOICES, _TRIES = 3, 4


@dataclass(frozen=True, slots=True)
class ShownMotion:
    """A chain in motion.

    Parameters
    ----------
    label : str
    page : str
        HTML; empty where no dimensions were accepted.
    mechanism : str
        The mechanism as TOML.
    facts : dict
        Frame, drivers, statement and figures for the page.
    """

    label: str
    page: str
    mechanism: str
    facts: dict[str, Any]


def choice_of(chain: MechanismGraph, most: int) -> list[tuple[int, list[int]]]:
    """Return the best frames with their drivers, in the numbers of the chain.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> choice_of(MechanismGraph.from_key("1BAN4"), 1)
    [(0, [2])]
    """
    from graphsynth.kinematics.embodiment.choice import choices

    found = []
    frames = {chain.with_frame(link): link for link in reversed(range(chain.links))}
    for inversion, pairs in choices(chain, None)[:most]:
        frame = frames[inversion]
        # with_frame() moves the frame to the front and keeps the order of the rest
        own = [frame, *(link for link in range(chain.links) if link != frame)]
        found.append((frame, [own[link] for _, link in pairs]))
    return found


def motion_of(task: tuple[str, str]) -> ShownMotion:
    """Find dimensions for a chain and show it moving; the numbers of the links are those of the key.

    Parameters
    ----------
    task : (str, str)
        Label and key.

    Returns
    -------
    ShownMotion
        Deterministic.  Where nothing is accepted the page is empty and the statement says why.
    """
    from graphsynth.drawing.animation import animation_html
    from graphsynth.drawing.frames import with_trace_points
    from graphsynth.errors import GraphError
    from graphsynth.kinematics.embodiment import embody
    from graphsynth.structure.graph import MechanismGraph

    label, key = task
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
        if not found.accepted or found.motion is None or found.mechanism is None or found.figures is None:
            continue
        page = animation_html(with_trace_points(found.motion), frames=90, title=f"Chain {label}")
        facts = {
            "frame": frame,
            "drivers": drivers,
            "statement": found.statement,
            "transmission": round(float(found.figures.transmission_angle), 4),
            "ratio": round(float(found.figures.length_ratio), 3),
        }
        return ShownMotion(label, page, found.mechanism.to_toml(), facts)
    return ShownMotion(label, "", "", {"statement": statement})
