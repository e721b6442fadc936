"""Access to python-flint, which the extra ``certified`` installs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from graphsynth.errors import GraphsynthError

__all__ = ["need_flint", "precision"]


def need_flint() -> Any:
    """Return the module ``flint``.

    Raises
    ------
    GraphsynthError
        If python-flint is not installed; the sentence names the extra.
    """
    try:
        return import_module("flint")
    except ImportError as error:
        raise GraphsynthError(
            "certificates need python-flint, which is not installed; pip install 'graphsynth[certified]'"
        ) from error


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Work with balls of ``bits`` binary digits inside the block, whatever the caller has set."""
    ctx = need_flint().ctx
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before
