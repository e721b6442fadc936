"""``graphsynth show``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.cli import console
from graphsynth.core.errors import FormatError, GraphError, GraphsynthError, SpecError
from graphsynth.core.wholefiles import replacing

if TYPE_CHECKING:
    from graphsynth.structure.gear_trains import PlanetaryGearTrain
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.multiple_joints import MultipleJointChain
    from graphsynth.structure.slider_chains import SliderChain

#: Links up to which assembly modes and degrees of curves are told, which takes a second there.
_COUNTED = 16
#: Suffixes of pictures; see graphsynth.drawing.export.
PICTURES = (".svg", ".png", ".pdf", ".tikz", ".tex", ".dxf")


def run(options: argparse.Namespace) -> int:
    """Describe one graph, and draw it if asked."""
    if chain := read_special(options.graph, options.line):
        return _with_special_joints(chain, options)
    graph = read_graph(options.graph, options.line)
    if options.output:
        from graphsynth.formats.registry import FORMATS, write

        data = [suffix for entry in FORMATS.values() if entry.name != "toml" for suffix in entry.suffixes]
        check_place(options.output, (*PICTURES, *data))
    facts = _facts(graph, options.driver)
    if options.json:
        console.put_json(facts)
    else:
        rows: list[tuple[str, str]] = []
        for name, value in facts.items():
            lines = value if isinstance(value, list) and value and isinstance(value[0], str) else [value]
            plain = [("no", "yes")[line] if isinstance(line, bool) else str(line) for line in lines]
            rows += zip((name, *[""] * len(plain)), plain)
        console.facts(rows)
    if options.output and options.output.suffix.lower() in PICTURES:
        _draw(graph, options.output, options.view, options.driver)
    elif options.output:
        write(graph, options.output)
    return 0


def read_special(text: str, line: int = 1) -> PlanetaryGearTrain | MultipleJointChain | SliderChain | None:
    """Read a chain with multiple or prismatic joints, or a gear train, as `read_graph` does; None for other graphs."""
    row = _row(text, line)[0]
    text = row[9:].partition('"')[0] if row.startswith('{"key": "') else row
    if not re.search(r"^1m[0-9]| m[0-9]{1,3}$|^1[gp]\.| [GP]:", text):
        return None
    from graphsynth.structure.gear_trains import PlanetaryGearTrain
    from graphsynth.structure.multiple_joints import MultipleJointChain
    from graphsynth.structure.slider_chains import SliderChain

    kinds: dict[str, type[PlanetaryGearTrain | SliderChain]] = {"g": PlanetaryGearTrain, "p": SliderChain}
    letter = next((letter for letter in kinds if text.startswith(f"1{letter}.") or f" {letter.upper()}:" in text), "m")
    kind = kinds.get(letter, MultipleJointChain)
    return kind.from_text(text) if " " in text else kind.from_key(text)


def _with_special_joints(
    chain: PlanetaryGearTrain | MultipleJointChain | SliderChain, options: argparse.Namespace
) -> int:
    """Describe and draw a chain with multiple or prismatic joints, or a planetary gear train."""
    from graphsynth.structure.gear_trains import PlanetaryGearTrain
    from graphsynth.structure.modes import count_assembly_modes
    from graphsynth.structure.multiple_joints import MultipleJointChain

    geared = isinstance(chain, PlanetaryGearTrain)
    if options.output:
        check_place(options.output, PICTURES)
        chain.draw(options.output, **({"title": chain.key} if geared else {"driver": options.driver}))
    joints = chain.axes if isinstance(chain, PlanetaryGearTrain) else chain.joints
    facts: dict[str, Any] = {
        "key": chain.key,
        "text": chain.to_text(),
        "links": chain.links,
        "axes" if geared else "joints": " ".join("-".join(map(str, joint)) for joint in joints),
        "mobility": chain.mobility,
        "automorphisms": chain.automorphism_order,
    }
    if isinstance(chain, MultipleJointChain):
        if chain.mobility > 1:
            facts["type of mobility"] = chain.mobility_type
        elif (frame := chain.frame) is not None and chain.links <= _COUNTED:
            driven = [link for link in range(chain.links) if chain.neighbours[frame] >> link & 1]
            modes = (f"{count_assembly_modes(chain, [link])} at most with driver {link}" for link in driven)
            facts["assembly modes"] = ", ".join(modes)
    if isinstance(chain, PlanetaryGearTrain):
        facts["gear pairs"] = ", ".join(f"{a}-{b} on {carrier}" for a, b, carrier in chain.gears)
        ways = chain.arrangements(coaxial=True)
        facts["input, output, fixed"] = " ".join("-".join(map(str, way)) for way in ways) or "none on one axis"
    if options.json:
        console.put_json(facts)
    else:
        console.facts([(name, str(value)) for name, value in facts.items()])
    return 0


def check_place(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that cannot be written before any work is done."""
    if path.suffix.lower() not in suffixes:
        raise GraphsynthError(f"{path} must end in {', '.join(suffixes[:-1])} or {suffixes[-1]}")
    if not path.parent.is_dir():
        raise GraphsynthError(f"{path}: the folder {path.parent} does not exist; make it first")
    if path.is_dir():
        raise GraphsynthError(f"{path} is a folder; name a file")


