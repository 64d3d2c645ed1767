"""The rows of a batch as work for processes: what is to be made, how it is checked, and what is lost begun again.

A row's pages depend on the batch, the row and the versions of the program alone, so that it does not matter which
process makes them, nor how often: what a lost process was making is made again by another.  Rows are taken in their
order, and while none is taken no more are begun than are ahead already.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import socket
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from handout.errors import HandoutError, InputError
from handout.hand import library
from handout.networks import one_thread
from handout.pipeline.merging import Account, RowPages
from handout.pipeline.texts import program
from handout.printing.prepared import Prepare, PreparedRow, prepare_row
from handout.printing.rows import Row

AHEAD = 2  # rows begun for every process: one that it makes, one that waits for it
_MOST_LOST = 5  # times that processes are lost while one row is waited for: then the row is to blame, or the machine


class WorkersLost(HandoutError):
    """The processes that make rows end again and again, or cannot be reached any more."""

    exit_code = 3


@dataclass(frozen=True)
class MadeRow:
    """A row as a process gives it back: what its destination takes, and what was written for it."""

    row: PreparedRow
    account: Account


@dataclass(frozen=True)
class RowWork:
    """How a batch makes its rows; it can be pickled.

    drawn : whether pages are drawn to be checked, too, since only strokes tell whether a machine reaches them.
    folder : in which names of files are meant; hands : the digests of the hands' files by their names.
    """

    pages: RowPages
    prepare: Prepare
    drawn: bool = False
    folder: Path = field(default_factory=Path.cwd)
    hands: tuple[tuple[str, str], ...] = ()
    program: str = field(default_factory=program)

    @one_thread  # in every process: as many are at work as there are processors, and sums come out alike
    def make(self, row: Row) -> MadeRow:
        """The pages of a row."""
        return MadeRow(prepare_row(self.pages, self.prepare, row), self.pages.settled())

    @one_thread
    def check(self, row: Row) -> MadeRow:
        """Whether a row can be made: as `make`, but without its pages."""
        if self.drawn or row.problem:
            made = self.make(row).row
            return MadeRow(PreparedRow(row.number, (), made.warnings, made.problem), Account())
        try:
            self.pages.check(row)
        except InputError as error:
            return MadeRow(PreparedRow(row.number, (), row.warnings, str(error)), Account())
        return MadeRow(PreparedRow(row.number, (), row.warnings), Account())

    def verify(self) -> None:
        """Refuse a machine on which the pages could come out otherwise."""
        if program() != self.program:
            raise InputError(f"{socket.gethostname()} runs {program()}, and this is {self.program}: install the same.")
        if not self.folder.is_dir():
            raise InputError(f"{socket.gethostname()} has no folder {self.folder}: its workers have to see its files.")
        for name, digest in self.hands:
            if _digest(name) != digest:
                raise InputError(f"{socket.gethostname()} has another hand {name}, or none: give its workers this one.")


def row_work(pages: RowPages, prepare: Prepare, drawn: bool = False) -> RowWork:
    """The work of a batch, with what other machines have to have."""
    own = pages.writing.hand
    names = {pages.merge.fields.manner(row).hand for row in pages.merge.table} | {own if isinstance(own, str) else ""}
    digests = {name: _digest(name) for name in sorted(names - {""})}
    return RowWork(pages, prepare, drawn, hands=tuple(digests.items()))


def _digest(name: str) -> str:
    """Of the file of a hand; "" where there is none."""
    try:
        return hashlib.sha256(library.path(name).read_bytes()).hexdigest()
    except (InputError, OSError):
        return ""


class Remote:
    """Rows that other processes make, a few ahead; those that are lost with their process are begun again."""

    def __init__(self, work: RowWork) -> None:
        self._work = pickle.dumps(work)

    @property
    def ahead(self) -> int:
        """How many rows are begun before the first of them is taken."""
        raise NotImplementedError

    def submit(self, row: Row, check: bool) -> Any:
        """Begin a row; a future."""
        raise NotImplementedError

    def result(self, future: Any) -> MadeRow | None:
        """Wait for a row; None where it was lost with its process."""
        raise NotImplementedError

    def recover(self, waiting: deque[tuple[Row, Any]]) -> Iterable[bool]:
        """After a loss, which of the rows that are begun have to be begun again."""
        raise NotImplementedError

    def each(self, rows: Iterable[Row], check: bool = False) -> Iterator[MadeRow]:
        """See `Workers`."""
        source, waiting = iter(rows), deque[tuple[Row, Any]]()
        while True:
            while len(waiting) < self.ahead and (row := next(source, None)) is not None:
                waiting.append((row, self.submit(row, check)))
            if not waiting:
                return
            yield self._first(waiting, check)

    def _first(self, waiting: deque[tuple[Row, Any]], check: bool) -> MadeRow:
        """The first of the rows that are begun, when it is made."""
        for _ in range(_MOST_LOST):
            made = self.result(waiting[0][1])
            if made is not None:
                waiting.popleft()
                return made
            for at, again in enumerate(list(self.recover(waiting))):
                if again:
                    row = waiting[at][0]
                    waiting[at] = row, self.submit(row, check)
        raise WorkersLost(
            f"The processes that make row {waiting[0][0].number} ended {_MOST_LOST} times, perhaps for want of memory: "
            "use fewer --jobs, or on a cluster fewer workers a machine."
        )


_ONE_AT_A_TIME = threading.Lock()  # a worker of a cluster may have several threads


def made_from(work: bytes, row: Row, check: bool) -> MadeRow:
    """Make or check a row in this process, which loads the hands of a batch once."""
    with _ONE_AT_A_TIME:
        own = _loaded(work)
        with contextlib.chdir(own.folder):
            return own.check(row) if check else own.make(row)


@lru_cache(maxsize=1)
def _loaded(work: bytes) -> RowWork:
    own = pickle.loads(work)
    assert isinstance(own, RowWork)
    own.verify()
    return own
