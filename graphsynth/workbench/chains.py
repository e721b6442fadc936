"""What the page needs to count and list chains with the kernels: contracted graphs, and the labels of each family."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterator
from typing import Any
from zlib import compress

import numpy as np

from graphsynth.synthesis.chunks import expansion_of
from graphsynth.synthesis.contracted import contracted_graphs
from graphsynth.synthesis.families import Family, chain_families, chain_joints, rings
from graphsynth.synthesis.kernels.layout import HEADER, make_work

MOST_LOOPS = 7
#: Most links by mobility.
MOST_LINKS = {1: 16, 2: 13, 3: 12}
_STATES = 1024


def script() -> str:
    """Return the script that hands all plans to ``Chains``: planar chains with lower pairs."""
    kinds = [(links, mobility) for mobility, most in MOST_LINKS.items() for links in range(mobility + 3, most + 1)]
    plans = {f"{links},{mobility}": _plan(links, mobility) for links, mobility in kinds if _possible(links, mobility)}
    work = make_work(_STATES)
    shapes = {name: [_kind(part), list(part.shape)] for name, part in work._asdict().items()}
    told = {"plans": plans, "graphs": _graphs(), "work": shapes, "header": HEADER}
    packed = b64encode(compress(json.dumps(told, separators=(",", ":")).encode(), 9)).decode()
    return f"Chains.register({json.dumps(packed)});\n"


def _possible(links: int, mobility: int) -> bool:
    joints = chain_joints(links, mobility, 3, {})
    return joints is not None and joints - links + 1 <= MOST_LOOPS


def _plan(links: int, mobility: int) -> dict[str, Any]:
    """Rings, packed, and the families of chains with these numbers."""
    return {
        "rings": [list(ring.packed) for ring in rings(links, mobility, 3, {}, framed=False)],
        "families": [_family(family) for family in chain_families(links, mobility, 3, {}, framed=False)],
    }


def _family(family: Family) -> dict[str, Any]:
    labels = family.edge_labels
    return {
        "loops": family.loops,
        "vertices": family.vertices,
        "joints": family.joints,
        "tables": _arrays(labels.tables),
        "expansion": _arrays(expansion_of(labels, ())),
    }


def _arrays(parts: Any) -> dict[str, Any]:
    """Return numbers, and arrays as (type, shape, items)."""
    return {
        name: [_kind(part), list(part.shape), part.ravel().tolist()] if isinstance(part, np.ndarray) else int(part)
        for name, part in parts._asdict().items()
    }


def _kind(array: Any) -> str:
    return str(array.dtype.str[1:])


def _graphs() -> dict[str, Any]:
    """Upper triangles of the contracted graphs by loops and vertices, as texts of digits, item by item."""

    def layers() -> Iterator[tuple[str, Any]]:
        for loops in range(2, MOST_LOOPS + 1):
            for k in range(2, 2 * (loops - 1) + 1):
                upper = contracted_graphs(loops, k)[:, *np.triu_indices(k, 1)]
                yield f"{loops},{k}", [len(upper), "".join(map(str, upper.T.ravel().tolist()))]

    return dict(layers())
