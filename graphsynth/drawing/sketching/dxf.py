"""A sketch as DXF, for CAD programs; needs the extra ``dxf`` (ezdxf).

Units are millimetres: one unit of the mechanism is `unit` millimetres.  Bars, plates, blocks, joints, ground and
letters lie on layers of their names; nothing is filled, since CAD wants outlines.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from graphsynth.core.extras import need
from graphsynth.drawing.shapes import LAYERS, Circle, Path, Placement, Point, Shape, Text, placement
from graphsynth.drawing.sketch import Sketch

_ALIGN = {"middle": "MIDDLE_CENTER", "start": "MIDDLE_LEFT", "end": "MIDDLE_RIGHT"}
_CURVE = 12  # straight pieces of a curve


def dxf(sketch: Sketch, pose: Sequence[Sequence[float]] | None = None, *, unit: float = 40.0) -> Any:
    """Return a sketch as an ``ezdxf`` drawing (DXF R2010, millimetres).

    `pose`: where every link is; needed if any shape is fixed to a link. `unit`: millimetres per unit of the mechanism;
    1000 for a mechanism in metres at full size. Raises `MissingExtraError` if ezdxf is not installed.
    """
    ezdxf = need("ezdxf", "dxf", "DXF")
    drawing = ezdxf.new("R2010", setup=True, units=4)
    space, place = drawing.modelspace(), placement(pose)
    for number, layer in enumerate(LAYERS, 1):
        drawing.layers.add(layer.upper(), color=number)
    for shape in sketch.ordered():
        _add(space, shape, sketch, place, unit)
    return drawing


def _add(space: Any, shape: Shape, sketch: Sketch, place: Placement, unit: float) -> None:
    def at(point: Point, offset: Point = 0j) -> tuple[float, float]:
        z = place(shape.link, point) + offset * sketch.pixel
        return z.real * unit, z.imag * unit

    look = {"layer": shape.layer.upper()}
    if isinstance(shape, Circle):
        space.add_circle(at(shape.centre), shape.radius * unit, dxfattribs=look)
    elif isinstance(shape, Path):
        for run in shape.runs:
            points = [at(point) for point in (_curve(run) if shape.curved else run)]
            space.add_lwpolyline(points, close=shape.closed, dxfattribs=look)
    elif isinstance(shape, Text):
        from ezdxf.enums import TextEntityAlignment

        height = 0.7 * shape.size * sketch.pixel * unit
        text = space.add_text(shape.text, height=height, dxfattribs=look)
        text.set_placement(at(shape.at, shape.offset), align=TextEntityAlignment[_ALIGN[shape.anchor]])


def _curve(run: Sequence[Point]) -> list[Point]:
    """Points of a quadratic curve."""
    p, q, r = run
    steps = [k / _CURVE for k in range(_CURVE + 1)]
    return [(1 - t) ** 2 * p + 2 * t * (1 - t) * q + t * t * r for t in steps]


def save_dxf(
    path: str | os.PathLike[str], sketch: Sketch, pose: Sequence[Sequence[float]] | None = None, *, unit: float = 40.0
) -> None:
    """Write a sketch to a DXF file; see :func:`dxf`."""
    dxf(sketch, pose, unit=unit).saveas(os.fspath(path))
