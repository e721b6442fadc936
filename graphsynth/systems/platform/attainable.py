"""What crank lengths alone can do when the phases are given: the attainable directions, and the best lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array, plane_point, positive, three
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.inverse_design import Design, _wanted, assess_design
from graphsynth.systems.platform.small_crank import small_crank

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Attainable:
    """How well real signed crank lengths approach a straight motion, to first order in the cranks.

    * `off_direction`: smallest share of the energy ``|Xi|^2`` (with ``Lc``) off the wanted direction: 0 if it is
      attainable.
    * `lengths` (shape (3,)): signed crank lengths of the best motion, scaled to a largest length of 1; a negative sign
      means keying by 180 degrees.
    * `phasor` (shape (3,), complex): first harmonic of these lengths.
    * `ellipticity`: ratio of its semi-axes in pose space: 0 for a straight motion.
    """

    off_direction: float
    lengths: Array
    phasor: Complex
    ellipticity: float
    Lc: float


@checked
def ellipticity(phasor: ArrayLike, Lc: float) -> float:
    """Ratio of the semi-axes of the ellipse ``Re(Xi exp(i psi))`` in pose space: 0 straight, 1 circular.

    >>> ellipticity([1.0, 1j, 0.0], 45.0), ellipticity([1.0, 2.0, 0.0], 45.0)
    (1.0, 0.0)
    """
    first, second, third = (
        plane_point(f"phasor of {n}", v) for n, v in zip(("x", "y", "alpha"), three("phasor", phasor))
    )
    scaled = np.array([first, second, third]) * np.array([1.0, 1.0, positive("Lc", Lc)])
    axes = np.linalg.svd(np.column_stack([scaled.real, scaled.imag]), compute_uv=False)
    return float(axes[1] / axes[0]) if axes[0] > 0.0 else 0.0


def _gains(mechanism: SingleMotorPlatform) -> Complex:
    return np.asarray(small_crank(mechanism).gains * np.array([1.0, 1.0, mechanism.Lc])[:, None])


@checked
def attainable(mechanism: SingleMotorPlatform, direction: ArrayLike) -> Attainable:
    """Best straight motion along a direction in pose space with the phases of the mechanism, lengths free.

    `mechanism`: its phases are kept, its crank lengths ignored. `direction` (shape (3,)): real direction ``(x, y,
    alpha)``: lengths, lengths, radians. Floating point, first order in the cranks. Raises `GeometryError`: a direction
    without three numbers, or of zeros. See theory/inverse-design 4: ``1 - mu`` with mu the largest eigenvalue of the
    pencil ``(Re(g g^H), Re(G^H G))``, ``g = G^H t``.

    With equal global phases no translation is straight; with phases equal in each leg's own frame every motion is.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> round(attainable(SingleMotorPlatform(), [1.0, 0.0, 0.0]).off_direction, 12)
    0.175858187957
    >>> legs = SingleMotorPlatform(phase=SingleMotorPlatform().frame_angle)
    >>> attainable(legs, [1.0, 0.0, 0.0]).off_direction < 1e-14
    True
    """
    scale = np.array([1.0, 1.0, mechanism.Lc])
    t = finite_array("direction", direction).reshape(-1)
    if t.shape != (3,) or not t.any():
        raise GeometryError(f"direction = {t.tolist()} must hold three numbers, not all zero: x, y, alpha")
    t = t * scale / np.linalg.norm(t * scale)
    G = _gains(mechanism)
    stacked = np.concatenate([G.real, G.imag])  # |Xi|^2 = |stacked l|^2
    _, values, right = np.linalg.svd(stacked, full_matrices=False)
    keep = values > 1e-12 * values[0]
    basis = right[keep].T / values[keep]  # lengths of motions with unit energy
    along = np.stack([t @ G.real, t @ G.imag]) @ basis
    best = np.linalg.svd(along)[2]
    # 1 - mu without cancellation: the energy across t of the best motion
    lengths = basis @ best[0]
    phasor = G @ lengths
    across = phasor - t * (t @ phasor)
    lengths = lengths / np.abs(lengths).max() * np.sign(lengths[int(np.argmax(np.abs(lengths)))])
    found = G @ lengths / scale
    return Attainable(
        float(np.linalg.norm(across)) ** 2, lengths, found, ellipticity(found, mechanism.Lc), mechanism.Lc
    )


@checked
def lengths_only_design(
    mechanism: SingleMotorPlatform, wanted: ArrayLike, *, free_phase: bool = True, samples: int = 96
) -> Design:
    """Least-squares crank lengths for a wanted first harmonic with the given phases, verified over the whole turn.

    `mechanism`: its phases are kept (modulo 180 degrees: a negative length is keyed the other way round). `wanted`:
    shape (3,), complex. `free_phase`: the motion may begin at any wheel angle: ``wanted`` is multiplied by the best
    ``exp(i chi)``, and ``Design.wanted`` is that product. ``error`` tells how far the result is from what was asked;
    `attainable` tells why.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> legs = SingleMotorPlatform(phase=SingleMotorPlatform().frame_angle)
    >>> lengths_only_design(legs, [2.0, 1.0, 0.0]).error < 1e-3
    True
    """
    target = _wanted(wanted)
    theory = small_crank(mechanism)
    scale = np.array([1.0, 1.0, mechanism.Lc])
    G = _gains(mechanism)
    stacked = np.concatenate([G.real, G.imag])
    if free_phase:
        target = target * _best_phase(stacked, target * scale)
    right = target * scale
    lengths = np.linalg.lstsq(stacked, np.concatenate([right.real, right.imag]), rcond=1e-12)[0]
    phase = np.array(mechanism.phase) + np.where(lengths < 0.0, np.pi, 0.0)
    size = np.abs(lengths)
    designed = replace(
        mechanism,
        crank=(float(size[0]), float(size[1]), float(size[2])),
        phase=(float(phase[0]), float(phase[1]), float(phase[2])),
    )
    return assess_design(designed, target, theory.home, samples=samples)


def _best_phase(stacked: Array, wanted: Complex) -> complex:
    """Return the unit factor of ``wanted`` whose product is nearest to the span of the columns."""
    left, values, _ = np.linalg.svd(stacked, full_matrices=False)
    basis = left[:, values > 1e-12 * values[0]]
    pair = np.column_stack([np.concatenate([w.real, w.imag]) for w in (wanted, 1j * wanted)])
    cosine, sine = np.linalg.svd(basis.T @ pair)[2][0]
    if cosine < 0.0:
        cosine, sine = -cosine, -sine
    return complex(cosine, sine)
