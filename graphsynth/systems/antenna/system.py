"""``module = "pointing"``: an antenna reflector on a gimbal, tilted about two axes by two cranks."""

from __future__ import annotations

from graphsynth.evidence.rows import plans
from graphsynth.pipeline.system import Stage, System
from graphsynth.systems.antenna.scene import AntennaTable

_HERE = "graphsynth.systems.antenna"
SYSTEM = System(
    table=AntennaTable,
    cases=tuple(f"instruments-9.{k}" for k in range(1, 8)),
    structure="none",
    build=f"{_HERE}.scene:antenna_of",
    stages=(
        Stage("sweep", f"{_HERE}.stages:sweep", (), ("sweep",)),
        Stage("compare models", f"{_HERE}.stages:compare", (), ("comparison",)),
        Stage("solve the twelve equations", f"{_HERE}.stages:cross_check", ("sweep",), ("second_way",)),
        Stage("find singular poses", f"{_HERE}.stages:singular_poses", (), ("singular_poses",)),
        Stage("prove tolerances", f"{_HERE}.stages:tolerances", (), ("tolerances",)),
        Stage(
            "assess",
            f"{_HERE}.stages:assess",
            ("sweep", "comparison", "second_way", "singular_poses", "tolerances"),
            ("records", "tables"),
        ),
        Stage("draw mechanism", f"{_HERE}.pictures:sketches", (), ("mechanism_pictures",)),
        Stage("animate", f"{_HERE}.pictures:animations", ("sweep",), ("animations",)),
        Stage("plot", f"{_HERE}.pictures:plots", ("sweep", "comparison"), ("plots",)),
        Stage("compare solvers", f"{_HERE}.stages:solvers", (), ("solvers",)),
    ),
    evidence=plans(f"{_HERE}.evidence", "poses"),
)
