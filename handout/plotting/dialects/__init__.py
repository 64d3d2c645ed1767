"""What a machine is told, free of any dialect; what all dialects have in common; and the table of the languages.

- `base`: what conversations and controllers of all dialects share; `gcode`: what those of G-code do.
- `grbl`, `marlin`, `ebb`, `hpgl`, `klipper`: in each, `protocol` (blocks → commands, bytes → replies; pure),
  `conversation` (flow control over one port, and connecting), `controller` (a `Controller`); the package has a
  `Dialect` named `DIALECT`.

To add a dialect: a package with its `DIALECT`, its simulated controller (in `handout.simulated.plotter`), one line in
the table below, and the name among those that `profiles.Plotter.dialect` takes.
`tests/plotting/dialects/test_dialects.py` goes over the table and says what is missing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

from handout.plotting.ports import Port
from handout.profiles import PenLift, Plotter

if TYPE_CHECKING:  # plans know their dialect
    from handout.plotting.planning.plan import Plan


import importlib
from typing import cast


class MoveBlock(NamedTuple):
    """A straight move to x, y (mm, machine coordinates) at a feed in mm/min; z: height of the pen, if it changes."""

    x: float
    y: float
    feed: float
    z: float | None = None


class Timed(NamedTuple):
    """A straight move to x, y (mm, machine coordinates) in exactly that many seconds, for machines that keep time.

    servo : value of the pen's from here on, if it changes.
    """

    x: float
    y: float
    seconds: float
    servo: float | None = None


class PenBlock(NamedTuple):
    """The pen is lowered or lifted, and waited for.

    value : to which it is lowered, of its servo or its Z axis; None: the profile's own; inks : it is for a stroke, and
        not for a hook.
    """

    down: bool
    value: float | None = None
    inks: bool = True


class Pause(NamedTuple):
    """The machine stands still, s."""

    seconds: float


class UserLines(NamedTuple):
    """Lines of the user's own, begun when the machine stands; what they may have changed is told anew."""

    lines: tuple[str, ...]


Block = MoveBlock | Timed | PenBlock | Pause | UserLines


Log = Callable[[str], None]


class Command(NamedTuple):
    """One instruction of a program.

    data : as it is sent, with its terminator, but without what one transmission adds (line numbers, checksums).
    done : how many blocks of the plan have been done when this command has been executed.
    """

    data: bytes
    done: int


class StateReport(NamedTuple):
    """What a machine has just said of itself.

    taken, executed : commands that it has acknowledged; that have certainly been executed.
    queued : moves it has in hand; place : where it is, machine coordinates, mm; None if it did not say.
    """

    taken: int
    executed: int
    queued: int | None = None
    place: tuple[float, float] | None = None


class Controller(Protocol):
    """A machine that is connected and ready; counts are of the commands given to `send`, in order.

    All methods raise PortError when the connection breaks, DeviceHeld when it is held for too long, DeviceSilent when
    nothing answers (or something was lost on the way), DeviceAlarm when the machine refuses or stops.

    profile : with the machine's own limits.
    sent : commands written to the port, whole or in part.
    taken : commands it has acknowledged.
    executed : commands that have certainly been executed; never more than were.
    proven : of these, how many have also been found right since, as far as the machine can tell: no damaged command is
        among them.
    patience : s that it may stand on hold, or wait for somebody to press its button, until that is taken for an end
        (DeviceHeld); infinite unless it is set.
    spoilt : whether a command has come over wrong behind those; told by `halt`, after a break of any kind.
    since : when what it has said last had certainly not come in yet, s by the port's clock.
    queued : moves it has in hand, as last heard; None as long as it has not said.
    listener : called whenever it has said how far it is.
    silent : why its answers do not tell when it executed what; "" if they do.
    """

    profile: Plotter
    sent: int
    taken: int
    executed: int
    queued: int | None
    listener: Callable[[StateReport], None]
    silent: str
    spoilt: bool
    patience: float

    @property
    def proven(self) -> int:
        """See above."""

    @property
    def earliest_arrival(self) -> float:
        """See above."""

    def send(self, data: bytes) -> None:
        """Write a command as soon as the machine has room for it, hearing what it says meanwhile."""

    def wait(self) -> None:
        """Hear its next answer, and ask if it is silent; returns when something was heard."""

    def finish(self) -> None:
        """Wait until everything that was sent has been executed."""

    def position(self) -> tuple[float, float] | None:
        """Its place (machine coordinates, mm); None if it cannot tell it, or has lost it by a restart."""

    def zero(self) -> None:
        """Take the place where the pen stands for its zero: a person has put it there."""

    def level(self) -> None:
        """Take the height where the pen stands for the zero of its Z axis, until it is switched off."""

    def go(self, x: float, y: float) -> None:
        """Lift the pen, travel there (machine coordinates, mm) and wait until it stands there."""

    def halt(self) -> None:
        """Stop as soon as the protocol allows (what waits in its queue is dropped), and lift the pen.

        Never raises: what could not be done is told to the log.
        """

    def home(self) -> None:
        """Find its zero by its switches."""

    def pen(self, down: bool) -> None:
        """Lower or lift the pen where it stands, and wait for it."""

    def jog(self, dx: float, dy: float) -> None:
        """Lift the pen and travel so far (machine coordinates, mm), even if it does not know its place."""

    def release(self) -> None:
        """Switch its motors off; after that it does not know its place.  InputError: it cannot."""

    def heed_button(self) -> None:
        """From now on `send`, `wait` and `finish` raise ButtonPressed when its button has been pressed, if it has one
        and does not hold by itself."""

    def was_button_pressed(self) -> bool:
        """Whether its button has been pressed since it was asked last; waits `BUTTON_LOOK` for that."""


