"""The certificate of all joints, in both models, against that of the single bearing: no contradiction.

With a spherical joint at A and a rigid one at C all misalignment goes to the bearing at B, so that the three answer the
same question.  ``GRAPHSYNTH_LINKAGES`` is the number of random linkages.
"""

import math
import os

import numpy as np
import pytest

from graphsynth import Mechanism, assess_jamming, simulate
from graphsynth.jamming import Bearing, ToleranceBox, Verdict, certify_jamming
from graphsynth.jamming.joints import RIGID, SPHERICAL, Misalignment, certify_coupled

COUNT = int(os.environ.get("GRAPHSYNTH_LINKAGES", "50"))
#: Of so many linkages one is also asked in the exact model, near its worst input.
EXACT = 10
TURN = np.linspace(0.0, 2.0 * math.pi, 73)
OPPOSITE = {Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED}


def linkage(rng):
    """Lengths with a driven link that turns fully, a tilt of up to 0.3 rad, and its largest exact tilt at B."""
    while True:
        sizes = rng.uniform(0.5, 4.0, 4)
        short, *middle, long = np.sort(sizes)
        alpha = rng.uniform(-0.3, 0.3)
        sine = sizes[1] / sizes[2] * math.sin(abs(alpha))
        if sizes.argmin() in (0, 1) and 1.02 * (short + long) < sum(middle) and sine < 0.45:
            return tuple(sizes.tolist()), alpha, math.asin(sine)


def bearing_at(tilt):
    """A bearing that binds (condition A) at a tilt."""
    sine, cosine = math.sin(tilt), math.cos(tilt)
    height = 60.0 if tilt > 0.1 else 10.0
    return Bearing(17.5, height, 0.5 * height * sine - 17.5 * sine**2 / (1.0 + cosine))


def cases():
    """Critical tilts between those of small and of exact tilts, and at 1e-3 to 0.9 beside the exact one."""
    for k in range(COUNT):
        rng = np.random.default_rng([41, k])
        sizes, alpha, exact = linkage(rng)
        small = sizes[1] / sizes[2] * abs(alpha)
        beside = exact * (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, -0.05))
        target = exact + rng.uniform(0.0, 1.0) * (small - exact) if k % 3 == 0 else beside
        yield k, sizes, alpha, bearing_at(target)


@pytest.mark.slow
def test_certificates_never_contradict_each_other():
    decided = [0, 0, 0]
    for k, sizes, alpha, bearing in cases():
        box = ToleranceBox(*sizes, alpha=alpha, Rb=bearing.Rb, Hb=bearing.Hb, clearance=bearing.clearance)
        alone = certify_jamming(box).verdict
        joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): bearing, (0, 3): RIGID}
        tilt, mechanism = Misalignment(0, 1, alpha), Mechanism.four_bar(*sizes)
        found = certify_coupled(simulate(mechanism, TURN), joints, tilt, resolution=1e-2, seconds=10.0)
        verdicts = [alone, found.verdict]
        if k % EXACT == 0:
            worst = simulate(mechanism, np.linspace(1.56, 1.58, 3))
            verdicts.append(assess_jamming(worst, tilt=tilt, joints=joints, model="exact").verdict)
        decided = [n + (v in OPPOSITE) for n, v in zip(decided, (*verdicts, None))]
        assert len(OPPOSITE & set(verdicts)) < 2, (k, sizes, alpha, bearing, verdicts)
    print(f"{COUNT} linkages: {decided} decided by the single bearing, by small tilts with bounds, in the exact model")
    assert decided[0] == COUNT and decided[1] >= 0.2 * COUNT
