"""Rows made by this process, by several of this machine, or by a Dask cluster."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol

from handout.pipeline.merging import Account
from handout.pipeline.row_work import AHEAD, MadeRow, Remote, RowWork, made_from
from handout.printing.prepared import MakeRows, PreparedRow
from handout.printing.rows import Row

_ENDING = 5.0  # s that a pool may take to end
_PRELOADED = ("handout.pipeline.printing", "handout.inking.pens", "handout.motion.trace")


class Workers(Protocol):
    """Processes that make rows."""

    def each(self, rows: Iterable[Row], check: bool = False) -> Iterator[MadeRow]:
        """Make rows, or check them; one after the other in their order, as they are asked for."""
        ...


@contextlib.contextmanager
def opened(work: RowWork, jobs: int, cluster: str, say: Callable[[str], object]) -> Iterator[Workers]:
    """Processes for the rows of a batch: this one alone for 1 job; of the Dask cluster at an address, if one is given.

    Raises
    ------
    InputError
        There is no such cluster, or not what talks to it.
    """
    if cluster:
        from handout.pipeline.cluster import ClusterWorkers

        with ClusterWorkers(work, cluster, say) as workers:
            yield workers
    elif jobs > 1:
        with ProcessWorkers(work, jobs) as processes:
            yield processes
    else:
        yield _Here(work)


@dataclass(frozen=True)
class _Here:
    """This process."""

    work: RowWork

    def each(self, rows: Iterable[Row], check: bool = False) -> Iterator[MadeRow]:
        """See `Workers`."""
        function = self.work.check if check else self.work.make
        for row in rows:
            yield function(row)


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
            self._context.set_forkserver_preload([*_PRELOADED])
        self._pool = self._opened()

    def _opened(self) -> ProcessPoolExecutor:
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
        """See `Remote`."""
        return AHEAD * self._jobs

    def submit(self, row: Row, check: bool) -> Future[MadeRow]:
        """See `Remote`."""
        try:
            with _unheard():
                return self._pool.submit(_made, row, check)
        except BrokenProcessPool as error:
            lost = Future[MadeRow]()
            lost.set_exception(error)
            return lost

    def result(self, future: Future[MadeRow]) -> MadeRow | None:
        """See `Remote`."""
        try:
            return future.result()
        except (BrokenProcessPool, CancelledError):
            return None

    def recover(self, waiting: deque[tuple[Row, Any]]) -> Iterator[bool]:
        """A pool that has lost a process ends; a new one goes on with what it had not made."""
        self._end()
        wait([future for _, future in waiting], _ENDING)
        self._pool = self._opened()
        for _, future in waiting:
            lost = future.cancelled() or not future.done()
            yield lost or isinstance(future.exception(), BrokenProcessPool)


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    """A process that is begun meanwhile never hears Ctrl-C: that is for this one, which then ends it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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


def _made(row: Row, check: bool) -> MadeRow:
    return made_from(_work, row, check)


def counted(workers: Workers, account: Account, say: Callable[..., object], check: bool = False) -> MakeRows:
    """Rows as they are made, which an account counts; what is to be said of them is said once."""

    def each(rows: Iterable[Row]) -> Iterator[PreparedRow]:
        for made in workers.each(rows, check):
            if new := account.add(made.account):
                say(*new)
            yield made.row

    return each
