"""Beyond the specification: links of length zero, joints that coincide, mechanisms that move against the count."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["against_the_count", "all_in_one_point", "zero_links"]


def zero_links(check: Checks) -> None:
    """Links of length zero: moving ones are refused; a frame of length zero turns a four-bar as one rigid triangle."""
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.kinematics.certify import certify_four_bar
    from graphsynth.kinematics.simulation import simulate

    u = np.linspace(0.0, 6.0, 25)
    for k, name in enumerate(("link 1", "link 2", "link 3")):
        lengths = [1.0, 2.5, 2.5, 2.0]
        lengths[k] = 0.0
        check.refused(f"{name} of length 0", partial(four_bar, *lengths), name, "length 0")
    motion = simulate(four_bar(3.0, 5.0, 4.0, 0.0), u, modes={0: 1})
    check.agrees("frame of length 0: completed", motion.completed, motion.reason or "yes")
    # crank 3, rocker 4 about one point, coupler 5: a right angle between crank and rocker at every input
    angle = np.angle(np.exp(1j * (motion.poses[:, 3, 2] - motion.poses[:, 1, 2])))
    check.below("crank to rocker is a right angle", float(np.abs(np.abs(angle) - math.pi / 2).max()), 2e-15)
    check.below("it turns with the crank", float(np.abs(motion.velocities[:, 3, 2] - 1.0).max()), 1e-14)
    tiny = simulate(four_bar(1e-300, 2.5, 2.5, 2.0), u, modes={0: 1})
    still = float(np.ptp(tiny.poses[:, 3, 2]))
    check.below("crank of 1e-300: the rocker moves by, rad", still, 5e-16, source="crank over rocker")
    check.refused("a proof with a crank of 0", lambda: certify_four_bar(2, 0, 3, 3), "crank")


def all_in_one_point(check: Checks) -> None:
    """All joints at one place: refused; a rhombus folded flat is reported, and right as soon as it is open."""
    from graphsynth.evidence.stress.cases.linkages import built, four_bar
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2), Revolute(2, 3), Revolute(0, 3)]
    check.refused("four turning pairs in one point", lambda: built(graph, joints), "length 0")
    # rhombus folded flat: the coupler's pivots lie on each other, the dyad may turn about them
    folded = simulate(four_bar(1.0, 1.0, 1.0, 1.0), [0.0, 0.5], modes={0: 1})
    check.says("rhombus folded flat: completed", folded.completed, False)
    check.mentions("its reason", folded.reason, "not determined")
    check.agrees("no pose is shown", bool(np.isnan(folded.poses).all()))
    for distance in (1e-3, 1e-6, 1e-9):
        # beside it the rhombus is a rhombus: the rocker is parallel to the crank, or lies on the frame
        near = simulate(four_bar(1.0, 1.0, 1.0, 1.0), [distance], modes={0: 1})
        angle = float(near.poses[0, 3, 2])
        gap = min(abs(math.remainder(angle - right, math.tau)) for right in (distance, math.pi))
        check.below(f"{distance:g} beside it: rocker", gap, 4e-16 / distance, source="parallel sides")


def against_the_count(check: Checks) -> None:
    """Platform on three bars: the count says 0; parallel and equal ones give rank 1, a bar that leans holds it."""
    for name, lean, by_rank in (("parallel bars", 0.0, 1), ("third bar leans by 0.2", 0.2, 0), ("by 1e-6", 1e-6, 0)):
        report = _on_three_bars(lean).mobility()
        check.equals(f"{name}: by count", report.count, 0, source="3 (n - 1) - 2 p")
        tell = check.says if by_rank else check.equals
        tell(f"{name}: by rank", report.by_rank, by_rank, source="instantaneous centre of three bars")


def _on_three_bars(lean: float) -> Any:
    """Frame, platform, and three bars of length 1 from 0, 1 and 2 at 0.7 rad; the third turned further by ``lean``."""
    from graphsynth.mechanism.joints import Revolute
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    graph = MechanismGraph(5, [(0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (3, 4)], frame=0)
    turns = (0.7, 0.7, 0.7 + lean)
    tips = [complex(k + math.cos(turn), math.sin(turn)) for k, turn in enumerate(turns)]
    joints = [Revolute(0, k + 1, (float(k), 0.0)) for k in range(3)]
    held = [tip - tips[0] for tip in tips]
    joints += [Revolute(k + 1, 4, (1.0, 0.0), (held[k].real, held[k].imag)) for k in range(3)]
    pose = [
        (0.0, 0.0, 0.0),
        *((float(k), 0.0, turn) for k, turn in enumerate(turns)),
        (tips[0].real, tips[0].imag, 0.0),
    ]
    return Mechanism(graph, tuple(joints), (), pose=tuple(pose))
