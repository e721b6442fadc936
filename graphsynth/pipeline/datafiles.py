"""Results as data: CSV (RFC 4180) and Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.products import Columns, Quantity, Record

if TYPE_CHECKING:
    from graphsynth.pipeline.runner import Report
    from graphsynth.pipeline.scene import Scene


def check_files(scene: Scene) -> None:
    """Refuse, before anything runs, kinds of files that this installation cannot write.

    Raises
    ------
    SceneError
        If Parquet is asked for without pyarrow.
    """
    if "parquet" in scene.outputs.files and find_spec("pyarrow") is None:
        raise (scene.place / "outputs" / "files").error(
            "asks for Parquet, which needs pyarrow: install graphsynth[parquet], or take it out"
        )


def data_files(report: Report) -> dict[str, bytes]:
    """Return the data files of a report by name: ``results`` of its records, one for each `Columns`."""
    found: dict[str, Mapping[str, Any]] = {}
    if report.products.get("records"):
        found["results"] = results_table(report.products["records"])
    for value in report.products.values():
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, Columns):
                found[item.name] = item.columns
    kinds = report.scene.outputs.files
    return {file: data for name, columns in found.items() for file, data in column_files(name, columns, kinds).items()}


def column_files(name: str, columns: Mapping[str, Any], kinds: Sequence[str]) -> dict[str, bytes]:
    """Return columns as files of the kinds asked for: name with its ending, to the content."""
    made = {"csv": lambda: _csv(columns).encode(), "parquet": lambda: _parquet(columns)}
    return {f"{name}.{kind}": made[kind]() for kind in kinds}


def results_csv(records: Sequence[Record]) -> str:
    """Return the records as CSV: one row per candidate, three columns per margin; an empty cell: not computed."""
    return _csv(results_table(records))


def results_table(records: Sequence[Record]) -> dict[str, list[Any]]:
    """Return the records by the column.

    For a margin ``m`` the columns are ``m [unit]``, ``m guarantee`` and ``m error [unit]``; None means not computed.
    """
    columns: dict[str, list[Any]] = {
        "number": [r.number for r in records],
        "key": [r.key for r in records],
        "solution": [r.solution for r in records],
        "status": [r.status for r in records],
        "recognised as": [r.recognised_as for r in records],
        "verdict": [r.verdict for r in records],
    }
    units: dict[str, str] = {}
    for record in records:
        for margin in record.margins:
            units.setdefault(margin.name, f" [{margin.unit}]" if margin.unit else "")
    found: list[dict[str, Quantity]] = [{m.name: m for m in record.margins} for record in records]
    for name, unit in units.items():
        margins = [have.get(name) for have in found]
        columns[f"{name}{unit}"] = [None if m is None else float(m.value) for m in margins]
        columns[f"{name} guarantee"] = [None if m is None else m.guarantee for m in margins]
        columns[f"{name} error{unit}"] = [None if m is None or m.error is None else float(m.error) for m in margins]
    columns["reason"] = [r.reason for r in records]
    return columns


def _csv(columns: Mapping[str, Any]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow(columns)
    lists = [values.tolist() if hasattr(values, "tolist") else values for values in columns.values()]
    writer.writerows(zip(*lists, strict=True))
    return stream.getvalue()


def _parquet(columns: Mapping[str, Any]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    stream = io.BytesIO()
    parquet.write_table(pyarrow.table({name: pyarrow.array(values) for name, values in columns.items()}), stream)
    return stream.getvalue()
