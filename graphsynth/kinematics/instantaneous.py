"""Instantaneous kinematics of a motion: poles, polodes, inflection and Bresse circles, mechanical advantage.

Plain functions over all samples of a `Motion`, which has them as methods.  Derivatives are by the input, as in the
motion; what is geometry (poles, the inflection circle) does not depend on it.  Estimated: float64, NaN where the branch
does not reach, infinite where a link does not turn.

References
----------
[Bottema & Roth 1979], chapter 8; [Hunt 1978]; [Uicker et al. 2003], chapters 3 and 4.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import link_number
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Polodes(NamedTuple):
    """Fixed polode (in the frame of the base) and moving polode (in the frame of the link), each (n, 2)."""

    fixed: Array
    moving: Array


class Circles(NamedTuple):
    """A circle at every sample: ``centre`` (n, 2) in the base's frame, ``diameter`` (n,), ``pole`` (n, 2) on it."""

    centre: Array
    diameter: Array
    pole: Array


def _relative(motion: Motion, link: int, base: int | None) -> tuple[list[Complex], list[Array], Complex]:
    """Place of a link's origin in the frame of the base and its angle, each with two derivatives; cos + i sin of it."""
    mechanism = motion.mechanism
    link = link_number("link", link)
    base = mechanism.frame if base is None else link_number("base", base)
    if max(link, base) >= mechanism.graph.links or link == base:
        raise GeometryError(f"links {link} and {base}: give two of the links 0..{mechanism.graph.links - 1}")
    arrays = (motion.poses, motion.velocities, motion.accelerations)
    angle, rate, second = (array[:, link, 2] - array[:, base, 2] for array in arrays)
    d, d1, d2 = (
        array[:, link, 0] - array[:, base, 0] + 1j * (array[:, link, 1] - array[:, base, 1]) for array in arrays
    )
    w, a = motion.velocities[:, base, 2], motion.accelerations[:, base, 2]
    back = np.exp(-1j * motion.poses[:, base, 2])
    # derivatives of back * d, with back' = -i w back
    place = [back * d, back * (d1 - 1j * w * d), back * (d2 - 2j * w * d1 - (1j * a + w * w) * d)]
    return place, [angle, rate, second], np.exp(1j * angle)


def _pole(place: list[Complex], turn: list[Array]) -> Complex:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(turn[1] == 0.0, complex(math.inf, math.inf), place[0] + 1j * place[1] / turn[1])


def _points(z: Complex) -> Array:
    return np.column_stack([z.real, z.imag])


def instant_centre(motion: Motion, link: int, base: int | None = None) -> Array:
    """Return the instant centre (velocity pole) of a link against another one, the frame by default.

    Parameters
    ----------
    motion : Motion
    link, base : int

    Returns
    -------
    ndarray, shape (n, 2)
        In the frame of ``base``; infinite where the link only translates.

    Raises
    ------
    GeometryError
        Links that do not exist, or are the same.

    Notes
    -----
    ``I = r + i r' / theta'`` with the relative place r of the link's origin and its relative angle theta.
    """
    place, turn, _ = _relative(motion, link, base)
    return _points(_pole(place, turn))


def polodes(motion: Motion, link: int, base: int | None = None) -> Polodes:
    """Return the polodes (centrodes) of a link against another one: its motion is the rolling of one on the other.

    Parameters
    ----------
    motion : Motion
    link, base : int
        The frame by default.

    Returns
    -------
    Polodes

    Raises
    ------
    GeometryError
        Links that do not exist, or are the same.
    """
    place, turn, direction = _relative(motion, link, base)
    pole = _pole(place, turn)
    with np.errstate(invalid="ignore"):
        return Polodes(_points(pole), _points((pole - place[0]) / direction))


