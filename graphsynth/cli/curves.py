"""``graphsynth curves``: build, find, verify."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graphsynth.cli import console
from graphsynth.core import ordered
from graphsynth.core.errors import FormatError, SpecError
from graphsynth.core.textfiles import read_bytes
from graphsynth.design.curves.building import build
from graphsynth.design.curves.index import CurveIndex
from graphsynth.formats.registry import write

#: Curves from which all cores work; the longest file of points; numbers of a pose.
_MANY, _LONGEST, _POSE = 20_000, 10**7, 3


def run(options: argparse.Namespace) -> int:
    """Do one action of the verb."""
    return {"build": _build, "find": _find, "verify": _verify}[options.action](options)


def _build(options: argparse.Namespace) -> int:
    shard = (1, 1) if options.shard is None else options.shard
    begin = time.perf_counter()
    try:
        with (
            console.executor(options, ordered.processes, options.curves >= _MANY) as executor,
            console.counting() as bar,
        ):
            place = build(
                options.folder,
                options.curves,
                links=options.links,
                sliders=options.sliders,
                seed=options.seed,
                shard=shard,
                executor=executor,
                watch=(lambda done, total: bar("drawing", done, total)) if bar else None,
            )
    except KeyboardInterrupt:
        console.note(f"{options.folder} keeps what is drawn: give the same command to go on")
        raise
    size = sum(path.stat().st_size for path in place.iterdir())
    seconds = round(time.perf_counter() - begin, 3)
    if options.json:
        console.put_json({"folder": str(place), "bytes": size, "seconds": seconds})
    else:
        console.put(f"{place}: {size / 1e6:.1f} MB ({seconds:.1f} s)")
    return 0


def _find(options: argparse.Namespace) -> int:
    points = _points(options.curve)
    index = CurveIndex(options.folder)
    begin = time.perf_counter()
    closed = options.closed or None
    if points.shape[1] == _POSE:
        found = index.find_motion(points, options.count, closed=closed)
    else:
        found = index.find(points, options.count, closed=closed, timed=options.timed)
    seconds = round(time.perf_counter() - begin, 3)
    if options.output is not None and found:
        mechanism = found[0].mechanism
        if options.output.suffix.lower() in (".toml", ".json"):
            write(mechanism, options.output)
        else:
            mechanism.draw(options.output)
    rows = [
        {
            "error": match.error,
            "links": match.links,
            "dyadic": match.dyadic,
            "driver": "{}-{}".format(*match.start.design.drivers[0]),
            "range_degrees": math.degrees(match.start.span) if match.turns else None,
            "key": match.key,
            "number": match.number,
        }
        for match in found
    ]
    if options.json:
        console.put_json({"curves": len(index), "found": rows, "seconds": seconds})
        return 0
    for row in rows:
        span = "slides" if row["range_degrees"] is None else f"{row['range_degrees']:.0f} degrees"
        groups = "dyads" if row["dyadic"] else "larger groups"
        console.put(
            f"{row['error']:.5f}  {row['links']} links  {groups:13}  driver {row['driver']} {span:11}  {row['key']}"
        )
    console.put(f"{len(found)} of {len(index)} curves ({seconds:.3f} s); errors over the size of the wanted curve")
    return 0


def _points(path: Path) -> NDArray[np.float64]:
    """Read two numbers from every line, or three; commas, semicolons or blanks stand between."""
    try:
        lines = read_bytes(path, _LONGEST, "a curve").decode("utf-8").splitlines()
    except UnicodeDecodeError:
        raise FormatError("is not a text; give x and y on every line", str(path)) from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        parts = line.replace(",", " ").replace(";", " ").split()
        if not parts or parts[0].startswith("#"):
            continue
        try:
            rows.append([float(part) for part in parts])
        except ValueError:
            raise FormatError("does not hold numbers; give x and y", f"{path}, line {number}") from None
        if len(parts) not in (_POSE - 1, _POSE) or len(parts) != len(rows[0]):
            raise FormatError("does not hold two numbers, or three as all others do", f"{path}, line {number}")
    if not rows:
        raise SpecError(f"{path} holds no points; give x and y on every line")
    return np.array(rows)


def _verify(options: argparse.Namespace) -> int:
    index = CurveIndex(options.folder)
    index.verify()
    if options.json:
        console.put_json({"folder": str(options.folder), "curves": len(index), "passed": True})
    else:
        console.put(f"{options.folder}: {len(index)} curves, every file as its checksum says")
    return 0
