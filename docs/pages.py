"""The pages of the documentation: their fenced blocks, their sections, the bibliography, for the site and the tests."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
    return [name.strip("{} ") if "{" in name else name.split(",")[0].strip() for name in author.split(" and ")]


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
        where = [
            entry.get(field, "") for field in ("edition", "journal", "booktitle", "number", "publisher", "address")
        ]
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


def _kind(schema: dict[str, Any]) -> str:
    """Type of a key in words: "number, mm", "text", "list of 3 numbers"."""
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if "anyOf" in schema:
        kinds = list(dict.fromkeys(_kind(option) for option in schema["anyOf"]))
        return " or ".join(kind for kind in kinds if kind != "quantity" or len(kinds) == 1)
    if schema.get("type") == "array":
        items = schema.get("prefixItems") or [schema.get("items") or {}]
        many = f"{len(items)} " if "prefixItems" in schema else "list of "
        kinds = dict.fromkeys(_kind(item) for item in items if isinstance(item, dict))
        return many + " and ".join(
            f"{kind}s" if kind in ("number", "integer", "text", "table") else kind for kind in kinds
        )
    if schema.get("type") == "string" and "pattern" in schema:
        return "quantity"
    return {"string": "text", "object": "table", "boolean": "true or false"}.get(
        schema.get("type", ""), schema.get("type", "any")
    )


def _rows(schema: dict[str, Any], above: str) -> Iterator[str]:
    for key, value in schema.get("properties", {}).items():
        told = value.get("description", "")
        if told.startswith("with its unit"):  # the same key without the unit in its name
            continue
        if _kind(value).endswith("quantity") and any(f"{key}_" in other for other in schema["properties"]):
            continue
        inner = json.dumps([value.get("items"), value.get("prefixItems")])
        unit = re.match(r"in (.*), or text with a unit$", told) or re.search(
            r'"in ([^"]*), or text with a unit"', inner
        )
        default = "" if "default" not in value else f"`{json.dumps(value['default'])}`"
        needed = "needed" if key in schema.get("required", ()) else default
        meaning = "" if told.startswith("in ") else " ".join(told.split()).replace("|", r"\|")
        yield f"| `{above}{key}` | {_kind(value)} | {unit[1] if unit else ''} | {needed} | {meaning} |"
        yield from _rows(value, f"{above}{key}.")
        if isinstance(value.get("items"), dict):
            yield from _rows(value["items"], f"{above}{key}[].")


def scene_keys(module: str) -> str:
    """Table of the keys of one system's ``[mechanism]``, from the schema of scene files."""
    schema = json.loads((ROOT / "docs" / "reference" / "scene.schema.json").read_text("utf-8"))
    for case in schema["allOf"]:
        if case["if"]["properties"]["mechanism"]["properties"]["module"].get("const") == module:
            rows = _rows(case["then"]["properties"]["mechanism"], "")
            head = "| key | type | unit | default | meaning |\n|---|---|---|---|---|\n"
            return head + "\n".join(row for row in rows if not row.startswith("| `module`"))
    raise ValueError(f"no system is called {module!r}")


def with_scene_keys(text: str) -> str:
    """Put the tables of keys into a page."""
    return re.sub(r"<!-- keys: (\w+) -->", lambda match: scene_keys(match[1]), text)


def benches() -> str:
    """Table of the benchmarks: what each module of ``tests/bench`` measures, in the first sentence of its docstring."""
    rows = []
    for path in sorted((ROOT / "tests" / "bench").glob("test_*_speed.py")):
        told = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
        first = " ".join(re.split(r"[;:.]", told.partition("\n\n")[0])[0].split())
        rows.append(f"| `{path.name}` | {first} |")
    return "| module | what it measures |\n|---|---|\n" + "\n".join(rows)


def readme_table() -> str:
    """Return the comparison with other tools as it stands in the README."""
    section = (ROOT / "README.md").read_text("utf-8").partition("## Beside other tools\n")[2].partition("\n## ")[0]
    return re.sub(r"\]\(docs/", "](../", section.strip())


def with_benches(text: str) -> str:
    """Put the tables of benchmarks into a page."""
    for mark, table in (("<!-- benches -->", benches), ("<!-- table of the README -->", readme_table)):
        if mark in text:
            text = text.replace(mark, table())
    return text
