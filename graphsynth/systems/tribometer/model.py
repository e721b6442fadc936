"""The tribometer: an upper platform on a spring, dragged by friction on a driven lower platform.

One model, three methods: the event-driven automaton (the reference), time stepping with complementarity, and the
regularised ordinary differential equation; and the same as a model of the general dynamics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.forms import Solving, regularised, time_stepping
from graphsynth.systems.tribometer.motion import EventGuard, StickSlipMotion, event_driven
from graphsynth.systems.tribometer.platforms import Drive, Platforms, StribeckLaw, finite, positive

if TYPE_CHECKING:
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.start import StartReport

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tribometer(Platforms):
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

    def _times(self, duration: float, times: ArrayLike | None) -> tuple[float, Array]:
        from graphsynth.dynamics.motors import numbers

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
        from graphsynth.dynamics.motors import whole

        duration, wanted = self._times(duration, times)
        if not 1e-13 <= finite("relative tolerance", rtol) <= 1e-2:
            raise SpecError(f"The relative tolerance is {rtol:g}; give a number from 1e-13 to 1e-2.")
        calls = whole("most_calls", most_calls, "raise it for long runs")
        how = Solving(speed, str(solver), rtol, jacobian, calls)
        return regularised(self, duration, wanted, how, solver == "LSODA" if check is None else check)


class _DriveLaw:
    """A drive of a tribometer as a motion law."""

    def __init__(self, drive: Drive) -> None:
        self._drive = drive

    def __call__(self, u: Array) -> tuple[Array, Array, Array]:
        motion = self._drive.motion(u)
        return motion.x, motion.v, motion.a


def general_model(tribometer: Tribometer) -> tuple[DynamicModel, StartReport]:
    """Return a tribometer as a general model with its start: two guides, a spring, a prescribed motion, dry friction.

    Parameters
    ----------
    tribometer : Tribometer
        With two coefficients or a Stribeck law of exponent 2, without a viscous part.

    Returns
    -------
    model : DynamicModel
        Link 1 is the lower platform, link 2 the upper one; the weight carries the load.
    start : StartReport

    Raises
    ------
    SpecError
        A law that `JointFriction` does not have.

    Examples
    --------
    >>> from graphsynth.dynamics.integrate import simulate_dynamics
    >>> model, start = general_model(Tribometer())
    >>> motion = simulate_dynamics(model, [0.0, 0.5], start=start)
    >>> [(event.kind, round(event.time, 9)) for event in motion.events]
    [('slip', 0.36531188)]
    """
    from graphsynth.dynamics.elements import JointFriction, Spring
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.mechanism.joints import Prismatic
    from graphsynth.mechanism.laws import Driver
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

    law, drive = tribometer.law, tribometer.drive
    stribeck = law.velocity if isinstance(law, StribeckLaw) else 0.0
    if law.viscous or (isinstance(law, StribeckLaw) and law.exponent != 2.0):
        raise SpecError(f"{law} has no general element; take the Stribeck exponent 2, and no viscous part.")
    begin = drive.motion(0.0)
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    pose = ((0.0, 0.0, 0.0), (float(begin.x), 0.0, 0.0), (tribometer.x2, 0.0, 0.0))
    far = 1.0 + 10.0 * tribometer.reach  # the spring never comes to length 0
    model = DynamicModel(
        Mechanism(graph, (Prismatic(0, 1), Prismatic(1, 2)), pose=pose),
        {1: Body(tribometer.mass, tribometer.mass), 2: Body(tribometer.mass, tribometer.mass)},
        (
            Spring(0, 2, (-far, 0.0), (0.0, 0.0), tribometer.stiffness, far, tribometer.damping),
            JointFriction(1, 2, law.kinetic, law.static, stribeck_speed=stribeck),
        ),
        gravity=(0.0, -tribometer.normal / tribometer.mass),
        prescribed=(Driver(0, 1, _DriveLaw(drive)),),
    )
    rate = float(begin.v) if tribometer.v2 is None else tribometer.v2
    return model, consistent_start(model, keep={(2, "x"): tribometer.x2}, keep_rates={(2, "x"): rate})
