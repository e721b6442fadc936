"""The drawings of the theory: what a lecturer would put on the board, drawn from the formulas of the page.

``python docs/pictures/theory.py [FOLDER]`` draws them anew.
"""

from __future__ import annotations

import cmath
import math
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import graphsynth as gs
from graphsynth.design import (
    CurveIndex,
    PathLinkage,
    burmester_curves,
    cognates,
    four_bars_for_poses,
    four_bars_through,
)
from graphsynth.design.curves.fourier import coefficients, orders, unit
from graphsynth.drawing.svg import number, painted, picture, words
from graphsynth.jamming import Bearing
from graphsynth.kinematics.triad.assembly_modes import assembly_modes
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.model import TracePoint
from graphsynth.systems.antenna.mechanism import PointingMechanism
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Points = Iterable[complex]


class Board:
    """A board with its origin and scale: points are complex numbers, y upwards."""

    def __init__(self, width: float, height: float, origin: complex, scale: float) -> None:
        self.width, self.height, self.origin, self.scale = width, height, origin, scale
        self.parts: list[str] = []

    def xy(self, point: complex) -> tuple[str, str]:
        """Place of a point on the page."""
        page = self.origin + self.scale * point.conjugate()
        return number(page.real), number(page.imag)

    def line(self, *points: complex, colour: str = "ink", width: float = 1.6, dash: str = "", fill: str = "") -> None:
        """Draw a polyline; a fill closes it."""
        path = "M" + " L".join(" ".join(self.xy(point)) for point in points) + ("Z" if fill else "")
        look = painted(fill, colour if width else "", width, opacity=0.25)
        more = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(f'<path d="{path}" {look}{more} stroke-linejoin="round" stroke-linecap="round"/>')

    def curve(self, points: Points, **look: object) -> None:
        """Draw a smooth curve through many points."""
        self.line(*points, **look)  # type: ignore[arg-type]

    def circle(self, centre: complex, radius: float, colour: str = "ink", width: float = 1.6, dash: str = "") -> None:
        """Draw a circle of a radius in the units of the drawing."""
        turn = [centre + radius * cmath.exp(2j * math.pi * k / 96) for k in range(97)]
        self.line(*turn, colour=colour, width=width, dash=dash)

    def arc(self, centre: complex, radius: float, start: float, stop: float, colour: str = "note") -> None:
        """Draw an arc with an arrow head at its end (angles in radians)."""
        turn = [centre + radius * cmath.exp(1j * (start + (stop - start) * k / 24)) for k in range(25)]
        self.line(*turn, colour=colour, width=1.2)
        self.head(turn[-1], turn[-1] - turn[-3], colour)

    def head(self, tip: complex, along: complex, colour: str = "ink") -> None:
        """Draw the head of an arrow."""
        back = 9.0 / self.scale * along / abs(along)
        path = " L".join(" ".join(self.xy(p)) for p in (tip, tip - back * (1 + 0.35j), tip - back * (1 - 0.35j)))
        self.parts.append(f'<path d="M{path}Z" {painted(colour)}/>')

    def arrow(self, start: complex, end: complex, colour: str = "ink", width: float = 1.6) -> None:
        """Draw an arrow."""
        self.line(start, end, colour=colour, width=width)
        self.head(end, end - start, colour)

    def span(self, start: complex, end: complex, text: str, aside: complex = 0j) -> None:
        """Draw a dimension line with an arrow at both ends and its text beside the middle."""
        self.line(start, end, colour="note", width=1.0)
        self.head(end, end - start, "note")
        self.head(start, start - end, "note")
        self.text((start + end) / 2 + aside, text, colour="note")

    def joint(self, *points: complex) -> None:
        """Draw revolute joints."""
        for point in points:
            x, y = self.xy(point)
            self.parts.append(f'<circle cx="{x}" cy="{y}" r="4" {painted("paper", "ink", 1.6)}/>')

    def ground(self, *points: complex) -> None:
        """Draw fixed pivots: a joint on a hatched foot."""
        for point in points:
            foot = [point + (a + 1j * b) / self.scale for a, b in ((0, 0), (-10, -16), (10, -16))]
            self.line(*foot, fill="note", colour="ink", width=1.2)
            self.joint(point)

    def text(self, at: complex, text: str, *, colour: str = "ink", size: float = 14.0, anchor: str = "middle") -> None:
        """Write text, its middle at a point."""
        page = self.origin + self.scale * at.conjugate()
        self.parts.append(
            words(text, page.real, page.imag + 0.36 * size, size=size, colour=colour, anchor=anchor, halo=3)
        )

    def svg(self, title: str) -> str:
        """Return the finished picture."""
        return picture(self.parts, self.width, self.height, title) + "\n"


def _ring(a: float, b: float, centre: complex = 0j, turn: complex = 1.0) -> list[complex]:
    """Points of an ellipse."""
    return [
        centre + turn * complex(a * math.cos(t), b * math.sin(t)) for t in (2 * math.pi * k / 120 for k in range(121))
    ]


def tilted_bearing() -> str:
    """Draw a tilted bearing in a long hole (A), and a long shaft through a short hole (B)."""
    board = Board(680, 330, 170 + 165j, 4.0)
    tilt = cmath.exp(-1j * math.radians(12))
    radius, half, clearance = 17.5, 9.0, 2.0
    for shift, short in ((0j, True), (82 + 0j, False)):
        hole, tall = radius + clearance, 26.0 if short else 9.0
        for side in (-1, 1):
            wall = [
                shift + side * x + 1j * y for x, y in ((hole, -tall), (hole + 9, -tall), (hole + 9, tall), (hole, tall))
            ]
            board.line(*wall, fill="note", colour="note", width=0)
            board.line(shift + side * hole - 1j * tall, shift + side * hole + 1j * tall, width=2)
        length = half if short else 27.0
        body = [
            shift + tilt * complex(x, y)
            for x, y in ((-radius, -length), (radius, -length), (radius, length), (-radius, length))
        ]
        board.line(*body, fill="a", colour="a", width=2)
        board.line(shift - 28j, shift + 33j, colour="note", width=1, dash="8 3 2 3")
        board.line(shift - 28j * tilt, shift + 33j * tilt, colour="a", width=1, dash="8 3 2 3")
        board.arc(shift, 30, math.pi / 2, math.pi / 2 - math.radians(12))
        board.text(shift + 3.5 + 34.5j, "t")
        touch = [tilt * complex(radius, half), -tilt * complex(radius, half)]
        if not short:
            touch = [complex(hole, 9.0), complex(-hole, -9.0)]
        for point in touch:
            x, y = board.xy(shift + point)
            board.parts.append(f'<circle cx="{x}" cy="{y}" r="6" {painted(stroke="b", width=2.5)}/>')
    board.span(-radius - clearance - 29j, radius + clearance - 29j, "2 Rh = 2 (R + c)", -4j)
    board.span(tilt * (-radius - 9j) - 2, tilt * (-radius + 9j) - 2, "", 0j)
    board.text(9.5 - 0.5j, "Hb = 2 h")
    board.text(-38.5j, "A: short bearing, long hole", size=15)
    board.text(82 - 38.5j, "B: long shaft, short hole", size=15)
    board.span(82 + 25 - 9j, 82 + 25 + 9j, "Hb", 4.5)
    return board.svg("A bearing whose axis is tilted by t touches its hole at two opposite points")


