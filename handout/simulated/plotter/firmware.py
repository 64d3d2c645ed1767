"""What every simulated controller has in common: it reads instructions, obeys, answers, and has a clock of its own.

Bytes come to it one after the other at the baud rate, into a buffer that can overflow.  A dialect names its controller,
which is a `Firmware` and shares no code with the dialect that drives it.
"""

from __future__ import annotations

import importlib
import math
import re
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol, cast

from handout.plotting.dialects import dialect
from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper


class Framing:
    """How a controller cuts what it receives into instructions.

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

    size : bytes the receive buffer holds.
    byte : s a byte takes.

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


Wait = float | str  # s of being busy, or what is waited for: a word that the firmware's `ready` understands
Say = Callable[[bytes], None]


class Firmware(Protocol):
    """One controller.

    wire : its receive buffer, of which it may report size and room; paper : where its carriage stands.
    say : takes its answers, with their terminators.

    now : s, its clock; it is set from outside.
    read_time : s it takes to read one instruction.
    acknowledgement : how an answer begins that acknowledges an instruction, in small letters; b"": every answer does.
    obeys : faults that strike while an instruction is read which it answers itself all the same.
    """

    now: float = 0.0
    read_time: float
    acknowledgement: bytes = b"ok"
    obeys: frozenset[str] = frozenset()

    def __init__(
        self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say
    ) -> None: ...

    @staticmethod
    def framing() -> Framing:
        """How it cuts what it receives into instructions."""

    def start(self) -> None:
        """Power comes on: nothing is remembered, where it stands is its zero; says its greeting, if it has one."""

    def stop(self) -> None:
        """Power goes off: the motors stand, the pen stays as it is."""

    def counts(self, line: bytes) -> bool:
        """Whether an instruction is part of a plot, and not a question or a setting."""

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Do what an instruction says as far as that keeps the main program, and answer."""

    def idle(self) -> None:
        """There is nothing to read."""

    def ready(self, wait: str) -> bool:
        """Whether what `execute` waits for has come."""

    def urgent(self, data: bytes) -> bool:
        """Obey bytes that act on reception; whether the main program starts anew and all that was received is lost."""
        return False

    @property
    def deaf(self) -> bool:
        """Whether it reads no instructions (after an alarm, say)."""
        return False

    @property
    def resting(self) -> bool:
        """Whether it stands still and has nothing left to do."""

    @property
    def next_event(self) -> float:
        """When something happens next by itself (a step, say), s; infinite: nothing will."""

    def step(self) -> None:
        """Do what is due now."""

    def refuse(self) -> None:
        """Answer an instruction with an error."""

    def alarm(self) -> None:
        """A limit switch is hit."""

    def lose_board(self) -> None:
        """The board that moves it is gone, if it is another computer than that which answers."""

    def hold(self) -> None:
        """Somebody puts it on hold; nothing where that cannot be."""


def firmware_of(profile: Plotter) -> type[Firmware]:
    """The controller of a profile's dialect."""
    module, _, name = dialect(profile.dialect).simulator.partition(":")
    return cast(type[Firmware], getattr(importlib.import_module(module), name))
