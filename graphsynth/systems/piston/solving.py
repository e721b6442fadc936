"""Contacts with Coulomb friction, in closed form: one unknown normal force, or two in a plane.

Forces are complex numbers.  A contact's force is ``N (normal - mu sgn(N) tangent)``: its direction depends on the
sign of N only, so every combination of signs gives a linear equation; those that confirm their own signs are solutions.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]


class Wedge(NamedTuple):
    """Directions of a contact's force for a positive and for a negative normal force; tangent and sliding speed."""

    positive: Complex
    negative: Complex
    mu: Array
    speed: Array

    def of(self, sign: int) -> Complex:
        """Direction for a sign of the normal force."""
        return self.positive if sign > 0 else self.negative


@dataclass(frozen=True, eq=False)
class Reaction:
    """Normal force (N), whole force on the body (N), power lost (W)."""

    normal: Array
    force: Complex
    loss: Array

    @classmethod
    def none(cls, zero: Array) -> Reaction:
        """Return a contact that is not there."""
        return cls(zero.copy(), zero + 0j, zero.copy())

    @classmethod
    def of(cls, normal: Array, contact: Wedge) -> Reaction:
        """Return a contact with its friction."""
        force = np.where(normal >= 0.0, contact.positive, contact.negative) * normal
        return cls(normal, np.asarray(force), np.asarray(contact.mu * np.abs(normal) * contact.speed))


def cross(a: Complex | complex, b: Complex | complex) -> Array:
    """Cross product in the plane."""
    return np.asarray((np.conj(a) * b).imag)


def wedge(tangent: complex, mu: Array, speed: Array) -> Wedge:
    """Return a contact whose body slides along ``tangent`` with ``speed`` (m/s); ``mu`` has the sign of the speed."""
    normal = 1j * tangent
    return Wedge(normal - mu * tangent, normal + mu * tangent, mu, speed)


def one_contact(moment: Array, lever: Complex, contact: Wedge) -> Reaction:
    """Solve ``lever x force = moment`` for the contact's normal force; NaN if there is no or no single solution."""
    with np.errstate(divide="ignore", invalid="ignore"):  # a contact that cannot carry the moment: no candidate
        candidates = [moment / cross(lever, contact.of(sign)) for sign in (1, -1)]
    normal = _single([(np.asarray(sign * value >= 0.0), value) for sign, value in zip((1, -1), candidates)])
    return Reaction.of(normal, contact)


def two_contacts(wanted: Complex, first: Wedge, second: Wedge) -> tuple[Reaction, Reaction]:
    """Solve ``force of first + force of second = wanted``; NaN if there is no or no single solution."""
    ones, others = [], []
    for s, t in product((1, -1), repeat=2):
        d, e = first.of(s), second.of(t)
        area = cross(d, e)
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel contacts: no candidate
            one, other = cross(wanted, e) / area, cross(d, wanted) / area
        good = np.asarray((s * one >= 0.0) & (t * other >= 0.0))
        ones.append((good, one))
        others.append((good, other))
    size = np.abs(wanted)
    return Reaction.of(_single(ones, size), first), Reaction.of(_single(others, size), second)


def _single(candidates: list[tuple[NDArray[np.bool_], Array]], size: Array | float = 0.0) -> Array:
    """Take the value of all candidates that hold, if they agree (they do where a force is 0); NaN otherwise.

    ``size`` is the load they share: rounding is relative to it.
    """
    values = np.array([np.where(good, value, np.nan) for good, value in candidates])
    holds = np.isfinite(values)
    low = np.where(holds, values, np.inf).min(axis=0)
    high = np.where(holds, values, -np.inf).max(axis=0)
    with np.errstate(invalid="ignore"):  # inf - inf where nothing holds
        agree = holds.any(axis=0) & (high - low <= 1e-12 * np.maximum(size, np.maximum(np.abs(low), np.abs(high))))
    return np.asarray(np.where(agree, np.where(np.abs(high) >= np.abs(low), high, low), np.nan))
