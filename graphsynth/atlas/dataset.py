"""`Dataset`: all chains of families, and their mechanisms, as Parquet files with a manifest.

A folder holds ``chains/mobility=1/links=14/part-00000.parquet`` and so on, ``mechanisms/`` likewise, and
``manifest.json``: parts, rows, checksums, and sums that other methods count.  Any tool that reads Parquet reads it.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.building import BuildStep
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError
from graphsynth.core.extras import need
from graphsynth.core.shown import Shown
from graphsynth.core.wholefiles import replacing

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.structure.graph import MechanismGraph

TABLES = ("chains", "mechanisms")
_MANIFEST, _FORM = "manifest.json", 2  # 2: with the type of mobility
_ABOUT = {
    "what": "kinematic chains in the plane with revolute joints, each once, and their mechanisms by frame and drivers",
    "licence": "as graphsynth",
    "made by": "graphsynth catalog dataset",
}


@dataclass(frozen=True)
class FilesCheck:
    """What a check of a data set found: differences in sentences, files and rows looked at."""

    differences: tuple[str, ...]
    files: int
    rows: int

    @property
    def passed(self) -> bool:
        """Whether nothing differs."""
        return not self.differences


class Dataset(Shown):
    """A folder of Parquet files with all chains of some families.

    Parameters
    ----------
    folder : path
        Made by `Dataset.build` or ``graphsynth catalog dataset``.

    Raises
    ------
    FormatError
        If the folder holds no data set, or one of another version.

    Examples
    --------
    >>> data = Dataset.build("dataset", [6, 8])  # doctest: +SKIP
    >>> len(data), data.chain(8, 3).links, data.verify().passed  # doctest: +SKIP
    (18, 8, True)
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        try:
            self.manifest: dict[str, Any] = json.loads((self.folder / _MANIFEST).read_text(encoding="utf-8"))
            version = self.manifest["version"]
            self._rows = {(own["mobility"], own["links"]): own for own in map(_read, self.manifest["families"])}
        except FileNotFoundError:
            raise FormatError(
                f"{self.folder} holds no data set (no {_MANIFEST}): build one by 'graphsynth catalog dataset'"
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise FormatError(f"{self.folder / _MANIFEST} is damaged ({error}): build the data set anew") from None
        if version != _FORM:
            raise FormatError(f"{self.folder} is a data set of version {version}, not {_FORM}: build it anew")

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        held = [(f"mobility {w}, {n} links", f"{own['rows']['chains']} chains") for (w, n), own in self._rows.items()]
        return f"Data set in {self.folder}", held

    def __len__(self) -> int:
        return sum(own["rows"]["chains"] for own in self._rows.values())

    @classmethod
    def build(
        cls,
        folder: str | Path,
        links: Iterable[int],
        mobility: int = 1,
        *,
        fractionated: bool = False,
        mechanisms: bool = True,
        executor: Executor | None = None,
        shard: tuple[int, int] | None = None,
        watch: Callable[[BuildStep], None] | None = None,
    ) -> Dataset:
        """Make or continue a data set: the same bytes whoever computes, part by part.

        Parameters
        ----------
        folder : path
            Where it is, or will be; parts that are there stay.
        links : iterable of int
            Numbers of links, at most 18.
        mobility, fractionated
            As for `Catalogue.build`.
        mechanisms : bool
            List mechanisms, too: forty for each chain of 14 links.
        executor : concurrent.futures.Executor, optional
            Who computes; this process writes.
        shard : (i, m), optional
            Make part i of m only, into the same folder or a copy of it; without ``shard`` the same call then makes what
            is missing, counts, and completes the family.
        watch : callable, optional
            Called with a `BuildStep` after every part.

        Returns
        -------
        Dataset

        Raises
        ------
        SpecError, TooLargeError
            For numbers out of their bounds; a missing extra.
        GraphsynthError
            If files cannot be written, or their rows are not as many as are counted.
        """
        place = Path(folder)
        need("pyarrow.parquet", "parquet", "A data set")
        try:
            place.mkdir(parents=True, exist_ok=True)
            if not (place / _MANIFEST).exists():
                _write_manifest(place, [])
            for count in sorted(set(links)):
                own = _Family(place, mobility, count, fractionated and mobility > 1, mechanisms)
                own.make(executor, shard, watch)
        except OSError as error:
            raise GraphsynthError(
                f"{error.filename or place} cannot be written ({error.strerror or error}): make room or name another "
                "folder, then give the same command to go on"
            ) from None
        return cls(place)

    @property
    def families(self) -> pd.DataFrame:
        """One row for each family: mobility, links, chains, mechanisms, parts, counted, labelled."""
        import pandas as pd

        rows = [
            (w, n, own["rows"]["chains"], own["rows"]["mechanisms"], len(own["parts"]), own["counted"], own["labelled"])
            for (w, n), own in self._rows.items()
        ]
        return pd.DataFrame(rows, columns=["mobility", "links", "chains", "mechanisms", "parts", "counted", "labelled"])

    def query(self, sql: str, parameters: Iterable[Any] = (), *, limit: int | None = None) -> pd.DataFrame:
        """Ask the tables ``chains`` and ``mechanisms`` anything in SQL (DuckDB).

        Parameters
        ----------
        sql : str
            A question; rows of both tables have ``mobility``, ``links``, ``part`` and ``chain``, its row in the part.
        parameters : iterable
            Values for ``?``.
        limit : int, optional
            Read no more rows than this.

        Returns
        -------
        pandas.DataFrame
            With ``limit``, ``.attrs["more"]`` says whether there are more.

        Raises
        ------
        SpecError
            For a question that DuckDB refuses, with what it says; for DuckDB missing.
        """
        import pandas as pd

        duckdb = need("duckdb", "dataset", "A question in SQL to a data set")
        try:
            answer = self._connection.execute(sql, list(parameters))
            if limit is None:
                whole: pd.DataFrame = answer.df()
                return whole
            chunks = [answer.fetch_df_chunk()]
            while len(chunks[-1]) and sum(map(len, chunks)) <= limit:
                chunks.append(answer.fetch_df_chunk())
        except duckdb.Error as error:
            raise SpecError(f"DuckDB refuses the question: {str(error).splitlines()[0]}") from None
        rows = pd.concat(chunks, ignore_index=True)
        rows.attrs["more"] = len(rows) > limit
        return rows.head(limit)

    @cached_property
    def _connection(self) -> Any:
        """Tables over the files of all complete families; nothing else can be read or written."""
        import duckdb

        connection = duckdb.connect()
        for table in TABLES:
            if files := [_quoted(str(path)) for path in self._files(table)]:
                chain = "file_row_number AS chain, " if table == "chains" else ""
                connection.execute(
                    f"CREATE VIEW {table} AS SELECT * EXCLUDE (filename, file_row_number), {chain}"
                    "CAST(regexp_extract(filename, 'part-(\\d+)', 1) AS INTEGER) AS part FROM read_parquet("
                    f"[{', '.join(files)}], hive_partitioning = true, filename = true, file_row_number = true)"
                )
        places = _quoted(str(self.folder.resolve())), _quoted(str(self.folder))
        connection.execute(f"SET allowed_directories = [{', '.join(places)}]")
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")
        return connection

    def chain(self, links: int, number: int, mobility: int = 1) -> MechanismGraph:
        """Return one chain of a family by its number, from 0, in the order of parts and rows.

        `SpecError` for a family that is not there or a number that is not below its chains; `FormatError` if the
        manifest is damaged.
        """
        from graphsynth.atlas.dataset_parts import TOGETHER
        from graphsynth.structure.graph import MechanismGraph

        parquet = need("pyarrow.parquet", "parquet", "A data set")
        family = self._rows.get((mobility, links))
        if family is None:
            raise SpecError(f"the data set has no chains of mobility {mobility} with {links} links; build them")
        if not 0 <= number < family["rows"]["chains"]:
            raise SpecError(f"number = {number} must be one of the {family['rows']['chains']} chains, from 0")
        for own in family["parts"]:
            if number < own["rows"]["chains"]:
                file = parquet.ParquetFile(_place(self.folder, "chains", mobility, links, own["part"]))
                column = file.read_row_group(number // TOGETHER, ["graph6"])["graph6"]
                return MechanismGraph.from_graph6(column[number % TOGETHER].as_py())
            number -= own["rows"]["chains"]
        raise FormatError(f"the manifest of {self.folder} is damaged: build the data set anew")

    def _files(self, table: str) -> Iterator[Path]:
        """Yield the files of a table that hold rows."""
        for (mobility, links), family in self._rows.items():
            for own in family["parts"]:
                if own["rows"][table]:
                    yield _place(self.folder, table, mobility, links, own["part"])

    def verify(self) -> FilesCheck:
        """Compare files with their checksums, and numbers of chains with what was counted without listing.

        The sum of ``links! / automorphisms``, the chains with named links, is computed anew from the files.
        """
        from graphsynth.atlas.dataset_parts import labelled_of

        parquet = need("pyarrow.parquet", "parquet", "A data set")
        wrong, files, rows = [], 0, 0
        for (mobility, links), family in self._rows.items():
            name = f"mobility {mobility}, {links} links"
            labelled, chains = 0, 0
            for own in family["parts"]:
                for table, digest in own["sha256"].items():
                    path = _place(self.folder, table, mobility, links, own["part"])
                    files += 1
                    data = path.read_bytes() if path.exists() else b""
                    if sha256(data).hexdigest() != digest:
                        wrong.append(f"{path} {'is not as it was made' if data else 'is missing'}")
                    elif table == "chains":
                        orders = parquet.read_table(io.BytesIO(data), columns=["automorphisms"])["automorphisms"]
                        labelled += labelled_of(links, orders.to_numpy())
                        chains += len(orders)
                    rows += own["rows"][table]
            if (chains, str(labelled)) != (family["counted"], family["labelled"]):
                wrong.append(f"{name}: {chains} chains, {labelled} with named links; counted {family['counted']}")
        return FilesCheck(tuple(wrong), files, rows)


def dataset(links: int | Iterable[int], folder: str | Path = "dataset", **options: Any) -> Dataset:
    """Open a data set; chains with these numbers of links are made first where they are not there.

    Parameters
    ----------
    links, folder, **options
        As for `Dataset.build`.

    Returns
    -------
    Dataset

    Examples
    --------
    >>> dataset(8).query("SELECT girth, count(*) AS chains FROM chains GROUP BY girth")  # doctest: +SKIP
    """
    return Dataset.build(folder, [links] if isinstance(links, int) else links, **options)


def _quoted(text: str) -> str:
    """Write text as SQL does."""
    return "'" + text.replace("'", "''") + "'"


def _read(family: dict[str, Any]) -> dict[str, Any]:
    """Look at what a manifest says of a family; what is damaged raises ValueError, KeyError or TypeError."""
    counts = [family["mobility"], family["links"], family["counted"], *(family["rows"][table] for table in TABLES)]
    int(family["labelled"])
    for part in family["parts"]:
        counts += [part["part"], *(part["rows"][table] for table in TABLES)]
        if not set(part["sha256"]) <= set(TABLES):
            raise ValueError(f"tables {', '.join(part['sha256'])}")
    if wrong := [own for own in counts if not isinstance(own, int) or own < 0]:
        raise ValueError(f"{wrong[0]!r} where a number is expected")
    return family


def _place(folder: Path, table: str, mobility: int, links: int, part: int) -> Path:
    return folder / table / f"mobility={mobility}" / f"links={links}" / f"part-{part:05d}.parquet"


def _write_manifest(folder: Path, families: list[dict[str, Any]]) -> None:
    document = {"version": _FORM, **_ABOUT, "families": families}
    with replacing(folder / _MANIFEST) as fresh:
        fresh.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


@dataclass
class _Family:
    """A family that is made: its parts that are there stand in a journal of one line each."""

    folder: Path
    mobility: int
    links: int
    fractionated: bool
    mechanisms: bool

    def make(
        self, executor: Executor | None, shard: tuple[int, int] | None, watch: Callable[[BuildStep], None] | None
    ) -> None:
        """Make the parts that are missing; complete the family unless a shard is asked for."""
        from graphsynth.atlas.dataset_parts import jobs_of, make_part
        from graphsynth.atlas.making import expected_of, fingerprint, problem_of, tasks_of
        from graphsynth.core.ordered import in_order
        from graphsynth.synthesis.shards import checked

        problem = problem_of(self.links, self.mobility, self.fractionated)
        tasks = tasks_of(self.links, self.mobility, self.fractionated)
        if not tasks:
            return
        cut = f"{_FORM} {fingerprint(problem, tasks)}{'+' if self.mechanisms else '-'}"
        jobs = jobs_of(tasks, self.mechanisms)
        done = self._done(cut)
        i, m = (1, 1) if shard is None else checked(shard)
        left = [job for job in jobs[(i - 1) * len(jobs) // m : i * len(jobs) // m] if job.number not in done]
        chains = sum(own["rows"]["chains"] for own in done.values())
        for part in in_order(executor, make_part, left):
            for table, data in part.tables.items():
                path = _place(self.folder, table, self.mobility, self.links, part.number)
                path.parent.mkdir(parents=True, exist_ok=True)
                with replacing(path) as fresh:
                    fresh.write_bytes(data)
            done[part.number] = part.record()
            with self._journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"cut": cut, **done[part.number]}) + "\n")
            chains += part.rows["chains"]
            if watch:
                watch(BuildStep(self.mobility, self.links, chains, len(done) / len(jobs)))
        if shard is None:
            counted = expected_of(problem, executor)
            if chains != counted:
                raise GraphsynthError(f"the parts hold {chains} chains, but counting gives {counted}: build them anew")
            self._complete([done[number] for number in sorted(done)], counted)

    @property
    def _journal(self) -> Path:
        return self.folder / f"parts-{self.mobility}-{self.links}.jsonl"

    def _done(self, cut: str) -> dict[int, dict[str, Any]]:
        """Return what the journal says of parts that are there; a line that was not finished says nothing."""
        found: dict[int, dict[str, Any]] = {}
        if not self._journal.exists():
            return found
        for line in self._journal.read_text(encoding="utf-8").splitlines():
            try:
                own = json.loads(line)
            except ValueError:
                continue
            if own.pop("cut", None) != cut:
                raise GraphsynthError(
                    f"{self.folder} holds chains of mobility {self.mobility} with {self.links} links made otherwise "
                    "(by another version, with or without mechanisms or fractionated chains): name another folder"
                )
            places = (_place(self.folder, table, self.mobility, self.links, own["part"]) for table in own["sha256"])
            if all(place.exists() for place in places):
                found[own["part"]] = own
        return found

    def _complete(self, parts: list[dict[str, Any]], counted: int) -> None:
        """Write the family into the manifest."""
        data = Dataset(self.folder)
        rows = {table: sum(own["rows"][table] for own in parts) for table in TABLES}
        labelled = str(sum(int(own["labelled"]) for own in parts))
        mine: dict[str, Any] = {"mobility": self.mobility, "links": self.links, "fractionated": self.fractionated}
        mine |= {"counted": counted, "rows": rows, "labelled": labelled, "parts": parts}
        others = [own for key, own in data._rows.items() if key != (self.mobility, self.links)]
        _write_manifest(self.folder, sorted([*others, mine], key=lambda own: (own["mobility"], own["links"])))
