"""Stick-slip motion with as many digits as asked for: the yardstick of all other methods.

An implementation of its own: Taylor series of arbitrary order for slip pieces, bracketed roots for events, arithmetic
of mpmath.  It shares no code with the kernels.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import mpmath
from mpmath import cos, exp, fdot, findroot, mpf, polyval, sin, sqrt

from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.systems.tribometer.platforms import BeltDrive, CrankDrive, Platforms, StribeckLaw, TwoCoefficientLaw

Series = list[Any]


class PreciseEvent(NamedTuple):
    """An event; ``time`` and ``position`` are mpmath numbers, ``state`` the new state."""

    time: Any
    state: int
    position: Any


class PreciseMotion(NamedTuple):
    """Events, and the final position and velocity of the upper platform, as mpmath numbers."""

    events: tuple[PreciseEvent, ...]
    x2: Any
    v2: Any
    digits: int


def precise_motion(model: Platforms, duration: float, *, digits: int = 30, most_events: int = 1000) -> PreciseMotion:
    """Run the automaton in multiple precision: so many significant digits, 15 to 200; ten more are carried.

    Estimated: the series are truncated below the digits asked for.  The data of the model are taken as they are stored,
    or as the shortest decimal numbers that round to them: 0.4 means four tenths.  `SpecError` if the law is neither a
    `TwoCoefficientLaw` nor a `StribeckLaw` whose exponent is a whole number, or the digits are out of bounds;
    `TooLargeError` if there are more events than ``most_events``.

    Examples
    --------
    >>> from graphsynth.systems.tribometer.model import Tribometer
    >>> precise_motion(Tribometer(), 0.5, digits=20).events[0].state
    -1
    """
    if not 15 <= digits <= 200:
        raise SpecError(f"The number of digits is {digits}; give 15 to 200.")
    with mpmath.workdps(digits + 10):
        run = _Run(model, digits + 10)
        run.to(mpmath.mpf(repr(float(duration))), most_events)
        return PreciseMotion(tuple(run.events), run.x, run.v, digits)


def _times(a: Series, b: Series, n: int) -> Any:
    """Return coefficient ``n`` of a product."""
    return fdot(a[: n + 1], b[n::-1])


class _Run:
    """State of a run; every number is an mpmath number."""

    def __init__(self, model: Platforms, digits: int) -> None:
        law, drive = model.law, model.drive

        def number(value: float) -> Any:
            return mpf(repr(value))

        self.m, self.k, self.c = number(model.mass), number(model.stiffness), number(model.damping)
        self.N = self.m * number(model.gravity) + number(model.load)
        self.static, self.kinetic = number(law.static), number(law.kinetic)
        self.viscous, self.power, self.vs = number(law.viscous), 0, mpf(1)
        if isinstance(law, StribeckLaw):
            self.power, self.vs = int(law.exponent), number(law.velocity)
            if self.power != law.exponent:
                raise SpecError(
                    f"The Stribeck exponent is {law.exponent:g}; a Taylor series at rest needs a whole number."
                )
        elif not isinstance(law, TwoCoefficientLaw):
            raise SpecError(f"No Taylor series is known for the law {law!r}.")
        self.kind = 0 if isinstance(drive, BeltDrive) else 2 if isinstance(drive, CrankDrive) else 1
        self.w = number(drive.speed)
        self.r = number(getattr(drive, "radius", 1.0))
        self.rod = number(getattr(drive, "rod", 2.0))
        self.digits, self.order = digits, int(1.2 * digits) + 8
        self.t, self.x = mpf(0), number(model.x2)
        _, v1, a1 = self.drive(self.t)
        self.v = v1 if model.v2 is None else number(model.v2)
        self.events: list[PreciseEvent] = []
        if self.v != v1:
            self.state = 1 if v1 > self.v else -1
        else:
            self.state = self.decide(self.m * a1 + self.k * self.x + self.c * v1)

    def decide(self, force: Any) -> int:
        """Return the state of a contact at rest that needs the force ``force`` to stay there."""
        return 0 if abs(force) <= self.static * self.N else 1 if force > 0 else -1

    def drive(self, t: Any) -> tuple[Any, Any, Any]:
        """Return displacement, velocity and acceleration of the lower platform."""
        r, w = self.r, self.w
        if self.kind == 0:
            return w * t, w, mpf(0)
        C, S = r * cos(w * t), r * sin(w * t)
        if self.kind == 1:
            return C, -w * S, -w * w * C
        q = sqrt(self.rod**2 - S * S)
        return C + q - self.rod, -w * S - w * S * C / q, w * w * (-C - (C * C - S * S) / q - (S * C) ** 2 / q**3)

    def to(self, end: Any, most: int) -> None:
        """Run to ``end``."""
        while self.t < end:
            found = self.stick(end) if self.state == 0 else self.slip(end)
            if found is None:
                continue
            self.state = found
            self.events.append(PreciseEvent(self.t, found, self.x))
            if len(self.events) > most:
                raise TooLargeError(
                    f"More than {most} events by {float(self.t):g} s; shorten the run or raise most_events."
                )

    def stick(self, end: Any) -> int | None:
        """Move with the lower platform to the release or the end; return the new state at a release."""
        start, offset = self.t, self.x - self.drive(self.t)[0]

        def force(t: Any) -> Any:
            x1, v1, a1 = self.drive(t)
            return self.m * a1 + self.k * (offset + x1) + self.c * v1

        bound = self.static * self.N
        step = mpf(1) / (200 * abs(self.w)) if self.kind else bound / (4 * self.k * abs(self.w)) if self.w else end
        low, side = start, 0
        while low < end and not side:
            high = min(low + step, end)
            side = self.decide(force(high))
            if not side:
                low = high
        if side:
            self.t = self.root(lambda t: side * force(t) - bound, low, high)
        else:
            self.t = end
        self.x, self.v = offset + self.drive(self.t)[0], self.drive(self.t)[1]
        return side or None

    def root(self, f: Any, low: Any, high: Any) -> Any:
        """Return the root in a bracket; bisection until the secant converges."""
        fl = f(low)
        for _ in range(20):
            middle = (low + high) / 2
            fm = f(middle)
            if (fm > 0) == (fl > 0):
                low, fl = middle, fm
            else:
                high = middle
        return findroot(f, (low, high), solver="anderson", tol=mpf(10) ** (-2 * self.digits + 6), verify=False)

    def slip(self, end: Any) -> int | None:
        """Take one Taylor step; return the new state if the slip ends in it with an event."""
        X, V, V1 = self.series()
        size = max(abs(self.v), abs(V1[0]), self.static * self.N / self.k)
        h = end - self.t
        for n in (self.order - 1, self.order):
            for last in (V[n], V1[n]):  # the series of the drive ends sooner than that of a free oscillation
                if last:
                    h = min(h, (size * mpf(10) ** (-self.digits) / abs(last)) ** (mpf(1) / n))
        sliding = [self.state * (a - b) for a, b in zip(V1, V)][::-1]
        while self.power:  # far from rest the series does not know the narrow rise of friction there
            ahead = polyval(sliding, h)
            if abs(ahead - sliding[-1]) <= self.vs + max(min(ahead, sliding[-1]), 0) / 2:
                break
            h /= 2
        low = mpf(0)
        for i in range(1, 33):
            high = h * i / 32
            if polyval(sliding, high) <= 0:
                if not low:  # the slip starts from rest: try a shorter step
                    low, high = self.rise(sliding, high)
                span = self.root(lambda at: polyval(sliding, at), low, high)
                self.t, self.x = self.t + span, polyval(X[::-1], span)
                return self.capture()
            low = high
        self.t, self.x, self.v = self.t + h, polyval(X[::-1], h), polyval(V[::-1], h)
        return None

    def rise(self, sliding: Series, high: Any) -> tuple[Any, Any]:
        """Find where a slip shorter than a sample is positive."""
        for _ in range(self.digits):
            if polyval(sliding, high / 4) > 0:
                return high / 4, high
            high /= 4
        raise SpecError(f"A slip at {float(self.t):.9g} s is too short to be resolved with {self.digits} digits.")

    def capture(self) -> int | None:
        """Give the platform the velocity of the lower one; return the new state, None at a grazing contact."""
        _, self.v, a1 = self.drive(self.t)
        found = self.decide(self.m * a1 + self.k * self.x + self.c * self.v)
        return None if found == self.state else found

    def drive_series(self) -> Series:
        """Return the Taylor coefficients of the velocity of the lower platform."""
        n, w = self.order + 1, self.w
        if self.kind == 0:
            return [w] + [mpf(0)] * (n - 1)
        C, S = [self.r * cos(w * self.t)], [self.r * sin(w * self.t)]
        for i in range(1, n):
            C.append(-w * S[i - 1] / i)
            S.append(w * C[i - 1] / i)
        if self.kind == 1:
            return [-w * value for value in S]
        product = [_times(S, C, i) for i in range(n)]
        q = [sqrt(self.rod**2 - S[0] ** 2)]
        for i in range(1, n):
            q.append((-_times(S, S, i) - (_times([*q, mpf(0)], [*q, mpf(0)], i))) / (2 * q[0]))
        ratio: Series = []
        for i in range(n):
            ratio.append((product[i] - _times([*ratio, mpf(0)], q, i)) / q[0])
        return [-w * (a + b) for a, b in zip(S, ratio)]

    def series(self) -> tuple[Series, Series, Series]:
        """Return the Taylor coefficients of position and velocity, and of the velocity of the lower platform."""
        V1, X, V = self.drive_series(), [self.x], [self.v]
        s, drop = self.state, self.static - self.kinetic
        powers: list[Series] = [[] for _ in range(max(self.power, 1))]
        E: Series = []
        for n in range(self.order):
            powers[0].append(s * (V1[n] - V[n]) / self.vs)
            for low, high in pairwise(powers):
                high.append(_times(low, powers[0], n))
            mu = self.viscous * self.vs * powers[0][n] + (self.kinetic if n == 0 else 0)
            if self.power:
                z = powers[-1]
                E.append(exp(-z[0]) if n == 0 else -sum(j * z[j] * E[n - j] for j in range(1, n + 1)) / n)
                mu += drop * E[n]
            force = s * self.N * mu - self.k * X[n] - self.c * V[n]
            X.append(V[n] / (n + 1))
            V.append(force / (self.m * (n + 1)))
        return X, V, V1
