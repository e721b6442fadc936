"""Stages: what a scene can compute, each named by a string, and the smallest set that yields the outputs asked for.

A stage is data: a name, a function as ``"package.module:function"``, the products it needs and the products it
gives. Nothing here imports the function; the runner does, when the scene needs it. Products travel one way, from
the stage that gives them to the stages that need them, and each product has one giver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.tables import Place, shortened, suggest

if TYPE_CHECKING:
    from graphsynth.pipeline.scene import Scene

_HERE = "graphsynth.pipeline"


@dataclass(frozen=True, slots=True)
class Stage:
    """One arrow of the pipeline.

    Attributes
    ----------
    name : str
        Short name for tables and messages.
    function : str
        ``"package.module:function"``; called as ``function(context, *needs)`` in the order of `needs`.
    needs, gives : tuple of str
        Names of products. A stage that gives several returns a tuple in the order of `gives`.
    stream : bool
        It gives one product, an iterable of candidates, and may make them one by one.
    each : bool
        It works on one candidate at a time: of what the stream or another such stage gives it gets the candidate's
        own value, of everything else the whole product.  Candidates go through all such stages one after the other,
        in parallel if there is an executor; one that raises is recorded and stops nobody else
        (:class:`~graphsynth.pipeline.products.Rejected`: it does not meet a goal; anything else: it failed).
    cost : float
        Of stages for each candidate that could come next, the cheapest comes first.
    aside : bool
        Nothing but outputs comes of it, of products that can be sent to another process: with an executor it may run
        there while later stages run here.
    """

    name: str
    function: str
    needs: tuple[str, ...] = ()
    gives: tuple[str, ...] = ()
    stream: bool = False
    each: bool = False
    cost: float = 1.0
    aside: bool = False


class Progress(Protocol):
    """Told before each stage (``done`` of ``total`` finished), after candidates, and once more at the end."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Show the progress; must not raise."""


@dataclass(frozen=True, slots=True)
class Context:
    """What every stage may read besides the products it needs."""

    scene: Scene
    executor: Executor | None = None


class StageFunction(Protocol):
    """The extension point: any function of a context and products."""

    def __call__(self, context: Context, *products: Any) -> Any:
        """Return the product, or a tuple of the products in the order of ``gives``."""


#: Stages of ``[structure]``, which every system shares; "sketch graphs" asks the system for ``recognised``.
STRUCTURE = (
    Stage("solve", f"{_HERE}.steps:solve", (), ("solutions",)),
    Stage("generate", f"{_HERE}.steps:generate", ("solutions",), ("candidates",), stream=True),
    Stage("sketch graphs", f"{_HERE}.steps:pictures", ("candidates", "recognised"), ("graph_pictures",)),
)


#: Collects what stages for each candidate gave as ``record`` into ``records``: one per candidate, with reasons.
COLLECT = Stage("collect", f"{_HERE}.steps:records", ("record",), ("records",))

#: Ranks the records by the objectives of ``[ranking]``.
RANK = Stage("rank", f"{_HERE}.rank:rank", ("records",), ("ranking",))

#: Entry points of this group are stages of other packages: ``product = "package.module:STAGE"``, one for each product.
GROUP = "graphsynth.stages"


def installed_stage(product: str) -> Stage | None:
    """Return the stage of another package that gives this product, or None if no package announces one.

    Raises
    ------
    SceneError
        If it cannot be imported, is no stage or does not give the product.
    """
    from importlib.metadata import entry_points

    for point in entry_points(group=GROUP, name=product):
        try:
            stage = point.load()
        except (ImportError, AttributeError, ValueError) as error:
            raise SceneError(
                f"product {product!r} is announced by {point.value!r}, which cannot be imported: {error}"
            ) from error
        if not isinstance(stage, Stage) or product not in stage.gives:
            raise SceneError(f"product {product!r} is announced by {point.value!r}, which is no Stage that gives it")
        return stage
    return None


def installed_products() -> tuple[str, ...]:
    """Return the products that stages of other packages announce."""
    from importlib.metadata import entry_points

    return tuple(sorted(entry_points(group=GROUP).names))


def _givers(stages: Iterable[Stage]) -> dict[str, Stage]:
    """Map each product to the one stage that gives it."""
    givers: dict[str, Stage] = {}
    for stage in stages:
        for product in stage.gives:
            if product in givers:
                raise SceneError(
                    f"product {product!r} is given by two stages, {givers[product].name!r} and {stage.name!r}"
                )
            givers[product] = stage
    return givers


def resolve(
    stages: Iterable[Stage],
    outputs: Sequence[str],
    place: Place | None = None,
    installed: Callable[[str], Stage | None] = installed_stage,
) -> tuple[Stage, ...]:
    """Return the smallest set of stages that yields `outputs`, in an order in which each finds what it needs.

    Backward from the outputs; the order depends on `outputs` and `stages` alone.

    Parameters
    ----------
    stages : iterable of Stage
        The registry.
    outputs : sequence of str
        Products wanted.
    place : Place, optional
        Where the outputs were named, for the message.
    installed : callable, optional
        Finds a stage of another package for a product that none of `stages` gives.

    Raises
    ------
    SceneError
        On an unknown output, a need that no stage gives, or a cycle; the message names the stages.

    Examples
    --------
    >>> a, b, c = Stage("a", "m:a", (), ("x",)), Stage("b", "m:b", ("x",), ("y",)), Stage("c", "m:c", (), ("z",))
    >>> [stage.name for stage in resolve([c, b, a], ["y"])]
    ['a', 'b']
    """
    givers = _givers(stages)
    at = f"{place} " if place else ""
    order: list[Stage] = []
    path: list[str] = []

    def visit(product: str) -> None:
        giver = givers.get(product) or installed(product)
        if giver is None:
            who = f"stage {path[-1]!r} needs" if path else "asks for"
            known = suggest(product, (*givers, *installed_products()))
            raise SceneError(f"{at}{who} {shortened(repr(product))}, which no stage gives{known}")
        givers[product] = giver
        if giver in order:
            return
        if giver.name in path:
            raise SceneError(
                f"{at}stages need each other: {' -> '.join([*path[path.index(giver.name) :], giver.name])}"
            )
        path.append(giver.name)
        for need in giver.needs:
            visit(need)
        path.pop()
        order.append(giver)

    for output in outputs:
        visit(output)
    return tuple(order)


def load(stage: Stage) -> Callable[..., Any]:
    """Import the function of a stage.

    Raises
    ------
    SceneError
        If the string does not name a function.
    """
    module_name, _, function_name = stage.function.partition(":")
    try:
        function = getattr(import_module(module_name), function_name)
    except (ImportError, AttributeError, ValueError) as error:
        raise SceneError(f"stage {stage.name!r} names {stage.function!r}, which cannot be imported: {error}") from error
    if not callable(function):
        raise SceneError(f"stage {stage.name!r} names {stage.function!r}, which is not a function")
    return function  # type: ignore[no-any-return]
