"""What every simulated controller has in common: it reads instructions, obeys, answers, and has a clock of its own.

The module that a dialect names as its simulator is a package here with a `Firmware`, which shares no code with the
dialect that drives it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Protocol, cast

from handout.plotting.dialects import dialect
from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper
from handout.simulated.plotter.wire import Framing, Wire

Wait = float | str  # s of being busy, or what is waited for: a word that the firmware's `ready` understands
Say = Callable[[bytes], None]


class Firmware(Protocol):
    """One controller.

    Parameters
    ----------
    wire : its receive buffer, of which it may report size and room; paper : where its carriage stands.
    say : takes its answers, with their terminators.

    Attributes
    ----------
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
    return cast(type[Firmware], importlib.import_module(dialect(profile.dialect).simulator).Firmware)
