"""`certify_assembly_modes`: the number of assembly modes of the planar platform proved, and every pose enclosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction
from time import perf_counter
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import three
from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import Gaussian, ball, complex_ball, gaussian, precision, rational
from graphsynth.kinematics.triad.assembly_modes import Sextic
from graphsynth.systems.platform.certified_exact_modes import (
    direction,
    exact_roots,
    isolate,
    mirror_count,
    parallel_positions,
    refine,
    self_motion,
    sextic_balls,
)
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

Array = NDArray[np.float64]

_LADDER = (64, 128, 256, 512, 1024)
_TRANSLATES = "at one orientation the platform translates on a circle: congruent triangles and equal legs"


class AssemblyVerdict(StrEnum):
    """Outcome of the certificate of a direct problem."""

    CERTIFIED = "certified"
    SELF_MOTION = "proved: self-motion"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class ModeEnclosure:
    """One assembly mode, enclosed.

    Attributes
    ----------
    x, y, alpha, determinant : arb
        Balls of python-flint that contain the exact pose and its ``det JX``; alpha up to whole turns, its midpoint in
        (-pi, pi].
    multiplicity : int
        1 for a regular mode, whose ``det JX`` is not zero; else that of the root alpha.
    """

    x: Any
    y: Any
    alpha: Any
    determinant: Any
    multiplicity: int = 1

    @property
    def pose(self) -> Array:
        """Midpoints ``(x, y, alpha)`` in double precision."""
        return np.array([float(v.mid()) for v in (self.x, self.y, self.alpha)])

    @property
    def radius(self) -> Array:
        """Bound of the distance of the exact ``(x, y, alpha)`` from `pose`."""
        return np.array([float(abs(v - m).upper()) for v, m in zip((self.x, self.y, self.alpha), self.pose)]) * (
            1.0 + 1e-15
        )


@dataclass(frozen=True, eq=False)
class AssemblyCertificate:
    """All assembly modes of one problem, with proof.

    Attributes
    ----------
    verdict : AssemblyVerdict
    modes : tuple of ModeEnclosure
        All modes, sorted by alpha; empty unless CERTIFIED.
    reason : str
        Why nothing is proved; empty if CERTIFIED.
    bits : int
        Binary digits that sufficed (or the last ones tried).
    method : str
        "subdivision", or "exact polynomial" at an exact singularity of rational data.
    cross_check : bool or None
        Whether root isolation with the mirror test gives the same count; None if it does not decide.
    seconds : float
    statement : str
    """

    verdict: AssemblyVerdict
    modes: tuple[ModeEnclosure, ...]
    reason: str
    bits: int
    method: str
    cross_check: bool | None
    seconds: float
    statement: str

    def __len__(self) -> int:
        return len(self.modes)

    @property
    def certified(self) -> bool:
        """Whether the count and every pose are proved."""
        return self.verdict is AssemblyVerdict.CERTIFIED


@dataclass(frozen=True)
class _Problem:
    """Exact data; ``arms`` (pivots, arm lengths, angles) replace the anchors where given."""

    vertices: list[Any]
    lengths: list[Any]
    anchors: list[Any]
    arms: tuple[list[Gaussian], list[Fraction], list[Fraction]] | None = None

    @property
    def exact(self) -> bool:
        """Whether all data are rational."""
        points = [*self.anchors, *self.vertices]
        return (
            self.arms is None
            and all(isinstance(v, Gaussian) for v in points)
            and all(isinstance(v, Fraction) for v in self.lengths)
        )

    def balls(self) -> tuple[list[Any], list[Any], list[Any]]:
        """Anchors, vertices and lengths at the precision set."""
        vertices, lengths = [complex_ball(v) for v in self.vertices], [ball(v) for v in self.lengths]
        if self.arms is None:
            return [complex_ball(v) for v in self.anchors], vertices, lengths
        arms = zip(*self.arms)
        anchors = [complex_ball(pivot) + ball(arm) * direction(ball(angle)) for pivot, arm, angle in arms]
        return anchors, vertices, lengths


def certify_assembly_modes(
    anchors: Sequence[Any],
    vertices: Sequence[Any],
    lengths: Sequence[Any],
    *,
    max_bits: int = 512,
    cross_check: bool = True,
) -> AssemblyCertificate:
    """Prove how many assembly modes exist for given anchors and leg lengths (3-RPR), and enclose each.

    Parameters
    ----------
    anchors, vertices : sequence of 3
        Points A_k and b_k: complex numbers, or pairs (x, y) of exact numbers.  Floats are exact dyadic numbers; int,
        Fraction, Decimal and texts such as "0.1" or "1/3" are exact too; ``acb`` balls stand for all their members.
    lengths : sequence of 3
        Leg lengths, exact numbers or ``arb`` balls.
    max_bits : int, optional
        Largest working precision.
    cross_check : bool, optional
        Isolate all six roots as well and compare the counts.

    Returns
    -------
    AssemblyCertificate
        Certified: subdivision of the circle in ball arithmetic, raised in precision until it decides.  Rational data at
        an exact singularity are decided with their multiplicities by exact polynomial arithmetic.

    Raises
    ------
    GeometryError
        Data that are not three points and lengths, a negative length.

    Notes
    -----
    See theory/platform-direct 5.

    Examples
    --------
    >>> proof = certify_assembly_modes(
    ...     [("0.9", 0), ("3.5", "0.2"), ("1.9", "2.3")],
    ...     [("-0.4", "-0.25"), ("0.45", "-0.3"), ("0.05", "0.5")], ["1.1", "0.95", "1.05"])
    >>> len(proof), proof.certified, proof.modes[0].pose.round(9).tolist()
    (2, True, [2.201176575, 0.859202394, -0.167647891])
    """
    problem = _Problem(_points("vertices", vertices), _lengths(lengths), _points("anchors", anchors))
    return _certify(problem, max_bits, cross_check)


def certify_direct(
    platform: ParallelPlatform, theta: Sequence[Any], *, max_bits: int = 512, cross_check: bool = True
) -> AssemblyCertificate:
    """Prove how many assembly modes a platform has at given rocker angles, and enclose each.

    As `certify_assembly_modes`, with ``A_k = D_k + l1_k exp(i theta_k)`` in ball arithmetic; the dimensions (floats)
    and the angles (exact numbers, radians) are taken as exact.

    Parameters
    ----------
    platform : ParallelPlatform
    theta : sequence of three numbers
        Rocker angles, radians; floats, integers, fractions or decimal text.
    max_bits, cross_check : optional
        As in `certify_assembly_modes`.

    Returns
    -------
    AssemblyCertificate

    Examples
    --------
    >>> len(certify_direct(ParallelPlatform.mock(), [0.239804666389671, 2.334199768783167, -1.854590436003224]))
    2
    """
    angles = [rational(f"theta of leg {k}", value) for k, value in enumerate(three("theta", theta), 1)]
    arms = ([gaussian("D", v) for v in platform.D], [rational("l1", v) for v in platform.l1], angles)
    problem = _Problem(_points("b", platform.b), _lengths(platform.l2), [], arms)
    return _certify(problem, max_bits, cross_check)


def _points(name: str, values: Sequence[Any]) -> list[Any]:
    found = enumerate(three(name, values), 1)
    return [v if isinstance(v, flint.acb) else gaussian(f"{name} {k}", v) for k, v in found]


def _lengths(values: Sequence[Any]) -> list[Any]:
    found = []
    for k, given in enumerate(three("lengths", values), 1):
        found.append(given if isinstance(given, flint.arb) else rational(f"length of leg {k}", given))
        if found[-1] < 0:
            raise GeometryError(f"length of leg {k} = {given} must be zero or more; correct the value")
    return found


def _certify(problem: _Problem, max_bits: int, cross_check: bool) -> AssemblyCertificate:
    begin = perf_counter()
    verdict, method, statement, checked = AssemblyVerdict.UNDECIDED, "subdivision", "", None
    modes: list[ModeEnclosure] | None = None
    reason, bits = "max_bits is less than 64; raise it", 0
    for bits in (b for b in _LADDER if b <= max_bits):
        with precision(bits):
            modes, reason = _subdivide(problem, bits)
            if modes is not None:
                count = mirror_count(sextic_balls(*problem.balls())) if cross_check else None
                checked = None if count is None else count == len(modes)
                break
    if modes is None and problem.exact:
        with precision(max(bits, 128)):
            if self_motion(problem.anchors, problem.vertices, problem.lengths):
                verdict, method = AssemblyVerdict.SELF_MOTION, "exact"
                statement = reason = _TRANSLATES
            else:
                modes, reason = _decide_exactly(problem, reason)
                method = method if modes is None else "exact polynomial"
    if checked is False:
        modes, reason = None, "subdivision and root isolation give different counts; please report these data"
    if modes is not None:
        verdict, merged = AssemblyVerdict.CERTIFIED, sum(mode.multiplicity > 1 for mode in modes)
        statement = f"certified: exactly {len(modes)} assembly modes, each enclosed"
        statement += f"; {merged} of them multiple roots (type-II singularity)" if merged else ""
    seconds, statement = perf_counter() - begin, statement or f"undecided: {reason}"
    return AssemblyCertificate(verdict, tuple(modes or ()), reason, bits, method, checked, seconds, statement)


def _subdivide(problem: _Problem, bits: int) -> tuple[list[ModeEnclosure] | None, str]:
    """All modes at one precision, or None and the reason why it does not decide."""
    A, b, lengths = problem.balls()
    s = sextic_balls(A, b, lengths)
    roots, reason = isolate(s, bits)
    if reason:
        return None, reason
    modes = []
    for low, high in roots:
        mode = _pose(s, A, b, refine(s, low, high, bits))
        if mode is None:
            return None, "Delta may vanish at a mode: its position is not determined by its orientation alone"
        if mode.determinant.contains(0):
            return None, "the sign of det JX at a mode is not decided"
        modes.append(mode)
    if sum(1 if mode.determinant > 0 else -1 for mode in modes) != 0:
        return None, "the signs of det JX do not cancel, which contradicts the theory; please report these data"
    return sorted(modes, key=lambda mode: float(mode.alpha)), ""


def _pose(s: Sextic, A: list[Any], b: list[Any], alpha: Any) -> ModeEnclosure | None:
    """Pose of a root; None if Delta may be zero."""
    z = direction(alpha)
    back, (n2, n1, n0, nm) = z.conjugate(), s.n
    Delta = s.d[0] + s.d[1] * z - s.d[1].conjugate() * back
    if Delta.contains(0):
        return None
    N = (n2 * z + n1) * z + n0 + nm * back
    return _enclosure(A, b, A[0] + N / Delta - z * b[0], z, alpha)


def _enclosure(A: list[Any], b: list[Any], p: Any, z: Any, alpha: Any) -> ModeEnclosure:
    """Mode at the position p and the orientation z, with ``det JX``."""
    rows = []
    for k in range(3):
        arm = z * b[k]
        d = p + arm - A[k]
        rows.append([2 * d.real, 2 * d.imag, 2 * (arm.real * d.imag - arm.imag * d.real)])
    turned = alpha - 2 * flint.arb.pi() if alpha.mid() > flint.arb.pi() else alpha
    return ModeEnclosure(p.real, p.imag, turned, flint.arb_mat(rows).det())


def _decide_exactly(problem: _Problem, reason: str) -> tuple[list[ModeEnclosure] | None, str]:
    """All modes of rational data with their multiplicities; None and a reason where a position is not determined."""
    data = problem.anchors, problem.vertices, problem.lengths
    roots = exact_roots(*data)
    if roots is None:
        return None, "every orientation solves the elimination equation: a self-motion, or a degenerate platform"
    A, b, lengths = problem.balls()
    s = sextic_balls(A, b, lengths)
    modes: list[ModeEnclosure] = []
    for root in roots:
        mode = _pose(s, A, b, root.alpha)
        if mode is not None:
            modes.append(replace(mode, multiplicity=root.multiplicity))
            continue
        positions = None if root.z is None else parallel_positions(*data, root.z)
        if positions is None:
            where = f"Delta may vanish at the root alpha = {float(root.alpha):.15g}"
            return None, f"{where}, so the position is not determined; {reason}"
        for p in positions:
            mode = _enclosure(A, b, p, complex_ball(root.z), root.alpha)
            regular = not mode.determinant.contains(0)
            modes.append(replace(mode, multiplicity=1 if regular else root.multiplicity))
    return modes, ""
