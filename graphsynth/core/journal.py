"""A file that keeps the results of long work piece by piece, so that the same command goes on after any interruption.

The first line says which work it is: its kind, its title, and a digest of the question, of the version and of the cut
into pieces.  Every further line holds the number of a piece, a checksum, and its result; they are written in the order
of the pieces.  A last line that was cut short does not count, a line that stands there twice counts once, and any other
line that does not belong there is refused.  The file is locked while it is written: a second writer is refused.
"""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from itertools import accumulate, takewhile
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import graphsynth
from graphsynth.core.errors import FormatError, GraphsynthError

#: What the system says of a full disk or a used-up quota.
FULL = (errno.ENOSPC, errno.EDQUOT)

_FORMAT = 1
_LINE = re.compile(rb'\{"piece": ([0-9]{1,12}), "check": "([0-9a-f]{16})", "value": (.+)\}')


@dataclass(frozen=True, slots=True)
class Work:
    """What a journal is of, and what is said when it cannot be used."""

    kind: str  # for people, such as "count"
    title: str  # the question, for people
    digest: str  # of all that the results of the pieces, their number and their order depend on; see `digest_of`
    piece: str = "piece"  # what one is called
    foreign: str = "belongs to another question or version"
    remedy: str = "give the same options, or name another file"
    place: str = "name another file"  # what to do if the file cannot be written
    again: str = "the same command"  # goes on with interrupted work
    error: type[GraphsynthError] = GraphsynthError


def digest_of(*parts: object) -> str:
    """Return a short text that differs when the parts, seen as text, or the version of graphsynth differ."""
    return sha256(repr((_FORMAT, graphsynth.__version__, *map(str, parts))).encode()).hexdigest()[:16]


@contextmanager
def writing(
    what: object, remedy: str, kind: type[GraphsynthError] = GraphsynthError, again: str = "the same command"
) -> Iterator[None]:
    """Turn what the system says of a place that cannot be written into one sentence with the remedy.

    >>> with writing("out", "choose another folder"):
    ...     raise PermissionError(errno.EACCES, "Permission denied")
    Traceback (most recent call last):
    graphsynth.core.errors.GraphsynthError: cannot write out: Permission denied; choose another folder
    """
    try:
        yield
    except OSError as error:
        full = f"free some space and give {again} again, or " if error.errno in FULL else ""
        raise kind(f"cannot write {what}: {error.strerror or error}; {full}{remedy}") from error


