"""Places of the joints of every chain's sketch, short enough to be sent: the page draws from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor

from graphsynth.atlas.site.families import Family, script

#: Chains in one file of sketches: about 70 kB for twelve links.
PER_FILE = 1024
_CHUNK = 64
_DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
_MOST = 4095


def places_of(keys: Sequence[str]) -> list[str]:
    """Return the places of the joints of chains: for each joint x and y, two digits of base 64 each.

    The larger side of the drawing is 4095 units; y is upwards.

    >>> [len(places) for places in places_of(["1BAN4", "1BgMw8g"])]  # four digits a joint
    [16, 28]
    """
    import numpy as np

    from graphsynth.kinematics.dimensional.sketch import layout
    from graphsynth.structure.graph import MechanismGraph

    found = []
    for key in keys:
        positions = layout(MechanismGraph.from_key(key)).positions
        moved = positions - positions.min(axis=0)
        units = np.rint(moved * (_MOST / max(float(moved.max()), 1e-9))).astype(int)
        found.append("".join(_DIGITS[value >> 6] + _DIGITS[value & 63] for value in units.ravel().tolist()))
    return found


def sketch_scripts(family: Family, executor: Executor | None) -> Iterator[tuple[str, str, int]]:
    """Yield the files of sketches of a family as (name, script, chains in it)."""
    from graphsynth.core.ordered import in_order

    keys = [row["key"] for row in family.rows]
    chunks = [keys[k : k + _CHUNK] for k in range(0, len(keys), _CHUNK)]
    held: list[str] = []
    done = 0
    for places in in_order(executor, places_of, chunks):
        held += places
        done += len(places)
        if len(held) == PER_FILE or done == len(keys):
            number = (done - 1) // PER_FILE
            yield (
                f"sketches-{family.name}-{number}.js",
                script("takeSketches", family.name, number, "".join(held)),
                len(held),
            )
            held = []