def lambda_linkage() -> str:
    """Draw the lambda linkage with its symbols and the path of its tracing point."""
    linkage = TiltedFourBar()
    board = Board(620, 420, 190 + 345j, 62.0)
    table = linkage.positions([math.radians(f) for f in range(0, 361, 3)])
    places = table.B
    path = [complex(*(2 * b - a)[:2]) for a, b in zip(table.A, places, strict=True)]
    board.curve(path, colour="b", width=2)
    board.circle(0j, 1.0, colour="note", width=1, dash="4 4")
    crank, k = table.A[20], 20
    a, b = complex(*crank[:2]), complex(*places[k][:2])
    m = 2 * b - a
    board.line(0j, a, width=3)
    board.line(a, m, width=3, colour="a")
    board.line(2 + 0j, b, width=3)
    board.line(0j, 2 + 0j, colour="note", width=1.2, dash="6 4")
    board.ground(0j, 2 + 0j)
    board.joint(a, b)
    board.arc(0j, 0.45, 0, cmath.phase(a))
    for at, text in (
        (-0.25 + 0.12j, "O"),
        (2.3 + 0j, "C"),
        (a - 0.24 + 0.1j, "A"),
        (b + 0.3 - 0.1j, "B"),
        (m + 0.3, "M"),
    ):
        board.text(at, text)
    for at, text in (
        (0.62 + 0.22j, "f"),
        (1.45 - 0.22j, "l1"),
        (a / 2 - 0.2 + 0.1j, "l2"),
        ((a + b) / 2 - 0.22, "l3"),
        ((2 + b) / 2 + 0.26, "l4"),
    ):
        board.text(at, text, colour="note")
    return board.svg("Chebyshev's lambda linkage and the path of its tracing point M")


def circle_and_ellipse() -> str:
    """Draw the shaft's circle and the two lids of the tilted hole (exaggerated)."""
    board = Board(560, 380, 280 + 180j, 8.0)
    radius, hole, tilt, half = 17.5, 18.2, 0.32, 5.0
    for sign in (-1, 1):
        board.curve(
            _ring(hole * math.cos(tilt), hole, sign * half * math.sin(tilt)), colour="a" if sign > 0 else "c", width=1.8
        )
    board.circle(0j, radius, colour="b", width=2.2)
    board.arrow(-22 + 0j, 24 + 0j, colour="note", width=1)
    board.text(25.5 + 0j, "u", colour="note")
    board.line(-half * math.sin(tilt) + 0j, half * math.sin(tilt) + 0j, width=4)
    board.text(3.4 - 1.8j, "h sin t")
    board.text(-18 + 13.5j, "shaft, radius R", colour="b", anchor="end")
    board.text(14 + 18j, "top lid", colour="a", anchor="start")
    board.text(-20 - 18j, "bottom lid", colour="c", anchor="end")
    board.text(-20.5j, "semi-axes Rh cos t along u, Rh across", colour="note", size=13)
    return board.svg("The two lids of a tilted hole, seen along the shaft, and the circle of the shaft")


def jam_arcs() -> str:
    """Draw the sine of the tilt over a turn against the critical one."""
    board = Board(690, 300, 60 + 150j, 1.5)
    kappa, high = 0.45, 62.0
    turn = [complex(f, high * math.sin(math.radians(f))) for f in range(361)]
    board.arrow(0j, 378 + 0j, colour="note", width=1)
    board.arrow(-80j, 85j, colour="note", width=1)
    board.curve(turn, colour="a", width=2.2)
    edge = math.degrees(math.asin(kappa))
    for sign, start in ((1, edge), (-1, 180 + edge)):
        stop = start + 180 - 2 * edge
        board.line(sign * 1j * kappa * high, 360 + sign * 1j * kappa * high, colour="note", width=1, dash="5 4")
        inside = [point for point in turn if start <= point.real <= stop]
        board.line(
            complex(start, sign * kappa * high),
            *inside,
            complex(stop, sign * kappa * high),
            fill="b",
            colour="b",
            width=1,
        )
        board.line(complex(start, -86), complex(stop, -86), colour="b", width=5)
    board.text(-16 + 1j * kappa * high, "κ")
    board.text(-18 - 1j * kappa * high, "−κ")
    board.text(384 + 12j, "f − ψ1", size=13)
    board.text(60 + 92j, "sin(f − ψ1)", colour="a", size=13)
    for f in (180, 360):
        board.text(complex(f - 12 if f == 180 else f + 12, -10), f"{f}°", size=12, colour="note")
    board.text(180 - 74j, "jam arcs", colour="b", size=13)
    return board.svg("Two jam arcs per turn, where the sine of the tilt exceeds the critical one")


def binding_corner() -> str:
    """Draw the part of a box of tolerances that binds, between two lines, and the box that is left to look at."""
    board = Board(560, 300, 60 + 255j, 1.0)
    wide, high, rest = 400.0, 205.0, 17.0

    def line(x: float) -> float:
        return 330.0 - 0.62 * x

    left, low = (330.0 - rest - high) / 0.62, line(wide) - rest
    board.line(0j, wide + 0j, complex(wide, high), 1j * high, 0j, colour="ink")
    corners = complex(left, low), complex(wide, low), complex(wide, high), complex(left, high)
    board.line(*corners, corners[0], colour="note", dash="5 4")
    curve = [complex(x, line(x) + 10.0 - 1.6e-3 * (x - 290.0) ** 2) for x in range(180, int(wide) + 1)]
    curve = [point for point in curve if point.imag <= high]
    board.line(*curve, complex(wide, high), colour="b", width=0, fill="b")
    board.curve(curve, colour="b", width=2.2)
    for shift in (rest, -rest):
        start = (330.0 + shift - high) / 0.62
        board.line(complex(start, high), complex(wide, line(wide) + shift), colour="a", width=1.2, dash="2 4")
    board.text(345 + 178j, "m < 0: binds", colour="b", size=13)
    board.text(80 + 70j, "ruled out", size=13)
    board.text(complex(wide + 42, line(wide)), "line ± ρ", colour="a", size=13)
    board.text(complex(left + 48, low + 14), "what is left", colour="note", size=12)
    board.text(wide - 14j, "v1", size=13)
    board.text(-14 + 1j * high, "v2", size=13)
    return board.svg("The part of a box that binds, the margin between two lines, and the box that is left")


