"""The protocol of HP-GL: blocks → instructions, answers → meanings.  Nothing here waits, opens or remembers.

Source: Hewlett-Packard 1983, HP 7475A, and the same of the 7470A: instructions, device control (ESC .), errors
of the language and of the RS-232 line, the bits of OS and ESC.O.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from handout.plotting.dialects import Block, Command, MoveBlock, Pause, PenBlock, UserLines
from handout.profiles import Plotter

SPACE, SIZE, LINE_ERROR, STATE = b"\x1b.B", b"\x1b.L", b"\x1b.E", b"\x1b.O"  # asked and answered at once
ABORT = b"\x1b.K"  # drops what waits in the buffer
LISTEN = b"\x1b.(\x1b.R\x1b.@;0:"  # hear this port; as after power-on; no handshake by wires, no echo
MARKED = b"\x1b.M;;;10:"  # from now on answers end with a line feed; once it has been off, with a carriage return again
POSITION, ERROR, LIMITS, WHO = b"OA;", b"OE;", b"OH;", b"OI;"  # answered when all before them has been obeyed
STATUS = b"OS;"
START, PEN_UP, PEN_DOWN = b"IN;", b"PU;", b"PD;"
ABSOLUTE = b"PA;"  # from now on numbers are places, and not ways

VIEWING, LEVER = 16, 32  # bits of ESC.O
STARTED, WRONG = 8, 32  # bits of OS; STARTED: switched on, or told IN, since it was last asked

_LONGEST = 40  # bytes of an instruction; long lists overflow parsers
_INK = 3.0  # mm that an instruction draws, or one vector: it is known to be drawn only as a whole

ERRORS: dict[int, str] = {
    1: "an instruction it does not know", 2: "a wrong number of parameters", 3: "a parameter out of its range",
    4: "a character it cannot read", 5: "a character set it does not have", 6: "a position beyond its numbers",
    7: "its buffer for shapes is full", 8: "a move while its pinch wheels were raised: load the paper, lower the lever",
}  # fmt: skip
LINE_ERRORS: dict[int, str] = {
    10: "it was asked before it had answered", 11: "a device control instruction it does not know",
    12: "a device control instruction that cannot be read", 13: "a device control parameter out of its range",
    14: "too many device control parameters",
    15: "a byte was damaged on the way: check baud, parity and the cable",
    16: "its buffer ran over and bytes were lost: use a smaller port.buffer",
}  # fmt: skip

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_INSTRUCTION = re.compile(r"([A-Z]{2})([^A-Z]*)")


class Instruction(NamedTuple):
    """Two letters and their parameters."""

    name: str
    numbers: tuple[float, ...]

    @property
    def points(self) -> list[tuple[float, float]]:
        """The parameters in pairs."""
        return list(zip(self.numbers[::2], self.numbers[1::2], strict=False))


def read_instructions(data: bytes) -> list[Instruction]:
    """The instructions in some bytes, such as a file."""
    text = data.decode("ascii", "replace")
    return [Instruction(name, tuple(map(float, _NUMBER.findall(rest)))) for name, rest in _INSTRUCTION.findall(text)]


def numbers(answer: bytes) -> tuple[float, ...] | None:
    """The numbers of an answer; None if it is no list of numbers."""
    parts = answer.decode("ascii", "replace").strip().split(",")
    return tuple(map(float, parts)) if all(_NUMBER.fullmatch(part.strip()) for part in parts) else None


def error(number: int) -> str:
    """An error of the language in words."""
    return f"HP-GL error {number}, {ERRORS.get(number, 'unknown')}"


def line_error(number: int) -> str:
    """An error of the line in words."""
    return f"RS-232 error {number}: {LINE_ERRORS.get(number, 'unknown')}"


def units(mm: float, profile: Plotter) -> int:
    """Plotter units of a length in mm; a profile calls them steps."""
    return round(mm * profile.limits.steps_per_mm)


def travel(x: float, y: float, profile: Plotter) -> bytes:
    """A move to a place, mm, with the pen lifted."""
    return f"PU{units(x, profile)},{units(y, profile)};".encode()


def velocity(block: MoveBlock) -> str:
    """A speed as VS takes it, cm/s."""
    return f"{block.feed / 600.0:.2f}".rstrip("0").rstrip(".")


def opening(profile: Plotter) -> list[bytes]:
    """Reset to the state after power-on, turn the coordinates as the profile says, and fetch a pen."""
    return [START, *rotate(profile), fetch_pen(profile), PEN_UP]


def fetch_pen(profile: Plotter) -> bytes:
    """A pen comes into the holder, if it is not there."""
    return f"SP{profile.hpgl.pen};".encode()


def rotate(profile: Plotter) -> list[bytes]:
    """Turn the coordinates and the area that they reach; nothing for plotters that need no turning."""
    return [f"RO{profile.hpgl.rotation};".encode(), b"IP;", b"IW;"] if profile.hpgl.rotation else []


def closing(profile: Plotter) -> list[bytes]:
    """The pen goes back into the carousel, where it is capped."""
    return [PEN_UP, b"SP0;"] if profile.hpgl.pens > 1 else [PEN_UP]


def program(blocks: Sequence[Block], profile: Plotter, *, absolute: bool = False) -> Iterator[Command]:
    """All instructions of a plan, none longer than 40 bytes.

    A velocity is only sent where it changes, and only for the pen that is down: with the pen lifted a plotter moves as
    fast as it can.  There is no instruction for a rest of the pen: a dot is as long as the plotter's own lifting.

    absolute : as other programs write it, places on the sheet in instructions that lower the pen (PD).  If not, every
        place but the first is told from the one before (PR), so that one that comes over wrong displaces all that
        follow and the place at the end tells; and only one instruction of a stroke lowers the pen, so that what comes
        to a plotter that has started anew draws nothing.
    """
    yield from (Command(data, 0) for data in opening(profile))
    stroke, done = _Stroke(profile, absolute), 0
    for index, block in enumerate(blocks):
        if isinstance(block, Pause):
            continue
        if stroke.ends_before(block):
            yield Command(stroke.instruction(), done)
        if isinstance(block, PenBlock):
            yield Command(stroke.turn(block.down), index + 1)
        elif isinstance(block, UserLines):
            yield Command(stroke.write_user_lines(block), index + 1)
        elif isinstance(block, MoveBlock):
            if not stroke.down:
                yield Command(stroke.travel(block), index + 1)
            else:
                yield from (Command(data, index) for data in stroke.change_speed(block))
                stroke.add(block)
        done = index + 1
    if stroke.points:
        yield Command(stroke.instruction(), done)
    yield from (Command(data, len(blocks)) for data in closing(profile))


class _Stroke:
    """The line under way, which the next instruction will draw.

    down : whether the pen is; points : the places that the instruction has so far.
    """

    def __init__(self, profile: Plotter, absolute: bool) -> None:
        self.profile, self.absolute = profile, absolute
        self.down, self.points = False, ""
        self._speed = ""
        self._ink = 0.0
        self._at = (0.0, 0.0)  # mm
        self._unit: tuple[int, int] | None = None  # the same as it was told

    def ends_before(self, block: Block) -> bool:
        """Whether the instruction must be sent before a block: it is full, or the block is no drawn move."""
        if not self.points:
            return False
        return not isinstance(block, MoveBlock) or velocity(block) != self._speed or not self.fits(block)

    def turn(self, down: bool) -> bytes:
        """The pen is lowered or lifted."""
        self.down = down
        return (PEN_DOWN if down else PEN_UP) * (1 if self.absolute else 2)

    def write_user_lines(self, block: UserLines) -> bytes:
        """Instructions of the user's own, which may change velocity and place; and back to where it stood."""
        self._speed = ""
        there = [] if self._unit is None else ["PA{},{}".format(*self._unit)]
        return "".join(f"{line.rstrip(';')};" for line in (*block.lines, *there)).encode("ascii")

    def change_speed(self, block: MoveBlock) -> list[bytes]:
        """The instruction for a velocity that differs from the last one told, if it does."""
        before, self._speed = self._speed, velocity(block)
        return [] if before == self._speed else [f"VS{self._speed};".encode()]

    def fits(self, block: MoveBlock) -> bool:
        """Whether the instruction can hold one more place."""
        more = math.dist(self._at, block[:2])
        return len(self.points) + len(self._point(block)) + 4 <= _LONGEST and self._ink + more <= _INK

    def add(self, block: MoveBlock) -> None:
        """Add a place to the instruction."""
        self.points = f"{self.points},{self._point(block)}".lstrip(",")
        self._ink += math.dist(self._at, block[:2])
        self._go(block)

    def instruction(self) -> bytes:
        """The instruction with all places so far; the next one begins."""
        points, self.points, self._ink = self.points, "", 0.0
        return f"{'PD' if self.absolute else 'PR'}{points};".encode()

    def travel(self, block: MoveBlock) -> bytes:
        """The pen goes to a place, lifted."""
        first, point = self._unit is None, self._point(block)
        self._go(block)
        if self.absolute:
            return f"PU{point};".encode()
        return f"{'PA' if first else 'PR'}{point};".encode()

    def _point(self, block: MoveBlock) -> str:
        x, y = units(block.x, self.profile), units(block.y, self.profile)
        before = (0, 0) if self.absolute or self._unit is None else self._unit
        return f"{x - before[0]},{y - before[1]}"

    def _go(self, block: MoveBlock) -> None:
        self._at, self._unit = block[:2], (units(block.x, self.profile), units(block.y, self.profile))
