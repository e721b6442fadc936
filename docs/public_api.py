"""The public names and the pages that show their docstrings.

Public is what stands in the stubs of the packages, and in a few modules beside them. A page of the reference asks for
the docstrings of objects or of whole packages with ``<!-- api: NAME NAME -->``; Sphinx's autodoc sets them.
"""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from pathlib import Path
from types import GenericAlias, UnionType

DOCS = Path(__file__).resolve().parent
PACKAGE = DOCS.parent / "graphsynth"
MARK = re.compile(r"<!-- api: ([^>]*?) -->")

#: Modules that are public beside the packages with stubs.
MODULES = (
    "graphsynth.core.errors",
    "graphsynth.structure.assur",
    "graphsynth.mechanism.joints",
    "graphsynth.mechanism.laws",
    "graphsynth.mechanism.files",
    "graphsynth.mechanism.gallery",
)


def rooms() -> list[str]:
    """Public modules, and every package with a stub; deeper ones first."""
    found = [".".join(stub.parent.relative_to(PACKAGE.parent).parts) for stub in PACKAGE.rglob("__init__.pyi")]
    return sorted([*MODULES, *found], key=lambda name: (-name.count("."), name))


def public_names(room: str) -> list[str]:
    """Public names of a room, without dunder names."""
    if room in MODULES:
        names = import_module(room).__all__
    else:
        stub = PACKAGE.parent.joinpath(*room.split("."), "__init__.pyi")
        lines = [node for node in ast.parse(stub.read_text("utf-8")).body if isinstance(node, ast.ImportFrom)]
        names = [alias.asname or alias.name for node in lines for alias in node.names]
    return [name for name in names if not name.startswith("__")]


def thing_of(dotted: str) -> object:
    """Return what a dotted name stands for."""
    room, _, name = dotted.rpartition(".")
    try:
        return getattr(import_module(room), name)
    except (ImportError, AttributeError):
        return import_module(dotted)


def kind_of(thing: object) -> str:
    """Kind of a name, as the Python domain of Sphinx calls it."""
    if isinstance(thing, GenericAlias):
        return "data"
    if inspect.isclass(thing):
        return "exception" if issubclass(thing, BaseException) else "class"
    if inspect.ismodule(thing):
        return "module"
    return "function" if callable(thing) else "data"


def places() -> dict[str, list[str]]:
    """Every public object by its shortest dotted name, with all dotted names that lead to it; modules are left out."""
    found: dict[int, list[str]] = {}
    for room in rooms():
        for name in public_names(room):
            thing = thing_of(f"{room}.{name}")
            if not inspect.ismodule(thing):
                found.setdefault(id(thing), []).append(f"{room}.{name}")
    return {min(names, key=lambda name: name.count(".")): names for names in found.values()}


def shown() -> dict[str, list[str]]:
    """Names that each page of the reference shows; a name that a page asks for by itself is not shown with its room."""
    asked = {
        page.stem: [word for found in MARK.findall(page.read_text("utf-8")) for word in found.split()]
        for page in sorted((DOCS / "reference").glob("*.md"))
    }
    shortest = {name: short for short, names in places().items() for name in names}
    singles = {shortest.get(word, word) for words in asked.values() for word in words if word not in rooms()}
    pages: dict[str, list[str]] = {}
    for page, words in asked.items():
        for word in words:
            if word in rooms():
                of_room = (shortest.get(f"{word}.{name}", "") for name in public_names(word))
                names = [name for name in of_room if name and name not in singles]
            else:
                names = [shortest.get(word, word)]
            pages.setdefault(page, []).extend(names)
    return pages


def comment_of(name: str) -> str:
    """Return what ``#:`` says above a constant or beside it, in the module from which its stub takes it or its own."""
    room, _, last = name.rpartition(".")
    folder = PACKAGE.parent.joinpath(*room.split("."))
    stub = ast.parse(_text(folder / "__init__.pyi")).body
    sources = [node for node in stub if isinstance(node, ast.ImportFrom) for name in node.names if name.name == last]
    base = folder if not sources else folder if sources[0].level else PACKAGE.parent
    module = base.joinpath(*(sources[0].module or "").split(".")) if sources else folder
    text = _text(module.with_suffix(".py"))
    beside = re.search(rf"^{last}\b.*  #: (.*)$", text, re.MULTILINE)
    above = re.search(rf"((?:^#:.*\n)+)^{last}\b", text, re.MULTILINE)
    lines = [beside[1]] if beside else above[1].splitlines() if above else []
    return " ".join(line.removeprefix("#:").strip() for line in lines)


def _text(path: Path) -> str:
    return path.read_text("utf-8") if path.is_file() else ""


def directive(name: str) -> str:
    """Return what makes Sphinx show a name; a value has no docstring, so its type, it and its comment are shown."""
    thing = thing_of(name)
    if kind_of(thing) != "data":
        return f".. auto{kind_of(thing)}:: {name}"
    value = f"\n   :value: {thing!r}" if len(repr(thing)) < 120 else ""
    kind = "TypeAlias" if isinstance(thing, GenericAlias | UnionType) else type(thing).__name__
    return f".. py:data:: {name}\n   :type: {kind}{value}\n\n   {comment_of(name)}"


def with_docstrings(text: str, page: str) -> str:
    """Put autodoc's directives where a page of the reference asks for docstrings."""
    name = page.partition("/")[2]
    if not MARK.search(text):
        return text
    lines = "\n\n".join(directive(each) for each in shown()[name])
    return MARK.sub(f"```{{eval-rst}}\n{lines}\n```", text, count=1)


def index() -> str:
    """Return a table of all public names by page: each leads to its docstring."""
    parts = []
    for page, names in shown().items():
        title = (DOCS / "reference" / f"{page}.md").read_text("utf-8").partition("\n")[0].removeprefix("# ")
        rows = []
        for name in names:
            documented = kind_of(thing_of(name)) != "data"
            text = (inspect.getdoc(thing_of(name)) or "") if documented else comment_of(name)
            told = " ".join(text.partition("\n\n")[0].split())
            rows.append(f"| {{py:obj}}`{name}` | {told.replace('``', '`').replace('|', chr(92) + '|')} |")
        parts.append(f"## [{title}]({page}.md)\n\n| name | what |\n|---|---|\n" + "\n".join(rows))
    return "\n\n".join(parts)