def _acceleration_at_pole(motion: Motion, link: int, base: int | None) -> tuple[Complex, Complex, list[Array]]:
    place, turn, _ = _relative(motion, link, base)
    pole = _pole(place, turn)
    with np.errstate(invalid="ignore"):
        return pole, place[2] + (1j * turn[2] - turn[1] ** 2) * (pole - place[0]), turn


def _circles(pole: Complex, across: Complex) -> Circles:
    return Circles(_points(pole + 0.5 * across), np.abs(across), _points(pole))


def inflection_circle(motion: Motion, link: int, base: int | None = None) -> Circles:
    """Return the inflection circle of a link: its points pass an inflection of their path, they run straight.

    Parameters
    ----------
    motion : Motion
    link, base : int
        The frame by default.

    Returns
    -------
    Circles
        Through the instant centre I; the other end of its diameter is the inflection pole ``I + a_I / theta'^2``, with
        the acceleration a_I of the point of the link that lies at I.

    Raises
    ------
    GeometryError
        Links that do not exist, or are the same.

    References
    ----------
    [Bottema & Roth 1979], chapter 8; [Hunt 1978].
    """
    pole, a, turn = _acceleration_at_pole(motion, link, base)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _circles(pole, a / turn[1] ** 2)


def bresse_circle(motion: Motion, link: int, base: int | None = None) -> Circles:
    """Return the second circle of Bresse of a link: its points have no tangential acceleration.

    Together with the inflection circle, the first circle of Bresse, it passes through the instant centre and the
    acceleration pole.  It depends on the angular acceleration, so on the input: it is that of a uniform input.

    Parameters
    ----------
    motion : Motion
    link, base : int
        The frame by default.

    Returns
    -------
    Circles
        Infinite where the angular acceleration is 0.

    Raises
    ------
    GeometryError
        Links that do not exist, or are the same.
    """
    pole, a, turn = _acceleration_at_pole(motion, link, base)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _circles(pole, 1j * a / turn[2])


def transmission_index(motion: Motion) -> dict[int, Array]:
    """Return the transmission index of every dyad with two modes, by group: the sine of its transmission angle.

    1 where force is handed on best, 0 in a dead-centre position.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    dict of int to ndarray, shape (n,)

    References
    ----------
    Sutherland & Roth, A transmission index for spatial mechanisms, J. Eng. Ind. 95 (1973) 589-597, for planar linkages.
    """
    return {group: np.sin(angle) for group, angle in motion.transmission_angle().items()}


def mechanical_advantage(motion: Motion, link: int) -> Array:
    """Return effort on a link of the frame over effort of the driver, without losses.

    Parameters
    ----------
    motion : Motion
        With one driver.
    link : int
        A link that turns about the frame, or slides on it.

    Returns
    -------
    ndarray, shape (n,)
        ``q' / s'``, rate of the driver over that of the link (virtual power); angles count in radians, so torque over
        torque, or force over torque in units of 1 / length.  Infinite where the link rests.

    Raises
    ------
    GeometryError
        Several drivers, or a link that is not jointed to the frame.

    References
    ----------
    [Norton 2004], chapter 6.
    """
    mechanism = motion.mechanism
    if len(mechanism.drivers) != 1:
        raise GeometryError(f"the mechanism has {len(mechanism.drivers)} drivers; mechanical advantage needs one")
    driver = mechanism.drivers[0]
    with np.errstate(divide="ignore"):
        return np.asarray(_rate(motion, driver.base, driver.link) / _rate(motion, mechanism.frame, link))


def _rate(motion: Motion, base: int, link: int) -> Array:
    """Rate of the coordinate of a joint."""
    joint = motion.mechanism.joint(base, link)
    place, turn, direction = _relative(motion, link, base)
    if not isinstance(joint, Prismatic):
        return turn[1]
    first = joint.a == base
    at = complex(*(joint.at_b if first else joint.at_a))
    along = np.exp(1j * (joint.angle_a if first else joint.angle_b))
    return np.asarray(((place[1] + 1j * turn[1] * direction * at) / along).real)
