"""Kill, end, double and spoil long commands at random, again and again, and compare what they give in the end.

    python tests/kills/campaign.py --kills 1000 --seed 1

A round takes one command, disturbs it a few times, then lets it end and compares its answer with that of an undisturbed
one.  Commands run in forks of this process, which has the kernels loaded, and one in twenty as a program of its own.
Prints one JSON document; status 1 if an answer was wrong, a traceback was shown, a command gave an unexpected status or
message, or a worker was left behind.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from graphsynth.cli import main

OWN = {0, 130, 143}
PATIENCE = 60.0  # seconds for any one command
REFUSALS = (
    "is being written by another process",
    "another process writes this catalogue",
    "cannot be written (database is locked)",
    "cannot be opened as a catalogue (database is locked)",
    "killed while they worked, again and again",
)
NOT_DONE = ("answers", "refused", "before the program begins")
DAMAGED = ("not the result of", "not a journal of graphsynth")

FAMILY = """
import time
from dataclasses import dataclass
from typing import Literal
from graphsynth.pipeline.system import System
from graphsynth.pipeline.products import Record
from graphsynth.pipeline.system import COLLECT, Stage

@dataclass(frozen=True, slots=True)
class Table:
    module: Literal["beads"]
    count: int

class Bead:
    def __init__(self, number):
        self.number, self.key = number, f"bead-{number}"

def beads(context):
    for number in range(1, context.scene.mechanism.count + 1):
        yield Bead(number)

def weigh(context, bead):
    time.sleep(0.01)
    return Record(verdict=f"{bead.number ** 2} g", good=bead.number % 3 != 0)

