"""Every verb with its options; imports nothing that computes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import graphsynth
from graphsynth.cli.console import note
from graphsynth.cli.question import add_question, limit, numbers, shard, workers

USAGE_ERROR = 2
#: Tilt that every joint takes up by default, degrees.
JOINT_LIMIT = 0.3

Option = tuple[list[str], dict[str, Any]]


def _option(names: str, meaning: str, kind: Callable[[str], Any] | None = None, **more: Any) -> Option:
    """Read ``"-o --output FILE"``, an option with a value, ``"--force"``, one without, or ``"FILE"``, an argument."""
    *flags, last = names.split()
    if last.startswith("-"):
        return [*flags, last], {"help": meaning, **(more or {"action": "store_true"})}
    return flags or [more.pop("dest")], {"help": meaning, "metavar": last} | ({"type": kind} if kind else {}) | more


_SCENE = _option("SCENE", "name of a shipped scene, or a TOML file of a scene or a question", dest="scene")
_SHARD = _option("--shard I/M", "do only shard I of M (1 <= I <= M)", shard)
_WORKERS = _option("--workers K", "worker processes (default: one; all for big work)", workers)
_PROPORTION = "; in proportion by default"
_SIZES = (
    _option("--thickness MM", f"thickness of the sheet{_PROPORTION}", float),
    _option("--pin MM", f"diameter of the pins{_PROPORTION}", float),
    _option("--hole MM", f"diameter of the holes{_PROPORTION}", float),
    _option("--wall MM", f"material around a hole{_PROPORTION}", float),
    _option("--clearance MM", f"least gap between parts of one layer{_PROPORTION}", float),
    _option("--washer MM", f"thickness of the washers between layers{_PROPORTION}", float),
)
_FORMS = ("svg", "dxf", "stl", "step", "csv")
_WORK = (
    _option("--frame", "choose a frame: mechanisms instead of chains"),
    _option("--assur N", "Assur groups with N moving links instead of chains", int),
    _option("--truss N", "Baranov trusses with N links instead of chains", int),
    _option("--multiple-joints K", "chains with K multiple joints (pins with three links or more), or any", str),
    _option("--sliders K", "chains with K prismatic joints beside revolute ones", str),
    _option("--cylinders", "of sliders: each is that of a cylinder, two binary links"),
    _option("--sliding-links", "of sliders: allow links with prismatic joints only"),
    _option("--sliding-loops", "of sliders: allow loops with fewer than two revolute joints"),
    _option("--gear-trains", "planetary gear trains"),
    _option("--rotation-graphs", "of gear trains: one of each rotation graph"),
    _option("--drive AXES", "of gear trains: choose input and output, too, any or coaxial", str),
    _option("--symmetry P", "require an automorphism of prime order P", int),
    _option("--girth G", "only chains whose loops have G joints or more", int),
    _option("--jointed A-B", "with a joint between links of A and B joints (or frame)", action="append", metavar="A-B"),
    _option("--apart A-B", "without a joint between such links", action="append", metavar="A-B"),
    _option("--contains TEXT", "that hold this graph (text form)", action="append", metavar="TEXT"),
    _option("--without TEXT", "that do not hold it", action="append", metavar="TEXT"),
    _option("--planar YES|NO", "planar graphs, or those that are not", choices=("yes", "no")),
    _option("--mobility-type T", "total, partial or fractionated", str),
    _SHARD,
    _WORKERS,
)

#: Summary and options of every verb; those of `_ASKING` state a structural question before.
_VERBS: dict[str, tuple[str, *tuple[Option, ...]]] = {
    "solve": ("Print all integer solutions of the structural system.",),
    "count": (
        "Count chains or mechanisms without listing them.",
        *_WORK,
        _option("--checkpoint FILE", "remember what is counted, and go on from there", Path),
    ),
    "enumerate": (
        "List every chain or mechanism, each once.",
        *_WORK,
        _option("-o --output FILE", ".g6 or .txt: text form; .jsonl: JSON lines", Path),
        _option("--resume", "go on with an interrupted FILE"),
        _option("--force", "replace FILE; list even what may not fit the disk"),
        _option("--sample K", "K of them at random instead, each as likely as any other", int),
        _option("--seed S", "of the sample (default 0)", int, default=0),
    ),
    "show": (
        "Describe one chain or mechanism.",
        _option("KEY|TEXT|FILE", "canonical key, text form (graph6 ...), or a file of them", dest="graph"),
        _option("--line N", "line of FILE (default 1)", int, default=1),
        _option("--driver LINK", "driven link: give the Assur groups for it only", int),
        _option("-o --output FILE", "draw it: FILE.svg, .png or .pdf", Path),
        _option(
            "--view", "kinematic diagram (default), graph by levels, or both", choices=("diagram", "levels", "both")
        ),
    ),
    "convert": (
        "Write the graphs and mechanisms of a file in another format.",
        _option("FILE|-", "file of any format; - is standard input", dest="source"),
        _option("-o --output FILE|-", "file to write; - is standard output", required=True),
        _option("--from FORMAT", "format of the input, if not by suffix", dest="source_format"),
        _option("--to FORMAT", "format of the output, if not by suffix", dest="target_format"),
        _option("--graphs", "of mechanisms, write the graphs only"),
        _option("--force", "replace FILE"),
    ),
    "animate": (
        "Give a candidate dimensions and make a moving picture of it.",
        _option(
            "KEY|TEXT|MECHANISM.toml",
            "canonical key, text form, or a file of them; or a dimensioned mechanism (.toml, .json)",
            dest="mechanism",
        ),
        _option("--line N", "line of a file of graphs (default 1)", int, default=1),
        _option(
            "-o --output FILE", "FILE.html (default mechanism.html), .gif or .svg", Path, default=Path("mechanism.html")
        ),
        _option("--driver LINK", "driven link on the frame (once for each driver)", int, action="append"),
        _option("--seed S", "of the search for dimensions (default 0)", int, default=0),
        _option("--frames N", "pictures of one pass (default 120, GIF 60)", int),
        _option("--range", "inputs of MECHANISM.toml, radians or lengths", type=float, nargs=2, metavar=("A", "B")),
        _option("--save FILE", "keep the mechanism found: FILE.toml or .json", Path),
    ),
    "workbench": (
        "Write the page on which mechanisms are drawn and dragged; it opens from a disk.",
        _option(
            "MECHANISM",
            "what lies on the table: a dimensioned mechanism (.toml, .json), the name of a classic one, or the key or "
            "text form of a graph, for which dimensions are found",
            dest="mechanism",
            nargs="?",
        ),
        _option("-o --output PLACE", "folder (default workbench), or with --single FILE.html", Path),
        _option("--single", "write one file instead of a folder"),
        _option("--seed S", "of the search for dimensions (default 0)", int, default=0),
    ),
    "parts": (
        "Make parts of a dimensioned mechanism: layers without collisions, drawings to cut, bill of parts.",
        _option("MECHANISM", "a dimensioned mechanism (.toml, .json), or the name of a classic one", dest="mechanism"),
        _option("-o --output --out FOLDER", "folder for the files (default parts)", Path, default=Path("parts")),
        _option("--unit MM", "millimetres of one unit of length (default 1)", float, default=1.0),
        _option(
            "--range", "inputs, radians or lengths (default: all it reaches)", type=float, nargs=2, metavar=("A", "B")
        ),
        *_SIZES,
        _option("--form FORM", "what to write, once for each (default svg and csv)", action="append", choices=_FORMS),
    ),
    "run": (
        "Run a scene: from the question to a report.",
        _SCENE,
        _option("-o --output --out DIR", "report folder (default graphsynth-out/SCENE)", Path),
        _option("--workers K", "processes (default: all cores for a stream)", workers),
        _option("--fresh", "start anew, do not go on with an interrupted run in DIR"),
        _option("--explain", "print what ran and why, what did not, imports, time and memory"),
    ),
    "design": (
        "Find mechanisms that do a task: ranked answers, a report, a file of each mechanism.",
        _option("TASK", "name of a shipped scene of module 'design', or a TOML file", dest="scene"),
        _option("-o --output --out DIR", "report folder (default graphsynth-out/TASK)", Path),
        _option("--seconds S", "time limit of the search (default: as the task says)", float),
        _option("--go-on", "begin with the mechanisms of the last report in DIR"),
        _option("--workers K", "worker processes (default: all cores)", workers),
    ),
    "accuracy": (
        "Measure error against run time of the methods in a scene.",
        _SCENE,
        _option("-o --output --out DIR", "report folder (default graphsynth-out/SCENE-accuracy)", Path),
        _option("--rounds N", "timed runs of each row (default 3)", int, default=3),
        _option("--quick", "fewer and easier settings, to try the command"),
    ),
    "schema": ("Print the JSON Schema of scene files, for editors.",),
    "doctor": ("Say where the machine code of the kernels comes from, and why.",),
    "stress": (
        "Run the stiff and extreme cases and compare the results with the right values.",
        _option(
            "NAME",
            "platform-12.5, or all of platform-12, of platform, or of a system, such as braider (default: all)",
            dest="names",
            nargs="*",
        ),
        _option(
            "--cases FILE",
            "run the cases of this TOML file instead (its expressions are evaluated: name only files that you trust)",
            Path,
            action="append",
            default=[],
        ),
        _option("-o --output --out DIR", "write stress.html and stress.csv there", Path),
        _option("--fast", "leave out cases that take more than about two seconds"),
        _option("--list", "list the cases, run none"),
    ),
}
_ASKING = ("solve", "count", "enumerate")
#: Modules of verbs that have not one of their own name.
_MODULES = {"enumerate": "enumerate_", "schema": "doctor"}

_EXECUTOR = (
    _option("--executor", "who computes (default processes)", choices=("processes", "dask"), default="processes"),
    _option("--scheduler ADDRESS", "dask scheduler, for example tcp://node1:8786"),
)
_FILE = _option("FILE", "the catalogue (query, verify: or the folder of a data set)", Path, dest="file")
_CATALOG = "Build, evaluate, ask, check, export and merge catalogues of chains and mechanisms."
_ACTIONS: dict[str, tuple[str, *tuple[Option, ...]]] = {
    "build": (
        "Make a catalogue file, or go on with one.",
        _option("--links N..M", "numbers of links, 18 at most", numbers, required=True),
        _option("--mobility W", "mobility, or W..V (default 1)", numbers, default=[1]),
        _option("--fractionated", "for W >= 2: include chains that one link or joint holds together"),
        _option("-o --output FILE", "the catalogue (default catalogue.sqlite)", Path, default=Path("catalogue.sqlite")),
        _SHARD,
        _option("--workers K", "worker processes (default: all cores)", workers),
        *_EXECUTOR,
    ),
    "dataset": (
        "Write all chains and mechanisms as Parquet files with a manifest, or go on with them.",
        _option("--links N..M", "numbers of links, 18 at most", numbers, required=True),
        _option("--mobility W", "mobility, or W..V (default 1)", numbers, default=[1]),
        _option("--fractionated", "for W >= 2: include chains that one link or joint holds together"),
        _option("--chains-only", "leave out the mechanisms: forty for each chain of 14 links"),
        _option("-o --output DIR", "folder of the data set (default dataset)", Path, default=Path("dataset")),
        _SHARD,
        _option("--workers K", "worker processes (default: all cores)", workers),
        *_EXECUTOR,
    ),
    "query": (
        "Ask a catalogue, or a data set in SQL.",
        _FILE,
        _option("--where CONDITION", "SQL condition on the rows of the table", default="1"),
        _option("--table NAME", "table (default chains)", default="chains"),
        _option("--sql TEXT", "any SQL question instead"),
        _option("--entry KEY|LABEL", "everything about one chain instead"),
        _option("--limit N", "rows read (default 20; 0: all)", limit, default=20),
        _option("--seconds S", "longest time of the question (default 60; 0: no bound)", float, default=60.0),
    ),
    "verify": (
        "Recompute every stored field by another route; status 1 if something differs.",
        _FILE,
        _option("--chains N", "only N chains of each family, drawn at random", limit),
        _option("--seed S", "of the draw (default 0)", int, default=0),
        _option("--quick", "compare the file with its seal only: every change is found, nothing recomputed"),
    ),
    "export": (
        "Write the tables to files, the same bytes for the same content.",
        _FILE,
        _option("-o --output DIR", "folder for the files", Path, required=True),
        _option("--form", "default csv", choices=("csv", "jsonl", "parquet"), default="csv"),
    ),
    "merge": (
        "Make one catalogue of its shards.",
        _option("PART", "files built with --shard I/M, all of them", Path, dest="parts", nargs="+"),
        _option("-o --output FILE", "the catalogue", Path, required=True),
    ),
    "evaluate": (
        "Find dimensions for a full rotation; store them with transmission and, if asked, a jamming verdict.",
        _FILE,
        _option("--links N..M", "numbers of links (default all)", numbers),
        _option("--mobility W..V", "mobilities (default all)", numbers),
        _option(
            "--per-chain N",
            "mechanisms of each chain, those of the smallest groups first (default 1; 0: all)",
            limit,
            default=1,
        ),
        _option("--limit N", "evaluate at most N mechanisms now (default 0: all)", limit, default=0),
        _option("--seed S", "of the search for dimensions (default 0)", limit, default=0),
        _option("--tries N", "searches for each mechanism (default 4)", limit, default=4),
        _option(
            "--tilt DEGREES",
            "prove whether it binds when the axis of the first driver is tilted by at most this, in any direction",
            float,
        ),
        _option("--joint-limit DEGREES", f"tilt that every joint takes up, with --tilt (default {JOINT_LIMIT})", float),
        _option("--workers K", "worker processes (default one)", workers),
    ),
    "site": (
        "Write the atlas page: a static site that opens from a file.",
        _FILE,
        _option("-o --output DIR", "folder of the page", Path, required=True),
        _WORKERS,
    ),
}

_INDEX = _option("FOLDER", "the index", Path, dest="folder")
_CURVES = "Build, ask and check indices of the curves that mechanisms draw."
_CURVES_ACTIONS: dict[str, tuple[str, *tuple[Option, ...]]] = {
    "build": (
        "Make an index of curves, or go on with one.",
        _INDEX,
        _option("--curves N", "curves of all shards together (default 1000000)", int, default=1_000_000),
        _option("--links N", "numbers of links (default 4 6 8)", int, nargs="+", default=[4, 6, 8]),
        _option("--sliders N", "most sliding joints of four-bars and six-bars (default 2)", int, default=2),
        _option("--seed S", "of the draws (default 0)", int, default=0),
        _SHARD,
        _option("--workers K", "worker processes (default: all cores)", workers),
        *_EXECUTOR,
    ),
    "find": (
        "Find mechanisms whose curves are nearest to a wanted one.",
        _INDEX,
        _option("CURVE", "file of points, x and y on every line, or of poses, x, y and radians", Path, dest="curve"),
        _option("--count N", "mechanisms to find (default 10)", int, default=10),
        _option("--closed", "join the last point to the first"),
        _option("--timed", "the points belong to uniform inputs; those of poses always do"),
        _option("-o --output FILE", "keep the best mechanism: FILE.toml, .json; or draw it: .svg, .png", Path),
    ),
    "verify": ("Compare the files of an index with their checksums.", _INDEX),
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        note(f"{self.prog}: {message} (see {self.prog} --help)")  # nobody may be there to read it
        sys.exit(USAGE_ERROR)


def command_line() -> argparse.ArgumentParser:
    """Return the parser of all verbs; ``module`` of what it reads names the module of the verb."""
    parser = _Parser(
        prog="graphsynth", description="Structural synthesis and analysis of mechanisms.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"graphsynth {graphsynth.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name in _VERBS:
        _add(verbs, name, _VERBS[name], _MODULES.get(name, name))
    for verb, summary, every in (("catalog", _CATALOG, _ACTIONS), ("curves", _CURVES, _CURVES_ACTIONS)):
        own = verbs.add_parser(verb, help=summary, description=summary, allow_abbrev=False)
        actions = own.add_subparsers(dest="action", required=True, metavar="ACTION")
        for name in every:
            _add(actions, name, every[name], verb)
    return parser


def _add(verbs: Any, name: str, told: tuple[str, *tuple[Option, ...]], module: str) -> None:
    summary, *options = told
    parser = verbs.add_parser(name, help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(module=module)
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    if name in _ASKING:
        add_question(parser)
    for flags, about in options:
        parser.add_argument(*flags, **about)
