"""Writing the atlas page of a catalogue."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.site.families import (
    PER_FILE,
    Family,
    contents,
    families,
    family_script,
    groups_script,
    relatives_script,
    sketch_scripts,
)
from graphsynth.atlas.site.motions import MotionTask, motion_of
from graphsynth.atlas.stored import stored_mechanisms
from graphsynth.core.errors import GraphsynthError, SpecError
from graphsynth.core.wholefolders import PageFolder, put

if TYPE_CHECKING:
    from graphsynth.atlas.catalogue import Catalogue


#: Data of the first load in bytes; families beyond it are loaded when they are asked for.
_FIRST_LOAD = 450_000

#: What pages consist of; a folder with anything else is somebody's.
_PAGES = PageFolder("atlas-page.txt", {".": (".html", ".css", ".js"), "data": (".js",), "motions": (".html", ".toml")})
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
    size, first_load : int
        Bytes in all, and those that a browser reads before the page can be used.
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
        Made if it does not exist; a page that is there is replaced, anything else is refused.  A symbolic link is
        followed.
    motion_links : int
        Chains of at most so many links are given dimensions and shown in motion (0: none at all).  Where the catalogue
        holds dimensions these are shown, for chains of any size.
    executor : concurrent.futures.Executor, optional
        Who computes sketches and motions; the files are the same for any.
    watch : callable, optional
        Called with what is being done, the steps done and the steps in all.

    Returns
    -------
    SiteReport

    Raises
    ------
    SpecError
        If ``motion_links`` is negative.
    FormatError
        If the catalogue is damaged, or holds values of another form than its columns have.
    GraphsynthError
        If the catalogue has no finished family, the folder holds something else, or it cannot be written.
    """
    if motion_links < 0:
        raise SpecError(f"motion_links = {motion_links} must be 0 (no motions) or more")
    with _PAGES.replaced(Path(folder)) as (target, building):
        with catalogue.reading(screened=True):
            found = families(catalogue.connection)
        if not found:
            raise GraphsynthError(f"{catalogue.path.name} has no finished family: finish building it first")
        report = _write(catalogue, found, building, motion_links, executor, watch)
    return SiteReport(target / "index.html", *report)


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
    from graphsynth.core.ordered import in_order

    data = folder / "data"
    data.mkdir()
    stored: dict[int, str] = {}  # the mechanism that ``catalogue.mechanism`` gives, as JSON, for each chain with one
    if motion_links:
        with catalogue.reading():
            for own in stored_mechanisms(catalogue.connection):
                stored.setdefault(own.chain_id, own.text)
    tasks = [
        MotionTask(row["label"], row["key"], stored.get(row["chain_id"]), family.links <= motion_links)
        for family in found
        for row in family.rows
        if family.links <= motion_links or row["chain_id"] in stored
    ]
    chains = sum(len(family.rows) for family in found)
    # a motion takes about as long as ten sketches
    progress = _Progress(chains + 10 * len(tasks), watch)
    motions: dict[str, dict[str, Any]] = {}
    (folder / "motions").mkdir()
    for shown in in_order(executor, motion_of, tasks):
        if shown.page:
            put(folder / "motions" / f"{shown.label}.html", shown.page)
            put(folder / "motions" / f"{shown.label}.toml", shown.mechanism)
        progress.add("motions", 10)
        motions[shown.label] = shown.facts
    places = {row["key"]: (family.name, k) for family in found for k, row in enumerate(family.rows)}
    first, room = [], _FIRST_LOAD
    for family in found:
        with catalogue.reading():
            text, relatives = family_script(family), relatives_script(catalogue.connection, family, places)
        put(data / f"family-{family.name}.js", text)
        put(data / f"relatives-{family.name}.js", relatives)
        for name, sketches, count in sketch_scripts(family, executor):
            put(data / name, sketches)
            progress.add("sketches", count)
        size = (data / f"family-{family.name}.js").stat().st_size
        if size <= room:
            room -= size
            first.append(family.name)
    more = {"first": first, "sketchesPerFile": PER_FILE, "motions": motions, "motionLinks": motion_links}
    with catalogue.reading():
        known, groups = contents(catalogue.connection, found, **more), groups_script(catalogue.connection)
    put(data / "contents.js", known)
    put(data / "groups.js", groups)
    loaded = [*_write_pages(folder, first), data / "contents.js", *(data / f"family-{name}.js" for name in first)]
    put(folder / _PAGES.mark, "This folder is written by 'graphsynth catalog site' and replaced by it.\n")
    everything = [path for path in folder.rglob("*") if path.is_file()]
    moving = sum("frame" in facts for facts in motions.values())
    size, first_load = (sum(path.stat().st_size for path in paths) for paths in (everything, loaded))
    return chains, moving, len(everything), size, first_load


def _write_pages(folder: Path, first: list[str]) -> list[Path]:
    """Write the page itself; return the files that it loads at once."""
    from jinja2 import Environment, StrictUndefined

    source = files("graphsynth.atlas.site").joinpath("pages")
    texts = {path.name: path.read_text("utf-8") for path in source.iterdir() if path.is_file()}
    data = ["contents", *(f"family-{name}" for name in first)]
    page = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, keep_trailing_newline=True)
    loaded = {
        "style.css": texts["style.css"],
        "theme.js": texts["theme.js"],
        "atlas.js": "".join(texts[f"{name}.js"] for name in texts["order.txt"].split()),
        "index.html": page.from_string(texts["index.html"]).render(data=data),
    }
    for name, text in loaded.items():
        put(folder / name, text)
    return [folder / name for name in loaded]