def read_graph(text: str, line: int = 1) -> MechanismGraph:
    """Read a canonical key, a text form, or graph ``line`` of a file of any format.

    Files of an unknown suffix hold a key, a text form or a JSON record on each line.
    """
    from graphsynth.structure.graph import MechanismGraph

    if _is_whole(text):
        from graphsynth.formats.registry import read

        item = read(text, number=line)
        return item if isinstance(item, MechanismGraph) else item.graph
    row, place = _row(text, line)
    if place:
        return _one(row, place)
    if text.startswith("1") and " " not in text:
        return MechanismGraph.from_key(text)
    try:
        return _one(text, "")
    except FormatError as error:
        if set(text) & {"/", "."}:  # never part of a key or a text form
            raise FormatError("there is no such file, nor is this a key or the text form of a graph", text) from None
        raise FormatError(f"no such file, and no text form of a graph: {error}", text) from None


def _is_whole(text: str) -> bool:
    """Tell whether a text names a file that is no file of lines."""
    if len(text) >= 1000 or not Path(text).is_file():
        return False
    from graphsynth.formats.registry import FORMATS

    return any(Path(text).suffix.lower() in entry.suffixes for entry in FORMATS.values() if not entry.line)


def _row(text: str, line: int) -> tuple[str, str]:
    """Return a line of the file of lines that a text names, and where it stands; of another text, the text alone."""
    if len(text) >= 1000 or not Path(text).is_file() or _is_whole(text):
        return text, ""
    from graphsynth.formats.registry import LINE_MAX

    count = 0
    with Path(text).open("rb") as file:
        while row := file.readline(LINE_MAX + 1):
            count += 1
            if len(row) > LINE_MAX:
                raise FormatError(
                    f"more than {LINE_MAX} bytes on one line; no graph is so long", f"{text} line {count}"
                )
            if count == line:
                return row.decode(errors="replace").strip(), f"{text} line {line}"
    raise FormatError(f"line {line} does not exist, the file has {count}: choose another --line", text)


def _one(text: str, place: str) -> MechanismGraph:
    from graphsynth.formats.plain import parse_jsonl
    from graphsynth.structure.graph import MechanismGraph

    if text.startswith("{"):
        return parse_jsonl(text, place)
    try:
        return MechanismGraph.from_key(text) if text.startswith("1") else MechanismGraph.from_text(text)
    except FormatError as error:
        raise FormatError(str(error), place) from None


