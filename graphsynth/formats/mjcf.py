"""A dynamic model as MuJoCo XML (MJCF): a tree of bodies, loops closed by equality constraints (theory/exports 2).

The model is written in its start pose, and ``ref`` of every joint is the joint coordinate there, so that ``qpos`` are
the joint coordinates of graphsynth: ``theta_b - theta_a`` of a revolute joint, the displacement of a prismatic one.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import choice, finite, point, positive, three
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Element, Force, Spring, Torque, TorqueSource, TorsionSpring
from graphsynth.dynamics.model import Coupling, DynamicModel, Rigid
from graphsynth.dynamics.start import StartReport
from graphsynth.formats.exporting import (
    SpanningTree,
    check_common,
    check_settings,
    constant_torque,
    gear_weights,
    spanning_tree,
    turn,
)
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute

Point = tuple[float, float]


@dataclass
class Work:
    """Workspace of one export."""

    model: DynamicModel
    start: StartReport
    tree: SpanningTree
    names: list[tuple[str, int, int]] = field(default_factory=list)
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


def add(parent: ET.Element, tag: str, **attributes: str | float | tuple[float, ...]) -> ET.Element:
    """Add an element; numbers are written by `text`."""
    written = {
        name: value if isinstance(value, str) else text(*value) if isinstance(value, tuple) else text(value)
        for name, value in attributes.items()
    }
    return ET.SubElement(parent, tag, written)


def site(work: Work, link: int, at: Point) -> str:
    """Add a site to a link and return its name."""
    name, work.sites = f"s{work.sites}", work.sites + 1
    add(work.bodies[link], "site", name=name, pos=(*at, 0.0))
    return name


def combine(work: Work, weights: dict[int, float]) -> dict[int, float]:
    """Return the combination of coordinates equal to a combination of link angles, but for a constant."""
    total: dict[int, float] = {}
    for link, weight in weights.items():
        for k, sign in work.chain[link].items():
            total[k] = total.get(k, 0.0) + weight * sign
    return {k: w for k, w in sorted(total.items()) if abs(w) > 1e-14}


def fixed(work: Work, tendon: ET.Element, name: str, combined: dict[int, float], **attributes: float) -> None:
    """Add a tendon whose length is a combination of coordinates."""
    element = add(tendon, "fixed", name=name, **attributes)
    for k, weight in combined.items():
        add(element, "joint", joint=work.names[k][0], coef=weight)


def write_load(work: Work, element: Element, name: str, tendon: ET.Element, actuator: ET.Element) -> None:
    """Write one spring, damper, torque or force."""
    if isinstance(element, Spring):
        own = {"stiffness": element.stiffness, "damping": element.damping, "springlength": element.free_length}
        spatial = add(tendon, "spatial", name=name, **own)
        for link, at in ((element.a, element.at_a), (element.b, element.at_b)):
            add(spatial, "site", site=site(work, link, at))
    elif isinstance(element, TorsionSpring):
        combined = combine(work, {element.a: -1.0, element.b: 1.0})
        if not combined:
            return  # the two links cannot turn against each other
        constant = work.angle(element.b) - work.angle(element.a) - sum(w * work.qpos[k] for k, w in combined.items())
        free = element.free_angle - constant
        if free < 0.0:  # a rest length must not be negative
            free, combined = -free, {k: -w for k, w in combined.items()}
        own = {"stiffness": element.stiffness, "damping": element.damping, "springlength": free}
        fixed(work, tendon, name, combined, **own)
    elif isinstance(element, Torque | TorqueSource):
        _torque(work, element, name, tendon, actuator)
    elif isinstance(element, Force):
        if callable(element.force):
            raise GeometryError(f"force on link {element.link} is a function; an exported one must be constant")
        size = math.hypot(*element.force)
        if size == 0.0:
            return
        unit = (element.force[0] / size, element.force[1] / size)
        where = {"site": site(work, element.link, element.at), "gear": text(*unit, 0.0, 0.0, 0.0, 0.0)}
        if element.frame == "world":
            where["refsite"] = site(work, work.model.mechanism.frame, (0.0, 0.0))
        _constant(actuator, size, name=name, **where)
    else:
        raise GeometryError(f"{type(element).__name__}: MuJoCo's dry friction is another law; leave the element out")


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
    fixed(work, tendon, name, combined, damping=damping, armature=rotor)
    if torque:
        _constant(actuator, torque, tendon=name)


def _constant(actuator: ET.Element, size: float, **where: str) -> None:
    """Add an actuator that pushes with a constant force, without control."""
    bias = (size, 0.0, 0.0)
    add(actuator, "general", **where, gaintype="fixed", gainprm="0", biastype="affine", biasprm=bias)


Array = NDArray[np.float64]
#: MuJoCo's own bound of masses and inertias.
_LEAST = 1e-15
INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")


@dataclass(frozen=True)
class MujocoSettings:
    """How MuJoCo integrates and how stiff its loops are.

    Parameters
    ----------
    step : float
        Seconds.
    integrator : {"RK4", "Euler", "implicit", "implicitfast"}
    solref : (float, float), optional
        Two negative numbers: minus stiffness and minus damping of the loop constraints (1/s^2, 1/s); two positive
        ones: time constant (s) and damping ratio.  By default ``(-1/step^2, -2/step)``, critically damped and as
        stiff as the step bears.
    solimp : (float, float, float)
        Impedance of the constraints.

    Examples
    --------
    >>> MujocoSettings(1e-3).constraint
    (-1000000.0, -2000.0)
    """

    step: float = 1e-4
    integrator: str = "RK4"
    solref: tuple[float, float] | None = None
    solimp: tuple[float, float, float] = (0.9999, 0.9999, 0.001)

    def __post_init__(self) -> None:
        positive("step", self.step)
        choice("integrator", self.integrator, INTEGRATORS)
        if self.solref is not None:
            object.__setattr__(self, "solref", point("solref", self.solref))
        object.__setattr__(self, "solimp", tuple(finite("solimp", part) for part in three("solimp", self.solimp)))
        if self.solref is not None and not (min(self.solref) > 0.0 or max(self.solref) < 0.0):
            raise GeometryError(f"solref = {self.solref}: give two positive or two negative numbers")

    @property
    def constraint(self) -> tuple[float, float]:
        """The ``solref`` in use."""
        return self.solref or (-float(f"{self.step**-2:.12g}"), -float(f"{2.0 / self.step:.12g}"))

    @property
    def text(self) -> str:
        """Integrator and constraint parameters in one line."""
        a, b = self.constraint
        return f"{self.integrator}, solref {a:g} {b:g}, solimp {' '.join(f'{v:g}' for v in self.solimp)}"

    @property
    def family(self) -> str:
        """What stays the same when only the step changes."""
        return self.text if self.solref else f"{self.integrator}, solref by step"


@dataclass(frozen=True, eq=False)
class MjcfModel:
    """An MJCF text and the map of its coordinates.

    Attributes
    ----------
    xml : str
        The same bytes for the same model, start and settings.
    tree : SpanningTree
    coordinates : tuple of (name, base, link)
        Engine joint name and the graphsynth coordinate it is: of ``link`` relative to ``base``; in the engine's order.
    qpos, qvel : ndarray
        Start, also the keyframe "start" of the text.
    angles : ndarray, shape (links, coordinates)
        ``theta = theta_start + angles @ (qpos - qpos_start)``.
    start : StartReport
    settings : MujocoSettings
    """

    xml: str
    tree: SpanningTree
    coordinates: tuple[tuple[str, int, int], ...]
    qpos: Array
    qvel: Array
    angles: Array
    start: StartReport
    settings: MujocoSettings


def to_mjcf(model: DynamicModel, start: StartReport, settings: MujocoSettings | None = None) -> MjcfModel:
    """Write a model for MuJoCo (the text is exact: every number reads back as the same double).

    Bodies with mass, inertia and centre of mass; R and P joints and slots in a tree; loops closed by ``connect``
    between two sites; gear pairs as ``joint`` or ``tendon`` equalities; springs and dampers as tendons; constant
    forces and torques as actuators without control; rotor inertia as armature; contact disabled.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
        From :func:`graphsynth.dynamics.consistent_start`; its pose is the reference pose, its state the keyframe.
    settings : MujocoSettings, optional

    Returns
    -------
    MjcfModel

    Raises
    ------
    GeometryError
        What MuJoCo cannot say: cams, joint friction, loads that are functions, prescribed motion, massless links, a
        loop of prismatic joints and slots alone, a gear pair without carrier, a rotor between links on different
        branches of the tree; an inconsistent start, or one that is none.

    References
    ----------
    See theory/exports 2; [Todorov et al. 2012], MuJoCo.

    Examples
    --------
    >>> from graphsynth.dynamics import Body, consistent_start
    >>> from graphsynth import Driver, Mechanism, MechanismGraph
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> export = to_mjcf(model, consistent_start(model, keep={(0, 1): 0.5}))
    >>> export.coordinates, export.qpos.tolist(), export.tree.cuts
    ((('j0_1', 0, 1),), [0.5], ())
    """
    settings = MujocoSettings() if settings is None else settings
    check_settings(settings, MujocoSettings)
    _check(model, start)
    work = Work(model, start, spanning_tree(model.mechanism))
    root = ET.Element("mujoco", model="graphsynth")
    add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    _options(root, model, settings)
    world = add(root, "worldbody")
    work.bodies[model.mechanism.frame], work.chain[model.mechanism.frame] = world, {}
    _hang(work, model.mechanism.frame)
    tendon, equality, actuator = (ET.Element(tag) for tag in ("tendon", "equality", "actuator"))
    for index in work.tree.cuts:
        joint = model.mechanism.joints[index]
        _close(work, joint, {"name": f"j{joint.a}_{joint.b}"}, tendon, equality)
    for extra in model.additional:
        _close(work, extra, {}, tendon, equality)
    for number, element in enumerate(model.elements):
        write_load(work, element, f"e{number}", tendon, actuator)
    for constraint in equality:
        constraint.set("solref", text(*settings.constraint))
        constraint.set("solimp", text(*settings.solimp))
    root.extend(part for part in (tendon, equality, actuator) if len(part))
    key = add(root, "keyframe")
    add(key, "key", name="start", time=start.time, qpos=tuple(work.qpos), qvel=tuple(work.qvel))
    ET.indent(root)
    angles = np.zeros((model.mechanism.graph.links, len(work.names)))
    for link, signs in work.chain.items():
        for k, sign in signs.items():
            angles[link, k] = sign
    xml = ET.tostring(root, encoding="unicode") + "\n"
    qpos, qvel = np.array(work.qpos), np.array(work.qvel)
    return MjcfModel(xml, work.tree, tuple(work.names), qpos, qvel, angles, start, settings)


def _check(model: DynamicModel, start: StartReport) -> None:
    check_common(model, start, "MuJoCo")
    for link, body in model.bodies.items():
        if min(body.mass, body.inertia) <= _LEAST:
            raise GeometryError(
                f"mass = {body.mass:g} kg and inertia = {body.inertia:g} kg m^2 of link {link}: MuJoCo takes none "
                f"below {_LEAST:g}; change the units, or leave out what hardly weighs"
            )
    if model.prescribed:
        pair = model.prescribed[0].pair
        raise GeometryError(f"prescribed motion of joint {pair[0]}-{pair[1]}: MuJoCo has none; use exudyn or a torque")


def _options(root: ET.Element, model: DynamicModel, settings: MujocoSettings) -> None:
    solver = {"solver": "Newton", "jacobian": "dense", "tolerance": "1e-14", "iterations": "100"}
    option = add(root, "option", timestep=settings.step, integrator=settings.integrator, **solver)
    option.set("gravity", text(*model.gravity, 0.0))
    add(option, "flag", contact="disable", refsafe="disable")


def _hang(work: Work, link: int) -> None:
    """Write the bodies that hang on a link, depth first: the order in which the engine counts coordinates."""
    for child, index in work.tree.children(link):
        body = work.model.bodies[child]
        x, y, theta = (float(v) for v in work.start.poses[child])
        px, py, parent = (float(v) for v in work.start.poses[link])
        place, half = turn(-parent, (x - px, y - py)), 0.5 * (theta - parent)
        turned = (math.cos(half), 0.0, 0.0, math.sin(half))
        element = add(work.bodies[link], "body", name=f"link{child}", pos=(*place, 0.0), quat=turned)
        add(element, "inertial", pos=(*body.centre, 0.0), mass=body.mass, diaginertia=(body.inertia,) * 3)
        work.bodies[child], work.chain[child] = element, dict(work.chain[link])
        _joint(work, element, work.model.mechanism.joints[index], child)
        _hang(work, child)


def _joint(work: Work, body: ET.Element, joint: JointGeometry, child: int) -> None:
    """Write the engine joints of a tree edge; the engine applies them in order, so a slot is slide then hinge."""
    if isinstance(joint, Revolute):
        _hinge(work, body, joint, child, joint.at_b if child == joint.b else joint.at_a)
        return
    assert isinstance(joint, Prismatic | PinSlot)
    d, rate = displacement(joint, work.start)
    if child != joint.b and isinstance(joint, PinSlot):
        dx, dy = turn(joint.angle_a, (d, 0.0))
        _hinge(work, body, joint, child, (joint.at_a[0] + dx, joint.at_a[1] + dy))
    along = work.angle(joint.a) + joint.angle_a - work.angle(child)
    axis = (*turn(along, (1.0 if child == joint.b else -1.0, 0.0)), 0.0)
    name = f"j{joint.a}_{joint.b}"
    add(body, "joint", name=name, type="slide", axis=axis, ref=d)
    _count(work, name, joint, d, rate)
    if child == joint.b and isinstance(joint, PinSlot):
        _hinge(work, body, joint, child, joint.at_b)


def displacement(joint: Prismatic | PinSlot, start: StartReport) -> tuple[float, float]:
    """Displacement of ``at_b`` along the line of link a, and its rate, at the start."""
    poses, rates = start.poses, start.velocities
    arms = [turn(float(poses[k, 2]), p) for k, p in ((joint.a, joint.at_a), (joint.b, joint.at_b))]
    place = [poses[k, :2] + arm for k, arm in zip((joint.a, joint.b), arms)]
    speed = [rates[k, :2] + rates[k, 2] * np.array([-arm[1], arm[0]]) for k, arm in zip((joint.a, joint.b), arms)]
    along = np.array(turn(float(poses[joint.a, 2]) + joint.angle_a, (1.0, 0.0)))
    return float((place[1] - place[0]) @ along), float((speed[1] - speed[0]) @ along)


def _hinge(work: Work, body: ET.Element, joint: JointGeometry, child: int, at: Point) -> None:
    sign = 1 if child == joint.b else -1
    q = work.angle(joint.b) - work.angle(joint.a)
    rate = float(work.start.velocities[joint.b, 2] - work.start.velocities[joint.a, 2])
    suffix = "_turn" if isinstance(joint, PinSlot) else ""
    name = f"j{joint.a}_{joint.b}{suffix}"
    add(body, "joint", name=name, type="hinge", pos=(*at, 0.0), axis=(0.0, 0.0, sign), ref=q)
    work.chain[child][len(work.names)] = sign
    _count(work, name, joint, q, rate)


def _count(work: Work, name: str, joint: JointGeometry, q: float, rate: float) -> None:
    work.names.append((name, joint.a, joint.b))
    work.qpos.append(q)
    work.qvel.append(rate)


def _close(
    work: Work, joint: JointGeometry | Coupling, name: dict[str, str], tendon: ET.Element, equality: ET.Element
) -> None:
    """Close a cut joint, which has a name, or an additional one by an equality."""
    if isinstance(joint, Revolute):
        sites = site(work, joint.a, joint.at_a), site(work, joint.b, joint.at_b)
        add(equality, "connect", **name, site1=sites[0], site2=sites[1])
    elif isinstance(joint, Gear):
        combined = combine(work, gear_weights(work.model, joint))
        if len(combined) == 2:
            (k, wk), (m, wm) = combined.items()
            ends = {"joint1": work.names[k][0], "joint2": work.names[m][0]}
            add(equality, "joint", **name, **ends, polycoef=(0.0, -wm / wk, 0.0, 0.0, 0.0))
            return
        length = f"t_{name['name']}"
        fixed(work, tendon, length, combined)
        add(equality, "tendon", **name, tendon1=length, polycoef="0 0 0 0 0")
    elif isinstance(joint, Rigid):
        frame = work.model.mechanism.frame
        bodies = ["world" if link == frame else f"link{link}" for link in (joint.b, joint.a)]
        add(equality, "weld", body1=bodies[0], body2=bodies[1])
    elif name and isinstance(joint, Prismatic | PinSlot):
        raise GeometryError(f"{joint.kind} {joint.a}-{joint.b} closes a loop of prismatic joints; use exudyn for it")
    else:
        cam = f"{joint.kind} joint {joint.a}-{joint.b}" if isinstance(joint, Cam) else ""
        raise GeometryError(f"{cam or f'additional {type(joint).__name__}'}: MuJoCo has no such joint; leave it out")
