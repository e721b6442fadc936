"""``graphsynth doctor`` and ``graphsynth schema``: what the program knows of itself."""

from __future__ import annotations

import argparse

from graphsynth.cli import console


def run(options: argparse.Namespace) -> int:
    """Print the JSON Schema of scene files, or where the machine code of the kernels comes from."""
    if options.verb == "schema":
        from graphsynth.pipeline.schema import schema_text

        console.put(schema_text().rstrip("\n"))
        return 0
    from graphsynth.core.native import doctor, library

    found = doctor.examine()
    held = library.contents()
    if options.json:
        kernels = [finding._asdict() for finding in found]
        console.put_json(
            {"library": str(library.path()), "loaded": bool(held), "code": library.reason} | {"kernels": kernels}
        )
        return 0
    console.put(f"library: {library.path()}")
    console.put(f"         loaded, code for {library.reason}" if held else f"         not used: {library.reason}")
    for place, why in dict.fromkeys((finding.place, finding.why) for finding in found):
        names = [finding.kernel for finding in found if (finding.place, finding.why) == (place, why)]
        console.put(f"{len(names):5d} kernels {place}{f': {why}' if why else ''}")
        if why and held:
            console.put("\n".join(f"        {name}" for name in names))
    return 0
