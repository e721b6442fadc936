"""Parts of a mechanism: put together, seen from above, and drawn apart layer by layer."""

from __future__ import annotations

from pathlib import Path as File
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.parts.outline import Rounded
from graphsynth.design.parts.result import Parts
from graphsynth.drawing.export import beside, save
from graphsynth.drawing.methods import Drawing
from graphsynth.drawing.shapes import Path, Placement, Point, Style, placement
from graphsynth.drawing.sketch import Sketch

Outline = NDArray[Any]
Loops = list[Outline]  #: of a sheet, or a label

#: Colours of layers, from below.
_COLOURS = ("fill", "a", "c", "d", "b", "soft")
#: Ends of a part beside which its label may lie, the best first; corners of a label.
_WAYS = tuple(np.exp(1j * np.pi / 4.0 * np.array([0, 1, -1, 4, 3, -3, 2, -2])).tolist())
_CORNERS = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
#: Arcs become chords at most this part of the picture from them.
_FINE = 2e-4
#: The apart view is seen from this height: y and z on the page.
_FORESHORTENED, _SPREAD = 0.42, 0.34


def draw_parts(parts: Parts, path: str | File | None = None, *, width: float = 420.0) -> Drawing:
    """Work of `Parts.draw`: both views beside each other, at the first pose of the motion."""
    sketches = [_together(parts, width), _apart(parts, width)]
    drawing = Drawing(
        beside([sketch.svg() for sketch in sketches], sketches), lambda file: save(file, sketches, [None, None])
    )
    if path is not None:
        drawing.save(path)
    return drawing


def _pose(parts: Parts) -> Placement:
    first = parts.motion.poses[int(np.argmax(parts.motion.assembled))]
    return placement((first * [parts.unit, parts.unit, 1.0]).tolist())


def _order(parts: Parts) -> list[int]:
    return sorted(range(len(parts.layers)), key=lambda link: parts.layers[link])


def colour(layer: int) -> str:
    """Colour of a layer."""
    return _COLOURS[0] if layer == 0 else _COLOURS[1 + (layer - 1) % (len(_COLOURS) - 1)]


def _loops(parts: Parts, link: int, place: Placement) -> list[list[Point]]:
    """Outline counter-clockwise and holes clockwise, in the fixed frame."""
    fine = _FINE * max(abs(b - a) for a, b in (shape.box for shape in parts.plan.outlines))

    def loop(shape: Rounded) -> list[Point]:
        return [place(parts.plan.links[link], z) for z in shape.flat(fine)]

    return [loop(parts.plan.outlines[link]), *(loop(hole)[::-1] for hole in parts.plan.holes[link])]


def _together(parts: Parts, width: float) -> Sketch:
    place = _pose(parts)
    loops = {link: _loops(parts, link, place) for link in _order(parts)}
    sketch = _box([z for own in loops.values() for z in own[0]], width, "Parts put together")
    for link, own in loops.items():
        layer = parts.layers[link]
        style = Style("link", 1.2, colour(layer), fill_opacity=1.0 if layer == 0 else 0.75)
        sketch.shapes.append(
            Path(tuple(map(tuple, own)), style, closed=True, layer="bar", part=f"link-{parts.plan.label(link)}")
        )
    return sketch


