"""Binary digits of python-flint's balls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import flint

__all__ = ["precision"]


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Work with balls of ``bits`` binary digits inside the block, whatever the caller has set."""
    before = flint.ctx.prec
    flint.ctx.prec = bits
    try:
        yield
    finally:
        flint.ctx.prec = before
