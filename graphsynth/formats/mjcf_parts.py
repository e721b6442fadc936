"""Workspace of the MJCF writer, and the loads of a model as MJCF."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Element, Force, Spring, Torque, TorqueSource, TorsionSpring
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.start import StartReport
from graphsynth.formats.exporting import constant_torque
from graphsynth.formats.trees import SpanningTree

Point = tuple[float, float]


@dataclass
class Work:
    """Workspace of one export."""

    model: DynamicModel
    start: StartReport
    tree: SpanningTree
    names: list[tuple[str, int, int]] = field(default_factory=list)
    hinge: list[bool] = field(default_factory=list)
    qpos: list[float] = field(default_factory=list)
    qvel: list[float] = field(default_factory=list)
    chain: dict[int, dict[int, int]] = field(default_factory=dict)  # link -> coordinate -> sign of its hinge
    bodies: dict[int, ET.Element] = field(default_factory=dict)
    sites: int = 0

    def angle(self, link: int) -> float:
        """Angle of a link at the start."""
        return float(self.start.poses[link, 2])


def text(*values: float) -> str:
    """Shortest decimals that read back as the same doubles; -0 is written 0."""
    return " ".join(repr(float(v) + 0.0) for v in values)


def site(work: Work, link: int, at: Point) -> str:
    """Add a site to a link and return its name."""
    name, work.sites = f"s{work.sites}", work.sites + 1
    ET.SubElement(work.bodies[link], "site", name=name, pos=text(*at, 0.0))
    return name


def combine(work: Work, weights: dict[int, float]) -> dict[int, float]:
    """Return the combination of coordinates equal to a combination of link angles, but for a constant."""
    total: dict[int, float] = {}
    for link, weight in weights.items():
        for k, sign in work.chain[link].items():
            total[k] = total.get(k, 0.0) + weight * sign
    return {k: w for k, w in sorted(total.items()) if abs(w) > 1e-14}


def fixed(work: Work, tendon: ET.Element, name: str, combined: dict[int, float], **attributes: str) -> None:
    """Add a tendon whose length is a combination of coordinates."""
    element = ET.SubElement(tendon, "fixed", {"name": name, **attributes})
    for k, weight in combined.items():
        ET.SubElement(element, "joint", joint=work.names[k][0], coef=text(weight))


def write_load(work: Work, element: Element, name: str, tendon: ET.Element, actuator: ET.Element) -> None:
    """Write one spring, damper, torque or force."""
    if isinstance(element, Spring):
        spatial = ET.SubElement(
            tendon, "spatial", name=name, stiffness=text(element.stiffness), damping=text(element.damping),
            springlength=text(element.free_length),
        )  # fmt: skip
        for link, at in ((element.a, element.at_a), (element.b, element.at_b)):
            ET.SubElement(spatial, "site", site=site(work, link, at))
    elif isinstance(element, TorsionSpring):
        _torsion(work, element, name, tendon)
    elif isinstance(element, Torque | TorqueSource):
        _torque(work, element, name, tendon, actuator)
    elif isinstance(element, Force):
        _force(work, element, name, actuator)
    else:
        raise GeometryError(f"{type(element).__name__}: MuJoCo's dry friction is another law; leave the element out")


def _torsion(work: Work, spring: TorsionSpring, name: str, tendon: ET.Element) -> None:
    combined = combine(work, {spring.a: -1.0, spring.b: 1.0})
    if not combined:
        return  # the two links cannot turn against each other
    constant = work.angle(spring.b) - work.angle(spring.a) - sum(w * work.qpos[k] for k, w in combined.items())
    free = spring.free_angle - constant
    if free < 0.0:  # a rest length must not be negative
        free, combined = -free, {k: -w for k, w in combined.items()}
    fixed(
        work, tendon, name, combined, stiffness=text(spring.stiffness), damping=text(spring.damping),
        springlength=text(free),
    )  # fmt: skip


def _torque(work: Work, element: Torque | TorqueSource, name: str, tendon: ET.Element, actuator: ET.Element) -> None:
    torque, damping = constant_torque(element)
    rotor = element.ratio**2 * element.rotor_inertia if isinstance(element, TorqueSource) else 0.0
    combined = combine(work, {element.a: -1.0, element.b: 1.0})
    if not combined:
        return
    if rotor and not any(combined.keys() <= work.chain[link].keys() for link in (element.a, element.b)):
        raise GeometryError(
            f"the rotor of torque source {element.a}-{element.b}, {rotor:g} kg m^2 at its output, couples links on "
            "different branches of the tree, for which MuJoCo's inertia matrix has no entries: leave it out, or make "
            "the rotor a link of its own with a gear pair"
        )
    fixed(work, tendon, name, combined, damping=text(damping), armature=text(rotor))
    if torque:
        _constant(actuator, torque, tendon=name)


def _constant(actuator: ET.Element, size: float, **where: str) -> None:
    """Add an actuator that pushes with a constant force, without control."""
    ET.SubElement(
        actuator, "general", {**where, "gaintype": "fixed", "gainprm": "0", "biastype": "affine",
                              "biasprm": text(size, 0.0, 0.0)},
    )  # fmt: skip


def _force(work: Work, force: Force, name: str, actuator: ET.Element) -> None:
    if callable(force.force):
        raise GeometryError(f"force on link {force.link} is a function; an exported one must be constant")
    size = math.hypot(*force.force)
    if size == 0.0:
        return
    unit = (force.force[0] / size, force.force[1] / size)
    where = {"site": site(work, force.link, force.at), "gear": text(*unit, 0.0, 0.0, 0.0, 0.0)}
    if force.frame == "world":
        where["refsite"] = site(work, work.model.mechanism.frame, (0.0, 0.0))
    _constant(actuator, size, name=name, **where)
