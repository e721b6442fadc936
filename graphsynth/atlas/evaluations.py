"""Evaluations of mechanisms in a catalogue: what somebody computed of one, with its unit and its guarantee.

The catalogue computes structure; dimensions, transmission and jamming are results of other rooms, kept here beside the
mechanism they belong to.  What is not here was not computed, and is shown so.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graphsynth.atlas.building import transaction
from graphsynth.atlas.schema import connect, settle
from graphsynth.errors import SpecError

__all__ = ["GUARANTEES", "KINDS", "NOT_COMPUTED", "Evaluation", "record", "store"]

#: Kinds that every entry lists, computed or not; others may be stored too.
KINDS = ("dimensions", "transmission", "jamming")
GUARANTEES = ("exact", "certified", "estimated")
NOT_COMPUTED = "not computed"


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One evaluation of one mechanism.

    Parameters
    ----------
    chain : str
        Key or label.
    frame : int
    driver : int or str
        As in the table of mechanisms; text such as ``'1,3'`` for several.
    kind : str
        ``'dimensions'``, ``'transmission'``, ``'jamming'``, or another word.
    status : str
        One word: ``'found'``, ``'free'``, ``'undecided'``, ...
    value : float, optional
        A finite number in SI units or radians; None where there is none.
    unit : str, optional
    guarantee : {"exact", "certified", "estimated"}, optional
    data : object, optional
        Anything JSON holds: dimensions, settings, the evidence.

    Raises
    ------
    SpecError
        For a value that is not finite, an unknown guarantee, or data that JSON does not hold.
    """

    chain: str
    frame: int
    driver: int | str
    kind: str
    status: str
    value: float | None = None
    unit: str | None = None
    guarantee: str | None = None
    data: Any = None

    def __post_init__(self) -> None:
        if self.value is not None and not math.isfinite(self.value):
            raise SpecError(f"the value {self.value!r} of {self.kind!r} is not finite; give None and say why in status")
        if self.guarantee is not None and self.guarantee not in GUARANTEES:
            raise SpecError(f"there is no guarantee {self.guarantee!r}; choose one of {', '.join(GUARANTEES)}")
        if not self.kind or not self.status:
            raise SpecError("an evaluation needs a kind and a status; give both as one word")
        _ = self.text

    @property
    def text(self) -> str | None:
        """The data as JSON."""
        if self.data is None:
            return None
        try:
            return json.dumps(self.data, allow_nan=False, sort_keys=True)
        except (TypeError, ValueError) as error:
            raise SpecError(f"the data of {self.kind!r} are not JSON ({error}); give numbers, text and lists") from None


def record(path: Path, evaluations: Iterable[Evaluation]) -> int:
    """Store evaluations in one transaction; see :meth:`graphsynth.atlas.catalogue.Catalogue.record`."""
    with closing(connect(path)) as connection:
        count = store(connection, evaluations)
        settle(connection)
    return count


def store(connection: sqlite3.Connection, evaluations: Iterable[Evaluation]) -> int:
    """Write evaluations in one transaction; return how many."""
    with transaction(connection):
        rows = [(*_mechanism(connection, item), *_values(item)) for item in evaluations]
        connection.executemany("INSERT OR REPLACE INTO evaluations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return len(rows)


def _values(item: Evaluation) -> tuple[Any, ...]:
    return item.kind, item.status, item.value, item.unit, item.guarantee, item.text


def _mechanism(connection: sqlite3.Connection, item: Evaluation) -> tuple[int, int, int | str]:
    row = connection.execute(
        "SELECT chain_id FROM chains JOIN driven USING (chain_id) WHERE (key = ? OR label = ?) AND frame = ? "
        "AND driver = ?",
        (item.chain, item.chain, item.frame, item.driver),
    ).fetchone()
    if row is None:
        raise SpecError(
            f"the catalogue holds no mechanism {item.chain!r} with frame {item.frame} and driver {item.driver}: "
            "take one from the table of mechanisms, which lists one of each orbit"
        )
    return row[0], item.frame, item.driver


def dimensions(entry: dict[str, Any], frame: int | None, driver: int | str | None) -> str:
    """Return the mechanism stored with an entry, as the JSON text that :class:`graphsynth.Mechanism` reads."""
    for own in entry["mechanisms"]:
        if frame in (None, own["frame"]) and (driver is None or str(driver) == str(own["driver"])):
            known = own["evaluations"]["dimensions"]
            data = known["data"] if isinstance(known, dict) else None
            if isinstance(data, dict) and "mechanism" in data:
                return json.dumps(data["mechanism"])
    raise SpecError(
        f"no dimensions are stored for {entry['label'] or entry['key']} with this choice of frame and driver: have "
        "them computed by 'graphsynth catalog evaluate'"
    )
