"""Compiled kernels are made anew when any source that went into them has changed, and only then."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from graphsynth.compilation import source_digest

BELOW = "from graphsynth.compilation import kernel\n\n@kernel\ndef below(x):\n    return x + {}\n"
ABOVE = """
from graphsynth.compilation import kernel
from graphsynth_probe.below import below

@kernel
def above(x):
    return 2.0 * below(x)
"""
RUN = """
import sys
sys.path.insert(0, {folder!r})
import graphsynth.compilation as c
from pathlib import Path
c._IMPORT = c.re.compile(c._IMPORT.pattern.replace("graphsynth", "graphsynth(?:_probe)?"), c.re.MULTILINE)
c.source_digest.__wrapped__.__defaults__ = (Path({folder!r}),)
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
        other = written(tmp_path / name.replace("/", "-"), {**texts, name: texts[name] + "# new\n"})
        assert (source_digest(other / start, other) != digest) == changed


def test_every_kernel_module_depends_on_what_it_imports() -> None:
    import graphsynth.synthesis.kernels.listing as listing
    import graphsynth.synthesis.kernels.variables as variables

    assert source_digest(Path(listing.__file__)) != source_digest(Path(variables.__file__))
