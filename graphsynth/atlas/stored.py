"""Dimensions stored in a catalogue: the one place that reads them, and what ties other results to them.

A transmission angle or a verdict on jamming belongs to one set of dimensions.  Such a row names them by `fingerprint`
in its data, and goes when they are replaced.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

#: Kinds of evaluations that hold for one set of dimensions only.
TIED = ("transmission", "jamming")
_DEEPEST = 100


@dataclass(frozen=True, slots=True)
class StoredMechanism:
    """A mechanism with its dimensions, as a catalogue holds it.

    Parameters
    ----------
    chain_id : int
        Number of the chain in the file.
    frame : int
    driver : int or str
        As in the table of mechanisms.
    text : str
        What :meth:`graphsynth.Mechanism.from_json` reads.
    """

    chain_id: int
    frame: int
    driver: int | str
    text: str


def data_of(text: str) -> Any:
    """Return the data of an evaluation, as :func:`json.loads` does.

    Raises `ValueError` if the text is not JSON, or lists and objects lie more than a hundred deep in one another:
    whoever writes such data out again would run out of stack.
    """
    try:
        data = json.loads(text)
    except RecursionError:
        raise ValueError("its data are too deep") from None
    level, depth = [data] if isinstance(data, dict | list) else [], 0
    while level:
        depth += 1
        if depth > _DEEPEST:
            raise ValueError(f"its data are more than {_DEEPEST} lists and objects deep")
        level = [
            own
            for one in level
            for own in (one.values() if isinstance(one, dict) else one)
            if isinstance(own, dict | list)
        ]
    return data


def mechanism_in(data: Any) -> dict[str, Any] | None:
    """Return the mechanism in the data of an evaluation of kind ``'dimensions'``; None where there is none."""
    mechanism = data.get("mechanism") if isinstance(data, dict) else None
    return mechanism if isinstance(mechanism, dict) else None


def fingerprint(mechanism: dict[str, Any]) -> str:
    """Return what names a set of dimensions: 128 bits of SHA-256 over every key and digit.

    Parameters
    ----------
    mechanism : dict
        As :meth:`graphsynth.Mechanism.to_json` writes it.

    Examples
    --------
    >>> fingerprint({"a": 1.0, "b": 2}) == fingerprint({"b": 2, "a": 1.0}) != fingerprint({"a": 1.5, "b": 2})
    True
    """
    text = json.dumps(mechanism, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return sha256(text.encode()).hexdigest()[:32]


def fingerprint_at(connection: sqlite3.Connection, place: tuple[int, int, int | str]) -> str | None:
    """Return the name of the dimensions stored for (chain, frame, driver); None where there are none.

    Raises `ValueError` if the row is not JSON.
    """
    row = connection.execute(
        "SELECT data FROM evaluations WHERE (chain_id, frame, driver, kind) = (?, ?, ?, 'dimensions')", place
    ).fetchone()
    mechanism = mechanism_in(data_of(row[0])) if row and row[0] else None
    return None if mechanism is None else fingerprint(mechanism)


_SELECT = """
SELECT d.chain_id, d.frame, d.driver, d.data FROM evaluations d LEFT JOIN evaluations t
  ON (t.chain_id, t.frame, t.driver, t.kind) = (d.chain_id, d.frame, d.driver, 'transmission')
WHERE d.kind = 'dimensions' AND d.status = 'found' AND d.data IS NOT NULL AND (? IS NULL OR d.chain_id = ?)
ORDER BY d.chain_id, t.value DESC, d.frame, CAST(d.driver AS TEXT)
"""


def stored_mechanisms(connection: sqlite3.Connection, chain_id: int | None = None) -> Iterator[StoredMechanism]:
    """Yield the mechanisms with stored dimensions, chain by chain, those of the best transmission first.

    ``chain_id``: only those of this chain. Raises `ValueError` if a row is not JSON: the file is damaged.
    """
    for number, frame, driver, data in connection.execute(_SELECT, (chain_id, chain_id)):
        mechanism = mechanism_in(data_of(data))
        if mechanism is not None:
            yield StoredMechanism(number, frame, driver, json.dumps(mechanism))
