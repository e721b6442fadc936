"""Compiled kernels are made anew when any source that went into them has changed, and only then."""

from __future__ import annotations

import errno
import importlib.util
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import FunctionType

import pytest

import graphsynth
from graphsynth.core import compilation
from graphsynth.core.compilation import kernel
from graphsynth.core.native import sources
from graphsynth.core.native.sources import source_digest

BELOW = "from graphsynth.core.compilation import kernel\n\n@kernel\ndef below(x):\n    return x + {}\n"
ABOVE = """
from graphsynth.core.compilation import kernel
from graphsynth_probe.below import below

@kernel
def above(x):
    return 2.0 * below(x)
"""
RUN = """
import sys
sys.path.insert(0, {folder!r})
import graphsynth.core.compilation as c
import graphsynth.core.native.sources as s
from pathlib import Path
s._IMPORT = s.re.compile(s._IMPORT.pattern.replace("graphsynth", "graphsynth(?:_probe)?"), s.re.MULTILINE)
s.source_digest.__wrapped__.__defaults__ = (Path({folder!r}),)
from graphsynth_probe.above import above
c.announce(lambda: sys.stderr.write("compiling\\n"))
print(above(1.0), sum(above.stats.cache_hits.values()), sum(above.stats.cache_misses.values()))
"""


def probe(folder: Path) -> tuple[float, int, int]:
    """Run the probe package in a process of its own: value, cache hits, cache misses; compiling is announced once."""
    done = subprocess.run(
        [sys.executable, "-c", RUN.format(folder=str(folder))], capture_output=True, text=True, check=True
    )
    value, hits, misses = done.stdout.split()
    assert done.stderr.count("compiling") == (1 if int(misses) else 0)
    return float(value), int(hits), int(misses)


@pytest.mark.long
def test_a_change_in_another_module_is_noticed(tmp_path: Path) -> None:
    package = tmp_path / "graphsynth_probe"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "above.py").write_text(ABOVE)
    (package / "below.py").write_text(BELOW.format("1.0"))
    assert probe(tmp_path) == (4.0, 0, 1)
    assert probe(tmp_path) == (4.0, 1, 0)
    (package / "below.py").write_text(BELOW.format("5.0"))
    assert probe(tmp_path) == (12.0, 0, 1)
    (package / "below.py").write_text(BELOW.format("1.0"))
    assert probe(tmp_path) == (4.0, 1, 0)


def written(folder: Path, texts: dict[str, str]) -> Path:
    for name, text in texts.items():
        path = folder / "graphsynth" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_digest_follows_imports(tmp_path: Path) -> None:
    texts = {
        "room/kernels/one": "from graphsynth.room.kernels.two import f\n",
        "room/kernels/two": "from graphsynth.room import (\n    codes,\n    more,\n)\n",
        "room/more": "C = 1\n",
        "room/codes": "A = 1\n",
        "other": "B = 1\n",
    }
    first = written(tmp_path / "a", texts)
    start = Path("graphsynth/room/kernels/one.py")
    digest = source_digest(first / start, first)
    for name, changed in (("room/codes", True), ("room/more", True), ("room/kernels/two", True), ("other", False)):
        for line in ("D = 2", "D = '#'", "# new", '"""New."""'):
            other = written(tmp_path / f"{name}-{line}".replace("/", "-"), {**texts, name: texts[name] + f"{line}\n"})
            assert (source_digest(other / start, other) != digest) == (changed and line.startswith("D"))


def test_every_kernel_module_depends_on_what_it_imports(tmp_path: Path) -> None:
    import graphsynth.synthesis.kernels.listing as listing
    import graphsynth.synthesis.kernels.variables as variables

    assert source_digest(Path(listing.__file__)) != source_digest(Path(variables.__file__))
    for module in (listing, variables):  # what they import is found where the package is
        assert source_digest(Path(module.__file__)) != source_digest(Path(module.__file__), tmp_path)


def forget_sources() -> None:
    """Read them anew, as a new process does."""
    source_digest.cache_clear()
    sources._read_source.cache_clear()


# -- every state of the cache ----------------------------------------------------------------------------------------


