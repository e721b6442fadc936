"""`Mechanism`: a mechanism graph with the geometry of its joints, drivers and named points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import Point, finite, link_number, point
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown, work
from graphsynth.mechanism.constructors import Constructors
from graphsynth.mechanism.joints import COLUMNS, JointGeometry, PlanarJoint, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    import sympy

    import graphsynth as gs  # what methods give back that is made in rooms above, by its public name
    from graphsynth.mechanism.constraints import MobilityReport
    from graphsynth.mechanism.symbolic import CouplerCurve

Array = NDArray[np.float64]
Pose = tuple[float, float, float]


class TracePoint(NamedTuple):
    """A named point of a link, in the link's frame."""

    link: int
    at: Point


@dataclass(frozen=True, repr=False)
class Mechanism(Constructors, Shown):
    """A dimensioned planar mechanism.

    Parameters
    ----------
    graph : MechanismGraph
        A graph with a frame, space 3.
    joints : iterable of Revolute, Prismatic, PinSlot, Gear or Cam
        One for every joint of the graph, in any order; kept in the order of ``graph.joints``.
    drivers : iterable of Driver
        Driven joints, R or P.
    points : mapping of str to (link, (x, y)), optional
        Named points of links.
    pose : sequence of (x, y, theta), optional
        A pose of every link close to an assembled one; it selects the assembly modes.  The frame is at rest at
        (0, 0, 0).
    input_range : (float, float), optional
        Inputs over which it is meant to move, the first that of the pose; `simulate` takes them where no inputs are
        given.
    link_names : mapping of str to int, optional
        Links that have a name.

    Raises
    ------
    GeometryError
        A joint without geometry, a geometry without a joint or of another mobility, zero-length or non-finite
        dimensions, a driver that is not an R or P joint, a point on a link that does not exist.

    Examples
    --------
    >>> graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> four_bar = Mechanism(graph, [
    ...     Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
    ...     Revolute(0, 3, (2.0, 0.0)),
    ... ], [Driver(0, 1)])
    >>> four_bar.joint(2, 3).at_a
    (2.5, 0.0)
    """

    graph: MechanismGraph
    joints: tuple[JointGeometry, ...]
    drivers: tuple[Driver, ...] = ()
    points: Mapping[str, TracePoint] = field(default_factory=dict)
    pose: tuple[Pose, ...] | None = None
    input_range: tuple[float, float] | None = None
    link_names: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", _ordered(self.graph, _sequence("joints", self.joints)))
        object.__setattr__(self, "drivers", self._checked_drivers(_sequence("drivers", self.drivers)))
        if not isinstance(self.points, Mapping):
            raise GeometryError(f"points = {self.points!r} is not a mapping of names to (link, (x, y))")
        object.__setattr__(self, "points", {name: self._checked_point(name, p) for name, p in self.points.items()})
        if self.pose is not None:
            object.__setattr__(self, "pose", self._checked_pose(self.pose))
        if self.input_range is not None:
            object.__setattr__(self, "input_range", self._checked_range(self.input_range))
        if not isinstance(self.link_names, Mapping):
            raise GeometryError(f"link_names = {self.link_names!r} is not a mapping of names to links")
        named = {name: self._checked_point(name, (link, (0.0, 0.0))).link for name, link in self.link_names.items()}
        object.__setattr__(self, "link_names", named)
        for link, degree in enumerate(self.graph.degrees):  # a binary link of zero length would have no direction
            own = [joint for joint in self.joints if link in (joint.a, joint.b)]
            ends = [joint.at_a if joint.a == link else joint.at_b for joint in own]
            revolute = all(isinstance(joint, Revolute) for joint in own)
            if degree == 2 and link != self.frame and revolute and ends[0] == ends[1]:
                raise GeometryError(f"link {link} has length 0 between its two joints; give it a positive length")

    def __hash__(self) -> int:
        return hash((self.graph, self.joints, self.drivers))

    def _checked_drivers(self, drivers: tuple[Driver, ...]) -> tuple[Driver, ...]:
        seen: set[tuple[int, int]] = set()
        by_pair = {joint.pair: joint for joint in self.joints}
        for driver in drivers:
            if not isinstance(driver, Driver):
                raise GeometryError(f"{driver!r} is not a Driver; give Driver(base, link)")
            joint = by_pair.get(driver.pair)
            if joint is None:
                raise GeometryError(
                    f"driver {driver.base}-{driver.link} drives no joint; name two links that are jointed"
                )
            if not isinstance(joint, Revolute | Prismatic):
                raise GeometryError(
                    f"driver {driver.base}-{driver.link} drives a {joint.kind} joint; only R and P joints are driven"
                )
            if driver.pair in seen:
                raise GeometryError(f"joint {driver.base}-{driver.link} is driven twice; remove a driver")
            seen.add(driver.pair)
        return drivers

    def _checked_point(self, name: str, value: Any) -> TracePoint:
        if not isinstance(name, str) or not name:
            raise GeometryError(f"point name {name!r} must be a text that is not empty")
        try:
            link, at = value
        except (TypeError, ValueError) as error:
            raise GeometryError(f"point {name} = {value!r} is not (link, (x, y))") from error
        link = link_number(f"link of point {name}", link)
        if link >= self.graph.links:
            raise GeometryError(f"point {name} is on link {link}, but the links are 0..{self.graph.links - 1}")
        return TracePoint(link, point(f"point {name}", at))

    def _checked_range(self, given: Any) -> tuple[float, float]:
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise GeometryError(f"input_range = {given!r} must be (first, last)")
        first, last = (finite(f"input_range[{k}]", value) for k, value in enumerate(given))
        if first == last:
            raise GeometryError(f"input_range = {given!r} must have two different ends")
        return first, last

    def _checked_pose(self, pose: Iterable[Iterable[float]]) -> tuple[Pose, ...]:
        try:
            rows = [tuple(finite(f"pose of link {k}", v) for v in row) for k, row in enumerate(pose)]
        except TypeError as error:
            raise GeometryError(f"pose = {pose!r} is not a list of (x, y, theta)") from error
        if len(rows) != self.graph.links or any(len(row) != 3 for row in rows):
            raise GeometryError(f"pose must give (x, y, theta) for each of the {self.graph.links} links")
        if rows[self.frame] != (0.0, 0.0, 0.0):
            raise GeometryError(f"the frame, link {self.frame}, stays at (0, 0, 0); its pose is {rows[self.frame]}")
        return tuple((row[0], row[1], row[2]) for row in rows)

    @property
    def frame(self) -> int:
        """The fixed link."""
        assert self.graph.frame is not None  # checked when made
        return self.graph.frame

    @cached_property
    def dimensions(self) -> Array:
        """Every number of the joints, shape (joints, 10), columns `COLUMNS`; the form batches use."""
        table = np.array([joint.row() for joint in self.joints]).reshape(-1, len(COLUMNS))
        table.setflags(write=False)
        return table

    def joint(self, a: int, b: int) -> JointGeometry:
        """Return the joint between two links; `GeometryError` if there is none."""
        a, b = link_number("link of a joint", a), link_number("link of a joint", b)
        for joint in self.joints:
            if joint.pair == (min(a, b), max(a, b)):
                return joint
        raise GeometryError(f"links {a} and {b} have no joint")

    def scaled(self, factor: float) -> Mechanism:
        """Return the mechanism with every length multiplied, as in another unit; inputs stay as they are.

        Lengths are points, radii, harmonics of cams, poses and the coordinates of sliding drivers.  A `GeometryError`
        refuses a law of a sliding driver that is none of `graphsynth.mechanism.laws`.

        >>> Mechanism.four_bar(2.0, 1.0, 2.5, 2.5).scaled(0.5).joint(2, 3).at_a
        (1.25, 0.0)
        """
        from graphsynth.mechanism.scaling import scaled

        return scaled(self, factor)

    def mobility(self, pose: ArrayLike | None = None) -> MobilityReport:
        """Mobility by count and by rank of the constraint matrix at a pose.

        See :func:`graphsynth.mechanism.constraints.mobility_report`.
        """
        from graphsynth.mechanism.constraints import mobility_report

        return mobility_report(self, pose)

    def to_json(self) -> str:
        """Write as JSON; see :mod:`graphsynth.mechanism.files`."""
        from graphsynth.mechanism.files import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> Mechanism:
        """Read JSON; anything else is a `FormatError` with the place."""
        from graphsynth.mechanism.files import from_json

        return from_json(text)

    def to_toml(self) -> str:
        """Write as TOML; see :mod:`graphsynth.mechanism.files`."""
        from graphsynth.mechanism.files import to_toml

        return to_toml(self)

    @classmethod
    def from_toml(cls, text: str | bytes) -> Mechanism:
        """Read TOML; anything else is a `FormatError` with the place."""
        from graphsynth.mechanism.files import from_toml

        return from_toml(text)

    # --- what is done in rooms above: motion, assembly modes, pictures

    def simulate(
        self,
        inputs: ArrayLike | str | None = None,
        *,
        modes: Mapping[int, int] | None = None,
        start: ArrayLike | None = None,
        events: bool = True,
    ) -> gs.Motion:
        """Move the mechanism; see :func:`graphsynth.simulate`."""
        found: gs.Motion = work("simulate")(self, inputs, modes=modes, start=start, events=events)
        return found

    def modes(self, input: float | str | None = None) -> list[gs.AssemblyMode]:
        """Return all assembly modes at one input; see :func:`graphsynth.kinematics.engine.start.assembly_modes`."""
        found: list[gs.AssemblyMode] = work("modes")(self, input)
        return found

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw the kinematic diagram, and write it to a file (.svg, .png, .pdf, .tikz, .dxf) if a path is given.

        ``width``, ``height``, ``numbers`` and ``title`` are those of
        :func:`graphsynth.drawing.diagram.mechanism_sketch`.  A mechanism without a pose is drawn where its motion
        starts.
        """
        found: gs.Drawing = work("draw mechanism")(self, path, **options)
        return found

    def plot(self, ax: Any = None) -> Any:
        """Draw the kinematic diagram on matplotlib axes, those of a new figure by default, and return them."""
        return work("plot mechanism")(self, ax)

    def animate(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Animate ``self.simulate()``; see `Motion.animate`."""
        return self.simulate().animate(path, **options)

    def open(self, path: str | Path | None = None, *, browser: bool | None = None) -> gs.OpenedWorkbench:
        """Lay it on the workbench, a page on which it is dragged and changed.

        See :func:`graphsynth.workbench.opening.open_workbench`.
        """
        found: gs.OpenedWorkbench = work("open mechanism")(self, path, browser=browser)
        return found

    def closure_equations(self) -> list[sympy.Expr]:
        """Return the equations of all joints as formulas; see :mod:`graphsynth.mechanism.symbolic`."""
        from graphsynth.mechanism.symbolic import closure_equations

        return closure_equations(self)

    def coupler_curve(self, name_or_link: str | int, at: tuple[float, float] | None = None) -> CouplerCurve:
        """Return the equation of the curve of a coupler point; see :mod:`graphsynth.mechanism.symbolic`."""
        from graphsynth.mechanism.symbolic import coupler_curve

        return coupler_curve(self, name_or_link, at)

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


