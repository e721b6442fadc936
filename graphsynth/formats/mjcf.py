"""A dynamic model as MuJoCo XML (MJCF): a tree of bodies, loops closed by equality constraints (theory/exports 2).

The model is written in its start pose, and ``ref`` of every joint is the joint coordinate there, so that ``qpos`` are
the joint coordinates of graphsynth: ``theta_b - theta_a`` of a turning pair, the displacement of a sliding pair.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite, point, positive, three
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.model import DynamicModel, Rigid
from graphsynth.dynamics.start import StartReport
from graphsynth.formats.engine_run import turn
from graphsynth.formats.exporting import check_common, check_settings, gear_weights
from graphsynth.formats.mjcf_parts import Work, combine, fixed, site, text, write_load
from graphsynth.formats.trees import SpanningTree, spanning_tree
from graphsynth.mechanism.joints import Gear, JointGeometry, PinSlot, Prismatic, Revolute

Array = NDArray[np.float64]
Point = tuple[float, float]
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
        if not isinstance(self.integrator, str) or self.integrator not in INTEGRATORS:
            raise GeometryError(
                f"integrator = {self.integrator!r} is not MuJoCo's; give one of {', '.join(INTEGRATORS)}"
            )
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
        loop of sliding pairs and slots alone, a gear pair without carrier, a rotor between links on different branches
        of the tree; an inconsistent start, or one that is none.

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
    work = Work(model, start, spanning_tree(model.mechanism))
    root = ET.Element("mujoco", model="graphsynth")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    _options(root, model, settings)
    world = ET.SubElement(root, "worldbody")
    work.bodies[model.mechanism.frame], work.chain[model.mechanism.frame] = world, {}
    _hang(work, model.mechanism.frame)
    tendon, equality, actuator = (ET.Element(tag) for tag in ("tendon", "equality", "actuator"))
    for index in work.tree.cuts:
        _close(work, model.mechanism.joints[index], tendon, equality)
    for extra in model.additional:
        _close_extra(work, extra, equality)
    for number, element in enumerate(model.elements):
        write_load(work, element, f"e{number}", tendon, actuator)
    for constraint in equality:
        constraint.set("solref", text(*settings.constraint))
        constraint.set("solimp", text(*settings.solimp))
    root.extend(part for part in (tendon, equality, actuator) if len(part))
    key = ET.SubElement(root, "keyframe")
    ET.SubElement(key, "key", name="start", time=text(start.time), qpos=text(*work.qpos), qvel=text(*work.qvel))
    ET.indent(root)
    angles = np.zeros((model.mechanism.graph.links, len(work.names)))
    for link, signs in work.chain.items():
        for k, sign in signs.items():
            angles[link, k] = sign
    return MjcfModel(
        ET.tostring(root, encoding="unicode") + "\n", work.tree, tuple(work.names), np.array(work.qpos),
        np.array(work.qvel), angles, start, settings,
    )  # fmt: skip


def _options(root: ET.Element, model: DynamicModel, settings: MujocoSettings) -> None:
    option = ET.SubElement(
        root, "option", timestep=text(settings.step), integrator=settings.integrator, solver="Newton",
        jacobian="dense", tolerance="1e-14", iterations="100", gravity=text(*model.gravity, 0.0),
    )  # fmt: skip
    ET.SubElement(option, "flag", contact="disable", refsafe="disable")


def _hang(work: Work, link: int) -> None:
    """Write the bodies that hang on a link, depth first: the order in which the engine counts coordinates."""
    for child, index in work.tree.children(link):
        body = work.model.bodies[child]
        x, y, theta = (float(v) for v in work.start.poses[child])
        px, py, parent = (float(v) for v in work.start.poses[link])
        place, half = turn(-parent, (x - px, y - py)), 0.5 * (theta - parent)
        element = ET.SubElement(
            work.bodies[link], "body", name=f"link{child}", pos=text(*place, 0.0),
            quat=text(math.cos(half), 0.0, 0.0, math.sin(half)),
        )  # fmt: skip
        ET.SubElement(
            element, "inertial", pos=text(*body.centre, 0.0), mass=text(body.mass),
            diaginertia=text(body.inertia, body.inertia, body.inertia),
        )  # fmt: skip
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
    along = work.angle(joint.a) + joint.angle_a - work.angle(child)
    if child == joint.b:
        _slide(work, body, joint, turn(along, (1.0, 0.0)), d, rate)
        if isinstance(joint, PinSlot):
            _hinge(work, body, joint, child, joint.at_b)
        return
    if isinstance(joint, PinSlot):
        dx, dy = turn(joint.angle_a, (d, 0.0))
        _hinge(work, body, joint, child, (joint.at_a[0] + dx, joint.at_a[1] + dy))
    _slide(work, body, joint, turn(along, (-1.0, 0.0)), d, rate)


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
    attributes = {"type": "hinge", "pos": text(*at, 0.0), "axis": text(0.0, 0.0, sign), "ref": text(q)}
    ET.SubElement(body, "joint", {"name": name, **attributes})
    work.chain[child][len(work.names)] = sign
    _count(work, name, joint, q, rate, True)


def _slide(work: Work, body: ET.Element, joint: JointGeometry, axis: Point, d: float, rate: float) -> None:
    name = f"j{joint.a}_{joint.b}"
    ET.SubElement(body, "joint", name=name, type="slide", axis=text(*axis, 0.0), ref=text(d))
    _count(work, name, joint, d, rate, False)


def _count(work: Work, name: str, joint: JointGeometry, q: float, rate: float, hinge: bool) -> None:
    work.names.append((name, joint.a, joint.b))
    work.hinge.append(hinge)
    work.qpos.append(q)
    work.qvel.append(rate)


def _close(work: Work, joint: JointGeometry, tendon: ET.Element, equality: ET.Element) -> None:
    """Close a cut joint by an equality."""
    name = f"j{joint.a}_{joint.b}"
    if isinstance(joint, Revolute):
        sites = site(work, joint.a, joint.at_a), site(work, joint.b, joint.at_b)
        ET.SubElement(equality, "connect", name=name, site1=sites[0], site2=sites[1])
    elif isinstance(joint, Gear):
        _gear(work, joint, name, tendon, equality)
    elif isinstance(joint, Prismatic | PinSlot):
        raise GeometryError(f"{joint.kind} joint {joint.a}-{joint.b} closes a loop of sliding pairs; use exudyn for it")
    else:
        raise GeometryError(f"{joint.kind} joint {joint.a}-{joint.b}: MuJoCo has no such joint; leave it out")


def _close_extra(work: Work, extra: object, equality: ET.Element) -> None:
    if isinstance(extra, Revolute):
        sites = site(work, extra.a, extra.at_a), site(work, extra.b, extra.at_b)
        ET.SubElement(equality, "connect", site1=sites[0], site2=sites[1])
    elif isinstance(extra, Rigid):
        ET.SubElement(equality, "weld", body1=_body(work, extra.b), body2=_body(work, extra.a))
    else:
        raise GeometryError(f"additional {type(extra).__name__}: MuJoCo has no such constraint; leave it out")


def _body(work: Work, link: int) -> str:
    return "world" if link == work.model.mechanism.frame else f"link{link}"


def _gear(work: Work, gear: Gear, name: str, tendon: ET.Element, equality: ET.Element) -> None:
    combined = combine(work, gear_weights(work.model, gear))
    if len(combined) == 2:
        (k, wk), (m, wm) = combined.items()
        ET.SubElement(
            equality, "joint", name=name, joint1=work.names[k][0], joint2=work.names[m][0],
            polycoef=text(0.0, -wm / wk, 0.0, 0.0, 0.0),
        )  # fmt: skip
        return
    fixed(work, tendon, f"t_{name}", combined)
    ET.SubElement(equality, "tendon", name=name, tendon1=f"t_{name}", polycoef="0 0 0 0 0")