class Journal:
    """The results of one work, kept in a file, which is made if it is not there; without a path nothing is kept.

    ``over`` says whether work of which these are the results is over, so that the file is begun anew, whatever it is
    of; ``fresh`` begins it anew, whatever it is.  ``entries`` are the results that are there: those of the first
    pieces, in order.  The error of the work is raised if another process writes the file, it belongs to another
    question, or it cannot be written; `FormatError` if it is no journal, or somebody changed it.
    """

    def __init__(
        self,
        path: Path | None,
        work: Work,
        over: Callable[[Sequence[str]], bool] = lambda entries: False,
        fresh: bool = False,
    ) -> None:
        self.path = path
        self.work = work
        self.entries: tuple[str, ...] = ()
        self._ends: list[int] = []  # of the first line and of each entry in the file
        self._stream: BinaryIO | None = None
        if path is None:
            return
        self._stream = self._opened(path)
        try:
            self._begin(path, over, fresh)
        except BaseException:
            self.close()
            raise

    def _opened(self, path: Path) -> BinaryIO:
        """Open the file and lock it; another one may have taken its place before it was locked."""
        while True:
            with self.writing(path):
                stream = path.open("a+b")
            if not _lock(stream):
                stream.close()
                raise self.work.error(f"{path} is being written by another process: wait until that ends")
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(stream.fileno()), path.stat()):
                    return stream
            stream.close()

    def _begin(self, path: Path, over: Callable[[Sequence[str]], bool], fresh: bool) -> None:
        """Read what is there, or begin the file."""
        assert self._stream is not None
        self._stream.seek(0)
        data = b"" if fresh else self._stream.read()
        whole = data[: data.rfind(b"\n") + 1]
        if whole:
            try:
                head = json.loads(whole.partition(b"\n")[0])
                known, owner, title = head["journal"] == _FORMAT, str(head["question"]), str(head["title"])
            except (ValueError, LookupError, TypeError, RecursionError):
                known = False
            if not known:
                raise FormatError(f"not a journal of graphsynth; {self.work.remedy}", str(path))
            entries = _entries(whole, owner, path, self.work)
            if not over(entries):
                if owner != self.work.digest:
                    raise self.work.error(f"{path} (of {title}) {self.work.foreign}; {self.work.remedy}")
                self._take(data, whole[: whole.index(b"\n") + 1], entries)
                return
        own = {"journal": _FORMAT, "of": self.work.kind, "title": self.work.title, "question": self.work.digest}
        first = json.dumps(own, ensure_ascii=False).encode() + b"\n"
        if not whole and not first.startswith(data):
            raise FormatError(f"not a journal of graphsynth; {self.work.remedy}", str(path))
        self._cut(0)
        self._write(first)
        self._ends = [len(first)]

    def _take(self, data: bytes, head: bytes, entries: list[str]) -> None:
        """Go on with these entries; what is torn or doubled leaves the file."""
        lines = [self._line(number, entry) for number, entry in enumerate(entries, 1)]
        self.entries, self._ends = tuple(entries), list(accumulate(map(len, lines), initial=len(head)))
        clean = head + b"".join(lines)
        if data != clean:
            same = takewhile(lambda pair: pair[0] == pair[1], zip(data.splitlines(keepends=True)[1:], lines))
            kept = len(head) + sum(len(line) for line, _ in same)
            self._cut(kept)
            self._write(clean[kept:])

    def _line(self, number: int, value: str) -> bytes:
        check = _check(self.work.digest, number, value.encode())
        return f'{{"piece": {number}, "check": "{check}", "value": {value}}}\n'.encode()

    def append(self, value: str) -> None:
        """Keep the result of the next piece, one line of JSON; it is in the file when this returns.

        If it cannot be written, such as on a full disk, what is there stays, and the same command goes on from it.
        """
        if self._stream is not None:
            line = self._line(len(self._ends), value)
            self._write(line)
            self._ends.append(self._ends[-1] + len(line))

    def keep(self, count: int) -> None:
        """Drop the results behind the first ones that were there when the file was opened."""
        if count < len(self.entries):
            self._cut(self._ends[count])
            self.entries, self._ends = self.entries[:count], self._ends[: count + 1]

    def writing(self, path: Path) -> AbstractContextManager[None]:
        """Say in one sentence why a file of the work cannot be written."""
        return writing(path, self.work.place, self.work.error, self.work.again)

    def close(self) -> None:
        """Let others write the file."""
        if self._stream is not None:
            with suppress(OSError):  # of a full disk: told when the line was appended
                self._stream.close()
            self._stream = None

    def remove(self) -> None:
        """Delete the file, as its work is over."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)  # while it is locked: nobody else goes on with it
        self.close()

    def _write(self, data: bytes) -> None:
        assert self._stream is not None and self.path is not None
        with self.writing(self.path):
            self._stream.write(data)
            self._stream.flush()

    def _cut(self, size: int) -> None:
        assert self._stream is not None and self.path is not None
        with self.writing(self.path):
            self._stream.truncate(size)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def _entries(data: bytes, owner: str, path: Path, work: Work) -> list[str]:
    """Return the results of the pieces."""
    found: list[str] = []
    checks: list[str] = []
    head, *lines = data.split(b"\n")[:-1]
    for place, line in enumerate(lines, 2):
        match = _LINE.fullmatch(line)
        number, check = (int(match[1]), match[2].decode()) if match else (0, "")
        if line == head or (0 < number <= len(checks) and check == checks[number - 1]):
            continue  # written twice
        if not match or number != len(found) + 1 or check != _check(owner, number, match[3]):
            remedy = f"{work.remedy}, or delete this line and all behind it"
            raise FormatError(f"not the result of {work.piece} {len(found) + 1}; {remedy}", f"{path}, line {place}")
        checks.append(check)
        found.append(match[3].decode())
    return found


def _check(question: str, number: int, value: bytes) -> str:
    return sha256(f"{question} {number} ".encode() + value).hexdigest()[:16]


def _lock(stream: BinaryIO) -> bool:
    """Lock a file for this process until it is closed; False if another one has it."""
    try:
        try:
            import fcntl
        except ImportError:  # Windows
            import msvcrt

            stream.seek(1 << 40)  # behind the end: the lock does not keep anybody from reading
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        # a file system without locks is used as it is: two writers would write the same lines twice, which count once
        return error.errno not in (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
    return True
