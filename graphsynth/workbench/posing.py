"""A pose for what is laid on the table: the page draws a mechanism as it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import characteristic_length, residual
from graphsynth.mechanism.model import Mechanism

#: Most links that the page shows.
LINKS_MAX = 64
#: Largest gap of a joint that the page takes for closed, in lengths of the mechanism.
_CLOSED = 1e-9


def assembled(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism in an assembled pose: its own, the one nearest to it, or the first of its motion.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Mechanism

    Raises
    ------
    GeometryError
        If it has more links than the page shows, or cannot be assembled where its motion starts.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> linkage = Mechanism.four_bar(4, 1, 3.5, 3)
    >>> assembled(linkage) is linkage
    True
    """
    if mechanism.graph.links > LINKS_MAX:
        raise GeometryError(f"{mechanism.graph.links} links; the workbench shows at most {LINKS_MAX}")
    if mechanism.pose is not None:
        gap = residual(mechanism.joints, np.array(mechanism.pose))
        if np.abs(gap).max(initial=0.0) <= _CLOSED * characteristic_length(mechanism):
            return mechanism
    from graphsynth.kinematics.engine.inputs import first_input

    motion = mechanism.simulate([first_input(mechanism)], events=False)
    if not motion.assembled.any():
        raise GeometryError(f"no pose can be drawn: {motion.reason}")
    return replace(mechanism, pose=tuple((float(x), float(y), float(turn)) for x, y, turn in motion.poses[0]))
