"""Functional schematics of planetary gear trains: seen from the side, as shafts, sleeves, gears and arms on axes.

Every axis is a dash-dotted line.  One link on it is the shaft, the others are sleeves around it, two strokes each, the
symbol of a turning joint (ISO 3952).  A gear is an upright bar with a short rim, and two rims that face each other are
in mesh; a carrier is an upright bar from axis to axis.  Each of them has columns of its own, so lines of two links can
only meet where a bar passes a shaft or a sleeve.  Orders of columns and axes with few such crossings are sought; a bar
that still crosses passes over, with a gap in what lies below.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random
from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch
from graphsynth.structure.gear_speeds import teeth_of

if TYPE_CHECKING:
    from graphsynth.structure.gear_speeds import Teeth
    from graphsynth.structure.gear_trains import PlanetaryGearTrain

#: In widths of a column: from axis to axis, overhang of a shaft and of a sleeve, from stroke to stroke, half a rim.
_RISE, _SHAFT, _SLEEVE, _STROKE, _RIM = 2.0, 0.5, 0.3, 0.14, 0.26
_MESH, _RING = 0.06, 0.8  # half the gap between two rims; how far beyond its axis a pinion meets its ring
_COLUMN = 40.0  # pixels
_STARTS, _MOVES = 5, 150  # of the search for few crossings


@dataclass(frozen=True)
class _Part:
    """A gear pair, a ring with its pinion, an arm or a mere sleeve: links with the axes they start from."""

    kind: str
    ends: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class _Line:
    """A stroke of a link: upright if both x are the same."""

    link: int
    x0: float
    y0: float
    x1: float
    y1: float


_Levels = dict[tuple[int, int], tuple[int, float, float]]
"""For each axis and link: 0 for the shaft, 1 or more for a sleeve, and the columns from which to which it reaches."""


def gear_schematic(
    train: PlanetaryGearTrain,
    *,
    teeth: Teeth | None = None,
    width: float = 480.0,
    numbers: bool = True,
    title: str = "",
) -> Sketch:
    """Build the functional schematic of a train: all links, axes and gear pairs; the frame is hatched.

    `teeth`: as for the speeds; a gear with a negative number is drawn as a ring around the other one. All others are
    external: the graph does not tell. `width`: most pixels. `numbers`: write those of the links. `title`: read out by
    screen readers. Raises `SpecError` for teeth that the speeds refuse, too.
    """
    picture = _Picture(train, *_best(train, _parts(train, teeth)))
    lines = picture.bars + picture.rims + picture.strokes
    lower = complex(min(line.x0 for line in lines) - 0.9, min(min(line.y0, line.y1) for line in lines) - 0.5)
    upper = complex(max(line.x1 for line in lines) + 0.9, max(max(line.y0, line.y1) for line in lines) + 0.5)
    natural = _COLUMN * (upper - lower).real
    size = min(1.0, width / natural)
    sketch = Sketch(lower, upper, size * natural, margin=0.0, title=title, symbol=size)
    for axis, (low, high) in picture.spans.items():
        sketch.on(layer="pitch", part=f"axis {'-'.join(map(str, train.axes[axis]))}")
        ends = (complex(x, picture.heights[axis]) for x in (low - _SHAFT - 0.35, high + _SHAFT + 0.35))
        sketch.trace(list(ends), "soft", 1.2, dash=(8.0, 3.0, 2.0, 3.0))
    for line in picture.strokes:
        _draw(sketch, line, "bar")
    for line in picture.bars:
        for y in picture.crossed(line):
            sketch.on(layer="block", part=f"bridge of link {line.link}")
            gap = 5.0 * sketch.pixel * size * 1j
            sketch.bar(complex(line.x0, y) - gap, complex(line.x0, y) + gap, "paper", 9.0)
        _draw(sketch, line, "joint")
    for line in picture.rims:
        _draw(sketch, line, "joint")
    for stroke, way in picture.grounds:
        sketch.on(layer="ground", part=f"ground of link {stroke.link}")
        sketch.hatch(
            complex(stroke.x0, stroke.y0), complex(stroke.x1, stroke.y0), complex(0, way * sketch.pixel * size), 4
        )
    for line in picture.named() if numbers else ():
        sketch.on(layer="label", part=f"number {line.link}")
        middle = complex(line.x0, (line.y0 + line.y1) / 2)
        sketch.label(middle, str(line.link), 8 * size + 0j, "start", "note", max(7.0, 13.0 * size))
    return sketch


def _draw(sketch: Sketch, line: _Line, layer: str) -> None:
    sketch.on(layer=layer, part=f"link {line.link}")
    sketch.line([complex(line.x0, line.y0), complex(line.x1, line.y1)], width=2.4)


def _parts(train: PlanetaryGearTrain, teeth: Teeth | None) -> list[_Part]:
    """List what takes columns; in a pair with a ring, the ring comes first."""
    own = {link: [k for k, axis in enumerate(train.axes) if link in axis] for link in range(train.links)}
    numbers = {} if teeth is None else teeth_of(train, teeth)
    parts = []
    for a, b, carrier in train.gears:
        starts = [(x, next(k for k in own[x] if carrier in train.axes[k])) for x in (a, b)]
        inside = [bool(z.is_negative) for z in numbers.get((a, b), ())]
        parts.append(_Part("ring" if any(inside) else "mesh", tuple(starts[::-1] if inside[1:] == [True] else starts)))
    parts += [_Part("arm", tuple((link, k) for k in axes)) for link, axes in own.items() if len(axes) > 1]
    used = {end for part in parts for end in part.ends}
    alone = [(link, k) for link, axes in own.items() for k in axes if (link, k) not in used]
    return parts + [_Part("sleeve", (end,)) for end in alone]


def _best(train: PlanetaryGearTrain, parts: list[_Part]) -> tuple[list[_Part], list[int]]:
    """Seek orders of columns and of axes with few crossings and short lines: the same ones every time."""
    random = Random(0)
    order, rows = list(parts), list(range(len(train.axes)))
    found = _Picture(train, order, rows).cost, order, rows
    for start in range(_STARTS):
        if start:
            order, rows = random.sample(parts, len(parts)), random.sample(rows, len(rows))
        cost = _Picture(train, order, rows).cost
        for _ in range(_MOVES if found[0][0] or not start else 0):
            columns, heights = list(order), list(rows)
            if random.random() < 0.8 or len(rows) == 1:
                columns.insert(random.randrange(len(parts)), columns.pop(random.randrange(len(parts))))
            else:
                heights.insert(random.randrange(len(rows)), heights.pop(random.randrange(len(rows))))
            fresh = _Picture(train, columns, heights).cost
            if fresh <= cost:
                cost, order, rows = fresh, columns, heights
        found = min(found, (cost, order, rows), key=lambda entry: entry[0])
    return found[1:]


class _Picture:
    """The lines of a train with its parts from left to right and its axes from below in given orders."""

    def __init__(self, train: PlanetaryGearTrain, order: Sequence[_Part], rows: Sequence[int]) -> None:
        self.train = train
        self.heights = {axis: _RISE * k for k, axis in enumerate(rows)}
        self.places: list[tuple[_Part, float]] = []
        columns: dict[int, dict[int, list[float]]] = {axis: {} for axis in rows}
        x = 0.0
        for part in order:
            self.places.append((part, x))
            for link, axis in part.ends:
                columns[axis].setdefault(link, []).append(x)
                x += part.kind == "ring"
            x += part.kind != "ring"
        self.spans = {axis: (min(map(min, own.values())), max(map(max, own.values()))) for axis, own in columns.items()}
        self.level: dict[tuple[int, int], int] = {}
        self.strokes: list[_Line] = []
        self.grounds: list[tuple[_Line, int]] = []
        for axis, own in columns.items():
            self._lay_axis(axis, own)
        self.bars: list[_Line] = []
        self.rims: list[_Line] = []
        for part, x in self.places:
            self._lay_part(part, x)
        self._ground()

    @property
    def cost(self) -> tuple[int, float]:
        """Crossings first, then the length of all lines."""
        lines = self.bars + self.strokes
        return sum(len(self.crossed(bar)) for bar in self.bars), sum(w.x1 - w.x0 + w.y1 - w.y0 for w in lines)

    def crossed(self, bar: _Line) -> list[float]:
        """Return where a bar crosses other links."""
        return [
            stroke.y0
            for stroke in self.strokes
            if bar.y0 < stroke.y0 < bar.y1 and stroke.x0 < bar.x0 < stroke.x1 and stroke.link != bar.link
        ]

    def named(self) -> list[_Line]:
        """Return one line of each link for its number, a bar if it has one."""
        found: dict[int, _Line] = {}
        for line in (*sorted(self.bars, key=lambda bar: bar.y0 - bar.y1), *self.strokes):
            found.setdefault(line.link, line)
        return list(found.values())

    def _lay_axis(self, axis: int, own: dict[int, list[float]]) -> None:
        """Choose the shaft, and lay sleeves around it, long ones inside; the frame has bearings, one a column."""
        y, frame = self.heights[axis], self.train.frame
        spans = {link: (min(xs), max(xs)) for link, xs in own.items()}

        def merit(link: int) -> tuple[int, bool, float, int]:
            over = sum(low <= x <= high for other, (low, high) in spans.items() if other != link for x in own[link])
            return over, self._arms(link) < 2, spans[link][0] - spans[link][1], link

        shaft = min((link for link in own if link != frame), key=merit)
        self.level[axis, shaft] = 0
        self.strokes.append(_Line(shaft, self.spans[axis][0] - _SHAFT, y, self.spans[axis][1] + _SHAFT, y))
        laid: list[tuple[int, float, float]] = []
        others = sorted((link for link in own if link != shaft), key=lambda k: (k == frame, spans[k][0] - spans[k][1]))
        for link in others:
            pieces = [(x, x) for x in own[link]] if link == frame else [spans[link]]
            inside = [level for level, low, high in laid for a, b in pieces if low <= b and a <= high]
            level = self.level[axis, link] = 1 + max(inside, default=0)
            for low, high in pieces:
                laid.append((level, low, high))
                for side in (-1, 1):
                    at = y + side * _STROKE * level
                    self.strokes.append(_Line(link, low - _SLEEVE, at, high + _SLEEVE, at))

    def _arms(self, link: int) -> int:
        return sum(link in axis for axis in self.train.axes)

    def _from(self, link: int, axis: int, way: int) -> float:
        """Return where a bar of a link starts on an axis, up or down."""
        return self.heights[axis] + way * _STROKE * self.level[axis, link]

    def _lay_part(self, part: _Part, x: float) -> None:
        ends = sorted(part.ends, key=lambda end: self.heights[end[1]])
        if part.kind == "arm":
            for (link, one), (_, other) in pairwise(ends):
                self.bars.append(_Line(link, x, self._from(link, one, 1), x, self._from(link, other, -1)))
        elif part.kind == "mesh":
            (a, one), (b, other) = ends
            middle = self.heights[one] + _RISE / 2  # where no axis is
            for link, y in ((a, middle - _MESH), (b, middle + _MESH)):
                self.rims.append(_Line(link, x - _RIM, y, x + _RIM, y))
            self.bars.append(_Line(a, x, self._from(a, one, 1), x, middle - _MESH))
            self.bars.append(_Line(b, x, middle + _MESH, x, self._from(b, other, -1)))
        elif part.kind == "ring":
            (ring, one), (pinion, other) = part.ends  # the ring in the left column
            way = 1 if self.heights[other] > self.heights[one] else -1
            at = self.heights[other] + way * _RING
            outer, rim = at + way * _MESH, at - way * _MESH
            self.rims.append(_Line(ring, x, outer, x + 1 + _RIM, outer))
            self.rims.append(_Line(pinion, x + 1 - _RIM, rim, x + 1 + _RIM, rim))
            for link, column, start, y in ((ring, x, one, outer), (pinion, x + 1, other, rim)):
                low, high = sorted((self._from(link, start, way), y))
                self.bars.append(_Line(link, column, low, column, high))

    def _ground(self) -> None:
        """Hatch the bearings of the frame, on the side where no bar stands."""
        mine = [line for line in self.strokes if line.link == self.train.frame]
        ends = {(bar.x0, y) for bar in self.bars for y in (bar.y0, bar.y1)}
        for lower, upper in zip(mine[::2], mine[1::2]):
            free = ((lower.x0 + lower.x1) / 2, lower.y0) not in ends
            self.grounds.append((lower, -1) if free else (upper, 1))
