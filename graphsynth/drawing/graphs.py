"""The kinematic diagram of a graph that has no dimensions: joints where the automatic sketch puts them."""

from __future__ import annotations

import cmath
from typing import TYPE_CHECKING

from graphsynth.core.errors import GraphError
from graphsynth.drawing.diagram import mechanism_sketch
from graphsynth.drawing.sketch import Sketch
from graphsynth.kinematics.dimensional.sketch import JointLayout, layout
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph


def graph_sketch(
    graph: MechanismGraph,
    *,
    driver: int | None = None,
    width: float = 480.0,
    height: float = 420.0,
    numbers: bool = True,
    title: str = "",
) -> tuple[Sketch, list[tuple[float, float, float]]]:
    """Build the kinematic diagram of a chain or a mechanism from its automatic sketch.

    Parameters
    ----------
    graph : MechanismGraph
        Planar (space 3), joints of mobility 1 (drawn as turning pairs) and 2 (drawn as a pin in a slot).  With a frame
        its joints stand on the ground; without one all links are alike.
    driver : int, optional
        Link on the frame whose joint gets the driver's arrow.
    width, height : float
        Largest size in pixels.
    numbers : bool
        Write the numbers of the links.
    title : str
        Read out by screen readers.

    Returns
    -------
    Sketch, list of (x, y, theta)
        The diagram and the pose it is drawn in: ``sketch.svg(pose)``.  The mean distance of neighbouring joints is 1;
        dimensions are those of a readable picture, nothing is said about motion.

    Raises
    ------
    GraphError
        Another space, a joint of higher mobility, a graph that is not connected.
    """
    if graph.space != 3 or any(joint.mobility > 2 for joint in graph.joints):
        raise GraphError("only planar graphs (space 3) with joints of mobility 1 and 2 have a kinematic diagram")
    places = layout(graph)
    framed = graph if graph.frame is not None else graph.with_frame(0)
    if driver is not None and not any({driver, graph.frame} == {a, b} for a, b, _ in graph.joints):
        raise GraphError(f"driver {driver} is not jointed to the frame; choose a link that is")
    drivers = () if driver is None or graph.frame is None else (Driver(graph.frame, driver),)
    pose = [(0.0, 0.0, 0.0)] * graph.links
    mechanism = Mechanism(framed, tuple(_joint(places, k) for k in range(len(graph.joints))), drivers, pose=tuple(pose))
    sketch = mechanism_sketch(
        mechanism, pose, width=width, height=height, numbers=numbers, grounded=graph.frame is not None, title=title
    )
    return sketch, pose


def _joint(places: JointLayout, k: int) -> JointGeometry:
    a, b, mobility = places.graph.joints[k]
    x, y = map(float, places.positions[k])
    if mobility == 1:
        return Revolute(a, b, (x, y), (x, y))
    # the slot runs towards the middle of its link
    cx, cy = map(float, places.outline(a).mean(axis=0))
    way = complex(cx - x, cy - y)
    return PinSlot(a, b, (x, y), (x, y), cmath.phase(way) if abs(way) > 1e-9 else 0.0)


def graph_svg(graph: MechanismGraph, *, driver: int | None = None, width: float = 480.0, title: str = "") -> str:
    """Kinematic diagram of a graph as one ``<svg>``; see :func:`graph_sketch`.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> svg = graph_svg(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0))
    >>> svg.count('data-part="joint'), svg.count('data-part="link')
    (4, 3)
    """
    sketch, pose = graph_sketch(graph, driver=driver, width=width, title=title)
    return sketch.svg(pose)
