"""Options of ``graphsynth catalog``; imports nothing that computes."""

from __future__ import annotations

import argparse
from pathlib import Path

from graphsynth.cli.question import limit, numbers, shard, workers

Parsers = argparse._SubParsersAction  # argparse has no public name for it
#: Tilt that every joint takes up by default, degrees.
JOINT_LIMIT = 0.3


def add_catalog(verbs: Parsers[argparse.ArgumentParser]) -> None:
    """Add the verb with its own verbs."""
    summary = "Build, evaluate, ask, check, export and merge catalogues of chains and mechanisms."
    parser = verbs.add_parser("catalog", help=summary, description=summary, allow_abbrev=False)
    own = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    for add in (_add_build, _add_query, _add_verify, _add_export, _add_merge, _add_evaluate, _add_site):
        add(own)


def _action(own: Parsers[argparse.ArgumentParser], name: str, summary: str) -> argparse.ArgumentParser:
    parser = own.add_parser(name, help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(module="catalog")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    if name not in ("build", "merge"):
        parser.add_argument("file", type=Path, metavar="FILE", help="the catalogue")
    return parser


def _add_build(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "build", "Make a catalogue file, or go on with one.")
    parser.add_argument("--links", type=numbers, required=True, metavar="N..M", help="numbers of links, 18 at most")
    parser.add_argument("--mobility", type=numbers, default=[1], metavar="W", help="mobility, or W..V (default 1)")
    parser.add_argument(
        "--fractionated", action="store_true", help="for W >= 2: include chains that fall apart at a link or a joint"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("catalogue.sqlite"),
        metavar="FILE",
        help="the catalogue (default catalogue.sqlite)",
    )
    parser.add_argument("--shard", type=shard, metavar="I/M", help="do only shard I of M (1 <= I <= M)")
    parser.add_argument("--workers", type=workers, metavar="K", help="worker processes (default: all cores)")
    parser.add_argument(
        "--executor", choices=("processes", "dask"), default="processes", help="who computes (default processes)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="dask scheduler, for example tcp://node1:8786")


def _add_query(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "query", "Ask a catalogue.")
    parser.add_argument("--where", default="1", metavar="CONDITION", help="SQL condition on the rows of the table")
    parser.add_argument("--table", default="chains", metavar="NAME", help="table (default chains)")
    parser.add_argument("--sql", metavar="TEXT", help="any SQL question instead")
    parser.add_argument("--entry", metavar="KEY|LABEL", help="everything about one chain instead")
    parser.add_argument("--limit", type=limit, default=20, metavar="N", help="rows read (default 20; 0: all)")
    parser.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="S",
        help="longest time of the question (default 60; 0: no bound)",
    )


def _add_verify(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "verify", "Recompute every stored field by another route; status 1 if something differs.")
    parser.add_argument("--chains", type=limit, metavar="N", help="only N chains of each family, drawn at random")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the draw (default 0)")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="compare the file with its seal only: every change is found, nothing recomputed",
    )


def _add_export(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "export", "Write the tables to files, the same bytes for the same content.")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder for the files")
    parser.add_argument("--form", choices=("csv", "jsonl", "parquet"), default="csv", help="default csv")


def _add_merge(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "merge", "Make one catalogue of its shards.")
    parser.add_argument("parts", type=Path, nargs="+", metavar="PART", help="files built with --shard I/M, all of them")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help="the catalogue")


def _add_evaluate(own: Parsers[argparse.ArgumentParser]) -> None:
    summary = "Find dimensions for a full rotation; store them with transmission and, if asked, a jamming verdict."
    parser = _action(own, "evaluate", summary)
    parser.add_argument("--links", type=numbers, metavar="N..M", help="numbers of links (default all)")
    parser.add_argument("--mobility", type=numbers, metavar="W..V", help="mobilities (default all)")
    parser.add_argument(
        "--per-chain",
        type=limit,
        default=1,
        metavar="N",
        help="mechanisms of each chain, those of the smallest groups first (default 1; 0: all)",
    )
    parser.add_argument(
        "--limit", type=limit, metavar="N", default=0, help="evaluate at most N mechanisms now (default 0: all)"
    )
    parser.add_argument("--seed", type=limit, default=0, metavar="S", help="of the search for dimensions (default 0)")
    parser.add_argument("--tries", type=limit, default=4, metavar="N", help="searches for each mechanism (default 4)")
    parser.add_argument(
        "--tilt",
        type=float,
        metavar="DEGREES",
        help="prove whether it binds when the axis of the first driver is tilted by at most this, in any direction",
    )
    parser.add_argument(
        "--joint-limit",
        type=float,
        metavar="DEGREES",
        help=f"tilt that every joint takes up, with --tilt (default {JOINT_LIMIT})",
    )
    parser.add_argument("--workers", type=workers, metavar="K", help="worker processes (default one)")


def _add_site(own: Parsers[argparse.ArgumentParser]) -> None:
    parser = _action(own, "site", "Write the atlas page: a static site that opens from a file.")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder of the page")
    parser.add_argument(
        "--motion-links",
        type=int,
        default=10,
        metavar="N",
        help="show chains of at most N links in motion (default 10; 0: none)",
    )
    parser.add_argument(
        "--workers", type=workers, metavar="K", help="worker processes (default: one; all for big work)"
    )
