"""Stress cases as data: TOML files with what is called and what must come, read and carried out here.

A file holds cases; a case is a list of steps, which are carried out in order.  A step may set names (``let``), repeat
itself over values (``for``), depend on a condition (``when``), hold steps of its own, and make one comparison: the keys
of `KINDS`, described in ``docs/explanation/stress.md``.  ``is`` holds what must come as it stands; ``right``,
``given``, ``that``, ``call``, ``let`` and ``for`` are Python expressions over the names that ``use`` imports, over
``math``, ``np``, ``mp`` (mpmath), ``Fraction``, and over the functions of Python files beside the data (``scripts``).
So a file of cases is a program: only the shipped ones are read, or one that the user names.

The id of a case is the list of theory/extreme-cases and the number of the row there: ``lambda-12.6`` is row 6 of the
list of the lambda linkage, ``platform-12.6`` and ``instruments-9.6`` are row 6 of the others.  Other numbers
stand for cases of other pages; ``beyond`` holds what no page asks for.
"""

from __future__ import annotations

import re
import runpy
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from string import Formatter
from typing import Any

from graphsynth.core.errors import SpecError
from graphsynth.evidence.stress.checks import Checks

#: First word of an id -> title of the page.
PAGES = {
    "lambda": "Lambda linkage and bearing jamming",
    "platform": "Parallel platform",
    "instruments": "Instruments and dynamics",
    "structure": "Structural synthesis",
    "beyond": "Beyond the lists",
}

_NUMBER = ("given", "is", "right", "relative", "absolute", "source")

#: Comparison -> the keys that go with it (see `graphsynth.evidence.stress.Checks`).
KINDS = {
    "value": _NUMBER,
    "values": _NUMBER,
    "below": ("given", "bound", "source"),
    "equals": ("given", "is", "right", "source"),
    "reports": ("given", "is", "right", "source"),
    "holds": ("that", "shown", "wanted", "source"),
    "mentions": ("given", "words", "source"),
    "refused": ("call", "words", "source"),
}
_CASE = {"id", "title", "about", "slow", "use", "step"}
_FILE = {"about", "use", "let", "scripts", "case"}
_STEP = {"for", "when", "digits", "let", "collect", "step"}


@dataclass(frozen=True)
class Case:
    """A stress case.

    Attributes
    ----------
    name : str
        Page and number, for example ``platform-12.5``.
    title : str
        The situation in a few words.
    slow : bool
        Takes more than about two seconds on one core.
    about : str
        What must come out, in a sentence.
    page_title : str
        Title of its page.
    """

    name: str
    title: str
    slow: bool = False
    about: str = ""
    page_title: str = ""
    path: Path = field(default=Path(), repr=False)
    steps: tuple[dict[str, Any], ...] = field(default=(), repr=False, compare=False)
    common: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def page(self) -> str:
        """First word of the name."""
        return self.name.partition("-")[0]

    def load(self) -> Callable[[Checks], None]:
        """Import what the case uses; return the function that carries it out."""
        import math
        from fractions import Fraction

        import mpmath
        import numpy as np

        names: dict[str, Any] = {"math": math, "np": np, "mp": mpmath.mp, "Fraction": Fraction}
        for script in self.common["scripts"]:
            names |= _functions(self.path.parent / script)
        for line in self.common["use"]:
            module, _, wanted = line.partition(":")
            found = import_module(module.strip())
            names |= {name.strip(): getattr(found, name.strip()) for name in wanted.split(",")}
        _let(self.common["let"], names)

        def run(checks: Checks) -> None:
            for step in self.steps:
                _carry_out(step, names, checks)

        return run


