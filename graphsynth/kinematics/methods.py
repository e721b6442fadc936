"""Methods of a `Motion` that show it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.shown import Shown, work
from graphsynth.kinematics.instantaneous import (
    Circles,
    Polodes,
    bresse_circle,
    inflection_circle,
    instant_centre,
    mechanical_advantage,
    polodes,
    transmission_index,
)
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.drawing.methods import Drawing
    from graphsynth.drawing.plots import Chart
    from graphsynth.dynamics.static import StaticForces
    from graphsynth.jamming.joints.assess import CoupledReport
    from graphsynth.kinematics.engine.result import Closure, Motion, MotionEvent
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


class MotionMethods(Shown):
    """Methods that every `Motion` has."""

    if TYPE_CHECKING:
        mechanism: Mechanism
        inputs: Array
        events: tuple[MotionEvent, ...]
        completed: bool
        reason: str
        closure: Closure

        residual: Any

    def plot(self, of: str | int | None = None, order: int = 0, *, ax: Any = None) -> Chart:
        """Plot paths of the named points, or coordinates over the input.

        Parameters
        ----------
        of : str or int, optional
            A named point, or a link: its x and y, its angle or displacement over the input.  Without it the paths of
            all named points; if there are none, the coordinates of the undriven links on the frame.
        order : {0, 1, 2}
            1 and 2 are first and second derivatives by the input.
        ax : matplotlib.axes.Axes, optional
            Drawn on these axes too.

        Returns
        -------
        Chart
            Shows itself in a notebook; ``.save("chart.png")`` writes it, ``.draw(ax)`` draws it on matplotlib axes.

        Raises
        ------
        GeometryError
            An unknown point or link, another order.
        """
        chart: Chart = work("plot motion")(self, of, order)
        if ax is not None:
            chart.draw(ax)
        return chart

    def animate(self, path: str | Path | None = None, **options: Any) -> Drawing:
        """Animate the motion, and write it to a file if a path is given.

        Parameters
        ----------
        path : path-like, optional
            ``.html``: a page with a player; ``.svg``: a picture that moves by itself; ``.gif``.
        **options
            ``frames``, ``seconds``, ``title``, ``width``, ``height`` as for
            :func:`graphsynth.drawing.animation.animation_html`.

        Returns
        -------
        Drawing
            An SVG that moves by itself; shows itself in a notebook.

        Raises
        ------
        GraphsynthError
            Another suffix; nothing of the motion is assembled.
        """
        found: Drawing = work("animate motion")(self, path, **options)
        return found

    def draw(self, path: str | Path | None = None, sample: int = 0, **options: Any) -> Drawing:
        """Draw the mechanism at one sample with the paths of its named points; see `Mechanism.draw`."""
        found: Drawing = work("draw motion")(self, path, sample, **options)
        return found

    def instant_centre(self, link: int, base: int | None = None) -> Array:
        """Return the instant centre of a link; see :func:`graphsynth.kinematics.instantaneous.instant_centre`."""
        return instant_centre(cast("Motion", self), link, base)

    def polodes(self, link: int, base: int | None = None) -> Polodes:
        """Return fixed and moving polode of a link; see :func:`graphsynth.kinematics.instantaneous.polodes`."""
        return polodes(cast("Motion", self), link, base)

    def inflection_circle(self, link: int, base: int | None = None) -> Circles:
        """Return the inflection circle of a link; see :func:`graphsynth.kinematics.instantaneous.inflection_circle`."""
        return inflection_circle(cast("Motion", self), link, base)

    def bresse_circle(self, link: int, base: int | None = None) -> Circles:
        """Return the second circle of Bresse; see :func:`graphsynth.kinematics.instantaneous.bresse_circle`."""
        return bresse_circle(cast("Motion", self), link, base)

    def transmission_index(self) -> dict[int, Array]:
        """Return the sine of every transmission angle, by group of the mechanism."""
        return transmission_index(cast("Motion", self))

    def mechanical_advantage(self, link: int) -> Array:
        """Return effort on a link over the driver's, without losses.

        See :func:`graphsynth.kinematics.instantaneous.mechanical_advantage`.
        """
        return mechanical_advantage(cast("Motion", self), link)

    def assess_jamming(self, bearing: Any, tilts: Any, **options: Any) -> CoupledReport:
        """Assess whether the joints bind if an axis leans; see :func:`graphsynth.assess_jamming`.

        ``motion.assess_jamming("1 deg", tilts="0.5 deg")``: every joint allows a tilt of one degree, and the axis of
        the first driver leans by half a degree.
        """
        found: CoupledReport = work("assess jamming")(self, bearing, tilts=tilts, **options)
        return found

    def forces(self, loads: Mapping[str | int, Any], **options: Any) -> StaticForces:
        """Return the static forces in all joints under loads, as in ``motion.forces({"P": (0.0, -100.0)})``.

        See :func:`graphsynth.dynamics.static.static_forces`.
        """
        found: StaticForces = work("static forces")(self, loads, **options)
        return found

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        mechanism, u = self.mechanism, self.inputs
        rows = []
        for driver in mechanism.drivers[:2]:
            angular = not isinstance(mechanism.joint(*driver.pair), Prismatic)
            ends = [f"{math.degrees(v):.6g}°" if angular else f"{v:.6g}" for v in (u[0], u[-1])]
            rows.append((f"driver {driver.base}-{driver.link}", f"input {ends[0]} to {ends[1]}, {len(u)} samples"))
        if self.completed:
            closed = self.closure.statement if self.closure.tested else "completed; no full rotation"
            rows.append(("motion", closed))
        else:
            rows.append(("motion", f"ends: {self.reason}"))
        counted: dict[str, int] = {}
        for event in self.events:
            counted[event.kind] = counted.get(event.kind, 0) + 1
        if counted:
            rows.append(("events", ", ".join(f"{n} x {kind}" if n > 1 else kind for kind, n in counted.items())))
        rows.append(("joints close to", f"{self.residual:.1e} of the mechanism's size"))
        return f"Motion of a mechanism of {mechanism.graph.links} links (estimated: float64)", rows

    def _picture(self) -> str:
        picture: str = work("motion picture")(self)
        return picture
