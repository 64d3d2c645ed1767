"""What every dialect of plotters has in common: a program of commands, and a controller that takes it.

A dialect is a package in `dialects` with the same four parts in each:

- `words`: blocks → commands, bytes → replies; pure.
- `controller`: the conversation over one port, with the dialect's own flow control; a `Controller`.
- the module of the package itself: a `Dialect`, that is `program`, `file`, `connect`.
- in `simulated`, a firmware of its own that shares no code with the three above.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol, cast

from handout.plotting.planning.blocks import Block
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import Port
from handout.profiles import Pen, Plotter

Log = Callable[[str], None]


class Command(NamedTuple):
    """One instruction of a program.

    data : as it is sent, with its terminator, but without what one transmission adds (line numbers, checksums).
    done : how many blocks of the plan have been done when this command has been executed.
    """

    data: bytes
    done: int


class Heard(NamedTuple):
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
    queued : moves it has in hand, as last heard; None as long as it has not said.
    listener : called whenever it has said how far it is.
    silent : why its answers do not tell when it executed what; "" if they do.
    """

    profile: Plotter
    sent: int
    taken: int
    executed: int
    queued: int | None
    listener: Callable[[Heard], None]
    silent: str
    spoilt: bool
    patience: float

    @property
    def proven(self) -> int:
        """See above."""

    def send(self, data: bytes) -> None:
        """Write a command as soon as the machine has room for it, hearing what it says meanwhile."""

    def wait(self) -> None:
        """Hear what it says next, asking if it says nothing; returns when something was heard."""

    def finish(self) -> None:
        """Wait until everything that was sent has been executed."""

    def position(self) -> tuple[float, float] | None:
        """Where it stands (machine coordinates, mm); None if it cannot tell, or no longer knows (it has restarted)."""

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
        """Lift the pen and travel so far (machine coordinates, mm), whether or not it knows where it is."""

    def release(self) -> None:
        """Take the power from its motors; it no longer knows where it is then.  InputError: it has no way to."""

    def heed_button(self) -> None:
        """From now on `send`, `wait` and `finish` raise ButtonPressed when its button has been pressed, if it has one
        and does not hold by itself."""

    def pressed(self) -> bool:
        """Whether its button has been pressed since it was asked last; waits `BUTTON_LOOK` for that."""


class Buttonless:
    """A controller without a button, or one that holds by itself when a person wants it to."""

    def heed_button(self) -> None:
        """Nothing to heed."""

    def pressed(self) -> bool:
        """Never."""
        return False


BUTTON_LOOK = 0.1  # s between two looks at a button while a plot pauses


class ButtonPressed(Exception):
    """A person wants the plot to pause."""


class Dialect(Protocol):
    """One language that plotters speak."""

    suffixes: tuple[str, ...]

    def program(self, blocks: Sequence[Block], profile: Plotter) -> Iterator[Command]:
        """All commands of a plan in order, what comes before its first block and after its last included; pure."""

    def file(self, plan: Plan, profile: Plotter) -> bytes:
        """A plan as a file that other programs can send to the machine."""

    def set_pen(self, pen: Pen, value: float) -> list[bytes]:
        """The pen goes to a value or a height, wherever it is, and is waited for; pure.

        Raises InputError if its heights cannot be set.
        """

    def connect(self, port: Port, profile: Plotter, log: Log) -> Controller:
        """Wake a controller, find out who it is and what its limits are; it does not move (but see `home`).

        log : told in plain words what the user should know, such as limits that differ from the profile's.
        """


def unheard(heard: Heard) -> None:
    """Nobody listens."""


def dialect(name: str) -> Dialect:
    """The dialect of a profile: "grbl", "marlin", "ebb" or "hpgl"."""
    return cast(Dialect, importlib.import_module(f"handout.plotting.dialects.{name}"))
