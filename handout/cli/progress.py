"""How far long work has come, and how long it still takes: one line on a terminal, and nothing anywhere else."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

from handout import units

if TYPE_CHECKING:
    from rich.progress import Progress

_EARLY = 0.02  # share of the work, and s, before which nobody can say how long it takes
_SOON = 1.0
_OFTEN = 4  # times a second
_shown: list[Progress] = []  # the line on the terminal, if there is one


class Line(Protocol):
    """A `progress.Tell` that may also be told how much time is left, s, by work that knows."""

    def __call__(self, share: float, stage: str, left: float | None = None) -> None:
        """Show it."""


def wanted(quiet: bool) -> bool:
    """Whether there is anybody to show it to."""
    return not quiet and sys.stderr.isatty()


def unseen(share: float, stage: str, left: float | None = None) -> None:
    """Nobody looks."""


@contextlib.contextmanager
def shown(quiet: bool) -> Iterator[Line]:
    """A function that is told how far the work of the block has come; a terminal shows it, unless one wants quiet."""
    if _shown or not wanted(quiet):
        yield unseen
        return
    bar, clock = _bar(), _Clock()
    task = bar.add_task("", total=None, clock=clock)  # which moves to and fro until a share is known

    def tell(share: float, stage: str, left: float | None = None) -> None:
        clock.told(share, left)
        bar.update(task, completed=min(share, 1.0), total=1.0 if share > 0 else None, description=stage)

    _shown.append(bar)
    bar.start()
    try:
        yield tell
    finally:
        _shown.remove(bar)
        bar.stop()


@contextlib.contextmanager
def hidden() -> Iterator[None]:
    """The line is taken away while something is said or asked."""
    for bar in _shown:
        bar.stop()
    try:
        yield
    finally:
        for bar in _shown:
            bar.start()


class _Clock:
    """How long the work still takes, from how long the part that is done took."""

    def __init__(self) -> None:
        self._begun = self._at = time.monotonic()
        self._left: float | None = None

    def told(self, share: float, left: float | None) -> None:
        self._at = time.monotonic()
        took = self._at - self._begun
        guessed = took * (1 - share) / share if share > _EARLY and took > _SOON else None
        self._left = guessed if left is None else left

    def __str__(self) -> str:
        if self._left is None:
            return ""
        left = self._left - (time.monotonic() - self._at)
        return f"{units.duration(left)} left" if left > 1 else "nearly done"


def _bar() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TaskProgressColumn, TextColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[clock]}"),
    )
    return Progress(
        *columns,
        console=Console(stderr=True),
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
        refresh_per_second=_OFTEN,
    )
