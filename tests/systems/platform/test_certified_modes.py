"""Certified assembly modes: reference values inside the enclosures, agreement with 200 digits, nothing by luck."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

import flint
import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import ball, complex_ball, gaussian, precision, rational
from graphsynth.systems.platform import (
    AssemblyCertificate,
    AssemblyVerdict,
    ModeEnclosure,
    certify_assembly_modes,
    certify_assembly_modes_batch,
    certify_direct,
    certify_direct_batch,
)
from graphsynth.systems.platform.certified_exact_modes import exact_roots, sextic_balls
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

D = [("0", "0"), ("2.5", "0.2"), ("1.1", "2.3")]
B = [("-0.4", "-0.25"), ("0.45", "-0.3"), ("0.05", "0.5")]
L1, L2 = ["0.9", "1.0", "0.8"], ["1.1", "0.95", "1.05"]
HOME = [("0.9", "0"), ("3.5", "0.2"), ("1.9", "2.3")]  # G1 at theta = (0, 0, 0)


def inside(value: Any, text: str, unit: str = "0.5") -> bool:
    """Whether a printed number, within half a unit of its last place (or ``unit``), meets the ball."""
    digits = len(text.split(".")[1])
    with precision(300):
        return bool((flint.arb(text) + flint.arb(0, f"{unit}e-{digits}")).overlaps(flint.arb(value)))


def elbows(theta: Sequence[str], slack: str = "0") -> list[Any]:
    """Anchors of G1 at printed angles, exact decimals, as balls of 300 digits."""
    with precision(1000):
        found = []
        for pivot, arm, angle in zip(D, L1, theta):
            s, c = (flint.arb(angle) + flint.arb(0, slack)).sin_cos()
            found.append(complex_ball(gaussian("D", pivot)) + ball(rational("l1", arm)) * flint.acb(c, s))
    return found


def check(modes: tuple[ModeEnclosure, ...], expected: list[tuple[str, ...]]) -> None:
    assert len(modes) == len(expected)
    for mode, texts in zip(modes, expected):
        for value, text in zip((mode.x, mode.y, mode.alpha, mode.determinant), texts):
            assert inside(value, text), (value, text)


# --- reference values


def test_g1_at_zero_angles() -> None:
    proof = certify_assembly_modes(HOME, B, L2, max_bits=256)
    assert proof.certified and proof.cross_check is True and proof.method == "subdivision"
    check(proof.modes, [
        ("2.201176574824335152036418315111726", "0.8592023940960303889858882300747313",
         "-0.1676478906740002300845393288613099", "-5.160695960119047064362753245"),
        ("2.172192970780247706912768147214596", "0.7866243880900504876483939425547658",
         "0.4780458846922180136167385177734372", "5.193397665195021007556334361"),
    ])  # fmt: skip
    with precision(128):
        s = sextic_balls([complex_ball(gaussian("A", v)) for v in HOME], [complex_ball(gaussian("b", v)) for v in B],
                         [ball(rational("l", v)) for v in L2])  # fmt: skip
        assert s.g[0].contains(flint.fmpq(4308263188125, 10**10))
        assert s.g[3].real.contains(flint.fmpq(-1033986, 10**5)) and s.g[3].imag.contains(flint.fmpq(503622, 10**5))


def test_g1_at_the_reference_pose() -> None:
    theta = ["1.820203731367051943318523950600570", "-2.644475043988912944478601459321876",
             "-0.1619825351011604738549565239053447"]  # fmt: skip
    proof = certify_assembly_modes(elbows(theta, "1e-33"), B, L2)
    check(proof.modes, [
        ("1.170779876116247460706011555938", "1.013261618710664131601840694857",
         "-1.20068946437939084629563283293", "-9.39946923287344333025162896"),
        ("1.2000000000000000000000000000", "0.9000000000000000000000000000", "0.1500000000000000000000000000",
         "9.14629168272994193080388760"),
    ])  # fmt: skip


NEAR = {
    "1e-3": (
        [
            "1.993963026206228016672296632595370356845",
            "3.883339916240559650861563252219424055145",
            "-0.02522615783274709427062438503457063163104",
        ],
        ("1.2", "0.9", "-0.4901740394327007164363865225797646916457"),
        (
            "1.200014497939407542492780356208929262709",
            "0.9001896876724395120125318104648516363947",
            "-0.4921764773997155301383646838947536089142",
        ),
        "0.0166759057795468702103895470934",
    ),
    "1e-6": (
        [
            "1.993977033694318608277538269252194065751",
            "3.883435523856570219287331300269557275857",
            "-0.02534662599308213334215829417781596377881",
        ],
        ("1.2", "0.9", "-0.4911730394327007164363865225797646916457"),
        (
            "1.20000001459283831858164522422128920841",
            "0.9000001896204544865439378048576210452906",
            "-0.4911750416750986847740103988954935308036",
        ),
        "0.0000166748631858956662886844118749",
    ),
    "1e-9": (
        [
            "1.99397704729682579100913434633926119239",
            "3.883435618987425947731696729011853971623",
            "-0.0253467469262519167982482485531679969043",
        ],
        ("1.2", "0.9", "-0.4911740384327007164363865225797646916457"),
        (
            "1.200000000014592933160680087177298628929",
            "0.9000000001896203871881050578521114808857",
            "-0.4911740404349429188679371003598414373085",
        ),
        "0.000000016674862136492409772587501098",
    ),
    "1e-12": (
        [
            "1.993977047310427893273409240925632591882",
            "3.883435619082556326758317157326704979355",
            "-0.02534674704718555144288409189953178994069",
        ],
        ("1.2", "0.9", "-0.4911740394317007164363865225797646916457"),
        (
            "1.200000000000014592933255522128768196723",
            "0.9000000000001896203871208065385862516074",
            "-0.4911740394337029586386225364028611409906",
        ),
        "1.66748621354429997088633823544e-11",
    ),
}


@pytest.mark.parametrize("eps", NEAR)
def test_near_double_roots_are_kept_apart(eps: str) -> None:
    theta, given_, twin, determinant = NEAR[eps]
    proof = certify_assembly_modes(elbows(theta), B, L2)
    assert proof.certified and len(proof) == 2
    low, high = proof.modes
    lost = round(-math.log10(float(eps)))  # the printed angles determine the modes to fewer digits
    for mode, texts in ((high, given_), (low, twin)):
        for value, text in zip((mode.x, mode.y, mode.alpha), texts):
            whole, digits = (text if "." in text else text + ".").split(".")
            assert inside(value, f"{whole}.{digits.ljust(40, '0')[: 36 - lost]}", "1")
    mantissa, _, exponent = determinant.partition("e")
    with precision(300):
        scaled = high.determinant * flint.arb(f"1e{-int(exponent or 0)}")
    assert inside(scaled, mantissa[:16], "1") and low.determinant < 0


def test_what_the_input_does_not_decide_stays_undecided() -> None:
    """Angles known to 1e-12 beside a double root whose twin is 2e-9 away: both counts are possible."""
    proof = certify_assembly_modes(elbows(NEAR["1e-9"][0], "1e-12"), B, L2)
    assert not proof.certified and len(proof) == 0 and "alpha = " in proof.reason
    # the same knowledge decides where the modes are far apart
    assert certify_assembly_modes(elbows(NEAR["1e-3"][0], "1e-12"), B, L2).certified


def test_symmetric_home_position_has_two_modes() -> None:
    """Exactly symmetric data (balls): double roots off the circle do not disturb the subdivision."""
    with precision(600):
        anchors, vertices = [], []
        for twelfths in (-5, -1, 3):
            s, c = flint.arb.sin_cos_pi_fmpq(flint.fmpq(twelfths, 6))
            turn = flint.acb(c, s)
            anchors.append(flint.acb(flint.arb("61.8") + 0, flint.arb("57.6")) * turn)
            vertices.append(45 * turn)
    proof = certify_assembly_modes(anchors, vertices, [60, 60, 60], cross_check=False)
    assert proof.certified
    check(proof.modes, [
        ("0.0000000000000", "0.0000000000000", "0.0000000000000", "-193945349.94704"),
        ("0.0000000000000", "0.0000000000000", "1.5004735628848400633", "193945349.94704"),
    ])  # fmt: skip
    theta = [0.23980466638967102, 2.3341997687831666, -1.8545904360032245]
    assert len(certify_direct(ParallelPlatform.mock(), theta)) == 2
    assert certify_direct_batch(ParallelPlatform.mock(), theta).counts.tolist() == [2]


# --- degenerate data, exactly


@pytest.mark.slow
def test_exact_double_root_of_rational_data() -> None:
    """Similar triangles, legs pulled straight through one point: the twin modes have merged at alpha = 0."""
    vertices = [(3, 4), (-5, 0), (4, -3)]
    anchors = [(6, 8), (-10, 0), (8, -6)]
    proof = certify_assembly_modes(anchors, vertices, [5, 5, 5], max_bits=128)
    assert proof.certified and proof.method == "exact polynomial"
    with mp.workdps(200):
        roots = circle_roots(anchors, vertices, [5, 5, 5])
    assert [m.multiplicity for m in proof.modes] == [k for _, k in roots] == [2]
    mode = proof.modes[0]
    assert mode.alpha.contains(0) and mode.x.contains(0) and mode.y.contains(0) and mode.determinant.contains(0)
    assert "multiple" in proof.statement


def test_a_hair_beside_the_double_root() -> None:
    """Legs shorter by 1e-30 leave no mode, longer by 1e-30 two; both counts are proved."""
    vertices, anchors = [(3, 4), (-5, 0), (4, -3)], [(6, 8), (-10, 0), (8, -6)]
    for sign, count in ((-1, 0), (1, 2)):
        length = 5 + Fraction(sign, 10**30)
        proof = certify_assembly_modes(anchors, vertices, [length] * 3, cross_check=False)
        assert proof.certified and len(proof) == count


def test_self_motion_is_recognised_exactly() -> None:
    triangle = [(0, 0), (4, 0), (1, 3)]
    turned = [(Fraction(3, 5) * x - Fraction(4, 5) * y, Fraction(4, 5) * x + Fraction(3, 5) * y) for x, y in triangle]
    assert certify_assembly_modes(turned, triangle, [2, 2, 2]).verdict is AssemblyVerdict.SELF_MOTION
    # with unequal legs nothing is left at that orientation
    unequal = certify_assembly_modes(turned, triangle, [2, 2, Fraction(21, 10)])
    assert unequal.certified and all(not mode.alpha.contains(math.atan2(4, 3)) for mode in unequal.modes)


def closed(proof: AssemblyCertificate, anchors: list[Any], vertices: list[Any], lengths: list[Any]) -> bool:
    """Whether every enclosure satisfies the closure equations: their balls hold zero and are small."""
    with precision(200):
        for mode in proof.modes:
            s, c = mode.alpha.sin_cos()
            for anchor, vertex, length in zip(anchors, vertices, lengths):
                d = flint.acb(mode.x, mode.y) + flint.acb(c, s) * complex_ball(gaussian("b", vertex))
                d -= complex_ball(gaussian("A", anchor))
                f = d.real * d.real + d.imag * d.imag - ball(rational("l", length)) ** 2
                if not (f.contains(0) and abs(f) < 1e-6):
                    return False
    return True


def test_two_modes_of_equal_orientation_are_kept_apart() -> None:
    """Delta = 0 at alpha = 0, where e = (-6, -3) and Q = (3, +4) or (3, -4): legs 5, 5, 4.

    See theory/platform-direct 3.
    """
    anchors, vertices, lengths = [(0, 0), (12, 0), (6, 0)], [(0, 0), (6, 0), (3, 0)], [5, 5, 4]
    proof = certify_assembly_modes(anchors, vertices, lengths)
    assert proof.certified and proof.method == "exact polynomial" and closed(proof, anchors, vertices, lengths)
    level = sorted((mode for mode in proof.modes if mode.alpha.contains(0)), key=lambda mode: float(mode.y))
    assert [(round(float(m.x), 12), round(float(m.y), 12)) for m in level] == [(3.0, -4.0), (3.0, 4.0)]
    # a third leg that is a little longer contradicts the line: nothing is left there
    other = certify_assembly_modes(anchors, vertices, [5, 5, "4.000001"])
    assert not any(mode.alpha.contains(0) for mode in other.modes)


COORDINATE = st.integers(-4, 4)
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=3)


@pytest.mark.long
@given(POINTS, POINTS, st.lists(st.integers(1, 6), min_size=3, max_size=3))
@settings(max_examples=150, deadline=None)
def test_small_integers_are_decided_the_same_in_two_ways(
    anchors: list[tuple[int, int]], vertices: list[tuple[int, int]], lengths: list[int]
) -> None:
    """Degenerate data of every kind: subdivision against exact polynomials, and the closure equations."""
    proof = certify_assembly_modes(anchors, vertices, lengths, max_bits=128)
    assert proof.certified or proof.reason
    assert closed(proof, anchors, vertices, lengths)
    if proof.certified:
        weights = [(1 if m.determinant > 0 else -1) for m in proof.modes if m.multiplicity == 1]
        if len(weights) == len(proof.modes):
            assert sum(weights) == 0
    if proof.method == "subdivision" and proof.certified:
        A, b = [gaussian("A", v) for v in anchors], [gaussian("b", v) for v in vertices]
        with precision(128):
            roots = exact_roots(A, b, [Fraction(v) for v in lengths])
        assert roots is not None and len(roots) == len(proof)
        assert all(root.multiplicity == 1 for root in roots)


def test_exact_input_forms_agree() -> None:
    forms: list[list[Any]] = [[Decimal("0.5"), 0.5, "1/2"], [Fraction(1, 2)] * 3]
    counts = [len(certify_assembly_modes([0, 1, 1j], [0, 0.5, 0.5j], lengths)) for lengths in forms]
    assert counts[0] == counts[1]
    with pytest.raises(GeometryError, match="length of leg 2"):
        certify_assembly_modes([0, 1, 1j], [0, 1, 1j], [1, -1, 1])
    for bad in (math.nan, math.inf, "one", None):
        with pytest.raises(GeometryError, match="finite number"):
            certify_assembly_modes([0, 1, 1j], [0, 1, 1j], [1, 1, bad])
    with pytest.raises(GeometryError, match="anchors has 2 entries"):
        certify_assembly_modes([0, 1], [0, 1, 1j], [1, 1, 1])
    with pytest.raises(GeometryError, match="finite"):
        certify_assembly_modes_batch([[0, 1, np.nan]], [0, 1, 1j], [1, 1, 1])


def test_size_does_not_matter() -> None:
    for scale in (2.0**-200, 2.0**200):
        anchors = [scale * complex(float(x), float(y)) for x, y in HOME]
        vertices = [scale * complex(float(x), float(y)) for x, y in B]
        lengths = [scale * float(v) for v in L2]
        assert len(certify_assembly_modes(anchors, vertices, lengths)) == 2
        assert certify_assembly_modes_batch([anchors], vertices, lengths).counts.tolist() == [2]


# --- against 200 digits


def circle_roots(A: list[Any], b: list[Any], lengths: list[Any]) -> list[tuple[mp.mpf, int]]:
    """Roots of the sextic on the unit circle at 200 digits, merged within 1e-60, with multiplicities."""

    def number(v: Any) -> mp.mpc:
        if isinstance(v, tuple):
            return mp.mpc(*(mp.mpf(Fraction(t).numerator) / Fraction(t).denominator for t in v))
        return mp.mpmathify(v)

    A, b, l2 = [number(v) for v in A], [number(v) for v in b], [number(v).real for v in lengths]
    a2, a3, b2, b3, L = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0], l2[0] ** 2
    # Laurent polynomials in z as lists of coefficients from z^-1 to z^1, by the closure equations themselves
    e = [(-a, c) for a, c in ((a2, b2), (a3, b3))]  # e_k = c z - a
    conj = mp.conj
    w = [l2[k] ** 2 - L - abs(a) ** 2 - abs(c) ** 2 for k, a, c in ((1, a2, b2), (2, a3, b3))]
    W = [[conj(c) * a, w[k], c * conj(a)] for k, (a, c) in enumerate(((a2, b2), (a3, b3)))]
    E = [[0, ek[0], ek[1]] for ek in e]
    Ebar = [[conj(ek[1]), conj(ek[0]), 0] for ek in e]

    def times(p: list[Any], q: list[Any]) -> list[Any]:
        out = [mp.mpc(0)] * (len(p) + len(q) - 1)
        for i, u in enumerate(p):
            for j, v in enumerate(q):
                out[i + j] += u * v
        return out

    def minus(p: list[Any], q: list[Any]) -> list[Any]:
        return [u - v for u, v in zip(p, q)]

    N = minus(times(W[0], E[1]), times(W[1], E[0]))  # z^-2 .. z^2
    Delta = minus(times(Ebar[0], E[1]), times(Ebar[1], E[0]))
    Nbar = [conj(v) for v in reversed(N)]
    # Delta is minus its own conjugate: |Delta|^2 = -Delta^2
    G = [u + L * v for u, v in zip(times(N, Nbar), times(Delta, Delta))]  # z^-4 .. z^4
    size = max(abs(v) for v in G)
    while G and abs(G[-1]) < size * mp.mpf(10) ** -150:
        G.pop()
    while G and abs(G[0]) < size * mp.mpf(10) ** -150:
        G.pop(0)
    roots = mp.polyroots(G[::-1], maxsteps=2000, extraprec=2000) if len(G) > 1 else []
    found: list[list[Any]] = []
    for z in roots:
        if abs(abs(z) - 1) < mp.mpf(10) ** -40:
            for known in found:
                if abs(known[0] - z) < mp.mpf(10) ** -40:
                    known[1] += 1
                    break
            else:
                found.append([z, 1])
    return sorted((mp.arg(z), k) for z, k in found)


@pytest.mark.long
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=12, deadline=None)
def test_random_platforms_agree_with_two_hundred_digits(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = (random.normal(size=3) + 1j * random.normal(size=3)).tolist()
    b = (random.uniform(0.2, 1.5) * (random.normal(size=3) + 1j * random.normal(size=3))).tolist()
    pose, turn = complex(*random.normal(size=2)), cmath.exp(1j * random.uniform(-3, 3))
    lengths = [abs(pose + turn * v - a) for a, v in zip(A, b)]
    proof, batch = certify_assembly_modes(A, b, lengths), certify_assembly_modes_batch([A], b, lengths)
    with mp.workdps(200):
        roots = circle_roots(A, b, lengths)
        assert proof.certified and len(proof) == len(roots) == batch.counts[0]
        assert len(roots) % 2 == 0 and len(roots) >= 2
        for k, (mode, (alpha, _)) in enumerate(zip(proof.modes, roots)):
            assert abs(mp.mpf(float(mode.alpha.mid())) - alpha) <= mode.radius[2] * 1.01 + 1e-16
            assert abs(mp.mpf(float(batch.poses[k, 2])) - alpha) <= batch.radii[k, 2]
            # position by the closure equations, not by N / Delta
            z = mp.expj(alpha)
            p = mp.mpc(*(float(v) for v in batch.poses[k, :2]))
            start = [p.real, p.imag, mp.mpf(alpha)]
            exact = mp.findroot(
                lambda x, y, t, z=z: [
                    abs(mp.mpc(x, y) + mp.expj(t) * mp.mpmathify(v) - mp.mpmathify(a)) ** 2 - mp.mpf(l) ** 2
                    for a, v, l in zip(A, b, lengths)
                ],
                start, tol=1e-60,
            )  # fmt: skip
            assert (
                np.array([abs(exact[i] - mp.mpf(float(batch.poses[k, i]))) for i in range(2)]) <= batch.radii[k, :2]
            ).all()
            assert abs(exact[2] - alpha) < mp.mpf(10) ** -30


@pytest.mark.parametrize("platform", [ParallelPlatform.g1(), ParallelPlatform.mock()])
def test_batch_agrees_with_single_problems_and_has_balanced_signs(platform: ParallelPlatform) -> None:
    theta = np.random.default_rng(9).uniform(-math.pi, math.pi, (400, 3))
    batch = certify_direct_batch(platform, theta)
    assert batch.certified.all() and (batch.counts % 2 == 0).all()
    balance = np.bincount(batch.problem, weights=batch.signs.astype(float), minlength=400)
    assert (balance == 0.0).all()
    for i in range(0, 400, 8):
        single = certify_direct(platform, theta[i].tolist())
        assert single.cross_check is not False and len(single) == batch.counts[i]
        for mode, pose, radius in zip(single.modes, batch.poses[batch.problem == i], batch.radii[batch.problem == i]):
            apart = np.abs(mode.pose - pose)
            assert (apart <= radius + mode.radius).all()


def test_spec_distribution_of_counts_is_proved() -> None:
    """The first part of the regression sample of theory/platform-direct 4, every problem with proof."""
    theta = np.random.default_rng(9).uniform(-math.pi, math.pi, (200000, 3))[:4000]
    g1, mock = certify_direct_batch(ParallelPlatform.g1(), theta), certify_direct_batch(ParallelPlatform.mock(), theta)
    for batch, platform in ((g1, ParallelPlatform.g1()), (mock, ParallelPlatform.mock())):
        estimated = platform.direct_batch(theta)
        assert batch.certified.all() and (batch.counts == estimated.counts).all()


@pytest.mark.slow
def test_whole_spec_distribution_is_proved() -> None:
    theta = np.random.default_rng(9).uniform(-math.pi, math.pi, (200000, 3))
    for platform, expected in (
        (ParallelPlatform.g1(), [147683, 45069, 4973, 2275]),
        (ParallelPlatform.mock(), [174206, 25561, 233, 0]),
    ):
        batch = certify_direct_batch(platform, theta)
        assert batch.certified.all()
        assert np.bincount(batch.counts, minlength=7)[::2].tolist() == expected
