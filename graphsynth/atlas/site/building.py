"""Writing the atlas page of a catalogue."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

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
from graphsynth.atlas.site.named import named_script
from graphsynth.atlas.site.sliders import sliders_script
from graphsynth.atlas.stored import stored_mechanisms
from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wholefolders import PageFolder, put
from graphsynth.workbench.modules import script
from graphsynth.workbench.writing import fragment, page_file, write_files

if TYPE_CHECKING:
    from graphsynth.atlas.catalogue import Catalogue
    from graphsynth.mechanism.model import Mechanism


#: Data of the first load in bytes; families beyond it are loaded when they are asked for.
_FIRST_LOAD = 450_000

#: What pages consist of; a folder with anything else is somebody's.
_PAGES = PageFolder(
    "atlas-page.txt", {".": (".html", ".css", ".js"), "data": (".js",), "workbench": (".html", ".css", ".js")}
)
#: Told ``(what is done now, steps done, steps in all)``.
Watch = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class SiteReport:
    """What was written.

    Parameters
    ----------
    page : Path
        The page to open.
    chains, dimensioned : int
        Chains shown, and those of them for which the catalogue holds dimensions.
    files : int
    size, first_load : int
        Bytes in all, and those that a browser reads before the page can be used.
    """

    page: Path
    chains: int
    dimensioned: int
    files: int
    size: int
    first_load: int


def build_site(
    catalogue: Catalogue,
    folder: str | Path,
    *,
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
    executor : concurrent.futures.Executor, optional
        Who computes sketches; the files are the same for any.
    watch : callable, optional
        Called with what is being done, the steps done and the steps in all.

    Returns
    -------
    SiteReport

    Raises
    ------
    FormatError
        If the catalogue is damaged, or holds values of another form than its columns have.
    GraphsynthError
        If the catalogue has no finished family, the folder holds something else, or it cannot be written.
    """
    with _PAGES.replaced(Path(folder)) as (target, building):
        with catalogue.reading(screened=True):
            found = families(catalogue.connection)
        if not found:
            raise GraphsynthError(f"{catalogue.path.name} has no finished family: finish building it first")
        report = _write(catalogue, found, building, executor, watch)
    return SiteReport(target / "index.html", *report)


def _write(
    catalogue: Catalogue,
    found: list[Family],
    folder: Path,
    executor: Executor | None,
    watch: Watch | None,
) -> tuple[int, int, int, int, int]:
    """Write all files; return what a report holds after its page."""
    data, bench = folder / "data", folder / "workbench"
    data.mkdir()
    bench.mkdir()
    write_files(bench, atlas="../index.html")
    with catalogue.reading():
        stored = _stored(catalogue, {row["chain_id"]: row["key"] for family in found for row in family.rows})
    chains, done = sum(len(family.rows) for family in found), 0
    places = {row["key"]: (family.name, k) for family in found for k, row in enumerate(family.rows)}
    first, room = [], _FIRST_LOAD
    for family in found:
        with catalogue.reading():
            text, relatives = family_script(family), relatives_script(catalogue.connection, family, places, stored)
        put(data / f"family-{family.name}.js", text)
        put(data / f"relatives-{family.name}.js", relatives)
        for name, sketches, count in sketch_scripts(family, executor):
            put(data / name, sketches)
            done += count
            if watch:
                watch("sketches", done, chains)
        size = (data / f"family-{family.name}.js").stat().st_size
        if size <= room:
            room -= size
            first.append(family.name)
    more = {"first": first, "sketchesPerFile": PER_FILE}
    with catalogue.reading():
        known, groups = contents(catalogue.connection, found, **more), groups_script(catalogue.connection)
    put(data / "contents.js", known)
    put(data / "groups.js", groups)
    put(data / "names.js", named_script())
    put(data / "sliders.js", sliders_script(found))
    begins = ["contents", "names", *(f"family-{name}" for name in first)]
    loaded = [*_write_pages(folder, begins), *(data / f"{name}.js" for name in begins)]
    put(folder / _PAGES.mark, "This folder is written by 'graphsynth catalog site' and replaced by it.\n")
    everything = [path for path in folder.rglob("*") if path.is_file()]
    size, first_load = (sum(path.stat().st_size for path in paths) for paths in (everything, loaded))
    return chains, len(stored), len(everything), size, first_load


def _stored(catalogue: Catalogue, keys: dict[int, str]) -> dict[int, tuple[int, list[int], str]]:
    """Return frame, drivers and the workbench's address of the mechanism that ``catalogue.mechanism`` gives, by chain.

    Left out: what does not fit its chain, or cannot be assembled.
    """
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    found: dict[int, tuple[int, list[int], str]] = {}
    for own in stored_mechanisms(catalogue.connection):
        if own.chain_id in found or own.chain_id not in keys:
            continue
        try:
            mechanism = Mechanism.from_json(own.text)
            frame = mechanism.graph.frame
            fits = mechanism.graph.without_frame() == MechanismGraph.from_key(keys[own.chain_id])
            if frame is not None and fits and mechanism.drivers:
                drivers = [driver.link if driver.base == frame else driver.base for driver in mechanism.drivers]
                found[own.chain_id] = frame, drivers, fragment(_traced(mechanism))
        except GraphsynthError:
            continue
    return found


def _traced(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with a point in the middle of up to two links that have no joint on the frame."""
    from graphsynth.mechanism.model import TracePoint

    frame, points = mechanism.graph.frame, dict(mechanism.points)
    for link in range(mechanism.graph.links):
        ends = [joint for joint in mechanism.joints if link in (joint.a, joint.b)]
        if link != frame and len(points) < 2 and all(frame not in (joint.a, joint.b) for joint in ends):
            places = [joint.at_a if joint.a == link else joint.at_b for joint in ends]
            x, y = (sum(place[c] for place in places) / len(places) for c in (0, 1))
            points[f"P{len(points) + 1}"] = TracePoint(link, (x, y))
    return replace(mechanism, points=points)


def _write_pages(folder: Path, data: list[str]) -> list[Path]:
    """Write the page itself; return the files that it loads at once."""
    from jinja2 import Environment, StrictUndefined

    source = files("graphsynth.atlas.site").joinpath("pages")
    texts = {path.name: path.read_text("utf-8") for path in source.iterdir() if path.is_file()}
    page = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, keep_trailing_newline=True)
    own = [texts[f"{name}.js"] for name in texts["order.txt"].split()]
    loaded = {
        "style.css": texts["style.css"],
        "theme.js": texts["theme.js"],
        "atlas.js": "".join([page_file("kernels.js"), page_file("labelling.js"), script("labels"), *own]),
        "index.html": page.from_string(texts["index.html"]).render(data=data),
    }
    for name, text in loaded.items():
        put(folder / name, text)
    return [folder / name for name in loaded]
