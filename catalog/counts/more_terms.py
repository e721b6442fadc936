"""Count series of chains, Baranov trusses and Assur groups to eight loops; write them as TOML.

    python catalog/counts/more_terms.py [LOOPS] > more-terms.toml

Planar, joints of mobility 1, one row for each series: the terms by number of links, smallest first, and the processor
time of the last one.  All terms to eight loops take about 20 minutes of one core; to seven, the default, one.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from graphsynth import count_assur_groups, count_baranov_trusses, count_chains

#: (name, what is counted, links with one loop, count)
SERIES: list[tuple[str, str, int, Callable[[int], int]]] = [
    ("baranov_trusses", "Baranov trusses by links", 3, count_baranov_trusses),
    ("assur_groups", "Assur groups by moving links", 2, count_assur_groups),
]
for _w in (2, 3, 4, 5):
    for _name, _all in (("", False), ("_with_fractionated", True)):
        SERIES.append(
            (
                f"chains_{_w}{_name}",
                f"chains of mobility {_w} by links, {'fractionated ones included' if _all else 'not fractionated'}",
                _w + 3,
                lambda links, w=_w, every=_all: count_chains(links, w, fractionated=every),  # type: ignore[misc]
            )
        )


def rows(loops: int) -> list[str]:
    """Return the lines of the file."""
    lines = []
    for name, what, first, count in SERIES:
        terms = {}
        for loop in range(loops):
            links = first + 2 * loop
            begin = time.process_time()
            terms[links] = count(links)
            sys.stderr.write(f"{name} {links}: {terms[links]} ({time.process_time() - begin:.1f} s)\n")
        inside = ", ".join(f"{links} = {number}" for links, number in terms.items())
        lines += [f"# {what}", f"{name} = {{ {inside} }}", ""]
    return lines


if __name__ == "__main__":
    sys.stdout.write("\n".join(rows(int(sys.argv[1]) if len(sys.argv) > 1 else 7)))
