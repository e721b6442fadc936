"""All assembly modes of a mechanism at one input, and the range of inputs that it reaches."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.angles import angles
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine.follow import Trace, Tracker
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.kinematics.engine.start import group_modes, started
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.laws import Harmonic, Linear, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.mechanism.rank import characteristic_length

Array = NDArray[np.float64]


class AssemblyMode(NamedTuple):
    """One way to assemble a mechanism: the mode of every group, as `simulate` takes them, and the pose (links, 3)."""

    modes: dict[int, int]
    pose: Array


def assembly_modes(mechanism: Mechanism, input: float | str | None = None) -> list[AssemblyMode]:
    """Find all assembly modes of a mechanism at one input.

    Parameters
    ----------
    mechanism : Mechanism
        With as many drivers as its mobility.
    input : float or str, optional
        Input u, or an angle such as "30 deg"; by default that of the mechanism's pose, else 0.

    Returns
    -------
    list of AssemblyMode
        Poses and the modes of all groups: +1 or -1 for dyads, the rank for larger groups.  Empty if there is none.
        Complete for dyads and for triads of binary outer links (closed forms and eliminants, float64); for larger
        groups they are searched for by Newton's method from many starts, and some may be missing.

    Raises
    ------
    GeometryError
        Drivers that do not fit the mobility, an input that is no number, a group with a continuum of poses.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> [mode.modes for mode in Mechanism.four_bar(2, 1, 2.5, 2.5).modes("30 deg")]
    [{0: 1}, {0: -1}]
    """
    u = first_input(mechanism) if input is None else float(angles("input", [input])[0])
    program = compile_program(mechanism)
    dyads = [step.group for step in program.steps if step.has_two_modes]
    found: list[AssemblyMode] = []
    for signs in product((1, -1), repeat=len(dyads)):
        chosen = dict(zip(dyads, signs))
        tracker = started(program, u, chosen, None)
        trace = tracker.blank(np.array([u]))
        found += _assembled(tracker, trace, np.zeros((mechanism.graph.links, 3)), chosen, 0)
    return found


def _assembled(tracker: Tracker, trace: Trace, poses: Array, chosen: dict[int, int], first: int) -> list[AssemblyMode]:
    """Complete a choice of modes by those of the larger groups from step ``first`` on."""
    steps = tracker.program.steps
    k = next((k for k in range(first, len(steps)) if steps[k].iterative), len(steps))
    tracker.seed(trace, poses)
    done, _, where = tracker.run(trace, 0)
    if k == len(steps):
        pose = np.column_stack([trace.X[0, :, :2], trace.angles(tracker.program, 0)])
        return [AssemblyMode(dict(sorted(chosen.items())), pose)] if done else []
    if not done and where < k:
        return []
    modes = group_modes(tracker, trace, k)
    if modes is None:
        raise GeometryError(f"group {steps[k].group} has a continuum of poses at this input; give another input")
    found: list[AssemblyMode] = []
    for rank, core in enumerate(modes):
        own = poses.copy()
        own[list(steps[k].core)] = core
        found += _assembled(tracker, trace, own, {**chosen, steps[k].group: rank}, k + 1)
    return found


def first_input(mechanism: Mechanism) -> float:
    """Return the input at which the first driver has the coordinate of the mechanism's pose; 0 without a pose."""
    driver = mechanism.drivers[0] if mechanism.drivers else None
    if driver is None or mechanism.pose is None or not isinstance(driver.law, Linear) or driver.law.rate == 0.0:
        return 0.0
    base, link = mechanism.pose[driver.base], mechanism.pose[driver.link]
    joint = mechanism.joint(*driver.pair)
    if isinstance(joint, Prismatic):
        (ax, ay, at), (bx, by, bt) = mechanism.pose[joint.a], mechanism.pose[joint.b]
        P = complex(ax, ay) + np.exp(1j * at) * complex(*joint.at_a)
        Q = complex(bx, by) + np.exp(1j * bt) * complex(*joint.at_b)
        along = float(((Q - P) * np.exp(-1j * (at + joint.angle_a))).real)
        q = along if driver.base == joint.a else -along
    else:
        q = link[2] - base[2]
    return (q - driver.law.offset) / driver.law.rate


def whole_range(mechanism: Mechanism) -> tuple[float, float]:
    """Return the inputs to be tried where none are given: a full rotation, a period, a table.

    Raises
    ------
    GeometryError
        No driver, or a law whose range is not known.
    """
    if not mechanism.drivers:
        raise GeometryError("the mechanism has no driver, so nothing moves it; give drivers")
    driver, u0 = mechanism.drivers[0], first_input(mechanism)
    law, slides = driver.law, isinstance(mechanism.joint(*driver.pair), Prismatic)
    if isinstance(law, Linear) and law.rate:
        size = 4.0 * characteristic_length(mechanism) if slides else math.tau
        return u0, u0 + size / abs(law.rate)
    if isinstance(law, Harmonic) and law.order:
        return 0.0, math.tau / abs(law.order)
    if isinstance(law, Table):
        return law.inputs[0], law.inputs[-1]
    raise GeometryError(f"the range of the law {law!r} is not known; give inputs")
