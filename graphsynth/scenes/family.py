"""Families of mechanisms: what a scene may say about one, and the stages that work on it.

``[mechanism] module = "name"`` chooses the family.  Names are looked up among the ones below and then among the
installed entry points of the group ``graphsynth.families``; a family is imported when a scene names it, no sooner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from graphsynth.scenes.stages import Stage
from graphsynth.scenes.tables import Place, suggest

__all__ = ["FAMILIES", "GROUP", "Family", "family", "family_names"]

_ROOM = "graphsynth.scenes.families"

#: Name of a family in a scene file -> the module that holds it as ``FAMILY``.
FAMILIES: dict[str, str] = {
    "lambda_linkage": f"{_ROOM}.lambda_linkage",
    "single_motor_platform": f"{_ROOM}.single_motor_platform",
    "pointing": f"{_ROOM}.antenna",
    "tribometer": f"{_ROOM}.tribometer",
    "braider": f"{_ROOM}.braider",
    "platform_drive": f"{_ROOM}.platform_drive",
    "floating_piston": f"{_ROOM}.floating_piston",
    "planar": f"{_ROOM}.planar",
    "four_bar_survey": f"{_ROOM}.survey",
}

#: Entry points of this group name further families: ``name = "package.module"`` or ``"package.module:FAMILY"``.
GROUP = "graphsynth.families"


@dataclass(frozen=True, slots=True)
class Family:
    """A kind of mechanism that scenes can be about.

    Attributes
    ----------
    table : type
        Frozen dataclass: the schema of ``[mechanism]``.  Its first field is ``module: Literal["name"]``.
    stages : tuple of Stage
        What can be computed, besides the stages of ``[structure]``.
    structure : {"required", "optional", "none"}
        Whether a scene must, may or must not have a table ``[structure]``.
    more : callable, optional
        Further stages for a scene as read: those of parts that only some scenes have.
    """

    table: type
    stages: tuple[Stage, ...]
    structure: Literal["required", "optional", "none"] = "optional"
    more: Callable[[Any], tuple[Stage, ...]] | None = None

    def stages_for(self, scene: object) -> tuple[Stage, ...]:
        """Return all stages that a scene of this family can use."""
        return (*self.stages, *(self.more(scene) if self.more else ()))


def family_names() -> tuple[str, ...]:
    """Return the names of all families, the installed ones of other packages included.

    Examples
    --------
    >>> "lambda_linkage" in family_names()
    True
    """
    return (*FAMILIES, *_installed())


def _installed() -> dict[str, str]:
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=GROUP)}


def family(name: str, place: Place | None = None) -> Family:
    """Import the family of this name.

    Parameters
    ----------
    name : str
        As in ``[mechanism] module``.
    place : Place, optional
        Where it was named, for the message.

    Raises
    ------
    SceneError
        For a name nobody knows, and for a module that is missing or is no family.

    Examples
    --------
    >>> family("lambda_linkage").structure
    'required'
    """
    at = place or Place("scene")
    value = FAMILIES.get(name) or _installed().get(name)
    if value is None:
        raise at.error(
            f"has module = {name!r}, which is no family of mechanisms{suggest(name, family_names())}", "module"
        )
    module, _, attribute = value.partition(":")
    try:
        found = getattr(import_module(module), attribute or "FAMILY")
    except (ImportError, AttributeError) as error:
        missing = isinstance(error, ModuleNotFoundError) and error.name == module
        why = "this installation does not have it" if missing else f"it cannot be imported: {error}"
        raise at.error(f"has module = {name!r}, but {why} (looked for {value})", "module") from error
    if not isinstance(found, Family):
        raise at.error(f"has module = {name!r}, but {value} is no Family but {type(found).__name__}", "module")
    return found