def _facts(graph: MechanismGraph, driver: int | None) -> dict[str, Any]:
    facts: dict[str, Any] = {
        "key": graph.key,
        "text": graph.to_text(),
        "links": graph.links,
        "joints": " ".join(f"{a}-{b}" + (f":{f}" if f > 1 else "") for a, b, f in graph.joints),
        "mobility": graph.mobility,
        "loops": graph.loops,
        "assortment": " ".join(f"n{a}={count}" for a, count in graph.assortment.items()),
        "planar graph": graph.is_planar,
        "fractionated": graph.is_fractionated,
        "automorphisms": graph.automorphism_order,
        "link orbits": _sets(graph.orbits),
        "rigid sub-chain": str(graph.rigid_subchain() or "none"),
    }
    if graph.mobility > 1 and facts["rigid sub-chain"] == "none":
        facts["type of mobility"] = graph.mobility_type
    if graph.frame is None:
        if driver is not None:
            raise SpecError("--driver needs a mechanism: choose a frame first (text form '... f0')")
        if graph.mobility == 0 and _is_revolute(graph):
            from graphsynth.structure.modes import count_assembly_modes

            facts["assembly modes"] = f"{count_assembly_modes(graph)} at most"
        return facts
    facts["levels"] = _sets(graph.levels)
    if facts["rigid sub-chain"] == "none":
        facts["Assur groups"] = _groups(graph, driver)
        if graph.mobility == 1 and _is_revolute(graph):
            facts["coupler curves"] = _curves(graph)
    return facts


def _is_revolute(graph: MechanismGraph) -> bool:
    """Whether assembly modes are counted: in the plane, with joints of mobility 1, few links."""
    return graph.space == 3 and graph.links <= _COUNTED and all(joint.mobility == 1 for joint in graph.joints)


def _curves(graph: MechanismGraph) -> str:
    """Say of which degree and genus the curves of each moving link are."""
    from graphsynth.structure.modes import coupler_curve_degree, coupler_curve_genus

    links: dict[tuple[int, int], list[str]] = {}
    for link in (own for own in range(graph.links) if own != graph.frame):
        links.setdefault((coupler_curve_degree(graph, link), coupler_curve_genus(graph, link)), []).append(str(link))
    kinds = sorted(links.items())
    return "; ".join(f"degree {degree}, genus {genus}: links {', '.join(own)}" for (degree, genus), own in kinds)


def _groups(graph: MechanismGraph, driver: int | None) -> list[str]:
    """Say how the mechanism is assembled, for one driven link or for every link jointed to the frame."""
    if graph.mobility != 1 and driver is None:
        return [f"{graph.mobility} drivers needed: not listed"]
    if driver is not None:
        if driver not in graph.levels[1]:
            raise GraphError(f"driver {driver} is not jointed to the frame; choose one of {_sets(graph.levels[1:2])}")
        needed = f"one of {graph.mobility} drivers needed, groups not listed"
        return [f"driver {driver}: {_assembled(graph, driver) if graph.mobility == 1 else needed}"]
    lines = []
    for link in graph.levels[1]:
        try:
            lines.append(f"driver {link}: {_assembled(graph, link)}")
        except GraphError as error:
            lines.append(f"driver {link}: {error}")
    return lines


def _assembled(graph: MechanismGraph, driver: int) -> str:
    """Say how the mechanism is assembled with this driver, and in how many ways."""
    from graphsynth.structure.assur import decompose
    from graphsynth.structure.modes import count_assembly_modes

    groups = str(decompose(graph, [driver]))
    return f"{groups}; {count_assembly_modes(graph, [driver])} assembly modes" if _is_revolute(graph) else groups


def _sets(sets: Iterable[tuple[int, ...]]) -> str:
    return " ".join("{" + ",".join(map(str, links)) + "}" for links in sets)


def _draw(graph: MechanismGraph, path: Path, view: str | None, driver: int | None) -> None:
    """Draw the kinematic diagram, the graph by levels, or both side by side."""
    from graphsynth.drawing.export import save
    from graphsynth.drawing.graphs import graph_sketch, levels_sketch
    from graphsynth.drawing.sketch import Sketch

    drawn: list[tuple[Sketch, list[tuple[float, float, float]] | None]] = []
    if view != "levels":
        try:
            drawn.append(graph_sketch(graph, driver=driver, title=graph.key))
        except GraphError as error:
            if view is not None:
                raise
            console.note(f"{error}; drawn by levels instead")
    if view in ("levels", "both") or not drawn:
        framed = graph if graph.frame is not None else graph.with_frame(0)
        drawn.append((levels_sketch(framed, title=graph.key), None))
    with replacing(path) as fresh:
        save(fresh, [sketch for sketch, _ in drawn], [pose for _, pose in drawn])
