"""Chebyshev's lambda linkage: the four-bar with frame 2, crank 1, coupler and rocker 2.5 that draws a straight line."""

from __future__ import annotations

from dataclasses import dataclass

from graphsynth.mechanism.four_bar import TiltedFourBar


@dataclass(frozen=True)
class LambdaLinkage(TiltedFourBar):
    """Chebyshev's lambda linkage; the parameters are those of `TiltedFourBar`.

    Examples
    --------
    >>> stroke = LambdaLinkage().straightness()
    >>> round(stroke.chord, 12), round(stroke.deviation, 6)
    (4.0, 0.009754)
    """
