"""Values that come from elsewhere: shown in a message, read as whole numbers, and the word that was meant."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from typing import Any

from graphsynth.core.errors import SpecError


def plain(text: str) -> str:
    r"""Return a text without characters that are not seen or that steer a terminal; they stand as escapes.

    >>> print(plain("red \x1b[31m"))
    red \x1b[31m
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def nearest(word: str, words: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest of ``words``, or nothing.

    A word with a unit too many is nearest.

    >>> nearest("inputs_deg", ["inputs", "outputs_deg"])
    "; did you mean 'inputs'?"
    """
    import difflib

    word, words = word[:60], list(words)
    close = [own for own in words if word.startswith(f"{own}_")]
    close = close or difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    return f"; did you mean {close[0]!r}?" if close else ""


def shown(value: Any) -> str:
    """Write a value for a message, shortly."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"a number of {value.bit_length()} bits"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # whatever a foreign __repr__ raises; of an integer of thousands of digits inside, ValueError
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


def whole(value: Any, name: str, least: int, most: int | None = None) -> int:
    """Return a whole number of any integer type as an int.

    `SpecError` for anything else, a truth value too, and for a number out of its bounds.

    >>> import numpy as np
    >>> whole(np.uint8(4), "links", 2, 255)
    4
    """
    number = None if isinstance(value, bool) else index_of(value)
    if number is None or number < least or (most is not None and number > most):
        bounds = f", at least {least}" if most is None else f" from {least} to {most}"
        raise SpecError(f"{name} = {shown(value)} must be a whole number{bounds}")
    return number


def index_of(value: Any) -> int | None:
    """Return a value of any integer type as an int; None for anything else."""
    try:
        return operator.index(value)
    except Exception:  # whatever a foreign __index__ raises
        return None
