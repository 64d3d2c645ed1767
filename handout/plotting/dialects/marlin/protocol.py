"""The protocol of Marlin: blocks → commands, lines → replies, how a line is numbered.  Nothing here waits or remembers.

Source: Marlin's documentation and sources, read for facts (G-code reference; queue of commands, planner, messages): a
line ``Nn …*cs`` is taken if n is the last number + 1 and cs the XOR of all bytes before the asterisk; if not, what has
been received is thrown away and ``Resend: n`` says which line is wanted.
"""

from __future__ import annotations

import functools
import math
import operator
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Command, MoveBlock, Pause, PenBlock, UserLines, gcode
from handout.plotting.dialects.gcode import number
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter

STANDING = b"M400\n"  # answered when all motion is done
WHERE = b"M114\n"
WHO = b"M115\n"
SETTINGS = b"M503\n"
NUMBER = b"M110\n"
HERE = b"G92X0Y0\n"  # the pen stands at zero
LEVEL = b"G92Z0\n"  # and its Z axis
STOP_DEAD, GO_ON = b"M410\n", b"M108\n"
RELEASE = b"M84\n"  # motors off
LONGEST = 95  # bytes of a line that Marlin keeps (MAX_CMD_SIZE); the rest is cut off silently
# Millimetres, absolute; no percentage from the knob; no slower segments when the queue runs low; motors stay powered
# while a person changes a pen, or their place would be lost.
MODES = (b"G21\n", b"G90\n", b"M220S100\n", b"M205B0\n", b"M84S0\n")
_AT_ONCE = 3  # moves with which Marlin begins; with fewer it waits a tenth of a second for more
_WORTH = 1.0  # mm of a move that is cut into so many

_HEATERS = "its heater protection struck; nothing has to be hot for drawing: switch its heaters off (M104 S0, M140 S0)"
_SENSOR = "put it back, or give its firmware a dummy sensor (998, 999)"
# part of what Marlin says after "Error:" → what it means and what to do
ERRORS: tuple[tuple[str, str], ...] = (
    ("kill() called", "it was stopped for good (M112, or its own protection); switch it off and on"),
    ("Printer stopped", "it stopped after an error; switch it off and on, or send M999"),
    ("Thermal Runaway", _HEATERS),
    ("Heating failed", _HEATERS),
    ("MINTEMP", f"a temperature sensor is not connected; {_SENSOR}"),
    ("MAXTEMP", f"a temperature sensor has a short circuit; {_SENSOR}"),
    ("Homing Failed", "a switch was not found; look at switches and cables, and that nothing is in the way"),
    ("Servo", "it has no servo of that number; build it with NUM_SERVOS, or lift the pen otherwise (pen.lift)"),
    ("out of range", "a number that it does not have"),
)  # fmt: skip


class Ok(NamedTuple):
    """A command was worked through; a move of it may still wait in the queue.

    With ADVANCED_OK it says which line, how many moves and how many commands it has room for.
    """

    line: int | None = None
    moves: int | None = None
    commands: int | None = None


class Resend(NamedTuple):
    """The line it wants next."""

    line: int


class Fault(NamedTuple):
    """A line came damaged or out of order; a `Resend` follows."""

    text: str


class Error(NamedTuple):
    """Something is wrong with the machine."""

    text: str

    @property
    def description(self) -> str:
        meaning = next((remedy for part, remedy in ERRORS if part.lower() in self.text.lower()), "")
        return f"“{self.text}”" + (f": {meaning}" if meaning else "")


class Unhomed(NamedTuple):
    """It moves only when it has been homed."""


class Struck(NamedTuple):
    """A limit switch was hit."""

    text: str


class Busy(NamedTuple):
    """It is alive and works, or waits for a person."""

    waits_for_person: bool


class Start(NamedTuple):
    """The controller has started."""


class Identity(NamedTuple):
    """Its firmware, from ``M115``."""

    name: str


class Capability(NamedTuple):
    """One of the things it can do, from ``M115``."""

    name: str
    able: bool


class SettingsLine(NamedTuple):
    """A line of ``M503``: its command, such as M201, and the values by letter."""

    code: str
    values: dict[str, float]


class Position(NamedTuple):
    """The end of the last move that it has taken, mm: it stands there when all motion is done."""

    x: float
    y: float
    z: float


class Unknown(NamedTuple):
    """A command it does not know; an `Ok` follows."""

    command: str


class Note(NamedTuple):
    """Anything else it says."""

    text: str


Reply = (
    Ok | Resend | Fault | Error | Unhomed | Struck | Busy | Start | Identity | Capability | SettingsLine | Position
    | Unknown | Note
)  # fmt: skip

