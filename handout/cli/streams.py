"""Standard input, output and error: of a command that was begun without one of them, or whose reader has gone."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from typing import TextIO, cast

# what is opened in place of a closed one: input has ended, output cannot be written, so that it is not lost unsaid
_MODES = {"stdin": os.O_RDONLY, "stdout": os.O_RDONLY, "stderr": os.O_WRONLY}


class _Unfailing(io.TextIOWrapper):
    """Standard error that loses what nobody can read: no reason to end what is being said."""

    def __init__(self, stream: io.TextIOWrapper) -> None:
        super().__init__(stream.buffer, stream.encoding, stream.errors, line_buffering=True)
        self._stream = stream  # which closes the file when it goes

    def write(self, text: str) -> int:
        with contextlib.suppress(OSError):
            return super().write(text)
        return len(text)

    def flush(self) -> None:
        with contextlib.suppress(OSError):
            super().flush()


def open_closed() -> None:
    """Open what is closed, lest the next file that is opened takes its place; and let standard error never fail."""
    for name, mode in _MODES.items():
        if getattr(sys, name) is None:
            file = os.open(os.devnull, mode)  # takes the least number that is free, which is that of the stream
            setattr(sys, name, os.fdopen(file, "r" if name == "stdin" else "w", encoding="utf-8", closefd=False))
    if sys.stderr is sys.__stderr__ or sys.__stderr__ is None:
        sys.stderr = _Unfailing(cast(io.TextIOWrapper, sys.stderr))


def is_unread() -> bool:
    """Whether standard output takes no more of what was written to it; what is left in it stays unsaid then."""
    output = cast(TextIO, sys.__stdout__ or sys.stdout)
    try:
        output.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())
        return True
    return False
