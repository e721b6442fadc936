"""What is certified is true, by many digits; what is false is not certified."""

import flint
import numpy as np
import pytest

from graphsynth.design.nine_points import proof
from graphsynth.design.nine_points.equations import slopes, value
from graphsynth.design.nine_points.following import solve
from graphsynth.design.nine_points.task import read_task
from graphsynth.intervals.balls import Balls
from graphsynth.intervals.reading import precision


@pytest.fixture(scope="module")
def solved(plant):
    linkage = plant(2, 7)
    task = read_task(linkage.points, linkage.pivots[:1])
    return task, solve(task)[0]


def digits(z, task):
    """Root near z by Newton's method with 300 digits, without proof."""
    free = task.free
    x = [flint.acb(complex(part)) for part in z]
    for k, pivot in enumerate(task.pivots):
        x[4 * k], x[4 * k + 1] = task.ball(pivot)
    points = [task.ball(p) for p in task.p[1:]]
    for _ in range(9):
        rows = [slopes(x, p, q) for p, q in points]
        step = flint.acb_mat([[row[k] for k in free] for row in rows]).solve(
            flint.acb_mat([[value(x, p, q)] for p, q in points])
        )
        for i, k in enumerate(free):
            x[k] = (x[k] - step[i, 0]).mid()
    return x


@pytest.mark.long
def test_roots_lie_in_their_boxes(solved):
    task, roots = solved
    assert roots.certified.all() and roots.distinct.all() and (roots.real ^ roots.complex).all()
    with precision(1000):
        for k in range(len(roots.box.mid)):
            x = digits(roots.box.mid[k], task)
            assert all(
                abs(part - flint.acb(complex(m))) <= flint.arb(float(r)) + flint.arb("1e-60")
                for part, m, r in zip(x, roots.box.mid[k], roots.box.rad[k])
            )
            gap = max(abs(x[i] - flint.acb(x[i + 1].real, -x[i + 1].imag)) for i in (0, 2, 4, 6))
            assert bool(gap < flint.arb("1e-100")) == roots.real[k]


def test_boxes_hold_the_given_pivots(solved):
    task, roots = solved
    beside = roots.box.mid.copy()
    beside[:, :2] *= 1.0 + 1e-12  # where a path ended
    box = proof.prove(beside, task).box
    with precision(200):
        for at, exact in enumerate(task.ball(task.pivots[0])):
            for mid, rad in zip(box.mid[:, at], box.rad[:, at]):
                assert abs(exact - flint.acb(complex(mid))) <= flint.arb(float(rad))


def test_many_digits_prove_the_same(solved):
    task, roots = solved
    for k in (0, 1, 2, int(np.flatnonzero(roots.real)[0])):
        mid, rad, real = proof._with_digits(roots.box.mid[k], task)
        assert real == roots.real[k]
        assert (np.abs(mid - roots.box.mid[k]) <= rad + roots.box.rad[k]).all() and rad.max() < 1e-15 * np.abs(
            mid
        ).max()


def test_what_is_no_root_is_not_certified(solved):
    task, roots = solved
    moved = roots.box.mid.copy()
    moved[:, task.free] *= 1.01
    assert not proof._krawczyk(moved, task)[1].any()


def test_one_root_twice_counts_once(solved):
    task, roots = solved
    twice = proof.prove(np.concatenate([roots.box.mid, roots.box.mid[:5] * (1.0 + 1e-15)]), task)
    assert twice.certified.sum() == len(roots.box.mid) + 5 and twice.distinct.sum() == len(roots.box.mid)


def test_a_cognate_counts_with_its_triple(plant):
    linkage = plant(4, 9)
    (a, b), (c, d), p = linkage.pivots, linkage.joints, linkage.points[0]
    task = read_task(linkage.points, [])
    z = [(a - p) / task.unit, (c - p) / task.unit, (b - p) / task.unit, (d - p) / task.unit]
    first = np.array([f(part) for part in z for f in (complex, np.conj)])
    rows = [first, first[[4, 5, 6, 7, 0, 1, 2, 3]], *(np.array(other) for other in proof_cognates(first))]
    roots = proof.prove(np.stack(rows), task)
    assert roots.certified.all() and roots.real.all() and roots.distinct.sum() == 1


def proof_cognates(z):
    from graphsynth.design.nine_points.equations import cognates

    return cognates(z)[1:]


def test_a_linkage_without_a_link_is_not_proper(plant):
    linkage = plant(2, 5)
    task = read_task(linkage.points, linkage.pivots)
    z = np.concatenate([task.held.mid[0], task.held.mid[0], task.held.mid[1], [0.3 + 0.1j, 0.3 - 0.1j]])
    assert not proof._proper(Balls(z[None], np.zeros((1, 8))), task).any()


def test_reciprocals_enclose():
    rng = np.random.default_rng(1)
    mid = rng.normal(size=50) + 1j * rng.normal(size=50)
    rad = np.abs(mid) * rng.choice([0.0, 1e-9, 0.3, 1.1], 50)
    found = proof.reciprocal(Balls(mid, rad))
    with precision(200):
        for m, r, w, s in zip(mid, rad, found.mid, found.rad):
            for turn in range(8):
                member = flint.acb(complex(m)) + flint.acb(0, turn * flint.arb.pi() / 4).exp() * flint.arb(float(r))
                assert not np.isfinite(s) or abs(1 / member - flint.acb(complex(w))) <= flint.arb(float(s))
    assert np.isinf(found.rad[rad > np.abs(mid)]).all() and np.isfinite(found.rad[rad < 0.4 * np.abs(mid)]).all()


def test_overlaps_are_those_of_all_pairs():
    rng = np.random.default_rng(2)
    rows = [Balls(rng.normal(size=60) + 1j * rng.normal(size=60), rng.exponential(0.4, 60)) for _ in range(2)]
    rows[0].rad[7] = np.inf
    slow = {
        (i, j)
        for i in range(60)
        for j in range(i + 1, 60)
        if all(abs(row.mid[i] - row.mid[j]) <= row.rad[i] + row.rad[j] for row in rows)
    }
    assert {tuple(pair) for pair in proof.overlaps(rows).tolist()} == slow
