"""The protocol of the EBB: blocks → commands, lines → replies.  Nothing here waits, opens or remembers.

Source: Schmalz, EiBotBoard command set (firmware 2.8.1 and 3.0), which says since which version each command is known.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from handout.errors import InputError
from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Command, MoveBlock, Pause, PenBlock, Timed, UserLines
from handout.plotting.dialects.ebb.stepping import HOME, Motors, Version
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter

SERVO_PERIOD = 0.024  # s between two pulses to the servo, of which each may change its place by the rate (SC,11 SC,12)
_BRUSHLESS_PERIOD = 0.003  # s, of one channel (SC,8,1) in the place of eight
_BRUSHLESS_PORT, _BRUSHLESS_PIN = 2, 5  # RB2, which is RP5: of SP, of S2
_SWEEP = 0.7  # share of the time allowed for the pen in which the servo goes all its way, if nothing slower is asked
_SERVO_PIN = 4  # RP4, the output B1 of the pen's servo, which S2 moves between two moves of the motors at no delay
_HOME_SPEED = 15.0  # mm/s, slow enough to be begun and ended at once: HM knows no acceleration
_LONGEST = 65535  # ms a command may pause

ERRORS: dict[int, str] = {
    0: "a step rate or a number of steps it cannot make", 1: "a step rate it cannot make",
    2: "it had more to say than it can hold", 3: "a command that is too long", 4: "a number is missing",
    5: "something other than a comma between two numbers", 6: "a number out of its bounds", 7: "a number too many",
    8: "a command it does not know", 9: "a wrong checksum", 10: "a checksum is missing",
}  # fmt: skip


class Ok(NamedTuple):
    """A command was taken; motion need not have been executed.  `name` is the command's, where it is said."""

    name: str


class Error(NamedTuple):
    """A command was refused; −1: it did not say a number."""

    number: int
    text: str

    @property
    def description(self) -> str:
        return f"{self.text!r}, {ERRORS.get(self.number, 'an error unknown here')}"


class About(NamedTuple):
    """The answer to ``V``.  uniform : whether it answers all commands in one form (``CU,10,1``)."""

    version: Version
    uniform: bool


class Values(NamedTuple):
    """The answer to a question: its numbers, and the name of the question where that is said."""

    name: str
    numbers: tuple[int, ...]


class Note(NamedTuple):
    """Anything else it says."""

    text: str


Reply = Ok | Error | About | Values | Note

_ERROR = re.compile(r"(?:[A-Z][A-Z0-9]?,)?(!\s*(\d+)?.*)")
_VALUES = re.compile(r"(?:([A-Z][A-Z0-9]?),)?(-?\d+(?:,-?\d+)*)")


def reply(line: bytes) -> Reply:
    """What a line from the board means.  Lines end in CR LF, LF CR or LF, by command and version."""
    text = line.decode("ascii", "replace").strip()
    if match := _ERROR.fullmatch(text):
        return Error(int(match.group(2) or -1), match.group(1))
    if "EBB" in text and (version := Version.from_answer(text)):
        return About(version, text.startswith("V,"))
    if text == "OK" or re.fullmatch(r"[A-Z][A-Z0-9]", text):
        return Ok("" if text == "OK" else text)
    if match := re.fullmatch(r"(QG,)?([0-9A-F]{2})", text):  # a byte of flags, in hexadecimal
        return Values("QG", (int(match.group(2), 16),))
    if match := _VALUES.fullmatch(text):
        return Values(match.group(1) or "", tuple(int(number) for number in match.group(2).split(",")))
    return Note(text)


def command(name: str, *numbers: int) -> bytes:
    """A command as it is sent."""
    return (",".join([name, *(str(number) for number in numbers)]) + "\r").encode("ascii")


PRESSED, BUSY, WAITING = 32, 8, 1  # bits of the answer to QG
QUEUED = frozenset({"SM", "LM", "LT", "HM", "SP", "S2"})  # commands that wait for their turn
_LONGEST_WAY = 60.0  # s that a board may take to go back to its zero


def is_own(data: bytes) -> bool:
    """Whether a command is of the kind that programs here are made of: it waits for its turn, or may come at once."""
    return data.split(b",")[0].strip().decode("ascii") in QUEUED | {"SC", "CS", "EM"}


def seconds(data: bytes) -> float:
    """How long a command keeps the board, s; nothing for what it does at once."""
    name, *fields = data.decode("ascii").strip().split(",")
    if name == "HM":
        return _LONGEST_WAY
    place = {"SM": 0, "SP": 1, "LT": 0}.get(name)
    if place is None or len(fields) <= place:
        return 0.0
    return int(fields[place]) / (25_000 if name == "LT" else 1000)


