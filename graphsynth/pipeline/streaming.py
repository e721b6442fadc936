"""Candidates one by one through the stages that work on each: in parallel, recorded as they come, resumed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any

from graphsynth.core.errors import SceneError
from graphsynth.core.ordered import in_order
from graphsynth.pipeline.products import Outcome, Rejected
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.store import Candidates, PartFolder, decode, encode, split_parts
from graphsynth.pipeline.system import Stage

_LONG = 0.05  # seconds: chunks of candidates grow until they take this long
_MOST = 32


@dataclass(frozen=True, slots=True)
class Plan:
    """Stages for each candidate in the order of running, and their products."""

    stages: tuple[Stage, ...]  # cheap ones first, as far as their needs allow
    source: str  # product of the stream
    shared: tuple[str, ...]  # whole products they need besides
    kept: tuple[str, ...]  # products of a candidate that other stages or the report need


def plan_stream(stages: Sequence[Stage], wanted: Sequence[str]) -> Plan | None:
    """Pick the stages for each candidate out of resolved stages; None if there is none.

    A `SceneError` says that they do not start from exactly one stream, or need what only all candidates together give.
    """
    each = [stage for stage in stages if stage.each]
    if not each:
        return None
    given = {product for stage in each for product in stage.gives}
    sources = {product for stage in stages if stage.stream for product in stage.gives}
    used = sorted({need for stage in each for need in stage.needs if need in sources})
    if len(used) != 1:
        names = ", ".join(repr(stage.name) for stage in each)
        raise SceneError(f"stages for each candidate ({names}) must start from one stream, not {len(used)}")
    shared = {need for stage in each for need in stage.needs} - given - set(used)
    for stage in stages:
        if not stage.each and set(stage.gives) & _before(stages, shared) and set(stage.needs) & given:
            raise SceneError(
                f"stage {stage.name!r} needs all candidates, but a stage for each candidate needs what comes of it; "
                "make that one a stage over all candidates"
            )
    rest = {need for stage in stages if not stage.each for need in stage.needs} | set(wanted)
    kept = tuple(product for stage in each for product in stage.gives if product in rest)
    return Plan(_cheapest_first(each, {*used, *shared}), used[0], tuple(sorted(shared)), kept)


def _before(stages: Sequence[Stage], products: set[str]) -> set[str]:
    """Return the products of stages over all that these need, directly or not; these included."""
    found = set(products)
    for stage in reversed(stages):  # each stage stands behind all it needs
        if not stage.each and found & set(stage.gives):
            found |= set(stage.needs)
    return found


def _cheapest_first(each: Sequence[Stage], ready: set[str]) -> tuple[Stage, ...]:
    """Order stages so that each finds what it needs and, of those that could come next, the cheapest comes first."""
    waiting = dict(enumerate(each))
    order: list[Stage] = []
    have = set(ready)
    while waiting:
        possible = ((stage.cost, place) for place, stage in waiting.items() if set(stage.needs) <= have)
        stage = waiting.pop(min(possible)[1])
        order.append(stage)
        have |= set(stage.gives)
    return tuple(order)


@dataclass(slots=True)
class Spent:
    """What one stage for each candidate cost, summed over candidates; the modules it was the first to import."""

    seconds: float = 0.0
    runs: int = 0
    modules: tuple[str, ...] = ()

    def add(self, other: Spent) -> None:
        """Add what it cost elsewhere."""
        self.seconds += other.seconds
        self.runs += other.runs
        self.modules += other.modules


def evaluate(
    plan: Plan, context: Context, shared: Mapping[str, Any], number: int, item: Any, spent: dict[str, Spent]
) -> Outcome:
    """Take one candidate through the stages until one stops it; add what each stage cost to `spent`."""
    have: dict[str, Any] = {**shared, plan.source: item}
    outcome = Outcome(number, str(getattr(item, "key", "")), str(getattr(item, "solution", "")))
    for stage in plan.stages:
        start, imported = time.perf_counter(), len(sys.modules)
        try:
            values = given_by(stage, stage.load()(context, *(have[need] for need in stage.needs)))
        except Rejected as why:
            return replace(outcome, status="rejected", stage=stage.name, cause=why.cause, reason=str(why))
        except Exception as error:
            if _interrupted(error):
                raise KeyboardInterrupt from error
            cause = type(error).__name__
            return replace(outcome, status="failed", stage=stage.name, cause=cause, reason=f"{cause}: {error}")
        finally:
            new = tuple(islice(sys.modules, imported, None)) if len(sys.modules) > imported else ()
            spent.setdefault(stage.name, Spent()).add(Spent(time.perf_counter() - start, 1, new))
        have.update(values)
    return replace(outcome, products={name: have[name] for name in plan.kept})


def _interrupted(error: BaseException | None) -> bool:
    """Whether an exception only wraps a Ctrl-C, as the compiler of the kernels does."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def given_by(stage: Stage, result: Any) -> dict[str, Any]:
    """Name what a stage returned; a `SceneError` if it is not what the stage says it gives."""
    values = (result,) if len(stage.gives) == 1 else result
    if not isinstance(values, tuple) or len(values) != len(stage.gives):
        raise SceneError(f"stage {stage.name!r} says it gives {', '.join(stage.gives)} but returned something else")
    return dict(zip(stage.gives, values, strict=True))


