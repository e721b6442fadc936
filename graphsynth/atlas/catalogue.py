"""A catalogue of kinematic chains in one file: build, open, ask, check, hand on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from graphsynth.atlas.building import BuildStep
from graphsynth.atlas.opened import OpenCatalogue
from graphsynth.atlas.schema import connect, readable, settle
from graphsynth.core.errors import FormatError, SpecError

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.atlas.evaluating import EvaluationStep
    from graphsynth.atlas.evaluations import Evaluation
    from graphsynth.atlas.verifying import Verification
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.structure.graph import MechanismGraph


class SearchOptions(TypedDict, total=False):
    """How dimensions are searched for."""

    seed: int
    tries: int


class Catalogue(OpenCatalogue):
    """A catalogue file, open for questions.

    Parameters
    ----------
    path : str or Path
        A file made by :meth:`build`; opened read-only.

    Raises
    ------
    FormatError
        If the file is missing or is no catalogue.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> folder = tempfile.TemporaryDirectory()
    >>> with Catalogue.build(pathlib.Path(folder.name) / "small.sqlite", links=range(4, 9, 2)) as small:
    ...     print(len(small), small.query("chains", "links = 6")["key"].tolist())
    19 ['1BgMw8g', '1BgOB7A']
    >>> folder.cleanup()
    """

    @classmethod
    def build(
        cls,
        path: str | Path,
        links: Iterable[int],
        mobility: int = 1,
        *,
        fractionated: bool = False,
        executor: Executor | None = None,
        shard: tuple[int, int] | None = None,
        watch: Callable[[BuildStep], None] | None = None,
    ) -> Catalogue:
        """Make a catalogue, or go on with one: all chains of a mobility with these numbers of links, once each.

        Parameters
        ----------
        path : str or Path
            Made if it does not exist; a family that is there is not made again, an interrupted one is continued.
        links : iterable of int
            Numbers of links, 18 at most; those without a chain of this mobility are passed over.
        mobility : int
        fractionated : bool
            For mobility >= 2: include chains that one link or joint holds together.
        executor : concurrent.futures.Executor, optional
            Who computes the facts; one process writes.  The file holds the same rows for any.
        shard : (int, int), optional
            Part i of m of every family; labels are given when the parts are merged.
        watch : callable, optional
            Called with a :class:`BuildStep` after every piece.

        Raises
        ------
        SpecError, TooLargeError
            For numbers out of their bounds.
        FormatError
            If the file is no catalogue.
        GraphsynthError
            If the file cannot be written, or holds a family in another way.
        """
        from graphsynth.atlas.making import make

        with readable(Path(path)):
            make(Path(path), links, mobility, fractionated, executor, shard, watch)
        return cls(path)

    @classmethod
    def merge(cls, path: str | Path, parts: Iterable[str | Path]) -> Catalogue:
        """Make one catalogue of its shards; the same rows, numbers and labels as built in one piece.

        Parameters
        ----------
        path : str or Path
            A new file.
        parts : iterable of str or Path
            Files built with ``shard=(i, m)``: every part of every family, once.

        Raises
        ------
        GraphsynthError
            If a piece is missing or twice there, or the file exists; the message names the shard.
        """
        from graphsynth.atlas.merging import merge

        with readable(Path(path)):
            merge(Path(path), [Path(part) for part in parts])
        return cls(path)

    @classmethod
    def shipped(cls) -> Catalogue:
        """Open the catalogue that comes with the project: all planar chains of mobility 1 to 4 with up to ten links.

        Raises
        ------
        FormatError
            If it is not installed.
        """
        own = Path(__file__).parent
        for path in (own / "shipped.sqlite", own.parents[1] / "catalog" / "up-to-10-links.sqlite"):
            if path.is_file():
                return cls(path)
        raise FormatError(
            "the shipped catalogue is not installed; build one with 'graphsynth catalog build'", "shipped"
        )

    def chain(self, name: str) -> MechanismGraph:
        """Return a chain by its key or its label.

        Raises
        ------
        SpecError
            If the catalogue does not hold it.
        """
        from graphsynth.structure.graph import MechanismGraph

        with self.reading():
            return MechanismGraph.from_key(self._fetch(name)["key"])

    def _fetch(self, name: str) -> dict[str, Any]:
        found = self._ask("SELECT * FROM chains WHERE key = ? OR label = ?", (name, name))
        if not found.rows:
            raise SpecError(f"no chain {name!r} in {self.path.name}; give a key or a label such as 1.8.4-4.1")
        return dict(zip(found.columns, found.rows[0]))

    def entry(self, name: str) -> dict[str, Any]:
        """Return everything the catalogue knows of a chain, given by key or label, ready for JSON.

        Mechanisms list their evaluations; kinds that were not evaluated say ``"not computed"``.

        Raises
        ------
        SpecError
            If the catalogue does not hold it.
        """
        from graphsynth.atlas.stored import entry

        with self.reading():
            return entry(self.connection, self._fetch(name))

    def record(self, evaluations: Iterable[Evaluation]) -> int:
        """Store evaluations of mechanisms, one for each mechanism and kind (a new one replaces the old).

        Returns
        -------
        int
            How many were stored.

        Raises
        ------
        SpecError
            For a mechanism that the catalogue does not hold, or a value that is not a number or None.
        GraphsynthError
            If the file cannot be written.
        """
        from graphsynth.atlas.evaluations import record

        with readable(self.path), self._written():
            return record(self.path, evaluations)

    @contextmanager
    def _written(self) -> Iterator[None]:
        """Leave one plain file after writing: the log of a killed process goes when nobody reads, this one included."""
        try:
            yield
        finally:
            real = self.path.resolve()
            if real.with_name(real.name + "-wal").exists():
                with self._turn:
                    self.connection.close()
                    with closing(connect(self.path)) as connection:
                        settle(connection)
                    self.connection = connect(self.path, readonly=True)

    def evaluate(
        self,
        links: Iterable[int] | None = None,
        mobility: Iterable[int] | None = None,
        *,
        per_chain: int = 1,
        limit: int | None = None,
        jamming: tuple[float, float] | None = None,
        executor: Executor | None = None,
        watch: Callable[[EvaluationStep], None] | None = None,
        **search: Unpack[SearchOptions],
    ) -> int:
        """Give mechanisms dimensions with which they turn, and store these with their transmission and verdict.

        Each mechanism is stored as it is done; the same call goes on after an interruption.  Dimensions that were found
        stay; where none were, another seed or number of tries searches anew.

        Parameters
        ----------
        links, mobility : iterable of int, optional
            Families to evaluate; default all.
        per_chain : int
            So many mechanisms of each chain, those of the smallest groups first; 0: all.
        limit : int, optional
            Evaluate at most so many now.
        jamming : (tilt, joint_limit), optional
            Prove also whether the mechanism jams when the axis of its first driver is tilted by at most ``tilt``, in
            any direction, and every joint takes up ``joint_limit`` (radians, below 0.1; model L1).
        executor : concurrent.futures.Executor, optional
            Who computes; one process writes.  The same results for any.
        watch : callable, optional
            Called with an ``EvaluationStep`` after every mechanism.
        **search
            ``seed`` (0) and ``tries`` (4) of :func:`graphsynth.embody`, with its default goals: a full turn.

        Returns
        -------
        int
            Mechanisms evaluated now.  Dimensions are certified (one regular branch that closes) where python-flint is
            there and proves it, else estimated; transmission is estimated; a verdict is certified or undecided.

        Raises
        ------
        SpecError
            For values out of their bounds.
        GraphsynthError
            If the file cannot be written.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> folder = tempfile.TemporaryDirectory()
        >>> with Catalogue.build(pathlib.Path(folder.name) / "four.sqlite", links=[4]) as four:
        ...     four.evaluate(), four.evaluate()  # the second call finds nothing to do
        (1, 0)
        >>> folder.cleanup()
        """
        from graphsynth.atlas.evaluating import Settings, evaluate

        settings = Settings(**search)
        if jamming is not None:
            settings = replace(settings, tilt=jamming[0], joint_limit=jamming[1])
        with readable(self.path), self._written():
            return evaluate(self.path, links, mobility, per_chain, limit, settings, executor, watch)

    def mechanism(self, name: str, frame: int | None = None, driver: int | str | None = None) -> Mechanism:
        """Return a stored mechanism of a chain, given by key or label: with several, that of the best transmission.

        Parameters
        ----------
        name : str
        frame : int, optional
        driver : int or str, optional
            As in the table of mechanisms.

        Returns
        -------
        Mechanism
            Exactly as stored; what is known of it stands in the table ``evaluations``.

        Raises
        ------
        SpecError
            If no dimensions are stored; the message says how to have them computed.
        FormatError
            If the file is damaged.

        Examples
        --------
        >>> with Catalogue.shipped() as shipped:
        ...     mechanism = shipped.mechanism("1.8.4-4.1")
        >>> mechanism.graph.links, len(mechanism.drivers)
        (8, 1)
        """
        from graphsynth.atlas.stored import stored_mechanisms
        from graphsynth.mechanism.model import Mechanism

        chain = self._fetch(name)
        with self.reading():
            for own in stored_mechanisms(self.connection, chain["chain_id"]):
                if frame in (None, own.frame) and (driver is None or str(driver) == str(own.driver)):
                    return Mechanism.from_json(own.text)
        raise SpecError(
            f"no dimensions are stored for {chain['label'] or chain['key']} with this choice of frame and driver: have "
            "them computed by 'graphsynth catalog evaluate'"
        )

    def completeness(self) -> pd.DataFrame:
        """Return the statement of completeness, one row for each family.

        Columns: ``mobility``, ``links``, ``fractionated``; ``listed``, chains in the file, every one with another key;
        ``counted``, by orbit counting without listing; ``published`` with its ``source`` (empty where nothing is);
        ``complete``, whether all that is there agrees.
        """
        from graphsynth.atlas.statement import completeness

        with self.reading():
            return completeness(self.connection)

    def verify(self, *, chains: int | None = None, seed: int = 0, quick: bool = False) -> Verification:
        """Recompute every stored field by another route and compare (exact), and the file with its seal.

        Parameters
        ----------
        chains : int, optional
            Only so many chains of each family, drawn at random; default all.
        seed : int
        quick : bool
            Compare the file with its seal only: every change of a byte is found, nothing is recomputed.

        Returns
        -------
        Verification
            How often each field was compared, and every difference.
        """
        from graphsynth.atlas.verifying import verify

        with self._turn:
            return verify(self.connection, chains, seed, quick)

    def digest(self) -> str:
        """Return a SHA-256 of the whole structural content, without internal numbers.

        Equal for two catalogues of the same families however they were built: at once, resumed, by any executor,
        or merged.  Evaluations are left out.
        """
        from graphsynth.atlas.exporting import digest

        with self.reading(screened=True):
            return digest(self.connection)

    def export(self, folder: str | Path, form: str = "csv") -> list[Path]:
        """Write the tables to a folder, one file each; equal catalogues give equal bytes.

        Parameters
        ----------
        folder : str or Path
            Made if it does not exist; files of the same name are replaced.
        form : {"csv", "jsonl", "parquet"}
            Parquet needs the extra ``parquet``.

        Returns
        -------
        list of Path

        Raises
        ------
        SpecError
            For another form, or a missing extra.
        FormatError
            If the file is damaged, or holds values of another form than its columns have.
        GraphsynthError
            If a file cannot be written.
        """
        from graphsynth.atlas.exporting import export

        with self.reading(screened=True):
            return export(self.connection, Path(folder), form)
