"""`dyads`: every link from the frame that lets a body pass through two to five given poses, proved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import Point, checked, choice, point as read_point, positive
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.design.poses.roots import Roots, five_poses, four_poses, linear, proved, rows_of, swapped
from graphsynth.design.poses.task import Task, direction, read_angle, read_poses
from graphsynth.intervals.reading import ball, precision, rational

Array = NDArray[np.float64]
Line = tuple[Point, float | str]
#: Binary digits of the balls, raised until everything is decided.
LADDER = (128, 256, 512, 1024)
#: What leaves finitely many dyads, by kind and number of poses; a choice is one of several words.
_NEEDS = {
    "RR": {5: (), 4: ("line",), 3: ("pivot", "point"), 2: ("pivot", "point")},
    "PR": {5: (), 4: (), 3: ("angle",), 2: ("point",)},
    "RP": {5: (), 4: (), 3: ("angle",), 2: ("pivot",)},
}


@dataclass(frozen=True)
class PoseDyad:
    """A link between frame and body, with one joint at each end: R a revolute joint, P a prismatic one.

    Attributes
    ----------
    kind : {"RR", "PR", "RP"}
        Joint at the frame, then joint at the body.
    pivot : (float, float)
        The revolute joint at the frame; of PR a point of the fixed line, where `point` is in the first pose.
    point : (float, float)
        The revolute joint at the body, in the body's own frame; of RP a point of the body's line, the one that is at
        `pivot` in the first pose.
    angle : float
        Direction of the line, radians: fixed for PR, in the body's frame for RP; of RR the direction from `pivot` to
        `point` in the first pose.
    length : float
        Distance of the two joints of RR; 0 for the others.
    error : float
        Bound of the distance of every number above from the exact one (certified).
    """

    kind: str
    pivot: Point
    point: Point
    angle: float
    length: float
    error: float

    def at(self, poses: Any) -> Array:
        """Places of `point` in poses (x, y, angle), shape (n, 2)."""
        x, y, angle = read_poses(poses, 1, 10**6, differ=False).poses.T
        z = x + 1j * y + np.exp(1j * angle) * complex(*self.point)
        return np.column_stack([z.real, z.imag])


@dataclass(frozen=True, eq=False, repr=False)
class PoseDyads(Shown):
    """Every dyad of one kind, or why some may be missing.

    Attributes
    ----------
    poses : ndarray, shape (n, 3)
        The poses, as doubles.
    kind : str
    dyads : tuple of PoseDyad
        The real ones, each proved to exist, in the order of their pivots.
    bound : int
        Solutions in the complex numbers, by algebra.
    solutions : int
        Those of them that are proved, real or not.
    complete : bool
        Whether it is proved that there is no other real one.
    notes : tuple of str
        What is special, and why something is not decided.
    bits : int
        Binary digits of the balls that sufficed, or the last ones tried.
    """

    poses: Array
    kind: str
    dyads: tuple[PoseDyad, ...]
    bound: int
    solutions: int
    complete: bool
    notes: tuple[str, ...]
    bits: int

    def __len__(self) -> int:
        return len(self.dyads)

    def __iter__(self) -> Iterator[PoseDyad]:
        return iter(self.dyads)

    def __getitem__(self, index: int) -> PoseDyad:
        return self.dyads[index]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        proof = "certified: no other" if self.complete else "undecided"
        rows = [
            (f"{k}", f"pivot ({d.pivot[0]:.6g}, {d.pivot[1]:.6g}), point ({d.point[0]:.6g}, {d.point[1]:.6g})")
            for k, d in enumerate(self.dyads)
        ]
        rows += [("note", note) for note in self.notes]
        return f"{len(self)} {self.kind} dyads of {len(self.poses)} poses, {proof}", rows


@checked
def dyads(
    poses: Any,
    kind: str = "RR",
    *,
    pivot: Any = None,
    point: Any = None,
    length: float | None = None,
    angle: Any = None,
    line: Any = None,
) -> PoseDyads:
    """Find every dyad that lets a body pass through two to five poses.

    Parameters
    ----------
    poses : sequence of (x, y, angle)
        Places of the body's own origin and its angles, in radians or as texts such as "30 deg", which are exact.
    kind : {"RR", "PR", "RP"}
        A link with two revolute joints; a point of the body on a fixed line; a line of the body through a fixed point.
    pivot : (x, y), optional
        The joint at the frame: three poses of RR, two of RR or RP.
    point : (x, y), optional
        The joint at the body, in its own frame: three poses of RR, two of RR or PR.
    length : float, optional
        Length of the link: two poses of RR.
    angle : float or str, optional
        Direction of the fixed line (PR) or of the body's line in its own frame (RP): three poses.
    line : ((x, y), angle), optional
        A line on which the pivot lies: four poses of RR, which have a whole curve of dyads, see `burmester_curves`.

    Returns
    -------
    PoseDyads
        Five poses have at most four RR dyads and in general no other; four poses with a line at most three RR, one PR,
        one RP; three and two poses with what is given one, and with a length at most two.  Every real one is enclosed
        and proved, and ``complete`` says whether there is provably no other.  Floats are taken as the exact numbers
        that they are.

    Raises
    ------
    GeometryError
        Poses that are the same, another number of them, something given that these poses do not leave free.

    Notes
    -----
    See theory/poses 2 to 4; [Bottema & Roth 1979], [McCarthy & Soh 2011].

    Examples
    --------
    >>> poses = [(0, 0, 0), (0.6, 0.3, "15 deg"), (1, 0.9, "40 deg"), (1.2, 1.5, "70 deg"), (1.1, 2, "95 deg")]
    >>> found = dyads(poses)
    >>> len(found), found.solutions, found.complete
    (2, 4, True)
    """
    choice("kind", kind, tuple(_NEEDS))
    task = read_poses(poses)
    given = {"pivot": pivot, "point": point, "angle": angle, "line": line}
    given = {name: value for name, value in given.items() if value is not None}
    needs = _NEEDS[kind][len(task)]
    if len(given) != min(1, len(needs)) or not given.keys() <= set(needs):
        said = " or ".join(needs) if needs else "none of pivot, point, angle, line"
        curve = "; burmester_curves gives the whole curve" if "line" in needs else ""
        raise GeometryError(f"{kind} dyads of {len(task)} poses need {said}, {sorted(given)} is given{curve}")
    if (length is not None) != (kind == "RR" and len(task) == 2):
        raise GeometryError(f"length = {length} with {len(task)} poses of {kind}; two poses of RR need one, no others")
    if kind == "RR":
        return _climb(task, kind, lambda: _revolute(task, given, length))
    return _climb(task, kind, lambda: _sliding(task, kind, given))


#: Real dyads, complex solutions found, their bound, and sentences: why it is not complete, and what else is to be said.
Found = tuple[list[PoseDyad], int, int, str, str]


def _climb(task: Task, kind: str, solve: Callable[[], Found]) -> PoseDyads:
    """Raise the precision until all is decided."""
    for bits in LADDER:
        with precision(bits):
            found, solutions, bound, reason, note = solve()
        if not reason:
            break
    notes = tuple(text for text in (reason, note) if text)
    found.sort(key=lambda dyad: (dyad.pivot, dyad.point))
    return PoseDyads(task.poses, kind, tuple(found), bound, solutions, not reason, notes, bits)


def _revolute(task: Task, given: dict[str, Any], length: float | None) -> Found:
    """RR dyads at the precision set."""
    rows = rows_of(task.displacements())
    turn = "point" in given
    if "line" in given:
        roots = four_poses(rows, read_line(task, given["line"]))
    elif given:
        name, place = next(iter(given.items()))
        fixed = task.to_first(read_point(name, place), in_link=turn)
        own = [swapped(row) for row in rows] if turn else rows
        roots = _three(own, fixed) if len(rows) == 2 else _two(own[0], fixed, ball(_exact(length) / task.unit))
        roots = roots._replace(found=[[*v[2:], *v[:2]] for v in roots.found]) if turn else roots
    else:
        roots = five_poses(rows)
    return _as_dyads(task, roots)


def _exact(length: Any) -> Any:
    positive("length", length)
    return rational("length", length)


def read_line(task: Task, line: Any) -> tuple[Any, Any]:
    """Read a point of a line and its direction."""
    try:
        place, angle = line
    except (TypeError, ValueError) as error:
        raise GeometryError(f"line = {line!r} is not a point and an angle; give ((x, y), angle)") from error
    return task.to_first(read_point("point of the line", place)), direction(read_angle("angle of the line", angle))


def _three(rows: list[Any], fixed: Any) -> Roots:
    """One end of three poses given: the other is the centre of a circle through three points."""
    v = linear(rows, fixed)
    if v is None:
        return Roots([], 1, "the three places seen from there are in a line, or nearly: the other end is at infinity")
    zero, one = flint.arb(0), flint.arb(1)
    held = [[zero] * 4 + [one, zero, -fixed.real], [zero] * 5 + [one, -fixed.imag]]
    own = proved([*rows, *held], v, real=True)
    return Roots([own] if own else [], 1, "" if own else "the solution is not regular")


def _two(row: Any, fixed: Any, length: Any) -> Roots:
    """One end of two poses given, and the distance: where a line meets a circle."""
    p, q = fixed.real, fixed.imag
    a, b, c = row[2] + row[0] * p - row[1] * q, row[3] + row[0] * q + row[1] * p, row[6] + row[4] * p + row[5] * q
    square = a * a + b * b
    if square.contains(0):
        return Roots([], 2, "the given end is the pole of the two poses, or nearly: any link there will do")
    off = (a * p + b * q + c) / square
    rest = length * length / square - off * off
    if rest.contains(0):
        return Roots([], 2, "the length is the shortest possible one, or nearly; give a longer one")
    if rest < 0:
        return Roots([], 2, "")
    found = [[p - off * a - side * b, q - off * b + side * a, p, q] for side in (rest.sqrt(), -rest.sqrt())]
    return Roots(found, 2, "")


def _as_dyads(task: Task, roots: Roots) -> Found:
    made, note = [], ""
    for x, y, p, q in roots.real:
        g, w = flint.acb(p, q), flint.acb(x, y)
        if (w - g).contains(0):
            note = "a point of the body stays where it is, or nearly: a pivot rather than a link"
            continue
        made.append(
            dyad_of("RR", task.from_first(g), task.from_first(w, True), (w - g).arg(), abs(w - g) * ball(task.unit))
        )
    return made, len(roots.found), roots.bound, roots.reason, note


def dyad_of(kind: str, pivot: Any, point: Any, angle: Any, length: Any) -> PoseDyad:
    """Round the numbers of a dyad, balls, to doubles with a bound of their error."""
    balls = [pivot.real, pivot.imag, point.real, point.imag, angle, flint.arb(length)]
    values = [float(part.mid()) for part in balls]
    error = max(float(abs(part - value).upper()) for part, value in zip(balls, values)) * (1.0 + 1e-15)
    px, py, x, y, own_angle, own_length = values
    return PoseDyad(kind, (px, py), (x, y), own_angle, own_length, error)


def _sliding(task: Task, kind: str, given: dict[str, Any]) -> Found:
    """PR dyads, or RP dyads as PR dyads of the inverse motion, at the precision set."""
    inverse = kind == "RP"
    rows = [[u.real - 1, u.imag, d.real, d.imag] for u, d in task.displacements(inverse)]
    if len(task) == 5:
        if flint.arb_mat(rows).det().contains(0):
            return (
                [],
                0,
                1,
                "the one condition that five poses must keep for such a dyad may be kept; leave one out",
                "",
            )
        return (
            [],
            0,
            0,
            "",
            "five poses have one only if they keep one condition (codimension 1): proved that they do not",
        )
    if len(task) == 4:
        A, B, a, b = (
            (-1) ** k * flint.arb_mat([[v for j, v in enumerate(row) if j != k] for row in rows]).det()
            for k in range(4)
        )
    elif len(task) == 3:
        turned = direction(read_angle("angle", given["angle"])) * flint.acb(0, 1)
        turned = turned * direction(task.angle[0]) if inverse else turned
        a, b = turned.real, turned.imag
        (m, s, *d), (n, t, *e) = rows
        below, right = m * t - n * s, [-(a * v[0] + b * v[1]) for v in (d, e)]
        if below.contains(0):
            return [], 0, 1, "the angles of the poses do not all differ: no such dyad, or a family", ""
        A, B = (right[0] * t - right[1] * s) / below, (m * right[1] - n * right[0]) / below
    else:
        name = "pivot" if inverse else "point"
        w = task.to_first(read_point(name, given[name]), in_link=not inverse)
        m, s, *d = rows[0]
        step = flint.acb(m, s) * w + flint.acb(*d)
        a, b = -step.imag, step.real
        A, B = a * w.real + b * w.imag, b * w.real - a * w.imag
    square = a * a + b * b
    if square.contains(0):
        return [], 0, 1, "the line has no direction, or it is at infinity: the poses are special", ""
    w = flint.acb((a * A + b * B) / square, (b * A - a * B) / square)
    along = flint.acb(-b, a)
    along = along * direction(task.angle[0]).conjugate() if inverse else along
    along = -along if float(along.real.mid()) < 0 else along
    own = dyad_of(kind, task.from_first(w), task.from_first(w, True), along.arg(), 0)
    return [own], 1, 1, "", ""
