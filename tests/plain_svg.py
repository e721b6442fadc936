"""What every SVG of the program keeps to, so that programs without style sheets show it right; no viewer is needed."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

SVG, XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
PAINT = re.compile(r"none|#[0-9a-f]{6}|url\(#([^)]+)\)")
#: What librsvg, Inkscape, LibreOffice and browsers read alike.
ELEMENTS = """svg title style g defs clipPath pattern use image path circle rect line text tspan animate
animateTransform"""
ATTRIBUTES = """xmlns version class id role aria-hidden aria-label viewBox width height x y cx cy r rx ry x1 x2 y1 y2 d
transform href clip-path display opacity fill fill-opacity fill-rule stroke stroke-opacity stroke-width stroke-dasharray
stroke-dashoffset stroke-linecap stroke-linejoin stroke-miterlimit font-family font-size font-style font-weight
text-anchor patternUnits patternTransform clipPathUnits preserveAspectRatio image-rendering attributeName type dur
repeatCount calcMode values data-part data-layer data-link data-joint"""
SHAPES = {"path", "circle", "rect", "line", "text"}


def faults(svg: str) -> list[str]:
    """What is not as it should be in an SVG text."""
    root = ET.fromstring(svg)
    ids = [part.get("id") for part in root.iter() if part.get("id")]
    found = (
        [f"ids twice: {sorted(name for name in set(ids) if ids.count(name) > 1)}"] if len(set(ids)) < len(ids) else []
    )
    if not root.get("font-family") and root.find(f".//{SVG}text") is not None:
        found.append("no typeface")
    _walk(root, {}, set(ids), found)
    clocks = {(part.get("dur"), part.get("repeatCount")) for part in root.iter() if "animate" in part.tag}
    if len(clocks) > 1:
        found.append(f"several clocks: {clocks}")
    return sorted(set(found))


def _walk(part: ET.Element, above: dict[str, str], ids: set[str], found: list[str]) -> None:
    tag = part.tag.removeprefix(SVG)
    own = {name.removeprefix(XLINK): value for name, value in part.attrib.items()}
    if tag not in ELEMENTS.split():
        found.append(f"element {tag}")
    found += [f"attribute {name}" for name in own if name not in ATTRIBUTES.split()]
    for name in ("fill", "stroke", "clip-path"):
        match = PAINT.fullmatch(own.get(name, "none"))
        if not match:
            found.append(f'{tag} {name}="{own[name]}"')
        elif match[1] and match[1] not in ids:
            found.append(f"{tag} {name} leads nowhere")
    if own.get("href", "#").startswith("#") and own.get("href", "#")[1:] not in {*ids, ""}:
        found.append(f"{tag} href leads nowhere")
    if own.get("class") == "rest" and own.get("display") != "none":
        found.append("the resting picture lies over the moving one")
    seen = {**above, **{name: own[name] for name in ("fill", "font-size") if name in own}}
    if tag in SHAPES and "fill" not in seen:
        found.append(f"{tag} without a fill")
    if tag == "text" and "font-size" not in seen and not all("font-size" in child.attrib for child in part):
        found.append("text without a size")
    if tag == "style":
        rest = re.sub(r"@media \([^)]*\)\{(?:[^{}]*\{[^{}]*\})*\}", "", part.text or "")
        if rest.strip() or re.search(r"var\(|@keyframes|currentColor|color-mix", part.text or ""):
            found.append(f"style sheet: {rest[:60] or 'var()'}")
    for child in part:
        _walk(child, seen, ids, found)


def pictures_of(page: str) -> list[str]:
    """All outermost SVG texts of an HTML page."""
    found, depth, start = [], 0, 0
    for tag in re.finditer(r"<svg\b|</svg>", page):
        if tag[0] == "<svg":
            start, depth = (tag.start() if depth == 0 else start), depth + 1
        else:
            depth -= 1
            if depth == 0:
                found.append(page[start : tag.end()])
    return found
