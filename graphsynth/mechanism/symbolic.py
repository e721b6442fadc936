"""Equations of a mechanism as formulas of sympy: closure equations, and the curve of a coupler point."""

from __future__ import annotations

import math
from dataclasses import fields
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from graphsynth.core.checks import point
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.equations import Plane, seen
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    import sympy

    from graphsynth.mechanism.model import Mechanism


class CouplerCurve(NamedTuple):
    """The algebraic curve on which a coupler point lies.

    ``equation`` is a polynomial in the symbols x and y with integer coefficients, zero on the curve; ``degree`` its
    degree; ``circularity`` how often the curve passes through each of the two circular points at infinity.
    """

    equation: sympy.Poly
    degree: int
    circularity: int


def closure_equations(mechanism: Mechanism) -> list[sympy.Expr]:
    """Return the equations of all joints as expressions that vanish, for export to other programs.

    They are in the symbols ``x_k``, ``y_k``, ``theta_k`` of the moving links k; two for a joint of mobility 1, one for
    a pin in a slot, a gear pair (up to whole turns of its line of centres) or a cam, in the order of
    ``mechanism.joints``.  Numbers are those given, as fractions (exact).

    >>> from graphsynth import Mechanism
    >>> Mechanism.four_bar(2, 1, 2.5, 2.5).closure_equations()[:2]
    [x_1, y_1]
    """
    import sympy

    plane = Plane(sympy.sin, sympy.cos, lambda x, y: sympy.sqrt(x**2 + y**2), sympy.atan2)
    poses = [
        (sympy.Integer(0),) * 3 if k == mechanism.frame else sympy.symbols(f"x_{k} y_{k} theta_{k}", real=True)
        for k in range(mechanism.graph.links)
    ]
    found: list[sympy.Expr] = []
    for joint in map(_exact, mechanism.joints):
        found += joint.values(seen(plane, joint, poses[joint.a], poses[joint.b]))
    return found


def _number(value: float) -> Any:
    import sympy

    return sympy.Rational(Fraction(value))


def _exact(joint: JointGeometry) -> JointGeometry:
    """Return a joint with the numbers given as fractions: without the checks, which make floats of them."""

    def exact(value: Any) -> Any:
        return tuple(map(exact, value)) if isinstance(value, tuple) else _number(value)

    made: JointGeometry = object.__new__(type(joint))
    for item in fields(joint):
        value = getattr(joint, item.name)
        object.__setattr__(made, item.name, value if isinstance(value, int) else exact(value))
    return made