def half_spaces() -> str:
    """Draw members free of binding between the half spaces of several wrenches, and the two lines of one box."""
    board = Board(560, 300, 50 + 262j, 1.0)
    tangents = [(at, 50.0 + 9.0 * math.sqrt(at - 40.0), 4.5 / math.sqrt(at - 40.0)) for at in (75, 120, 185, 350)]

    def verge(x: float) -> float:
        return min(height + slope * (x - at) for at, height, slope in tangents)

    edge = [complex(x, verge(x)) for x in range(60, 441)]
    board.line(0j + edge[0].real, *edge, 440 + 0j, colour="a", width=0, fill="a")
    board.curve(edge, colour="a", width=2.2)
    for at, height, slope in tangents:
        ends = [complex(x, height + slope * (x - at)) for x in (60, min(440.0, at + (235.0 - height) / slope))]
        board.line(*ends, colour="note", width=1.0, dash="2 5")
    left, right, low, high = 110.0, 265.0, 85.0, 215.0
    corners = complex(left, low), complex(right, low), complex(right, high), complex(left, high)
    board.line(*corners, corners[0], colour="ink")
    at, height, slope = tangents[2]
    for shift, colour in ((0.0, "b"), (-16.0, "a")):
        board.line(*(complex(x, height + shift + slope * (x - at)) for x in (left, right)), colour=colour, width=2.2)
    board.text(345 + 60j, "free at every input", colour="a", size=13)
    board.text(150 + 198j, "binds", colour="b", size=13)
    board.text(306 + 175j, "a·δ = low", colour="b", size=13)
    board.text(300 + 154j, "a·δ = c", colour="a", size=13)
    board.text(440 - 14j, "limit", size=13)
    board.text(28 + 200j, "tilt", size=13)
    return board.svg("Free members lie between the half spaces of all wrenches; two lines of a box bound what binds")


def whitney() -> str:
    """Draw a peg in a hole with two contacts, and the diagram of its loads."""
    board = Board(660, 330, 150 + 150j, 3.0)
    lean = cmath.exp(-1j * math.radians(7))
    for side in (-1, 1):
        wall = [complex(side * x, y) for x, y in ((21, 12), (38, 12), (38, -45), (21, -45))]
        board.line(*wall, fill="note", colour="note", width=0)
        board.line(complex(side * 38, 12), complex(side * 21, 12), complex(side * 21, -45), width=2)
    board.line(
        *(lean * complex(x, y) for x, y in ((-18, -28), (18, -28), (18, 40), (-18, 40))), fill="a", colour="a", width=2
    )
    tip = lean * -28j
    board.arrow(tip, tip - 18j, colour="b", width=2)
    board.arrow(tip, tip + 17, colour="b", width=2)
    board.text(tip - 22j - 5, "Fz", colour="b")
    board.text(tip + 11 + 6j, "Fx", colour="b")
    board.span(-43 + 12j, complex(-43, tip.imag), "l", -3.5)
    slope, reach = 0.55, 1.6
    centre = 118 - 5j
    corners = [
        complex(x * 26, y * 15)
        for x, y in (
            (1.25, reach - slope * 1.25 * 1.4),
            (1.25, -reach - slope * 1.25 * 1.4),
            (-1.25, -reach + slope * 1.25 * 1.4),
            (-1.25, reach + slope * 1.25 * 1.4),
        )
    ]
    board.arrow(centre - 44, centre + 46, colour="note", width=1)
    board.arrow(centre - 50j, centre + 49j, colour="note", width=1)
    board.line(*(centre + corner for corner in corners), fill="c", colour="c", width=2)
    board.text(centre + 42.5 - 5.5j, "Fx / Fz", size=13)
    board.text(centre + 18 + 46j, "M / (r Fz)", size=13)
    board.text(centre + 12j - 12, "no jamming", size=13)
    board.text(centre + 38 + 5j, "1/μ", size=12, colour="note")
    board.text(centre + 5 + 27j, "λ", size=12, colour="note")
    return board.svg("A peg with two contacts, and Whitney's parallelogram of loads without jamming")


def shared_tilt() -> str:
    """Draw the tilts of the joints close the loop: levers about a point p."""
    table = TiltedFourBar().positions([math.radians(60)])
    a, b = complex(*table.A[0][:2]), complex(*table.B[0][:2])
    board = Board(560, 330, 130 + 265j, 75.0)
    point = 3.6 + 2.2j
    for joint in (a, b, 2 + 0j):
        board.line(point, joint, colour="c", width=1.4, dash="5 4")
    board.line(0j, a, width=3)
    board.line(a, b, width=3, colour="a")
    board.line(2 + 0j, b, width=3)
    board.arrow(-0.9 + 0j, 4.6 + 0j, colour="b", width=2)
    board.text(4.75 + 0j, "a", colour="b")
    board.ground(0j, 2 + 0j)
    board.joint(a, b)
    board.span(complex(point.real, 0.06), point - 0.06j, "|a × (p − O)|", 0.66)
    for at, text in (
        (-0.22 + 0.2j, "O"),
        (a - 0.22 + 0.12j, "A"),
        (b + 0.02 + 0.25j, "B"),
        (2.25 - 0.2j, "C"),
        (point + 0.22 + 0.05j, "p"),
    ):
        board.text(at, text)
    board.text(3.2 + 0.95j, "t |p − r|", colour="c", size=13)
    return board.svg(
        "The tilted motor lifts a point p; every joint can give back its critical tilt times its distance from p"
    )


def _platform(
    board: Board, platform: ParallelPlatform, pose: complex, alpha: float, sigma: tuple[int, int, int], colour: str
) -> None:
    """Draw a platform on its legs."""
    angles = platform.inverse([[pose.real, pose.imag, alpha]], sigma).theta[0]
    corners = [pose + cmath.exp(1j * alpha) * vertex for vertex in platform.b]
    board.line(*corners, fill=colour, colour=colour, width=2)
    for pivot, arm, angle, corner in zip(platform.D, platform.l1, angles, corners, strict=True):
        elbow = pivot + arm * cmath.exp(1j * float(angle))
        board.line(pivot, elbow, width=3)
        board.line(elbow, corner, width=2)
        board.joint(elbow, corner)
        board.ground(pivot)


def platform() -> str:
    """Draw the reference platform G1 with its symbols."""
    g1 = ParallelPlatform.g1()
    board = Board(560, 400, 110 + 330j, 118.0)
    _platform(board, g1, 1.2 + 0.9j, 0.15, (1, 1, 1), "a")
    first = g1.D[0]
    angle = float(g1.inverse([[1.2, 0.9, 0.15]], (1, 1, 1)).theta[0][0])
    elbow = first + g1.l1[0] * cmath.exp(1j * angle)
    vertex = 1.2 + 0.9j + cmath.exp(0.15j) * g1.b[0]
    board.arc(first, 0.3, 0, angle)
    board.line(first, first + 0.5, colour="note", width=1)
    for at, text in (
        (first - 0.2 + 0.02j, "D1"),
        (elbow - 0.17 + 0.05j, "A1"),
        (vertex - 0.03 - 0.16j, "F1"),
        (1.2 + 0.9j, "p, α"),
        (first + 0.37 + 0.2j, "θ1"),
    ):
        board.text(at, text)
    board.text((first + elbow) / 2 - 0.16, "l1", colour="note")
    board.text((elbow + vertex) / 2 + 0.02 + 0.14j, "l2", colour="note")
    return board.svg("A platform on three legs: pivots D, rockers l1, intermediate links l2, vertices F")


