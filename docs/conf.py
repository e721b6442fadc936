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
from sphinx import addnodes
from sphinx.domains.python import PyObject
from sphinx.ext.napoleon.docstring import NumpyDocstring

ROOT = Path(__file__).resolve().parents[1]
META = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]

project = META["name"]
author = "The graphsynth developers"
project_copyright = author
version = release = META["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
highlight_language = "none"  # of blocks that name no language: text, not Python
INHERITED = "BaseException,Enum,Exception,ImportError,int,object,str,tuple"  # what is theirs is not shown
autodoc_default_options = {"members": True, "inherited-members": INHERITED}
autodoc_member_order = "bysource"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "NDArray")}
autodoc_typehints_format = "short"
default_role = "literal"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_maximum_signature_line_length = 88
suppress_warnings = ["ref.python"]  # "x" names the attribute of several classes
toc_object_entries_show_parents = "hide"
myst_enable_extensions = ["deflist", "dollarmath"]
html_math_renderer = "mathml"
myst_heading_anchors = 4
exclude_patterns = ["pictures/*.py"]
html_theme = "furo"
html_title = f"graphsynth {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
CONSUME: Any = NumpyDocstring._consume_fields


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
        source[0] = source[0].replace("<!-- names -->", public_api.index())
    elif page.startswith("reference/"):
        source[0] = public_api.with_docstrings(source[0], page)


def _docstring(app: object, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Lead citations of the theory and of the bibliography to their pages; |x| is an absolute value."""
    literal_or_bars = re.compile(r"``.*?``|\|(\w+)\|", re.DOTALL)
    text = re.sub(r"(``)?\bdocs/([\w/-]+)\.md(?(1)``)", r":doc:`/\2`", "\n".join(lines))
    text = literal_or_bars.sub(lambda m: rf"\|{m[1]}\|" if m[1] else m[0], text)
    text = re.sub(r"(?<![`\w/])theory/([\w-]+)((?:,? (?:and |to )?\d+\b)*)", r":doc:`theory/\1\2 </theory/\1>`", text)
    for label, entry in pages.bibliography().items():
        text = text.replace(f"[{label}]", f":ref:`[{label}] <{entry['key'].lower()}>`")
    lines[:] = text.split("\n")


def _without_chance_links(app: object, doctree: nodes.document) -> None:
    """Unlink words of numpydoc's types: "ndarray, shape (n,)" does not mean the attribute ``n`` of some class."""
    for node in list(doctree.findall(addnodes.pending_xref)):
        if node.get("refdomain") == "py" and not re.search(r"[A-Z.]", node["reftarget"]):
            node.replace_self(node.children)


def _whole_numbers(app: Any, tree: Any, name: str) -> None:
    """Keep numbers such as 1e-6 in one line: browsers break lines behind the hyphen."""
    for text in [text for entry in tree.findall(nodes.entry) for text in entry.findall(nodes.Text)]:
        parts = re.split(r"(\d[\d.]*e-\d+)", text.astext())
        if len(parts) > 1 and not isinstance(text.parent, nodes.math | nodes.literal):
            numbers = [nodes.inline("", s, classes=["number"]) if k % 2 else nodes.Text(s) for k, s in enumerate(parts)]
            text.parent.replace(text, numbers)
    for code in [code for code in tree.findall(nodes.literal) if max(map(len, code.astext().split()), default=0) <= 16]:
        code["classes"].append("words")  # ``--links`` too


def _note_other_names(app: Any, env: Any) -> None:
    """Enter the longer names of public objects in the inventory (``objects.inv``) too."""
    domain = env.domains.python_domain
    for short, names in public_api.places().items():
        entry = domain.objects[short]
        for name in names:
            domain.objects.setdefault(name, entry._replace(aliased=True))


def _formula(writer: Any, node: Any) -> None:
    block = node.tagname == "math_block"
    markup = mathml(node.astext(), block)
    writer.body.append(f'<div class="math">{markup}</div>' if block else markup)
    raise nodes.SkipNode


def _long_cells(app: Any, doctree: nodes.document, name: str) -> None:
    """Mark the cells of long texts: on a phone they stay wide enough to be read."""
    for cell in doctree.findall(nodes.entry):
        if len(cell.astext()) > 60:
            cell["classes"].append("long")


def _tables_of_keys(app: Any, doctree: nodes.document, name: str) -> None:
    """Mark tables whose last column, of five, is the meaning: on a phone each row becomes a paragraph."""
    for table in doctree.findall(nodes.table):
        heads = [entry.astext() for entry in next(iter(table.findall(nodes.thead))).findall(nodes.entry)]
        if heads == ["key", "type", "unit", "default", "meaning"]:
            table["classes"].append("keys")


def _dotted_names(app: Any, doctree: nodes.document, name: str) -> None:
    """Let the dotted names of tables and headings break behind a dot, not in a word."""
    places = [place for kind in (nodes.entry, nodes.title) for place in doctree.findall(kind)]
    for literal in [found for place in places for found in place.findall(nodes.literal)]:
        parts = re.split(r"(?<=[\w\]]\.)(?=[A-Za-z_])", literal.astext())
        if len(parts) > 1 and len(literal.children) == 1:
            literal.clear()
            for part in parts:
                literal.extend([nodes.Text(part), nodes.raw("", "<wbr>", format="html")])


def _signature(app: Any, what: str, name: str, obj: Any, options: Any, *texts: str | None) -> tuple[str | None, ...]:
    """Write aliases of types by their names, and a default that is made anew as ``...``, which Sphinx can parse."""
    texts = tuple(text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in texts)
    return tuple(text and text.replace("<factory>", "...") for text in texts)


def _skip(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out the fields of named tuples: the signature has them, and their docstring is "Alias for field 0"."""
    return True if type(obj).__name__ == "_tuplegetter" else None


def _whole_docstring(self: Any) -> tuple[str, list[str]]:
    """Return no type and all lines: a property whose docstring says "Mean: what it is" does not state a type."""
    return "", self.__class__(self._dedent(self._consume_to_end()), self._config).lines()


def _one_entry(
    self: Any, parse_type: bool = True, prefer_type: bool = False, multiple: bool = False
) -> list[tuple[Any, ...]]:
    """Keep the names of "width, height : float" in one entry; Sphinx would take the first for a type."""
    return [(re.sub(r",\s+", ",", name), *rest) for name, *rest in CONSUME(self, parse_type, prefer_type, False)]


def _spaced_names(app: Any, doctree: nodes.document) -> None:
    """Set the space again that `_one_entry` took."""
    for comma in [node for node in doctree.findall(addnodes.literal_strong) if node.astext() == ","]:
        comma.replace_self(nodes.Text(", "))


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    setattr(NumpyDocstring, "_consume_inline_attribute", _whole_docstring)  # noqa: B010
    setattr(NumpyDocstring, "_consume_fields", _one_entry)  # noqa: B010
    next(field for field in PyObject.doc_field_types if field.name == "variable").label = "Attributes"
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-skip-member", _skip)
    app.connect("doctree-read", _without_chance_links)
    app.connect("doctree-read", _spaced_names)
    app.connect("doctree-resolved", _whole_numbers)
    app.connect("doctree-resolved", _long_cells)
    app.connect("doctree-resolved", _tables_of_keys)
    app.connect("doctree-resolved", _dotted_names)
    app.connect("env-updated", _note_other_names)
    app.add_html_math_renderer("mathml", (_formula, None), (_formula, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