SYSTEM = System(
    Table,
    (
        Stage("beads", "campaign_beads:beads", (), ("beads",), stream=True),
        Stage("weigh", "campaign_beads:weigh", ("beads",), ("record",), each=True),
        COLLECT,
    ),
    structure="none",
)
"""
SCENE = """
[scene]
name = "beads"
title = "Beads"
[mechanism]
module = "beads"
count = 40
[outputs]
products = ["records"]
"""


@dataclass
class Job:
    """A command with a journal, or a catalogue, in a folder; `answer` reads what it gave."""

    name: str
    words: list[str]
    answer: Callable[[Path, str], str]
    journal: str = ""
    data: str = ""
    first: Callable[[Path], None] = lambda folder: None
    seconds: float = 1.0
    right: str = ""


def digest(*data: bytes) -> str:
    return hashlib.sha256(b"\0".join(data)).hexdigest()


def rows(path: Path, queries: list[str]) -> str:
    with sqlite3.connect(path) as connection:
        found = [connection.execute(query).fetchall() for query in queries]
    connection.close()
    return digest(repr(found).encode())


CHAINS = [
    "SELECT key, label, assortment, family_id, chain_id FROM chains ORDER BY key",
    "SELECT mobility, links, pieces, cut, expected, complete FROM families ORDER BY 1, 2",
    "SELECT family_id, piece, first_chain, chains FROM pieces ORDER BY 1, 2",
    "SELECT chain_id, frame, driver, structure_id FROM driven ORDER BY 1, 2, 3",
]
EVALUATIONS = ["SELECT * FROM evaluations ORDER BY chain_id, frame, driver, kind"]


def copied(eight: Path, place: Path) -> None:
    """Lay a catalogue to evaluate into a folder."""
    if not eight.exists():
        run_here(["catalog", "build", "--links", "4..6", "-o", str(eight)], place, place / "o", place / "e")
    shutil.copy(eight, place / "x.sqlite")


def jobs(folder: Path) -> list[Job]:
    site = folder / "site"
    info = site / "campaign_beads-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "campaign_beads.py").write_text(FAMILY)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: campaign-beads\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[graphsynth.systems]\nbeads = campaign_beads:SYSTEM\n")
    sys.path.insert(0, str(site))
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH")]))
    scene, eight = folder / "beads.toml", folder / "eight.sqlite"
    scene.write_text(SCENE)
    return [
        Job(
            "count", ["count", "--links", "14", "--checkpoint", "ck.txt"],
            lambda place, text: text.strip().rpartition("\n")[2], "ck.txt",
        ),
        Job(
            "enumerate", ["enumerate", "--links", "12", "-o", "a.g6", "--resume"],
            lambda place, text: digest((place / "a.g6").read_bytes()), "a.g6.progress", "a.g6",
        ),
        Job(
            "run", ["run", str(scene), "--out", "out"],
            lambda place, text: digest((place / "out/results.csv").read_bytes(),
                                       (place / "out/candidates.jsonl").read_bytes()),
            "out/candidates.jsonl",
        ),
        Job(
            "build", ["catalog", "build", "--links", "4..10", "-o", "x.sqlite"],
            lambda place, text: rows(place / "x.sqlite", CHAINS),
        ),
        Job(
            "evaluate", ["catalog", "evaluate", "x.sqlite", "--tries", "1", "--limit", "12"],
            lambda place, text: rows(place / "x.sqlite", EVALUATIONS),
            first=lambda place: copied(eight, place),
        ),
    ]  # fmt: skip


# -- commands --------------------------------------------------------------------------------------------------------


@dataclass
class Command:
    pid: int
    out: Path
    err: Path
    begun: float = field(default_factory=time.monotonic)
    status: int | None = None

    def poll(self) -> int | None:
        if self.status is None:
            done, status = os.waitpid(self.pid, os.WNOHANG)
            if done:
                self.status = os.waitstatus_to_exitcode(status)
        return self.status

    def wait(self, seconds: float) -> int | None:
        end = time.monotonic() + seconds
        while self.poll() is None and time.monotonic() < end:
            time.sleep(0.005)
        return self.status


def begin(words: list[str], place: Path, number: int, program: bool) -> Command:
    out, err = place / f"out-{number}.log", place / f"err-{number}.log"
    for path in (out, err):
        path.touch()
    if program:
        with out.open("wb") as stdout, err.open("wb") as stderr:
            command = [sys.executable, "-m", "graphsynth", *words]
            process = subprocess.Popen(command, stdout=stdout, stderr=stderr, cwd=place)
        process.returncode = 0  # it is waited for by its number
        return Command(process.pid, out, err)
    pid = os.fork()
    if not pid:
        status = 70
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # as in a program that has just begun
        try:
            status = run_here(words, place, out, err)
        finally:
            os._exit(status)
    return Command(pid, out, err)


def run_here(words: list[str], place: Path, out: Path, err: Path) -> int:
    """Run a command in this process, its output in files, as the program does."""
    before, folder = [os.dup(1), os.dup(2)], Path.cwd()
    for number, path in ((1, out), (2, err)):
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(handle, number)
        os.close(handle)
    os.chdir(place)
    try:
        return main(words)
    except SystemExit as end:
        return int(end.code or 0)
    except BaseException:
        traceback.print_exc()
        return 71
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, handle in zip((1, 2), before):
            os.dup2(handle, number)
            os.close(handle)
        os.chdir(folder)


def children(pid: int) -> list[int]:
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += map(int, task.read_text().split())
        except OSError:
            continue
    return found


def workers(pid: int) -> list[int]:
    found = []
    for child in children(pid):
        try:
            if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                found.append(child)
        except OSError:
            continue
    return found


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# -- disturbances ----------------------------------------------------------------------------------------------------


class Campaign:
    def __init__(self, seed: int, folder: Path, only: list[str]) -> None:
        self.chance = random.Random(seed)
        self.folder = folder
        self.jobs = [job for job in jobs(folder) if not only or job.name in only]
        self.done: Counter[str] = Counter()
        self.faults: list[str] = []
        self.place = folder
        self.number = 0

    def prepare(self) -> None:
        """Run every command undisturbed, with the kernels of this process, for its answer and its time."""
        for job in self.jobs:
            for _ in range(1 + len(self.jobs) // 5):  # the first one compiles
                place = self.fresh(job)
                begun = time.monotonic()
                status = run_here(job.words, place, place / "out-0.log", place / "err-0.log")
                job.seconds = time.monotonic() - begun
                assert status == 0, (place / "err-0.log").read_text()
                job.right = job.answer(place, (place / "out-0.log").read_text())
                shutil.rmtree(place)
            assert len(job.right) > 3

    def fresh(self, job: Job) -> Path:
        place = self.folder / job.name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        job.first(place)
        return place

    def fault(self, job: Job, what: str, command: Command | None = None) -> None:
        said = command.err.read_text(errors="replace")[-2000:] if command else ""
        self.faults.append(f"{job.name}: {what} {said}")

    def begin(self, job: Job, shared: bool) -> Command:
        self.number += 1
        return begin(
            [*job.words, "--workers", "2" if shared else "1"], self.place, self.number, self.chance.random() < 0.05
        )

    def judge(self, job: Job, command: Command, allowed: tuple[str, ...] = (), killed: int = 0) -> None:
        """Look at how a command ended: its status, and what it said."""
        said = command.err.read_text(errors="replace")
        if killed == signal.SIGINT and starting(said):
            self.done["before the program begins"] += 1
        elif "Traceback" in said or "Error:" in said:
            self.fault(job, "traceback", command)
        elif command.status == 2:
            lines = [line for line in said.splitlines() if line.startswith("graphsynth: ")]
            if len(lines) != 1 or not any(reason in said for reason in (*REFUSALS, *allowed)):
                self.fault(job, "unexpected sentence", command)
            self.done["refused"] += 1
        elif command.status not in OWN and command.status != -killed:
            self.fault(job, f"status {command.status}", command)

    def round(self, job: Job, kills: int) -> None:
        self.place = self.fresh(job)
        for _ in range(kills):
            self.disturb(job)
            if job.journal and self.chance.random() < 0.4:
                self.spoil(job)
        for _ in range(8):
            command = self.begin(job, self.chance.random() < 0.05)
            if command.wait(PATIENCE) is None:
                os.kill(command.pid, signal.SIGKILL)
                command.wait(5)
                self.fault(job, "does not end", command)
                return
            self.judge(job, command)
            if command.status == 0:
                found = job.answer(self.place, command.out.read_text())
                if found != job.right:
                    self.fault(job, f"wrong answer {found}, not {job.right}", command)
                self.done["answers"] += 1
                return
        self.fault(job, "does not come to an end", command)

    def disturb(self, job: Job) -> None:
        """Start the command and do something to it."""
        what = self.chance.choice(["kill", "kill", "kill", "term", "term", "int", "twice", "worker"])
        shared = what == "worker" or self.chance.random() < 0.08
        command = self.begin(job, shared)
        wait = self.chance.random() * 1.1 * job.seconds
        if shared:
            wait += self.chance.random() * 1.5  # workers take their time to start
        if what == "twice":
            self.twice(job, command, wait)
        elif what == "worker":
            self.kill_worker(job, command, wait)
        else:
            number = {"kill": signal.SIGKILL, "term": signal.SIGTERM, "int": signal.SIGINT}[what]
            early = command.wait(wait)
            below = [] if early is not None else [command.pid, *children(command.pid)]
            if early is None:
                os.kill(command.pid, number)
            if command.wait(PATIENCE) is None:
                self.fault(job, f"does not end after {what}", command)
                os.kill(command.pid, signal.SIGKILL)
                command.wait(5)
            self.judge(job, command, killed=number)
            end = time.monotonic() + 5
            while any(map(runs, below)):
                if time.monotonic() > end:
                    self.fault(job, f"processes are left after {what}")
                    break
                time.sleep(0.01)
        self.done[what] += 1

    def kill_worker(self, job: Job, command: Command, wait: float) -> None:
        command.wait(wait)
        end = time.monotonic() + 2
        while command.poll() is None and time.monotonic() < end:
            found = workers(command.pid)
            if found:
                os.kill(self.chance.choice(found), signal.SIGKILL)
                break
            time.sleep(0.01)
        if command.wait(PATIENCE) is None:
            self.fault(job, "does not end without its worker", command)
            os.kill(command.pid, signal.SIGKILL)
            command.wait(5)
            return
        self.judge(job, command)
        if command.status == 0 and job.answer(self.place, command.out.read_text()) != job.right:
            self.fault(job, "wrong answer without a worker", command)

    def twice(self, job: Job, command: Command, wait: float) -> None:
        command.wait(wait)
        both = [command, self.begin(job, False)]
        for one in both:
            if one.wait(PATIENCE) is None:
                self.fault(job, "does not end beside another", one)
                os.kill(one.pid, signal.SIGKILL)
                one.wait(5)
                continue
            self.judge(job, one)
            over = all(other.poll() is not None for other in both)
            if one.status == 0 and over and job.answer(self.place, one.out.read_text()) != job.right:
                self.fault(job, "wrong answer beside another", one)

    def spoil(self, job: Job) -> None:
        """Tear, double or add to the journal, or cut the data."""
        path = self.place / job.journal
        if not path.exists():
            return
        data = path.read_bytes()
        lines = data.splitlines(keepends=True)
        how = self.chance.choice(["torn", "torn", "doubled", "doubled", "added", "cut"])
        if how == "torn" and data:
            path.write_bytes(data[: self.chance.randrange(len(data))])
        elif how == "doubled" and lines and data.endswith(b"\n"):
            which = self.chance.choice(["one", "each", "all"])
            at = self.chance.randrange(len(lines))
            doubled = {"one": [*lines[:at], lines[at], *lines[at:]], "all": [*lines, *lines]}
            path.write_bytes(b"".join(doubled.get(which) or [line for line in lines for _ in range(2)]))
        elif how == "added" and data.endswith(b"\n"):
            path.write_bytes(data + self.chance.choice([b"-5000\n", b"7\n", lines[-1].replace(b"1", b"2"), b"{}\n"]))
            changed = path.read_bytes()
            command = self.begin(job, False)
            command.wait(PATIENCE)
            self.judge(job, command, allowed=DAMAGED)
            if command.status != 0 and path.read_bytes() != changed:
                self.fault(job, "a refused journal was changed", command)
            if command.status != 0:
                path.write_bytes(data)
        elif how == "cut" and job.data and (self.place / job.data).exists():
            part = self.place / job.data
            part.write_bytes(part.read_bytes()[: self.chance.randrange(part.stat().st_size + 1)])
        else:
            return
        self.done[how] += 1


def starting(said: str) -> bool:
    """Whether Python itself was interrupted, before it had begun the program: it then shows a traceback of its own."""
    return "Fatal Python error: init" in said or ("<frozen runpy>" in said and "__main__.py" not in said)


def disturbances(done: Counter[str]) -> int:
    return sum(count for name, count in done.items() if name not in NOT_DONE)


def rounds(campaign: Campaign, kills: int) -> Iterator[Job]:
    while disturbances(campaign.done) < kills:
        for job in campaign.jobs:
            campaign.round(job, campaign.chance.randint(1, 4))
            yield job
            if disturbances(campaign.done) >= kills:
                return


def run(arguments: argparse.Namespace) -> int:
    begun = time.monotonic()
    by_job: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(arguments.seed, Path(folder), arguments.only)
        campaign.prepare()
        for job in rounds(campaign, arguments.kills):
            by_job[job.name] = by_job[job.name] + 1
            if arguments.verbose:
                print(job.name, dict(campaign.done), campaign.faults[-1:], file=sys.stderr, flush=True)
    document = {
        "disturbances": disturbances(campaign.done),
        "kinds": dict(sorted(campaign.done.items())),
        "rounds": dict(by_job),
        "faults": campaign.faults,
        "seconds": round(time.monotonic() - begun, 1),
    }
    print(json.dumps(document, indent=1))
    return 1 if campaign.faults else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--verbose", action="store_true")
    sys.exit(run(parser.parse_args()))
