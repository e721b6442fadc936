"""A problem that can be measured for a scene: a string, imported when it is measured.

A plan names a function ``"package.module:function"`` that is called as ``function(context, effort)`` and returns a
`graphsynth.evidence.rows.Problem`.  ``context.scene`` is the scene as read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from graphsynth.core.errors import SceneError


@dataclass(frozen=True)
class Plan:
    """A problem that can be measured.

    Attributes
    ----------
    name : str
        Short; that of the problem.
    function : str
        ``"package.module:function"``.
    structure : bool
        Only for scenes with a table ``[structure]``.
    """

    name: str
    function: str
    structure: bool = False


def plans(module: str, *names: str) -> tuple[Plan, ...]:
    """Return plans whose functions are in one module, each under its own name with ``_`` for ``-``."""
    return tuple(Plan(name, f"{module}:{name.replace('-', '_')}") for name in names)


def load(plan: Plan) -> Callable[..., Any]:
    """Import the function of a plan.

    Raises
    ------
    SceneError
        If the string does not name a function.
    """
    return _function(plan.function, f"problem {plan.name!r}")


def _function(text: str, who: str) -> Callable[..., Any]:
    module, _, name = text.partition(":")
    try:
        found = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise SceneError(f"{who} names {text!r}, which cannot be imported: {error}") from error
    return found  # type: ignore[no-any-return]
