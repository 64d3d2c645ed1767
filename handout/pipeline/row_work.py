"""The rows of a batch as work for this process, for several, or for a cluster; what is lost is begun again.

The pages of a row depend on the batch, the row and the versions of the program alone, so that any process may make
them, and what a lost process was making another makes again.  Rows are taken in their order; while none is taken, no
more are begun.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import multiprocessing
import os
import pickle
import signal
import socket
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any, Self

from handout.errors import HandoutError, InputError
from handout.hand import library
from handout.networks import one_thread
from handout.pipeline.merging import PageFinding, RowAccount, RowPages
from handout.pipeline.options import TableOptions
from handout.pipeline.results import Delivery, Listener
from handout.pipeline.texts import program
from handout.printing.batch import BatchOptions, make_rows
from handout.printing.journal import Journal
from handout.printing.prepared import Destination, Prepare, PreparedRow, prepare_row
from handout.printing.rows import TableRow, name_rows
from handout.printing.sending import Report

AHEAD = 2  # rows begun for every process: one that it makes, one that waits for it
_MOST_LOST = 5  # times that processes are lost while one row is waited for: then the row is to blame, or the machine

_ENDING = 5.0  # s that a pool may take to end
_PRELOADED = ("pipeline.printing", "inking.pens", "motion.trace", "motion.optimal_control")
_OF_SCANNED = ("inking.pen_replacement", "writing.glyph_index", "completion.letters")

_ANSWER = 10.0  # s that a scheduler may take to answer
_PATIENCE = 30.0  # s without a row after which somebody is told
_LOOK = 5.0  # s for which the number of workers is taken as known
_MOST = 1024  # rows that are ahead at most, however large the cluster is: they are kept in memory


class WorkersLost(HandoutError):
    """The processes that make rows end again and again, or cannot be reached any more."""

    exit_code = 3


@dataclass(frozen=True)
class MadeRow:
    """A row as a process gives it back: what its destination takes, and what was written for it."""

    row: PreparedRow
    account: RowAccount


@dataclass(frozen=True)
class RowWork:
    """How a batch makes its rows; it can be pickled.

    drawn : whether a check draws the pages, since only strokes tell whether a machine reaches them.
    folder : where names of files are looked up; hands : names of hands and the digests of their files.
    """

    pages: RowPages
    prepare: Prepare
    drawn: bool = False
    folder: Path = field(default_factory=Path.cwd)
    hands: tuple[tuple[str, str], ...] = ()
    program: str = field(default_factory=program)

    @one_thread  # in every process: as many are at work as there are processors, and sums come out alike
    def make(self, row: TableRow) -> MadeRow:
        """The pages of a row."""
        return MadeRow(prepare_row(self.pages, self.prepare, row), self.pages.settle())

    @one_thread
    def check(self, row: TableRow) -> MadeRow:
        """Whether a row can be made: as `make`, but without its pages."""
        if self.drawn or row.problem:
            made = self.make(row).row
            return MadeRow(PreparedRow(row.number, (), made.warnings, made.problem), RowAccount())
        try:
            self.pages.check(row)
        except InputError as error:
            return MadeRow(PreparedRow(row.number, (), row.warnings, str(error)), RowAccount())
        return MadeRow(PreparedRow(row.number, (), row.warnings), RowAccount())

    def make_each(self, rows: Iterable[TableRow], check: bool = False) -> Iterator[MadeRow]:
        """Make rows in this process, or check them; one after the other in their order, as they are asked for."""
        for row in rows:
            yield self.check(row) if check else self.make(row)

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
    """The work of a batch, with the digests of the hands that other machines must have, too."""
    own = pages.writing.hand
    names = {pages.merge.fields.manner(row).hand for row in pages.merge.table} | {own if isinstance(own, str) else ""}
    digests = {name: _digest(name) for name in sorted(names - {""})}
    return RowWork(pages, prepare, drawn, hands=tuple(digests.items()))


def _digest(name: str) -> str:
    """The digest of the file of a hand; "" where there is none."""
    try:
        return hashlib.sha256(library.path(name).read_bytes()).hexdigest()
    except (InputError, OSError):
        return ""


class Remote(ABC):
    """Rows that other processes make, a few ahead; those that are lost with their process are begun again."""

    def __init__(self, work: RowWork) -> None:
        self._work = pickle.dumps(work)

    @property
    @abstractmethod
    def ahead(self) -> int:
        """How many rows are begun before the first of them is taken."""

    @abstractmethod
    def submit(self, row: TableRow, check: bool) -> Any:
        """Begin a row; a future."""

    @abstractmethod
    def result(self, future: Any) -> MadeRow | None:
        """Wait for a row; None where it was lost with its process."""

    @abstractmethod
    def recover(self, waiting: deque[tuple[TableRow, Any]]) -> Iterable[bool]:
        """After a loss, which of the rows that are begun have to be begun again."""

    def make_each(self, rows: Iterable[TableRow], check: bool = False) -> Iterator[MadeRow]:
        source, waiting = iter(rows), deque[tuple[TableRow, Any]]()
        while True:
            while len(waiting) < self.ahead and (row := next(source, None)) is not None:
                waiting.append((row, self.submit(row, check)))
            if not waiting:
                return
            yield self._take_first(waiting, check)

    def _take_first(self, waiting: deque[tuple[TableRow, Any]], check: bool) -> MadeRow:
        """Wait for the first of the rows that are begun; begin again what is lost."""
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


def made_from(work: bytes, row: TableRow, check: bool) -> MadeRow:
    """Make or check a row in this process, which loads the hands of a batch once."""
    with _ONE_AT_A_TIME:
        own = _load_work(work)
        with contextlib.chdir(own.folder):
            return own.check(row) if check else own.make(row)


@lru_cache(maxsize=1)
def _load_work(work: bytes) -> RowWork:
    own = pickle.loads(work)
    assert isinstance(own, RowWork)
    own.verify()
    return own


@contextlib.contextmanager
def open_workers(work: RowWork, jobs: int, cluster: str, say: Callable[[str], object]) -> Iterator[RowWork | Remote]:
    """Processes for the rows of a batch: this one alone for 1 job; of the Dask cluster at an address, if one is given.

    Raises InputError: there is no such cluster, or not what talks to it.
    """
    if cluster:
        with ClusterWorkers(work, cluster, say) as workers:
            yield workers
    elif jobs > 1:
        with ProcessWorkers(work, jobs) as processes:
            yield processes
    else:
        yield work


class ProcessWorkers(Remote):
    """Processes of this machine."""

    def __init__(self, work: RowWork, jobs: int) -> None:
        super().__init__(work)
        self._jobs = jobs
        self._before = set(multiprocessing.active_children())
        names = multiprocessing.get_all_start_methods()
        # a server that has loaded the program forks them: a new process is there in no time
        self._context = multiprocessing.get_context("forkserver" if "forkserver" in names else "spawn")
        if "forkserver" in names:
            scanned = any(library.path(name).suffix == ".hand" for name, digest in work.hands if digest)
            needed = (f"handout.{name}" for name in (*_PRELOADED, *(_OF_SCANNED if scanned else ())))
            self._context.set_forkserver_preload([*needed, "scipy.ndimage"])
        self._pool = self._open_pool()

    def _open_pool(self) -> ProcessPoolExecutor:
        # the work goes to each process once: a pool that breaks while its queue is full would never end
        return ProcessPoolExecutor(self._jobs, self._context, _begin, (self._work,))

    def __enter__(self) -> ProcessWorkers:
        return self

    def __exit__(self, *exc: object) -> None:
        self._end()

    def _end(self) -> None:
        """End the processes, whatever they are at: what is still being made nobody wants any more."""
        # its thread may still write into a pipe that it closes: an interpreter that ends meanwhile prints a traceback
        manager = getattr(self._pool, "_executor_manager_thread", None)
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - self._before:
            process.kill()
        if manager is not None:
            manager.join(_ENDING)

    @property
    def ahead(self) -> int:
        return AHEAD * self._jobs

    def submit(self, row: TableRow, check: bool) -> Future[MadeRow]:
        try:
            with _unheard():
                return self._pool.submit(_make_row, row, check)
        except BrokenProcessPool as error:
            lost = Future[MadeRow]()
            lost.set_exception(error)
            return lost

    def result(self, future: Future[MadeRow]) -> MadeRow | None:
        try:
            return future.result()
        except (BrokenProcessPool, CancelledError):
            return None

    def recover(self, waiting: deque[tuple[TableRow, Any]]) -> Iterator[bool]:
        """A pool that has lost a process ends; a new one goes on with what it had not made."""
        self._end()
        wait([future for _, future in waiting], _ENDING)
        self._pool = self._open_pool()
        for _, future in waiting:
            lost = future.cancelled() or not future.done()
            yield lost or isinstance(future.exception(), BrokenProcessPool)


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    """A block whose new processes never hear Ctrl-C: this process hears it, and ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class ClusterWorkers(Remote):
    """The workers behind the scheduler at an address, as many as there are from time to time."""

    def __init__(self, work: RowWork, address: str, say: Callable[[str], object]) -> None:
        """`say` hears of it when nobody works.

        Raises InputError: no scheduler answers there, or what talks to it is not installed.
        """
        super().__init__(work)
        try:
            self._distributed: Any = import_module("distributed")
        except ImportError as error:
            raise InputError("--cluster needs the extra cluster: pip install 'handout-driver[cluster]'.") from error
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what becomes of workers is said here
        self._address, self._say = address, say
        self._workers, self._looked = 0, float("-inf")
        try:
            self._client = self._distributed.Client(address, timeout=_ANSWER, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"--cluster: no scheduler answers at {address}: start one with dask scheduler, and workers with dask "
                "worker --nthreads 1."
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self._client.close()  # which gives up what is still being made

    @property
    def ahead(self) -> int:
        """See `Remote`; workers may come and go."""
        if time.monotonic() > self._looked + _LOOK:
            self._workers, self._looked = self._present(), time.monotonic()
        return min(AHEAD * max(self._workers, 1), _MOST)

    def _present(self) -> int:
        return len(self._client.scheduler_info(n_workers=-1)["workers"])

    def submit(self, row: TableRow, check: bool) -> Any:
        # what a lost worker was making the scheduler gives to another by itself
        return self._client.submit(made_from, self._work, row, check, pure=False)

    def result(self, future: Any) -> MadeRow | None:
        told = False
        while True:
            try:
                made = future.result(timeout=_PATIENCE)
                assert isinstance(made, MadeRow)
                return made
            except TimeoutError:
                if not told and self._client.status == "running" and not self._present():
                    self._say(f"The cluster {self._address} has no worker at present: waiting for one.")
                    told = True
            except (self._distributed.KilledWorker, CancelledError):  # with several workers, or the scheduler
                return None

    def recover(self, waiting: deque[tuple[TableRow, Any]]) -> Sequence[bool]:
        if self._client.status != "running":
            raise WorkersLost(f"The scheduler at {self._address} cannot be reached any more.")
        return [future.status in ("error", "cancelled", "lost") for _, future in waiting]


_work = b""  # that this process does


def _begin(work: bytes) -> None:
    """Begin a process: it ends with the one that it works for, however that ends."""
    global _work
    _work = work

    def follow() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _make_row(row: TableRow, check: bool) -> MadeRow:
    return made_from(_work, row, check)


@dataclass(frozen=True, kw_only=True)
class BatchDelivery(Delivery):
    """What became of a table.

    destination : the queue, the printer or the plotter.
    calibration_note : a sentence on the calibration that the pages went through.
    letters : whether there are letters, besides envelopes or alone.
    """

    report: Report
    destination: str = ""
    calibration_note: str = ""
    letters: bool = False

    @property
    def shares(self) -> str:
        """Which rows each of several devices made; "" of one."""
        devices = self.report.devices
        return ", ".join(f"{name}: {name_rows(rows)}" for name, rows in devices.items()) if len(devices) > 1 else ""


def make_all(
    pages: RowPages,
    place: Destination,
    options: BatchOptions,
    run: tuple[TableOptions, Journal],
    *,
    drawn: bool = False,
    notes: Sequence[str] = (),
    found: dict[int, list[PageFinding]] | None = None,
    listener: Listener,
) -> BatchDelivery:
    """Make all rows of a batch, by as many processes as its options say; see `make_rows`.

    run : the options of the table, and the journal; drawn : see `RowWork`; notes : on all rows, made before.
    found : gets what is to be looked at on the pages of each row.
    """
    (table, record), account, merge = run, RowAccount(), pages.merge

    def count_made(check: bool, rows: Iterable[TableRow]) -> Iterator[PreparedRow]:
        for row in workers.make_each(rows, check):
            if new := account.add(row.account):  # what is to be said of several is said once
                listener.say(*new)
            if found is not None:
                found.update(row.account.findings)
            yield row.row

    with open_workers(row_work(pages, place.prepare, drawn), table.jobs, table.cluster, listener.say) as workers:
        make, check = partial(count_made, False), partial(count_made, True)
        report = make_rows(merge.table, make, place, options, record, tell=listener.progress, check=check)
    notes = [*notes, *account.dropped]
    told = {
        **account.tally.facts(pages.seed, pages.look().hand.name, report.files),
        "rows": len(report.rows),
        "failed": [asdict(failure) for failure in report.failed],
        "jobs": [job.name for job in report.jobs],
        **({"devices": report.devices} if len(report.devices) > 1 else {}),
        "warnings": list(report.warnings),
        "before": list(report.before),
        "unknown": [asdict(row) for row in report.unknown],
        "columns": {**merge.table.facts()},
        **({"notes": notes} if notes else {}),
    }
    counted: dict[str, Any] = {"tally": account.tally, "seed": pages.seed, "files": tuple(report.files), "told": told}
    return BatchDelivery(**counted, report=report, letters=merge.with_letters, notes=tuple(notes))
