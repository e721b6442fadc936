"""Numbers with their change: values at a base point and what a change of the input adds, free of cancellation."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Difference"]


@dataclass(frozen=True)
class Difference:
    """``base`` and ``change``: the value elsewhere is their sum, but the change keeps its own relative accuracy.

    Examples
    --------
    >>> angle = Difference(1.0, 1e-20)
    >>> angle.cos().change
    -8.414709848078965e-21
    """

    base: float
    change: float = 0.0

    @property
    def value(self) -> float:
        """The sum, rounded."""
        return self.base + self.change

    def __add__(self, other: Difference) -> Difference:
        return Difference(self.base + other.base, self.change + other.change)

    def __sub__(self, other: Difference) -> Difference:
        return Difference(self.base - other.base, self.change - other.change)

    def __mul__(self, other: Difference) -> Difference:
        change = self.base * other.change + other.base * self.change + self.change * other.change
        return Difference(self.base * other.base, change)

    def scaled(self, factor: float) -> Difference:
        """Multiply by a constant."""
        return Difference(factor * self.base, factor * self.change)

    def sin(self) -> Difference:
        """Sine: the change is ``2 cos(base + change/2) sin(change/2)``."""
        half = 0.5 * self.change
        return Difference(math.sin(self.base), 2.0 * math.cos(self.base + half) * math.sin(half))

    def cos(self) -> Difference:
        """Cosine: the change is ``-2 sin(base + change/2) sin(change/2)``."""
        half = 0.5 * self.change
        return Difference(math.cos(self.base), -2.0 * math.sin(self.base + half) * math.sin(half))

    def sqrt(self) -> Difference:
        """Square root: the change is ``change / (sqrt(base + change) + sqrt(base))``; NaN if the value is negative."""
        if self.base < 0.0 or self.value < 0.0:
            return Difference(math.nan, math.nan)
        root = math.sqrt(self.base)
        total = math.sqrt(self.value) + root
        return Difference(root, self.change / total if total > 0.0 else 0.0)

    def angle(self, x: Difference) -> Difference:
        """``atan2(self, x)``: the change is the angle between the two directions."""
        cross = self.change * x.base - x.change * self.base
        dot = x.base * x.value + self.base * self.value
        return Difference(math.atan2(self.base, x.base), math.atan2(cross, dot))
