"""Questions about the joints of a mechanism in motion, each for the model that one word chooses.

``model="small"``: small tilts (L1), the fast model of first order.  ``model="exact"``: every loop closed in space.  See
theory/joints-that-share-a-tilt and theory/closure-in-space.  Every answer says which model it is about.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from graphsynth.core.angles import angle
from graphsynth.core.checks import choice
from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.bearing import Condition
    from graphsynth.jamming.joints.certify import TurnCertificate
    from graphsynth.jamming.joints.drawing import Tolerances
    from graphsynth.jamming.joints.limits import Misalignment
    from graphsynth.jamming.joints.program import Bearings
    from graphsynth.jamming.joints.scale import DirectionMap, ScaleCertificate, SensitivityTable
    from graphsynth.kinematics.engine.result import Motion

    Tilt: TypeAlias = Misalignment | Iterable[Misalignment] | float | str
    Joints: TypeAlias = Bearings | float | str
Model: TypeAlias = Literal["small", "exact"]


def is_exact(model: str) -> bool:
    """Whether the exact model is asked for; `GeometryError` for a word that names none."""
    return choice("model", model, ("small", "exact")) == "exact"


def asked(motion: Any, tilt: Any, joints: Any, fits: bool = False) -> tuple[Motion, Any, Any]:
    """Return motion, limits and misalignments as the models take them.

    `GeometryError` for what is no motion, and for one without misaligned axes or limits of its joints; ``fits``: these
    may come from tolerances.
    """
    from graphsynth.jamming.joints.limits import JointLimits, Misalignment
    from graphsynth.kinematics.engine.result import Motion

    if not isinstance(motion, Motion):
        raise GeometryError(
            f"subject = {motion!r} is neither a Motion (simulate) nor a TiltedFourBar or ToleranceBox; give one"
        )
    if tilt is None:
        raise GeometryError('no axis is misaligned; give tilt="0.5 deg" or tilt=Misalignment(base, link, alpha)')
    if joints is None and not fits:
        raise GeometryError('the joints have no limits; give joints="1 deg", a Bearing or JointLimits, or a mapping')
    if isinstance(tilt, float | int | str):
        driver = motion.mechanism.drivers[0]
        tilt = Misalignment(driver.base, driver.link, angle("tilt", tilt))
    if isinstance(joints, float | int | str):
        joints = JointLimits(angle("joints", joints))
    return motion, joints, tilt


def certified_arcs(
    motion: Motion,
    bearings: Joints,
    tilts: Tilt,
    *,
    model: Model = "small",
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    resolution: float = 1e-3,
    seconds: float = 60.0,
) -> TurnCertificate:
    """Prove which arcs of the input are free and which bind.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; or, in radians or as text, the tilt that every joint allows
        and the misalignment of the first driver's axis.
    model : {"small", "exact"}
        Proofs in the small-tilt model with bounds of what it neglects, or with every loop closed in space.
    tolerances : float or iterable of PartTolerance
        As for `graphsynth.jamming.joints.certify_coupled`; what is proved holds for all members.
    resolution : float
        Width, over the range, below which a piece of the input is left undecided.
    seconds : float
        Time of the proofs.

    Returns
    -------
    TurnCertificate
        Certified: ``arcs(1)`` are free, ``arcs(-1)`` bind, ``arcs(0)`` are undecided; ``model`` says of what.

    Examples
    --------
    >>> import math
    >>> from graphsynth import Mechanism
    >>> from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate("20..40 deg")
    >>> joints = {(1, 2): SPHERICAL, (2, 3): JointLimits(0.02), (0, 3): RIGID}
    >>> arcs = certified_arcs(motion, joints, 0.1, resolution=0.01)
    >>> edge = math.asin(2.5 * math.sin(0.02) / math.sin(0.1))  # where the joint tilts by asin(0.4 sin 0.1 sin u)
    >>> arcs.arcs(1)[0][1] < edge < arcs.arcs(-1)[0][0]
    True
    """
    motion, limits, axes = asked(motion, tilts, bearings, isinstance(tolerances, Iterable))
    options: Any = {"condition": condition, "tolerances": tolerances, "resolution": resolution, "seconds": seconds}
    if is_exact(model):
        from graphsynth.jamming.space.turn import certify_in_space

        return certify_in_space(motion, limits, axes, **options)
    from graphsynth.jamming.joints.certify import certify_coupled

    return certify_coupled(motion, limits, axes, **options)


def largest_scale(
    motion: Motion,
    bearings: Joints,
    tilts: Tilt,
    *,
    model: Model = "small",
    condition: Condition = "A",
    tolerances: Tolerances = 0.0,
    relative_gap: float | None = None,
    seconds: float | None = None,
) -> ScaleCertificate:
    """Enclose the factor on all misalignments at which a motion begins to bind, with proof on both sides.

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; or, in radians or as text, the tilt that every joint allows
        and the misalignment of the first driver's axis.
    model : {"small", "exact"}
        The bounds are about small tilts (without what these neglect), or about every loop closed in space.
    tolerances : float or iterable of PartTolerance
        As for `graphsynth.jamming.joints.certify_coupled`; what is proved holds for all members.
    relative_gap, seconds : optional
        Wanted distance of the bounds, and time: 1e-4 and 20 s with small tilts, 1e-3 and 60 s with exact ones.

    Returns
    -------
    ScaleCertificate
        Certified for the model that ``model`` names; see `graphsynth.jamming.joints.largest_scale` and
        `graphsynth.jamming.space.largest_scale`.

    Examples
    --------
    >>> from graphsynth import Mechanism
    >>> motion = Mechanism.four_bar(2, 1, 2.5, 2.5).simulate("89..91 deg")
    >>> small, exact = (largest_scale(motion, 0.1, 0.1, model=word) for word in ("small", "exact"))
    >>> exact.low < exact.high and abs(exact.low / small.low - 1.0) < 0.02
    True
    """
    motion, limits, axes = asked(motion, tilts, bearings, isinstance(tolerances, Iterable))
    options: Any = {"condition": condition, "tolerances": tolerances, "relative_gap": relative_gap, "seconds": seconds}
    options = {name: value for name, value in options.items() if value is not None}
    if is_exact(model):
        from graphsynth.jamming.space.scale import largest_scale as exact_scale

        return exact_scale(motion, limits, axes, **options)
    from graphsynth.jamming.joints.scale import largest_scale as small_scale

    return small_scale(motion, limits, axes, **options)


def direction_map(
    motion: Motion,
    bearings: Joints,
    tilts: Tilt,
    *,
    model: Model = "small",
    condition: Condition = "A",
    directions: int = 12,
) -> DirectionMap:
    """Turn all misalignments together through half a turn and find the worst direction (estimated).

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; or, in radians or as text, the tilt that every joint allows
        and the misalignment of the first driver's axis.
    model : {"small", "exact"}
        Small tilts, or every loop closed in space: about 0.1 s for each sample and direction.
    directions : int
        Number of directions over half a turn, at least 3.

    Returns
    -------
    DirectionMap
        Its ``bound`` for the directions between is NaN with exact closure.
    """
    motion, limits, axes = asked(motion, tilts, bearings)
    if is_exact(model):
        from graphsynth.jamming.space.sensitivity import direction_map as exact_map

        return exact_map(motion, limits, axes, condition=condition, directions=directions)
    from graphsynth.jamming.joints.scale import direction_map as small_map

    return small_map(motion, limits, axes, condition=condition, directions=directions)


def compare_sensitivities(
    motion: Motion,
    bearings: Joints,
    tilts: Tilt,
    *,
    model: Model = "small",
    condition: Condition = "A",
    by: float = 0.1,
) -> SensitivityTable:
    """Loosen every limit by itself and tell how much more misalignment a motion then takes (estimated).

    Parameters
    ----------
    motion, bearings, tilts, condition
        As for `graphsynth.jamming.joints.assess_coupled`; or, in radians or as text, the tilt that every joint allows
        and the misalignment of the first driver's axis.
    model : {"small", "exact"}
        Small tilts, or every loop closed in space.
    by : float
        Relative growth of a limit: 0.1 is ten percent.

    Returns
    -------
    SensitivityTable
        The first row is the limit to loosen first.
    """
    motion, limits, axes = asked(motion, tilts, bearings)
    if is_exact(model):
        from graphsynth.jamming.space.sensitivity import compare_sensitivities as exact_table

        return exact_table(motion, limits, axes, condition=condition, by=by)
    from graphsynth.jamming.joints.scale import compare_sensitivities as small_table

    return small_table(motion, limits, axes, condition=condition, by=by)
