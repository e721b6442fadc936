"""What a command says on standard error."""

from __future__ import annotations

NOTICES = ("compiling kernels (first use only", "kernels are compiled in memory")


def said(stderr: str) -> list[str]:
    """Lines of standard error but the notices about kernels, which depend on the state of their cache."""
    return [line for line in stderr.splitlines() if not line.startswith(NOTICES)]
