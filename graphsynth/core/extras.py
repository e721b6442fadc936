"""Optional packages: imported when a call needs one, or one sentence that says how to get it."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from graphsynth.core.errors import MissingExtraError


def need(module: str, extra: str, purpose: str) -> Any:
    """Import an optional package, or a module of it, that an extra of graphsynth in ``pyproject.toml`` installs.

    ``purpose`` is what needs it, as the subject of a sentence in the singular.

    >>> need("no_such_package", "dxf", "DXF")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    graphsynth.core.errors.MissingExtraError: DXF needs no_such_package, which is not installed; ...
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise MissingExtraError(
            f"{purpose} needs {package}, which is not installed; pip install 'graphsynth[{extra}]'"
        ) from error
