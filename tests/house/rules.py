"""The rules of the house, each as a function that returns what breaks it; `test_house.py` asks them all."""

from __future__ import annotations

import ast
import gc
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "graphsynth"
#: Rooms from the lowest to the highest; those in one line do not import each other.
ORDER = (
    ("core",), ("intervals", "structure"), ("synthesis", "mechanism"), ("tolerances",), ("kinematics",),
    ("jamming", "dynamics"), ("design",), ("drawing", "formats"), ("evidence",), ("pipeline",), ("systems",),
    ("workbench",), ("atlas",), ("cli", "testing"),
)  # fmt: skip
#: Modules whose methods are written down elsewhere and looked up on first use.
FACADES = {"graphsynth.structure.graph", "graphsynth.mechanism.model"}


@cache
def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name; a package by its ``__init__``."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def tree(name: str) -> ast.Module:
    """Return the syntax tree of a module."""
    gc.disable()  # it would look through all trees again and again, and finds nothing to free
    try:
        return ast.parse(modules()[name].read_text(encoding="utf-8"))
    finally:
        gc.enable()


@cache
def nodes(name: str) -> list[ast.AST]:
    """Return what the rules ask of a module: its imports, functions and constants, wherever they stand."""
    kinds = (ast.Import, ast.ImportFrom, ast.Constant, ast.FunctionDef)
    return [node for node in ast.walk(tree(name)) if isinstance(node, kinds)]


@cache
def imports(name: str) -> frozenset[str]:
    """Modules that a module imports anywhere, for type checkers too, or names in a string."""
    found = set()
    for node in nodes(name):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= whole & modules().keys() or {node.module}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("graphsynth."):
            found |= {match[1] for match in re.finditer(r"^(graphsynth(?:\.\w+)+)(?::\w+)?$", node.value)}
    return frozenset(found & modules().keys() - {name})


def room(name: str) -> str:
    """Return the room of a module."""
    return name.split(".")[1] if "." in name else ""


def upward() -> Iterator[str]:
    """Rule 3: a module that imports, or names in a string, a room above its own."""
    height = {name: k for k, names in enumerate(ORDER) for name in names}
    for name in modules():
        own = room(name)
        if own in height:
            for other in sorted(imports(name)):
                theirs = room(other)
                if theirs in height and theirs != own and height[theirs] >= height[own]:
                    yield f"{name} -> {other}"


def circles() -> Iterator[str]:
    """Rule 3: modules that import each other, directly or through others; a package's own names are not a module."""
    graph = nx.DiGraph()
    plain = {name for name, path in modules().items() if path.name != "__init__.py"}
    graph.add_edges_from(
        (name, other) for name in plain - FACADES for other in imports(name) if other in plain - FACADES
    )
    for group in nx.strongly_connected_components(graph):
        if len(group) > 1:
            yield " <-> ".join(sorted(group))


def systems_named_outside() -> Iterator[str]:
    """Rule 1: a file outside ``systems/X`` that imports or names the folder of system X."""
    names = sorted(path.name for path in (PACKAGE / "systems").iterdir() if (path / "__init__.py").exists())
    pattern = re.compile(rf"graphsynth\.systems\.({'|'.join(names)})\b|systems/({'|'.join(names)})\b")
    for name, path in modules().items():
        for match in set(pattern.findall(path.read_text(encoding="utf-8"))):
            system = "".join(match)
            if not name.startswith(f"graphsynth.systems.{system}"):
                yield f"{name} names {system}"


def _functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    for name in modules():
        yield from ((name, node) for node in nodes(name) if isinstance(node, ast.FunctionDef))


def many_parameters() -> Iterator[str]:
    """Rule 5: a function with more than 8 parameters, a kernel with more than 12."""
    for name, node in _functions():
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        own = [a for a in arguments if a.arg not in ("self", "cls")]
        if len(own) > (12 if ".kernels" in name else 8):
            yield f"{name}.{node.name}: {len(own)}"


def silent_kernels() -> Iterator[str]:
    """Rule 5: a kernel above 40 lines without comments that explain its steps, one in 20 lines at least."""
    for name, node in _functions():
        if ".kernels" in name and (node.end_lineno or 0) - node.lineno + 1 > 40:
            lines = modules()[name].read_text(encoding="utf-8").splitlines()[node.lineno - 1 : node.end_lineno]
            if sum("#" in line for line in lines) < len(lines) / 20:
                yield f"{name}.{node.name}: {len(lines)} lines"


def long_functions() -> Iterator[str]:
    """Functions of more than 80 lines."""
    for name, node in _functions():
        if (node.end_lineno or 0) - node.lineno + 1 > 80:
            yield f"{name}.{node.name}"


def unformatted() -> Iterator[str]:
    """Places that the formatter is told to leave alone."""
    for name, path in modules().items():
        for _ in re.finditer(r"# fmt: (skip|off)", path.read_text(encoding="utf-8")):
            yield name


def unresolved_references() -> Iterator[str]:
    """Rule 6: a mention of a section of something that is not in the repository."""
    book = r"(?<!\d\], )(?<!chapter \d, )"  # [Hunt 1978], section 5.4
    words = rf"spec(?:ification)?\b[^.\n]{{0,40}}?\bsections?|{book}sections?|spec"
    pattern = re.compile(rf"(?i)\b(?:{words}) \d+(?:\.\d+)*")
    for name, path in modules().items():
        for match in pattern.findall(path.read_text(encoding="utf-8")):
            yield f"{name}: {match}"


def repeated_public_names() -> Iterator[str]:
    """Rule 4: a class name that two modules give to different public classes."""
    found = defaultdict(set)
    for name in modules():
        for node in tree(name).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].add(name)
    public = set()
    for stub in PACKAGE.rglob("__init__.pyi"):
        public |= {
            a.name for n in ast.parse(stub.read_text("utf-8")).body if isinstance(n, ast.ImportFrom) for a in n.names
        }
    for word, places in sorted(found.items()):
        if len(places) > 1 and word in public:
            yield f"{word}: {', '.join(sorted(places))}"


#: Folders of modules with a line of their own in the budget, beside the systems.
FOLDERS = {
    "jamming/assembly", "jamming/binding", "jamming/chance", "jamming/margins", "jamming/space",
    "design/poses", "design/nine_points", "design/curves", "design/task", "design/parts",
}  # fmt: skip


def sizes() -> dict[str, tuple[int, int]]:
    """Lines and files of every room; modules at the top are the room ``graphsynth``."""
    found: dict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for path in [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]:
        parts = path.relative_to(PACKAGE).parts
        deep = len(parts) > 2 and (parts[0] == "systems" or "/".join(parts[:2]) in FOLDERS)
        own = "graphsynth" if len(parts) == 1 else "/".join(parts[: 2 if deep else 1])
        lines, files = found[own]
        found[own] = (lines + len(path.read_text(encoding="utf-8").splitlines()), files + 1)
    return dict(found)


RULES = {
    rule.__name__: rule
    for rule in (
        upward, circles, systems_named_outside, many_parameters, silent_kernels, long_functions, unformatted,
        unresolved_references, repeated_public_names,
    )
}  # fmt: skip