def _evaluate_chunk(
    plan: Plan, context: Context, shared: Mapping[str, Any], chunk: list[tuple[int, Any]]
) -> tuple[list[tuple[str, dict[str, bytes]]], dict[str, Spent]]:
    """Evaluate some candidates anywhere; outcomes come back as the text that is stored, with the files they gave."""
    spent: dict[str, Spent] = {}
    results = []
    for number, item in chunk:
        outcome, files = split_parts(evaluate(plan, context, shared, number, item, spent), context.scene.outputs.files)
        results.append((encode(outcome), files))
    return results, spent


@dataclass(slots=True)
class Streamed:
    """What a stream gave: outcomes in the order of candidates, the cost of each stage, why it stopped early."""

    outcomes: list[Outcome] = field(default_factory=list)
    spent: dict[str, Spent] = field(default_factory=dict)
    stopped: str = ""
    resumed: int = 0


def stream(
    plan: Plan,
    context: Context,
    shared: Mapping[str, Any],
    items: Iterable[Any],
    journal: Candidates,
    used_up: Callable[[], str],
    progress: Callable[[int], None] | None = None,
) -> Streamed:
    """Evaluate every item, in order whoever computes it, and write each outcome as it comes.

    Items are taken one by one, at most some chunks ahead; what the journal has already is not computed again. `used_up`
    says after each chunk which budget is used up, or nothing; `progress` is told the number of candidates done. A
    `SceneError` says that the journal was written for other candidates.
    """
    done = Streamed()
    numbered = enumerate(items, 1)
    for outcome in journal.done:  # these an interrupted run has finished, if they are the same ones
        number, item = next(numbered, (0, None))
        if (number, str(getattr(item, "key", ""))) != (outcome.number, outcome.key):
            raise SceneError(
                f"candidate {outcome.number} of the interrupted run ({outcome.key or 'no key'}) is not candidate "
                f"{number or 'any'} of this one; add --fresh to start anew"
            )
        done.outcomes.append(outcome)
    done.resumed = len(journal.done)
    parts = PartFolder(journal.path.parent if journal.path else None, journal.done, context.scene.outputs.files)
    executor: Executor | None = context.executor
    size = [1]
    work = partial(_evaluate_chunk, plan, replace(context, executor=None), shared)
    with closing(in_order(executor, work, _chunks(numbered, size))) as results:
        for evaluated, spent in results:
            for line, files in evaluated:
                parts.write(files)
                journal.append(line)
                done.outcomes.append(decode(line))
            for name, cost in spent.items():
                done.spent.setdefault(name, Spent()).add(cost)
            if executor is not None and sum(cost.seconds for cost in spent.values()) < _LONG:
                size[0] = min(_MOST, 2 * size[0])
            if progress:
                progress(len(done.outcomes))
            done.stopped = used_up()
            if done.stopped:
                return done
    journal.complete()
    return done


def _chunks(numbered: Iterator[tuple[int, Any]], size: list[int]) -> Iterator[list[tuple[int, Any]]]:
    """Cut into runs of candidates, as long as ``size[0]`` says when they are cut; outcomes do not depend on it."""
    chunk: list[tuple[int, Any]] = []
    for pair in numbered:
        chunk.append(pair)
        if len(chunk) >= size[0]:
            yield chunk
            chunk = []
    if chunk:
        yield chunk
