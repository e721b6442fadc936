"""Writing the atlas page of a catalogue."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.site.families import (
    Family,
    contents,
    families,
    family_script,
    groups_script,
    relatives_script,
)
from graphsynth.atlas.site.motions import MotionTask, motion_of
from graphsynth.atlas.site.sketches import PER_FILE, sketch_scripts
from graphsynth.atlas.stored import stored_mechanisms
from graphsynth.errors import GraphsynthError, SpecError

if TYPE_CHECKING:
    from graphsynth.atlas.catalogue import Catalogue

__all__ = ["SCRIPTS", "SiteReport", "build_site"]

#: Scripts of the page, in the order in which they are loaded.
SCRIPTS = (
    "graph", "canonical", "groups", "reading", "drawing", "store", "glossary", "writing", "browse", "entry", "editor",
    "find", "about", "main",
)  # fmt: skip
#: Data of the first load in bytes; families beyond it are loaded when they are asked for.
_FIRST_LOAD = 450_000
_MARK = "atlas-page.txt"
#: Told ``(what is done now, steps done, steps in all)``.
Watch = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class SiteReport:
    """What was written.

    Parameters
    ----------
    page : Path
        The page to open.
    chains, motions : int
        Chains shown, and those of them shown in motion.
    files : int
    size : int
        Bytes in all.
    first_load : int
        Bytes that a browser reads before the page can be used.
    """

    page: Path
    chains: int
    motions: int
    files: int
    size: int
    first_load: int


def build_site(
    catalogue: Catalogue,
    folder: str | Path,
    *,
    motion_links: int = 10,
    executor: Executor | None = None,
    watch: Watch | None = None,
) -> SiteReport:
    """Write a catalogue as a static site: open ``index.html`` in a browser, from a disk or from any server.

    Parameters
    ----------
    catalogue : Catalogue
    folder : str or Path
        Made if it does not exist; a page that is there is replaced, anything else is refused.
    motion_links : int
        Chains of at most so many links are given dimensions and shown in motion (0: none at all).  Where the catalogue
        holds dimensions these are shown, for chains of any size.
    executor : concurrent.futures.Executor, optional
        Who computes sketches and motions; the files are the same for any.
    watch : callable, optional
        Told what is being done, the steps done and the steps in all.

    Returns
    -------
    SiteReport

    Raises
    ------
    SpecError
        If ``motion_links`` is negative.
    FormatError
        If the catalogue is damaged.
    GraphsynthError
        If the catalogue has no finished family, or the folder holds something else.
    """
    if motion_links < 0:
        raise SpecError(f"motion_links = {motion_links} must be 0 (no motions) or more")
    target = Path(folder)
    _check_place(target)
    with catalogue.reading():
        found = families(catalogue.connection)
    if not found:
        raise GraphsynthError(f"{catalogue.path.name} has no finished family: finish building it first")
    building = target.with_name(target.name + ".building")
    shutil.rmtree(building, ignore_errors=True)
    try:
        report = _write(catalogue, found, building, motion_links, executor, watch)
        shutil.rmtree(target, ignore_errors=True)
        building.rename(target)
    except BaseException:
        shutil.rmtree(building, ignore_errors=True)
        raise
    return SiteReport(target / "index.html", *report)


def _check_place(target: Path) -> None:
    if not target.absolute().parent.is_dir():
        raise GraphsynthError(f"{target}: the folder {target.absolute().parent} does not exist; make it first")
    if target.exists() and not target.is_dir():
        raise GraphsynthError(f"{target} is a file; name a folder")
    if target.is_dir() and any(target.iterdir()) and not (target / _MARK).is_file():
        raise GraphsynthError(f"{target} holds other files; name an empty or a new folder")


class _Progress:
    """Steps done of all: sketches and motions, the slow part."""

    def __init__(self, total: int, watch: Watch | None) -> None:
        self.total, self.watch, self.done = total, watch, 0

    def add(self, what: str, steps: int) -> None:
        self.done += steps
        if self.watch:
            self.watch(what, self.done, self.total)


def _write(
    catalogue: Catalogue,
    found: list[Family],
    folder: Path,
    motion_links: int,
    executor: Executor | None,
    watch: Watch | None,
) -> tuple[int, int, int, int, int]:
    """Write all files; return what a report holds after its page."""
    data = folder / "data"
    data.mkdir(parents=True)
    stored = _best_stored(catalogue) if motion_links else {}
    tasks = [
        MotionTask(row["label"], row["key"], stored.get(row["chain_id"]), family.links <= motion_links)
        for family in found
        for row in family.rows
        if family.links <= motion_links or row["chain_id"] in stored
    ]
    chains = sum(len(family.rows) for family in found)
    # a motion takes about as long as ten sketches
    progress = _Progress(chains + 10 * len(tasks), watch)
    motions = dict(_motions(folder, tasks, executor, progress))
    _write_families(catalogue, found, data, executor, progress)
    first, room = [], _FIRST_LOAD
    for family in found:
        size = (data / f"family-{family.name}.js").stat().st_size
        if size <= room:
            room -= size
            first.append(family.name)
    more = {"first": first, "sketchesPerFile": PER_FILE, "motions": motions, "motionLinks": motion_links}
    with catalogue.reading():
        known, groups = contents(catalogue.connection, found, **more), groups_script(catalogue.connection)
    _put(data / "contents.js", known)
    _put(data / "groups.js", groups)
    loaded = [*_write_pages(folder, first), data / "contents.js", *(data / f"family-{name}.js" for name in first)]
    _put(folder / _MARK, "This folder is written by 'graphsynth catalog site' and replaced by it.\n")
    everything = [path for path in folder.rglob("*") if path.is_file()]
    shown = sum("frame" in facts for facts in motions.values())
    return (
        chains, shown, len(everything), sum(path.stat().st_size for path in everything),
        sum(path.stat().st_size for path in loaded),
    )  # fmt: skip


def _best_stored(catalogue: Catalogue) -> dict[int, str]:
    """Return the mechanism that ``catalogue.mechanism`` gives, as JSON, for each chain that has one."""
    found: dict[int, str] = {}
    with catalogue.reading():
        for own in stored_mechanisms(catalogue.connection):
            found.setdefault(own.chain_id, own.text)
    return found


def _motions(
    folder: Path, tasks: list[MotionTask], executor: Executor | None, progress: _Progress
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Write the pages of motions; yield label and facts."""
    from graphsynth.ordered import in_order

    place = folder / "motions"
    place.mkdir()
    for shown in in_order(executor, motion_of, tasks):
        if shown.page:
            _put(place / f"{shown.label}.html", shown.page)
            _put(place / f"{shown.label}.toml", shown.mechanism)
        progress.add("motions", 10)
        yield shown.label, shown.facts


