"""The protocol of GRBL 1.1: blocks → lines, lines → replies.  Nothing here waits, opens or remembers.

Source: Skogsrud and Jeon 2019, GRBL 1.1 (interface; real-time bytes, errors 1–38, alarms 1–10), and own measurements
on its unmodified machine code.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Command, MoveBlock, UserLines, gcode
from handout.plotting.dialects.gcode import number
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter

RESET, HOLD, STATUS = b"\x18", b"!", b"?"
STANDING = b"G4P0\n"  # a pause of no length is answered when all motion is done
MODES = (b"G21\n", b"G90\n", b"G94\n")  # millimetres, absolute positions, feeds per minute

ERRORS: dict[int, str] = {
    1: "a word without its letter", 2: "a number that cannot be read", 3: "a $ command it does not know",
    4: "a negative value", 5: "homing is switched off in its settings ($22)", 6: "a step pulse that is too short",
    7: "its memory of settings could not be read and was reset", 8: "a command that needs it to stand still",
    9: "it is locked after an alarm", 10: "soft limits need homing ($20, $22)", 11: "a line that is too long",
    12: "a speed beyond its step rate", 13: "the safety door is open", 14: "a start-up line that is too long",
    15: "a jog beyond its travel", 16: "a jog it cannot read", 17: "laser mode needs PWM ($32)",
    20: "a command it does not know", 21: "two commands of one kind in a line", 22: "a move without a speed",
    23: "a whole number is needed", 24: "two commands that both need X, Y, Z", 25: "a letter twice in a line",
    26: "a command without its axes", 27: "a line number that is too large", 28: "a missing P or L",
    29: "a coordinate system it does not have", 30: "G53 without G0 or G1", 31: "axes that nothing uses",
    32: "an arc without its plane", 33: "a target it cannot reach", 34: "an arc that does not close",
    35: "an arc without its centre", 36: "words that nothing uses", 37: "a tool length on a wrong axis",
    38: "a tool number that is too large",
}  # fmt: skip
ALARMS: dict[int, str] = {
    1: "a limit switch was hit; it no longer knows where it is: bring it back to its zero",
    2: "a move would have left its travel: check its travel ($130, $131) and where its zero is",
    3: "it was reset while it moved and no longer knows where it is: bring it back to its zero",
    4: "a probe was not as expected", 5: "a probe touched nothing", 6: "homing was interrupted: home again",
    7: "the safety door was opened while homing", 8: "homing could not leave the limit switch",
    9: "homing did not find a limit switch: look at the switch and its wire, and home again",
    10: "homing did not find the second limit switch, or the emergency stop is pressed",
    11: "it has to be homed before it moves (homing = true in the profile)",
    12: "a limit switch is pressed: push the carriage off it", 17: "a motor driver reports a fault",
}  # fmt: skip
SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59")
MARK = b"F600\n"  # a feed tells one that has been driven from one that has restarted
SLEEP = b"$SLP\n"  # motors off
HELD = {
    "Hold": "The plotter is on hold; it goes on when it is told to (~ or its cycle-start button). Ctrl-C ends it.",
    "Door": "The plotter stands because its safety door is open; close it and press its cycle-start button (~).",
    "Tool": "The plotter waits for a change of tool; confirm it on the plotter.",
}


class Ok(NamedTuple):
    """A line was taken; it need not have been executed."""


class Error(NamedTuple):
    """A line was refused."""

    number: int

    @property
    def description(self) -> str:
        return f"error:{self.number}, {ERRORS.get(self.number, 'unknown')}"


class Alarm(NamedTuple):
    """The machine stopped and locked itself."""

    number: int

    @property
    def description(self) -> str:
        return f"ALARM:{self.number}: {ALARMS.get(self.number, 'unknown')}"


class Banner(NamedTuple):
    """The controller has started."""

    text: str


class Status(NamedTuple):
    """The answer to ``?``: a state such as Idle, Run, Hold, Alarm, with its number apart; and the rest as it came."""

    state: str
    detail: str
    fields: str

    def field(self, name: str) -> tuple[float, ...]:
        """The numbers of a field such as MPos, WCO, Bf or FS; none if it is not there or cannot be read."""
        match = re.search(rf"\|{name}:([-\d.,]+)", self.fields)
        try:
            return tuple(float(part) for part in match.group(1).split(",")) if match else ()
        except ValueError:
            return ()


class Setting(NamedTuple):
    """One line of ``$$``."""

    number: int
    value: float


class Sizes(NamedTuple):
    """From ``$I``: moves and bytes it can hold; and whether its axes may count forward from where they are homed."""

    queue: int
    buffer: int
    forward: bool = False


class Version(NamedTuple):
    """From ``$I``: what it is."""

    text: str


class Offset(NamedTuple):
    """From ``$#``: an offset of a coordinate system such as G54, or of G92; mm."""

    name: str
    place: tuple[float, ...]


class Modal(NamedTuple):
    """From ``$G``: the words that are in force."""

    words: tuple[str, ...]


class Note(NamedTuple):
    """Anything else it says."""

    text: str


Reply = Ok | Error | Alarm | Banner | Status | Setting | Sizes | Version | Offset | Modal | Note

