"""The cache of compiled kernels is dropped when any kernel source changes."""

from __future__ import annotations

from pathlib import Path

from graphsynth.compilation import drop_stale_kernels


def _package(folder: Path) -> tuple[Path, Path]:
    kernels = folder / "room" / "kernels"
    (kernels / "__pycache__").mkdir(parents=True)
    (kernels / "one.py").write_text("A = 1\n")
    kept = kernels / "__pycache__" / "one.f-1.py311.nbi"
    kept.write_bytes(b"compiled")
    return kernels / "one.py", kept


def test_dropped_once_and_again_after_a_change(tmp_path: Path) -> None:
    source, kept = _package(tmp_path)
    assert drop_stale_kernels.__wrapped__(tmp_path)
    assert not kept.exists()
    kept.write_bytes(b"compiled")
    assert not drop_stale_kernels.__wrapped__(tmp_path)
    assert kept.exists()
    source.write_text("A = 2\n")
    assert drop_stale_kernels.__wrapped__(tmp_path)
    assert not kept.exists()


def test_other_sources_do_not_matter(tmp_path: Path) -> None:
    _, kept = _package(tmp_path)
    drop_stale_kernels.__wrapped__(tmp_path)
    kept.write_bytes(b"compiled")
    (tmp_path / "room" / "plain.py").write_text("B = 1\n")
    assert not drop_stale_kernels.__wrapped__(tmp_path)
