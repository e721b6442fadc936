"""Where the joints of a mechanism are."""

from __future__ import annotations

from typing import Any, NamedTuple


class Places(NamedTuple):
    """Where joints are, floats or intervals, or how that changes.

    ``r``, ``e`` (..., joints, 2): positions, and directions of guides; ``base`` (..., joints, 2, 2): directions of
    links a and b; ``rail`` (..., joints, 2): points of guides on link a, which a slider leaves; of other joints r.
    """

    r: Any
    e: Any
    base: Any
    rail: Any
