"""What exports to other engines share: refusals, gear pairs, torques, the spanning tree, what a run gives back.

The spanning tree and the joints that are cut are what an engine of joint coordinates needs, see theory/exports 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.core.extras import need
from graphsynth.dynamics.elements import Torque, TorqueSource
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.start import StartReport, check_start
from graphsynth.mechanism.joints import Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

Point = tuple[float, float]


def check_common(model: DynamicModel, start: StartReport, engine: str) -> None:
    """Refuse what no engine here can run."""
    if isinstance(start, StartReport) and not start.consistent:
        raise GeometryError(f"the start is not consistent, so {engine} would run another mechanism: {start.message}")
    check_start(model, start)
    if model.massless:
        raise GeometryError(f"links {list(model.massless)} have no mass or inertia; {engine} needs both positive")


def check_settings(settings: Any, kind: type) -> None:
    """Refuse settings of another engine."""
    if not isinstance(settings, kind):
        raise GeometryError(f"settings are {type(settings).__name__}, not {kind.__name__}; give these, or none")


def _bears(model: DynamicModel, link: int, wheel: int, centre: Point) -> bool:
    """Whether the centre of a wheel is fixed in a link: revolute joints of both, at one point of one link."""
    for middle, spot in [(wheel, centre), *_hinges(model, wheel, centre)]:
        if middle == link or any(other == link for other, _ in _hinges(model, middle, spot)):
            return True
    return False


def _hinges(model: DynamicModel, link: int, at: Point) -> list[tuple[int, Point]]:
    """Links that turn on a link at the given point of it, and the point in them."""
    found = []
    for joint in model.mechanism.joints:
        if isinstance(joint, Revolute) and link in (joint.a, joint.b):
            own, other = (joint.at_a, joint.at_b) if joint.a == link else (joint.at_b, joint.at_a)
            if math.dist(own, at) <= 1e-12 * max(1.0, math.hypot(*at)):
                found.append((joint.b if joint.a == link else joint.a, other))
    return found


def gear_weights(model: DynamicModel, gear: Gear) -> dict[int, float]:
    """Weights of the link angles whose sum a gear pair keeps constant."""
    others = sorted(set(range(model.mechanism.graph.links)) - {gear.a, gear.b})
    wheels = ((gear.a, gear.at_a), (gear.b, gear.at_b))
    carrier = next((link for link in others if all(_bears(model, link, *wheel) for wheel in wheels)), None)
    if carrier is None:
        pair = f"{gear.a}-{gear.b}"
        raise GeometryError(f"gear pair {pair} has no link that bears both wheels at their centres; give one")
    sign = -1.0 if gear.internal else 1.0
    weights = {gear.a: gear.radius_a, gear.b: sign * gear.radius_b}
    weights[carrier] = weights.get(carrier, 0.0) - gear.radius_a - sign * gear.radius_b
    largest = max(gear.radius_a, gear.radius_b)
    return {link: w / largest for link, w in weights.items()}


def constant_torque(element: Torque | TorqueSource) -> tuple[float, float]:
    """Return torque and viscous damping of an element on its link b."""
    torque, pair = element.torque, f"{element.a}-{element.b}"
    if callable(torque):
        raise GeometryError(f"torque {pair} is a function; an exported one must be constant")
    if isinstance(element, Torque):
        return torque, 0.0
    if element.efficiency != 1.0 and torque != 0.0:
        raise GeometryError(
            f"efficiency = {element.efficiency} of torque source {pair} depends on the flow of power; an exported "
            "train must have efficiency 1"
        )
    return torque * element.ratio, element.ratio**2 * element.rotor_damping


@dataclass(frozen=True)
class SpanningTree:
    """A tree rooted at the frame.

    Attributes
    ----------
    edges : tuple of (parent, link, joint)
        Joints as indices into ``mechanism.joints``; parents come before their children.
    cuts : tuple of int
        The other joints, ascending; gears and cams are always among them.
    """

    edges: tuple[tuple[int, int, int], ...]
    cuts: tuple[int, ...]

    def children(self, link: int) -> tuple[tuple[int, int], ...]:
        """(link, joint) of the links that hang on ``link``."""
        return tuple((child, joint) for parent, child, joint in self.edges if parent == link)


@checked
def spanning_tree(mechanism: Mechanism) -> SpanningTree:
    """Choose the tree: prismatic joints and slots stay in it, revolute joints are cut, the depth is small (exact).

    A cut revolute joint is one pair of points that coincide, which every engine knows; a cut prismatic joint is not.
    So the tree holds as many prismatic joints and slots as it can, and the rest is filled breadth first from the frame.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    SpanningTree

    Raises
    ------
    GraphError
        A link held by gears or cams alone.

    References
    ----------
    See theory/exports 2.

    Examples
    --------
    >>> from graphsynth.mechanism.model import MechanismGraph
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> slider_crank = Mechanism(graph, [
    ...     Revolute(0, 1), Revolute(1, 2, (0.1, 0.0)), Revolute(2, 3, (0.3, 0.0)), Prismatic(0, 3)])
    >>> spanning_tree(slider_crank)
    SpanningTree(edges=((0, 3, 1), (0, 1, 0), (3, 2, 3)), cuts=(2,))
    """
    import networkx

    joints = mechanism.joints
    # prismatic joints, then slots, without a cycle (Kruskal)
    sliding = networkx.Graph()
    for index, joint in enumerate(joints):
        if isinstance(joint, Prismatic | PinSlot):
            weight = index + len(joints) * isinstance(joint, PinSlot)
            sliding.add_edge(joint.a, joint.b, weight=weight, index=index)
    slides = {data["index"] for *_, data in networkx.minimum_spanning_edges(sliding)}
    edges: list[tuple[int, int, int]] = []
    seen: set[int] = set()

    def reach(start: int) -> list[int]:
        """Walk the chosen sliding joints from ``start``; return the links reached, ``start`` first."""
        seen.add(start)
        reached = [start]
        for link in reached:
            for index in sorted(slides):
                other = _across(joints[index], link)
                if other is not None and other not in seen:
                    seen.add(other)
                    edges.append((link, other, index))
                    reached.append(other)
        return reached

    layer = reach(mechanism.frame)
    for link in layer:
        for index, joint in enumerate(joints):
            other = _across(joint, link)
            if isinstance(joint, Revolute) and other is not None and other not in seen:
                edges.append((link, other, index))
                layer += reach(other)
    missing = sorted(set(range(mechanism.graph.links)) - seen)
    if missing:
        raise GraphError(f"links {missing} hang on gears or cams alone; give each a revolute or prismatic joint")
    used = {index for *_, index in edges}
    return SpanningTree(tuple(edges), tuple(k for k in range(len(joints)) if k not in used))


def _across(joint: JointGeometry, link: int) -> int | None:
    """Return the other link of a joint, None if the joint is elsewhere."""
    return joint.b if joint.a == link else joint.a if joint.b == link else None


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EngineRun:
    """The motion that an engine computed (estimated; nothing is known of its error until it is compared).

    Attributes
    ----------
    settings : str
        Integrator, constraint parameters.
    step : float
        Seconds.
    poses, velocities : ndarray, shape (n, links, 3)
        ``(x, y, theta)`` of the link frames, m and rad; NaN from where the engine failed.
    status : str
        "completed" or "failed".
    seconds : float
        Wall time of the integration alone.
    """

    engine: str
    version: str
    settings: str
    step: float
    times: Array
    poses: Array
    velocities: Array
    status: str
    message: str
    steps: int
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether the last output time was reached with finite numbers."""
        return self.status == "completed"


