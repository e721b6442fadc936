"""A disk that takes no more: one sentence with the file, nothing half written, and what was there stays."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from graphsynth.cli import main
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

from ..telling import said

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits on the size of files as Linux has them")


@contextmanager
def full(size: int) -> Iterator[None]:
    """No file may grow beyond so many bytes."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def mechanism(tmp_path_factory: pytest.TempPathFactory) -> str:
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (4.0, 0.0), (3.0, 0.0)),
              Revolute(0, 3, (4.0, 0.0))]  # fmt: skip
    path = tmp_path_factory.mktemp("mechanism") / "m.toml"
    path.write_text(Mechanism(CYCLE, joints, [Driver(0, 1)]).to_toml())
    assert (
        main(["animate", str(path), "-o", str(path.with_name("x.html"))]) == 0
    )  # kernels are kept while files may grow
    return str(path)


@pytest.mark.parametrize(
    "words",
    [
        ["animate", "MECHANISM", "-o", "x.html", "--frames", "9"],
        ["animate", "MECHANISM", "-o", "x.svg", "--frames", "9"],
        ["animate", "MECHANISM", "-o", "x.gif", "--frames", "3"],
        ["show", "Cl f0", "-o", "x.svg"],
        ["show", "Cl f0", "-o", "x.png"],
        ["convert", "MECHANISM", "-o", "x.json"],
    ],
    ids=lambda words: f"{words[0]} {words[3]}",
)
@pytest.mark.parametrize("there", [False, True], ids=["new", "replaced"])
def test_nothing_is_left_half_written(
    words: list[str],
    there: bool,
    mechanism: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    place = Path(words[3])
    if there:
        place.write_text("as before")
        words = [*words, *(["--force"] if words[0] == "convert" else [])]
    with full(200):
        assert main([mechanism if word == "MECHANISM" else word for word in words]) == 2
    (sentence,) = said(capsys.readouterr().err)
    assert sentence == f"graphsynth: {place}: File too large"
    assert [own.name for own in tmp_path.iterdir()] == [place.name] * there
    assert not there or place.read_text() == "as before"
