"""Compiled kernels are forgotten when any kernel source changes."""

from __future__ import annotations

import os
from pathlib import Path

from graphsynth.compilation import drop_stale_kernels

LONG_AGO = 1_000_000_000
drop = drop_stale_kernels.__wrapped__


def _sources(folder: Path) -> tuple[Path, Path, Path]:
    own, base = folder / "room" / "kernels", folder / "base" / "kernels.py"
    own.mkdir(parents=True)
    base.parent.mkdir()
    (own / "one.py").write_text("A = 1\n")
    (own / "two.py").write_text("from one import A\n")
    base.write_text("C = 3\n")
    for source in (own / "one.py", own / "two.py", base):
        os.utime(source, (LONG_AGO, LONG_AGO))
    return own, own / "two.py", base


def test_every_own_source_is_touched_when_one_changes(tmp_path: Path) -> None:
    own, two, base = _sources(tmp_path)
    assert drop(own, base)
    assert two.stat().st_mtime > LONG_AGO
    assert base.stat().st_mtime == LONG_AGO
    os.utime(two, (LONG_AGO, LONG_AGO))
    assert not drop(own, base)
    assert two.stat().st_mtime == LONG_AGO
    (own / "one.py").write_text("A = 2\n")
    assert drop(own, base)
    assert two.stat().st_mtime > LONG_AGO


def test_a_change_below_counts(tmp_path: Path) -> None:
    own, two, base = _sources(tmp_path)
    drop(own, base)
    os.utime(two, (LONG_AGO, LONG_AGO))
    base.write_text("C = 4\n")
    assert drop(own, base)
    assert two.stat().st_mtime > LONG_AGO


def test_a_single_module(tmp_path: Path) -> None:
    _, _, base = _sources(tmp_path)
    assert drop(base)
    assert base.stat().st_mtime > LONG_AGO
    assert not drop(base)
