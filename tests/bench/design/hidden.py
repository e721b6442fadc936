"""Curves and functions of hidden random mechanisms, of which `design` is told nothing else: how near it comes.

``python -m tests.bench.design.hidden --out FOLDER`` goes on where it stopped; ``--count 1000`` asks for so many of
each kind, ``--only functions`` for one kind, ``--index FOLDER`` begins with the nearest curves of an index that is
there (else one of ``--curves`` curves is built first).  Run it on one thread (``OMP_NUM_THREADS=1``).
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from graphsynth.core.errors import GraphsynthError
from graphsynth.design import CurveIndex, DesignTask, FunctionTarget, PathTarget, design, index_starts
from graphsynth.design.curves.families import Family, families
from graphsynth.design.curves.sampling import draw
from graphsynth.design.task.targets import MOST, evenly
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Error over the size that counts as found; shares of four, six and eight links.
NEAR, SHARES = 1e-3, {4: 0.1, 6: 0.3, 8: 0.6}
#: Positions of a hidden motion; points of a curve that are given, and more where so few do not tell it; of a function.
_FINE, _POINTS, _ANGLES = 2048, 96, 36
#: Of the error that counts as found: what the polygon of a curve may differ from it, and what it is asked for with.
_TOLD, _ASKED = 0.25, 0.6
#: Smallest swing of a function; drawn mechanisms of a family.
_SWING, _DRAWN = 0.1, 4
#: What a range that is not a full turn lacks at either end.
_CUT = 0.05
#: The random numbers: of this benchmark, not of the index, which has 0.
_SEED = 20_261_123


class Hidden(NamedTuple):
    """A mechanism that moves: links, dyads only, drive, its range; inputs (n,) and a curve or angle."""

    links: int
    dyadic: bool
    drive: str
    span: float
    inputs: Array
    values: Any

    @property
    def size(self) -> float:
        """Of a curve its largest distance from its middle, of a function its swing."""
        if self.values.dtype == np.float64:
            return float(np.ptp(self.values))
        z = evenly(self.values, 48, self.drive == "rotation")
        return float(np.abs(z - z.mean()).max())


@dataclass(frozen=True)
class Row:
    """One hidden mechanism and what was found: the largest error over the size, with a mechanism of so many links."""

    kind: str
    number: int
    hidden_links: int
    hidden_dyadic: bool
    drive: str
    error: float
    links: int
    pieces: int
    seconds: float


@cache
def _families(links: int) -> list[Family]:
    return families([links], 0)


def hidden(kind: str, number: int) -> Hidden:
    """Draw the hidden mechanism of a number, the same on every machine."""
    random = np.random.default_rng([_SEED, ("curves", "functions").index(kind), number])
    while True:
        every = _families(int(random.choice(list(SHARES), p=list(SHARES.values()))))
        family = every[int(random.integers(len(every)))]
        drawn = draw(family, _DRAWN, random)
        if not len(drawn.link):
            continue
        row = int(random.integers(len(drawn.link)))
        found = _moved(kind, family, drawn, row, random)
        if found is not None:
            return found


def _moved(kind: str, family: Family, drawn: Any, row: int, random: np.random.Generator) -> Hidden | None:
    """Move a mechanism that was drawn, finely; None if it hardly swings."""
    graph, closed = family.design.graph, bool(drawn.closed[row])
    own = family.design.mechanism(drawn.places[row].astype(float), drawn.numbers[row].astype(float))
    first, last = (0.0, math.tau) if closed else (float(drawn.first[row]), float(drawn.last[row]))
    if not closed:  # not up to a dead centre
        first, last = first + _CUT * (last - first), last - _CUT * (last - first)
        if first > 0.0 or last < 0.0:
            return None
    parts = [simulate(own, np.linspace(0.0, end, _FINE + 1), events=False) for end in (first, last) if end != 0.0]
    if not all(part.completed for part in parts):
        return None

    def joined(of: Callable[[Any], Any]) -> Any:
        found = [of(part) for part in parts]
        both = np.concatenate([found[0][:0:-1], found[-1]]) if len(parts) > 1 else found[0]
        return both if len(parts) > 1 or last > 0.0 else both[::-1]

    inputs = joined(lambda part: part.inputs)
    inputs = inputs - inputs[0]
    if kind == "functions":
        outputs = [k for k in range(1, graph.links) if graph.neighbours[0] >> k & 1 and k != family.driven]
        link = int(random.choice(outputs))
        theta = np.unwrap(joined(lambda part: part.poses[:, link, 2]))
        values: Any = theta - theta[0]
        if np.ptp(values) < _SWING:
            return None
    else:
        link, point = int(drawn.link[row]), complex(*drawn.point[row].tolist())
        pose = joined(lambda part: part.poses[:, link])
        values = pose[:, 0] + 1j * pose[:, 1] + np.exp(1j * pose[:, 2]) * point
    drive = "rotation" if closed else "rocking"
    return Hidden(graph.links, family.dyadic, drive, float(inputs[-1]), inputs, values)


def task_of(kind: str, own: Hidden) -> DesignTask:
    """Ask for the curve or function, with bounds that do not bind."""
    target: PathTarget | FunctionTarget
    if kind == "functions":
        at = np.linspace(0.0, own.span, _ANGLES, endpoint=own.drive != "rotation")
        outputs = np.interp(at, own.inputs, own.values).tolist()
        target = FunctionTarget(inputs=at.tolist(), outputs=outputs, tolerance=NEAR * own.size)
    else:
        z = polygon(own)
        target = PathTarget(
            points=[(p.real, p.imag) for p in z.tolist()], closed=own.drive == "rotation", tolerance=_ASKED * NEAR
        )
    free: dict[str, Any] = {"transmission": 0.0, "length_ratio": 1e3, "lengths": (1e-3 * own.size, 1e3 * own.size)}
    if kind == "functions":
        free["lengths"] = (1e-3, 1e3)
    return DesignTask(targets=[target], drive=own.drive, span=own.span, links=list(SHARES), **free)  # type: ignore[arg-type]


def polygon(own: Hidden) -> Complex:
    """Points of a curve, evenly along it, and more where their polygon would not tell it."""
    z, closed = own.values, own.drive == "rotation"
    near = evenly(z, _POINTS, closed)
    at = [0, *(int(np.abs(z - point).argmin()) for point in near[1:-1]), len(z) - 1]
    while len(at) < MOST:
        sides = [(k, _distances(z[k : end + 1], z[[k, end]])) for k, end in pairwise(sorted({*at}))]
        more = [k + int(far.argmax()) for k, far in sides if far.max() > _TOLD * NEAR * own.size]
        if not more:
            break
        at += more
    return np.asarray(z[sorted({*at})[: -1 if closed else None]][:MOST])


def _distances(z: Complex, corners: Complex) -> Array:
    """Distances of points from a polyline."""
    side = np.diff(corners)
    found = np.empty(len(z))
    for at in range(0, len(z), 64):
        own = z[at : at + 64, None]
        part = np.clip((np.conj(side) * (own - corners[:-1])).real / np.maximum(np.abs(side) ** 2, 1e-300), 0.0, 1.0)
        found[at : at + 64] = np.abs(own - corners[:-1] - part * side).min(axis=1)
    return found


def error_of(kind: str, own: Hidden, mechanism: Mechanism, link: int) -> float:
    """Largest error over the size, of the whole curve or function: simulated anew, finely.

    Of a closed curve the larger of both distances, of the curve from the hidden one and back; of an open one, which
    may go on, that of the hidden one; of a function half the spread of the differences.
    """
    motion = simulate(mechanism, np.linspace(0.0, own.span, _FINE + 1), events=False)
    if not motion.completed:
        return math.inf
    if kind == "functions":
        theta = np.unwrap(motion.poses[:, link, 2])
        return float(0.5 * np.ptp(theta - np.interp(motion.inputs, own.inputs, own.values))) / own.size
    z: Any = motion.point("P").position @ [1.0, 1.0j]
    far = _distances(own.values[::4], z).max()
    if own.drive == "rotation":
        far = max(far, _distances(z[::4], own.values).max())
    return float(far) / own.size


def found_for(kind: str, number: int, seconds: float, index: CurveIndex | None, count: int) -> Row:
    """Ask `design` for at most so many seconds of the processor."""
    own = hidden(kind, number)
    task, begin, pieces = task_of(kind, own), process_time(), 0

    def watch(progress: Any) -> None:
        nonlocal pieces
        pieces = progress.pieces
        if process_time() - begin > seconds:
            raise KeyboardInterrupt  # the search then gives what it has

    starts = None if index is None or kind == "functions" else index_starts(index, count)
    error, links = math.inf, 0
    try:
        answers = design(task, seconds=1e6, count=1, seed=number, starts=starts, progress=watch).answers
    except GraphsynthError:
        answers = ()
    used = process_time() - begin
    for answer in answers:
        link = next(iter(answer.carriers.values()))
        if all(reason.endswith("is missed") for reason in answer.reasons):
            error, links = min((error, links), (error_of(kind, own, answer.mechanism, link), answer.links))
    return Row(kind, number, own.links, own.dyadic, own.drive, error, links, pieces, used)


def read(path: Path) -> list[Row]:
    """Read what is done."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return [
            Row(r["kind"], int(r["number"]), int(r["hidden_links"]), r["hidden_dyadic"] == "True", r["drive"],
                float(r["error"]), int(r["links"]), int(r["pieces"]), float(r["seconds"]))
            for r in csv.DictReader(stream)
        ]  # fmt: skip


