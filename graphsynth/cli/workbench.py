"""``graphsynth workbench``."""

from __future__ import annotations

import argparse
from pathlib import Path

from graphsynth.cli import console
from graphsynth.cli.animate import read_mechanism
from graphsynth.cli.show import read_graph
from graphsynth.core.errors import GraphsynthError
from graphsynth.mechanism.model import Mechanism


def run(options: argparse.Namespace) -> int:
    """Write the workbench page, with a mechanism on the table if one is named."""
    from graphsynth.workbench.writing import write_workbench

    place = options.output or Path("workbench.html" if options.single else "workbench")
    page = write_workbench(place, _mechanism(options) if options.mechanism else None, single=options.single)
    size = sum(own.stat().st_size for own in ([page] if options.single else page.parent.iterdir()))
    if options.json:
        console.put_json({"page": str(page), "bytes": size})
    else:
        console.put(f"{page}, {size / 1000:.0f} kB: open it in a browser")
    return 0


def _mechanism(options: argparse.Namespace) -> Mechanism:
    """Return a mechanism from a file, a classic one by name, or dimensions that are found for a graph."""
    from graphsynth.mechanism import gallery

    place = Path(options.mechanism)
    if options.mechanism in gallery.__all__:
        made: Mechanism = getattr(gallery, options.mechanism)()
        return made
    if len(options.mechanism) < 1000 and place.suffix.lower() in (".toml", ".json") and place.is_file():
        return read_mechanism(place)
    from graphsynth.kinematics.dimensional import embody

    found = embody(read_graph(options.mechanism), seed=options.seed)
    if found.mechanism is None or found.motion is None:
        raise GraphsynthError(f"{found.statement}; try another --seed")
    return found.motion.mechanism
