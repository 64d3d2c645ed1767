"""Standard input, output and error: of a command that was begun without one of them, or whose reader has gone."""

from __future__ import annotations

import errno
import io
import os
import sys

# what is opened in place of a closed one: input has ended, output cannot be written, so that it is not lost unsaid
_MODES = {"stdin": os.O_RDONLY, "stdout": os.O_RDONLY, "stderr": os.O_WRONLY}


class _OutputStream(io.TextIOWrapper):
    """Standard output or error, which notes that nobody takes what is written to it.

    Standard error is no reason to end what is being said; what is lost of it nobody can read.
    """

    def __init__(self, stream: io.TextIOWrapper, *, needed: bool) -> None:
        super().__init__(stream.buffer, stream.encoding, stream.errors, line_buffering=stream.line_buffering)
        self.needed, self.failed = needed, False
        self._stream = stream  # which closes the file when it goes

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError:
            self._note()
        return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError:
            self._note()

    def _note(self) -> None:
        self.failed = True
        if self.needed:
            raise  # the error that is being handled


_output: list[_OutputStream] = []  # standard output, whatever click puts in its place


def open_closed() -> None:
    """Open what is closed, lest the next file that is opened takes its place; and let standard error never fail."""
    for name, mode in _MODES.items():
        if getattr(sys, name) is None:
            file = os.open(os.devnull, mode)  # takes the least number that is free, which is that of the stream
            setattr(sys, name, os.fdopen(file, "r" if name == "stdin" else "w", encoding="utf-8", closefd=False))
    for name, real in (("stdout", sys.__stdout__), ("stderr", sys.__stderr__)):
        stream = getattr(sys, name)
        if stream is real or real is None:  # and not what a test has put there
            setattr(sys, name, _OutputStream(stream, needed=name == "stdout"))
    _output[:] = [sys.stdout] if isinstance(sys.stdout, _OutputStream) else []


def check_unread(leave: SystemExit) -> None:
    """Raise the exit again, unless click ended because nobody reads what it prints any more."""
    if not is_unread():
        raise leave


def explain_closed(error: Exception) -> str | None:
    """What is said where standard output was closed before the command began; None for other errors."""
    return "Standard output is closed." if getattr(error, "errno", None) == errno.EBADF and is_unread() else None


def is_unread() -> bool:
    """Whether standard output took no more of what was written to it; what is left in it stays unsaid then."""
    failed = bool(_output) and _output[0].failed
    if failed:
        os.dup2(os.open(os.devnull, os.O_WRONLY), _output[0].fileno())
    return failed
