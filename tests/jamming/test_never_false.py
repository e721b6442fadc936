"""A certificate is never false: random linkages whose verdict is known to 60 digits, and boxes checked by members.

Margins go down to 1e-9 of the touching tilt, where everything must still be decided, and on to 1e-40, where "undecided"
is right and a verdict must not be wrong.  The full numbers are in ``docs/explanation/bearing-jamming.md``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from graphsynth.jamming import Verdict

sys.path.insert(0, str(Path(__file__).parent))  # not a package: the helper lies beside the test
from known_verdicts import check_box, check_limits, check_sweep, count_undecided, loosened, random_case, random_lengths

KINDS = ("moderate", "extreme", "change point")


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_known_verdicts(kind):
    assert count_undecided(50, 1, kind) <= 1  # margins from 1e-9 to 0.3
    assert count_undecided(50, 2, kind, (-9.0, -8.99)) <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_margins_below_the_rounding_are_never_decided_wrongly(kind):
    assert count_undecided(15, 3, kind, (-40.0, -9.0)) > 0


def drawn(count, seed):
    """Half of them any lengths (dead centres, no assembly), half near touching; half of each with tolerances."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        condition = ("A", "B", "general")[k % 3]
        if k % 4 < 2:
            box = random_lengths(rng)
        else:
            case = None
            while case is None:
                case = random_case(rng, KINDS[k % 3], (-6.0, -0.5))
            box, condition = case.box, case.condition
        yield rng, loosened(rng, box) if k % 2 else box, condition


def boxes(count, seed):
    for rng, box, condition in drawn(count, seed):
        yield check_box(rng, box, condition)


@pytest.mark.long
def test_boxes_hold_their_members():
    found = [one.verdict for one in boxes(40, 4)]
    assert {Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME} <= set(found)


@pytest.mark.long
def test_sweeps_and_limits_hold_their_members():
    for k, drawing in enumerate(drawn(8, 8)):
        check_sweep(*drawing)
        if k in (1, 6):
            check_limits(*drawing)


@pytest.mark.slow
def test_many_sweeps_and_limits_hold_their_members():
    for k, drawing in enumerate(drawn(300, 9)):
        check_sweep(*drawing)
        if k % 5 == 0:
            check_limits(*drawing)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("margins", [(-9.0, -0.5), (-9.0, -8.99)])
def test_ten_thousand_known_verdicts(kind, margins):
    assert count_undecided(10_000, 5, kind, margins) <= 200  # fewer than 2 %


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_three_thousand_margins_below_the_rounding(kind):
    assert count_undecided(3_000, 6, kind, (-40.0, -9.0)) > 0


@pytest.mark.slow
def test_four_thousand_boxes_hold_their_members():
    undecided = sum(one.verdict is Verdict.UNDECIDED for one in boxes(4_000, 7))
    assert undecided <= 80  # fewer than 2 %
