"""Change the orbit engine a little, many times, and see whether any change gives all the counts it should not.

``python tests/mutation/counts.py --count 200`` draws changes of the modules that make and count labellings, and
``--all --out FILE`` makes every one, going on where it was stopped.  Each is made in a fork of this process, where the
kernels are interpreted: a second for each, where compiling takes half a minute.  A change is noticed when an answer of
``questions.py`` differs, an error is raised, or an answer takes several times its usual processor time.  What is not
noticed is listed; ``known.toml`` says which changes alter nothing that can be seen, and ``run.py`` runs the tests
against any one.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import random
import resource
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"  # before numba is imported

import questions
from run import _line, known
from sites import Change, changes

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests/synthesis"))  # the second count and what is found by trying everything
ENGINE = ROOT / "graphsynth/synthesis"
NAMES = ("edge_labels", "families", "fractionated", "geared_trees", "rigid_blocks", "totals", "wishes")
KERNELS = ("colouring", "contracted", "counting", "covers", "expanding", "gears")
KERNELS += ("growing", "listing", "moving", "splitting", "variables")
SECOND = ROOT / "tests/synthesis/rigid_clusters.py"
MODULES = [*(ENGINE / f"{name}.py" for name in NAMES), *(ENGINE / "kernels" / f"{name}.py" for name in KERNELS), SECOND]
#: What only estimates work or room, chooses between two ways to count, or is not counted here.
BESIDE = {"work", "weigh_block",
          "_visited", "_least", "_stays", "labellings", "_ways", "_known_ways", "_costs", "weight",
          "make_work", "open_fixed", "decode_fixed", "_nth_label", "expand_text", "_put_number", "_put_plain",
          "_lay_pairs", "_is_ordered", "_smallest_sets_first", "refine",
          "is_counted_together", "totals_of", "_search_order", "identity_sums"}  # fmt: skip
MEMORY = 6 * 2**30
Row = dict[str, Any]


class _TooLong(BaseException):
    """No part of the engine catches it."""


def _stop(number: int, frame: Any) -> None:
    raise _TooLong


def _interpret() -> None:
    """Give the operations of the processor to interpreted kernels."""
    from graphsynth.core import intrinsics

    intrinsics.popcount = lambda mask: int(mask).bit_count()
    intrinsics.lowest_bit = lambda mask: (int(mask) & -int(mask)).bit_length() - 1 if mask else 64


def _name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts) if path.is_relative_to(ENGINE) else path.stem


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield the code of a source and of all functions in it."""
    yield code
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _codes(one)


class _Fork:
    """A copy of this process for what stands in the body; what it says is there afterwards, or None."""

    said: Any = None

    def __enter__(self) -> _Fork:
        self._reading, self._writing = os.pipe()
        self._process = os.fork()
        self.child = self._process == 0
        return self

    def say(self, what: Any) -> None:
        with os.fdopen(self._writing, "w") as answer:
            json.dump(what, answer)

    def __exit__(self, *error: object) -> None:
        if self.child:
            os._exit(0)
        os.close(self._writing)
        with os.fdopen(self._reading) as answer:
            said = answer.read()
        os.waitpid(self._process, 0)
        self.said = json.loads(said) if said else None


