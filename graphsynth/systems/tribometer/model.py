"""The tribometer: an upper platform on a spring, dragged by friction on a driven lower platform.

One model, three methods: the event-driven automaton (the reference), time stepping with complementarity, and the
regularised ordinary differential equation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.friction.laws import FrictionLaw, StribeckLaw, TwoCoefficientLaw, finite, positive
from graphsynth.dynamics.motors import numbers, whole
from graphsynth.systems.tribometer.drives import CrankDrive, Drive
from graphsynth.systems.tribometer.events import EventGuard
from graphsynth.systems.tribometer.stick_slip import StickSlipMotion, event_driven
from graphsynth.systems.tribometer.stick_slip_forms import regularised, time_stepping

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tribometer:
    """A tribometer; the defaults are the chosen values of theory/tribometer 1 (Stribeck law, crank drive).

    ``m x2'' = -k x2 - c x2' + F``; ``F = sgn(u) N mu(|u|)`` while slipping with ``u = x1' - x2'``, and whatever keeps
    ``u = 0``, at most ``mu_s N``, while sticking.

    Parameters
    ----------
    mass : float
        Mass of the upper platform, kg.
    stiffness : float
        Spring stiffness, N/m.
    damping : float
        N s/m.
    load : float
        Vertical force P beside the weight, N; the normal force is ``mass gravity + load``.
    gravity : float
        m/s^2.
    law : TwoCoefficientLaw or StribeckLaw
    drive : CrankDrive, HarmonicDrive or BeltDrive
    x2 : float
        Initial position of the upper platform, m; the spring is relaxed at 0.
    v2 : float or None
        Initial velocity, m/s; None: that of the lower platform.

    Raises
    ------
    SpecError
        If a number is out of its bounds, or the platforms are not pressed together.

    Notes
    -----
    [Perechesova et al. 2014]; theory/tribometer.

    Examples
    --------
    >>> motion = Tribometer().event_driven(1.0)
    >>> [event.name for event in motion.events]
    ['SLIP(-1)', 'STICK', 'SLIP(-1)', 'STICK']
    >>> round(motion.events[0].time, 12)
    0.365311879706
    """

    mass: float = 1.0
    stiffness: float = 400.0
    damping: float = 2.0
    load: float = 0.0
    gravity: float = 9.81
    law: FrictionLaw = field(default_factory=lambda: StribeckLaw(0.40, 0.25, 0.02))
    drive: Drive = field(default_factory=lambda: CrankDrive(0.03, 0.12, 2.0))
    x2: float = 0.0
    v2: float | None = None

    def __post_init__(self) -> None:
        for name, value in (
            ("mass", positive("mass", self.mass)),
            ("stiffness", positive("spring stiffness", self.stiffness)),
            ("damping", positive("damping", self.damping, or_zero=True)),
            ("load", finite("load", self.load)),
            ("gravity", positive("gravity", self.gravity, or_zero=True)),
            ("x2", finite("initial position", self.x2)),
            ("v2", None if self.v2 is None else finite("initial velocity", self.v2)),
        ):
            object.__setattr__(self, name, value)
        check_fields(self, ("mass", "stiffness"), SpecError, small=("damping", "load", "gravity", "x2", "v2"))
        if not isinstance(self.law, FrictionLaw):
            raise SpecError(f"The friction law is {self.law!r}; give a TwoCoefficientLaw or a StribeckLaw.")
        if not isinstance(self.drive, Drive):
            raise SpecError(f"The drive is {self.drive!r}; give a CrankDrive, a HarmonicDrive or a BeltDrive.")
        if not self.normal > 0.0:
            raise SpecError(
                f"The normal force is {self.normal:g} N; the platforms separate: "
                "raise the load so that mass * gravity + load is greater than zero."
            )

    @property
    def normal(self) -> float:
        """Normal force ``N = m g + P``, N."""
        return self.mass * self.gravity + self.load

    @property
    def frequency(self) -> float:
        """Natural angular frequency ``sqrt(k/m)``, rad/s."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def reach(self) -> float:
        """Natural scale of the displacement, ``mu_s N / k``, m."""
        return self.law.static * self.normal / self.stiffness

    @property
    def closed_form(self) -> bool:
        """Whether slip pieces have a closed form (two coefficients, no viscous part)."""
        return isinstance(self.law, TwoCoefficientLaw) and self.law.viscous == 0.0

    def stiffened(self, factor: float, *, scaled_damping: bool = True) -> Tribometer:
        """Return the same tribometer with the stiffness times ``factor``.

        Parameters
        ----------
        factor : float
        scaled_damping : bool
            Change the damping so that the damping ratio stays.
        """
        factor = positive("factor on the stiffness", factor)
        damping = self.damping * math.sqrt(factor) if scaled_damping else self.damping
        return replace(self, stiffness=self.stiffness * factor, damping=damping)

    def limit_force(self, times: ArrayLike) -> Array:
        """Spring force over the normal force in the limit of a stiff, damped spring, ``sgn(v1) mu(|v1|)``.

        The averaged limit to which ``k x2 / N`` tends (theory/tribometer 11).
        """
        v = self.drive.motion(times).v
        found: Array = np.sign(v) * self.law.coefficient(np.abs(v))
        return found

    def data(self) -> Array:
        """Return the data of the kernels."""
        return np.array(
            [self.mass, self.stiffness, self.damping, self.normal, *self.law._packed(), *self.drive._packed()]
        )

    def _start(self) -> tuple[float, float]:
        """Return the initial velocity and state."""
        begin = self.drive.motion(0.0)
        v1, a1 = float(begin.v), float(begin.a)
        v = v1 if self.v2 is None else self.v2
        if v != v1:
            return v, math.copysign(1.0, v1 - v)
        force = self.mass * a1 + self.stiffness * self.x2 + self.damping * v1
        return v, 0.0 if abs(force) <= self.law.static * self.normal else math.copysign(1.0, force)

    def _times(self, duration: float, times: ArrayLike | None) -> tuple[float, Array]:
        duration = positive("duration", duration)
        if times is None:
            return duration, np.linspace(0.0, duration, 1001)
        wanted = np.atleast_1d(numbers("times", times, "s", finite=False))
        if wanted.ndim != 1 or not wanted.size or not ((wanted >= 0.0) & (wanted <= duration)).all():
            raise SpecError(f"The times asked for must be numbers between 0 and the duration {duration:g}.")
        if (np.diff(wanted) < 0.0).any():
            raise SpecError("The times asked for have to be in ascending order; sort them.")
        return duration, wanted

    def event_driven(
        self,
        duration: float = 10.0,
        *,
        times: ArrayLike | None = None,
        rtol: float = 1e-14,
        guard: EventGuard | None = None,
        estimate: bool = True,
    ) -> StickSlipMotion:
        """Run the hybrid automaton: stick exactly, slip in smooth pieces, events located to rounding.

        Parameters
        ----------
        duration : float
            Final time, s.
        times : array_like, optional
            Times of the curves; 1001 equal steps if not given.
        rtol : float
            Relative tolerance of integrated slip pieces (1e-14 to 1e-3); closed-form pieces need none.
        guard : EventGuard, optional
            Bounds against Zeno behaviour.
        estimate : bool
            Estimate the errors by a second run with a larger tolerance and slightly changed data.

        Returns
        -------
        StickSlipMotion
            With ``status`` other than `RunStatus.COMPLETE` the motion up to where the run stopped.

        Raises
        ------
        SpecError
            If a number is out of its bounds.
        """
        duration, wanted = self._times(duration, times)
        if not 1e-14 <= finite("relative tolerance", rtol) <= 1e-3:
            raise SpecError(f"The relative tolerance is {rtol:g}; give a number from 1e-14 to 1e-3.")
        return event_driven(self, duration, wanted, rtol, guard or EventGuard(), estimate)

    def time_stepping(
        self,
        duration: float = 10.0,
        *,
        step: float = 1e-4,
        times: ArrayLike | None = None,
        weight: float = 0.5,
        estimate: bool = True,
    ) -> StickSlipMotion:
        """March with fixed steps and friction impulses from a complementarity problem.

        First order; needs no event location, so it survives Zeno behaviour.

        Parameters
        ----------
        duration : float
            Final time, s.
        step : float
            Largest step, s; the duration is divided into equal steps.
        times : array_like, optional
            Times of the curves; 1001 equal steps if not given.
        weight : float
            Weight of the end of a step, 0 to 1.
        estimate : bool
            Estimate the error by a second run with steps of twice the length.

        Returns
        -------
        StickSlipMotion
            The times of the changes are whole steps; their errors come from the second run.

        Raises
        ------
        SpecError, TooLargeError
            If a number is out of its bounds, or the steps are too many.
        """
        duration, wanted = self._times(duration, times)
        return time_stepping(self, duration, wanted, step, weight, estimate)

    def regularised(
        self,
        duration: float = 10.0,
        *,
        speed: float = 1e-5,
        solver: str = "Radau",
        times: ArrayLike | None = None,
        rtol: float = 1e-8,
        jacobian: bool = True,
        check: bool | None = None,
        most_calls: int = 2_000_000,
    ) -> StickSlipMotion:
        """Solve the form with ``F = N mu(|u|) tanh(u / speed)``, which any solver accepts.

        It never sticks: the upper platform creeps.  The error of the result is its difference from an event-driven run.

        Parameters
        ----------
        duration : float
            Final time, s.
        speed : float
            Smoothing velocity epsilon, m/s, below the Stribeck velocity.
        solver : str
            "LSODA", "BDF", "Radau", "DOP853", "RK45" or "RK23" of scipy.
        times : array_like, optional
            Times of the curves; 1001 equal steps if not given.
        rtol : float
            Relative tolerance; the absolute one is a hundredth of it (of metres, metres per second).
        jacobian : bool
            Give the implicit solvers the exact Jacobian.
        check : bool or None
            Compare with a second implicit solver; None: if the solver is LSODA, which can report a wrong answer as a
            success.
        most_calls : int
            Bound on the calls of the right-hand side.

        Returns
        -------
        StickSlipMotion
            `RunStatus.FAILED` if the solver stopped, `RunStatus.UNRELIABLE` if the cross-check objects.

        Raises
        ------
        SpecError
            If the law has two coefficients, or a number is out of its bounds.
        """
        duration, wanted = self._times(duration, times)
        if not 1e-13 <= finite("relative tolerance", rtol) <= 1e-2:
            raise SpecError(f"The relative tolerance is {rtol:g}; give a number from 1e-13 to 1e-2.")
        checked = solver == "LSODA" if check is None else check
        calls = whole("most_calls", most_calls, "raise it for long runs")
        return regularised(self, duration, wanted, speed, str(solver), rtol, jacobian, checked, calls)
