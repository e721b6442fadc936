"""Text that comes from elsewhere, fit to be shown."""

from __future__ import annotations

__all__ = ["plain"]


def plain(text: str) -> str:
    r"""Return a text without characters that are not seen or that steer a terminal; they stand as escapes.

    Examples
    --------
    >>> print(plain("red \x1b[31m"))
    red \x1b[31m
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
