"""Classic mechanisms by name, each with its source.

Every function returns a `Mechanism` with a driver and a pose; the unit of length is free.  A Geneva wheel is not among
them: its pin leaves the slot in every turn and another slot takes it up, and a joint of a `Mechanism` holds for the
whole motion.

References
----------
Artobolevsky, Mechanisms in Modern Engineering Design (1975-1980); Kempe, How to Draw a Straight Line (1877); Norton,
Design of Machinery (2004).  Others where they are used.
"""

from __future__ import annotations

import math
from cmath import rect
from collections.abc import Callable
from inspect import getdoc
from typing import TypeVar

from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constructors import meeting
from graphsynth.mechanism.model import Mechanism

F = TypeVar("F", bound=Callable[..., Mechanism])
__all__ = [
    "chebyshev_lambda",
    "excavator_arm",
    "jansen",
    "klann",
    "pantograph",
    "peaucellier",
    "scott_russell",
    "stephenson_six_bar",
    "toggle_press",
    "watt_six_bar",
    "watt_straight_line",
    "whitworth_quick_return",
]


def _classic(function: F) -> F:
    """Say in the docstring what every function here returns."""
    function.__doc__ = f"{getdoc(function)}\n\nReturns\n-------\nMechanism\n    With a driver and a pose."
    return function


def _places(text: str = "", **points: complex) -> dict[str, tuple[float, float]]:
    """Coordinates of points, from a text of names and numbers, or as complex numbers."""
    words = text.split()
    found = {name: (float(x), float(y)) for name, x, y in zip(words[::3], words[1::3], words[2::3])}
    return found | {name: (z.real, z.imag) for name, z in points.items()}


@_classic
def chebyshev_lambda() -> Mechanism:
    """Chebyshev's lambda linkage 2 : 1 : 2.5 : 2.5; "P" draws a nearly straight line over half a turn, 4 cranks long.

    Source: after P. L. Chebyshev (papers from 1854 on, this linkage 1878); Artobolevsky, volume 1; what the proportions
    give is computed in docs/explanation/bearing-jamming.md.
    """
    return Mechanism.four_bar(2.0, 1.0, 2.5, 2.5, coupler_point=(5.0, 0.0))


@_classic
def watt_straight_line() -> Mechanism:
    """Watt's straight-line linkage: two equal levers and a link whose middle "P" draws a slender figure of eight.

    Source: J. Watt, British patent 1432 (1784); Kempe (1877).  Levers 5, link 2, drawn in the middle of its stroke.
    """
    places = _places("A -5 1 B 0 1 C 0 -1 D 5 -1 P 0 0")
    return Mechanism.from_points(places, ["AB", "BPC", "CD"], "AD", "AB")


@_classic
def watt_six_bar() -> Mechanism:
    """Watt's six-bar, its two ternary links jointed: a crank-rocker whose rocker swings a second one further.

    Source: the chain of Watt's engine (1784), as the type Watt II in Norton, chapter 2.
    """
    return Mechanism.six_bar("watt", (4.0, 1.0, 4.0, 3.0), joint=(2.0, 1.0), link=3.0, output=3.0, pivot=(7.0, 0.0))


@_classic
def stephenson_six_bar() -> Mechanism:
    """Stephenson's six-bar, its two ternary links apart: the coupler of a crank-rocker drives a second rocker.

    Source: the chain of Stephenson's valve gear (1842), as the type Stephenson III in Norton, chapter 2.
    """
    return Mechanism.six_bar(
        "stephenson", (4.0, 1.0, 3.5, 3.0), joint=(2.0, 1.0), link=4.0, output=3.0, pivot=(6.0, -1.0)
    )


@_classic
def peaucellier(long: float = 5.0, short: float = 3.0, crank: float = 1.5) -> Mechanism:
    """Peaucellier's cell: its point "P" draws an exact straight line, for crank and distance of the pivots are equal.

    Source: C.-N. Peaucellier, Nouv. ann. math. 3 (1864) 414; Kempe (1877).  By inversion ``OP OR = long^2 - short^2``,
    so P lies at the distance ``(long^2 - short^2) / (2 crank)`` from the first pivot.

    Parameters
    ----------
    long, short, crank : float
        Sides of the cell, and the crank about the second pivot at (crank, 0); `GeometryError` if they do not fit.
    """
    if not 0.0 < long - short < 2.0 * crank < long + short:
        raise GeometryError(
            f"sides {long:g} and {short:g} do not fit the crank {crank:g}; long - short < 2 crank < their sum"
        )
    R = complex(2.0 * crank, 0.0)
    U = meeting(0j, long, R, short)
    places = _places(O=0j, Q=0.5 * R, R=R, U=U, V=U.conjugate(), P=2.0 * U.real - R)
    links = ["OU", "OV", "RU", "RV", "UP", "VP", "QR"]
    return Mechanism.from_points(places, links, "OQ", "QR", trace="P")


@_classic
def scott_russell(length: float = 2.0) -> Mechanism:
    """Scott Russell's linkage: a rod twice as long as the crank, its end "P" on an exact line through the crank's axis.

    Source: named after J. Scott Russell (1808-1882), patented by W. Freemantle (1803); Artobolevsky, volume 1.  The
    crank's pin is as far from both ends of the rod as from the crank's axis, so the angle is right (Thales).

    Parameters
    ----------
    length : float
        Of the rod; the crank is half as long and jointed to its middle.
    """
    B = rect(0.5 * length, math.radians(40.0))
    places = _places(O=0j, B=B, C=2.0 * B.real, P=2j * B.imag, E=3.0 * length)
    return Mechanism.from_points(places, ["OB", "PBC"], "OE", "OB", slides={"C": "OE"})