def read_cases(path: Path) -> list[Case]:
    """Read the cases of a TOML file; nothing of it is evaluated.

    A `SpecError` names file, case and key if the file cannot be read, or a case is written wrongly.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SpecError(f"cannot read stress cases from {path}: {error}") from error
    _only(document, _FILE, path.name)
    cases = []
    for k, table in enumerate(document.get("case", ())):
        where = f"{path.name}, case {table.get('id', k + 1)}"
        _only(table, _CASE, where)
        if lost := [key for key in ("id", "title", "step") if not table.get(key)]:
            raise SpecError(f"{where}: {' and '.join(lost)} missing; a case needs id, title and at least one step")
        if not re.fullmatch(r"[a-z]+-\d+(\.\d+)?", table["id"]):
            raise SpecError(f"{where}: an id is a word and a number, such as mine-1.2")
        for step in table["step"]:
            _check_step(step, where)
        common = {
            "use": [*document.get("use", ()), *table.get("use", ())],
            "let": document.get("let", {}),
            "scripts": document.get("scripts", ()),
        }
        title = PAGES.get(table["id"].partition("-")[0]) or document.get("about", "").strip() or path.stem
        about = " ".join(table.get("about", "").split())
        own = (table["id"], table["title"], table.get("slow", False), about, title)
        cases.append(Case(*own, path, tuple(table["step"]), common))
    return cases


def _only(table: dict[str, Any], allowed: Iterable[str], where: str) -> None:
    for key in table:
        if key not in allowed:
            near = get_close_matches(key, list(allowed), n=1)
            advice = f"did you mean {near[0]}?" if near else f"known are {', '.join(sorted(allowed))}"
            raise SpecError(f"{where}: unknown key {key!r}; {advice}")


def _check_step(step: dict[str, Any], where: str) -> None:
    kinds = [kind for kind in KINDS if kind in step]
    if len(kinds) > 1:
        raise SpecError(f"{where}: a step makes one comparison, not {' and '.join(kinds)}")
    _only(step, {*_STEP, *kinds, *(key for kind in kinds for key in KINDS[kind])}, where)
    for inner in step.get("step", ()):
        _check_step(inner, where)


@cache
def _shipped() -> tuple[Case, ...]:
    """All cases of the package, in the order of pages and numbers: from a wheel, else beside an editable checkout."""
    here = Path(__file__).resolve().parent
    for folder in (here.parent / "shipped_stress", here.parents[2] / "catalog" / "stress"):
        if folder.is_dir():
            return _in_order(case for path in sorted(folder.glob("*.toml")) for case in read_cases(path))
    raise SpecError(f"no folder with stress cases beside {here}; install graphsynth again")


def _in_order(cases: Iterable[Case]) -> tuple[Case, ...]:
    pages = list(PAGES)

    def place(case: Case) -> tuple[int, str, list[int]]:
        page, _, number = case.name.partition("-")
        known = pages.index(page) if page in PAGES else len(pages)
        return known, page, [int(part) for part in number.split(".")]

    found = sorted(cases, key=place)
    for one, other in pairwise(found):
        if one.name == other.name:
            raise SpecError(f"two stress cases are called {one.name}: in {one.path.name} and {other.path.name}")
    return tuple(found)


def stress_cases(names: Iterable[str] = (), *, slow: bool = True, files: Iterable[Path] = ()) -> tuple[Case, ...]:
    """Return the cases whose names are given, or that lie under a given page or section, in the order of the list.

    Parameters
    ----------
    names : iterable of str
        Full names or beginnings that end at a dash or a point: ``platform``, ``platform-12``, ``platform-12.5``.
        None: all.
    slow : bool
        With False, slow cases are left out unless one is named in full.
    files : iterable of Path
        Files of own cases, taken instead of the shipped ones.  Their expressions are evaluated when a case runs.

    Returns
    -------
    tuple of Case

    Raises
    ------
    SpecError
        A name that fits no case, or a file that holds no cases.

    Examples
    --------
    >>> [case.name for case in stress_cases(["structure-2"])]
    ['structure-2.1', 'structure-2.2', 'structure-2.3']
    """
    own = [case for path in files for case in read_cases(path)]
    cases = _in_order(own) if own else _shipped()
    wanted = list(names)

    def under(full: str, name: str) -> bool:
        return full == name or (full.startswith(name) and full[len(name)] in "-.")

    for name in wanted:
        if not any(under(case.name, name) for case in cases):
            pages = list(dict.fromkeys(case.page for case in cases))
            near = get_close_matches(name, [*pages, *(case.name for case in cases)], n=2)
            advice = f"did you mean {' or '.join(near)}?" if near else f"pages are {', '.join(pages)}"
            raise SpecError(f"no stress case is called {name!r}; {advice} (`graphsynth stress --list` shows all)")
    return tuple(
        case
        for case in cases
        if (not wanted or any(under(case.name, name) for name in wanted))
        and (slow or not case.slow or case.name in wanted)
    )


@cache
def _functions(path: Path) -> dict[str, Any]:
    return {name: value for name, value in runpy.run_path(str(path)).items() if not name.startswith("__")}


def _carry_out(step: dict[str, Any], names: dict[str, Any], checks: Checks) -> None:
    """Carry out a step; with ``for`` once for each set of values, whose names end with the step."""
    loops = step.get("for")
    scopes = [names] if loops is None else _scopes([loops] if isinstance(loops, str) else loops, names)
    for scope in scopes:
        if "when" in step and not _value(step["when"], scope):
            continue
        with scope["mp"].workdps(step["digits"]) if "digits" in step else nullcontext():
            _let(step.get("let", {}), scope)
            for name, expression in step.get("collect", {}).items():
                scope[name].append(_value(expression, scope))
            for kind in KINDS:
                if kind in step:
                    _compare(kind, step, scope, checks)
            for inner in step.get("step", ()):
                _carry_out(inner, scope, checks)


def _scopes(loops: list[str], names: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if not loops:
        yield dict(names)
        return
    targets, _, values = loops[0].partition(" in ")
    for value in _value(values, names):
        scope = dict(names)
        _bind(targets, value, scope)
        yield from _scopes(loops[1:], scope)


def _let(table: dict[str, Any], names: dict[str, Any]) -> None:
    for targets, expression in table.items():
        _bind(targets, _value(expression, names), names)


def _bind(targets: str, value: Any, names: dict[str, Any]) -> None:
    """Give the value the name, or its parts the names of ``a, b`` or ``(a, b), c``."""
    if targets.isidentifier():
        names[targets] = value
        return
    parts = re.findall(r"\w+", targets)
    found = ", ".join(f"{part!r}: {part}" for part in parts)
    names |= eval(f"next({{{found}}} for {targets} in (value__,))", {"value__": value})


def _compare(kind: str, step: dict[str, Any], names: dict[str, Any], checks: Checks) -> None:
    what = _text(step[kind], names)
    options: dict[str, Any] = {"source": _text(step.get("source", ""), names)}
    if kind == "refused":
        checks.refused(what, lambda: _value(step["call"], names), *_words(step, names), **options)
    elif kind == "mentions":
        checks.mentions(what, _value(step["given"], names), *_words(step, names), **options)
    elif kind == "holds":
        shown, wanted = _text(step.get("shown", ""), names), _text(step.get("wanted", "yes"), names)
        checks.holds(what, _value(step["that"], names), shown, wanted, **options)
    elif kind == "below":
        checks.below(what, _value(step["given"], names), _value(step["bound"], names), **options)
    else:
        for bound in ("relative", "absolute"):
            if bound in step:
                options[bound] = _value(step[bound], names)
        given = _value(step["given"], names)
        right = _like(step["is"], given) if "is" in step else _value(step["right"], names)
        getattr(checks, kind)(what, given, right, **options)


def _words(step: dict[str, Any], names: dict[str, Any]) -> list[str]:
    words = step["words"]
    return list(_value(words, names)) if isinstance(words, str) else [_text(word, names) for word in words]


def _like(right: Any, given: Any) -> Any:
    """Turn lists of the file into tuples where tuples are given."""
    if not isinstance(right, list):
        return right
    given_parts = given if isinstance(given, (list, tuple)) else ()
    parts = [_like(one, other) for one, other in zip(right, [*given_parts, *[None] * len(right)])]
    return tuple(parts) if isinstance(given, tuple) else parts


def _value(expression: Any, names: dict[str, Any]) -> Any:
    """Evaluate an expression; a number of the file is taken as it stands."""
    return eval(_compiled(expression), names) if isinstance(expression, str) else expression


@cache
def _compiled(expression: str) -> Any:
    return compile(f"({expression.strip()}\n)", "<stress case>", "eval")


def _text(template: str, names: dict[str, Any]) -> str:
    """Fill the fields ``{expression:format}`` of a text."""
    parts = []
    for plain, expression, form, conversion in Formatter().parse(template):
        parts.append(plain)
        if expression is not None:
            value = _value(expression, names)
            parts.append(format(repr(value) if conversion == "r" else value, form or ""))
    return "".join(parts)
