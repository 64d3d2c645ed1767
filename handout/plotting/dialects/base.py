"""What the conversations and the controllers of all dialects share: lines in, silence, limits, counts, the pen."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from handout import signals
from handout.errors import DeviceError, DeviceSilent
from handout.plotting.dialects import Controller, Log, StateReport, ignore_report
from handout.plotting.ports import Port, TimedReader
from handout.profiles import Limits, Plotter

Reply = TypeVar("Reply")

GLANCE = 0.25  # s that a machine is listened to at a time, before silence is reckoned with
RESTARTED = "The plotter restarted by itself and no longer knows where it is: check its power and its cable."


class Conversation(ABC, Generic[Reply]):
    """A port with a controller behind it that talks in lines.

    reply : what a line from the controller means.
    timeout : s of silence before it is given up.

    patience : s that it may stand on hold, or wait for a person.
    """

    line_end: ClassVar[re.Pattern[bytes]] = re.compile(rb"\n")

    def __init__(self, port: Port, timeout: float, log: Log, reply: Callable[[bytes], Reply]) -> None:
        self.port, self.timeout, self.log, self._reply = port, timeout, log, reply
        self.patience = math.inf
        self._partial = b""
        self._reader = TimedReader(port)

    @property
    def time(self) -> float:
        """How long it has been listened to so far, s by the port's clock."""
        return self._reader.time

    @property
    def earliest_arrival(self) -> float:
        """When what it has said last had certainly not come in yet, s by the port's clock."""
        return self._reader.since

    def read(self, patience: float) -> bytes:
        """The bytes that come in within `patience` s, as soon as there are any."""
        return self._reader.read(patience)

    def replies(self, patience: float) -> list[Reply]:
        """What the controller says within `patience` s; returns with the first complete lines, or with none then."""
        end = self.time + patience
        while True:
            *complete, self._partial = self.line_end.split(self._partial + self.read(max(end - self.time, 0.0)))
            if (lines := [line for line in complete if line.strip()]) or self.time >= end:
                return [self._reply(line) for line in lines]

    def listen(self, patience: float, glance: float = GLANCE) -> Iterator[list[Reply]]:
        """The replies of one glance after the other ([] for none), until `patience` s have passed."""
        end = self.time + patience
        while self.time < end:
            yield self.replies(min(glance, end - self.time))

    @abstractmethod
    def ask(self, data: bytes) -> object:
        """Send something and wait until it is answered; each dialect has a way of its own."""

    @property
    def glance(self) -> float:
        """How long the machine is listened to at a time, s."""
        return min(GLANCE, self.timeout / 2)


def silence_error(seconds: str) -> DeviceSilent:
    """The error of a machine that has been silent for too long."""
    return DeviceSilent(
        f"The plotter has not answered for {seconds} s: check its cable and its power, and that it moves freely."
    )


def never_answered(language: str, patience: float, garbage: bool) -> DeviceSilent:
    """The error of a machine that cannot be met; garbage : something answers, but not in the language."""
    if garbage:
        return DeviceSilent(
            f"Something answers, but not as a {language} controller does: check baud and dialect in the profile."
        )
    return DeviceSilent(
        f"The plotter does not answer within {patience:g} s: is it switched on, is this its port, "
        "is the baud rate of the profile right?"
    )


def with_limits(profile: Plotter, limits: Mapping[str, float], log: Log) -> Limits:
    """The limits of a profile with those that the machine has told in their place; `log` is told where they differ."""
    for name, value in limits.items():
        expected = getattr(profile.limits, name)
        if abs(value - expected) > 1e-3 * max(abs(expected), abs(value)):
            log(f"{name.replace('_', ' ')}: the plotter's own {value:g} instead of the profile's {expected:g}.")
    return msgspec.structs.replace(profile.limits, **limits)


class BaseController(Controller):
    """The counts and habits of a `dialects.Controller`, whose words say what they mean.

    conversation : with the machine; its `patience` is the controller's.
    """

    conversation: Conversation[Any]
    silent = ""
    hurry: ClassVar[float]  # s to wait for an answer when something has gone wrong already

    def __init__(self, profile: Plotter, log: Log) -> None:
        self.profile, self.log = profile, log
        self.sent = self.taken = self.executed = 0
        self.queued: int | None = None
        self.listener: Callable[[StateReport], None] = ignore_report
        self.spoilt = False
        self._proven = 0

    @property
    def proven(self) -> int:
        """How many commands were executed when the machine was last found right."""
        return self._proven

    @property
    def earliest_arrival(self) -> float:
        """When it was listened to before, s by the port's clock."""
        return self.conversation.earliest_arrival

    @property
    def patience(self) -> float:
        """The patience of the conversation, s."""
        return self.conversation.patience

    @patience.setter
    def patience(self, seconds: float) -> None:
        self.conversation.patience = seconds

    def was_button_pressed(self) -> bool:
        """Never, without a button."""
        return False

    def _ask_all(self, lines: Iterable[bytes]) -> None:
        """Send lines one at a time, each when the one before is answered."""
        for line in lines:
            self.conversation.ask(line)

    def halt(self) -> None:
        """Stop and lift the pen; a signal that comes while it is lifted acts afterwards."""
        with signals.defer_signals():
            self.conversation.timeout = min(self.conversation.timeout, self.hurry)
            try:
                self._stop_and_lift()
            except DeviceError:
                self._pen_not_lifted()

    @abstractmethod
    def _stop_and_lift(self) -> None:
        """Stop as soon as the protocol allows, and lift the pen; signals are deferred."""

    def _pen_not_lifted(self) -> None:
        self.log("The pen could not be lifted and may stand on the paper: lift it by hand.")
