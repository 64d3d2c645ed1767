"""Signals that end a command: Ctrl-C, SIGTERM and SIGHUP all unwind it, so that nothing is left half done.

What must not be cut short runs within `defer_signals`: signals that come meanwhile are noted and act at its end.
"""

from __future__ import annotations

import contextlib
import ctypes
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

INTERRUPTED = 130  # the exit code of shells for a program that Ctrl-C ended: 128 + SIGINT
_OF_SIGNALS = 128  # what a shell adds to the number of the signal that ended a program


class Stopped(KeyboardInterrupt):
    """A signal asked the program to stop; it is handled as Ctrl-C is, so the same clean-up runs.

    code : with which the command ends.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.code = _OF_SIGNALS + number


@dataclass
class _Deferral:
    """Of one thread. acts : whether a signal acts at once; noted : those that came while none did."""

    acts: bool = True
    noted: list[Callable[[], object]] = field(default_factory=list)

    def take(self, act: Callable[[], object]) -> None:
        """Act on a signal now or later. Whatever unwinds the thread is not disturbed by the next signal."""
        if self.acts:
            self.acts = False
            act()
            self.acts = True
        else:
            self.noted.append(act)

    def catch_up(self) -> None:
        """Act on the first signal that was noted: one is enough to end a command."""
        if self.acts and self.noted:
            first, self.noted = self.noted[0], []
            self.take(first)


_deferrals: dict[int, _Deferral] = {}  # by thread


@contextlib.contextmanager
def defer_signals() -> Iterator[None]:
    """Signals that come meanwhile act when this ends: Ctrl-C, those of `orderly`, and `interrupt` of this thread."""
    me = threading.get_ident()
    if inner := _deferrals.get(me):
        before, inner.acts = inner.acts, False
        try:
            yield
        finally:
            inner.acts = before
            inner.catch_up()
        return
    deferral = _deferrals[me] = _Deferral(acts=False)
    usual = _note_signals(deferral) if threading.current_thread() is threading.main_thread() else {}
    try:
        yield
    finally:
        del _deferrals[me]
        for number, handler in reversed(usual.items()):  # Ctrl-C last: from then on it acts by itself
            signal.signal(number, handler)
        deferral.acts = True
        deferral.catch_up()


def _note_signals(deferral: _Deferral) -> dict[int, Any]:
    """Have a deferral take all signals that have a handler in Python; the handlers."""
    numbers = [
        number for name in ("SIGINT", "SIGTERM", "SIGHUP") if (number := getattr(signal, name, None)) is not None
    ]
    usual: dict[int, Any] = {number: handler for number in numbers if callable(handler := signal.getsignal(number))}

    def note(number: int, frame: FrameType | None) -> None:
        deferral.take(lambda: usual[number](number, frame))

    for number in usual:
        signal.signal(number, note)
    return usual


@contextlib.contextmanager
def heed_signals() -> Iterator[None]:
    """Within `defer_signals`: signals act at once again, those that were noted too."""
    deferral = _deferrals.get(threading.get_ident())
    if deferral is None:
        yield
        return
    before, deferral.acts = deferral.acts, True
    try:
        deferral.catch_up()
        yield
    finally:
        deferral.acts = before


def interrupt(thread: int) -> None:
    """Raise KeyboardInterrupt in another thread, as Ctrl-C does in the first: it lifts its pen, or cancels its job."""
    if deferral := _deferrals.get(thread):
        if not deferral.acts:
            deferral.noted.append(_raise)
            return
        deferral.acts = False  # the next one waits until this one has been heeded
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(KeyboardInterrupt))


def _raise() -> None:
    raise KeyboardInterrupt


@contextlib.contextmanager
def orderly() -> Iterator[None]:
    """SIGTERM (a service manager, a shutdown, `kill`) and SIGHUP (the terminal is gone) raise `Stopped` meanwhile.

    Ctrl-C is heard once, however often it is pressed in one go: the next would break off what the first has to undo.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names: dict[str, tuple[Any, Any]] = {"SIGTERM": (signal.SIG_DFL, _stop), "SIGHUP": (signal.SIG_DFL, _stop)}
    names["SIGINT"] = (signal.default_int_handler, _interrupt_once)
    numbers = {number: names[name] for name in names if (number := getattr(signal, name, None)) is not None}
    # who ignores a signal, as `nohup` does, goes on ignoring it
    ours = {number: (usual, own) for number, (usual, own) in numbers.items() if signal.getsignal(number) is usual}
    for number, (_, own) in ours.items():
        signal.signal(number, own)
    try:
        yield
    finally:
        for number, (usual, own) in ours.items():
            if number != signal.SIGINT or signal.getsignal(number) is own:  # else Ctrl-C is ignored to the end
                signal.signal(number, usual)


_ONCE = 0.5  # s: signals that follow one another faster are one press of a key that is held
_last_interrupt = -_ONCE


def _interrupt_once(_number: int, _frame: FrameType | None) -> None:
    global _last_interrupt
    before, _last_interrupt = _last_interrupt, time.monotonic()
    if _last_interrupt - before > _ONCE:
        raise KeyboardInterrupt


def ignore() -> None:
    """Hear no more signals while the last words are said, nor Ctrl-C until the program has ended: a traceback else."""
    if threading.current_thread() is threading.main_thread():
        numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
        # Python writes a traceback of one that comes while it is told to ignore it: hear it, hold it back, ignore it
        for number in numbers:
            signal.signal(number, lambda *_: None)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers) if hasattr(signal, "pthread_sigmask") else None
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)
        if before is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stop(number: int, _frame: FrameType | None) -> None:
    raise Stopped(number)


def last_words(stop: BaseException) -> tuple[str, int]:
    """The last sentence, and the exit code."""
    cause = stop.__cause__ or stop.__context__ or stop
    stopped = next((error for error in (stop, cause) if isinstance(error, Stopped)), None)
    notes = list(dict.fromkeys(note for error in (cause, stop) for note in getattr(error, "__notes__", [])))
    sentence = "Interrupted." if stopped is None else f"Stopped by {stopped}."
    return " ".join([sentence, *notes]), INTERRUPTED if stopped is None else stopped.code
