"""The start systems: what is shipped holds, can be made again, and passes the trace test."""

import numpy as np
import pytest

from graphsynth.design.nine_points import monodromy
from graphsynth.design.nine_points.equations import cognates, slopes, value
from graphsynth.design.nine_points.following import Start, follow, repeated, shipped
from graphsynth.design.nine_points.task import free_unknowns


@pytest.mark.parametrize(("pivots", "count"), [(0, 1442), (1, 243), (2, 36)])
def test_shipped_starts_hold(pivots, count):
    start = shipped(pivots)
    assert len(start.z) == count and start.pivots == pivots
    assert len(repeated(start.z, pivots)) == 0
    n = 8 - 2 * pivots
    p, q = start.end[:n].T
    for linkage in cognates(start.z.T[:, :, None])[: 3 - pivots]:
        assert newton_step(linkage, p, q, free_unknowns(pivots)) < 1e-8


def newton_step(linkage, p, q, free):
    """Largest correction of Newton's method, relative to the largest unknown."""
    M = np.stack(slopes(linkage, p, q), axis=-1)[..., free]
    step = np.linalg.solve(M, value(linkage, p, q)[..., None])[..., 0]
    size = np.abs(np.stack(np.broadcast_arrays(*linkage))).max(axis=0)[:, 0]
    return (np.abs(step).max(axis=1) / size).max()


def test_turned_roots_are_roots():
    start = shipped(2).turned(np.array([0.3 + 1.0j, -2.0 + 0.1j]))
    p, q = start.end[:4].T
    assert newton_step(tuple(start.z.T[:, :, None]), p, q, free_unknowns(2)) < 1e-10
    assert np.abs(follow(start, start.end) - start.z).max() < 1e-9


@pytest.mark.long
def test_made_again_and_after_an_interruption(tmp_path, capsys, monkeypatch):
    out, work = tmp_path / "starts.npz", tmp_path / "work.npz"
    monodromy.main(["--pivots", "2", "--out", str(out)])
    with np.load(out) as data:
        whole = Start(data["end_2"], data["z_2"])
    assert len(whole.z) == 36 and whole.z.tobytes() == shipped(2).z.tobytes()
    assert "36" in capsys.readouterr().out
    # stopped after four loops, then resumed
    stopped = monodromy.around
    calls = iter(range(4))

    def four(start, rng):
        next(calls)
        return stopped(start, rng)

    monkeypatch.setattr(monodromy, "around", four)
    with pytest.raises(StopIteration):
        monodromy.main(["--pivots", "2", "--out", str(out), "--work", str(work)])
    monkeypatch.setattr(monodromy, "around", stopped)
    monodromy.main(["--pivots", "2", "--out", str(out), "--work", str(work)])
    with np.load(out) as data:
        assert data["z_2"].tobytes() == whole.z.tobytes()


@pytest.mark.long
def test_trace():
    """Sum over all roots of a curve's sections is linear, and not without one of them."""
    found = monodromy.trace(shipped(2), (1, 2))
    assert found.straight == 36 and found.bent == 78
    assert found.defect < 1e-8 < 1e-4 < found.without


@pytest.mark.slow
def test_trace_with_one_pivot():
    found = monodromy.trace(shipped(1), (1, 1))
    assert found.straight == 486 and found.bent == 966
    assert found.defect < 1e-7 < 1e-5 < found.without
