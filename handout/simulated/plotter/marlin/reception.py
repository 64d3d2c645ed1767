"""How the simulated Marlin takes in lines: number, checksum, a request for what is missing, a queue of commands.

Source: Marlin's queue of commands, read for facts.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator

from handout.simulated.plotter import wire

_BUFFER = 4  # commands it holds, the one under way included
_KEPT = 95  # bytes of a line; the rest is lost silently
_URGENT = re.compile(rb"\s*(M108|M112|M410)\s*")


class MarlinFraming(wire.Framing):
    """Lines; three of them may act on reception besides (EMERGENCY_PARSER), and are read later as all others."""

    def cut_pieces(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """Pieces, each up to the end of a line."""
        for piece, _ in super().cut_pieces(data):
            if _URGENT.fullmatch(piece):
                yield piece, True
            yield piece, False


class Reception:
    """Lines received, judged, and not yet obeyed.

    Parameters
    ----------
    say : takes the lines of its answers; flush : forgets the bytes that have been received.

    Attributes
    ----------
    commands : in order; the first is under way.
    last : number of the last line that was taken.
    echoes : whether ``ok`` follows a request for a line, as it does in most versions.
    garbles : every line is judged damaged.
    """

    def __init__(self, say: Callable[[str], None], flush: Callable[[], None]) -> None:
        self._say, self._flush = say, flush
        self.commands: deque[str] = deque()
        self.last = 0
        self.echoes = True
        self.garbles = False

    @property
    def full(self) -> bool:
        """Whether no further line can be taken."""
        return len(self.commands) >= _BUFFER

    @property
    def room(self) -> int:
        """Commands that it can still take."""
        return _BUFFER - len(self.commands)

    def take(self, raw: bytes) -> str | None:
        """Judge a line; what it says if it was good and is now in the queue."""
        line = raw.rstrip(b"\r\n").split(b";")[0][:_KEPT].lstrip(b" ").decode("latin-1")
        if not line:
            return None
        if line.startswith("N") and not self._check_number(line):
            return None
        self.commands.append(line)
        return line

    def _check_number(self, line: str) -> bool:
        """Check a line that begins with its number."""
        number = _integer(line[1:])
        body, star, sum_text = line.rpartition("*")
        checksum = 0
        for char in body:
            checksum ^= ord(char)
        if number != self.last + 1 and "M110" not in line:
            return self._refuse("Line Number is not Last Line Number+1")
        if not star:
            return self._refuse("No Checksum with line number")
        if _integer(sum_text) != checksum or self.garbles:
            return self._refuse("checksum mismatch")
        self.last = number
        return True

    def _refuse(self, why: str) -> bool:
        """Throw away what has been received, and ask for the line after the last good one."""
        self._say(f"Error:{why}, Last Line: {self.last}")
        self._flush()
        self._say(f"Resend: {self.last + 1}")
        if self.echoes:
            self._say("ok")
        return False


def _integer(text: str) -> int:
    """The number at the beginning of a text; 0 if there is none."""
    match = re.match(r"\s*[-+]?\d+", text)
    return int(match.group()) if match else 0