BUTTON_LOOK = 0.1  # s between two looks at a button while a plot pauses


class ButtonPressed(Exception):
    """A person wants the plot to pause."""


@dataclass(frozen=True)
class Question:
    """How a machine is asked whether it speaks a dialect; no machine of another may take it for a command to move.

    answer : what the answer looks like; its group is what the machine says it is.  bauds : usual speeds of a port.
    """

    asked: bytes
    answer: re.Pattern[bytes]
    bauds: tuple[int, ...]


@dataclass(frozen=True)
class PenValues:
    """What the servo of a pen can be told: least and greatest, and how a value is written for a person."""

    least: float
    greatest: float
    written: Callable[[float], str]


@dataclass(frozen=True)
class Dialect:
    """Everything that is particular to one language of plotters; `DIALECT` of each package in `dialects`.

    program : all commands of a plan in order, what comes before its first block and after its last included; pure.
    file : a plan as a file that other programs can send to the machine; pure.
    set_pen : commands by which the pen goes to a value or a height, wherever it is, and is waited for; pure.
        InputError if its heights cannot be set.
    connect : wakes a controller and finds out who it is and what its limits are, without moving it (but see `home`).
        The log is told in plain words what the user should know, such as limits that differ from the profile's.
    simulator : ``module:class`` of the simulated controller, which shares no code with the dialect.
    question : how a machine is found out; usb : USB ids that only machines of this dialect have.
    suffixes : of files; usual_device : the machine that a file is for if none is named.
    motion : who makes the speeds: the controller, from feeds, with its own planner ("planned"); the program, which
        tells a time for every move ("timed"); the plotter, which keeps a velocity along each line ("vectors").
    curves : of a planner that limits the acceleration along the path: what it takes for a curve (`lookahead.Machine`).
    shortest_segment : steps that a segment has at least.
    lowering_bytes : bytes that are asked and answered before the pen is lowered.
    clues : further questions that no machine takes for a command to move, whose answers tell machines of the dialect
        apart (`greetings.narrow_profiles`).
    line_end : of lines of the user's own, such as a feeder's.
    in_hand : s of motion that it must be sent ahead, however much ink that is, or it stops in the middle of a stroke.
    pen_values : of a servo; None if the dialect has words of its own for the pen.
    steps_setting : where the machine keeps its steps per mm, "" if its scale is not set so.
    """

    program: Callable[[Sequence[Block], Plotter], Iterator[Command]]
    file: Callable[[Plan, Plotter], bytes]
    set_pen: Callable[[PenLift, float], list[bytes]]
    connect: Callable[[Port, Plotter, Log], Controller]
    simulator: str
    question: Question
    suffixes: tuple[str, ...]
    usual_device: str
    motion: Literal["planned", "timed", "vectors"]
    pen_values: PenValues | None
    steps_setting: str
    usb: frozenset[tuple[int, int]] = frozenset()
    curves: Literal["", "short", "all"] = ""
    # own method: with fewer steps a segment has no direction, and its feed makes a GRBL crawl
    shortest_segment: float = 3.0
    lowering_bytes: float = 0.0
    clues: tuple[bytes, ...] = ()
    line_end: str = "\n"
    in_hand: float = 0.0


def ignore_report(report: StateReport) -> None:
    """The listener of a controller as long as nobody listens."""


# in the order in which an unknown machine is asked; files with a suffix of several are for the first
DIALECTS: dict[str, str] = {
    "grbl": "handout.plotting.dialects.grbl",  # GRBL 1.1, grblHAL, FluidNC
    "ebb": "handout.plotting.dialects.ebb",  # EiBotBoard: AxiDraw, iDraw
    "marlin": "handout.plotting.dialects.marlin",  # Marlin and its kin: 3D printers that carry a pen
    "hpgl": "handout.plotting.dialects.hpgl",  # pen plotters from 1977 on, over RS-232
    "klipper": "handout.plotting.dialects.klipper",  # Klipper and its kin, behind Moonraker
}


def dialect(name: str) -> Dialect:
    """The dialect of a profile, by its name; loaded when it is asked for."""
    return cast(Dialect, importlib.import_module(DIALECTS[name]).DIALECT)


def usual_devices() -> dict[str, str]:
    """Suffix of a file → the machine that it is for if none is named."""
    return {
        suffix: language.usual_device for language in map(dialect, reversed(DIALECTS)) for suffix in language.suffixes
    }
