"""Which tests to run against a change: those that run the changed function, or else those nearest to its module."""

from __future__ import annotations

import ast
import json
import re
from collections import defaultdict, deque
from functools import cache
from pathlib import Path

__all__ = ["is_compiled", "nearest_files", "touching"]

ROOT = Path(__file__).parents[2]


def _name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def _names(path: Path) -> frozenset[str]:
    """Modules of the package that a file imports, by statement or as a string, lazily or not."""
    source = path.read_text("utf-8")
    names = set(re.findall(r"graphsynth(?:\.\w+)+", source))
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


@cache
def _users() -> dict[str, set[Path]]:
    """Which files name a module."""
    modules = set((ROOT / "graphsynth").rglob("*.py"))
    known = {_name(path): path for path in modules}
    users: dict[str, set[Path]] = {name: set() for name in known}
    for path in sorted(modules) + sorted((ROOT / "tests").rglob("*.py")):
        for name in _names(path):
            while name and name not in known:
                name = name.rpartition(".")[0]
            if name and known[name] != path:
                users[name].add(path)
    return users


@cache
def _distances(module: str) -> tuple[dict[str, int], dict[Path, int]]:
    """How many imports away from a module the modules and the test files are that reach it."""
    distance, files, waiting = {_name(ROOT / module): 0}, {}, deque([_name(ROOT / module)])
    while waiting:
        here = waiting.popleft()
        for path in sorted(_users().get(here, ())):
            if path.is_relative_to(ROOT / "tests"):
                if path.name.startswith("test_") and "bench" not in path.parts:
                    files[path] = min(distance[here], files.get(path, 99))
            elif _name(path) not in distance and _name(path) != "graphsynth":
                distance[_name(path)] = distance[here] + 1
                waiting.append(_name(path))
    return distance, files


def is_compiled(module: str) -> bool:
    """Whether compiled functions depend on a module."""
    sources = (ROOT.joinpath(*name.split(".")).with_suffix(".py") for name in _distances(module)[0])
    return any(path.is_file() and "import kernel" in path.read_text("utf-8") for path in sources)


def _rank(module: str, file: str) -> tuple[bool, int, int]:
    """Order of a test file: of the same room, alike in name, few imports away."""
    alike = set(re.split(r"[_/.]", module)) & set(re.split(r"[_/.]", file))
    room = Path(file).parts[1:2] != Path(module).parts[1:2]
    return room, -len(alike), _distances(module)[1].get(ROOT / file, 99)


def nearest_files(module: str, most: int = 24) -> list[str]:
    """Test files of a module's room and those that reach it by imports, nearest and most alike in name first."""
    room = (ROOT / "tests" / Path(module).parts[1]).rglob("test_*.py")
    files = {str(path.relative_to(ROOT)) for path in (*room, *_distances(module)[1])}
    return sorted(files, key=lambda file: (*_rank(module, file), file))[:most]


@cache
def _read(folder: Path) -> tuple[dict[str, set[str]], dict[str, float]]:
    """Tests of each function, and their seconds, from what the plugin ``touched`` wrote."""
    tests, seconds = defaultdict(set), defaultdict(float)
    for path in sorted(folder.glob("touched.*.json")):
        found = json.loads(path.read_text("utf-8"))
        for node, row in found["tests"].items():
            test, file = node.partition("[")[0], node.partition("::")[0]
            seconds[test] += row.get("seconds", 0.0)
            for function in (*row.get("functions", ()), *found["files"].get(file, ())):
                tests[function].add(test)
    return tests, seconds


@cache
def _mentions() -> dict[str, set[tuple[Path, str]]]:
    """Functions whose code mentions a name."""
    found = defaultdict(set)
    for path in sorted((ROOT / "graphsynth").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef):
                for part in ast.walk(node):
                    name = part.id if isinstance(part, ast.Name) else getattr(part, "attr", None)
                    if name and name != node.name:
                        found[name].add((path, node.name))
    return found


def touching(folder: Path, module: str, function: str, seconds: float = 60.0) -> list[str]:
    """Return tests that run a function, or those that call it where it is compiled: at most so many seconds of them."""
    tests, cost = _read(folder)
    start = (ROOT / module, function)
    seen, waiting, chosen = {start}, deque([start]), set()
    while waiting:
        path, name = waiting.popleft()
        ran = tests.get(f"{path.relative_to(ROOT)}::{name}", set())
        chosen |= ran
        if not ran or "@kernel" in path.read_text("utf-8"):  # a compiled function leaves no trace
            for caller in sorted(_mentions()[name] - seen):
                if caller[0] == path or any(n.startswith(_name(path)) for n in _names(caller[0])):
                    seen.add(caller)
                    waiting.append(caller)
    files: dict[str, list[str]] = defaultdict(list)
    for test in sorted(chosen, key=lambda test: (cost[test], test)):
        files[test.partition("::")[0]].append(test)
    order, spent = [], 0.0
    for file in sorted(files, key=lambda file: (*_rank(module, file), file)):
        for test in files[file]:
            if spent + cost[test] <= seconds:
                order.append(test)
                spent += cost[test]
    return order
