"""Rows made by the workers of a Dask cluster, on any machines."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from importlib import import_module
from typing import Any, Self

from handout.errors import InputError
from handout.pipeline.row_work import AHEAD, MadeRow, Remote, RowWork, WorkersLost, made_from
from handout.printing.rows import Row

_ANSWER = 10.0  # s that a scheduler may take to answer
_PATIENCE = 30.0  # s without a row after which somebody is told
_LOOK = 5.0  # s for which the number of workers is taken as known
_MOST = 1024  # rows that are ahead at most, however large the cluster is: they are kept in memory


class ClusterWorkers(Remote):
    """The workers behind the scheduler at an address, as many as there are from time to time."""

    def __init__(self, work: RowWork, address: str, say: Callable[[str], object]) -> None:
        """`say` hears of it when nobody works.

        Raises
        ------
        InputError
            No scheduler answers there, or what talks to it is not installed.
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

    def submit(self, row: Row, check: bool) -> Any:
        """See `Remote`."""
        # what a lost worker was making the scheduler gives to another by itself
        return self._client.submit(made_from, self._work, row, check, pure=False)

    def result(self, future: Any) -> MadeRow | None:
        """See `Remote`."""
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
            except (
                self._distributed.KilledWorker,
                CancelledError,
            ):  # with several workers, or the scheduler
                return None

    def recover(self, waiting: deque[tuple[Row, Any]]) -> Sequence[bool]:
        """See `Remote`."""
        if self._client.status != "running":
            raise WorkersLost(f"The scheduler at {self._address} cannot be reached any more.")
        return [future.status in ("error", "cancelled", "lost") for _, future in waiting]