def coupler_curve(mechanism: Mechanism, name_or_link: str | int, at: tuple[float, float] | None = None) -> CouplerCurve:
    """Return the equation of the curve of a named point, or of a point (x, y) of a link in its frame (exact).

    Two points of the link must be held, each on a circle (by a link that turns about the frame) or on a straight line
    (by a slider on the frame, or a slot in it): four-bar, slider-crank, elliptic trammel; `GeometryError` for another
    mechanism.  The curve is the whole one, of both assembly modes; numbers are taken as the fractions they are.

    With ``A = P - R(theta) a`` each condition is linear in ``cos theta`` and ``sin theta``; Cramer's rule and
    ``cos^2 + sin^2 = 1`` eliminate the angle.  For a four-bar it is Roberts' tricircular sextic: S. Roberts, On
    three-bar motion in plane space, Proc. London Math. Soc. 7 (1875) 14-23.

    >>> from graphsynth import Mechanism
    >>> curve = Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0)).coupler_curve("P")
    >>> curve.degree, curve.circularity
    (6, 3)
    """
    import sympy

    if isinstance(name_or_link, str):
        if name_or_link not in mechanism.points:
            raise GeometryError(f"point {name_or_link!r} is not defined; the mechanism has {list(mechanism.points)}")
        link, local = mechanism.points[name_or_link]
    else:
        link, local = name_or_link, point("at", (0.0, 0.0) if at is None else at)
    own_joints = [joint for joint in mechanism.joints if link in (joint.a, joint.b)]
    if len(own_joints) != 2 or mechanism.frame == link:
        raise GeometryError(f"link {link} is not held by two joints; give the coupler of a four-bar or slider-crank")
    held = [_held(mechanism, joint, link) for joint in own_joints]
    x, y = sympy.symbols("x y", real=True)
    px, py = map(_number, local)
    rows = []
    for (own, kind), numbers in held:
        a, b = px - _number(own[0]), py - _number(own[1])  # from the held point to P, in the link
        if kind == "circle":
            u, v, r = x - numbers[0], y - numbers[1], numbers[2]
            rows.append((2 * (u * a + v * b), 2 * (v * a - u * b), u * u + v * v + a * a + b * b - r * r))
        else:
            nx, ny, d = numbers
            rows.append((nx * a + ny * b, ny * a - nx * b, nx * x + ny * y - d))
    (a1, b1, c1), (a2, b2, c2) = rows
    determinant = a1 * b2 - a2 * b1
    equation = sympy.Poly((c1 * b2 - c2 * b1) ** 2 + (a1 * c2 - a2 * c1) ** 2 - determinant**2, x, y)
    if equation.is_zero:
        raise GeometryError("every point of the plane fulfils the conditions: the coupler moves by itself")
    equation = equation.clear_denoms()[1].primitive()[1]
    z, w = sympy.symbols("z w")
    isotropic = sympy.Poly(equation.as_expr().subs({x: (z + w) / 2, y: (z - w) / (2 * sympy.I)}), z, w)
    degree = equation.total_degree()
    return CouplerCurve(equation, degree, degree - isotropic.degree(z))


def _held(
    mechanism: Mechanism, joint: JointGeometry, link: int
) -> tuple[tuple[tuple[float, float], str], tuple[Any, ...]]:
    """Point of a link that a joint holds, on what, and its numbers: centre and radius, or normal and distance."""
    frame = mechanism.frame
    own, at, other = (joint.at_a, joint.at_b, joint.b) if joint.a == link else (joint.at_b, joint.at_a, joint.a)
    if isinstance(joint, PinSlot) and joint.a == frame:
        return (own, "line"), _line(joint.at_a, joint.angle_a)
    if isinstance(joint, Revolute):
        for second in mechanism.joints:
            if second.pair != (min(frame, other), max(frame, other)) or other == frame:
                continue
            on_frame, on_other = (second.at_a, second.at_b) if second.a == frame else (second.at_b, second.at_a)
            if isinstance(second, Revolute):
                radius2 = sum((_number(p) - _number(q)) ** 2 for p, q in zip(at, on_other))
                return (own, "circle"), (*map(_number, on_frame), radius2 ** _number(0.5))
            if isinstance(second, Prismatic):
                # through the guide's line, shifted by the place of the point across the slide
                turns = (second.angle_a, second.angle_b) if second.a == frame else (second.angle_b, second.angle_a)
                (nx, ny, d), (mx, my, _) = _line(on_frame, turns[0]), _line((0.0, 0.0), turns[1])
                dx, dy = (_number(p) - _number(q) for p, q in zip(at, on_other))
                return (own, "line"), (nx, ny, d + mx * dx + my * dy)
    raise GeometryError(f"joint {joint.a}-{joint.b} holds no point of link {link} on a circle or a line of the frame")


def _line(at: tuple[float, float], angle: float) -> tuple[Any, Any, Any]:
    """Return normal and distance of a line; directions along the axes are exact."""

    def plain(value: float) -> Any:
        return _number(round(value) if abs(value - round(value)) < 1e-15 else value)

    nx, ny = plain(-math.sin(angle)), plain(math.cos(angle))
    return nx, ny, nx * _number(at[0]) + ny * _number(at[1])
