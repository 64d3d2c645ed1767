"""What goes wrong around a plotter: the disk of the computer is slow, its processor is busy with something else."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

from handout.simulated.plotter.options import parse

_SPINS = """
import os
if hasattr(os, "sched_setscheduler"):  # as other programs are, whatever this one is
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
parent = os.getppid()
while os.getppid() == parent:
    sum(range(100_000))
"""


@contextlib.contextmanager
def disturb_computer(query: str) -> Iterator[None]:
    """Slow disk and processor as an address asks after ``sim:?`` (``disk=1s&busy=2``), until the block ends."""
    options = parse(query)
    with slow_disk(options.disk), busy_processor(options.busy):
        yield


@contextlib.contextmanager
def slow_disk(seconds: float) -> Iterator[None]:
    """Every time this program waits until the disk has kept something, it takes so much longer."""
    usual = os.fsync

    def late(handle: Any) -> None:
        time.sleep(seconds)
        usual(handle)

    setattr(os, "fsync", late if seconds > 0.0 else usual)  # noqa: B010 — a function of the system cannot be assigned
    try:
        yield
    finally:
        setattr(os, "fsync", usual)  # noqa: B010


@contextlib.contextmanager
def busy_processor(many: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """So many other programs work as hard as they can; each ends by itself when this one is gone."""
    others = [subprocess.Popen([sys.executable, "-c", _SPINS]) for _ in range(many)]
    try:
        yield others
    finally:
        for other in others:
            other.kill()
            other.wait()
