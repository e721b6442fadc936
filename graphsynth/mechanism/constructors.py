"""Mechanisms from what people know of them: lengths of a named linkage, coordinates of joints, a sketch, a graph.

`Constructors` are class methods of `Mechanism`.  In those from coordinates every link's own frame is the fixed one at
the drawn position: the coordinates of a driver are counted from there.
"""

from __future__ import annotations

import cmath
import json
import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any, Self

from graphsynth.core.angles import angle
from graphsynth.core.checks import Point, choice, finite, point, positive, sign
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import work
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.structure.graph import MechanismGraph

Pose = tuple[float, float, float]
_LOOP = ((0, 1), (1, 2), (2, 3), (0, 3))


class Constructors:
    """Class methods that make a `Mechanism`."""

    if TYPE_CHECKING:

        def __init__(self, graph: Any, joints: Any, drivers: Any = (), points: Any = ..., pose: Any = None) -> None: ...

    @classmethod
    def four_bar(
        cls,
        ground: float,
        crank: float,
        coupler: float,
        rocker: float,
        *,
        coupler_point: Point | None = None,
        crank_angle: float | str | None = None,
        branch: int = 1,
    ) -> Self:
        """Make a four-bar linkage: frame 0 from (0, 0) to (ground, 0), crank 1, coupler 2, rocker 3.

        Parameters
        ----------
        ground, crank, coupler, rocker : float
            Distances of the joints of the four links, in this order; any common unit.
        coupler_point : (x, y), optional
            A point "P" of the coupler, x counted from the crank pin towards the rocker, y to the left of that.
        crank_angle : float or str, optional
            Where the motion starts, radians or "30 deg".  By default 0, or the middle of the angles that are reached.
        branch : {+1, -1}
            +1: the joint of coupler and rocker lies left of the way from the crank pin to the rocker's pivot.

        Returns
        -------
        Mechanism
            Driven at the crank; `GeometryError` for four lengths that cannot be assembled.

        Examples
        --------
        >>> from graphsynth import Mechanism
        >>> Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0)).simulate().closure.closed
        True
        """
        joints, pose = _four_bar(ground, crank, coupler, rocker, crank_angle, branch)
        points = {} if coupler_point is None else {"P": (2, point("coupler_point", coupler_point))}
        return cls(MechanismGraph(4, _LOOP, frame=0), joints, [Driver(0, 1)], points, pose)

    @classmethod
    def slider_crank(
        cls,
        crank: float,
        rod: float,
        offset: float = 0.0,
        *,
        rod_point: Point | None = None,
        crank_angle: float | str | None = None,
        branch: int = 1,
    ) -> Self:
        """Make a slider-crank: frame 0, crank 1 about (0, 0), connecting rod 2, slider 3 on the line y = offset.

        Parameters
        ----------
        crank, rod : float
            Distances of their joints; any common unit.
        offset : float
            Height of the slider's line above the crank's axis.
        rod_point : (x, y), optional
            A point "P" of the rod, x counted from the crank pin towards the slider, y to the left of that.
        crank_angle : float or str, optional
            As in `four_bar`.
        branch : {+1, -1}
            +1: the slider lies to the right of the crank pin.

        Returns
        -------
        Mechanism
            Driven at the crank; the slider's pin is the point "C".  `GeometryError` for a rod that is too short.

        Examples
        --------
        >>> from graphsynth import Mechanism
        >>> motion = Mechanism.slider_crank(1.0, 3.0).simulate()
        >>> round(float(motion.point("C").position[0, 0]), 12)
        4.0
        """
        crank, rod, offset = positive("crank", crank), positive("rod", rod), finite("offset", offset)
        # the height of the crank pin over the line lies between -rod and rod
        low, high = max(-1.0, (offset - rod) / crank), min(1.0, (offset + rod) / crank)
        if low > 1.0 or high < -1.0:
            raise GeometryError(
                f"a rod of {rod:g} does not reach from a crank of {crank:g} to a line {offset:g} away; lengthen it"
            )
        phi = angle("crank_angle", crank_angle) if crank_angle is not None else 0.0
        if crank_angle is None and not low <= 0.0 <= high:
            phi = 0.5 * (math.asin(low) + math.asin(high))
        A = cmath.rect(crank, phi)
        if (reach := rod * rod - (offset - A.imag) ** 2) < 0.0:
            raise GeometryError(f"at {phi:g} rad the rod of {rod:g} does not reach the line; give another crank_angle")
        B = complex(A.real + sign("branch", branch) * math.sqrt(reach), offset)
        joints = [
            Revolute(0, 1),
            Revolute(1, 2, (crank, 0.0)),
            Revolute(2, 3, (rod, 0.0)),
            Prismatic(0, 3, (0.0, offset)),
        ]
        pose = ((0.0, 0.0, 0.0), (0.0, 0.0, phi), _at(A, B), (B.real, B.imag, 0.0))
        points: dict[str, Any] = {"C": (3, (0.0, 0.0))}
        if rod_point is not None:
            points["P"] = (2, point("rod_point", rod_point))
        return cls(MechanismGraph(4, _LOOP, frame=0), joints, [Driver(0, 1)], points, pose)

    @classmethod
    def six_bar(
        cls,
        kind: str,
        lengths: Sequence[float],
        *,
        joint: Point,
        link: float,
        output: float,
        pivot: Point,
        crank_angle: float | str | None = None,
        branches: tuple[int, int] = (1, 1),
    ) -> Self:
        """Make a six-bar linkage: a four-bar, and two more links from one of its links to a third pivot.

        Parameters
        ----------
        kind : {"watt", "stephenson"}
            "watt" (Watt II): the fifth link is jointed to the rocker; "stephenson" (Stephenson III): to the coupler.
        lengths : (ground, crank, coupler, rocker)
            Of the four-bar, as in `four_bar`.
        joint : (x, y)
            Where the fifth link is jointed: on the rocker, x counted from its pivot towards the coupler; or on the
            coupler, x counted from the crank pin towards the rocker.
        link, output : float
            Lengths of link 4, which begins at ``joint``, and of link 5, which turns about ``pivot``.
        pivot : (x, y)
            Third pivot on the frame.
        crank_angle : float or str, optional
            As in `four_bar`.
        branches : ({+1, -1}, {+1, -1})
            That of the four-bar; and +1: the joint of links 4 and 5 lies left of the way from ``joint`` to ``pivot``.

        Returns
        -------
        Mechanism
            Driven at the crank; `GeometryError` for lengths that cannot be assembled.

        Examples
        --------
        >>> from graphsynth import Mechanism
        >>> watt = Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
        >>> watt.graph.links, watt.graph.mobility
        (6, 1)
        """
        carrier = {"watt": 3, "stephenson": 2}[choice("kind", kind, ("watt", "stephenson"))]
        if len(lengths) != 4 or len(branches) != 2:
            raise GeometryError(f"lengths = {lengths!r}, branches = {branches!r}; give four lengths and two branches")
        l1, l2, l3, l4 = lengths
        joints, pose = _four_bar(l1, l2, l3, l4, crank_angle, branches[0])
        link, output = positive("link", link), positive("output", output)
        joint, pivot = point("joint", joint), point("pivot", pivot)
        x, y, theta = pose[carrier]
        E, F = complex(x, y) + cmath.exp(1j * theta) * complex(*joint), complex(*pivot)
        G = meeting(E, link, F, output, branches[1], "link and output")
        joints += [Revolute(carrier, 4, joint), Revolute(4, 5, (link, 0.0), (output, 0.0)), Revolute(0, 5, pivot)]
        graph = MechanismGraph(6, [*_LOOP, (carrier, 4), (4, 5), (0, 5)], frame=0)
        return cls(graph, joints, [Driver(0, 1)], {}, (*pose, _at(E, G), _at(F, G)))

    @classmethod
    def from_points(
        cls,
        points: Mapping[str, Point],
        links: Sequence[str | Sequence[str]],
        frame: str | Sequence[str],
        driver: str | tuple[int, int] | Sequence[str | tuple[int, int]] | None = None,
        *,
        slides: Mapping[str, str | Sequence[str]] | None = None,
        cylinders: Sequence[str | Sequence[str]] = (),
        trace: str | Sequence[str] = (),
    ) -> Self:
        """Make a mechanism from the coordinates of its joints at one position.

        Parameters
        ----------
        points : mapping of str to (x, y)
            Places of all joints, and of points to be traced; any common unit.
        links : sequence
            The moving links 1, 2, ...: the names of the points on each, as a list, or as a text: letters ("BCP") or
            names with spaces between ("B C P1").  Where several links share a point they are jointed; where more than
            two share one, the first of them is jointed to each of the others.
        frame : str or sequence of str
            Points on link 0, which is fixed.
        driver : optional
            What is driven: two points of a link ("AB": it is turned about the first of them, against the other link
            there), a cylinder (its two points), or a pair of link numbers (base, link); a list for several.  By default
            the first cylinder, else the first link that is jointed to the frame by a revolute joint.
        slides : mapping, optional
            A point that slides along a line: the line's two points, both on the frame or on one link.  The block that
            slides becomes a link of its own, numbered after the others.
        cylinders : sequence, optional
            Pairs of points with a telescopic link between them: two links more, the first of them at the first point.
        trace : str or sequence of str
            Joints that are named points of the mechanism too, as are the points on one link only.

        Returns
        -------
        Mechanism
            `GeometryError` for a name that is not among the points, a link without two points, a driver that is no
            joint.

        Examples
        --------
        >>> from graphsynth import Mechanism
        >>> places = {"A": (0, 0), "B": (0, 1), "C": (3, 3), "D": (4, 0), "P": (2, 4)}
        >>> linkage = Mechanism.from_points(places, links=["AB", "BCP", "CD"], frame="AD")
        >>> linkage.graph.mobility, list(linkage.points)
        (1, ['P'])
        """
        places = {name: point(f"point {name}", value) for name, value in points.items()}
        drawn = _Drawn(places, [_names("frame", frame, places), *(_names("link", link, places) for link in links)])
        for name, line in (slides or {}).items():
            drawn.slide(name, _names(f"slide of {name}", line, places))
        for pair in cylinders:
            drawn.cylinder(_names("cylinder", pair, places))
        for (a, one), (b, other) in combinations(enumerate(drawn.links), 2):
            if len(set(one) & set(other)) > 1:
                raise GeometryError(f"links {a} and {b} share two points, so they are one link; give them as one")
        joints: list[JointGeometry] = []
        for name, place in places.items():
            first, *others = drawn.at(name) or [0]
            joints += [Revolute(first, other, place, place) for other in others]
        joints += drawn.prismatics
        graph = MechanismGraph(len(drawn.links), [(j.a, j.b) for j in joints], frame=0)
        given = [driver] if driver is None or isinstance(driver, str) or _is_pair(driver) else list(driver)
        drivers = [Driver(*drawn.driven(each, joints)) for each in given]
        traced = set(_names("trace", trace, places)) if trace else set()
        traced |= {name for name in places if len(own := drawn.at(name)) == 1 and own != [0]}
        named = {name: (drawn.at(name)[-1], at) for name, at in places.items() if name in traced}
        return cls(graph, joints, drivers, named, ((0.0, 0.0, 0.0),) * len(drawn.links))

    @classmethod
    def from_sketch(cls, sketch: str | bytes | Mapping[str, Any], *, driver: Any = None) -> Self:
        """Make a mechanism from a sketch of the atlas page.

        Parameters
        ----------
        sketch : str, bytes or mapping
            JSON or what it holds: ``{"pivots": [[x, y], ...], "links": [[0, 1], ...], "frame": 0}``.  Places are
            pixels, y down; links name their pivots by number, ``frame`` is the number of the fixed link.  The pivots
            get the names A, B, ... Z, A1, ...
        driver : optional
            As in `from_points`.

        Returns
        -------
        Mechanism
            Links in the order of the sketch, the frame moved to the front; lengths in pixels, y up.  `GeometryError`
            for a sketch without a frame, or one that is not read.

        Examples
        --------
        >>> from graphsynth import Mechanism
        >>> pivots, links = [[0, 90], [0, 60], [90, 20], [120, 90]], [[0, 3], [0, 1], [1, 2], [2, 3]]
        >>> sheet = {"pivots": pivots, "links": links, "frame": 0}
        >>> Mechanism.from_sketch(sheet).graph.key == Mechanism.four_bar(4, 1, 3, 3).graph.key
        True
        """
        try:
            data = json.loads(sketch) if isinstance(sketch, str | bytes) else sketch
            pivots, links, fixed = list(data["pivots"]), [list(map(int, link)) for link in data["links"]], data["frame"]
            names = [chr(65 + k % 26) + (str(k // 26) if k >= 26 else "") for k in range(len(pivots))]
            own = [[names[k] for k in link] for link in links]
            frame = None if fixed is None else own.pop(fixed)
            places = {name: (float(x), -float(y)) for name, (x, y) in zip(names, pivots)}
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise GeometryError(f"the sketch is not read ({error!r}); give pivots, links and frame") from error
        if frame is None:
            raise GeometryError("the sketch has no frame; mark one link as the frame")
        return cls.from_points(places, own, frame, driver)

    @classmethod
    def from_graph(
        cls, graph: MechanismGraph, places: Sequence[Point] | None = None, *, driver: Any = None, seed: int = 0
    ) -> Self:
        """Make a mechanism from its graph, with revolute joints at given places or with dimensions that a search finds.

        Parameters
        ----------
        graph : MechanismGraph
            With a frame if places are given; without one the search chooses it.
        places : sequence of (x, y), optional
            Places of the joints at one position, in the order of ``graph.joints``.
        driver : optional
            Links (base, link), or a list of such pairs; the first joint of the frame by default.
        seed : int
            Of the search, see `graphsynth.embody`.

        Returns
        -------
        Mechanism
            Found by the search, it makes a full rotation (estimated); `GeometryError` if nothing is found.

        Examples
        --------
        >>> from graphsynth import Mechanism, MechanismGraph
        >>> graph = MechanismGraph(4, [(0, 1), (0, 3), (1, 2), (2, 3)], frame=0)
        >>> Mechanism.from_graph(graph, [(0, 0), (4, 0), (0, 1), (3, 3)]).joint(2, 3).at_a
        (3.0, 3.0)
        """
        if places is None:
            found: Any = work("embody")(graph, seed=seed, driver=driver)
            if not found.accepted:
                raise GeometryError(f"{found.statement}; give places, or another seed")
            made: Self = found.mechanism
            return made
        if graph.frame is None or len(places) != (count := len(graph.joints)):
            raise GeometryError(
                f"{len(places)} places for {count} joints, frame {graph.frame}; give one for each, and a frame"
            )
        at = [point(f"places[{k}]", place) for k, place in enumerate(places)]
        joints = [Revolute(a, b, p, p) for (a, b, _), p in zip(graph.joints, at)]
        near = next(a + b - graph.frame for a, b, _ in graph.joints if graph.frame in (a, b))
        pairs = [(graph.frame, near)] if driver is None else [driver] if _is_pair(driver) else list(driver)
        return cls(graph, joints, [Driver(*pair) for pair in pairs], {}, ((0.0, 0.0, 0.0),) * graph.links)


def _at(start: complex, end: complex) -> Pose:
    """Pose of a link whose x axis leads from one point to another."""
    return start.real, start.imag, cmath.phase(end - start)


def meeting(A: complex, a: float, B: complex, b: float, branch: int = 1, what: str = "sides") -> complex:
    """Return where circles about A and B meet, left (+1) or right (-1) of the way from A to B."""
    d = abs(B - A)
    if not abs(a - b) <= d <= a + b or d == 0.0:
        raise GeometryError(
            f"{what} of {a:g} and {b:g} do not meet over the distance {d:.6g}, which is not between {abs(a - b):g} and "
            f"{a + b:g}; give other lengths"
        )
    along = (d * d + (a - b) * (a + b)) / (2.0 * d)
    return A + (B - A) / d * complex(along, sign("branch", branch) * math.sqrt(max(0.0, (a - along) * (a + along))))


def _four_bar(
    ground: float, crank: float, coupler: float, rocker: float, crank_angle: float | str | None, branch: int
) -> tuple[list[JointGeometry], tuple[Pose, ...]]:
    """Joints of a four-bar and its pose at a crank angle."""
    l1, l2 = positive("ground", ground), positive("crank", crank)
    l3, l4 = positive("coupler", coupler), positive("rocker", rocker)
    longest, total = max(l1, l2, l3, l4), l1 + l2 + l3 + l4
    if 2.0 * longest > total:
        raise GeometryError(
            f"the longest link, {longest:g}, is longer than the other three together, {total - longest:g}: "
            "the four-bar cannot be assembled; give other lengths"
        )
    if crank_angle is not None:
        phi = angle("crank_angle", crank_angle)
    elif abs(l3 - l4) < abs(l1 - l2) < l3 + l4:
        phi = 0.0
    else:
        # the middle of the angles reached in (0, pi), which end where the pin is farthest from the pivot, and nearest
        cosines = ((l1 * l1 + l2 * l2 - reach * reach) / (2.0 * l1 * l2) for reach in (abs(l3 - l4), l3 + l4))
        phi = 0.5 * sum(math.acos(min(1.0, max(-1.0, cosine))) for cosine in cosines)
    A, D = cmath.rect(l2, phi), complex(l1, 0.0)
    B = meeting(A, l3, D, l4, branch, "coupler and rocker")
    pins = (Revolute(0, 1), Revolute(1, 2, (l2, 0.0)), Revolute(2, 3, (l3, 0.0), (l4, 0.0)), Revolute(0, 3, (l1, 0.0)))
    return list(pins), ((0.0, 0.0, 0.0), (0.0, 0.0, phi), _at(A, B), _at(D, B))


def _is_pair(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and all(isinstance(part, int) for part in value)


def _names(what: str, given: str | Sequence[str], places: Mapping[str, Point]) -> list[str]:
    """Names of points in a text or a list; each is one of the places."""
    found = list(given) if not isinstance(given, str) else given.split() if " " in given else [given]
    if isinstance(given, str) and found == [given] and given not in places:
        found = list(given)
    strange = next((name for name in found if name not in places), None)
    if strange is not None:
        raise GeometryError(f"{what} {given!r} names the point {strange!r}, which has no place; points: {list(places)}")
    return found


class _Drawn:
    """Links as lists of points, the frame first, and what slides."""

    def __init__(self, places: Mapping[str, Point], links: list[list[str]]) -> None:
        self.places, self.links = places, links
        self.prismatics: list[JointGeometry] = []
        self.pairs: dict[tuple[str, ...], tuple[int, int]] = {}
        for k, link in enumerate(links):
            if len(set(link)) < min(2, k + 1):
                raise GeometryError(f"link {k} has the points {link}; give two or more")

    def at(self, name: str) -> list[int]:
        """Links through a point."""
        return [k for k, link in enumerate(self.links) if name in link]

    def slide(self, name: str, line: list[str]) -> None:
        """Put a block at a point that slides along a line of a link."""
        guides = [k for k, link in enumerate(self.links) if set(line) <= set(link)]
        if len(set(line)) != 2 or not guides:
            raise GeometryError(f"{name} slides along {line}, which are no two points of one link; name two that are")
        self._prismatic(guides[0], [name], line, name)

    def cylinder(self, pair: list[str]) -> None:
        """Put two links that slide in one another between two points."""
        if len(set(pair)) != 2:
            raise GeometryError(f"a cylinder between {pair}; name its two points")
        self.links.append([pair[0]])
        self._prismatic(len(self.links) - 1, [pair[1]], pair, pair[1])
        self.pairs[tuple(pair)] = (len(self.links) - 2, len(self.links) - 1)

    def _prismatic(self, guide: int, block: list[str], line: list[str], at: str) -> None:
        P, Q = (complex(*self.places[name]) for name in line)
        if P == Q:
            raise GeometryError(f"the points {line} coincide, so they give no direction; move one of them")
        self.links.append(block)
        turn, place = cmath.phase(Q - P), self.places[at]
        self.prismatics.append(Prismatic(guide, len(self.links) - 1, place, place, turn, turn))

    def driven(self, given: Any, joints: Sequence[JointGeometry]) -> tuple[int, int]:
        """Return base and link of a driver."""
        known = {joint.pair for joint in joints}
        if given is None:
            ends = [pair for pair in known if 0 in pair and pair not in {j.pair for j in self.prismatics}]
            found = next(iter(self.pairs.values()), min(ends, default=(0, 0)))
        elif _is_pair(given):
            found = given
        else:
            names = _names("driver", given, self.places)
            found = self.pairs.get(tuple(names), (0, 0))
            carriers = [k for k, link in enumerate(self.links) if k and set(names) <= set(link)]
            if found == (0, 0) and carriers and names:
                found = (next((k for k in self.at(names[0]) if k != carriers[0]), 0), carriers[0])
        if (min(found), max(found)) not in known:
            some = ", ".join(f"{a}-{b}" for a, b in sorted(known))
            raise GeometryError(f"driver {given!r} is no joint; name two points of a driven link, or one of {some}")
        return found
