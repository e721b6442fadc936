"""Real roots as linkages: what drives, whether one motion passes all points, in order (theory/nine-points 5)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from graphsynth.core.shown import Shown
from graphsynth.design.nine_points.equations import minors
from graphsynth.design.nine_points.proof import Mask, ProvedRoots, reciprocal
from graphsynth.design.nine_points.task import Task
from graphsynth.intervals.balls import Balls, argument, exact, root, stack
from graphsynth.intervals.operations import Array

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

_TAU = 2.0 * np.pi


@dataclass(frozen=True, eq=False, repr=False)
class PathLinkage(Shown):
    """A four-bar with a point of its coupler on every given point; the crank is the link that turns best.

    Attributes
    ----------
    crank_pivot, rocker_pivot, crank_pin, rocker_pin, point : complex
        Joints on the frame, joints on the coupler and tracing point, at the first given point.
    radius : float
        Each joint of the exact linkage is at most that far away (certified).
    crank_angles : ndarray, shape (points,)
        Turn of the crank from the first point to each of them, radians, in (-2 pi, 2 pi); estimated.  As inputs of
        ``mechanism`` they lead to the points; of points in order they rise or fall.
    turns_fully : bool
        Whether the crank turns fully (certified).  If not, it swings between two limits.
    one_branch : bool
        Whether one motion of the crank, without a limit between, passes all points (certified).
    in_order : bool
        Whether that motion passes them in the given order, forwards or backwards (certified); of a full turn it does
        not matter with which point it begins.
    """

    crank_pivot: complex
    rocker_pivot: complex
    crank_pin: complex
    rocker_pin: complex
    point: complex
    radius: float
    crank_angles: Array
    turns_fully: bool
    one_branch: bool
    in_order: bool

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Frame, crank, coupler, rocker."""
        A, B, C, D = self.crank_pivot, self.rocker_pivot, self.crank_pin, self.rocker_pin
        return abs(B - A), abs(C - A), abs(D - C), abs(D - B)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The linkage in the place of the points, at the first of them; the tracing point is "P"."""
        from graphsynth.mechanism.model import Mechanism

        places = zip("ABCDP", (self.crank_pivot, self.rocker_pivot, self.crank_pin, self.rocker_pin, self.point))
        points = {name: (at.real, at.imag) for name, at in places}
        return Mechanism.from_points(points, links=["AC", "CDP", "BD"], frame="AB", driver="AC")

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        frame, crank, coupler, rocker = self.lengths
        defects = "" if self.in_order else ", not in order" if self.one_branch else ", not on one branch"
        lengths = f"{frame:.5g}, {crank:.5g}, {coupler:.5g}, {rocker:.5g}"
        places = [f"({at.real:.5g}, {at.imag:.5g})" for at in (self.crank_pivot, self.rocker_pivot)]
        rows = [("frame, crank, coupler, rocker", lengths), ("pivots", f"{places[0]} and {places[1]}")]
        return f"four-bar, {'full turn' if self.turns_fully else 'limited swing'}{defects}", rows


class _Candidates(NamedTuple):
    """Every cognate, driven at either pivot: balls of shape (roots, candidates), then (roots, candidates, points)."""

    a: Balls
    x: Balls
    b: Balls
    y: Balls
    crank: Balls
    coupler: Balls
    rocker: Balls


def linkages(roots: ProvedRoots, task: Task) -> tuple[PathLinkage, ...]:
    """Return the best cognate of every real root, without defects first, then the smallest."""
    real = np.flatnonzero(roots.real & roots.distinct)
    if real.size == 0:
        return ()
    with np.errstate(all="ignore"):
        each = _candidates(roots.box[real], task)
        full, one, order, angles = _judge(each)
    parts = np.stack([part.mid for part in each[:4]])
    extent = np.abs(np.concatenate([parts, parts[:1] - parts[2:3], parts[:1] - parts[1:2]])).max(axis=0)
    rank = 8.0 * (one & order) + 4.0 * (one & full) + 2.0 * one + 1.0 / (1.0 + extent)
    rank[np.isinf([part.rad for part in each[:4]]).any(axis=0)] = -1.0
    best = np.argmax(rank, axis=1)
    made = []
    for i in np.argsort(-rank[np.arange(len(best)), best], kind="stable"):
        k = best[i]
        a, x, b, y = (complex(task.p[0] + task.unit * part) for part in parts[:, i, k])
        radius = task.unit * max(float(part.rad[i, k]) for part in each[:4])
        radius = 1.000001 * radius + 4e-16 * max(abs(task.p[0]), *map(abs, (a, x, b, y)))  # of scaling back
        judged = (bool(full[i, k]), bool(one[i, k]), bool(one[i, k] and order[i, k]))
        made.append(PathLinkage(a, b, x, y, complex(task.p[0]), radius, angles[i, k], *judged))
    return tuple(made)


def _candidates(box: Balls, task: Task) -> _Candidates:
    """Cognates with the given pivots (theory/nine-points 2), each in both directions."""
    a, x, b, y = (box[:, k] for k in (0, 2, 4, 6))
    share = y * reciprocal(y - x)
    left, right = (a - x) * share, (y - b) * x * reciprocal(y - x)
    third = left + right
    cognates = [(a, x, b, y), (a, a - x, third, left), (b, b - y, third, right)][: 3 - len(task.pivots)]
    both = [four for a, x, b, y in cognates for four in ((a, x, b, y), (b, y, a, x))]
    a, x, b, y = (stack([four[k] for four in both]) for k in range(4))
    p = Balls(np.append(0.0, task.points.mid[:, 0]), np.append(0.0, task.points.rad[:, 0]))
    z = [part[..., None] for pair in ((a, a.conj), (x, x.conj), (b, b.conj), (y, y.conj)) for part in pair]
    u, _v, w, _one, _two = minors(z, p, p.conj)
    turn = exact(1.0 + 0j) + u * reciprocal(w)
    crank, rocker = p + z[2] * turn - z[0], p + z[6] * turn - z[4]
    return _Candidates(a, x, b, y, crank, (z[6] - z[2]) * turn, rocker)


def _judge(each: _Candidates) -> tuple[Mask, Mask, Mask, Array]:
    """Whether the crank turns fully, one branch holds all points, in order: all proved; angles of the crank."""
    frame = each.b - each.a
    g, c, k, r = (_length(part) for part in (frame, each.x - each.a, each.y - each.x, each.y - each.b))
    # the crank passes the direction to the other pivot if near > 0, and the opposite one if far > 0
    near, far = (g - c - r + k) * (g - c + r - k), k + r - g - c
    meets, reaches = (near.mid > near.rad, near.mid < -near.rad), (far.mid > far.rad, far.mid < -far.rad)
    full, outer, inner = meets[0] & reaches[0], meets[1] & reaches[0], meets[0] & reaches[1]
    side = (each.coupler.conj * each.rocker).imag
    # a crank that passes neither direction swings on one side of the frame
    aside = meets[1] & reaches[1] & _one_sign((each.crank * frame.conj[..., None]).imag)
    one = _one_sign(side) & (full | outer | inner | aside)
    sign = np.where(outer, -1.0, 1.0)  # angles are counted from the middle of what is reached
    angle = argument(each.crank * (frame.conj * exact(sign))[..., None])
    after = [np.roll(part, -1, axis=-1) for part in (angle.mid, angle.rad)]
    step = Balls(*after) - angle  # the last one leads back to the first point
    sure = np.abs(step.mid) + step.rad < 6.28
    ahead, behind = sure & (step.mid > step.rad), sure & (step.mid < -step.rad)
    ups, downs = ahead.sum(axis=-1), behind.sum(axis=-1)
    n = step.mid.shape[-1]
    # of a full turn one step is the other way round, once the angle jumps by a turn; of a swing it is the way back
    forwards, backwards = (ups == n - 1) & (downs == 1), (downs == n - 1) & (ups == 1)
    swing = ahead[..., :-1].all(axis=-1) | behind[..., :-1].all(axis=-1)
    order = np.where(full, forwards | backwards, swing)
    onward = np.where((full & forwards)[..., None], step.mid % _TAU, step.mid)
    onward = np.where((full & backwards)[..., None], -(-step.mid % _TAU), onward)
    turns = np.concatenate([np.zeros((*onward.shape[:-1], 1)), np.cumsum(onward, axis=-1)[..., :-1]], axis=-1)
    turns = np.where((full & ~order)[..., None], turns % _TAU, turns)
    return full, one, order, turns


def _one_sign(values: Balls) -> Mask:
    """Whether no value changes its sign over the points."""
    return np.asarray((values.mid > values.rad).all(axis=-1) | (values.mid < -values.rad).all(axis=-1))


def _length(vector: Balls) -> Balls:
    return root((vector * vector.conj).real)
