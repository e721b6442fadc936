"""Rule 6: every citation leads to a section of docs/theory or to an entry of docs/references.bib.

``theory/jam-arcs 3`` cites section 3 of docs/theory/jam-arcs.md; several are ``1, 3``, ``1 and 3`` or ``1 to 3``.
``[Krawczyk 1969]`` or ``[Rump et al. 2009]`` cites the entry of that label; both forms may go on after a line break.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GAP = r"(?:\s+(?:#:? )?)"
NEXT = rf"(?:{GAP}|,{GAP}|{GAP}and{GAP}|{GAP}to{GAP})\d{{1,2}}\b(?![.\d]*\d)"
THEORY = re.compile(rf"\btheory/([\w-]+)(?![\w-]|\.md)(?:{NEXT})*")
LABEL = re.compile(rf"(?<![\w\])])\[([A-Z][^\W\d]+(?:{GAP}(?:&|et|al\.|[A-Z][\w-]+))*{GAP}\d{{4}}[a-z]?)\]")
OLD = re.compile(r"\b[Ss]pec(?:ification)?,?\s(?:\w+_\w+,\s)?(?:sections?\s\d|\d+\.\d)")


def _pages():  # type: ignore[no-untyped-def]
    spec = importlib.util.spec_from_file_location("docs_pages", ROOT / "docs" / "pages.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def citing(text: str) -> Iterator[tuple[str, str, list[int]]]:
    """Citations of a text: as written, page or label, numbers of sections (none for a label or a whole page)."""
    for match in THEORY.finditer(text):
        yield match[0], match[1], [int(n) for n in re.findall(r"\d+", match[0][len("theory/") + len(match[1]) :])]
    for match in LABEL.finditer(text):
        yield match[0], re.sub(GAP, " ", match[1]), []


def files() -> Iterator[Path]:
    """Sources, tests, scenes and pages."""
    for folder, ending in (("graphsynth", "py"), ("tests", "py"), ("catalog", "toml"), ("docs", "md")):
        yield from sorted((ROOT / folder).rglob(f"*.{ending}"))
    yield ROOT / "README.md"


def unresolved_references() -> Iterator[str]:
    """Citations that lead nowhere, and those of a text that is not in the repository."""
    pages = _pages()
    theory, labels = pages.theory(), set(pages.bibliography())
    for path in files():
        text = path.read_text(encoding="utf-8")
        if path.parent.name == "house":
            continue
        for written, target, numbers in citing(text):
            if target not in labels and not (target in theory and set(numbers) <= theory[target]):
                yield f"{path.relative_to(ROOT)}: {written}"
        yield from (f"{path.relative_to(ROOT)}: {match}" for match in OLD.findall(text))
