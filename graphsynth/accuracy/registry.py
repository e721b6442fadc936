"""Which problems a scene has, by the family of its mechanism: strings, imported when they are measured.

A plan names a function ``"package.module:function"`` that is called as ``function(context, effort)`` and returns a
`graphsynth.accuracy.rows.Problem`.  ``context.scene`` is the scene as read.  What builds the model of a scene is named
by a string too (`build`), so this room knows the room of scenes by name only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from graphsynth.errors import SceneError

__all__ = ["GROUP", "PLANS", "Plan", "build", "load", "plans_of"]

_HERE = "graphsynth.accuracy.families"
#: Entry points of this group add problems for a family: ``family = "package.module:PLANS"``, a sequence of `Plan`.
GROUP = "graphsynth.accuracy"


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


def _plans(module: str, *names: str) -> tuple[Plan, ...]:
    return tuple(Plan(name, f"{_HERE}.{module}:{name.replace('-', '_')}") for name in names)


_ENUMERATION = Plan("enumeration", f"{_HERE}.structure:enumeration", structure=True)

#: Family of a scene (``[mechanism] module``) -> its problems.
PLANS: dict[str, tuple[Plan, ...]] = {
    "lambda_linkage": _plans(
        "lambda_linkage", "crossing", "areas", "arc-ends", "coupled-joints", "positions", "dimensions"
    ),
    "single_motor_platform": _plans("platform", "assembly-modes", "double-root", "turn", "drive"),
    "pointing": _plans("antenna", "poses"),
    "tribometer": _plans("tribometer", "events", "stick-slip"),
    "braider": _plans("braider", "start-up", "linkage-dynamics", "positions"),
    "platform_drive": _plans("platform_drive", "drive", "small-inductance"),
    "floating_piston": _plans("floating_piston", "positions", "loads", "work"),
    "planar": _plans("planar", "positions", "coupled-joints", "linkage-dynamics", "dimensions", "path-dimensions"),
    "four_bar_survey": _plans("survey", "many-sets", "arc-ends", "crossing", "dimensions"),
}


def plans_of(family: str, *, structure: bool = False) -> tuple[Plan, ...]:
    """Return the problems of a family, those that other packages announce included.

    Parameters
    ----------
    family : str
        As in ``[mechanism] module``.
    structure : bool
        Whether the scene has a structural question.

    Examples
    --------
    >>> [plan.name for plan in plans_of("tribometer")]
    ['events', 'stick-slip']
    """
    from importlib.metadata import entry_points

    found = list(PLANS.get(family, ()))
    for point in entry_points(group=GROUP, name=family):
        found += point.load()
    found += [_ENUMERATION] if structure else []
    return tuple(plan for plan in found if structure or not plan.structure)


def load(plan: Plan) -> Callable[..., Any]:
    """Import the function of a plan.

    Raises
    ------
    SceneError
        If the string does not name a function.
    """
    return _function(plan.function, f"problem {plan.name!r}")


def build(function: str, context: Any, *arguments: Any) -> Any:
    """Build a model of a scene by the function that its stages use, named by a string.

    Raises
    ------
    SceneError
        If the string does not name a function, or the scene holds numbers that make no model.
    """
    return _function(function, "a model")(context, *arguments)


def _function(text: str, who: str) -> Callable[..., Any]:
    module, _, name = text.partition(":")
    try:
        found = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise SceneError(f"{who} names {text!r}, which cannot be imported: {error}") from error
    return found  # type: ignore[no-any-return]
