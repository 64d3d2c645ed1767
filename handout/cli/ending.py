"""How a command ends that is told to: Ctrl-C, SIGTERM and SIGHUP all unwind it, so that nothing is left half done."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

INTERRUPTED = 130
_OF_SIGNALS = 128  # what a shell adds to the number of the signal that ended a program


class Stopped(KeyboardInterrupt):
    """The program was told to stop; whatever puts things in order after Ctrl-C does so now.

    code : with which the command ends.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.code = _OF_SIGNALS + number


@contextlib.contextmanager
def orderly() -> Iterator[None]:
    """SIGTERM (a service manager, a shutdown, `kill`) and SIGHUP (the terminal is gone) raise `Stopped` meanwhile."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [number for name in ("SIGTERM", "SIGHUP") if (number := getattr(signal, name, None)) is not None]
    # who ignores a signal, as `nohup` does, goes on ignoring it
    before = {number: signal.getsignal(number) for number in numbers}
    taken = {number: handler for number, handler in before.items() if handler is signal.SIG_DFL}
    for number in taken:
        signal.signal(number, _stop)
    try:
        yield
    finally:
        for number, handler in taken.items():
            signal.signal(number, handler)


def _stop(number: int, _frame: FrameType | None) -> None:
    raise Stopped(number)


def told(stop: BaseException) -> tuple[str, int]:
    """What is said at the end, and the exit code."""
    cause = stop.__cause__ or stop.__context__ or stop
    stopped = next((one for one in (stop, cause) if isinstance(one, Stopped)), None)
    notes = list(dict.fromkeys(note for one in (cause, stop) for note in getattr(one, "__notes__", [])))
    said = "Interrupted." if stopped is None else f"Stopped by {stopped}."
    return " ".join([said, *notes]), INTERRUPTED if stopped is None else stopped.code