def modes() -> str:
    """Draw both assembly modes of the reference platform at the same rocker angles."""
    g1 = ParallelPlatform.g1()
    board = Board(560, 420, 90 + 350j, 112.0)
    first = (1.2 + 0.9j, 0.15)
    second = (1.170779876116247 + 1.013261618710664j, -1.200689464379391)
    angles = g1.inverse([[1.2, 0.9, 0.15]], (1, 1, 1)).theta[0]
    elbows = [D + arm * cmath.exp(1j * float(angle)) for D, arm, angle in zip(g1.D, g1.l1, angles, strict=True)]
    for (place, alpha), colour in ((first, "a"), (second, "b")):
        corners = [place + cmath.exp(1j * alpha) * vertex for vertex in g1.b]
        board.line(*corners, fill=colour, colour=colour, width=2)
        for elbow, corner in zip(elbows, corners, strict=True):
            board.line(elbow, corner, colour=colour, width=1.6, dash="" if colour == "a" else "6 4")
            board.joint(corner)
    names = (("A1", -0.17 + 0.12j), ("A2", 0.03 - 0.16j), ("A3", 0.16 + 0.08j))
    for pivot, elbow, (name, aside) in zip(g1.D, elbows, names, strict=True):
        board.line(pivot, elbow, width=3)
        board.ground(pivot)
        board.joint(elbow)
        board.text(elbow + aside, name)
    return board.svg("The two assembly modes of a platform: the same rocker angles, two poses")