def pen(down: bool, profile: PenProfile) -> bytes:
    """Lower or lift the pen, and wait for it."""
    wait = _milliseconds(pen_lift.wait(profile, down, 0.0))
    if profile.servo == "brushless":
        return command("SP", 0 if down else 1, *(wait or [1]), _BRUSHLESS_PORT)
    return command("SP", 0 if down else 1, *wait)


def _milliseconds(seconds: float) -> list[int]:
    """The number of whole milliseconds as a parameter; none for 0, which is refused."""
    whole = min(round(1000 * seconds), _LONGEST)
    return [whole] if whole > 0 else []


def _rate(way: float, seconds: float, period: float) -> int:
    """The step of the servo with every pulse, so that it goes all its way in that time."""
    return max(1, min(65535, math.ceil(abs(way) * period / max(seconds, period))))


def set_pen(profile: PenProfile, value: float) -> list[bytes]:
    """The pen goes to a length of its pulse; see `dialects.Dialect`."""
    there = pen_lift.lower_at_once(profile, value)
    return [*reach(profile), command("SC", 5, round(value)), pen(True, there)]


def prepare_pen(profile: PenProfile) -> list[bytes]:
    """Set the height and speed of the pen, which a board forgets when it restarts, and lift it."""
    return [*reach(profile), pen(False, profile)]


def reach(profile: PenProfile) -> list[bytes]:
    """How high the pen goes, and how fast."""
    way, brushless = profile.down - profile.up, profile.servo == "brushless"
    period = _BRUSHLESS_PERIOD if brushless else SERVO_PERIOD
    return [
        *([command("SC", 8, 1)] if brushless else []),
        command("SC", 4, round(profile.up)),
        command("SC", 5, round(profile.down)),
        command("SC", 11, _rate(way, _SWEEP * profile.up_time, period)),
        command("SC", 12, _rate(way, profile.ramp or _SWEEP * profile.down_time, period)),
    ]


def opening(profile: Plotter) -> list[bytes]:
    """Lift the pen, and bring the carriage to its zero, for all moves are relative to where it stands."""
    if Version.from_text(profile.firmware) < HOME:  # zero is wherever it stands
        return prepare_pen(profile.pen)
    home = command("HM", round(_HOME_SPEED * profile.limits.steps_per_mm))
    return [*prepare_pen(profile.pen), command("CS") if profile.bed.zero == "here" else home]


def program(blocks: Sequence[Block], profile: Plotter) -> Iterator[Command]:
    """All commands of a plan.

    Motion is told as the firmware of the profile understands it best: constant acceleration over a time (LT), over
    steps (LM), or constant speed (SM) where it is older or not known.

    Raises InputError: the plan was made for a machine that does not keep time.
    """
    for data in opening(profile):
        yield Command(data, 0)
    lift = _Lift(profile.pen)
    motors = Motors(profile)
    pin = _BRUSHLESS_PIN if profile.pen.servo == "brushless" else _SERVO_PIN
    index = 0
    while index < len(blocks):
        block = blocks[index]
        if isinstance(block, Timed):
            run = _take_moves(blocks, index)
            for offset, data in motors.command_moves(run):
                if (value := run[offset].servo) is not None:
                    yield Command(command("S2", round(value), pin, 0, 0), index + offset)
                yield Command(data, index + offset + 1)
            index += len(run)
            continue
        index += 1
        if isinstance(block, PenBlock):
            yield from _ending(lift.move(block), index)
        elif isinstance(block, UserLines):
            yield from _ending([f"{line}\r".encode("ascii") for line in block.lines], index)
        elif isinstance(block, Pause):
            yield from (Command(data, index) for data in pause(block.seconds))
        elif isinstance(block, MoveBlock):
            raise InputError("This plan was made for another machine: plan the drawing for the EBB that will draw it.")


class _Lift:
    """The last commands to the pen: the opening has lifted it, and set how low it goes."""

    def __init__(self, profile: PenProfile) -> None:
        self.profile, self.down, self.low = profile, False, profile.down

    def move(self, block: PenBlock) -> list[bytes]:
        """Commands that lift or lower the pen, also to the value of a hook; none if it is there."""
        told, low = [], self.profile.down if block.value is None else block.value
        if block.down and low != self.low:
            self.low = low
            told.append(command("SC", 5, round(low)))
        if block.down != self.down:
            told.append(pen(block.down, self.profile))
        self.down = block.down
        return told


def _ending(told: Sequence[bytes], done: int) -> Iterator[Command]:
    """The commands of a block, after the last of which so many blocks are done."""
    yield from (Command(data, done if data is told[-1] else done - 1) for data in told)


def _take_moves(blocks: Sequence[Block], first: int) -> list[Timed]:
    """The timed moves in a row that begin at `first`."""
    run = []
    for block in blocks[first:]:
        if not isinstance(block, Timed):
            break
        run.append(block)
    return run


def pause(seconds: float) -> list[bytes]:
    """Stand still."""
    return [command("SM", whole, 0, 0) for whole in _milliseconds(seconds)]
