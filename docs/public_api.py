"""Turns the docstrings of all public names into Markdown, for `docs/reference/api.md` of the built site."""

from __future__ import annotations

import enum
import inspect
import re
from importlib import import_module
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "graphsynth"

#: Modules that are public beside the packages with an ``__all__``.
MODULES = (
    "graphsynth.core.errors",
    "graphsynth.structure.assur",
    "graphsynth.mechanism.joints",
    "graphsynth.mechanism.laws",
    "graphsynth.mechanism.files",
    "graphsynth.mechanism.gallery",
)


def rooms() -> list[str]:
    """Public modules, and every package whose ``__init__`` has an ``__all__``; deeper ones first."""
    found = list(MODULES)
    for init in PACKAGE.rglob("__init__.py"):
        name = ".".join(init.parent.relative_to(PACKAGE.parent).parts)
        public = re.search(r"^(?:\w+, )*__all__\b", init.read_text("utf-8"), re.MULTILINE)
        if public and not {"kernels", "cli"} & set(name.split(".")):
            found.append(name)
    return sorted(found, key=lambda name: (-name.count("."), name))


def public_names(room: str) -> list[str]:
    """Names of ``__all__`` without dunder names."""
    return [name for name in import_module(room).__all__ if not name.startswith("__")]


def signature_of(name: str, thing: object) -> str:
    """Call signature as text; empty for what is not called."""
    if not callable(thing):
        return ""
    try:
        signature = inspect.signature(thing)
    except (TypeError, ValueError):
        return ""
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    text = f"{name}{signature.replace(parameters=bare, return_annotation=signature.empty)}"
    return re.sub(r"<([\w.]+)[^<>]*>", r"\1", text)


def members(thing: type) -> str:
    """Public methods and properties of a class with the first line of their docstrings; values of an enumeration."""
    if issubclass(thing, enum.Enum):
        return "\n".join(f"{member.name} = {member.value!r}" for member in thing)
    lines = []
    for name, raw in sorted(vars(thing).items()):
        member = raw.__func__ if isinstance(raw, classmethod | staticmethod) else raw
        told = inspect.getdoc(member) if inspect.isfunction(member) or hasattr(member, "__get__") else None
        if name.startswith("_") or not told or inspect.ismemberdescriptor(member):
            continue
        call = signature_of(name, member) if inspect.isfunction(member) else name
        first = " ".join(told.partition("\n\n")[0].split()).replace("``", "`")
        lines.append(f".{re.sub(r'[(](self|cls)(, )?', '(', call)}\n    {first}")
    return "\n".join(lines)


def entry(name: str, thing: object) -> str:
    """Markdown of one name: signature, docstring, examples."""
    parts = [f"### `{name}`\n"]
    call = signature_of(name, thing)
    if call:
        parts.append(f"```python\n{call}\n```\n")
    documented = inspect.isclass(thing) or inspect.isroutine(thing) or inspect.ismodule(thing)
    text = (inspect.getdoc(thing) or "") if documented else ""
    text = re.sub(r":\w+:`~?", "`", text.replace("``", "`"))  # roles of reStructuredText
    body, _, examples = text.partition("\nExamples\n--------\n")
    if body:
        parts.append(f"````text\n{body.strip()}\n````\n")
    inner = members(thing) if isinstance(thing, type) else ""
    if inner:
        parts.append(f"````text\n{inner}\n````\n")
    if examples:
        parts.append(f"````pycon\n{examples.strip()}\n````\n")
    if not documented:
        parts.append(f"`{thing}`\n" if len(str(thing)) < 200 else f"A value of type `{type(thing).__name__}`.\n")
    return "\n".join(parts)


def reference() -> str:
    """Markdown of all rooms; a name that a package lends from another is shown once, in the deepest one."""
    sections, seen = {}, set[int]()
    for room in rooms():
        module = import_module(room)
        entries = []
        for name in sorted(public_names(room)):
            thing = getattr(module, name)
            if id(thing) not in seen:
                seen.add(id(thing))
                entries.append(entry(name, thing))
        if entries:
            sections[room] = f"## `{room}`\n\n" + "\n".join(entries)
    return "\n".join(text for _, text in sorted(sections.items()))


def kind_of(thing: object) -> str:
    """Kind of a name, as the Python domain of Sphinx calls it."""
    if inspect.isclass(thing):
        return "exception" if issubclass(thing, BaseException) else "class"
    if inspect.ismodule(thing):
        return "module"
    return "function" if callable(thing) else "data"


def places() -> list[tuple[str, str, list[str], str]]:
    """Room and name of every entry of `reference`, every dotted name that leads to it, and its kind."""
    entries: dict[int, tuple[str, str, list[str], str]] = {}
    for room in rooms():
        module = import_module(room)
        for name in sorted(public_names(room)):
            thing = getattr(module, name)
            entry_of = entries.setdefault(id(thing), (room, name, [], kind_of(thing)))
            entry_of[2].append(f"{room}.{name}")
    return list(entries.values())