def six_modes() -> str:
    """Draw a structure of five links in all six ways in which it can be assembled."""
    fixed, carried = (0j, 2 + 0j, 0.73 + 1.56j), (0j, 1.41 + 0j, 1.17 - 0.97j)
    poses = assembly_modes(fixed, carried, (1.76, 1.94, 1.7)).poses
    board = Board(640, 470, 0j, 46.0)
    for k, (x, y, alpha) in enumerate(sorted(poses.tolist())):
        corners = [complex(x, y) + cmath.exp(1j * alpha) * vertex for vertex in carried]
        whole = [*fixed, *corners]
        middle = complex(*(0.5 * (min(side) + max(side)) for side in zip(*((z.real, z.imag) for z in whole))))
        board.origin = complex(110 + 210 * (k % 3), 120 + 230 * (k // 3)) - board.scale * middle.conjugate()
        board.line(*fixed, fill="ink", width=1.6)
        board.line(*corners, fill="a", colour="a", width=2)
        for anchor, corner in zip(fixed, corners):
            board.line(anchor, corner, width=3)
            board.joint(anchor)
            board.joint(corner)
    return board.svg("A structure of five links in its six assembly modes")


def singular() -> str:
    """Draw the lines of the intermediate links of the mock-up that meet in one point."""
    mock = ParallelPlatform.mock()
    board = Board(460, 420, 225 + 220j, 1.55)
    alpha = 2 * math.atan(3 / 7)
    _platform(board, mock, 0j, alpha, (-1, -1, -1), "a")
    angles = mock.inverse([[0.0, 0.0, alpha]], (-1, -1, -1)).theta[0]
    for D, arm, angle in zip(mock.D, mock.l1, angles, strict=True):
        elbow = D + arm * cmath.exp(1j * float(angle))
        board.line(elbow, -0.3 * elbow, colour="b", width=1.2, dash="6 4")
    board.text(72 - 38j, "det J = 0", colour="b", size=13)
    return board.svg("A type-II singularity: the lines of the three intermediate links pass through one point")


def levels() -> str:
    """Draw the mechanism graph of the source's Figure 3 by adjacency levels."""
    board = Board(680, 330, 40 + 60j, 1.0)
    rows = ((0,), (1, 2, 3, 4, 8, 9, 10), (5, 6, 7, 11, 12, 13), (14,))
    at = {}
    for k, row in enumerate(rows):
        for m, link in enumerate(row):
            at[link] = complex(320 + (m - (len(row) - 1) / 2) * 82, -75 * k)
        board.text(complex(0, -75 * k), f"L{k}", colour="note")
    single = "0-1 0-2 0-3 0-4 2-5 3-6 4-7 5-8 6-9 7-10 0-8 0-9 0-10 8-11 9-12 10-13 11-14 12-14 13-14"
    for pair in single.split():
        one, other = map(int, pair.split("-"))
        board.line(at[one], at[other], colour="note")
    for k, other in enumerate((2, 3, 4)):
        bend = (at[1] + at[other]) / 2 + 1j * (10 + 10 * k)
        board.curve([at[1], bend, at[other]], colour="b", width=2)
    for link, place in at.items():
        x, y = board.xy(place)
        board.parts.append(f'<circle cx="{x}" cy="{y}" r="14" {painted("paper", "a", 2)}/>')
        board.text(place, str(link), size=13)
    return board.svg("A mechanism graph by adjacency levels; gear pairs in the second colour")


def cuts() -> str:
    """Draw a four-bar as a spanning tree and the joint that is cut."""
    board = Board(620, 220, 40 + 175j, 70.0)
    for shift, cut in ((0j, False), (4.4 + 0j, True)):
        A, C = shift + 0.55 + 0.85j, shift + 3 + 0j
        B = shift + 2.3 + 1.7j
        near = B + (0.12j + 0.18 if cut else 0)
        board.line(shift, A, width=3)
        board.line(A, B, width=3, colour="a")
        board.line(C, near, width=3)
        board.ground(shift, C)
        board.joint(A, B)
        if cut:
            board.joint(near)
            board.line(B - 0.2 + 0.3j, near + 0.25 - 0.32j, colour="b", width=1.6, dash="4 3")
            board.text(B + 0.5 + 0.25j, "cut", colour="b")
    board.arrow(3.35 + 0.8j, 3.95 + 0.8j, colour="note")
    return board.svg("A closed loop becomes a tree of two branches and one cut joint")


def workspace() -> str:
    """Draw three annuli and their intersection."""
    g1 = ParallelPlatform.g1()
    board = Board(560, 480, 190 + 320j, 66.0)
    centres = [pivot - vertex for pivot, vertex in zip(g1.D, g1.b, strict=True)]
    step = 0.03
    for row in range(110):
        line = [complex(-0.6 + step * column, -0.9 + step * row) for column in range(130)]
        free = [
            p
            for p in line
            if all(abs(a - b) <= abs(p - c) <= a + b for a, b, c in zip(g1.l1, g1.l2, centres, strict=True))
        ]
        runs = [p for p in free if not any(abs(p - step - q) < 1e-9 for q in free)]
        for start in runs:
            end = start
            while any(abs(end + step - q) < 1e-9 for q in free):
                end += step
            board.line(start, end, colour="a", width=1.2)
    for centre, arm, link, colour in zip(centres, g1.l1, g1.l2, ("b", "c", "note"), strict=True):
        board.circle(centre, arm + link, colour=colour)
        board.circle(centre, abs(arm - link), colour=colour, dash="4 3")
        board.text(centre, "+", colour=colour)
    board.text(1.25 + 0.9j, "workspace")
    return board.svg("For a fixed orientation every leg reaches an annulus; the workspace is their intersection")


def drive() -> str:
    """Draw pinion, wheel, four-bar and leg of the mock-up."""
    board = Board(640, 410, 150 + 290j, 3.0)
    axis, pivot, wheel, pinion = 45 + 0j, 105 + 45j, 30.0, 15.0
    psi, crank, coupler, rocker = math.radians(115), 14.0, 45.0, 60.0
    pin = axis + crank * cmath.exp(1j * psi)
    arm = pin - pivot
    reach = abs(arm)
    phi = cmath.phase(arm) + math.atan2(
        math.sqrt(4 * rocker**2 * reach**2 - (reach**2 + rocker**2 - coupler**2) ** 2),
        reach**2 + rocker**2 - coupler**2,
    )
    end = pivot + rocker * cmath.exp(1j * phi)
    elbow = pivot + 45 * cmath.exp(1j * (phi - math.pi / 2))
    vertex = 45 + 30j
    board.circle(axis, wheel, colour="note", dash="3 3")
    board.circle(0j, pinion, colour="note", dash="3 3")
    for line, colour in (((axis, pin), "b"), ((pin, end), "a"), ((end, pivot), "ink"), ((pivot, elbow), "ink")):
        board.line(*line, colour=colour, width=3)
    reach_link = elbow + 60 * (vertex - elbow) / abs(vertex - elbow)
    board.line(elbow, reach_link, colour="c", width=3)
    board.line(reach_link, reach_link + 26j - 20, reach_link - 26 - 4j, fill="c", colour="c", width=1.5)
    board.ground(axis, pivot)
    board.joint(pin, end, elbow, reach_link)
    for at, text in (
        (axis + 9 - 9j, "O"),
        (pin - 7 + 4j, "B"),
        (end + 4 - 9j, "C"),
        (pivot + 9 + 2j, "D"),
        (elbow + 8 + 4j, "A"),
        (reach_link + 2 + 8j, "F"),
    ):
        board.text(at, text)
    board.text(-1 - 20j, "pinion z1", colour="note", size=12)
    board.text(45 - 36j, "wheel z2", colour="note", size=12)
    return board.svg("One leg of the drive: wheel with crank OB, coupler BC, bell crank CDA, intermediate link AF")


def krawczyk() -> str:
    """Draw three boxes and their images."""
    board = Board(660, 240, 110 + 110j, 1.0)
    for k, (image, text) in enumerate(
        (
            ((-38, -28, 30, 34), "inside: exactly one root"),
            ((20, -30, 110, 30), "overlap: nothing proved"),
            ((95, -35, 150, 25), "apart: no root"),
        )
    ):
        shift = complex(k * 205 - 15, 0)
        box = [shift + complex(x, y) for x, y in ((-70, -60), (70, -60), (70, 60), (-70, 60))]
        board.line(*box, box[0], width=1.8)
        x0, y0, x1, y1 = image
        corners = [shift + complex(x, y) * 0.9 for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        board.line(*corners, fill="a", colour="a", width=1.8)
        board.text(shift - 58 + 48j, "X", size=13)
        board.text(sum(corners) / 4, "K(X)", colour="a", size=13)
        board.text(shift - 82j, text, size=13)
    return board.svg("What follows from Krawczyk's image K(X) of a box X")


def rounding_test() -> str:
    """Draw three doubles, a pair between them with its error, and where nothing is decided."""
    board = Board(660, 180, 330 + 75j, 1.0)
    board.line(-300 + 0j, 300 + 0j, width=1.8)
    for x, text in ((-240, "h − ulp"), (0, "h"), (240, "h + ulp")):
        board.line(x - 16j, x + 16j, width=2.2)
        board.text(x - 36j, text, size=15)
    for x in (-120, 120):
        board.line(x - 7j, x + 7j, colour="note", dash="3 3")
    board.line(-28 - 9j, 28 - 9j, 28 + 9j, -28 + 9j, fill="b", colour="b", width=1.2)
    board.text(46j, "|l| ≤ E: not decided", colour="b", size=13)
    board.line(62 - 6j, 98 - 6j, 98 + 6j, 62 + 6j, fill="a", colour="a", width=1.2)
    board.line(80 - 12j, 80 + 12j, colour="a", width=2)
    board.text(130 + 26j, "h + l, and v within E of it", colour="a", size=13)
    board.arrow(0 - 74j, 0 - 50j, colour="c")
    board.arrow(240 - 74j, 240 - 50j, colour="c")
    board.text(120 - 72j, "tightest bounds of v", colour="c", size=13)
    return board.svg("The sign of l tells on which side of h the exact value v lies, unless |l| is at most E")


def body() -> str:
    """Draw the free body of a link: coordinates, offset of a joint, forces."""
    board = Board(560, 280, 110 + 200j, 2.0)
    turn, centre = cmath.exp(0.35j), 70 + 45j
    shape = [centre + turn * point for point in (-55 - 12j, 55 - 18j, 60 + 14j, -50 + 16j)]
    board.line(*shape, fill="a", colour="a", width=2)
    ends = [centre + turn * point for point in (-48 + 2j, 50 - 2j)]
    board.arrow(-35 + 0j, 30 + 0j, colour="note", width=1)
    board.arrow(-30 - 5j, -30 + 55j, colour="note", width=1)
    board.arrow(-30 + 0j, centre, colour="note", width=1.2)
    board.arrow(centre, ends[1], colour="c", width=2)
    board.arrow(ends[1], ends[1] + 38 + 16j, colour="b", width=2.2)
    board.arrow(ends[0], ends[0] - 22 + 26j, colour="b", width=2.2)
    board.arrow(centre, centre - 40j, colour="b", width=2.2)
    board.joint(*ends, centre)
    for at, text, colour in (
        (centre - 20 + 22j, "(x, y, ψ)", "ink"),
        ((centre + ends[1]) / 2 + 5 - 7j, "A(ψ) s", "c"),
        (ends[1] + 42 + 22j, "−λ", "b"),
        (centre + 14 - 36j, "m g", "b"),
        (28 + 7j, "r", "note"),
    ):
        board.text(at, text, colour=colour)
    return board.svg("A body with its centre of mass, a joint at s from it, and the forces on it")


def conventions() -> str:
    """Draw the turned vector of a cross product, and the three signs of interference."""
    board = Board(680, 270, 60 + 190j, 60.0)
    r = 1.6 + 0.8j
    for tip, text, colour in ((r, "r", "a"), (-1j * r, "J(r)", "b")):
        board.arrow(0.9j, 0.9j + tip, colour=colour, width=2.2)
        board.text(0.9j + 1.14 * tip, text, colour=colour)
    board.line(0.9j + 0.12 * r, 0.9j + (0.12 - 0.12j) * r, 0.9j - 0.12j * r, colour="note", width=1.2)
    for k, (gap, text) in enumerate(((0.18, "g < 0: free"), (0.0, "g = 0: touching"), (-0.16, "g > 0: overlap"))):
        centre = complex(4.4 + 2.3 * k, 1.6)
        board.circle(centre, 0.85, width=2)
        board.circle(centre - 0.85 + 0.6 + gap, 0.6, colour="a", width=2)
        board.line(centre - 0.85, centre - 0.85 + gap, colour="b", width=4)
        board.text(centre - 1.35j, text)
    return board.svg("J(r) is r turned clockwise by a right angle; the sign of the interference g of a shaft in a hole")


def small_crank() -> str:
    """Draw the path of the platform over its crank length, for three cranks, beside the circle of the limit."""
    board = Board(620, 400, 200 + 200j, 170.0)
    psi = [2 * math.pi * k / 180 for k in range(181)]
    board.circle(0j, 0.75, colour="note", width=1.2, dash="4 4")
    for crank, colour, y in ((2.0, "c", 0.8), (10.0, "a", 0.6), (20.0, "b", 0.4)):
        pose = SingleMotorPlatform(crank=(crank, crank, crank)).sweep(psi).pose
        board.curve([complex(x, y) / crank for x, y, _ in pose.tolist()], colour=colour, width=2)
        board.line(1.25 + 1j * y, 1.4 + 1j * y, colour=colour, width=3)
        board.text(1.45 + 1j * y, f"crank {crank:g} mm", anchor="start")
    board.line(1.25 + 0.2j, 1.4 + 0.2j, colour="note", dash="4 4")
    board.text(1.45 + 0.2j, "limit: a circle", anchor="start")
    board.arrow(-1.1 + 0j, 1.1 + 0j, colour="note", width=1)
    board.arrow(-1.1j, 1.1j, colour="note", width=1)
    board.text(1.1 - 0.1j, "x / crank", colour="note", size=12)
    board.text(0.22 + 1.08j, "y / crank", colour="note", size=12)
    return board.svg("Path of the platform over the crank length: the shorter the cranks, the rounder")


def inverse_design() -> str:
    """Draw one leg of the drive in both extreme poses: crank and coupler in one line, folded and stretched."""
    board = Board(640, 340, 95 + 255j, 3.9)
    axis, pivot, rocker = 0j, 105 + 8j, 52.0
    ends = [pivot + rocker * cmath.exp(1j * math.radians(angle)) for angle in (112, 158)]
    far, near = sorted(ends, key=abs, reverse=True)
    crank = (abs(far) - abs(near)) / 2
    board.circle(axis, crank, colour="note", dash="4 3")
    board.arc(pivot, rocker, math.radians(158), math.radians(112), colour="note")
    for end, sign, dash in ((far, 1, ""), (near, -1, "6 4")):
        pin = sign * crank * end / abs(end)
        board.line(axis, pin, colour="b", width=3)
        board.line(pin, end, colour="a", width=2.4, dash=dash)
        board.line(end, pivot, width=2.4, dash=dash)
        board.joint(pin, end)
    board.ground(axis, pivot)
    for at, text in (
        (far + 2 + 6j, "C+"),
        (near + 8 + 2j, "C−"),
        (3 - 8j, "O"),
        (pivot + 6 + 4j, "D"),
    ):
        board.text(at, text)
    board.text(34 + 56j, "lB = (d+ − d−) / 2", colour="b", anchor="end")
    board.text(34 + 49j, "lBC = (d+ + d−) / 2", colour="a", anchor="end")
    return board.svg("Both dead centres of a drive: crank and coupler in one line, d = |C - O|")


def extreme_cases() -> str:
    """Draw what degenerates: a leg out of reach, a change point, a double crossing, a fold of two modes."""
    board = Board(700, 220, 30 + 130j, 55.0)
    board.line(0j, 1.2 + 0.5j, 2.4 + 1j, width=3)
    board.ground(0j)
    board.joint(1.2 + 0.5j, 2.4 + 1j)
    board.circle(0j, 0.0, width=0)
    reach = [2.6 * cmath.exp(1j * math.radians(a)) for a in range(-8, 50, 2)]
    board.curve(reach, colour="b", dash="5 4")
    board.text(1.2 - 1.15j, "edge of reach", size=13)
    left, right = 3.5 + 0j, 5.6 + 0j
    board.ground(left, right)
    board.line(left, left + 0.9, width=3)
    board.line(left + 0.9, right + 0.9, colour="a", width=3)
    board.line(right, right + 0.9, width=3)
    turned = 0.9 * cmath.exp(0.8j)
    diagonal = (right - left - turned) / abs(right - left - turned)
    for other, dash, colour in (
        (right + turned, "5 4", "c"),
        (left + turned + (right - left).conjugate() * diagonal**2, "2 3", "b"),
    ):
        board.line(left, left + turned, other, right, colour=colour, width=1.4, dash=dash)
    board.joint(left + 0.9, right + 0.9)
    board.text(5 - 1.15j, "change point", size=13)
    centre = 8.2 + 0.4j
    board.curve(_ring(0.75, 1.05, centre), colour="a", width=2)
    board.circle(centre, 0.75, colour="b", width=2)
    board.text(centre - 1.55j, "tangent curves", size=13)
    start = 9.9 - 0.5j
    board.curve([start + complex(1.5 - s * s * 1.2, 0.95 + 0.95 * s) for s in (k / 20 - 1 for k in range(41))], width=2)
    board.arrow(start - 0.2j, start + 1.9 - 0.2j, colour="note", width=1)
    board.joint(start + 1.5 + 0.95j)
    board.text(start + 0.8 - 0.65j, "fold of two modes", size=13)
    return board.svg("Four ways to degenerate: edge of reach, change point, tangent curves, fold of two assembly modes")


def tabled_positions() -> str:
    """Draw the lambda linkage at the crank angles of the table."""
    linkage = TiltedFourBar()
    board = Board(620, 440, 190 + 300j, 92.0)
    angles = (0, 30, 45, 90, 120, 180, 225, 270, 300)
    table = linkage.positions([math.radians(f) for f in range(0, 361, 3)])
    board.curve([complex(*point[:2]) for point in table.B], colour="b", width=1.4)
    board.circle(0j, 1.0, colour="note", width=1, dash="4 4")
    for f in angles:
        a, b = complex(*table.A[f // 3][:2]), complex(*table.B[f // 3][:2])
        board.line(0j, a, width=1.6)
        board.line(a, b, colour="a", width=1.6)
        board.joint(a, b)
        aside = {30: 0.76 * cmath.exp(-0.2j), 45: 0.8 * cmath.exp(0.26j), 90: 0.84}.get(f, 1.2)
        board.text(aside * a, f"{f}°", colour="note", size=12)
    board.ground(0j, 2 + 0j)
    return board.svg("The lambda linkage at the crank angles of the table: O A, A B and the path of B")


def both_modes_of_legs() -> str:
    """Draw G1 in the tabled pose with both rocker angles of every leg."""
    g1 = ParallelPlatform.g1()
    board = Board(560, 420, 120 + 330j, 112.0)
    corners = [1.2 + 0.9j + cmath.exp(0.15j) * vertex for vertex in g1.b]
    for sign, colour in ((-1, "note"), (1, "ink")):
        angles = g1.inverse([[1.2, 0.9, 0.15]], (sign, sign, sign)).theta[0]
        for k, (pivot, arm, angle, corner) in enumerate(zip(g1.D, g1.l1, angles, corners, strict=True), 1):
            elbow = pivot + arm * cmath.exp(1j * float(angle))
            board.line(pivot, elbow, corner, colour=colour, width=2.4, dash="" if sign > 0 else "6 4")
            board.joint(elbow)
            aside = 0.2 * (elbow - pivot) / arm if k < 3 else 0.1 * sign + 0.15j
            board.text(elbow + aside, f"θ{k}({'+' if sign > 0 else '−'})", colour=colour, size=13)
    board.line(*corners, fill="a", colour="a", width=2)
    board.joint(*corners)
    for pivot in g1.D:
        board.ground(pivot)
    return board.svg("G1 in the pose of section 1: both rocker angles of every leg")


def drawn_link() -> str:
    """Draw a link of three joints with the tolerances of a drawing: a length, a hole in a circle, the datum."""
    board = Board(520, 230, 70 + 170j, 100.0)
    datum, second, hole = 0j, 2.4 + 0j, 3.5 + 1.1j
    board.line(datum, second, hole, datum, colour="ink", fill="note", width=1.2)
    for end in (datum, second):
        board.line(end - 0.12j, end - 0.48j, colour="note", width=0.8)
    board.span(-0.4j, 2.4 - 0.4j, "L", aside=-0.05 + 0.17j)
    board.line(2.28 - 0.52j, 2.52 - 0.52j, colour="b", width=5.0)
    board.text(2.62 - 0.52j, "+b, -c", colour="b", anchor="start")
    board.circle(hole, 0.2, colour="b", width=1.4, dash="4 3")
    board.text(hole - 0.32 + 0.12j, "within a circle t", colour="b", anchor="end", size=13.0)
    board.joint(datum, second, hole)
    board.text(-0.15 + 0.25j, "datum")
    return board.svg("A link with three joints: a length with plus and minus, a hole within a circle, and a datum")


def tabled_antenna() -> str:
    """Draw the reflector's angles over equal crank angles, with the values of the table."""
    board = Board(640, 340, 70 + 290j, 1.0)
    sweep = PointingMechanism().sweep([math.radians(f) for f in range(41)])
    across, up = 12.5, 10.0
    board.arrow(0j, 530 + 0j, colour="note", width=1)
    board.arrow(0j, 275j, colour="note", width=1)
    board.line(0j, complex(40 * across, 0) + 0j, colour="note", width=1)
    for name, values, colour in (("a", sweep.poses.a, "a"), ("b", sweep.poses.b, "b")):
        points = [complex(across * f, up * math.degrees(v)) for f, v in enumerate(values)]
        board.curve(points, colour=colour, width=2)
        for f in (5, 10, 15, 20, 30, 40):
            x, y = board.xy(points[f])
            board.parts.append(f'<circle cx="{x}" cy="{y}" r="4" {painted(colour)}/>')
        board.text(points[40] + 16, name, colour=colour)
    for f in (10, 20, 30, 40):
        board.text(complex(across * f, -14), f"{f}°", colour="note", size=12)
        board.text(complex(-22, up * f * 0.6), f"{f * 0.6:g}°", colour="note", size=12)
    board.text(530 - 14j, "φ", colour="note")
    return board.svg("Angles a and b of the reflector over equal crank angles; dots are values of the table")


def binding() -> str:
    """Draw the law of a joint, and the torque that the lambda linkage costs over a turn."""
    board = Board(700, 300, 50 + 150j, 1.0)
    board.arrow(0j, 200 + 0j, colour="note", width=1)
    board.arrow(0j, 120j, colour="note", width=1)
    board.line(0j, 90 + 0j, 180 + 95j, colour="b", width=2.4)
    for at, text, colour in ((90 - 16j, "t", "ink"), (205 - 16j, "|τ|", "ink"), (-2 + 132j, "moment", "note")):
        board.text(at, text, colour=colour, size=13)
    board.text(45 + 12j, "free", colour="c", size=13)
    board.text(96 + 68j, "k (|τ| − t)", colour="b", size=13)
    motion = gs.Mechanism.four_bar(0.2, 0.1, 0.25, 0.25).simulate([math.radians(f) for f in range(0, 361, 2)])
    report = motion.binding(tilt=0.0135, joints=Bearing(), stiffness=2000.0, friction=0.1)
    left = 260.0
    board.arrow(left + 0j, left + 385 + 0j, colour="note", width=1)
    board.line(left - 100j, left + 110j, colour="note", width=1)
    parts = (("friction", report.friction_torque, "c", 126j), ("elastic part", report.elastic_torque, "a", -104j))
    for name, values, colour, at in parts:
        most = float(abs(values).max())
        board.curve(
            [complex(left + 2 * k, 90.0 * float(v) / most) for k, v in enumerate(values)], colour=colour, width=2
        )
        board.text(left + 150 + at, f"{name}, at most {most:.2g} N m", colour=colour, size=13)
    touching = [k for k, energy in enumerate(report.energy) if energy > 0.0]
    for k in touching:
        board.line(complex(left + 2 * k - 1, -125), complex(left + 2 * k + 1, -125), colour="d", width=5)
    board.text(left + 200 - 125j, "contact", colour="d", size=13)
    board.text(left + 372 - 16j, "360°", colour="note", size=12)
    return board.svg("A joint is free within its limit and a spring beyond it; the torque that this costs over a turn")


def four_poses() -> str:
    """Draw the curves of four poses, their asymptotes, the four bodies and one dyad."""
    poses = [(0.0, 0.0, 0.0), (1.2, 1.1, 0.65), (1.9, 2.3, 1.3), (3.4, 3.3, 1.65)]
    curves = burmester_curves(poses)
    board = Board(620, 470, 210 + 340j, 68.0)

    def inside(z: complex) -> bool:
        return -2.9 < z.real < 5.8 and -1.7 < z.imag < 4.8

    for curve, colour in ((curves.centre, "a"), (curves.circle, "b")):  # the first pose is the frame of both
        for branch in curve.points(500):
            run: list[complex] = []
            for x, y in [*branch.tolist(), (99.0, 99.0)]:
                if inside(z := complex(x, y)):
                    run.append(z)
                elif run:
                    board.curve(run, colour=colour, width=2)
                    run = []
        (x, y), angle = curve.asymptote
        ends = [z for k in range(-400, 401) if inside(z := complex(x, y) + 0.05 * k * cmath.exp(1j * angle))]
        board.line(ends[0], ends[-1], colour=colour, width=1.2, dash="6 4")
    linkage = four_bars_for_poses(poses, pivots=((-2.5, 5.5), (-1.5, 4.5)), count=1)[0]
    for x, y, angle in poses:
        corners = [complex(x, y) + cmath.exp(1j * angle) * z for z in (0j, 0.55 + 0j, 0.4j)]
        board.line(*corners, fill="soft", colour="ink", width=1.2)
    for dyad in linkage.dyads:
        end = complex(*dyad.point)
        board.line(complex(*dyad.pivot), end, width=3)
        board.ground(complex(*dyad.pivot))
        board.joint(end)
    board.text(4.6 - 1.0j, "centre points", colour="a")
    board.text(4.6 - 1.35j, "circle points", colour="b")
    return board.svg("Centre points and circle points of four poses, their asymptotes, and a four-bar on them")


def curve_index() -> str:
    """Draw a wanted curve and the nearest of a small index, the same elsewhere, and the sizes of its coefficients."""
    turns = [math.tau * k / 180 for k in range(180)]
    wanted = [complex(1.6 * math.cos(t), 0.9 * math.sin(t) + 0.5 * math.cos(2 * t)) for t in turns]
    moved = [0.7 * cmath.exp(2.2j) * z.conjugate() for z in wanted[60:] + wanted[:60]]
    board = Board(680, 250, 130 + 125j, 62.0)
    with tempfile.TemporaryDirectory() as folder:
        index = CurveIndex.build(folder, 2000, links=[4], sliders=0)
        for curve, shift in ((wanted, 0j), (moved, 3.4 + 0j)):
            board.curve([shift + z for z in [*curve, curve[0]]], colour="b", width=5)
            for match in index.find([(z.real, z.imag) for z in curve], 3, closed=True):
                x, y = match.mechanism.simulate(match.inputs, events=False).point("P").position.T
                board.curve([shift + complex(*p) for p in zip(x.tolist(), y.tolist())], width=1.2)
            start = shift + curve[0]
            board.joint(start)
    c = coefficients(np.array([[*wanted, wanted[0]]]), np.array([True]), 5)
    for k, size in zip(orders(5).tolist(), np.abs(unit(c))[0].tolist()):
        foot = 6.9 + 0.32 * k - 0.9j
        board.line(foot, foot + 2.0j * size, colour="b", width=9)
        board.text(foot - 0.25j, f"{k}", colour="note", size=12)
    board.text(6.9 + 1.5j, "sizes of coefficients; reflection exchanges k and −k", colour="note", size=12)
    return board.svg("A wanted curve, thick, and the nearest three of 2000: the same wherever it lies")


NINE_POINTS = [
    (2.41, 2.79), (3.14, 2.62), (2.81, 2.25), (2.11, 1.86), (1.64, 1.49), (1.37, 1.2), (1.34, 1.27), (1.34, 1.66),
    (1.46, 2.17),
]  # fmt: skip


def branches(linkage: PathLinkage) -> list[list[complex]]:
    """Sample both branches of the path of a four-bar."""
    O, Q, A, B = linkage.crank_pivot, linkage.rocker_pivot, linkage.crank_pin, linkage.rocker_pin
    arm, shape = abs(B - A), (linkage.point - A) / (B - A)
    found: list[list[complex]] = [[], []]
    for path, side in zip(found, (1, -1)):
        for k in range(721):
            pin = O + (A - O) * cmath.exp(2j * math.pi * k / 720)
            reach = abs(Q - pin)
            cosine = (arm**2 + reach**2 - abs(B - Q) ** 2) / (2 * arm * reach)
            if abs(cosine) <= 1:
                path.append(pin + shape * arm * (Q - pin) / reach * cmath.exp(1j * side * math.acos(cosine)))
    return found


def nine_points() -> str:
    """Draw nine points, the two four-bars that pass them on one branch and in order, and one that does not."""
    found = four_bars_through(NINE_POINTS)
    whole = found.without_defects
    torn = min(
        (one for one in found.linkages if one.turns_fully and not one.one_branch), key=lambda one: max(one.lengths)
    )
    board = Board(620, 430, 130 + 350j, 95.0)
    for linkage, colour, dash in ((torn, "note", "5 5"), (whole[1], "b", ""), (whole[0], "a", "")):
        paths = sorted(branches(linkage), key=lambda path: min(abs(z - complex(*NINE_POINTS[0])) for z in path))
        for branch in paths if dash else paths[:1]:
            board.curve(branch, colour=colour, width=1.4 if dash else 2, dash=dash)
        joints = linkage.crank_pivot, linkage.crank_pin, linkage.rocker_pin, linkage.rocker_pivot
        if not dash:
            board.line(*joints, colour=colour, width=3)
            board.line(joints[1], linkage.point, joints[2], colour=colour, width=1.6)
            for pivot in joints[::3]:
                board.ground(pivot)
            for pin in joints[1:3]:
                board.joint(pin)
    for at in NINE_POINTS:
        x, y = board.xy(complex(*at))
        board.parts.append(f'<circle cx="{x}" cy="{y}" r="4.5" {painted("ink", "paper", 1)}/>')
    return board.svg("Nine points, two four-bars that pass them in order, and the two branches of one that does not")


STEPHENSON = {
    (0, 2): (0, 0), (1, 2): (1, 1.2), (0, 3): (4, 0), (1, 3): (3.6, 2.3), (0, 4): (6.2, 0.4), (4, 5): (5.5, 2.7),
    (1, 5): (2.4, 3.4),
}  # fmt: skip


def six_bar_cognates() -> str:
    """Draw a Stephenson III six-bar, another one with the same curve, and the curve."""
    parts = tuple(gs.Revolute(a, b, place, place) for (a, b), place in STEPHENSON.items())
    graph = gs.MechanismGraph(6, list(STEPHENSON), frame=0)
    P = TracePoint(5, (4.6, 4.4))
    given = gs.Mechanism(graph, parts, (gs.Driver(0, 2),), {"P": P}, ((0.0, 0.0, 0.0),) * 6)
    other = next(one for one in cognates(given) if one.timed and one.turns[4:] == (5, 4) and one.turns[1] != 1)
    board = Board(620, 400, 90 + 330j, 62.0)
    curve: list[complex] = []
    for side in (-1, 1):
        path = given.simulate([0.02 * side * k for k in range(120)], events=False)
        curve = [complex(x, y) for x, y in path.point("P").position[path.assembled]][::-1] + curve[::-1]
    for mechanism, colour in ((given, "a"), (other.mechanism, "b")):
        assert mechanism.pose is not None
        at = {}
        for joint in mechanism.joints:
            x, y, angle = mechanism.pose[joint.a]
            at[joint.pair] = complex(x, y) + cmath.exp(1j * angle) * complex(*joint.at_a)
        for link in range(1, 6):
            corners = [z for pair, z in at.items() if link in pair] + [complex(*P.at)] * (link == 5)
            board.line(*corners, colour=colour, width=3, fill=colour if len(corners) > 2 else "")
        for pair, z in at.items():
            (board.ground if 0 in pair else board.joint)(z)
    board.curve(curve, width=2.5)
    board.joint(complex(*P.at))
    board.text(complex(4.75, 4.65), "P")
    return board.svg("A Stephenson III six-bar and another one whose point P draws the same curve at the same angles")


DRAWINGS = {
    "theory-arcs": jam_arcs,
    "theory-bearing": tilted_bearing,
    "theory-binding": binding,
    "theory-body": body,
    "theory-cognates": six_bar_cognates,
    "theory-conventions": conventions,
    "theory-curve-index": curve_index,
    "theory-assembly-modes": six_modes,
    "theory-cuts": cuts,
    "theory-drawing-tolerances": drawn_link,
    "theory-drive": drive,
    "theory-ellipse": circle_and_ellipse,
    "theory-extreme": extreme_cases,
    "theory-inverse-design": inverse_design,
    "theory-krawczyk": krawczyk,
    "theory-rounding-test": rounding_test,
    "theory-levels": levels,
    "theory-nine-points": nine_points,
    "theory-linkage": lambda_linkage,
    "theory-modes": modes,
    "theory-platform": platform,
    "theory-poses": four_poses,
    "theory-probability": binding_corner,
    "theory-probability-of-joints": half_spaces,
    "theory-shared-tilt": shared_tilt,
    "theory-singular": singular,
    "theory-small-crank": small_crank,
    "theory-values-antenna": tabled_antenna,
    "theory-values-bearings": tabled_positions,
    "theory-values-platform": both_modes_of_legs,
    "theory-whitney": whitney,
    "theory-workspace": workspace,
}


def make(folder: Path) -> None:
    """Write all drawings."""
    for name, draw in DRAWINGS.items():
        (folder / f"{name}.svg").write_text(draw(), encoding="utf-8")


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
