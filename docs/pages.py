"""The pages of the documentation: their fenced blocks, their sections, the bibliography, for the site and the tests."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md"])
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
ENTRY = re.compile(r"^@\w+\{(\w+),\n(.*?)^\}", re.MULTILINE | re.DOTALL)


def name_of(page: Path) -> str:
    """Path of a page within the project."""
    return page.relative_to(ROOT).as_posix()


def fences(page: Path) -> Iterator[tuple[str, str, int]]:
    """Language, text and first line of every fenced block."""
    text = page.read_text(encoding="utf-8")
    for match in FENCE.finditer(text):
        yield match[1].strip(), match[2], text.count("\n", 0, match.start(2))


def theory() -> dict[str, set[int]]:
    """Numbers of the sections of every page of the theory: what ``theory/PAGE NUMBER`` may cite."""
    heading = re.compile(r"^## (\d+)\. ", re.MULTILINE)
    pages = (ROOT / "docs" / "theory").glob("*.md")
    return {page.stem: {int(n) for n in heading.findall(page.read_text("utf-8"))} for page in pages}


def _last_names(author: str) -> list[str]:
    names = [name.strip() for name in author.split(" and ")]
    return [name.strip("{}").removeprefix("The ").split(" ")[0] if "{" in name else name.split(",")[0] for name in names]


def bibliography() -> dict[str, dict[str, str]]:
    """Entries of ``references.bib`` by their label, "Krawczyk 1969" or "Rump et al. 2009", in its order."""
    found = {}
    for match in ENTRY.finditer((ROOT / "docs" / "references.bib").read_text("utf-8")):
        entry = dict(re.findall(r"^  (\w+) = \{(.*)\},$", match[2], re.MULTILINE))
        names = _last_names(entry["author"])
        who = " & ".join(names) if len(names) < 3 else f"{names[0]} et al."
        found[f"{who} {entry['year']}"] = entry | {"key": match[1]}
    return found


def references() -> str:
    """Markdown of the bibliography: one paragraph with an anchor for each entry."""
    parts = []
    for label, entry in bibliography().items():
        people = []
        for name in entry["author"].split(" and "):
            last, _, first = name.strip("{} ").partition(", ")
            people.append(f"{first} {last}".strip())
        where = [entry.get(field, "") for field in ("edition", "journal", "booktitle", "number", "publisher", "address")]
        where[0] += " edition" if where[0] else ""
        if "volume" in entry:
            where.append(f"volume {entry['volume']}")
        if "pages" in entry:
            where.append(f"pages {entry['pages']}")
        where += [entry["year"], entry.get("note", "")]
        text = ", ".join([*people, f"*{entry['title']}*", *filter(None, where)]).replace("--", "–")
        doi = f", [doi:{entry['doi']}](https://doi.org/{entry['doi']})" if "doi" in entry else ""
        parts.append(f"({entry['key'].lower()})=\n**{label}**: {text}{doi}.\n")
    return "\n".join(parts)


def with_links_to_references(text: str, page: str) -> str:
    """Link every ``[Krawczyk 1969]`` of a page to the bibliography."""
    for label, entry in bibliography().items():
        text = text.replace(f"[{label}]", f"[{label}](#{entry['key'].lower()})")
    return text if page != "reference/bibliography" else text.replace("<!-- references -->", references())
