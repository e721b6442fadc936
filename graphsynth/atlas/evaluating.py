"""Evaluating mechanisms of a catalogue: dimensions with which they turn, their transmission, and whether they jam."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.evaluations import Evaluation, store
from graphsynth.atlas.schema import GARBAGE, connect, readable, screen, settle
from graphsynth.atlas.stored import data_of, fingerprint, mechanism_in
from graphsynth.core.errors import GraphError, GraphsynthError, SpecError

if TYPE_CHECKING:
    from graphsynth.jamming.joints.certify import TurnCertificate
    from graphsynth.kinematics.dimensional.api import Embodiment
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph

#: Samples of a turn behind the proof that it does not jam, and bounds of the proofs; no limit of time decides a result.
_SAMPLES, _PIECES, _BOXES, _SECONDS = 181, 2000, 20_000, 3600.0
_MOST_TRIES = 1000

#: Status and guarantee of the verdicts that are proofs; every other one is undecided.
VERDICTS = {
    "CERTIFIED_FREE": ("free", "certified"),
    "CERTIFIED_JAMMED": ("jammed", "certified"),
    "CERTIFIED_JAMMED_FOR_SOME": ("jammed for some", "certified"),
}


@dataclass(frozen=True, slots=True)
class Settings:
    """How mechanisms are evaluated; a `SpecError` refuses values out of these bounds."""

    seed: int = 0  # of the search for dimensions
    tries: int = 4  # searches for each mechanism, 1 to 1000
    #: largest misalignment of the axis of the first driver, in any direction, radians; None: no verdict on jamming
    tilt: float | None = None
    joint_limit: float = math.radians(0.3)  # tilt that every joint takes up, radians

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise SpecError(f"seed = {self.seed} must be 0 or more")
        if not 1 <= self.tries <= _MOST_TRIES:
            raise SpecError(f"tries = {self.tries} must lie between 1 and {_MOST_TRIES}")
        for name, value in (("tilt", self.tilt), ("joint_limit", self.joint_limit)):
            if value is not None and not 0.0 < value < 0.1:
                raise SpecError(f"{name} = {value} must lie in (0, 0.1) radians: the model is one of small tilts")


@dataclass(frozen=True, slots=True)
class Task:
    """One mechanism to evaluate; ``known`` is the text of its dimensions where they were found before."""

    key: str
    frame: int
    driver: int | str
    settings: Settings
    known: str | None = None


@dataclass(frozen=True, slots=True)
class EvaluationStep:
    """How far an evaluation is: mechanisms done, of all, and how many of them have dimensions."""

    done: int
    total: int
    found: int


def evaluate(
    path: Path,
    links: Iterable[int] | None,
    mobility: Iterable[int] | None,
    per_chain: int,
    limit: int | None,
    settings: Settings,
    executor: Executor | None,
    watch: Callable[[EvaluationStep], None] | None,
) -> int:
    """Evaluate and store, mechanism by mechanism; see :meth:`graphsynth.atlas.catalogue.Catalogue.evaluate`."""
    from graphsynth.core.ordered import in_order

    if per_chain < 0 or (limit is not None and limit < 0):
        raise SpecError("the numbers of mechanisms must be 0 or more")
    with closing(connect(path)) as connection:
        try:
            screen(connection, path)
            with readable(path, *GARBAGE):
                wanted = list(islice(tasks(connection, links, mobility, per_chain, settings), limit))
            found = 0
            for done, evaluations in enumerate(in_order(executor, evaluate_task, wanted), 1):
                store(connection, evaluations)
                found += any(item.kind == "dimensions" and item.status == "found" for item in evaluations)
                if watch:
                    watch(EvaluationStep(done, len(wanted), found))
        finally:
            settle(connection)
    return len(wanted)


def tasks(
    connection: sqlite3.Connection,
    links: Iterable[int] | None,
    mobility: Iterable[int] | None,
    per_chain: int,
    settings: Settings,
) -> Iterator[Task]:
    """Yield the mechanisms that are still to be evaluated, chain by chain, the simplest to assemble first."""
    sizes = dict(connection.execute("SELECT group_id, links FROM groups"))
    families = connection.execute("SELECT family_id, links, mobility FROM families ORDER BY mobility, links").fetchall()
    for family, count, freedom in families:
        if (links is not None and count not in set(links)) or (mobility is not None and freedom not in set(mobility)):
            continue
        select = "SELECT chain_id, key FROM chains WHERE family_id = ? ORDER BY key"
        for number, key in connection.execute(select, (family,)).fetchall():
            # those of small groups before those of large ones, then by class, frame, driver
            select = "SELECT frame, driver, class, groups FROM mechanisms WHERE chain_id = ?"
            ranked = sorted(
                (max((sizes[int(group)] for group in groups.split()), default=0), own, frame, str(driver), driver)
                for frame, driver, own, groups in connection.execute(select, (number,)).fetchall()
            )
            for _, _, frame, _, driver in ranked[: per_chain or None]:
                task = _task(connection, number, key, frame, driver, settings)
                if task is not None:
                    yield task


def _task(
    connection: sqlite3.Connection, number: int, key: str, frame: int, driver: int | str, settings: Settings
) -> Task | None:
    """Return what is left to do for a mechanism: nothing if it was evaluated with these settings."""
    select = "SELECT kind, status, data FROM evaluations WHERE (chain_id, frame, driver) = (?, ?, ?)"
    stored = {kind: tuple(rest) for kind, *rest in connection.execute(select, (number, frame, driver))}
    status, data = stored.get("dimensions", ("", None))
    if status == "found" and data is not None:
        if settings.tilt is None or _has(stored.get("jamming"), _question(settings, data)):
            return None
        return Task(key, frame, driver, settings, data)
    if status and _has((status, data), {"seed": settings.seed, "tries": settings.tries}):
        return None
    return Task(key, frame, driver, settings)


def _has(row: tuple[str, str | None] | None, wanted: dict[str, Any]) -> bool:
    """Whether a stored evaluation was made with these settings."""
    try:
        data = data_of(row[1]) if row and row[1] else {}
    except ValueError:
        return False
    return isinstance(data, dict) and all(data.get(name) == value for name, value in wanted.items())


def evaluate_task(task: Task) -> list[Evaluation]:
    """Evaluate one mechanism (in the worker); the same task gives the same result."""
    import graphsynth
    from graphsynth.mechanism.model import Mechanism

    found = [] if task.known else _dimensions(task)
    text = task.known or next((item.text for item in found if item.status == "found"), None)
    tilt, limit = task.settings.tilt, task.settings.joint_limit
    if text is not None and tilt is not None:
        proof = jamming_proof(Mechanism.from_json(json.dumps(data_of(text)["mechanism"])), tilt, limit)
        status, guarantee = VERDICTS.get(proof.verdict.name, ("undecided", None))
        data = {**_question(task.settings, text), "reason": proof.reason, "version": graphsynth.__version__}
        place = task.key, task.frame, task.driver
        found.append(Evaluation(*place, "jamming", status, tilt, "rad", guarantee, data))
    return found


def _dimensions(task: Task) -> list[Evaluation]:
    """Search for dimensions; the numbers of the links stay those of the key."""
    import graphsynth
    from graphsynth.structure.graph import MechanismGraph

    chain = MechanismGraph.from_key(task.key)
    framed = MechanismGraph(chain.links, chain.joints, frame=task.frame)
    drivers = [(task.frame, int(link)) for link in str(task.driver).split(",")]
    settings = {"seed": task.settings.seed, "tries": task.settings.tries, "version": graphsynth.__version__}
    place = task.key, task.frame, task.driver
    try:
        found = _embody(framed, driver=drivers, seed=task.settings.seed, tries=task.settings.tries)
    except GraphError as error:
        return [Evaluation(*place, "dimensions", "not found", data={**settings, "statement": str(error)})]
    if not found.accepted or found.mechanism is None or found.motion is None or found.figures is None:
        return [Evaluation(*place, "dimensions", "not found", data={**settings, "statement": found.statement})]
    mechanism = json.loads(found.mechanism.to_json())
    data: dict[str, Any] = {
        **settings,
        "statement": found.statement,
        "goals": {name: getattr(found.goals, name) for name in ("min_transmission_angle", "max_length_ratio")},
        "length_ratio": found.figures.length_ratio,
        "mechanism": mechanism,
    }
    guarantee = "certified" if turn_is_proved(found.motion) else "estimated"
    angle, turn = found.figures.transmission_angle, {"range": [0.0, math.tau], "dimensions": fingerprint(mechanism)}
    return [
        Evaluation(*place, "dimensions", "found", guarantee=guarantee, data=data),
        Evaluation(*place, "transmission", "found", angle, "rad", "estimated", turn),
    ]


def _embody(graph: MechanismGraph, **options: Any) -> Embodiment:
    from graphsynth.kinematics.dimensional import embody

    found: Embodiment = embody(graph, **options)
    return found


def turn_is_proved(motion: Motion) -> bool:
    """Whether the motion is proved to be one regular branch that closes."""
    from graphsynth.kinematics.certify.poses import certify

    try:
        proof = certify(motion, max_boxes=_BOXES, seconds=_SECONDS)
    except GraphsynthError:
        return False
    return proof.certified and proof.closed


def motion_of(mechanism: Mechanism, samples: int = _SAMPLES) -> Motion:
    """Simulate a full turn of all drivers."""
    import numpy as np

    from graphsynth.kinematics.simulation import simulate

    return simulate(mechanism, np.linspace(0.0, math.tau, samples))


def _question(settings: Settings, dimensions: str) -> dict[str, Any]:
    """Return what a verdict is about: tilt, what the joints take up, and the name of the dimensions."""
    mechanism = mechanism_in(data_of(dimensions))
    named = None if mechanism is None else fingerprint(mechanism)
    return {"tilt": settings.tilt, "joint_limit": settings.joint_limit, "dimensions": named}


def jamming_proof(mechanism: Mechanism, tilt: float, joint_limit: float) -> TurnCertificate:
    """Prove whether a mechanism jams: the first driven axis tilted by at most ``tilt`` in any direction, model L1."""
    from graphsynth.jamming.joints import JointLimits, Misalignment, certify_coupled

    driver = mechanism.drivers[0]
    motor = Misalignment(driver.base, driver.link, tilt, alpha_range=(0.0, tilt), direction_range=(0.0, math.tau))
    limits = JointLimits(joint_limit)
    proof: TurnCertificate = certify_coupled(motion_of(mechanism), limits, motor, max_pieces=_PIECES, seconds=_SECONDS)
    return proof
