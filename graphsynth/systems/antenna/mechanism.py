"""The antenna pointing mechanism: the entry to everything that is computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from graphsynth.systems.antenna.model import PointingDimensions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.systems.antenna.closed_form import Convention, CrankAngles, ModelComparison, PointingModes
    from graphsynth.systems.antenna.folds import Fold
    from graphsynth.systems.antenna.loop_equations import ChartReport, LoopSolution, PassiveAngles, RootSurvey
    from graphsynth.systems.antenna.model import Poses
    from graphsynth.systems.antenna.motion import DeadPoint, PointingSweep, Rates
    from graphsynth.systems.antenna.precise import ApproachToFold
    from graphsynth.systems.antenna.tolerance import Tolerance


@dataclass(frozen=True)
class PointingMechanism(PointingDimensions):
    """A reflector on a central gimbal, tilted about two axes by two crank-and-rod legs.

    Leg Y (rod ``l2``, crank ``l3``, crank angle ``phi_x``) tilts the reflector about X: elevation ``a``.  Leg X (rod
    ``l4``, crank ``l5``, crank angle ``phi_y``) turns it about Y: azimuth ``b``.  Both are attached at the distance
    ``l1`` from the centre.  At rest all angles are zero.  The defaults are the geometry ART of theory/antenna 2.

    Parameters
    ----------
    l1, l2, l3, l4, l5 : float
        Lengths, metres (any common unit).
    order : {"YX", "XY"}
        Order of the gimbal: "YX" has the azimuth axis fixed to the ground, ``R = R_y(b) R_x(a)``; "XY" the elevation
        axis, ``R = R_x(a) R_y(b)``.

    Raises
    ------
    GeometryError
        A length that is not positive and finite, or an unknown order.

    Notes
    -----
    [Perechesova et al. 2014], corrected; theory/antenna.

    Examples
    --------
    >>> import numpy as np
    >>> poses = PointingMechanism().poses(np.radians(40), np.radians(40))
    >>> np.degrees([poses.a, poses.b]).round(9).tolist()
    [23.712080016, 22.447857254]
    """

    def poses(self, phi_x: ArrayLike, phi_y: ArrayLike, s_y: int = 1, s_x: int = -1) -> Poses:
        """Reflector angles for crank angles, on one assembly mode (closed form, theory/antenna 5).

        Parameters
        ----------
        phi_x, phi_y : array_like
            Angles of the cranks of legs Y and X, radians, broadcast against each other.
        s_y, s_x : {+1, -1}
            Branch signs; the defaults contain the rest pose.

        Returns
        -------
        Poses
            Accurate to a few units of rounding divided by ``margin_y`` and ``margin_x`` (estimated).  A pose that
            cannot be assembled has NaN, a status and the deficit in length.

        Raises
        ------
        GeometryError
            A crank angle that is not finite, a sign that is not +1 or -1.
        """
        from graphsynth.systems.antenna.closed_form import poses

        return poses(self, phi_x, phi_y, s_y, s_x)

    def solve(self, phi_x: ArrayLike, phi_y: ArrayLike) -> PointingModes:
        """All assembly modes at the given crank angles: up to four, none twice.

        Examples
        --------
        >>> PointingMechanism().solve(0.2, 0.3).count
        array(4)
        """
        from graphsynth.systems.antenna.closed_form import solve

        return solve(self, phi_x, phi_y)

    def cranks(self, a: ArrayLike, b: ArrayLike, elbow_y: int | None = None, elbow_x: int | None = None) -> CrankAngles:
        """Crank angles that point the reflector (closed form, each leg by itself).

        Parameters
        ----------
        a, b : array_like
            Wanted elevation and azimuth, radians.
        elbow_y, elbow_x : {+1, -1}, optional
            Which of the two settings of each crank; by default those of the rest pose (-1 and +1).

        Returns
        -------
        CrankAngles
            With the assembly mode on which `poses` returns to the wanted pose.

        Examples
        --------
        >>> import numpy as np
        >>> found = PointingMechanism().cranks(np.radians(10), np.radians(-5))
        >>> np.degrees([found.phi_x, found.phi_y]).round(6).tolist()
        [17.001794, -8.466231]
        """
        from graphsynth.systems.antenna.closed_form import cranks

        return cranks(self, a, b, elbow_y, elbow_x)

    def passive_angles(self, poses: Poses) -> PassiveAngles:
        """Angles of all passive joints at known poses: the twelve unknowns of the loop equations (theory/antenna 5)."""
        from graphsynth.systems.antenna.loop_equations import passive_angles

        return passive_angles(self, poses)

    def solve_loops(
        self, phi_x: ArrayLike, phi_y: ArrayLike, *, start: ArrayLike | None = None, chart: str = "corrected"
    ) -> LoopSolution:
        """Solve the twelve loop equations by Newton's method, without the closed form (theory/antenna 3).

        Parameters
        ----------
        phi_x, phi_y : array_like
            Crank angles, radians.
        start : array_like, shape (..., 12), optional
            Unknowns to start from; by default the rest pose, followed to the given angles in small steps.
        chart : {"corrected", "printed"}
            "printed" turns the ball joint of leg Y about y, x, y as the source does, which is singular at rest; without
            ``start`` this is noticed and the regular coordinates are used.

        Returns
        -------
        LoopSolution
            Roots whose orientations do not agree are rejected.
        """
        from graphsynth.systems.antenna.loop_equations import solve_loops

        return solve_loops(self, phi_x, phi_y, start, chart)

    def survey_roots(
        self, phi_x: float, phi_y: float, *, starts: int = 200, seed: int = 0, chart: str = "corrected"
    ) -> RootSurvey:
        """Newton's method from random starts: genuine roots by assembly mode, false orientation roots counted."""
        from graphsynth.systems.antenna.loop_equations import survey_roots

        return survey_roots(self, phi_x, phi_y, starts, seed, chart)

    def check_chart(
        self, phi_x: float, phi_y: float, chart: str = "corrected", *, s_y: int = 1, s_x: int = -1, scaled: bool = True
    ) -> ChartReport:
        """Judge the coordinates of the loop equations at a pose: rank, condition, verdict (theory/antenna 4).

        Examples
        --------
        >>> report = PointingMechanism().check_chart(0.0, 0.0, "printed")
        >>> report.rank, report.verdict, report.use
        (11, 'coordinates singular, mechanism regular', 'corrected')
        """
        from graphsynth.systems.antenna.loop_equations import check_chart

        return check_chart(self, phi_x, phi_y, chart, s_y, s_x, scaled)

    def rates(
        self,
        phi_x: ArrayLike,
        phi_y: ArrayLike,
        dphi_x: ArrayLike = 0.0,
        dphi_y: ArrayLike = 0.0,
        ddphi_x: ArrayLike = 0.0,
        ddphi_y: ArrayLike = 0.0,
        *,
        s_y: int = 1,
        s_x: int = -1,
    ) -> Rates:
        """Velocity Jacobian, velocities and accelerations (theory/antenna 6); crank rates in rad/s, rad/s^2.

        Examples
        --------
        >>> import numpy as np
        >>> PointingMechanism().rates(np.radians(15), np.radians(15)).jacobian.round(9).tolist()
        [[0.583946582, 0.01261739], [0.0, 0.579026781]]
        """
        from graphsynth.systems.antenna.motion import rates

        return rates(self, phi_x, phi_y, (dphi_x, dphi_y), (ddphi_x, ddphi_y), s_y, s_x)

    def passive_rates(self, poses: Poses, dphi_x: ArrayLike, dphi_y: ArrayLike) -> NDArray[np.float64]:
        """Rates of the twelve unknowns for crank speeds, shape (..., 12), from the 12 x 12 Jacobian."""
        from graphsynth.systems.antenna.motion import passive_rates

        return passive_rates(self, poses, dphi_x, dphi_y)

    def folds(self, leg: str, phi_other: float = 0.0, *, s_other: int | None = None) -> tuple[Fold, ...]:
        """All folds of one leg over a full turn of its crank, with place, output, order and coefficient.

        See theory/antenna 7.

        Parameters
        ----------
        leg : {"Y", "X"}
        phi_other : float
            Angle of the other crank, radians.
        s_other : {+1, -1}, optional
            Branch of the other leg; by default that of the rest pose.

        Returns
        -------
        tuple of Fold
            Sorted by crank angle.  The output of the other leg is NaN where that leg does not reach.

        Raises
        ------
        GeometryError
            The fold depends on the other leg, and that leg does not reach at ``phi_other``.

        Examples
        --------
        >>> PointingMechanism().folds("X")
        ()
        >>> len(PointingMechanism(l3=0.12, l5=0.12).folds("X"))
        4
        """
        from graphsynth.systems.antenna.folds import folds

        return folds(self, leg, phi_other, s_other)

    def dead_points(self, leg: str, phi_other: float = 0.0, *, s_other: int | None = None) -> tuple[DeadPoint, ...]:
        """All dead points of one crank: crank and rod in a plane with the crank axis (theory/antenna 7).

        Parameters are those of `folds`.
        """
        from graphsynth.systems.antenna.motion import dead_points

        return dead_points(self, leg, phi_other, s_other)

    def sweep(
        self,
        t: ArrayLike,
        direction: tuple[float, float] = (1.0, 1.0),
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        s_y: int = 1,
        s_x: int = -1,
    ) -> PointingSweep:
        """Move both cranks along ``offset + t * direction`` on one assembly mode and stop at the first fold.

        Parameters
        ----------
        t : array_like, shape (n,)
            Rising or falling path parameter, radians.
        direction, offset : tuple of float
            Change of ``(phi_x, phi_y)`` per unit of ``t``, and their values at ``t = 0``.
        s_y, s_x : {+1, -1}
            Assembly mode.

        Returns
        -------
        PointingSweep
            Never continues on another mode; beyond the fold all angles are NaN.

        Examples
        --------
        >>> import numpy as np
        >>> sweep = PointingMechanism(l3=0.1, l5=0.1).sweep(np.radians(np.arange(0.0, 76.0)))
        >>> np.degrees([sweep.fold.parameter, sweep.fold.a]).round(9).tolist(), round(sweep.fold.coefficient, 9)
        ([69.394627605, 150.578155425], 2.869433008)
        """
        from graphsynth.systems.antenna.motion import sweep

        return sweep(self, t, direction, offset, s_y, s_x)

    def approach(self, fold: Fold, distances: ArrayLike, *, branch: int = 1) -> ApproachToFold:
        """Output at small distances from a fold: exact, compensated, by the square root, and plain with its error.

        Parameters
        ----------
        fold : Fold
        distances : array_like, shape (n,)
            Positive, radians of the path parameter; may be far below the spacing of floating-point numbers.
        branch : {+1, -1}
            Branch sign of the folding leg.
        """
        from graphsynth.systems.antenna.precise import approach

        return approach(self, fold, distances, branch)

    def compare(
        self,
        other: PointingMechanism,
        phi_x: ArrayLike,
        phi_y: ArrayLike | None = None,
        *,
        reading: Convention | None = None,
        other_reading: Convention | None = None,
    ) -> ModelComparison:
        """Difference of two models over a sweep: gimbal order, lengths, senses, mounting, reading (theory/antenna 8).

        Parameters
        ----------
        other : PointingMechanism
        phi_x, phi_y : array_like
            Crank angles, radians; ``phi_y = phi_x`` unless given.
        reading, other_reading : Convention, optional
            Conventions of each model.

        Examples
        --------
        >>> import numpy as np
        >>> found = PointingMechanism().compare(PointingMechanism(order="XY"), np.radians([15, 40]))
        >>> found.arcminutes.round(6).tolist()
        [0.656059, 30.989576]
        """
        from graphsynth.systems.antenna.closed_form import Convention, compare

        return compare(self, other, phi_x, phi_y, reading or Convention(), other_reading or Convention())

    def tolerance(
        self,
        phi_x: float,
        phi_y: float,
        widths: ArrayLike = 5e-5,
        *,
        s_y: int = 1,
        s_x: int = -1,
        method: str = "mixed",
        converted: bool = False,
    ) -> Tolerance:
        """Certified bounds of elevation and azimuth if every length may deviate by plus or minus its width.

        Parameters
        ----------
        phi_x, phi_y : float
            Crank angles, radians.
        widths : float or array_like, shape (5,)
            Tolerances of l1 to l5, unit of the lengths.
        s_y, s_x : {+1, -1}
            Assembly mode.
        method : {"mixed", "mean_value"}
            "mixed" puts every length with a proved sign of the derivative to the ends of its interval
            (theory/antenna 9, step 3); "mean_value" is faster and some per cent wider.
        converted : bool
            The doubles given stand for decimals or degrees: the bounds then hold for the numbers before they were
            converted to metres and radians and rounded (up to three roundings each).

        Returns
        -------
        Tolerance
            Certified, or undecided with the lengths that let a fold into the box; with the corner values and the
            first-order estimate beside it.

        Raises
        ------
        GeometryError
            A width that is negative or not below its length.

        Examples
        --------
        >>> import numpy as np
        >>> found = PointingMechanism().tolerance(np.radians(15), np.radians(15))
        >>> print(found.report())
        certified: one pose of this mode for all lengths in the box
        elevation 8.907526593 deg: certified -44.3763 .. +44.4260, corners -44.3762 .. +44.4259, first order 44.4010
        azimuth 8.814978215 deg: certified -42.9741 .. +43.0184, corners -42.9740 .. +43.0184, first order 42.9962
        """
        from graphsynth.systems.antenna.tolerance import tolerance

        return tolerance(self, phi_x, phi_y, widths, s_y, s_x, method, converted)
