"""Methods of a `Mechanism` whose work is done in rooms above: motion, assembly modes, pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike

from graphsynth.core.shown import Shown, work
from graphsynth.mechanism.joints import JointGeometry

if TYPE_CHECKING:
    import sympy

    from graphsynth.drawing.methods import Drawing
    from graphsynth.kinematics.assembly import AssemblyMode
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism, TracePoint
    from graphsynth.mechanism.symbolic import CouplerCurve
    from graphsynth.structure.graph import MechanismGraph


class Methods(Shown):
    """Methods that every `Mechanism` has."""

    if TYPE_CHECKING:
        graph: MechanismGraph
        joints: tuple[JointGeometry, ...]
        drivers: tuple[Driver, ...]
        points: Mapping[str, TracePoint]

    def simulate(
        self,
        inputs: ArrayLike | str | None = None,
        *,
        modes: Mapping[int, int] | None = None,
        start: ArrayLike | None = None,
        events: bool = True,
    ) -> Motion:
        """Move the mechanism; see :func:`graphsynth.simulate`."""
        found: Motion = work("simulate")(self, inputs, modes=modes, start=start, events=events)
        return found

    def modes(self, input: float | str | None = None) -> list[AssemblyMode]:
        """Return all assembly modes at one input; see :func:`graphsynth.kinematics.assembly.assembly_modes`."""
        found: list[AssemblyMode] = work("modes")(self, input)
        return found

    def draw(self, path: str | Path | None = None, **options: Any) -> Drawing:
        """Draw the kinematic diagram, and write it to a file (.svg, .png, .pdf, .tikz, .dxf) if a path is given.

        ``width``, ``height``, ``numbers`` and ``title`` are those of
        :func:`graphsynth.drawing.diagram.mechanism_sketch`.  A mechanism without a pose is drawn where its motion
        starts.
        """
        found: Drawing = work("draw mechanism")(self, path, **options)
        return found

    def plot(self, ax: Any = None) -> Any:
        """Draw the kinematic diagram on matplotlib axes, those of a new figure by default, and return them."""
        return work("plot mechanism")(self, ax)

    def animate(self, path: str | Path | None = None, **options: Any) -> Drawing:
        """Animate ``self.simulate()``; see `Motion.animate`."""
        return self.simulate().animate(path, **options)

    def closure_equations(self) -> list[sympy.Expr]:
        """Return the equations of all joints as formulas; see :mod:`graphsynth.mechanism.symbolic`."""
        from graphsynth.mechanism.symbolic import closure_equations

        return closure_equations(cast("Mechanism", self))

    def coupler_curve(self, name_or_link: str | int, at: tuple[float, float] | None = None) -> CouplerCurve:
        """Return the equation of the curve of a coupler point; see :mod:`graphsynth.mechanism.symbolic`."""
        from graphsynth.mechanism.symbolic import coupler_curve

        return coupler_curve(cast("Mechanism", self), name_or_link, at)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        kinds = ", ".join(f"{joint.a}-{joint.b} {joint.kind}" for joint in self.joints)
        drivers = ", ".join(f"{driver.link} against {driver.base}" for driver in self.drivers)
        rows = [("frame", f"link {self.graph.frame}"), ("joints", kinds), ("driven", drivers or "nothing")]
        if self.points:
            rows.append(("points", ", ".join(f"{name} on link {one.link}" for name, one in self.points.items())))
        return f"Mechanism of {self.graph.links} links, mobility {self.graph.mobility}", rows

    def _picture(self) -> str:
        picture: str = work("mechanism picture")(self)
        return picture