def finished(
    engine: str,
    version: str,
    settings: Any,
    times: Array,
    motion: tuple[Array, Array],
    message: str,
    steps: int,
    seconds: float,
) -> EngineRun:
    """Return a run; it failed if there is a message."""
    status, said = ("failed", message) if message else ("completed", "reached the last output time")
    return EngineRun(engine, version, settings.text, settings.step, times, *motion, status, said, steps, seconds)


def load_engine(name: str) -> Any:
    """Import an engine; `MissingExtraError` if it is not installed."""
    return need(name, "crosscheck", "a run in another engine")


def steps_between(times: ArrayLike, step: float) -> tuple[Array, list[int]]:
    """Return the times and the whole numbers of steps from the first to each of them."""
    grid = finite_array("times", times, nan=True)
    if grid.ndim != 1 or grid.size < 2 or not np.isfinite(grid).all() or (np.diff(grid) <= 0.0).any():
        raise GeometryError("times must be a list of two or more finite numbers that increase; sort them")
    if not (np.isfinite(step) and step > 0.0):
        raise GeometryError(f"step = {step} s must be positive; give the step of the engine")
    counts = (grid - grid[0]) / step
    whole = np.rint(counts)
    if (np.abs(counts - whole) > 1e-6 * np.maximum(1.0, whole)).any() or (np.diff(whole) < 1.0).any():
        raise GeometryError(f"step = {step} s does not divide the output times; give a step that does")
    return grid, [int(n) for n in whole]


def turn(angle: float, place: tuple[float, float]) -> tuple[float, float]:
    """Turn a point or vector by an angle (rad)."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return c * place[0] - s * place[1], s * place[0] + c * place[1]
