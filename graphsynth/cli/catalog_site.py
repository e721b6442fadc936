"""``graphsynth catalog site``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.cli import console
from graphsynth.cli.workers import workers_for

if TYPE_CHECKING:
    from graphsynth.atlas.site.building import Watch

#: Chains from which all cores are used.
_MANY = 1000


def add_site(own: argparse._SubParsersAction[argparse.ArgumentParser], workers: Callable[[str], int]) -> None:
    """Add the action; ``workers`` reads a number of processes."""
    summary = "Write the atlas page: a static site that opens from a file."
    parser = own.add_parser("site", help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(module="catalog_site")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("file", type=Path, metavar="FILE", help="the catalogue")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder of the page")
    parser.add_argument(
        "--motion-links", type=int, default=10, metavar="N",
        help="show chains of at most N links in motion (default 10; 0: none)",
    )  # fmt: skip
    parser.add_argument(
        "--workers", type=workers, metavar="K", help="worker processes (default: one; all for big work)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the page and say what it holds."""
    from graphsynth.atlas.catalogue import Catalogue
    from graphsynth.atlas.site.building import build_site
    from graphsynth.core.ordered import processes

    begin = time.perf_counter()
    with Catalogue(options.file) as catalogue:
        count = workers_for(options.workers, len(catalogue) > _MANY)
        with processes(count) as executor, _progress() as watch:
            report = build_site(
                catalogue, options.output, motion_links=options.motion_links, executor=executor, watch=watch
            )
    seconds = round(time.perf_counter() - begin, 3)
    facts = {
        "page": str(report.page),
        "chains": report.chains,
        "motions": report.motions,
        "files": report.files,
        "bytes": report.size,
        "first_load": report.first_load,
        "seconds": seconds,
    }
    if options.json:
        console.put_json(facts)
    else:
        console.put(
            f"{report.page}: {report.chains} chains, {report.motions} in motion, {report.files} files, "
            f"{report.size / 1e6:.1f} MB, {report.first_load / 1000:.0f} kB to begin with ({seconds:.1f} s)"
        )
    return 0


@contextmanager
def _progress() -> Iterator[Watch | None]:
    """Show the share of the work done."""
    from graphsynth.synthesis.writing import Step

    with console.progress("drawing") as watch:
        yield None if watch is None else lambda what, done, total: watch(Step(done, done / max(total, 1)))