def add(path: Path, row: Row) -> None:
    """Write one more row."""
    fresh = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        if fresh:
            writer.writerow([field.name for field in fields(Row)])
        writer.writerow([f"{value:.4g}" if isinstance(value, float) else value for value in asdict(row).values()])


def share(found: int, count: int) -> tuple[float, float]:
    """Bounds of a share with 95 % confidence, exact (Clopper and Pearson).

    >>> [round(bound, 3) for bound in share(9, 10)]
    [0.555, 0.997]
    """
    low, high = binomtest(found, count).proportion_ci(0.95, method="exact")
    return float(low), float(high)


def table(rows: list[Row]) -> str:
    """Write shares by kind and number of links of the hidden mechanism."""
    lines = ["| hidden | links | number | found to 1e-3 | 95 % confidence | to 1e-2 | median error | median CPU s |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for kind in ("curves", "functions"):
        for links in (0, *SHARES):
            own = [row for row in rows if row.kind == kind and links in (0, row.hidden_links)]
            if not own:
                continue
            good, fair = (sum(row.error <= near for row in own) for near in (NEAR, 10 * NEAR))
            low, high = share(good, len(own))
            n, middle = len(own), float(np.median([row.error for row in own]))
            used = float(np.median([row.seconds for row in own]))
            lines.append(
                f"| {kind} | {links or 'all'} | {n} | {100 * good / n:.0f} % | {100 * low:.0f} to {100 * high:.0f} % "
                f"| {100 * fair / n:.0f} % | {middle:.1e} | {used:.1f} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure what is asked and not there yet; print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.design.hidden", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("hidden-benchmark"))
    parser.add_argument("--count", type=int, default=200, help="hidden mechanisms of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--seconds", type=float, default=20.0, help="of the processor, at most, for each")
    parser.add_argument("--only", nargs="*", default=["curves", "functions"], choices=["curves", "functions"])
    parser.add_argument("--index", type=Path, help="folder of an index of curves; --curves 0: none")
    parser.add_argument("--curves", type=int, default=1_000_000, help="curves of the index that is built")
    parser.add_argument("--starts", type=int, default=32, help="curves of the index with which a search begins")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    results, index = given.out / "hidden.csv", None
    if "curves" in given.only and given.curves:
        place = given.index or given.out / "index"
        index = CurveIndex(place) if given.index else CurveIndex.build(place, given.curves, sliders=0)
    done = {(row.kind, row.number) for row in read(results)}
    for number in range(given.first, given.first + given.count):
        for kind in given.only:
            if (kind, number) not in done:
                row = found_for(kind, number, given.seconds, index, given.starts)
                add(results, row)
                print(row, flush=True)
    print(table(read(results)))


if __name__ == "__main__":
    main()
