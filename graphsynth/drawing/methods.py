"""What `draw`, `plot` and `animate` of mechanisms, motions and graphs do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wholefiles import replacing
from graphsynth.drawing.diagram import draw_mechanism, mechanism_sketch
from graphsynth.drawing.frames import with_trace_points
from graphsynth.drawing.plots import Chart
from graphsynth.drawing.sketch import Sketch

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.gear_trains import PlanetaryGearTrain
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.multiple_joints import MultipleJointChain
    from graphsynth.structure.slider_chains import SliderChain


@dataclass(frozen=True, repr=False)
class Drawing:
    """A picture that shows itself in a notebook.

    Attributes
    ----------
    svg : str
        One self-contained ``<svg>``.
    """

    svg: str
    _writer: Callable[[Path], object] | None = None

    def save(self, path: str | Path) -> None:
        """Write it to a file, as its suffix says.

        Raises
        ------
        GraphsynthError
            A suffix that this picture cannot be written as.
        """
        file = Path(path)
        if file.suffix.lower() == ".svg":
            with replacing(file) as fresh:
                fresh.write_text(self.svg, "utf-8")
        elif self._writer is None:
            raise GraphsynthError(f"{file} must end in .svg")
        else:
            self._writer(file)

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"Drawing of {len(self.svg)} bytes of SVG; .save(path) writes it, a notebook shows it"


def _drawing(sketch: Sketch, pose: Any, path: str | Path | None) -> Drawing:
    from graphsynth.drawing.export import save

    drawing = Drawing(sketch.svg(pose), lambda file: save(file, [sketch], [pose]))
    if path is not None:
        drawing.save(path)
    return drawing


def draw_graph(graph: MechanismGraph, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `MechanismGraph.draw`."""
    from graphsynth.drawing.graphs import graph_sketch

    return _drawing(*graph_sketch(graph, **options), path)


def draw_multiple_joints(chain: MultipleJointChain, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `MultipleJointChain.draw`."""
    from graphsynth.drawing.graphs import multiple_joint_sketch

    return _drawing(*multiple_joint_sketch(chain, **options), path)


def draw_sliders(chain: SliderChain, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `SliderChain.draw`."""
    from graphsynth.drawing.graphs import slider_sketch

    return _drawing(*slider_sketch(chain, **options), path)


def draw_gear_train(train: PlanetaryGearTrain, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `PlanetaryGearTrain.draw`."""
    from graphsynth.drawing.gear_schematic import gear_schematic

    return _drawing(gear_schematic(train, **options), None, path)


def graph_picture(graph: MechanismGraph) -> str:
    """Work of `MechanismGraph._repr_svg_`: the sketch, or the adjacency levels of what has none."""
    from graphsynth.drawing.graphs import draw_levels

    try:
        return draw_graph(graph, None, width=300.0, height=260.0).svg
    except GraphsynthError:
        return draw_levels(graph)


def _posed(mechanism: Mechanism) -> Any:
    """Return the pose of a mechanism, or where its motion starts."""
    if mechanism.pose is not None:
        return np.asarray(mechanism.pose)
    motion = mechanism.simulate(events=False)
    if not motion.assembled.any():
        raise GraphsynthError(f"the mechanism cannot be drawn, it is not assembled: {motion.reason}")
    return motion.poses[int(np.argmax(motion.assembled))]


def draw_posed(mechanism: Mechanism, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `Mechanism.draw`."""
    pose = _posed(mechanism)
    return _drawing(mechanism_sketch(mechanism, pose, **options), pose.tolist(), path)


def plot_posed(mechanism: Mechanism, ax: Any) -> Any:
    """Work of `Mechanism.plot`."""
    return draw_mechanism(mechanism, _posed(mechanism), ax=ax)


def mechanism_picture(mechanism: Mechanism) -> str:
    """Return the SVG of a mechanism in a notebook; empty if it cannot be drawn."""
    try:
        return draw_posed(mechanism, None, width=360.0, height=300.0).svg
    except GraphsynthError:
        return ""


def draw_motion(motion: Motion, path: str | Path | None, sample: int, **options: Any) -> Drawing:
    """Work of `Motion.draw`."""
    reached = motion.poses[np.isfinite(motion.poses).all(axis=(1, 2))]
    return _drawing(mechanism_sketch(motion.mechanism, reached, **options), motion.poses[sample].tolist(), path)


def plot_motion(motion: Motion, of: str | int | None, order: int) -> Chart:
    """Work of `Motion.plot`."""
    from graphsynth.drawing.motion_charts import coupler_curves, motion_chart

    if of is None and order == 0 and motion.mechanism.points:
        return coupler_curves(motion)
    return motion_chart(motion, of, order)


def animate_motion(motion: Motion, path: str | Path | None, **options: Any) -> Drawing:
    """Work of `Motion.animate`."""
    from graphsynth.drawing.animation import animated_svg, animation_html, save_gif

    def write(file: Path) -> None:
        suffix = file.suffix.lower()
        if suffix == ".gif":
            save_gif(motion, file, **options)
        elif suffix == ".html":
            file.write_text(animation_html(motion, **options), "utf-8")
        else:
            raise GraphsynthError(f"{file} must end in .html, .svg or .gif")

    drawing = Drawing(animated_svg(motion, **options), write)
    if path is not None:
        drawing.save(path)
    return drawing


def motion_picture(motion: Motion) -> str:
    """Return the moving SVG of a motion in a notebook; empty if nothing of it is assembled."""
    try:
        return animate_motion(with_trace_points(motion), None, width=420.0, height=340.0).svg
    except GraphsynthError:
        return ""
