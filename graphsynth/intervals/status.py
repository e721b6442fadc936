"""`Status`: what a test has proved about a box."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """What is proved about a box X, for all parameter values at once (theory/interval-tests 1).

    With K the Krawczyk image of X:

    ========= ===================================================== =========================================
    member    meaning                                               proof
    ========= ===================================================== =========================================
    EMPTY     no solution in X                                      0 not in F(X), or X and K disjoint
    UNIQUE    exactly one solution in X for every parameter value   K in the interior of X
    EXISTS    at least one solution in X for every parameter value  K in X, preconditioner proved nonsingular
    UNDECIDED nothing proved                                        otherwise; an overlap proves nothing
    ========= ===================================================== =========================================

    Examples
    --------
    >>> Status.UNIQUE.proves_existence, Status.UNDECIDED.proves_existence
    (True, False)
    """

    EMPTY = 0
    UNIQUE = 1
    EXISTS = 2
    UNDECIDED = 3

    @property
    def proves_existence(self) -> bool:
        """Whether a solution is certain."""
        return self in (Status.UNIQUE, Status.EXISTS)
