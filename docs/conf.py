"""Sphinx configuration: ``sphinx-build -W -b html docs build/site``."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import pages
import public_api
from docutils import nodes
from mathml import mathml

ROOT = Path(__file__).resolve().parents[1]
META = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]

project = META["name"]
author = "The graphsynth developers"
project_copyright = author
version = release = META["version"]

extensions = ["myst_parser"]
myst_enable_extensions = ["deflist", "dollarmath"]
html_math_renderer = "mathml"
myst_heading_anchors = 4
exclude_patterns = ["pictures/*.py"]
html_theme = "furo"
html_title = f"graphsynth {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]


def _toctrees(text: str) -> str:
    """Add a hidden toctree of the linked pages under every section of the index, which stays the only list."""
    sections = re.split(r"(?m)^(?=## )", text)
    for k, section in enumerate(sections[1:], 1):
        pages = list(dict.fromkeys(re.findall(r"\]\(([\w./-]+)\.md\)", section)))
        title = section.partition("\n")[0].removeprefix("## ")
        sections[k] = section + "\n```{toctree}\n:hidden:\n:caption: " + title + "\n\n" + "\n".join(pages) + "\n```\n\n"
    return "".join(sections)


def _plain_links(text: str, page: str) -> str:
    """Name files outside of the documentation instead of linking them; the site does not hold them."""
    docs = Path(__file__).resolve().parent

    def name(match: re.Match[str]) -> str:
        target = (docs / page).parent.joinpath(match[2]).resolve()
        return match[0] if target.is_relative_to(docs) else f"{match[1]} (`{target.relative_to(ROOT).as_posix()}`)"

    return re.sub(r"\[([^\]]*)\]\((\.\.[^)#\s]*)\)", name, text)


def _read(app: object, page: str, source: list[str]) -> None:
    text = _plain_links(pages.with_benches(source[0]), page)
    source[0] = pages.with_links_to_references(pages.with_scene_keys(text), page)
    if page == "index":
        source[0] = _toctrees(source[0])
    elif page == "reference/api":
        source[0] = source[0].replace("<!-- docstrings -->", public_api.reference())


def _note_objects(app: Any, doctree: nodes.document) -> None:
    """Enter every public name in the inventory of the site (``objects.inv``), so that other sites can link to it."""
    if app.env.current_document.docname != "reference/api":
        return
    anchors = {}
    for room in doctree.findall(nodes.section):
        for entry in room.children:
            if isinstance(entry, nodes.section):
                anchors[room[0].astext(), entry[0].astext()] = entry["ids"][0]
    for room_name, name, dotted, kind in public_api.places():
        for full in dotted:
            app.env.domains.python_domain.note_object(full, kind, anchors[room_name, name])


def _formula(writer: Any, node: Any) -> None:
    block = node.tagname == "math_block"
    markup = mathml(node.astext(), block)
    writer.body.append(f'<div class="math">{markup}</div>' if block else markup)
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _read)
    app.connect("doctree-read", _note_objects)
    app.add_html_math_renderer("mathml", (_formula, None), (_formula, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
