"""Systems: what a scene may say about a kind of mechanism, the stages that work on it, and what is measured of it.

``[mechanism] module = "name"`` chooses the system among the installed entry points of the group
``graphsynth.systems``, those of graphsynth itself and of other packages alike; it is imported when a scene names it.

A stage is data: a name, a function as ``"package.module:function"``, the products it needs and the products it
gives.  Nothing here imports the function; the runner does, when the scene needs it.  Products travel one way, from
the stage that gives them to the stages that need them, and each product has one giver.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from graphsynth.evidence.rows import Plan, imported
from graphsynth.pipeline.tables import Place, suggest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints


@dataclass(frozen=True, slots=True)
class Stage:
    """One arrow of the pipeline.

    A stage for `each` candidate gets, of what the stream or another such stage gives, the candidate's own value, and of
    everything else the whole product.  Candidates go through all such stages one after the other, in parallel if there
    is an executor; one that raises is recorded and stops nobody else
    (:class:`~graphsynth.pipeline.products.Rejected`: it does not meet a goal; anything else: it failed).
    """

    name: str  # short, for tables and messages
    function: str  # ``"package.module:function"``; called as ``function(context, *needs)`` in the order of `needs`
    needs: tuple[str, ...] = ()  # names of products
    gives: tuple[str, ...] = ()  # names of products; with several, the function returns a tuple in this order
    stream: bool = False  # it gives one product, an iterable of candidates, and may make them one by one
    each: bool = False  # it works on one candidate at a time
    cost: float = 1.0  # of stages for each candidate that could come next, the cheapest comes first
    #: nothing but outputs comes of it, of products that can be sent to another process: with an executor it may run
    #: there while later stages run here
    aside: bool = False

    def load(self) -> Callable[..., Any]:
        """Import the function; a `SceneError` if there is none."""
        return imported(self.function, f"stage {self.name!r}")


_HERE = "graphsynth.pipeline"
#: Stages of ``[structure]``, which every system shares; "sketch graphs" asks the system for ``recognised``.
STRUCTURE = (
    Stage("solve", f"{_HERE}.steps:solve", (), ("solutions",)),
    Stage("generate", f"{_HERE}.steps:generate", ("solutions",), ("candidates",), stream=True),
    Stage("sketch graphs", f"{_HERE}.steps:pictures", ("candidates", "recognised"), ("graph_pictures",)),
)
#: Collects what stages for each candidate gave as ``record`` into ``records``: one per candidate, with reasons.
COLLECT = Stage("collect", f"{_HERE}.steps:records", ("record",), ("records",))
#: Ranks the records by the objectives of ``[ranking]``.
RANK = Stage("rank", f"{_HERE}.steps:rank", ("records",), ("ranking",))
#: Measured of every scene with a structural question.
ENUMERATION = Plan("enumeration", "graphsynth.evidence.enumeration:of_scene", structure=True)


@dataclass(frozen=True, slots=True)
class System:
    """A kind of mechanism that scenes can be about."""

    table: type  # the schema of ``[mechanism]``, a frozen dataclass; its first field is ``module: Literal["name"]``
    stages: tuple[Stage, ...]  # what can be computed besides ``[structure]``: tables, charts and pictures among it
    structure: Literal["required", "optional", "none"] = "optional"  # whether a scene has a table ``[structure]``
    more: Callable[[Any], tuple[Stage, ...]] | None = None  # stages of parts that only some scenes have, by scene
    #: ``"package.module:function"`` that makes the mechanism of a scene, for `graphsynth.pipeline.stages.build` and its
    #: own stages, called with their `Context`; empty only if a scene has many
    build: str = ""
    evidence: tuple[Plan, ...] = ()  # problems on which error against run time is measured
    cases: tuple[str, ...] = ()  # its stress cases, by name or section, as ``graphsynth stress`` takes them


def announced(kind: str) -> EntryPoints:
    """Return the entry points of a group, of graphsynth and of other packages: what a name stands for.

    Of ``systems``: ``name = "package.module"`` or ``"package.module:SYSTEM"``; of ``stages``: ``product =
    "package.module:STAGE"``; of ``evidence``: ``system = "package.module:PLANS"``, a sequence of further `Plan`.
    """
    folders = [Path(folder) for folder in sys.path]
    return _announced(kind, tuple((at, at.stat().st_mtime_ns if at.exists() else 0) for at in folders))


@cache
def _announced(kind: str, folders: tuple[tuple[Path, int], ...]) -> EntryPoints:
    """Read what all packages announce, again when a folder of packages has changed."""
    from importlib.metadata import entry_points

    return entry_points(group=f"graphsynth.{kind}")


def system_names() -> tuple[str, ...]:
    """Return the names of all installed systems.

    >>> "planar" in system_names()
    True
    """
    return tuple(sorted(announced("systems").names))


def system(name: str, place: Place | None = None) -> System:
    """Import the system of this name, as in ``[mechanism] module``.

    A `SceneError` with the place where it was named says that the name is unknown, or the module missing or no system.

    >>> system("planar").structure
    'optional'
    """
    at = place or Place("scene")
    values = {point.name: point.value for point in announced("systems")}
    if name not in values:
        raise at.error(f"has module = {name!r}, which is no system of mechanisms{suggest(name, values)}", "module")
    module, _, attribute = (value := values[name]).partition(":")
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
    """Return the problems of a system, those that other packages announce included; more with a structural question."""
    others = (plan for point in announced("evidence").select(name=name) for plan in point.load())
    return tuple(plan for plan in (*system(name).evidence, *others, ENUMERATION) if structure or not plan.structure)