class Engine:
    """The modules as they are imported, and the questions with their usual seconds."""

    def __init__(self, paths: list[Path]) -> None:
        for path in paths:
            if (taken := import_module(_name(path)).__file__) != str(path):
                raise SystemExit(f"{path.stem} is imported from {taken}, not from this checkout: set PYTHONPATH={ROOT}")
        files = {str(path) for path in paths}
        self.functions: dict[tuple[str, str], list[FunctionType]] = {}
        for one in gc.get_objects():
            if isinstance(one, FunctionType) and one.__code__.co_filename in files:
                key = one.__code__.co_filename, one.__code__.co_qualname
                self.functions.setdefault(key, []).append(one)
        self.usual: dict[str, float] = {}
        self.runs: dict[str, set[tuple[str, str]]] = {}
        self.by: dict[tuple[str, str], Counter[str]] = {}

    def change(self, path: Path, source: str) -> set[tuple[str, str]]:
        """Give the functions of a module the code of another source, and return which ones differ."""
        found = set()
        for code in _codes(compile(source, str(path), "exec")):
            for function in self.functions.get((str(path), code.co_qualname), ()):
                if function.__code__ != code:
                    function.__code__ = code
                    found.add((str(path), code.co_qualname))
        return found

    def see_what_runs(self) -> None:
        """Ask each question in a fork of its own, where nothing is kept of others, and note which functions run."""

        def note(frame: Any, event: str, what: Any) -> None:
            if event == "call" and frame.f_code.co_filename in files:
                ran.add((frame.f_code.co_filename, frame.f_code.co_qualname))

        files = {file for file, _ in self.functions}
        for name, question, _ in (*questions.of_the_engine(), *questions.of_the_second_count()):
            ran: set[tuple[str, str]] = set()
            with _Fork() as fork:
                if fork.child:
                    sys.setprofile(note)
                    question()
                    sys.setprofile(None)
                    fork.say([*ran])
            self.runs.setdefault(name, set()).update(map(tuple, fork.said))

    def questions(self, path: Path, change: Change | None, changed: set[tuple[str, str]]) -> list[questions.Question]:
        """Return the questions that run what is changed, first those that noticed changes of the same function."""
        asked = questions.of_the_second_count() if path == SECOND else questions.of_the_engine()
        asked = [one for one in asked if not change or self.runs[one[0]] & changed]
        noticed = {one[0]: self._noticed(path, change, one[0]) for one in asked}
        return sorted(asked, key=lambda one: (-noticed[one[0]], self.usual.get(one[0], 0.0)))

    def _noticed(self, path: Path, change: Change | None, question: str) -> float:
        """How many changes of the function, and of its module, a question noticed, for its time."""
        function = self.by.get((path.stem, change.function if change else ""), Counter())
        alike = function[question] + 0.1 * self.by.get((path.stem, ""), Counter())[question]
        return alike / (0.05 + self.usual.get(question, 0.0))

    def answer(self, path: Path, change: Change | None) -> dict[str, float] | str:
        """Return the first question that is answered wrongly, or the seconds that each took."""
        changed = self.change(path, change.applied(path.read_text("utf-8"))) if change else set()
        seconds = {}
        for name, question, right in self.questions(path, change, changed):
            begin = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, 0.5 + 3 * self.usual.get(name, 10.0))
            try:
                if (found := question()) != right:
                    return f"{name}: {found}"
            except _TooLong:
                return f"{name}: time is up"
            except (Exception, SystemExit) as error:
                return f"{name}: {type(error).__name__}"
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
            seconds[name] = time.process_time() - begin
        return seconds

    def judge(self, path: Path, change: Change | None) -> Row:
        """Ask the questions of one change in a fork."""
        begin = time.monotonic()
        with _Fork() as fork:
            if fork.child:
                resource.setrlimit(resource.RLIMIT_CPU, (120, 120))
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
                signal.signal(signal.SIGPROF, _stop)
                fork.say(self.answer(path, change))
        by = "no answer" if fork.said is None else fork.said
        if isinstance(by, dict):
            self.usual.update(by if change is None else {})
            by = ""
        elif change:
            for function in (change.function, ""):
                self.by.setdefault((path.stem, function), Counter())[by.partition(":")[0]] += 1
        place = {"module": str(path.relative_to(ROOT)), "status": "killed" if by else "survived", "by": by}
        return {**(vars(change) if change else {}), **place, "seconds": round(time.monotonic() - begin, 1)}


def _key(row: Row) -> tuple[Any, ...]:
    return row["module"], row["function"], row["start"], row["old"], row["new"]


def table(rows: list[Row]) -> str:
    """Say for each module how many changes were made, noticed (and of these by time), and how many alter nothing."""
    lines = ["| module | changes | noticed | by time | alter nothing | not noticed |", "|---|--:|--:|--:|--:|--:|"]
    sums: Counter[str] = Counter()
    for module in sorted({row["module"] for row in rows}):
        own: Counter[str] = Counter()
        for row in (row for row in rows if row["module"] == module):
            lives = row["status"] == "survived"
            own["all"] += 1
            own["noticed"] += not lives
            own["time"] += row["by"].endswith("time is up") or row["by"] == "no answer"
            own["known"] += lives and bool(known(row))
        sums += own
        lines.append(_cells(f"`{Path(module).stem}`", own))
    return "\n".join([*lines, _cells("all", sums)])


def _cells(name: str, own: Counter[str]) -> str:
    open_ = own["all"] - own["noticed"] - own["known"]
    return f"| {name} | {own['all']} | {own['noticed']} | {own['time']} | {own['known']} | {open_} |"


def main() -> int:
    """Run, and print what was not noticed; status 1 if that is anything whose reason is not known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--all", action="store_true", help="every change instead of --count of them")
    parser.add_argument("--modules", nargs="+", default=[path.stem for path in MODULES], help="names to draw from")
    parser.add_argument("--out", type=Path, help="file of a line for each change: those in it are not made again")
    parser.add_argument("--again", action="store_true", help="make those again that were not noticed and are not known")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    _interpret()
    engine = Engine(MODULES)
    for path in (SECOND, ENGINE):
        if wrong := engine.judge(path, None)["by"]:
            print(f"the code as it is answers wrongly: {wrong}")
            return 1
    engine.see_what_runs()
    found = [(path, c) for path in MODULES if path.stem in options.modules for c in changes(path.read_text("utf-8"))]
    found = [one for one in found if one[1].function not in BESIDE]
    drawn = found if options.all else random.Random(options.seed).sample(found, min(options.count, len(found)))
    lines = options.out.read_text("utf-8").splitlines() if options.out and options.out.exists() else []
    done = {_key(row): row for row in map(json.loads, lines)}
    if options.again:
        done = {key: row for key, row in done.items() if row["status"] == "killed" or known(row)}
    rows = []
    for path, change in drawn:
        row = {**vars(change), "module": str(path.relative_to(ROOT))}
        if _key(row) in done:
            rows.append(done[_key(row)])
            continue
        rows.append(engine.judge(path, change))
        print(f"{len(rows)}/{len(drawn)} {_line(rows[-1])}", flush=True)
        if options.out:
            with options.out.open("a", encoding="utf-8") as out:
                print(json.dumps(rows[-1]), file=out)
    print(table(rows))
    open_ = [row for row in rows if row["status"] == "survived" and not known(row)]
    for row in open_:
        print("unnoticed:", _line(row))
    return bool(open_)


if __name__ == "__main__":
    raise SystemExit(main())
