"""Strategy for scene files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from graphsynth.testing.extra import st

#: Titles hold any printable character, quotes and backslashes included.
_PRINTABLE = st.characters(exclude_categories=("C", "Z"), include_characters=" ")


def toml_text(tables: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """Write nested tables of strings, numbers, booleans and lists as TOML; ``path`` is the name of the whole."""
    plain = {key: value for key, value in tables.items() if not isinstance(value, Mapping)}
    found = ""
    if path and (plain or not tables):
        lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in plain.items()]
        found = "".join([f"[{'.'.join(path)}]\n", *lines, "\n"])
    return found + "".join(toml_text(value, (*path, key)) for key, value in tables.items() if key not in plain)


def _lambda_linkage(draw: st.DrawFn) -> dict[str, Any]:
    """Linkage, tilt and bearing, whether or not it can be assembled."""
    number = st.integers(1, 40).map(lambda k: k / 8.0)
    bearing = {"radius_mm": draw(st.floats(1.0, 40.0)), "height_mm": draw(st.floats(0.5, 40.0))}
    bearing["clearance_mm"] = draw(st.sampled_from((0, 0.03)) | st.floats(1e-9, 1.0))
    alpha = draw(st.sampled_from((0, 1e-8, 1.5)) | st.floats(1e-9, 1.5) | st.floats(-1.5, -1e-9))
    return {
        "module": "lambda_linkage",
        "positions": draw(st.integers(8, 400)),
        "lengths": {name: draw(number) for name in ("frame", "crank", "coupler", "rocker")},
        "tilt": {"alpha_rad": alpha, "axis": draw(st.sampled_from(([1, 0, 0], [0, 1, 0], [2, -1, 2], [0, 0, 1])))},
        "bearing": {**bearing, "condition": draw(st.sampled_from("AB"))},
    }


def _tribometer(draw: st.DrawFn) -> dict[str, Any]:
    """Platform, friction of both kinds, every drive."""
    kinetic = draw(st.integers(0, 40)) / 100
    friction = {"static": kinetic + draw(st.integers(1, 40)) / 100, "kinetic": kinetic}
    if draw(st.booleans()):
        friction["stribeck_m_s"] = draw(st.floats(0.001, 0.1))
    radius, speed = draw(st.integers(1, 50)), draw(st.integers(-50, 50).filter(bool)) / 10
    crank = {"kind": "crank", "radius_mm": radius, "rod_mm": radius * 2, "speed_rad_s": speed}
    harmonic = {"kind": "harmonic", "radius_mm": radius, "speed_rad_s": speed}
    drive = draw(st.sampled_from((crank, harmonic, {"kind": "belt", "belt_m_s": speed})))
    platform = {"mass_kg": draw(st.floats(0.1, 10.0)), "stiffness_N_per_m": draw(st.floats(1.0, 1e5))}
    run = {"duration_s": draw(st.integers(1, 20)), "samples": draw(st.integers(20, 500))}
    return {"module": "tribometer", "platform": platform, "friction": friction, "drive": drive, "run": run}


@st.composite
def _scenes(draw: st.DrawFn) -> str:
    name = draw(st.text("abcXYZ019_-", max_size=12).map(lambda text: f"a{text}"))
    title = draw(st.text(_PRINTABLE, min_size=1, max_size=20))
    tables: dict[str, Any] = {"scene": {"name": name, "title": title, "seed": draw(st.integers(0, 2**31))}}
    products = st.lists(st.sampled_from(("records", "tables")), min_size=1, unique=True)
    if draw(st.booleans()):
        limit = {"limit": draw(st.integers(1, 1000)), "planar": draw(st.booleans())}
        tables["structure"] = {"question": {"W": 1, "links": 4, "p2": 0}, "generate": limit}
        tables["mechanism"] = _lambda_linkage(draw)
    else:
        tables["mechanism"] = _tribometer(draw)
    tables["outputs"] = {"products": draw(products)}
    return toml_text(tables)


def scenes() -> st.SearchStrategy[str]:
    """Scene files as TOML text, valid by the documented schema: lambda linkages and tribometers.

    Give the text to a file, or ``graphsynth.pipeline.scene.Scene.from_mapping(tomllib.loads(text), "scene.toml")``.

    Returns
    -------
    hypothesis strategy
        Of str.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(scenes(), lambda text: "lambda_linkage" in text).startswith("[scene]")
    True
    """
    return _scenes()