def _sequence(name: str, values: Any) -> tuple[Any, ...]:
    try:
        return tuple(values)
    except TypeError as error:
        raise GeometryError(f"{name} = {values!r} is not a sequence; give a list of {name}") from error


def _ordered(graph: MechanismGraph, joints: tuple[JointGeometry, ...]) -> tuple[JointGeometry, ...]:
    """Return the joints in the order of the graph's, each checked against it."""
    if not isinstance(graph, MechanismGraph):
        raise GeometryError(f"graph = {graph!r} is not a MechanismGraph")
    if graph.frame is None:
        raise GeometryError("a mechanism needs a frame; choose one with graph.with_frame(link)")
    if graph.space != 3:
        raise GeometryError(f"space = {graph.space}: only planar mechanisms (space 3) have joint geometry here")
    by_pair: dict[tuple[int, int], JointGeometry] = {}
    for joint in joints:
        if not isinstance(joint, PlanarJoint):
            raise GeometryError(f"{joint!r} is not a joint; use Revolute, Prismatic, PinSlot, Gear or Cam")
        if joint.pair in by_pair:
            raise GeometryError(f"joint {joint.pair[0]}-{joint.pair[1]} has two geometries; remove one")
        by_pair[joint.pair] = joint
    found = []
    for a, b, mobility in graph.joints:
        own = by_pair.pop((a, b), None)
        if own is None:
            raise GeometryError(f"joint {a}-{b} of the graph has no geometry; add a joint")
        if own.mobility != mobility:
            raise GeometryError(
                f"joint {a}-{b} has mobility {mobility} in the graph, but a {own.kind} joint has {own.mobility}"
            )
        found.append(own)
    if by_pair:
        a, b = min(by_pair)
        raise GeometryError(f"joint {a}-{b} has a geometry but is not in the graph; remove it or change the graph")
    return tuple(found)
