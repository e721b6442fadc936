"""``graphsynth parts``."""

from __future__ import annotations

import argparse
from pathlib import Path

from graphsynth.cli import console
from graphsynth.cli.animate import moved, read_mechanism
from graphsynth.core.errors import SpecError

#: Pins thinner than this, in millimetres, are told: the unit of length may be a metre.
_SMALL = 0.5


def run(options: argparse.Namespace) -> int:
    """Make parts of a mechanism and write them to a folder."""
    from graphsynth.design.parts.api import parts
    from graphsynth.design.parts.plan import PartSizes
    from graphsynth.mechanism import gallery

    place = Path(options.mechanism)
    if options.mechanism in gallery.__all__:
        mechanism = getattr(gallery, options.mechanism)()
    elif place.suffix.lower() in (".toml", ".json"):
        mechanism = read_mechanism(place)
    else:
        raise SpecError(
            f"{options.mechanism} is neither a file .toml or .json nor one of the classic mechanisms: "
            f"{', '.join(gallery.__all__)}"
        )
    sizes = PartSizes(**{name: getattr(options, name) for name in PartSizes.__dataclass_fields__})
    made = parts(moved(mechanism, options.range), unit=options.unit, sizes=sizes)
    if made.sizes.pin < _SMALL:
        longest = max(row.length for row in made.bill)
        console.note(f"the longest part is {longest:.3g} mm: --unit says how many millimetres one unit of length is")
    files = made.write(options.output, forms=options.form or ("svg", "csv"))
    if options.json:
        console.put_json(
            {
                "layers": list(made.layers),
                "certified": made.certified,
                "reason": made.reason,
                "statement": made.statement,
                "sizes": made.sizes._asdict(),
                "bill": [row._asdict() for row in made.bill],
                "files": [str(file) for file in files],
            }
        )
        return 0
    console.put(repr(made))
    console.put(f"written to {options.output}: {', '.join(file.name for file in files)}")
    return 0
