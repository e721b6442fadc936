"""``module = "design"``: from a task to mechanisms that do it."""

from __future__ import annotations

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.design.tables import DesignTable
from graphsynth.pipeline.system import Stage, System

_HERE = "graphsynth.pipeline.design.stages"

SYSTEM = System(
    table=DesignTable,
    structure="none",
    stages=(
        Stage("search", f"{_HERE}:search", (), ("designs",)),
        Stage("assess", f"{_HERE}:records", ("designs",), ("records",)),
        Stage("tabulate", f"{_HERE}:tables", ("designs",), ("tables",)),
        Stage("animate", f"{_HERE}:pictures", ("designs",), ("animations",)),
        Stage("plot", f"{_HERE}:curves", ("designs",), ("plots",)),
        Stage("mechanisms", f"{_HERE}:mechanisms", ("designs",), ("mechanisms",)),
    ),
    evidence=(
        *plans("graphsynth.evidence.designs", "hidden-task", "nine-points", "nearest-curves"),
        *plans("graphsynth.evidence.poses", "five-poses", "function-positions", "cognates"),
    ),
)
