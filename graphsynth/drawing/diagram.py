"""Kinematic diagrams of dimensioned mechanisms: the joints' and links' symbols, each fixed to its link.

Symbols follow ISO 3952: revolute joints are open circles, those on the frame stand on hatched ground, a slider is a
block on its guide, a pin runs in a slot, gears are dash-dotted pitch circles.  The driven link and the arrow of its
sense are drawn in a second colour.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.bodies import bodies, bounds
from graphsynth.drawing.sketch import Sketch
from graphsynth.drawing.symbols import (
    BLOCK,
    Plan,
    draw_arrow,
    draw_joints,
    draw_link,
    draw_points,
    draw_slider,
    draw_traces,
    place_letters,
)
from graphsynth.mechanism.joints import PinSlot, Prismatic
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]

_MARGIN = 40.0


def mechanism_sketch(
    mechanism: Mechanism,
    poses: ArrayLike,
    *,
    width: float = 480.0,
    height: float = 420.0,
    numbers: bool = True,
    grounded: bool = True,
    traces: bool = True,
    title: str = "",
) -> Sketch:
    """Build the diagram of a mechanism, with room for all the poses given.

    `poses` (shape (n, links, 3) or (links, 3)): assembled poses ``(x, y, theta)``.  Guides are as long as the travel in
    them; named points are traced over them. `width`, `height`: largest size in pixels. `numbers`: write the numbers of
    the links. `grounded`: draw the frame as ground; False shows a chain, whose links are all alike. `traces`: draw the
    paths of the named points. `title`: read out by screen readers. Its shapes are fixed to the links:
    ``sketch.svg(pose)`` for any pose. Raises `GeometryError` if a pose is not finite or does not fit the mechanism.
    """
    array = _checked(mechanism, poses)
    lower, upper = bounds(mechanism, array)
    size = upper - lower
    scale = min((width - 2 * _MARGIN) / size.real, (height - 2 * _MARGIN) / size.imag)
    least = 200.0 - 2 * _MARGIN  # a narrow mechanism is centred on a picture that has room for letters
    spare = max(0.0, least / scale - size.real) / 2
    lower, upper = lower - spare, upper + spare
    title = title or f"Kinematic diagram, {mechanism.graph.links} links"
    sketch = Sketch(lower, upper, (upper - lower).real * scale + 2 * _MARGIN, _MARGIN, title)
    reserve = (BLOCK + 5.0) / scale
    plan = Plan(mechanism, array, sketch, bodies(mechanism, array, reserve), grounded)
    if traces and len(array) > 1:
        draw_traces(plan)
    for body in plan.bodies:
        draw_link(plan, body)
    for joint in mechanism.joints:
        if isinstance(joint, Prismatic | PinSlot):
            draw_slider(plan, joint)
    grounds = draw_joints(plan)
    if grounded:
        for driver in mechanism.drivers:
            draw_arrow(plan, driver, grounds)
    draw_points(plan)
    place_letters(plan, grounds, numbers)
    sketch.on()
    return sketch


def _checked(mechanism: Mechanism, poses: ArrayLike) -> Array:
    array = np.asarray(poses, dtype=np.float64)
    if array.ndim == 2:
        array = array[None]
    links = mechanism.graph.links
    if array.ndim != 3 or array.shape[1:] != (links, 3) or len(array) == 0:
        raise GeometryError(f"poses have shape {np.shape(poses)}; give (x, y, theta) for each of the {links} links")
    if not np.isfinite(array).all():
        raise GeometryError("a pose that is not finite cannot be drawn; give an assembled one")
    return array


def _pose_of(what: Mechanism | Motion, pose: ArrayLike | int | None) -> tuple[Mechanism, Array, Array]:
    """Return the mechanism, the poses that the picture must hold, and the one that is drawn."""
    if isinstance(what, Mechanism):
        given = what.pose if pose is None else pose
        if given is None or isinstance(given, int):
            raise GeometryError("the mechanism has no pose to draw; give one, or a motion and a sample")
        array = _checked(what, given)
        return what, array, array[0]
    reached: NDArray[np.bool_] = np.asarray(np.isfinite(what.poses).all(axis=(1, 2)))
    sample = 0 if pose is None else pose
    if not isinstance(sample, int | np.integer):
        raise GeometryError("a motion is drawn at a sample: give its number")
    if not -len(reached) <= sample < len(reached):
        raise GeometryError(f"sample {sample} does not exist; the motion has {len(reached)}")
    if not reached[sample]:
        raise GeometryError(f"sample {sample} cannot be drawn, it is not assembled: {what.reason or 'no pose'}")
    return what.mechanism, what.poses[reached], what.poses[sample]


def mechanism_svg(
    what: Mechanism | Motion,
    pose: ArrayLike | int | None = None,
    *,
    width: float = 480.0,
    height: float = 420.0,
    numbers: bool = True,
    title: str = "",
) -> str:
    """Kinematic diagram as one self-contained ``<svg>``, light or dark with the page; needs no third-party package.

    `what`: a motion shows the paths of the named points too. `pose` (shape (links, 3)): pose of a mechanism (its own by
    default), or sample of a motion (the first by default). `width`, `height`: largest size in pixels. `numbers`: write
    the numbers of the links. `title`: read out by screen readers. Raises `GeometryError`: there is no pose, or it is
    not assembled.

    >>> from graphsynth import Driver, Mechanism, MechanismGraph, Revolute
    >>> graph = MechanismGraph(2, [(0, 1)], frame=0)
    >>> crank = Mechanism(graph, [Revolute(0, 1)], [Driver(0, 1)], {"A": (1, (1, 0))}, pose=[(0, 0, 0), (0, 0, 0.5)])
    >>> mechanism_svg(crank).count('data-part="joint 0-1"')
    1
    """
    mechanism, poses, one = _pose_of(what, pose)
    sketch = mechanism_sketch(mechanism, poses, width=width, height=height, numbers=numbers, title=title)
    return sketch.svg(one.tolist())


def draw_mechanism(
    what: Mechanism | Motion,
    pose: ArrayLike | int | None = None,
    *,
    ax: object | None = None,
    width: float = 480.0,
    height: float = 420.0,
    numbers: bool = True,
) -> object:
    """Kinematic diagram on matplotlib axes: the same shapes as :func:`mechanism_svg`, in data coordinates.

    `what`, `pose`, `width`, `height`, `numbers`: as for :func:`mechanism_svg`. `ax`: axes of a new figure by default
    (``ax.figure.savefig(...)`` writes it). Raises `GeometryError`: there is no pose, or it is not assembled.
    """
    from graphsynth.drawing.export import Canvas, figure_of

    mechanism, poses, one = _pose_of(what, pose)
    sketch = mechanism_sketch(mechanism, poses, width=width, height=height, numbers=numbers)
    if ax is None:
        figure, _ = figure_of([sketch], [one.tolist()])
        return figure.axes[0]
    Canvas(sketch, ax, one.tolist())
    return ax
