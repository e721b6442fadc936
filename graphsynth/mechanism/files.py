"""Mechanisms as TOML and JSON; the round trip is exact.

Floats are written with ``repr``, the shortest text that reads back as the same double.  Readers accept any text or
bytes and raise nothing but `FormatError`, whose place is the line or the key; a text too long to be read within a
second is refused before it is read.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any, TypeVar

from graphsynth.core.checks import checked
from graphsynth.core.errors import FormatError, GeometryError
from graphsynth.core.textfiles import json_value, text_of, toml_tables
from graphsynth.mechanism.joints import KINDS, JointGeometry
from graphsynth.mechanism.laws import LAWS, Driver, Linear
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

__all__ = ["JSON_MAX", "TOML_MAX", "from_dict", "from_json", "from_toml", "to_dict", "to_json", "to_toml"]

FORMAT = "graphsynth mechanism"
VERSION = 1
_KEYS = {"format", "version", "graph", "joints", "drivers", "points", "pose", "input_range", "link_names"}
#: Longest JSON text that is read, in characters.
JSON_MAX = 3_000_000
TOML_MAX = 400_000  #: Longest TOML text that is read, in characters.
_T = TypeVar("_T")


@checked
def to_dict(mechanism: Mechanism) -> dict[str, Any]:
    """Return plain lists, numbers and texts that describe a mechanism.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    dict
        What :func:`from_dict` reads back without loss.

    Raises
    ------
    GeometryError
        If a driver has a law that is not one of :mod:`graphsynth.mechanism.laws`.
    """
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION, "graph": mechanism.graph.to_text()}
    if mechanism.pose is not None:
        data["pose"] = [list(row) for row in mechanism.pose]
    if mechanism.input_range is not None:
        data["input_range"] = list(mechanism.input_range)
    if mechanism.link_names:
        data["link_names"] = dict(mechanism.link_names)
    data["joints"] = [{"kind": joint.kind, **_plain(joint)} for joint in mechanism.joints]
    data["drivers"] = []
    for driver in mechanism.drivers:
        law, kind = driver.law, getattr(driver.law, "kind", None)
        if not isinstance(kind, str) or type(law) is not LAWS.get(kind):
            raise GeometryError(
                f"the law {law!r} of driver {driver.base}-{driver.link} cannot be written; use a Table of its values"
            )
        data["drivers"].append({"base": driver.base, "link": driver.link, "law": {"kind": kind, **_plain(law)}})
    data["points"] = {name: {"link": p.link, "at": list(p.at)} for name, p in mechanism.points.items()}
    return data


def _plain(value: Any) -> dict[str, Any]:
    found = {item.name: getattr(value, item.name) for item in fields(value)}
    return {name: list(part) if isinstance(part, tuple) else part for name, part in found.items()}


@checked
def to_json(mechanism: Mechanism) -> str:
    """Write JSON, indented, with a final line end.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    str
        What :func:`from_json` reads back without loss.
    """
    return json.dumps(to_dict(mechanism), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


@checked
def to_toml(mechanism: Mechanism) -> str:
    """Write TOML: one table per joint, driver and point.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    str
        What :func:`from_toml` reads back without loss.
    """
    data = to_dict(mechanism)
    lines = [
        f"{key} = {_toml(data[key])}" for key in ("format", "version", "graph", "pose", "input_range") if key in data
    ]
    lines += [f"{key} = []" for key in ("joints", "drivers") if not data[key]]
    for key in ("joints", "drivers"):
        for entry in data[key]:
            lines += ["", f"[[{key}]]", *(f"{name} = {_toml(value)}" for name, value in entry.items())]
    if "link_names" in data:
        lines += ["", "[link_names]", *(f"{_toml(name)} = {link}" for name, link in data["link_names"].items())]
    if data["points"]:
        lines += ["", "[points]", *(f"{_toml(name)} = {_toml(p)}" for name, p in data["points"].items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {_toml(part)}" for name, part in value.items()) + " }"
    return "[" + ", ".join(map(_toml, value)) + "]"


def _decoded(text: str | bytes, most: int, name: str) -> str:
    if not isinstance(text, str | bytes):
        raise FormatError(f"{type(text).__name__} is neither text nor bytes; give the content of a file")
    if len(text) > most:
        raise FormatError(f"{len(text)} characters; a mechanism in {name} is read up to {most}", "length")
    return text_of(text)


def from_json(text: str | bytes) -> Mechanism:
    """Read JSON; anything that is not a mechanism is a `FormatError` with the line or key.

    Parameters
    ----------
    text : str or bytes
        Bytes are UTF-8.

    Returns
    -------
    Mechanism
    """
    return from_dict(json_value(_decoded(text, JSON_MAX, "JSON")))


def from_toml(text: str | bytes) -> Mechanism:
    """Read TOML; anything that is not a mechanism is a `FormatError` with the line or key.

    Parameters
    ----------
    text : str or bytes
        Bytes are UTF-8.

    Returns
    -------
    Mechanism
    """
    return from_dict(toml_tables(_decoded(text, TOML_MAX, "TOML")))


def from_dict(data: Any) -> Mechanism:
    """Build a mechanism from what :func:`to_dict` returns; `FormatError` with the key for anything else.

    Parameters
    ----------
    data : mapping
        Tables as in a file, see ``docs/reference/mechanism.md``.

    Returns
    -------
    Mechanism
    """
    try:
        return _mechanism(data)
    except RecursionError:  # values nested deeper than a message can show
        raise FormatError("the values are nested too deep", "top level") from None


def _mechanism(data: Any) -> Mechanism:
    table = _table(data, "top level", _KEYS, {"format", "version", "graph", "joints"})
    if table["format"] != FORMAT:
        raise FormatError(f"found {_shown(table['format'])}, expected {FORMAT!r}", "format")
    if table["version"] != VERSION or isinstance(table["version"], bool):
        raise FormatError(f"found {_shown(table['version'])}, this program reads version {VERSION}", "version")
    if not isinstance(table["graph"], str):
        raise FormatError("expected the text form of a graph", "graph")
    try:
        graph = MechanismGraph.from_text(table["graph"])
    except FormatError as error:
        raise FormatError(str(error), "graph") from error
    most = len(graph.joints)
    joints = [_joint(entry, f"joints[{k}]") for k, entry in _entries(table["joints"], "joints", most)]
    drivers = [_driver(entry, f"drivers[{k}]") for k, entry in _entries(table.get("drivers", []), "drivers", most)]
    named = table.get("points", {})
    if not isinstance(named, dict):
        raise FormatError("expected a table of points", "points")
    points = {}
    for name, entry in named.items():
        try:
            name.encode()
        except UnicodeEncodeError:
            raise FormatError(f"the name {name[:24]!r} holds half a character", "points") from None
        own = _table(entry, f"points.{name[:24]}", {"link", "at"}, {"link", "at"})
        points[name] = TracePoint(own["link"], own["at"])
    pose = table.get("pose")
    if pose is not None:
        pose = tuple(tuple(_list(row, f"pose[{k}]")) for k, row in _entries(pose, "pose", graph.links))
    more = {key: table[key] for key in ("input_range", "link_names") if key in table}
    return _build(lambda: Mechanism(graph, tuple(joints), tuple(drivers), points, pose, **more), "mechanism")


def _build(make: Callable[[], _T], place: str) -> _T:
    try:
        return make()
    except GeometryError as error:
        said = str(error)
        raise FormatError(said if len(said) <= 240 else f"{said[:160]} ... {said[-60:]}", place) from None


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, str | int | float) else type(value).__name__
    return text if len(text) <= 40 else f"{text[:36]} ..."


def _entries(value: Any, place: str, most: int) -> Iterator[tuple[int, Any]]:
    """Return the numbered entries of a list; refuse too many before any is looked at."""
    if len(_list(value, place)) > most:
        raise FormatError(f"{len(value)} entries; the graph takes at most {most}", place)
    return enumerate(value)


def _list(value: Any, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise FormatError(f"expected a list, found {type(value).__name__}", place)
    return value


def _table(value: Any, place: str, known: set[str], needed: set[str]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise FormatError(f"expected a table, found {type(value).__name__}", place)
    unknown = sorted(set(value) - known)
    if unknown:
        raise FormatError(f"unknown key {_shown(unknown[0])}; known are {', '.join(sorted(known))}", place)
    missing = sorted(needed - set(value))
    if missing:
        raise FormatError(f"key {missing[0]!r} is missing", place)
    return value


def _kind(value: Any, place: str, known: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    if not isinstance(value, dict) or not isinstance(value.get("kind"), str) or value["kind"] not in known:
        raise FormatError(f"expected a table with kind = one of {', '.join(known)}", place)
    made = known[value["kind"]]
    names = {item.name for item in fields(made)}
    return made, {k: v for k, v in _table(value, place, names | {"kind"}, set()).items() if k != "kind"}


def _joint(value: Any, place: str) -> JointGeometry:
    made, parts = _kind(value, place, KINDS)
    _table(value, place, set(value), {"a", "b"})
    joint: JointGeometry = _build(lambda: made(**parts), place)
    return joint


def _driver(value: Any, place: str) -> Driver:
    table = _table(value, place, {"base", "link", "law"}, {"base", "link"})
    law = Linear()
    if "law" in table:
        made, parts = _kind(table["law"], f"{place}.law", LAWS)
        try:
            law = _build(lambda: made(**parts), f"{place}.law")
        except TypeError as error:  # a table law without its values
            needed = ", ".join(item.name for item in fields(made))
            raise FormatError(f"a law of this kind needs {needed}", f"{place}.law") from error
    return _build(lambda: Driver(table["base"], table["link"], law), place)
