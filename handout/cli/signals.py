"""Signals that end a command: Ctrl-C, SIGTERM and SIGHUP all unwind it, so that nothing is left half done."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

INTERRUPTED = 130  # the exit code of shells for a program that Ctrl-C ended: 128 + SIGINT
_OF_SIGNALS = 128  # what a shell adds to the number of the signal that ended a program


class Stopped(KeyboardInterrupt):
    """A signal asked the program to stop; it is handled as Ctrl-C is, so the same clean-up runs.

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
    handlers = {number: handler for number, handler in before.items() if handler is signal.SIG_DFL}
    for number in handlers:
        signal.signal(number, _stop)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def ignore() -> None:
    """Hear no more signals while the last words are said, nor Ctrl-C until the program has ended: a traceback else."""
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            if (number := getattr(signal, name, None)) is not None:
                signal.signal(number, signal.SIG_IGN)


def _stop(number: int, _frame: FrameType | None) -> None:
    raise Stopped(number)


def last_words(stop: BaseException) -> tuple[str, int]:
    """The last sentence, and the exit code."""
    cause = stop.__cause__ or stop.__context__ or stop
    stopped = next((error for error in (stop, cause) if isinstance(error, Stopped)), None)
    notes = list(dict.fromkeys(note for error in (cause, stop) for note in getattr(error, "__notes__", [])))
    sentence = "Interrupted." if stopped is None else f"Stopped by {stopped}."
    return " ".join([sentence, *notes]), INTERRUPTED if stopped is None else stopped.code
