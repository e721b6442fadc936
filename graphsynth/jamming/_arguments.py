"""Arguments of another kind are refused with a sentence, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from graphsynth.errors import GeometryError

__all__ = ["numbers", "takes"]

P = ParamSpec("P")
R = TypeVar("R")


def takes(**kinds: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Check that arguments are objects of the classes named, or of classes derived from them.

    Parameters
    ----------
    **kinds : str
        Name of the class of each argument; by name, so that no module is loaded for the check.

    Examples
    --------
    >>> @takes(box="ToleranceBox")
    ... def describe(box):
    ...     return "a box"
    >>> describe(None)
    Traceback (most recent call last):
        ...
    graphsynth.errors.GeometryError: box = None is no ToleranceBox; give a ToleranceBox to describe
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        places = {name: place for place, name in enumerate(signature(function).parameters) if name in kinds}

        @wraps(function)
        def checked(*args: P.args, **kwargs: P.kwargs) -> R:
            for name, place in places.items():
                if place < len(args) or name in kwargs:
                    value = args[place] if place < len(args) else kwargs[name]
                    if kinds[name] not in (base.__name__ for base in type(value).__mro__):
                        shown = repr(value)[:60]
                        raise GeometryError(
                            f"{name} = {shown} is no {kinds[name]}; give a {kinds[name]} to {function.__name__}"
                        )
            return function(*args, **kwargs)

        return checked

    return decorate


def numbers(name: str, values: Any) -> NDArray[np.float64]:
    """Return floats, NaN among them for what cannot be assembled; `GeometryError` for anything else."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise GeometryError(f"{name} = {values!r} holds something that is no number ({error}); give numbers") from error
