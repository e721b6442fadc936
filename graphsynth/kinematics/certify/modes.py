"""`certify_modes`: assembly modes that are proved, beside how many there can be."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import exact
from graphsynth.intervals.guard import check_rounding
from graphsynth.intervals.moving import prove_nodes
from graphsynth.kinematics.certify.equations import MechanismSystem
from graphsynth.kinematics.certify.poses import radii_of
from graphsynth.kinematics.engine.inputs import input_of
from graphsynth.kinematics.engine.start import AssemblyMode, assembly_modes
from graphsynth.mechanism.joints import Revolute
from graphsynth.structure.modes import count_assembly_modes

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ModesCertificate:
    """What is proved about the assembly modes of a mechanism at one input.

    Attributes
    ----------
    modes : tuple of AssemblyMode
        Those that were found.
    proved : ndarray of bool, shape (n,)
        Near this one there is exactly one exact assembly, another one than those before it.
    position_radius, angle_radius : ndarray, shape (n,)
        How near: distance of the origin of every link (length) and angle (radians); NaN where nothing is proved.
    most : int or None
        No mechanism of this structure has more isolated assembly modes; None where not known (sliders, gears, cams).
    """

    modes: tuple[AssemblyMode, ...]
    proved: NDArray[np.bool_]
    position_radius: Array
    angle_radius: Array
    most: int | None

    def __len__(self) -> int:
        return int(self.proved.sum())

    @property
    def complete(self) -> bool:
        """Whether as many are proved as there can be, so that none is missing."""
        return self.most is not None and len(self) == self.most

    @property
    def statement(self) -> str:
        """The result in one sentence."""
        if self.complete:
            return f"all {self.most} of at most {self.most} assembly modes found, each proved"
        left = len(self.modes) - len(self)
        bound = "more are not excluded" if self.most is None else f"at most {self.most} exist, complex ones included"
        return f"{len(self)} assembly modes proved; {bound}" + (f"; {left} found but not proved" if left else "")

    def __repr__(self) -> str:
        return f"ModesCertificate({self.statement})"


def certify_modes(mechanism: Mechanism, input: float | str | None = None) -> ModesCertificate:
    """Prove the assembly modes that are found, and say whether there can be others.

    Parameters
    ----------
    mechanism, input
        As for `graphsynth.kinematics.engine.start.assembly_modes`.  Dimensions and input are taken as exact numbers.

    Returns
    -------
    ModesCertificate
        Each mode by Krawczyk's test in ball arithmetic.  With revolute joints their number is compared with that of
        all complex modes for dimensions in general position, which isolated modes never exceed: a proof that none is
        missing where all are real.

    Raises
    ------
    GeometryError
        As `assembly_modes`.

    Notes
    -----
    [Krawczyk 1969]; theory/assembly-modes; isolated solutions are at most as many as for parameters in general
    position [Sommese & Wampler 2005], theorem 7.1.1.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> certify_modes(Mechanism.four_bar(2, 1, 2.5, 2.5), "30 deg")
    ModesCertificate(all 2 of at most 2 assembly modes found, each proved)
    """
    check_rounding()
    u = input_of(mechanism, input)
    found, system = tuple(assembly_modes(mechanism, u)), MechanismSystem(mechanism)
    poses = np.array([mode.pose for mode in found]).reshape(len(found), mechanism.graph.links, 3)
    samples = poses[:, system.moving].reshape(len(found), system.size)
    nodes = prove_nodes(system, exact(np.full(len(found), u)), samples)
    position, angle, _ = radii_of(system, nodes, samples)
    proved = np.isfinite(position)
    for i, j in combinations(np.flatnonzero(proved), 2):
        if not _differ(poses[i] - poses[j], position[i] + position[j], angle[i] + angle[j]):
            proved[j] = False
    revolute = all(isinstance(joint, Revolute) for joint in mechanism.joints)
    most = count_assembly_modes(mechanism.graph, [driver.pair for driver in mechanism.drivers]) if revolute else None
    return ModesCertificate(found, proved, position, angle, most)


def _differ(between: Array, position: float, angle: float) -> bool:
    """Whether two poses are further apart than both their radii, twice for what is rounded here."""
    turned = np.abs(np.remainder(between[:, 2] + np.pi, 2.0 * np.pi) - np.pi)
    moved = np.hypot(between[:, 0], between[:, 1])
    return bool((moved > 2.0 * position).any() or (turned > 2.0 * angle + 1e-12).any())