_OPTIONS = re.compile(r"\[OPT:([^,\]]*),(\d+),(\d+)")
_OFFSET = re.compile(r"\[(G5[4-9]|G92):(-?\d+\.?\d*(?:,-?\d+\.?\d*)*)\]")
_WRITERS = re.compile(rb"\$(\d+|N\d*|I|RST)=|.*(G10L|G28\.1|G30\.1)", re.IGNORECASE)
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)")


def reply(line: bytes) -> Reply:
    """What a line from the controller means."""
    text = line.decode("ascii", "replace").strip()
    if text == "ok":
        return Ok()
    if match := re.fullmatch(r"(error|ALARM):(\d+)", text):
        return (Error if match.group(1) == "error" else Alarm)(int(match.group(2)))
    if text.startswith("<") and text.endswith(">"):
        state, _, fields = text[1:-1].partition("|")
        name, _, detail = state.partition(":")
        return Status(name, detail, "|" + fields)
    if re.match(r"grbl", text, re.IGNORECASE):
        return Banner(text)
    if match := _OPTIONS.match(text):
        return Sizes(int(match.group(2)), int(match.group(3)), "Z" in match.group(1))
    if match := _SETTING.match(text):
        return Setting(int(match.group(1)), float(match.group(2)))
    if match := _OFFSET.match(text):
        return Offset(match.group(1), tuple(float(part) for part in match.group(2).split(",")))
    if text.startswith("[GC:"):
        return Modal(tuple(text[4:].rstrip("]").split()))
    return Version(text[5:].rstrip("]")) if text.startswith("[VER:") else Note(text)


def writes_memory(line: bytes) -> bool:
    """Whether a line makes the controller write into its memory, deaf meanwhile: it has to be sent alone."""
    return _WRITERS.match(line.replace(b" ", b"")) is not None


def pen(down: bool, profile: PenProfile) -> list[bytes]:
    """Lower or lift the pen and wait for it."""
    return gcode.pen(down, profile, stand=STANDING, servo=lambda value: f"M3S{number(value)}\n".encode(), pause=pause)


def set_place(place: tuple[float, float, float]) -> bytes:
    """Set the coordinates of the place where it stands, mm."""
    x, y, z = place
    return f"G92X{number(x)}Y{number(y)}Z{number(z)}\n".encode()


def set_pen(profile: PenProfile, value: float) -> list[bytes]:
    """The pen goes to a value or a height; see `dialects.Dialect`."""
    return [*MODES, *pen(True, pen_lift.lower_at_once(profile, value)), STANDING]


def pause(seconds: float) -> bytes:
    """Stand still when all motion is done."""
    return f"G4P{number(seconds)}\n".encode()


def program(blocks: Sequence[Block], profile: Plotter, *, absolute: bool = False) -> Iterator[Command]:
    """The commands of a plan; see `gcode.Program`.

    absolute : every place is told as it is.  If not, every place but the first is told from the one before (G91): one
        that comes over wrong displaces all that follow, so that every later report of the place tells.
    """
    return _Program(profile, blocks, absolute).commands()


class _Program(gcode.Program):
    """Remembers places in thousandths of a millimetre, as they are told, and the motion word besides."""

    standing, modes = STANDING, MODES

    def __init__(self, profile: Plotter, blocks: Sequence[Block], absolute: bool) -> None:
        super().__init__(profile, blocks)
        self.absolute, self.relative = absolute, False
        self.at: dict[str, int] = {}
        self.motion = self.feed = ""

    def open(self) -> list[bytes]:
        return list(MODES)

    def pause(self, seconds: float) -> bytes:
        return pause(seconds)

    def move_pen(self, down: bool, profile: PenProfile) -> list[bytes]:
        """Move the pen; heights are absolute."""
        lines = pen(down, profile)
        if profile.lift == "z":
            self.at["Z"] = round(1000 * (profile.down if down else profile.up))
        if profile.lift == "command":  # whose lines may change all of it
            self.at, self.motion = {}, ""
        self.feed = self.feed if profile.lift == "servo" else ""
        return lines if profile.lift == "servo" else [*self._restore_absolute(), *lines]

    def obey(self, block: UserLines) -> list[bytes]:
        self.at, self.motion, self.feed = {}, "", ""
        return [*self._restore_absolute(), *super().obey(block)]

    def close(self) -> list[bytes]:
        """M2 and M30 are left out: they would drop the pen."""
        return [*self._restore_absolute(), STANDING]

    def _restore_absolute(self) -> list[bytes]:
        """Return to absolute coordinates."""
        relative, self.relative = self.relative, False
        return [b"G90\n"] if relative else []

    def line(self, block: MoveBlock) -> bytes:
        there = {"X": round(1000 * block.x), "Y": round(1000 * block.y)}
        there |= {} if block.z is None else {"Z": round(1000 * block.z)}
        changed = {axis: to for axis, to in there.items() if to != self.at.get(axis)}
        relative = not self.absolute and there.keys() <= self.at.keys()
        words = ["G91"] if relative and not self.relative else ["G90"] if self.relative and not relative else []
        words += [] if self.motion == "G1" else ["G1"]
        for axis, to in changed.items():
            words.append(axis + number((to - self.at[axis] if relative else to) / 1000))
        feed = f"F{number(block.feed, 1)}"
        words += [] if feed == self.feed else [feed]
        self.at |= there
        self.motion, self.feed, self.relative = "G1", feed, relative
        return ("".join(words) + "\n").encode()
