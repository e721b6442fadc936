"""Every exception graphsynth raises on purpose.

::

    GraphsynthError                  base of all; the command line turns it into one sentence and exit status 2
    ├── SpecError (ValueError)       a question that makes no sense: unknown variable, value out of its bounds
    │   └── InfeasibleSpecError      a question without any answer; names the equations that clash
    ├── FormatError (ValueError)     unreadable input; carries ``place`` (line, column, byte or key)
    ├── GraphError (ValueError)      a graph that is not what the operation needs (no frame, disconnected, ...)
    ├── MissingExtraError (ImportError)  an optional package that is not installed; names the command that installs it
    ├── TooLargeError                an enumeration that cannot finish; carries an estimate and the remedy
    ├── SceneError (ValueError)      a scene file with an unknown key, a wrong unit or a missing section
    ├── IntervalError (ValueError)   bounds, boxes or functions that interval arithmetic cannot take
    ├── GeometryError (ValueError)   dimensions that no mechanism can have (negative length, zero axis, ...)
    └── UnitWarning (UserWarning)    a warning: numbers that look like degrees where radians are meant

A message names the value, the bound and the remedy.  Outcomes of a computation (a pose that cannot be
assembled, a bearing that jams) are values, not exceptions.
"""

from __future__ import annotations

__all__ = [
    "FormatError",
    "GeometryError",
    "GraphError",
    "GraphsynthError",
    "InfeasibleSpecError",
    "IntervalError",
    "MissingExtraError",
    "SceneError",
    "SpecError",
    "TooLargeError",
    "UnitWarning",
]


class GraphsynthError(Exception):
    """Base class of every exception that graphsynth raises on purpose."""


class SpecError(GraphsynthError, ValueError):
    """A structural question that makes no sense as stated."""


class InfeasibleSpecError(SpecError):
    """A structural question without any answer.

    Parameters
    ----------
    message : str
        The sentence shown to the user.
    clashes : tuple of str, optional
        The equations and fixed values that contradict each other, one per entry.
    """

    def __init__(self, message: str, clashes: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.clashes = clashes


class FormatError(GraphsynthError, ValueError):
    """Input that cannot be read.

    Parameters
    ----------
    message : str
        What was found and what was expected.
    place : str, optional
        Where: a line, column, byte offset or key.
    """

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(f"{place}: {message}" if place else message)
        self.place = place


class GraphError(GraphsynthError, ValueError):
    """A graph that is not what the operation needs."""


class TooLargeError(GraphsynthError):
    """An enumeration that cannot finish in reasonable time.

    Parameters
    ----------
    message : str
        The sentence shown to the user: the estimate and the remedy.
    estimate : float, optional
        Estimated number of results.
    """

    def __init__(self, message: str, estimate: float = float("nan")) -> None:
        super().__init__(message)
        self.estimate = estimate


class MissingExtraError(GraphsynthError, ImportError):
    """A part of the work needs an optional package that is not installed; the sentence says how to install it."""


class SceneError(GraphsynthError, ValueError):
    """A scene file that asks for something unknown or leaves out something needed."""


class IntervalError(GraphsynthError, ValueError):
    """Bounds, boxes, matrices or functions that interval arithmetic cannot take (reversed bounds, NaN, ...)."""


class GeometryError(GraphsynthError, ValueError):
    """Dimensions that no mechanism can have."""


class UnitWarning(GraphsynthError, UserWarning):  # noqa: N818  # a warning that can be made an error
    """Numbers that look as if they were in another unit than the one meant; they are taken as they are."""
