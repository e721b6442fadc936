"""``graphsynth animate``."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.cli import console
from graphsynth.cli.show import check_place, read_graph, read_special
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError
from graphsynth.core.wholefiles import replacing

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

_SUFFIXES = (".html", ".gif", ".svg")
_FRAMES = {".html": 120, ".gif": 60, ".svg": 90}


@dataclass(frozen=True)
class _Found:
    """A motion to show, and what is to be said about it."""

    motion: Motion
    title: str
    statement: str
    facts: dict[str, Any] = field(default_factory=dict)


def run(options: argparse.Namespace) -> int:
    """Embody and animate one candidate, or animate a dimensioned mechanism."""
    from graphsynth.drawing.frames import check_frames
    from graphsynth.formats.registry import write

    suffix = options.output.suffix.lower()
    check_place(options.output, _SUFFIXES)
    if options.save:
        check_place(options.save, (".toml", ".json"))
    count = options.frames if options.frames is not None else _FRAMES[suffix]
    check_frames(count)
    place = Path(options.mechanism)
    dimensioned = len(options.mechanism) < 1000 and place.suffix.lower() in (".toml", ".json") and place.is_file()
    found = _from_file(place, options) if dimensioned else _from_graph(options)
    with replacing(options.output) as fresh:
        _write(found, fresh, suffix, count)
    if options.save:
        write(found.motion.mechanism, options.save)
    motion, closure = found.motion, found.motion.closure
    if not options.json:
        ending = closure.statement if motion.completed else f"not a full rotation: {motion.reason}"
        console.put(console.wrapped(f"{found.statement}; {ending}"))
        console.put(f"{options.output}, {options.output.stat().st_size / 1000:.0f} kB")
        return 0
    facts = {
        "links": motion.mechanism.graph.links,
        "drivers": _drivers(motion.mechanism),
        "completed": motion.completed,
        "reason": motion.reason,
        "closed": closure.closed if closure.tested else None,
        "closure": _number(closure.error),
        "residual": _number(motion.residual),
    }
    console.put_json({**facts, **found.facts, "statement": found.statement, "file": str(options.output)})
    return 0


def _from_file(place: Path, options: argparse.Namespace) -> _Found:
    """Move a dimensioned mechanism over the range given, or as far as it goes."""
    if options.driver:
        raise SpecError("--driver belongs to a graph: a dimensioned mechanism names its drivers in its file")
    mechanism = read_mechanism(place)
    motion = moved(mechanism, options.range)
    size = f"{mechanism.graph.links} links, drivers {_drivers(mechanism)}"
    if not motion.assembled.any():
        raise GraphsynthError(f"nothing of the motion is assembled: {motion.reason}")
    return _Found(motion, place.stem, size, {"key": mechanism.graph.key, "text": mechanism.graph.to_text()})


def read_mechanism(place: Path) -> Mechanism:
    """Read a dimensioned mechanism from a .toml or .json file."""
    from graphsynth.core.textfiles import read_bytes
    from graphsynth.mechanism.files import JSON_MAX
    from graphsynth.mechanism.model import Mechanism

    text = read_bytes(place, JSON_MAX, "a mechanism")
    try:
        return Mechanism.from_toml(text) if place.suffix.lower() == ".toml" else Mechanism.from_json(text)
    except FormatError as error:
        raise FormatError(str(error), str(place)) from None


def moved(mechanism: Mechanism, reach: list[float] | None) -> Motion:
    """Move a mechanism over a range of inputs, or as far as it goes."""
    import numpy as np

    from graphsynth.drawing.frames import motion_over_reach
    from graphsynth.kinematics.simulation import simulate

    return simulate(mechanism, np.linspace(reach[0], reach[1], 361)) if reach else motion_over_reach(mechanism)


def _from_graph(options: argparse.Namespace) -> _Found:
    """Find dimensions for a graph; the best found is shown even where nothing was accepted."""
    from graphsynth.kinematics.dimensional import embody
    from graphsynth.structure.slider_chains import SliderChain

    if options.range is not None:
        raise SpecError("--range belongs to a dimensioned mechanism; a graph gets dimensions for a full rotation")
    chain = read_special(options.mechanism, options.line)
    if chain is not None and not isinstance(chain, SliderChain):
        raise SpecError(f"{options.mechanism}: dimensions are found for chains of simple joints, not for this kind")
    graph = chain.graph if chain else read_graph(options.mechanism, options.line)
    slides = dict.fromkeys(chain.sliders, "P") if chain else None
    found = embody(graph, seed=options.seed, driver=_on_frame(graph, options.driver), joints=slides)
    if found.motion is None or found.mechanism is None:
        raise GraphsynthError(f"{found.statement}; try another --seed or --driver")
    facts: dict[str, Any] = {
        "key": (chain or graph).key,
        "text": (chain or found.graph).to_text(),
        "accepted": found.accepted,
        "seed": found.seed,
        "evaluations": found.evaluations,
        "search_seconds": round(found.seconds, 3),
    }
    if found.figures is not None:
        names = ("transmission_angle", "singularity_distance", "length_ratio")
        facts |= {name: _number(getattr(found.figures, name)) for name in names}
    return _Found(found.motion, (chain or graph).to_text(), found.statement, facts)


def _on_frame(graph: MechanismGraph, links: list[int] | None) -> list[tuple[int, int]] | None:
    """Driven joints between the links given and the frame."""
    if not links:
        return None
    if graph.frame is None:
        raise SpecError("--driver needs a mechanism: choose a frame first (text form '... f0')")
    for link in links:
        if link not in graph.levels[1]:
            listed = ", ".join(map(str, graph.levels[1]))
            raise SpecError(f"--driver {link}: the link is not jointed to the frame; choose from {listed}")
        if links.count(link) > 1:
            raise SpecError(f"--driver {link} is given twice; name every driven link once")
    return [(graph.frame, link) for link in links]


def _write(found: _Found, path: Path, suffix: str, frames: int) -> None:
    from graphsynth.drawing.animation import animated_svg, animation_html, save_gif
    from graphsynth.drawing.frames import with_trace_points

    motion = with_trace_points(found.motion)
    if suffix == ".gif":
        save_gif(motion, path, frames=frames)
    elif suffix == ".svg":
        path.write_text(animated_svg(motion, frames=frames, title=found.title), "utf-8")
    else:
        note = f"{found.statement[:1].upper()}{found.statement[1:]}."
        path.write_text(animation_html(motion, frames=frames, title=found.title, note=note), "utf-8")


def _drivers(mechanism: Mechanism) -> str:
    return ", ".join(f"{d.base}-{d.link}" for d in mechanism.drivers)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