def _apart(parts: Parts, width: float) -> Sketch:
    place = _pose(parts)
    flat = {link: _loops(parts, link, place) for link in _order(parts)}
    everything = [z for own in flat.values() for z in own[0]]
    high = max(z.imag for z in everything) - min(z.imag for z in everything)
    wide = max(z.real for z in everything) - min(z.real for z in everything)
    step = _SPREAD * (high * _FORESHORTENED + 0.35 * wide)

    def seen(z: Point, height: float) -> Point:
        return complex(z.real + 0.25 * z.imag, _FORESHORTENED * z.imag + step * height)

    lifted = {link: [[seen(z, parts.layers[link]) for z in loop] for loop in own] for link, own in flat.items()}
    sketch = _box([z for own in lifted.values() for z in own[0]], width, "Parts drawn apart, layer by layer")
    axes: list[Loops] = []
    for layer in range(parts.count + 1):
        for k, pin in enumerate(parts.plan.pins):  # axes behind the sheets of this layer
            low, top = parts.span(k)
            if low < layer <= top:
                at = place(pin.link, pin.at)
                line = (seen(at, layer - 1), seen(at, layer))
                axes.append([line[0] + (line[1] - line[0]) * (_CORNERS.imag > 0) + 2.0 * sketch.pixel * _CORNERS.real])
                sketch.shapes.append(Path((line,), Style("ink", 1.0, dash=(4.0, 3.0)), layer="bar", part=f"pin-{k}"))
        for link, own in lifted.items():
            if parts.layers[link] == layer:
                style = Style("link", 1.2, colour(layer))
                sketch.shapes.append(
                    Path(tuple(map(tuple, own)), style, closed=True, layer="bar", part=f"link-{parts.plan.label(link)}")
                )
    names = [parts.plan.label(link) for link in lifted]
    sheets = [[np.array(loop) for loop in own] for own in lifted.values()]
    for name, at in zip(names, _beside(sheets, names, axes, sketch)):
        sketch.on(layer="label").label(at, name, size=13.0)
    return sketch


def _beside(sheets: list[Loops], names: list[str], axes: list[Loops], sketch: Sketch) -> list[Point]:
    """Where labels are read as those of their sheets: beside an end that no later one hides, else on it; all clear."""
    found: list[Point] = []
    taken, margin = list(axes), sketch.margin * sketch.pixel
    for k, ((own, *_), name) in enumerate(zip(sheets, names)):
        half = complex(4.2 * len(name) + 1.0, 7.0) * sketch.pixel  # of the text
        away = half + (6.0 + 4.0j) * sketch.pixel
        box = (
            1.2 * (half.real * np.linspace(-1.0, 1.0, 9)[:, None] + 1j * half.imag * np.linspace(-1.0, 1.0, 7)).ravel()
        )
        later, tried, costs = sheets[k + 1 :], [], []
        for way in _WAYS:
            end = own[(own * way.conjugate()).real.argmax()]
            tried.append(complex(end + way.real * away.real + 1j * way.imag * away.imag))
            costs.append(_covered(end, later) + _covered(tried[-1] + box, sheets[:k] + later + taken))
        for part in (0.0, 0.5):
            for corner in own[:: len(own) // 12 + 1]:
                tried.append(complex(own.mean() + part * (corner - own.mean())))
                on = _covered(tried[-1] + box, sheets[k : k + 1])
                costs.append(1.3 - on + _covered(tried[-1] + box, later + taken))
        at = np.array(tried)
        out = ((at - half).real < sketch.lower.real - margin) | ((at + half).real > sketch.upper.real + margin)
        found.append(tried[int((costs + 1.0 * out).argmin())])
        taken.append([found[-1] + half.real * _CORNERS.real + 1j * half.imag * _CORNERS.imag])
    return found


def _covered(points: Outline | Point, sheets: list[Loops]) -> float:
    """Shares of points that lie in sheets, added up; a sheet is what an odd number of its loops is around."""
    total, points = 0.0, np.atleast_1d(points)
    for loops in sheets:
        inside = np.zeros(len(points), dtype=bool)
        for loop in loops:
            p, q = loop - points[:, None], np.roll(loop, -1) - points[:, None]
            crosses = (p.imag > 0.0) != (q.imag > 0.0)
            inside ^= (crosses & (((p.conj() * q).imag > 0.0) == (q.imag > p.imag))).sum(axis=1) % 2 == 1
        total += float(inside.mean())
    return total


def _box(points: list[Point], width: float, title: str) -> Sketch:
    x, y = [z.real for z in points], [z.imag for z in points]
    return Sketch(complex(min(x), min(y)), complex(max(x), max(y)), width, title=title)
