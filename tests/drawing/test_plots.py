"""Plots: themed, deterministic, with ids of their own."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import Band, Line, line_plot


def plot(scale: float = 1.0) -> str:
    x = [0.0, 1.0, 2.0]
    return line_plot(
        [Line(x, [scale * v for v in (0.0, 1.0, float("nan"))], "curve <1>")],
        "x [mm]",
        "y",
        bands=[Band(0.5, 1.0, "jams")],
        levels=[Line((), 0.5, "limit", "soft", "--")],
    )


def test_same_plot_same_bytes() -> None:
    assert plot() == plot()


def test_colours_follow_the_page_and_text_stays_text() -> None:
    svg = plot()
    ET.fromstring(svg)
    used = set(re.findall(r' (?:fill|stroke)="(#\w+)"', svg))
    assert used == {LIGHT[name] for name in ("a", "ink", "jam", "soft")}  # each with its rule for dark pages
    assert all(f'[stroke="{colour}"]{{stroke:' in svg for colour in used)
    texts = {"".join(t.itertext()) for t in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")}
    assert {"x [mm]", "y", "curve <1>", "jams", "limit"} <= texts


def test_two_plots_on_one_page_do_not_share_ids_and_find_their_own() -> None:
    first, second = plot(1.0), plot(2.0)
    ids = [set(re.findall(r' id="([^"]+)"', svg)) for svg in (first, second)]
    assert ids[0] and not ids[0] & ids[1]
    for svg, own in zip((first, second), ids):
        used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', svg))
        assert used <= own
