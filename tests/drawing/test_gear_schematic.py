"""A schematic of a gear train says what the train is: links, axes and gear pairs are read back from its lines."""

from __future__ import annotations

import random
from itertools import combinations

import networkx as nx
import pytest

import graphsynth.drawing.gear_schematic as gear_schematic_module
from graphsynth import PlanetaryGearTrain, enumerate_planetary_gear_trains
from graphsynth.core.errors import SpecError
from graphsynth.drawing.gear_schematic import gear_schematic
from graphsynth.drawing.shapes import Path

RISE, STROKE, MESH, CLEAR = 2.0, 0.14, 0.12, 0.1
RAVIGNEAUX = PlanetaryGearTrain.from_axes(6, [(0, 1, 2, 3), (3, 4), (3, 5)], [(0, 4), (4, 5), (1, 5), (2, 5)])


def lines_of(sketch):
    """Return (link, x0, x1, y0, y1) of each line, and the places where a bar passes over."""
    lines, bridges = [], []
    for shape in sketch.shapes:
        if isinstance(shape, Path) and shape.part.startswith(("link", "bridge")):
            (p, q), link = shape.runs[0], int(shape.part.split()[-1])
            xs, ys = sorted((p.real, q.real)), sorted((p.imag, q.imag))
            if shape.part.startswith("link"):
                lines.append((link, *xs, *ys))
            else:
                assert shape.style.stroke == "paper"
                bridges.append((link, xs[0], sum(ys) / 2))
    return lines, bridges


def gap(p, q):
    """Distance of two lines, each upright or level."""
    dx = max(p[1] - q[2], q[1] - p[2], 0.0)
    dy = max(p[3] - q[4], q[3] - p[4], 0.0)
    return (dx * dx + dy * dy) ** 0.5


def read(train, sketch):
    """Return the axes and gear pairs that lines show; every other meeting of links is an error."""
    lines, bridges = lines_of(sketch)
    body = nx.Graph()
    body.add_nodes_from(range(len(lines)))
    axes, pairs = {}, set()
    for link, x0, x1, y0, _ in lines:
        height = RISE * round(y0 / RISE)
        if x1 > x0 and abs(y0 - height) < 0.75:  # a shaft or a sleeve
            axes.setdefault(height, set()).add(link)
    for (i, p), (j, q) in combinations(enumerate(lines), 2):
        level = p[4] == p[3], q[4] == q[3]
        if p[0] == q[0]:
            around = all(level) and p[1:3] == q[1:3] and abs((p[3] + q[3]) / 2 / RISE % 1) < 1e-9  # of one sleeve
            if gap(p, q) < 1e-9 or around:
                body.add_edge(i, j)
            continue
        bar, stroke = (q, p) if level[0] else (p, q)
        if all(level) and abs(gap(p, q) - MESH) < 1e-9:
            pairs.add((min(p[0], q[0]), max(p[0], q[0])))
        elif gap(p, q) < MESH - 1e-9:
            assert level[0] != level[1], f"links {p[0]} and {q[0]} meet: {p}, {q}"
            assert min(bar[1] - stroke[1], stroke[2] - bar[1], stroke[3] - bar[3], bar[4] - stroke[3]) > CLEAR
            assert any(own == bar[0] and x == bar[1] and abs(y - stroke[3]) < 1e-9 for own, x, y in bridges)
    for link in range(train.links):
        own = body.subgraph(k for k, line in enumerate(lines) if line[0] == link)
        if link == train.frame:  # one body through the ground: every piece stands on it
            hatched = [s.runs[0] for s in sketch.shapes if s.layer == "ground"]
            for piece in nx.connected_components(own):
                assert any(p.real == lines[k][1] and p.imag == lines[k][3] for k in piece for p, _ in hatched)
        else:
            assert nx.is_connected(own), f"link {link} is in pieces"
    return sorted(tuple(sorted(axis)) for axis in axes.values()), sorted(pairs)


def trains(links, step):
    for k, train in enumerate(enumerate_planetary_gear_trains(links)):
        if k % step == 0:
            yield PlanetaryGearTrain(train.coloured.with_frame(k // step % links)) if k // step % 2 else train


def checked(train, teeth=None):
    axes, pairs = read(train, gear_schematic(train, teeth=teeth))
    assert axes == sorted(train.axes)
    assert pairs == sorted(pair[:2] for pair in train.gears)


@pytest.mark.parametrize(
    ("links", "step"),
    [(3, 1), (4, 1), pytest.param(5, 1, marks=pytest.mark.long), pytest.param(6, 1, marks=pytest.mark.long),
     pytest.param(7, 1, marks=pytest.mark.slow), pytest.param(9, 2500, marks=pytest.mark.slow)],
)  # fmt: skip
def test_trains_are_read_back(links, step):
    rng = random.Random(links)
    for train in trains(links, step):
        checked(train)
        if rng.random() < 0.3:
            teeth = {pair[:2]: rng.choice([(20, 20), (-60, 20), (20, -60)]) for pair in train.gears}
            checked(train, teeth)


@pytest.mark.long
def test_no_bar_crosses_what_it_need_not():
    for train in (*trains(4, 1), *trains(7, 200), RAVIGNEAUX):
        assert lines_of(gear_schematic(train))[1] == []


@pytest.mark.long
def test_a_bar_that_must_cross_passes_over(monkeypatch):
    """With any order of columns and axes, here a bad one, nothing meets that should not."""
    monkeypatch.setattr(gear_schematic_module, "_MOVES", 0)
    crossed = 0
    for train in (*trains(5, 1), *trains(6, 4), *trains(8, 700), RAVIGNEAUX):
        checked(train)
        crossed += len(lines_of(gear_schematic(train))[1])
    assert crossed > 20


def test_links_without_gears_are_drawn():
    for train in (
        PlanetaryGearTrain.from_axes(2, [(0, 1)], [], frame=0),
        PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [], frame=2),
        PlanetaryGearTrain.from_axes(5, [(0, 1, 4), (1, 2), (2, 3)], [(0, 2)]),
    ):
        checked(train)


def test_a_ring_lies_around_its_pinion():
    teeth = {(0, 4): (28, 18), (4, 5): (18, 30), (1, 5): (36, 30), (5, 2): (30, -72)}
    lines, _ = lines_of(gear_schematic(RAVIGNEAUX, teeth=teeth))
    (ring,) = [line for line in lines if line[0] == 2 and line[3] == line[4] and abs(line[3] / RISE % 1 - 0.43) < 0.01]
    assert ring[2] - ring[1] > 1
    checked(RAVIGNEAUX, teeth)


def test_the_train_shows_itself_and_its_numbers(tmp_path):
    drawing = RAVIGNEAUX.draw(tmp_path / "train.svg", title="Ravigneaux")
    assert (tmp_path / "train.svg").read_text() == drawing.svg == RAVIGNEAUX.draw(title="Ravigneaux").svg
    for link in range(6):
        assert f'data-part="number {link}"' in drawing.svg
    assert "number" not in RAVIGNEAUX.draw(numbers=False).svg
    assert RAVIGNEAUX._repr_svg_().startswith("<svg")
    with pytest.raises(SpecError, match="are missing"):
        RAVIGNEAUX.draw(teeth={(0, 4): (28, 18)})
