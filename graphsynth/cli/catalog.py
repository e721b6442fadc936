"""``graphsynth catalog``: build, dataset, evaluate, query, verify, export, merge, site."""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.cli import console
from graphsynth.cli.options import JOINT_LIMIT
from graphsynth.core import ordered, wording
from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.atlas.building import BuildStep
    from graphsynth.atlas.evaluating import EvaluationStep

DIFFERENT = 1
#: Chains from which all cores draw the atlas page.
_MANY = 1000


def run(options: argparse.Namespace) -> int:
    """Do one action of the verb."""
    actions = (_build, _dataset, _query, _verify, _export, _merge, _evaluate, _site)
    return {action.__name__[1:]: action for action in actions}[options.action](options)


def _build(options: argparse.Namespace) -> int:
    begin = time.perf_counter()
    with _building(options) as more:
        for mobility in options.mobility:
            Catalogue.build(options.output, options.links, mobility, **more).close()
    return _summary(options, begin)


@contextmanager
def _building(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Give what a build takes beside its question: who computes, and who is told; say what stays when it is stopped."""
    from graphsynth.atlas import making
    from graphsynth.synthesis.writing import Step

    big = max(options.links) > 10 + min(options.mobility)  # more than a second of work
    try:
        with console.executor(options, making.processes, big) as executor, console.progress("building") as bar:

            def watch(step: BuildStep) -> None:
                if bar:
                    bar(Step(step.chains, step.done))

            own = {"fractionated": options.fractionated, "shard": options.shard}
            yield {**own, "executor": executor, "watch": watch}
    except KeyboardInterrupt:
        console.note(f"{options.output} keeps what is written: give the same command to go on")
        raise


def _dataset(options: argparse.Namespace) -> int:
    """Make a data set and say what it holds."""
    from graphsynth.atlas.dataset import Dataset

    begin = time.perf_counter()
    with _building(options) as more:
        for mobility in options.mobility:
            data = Dataset.build(options.output, options.links, mobility, mechanisms=not options.chains_only, **more)
    size = sum(path.stat().st_size for path in options.output.rglob("*") if path.is_file())
    seconds = round(time.perf_counter() - begin, 3)
    if options.json:
        held = {"bytes": size, "seconds": seconds, "families": _records(data.families)}
        console.put_json({"folder": str(options.output), **held})
        return 0
    _put_frame(data.families)
    part = (
        ""
        if options.shard is None
        else ", part {}/{} made: give the command without --shard at last".format(*options.shard)
    )
    console.put(f"{options.output}: {len(data)} chains{part}, {size / 1e6:.1f} MB ({seconds:.1f} s)")
    return 0


def _summary(options: argparse.Namespace, begin: float) -> int:
    """Say what the catalogue now holds."""
    seconds = round(time.perf_counter() - begin, 3)
    with Catalogue(options.output) as catalogue:
        families = catalogue.completeness()
        chains = len(catalogue)
        size = options.output.stat().st_size
    if options.json:
        held = {"chains": chains, "bytes": size, "seconds": seconds, "families": _records(families)}
        console.put_json({"file": str(options.output), **held})
        return 0
    _put_frame(families)
    part = "" if getattr(options, "shard", None) is None else ", part {}/{}: merge all parts".format(*options.shard)
    console.put(f"{options.output}: {chains} chain{'s' * (chains != 1)}{part}, {size / 1e6:.1f} MB ({seconds:.1f} s)")
    return 0


def _query(options: argparse.Namespace) -> int:
    if sum((options.sql is not None, options.entry is not None, options.where != "1")) > 1:
        raise SpecError("give one of --where, --sql and --entry")
    if options.file.is_dir():
        return _put_answer(_asked_dataset(options), options)
    with Catalogue(options.file) as catalogue:
        if options.entry is not None:
            with catalogue.reading():  # what is printed may be of any type
                _put_entry(catalogue, options)
            return 0
        limit, seconds = options.limit or None, options.seconds or None
        if options.sql is not None:
            frame = catalogue.sql(options.sql, limit=limit, seconds=seconds)
        else:
            frame = catalogue.query(options.table, options.where, limit=limit, seconds=seconds)
    return _put_answer(frame, options)


def _asked_dataset(options: argparse.Namespace) -> pd.DataFrame:
    """Ask a data set."""
    from graphsynth.atlas.dataset import TABLES, Dataset

    if options.entry is not None:
        raise SpecError("--entry asks a catalogue, and this is a data set; ask it by --sql")
    if options.table not in TABLES:
        raise SpecError(f"a data set has no table {options.table!r}; choose {' or '.join(TABLES)}")
    sql = options.sql or f"SELECT * FROM {options.table} WHERE {options.where}"
    frame = Dataset(options.file).query(sql, limit=options.limit or None)
    frame.attrs.setdefault("more", False)
    return frame


def _put_answer(frame: pd.DataFrame, options: argparse.Namespace) -> int:
    more = frame.attrs["more"]
    if options.json:
        console.put_json({"rows": None if more else len(frame), "shown": _records(frame)})
        return 0
    _put_frame(frame)
    rows = f"{'more than ' * more}{len(frame)} row{'s' * (len(frame) != 1)}"
    console.put(f"{rows}, {len(frame)} shown: --limit 0 shows all" if more else rows)
    return 0


def _put_entry(catalogue: Catalogue, options: argparse.Namespace) -> None:
    entry = catalogue.entry(options.entry)
    if options.json:
        console.put_json(entry)
        return
    plain = {name: value for name, value in entry.items() if not isinstance(value, list | dict)}
    plain["contracted graph"] = entry["contracted"]["edges"] or "none (a ring)"
    for relation in ("parents", "children"):
        plain[relation] = " ".join(entry[relation]) or "none in this catalogue"
    console.facts((name, wording.plain(str(value))) for name, value in plain.items())
    for inversion in entry["inversions"]:
        _put(f"frame {inversion['frame']}: {inversion['frame_joints']} joints, levels {inversion['levels']}")
        for own in entry["mechanisms"]:
            if own["frame"] == inversion["frame"]:
                known = [f"{g['links']} links class {g['class']} order {g['order']}" for g in own["groups"]]
                words = [", ".join(known)]
                for kind, found in own["evaluations"].items():
                    if isinstance(found, dict):
                        number = "" if found["value"] is None else f" {found['value']:.6g} {found['unit'] or ''}"
                        sure = f" ({found['guarantee']})" if found["guarantee"] else ""
                        found = f"{found['status']}{number.rstrip()}{sure}"
                    words.append(f"{kind} {found}")
                _put(f"  driver {own['driver']}: class {own['class']}, order {own['order']}: {'; '.join(words)}")


def _verify_dataset(options: argparse.Namespace) -> int:
    from graphsynth.atlas.dataset import Dataset

    found = Dataset(options.file).verify()
    if options.json:
        document = {"passed": found.passed, "differences": list(found.differences)}
        console.put_json({**document, "files": found.files, "rows": found.rows})
    else:
        for difference in found.differences:
            _put(difference)
        told = "as they were made and counted" if found.passed else "that is not as it was made"
        console.put(f"{options.file}: {found.files} files, {found.rows} rows, {told}")
    return 0 if found.passed else DIFFERENT


def _verify(options: argparse.Namespace) -> int:
    if options.file.is_dir():
        return _verify_dataset(options)
    with Catalogue(options.file) as catalogue:
        found = catalogue.verify(chains=options.chains, seed=options.seed, quick=options.quick)
    if options.json:
        document = {"passed": found.passed, "compared": found.compared, "differences": list(found.differences)}
        console.put_json({**document, "seconds": round(found.seconds, 3)})
    else:
        for difference in found.differences:
            _put(difference)
        console.put(f"{options.file}: {found.statement}")
    return 0 if found.passed else DIFFERENT


def _export(options: argparse.Namespace) -> int:
    with Catalogue(options.file) as catalogue:
        files = catalogue.export(options.output, options.form)
        digest = catalogue.digest()
    sizes = {str(path): path.stat().st_size for path in files}
    if options.json:
        console.put_json({"digest": digest, "files": sizes})
        return 0
    for name, size in sizes.items():
        console.put(f"{name}  {size} bytes")
    console.put(f"content {digest}")
    return 0


def _merge(options: argparse.Namespace) -> int:
    begin = time.perf_counter()
    Catalogue.merge(options.output, options.parts).close()
    return _summary(options, begin)


def _evaluate(options: argparse.Namespace) -> int:
    """Evaluate, and say what the catalogue now holds."""
    if options.joint_limit is not None and options.tilt is None:
        raise SpecError("--joint-limit goes with --tilt; give both, or neither")
    jamming = None
    if options.tilt is not None:
        limit = JOINT_LIMIT if options.joint_limit is None else options.joint_limit
        jamming = math.radians(options.tilt), math.radians(limit)
    begin = time.perf_counter()
    with Catalogue(options.file) as catalogue:
        try:
            with ordered.processes(console.workers_for(options.workers, False)) as executor, console.counting() as bar:

                def watch(step: EvaluationStep) -> None:
                    if bar:
                        bar("evaluating", step.done, step.total)

                done = catalogue.evaluate(
                    options.links,
                    options.mobility,
                    per_chain=options.per_chain,
                    limit=options.limit or None,
                    seed=options.seed,
                    tries=options.tries,
                    jamming=jamming,
                    executor=executor,
                    watch=watch,
                )
        except KeyboardInterrupt:
            console.note(f"{options.file} keeps what is evaluated: give the same command to go on")
            raise
        rows = catalogue.sql(
            "SELECT kind, status, COALESCE(guarantee, '') AS guarantee, COUNT(*) AS count, MIN(value) AS least, "
            "MAX(value) AS most FROM evaluations GROUP BY kind, status, guarantee ORDER BY kind, status, guarantee"
        )
    held: list[dict[str, Any]] = rows.astype(object).where(rows.notna(), None).to_dict("records")
    seconds = round(time.perf_counter() - begin, 3)
    if options.json:
        console.put_json({"file": str(options.file), "evaluated": done, "held": held, "seconds": seconds})
        return 0
    for row in held:
        sure = f" ({row['guarantee']})" if row["guarantee"] else ""
        spread = ""
        if row["kind"] == "transmission" and row["least"] is not None:
            spread = f", {math.degrees(row['least']):.1f} to {math.degrees(row['most']):.1f} degrees"
        console.put(f"{row['kind']:12}  {row['status']}{sure}: {row['count']}{spread}")
    console.put(f"{options.file}: {done} evaluated now ({seconds:.1f} s)")
    return 0


def _site(options: argparse.Namespace) -> int:
    """Write the page and say what it holds."""
    from graphsynth.atlas.site.building import build_site

    begin = time.perf_counter()
    with Catalogue(options.file) as catalogue:
        count = console.workers_for(options.workers, len(catalogue) > _MANY)
        with ordered.processes(count) as executor, console.counting() as watch:
            report = build_site(catalogue, options.output, executor=executor, watch=watch)
    seconds = round(time.perf_counter() - begin, 3)
    if options.json:
        held = {"bytes" if name == "size" else name: value for name, value in asdict(report).items()}
        console.put_json({**held, "page": str(report.page), "seconds": seconds})
    else:
        console.put(
            f"{report.page}: {report.chains} chains, {report.dimensioned} with dimensions, {report.files} files, "
            f"{report.size / 1e6:.1f} MB, {report.first_load / 1000:.0f} kB to begin with ({seconds:.1f} s)"
        )
    return 0


def _put(text: str) -> None:
    """Print a line that may come from a file: nothing in it steers the terminal."""
    console.put(console.wrapped(wording.plain(text), 4))


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as plain values for JSON; bytes as hexadecimal digits, and columns of one name numbered."""
    names: list[str] = []
    for at, name in enumerate(frame.columns, 1):
        before = list(frame.columns[:at]).count(name)
        names.append(name if before == 1 else f"{name}:{before}")
    shown = frame.set_axis(names, axis="columns").map(lambda value: value.hex() if isinstance(value, bytes) else value)
    records: list[dict[str, Any]] = json.loads(shown.to_json(orient="records", double_precision=15))
    return records


def _put_frame(frame: pd.DataFrame) -> None:
    """Print a table as text that scripts can cut; on a terminal too narrow for it, some columns below the others."""
    if len(frame.columns) and len(frame):
        text = frame.map(lambda value: wording.plain(value) if isinstance(value, str) else value)
        text = text.rename(columns=wording.plain)
        console.put(text.to_string(index=False, max_colwidth=60, line_width=console.columns()).replace("<NA>", "   -"))
