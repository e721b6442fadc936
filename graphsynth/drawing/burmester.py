"""The curves of four poses: where the joints of a link from the frame may lie, at the frame and at the body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.drawing.plots import Chart, Line

if TYPE_CHECKING:
    from graphsynth.design.poses.curves import BurmesterCurves

#: Half the side of the picture, over the size of the task.
_REACH = 1.5


def burmester_chart(curves: BurmesterCurves, *, unit: str = "length") -> Chart:
    """Centre-point and circle-point curve with their asymptotes, the latter in the first pose, and the four places.

    `unit`: unit of length written at the axes.
    """
    poses = curves.poses
    middle, half = poses[:, :2].mean(axis=0), _REACH * np.ptp(poses[:, :2], axis=0).max() + 1e-300
    turn = np.exp(1j * poses[0, 2])

    def line(points: NDArray[np.float64], body: bool, label: str, colour: str, style: str = "-") -> Line:
        z = points @ np.array([1.0, 1j])
        z = poses[0, 0] + 1j * poses[0, 1] + turn * z if body else z
        found = np.column_stack([z.real, z.imag])
        found[(np.abs(found - middle) > half).any(axis=1)] = np.nan
        return Line(found[:, 0], found[:, 1], label, colour, style)

    lines = []
    for curve, colour in ((curves.centre, "a"), (curves.circle, "b")):
        body = curve.kind == "circle"
        for k, branch in enumerate(curve.points(1200)):
            lines.append(line(branch, body, "" if k else f"{curve.kind} points", colour))
        (x, y), angle = curve.asymptote
        along = np.linspace(-4.0, 4.0, 801)[:, None] * half * np.array([np.cos(angle), np.sin(angle)])
        lines.append(line(along + np.array([x, y]), body, "" if body else "asymptote", colour, ":"))
    lines.append(Line(poses[:, 0], poses[:, 1], "", "ink", "--"))
    return Chart(lines, f"x [{unit}]", f"y [{unit}]", equal=True, size=(5.4, 4.2))
