"""Evaluations of mechanisms in a catalogue: what somebody computed of one, with its unit and its guarantee.

The catalogue computes structure; dimensions, transmission and jamming are results of other rooms, kept here beside the
mechanism they belong to.  What is not here was not computed, and is shown so.
"""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graphsynth.atlas.building import transaction
from graphsynth.atlas.schema import connect, settle
from graphsynth.atlas.stored import TIED, data_of, fingerprint, fingerprint_at, mechanism_in
from graphsynth.core.errors import SpecError

GUARANTEES = ("exact", "certified", "estimated")
#: As the columns of the table ask for, see :mod:`graphsynth.atlas.tables`.
_WORD = re.compile(r"(?![=+@-])[^\x00-\x1f\x7f-\x9f]{1,200}")
_MOST_DATA = 1_000_000


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One evaluation of one mechanism.

    A `SpecError` refuses a value that is not finite, an unknown guarantee, no words, and data that JSON does not hold
    or that are longer than a million characters.
    """

    chain: str  # key or label
    frame: int
    driver: int | str  # as in the table of mechanisms; text such as ``'1,3'`` for several
    kind: str  # ``'dimensions'``, ``'transmission'``, ``'jamming'``, or another word of at most 200 characters
    status: str  # one such word: ``'found'``, ``'free'``, ``'undecided'``, ...
    value: float | None = None  # a finite number in SI units or radians; None where there is none
    unit: str | None = None
    guarantee: str | None = None  # one of `GUARANTEES`
    data: Any = None  # anything JSON holds: dimensions, settings, the evidence

    def __post_init__(self) -> None:
        if self.value is not None and not math.isfinite(self.value):
            raise SpecError(f"the value {self.value!r} of {self.kind!r} is not finite; give None and say why in status")
        if self.guarantee is not None and self.guarantee not in GUARANTEES:
            raise SpecError(f"there is no guarantee {self.guarantee!r}; choose one of {', '.join(GUARANTEES)}")
        for name, word in (("kind", self.kind), ("status", self.status), ("unit", self.unit)):
            if word is not None and not _WORD.fullmatch(word):
                raise SpecError(
                    f"{name} = {word!r} must be 1 to 200 characters without control characters, and begin with none of "
                    "=+@-; give one word"
                )
        text = self.text or "null"
        try:
            data_of(text)
        except ValueError as error:
            raise SpecError(f"of the evaluation {self.kind!r}, {error}; give flatter ones") from None
        if len(text) > _MOST_DATA:
            raise SpecError(
                f"the data of {self.kind!r} take more than {_MOST_DATA} characters of JSON; keep them in a file"
            )

    @property
    def text(self) -> str | None:
        """The data as JSON."""
        if self.data is None:
            return None
        try:
            return json.dumps(self.data, allow_nan=False, sort_keys=True)
        except (TypeError, ValueError, RecursionError) as error:
            raise SpecError(f"the data of {self.kind!r} are not JSON ({error}); give numbers, text and lists") from None


def record(path: Path, evaluations: Iterable[Evaluation]) -> int:
    """Store evaluations in one transaction; see :meth:`graphsynth.atlas.catalogue.Catalogue.record`."""
    with closing(connect(path)) as connection:
        try:
            return store(connection, evaluations)
        finally:
            settle(connection)


def store(connection: sqlite3.Connection, evaluations: Iterable[Evaluation]) -> int:
    """Write evaluations in one transaction, dimensions first; return how many.

    Results that belong to dimensions which are replaced now are dropped.
    """
    items = sorted(evaluations, key=lambda item: item.kind != "dimensions")
    with transaction(connection):
        for item in items:
            place = _mechanism(connection, item)
            if item.kind == "dimensions":
                mechanism = mechanism_in(item.data)
                if mechanism is None or fingerprint(mechanism) != fingerprint_at(connection, place):
                    drop = "DELETE FROM evaluations WHERE (chain_id, frame, driver, kind) = (?, ?, ?, ?)"
                    connection.executemany(drop, [(*place, kind) for kind in TIED])  # found for other dimensions
            elif item.kind in TIED:
                named = item.data.get("dimensions") if isinstance(item.data, dict) else None
                if named is not None and named != fingerprint_at(connection, place):
                    raise SpecError(
                        f"the {item.kind} of {item.chain} with frame {item.frame} and driver {item.driver} is of the "
                        f"dimensions {named!r}, which are not those stored: store its dimensions first, or compute it "
                        "for the stored ones"
                    )
            row = *place, item.kind, item.status, item.value, item.unit, item.guarantee, item.text
            connection.execute("INSERT OR REPLACE INTO evaluations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
    return len(items)


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
