"""Which turning and sliding pairs make the graph of the floating piston a mechanism with a crank that turns."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from graphsynth.core.checks import whole
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.piston.spaces import LoopSpaces, loop_spaces

_JOINTS = ((0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (0, 4))
_FULL_TURN = {
    "RR": (True, "crank-slider: the crank turns fully if the rod is longer than crank + |offset|"),
    "RP": (True, "Scotch yoke: the crank turns fully with any dimensions"),
    "PR": (False, "swinging block: the pin runs to infinity where the crank is parallel to the guide"),
}


class Assignment(NamedTuple):
    """Kinds of joints 0-1, 1-2, 2-3, 0-3, 3-4, 0-4, the spaces of their loops, and whether the crank turns fully."""

    kinds: str
    spaces: LoopSpaces
    full_turn: bool
    remark: str


def rotary_assignments(seed: int = 0) -> list[Assignment]:
    """List all R and P on the graph's joints whose loops move in spaces (3, 2), with W = 1 and a turning crank.

    All 64 assignments are tried at random geometry.  The crank must be able to turn (joint 0-1 is R, and moves) and the
    piston must move.

    Parameters
    ----------
    seed : int
        Of the random geometry, 0 or more.

    Returns
    -------
    list of Assignment
        Three; two of them have a crank that turns fully: the two mechanisms of the source.

    Raises
    ------
    GeometryError
        A seed that is not a whole number, or is negative.

    Examples
    --------
    >>> [(a.kinds, a.full_turn) for a in rotary_assignments()]
    [('RRRPPP', True), ('RRPPPP', True), ('RPRPPP', False)]
    """
    seed = whole("seed", seed, 0, 2**63 - 1)
    found = []
    for kinds in product("RP", repeat=6):
        mechanism = _random("".join(kinds), seed)
        spaces = loop_spaces(mechanism, loops=[(0, 1, 2, 3), (0, 3, 4)])
        if spaces.spaces != (3, 2) or spaces.mobility != 1 or kinds[0] != "R":
            continue
        rates = mechanism.mobility().freedoms[0]
        size = np.abs(rates).max()
        if abs(rates[1, 2]) > 1e-9 * size and np.abs(rates[4, :2]).max() > 1e-9 * size:
            name = "".join(kinds)
            found.append(Assignment(name, spaces, *_FULL_TURN[name[1:3]]))
    return found


def _random(kinds: str, seed: int) -> Mechanism:
    """Return the mechanism with random joints, all link frames at the origin."""
    rng = np.random.default_rng(seed)
    joints: list[JointGeometry] = []
    for (a, b), kind in zip(_JOINTS, kinds):
        at = (float(rng.uniform(-1, 1)), float(rng.uniform(-1, 1)))
        turn = float(rng.uniform(0, np.pi))
        joints.append(Revolute(a, b, at, at) if kind == "R" else Prismatic(a, b, at, at, turn, turn))
    return Mechanism(MechanismGraph(5, list(_JOINTS), frame=0), tuple(joints), pose=((0.0, 0.0, 0.0),) * 5)
