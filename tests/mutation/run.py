"""Change the code a little, many times, and see whether a test notices.

``python tests/mutation/run.py --count 300 --out mutants.jsonl`` draws changes spread over rooms, modules and functions,
makes each in a copy of the checkout, and runs the test files nearest to the changed module until one fails.  Kernels
are compiled anew where the change reaches.  Interrupted, the same command goes on.  A file that no test notices is
listed; ``known.toml`` beside this script says which changes alter nothing that can be seen, and why.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import deque
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from functools import cache
from pathlib import Path
from queue import Queue

from sites import Change, changes

ROOT = Path(__file__).parents[2]
ROOMS = ("intervals", "jamming", "kinematics", "synthesis", "structure", "dynamics")
#: No test takes longer on any correct code; one that does hangs.
HANG = 300
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


@cache
def _names(path: Path) -> frozenset[str]:
    """Modules of the package that a file imports, by statement or as a string, lazily or not."""
    source = path.read_text("utf-8")
    names = set(re.findall(r"graphsynth(?:\.\w+)+", source))
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


@cache
def _users() -> dict[str, set[Path]]:
    """Which files name a module."""
    modules = set((ROOT / "graphsynth").rglob("*.py"))
    known = {".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): p for p in modules}
    users: dict[str, set[Path]] = {name: set() for name in known}
    for path in sorted(modules) + sorted((ROOT / "tests").rglob("*.py")):
        for name in _names(path):
            while name and name not in known:
                name = name.rpartition(".")[0]
            if name and known[name] != path:
                users[name].add(path)
    return users


def tests_of(module: str, most: int = 24) -> list[str]:
    """Test files of a module's room and those that reach it by imports, nearest and most alike in name first."""
    name = ".".join(Path(module).with_suffix("").parts).removesuffix(".__init__")
    room = Path(module).parts[1]
    distance, waiting = {name: 0}, deque([name])
    files = dict.fromkeys(sorted((ROOT / "tests" / room).rglob("test_*.py")), 99)
    while waiting:
        here = waiting.popleft()
        for path in sorted(_users().get(here, ())):
            if path.is_relative_to(ROOT / "tests"):
                if path.name.startswith("test_") and "bench" not in path.parts:
                    files[path] = min(distance[here], files.get(path, 99))
            else:
                other = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
                if other not in distance and other != "graphsynth":
                    distance[other] = distance[here] + 1
                    waiting.append(other)
    words = set(re.split(r"[_/.]", module))

    def rank(path: Path) -> tuple[bool, int, int]:
        near = path.relative_to(ROOT)
        return near.parts[1] != room, -len(words & set(re.split(r"[_/.]", str(near)))), files[path]

    return [str(path.relative_to(ROOT)) for path in sorted(files, key=rank)[:most]]


def judge(folder: Path, module: str, change: Change, seconds: float) -> dict[str, object]:
    """Make one change in a copy, run the tests, and take it back."""
    path, begin = folder / module, time.monotonic()
    source = path.read_text("utf-8")
    path.write_text(change.applied(source), "utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-o",
               f"faulthandler_timeout={HANG}", "-o", "faulthandler_exit_on_timeout=true",
               *tests_of(module)]  # fmt: skip
    environment = dict(os.environ, PYTHONPATH=str(folder))
    try:
        ended = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=seconds)
        said = re.findall(r"(?m)^(?:FAILED|ERROR) (\S+)", ended.stdout)
        status = "survived" if ended.returncode in (0, 5) else "killed"
        by = said[0] if said else ("" if status == "survived" else f"exit {ended.returncode}")
    except subprocess.TimeoutExpired:
        status, by = "survived", "time is up"
    finally:
        path.write_text(source, "utf-8")
    took = round(time.monotonic() - begin, 1)
    return {"module": module, **asdict(change), "status": status, "by": by, "seconds": took}


def known(row: dict[str, object]) -> str:
    """Why a change alters nothing that can be seen, if that is known."""
    entries = tomllib.loads(KNOWN.read_text("utf-8")).get("equivalent", []) if KNOWN.exists() else []
    fit = (e["why"] for e in entries if all(e[k] == row[k] for k in ("module", "function", "old", "new")))
    return next(fit, "")


def main() -> int:
    """Run, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rooms", nargs="+", default=ROOMS, choices=ROOMS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=400, help="for the tests of one change")
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    options = parser.parse_args()
    wanted = sample(options.count, options.seed, tuple(options.rooms))
    rows = [json.loads(line) for line in options.out.read_text("utf-8").splitlines()] if options.out.exists() else []
    done = {(row["module"], row["start"], row["new"]) for row in rows}
    waiting = [(module, c) for module, c in wanted if (module, c.start, c.new) not in done]
    with tempfile.TemporaryDirectory() as temporary, options.out.open("a", encoding="utf-8") as out:
        folders: Queue[Path] = Queue()
        for k in range(options.jobs):
            folder = Path(temporary, str(k))
            shutil.copytree(
                ROOT, folder, ignore=shutil.ignore_patterns(".git", ".venv*", ".hypothesis", "build", ".*_cache")
            )
            folders.put(folder)

        def one(module: str, change: Change) -> dict[str, object]:
            folder = folders.get()
            try:
                return judge(folder, module, change, options.seconds)
            finally:
                folders.put(folder)

        with ThreadPoolExecutor(options.jobs) as pool:
            for future in as_completed([pool.submit(one, *item) for item in waiting]):
                row = future.result()
                rows.append(row)
                print(json.dumps(row), file=out, flush=True)
                print(f"{len(rows)}/{len(wanted)} {row['status']:8} {row['module']}:{row['line']} "
                      f"{row['old']!r} -> {row['new']!r} {row['by']} {row['seconds']} s", flush=True)  # fmt: skip
    lived = [row for row in rows if row["status"] == "survived"]
    equivalent = [row for row in lived if known(row)]
    open_ = [row for row in lived if not known(row)]
    noticed = len(rows) - len(lived)
    print(f"{len(rows)} changes: {noticed} noticed, {len(equivalent)} alter nothing, {len(open_)} unnoticed")
    print(f"noticed: {100 * noticed / max(1, len(rows) - len(equivalent)):.1f} % of those that alter something")
    for row in open_:
        print(f"  {row['module']}:{row['line']} in {row['function']}: {row['old']!r} -> {row['new']!r} {row['by']}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
