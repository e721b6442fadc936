"""Public names of a package, resolved on first use: importing the package loads nothing (PEP 562)."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any

__all__ = ["resolve"]


def resolve(package: str, public: Mapping[str, str], name: str) -> Any:
    """Return a public name and keep it in the package, so that it is looked up once.

    Parameters
    ----------
    package : str
        ``__name__`` of the package.
    public : mapping of str to str
        Public name to the module that defines it, within the package.
    name : str
        The name asked for.

    Raises
    ------
    AttributeError
        A name that is not public.
    """
    module = public.get(name)
    if module is None:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    value = getattr(import_module(f"{package}.{module}"), name)
    vars(sys.modules[package])[name] = value
    return value
