"""Circle and ellipse: coincident, tangent, near-circular, wide tolerances (lambda page, 12.11 to 12.16, 14.5)."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["circles", "clipped", "coincident", "near_circular", "printed_hulls", "tangent", "wide_tolerances"]

#: Semi-axis b of E4 at 90 degrees, section 14.2.
B90 = "17.4617879639289313590283215334"


def _hull(check: Checks, what: str, problem: object, expected: str) -> None:
    """Bounds lie outside of the printed ones, by two units in the last place at most."""
    from graphsynth.jamming.intersection import exact_hull

    found = exact_hull(problem)  # type: ignore[arg-type]
    texts = expected.split()
    names = ("x low", "x high", "y low", "y high")
    bounds = (found.hull.lo[0], found.hull.hi[0], found.hull.lo[1], found.hull.hi[1])
    slack = Fraction(1, 10**22)
    for name, bound, text in zip(names, bounds, texts):
        check.value(f"{what}: {name}", bound, text, relative=4.5e-16, absolute=1e-22)
        outward = (Fraction(text) - Fraction(float(bound))) * (1 if name.endswith("low") else -1)
        check.agrees(f"{what}: {name} is rounded outward", outward >= -slack)


def coincident(check: Checks) -> None:
    """Whole circle solves: hull ``[0, R1]^2``, UNDECIDED, with the reason."""
    from graphsynth.intervals import Status
    from graphsynth.jamming.intersection import Reason, circle_ellipse, exact_hull, krawczyk_boxes

    found = exact_hull(circle_ellipse(2, 2, 2))
    check.says("status", found.status, Status.UNDECIDED)
    check.says("reason", found.reasons, (Reason.COINCIDENT,))
    check.values("hull", [*found.hull.lo, *found.hull.hi], [0, 0, 2, 2])
    boxes = krawczyk_boxes(circle_ellipse(2, 2, 2), max_boxes=2000)
    check.says("boxes proved by Krawczyk's test", len(boxes.proved), 0)
    check.says("its status", boxes.status, Status.UNDECIDED)


def circles(check: Checks) -> None:
    """Concentric circles of different radii: EMPTY, proved, and which one is inside."""
    from graphsynth.intervals import Status
    from graphsynth.jamming.intersection import Reason, circle_ellipse, exact_hull, krawczyk_boxes

    tiny = Fraction(1, 10**30)
    for R1, reason in ((3, Reason.CIRCLE_OUTSIDE), (1, Reason.CIRCLE_INSIDE), (2 + tiny, Reason.CIRCLE_OUTSIDE)):
        found = exact_hull(circle_ellipse(R1, 2, 2))
        check.says(f"R1 = {float(R1):g}: status", found.status, Status.EMPTY)
        check.says(f"R1 = {float(R1):g}: reason", found.reasons, (reason,))
    check.says("Krawczyk's test", krawczyk_boxes(circle_ellipse(3, 2, 2)).status, Status.EMPTY)


def tangent(check: Checks) -> None:
    """Double points on an axis: exact hull, UNDECIDED with its reason; with a tolerance it grows like its root."""
    from graphsynth.intervals import Status
    from graphsynth.jamming.intersection import Reason, circle_ellipse, exact_hull

    for R1, eps, expected, reason in (
        ("17.53", "0", "17.53 17.53 0 0", Reason.TANGENT_LONG),
        (
            "17.53", "1e-9",
            "17.52999887662644729619965 17.53000000002852253280089 0 0.006275705179167286322514133", Reason.TOUCHES_Y,
        ),
        (B90, "0", f"0 0 {B90} {B90}", Reason.TANGENT_SHORT),
        (
            B90, "1e-9",
            "0 0.006275784850982951066368807 17.46178683619571042637229 17.46178796395756531112031", Reason.TOUCHES_X,
        ),
    ):  # fmt: skip
        problem = circle_ellipse(R1, "17.53", B90, eps=eps)
        what = f"R1 = {R1[:6]}, eps = {eps}"
        _hull(check, what, problem, expected)
        check.says(f"{what}: status", exact_hull(problem).status, Status.UNDECIDED)
        check.says(f"{what}: reason", exact_hull(problem).reasons, (reason,))
    tiny = Fraction(1, 10**30)
    for shift, status in ((tiny, Status.EMPTY), (-tiny, Status.UNIQUE), (Fraction(0), Status.UNDECIDED)):
        found = exact_hull(circle_ellipse(6 + shift, 6, 4))
        check.says(f"R1 - a = {float(shift):g}", found.status, status, source="exact fractions")


def near_circular(check: Checks) -> None:
    """Axes that differ in the ninth and twelfth digit: hull and areas keep all digits."""
    import mpmath as mp

    from graphsynth.jamming.bearing.areas import ellipse_circle_stable
    from graphsynth.jamming.bearing.areas_enclosed import enclose_crescents
    from graphsynth.jamming.intersection import circle_ellipse, exact_hull

    for power in (9, 12):
        d = Fraction(1, 10**power)
        found = exact_hull(circle_ellipse(1, 1 + d, 1 - d))
        with mp.workdps(80):
            D = mp.mpf(10) ** -power
            a, b = 1 + D, 1 - D
            x = a * mp.sqrt((1 - b * b) / (a * a - b * b))
            y = b * mp.sqrt((a * a - 1) / (a * a - b * b))
            area = 2 * (a * b * mp.atan2(a * y, b * x) - mp.atan2(y, x))
        for name, k, right in (("x", 0, x), ("y", 1, y)):
            what = f"1e-{power}: {name}"
            check.value(f"{what} low", found.hull.lo[k], right, relative=4e-16, source="80 digits")
            check.value(f"{what} high", found.hull.hi[k], right, relative=4e-16, source="80 digits")
            check.agrees(f"{what} is enclosed", found.hull.lo[k] <= right <= found.hull.hi[k], source="80 digits")
        # the double 1e-9 is not the decimal: reference for the double itself
        with mp.workdps(80):
            D = mp.mpf(float(d))
            a, b = 1 + D, 1 - D
            x = a * mp.sqrt((1 - b * b) / (a * a - b * b))
            y = b * mp.sqrt((a * a - 1) / (a * a - b * b))
            area = 2 * (a * b * mp.atan2(a * y, b * x) - mp.atan2(y, x))
        given = ellipse_circle_stable(1.0, float(d), float(d)).ellipse_only
        check.value(f"1e-{power}: crescent", given, area, relative=8e-15, source="80 digits")
        proved = enclose_crescents("1", f"1e-{power}", f"1e-{power}")
        low, high = float(proved.ellipse_only.lo), float(proved.ellipse_only.hi)
        check.agrees(
            f"1e-{power}: crescent enclosed",
            low <= area * (1 + mp.mpf(10) ** -15) and high >= area * (1 - mp.mpf(10) ** -15),
        )
        check.below(f"1e-{power}: width of the enclosure", (high - low) / high, 1e-10)


def clipped(check: Checks) -> None:
    """Tolerances that reach over an axis: the exact hull of what is left, and which axis."""
    from graphsynth.intervals import Status
    from graphsynth.jamming.intersection import Reason, circle_ellipse, exact_hull

    problem = circle_ellipse("17.5", "17.53", B90, eps="1e-2")
    _hull(check, "eps = 1e-2", problem, "0 17.50028571195339084827388 0 17.50028571195339084827388")
    found = exact_hull(problem)
    check.says("status", found.status, Status.UNDECIDED)
    check.says("reasons", found.reasons, (Reason.TOUCHES_X, Reason.TOUCHES_Y))
    check.says("boxes in the whole plane", len(found.four), 1)


def wide_tolerances(check: Checks) -> None:
    """Lower bounds of level or circle vanish: the parallelogram is clipped, by exact fractions here."""
    from graphsynth.intervals import Status
    from graphsynth.jamming.intersection import circle_ellipse, exact_hull

    for e1, e2 in ((0, 1), (0, 2), (25, 0), (100, 3)):
        found = exact_hull(circle_ellipse(5, 6, 4, e1, e2))
        right = _clip(Fraction(5), Fraction(6), Fraction(4), Fraction(e1), Fraction(e2))
        what = f"e1 = {e1}, e2 = {e2}"
        check.says(f"{what}: status", found.status, Status.UNDECIDED)
        given = [found.squares.lo[0], found.squares.hi[0], found.squares.lo[1], found.squares.hi[1]]
        check.values(f"{what}: squares", given, right, relative=4.5e-16, source="clipping with fractions")


def _clip(R1: Fraction, a: Fraction, b: Fraction, e1: Fraction, e2: Fraction) -> list[Fraction]:
    """Bounds of u = x^2 and v = y^2 by clipping the parallelogram edge by edge."""
    span = a**2 - b**2
    corners = []
    for s1, s2 in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        Q, E = R1**2 + s1 * e1, 1 + s2 * e2
        corners.append((a**2 * (Q - b**2 * E) / span, b**2 * (a**2 * E - Q) / span))
    for axis in (0, 1):
        kept = []
        for p, q in zip(corners, corners[1:] + corners[:1]):
            if p[axis] >= 0:
                kept.append(p)
            if (p[axis] < 0) != (q[axis] < 0):
                t = p[axis] / (p[axis] - q[axis])
                kept.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
        corners = kept
    u, v = zip(*corners)
    return [min(u), max(u), min(v), max(v)]


def printed_hulls(check: Checks) -> None:
    """Table of section 14.5, and the second problem there."""
    from graphsynth.jamming.intersection import circle_ellipse

    x0, y0 = "13.11490802879096276551727", "11.58659515976778845911871"
    for eps, expected in (
        ("0", f"{x0} {x0} {y0} {y0}"),
        ("1e-12", "13.11490802728940913618112 13.11490803029251639468150 "
                  "11.58659515806821775022441 11.58659516146735916776371"),
        ("1e-9", "13.11490652723724755728604 13.11490953034450605768957 "
                 "11.58659346019695503934472 11.58659685933837257868377"),
        ("1e-6", "13.11340638919384018378296 13.11640949647202360219709 "
                 "11.58489546439062678637722 11.58829460584473449768323"),
        ("1e-3", "11.51587326726977120518672 14.53912955095568154052795 "
                 "9.739851739145069863547885 13.17701266950068029306394"),
    ):  # fmt: skip
        _hull(check, f"eps = {eps}", circle_ellipse("17.5", "17.53", B90, eps=eps), expected)
    _hull(
        check, "e1 = 1e-3, e2 = 1e-6", circle_ellipse("17.5", "17.53", B90, "1e-3", "1e-6"),
        "13.10850140189148743244032 13.12131152758367451247872 11.57938615800076761795533 11.59379967899259973598900",
    )  # fmt: skip
    _hull(
        check, "ranges of the radii", circle_ellipse("17.5 +- 0.001", "[17.529, 17.531]", "[17.461, 17.462]"),
        "12.83170424860185077321160 13.43874902430272593057451 11.21093330913187315691290 11.89799844832790404113219",
    )  # fmt: skip
    _parabola(check)


def _parabola(check: Checks) -> None:
    """``x^2 + y^2 = 1 + d``, ``x = y^2`` by Krawczyk's test: bounds outside of the exact range, and close to it."""
    from graphsynth.intervals import Status, krawczyk

    def system(x, p):  # type: ignore[no-untyped-def]
        return [x[0] ** 2 + x[1] ** 2 - 1 - p[0], x[0] - x[1] ** 2]

    found = krawczyk(system, ["[0.5, 0.75]", "[0.7, 0.87]"], ["[-0.1, 0.1]"], rounds=30)
    check.equals("x^2 + y^2 = 1 + d, x = y^2: status", found.status, Status.UNIQUE)
    exact_range = (
        ("x", 0, "0.5723805294763608304814160", "0.6618950038622250655537796"),
        ("y", 1, "0.7565583450576438063597680", "0.8135692987461025532683699"),
    )
    for name, k, low, high in exact_range:
        lo, hi = Fraction(float(found.box.lo[k])), Fraction(float(found.box.hi[k]))
        check.agrees(
            f"{name} is enclosed", lo <= Fraction(low) and hi >= Fraction(high), f"[{float(lo):.6f}, {float(hi):.6f}]"
        )
    point = krawczyk(system, ["[0.5, 0.75]", "[0.7, 0.87]"], ["0"], rounds=30)
    for k, right in enumerate(("0.6180339887498948482045868", "0.7861513777574232860695586")):
        check.value(f"d = 0: unknown {k}", float(point.box.mid[k]), right, absolute=1e-14)
