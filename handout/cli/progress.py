"""The progress bar of long work, with the time that is left: a terminal shows it, and nothing else does."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

from handout import units

if TYPE_CHECKING:
    from rich.progress import Progress

# no time left is shown before this share of the work is done and so many s have passed; set by eye
_LEAST_SHARE, _LEAST_TIME = 0.02, 1.0
_REFRESHES = 4  # a second; set by eye
_shown: list[Progress] = []  # the bar on the terminal, if there is one


class ProgressLine(Protocol):
    """A `progress.Tell` that also takes how much time is left, s, from work that knows it."""

    def __call__(self, share: float, stage: str, left: float | None = None) -> None:
        """Show the share of the work that is done, 0 to 1, and what is being done."""


def wants_bar(quiet: bool) -> bool:
    """Whether a terminal is there and the user does not want quiet."""
    return not quiet and sys.stderr.isatty()


def show_nothing(share: float, stage: str, left: float | None = None) -> None:
    """Show nothing."""


@contextlib.contextmanager
def show_bar(quiet: bool) -> Iterator[ProgressLine]:
    """The bar of a block of work; gives the function that moves it, which shows nothing without a terminal."""
    if _shown or not wants_bar(quiet):
        yield show_nothing
        return
    bar, clock = _bar(), _Clock()
    task = bar.add_task("", total=None, clock=clock)  # without a total the bar moves to and fro

    def tell(share: float, stage: str, left: float | None = None) -> None:
        clock.update(share, left)
        bar.update(task, completed=min(share, 1.0), total=1.0 if share > 0 else None, description=stage)

    _shown.append(bar)
    bar.start()
    try:
        yield tell
    finally:
        _shown.remove(bar)
        bar.stop()


@contextlib.contextmanager
def hide_bar() -> Iterator[None]:
    """Take the bar away while something is printed or asked."""
    for bar in _shown:
        bar.stop()
    try:
        yield
    finally:
        for bar in _shown:
            bar.start()


class _Clock:
    """The time that is left, as text: estimated from the time that the share that is done took."""

    def __init__(self) -> None:
        self._begun = self._at = time.monotonic()
        self._left: float | None = None

    def update(self, share: float, left: float | None) -> None:
        self._at = time.monotonic()
        took = self._at - self._begun
        estimate = took * (1 - share) / share if share > _LEAST_SHARE and took > _LEAST_TIME else None
        self._left = estimate if left is None else left

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
        refresh_per_second=_REFRESHES,
    )
