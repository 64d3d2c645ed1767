"""The way into the simulated controller: bytes one after the other at the baud rate, and a buffer that can overflow."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

_REALTIME = frozenset(b"?!~\x18")


@dataclass(slots=True)
class _Piece:
    """Bytes up to the end of a line, or one real-time byte; `first` is when the first of them is in, s."""

    first: float
    data: bytes
    given: int = 0


class Wire:
    """Bytes under way and bytes received.

    Parameters
    ----------
    size : bytes the receive buffer holds.
    byte : s a byte takes.

    Attributes
    ----------
    lost : how many bytes found the buffer full.
    cut : how many more ends of lines come through before one is lost on the way (−1: none is).
    """

    def __init__(self, size: int, byte: float, cut: int = -1) -> None:
        self.size, self.byte, self.cut = size, byte, cut
        self.lost = 0
        self._under_way: deque[_Piece] = deque()
        self._free = 0.0
        self._buffer = bytearray()  # received, not read
        self._line = bytearray()  # read, the line is not complete

    def put(self, data: bytes, now: float) -> None:
        """Send bytes off."""
        at = max(self._free, now)
        for piece in _pieces(data):
            self._under_way.append(_Piece(at + self.byte, self._damaged(piece)))
            at += len(piece) * self.byte
        self._free = at

    def _damaged(self, piece: bytes) -> bytes:
        if piece.endswith(b"\n") and self.cut >= 0:
            self.cut -= 1
            return piece[:-1] if self.cut < 0 else piece
        return piece

    @property
    def next(self) -> float:
        """When the next line is complete or the next real-time byte comes in, s."""
        if not self._under_way:
            return math.inf
        piece = self._under_way[0]
        return piece.first + max(len(piece.data) - 1, 0) * self.byte

    @property
    def room(self) -> int:
        """Bytes the buffer can still take."""
        return self.size - len(self._buffer)

    def receive(self, now: float) -> list[int]:
        """Take in all that has arrived; the real-time bytes among it."""
        urgent: list[int] = []
        while self._under_way and self._under_way[0].first <= now + 1e-12:
            piece = self._under_way[0]
            many = min(len(piece.data), math.floor((now - piece.first) / self.byte + 1e-6) + 1)
            fresh = piece.data[piece.given : many]
            piece.given = many
            if fresh and fresh[0] in _REALTIME:
                urgent.append(fresh[0])
            else:
                fits = fresh[: self.size - 1 - len(self._buffer)]  # a ring of n bytes holds n − 1
                self.lost += len(fresh) - len(fits)
                self._buffer += fits
            if many < len(piece.data):
                break
            self._under_way.popleft()
        return urgent

    @property
    def has_line(self) -> bool:
        """Whether a line is complete; what is there of it is read meanwhile."""
        if b"\n" in self._buffer:
            return True
        self._line += self._buffer
        self._buffer.clear()
        return False

    def line(self) -> bytes | None:
        """Read from the buffer: a complete line if there is one by now."""
        end = self._buffer.find(b"\n")
        take = len(self._buffer) if end < 0 else end + 1
        self._line += self._buffer[:take]
        del self._buffer[:take]
        if end < 0:
            return None
        line = bytes(self._line)
        self._line.clear()
        return line

    def clear(self) -> None:
        """Forget what has been received."""
        self._buffer.clear()
        self._line.clear()


def _pieces(data: bytes) -> list[bytes]:
    """The bytes cut after every end of a line and around every real-time byte."""
    pieces, start = [], 0
    for at, byte in enumerate(data):
        if byte in _REALTIME:
            pieces += [data[start:at], data[at : at + 1]]
            start = at + 1
        elif byte == 10:
            pieces.append(data[start : at + 1])
            start = at + 1
    return [piece for piece in [*pieces, data[start:]] if piece]
