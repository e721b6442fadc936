"""Catalogues changed at random, by accident and on purpose, through every command that reads them.

    GRAPHSYNTH_MUTANTS=10000 python -m pytest -n 0 -m slow tests/atlas/site/test_site_mutations.py

Nothing is written outside the folder that was named, no script runs in Chromium, there is no traceback, and each
command takes at most five seconds and a gigabyte.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import resource
import shutil
import sqlite3
import struct
import time
import traceback
from importlib import import_module

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.sealing import seal

cli = import_module("graphsynth.cli.main")

SECONDS, MEGABYTES = 5.0, 1000
MARK = "ran"  # what scripts would set
PRECIOUS = "precious"  # a file that has nothing to do with it
TEXTS = [
    "", " ", "../../../escaped.1", "/tmp/escaped", "..", "x/../../y", "C:\\x", "CON", "a\0b", "\n", "\x1b[2J", "\u202e",
    f"<img src=x onerror=window.{MARK}=1>", f"</script><script>window.{MARK}=1</script>", f"\"><b onmouseover={MARK}>",
    f"javascript:window.{MARK}=1", "';alert(1)//", "${window.ran=1}", "{{7*7}}", "=cmd|'!A0", "%s%n", "é" * 300,
    "1BAN4", "1BgMw8g", "1BgOB7A", "1CAMBmSzA", "1.4.4.1", "1.6.4-2.1", "1.6.4-2.99999999999999999999", "4-4", "0-1x3",
    "0-1x99999999 5-7", "0,1 2,3", "1 2 3", "99999999", "2/3", "1/1", "0123456789abcdef", "NaN", "null", "A" * 100_000,
    "[" * 50_000, "{" * 300, "1" * 5000, "found", "free", "certified",
]  # fmt: skip
VALUES = [
    *TEXTS, None, -1, 0, 1, 2, 3, 17, 18, 19, 64, 255, 10**6, 2**31, 2**63 - 1, -(2**63), 1e300, 9e999, -9e999, 0.5,
    b"", b"\xff\xfe", b"\x00" * 1000, b"../../x",
]  # fmt: skip
SCHEMAS = [
    "CREATE TRIGGER t BEFORE INSERT ON evaluations BEGIN DELETE FROM chains; END", "CREATE VIEW v AS SELECT 1",
    "CREATE VIRTUAL TABLE v USING fts5(a)", "CREATE VIRTUAL TABLE v USING rtree(a, b, c)", "CREATE TABLE t (a)",
    "CREATE INDEX i ON chains (girth)", "ALTER TABLE chains ADD COLUMN c AS (zeroblob(900000000))", "DROP TABLE driven",
    "DROP VIEW mechanisms", "DROP VIEW mechanisms; CREATE VIEW mechanisms AS SELECT 1 AS chain_id",
    "ALTER TABLE chains RENAME TO c; CREATE VIEW chains AS WITH RECURSIVE x(n) AS (SELECT 1 UNION ALL SELECT n + 1 "
    "FROM x) SELECT n FROM x", "DROP TABLE meta", "PRAGMA user_version = 3", "PRAGMA application_id = 1",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = 3 + abs(random()) % 20 WHERE type = 'table'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE TABLE x(' || hex(zeroblob(100000)) || ')'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET name = char(27) || name, tbl_name = tbl_name || '<b>'",
    "PRAGMA journal_mode = WAL", "PRAGMA auto_vacuum = FULL; VACUUM", "PRAGMA page_size = 512; VACUUM", "VACUUM",
    "ANALYZE", "PRAGMA encoding = 'UTF-16'; VACUUM",
]  # fmt: skip


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    path = tmp_path_factory.mktemp("right") / "x.sqlite"
    Catalogue.build(path, [5], 2).close()
    with Catalogue.build(path, [4, 6]) as catalogue:
        catalogue.evaluate([4])
        frame, driver = catalogue.sql("SELECT frame, driver FROM evaluations").iloc[0].tolist()
        catalogue.record([Evaluation("1.4.4.1", frame, driver, "jamming", "undecided", 0.001, "rad")])
    return path


class Mutants:
    """Changed files, one of each seed."""

    def __init__(self, right, altered):
        self.data, self.right, self.altered = right.read_bytes(), right, altered
        with contextlib.closing(sqlite3.connect(right)) as raw:
            tables = [row[0] for row in raw.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            self.columns = [
                (table, column[1]) for table in tables for column in raw.execute(f"PRAGMA table_info({table})")
            ]

    def make(self, seed, path):
        """Write a changed file and say what was changed."""
        choice = random.Random(seed)
        for own in path.parent.iterdir():
            own.unlink()
        path.write_bytes(self.data)
        ways = [
            self.bits,
            self.pages,
            self.values,
            self.values,
            self.values,
            self.rows,
            self.schema,
            self.json,
            self.beside,
        ]
        said = []
        for _ in range(choice.choice([1, 1, 1, 2, 3])):
            way = choice.choice(ways)
            try:
                said.append(f"{way.__name__}: {way(choice, path)}")
            except Exception as error:  # a file that was changed before may be past changing
                said.append(f"{way.__name__}: {error}")
        if choice.random() < 0.7:
            with (
                contextlib.suppress(Exception),
                contextlib.closing(sqlite3.connect(path)) as raw,
            ):
                raw.isolation_level = None
                raw.execute("DELETE FROM meta")
                seal(raw)
        return " | ".join(said)[:400]

    def bits(self, choice, path):
        data = bytearray(path.read_bytes())
        for _ in range(choice.choice([1, 1, 3, 30])):
            at = choice.randrange(choice.choice([100, 4096, len(data)]))
            data[at] ^= 1 << choice.randrange(8)
        path.write_bytes(data)
        return "flipped"

    def pages(self, choice, path):
        data = bytearray(path.read_bytes())
        one, two = (4096 * choice.randrange(len(data) // 4096) for _ in range(2))
        kind = choice.randrange(5)
        if kind == 0:
            data = data[: choice.randrange(len(data))]
        elif kind == 1:
            data[one : one + 4096] = data[two : two + 4096]
        elif kind == 2:
            data[one : one + 4096] = bytes(4096)
        elif kind == 3:
            data[one : one + 4096] = choice.randbytes(4096)
        else:
            data += choice.randbytes(5000)
        path.write_bytes(data)
        return f"kind {kind}"

    def values(self, choice, path):
        table, column = choice.choice(self.columns)
        value = choice.choice(VALUES)
        with self.altered(path, sealed=False, anything=choice.random() < 0.5) as raw:
            rows = raw.execute(f"SELECT COUNT(*) FROM {table}").fetchone()[0]
            every = "" if choice.random() < 0.3 else f" LIMIT 1 OFFSET {choice.randrange(max(rows, 1))}"
            names = ", ".join(name for own, name in self.columns if own == table)
            where = f"WHERE ({names}) IN (SELECT {names} FROM {table}{every})" if every else ""
            raw.execute(f'UPDATE OR IGNORE {table} SET "{column}" = ? {where}', (value,))
        return f"{table}.{column} = {value!r:.60}"

    def rows(self, choice, path):
        table = choice.choice(self.columns)[0]
        names = [name for own, name in self.columns if own == table]
        with self.altered(path, sealed=False, anything=choice.random() < 0.3) as raw:
            if choice.random() < 0.4:
                limit = choice.choice(["1", "(SELECT COUNT(*) FROM chains) / 2"])
                raw.execute(f"DELETE FROM {table} WHERE ({', '.join(names)}) IN (SELECT * FROM {table} LIMIT {limit})")
                return f"{table}: deleted"
            row = list(raw.execute(f"SELECT * FROM {table} ORDER BY random() LIMIT 1").fetchone() or [1] * len(names))
            for _ in range(choice.choice([1, 2, 5])):
                row[choice.randrange(len(row))] = choice.choice(VALUES + list(range(30)))
            raw.execute(f"INSERT OR REPLACE INTO {table} VALUES ({', '.join('?' * len(row))})", row)
            return f"{table}: {row!r:.80}"

    def schema(self, choice, path):
        statement = choice.choice(SCHEMAS)
        with self.altered(path, sealed=False) as raw:
            raw.executescript(statement)
        return statement[:60]

    def json(self, choice, path):
        """Change the data of an evaluation, above all the mechanism in it."""
        with self.altered(path, sealed=False) as raw:
            (text,) = raw.execute("SELECT data FROM evaluations WHERE kind = 'dimensions'").fetchone() or ("{}",)
            data = json.loads(text)
            for _ in range(choice.choice([1, 2, 5])):
                change(data, choice)
            raw.execute("UPDATE evaluations SET data = ? WHERE kind = 'dimensions'", (json.dumps(data),))
        return "data"

    def beside(self, choice, path):
        """Put something beside the file, at times a journal that has another file deleted."""
        name = choice.choice(["-wal", "-journal", "-shm"])
        data = self.data[: choice.randrange(len(self.data))] if choice.random() < 0.5 else choice.randbytes(9000)
        if name == "-journal" and choice.random() < 0.5:
            data = naming(path.parents[1] / PRECIOUS)
        path.with_name(path.name + name).write_bytes(data)
        return name


def naming(victim):
    """A journal of SQLite that names another file; whoever takes it back deletes that file."""
    name = str(victim).encode()
    head = bytes.fromhex("d9d505f920a163d7") + struct.pack(">5I", 0, 0, 1, 512, 4096)
    tail = struct.pack(">I", 2**30 // 4096 + 1) + name + struct.pack(">2I", len(name), sum(name))
    return head.ljust(512, b"\0") + tail + bytes.fromhex("d9d505f920a163d7")


def change(data, choice):
    """Replace something in a tree of lists and dictionaries."""
    while isinstance(data, dict | list) and data:
        at = choice.choice(list(data) if isinstance(data, dict) else range(len(data)))
        if isinstance(data[at], dict | list) and data[at] and choice.random() < 0.8:
            data = data[at]
            continue
        kind = choice.randrange(4)
        if kind == 0 and isinstance(data, dict):
            del data[at]
        elif kind == 1 and isinstance(data, dict):
            data[choice.choice(TEXTS)[:1000]] = data[at]
        else:
            data[at] = choice.choice([value for value in VALUES if not isinstance(value, bytes)])
        return


COMMANDS = {
    "site": ["site", "FILE", "-o", "OUT/page", "--workers", "1"],
    "query": ["query", "FILE"],
    "evaluations": ["query", "FILE", "--table", "evaluations", "--json"],
    "entry": ["query", "FILE", "--entry", "1.4.4.1"],
    "export": ["export", "FILE", "-o", "OUT/tables"],
    "verify": ["verify", "FILE"],
    "quick": ["verify", "FILE", "--quick"],
    "merge": ["merge", "FILE", "-o", "OUT/merged.sqlite"],
}


def tried(words):
    """Run a command here; return what is wrong with it, and its status."""
    out, error = io.StringIO(), io.StringIO()
    begin = time.perf_counter()
    cpu = time.process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = cli.main(["catalog", *words])
    except BaseException:
        return ["traceback: " + traceback.format_exc()[-1500:]], None
    faults = []
    if min(time.perf_counter() - begin, time.process_time() - cpu) > SECONDS:
        faults.append(f"{time.perf_counter() - begin:.1f} s")
    if status not in ((0, 1, 2) if words[0] == "verify" else (0, 2)) or error.getvalue().count("\n") != (status == 2):
        faults.append(f"status {status}, said {error.getvalue()!r}")
    if not all(c.isprintable() or c == "\n" for c in out.getvalue() + error.getvalue()):
        faults.append("steers the terminal")
    return faults, status


def outside(top):
    """Everything in the sandbox but the results that were asked for."""
    return {str(own.relative_to(top)) for own in top.rglob("*") if "out" not in own.relative_to(top).parts}


def campaign(right, altered, top, monkeypatch, seeds, window=None):
    """Run every command on every mutant; return (faults, statuses, pages seen in Chromium)."""
    inside = top / "a" / "b" / "c"
    place, out = inside / "in", inside / "out"
    place.mkdir(parents=True)
    mutants = Mutants(right, altered)
    parser = cli.command_line()  # most of the time of a small command
    monkeypatch.setattr(cli, "command_line", lambda: parser)
    faults, statuses, seen, told = [], {}, 0, 0
    out.mkdir()
    (inside / PRECIOUS).touch()
    for words in COMMANDS.values():  # kernels are compiled once
        named = {"FILE": str(right)}
        tried([named.get(word, word.replace("OUT", str(out))) for word in words])
    for seed in seeds:
        if window and (seed % 50 == 0 or faults[told:]):
            print(seed, *faults[told:], sep="\n", flush=True)
            told = len(faults)
        said = mutants.make(seed, place / "x.sqlite")
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        before = outside(top) | {f"a/b/c/in/x.sqlite{end}" for end in ("-wal", "-shm", "-journal")}
        content = (place / "x.sqlite").read_bytes()
        for name, words in COMMANDS.items():
            named = {"FILE": str(place / "x.sqlite")}
            own = [named.get(word, word.replace("OUT", str(out))) for word in words]
            found, status = tried(own)
            statuses[name, status] = statuses.get((name, status), 0) + 1
            faults += [f"seed {seed} ({said}), {name}: {fault}" for fault in found]
            left = {own.name for own in out.iterdir()} - {"page", "tables", "merged.sqlite"}
            if outside(top) - before or {name for name in left if not name.startswith("merged.sqlite-")}:
                faults.append(f"seed {seed} ({said}), {name}: wrote {sorted(outside(top) - before)} {sorted(left)}")
        if not (inside / PRECIOUS).exists():
            (inside / PRECIOUS).touch()
            faults.append(f"seed {seed} ({said}): another file was deleted")
        if (place / "x.sqlite").read_bytes() != content and "-" not in "".join(own.name for own in place.iterdir()):
            faults.append(f"seed {seed} ({said}): the file was changed")
        page = out / "page" / "index.html"
        if window and page.is_file() and (seed % 100 == 0 or holds_markup(page.parent)):
            seen += 1
            faults += [f"seed {seed} ({said}): a script ran in {address}" for address in ran(window, page)]
    return faults, statuses, seen


def holds_markup(folder):
    return any(f"{MARK}=1" in own.read_text("utf-8") for own in (folder / "data").glob("*.js"))


def ran(window, page):
    """Addresses of a page at which a script of its data ran."""
    found = []
    addresses = ["", "#/1.4.4.1", "#/1BgMw8g", "#/about"]
    for one in [page.as_uri() + own for own in addresses]:
        window.get("about:blank")
        window.get(one)
        window.execute_async_script("setTimeout(arguments[0], 50)")
        if window.execute_script(f"return window.{MARK} !== undefined"):
            found.append(one)
    return found


def memory():
    """Megabytes that this process has had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000


@pytest.mark.long
def test_mutants(right, altered, tmp_path, monkeypatch):
    """A fixed few."""
    faults, statuses, _ = campaign(right, altered, tmp_path, monkeypatch, range(16))
    assert faults == []
    assert {(name, status) for name in COMMANDS for status in (0, 2)} - set(statuses) <= {("quick", 0)}


@pytest.mark.slow
def test_many_mutants(right, altered, tmp_path, monkeypatch, request):
    """As many as wanted, from a first seed that is told; pages in Chromium where there is one."""
    count, first = (int(os.environ.get(f"GRAPHSYNTH_MUTANT{end}", 0)) for end in ("S", "_SEED"))
    seeds = range(first, first + (count or 300))
    window = request.getfixturevalue("window")
    faults, statuses, seen = campaign(right, altered, tmp_path, monkeypatch, seeds, window)
    print(f"{count or 300} mutants from seed {first}: {statuses}, {seen} pages in Chromium, {memory():.0f} MB")
    assert faults == []
    assert memory() < MEGABYTES
