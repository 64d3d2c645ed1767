"""Makes the missing pages of a job in a process of its own, which runs ahead of the pen.

It adds to the job's folder what is lacking and prints a line for every page; when the program that plots has gone, and
nobody reads these lines, it stops at the next page.  What it has made is on the disk, so that neither of them holds
more than a page.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import handout
from handout.errors import InputError

ADDED, FAILED = "added", "failed"  # what its lines begin with


class PageProducer(Protocol):
    """Makes the pages that a job lacks, in order."""

    def wait(self) -> None:
        """Return when one more page may exist, or all do; InputError if the next cannot be made."""

    def trouble(self) -> str:
        """Why a page will be missing, as soon as that is known; else ""."""


class ProducerProcess:
    """A program that makes the pages of a job.

    Parameters
    ----------
    command : what is run; it says ``added 7`` when page 7 is there, ``failed`` and one sentence if one cannot be made,
        and ends when there is nothing more to make.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self._failed, self._ended = "", False
        path = os.pathsep.join(filter(None, [str(Path(handout.__file__).parents[1]), os.environ.get("PYTHONPATH")]))
        try:
            # of a session of its own: Ctrl-C is for the program that plots
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                env={**os.environ, "PYTHONPATH": path},
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(f"{command[0]} cannot be started to make the other pages: {error.strerror}.") from error

    def wait(self) -> None:
        """Wait until the process has printed another line, or has ended."""
        assert self._process.stdout is not None
        self._hear(self._process.stdout.readline())
        if self._failed:
            raise InputError(self._failed)

    def trouble(self) -> str:
        """Why the process ended early."""
        if not self._failed and self._process.poll():
            assert self._process.stdout is not None
            for line in [*self._process.stdout, ""]:
                self._hear(line)
        return self._failed

    def _hear(self, line: str) -> None:
        word, _, rest = line.strip().partition(" ")
        if word == FAILED:
            self._failed = rest
        elif word != ADDED:
            if (self._process.wait() or self._ended) and not self._failed:
                code = self._process.returncode
                self._failed = f"The other pages cannot be made: the program for that ended with {code}."
            self._ended = True

    def close(self) -> None:
        """End the process; the page under way is made again next time."""
        self._process.terminate()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
