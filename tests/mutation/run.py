"""Change the code a little, many times, and see whether a test notices.

``python tests/mutation/run.py --count 300 --out mutants.jsonl`` draws changes spread over rooms, modules and functions,
makes each in a copy of the checkout, and runs the test files nearest to the changed module until one fails; with
``--touched`` the tests that run the changed function, as the plugin ``touched.py`` wrote down.  Kernels are compiled
anew where the change reaches.  Interrupted, the same command goes on.  What no test notices is listed; ``known.toml``
beside this script says which changes alter nothing that can be seen, and why.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from queue import Queue

from choice import is_compiled, nearest_files, touching
from sites import Change, changes

ROOT = Path(__file__).parents[2]
ROOMS = ("intervals", "jamming", "kinematics", "synthesis", "structure", "dynamics")
#: Seconds: no quick test takes longer on any correct code, where nothing has to be compiled; one that does hangs.
HANG = 100
#: Bytes of address space for the tests of one change.
MEMORY = 12 * 2**30
KNOWN = Path(__file__).with_name("known.toml")


def sample(count: int, seed: int, rooms: tuple[str, ...]) -> list[tuple[str, Change]]:
    """Draw changes: as many of each room; there, first a module (by its size), then a function, then a change."""
    draw = random.Random(seed)
    chosen: dict[tuple[str, Change], None] = {}
    modules = {room: sorted((ROOT / "graphsynth" / room).rglob("*.py")) for room in rooms}
    found = {path: changes(path.read_text("utf-8")) for paths in modules.values() for path in paths}
    rooms = tuple(room for room in rooms if any(found[path] for path in modules[room]))
    while len(chosen) < count:
        paths = modules[rooms[len(chosen) % len(rooms)]]
        path = draw.choices(paths, [len(found[p]) for p in paths])[0]
        function = draw.choice(sorted({c.function for c in found[path]}))
        change = draw.choice([c for c in found[path] if c.function == function])
        chosen[str(path.relative_to(ROOT)), change] = None
    return list(chosen)


def _alone() -> None:
    """Bound what a test that went astray can take."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def judge(folder: Path, module: str, change: Change, tests: list[str], seconds: float) -> dict[str, object]:
    """Make one change in a copy, run the tests, and take it back."""
    path, begin = folder / module, time.monotonic()
    source = path.read_text("utf-8")
    path.write_text(change.applied(source), "utf-8")
    hang = HANG * (3 if is_compiled(module) else 1)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-o",
               f"faulthandler_timeout={hang}", "-o", "faulthandler_exit_on_timeout=true", *tests]  # fmt: skip
    with tempfile.TemporaryDirectory() as kept:  # what was compiled of the change
        environment = dict(os.environ, PYTHONPATH=str(folder), NUMBA_CACHE_DIR=kept)
        process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True,
                                   stderr=subprocess.PIPE, start_new_session=True, preexec_fn=_alone)  # fmt: skip
        try:
            out, err = process.communicate(timeout=seconds)
            said = re.findall(r"(?m)^(?:FAILED|ERROR) (\S+)", out)
            status = "survived" if process.returncode in (0, 5) else "killed"
            why = "hangs" if "Timeout (" in err else f"exit {process.returncode}"
            by = said[0] if said else ("" if status == "survived" else why)
        except subprocess.TimeoutExpired:
            status, by = "survived", "time is up"
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            path.write_text(source, "utf-8")
    took = round(time.monotonic() - begin, 1)
    return {"module": module, **asdict(change), "status": status, "by": by, "seconds": took}


def known(row: dict[str, object]) -> str:
    """Why a change alters nothing that can be seen, if that is known."""
    entries = tomllib.loads(KNOWN.read_text("utf-8")).get("equivalent", []) if KNOWN.exists() else []
    row = {
        **row,
        "code": (ROOT / str(row["module"])).read_text("utf-8").splitlines()[int(str(row["line"])) - 1].strip(),
    }
    fit = (e["why"] for e in entries if all(row[k] == e[k] for k in e.keys() - {"why"}))
    return next(fit, "")


def main() -> int:
    """Run, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rooms", nargs="+", default=ROOMS, choices=ROOMS, help="to draw from")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=400, help="for the tests of one change")
    parser.add_argument("--touched", type=Path, help="folder of what the plugin touched.py wrote")
    parser.add_argument("--only", nargs="+", default=ROOMS, choices=ROOMS, help="of the changes drawn, those of rooms")
    parser.add_argument("--again", action="store_true", help="try again what no test noticed and known.toml has not")
    parser.add_argument("--first", nargs="+", default=[], help="tests to run before the chosen ones")
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    options = parser.parse_args()
    wanted = sample(options.count, options.seed, tuple(options.rooms))
    wanted = [(module, change) for module, change in wanted if Path(module).parts[1] in options.only]
    lines = options.out.read_text("utf-8").splitlines() if options.out.exists() else []
    rows = {_key(row): row for row in map(json.loads, lines)}
    done = {key for key, row in rows.items() if not options.again or row["status"] == "killed" or known(row)}
    waiting = [(module, c) for module, c in wanted if (module, c.start, c.new) not in done]
    if options.again:
        waiting = [(module, c) for module, c in waiting if (module, c.start, c.new) in rows]
    with tempfile.TemporaryDirectory() as temporary, options.out.open("a", encoding="utf-8") as out:
        folders: Queue[Path] = Queue()
        for k in range(options.jobs):
            folder = Path(temporary, str(k))
            shutil.copytree(
                ROOT, folder, ignore=shutil.ignore_patterns(".git", ".venv*", ".hypothesis", "build", ".*_cache")
            )
            folders.put(folder)

        def one(module: str, change: Change) -> dict[str, object]:
            chosen = touching(options.touched, module, change.function) if options.touched else []
            tests = [*options.first, *(chosen or nearest_files(module))]
            folder = folders.get()
            try:
                return judge(folder, module, change, tests, options.seconds)
            finally:
                folders.put(folder)

        with ThreadPoolExecutor(options.jobs) as pool:
            for future in as_completed([pool.submit(one, *item) for item in waiting]):
                row = future.result()
                rows[_key(row)] = row
                print(json.dumps(row), file=out, flush=True)
                print(f"{len(rows)}/{len(wanted)} {_line(row)}", flush=True)
    return report(list(rows.values()))


def _key(row: dict[str, object]) -> tuple[object, ...]:
    return row["module"], row["start"], row["new"]


def _line(row: dict[str, object]) -> str:
    where = f"{row['module']}:{row['line']} in {row['function']}: {row['old']!r} -> {row['new']!r}"
    return f"{row['status']:8} {where} {row['by']} {row['seconds']} s"


def report(rows: list[dict[str, object]]) -> int:
    """Print what no test noticed, and how much was noticed."""
    for row in rows:
        print(_line(row), known(row) if row["status"] == "survived" else "")
    lived = [row for row in rows if row["status"] == "survived"]
    equivalent = [row for row in lived if known(row)]
    open_ = [row for row in lived if not known(row)]
    noticed = len(rows) - len(lived)
    print(f"{len(rows)} changes: {noticed} noticed, {len(equivalent)} alter nothing, {len(open_)} unnoticed")
    print(f"noticed: {100 * noticed / max(1, len(rows) - len(equivalent)):.1f} % of those that alter something")
    for row in open_:
        print(" ", _line(row))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