def _write_families(
    catalogue: Catalogue, found: list[Family], data: Path, executor: Executor | None, progress: _Progress
) -> None:
    places = {row["key"]: (family.name, k) for family in found for k, row in enumerate(family.rows)}
    for family in found:
        with catalogue.reading():
            own, relatives = family_script(family), relatives_script(catalogue.connection, family, places)
        _put(data / f"family-{family.name}.js", own)
        _put(data / f"relatives-{family.name}.js", relatives)
        for name, text, count in sketch_scripts(family, executor):
            _put(data / name, text)
            progress.add("sketches", count)


def _write_pages(folder: Path, first: list[str]) -> list[Path]:
    """Write the page itself; return the files that it loads at once."""
    source = files("graphsynth.atlas.site").joinpath("pages")
    style = source.joinpath("style.css").read_text("utf-8")
    _put(folder / "style.css", style)
    _put(folder / "atlas.js", "".join(source.joinpath(f"{name}.js").read_text("utf-8") for name in SCRIPTS))
    data = "".join(
        f'<script src="data/{name}.js"></script>\n' for name in ("contents", *(f"family-{n}" for n in first))
    )
    _put(folder / "index.html", source.joinpath("index.html").read_text("utf-8").replace("@DATA@", data))
    return [folder / name for name in ("index.html", "style.css", "atlas.js")]


def _put(path: Path, text: str) -> None:
    path.write_text(text, "utf-8", newline="\n")
