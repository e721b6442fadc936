"""Systems: what a scene may say about a kind of mechanism, the stages that work on it, and what is measured of it.

``[mechanism] module = "name"`` chooses the system among the installed entry points of the group
``graphsynth.systems``, those of graphsynth itself and of other packages alike; it is imported when a scene names it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from graphsynth.evidence.registry import Plan
from graphsynth.pipeline.stages import Stage
from graphsynth.pipeline.tables import Place, suggest

#: Measured of every scene with a structural question.
ENUMERATION = Plan("enumeration", "graphsynth.evidence.enumeration:of_scene", structure=True)

#: Entry points of this group name systems: ``name = "package.module"`` or ``"package.module:SYSTEM"``.
GROUP = "graphsynth.systems"
#: Entry points of this group add problems to a system: ``system = "package.module:PLANS"``, a sequence of `Plan`.
EVIDENCE = "graphsynth.evidence"


@dataclass(frozen=True, slots=True)
class System:
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
    evidence : tuple of Plan
        Problems on which error against run time is measured.
    """

    table: type
    stages: tuple[Stage, ...]
    structure: Literal["required", "optional", "none"] = "optional"
    more: Callable[[Any], tuple[Stage, ...]] | None = None
    evidence: tuple[Plan, ...] = ()

    def stages_for(self, scene: object) -> tuple[Stage, ...]:
        """Return all stages that a scene of this system can use."""
        return (*self.stages, *(self.more(scene) if self.more else ()))


def system_names() -> tuple[str, ...]:
    """Return the names of all installed systems.

    Examples
    --------
    >>> "planar" in system_names()
    True
    """
    return tuple(sorted(_installed()))


def _installed() -> dict[str, str]:
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=GROUP)}


def system(name: str, place: Place | None = None) -> System:
    """Import the system of this name.

    Parameters
    ----------
    name : str
        As in ``[mechanism] module``.
    place : Place, optional
        Where it was named, for the message.

    Raises
    ------
    SceneError
        For an unknown name, and for a module that is missing or is no system.

    Examples
    --------
    >>> system("planar").structure
    'optional'
    """
    at = place or Place("scene")
    value = _installed().get(name)
    if value is None:
        raise at.error(
            f"has module = {name!r}, which is no system of mechanisms{suggest(name, system_names())}", "module"
        )
    module, _, attribute = value.partition(":")
    try:
        found = getattr(import_module(module), attribute or "SYSTEM")
    except (ImportError, AttributeError) as error:
        missing = isinstance(error, ModuleNotFoundError) and error.name == module
        why = "this installation does not have it" if missing else f"it cannot be imported: {error}"
        raise at.error(f"has module = {name!r}, but {why} (looked for {value})", "module") from error
    if not isinstance(found, System):
        raise at.error(f"has module = {name!r}, but {value} is no System but {type(found).__name__}", "module")
    return found


def plans_of(name: str, *, structure: bool = False) -> tuple[Plan, ...]:
    """Return the problems of a system, those that other packages announce included.

    Parameters
    ----------
    name : str
        As in ``[mechanism] module``.
    structure : bool
        Whether the scene has a structural question.
    """
    from importlib.metadata import entry_points

    found = list(system(name).evidence)
    for point in entry_points(group=EVIDENCE, name=name):
        found += point.load()
    found += [ENUMERATION] if structure else []
    return tuple(plan for plan in found if structure or not plan.structure)