_OK = re.compile(r"ok(?: +N(\d+))?(?: +P(\d+))?(?: +B(\d+))?(?: .*)?")
_RESEND = re.compile(r"(?:Resend:? *|rs +)N?(\d+)", re.IGNORECASE)
_FAULT = re.compile(r"checksum mismatch|Line Number is not Last Line|No (?:Checksum|Line Number) with", re.IGNORECASE)
_SETTINGS = re.compile(r"(?:echo:)?\s*(M\d+)((?:\s+[A-Z]-?\d+(?:\.\d+)?)+)\s*(?:;.*)?")
_POSITION = re.compile(r"X:\s*(-?[\d.]+) +Y:\s*(-?[\d.]+) +Z:\s*(-?[\d.]+)")
_UNKNOWN = re.compile(r'(?:echo:)?Unknown (?:command|[GMT] code): "?([^"]*)"?', re.IGNORECASE)
_UNHOMED = re.compile(r"home +(?:axis +)?[xyz ]+first", re.IGNORECASE)


def reply(line: bytes) -> Reply:
    """What a line from the controller means."""
    text = line.decode("ascii", "replace").strip()
    plain = text.removeprefix("echo:")
    if match := _OK.fullmatch(text):
        return Ok(*(None if part is None else int(part) for part in match.groups()))
    if match := _RESEND.fullmatch(text):
        return Resend(int(match.group(1)))
    if text.lower().startswith("error:"):
        message = text[6:].strip()
        return Fault(message) if _FAULT.search(message) else Error(message)
    if plain.startswith("busy:"):
        return Busy("paused" in plain)
    if text == "start":
        return Start()
    return _information(text, plain)


def _information(text: str, plain: str) -> Reply:
    """What a line tells about the machine itself."""
    if text.startswith("FIRMWARE_NAME:"):
        return Identity(re.split(r" [A-Z_]+:", text[14:])[0])
    if match := re.fullmatch(r"Cap:(\w+):([01])", text):
        return Capability(match.group(1), match.group(2) == "1")
    if match := _SETTINGS.fullmatch(text):
        values = {word[0]: float(word[1:]) for word in match.group(2).split()}
        return SettingsLine(match.group(1), values)
    if match := _POSITION.match(text):
        return Position(*(float(part) for part in match.groups()))
    if match := _UNKNOWN.match(text):
        return Unknown(match.group(1))
    if _UNHOMED.search(plain):
        return Unhomed()
    if "endstops hit" in plain.lower():
        return Struck(plain)
    return Note(plain)


def frame_line(number: int, data: bytes) -> bytes:
    """A command as one line with its number and its checksum."""
    body = b"N%d %s" % (number, data.rstrip(b"\n"))
    return b"%s*%d\n" % (body, functools.reduce(operator.xor, body))


def pen(down: bool, profile: PenProfile) -> list[bytes]:
    """Lower or lift the pen and wait for it; a servo acts at once, so that the moves before must be done."""
    lines = gcode.pen(
        down, profile, stand=STANDING, servo=lambda value: f"M280P0S{round(value)}\n".encode(), pause=gcode.pause_ms
    )
    return [STANDING, *lines] if profile.lift == "servo" else lines


def set_pen(profile: PenProfile, value: float) -> list[bytes]:
    """The pen goes to a value or a height; see `dialects.Dialect`."""
    return [*MODES[:2], *pen(True, pen_lift.lower_at_once(profile, value)), STANDING]


def homing(profile: Plotter) -> list[bytes]:
    """Lift the pen and find the zero of X and Y.  Z is left alone: a pen reaches lower than its switch allows for."""
    if profile.pen.lift == "z":
        rise = f"G1Z{number(profile.pen.up - profile.pen.down)}F{number(profile.pen.z_speed * 60, 1)}\n".encode()
        return [b"G91\n", rise, b"G90\n", b"G28XY\n"]
    return [*pen(False, profile.pen), b"G28XY\n"]


def program(blocks: Sequence[Block], profile: Plotter) -> Iterator[Command]:
    """The commands of a plan; see `gcode.Program`."""
    return _Program(profile, blocks).commands()


class _Program(gcode.Program):
    modes = MODES[:2]

    def open(self) -> list[bytes]:
        return [*MODES, *([HERE] if self.profile.bed.zero == "here" else [])]

    def move_pen(self, down: bool, profile: PenProfile) -> list[bytes]:
        self.forget_pen()
        return pen(down, profile)

    def move(self, block: MoveBlock, index: int) -> list[bytes]:
        """A move between two rests is cut into pieces, since Marlin would wait for more before it begins."""
        lone = self._rests(index - 1) and self._rests(index + 1)
        start = tuple(float(self.words[axis]) for axis in "XY" if axis in self.words)
        if not lone or len(start) < 2 or math.dist(start, (block.x, block.y)) <= _WORTH:
            return [self.line(block)]
        pieces = []
        for share in (piece / _AT_ONCE for piece in range(1, _AT_ONCE)):
            x, y = (a + share * (b - a) for a, b in zip(start, (block.x, block.y), strict=True))
            pieces.append(self.line(MoveBlock(x, y, block.feed)))
        return [*pieces, self.line(block)]

    def _rests(self, index: int) -> bool:
        """Whether the machine comes to rest at a block (or beyond the ends of the plan)."""
        if not 0 <= index < len(self.blocks):
            return True
        block, lift = self.blocks[index], self.profile.pen
        if isinstance(block, PenBlock):
            return lift.lift != "z" or pen_lift.wait(lift, block.down, 0.0) > 0
        return isinstance(block, Pause | UserLines)