@_classic
def pantograph(scale: float = 2.0) -> Mechanism:
    """Pantograph: "P" draws what the slide on (1, 0)-(1, 2) leads "T" along, ``scale`` times as large from (0, 0).

    Source: after C. Scheiner, Pantographice (1631); Artobolevsky, volume 1.  The bars are a parallelogram, so T divides
    the way from O to P in the same ratio always.

    Parameters
    ----------
    scale : float
        Above 1, else `GeometryError`.
    """
    if not (math.isfinite(scale) and scale > 1.0):
        raise GeometryError(f"scale = {scale:g} must be above 1 and finite; give how many times larger P draws")
    T = complex(1.0, 0.5)
    P = scale * T
    B = meeting(0j, 1.2 * scale, P, 1.2 * scale)
    places = _places("U 1 -3 V 1 3", O=0j, D=B / scale, B=B, E=B + (P - B) / scale, T=T, P=P)
    return Mechanism.from_points(places, ["ODB", "BEP", "DT", "TE"], "OUV", (0, 5), slides={"T": "UV"}, trace="T")


@_classic
def whitworth_quick_return(ratio: float = 2.0) -> Mechanism:
    """Whitworth's quick return: the crank drives a slotted link that turns fully, slow half a turn and fast the other.

    Source: after J. Whitworth; Norton, chapter 3.  The slotted link turns about (0, 0), the crank 1 about (0, e): in
    one half turn of the link, above the ram's line, the crank turns by ``2 arccos(-e)``, in the other by
    ``2 arccos(e)``.

    Parameters
    ----------
    ratio : float
        Time of the slow half turn over that of the fast one, above 1, else `GeometryError`:
        ``cos(pi / (1 + ratio)) = e``.
    """
    if not (math.isfinite(ratio) and ratio > 1.0):
        raise GeometryError(f"ratio = {ratio:g} must be above 1 and finite; give the time ratio")
    e = math.cos(math.pi / (1.0 + ratio))
    A = complex(1.0, e)
    places = _places("C 5 0 T 9 0", O=0j, Q=1j * e, A=A, S=2.5 * A, B=-0.8 * A / abs(A))
    return Mechanism.from_points(places, ["QA", "BOS", "BC"], "OQT", "QA", slides={"A": "OS", "C": "OT"})


@_classic
def toggle_press(link: float = 1.0) -> Mechanism:
    """Toggle press: a crank stretches two equal links, and presses the ram "R" with a force that grows without bound.

    Source: after Norton, chapter 3, and Artobolevsky, volume 2; own proportions.  With both links at the angle t from
    the line of the ram its speed is ``2 link sin(t)`` times that of t, which vanishes where they are stretched.

    Parameters
    ----------
    link : float
        Length of both links of the toggle.
    """
    K = rect(link, math.radians(-80.0))
    Q = complex(1.6 * link, -0.6 * link)
    C = Q + rect(0.25 * link, math.radians(100.0))
    places = _places(O=0j, K=K, R=2j * K.imag, G=-3j * link, Q=Q, C=C)
    return Mechanism.from_points(places, ["QC", "CK", "OK", "KR"], "OQG", "QC", slides={"R": "OG"}, trace="R")


@_classic
def klann() -> Mechanism:
    """Klann's walking leg: a six-bar of Stephenson's chain whose foot "P" steps once for a turn of the crank.

    Source: after J. C. Klann, US patent 6260862 (2001).
    """
    places = _places(
        "A 1.366 1.366 B 1.009 0.574 O 1.599 0.75 M 1.331 0.75 E 0.741 0.75 D 0.232 0.866 H 0.866 1.366 P 0 0"
    )
    return Mechanism.from_points(places, ["OM", "MED", "BE", "AH", "DHP"], "OAB", "OM")


@_classic
def jansen() -> Mechanism:
    """Jansen's walking leg: eight links with his "holy numbers"; its foot "P" steps once for a turn of the crank.

    Source: T. Jansen, The Great Pretender (2007); a = 38, b = 41.5, c = 39.3, d = 40.1, e = 55.8, f = 39.4, g = 36.7,
    h = 65.7, i = 49, j = 50, k = 61.9, l = 7.8, m = 15.
    """
    numbers = "38 41.5 39.3 40.1 55.8 39.4 36.7 65.7 49 50 61.9 7.8 15"
    a, b, c, d, e, f, g, h, i, j, k, low, m = map(float, numbers.split())
    O, B = complex(a, low), 0j
    A = O + m
    C = meeting(B, b, A, j)  # above
    D = meeting(B, d, C, e)
    E = meeting(A, k, B, c)  # below
    F = meeting(E, g, D, f)
    P = meeting(E, i, F, h)
    places = _places(O=O, B=B, A=A, C=C, D=D, E=E, F=F, P=P)
    return Mechanism.from_points(places, ["OA", "AC", "BCD", "AE", "BE", "DF", "EFP"], "OB", "OA")


@_classic
def excavator_arm() -> Mechanism:
    """Excavator arm: boom, stick and bucket, each moved by a hydraulic cylinder; three drivers, in metres.

    Source: the usual arrangement of a backhoe; round lengths of a machine of about 20 tonnes, of no particular maker.
    The bucket with its tip "P" is turned through a four-bar.
    """
    places = _places(
        "A 0 1.8 B 0.6 1.4 C 2.6 4.6 D 5.4 5 E 3 5.3 F 5.09 5.515 G 6.6 3 H 5.95 5 K 6.394 3.343 "
        "L 6.85 3.62 M 6.93 3.12 P 6.7 1.7"
    )
    return Mechanism.from_points(
        places, ["ACED", "DFHKG", "KL", "LM", "GMP"], "AB", ["BC", "EF", "HL"], cylinders=["BC", "EF", "HL"]
    )