class Place:
    """A module with one function, the folders where it may be kept, and what was told."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.told: list[str] = []
        self.home = folder / "home"
        self.beside = folder / "package" / "__pycache__"
        (folder / "package").mkdir()
        self.source = folder / "package" / "small.py"
        self.source.write_text("def twice(x):\n    return x + x\n")
        monkeypatch.setattr(compilation, "_listeners", [])
        monkeypatch.setattr(compilation, "_warners", [self.told.append])
        monkeypatch.setattr("numba.misc.appdirs.AppDirs.user_cache_dir", str(self.home))

    def function(self) -> FunctionType:
        spec = importlib.util.spec_from_file_location("small", self.source)
        module = importlib.util.module_from_spec(spec)
        sys.modules["small"] = module
        spec.loader.exec_module(module)
        return module.twice

    def hits(self) -> int:
        """Call the function as a new process would; whether it was found."""
        compiled = kernel(self.function())
        assert compiled(21.0) == 42.0
        return sum(compiled.stats.cache_hits.values())

    def kept(self) -> list[Path]:
        return [path for folder in (self.beside, self.home) for path in folder.rglob("*.nbc*")]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Place:
    return Place(tmp_path, monkeypatch)


def test_a_kernel_is_kept_beside_its_module(place: Place) -> None:
    assert [place.hits(), place.hits()] == [0, 1]
    assert [path.parent for path in place.kept()] == [place.beside] and not place.told


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: b"",
        lambda data: data[:7],
        lambda data: data[:-1],
        lambda data: data[:200] + bytes([data[200] ^ 1]) + data[201:],
        lambda data: data[:-200] + bytes([data[-200] ^ 64]) + data[-199:],
        lambda data: bytes(len(data)),
        lambda data: data + b"more",
        lambda data: b"\x80\x04N.",
    ],
)
def test_a_damaged_file_is_made_anew(place: Place, spoil) -> None:
    place.hits()
    (path,) = place.kept()
    data = path.read_bytes()
    path.write_bytes(spoil(data))
    assert [place.hits(), place.hits()] == [0, 1]
    assert not place.told and place.kept() == [path]


def test_a_file_of_another_function_numba_or_machine_is_not_taken(place: Place, monkeypatch) -> None:
    import numba

    place.hits()
    (path,) = place.kept()
    data = path.read_bytes()
    place.source.write_text("def twice(x):\n    return 2.0 * x\n")
    forget_sources()
    assert place.hits() == 0
    (other,) = set(place.kept()) - {path}
    other.write_bytes(data)  # under the name of the new one
    assert [place.hits(), place.hits()] == [0, 1]
    monkeypatch.setattr(numba, "__version__", "0.0.0")
    assert [place.hits(), place.hits()] == [0, 1]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EROFS, errno.EACCES, errno.EDQUOT])
def test_without_a_place_to_keep_it_a_kernel_is_compiled_in_memory_with_one_notice(
    place: Place, monkeypatch, code: int
) -> None:
    def full(path: Path, data: bytes) -> int:
        path.touch()
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        assert [place.hits(), place.hits()] == [0, 0]
    assert len(place.told) == 1 and "compiled in memory" in place.told[0] and "NUMBA_CACHE_DIR" in place.told[0]
    assert not place.kept()
    assert [place.hits(), place.hits()] == [0, 1]


def test_folders_that_are_files_are_passed_over(place: Place, monkeypatch, tmp_path: Path) -> None:
    place.beside.touch()
    assert [place.hits(), place.hits()] == [0, 1]
    assert [place.home in path.parents for path in place.kept()] == [True] and not place.told
    (chosen := tmp_path / "chosen").touch()
    monkeypatch.setattr("numba.config.CACHE_DIR", str(chosen))
    monkeypatch.setattr("numba.misc.appdirs.AppDirs.user_cache_dir", "~/.cache/numba")  # nobody's home
    monkeypatch.chdir(tmp_path)
    assert [place.hits(), place.hits()] == [0, 0]
    assert len(place.told) == 1 and not (tmp_path / "~").exists()
    chosen.unlink()
    assert [place.hits(), place.hits()] == [0, 1]


def test_what_is_kept_where_nobody_may_write_is_found(place: Place, monkeypatch) -> None:
    place.hits()
    monkeypatch.setattr(Path, "write_bytes", lambda path, data: pytest.fail("nothing is to be written"))
    assert place.hits() == 1


def test_many_processes_at_once_and_many_versions(place: Place) -> None:
    wrong: list[object] = []

    def write() -> None:
        if not all(compilation._write(place.beside, "a.nbc", b"x" * 10_000) for _ in range(300)):
            wrong.append("not written")

    def read() -> None:
        for _ in range(300):
            try:
                data = (place.beside / "a.nbc").read_bytes()
            except FileNotFoundError:
                continue
            if len(data) != 10_032:
                wrong.append(len(data))

    workers = [threading.Thread(target=work) for work in (write, read, read)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong
    for number in range(20):
        place.source.write_text(f"def twice(x):\n    return x + x  # {number}\n")
        forget_sources()
        compilation._write(place.beside, f"small.twice-0.{number}.nbc", b"")
        compilation._drop_old(place.beside, "small.twice-0")
    assert len(list(place.beside.glob("small.*"))) == compilation._VERSIONS


def test_a_library_warns_once(place: Place, monkeypatch) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(compilation, "_warners", [compilation._warn])
    monkeypatch.setattr(compilation, "_write", lambda *_: False)
    with pytest.warns(RuntimeWarning, match="compiled in memory") as told:
        place.hits()
        place.hits()
    assert len(told) == 1


@pytest.mark.slow  # compiles in memory
def test_verbs_where_nothing_can_be_kept(tmp_path: Path) -> None:
    """A package whose folders take no new files, and a home that is none."""
    package = Path(graphsynth.__file__).parent
    shutil.copytree(package, tmp_path / "graphsynth", ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [path for path in (tmp_path / "graphsynth").rglob("*") if path.is_dir()]:
        (folder / "__pycache__").touch()
    own = {"PYTHONPATH": str(tmp_path), "HOME": "/dev/null", "NUMBA_CACHE_DIR": "/dev/null", "PATH": os.environ["PATH"]}
    own["GRAPHSYNTH_NATIVE"] = "0"  # something is compiled
    command = [sys.executable, "-m", "graphsynth", "count", "--links", "8", "--workers", "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=own, cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.endswith("\n16\n"), done.stderr
    assert done.stderr.count("kernels are compiled in memory") == 1 and done.stderr.count("\n") == 2
