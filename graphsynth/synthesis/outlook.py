"""What a question would take that has more loops than there are contracted graphs for: the refusal, with an estimate.

A question with one loop less has Pi - 1 links less, and the same mobility, space and higher pairs.  Such smaller
questions are counted, and the ratio of one number to the next, which grows by about as much each time, is continued.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NoReturn

from graphsynth.core.errors import TooLargeError
from graphsynth.synthesis.contracted import FOLDER_VARIABLE, SHIPPED_LOOPS
from graphsynth.synthesis.families import chain_families, truss_families
from graphsynth.synthesis.units import count_unit, cut

LISTED_PER_SECOND = 1e6  # order of magnitude, one core
MOST_LOOPS = 10  # what the kernels are laid out for
_COUNTED_LOOPS = 6  # counts of so many loops take a moment
# 1-DOF planar chains with 2, 3, ..., 8 loops (published and recomputed): where there is nothing smaller to count
_KNOWN = (2, 16, 230, 6856, 318162, 19819281, 1535380884)


def refuse(
    loops: int, links: int, mobility: int, space: int, higher: Mapping[int, int], *, framed: bool = False
) -> NoReturn:
    """Refuse what cannot finish.

    Always raises `TooLargeError`, with an estimate of what it would take.
    """
    count = extrapolated(loops, links, mobility, space, higher, framed=framed)
    what = "mechanisms" if framed and mobility else "groups" if framed else "chains" if mobility else "trusses"
    estimate = f"about {count:.0e} {what} answer it, by those with fewer loops; listing them would take "
    estimate += _duration(count / LISTED_PER_SECOND) + " on one core"
    if loops <= MOST_LOOPS:
        takes = "five minutes and 1.5 GB" if loops == 9 else "hours and tens of GB"
        remedy = (
            f"make their contracted graphs once with 'python -m graphsynth.synthesis.regenerate {loops} FOLDER' "
            f"({takes}), set {FOLDER_VARIABLE}=FOLDER, and share the work out with --shard i/m over m machines"
        )
    else:
        remedy = (
            f"contracted graphs with more than {MOST_LOOPS} loops cannot be made: ask for fewer links, or fix more of "
            "the question"
        )
    raise TooLargeError(
        f"{links} links make {loops} independent loops, more than the bound of {SHIPPED_LOOPS}: {estimate}; {remedy}",
        count,
    )


def _duration(seconds: float) -> str:
    for size, name in ((3.15e7, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {name}" if seconds < 1e4 * size else f"{seconds / size:.0e} {name}"
    return "a minute or two" if seconds > 20 else "seconds"


def extrapolated(
    loops: int, links: int, mobility: int, space: int, higher: Mapping[int, int], *, framed: bool = False
) -> float:
    """Estimate a number of non-fractionated chains (trusses, for mobility 0; with every frame, if ``framed``).

    >>> 1e11 < extrapolated(9, 20, 1, 3, {}) < 2e11
    True
    """
    first = [loops - _COUNTED_LOOPS, loops - _COUNTED_LOOPS + 1, loops - _COUNTED_LOOPS + 2]
    known = [_smaller(links - (space - 1) * fewer, mobility, space, higher, framed) for fewer in reversed(first)]
    if not all(known):
        factor = links if framed else 1
        known, at = [factor * n for n in _KNOWN[-3:]], SHIPPED_LOOPS
    else:
        at = _COUNTED_LOOPS
    ratio, growth = known[2] / known[1], known[2] / known[1] - known[1] / known[0]
    count = float(known[2])
    for _ in range(at, loops):
        ratio += max(growth, 0.0)
        count = min(count * ratio, 1e300)
    return count


def _smaller(links: int, mobility: int, space: int, higher: Mapping[int, int], framed: bool) -> int:
    if links < 3:
        return 0
    if mobility:
        families = chain_families(links, mobility, space, higher, framed)
    else:
        families = truss_families(links, space, framed)
    return sum(map(count_unit, cut(families, listing=False)))
