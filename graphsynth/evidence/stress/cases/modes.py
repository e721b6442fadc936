"""Assembly modes: none, merging, degenerate, self-motion, parity (platform page, 12.8 to 12.15, 14.4)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["coincident", "collinear", "delta_zero", "home", "none", "parity", "self_motion", "type_two"]

#: Section 14.4: distance from the singular pose, theta, alpha of the twin, det JX.
NEAR = (
    (
        "1e-3", ("1.993963026206228016672296632595370356845", "3.883339916240559650861563252219424055145",
        "-0.02522615783274709427062438503457063163104"), "-0.4921764773997155301383646838947536089142",
        "0.0166759057795468702103895470934",
    ),
    (
        "1e-6", ("1.993977033694318608277538269252194065751", "3.883435523856570219287331300269557275857",
        "-0.02534662599308213334215829417781596377881"), "-0.4911750416750986847740103988954935308036",
        "0.0000166748631858956662886844118749",
    ),
    (
        "1e-9", ("1.99397704729682579100913434633926119239", "3.883435618987425947731696729011853971623",
        "-0.0253467469262519167982482485531679969043"), "-0.4911740404349429188679168003599841373085",
        "0.000000016674862136492409772587501098",
    ),
    (
        "1e-12", ("1.993977047310427893273409240925632591882", "3.883435619082556326758317157326704979355",
        "-0.02534674704718555144288409189953178994069"), "-0.4911740394337029586386225364028611409906",
        "1.66748621354429997088633823544e-11",
    ),
)  # fmt: skip
ALPHA_S = "-0.491174039432700716436386522579764691645742"


def none(check: Checks) -> None:
    """No assembly mode: an empty list, by every method."""
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes, assembly_modes_batch
    from graphsynth.systems.platform import certify_assembly_modes

    for name, lengths in (("legs far too short", [1, 1, 1]), ("one leg far too long", [1, 1, 1e4])):
        modes = assembly_modes([0, 100, 50j], [0, 1, 1j], lengths)
        check.equals(f"{name}: modes", len(modes), 0)
        check.equals(f"{name}: consistent", modes.consistent, True)
        check.equals(f"{name}: flagged", modes.near_double_root, False)
    batch = assembly_modes_batch([[0, 100, 50j]] * 3, [0, 1, 1j], [1, 1, 1])
    check.equals("batch: counts", batch.counts.tolist(), [0, 0, 0])
    proof = certify_assembly_modes([(0, 0), (100, 0), (0, 50)], [(0, 0), (1, 0), (0, 1)], [1, 1, 1])
    check.equals("certified", proof.certified and len(proof) == 0, True)


def type_two(check: Checks) -> None:
    """Near-singular printed problems: both modes and a flag, in double precision and as proof."""
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    for eps, theta, twin, determinant in NEAR:
        given = [float(text) for text in theta]
        modes = g1.direct(given)
        if float(eps) >= 1e-6:
            # angles as doubles determine the modes to 1e-16 / eps
            loss = 1e-15 / float(eps) + 1e-16
            right = [twin, str(_sum(ALPHA_S, eps))]
            check.values(f"eps = {eps}: alpha", modes.poses[:, 2], right, absolute=loss, source="section 14.4")
            check.value(
                f"eps = {eps}: det JX", modes.determinants[-1], determinant, relative=40 * loss / float(eps),
                source="section 14.4",
            )  # fmt: skip
            check.agrees(f"eps = {eps}: consistent", modes.consistent)
        else:
            check.says(f"eps = {eps}: flag", modes.near_double_root, True)
            check.says(f"eps = {eps}: precision raised", modes.escalated, True)
            check.equals(f"eps = {eps}: modes for these doubles", len(modes), _count_for_doubles(given))
            if len(modes):
                away = np.abs(modes.poses[:, 2] - float(ALPHA_S)).max()
                check.below(f"eps = {eps}: distance of alpha", away, 2e-7)
        _proved(check, eps, theta, twin)
    _exactly_singular(check)


def _sum(a: str, b: str) -> Any:
    from decimal import Decimal, localcontext

    with localcontext() as context:
        context.prec = 50
        return Decimal(a) + Decimal(b)


def _elbows(theta: tuple[str, ...]) -> list[Any]:
    """Anchors of G1 at decimal angles, as balls."""
    import flint

    from graphsynth.kinematics.certify.numbers import ball, complex_ball, gaussian, rational
    from graphsynth.kinematics.certify.precision import precision

    with precision(1000):
        found = []
        for pivot, arm, angle in zip((("0", "0"), ("2.5", "0.2"), ("1.1", "2.3")), ("0.9", "1.0", "0.8"), theta):
            s, c = flint.arb(angle).sin_cos()
            found.append(complex_ball(gaussian("D", pivot)) + ball(rational("l1", arm)) * flint.acb(c, s))
        return found


def _proved(check: Checks, eps: str, theta: tuple[str, ...], twin: str) -> None:
    """Two modes, proved, with the printed orientations to the digits that the printed angles determine."""
    from graphsynth.systems.platform import certify_assembly_modes

    proof = certify_assembly_modes(
        _elbows(theta), [("-0.4", "-0.25"), ("0.45", "-0.3"), ("0.05", "0.5")], ["1.1", "0.95", "1.05"]
    )
    check.equals(f"eps = {eps}: two modes proved", proof.certified and len(proof) == 2, True)
    for name, mode, right in (("twin", proof.modes[0], twin), ("given", proof.modes[1], str(_sum(ALPHA_S, eps)))):
        radius = float(mode.radius[2]) + 1e-16
        check.value(f"eps = {eps}: alpha, {name}", float(mode.alpha.mid()), right, absolute=radius)
        check.below(f"eps = {eps}: radius, {name}", float(mode.radius[2]), 1e-4 * float(eps))


def _count_for_doubles(theta: list[float]) -> int:
    """Count the modes near the singular pose: closure of two legs, the third left over, extreme value at 60 digits."""
    import mpmath as mp

    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    with mp.workdps(60):
        A = [mp.mpc(D) + mp.mpf(r) * mp.expj(mp.mpf(t)) for D, r, t in zip(g1.D, g1.l1, theta)]
        b, l2 = [mp.mpc(v) for v in g1.b], [mp.mpf(v) for v in g1.l2]

        def third(alpha: Any) -> Any:
            c = [A[k] - mp.expj(alpha) * b[k] for k in (0, 1)]
            d = c[1] - c[0]
            along = (abs(d) ** 2 + l2[0] ** 2 - l2[1] ** 2) / (2 * abs(d))
            across = mp.sqrt(l2[0] ** 2 - along**2)
            options = [c[0] + d / abs(d) * mp.mpc(along, s * across) for s in (1, -1)]
            p = min(options, key=lambda q: abs(q - mp.mpc(1.2, 0.9)))
            return abs(p + mp.expj(alpha) * b[2] - A[2]) ** 2 - l2[2] ** 2

        low, high = mp.mpf(ALPHA_S) - mp.mpf("1e-4"), mp.mpf(ALPHA_S) + mp.mpf("1e-4")
        extreme = third(mp.findroot(lambda a: mp.diff(third, a), (low + high) / 2))
        return 2 if extreme * third(high) < 0 else 0


def _exactly_singular(check: Checks) -> None:
    """Similar triangles, legs pulled straight through one point: one double mode; a hair shorter none, longer two."""
    from fractions import Fraction

    from graphsynth.kinematics.triad.assembly_modes import assembly_modes
    from graphsynth.systems.platform import certify_assembly_modes
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    from graphsynth.systems.platform.singularity import singularity

    vertices, anchors = [(3, 4), (-5, 0), (4, -3)], [(6, 8), (-10, 0), (8, -6)]
    for name, shift, count in (
        ("exactly", Fraction(0), 1),
        ("1e-30 shorter", Fraction(-1, 10**30), 0),
        ("1e-30 longer", Fraction(1, 10**30), 2),
    ):
        proof = certify_assembly_modes(anchors, vertices, [5 + shift] * 3, cross_check=False)
        check.equals(f"singular {name}: modes proved", (proof.certified, len(proof)), (True, count))
        if name == "exactly":
            check.equals("its multiplicity", proof.modes[0].multiplicity, 2)
    double = assembly_modes([complex(*a) for a in anchors], [complex(*b) for b in vertices], [5, 5, 5])
    check.says("double precision: flag", double.near_double_root, True)
    check.says("double precision: merged mode", double.double.tolist(), [True])
    # MOCK at home turned to 2 atan(3/7): the free motion is reported
    mock = ParallelPlatform.mock()
    pose = [0.0, 0.0, 2 * math.atan(3 / 7)]
    theta = mock.inverse(pose, (-1, -1, -1)).theta
    found = singularity(mock, pose, theta)
    check.says("MOCK at 2 atan(3/7): type", found.kind, "II")
    check.says("free motions", len(found.uncontrolled), 1)
    flat = np.abs(found.uncontrolled[0, :2]).max()
    check.below("it is a rotation about the centre", float(flat), 1e-6)
    near = [0.0, 0.0, 2 * math.atan(3 / 7) - 1e-6]
    condition = mock.condition_number(near, mock.inverse(near, (-1, -1, -1)).theta, 45.0)
    check.agrees("condition number 1e-6 beside it", 1e5 < float(condition) < 1e8, f"{float(condition):.3g}")


def delta_zero(check: Checks) -> None:
    """Two modes of equal orientation: both found, kept apart; exact data have them at known places."""
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes
    from graphsynth.systems.platform import certify_assembly_modes

    Q = 0.3 + 1.1j
    modes = assembly_modes([0, 2, 5], [0, 1, 2], [abs(Q), abs(Q - 1), abs(Q - 3)])
    level = modes.poses[np.abs(modes.poses[:, 2]) < 1e-9]
    order = np.argsort(level[:, 1])
    check.values("x", level[order, 0], ["0.3", "0.3"], absolute=1e-12, source="closed form")
    check.values("y", level[order, 1], ["-1.1", "1.1"], absolute=1e-12, source="closed form")
    check.equals("consistent", modes.consistent, True)
    # similar collinear triangles: the root is fourfold, which 50 digits do not isolate; the exact method does
    anchors, vertices, lengths = [(0, 0), (12, 0), (6, 0)], [(0, 0), (6, 0), (3, 0)], [5, 5, 4]
    flat = assembly_modes([complex(*a) for a in anchors], [complex(*b) for b in vertices], lengths)
    check.says("fourfold root: flag", (flat.near_double_root, flat.consistent), (True, False))
    check.mentions("fourfold root: sentence", flat.self_motion, "not decided")
    proof = certify_assembly_modes(anchors, vertices, lengths)
    exact = sorted((float(m.x), float(m.y)) for m in proof.modes if m.alpha.contains(0))
    check.equals("fourfold root: proved", (proof.certified, len(exact)), (True, 2))
    check.values("fourfold root: places", [v for pair in exact for v in pair], [3, -4, 3, 4], absolute=1e-15)


def coincident(check: Checks) -> None:
    """Vertices or anchors that coincide: the degree drops, the modes are right."""
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes

    for name, A, b in (
        ("two vertices", [0, 2, 1 + 2j], [0, 0, 0.5]),
        ("two anchors", [0, 0, 1 + 2j], [0, 1, 0.5 + 0.2j]),
    ):
        modes = assembly_modes(A, b, [1.5, 1.5, 1.5])
        check.mentions(f"{name}: note", modes.note, "degree drops")
        check.equals(f"{name}: consistent", modes.consistent, True)
        check.equals(f"{name}: modes", len(modes), _count_by_grid(A, b, [1.5, 1.5, 1.5]))
        opened = _opening(modes.poses, A, b, [1.5, 1.5, 1.5])
        check.below(f"{name}: closure", opened, 1e-12)


def _opening(poses: np.ndarray, A: Any, b: Any, lengths: Any) -> float:
    """Largest error of a leg length."""
    p = poses[:, :1] + 1j * poses[:, 1:2] + np.exp(1j * poses[:, 2:]) * np.asarray(b) - np.asarray(A)
    return float(np.abs(np.abs(p) - np.asarray(lengths)).max(initial=0.0))


def _count_by_grid(A: Any, b: Any, lengths: Any) -> int:
    """Sign changes of the third leg's error along both circles' crossings of the other two, over a fine grid of alpha.

    Needs leg 1 and 2 with different ends; legs are renumbered until they have.
    """
    A, b, l = np.asarray(A, complex), np.asarray(b, complex), np.asarray(lengths, float)
    alpha = np.linspace(-math.pi, math.pi, 40_001)
    z = np.exp(1j * alpha)
    for order in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
        i, j, k = order
        c0, c1 = A[i] - z * b[i], A[j] - z * b[j]
        d = c1 - c0
        if np.abs(d).min() > 1e-6:
            break
    size = np.abs(d)
    along = (size**2 + l[i] ** 2 - l[j] ** 2) / (2 * size)
    square = l[i] ** 2 - along**2
    across = np.sqrt(np.maximum(square, 0.0))
    count = 0
    curves = []
    for sign in (1.0, -1.0):
        p = c0 + d / size * (along + 1j * sign * across)
        error = np.where(square >= 0.0, np.abs(p + z * b[k] - A[k]) - l[k], np.nan)
        curves.append(error)
        with np.errstate(invalid="ignore"):
            count += int((error[:-1] * error[1:] < 0.0).sum())
    # where the two circles only just touch, both curves end at the same point: a sign change between them is a mode
    inside = square >= 0.0
    for a in np.flatnonzero(inside[:-1] != inside[1:]):
        at = a if inside[a] else a + 1
        count += int(curves[0][at] * curves[1][at] < 0.0)
    return count


def collinear(check: Checks) -> None:
    """Collinear vertices and anchors: works unchanged, at most four modes."""
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes, assembly_modes_batch
    from graphsynth.systems.platform import certify_assembly_modes

    A, b = [0, 2, 5], [0, 1, 1.8]
    for lengths in ([2.0, 1.5, 2.5], [3.0, 2.0, 2.2], [1.0, 1.4, 3.0]):
        modes = assembly_modes(A, b, lengths)
        check.agrees(f"{lengths}: at most four", len(modes) <= 4 and len(modes) % 2 == 0, str(len(modes)))
        check.equals(f"{lengths}: modes", len(modes), _count_by_grid(A, b, lengths))
        check.equals(f"{lengths}: consistent", modes.consistent, True)
        check.below(f"{lengths}: closure", _opening(modes.poses, A, b, lengths), 1e-12)
        # a mirror image in the line is a mode too
        mirrored = np.sort(-modes.poses[:, 1])
        check.below(
            f"{lengths}: mirror image", float(np.abs(mirrored - np.sort(modes.poses[:, 1])).max(initial=0.0)), 1e-11
        )
    proof = certify_assembly_modes([(0, 0), (2, 0), (5, 0)], [(0, 0), (1, 0), ("1.8", 0)], [2, "1.5", "2.5"])
    check.equals("proved", (proof.certified, len(proof)), (True, _count_by_grid(A, b, [2.0, 1.5, 2.5])))
    random = np.random.default_rng(5)
    batch = assembly_modes_batch([A] * 500, b, random.uniform(0.5, 4.0, (500, 3)))
    check.agrees("500 random problems: at most four", batch.counts.max() <= 4, str(batch.counts.max()))


def self_motion(check: Checks) -> None:
    """Congruent triangles and equal legs: a family of poses with its description, no list of modes."""
    from fractions import Fraction

    from graphsynth.kinematics.triad.assembly_modes import assembly_modes
    from graphsynth.systems.platform import certify_assembly_modes

    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    found = assembly_modes(3 + corner, corner, [0.5, 0.5, 0.5])
    check.mentions("description", found.self_motion, "translates", "circle")
    check.says("modes listed", len(found), 0)
    triangle = [(0, 0), (4, 0), (1, 3)]
    turned = [(Fraction(3, 5) * x - Fraction(4, 5) * y, Fraction(4, 5) * x + Fraction(3, 5) * y) for x, y in triangle]
    check.says("exact verdict", certify_assembly_modes(turned, triangle, [2, 2, 2]).verdict.name, "SELF_MOTION")
    unequal = certify_assembly_modes(turned, triangle, [2, 2, Fraction(21, 10)])
    check.equals("unequal legs: decided", unequal.certified, True)


def home(check: Checks) -> None:
    """Symmetric home position: two modes, printed, and proved in spite of the double roots off the circle."""
    from graphsynth.systems.platform import certify_direct, certify_direct_batch
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    mock = ParallelPlatform.mock()
    theta = mock.inverse([0, 0, 0], (-1, -1, -1)).theta
    modes = mock.direct(theta)
    check.values(
        "alpha", modes.poses[:, 2], ["0", "1.500473562884840063348944637207295"], absolute=1e-15, source="section 14.5"
    )
    check.values(
        "det JX", modes.determinants, ["-193945349.947040493616359687622", "193945349.947040493616359687622"],
        relative=1e-14, source="section 14.5",
    )  # fmt: skip
    proof = certify_direct(mock, theta.tolist())
    check.equals("proved", (proof.certified, len(proof)), (True, 2))
    check.equals("proved in a batch", certify_direct_batch(mock, theta).counts.tolist(), [2])


def parity(check: Checks) -> None:
    """No count is odd, and the signs of ``det JX`` cancel, without a flag: searched for among random problems.

    An unflagged odd count would be reported as an internal error; here its absence is shown, with counts compared with
    companion eigenvalues.
    """
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes_batch
    from graphsynth.kinematics.triad.sextic import sextic

    random = np.random.default_rng(4)
    anchors = random.normal(size=(3000, 3)) + 1j * random.normal(size=(3000, 3))
    vertices = random.normal(size=(3000, 3)) + 1j * random.normal(size=(3000, 3))
    lengths = random.uniform(0.3, 3, (3000, 3))
    batch = assembly_modes_batch(anchors, vertices, lengths)
    plain = ~batch.near_double_root
    check.equals("odd counts without a flag among 3000", int((batch.counts[plain] % 2).sum()), 0)
    check.equals("inconsistent ones without a flag", int((~batch.consistent[plain]).sum()), 0)
    balance = np.bincount(batch.problem, weights=np.sign(batch.determinants), minlength=3000)
    check.equals("sums of signs that are not 0", int((balance[plain] != 0).sum()), 0)
    other = 0
    for k in range(300):
        g = np.array(sextic(anchors[k], vertices[k], lengths[k]).g, dtype=complex)
        roots = np.roots([g[3], g[2], g[1], g[0], *np.conj(g[1:])])
        other += bool(plain[k]) and int(np.sum(np.abs(np.abs(roots) - 1) < 1e-6)) != batch.counts[k]
    check.equals("counts unlike companion eigenvalues, of 300", int(other), 0)
