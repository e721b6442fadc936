"""Four-bars that couple two angles, or draw points at given crank angles (theory/poses 6)."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence
from itertools import permutations
from typing import Any

import flint
import numpy as np

from graphsynth.core.checks import checked, point
from graphsynth.core.errors import GeometryError
from graphsynth.design.poses.cognates import roberts
from graphsynth.design.poses.dyads import LADDER, PoseDyad, PoseDyads, dyad_of, dyads
from graphsynth.design.poses.linkages import PoseLinkage, PoseLinkages, linkage_of
from graphsynth.design.poses.roots import Roots, five_poses, four_poses, rows_of
from graphsynth.design.poses.task import Angle, Task, direction, radians, read_angle, read_poses
from graphsynth.intervals.reading import ball, precision

Ends = list[tuple[Any, Any]]


@checked
def function_generators(
    inputs: Sequence[Any], outputs: Sequence[Any], *, input_start: Any = None, output_start: Any = None
) -> PoseLinkages:
    """Find the four-bars that turn an output link to given angles when the driver is at given angles.

    Parameters
    ----------
    inputs, outputs : sequence of float or str
        Three to five angles of driver and output link, radians or texts such as "30 deg", each counted from its own
        first one.
    input_start : float or str, optional
        Angle of the driver at the first position, against the direction from its pivot to that of the output link:
        three positions, and four unless ``output_start`` is given.
    output_start : float or str, optional
        The same of the output link: three positions, and four unless ``input_start`` is given.

    Returns
    -------
    PoseLinkages
        Frame from (0, 0), the pivot of link 1, the driver, to (1, 0), that of link 3; scale them at will.  Three
        positions with both angles given have one solution, four have at most two, five with both free at most three;
        whether there is provably no other says ``complete``.

    Raises
    ------
    GeometryError
        Other numbers of angles, angles that repeat, starts that are missing or too many.

    Notes
    -----
    Freudenstein's equation, and the poses of the output link as seen from the driver: theory/poses 6.

    Examples
    --------
    >>> found = function_generators(["0 deg", "30 deg", "70 deg"], ["0 deg", "20 deg", "60 deg"],
    ...                             input_start="40 deg", output_start="60 deg")
    >>> len(found), found.complete, bool(found[0].miss < 1e-12)
    (1, True, True)
    """
    first, second = (_angles(name, own) for name, own in (("inputs", inputs), ("outputs", outputs)))
    count, starts = len(first), {"input_start": input_start, "output_start": output_start}
    given = {name: read_angle(name, value) for name, value in starts.items() if value is not None}
    if count != len(second) or not 3 <= count <= 5:
        raise GeometryError(f"{count} inputs and {len(second)} outputs; give three to five of each")
    if len({(a, b) for a, b in zip(first, second)}) < count:
        raise GeometryError("a pair of input and output is given twice; leave one of them out")
    if len(given) != 5 - count:
        raise GeometryError(f"{count} positions need {5 - count} of input_start and output_start, {list(given)} given")
    swap = list(given) == ["output_start"]
    if swap:
        first, second = second, first

    def solve() -> tuple[Ends, int, str]:
        if count == 3:
            return _freudenstein(first, second, given["input_start"], given["output_start"])
        moves = [
            (direction(b, second[0]) * direction(a, first[0]).conjugate(), direction(a, first[0]).conjugate() - 1)
            for a, b in zip(first[1:], second[1:])
        ]
        if count == 5:
            return _without_trivial(five_poses(rows_of(moves)))
        along = -direction(given["output_start"]) if swap else direction(given["input_start"])
        return _without_trivial(four_poses(rows_of(moves), (flint.acb(-1), along)))

    return _generators(solve, first, second, swap)


def _angles(name: str, values: Sequence[Any]) -> list[Angle]:
    return [read_angle(f"{name}[{k}]", value) for k, value in enumerate(values)]


def _freudenstein(first: list[Angle], second: list[Angle], start: Angle, stop: Angle) -> tuple[Ends, int, str]:
    """Crank and rocker of three positions: linear in 1/a, 1/b and K3."""
    turns = [
        (direction(start) * direction(a, first[0]), direction(stop) * direction(b, second[0]))
        for a, b in zip(first, second)
    ]
    table = flint.arb_mat([[v.real, -u.real, 1] for u, v in turns])
    if table.det().contains(0):
        return [], 1, "the three equations depend on each other, or nearly: no solution or a family"
    K = table.solve(flint.arb_mat(3, 1, [(u * v.conjugate()).real for u, v in turns]))
    if K[0, 0].contains(0) or K[1, 0].contains(0):
        return [], 1, "a link is infinitely long, or nearly: a slider"
    a, b = 1 / K[0, 0], 1 / K[1, 0]
    square = a * a + b * b + 1 - 2 * a * b * K[2, 0]
    if square.contains(0):
        return [], 1, "the coupler has length 0, or nearly"
    return ([(a * turns[0][0], b * turns[0][1])] if square > 0 else []), 1, ""


def _without_trivial(roots: Roots) -> tuple[Ends, int, str]:
    """Pins of crank and rocker at the first position; the frame itself is a solution of no use."""
    ends = []
    for x, y, p, q in roots.real:
        A, B = flint.acb(p + 1, q), flint.acb(x, y)
        if not (A.contains(0) and B.contains(0)):
            ends.append((A, B))
    lost = len(roots.real) - len(ends) != 1 and not roots.reason
    return ends, roots.bound - 1, "the frame itself is not told apart from a solution" if lost else roots.reason


def _generators(
    solve: Callable[[], tuple[Ends, int, str]], first: list[Angle], second: list[Angle], swap: bool
) -> PoseLinkages:
    """Raise the precision until all is decided, and make the linkages."""
    made: list[tuple[PoseDyad, PoseDyad]] = []
    note = ""
    for bits in LADDER:
        with precision(bits):
            ends, _, reason = solve()
            made = []
            for A, B in ends:
                if A.contains(0) or B.contains(0) or (1 + B - A).contains(0):
                    note = "a solution has a link of length 0, or nearly, and is left out"
                    continue
                made.append(_pair(-B, -A) if swap else _pair(A, B))
        if not reason:
            break
    found = []
    for driver, output in made:
        a, b = (second, first) if swap else (first, second)
        turn, answer = (np.array([radians(v) - radians(own[0]) for v in own]) for own in (a, b))
        A = driver.length * np.exp(1j * (driver.angle + turn))
        B = 1.0 + output.length * np.exp(1j * (output.angle + answer))
        poses = np.column_stack([A.real, A.imag, np.angle(B - A)])
        found.append(linkage_of(poses, driver, output))
    found.sort(key=lambda one: (len(one.defects), -one.transmission))
    return PoseLinkages(tuple(found), not reason, tuple(text for text in (reason, note) if text))


def _pair(A: Any, B: Any) -> tuple[PoseDyad, PoseDyad]:
    """Crank and rocker with their pins at A, and at 1 + B, joined by a coupler whose x axis leads from pin to pin."""
    coupler = abs(1 + B - A)
    first = dyad_of("RR", flint.acb(0), flint.acb(0), A.arg(), abs(A))
    second = dyad_of("RR", flint.acb(1), flint.acb(coupler), B.arg(), abs(B))
    return first, second


@checked
def timed_paths(
    points: Sequence[Any], angles: Sequence[Any], *, links: Sequence[PoseDyad] | None = None
) -> PoseLinkages:
    """Find the four-bars of which a coupler point is at given points when the crank is at given angles.

    Parameters
    ----------
    points : sequence of (x, y)
        Two to five points.
    angles : sequence of float or str
        Angles of the crank there, radians or texts such as "30 deg", counted from any direction.
    links : sequence of PoseDyad, optional
        For fewer than five points: dyads of the poses (x, y, angle); the pivot of one of them becomes the crank's.

    Returns
    -------
    PoseLinkages
        Point P of the coupler passes the points; link 1 is the crank.  Five points have at most twelve solutions, one
        for every ordered pair of the dyads of the poses (x, y, angle); ``complete`` says whether there is provably no
        other.

    Raises
    ------
    GeometryError
        Other numbers of points and angles, or links missing.

    Notes
    -----
    A cognate has a crank that turns as the coupler does: theory/poses 6, 7.

    Examples
    --------
    >>> points = [(0, 0), (0.6, 0.3), (1, 0.9), (1.2, 1.5), (1.1, 2)]
    >>> found = timed_paths(points, ["0 deg", "15 deg", "40 deg", "70 deg", "95 deg"])
    >>> len(found), found.complete
    (2, True)
    """
    if len(points) != len(angles):
        raise GeometryError(f"{len(points)} points and {len(angles)} angles; give as many of each")
    rows = [(*point(f"point {k}", place), angle) for k, (place, angle) in enumerate(zip(points, angles), 1)]
    task = read_poses(rows)
    if links is None and len(task) != 5:
        raise GeometryError(f"{len(task)} points leave pivots free; give links=[...] made by dyads of (x, y, angle)")
    found: PoseDyads | Sequence[PoseDyad] = dyads(task) if links is None else list(links)
    complete, notes = (found.complete, found.notes) if isinstance(found, PoseDyads) else (False, ())
    made = [_timed(task, one, other) for one, other in permutations(found, 2)]
    made.sort(key=lambda one: (len(one.defects), -one.transmission))
    return PoseLinkages(tuple(made), complete, notes)


def _timed(task: Task, first: PoseDyad, second: PoseDyad) -> PoseLinkage:
    """Make the cognate whose crank, about the first pivot, turns as the body does in the poses."""
    with precision(128):
        P, turn = flint.acb(ball(task.x[0]), ball(task.y[0])), direction(task.angle[0])
        O, Q = (_enclosed(dyad.pivot, dyad.error) for dyad in (first, second))
        A, B = (P + turn * _enclosed(dyad.point, dyad.error) for dyad in (first, second))
        left, _ = roberts(O, A, B, Q, P)
        pair = [dyad_of("RR", g, w - P, (w - g).arg(), abs(w - g)) for g, w in ((O, left[1]), (left[3], left[2]))]
    poses = task.poses
    arms = first.at(poses) @ [1.0, 1j] - complex(*first.pivot)
    turned = np.unwrap(np.angle(arms)) - cmath.phase(arms[0])
    return linkage_of(np.column_stack([poses[:, :2], turned]), pair[0], pair[1])


def _enclosed(place: tuple[float, float], error: float) -> Any:
    return flint.acb(*(flint.arb(part, error) for part in place))
