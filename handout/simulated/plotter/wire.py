"""The way into the simulated controller: bytes one after the other at the baud rate, and a buffer that can overflow."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass


class Framing:
    """How a controller cuts what it receives into instructions.

    Parameters
    ----------
    ends : bytes of which each completes an instruction.
    immediate : bytes that act on reception, wherever they stand, and are never stored.
    blocks : whether the sender has to wait while the buffer is full (USB); if not, bytes are lost.
    """

    def __init__(self, ends: bytes, immediate: bytes = b"", blocks: bool = False) -> None:
        self.blocks = blocks
        self.end = re.compile(b"[" + re.escape(ends) + b"]")
        self.ends = ends
        self._ends, self._immediate = frozenset(ends), frozenset(immediate)

    def cut_pieces(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """Pieces of what is sent, each up to the end of an instruction; and whether a piece acts on reception.

        A framing in which several bytes together act on reception keeps them until they are complete.
        """
        start = 0
        for at, byte in enumerate(data):
            if byte in self._immediate:
                if at > start:
                    yield data[start:at], False
                yield data[at : at + 1], True
                start = at + 1
            elif byte in self._ends:
                yield data[start : at + 1], False
                start = at + 1
        if start < len(data):
            yield data[start:], False


@dataclass(slots=True)
class _WirePiece:
    """Bytes up to the end of an instruction, or some that act on reception; `first` is when the first is in, s."""

    first: float
    data: bytes
    urgent: bool
    read: int = 0


class Wire:
    """Bytes under way and bytes received.

    Parameters
    ----------
    size : bytes the receive buffer holds.
    byte : s a byte takes.

    Attributes
    ----------
    lost : how many bytes found the buffer full, or nobody who listened.
    deaf_until : s; bytes that come in before that are lost.
    """

    def __init__(self, size: int, byte: float, framing: Framing) -> None:
        self.size, self.byte, self.framing = size, byte, framing
        self.lost = 0
        self.deaf_until = 0.0  # s; what comes before that is lost
        self._under_way: deque[_WirePiece] = deque()
        self._free = 0.0
        self._buffer = bytearray()  # received, not read
        self._line = bytearray()  # read, the instruction is not complete

    def send_bytes(self, data: bytes, now: float) -> float:
        """Send bytes off; returns when the last of them will be in, s."""
        at = max(self._free, now)
        for piece, urgent in self.framing.cut_pieces(data):
            self._under_way.append(_WirePiece(at + self.byte, piece, urgent))
            at += len(piece) * self.byte
        self._free = at
        return at

    @property
    def next_arrival(self) -> float:
        """When the next instruction is complete or the next urgent piece comes in, s."""
        if not self._under_way or (self.framing.blocks and not self._under_way[0].urgent and self.room <= 1):
            return math.inf
        piece = self._under_way[0]
        return piece.first + max(len(piece.data) - 1, 0) * self.byte

    @property
    def room(self) -> int:
        """Bytes the buffer can still take."""
        return self.size - len(self._buffer)

    def receive(self, now: float) -> list[bytes]:
        """Take in all that has arrived; the urgent pieces among it."""
        urgent: list[bytes] = []
        while self._under_way and self._under_way[0].first <= now + 1e-12:
            piece = self._under_way[0]
            many = min(len(piece.data), math.floor((now - piece.first) / self.byte + 1e-6) + 1)
            if piece.urgent:
                if many < len(piece.data):
                    break
                urgent.append(piece.data)
            elif not self._store(piece, many):
                break
            self._under_way.popleft()
        return urgent

    def _store(self, piece: _WirePiece, many: int) -> bool:
        """Put the bytes of a piece that have arrived into the buffer; whether that was all of it."""
        fresh = piece.data[piece.read : many]
        if piece.first + piece.read * self.byte < self.deaf_until:
            unheard = min(len(fresh), math.ceil((self.deaf_until - piece.first) / self.byte - piece.read))
            self.lost += unheard
            piece.read += unheard
            fresh = fresh[unheard:]
        fits = fresh[: max(self.size - 1 - len(self._buffer), 0)]  # a ring of n bytes holds n − 1
        self._buffer += fits
        if self.framing.blocks:
            piece.read += len(fits)
        else:
            self.lost += len(fresh) - len(fits)
            piece.read = many
        return piece.read == len(piece.data)

    @property
    def has_line(self) -> bool:
        """Whether an instruction is complete; what is there of it is read meanwhile."""
        if self.framing.end.search(self._buffer):
            return True
        self._line += self._buffer
        self._buffer.clear()
        return False

    def line(self) -> bytes | None:
        """Read from the buffer: a complete instruction, with its end, if there is one by now."""
        end = self.framing.end.search(self._buffer)
        take = end.end() if end else len(self._buffer)
        self._line += self._buffer[:take]
        del self._buffer[:take]
        if end is None:
            return None
        line = bytes(self._line)
        self._line.clear()
        return line

    def lose(self) -> None:
        """Lose the bytes that are under way."""
        self._under_way.clear()

    def clear(self) -> None:
        """Forget what has been received."""
        self._buffer.clear()
        self._line.clear()
