"""What is said while a machine draws: on a thread of its own, for a terminal may take its time to show a line."""

from __future__ import annotations

import contextlib
import threading
from concurrent.futures import Executor, ThreadPoolExecutor
from types import TracebackType

import click

from handout.cli import progress

_MANY = 200  # lines that may wait; more are only counted


def thread() -> Executor:
    """Where it is said."""
    return ThreadPoolExecutor(1, "voice")


class Voice:
    """Says lines on standard error; whoever calls it never waits.

    quiet : says nothing.
    """

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet
        self._thread, self._lock = thread(), threading.Lock()
        self._lines: list[str] = []
        self._lost = 0
        self._speaks = False  # the thread will look for more lines

    def say(self, line: str) -> None:
        """Say a line."""
        if self.quiet:
            return
        with self._lock:
            self._lost += len(self._lines) >= _MANY
            if len(self._lines) < _MANY:
                self._lines.append(line)
            if not self._speaks:
                self._speaks = True
                self._thread.submit(self._out)

    def wait(self) -> None:
        """Until all is said."""
        self._thread.submit(lambda: None).result()

    def _out(self) -> None:
        while True:
            with self._lock:
                lines, self._lines, lost, self._lost = self._lines, [], self._lost, 0
                self._speaks = bool(lines)
            if not lines:
                return
            with contextlib.suppress(OSError, ValueError), progress.hidden():  # nobody hears it: no reason to stop
                for line in [*lines, *([f"({lost} more lines)"] if lost else [])]:
                    click.echo(line, err=True)

    def __enter__(self) -> Voice:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._thread.shutdown()
