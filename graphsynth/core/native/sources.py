"""What a compiled kernel was made of: its module and all modules of the package that this one imports."""

from __future__ import annotations

import re
from functools import cache
from hashlib import sha256
from pathlib import Path

_IMPORT = re.compile(r"^\s*(?:from|import)\s+(graphsynth[\w.]*)(?:\s+import\s+(\([^)]*\)|[^#\n]+))?", re.MULTILINE)
_TRIPLE = r'"""[^"\\]*(?:(?:\\.|"(?!""))[^"\\]*)*"""'
#: A docstring; any other text, which is kept; a comment; lines without anything.
_UNREAD = re.compile(
    rf'^[ \t]*r?{_TRIPLE}[ \t]*$|({_TRIPLE}|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\')|[ \t]*#.*', re.MULTILINE
)
_BLANK = re.compile(r"(?:[ \t]*\n)+")
_ROOT = Path(__file__).parents[3]
_COMPILATION = Path(__file__).parents[1] / "compilation.py"  # no code of its own in a kernel


@cache
def source_digest(module: Path, root: Path = _ROOT) -> str:
    """Digest of a source file and of all modules of the package, in ``root``, that it imports, directly or not.

    Comments and docstrings do not count.
    """
    digest = sha256()
    for path in sorted(sources(module, root), key=str):
        digest.update(f"{path.name}\0{_read_source(path, root)[0]}\0".encode())
    return digest.hexdigest()


def sources(module: Path, root: Path = _ROOT) -> set[Path]:
    """Return a source file and all modules of the package that it imports, directly or through others."""
    found: set[Path] = set()
    waiting = [module]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _read_source(path, root)[1]
    return found


@cache
def _read_source(path: Path, root: Path) -> tuple[str, list[Path]]:
    """Return a source file without comments and docstrings, and the files of the package that it imports."""
    text = _BLANK.sub("\n", _UNREAD.sub(r"\1", path.read_text("utf-8")))
    paths = []
    for name, parts in _IMPORT.findall(text):
        base = root.joinpath(*name.split("."))
        modules = [base / f"{part}.py" for part in re.findall(r"\w+", parts)]
        package = base / "__init__.py"
        found = [path if path.is_file() else package for path in modules] or [package]
        paths += [path for path in (base.with_suffix(".py"), *found) if path.is_file() and path != _COMPILATION]
    return text, paths
