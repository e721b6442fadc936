"""``module = "planar"``: any planar mechanisms, from a question or from files: dimensions, motion, bearings, loads."""

from __future__ import annotations

from typing import Any

from graphsynth.core.errors import SceneError
from graphsynth.evidence.rows import plans
from graphsynth.pipeline.planar.tables import PlanarTable
from graphsynth.pipeline.system import COLLECT, Stage, System

_HERE = "graphsynth.pipeline.planar"


def _more(scene: Any) -> tuple[Stage, ...]:
    """Return the stages of the parts that a scene has."""
    table: PlanarTable = scene.mechanism
    place = scene.place / "mechanism"
    if bool(table.files) == (scene.structure is not None):
        raise SceneError(
            f"{place} needs candidates: give either a table [structure] or mechanism files, as in "
            'files = ["my-mechanism.toml"]'
        )
    parts, stages = ["moved"], []
    if table.bearings is not None:
        stages.append(Stage("jamming", f"{_HERE}.stages:jamming", ("moved",), ("jammed",), each=True, cost=2.0))
        parts.append("jammed")
    if table.binding is not None:
        stages.append(Stage("binding", f"{_HERE}.binding:binding", ("moved",), ("bound", "loaded"), each=True))
        parts.append("bound")
    if table.risk is not None:
        stages += [
            Stage("risk", f"{_HERE}.risk:risk", ("moved",), ("risk", "risked"), each=True, cost=4.0),
            Stage("tables of the risk", f"{_HERE}.risk:tables", ("risked",), ("tables",)),
            Stage("cost of less risk", f"{_HERE}.risk:pictures", ("risked",), ("cost_over_risk",)),
        ]
        parts.append("risk")
    if table.loads is not None:
        stages.append(Stage("dynamics", f"{_HERE}.stages:dynamics", ("moved",), ("driven",), each=True, cost=3.0))
        parts.append("driven")
    stages.append(Stage("assess", f"{_HERE}.stages:assess", tuple(parts), ("record",), each=True))
    if scene.structure is not None and scene.structure.generate.sample is not None:
        stages.append(Stage("shares", f"{_HERE}.shares:shares", ("records",), ("shares",)))
    best = ("written", "records" if scene.ranking is None else "ranking")
    stages += [
        Stage("sketch best", f"{_HERE}.stages_pictures:sketches", (*best, "records"), ("mechanism_pictures",)),
        Stage("animate best", f"{_HERE}.stages_pictures:animations", (*best, "records"), ("animations",)),
        Stage("plot best", f"{_HERE}.stages_pictures:plots", best, ("plots",)),
    ]
    if table.binding is not None:
        stages += [
            Stage("tables of binding", f"{_HERE}.binding:tables", ("loaded", best[1]), ("binding_tables",)),
            Stage("plot binding", f"{_HERE}.binding:curves", ("loaded", *best), ("binding_curves",)),
        ]
    return tuple(stages)


SYSTEM = System(
    table=PlanarTable,
    stages=(
        Stage("take", f"{_HERE}.stages:take", (), ("designs",), stream=True),
        Stage("embody", f"{_HERE}.stages:embody", ("designs",), ("built",), each=True),
        Stage("move", f"{_HERE}.stages:move", ("built",), ("moved",), each=True),
        Stage("write", f"{_HERE}.stages:write", ("moved",), ("written",), each=True, cost=9.0),
        Stage("mechanisms", f"{_HERE}.stages:mechanisms", ("written",), ("mechanisms",)),
        COLLECT,
    ),
    more=_more,
    evidence=(
        *plans(f"{_HERE}.evidence", "positions", "coupled-joints", "binding", "binding-in-space", "linkage-dynamics"),
        *plans("graphsynth.evidence.chance", "joints-probability", "allocation"),
        *plans(f"{_HERE}.evidence", "dimensions", "path-dimensions"),
    ),
)
