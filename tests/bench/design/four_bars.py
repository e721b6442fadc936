"""Four-bars by closed form, for many at once: the measure of every answer, and the model of the peers.

It shares nothing with the solvers of the package: places are complex numbers, and the two circles of coupler and
follower are intersected.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class FourBar(NamedTuple):
    """One four-bar or many: pivots, crank at input 0, lengths, coupler point from the crank pin along the coupler.

    ``mode``: sign of the side of the coupler on which the follower is; ``sense``: of the crank.  Places have any shape
    that numpy broadcasts with the inputs.
    """

    a0: Any
    b0: Any
    crank: Any
    coupler: Any
    follower: Any
    point: Any
    mode: Any = 1.0
    sense: Any = 1.0

    def at(self, inputs: Any) -> tuple[Complex, Complex, Complex]:
        """Return crank pin, follower pin and coupler point at inputs; NaN where the linkage does not close."""
        a = self.a0 + self.crank * np.exp(1j * self.sense * np.asarray(inputs))
        gap = self.b0 - a
        with np.errstate(all="ignore"):
            far = np.abs(gap)
            cosine = (self.coupler**2 + far**2 - self.follower**2) / (2.0 * self.coupler * far)
            along = np.exp(1j * self.mode * np.arccos(cosine)) * gap / far  # NaN beyond -1 ... 1
        return a, a + self.coupler * along, a + self.point * along

    def curve(self, inputs: Any) -> Complex:
        """Places of the coupler point."""
        return self.at(inputs)[2]

    def output(self, inputs: Array) -> Array:
        """Angle of the follower, continuous along the last axis."""
        return np.unwrap(np.angle(self.at(inputs)[1] - self.b0))

    def transmission(self, count: int = 721) -> float:
        """Smallest angle between coupler and follower over the turn."""
        a, b, _ = self.at(np.linspace(0.0, 2.0 * np.pi, count))
        with np.errstate(all="ignore"):
            sine = np.sin(np.angle((a - b) / (self.b0 - b)))
        return float(np.arcsin(np.abs(sine)).min())

    @property
    def turns(self) -> Any:
        """Whether the crank turns fully."""
        ground, crank = np.abs(self.b0 - self.a0), np.abs(self.crank)
        return (ground + crank <= self.coupler + self.follower) & (
            np.abs(ground - crank) >= np.abs(self.coupler - self.follower)
        )


def of_lengths(x: Any) -> FourBar:
    """Read ground, crank, coupler, follower, coupler point (two), frame (two, angle), as the literature writes them.

    >>> bar = of_lengths([4.0, 1.0, 3.0, 3.0, 1.0, 0.5, 0.0, 0.0, 0.0])
    >>> a, b, p = bar.at(0.0)
    >>> bool(abs(abs(b - a) - 3) < 1e-12 and abs(abs(b - 4) - 3) < 1e-12)
    True
    """
    r1, r2, r3, r4, along, across, x0, y0, turn = x[:9]
    frame, start = np.exp(1j * np.asarray(turn)), x0 + 1j * np.asarray(y0)
    return FourBar(start, start + r1 * frame, r2 * frame, r3, r4, along + 1j * np.asarray(across))


def of_mechanism(mechanism: Any, name: str = "") -> FourBar:
    """Read a four-bar of the package, revolute joints only: from its joints in its pose."""
    frames = [(complex(x, y), np.exp(1j * angle)) for x, y, angle in mechanism.pose]

    def world(link: int, at: tuple[float, float]) -> complex:
        return frames[link][0] + frames[link][1] * complex(*at)

    place = {frozenset(joint.pair): world(joint.a, joint.at_a) for joint in mechanism.joints}
    frame, driven = mechanism.drivers[0].pair
    if frame != mechanism.frame:
        frame, driven = driven, frame
    coupler = next(k for k in range(4) if k != frame and frozenset((k, driven)) in place)
    follower = next(k for k in range(4) if k not in (frame, driven, coupler))
    a0, a = place[frozenset((frame, driven))], place[frozenset((driven, coupler))]
    b0, b = place[frozenset((frame, follower))], place[frozenset((coupler, follower))]
    point = 0j
    if name:
        own = mechanism.points[name]
        point = (world(own.link, own.at) - a) / ((b - a) / abs(b - a))
    mode = np.sign(((b - a) * np.conj(b0 - a)).imag)
    rate = float(mechanism.drivers[0].law(np.zeros(1))[1][0])
    sense = np.sign(rate if mechanism.drivers[0].pair[0] == frame else -rate)
    return FourBar(a0, b0, a - a0, abs(b - a), abs(b - b0), point, mode, sense)
