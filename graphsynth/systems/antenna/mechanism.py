"""The antenna pointing mechanism, the entry to all that is computed: its methods are functions of the modules."""

from __future__ import annotations

from dataclasses import dataclass

from graphsynth.systems.antenna import closed_form, loop_equations, motion, precise
from graphsynth.systems.antenna.folds import folds as folds_of_leg
from graphsynth.systems.antenna.model import PointingDimensions
from graphsynth.systems.antenna.tolerance import tolerance as tolerance_at


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

    poses = closed_form.poses
    solve = closed_form.solve
    cranks = closed_form.cranks
    compare = closed_form.compare
    passive_angles = loop_equations.passive_angles
    solve_loops = loop_equations.solve_loops
    survey_roots = loop_equations.survey_roots
    check_chart = loop_equations.check_chart
    rates = motion.rates
    passive_rates = motion.passive_rates
    dead_points = motion.dead_points
    sweep = motion.sweep
    folds = folds_of_leg
    approach = precise.approach
    tolerance = tolerance_at
