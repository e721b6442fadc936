"""Batches of single RRR dyads: the joint C from the points A and B."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError

__all__ = ["solve_rrr"]

Array = NDArray[np.float64]


def solve_rrr(A: ArrayLike, B: ArrayLike, l1: ArrayLike, l2: ArrayLike, sign: int = 1) -> tuple[Array, Array]:
    """Joint C of RRR dyads with ``|AC| = l1`` and ``|BC| = l2``; closed form, compiled.

    Parameters
    ----------
    A, B : array_like, shape (n, 2)
        Outer joints.
    l1, l2 : array_like, shape () or (n,)
        Lengths, positive.
    sign : {+1, -1}
        +1 puts C left of the way from A to B.

    Returns
    -------
    C : ndarray, shape (n, 2)
        NaN where the circles do not meet.
    margin : ndarray, shape (n,)
        Square of the sine of the transmission angle; negative where the circles do not meet.

    Raises
    ------
    GeometryError
        A sign that is not +1 or -1, a length that is not positive, shapes that do not fit.

    Examples
    --------
    >>> C, margin = solve_rrr([[0.0, 0.0]], [[5.0, 0.0]], 3.0, 4.0)
    >>> C.round(12).tolist(), margin.round(12).tolist()
    ([[1.8, 2.4]], [1.0])
    """
    from graphsynth.kinematics.engine import kernels

    if sign not in (1, -1):
        raise GeometryError(f"sign = {sign!r} must be +1 or -1")
    first, second = (np.ascontiguousarray(finite_array(name, points)) for name, points in (("A", A), ("B", B)))
    if first.ndim != 2 or first.shape[1] != 2 or first.shape != second.shape:
        raise GeometryError(f"A and B have shapes {first.shape} and {second.shape}; give (n, 2) twice")
    lengths = []
    for name, given in (("l1", l1), ("l2", l2)):
        values = finite_array(name, given)
        if values.shape not in ((), (1,), (len(first),)) or not (values > 0.0).all():
            raise GeometryError(f"{name} must be one positive length or one for each of the {len(first)} dyads")
        lengths.append(np.ascontiguousarray(np.atleast_1d(values)))
    C, margin = np.empty_like(first), np.empty(len(first))
    kernels.rrr(first, second, lengths[0], lengths[1], float(sign), C, margin)
    return C, margin
