"""A real dask cluster of local processes, and workers that die at their work."""

from __future__ import annotations

import json
import os
import signal
import socket

import distributed
import pytest

from graphsynth.atlas import making
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.cluster import dask_executor
from graphsynth.cli import main
from graphsynth.core.errors import GraphsynthError

#: A bound on pieces that cuts ten links into many.
FINE = 10.0


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "PIECE", FINE)
        with Catalogue.build(tmp_path_factory.mktemp("alone") / "x.sqlite", range(4, 11)) as catalogue:
            yield catalogue


@pytest.fixture
def fine(monkeypatch):
    monkeypatch.setattr(making, "PIECE", FINE)


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster


def content(catalogue, folder):
    return [path.read_bytes() for path in catalogue.export(folder, "csv")]


@pytest.mark.slow
def test_the_command_line_on_a_cluster(alone, cluster, fine, tmp_path, capsys):
    path = tmp_path / "x.sqlite"
    command = ["catalog", "build", "--links", "4..10", "-o", str(path), "--executor", "dask", "--json"]
    assert main([*command, "--scheduler", cluster.scheduler_address]) == 0
    assert json.loads(capsys.readouterr().out)["chains"] == 249
    with Catalogue(path) as catalogue:
        assert catalogue.digest() == alone.digest()
        assert content(catalogue, tmp_path / "one") == content(alone, tmp_path / "two")


@pytest.mark.slow
def test_lost_workers_are_replaced_and_their_pieces_done_again(alone, cluster, fine, tmp_path):
    """While the pieces are under way, two of the three workers are killed."""
    assert len(cluster.workers) == 3
    with distributed.Client(cluster) as client:
        working = sorted(client.run(os.getpid).values())
    killed = []

    def kill_some(step):
        if step.links == 10 and len(killed) < 2:
            killed.append(working[len(killed)])
            os.kill(killed[-1], signal.SIGKILL)

    with dask_executor(cluster.scheduler_address) as executor:
        path = tmp_path / "x.sqlite"
        with Catalogue.build(path, range(4, 11), executor=executor, watch=kill_some) as catalogue:
            assert killed == working[:2]
            assert catalogue.digest() == alone.digest()


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(GraphsynthError, match="does not answer"), dask_executor(address, timeout=0.5):
        pass


@pytest.mark.slow
def test_workers_with_another_version_are_refused(cluster, monkeypatch):
    monkeypatch.setattr("graphsynth.__version__", "0.0.1")
    with (
        pytest.raises(GraphsynthError, match=r"workers have graphsynth .* this is 0\.0\.1"),
        dask_executor(cluster.scheduler_address),
    ):
        pass
