"""What several verbs share: the structural question, shards, numbers of processes, ranges of numbers."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from graphsynth.structure.system.spec import StructuralSpec
    from graphsynth.synthesis.problem import EnumerationProblem
    from graphsynth.synthesis.wishes import Wishes

_VARIABLES = {
    "mobility": ("W", "mobility"),
    "space": ("Pi", "mobility of the space (default 3, the plane)"),
    "links": ("N", "links, the frame included"),
    "moving-links": ("n", "moving links"),
    "joints": ("p", "joints"),
    "loops": ("v", "independent loops"),
    "frame-loops": ("v_ct", "loops through the frame"),
    "moving-loops": ("v_P", "loops among moving links"),
    "frame-joints": ("t0", "joints on the frame"),
    "sub-edges": ("G", "sub-edges"),
}
_KINDS = [*(f"p{i}" for i in range(1, 6)), *(f"n{a}" for a in range(2, 10))]
_MOST_NUMBERS = 300
_OF_CHAINS = {"W", "Pi", "N", "p1", "p2", "p3", "p4", "p5"}


def add_question(parser: argparse.ArgumentParser) -> None:
    """Add the options that state a structural question."""
    group = parser.add_argument_group("structural question", "each X is a number, or a range such as 0..2 or 3..")
    for name, (symbol, meaning) in _VARIABLES.items():
        group.add_argument(f"--{name}", f"--{symbol}", dest=f"var_{symbol}", metavar="X", help=meaning)
    for kind in _KINDS:
        meaning = f"joints of mobility {kind[1:]}" if kind[0] == "p" else f"moving links with {kind[1:]} joints"
        group.add_argument(f"--{kind}", dest=f"var_{kind}", metavar="X", help=meaning)
    group.add_argument("--spec", type=Path, metavar="FILE", help="read the question from a TOML file")
    group.add_argument("--set", action="append", default=[], metavar="NAME=X", help="any variable or option by name")
    group.add_argument("--fractionated", action="store_true", help="include fractionated chains (mobility >= 2)")


def _given(options: argparse.Namespace) -> dict[str, str]:
    """Return the variables of the question that have a value, by symbol."""
    return {name[4:]: value for name, value in vars(options).items() if name.startswith("var_") and value is not None}


def spec_of(options: argparse.Namespace) -> StructuralSpec:
    """Return the question; options on the command line add to the file, or replace what it says."""
    from graphsynth.structure.system.spec import StructuralSpec

    assignments = [f"{symbol}={value}" for symbol, value in _given(options).items()] + options.set
    if options.fractionated:
        assignments.append("fractionated=true")
    if options.spec is None:
        return StructuralSpec.from_assignments(assignments)
    question = StructuralSpec.from_toml(options.spec).as_dict()
    question.update(StructuralSpec.from_assignments(assignments).as_dict() if assignments else {})
    return StructuralSpec(**question)


def problem_of(options: argparse.Namespace, *, counted: bool = False) -> EnumerationProblem:
    """Return what ``count`` and ``enumerate`` are asked to do."""
    wishes = _wishes(options)
    return _problem(options, counted=counted and wishes is None).wishing(wishes)


def _wishes(options: argparse.Namespace) -> Wishes | None:
    """Return what chains are to be like as a whole, None for anything."""
    names = ("girth", "jointed", "apart", "contains", "without", "planar", "mobility_type")
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    if not given:
        return None
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.synthesis.wishes import Wishes

    for name in {"jointed", "apart"} & set(given):
        pairs = [text.split("-") for text in given[name]]
        given[name] = [[int(role) if role.isdecimal() else role for role in pair] for pair in pairs]
    for name in {"contains", "without"} & set(given):
        given[name] = [MechanismGraph.from_text(text) for text in given[name]]
    if "planar" in given:
        given["planar"] = given["planar"] == "yes"
    return Wishes(**given)


def _problem(options: argparse.Namespace, *, counted: bool) -> EnumerationProblem:
    from graphsynth.synthesis.problem import EnumerationProblem

    given = _given(options)
    if options.assur is not None or options.truss is not None:
        if options.assur is not None and options.truss is not None:
            raise SpecError("--assur and --truss ask for different things: give one of them")
        if options.symmetry:
            raise SpecError("--symmetry is for chains and mechanisms; --assur and --truss have none: leave it out")
        space = given.pop("Pi", "3")
        if given or options.spec or options.set or options.frame or options.fractionated:
            raise SpecError(
                f"--assur N and --truss N take no other part of a question than --space "
                f"(given: {', '.join(sorted(given)) or 'more'}): leave the rest out"
            )
        if not space.isdecimal():
            raise SpecError(f"Pi = {space} must be a whole number from 2 to 6")
        links = options.truss if options.assur is None else options.assur + 1
        return EnumerationProblem.trusses(links, int(space), options.assur is not None)
    special = special_of(options)
    if special:
        return _with_special_joints(options, given, special)
    if options.frame or options.spec or options.set or set(given) - _OF_CHAINS:
        spec = spec_of(options)
        if spec.bounds("W") == (None, None) and "p" not in spec.ranges:
            spec = spec.replace(W=1)  # the default of chains
        return EnumerationProblem.mechanisms(spec, options.symmetry)
    for symbol, text in given.items():
        if not text.isdecimal():
            raise SpecError(f"{symbol} = {text} must be a whole number for chains; with --frame it may be a range")
    if "N" not in given:
        raise SpecError("the number of links is missing: give --links N, or a question with a frame (see --help)")
    asked = {symbol: int(text) for symbol, text in given.items()}
    joints = {int(symbol[1:]): count for symbol, count in asked.items() if symbol[0] == "p"}
    plane, mobility = asked.get("Pi", 3), asked.get("W", 1)
    numbers = asked["N"], mobility, plane, joints, options.fractionated, options.symmetry
    return EnumerationProblem.chains(*numbers, counted=counted)


def special_of(options: argparse.Namespace) -> str:
    """Return the option that asks for other joints or gears, also where only what goes with it is given."""
    asked = {
        "multiple-joints": options.multiple_joints is not None,
        "sliders": options.sliders is not None or options.cylinders or options.sliding_links or options.sliding_loops,
        "gear-trains": options.gear_trains or options.rotation_graphs or options.drive,
    }
    names = [name for name, wanted in asked.items() if wanted]
    if len(names) > 1:
        raise SpecError(f"--{names[0]} and --{names[1]} ask for different things: give one of them")
    return "".join(names)


def _with_special_joints(options: argparse.Namespace, given: dict[str, str], name: str) -> EnumerationProblem:
    """Return the question of chains with multiple or prismatic joints, or of gear trains."""
    from graphsynth.synthesis.problem import EnumerationProblem

    others = sorted(set(given) - {"N", "W"})
    if others or options.spec or options.set or options.fractionated or options.symmetry or "N" not in given:
        raise SpecError(
            f"--{name} takes --links, --mobility and --frame, and needs --links (given besides: "
            f"{', '.join(others) or 'more'}): leave the rest out"
        )
    numbers = {"multiple-joints": options.multiple_joints, "sliders": options.sliders}
    number = numbers.get(name, "1" if options.gear_trains else None)
    if number is None:
        raise SpecError(f"what is asked besides goes with --{name}{' K' * (name == 'sliders')}: give that, too")
    any_number = number == "any" and name == "multiple-joints"
    for text in (given["N"], given.get("W", "1"), "1" if any_number else number):
        if not text.isdecimal():
            raise SpecError(f"{text or 'nothing'} must be a whole number for chains with --{name}")
    links, mobility = int(given["N"]), int(given.get("W", "1"))
    if name == "sliders":
        loose = options.sliding_links, options.sliding_loops, options.cylinders, options.frame
        return EnumerationProblem.sliders(links, int(number), mobility, *loose)
    if name == "gear-trains":
        roles = {"rotation": options.rotation_graphs, "framed": options.frame, "drive": options.drive}
        return EnumerationProblem.gear_trains(links, mobility, **roles)
    multiple = None if any_number else int(number)
    return EnumerationProblem.multiple_joints(links, mobility, multiple, framed=options.frame)


def shard(text: str) -> tuple[int, int]:
    """Read I/M."""
    try:
        i, m = map(int, text.split("/"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} must be I/M, for example 3/16") from None
    if m < 1 or not 1 <= i <= m:
        raise argparse.ArgumentTypeError(f"{text!r} must be I/M with 1 <= I <= M")
    return i, m


def workers(text: str) -> int:
    """Read a number of processes."""
    try:
        count = int(text)
    except ValueError:
        count = 0
    if not 1 <= count <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number from 1 to 1024")
    return count


def numbers(text: str) -> list[int]:
    """Read '8' or '4..12'."""
    low, dots, high = text.partition("..")
    try:
        first, last = int(low), int(high if dots else low)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} must be a number or N..M, for example 4..12") from None
    if not 1 <= first <= last < _MOST_NUMBERS:
        raise argparse.ArgumentTypeError(f"{text!r} must be N..M with 1 <= N <= M < {_MOST_NUMBERS}")
    return list(range(first, last + 1))


def limit(text: str) -> int:
    """Read a number that may be 0."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number, 0 or more")
    return int(text)
